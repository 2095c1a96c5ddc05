"""What a design can tell, against closed forms, published figures and statsmodels; designs that fill a box."""

import json

import numpy as np
import pytest
from scipy import stats
from scipy.stats import qmc
from statsmodels.stats.outliers_influence import variance_inflation_factor

from doe.designs import box_behnken, central_composite, full_factorial, latin_hypercube, sobol
from doe.designs.model import evaluate, lost_terms, model_matrix, model_terms, moment_matrix, sample
from doe.response_surface import fit

QUADRATIC = model_terms(3, "quadratic")


def test_closed_form_two_level_factorial_is_fully_efficient():
    """Closed form: for the linear model SPV = 1 + r^2, so d = a = 100 %, and g = 100 % in the box."""
    found = evaluate(full_factorial(3, levels=2).coded, model_terms(3, "linear"))
    assert (found.region.shape, found.region.reach) == ("box", 1.0)
    assert [found.efficiency_percent[key] for key in "dag"] == pytest.approx([100.0] * 3)
    assert found.scaled_prediction_variance.mean == pytest.approx(2.0)
    shells = found.by_radius
    assert [shell.max for shell in shells] == pytest.approx([1 + shell.radius**2 for shell in shells])


def test_closed_form_three_level_factorial():
    """Closed form: |X'X| = 5184, so d = 5184^(1/6)/9; the corners have the largest variance, 7.25."""
    found = evaluate(full_factorial(2).coded, model_terms(2, "quadratic"))
    assert found.efficiency_percent["d"] == pytest.approx(100 * 5184 ** (1 / 6) / 9)
    assert found.scaled_prediction_variance.max == pytest.approx(7.25)
    assert found.efficiency_percent["g"] == pytest.approx(100 * 6 / 7.25)
    assert found.scaled_prediction_variance.centre == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("design", "centres"),
    [(central_composite(2, centre_replicates=5).coded, 5), (box_behnken(3, centre_replicates=3).coded, 3)],
)
def test_closed_form_centre_of_a_spherical_design(design, centres):
    """Closed form: with all other points on one sphere only the centre runs tell of the centre: N/n0."""
    found = evaluate(design, model_terms(design.shape[1], "quadratic"))
    assert found.region.shape == "ball"
    assert found.scaled_prediction_variance.centre == pytest.approx(len(design) / centres)


def test_rotatable_means_one_variance_by_radius():
    shells = evaluate(central_composite(3).coded, QUADRATIC).by_radius
    assert all(shell.max == pytest.approx(shell.min) for shell in shells)
    other = evaluate(central_composite(3, alpha="face_centred").coded, QUADRATIC).by_radius
    assert other[-1].max > 1.2 * other[-1].min


@pytest.mark.parametrize(("region", "reach"), [("ball", 1.7), ("box", 1.2)])
def test_moments_agree_with_a_sample_of_the_region(region, reach):
    columns = model_matrix(sample(3, region, reach), QUADRATIC)
    expected = columns.T @ columns / len(columns)
    assert moment_matrix(QUADRATIC, 3, region, reach) == pytest.approx(expected, abs=0.02)


def test_oracle_variance_inflation_leverage_and_errors():
    """Oracle: statsmodels for the inflation; our own least squares for the errors of predictions."""
    points = np.random.default_rng(4).uniform(-1, 1, (24, 3))
    found = evaluate(points, QUADRATIC, region="ball", reach=0.5)
    matrix = model_matrix(points, QUADRATIC)
    expected = [variance_inflation_factor(matrix, column) for column in range(1, 10)]
    assert list(found.vif.values()) == pytest.approx(expected)
    hat = matrix @ np.linalg.pinv(matrix)
    assert found.leverage == pytest.approx(np.diag(hat).tolist())
    values = np.random.default_rng(5).normal(size=24)
    surface = fit(points, values, name="y", centre=[0] * 3, step=[1] * 3)
    # The error of a mean holds that of the model too, here the whole residual, which is no matter of the design.
    scatter = surface.prediction_standard_error([0, 0, 0]) ** 2 - surface.model_error.variance
    spv = 24 * scatter / surface.residual_mean_square
    assert found.scaled_prediction_variance.centre == pytest.approx(spv)


def test_oracle_power_by_the_noncentral_t_distribution():
    matrix = model_matrix(central_composite(3).coded, QUADRATIC)
    found = evaluate(central_composite(3).coded, QUADRATIC)
    covariance = np.linalg.inv(matrix.T @ matrix)
    limit = stats.t.isf(0.025, 10)
    for term, change, key in (("A", 0.5, "one_sigma"), ("BC", 1.0, "two_sigma"), ("B^2", 1.0, "one_sigma")):
        place = QUADRATIC.index(term)
        shift = change / np.sqrt(covariance[place, place])
        power = stats.nct.sf(limit, 10, shift) + stats.nct.cdf(-limit, 10, shift)
        assert getattr(found.power_percent[term], key) == pytest.approx(100 * power, abs=1e-6)


def test_blocks_take_degrees_of_freedom_but_no_precision_when_orthogonal():
    design = central_composite(3, alpha="orthogonal_blocks", blocks=True)
    blocked = evaluate(design.coded, QUADRATIC, design.block)
    plain = evaluate(design.coded, QUADRATIC)
    assert blocked.degrees_of_freedom == {
        "model": 9, "blocks": 1, "residual": 9, "lack_of_fit": 5, "pure_error": 4,
    }  # fmt: skip
    assert plain.degrees_of_freedom["pure_error"] == 5
    assert blocked.vif == pytest.approx(plain.vif)
    assert blocked.blocks.orthogonal and plain.blocks is None
    skewed = evaluate(design.coded, QUADRATIC, np.arange(20) % 3)
    assert not skewed.blocks.orthogonal
    assert skewed.vif["A"] > blocked.vif["A"] + 1e-3


def test_record_is_plain_json_without_residual_degrees_of_freedom_too():
    record = evaluate(central_composite(2).coded, model_terms(2, "interaction")).as_dict()
    assert json.loads(json.dumps(record, allow_nan=False)) == record
    saturated = evaluate(full_factorial(2, levels=2).coded, model_terms(2, "interaction"))
    assert vars(saturated.power_percent["AB"]) == {"one_sigma": None, "two_sigma": None}
    quantiles = [row["variance"] for row in record["fraction_of_design_space"]]
    assert quantiles == sorted(quantiles)


def test_terms_that_cannot_be_told_are_named():
    two_levels = full_factorial(3, levels=2, centre_replicates=2).coded
    assert lost_terms(two_levels, QUADRATIC) == ["B^2", "C^2"]
    with pytest.raises(ValueError, match=r"cannot separate B\^2, C\^2 from"):
        evaluate(two_levels, QUADRATIC)


def test_full_factorial_has_every_combination_once():
    design = full_factorial(3, levels=4)
    assert design.coded[:2, 0] == pytest.approx([-1.0, -1.0 / 3.0])
    assert len(np.unique(design.coded, axis=0)) == 64
    with pytest.raises(ValueError, match="more than 10000"):
        full_factorial(8, levels=4)


def test_latin_hypercube_has_one_run_in_every_interval_and_is_even():
    design = latin_hypercube(3, runs=30, seed=2, centre_replicates=2)
    intervals = np.floor((design.coded[:30] + 1.0) * 15.0)
    assert all(sorted(column) == list(range(30)) for column in intervals.T)
    assert design.kind[-2:] == ("centre", "centre")
    plain = qmc.LatinHypercube(3, seed=2).random(30)
    assert qmc.discrepancy((design.coded[:30] + 1) / 2) < 0.6 * qmc.discrepancy(plain)
    assert np.array_equal(design.coded, latin_hypercube(3, runs=30, seed=2, centre_replicates=2).coded)


def test_longer_sobol_sequence_keeps_the_runs_of_the_shorter():
    assert np.array_equal(sobol(4, runs=50).coded[:20], sobol(4, runs=20).coded)
    assert not np.array_equal(sobol(4, runs=20, seed=2).coded, sobol(4, runs=20).coded)
    assert np.abs(sobol(2, runs=64).coded).max() <= 1.0
