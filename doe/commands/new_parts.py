"""Parts that make a scene's clearances: their nominals, the tolerances that ISO 286-1 gives them, and the dimension chains that they close.

A clearance is the sum of coefficient times nominal of its parts: radial, outer less inner raceway less two rollers; guide, land and
cage; pocket, its width less the roller. All are diametral and of the loose bearing. Rollers are graded by size: one diameter in a bearing.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from rbdyn.base.faults import InputError, MethodError
from rbdyn.properties.tolerances import grade_tolerances
from rbdyn.scene import Scene

# Usual grades: of ground raceways, of turned and milled cages and their lands.
RACEWAY_GRADE, CAGE_GRADE = "IT5", "IT7"
# Half widths of rollers of one diameter [mm], the usual one first.
ROLLER_HALF_WIDTHS = (0.001, 0.0005)
# Decimals [mm] of an estimated land, and of sums.
MICROMETRES, DIGITS = 3, 9

LEFT_OUT = "Without this line: as wide as [tolerances] allows"


class Part(NamedTuple):
    """A part: its name, what the clearance changes by per unit of it, its nominal [mm], where that comes from; rollers are graded."""

    name: str
    coefficient: float
    nominal: float
    source: str = ""

    @property
    def graded(self) -> bool:
        """Whether it is a roller, whose tolerance is that of its lot."""
        return not self.source


class ClearanceParts(NamedTuple):
    """The parts of one clearance: names of chain and factor, what the chain is in words, the usual grade, the part that is adjusted."""

    name: str
    factor: str
    sentence: str
    grade: str
    parts: tuple[Part, ...]
    adjust: str

    @property
    def clearance(self) -> float:
        """What the nominals close to [mm]."""
        return sum(part.coefficient * part.nominal for part in self.parts)


class Manufacture(NamedTuple):
    """How the parts of a clearance are made: half width of the clearance and of rollers [mm], and the rule in words."""

    half_width: float
    rollers: float
    rule: str


def clearance_parts(scene: Scene) -> dict[str, ClearanceParts]:
    """Parts of the radial, the guide and the pocket clearances of a scene, by factor; those that the scene has."""
    bearing, cage = scene.bearing, scene.cage
    pitch, roller, radial = bearing.pitch_diameter_mm, bearing.roller_diameter_mm, bearing.radial_clearance_mm
    around = "pitch diameter {} roller {} half of the clearance"
    # The outer raceway is at the resolution of a drawing, and the inner one closes to the clearance.
    outer = round(pitch + roller + 0.5 * radial, MICROMETRES)
    raceways = (
        Part("outer_raceway", 1.0, outer, around.format("+", "+")),
        Part("inner_raceway", -1.0, _size(outer - 2.0 * roller - radial), around.format("-", "-")),
        Part("rollers", -2.0, roller),
    )
    pocket = (
        Part("pocket_width", 1.0, _size(roller + cage.pocket_clearance_mm), "roller + clearance"),
        Part("roller_diameter", -1.0, roller),
    )
    groups = [
        ClearanceParts(
            "radial", "radial_clearance_mm", "outer raceway less inner raceway less two rollers, of the loose bearing",
            RACEWAY_GRADE, raceways, "outer_raceway",
        ),
        *_guide(scene),
        ClearanceParts(
            "pocket", "pocket_clearance_mm", "width of the pocket less roller diameter",
            CAGE_GRADE, pocket, "pocket_width",
        ),
        *_lips(scene),
    ]  # fmt: skip
    return {group.factor: group for group in groups}


def _guide(scene: Scene) -> Iterator[ClearanceParts]:
    """Land and cage; none where the rollers guide the cage."""
    clearance, land = scene.cage.guide_clearance_mm, round(scene.land_diameter_mm, MICROMETRES)
    if clearance is None or scene.cage.guidance == "roller":
        return
    on_drawing = scene.cage.land_diameter_mm is not None
    source = "cage.land_diameter_mm" if on_drawing else "estimated: pitch diameter {} 2/3 roller; put in the drawing's"
    if scene.cage.guidance == "outer":
        words = "land of the outer ring less outside diameter of the cage"
        parts = (
            Part("guide_land", 1.0, _size(land), source.format("+")),
            Part("cage_outside", -1.0, _size(land - clearance), "land - clearance"),
        )
    else:
        words = "bore of the cage less land of the inner ring"
        parts = (
            Part("cage_bore", 1.0, _size(land + clearance), "land + clearance"),
            Part("guide_land", -1.0, _size(land), source.format("-")),
        )
    adjust = next(part.name for part in parts if part.name != "guide_land")
    yield ClearanceParts("guide", "guide_clearance_mm", words, CAGE_GRADE, parts, adjust)


def _lips(scene: Scene) -> Iterator[ClearanceParts]:
    """Pocket lips and roller; none where a ring guides the cage."""
    roller, clearance = scene.bearing.roller_diameter_mm, scene.cage.lip_clearance_mm
    if clearance is None:
        return
    parts = (
        Part("pocket_lips", 1.0, _size(roller + clearance), "roller + clearance"),
        Part("roller_diameter", -1.0, roller),
    )
    words = "width between the pocket's lips less roller diameter"
    yield ClearanceParts("lips", "pocket_radial_clearance_mm", words, CAGE_GRADE, parts, "pocket_lips")


def _size(value: float) -> float:
    return round(value, DIGITS)


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
    return Manufacture(_size(whole), half, f"{grade} (ISO 286-1): {sizes}{graded}{why}")


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

    ``derived``: the study derives the widest tolerances, which hold where the half width is left out.
    """
    rule = f"{manufacture.rule}. {LEFT_OUT}" if derived else manufacture.rule
    head = _template("chain").format(**group._asdict(), half_width=manufacture.half_width, rule=rule)
    below = {"half_width": manufacture.rollers, "half_width_below": -manufacture.rollers}
    links = [_template("roller" if part.graded else "part").format(**part._asdict(), **below) for part in group.parts]
    return "".join([head, *links])
