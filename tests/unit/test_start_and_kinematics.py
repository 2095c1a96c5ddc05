"""Where a run starts: epicyclic speeds, static load share, seeded offsets."""

import math

import numpy as np
import pytest
from conftest import ROOT, UNSAMPLED
from numpy_twin import race_overlap
from numpy_twin_laws import race_load, raceways, roller_errors
from scipy.optimize import brentq

from rbdyn.contact.hertz_line import LineContactOnBar
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.cage import InnerGuide, NoFilm, NoGuide, OuterGuide
from rbdyn.dynamics.forces.equations import OF_MOTION, OFF_RACES, mechanical_energy, without
from rbdyn.dynamics.parameters import state as scale_module
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import load_distribution, scales, start_state, static_share
from rbdyn.dynamics.parameters.validity import race_report
from rbdyn.dynamics.run import Run
from rbdyn.scene import Scene, fits
from rbdyn.scene.bearing import Bearing


def test_literature_speeds_at_the_papers_point(outer):
    """Literature: raceways 34.5/52.5 mm, cage 9517 rpm, entrainment 26.2 m/s, at zero clearance (printed digits)."""
    zero = outer.model_copy(update={"bearing": outer.bearing.model_copy(update={"radial_clearance_mm": 0.0})})
    assert zero.geometry.raceways == pytest.approx((26.25e-3, 17.25e-3), rel=1e-12)
    motion = zero.geometry.motion
    assert motion.cage_speed * 30.0 / math.pi == pytest.approx(9517.0, abs=0.5)
    assert motion.cage_speed - motion.roller_spin == pytest.approx(5814.0, abs=0.5)
    assert motion.entrainment == pytest.approx(26.2, abs=0.05)
    # The clearance moves the raceways by a few parts in ten thousand.
    assert outer.geometry.motion.cage_speed == pytest.approx(motion.cage_speed, rel=1e-3)


def test_invariant_rolling_without_slip(outer):
    """Invariant: at the kinematic speeds a roller slips on neither raceway of the bearing without clearance."""
    scene = outer.model_copy(update={"bearing": outer.bearing.model_copy(update={"radial_clearance_mm": 0.0})})
    motion, (outer_radius, inner_radius) = scene.geometry.motion, scene.geometry.raceways
    roller = 4.5e-3
    orbit = motion.cage_speed * (outer_radius - roller)
    shaft = scene.operation.inner_speed_rpm * math.pi / 30.0
    assert orbit + motion.roller_spin * roller == pytest.approx(0.0, abs=1e-12 * orbit)
    assert orbit - motion.roller_spin * roller == pytest.approx(shaft * inner_radius, rel=1e-12)
    assert (shaft - motion.cage_speed) * inner_radius == pytest.approx(motion.entrainment, rel=1e-12)


def test_literature_centrifugal_force(outer):
    """Literature: 54 N on a roller of 5 mm."""
    bearing, motion = roller_bearing(outer), outer.geometry.motion
    assert bearing.roller_mass * 21.75e-3 * motion.cage_speed**2 == pytest.approx(54.0, abs=0.5)


def equilibrium(scene, angles, orbit_speed):
    """Ring displacement and loads on the inner race by nested bracketing, from the laws and geometry of the twin."""
    radii, (outer_radius, _) = roller_errors(scene), raceways(scene)
    mass, load = roller_bearing(scene).roller_mass, scene.operation.radial_load_N

    def contact(j, centre, ring_x, encloses):
        between = centre - np.array([0.0 if encloses else ring_x, 0.0])
        overlap = float(race_overlap(scene, encloses, radii[j], between, 0.0))
        return race_load(scene, encloses, overlap, math.atan2(between[1], between[0]))[0]

    def roller_load(j, ring_x):
        direction = np.array([math.cos(angles[j]), math.sin(angles[j])])

        def unbalance(radius):
            centre = radius * direction
            held = contact(j, centre, ring_x, True) - contact(j, centre, ring_x, False)
            return held - mass * radius * orbit_speed**2

        seat = outer_radius - radii[j]
        radius = brentq(unbalance, seat - 1e-4, seat + 1e-4, xtol=1e-18, rtol=1e-15)
        return contact(j, radius * direction, ring_x, False)

    def support(ring_x):
        return sum(roller_load(j, ring_x) * math.cos(angles[j]) for j in range(len(angles))) - load

    ring_x = brentq(support, 0.0, 1e-4, xtol=1e-15, rtol=1e-12)
    return ring_x, [roller_load(j, ring_x) for j in range(len(angles))]


def test_oracle_static_share(outer):
    """Oracle and literature: ring displacement as scipy finds it; 674/387/387 N on the three loaded rollers."""
    bearing, motion = roller_bearing(outer), outer.geometry.motion
    angles = 2.0 * np.pi * np.arange(10) / 10
    expected, loads = equilibrium(outer, angles, motion.cage_speed)
    radii = np.empty(10)
    # Bisection stops at the round-off of the radii, 3e-18 m in a displacement of some 1e-5 m.
    found = static_share(without(bearing, OFF_RACES), angles, motion.cage_speed, 1300.0, radii)
    assert found == pytest.approx(expected, rel=1e-10)
    assert loads[0] == pytest.approx(674.0, rel=0.01)
    assert [loads[1], loads[9]] == pytest.approx([387.0, 387.0], rel=0.01)
    assert loads[2:9] == [0.0] * 7


def test_oracle_static_share_of_an_imperfect_bearing(everything):
    """Oracle: the same with waviness, unequal rollers, a crown, a tilt and the logarithmic law."""
    bearing, motion = roller_bearing(everything), everything.geometry.motion
    angles = 0.2 + 2.0 * np.pi * np.arange(10) / 10
    expected, loads = equilibrium(everything, angles, motion.cage_speed)
    radii = np.empty(10)
    found = static_share(
        without(bearing, OFF_RACES), angles, motion.cage_speed, everything.operation.radial_load_N, radii
    )
    assert found == pytest.approx(expected, rel=1e-9)
    assert 2 <= np.count_nonzero(loads) < 10


def test_oracle_load_distribution(outer, everything):
    """Oracle: loads at each place are those of nested bracketing; the outer race bears the centrifugal force on top."""
    for scene in (outer, everything):
        bearing, geometry = roller_bearing(scene), scene.geometry
        load, count = scene.operation.radial_load_N, scene.bearing.rollers
        found = load_distribution(scene, bearing, load, positions=3)
        assert found.outer.shape == found.inner.shape == (3, count)
        for row in (0, 2):
            angles = 2.0 * np.pi * (np.arange(count) + (row + 0.5) / 3) / count
            _, loads = equilibrium(scene, angles, geometry.motion.cage_speed)
            assert found.inner[row] == pytest.approx(loads, rel=1e-4, abs=1e-3)
            along = found.inner[row] @ np.cos(angles)
            assert along == pytest.approx(load, rel=1e-3)
        # The contact normals of the two races differ by the ring's displacement over its radius.
        extra = found.outer - found.inner
        assert extra == pytest.approx(np.full_like(extra, geometry.centrifugal_force), rel=0.01)


def test_literature_both_rings_turn(make_scene):
    """Literature: cage speed (w_i R_i + w_o R_o)/(R_i + R_o); zero where race surfaces run against each other."""
    scene = make_scene("bearing.radial_clearance_mm=0.0", "operation.outer_speed_rpm=9000.0")
    shaft, housing = 24000.0 * math.pi / 30.0, 9000.0 * math.pi / 30.0
    motion, roller = scene.geometry.motion, 4.5e-3
    assert motion.cage_speed == pytest.approx((shaft * 17.25 + housing * 26.25) / 43.5, rel=1e-12)
    orbit = motion.cage_speed * 21.75e-3
    assert orbit + motion.roller_spin * roller == pytest.approx(housing * 26.25e-3, rel=1e-12)
    assert orbit - motion.roller_spin * roller == pytest.approx(shaft * 17.25e-3, rel=1e-12)
    assert (shaft - motion.cage_speed) * 17.25e-3 == pytest.approx(motion.entrainment, rel=1e-12)
    assert (housing - motion.cage_speed) * 26.25e-3 == pytest.approx(-motion.entrainment, rel=1e-12)
    counter = scene.geometry.rolling(shaft, -shaft * 17.25 / 26.25)
    assert counter.cage_speed == pytest.approx(0.0, abs=1e-12 * shaft)
    assert counter.entrainment == pytest.approx(shaft * 17.25e-3, rel=1e-12)
    together = scene.geometry.rolling(shaft, shaft)
    assert (together.cage_speed, together.roller_spin) == pytest.approx((shaft, shaft), rel=1e-12)
    assert together.entrainment == pytest.approx(0.0, abs=1e-12 * shaft)


def test_unit_start_on_a_support(everything):
    """Unit: all sits on the outer ring, which gives way by load over stiffness; speeds are those of time zero."""
    bearing = roller_bearing(everything)
    y = start_state(everything, bearing, np.random.default_rng(5))
    assert y.size == 67 and (y[61:] == 0.0).all()
    # At rest the rotating load and the unbalance lie along the load.
    shaft = 20000.0 * math.pi / 30.0
    load = 900.0 + 150.0 + 3e-6 * shaft**2
    assert y[60] == pytest.approx(load / 5e7, rel=1e-12)
    motion = everything.geometry.rolling(shaft, -6000.0 * math.pi / 30.0)
    assert y[55] == pytest.approx(motion.cage_speed, rel=1e-12)
    assert y[40:50] == pytest.approx(np.full(10, motion.roller_spin), rel=1e-12)
    assert y[56] > y[60] and np.hypot(y[50] - y[60], y[51]) == pytest.approx(7.5e-6, rel=1e-9)


def test_unit_start_is_in_equilibrium(outer, evaluate):
    """Unit: at the start radial forces balance: the ring has no acceleration along the load, races no impact."""
    bearing = roller_bearing(outer)
    y = start_state(outer, bearing, np.random.default_rng(5))
    outcome = evaluate(bearing, y)
    # Traction and rolling resistance are not part of the static share: some parts in ten thousand of the load.
    assert abs(outcome.dy[58]) < 0.002 * bearing.drive.load_x / bearing.inner_ring_mass
    # 674 N with a roller under the load, least with the load between two.
    assert 600.0 < outcome.loads[2] < 680.0
    assert all(math.isfinite(part) for part in mechanical_energy(without(bearing, OF_MOTION), y))


def test_unit_seeds(outer):
    """Unit: the same seed gives the same bits, another seed another start, within the stated offsets."""
    bearing = roller_bearing(outer)
    first, again, other = (start_state(outer, bearing, np.random.default_rng(seed)) for seed in (1, 1, 2))
    assert (first == again).all()
    assert (first[:10] != other[:10]).all()
    for y in (first, other):
        angles = np.arctan2(y[10:20], y[:10]) - y[52] - 2.0 * np.pi * np.arange(10) / 10
        offset = 21.75e-3 * np.abs((angles + np.pi) % (2.0 * np.pi) - np.pi)
        assert offset.max() <= 0.2 * 0.30e-3
        assert math.hypot(y[50], y[51]) == pytest.approx(0.1 * 0.075e-3, rel=1e-9)


def test_unit_state_names():
    """Unit: components have the names of the layout, rollers counted from 1."""
    plain, full = state.layout(10, False, False), state.layout(10, True, True)
    assert plain == (10, 60, None, None, None) and full == (10, 67, 60, 64, None)
    assert state.layout(10, False, True) == (10, 63, None, 60, None)
    assert state.layout(10, False, True, True) == (10, 83, None, 60, 63)
    for parts in (plain, full):
        assert [state.name(i, parts) for i in (0, 29, 43, 52, 59)] == [
            "roller 1 x", "roller 10 vx", "roller 4 spin", "cage angle", "inner ring vy",
        ]  # fmt: skip
    assert [state.name(i, full) for i in (60, 63, 64, 65, 66)] == [
        "outer ring x", "outer ring vy", "time", "inner ring angle", "outer ring angle",
    ]  # fmt: skip
    assert state.name(60, state.layout(10, False, True)) == "time"


def test_unit_geometry_of_guides(make_scene, outer, inner):
    """Unit: which part is the journal, its radius and play; the plain ring's inertia; what is off is not there."""
    outside, inside = roller_bearing(outer).guide, roller_bearing(inner).guide
    assert type(outside) is OuterGuide and type(inside) is InnerGuide
    assert outside.radius == pytest.approx(24.75e-3 - 75e-6) and inside.radius == pytest.approx(18.75e-3)
    assert outside.dry.play == pytest.approx(72e-6)
    # m (D^2 + d^2)/8 with 49.5 and 40.5 mm.
    assert outer.geometry.cage_inertia == pytest.approx(0.045 * (49.5e-3**2 + 40.5e-3**2) / 8.0, rel=1e-12)
    dry = roller_bearing(make_scene("model.guide_land=dry", UNSAMPLED)).guide
    assert type(dry.film) is NoFilm and dry.dry.play == pytest.approx(75e-6)
    assert type(roller_bearing(make_scene("cage.guidance=roller", UNSAMPLED)).guide) is NoGuide
    assert type(roller_bearing(outer).pocket.contact) is LineContactOnBar


def test_unit_scales(outer):
    """Unit: a contact's characteristic speed is its amplitude times its natural frequency."""
    bearing = roller_bearing(outer)
    scale = scales(outer)
    assert scale.load == pytest.approx(130.0)  # 1300 N over ten rollers
    assert bearing.inner.contact.stiffness * scale.length ** (10.0 / 9.0) == pytest.approx(scale.load, rel=1e-12)
    stiffness = 10.0 / 9.0 * scale.load / scale.length
    assert scale.speed == pytest.approx(scale.length * math.sqrt(stiffness / bearing.roller_mass), rel=1e-12)


def test_invariant_what_a_scene_fixes_is_worked_out_once(monkeypatch):
    """Invariant: mounting and slip scale once a scene, not once a replicate; a changed copy works out its own."""
    calls = []
    for module, name in ((fits, "operating_clearance"), (scale_module, "slip_scale")):
        real = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *given, name=name, real=real: [calls.append(name), real(*given)][1])
    scene = Scene.load(ROOT / "examples" / "all_options.toml", ["traction.elasticity=false", UNSAMPLED])
    bearing = roller_bearing(scene)
    for replicate in range(3):
        run = Run(scene, bearing, replicate, 1e-2, Stop())
        assert not run.carry.counts.any() and run.carry.clock[0] == 0.0, "a run that is made has not begun"
    race_report(scene, 100.0, 100.0)
    assert sorted(calls) == ["operating_clearance", "slip_scale"]
    tighter = scene.bearing.model_copy(update={"radial_clearance_mm": scene.bearing.radial_clearance_mm - 0.01})
    copied = scene.model_copy(update={"bearing": tighter})
    assert scene.geometry.clearance - copied.geometry.clearance == pytest.approx(1e-5, rel=1e-9)
    assert (
        scene == Scene.load(ROOT / "examples" / "all_options.toml", ["traction.elasticity=false", UNSAMPLED]) != copied
    ), "what was worked out is no part of a scene"


def test_unit_keys_in_si():
    """Unit: a key without its unit is its SI value."""
    scene = Scene.load(ROOT / "examples" / "all_options.toml")
    bearing, operation = scene.bearing, scene.operation
    assert bearing.roller_diameter == pytest.approx(bearing.roller_diameter_mm / 1e3, rel=1e-15)
    assert bearing.tilt_direction == math.radians(bearing.tilt_direction_deg)
    assert bearing.outer_waviness[0].amplitude == pytest.approx(bearing.outer_waviness[0].amplitude_um / 1e6, rel=1e-15)
    assert operation.schedule.inner_speed == pytest.approx(
        np.array(operation.schedule.inner_speed_rpm) * math.pi / 30.0
    )
    assert operation.unbalance == pytest.approx(operation.unbalance_g_mm / 1e6, rel=1e-15)
    assert (
        Bearing(**{**bearing.model_dump(), "roller_profile": "cylinder", "crown_radius_mm": None}).crown_radius is None
    )
