"""Notes on suspicious values of a scene: a probable slip of the unit, dimensions that contradict the stated designation."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Protocol

from rbdyn.base.faults import RPM
from rbdyn.base.notes import Note, Notes
from rbdyn.life.rollers import REFERENCE_SPEED
from rbdyn.mounting.cage import OperatingClearance
from rbdyn.properties.catalogue import Designation, Envelope, envelope, read_designation, roller_interior
from rbdyn.properties.materials import Material
from rbdyn.scene.bearing import Bearing, Cage
from rbdyn.scene.lubricant import Lubricant
from rbdyn.scene.operation import Mounting
from rbdyn.scene.thermal import Thermal

# A key, its value or None, and its usual range.
Usual = tuple[str, float | None, tuple[float, float]]
# Factor from another unit, by the unit of a key; kelvin are shifted.
FACTORS = {
    "mm": {"m": 1e3, "um": 1e-3},
    "um": {"mm": 1e3, "nm": 1e-3},
    "g": {"kg": 1e3},
    "kg_mm2": {"kg m2": 1e6, "g mm2": 1e-3},
    "mPas": {"Pa s": 1e3},
    "1_GPa": {"1/Pa": 1e9, "1/MPa": 1e3},
    "N_m": {"N/um": 1e6, "N/mm": 1e3},
    "l_min": {"mL/min": 1e-3},
    "deg": {"rad": 180.0 / math.pi},
}
ZERO_C_K = 273.15
# Usual temperatures. Ester oils endure about 200 C and stiffen towards -54 C; bearing steels lose hardness above 300 C.
OIL_C, RING_C = (-60.0, 220.0), (-60.0, 300.0)


# Surroundings in kelvin are above the hottest usual ones in C, those of a hot engine.
AMBIENT_C = (-60.0, 210.0)
# Largest usual flow of oil over D B/12 500 L/min, D and B in mm, above which it hardly cools further (SKF). The jets of fast bearings
# have 10 to 20 times that; a flow in mL/min would be 1000 times too large.
LARGEST_FLOW = 300.0 / 12_500.0
# Usual pressure coefficient [1/GPa]: below 1 for water, 60 for the thickest mineral oils in the cold.
PRESSURE_COEFFICIENT = (2.0, 80.0)
# Usual contact angles [deg]: from 12 to 60 on drawings, with room to both sides; one in radians is at most 1.3.
CONTACT_ANGLE = (2.0, 75.0)
# Stiffness of a bar over modulus times roller length: 0.005 for slender bars, 0.3 for stubby ones, by the finite elements of
# tests/oracle/test_cage_bar.py; a factor of forty to each side allows for another material.
BAR_STIFFNESS = (1e-4, 20.0)


class DrawnRow(Protocol):
    """Sizes of a row of balls that may be in another unit."""

    contact_angle_deg: float | None
    radial_clearance_mm: float | None
    pitch_diameter_mm: float


def unit_notes(
    bearing: Bearing,
    cage: Cage,
    oil: Lubricant,
    mounting: Mounting | None,
    cage_material: Material,
    bar_stiffness: float | str,
) -> Notes:
    """One sentence for each suspicious value.

    ``cage_material``: its density gives a usual mass of the cage, its modulus a usual stiffness of bars; ``bar_stiffness`` [N/m]
    or "rigid".
    """
    usual = [*_of_cage(bearing, cage, cage_material, bar_stiffness), *_of_section(bearing, cage)]
    usual.append(_of_clearance("bearing", bearing.radial_clearance_mm, bearing.pitch_diameter_mm))
    return _notes([*usual, *_of_oil(oil), *_of_mounting(mounting)])


def ball_unit_notes(rows: Mapping[str, DrawnRow], oil: Lubricant | None, mounting: Mounting | None) -> Notes:
    """One sentence for each suspicious value of a ball bearing; ``rows`` by the name of their table."""
    usual = list[Usual]()
    for table, row in rows.items():
        usual.append((f"{table}.contact_angle_deg", row.contact_angle_deg or None, CONTACT_ANGLE))
        usual.append(_of_clearance(table, row.radial_clearance_mm or 0.0, row.pitch_diameter_mm))
    return _notes([*usual, *([] if oil is None else _of_oil(oil)), *_of_mounting(mounting)])


def _of_clearance(table: str, clearance_mm: float, pitch_mm: float) -> Usual:
    """A diametral clearance: the least is below any tolerance grade, the largest several times the loosest class."""
    return f"{table}.radial_clearance_mm", max(clearance_mm, 0.0) or None, (5e-4, 5e-3 * pitch_mm)


def _of_oil(oil: Lubricant) -> list[Usual]:
    """Values of the lubricant, with their usual ranges."""
    return [
        ("lubricant.roller_roughness_um", oil.roller_roughness_um, (3e-3, 5.0)),
        ("lubricant.race_roughness_um", oil.race_roughness_um, (3e-3, 5.0)),
        ("lubricant.viscosity_mPas", oil.viscosity_mPas, (0.3, 1e5)),
        ("lubricant.pressure_coefficient_1_GPa", oil.pressure_coefficient_1_GPa, PRESSURE_COEFFICIENT),
        ("lubricant.temperature_C", oil.temperature_C, OIL_C),
    ]


def _of_mounting(mounting: Mounting | None) -> list[Usual]:
    """Temperatures of parts, with their usual range."""
    temperatures = {} if mounting is None else mounting.model_dump()
    return [(f"mounting.{key}", value, RING_C) for key, value in temperatures.items() if key.endswith("_C")]


def heat_notes(thermal: Thermal, oil: Lubricant, mounting: Mounting, width: float) -> Notes:
    """One sentence for each suspicious value of a heat balance with rings of a ``width`` [m]."""
    outside, wide = mounting.outside_diameter_mm, 1e3 * width
    return _notes(
        [
            ("thermal.ambient_C", thermal.ambient_C, AMBIENT_C),
            ("lubricant.oil_inlet_temperature_C", oil.oil_inlet_temperature_C, OIL_C),
            ("lubricant.oil_flow_l_min", oil.oil_flow_l_min, (0.0, LARGEST_FLOW * outside * wide)),
            ("mounting.width_mm", wide, (0.0, outside)),
        ]
    )


def _notes(usual: Iterable[Usual]) -> Notes:
    """The sentences on values outside their usual range."""
    return tuple(
        _note(key, value, *ends) for key, value, ends in usual if value is not None and not ends[0] <= value <= ends[1]
    )


def _of_cage(bearing: Bearing, cage: Cage, material: Material, bar_stiffness: float | str) -> list[Usual]:
    """Values of a cage and the stiffness of its bars, with their usual ranges."""
    pitch, roller, length = bearing.pitch_diameter_mm, bearing.roller_diameter_mm, bearing.roller_length_mm
    mass_g = 1e-6 * material.density * math.pi * pitch * 0.5 * roller * (length + cage.lands * cage.land_width_mm)
    inertia = 1e-3 * mass_g * (0.5 * pitch) ** 2
    guide = None if cage.guidance == "roller" else cage.guide_clearance_mm
    stiff = material.elastic_modulus * 1e-3 * length
    bar = None if isinstance(bar_stiffness, str) else bar_stiffness
    return [
        ("cage.guide_clearance_mm", guide, (5e-4, 0.03 * pitch)),
        ("cage.pocket_clearance_mm", cage.pocket_clearance_mm, (5e-4, 0.25 * roller)),
        ("cage.mass_g", cage.mass_g, (mass_g / 20.0, mass_g * 20.0)),
        ("cage.inertia_kg_mm2", cage.inertia_kg_mm2, (inertia / 20.0, inertia * 20.0)),
        ("model.pocket_bar_stiffness_N_m", bar, (BAR_STIFFNESS[0] * stiff, BAR_STIFFNESS[1] * stiff)),
    ]


def _of_section(bearing: Bearing, cage: Cage) -> list[Usual]:
    """Sizes of the section of a cage, with their usual ranges."""
    roller, length = bearing.roller_diameter_mm, bearing.roller_length_mm
    return [
        (
            "cage.bar_width_mm",
            cage.bar_width_mm,
            (0.02 * roller, math.pi * bearing.pitch_diameter_mm / bearing.rollers),
        ),
        ("cage.bar_thickness_mm", cage.bar_thickness_mm, (0.02 * roller, roller)),
        ("cage.bar_length_mm", cage.bar_length_mm, (length, 2.0 * length)),
        ("cage.side_ring_width_mm", cage.side_ring_width_mm, (0.02 * length, 2.0 * length)),
    ]


def _note(key: str, value: float, low: float, high: float) -> Note:
    """The sentence on a value outside its usual range, with the probable unit."""
    unit = next((unit for unit in FACTORS if key.endswith(f"_{unit}")), "")
    candidates = {other: factor * value for other, factor in FACTORS.get(unit, {}).items()}
    candidates |= {"K": value - ZERO_C_K} if key.endswith("_C") else {}
    likely = {other: number for other, number in candidates.items() if low <= number <= high}
    other = _nearest(likely, low, high)
    fix = "check its unit" if other is None else f"if {value:g} {other} are meant, write {likely[other]:.4g}"
    return Note("unit", f"{key} = {value:g}: is outside the usual {low:.3g} to {high:.3g}; {fix}")


def _nearest(likely: Mapping[str, float], low: float, high: float) -> str | None:
    """The likely unit whose number is nearest to the middle of the range; None without a likely unit."""
    if len(likely) < 2:
        return next(iter(likely), None)
    return min(likely, key=lambda other: abs(math.log(likely[other] ** 2 / (low * high))))


# Share of a drawn clearance below which its rest in operation counts as nearly lost, and that below which a cage is to be looked at:
# the temperatures that take it are known within some 10 K, and so are the parts of a sum of changes.
NEARLY_LOST, MOSTLY_LOST = 0.1, 0.5
# Speeds over the reference speed, of bearings by designation: limiting speeds of a catalogue are 1 to 1.5 times it. Of others the
# product of speed and pitch diameter [m/s]: usual ones at their reference speed twice over, and the 3 million mm/min up to which
# special bearings were tested.
FAST_LISTED, FAST_USUAL, FASTEST = (1.0, 2.0), 2.0, 3.0e3 * RPM


def clearance_notes(
    clearances: Mapping[str, OperatingClearance | None], floors: Mapping[str, float] | None = None
) -> Iterator[Note]:
    """Notes on diametral ``clearances`` [m], by name, that are negative, nearly lost or, of a cage, mostly lost in operation.

    ``floors`` [m]: what must be left of each, minus infinity of one that may become a preload; a tenth of the drawn clearance where
    there is none.
    """
    for name, play in clearances.items():
        if play is None:
            continue
        lost = play.operating < (floors or {}).get(name, NEARLY_LOST * max(play.drawn, 0.0))
        preloads = play.operating < 0.0 <= play.drawn and not lost
        if not (lost or preloads) and (name == "radial" or play.operating >= MOSTLY_LOST * play.drawn):
            continue
        subject, effect = "seizure: " if lost else "", "all results include this preload; " if preloads else ""
        sentence = (
            f"{subject}{name} clearance in operation is {1e6 * play.operating:.1f} um of {1e6 * play.drawn:.1f} um: fits "
            f"{1e6 * play.fit:+.1f}, temperature {1e6 * play.temperature:+.1f}, rotation {1e6 * play.rotation:+.1f} um; {effect}widen it or "
            "check the temperatures"
        )
        yield Note("seizure" if lost else "clearance", sentence)


def speed_notes(speed: float, pitch_diameter: float, reference: float | None, usual: float = REFERENCE_SPEED) -> Notes:
    """A note on a ``speed`` above the ``reference`` speed [rad/s] of a listed bearing, or far above that of a usual one.

    ``usual``: reference speed times pitch diameter [m/s] of such bearings.
    """
    name = "reference speed"
    if reference is not None:
        fast, limit = (factor * reference for factor in FAST_LISTED)
    else:
        fast, limit = FAST_USUAL * usual / pitch_diameter, FASTEST / pitch_diameter
        name = "usual reference speed"
    speed = abs(speed)
    if speed <= fast:
        return ()
    base = reference or usual / pitch_diameter
    sentence = f"{speed / RPM:.0f} rpm is {speed / base:.2g} times the {name} of {base / RPM:.0f} rpm"
    if speed <= limit:
        return (
            Note(
                "fast", f"speed: {sentence}, so the bearing needs more cooling than usual; check the heat by [thermal]"
            ),
        )
    beyond = "every limiting speed of a catalogue" if reference is not None else "the fastest tests of special bearings"
    return (Note("overspeed", f"overspeed: {sentence}, beyond {beyond}; reduce the speed or take a smaller bearing"),)


# Relative tolerances of sizes in the catalogue, of an estimated roller (series 10 within 10 %) and of its pitch circle.
LISTED, ROLLER, PITCH = 0.01, 0.12, 0.01


def catalogue_entry(bearing: Bearing) -> tuple[Designation, Envelope] | None:
    """The designation of a bearing with its catalogue sizes; None where the scene states none."""
    if bearing.designation is None:
        return None
    designation = read_designation(bearing.designation)
    return designation, envelope(designation)


def catalogue_notes(bearing: Bearing, mounting: Mounting | None) -> Notes:
    """One note on all dimensions that contradict the catalogue; none where the scene states no designation."""
    entry = catalogue_entry(bearing)
    if entry is None:
        return ()
    designation, sizes = entry
    interior = roller_interior(sizes, designation.series == "10")
    both = sizes.inner_raceway is not None and sizes.outer_raceway is not None
    pairs = [
        ("bearing.pitch_diameter_mm", bearing.pitch_diameter_mm, interior.pitch_diameter, LISTED if both else PITCH),
        (
            "bearing.roller_diameter_mm",
            bearing.roller_diameter_mm,
            interior.roller_diameter,
            LISTED if both else ROLLER,
        ),
    ]
    if mounting is not None:
        pairs += [
            ("mounting.bore_mm", mounting.bore_mm, sizes.bore, LISTED),
            ("mounting.outside_diameter_mm", mounting.outside_diameter_mm, sizes.outside, LISTED),
        ]
    differences = [
        f"{key} = {value:g} ({expected:g})"
        for key, value, expected, error in pairs
        if value is not None and abs(value - expected) > error * expected
    ]
    if bearing.roller_length_mm > sizes.width:
        differences.append(
            f"bearing.roller_length_mm = {bearing.roller_length_mm:g} (below {sizes.width:g}, the width)"
        )
    if not differences:
        return ()
    return (
        Note(
            "designation",
            f"bearing.designation = {bearing.designation!r}: its catalogue sizes disagree with {', '.join(differences)}; "
            "correct the designation or these keys",
        ),
    )
