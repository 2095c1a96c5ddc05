"""Input that cannot be misread: tables, TOML and studies, each fault by its smallest input."""

import json
import math
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from short_studies import with_paper_goals
from typer.testing import CliRunner

from doe.cli import app
from doe.dimension_chain import read_chains
from doe.report.sections.design import run_sheet
from doe.study_file.table import read_table
from doe.workflow.design import DesignResult
from doe.workflow.problem import Problem
from doe.workflow.runs import Runs, StudyDesign
from rbdyn.base.faults import LONGEST_SENTENCE, MOST_FAULTS, InputError, one_line, read_toml
from rbdyn.quasistatic.result import BallResult
from rbdyn.quasistatic.sweep import keys_of_texts
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
ROLLER = EXAMPLES / "cylindrical_roller.toml"


def faults_of(read, *arguments) -> list[str]:
    """The sentences with which input is refused, each one bounded line."""
    with pytest.raises(InputError) as refused:
        read(*arguments)
    assert all(fault.isprintable() and len(fault) <= LONGEST_SENTENCE for fault in refused.value.faults)
    return refused.value.faults


def table(folder: Path, text: str | bytes):
    """A table with factors a and b and a response y."""
    path = folder / "t.csv"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_table(path, ["a", "b"], ["y"], Path("S.toml"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b,y\n1,2,3,9\n4,5,6,9\n", "row 1 has 4 fields and the header 3; give it a field for each column"),
        ("a,b,y\n1,2,3\n4,5\n", "row 2 has 2 fields and the header 3; give it a field for each column"),
        ("a,b,y\n1,2,3\n4,5,6,7\n", "row 2 has 4 fields and the header 3"),
        ("a,b,y,c,c\n1,2,3,4,5\n", "column 'c' comes 2 times; keep one"),
        ("a,b\n1,2\n", "column 'y' is missing; add it, or rename the factor or response in S.toml"),
        ("a|b|y\n1|2|3\n", "has '|' between its fields; write commas there and points in numbers"),
        ('a,b,y\n1,2.5,"3,5"\n', "y in row 1 = '3,5': has a decimal comma and other numbers a decimal point; write one of them"),
        ('a,b,y\n1,2,"3,500"\n', "y in row 1 = '3,500': may mean 3500 or 3.500; write 3500 or 3.500"),
        ("a;b;y\n1;2;3.500\n", "y in row 1 = 3.500: may mean 3500 or 3.500; write 3500 or 3.5000"),
        ("a;b;y\n1;0,5;3.500\n", "y in row 1 = 3.500: may mean 3500 or 3,500; write 3500 or 3,500"),
        ("a,b,y\n1,2,2026-02-01\n", "y in row 1 = '2026-02-01': is a date, which Excel makes of numbers such as 1.2"),
        ("a,b,y\n1,2,01. Feb\n", "y in row 1 = '01. Feb': is a date, which Excel makes of numbers such as 1.2"),
        ("a,b,y\n1,2,#DIV/0!\n", "y in row 1 = '#DIV/0!': is the fault of a formula; correct it in the spreadsheet"),
        ("Versuch 12,,\na,b,y\n1,2,3\n", "names columns such as 'a' below another row; remove the rows above the names"),
        ("a,b,y\n1,5,2,5,3,5\n", "row 1 has 6 fields and the header 3; give it a field for each column, in their order, or save it with semicolons"),
        ("a;b;y\n1;2;3\n".encode("utf-16-le"), "is not text in UTF-8; save the file as UTF-8"),
        ("a,b,y\nmm,mm,N\n1,2,3\n", "row 1 has words where the others have numbers, such as 'mm'; remove that row of units"),
        ("a,b,y\n1,2,nan\n", "y in row 1 = 'nan': is not a finite number"),
        ("a,b,y\n1,2,-inf\n", "y in row 1 = '-inf': is not a finite number"),
        ("a,b,y\n1,2,\n", "y in row 1 = '': is not a finite number; fill it in or remove the row"),
        ("a,b,y\n1,2,True\n", "y in row 1 = 'True': is not a finite number"),
        ("a,b,y\n1,2,1_000\n", "y in row 1 = '1_000': is not a finite number"),
        ("a,b,y\n1,2,1e400\n", "y in row 1 = 1e400: is not a finite number"),
        ("a,b,y\n1,2,1e200\n", "y in row 1 = 1e200: is beyond 1e+50; check the unit"),
        ("a,b,y,y_error\n1,2,3,-1\n", "y_error in row 1 = -1: is below 0; check the sign"),
        ("a,b,y,y_error\n1,2,3,inf\n", "y_error in row 1 = 'inf': is not a finite number"),
        ("a,b,y,replicates\n1,2,3,-3\n", "replicates in row 1 = -3: is below 0; check the sign"),
        ("a,b,y,replicates\n1,2,3,1e300\n", "replicates in row 1 = 1e300: is beyond 1e+09"),
        ("a,b,y,block\n1,2,3,1.5\n", "block in row 1 = 1.5: is not a whole number; write a plain one"),
        ("a,b,y,run\n1,2,3,1\n4,2,3,1\n", "a of run 1 is 4 in one replicate and 1 in another"),
        ("a,b,y,run,block\n1,2,3,1,1\n1,2,3,1,2\n", "block of run 1 is 2 in one replicate and 1 in another"),
        ("a,b,y,run,y_error\n1,2,3,1,.1\n1,2,4,1,.1\n", "column y_error: rows of one run are its replicates, and it follows from their scatter"),
        ("a,b,y,run,replicates\n1,2,3,1,8\n1,2,4,1,8\n", "column replicates: rows of one run are its replicates"),
        ("a,b,y\n1,2,1e-60\n", "y in row 1 = 1e-60: is nearer to 0 than 1e-50; check the unit"),
        ('a,b,y\n1,2,3\n""\n', "row 2 has 1 field and the header 3"),
        ("a" * 200_000 + ",b,y\n1,2,3\n", "line 1: is not CSV (field larger than field limit"),
        ("a,b," + "y" * 5000 + "\n1,2,3\n", "column 'y' is missing"),
        ("a,b,y\n1,2," + "9" * 5000 + "\n", "is longer than 400 characters; write a shorter number"),
        ("", "is empty; write a header"),
        ("a,b,y\n", "has a header and no rows; add a row for each run"),
        ("a,b,y\n1,2,\0003\n", "y in row 1 = '\\\\x003': is not a finite number"),
        (b"a,b,y\n1,2,3\x81\n", "line 2: byte 0x81 is not UTF-8); save the file as UTF-8"),
        (b"a,b,y\n1,2,3\x02\xe9\n", "line 2: byte 0xe9 is not UTF-8); save the file as UTF-8"),
        (bytes(range(256)), "cannot be read (line 2: byte 0x80"),
        ('a,b,y\n1,2,3\n1,"2,3\n4,5,6\n', "line 3: is not CSV (unexpected end of data); close the quotes that open there"),
    ],
)  # fmt: skip
def test_a_table_is_refused_in_one_sentence_of_file_row_column_and_mend(tmp_path, text, words):
    fault = faults_of(table, tmp_path, text)[0]
    assert fault.startswith(f"{tmp_path / 't.csv'}: ") and words in fault


@pytest.mark.parametrize(
    "text",
    [
        "a,b,y\n1,2,3\n",
        "\ufeffa,b,y\n1,2,3\n",
        '\ufeff"a",b,y\r\n1,2,3\r\n',
        " a, b ,y,\n\n1, 2 ,3,\n",
        "y,k,b,a\n3,x,2,1\n",
        "a,b,y,,\n1,2,3,,\n,,,,\n",
        "a;b;y;\r\n1,0;2;3,00;\r\n;;;\r\n",
        "sep=;\r\na;b;y\r\n1;2;3\r\n",
        "a\tb\ty\n1\t2\t3\n",
        "a;b, in mm;y;b\n1,0;5,5;3;2\n",
        'a,b,y\n1,"2,0",3\n',
        "a;b;y;Kraft in N\n1;2,0;3;1.234,5\n".encode("utf-16"),
        "a;b;y;Kräfte\n1;2,0;3;7\n".encode("cp1252"),
    ],
)
def test_a_table_is_read_by_its_names_however_it_is_written(tmp_path, text: str | bytes):
    found = table(tmp_path, text)
    assert (found.actual.tolist(), found.values.tolist()) == ([[1.0, 2.0]], [[3.0]])
    assert math.isnan(found.errors[0, 0]) and (found.replicates[0], found.block[0]) == (0, 0)


def test_replicates_are_joined_in_the_order_of_their_first_rows(tmp_path):
    """Closed form: 1 and 3 have mean 2 and half width 12.7062 x sqrt(2)/sqrt(2); a run alone has no scatter."""
    found = table(tmp_path, "run,a,b,y,block\n7,1,2,1,5\n3,4,5,6,5\n7,1,2,3,5\n")
    assert found.actual.tolist() == [[1.0, 2.0], [4.0, 5.0]] and found.values.tolist() == [[2.0], [6.0]]
    assert found.errors[0, 0] == pytest.approx(12.7062047) and math.isnan(found.errors[1, 0])
    assert (found.replicates.tolist(), found.block.tolist()) == ([2, 1], [5, 5])


def test_a_directory_is_no_table_and_a_flood_of_faults_is_told_by_its_count(tmp_path):
    assert "cannot be read" in faults_of(read_table, tmp_path, ["a", "b"], ["y"], Path("S.toml"))[0]
    start = time.process_time()
    faults = faults_of(table, tmp_path, "a,b,y\n" + "1,2,x\n" * 100_000)
    assert len(faults) == MOST_FAULTS and faults[-1] == "and 99951 more faults; fix these first"
    assert time.process_time() - start < 5.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[Bearing]\n", "Bearing: unknown key; did you mean bearing?"),
        ('Title = "x"\n', "Title: unknown key; known keys here: bearing, cage"),
        ("[cage]\nMass_g = 3\n", "cage.Mass_g: unknown key; did you mean mass_g?"),
        ("x = " + "9" * 5000, "line 1: a number of thousands of digits"),
        ("x = " + "9" * 400, "x: a whole number beyond 64 bits"),
        ("x = 0x" + "f" * 5000, "x: a whole number beyond 64 bits"),
        ("x = " + "[" * 2000 + "]" * 2000, "brackets nested more than 20 deep"),
        ("x = " + "{a=" * 30 + "1" + "}" * 30, "nested more than 20 deep"),
        ("\n" + ".".join("a" * 3000) + " = 1", "line 2: a key of more than 20 parts"),
        ("[" + ".".join("a" * 3000) + "]", "line 1: a key of more than 20 parts"),
        ('"a\\nb" = 1', "a\\nb: unknown key"),
        ("k" * 5000 + " = 1", "kkk: unknown key; known keys here"),
        ('x = "\0"', "not valid TOML (Illegal character '\\x00' (at line 1, column 6))"),
    ],
)
def test_toml_is_refused_in_one_sentence_of_file_key_and_mend(tmp_path, text, words):
    path = tmp_path / "s.toml"
    path.write_text(text, encoding="utf-8")
    assert any(words in fault and fault.startswith(f"{path}: ") for fault in faults_of(Scene.load, path))


@pytest.mark.parametrize("value", ["2020-01-01", "07:00:00", "inf", "nan", "1e400", "true", '"5"', "[1]", "{a=1}"])
def test_no_number_where_one_belongs_is_named_with_its_key(value):
    (fault,) = faults_of(Scene.load, ROLLER, [f"cage.mass_g={value}"])
    assert fault.startswith(f"{ROLLER}: cage.mass_g = ") and "number" in fault


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("Cage.mass_g=3", "Cage: unknown key; did you mean cage?"),
        ("cage.mass_g=1\ny=2", "--set cage.mass_g=1\\ny=2: more than one value"),
        (".".join("a" * 30000) + "=1", "write it as key.path=value"),
        ("cage.mass_g=" + "9" * 5000, "a number of thousands of digits"),
        ("x=" + "[" * 2000 + "]" * 2000, "nested more than 20 deep"),
    ],
)
def test_a_bad_assignment_is_one_sentence(assignment, words):
    (fault,) = faults_of(Scene.load, ROLLER, [assignment])
    assert words in fault


@pytest.mark.parametrize("read", [Scene.load, Problem.load, read_chains])
def test_unknown_keys_are_told_in_linear_time_and_a_byte_order_mark_is_read(tmp_path, read):
    """Rate: 30 000 unknown keys take a second of the processor (many minutes where each is compared with all)."""
    name = {Scene.load: "cylindrical_roller", Problem.load: "clearance_study"}.get(read, "pocket_chain")
    whole, path = (EXAMPLES / f"{name}.toml").read_bytes(), tmp_path / "s.toml"
    path.write_bytes(b"\xef\xbb\xbf" + whole)
    assert read(path)
    path.write_bytes(b"".join(b"k%d = 1\n" % number for number in range(30_000)) + whole)
    start = time.process_time()
    faults = faults_of(read, path)
    assert len(faults) == MOST_FAULTS and "29951 more" in faults[-1]
    assert time.process_time() - start < 5.0


def test_sentences_are_cut_in_the_middle():
    assert one_line("a\r\nb\x1b[0m\udcff") == "a\\r\\nb\\x1b[0m\\udcff"
    assert one_line("h" * 500 + "x" * 10**6 + "t" * 300, 90) == "h" * 57 + "..." + "t" * 30
    assert InputError(["x" * 10**6]).faults == InputError(InputError(["x" * 10**6]).faults).faults


def study(folder: Path, *changes: tuple[str, str]) -> Path:
    """The example study in a folder of its own, changed."""
    for name in ("cylindrical_roller.toml", "ccd_table4.csv", "bearing_chains.toml"):
        shutil.copy(EXAMPLES / name, folder)
    text = with_paper_goals((EXAMPLES / "clearance_study.toml").read_text(encoding="utf-8"))
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    (folder / "study.toml").write_text(text, encoding="utf-8")
    return folder / "study.toml"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("cage.guide_clearance_mm", "bearing.radial_clearance_mm", "factor.key = 'bearing.radial_clearance_mm': used more than"),
        ("step = 0.005", "step = 1e-300", "factor[1].step = 1e-300: must be at least 1e-12"),
        ("step = 0.005", "step = 1e-12", "factor[1].step = 1e-12: is lost in rounding next to centre = 0.02; widen it"),
        ("step = 0.005", "step = 1e300", "factor[1].step = 1e+300: must be at most"),
        ("resolution = 0.001", "resolution = 5e-12", "factor[1].resolution = 5e-12: makes more than 1e+09 steps"),
        ('name = "guide"', 'name = "pocket"', "chain.name = 'pocket': used more than once"),
        ('name = "radial_clearance_mm"', 'name = "run"', "factor.name = 'run': is another column of a table of runs"),
        ('name = "radial_clearance_mm"', 'name = "a,b"', "factor[1].name = 'a,b': must have no commas"),
        ('name = "power_loss_W"', 'name = "other"', "response.name = 'other': the simulation does not give it"),
        ('key = "bearing.radial_clearance_mm"', 'key = "bearing.rim"', "factor.key = 'bearing.rim': no such key"),
        ('file = "cylindrical_roller.toml"', 'file = "bearing_chains.toml"', "factor.key = 'bearing.radial_clearance_mm': no such"),
        ("nominal_mm = 9.3", 'nominal_mm = "wide"', "link[1].nominal_mm = 'wide': must be a number"),
        ('goal = "min"', 'goal = "min"\nlower = 2.0\nupper = 1.0', "response[1].lower = 2.0: must be below upper = 1.0"),
    ],
)  # fmt: skip
def test_design_and_study_refuse_alike_before_anything_runs(tmp_path, old, new, words):
    path = study(tmp_path, (old, new))
    told = [CliRunner().invoke(app, [name, str(path), "--out", str(tmp_path / "out")]) for name in ("design", "study")]
    assert [each.exit_code for each in told] == [2, 2]
    assert told[0].stderr == told[1].stderr and words in told[0].stderr
    assert not (tmp_path / "out" / "study.sqlite").exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("tolerance = 0.003", ""), "factor.tolerance of radial"),
        (('goal = "min"', 'goal = "none"'), "a front needs two responses with a goal"),
    ],
)
def test_a_study_without_a_front_is_refused_before_it_runs(tmp_path, change, words):
    changes = [change] if "tolerance" in change[0] else [change, change]
    shown = CliRunner().invoke(app, ["study", str(study(tmp_path, *changes)), "--out", str(tmp_path / "out")])
    assert shown.exit_code == 2 and words in shown.stderr
    assert not (tmp_path / "out" / "study.sqlite").exists()


def test_blocks_are_numbered_from_one_everywhere(tmp_path):
    """Design, its CSV, the summary and the table of runs number the blocks of a design alike."""
    path = study(tmp_path, ('alpha = "rotatable"', 'alpha = "orthogonal_blocks"\nblocks = true'))
    path.write_text(path.read_text(encoding="utf-8").partition("[reference]")[0], encoding="utf-8")
    loaded = Problem.load(path)
    design = loaded.design
    expected = [1] * 12 + [2] * 8
    assert [run.block for run in DesignResult.of(loaded, design).runs] == expected
    values = np.ones((20, 3))
    runs = StudyDesign.of(loaded, design, Runs(design.coded, design.coded, values, values)).points
    assert [run.block for run in runs] == expected
    assert [row["block"] for row in run_sheet(loaded.factors, loaded.responses, runs).records] == expected
    lines = CliRunner().invoke(app, ["design", str(path), "--csv"]).stdout.splitlines()
    assert [int(line.split(",")[1]) for line in lines[1:]] == expected


@pytest.mark.parametrize(
    "text", ["", "[" * 5000, "[]", '{"format": 3}', '{"format": "rbdyn.simulation/5", "status": 1}']
)
@pytest.mark.parametrize("load", [SimulationResult.load, BallResult.load])
def test_a_broken_result_is_one_sentence(tmp_path, load, text):
    (tmp_path / "result.json").write_text(text)
    (fault,) = faults_of(load, tmp_path / "result.json")
    assert fault.startswith(f"{tmp_path / 'result.json'}: ")


def test_a_number_of_text_in_a_result_is_refused(tmp_path):
    data = {"format": "rbdyn.simulation/5", "scene": 5}
    (tmp_path / "result.json").write_text(json.dumps(data))
    assert "not a whole simulation result" in faults_of(SimulationResult.load, tmp_path / "result.json")[0]


def test_other_ways_in(tmp_path):
    """A count beyond all memory, and a path that no system has."""
    assert "more than the 100000" in faults_of(keys_of_texts, ["operation.axial_load_N=0:1:1000000000000"])[0]
    assert "cannot be read" in faults_of(read_toml, "a\0b")[0]
