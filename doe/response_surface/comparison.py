"""A polynomial surface against a Gaussian process, which bends wherever the runs say so: which one predicts points that it
has not seen."""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from string import ascii_uppercase
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from doe.designs.design import replicate_groups
from doe.emulator import Emulator, fit_emulator
from doe.response_surface.surface import Surface
from doe.threads import one_thread
from rbdyn.base.arrays import Array, Rows, Whole
from rbdyn.base.faults import MethodError
from rbdyn.base.words import counted

# More points than these are left out in groups.
MOST_SINGLY, FOLDS = 60, 20
# Leverage of a point, all its replicates together, from which on the polynomial is a guess without it.
INDISPENSABLE = 0.95


# What a rival made of the runs of some rows predicts (n,) at coded points (n, k).
Rival = Callable[[Rows, Array], Array]


def compare(
    coded: ArrayLike,
    values: ArrayLike,
    refit: Callable[[Rows], Surface],
    *,
    name: str,
    matrix: ArrayLike | None = None,
    standard_errors: ArrayLike | None = None,
) -> dict[str, Any]:
    """Leave out each point in turn with all its replicates, refit both, and compare what they miss there.

    Both rivals see the same runs and are wholly refitted without the point (the process with its
    hyperparameters, the polynomial with its choice of terms), and predict the mean of the runs left out;
    each point counts once. Of more than `MOST_SINGLY` points a twentieth is left out at a time, and the process keeps
    the hyperparameters of all runs: a fit costs the cube of their number. A point without which the polynomial cannot be fitted, or is a guess, such as the
    centre of a spherical design, is not compared: no one would leave it out.

    coded, values : runs in coded units (n, k) and their response (n,).
    refit : the polynomial fitted to the runs of the given rows; it raises MethodError where they do not suffice.
    name : of the response, for the sentence.
    matrix : model matrix of the polynomial (n, p), to find the points that it cannot do without (leverage of all
        replicates together above 0.95); without it only those whose absence makes ``refit`` fail.
    standard_errors : known standard error of each value (n,), for the process; else it estimates one.

    Returns ``polynomial`` and ``gaussian_process``, each with ``loo_rmse`` and ``loo_r2`` (None where the points all
    have one mean), the latter also with its hyperparameters: ``length_scales`` in coded units by letter, ``deviation`` of the
    random function and ``noise`` of a run (None where it was given), ``log_likelihood``, restricted; ``difference`` of the
    squared misses, polynomial less process: ``mean``, ``standard_error`` and 95 % ``interval`` by Student's t over the points,
    which takes them as independent; ``points`` compared; ``folds``: how often some were left out; ``recommended``:
    "gaussian_process" only where the interval lies above zero, else "polynomial"; ``sentence``.

    Raises MethodError when fewer than three points can be left out.

    Source: Stone, Cross-validatory choice, J. R. Stat. Soc. B 36 (1974); the interval is rough, for there is no
    unbiased variance of a cross-validation (Bengio and Grandvalet, J. Mach. Learn. Res. 5 (2004)).
    """
    points, response = np.asarray(coded, float), np.asarray(values, float)
    variances = np.zeros(len(response)) if standard_errors is None else np.asarray(standard_errors, float) ** 2
    whole = fit_emulator(points, response, variances, trend="constant")
    group = replicate_groups(points)
    basis = np.zeros((len(points), 1)) if matrix is None else np.linalg.qr(np.asarray(matrix, float))[0]
    firsts = np.unique(group)
    singly = len(firsts) <= MOST_SINGLY
    order = firsts if singly else np.random.default_rng(1).permutation(firsts)
    folds = np.array_split(order, len(firsts) if singly else FOLDS)

    def process(rows: Rows, at: Array) -> Array:
        runs = points[rows], response[rows], variances[rows]
        return fit_emulator(*runs, trend="constant", start=whole.hyperparameters, search=singly).mean(at)

    def polynomial(rows: Rows, at: Array) -> Array:
        return refit(rows).predict(at)

    spared = [[first for first in fold if (basis[group == first] ** 2).sum() <= INDISPENSABLE] for fold in folds]
    kept = [fold for fold in spared if fold]
    truths, predicted = _left_out(name, points, response, group, kept, (polynomial, process))
    squares = (truths[:, None] - predicted) ** 2
    compared = f"{len(truths)} of {len(firsts)} points{'' if singly else f' (in {len(folds)} groups)'}"
    difference = _difference(squares[:, 0] - squares[:, 1])
    scores = [_score(each, truths) for each in squares.T]
    return {
        "polynomial": scores[0],
        "gaussian_process": {**scores[1], **_hyperparameters(whole, scatter=standard_errors is None)},
        "difference": difference,
        "points": len(truths),
        "folds": len(folds),
        "recommended": "gaussian_process" if difference["interval"][0] > 0.0 else "polynomial",
        "sentence": _sentence(name, compared, *(each["loo_rmse"] for each in scores), *difference["interval"]),
    }


def _hyperparameters(process: Emulator, scatter: bool) -> dict[str, Any]:
    given = process.hyperparameters
    return {
        "kernel": "Matern 5/2",
        "length_scales": dict(zip(ascii_uppercase, given.lengths.tolist(), strict=False)),
        "deviation": math.sqrt(given.variance),
        "noise": math.sqrt(given.nugget) if scatter else None,
        "log_likelihood": process.restricted_likelihood,
    }


@one_thread
def _left_out(
    name: str, points: Array, response: Array, group: Whole, folds: Sequence[Sequence[int]], rivals: tuple[Rival, ...]
) -> tuple[Array, Array]:
    """Mean responses (c,) of points left out a fold at a time, and what rivals fitted without them predict (c, rivals).

    A fold without which a rival cannot be fitted is passed over. Raises MethodError where fewer than three points are left.
    """
    truths, predicted = [np.empty(0)], [np.empty((0, len(rivals)))]
    for fold in folds:
        rows = np.flatnonzero(~np.isin(group, fold))
        with suppress(MethodError):
            predicted.append(np.column_stack([rival(rows, points[fold]) for rival in rivals]))
            truths.append(np.array([response[group == first].mean() for first in fold]))
    if (count := sum(map(len, truths))) < 3:
        raise MethodError(
            f"{name}: only {counted(count, 'point')} can be left out of the polynomial, too few to compare; add "
            "design points or choose a simpler model"
        )
    return np.concatenate(truths), np.vstack(predicted)


def _difference(paired: Array) -> dict[str, Any]:
    mean, error = float(paired.mean()), float(paired.std(ddof=1) / math.sqrt(paired.size))
    reach = float(stats.t.ppf(0.975, paired.size - 1)) * error
    return {"mean": mean, "standard_error": error, "interval": [mean - reach, mean + reach]}


def _score(squares: Array, means: Array) -> dict[str, Any]:
    total = float(((means - means.mean()) ** 2).sum())
    r2 = 1.0 - float(squares.sum()) / total if total > 0.0 else None
    return {"loo_rmse": math.sqrt(squares.mean()), "loo_r2": r2}


def _sentence(name: str, compared: str, polynomial: float, process: float, low: float, high: float) -> str:
    figures = f"{name}: leave-one-out RMSE of {compared} is {polynomial:.3g} by the polynomial, {process:.3g} by a Gaussian process"
    if low > 0.0:
        return f"{figures}; the process is better by more than the error of the comparison: prefer it."
    if high < 0.0:
        return f"{figures}; the polynomial is better by more than the error of the comparison: keep it."
    return f"{figures}; no clear difference: keep the polynomial, which is simpler."
