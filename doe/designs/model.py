"""Polynomial models in lettered factors, and how well a design estimates them before any run.

Terms of second order are "1", "A", "AB" (product) and "A^2" (square). The module has the terms of each model, their columns
and hierarchy, and the polynomial of terms and coefficients. Predictions are in the innermost loop of every search, so they
use no columns of powers. ``evaluate`` reports the precision of terms and predictions, the tests and their power.

Source: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., chapters 8 and 9.
"""

import math
from collections.abc import Sequence
from functools import cache
from itertools import combinations, product
from string import ascii_uppercase
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from doe.designs.design import Region, replicate_groups
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record, shown

Model = Literal["linear", "interaction", "pure_quadratic", "quadratic", "reduced"]
MODELS: tuple[str, ...] = get_args(Model)
Terms = tuple[str, ...]


def model_terms(factors: int, model: str) -> Terms:
    """Terms of a model: "linear", "interaction" (with two-factor products), "pure_quadratic" (with squares), else all.

    A model that the data reduce needs runs for all its initial terms.
    """
    letters = ascii_uppercase[:factors]
    products = [a + b for a, b in combinations(letters, 2)] if model not in ("linear", "pure_quadratic") else []
    squares = [f"{letter}^2" for letter in letters] if model not in ("linear", "interaction") else []
    return ("1", *letters, *products, *squares)


def term_powers(terms: Sequence[str], factors: int) -> Rows:
    """Power of each factor in each term, shape (p, k)."""
    first, second = _pairs(tuple(terms))
    of_column = np.eye(factors + 1, dtype=np.intp)[:, 1:]
    return of_column[first] + of_column[second]


def needed(term: str, terms: Terms) -> bool:
    """Whether hierarchy keeps a term: the constant, or a factor of another term."""
    return term == "1" or any(term in other for other in terms if other != term)


def model_matrix(coded: ArrayLike, terms: Sequence[str]) -> Array:
    """Columns of ``terms`` at coded points (..., k), shape (..., number of terms)."""
    points = np.asarray(coded, float)
    first, second = _pairs(tuple(terms))
    padded = np.concatenate([np.ones((*points.shape[:-1], 1)), points], axis=-1)
    return padded[..., first] * padded[..., second]


def second_order(terms: Terms, coefficients: Array, factors: int) -> tuple[float, Array, Array]:
    """Constant b0, gradient b (k,) and symmetric B (k, k) of b0 + b x + x' B x."""
    padded = np.zeros((factors + 1, factors + 1))
    for a, b, value in zip(*_pairs(terms), coefficients.tolist(), strict=True):
        padded[a, b] += value / 2
        padded[b, a] += value / 2
    return float(padded[0, 0]), 2 * padded[0, 1:], padded[1:, 1:]


def in_actual_units(terms: Terms, coefficients: Array, centre: Array, step: Array) -> Array:
    """Coefficients in actual units of a hierarchical model with ``coefficients`` in coded units."""
    constant, gradient, matrix = second_order(terms, coefficients, centre.size)
    matrix, gradient = matrix / np.outer(step, step), gradient / step
    constant += float(-gradient @ centre + centre @ matrix @ centre)
    gradient = gradient - 2 * matrix @ centre
    padded = np.block([[np.full((1, 1), constant), gradient[None] / 2], [gradient[:, None] / 2, matrix]])
    return np.array([padded[a, b] * (1 if a == b else 2) for a, b in zip(*_pairs(terms), strict=True)])


@cache
def _pairs(terms: Terms) -> tuple[list[int], list[int]]:
    """For each term the two columns, of 1 and the factors, whose product it is."""
    pairs = [_pair(term) for term in terms]
    return [a for a, _ in pairs], [b for _, b in pairs]


def _pair(term: str) -> tuple[int, int]:
    if term == "1":
        return 0, 0
    places = [ascii_uppercase.index(letter) + 1 for letter in term.removesuffix("^2")]
    if term.endswith("^2"):
        return places[0], places[0]
    return (0, places[0]) if len(places) == 1 else (places[0], places[1])


SIGNIFICANCE = 0.05  # of the tests whose power is reported
RADII = 11  # of the variance dispersion graph
SAMPLE = 12  # base-2 logarithm of the size of the quasi-random sample of a region


class Span(Record):
    """Where predictions count: a "ball" of radius or a "box" of half-width ``reach``."""

    shape: Region
    reach: float


class PredictionVariance(Record):
    """n var(prediction)/sigma^2: at the centre, its mean (exact) and maximum (over a lattice and 4096 points) in the region, and
    the maximum in the box as wide as the design."""

    centre: float
    mean: float
    max: float
    box_max: float


class Shell(Record):
    """Scaled prediction variance over 3^k - 1 directions at a radius."""

    radius: float = shown("radius", ".3f")
    min: float = shown("least", ".3f")
    mean: float = shown("mean", ".3f")
    max: float = shown("largest", ".3f")


class DesignSpace(Record):
    """Scaled prediction ``variance`` that ``percent`` of the region do not exceed."""

    percent: float
    variance: float


class Blocking(Record):
    """Runs of each block, and whether blocks are orthogonal to the terms: the largest cosine between the two."""

    sizes: list[int]
    orthogonal: bool
    largest_cosine: float


class Power(Record):
    """Power [%] of a 5 % t test of a change by one and two sigma; None without residual degrees of freedom.

    The change is from -1 to +1 for a slope or product, from the centre to +-1 for a square.
    """

    one_sigma: float | None
    two_sigma: float | None


class Evaluation(Record, kw_only=True):
    """How good a design is for a model, with X the model matrix of p terms and n runs.

    - ``efficiency_percent``, with factors scaled to -1..+1 over the design: d = |X'X|^(1/p)/n, a = p/(n trace (X'X)^-1).
      g and i are p over the largest and the mean scaled prediction variance in the region; i may exceed 100.
    - ``leverage`` by run; ``condition_number`` of X with columns of unit length
    - ``blocks``: None for one block
    """

    model: str | None = None
    terms: list[str]
    runs: int
    region: Span
    efficiency_percent: dict[str, float]
    scaled_prediction_variance: PredictionVariance
    by_radius: list[Shell]
    fraction_of_design_space: list[DesignSpace]
    vif: dict[str, float]
    leverage: list[float]
    condition_number: float
    degrees_of_freedom: dict[str, int]
    blocks: Blocking | None
    power_percent: dict[str, Power]


def evaluate(
    coded: ArrayLike,
    terms: Sequence[str],
    block: ArrayLike | None = None,
    *,
    region: Region | None = None,
    reach: float | None = None,
) -> Evaluation:
    """Evaluate a design for a model.

    coded : points in coded units, shape (n, k).
    terms : terms of the model, with "1".
    block : block of each run (n,); block effects are estimated too, and predictions are means over the blocks.
    region, reach : where predictions count, a "ball" of radius or a "box" of half-width ``reach``. By default the box as
        wide as the design if a run is in a corner of it, else the ball through the outermost runs.

    Raises MethodError naming the terms that the runs cannot separate.

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
    # The memory has a row a run, so that sums over columns have the same bits on every path.
    matrix, contrasts = np.ascontiguousarray(model_matrix(points, terms)), block_contrasts(groups)
    extended = np.column_stack([matrix, contrasts])
    size = matrix.shape[1]
    covariance = np.asarray(np.linalg.inv(extended.T @ extended)[:size, :size], float)
    freedom = _degrees_of_freedom(points, groups, size, contrasts.shape[1])
    orthogonal = np.linalg.qr(extended)[0]
    return Evaluation(
        terms=list(terms),
        runs=runs,
        region=Span(region, reach),
        **_precision(points, terms, covariance, region, reach),
        vif=_inflation(matrix, covariance, terms),
        leverage=(orthogonal**2).sum(axis=1).tolist(),
        condition_number=float(np.linalg.cond(matrix / np.linalg.norm(matrix, axis=0))),
        degrees_of_freedom=freedom,
        blocks=_blocks(matrix, contrasts, groups),
        power_percent=_power(covariance, terms, freedom["residual"]),
    )


def _where(points: Array, region: Region | None, reach: float | None) -> tuple[Region, float]:
    """Region and reach, by default those of a design at coded points (n, k)."""
    half_width, radius = float(np.abs(points).max()), float(np.linalg.norm(points, axis=1).max())
    if region is None:
        region = "box" if radius > 0.999 * half_width * math.sqrt(points.shape[1]) else "ball"
    return region, reach if reach is not None else half_width if region == "box" else radius


def _precision(points: Array, terms: Sequence[str], covariance: Array, region: Region, reach: float) -> dict[str, Any]:
    """Efficiencies and scaled prediction variances, by the covariance (p, p) of the coefficients over sigma^2."""
    (runs, factors), size, half_width = points.shape, len(terms), float(np.abs(points).max())
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
    per_width = np.abs(model_matrix(np.full(factors, half_width), terms))
    scaled = covariance * np.outer(per_width, per_width)
    return {
        "efficiency_percent": {
            "d": 100.0 * math.exp(-float(np.linalg.slogdet(scaled)[1]) / size) / runs,
            "a": 100.0 * size / (runs * float(np.trace(scaled))),
            "g": 100.0 * size / largest,
            "i": 100.0 * size / mean,
        },
        "scaled_prediction_variance": PredictionVariance(
            centre=float(variances(np.zeros(factors))),
            mean=mean,
            max=largest,
            box_max=float(variances(lattice(factors, reach if region == "box" else half_width)).max()),
        ),
        "by_radius": [
            Shell(radius, float(shell.min()), float(shell.mean()), float(shell.max()))
            for radius, shell in zip(radii.tolist(), shells, strict=True)
        ],
        "fraction_of_design_space": [
            DesignSpace(share, float(np.percentile(spread, share))) for share in range(0, 101, 5)
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
    """Columns (n, b - 1) of all blocks but the last, each of mean zero, so that "1" is the mean over all runs."""
    indicator = (block[:, None] == np.unique(block)[None, :-1]).astype(float)
    return indicator - indicator.mean(axis=0)


def _inflation(matrix: Array, covariance: Array, terms: Sequence[str]) -> dict[str, float]:
    """Variance of each coefficient over its variance with orthogonal columns."""
    alone = ((matrix - matrix.mean(axis=0)) ** 2).sum(axis=0)
    inflation = (np.diag(covariance) * alone).tolist()
    return {term: value for term, value in zip(terms, inflation, strict=True) if term != "1"}


def _degrees_of_freedom(points: Array, groups: Rows, terms: int, blocks: int) -> dict[str, int]:
    residual = len(points) - terms - blocks
    pure = len(points) - len(np.unique(replicate_groups(points, groups)))
    missed = {"lack_of_fit": residual - pure, "pure_error": pure}
    return {"model": terms - 1, "blocks": blocks, "residual": residual, **missed}


def _blocks(matrix: Array, contrasts: Array, groups: Rows) -> Blocking | None:
    if contrasts.shape[1] == 0:
        return None
    unit = matrix / np.linalg.norm(matrix, axis=0)
    cosine = float(np.abs(unit.T @ (contrasts / np.linalg.norm(contrasts, axis=0))).max())
    return Blocking(np.bincount(groups).tolist(), cosine < 1e-9, cosine)


def _power(covariance: Array, terms: Sequence[str], residual: int) -> dict[str, Power]:
    from scipy import stats

    def power(term: str, variance: float, change: float) -> float | None:
        if residual <= 0:
            return None
        shift = ((1.0 if "^2" in term else 0.5) * change) ** 2 / variance
        return 100.0 * float(stats.ncf.sf(stats.f.isf(SIGNIFICANCE, 1, residual), 1, residual, shift))

    variances = zip(terms, np.diag(covariance).tolist(), strict=True)
    return {term: Power(power(term, v, 1.0), power(term, v, 2.0)) for term, v in variances if term != "1"}


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
        from scipy import special

        on_sphere = special.gammaln(factors / 2) - special.gammaln((factors + degree) / 2)
        on_sphere += (special.gammaln((both + 1) / 2) - special.gammaln(0.5)).sum(axis=-1)
        means = np.exp(on_sphere) * factors / (factors + degree)
    return np.where((both % 2 == 1).any(axis=-1), 0.0, means * reach**degree)


def directions(factors: int) -> Array:
    """Unit vectors (3^k - 1, k) to the corners and the middles of all edges and faces of a cube."""
    towards = np.array([direction for direction in product((-1.0, 0.0, 1.0), repeat=factors) if any(direction)])
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)


def sample(factors: int, region: Region, reach: float) -> Array:
    """Fixed, evenly spread points (4096, k) of the region."""
    from scipy import stats

    if region == "box":
        return reach * (2.0 * stats.qmc.Sobol(factors, seed=0).random_base2(SAMPLE) - 1.0)
    unit = stats.qmc.Sobol(factors + 1, seed=0).random_base2(SAMPLE)
    normal = stats.norm.ppf(unit[:, :-1].clip(1e-12, 1 - 1e-12))
    radius = reach * unit[:, -1:] ** (1.0 / factors)
    return radius * normal / np.linalg.norm(normal, axis=1, keepdims=True)


def lattice(factors: int, reach: float) -> Array:
    """Regular grid of a box with corners, faces and centre: five levels a factor, three for more than six factors."""
    return np.array(list(product(np.linspace(-reach, reach, 5 if factors <= 6 else 3), repeat=factors)))
