"""The command ``rbdyn new``. Physics is imported inside it, so that help comes at once."""

import math
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.base.faults import LONGEST_NAME, InputError, MethodError, one_line, refuse
from rbdyn.base.options import Json, valued
from rbdyn.base.terminal import guarded, print_json

if TYPE_CHECKING:
    from rbdyn.properties.catalogue import Designation, Envelope
    from rbdyn.properties.oils import NamedOil

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
        from rbdyn.cli import new_scene
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
        point = new_scene.OperatingPoint(speed, load, preload, lubricant, temperature, wanted, supply)
        fill = new_scene.roller_values if rollers else new_scene.ball_values
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
    from rbdyn.cli.new_scene import mounting_values
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
