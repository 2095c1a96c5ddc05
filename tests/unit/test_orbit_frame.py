"""The frame that turns with the rollers: an exact change of variables that spares steps."""

import numpy as np
import pytest

from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.integrators import runge_kutta as rk
from rbdyn.dynamics.integrators.advance import ACCEPTED, FINISHED, steps_to
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.run import Run, with_numerics


@pytest.fixture
def state():
    draw = np.random.default_rng(3)
    return draw.normal(size=60), draw.normal(size=(2, 60))


@pytest.mark.parametrize("rate", [0.0, 1300.0, -2500.0])
def test_unit_turn_is_a_rotation_at_its_own_speed(rate):
    """Unit: cosine and sine lie on the circle; the speed is the rate of the angle, and at first the given rate."""
    for time in (0.0, 1e-5, 1e-3):
        turn = rk.turn_of(rate, time)
        assert turn.cosine**2 + turn.sine**2 == pytest.approx(1.0, abs=1e-15)
        early, late = (rk.turn_of(rate, time + dt) for dt in (-1e-7, 1e-7))
        angle = np.arctan2(late.sine, late.cosine) - np.arctan2(early.sine, early.cosine)
        assert angle / 2e-7 == pytest.approx(turn.speed, rel=1e-7, abs=1e-9)
    assert rk.turn_of(rate, 0.0) == (1.0, 0.0, rate)


def test_unit_rates_go_to_the_frame_and_back(state):
    """Unit: the two changes of rates undo each other; spins, cage and rings are left alone."""
    y, dy = state
    before, turn = dy.copy(), rk.turn_of(900.0, 3e-4)
    rk.rates_to_frame(turn, 10, y, 1, dy)
    assert (dy[0] == before[0]).all() and (dy[1, 40:] == before[1, 40:]).all()
    assert np.abs(dy[1, :40] - before[1, :40]).min() > 0.0
    rk.rates_to_fixed_axes(turn, 10, y, 1, dy)
    assert dy[1] == pytest.approx(before[1], abs=1e-12 * 900.0)


def test_unit_rollers_that_orbit_stand_still_in_the_frame():
    """Unit: a rigid turn has the frame's rate and no rates in it; turned on, it is where the orbit has come to."""
    rate, z, radius = 1200.0, 10, 0.02175
    angles = 2.0 * np.pi * np.arange(z) / z
    y = np.concatenate(
        (
            *(radius * f(angles) for f in (np.cos, np.sin)),
            -rate * radius * np.sin(angles),
            rate * radius * np.cos(angles),
        )
    )
    assert rk.mean_orbit_rate(z, y) == pytest.approx(rate, rel=1e-14)
    dy = np.concatenate((y[2 * z :], -(rate**2) * y[: 2 * z]))[None, :]
    rk.rates_to_frame(rk.turn_of(rate, 0.0), z, y, 0, dy)
    assert np.abs(dy[0, : 2 * z]).max() < 1e-13 * rate * radius
    assert np.abs(dy[0, 2 * z :]).max() < 1e-13 * rate**2 * radius
    turn = rk.turn_of(rate, 1e-4)
    moved = y.copy()
    rk.to_fixed_axes(turn, z, moved)
    ahead = angles + np.arctan2(turn.sine, turn.cosine)
    assert moved[:z] == pytest.approx(radius * np.cos(ahead), abs=1e-16)
    assert moved[z : 2 * z] == pytest.approx(radius * np.sin(ahead), abs=1e-16)


def test_invariant_frame_changes_no_solution(outer, monkeypatch):
    """Invariant: the same state at the end, however fast the frame turns; one that does not turn costs more steps."""
    ends, steps, scene = [], [], with_numerics(outer, method="rk45")
    for factor in (1.0, 0.0, -0.5):

        def begin_step(z, y, k, factor=factor):
            rate = factor * rk.mean_orbit_rate(z, y)
            rk.rates_to_frame(rk.turn_of(rate, 0.0), z, y, 0, k)
            return rate

        monkeypatch.setattr(rk, "begin_step", begin_step)
        run = Run(scene, roller_bearing(scene), 0, 1e-9, Stop())
        t_end = 0.02 * outer.turn_s
        status = steps_to.py_func(run.bearing, run.control, run.carry, run.tally, t_end, 1.0)
        assert status == FINISHED
        ends.append(run.carry.y.copy())
        steps.append(run.carry.counts[ACCEPTED])
    scale = 1e9 / run.control.inverse_tolerance
    for end in ends[1:]:
        assert np.abs((end - ends[0]) / scale).max() < 1e-6
    assert steps[0] < steps[1] < steps[2]
