"""What the surfaces promise at any point: gains over the baseline, with the interval of the difference."""

import math
from collections.abc import Sequence

import numpy as np
from scipy import stats

from doe.arrays import Array
from doe.pareto.front import contrast_error
from doe.response_surface import Surface
from doe.response_surface.model_error import correlation
from doe.study.drawn import jacobian, predict_all
from doe.study.goals import goals_of
from doe.study_file import Study
from rbdyn.base.words import error_alone, improvement
from rbdyn.records.record import Record, derived, keyed, outside_json


def verdict(percent: float, error: float) -> str:
    """Whether a gain is more than its error."""
    if abs(percent) <= error:
        return "within error"
    return "better" if percent > 0.0 else "worse"


class PredictedGain(Record):
    """Improvement [%] of a mean response over the baseline, with two 95 % half widths [%].

    ``error`` is that of the difference of the two predictions: the errors that they share cancel (contrast c'Vc, and
    what the model misses at either point, with the degrees of freedom of `Surface.interval_dof`). ``scatter`` is by how much two single runs at one point differ (pure error of
    the replicates), and ``within_scatter`` whether the gain is no more; both None where no run is repeated.
    """

    response: str = outside_json()
    baseline: float = outside_json()
    value: float = outside_json()
    percent: float
    error: float = keyed("error_percent")
    verdict: str = derived(lambda self: verdict(self.percent, self.error))
    scatter: float | None = keyed("single_run_scatter_percent")
    goal: str = "min"
    within_scatter: bool | None = derived(
        lambda self: None if self.scatter is None else abs(self.percent) <= self.scatter, "within_single_run_scatter"
    )

    @property
    def sentence(self) -> str:
        """The gain in words."""
        changed = improvement(self.percent, self.error, self.goal)
        said = f"{self.response}: {self.baseline:.5g} to {self.value:.5g}, {changed}"
        judged = {
            "within error": "which is inside its own noise",
            "better": "which is more than its error",
            "worse": "a loss that is more than its error",
        }[self.verdict]
        if self.scatter is None:
            return f"{said}, {judged}."
        place = "inside" if self.within_scatter else "outside"
        return f"{said}, {judged} and {place} the scatter of single runs ({error_alone(self.scatter)} %)."


def predicted_gains(study: Study, surfaces: Sequence[Surface], point: Array) -> list[PredictedGain]:
    """Gains at a point (k,) in factor units over the study's baseline, for every response that has a goal."""
    goals = goals_of(study)
    coded = study.coded(np.stack([study.baseline, point]))
    values = predict_all(surfaces, coded)
    costs, slopes = goals.costs(values), goals.slopes(values)
    gains = []
    for column, index in enumerate(goals.objectives):
        surface = surfaces[index]
        rows = [slopes[end, column] * jacobian(surface, coded[end]) for end in (0, 1)]
        scale = 100.0 / abs(float(values[0, index])) if values[0, index] else math.nan
        shared = contrast_error(rows[0] - rows[1], surface.covariance)
        error = float(stats.t.ppf(0.975, surface.interval_dof)) * math.hypot(shared, _missed(surface, coded, rows))
        pure, scatter = surface.pure_error, None
        if pure["ms"] is not None and surface.residual_mean_square > 0.0:
            constant = surface.terms.index("1")
            # With weights the mean squares have no unit; the variance of a run has.
            variance = pure["ms"] / surface.residual_mean_square * surface.observation_variance
            single = math.sqrt(variance * sum(float(row[constant]) ** 2 for row in rows))
            scatter = float(stats.t.ppf(0.975, pure["df"])) * single
        gains.append(
            PredictedGain(
                response=surface.name,
                baseline=float(values[0, index]),
                value=float(values[1, index]),
                percent=float(scale * (costs[0, column] - costs[1, column])),
                error=error * scale,
                scatter=None if scatter is None else scatter * scale,
                goal=study.file.response[index].goal,
            )
        )
    return gains


def _missed(surface: Surface, coded: Array, rows: Sequence[Array]) -> float:
    """Standard deviation of the difference of what the model misses at two coded points (2, k).

    ``rows`` are the derivatives of either cost by the coefficients; that by the constant is that by the field.
    """
    if surface.model_error is None:
        return 0.0
    constant = surface.terms.index("1")
    by_field = np.array([float(row[constant]) for row in rows]) * [1.0, -1.0]
    variance = surface.model_error.variance * float(by_field @ correlation(coded, coded) @ by_field)
    return math.sqrt(max(variance, 0.0))


# What a verdict amounts to.
AMOUNT = {"better": "better beyond its error", "worse": "worse beyond its error", "within error": "not significant"}


def statement(gains: Sequence[PredictedGain]) -> str:
    """What the gains amount to, in a sentence."""
    parts = []
    for verdict, words in AMOUNT.items():
        names = [gain.response for gain in gains if gain.verdict == verdict]
        parts += [f"{words}: {', '.join(names)}"] if names else []
    hidden = [gain.response for gain in gains if gain.within_scatter]
    tail = f" One run each would not show: {', '.join(hidden)}." if hidden else ""
    return f"On the surfaces, {'; '.join(parts)}.{tail}"
