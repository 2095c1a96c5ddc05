"""Surfaces that the runs might as well have come from, all responses of one draw together.

Coefficients follow their multivariate t, and what a model with lack of fit misses is a random field, as
`doe.response_surface.model_error` has it. The residuals of one run belong together: responses are drawn with the correlation of
their residuals, and so are the variances behind them (Bartlett's columns of a Wishart matrix). What was simulated at a few
points moves every draw to pass these within their errors (Matheron's rule).

Sources: Box and Tiao, Bayesian Inference in Statistical Analysis, sections 2.7 and 8.5; Zellner, An efficient method of
estimating seemingly unrelated regressions (1962), for the residuals; Wilson et al., Pathwise conditioning of Gaussian
processes (2021).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from doe.arrays import Array
from doe.response_surface import Surface, model_matrix
from doe.response_surface.box_cox import forward, slope
from doe.response_surface.model_error import correlation
from doe.study.drawn import link_of

CHUNK = 50  # draws at a time: a few megabytes of 4096 parts
LEFT_OUT = 1e-8  # variance of a field of variance 1 that its root may leave out
MOST_COLUMNS = 300  # of the root of a field


@dataclass(frozen=True, eq=False)
class Simulated:
    """What was simulated at coded points (c, k): responses (c, m) and their standard errors (c, m)."""

    points: Array
    values: Array
    errors: Array


def drawn_responses(
    surfaces: Sequence[Surface], coded: Array, draws: int, seed: int, simulated: Simulated | None = None
) -> Iterator[Array]:
    """Responses (d, n, m) at coded points (n, k) on drawn surfaces, some draws at a time."""
    random = np.random.default_rng(seed)
    places = coded if simulated is None else np.vstack([coded, simulated.points])
    known = [None] * len(surfaces) if simulated is None else _on_scale_of_fit(surfaces, simulated)
    # Where no surface misses anything there is no field.
    root = field_root(places) if any(surface.model_error for surface in surfaces) else np.zeros((len(places), 1))
    each = [_Posterior.of(surface, places, root, one) for surface, one in zip(surfaces, known, strict=True)]
    links = [link_of(surface) for surface in surfaces]
    together = _root(residual_correlation(surfaces))
    runs, most = (
        len(surfaces[0].data.values),
        max(max(surface.residual_dof, surface.interval_dof) for surface in surfaces),
    )
    for first in range(0, draws, CHUNK):
        count = min(CHUNK, draws - first)
        squares = np.cumsum((random.standard_normal((count, most, len(surfaces))) @ together.T) ** 2, axis=1)
        errors, fields, noise = (
            random.standard_normal((count, size, len(surfaces))) @ together.T
            for size in (runs, root.shape[1], max(len(places) - len(coded), 1))
        )
        columns = [
            link(one.draws(squares[..., j], errors[..., j], fields[..., j], noise[..., j])[:, : len(coded)])
            for j, (one, link) in enumerate(zip(each, links, strict=True))
        ]
        yield np.stack(columns, axis=-1)


def residual_correlation(surfaces: Sequence[Surface]) -> Array:
    """Correlation (m, m) of the residuals of all responses over the runs; none with residuals that are all 0."""
    residuals = np.array([[run["residual"] for run in surface.diagnostics["runs"]] for surface in surfaces], float)
    size = np.sqrt((residuals**2).sum(axis=1))
    unit = np.divide(residuals, size[:, None], out=np.zeros_like(residuals), where=size[:, None] > 0.0)
    found = unit @ unit.T
    np.fill_diagonal(found, 1.0)
    return np.asarray(found)


def coefficient_root(surface: Surface) -> Array:
    """How the coefficients follow independent errors of variance 1 of the runs, (p, n): times its transpose it is their
    covariance."""
    data = surface.data
    matrix = np.hstack([model_matrix(data.points, surface.terms), data.block_columns])
    weights = np.ones(len(data.values))
    if surface.weighting == "replicates" and data.standard_errors is not None:
        scale = 1.0 if surface.transform is None else slope(data.values, surface.transform)
        weights = 1.0 / (data.standard_errors * scale) ** 2
    root = np.linalg.pinv(matrix * np.sqrt(weights)[:, None])[: len(surface.terms)]
    return np.asarray(root * np.sqrt(surface.residual_mean_square))


def field_root(coded: Array) -> Array:
    """Root (n, r) of the correlation of a field at coded points (n, k), by a Cholesky factor with pivots that ends where next to
    nothing is left (Harbrecht, Peters and Schneider, Applied Numerical Mathematics 62, 2012)."""
    left, columns = np.ones(len(coded)), np.zeros((len(coded), min(len(coded), MOST_COLUMNS)))
    for place in range(columns.shape[1]):
        pivot = int(left.argmax())
        if left[pivot] <= LEFT_OUT:
            return columns[:, :place]
        rest = correlation(coded, coded[pivot][None])[:, 0] - columns[:, :place] @ columns[pivot, :place]
        columns[:, place] = rest / np.sqrt(left[pivot])
        left = (left - columns[:, place] ** 2).clip(0.0)
    return columns


@dataclass(frozen=True, eq=False)
class _Posterior:
    """A response at n points on the scale of its fit: ``mean`` (n,), the ``matrix`` (n, p) of the model, the ``roots`` of its
    coefficients (p, runs) and of its field (n, r), the degrees of freedom of both, and what was ``known`` of the last points:
    their values and standard errors (c,)."""

    mean: Array
    matrix: Array
    roots: tuple[Array, Array]
    freedom: tuple[int, int]
    known: tuple[Array, Array] | None

    @classmethod
    def of(cls, surface: Surface, places: Array, root: Array, known: tuple[Array, Array] | None) -> "_Posterior":
        matrix, error = model_matrix(places, surface.terms), surface.model_error
        roots = coefficient_root(surface), root * (0.0 if error is None else np.sqrt(error.variance))
        freedom = surface.residual_dof, surface.interval_dof
        return cls(matrix @ surface.coefficients, matrix, roots, freedom, known)

    def draws(self, squares: Array, errors: Array, fields: Array, noise: Array) -> Array:
        """Values (d, n) from squares of normal numbers, summed, (d, f), and normal numbers for the runs (d, runs), the field
        (d, r) and the values known (d, c)."""
        wide = [np.sqrt(behind / squares[:, behind - 1])[:, None] for behind in self.freedom]
        moved = wide[0] * (errors @ self.roots[0].T)
        found = self.mean + moved @ self.matrix.T + wide[1] * (fields @ self.roots[1].T)
        if self.known is None:
            return np.asarray(found)
        values, error = self.known
        last = slice(len(self.mean) - len(values), None)
        across = self.matrix @ self.roots[0]
        links = [across @ across[last].T, self.roots[1] @ self.roots[1][last].T]
        inside = sum(each[:, :, None] ** 2 * link[last] for each, link in zip(wide, links, strict=True))
        # What is known exactly, and twice, would leave nothing to invert.
        inside = inside + np.diag(error**2 + 1e-12 * sum(np.trace(link[last]) for link in links))
        missed = values - found[:, last] - error * noise
        weights = np.linalg.solve(inside, missed[..., None])[..., 0]
        return np.asarray(found + sum(each**2 * (weights @ link.T) for each, link in zip(wide, links, strict=True)))


def _on_scale_of_fit(surfaces: Sequence[Surface], simulated: Simulated) -> list[tuple[Array, Array] | None]:
    """Values and standard errors (c,) of each response on the scale of its fit; None where a value is not positive and must
    be."""
    found: list[tuple[Array, Array] | None] = []
    for surface, values, errors in zip(surfaces, simulated.values.T, simulated.errors.T, strict=True):
        if surface.transform is None:
            found.append((values, errors))
        elif (values > 0.0).all():
            found.append((forward(values, surface.transform), errors * slope(values, surface.transform)))
        else:
            found.append(None)
    return found


def _root(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.sqrt(values.clip(0.0)))
