"""What a surface says of itself: curvature, known variances, transforms, blocks, diagnostics, in words."""

import json

import numpy as np
import pytest
from scipy import stats
from surface_intervals import new_run_interval

from doe.designs import central_composite
from doe.designs.model import model_terms
from doe.response_surface import describe, fit, model_matrix
from doe.response_surface.least_squares import solve
from doe.response_surface.statistics import fits_of
from doe.workflow.runs import Runs, independent_values, standard_errors
from doe.workflow.surfaces import with_rivals

POINTS = central_composite(3).coded
CENTRE, STEP = np.array([0.02, 0.15, 0.3]), np.array([0.005, 0.05, 0.05])


def noise(seed, size=20, deviation=1.0):
    return deviation * np.random.default_rng(seed).normal(size=size)


def surface_of(values, points=POINTS, **keywords):
    """Surface through values on the three-factor design."""
    return fit(points, values, name="y", centre=CENTRE[: points.shape[1]], step=STEP[: points.shape[1]], **keywords)


def sentence(surface, words):
    """The one sentence with these words."""
    (found,) = [line for line in describe(surface) if words in line]
    return found


@pytest.mark.parametrize("model", ["linear", "interaction", "quadratic", "reduced"])
def test_prediction_is_the_sum_of_its_terms(model):
    surface = surface_of(10 + POINTS @ [1.0, -2.0, 0.5] + POINTS[:, 0] * POINTS[:, 1] + noise(1), model=model)
    new = np.random.default_rng(2).uniform(-2, 2, (7, 4, 3))
    a, b, c = np.moveaxis(new, -1, 0)
    columns = {"1": 1, "A": a, "B": b, "C": c, "AB": a * b, "AC": a * c, "BC": b * c}
    columns |= {"A^2": a**2, "B^2": b**2, "C^2": c**2}
    expected = sum(x * columns[term] for term, x in zip(surface.terms, surface.coefficients, strict=True))
    assert surface.predict(new) == pytest.approx(expected, rel=1e-12)
    assert model_matrix(new, surface.terms) @ surface.coefficients == pytest.approx(expected, rel=1e-12)
    actual = CENTRE + new * STEP
    a, b, c = np.moveaxis(actual, -1, 0)
    columns = {"1": 1, "A": a, "B": b, "C": c, "AB": a * b, "AC": a * c, "BC": b * c}
    columns |= {"A^2": a**2, "B^2": b**2, "C^2": c**2}
    assert sum(x * columns[term] for term, x in surface.actual_coefficients.items()) == pytest.approx(expected)


def test_draws_follow_their_coefficients():
    surface = surface_of(5 + POINTS @ [1.0, 2.0, 3.0] + noise(3), model="linear")
    drawn = surface.draws(POINTS[:4], np.vstack([surface.coefficients, 2 * surface.coefficients]))
    assert drawn[0] == pytest.approx(surface.predict(POINTS[:4]))
    assert drawn[1] == pytest.approx(2 * drawn[0])
    assert surface.draws(np.zeros((2, 5, 3)), [surface.coefficients] * 3).shape == (3, 2, 5)


def test_terms_of_eight_factors_are_all_there_once():
    terms = model_terms(8, "quadratic")
    assert len(terms) == len(set(terms)) == 1 + 8 + 28 + 8
    assert terms[:3] == ("1", "A", "B") and terms[-1] == "H^2"


def test_elimination_is_the_order_of_the_largest_p_each_time():
    values = 5 + 3 * POINTS[:, 0] + 2 * POINTS[:, 1] ** 2 + noise(4)
    surface = surface_of(values, model="reduced")
    terms = model_terms(3, "quadratic")
    for removal in surface.elimination:
        fitted = solve(model_matrix(POINTS, terms), values)
        t = fitted.coefficients / np.sqrt(fitted.mean_square * np.diag(fitted.inverse))
        p = dict(zip(terms, 2 * stats.t.sf(np.abs(t), fitted.dof), strict=True))
        free = [term for term in terms if term != "1" and not any(term in other for other in terms if other != term)]
        assert removal.term == max(free, key=p.get)
        assert removal.p == pytest.approx(p[removal.term]) and removal.p > 0.05
        terms = tuple(term for term in terms if term != removal.term)
    assert terms == surface.terms and "removed in this order" in sentence(surface, "removed")


def test_eigenvalue_errors_are_those_of_a_fit_in_rotated_axes():
    # Along its own axes an eigenvalue is the coefficient of a square, and its error that coefficient's
    # (Bisgaard and Ankenman 1996); the turn is taken as known, so the two agree to first order.
    curved = POINTS[:, 0] ** 2 + 3 * POINTS[:, 1] ** 2 - 2 * POINTS[:, 2] ** 2 + 1.5 * POINTS[:, 0] * POINTS[:, 1]
    surface = surface_of(curved + noise(5, deviation=0.1))
    found = surface.canonical
    turn = np.array(found.eigenvectors).T
    turned = surface_of(surface.data.values, POINTS @ turn)
    squares = dict(zip(turned.terms, turned.coefficients, strict=True))
    assert found.eigenvalues == pytest.approx([squares[f"{letter}^2"] for letter in "ABC"])
    rows = {row.term: row.high - row.coefficient for row in turned.coefficient_table}
    assert found.eigenvalue_errors == pytest.approx([rows[f"{letter}^2"] for letter in "ABC"])
    assert turn.T @ turn == pytest.approx(np.eye(3))
    assert found.nature == "saddle"


@pytest.mark.parametrize(
    ("place", "nature", "words"), [(0.3, "stationary ridge", "inside"), (9.0, "rising ridge", "outside")]
)
def test_a_direction_without_certain_curvature_is_a_ridge(place, nature, words):
    shape = 5 * (POINTS[:, 0] - 0.2) ** 2 + 4 * POINTS[:, 1] ** 2 + 0.06 * (POINTS[:, 2] - place) ** 2
    # Scatter that the terms cannot take up leaves the coefficients as they are.
    surface = surface_of(shape + solve(model_matrix(POINTS, model_terms(3, "quadratic")), noise(6)).residuals)
    assert surface.canonical.nature == nature
    assert surface.stationary_point.nature == "minimum"
    assert surface.stationary_point.coded == pytest.approx([0.2, 0.0, place], abs=1e-9)
    assert words in sentence(surface, "stationary point") and "ridge" in sentence(surface, "stationary point")


def test_minimum_outside_the_runs_is_said_to_be_there():
    surface = surface_of(((POINTS - [4.0, 0.0, 0.0]) ** 2).sum(axis=1) + noise(7, deviation=0.01))
    assert surface.canonical.inside is False
    assert surface.canonical.distance == pytest.approx(4.0, abs=0.1)
    assert "outside the region of the runs, is a minimum" in sentence(surface, "stationary point")


def test_known_variances_that_hold_are_agreed_with():
    # Under its own assumptions the test rejects as often as it says, though the variances come of 8 replicates.
    random, small = np.random.default_rng(8), 0
    for _ in range(120):
        runs = 10 + POINTS @ [1.0, 2.0, -1.0] + random.normal(size=(8, 20))
        error = runs.std(axis=0, ddof=1) / np.sqrt(8)
        fitted = surface_of(runs.mean(axis=0), standard_errors=error, replicates=np.full(20, 8))
        small += fitted.known_variance.p < 0.1
    assert 4 <= small <= 22


def test_a_surface_that_misses_more_than_the_known_variance_says_so():
    bent = 10 + 3 * np.sin(2 * POINTS[:, 0]) + noise(9, deviation=0.05)
    surface = surface_of(bent, standard_errors=np.full(20, 0.05))
    assert surface.known_variance.p < 1e-6
    assert "against pure error, p < 0.0001 against the known variance): the surface error" in sentence(
        surface, "lack of fit"
    )
    assert "agree" in sentence(surface, "repeated runs")


def test_one_sentence_judges_lack_of_fit_where_two_tests_disagree():
    """Pure error that is small by chance shows lack of fit; the known variance of all runs does not."""
    values = 10 + POINTS @ [1.0, 2.0, -1.0] + noise(8)
    values[-6:] = 10 + 0.5 * (values[-6:] - 10)
    surface = surface_of(values, standard_errors=np.full(20, 1.0), model="linear")
    assert surface.lack_of_fit.p < 0.05 < surface.known_variance.p and not surface.known_variance.refuted
    assert "is in doubt, because the tests disagree" in sentence(surface, "lack of fit")
    assert not any("explains the residual" in line for line in describe(surface))


def test_columns_that_repeat_each_other_are_named():
    """The smallest table: two columns equal within 1e-4, and the response follows one of them."""
    random = np.random.default_rng(9)
    points = random.uniform(-1.0, 1.0, (30, 3))
    points[:, 2] = points[:, 0] + 1e-4 * random.normal(size=30)
    surface = surface_of(3.0 * points[:, 0] + 0.5 * random.normal(size=30), points, model="linear")
    assert "but the model as a whole is (F = " in sentence(surface, "no term alone is significant")
    assert "hardly separate A, C from" in sentence(surface, "variance inflation factor")
    apart = surface_of(10 + POINTS @ [1.0, 2.0, -1.0] + noise(3))
    assert not any("variance inflation" in line for line in describe(apart))


@pytest.mark.parametrize(
    ("told", "words"), [(0.01, "more than their replicates show"), (20.0, "too large"), (1.0, "are reliable")]
)
def test_scatter_of_repeated_runs_is_set_beside_their_replicates(told, words):
    surface = surface_of(100 + noise(10), standard_errors=np.full(20, told))
    row = next(row for row in surface.anova if row.source == "replicate_variance")
    assert row.ms == pytest.approx(told**2)
    assert row.f == pytest.approx(surface.pure_error.ms / told**2)
    assert row.p == pytest.approx(2 * min(stats.chi2.cdf(5 * row.f, 5), stats.chi2.sf(5 * row.f, 5)))
    assert words in sentence(surface, "repeated runs")


def test_unknown_errors_leave_no_comparison():
    for errors in (None, np.full(20, np.nan), np.where(np.arange(20) == 3, np.nan, 1.0), np.zeros(20)):
        surface = surface_of(noise(11), standard_errors=errors)
        assert surface.known_variance is None
        assert all(row.source != "replicate_variance" for row in surface.anova)


def test_half_widths_become_standard_errors_by_students_t():
    found = standard_errors(np.ones((2, 2)), np.array([[0, 2], [8, 1]]))
    assert found.ravel() == pytest.approx([1 / 1.959964, 1 / 12.7062, 1 / 2.364624, 1 / 1.959964], rel=1e-6)


@pytest.mark.parametrize(
    ("given", "expected"),
    [(None, [[0, 0], [0, 0]]), (np.array([8, 9]), [[8, 8], [9, 9]]), (np.array([[1, 2], [3, 4]]), [[1, 2], [3, 4]])],
)
def test_independent_values_are_counted_a_run_or_a_response(given, expected):
    none = np.zeros((2, 2))
    assert independent_values(Runs(none, none, none, none, replicates=given)).tolist() == expected


def test_transformed_fit_is_the_fit_of_the_transform():
    values = np.exp(2 + POINTS @ [0.3, 0.2, -0.1] + noise(12, deviation=0.05))
    ours, logarithm = surface_of(values, transform=0.0), surface_of(np.log(values))
    assert ours.coefficients == pytest.approx(logarithm.coefficients)
    assert ours.r2 == pytest.approx(logarithm.r2)
    new = np.random.default_rng(13).uniform(-1, 1, (5, 3))
    assert np.log(ours.predict(new)) == pytest.approx(logarithm.predict(new))
    assert np.log(np.array(new_run_interval(ours, new))) == pytest.approx(np.array(new_run_interval(logarithm, new)))
    error = ours.prediction_standard_error(new)
    assert error == pytest.approx(ours.predict(new) * logarithm.prediction_standard_error(new))
    assert np.log(ours.draws(new, [ours.coefficients])) == pytest.approx(logarithm.predict(new)[None])
    assert ours.as_dict()["transform"] == 0.0 and ours.as_dict()["box_cox"] is None


def test_the_recommended_transform_is_taken_or_advised():
    values = np.exp(2 + POINTS @ [0.9, 0.6, -0.5] + noise(14, deviation=0.1))
    assert surface_of(values, model="linear", transform="box_cox").transform == 0.0
    assert "fit ln y instead" in sentence(surface_of(values, model="linear"), "likelihood")
    straight = 50 + POINTS @ [9.0, 5.0, 3.0] + noise(15)
    assert surface_of(straight, model="linear", transform="box_cox").transform is None


def test_rival_is_compared_and_told():
    values = 5 + POINTS @ [1.0, 2.0, 3.0] + noise(16, deviation=0.1)
    (surface,) = with_rivals([surface_of(values, model="linear")])
    record = fits_of([surface]).as_dict()["responses"][surface.name]
    assert record["rival"]["recommended"] == "polynomial"
    assert record["rival"]["sentence"] in record["sentences"]
    assert json.loads(json.dumps(record, allow_nan=False)) == record


def test_an_outlier_an_influential_run_and_a_bad_forecast_are_named():
    values = 10 + POINTS @ [1.0, 1.0, 1.0] + noise(17, deviation=0.1)
    values[8] += 4.0
    lines = describe(surface_of(values))
    text = "\n".join(lines)
    assert "run 9 (studentized residual +" in text and "is an outlier" in text
    assert "run 9 alone would move the surface" in text
    assert "differ by more than 0.2" in text


def test_a_run_met_exactly_leaves_its_figures_undefined():
    points = np.vstack([central_composite(2, centre_replicates=0).coded, [[0.0, 0.0]], [[0.5, 0.5]]])
    points = np.column_stack([points, np.zeros(len(points))])
    points[-1, 2] = 1.0
    surface = fit(points, noise(18, len(points)), name="y", model="linear", centre=np.zeros(3), step=np.ones(3))
    last = surface.diagnostics.runs[-1]
    assert last.leverage == pytest.approx(1.0)
    assert last.standardized is None and last.cook is None
    assert surface.press is None and "cannot be computed" in sentence(surface, "predicted R2")
    json.dumps(surface.as_dict(), allow_nan=False)


def test_blocks_are_told_and_left_out_of_the_surface():
    block = np.r_[np.zeros(10, int), np.ones(10, int)]
    values = 10 + POINTS @ [1.0, 2.0, 3.0] + 4.0 * block + noise(19, deviation=0.1)
    surface = surface_of(values, model="linear", block=block)
    assert surface.coefficients[0] == pytest.approx(12.0, abs=0.2)
    assert surface.blocks == {"0": pytest.approx(-2.0, abs=0.2), "1": pytest.approx(2.0, abs=0.2)}
    known = surface_of(values, model="linear", block=block, standard_errors=np.full(20, 0.1)).known_variance
    assert known.covariance.shape == surface.covariance.shape == (4, 4)
    assert "the blocks differ" in sentence(surface, "blocks")


@pytest.mark.parametrize(
    ("keywords", "words"),
    [
        ({"transform": 0.5}, 'value of run 3 is -2, but a power transform .* use transform = "none"'),
        ({"transform": "box_cox"}, "run 3 is -2"),
        ({"block": np.arange(20) % 11}, "20 runs are too few .* at least 21, one more than its terms and block"),
        ({"block": (POINTS[:, 0] > 0).astype(int), "model": "linear"}, None),
        ({"block": np.r_[np.zeros(14, int), np.ones(6, int)]}, None),
    ],
)
def test_what_cannot_be_fitted_is_refused_with_the_mend(keywords, words):
    values = np.where(np.arange(20) == 2, -2.0, 10.0 + POINTS[:, 0])
    if words is None:
        assert surface_of(values, **keywords).blocks
        return
    with pytest.raises(ValueError, match=words):
        surface_of(values, **keywords)
