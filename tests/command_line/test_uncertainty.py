"""``doe uncertainty`` and the judgement of ``doe study --robust``: files, keys, resumption, bad input; known truths."""

import json
import sqlite3
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from instant_runs import instant_result
from short_studies import with_paper_goals
from typer.testing import CliRunner

from doe.cli import app
from doe.study_file.sections import Robust
from doe.workflow.input_sets import ROUND_SEEDS, override_notes, read_case, replicated_sets, run
from doe.workflow.judgement import MOST_PAIRS, Decision, Pair, worded
from doe.workflow.problem import Problem
from doe.workflow.robust import case_of_study, fresh_rows, judge
from doe.workflow.status import CODE, inputs_digest
from doe.workflow.uncertainty import OUTPUTS, find_uncertainty
from rbdyn.base.digests import code_behind
from rbdyn.base.faults import InputError
from rbdyn.base.files import digest_of
from rbdyn.result import Quantity, SimulationResult
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = [
    "numerics.turns=4", "numerics.discard_turns=2", "numerics.impact_window_turns=2", "numerics.replicates=2",
    "numerics.extend=false", "numerics.companion=false",
]  # fmt: skip
UNCERTAIN = f"""
[uncertain]
defaults = "none"
points = 16
set = {json.dumps(SHORT)}
"model.pocket_bar_stiffness_N_m" = {{ law = "log_uniform", low = 1e7, high = 2e8 }}
"cage.mass_g" = {{ law = "normal", mean = 45.0, sd = 3.0 }}
"""


@pytest.fixture(scope="module", autouse=True)
def few_resamplings() -> Iterator[None]:
    """Intervals and the robust front from fewer draws: their coverage is the subject of ``test_odds`` and ``test_unknown_worth``."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("doe.unknown.decision.RESAMPLES", 40)
        patch.setattr("doe.unknown.decision.HALVES", 40)
        patch.setattr("doe.workflow.robust.GENERATIONS", 15)
        yield


def _scene(folder: Path, uncertain: str = UNCERTAIN) -> Path:
    path = folder / "scene.toml"
    path.write_text((EXAMPLES / "cylindrical_roller.toml").read_text("utf-8") + uncertain, "utf-8")
    return path


def _run(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["uncertainty", *arguments])


def _closed_form(patch: pytest.MonkeyPatch) -> None:
    """Let simulations give an impact that is linear in the cage's mass and in the logarithm of its bars' stiffness."""

    def simulate(scene: Scene, *_: Any, **named: Any) -> SimulationResult:
        bar = np.log(scene.model.pocket_bar_stiffness_N_m / 3e7)
        scatter = 0.2 * np.random.default_rng(scene.numerics.seed).standard_normal()
        impact = 100.0 + scene.cage.mass_g - 45.0 + 5.0 * bar + scatter
        found = instant_result(scene)
        return replace(found, figures=found.figures | {"impact_force_N": Quantity(impact, 0.45, None, 10.0, 9)})

    patch.setattr("doe.workflow.uncertainty.OUTPUTS", ("impact_force_N",))
    patch.setattr("doe.unknown.propagation.REFITS", 4)  # intervals of shares are not the subject
    patch.setattr("rbdyn.dynamics.simulate.simulate", simulate)
    patch.setattr("rbdyn.dynamics.run.prepare", lambda scene, bearing: 0.0)


def test_record_files_and_resumption(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulation itself: every file and key, and the same record from the store."""
    monkeypatch.setattr("doe.workflow.uncertainty.MOST", 16)
    monkeypatch.setattr("doe.workflow.uncertainty.MOST_EFFORT", 2)
    monkeypatch.setattr("doe.unknown.propagation.REFITS", 4)
    scene, out = _scene(tmp_path), tmp_path / "out"
    command = [str(scene), "--target", "50%", "--out", str(out), "--json", *(f"--set={each}" for each in SHORT)]
    first = _run(*command, "--workers", "2")
    assert first.exit_code == 0, first.output
    record = json.loads(first.stdout)
    assert set(record["responses"]) == {"impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm"}
    for each in record["responses"].values():
        assert each["input"]["low"] <= each["input"]["median"] <= each["input"]["high"]
        assert sum(each["variance"].values()) == pytest.approx(1.0)
        assert (each["first"] is None) == (not each["trusted"])
    assert [each["key"] for each in record["inputs"]] == ["cage.mass_g", "model.pocket_bar_stiffness_N_m"]
    assert record["runs"] == 16 and record["failed"] == 0
    # A stiffer bar makes harder impacts: its share is the largest wherever it can be told.
    impact = record["responses"]["impact_force_N"]
    if impact["trusted"]:
        assert impact["total"]["model.pocket_bar_stiffness_N_m"][0] > impact["total"]["cage.mass_g"][0]
    for name in ("uncertainty.json", "input_sets.csv", "uncertainty.png", "study.sqlite"):
        assert (out / name).stat().st_size > 0
    assert len((out / "input_sets.csv").read_text("utf-8").splitlines()) == record["runs"] + 1
    assert json.loads(_run(*command, "--workers", "1").stdout) == record


@pytest.mark.parametrize(
    ("uncertain", "sentence"),
    [
        ('[uncertain]\ndefaults = "none"\n', "uncertain: nothing is unknown"),
        (
            '[uncertain]\n"cage.mass_g" = {law = "uniform", low = -2.0, high = -1.0}\n',
            'uncertain."cage.mass_g" at -1.999: cage.mass_g = -1.999: must be at least 0.01; check its unit, g; change its law',
        ),
        ("[uncertain]\npoints = 100\n", "points = 100: no power of two; take 64"),
        ('[uncertain]\nsample = "none.csv"\n', "none.csv: no such file"),
    ],
)
def test_bad_declarations_end_in_one_sentence(tmp_path: Path, uncertain: str, sentence: str) -> None:
    found = _run(str(_scene(tmp_path, uncertain)), "--out", str(tmp_path / "out"), *(f"--set={each}" for each in SHORT))
    assert found.exit_code == 2
    assert sentence in found.output and "Traceback" not in found.output
    # Before anything ran.
    assert not (tmp_path / "out" / "study.sqlite").exists() or runs_in(tmp_path / "out") == 0


def runs_in(folder: Path) -> int:
    """Runs in the store of a folder."""
    with sqlite3.connect(folder / "study.sqlite") as store:
        return int(store.execute("select count(*) from runs").fetchone()[0])


def test_interrupted_is_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a shorter plan left in the store and what runs anew give the same bits as all of it at once."""
    _closed_form(monkeypatch)
    monkeypatch.setattr("doe.workflow.uncertainty.MOST", 16)  # none is added
    monkeypatch.setattr("doe.workflow.uncertainty.MOST_EFFORT", 1)
    command = [str(_scene(tmp_path)), "--json", *(f"--set={each}" for each in SHORT)]
    assert _run(*command, "--points", "16", "--out", str(tmp_path / "parts")).exit_code == 0
    assert runs_in(tmp_path / "parts") == 17
    parts, whole = (_run(*command, "--points", "32", "--out", str(tmp_path / name)) for name in ("parts", "whole"))
    assert runs_in(tmp_path / "parts") == runs_in(tmp_path / "whole") == 33
    assert parts.exit_code == 0 and json.loads(parts.stdout) == json.loads(whole.stdout)


def test_inputs_that_go_together_have_shapley_effects(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a sample in whose rows mass and bar go together, no Sobol' index; effects are those of the closed form and sum to one;
    rows stay rows."""
    _closed_form(monkeypatch)
    monkeypatch.setattr("doe.workflow.uncertainty.MOST", 64)
    random = np.random.default_rng(1)
    mass = 45.0 + 3.0 * random.standard_normal(200)
    rows = np.column_stack([mass, 3e7 * np.exp(0.2 * (mass - 45.0) + 0.2 * random.standard_normal(200))])
    header = "cage.mass_g,model.pocket_bar_stiffness_N_m"
    np.savetxt(tmp_path / "posterior.csv", rows, delimiter=",", header=header, comments="")
    short = f'[uncertain]\ndefaults = "none"\npoints = 64\nsample = "posterior.csv"\nset = {json.dumps(SHORT)}\n'
    command = [str(_scene(tmp_path, short)), "--json", "--out", str(tmp_path / "out")]
    found = _run(*command, *(f"--set={each}" for each in SHORT))
    assert found.exit_code == 0, found.output
    record = json.loads(found.stdout)
    assert [each["law"]["law"] for each in record["inputs"]] == ["sample", "sample"]
    impact = record["responses"]["impact_force_N"]
    assert impact["trusted"] and impact["first"] is None and impact["total"] is None
    effects = {key: share[0] for key, share in impact["shapley"].items()}
    assert sum(effects.values()) + impact["floor"][0] == pytest.approx(1.0, abs=0.02)
    # Of a sum of two, each makes its own variance and the covariance with the other.
    parts = np.column_stack([rows[:, 0], 5.0 * np.log(rows[:, 1])])
    truth = np.cov(parts.T).sum(axis=1) / parts.sum(axis=1).var(ddof=1)
    assert list(effects.values()) == pytest.approx(truth, abs=0.05)
    ran = np.loadtxt(tmp_path / "out" / "input_sets.csv", delimiter=",", skiprows=1)[:, :2]
    assert np.abs(ran[:, None] / rows[None] - 1.0).max(axis=2).min(axis=1).max() < 1e-9


def test_a_sample_is_tried_row_by_row_and_says_what_its_rig_could_not(tmp_path: Path) -> None:
    """Each friction alone would lie beside the other's value in the scene, where no traction curve is."""
    sample = tmp_path / "posterior.csv"
    sample.write_text("traction.mu_m,traction.mu_inf\n0.02,0.015\n0.03,0.02\n0.09,0.07\n", "utf-8")
    record = {"verdict": "not calibrated", "reasons": ["two rows contradict"], "sha256": digest_of(sample.read_bytes())}
    sample.with_suffix(".json").write_text(json.dumps(record), "utf-8")
    path = _scene(tmp_path, '[uncertain]\ndefaults = "none"\nsample = "posterior.csv"\n')
    case = read_case(path, ("impact_force_N",), ())
    assert case.doubt == "posterior.csv is of a rig that ended not calibrated: two rows contradict"
    sample.write_text("traction.mu_m,traction.mu_inf\n0.02,0.015\n0.03,0.2\n", "utf-8")
    with pytest.raises(InputError, match=r"uncertain.sample, row 3: .*; take the row out"):
        read_case(path, ("impact_force_N",), ())


def test_laws_from_the_command_line(tmp_path: Path) -> None:
    """Quotes hold the dots of a key together."""
    law = 'uncertain."cage.mass_g"={law="uniform",low=-2.0,high=-1.0}'
    scene = _scene(tmp_path, "")
    found = _run(str(scene), "--set", 'uncertain.defaults="none"', "--set", law, "--out", str(tmp_path / "out"))
    assert found.exit_code == 2 and 'uncertain."cage.mass_g" at -1.999' in found.output


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [(["--points", "100"], "--points 100: no power of two; take 64"), (["--target", "x"], "--target x: not a number")],
)
def test_bad_options(tmp_path: Path, arguments: list[str], sentence: str) -> None:
    found = _run(str(_scene(tmp_path)), *arguments, "--out", str(tmp_path / "out"))
    assert found.exit_code == 2 and sentence in found.output


def test_balls_are_refused(tmp_path: Path) -> None:
    found = _run(str(EXAMPLES / "angular_contact_ball.toml"), "--out", str(tmp_path / "out"))
    assert found.exit_code == 2 and "is not simulated in time" in found.output


class _Result:
    """A result of a simulation that never ran and traced no cage."""

    verdict = None

    def __init__(self, values: Sequence[float], error: float) -> None:
        names = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W")
        self.responses = {
            name: Quantity(value, 2.4 * error * value, None, 8.0, 7) for name, value in zip(names, values, strict=True)
        }


class _Simulations:
    """Responses in closed form: the selected design gains 2 % in impact and loss, in whirl only below an imbalance of 20 um."""

    def __init__(self, error: float) -> None:
        self.error, self.replicates = error, list[int]()

    def progress(self, title: str) -> Any:
        return lambda done, total: None

    def run(self, scenes: Sequence[Scene], labels: Sequence[str], progress: Any) -> list[_Result]:
        return [self._one(scene) for scene in scenes]

    def _one(self, scene: Scene) -> _Result:
        self.replicates.append(scene.numerics.replicates)
        picked = scene.cage.pocket_clearance_mm < 0.3
        gain = np.array([0.02, 0.003 * (20.0 - scene.cage.imbalance_um), 0.02]) if picked else np.zeros(3)
        random = np.random.default_rng([scene.numerics.seed, picked])
        error = self.error / np.sqrt(scene.numerics.replicates / 2.0)
        level = np.array([80.0 * scene.cage.mass_g / 45.0, 0.4, 230.0])
        return _Result((level * (1.0 - gain) * (1.0 + error * random.standard_normal(3))).tolist(), error)


def _study(folder: Path, uncertain: str, settle: float = 0.5, front: str = "none") -> Problem:
    text = with_paper_goals((EXAMPLES / "clearance_study.toml").read_text("utf-8"))
    (folder / "cylindrical_roller.toml").write_text((EXAMPLES / "cylindrical_roller.toml").read_text("utf-8"), "utf-8")
    for each in EXAMPLES.glob("*.csv"):
        (folder / each.name).write_bytes(each.read_bytes())
    (folder / "study.toml").write_text(
        f'{text}\n[robust]\npoints = 128\nsettle = {settle}\nfront = "{front}"\n{uncertain}', "utf-8"
    )
    return Problem.load(folder / "study.toml")


MASS = """
[uncertain]
defaults = "none"
"cage.mass_g" = { law = "uniform", low = 40.0, high = 50.0 }
"""
IMBALANCE = """
[uncertain]
defaults = "none"
"cage.imbalance_um" = { law = "uniform", low = 0.0, high = 50.0 }
"cage.mass_g" = { law = "uniform", low = 40.0, high = 50.0 }
"""


@pytest.fixture(scope="module")
def judgement(tmp_path_factory: pytest.TempPathFactory) -> tuple[Problem, Any]:
    """A study whose impact and loss have limits, and the judgement of its pick over imbalance and mass."""
    study = _study(tmp_path_factory.mktemp("judgement"), IMBALANCE)
    text = study.path.read_text("utf-8")
    limits = 'name = "impact_force_N"\nmodel = "linear"\ngoal = "min"\nlower = 72.0\nupper = 80.0'
    text = text.replace('name = "impact_force_N"\nmodel = "linear"\ngoal = "min"', limits)
    text = text.replace('goal = "min"\n\n[front]', 'goal = "min"\nupper = 200.0\n\n[front]')
    study.path.write_text(text, "utf-8")
    study = Problem.load(study.path)
    return study, judge(study, study.baseline * [1.0, 1.0, 0.8], _Simulations(0.002))  # type: ignore[arg-type]


def test_the_unknown_that_decides_is_named_with_its_flip(judgement: tuple[Problem, Any]) -> None:
    _, found = judgement
    imbalance, mass = found.decision.inputs
    assert all(found.chances.gains[name].value > 0.98 for name in ("impact_force_N", "power_loss_W"))
    assert found.chances.all.value == pytest.approx(0.4, abs=0.05)
    assert imbalance.key == "cage.imbalance_um" and imbalance.flip == pytest.approx(20.0, abs=1.5)
    assert imbalance.worth == pytest.approx(0.4, abs=0.05) and not imbalance.pick_above
    assert mass.worth < 0.02 and mass.flip is None
    # Half as wide about its median the imbalance lies between 12.5 and 37.5 um, 0.3 of that below 20.
    assert found.halved == pytest.approx(0.3, abs=0.05)
    first, words = found.decides[0], found.sentences[1]
    assert first.flip_interval[0] < 20.0 < first.flip_interval[1] < 22.0
    assert first.worth_interval[0] < first.worth < first.worth_interval[1]
    assert found.undecided is None and found.pair is None and found.pairs == 128
    assert words.startswith(f"Most decisive unknown: cage.imbalance_um. Above {first.flip:.3g} (")
    assert " µm keep the baseline. Measuring it raises the chance of the right choice by " in words
    record = json.loads(json.dumps(found.as_dict()))
    assert type(found).from_dict(record).as_dict() == record


def test_what_is_undecided_or_worth_nothing_is_said_so(judgement: tuple[Problem, Any]) -> None:
    """The words of each verdict; only a decided one lists inputs."""
    _, found = judgement
    rivals, first = ["cage.imbalance_um", "cage.mass_g"], found.decision.inputs[0]
    for needed, words in ((300.0, "About 512 pairs would decide"), (np.inf, "More than 1024 pairs, the most that")):
        unsure = worded(found, replace(found.decision, verdict="undecided", rivals=rivals, needed=needed))
        assert unsure.decides == [] and words in unsure.undecided and all(key in unsure.undecided for key in rivals)
        assert unsure.sentences[1] == unsure.undecided
    small = [replace(each, worth=0.0, worth_interval=(0.0, 0.011)) for each in found.decision.inputs]
    nothing = Decision(small, "nothing", [], 128.0)
    never = worded(found, nothing)
    assert never.decides == [] and never.undecided is None
    assert "No measurement of one unknown is worth making: it would raise" in never.sentences[1]
    assert "by at most 2 points" in never.sentences[1]
    both = worded(replace(found, pair=Pair(tuple(rivals), 0.3, (0.25, 0.34))), nothing)
    assert both.sentences[1].endswith("together raises that chance by 30 (25 to 34) points.")
    choice = replace(found.decision, inputs=[replace(first, flip="flooded", flip_interval=None)])
    words = worded(found, choice).sentences[1]
    assert "flooded" not in words and words.startswith("Most decisive unknown: cage.imbalance_um. Measuring it")
    loose = replace(found.decision, inputs=[replace(first, flip_interval=None)])
    words = worded(found, loose).sentences[1]
    assert "The value at which it changes the choice is too uncertain to state. Measuring it" in words
    assert Robust.model_fields["points"].metadata[-1].le == MOST_PAIRS


def test_closed_form_of_the_odds_of_limits(judgement: tuple[Problem, Any]) -> None:
    """Closed form: the impact of the selected design is 78.4 N times the mass over 45 g, uniform from 40 to 50 g; both its limits count."""
    _, found = judgement
    low, high = (45.0 * each / 78.4 for each in (72.0, 80.0))
    assert set(found.odds) == {"impact_force_N", "power_loss_W"}
    assert found.odds["impact_force_N"].value == pytest.approx((high - low) / 10.0, abs=0.02)
    assert found.odds["impact_force_N"].low < (high - low) / 10.0 < found.odds["impact_force_N"].high
    assert found.odds["power_loss_W"].value == 0.0


def test_doubtful_rows_get_more_replicates_within_the_share_allowed(tmp_path: Path) -> None:
    study = _study(tmp_path, IMBALANCE, settle=4.0)
    simulations = _Simulations(0.03)
    found = judge(study, study.baseline * [1.0, 1.0, 0.8], simulations)  # type: ignore[arg-type]
    assert set(simulations.replicates) == {2, 4, 8}
    assert 768 < found.runs <= 1280
    assert sum(simulations.replicates) / 2 == found.runs
    assert found.chances.all.value == pytest.approx(0.4, abs=0.12)


ALL_VARY = """
[uncertain]
inputs = 2
"cage.imbalance_um" = { law = "uniform", low = 0.0, high = 50.0 }
"""


class _Rest(_Simulations):
    """The selected design gains in whirl only with a short pocket and little oil: of these at most one is in an emulator."""

    def _one(self, scene: Scene) -> _Result:
        picked = scene.cage.pocket_clearance_mm < 0.3
        length = scene.cage.pocket_contact_length_mm or scene.bearing.effective_length_mm
        short = length < 0.75 * scene.bearing.effective_length_mm
        little = scene.lubricant.oil_fraction < np.sqrt(0.005 * 0.1)
        gain = np.array([0.02, 0.02 if short and little else -0.02, 0.02]) if picked else np.zeros(3)
        random = np.random.default_rng([scene.numerics.seed, picked])
        level = np.array([80.0 * np.exp(0.01 * scene.cage.imbalance_um), 0.4, 230.0])
        return _Result((level * (1.0 - gain) * (1.0 + self.error * random.standard_normal(3))).tolist(), self.error)


def test_inputs_without_an_effect_on_levels_still_count(tmp_path: Path) -> None:
    """A gain that hangs on two inputs which no level shows, one of them in no emulator: its chance is a quarter all the same."""
    study = _study(tmp_path, ALL_VARY)
    found = judge(study, study.baseline * [1.0, 1.0, 0.8], _Rest(0.001))  # type: ignore[arg-type]
    assert len(found.inputs) == 23 and len(found.screened) == 21 and "cage.imbalance_um" not in found.screened
    assert found.chances.all.value == pytest.approx(0.25, abs=0.04)
    assert found.chances.all.low < 0.25 < found.chances.all.high
    named = {each.key for each in found.inputs} - set(found.screened) - {"cage.imbalance_um"}
    assert named <= {"cage.pocket_contact_length_mm", "lubricant.oil_fraction"}
    (other,) = {"cage.pocket_contact_length_mm", "lubricant.oil_fraction"} - named
    # Its main effect is a third of the variance: 1/16 of 3/16.
    assert found.screened[other] == max(found.screened.values()) == pytest.approx(0.25, abs=0.12)
    assert json.loads(json.dumps(found.as_dict()))["screened"] == found.screened


@pytest.mark.parametrize(("points", "first"), [(256, 128), (1024, 128), (64, 32), (16, 8)])
def test_points_are_simulated_at_input_sets_that_no_emulator_saw(points: int, first: int) -> None:
    rows = fresh_rows(points)
    assert len(set(rows.tolist())) == 128 and rows[:first].tolist() == list(range(first))
    assert not set(rows.tolist()) & set(range(points // 2, points))


class _Outputs(_Simulations):
    """Outputs of scenes that follow the imbalance alone, with an error of one replicate; counts what ran."""

    def __init__(self, error: float) -> None:
        super().__init__(error)
        self.seeds = list[int]()

    def run(self, scenes: Sequence[Scene], labels: Sequence[str], progress: Any) -> list[Any]:
        return [self._output(scene) for scene in scenes]

    def _output(self, scene: Scene) -> Any:
        self.replicates.append(scene.numerics.replicates)
        self.seeds.append(scene.numerics.seed)
        random = np.random.default_rng(scene.numerics.seed)
        error = self.error / np.sqrt(scene.numerics.replicates)
        values = (10.0 + 0.1 * scene.cage.imbalance_um) * np.ones(4) + error * random.standard_normal(4)
        half = 2.2 * error * np.sqrt(random.chisquare(8, 4) / 8.0)
        result = _Result((1.0, 1.0, 1.0), 0.0)
        result.responses = {
            name: Quantity(value, wide, 0.0, 9.0, 8)
            for name, value, wide in zip(OUTPUTS, values.tolist(), half.tolist(), strict=True)
        }
        return result


@pytest.mark.parametrize(("error", "most"), [(0.3, 2), (0.8, 4), (5.0, 8)])
def test_replicates_follow_the_share_of_noise(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: float, most: int
) -> None:
    """Inputs make a variance of 25/12: two replicates leave 0.02, 0.13 and 0.86 of a run's variance to noise."""
    monkeypatch.setattr("doe.workflow.uncertainty.OUTPUTS", OUTPUTS[:1])
    simulations = _Outputs(error)
    found = find_uncertainty(_scene(tmp_path, IMBALANCE), (), simulations, 64, 1.0)  # type: ignore[arg-type]
    # After the scene as it is; what ran before comes from the store.
    ran = dict(zip(simulations.seeds[1:], simulations.replicates[1:], strict=True))
    assert max(ran.values()) == max(most // 2, 2) and sum(ran.values()) == 64 * most
    share = error**2 / most / (error**2 / most + 25.0 / 12.0)
    assert found.responses["impact_force_N"].variance.simulation == pytest.approx(share, rel=0.4, abs=0.01)


def test_more_replicates_are_the_mean_of_all(tmp_path: Path) -> None:
    """Against all replicates by hand: means, variances of these and degrees of freedom, at every set."""
    case = read_case(_scene(tmp_path, IMBALANCE), OUTPUTS, ())
    quantiles = case.joint(case.every).sets(16, 1)
    whole = replicated_sets(case, quantiles, _Outputs(0.5), 4)  # type: ignore[arg-type]
    seeds = (0, ROUND_SEEDS, 2 * ROUND_SEEDS)
    more = ([], ["numerics.replicates=2"], ["numerics.replicates=4"])
    parts = [run(case, case.every, quantiles, _Outputs(0.5), *each) for each in zip(seeds, more, strict=True)]  # type: ignore[arg-type]
    weights = np.array([0.25, 0.25, 0.5])
    values, variances, freedom = map(list, zip(*(each.outputs for each in parts), strict=True))
    assert whole.outputs.values == pytest.approx(np.einsum("p,pnm->nm", weights, values))
    assert whole.outputs.variances == pytest.approx(np.einsum("p,pnm->nm", weights**2, variances))
    assert (whole.outputs.freedom == sum(freedom) + 2).all()


def test_set_of_a_run_says_which_runs_it_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    overrides = ["numerics.turns=80", "numerics.rtol=0.003", "cage.imbalance_um=3.0"]
    case = read_case(_scene(tmp_path, MASS), OUTPUTS, overrides)
    assert override_notes(case, overrides, "the run at the scene's own inputs") == [
        "--set numerics.turns=80 changes the run at the scene's own inputs, not the input sets: uncertain.set gives these numerics.turns=20",
        "--set numerics.rtol=0.003 changes every run",
    ]
    assert override_notes(case, ["numerics.turns=80"]) == [
        "--set numerics.turns=80 changes no run: uncertain.set gives all of them numerics.turns=20"
    ]
    assert override_notes(case, ["numerics.turns=20"]) == ["--set numerics.turns=20 changes every run"]
    assert override_notes(case, ["cage.imbalance_um=3.0"]) == []
    monkeypatch.setattr("doe.workflow.uncertainty.OUTPUTS", OUTPUTS[:1])
    found = find_uncertainty(_scene(tmp_path, IMBALANCE), overrides[:1], _Outputs(0.1), 16, 1.0)  # type: ignore[arg-type]
    assert found.notes[0].startswith("2 of 26 inputs vary, the others count as exact (")
    assert found.notes[1].startswith("--set numerics.turns=80 changes the run at the scene's own inputs")


def test_a_study_says_where_input_sets_differ_from_its_runs(judgement: tuple[Problem, Any]) -> None:
    _, found = judgement
    runs = "other runs of the study, not the input sets: uncertain.set gives these numerics.turns=20, numerics.replicates=2"
    assert found.sentences[-2].startswith("2 of 26 inputs vary, the others count as exact (")
    assert found.sentences[-1] == f"scene.set: numerics.turns=40, numerics.replicates=8 changes {runs}."


def test_a_factor_cannot_be_unknown_too(tmp_path: Path) -> None:
    law = '[uncertain]\n"cage.pocket_clearance_mm" = { law = "uniform", low = 0.2, high = 0.4 }\n'
    with pytest.raises(InputError, match="is a factor of the study too"):
        case_of_study(_study(tmp_path, law))


def test_what_varies_cannot_be_measured(tmp_path: Path) -> None:
    """What differs from bearing to bearing has no value that a measurement could give."""
    varies = _study(tmp_path, IMBALANCE.replace("high = 50.0 }", 'high = 50.0, kind = "varies" }', 1))
    found = judge(varies, varies.baseline * [1.0, 1.0, 0.8], _Simulations(0.002))  # type: ignore[arg-type]
    assert [each.key for each in found.decision.inputs] == ["cage.mass_g"] and found.decision.inputs[0].worth < 0.02


class _Trade(_Simulations):
    """Whirl and impact gain with a small pocket, in whirl the more the heavier the cage; the loss with a large guide clearance,
    where whirl loses if the imbalance is large."""

    def _one(self, scene: Scene) -> _Result:
        pocket, guide = 0.3 - scene.cage.pocket_clearance_mm, scene.cage.guide_clearance_mm - 0.15
        gain = np.array([pocket, pocket - 0.05 * guide * scene.cage.imbalance_um, 2.0 * guide])
        random = np.random.default_rng([scene.numerics.seed, round(1e3 * guide + 1e6)])
        level = np.array([80.0 * scene.cage.mass_g / 45.0, 0.4, 230.0])
        return _Result((level * (1.0 - gain) * (1.0 + self.error * random.standard_normal(3))).tolist(), self.error)


@pytest.mark.parametrize("kind", ["quantile", pytest.param("mean", marks=pytest.mark.slow)])
def test_robust_front_keeps_what_it_promises(tmp_path: Path, kind: str) -> None:
    """Closed form: the gain in whirl is pocket - 0.05 guide imbalance, whose 10 % quantile is that at 45 um, its mean at 25."""
    study = _study(tmp_path, IMBALANCE, front=kind)
    found = judge(study, np.add(study.baseline, [0.0, 0.08, -0.05]), _Trade(0.002)).front  # type: ignore[arg-type]
    assert found is not None and min(found.q2.values()) > 0.95
    predicted = np.array([list(point.factors.values()) for point in found.points])
    pocket, guide = 0.3 - predicted[:, 2], predicted[:, 1] - 0.15
    at = np.where(guide > 0.0, 45.0, 5.0) if kind == "quantile" else 25.0
    truth = np.column_stack([pocket, pocket - 0.05 * guide * at, 2.0 * guide])
    assert np.abs(np.array([list(point.gains.values()) for point in found.points]) - truth).max() < 0.01
    # The smallest pocket is best in impact and whirl; guide clearance trades loss for whirl.
    assert pocket == pytest.approx(np.full(len(pocket), pocket.max()), abs=0.01)
    assert np.ptp(guide) > 0.05
    pick, surest, *_ = found.confirmed
    assert (pick.name, surest.name) == ("pick", "robust surest")
    # The selected design's guide costs more whirl than its pocket gains where the imbalance is above 12.5 um.
    assert pick.chances.all.value == pytest.approx(0.25, abs=0.05) and surest.chances.all.value > 0.98
    for each in found.confirmed:
        _, guide_mm, pocket_mm = each.factors.values()
        x, y = 0.3 - pocket_mm, guide_mm - 0.15
        worst = 45.0 if y > 0.0 else 5.0
        middle = x - 0.05 * y * (worst if kind == "quantile" else 25.0)
        assert list(each.gains.values()) == pytest.approx([x, middle, 2.0 * y], abs=0.01)


def test_a_factor_need_not_stand_in_the_scene(tmp_path: Path) -> None:
    study = _study(tmp_path, IMBALANCE)
    text = study.path.read_text("utf-8")
    study.path.write_text(text.replace('"cage.guide_clearance_mm"', '"lubricant.oil_fraction"'), "utf-8")
    assert "oil_fraction" not in Problem.load(study.path).scene_tables["lubricant"]


def test_a_study_is_not_finished_once_its_steps_change() -> None:
    """The packages themselves hold no code: their steps count."""
    assert set(code_behind(CODE)) > {
        "doe.unknown.decision",
        "doe.response_surface.least_squares",
        "doe.workflow.judgement",
    }


@pytest.mark.parametrize("where", ["study.toml", "cylindrical_roller.toml"])
def test_a_study_is_not_finished_once_its_sample_changes(tmp_path: Path, where: str) -> None:
    study, digests = _study(tmp_path, ""), []
    with (tmp_path / where).open("a", encoding="utf-8") as file:
        file.write('\n[uncertain]\nsample = "posterior.csv"\n')
    for rows in ("1\n2\n", "1\n3\n"):
        (tmp_path / "posterior.csv").write_text(f"cage.mass_g\n{rows}", "utf-8")
        digests.append(inputs_digest(Problem.load(study.path)))
    assert digests[0] != digests[1]
