"""``rbdyn new own``: a bearing of one's own from its rollers or balls, and what does not fit in it, one sentence a fault."""

import math

from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, refuse
from rbdyn.draft.options import Options
from rbdyn.draft.values import Subject, drawing_subject
from rbdyn.properties.catalogue import NO_SERIES, cage_estimate
from rbdyn.properties.drawing import BallDrawing, RollerDrawing, ball_boundary, roller_boundary

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
    cage = cage_estimate(NO_SERIES, length, number, diameter, length, pitch)
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
