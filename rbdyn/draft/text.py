"""The commented scene of a bearing by its designation, a drawing or a REXS file, as text."""

import math
import tomllib
from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

from rbdyn.base.command import fill_template
from rbdyn.base.faults import LONGEST_NAME, InputError, MethodError, one_line, refuse
from rbdyn.draft.options import TABLE, Options, dashed
from rbdyn.draft.values import Subject, ball_values, catalogue_subject, drawing_subject, mounting_values, roller_values
from rbdyn.properties import catalogue
from rbdyn.properties.drawing import BallDrawing, RollerDrawing, ball_boundary, roller_boundary
from rbdyn.properties.rexs import SIZES as REXS_SIZES
from rbdyn.properties.rexs import RexsBearing
from rbdyn.properties.tolerances import housing_interference, shaft_interference
from rbdyn.scene import Scene
from rbdyn.scene.notes import heat_notes

Value = TypeVar("Value")
SIZES = ("--bore", "--outside", "--width")


def rexs_text(found: RexsBearing, typed: dict[str, str | None]) -> str:
    """The scene of a bearing in a REXS file, headed by what was taken; options that are typed replace those of the file.

    Sizes of a listed designation are those of its catalogue. Raises InputError with all faults at once.
    """
    presets = _presets()
    stated = {name: text for name, text in typed.items() if text != presets[name]}
    without = {name: text for name, text in found.options.items() if name not in SIZES or found.words == OWN}
    sizes = {name for option, names in REXS_SIZES.items() if option not in without for name in names}
    for words, options in product((found.words, found.basic), (without, found.options)):
        try:
            text = scene_text(words, Options(presets | dict(options) | stated))
            break
        except InputError as error:
            refused = error
    else:
        raise refused
    taken = [name for name in dict.fromkeys(found.taken) if options is found.options or name not in sizes]
    unread = f"# Not read: {', '.join(found.unread)}.\n" if found.unread else ""
    return f"# From {found.title}. Taken: {', '.join(taken)}.\n{unread}{text}"


def _presets() -> dict[str, str | None]:
    """Texts of the options that a user does not state."""
    return {dashed(entry.name): entry.metadata.get("preset") for entry in TABLE.values()}


def tables_of(designation: str) -> dict[str, Any]:
    """Tables of the scene of a designation without options. Raises InputError."""
    return tomllib.loads(scene_text(designation, Options(_presets())))


def scene_text(words: str, options: Options) -> str:
    """The commented scene that designation and options ask for, checked. Raises InputError with all faults at once."""
    first, _, inside = words.strip().partition(" ")
    is_own = first.lower() == OWN
    subject = own_subject(inside.strip(), options) if is_own else _catalogue_bearing(words, options)
    rollers = subject.kind == catalogue.ROLLERS
    cause = f"--clearance {subject.clearance}" if is_own else f"DESIGNATION {one_line(words, LONGEST_NAME)}"
    values = _or_fault(cause, lambda: (roller_values if rollers else ball_values)(subject, options))
    template = Path(__file__).with_name("roller_scene.toml" if rollers else "ball_scene.toml")
    text = fill_template(template.read_text(encoding="utf-8"), values | _mounting(subject, options))
    # What is wrong with an estimate comes from the sizes that were given.
    sizes = " ".join(options.typed(*SIZES))
    source = f"{sizes}: estimated inside" if sizes and not is_own else OWN if is_own else f"DESIGNATION {subject.name}"
    try:
        scene = Scene.from_dict(tomllib.loads(text), source)
        notes = [*scene.unit_notes]
        if scene.thermal and scene.lubricant and scene.mounting and scene.mounting.width:
            notes += heat_notes(scene.thermal, scene.lubricant, scene.mounting, scene.mounting.width)
        refuse(f"{source}: {note}" for note in notes)
    except InputError as error:
        raise InputError(map(options.of_scene, error.faults)) from None
    return text


def _or_fault(name: str, attempt: Callable[[], Value]) -> Value:
    """What an attempt gives. Raises InputError, with the name in front, where it raises MethodError."""
    try:
        return attempt()
    except MethodError as error:
        raise InputError(f"{name}: {error}") from None


def _mounting(subject: Subject, options: Options) -> dict[str, Any]:
    """Values of [mounting], none of them without a class or a heat balance. Raises InputError for a class or a size that is not listed."""
    sizes, rings = subject.sizes, subject.rings
    options.read("--shaft", lambda zone: shaft_interference(sizes.bore, zone, rings.ring_class))
    options.read("--housing", lambda zone: housing_interference(sizes.outside, zone, rings.ring_class))
    refuse(options.faults)
    if not options.mounted:
        return {"loose": sizes}
    where = f"{' '.join(options.mounted)}: a usual seat of the rings, of {sizes.bore:g} x {sizes.outside:g} mm"
    return _or_fault(where, lambda: mounting_values(sizes, rings, options))


def _catalogue_bearing(words: str, options: Options) -> Subject:
    """The bearing of a designation. Raises InputError with all faults at once."""
    name = one_line(words, LONGEST_NAME)
    for stated in options.typed(*OF_DRAWINGS):
        options.note(f"{stated}: is of a bearing of one's own; leave it out, or write {OWN} instead of {name}")
    try:
        named = catalogue.read_designation(words)
    except MethodError as error:
        raise InputError([*options.faults, f"DESIGNATION {name}: {error}"]) from None
    options.check_kind(named.kind == catalogue.ROLLERS)
    _note_contradictions(named, options)
    refuse(options.faults)
    return _or_fault(f"DESIGNATION {name}", lambda: catalogue_subject(named, _envelope(named, options), options))


def _note_contradictions(named: catalogue.Designation, options: Options) -> None:
    """Note options that contradict a designation, and a clearance of a bearing that has a contact angle instead."""
    clearance, of_suffix, cage = options.clearance, named.value_of("clearance"), named.value_of("cage")
    if named.value_of("bore") is not None:
        if not isinstance(clearance, float):
            tapered = "a tapered bore is driven up its seat; add --clearance in mm, as it is then"
            options.note(f"DESIGNATION {named.name}: {tapered}")
        if options["--shaft"] is not None:
            options.fault("--shaft", "a tapered bore has no such seat; leave it out")
    angular = "an angular contact bearing has a contact angle instead; leave it out"
    if named.kind == catalogue.ANGULAR and clearance is not None:
        options.fault("--clearance", angular)
    elif clearance is not None and of_suffix not in (None, clearance):
        options.fault("--clearance", f"contradicts {of_suffix} of {named.name}; leave one out")
    if named.kind == catalogue.ANGULAR and of_suffix is not None:
        options.note(f"DESIGNATION {named.name}: suffix {of_suffix}: {angular}")
    if cage is not None:
        for stated in options.typed("--guidance", "--cage-material"):
            options.note(f"{stated}: contradicts the cage {cage} of {named.name}; leave one out")


def _envelope(named: catalogue.Designation, options: Options) -> catalogue.Envelope:
    """Boundary dimensions as typed or as the catalogue lists them. Raises MethodError, InputError."""
    bore, outside, width = options.bore, options.outside, options.width
    if not options.typed(*SIZES):
        return catalogue.envelope(named)
    if bore is None or outside is None or width is None:
        missing = ", ".join(name for name in SIZES if options[name] is None)
        raise InputError(f"{missing}: missing; give all of {', '.join(SIZES)} in mm, or none for a listed bearing")
    if bore >= outside:
        raise InputError(f"--bore {bore:g}: not below --outside {outside:g}; fix them")
    return catalogue.Envelope(bore, outside, width)


OWN = "own"
OF_ROLLERS = ("--rollers", "--roller")
OF_BALLS = ("--balls", "--ball", "--contact-angle", "--conformity")
OF_DRAWINGS = (*OF_ROLLERS, *OF_BALLS, "--pitch")
EXAMPLES = "own --rollers 16 --roller 7x7 --pitch 60, or own --balls 16 --ball 9.525 --pitch 65 --contact-angle 25"
# Narrowest cage bar, in roller diameters and [mm].
NARROWEST_BAR, NARROWEST_BAR_MM = 0.03, 0.1
# A clearance below this share of a roller is one.
LARGEST_CLEARANCE_SHARE = 0.1


def own_subject(words: str, options: Options) -> Subject:
    """The bearing that the options draw; ``words``: what is typed next to "own". Raises InputError with all faults at once."""
    if words:
        name = one_line(words, LONGEST_NAME)
        options.note(f"DESIGNATION {name}: is a second bearing next to own; leave one of them out")
    rollers, balls = options.typed(*OF_ROLLERS), options.typed(*OF_BALLS)
    if rollers and balls:
        both = f"{' '.join(rollers)} and {' '.join(balls)}"
        options.note(f"{both}: a bearing has rollers or balls; leave out one kind")
        raise InputError(options.faults)
    if not rollers and not balls:
        raise InputError([*options.faults, f"own: neither rollers nor balls are stated; write {EXAMPLES}"])
    return _roller_bearing(options) if rollers else _ball_bearing(options)


def _roller_bearing(options: Options) -> Subject:
    options.require("--rollers", "--roller", "--pitch")
    options.check_kind(rollers=True)
    number, pitch, (diameter, length) = options.rollers or 0, options.pitch or 0.0, options.roller or (0.0, 0.0)
    _check_raceways(options, pitch, diameter, "rollers")
    if options.width and length > options.width:
        ring = f"is longer than the ring of --width {options.width:g}"
        options.fault("--roller", f"{ring}; shorten the roller or widen the ring")
    clearance, most = options.clearance, LARGEST_CLEARANCE_SHARE * diameter
    if diameter and isinstance(clearance, float) and abs(clearance) >= most:
        proportion = f"is out of proportion to rollers of {diameter:g} mm"
        options.fault("--clearance", f"{proportion}; write millimetres, below {most:g}")
    drawing = RollerDrawing(number, diameter, length, pitch)
    if all(drawing) and diameter < pitch and number > (fitting := _most_rollers(drawing)):
        bars = f"leaves bars of {max(_bar(drawing), 0.0):.3g} mm between the pockets of a cage on --pitch {pitch:g}"
        _overfilled(options, "rollers", number, diameter, pitch, fitting, bars)
    refuse(options.faults)
    return drawing_subject(drawing, roller_boundary(drawing, options.bore, options.outside, options.width), options)


def _overfilled(
    options: Options, what: str, number: int, diameter: float, pitch: float, fitting: int, bars: str = ""
) -> None:
    """Note rolling elements that overlap, or else what the ``bars`` of the cage are; ``fitting``: how many have room."""
    chord = _chord(number, pitch)
    overlap = f"{what} of {diameter:g} mm overlap on --pitch {pitch:g}, where each has {chord:.4g} mm"
    fix = f"take at most {fitting}" if fitting >= 3 else f"take smaller {what} or a larger pitch diameter"
    options.fault(f"--{what}", f"{overlap if chord <= diameter else bars}; {fix}")


def _chord(number: int, pitch: float) -> float:
    return pitch * math.sin(math.pi / number)


def _most_rollers(drawing: RollerDrawing) -> int:
    """The most rollers, up to those drawn, that neither overlap nor leave the cage too narrow bars."""
    narrowest = max(NARROWEST_BAR * drawing.diameter, NARROWEST_BAR_MM)
    for number in range(drawing.rollers, 2, -1):
        apart = _chord(number, drawing.pitch_diameter) > drawing.diameter
        if apart and _bar(drawing._replace(rollers=number)) >= narrowest:
            return number
    return 0


def _bar(drawing: RollerDrawing) -> float:
    """Width of a cage bar [mm] as the scene will estimate it, where it is narrowest."""
    number, diameter, length, pitch = drawing
    cage = catalogue.cage_estimate(catalogue.NO_SERIES, length, number, diameter, length, pitch)
    return min(cage.bar_width, _chord(number, pitch) - diameter - cage.pocket_clearance)


def _ball_bearing(options: Options) -> Subject:
    options.require("--balls", "--ball", "--pitch")
    angle, clearance = options["--contact-angle"], options["--clearance"]
    if angle is None and clearance is None:
        words = "missing; write it in degrees, as 25, or --clearance of a deep groove bearing"
        options.fault("--contact-angle", words)
    options.check_kind(rollers=False)
    if angle is not None and clearance is not None:
        stated = options.words("--contact-angle")
        options.fault("--clearance", f"contradicts {stated}, which gives it; leave one out")
    number, ball, pitch, width = options.balls or 0, options.ball or 0.0, options.pitch or 0.0, options.width
    _check_raceways(options, pitch, ball, "balls", options.contact_angle or 0.0)
    if width and ball > width:
        ring = f"is wider than the ring of --width {width:g}"
        options.fault("--ball", f"{ring}; take a smaller ball or widen the ring")
    if number and 0.0 < ball < pitch and _chord(number, pitch) <= ball:
        _overfilled(options, "balls", number, ball, pitch, math.ceil(math.pi / math.asin(ball / pitch)) - 1)
    refuse(options.faults)
    drawing = BallDrawing(number, ball, pitch, options.contact_angle)
    return drawing_subject(drawing, ball_boundary(drawing, options.bore, options.outside, width), options)


def _check_raceways(options: Options, pitch: float, diameter: float, what: str, angle: float = 0.0) -> None:
    """Note a pitch circle without an inner raceway, and rings that do not reach beyond theirs."""
    if not pitch or not diameter:
        return
    reach = diameter * math.cos(math.radians(angle))
    if pitch <= diameter:
        options.fault("--pitch", f"leaves no inner raceway under {what} of {diameter:g} mm; enlarge it")
        return
    if options.bore and options.bore >= (raceway := pitch - reach):
        options.fault("--bore", f"leaves no inner ring under a raceway of {raceway:.4g} mm; make it smaller")
    if options.outside and options.outside <= (raceway := pitch + reach):
        options.fault("--outside", f"leaves no outer ring over a raceway of {raceway:.4g} mm; make it larger")
