"""Tables of STUDY.toml: factors and the design; goals, the front, its search and the widest tolerances; chains; duty.

Over a duty a response is one figure of all points. Its limits hold at points: each of them becomes a response of its own,
without a goal, so that every step of a study treats it like any other limit.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal, get_args

from pydantic import AfterValidator, Field, model_validator

from rbdyn.base.faults import Consistent, Figure, Name, NonNegative, Number, Positive, Strict, no_power_of_two
from rbdyn.scene.duty import DutyPoint, point_faults, shares_of_time
from rbdyn.verdict.orbits import CageClass

# Classes that a limit may name.
CLASSES = [name for name in get_args(CageClass) if name != "not judged"]


def split_classes(text: str) -> list[str]:
    """Names between upright strokes."""
    return [name.strip() for name in text.split("|") if name.strip()]


def _classes(text: str) -> str:
    """The text of a limit on the class of a cage. Raises ValueError unless it names one to four of them."""
    names = split_classes(text)
    unknown = [name for name in names if name not in CLASSES]
    if unknown or not names or set(names) == set(CLASSES):
        raise ValueError(f'must name some of {", ".join(CLASSES)}, with "|" between them')
    return text


# Smallest ratio of a step to its value, and of a resolution to its step; a finer one is lost in rounding.
FINEST = 1e-9


class Factor(Consistent):
    """A factor: its name, its key in the scene, its values."""

    name: Name
    """Name of the factor in tables and messages."""
    key: Annotated[str, Field(min_length=3)] = ""
    """Key of the factor in the scene file, such as cage.pocket_clearance_mm. Required with [scene]."""
    centre: Number
    """Value at coded 0."""
    step: Positive
    """Change of the value per coded unit."""
    resolution: Positive | None = None
    """Resolution of the drawing, to which the selected design is rounded. Default: no rounding."""
    tolerance: Positive | None = None
    """Manufacturing tolerance, as a half width."""
    whole: bool = False
    """Whether the factor is an integer, such as the number of rollers. Runs and the selected design are then rounded."""
    allowed: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    """Lowest and highest value of an adaptive search. Default: the search stays in the design region."""

    def faults(self) -> Iterator[str]:
        if self.step < FINEST * abs(self.centre):
            yield f"step = {self.step:g}: is lost in rounding next to centre = {self.centre:g}; widen it"
        if self.resolution is not None and self.resolution < FINEST * self.step:
            yield (
                f"resolution = {self.resolution:g}: makes more than {1.0 / FINEST:g} steps of step = {self.step:g}; "
                "coarsen it"
            )
        if self.whole and self.resolution is not None:
            yield f"resolution = {self.resolution:g}: whole = true has none but 1; leave it out"
        if self.whole and self.tolerance is not None:
            yield f"tolerance = {self.tolerance:g}: whole = true has none; leave it out"
        if self.whole and self.step < 1.0:
            yield f"step = {self.step:g}: is less than a whole number; widen it"

    @property
    def finest(self) -> float | None:
        """Resolution of the factor; None without one."""
        return 1.0 if self.whole else self.resolution


Kind = Literal[
    "central_composite", "box_behnken", "full_factorial", "latin_hypercube", "sobol", "definitive_screening",
    "d_optimal", "i_optimal",
]  # fmt: skip
Alpha = Literal[
    "rotatable", "spherical", "orthogonal_blocks", "orthogonal_columns", "practical", "face_centred", "inscribed"
]

# Keys of only some kinds of design.
KEYS_OF = {
    "central_composite": {"alpha", "cube", "blocks"},
    "box_behnken": {"blocks"},
    "full_factorial": {"levels"},
    "latin_hypercube": {"runs"},
    "sobol": {"runs"},
    "definitive_screening": set[str](),
    "d_optimal": {"runs"},
    "i_optimal": {"runs"},
}
# Runs at the centre by default.
CENTRES = {"central_composite": 6, "box_behnken": 6, "definitive_screening": 1}


class Design(Consistent):
    """The runs and their order. Optimal designs are optimal for the terms of all response models."""

    kind: Kind = "central_composite"
    """Kind of design."""
    alpha: Alpha | Annotated[float, Field(gt=0.0, le=10.0)] = "rotatable"
    """Distance of the star points of a central composite design in coded units, by a rule or as a number."""
    cube: Literal["full", "resolution_v"] = "full"
    """Cube of a central composite design: all corners, or a fraction of resolution V."""
    centre_replicates: Annotated[int, Field(ge=0, le=100)] | None = None
    """Runs at the centre. Default: 6 for central composite and Box-Behnken designs, 1 for definitive screening, otherwise
    none."""
    blocks: bool = False
    """Whether the runs form orthogonal blocks."""
    levels: Annotated[int, Field(ge=2, le=100)] = 3
    """Levels of each factor in a full factorial design."""
    runs: Annotated[int, Field(ge=2, le=10000)] = 60
    """Runs of a Latin hypercube or Sobol sequence. For an optimal design it is required: its runs without those at the
    centre."""
    order: Literal["standard", "random"] = "standard"
    """Order of the runs. In either order the seed of a run is seed plus its place in the standard order."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the design and of its runs."""
    fewest_replicates: Annotated[int, Field(ge=2, le=10000)] = 4
    """Replicates of each run at first. Default: 4, or numerics.replicates if it is less than 8. Effect: runs get the others only
    if noise exceeds a tenth of the variance of a predicted response with a goal, or a run is near a limit. They also get them
    if replicates of a run differ about limits.cage."""

    @property
    def centres(self) -> int:
        """Number of centre points."""
        return CENTRES.get(self.kind, 0) if self.centre_replicates is None else self.centre_replicates

    def faults(self) -> Iterator[str]:
        alien = self.model_fields_set & set().union(*KEYS_OF.values()) - KEYS_OF[self.kind]
        yield from (
            f"{key}: kind = {self.kind!r} has no such key; remove it or choose another kind"
            for key in type(self).model_fields
            if key in alien
        )
        if self.kind in ("d_optimal", "i_optimal") and "runs" not in self.model_fields_set:
            yield f"runs: missing; kind = {self.kind!r} needs the number of runs to make"


# Keys by which a response wishes for something beyond its limits.
WISHES = {"goal", "target", "weight"}


class Goal(Consistent):
    """Goal and limits of a response."""

    goal: Literal["min", "max", "target", "none"] = "min"
    """Goal: a small value, a large one, one near target, or "none" (the response is only observed or limited). A response with
    a limit but without goal, target and weight has the goal "none"."""
    target: Figure | None = None
    """Desired value, for goal = "target"."""
    lower: Figure | None = None
    """Limit that the response must not fall below."""
    upper: Figure | None = None
    """Limit that the response must not exceed."""
    weight: Positive = 1.0
    """Weight of the response if front.pick is "desirability" or "weights"."""

    @model_validator(mode="before")
    @classmethod
    def _limits_only(cls, data: Any) -> Any:
        if not isinstance(data, Mapping) or not {"lower", "upper"} & data.keys() or WISHES & data.keys():
            return data
        return {**data, "goal": "none"}

    def faults(self) -> Iterator[str]:
        if self.goal == "target" and self.target is None:
            yield 'target: missing; goal = "target" needs the desired value'
        if self.goal != "target" and self.target is not None:
            yield f'target = {self.target}: goal = "{self.goal}" has none; write goal = "target"'
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            yield f"lower = {self.lower}: must be below upper = {self.upper}"


class Front(Strict):
    """NSGA-II on the surfaces, within the region of the design."""

    population: Annotated[int, Field(ge=8, le=10000)] = 100
    """Points of a generation."""
    generations: Annotated[int, Field(ge=1, le=100000)] = 200
    """Generations of the search."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the search."""
    pick: Literal["knee", "desirability", "weights"] = "knee"
    """Rule that selects a design among the points of the front that dominate the baseline."""
    draws: Annotated[int, Field(ge=100, le=100000)] = 1000
    """Random draws of the surfaces for the front's uncertainty."""
    tolerance_aware: Literal["none", "worst_case", "quantile"] = "none"
    """Second front that allows for the factors' tolerances, by the worst case or by a quantile of the parts."""
    quantile: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.95
    """Quantile of a tolerance-aware front."""
    distribution: Literal["normal", "uniform"] = "normal"
    """Distribution of the parts within the tolerances."""


class Adaptive(Strict):
    """The search with emulators, which begins with the runs of the design."""

    budget: Annotated[int, Field(ge=10, le=10000)] = 100
    """Number of all runs: the design, the search, and a last fifth for confirmation at the points of the front."""
    batch: Annotated[int, Field(ge=1, le=1000)] = 8
    """Runs per batch. Effect: larger batches keep more workers busy; smaller batches choose each run slightly better."""
    extend: bool = True
    """Whether the design region grows where the front lies at its bound, up to the factors' "allowed" ends."""
    least_clearance_um: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 0.0
    """Least diametral clearance in operation (mounted, hot and at speed) wherever the region grows; below 0 the bearing is
    preloaded. The least guide clearance follows from the scene, by the floor of the land's film."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the search and its runs."""
    set: list[str] = []
    """Keys that differ from the scene file in these runs, as "key=value". A run whose results drift grows to twice its turns
    at most, unless numerics.extend_limit is set here or is less in the scene file."""


class Robust(Consistent):
    """Whether the pick beats the baseline over the unknown inputs of the scene: with --robust, or where this table is written."""

    points: Annotated[int, Field(ge=32, le=1024)] = 256
    """Number of input sets, a power of two. Baseline and selected design are simulated at each of them."""
    settle: Annotated[float, Field(ge=0.0, le=4.0)] = 0.5
    """Further simulations of input sets with a doubtful improvement, as a share of the first simulations."""
    front: Literal["quantile", "mean", "none"] = "quantile"
    """Robust front, by the quantile or the mean of each improvement over the unknown inputs. Some of its points are
    simulated."""
    quantile: Annotated[float, Field(gt=0.0, lt=0.5)] = 0.1
    """Quantile of a robust front: the share of input sets in which the improvement is smaller."""

    def faults(self) -> list[str]:
        return no_power_of_two("points = ", self.points)


class Tolerances(Strict):
    """Widest tolerances of the factors about the pick."""

    probability: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Probability that a part keeps the required share of every improvement that counts, and meets all limits."""
    keep: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    """Share of each improvement that the parts must keep, unless at_least states it."""
    gains: Annotated[list[str], Field(min_length=1)] | None = None
    """Responses whose improvement the parts must keep, in addition to those in at_least. Default (neither key set): every
    predicted improvement of at least three times smallest_difference_percent; if there is none, every significant
    improvement."""
    at_least: dict[str, NonNegative] = {}
    """Smallest improvement that the parts must keep, by response, in percent of the baseline."""
    smallest_difference_percent: Positive = 1.0
    """Smallest difference of a response that matters, in percent of the baseline."""
    finest_grade: Annotated[int, Field(ge=1, le=18)] = 4
    """Finest ISO 286 grade that can be manufactured. Effect: finer parts cause a warning that names the response
    responsible."""
    distribution: Literal["normal", "uniform"] = "normal"
    """Distribution of the parts within the tolerances."""
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 4096
    """Number of random parts."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the parts."""


class CageLimit(Strict):
    """Limits on the cage."""

    verdict: Annotated[str, AfterValidator(_classes)] | None = None
    """Classes that the cage may have by its orbit, such as "held|circling", at every operating point. The selected design
    meets the limit if its replicates show one of these classes, and violates it if they show another. Surfaces cannot predict
    a class, so front and selected design stay where the cage of the nearest run meets the limit. With --robust the probability
    is the mean share of replicates with one of these classes over the input sets."""


class OtherLimits(Strict):
    """Limits that no figure has."""

    cage: CageLimit = CageLimit()
    """Limits on the cage."""

    @property
    def classes(self) -> tuple[str, ...]:
        """Classes that the cage may have; empty without a limit."""
        return tuple(split_classes(self.cage.verdict or ""))

    @property
    def share_of_classes(self) -> str:
        """Name of the share of bearings alike whose cage has one of the classes."""
        return f"cage_{'_or_'.join(self.classes).replace(' ', '_')}_share"


class StudyChain(Consistent):
    """Dimension chain whose closing link is the picked value of a factor. Its links are here or in a file."""

    name: Annotated[str, Field(min_length=1)]
    """Name of the chain."""
    factor: str
    """Factor whose selected value the chain must produce."""
    half_width_mm: Annotated[float, Field(gt=0.0)] | None = None
    """Half width of the closing link about the selected value. Default: the widest tolerance of the factor that the study
    finds."""
    file: str | None = None
    """CHAIN.toml next to the study, with the links under the chain's name."""
    link: list[dict[str, Any]] = []
    """Links, as in a CHAIN.toml."""
    allocate: dict[str, Any] = {}
    """Allocation of the tolerances, as in a CHAIN.toml."""
    monte_carlo: dict[str, Any] = {}
    """Monte Carlo of the assemblies, as in a CHAIN.toml."""
    selective: dict[str, Any] | None = None
    """Selective assembly, as in a CHAIN.toml."""

    def faults(self) -> Iterator[str]:
        if self.file is None and not self.link:
            yield "link: missing; give the links, or the file that has them"
        if self.file is not None and (self.link or self.allocate or self.monte_carlo or self.selective):
            yield f"file = {self.file!r}: states the links with all their settings; leave out the file or these"


Aggregate = Literal["mean", "worst", "worst_relative"]


class OverDuty(Goal):
    """How a response follows from its figures at the points of the duty."""

    aggregate: Aggregate = "mean"
    """How the operating points of [[duty]] are combined. "mean" weights them by their shares. "worst" is the worst of them for
    the goal, or the largest without a goal. "worst_relative" is the worst ratio to the baseline at one point."""
    points: Annotated[list[str], Field(min_length=1)] | None = None
    """Names of the points of [[duty]] at which the limits of the response hold. Default: all."""


def at_point(point: str, figure: str) -> str:
    """Name of a figure at a point of the duty."""
    return f"{point}: {figure}"


def alike(points: Sequence[DutyPoint]) -> bool:
    """Whether all points have the same overrides, in whatever order, and begin alike."""
    return len({(frozenset(point.set), point.origin) for point in points}) <= 1


def shares_of(points: Sequence[DutyPoint]) -> dict[str, float]:
    """Shares of the time by name of the point, in the order of the names: they do not depend on that of the tables."""
    return dict(sorted(zip((point.name for point in points), shares_of_time(points), strict=True)))


def duty_faults(
    points: Sequence[DutyPoint],
    responses: Mapping[str, OverDuty],
    normalise: bool,
    claims: Mapping[tuple[str, ...], str],
    has_scene: bool,
) -> Iterator[str]:
    """Faults of a duty and of the responses' keys on it; ``claims``: keys that no point may set, with the reasons."""
    if not points:
        if normalise:
            yield "normalise_shares = true: there is no [[duty]] with shares; add one or leave it out"
        yield from (
            f"response.{key} of {name}: needs points of a duty; add [[duty]] or leave it out"
            for name, response in responses.items()
            for key in ("aggregate", "points")
            if key in response.model_fields_set
        )
        return
    if not has_scene:
        yield "duty: it needs a scene to set its keys; add [scene]"
    yield from point_faults(points, normalise, claims)
    names = [point.name for point in points]
    for name, response in responses.items():
        yield from _limit_faults(name, response, names)


def _limit_faults(response_name: str, response: OverDuty, names: Sequence[str]) -> Iterator[str]:
    if response.points is None:
        return
    where = f"response.points of {response_name}"
    if response.lower is None and response.upper is None:
        yield f"{where}: the response has no limit to hold there; add lower or upper, or leave it out"
    for name, count in Counter(response.points).items():
        if name not in names:
            yield f"{where} = {name!r}: no such point of the duty; name one of {', '.join(dict.fromkeys(names))}"
        elif count > 1:
            yield f"{where} = {name!r}: used more than once; name each once"
