"""``rbdyn new own``: a bearing of one's own from its rollers or balls, and what does not fit in it, one sentence a fault."""

import math

from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, refuse
from rbdyn.cli.new_options import (
    Typed,
    cage_material_of,
    clearance_of,
    conformity_of,
    guidance_of,
    kind_faults,
    roller_size,
)
from rbdyn.cli.new_scene import Subject, ball_subject, roller_subject
from rbdyn.properties.catalogue import NO_SERIES, cage_estimate
from rbdyn.properties.drawing import BallDrawing, RollerDrawing, ball_boundary, roller_boundary

OWN = "own"
OF_ROLLERS = ("--rollers", "--roller")
OF_BALLS = ("--balls", "--ball", "--contact-angle", "--conformity")
OF_DRAWINGS = (*OF_ROLLERS, *OF_BALLS, "--pitch")
EXAMPLES = "own --rollers 16 --roller 7x7 --pitch 60, or own --balls 16 --ball 9.525 --pitch 65 --contact-angle 25"
REMEDIES = {
    "--rollers": "write the number of rollers, as 16",
    "--roller": "write diameter x length of a roller in mm, as 7x7",
    "--balls": "write the number of balls, as 16",
    "--ball": "write the diameter of a ball in mm, as 9.525",
    "--pitch": "write the diameter of the circle through the centres in mm, as 60",
}
# Narrowest cage bar, in roller diameters and [mm].
NARROWEST_BAR, NARROWEST_BAR_MM = 0.03, 0.1
# A clearance below this share of a roller is one.
LARGEST_CLEARANCE_SHARE = 0.1


def own_subject(words: str, typed: Typed) -> Subject:
    """The bearing that the options draw; ``words``: what is typed next to "own". Raises InputError with all faults at once."""
    if words:
        typed.note(
            f"DESIGNATION {one_line(words, LONGEST_NAME)}: is a second bearing next to own; leave one of them out"
        )
    rollers, balls = typed.listing(*OF_ROLLERS), typed.listing(*OF_BALLS)
    if rollers and balls:
        both = f"{' '.join(rollers)} and {' '.join(balls)}"
        raise InputError([*typed.faults, f"{both}: a bearing has rollers or balls; leave out one kind"])
    if not rollers and not balls:
        raise InputError([*typed.faults, f"own: neither rollers nor balls are stated; write {EXAMPLES}"])
    return _roller_bearing(typed) if rollers else _ball_bearing(typed)


def _require(typed: Typed, *options: str) -> None:
    for option in options:
        if typed[option] is None:
            typed.fault(option, f"missing; {REMEDIES[option]}")


def _roller_bearing(typed: Typed) -> Subject:
    _require(typed, "--rollers", "--roller", "--pitch")
    kind_faults(typed, rollers=True)
    number, pitch = typed.count("--rollers"), typed.number("--pitch")
    roller, clearance = typed.read("--roller", roller_size), typed.read("--clearance", clearance_of)
    guidance, material = typed.read("--guidance", guidance_of), typed.read("--cage-material", cage_material_of)
    bore, outside, width = (typed.number(option) for option in ("--bore", "--outside", "--width"))
    if roller is not None and pitch is not None:
        _check_raceways(typed, pitch, roller[0], (bore, outside), "rollers")
    if roller is not None and width is not None and roller[1] > width:
        typed.fault("--roller", f"is longer than the ring of --width {width:g}; shorten the roller or widen the ring")
    if roller is not None and isinstance(clearance, float) and abs(clearance) >= LARGEST_CLEARANCE_SHARE * roller[0]:
        most = f"write millimetres, below {LARGEST_CLEARANCE_SHARE * roller[0]:g}"
        typed.fault("--clearance", f"is out of proportion to rollers of {roller[0]:g} mm; {most}")
    drawing = None if roller is None or number is None or pitch is None else RollerDrawing(number, *roller, pitch)
    if drawing is not None and drawing.diameter < drawing.pitch_diameter:
        _check_pockets(typed, drawing)
    refuse(typed.faults)
    assert drawing is not None
    return roller_subject(drawing, roller_boundary(drawing, bore, outside, width), guidance, material)


def _check_pockets(typed: Typed, drawing: RollerDrawing) -> None:
    """Note rollers that overlap, and those that leave the cage no bars."""
    pitch, diameter = drawing.pitch_diameter, drawing.diameter
    if drawing.rollers <= (most := _most_rollers(drawing)):
        return
    fix = f"take at most {most}" if most >= 3 else "take smaller rollers or a larger pitch diameter"
    chord = pitch * math.sin(math.pi / drawing.rollers)
    if chord <= diameter:
        room = f"on --pitch {pitch:g}, where each has {chord:.4g} mm"
        typed.fault("--rollers", f"rollers of {diameter:g} mm overlap {room}; {fix}")
    else:
        typed.fault(
            "--rollers",
            f"leaves bars of {max(_bar(drawing), 0.0):.3g} mm between the pockets of a cage on --pitch {pitch:g}; {fix}",
        )


def _most_rollers(drawing: RollerDrawing) -> int:
    """The most rollers, up to those drawn, that neither overlap nor leave the cage too narrow bars."""
    narrowest = max(NARROWEST_BAR * drawing.diameter, NARROWEST_BAR_MM)
    fewer = (drawing._replace(rollers=number) for number in range(drawing.rollers, 2, -1))
    apart = (one for one in fewer if one.pitch_diameter * math.sin(math.pi / one.rollers) > one.diameter)
    return next((one.rollers for one in apart if _bar(one) >= narrowest), 0)


def _bar(drawing: RollerDrawing) -> float:
    """Width of a cage bar [mm] as the scene will estimate it, where it is narrowest."""
    number, diameter, length, pitch = drawing
    cage = cage_estimate(NO_SERIES, length, number, diameter, length, pitch)
    return min(cage.bar_width, pitch * math.sin(math.pi / number) - diameter - cage.pocket_clearance)


def _ball_bearing(typed: Typed) -> Subject:
    _require(typed, "--balls", "--ball", "--pitch")
    if typed["--contact-angle"] is None and typed["--clearance"] is None:
        typed.fault("--contact-angle", "missing; write it in degrees, as 25, or --clearance of a deep groove bearing")
    kind_faults(typed, rollers=False)
    number, ball, pitch = typed.count("--balls"), typed.number("--ball"), typed.number("--pitch")
    angle, grooves = typed.number("--contact-angle"), typed.read("--conformity", conformity_of)
    if typed["--contact-angle"] is not None and typed["--clearance"] is not None:
        typed.fault("--clearance", f"contradicts {typed.words('--contact-angle')}, which gives it; leave one out")
    else:
        typed.read("--clearance", clearance_of)
    bore, outside, width = (typed.number(option) for option in ("--bore", "--outside", "--width"))
    if ball is not None and pitch is not None:
        _check_raceways(typed, pitch, ball, (bore, outside), "balls", angle or 0.0)
    if ball is not None and width is not None and ball > width:
        typed.fault("--ball", f"is wider than the ring of --width {width:g}; take a smaller ball or widen the ring")
    if number is not None and ball is not None and pitch is not None and ball < pitch:
        chord = pitch * math.sin(math.pi / number)
        if chord <= ball:
            most = math.ceil(math.pi / math.asin(ball / pitch)) - 1
            fix = f"take at most {most}" if most >= 3 else "take smaller balls or a larger pitch diameter"
            room = f"on --pitch {pitch:g}, where each has {chord:.4g} mm"
            typed.fault("--balls", f"balls of {ball:g} mm overlap {room}; {fix}")
    refuse(typed.faults)
    assert number is not None and ball is not None and pitch is not None
    drawing = BallDrawing(number, ball, pitch, angle)
    return ball_subject(drawing, ball_boundary(drawing, bore, outside, width), grooves)


def _check_raceways(
    typed: Typed, pitch: float, diameter: float, rings: tuple[float | None, float | None], what: str, angle: float = 0.0
) -> None:
    """Note a pitch circle without an inner raceway, and rings (bore, outside diameter) that do not reach beyond theirs."""
    if pitch <= diameter:
        typed.fault("--pitch", f"leaves no inner raceway under {what} of {diameter:g} mm; enlarge it")
        return
    reach, (bore, outside) = diameter * math.cos(math.radians(angle)), rings
    if bore is not None and bore >= pitch - reach:
        typed.fault("--bore", f"leaves no inner ring under a raceway of {pitch - reach:.4g} mm; make it smaller")
    if outside is not None and outside <= pitch + reach:
        typed.fault("--outside", f"leaves no outer ring over a raceway of {pitch + reach:.4g} mm; make it larger")
