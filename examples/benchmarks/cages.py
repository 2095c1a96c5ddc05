"""The estimated cage of catalogue bearings: its mass compared with a maker's catalogue, the stiffness of its bars.

``python examples/benchmarks/cages.py`` prints, by series, the mass of the estimated brass cage over what the catalogue weighs
beyond rings and rollers, and for ten bearings the section, and the stiffness of a bar of brass and of polyamide with that of a
brass bar whose ends are clamped. Steel of the catalogue's bearings is that of plain rings with flanges; it is scaled, series by
series, so that bearings with polyamide cages have their mass, for the catalogue weighs chamfers and undercuts too.
"""

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbdyn.contact.cage_bar import CageSection, Elastic, bar_beam, bar_compliance, bar_stiffness
from rbdyn.properties.catalogue import (
    CageEstimate,
    Envelope,
    RollerInterior,
    cage_estimate,
    envelope,
    read_designation,
    roller_interior,
)

CATALOGUE = Path(__file__).resolve().parents[1] / "published" / "catalogue_masses.csv"
STEEL, BRASS, POLYAMIDE = 7.827e-6, 8.5e-6, 1.3e-6  # [kg/mm^3]
SERIES = ("10", "2", "22", "3", "23")
BARS = ("NU204", "NU208", "NU210", "NU215", "NU220", "NU308", "NU314", "NU320", "NU1020", "NU2210", "NU2220")


class Weighed(NamedTuple):
    """A bearing of the catalogue: whether its cage is of brass; mass, that of rings and rollers by their sizes [kg]; its cage."""

    brass: bool
    mass: float
    steel: float
    cage: CageEstimate


def cage_in(series: str, width: float, inside: RollerInterior) -> CageEstimate:
    """The estimated cage of a bearing."""
    sizes = inside.rollers, inside.roller_diameter, inside.roller_length, inside.pitch_diameter
    return cage_estimate(series, width, *sizes)


def bearings(series: str) -> Iterator[Weighed]:
    """Every bearing of a series in the catalogue."""
    lines = CATALOGUE.read_text(encoding="utf-8").splitlines()
    for row in csv.DictReader(line for line in lines if not line.startswith("#")):
        if row["size"][:-2] != series:
            continue
        known = {key: float(value) for key, value in row.items() if value and key not in ("size", "suffix")}
        bore, outside, width = known["bore"], known["outside"], known["width"]
        races = known["inner_raceway"], known.get("outer_raceway")
        inside = roller_interior(Envelope(bore, outside, width, 1.0, 1e3 * known["C0"], *races), series == "10")
        inner, outer = (inside.pitch_diameter + sign * inside.roller_diameter for sign in (-1.0, 1.0))
        # A plain inner ring, an outer one with flanges next to the rollers.
        squares = (inner**2 - bore**2 + outside**2 - outer**2) * width
        squares += (outer**2 - known["shoulder"] ** 2) * (width - inside.roller_length)
        squares += inside.rollers * inside.roller_diameter**2 * inside.roller_length
        steel = STEEL * 0.25 * math.pi * squares
        yield Weighed("M" in row["suffix"], known["mass"], steel, cage_in(series, width, inside))


def cage_over_catalogue(series: str) -> tuple[np.ndarray, float]:
    """Estimated over catalogue's mass of each brass cage of a series, and the scale of steel."""
    rows = list(bearings(series))
    light = [(row.mass - POLYAMIDE * row.cage.volume) / row.steel for row in rows if not row.brass]
    scale = float(np.median(light))
    ratios = [BRASS * row.cage.volume / (row.mass - scale * row.steel) for row in rows if row.brass]
    return np.array(ratios), scale


def masses() -> str:
    """Table of masses by series."""
    lines = ["| series | brass cages | steel scaled by | estimate over catalogue: median | 10 % to 90 % |"]
    lines.append("| --- | --- | --- | --- | --- |")
    for series in SERIES:
        ratios, scale = cage_over_catalogue(series)
        low, high = np.quantile(ratios, [0.1, 0.9])
        lines.append(f"| {series} | {ratios.size} | {scale:.3f} | {np.median(ratios):.2f} | {low:.2f} to {high:.2f} |")
    return "\n".join(lines)


def bars() -> str:
    """Table of sections and stiffnesses of bars."""
    lines = [
        "| bearing | bar, width x thickness x length, side ring [mm] | brass [N/m] | with clamped ends | polyamide |"
    ]
    lines.append("| --- | --- | --- | --- | --- |")
    brass, soft = Elastic(105e9, 0.34), Elastic(5e9, 0.35)
    for name in BARS:
        named = read_designation(name)
        sizes = envelope(named)
        inside = roller_interior(sizes, named.series == "10")
        cage, contact = cage_in(named.series, sizes.width, inside), 1e-3 * inside.effective_length
        lengths = cage.bar_width, cage.bar_thickness, cage.bar_length, cage.side_ring_width
        width, thickness, length, ring = (1e-3 * each for each in lengths)
        section = CageSection(width, thickness, length, ring, 1e-3 * inside.pitch_diameter, inside.rollers)
        clamped = 1.0 / bar_compliance(bar_beam(section, brass), contact, np.zeros((2, 2)))
        cells = bar_stiffness(section, brass, contact), clamped, bar_stiffness(section, soft, contact)
        shape = "{:.2f} x {:.2f} x {:.1f}, {:.2f}".format(*lengths)
        lines.append(f"| {named.name} | {shape} | {' | '.join(f'{each:.2g}' for each in cells)} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(f"{masses()}\n\n{bars()}")
