"""A response surface for each response of a study with its rival, surfaces drawn at random within its errors, predictions at any point, and
a published table of the same design.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from string import ascii_uppercase
from typing import Any

import numpy as np
from scipy import special, stats
from scipy.stats import spearmanr

from doe.designs.model import second_order
from doe.pareto.front import contrast_error, draw_coefficients
from doe.pareto.manufacture import Quadratic, identity
from doe.response_surface import Surface, fit, model_matrix
from doe.response_surface.box_cox import backward, forward, slope
from doe.response_surface.model_error import correlation, draw_fields
from doe.study_file import Study
from doe.study_file.study import Fitted
from doe.threads import one_thread
from doe.workflow.goals import goals_of
from doe.workflow.runs import Runs, design_of, read_runs
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, MethodError, refuse
from rbdyn.base.records import Record, derived, keyed, outside_json
from rbdyn.base.words import error_alone, improvement

# Runs of which a Gaussian process takes some 10 s; of 1000 it took 3 s, of 3000 45 s and 0.9 GB.
MOST_RIVALLED = 1500


@one_thread
def fit_surfaces(study: Study, runs: Runs) -> list[Surface]:
    """A surface a response. Raises InputError when the runs do not suffice."""
    surfaces, faults = [], []
    number = independent_values(runs)
    errors = standard_errors(runs.errors, number)
    units: dict[str, Any] = {"centre": study.centre, "step": study.step, "block": runs.block}
    units["without"] = study.inactive
    columns = zip(study.file.response, runs.values.T, errors.T, number.T, strict=True)
    for response, values, error, behind in columns:
        asked = response.model_dump(include={"name", *Fitted.model_fields}) | units
        try:
            surfaces.append(fit(runs.coded, values, standard_errors=error, replicates=behind, **asked))
        except MethodError as error_of_fit:
            faults.append(f"{study.path}: {error_of_fit}")
    refuse(faults)
    return surfaces


@one_thread
def with_rivals(surfaces: Sequence[Surface]) -> list[Surface]:
    """The surfaces, each compared with a Gaussian process by leaving out every point in turn.

    It takes of the order of a second a response. ``rival`` stays None where too few points can be left out, or there are
    too many runs (`unrivalled` says so).
    """
    from doe.response_surface.comparison import compare

    found = list(surfaces)
    for place, surface in enumerate(surfaces):
        if len(surface.data.values) > MOST_RIVALLED:
            continue
        data, matrix = surface.data, model_matrix(surface.data.points, surface.terms)
        errors = data.standard_errors if surface.weighting == "replicates" else None
        with suppress(MethodError):
            runs = data.points, data.values, surface.refit
            rival = compare(*runs, name=surface.name, matrix=matrix, standard_errors=errors)
            found[place] = replace(surface, rival=rival)
    return found


def unrivalled(surfaces: Sequence[Surface]) -> list[str]:
    """A note where surfaces have too many runs to be compared with a Gaussian process; else none."""
    runs = max(len(surface.data.values) for surface in surfaces)
    return (
        [f"{runs} runs are not compared with a rival: a Gaussian process of more than {MOST_RIVALLED} takes too long"]
        if runs > MOST_RIVALLED
        else []
    )


def independent_values(runs: Runs) -> Whole:
    """How many are behind each half width, shape (n, m), from ``runs.replicates``: (n,), (n, m) or None; 0: unknown."""
    given = np.zeros(len(runs.values)) if runs.replicates is None else np.asarray(runs.replicates)
    per_response = given if given.ndim == 2 else given[:, None]
    return np.array(np.broadcast_to(per_response, runs.values.shape), np.int64)


def standard_errors(half_widths: Array, number: Whole) -> Array:
    """Standard errors of means from the half widths (n, m) of their 95 % intervals.

    The quantile is Student's with ``number`` - 1 degrees of freedom, where ``number`` (n, m) counts the independent
    values behind each mean; of unknown numbers (0) it is the normal one.
    """
    student = special.stdtrit(np.maximum(number - 1, 1), 0.975)
    return half_widths / np.where(number > 1, student, special.ndtri(0.975))


class Effect(Record):
    """Linear effect of a factor per coded unit, ours and theirs, and whether either is significant at 5 %."""

    ours: float
    theirs: float
    same_sign: bool = derived(lambda self: self.ours * self.theirs > 0.0)
    ours_significant: bool = outside_json()
    theirs_significant: bool = outside_json()


class Beside(Record):
    """One response next to a published table of the same design.

    Ranges are least, mean, largest value; ``effects`` go by factor. ``rank_correlation`` is Spearman's over the runs,
    ``verdict`` a sentence: level, signs of the effects that the published table shows, ranks.
    """

    response: str = outside_json()
    our_range: tuple[float, float, float] = keyed("ours_min_mean_max")
    their_range: tuple[float, float, float] = keyed("theirs_min_mean_max")
    effects: dict[str, Effect] = keyed("linear_effects")
    rank_correlation: float
    verdict: str = derived(lambda self: self._sentence())
    why: str

    def _sentence(self) -> str:
        shown = {factor: effect for factor, effect in self.effects.items() if effect.theirs_significant}
        opposite = [factor for factor, effect in shown.items() if not effect.same_sign]
        signs = f"sign differs for {', '.join(opposite)}" if opposite else "all with our sign"
        return (
            f"{self.response}: our mean is {self.our_range[1] / self.their_range[1]:.2f} of theirs; of their "
            f"{len(shown)} significant linear effects, {signs}; rank correlation {self.rank_correlation:+.2f}."
        )


def reference_runs(study: Study) -> Runs | None:
    """The published table in the order of our design. Raises InputError when it is of another design."""
    if study.file.reference is None:
        return None
    path = study.beside(study.file.reference.file)
    table = read_runs(study, path)
    left = list(range(len(table.coded)))
    order = []
    for point in design_of(study).coded:
        distance = [float(np.abs(table.coded[row] - point).max()) for row in left]
        if not distance or min(distance) > 0.02:
            raise InputError(
                [f"{path}: no run left for the design point {point.round(3).tolist()} (coded); fix the reference"]
            )
        order.append(left.pop(int(np.argmin(distance))))
    return Runs(table.coded[order], table.actual[order], table.values[order], table.errors[order])


def beside(study: Study, ours: Runs, theirs: Runs) -> list[Beside]:
    """Every response of both, with the linear effects on the surfaces through either."""
    assert study.file.reference is not None
    surfaces = zip(fit_surfaces(study, ours), fit_surfaces(study, theirs), strict=True)
    lettered = dict(zip(study.factors, ascii_uppercase, strict=False))
    rows = []
    for index, (name, pair) in enumerate(zip(study.responses, surfaces, strict=True)):
        our_values, their_values = ours.values[:, index], theirs.values[:, index]
        rows.append(
            Beside(
                response=name,
                our_range=(our_values.min(), our_values.mean(), our_values.max()),
                their_range=(their_values.min(), their_values.mean(), their_values.max()),
                effects={name: _effect(*pair, letter) for name, letter in lettered.items()},
                rank_correlation=float(spearmanr(our_values, their_values).statistic),
                why=study.file.reference.why.get(name, ""),
            )
        )
    return rows


def _effect(ours: Surface, theirs: Surface, letter: str) -> Effect:
    values = [each.by_term.get(letter, 0.0) for each in (ours, theirs)]
    p = [{row["source"]: row["p"] for row in each.anova}.get(letter) for each in (ours, theirs)]
    return Effect(values[0], values[1], *(each is not None and each < 0.05 for each in p))


def predict_all(surfaces: Sequence[Surface], coded: Array) -> Array:
    """Responses (n, m) at coded points (n, k)."""
    return np.column_stack([surface.predict(coded) for surface in surfaces])


def half_widths(surfaces: Sequence[Surface], coded: Array) -> Array:
    """95 % half widths (n, m) of the mean responses at coded points (n, k)."""
    reach = [special.stdtrit(surface.interval_dof, 0.975) for surface in surfaces]
    return np.column_stack([surface.prediction_standard_error(coded) for surface in surfaces]) * reach


def draw_all(surfaces: Sequence[Surface], draws: int, seed: int) -> list[Array]:
    """Coefficients (draws, p) of each surface, drawn from their multivariate t independently by response."""
    random = np.random.default_rng(seed)
    known = [(surface.coefficients, surface.covariance, surface.residual_dof) for surface in surfaces]
    return [draw_coefficients(*each, draws, random) for each in known]


def predict_draws(surfaces: Sequence[Surface], drawn: Sequence[Array], coded: Array, seed: int = 1) -> Array:
    """Responses (d, n, m) on drawn coefficients, and with what the models may miss, at coded points (n, k)."""
    random = np.random.default_rng(seed)
    columns = [
        surface.draws(coded, coefficients, draw_fields(surface.model_error, coded, len(coefficients), random))
        for surface, coefficients in zip(surfaces, drawn, strict=True)
    ]
    return np.stack(columns, axis=-1)


def predict_paired(surfaces: Sequence[Surface], drawn: Sequence[Array], coded: Array) -> Array:
    """Responses (n, m) at coded points (n, k), each on the drawn coefficients (n, p) of its own row."""
    columns = []
    for surface, coefficients in zip(surfaces, drawn, strict=True):
        columns.append(link_of(surface)((model_matrix(coded, surface.terms) * coefficients).sum(axis=-1)))
    return np.column_stack(columns)


def jacobian(surface: Surface, coded: Array) -> Array:
    """Derivatives (p,) of the prediction at a coded point (k,) by the coefficients."""
    row = model_matrix(coded, surface.terms)
    if surface.transform is None:
        return row
    return np.asarray(row / slope(surface.predict(coded), surface.transform))


def link_of(surface: Surface) -> Callable[[Array], Array]:
    """From the scale of the fit to the units of the response."""
    return identity if surface.transform is None else partial(backward, exponent=surface.transform)


def quadratics(surfaces: Sequence[Surface], factors: int) -> list[Quadratic]:
    """The surfaces as quadratics of the coded factors."""
    forms = [second_order(surface.terms, surface.coefficients, factors) for surface in surfaces]
    return [Quadratic(*form, link_of(surface)) for form, surface in zip(forms, surfaces, strict=True)]


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


def gain_verdict(percent: float, error: float) -> str:
    """Whether a gain is more than its error."""
    if abs(percent) <= error:
        return "within error"
    return "better" if percent > 0.0 else "worse"


class PredictedGain(Record):
    """Improvement [%] of a mean response over the baseline, with two 95 % half widths [%].

    ``error`` is that of the difference of the two predictions: the errors that they share cancel (contrast c'Vc, and
    what the model misses at either point, with the degrees of freedom of `Surface.interval_dof`). ``scatter`` is by how much two single runs at one point differ (pure error of
    the replicates), and ``within_scatter`` whether the gain is no more; both None where no run is repeated.
    """

    response: str = outside_json()
    baseline: float = outside_json()
    value: float = outside_json()
    percent: float
    error: float = keyed("error_percent")
    verdict: str = derived(lambda self: gain_verdict(self.percent, self.error))
    scatter: float | None = keyed("single_run_scatter_percent")
    goal: str = "min"
    within_scatter: bool | None = derived(
        lambda self: None if self.scatter is None else abs(self.percent) <= self.scatter, "within_single_run_scatter"
    )

    @property
    def sentence(self) -> str:
        """The gain in words."""
        changed = improvement(self.percent, self.error, self.goal)
        said = f"{self.response}: {self.baseline:.5g} to {self.value:.5g}, {changed}"
        judged = {
            "within error": "which is inside its own noise",
            "better": "which is more than its error",
            "worse": "a loss that is more than its error",
        }[self.verdict]
        if self.scatter is None:
            return f"{said}, {judged}."
        place = "inside" if self.within_scatter else "outside"
        return f"{said}, {judged} and {place} the scatter of single runs ({error_alone(self.scatter)} %)."


def predicted_gains(study: Study, surfaces: Sequence[Surface], point: Array) -> list[PredictedGain]:
    """Gains at a point (k,) in factor units over the study's baseline, for every response that has a goal."""
    goals = goals_of(study)
    coded = study.coded(np.stack([study.baseline, point]))
    values = predict_all(surfaces, coded)
    costs, slopes = goals.costs(values), goals.slopes(values)
    gains = []
    for column, index in enumerate(goals.objectives):
        surface = surfaces[index]
        rows = [slopes[end, column] * jacobian(surface, coded[end]) for end in (0, 1)]
        scale = 100.0 / abs(float(values[0, index])) if values[0, index] else math.nan
        shared = contrast_error(rows[0] - rows[1], surface.covariance)
        error = float(stats.t.ppf(0.975, surface.interval_dof)) * math.hypot(shared, _missed(surface, coded, rows))
        pure, scatter = surface.pure_error, None
        if pure["ms"] is not None and surface.residual_mean_square > 0.0:
            constant = surface.terms.index("1")
            # With weights the mean squares have no unit; the variance of a run has.
            variance = pure["ms"] / surface.residual_mean_square * surface.observation_variance
            single = math.sqrt(variance * sum(float(row[constant]) ** 2 for row in rows))
            scatter = float(stats.t.ppf(0.975, pure["df"])) * single
        gains.append(
            PredictedGain(
                response=surface.name,
                baseline=float(values[0, index]),
                value=float(values[1, index]),
                percent=float(scale * (costs[0, column] - costs[1, column])),
                error=error * scale,
                scatter=None if scatter is None else scatter * scale,
                goal=study.file.response[index].goal,
            )
        )
    return gains


def _missed(surface: Surface, coded: Array, rows: Sequence[Array]) -> float:
    """Standard deviation of the difference of what the model misses at two coded points (2, k).

    ``rows`` are the derivatives of either cost by the coefficients; that by the constant is that by the field.
    """
    if surface.model_error is None:
        return 0.0
    constant = surface.terms.index("1")
    by_field = np.array([float(row[constant]) for row in rows]) * [1.0, -1.0]
    variance = surface.model_error.variance * float(by_field @ correlation(coded, coded) @ by_field)
    return math.sqrt(max(variance, 0.0))


# What a verdict amounts to.
AMOUNT = {"better": "better beyond its error", "worse": "worse beyond its error", "within error": "not significant"}


def statement(gains: Sequence[PredictedGain]) -> str:
    """What the gains amount to, in a sentence."""
    parts = []
    for verdict, words in AMOUNT.items():
        names = [gain.response for gain in gains if gain.verdict == verdict]
        parts += [f"{words}: {', '.join(names)}"] if names else []
    hidden = [gain.response for gain in gains if gain.within_scatter]
    tail = f" One run each would not show: {', '.join(hidden)}." if hidden else ""
    return f"On the surfaces, {'; '.join(parts)}.{tail}"
