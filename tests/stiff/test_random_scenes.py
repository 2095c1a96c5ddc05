"""Two hundred random extreme roller scenes under random laws: each ends with a result, a sentence or its budget."""

import math

import numpy as np
import pytest

from rbdyn.accuracy.variants import OPTIONS
from rbdyn.base.faults import InputError, RunError
from rbdyn.dynamics.simulate import simulate
from rbdyn.scene import Scene

EXAMPLE = "examples/cylindrical_roller.toml"
# A set of laws is compiled once and serves many scenes.
LAWS = 8
SHORT = (
    "numerics.turns=0.5",
    "numerics.discard_turns=0.25",
    "numerics.replicates=1",
    "numerics.companion=false",
    "numerics.extend=false",
    "numerics.impact_window_turns=0.25",
    "numerics.step_budget_per_turn=20000",
)


def laws(draw):
    """Two to four options of a bearing at random; the same keys are not set twice."""
    chosen = {}
    for name in draw.permutation(sorted(OPTIONS))[: draw.integers(2, 5)]:
        for assignment in OPTIONS[name]:
            chosen.setdefault(assignment.split("=")[0], assignment)
    return list(chosen.values())


def scene(draw):
    """Assignments of a bearing of any size, clearance, speed, load and oil, each far beyond what is usual."""
    diameter = math.exp(draw.uniform(math.log(2.0), math.log(60.0)))
    rollers = int(draw.integers(5, 41))
    pitch = rollers * diameter * draw.uniform(1.15, 2.0) / math.pi
    length = diameter * draw.uniform(0.6, 2.0)
    speed = math.exp(draw.uniform(math.log(20.0), math.log(2e6 / pitch)))
    load = math.exp(draw.uniform(math.log(1.0), math.log(40.0 * diameter * length * rollers)))
    numbers = {
        "bearing.rollers": rollers,
        "bearing.roller_diameter_mm": diameter,
        "bearing.roller_length_mm": length,
        "bearing.effective_length_mm": 0.9 * length,
        "bearing.pitch_diameter_mm": pitch,
        "bearing.radial_clearance_mm": diameter * draw.uniform(-5e-4, 1e-2),
        "cage.guide_clearance_mm": diameter * draw.uniform(2e-3, 0.1),
        "cage.pocket_clearance_mm": diameter * draw.uniform(1e-3, 0.1),
        "operation.inner_speed_rpm": speed,
        "operation.radial_load_N": load,
        "lubricant.temperature_C": draw.uniform(-20.0, 150.0),
        "numerics.rtol": 10.0 ** draw.uniform(-4.0, -1.3),
    }
    return [
        f"{key}={value!r}" if isinstance(value, int) else f"{key}={float(value)!r}" for key, value in numbers.items()
    ]


def ending(assignments):
    """How a scene ends: "refused", "stopped", or "done" with its power gap and notes."""
    try:
        result = simulate(Scene.load(EXAMPLE, assignments), workers=1)
    except InputError as error:
        assert error.faults and all(fault and "\n" not in fault for fault in error.faults)
        return "refused", 0.0, ()
    except RunError as error:
        assert len(str(error)) > 40 and "\n" not in str(error)
        return "stopped", 0.0, ()
    figures = (result.impact_force_N, result.whirl_deviation_ratio, result.power_loss_W, result.cage_speed_rpm)
    assert all(math.isfinite(figure.value) for figure in figures)
    return "done", result.power_balance.relative_gap, result.notes


@pytest.mark.slow
def test_random_extreme_scenes_end_with_a_word(fuzz_cases):
    """Invariant: no NaN, no traceback, and no balance open by more than a per cent of which the result says nothing.

    Twice as many scenes as the cases of other fuzz tests, which also seed them.
    """
    scenes = 2 * fuzz_cases
    draw = np.random.default_rng(20261122 + scenes - 200)
    ends = []
    for _ in range(LAWS):
        chosen = laws(draw)
        for _ in range(scenes // LAWS):
            assignments = [*SHORT, *scene(draw), *chosen]
            end, gap, notes = ending(assignments)
            assert gap <= 0.01 or any("power balance" in note for note in notes), assignments
            ends.append(end)
    assert len(ends) == scenes // LAWS * LAWS
    # Most of these run: a battery that is refused tests nothing.
    assert ends.count("done") > scenes // 4, {end: ends.count(end) for end in set(ends)}
