"""Verdict on a cage: synthetic orbits of known measures, and shares of known counts."""

import numpy as np
import pytest

from rbdyn.verdict.orbits import (
    Forcing,
    Orbit,
    Share,
    Thresholds,
    Trial,
    cage_verdict,
    class_shares,
    mean_measures,
    orbit_class,
    orbit_measures,
    verdict,
)

PLAY = 100e-6
TURNS = np.arange(64 * 10) / 64


def bouncing(seed=7):
    """A cage that flies from wall to wall of its circle in chords of any direction."""
    angles = np.cumsum(np.random.default_rng(seed).uniform(0.6, 1.4, 160) * np.pi)
    return PLAY * np.interp(np.arange(640) / 4, np.arange(160), np.exp(1j * angles))


def test_a_cage_at_rest_is_held():
    orbit = orbit_measures(np.full(640, 0.9 * PLAY + 0j), PLAY)
    assert (orbit.offset, orbit.radius) == (pytest.approx(0.9), pytest.approx(0, abs=1e-12))
    assert orbit_class(orbit, Forcing(), Thresholds()) == "held"


@pytest.mark.parametrize(
    ("rate", "orders", "name"),
    [
        (0.47, (1,), "circling"), (-0.1, (1,), "circling"), (2.57, (1,), "fast whirl"), (2.57, (1, 2.6), "circling"),
        (-3, (1,), "fast whirl"),
    ],
)  # fmt: skip
def test_a_steady_circle_has_its_rate(rate, orders, name):
    orbit = orbit_measures(0.8 * PLAY * np.exp(2j * np.pi * rate * TURNS), PLAY)
    assert orbit.radius == pytest.approx(0.8, rel=0.1)
    assert orbit.rate == pytest.approx(rate, rel=0.02, abs=0.02)
    assert orbit.concentration > 0.9
    assert orbit_class(orbit, Forcing(orders), Thresholds()) == name


def test_a_bouncing_cage_is_judged_by_its_turnover():
    orbit = orbit_measures(bouncing(), PLAY)
    assert orbit.radius > 0.3 > orbit.offset and orbit.concentration < 0.6
    forcing = Forcing(turnover=5)
    assert orbit_class(orbit, forcing, Thresholds()) == "not judged"
    assert orbit_class(orbit, forcing, Thresholds(rattling_turnover=1)) == "rattling"
    assert orbit_class(orbit, forcing, Thresholds(rattling_turnover=10)) == "wandering"


def test_a_forced_oscillation_about_an_offset_is_held():
    assert orbit_class(Orbit(offset=0.79, radius=0.5, concentration=1, rate=1), Forcing(), Thresholds()) == "held"


@pytest.mark.parametrize(
    ("replicates", "share", "name"), [(8, 0.895, "held"), (6, 0.867, "held"), (5, 0.846, "undecided")]
)
def test_replicates_alike_name_a_class_from_six(replicates, share, name):
    found = class_shares(["held"] * replicates)["held"]
    assert found.mean == pytest.approx(share, abs=5e-4) and found.low < found.mean < found.high <= 1
    assert verdict(class_shares(["held"] * replicates), Thresholds()) == name
    assert verdict(class_shares(["held"] * (replicates - 1) + ["circling"]), Thresholds()) == "undecided"


def test_fewest_replicates_follow_from_the_least_share():
    """Six alike bear the default of 0.85, and five do not."""
    assert Thresholds().fewest_replicates == 6
    for share in (0.6, 0.7, 0.9, 0.95):
        limits = Thresholds(least_share=share)
        needed = limits.fewest_replicates
        assert verdict(class_shares(["held"] * needed), limits) == "held"
        assert verdict(class_shares(["held"] * (needed - 1)), limits) == "undecided"


def test_a_longer_orbit_has_the_measures_of_a_shorter_one():
    """Blocks have one length: a circle with noise measures alike over 16 and 160 cage turns, at any rate of samples."""
    random = np.random.default_rng(3)

    def noisy(turns, samples_per_turn):
        times = np.arange(round(turns * samples_per_turn)) / samples_per_turn
        noise = random.normal(size=(2, len(times))) * 0.05
        circle = np.exp(2j * np.pi * 0.8 * times) + noise[0] + 1j * noise[1]
        return mean_measures(0.8 * PLAY * circle, PLAY, samples_per_turn)

    short, long, dense = noisy(16.6, 64), noisy(160, 64), noisy(16.6, 171.3)
    for other in (long, dense):
        assert short.radius == pytest.approx(other.radius, rel=0.01)
        assert short.rate == pytest.approx(other.rate, abs=0.01)
        assert short.concentration == pytest.approx(other.concentration, abs=0.02)


def test_a_film_on_a_ring_that_turns_drives_a_faster_orbit():
    """Half the sum of the speeds of ring and cage: a rate of 1.6 circles where the ring of the land turns 2.4 times as fast."""
    orbit = Orbit(offset=0.0, radius=0.8, concentration=1.0, rate=1.6)
    assert orbit_class(orbit, Forcing(film_rate=1.7), Thresholds()) == "circling"
    assert orbit_class(orbit, Forcing(), Thresholds()) == "fast whirl"


def trials(*rates):
    return [Trial(Orbit(0.01, 0.8, 0.9, rate), Forcing(turnover=0.1)) for rate in rates]


def test_distances_count_in_standard_errors():
    """Rates of 1.0 and 1.4 have a mean of 1.2 and a standard error of 0.2: 7 of them above -0.2, none from 1.2."""
    found = cage_verdict(trials(1.0, 1.4), Thresholds())
    assert found.distances["lowest_rate"] == pytest.approx(7.0)
    assert found.distances["highest_rate"] == pytest.approx(0.0, abs=1e-9)
    assert "still_radius" not in found.distances, "a radius that does not scatter has no distance"
    assert found.measures["rate"] == pytest.approx((1.2, 0.2))
    assert cage_verdict(trials(1.0), Thresholds()).distances == {}


@pytest.mark.parametrize(
    ("rates", "reason", "words"),
    [
        ([1.0] * 8, None, "Cage: circling (8 of 8 replicates)"),
        ([1.0] * 5, None, "Cage: undecided (circling in 5 of 5 replicates; a class needs 6 replicates alike)"),
        (
            [1.0] * 3 + [2.0] * 5,
            None,
            "Cage: undecided (fast whirl in 5, circling in 3 of 8 replicates; two regimes last, and the start decides which)",
        ),
        ([1.0, 1.1, 1.15, 1.25, 1.3, 1.4], None, "Cage: undecided (circling in 3, fast whirl in 3 of 6 replicates)"),
        ([1.0] * 5 + [2.0], None, "Cage: undecided (circling in 5, fast whirl in 1 of 6 replicates)"),
        (
            [1.0] * 8,
            "films alone drive the rollers",
            "Cage: not judged, because films alone drive the rollers; its orbit is circling (8 of 8 replicates)",
        ),
    ],
)
def test_the_verdict_says_how_many_replicates_agree(rates, reason, words):
    assert cage_verdict(trials(*rates), Thresholds(), reason).words == words


def test_a_motion_of_no_class_names_the_key_it_lacks():
    bouncing_cage = [Trial(Orbit(0.1, 0.7, 0.2, 0.4), Forcing(turnover=0.5))] * 8
    unknown = cage_verdict(bouncing_cage, Thresholds())
    assert unknown.name == unknown.rule == "not judged" and "verdict.rattling_turnover has no value" in unknown.words
    known = cage_verdict(bouncing_cage, Thresholds(rattling_turnover=0.2))
    assert known.name == "rattling" and known.shares["rattling"] == pytest.approx(Share(0.895, 0.703, 0.994), abs=1e-3)
