"""Relaxation times of slow motions: against slopes of the independent twin, and what a reading leaves untouched."""

import numpy as np
import pytest

from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.state import CAGE_SPEED, CAGE_VX, CAGE_VY
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import absolute_tolerance
from rbdyn.dynamics.recording import Linearised, Recording, slowest
from rbdyn.dynamics.run import Run, with_numerics
from tests.oracles.numpy_twin import twin


@pytest.mark.parametrize("method", ["rk43", "rk45", "rosenbrock"])
def test_oracle_decay_rates_are_slopes_of_the_moments(outer, method):
    """Oracle: in a state of the running bearing the rates are the twin's differences of acceleration over speed."""
    scene = with_numerics(outer, method=method)
    bearing = roller_bearing(scene)
    run = Run(scene, bearing, 0, scene.numerics.rtol, Stop())
    run.to(0.3)
    before = [part.copy() for part in run.carry if isinstance(part, np.ndarray)]
    rates = Linearised(run).decay_rates()
    after = [part for part in run.carry if isinstance(part, np.ndarray)]
    assert all(np.array_equal(old, new) for old, new in zip(before, after, strict=True))

    z, y = scene.bearing.rollers, run.carry.y
    cage = 5 * z
    step = 1e-4 * absolute_tolerance(scene, bearing, 1.0)
    motions = ([cage + CAGE_SPEED], [cage + CAGE_VX, cage + CAGE_VY], list(range(4 * z, 5 * z)))
    for rate, places in zip(rates, motions, strict=True):
        changed = y.copy()
        changed[places] += step[places]
        slopes = (twin(scene, changed).dy - twin(scene, y).dy)[places] / step[places]
        assert rate == pytest.approx(-float(np.mean(slopes)), rel=2e-2, abs=1e-3 / scene.turn_s)


def test_unit_the_slowest_motion_and_its_noise():
    """Unit: the slowest motion counts at its mean rate and one standard error; what excites itself has none."""
    rates = np.array([[0.5, 3.0, 100.0], [1.5, 5.0, 100.0]])
    found = slowest(rates)
    # Mean 1, standard error sqrt(0.5)/sqrt(2) = 0.5.
    assert found.motion == "the spin of the cage" and found.time_s == pytest.approx(1.0 / 1.5)
    assert slowest(-rates) is None
    assert slowest(rates * [-1.0, 1.0, 1.0]).motion == "the motion of the cage's centre"
    assert slowest(rates[:1]) is None and slowest(np.zeros((0, 3))) is None


def test_invariant_reading_changes_no_bit(outer):
    """Invariant: a recording that reads decay rates has the bits of one that does not."""
    scene = with_numerics(outer, turns=13.0, discard_turns=0.0, replicates=1)
    read, plain = (
        Recording(Run(scene, roller_bearing(scene), 0, 0.01, Stop()), reads_decay).to(13.0)
        for reads_decay in (True, False)
    )
    assert read.decay_rates.shape == (2, 3) and plain.decay_rates.shape == (0, 3)
    assert np.array_equal(read.work, plain.work) and np.array_equal(read.cage_angle, plain.cage_angle)
