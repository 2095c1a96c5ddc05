"""``rbdyn new``: a scene of a catalogue bearing or of one's own, with mounting, oil and cage, from a template."""

import json
import math
import tomllib
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import typer

from rbdyn.base.faults import LONGEST_NAME, InputError, MethodError, one_line, refuse
from rbdyn.base.options import Json, valued
from rbdyn.base.terminal import guarded, print_json
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


TEMPERATURE_C, OIL, CLEARANCE = 70.0, "ISO VG 68", "CN"
LISTED = "as listed"
# Limits of a number that is typed, and its unit.
LIMITS = {
    "--speed": (-1e6, 1e6, "rpm"),
    "--load": (0.0, 1e7, "N"),
    "--preload": (-1e8, 1e8, "N"),
    "--temperature": (-60.0, 220.0, "C"),
    "--bore": (1.0, 2000.0, "mm"),
    "--outside": (2.0, 4000.0, "mm"),
    "--width": (0.5, 1000.0, "mm"),
}


def new(
    designation: Annotated[
        list[str], typer.Argument(metavar="DESIGNATION", help="Bearing: NU210, NU 1010 M, 6208 C3, 7208B.")
    ],
    speed: Annotated[float | None, valued("RPM", "Speed of the inner ring.", "half the reference speed")] = None,
    load: Annotated[float | None, valued("N", "Radial load.", "0.1 C")] = None,
    preload: Annotated[
        float | None, valued("N", "Axial preload of a ball bearing.", "what loads half of the balls")
    ] = None,
    oil: Annotated[
        str, typer.Option(metavar="NAME", help='"ISO VG 32 PAO", "grease VG 100", 23699, "Jet Oil II".')
    ] = OIL,
    temperature: Annotated[float, typer.Option(metavar="C", help="Temperature of the oil.")] = TEMPERATURE_C,
    clearance: Annotated[str | None, valued("CLASS", "C2, CN, C3, C4 or C5.", "of DESIGNATION, else CN")] = None,
    lubrication: Annotated[
        str | None, valued("HOW", "bath, drop, jet, oil_air or grease.", "bath, or grease where --oil is one")
    ] = None,
    bore: Annotated[float | None, valued("MM", "Bore, where the table lacks the bearing.", LISTED)] = None,
    outside: Annotated[float | None, valued("MM", "Outside diameter.", LISTED)] = None,
    width: Annotated[float | None, valued("MM", "Width.", LISTED)] = None,
    shaft: Annotated[
        str | None, valued("CLASS", "Tolerance class of the shaft: k5. Writes the table mounting.", "loose")
    ] = None,
    housing: Annotated[
        str | None, valued("CLASS", "Tolerance class of the housing: H7. Writes the table mounting.", "loose")
    ] = None,
    as_json: Json = False,
) -> None:
    """Write a commented scene of a catalogue bearing, its interior estimated, on standard output."""
    with guarded(as_json):
        from rbdyn.base.options import filled
        from rbdyn.properties.catalogue import read_designation
        from rbdyn.properties.oils import oil_named
        from rbdyn.scene import Scene

        words, sizes = " ".join(designation), {"--bore": bore, "--outside": outside, "--width": width}
        numbers = {"--speed": speed, "--load": load, "--preload": preload, "--temperature": temperature, **sizes}
        faults = [fault for name, value in numbers.items() if value is not None and (fault := _fault(name, value))]
        lubricant, named = _read(oil_named, "--oil", oil, faults), _read(read_designation, "DESIGNATION", words, faults)
        chosen = None if clearance is None else _read(_class_named, "--clearance", clearance, faults)
        refuse(faults)
        assert lubricant is not None and named is not None
        rollers = named.kind == "cylindrical_roller"
        refuse(_misfits(named, speed, preload, chosen))
        wanted = chosen or named.stated("clearance") or CLEARANCE
        supply = _supply(lubrication, lubricant, oil, rollers)
        point = OperatingPoint(speed, load, preload, lubricant, temperature, wanted, supply)
        fill = roller_values if rollers else ball_values
        box = _read(lambda text: _envelope(named, sizes), "DESIGNATION", words, faults)
        inside: Any = None if box is None else _read(lambda text: fill(named, box, point), "DESIGNATION", words, faults)
        refuse(faults)
        values = inside | _mounting(box, shaft, housing, temperature)
        template = Path(__file__).with_name("roller_scene.toml" if rollers else "ball_scene.toml")
        text = filled(template.read_text(encoding="utf-8"), values)
        data = tomllib.loads(text)
        # What is wrong with an estimate comes from the sizes that were given.
        typed = " ".join(f"{option} {value:g}" for option, value in sizes.items() if value is not None)
        source = f"{typed}: estimated inside" if typed else f"DESIGNATION {named.name}"
        notes = getattr(Scene.from_dict(data, source), "unit_notes", ())
        refuse(f"{source}: {note}" for note in notes)
        if as_json:
            print_json(data)
        else:
            print(text)


def _mounting(sizes: "Envelope", shaft: str | None, housing: str | None, temperature: float) -> dict[str, Any]:
    """Values of [mounting], none of them without a class. Raises InputError for a class or a size that is not listed."""
    from rbdyn.properties.tolerances import housing_interference, shaft_interference

    faults = list[str]()
    if shaft is not None:
        _read(lambda zone: shaft_interference(sizes.bore, zone), "--shaft", shaft, faults)
    if housing is not None:
        _read(lambda zone: housing_interference(sizes.outside, zone), "--housing", housing, faults)
    refuse(faults)
    return mounting_values(sizes, shaft, housing, temperature)


def _fault(option: str, value: float) -> str | None:
    least, largest, unit = LIMITS[option]
    if not math.isfinite(value):
        return f"{option} {value}: is not a finite number; write a plain number"
    if least <= value <= largest:
        return None
    kelvin = value - 273.15
    meant = unit == "C" and least <= kelvin <= largest
    remedy = f"if {value:g} K are meant, write {kelvin:.4g}" if meant else "fix it"
    return f"{option} {value:g}: must be from {least:g} to {largest:g} {unit}; {remedy}"


def _read(reader: Any, name: str, text: str, faults: list[str]) -> Any:
    """What ``reader`` makes of a text; None, and one more fault, where it refuses it."""
    try:
        return reader(text)
    except MethodError as error:
        faults.append(f"{name} {one_line(text, LONGEST_NAME)}: {error}")
        return None


def _class_named(text: str) -> str:
    """A clearance class as the tables name it. Raises MethodError."""
    from rbdyn.properties.catalogue import CLEARANCE_CLASSES

    name = text.strip().upper()
    if name not in CLEARANCE_CLASSES:
        raise MethodError(f"is no clearance class; choose one of {', '.join(CLEARANCE_CLASSES)}")
    return name


def _supply(asked: str | None, oil: "NamedOil", oil_text: str, rollers: bool) -> str:
    """How the bearing gets its oil, as asked for or as the oil says. Raises InputError for what contradicts the oil."""
    from rbdyn.scene.lubricant import SUPPLIES

    usual = "grease" if oil.grease else "bath"
    if asked is None:
        return usual
    supply = asked.strip().lower().replace("-", "_")
    what, name = f"--lubrication {one_line(asked, LONGEST_NAME)}", one_line(oil_text, LONGEST_NAME)
    if supply not in SUPPLIES:
        raise InputError([f"{what}: is no lubrication known here; choose one of {', '.join(SUPPLIES)}"])
    if not rollers:
        raise InputError([f"{what}: is one of cylindrical roller bearings; leave it out"])
    if oil.grease and supply != "grease":
        raise InputError([f"{what}: contradicts the grease of --oil {name}; leave one out"])
    if supply == "grease" and not oil.grease:
        raise InputError([f'{what}: --oil {name} is no grease; write --oil "grease VG 100" with its base oil'])
    return supply


def _misfits(named: "Designation", speed: float | None, preload: float | None, clearance: str | None) -> list[str]:
    """Options that the bearing has no use for, or that contradict its designation."""
    faults, rollers, of_suffix = [], named.kind == "cylindrical_roller", named.stated("clearance")
    if rollers and speed is not None and abs(speed) < 0.1:
        faults.append(f"--speed {speed:g}: a run is counted in shaft turns; give at least 0.1")
    if rollers and preload is not None:
        faults.append(f"--preload {preload:g}: is one of ball bearings; leave it out")
    angular = "an angular contact bearing has a contact angle instead; leave it out"
    if named.kind == "angular_contact_ball" and clearance is not None:
        faults.append(f"--clearance {clearance}: {angular}")
    elif clearance is not None and of_suffix not in (None, clearance):
        faults.append(f"--clearance {clearance}: contradicts {of_suffix} of {named.name}; leave one out")
    if named.kind == "angular_contact_ball" and of_suffix is not None:
        faults.append(f"DESIGNATION {named.name}: suffix {of_suffix}: {angular}")
    return faults


def _envelope(named: "Designation", sizes: dict[str, float | None]) -> "Envelope":
    """Boundary dimensions as typed or as the catalogue lists them. Raises MethodError, InputError."""
    from rbdyn.properties.catalogue import Envelope, envelope

    given = [value for value in sizes.values() if value is not None]
    if not given:
        return envelope(named)
    if len(given) < len(sizes):
        missing = ", ".join(option for option, value in sizes.items() if value is None)
        raise InputError([f"{missing}: missing; give all of {', '.join(sizes)} in mm, or none for a listed bearing"])
    if given[0] >= given[1]:
        raise InputError([f"--bore {given[0]:g}: not below --outside {given[1]:g}; fix them"])
    return Envelope(*given)
