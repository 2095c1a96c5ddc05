"""The least-squares core on the reference datasets of NIST, and what must hold of any fit."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from strd import REFERENCES, filip

from doe.response_surface.least_squares import dependent_columns, solve

# Digits that a fit reaches, in coefficients, their standard errors and the deviation. Filip loses nine to its condition number of 5e9,
# because its powers are rounded before the fit.
DIGITS = {
    **{"Longley": (14, 12.5, 13), "Wampler 1": (14, 15, 13), "Wampler 2": (13, 15, 13)},
    **{"Wampler 3": (14, 13.5, 13), "Wampler 4": (14, 13.5, 13), "Wampler 5": (14, 13.5, 13), "Filip": (7, 7, 7)},
}


def as_certified(texts, digits):
    return pytest.approx([float(text) for text in texts], rel=10.0**-digits, abs=0)


@pytest.mark.parametrize("name", REFERENCES)
def test_meets_the_certified_values(name):
    reference, (digits, error_digits, rest_digits) = REFERENCES[name], DIGITS[name]
    response = np.array(reference.response, float)
    fit = solve(reference.matrix, response)
    assert fit.coefficients.tolist() == as_certified(reference.coefficients, digits)
    errors = np.sqrt(fit.mean_square * np.diag(fit.inverse))
    assert errors.tolist() == as_certified(reference.standard_errors, error_digits)
    assert fit.mean_square**0.5 == pytest.approx(float(reference.deviation), rel=10.0**-rest_digits, abs=0)
    total = float(((response - response.mean()) ** 2).sum())
    assert 1 - fit.residual_sum / total == pytest.approx(float(reference.r2), rel=10.0**-rest_digits)
    if reference.f is None:
        assert fit.mean_square == 0
    else:
        f = (total - fit.residual_sum) / (len(fit.coefficients) - 1) / fit.mean_square
        assert f == pytest.approx(float(reference.f), rel=10.0**-rest_digits)


def test_certified_values_follow_from_the_printed_data():
    # The normal equations in exact fractions: neither data nor certified values were mistyped.
    reference = filip()
    rows, size = reference.regressors, len(reference.coefficients)
    columns = list(zip(*rows, strict=True))
    table = [
        [sum(a * b for a, b in zip(left, right, strict=True)) for right in (*columns, reference.response)]
        for left in columns
    ]
    for pivot in range(size):
        table[pivot] = [entry / table[pivot][pivot] for entry in table[pivot]]
        for row in set(range(size)) - {pivot}:
            factor = table[row][pivot]
            table[row] = [a - factor * b for a, b in zip(table[row], table[pivot], strict=True)]
    exact = [row[-1] for row in table]
    for value, text in zip(exact, reference.coefficients, strict=True):
        assert abs(value / Fraction(text) - 1) < Fraction(6, 10**15)


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), size=st.integers(1, 6), extra=st.integers(1, 12))
def test_residuals_are_orthogonal_and_leverages_sum_to_the_columns(seed, size, extra):
    random = np.random.default_rng(seed)
    matrix = random.normal(size=(size + extra, size)) * 10.0 ** random.uniform(-6, 6, size)
    values = random.normal(size=size + extra)
    fit = solve(matrix, values)
    gradient = matrix.T @ fit.residuals / np.linalg.norm(matrix, axis=0)
    assert gradient == pytest.approx(np.zeros(size), abs=1e-12)
    assert fit.leverage.sum() == pytest.approx(size)
    assert (fit.leverage > -1e-12).all() and (fit.leverage < 1 + 1e-12).all()


def test_units_of_the_columns_do_not_matter():
    random = np.random.default_rng(7)
    matrix, values = random.normal(size=(12, 4)), random.normal(size=12)
    scale = np.array([1e-12, 1.0, 1e9, 3.0])
    one, other = solve(matrix, values), solve(matrix * scale, values)
    assert other.coefficients * scale == pytest.approx(one.coefficients, rel=1e-13)
    assert other.mean_square == pytest.approx(one.mean_square, rel=1e-13)
    assert other.inflation == pytest.approx(one.inflation, rel=1e-12)


def test_partial_sum_is_what_the_residual_sum_grows_by():
    random = np.random.default_rng(6)
    matrix, values = random.normal(size=(12, 5)), random.normal(size=12)
    whole, less = solve(matrix, values), solve(matrix[:, [0, 2, 3]], values)
    assert whole.partial_sum([1, 4]) == pytest.approx(less.residual_sum - whole.residual_sum, rel=1e-12)


def test_what_only_rounding_leaves_is_zero():
    x = np.linspace(-1, 1, 9)
    fit = solve(np.column_stack([np.ones(9), x, x**2]), 0.1 + 0.3 * x)
    assert fit.mean_square == 0 and not fit.residuals.any()
    assert fit.coefficients.tolist() == [pytest.approx(0.1), pytest.approx(0.3), 0.0]


def test_dependent_columns_are_named():
    x = np.random.default_rng(9).normal(size=(8, 3))
    assert dependent_columns(x) == []
    dependent = dependent_columns(np.column_stack([x, x[:, 0] - 2 * x[:, 1]]))
    assert len(dependent) == 1 and dependent[0] in (0, 1, 3)
