"""The command ``rbdyn new``. Physics is imported inside it, so that help comes at once."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import typer

from rbdyn.base.command import ForceFile, Json, OutFile, guarded, hand_out, valued
from rbdyn.base.faults import LONGEST_NAME, InputError, MethodError, one_line, refuse

if TYPE_CHECKING:
    from rbdyn.cli.new_options import Typed
    from rbdyn.cli.new_scene import OperatingPoint, Subject
    from rbdyn.properties.catalogue import Designation, Envelope

Value = TypeVar("Value")
TEMPERATURE_C, OIL, CLEARANCE = 70.0, "ISO VG 68", "CN"
LISTED, OF_OWN = "as listed; of own: estimated", "only with own"
SIZES = ("--bore", "--outside", "--width")

Designations = Annotated[
    list[str],
    typer.Argument(
        metavar="DESIGNATION|own", help="Bearing: NU210, NU 1010 M, 6208 C3, 7208B; own: a drawing of one's own."
    ),
]
Text = str | None
Rollers = Annotated[Text, valued("Z", "Number of rollers.", OF_OWN)]
Roller = Annotated[Text, valued("DxL", "Diameter x length of a roller in mm: 7x7.", OF_OWN)]
Balls = Annotated[Text, valued("Z", "Number of balls.", OF_OWN)]
Ball = Annotated[Text, valued("MM", "Diameter of a ball.", OF_OWN)]
Pitch = Annotated[Text, valued("MM", "Diameter of the circle through the centres of rollers or balls.", OF_OWN)]
ContactAngle = Annotated[Text, valued("DEG", "Contact angle of the balls.", OF_OWN)]
Conformity = Annotated[
    Text, valued("SHARE", "Groove radius over ball diameter, or INNER/OUTER: 0.515/0.525.", "0.52/0.53, only with own")
]
Speed = Annotated[Text, valued("RPM", "Speed of the inner ring.", "half the reference speed")]
Load = Annotated[Text, valued("N", "Radial load.", "0.1 C")]
Preload = Annotated[Text, valued("N", "Axial preload of a ball bearing.", "what loads half of the balls")]
Oil = Annotated[str, typer.Option(metavar="NAME", help='"ISO VG 32 PAO", "grease VG 100", 23699, "Jet Oil II".')]
Temperature = Annotated[
    Text, valued("C", "Temperature of the oil.", f"{TEMPERATURE_C:g}, or by the heat balance of --ambient")
]
OilFlow = Annotated[
    Text, valued("L_MIN", "Oil flow in L/min; a heat balance computes the temperatures.", "no flow", "--oil-flow")
]
OilInlet = Annotated[Text, valued("C", "Temperature of the oil that flows in.", "no flow", "--oil-inlet")]
Ambient = Annotated[
    Text, valued("C", "Temperature around housing and shaft; writes the heat balance.", "20 with --oil-flow")
]
Clearance = Annotated[Text, valued("CLASS|MM", "C2, CN, C3, C4 or C5, or diametral in mm.", "of DESIGNATION, else CN")]
Lubrication = Annotated[
    Text, valued("HOW", "bath, drop, jet, oil_air or grease.", "bath; grease if --oil is one, jet with --oil-flow")
]
Guidance = Annotated[
    Text, valued("PART", "What guides the cage: outer, inner or roller.", "of DESIGNATION, else outer")
]
CageMaterial = Annotated[
    Text, valued("NAME", "Material of the cage: brass, peek, polyamide.", "of DESIGNATION, else brass")
]
Bore = Annotated[Text, valued("MM", "Bore, where the table lacks the bearing.", LISTED)]
Outside = Annotated[Text, valued("MM", "Outside diameter.", LISTED)]
Width = Annotated[Text, valued("MM", "Width.", LISTED)]
Shaft = Annotated[Text, valued("CLASS", "Tolerance class of the shaft: k5. Writes the table mounting.", "loose")]
Housing = Annotated[Text, valued("CLASS", "Tolerance class of the housing: H7. Writes the table mounting.", "loose")]


def new(
    designation: Designations,
    rollers: Rollers = None,
    roller: Roller = None,
    balls: Balls = None,
    ball: Ball = None,
    pitch: Pitch = None,
    contact_angle: ContactAngle = None,
    conformity: Conformity = None,
    speed: Speed = None,
    load: Load = None,
    preload: Preload = None,
    oil: Oil = OIL,
    temperature: Temperature = None,
    oil_flow: OilFlow = None,
    oil_inlet: OilInlet = None,
    ambient: Ambient = None,
    clearance: Clearance = None,
    lubrication: Lubrication = None,
    guidance: Guidance = None,
    cage_material: CageMaterial = None,
    bore: Bore = None,
    outside: Outside = None,
    width: Width = None,
    shaft: Shaft = None,
    housing: Housing = None,
    out: OutFile = None,
    force: ForceFile = False,
    as_json: Json = False,
) -> None:
    """Write a commented scene of a catalogue bearing, or of one's own, its interior estimated."""
    texts = {
        "--rollers": rollers, "--roller": roller, "--balls": balls, "--ball": ball, "--pitch": pitch,
        "--contact-angle": contact_angle, "--conformity": conformity, "--speed": speed, "--load": load,
        "--preload": preload, "--oil": oil, "--temperature": temperature, "--oil-flow": oil_flow,
        "--oil-inlet": oil_inlet, "--ambient": ambient, "--clearance": clearance,
        "--lubrication": lubrication, "--guidance": guidance, "--cage-material": cage_material, "--bore": bore,
        "--outside": outside, "--width": width, "--shaft": shaft, "--housing": housing,
    }  # fmt: skip
    with guarded(as_json):
        from rbdyn.cli.new_options import Typed

        text = scene_text(" ".join(designation), Typed(texts))
        runs = "rbdyn simulate" if 'kind = "cylindrical_roller"' in text else "rbdyn ball"
        hand_out(text, as_json, out, force, runs)


def scene_text(words: str, typed: "Typed") -> str:
    """The commented scene that designation and options ask for, checked. Raises InputError with all faults at once."""
    from rbdyn.base.command import fill_template
    from rbdyn.cli import new_scene
    from rbdyn.cli.new_drawing import OWN, own_subject
    from rbdyn.cli.new_options import typed_fault
    from rbdyn.properties.catalogue import ROLLERS
    from rbdyn.properties.oils import oil_named
    from rbdyn.scene import Scene
    from rbdyn.scene.notes import heat_notes

    typed.read_numbers()
    typed.read("--oil", oil_named)
    first, _, rest = words.strip().partition(" ")
    own = first.lower() == OWN
    subject = own_subject(rest.strip(), typed) if own else _catalogue_bearing(words, typed)
    rollers = subject.kind == ROLLERS
    point = _operating_point(subject, typed)
    fill = new_scene.roller_values if rollers else new_scene.ball_values
    name = OWN if own else f"DESIGNATION {one_line(words, LONGEST_NAME)}"
    cause = f"--clearance {point.clearance}" if own else name
    values = _or_fault(cause, lambda: fill(subject, point)) | _mounting(subject, typed, point)
    template = Path(__file__).with_name("roller_scene.toml" if rollers else "ball_scene.toml")
    text = fill_template(template.read_text(encoding="utf-8"), values)
    # What is wrong with an estimate comes from the sizes that were given.
    sizes = " ".join(typed.listing(*SIZES))
    source = f"{sizes}: estimated inside" if sizes and not own else OWN if own else f"DESIGNATION {subject.name}"
    try:
        scene = Scene.from_dict(tomllib.loads(text), source)
        notes = [*getattr(scene, "unit_notes", ())]
        if scene.thermal and scene.lubricant and scene.mounting and scene.mounting.width:
            notes += heat_notes(scene.thermal, scene.lubricant, scene.mounting, scene.mounting.width)
        refuse(f"{source}: {note}" for note in notes)
    except InputError as error:
        raise InputError([typed_fault(typed, fault) for fault in error.faults]) from None
    return text


def _or_fault(name: str, attempt: Callable[[], Value]) -> Value:
    """What an attempt gives. Raises InputError, with the name in front, where it raises MethodError."""
    try:
        return attempt()
    except MethodError as error:
        raise InputError([f"{name}: {error}"]) from None


def _operating_point(subject: "Subject", typed: "Typed") -> "OperatingPoint":
    from rbdyn.cli.new_options import clearance_of, heat_of, supply_of
    from rbdyn.cli.new_scene import OperatingPoint
    from rbdyn.properties.oils import oil_named

    oil, heat, temperature = typed.read("--oil", oil_named), heat_of(typed), typed.number("--temperature")
    refuse(typed.faults)
    assert oil is not None
    if temperature is None and heat is None:
        temperature = TEMPERATURE_C
    clearance = typed.read("--clearance", clearance_of)
    clearance = subject.clearance or CLEARANCE if clearance is None else clearance
    speed, load, preload = (typed.number(option) for option in ("--speed", "--load", "--preload"))
    stated = typed["--lubrication"] is not None or oil.grease
    return OperatingPoint(speed, load, preload, oil, temperature, clearance, supply_of(typed), stated, heat)


def _mounting(subject: "Subject", typed: "Typed", point: "OperatingPoint") -> dict[str, Any]:
    """Values of [mounting], none of them without a class or a heat balance. Raises InputError for a class or a size that is not listed."""
    from rbdyn.cli.new_options import HEAT
    from rbdyn.cli.new_scene import mounting_values
    from rbdyn.properties.tolerances import housing_interference, shaft_interference

    sizes, rings = subject.sizes, subject.rings
    typed.read("--shaft", lambda zone: shaft_interference(sizes.bore, zone, rings.ring_class))
    typed.read("--housing", lambda zone: housing_interference(sizes.outside, zone, rings.ring_class))
    refuse(typed.faults)
    shaft, housing = typed["--shaft"], typed["--housing"]
    if shaft is None and housing is None and point.heat is None:
        return {}
    where = " ".join(typed.listing("--shaft", "--housing", *HEAT))
    name = f"{where}: a usual seat of the rings, of {sizes.bore:g} x {sizes.outside:g} mm"
    return _or_fault(name, lambda: mounting_values(sizes, rings, shaft, housing, point.temperature))


def _catalogue_bearing(words: str, typed: "Typed") -> "Subject":
    """The bearing of a designation. Raises InputError with all faults at once."""
    from rbdyn.cli.new_drawing import OF_DRAWINGS, OWN
    from rbdyn.cli.new_options import HEAT, cage_material_of, clearance_of, guidance_of, kind_faults
    from rbdyn.cli.new_scene import catalogue_subject
    from rbdyn.properties.catalogue import ROLLERS, read_designation

    name = one_line(words, LONGEST_NAME)
    for option in typed.listing(*OF_DRAWINGS):
        typed.note(f"{option}: is of a bearing of one's own; leave it out, or write {OWN} in place of {name}")
    clearance = typed.read("--clearance", clearance_of)
    cage = typed.read("--guidance", guidance_of), typed.read("--cage-material", cage_material_of)
    try:
        named = read_designation(words)
    except MethodError as error:
        raise InputError([*typed.faults, f"DESIGNATION {name}: {error}"]) from None
    rollers = named.kind == ROLLERS
    kind_faults(typed, rollers)
    _note_contradictions(named, typed, clearance)
    refuse(typed.faults)
    sizes = _or_fault(f"DESIGNATION {name}", lambda: _envelope(named, typed))
    mounted = bool(typed.listing("--shaft", "--housing", *HEAT))
    return _or_fault(f"DESIGNATION {name}", lambda: catalogue_subject(named, sizes, *cage, mounted))


def _note_contradictions(named: "Designation", typed: "Typed", clearance: str | float | None) -> None:
    """Note options that contradict a designation, and a clearance of a bearing that has a contact angle instead."""
    from rbdyn.properties.catalogue import ANGULAR

    of_suffix, cage = named.value_of("clearance"), named.value_of("cage")
    if named.value_of("bore") is not None:
        if not isinstance(clearance, float):
            typed.note(
                f"DESIGNATION {named.name}: a tapered bore is driven up its seat; add --clearance in mm, as it is then"
            )
        if typed["--shaft"] is not None:
            typed.fault("--shaft", "a tapered bore has no such seat; leave it out")
    angular = "an angular contact bearing has a contact angle instead; leave it out"
    if named.kind == ANGULAR and clearance is not None:
        typed.fault("--clearance", angular)
    elif clearance is not None and of_suffix not in (None, clearance):
        typed.fault("--clearance", f"contradicts {of_suffix} of {named.name}; leave one out")
    if named.kind == ANGULAR and of_suffix is not None:
        typed.note(f"DESIGNATION {named.name}: suffix {of_suffix}: {angular}")
    if cage is not None:
        for option in typed.listing("--guidance", "--cage-material"):
            typed.note(f"{option}: contradicts the cage {cage} of {named.name}; leave one out")


def _envelope(named: "Designation", typed: "Typed") -> "Envelope":
    """Boundary dimensions as typed or as the catalogue lists them. Raises MethodError, InputError."""
    from rbdyn.properties.catalogue import Envelope, envelope

    bore, outside, width = (typed.number(option) for option in SIZES)
    if bore is None and outside is None and width is None:
        return envelope(named)
    if bore is None or outside is None or width is None:
        missing = ", ".join(option for option in SIZES if typed[option] is None)
        raise InputError([f"{missing}: missing; give all of {', '.join(SIZES)} in mm, or none for a listed bearing"])
    if bore >= outside:
        raise InputError([f"--bore {bore:g}: not below --outside {outside:g}; fix them"])
    return Envelope(bore, outside, width)
