"""How companions are chosen: by the steps that the runs took, and what these do to rollers that lie lightly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from rbdyn.dynamics.companions import DAMPED, DAMPING_SCALE, RESOLVED, companions_of, usual_companions
from rbdyn.dynamics.integrators import dormand_prince, kutta_pair
from rbdyn.dynamics.parameters.scales import light_contact_frequency
from rbdyn.dynamics.simulate import simulate
from rbdyn.dynamics.statistics.metrics import Replicate

SLOW = ("operation.inner_speed_rpm=2000", "operation.radial_load_N=4000")


def amplification(weights, x):
    """|R(i x)| of the pair whose rows of weights these are: its last row makes the new state."""
    stages = len(weights)
    matrix = np.zeros((stages, stages))
    matrix[:, : weights.shape[1]] = weights[:, :stages]
    slopes = np.linalg.solve(np.eye(stages) - 1j * x * matrix, np.ones(stages))
    return abs(1.0 + 1j * x * (matrix[-1] @ slopes))


@pytest.mark.parametrize(("name", "weights"), [("rk43", kutta_pair.A), ("rk45", dormand_prince.A)])
def test_oracle_damping_of_explicit_pairs(name, weights):
    """Oracle: each pair's stability function on the imaginary axis is 1 - x^6/C to leading order."""
    for x in (0.3, 0.2):
        assert 1.0 - amplification(weights, x) == pytest.approx(x**6 / DAMPING_SCALE[name], rel=1.5 * x**2)


def runs_with(scene, step, method="rk43"):
    """Two replicates of a second each that took steps of this length [s]."""
    empty = np.zeros((1, 1))
    blank = Replicate(
        0, 1, np.ones(1), empty, empty, empty, *(np.zeros(1),) * 3, 0.0, round(1.0 / step), 0, 0, 0.0, method
    )
    return [blank, replace(blank)]


def test_unit_companions_follow_the_steps(make_scene, outer):
    """Unit: long steps of an explicit pair in a slow bearing ask for companions that resolve its light contacts."""
    slow = make_scene(*SLOW)
    frequency, scale = light_contact_frequency(slow), DAMPING_SCALE["rk43"]
    assert frequency == pytest.approx(1.69e5, rel=0.01) and light_contact_frequency(outer) is None
    limit = (DAMPED * scale) ** 0.2 / frequency
    long = companions_of(slow, runs_with(slow, 1.05 * limit))
    assert long.rtol == pytest.approx(1e-3) and long.method == "rk43" and long.share == pytest.approx(10.0 / 9.0)
    assert (long.longest_step * frequency) ** 5 / scale == pytest.approx(RESOLVED)
    for scene, runs in (
        (slow, runs_with(slow, 0.95 * limit)),
        (slow, runs_with(slow, 1.05 * limit, "rosenbrock")),
        (outer, runs_with(outer, 1.05 * limit)),
    ):
        assert companions_of(scene, runs) == usual_companions(scene)
    assert usual_companions(slow).longest_step == math.inf


@pytest.mark.slow
def test_oracle_numerical_error_of_a_slow_bearing(make_scene):
    """Oracle: at 2000 rpm and 4 kN the stated numerical error of the loss holds a run at rtol 1e-6, and is no blanket."""
    length = (
        "numerics.turns=30",
        "numerics.discard_turns=10",
        "numerics.replicates=8",
        "numerics.impact_window_turns=10",
    )
    stated = simulate(make_scene(*SLOW, *length, "numerics.companion=true")).power_loss
    truth = simulate(make_scene(*SLOW, *length, "numerics.rtol=1e-6")).power_loss
    bias = stated.value - truth.value
    noise = math.hypot(stated.statistical_error, truth.statistical_error)
    assert abs(bias) > 2.0 * noise, "stability no longer holds the steps: look for another scene"
    assert abs(bias) - noise < stated.numerical_error < 2.0 * abs(bias) + noise
