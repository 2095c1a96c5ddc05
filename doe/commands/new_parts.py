"""Parts that make a scene's clearances: the tolerances that ISO 286-1 gives them, and the dimension chains that they close."""

from pathlib import Path
from typing import NamedTuple

from doe.workflow.parts import DIGITS, ClearanceParts, Part
from rbdyn.base.faults import InputError, MethodError
from rbdyn.properties.tolerances import grade_tolerances

# Half widths of rollers of one diameter [mm], the usual one first.
ROLLER_HALF_WIDTHS = (0.001, 0.0005)

# Of a study that derives its tolerances, whose chains are made to these.
DERIVED = "would state it. Default: as [tolerances] derives it, otherwise as the factor states it"
MARK = "estimated = true # until a drawing states it: parts and reports mark it\n"


class Manufacture(NamedTuple):
    """How the parts of a clearance are made: half width of the clearance and of rollers [mm], and the rule in words."""

    half_width: float
    rollers: float
    rule: str


def manufacture_of(group: ClearanceParts, step: float) -> Manufacture:
    """The usual grade of the parts, or the next finer one that leaves the clearance within a step [mm] of the design.

    Raises InputError for a part outside the tables of ISO 286.
    """
    widths = [(part, _grades(group, part)) for part in group.parts if not part.graded]
    rollers = sum(abs(part.coefficient) for part in group.parts if part.graded)
    names = list(widths[0][1])
    finer = names[names.index(group.grade) :: -1]
    candidates = [
        _by_grade(group, grade, half, widths, rollers, finer[0])
        for half in (ROLLER_HALF_WIDTHS if rollers else ROLLER_HALF_WIDTHS[:1])
        for grade in finer
    ]
    return next((candidate for candidate in candidates if candidate.half_width <= step), candidates[-1])


def _by_grade(
    group: ClearanceParts,
    grade: str,
    half: float,
    widths: list[tuple[Part, dict[str, float]]],
    rollers: float,
    usual: str,
) -> Manufacture:
    whole = 0.5 * sum(abs(part.coefficient) * table[grade] for part, table in widths) + rollers * half
    sizes = " and ".join(f"{part.name} {1e3 * table[grade]:g} um" for part, table in widths)
    graded = "".join(f", {part.name} within {1e3 * half:g} um of nominal" for part in group.parts if part.graded)
    why = "" if grade == usual else f"; {usual} would be wider than a step"
    return Manufacture(round(whole, DIGITS), half, f"{grade} (ISO 286-1): {sizes}{graded}{why}")


def _grades(group: ClearanceParts, part: Part) -> dict[str, float]:
    try:
        return grade_tolerances(part.nominal)
    except MethodError as error:
        why = f"{part.name} of {part.nominal:g} mm {error}"
        raise InputError([f"{group.factor}: {why}; leave --tolerances and --chains out"]) from None


def _template(name: str) -> str:
    """A part of the template of a study."""
    return Path(__file__).with_name(f"new_study_{name}.toml").read_text(encoding="utf-8")


def tolerances_text() -> str:
    """The tables of a study that derive its tolerances."""
    return _template("tolerances")


def chain_text(group: ClearanceParts, manufacture: Manufacture, derived: bool) -> str:
    """A [[chain]] of a study: its links resolve to the clearance of the scene.

    ``derived``: the study derives the widest tolerances, to which the parts are made; so the chain states none itself.
    """
    rule, stated = (DERIVED, "# ") if derived else (manufacture.rule, "")
    head = _template("chain").format(**group._asdict(), half_width=manufacture.half_width, rule=rule, stated=stated)
    below = {"half_width": manufacture.rollers, "half_width_below": -manufacture.rollers}
    links = [
        _template("roller" if part.graded else "part").format(
            **part._asdict(), **below, mark=MARK if part.estimated else ""
        )
        for part in group.parts
    ]
    return "".join([head, *links])
