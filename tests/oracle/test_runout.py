"""Circles about an orbit, runout of paths whose runout is known, class limits."""

import importlib
import itertools
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn.quasistatic.runout.turn import (
    convex_hull,
    diameter,
    error_motion,
    face_runout,
    least_squares_circle,
    minimum_zone,
    running_accuracy,
    runout,
    zone_about,
)

ANGLE = 2.0 * math.pi * np.arange(360) / 360


def ring(radius, angle=ANGLE):
    """Points at a radius round the origin."""
    return np.column_stack((radius * np.cos(angle), radius * np.sin(angle)))


def test_unit_zone_of_a_circle():
    """Unit: a circle anywhere has no width, its own centre and its own radius."""
    points = 3e-6 * ring(1.0) + (5e-6, -2e-6)
    for zone in (least_squares_circle(points), minimum_zone(points)):
        assert (zone.x, zone.y, zone.inner) == pytest.approx((5e-6, -2e-6, 3e-6), rel=1e-9)
        assert zone.width < 1e-18


def test_unit_zone_of_an_ellipse():
    """Unit: an ellipse touches both circles twice each: the width is the difference of its half axes."""
    points = np.column_stack((2.0 * np.cos(ANGLE) + 7.0, 1.9 * np.sin(ANGLE)))
    zone = minimum_zone(points)
    assert zone.width == pytest.approx(0.1, rel=1e-9)
    assert (zone.x, zone.y) == pytest.approx((7.0, 0.0), abs=1e-8)


def test_unit_zone_of_a_circle_with_a_spike():
    """Unit: no shift of the centre hides a spike: what it takes from the spike it adds beside it."""
    radius = np.ones(360)
    radius[0] = 1.001
    zone = minimum_zone(ring(radius))
    assert zone.width == pytest.approx(0.001, rel=1e-3)
    assert zone.width <= least_squares_circle(ring(radius)).width


def oracle_width(points):
    """Narrowest zone by trying every centre that three or four points on two circles can fix."""

    def bisector(a, b):
        return b - a, 0.5 * (b @ b - a @ a)

    pairs = [bisector(points[i], points[j]) for i, j in itertools.combinations(range(len(points)), 2)]
    normals, offsets = np.array([n for n, _ in pairs]), np.array([o for _, o in pairs])
    first, second = np.triu_indices(len(pairs), 1)
    determinant = normals[first, 0] * normals[second, 1] - normals[first, 1] * normals[second, 0]
    meet = np.abs(determinant) > 1e-12
    first, second, determinant = first[meet], second[meet], determinant[meet]
    x = (offsets[first] * normals[second, 1] - offsets[second] * normals[first, 1]) / determinant
    y = (normals[first, 0] * offsets[second] - normals[second, 0] * offsets[first]) / determinant
    near = np.hypot(x, y) < 0.5
    apart = np.hypot(points[:, 0, np.newaxis] - x[near], points[:, 1, np.newaxis] - y[near])
    return np.ptp(apart, axis=0).min()


@pytest.mark.parametrize("seed", range(12))
def test_oracle_minimum_zone(seed):
    """Oracle: as narrow as the best of all centres that pairs of points fix (every optimum is one of them)."""
    draw = np.random.default_rng(seed)
    angle = np.sort(draw.uniform(0.0, 2.0 * math.pi, 14))
    angle[:4] = [0.0, 1.6, 3.1, 4.7]
    points = ring(1.0 + 0.02 * draw.standard_normal(14), angle)
    assert minimum_zone(points).width == pytest.approx(oracle_width(points), rel=1e-8)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), size=st.sampled_from([1e-9, 1e-6, 1.0]), far=st.floats(-50.0, 50.0))
def test_invariant_zones_move_and_scale(seed, size, far):
    """Invariant: shifting, turning and scaling the points does so with the zone, which no other centre beats."""
    draw = np.random.default_rng(seed)
    points = ring(1.0 + 0.1 * draw.standard_normal(40), np.linspace(0.0, 6.2, 40))
    zone = minimum_zone(points)
    turn = np.array([[0.6, -0.8], [0.8, 0.6]])
    moved = minimum_zone(size * (points @ turn.T + far))
    assert moved.width == pytest.approx(size * zone.width, rel=1e-6)
    assert zone.width <= least_squares_circle(points).width * (1.0 + 1e-12)
    for x, y in 1e-3 * draw.standard_normal((50, 2)):
        assert zone_about(points, zone.x + x, zone.y + y).width >= zone.width * (1.0 - 1e-9)


def test_unit_flat_orbits_keep_their_centre_among_them():
    """Unit: a line, two points and one point have zones without a centre at infinity."""
    line = np.column_stack((np.linspace(-1.0, 1.0, 21), np.zeros(21)))
    assert minimum_zone(line).width == pytest.approx(1.0)
    assert minimum_zone(line[:1]).width == 0.0
    assert diameter(line) == 2.0 and diameter(line[:1]) == 0.0
    thin = np.column_stack((np.cos(ANGLE), 1e-3 * np.sin(ANGLE)))
    assert np.abs([minimum_zone(thin).x, minimum_zone(thin).y]).max() <= 1.0


@settings(deadline=None)
@given(seed=st.integers(0, 10_000))
def test_oracle_diameter_and_hull(seed):
    """Oracle: the diameter is the largest distance of all pairs, and the hull holds every point."""
    points = np.random.default_rng(seed).standard_normal((30, 2)).round(1)
    apart = points[:, np.newaxis] - points
    assert diameter(points) == pytest.approx(np.hypot(apart[..., 0], apart[..., 1]).max())
    corners = convex_hull(points)
    along = np.roll(corners, -1, axis=0) - corners
    left = points[:, np.newaxis] - corners
    assert np.all(along[:, 0] * left[..., 1] - along[:, 1] * left[..., 0] >= -1e-12)


def path_of(x, y, z=0.0, theta_x=0.0, theta_y=0.0):
    """A path from its displacements."""
    return np.column_stack([np.broadcast_to(part, np.shape(x)) for part in (x, y, z, theta_x, theta_y)])


def test_unit_eccentric_ring():
    """Unit: an eccentricity e reads 2e on an indicator and nothing between circles or as error motion."""
    e = 1e-6
    found = runout(path_of(e * np.cos(ANGLE), e * np.sin(ANGLE)), 1, 0.04)
    assert found.indicator_um == pytest.approx(2e6 * e)
    assert (
        max(found.minimum_zone_um, found.least_squares_um, found.error_motion_um, found.axial_um, found.face_um) < 1e-9
    )
    assert found.asynchronous_radial_um == 0.0


def test_unit_three_lobes():
    """Unit: motion of order k along x has its whole range as error motion, whatever the eccentricity added."""
    x = 2e-6 * np.cos(ANGLE - 1.0) + 0.3e-6 * np.cos(3.0 * ANGLE)
    assert error_motion(ANGLE, x) == pytest.approx(0.6e-6, rel=1e-6)
    assert error_motion(ANGLE, np.zeros(360)) == 0.0


def test_unit_face_runout_of_a_tilt():
    """Unit: a ring that wobbles by an angle reads twice angle times radius on its face and nothing at its centre."""
    path = path_of(0.0 * ANGLE, 0.0, 0.0, 1e-5 * np.cos(ANGLE), 1e-5 * np.sin(ANGLE))
    assert face_runout(path, 0.04) == pytest.approx(2.0 * 1e-5 * 0.04)
    assert runout(path, 1, 0.04).axial_um == 0.0


def test_unit_synchronous_and_asynchronous_parts():
    """Unit: what repeats with the ring is synchronous, what comes at 2/5 of its speed averages out over five turns."""
    angle = 2.0 * math.pi * np.arange(5 * 88) / 88
    x, z = 1e-6 * np.cos(angle), 0.5e-6 * np.cos(2.0 * angle)
    slow, slow_axial = 0.2e-6 * np.cos(0.4 * angle), 0.1e-6 * np.cos(0.4 * angle)
    found = runout(path_of(x + slow, 0.0, z + slow_axial), 5, 0.04)
    assert found.synchronous_radial_um == pytest.approx(2.0, rel=1e-9)
    assert found.synchronous_axial_um == pytest.approx(1.0, rel=1e-9)
    # Five samples of a cosine, 144 degrees apart, span at most 2 cos(18 deg) of its amplitude.
    assert found.asynchronous_radial_um == pytest.approx(0.2 * 2.0 * math.cos(math.pi / 10.0), rel=1e-3)
    assert found.asynchronous_axial_um == pytest.approx(0.1 * 2.0 * math.cos(math.pi / 10.0), rel=1e-3)


def test_literature_homogenisation(monkeypatch):
    """Literature: Zhou et al.'s 1.89 um from 1.5 and 1.6 um is 0.61, 1.98 um from 1.6 and 1.7 um is 0.60 (eqs 23-26)."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    homogenisation = importlib.import_module("published.homogenisation").homogenisation
    assert homogenisation(1.89, 1.5, 1.6) == pytest.approx(0.61, abs=0.005)
    assert homogenisation(1.98, 1.6, 1.7) == pytest.approx(0.60, abs=0.005)
    with pytest.raises(ValueError, match="without errors"):
        homogenisation(1.0, 0.0, 0.0)


def test_literature_class_p2_as_in_the_paper():
    """Literature: P2 of Zhou et al. 2024, Table 3: K_ia 2.5, S_d 1.5, S_ia 2.5 um from 30 to 80 mm."""
    for bore in (40e-3, 50e-3, 70e-3, 80e-3):
        limits = running_accuracy("P2", bore, 110e-3)
        assert (limits.radial, limits.face, limits.axial) == pytest.approx((2.5e-6, 1.5e-6, 2.5e-6))
        assert limits.outer_radial == pytest.approx(5e-6)


def test_invariant_classes_are_ordered():
    """Invariant: a finer class never permits more, and a larger bore never less."""
    bores = (5e-3, 15e-3, 25e-3, 40e-3, 70e-3)
    radial = np.array(
        [[running_accuracy(name, bore).radial for name in ("P2", "P4", "P5", "P6", "normal")] for bore in bores]
    )
    assert np.all(np.diff(radial, axis=1) > 0.0) and np.all(np.diff(radial, axis=0) >= 0.0)


def test_unit_limits_end_with_the_table():
    """Unit: nothing is made up outside the tables."""
    with pytest.raises(ValueError, match="up to 80 mm"):
        running_accuracy("P4", 0.3)
    assert running_accuracy("P5", 0.07, 0.11).outer_radial is None
