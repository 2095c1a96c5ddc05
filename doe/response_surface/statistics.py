"""The statistics of a fitted surface, as its JSON has them, and sentences on these.

Statistics are on the scale of the fit, in coded units. An undefined number, such as the pure error of a design without
replicates, is None and never NaN.

The canonical analysis of a quadratic has its stationary point, the axes of its curvature, and the errors of these.

Sources: Myers, Montgomery and Anderson-Cook, Response Surface Methodology, 4th ed., 6.3-6.4 for nature and ridges; Bisgaard
and Ankenman, Standard errors for the eigenvalues in second-order response surface models (1996).
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from string import ascii_uppercase
from typing import Any, Literal, Self

import numpy as np
from scipy import special

from doe.designs import to_actual
from doe.designs.model import Model, Terms, model_matrix, second_order
from doe.response_surface import adequacy
from doe.response_surface.least_squares import BoxCox, Data
from rbdyn.base.arrays import Array
from rbdyn.base.estimate import LEVEL
from rbdyn.base.records import Record, derived, keyed, outside_json, shown, written
from rbdyn.base.words import value_alone

FLAT = 1e-10  # curvature as a share of the largest coefficient below which it is rounding
Nature = Literal["minimum", "maximum", "saddle"]


class StationaryPoint(Record):
    """Point of zero gradient; ``eigenvalues`` of the matrix of second-order coefficients."""

    coded: list[float]
    actual: list[float]
    eigenvalues: list[float]
    nature: Nature


class Canonical(Record):
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
    values = ", ".join(f"{value:.3g}" for value in analysis.eigenvalues)
    if place is None:
        return f"no single stationary point exists, because one direction has no curvature (eigenvalues {values})."
    where = ", ".join(f"{letter} = {x:.3g}" for letter, x in zip(ascii_uppercase, place.coded, strict=False))
    region = "inside" if analysis.inside else "outside"
    head = f"the stationary point at {where} (coded), {region} the region of the runs, is a {analysis.nature}"
    if "ridge" not in analysis.nature:
        if analysis.inside:
            return f"{head} (eigenvalues {values})."
        return f"{head} (eigenvalues {values}); the best point is on the border of the region."
    axis = int(np.argmin(np.abs(analysis.eigenvalues)))
    lettered = zip(ascii_uppercase, analysis.eigenvectors[axis], strict=False)
    direction = " ".join(f"{x:+.2f} {letter}" for letter, x in lettered)
    return (
        f"{head} (eigenvalues {values}, one within its error of zero): its position along {direction} is undetermined."
    )


def _errors(terms: Terms, vectors: Array, covariance: Array, dof: int) -> Array:
    """Half widths by first order: the eigenvalue v'Bv changes with the coefficient of x_i x_j by v_i v_j."""
    second = np.array([len(term) > 1 for term in terms])
    slopes = model_matrix(vectors.T, terms) * second
    variance = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
    return special.stdtrit(dof, (1 + LEVEL) / 2) * np.sqrt(variance.clip(0.0))


def _inside(place: Array, points: Array) -> bool:
    """Within the box of the runs and no farther from the centre than the farthest of them."""
    in_box = bool(((points.min(axis=0) <= place) & (place <= points.max(axis=0))).all())
    return in_box and bool(np.linalg.norm(place) <= np.linalg.norm(points, axis=1).max())


class LackOfFit(Record):
    """Error of the surface beyond the scatter of replicates."""

    ss: float | None
    df: int | None
    f: float | None
    p: float | None


class PureError(Record):
    """Scatter of the replicates."""

    ss: float | None
    df: int | None
    ms: float | None


class Term(Record):
    """A coefficient with its test, its 95 % interval, its variance inflation, and the same coefficient in actual units."""

    term: str = shown("term")
    coefficient: float = shown(
        "coefficient ± standard error", error="standard_error", unit="of the response", meaning="in coded factors"
    )
    standard_error: float
    t: float | None = written("t value, and its probability by chance")
    p: float | None
    low: float = shown(
        "95 % from",
        value_alone,
        error="standard_error",
        unit="of the response",
        meaning="95 % interval of the coefficient",
    )
    high: float = shown("to", value_alone, error="standard_error")
    vif: float | None = shown("VIF", 5, meaning="by how much other terms inflate its variance")
    actual_units: float = written("the same coefficient for factors in their own units")


class Tested(Record):
    """t value of a coefficient with its probability, and the 95 % interval."""

    t: float | None
    p: float | None
    low: float
    high: float


class Score(Record):
    """Error of a rival at points that it has not seen; ``loo_r2`` is None where all points have one mean."""

    loo_rmse: float
    loo_r2: float | None


class ProcessScore(Score):
    """That of a Gaussian process, with its parameters.

    ``length_scales`` are by letter, in coded units. ``deviation`` is that of the random function, ``noise`` that of a run.
    """

    kernel: str
    length_scales: dict[str, float]
    deviation: float
    noise: float
    log_likelihood: float


class Difference(Record):
    """Mean difference of the squared errors, polynomial less process, with a 95 % interval by Student's t over the points."""

    mean: float
    standard_error: float
    interval: list[float]


class Comparison(Record):
    """A polynomial and a Gaussian process at ``points`` left out in so many ``folds``.

    ``recommended``: "gaussian_process" only where the interval of the difference is above zero, else "polynomial".
    """

    polynomial: Score
    gaussian_process: ProcessScore
    difference: Difference
    points: int
    folds: int
    recommended: str
    sentence: str


class Fit(Record, kw_only=True):
    """The fit of one response.

    - ``by_term``, ``covariance`` (p, p): coefficients by ``terms``, in coded units and units of the response or its transform
    - ``transform``: exponent of Box and Cox, None without one
    - ``residual_mean_square``: scale of the covariance, on ``residual_dof`` degrees of freedom, and the variance of a new run
      about the surface
    - ``r2``, ``adjusted_r2``, ``predicted_r2``: without the differences of blocks
    - ``blocks``: effects by label about the mean over all runs, which the surface predicts
    - ``inflation``: variance inflation factor by term
    - ``actual_coefficients``: of the same terms in actual units
    - ``box_cox``: advice on a power transform of an untransformed fit, None where values or fit allow none
    - ``stationary_point``: None without a single one; ``canonical``: None without curvature
    - ``known_variance``: None without errors of the runs; ``model_error``: None where scatter explains the residual
    - ``rival``: None until `doe.workflow.surfaces.with_rivals` has compared the surface with a Gaussian process
    """

    name: str = outside_json(default="")
    model: Model
    by_term: dict[str, float] = keyed("coefficients")
    anova: list[adequacy.AnovaRow]
    lack_of_fit: LackOfFit = derived(lambda self: self._tested_by("lack_of_fit", LackOfFit))
    pure_error: PureError = derived(lambda self: self._tested_by("pure_error", PureError))
    r2: float | None
    adjusted_r2: float | None
    predicted_r2: float | None
    press: float | None
    cv_percent: float | None
    adequate_precision: float | None
    stationary_point: StationaryPoint | None
    terms: Terms
    standard_errors: dict[str, float] = derived(lambda self: self._named(np.sqrt(np.diag(self.covariance))))
    inflation: dict[str, float | None] = keyed("vif")
    tests: dict[str, Tested] = derived(lambda self: {term: self._test(term) for term in self.terms})
    covariance: Array
    residual_dof: int
    residual_mean_square: float = keyed("observation_variance")
    actual_coefficients: dict[str, float]
    transform: float | None
    box_cox: BoxCox | None
    blocks: dict[str, float]
    elimination: list[adequacy.Removal]
    canonical: Canonical | None
    known_variance: adequacy.KnownVariance | None
    model_error: adequacy.ModelError | None
    diagnostics: adequacy.Diagnostics
    rival: Comparison | None
    sentences: list[str] = derived(lambda self: describe(self))

    @cached_property
    def coefficients(self) -> Array:
        """Coefficients (p,) by ``terms``."""
        return np.array([*self.by_term.values()])

    @property
    def interval_dof(self) -> int:
        """Degrees of freedom of intervals of a mean: of the source of the model error or, without one, of the residual."""
        return self.residual_dof if self.model_error is None else self.model_error.dof

    @property
    def coefficient_table(self) -> list[Term]:
        """A row a term, in coded units."""
        return [
            Term(
                term,
                value,
                self.standard_errors[term],
                **self.tests[term].as_dict(),
                vif=self.inflation.get(term),
                actual_units=self.actual_coefficients[term],
            )
            for term, value in self.by_term.items()
        ]

    def _named(self, values: Array) -> dict[str, float]:
        return dict(zip(self.terms, values.tolist(), strict=True))

    def _tested_by(self, source: str, kind: type[Record]) -> Any:
        row = adequacy.find(self.anova, source).as_dict()
        return kind(**{key: row[key] for key in kind.__annotations__})

    def _test(self, term: str) -> Tested:
        coefficient, error = self.by_term[term], self.standard_errors[term]
        half = float(special.stdtrit(self.residual_dof, 0.975)) * error
        t = coefficient / error if error > 0 else None
        p = None if t is None else 2 * float(special.stdtr(self.residual_dof, -abs(t)))
        return Tested(t, p, coefficient - half, coefficient + half)


class Fits(Record):
    """Fits by response."""

    responses: dict[str, Fit]

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Self:
        """Inverse of ``as_dict``, which has the name of a response as its key."""
        fits = super().from_dict(data).responses
        return cls({name: replace(fit, name=name) for name, fit in fits.items()})


def fits_of(fits: Iterable[Fit]) -> Fits:
    """Fits by response."""
    return Fits({fit.name: fit for fit in fits})


ALPHA = 0.05  # p-value up to which something is significant
FAR_APART = 0.2  # difference of adjusted and predicted R2 above which they disagree
DISCERNIBLE = 4.0  # adequate precision above which the surface can steer a search
INFLATED = 10.0  # variance inflation factor above which runs hardly tell a term from the others


def describe(fit: Fit) -> list[str]:
    """Sentences on significance at `ALPHA`, on the adequacy of the surface, and on what to check."""
    known_variance, canonical = fit.known_variance, fit.canonical
    sentences = [
        *(_terms(fit), _collinearity(fit), _lack_of_fit(fit), _removed(fit), _blocks(fit)),
        *([] if known_variance is None else adequacy.describe_known_variance(known_variance, ALPHA)),
        *(_model_error(fit), _summary(fit)),
        *adequacy.describe_diagnostics(fit.diagnostics, ALPHA),
        _transform(fit),
        "" if canonical is None else describe_canonical(canonical, fit.stationary_point),
        "" if fit.rival is None else fit.rival.sentence,
    ]
    head = f"{fit.name}: "
    # Some sentences already start with the name of the response.
    return [head + sentence.removeprefix(head) for sentence in sentences if sentence]


def _terms(fit: Fit) -> str:
    tested = [row for row in fit.anova if row.source in fit.terms]
    p_values = {row.source: row.p for row in tested if row.p is not None}
    if len(p_values) < len(tested):
        return "the surface has no residual, so its terms cannot be tested."
    strong = sorted((p, source) for source, p in p_values.items() if p <= ALPHA)
    weak = [source for source, p in p_values.items() if p > ALPHA]
    listed = ", ".join(f"{source} ({adequacy.p_text(p)})" for p, source in strong)
    if not strong:
        model = adequacy.find(fit.anova, "model")
        regression = (
            f", but the model as a whole is (F = {model.f:.3g}, {adequacy.p_text(model.p)})"
            if model.p is not None and model.p <= ALPHA
            else ""
        )
        return f"no term alone is significant at {ALPHA:g}{regression}."
    if not weak:
        return f"significant at {ALPHA:g}: {listed}."
    return f"significant at {ALPHA:g}: {listed}; not significant: {', '.join(weak)}."


def _collinearity(fit: Fit) -> str:
    inflated = [term for term, vif in fit.inflation.items() if vif is not None and vif > INFLATED]
    if not inflated:
        return ""
    return (
        f"the runs hardly separate {', '.join(inflated)} from the other terms (variance inflation factor up to "
        f"{max(filter(None, fit.inflation.values())):.2g}), so these coefficients are uncertain: drop one, or add runs that vary them apart."
    )


def lack_of_fit_tests(fit: Fit) -> dict[str, float]:
    """Probability of lack of fit by each test that the runs allow."""
    known = fit.known_variance
    tests = {"pure error": fit.lack_of_fit.p, "the known variance": None if known is None or known.refuted else known.p}
    return {what: p for what, p in tests.items() if p is not None}


def _lack_of_fit(fit: Fit) -> str:
    values = lack_of_fit_tests(fit)
    if not values and fit.pure_error.df == 0:
        return "lack of fit cannot be tested, because no run is replicated; add centre replicates."
    if not values and fit.lack_of_fit.df == 0:
        return "lack of fit cannot be tested, because the model has as many terms as distinct points."
    if fit.pure_error.ms == 0.0:
        verdict = "certain" if fit.lack_of_fit.ss else "none"
        return f"lack of fit is {verdict}, because the replicates agree exactly and the residual is {'not ' if verdict == 'certain' else ''}zero."
    listed = ", ".join(f"{adequacy.p_text(p)} against {what}" for what, p in values.items())
    if min(values.values()) > ALPHA:
        return (
            f"lack of fit is not significant ({listed}): the error of the surface is within the scatter of replicates."
        )
    if max(values.values()) > ALPHA:
        return f"lack of fit is in doubt, because the tests disagree ({listed}): confirm predictions by runs, or add replicates."
    return (
        f"lack of fit is significant ({listed}): the surface error exceeds the scatter of replicates. Enlarge the model, "
        "transform the response or narrow the region, and confirm predictions by runs."
    )


SHOWN_BY: Mapping[adequacy.Source, str] = {
    "repeats": "shown by repeats",
    "known variance": "shown by the known variance",
    "residual": "which is the whole residual, because no scatter of a run is known",
}


def _model_error(fit: Fit) -> str:
    if (error := fit.model_error) is None:
        return ""
    return (
        f"the 95 % intervals of its mean include a model error of standard deviation {error.variance**0.5:.3g}, "
        f"{SHOWN_BY[error.source]} ({error.dof} degrees of freedom)."
    )


def _removed(fit: Fit) -> str:
    if not fit.elimination:
        return ""
    listed = ", ".join(f"{removal.term} ({adequacy.p_text(removal.p)})" for removal in fit.elimination)
    return f"removed in this order: {listed}; p values of the other terms are optimistic, for the same runs selected the terms."


def _blocks(fit: Fit) -> str:
    if not fit.blocks or (p := adequacy.find(fit.anova, "block").p) is None:
        return ""
    verdict = "differ" if p <= ALPHA else "do not differ significantly"
    return f"the blocks {verdict} ({adequacy.p_text(p)}); predictions are for the mean over all runs."


def _summary(fit: Fit) -> str:
    adjusted_r2, predicted_r2 = fit.adjusted_r2, fit.predicted_r2
    if adjusted_r2 is None or predicted_r2 is None:
        return "predicted R2 cannot be computed, for the fit passes through a run whatever its value."
    figures = f"adjusted R2 {adjusted_r2:.3f} and predicted R2 {predicted_r2:.3f}"
    precision = fit.adequate_precision
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


def _transform(fit: Fit) -> str:
    if fit.transform is not None:
        return (
            f"the response is fitted as its Box-Cox transform with exponent {fit.transform:.3g}; the analysis is on that "
            "scale, predictions are medians in the unit of the response."
        )
    return "" if fit.box_cox is None else fit.box_cox.sentence
