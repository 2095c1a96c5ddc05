"""``doe uncertainty`` and the judgement of ``doe study --robust``: files, keys, resumption, bad input; known truths."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from doe.cli import app
from doe.report.steps.robust import robust_record
from doe.study.robust import check_robust, judge
from doe.study_file import Study
from rbdyn.faults import InputError
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


def _scene(folder: Path, uncertain: str = UNCERTAIN) -> Path:
    path = folder / "scene.toml"
    path.write_text((EXAMPLES / "cylindrical_roller.toml").read_text("utf-8") + uncertain, "utf-8")
    return path


def _run(*arguments: str) -> Any:
    return CliRunner().invoke(app, ["uncertainty", *arguments])


def test_record_files_and_resumption(tmp_path: Path) -> None:
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
    assert record["runs"] in (16, 32, 64, 128, 256, 512) and record["failed"] == 0
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
        ('[uncertain]\n"cage.masss_g" = {law = "uniform", low = 1.0, high = 2.0}\n', "masss_g: unknown key"),
        ('[uncertain]\n"cage.mass_g" = {law = "uniform", low = -2.0, high = -1.0}\n', "narrow the laws"),
        ("[uncertain]\npoints = 100\n", "points = 100: no power of two; take 64"),
    ],
)
def test_bad_declarations_end_in_one_sentence(tmp_path: Path, uncertain: str, sentence: str) -> None:
    found = _run(str(_scene(tmp_path, uncertain)), "--out", str(tmp_path / "out"), *(f"--set={each}" for each in SHORT))
    assert found.exit_code in (1, 2)
    assert sentence in found.output and "Traceback" not in found.output


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
    """A result of a simulation that never ran."""

    def __init__(self, values: Sequence[float], error: float) -> None:
        names = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W")
        self.figures = {
            name: {"value": value, "statistical_error": 2.4 * error * value, "effective_samples": 8.0}
            for name, value in zip(names, values, strict=True)
        }

    def as_dict(self) -> dict[str, Any]:
        return self.figures


class _Simulations:
    """Responses in closed form: the pick gains 2 % in impact and loss, in whirl only below an imbalance of 20 um."""

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


def _study(folder: Path, uncertain: str, settle: float = 0.5) -> Study:
    text = (EXAMPLES / "clearance_study.toml").read_text("utf-8")
    (folder / "cylindrical_roller.toml").write_text((EXAMPLES / "cylindrical_roller.toml").read_text("utf-8"), "utf-8")
    for each in EXAMPLES.glob("*.csv"):
        (folder / each.name).write_bytes(each.read_bytes())
    (folder / "study.toml").write_text(f"{text}\n[robust]\npoints = 128\nsettle = {settle}\n{uncertain}", "utf-8")
    return Study.load(folder / "study.toml")


IMBALANCE = """
[uncertain]
defaults = "none"
"cage.imbalance_um" = { law = "uniform", low = 0.0, high = 50.0 }
"cage.mass_g" = { law = "uniform", low = 40.0, high = 50.0 }
"""


def test_the_unknown_that_decides_is_named_with_its_flip(tmp_path: Path) -> None:
    study = _study(tmp_path, IMBALANCE)
    simulations = _Simulations(0.002)
    found = judge(study, study.baseline * [1.0, 1.0, 0.8], simulations)  # type: ignore[arg-type]
    shares = dict(zip(found.responses, found.better.each, strict=True))
    assert shares["impact_force_N"].value > 0.98 and shares["power_loss_W"].value > 0.98
    assert found.better.all.value == pytest.approx(0.4, abs=0.05)
    assert found.decides[0].key == "cage.imbalance_um"
    assert found.decides[0].flip == pytest.approx(20.0, abs=1.5)
    assert found.decides[0].worth == pytest.approx(0.4, abs=0.05)
    assert found.decides[1].worth < 0.02 and found.decides[1].flip is None
    record = robust_record(found)
    assert set(record) >= {"better", "all", "decides", "pairs"} and record["pairs"] == 128
    assert "cage.imbalance_um decides most" in record["sentences"][1]
    assert json.loads(json.dumps(record)) == record


def test_doubtful_rows_get_more_replicates_within_the_share_allowed(tmp_path: Path) -> None:
    study = _study(tmp_path, IMBALANCE, settle=4.0)
    simulations = _Simulations(0.03)
    found = judge(study, study.baseline * [1.0, 1.0, 0.8], simulations)  # type: ignore[arg-type]
    assert set(simulations.replicates) == {2, 4, 8}
    assert 768 < found.runs <= 1280
    assert sum(simulations.replicates) / 2 == found.runs
    assert found.better.all.value == pytest.approx(0.4, abs=0.12)


def test_a_factor_cannot_be_unknown_too(tmp_path: Path) -> None:
    law = '[uncertain]\n"cage.pocket_clearance_mm" = { law = "uniform", low = 0.2, high = 0.4 }\n'
    with pytest.raises(InputError, match="is a factor of the study too"):
        check_robust(_study(tmp_path, law))
