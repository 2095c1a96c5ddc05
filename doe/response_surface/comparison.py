"""Cross-validation of a polynomial surface and a Gaussian process: which one predicts new points better."""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from string import ascii_uppercase

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from doe.designs.design import replicate_groups
from doe.emulator import Emulator, fit_emulator
from doe.response_surface.statistics import Comparison, Difference, ProcessScore, Score
from doe.response_surface.surface import Surface
from rbdyn.base.arrays import Array, Rows, Whole, one_thread
from rbdyn.base.faults import MethodError
from rbdyn.base.words import counted

# Largest number of points that are left out one by one, and number of groups of more points.
MOST_SINGLY, FOLDS = 60, 20
# Leverage of a point with all its replicates above which the polynomial without it is a guess.
INDISPENSABLE = 0.95


# A rival fitted to the runs of some rows: its predictions (n,) at coded points (n, k).
Rival = Callable[[Rows, Array], Array]


def compare(
    coded: ArrayLike, values: ArrayLike, refit: Callable[[Rows], Surface], *, name: str, matrix: ArrayLike | None = None
) -> Comparison:
    """Leave out each point in turn with all its replicates, refit both rivals, and compare their errors there.

    Both rivals see the same runs. Each fit without the point estimates the hyperparameters of the process and selects the
    terms of the polynomial anew. It predicts the mean of the omitted runs. Each point counts once. Of more than
    `MOST_SINGLY` points a twentieth is left out at a time. The process then keeps the hyperparameters of all runs, for a fit
    costs the cube of their number. Points without which the polynomial cannot be fitted or is a guess are not compared, such as the centre of
    a spherical design.

    coded, values : runs in coded units (n, k) and their response (n,), with its ``name`` for the sentence.
    refit : the polynomial fitted to the runs of some rows; it raises MethodError where they do not suffice.
    matrix : model matrix of the polynomial (n, p), to find the points that it needs (leverage of all replicates together
        above 0.95); by default only those without which ``refit`` fails.

    Raises MethodError when fewer than three points can be left out.

    Source: Stone, Cross-validatory choice, J. R. Stat. Soc. B 36 (1974). The interval is rough, for the variance of a
    cross-validation has no unbiased estimate (Bengio and Grandvalet, J. Mach. Learn. Res. 5 (2004)).
    """
    points, response = np.asarray(coded, float), np.asarray(values, float)
    variances = np.zeros(len(response))
    whole = fit_emulator(points, response, variances, trend="constant")
    group = replicate_groups(points)
    basis = np.zeros((len(points), 1)) if matrix is None else np.linalg.qr(np.asarray(matrix, float))[0]
    firsts = np.unique(group)
    singly = len(firsts) <= MOST_SINGLY
    folds = _folds(firsts, singly)

    def process(rows: Rows, places: Array) -> Array:
        runs = points[rows], response[rows], variances[rows]
        return fit_emulator(*runs, trend="constant", start=whole.hyperparameters, search=singly).mean(places)

    def polynomial(rows: Rows, places: Array) -> Array:
        return refit(rows).predict(places)

    spared = [[first for first in fold if (basis[group == first] ** 2).sum() <= INDISPENSABLE] for fold in folds]
    trials = [fold for fold in spared if fold]
    truths, predictions = _leave_out(name, points, response, group, trials, (polynomial, process))
    squares = (truths[:, None] - predictions) ** 2
    extent = f"{len(truths)} of {len(firsts)} points{'' if singly else f' (in {len(folds)} groups)'}"
    difference = _difference(squares[:, 0] - squares[:, 1])
    scores = [_score(score, truths) for score in squares.T]
    return Comparison(
        polynomial=Score(*scores[0]),
        gaussian_process=_process_score(*scores[1], whole),
        difference=difference,
        points=len(truths),
        folds=len(folds),
        recommended="gaussian_process" if difference.interval[0] > 0.0 else "polynomial",
        sentence=_sentence(name, extent, *(rmse for rmse, _ in scores), *difference.interval),
    )


def _folds(firsts: Whole, singly: bool) -> list[Whole]:
    """Points by their first runs, one by one or in ``FOLDS`` random groups."""
    if singly:
        return np.array_split(firsts, len(firsts))
    return np.array_split(np.random.default_rng(1).permutation(firsts), FOLDS)


def _process_score(rmse: float, r2: float | None, process: Emulator) -> ProcessScore:
    parameters = process.hyperparameters
    return ProcessScore(
        rmse,
        r2,
        kernel="Matern 5/2",
        length_scales=dict(zip(ascii_uppercase, parameters.lengths.tolist(), strict=False)),
        deviation=math.sqrt(parameters.variance),
        noise=math.sqrt(parameters.nugget),
        log_likelihood=process.likelihood,
    )


@one_thread
def _leave_out(
    name: str, points: Array, response: Array, group: Whole, folds: Sequence[Sequence[int]], rivals: tuple[Rival, ...]
) -> tuple[Array, Array]:
    """Mean responses (c,) of points left out a fold at a time, and predictions (c, rivals) of rivals fitted without them.

    A fold that a rival needs for its fit is skipped. Raises MethodError where fewer than three points remain.
    """
    truths, predictions = [np.empty(0)], [np.empty((0, len(rivals)))]
    for fold in folds:
        rows = np.flatnonzero(~np.isin(group, fold))
        with suppress(MethodError):
            predictions.append(np.column_stack([rival(rows, points[fold]) for rival in rivals]))
            truths.append(np.array([response[group == first].mean() for first in fold]))
    if (count := sum(map(len, truths))) < 3:
        raise MethodError(
            f"{name}: only {counted(count, 'point')} can be left out of the polynomial, too few for a comparison; add "
            "design points or choose a simpler model"
        )
    return np.concatenate(truths), np.vstack(predictions)


def _difference(paired: Array) -> Difference:
    mean, error = float(paired.mean()), float(paired.std(ddof=1) / math.sqrt(paired.size))
    reach = float(stats.t.ppf(0.975, paired.size - 1)) * error
    return Difference(mean, error, [mean - reach, mean + reach])


def _score(squares: Array, means: Array) -> tuple[float, float | None]:
    """Root mean square of the errors, and the share of the scatter of the means that the predictions explain."""
    total = float(((means - means.mean()) ** 2).sum())
    return math.sqrt(squares.mean()), 1.0 - float(squares.sum()) / total if total > 0.0 else None


def _sentence(name: str, extent: str, polynomial: float, process: float, low: float, high: float) -> str:
    figures = f"{name}: leave-one-out RMSE of {extent} is {polynomial:.3g} by the polynomial, {process:.3g} by a Gaussian process"
    if low > 0.0:
        return f"{figures}; the process is better by more than the error of the comparison: prefer it."
    if high < 0.0:
        return f"{figures}; the polynomial is better by more than the error of the comparison: keep it."
    return f"{figures}; no clear difference: keep the polynomial, which is simpler."
