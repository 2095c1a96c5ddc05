"""``doe run``: a table of scenes, its failures, its parts, and what reads its files."""

import csv
import json
import shutil
import tracemalloc
from dataclasses import replace
from pathlib import Path

import instant_runs
import numpy as np
import pandas as pd
import pytest
from doe_command import doe
from instant_runs import instantly, unillustrated
from pytest import approx

import doe as library
from doe.library.scene_runs import run_answer
from doe.workflow import scene_table
from doe.workflow.scene_table import RowFigures, RowRun
from rbdyn.base.notes import Note

EXAMPLES = Path(__file__).parents[2] / "examples"
HEADER = "name,scene,replicates,seed,cage.pocket_clearance_mm\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.copy(EXAMPLES / "cylindrical_roller.toml", "base.toml")
    return tmp_path


def table(rows: str, header: str = HEADER, name: str = "rows.csv") -> str:
    Path(name).write_text(header + rows, encoding="utf-8")
    return name


def test_rows_that_fail_do_not_end_the_others(folder, monkeypatch):
    """Command line: cells, files and runs that fail are named by row and cause; the others have figures, and exit code 1."""
    ran = instantly(monkeypatch.setattr, faulty=[13])
    Path("other.toml").write_text(
        Path("base.toml").read_text(encoding="utf-8").replace("24000.0", "12000.0"), encoding="utf-8"
    )
    rows = table("a,,2,11,0.2\nb,other.toml,,12,\nc,,,13,0.2\nd,none.toml,,,\ne,,,14,-1\n,,2,15,0.25\n")
    shown = doe("run", rows, "--scene", "base.toml", "--out", "out", "--json")
    assert shown.returncode == 1 and sorted(ran) == [11, 12, 13, 15]
    record = json.loads(shown.stdout)
    assert [row["status"] for row in record["rows"]] == ["done", "done", "failed", "failed", "failed", "done"]
    assert [(failure["row"], failure["name"]) for failure in record["failures"]] == [(3, "c"), (4, "d"), (5, "e")]
    frozen, missing, negative = (failure["cause"] for failure in record["failures"])
    assert "the oil froze" in frozen and missing == "none.toml: no such file; check the path"
    assert negative.startswith("rows.csv: cage.pocket_clearance_mm in row 5 = -1:")
    assert shown.stderr.splitlines()[-1] == "3 of 6 rows failed; runs.csv says which and why"
    assert record["rows"][0]["figures"]["impact_force_N"]["value"] == approx(100.0 * 0.2 + 30.0 * 0.15 + 0.2)
    frame = pd.read_csv(record["table"])
    assert frame["name"].tolist() == ["a", "b", "c", "d", "e", "6"] and frame["impact_force_N"].notna().sum() == 3
    assert frame["impact_force_N_error"][0] == approx(0.01 * frame["impact_force_N"][0])
    assert frame["numerics.replicates"].tolist()[0] == 2 and frame["scene"].tolist()[1] == "other.toml"


def test_a_second_call_runs_nothing_again(folder, monkeypatch):
    """Command line: finished rows are in the store; a changed table runs its changed rows alone."""
    ran = instantly(monkeypatch.setattr)
    first = doe("run", table("a,,,11,0.2\nb,,,12,0.3\n"), "--scene", "base.toml", "--out", "out", "-q")
    second = doe("run", "rows.csv", "--scene", "base.toml", "--out", "out", "-q")
    assert first.returncode == second.returncode == 0 and first.stdout == second.stdout and sorted(ran) == [11, 12]
    doe("run", table("a,,,11,0.2\nb,,,12,0.3\nc,,,13,0.3\n"), "--scene", "base.toml", "--out", "out", "-q")
    assert sorted(ran) == [11, 12, 13]


def test_parts_give_the_table_of_one_process(folder, monkeypatch):
    """Command line: parts keep stores of their own, and the whole takes them over and runs what is missing."""
    ran = instantly(monkeypatch.setattr, faulty=[15])
    rows = table("".join(f"r{seed},,,{seed},0.2\n" for seed in range(11, 18)))
    call = ("run", rows, "--scene", "base.toml", "-q")
    assert doe(*call, "--out", "one").returncode == 1
    assert len(ran) == 7
    for part in ("1/3", "3/3"):
        assert doe(*call, "--out", "parts", "--part", part).returncode in (0, 1)
    assert len(ran) == 12
    assert doe(*call, "--out", "parts").returncode == 1 and sorted(ran[12:]) == [12, 15]
    assert Path("parts/runs.csv").read_bytes() == Path("one/runs.csv").read_bytes()


def test_a_part_of_another_table_is_refused(folder, monkeypatch):
    """Command line: parts of different tables in one folder, a part that is none, and a part without a folder: a sentence each."""
    instantly(monkeypatch.setattr)
    rows, others = table("a,,,11,0.2\nb,,,12,0.2\n"), table("a,,,11,0.3\nb,,,12,0.3\n", name="others.csv")
    assert doe("run", rows, "--scene", "base.toml", "--out", "out", "--part", "1/2").returncode == 0
    refused = doe("run", others, "--scene", "base.toml", "--out", "out", "--part", "2/2")
    assert refused.returncode == 2
    assert refused.stderr == (
        "--out out: part-1-of-2 is a part of another input, or another version of rbdyn made it; remove it or name another folder\n"
    )
    for part, words in {"5/4": "a part from 1 to 4", "0/4": "a part from 1 to 4", "x": "K/N"}.items():
        refused = doe("run", rows, "--scene", "base.toml", "--out", "out", "--part", part)
        assert refused.returncode == 2 and f"--part {part}: this part does not exist; write {words}" in refused.stderr
    few = doe("run", rows, "--scene", "base.toml", "--out", "few", "--part", "3/4")
    assert few.returncode == 2 and "--part 3/4: has no row" in few.stderr and not Path("few").exists()


SLIPS = {
    "operation.inner_speed\n1000\n": "column operation.inner_speed: unknown key; did you mean operation.inner_speed_rpm?",
    "inner_speed_rpm\n1000\n": "column inner_speed_rpm: unknown key; did you mean operation.inner_speed_rpm?",
    "speed_rpm\n1000\n": "column speed_rpm: unknown key; did you mean operation.inner_speed_rpm?",
    "seeds\n1\n": "column seeds: unknown key; did you mean seed?",
    "seed,numerics.seed\n1,2\n": "columns seed and numerics.seed: both state one value; keep one of them",
    "cage.mass_g\n30\n": "column cage.mass_g: --set cage.mass_g states it too; leave out one of them",
    "name\na\n": "states neither scene, designation nor a key of a scene; it has name",
}


@pytest.mark.parametrize("text", SLIPS)
def test_slips_of_the_table_end_before_anything_runs(folder, monkeypatch, text):
    """Command line: a fault of the whole table is one sentence, exit code 2, and no folder."""
    ran = instantly(monkeypatch.setattr)
    Path("rows.csv").write_text(text, encoding="utf-8")
    refused = doe("run", "rows.csv", "--scene", "base.toml", "--set", "cage.mass_g=40", "--out", "out")
    assert refused.returncode == 2 and refused.stderr == f"rows.csv: {SLIPS[text]}\n"
    assert not ran and not Path("out").exists()


def test_a_row_without_a_scene_and_a_ball_bearing_fail(folder, monkeypatch):
    """Command line: a row needs a scene of rollers."""
    instantly(monkeypatch.setattr)
    shutil.copy(EXAMPLES / "angular_contact_ball.toml", "balls.toml")
    record = json.loads(doe("run", table("a,,,11,0.2\nb,balls.toml,,,\n"), "--out", "out", "--json").stdout)
    assert [failure["cause"] for failure in record["failures"]] == [
        "row 1 (a): has no scene; name one in its column scene, a bearing in designation, or a scene for all rows by --scene",
        "row 2 (b): balls.toml: is a ball bearing; rbdyn ball computes it, doe run takes rollers",
    ]


def test_a_fit_takes_the_table_as_it_is(folder, monkeypatch):
    """Command line: failed rows are left out of a fit, and a note counts them."""
    instantly(monkeypatch.setattr, faulty=[15])
    rows = "".join(f"r{seed},,,{seed},{0.2 + 0.01 * seed:.2f}\n" for seed in range(11, 21))
    doe("run", table(rows), "--scene", "base.toml", "--out", "out")
    options = ("--factor", "cage.pocket_clearance_mm", "--response", "impact_force_N", "--model", "linear")
    record = json.loads(doe("fit", "--data", "out/runs.csv", *options, "--json").stdout)
    assert any("1 of 10 rows failed and are left out" in note["text"] for note in record["notes"])
    fit = record["responses"]["impact_force_N"]
    assert fit["residual_dof"] == 7 and fit["coefficients"]["A"] == approx(100.0 * 0.045, rel=0.1)


def test_a_frame_gives_a_frame(folder, monkeypatch):
    """Library: ``doe.run`` takes a frame and returns one with the figures of its rows, in their order."""
    instantly(monkeypatch.setattr)
    frame = pd.DataFrame({"cage.pocket_clearance_mm": [0.2, 0.3, None], "seed": [11, 12, 13], "name": ["a", None, "c"]})
    runs = library.run(frame, scene="base.toml")
    assert runs["name"].tolist() == ["a", "2", "c"] and runs["status"].tolist() == ["done"] * 3
    assert runs["impact_force_N"].tolist() == approx([24.7, 34.9, 34.6])
    assert list(Path().iterdir()) == [Path("base.toml")]


def test_memory_holds_no_more_of_a_row_than_its_figures(folder, monkeypatch):
    """Library: files of many rows are written row by row. A row of 75 figures takes 1.8 kB in memory and 14 kB on disk."""
    names = tuple(f"figure_{number}" for number in range(75))

    def figures(table, rows, simulations):
        return (RowRun(row, RowFigures(names, np.full((3, 75), float(row.number)))) for row in rows)

    monkeypatch.setattr(scene_table, "run_rows", figures)
    peaks = []
    for count in (2, 20, 140):
        frame = pd.DataFrame({"seed": range(1, count + 1)})
        if count > 2:  # the first call loads modules
            tracemalloc.start()
        answer = run_answer(frame, "base.toml", f"out{count}")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] - peaks[1] < 120 * 4000
    written = json.loads(Path("out140/runs.json").read_text(encoding="utf-8"))
    assert answer["rows"] == written["rows"] and answer.as_dict() == written
    assert [row["figures"]["figure_3"]["value"] for row in written["rows"]] == [float(n) for n in range(1, 141)]


def test_parts_of_a_study_give_the_study(folder, monkeypatch):
    """Command line: design runs by parts, then the study takes them over and has the bits of one process."""
    ran = instantly(monkeypatch.setattr)
    unillustrated(monkeypatch.setattr)
    study = "\n".join(
        [
            '[scene]\nfile = "base.toml"',
            '[[factor]]\nname = "pocket_mm"\nkey = "cage.pocket_clearance_mm"\ncentre = 0.3\nstep = 0.05',
            '[[factor]]\nname = "guide_mm"\nkey = "cage.guide_clearance_mm"\ncentre = 0.15\nstep = 0.05',
            '[[response]]\nname = "impact_force_N"\ngoal = "min"\n[[response]]\nname = "power_loss_W"\ngoal = "min"\n',
        ]
    )
    Path("study.toml").write_text(study, encoding="utf-8")
    parts = [doe("study", "study.toml", "--out", "parts", "--part", f"{part}/3") for part in (1, 2, 3)]
    assert [shown.returncode for shown in parts] == [0, 0, 0]
    assert "part 2 of 3: " in parts[1].stdout and "without --part gathers" in parts[1].stdout
    design = len(ran)
    assert doe("study", "study.toml", "--out", "parts", "-q").returncode == 0
    further = len(ran) - design
    assert doe("study", "study.toml", "--out", "one", "-q").returncode == 0
    assert len(ran) == 2 * (design + further)
    with Path("one/design_runs.csv").open() as one, Path("parts/design_runs.csv").open() as other:
        assert list(csv.reader(one)) == list(csv.reader(other))


def test_every_table_may_be_parquet(folder, monkeypatch):
    """Command line: a parquet file is read by pandas; a file that is none and pandas without a reader are a sentence each."""
    instantly(monkeypatch.setattr)
    frame = pd.DataFrame({"name": ["a", "b"], "cage.pocket_clearance_mm": [0.2, 0.3], "seed": [11, 12]})
    Path("rows.parquet").write_bytes(b"PAR1")
    monkeypatch.setattr(pd, "read_parquet", lambda file: frame)
    assert doe("run", "rows.parquet", "--scene", "base.toml", "--out", "out", "-q").returncode == 0
    frame.to_csv("rows.csv", index=False)
    assert doe("run", "rows.csv", "--scene", "base.toml", "--out", "other", "-q").returncode == 0
    assert Path("out/runs.csv").read_bytes() == Path("other/runs.csv").read_bytes()

    def fails(error: Exception) -> None:
        def read(file: object) -> None:
            raise error

        monkeypatch.setattr(pd, "read_parquet", read)

    for error, words in (
        (ImportError("no engine"), "pip install pyarrow"),
        (ValueError("magic"), "no parquet file (magic)"),
    ):
        fails(error)
        refused = doe("run", "rows.parquet", "--scene", "base.toml", "--out", "third")
        assert refused.returncode == 2 and words in refused.stderr and len(refused.stderr.splitlines()) == 1


def test_a_row_may_begin_with_a_designation(folder, monkeypatch):
    """Command line: a bearing of the catalogue as ``rbdyn new`` writes it, with the keys of the row; two sources fail."""
    instantly(monkeypatch.setattr)
    header = "name,scene,designation,seed,operation.inner_speed_rpm\n"
    rows = table("a,,NU 210,11,3000\nb,,NU999,12,\nc,base.toml,NU210,13,\nd,,6208,14,\n", header)
    record = json.loads(doe("run", rows, "--out", "out", "--json").stdout)
    assert [row["status"] for row in record["rows"]] == ["done", "failed", "failed", "failed"]
    unlisted, both, balls = (failure["cause"] for failure in record["failures"])
    assert "DESIGNATION NU999" in unlisted and "rbdyn ball computes it" in balls
    assert both == "row 3 (c): has a scene and a designation, which both state the bearing; keep one of them"
    assert pd.read_csv("out/runs.csv")["designation"].tolist() == ["NU 210", "NU999", "NU210", "6208"]


def test_dangers_of_rows_are_told(folder, monkeypatch):
    """Command line: a row that runs in danger is done, and its danger is on the screen, in its row and in the notes, once for all rows."""
    instantly(monkeypatch.setattr)
    dented = [Note("dent", "inner raceway: 4100 MPa dent it"), Note("fast", "speed: much")]
    plain = instant_runs.instant_result

    def dangerous(scene, *arguments, **options):
        result = plain(scene, *arguments, **options)
        return replace(result, notes=(*dented, *result.notes)) if scene.numerics.seed > 11 else result

    monkeypatch.setattr(instant_runs, "instant_result", dangerous)
    rows = table("a,,2,11,0.2\nb,,2,12,0.2\nc,,2,13,0.2\n")
    shown = doe("run", rows, "--scene", "base.toml", "--out", "out", "--json")
    record, words = json.loads(shown.stdout), "inner raceway: 4100 MPa dent it"
    assert shown.returncode == 0 and [row["dangers"] for row in record["rows"]] == [[], [words], [words]]
    assert record["notes"] == [{"level": "danger", "code": "dent", "text": f"{words} (in rows b, c)"}]
    assert shown.stderr.splitlines()[-1] == f"danger: {words} (in rows b, c)"
    assert pd.read_csv(record["table"])["danger"].fillna("").tolist() == ["", words, words]
    assert doe("run", rows, "--scene", "base.toml", "--out", "out").stdout.startswith(f"Danger: {words} (in rows b, c)")
