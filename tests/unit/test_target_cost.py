"""What a run to a target accuracy costs: pilots and earlier runs of its loop count."""

import time

import pytest

from rbdyn.dynamics.recording import run_series
from rbdyn.dynamics.simulate import simulate
from rbdyn.dynamics.target import LADDER, PILOT_REPLICATES, PILOT_TURNS


def test_cost_of_a_run_to_a_target_is_that_of_pilots_and_all_runs(outer, monkeypatch):
    """Invariant: the cost told is the sum over every replicate integrated on the way, and no less than what a clock
    around them says."""
    runs, results = [], []

    def series(*arguments):
        found = run_series(*arguments)
        runs.extend(run for each in found for run in each)
        return found

    def watched(*arguments, **named):
        results.append(simulate(*arguments, **named))
        return results[-1]

    monkeypatch.setattr("rbdyn.dynamics.target.run_series", series)
    monkeypatch.setattr("rbdyn.dynamics.simulate.simulate", watched)
    numbers = {"impact_window_turns": 10.0, "discard_turns": 5.0}
    scene = outer.model_copy(update={"numerics": outer.numerics.model_copy(update=numbers)})
    started = time.perf_counter()
    result = simulate(scene, workers=1, target=0.2)
    took = time.perf_counter() - started
    cost, last = result.cost, results[-1].cost
    assert result.target.runs == len(results) >= 1 and len(runs) == len(LADDER) * PILOT_REPLICATES
    sums = {
        "cpu_s": sum(run.cpu_s for run in runs),
        "steps": sum(run.accepted_steps for run in runs),
        "rejected_steps": sum(run.rejected_steps for run in runs),
        "rhs_evaluations": sum(run.derivatives for run in runs),
        "turns": len(runs) * (PILOT_TURNS + 5.0),
    }
    for key, pilots in sums.items():
        assert cost[key] == pytest.approx(pilots + sum(each.cost[key] for each in results)), key
    assert cost["rhs_evaluations"] == result.target.rhs_evaluations > last["rhs_evaluations"]
    assert cost["cpu_s"] <= cost["wall_s"] + cost["compile_s"] <= took
    assert cost["wall_s"] > sum(each.cost["wall_s"] for each in results) + 0.8 * sums["cpu_s"]
    assert set(cost) == set(last) and cost["eigenvalue_1_s"] == last["eigenvalue_1_s"]
