"""Least-squares response surfaces of first and second order, with their statistics and canonical analysis.

Fits are in coded units. Factors have the letters A, B, C in the order of the columns; the terms of a surface are "1", "A",
"AB" (interaction) and "A^2" (square). An undefined number, such as the pure error of a design without replicates, is None
and never NaN. Canonical analysis gives the stationary point, the axes of curvature, and the errors of the curvature.

Sources: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 6.3-6.4 for nature and ridges; Bisgaard
and Ankenman, Standard errors for the eigenvalues in second-order response surface models (1996).
"""

from collections.abc import Mapping
from functools import cached_property
from string import ascii_uppercase
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from doe.designs import to_actual
from doe.designs.design import replicate_groups
from doe.designs.model import MODELS, Model, Terms, in_actual_units, model_matrix, model_terms, second_order
from doe.response_surface.adequacy import (
    AnovaRow,
    Diagnostics,
    KnownVariance,
    ModelError,
    Removal,
    Source,
    anova,
    compare,
    describe_diagnostics,
    describe_known_variance,
    diagnose,
    eliminate,
    find,
    goodness,
    model_error,
    p_text,
)
from doe.response_surface.least_squares import (
    BoxCox,
    Data,
    backward,
    box_cox,
    check_matrix,
    check_positive,
    check_size,
    forward,
    run_data,
    slope,
    solve,
)
from doe.threads import one_thread
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record, derived, outside_json

FLAT = 1e-10  # curvature as a share of the largest coefficient below which it is rounding
Nature = Literal["minimum", "maximum", "saddle"]
SURE = 0.95  # probability of the intervals of the eigenvalues


class StationaryPoint(TypedDict):
    """Point of zero gradient; ``eigenvalues`` of the matrix of second-order coefficients."""

    coded: list[float]
    actual: list[float]
    eigenvalues: list[float]
    nature: Nature


class Canonical(TypedDict):
    """Curvature with its error, and the nature of the stationary point.

    ``eigenvalues`` ascend; ``eigenvalue_errors`` are half widths of their 95 % intervals, None without a residual.
    ``eigenvectors[i]`` is the axis of ``eigenvalues[i]`` in coded units. ``nature`` is "minimum", "maximum" or "saddle". When
    an eigenvalue is within its error of zero, it is "stationary ridge" with the stationary point in the region, else
    "rising ridge". ``inside``: whether the point is in the region of the runs. ``distance``: from the centre (coded).
    """

    eigenvalues: list[float]
    eigenvalue_errors: list[float] | None
    eigenvectors: list[list[float]]
    nature: str
    inside: bool | None
    distance: float | None


def canonical(
    terms: Terms, coefficients: Array, covariance: Array, dof: int, data: Data
) -> tuple[StationaryPoint | None, Canonical | None]:
    """The stationary point and the canonical analysis of a surface fitted to ``data``.

    The point is None where a direction has no curvature, the analysis None without second-order terms.
    """
    factors = data.points.shape[1]
    _, gradient, matrix = second_order(terms, coefficients, factors)
    if not any(len(term) > 1 for term in terms):
        return None, None
    eigenvalues, vectors = (part.astype(float) for part in np.linalg.eigh(matrix))
    vectors = vectors * np.sign(vectors[np.abs(vectors).argmax(axis=0), np.arange(factors)])
    errors = _errors(terms, vectors, covariance, dof) if covariance.any() else None
    flat = np.abs(eigenvalues) <= FLAT * np.abs(coefficients).max()
    unsure = flat if errors is None else flat | (np.abs(eigenvalues) <= errors)
    sign: Nature = "minimum" if eigenvalues.min() > 0 else "maximum" if eigenvalues.max() < 0 else "saddle"
    stationary, inside, distance = None, None, None
    if not flat.any():
        place = np.linalg.solve(-2 * matrix, gradient).astype(float)
        inside, distance = _inside(place, data.points), float(np.linalg.norm(place))
        actual = to_actual(place, data.centre, data.step).tolist()
        coded, values = place.tolist(), np.linalg.eigvalsh(matrix).tolist()
        stationary = StationaryPoint(coded=coded, actual=actual, eigenvalues=values, nature=sign)
    ridge = "stationary ridge" if inside else "rising ridge"
    return stationary, Canonical(
        eigenvalues=eigenvalues.tolist(),
        eigenvalue_errors=None if errors is None else errors.tolist(),
        eigenvectors=vectors.T.tolist(),
        nature=ridge if unsure.any() else sign,
        inside=inside,
        distance=distance,
    )


def describe_canonical(analysis: Canonical, place: StationaryPoint | None) -> str:
    """Canonical analysis in a sentence."""
    values = ", ".join(f"{value:.3g}" for value in analysis["eigenvalues"])
    if place is None:
        return f"there is no single stationary point, for one direction has no curvature (eigenvalues {values})."
    where = ", ".join(f"{letter} = {x:.3g}" for letter, x in zip(ascii_uppercase, place["coded"], strict=False))
    region = "inside" if analysis["inside"] else "outside"
    head = f"the stationary point at {where} (coded), {region} the region of the runs, is a {analysis['nature']}"
    if "ridge" not in analysis["nature"]:
        if analysis["inside"]:
            return f"{head} (eigenvalues {values})."
        return f"{head} (eigenvalues {values}); the best point is on the border of the region."
    axis = int(np.argmin(np.abs(analysis["eigenvalues"])))
    lettered = zip(ascii_uppercase, analysis["eigenvectors"][axis], strict=False)
    direction = " ".join(f"{x:+.2f} {letter}" for letter, x in lettered)
    return (
        f"{head} (eigenvalues {values}, one within its error of zero): its position along {direction} is undetermined."
    )


def _errors(terms: Terms, vectors: Array, covariance: Array, dof: int) -> Array:
    """Half widths by first order: the eigenvalue v'Bv changes with the coefficient of x_i x_j by v_i v_j."""
    second = np.array([len(term) > 1 for term in terms])
    slopes = model_matrix(vectors.T, terms) * second
    variance = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    return special.stdtrit(dof, (1 + SURE) / 2) * np.sqrt(variance.clip(0.0))


def _inside(place: Array, points: Array) -> bool:
    """Within the box of the runs and no farther from the centre than the farthest of them."""
    in_box = bool(((points.min(axis=0) <= place) & (place <= points.max(axis=0))).all())
    return in_box and bool(np.linalg.norm(place) <= np.linalg.norm(points, axis=1).max())


# Range of values over the largest value, below which sums of squares have too few digits.
LEAST_SPREAD = 1e-9
Transform = Literal["none", "box_cox"] | float

TESTED = ("t", "p", "low", "high")


class Surface(Record):
    """A fitted surface of one response.

    Statistics are on the scale of the fit, predictions in units of the response.

    - ``coefficients`` (p,), ``covariance`` (p, p): by ``terms``, in coded units and units of the response or its transform
    - ``transform``: exponent of Box and Cox, None without one
    - ``residual_mean_square``: scale of the covariance, on ``residual_dof`` degrees of freedom
    - ``lack_of_fit``, ``pure_error``: error of the surface beyond the scatter of replicates, and that scatter
    - ``observation_variance``: of a new run about the surface
    - ``r2``, ``adjusted_r2``, ``predicted_r2``: without the differences of blocks
    - ``blocks``: effects by label about the mean over all runs, which the surface predicts
    - ``vif``: by ``terms``, NaN for "1"
    - ``actual_coefficients``: of the same terms in actual units
    - ``box_cox``: advice on a power transform of an untransformed fit, None where values or fit allow none
    - ``stationary_point``: None without a single one; ``canonical``: None without curvature
    - ``known_variance``: None without errors of the runs; ``model_error``: None where scatter explains the residual
    - ``rival``: None until `doe.workflow.surfaces.with_rivals` has compared the surface with a Gaussian process
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
    observation_variance: float = derived(lambda self: self.residual_mean_square)
    actual_coefficients: dict[str, float] = derived(
        lambda self: self._named(in_actual_units(self.terms, self.coefficients, self.data.centre, self.data.step))
    )
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
        """Mean response at coded points (..., k), shape (...); with a transform its median."""
        points = np.asarray(coded, float)
        constant, gradient, matrix = self._polynomial
        return self._back(np.einsum("...i,...i", points @ matrix + gradient, points) + constant)

    def draws(self, coded: ArrayLike, coefficients: ArrayLike, fields: Array | None = None) -> Array:
        """Response at coded points (..., k) for each row of ``coefficients`` (s, p), shape (s, ...).

        ``fields`` (s, ...): model errors there, on the scale of the fit.
        """
        columns = model_matrix(coded, self.terms)
        values = np.moveaxis(columns @ np.asarray(coefficients, float).T, -1, 0)
        return self._back(values if fields is None else values + fields)

    def prediction_standard_error(self, coded: ArrayLike) -> Array:
        """Standard error of the mean response at coded points (..., k), shape (...), its model error included.

        A new observation has ``observation_variance`` as additional variance. For a transformed response it is the error
        of the transform over the slope of the transform, to first order.
        """
        variance = self.coefficient_error(coded) ** 2
        error = np.sqrt(variance + (0.0 if self.model_error is None else self.model_error.variance))
        if self.transform is None:
            return error
        return error / slope(self.predict(coded), self.transform)

    def coefficient_error(self, coded: ArrayLike) -> Array:
        """Standard error of the fit at coded points (..., k), shape (...), by the covariance of its coefficients alone."""
        matrix = model_matrix(coded, self.terms)
        return np.sqrt(np.einsum("...j,jk,...k", matrix, self.covariance, matrix).clip(0.0))

    def refit(self, rows: Rows) -> "Surface":
        """The same kind of surface fitted to these runs alone. Raises MethodError when they do not suffice."""
        transform: Transform = "none" if self.transform is None else self.transform
        return _fit(self.name, self.data.rows(rows), self.model, transform, advised=False)

    @property
    def interval_dof(self) -> int:
        """Degrees of freedom of intervals of a mean: of the source of the model error or, without one, of the residual."""
        return self.residual_dof if self.model_error is None else self.model_error.dof

    def coefficient_table(self) -> list[dict[str, Any]]:
        """For each term: ``term, coefficient, standard_error, t, p, low, high, vif``, in coded units, at 95 %."""
        errors = np.sqrt(np.diag(self.covariance))
        columns = self.coefficients, errors, special.stdtrit(self.residual_dof, 0.975) * errors, self.vif
        rows = []
        for term, c, error, half, vif in zip(self.terms, *(column.tolist() for column in columns), strict=True):
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
    data = run_data(name, coded, values, centre, step, standard_errors, replicates, block)
    return _fit(name, data, model, "none" if transform is None else transform, advised=True)


def _figures(surface: Surface, source: str, *keys: str) -> dict[str, Any]:
    row: Mapping[str, Any] = find(surface.anova, source)
    return {key: row[key] for key in keys}


def _fit(name: str, data: Data, model: Model, transform: Transform, advised: bool) -> Surface:
    terms = model_terms(data.points.shape[1], model)
    check_size(name, model, terms, data.block)
    check_matrix(name, model, terms, _columns(data, terms))
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
        terms, removed = eliminate(terms, lambda subset: solve(_columns(data, subset), response))
    matrix = _columns(data, terms)
    solution = solve(matrix, response)
    count = len(terms)
    covariance = (solution.mean_square * solution.inverse)[:count, :count]
    groups = replicate_groups(data.points, data.block)
    table, known_variance = anova(terms, solution, response, data.points, data.block), None
    if variances is not None:
        known_variance = compare(solution, matrix, response, variances, data.replicates, groups, count)
        table.insert(len(table) - 1, known_variance.pure_error)
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
        known_variance=known_variance,
        model_error=model_error(solution, matrix, groups, table, known_variance),
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
    # The exponent 1 would only shift the response by 1.
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
INFLATED = 10.0  # variance inflation factor above which runs hardly tell a term from the others


def describe(surface: Surface) -> list[str]:
    """Sentences on significance at `ALPHA`, on the adequacy of the surface, and on what to check."""
    known_variance, canonical = surface.known_variance, surface.canonical
    sentences = [
        *(_terms(surface), _collinearity(surface), _lack_of_fit(surface), _removed(surface), _blocks(surface)),
        *([] if known_variance is None else describe_known_variance(known_variance, ALPHA)),
        *(_model_error(surface), _summary(surface)),
        *describe_diagnostics(surface.diagnostics, ALPHA),
        _transform(surface),
        "" if canonical is None else describe_canonical(canonical, surface.stationary_point),
        "" if surface.rival is None else surface.rival["sentence"],
    ]
    head = f"{surface.name}: "
    # Some sentences already start with the name of the response.
    return [head + sentence.removeprefix(head) for sentence in sentences if sentence]


def _terms(surface: Surface) -> str:
    tested = [row for row in surface.anova if row["source"] in surface.terms]
    p_values = {row["source"]: row["p"] for row in tested if row["p"] is not None}
    if len(p_values) < len(tested):
        return "the surface has no residual, so its terms cannot be tested."
    strong = sorted((p, source) for source, p in p_values.items() if p <= ALPHA)
    weak = [source for source, p in p_values.items() if p > ALPHA]
    listed = ", ".join(f"{source} ({p_text(p)})" for p, source in strong)
    if not strong:
        f, p = (find(surface.anova, "model")[key] for key in ("f", "p"))
        whole = f", but the model as a whole is (F = {f:.3g}, {p_text(p)})" if p is not None and p <= ALPHA else ""
        return f"no term alone is significant at {ALPHA:g}{whole}."
    if not weak:
        return f"significant at {ALPHA:g}: {listed}."
    return f"significant at {ALPHA:g}: {listed}; not significant: {', '.join(weak)}."


def _collinearity(surface: Surface) -> str:
    inflated = [term for term, vif in surface.inflation.items() if vif is not None and vif > INFLATED]
    if not inflated:
        return ""
    return (
        f"the runs hardly separate {', '.join(inflated)} from the other terms (variance inflation factor up to "
        f"{np.nanmax(surface.vif):.2g}): their coefficients and p values say little; drop one of them, or add runs that vary them apart."
    )


def _lack_of_fit(surface: Surface) -> str:
    known = surface.known_variance
    tests = {
        "pure error": surface.lack_of_fit["p"],
        "the known variance": None if known is None or known.refuted else known.p,
    }
    values = {what: p for what, p in tests.items() if p is not None}
    if not values and surface.pure_error["df"] == 0:
        return "lack of fit cannot be tested, for no run is replicated; add centre replicates."
    if not values and surface.lack_of_fit["df"] == 0:
        return "lack of fit cannot be tested, for the model has as many terms as distinct points."
    if surface.pure_error["ms"] == 0.0:
        verdict = "certain" if surface.lack_of_fit["ss"] else "none"
        return f"lack of fit is {verdict}, for the replicates agree exactly and the residual is {'not ' if verdict == 'certain' else ''}zero."
    listed = ", ".join(f"{p_text(p)} against {what}" for what, p in values.items())
    if min(values.values()) > ALPHA:
        return (
            f"lack of fit is not significant ({listed}): the error of the surface is within the scatter of replicates."
        )
    if max(values.values()) > ALPHA:
        return f"lack of fit is in doubt, for the tests disagree ({listed}): confirm predictions by runs, or add replicates."
    return (
        f"lack of fit is significant ({listed}): the error of the surface exceeds the scatter of replicates; enlarge the model, "
        "transform the response or narrow the region, and confirm predictions by runs."
    )


SHOWN_BY: Mapping[Source, str] = {
    "repeats": "shown by repeats",
    "known variance": "shown by the known variance",
    "residual": "which is the whole residual, for no scatter of a run is known",
}


def _model_error(surface: Surface) -> str:
    if (error := surface.model_error) is None:
        return ""
    return (
        f"the 95 % intervals of its mean include a model error of standard deviation {error.variance**0.5:.3g}, "
        f"{SHOWN_BY[error.source]} ({error.dof} degrees of freedom)."
    )


def _removed(surface: Surface) -> str:
    if not surface.elimination:
        return ""
    listed = ", ".join(f"{removal['term']} ({p_text(removal['p'])})" for removal in surface.elimination)
    return f"removed in this order: {listed}; p values of the other terms are optimistic, for the same runs selected the terms."


def _blocks(surface: Surface) -> str:
    if not surface.blocks or (p := find(surface.anova, "block")["p"]) is None:
        return ""
    verdict = "differ" if p <= ALPHA else "do not differ significantly"
    return f"the blocks {verdict} ({p_text(p)}); predictions are for the mean over all runs."


def _summary(surface: Surface) -> str:
    adjusted_r2, predicted_r2 = surface.adjusted_r2, surface.predicted_r2
    if adjusted_r2 is None or predicted_r2 is None:
        return "predicted R2 cannot be computed, for the fit passes through a run whatever its value."
    figures = f"adjusted R2 {adjusted_r2:.3f} and predicted R2 {predicted_r2:.3f}"
    precision = surface.adequate_precision
    tail = ""
    if precision is not None and precision < DISCERNIBLE:
        tail = (
            f" Adequate precision {precision:.3g} is below {DISCERNIBLE:g}: scatter exceeds the effects of the factors."
        )
    if adjusted_r2 - predicted_r2 > FAR_APART:
        return (
            f"{figures} differ by more than {FAR_APART:g}: the surface predicts new runs worse than it fits its own runs; "
            f"check influential runs or drop terms.{tail}"
        )
    return f"{figures} agree.{tail}"


def _transform(surface: Surface) -> str:
    if surface.transform is not None:
        return (
            f"the response is fitted as its Box-Cox transform with exponent {surface.transform:.3g}; the analysis is on that "
            "scale, predictions are medians in the unit of the response."
        )
    return "" if surface.box_cox is None else str(surface.box_cox["sentence"])
