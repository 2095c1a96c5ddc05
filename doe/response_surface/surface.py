"""Least-squares response surfaces of first and second order, with the statistics to judge them.

Everything is fitted in coded units. Factors are lettered A, B, C in the order of the columns; the terms of
a surface are "1", "A", "AB" (interaction) and "A^2" (square). A number that the data leave undefined, such
as the pure error of a design without replicates, is None and never NaN.

Source: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from string import ascii_uppercase
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import linalg, stats
from sklearn.preprocessing import PolynomialFeatures

from doe.designs import to_actual

Array = NDArray[np.float64]
Model = Literal["linear", "quadratic", "reduced"]

SAME_POINT = 1e-9  # coded units within which two runs are replicates
KEEP_BELOW = 0.05  # p-value up to which backward elimination keeps a term
STATISTICS = (
    *("anova", "lack_of_fit", "pure_error", "r2", "adjusted_r2", "predicted_r2", "press"),
    *("cv_percent", "adequate_precision", "stationary_point"),
)


class AnovaRow(TypedDict):
    """One row of an analysis of variance; ``ss`` of a term is partial (type III)."""

    source: str
    ss: float | None
    df: int
    ms: float | None
    f: float | None
    p: float | None


class StationaryPoint(TypedDict):
    """Where the gradient vanishes; ``eigenvalues`` are those of the matrix of second-order coefficients."""

    coded: list[float]
    actual: list[float]
    eigenvalues: list[float]
    nature: Literal["minimum", "maximum", "saddle"]


@dataclass(frozen=True, eq=False)
class Surface:
    """A fitted surface of one response.

    ``coefficients`` (p,) and ``covariance`` (p, p) follow ``terms``, in coded units and units of the
    response. ``stationary_point`` is None for a surface that has none or no single one. The other fields
    carry the names and meanings of the analysis-of-variance table and its summary.
    """

    name: str
    model: Model
    terms: tuple[str, ...]
    coefficients: Array
    covariance: Array
    residual_mean_square: float
    residual_dof: int
    anova: list[AnovaRow]
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    press: float | None
    cv_percent: float | None
    adequate_precision: float | None
    stationary_point: StationaryPoint | None

    def predict(self, coded: ArrayLike) -> Array:
        """Mean response at coded points (..., k), shape (...)."""
        values: Array = model_matrix(coded, self.terms) @ self.coefficients
        return values

    def prediction_standard_error(self, coded: ArrayLike) -> Array:
        """Standard error of the mean response at coded points (..., k), shape (...).

        A single new observation scatters by ``residual_mean_square`` more (as a variance).
        """
        matrix = model_matrix(coded, self.terms)
        variance: Array = np.einsum("...j,jk,...k", matrix, self.covariance, matrix)
        error: Array = np.sqrt(variance.clip(0.0))
        return error

    @property
    def lack_of_fit(self) -> dict[str, Any]:
        """What the surface misses against the scatter of replicates: ``ss``, ``df``, ``f``, ``p``."""
        row = _find(self.anova, "lack_of_fit")
        return {"ss": row["ss"], "df": row["df"], "f": row["f"], "p": row["p"]}

    @property
    def pure_error(self) -> dict[str, Any]:
        """Scatter of replicates about their own means: ``ss``, ``df``, ``ms``."""
        row = _find(self.anova, "pure_error")
        return {"ss": row["ss"], "df": row["df"], "ms": row["ms"]}

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and dicts, ready for JSON: coefficients by term, and all statistics."""
        coefficients = dict(zip(self.terms, self.coefficients.tolist(), strict=True))
        statistics = {key: getattr(self, key) for key in STATISTICS}
        return {"model": self.model, "coefficients": coefficients, **statistics}


@dataclass(frozen=True, eq=False)
class _LeastSquares:
    """Solution of one problem; ``inverse`` is that of X'X, ``leverage`` the diagonal of the hat matrix."""

    coefficients: Array
    inverse: Array
    residuals: Array
    leverage: Array
    mean_square: float
    dof: int

    def tests(self, terms: tuple[str, ...]) -> list[AnovaRow]:
        """Partial sum of squares, F and p of each coefficient."""
        squares = (self.coefficients**2 / np.diag(self.inverse)).tolist()
        pairs = zip(terms, squares, strict=True)
        return [_row(term, ss, 1, self.mean_square, self.dof) for term, ss in pairs]


def fit(
    coded: ArrayLike,
    values: ArrayLike,
    *,
    name: str,
    model: Model = "quadratic",
    centre: ArrayLike,
    step: ArrayLike,
) -> Surface:
    """Fit one response by least squares.

    Parameters
    ----------
    coded : runs in coded units, shape (n, k).
    values : response of each run, shape (n,).
    name : name of the response, for messages.
    model : "linear"; "quadratic" (full second order); or "reduced", which starts from the quadratic and
        drops the term of largest p until every p is at most 0.05, keeping each term that a remaining
        interaction or square is built on (hierarchy).
    centre, step : actual value of each factor at coded 0 and its change over one coded unit, shape (k,).

    Raises
    ------
    ValueError when a value is not finite, shapes differ, the model is unknown, runs are too few for it, or
    the runs cannot tell its terms apart.
    """
    points, response = np.asarray(coded, float), np.asarray(values, float)
    _check(points, response, name, model)
    actual_units = np.broadcast_to(centre, points.shape[1]), np.broadcast_to(step, points.shape[1])
    terms = _model_terms(points.shape[1], model)
    _check_matrix(model_matrix(points, terms), terms, name, model)
    if model == "reduced":
        terms = _eliminate(points, response, terms)
    solution = _solve(model_matrix(points, terms), response)
    total, press = _scatter(response), _press(solution)
    mean_square, dof = solution.mean_square, solution.dof
    deviation_of_fit = math.sqrt(len(terms) * mean_square / response.size)
    return Surface(
        name=name,
        model=model,
        terms=terms,
        coefficients=solution.coefficients,
        covariance=mean_square * solution.inverse,
        residual_mean_square=mean_square,
        residual_dof=dof,
        anova=_anova(terms, solution, total, points, response),
        r2=_complement(mean_square * dof, total),
        adjusted_r2=_complement(mean_square, total / (response.size - 1)),
        predicted_r2=None if press is None else _complement(press, total),
        press=press,
        cv_percent=_ratio(100 * math.sqrt(mean_square), abs(float(response.mean()))),
        adequate_precision=_ratio(float(np.ptp(response - solution.residuals)), deviation_of_fit),
        stationary_point=_stationary_point(terms, solution.coefficients, *actual_units),
    )


def model_matrix(coded: ArrayLike, terms: tuple[str, ...]) -> Array:
    """Columns of ``terms`` at coded points (..., k), shape (..., number of terms)."""
    points = np.asarray(coded, float)
    columns = _columns(points.shape[-1])
    everything: Array = PolynomialFeatures(2).fit_transform(points.reshape(-1, points.shape[-1]))
    return everything[:, [columns[term] for term in terms]].reshape(*points.shape[:-1], len(terms))


def describe(surface: Surface, alpha: float = 0.05) -> list[str]:
    """Say in sentences which terms are significant at ``alpha`` and what the lack of fit means."""
    return [_describe_terms(surface, alpha), _describe_lack_of_fit(surface, alpha)]


def _describe_terms(surface: Surface, alpha: float) -> str:
    tested = [row for row in surface.anova if row["source"] in surface.terms]
    known = {row["source"]: row["p"] for row in tested if row["p"] is not None}
    if len(known) < len(tested):
        return f"{surface.name}: the surface leaves no residual, so its terms cannot be tested."
    strong = sorted((p, source) for source, p in known.items() if p <= alpha)
    weak = [source for source, p in known.items() if p > alpha]
    listed = ", ".join(f"{source} ({_p_text(p)})" for p, source in strong)
    head = f"significant at {alpha:g}: {listed}" if strong else f"no term is significant at {alpha:g}"
    return f"{surface.name}: {head}" + (f"; not significant: {', '.join(weak)}." if weak else ".")


def _describe_lack_of_fit(surface: Surface, alpha: float) -> str:
    p, name = surface.lack_of_fit["p"], surface.name
    if p is not None and p <= alpha:
        return (
            f"{name}: lack of fit is significant ({_p_text(p)}): the surface misses more than the scatter of "
            "replicates explains; enlarge the model, transform the response or narrow the region, and "
            "confirm predictions by runs."
        )
    if p is not None:
        found = f"lack of fit is not significant ({_p_text(p)})"
        return f"{name}: {found}: what the surface misses is within the scatter of replicates."
    if surface.pure_error["df"] == 0:
        return f"{name}: lack of fit cannot be tested, for no run is replicated; add centre replicates."
    if surface.lack_of_fit["df"] == 0:
        return f"{name}: lack of fit cannot be tested, for the model has as many terms as distinct points."
    return f"{name}: lack of fit cannot be tested, for the replicates agree exactly."


def _find(anova: list[AnovaRow], source: str) -> AnovaRow:
    return next(row for row in anova if row["source"] == source)


def _p_text(p: float) -> str:
    return "p < 0.0001" if p < 1e-4 else f"p = {p:.4f}"


@cache
def _columns(factors: int) -> dict[str, int]:
    """Column of each second-order term in scikit-learn's order; listed linear, interactions, squares."""
    powers = PolynomialFeatures(2).fit(np.zeros((1, factors))).powers_
    order = sorted(range(len(powers)), key=lambda row: (powers[row].sum(), powers[row].max()))
    return {_term(powers[row]): row for row in order}


def _term(powers: NDArray[np.int64]) -> str:
    letters = zip(ascii_uppercase, powers, strict=False)
    return "".join(letter if power == 1 else f"{letter}^2" for letter, power in letters if power) or "1"


def _model_terms(factors: int, model: Model) -> tuple[str, ...]:
    terms = tuple(_columns(factors))
    return terms[: factors + 1] if model == "linear" else terms


def _check(points: Array, response: Array, name: str, model: str) -> None:
    if model not in ("linear", "quadratic", "reduced"):
        raise ValueError(f"{name}: model = {model!r}: choose linear, quadratic or reduced")
    if points.ndim != 2 or response.shape != (len(points),):
        shapes = f"points of shape {points.shape} and values of shape {response.shape}"
        raise ValueError(f"{name}: {shapes} do not match; give one row of factors and one value a run")
    if not np.isfinite(points).all():
        raise ValueError(f"{name}: a coded factor is not a finite number; mend or leave out that run")
    bad = np.flatnonzero(~np.isfinite(response))
    if bad.size:
        found = f"the value of run {bad[0] + 1} is {response[bad[0]]}"
        raise ValueError(f"{name}: {found}; mend or leave out that run")


def _check_matrix(matrix: Array, terms: tuple[str, ...], name: str, model: str) -> None:
    runs, size = matrix.shape
    if runs <= size:
        raise ValueError(
            f"{name}: {runs} runs are too few for the {model} model; give at least {size + 1} "
            f"({size} terms and one to judge the fit) or choose a simpler model"
        )
    _, triangle, pivots = linalg.qr(matrix / np.linalg.norm(matrix, axis=0).clip(1e-300), pivoting=True)
    dependent = np.abs(np.diag(triangle)) <= 1e-9
    if dependent.any():
        lost = ", ".join(sorted(terms[pivot] for pivot in pivots[dependent]))
        raise ValueError(
            f"{name}: the runs cannot tell {lost} from the other terms of the {model} model (its matrix is "
            "singular); add design points or choose a simpler model"
        )


def _eliminate(points: Array, response: Array, terms: tuple[str, ...]) -> tuple[str, ...]:
    while True:
        removable = [
            (row["p"], row["source"])
            for row in _solve(model_matrix(points, terms), response).tests(terms)
            if row["p"] is not None and row["p"] > KEEP_BELOW and not _needed(row["source"], terms)
        ]
        if not removable:
            return terms
        terms = tuple(term for term in terms if term != max(removable)[1])


def _needed(term: str, terms: tuple[str, ...]) -> bool:
    return term == "1" or any(term in other for other in terms if other != term)


def _solve(matrix: Array, response: Array) -> _LeastSquares:
    orthogonal, triangle = linalg.qr(matrix, mode="economic")
    coefficients = linalg.solve_triangular(triangle, orthogonal.T @ response)
    root = linalg.solve_triangular(triangle, np.eye(len(triangle)))
    residuals = response - matrix @ coefficients
    dof = matrix.shape[0] - matrix.shape[1]
    return _LeastSquares(
        coefficients=coefficients,
        inverse=root @ root.T,
        residuals=residuals,
        leverage=(orthogonal**2).sum(axis=1),
        mean_square=float(residuals @ residuals) / dof,
        dof=dof,
    )


def _anova(
    terms: tuple[str, ...], solution: _LeastSquares, total: float, points: Array, response: Array
) -> list[AnovaRow]:
    dof, mean_square, model_df = solution.dof, solution.mean_square, len(terms) - 1
    residual = mean_square * dof
    return [
        _row("model", total - residual, model_df, mean_square, dof),
        *(row for row in solution.tests(terms) if row["source"] != "1"),
        _row("residual", residual, dof),
        *_lack_of_fit(points, response, residual, dof),
        AnovaRow(source="total", ss=total, df=model_df + dof, ms=None, f=None, p=None),
    ]


def _row(source: str, ss: float | None, df: int, error: float | None = None, error_df: int = 0) -> AnovaRow:
    """A row with its mean square, tested by F against the mean square ``error`` if there is one."""
    mean_square = None if ss is None else _ratio(ss, df)
    f = None if mean_square is None or error is None else _ratio(mean_square, error)
    p = None if f is None else float(stats.f.sf(f, df, error_df))
    return AnovaRow(source=source, ss=ss, df=df, ms=mean_square, f=f, p=p)


def _lack_of_fit(points: Array, response: Array, residual: float, dof: int) -> tuple[AnovaRow, AnovaRow]:
    apart = np.abs(points[:, None, :] - points[None, :, :]).max(axis=2)
    group = (apart <= SAME_POINT).argmax(axis=1)
    pure_df = len(response) - len(np.unique(group))
    if pure_df == 0:
        return _row("lack_of_fit", None, dof), _row("pure_error", None, 0)
    pure = sum(_scatter(response[group == first]) for first in np.unique(group))
    lack = _row("lack_of_fit", max(residual - pure, 0.0), dof - pure_df, pure / pure_df, pure_df)
    return lack, _row("pure_error", pure, pure_df)


def _scatter(values: Array) -> float:
    """Sum of squares about the mean; measured from the first value, equal values give exactly zero."""
    offset = values - values[0]
    return float(((offset - offset.mean()) ** 2).sum())


def _press(solution: _LeastSquares) -> float | None:
    free = 1.0 - solution.leverage
    if (free <= 1e-12).any():
        return None
    return float(((solution.residuals / free) ** 2).sum())


def _stationary_point(
    terms: tuple[str, ...], coefficients: Array, centre: Array, step: Array
) -> StationaryPoint | None:
    by_term = dict(zip(terms, coefficients.tolist(), strict=True))
    letters = ascii_uppercase[: centre.size]
    gradient = np.array([by_term.get(letter, 0.0) for letter in letters])
    upper = np.array([[by_term.get(f"{a}^2" if a == b else a + b, 0.0) for b in letters] for a in letters])
    matrix = (upper + upper.T) / 2
    eigenvalues = np.linalg.eigvalsh(matrix)
    if np.abs(eigenvalues).min() <= 1e-10 * np.abs(coefficients).max():
        return None
    coded = np.linalg.solve(-2 * matrix, gradient)
    nature: Literal["minimum", "maximum", "saddle"] = (
        "minimum" if eigenvalues[0] > 0 else "maximum" if eigenvalues[-1] < 0 else "saddle"
    )
    return StationaryPoint(
        coded=coded.tolist(),
        actual=to_actual(coded, centre, step).tolist(),
        eigenvalues=eigenvalues.tolist(),
        nature=nature,
    )


def _ratio(a: float, b: float) -> float | None:
    return a / b if b > 0 and math.isfinite(a / b) else None


def _complement(part: float, whole: float) -> float | None:
    ratio = _ratio(part, whole)
    return None if ratio is None else 1.0 - ratio
