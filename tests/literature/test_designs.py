"""Designs: published tables, rotatability, orthogonal blocks, coding."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from doe.designs import axial_distance, box_behnken, central_composite, to_actual, to_coded
from doe.designs.design import centre_shares, cube_points
from doe.designs.model import block_contrasts, model_matrix, model_terms
from doe.response_surface import fit

# Axial distances of Lenth, Response-Surface Methods in R, Using rsm, J. Stat. Softw. 32 (2009) 7, the designs of
# `ccd.pick(5, ...)` with one run of each axial point: runs and centre points of a cube block, number of cube
# blocks, centre points of the axial block, runs in all, alpha for rotatability and for orthogonal blocks.
FIVE_FACTORS = [
    (16, 6, 1, 1, 33, 2.000000, 2.000000),
    (16, 8, 1, 2, 36, 2.000000, 2.000000),
    (16, 10, 1, 3, 39, 2.000000, 2.000000),
    (16, 8, 2, 7, 65, 2.378414, 2.380476),
    (8, 4, 4, 7, 65, 2.378414, 2.380476),
    (16, 1, 2, 2, 46, 2.378414, 2.376354),
    (16, 5, 2, 5, 57, 2.378414, 2.390457),
    (16, 4, 2, 4, 54, 2.378414, 2.366432),
    (8, 2, 4, 4, 54, 2.378414, 2.366432),
]
# The same source: `bbd(3, n0 = 2)` by standard order.
BOX_BEHNKEN_3 = {
    1: (-1, -1, 0), 2: (1, -1, 0), 3: (-1, 1, 0), 4: (1, 1, 0), 5: (-1, 0, -1), 6: (1, 0, -1), 7: (-1, 0, 1),
    8: (1, 0, 1), 9: (0, -1, -1), 10: (0, 1, -1), 11: (0, -1, 1), 12: (0, 1, 1), 13: (0, 0, 0), 14: (0, 0, 0),
}  # fmt: skip


def prediction_errors(points: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Standard errors of a full second-order surface over the points, up to a factor."""
    factors = points.shape[1]
    values = np.random.default_rng(1).normal(size=len(points))
    surface = fit(points, values, name="y", centre=np.zeros(factors), step=np.ones(factors))
    return surface.prediction_standard_error(at)


def cosines_of_blocks(design) -> float:
    """Largest cosine between a block contrast and a column of the full second-order model."""
    columns = model_matrix(design.coded, model_terms(design.coded.shape[1], "quadratic"))
    contrasts = block_contrasts(design.block)
    norms = np.outer(np.linalg.norm(columns, axis=0), np.linalg.norm(contrasts, axis=0))
    return float(np.abs(columns.T @ contrasts / norms).max())


def test_three_factors_in_standard_order():
    design = central_composite(3).coded
    assert design.shape == (20, 3)
    assert design[:3].tolist() == [[-1, -1, -1], [1, -1, -1], [-1, 1, -1]]
    assert design[8:10] == pytest.approx(np.array([[-1.681792831, 0, 0], [1.681792831, 0, 0]]), abs=5e-10)
    assert not design[14:].any()


@pytest.mark.parametrize(
    ("factors", "cube", "alpha"),
    [
        (2, "full", 1.414), (3, "full", 1.682), (4, "full", 2.0), (5, "resolution_v", 2.0),
        (5, "full", 2.378), (6, "resolution_v", 2.378), (6, "full", 2.828),
    ],
)  # fmt: skip
def test_literature_rotatable_alpha(factors, cube, alpha):
    """Literature: NIST/SEMATECH e-Handbook, Table 3.23."""
    assert central_composite(factors, cube=cube).coded.max() == pytest.approx(alpha, abs=5e-4)


@pytest.mark.parametrize("factors", [3, 4])
def test_practical_alpha_predicts_the_box_better_and_still_shows_a_cubic(factors):
    """In the box of its axial points; a cubic leaves residuals as large as the bias that it causes there, which three levels hide."""
    corners = np.array(list(product((-1.0, 1.0), repeat=factors)))
    places = np.random.default_rng(1).uniform(-1.0, 1.0, (4000, factors))
    terms, variance, seen = model_terms(factors, "quadratic"), {}, {}
    for alpha in ("rotatable", "practical", "face_centred"):
        coded = central_composite(factors, alpha=alpha).coded
        rows, here, there = (model_matrix(points, terms) for points in (coded / coded.max(), places, corners))
        inverse = np.linalg.inv(rows.T @ rows)
        variance[alpha] = [np.einsum("ij,jk,ik->i", points, inverse, points).mean() for points in (here, there)]
        cubic = (coded[:, 0] / coded.max()) ** 3
        coefficients = inverse @ rows.T @ cubic
        residual = np.sqrt(((cubic - rows @ coefficients) ** 2).sum() / (len(rows) - rows.shape[1]))
        seen[alpha] = residual / np.sqrt(((places[:, 0] ** 3 - here @ coefficients) ** 2).mean())
    assert axial_distance(factors, "practical") == pytest.approx(factors**0.25)
    assert (np.array(variance["practical"]) < 0.6 * np.array(variance["rotatable"])).all()
    assert seen["face_centred"] < 1e-9 and seen["practical"] == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(
    ("corners", "with_cube", "cubes", "with_axial", "runs", "rotatable", "orthogonal"), FIVE_FACTORS
)
def test_literature_alpha_of_five_factors(corners, with_cube, cubes, with_axial, runs, rotatable, orthogonal):
    cube, centres = corners * cubes, (with_cube * cubes, with_axial)
    assert cube + 10 + sum(centres) == runs
    assert axial_distance(5, "rotatable", cube_runs=cube) == pytest.approx(rotatable, abs=5e-7)
    found = axial_distance(5, "orthogonal_blocks", cube_runs=cube, centres=centres)
    assert found == pytest.approx(orthogonal, abs=5e-7)


def test_literature_two_factors_in_two_blocks():
    """Literature: NIST/SEMATECH e-Handbook, Table 3.29: 4 corners and 4 axial points at 1.414, 3 centres each."""
    design = central_composite(2, alpha="orthogonal_blocks", centre_replicates=6, blocks=True)
    assert np.bincount(design.block).tolist() == [7, 7]
    assert design.coded.max() == pytest.approx(1.414, abs=5e-4)


@pytest.mark.parametrize(("factors", "cube", "centres"), [(2, "full", 4), (5, "resolution_v", 7)])
def test_blocks_disturb_no_term(factors, cube, centres):
    design = central_composite(factors, alpha="orthogonal_blocks", cube=cube, centre_replicates=centres, blocks=True)
    assert design.blocks == 2
    assert cosines_of_blocks(design) < 1e-12


def test_blocks_of_a_rotatable_design_disturb_the_squares_a_little():
    """Its alpha is not the orthogonal one; the centre points are shared so that it is as near as can be."""
    design = central_composite(3, blocks=True)
    assert np.bincount(design.block).tolist() == [12, 8]
    assert 1e-3 < cosines_of_blocks(design) < 0.03
    assert centre_shares(3, 8, "spherical", 6) == (3, 3)


def test_squares_are_estimated_independently_of_each_other():
    design = central_composite(3, alpha="orthogonal_columns", centre_replicates=4).coded
    covariance = np.linalg.inv(np.cov((design**2).T))
    assert np.abs(covariance - np.diag(np.diag(covariance))).max() < 1e-9 * covariance.max()


def test_words_of_alpha_are_what_they_say():
    assert axial_distance(5, "spherical") == pytest.approx(5**0.5)
    assert np.abs(central_composite(4, alpha="face_centred").coded).max() == 1.0
    inscribed, rotatable = central_composite(3, alpha="inscribed").coded, central_composite(3).coded
    assert inscribed == pytest.approx(rotatable / rotatable.max())
    assert central_composite(3, alpha=1.5).reach == 1.5
    assert central_composite(3, alpha="inscribed").reach == 1.0


def test_alpha_and_centre_replicates_are_free():
    design = central_composite(2, alpha=1.0, centre_replicates=0).coded
    assert len(design) == 8
    assert np.abs(design).max() == 1.0


@settings(max_examples=20, deadline=None)
@given(st.integers(2, 5), st.floats(0.1, 2.0), st.sampled_from(["rotatable", "inscribed"]))
def test_prediction_variance_depends_on_the_radius_only(factors, radius, alpha):
    cube = "resolution_v" if factors == 5 else "full"
    design = central_composite(factors, alpha=alpha, cube=cube).coded
    towards = np.random.default_rng(factors).normal(size=(20, factors))
    errors = prediction_errors(design, radius * towards / np.linalg.norm(towards, axis=1, keepdims=True))
    assert errors == pytest.approx(errors[0], rel=1e-9)


def test_another_alpha_is_not_rotatable():
    at = np.array([[1.0, 0.0, 0.0], np.full(3, 3**-0.5)])
    on_axis, on_diagonal = prediction_errors(central_composite(3, alpha=1.0).coded, at)
    assert abs(on_axis / on_diagonal - 1) > 0.01


@pytest.mark.parametrize(("factors", "corners"), [(5, 16), (6, 32), (7, 64), (8, 64)])
def test_fractions_confuse_no_term_of_second_order(factors, corners):
    cube = cube_points(factors, "resolution_v")
    terms = model_terms(factors, "interaction")
    columns = model_matrix(cube, terms)
    assert cube.shape == (corners, factors)
    assert columns.T @ columns == pytest.approx(corners * np.eye(len(terms)))


def test_box_behnken_points_are_the_published_ones():
    design = box_behnken(3, centre_replicates=2)
    assert {place + 1: tuple(point) for place, point in enumerate(design.coded)} == BOX_BEHNKEN_3


@pytest.mark.parametrize(
    ("factors", "centres", "sizes"),
    [(3, 3, [15]), (4, 3, [9, 9, 9]), (5, 6, [23, 23]), (6, 6, [27, 27]), (7, 6, [31, 31])],
)
def test_literature_box_behnken_sizes_and_blocks(factors, centres, sizes):
    """Literature: Box and Behnken (1960); every factor is varied equally often, so is every pair."""
    design = box_behnken(factors, centre_replicates=centres, blocks=factors > 3)
    assert np.bincount(design.block).tolist() == sizes
    squares = design.coded**2
    together = squares.T @ squares
    assert len(set(np.diag(together))) == 1
    assert len(set(np.linalg.norm(design.coded, axis=1)[: -centres or None].round(9)) - {0.0}) == 1
    if factors != 6:  # the design in six factors is only partly balanced
        assert len(set(together[np.triu_indices(factors, 1)])) == 1
    assert factors == 3 or cosines_of_blocks(design) < 1e-12


def test_random_order_stays_within_blocks_and_keeps_the_names_of_the_runs():
    design = box_behnken(4, blocks=True)
    mixed = design.by_blocks(seed=3)
    assert (np.diff(mixed.block) >= 0).all()
    assert np.array_equal(mixed.coded, design.coded[mixed.order])
    assert np.array_equal(mixed.order, design.by_blocks(seed=3).order)
    assert not np.array_equal(mixed.order, design.by_blocks(seed=4).order)
    assert sorted(mixed.order) == list(range(30))
    assert np.array_equal(central_composite(3).by_blocks().coded, central_composite(3).coded)


@given(st.lists(st.floats(-2, 2), min_size=3, max_size=3))
def test_coding_goes_there_and_back(coded):
    centre, step = [0.02, 0.15, 0.3], [0.005, 0.05, 0.05]
    assert to_coded(to_actual(coded, centre, step), centre, step) == pytest.approx(coded, abs=1e-12)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"factors": 1}, "at least 2 factors"),
        ({"factors": 3, "alpha": "rotatble"}, 'write "rotatable", .* or a positive number'),
        ({"factors": 3, "alpha": 0.0}, "must be a positive number"),
        ({"factors": 3, "alpha": float("nan")}, "must be a positive number"),
        ({"factors": 3, "centre_replicates": -1}, "must be at least 0"),
        ({"factors": 4, "cube": "resolution_v"}, "tabulated for 4 factors, only for 5 to 8"),
        ({"factors": 4, "cube": "half"}, 'choose "full" or "resolution_v"'),
    ],
)
def test_bad_designs_are_refused(arguments, words):
    with pytest.raises(ValueError, match=words):
        central_composite(**arguments)


@pytest.mark.parametrize(
    ("factors", "arguments", "words"),
    [
        (8, {}, "tabulated for 3 to 7 factors, not for 8"),
        (3, {"blocks": True}, "no orthogonal blocks"),
        (5, {"blocks": True, "centre_replicates": 5}, "give a multiple of 2"),
    ],
)
def test_bad_box_behnken_designs_are_refused(factors, arguments, words):
    with pytest.raises(ValueError, match=words):
        box_behnken(factors, **arguments)


def test_a_zero_step_is_refused():
    with pytest.raises(ValueError, match="differ from zero"):
        to_coded([1.0], [0.0], [0.0])
