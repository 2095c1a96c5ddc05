"""Goals of the responses, the front, the direct front and the widest tolerances of STUDY.toml."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rbdyn.faults import Strict
from rbdyn.fields import or_refuse


class Goal(Strict):
    """What is wanted of a response.

    ``goal``: small, large, near ``target``, or nothing ("none": watched, or held by its limits only). ``lower`` and
    ``upper`` are limits that it must keep. ``weight`` is its weight in the desirability and weights picks. ``desired``
    are the ends of its desirability: nil at one, full at the other (for a target nil at both).
    """

    goal: Literal["min", "max", "target", "none"] = "min"
    target: float | None = None
    lower: float | None = None
    upper: float | None = None
    weight: Annotated[float, Field(gt=0.0)] = 1.0
    desired: Annotated[list[float], Field(min_length=2, max_length=2)] | None = None

    @model_validator(mode="after")
    def _goal_is_whole(self) -> Self:
        faults = []
        if self.goal == "target" and self.target is None:
            faults.append('target: missing; goal = "target" needs the number to come near to')
        if self.goal != "target" and self.target is not None:
            faults.append(f'target = {self.target}: goal = "{self.goal}" has none; write goal = "target"')
        if self.lower is not None and self.upper is not None and self.lower >= self.upper:
            faults.append(f"lower = {self.lower}: must be below upper = {self.upper}")
        if self.desired is not None:
            low, high = self.desired
            if self.goal == "none":
                faults.append(f'desired = {self.desired}: goal = "none" desires nothing; leave it out')
            elif low >= high:
                faults.append(f"desired = {self.desired}: must rise; write the lower end first")
            elif self.target is not None and not low < self.target < high:
                faults.append(f"desired = {self.desired}: must have target = {self.target} between its ends")
        return or_refuse(self, faults)


class Front(Strict):
    """NSGA-II on the surfaces, within the region of the design.

    ``pick``: the rule that makes the pick, among the points that dominate the baseline. ``draws``: surfaces drawn for
    its uncertainty. ``tolerance_aware``: a second front of what the tolerances of the factors leave of a point, its
    worst case or its ``quantile`` over ``tolerance_samples`` parts of the ``distribution``.
    """

    population: Annotated[int, Field(ge=8, le=10000)] = 100
    generations: Annotated[int, Field(ge=1, le=100000)] = 200
    seed: Annotated[int, Field(ge=0)] = 1
    pick: Literal["knee", "desirability", "weights"] = "knee"
    draws: Annotated[int, Field(ge=100, le=100000)] = 1000
    tolerance_aware: Literal["none", "worst_case", "quantile"] = "none"
    quantile: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.95
    distribution: Literal["normal", "uniform"] = "normal"
    tolerance_samples: Literal[64, 128, 256, 512, 1024, 2048, 4096] = 256


class Direct(Strict):
    """NSGA-II on the simulator itself.

    ``replicates`` of each evaluation, each of ``turns`` shaft turns of which the first ``discard_turns`` are left out as
    transient; without them a run is as long as a design run. What is counted must hold a whole window of the impact.
    ``confidence`` at which differences count in the search;
    ``resample``: share of the evaluations for fresh runs of the points found; ``set`` replaces keys of the scene.
    """

    evaluations: Annotated[int, Field(ge=50, le=10_000_000)] = 2000
    population: Annotated[int, Field(ge=8, le=10000)] = 50
    # Fewer than a design run has: the search makes up for it by the number of its runs.
    replicates: Annotated[int, Field(ge=2, le=10000)] = 3
    turns: Annotated[float, Field(gt=0.0)] | None = None
    discard_turns: Annotated[float, Field(ge=0.0)] | None = None
    seed: Annotated[int, Field(ge=0)] = 1
    confidence: Annotated[float, Field(gt=0.5, lt=1.0)] = 0.95
    resample: Annotated[float, Field(ge=0.1, le=0.9)] = 0.3
    set: list[str] = []

    @model_validator(mode="after")
    def _something_is_counted(self) -> Direct:
        if self.turns is not None and (self.discard_turns or 0.0) >= self.turns:
            raise ValueError(
                f"discard_turns = {self.discard_turns:g}: must be below turns = {self.turns:g}; discard fewer"
            )
        return self


class Tolerances(Strict):
    """Widest tolerances of the factors about the pick: ``probability`` that a part keeps the share ``keep`` of every
    predicted gain, and all limits.

    ``aim``: "ratios" keeps the ratios of the factors' own tolerances (of their steps, where one has none); "product"
    and "sum" maximise that of the half widths. ``surface_uncertainty``: count the errors of the surfaces too.
    """

    probability: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.95
    keep: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    aim: Literal["ratios", "product", "sum"] = "ratios"
    distribution: Literal["normal", "uniform"] = "normal"
    surface_uncertainty: bool = False
    samples: Annotated[int, Field(ge=100, le=1_000_000)] = 4096
    seed: Annotated[int, Field(ge=0)] = 1
