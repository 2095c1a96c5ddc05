"""Speed at which SKF's friction heats a bearing to 70 C in the thermal network, over the reference speed of the catalogue.

``python examples/benchmarks/reference_speeds.py`` takes a dozen NU bearings at the conditions of ISO 15312: 0.05 C0, ISO VG 32 in a
bath, outer ring at 70 C, surroundings at 20 C. No simulation runs. SKF's M_rr + M_sl arises half at each race, and the heat
leaves through the seats and the sump, with the default factors of [thermal].

The error is a factor of two, 0.5 to 2, and no finer claim is made. At the listed speeds SKF's own friction is 0.94 to 2.2 times the
heat of ISO 15312. Loss rises with about the 1.3th power of the speed, so the friction model alone moves the speed by 0.55 to
1.05. The seats add a factor of two on heat. ``--only 204,210`` takes some sizes.
"""

import argparse
import math
import statistics
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM
from rbdyn.contact.film_thickness import RollingContact
from rbdyn.life.friction import Running
from rbdyn.life.rollers import iso_15312_heat, skf_moments
from rbdyn.properties.catalogue import cage_estimate, envelope, read_designation, roller_interior
from rbdyn.properties.materials import MATERIALS, equivalent_modulus
from rbdyn.properties.oils import BASE_OILS, grade_oil
from rbdyn.scene.thermal import Thermal
from rbdyn.thermal.losses import TERMS, Effusivities, shares
from rbdyn.thermal.network import (
    INNER,
    OUTER,
    Boundaries,
    CageSize,
    Conductances,
    race_contact,
    seats,
    sump,
    surface_coefficient,
    surfaces,
    temperatures,
)

SIZES = ("204", "206", "208", "210", "215", "220", "308", "314", "320", "1020", "2210", "2312")
LOAD_SHARE = 0.05  # of C0
AMBIENT, REFERENCE = 20.0, 70.0  # [C]
GRADE = 32.0
CAGE_WIDTH = 0.95  # of the bearing's width
# Stated error of a speed: a factor.
ERROR = 2.0
# Largest roller load over the mean one F/Z of line contacts without clearance (Stribeck's sum for the exponent 10/9).
STRIBECK = 4.08
POSITIONS = 90
DEFAULTS = Thermal()


class Point(NamedTuple):
    """A bearing at one speed: its SKF power [W], its temperatures of oil, outer ring, inner ring, rollers [C]."""

    power: float
    temperatures: Array


class Row(NamedTuple):
    """Listed and computed speed [rad/s]; at the computed one the inner ring over the outer one [K]; SKF over ISO heat as listed."""

    listed: float
    computed: float
    rise_of_inner: float
    friction_over_heat: float

    @property
    def ratio(self) -> float:
        """Computed over listed speed."""
        return self.computed / self.listed


def point(name: str, speed: float, thermal: Thermal = DEFAULTS) -> Point:
    """The bearing of a designation at a speed [rad/s], under the conditions of ISO 15312, with factors of ``thermal``."""
    named = read_designation(name)
    sizes = envelope(named)
    assert sizes.static_capacity is not None
    inside = roller_interior(sizes, named.series == "10")
    roller, pitch, length = (
        1e-3 * size for size in (inside.roller_diameter, inside.pitch_diameter, inside.effective_length)
    )
    bore, outside, width = (1e-3 * size for size in (sizes.bore, sizes.outside, sizes.width))
    steel, brass = MATERIALS["bearing_steel"], MATERIALS["brass"]
    oil = grade_oil(GRADE, BASE_OILS["mineral"]).at_temperature(REFERENCE)
    radii = {"outer": 0.5 * (pitch + roller), "inner": 0.5 * (pitch - roller)}
    orbit = speed * radii["inner"] / pitch
    entrainment = (speed - orbit) * radii["inner"]

    load = LOAD_SHARE * sizes.static_capacity
    angles = np.arange(POSITIONS) * 2.0 * math.pi / POSITIONS
    zone = STRIBECK * load / inside.rollers * np.maximum(np.cos(angles), 0.0) ** (10.0 / 9.0)
    mass = steel.density * math.pi / 4.0 * roller**2 * 1e-3 * inside.roller_length
    loads = {"inner": zone, "outer": zone + mass * 0.5 * pitch * orbit**2}
    modulus = equivalent_modulus(steel, steel)

    def race(which: str) -> float:
        side = 1.0 if which == "inner" else -1.0
        contact = RollingContact(1.0 / (2.0 / roller + side / radii[which]), length, modulus, entrainment)
        # Each angle stands for a roller; the mean over them times the rollers is the race.
        return inside.rollers / POSITIONS * race_contact(loads[which], contact, oil, steel, steel)

    estimate = cage_estimate(
        named.series, sizes.width, inside.rollers, inside.roller_diameter, inside.roller_length, inside.pitch_diameter
    )
    half = 0.5e-3 * estimate.bar_thickness
    cage = CageSize(0.5 * pitch + half, 0.5 * pitch - half, CAGE_WIDTH * width)
    area = surfaces(
        (radii["outer"], radii["inner"]), width, inside.rollers, 0.5 * roller, 1e-3 * inside.roller_length, cage
    )
    film = surface_coefficient(oil, orbit, pitch)
    housing, shaft = seats(bore, outside, width)
    network = Conductances(
        flow=0.0,
        oil_outer=film * area.outer,
        oil_inner=film * area.inner,
        oil_rollers=film * (area.rollers + area.cage),
        outer_rollers=race("outer"),
        inner_rollers=race("inner"),
        outer_ambient=housing,
        inner_ambient=thermal.shaft_factor * shaft,
        sump=thermal.sump_factor * sump(outside, width),
    )
    running = Running(bore, outside, speed, oil.viscosity / oil.density, "bath")
    moments = skf_moments(named.series, running, load)
    rolling, sliding = moments.rolling * speed, moments.sliding * speed
    halves = {f"{race}_race_traction": 0.5 * sliding for race in ("outer", "inner")}
    halves |= {f"{race}_rolling_resistance": 0.5 * rolling for race in ("outer", "inner")}
    powers = np.array([halves.get(term, 0.0) for term in TERMS])
    heat = (
        shares(Effusivities(steel.effusivity, steel.effusivity, brass.effusivity), "outer", thermal.film_share_to_oil).T
        @ powers
    )
    return Point(rolling + sliding, temperatures(network, Boundaries(AMBIENT, AMBIENT), heat))


def row(name: str, thermal: Thermal = DEFAULTS) -> Row:
    """Speed at which the outer ring has 70 C, by bisection, since heat rises with speed."""
    sizes = envelope(read_designation(name))
    assert sizes.reference_speed is not None
    listed = sizes.reference_speed * RPM
    low, high = 0.05 * listed, 5.0 * listed
    while high - low > 1e-6 * listed:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if point(name, middle, thermal).temperatures[OUTER] < REFERENCE else (low, middle)
    hot = point(name, low, thermal).temperatures
    return Row(listed, low, float(hot[INNER] - hot[OUTER]), point(name, listed, thermal).power / iso_15312_heat(sizes))


def main() -> None:
    """Read the arguments and print a line a bearing."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default=",".join(SIZES), help="sizes, such as 204,210 (all)")
    asked = parser.parse_args()
    rows = {f"NU {size}": row(f"NU {size}") for size in asked.only.split(",")}
    print("| bearing | listed rpm | computed rpm | ratio | inner over outer ring K | SKF over ISO 15312 heat |")
    print("|---|---|---|---|---|---|")
    for name, found in rows.items():
        cells = (f"{found.listed / RPM:.0f}", f"{found.computed / RPM:.0f}", f"{found.ratio:.2f}")
        print(f"| {name} | {' | '.join(cells)} | {found.rise_of_inner:.1f} | {found.friction_over_heat:.2f} |")
    ratios = [found.ratio for found in rows.values()]
    inside = sum(1.0 / ERROR <= ratio <= ERROR for ratio in ratios)
    print(
        f"\nComputed over listed speed: median {statistics.median(ratios):.2f} ({min(ratios):.2f} to {max(ratios):.2f}); {inside} of "
        f"{len(ratios)} within the stated factor of {ERROR:g}."
    )


if __name__ == "__main__":
    main()
