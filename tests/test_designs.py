"""Central composite designs: geometry, rotatability and coding."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from doe.designs import central_composite, to_actual, to_coded
from doe.response_surface import fit


def test_three_factors_in_standard_order():
    design = central_composite(3)
    assert design.shape == (20, 3)
    assert design[:3].tolist() == [[-1, -1, -1], [1, -1, -1], [-1, 1, -1]]
    assert design[8:10] == pytest.approx(np.array([[-1.681792831, 0, 0], [1.681792831, 0, 0]]), abs=5e-10)
    assert not design[14:].any()


@pytest.mark.parametrize(("factors", "alpha"), [(2, 1.414213562), (3, 1.681792831), (4, 2.0)])
def test_rotatable_alpha(factors, alpha):
    assert central_composite(factors).max() == pytest.approx(alpha, abs=1e-9)


def test_alpha_and_centre_replicates_are_free():
    design = central_composite(2, alpha=1.0, centre_replicates=0)
    assert len(design) == 8
    assert np.abs(design).max() == 1.0


@settings(max_examples=30, deadline=None)
@given(st.integers(2, 4), st.floats(0.1, 2.0), st.integers(0, 2**32 - 1))
def test_prediction_variance_depends_on_the_radius_only(factors, radius, seed):
    rng = np.random.default_rng(seed)
    design = central_composite(factors)
    zero, one = np.zeros(factors), np.ones(factors)
    surface = fit(design, rng.normal(size=len(design)), name="y", centre=zero, step=one)
    directions = rng.normal(size=(20, factors))
    points = radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)
    errors = surface.prediction_standard_error(points)
    assert errors == pytest.approx(errors[0], rel=1e-9)


def test_another_alpha_is_not_rotatable():
    design = central_composite(3, alpha=1.0)
    values = np.random.default_rng(1).normal(size=len(design))
    surface = fit(design, values, name="y", centre=[0] * 3, step=[1] * 3)
    on_axis, on_diagonal = surface.prediction_standard_error([[1, 0, 0], np.full(3, 3**-0.5)])
    assert abs(on_axis / on_diagonal - 1) > 0.01


@given(st.lists(st.floats(-2, 2), min_size=3, max_size=3))
def test_coding_goes_there_and_back(coded):
    centre, step = [0.02, 0.15, 0.3], [0.005, 0.05, 0.05]
    assert to_coded(to_actual(coded, centre, step), centre, step) == pytest.approx(coded, abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"factors": 1}, "at least 2 factors"),
        ({"factors": 3, "alpha": "rotatble"}, 'write "rotatable" or a positive number'),
        ({"factors": 3, "alpha": 0.0}, "must be a positive number"),
        ({"factors": 3, "alpha": float("nan")}, "must be a positive number"),
        ({"factors": 3, "centre_replicates": -1}, "must be at least 0"),
    ],
)
def test_bad_designs_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        central_composite(**arguments)


def test_a_zero_step_is_refused():
    with pytest.raises(ValueError, match="differ from zero"):
        to_coded([1.0], [0.0], [0.0])
