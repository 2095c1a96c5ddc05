"""Sizes of a drawing: allocated deviations and nominals on the steps of its resolution, and tolerances that it can carry.

Deviations are rounded inwards. The nominal that is moved takes the step next to its place. Stated parts are left alone.
"""

from dataclasses import replace
from math import ceil, floor

from doe.dimension_chain.links import DIGITS, SLACK, Link, Part
from rbdyn.base.faults import MethodError
from rbdyn.properties.tolerances import fit_limits, grade_tolerances

LEAST = 1e-6  # mm: tolerance that counts as one where nothing is rounded
SHAFT_LETTERS = ("f", "g", "h", "js", "j", "k", "m", "n", "p", "r", "s")
HOLE_LETTERS = ("F", "G", "H", "JS", "J", "K", "M", "N", "P", "R", "S")
SEAT_GRADES = range(4, 10)
NEAR = 1e-6  # share of a step within which a size is on it


def on_step(steps: int, resolution: float) -> float:
    """Size, mm, of a whole number of steps."""
    return round(steps * resolution, DIGITS)


def steps_below(size: float, resolution: float) -> int:
    """Whole steps in a size."""
    return floor(size / resolution + NEAR)


def steps_above(size: float, resolution: float) -> int:
    """Whole steps that a size needs."""
    return ceil(size / resolution - NEAR)


def least_tolerance(link: Link, resolution: float) -> float:
    """Narrowest tolerance, mm, that the drawing carries and the process of the link gives."""
    process = 0.0 if link.cost is None else link.cost.narrowest_mm
    if not resolution:
        return max(process, LEAST)
    # Both sides of a symmetric tolerance are whole steps.
    step = resolution * (2 if link.position in ("symmetric", "js", "JS") else 1)
    return on_step(max(steps_above(process, step), 1), step)


def rounded_part(part: Part, resolution: float) -> Part:
    """An allocated part with its nominal on the nearest step and its deviations rounded inwards; others as they are.

    A tolerance below one step takes one. A grade stays where the tolerance is no wider than it.
    """
    if part.origin != "allocated" or not resolution:
        return part
    lower, upper = steps_above(part.lower_mm, resolution), steps_below(part.upper_mm, resolution)
    if upper <= lower:
        below = part.lower_mm + part.upper_mm < 0
        lower, upper = (upper - 1, upper) if below else (lower, lower + 1)
    low, high = on_step(lower, resolution), on_step(upper, resolution)
    nominal = on_step(round(part.nominal_mm / resolution), resolution)
    grade = part.grade if high - low <= part.tolerance_mm + SLACK else None
    return replace(
        at_nominal(part, nominal), lower_mm=low, upper_mm=high, mean_mm=round((low + high) / 2, DIGITS), grade=grade
    )


def at_nominal(part: Part, nominal: float) -> Part:
    """The part with another nominal, and the whole move since the stated one."""
    return replace(part, nominal_mm=nominal, moved_mm=round(part.moved_mm + nominal - part.nominal_mm, DIGITS))


def seat_part(part: Part) -> Part:
    """A seat of a bought ring with its stated nominal: the move of the nominal is in the deviations, as of any fit."""
    shift = part.moved_mm
    low, high, mean = (round(value + shift, DIGITS) for value in (part.lower_mm, part.upper_mm, part.mean_mm))
    seat = at_nominal(part, round(part.nominal_mm - shift, DIGITS))
    return replace(seat, lower_mm=low, upper_mm=high, mean_mm=mean)


def class_within(part: Part, shaft: bool) -> str:
    """Widest tolerance class of ISO 286 within the limits of a seat, such as 'k5'; empty if there is none."""
    widest, name = 0.0, ""
    for letter in SHAFT_LETTERS if shaft else HOLE_LETTERS:
        for grade in SEAT_GRADES:
            try:
                lower, upper = fit_limits(part.nominal_mm, f"{letter}{grade}")
            except MethodError:
                continue
            inside = part.lower_mm - SLACK <= lower and upper <= part.upper_mm + SLACK
            if inside and upper - lower > widest + SLACK:
                widest, name = upper - lower, f"{letter}{grade}"
    return name


def places(part: Part, resolution: float) -> list[Part]:
    """The part with its nominal on the steps next to it, the nearer first; as it is where nothing is rounded.

    A stated nominal within a step comes first of all: a move that only the rounding asks for is none.
    """
    if not resolution:
        return [part]
    steps = {steps_below(part.nominal_mm, resolution), steps_above(part.nominal_mm, resolution)}
    nominals = sorted((on_step(step, resolution) for step in steps), key=lambda size: abs(size - part.nominal_mm))
    stated = round(part.nominal_mm - part.moved_mm, DIGITS)
    if (
        abs(part.moved_mm) < resolution * (1.0 + NEAR)
        and on_step(steps_below(stated, resolution), resolution) == stated
    ):
        nominals = [stated, *(nominal for nominal in nominals if nominal != stated)]
    return [at_nominal(part, nominal) for nominal in nominals]


def narrower(tolerance: float, least: float, resolution: float) -> float:
    """The next narrower tolerance, mm: by a step, at least by a hundredth, and no narrower than ``least``."""
    step = max(resolution, 0.01 * tolerance)
    return max(least, round(tolerance - step, DIGITS))


def grade_words(part: Part) -> str:
    """'IT5' of an allocated part, or the grade that it is finer than; empty for others and beyond ISO 286."""
    if part.grade or part.origin != "allocated":
        return part.grade or ""
    try:
        ladder = grade_tolerances(part.nominal_mm)
    except MethodError:
        return ""
    wider = [grade for grade, width in ladder.items() if part.tolerance_mm <= width + SLACK]
    if not wider:
        return ""
    return wider[0] if abs(ladder[wider[0]] - part.tolerance_mm) < SLACK else f"finer than {wider[0]}"
