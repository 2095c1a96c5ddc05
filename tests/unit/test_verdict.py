"""Verdict on a cage: synthetic orbits of known measures, and shares of known counts."""

import numpy as np
import pytest

from rbdyn.verdict.orbits import Orbit, Thresholds, orbit_class, orbit_measures
from rbdyn.verdict.replicates import class_shares, verdict

PLAY = 100e-6
TURNS = np.arange(64 * 10) / 64


def bouncing(seed=7):
    """A cage that flies from wall to wall of its circle in chords of any direction."""
    angles = np.cumsum(np.random.default_rng(seed).uniform(0.6, 1.4, 160) * np.pi)
    return PLAY * np.interp(np.arange(640) / 4, np.arange(160), np.exp(1j * angles))


def test_a_cage_at_rest_is_held():
    orbit = orbit_measures(np.full(640, 0.9 * PLAY + 0j), PLAY)
    assert (orbit.offset, orbit.radius) == (pytest.approx(0.9), pytest.approx(0, abs=1e-12))
    assert orbit_class(orbit, Thresholds()) == "held"


@pytest.mark.parametrize(
    ("rate", "orders", "name"),
    [
        (0.47, (1,), "circling"),
        (-0.1, (1,), "circling"),
        (2.57, (1,), "fast whirl"),
        (2.57, (1, 2.6), "circling"),
        (-3, (1,), "fast whirl"),
    ],
)
def test_a_steady_circle_has_its_rate(rate, orders, name):
    orbit = orbit_measures(0.8 * PLAY * np.exp(2j * np.pi * rate * TURNS), PLAY)
    assert orbit.radius == pytest.approx(0.8, rel=0.1)
    assert orbit.rate == pytest.approx(rate, rel=0.02, abs=0.02)
    assert orbit.concentration > 0.9
    assert orbit_class(orbit, Thresholds(), orders) == name


def test_a_bouncing_cage_is_judged_by_its_turnover():
    orbit = orbit_measures(bouncing(), PLAY)
    assert orbit.radius > 0.3 > orbit.offset and orbit.concentration < 0.6
    assert orbit_class(orbit, Thresholds(), turnover=5) == "not judged"
    assert orbit_class(orbit, Thresholds(rattling_turnover=1), turnover=5) == "rattling"
    assert orbit_class(orbit, Thresholds(rattling_turnover=10), turnover=5) == "wandering"


def test_a_forced_oscillation_about_an_offset_is_held():
    assert orbit_class(Orbit(offset=0.79, radius=0.5, concentration=1, rate=1), Thresholds()) == "held"


@pytest.mark.parametrize(
    ("replicates", "share", "name"), [(8, 0.895, "held"), (6, 0.867, "held"), (5, 0.846, "undecided")]
)
def test_replicates_alike_name_a_class_from_six(replicates, share, name):
    found = class_shares(["held"] * replicates)["held"]
    assert found.mean == pytest.approx(share, abs=5e-4) and found.low < found.mean < found.high <= 1
    assert verdict(["held"] * replicates, Thresholds()) == name
    assert verdict(["held"] * (replicates - 1) + ["circling"], Thresholds()) == "undecided"


@pytest.mark.parametrize(("samples", "play", "fault"), [(640, 0.0, "play above 0"), (63, PLAY, "at least a cage turn")])
def test_an_orbit_that_cannot_be_judged_is_refused(samples, play, fault):
    with pytest.raises(ValueError, match=fault):
        orbit_measures(np.ones(samples, complex), play)
