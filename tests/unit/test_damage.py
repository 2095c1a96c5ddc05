"""Figures of damage: sliding and impacts of the cage."""

import json
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import EVERYTHING, ROOT
from scipy.stats import f_oneway
from short_studies import short_study

import rbdyn
from doe.clearance import responses_of
from doe.workflow.problem import Problem
from rbdyn.base.faults import InputError
from rbdyn.contact.cage_bar import CageSection, clamped_stress
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.figures import DAMAGE, sliding_over_track
from rbdyn.dynamics.forces.state import CAGE_ANGLE, ENTRY_SLIPS, SAMPLES_NUMBER
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.run import Run
from rbdyn.dynamics.statistics.extremes import (
    LARGEST_DISTANCE,
    RETURN_WINDOWS,
    chance_of_one_law,
    distance,
    moments_of,
    return_force_notes,
    return_level,
)
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene

SHORT = ("numerics.turns=4", "numerics.discard_turns=2", "numerics.replicates=3", "numerics.extend=false")


@cache
def result(*overrides: str) -> SimulationResult:
    """A short run of the example."""
    scene = ROOT / "examples" / "cylindrical_roller.toml"
    return rbdyn.simulate(scene, overrides=(*SHORT, *overrides), notice=None)


def test_sliding_is_friction_power_over_its_coefficient():
    """The coefficient times all sliding is the power of friction, of pockets and of a land without a film."""
    # The laws of a cage that a rotating load drives on a dry land, as test_verdict_of_bearings compiles them.
    load = ("operation.radial_load_N=0", "operation.rotating_load_N=1300", "numerics.companion=false")
    run = result(*load, "model.guide_land='dry'", "model.land_friction=0.08")
    scene, powers = Scene.from_dict(run.scene), run.power_terms_W
    pockets = scene.model.pocket_friction * scene.bearing.rollers * run.damage["pocket_sliding_N_m_s"].value
    assert pockets == pytest.approx(powers["pocket_friction"], rel=1e-9)
    land = 0.08 * run.damage["land_sliding_N_m_s"].value
    assert land == pytest.approx(powers["land_friction"], rel=1e-9) and land > 0.0
    assert run.damage["pocket_impact_power_W"].value == pytest.approx(powers["pocket_damping"], rel=1e-9)


def test_smaller_pockets_are_hit_with_less_power():
    """From a pocket clearance of 0.30 to 0.25 mm the sliding remains within 5 %, and the impacts lose less."""
    wide, narrow = (result(f"cage.pocket_clearance_mm={clearance}").damage for clearance in (0.30, 0.25))
    key = "pocket_sliding_N_m_s"
    assert narrow[key].value == pytest.approx(wide[key].value, rel=0.05)
    assert narrow["pocket_impact_power_W"].value < wide["pocket_impact_power_W"].value


def test_damage_is_stated_wherever_figures_are():
    """The JSON has an object of it with errors, studies may name each figure, and a saved result keeps it."""
    run = result()
    assert list(run.damage) == [figure.key for figure in DAMAGE if figure.key in run.damage]
    record = json.loads(json.dumps(run.as_dict()))
    assert record["damage"]["pocket_impact_power_W"]["statistical_error"] > 0.0
    assert SimulationResult.from_dict(record).damage == run.damage
    assert set(run.damage) <= set(run.responses) & set(responses_of(heats=False))


@pytest.mark.parametrize(
    ("override", "missing"),
    [
        ("model.pocket_friction=0", "pocket_sliding_N_m_s"),
        ("model.land_friction=0", "land_sliding_N_m_s"),
        ("model.guide_land='off'", "land_sliding_N_m_s"),
        ("model.pocket='off'", "pocket_impact_power_W"),
    ],
)
def test_a_figure_without_its_law_is_left_out(override, missing):
    """Without friction there is nothing to divide by, and without pockets there are no impacts."""
    scene = Scene.load(ROOT / "examples" / "cylindrical_roller.toml", [override])
    (figure,) = (figure for figure in DAMAGE if figure.key == missing)
    assert figure.scale_in(scene) is None


def replicates_with(windows):
    """Replicates with these largest pocket forces (replicates, windows)."""
    return [
        SimpleNamespace(windows=lambda force, row=row: row, largest_load=lambda force, row=row: row.max())
        for row in windows
    ]


def test_a_note_says_why_there_is_no_return_force():
    """One replicate in another regime, a law with two steps, and too few windows each have their own cause and fix."""
    random = np.random.default_rng(3)
    alike = random.gumbel(86.0, 0.3, (8, 5))
    assert not return_force_notes(replicates_with(alike))
    apart = alike + np.array([[2.0], *[[0.0]] * 7])
    stepped = np.tile([80.0, 90.0, 80.0, 90.0], (8, 2))
    for windows, why in (
        (apart, "several lasting motions"),
        (stepped, "Gumbel's law"),
        (alike[:, :2], "fewer than 30"),
    ):
        (note,) = return_force_notes(replicates_with(windows))
        assert why in note
    # Without pockets nothing loads them.
    assert not return_force_notes(replicates_with(np.zeros((8, 2))))
    assert chance_of_one_law(replicates_with(apart)) == pytest.approx(f_oneway(*apart).pvalue)


def test_return_level_is_the_quantile_of_gumbels_law():
    """Maxima of a known law give its quantile; equal ones give themselves."""
    maxima = np.random.default_rng(1).gumbel(80.0, 3.0, 200_000)
    exact = 80.0 - 3.0 * np.log(-np.log(1.0 - 1.0 / RETURN_WINDOWS))
    assert return_level(moments_of(maxima).sum(axis=0)) == pytest.approx(exact, rel=2e-3)
    assert return_level(moments_of(np.full(40, 7.0)).sum(axis=0)) == pytest.approx(7.0, rel=1e-6)


def test_other_laws_are_refused():
    """Of samples of Gumbel's law 3 to 8 % are refused; uniform and bounded ones nearly always, and equal forces always."""
    random = np.random.default_rng(2)

    def refused(draw) -> float:
        return float(np.mean([distance(draw()) > LARGEST_DISTANCE for _ in range(1000)]))

    for count in (30, 100, 400):
        assert 0.03 <= refused(lambda count=count: random.gumbel(80.0, 3.0, count)) <= 0.08
    assert refused(lambda: random.uniform(0.0, 1.0, 200)) > 0.99
    assert refused(lambda: 5.0 - random.weibull(1.0, 200)) > 0.99
    assert distance(np.full(40, 7.0)) > LARGEST_DISTANCE


def test_return_force_needs_windows_and_exceeds_their_mean():
    """Eight windows of a turn bear no return force; 36 of them bear one above their mean, with an error."""
    fewer = result("numerics.impact_window_turns=1", "numerics.replicates=2")
    assert "impact_return_force_N" not in fewer.damage
    assert any("8 impact windows are fewer than 30" in note for note in fewer.notes)
    run = result("numerics.impact_window_turns=1", "numerics.replicates=9", "numerics.seed=3")
    force = run.damage["impact_return_force_N"]
    assert force.value > run.impact_force_N.value and force.statistical_error > 0.0


def test_stress_of_a_clamped_bar():
    """F L/8 under a load in the middle, F L/12 under one along the whole bar, over the section modulus t b^2/6."""
    section = CageSection(3e-3, 2e-3, 12e-3, 2e-3, 43.5e-3, 10)
    modulus = 2e-3 * 3e-3**2 / 6.0
    assert clamped_stress(section, 0.0) == pytest.approx(12e-3 / 8.0 / modulus)
    assert clamped_stress(section, 12e-3) == pytest.approx(12e-3 / 12.0 / modulus)


def test_stress_follows_the_return_force_and_its_concentration():
    """The stress is the return force times the stress per force, which doubles with the concentration."""
    sizes = ("bar_width", "bar_thickness", "bar_length", "side_ring_width")
    section = [f"cage.{key}_mm={size}" for key, size in zip(sizes, (3.0, 3.0, 9.5, 2.0), strict=True)]
    stress = Scene.load(ROOT / "examples" / "cylindrical_roller.toml", section).bar_stress_MPa_N
    sharp = Scene.load(ROOT / "examples" / "cylindrical_roller.toml", [*section, "damage.stress_concentration=4"])
    assert sharp.bar_stress_MPa_N == pytest.approx(2.0 * stress)
    run = result("numerics.impact_window_turns=1", "numerics.replicates=9", "numerics.seed=3", *section)
    force = run.damage["impact_return_force_N"].value
    assert run.damage["bar_stress_MPa"].value == pytest.approx(stress * force)


@pytest.mark.parametrize(
    ("name", "override", "sentence"),
    [
        ("impact_return_force_N", "model.drag_coefficient=1.0", "6 impact windows, and a return force needs 30"),
        ("bar_stress_MPa", "model.drag_coefficient=1.0", "the section of a bar"),
        ("land_sliding_N_m_s", "model.guide_land=off", "leaves out the guide land"),
        ("impact_energy_J", "damage.impacts=false", "damage.impacts = false"),
        ("impacts_per_turn", "model.pocket=off", "leaves out pockets"),
        ("entry_slip_m_s", "damage.races=false", "damage.races = false"),
        ("stiffness_xx_N_um", "numerics.stiffness=false", "numerics.stiffness = false"),
        ("wear_life_h", "model.drag_coefficient=1.0", "wear needs K/H of a rig"),
    ],
)
def test_a_study_is_refused_a_figure_that_its_scene_lacks(tmp_path, name, override, sentence):
    """One sentence names the response and the fix before anything runs."""
    text = short_study(tmp_path, replace=("set = [", f'set = ["{override}", ')).read_text(encoding="utf-8")
    path = tmp_path / "named.toml"
    path.write_text(text.replace("power_loss_W", name), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        assert Problem.load(path).plan
    (fault,) = refused.value.faults
    assert f"response.name = {name!r}: " in fault and sentence in fault


def test_mean_force_slides_at_the_speed_of_the_rollers():
    """Force on a pocket times the surface speed of rollers that roll, within the scatter of both; a film takes up power by its squeeze."""
    run = result()
    # Spin of a roller that rolls without slip, by the pitch diameter and its own.
    spin = 0.5 * 24000.0 * np.pi / 30.0 * (43.5 / 9.0 - 9.0 / 43.5)
    speed = 4.5e-3 * spin
    assert run.damage["pocket_sliding_N_m_s"].value == pytest.approx(
        speed * run.damage["pocket_force_mean_N"].value, rel=0.05
    )
    # Every law, as test_surroundings compiles them.
    wet = result(*EVERYTHING, "numerics.companion=false")
    assert wet.damage["pocket_impact_power_W"].value > wet.power_terms_W["pocket_damping"]


def test_a_study_computes_only_what_it_names(tmp_path):
    """Scenes of a study leave out sums, stiffness and trace that no response or limit needs."""
    problem = Problem.load(short_study(tmp_path))
    scene = problem.scene_at(problem.baseline, 1)
    assert not scene.damage.impacts and not scene.damage.races
    assert not scene.numerics.stiffness and not scene.verdict.trace
    confirmed = problem.confirmation_scene(problem.baseline)
    assert confirmed.verdict.trace and not confirmed.numerics.stiffness
    text = problem.path.read_text(encoding="utf-8").replace("power_loss_W", "impact_fatigue_force_N")
    path = tmp_path / "named.toml"
    path.write_text(text, encoding="utf-8")
    named = Problem.load(path)
    assert named.scene_at(named.baseline, 1).damage.impacts
    path.write_text(
        text.replace("impact_fatigue_force_N", "stiffness_yy_N_um") + '\n[limits]\ncage.verdict = "held"\n',
        encoding="utf-8",
    )
    stiff = Problem.load(path)
    scene = stiff.scene_at(stiff.baseline, 1)
    assert scene.numerics.stiffness and scene.verdict.trace and not scene.damage.impacts


def test_impacts_are_fewer_the_faster_they_must_be():
    """A higher threshold leaves fewer impacts of more energy and force each; without any, energy and force are left out."""
    slow, fast = (result(f"damage.impact_speed_m_s={speed}").damage for speed in (0.01, 0.1))
    assert slow["impacts_per_turn"].value > fast["impacts_per_turn"].value > 0.0
    for key in ("impact_energy_J", "impact_fatigue_force_N"):
        assert slow[key].value < fast[key].value
    none = result("damage.impact_speed_m_s=50").damage
    assert none["impacts_per_turn"].value == 0.0
    assert "impact_energy_J" not in none and "impact_fatigue_force_N" not in none


def test_impacts_and_samples_of_the_races_change_no_motion():
    """Without both every other figure keeps its bits; with them power density is largest at the inner race."""
    full, bare = result(), result("damage.impacts=false", "damage.races=false")
    sampled = {figure.key for figure in DAMAGE if figure.switch == "damage.races"}
    missing = sampled | {"impacts_per_turn", "impact_energy_J", "impact_fatigue_force_N"}
    assert len(sampled) == 8 and set(full.damage) - set(bare.damage) == missing
    assert bare.figures == full.figures and bare.power_terms_W == full.power_terms_W
    assert bare.damage == {key: figure for key, figure in full.damage.items() if key not in missing}
    assert bare.pocket_impacts is None
    damage = full.damage
    assert damage["inner_power_density_W_mm2"].value > damage["outer_power_density_W_mm2"].value > 0.0
    assert damage["entry_slip_95_m_s"].value > damage["entry_slip_m_s"].value > 0.0


def test_light_loads_enter_with_more_slip():
    """A tenth of the load leaves the rollers slower outside the load zone: more slip and more energy at each entry."""
    loaded, light = result().damage, result("operation.radial_load_N=130").damage
    assert light["entry_slip_m_s"].value > 3.0 * loaded["entry_slip_m_s"].value
    assert light["entry_energy_J"].value > loaded["entry_energy_J"].value


def test_each_roller_enters_once_a_turn_of_the_cage():
    """Entries of all rollers are as many as passes of rollers through the load zone, within the two at the ends."""
    scene = Scene.load(ROOT / "examples" / "cylindrical_roller.toml")
    run = Run(scene, roller_bearing(scene), 0, scene.numerics.rtol, Stop())
    run.to(3.0)
    run.forget()
    begin = run.carry.y[run.layout.first_body + CAGE_ANGLE]
    run.to(33.0)
    passes = (run.carry.y[run.layout.first_body + CAGE_ANGLE] - begin) / (2.0 * np.pi) * scene.bearing.rollers
    assert run.tally.races[ENTRY_SLIPS, SAMPLES_NUMBER] == pytest.approx(passes, abs=2.0)


def test_net_force_of_the_pockets_drives_the_cage_against_its_land():
    """Mean moments on the cage balance: net pocket force times pitch radius is the torque of the land (43.2 W at 981 rad/s)."""
    path = ROOT / "examples" / "cylindrical_roller.toml"
    motion, scene = rbdyn.history(path, 40, notice=None), Scene.load(path)
    parts = motion.pocket_load.sum(axis=1).reshape(8, -1).mean(axis=1)
    powers, speed = result().power_terms_W, float(motion.cage_speed.mean())
    land = (powers["land_film"] + powers["land_friction"]) / speed / (0.5e-3 * scene.bearing.pitch_diameter_mm)
    assert land == pytest.approx(2.0, abs=0.05)
    # Student's t of 7 degrees of freedom for 99 %.
    assert abs(parts.mean() - land) < 3.5 * parts.std(ddof=1) / np.sqrt(8.0)


def test_pockets_share_the_impacts():
    """Impacts of the pockets add up to those of all, with their energies and forces."""
    run = result()
    pockets = run.pocket_impacts
    assert pockets is not None and len(pockets["impacts_per_turn"]) == 10
    numbers, energies = np.array(pockets["impacts_per_turn"]), np.array(pockets["impact_energy_J"])
    assert numbers.sum() == pytest.approx(run.damage["impacts_per_turn"].value)
    assert numbers @ energies / numbers.sum() == pytest.approx(run.damage["impact_energy_J"].value)
    forces = np.array(pockets["impact_fatigue_force_N"])
    whole = (numbers @ forces**8 / numbers.sum()) ** 0.125
    assert whole == pytest.approx(run.damage["impact_fatigue_force_N"].value)
    assert SimulationResult.from_dict(json.loads(json.dumps(run.as_dict()))).pocket_impacts == pockets


def test_wear_follows_sliding_over_its_track():
    """The same sliding on a track twice as wide wears half; a cage that rests in the middle leaves the Hertz width alone."""
    still = np.array([2.0, 8.0, 5.0, 0.0, 18.0, 2.0 * 1e-5])
    assert sliding_over_track(still) == pytest.approx(4.0 / (1e-5 * 3.0))
    moving = np.array([2.0, 8.0, 5.0, 5.0 * (1e-4) ** 2, 0.0, 0.0])
    assert sliding_over_track(moving) == pytest.approx(4.0 / (2.0 * np.sqrt(3.0) * 1e-4 / np.sqrt(2.0)))
    wider = moving * np.array([1.0, 1.0, 1.0, 4.0, 1.0, 1.0])
    assert sliding_over_track(wider) == pytest.approx(0.5 * sliding_over_track(moving))
    assert sliding_over_track(np.zeros(6) + np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])) == 0.0
    run = result()
    scene = Scene.from_dict(run.scene)
    area = run.damage["pocket_sliding_N_m_s"].value / run.damage["pocket_sliding_density_W_mm2"].value
    # Between the Hertz width alone and a cage that goes round its whole clearance.
    widest = 2.0 * np.sqrt(1.5) * scene.guide_clearance_m + 1e-4
    assert 0.0 < area * 1e-6 / scene.bearing.effective_length < widest
