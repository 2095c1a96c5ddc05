"""Verdict on cages of bearings by their histories: known answers of the example at 24 000 rpm."""

import numpy as np
import pytest

from rbdyn.dynamics.motion import History, history
from rbdyn.verdict.orbits import Orbit, Thresholds, orbit_class, orbit_measures

EXAMPLE = "examples/cylindrical_roller.toml"


def measured(motion: History, play: float) -> Orbit:
    """Orbit of the cage at 64 samples of each whole cage turn."""
    angle = motion.cage_angle - motion.cage_angle[0]
    even = np.arange(64 * int(angle[-1] / (2 * np.pi))) * (2 * np.pi / 64)
    return orbit_measures(np.interp(even, angle, motion.cage_x) + 1j * np.interp(even, angle, motion.cage_y), play)


@pytest.mark.parametrize(
    ("overrides", "offset", "rate", "name"),
    [
        ([], (0.86, 0.88), None, "held"),
        (["cage.imbalance_um=100"], (0.78, 0.80), (0.99, 1.01), "held"),
        (["operation.radial_load_N=0"], (0, 0.05), (0.435, 0.505), "circling"),
    ],
)
def test_the_cage_of_the_example_has_its_known_class(overrides, offset, rate, name):
    """A load holds it, with an imbalance too; without a load its film turns it at half its speed."""
    motion = history(EXAMPLE, turns=40, samples_per_turn=64, overrides=overrides)
    orbit = measured(motion, play=motion.scene.cage.guide_clearance_mm * 0.5e-3)
    assert offset[0] < orbit.offset < offset[1]
    assert rate is None or rate[0] < orbit.rate < rate[1]
    assert orbit_class(orbit, Thresholds()) == name


@pytest.mark.parametrize(
    ("friction", "rate", "name"), [(0.1, 0.92, "circling"), (0.2, 1.95, "fast whirl"), (0.3, 3.74, "fast whirl")]
)
def test_friction_of_pockets_turns_a_cage_on_its_rollers_to_fast_whirl(friction, rate, name):
    """The known instability of cages by friction: between 0.1 and 0.2 the whirl outruns the cage."""
    overrides = ["cage.guidance=roller", "bearing.radial_clearance_mm=-0.01", "operation.radial_load_N=0"]
    motion = history(EXAMPLE, 80, samples_per_turn=128, overrides=[*overrides, f"model.pocket_friction={friction}"])
    orbit = measured(motion, play=motion.scene.cage.pocket_clearance_mm * 0.5e-3)
    assert orbit.rate == pytest.approx(rate, rel=0.1)
    assert orbit_class(orbit, Thresholds()) == name


def test_a_cage_that_a_rotating_load_drives_circles_at_its_order():
    """Its rate of 2.57 would be fast whirl, were the order of the shaft not known."""
    overrides = ["operation.radial_load_N=0", "operation.rotating_load_N=1300", "model.land_friction=0.3"]
    motion = history(EXAMPLE, turns=60, samples_per_turn=128, overrides=[*overrides, "model.guide_land=dry"])
    orbit = measured(motion, play=motion.scene.cage.guide_clearance_mm * 0.5e-3)
    shaft_order = np.ptp(motion.inner_angle) / np.ptp(motion.cage_angle)
    assert orbit.rate == pytest.approx(2.57, rel=0.01)
    assert orbit_class(orbit, Thresholds(), (1, shaft_order)) == "circling"
    assert orbit_class(orbit, Thresholds()) == "fast whirl"
