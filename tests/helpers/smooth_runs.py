"""Runs of one replicate by a method of one's choice, and a smooth stretch on which orders of convergence show."""

import numpy as np
import pytest

from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.integrators import advance as at
from rbdyn.dynamics.integrators.advance import advance
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.run import Run


def run_of(scene, rtol, method, replicate=0):
    """A replicate at its start, to be integrated by ``method`` whatever the scene names."""
    numerics = scene.numerics.model_copy(update={"method": method})
    scene = scene.model_copy(update={"numerics": numerics})
    return Run(scene, roller_bearing(scene), replicate, rtol, Stop())


def vibrating(scene, method):
    """A start whose loaded contacts vibrate but neither open nor close within 1e-4 s: a smooth problem."""
    run = run_of(scene, 1e-6, method)
    run.carry.y[58:60] += 0.05
    return run


def fixed_step(scene, step, duration, method):
    """State after ``duration`` in steps of exactly ``step``: no error is ever too large."""
    run = vibrating(scene, method)
    control = run.control._replace(inverse_tolerance=np.zeros_like(run.control.inverse_tolerance), largest_step=step)
    run.carry.clock[at.STEP] = step
    assert advance(run.bearing, control, run.carry, run.tally, duration, 1.0) == at.FINISHED
    assert run.carry.counts[at.ACCEPTED] == pytest.approx(duration / step, abs=1.1)
    return run.carry.y
