"""A polynomial surface against a Gaussian process: which one foretells points that it has not seen."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from doe.arrays import Array, Rows
from doe.designs.replicates import replicate_groups
from doe.response_surface.gaussian_process import THREADS, fit_gaussian

# More points than these are left out in groups.
MOST_SINGLY, FOLDS = 60, 20
# Leverage of a point, all its replicates together, from which on the polynomial is a guess without it.
INDISPENSABLE = 0.95


class Predictor(Protocol):
    """Anything that foretells the response."""

    def predict(self, coded: ArrayLike) -> Array:
        """Mean response at coded points (..., k), shape (...)."""
        ...


def compare(
    coded: ArrayLike,
    values: ArrayLike,
    refit: Callable[[Rows], Predictor],
    *,
    name: str,
    matrix: ArrayLike | None = None,
    standard_errors: ArrayLike | None = None,
    seed: int = 1,
) -> dict[str, Any]:
    """Leave out each point in turn with all its replicates, refit both, and compare what they miss there.

    Both rivals see the same runs and are wholly refitted without the point (the process with its
    hyperparameters, the polynomial with its choice of terms), and foretell the mean of the runs left out;
    each point counts once. Of more than `MOST_SINGLY` points a twentieth is left out at a time, and the process keeps
    the hyperparameters of all runs: a fit costs the cube of their number. A point without which the polynomial cannot be fitted, or is a guess, such as the
    centre of a spherical design, is not compared: no one would leave it out.

    Parameters
    ----------
    coded, values : runs in coded units (n, k) and their response (n,).
    refit : the polynomial fitted to the runs of the given rows; it raises ValueError where they do not suffice.
    name : name of the response, for the sentence.
    matrix : model matrix of the polynomial (n, p), to find the points that it cannot do without (leverage of all
        replicates together above 0.95); without it only those whose absence makes ``refit`` fail.
    standard_errors : known standard error of each value (n,), for the process; else it estimates one.
    seed : of the search for hyperparameters.

    Returns
    -------
    ``polynomial`` and ``gaussian_process``, each with ``loo_rmse`` and ``loo_r2`` (None where the points all
    have one mean); ``difference`` of the squared misses, polynomial less process: ``mean``, ``standard_error``
    and 95 % ``interval`` by Student's t over the points, which takes them as independent; ``points`` compared;
    ``folds``: how often some were left out; ``recommended``: "gaussian_process" only where the interval lies above zero, else "polynomial"; ``sentence``.

    Raises
    ------
    ValueError when fewer than three points can be left out.

    Source: Stone, Cross-validatory choice, J. R. Stat. Soc. B 36 (1974); the interval is rough, for there is no
    unbiased variance of a cross-validation (Bengio and Grandvalet, J. Mach. Learn. Res. 5 (2004)).
    """
    points, response = np.asarray(coded, float), np.asarray(values, float)
    errors = None if standard_errors is None else np.asarray(standard_errors, float)
    whole = fit_gaussian(points, response, name=name, standard_errors=errors, seed=seed)
    group = replicate_groups(points)
    leverage = np.zeros(len(points)) if matrix is None else _leverage(np.asarray(matrix, float))
    means, misses = [], []
    firsts = np.unique(group)
    folds = _folds(firsts, seed)
    for fold in folds:
        spared = np.array([first for first in fold if leverage[group == first].sum() <= INDISPENSABLE], int)
        kept = np.flatnonzero(~np.isin(group, spared))
        if not spared.size:
            continue
        with THREADS.limit(limits=1):
            try:
                polynomial = refit(kept)
            except ValueError:
                continue
            process = fit_gaussian(
                points[kept],
                response[kept],
                name=name,
                standard_errors=None if errors is None else errors[kept],
                seed=seed,
                start=whole,
                search=len(folds) == len(firsts),
            )
            foretold = np.column_stack([rival.predict(points[spared]) for rival in (polynomial, process)])
        truth = np.array([response[group == first].mean() for first in spared])
        means += truth.tolist()
        misses += (truth[:, None] - foretold).tolist()
    if len(misses) < 3:
        raise ValueError(
            f"{name}: only {len(misses)} points can be left out of the polynomial, too few to compare; "
            "add design points or choose a simpler model"
        )
    squares = np.array(misses) ** 2
    at_a_time = "" if len(folds) == len(firsts) else f" (in {len(folds)} groups)"
    compared = f"{len(misses)} of {len(firsts)} points{at_a_time}"
    difference = _difference(squares[:, 0] - squares[:, 1])
    scores = [_score(each, np.array(means)) for each in squares.T]
    low, high = difference["interval"]
    return {
        "polynomial": scores[0],
        "gaussian_process": {**scores[1], **whole.as_dict()},
        "difference": difference,
        "points": len(misses),
        "folds": len(folds),
        "recommended": "gaussian_process" if low > 0.0 else "polynomial",
        "sentence": _sentence(name, compared, scores[0]["loo_rmse"], scores[1]["loo_rmse"], low, high),
    }


def _folds(firsts: Rows, seed: int) -> list[Rows]:
    """Points to be left out together: each alone, or of many a twentieth at a time."""
    if len(firsts) <= MOST_SINGLY:
        return np.array_split(firsts, len(firsts))
    return np.array_split(np.random.default_rng(seed).permutation(firsts), FOLDS)


def _leverage(matrix: Array) -> Array:
    orthogonal = np.linalg.qr(matrix)[0]
    return (orthogonal**2).sum(axis=1)


def _difference(paired: Array) -> dict[str, Any]:
    mean, error = float(paired.mean()), float(paired.std(ddof=1) / math.sqrt(paired.size))
    reach = float(stats.t.ppf(0.975, paired.size - 1)) * error
    return {"mean": mean, "standard_error": error, "interval": [mean - reach, mean + reach]}


def _score(squares: Array, means: Array) -> dict[str, Any]:
    total = float(((means - means.mean()) ** 2).sum())
    r2 = 1.0 - float(squares.sum()) / total if total > 0.0 else None
    return {"loo_rmse": math.sqrt(squares.mean()), "loo_r2": r2}


def _sentence(name: str, compared: str, polynomial: float, process: float, low: float, high: float) -> str:
    found = (
        f"{name}: {compared} left out in turn are missed by {polynomial:.3g} by the polynomial and by "
        f"{process:.3g} by a Gaussian process (root mean square)"
    )
    if low > 0.0:
        return f"{found}; the process is better by more than the error of the comparison: prefer it."
    if high < 0.0:
        return f"{found}; the polynomial is better by more than the error of the comparison: keep it."
    return f"{found}; no clear difference: keep the polynomial, which is simpler."
