"""Least-squares response surfaces of first and second order, with the statistics to judge them.

Everything is fitted in coded units. Factors are lettered A, B, C in the order of the columns; the terms of
a surface are "1", "A", "AB" (interaction) and "A^2" (square). A number that the data leave undefined, such
as the pure error of a design without replicates, is None and never NaN.

Source: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed.
"""

from collections.abc import Collection, Mapping
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from doe.designs.design import replicate_groups
from doe.designs.model import MODELS, Model, Terms, in_actual_units, model_matrix, model_terms, second_order
from doe.response_surface.anova import (
    AnovaRow,
    Diagnostics,
    Removal,
    anova,
    describe_diagnostics,
    diagnose,
    eliminate,
    find,
    goodness,
    observation_variance,
    p_text,
)
from doe.response_surface.box_cox import BoxCox, backward, box_cox, check_positive, forward, slope
from doe.response_surface.canonical import Canonical, StationaryPoint, canonical, describe_canonical
from doe.response_surface.least_squares import Data, check_errors, check_matrix, check_size, checked, solve
from doe.response_surface.model_error import KnownVariance, ModelError, compare, describe_known_variance, model_error
from doe.threads import one_thread
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record, derived, outside_json

Weighting = Literal["equal", "replicates"]
# Range of values over the largest of them, below which too few digits are left for their sums of squares.
LEAST_SPREAD = 1e-9
Transform = Literal["none", "box_cox"] | float

TESTED = ("t", "p", "low", "high")


class Surface(Record):
    """A fitted surface of one response.

    ``coefficients`` (p,) and ``covariance`` (p, p) follow ``terms``, in coded units and units of the
    response or of its transform; ``transform`` is the exponent of Box and Cox, None without one. They and all
    statistics are on the scale of the fit; predictions are in units of the response. ``covariance`` is
    scaled by ``residual_mean_square`` on ``residual_dof`` degrees of freedom; with weights 1 / variance that
    mean square has no unit, and `known_variance` shows what it should be. ``lack_of_fit`` is what the surface misses
    against the scatter of replicates, ``pure_error`` that scatter about their own means.
    ``observation_variance`` is that of a new run about the surface (of the mean run, if they differ).
    ``r2``, ``adjusted_r2`` and ``predicted_r2`` leave out what the blocks differ by; ``blocks`` are their
    effects by label, about the mean over all runs for which the surface stands. ``vif`` follows ``terms`` (NaN for "1").
    ``actual_coefficients`` are those of the same terms with the factors in actual units, ``box_cox`` is advice on a power
    transform for an untransformed fit, None where values or fit allow none.
    ``stationary_point`` is None for a surface that has none or no single one, ``canonical`` for one without
    curvature, ``known_variance`` where the errors of the runs are not known, ``model_error`` where lack of fit is not
    significant, ``rival`` until `doe.workflow.surfaces.with_rivals` has compared it with a Gaussian process.
    """

    name: str = outside_json()
    data: Data = outside_json()
    coefficients: Array = outside_json()
    vif: Array = outside_json()
    residual_mean_square: float = outside_json()
    model: Model
    by_term: dict[str, float] = derived(lambda self: self._named(self.coefficients), "coefficients")
    anova: list[AnovaRow]
    lack_of_fit: dict[str, Any] = derived(lambda self: _figures(self, "lack_of_fit", "ss", "df", "f", "p"))
    pure_error: dict[str, Any] = derived(lambda self: _figures(self, "pure_error", "ss", "df", "ms"))
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    press: float | None
    cv_percent: float | None
    adequate_precision: float | None
    stationary_point: StationaryPoint | None
    terms: Terms
    standard_errors: dict[str, float] = derived(lambda self: self._named(np.sqrt(np.diag(self.covariance))))
    inflation: dict[str, float | None] = derived(
        lambda self: {row["term"]: row["vif"] for row in self.coefficient_table() if row["term"] != "1"}, "vif"
    )
    tests: dict[str, dict[str, float | None]] = derived(
        lambda self: {row["term"]: {key: row[key] for key in TESTED} for row in self.coefficient_table()}
    )
    covariance: Array
    residual_dof: int
    observation_variance: float
    actual_coefficients: dict[str, float] = derived(
        lambda self: self._named(in_actual_units(self.terms, self.coefficients, self.data.centre, self.data.step))
    )
    weighting: Weighting
    transform: float | None
    box_cox: BoxCox | None
    blocks: dict[str, float]
    elimination: list[Removal]
    canonical: Canonical | None
    known_variance: KnownVariance | None
    model_error: ModelError | None
    diagnostics: Diagnostics
    rival: dict[str, Any] | None

    def predict(self, coded: ArrayLike) -> Array:
        """Response at coded points (..., k), shape (...): its mean, or of a transformed one its median."""
        points = np.asarray(coded, float)
        constant, gradient, matrix = self._polynomial
        return self._back(np.einsum("...i,...i", points @ matrix + gradient, points) + constant)

    def draws(self, coded: ArrayLike, coefficients: ArrayLike, fields: Array | None = None) -> Array:
        """Response at coded points (..., k) for each row of ``coefficients`` (s, p), shape (s, ...).

        ``fields`` (s, ...): what the model misses there, on the scale of the fit.
        """
        columns = model_matrix(coded, self.terms)
        drawn = np.moveaxis(columns @ np.asarray(coefficients, float).T, -1, 0)
        return self._back(drawn if fields is None else drawn + fields)

    def prediction_standard_error(self, coded: ArrayLike) -> Array:
        """Standard error of the mean response at coded points (..., k), shape (...), its model error included.

        A single new observation scatters by ``observation_variance`` more (as a variance). Of a transformed
        response it is that of the transform over the slope of the transform (first order).
        """
        matrix = model_matrix(coded, self.terms)
        variance = np.einsum("...j,jk,...k", matrix, self.covariance, matrix).clip(0.0)
        error = np.sqrt(variance + (0.0 if self.model_error is None else self.model_error.variance))
        if self.transform is None:
            return error
        return error / slope(self.predict(coded), self.transform)

    def refit(self, rows: Rows) -> "Surface":
        """The same kind of surface through these runs alone. Raises MethodError when they do not suffice."""
        transform: Transform = "none" if self.transform is None else self.transform
        return _fit(self.name, self.data.rows(rows), self.model, self.weighting, transform, advised=False)

    @property
    def interval_dof(self) -> int:
        """Degrees of freedom of the intervals of a mean: of the residual, or of the source of the model error."""
        return self.residual_dof if self.model_error is None else self.model_error.dof

    def coefficient_table(self) -> list[dict[str, Any]]:
        """For each term: ``term, coefficient, standard_error, t, p, low, high, vif``, in coded units, at 95 %."""
        errors = np.sqrt(np.diag(self.covariance))
        columns = self.coefficients, errors, special.stdtrit(self.residual_dof, 0.975) * errors, self.vif
        rows = []
        for term, c, error, half, vif in zip(self.terms, *(each.tolist() for each in columns), strict=True):
            t = c / error if error > 0 else None
            p = None if t is None else 2 * float(special.stdtr(self.residual_dof, -abs(t)))
            judged = {"t": t, "p": p, "low": c - half, "high": c + half, "vif": None if vif != vif else vif}
            rows.append({"term": term, "coefficient": c, "standard_error": error, **judged})
        return rows

    @cached_property
    def _polynomial(self) -> tuple[float, Array, Array]:
        return second_order(self.terms, self.coefficients, self.data.points.shape[1])

    def _named(self, values: Array) -> dict[str, float]:
        return dict(zip(self.terms, values.tolist(), strict=True))

    def _back(self, values: Array) -> Array:
        if self.transform is None:
            return values
        return backward(values, self.transform)


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
    weighting: Weighting = "equal",
    block: ArrayLike | None = None,
    transform: Transform | None = None,
    without: Collection[int] = (),
) -> Surface:
    """Fit one response by least squares.

    coded : runs in coded units, shape (n, k).
    values : response of each run, shape (n,).
    name : name of the response, for messages.
    model : "linear"; "interaction" (linear and products of two factors); "pure_quadratic" (linear and squares);
        "quadratic" (full second order); or "reduced", which starts from the quadratic and drops the term of largest p until every p is at most
        0.05, keeping each term that a remaining interaction or square is built on (hierarchy).
    centre, step : actual value of each factor at coded 0 and its change over one coded unit, shape (k,).
    standard_errors : of each value, from the replicates of the simulation, shape (n,). They are compared with
        the scatter of the runs, and weigh them if ``weighting`` says so; NaN where unknown.
    replicates : number behind each standard error, shape (n,); 0 for errors that count as known exactly.
    weighting : "equal", or "replicates" for weights 1 / standard_error^2.
    block : label of the block of each run, whole numbers, shape (n,).
    transform : "none", "box_cox" for the recommended exponent, or an exponent: (y^lambda - 1)/lambda, ln y for 0.
    without : places of factors that the surface does not depend on.

    Raises MethodError when a value is not finite, all are equal, shapes differ, the model is unknown, runs are too few
    for it, the runs cannot distinguish its terms, a transform meets a value that is not positive, or weights are
    asked for and an error is not positive.
    """
    if model not in MODELS:
        raise MethodError(f"{name}: model = {model!r}: choose {', '.join(MODELS[:-1])} or {MODELS[-1]}")
    data = checked(name, coded, values, centre, step, standard_errors, replicates, block, without)
    if weighting == "replicates":
        check_errors(name, standard_errors)
    return _fit(name, data, model, weighting, "none" if transform is None else transform, advised=True)


def _figures(surface: Surface, source: str, *keys: str) -> dict[str, Any]:
    row: Mapping[str, Any] = find(surface.anova, source)
    return {key: row[key] for key in keys}


def _fit(name: str, data: Data, model: Model, weighting: Weighting, transform: Transform, advised: bool) -> Surface:
    terms = model_terms(data.points.shape[1], model, data.without)
    check_size(name, model, terms, data.block)
    check_matrix(name, model, terms, _columns(data, terms))
    if not np.ptp(data.values):
        alike = f"all {len(data.values)} values are {data.values[0]:g}, so there is nothing to fit"
        raise MethodError(f"{name}: {alike}; check the response or leave it out")
    if np.ptp(data.values) < LEAST_SPREAD * np.abs(data.values).max():
        near = f"values differ by {np.ptp(data.values):.3g} about {data.values.mean():.6g}, which rounding hides"
        raise MethodError(f"{name}: {near}; subtract a constant from all")
    exponent = _exponent(name, data, terms, transform)
    response, variances = _on_scale_of_fit(data, exponent)
    weights = 1.0 / variances if weighting == "replicates" and variances is not None else None
    removed: list[Removal] = []
    if model == "reduced":
        terms, removed = eliminate(terms, lambda left: solve(_columns(data, left), response, weights))
    matrix = _columns(data, terms)
    solution = solve(matrix, response, weights)
    count = len(terms)
    covariance = (solution.mean_square * solution.inverse)[:count, :count]
    groups = replicate_groups(data.points, data.block)
    table, known = anova(terms, solution, response, data.points, data.block), None
    if variances is not None:
        known = compare(solution, matrix, response, variances, data.replicates, groups, count)
        table.insert(len(table) - 1, known.pure_error)
    coefficients = solution.coefficients[:count]
    stationary, analysis = canonical(terms, coefficients, covariance, solution.dof, data)
    open_to_transform = exponent is None and (data.values > 0).all() and solution.mean_square != 0
    return Surface(
        name=name,
        model=model,
        terms=terms,
        coefficients=coefficients,
        data=data,
        covariance=covariance,
        residual_mean_square=solution.mean_square,
        residual_dof=solution.dof,
        anova=table,
        **goodness(solution, response, matrix[:, :count] @ coefficients, data.block),
        stationary_point=stationary,
        canonical=analysis,
        vif=solution.inflation[:count],
        blocks=_block_effects(data, solution.coefficients[count:]),
        elimination=removed,
        diagnostics=diagnose(solution, response),
        known_variance=known,
        model_error=model_error(solution, matrix, groups, table, known),
        observation_variance=observation_variance(solution),
        weighting=weighting,
        transform=exponent,
        box_cox=box_cox(matrix, data.values, name=name) if advised and open_to_transform else None,
        rival=None,
    )


def _columns(data: Data, terms: Terms) -> Array:
    return np.hstack([model_matrix(data.points, terms), data.block_columns])


def _exponent(name: str, data: Data, terms: Terms, transform: Transform) -> float | None:
    if transform == "none":
        return None
    check_positive(data.values, name)
    if transform == "box_cox":
        transform = box_cox(_columns(data, terms), data.values, name=name)["recommended"]
    # The exponent 1 would only move the response by 1.
    return None if transform == 1 else float(transform)


def _on_scale_of_fit(data: Data, exponent: float | None) -> tuple[Array, Array | None]:
    """Response and variance of each run, transformed."""
    errors = data.standard_errors
    if exponent is None:
        return data.values, None if errors is None else errors**2
    variances = None if errors is None else (errors * slope(data.values, exponent)) ** 2
    return forward(data.values, exponent), variances


def _block_effects(data: Data, effects: Array) -> dict[str, float]:
    if not effects.size:
        return {}
    labels, first = np.unique(data.block, return_index=True)
    return dict(zip(map(str, labels), (data.block_columns[first] @ effects).tolist(), strict=True))


ALPHA = 0.05  # p-value up to which something is significant
FAR_APART = 0.2  # difference of adjusted and predicted R2 above which they disagree
DISCERNIBLE = 4.0  # adequate precision above which the surface can steer a search


def describe(surface: Surface) -> list[str]:
    """Say in sentences what is significant at `ALPHA`, whether the surface fits, and what to look at."""
    known, canonical = surface.known_variance, surface.canonical
    sentences = [
        *(_terms(surface), _lack_of_fit(surface), _removed(surface), _blocks(surface)),
        *([] if known is None else describe_known_variance(known, ALPHA)),
        *(_model_error(surface), _summary(surface)),
        *describe_diagnostics(surface.diagnostics, ALPHA),
        _transform(surface),
        "" if canonical is None else describe_canonical(canonical, surface.stationary_point),
        "" if surface.rival is None else surface.rival["sentence"],
    ]
    head = f"{surface.name}: "
    # Some name their response by themselves.
    return [head + sentence.removeprefix(head) for sentence in sentences if sentence]


def _terms(surface: Surface) -> str:
    tested = [row for row in surface.anova if row["source"] in surface.terms]
    known = {row["source"]: row["p"] for row in tested if row["p"] is not None}
    if len(known) < len(tested):
        return "the surface leaves no residual, so its terms cannot be tested."
    strong = sorted((p, source) for source, p in known.items() if p <= ALPHA)
    weak = [source for source, p in known.items() if p > ALPHA]
    listed = ", ".join(f"{source} ({p_text(p)})" for p, source in strong)
    head = f"significant at {ALPHA:g}: {listed}" if strong else f"no term is significant at {ALPHA:g}"
    return head + (f"; not significant: {', '.join(weak)}." if weak else ".")


def _lack_of_fit(surface: Surface) -> str:
    p = surface.lack_of_fit["p"]
    if p is not None and p <= ALPHA:
        what = (
            f"lack of fit is significant ({p_text(p)}): the surface misses more than the scatter of replicates explains"
        )
        return (
            f"{what}; enlarge the model, transform the response or narrow the region, and confirm predictions by runs."
        )
    if p is not None:
        what = "what the surface misses is within the scatter of replicates"
        return f"lack of fit is not significant ({p_text(p)}): {what}."
    if surface.pure_error["df"] == 0:
        return "lack of fit cannot be tested, for no run is replicated; add centre replicates."
    if surface.lack_of_fit["df"] == 0:
        return "lack of fit cannot be tested, for the model has as many terms as distinct points."
    return "lack of fit cannot be tested, for the replicates agree exactly."


def _model_error(surface: Surface) -> str:
    if (error := surface.model_error) is None:
        return ""
    return (
        "the 95 % intervals of its mean join the error of the coefficients with what the model misses, a standard "
        f"deviation of {error.variance**0.5:.3g} shown by {error.source} ({error.dof} degrees of freedom)."
    )


def _removed(surface: Surface) -> str:
    if not surface.elimination:
        return ""
    listed = ", ".join(f"{each['term']} ({p_text(each['p'])})" for each in surface.elimination)
    return f"removed in this order: {listed}; p values of the remaining terms are optimistic, for the same runs selected them."


def _blocks(surface: Surface) -> str:
    if not surface.blocks or (p := find(surface.anova, "block")["p"]) is None:
        return ""
    verdict = "differ" if p <= ALPHA else "do not differ significantly"
    return f"the blocks {verdict} ({p_text(p)}); predictions are for the mean over all runs."


def _summary(surface: Surface) -> str:
    adjusted, predicted = surface.adjusted_r2, surface.predicted_r2
    if adjusted is None or predicted is None:
        return "predicted R2 cannot be computed, for a run is met exactly by its own coefficient."
    figures = f"adjusted R2 {adjusted:.3f} and predicted R2 {predicted:.3f}"
    precision = surface.adequate_precision
    tail = ""
    if precision is not None and precision < DISCERNIBLE:
        tail = f" Adequate precision {precision:.3g} is below {DISCERNIBLE:g}: the scatter hides the surface."
    if adjusted - predicted > FAR_APART:
        return (
            f"{figures} differ by more than {FAR_APART:g}: the surface predicts new runs worse than it fits its own; "
            f"look for influential runs or drop terms.{tail}"
        )
    return f"{figures} agree.{tail}"


def _transform(surface: Surface) -> str:
    if surface.transform is not None:
        return (
            f"fitted as Box-Cox transform with exponent {surface.transform:.3g}; the analysis is on that scale, "
            "predictions are medians in the unit of the response."
        )
    return "" if surface.box_cox is None else str(surface.box_cox["sentence"])
