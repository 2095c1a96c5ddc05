"""Goals of the responses, the front, its searches and the widest tolerances of STUDY.toml."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from rbdyn.faults import Consistent, Strict
from rbdyn.fields import Figure, Positive, no_power_of_two


class Goal(Consistent):
    """What is wanted of a response."""

    goal: Literal["min", "max", "target", "none"] = "min"
    """What is wanted: small, large, near target, or nothing (watched, or held by its limits only)."""
    target: Figure | None = None
    """Value to come near to, for goal = "target"."""
    lower: Figure | None = None
    """Limit that the response must not fall below."""
    upper: Figure | None = None
    """Limit that the response must not exceed."""
    weight: Positive = 1.0
    """Weight in the desirability and weights picks."""
    desired: Annotated[list[Figure], Field(min_length=2, max_length=2)] | None = None
    """Ends of the desirability: nil at one, full at the other (for a target nil at both)."""

    def faults(self) -> Iterator[str]:
        if self.goal == "target" and self.target is None:
            yield 'target: missing; goal = "target" needs the number to come near to'
        if self.goal != "target" and self.target is not None:
            yield f'target = {self.target}: goal = "{self.goal}" has none; write goal = "target"'
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            yield f"lower = {self.lower}: must be below upper = {self.upper}"
        if self.desired is not None:
            low, high = self.desired
            if self.goal == "none":
                yield f'desired = {self.desired}: goal = "none" desires nothing; leave it out'
            elif low >= high:
                yield f"desired = {self.desired}: must rise; write the lower end first"
            elif self.target is not None and not low < self.target < high:
                yield f"desired = {self.desired}: must have target = {self.target} between its ends"


class Front(Strict):
    """NSGA-II on the surfaces, within the region of the design."""

    population: Annotated[int, Field(ge=8, le=10000)] = 100
    """Points of a generation."""
    generations: Annotated[int, Field(ge=1, le=100000)] = 200
    """Generations of the search."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the search."""
    pick: Literal["knee", "desirability", "weights"] = "knee"
    """Rule that makes the pick among the points of the front that dominate the baseline."""
    draws: Annotated[int, Field(ge=100, le=100000)] = 1000
    """Surfaces drawn for the front's uncertainty."""
    tolerance_aware: Literal["none", "worst_case", "quantile"] = "none"
    """A second front, of what the factors' tolerances leave of a point: its worst case or its quantile."""
    quantile: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.95
    """Quantile of a tolerance-aware front."""
    distribution: Literal["normal", "uniform"] = "normal"
    """How parts scatter within the tolerances."""
    tolerance_samples: Literal[64, 128, 256, 512, 1024, 2048, 4096] = 256
    """Parts drawn for a quantile."""


class Adaptive(Strict):
    """The search with emulators, from the runs of the design on."""

    budget: Annotated[int, Field(ge=10, le=10000)] = 100
    """Runs, those of the design and the last fifth, fresh ones at the points of the front, included."""
    batch: Annotated[int, Field(ge=1, le=1000)] = 8
    """Runs chosen at once, so that many workers have work; the search knows a little less of each than one by one."""
    extend: bool = True
    """Whether the region grows where the front lies at its edge, as far as the factors' "allowed" permit."""
    least_clearance_um: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 0.0
    """Diametral clearance that is left to the bearing in operation, mounted, hot and at speed, wherever the region grows: below
    0 it would be preloaded. What the floor of the land's film needs of the guide clearance the scene itself demands."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the search and its runs."""
    set: list[str] = []
    """Keys of the scene that are replaced, as "key=value". Where figures drift, a run is lengthened to twice the turns asked for
    at most, unless numerics.extend_limit stands here or is less in the scene."""


class Robust(Consistent):
    """Whether the pick beats the baseline over what is not known of the scene, with --robust."""

    points: Annotated[int, Field(ge=32, le=1024)] = 256
    """Input sets, a power of two; the baseline and the pick are simulated at each."""
    settle: Annotated[float, Field(ge=0.0, le=4.0)] = 0.5
    """Further simulations, as a share of the first, spent on the input sets where a gain is in doubt."""
    front: Literal["quantile", "mean", "none"] = "quantile"
    """A front of what holds over the unknowns: the quantile or the mean of each gain over the baseline; some of its points are
    simulated beside the pick."""
    quantile: Annotated[float, Field(gt=0.0, lt=0.5)] = 0.1
    """Quantile of a robust front: in how many of the cases a gain may be less."""

    def faults(self) -> list[str]:
        return no_power_of_two("points = ", self.points)


class Tolerances(Strict):
    """Widest tolerances of the factors about the pick."""

    probability: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    """Probability that a part keeps its share of every predicted gain, and all limits."""
    keep: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    """Share of each predicted gain that must be kept."""
    aim: Literal["ratios", "product", "sum"] = "ratios"
    """"ratios" keeps the ratios of the factors' own tolerances (of their steps, where one has none); "product" and
    "sum" maximise that of the half widths."""
    distribution: Literal["normal", "uniform"] = "normal"
    """How parts scatter within the tolerances."""
    surface_uncertainty: bool = False
    """Whether the errors of the surfaces count too."""
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 4096
    """Parts drawn."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the parts."""
