"""``doe fit``: errors and blocks of a table, what is printed and written, what is refused."""

import json
import time
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from short_studies import paper_study, with_paper_goals
from typer.testing import CliRunner, Result

from doe.cli import app
from doe.report.sections.fit import fit_blocks
from doe.running.store import StoppedError
from doe.study_file.table import read_table
from doe.workflow.problem import Problem
from doe.workflow.runs import read_runs
from doe.workflow.surfaces import fit_surfaces
from rbdyn.base.blocks import Detail
from rbdyn.base.terminal import text

EXAMPLES = Path(__file__).parents[2] / "examples"
TABLE = pd.read_csv(EXAMPLES / "ccd_table4.csv")
RESPONSES = ["impact_force_N", "whirl_deviation_ratio", "power_loss_W"]


def run(folder: Path, table: pd.DataFrame | str, *options: str, replace: tuple[str, str] = ("", "")) -> Result:
    """The command on a table and the example study, changed by ``replace``."""
    study(folder, replace)
    text = table if isinstance(table, str) else table.to_csv(index=False)
    (folder / "table.csv").write_text(text, encoding="utf-8")
    return CliRunner().invoke(app, ["fit", str(folder / "study.toml"), "--data", str(folder / "table.csv"), *options])


def study(folder: Path, replace: tuple[str, str] = ("", "")) -> Path:
    """The example study with linear models, which are quick, in a folder of its own."""
    text = with_paper_goals((EXAMPLES / "clearance_study.toml").read_text("utf-8")).replace('"quadratic"', '"linear"')
    path = folder / "study.toml"
    path.write_text(text.replace(*replace) if replace[0] else text, encoding="utf-8")
    return path


def with_errors() -> pd.DataFrame:
    """Table 4 with half-widths and their replicates, its runs in two blocks."""
    half = {f"{name}_error": 0.02 * TABLE[name] for name in RESPONSES}
    return TABLE.assign(**half, replicates=8, block=np.arange(20) % 2)


def test_errors_replicates_and_blocks_of_a_table_reach_the_fit(tmp_path):
    with_errors().to_csv(tmp_path / "table.csv", index=False)
    loaded = Problem.load(study(tmp_path))
    runs = read_runs(loaded, tmp_path / "table.csv")
    assert runs.errors == pytest.approx(0.02 * runs.values)
    assert runs.replicates.tolist() == [8] * 20 and runs.block.tolist() == [0, 1] * 10
    surface = fit_surfaces(loaded, runs)[0]
    assert set(surface.blocks) == {"0", "1"}
    assert surface.data.standard_errors == pytest.approx(0.02 * runs.values[:, 0] / 2.364624, rel=1e-6)
    assert surface.known_variance.dof == pytest.approx(7)


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> tuple[str, Path]:
    """What a verbose fit of the first response prints, and the folder that it writes."""
    folder = tmp_path_factory.mktemp("fit")
    text = (EXAMPLES / "clearance_study.toml").read_text(encoding="utf-8")
    start = text.index("[[response]]", text.index("[[response]]") + 1)
    others = text[start : text.index("[front]")]
    path = folder / "study.toml"
    path.write_text(text.replace(others, "").partition("[reference]")[0], encoding="utf-8")
    with_errors().to_csv(folder / "table.csv", index=False)
    options = ["--data", str(folder / "table.csv"), "--verbose", "--out", str(folder)]
    shown = CliRunner().invoke(app, ["fit", str(path), *options])
    assert shown.exit_code == 0, shown.output
    return shown.output, folder


def test_tables_are_written_beside_the_record(finished):
    printed, folder = finished
    record = json.loads((folder / "fit.json").read_text(encoding="utf-8"))["responses"][RESPONSES[0]]
    tables = [pd.read_csv(folder / f"{name}.csv") for name in ("coefficients", "anova", "runs")]
    coefficients, anova, runs = tables
    assert all(list(table["response"]) == [RESPONSES[0]] * len(table) for table in tables)
    assert list(runs["run"]) == list(range(1, 21))
    assert runs["cook"].tolist() == pytest.approx([run["cook"] for run in record["diagnostics"]["runs"]])
    found = coefficients.set_index("term")
    assert found["coefficient"].to_dict() == pytest.approx(record["coefficients"])
    assert found["standard_error"].to_dict() == pytest.approx(record["standard_errors"])
    assert found["actual_units"].to_dict() == pytest.approx(record["actual_coefficients"])
    assert list(anova["source"]) == [row["source"] for row in record["anova"]]
    assert {"block", "replicate_variance"} <= set(anova["source"])
    assert record["rival"]["recommended"] in ("polynomial", "gaussian_process")
    said = [sentence.partition(": ")[2] for sentence in record["sentences"]]
    assert {sentence[:1].upper() + sentence[1:] for sentence in said} <= set(printed.splitlines())


def test_a_statistician_recognises_the_tables(finished):
    printed, _ = finished
    for words in ("sum of squares", "mean square", "standard error", "95 % from", "VIF", "cook", "***"):
        assert words in printed
    assert "A = radial clearance [mm], B = guide clearance [mm]" in printed


def test_equations_are_in_coded_and_in_actual_units(tmp_path):
    TABLE.to_csv(tmp_path / "table.csv", index=False)
    loaded = Problem.load(study(tmp_path))
    surfaces = fit_surfaces(loaded, read_runs(loaded, tmp_path / "table.csv"))
    printed = text(fit_blocks(surfaces[:1], loaded.factors))
    assert "impact force = +203.7 +22.979 A +17.186 B +32.248 C (coded)" in printed
    assert "impact force = -133.26 +4595.7 A +343.72 B +644.96 C (actual units)" in printed
    quiet = text(fit_blocks(surfaces[:1], loaded.factors), Detail.LEAST).splitlines()
    said = [sentence.partition(": ")[2] for sentence in surfaces[0].sentences]
    assert quiet == ["impact force [N]", *(sentence[:1].upper() + sentence[1:] for sentence in said)]


MODEL = 'model = "linear"\ngoal'


@pytest.mark.parametrize(
    ("table", "replace", "words"),
    [
        (TABLE.head(4), ("", ""), "4 runs are too few for the linear model; give at least 5"),
        (TABLE.assign(guide_clearance_mm=0.15), ("", ""), "cannot separate B from the other terms"),
        (TABLE.assign(power_loss_W=9.0), ("", ""), "power_loss_W: all 20 values are 9, so there is nothing to fit"),
        (
            TABLE.assign(impact_force_N=TABLE["impact_force_N"] - 200),
            (MODEL, f"transform = 'box_cox'\n{MODEL}"),
            "a power transform needs positive values",
        ),
        (TABLE, (MODEL, f"transform = 'log'\n{MODEL}"), "transform = 'log': choose one of 'none' or 'box_cox', or"),
    ],
)
def test_bad_input_is_a_sentence_and_exit_2(tmp_path, table, replace, words):
    shown = run(tmp_path, table, "--out", str(tmp_path / "out"), replace=replace)
    assert shown.exit_code == 2
    assert any(words in line for line in shown.stderr.splitlines()), shown.stderr
    assert "Traceback" not in shown.output
    assert not (tmp_path / "out").exists()


def test_responses_without_a_column_are_left_out_with_a_note():
    """Command line: the example study names a response that its published table lacks; the others are fitted as without it."""
    study, table = str(EXAMPLES / "clearance_study.toml"), str(EXAMPLES / "ccd_table4.csv")
    record = json.loads(CliRunner().invoke(app, ["fit", study, "--data", table, "--json"]).stdout)
    (note,) = record["notes"]
    assert (
        note["text"] == f"{table} has no column of pocket_impact_power_W, which is left out"
        and note["level"] == "warning"
    )
    paper = paper_study()
    surfaces = fit_surfaces(paper, read_runs(paper, Path(table)))
    assert {name: fit["r2"] for name, fit in record["responses"].items()} == {fit.name: fit.r2 for fit in surfaces}


def test_all_faults_of_a_table_at_once(tmp_path):
    table = TABLE.drop(columns="power_loss_W").assign(block="one", impact_force_N="many")
    faults = run(tmp_path, table).stderr.splitlines()
    assert len(faults) == 40 and len(set(faults)) == 40


@pytest.mark.parametrize("kept", [True, False])
def test_a_run_that_is_stopped_says_what_is_kept(tmp_path, monkeypatch, kept):
    """Unit: a full disk or a lost cluster leaves the finished runs in the folder of ``--out``, and nowhere without one."""

    def stop(*arguments, **options):
        raise StoppedError("the scheduler is gone", "start again")

    monkeypatch.setattr("doe.clearance.Simulations.run", stop)
    path = study(tmp_path)
    (tmp_path / "cylindrical_roller.toml").write_text((EXAMPLES / "cylindrical_roller.toml").read_text())
    found = CliRunner().invoke(app, ["fit", str(path), *(["--out", str(tmp_path / "out")] if kept else [])])
    where = "finished runs are kept" if kept else "without --out no finished run is kept"
    note, stopped = found.stderr.splitlines()
    assert note.startswith("note: 20 design runs, ")
    assert found.exit_code == 1 and stopped == f"the scheduler is gone; {where}: start again"


def fit_table(folder: Path, table: pd.DataFrame, *options: str) -> Result:
    """The command on a table without a study."""
    table.to_csv(folder / "mine.csv", index=False)
    return CliRunner().invoke(app, ["fit", "--data", str(folder / "mine.csv"), *options])


def test_a_table_of_ones_own_is_fitted_without_a_study(tmp_path):
    """Closed form: y = 3 + 2 (a - 5)/5 - 4 b over a in 0..10, b in -1..1 has these coefficients, whatever else is in the table."""
    a, b = (grid.ravel() for grid in np.meshgrid([0.0, 5.0, 10.0], [-1.0, 0.0, 1.0]))
    y = 3.0 + 0.4 * (a - 5.0) - 4.0 * b + 1e-3 * np.sin(7.0 * a * b + b)
    table = pd.DataFrame({"run": np.arange(9), "a": a, "b [N]": b, "who": "me", "y": y, "y_error": 1e-3})
    shown = fit_table(tmp_path, table, "--response", "y", "--model", "linear", "--json", "--out", str(tmp_path / "out"))
    assert shown.exit_code == 0, shown.output
    record = json.loads(shown.stdout)["responses"]
    assert list(record) == ["y"]
    assert record["y"]["coefficients"] == pytest.approx({"1": 3.0, "A": 2.0, "B": -4.0}, abs=2e-3)
    assert record["y"]["actual_coefficients"] == pytest.approx({"1": 1.0, "A": 0.4, "B": -4.0}, abs=2e-3)
    assert json.loads((tmp_path / "out" / "fit.json").read_text())["responses"].keys() == {"y"}
    one = fit_table(tmp_path, table, "--factor", "a", "--response", "y", "--model", "linear", "-q")
    assert "factors a; responses y; coded -1 and +1 are the ends" in one.stdout


OWN = pd.DataFrame(
    {"a": [-1.0, 0.0, 1.0] * 4, "b": [-1.0] * 6 + [1.0] * 6, "y": np.arange(12.0) ** 1.5, "z": np.arange(12.0)}
)


@pytest.mark.parametrize("named", ["--response=y", "--factor=a"])
@pytest.mark.parametrize(
    "cell", ["25O", "", "nan", "inf", "1_000", "0x10", "1e400", "1e200", "１２", "3,5", "9" * 500, "reference"]
)
def test_unit_a_cell_that_is_no_number_leaves_no_column_out(tmp_path, named, cell):
    """Unit: without a study too, a bad cell of a factor or response is refused with its row, never the column dropped."""
    shown = fit_table(
        tmp_path, OWN.astype({"b": object}).assign(b=[*OWN["b"][:6], cell, *OWN["b"][7:]]), named, "--model=linear"
    )
    if named == "--factor=a" and cell in ("", "nan"):
        assert shown.exit_code == 0 and "mine.csv: b has no value in row 7; it does without that row" in shown.stdout
        return
    assert shown.exit_code == 2 and len(shown.stderr.splitlines()) == 1
    assert shown.stderr.startswith(f"{tmp_path / 'mine.csv'}: b in row 7 = ")


def test_a_missing_response_is_fitted_to_the_other_rows_and_the_row_serves_the_others(tmp_path):
    """Each response has the fit of a table of its own rows, and its runs keep the numbers of the whole table."""
    whole = OWN.assign(y=OWN["y"] + np.tile([0.3, -0.2, 0.1], 4), z=OWN["z"] + np.cos(np.arange(12.0)))
    gaps = whole.assign(y=[*whole["y"][:4], np.nan, *whole["y"][5:]], z=[np.nan, np.nan, *whole["z"][2:]])
    options = ("--factor=a", "--factor=b", "--model=linear", "--json")
    shown = json.loads(fit_table(tmp_path, gaps, *options).stdout)
    for name, left_out in (("y", [4]), ("z", [0, 1])):
        alone = whole.drop(index=left_out)[["a", "b", name]]
        own = json.loads(fit_table(tmp_path, alone, *options).stdout)["responses"][name]
        assert shown["responses"][name]["coefficients"] == own["coefficients"]
        assert shown["responses"][name]["anova"] == own["anova"]
        runs = [run["run"] for run in shown["responses"][name]["diagnostics"]["runs"]]
        assert runs == [row + 1 for row in range(12) if row not in left_out]
    path = tmp_path / "mine.csv"
    assert [note["text"] for note in shown["notes"]] == [
        f"{path}: y has no value in row 5; it does without that row, which serves the others",
        f"{path}: z has no value in rows 1, 2; it does without those rows, which serve the others",
    ]


def test_unit_runs_too_many_for_a_rival_are_fitted_with_a_note(tmp_path, monkeypatch):
    """Unit: a Gaussian process costs the cube of the runs; without it the surface stands and a note says so."""
    monkeypatch.setattr("doe.workflow.surfaces.MOST_RIVALLED", 11)
    shown = fit_table(tmp_path, OWN, "--factor=a", "--factor=b", "--response=y", "--model=linear")
    assert (
        shown.exit_code == 0
        and "note: 12 runs are not compared with an alternative: a Gaussian process of more than 11" in shown.stdout
    )
    assert "leave-one-out" not in shown.stdout


def test_unit_a_block_a_run_is_refused_before_its_columns_are_made(tmp_path):
    """Unit: thousands of blocks of a run each are counted before their columns are made, which is quick."""
    table = pd.DataFrame({"a": np.arange(5000) % 7, "y": np.arange(5000), "block": np.arange(5000)})
    shown = fit_table(tmp_path, table, "--factor=a", "--response=y")
    assert shown.exit_code == 2 and "5000 runs are too few for the quadratic model; give at least 5003" in shown.stderr


def test_unit_more_runs_than_statistics_in_pairs_can_take_are_refused(tmp_path):
    """Unit: 5001 runs are too many, twice 2501 replicates of 2501 runs are not."""
    table = pd.DataFrame({"a": np.arange(5002) % 7, "y": np.arange(5002) % 11, "run": np.arange(5002)})
    shown = fit_table(tmp_path, table, "--factor=a", "--response=y")
    assert (
        shown.exit_code == 2
        and "has 5002 runs; give 5000 at most, or number replicates alike in a column run" in shown.stderr
    )
    table = pd.concat([table[:2501]] * 2)
    assert len(read_table(_written(tmp_path, table), ["a"], ["y"], tmp_path).actual) == 2501


def _written(folder: Path, table: pd.DataFrame) -> Path:
    table.to_csv(folder / "table.csv", index=False)
    return folder / "table.csv"


@pytest.mark.parametrize("text", ["1O", "2 N", "1.5.2", "１"])
def test_unit_a_column_of_slips_is_no_column_of_labels(tmp_path, text):
    """Unit: what was meant as a number in every row is refused as such, and not left out as text."""
    shown = fit_table(tmp_path, OWN.assign(b=text), "--response=y", "--model=linear")
    wanted = "left out as no numbers: b ('1.5.2')" if text == "1.5.2" else "b in row 1 = "
    assert wanted in shown.output and shown.exit_code == (0 if text == "1.5.2" else 2)


def test_unit_columns_that_are_left_out_are_named_with_the_reason(tmp_path):
    """Unit: labels, dates, empty columns, errors of factors and columns without a name stand in notes; JSON has them too."""
    table = OWN.assign(who="me", date="2024-01-01", none="", a_error=0.1, y_error=0.2)
    table.insert(0, "", np.arange(12))
    notes = [
        "left out as no numbers: who ('me'), date ('2024-01-01'), none (empty)",
        "left out as errors of no response: a_error",
        "left out as without a name: column 1",
    ]
    shown = fit_table(tmp_path, table, "--factor=a", "--factor=b", "--model=linear")
    assert shown.exit_code == 0, shown.output
    assert [line for line in shown.stdout.splitlines() if line.startswith("note: ")] == [
        f"note: {tmp_path / 'mine.csv'}: {note}" for note in notes
    ]
    record = json.loads(fit_table(tmp_path, table, "--factor=a", "--factor=b", "--model=linear", "--json").stdout)
    assert [note["text"] for note in record["notes"]] == [f"{tmp_path / 'mine.csv'}: {note}" for note in notes]
    assert set(record["responses"]) == {"y", "z"}


@pytest.mark.parametrize(("named", "words"), [
    ("--factor=c0", "has 49999 columns for responses; name 100 at most by --response NAME"),
    ("--response=c0", "has 49999 columns for factors; name 8 at most by --factor NAME"),
])  # fmt: skip
def test_unit_a_wide_table_is_read_in_linear_time(tmp_path, named, words):
    """Unit: 50 000 columns, of which a comparison of each with all takes minutes, are refused within seconds."""
    rows = [",".join(f"c{column}" for column in range(50_000)), *(",".join([str(row)] * 50_000) for row in range(3))]
    (tmp_path / "mine.csv").write_text("\n".join(rows), encoding="utf-8")
    start = time.process_time()
    shown = CliRunner().invoke(app, ["fit", "--data", str(tmp_path / "mine.csv"), named])
    assert shown.exit_code == 2 and words in shown.stderr and len(shown.stderr) < 1000
    assert time.process_time() - start < 5.0


def test_unit_runs_as_large_as_a_table_may_have_are_fitted_without_a_warning(tmp_path):
    """Unit: responses near the largest magnitude, whose fourth powers are taken, overflow nothing."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for scale in (9e49, 3e-50):
            values = OWN.assign(y=scale * (0.5 + 0.1 * np.sin(OWN["y"])) + 0.0)[["a", "b", "y"]]
            shown = fit_table(tmp_path, values, "--response=y", "--model=interaction", "-q")
            assert shown.exit_code == 0, shown.output


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "name its factors by --factor NAME and its responses by --response NAME; it has run, radial_clearance_mm"),
        (("--factor", "radial"), "--factor radial: is not a column of"),
        (("--response", "powr"), "; it has run, radial_clearance_mm, guide_clearance_mm, pocket_clearance_mm, impact"),
        (("--response", "power_loss_W", "--model", "cubic"), "model = 'cubic': choose one of 'linear', 'interaction'"),
        (("--factor", "power_loss_W", "--response", "impact_force_N"), "--factor power_loss_W: is 9 in every row of"),
    ],
)
def test_bad_names_tell_the_columns(tmp_path, options, words):
    table = TABLE.assign(power_loss_W=9.0) if "impact_force_N" in options else TABLE
    shown = fit_table(tmp_path, table, *options)
    assert shown.exit_code == 2 and words in shown.stderr and len(shown.stderr.splitlines()) == 1


def test_a_study_of_a_table_needs_no_scene(tmp_path, monkeypatch):
    """What needs runs says that the scene is missing; names stand in one place only."""
    monkeypatch.chdir(tmp_path)  # the commands write beside
    monkeypatch.setattr("doe.workflow.surfaces.MOST_RIVALLED", 0)
    text = study(tmp_path).read_text(encoding="utf-8")
    lines = [line for line in text.splitlines() if not line.startswith(("key = ", 'file = "cyl', "set = "))]
    bare = tmp_path / "bare.toml"
    bare.write_text("\n".join(lines).replace("[scene]", ""), encoding="utf-8")
    both = [run(tmp_path, TABLE, "--json").stdout]
    both.append(CliRunner().invoke(app, ["fit", str(bare), "--data", str(tmp_path / "table.csv"), "--json"]).stdout)
    assert both[0] == both[1] and "coefficients" in both[0]
    for command in ("fit", "study", "status"):
        shown = CliRunner().invoke(app, [command, str(bare)])
        assert shown.exit_code == 2 and "scene: missing; add [scene] with its file" in shown.stderr
    twice = run(tmp_path, TABLE, "--factor", "a")
    assert twice.exit_code == 2 and "study.toml states it; leave out one or the other" in twice.stderr
    assert "nothing to fit; give STUDY.toml, or --data" in CliRunner().invoke(app, ["fit"]).stderr
