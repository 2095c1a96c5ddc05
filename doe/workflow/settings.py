"""What a study asks, as its record states it: factors with their ranges, responses with their goals, and the settings of its runs."""

import math
from string import ascii_uppercase
from typing import Any, Self

from doe.duty import main_scene
from doe.study_file.duty import OverDuty
from doe.study_file.sections import Goal
from doe.workflow.problem import Problem
from rbdyn.base.records import Record, spread
from rbdyn.base.words import label, quantity


class Factor(Record):
    """A factor as its study states it: ``centre`` and ``step`` of the coded unit, the region from ``low`` to ``high``.

    ``resolution`` of the drawing; ``tolerance``: half width of its parts; None where the study states none.
    """

    letter: str
    name: str
    key: str
    centre: float
    step: float
    resolution: float | None
    low: float
    high: float
    tolerance: float | None

    @property
    def words(self) -> str:
        """Its name without the unit."""
        return quantity(self.name)[0]

    @property
    def unit(self) -> str:
        return quantity(self.name)[1]

    @property
    def decimals(self) -> int:
        """Decimals of the resolution of the drawing, or of a hundredth of the step."""
        return min(max(-math.floor(math.log10(self.resolution or self.step / 100.0) + 1e-9), 0), 9)

    def text(self, value: float | None, further: int = 0) -> str:
        """A value to the resolution of the drawing, or ``further`` decimals beyond."""
        return "" if value is None else f"{value:.{self.decimals + further}f}"


class PointsOfDuty(Record):
    """How a response follows from its figures at the points of a duty; a limit at one ``point`` is that of its ``figure`` there."""

    aggregate: str
    points: list[str] | None
    figure: str | None = None
    point: str | None = None


class Response(Record):
    """A response with its goal, limits and the ``model`` of its surface; ``over_duty`` is None without a duty."""

    goal: str
    target: float | None
    lower: float | None
    upper: float | None
    weight: float
    model: str
    transform: str | float
    name: str
    over_duty: PointsOfDuty | None = spread(default=None)

    @property
    def is_ratio(self) -> bool:
        """Whether it is the worst ratio to the baseline over a duty."""
        return self.over_duty is not None and self.over_duty.aggregate == "worst_relative"

    @property
    def label(self) -> str:
        """'impact force [N]'; over a duty 'impact force, worst ratio' where it is one."""
        return f"{quantity(self.name)[0]}, worst ratio" if self.is_ratio else label(self.name)

    @property
    def bounds(self) -> list[float]:
        """Its limits, the lower one first."""
        return [bound for bound in (self.lower, self.upper) if bound is not None]


class Asked(Record):
    """Factors and responses in the order of the study."""

    factors: list[Factor]
    responses: list[Response]

    @staticmethod
    def of(study: Problem) -> "Asked":
        """What a study states."""
        reach, widths = study.reach, study.known_tolerances
        low, high = (study.actual(side * reach).tolist() for side in (-1.0, 1.0))
        without = set() if study.shares else set(OverDuty.model_fields) - set(Goal.model_fields)
        return Asked(
            [
                Factor(
                    letter=letter,
                    **factor.model_dump(include={"name", "key", "centre", "step", "resolution"}),
                    low=low[index],
                    high=high[index],
                    tolerance=widths.get(factor.name),
                )
                for index, (letter, factor) in enumerate(zip(ascii_uppercase, study.file.factor, strict=False))
            ],
            [Response.from_dict(response.model_dump(exclude=without)) for response in study.file.response],
        )

    @property
    def names(self) -> list[str]:
        """Names of the responses."""
        return [response.name for response in self.responses]

    @property
    def columns(self) -> list[str]:
        """Names of the factors."""
        return [factor.name for factor in self.factors]

    def response(self, name: str) -> Response:
        """The response of a name."""
        return next(response for response in self.responses if response.name == name)


class Settings(Asked):
    """What a whole study asks: its files, the ``scene`` of its runs, factors and responses, and its runs a point."""

    study_file: str
    scene_file: str
    scene: dict[str, Any]
    replicates: int
    turns: float
    confirmation_replicates: int

    @classmethod
    def of_runs(cls, study: Problem) -> Self:
        """What a study with a scene states."""
        scene, asked = main_scene(study.design_scenes(study.baseline[None])[0]), Asked.of(study)
        return cls(
            factors=asked.factors,
            responses=asked.responses,
            study_file=study.path.name,
            scene_file=study.scene.file,
            scene=scene.model_dump(mode="json", exclude_none=True),
            replicates=scene.numerics.replicates,
            turns=scene.numerics.turns,
            confirmation_replicates=study.file.confirmation.replicates,
        )
