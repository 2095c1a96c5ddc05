"""State of the example with tangential elasticity after a few steps of velocity Verlet: printed by a process that compiles nothing."""

import json

import numpy as np
from conftest import UNSAMPLED, make, state_near_contact
from smooth_runs import run_of

from rbdyn.dynamics.integrators import advance as at

STEPS, STEP = 5, 1e-6


def state_after_steps() -> list[float]:
    """State after ``STEPS`` equal steps from contacts that are open, closed and sliding."""
    scene = make(UNSAMPLED, "traction.elasticity=true")
    run = run_of(scene, 1e-2, "verlet")
    run.carry.y[:] = state_near_contact(scene, 7)
    run.carry.clock[at.STEP] = STEP
    control = run.control._replace(inverse_tolerance=np.zeros_like(run.control.inverse_tolerance), largest_step=STEP)
    assert at.advance(run.bearing, control, run.carry, run.tally, STEPS * STEP, 1.0) == at.FINISHED
    return [float(value) for value in run.carry.y]


if __name__ == "__main__":
    print(json.dumps(state_after_steps()))
