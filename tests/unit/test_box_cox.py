"""Power transforms of a response: profile likelihood against published data and oracles, there and back."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from doe.response_surface.least_squares import backward, box_cox, check_positive, forward, slope

# Survival times [10 h] of 48 animals: four treatments (rows of three poisons of four animals each).
# Box and Cox (1964), their first example.
SURVIVAL = [
    [0.31, 0.45, 0.46, 0.43, 0.36, 0.29, 0.40, 0.23, 0.22, 0.21, 0.18, 0.23],
    [0.82, 1.10, 0.88, 0.72, 0.92, 0.61, 0.49, 1.24, 0.30, 0.37, 0.38, 0.29],
    [0.43, 0.45, 0.63, 0.76, 0.44, 0.35, 0.31, 0.40, 0.23, 0.25, 0.24, 0.22],
    [0.45, 0.71, 0.66, 0.62, 0.56, 1.02, 0.71, 0.38, 0.30, 0.36, 0.31, 0.33],
]


def additive_model() -> tuple[np.ndarray, np.ndarray]:
    """Matrix of the additive model of treatments and poisons, and the survival times."""
    treatment, poison = np.repeat(np.arange(4), 12), np.tile(np.repeat(np.arange(3), 4), 4)
    columns = [np.ones(48), *(treatment == t for t in (1, 2, 3)), *(poison == p for p in (1, 2))]
    return np.column_stack(columns).astype(float), np.ravel(SURVIVAL)


def test_literature_survival_times_call_for_the_reciprocal():
    """Literature: Box and Cox (1964): lambda = -0.75, 95 % interval -1.13 to -0.37; they take -1."""
    found = box_cox(*additive_model(), name="survival")
    assert found.exponent == pytest.approx(-0.75, abs=0.005)
    assert found.interval == pytest.approx([-1.13, -0.37], abs=0.02)
    assert found.recommended == -1.0
    assert "1/y" in found.sentence


def test_oracle_scipy_without_factors():
    values = np.random.default_rng(3).lognormal(1.0, 0.4, 40) + 1.0
    exponent, interval = stats.boxcox(values, alpha=0.05)[1:]
    found = box_cox(np.ones((40, 1)), values)
    assert found.exponent == pytest.approx(exponent, abs=1e-5)
    assert found.interval == pytest.approx(interval, abs=1e-5)


def test_scale_of_the_response_does_not_matter():
    matrix, values = additive_model()
    here, there = box_cox(matrix, values), box_cox(matrix, 3600.0 * values)
    assert there.interval == pytest.approx(here.interval, abs=1e-6)


@pytest.mark.parametrize(
    ("power", "recommended", "words"),
    [
        (1.0, 1.0, "no transform is needed"),
        (2.0, 0.5, "fit sqrt(y)"),
        (-1.0, -1.0, "fit 1/y"),
        (-0.25, 1.0, "beyond all usual exponents"),
    ],
)
def test_a_response_made_by_a_power_is_found(power, recommended, words):
    """Closed form: y = z^power with z linear in the factor is linear again under the exponent 1/power."""
    x = np.linspace(-1.0, 1.0, 30)
    z = 3.0 + 2.0 * x + np.random.default_rng(1).normal(0.0, 0.02, x.size)
    found = box_cox(np.column_stack([np.ones(30), x]), z**power)
    assert found.exponent == pytest.approx(1.0 / power, rel=0.01)
    assert found.recommended == recommended
    assert words in found.sentence


def test_an_exact_fit_keeps_the_response():
    x = np.linspace(-1.0, 1.0, 9)
    assert box_cox(np.column_stack([np.ones(9), x]), 5.0 + x).recommended == 1.0


@given(st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=5), st.sampled_from([-2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0]))
def test_there_and_back(values, exponent):
    assert backward(forward(values, exponent), exponent) == pytest.approx(values, rel=1e-6)


@pytest.mark.parametrize("exponent", [-1.0, 0.0, 0.5, 1.0])
def test_slope_is_the_derivative(exponent):
    values, h = np.array([0.3, 1.0, 7.0]), 1e-6
    difference = (forward(values + h, exponent) - forward(values - h, exponent)) / (2 * h)
    assert slope(values, exponent) == pytest.approx(difference, rel=1e-6)


def test_what_no_response_transforms_to_is_at_the_limit():
    assert backward([-3.0, -2.0], 0.5).tolist() == [0.0, 0.0]
    assert backward([1.0, 2.0], -1.0).tolist() == [np.inf, np.inf]


@pytest.mark.parametrize(
    ("matrix", "values", "words"),
    [
        (np.ones((3, 1)), [1.0, 0.0, 2.0], "run 2 is 0, but a power transform needs positive values"),
        (np.ones((3, 1)), [1.0, 2.0, -0.5], "run 3 is -0.5"),
        (np.ones((3, 1)), [2.0, 2.0, 2.0], "all values are equal"),
        (np.eye(3), [1.0, 2.0, 3.0], "no residual for 3 terms"),
    ],
)
def test_data_without_an_answer_are_refused(matrix, values, words):
    with pytest.raises(ValueError, match=words):
        box_cox(matrix, values, name="whirl")


def test_positive_data_pass():
    check_positive([1e-9, 2.0], "whirl")
