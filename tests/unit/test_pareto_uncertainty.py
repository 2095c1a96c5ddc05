"""Errors of fronts and gains: against statsmodels, closed forms and plain simulation; the published table's promise."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
import statsmodels.formula.api as smf
from pareto_cases import TABLE, edited_study, table_surfaces

from doe.designs import to_coded
from doe.pareto import Goals, front, hypervolume, non_dominated
from doe.pareto.front import (
    contrast_error,
    draw_coefficients,
    front_uncertainty,
    non_dominated_share,
    selection_optimism,
)
from doe.workflow.front import find_front
from doe.workflow.surfaces import (
    draw_all,
    half_widths,
    jacobian,
    predict_all,
    predict_draws,
    predicted_gains,
    statement,
)

PAPER_PICK = np.array([0.017, 0.187, 0.285])  # Chen et al. 2022, Table 8


def of_the_textbook(surfaces):
    """The surfaces without what their models miss."""
    return [replace(surface, model_error=None) for surface in surfaces]


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    study = edited_study(tmp_path_factory.mktemp("study"))
    return study, table_surfaces(study)


def test_gain_of_the_published_pick_is_that_of_statsmodels(table):
    study, surfaces = table[0], of_the_textbook(table[1])
    data = pd.read_csv(TABLE)
    for letter, factor in zip("ABC", study.file.factor, strict=True):
        data[letter] = (data[factor.name] - factor.centre) / factor.step
    second = "A + B + C + A:B + A:C + B:C + I(A**2) + I(B**2) + I(C**2)"
    for gain, terms in zip(
        predicted_gains(study.with_surfaces(surfaces), PAPER_PICK), ("A + B + C", second, second), strict=True
    ):
        model = smf.ols(f"{gain.response} ~ {terms}", data).fit()
        a, b, c = -0.6, 0.74, -0.3
        change = [a, b, c] if terms == "A + B + C" else [a, b, c, a * b, a * c, b * c, a * a, b * b, c * c]
        tested = model.t_test(np.array([[0.0, *change]]))
        low, high = (-100.0 * end / model.params["Intercept"] for end in tested.conf_int()[0])
        assert gain.percent == pytest.approx((low + high) / 2.0, rel=1e-6)
        assert gain.error_percent == pytest.approx((low - high) / 2.0, rel=1e-6)


def test_promise_of_the_published_pick_is_less_than_claimed(table):
    study, surfaces = table[0], of_the_textbook(table[1])
    impact, whirl, power = predicted_gains(study.with_surfaces(surfaces), PAPER_PICK)
    # Table 8 claims 9.26, 2.87 and 1.45 %, of one run at the centre and a value that eq 22 does not give (193.2).
    assert impact.percent == pytest.approx(5.27, abs=0.01) and impact.error_percent == pytest.approx(4.17, abs=0.01)
    assert whirl.percent == pytest.approx(2.54, abs=0.01) and power.percent == pytest.approx(0.75, abs=0.01)
    assert [gain.verdict for gain in (impact, whirl, power)] == ["better", "better", "within error"]
    assert statement([impact, whirl, power]).count("impact_force_N") == 1


def test_gain_of_the_baseline_over_itself_is_nothing_without_error(table):
    study, surfaces = table
    for gain in predicted_gains(study.with_surfaces(surfaces), study.baseline):
        assert gain.percent == 0.0 and gain.error_percent == pytest.approx(0.0, abs=1e-9)


def test_shared_error_cancels_in_a_difference():
    # Two points that differ in one term share the error of all others.
    covariance = np.array([[4.0, 1.0], [1.0, 2.0]])
    assert contrast_error(np.array([0.0, 3.0]), covariance) == pytest.approx(3.0 * np.sqrt(2.0))
    assert contrast_error(np.array([0.0, 0.0]), covariance) == 0.0


@pytest.mark.parametrize("transform", ["none", 0.0, -1.0])
def test_gain_of_a_transformed_response_is_judged_in_its_own_units(tmp_path, transform):
    word = f'"{transform}"' if transform == "none" else str(transform)
    study = edited_study(
        tmp_path, ('model = "linear"\ngoal = "min"', f'model = "linear"\ntransform = {word}\ngoal = "min"')
    )
    surfaces = table_surfaces(study)
    gain = predicted_gains(study.with_surfaces(surfaces), PAPER_PICK)[0]
    points = to_coded(np.stack([study.baseline, PAPER_PICK]), study.centre, study.step)
    # To first order, the quantiles of the drawn difference.
    drawn = predict_draws(surfaces, draw_all(surfaces, 20000, 1), points)[:, :, 0]
    low, high = np.quantile(drawn[:, 0] - drawn[:, 1], [0.025, 0.975]) / gain.baseline * 100.0
    assert gain.error_percent == pytest.approx((high - low) / 2.0, rel=0.05)
    shifts = 1e-6 * np.eye(4)
    up, down = (surfaces[0].draws(points[1], surfaces[0].coefficients + s * shifts) for s in (1, -1))
    assert jacobian(surfaces[0], points[1]) == pytest.approx((up - down) / 2e-6, rel=1e-5)


def test_drawn_coefficients_have_the_quantiles_of_t():
    drawn = draw_coefficients(
        np.array([5.0, -1.0]), np.array([[4.0, 1.9], [1.9, 1.0]]), 6, 40000, np.random.default_rng(1)
    )
    # 97.5 % quantile of t with 6 degrees of freedom: 2.447.
    assert np.quantile(drawn[:, 0], [0.025, 0.5, 0.975]) == pytest.approx([5 - 4.894, 5.0, 5 + 4.894], abs=0.15)
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(0.95, abs=0.01)


def test_share_of_non_dominated_is_a_plain_count():
    costs = np.array([[[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]], [[0.0, 0.0], [1.0, 0.0], [0.0, 0.0]]])
    assert non_dominated_share(costs).tolist() == [1.0, 0.5, 0.5]


def test_probability_of_dominance_of_two_independent_gains():
    # Gains of one standard error in two independent responses: Phi(1)^2.
    drawn = np.random.default_rng(1).standard_normal((20000, 1, 2))
    sure = front_uncertainty(
        *(drawn, Goals.of(["min", "min"]), np.zeros((1, 2)), 0, "knee"),
        baseline=np.ones((20000, 2)),
        original=np.ones(2),
    )
    assert sure.pick_dominates.probability == pytest.approx(0.8413**2, abs=4 * sure.pick_dominates.standard_error)
    assert sure.non_dominated.tolist() == [1.0]


def dense_front(responses, reach, rounds):
    """Costs of an exact front: a grid of 41 levels a factor, then random steps from its non-dominated points."""
    random, spacing = np.random.default_rng(1), reach / 20
    grid = np.linspace(-reach, reach, 41)
    points = np.stack(np.meshgrid(grid, grid, grid), -1).reshape(-1, 3)
    parts = np.array_split(points, 8)
    points = np.vstack([part[non_dominated(responses(part))] for part in parts])
    for each in range(rounds):
        step = 0.7**each * spacing * random.uniform(-1, 1, points.shape)
        points = np.vstack([points, (points + step).clip(-reach, reach)])
        points = points[non_dominated(responses(points))]
    return responses(points)


def test_luck_of_a_rule_is_the_expected_largest_of_equal_points():
    # Three equal points with independent errors of one: the best of three promises 0.8463 too much, on the other
    # cost nothing is chosen.
    drawn = np.random.default_rng(2).standard_normal((4000, 3, 1)) * [1.0, 0.0] + [0.0, 1.0]
    goals = Goals.of(["min", "min"], weight=[1.0, 1e-9])
    luck = selection_optimism(drawn, np.full((4000, 2), 5.0), np.tile([5.0, 4.0], (3, 1)), goals, "weights")
    assert luck == pytest.approx([0.8463, 0.0], abs=0.05)


def test_front_of_the_published_table_has_the_hypervolume_of_a_dense_one(table):
    surfaces, reach = table[1], 2**0.75

    def responses(points):
        return predict_all(surfaces, points)

    dense = dense_front(responses, reach, 3)
    ideal, nadir = dense.min(axis=0), dense.max(axis=0)
    # The settings of the example, with all of the archive.
    found = front(responses, [-reach] * 3, [reach] * 3, population=100, generations=200, seed=1, keep=100000)
    assert hypervolume(found.values, ideal, nadir) > 0.995 * hypervolume(dense, ideal, nadir)


def test_front_of_the_published_table_knows_its_errors(table):
    study, surfaces = table
    found, again = find_front(study.with_surfaces(surfaces)), find_front(study.with_surfaces(surfaces))
    assert np.array_equal(found.points, again.points)
    sure = found.uncertainty
    assert np.array_equal(sure.non_dominated, again.uncertainty.non_dominated)
    # Student's t of the lack of fit, 11 degrees of freedom for the linear surface and 5 for the others.
    coded = study.coded(found.points)
    errors = np.column_stack([surface.prediction_standard_error(coded) for surface in surfaces])
    assert half_widths(surfaces, coded) == pytest.approx(errors * [2.2010, 2.5706, 2.5706], rel=1e-4)
    assert 0.3 < sure.pick_dominates.probability < 0.95
    assert 0.0 < sure.non_dominated.min() < sure.non_dominated.max() <= 1.0
