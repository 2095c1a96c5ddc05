"""How far a pick stays back from a limit, so that it keeps it although what foretells the responses errs.

What foretells (surfaces, or the fresh runs of a search) has a standard error at every point. Its error is taken as a
field, alike within a coded unit (`doe.response_surface.model_error`). Where points were simulated, design runs or picks,
what was missed there is known: the field is conditioned on it, after its scale has been raised so far that these misses
are likely, if they are not (maximum likelihood). Source: Sacks, Welch, Mitchell and Wynn, Stat. Sci. 4 (1989), section 4.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy import special

from doe.arrays import Array
from doe.pareto.search import Doubt
from doe.response_surface import Surface
from doe.response_surface.model_error import correlation
from doe.study.confirmation import Confirmed
from doe.study.goals import goals_of
from doe.study_file import Study

SCALES = np.geomspace(1.0, 100.0, 81)  # of the standard errors, tried against the misses
MOST_RUNS = 300  # design runs whose misses count; of more, evenly spread ones


@dataclass(frozen=True, eq=False)
class Missed:
    """What was simulated of one response at coded points (c, k) less what was foretold: ``misses`` (c,), with the
    standard errors of the simulation (c,) and of the forecast (c,)."""

    points: Array
    misses: Array
    errors: Array
    stated: Array

    def and_at(self, points: Array, misses: Array, errors: Array, stated: Array) -> Self:
        """With more points."""
        more = zip((self.points, self.misses, self.errors, self.stated), (points, misses, errors, stated), strict=True)
        return type(self)(*(np.concatenate(pair) for pair in more))


class Conditioned:
    """The error of a forecast as a field, given what was missed."""

    def __init__(self, missed: Missed) -> None:
        prior = correlation(missed.points, missed.points) * np.outer(missed.stated, missed.stated)
        self._missed, self._noise = missed, np.diag(missed.errors**2)
        self._scale = _scale(prior, self._noise, missed.misses)
        self._solve = np.linalg.pinv(self._scale**2 * prior + self._noise, hermitian=True)

    def __call__(self, coded: Array, stated: Array) -> tuple[Array, Array]:
        """Mean (n,) and standard deviation (n,) of the error at coded points (n, k) of ``stated`` standard errors (n,)."""
        link = self._scale**2 * correlation(coded, self._missed.points) * np.outer(stated, self._missed.stated)
        projected = link @ self._solve
        left = (self._scale * stated) ** 2 - (projected * link).sum(axis=1)
        return projected @ self._missed.misses, np.sqrt(left.clip(0.0))


class SurfaceDoubt:
    """How far the limited responses may lie off their surfaces, from what these missed at the design runs and at points
    ``simulated``."""

    def __init__(self, study: Study, surfaces: Sequence[Surface], simulated: Sequence[Confirmed] = ()) -> None:
        self._surfaces, self._probability = surfaces, study.file.confirmation.limit_probability
        self._fields: dict[int, Conditioned] = {}
        # The error of one more simulation counts too.
        self._more: dict[int, float] = {}
        for index in sorted({index for index, _, _ in goals_of(study).limited}):
            surface = surfaces[index]
            missed = _at_design(surface)
            if simulated:
                at = study.coded(np.array([each.point for each in simulated]))
                errors = standard_errors_of(simulated)[:, index]
                misses = np.array([each.values[index] for each in simulated]) - surface.predict(at)
                missed = missed.and_at(at, misses, errors, surface.prediction_standard_error(at))
                self._more[index] = float(errors.max())
            self._fields[index] = Conditioned(missed)

    def _off(self, index: int, coded: Array) -> tuple[Array, Array]:
        """Mean (n,) and standard deviation (n,) of what a response lies off its surface."""
        shift, deviation = self._fields[index](coded, self._surfaces[index].prediction_standard_error(coded))
        return shift, np.hypot(deviation, self._more.get(index, 0.0))

    def at_share(self, share: float) -> Doubt:
        """Range in which the responses lie with the study's probability, or a share of it."""

        def doubt(coded: Array) -> tuple[Array, Array]:
            shift, margin = np.zeros((2, len(coded), len(self._surfaces)))
            for index in self._fields:
                quantile = float(special.stdtrit(self._surfaces[index].interval_dof, self._probability))
                shift[:, index], deviation = self._off(index, coded)
                margin[:, index] = quantile * deviation
            # A limit is never loosened: the surface itself keeps it too.
            return share * (margin - shift).clip(0.0), share * (margin + shift).clip(0.0)

        return doubt

    def kept_with(self, index: int, sense: str, bound: float, coded: Array) -> float:
        """Probability with which a limited response keeps a bound ("<=" or ">=") at a coded point (k,)."""
        shift, deviation = (float(each[0]) for each in self._off(index, coded[None]))
        room = bound - float(self._surfaces[index].predict(coded)) - shift
        room = room if sense == "<=" else -room
        if deviation == 0.0:
            return float(room >= 0.0)
        return float(special.stdtr(self._surfaces[index].interval_dof, room / deviation))


def standard_errors_of(simulated: Sequence[Confirmed]) -> Array:
    """Standard errors (c, m) of simulated points."""
    return np.array([each.standard_error for each in simulated])


def _at_design(surface: Surface) -> Missed:
    """What the surface missed at its own runs, whose error is that of their replicates, of repeats, or of all the rest."""
    data = surface.data
    rows = np.unique(np.linspace(0, len(data.values) - 1, MOST_RUNS).round().astype(int))
    if data.standard_errors is not None:
        errors = data.standard_errors
    else:
        pure = surface.pure_error["ms"] if surface.model_error is not None else None
        one = surface.residual_mean_square if pure is None else pure
        errors = np.full(len(data.values), np.sqrt(one if surface.transform is None else 0.0))
    points, misses = data.points[rows], data.values[rows] - surface.predict(data.points[rows])
    return Missed(points, misses, errors[rows], surface.prediction_standard_error(points))


def _scale(prior: Array, noise: Array, misses: Array) -> float:
    """How many times the stated standard errors make the misses most likely; 1 at least."""
    likelihood = []
    for scale in SCALES:
        covariance = scale**2 * prior + noise
        sign, logarithm = np.linalg.slogdet(covariance)
        if sign <= 0:
            return 1.0
        likelihood.append(-0.5 * (logarithm + misses @ np.linalg.solve(covariance, misses)))
    return float(SCALES[int(np.argmax(likelihood))]) if likelihood else 1.0
