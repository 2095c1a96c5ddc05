"""Response surfaces of a study: fits with their rivals, predictions at any point, and random draws within their errors.

Gains are predicted with errors, and a published table of the same design is compared with the runs.
"""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from string import ascii_uppercase
from typing import Any

import numpy as np
from scipy import special, stats
from scipy.stats import spearmanr

from doe.designs.model import second_order
from doe.pareto.front import contrast_error, draw_coefficients
from doe.pareto.manufacture import Quadratic, identity
from doe.pareto.search import columns_of
from doe.response_surface import Surface, cross_validate, fit, model_matrix
from doe.response_surface.adequacy import Diagnostics, correlation, draw_fields
from doe.response_surface.least_squares import backward, forward, slope
from doe.study_file.study import Fitted
from doe.study_file.table import read_sheet
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs, independent_values, read_runs, standard_errors
from rbdyn.base.arrays import Array, Rows, Whole, one_thread
from rbdyn.base.faults import InputError, MethodError, given, refuse
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, outside_json
from rbdyn.base.words import are, improvement, quantity

# Runs with which a Gaussian process takes some 10 s; with 1000 it took 3 s, with 3000 45 s and 0.9 GB.
MOST_RIVALLED = 1500


@one_thread
def fit_surfaces(study: Problem, runs: Runs) -> list[Surface]:
    """A surface for each response, on the runs that have a value of it. Raises InputError if they are too few."""
    surfaces, faults = [], []
    number = independent_values(runs)
    errors = standard_errors(runs.errors, number)
    units: dict[str, Any] = {"centre": study.centre, "step": study.step}
    columns = zip(study.file.response, runs.values.T, errors.T, number.T, strict=True)
    for response, values, error, samples in columns:
        settings = response.model_dump(include={"name", *Fitted.model_fields}) | units
        rows = np.flatnonzero(~np.isnan(values))
        settings["block"] = None if runs.block is None else runs.block[rows]
        try:
            surface = fit(
                runs.coded[rows], values[rows], standard_errors=error[rows], replicates=samples[rows], **settings
            )
            surfaces.append(surface if len(rows) == len(values) else _numbered(surface, rows))
        except MethodError as error_of_fit:
            faults.append(f"{study.path}: {error_of_fit}")
    refuse(faults)
    return surfaces


def _numbered(surface: Surface, rows: Whole) -> Surface:
    """The surface with its runs numbered by their ``rows`` of the table, which has more."""
    old, numbers = surface.diagnostics, dict(enumerate((rows + 1).tolist(), 1))
    outlier = old.outlier.run
    diagnostics = Diagnostics(
        runs=[replace(run, run=numbers[run.run]) for run in old.runs],
        normality=old.normality,
        outlier=replace(old.outlier, run=None if outlier is None else numbers[outlier]),
        high_leverage=[numbers[run] for run in old.high_leverage],
        influential=[numbers[run] for run in old.influential],
    )
    return replace(surface, diagnostics=diagnostics)


def _places(surfaces: Sequence[Surface]) -> list[list[int]]:
    """Places of each surface's runs among all runs, from 0."""
    return [[run.run - 1 for run in surface.diagnostics.runs] for surface in surfaces]


@one_thread
def with_rivals(surfaces: Sequence[Surface]) -> list[Surface]:
    """The surfaces, each compared with a Gaussian process by leaving out each point in turn.

    This takes about a second per response. ``rival`` stays None if too few points can be left out, or if there are too
    many runs (see `unrivalled`).
    """
    results = list(surfaces)
    for place, surface in enumerate(surfaces):
        if len(surface.data.values) > MOST_RIVALLED:
            continue
        data, matrix = surface.data, model_matrix(surface.data.points, surface.terms)
        with suppress(MethodError):
            rival = cross_validate(data.points, data.values, surface.refit, name=surface.name, matrix=matrix)
            results[place] = replace(surface, rival=rival)
    return results


def unrivalled(surfaces: Sequence[Surface]) -> list[Note]:
    """A note on surfaces with too many runs for a comparison with a Gaussian process; else none."""
    runs = max(len(surface.data.values) for surface in surfaces)
    sentence = (
        f"{runs} runs are not compared with an alternative: a Gaussian process of more than {MOST_RIVALLED} is too slow"
    )
    return [Note("remark", sentence)] if runs > MOST_RIVALLED else []


class Effect(Record):
    """Linear effect of a factor per coded unit, ours and theirs."""

    ours: float
    theirs: float
    same_sign: bool = derived(lambda self: self.ours * self.theirs > 0.0)
    theirs_significant: bool = outside_json(default=False)
    """Whether theirs is significant at 5 %."""


class PublishedComparison(Record):
    """A response compared with a published table of the same design.

    Ranges are the least, mean and largest value; effects are by factor. ``rank_correlation`` is Spearman's over the
    runs. ``verdict`` is a sentence on level, signs of the significant published effects, and ranks.
    """

    ours_min_mean_max: tuple[float, ...]
    theirs_min_mean_max: tuple[float, ...]
    linear_effects: dict[str, Effect]
    rank_correlation: float
    verdict: str
    why: str


def _verdict(response: str, level: float, effects: Mapping[str, Effect], rank_correlation: float) -> str:
    significant = {factor: effect for factor, effect in effects.items() if effect.theirs_significant}
    opposite = [factor for factor, effect in significant.items() if not effect.same_sign]
    if opposite:
        signs = f"of their {len(significant)} significant linear effects, sign differs for {', '.join(opposite)}"
    else:
        signs = f"of their {len(significant)} significant linear effects, all with our sign"
    return f"{response}: our mean is {level:.2f} of theirs; {signs}; rank correlation {rank_correlation:+.2f}."


def shared_runs(study: Problem, path: Path, names: Sequence[str], code: str, left: str) -> tuple[Problem, Runs]:
    """The study with those of the responses ``names`` that a table has, and its runs; a note of this ``code`` says that the others are ``left``.

    Raises InputError, also for a table without any of them.
    """
    sheet = read_sheet(path)
    missing = [name for name in names if name not in sheet]
    study = study.with_responses([name for name in names if name in sheet] or names)
    sentence = f"{path} has no column of {', '.join(missing)}, which {are(len(missing))} {left}"
    runs = read_runs(study, path)
    return study, replace(runs, notes=(*runs.notes, *([Note(code, sentence)] if missing else ())))


def reference_runs(study: Problem) -> Runs | None:
    """The published table in the order of our design; responses that it does not have are NaN, and a note names them.

    Raises InputError for a table of another design, or one without any of the responses.
    """
    if study.file.reference is None:
        return None
    path = study.path_of(study.file.reference.file)
    shared, table = shared_runs(study, path, study.figures, "table", "not compared")
    rows = list(range(len(table.coded)))
    order = []
    for point in study.design.coded:
        distance = [float(np.abs(table.coded[row] - point).max()) for row in rows]
        if not distance or min(distance) > 0.02:
            raise InputError(
                f"{path}: no run left for the design point {point.round(3).tolist()} (coded); fix the reference"
            )
        order.append(rows.pop(int(np.argmin(distance))))
    values, errors = np.full((2, len(order), len(study.responses)), np.nan)
    columns = [study.responses.index(name) for name in shared.responses]
    values[:, columns], errors[:, columns] = table.values[order], table.errors[order]
    return Runs(table.coded[order], table.actual[order], values, errors, table.notes)


def compare_with_published(study: Problem, ours: Runs, theirs: Runs) -> dict[str, PublishedComparison]:
    """Each response of both tables by name, with the linear effects on the surfaces through each table.

    A published table has no run added in place of a failed one.
    """
    columns = np.flatnonzero(np.isfinite(theirs.values).any(axis=0))
    study = study.with_responses([study.responses[column] for column in columns])
    ours, theirs = (_of_columns(runs, columns) for runs in (ours.only(list(range(len(theirs.coded)))), theirs))
    surfaces = zip(fit_surfaces(study, ours), fit_surfaces(study, theirs), strict=True)
    lettered = dict(zip(study.factors, ascii_uppercase, strict=False))
    compared = {}
    for index, (name, pair) in enumerate(zip(study.responses, surfaces, strict=True)):
        both = np.isfinite(ours.values[:, index]) & np.isfinite(theirs.values[:, index])
        our_values, their_values = ours.values[both, index], theirs.values[both, index]
        effects = {factor: _effect(*pair, letter) for factor, letter in lettered.items()}
        ranks = float(spearmanr(our_values, their_values).statistic)
        compared[name] = PublishedComparison(
            ours_min_mean_max=(our_values.min(), our_values.mean(), our_values.max()),
            theirs_min_mean_max=(their_values.min(), their_values.mean(), their_values.max()),
            linear_effects=effects,
            rank_correlation=ranks,
            verdict=_verdict(name, our_values.mean() / their_values.mean(), effects, ranks),
            why=given(study.file.reference).why.get(name, ""),
        )
    return compared


def _of_columns(runs: Runs, columns: Rows) -> Runs:
    """Runs with these columns of their responses alone."""
    replicates = (
        runs.replicates if runs.replicates is None or runs.replicates.ndim == 1 else runs.replicates[:, columns]
    )
    return replace(runs, values=runs.values[:, columns], errors=runs.errors[:, columns], replicates=replicates)


def _effect(ours: Surface, theirs: Surface, letter: str) -> Effect:
    values = [surface.by_term.get(letter, 0.0) for surface in (ours, theirs)]
    p_value = {row.source: row.p for row in theirs.anova}.get(letter)
    return Effect(values[0], values[1], p_value is not None and p_value < 0.05)


def predict_all(surfaces: Sequence[Surface], coded: Array) -> Array:
    """Responses (n, m) at coded points (n, k)."""
    return np.column_stack([surface.predict(coded) for surface in surfaces])


def half_widths(surfaces: Sequence[Surface], coded: Array) -> Array:
    """95 % half widths (n, m) of the mean responses at coded points (n, k)."""
    reach = [special.stdtrit(surface.interval_dof, 0.975) for surface in surfaces]
    return np.column_stack([surface.prediction_standard_error(coded) for surface in surfaces]) * reach


def extrapolation_notes(surfaces: Sequence[Surface], coded: Array) -> Notes:
    """A note where surfaces are less sure at a ``coded`` point (k,) than at every run: there they rest on no run nearby.

    By the largest variance of the mean at a run, for hidden extrapolation in several factors (Montgomery, Peck, Vining).
    """
    beyond = [surface.name for surface in surfaces if _variance_ratio(surface, coded) > 1.0 + 1e-9]
    if not beyond:
        return ()
    names = ", ".join(quantity(name)[0] for name in beyond)
    sentence = f"extrapolation: at the selected design the surfaces of {names} are less sure than at any run; simulate it, or add runs there"
    return (Note("extrapolation", sentence),)


def _variance_ratio(surface: Surface, coded: Array) -> float:
    """Variance of the mean at a point over the largest at a run; 0 for a surface without scatter."""
    errors = surface.coefficient_error(np.vstack([coded, surface.data.points]))
    largest = float(errors[1:].max())
    return float(errors[0]) / largest if largest > 0.0 else 0.0


def draw_all(surfaces: Sequence[Surface], draws: int, seed: int) -> list[Array]:
    """Coefficients (draws, p) of each surface, drawn from their multivariate t, independently by response."""
    random = np.random.default_rng(seed)
    posteriors = [(surface.coefficients, surface.covariance, surface.residual_dof) for surface in surfaces]
    return [draw_coefficients(*posterior, draws, random) for posterior in posteriors]


def predict_draws(surfaces: Sequence[Surface], draws_by_surface: Sequence[Array], coded: Array, seed: int = 1) -> Array:
    """Responses (d, n, m) at coded points (n, k) on drawn coefficients, with draws of the model errors."""
    random = np.random.default_rng(seed)
    columns = [
        surface.draws(coded, coefficients, draw_fields(surface.model_error, coded, len(coefficients), random))
        for surface, coefficients in zip(surfaces, draws_by_surface, strict=True)
    ]
    return np.stack(columns, axis=-1)


def jacobian(surface: Surface, coded: Array) -> Array:
    """Derivatives (p,) of the prediction at a coded point (k,) with respect to the coefficients."""
    row = model_matrix(coded, surface.terms)
    if surface.transform is None:
        return row
    return np.asarray(row / slope(surface.predict(coded), surface.transform))


def link_of(surface: Surface) -> Callable[[Array], Array]:
    """Function from the scale of the fit to the units of the response."""
    return identity if surface.transform is None else partial(backward, exponent=surface.transform)


def quadratics(surfaces: Sequence[Surface], factors: int) -> list[Quadratic]:
    """The surfaces as quadratics of the coded factors."""
    forms = [second_order(surface.terms, surface.coefficients, factors) for surface in surfaces]
    return [Quadratic(*form, link_of(surface)) for form, surface in zip(forms, surfaces, strict=True)]


CHUNK = 50  # draws at a time: a few megabytes of 4096 parts
LEFT_OUT = 1e-8  # variance that the root of a field of variance 1 may leave out
MOST_COLUMNS = 300  # of the root of a field


class Simulated(Record, eq=False):
    """Simulated responses (c, m) at coded points (c, k), with their standard errors (c, m)."""

    points: Array
    values: Array
    errors: Array


def drawn_responses(
    surfaces: Sequence[Surface], coded: Array, draws: int, seed: int, simulated: Simulated | None = None
) -> Iterator[Array]:
    """Responses (d, n, m) at coded points (n, k) on drawn surfaces, some draws at a time."""
    random = np.random.default_rng(seed)
    places = coded if simulated is None else np.vstack([coded, simulated.points])
    values_by_surface = [None] * len(surfaces) if simulated is None else _on_scale_of_fit(surfaces, simulated)
    # Surfaces without a model error have no field.
    root = field_root(places) if any(surface.model_error for surface in surfaces) else np.zeros((len(places), 1))
    posteriors = [
        _Posterior.of(surface, places, root, values)
        for surface, values in zip(surfaces, values_by_surface, strict=True)
    ]
    links = [link_of(surface) for surface in surfaces]
    correlation_root = _root(residual_correlation(surfaces))
    places_of_runs = _places(surfaces)
    runs = 1 + max(map(max, places_of_runs))
    most_freedom = max(max(surface.residual_dof, surface.interval_dof) for surface in surfaces)
    for first in range(0, draws, CHUNK):
        count = min(CHUNK, draws - first)
        squares = np.cumsum(
            (random.standard_normal((count, most_freedom, len(surfaces))) @ correlation_root.T) ** 2, axis=1
        )
        errors, fields, noise = (
            random.standard_normal((count, size, len(surfaces))) @ correlation_root.T
            for size in (runs, root.shape[1], max(len(places) - len(coded), 1))
        )
        columns = []
        for j, (posterior, link, rows) in enumerate(zip(posteriors, links, places_of_runs, strict=True)):
            own_errors = errors[..., j] if len(rows) == runs else errors[:, rows, j]
            values = posterior.draws(squares[..., j], own_errors, fields[..., j], noise[..., j])
            columns.append(link(values[:, : len(coded)]))
        yield columns_of(columns)


def residual_correlation(surfaces: Sequence[Surface]) -> Array:
    """Correlation (m, m) of the residuals of all responses over the runs; 0 with residuals that are all 0.

    Runs that one of two responses lacks count as uncorrelated.
    """
    places = _places(surfaces)
    residuals = np.zeros((len(surfaces), 1 + max(map(max, places))))
    for row, surface, columns in zip(residuals, surfaces, places, strict=True):
        row[columns] = [run.residual for run in surface.diagnostics.runs]
    size = np.sqrt((residuals**2).sum(axis=1))
    unit = np.divide(residuals, size[:, None], out=np.zeros_like(residuals), where=size[:, None] > 0.0)
    matrix = unit @ unit.T
    np.fill_diagonal(matrix, 1.0)
    return np.asarray(matrix)


def coefficient_root(surface: Surface) -> Array:
    """Root (p, n) of the covariance of the coefficients: their response to independent errors of variance 1 of the runs."""
    data = surface.data
    matrix = np.hstack([model_matrix(data.points, surface.terms), data.block_columns])
    root = np.linalg.pinv(matrix)[: len(surface.terms)]
    return np.asarray(root * np.sqrt(surface.residual_mean_square))


def field_root(coded: Array) -> Array:
    """Root (n, r) of the correlation of a field at coded points (n, k).

    It is a pivoted Cholesky factor, cut off at `LEFT_OUT` (Harbrecht, Peters and Schneider, Applied Numerical Mathematics
    62, 2012).
    """
    variance, columns = np.ones(len(coded)), np.zeros((len(coded), min(len(coded), MOST_COLUMNS)))
    for place in range(columns.shape[1]):
        pivot = int(variance.argmax())
        if variance[pivot] <= LEFT_OUT:
            return columns[:, :place]
        column = correlation(coded, coded[pivot][None])[:, 0] - columns[:, :place] @ columns[pivot, :place]
        columns[:, place] = column / np.sqrt(variance[pivot])
        variance = (variance - columns[:, place] ** 2).clip(0.0)
    return columns


class _Posterior(Record, eq=False):
    """A response at n points on the scale of its fit: its ``mean`` (n,) and the ``matrix`` (n, p) of the model.

    ``roots`` of the covariances of its coefficients (p, runs) and of its field (n, r), with the degrees of ``freedom`` of
    both. ``simulated``: values and standard errors (c,) at the last c points.
    """

    mean: Array
    matrix: Array
    roots: tuple[Array, Array]
    freedom: tuple[int, int]
    simulated: tuple[Array, Array] | None

    @classmethod
    def of(cls, surface: Surface, places: Array, root: Array, simulated: tuple[Array, Array] | None) -> "_Posterior":
        matrix, error = model_matrix(places, surface.terms), surface.model_error
        roots = coefficient_root(surface), root * (0.0 if error is None else np.sqrt(error.variance))
        freedom = surface.residual_dof, surface.interval_dof
        return cls(matrix @ surface.coefficients, matrix, roots, freedom, simulated)

    def draws(self, squares: Array, errors: Array, fields: Array, noise: Array) -> Array:
        """Draws (d, n) of the values, from standard normal numbers.

        ``squares`` (d, f): cumulative sums of their squares; ``errors`` (d, runs), ``fields`` (d, r) and ``noise`` (d, c):
        numbers for the runs, the field and the simulated values.
        """
        widths = [np.sqrt(dof / squares[:, dof - 1])[:, None] for dof in self.freedom]
        changes = widths[0] * (errors @ self.roots[0].T)
        draws = self.mean + changes @ self.matrix.T + widths[1] * (fields @ self.roots[1].T)
        # A surface without any error, such as that of an operating clearance, has nothing to learn from simulated values.
        if self.simulated is None or not any(root.any() for root in self.roots):
            return np.asarray(draws)
        values, error = self.simulated
        simulated_rows = slice(len(self.mean) - len(values), None)
        across = self.matrix @ self.roots[0]
        links = [across @ across[simulated_rows].T, self.roots[1] @ self.roots[1][simulated_rows].T]
        covariance = sum(
            width[:, :, None] ** 2 * link[simulated_rows] for width, link in zip(widths, links, strict=True)
        )
        # Two exact values at one point would make the covariance singular.
        covariance = covariance + np.diag(error**2 + 1e-12 * sum(np.trace(link[simulated_rows]) for link in links))
        misses = values - draws[:, simulated_rows] - error * noise
        weights = np.linalg.solve(covariance, misses[..., None])[..., 0]
        return np.asarray(draws + sum(width**2 * (weights @ link.T) for width, link in zip(widths, links, strict=True)))


def _on_scale_of_fit(surfaces: Sequence[Surface], simulated: Simulated) -> list[tuple[Array, Array] | None]:
    """Values and standard errors (c,) of each response on the scale of its fit.

    None for a response whose transform needs positive values and which has another one.
    """
    pairs: list[tuple[Array, Array] | None] = []
    for surface, values, errors in zip(surfaces, simulated.values.T, simulated.errors.T, strict=True):
        if surface.transform is None:
            pairs.append((values, errors))
        elif (values > 0.0).all():
            pairs.append((forward(values, surface.transform), errors * slope(values, surface.transform)))
        else:
            pairs.append(None)
    return pairs


def _root(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray(vectors * np.sqrt(values.clip(0.0)))


def gain_verdict(percent: float, error: float) -> str:
    """Whether a gain exceeds its error, in words."""
    if abs(percent) <= error:
        return "within error"
    return "better" if percent > 0.0 else "worse"


class PredictedGain(Record):
    """Improvement [%] of a mean response over the baseline, with its 95 % half width [%].

    ``error_percent`` is that of the difference of the two predictions, in which common errors cancel: the contrast c'Vc and the
    model error at both points, with the degrees of freedom of `Surface.interval_dof`. ``selection_optimism_percent``: by how much
    the choice of the pick exaggerates the gain.
    """

    percent: float
    error_percent: float
    verdict: str = derived(lambda self: gain_verdict(self.percent, self.error_percent))
    goal: str = "min"
    selection_optimism_percent: float | None = None
    response: str = outside_json(default="")
    baseline: float = outside_json(default=math.nan)
    value: float = outside_json(default=math.nan)

    @property
    def sentence(self) -> str:
        """The gain in words."""
        gain = improvement(self.percent, self.error_percent, self.goal)
        change = f"{self.response}: {self.baseline:.5g} to {self.value:.5g}, {gain}"
        verdict = {
            "within error": "which is within its error",
            "better": "which is more than its error",
            "worse": "a loss that is more than its error",
        }[self.verdict]
        return f"{change}, {verdict}."


def predicted_gains(study: Problem, point: Array) -> list[PredictedGain]:
    """Gains at a point (k,) in factor units over the study's baseline, for every response that has a goal."""
    goals = study.goals
    coded = study.coded(np.stack([study.baseline, point]))
    values = predict_all(study.surfaces, coded)
    costs, slopes = goals.costs(values), goals.slopes(values)
    gains = []
    for column, index in enumerate(goals.objectives):
        surface = study.surfaces[index]
        rows = [slopes[end, column] * jacobian(surface, coded[end]) for end in (0, 1)]
        scale = 100.0 / abs(float(values[0, index])) if values[0, index] else math.nan
        shared = contrast_error(rows[0] - rows[1], surface.covariance)
        error = float(stats.t.ppf(0.975, surface.interval_dof)) * math.hypot(
            shared, _model_error_of_difference(surface, coded, rows)
        )
        gains.append(
            PredictedGain(
                response=surface.name,
                baseline=float(values[0, index]),
                value=float(values[1, index]),
                percent=float(scale * (costs[0, column] - costs[1, column])),
                error_percent=error * scale,
                goal=study.file.response[index].goal,
            )
        )
    return gains


def _model_error_of_difference(surface: Surface, coded: Array, rows: Sequence[Array]) -> float:
    """Standard deviation of the difference of the model errors at two coded points (2, k).

    ``rows``: derivatives of each cost with respect to the coefficients; that of the constant holds for the field too.
    """
    if surface.model_error is None:
        return 0.0
    constant = surface.terms.index("1")
    by_field = np.array([float(row[constant]) for row in rows]) * [1.0, -1.0]
    variance = surface.model_error.variance * float(by_field @ correlation(coded, coded) @ by_field)
    return math.sqrt(max(variance, 0.0))


# Words of the verdicts in a statement.
VERDICT_WORDS = {
    "better": "better beyond its error",
    "worse": "worse beyond its error",
    "within error": "not significant",
}


def statement(gains: Sequence[PredictedGain]) -> str:
    """The verdicts on the gains, in a sentence."""
    parts = []
    for verdict, words in VERDICT_WORDS.items():
        names = [gain.response for gain in gains if gain.verdict == verdict]
        parts += [f"{words}: {', '.join(names)}"] if names else []
    return f"On the surfaces, {'; '.join(parts)}."
