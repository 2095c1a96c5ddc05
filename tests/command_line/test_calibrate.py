"""``doe calibrate``: bad input in one sentence each, a rig of one's own recovered, files, the answer again."""

import csv
import json
import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

import doe
from doe.cli import app
from doe.report.sections.calibration import blocks, files_of, signed, stored, write
from doe.workflow.calibration import calibration_stages, design_of, find_calibration, question_of, read_question
from doe.workflow.identification import Calibration
from doe.workflow.rig import read_rig
from doe.workflow.status import scene_identity
from rbdyn.base.terminal import text
from rbdyn.result import Quantity
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
SHORT = [
    "numerics.turns=2", "numerics.discard_turns=1", "numerics.impact_window_turns=1", "numerics.replicates=2",
    "numerics.extend=false", "numerics.companion=false",
]  # fmt: skip
UNCERTAIN = f"""
[uncertain]
defaults = "none"
set = {json.dumps(SHORT)}
"model.pocket_bar_stiffness_N_m" = {{ law = "log_uniform", low = 1e7, high = 2e8 }}
"lubricant.oil_fraction" = {{ law = "log_uniform", low = 0.005, high = 0.1 }}
"model.drag_coefficient" = {{ law = "log_uniform", low = 0.3, high = 1.2 }}
"cage.mass_g" = {{ law = "uniform", low = 40.0, high = 50.0 }}
"""
HEADER = "operation.inner_speed_rpm,impact_force_N,impact_force_N_sd,power_loss_W,power_loss_W_sd"
ROWS = ["12000,40,1,40,1", "18000,60,1,100,2", "24000,80,2,180,3"]


def _files(folder: Path, uncertain: str = UNCERTAIN, header: str = HEADER, rows: Sequence[str] = ROWS) -> list[str]:
    scene, rig = folder / "scene.toml", folder / "rig.csv"
    scene.write_text((EXAMPLES / "cylindrical_roller.toml").read_text("utf-8") + uncertain, "utf-8")
    rig.write_text("\n".join([header, *rows]) + "\n", "utf-8")
    return [str(scene), "--data", str(rig), "--out", str(folder / "out")]


def _run(arguments: Sequence[str]) -> Any:
    return CliRunner().invoke(app, ["calibrate", *arguments])


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"header": HEADER.replace("inner_speed", "inner_sped")}, "inner_sped_rpm: unknown key; did you mean"),
        ({"header": HEADER.replace("impact_force_N", "impact")}, "column impact: neither a key of a scene"),
        ({"header": HEADER.replace("power_loss_W_sd", "cage_slip")}, "give cage_speed_rpm, which means the same"),
        ({"header": HEADER.replace("power_loss_W_sd", "cutof_hz")}, "column cutof_hz: neither a key of a scene"),
        ({"header": HEADER.replace("power_loss_W", "torque_sd", 1)}, "no output torque is measured here"),
        ({"header": "impact_force_N,impact_force_N_sd", "rows": ["40,1"] * 3}, "no operating condition"),
        ({"header": "operation.inner_speed_rpm,turns", "rows": ["12000,9"] * 3}, "no measured output"),
        ({"rows": [*ROWS[:2], "24000,80,,180,3"]}, "impact_force_N_sd in row 3: is missing; give it, or turns"),
        ({"rows": [*ROWS[:2], "24000,-80,2,180,3"]}, "impact_force_N in row 3 = -80: is not above 0; check the sign"),
        ({"rows": [*ROWS[:2], "1e12,80,2,180,3"]}, "operation.inner_speed_rpm in row 3 = 1e12: is not a value of that key"),
        ({"rows": [*ROWS[:2], f"{'9' * 5000},80,2,180,3"]}, "is longer than 400 characters; write a shorter value"),
        ({"rows": [*ROWS[:2], "1e400,80,2,180,3"]}, "operation.inner_speed_rpm in row 3 = 1e400: is not a value of that key"),
        ({"rows": [*ROWS[:2], "24OOO,80,2,180,3"]}, "operation.inner_speed_rpm in row 3 = '24OOO': is not a value of that key"),
        ({"rows": [*ROWS[:2], ",80,2,180,3"]}, "operation.inner_speed_rpm in row 3 = '': is empty; fill it in"),
        ({"rows": [*ROWS[:2], "24000,80,0,180,3"]}, "impact_force_N_sd in row 3 = 0: is not above 0; check the sign"),
        ({"rows": [*ROWS[:2], "24000,8e1_0,2,180,3"]}, "impact_force_N in row 3 = '8e1_0': is not a finite number"),
        ({"rows": [*ROWS[:2], "24000,,2,180,3"]}, "impact_force_N_sd in row 3 = 2: has no use in this row"),
        ({"header": HEADER + ",", "rows": [f"{row},9" for row in ROWS]}, "column 6 has no name; name it or remove it"),
        ({"header": HEADER.replace("power_loss_W_sd", "whirl_accuracy_percent")}, "no output whirl is measured here"),
        ({"header": HEADER + ",power_loss_W_accuracy_percent", "rows": [f"{ROWS[0]},3", f"{ROWS[1]},", f"{ROWS[2]},5"]},
         "power_loss_W_accuracy_percent in row 3 = 5: is 3 in row 1; a sensor has one accuracy in all rows"),
        ({"header": HEADER + ",power_loss_W_accuracy_percent", "rows": [f"{ROWS[0]},300", *(f"{row}," for row in ROWS[1:])]},
         "power_loss_W_accuracy_percent in row 1 = 300: is beyond 100; check the unit"),
        ({"rows": [*ROWS[:2], "24000,80,80,180,3"]}, "impact_force_N_sd in row 3 = 80: is not below the value itself, 80"),
        ({"header": HEADER + ",cage_speed_rpm,cage_speed_rpm_sd", "rows": [f"{row},13000,1" for row in ROWS]},
         "cage_speed_rpm in row 1 = 13000: is above 12000 rpm, the speed of the faster ring (1 of 3 rows); check the columns"),
        ({"rows": ROWS[:1] * 3}, "all rows have one operating condition, so none predicts another; measure at two at least"),
        ({"rows": [f"{9000 + row},40,1,40,1" for row in range(150)]}, "150 operating conditions take up to 53550 runs, 50000 at most"),
        ({"rows": [f"{row},40,1,40,1" for row in range(1, 1002)]}, "has 1001 rows; give 1000 at most"),
        ({"rows": [f"{row},40,1,40,1" for row in range(1, 202)]}, "has 201 operating conditions; give 200 at most"),
        ({"rows": ROWS[:2]}, "only 2 rows not on hold; at least 3 are needed"),
        ({"header": HEADER + ",hold", "rows": [f"{row},1" for row in ROWS]}, "only 0 rows not on hold"),
        ({"header": HEADER + ",hold", "rows": [f"{row},perhaps" for row in ROWS]}, "write 1 for a row that is held out"),
        ({"uncertain": UNCERTAIN.replace("low = 40.0", "low = -40.0")}, 'uncertain."cage.mass_g" at -'),
        ({"uncertain": UNCERTAIN.replace("cage.mass_g", "operation.inner_speed_rpm")}, "is a target too"),
        ({"uncertain": UNCERTAIN.replace("set =", "sample = 'old.csv'\nset =")}, "is a result of calibration; leave it out"),
        ({"uncertain": UNCERTAIN + "[calibrate.discrepancy]\nwhirl = 0.1\n"}, "discrepancy: whirl is not measured"),
        ({"uncertain": UNCERTAIN + "[calibrate]\ndiscrepancy = 'some'\n"}, "calibrate.discrepancy"),
        ({"uncertain": UNCERTAIN.replace("set = [", "set = ['operation.inner_speed_rpm=1e4', ")}, "is a column of"),
        ({"header": HEADER.replace("operation.inner_speed_rpm", "numerics.seed")}, "column numerics.seed: every run has a seed"),
        ({"header": HEADER.replace("operation.inner_speed_rpm", "calibrate.seed")}, "calibrate.seed: no run depends on it"),
    ],
)  # fmt: skip
def test_bad_input_ends_in_a_sentence_before_anything_runs(
    tmp_path: Path, change: dict[str, Any], sentence: str
) -> None:
    found = _run(_files(tmp_path, **change))
    assert found.exit_code == 2, found.output
    assert sentence in found.output and "Traceback" not in found.output
    assert not (tmp_path / "out" / "study.sqlite").exists()


@pytest.mark.parametrize(
    "shift",
    [
        lambda number, cells: [str(number), *cells],
        lambda number, cells: [str(number), *cells[:-1]],
        lambda number, cells: ["", *cells[:-1]],
        lambda number, cells: [*cells[1:], ""],
        lambda number, cells: [*cells[1:], cells[0]],
        lambda number, cells: [cells[0], cells[2], cells[1], *cells[3:]],
    ],
    ids=["a field too many", "an index", "blank first", "left", "around", "swapped"],
)
def test_shifted_columns_get_one_sentence(tmp_path: Path, shift: Any) -> None:
    """Command line: not a sentence a cell, and no thousand runs of conditions that were never measured."""
    rows = [",".join(shift(number, row.split(","))) for number, row in enumerate(ROWS, 1)]
    found = _run(_files(tmp_path, rows=rows))
    assert found.exit_code == 2
    (sentence,) = found.output.strip().splitlines()
    assert "row 1" in sentence and ("more rows are like it" in sentence or "which may be shifted" in sentence)


def test_unit_each_output_has_the_accuracy_of_its_sensor(tmp_path: Path) -> None:
    """Unit: one value states that of all rows, and a default stands for the others."""
    header = HEADER + ",impact_force_N_accuracy_percent"
    _files(tmp_path, header=header, rows=[f"{ROWS[0]},", f"{ROWS[1]},25", f"{ROWS[2]},"])
    assert read_rig(tmp_path / "rig.csv").accuracies == {"impact_force_N": 0.25, "power_loss_W": 0.03}


def test_the_same_table_in_any_form_asks_the_same_bounded_question(tmp_path: Path) -> None:
    """Unit: decimal commas, semicolons, tabs and UTF-16 take the runs of the plain table."""
    header, rows, stages = HEADER, ["12000,40.5,1.5,40,1", *ROWS[1:]], []
    for mark, comma, encoding in (
        (",", ".", "utf-8"),
        (";", ",", "utf-8"),
        ("\t", ",", "utf-16"),
        (";", ".", "utf-16"),
    ):
        scene, _, rig, *_ = _files(tmp_path)
        text = "\n".join([header, *rows]).replace(",", mark)
        Path(rig).write_text(text.replace(".", comma).replace(f"operation{comma}", "operation."), encoding)
        question = read_question(Path(scene), Path(rig), (), ())
        assert question.rig.rows[0].values == {"impact_force_N": 40.5, "power_loss_W": 40.0}
        stages.append([(stage.name, stage.runs, stage.most) for stage in calibration_stages(question)])
    assert stages.count(stages[0]) == 4
    assert sum(most or runs for _, runs, most in stages[0]) == 3 * (1 + 4 * 64 + 2 * 50)


def test_unit_keys_of_a_rig_have_the_types_of_the_scene(tmp_path: Path) -> None:
    """Unit: whole numbers, booleans, text and numbers of a row are what a scene file would give."""
    header = HEADER + ",bearing.rollers,model.pocket_film,model.pocket_bar_stiffness_N_m,lubricant.oil"
    more = ["10,true,rigid,ISO VG 32", "+11,False,50000000,ISO VG 46", "12,TRUE,5e7,data_sheet"]
    _files(tmp_path, header=header, rows=[f"{row},{rest}" for row, rest in zip(ROWS, more, strict=True)])
    values = [list(row.keys.values()) for row in read_rig(tmp_path / "rig.csv").rows]
    expected = [
        [12e3, 10, True, "rigid", "ISO VG 32"],
        [18e3, 11, False, 5e7, "ISO VG 46"],
        [24e3, 12, True, 5e7, "data_sheet"],
    ]
    assert values == expected
    assert [[type(value) for value in row] for row in values] == [[type(value) for value in row] for row in expected]


def test_unit_a_rig_of_many_columns_is_read_in_linear_time(tmp_path: Path) -> None:
    """Unit: 100 000 columns, of which a comparison of each with all takes minutes, are refused within seconds."""
    names = [f"cage.key_{number}" for number in range(100_000)]
    arguments = _files(
        tmp_path, header=",".join([*HEADER.split(","), *names]), rows=[row + ",1" * len(names) for row in ROWS]
    )
    start = time.process_time()
    refused = _run(arguments)
    assert refused.exit_code == 2 and "cage.key_0: unknown key" in refused.output
    assert time.process_time() - start < 10.0


def test_free_keys_need_a_law(tmp_path: Path) -> None:
    found = _run([*_files(tmp_path), "--free", "bearing.rollers"])
    assert (
        found.exit_code == 2
        and "--free bearing.rollers: has neither a law in uncertain nor a documented" in found.output
    )


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--free", "cage.imbalance_um"], "--free cage.imbalance_um: uncertain.set gives its value"),
        (["--set", "operation.inner_speed_rpm=1e4"], "--set operation.inner_speed_rpm=1e4: is a column of"),
        (["--set", "cage.mass_g=46.0"], "--set cage.mass_g=46.0: the uniform law of this unknown input replaces it"),
    ],
)
def test_options_that_no_run_would_have_are_refused(tmp_path: Path, options: list[str], sentence: str) -> None:
    """Unit: a key that ``set``, a law or the rig's table gives is neither sought nor set beside them."""
    files = _files(tmp_path, UNCERTAIN.replace("set = [", "set = ['cage.imbalance_um=7.0', "))
    found = _run([*files, *options])
    assert found.exit_code == 2 and sentence in found.output
    # What is not sought keeps the value that is set.
    scene, _, rig, *_ = files
    free = ["model.drag_coefficient"]
    assert read_question(Path(scene), Path(rig), free, ["cage.mass_g=46.0"]).case.scene.cage.mass_g == 46.0


def test_a_rig_of_german_excel_with_gaps_is_read_with_notes_on_both(tmp_path: Path) -> None:
    """Semicolons and decimal commas; a row without one output serves the other."""
    rows = ["12000;40,5;1;40;1", "18000;;;100;2,5", "24000;80;2;180;3", "18000;60;1;99;2", ";" * 4]
    _files(tmp_path, header=HEADER.replace(",", ";"), rows=rows)
    path = tmp_path / "rig.csv"
    rig = read_rig(path)
    assert [row.values.get("impact_force_N") for row in rig.rows] == [40.5, None, 80.0, 60.0]
    assert rig.rows[1].sds == {"power_loss_W": 2.5}
    assert rig.notes == (
        f"{path}: read with semicolons and decimal commas",
        f"{path}: impact_force_N has no value in row 2; it does without that row, which serves the others",
    )


class _Result:
    """A result of a simulation that never ran."""

    counted_turns, replicates = 40.0, 2

    def __init__(self, values: dict[str, float], errors: dict[str, float]) -> None:
        self.responses = {
            name: Quantity(value * (1.0 + errors[name] * noise), 2.4 * errors[name] * value, 0.0, 8.0, 7)
            for (name, value), noise in zip(values.items(), errors["noise"], strict=True)  # type: ignore[call-overload]
        }


def _responses(scene: Scene) -> dict[str, float]:
    """Impact by speed and bar stiffness, losses by a part of the load and one of drag."""
    speed, load = scene.operation.inner_speed_rpm / 24000.0, scene.operation.radial_load_N / 1300.0
    drag = 30.0 * scene.model.drag_coefficient * (scene.lubricant.oil_fraction / 0.02) * speed**3
    stiffness = float(scene.model.pocket_bar_stiffness_N_m) / 5e7
    impact = 80.0 * stiffness**0.35 * speed * load**0.1 + 10.0 * (scene.cage.mass_g / 45.0) * speed**2
    return {"impact_force_N": impact, "power_loss_W": 60.0 * load * speed + drag}


class _Simulations:
    def __init__(self, errors: tuple[float, float] = (0.01, 0.003)) -> None:
        self.errors, self.runs = errors, 0

    def progress(self, title: str) -> Any:
        return lambda done, total: None

    def run(self, scenes: Sequence[Scene], labels: Sequence[str], progress: Any) -> list[_Result]:
        self.runs += len(scenes)
        return [self._one(scene) for scene in scenes]

    def _one(self, scene: Scene) -> _Result:
        noise = np.random.default_rng(scene.numerics.seed).standard_normal(2)
        impact, loss = self.errors
        return _Result(_responses(scene), {"impact_force_N": impact, "power_loss_W": loss, "noise": noise})  # type: ignore[dict-item]


CONDITIONS = [(12000.0, 600.0), (12000.0, 2000.0), (18000.0, 600.0), (18000.0, 1300.0), (18000.0, 2500.0),
              (24000.0, 800.0), (24000.0, 1300.0), (28000.0, 2000.0)]  # fmt: skip
HIDDEN = {"model.pocket_bar_stiffness_N_m": 3e7, "lubricant.oil_fraction": 0.03, "model.drag_coefficient": 0.6}


def _own_rig(folder: Path, more: str = "", reads: float = 1.0) -> list[str]:
    """A rig made from a hidden scene, whose loss sensor ``reads`` so many times the loss; rows 2, 5 and 7 are held out."""
    random, rows = np.random.default_rng(1), []
    hidden = Scene.load(EXAMPLES / "cylindrical_roller.toml").changed(HIDDEN)
    for place, (speed, load) in enumerate(CONDITIONS):
        scene = hidden.changed({"operation.inner_speed_rpm": speed, "operation.radial_load_N": load})
        cells = [
            f"{by * value * (1.0 + 0.02 * random.standard_normal()):.6g},{0.02 * by * value:.4g}"
            for by, value in zip((1.0, reads), _responses(scene).values(), strict=True)
        ]
        rows.append(f"{speed},{load},{','.join(cells)},{int(place in (1, 4, 6))}")
    header = HEADER.replace("inner_speed_rpm,", "inner_speed_rpm,operation.radial_load_N,") + ",hold"
    return _files(folder, UNCERTAIN + more, header, rows)


def test_a_rig_made_from_a_hidden_scene_gives_it_back(tmp_path: Path) -> None:
    scene, _, rig, *_ = _own_rig(tmp_path, "[calibrate.discrepancy]\nimpact_force_N = 0.03\npower_loss_W = 0.03\n")
    question = read_question(Path(scene), Path(rig), (), ())
    simulations = _Simulations()
    found = find_calibration(question, simulations)  # type: ignore[arg-type]
    record = found.as_dict()
    assert json.loads(json.dumps(record)) == record and type(found).from_dict(record).as_dict() == record
    assert found.verdict == "calibrated", found.reasons
    assert record["runs"] == simulations.runs <= 8 * (1 + 4 * 64 + 2 * 50)
    for key, value in HIDDEN.items():
        assert record["inputs"][key]["low"] < value < record["inputs"][key]["high"]
    # Bar stiffness by the impact; drag only as a product of two inputs, of which neither is known; the mass by nothing.
    assert record["inputs"]["model.pocket_bar_stiffness_N_m"]["seen"] == "learned"
    (ridge,) = record["combinations"]
    assert set(ridge["powers"]) == {"lubricant.oil_fraction", "model.drag_coefficient"}
    assert min(ridge["powers"].values()) > 0.8 and ridge["sd_percent"] < 0.25 * ridge["sd_percent_before"]
    assert record["inputs"]["cage.mass_g"]["seen"] == "not seen"
    assert record["held_out"]["rows"] == "held out" and record["held_out"]["values"] == 6
    assert record["held_out"]["width"]["values"] == 10 and record["held_out"]["width"]["chance"] > 0.05
    assert all(each["explained"] and each["allowed"] == 0.03 for each in record["outputs"].values())
    assert [each["accuracy_percent"] for each in record["outputs"].values()] == [10.0, 3.0]
    # The reader first hears which offset could hide, and what it does to the input that the output shows.
    impact = record["outputs"]["impact_force_N"]
    first = text(blocks(found)).split("\n\n")[0].replace("\n", " ")
    assert (
        first.startswith("calibrated: an offset of the impact force below") and "would not be seen and moves" in first
    )
    assert max(impact["moves_sd"], key=impact["moves_sd"].get) == "model.pocket_bar_stiffness_N_m"
    assert impact["moves"]["model.pocket_bar_stiffness_N_m"] > 0.0 and impact["resolution"] > 0.2
    assert "absorbed" not in text(blocks(found))
    assert set(record["discrepancy"]) == {"impact_force_N", "power_loss_W"}
    shown = text(blocks(found))
    assert shown.startswith("calibrated") and "identified combination lubricant.oil_fraction^1" in shown

    assert found.made_of == question_of(question)
    out, whole = tmp_path / "out", signed(found)
    out.mkdir()
    write(whole, out, scene_identity("doe calibrate", Path(scene), ()))
    assert all((out / name).stat().st_size > 0 for name in files_of(found))
    again = stored(out, found.made_of)
    assert again is not None and again.as_dict() == whole.as_dict() and stored(out, "made of that") is None
    with (out / "posterior.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 1000 and set(rows[0]) == {each.key for each in question.targets}
    answer = doe.calibrate(scene, rig, out=out)
    command = _run([scene, "--data", rig, "--out", str(out), "--json"])
    assert answer.as_dict() == whole.as_dict() == json.loads(command.stdout)
    assert answer.files == tuple(files_of(found)) and repr(answer).startswith("<CalibrationAnswer: calibrated: an")
    inputs = answer.table().set_index("input")
    assert (inputs["low"] < inputs["median"]).all() and inputs["contraction"].between(-1.0, 1.0).all()
    assert answer.table("cells").shape == (16, 13) and set(answer.table("outputs")["output"]) == set(record["outputs"])
    base = Scene.load(EXAMPLES / "cylindrical_roller.toml")
    assert base.changed({key: float(value) for key, value in rows[0].items()}).cage.mass_g == float(
        rows[0]["cage.mass_g"]
    )
    assert json.loads((out / "posterior.json").read_text("utf-8"))["verdict"] == "calibrated"


@pytest.mark.slow
def test_a_biased_sensor_ends_not_calibrated_and_is_named(tmp_path: Path) -> None:
    scene, _, rig, *_ = _own_rig(tmp_path, reads=1.2)
    found = find_calibration(read_question(Path(scene), Path(rig), (), ()), _Simulations())  # type: ignore[arg-type]
    impact, loss = (found.outputs[name] for name in ("impact_force_N", "power_loss_W"))
    assert found.verdict == "not calibrated"
    assert impact.explained and not loss.explained and loss.evidence > 10.0
    # A tenth of what the unknown inputs do to each output is allowed by default.
    assert 0.005 < loss.allowed < 0.05 < 0.2 < loss.discrepancy[2]
    assert any(reason.startswith("power loss is not explained") for reason in found.reasons)
    assert "power loss: not explained" in text(blocks(found))


def test_no_discrepancy_warns_and_a_missing_sd_is_that_of_a_run(tmp_path: Path) -> None:
    scene, _, rig, *_ = _own_rig(tmp_path, '[calibrate]\ndiscrepancy = "none"\nwaves = 1\n')
    lines = Path(rig).read_text("utf-8").splitlines()
    cells = [line.split(",") for line in lines]
    for row in cells[1:]:
        row[3] = ""
    text = [",".join([*row, "turns" if place == 0 else "20"]) for place, row in enumerate(cells)]
    Path(rig).write_text("\n".join(text), "utf-8")
    found = find_calibration(read_question(Path(scene), Path(rig), (), ()), _Simulations())  # type: ignore[arg-type]
    assert any("intervals are far too narrow" in note for note in found.notes)
    assert all(each.evidence is None for each in found.outputs.values())
    # Two replicates of 40 turns err by 1 %, one measurement of 20 turns by twice that.
    measured = found.evidence.match.measured
    impact = measured.variances[measured.output == 0]
    assert np.sqrt(impact) == pytest.approx(0.02, rel=0.1)


@pytest.mark.slow
def test_the_command_runs_and_answers_again_without_running(tmp_path: Path) -> None:
    command = [*_files(tmp_path, UNCERTAIN + "[calibrate]\nwaves = 1\n"), "--free", "cage.mass_g", "--json"]
    first = _run(command)
    assert first.exit_code == 0, first.output
    record = json.loads(first.stdout)
    assert {"verdict", "learned", "combinations", "discrepancy", "outputs", "held_out", "posterior"} <= set(record)
    assert set(record["learned"]) <= {"cage.mass_g"} and record["verdict"] != "calibrated"
    # Three rows cannot judge predictions: this is stated before the first run, and again at the end.
    question = read_question(Path(command[0]), Path(command[2]), ("cage.mass_g",), ())
    (doubt,) = record["reasons"][-1:]
    assert design_of(question).doubt == doubt and f"note: {doubt}" in " ".join(first.stderr.split())
    low, high = map(int, re.match(r"note: (\d+) to (\d+) runs \(", first.stderr).groups())
    assert low <= record["cost"]["runs"] <= high and record["cost"]["seconds"] > 0.0
    assert "shaft turns in all took" in text(blocks(Calibration.from_dict(record)))
    store = (tmp_path / "out" / "study.sqlite").stat().st_mtime_ns
    assert json.loads(_run(command).stdout) == record
    assert (tmp_path / "out" / "study.sqlite").stat().st_mtime_ns == store
