"""A scene of a catalogue bearing or of one's own: estimates of what no catalogue lists, mounting, oil and cage."""

import json
import math
from typing import Any, NamedTuple

from rbdyn.life.rollers import REFERENCE_SPEED_FACTOR
from rbdyn.properties.catalogue import (
    CAGES,
    SMALLEST_CLEARANCE_MM,
    Designation,
    Envelope,
    RollerInterior,
    ball_interior,
    cage_estimate,
    radial_clearance,
    roller_interior,
)
from rbdyn.properties.materials import MATERIALS
from rbdyn.properties.oils import NamedOil
from rbdyn.properties.tolerances import Interference, housing_interference, shaft_interference

# Classes for a load that stands still on an inner ring that turns, where only the other seat is stated.
USUAL_SHAFT, USUAL_HOUSING = "k5", "H7"
# Outer diameter of the housing over that of the bearing; rise of inner ring and rollers above the outer ring [K] (NTN, NSK).
HOUSING_SHARE, INNER_RISE = 1.5, 7.5
# By how much of the inner ring's rise above its drawing, at 20 C, the shaft stays below it: 0.10 to 0.15 (NSK).
SHAFT_LAG, DRAWING = 0.125, 20.0
NONE = dict.fromkeys(
    ("shaft_by", "housing_by", "mounted_bore", "mounted_outside", "housing_diameter", "inner_temperature", "shaft_temperature",
     "outer_temperature", "inner_interference", "inner_fit_by", "outer_interference", "outer_fit_by", "inner_law", "outer_law")
)  # fmt: skip


def mounting_values(sizes: Envelope, shaft: str | None, housing: str | None, temperature: float) -> dict[str, Any]:
    """Values of the templates for the classes of shaft and housing, and the temperature of the oil [C].

    None of them where neither class is stated. Raises MethodError as ``shaft_interference``.
    """
    loose: dict[str, Any] = {"loose_bore": sizes.bore, "loose_outside": sizes.outside, "estimated_mounting": ""}
    if shaft is None and housing is None:
        return {**NONE, **loose}
    inner = shaft_interference(sizes.bore, shaft or USUAL_SHAFT)
    outer = housing_interference(sizes.outside, housing or USUAL_HOUSING)
    warm = temperature + INNER_RISE
    return {
        **dict.fromkeys(loose),
        "estimated_mounting": ',\n    "mounting.inner_ring_temperature_C"',
        "shaft_by": f"shaft {shaft or f'{USUAL_SHAFT} (not stated, usual)'}",
        "housing_by": f"housing {housing or f'{USUAL_HOUSING} (not stated, usual)'}",
        "mounted_bore": sizes.bore,
        "mounted_outside": sizes.outside,
        "housing_diameter": round(HOUSING_SHARE * sizes.outside, 1),
        "outer_temperature": temperature,
        "inner_temperature": warm,
        "shaft_temperature": round(warm - SHAFT_LAG * (warm - DRAWING), 1),
        "inner_interference": round(inner.mean, 2) + 0.0,
        "inner_fit_by": _reason(inner),
        "inner_law": _law(inner),
        "outer_interference": round(outer.mean, 2) + 0.0,
        "outer_fit_by": _reason(outer),
        "outer_law": _law(outer),
    }


def _reason(fit: Interference) -> str:
    less = f", less {fit.smoothing:.3g} of smoothing" if fit.smoothing else ""
    return f"mean of {fit.low + fit.smoothing:.3g} to {fit.high + fit.smoothing:.3g}{less}; negative is loose"


def _law(fit: Interference) -> str | None:
    """Law of an interference; None where all of the fits are loose and none has any effect."""
    if fit.high <= 0.0:
        return None
    numbers = f"mean = {fit.mean + 0.0:.2f}, sd = {fit.sd:.2f}, low = {fit.low:.2f}, high = {fit.high:.2f}"
    return f'{{ law = "normal", {numbers}, kind = "varies" }}'


# Glass-filled polyamide as [materials] takes it, and its density [g/mm^3].
POLYAMIDE = (
    "{ elastic_modulus_GPa = 5.0, poisson_ratio = 0.35, density_kg_m3 = 1300.0, thermal_expansion_1e_6_K = 40.0 }"
)
POLYAMIDE_DENSITY = 1.3e-3
# Where no suffix names a cage.
USUAL_CAGE = "MA"
# Guide clearance in pitch diameters.
GUIDE_CLEARANCE = 0.004
# Half-widths at which the oil begins unless a jet floods the inlet; share of oil in the cavity, less where little oil enters.
INLET_DISTANCE, FLOODED_SUPPLIES = 5.0, ("jet",)
OIL_FRACTION, SCARCE_FRACTION, SCARCE_SUPPLIES = 0.02, 0.005, ("drop", "oil_air", "grease")
SUPPLY_WORDS = {
    "bath": "oil bath", "drop": "drop feed", "jet": "oil jet", "oil_air": "oil and air", "grease": "grease, its base oil above"
}  # fmt: skip
# Axial over radial load, by tan(contact angle), that loads half of the balls (NSK).
HALF_LOADED = 1.216
# Reference speed times pitch diameter of ball bearings, as usual in catalogues, within 20 % [mm/min].
BALL_SPEEDS = {"deep_groove_ball": 1.0e6, "angular_contact_ball": 6.3e5}
# Of the reference speed and of C, where the user gives nothing.
USUAL_SPEED, USUAL_LOAD, USUAL_PRELOAD = 0.5, 0.1, 0.01


# Of a template, by the names in it.
Values = dict[str, Any]


class OperatingPoint(NamedTuple):
    """What the user asks for; None where it is left to this module."""

    speed: float | None
    load: float | None
    preload: float | None
    oil: NamedOil
    temperature: float
    clearance: str
    supply: str = "bath"


def roller_values(named: Designation, sizes: Envelope, point: OperatingPoint) -> Values:
    """Values of ``roller_scene.toml``. Raises ValueError for impossible dimensions or an unlisted clearance."""
    from rbdyn.life.rollers import dynamic_capacity

    inside = roller_interior(sizes, named.series == "10")
    diameter, pitch, listed = inside.roller_diameter, inside.pitch_diameter, sizes.dynamic_capacity
    by_iso = dynamic_capacity(inside.rollers, diameter * 1e-3, inside.effective_length * 1e-3, pitch * 1e-3)
    volume = math.pi / 4.0 * (pitch - diameter) ** 2 * sizes.outside
    ratings = "" if listed is None else f", C = {1e-3 * listed:g} kN, C0 = {1e-3 * (sizes.static_capacity or 0.0):g} kN"
    common = _common(named, sizes, point, sizes.reference_speed or REFERENCE_SPEED_FACTOR / pitch, listed or by_iso)
    flooded, scarce = point.supply in FLOODED_SUPPLIES, point.supply in SCARCE_SUPPLIES
    return {
        **inside._asdict(),
        **common,
        **_clearance(sizes.bore, point.clearance, named.kind),
        **_cage(named, sizes.width, inside),
        "ratings": ratings,
        "ring_mass": 1e-9 * MATERIALS["bearing_steel"].density * volume,
        "listed_capacity": listed,
        "capacity_share": by_iso / (listed or by_iso),
        # Sizes that are typed are those of no listed bearing.
        "designation": json.dumps(named.name) if sizes.reference_speed is not None else None,
        "supply": json.dumps(point.supply),
        "supply_by": SUPPLY_WORDS[point.supply],
        "inlet_distance": None if flooded else INLET_DISTANCE,
        "oil_fraction": SCARCE_FRACTION if scarce else OIL_FRACTION,
        "oil_fraction_by": "0.001 to 0.02 where little oil enters" if scarce else "0.005 to 0.1",
    }


def ball_values(named: Designation, sizes: Envelope, point: OperatingPoint) -> Values:
    """Values of ``ball_scene.toml``. Raises ValueError as ``roller_values``."""
    from rbdyn.life.balls import dynamic_capacity

    inside = ball_interior(sizes, named)
    deep, angle = inside.contact_angle is None, math.radians(inside.contact_angle or 0.0)
    capacity = dynamic_capacity(inside.balls, inside.ball_diameter * 1e-3, inside.pitch_diameter * 1e-3, angle)
    common = _common(named, sizes, point, BALL_SPEEDS[named.kind] / inside.pitch_diameter, capacity)
    preload, why = point.preload, ""
    if preload is None and not deep:
        preload = float(f"{max(USUAL_PRELOAD * capacity, HALF_LOADED * common['load'] * math.tan(angle)):.2g}")
        why = "assumed: loads half of the balls, 1.216 F_r tan(contact angle), or 0.01 C"
    known = _clearance(sizes.bore, point.clearance, named.kind) if deep else dict.fromkeys(CLEARANCE_VALUES)
    return {**inside._asdict(), **common, **known, "preload": preload, "preload_by": why}


def _common(named: Designation, sizes: Envelope, point: OperatingPoint, reference: float, capacity: float) -> Values:
    """What both kinds of bearing have: name, boundary dimensions, oil, speed [rpm] and load [N]; no mounting."""
    error = 9 if named.kind == "cylindrical_roller" else 20
    oil, base, grease = point.oil
    speed, load = point.speed, point.load
    speed = float(f"{USUAL_SPEED * reference:.2g}") if speed is None else speed
    load = float(f"{USUAL_LOAD * capacity:.2g}") if load is None else load
    return {
        "name": named.name,
        "without_effect": named.without_effect or None,
        "kind": named.kind,
        "bore": sizes.bore,
        "outside": sizes.outside,
        "width": sizes.width,
        "oil": oil,
        "oil_by": "base oil of the grease" if grease else "",
        "base_oil": (base or "mineral") if oil.startswith("ISO VG") else None,
        "base_oil_by": "" if base else "assumed; or naphthenic, PAO, ester, PAG",
        "temperature": point.temperature,
        "speed": speed,
        "speed_by": "assumed: half of the " if point.speed is None else "",
        "reference": f"{reference:g} rpm, catalogue"
        if reference == sizes.reference_speed
        else f"about {round(reference, -2):.0f} rpm, +-{error} %",
        "load": load,
        "load_by": "assumed: " if point.load is None else "",
        "load_share": load / capacity,
        **mounting_values(sizes, None, None, point.temperature),
    }


CLEARANCE_VALUES = ("clearance", "clearance_class", "lower", "upper")


def _clearance(bore: float, name: str, kind: str) -> Values:
    lower, upper = (1e-3 * limit for limit in radial_clearance(bore, name, kind))
    return dict(zip(CLEARANCE_VALUES, (round(0.5 * (lower + upper), 4), name, lower, upper), strict=True))


def _cage(named: Designation, width: float, inside: RollerInterior) -> Values:
    """A cage of the kind that the suffix names, about the pitch circle."""
    suffix = named.stated("cage")
    guidance, material = CAGES[suffix or USUAL_CAGE]
    soft, landed = material == "polyamide", guidance != "roller"
    density = POLYAMIDE_DENSITY if soft else 1e-6 * MATERIALS[material].density
    sizes = inside.rollers, inside.roller_diameter, inside.roller_length, inside.pitch_diameter
    cage = cage_estimate(named.series, width, *sizes)
    guide = max(round(GUIDE_CLEARANCE * inside.pitch_diameter, 2), SMALLEST_CLEARANCE_MM)
    return {
        **cage._asdict(),
        "cage_by": f"{f'of suffix {suffix}' if suffix else 'assumed'}: {material}, guided by the {guidance}{' ring' if landed else 's'}",
        "guidance": guidance,
        "guide_clearance": guide if landed else None,
        "cage_mass": cage.volume * density,
        "land_width": round(cage.side_ring_width, 2) if landed else None,
        "cage_material": POLYAMIDE if soft else json.dumps(material),
    }
