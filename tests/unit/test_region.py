"""The region in which bearings run: floors of clearances, moved and narrowed regions, and studies whose runs fail."""

import shutil
import tomllib
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from instant_runs import instant_result, instantly, unillustrated
from short_studies import EXAMPLES, region_that_runs, run_design, run_study, silent
from typer.testing import CliRunner

from doe.clearance import points_of
from doe.cli import app
from doe.designs import central_composite
from doe.designs.model import lost_terms, model_terms
from doe.designs.optimal import Remaining, added_points
from doe.running.store import Failure
from doe.workflow.front import find_front
from doe.workflow.problem import Problem
from doe.workflow.region import moved_region, region_in_store
from doe.workflow.runs import with_remaining
from doe.workflow.surfaces import fit_surfaces
from rbdyn.base.faults import InputError, RunError
from rbdyn.dynamics import simulate as simulation
from rbdyn.mounting.cage import NEARLY_K, OperatingClearance, RunningClearance
from rbdyn.result import HeatBalance, Quantity, Ranges
from rbdyn.scene import DrawnScene, Scene

HOT_PARTS = """
[mounting]
bore_mm = 27.0
outside_diameter_mm = 60.0
width_mm = 11.0
housing_diameter_mm = 90.0
inner_interference_um = 0.0
outer_interference_um = 0.0
rotation = false
outer_ring_temperature_C = 60.0
inner_ring_temperature_C = 60.0
roller_temperature_C = 60.0
cage_temperature_C = {cage}

[materials]
cage = "peek"
"""
STUDY = """
[scene]
file = "scene.toml"
set = ["numerics.turns=3", "numerics.discard_turns=1", "numerics.replicates=2", "numerics.companion=false", "numerics.impact_window_turns=1"]

[[factor]]
name = "guide_clearance_mm"
key = "cage.guide_clearance_mm"
centre = {centre}
step = {step}
resolution = 0.001
{more}
[[factor]]
name = "pocket_clearance_mm"
key = "cage.pocket_clearance_mm"
centre = 0.3
step = 0.05
resolution = 0.001

[design]
alpha = "face_centred"
centre_replicates = 2

[[response]]
name = "impact_force_N"
{limit}
[[response]]
name = "power_loss_W"

[front]
population = 20
generations = 10
draws = 100

[confirmation]
replicates = 2
"""


def hot_study(
    folder: Path,
    centre: float = 0.2,
    step: float = 0.1,
    cage: float = 100.0,
    more: str = "",
    tables: str = "",
    limit: str = "",
    drawn: float | None = None,
) -> Problem:
    """A study of the example with a hot PEEK cage, in a folder of its own; ``drawn``: guide clearance of the scene."""
    scene = (EXAMPLES / "cylindrical_roller.toml").read_text(encoding="utf-8")
    line = next(line for line in scene.splitlines() if line.startswith("guide_clearance_mm"))
    scene = scene.replace(line, f"guide_clearance_mm = {centre if drawn is None else drawn}")
    (folder / "scene.toml").write_text(scene + HOT_PARTS.format(cage=cage), encoding="utf-8")
    text = STUDY.format(centre=centre, step=step, more=more, limit=limit) + tables
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return Problem.load(folder / "study.toml")


def unheated(scenes, labels):
    raise AssertionError("stated temperatures need no run")


def taken_mm(scene: Scene) -> float:
    """What operation takes of the guide clearance [mm]."""
    guide = scene.clearances["guide"]
    return 1e3 * (guide.drawn - guide.operating)


def test_unit_a_floor_is_a_film_and_five_kelvin():
    """Unit: with parts five kelvin farther apart a clearance at its floor just touches; one that is a preload has no film."""
    play = OperatingClearance(1e-4, 0.0, -7e-5)
    guide = RunningClearance("cage.guide_clearance_mm", play, 4e-6, 2e-6)
    assert guide.floor == pytest.approx(4e-6 + NEARLY_K * 2e-6) and not guide.seizes
    assert guide._replace(play=play._replace(temperature=-9.7e-5)).seizes
    assert replace_touching(guide, -np.inf).floor == pytest.approx(NEARLY_K * 2e-6)


def replace_touching(running: RunningClearance, touching: float) -> RunningClearance:
    return running._replace(touching=touching, play=running.play._replace(temperature=-1.0))


def test_unit_five_kelvin_take_what_the_floor_says(tmp_path):
    """Unit: a cage warmer by NEARLY_K loses the guide clearance that lies between the floor and touching, within 1 %."""
    hot_study(tmp_path)
    scene = DrawnScene.load(tmp_path / "scene.toml")
    warmer = scene.changed({"mounting.cage_temperature_C": 100.0 + NEARLY_K})
    guide = scene.running_clearances(scene.mounting)["guide"]
    left = 1e3 * guide.play.operating - 1e3 * warmer.clearances["guide"].operating
    assert left == pytest.approx(1e3 * (guide.floor - guide.touching), rel=0.01)


def test_unit_a_region_is_narrowed_to_where_the_cage_runs(tmp_path):
    """Unit: heat takes by free expansion what the sentence says; the least clearance in the region stays above its floor, the
    upper end where it was, and the file as it was."""
    study = hot_study(tmp_path)
    before = (tmp_path / "study.toml").read_bytes()
    moved, (note,) = moved_region(study, unheated)
    (low, _), (high, _) = ((moved.actual(np.full(2, side))) for side in (-1.0, 1.0))
    scene = DrawnScene.load(tmp_path / "scene.toml", [f"cage.guide_clearance_mm={low}"])
    land = scene.land_diameter_mm
    taken = taken_mm(scene)
    assert taken == pytest.approx(land * (47e-6 * 80.0 - 12e-6 * 40.0), rel=5e-3)
    guide = scene.running_clearances(scene.mounting)["guide"]
    assert guide.floor < guide.play.operating < guide.floor + 0.02e-3
    assert high == pytest.approx(0.3, abs=2e-3) and 0.15 < low < 0.22
    assert note.code == "region" and note.startswith("The region of the guide clearance was narrowed to ")
    assert f"heat takes {taken:.3f} mm of it" in note
    assert (tmp_path / "study.toml").read_bytes() == before
    assert moved_region(moved, unheated).notes == () and moved_region(moved, unheated).study is moved


def test_unit_a_region_that_has_too_little_left_moves(tmp_path):
    """Unit: of a region that nothing would be left of half the width remains, above; without need nothing changes."""
    moved, notes = moved_region(hot_study(tmp_path, centre=0.1, step=0.04), unheated)
    low, high = (float(moved.actual(np.full(2, side))[0]) for side in (-1.0, 1.0))
    assert high - low == pytest.approx(0.04, abs=2e-3) and low > 0.16
    assert "(before: 0.060 to 0.140 mm): " in notes[0]
    wide = hot_study(tmp_path, centre=0.4)
    assert moved_region(wide, unheated) == (wide, ())


def test_unit_the_original_design_stays_the_baseline_unless_it_seizes(tmp_path):
    """Unit: gains are over the design of the drawing; where that seizes, over the middle of the region, and a danger says so."""
    moved, _ = moved_region(hot_study(tmp_path, centre=0.2), unheated)
    assert moved.baseline == pytest.approx([0.2, 0.3]) and moved.centre[0] > 0.2
    moved, notes = moved_region(hot_study(tmp_path, centre=0.1, step=0.04), unheated)
    assert moved.baseline == pytest.approx(moved.centre)
    assert notes[-1].level == "danger" and notes[-1].startswith(
        "Seizure: guide clearance of the baseline design in operation is -"
    )


def test_unit_a_preload_is_meant(tmp_path):
    """Unit: a bearing without clearance on the drawing keeps its region; one with a stated least clearance has that floor."""
    factor = '[[factor]]\nname = "radial"\nkey = "bearing.radial_clearance_mm"\ncentre = {}\nstep = 0.003\n'
    preloaded = hot_study(tmp_path, centre=0.4, tables=factor.format(-0.004))
    assert moved_region(preloaded, unheated).notes == ()
    loose = hot_study(tmp_path, centre=0.4, tables=factor.format(0.003))
    moved, (note,) = moved_region(loose, unheated)
    assert note.startswith("The region of the radial") and moved.centre[2] > 0.003
    stated = hot_study(tmp_path, centre=0.4, tables=factor.format(0.003) + "[adaptive]\nleast_clearance_um = -5.0\n")
    assert moved_region(stated, unheated).notes == ()


def test_unit_impossible_regions_are_refused_in_a_sentence(tmp_path):
    """Unit: an end that the study forbids, pockets without a bar between them, and a clearance that is no factor."""
    with pytest.raises(
        InputError,
        match=r"factor.allowed of guide_clearance_mm = .*its region has to begin at 0\.1.*raise its upper end",
    ):
        moved_region(hot_study(tmp_path, centre=0.1, step=0.04, more="allowed = [0.05, 0.15]"), unheated)
    result = CliRunner().invoke(app, ["design", str(tmp_path / "study.toml")])
    assert result.exit_code == 2 and "has to begin at" in result.stdout + result.stderr
    study = hot_study(tmp_path, centre=0.1, step=0.04, drawn=0.15)
    text = (tmp_path / "study.toml").read_text(encoding="utf-8").replace("cage.guide_clearance_mm", "cage.mass_g")
    (tmp_path / "study.toml").write_text(
        text.replace("centre = 0.1\n", "centre = 40.0\n").replace("step = 0.04", "step = 4.0"), encoding="utf-8"
    )
    with pytest.raises(
        InputError,
        match=r"cage.guide_clearance_mm = 0.15: heat takes .*: the cage seizes; widen it in scene.toml, or make",
    ):
        moved_region(Problem.load(study.path), unheated)


def test_unit_a_table_of_earlier_runs_keeps_its_region(tmp_path):
    """Unit: published runs keep their points; what they come near to is a danger."""
    shutil.copy(EXAMPLES / "ccd_table4.csv", tmp_path)
    study = hot_study(
        tmp_path, centre=0.22, step=0.06, tables='[reference]\nfile = "ccd_table4.csv"\nlabel = "published"\n'
    )
    same, (note,) = moved_region(study, unheated)
    assert same is study and note.level == "danger" and "runs of a table keep its region where it is" in note


def test_unit_every_corner_at_every_point_of_the_duty_is_looked_at(tmp_path):
    """Unit: the point of the duty that takes most is named, and no run of the moved design seizes at any."""
    duty = "".join(
        f'[[duty]]\nname = "{name}"\nshare = 0.5\nset = ["mounting.cage_temperature_C={cage}"]\n'
        for name, cage in (("cruise", 60.0), ("take-off", 110.0))
    )
    study = hot_study(tmp_path, tables=duty)
    moved, (note,) = moved_region(study, unheated)
    assert ": at take-off heat takes " in note
    for run in moved.design_scenes(moved.actual(moved.design.coded)):
        for scene in run.scenes.values():
            assert all(
                clear.play.operating > clear.floor for clear in scene.running_clearances(scene.mounting).values()
            )


HEATED = {"oil": 80.0, "outer": 90.0, "inner": 90.0, "rollers": 100.0}


def heated_study(folder: Path, centre: float = 0.2, step: float = 0.1) -> Problem:
    """A study whose temperatures follow from the losses."""
    study = hot_study(folder, centre, step)
    text = (folder / "scene.toml").read_text(encoding="utf-8")
    kept = [line for line in text.splitlines() if "temperature_C" not in line]
    kept.insert(kept.index("[lubricant]") + 1, "oil_flow_l_min = 1.0\noil_inlet_temperature_C = 60.0")
    (folder / "scene.toml").write_text("\n".join([*kept, "[thermal]", "ambient_C = 25.0", ""]), encoding="utf-8")
    return study


def heats(monkeypatch, seizing: float = 0.0, oil: float = 80.0, slopes: list[list[float]] | None = None) -> list[Scene]:
    """Simulations in no time with temperatures, of which those below a guide clearance seize; the scenes that ran."""
    ran: list[Scene] = []
    instantly(monkeypatch.setattr)

    def simulate(scene, *rest, **more):
        ran.append(scene)
        nodes = {**HEATED, "oil": oil}
        result = replace(
            instant_result(scene),
            temperatures_C={name: Quantity(value, 0.1, 0.1, 10.0, 9) for name, value in nodes.items()},
        )
        nothing = {key: {} for key in ("heat_W", "carried_off_W", "conductances_W_K")}
        record = HeatBalance(
            status="steady",
            gain=0.0,
            slopes=slopes,
            windage_W=0.0,
            ranges=Ranges(None),
            oil_fraction=None,
            path_C=[nodes],
            **nothing,
        )
        if scene.cage.guide_clearance_mm < seizing:
            return replace(result, status="seizure", thermal=replace(record, reason="the cage seizes when hot"))
        return replace(result, thermal=record)

    monkeypatch.setattr(simulation, "simulate", simulate)
    return ran


def test_heat_balances_are_made_once_and_resumed(tmp_path, monkeypatch):
    """A short run at the centre and one where the clearances of the moved region are least; a second look finds both in the store,
    and so does status."""
    study, said = heated_study(tmp_path), list[str]()
    assert region_in_store(study, tmp_path) is study
    ran = heats(monkeypatch)
    region = region_that_runs(study, tmp_path, 1, notice=said.append)
    assert ran[0].cage.guide_clearance_mm == 0.2 and ran[0].numerics.turns == 5.0
    low = region.study.actual(-np.ones(2))
    assert [ran[1].cage.guide_clearance_mm, ran[1].cage.pocket_clearance_mm] == pytest.approx(low)
    assert len(ran) == 2, "the baseline, which is near its end, is the centre"
    assert said[0] == "1 short run for the temperatures of the middle of the region"
    assert said[3:] == list(region.notes)
    again = region_that_runs(study, tmp_path, 1)
    assert len(ran) == 2 and again.study.file == region.study.file
    assert region_in_store(study, tmp_path).file == region.study.file
    record = CliRunner().invoke(app, ["status", str(study.path), "--out", str(tmp_path), "--json"])
    assert record.exit_code == 0, record.output


def test_balances_of_design_runs_begin_in_the_middle_of_the_region(tmp_path, monkeypatch):
    """The scenes and keys of design runs have its temperatures and slopes, rounded; so have those of confirmations in brief, or where
    the gain of the loop is slight. The store tells the same keys again."""
    study, slopes = heated_study(tmp_path), (-0.123456 * np.eye(4)).tolist()
    heats(monkeypatch, slopes=slopes)
    region = region_that_runs(study, tmp_path, 1).study
    for scene in region.plan.scenes:
        near = scene.thermal.near
        assert near.slopes[1] == [0.0, -0.12, 0.0, 0.0] and near.temperatures_C == [HEATED[name] for name in HEATED]
        assert Scene.from_dict(scene.model_dump(mode="json")).model_dump_json() == scene.model_dump_json()
    for share, begins in ((1.0, True), (-4.0, False)):
        at_gain = replace(
            region, near={"": near.model_copy(update={"slopes": (share * np.array(near.slopes)).tolist()})}
        )
        assert (at_gain.confirmation_run(region.baseline).thermal.near is not None) == begins
    assert region.confirmation_run(region.baseline, in_brief=True).thermal.near == near
    (adaptive,) = region.adaptive_scenes(region.baseline[None], [2], 0)
    assert adaptive.thermal.near == near
    keys = [point.key for point in points_of(region.plan.scenes, region.plan.labels)]
    seen = region_in_store(study, tmp_path).plan
    assert [point.key for point in points_of(seen.scenes, seen.labels)] == keys
    unbegun = replace(region, near={}).plan
    assert not {*keys} & {point.key for point in points_of(unbegun.scenes, unbegun.labels)}


def test_a_bearing_with_clearance_to_spare_is_balanced_once(tmp_path, monkeypatch):
    """A metal cage that nothing closes: one short run, and the region stays."""
    study = heated_study(tmp_path, centre=0.6)
    ran = heats(monkeypatch)
    region = region_that_runs(study, tmp_path, 1)
    assert len(ran) == 1 and region.study is study and region.notes == ()


def test_a_centre_that_seizes_is_balanced_with_wider_clearances(tmp_path, monkeypatch):
    """Its heat is that of a cage that turns; where none does, one sentence says so and nothing else runs."""
    study = heated_study(tmp_path, centre=0.11)
    ran = heats(monkeypatch, seizing=0.15)
    region = region_that_runs(study, tmp_path, 1)
    assert [scene.cage.guide_clearance_mm > 0.15 for scene in ran] == [False, True, True]
    assert region.study.centre[0] > 0.2 and "heat takes" in region.notes[0]
    assert region.study.baseline == pytest.approx(region.study.centre), "the original design seizes"
    (tmp_path / "never").mkdir()
    ran = heats(monkeypatch, seizing=9.0)
    with pytest.raises(
        RunError, match=r"^the middle of the region has no steady temperatures: seizure: the cage seizes when hot; "
    ):
        region_that_runs(study, tmp_path / "never", 1)
    assert len(ran) == 3


def test_a_land_that_heats_itself_moves_the_region_on(tmp_path, monkeypatch):
    """The centre leaves enough, but the least clearances seize by their own heat: the region moves until they run, and says why."""
    ran = heats(monkeypatch, seizing=0.23)
    region = region_that_runs(heated_study(tmp_path, centre=0.37, step=0.16), tmp_path, 1)
    low = region.study.actual(-np.ones(2))[0]
    assert 0.23 <= low < 0.27 and ran[-1].cage.guide_clearance_mm == pytest.approx(0.21)
    (note,) = region.notes
    assert (
        note.startswith(
            "The region of the guide clearance was narrowed to 0.240 to 0.530 mm (before: 0.210 to 0.530 mm)"
        )
        and "and heat itself" in note
    )


def test_an_oil_too_hot_is_told_before_the_design_runs(tmp_path, monkeypatch):
    heats(monkeypatch, oil=240.0)
    notes = region_that_runs(heated_study(tmp_path, centre=0.4), tmp_path, 1).notes
    assert notes[0].level == "danger" and notes[0].startswith(
        "Too hot: the oil reaches 240 C in the middle of the region, above its"
    )


def test_doe_new_writes_the_region_that_runs(tmp_path, monkeypatch):
    """The centre moves with the whole width; the study that it writes needs no other move; a scene that runs is not changed.

    Both say that the middle of the region replaces the drawing, which seizes.
    """
    hot_study(tmp_path, drawn=0.15)
    monkeypatch.chdir(tmp_path)
    result = CliRunner().invoke(app, ["new", "scene.toml"])
    assert result.exit_code == 0, result.output
    assert "(before: 0.075 to 0.225 mm): heat takes" in result.stderr
    data = tomllib.loads(result.stdout)
    guide = next(factor for factor in data["factor"] if factor["name"] == "guide_clearance_mm")
    assert guide["centre"] > 0.15 and guide["step"] == pytest.approx(0.057, abs=1e-3)
    (tmp_path / "written.toml").write_text(result.stdout, encoding="utf-8")
    (note,) = moved_region(Problem.load(tmp_path / "written.toml"), unheated).notes
    replaced = "in operation is -12 um; gains are over the middle of the region instead."
    assert note.code == "region" and note == f"Seizure: guide clearance of scene.toml {replaced}"
    assert f"Seizure: guide clearance of the baseline design {replaced}" in result.stderr
    hot_study(tmp_path, cage=30.0, drawn=0.15)
    result = CliRunner().invoke(app, ["new", "scene.toml"])
    assert "baseline" not in tomllib.loads(result.stdout) and result.stderr == ""


def test_unit_what_remains_lies_nearest_to_runs_that_went_well():
    """Unit: midway to a failed corner the region ends; a place where another run went well is not lost."""
    points = np.array([*product([-1.0, 1.0], repeat=2), (0.0, 0.0)])
    remaining = Remaining(points[1:], points[:1])
    places = np.array([[-0.49, -0.49], [-0.51, -0.51], [-2.0, -2.0], [1.0, -1.0]])
    assert (remaining.excess(places) <= 0.0).tolist() == [True, False, False, True]
    assert (Remaining(points, points[:1]).excess(points) <= 0.0).all()


def test_unit_added_points_estimate_what_was_lost():
    """Unit: a design that lost its axial runs cannot tell the squares apart; so many points of the lattice mend it, and D-optimally:
    no exchange of the last of them raises the determinant."""
    design, terms = central_composite(2), model_terms(2, "quadratic")
    cube = design.coded[[kind == "cube" for kind in design.kind]]
    assert lost_terms(cube, terms)
    lattice = np.array(list(product([-1.0, 0.0, 1.0], repeat=2)))
    added = added_points(cube, lattice, terms, 4)
    whole = np.vstack([cube, added])
    assert not lost_terms(whole, terms)

    def determinant(points):
        from doe.designs.model import model_matrix

        columns = model_matrix(points, terms)
        return np.linalg.slogdet(columns.T @ columns)[1]

    best = determinant(whole)
    assert all(determinant(np.vstack([whole[:-1], other])) <= best + 1e-9 for other in lattice)


@pytest.fixture
def failing(tmp_path, monkeypatch):
    """A study of which all runs below a guide clearance of 0.37 mm fail."""
    study = hot_study(tmp_path, centre=0.4)
    instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)

    def simulate(scene, *rest, **more):
        if scene.cage.guide_clearance_mm < 0.37:
            raise RunError("the cage seized")
        return instant_result(scene)

    monkeypatch.setattr(simulation, "simulate", simulate)
    return study


def test_a_study_is_not_lost_where_runs_fail(failing, tmp_path):
    """Three of ten runs fail, so that the square of a factor is lost: others replace them in the rest of the region, all terms are
    estimable, the front stays there, and the answer says so in a sentence."""
    runs = run_design(failing, tmp_path, 1, silent)
    assert [failure.run for failure in runs.failures] == [1, 3, 5]
    assert runs.design is not None and runs.design.kind[-1] == "added" and len(runs.design.coded) == 13
    assert not lost_terms(runs.coded, model_terms(2, "quadratic"))
    assert runs.places == [place for place in range(13) if place not in (0, 2, 4)]
    assert runs.notes[0].code == "lost-runs" and runs.notes[0].count("the cage seized") == 1
    assert "3 other runs in the rest of the region are in their place" in runs.notes[0]
    rest = with_remaining(failing, runs)
    front = find_front(rest.with_surfaces(fit_surfaces(rest, runs)))
    assert front.points[:, 0].min() >= 0.35 and (rest.remaining.excess(rest.coded(front.points)) <= 0.0).all()
    everywhere = find_front(failing.with_surfaces(fit_surfaces(failing, runs)))
    assert everywhere.points[:, 0].min() < 0.31
    again = run_design(failing, tmp_path, 2, silent)
    assert np.array_equal(again.values, runs.values) and again.failures == runs.failures


def test_a_pick_that_fails_gives_way(failing, tmp_path):
    """The boundary lies a little above where the runs say: the selected design there fails, and the next one is simulated."""
    outcome = run_study(failing, tmp_path, 1, lambda title: silent)
    assert outcome.pick.point[0] >= 0.37 and not isinstance(outcome.pick, Failure)
    assert outcome.notes[0].startswith("3 design runs failed") and len(outcome.design.coded) == 13


def test_unit_a_clearance_that_fits_turn_into_a_preload_is_lost():
    """Unit: a radial clearance may be a preload on the drawing, but not become one."""
    play = OperatingClearance(2e-5, -3e-5, 0.0)
    radial = RunningClearance("bearing.radial_clearance_mm", play, -np.inf, 1e-6)
    assert radial.lost and not radial.seizes
    assert not radial._replace(play=play._replace(drawn=-1e-6)).lost
    assert not radial._replace(play=play._replace(fit=-1e-5)).lost
