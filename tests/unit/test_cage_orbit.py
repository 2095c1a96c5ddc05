"""The radius of the cage's orbit: closed forms, what a result and a study say of a jitter, and the sums behind it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from short_studies import short_study

from doe.workflow.confirmation import Choice, confirmed_from, whirl_sentence
from doe.workflow.problem import Problem
from rbdyn.dynamics.figures import BEARING
from rbdyn.dynamics.forces.state import LOADS
from rbdyn.dynamics.integrators.advance import WHIRL, book_whirl
from rbdyn.dynamics.motion import history
from rbdyn.dynamics.recording import PLACE_SUMS, SPEED_SUMS
from rbdyn.dynamics.simulate import simulate
from rbdyn.dynamics.statistics.metrics import quantity, whirl_notes
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.losses import POWERS
from rbdyn.result import JITTER, Quantity

# Radial guide clearance 150 um.
WIDE = "cage.guide_clearance_mm=0.3"
RADIUS = 150e-6


def run_at(places, batches=10):
    """A replicate whose cage centre was at ``places`` (2, samples) [m], sampled in equal batches."""
    x, y = (np.split(coordinate, batches) for coordinate in places)
    sums = [(one.size, one.sum(), two.sum(), (one**2 + two**2).sum()) for one, two in zip(x, y, strict=True)]
    still = np.ones(batches)
    return Replicate(
        0, 1, still, np.tile((1.0, 1.0, 1.0), (batches, 1)), np.zeros((batches, POWERS)), np.zeros((batches, LOADS)),
        still, still, np.zeros(batches + 1), 1.0, 1, 0, 1, 0.0, orbit=np.array(sums),
    )  # fmt: skip


def orbit_radius_share(scene, runs):
    """Radius of the orbit over the play of the cage, with its errors."""
    (figure,) = (one for one in BEARING if one.key == "cage_orbit_radius_share")
    scale = figure.scale_in(scene)
    return None if scale is None else quantity(figure.statistic, runs, [], 0.0, 0.0, scale)


def circle(share, turns=100, samples=20_000, centre=(0.0, 0.0)):
    """Places of a centre that goes round ``centre`` at a share of the clearance."""
    angle = 2.0 * math.pi * turns * np.arange(samples) / samples
    return share * RADIUS * np.array([np.cos(angle), np.sin(angle)]) + np.array(centre)[:, None]


def noise(size, centre, seed=0, samples=20_000):
    """Places scattered about ``centre`` with a root mean square distance of ``size`` [m]."""
    scatter = np.random.default_rng(seed).normal(scale=size / math.sqrt(2.0), size=(2, samples))
    return scatter + np.array(centre)[:, None]


def test_unit_circle_is_a_whirl(make_scene):
    """Unit: a circle at 0.9 of the clearance has that radius, wherever its centre is, and no note."""
    scene = make_scene(WIDE)
    for centre in ((0.0, 0.0), (3e-6, -5e-6)):
        share = orbit_radius_share(scene, [run_at(circle(0.9, centre=centre))])
        assert share.value == pytest.approx(0.9, rel=1e-9)
        assert whirl_notes(scene, share) == ()


def test_unit_noise_at_a_resting_place_is_a_jitter(make_scene):
    """Unit: 2 um about a place at 0.87 of 150 um is a jitter of 0.0133, and so is it about several places of as many runs."""
    scene = make_scene(WIDE)
    places = [(-0.76 * RADIUS, 0.42 * RADIUS), (0.0, 0.0), (0.87 * RADIUS, 0.0)]
    runs = [run_at(noise(2e-6, place, seed)) for seed, place in enumerate(places)]
    for some in (runs[:1], runs):
        share = orbit_radius_share(scene, some)
        # 20000 samples: half a per cent.
        assert share.value == pytest.approx(2e-6 / RADIUS, rel=0.01)
        assert share.statistical_error < 0.05 * share.value
        (note,) = whirl_notes(scene, share)
        assert "the cage does not whirl" in note and "radius is 2 um, 0.013 of the radial guide clearance" in note


def test_unit_threshold(make_scene):
    """Unit: the note ends where the radius reaches the threshold."""
    scene = make_scene(WIDE)
    for factor, noted in ((0.99, 1), (1.01, 0)):
        share = orbit_radius_share(scene, [run_at(circle(factor * JITTER))])
        assert len(whirl_notes(scene, share)) == noted


def test_unit_play_of_other_guidances(make_scene):
    """Unit: rollers guide a cage within half the play of their pocket lips, which counts both ways; without a land there is no play and no share."""
    lips = make_scene("cage.guidance=roller", "cage.pocket_radial_clearance_mm=0.30")
    assert lips.guide_clearance_m is None and lips.cage_play_m == pytest.approx(RADIUS)
    share = orbit_radius_share(lips, [run_at(noise(2e-6, (0.0, 0.0)))])
    assert share.value == pytest.approx(2e-6 / RADIUS, rel=0.01)
    assert "of the radial clearance in its pockets" in whirl_notes(lips, share)[0]
    loose = make_scene("model.guide_land=off")
    assert loose.cage_play_m is None and orbit_radius_share(loose, [run_at(circle(0.5))]) is None
    assert whirl_notes(loose, None) == ()


def test_unit_bookkeeping():
    """Unit: the kernel adds up speeds and places; interpreted, for the oracle below runs it compiled."""
    samples = np.random.default_rng(2).normal(size=(50, 4))
    x, y, vx, vy = samples.T
    expected = {
        SPEED_SUMS: (50.0, np.hypot(vx, vy).sum(), (vx**2 + vy**2).sum()),
        PLACE_SUMS: (50.0, x.sum(), y.sum(), (x**2 + y**2).sum()),
    }
    sums = np.zeros(WHIRL)
    for sample in samples:
        book_whirl.py_func(sums, *sample)
    for columns, values in expected.items():
        assert sums[list(columns)] == pytest.approx(values, rel=1e-12)


def test_oracle_share_is_that_of_the_motion(make_scene):
    """Oracle: a result's share is that of the sampled history; the example's cage trembles at one place, and says so."""
    keys = ("numerics.replicates=1", "numerics.turns=5", "numerics.extend_limit=1", "numerics.companion=false")
    scene = make_scene(*keys)
    result = simulate(scene)
    motion = history(scene, 5.0)
    share = math.sqrt(motion.cage_x.var() + motion.cage_y.var()) / scene.guide_clearance_m
    # A history ends its steps at its samples: trajectories part within half a turn, statistics do not.
    assert result.cage_orbit_radius_share.value == pytest.approx(share, rel=0.1)
    assert share < JITTER and result.jitters
    assert sum("does not whirl" in note for note in result.notes) == 1
    assert type(result).from_dict(result.as_dict()).cage_orbit_radius_share == result.cage_orbit_radius_share
    x, y = motion.guide_eccentricity
    turned = np.unwrap(np.arctan2(y, x))
    assert abs(turned[-1] - turned[0]) < 0.1 * math.pi


def test_unit_circling_cage_has_no_note(make_scene):
    """Unit: with hardly a load at 60000 rpm the cage goes round its guide, and the result says nothing."""
    scene = make_scene(
        "operation.inner_speed_rpm=60000", "operation.radial_load_N=50", "numerics.replicates=1", "numerics.turns=20",
        "numerics.discard_turns=20", "numerics.extend_limit=1", "numerics.companion=false",
    )  # fmt: skip
    result = simulate(scene)
    assert result.cage_orbit_radius_share.value > 2.0 * JITTER and not result.jitters
    assert not any("does not whirl" in note for note in result.notes)


def test_unit_study_says_whose_whirl_is_a_jitter(tmp_path, outer_result):
    """Unit: only a study with a goal for the whirl speaks of it, and names the points."""
    study = Problem.load(short_study(tmp_path))
    idle = Problem.load(short_study(tmp_path, replace=('"quadratic"\ngoal = "min"', '"quadratic"\ngoal = "none"')))

    def point(share):
        orbit = {} if share is None else {"cage_orbit_radius_share": Quantity(share, 0.1 * share, None, 10.0, 9)}
        others = {key: one for key, one in outer_result.figures.items() if key != "cage_orbit_radius_share"}
        result = replace(outer_result, figures=others | orbit)
        return confirmed_from(study, Choice(study.baseline, "a test"), result)

    both = {"baseline": point(0.016), "pick": point(0.02)}
    found = whirl_sentence(study, both)
    assert "does not whirl" in found
    assert found.endswith("(orbit over clearance: baseline 0.016, selected design 0.02).")
    assert whirl_sentence(study, both | {"pick": point(0.9)}).endswith("(orbit over clearance: baseline 0.016).")
    assert whirl_sentence(study, dict.fromkeys(both, point(0.9))) == ""
    assert whirl_sentence(study, dict.fromkeys(both, point(None))) == ""
    assert whirl_sentence(idle, both) == ""


def test_unit_unknown_share_is_no_jitter(outer_result):
    """Unit: a result saved without the share, or of a cage without a play, claims nothing."""
    record = outer_result.as_dict()
    del record["cage_orbit_radius_share"]
    old = type(outer_result).from_dict(record)
    assert old.cage_orbit_radius_share is None and not old.jitters
    assert isinstance(outer_result.cage_orbit_radius_share, Quantity)
