"""The motion that goes into a report: light, and the motion that was computed."""

import json

import numpy as np
import pytest

from doe.clearance import FRAMES, ORBIT_POINTS, drawn_motion
from rbdyn.dynamics.motion import history


@pytest.fixture(scope="module")
def recorded(outer):
    """A motion of four turns and its record."""
    motion = history(outer, 4.0, samples_per_turn=1024)
    return motion, drawn_motion(motion)


def test_orbit_is_that_of_the_cage_in_its_guide(recorded):
    motion, record = recorded
    x, y = motion.guide_eccentricity
    orbit = dict(zip("xy", map(np.array, record.orbit_um), strict=True))
    assert ORBIT_POINTS / 2 < len(orbit["x"]) == len(orbit["y"]) <= ORBIT_POINTS
    every = -(-len(x) // ORBIT_POINTS)
    assert np.abs(orbit["x"] - 1e6 * x[::every]).max() <= 0.005 + 1e-9
    assert np.abs(orbit["y"] - 1e6 * y[::every]).max() <= 0.005 + 1e-9
    # Diametral clearance 0.15 mm.
    assert record.guide_radius_um == 75.0


def test_frames_are_few_and_about_the_largest_pocket_force(recorded):
    motion, record = recorded
    moving = record.moving
    assert 0.8 * FRAMES <= moving["frames"] <= FRAMES
    start, end = moving["time_us"][0], moving["time_us"][-1]
    assert end - start == pytest.approx(2.0 * moving["turn_s"] * 1e6, rel=0.02)
    peak = 1e6 * motion.time[np.abs(motion.pocket_load).max(axis=1).argmax()]
    assert start <= peak <= end
    angles = np.unwrap(moving["cage_angle"])
    assert (np.diff(angles) > 0.0).all()


def test_record_is_light(recorded):
    _, record = recorded
    assert len(json.dumps(record, allow_nan=False)) < 200_000
