"""How good a design is before any run is made: precision of terms and predictions, tests, power.

Source: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., chapters 8 and 9.
"""

import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import special, stats

from doe.designs.design import Region, replicate_groups
from doe.designs.model import model_matrix, term_powers
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.faults import MethodError

SIGNIFICANCE = 0.05  # of the tests whose power is given
RADII = 11  # of the variance dispersion graph
SAMPLE = 12  # base-2 logarithm of the size of the quasi-random sample of a region


def evaluate(
    coded: ArrayLike,
    terms: Sequence[str],
    block: ArrayLike | None = None,
    *,
    region: Region | None = None,
    reach: float | None = None,
) -> dict[str, Any]:
    """Evaluate a design for a model.

    coded : points in coded units, shape (n, k).
    terms : terms of the model, with "1".
    block : block of each run (n,); effects of blocks are estimated along, predictions are means over them.
    region, reach : where predictions count, a "ball" of radius or a "box" of half-width ``reach``. Unless
        given: the box as wide as the design if a run stands in a corner of it, else the ball through the
        outermost runs.

    Returns a record ready for JSON. ``efficiency_percent`` with X the model matrix, p terms, n runs, factors scaled to -1..+1 over
    the design: d = |X'X|^(1/p)/n, a = p/(n trace (X'X)^-1), g = p/(largest), i = p/(mean) scaled prediction
    variance over the region (i has no bound of 100). ``scaled_prediction_variance`` is n var(prediction)/sigma^2:
    ``centre``, ``mean`` (exact), ``max`` (over a lattice and 4096 points) of the region, and ``box_max`` of the box
    as wide as the design. ``by_radius``: its ``min``, ``mean`` and ``max`` over 3^k - 1 directions.
    ``fraction_of_design_space``: ``variance`` that ``percent`` of the region stays within. ``vif``, ``power_percent``
    by term; power is that of a 5 % t test of a change by one and two sigma, from -1 to +1 for a slope or
    product, from centre to +-1 for a square (None without residual degrees of freedom). ``leverage`` by run;
    ``condition_number`` of the model matrix with columns of unit length; ``degrees_of_freedom``; ``blocks``:
    None for one block, else ``sizes``, whether ``orthogonal`` and the ``largest_cosine`` between block and terms.

    Raises MethodError naming the terms that the runs cannot distinguish.

    Source: Atkinson, Donev and Tobias, Optimum Experimental Designs (2007) (efficiencies);
    Giovannitti-Jensen and Myers, Technometrics 31 (1989) (by radius); Zahran, Anderson-Cook and Myers,
    J. Qual. Technol. 35 (2003) (fraction of design space).
    """
    points = np.asarray(coded, float)
    runs = len(points)
    groups = np.zeros(runs, dtype=np.intp) if block is None else np.unique(block, return_inverse=True)[1]
    lost = lost_terms(points, terms, groups)
    if lost:
        raise MethodError(f"the {runs} runs cannot separate {', '.join(lost)} from the other terms")
    region, reach = _where(points, region, reach)
    # A row a run in memory too: sums over columns then have the same bits whatever made the columns.
    matrix, contrasts = np.ascontiguousarray(model_matrix(points, terms)), block_contrasts(groups)
    whole = np.column_stack([matrix, contrasts])
    size = matrix.shape[1]
    covariance = np.asarray(np.linalg.inv(whole.T @ whole)[:size, :size], float)
    freedom = _degrees_of_freedom(points, groups, size, contrasts.shape[1])
    orthogonal = np.linalg.qr(whole)[0]
    return {
        "terms": list(terms),
        "runs": runs,
        "region": {"shape": region, "reach": reach},
        **_precision(points, terms, covariance, region, reach),
        "vif": _inflation(matrix, covariance, terms),
        "leverage": (orthogonal**2).sum(axis=1).tolist(),
        "condition_number": float(np.linalg.cond(matrix / np.linalg.norm(matrix, axis=0))),
        "degrees_of_freedom": freedom,
        "blocks": _blocks(matrix, contrasts, groups),
        "power_percent": _power(covariance, terms, freedom["residual"]),
    }


def _where(points: Array, region: Region | None, reach: float | None) -> tuple[Region, float]:
    """Region and reach of a design at coded points (n, k), unless given."""
    widest, farthest = float(np.abs(points).max()), float(np.linalg.norm(points, axis=1).max())
    if region is None:
        region = "box" if farthest > 0.999 * widest * math.sqrt(points.shape[1]) else "ball"
    return region, reach if reach is not None else widest if region == "box" else farthest


def _precision(points: Array, terms: Sequence[str], covariance: Array, region: Region, reach: float) -> dict[str, Any]:
    """Efficiencies and scaled prediction variances, from the covariance (p, p) of the coefficients over sigma^2."""
    (runs, factors), size, widest = points.shape, len(terms), float(np.abs(points).max())
    root = math.sqrt(runs) * np.linalg.cholesky(covariance)

    def variances(places: Array) -> Array:
        columns = model_matrix(places, terms) @ root
        return np.einsum("...i,...i->...", columns, columns)

    mean = runs * float(np.trace(covariance @ moment_matrix(terms, factors, region, reach)))
    spread = variances(sample(factors, region, reach))
    radii = np.linspace(0.0, reach, RADII)
    shells = variances(radii[:, None, None] * directions(factors)[None])
    edges = shells.ravel() if region == "ball" else variances(lattice(factors, reach))
    largest = max(float(spread.max()), float(edges.max()))
    per_width = np.abs(model_matrix(np.full(factors, widest), terms))
    scaled = covariance * np.outer(per_width, per_width)
    return {
        "efficiency_percent": {
            "d": 100.0 * math.exp(-float(np.linalg.slogdet(scaled)[1]) / size) / runs,
            "a": 100.0 * size / (runs * float(np.trace(scaled))),
            "g": 100.0 * size / largest,
            "i": 100.0 * size / mean,
        },
        "scaled_prediction_variance": {
            "centre": float(variances(np.zeros(factors))),
            "mean": mean,
            "max": largest,
            "box_max": float(variances(lattice(factors, reach if region == "box" else widest)).max()),
        },
        "by_radius": [
            {"radius": radius, "min": float(shell.min()), "mean": float(shell.mean()), "max": float(shell.max())}
            for radius, shell in zip(radii.tolist(), shells, strict=True)
        ],
        "fraction_of_design_space": [
            {"percent": share, "variance": float(np.percentile(spread, share))} for share in range(0, 101, 5)
        ],
    }


def lost_terms(coded: Array, terms: Sequence[str], block: Rows | None = None) -> list[str]:
    """Terms that the runs cannot separate from blocks and the terms before them."""
    groups = np.zeros(len(coded), dtype=np.intp) if block is None else block
    columns = np.column_stack([block_contrasts(groups), model_matrix(coded, terms)])
    columns = columns / np.linalg.norm(columns, axis=0).clip(1e-300)
    first = columns.shape[1] - len(terms)
    ranks = [np.linalg.matrix_rank(columns[:, :end], tol=1e-9) for end in range(first, columns.shape[1] + 1)]
    return [term for term, rise in zip(terms, np.diff(ranks), strict=True) if rise == 0]


def block_contrasts(block: Rows) -> Array:
    """Columns (n, b - 1) of the blocks but the last, each of mean zero, so that "1" is the mean over all runs."""
    indicator = (block[:, None] == np.unique(block)[None, :-1]).astype(float)
    return indicator - indicator.mean(axis=0)


def _inflation(matrix: Array, covariance: Array, terms: Sequence[str]) -> dict[str, float]:
    """Variance of each coefficient relative to that with a column orthogonal to all others."""
    alone = ((matrix - matrix.mean(axis=0)) ** 2).sum(axis=0)
    inflation = (np.diag(covariance) * alone).tolist()
    return {term: value for term, value in zip(terms, inflation, strict=True) if term != "1"}


def _degrees_of_freedom(points: Array, groups: Rows, terms: int, blocks: int) -> dict[str, int]:
    residual = len(points) - terms - blocks
    pure = len(points) - len(np.unique(replicate_groups(points, groups)))
    missed = {"lack_of_fit": residual - pure, "pure_error": pure}
    return {"model": terms - 1, "blocks": blocks, "residual": residual, **missed}


def _blocks(matrix: Array, contrasts: Array, groups: Rows) -> dict[str, Any] | None:
    if contrasts.shape[1] == 0:
        return None
    unit = matrix / np.linalg.norm(matrix, axis=0)
    cosine = float(np.abs(unit.T @ (contrasts / np.linalg.norm(contrasts, axis=0))).max())
    return {"sizes": np.bincount(groups).tolist(), "orthogonal": cosine < 1e-9, "largest_cosine": cosine}


def _power(covariance: Array, terms: Sequence[str], residual: int) -> dict[str, dict[str, float | None]]:
    power: dict[str, dict[str, float | None]] = {}
    for term, variance in zip(terms, np.diag(covariance).tolist(), strict=True):
        if term == "1":
            continue
        power[term] = {"one_sigma": None, "two_sigma": None}
        for name, change in (("one_sigma", 1.0), ("two_sigma", 2.0)):
            if residual > 0:
                limit = stats.f.isf(SIGNIFICANCE, 1, residual)
                shift = ((1.0 if "^2" in term else 0.5) * change) ** 2 / variance
                power[term][name] = 100.0 * float(stats.ncf.sf(limit, 1, residual, shift))
    return power


def moment_matrix(terms: Sequence[str], factors: int, region: Region, reach: float) -> Array:
    """Mean over the region of the products of any two terms, shape (p, p).

    ``reach``: radius of the ball or half-width of the box. Closed form: in a box the mean of x^m is
    reach^m/(m + 1) for each factor and even m; for the ball see Folland, Am. Math. Mon. 108 (2001) 446-448.
    """
    powers = term_powers(terms, factors)
    both = powers[:, None, :] + powers[None, :, :]
    degree = both.sum(axis=-1)
    if region == "box":
        means = np.prod(1.0 / (both + 1.0), axis=-1)
    else:
        on_sphere = special.gammaln(factors / 2) - special.gammaln((factors + degree) / 2)
        on_sphere += (special.gammaln((both + 1) / 2) - special.gammaln(0.5)).sum(axis=-1)
        means = np.exp(on_sphere) * factors / (factors + degree)
    return np.where((both % 2 == 1).any(axis=-1), 0.0, means * reach**degree)


def directions(factors: int) -> Array:
    """Unit vectors (3^k - 1, k) to the middle of every face, edge and corner of a cube."""
    towards = np.array([each for each in product((-1.0, 0.0, 1.0), repeat=factors) if any(each)])
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)


def sample(factors: int, region: Region, reach: float) -> Array:
    """Evenly spread points (4096, k) of the region, always the same ones."""
    if region == "box":
        return reach * (2.0 * stats.qmc.Sobol(factors, seed=0).random_base2(SAMPLE) - 1.0)
    unit = stats.qmc.Sobol(factors + 1, seed=0).random_base2(SAMPLE)
    normal = stats.norm.ppf(unit[:, :-1].clip(1e-12, 1 - 1e-12))
    radius = reach * unit[:, -1:] ** (1.0 / factors)
    return radius * normal / np.linalg.norm(normal, axis=1, keepdims=True)


def lattice(factors: int, reach: float) -> Array:
    """Regular points of a box with its corners, faces and centre: five levels a factor, three beyond six factors."""
    levels = np.linspace(-reach, reach, 5 if factors <= 6 else 3)
    return np.array(list(product(levels, repeat=factors)))
