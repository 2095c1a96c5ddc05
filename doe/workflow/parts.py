"""Parts that make a clearance, and the grade of ISO 286 at which a shop must make them for a tolerance of that clearance.

A clearance is the sum of coefficient times nominal of its parts: radial, outer less inner raceway less two rollers; guide, land and
cage; pocket, its width less the roller. All are diametral and of the loose bearing. Rollers are graded by size: one diameter in a bearing.

A dimension chain of the study allocates a tolerance to its parts, which have their grades from there. Without one the parts are
those of the scene, and their grade is the widest that all of them may have together. Any other length is a part by itself.
"""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

from doe.dimension_chain import Chain, chain_from, grade_tolerances
from doe.dimension_chain.allocation import Allocation
from doe.dimension_chain.closing import NoValueError
from doe.dimension_chain.links import Part as ChainPart
from doe.dimension_chain.links import grade_words
from doe.study_file.sections import StudyChain
from doe.workflow.problem import Problem
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, MethodError
from rbdyn.base.records import Record
from rbdyn.base.words import all_of
from rbdyn.properties.tolerances import STANDARD_TOLERANCES
from rbdyn.scene import Scene
from rbdyn.scene.uncertain import MARKING

# Usual grades: of ground raceways, of turned and milled cages and their lands.
RACEWAY_GRADE, CAGE_GRADE = "IT5", "IT7"
# Decimals [mm] of an estimated land, and of sums.
MICROMETRES, DIGITS = 3, 9
# Half width of rollers of one lot [mm].
LOT = 0.001
# Half widths of rollers of one diameter [mm], the usual one first.
ROLLER_HALF_WIDTHS = (0.001, 0.0005)
GRADES = list(STANDARD_TOLERANCES)
FINER = f"finer than {GRADES[0]}"
# ISO 286 begins its coarse grades at this size [mm]; smaller lengths are no sizes of a part.
SMALLEST_SIZE = 1.0


class Part(NamedTuple):
    """A part: its name, what the clearance changes by per unit of it, its nominal [mm], where that comes from, and whether that is
    an estimate; rollers are graded."""

    name: str
    coefficient: float
    nominal: float
    source: str = ""
    estimated: bool = False

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


def clearance_parts(scene: Scene) -> dict[str, ClearanceParts]:
    """Parts of the radial, the guide and the pocket clearances of a scene, by factor; those that the scene has."""
    bearing, cage = scene.bearing, scene.cage
    pitch, roller, radial = bearing.pitch_diameter_mm, bearing.roller_diameter_mm, bearing.radial_clearance_mm
    around = "pitch diameter {} roller {} half of the clearance"
    estimates = set() if scene.uncertain is None else {*scene.uncertain.estimated}
    unsure = bool(estimates & {*MARKING})
    of_roller = MARKING[0] in estimates
    # The outer raceway is at the resolution of a drawing, and the inner one closes to the clearance.
    outer = round(pitch + roller + 0.5 * radial, MICROMETRES)
    raceways = (
        Part("outer_raceway", 1.0, outer, around.format("+", "+"), unsure),
        Part("inner_raceway", -1.0, _size(outer - 2.0 * roller - radial), around.format("-", "-"), unsure),
        Part("rollers", -2.0, roller, estimated=of_roller),
    )
    pocket = (
        Part("pocket_width", 1.0, _size(roller + cage.pocket_clearance_mm), "roller + clearance", of_roller),
        Part("roller_diameter", -1.0, roller, estimated=of_roller),
    )
    groups = [
        ClearanceParts(
            "radial", "radial_clearance_mm", "outer raceway less inner raceway less two rollers, before mounting",
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
    source = "cage.land_diameter_mm" if on_drawing else "estimated: pitch diameter {} 2/3 roller; see your drawing"
    if scene.cage.guidance == "outer":
        words = "land of the outer ring less outside diameter of the cage"
        parts = (
            Part("guide_land", 1.0, _size(land), source.format("+"), not on_drawing),
            Part("cage_outside", -1.0, _size(land - clearance), "land - clearance", not on_drawing),
        )
    else:
        words = "bore of the cage less land of the inner ring"
        parts = (
            Part("cage_bore", 1.0, _size(land + clearance), "land + clearance", not on_drawing),
            Part("guide_land", -1.0, _size(land), source.format("-"), not on_drawing),
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

    def made(grade: str, half: float) -> Manufacture:
        width = 0.5 * sum(abs(part.coefficient) * table[grade] for part, table in widths) + rollers * half
        sizes = all_of(f"{part.name} {1e3 * table[grade]:g} um" for part, table in widths)
        graded = "".join(f", {part.name} within {1e3 * half:g} um of nominal" for part in group.parts if part.graded)
        why = "" if grade == finer[0] else f"; {finer[0]} would be wider than a step"
        return Manufacture(round(width, DIGITS), half, f"{grade} (ISO 286-1): {sizes}{graded}{why}")

    halves = ROLLER_HALF_WIDTHS if rollers else ROLLER_HALF_WIDTHS[:1]
    candidates = [made(grade, half) for half in halves for grade in finer]
    return next((candidate for candidate in candidates if candidate.half_width <= step), candidates[-1])


def _grades(group: ClearanceParts, part: Part) -> dict[str, float]:
    try:
        return grade_tolerances(part.nominal)
    except MethodError as error:
        why = f"{part.name} of {part.nominal:g} mm {error}"
        raise InputError(f"{group.factor}: {why}; leave --tolerances and --chains out") from None


class PartWidth(Record):
    """Nominal and width of the tolerance of a part [mm]."""

    nominal_mm: float
    width_mm: float


class Grade(NamedTuple):
    """Grade of the parts of a tolerance, such as "IT5" or `FINER`, its place in `GRADES` (-1: finer than all), and the parts."""

    name: str
    place: int
    parts: dict[str, PartWidth]

    def finer_than(self, number: int) -> bool:
        """Whether it is finer than the grade of this number."""
        return self.place < GRADES.index(f"IT{number}")


class Made(Record):
    """The half width that the parts of a factor are made to, their grade, and the chain that closes on it."""

    half_width: float
    grade: str | None
    chain: str


class SharedTolerance(Record):
    """``parts`` that share a tolerance in the worst case, and the widths [mm] ``taken`` by graded parts."""

    parts: tuple[Part, ...]
    taken: tuple[float, ...] = ()

    def grade(self, width: float) -> Grade:
        """The widest grade of the parts that fits a width [mm]. Raises MethodError for a size outside the tables."""
        tables = {part.name: list(grade_tolerances(part.nominal).values()) for part in self.parts}

        def width_of(place: int) -> float:
            return sum((*(abs(part.coefficient) * tables[part.name][place] for part in self.parts), *self.taken))

        fitting = [place for place in range(len(GRADES)) if width_of(place) <= width * (1.0 + 1e-9)]
        if not fitting:
            return Grade(FINER, -1, {})
        best = fitting[-1]
        parts = {part.name: PartWidth(part.nominal, tables[part.name][best]) for part in self.parts}
        return Grade(GRADES[best], best, parts)


def grades_of(study: Problem, scene: Scene, point: Array, half_widths: Array) -> dict[str, Grade]:
    """Grades by factor of half widths (k,) about a point (k,), whose scene it is; none for a factor that is no length in ISO 286."""
    groups, grades = clearance_parts(scene), {}
    closing = {chain.factor: chain for chain in reversed(study.file.chain)}
    for factor, value, half in zip(study.file.factor, point.tolist(), half_widths.tolist(), strict=True):
        chain = _chain_at(study, closing.get(factor.name), value, half) if half > 0.0 else None
        if chain is not None and not chain.is_stated:
            if (grade := _allocated_grade(chain)) is not None:
                grades[factor.name] = grade
            continue
        shared = _of_scene(groups, factor.key, factor.name, value)
        if shared is None or math.isnan(half):
            continue
        try:
            grades[factor.name] = shared.grade(2.0 * half)
        except MethodError:
            # No grade is listed for a part of this size.
            continue
    return grades


def _chain_at(study: Problem, chain: StudyChain | None, value: float, half_width: float) -> Chain | None:
    """A chain at a value and a half width [mm], whatever it states itself; None without a chain."""
    if chain is None:
        return None
    free = chain.model_copy(update={"half_width_mm": None})
    try:
        return chain_from(study.chain_table(free, value, half_width), chain.name)
    except InputError:
        # The solution of the chain names its faults.
        return None


def _allocated_grade(chain: Chain) -> Grade | None:
    """Grades of the parts that the chain allocates, so that a tolerance has those of the parts to make; None without a solution."""
    try:
        parts = Allocation(chain).allocated()
    except (InputError, MethodError, NoValueError):
        return None
    return Grade(FINER, -1, {}) if parts is None else grade_of_parts(parts)


def grade_of_parts(parts: Iterable[ChainPart]) -> Grade | None:
    """Grades of the allocated parts as their table states them, "IT3 and IT4"; its place is that of the finest."""
    made = {part.name: part for part in parts if part.origin == "allocated"}
    words = {name: grade_words(part) for name, part in made.items()}
    # What is finer than a grade lies below it.
    ladder = {word: GRADES.index(word.split()[-1]) - word.startswith("finer") for word in words.values() if word}
    if not ladder or not all(words.values()):
        return None
    widths = {name: PartWidth(part.nominal_mm, part.tolerance_mm) for name, part in made.items()}
    return Grade(all_of(sorted(ladder, key=ladder.__getitem__)), min(ladder.values()), widths)


def _of_scene(groups: Mapping[str, ClearanceParts], key: str, name: str, value: float) -> SharedTolerance | None:
    """Parts of a clearance of the scene, or a length of the scene as a part by itself."""
    group = groups.get(key.rpartition(".")[2])
    if group is None:
        sized = key.endswith("_mm") and value >= SMALLEST_SIZE
        return SharedTolerance((Part(name, 1.0, value, key),)) if sized else None
    rollers = [2.0 * LOT * abs(part.coefficient) for part in group.parts if part.graded]
    return SharedTolerance(tuple(part for part in group.parts if not part.graded), tuple(rollers))
