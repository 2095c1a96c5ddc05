"""Trends that physics demands, each beyond the 95 % error of the difference; the default laws, only numbers changed."""

import functools
import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from rbdyn import Scene, history, simulate
from rbdyn.dynamics.forces.state import CAGE_SPEED
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import start_state

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
RUN = (
    "numerics.turns=20",
    "numerics.discard_turns=10",
    "numerics.replicates=4",
    "numerics.impact_window_turns=10",
    "numerics.companion=false",
)


@functools.cache
def result(*changes):
    return simulate(Scene.load(EXAMPLE, (*RUN, *changes)))


def assert_rises(figures):
    """Each value lies above the one before it by more than the 95 % error of their difference."""
    for low, high in pairwise(figures):
        error = math.hypot(low.statistical_error, high.statistical_error)
        assert high.value - low.value > error, f"{low} then {high}"


def test_trend_slip_rises_as_load_falls():
    """Trend: less load, less traction to pull the cage along."""
    assert_rises([result(f"operation.radial_load_N={load}").cage_slip for load in (2600, 1300, 650)])


def test_trend_slip_rises_with_speed():
    """Trend: drag and land film grow with speed, what the races can pull does not."""
    assert_rises([result(f"operation.inner_speed_rpm={n}").cage_slip for n in (6000, 12000, 24000)])


def test_trend_outer_land_brakes_and_inner_land_drives(evaluate):
    """Trend: the land film pulls the cage towards its ring's speed, so inner guidance slips less."""
    for guidance, sense in (("outer", -1.0), ("inner", 1.0)):
        scene = Scene.load(EXAMPLE, (*RUN, f"cage.guidance={guidance}"))
        bearing = roller_bearing(scene)
        y = start_state(scene, bearing, np.random.default_rng(0))
        # At the start no roller touches its pocket: the land alone turns the cage.
        assert sense * evaluate(bearing, y).dy[5 * bearing.rollers + CAGE_SPEED] > 0.0
    assert_rises([result(f"cage.guidance={guidance}").cage_slip for guidance in ("inner", "outer")])


def test_trend_wider_pockets_strike_harder():
    """Trend: a roller that may run further ahead or behind meets its pocket wall faster."""
    assert_rises([result(f"cage.pocket_clearance_mm={mm}").impact_force_N for mm in (0.2, 0.3, 0.4)])


def test_trend_power_rises_with_viscosity_and_speed():
    """Trend: films shear."""
    assert_rises([result(f"lubricant.temperature_C={celsius}").power_loss_W for celsius in (120, 100, 80)])
    assert_rises([result(f"operation.inner_speed_rpm={n}").power_loss_W for n in (6000, 12000, 24000)])


def loaded_share(clearance_mm, replicate):
    """Share of roller positions that carry the inner ring."""
    scene = Scene.load(EXAMPLE, (*RUN, f"bearing.radial_clearance_mm={clearance_mm}"))
    return float((history(scene, 3.0, replicate=replicate, samples_per_turn=48).inner_load > 0.0).mean())


def test_trend_load_zone_widens_as_clearance_shrinks():
    """Trend: half the circle carries without clearance, less with it, more under preload."""
    shares = [[loaded_share(mm, seed) for seed in range(3)] for mm in (0.04, 0.02, 0.0, -0.005)]
    for narrow, wide in pairwise(shares):
        assert max(narrow) < min(wide)
    # Static rollers without clearance load exactly the half circle; centrifugal force lifts those at its edge.
    assert 0.45 < np.mean(shares[2]) <= 0.5


@pytest.mark.slow
def test_trend_power_loss_falls_with_guide_clearance():
    """Trend: the loss falls as the guide clearance grows, for a film shears less."""
    long = ("numerics.turns=40", "numerics.replicates=8")
    assert_rises([result(*long, f"cage.guide_clearance_mm={mm}").power_loss_W for mm in (0.23, 0.15, 0.1, 0.066)])


def test_trend_cage_never_outruns_rolling():
    """Trend: with an outer land that brakes, no replicate runs faster than the epicyclic cage."""
    here = result()
    epicyclic = Scene.load(EXAMPLE).geometry.motion.cage_speed * 30.0 / math.pi
    assert here.cage_speed_rpm.value + here.cage_speed_rpm.statistical_error < epicyclic
