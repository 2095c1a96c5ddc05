"""Least-squares response surfaces of first and second order, and their cross-validation with a Gaussian process.

Fits are in coded units. Factors have the letters A, B, C in the order of the columns; the terms of a surface are "1", "A",
"AB" (interaction) and "A^2" (square).
"""

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import cached_property
from string import ascii_uppercase
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import stats

from doe.designs.design import replicate_groups
from doe.designs.model import MODELS, Model, Terms, in_actual_units, model_matrix, model_terms, second_order
from doe.emulator import Emulator, fit_emulator
from doe.response_surface import least_squares
from doe.response_surface.adequacy import Removal, anova, compare, diagnose, eliminate, goodness, model_error
from doe.response_surface.statistics import Comparison, Difference, Fit, ProcessScore, Score, canonical
from rbdyn.base.arrays import Array, Rows, Whole, one_thread
from rbdyn.base.faults import MethodError
from rbdyn.base.records import finite, outside_json
from rbdyn.base.words import counted

# Range of values over the largest value, below which sums of squares have too few digits.
LEAST_SPREAD = 1e-9
Transform = Literal["none", "box_cox"] | float
# Largest number of points that are left out one by one, and number of groups of more points.
MOST_SINGLY, FOLDS = 60, 20
# Leverage of a point with all its replicates above which the polynomial without it is a guess.
INDISPENSABLE = 0.95
# A rival fitted to the runs of some rows: its predictions (n,) at coded points (n, k).
Rival = Callable[[Rows, Array], Array]


class Surface(Fit, kw_only=True):
    """A fitted surface of one response with its runs ``data``; predictions are in units of the response."""

    data: least_squares.Data = outside_json()

    def predict(self, coded: ArrayLike) -> Array:
        """Mean response at coded points (..., k), shape (...); with a transform its median."""
        points = np.asarray(coded, float)
        constant, gradient, matrix = self._polynomial
        return self._back(np.einsum("...i,...i", points @ matrix + gradient, points) + constant)

    def draws(self, coded: ArrayLike, coefficients: ArrayLike, fields: Array | None = None) -> Array:
        """Response at coded points (..., k) for each row of ``coefficients`` (s, p), shape (s, ...).

        ``fields`` (s, ...): model errors there, on the scale of the fit.
        """
        values = np.moveaxis(model_matrix(coded, self.terms) @ np.asarray(coefficients, float).T, -1, 0)
        return self._back(values if fields is None else values + fields)

    def prediction_standard_error(self, coded: ArrayLike) -> Array:
        """Standard error of the mean response at coded points (..., k), shape (...), its model error included.

        A new observation has ``residual_mean_square`` as additional variance. For a transformed response it is the error
        of the transform over the slope of the transform, to first order.
        """
        variance = self.coefficient_error(coded) ** 2
        error = np.sqrt(variance + (0.0 if self.model_error is None else self.model_error.variance))
        if self.transform is None:
            return error
        return error / least_squares.slope(self.predict(coded), self.transform)

    def coefficient_error(self, coded: ArrayLike) -> Array:
        """Standard error of the fit at coded points (..., k), shape (...), by the covariance of its coefficients alone."""
        matrix = model_matrix(coded, self.terms)
        return np.sqrt(np.einsum("...j,jk,...k", matrix, self.covariance, matrix).clip(0.0))

    def refit(self, rows: Rows) -> "Surface":
        """The same kind of surface fitted to these runs alone. Raises MethodError when they do not suffice."""
        transform: Transform = "none" if self.transform is None else self.transform
        return _fit(self.name, self.data.rows(rows), self.model, transform, advised=False)

    @cached_property
    def _polynomial(self) -> tuple[float, Array, Array]:
        return second_order(self.terms, self.coefficients, self.data.points.shape[1])

    def _back(self, values: Array) -> Array:
        if self.transform is None:
            return values
        return least_squares.backward(values, self.transform)


@one_thread
def fit(
    coded: ArrayLike,
    values: ArrayLike,
    *,
    name: str,
    model: Model = "quadratic",
    centre: ArrayLike,
    step: ArrayLike,
    standard_errors: ArrayLike | None = None,
    replicates: ArrayLike | None = None,
    block: ArrayLike | None = None,
    transform: Transform | None = None,
) -> Surface:
    """Fit one response by least squares.

    coded : runs in coded units, shape (n, k).
    values : response of each run, shape (n,).
    name : name of the response, for messages.
    model : "linear"; "interaction" (linear and two-factor products); "pure_quadratic" (linear and squares); "quadratic" (full
        second order); or "reduced", the quadratic after backward elimination. This drops the term of largest p until every p
        is at most 0.05, except terms that a remaining interaction or square needs by hierarchy.
    centre, step : actual value of each factor at coded 0 and its change over one coded unit, shape (k,).
    standard_errors : of each value by the replicates of the simulation, shape (n,), NaN where unknown. They are compared
        with the scatter of the runs.
    replicates : number behind each standard error, shape (n,); 0 for errors taken as exact.
    block : label of the block of each run, whole numbers, shape (n,).
    transform : "none", "box_cox" for the recommended exponent, or an exponent: (y^lambda - 1)/lambda, ln y for 0.

    Raises MethodError when shapes differ, a value is not finite, all values are equal, or the model is unknown. It also
    refuses runs that cannot determine the terms, and a transform of values that are not positive.
    """
    if model not in MODELS:
        raise MethodError(f"{name}: model = {model!r}: choose {', '.join(MODELS[:-1])} or {MODELS[-1]}")
    data = least_squares.run_data(name, coded, values, centre, step, standard_errors, replicates, block)
    return _fit(name, data, model, "none" if transform is None else transform, advised=True)


def _fit(name: str, data: least_squares.Data, model: Model, transform: Transform, advised: bool) -> Surface:
    terms = model_terms(data.points.shape[1], model)
    least_squares.check_size(name, model, terms, data.block)
    least_squares.check_matrix(name, model, terms, _columns(data, terms))
    if not np.ptp(data.values):
        raise MethodError(
            f"{name}: all {len(data.values)} values are {data.values[0]:g}, so there is nothing to fit; check the response or "
            "leave it out"
        )
    if np.ptp(data.values) < LEAST_SPREAD * np.abs(data.values).max():
        raise MethodError(
            f"{name}: values differ by {np.ptp(data.values):.3g} about {data.values.mean():.6g}, which rounding hides; subtract a "
            "constant from all"
        )
    exponent = _exponent(name, data, terms, transform)
    response, variances = _on_scale_of_fit(data, exponent)
    removed: list[Removal] = []
    if model == "reduced":
        terms, removed = eliminate(terms, lambda subset: least_squares.solve(_columns(data, subset), response))
    matrix = _columns(data, terms)
    solution = least_squares.solve(matrix, response)
    count = len(terms)
    covariance = (solution.mean_square * solution.inverse)[:count, :count]
    groups = replicate_groups(data.points, data.block)
    table, known_variance = anova(terms, solution, response, data.points, data.block), None
    if variances is not None:
        known_variance, repeats = compare(solution, matrix, response, variances, data.replicates, groups, count)
        table.insert(len(table) - 1, repeats)
    coefficients = solution.coefficients[:count]
    actual = in_actual_units(terms, coefficients, data.centre, data.step)
    stationary, analysis = canonical(terms, coefficients, covariance, solution.dof, data)
    open_to_transform = exponent is None and (data.values > 0).all() and solution.mean_square != 0
    return Surface(
        name=name,
        model=model,
        terms=terms,
        by_term=dict(zip(terms, coefficients.tolist(), strict=True)),
        actual_coefficients=dict(zip(terms, actual.tolist(), strict=True)),
        data=data,
        covariance=covariance,
        residual_mean_square=solution.mean_square,
        residual_dof=solution.dof,
        anova=table,
        **goodness(solution, response, matrix[:, :count] @ coefficients, data.block),
        stationary_point=stationary,
        canonical=analysis,
        inflation={
            term: finite(vif) for term, vif in zip(terms, solution.inflation.tolist(), strict=False) if term != "1"
        },
        blocks=_block_effects(data, solution.coefficients[count:]),
        elimination=removed,
        diagnostics=diagnose(solution, response),
        known_variance=known_variance,
        model_error=model_error(solution, matrix, groups, table, known_variance),
        transform=exponent,
        box_cox=least_squares.box_cox(matrix, data.values, name=name) if advised and open_to_transform else None,
        rival=None,
    )


def _columns(data: least_squares.Data, terms: Terms) -> Array:
    return np.hstack([model_matrix(data.points, terms), data.block_columns])


def _exponent(name: str, data: least_squares.Data, terms: Terms, transform: Transform) -> float | None:
    if transform == "none":
        return None
    least_squares.check_positive(data.values, name)
    if transform == "box_cox":
        transform = least_squares.box_cox(_columns(data, terms), data.values, name=name).recommended
    # The exponent 1 would only shift the response by 1.
    return None if transform == 1 else float(transform)


def _on_scale_of_fit(data: least_squares.Data, exponent: float | None) -> tuple[Array, Array | None]:
    """Response and variance of each run, transformed."""
    errors = data.standard_errors
    if exponent is None:
        return data.values, None if errors is None else errors**2
    variances = None if errors is None else (errors * least_squares.slope(data.values, exponent)) ** 2
    return least_squares.forward(data.values, exponent), variances


def _block_effects(data: least_squares.Data, effects: Array) -> dict[str, float]:
    if not effects.size:
        return {}
    labels, first = np.unique(data.block, return_index=True)
    return dict(zip(map(str, labels), (data.block_columns[first] @ effects).tolist(), strict=True))


def cross_validate(
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
    fitted = fit_emulator(points, response, variances, trend="constant")
    group = replicate_groups(points)
    basis = np.zeros((len(points), 1)) if matrix is None else np.linalg.qr(np.asarray(matrix, float))[0]
    firsts = np.unique(group)
    singly = len(firsts) <= MOST_SINGLY
    folds = _folds(firsts, singly)

    def process(rows: Rows, places: Array) -> Array:
        runs = points[rows], response[rows], variances[rows]
        return fit_emulator(*runs, trend="constant", start=fitted.hyperparameters, search=singly).mean(places)

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
        gaussian_process=_process_score(*scores[1], fitted),
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
