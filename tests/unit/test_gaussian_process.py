"""The Gaussian process beside the polynomial: closed form, determinism, and a fair comparison."""

import warnings

import numpy as np
import pytest
from scipy.spatial.distance import cdist

from doe.designs import central_composite
from doe.designs.design import replicate_groups
from doe.emulator import fit_emulator
from doe.response_surface import cross_validate, fit
from doe.response_surface.surface import model_matrix

POINTS = central_composite(2, centre_replicates=4).coded


def bent(points: np.ndarray, scatter: float = 0.05) -> np.ndarray:
    """A response that no quadratic follows, with seeded scatter."""
    noise = np.random.default_rng(5).normal(0.0, scatter, len(points))
    return 10.0 + np.sin(2.0 * points[:, 0]) + 0.4 * points[:, 1] + noise


def refit_of(points: np.ndarray, values: np.ndarray, model: str = "quadratic"):
    """The polynomial refitted to some rows."""
    zero, one = np.zeros(points.shape[1]), np.ones(points.shape[1])
    return lambda rows: fit(points[rows], values[rows], name="y", model=model, centre=zero, step=one)


def test_oracle_prediction_by_the_equations_of_the_book():
    """Closed form: Rasmussen and Williams eqs 2.41 and 2.42, a constant of a flat prior, with the hyperparameters found."""
    values = bent(POINTS)
    surface = fit_emulator(POINTS, values, np.full(len(POINTS), 0.05**2), trend="constant")
    new, given, ones = np.array([[0.3, -0.2], [1.0, 1.0]]), surface.hyperparameters, np.ones(len(POINTS))

    def covariance(a, b):
        r = np.sqrt(5.0) * cdist(a / given.lengths, b / given.lengths)
        return given.variance * (1.0 + r + r**2 / 3.0) * np.exp(-r)

    runs = np.linalg.inv(covariance(POINTS, POINTS) + (0.05**2 + given.nugget) * np.eye(len(POINTS)))
    across = covariance(new, POINTS)
    level = ones @ runs @ values / (ones @ runs @ ones)
    left = 1.0 - across @ runs @ ones
    variance = given.variance - np.einsum("ij,jk,ik->i", across, runs, across) + left**2 / (ones @ runs @ ones)
    mean, error = surface.predict(new)
    assert mean == pytest.approx(level + across @ runs @ (values - level), rel=1e-6)
    assert error == pytest.approx(np.sqrt(variance), rel=1e-4)


def test_it_finds_the_scatter_and_leaves_it_out_of_the_mean():
    rng = np.random.default_rng(2)
    points = np.repeat(np.linspace(-1.0, 1.0, 12)[:, None], 8, axis=0)
    values = 3.0 + 2.0 * points[:, 0] + rng.normal(0.0, 0.2, len(points))
    surface = fit_emulator(points, values, 0.0, trend="constant")
    assert surface.hyperparameters.nugget**0.5 == pytest.approx(0.2, rel=0.15)
    errors = surface.predict([[0.0], [5.0]])[1]
    assert errors[0] < 0.07 < errors[1]


def test_equal_values_and_exact_runs_are_followed_without_a_warning():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        level = fit_emulator(POINTS, np.full(len(POINTS), 7.0), 0.0, trend="constant")
        exact = fit_emulator(POINTS[:9], bent(POINTS[:9], 0.0), 0.0, trend="constant")
        mean, errors = exact.predict(POINTS[:9])
    assert level.mean([[0.2, 0.4]]) == pytest.approx([7.0])
    assert (np.abs(mean - bent(POINTS[:9], 0.0)) < 2.0 * errors).all()
    assert (errors < 0.01 * np.ptp(bent(POINTS, 0.0))).all(), "nine runs do not show that they have no scatter"


def test_same_seed_same_bits():
    one, two = (cross_validate(POINTS, bent(POINTS), refit_of(POINTS, bent(POINTS)), name="y") for _ in range(2))
    assert one == two


def test_left_out_polynomial_misses_agree_with_press():
    """Closed form: without replicates the squared misses of the polynomial are the PRESS of the surface."""
    points = central_composite(2, alpha=1.0, centre_replicates=1).coded
    values = bent(points)
    found = cross_validate(points, values, refit_of(points, values), name="y")
    surface = refit_of(points, values)(np.arange(len(points)))
    assert found.points == len(points)
    assert found.polynomial.loo_rmse**2 * len(points) == pytest.approx(surface.press, rel=1e-9)
    assert found.polynomial.loo_r2 == pytest.approx(surface.predicted_r2, rel=1e-9)


def test_points_that_the_polynomial_cannot_do_without_are_not_compared():
    """Without its centre a spherical design tells no square from the constant."""
    values = bent(POINTS)
    matrix = model_matrix(POINTS, ("1", "A", "B", "AB", "A^2", "B^2"))
    found = cross_validate(POINTS, values, refit_of(POINTS, values), name="y", matrix=matrix)
    assert found.points == 8
    assert "8 of 9 points" in found.sentence


def test_replicates_leave_together():
    seen = []
    values = bent(POINTS)

    def watched(rows):
        seen.append(replicate_groups(POINTS)[rows])
        return refit_of(POINTS, values, "linear")(rows)

    cross_validate(POINTS, values, watched, name="y")
    assert [len(np.unique(groups)) for groups in seen] == [8] * 9
    assert min(len(groups) for groups in seen) == len(POINTS) - 4


def test_the_process_is_preferred_only_where_it_is_clearly_better():
    grid = np.array([[a, b] for a in np.linspace(-2, 2, 6) for b in np.linspace(-2, 2, 3)])
    curved = np.sin(2.5 * grid[:, 0]) + 0.3 * grid[:, 1]
    clear = cross_validate(grid, curved, refit_of(grid, curved), name="y")
    assert clear.recommended == "gaussian_process"
    assert clear.difference.interval[0] > 0.0
    straight = grid @ [1.0, -2.0] + np.random.default_rng(1).normal(0.0, 0.3, len(grid))
    level = cross_validate(grid, straight, refit_of(grid, straight, "linear"), name="y")
    assert level.recommended == "polynomial"
    assert "keep" in level.sentence


@pytest.mark.parametrize(
    ("values", "fault"), [(np.zeros(3), r"numbers of samples: \[12, 3\]"), (np.full(12, np.nan), "not a finite number")]
)
def test_bad_runs_are_refused(values, fault):
    with pytest.raises(ValueError, match=fault):
        cross_validate(POINTS, values, refit_of(POINTS, values), name="y")


def test_a_design_without_a_point_to_spare_is_refused():
    points = POINTS[:7]
    values = bent(points)
    with pytest.raises(ValueError, match="only 0 points can be left out"):
        cross_validate(points, values, refit_of(points, values), name="y")


def test_many_points_are_left_out_in_groups():
    points = np.random.default_rng(2).uniform(-1.5, 1.5, (160, 2))
    values = bent(points)
    groups = cross_validate(points, values, refit_of(points, values), name="y")
    assert (groups.points, groups.folds) == (160, 20)
    assert groups.recommended == "gaussian_process"
