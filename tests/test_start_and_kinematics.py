"""Where a run starts: epicyclic speeds, static load share, seeded offsets."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from rbdyn.contact.hertz_line import LineContactOnBar
from rbdyn.dynamics import state
from rbdyn.dynamics.equations import mechanical_energy
from rbdyn.dynamics.guide_land import InnerGuide, NoFilm, NoGuide, OuterGuide
from rbdyn.dynamics.model import cage_inertia, kinematics, raceway_radii, roller_bearing, scales
from rbdyn.dynamics.start import start_state, static_share


def test_literature_speeds_at_the_papers_point(outer):
    """Literature: raceways 34.5/52.5 mm, cage 9517 rpm, entrainment 26.2 m/s, at zero clearance (printed digits)."""
    zero = outer.model_copy(update={"bearing": outer.bearing.model_copy(update={"radial_clearance_mm": 0.0})})
    assert raceway_radii(zero) == pytest.approx((26.25e-3, 17.25e-3), rel=1e-12)
    motion = kinematics(zero)
    assert motion.cage_speed * 30.0 / math.pi == pytest.approx(9517.0, abs=0.5)
    assert motion.cage_speed - motion.roller_spin == pytest.approx(5814.0, abs=0.5)
    assert motion.entrainment == pytest.approx(26.2, abs=0.05)
    # The clearance moves the raceways by a few parts in ten thousand.
    assert kinematics(outer).cage_speed == pytest.approx(motion.cage_speed, rel=1e-3)


def test_invariant_rolling_without_slip(outer):
    """Invariant: at the kinematic speeds a roller slips on neither raceway of the bearing without clearance."""
    scene = outer.model_copy(
        update={"bearing": outer.bearing.model_copy(update={"radial_clearance_mm": 0.0})}
    )
    motion, (outer_radius, inner_radius) = kinematics(scene), raceway_radii(scene)
    roller = 4.5e-3
    orbit = motion.cage_speed * (outer_radius - roller)
    shaft = scene.operation.inner_speed_rpm * math.pi / 30.0
    assert orbit + motion.roller_spin * roller == pytest.approx(0.0, abs=1e-12 * orbit)
    assert orbit - motion.roller_spin * roller == pytest.approx(shaft * inner_radius, rel=1e-12)
    assert (shaft - motion.cage_speed) * inner_radius == pytest.approx(motion.entrainment, rel=1e-12)


def test_literature_centrifugal_force(outer):
    """Literature: 54 N on a roller of 5 mm."""
    bearing, motion = roller_bearing(outer), kinematics(outer)
    assert bearing.roller_mass * 21.75e-3 * motion.cage_speed**2 == pytest.approx(54.0, abs=0.5)


def equilibrium(bearing, angles, orbit_speed):
    """Ring displacement and loads on the inner race by nested bracketing, from Palmgren's law and geometry alone."""
    k = bearing.inner.contact.stiffness

    def load(approach):
        return k * max(approach, 0.0) ** (10.0 / 9.0)

    def roller_loads(ring_x, angle):
        def inner(radius):
            x, y = radius * math.cos(angle) - ring_x, radius * math.sin(angle)
            return load(bearing.inner.radius + bearing.roller_radius - math.hypot(x, y))

        def unbalance(radius):
            outside = load(radius + bearing.roller_radius - bearing.outer.radius)
            return outside - inner(radius) - bearing.roller_mass * radius * orbit_speed**2

        seat = bearing.outer.radius - bearing.roller_radius
        return inner(brentq(unbalance, seat - 1e-4, seat + 1e-4, xtol=1e-18, rtol=1e-15))

    def support(ring_x):
        return sum(roller_loads(ring_x, angle) * math.cos(angle) for angle in angles) - bearing.radial_load

    ring_x = brentq(support, 0.0, 1e-4, xtol=1e-18, rtol=1e-15)
    return ring_x, [roller_loads(ring_x, angle) for angle in angles]


def test_oracle_static_share(outer):
    """Oracle and literature: ring displacement as scipy finds it; 674/387/387 N on the three loaded rollers."""
    bearing, motion = roller_bearing(outer), kinematics(outer)
    angles = 2.0 * np.pi * np.arange(10) / 10
    expected, loads = equilibrium(bearing, angles, motion.cage_speed)
    radii = np.empty(10)
    # Bisection stops at the round-off of the radii, 3e-18 m in a displacement of some 1e-5 m.
    assert static_share(bearing, angles, motion.cage_speed, radii) == pytest.approx(expected, rel=1e-10)
    assert loads[0] == pytest.approx(674.0, rel=0.01)
    assert [loads[1], loads[9]] == pytest.approx([387.0, 387.0], rel=0.01)
    assert loads[2:9] == [0.0] * 7


def test_unit_start_is_in_equilibrium(outer, evaluate):
    """Unit: at the start radial forces balance: the ring has no acceleration along the load, races no impact."""
    bearing = roller_bearing(outer)
    y = start_state(outer, bearing, np.random.default_rng(5))
    outcome = evaluate(bearing, y)
    # Traction and rolling resistance are not part of the static share: a few parts in a hundred of the load.
    assert abs(outcome.dy[58]) < 0.05 * bearing.radial_load / bearing.ring_mass
    assert 400.0 < outcome.loads[2] < 900.0
    assert all(math.isfinite(part) for part in mechanical_energy(bearing, y))


def test_unit_seeds(outer):
    """Unit: the same seed gives the same bits, another seed another start, within the stated offsets."""
    bearing = roller_bearing(outer)
    first, again, other = (start_state(outer, bearing, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert (first == again).all()
    assert (first[:10] != other[:10]).all()
    for y in (first, other):
        angles = np.arctan2(y[10:20], y[:10]) - 2.0 * np.pi * np.arange(10) / 10
        offset = 21.75e-3 * np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi)
        assert offset.max() <= 0.2 * 0.30e-3
        assert math.hypot(y[50], y[51]) == pytest.approx(0.1 * 0.075e-3, rel=1e-9)


def test_unit_state_names():
    """Unit: components have the names of the layout, rollers counted from 1."""
    assert state.size(10) == 60
    assert [state.name(i, 10) for i in (0, 29, 43, 52, 59)] == [
        "roller 1 x", "roller 10 vx", "roller 4 spin", "cage angle", "inner ring vy",
    ]  # fmt: skip


def test_unit_geometry_of_guides(make_scene, outer, inner):
    """Unit: which part is the journal, its radius and play; the plain ring's inertia; what is off is not there."""
    outside, inside = roller_bearing(outer).guide, roller_bearing(inner).guide
    assert type(outside) is OuterGuide and type(inside) is InnerGuide
    assert outside.radius == pytest.approx(24.75e-3 - 75e-6) and inside.radius == pytest.approx(18.75e-3)
    assert outside.dry.play == pytest.approx(72e-6)
    # m (D^2 + d^2)/8 with 49.5 and 40.5 mm.
    assert cage_inertia(outer) == pytest.approx(0.045 * (49.5e-3**2 + 40.5e-3**2) / 8.0, rel=1e-12)
    dry = roller_bearing(make_scene("model.guide_land=dry")).guide
    assert type(dry.film) is NoFilm and dry.dry.play == pytest.approx(75e-6)
    assert type(roller_bearing(make_scene("cage.guidance=roller")).guide) is NoGuide
    assert type(roller_bearing(outer).pocket.contact) is LineContactOnBar


def test_unit_scales(outer):
    """Unit: a contact's characteristic speed is its amplitude times its natural frequency."""
    bearing = roller_bearing(outer)
    scale = scales(bearing, outer)
    assert scale.load == pytest.approx(130.0)  # 1300 N over ten rollers
    assert bearing.inner.contact.stiffness * scale.length ** (10.0 / 9.0) == pytest.approx(
        scale.load, rel=1e-12
    )
    stiffness = 10.0 / 9.0 * scale.load / scale.length
    assert scale.speed == pytest.approx(scale.length * math.sqrt(stiffness / bearing.roller_mass), rel=1e-12)
