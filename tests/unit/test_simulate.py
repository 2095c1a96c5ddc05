"""A whole simulation: determinism, seeds, records, error bars, and what the guidance does to the cage."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from rbdyn.base.faults import InputError, RunError
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.figures import CAGE_SLIP, IMPACT_FORCE, POWER_LOSS, WHIRL_DEVIATION_RATIO
from rbdyn.dynamics.forces.state import INNER_LOAD, LAND_LOAD, LOADS, OUTER_LOAD, POCKET_CONTACT_LOAD, POCKET_LOAD
from rbdyn.dynamics.motion import history
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.run import Run
from rbdyn.dynamics.simulate import simulate
from rbdyn.dynamics.statistics.batch_means import student_chance, student_factor, student_half_width
from rbdyn.dynamics.statistics.metrics import quantity
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.losses import POWER_TERMS, POWERS, SHAFT
from rbdyn.result import Quantity, SimulationResult

# The contract of `rbdyn simulate --json`; more keys may be added.
KEYS = {
    "format", "status", "impact_force_N", "impact_contact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm", "cage_slip",
    "power_balance", "power_terms_W", "loads", "cost", "replicates", "seed", "versions", "transient_turns", "target",
    "cage_orbit_radius_share",
}  # fmt: skip
QUANTITIES = (
    "impact_force_N", "impact_contact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm", "cage_slip",
)  # fmt: skip
COST_KEYS = {"wall_s", "compile_s", "steps", "rejected_steps", "rhs_evaluations", "turns"}


def figures(result):
    """The record without what a clock says."""
    record = result.as_dict()
    del record["cost"]
    return record


def changed(scene, **numerics):
    return scene.model_copy(update={"numerics": scene.numerics.model_copy(update=numerics)})


def test_unit_workers_change_nothing(outer, outer_result):
    """Unit: any number of workers gives the same bits, and the same count of steps."""
    for workers in (2, 3):
        again = simulate(outer, workers=workers)
        assert figures(again) == figures(outer_result)
        for key in ("steps", "rejected_steps", "rhs_evaluations", "turns"):
            assert again.cost[key] == outer_result.cost[key]


def test_unit_seeds_differ(outer, outer_result):
    """Unit: another seed is another sample, and says so."""
    other = simulate(changed(outer, seed=2))
    assert other.seed == 2
    assert other.impact_force_N.value != outer_result.impact_force_N.value
    assert other.power_loss_W.value != outer_result.power_loss_W.value


def test_unit_replicates_are_independent_of_their_number(outer, outer_result):
    """Unit: the first replicate alone has a statistical error from its batches, and says that these are few."""
    one = simulate(changed(outer, replicates=1))
    assert one.power_loss_W.statistical_error > 0.0
    assert one.power_loss_W.effective_samples <= 4.0
    assert any("fewer than 10 effective samples" in note for note in one.notes)
    window = simulate(changed(outer, replicates=1, impact_window_turns=4.0))
    assert window.as_dict()["impact_force_N"]["statistical_error"] is None
    # Two values a, b: mean of both lies half way between.
    assert outer_result.power_loss_W.value != one.power_loss_W.value
    assert outer_result.power_loss_W.statistical_error is not None


def test_unit_companions_give_a_numerical_error(outer, outer_result):
    """Unit: with companions there is a numerical error, and the values stay those of the asked tolerance."""
    both = simulate(changed(outer, companion=True))
    assert both.power_loss_W.value == outer_result.power_loss_W.value
    assert both.impact_force_N.numerical_error > 0.0
    assert outer_result.impact_force_N.numerical_error is None
    # Of the loss the power balance tells a part without companions.
    assert both.power_loss_W.numerical_error > outer_result.power_loss_W.numerical_error > 0.0
    # A quarter of the replicates, at least one.
    assert both.cost["turns"] == outer_result.cost["turns"] + 4 + 2


def test_unit_a_failing_companion_leaves_the_figures(outer, outer_result, monkeypatch):
    """Unit: where only a companion cannot go on, figures stay and the note says why there is no numerical error."""
    import rbdyn.dynamics.recording as module

    class Failing(module.Run):
        def to(self, turns):
            if self.rtol > outer.numerics.rtol:
                raise RunError("replicate 1 stopped")
            super().to(turns)

    monkeypatch.setattr(module, "Run", Failing)
    alone = simulate(changed(outer, companion=True))
    assert alone.impact_force_N == outer_result.impact_force_N
    assert any("not estimated" in note and "replicate 1 stopped" in note for note in alone.notes)


def test_unit_json_keys_and_values(outer_result):
    """Unit: keys, their form, and plain JSON without NaN."""
    record = json.loads(json.dumps(outer_result.as_dict(), allow_nan=False))
    assert record.keys() >= KEYS
    assert (record["format"], record["status"]) == ("rbdyn.simulation/5", "ok")
    for name in QUANTITIES:
        keys = {"value", "statistical_error", "numerical_error", "effective_samples", "degrees_of_freedom"}
        assert record[name].keys() == keys
    assert record["power_balance"].keys() >= {"relative_gap"}
    assert record["loads"].keys() >= {"max_inner_N", "max_outer_N"}
    assert record["cost"].keys() >= COST_KEYS
    assert set(record["power_terms_W"]) == set(POWER_TERMS)
    assert record["cost"]["turns"] == 2 * (4 + 2)
    # The terms are the same means, summed in another order.
    assert sum(record["power_terms_W"].values()) == pytest.approx(record["power_loss_W"]["value"], rel=1e-12)


def test_unit_figures_of_the_shared_scene(outer_result):
    """Unit: figures are those of 48 seeds of this scene (24 either way round), within five of their standard deviations."""
    assert outer_result.impact_force_N.value == pytest.approx(93.0, abs=5.0 * 1.5)
    # Without a film the contact is all there is on a wall.
    assert outer_result.impact_contact_force_N == outer_result.impact_force_N
    assert outer_result.power_loss_W.value == pytest.approx(238.07, abs=5.0 * 0.18)
    assert outer_result.cage_slip.value == pytest.approx(0.011614, abs=5.0 * 2e-5)
    assert outer_result.power_balance.relative_gap < 1e-5
    assert outer_result.loads.max_inner_N == pytest.approx(725.0, abs=5.0 * 4.1)
    # The centrifugal force of a roller.
    assert outer_result.loads.max_outer_N - outer_result.loads.max_inner_N == pytest.approx(54.0, abs=0.3)


def test_unit_saved_result_comes_back(outer_result, tmp_path):
    """Unit: save and load are inverse; foreign and missing files are refused with a sentence."""
    path = tmp_path / "result.json"
    outer_result.save(path)
    assert SimulationResult.load(path) == outer_result
    assert list(tmp_path.iterdir()) == [path]
    import rbdyn

    assert rbdyn.load(str(path)) == outer_result
    for text, words in (
        ("{}", "not a saved simulation result"),
        ("nonsense", "not a saved"),
        ('{"format": "x/1"}', "format is x/1"),
    ):
        path.write_text(text)
        with pytest.raises(InputError, match=words):
            SimulationResult.load(path)
    with pytest.raises(InputError, match="cannot be read"):
        SimulationResult.load(tmp_path / "none.json")


def test_unit_scene_inside_the_result_runs_again(outer, outer_result):
    """Unit: the scene that a result carries is complete: it is the scene that gave it."""
    from rbdyn.scene import Scene

    assert Scene.from_dict(json.loads(json.dumps(outer_result.scene))) == outer


def test_unit_impact_windows(outer, outer_result):
    """Unit: a longer window finds larger forces on the same paths; a window longer than the run is the run."""
    long = simulate(changed(outer, impact_window_turns=100.0))
    short = simulate(changed(outer, impact_window_turns=1.0))
    assert long.impact_window_turns == 4.0
    assert short.impact_force_N.value < outer_result.impact_force_N.value < long.impact_force_N.value
    # Steps end at the window's ends, so paths differ by round-off and then by chaos: figures of a kind, not bits.
    assert short.power_loss_W.value == pytest.approx(outer_result.power_loss_W.value, abs=5.0 * 0.25)


def test_unit_everything_off_loses_nothing(conservative):
    """Unit: with every law off each power is exactly zero, and so is the shaft's."""
    result = simulate(changed(conservative, replicates=1))
    assert set(result.power_terms_W.values()) == {0.0}
    assert result.power_loss_W.value == 0.0
    assert result.impact_force_N.value > 0.0


def test_invariant_guidance_brakes_or_drives(outer, inner, outer_result, evaluate):
    """Invariant: an outer land brakes the cage, an inner land drives it; the cage then runs faster, never past the shaft."""
    from rbdyn.dynamics.parameters.state import start_state

    for scene, sign in ((outer, -1.0), (inner, 1.0)):
        bearing = roller_bearing(scene)
        y = start_state(scene, bearing, np.random.default_rng(0))
        # Rollers in the middle of their pockets: the land alone acts on the cage.
        assert sign * evaluate(bearing, y).dy[5 * bearing.rollers + 5] > 0.0
    driven = simulate(inner)
    assert driven.cage_speed_rpm.value > outer_result.cage_speed_rpm.value
    assert driven.cage_slip.value < outer_result.cage_slip.value
    assert driven.cage_speed_rpm.value < 24000.0


def test_invariant_reversed_shaft(outer, outer_result):
    """Invariant: the other sense of rotation is the same machine: figures of the same size, cage speed negative."""
    operation = outer.operation.model_copy(update={"inner_speed_rpm": -24000.0})
    turned = simulate(outer.model_copy(update={"operation": operation}))
    # Other starts, four turns: within five standard deviations over 24 seeds, of both.
    assert turned.cage_speed_rpm.value == pytest.approx(-outer_result.cage_speed_rpm.value, abs=5.0 * 0.25)
    assert turned.cage_slip.value == pytest.approx(outer_result.cage_slip.value, abs=5.0 * 2.6e-5)
    assert turned.power_loss_W.value == pytest.approx(outer_result.power_loss_W.value, abs=5.0 * 0.25)


@pytest.fixture(scope="module")
def past(outer):
    """The first two counted turns of the first replicate."""
    return history(outer, 2.0)


def test_unit_history_is_the_first_replicate(outer, past):
    """Unit: uniform samples of the counted turns; the cage stays in its land; walls push both ways."""
    assert len(past.time) == 2 * 512
    assert np.diff(past.time) == pytest.approx(np.full(1023, outer.turn_s / 512), rel=1e-9)
    for name in ("pocket_load", "outer_load", "inner_slip", "outer_heat", "roller_x", "azimuth"):
        assert getattr(past, name).shape == (1024, 10)
    # Dry contact indents the land by a micrometre or so.
    assert np.hypot(*past.guide_eccentricity).max() < 1.05 * outer.guide_clearance_m
    assert past.pocket_load.max() > 0.0 > past.pocket_load.min()
    assert (past.outer_x == 0.0).all() and (past.outer_y == 0.0).all()
    # From the discarded turns on, both angles grow without bound, at the speeds of shaft and cage.
    turned = past.inner_angle[-1] - past.inner_angle[0]
    assert turned == pytest.approx(2.0 * np.pi * 1023 / 512, rel=1e-9)
    assert past.inner_angle[0] == pytest.approx(2.0 * np.pi * outer.numerics.discard_turns, rel=1e-9)
    orbits = past.azimuth[-1] - past.azimuth[0]
    assert orbits == pytest.approx(np.full(10, turned * past.cage_speed.mean() / 2513.27), rel=0.02)


def test_unit_history_agrees_with_the_tally(outer, past):
    """Unit: sampled loads never pass the largest that the run keeps, and come close where loads change slowly."""
    run = Run(outer, roller_bearing(outer), 0, outer.numerics.rtol, Stop())
    run.to(outer.numerics.discard_turns)
    run.forget()
    # Steps end at the samples, as in the history: the same path, bit by bit.
    for sample in range(len(past.time)):
        run.to(outer.numerics.discard_turns + sample / outer.numerics.samples_per_turn)
    kept = run.tally.largest
    for name, index in (("outer_load", OUTER_LOAD), ("inner_load", INNER_LOAD)):
        sampled = getattr(past, name)[1:].max()
        assert 0.98 * kept[index] < sampled <= kept[index] * (1.0 + 1e-12)
    # Impacts are shorter than a sample, and the tally looks inside the steps.
    assert 0.0 < np.abs(past.pocket_load[1:]).max() <= kept[POCKET_LOAD] * (1.0 + 1e-9)
    assert past.land_load[1:].max() <= kept[LAND_LOAD] * (1.0 + 1e-12)


def test_unit_history_table(past):
    """Unit: a row a sample; every column tells its unit and holds what the arrays hold."""
    table = past.table()
    assert len(table) == len(past.time) and not table.isna().to_numpy().any()
    units = ("_s", "_um", "_rpm", "_N", "_m_s", "_rad", "_deg", "_W")
    assert [name for name in table.columns if not name.endswith(units)] == []
    assert table["cage_x_um"].to_numpy() == pytest.approx(past.cage_x * 1e6, rel=1e-12)
    assert table["cage_speed_rpm"].mean() == pytest.approx(past.cage_speed.mean() * 30.0 / np.pi, rel=1e-12)
    assert (table["pocket_3_N"].to_numpy() == past.pocket_load[:, 2]).all()
    assert (table["inner_slip_10_m_s"].to_numpy() == past.inner_slip[:, 9]).all()


def test_unit_a_result_keeps_no_time_series(outer_result):
    """Unit: nothing is stored that was not asked for: no array in a result, and a record of some kilobytes."""

    def arrays(value):
        if isinstance(value, np.ndarray):
            return 1
        if isinstance(value, dict):
            return sum(map(arrays, value.values()))
        return sum(map(arrays, value)) if isinstance(value, list | tuple) else 0

    assert arrays(list(vars(outer_result).values())) == 0
    assert len(json.dumps(outer_result.as_dict())) < 50_000


def test_unit_failing_replicate_raises(make_scene):
    """Unit: a replicate that cannot go on ends the simulation, with its number in the sentence."""
    with pytest.raises(RunError, match=r"replicate [12] \(seed 1\) stopped at t ="):
        simulate(make_scene("numerics.step_budget_per_turn=100"), workers=2)


def record_of(speeds, scene, **changes):
    """A replicate whose cage centre had these speeds [m/s]."""
    speeds = np.asarray(speeds)
    blank = Replicate(
        first=0,
        per_window=1,
        durations=np.ones(1),
        whirl=np.array([[len(speeds), speeds.sum(), (speeds**2).sum()]]),
        work=np.zeros((1, POWERS)),
        largest=np.zeros((1, LOADS)),
        cage_angle=np.array([scene.geometry.motion.cage_speed]),
        kinematic_angle=np.array([scene.geometry.motion.cage_speed]),
        energy=np.zeros(2),
        energy_scale=1.0,
        accepted_steps=1,
        rejected_steps=0,
        derivatives=7,
        cpu_s=0.0,
    )
    return replace(blank, **changes)


def test_literature_whirl_deviation_ratio(outer):
    """Literature: 0 for steady circular whirl, 0.523 for an isotropic Gaussian velocity, 0 for a cage at rest."""
    # The sum of squares loses half the digits.
    assert WHIRL_DEVIATION_RATIO.value(record_of(np.full(1000, 0.3), outer)) == pytest.approx(0.0, abs=1e-7)
    velocity = np.random.default_rng(0).normal(size=(2, 400_000))
    # Standard error of the ratio of 400000 samples: 6e-4.
    ratio = WHIRL_DEVIATION_RATIO.value(record_of(np.hypot(*velocity), outer))
    assert ratio == pytest.approx(math.sqrt(4.0 / math.pi - 1.0), abs=3e-3)
    assert ratio == pytest.approx(0.523, abs=3e-3)
    assert WHIRL_DEVIATION_RATIO.value(record_of(np.zeros(10), outer)) == 0.0
    speeds = np.random.default_rng(1).uniform(0.1, 0.9, 50)
    expected = speeds.std(ddof=1) / speeds.mean()
    assert WHIRL_DEVIATION_RATIO.value(record_of(speeds, outer)) == pytest.approx(expected, rel=1e-12)


def test_unit_replicate_figures(outer):
    """Unit: means over windows, slip, and the gap of the power balance."""
    work = np.zeros((2, POWERS))
    work[:, 0], work[:, 2], work[:, SHAFT] = 1.5, 0.5, 2.5
    loads = np.zeros((2, LOADS))
    loads[:, POCKET_LOAD] = 10.0, 20.0
    loads[:, POCKET_CONTACT_LOAD] = 8.0, 3.0
    run = record_of(
        [1.0],
        outer,
        durations=np.ones(2),
        work=work,
        energy=np.array([0.0, 5.0, 0.9]),
        largest=loads,
        cage_angle=np.full(2, 0.5 * outer.geometry.motion.cage_speed),
        kinematic_angle=np.full(2, outer.geometry.motion.cage_speed),
    )
    assert (IMPACT_FORCE.value(run), POWER_LOSS.value(run)) == (15.0, 2.0)
    assert list(run.windows(POCKET_CONTACT_LOAD)) == [8.0, 3.0] and list(run.windows(POCKET_LOAD)) == [10.0, 20.0]
    assert run.power("outer_race_traction") == 1.5
    assert run.power_gap == pytest.approx(0.02)
    assert CAGE_SLIP.value(run) == pytest.approx(0.5)
    later = run.counted_from(1)
    assert (IMPACT_FORCE.value(later), later.duration) == (20.0, 1.0)
    assert later.missing_work == pytest.approx(2.5 - 2.0 + 4.1)


def test_oracle_student_coverage():
    """Oracle: intervals of eight normal values hold the mean 95 times in a hundred; against scipy's own."""
    from scipy import stats

    samples = np.random.default_rng(7).normal(3.0, 2.0, size=(4000, 8))
    widths = np.array([student_half_width(values) for values in samples])
    coverage = (np.abs(samples.mean(axis=1) - 3.0) < widths).mean()
    assert coverage == pytest.approx(0.95, abs=0.014)  # four standard errors of 4000 trials
    low, high = stats.t.interval(0.95, 7, samples[0].mean(), stats.sem(samples[0]))
    assert widths[0] == pytest.approx(0.5 * (high - low), rel=1e-10)
    assert student_half_width(np.array([1.0])) is None
    for freedom in (1, 2, 3, 4, 15, 200, 9999):
        # scipy 1.14 itself is off by 2e-11 at one degree of freedom.
        assert student_factor(freedom) == pytest.approx(stats.t.ppf(0.975, freedom), rel=1e-10)
        assert student_chance(-2.3, freedom) == pytest.approx(2.0 * stats.t.sf(2.3, freedom), rel=1e-9)


def test_unit_quantity(outer):
    """Unit: the statistical error of independent replicates is Student's; the numerical one comes from companions."""

    def series(*forces):
        loads = np.zeros((len(forces), 1, LOADS))
        loads[:, 0, POCKET_LOAD] = forces
        return [record_of([1.0], outer, largest=each) for each in loads]

    runs = series(1.0, 2.0, 3.0)
    found = quantity(IMPACT_FORCE, runs, series(11.0, 12.0, 13.0), 1.0 / 9.0, 0.0, 2.0)
    assert found.value == 4.0
    student = 4.302652729911275 / math.sqrt(3.0)  # t(2, 0.975)
    assert found.statistical_error == pytest.approx(2.0 * student)
    assert found.numerical_error == pytest.approx(2.0 * math.hypot(10.0, math.sqrt(2.0 / 3.0)) / 9.0)
    slow = quantity(IMPACT_FORCE, runs, [], 1.0, 3.0)
    assert slow.statistical_error == pytest.approx(math.hypot(student, 3.0)) and slow.numerical_error is None
    assert quantity(POWER_LOSS, runs, [], 1.0, 0.0, balanced=True).numerical_error == 0.0
    assert str(Quantity(2.0, None, None, 1.0)) == "2"
    assert "(numerical)" in str(found)
