"""The command ``rbdyn`` as a user meets it: in a process of its own."""

import json
import subprocess
import sys

from conftest import EXAMPLE, SHORT

HEAVY = ("numba", "scipy", "pandas", "sklearn", "pymoo", "matplotlib")
QUICK = [part for assignment in SHORT for part in ("--set", assignment)]


def loaded_by(statement):
    """Which heavy packages a Python statement loads, in a fresh interpreter."""
    program = f"import sys\ntry:\n    {statement}\nexcept SystemExit:\n    pass\n"
    program += f"print(*[m for m in {HEAVY!r} if m in sys.modules], file=sys.stderr)"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return found.stderr.split()


def test_command_line_help_and_import_load_nothing_heavy():
    """Command line: help and import stay light; a scene can be read without numba."""
    assert loaded_by("import rbdyn") == []
    assert loaded_by("import sys; sys.argv = ['rbdyn', '--help']; from rbdyn.cli import run; run()") == []
    assert loaded_by("import sys; sys.argv = ['rbdyn', 'simulate', '--help']; from rbdyn.cli import run; run()") == []
    assert loaded_by("from rbdyn import Scene, SimulationResult, InputError, RunError") == []
    assert loaded_by(f"from rbdyn import Scene; Scene.load({str(EXAMPLE)!r})") == []
    # A simulation needs numba, and no response surface, front, table or picture.
    assert set(loaded_by("from rbdyn import simulate")) <= {"numba", "scipy"}


def test_command_line_help(command):
    """Command line: help names the commands and their options; no command at all shows it too."""
    shown = command("--help")
    assert shown.returncode == 0 and "simulate" in shown.stdout
    options = command("simulate", "--help").stdout
    for option in ("--set", "--turns", "--replicates", "--seed", "--workers", "--out", "--json"):
        assert option in options
    assert "simulate" in command().stdout + command().stderr


def test_command_line_json_is_one_object_and_repeats(command, outer, outer_result):
    """Command line: standard output is one JSON object, the same figures as from Python, in any process."""
    shown = command("simulate", EXAMPLE, *QUICK, "--json", "--workers", "2")
    assert shown.returncode == 0 and shown.stderr.endswith("2 at once\n") and shown.stderr.startswith("note: ")
    record = json.loads(shown.stdout)
    expected = json.loads(json.dumps(outer_result.as_dict()))
    for each in (record, expected):
        del each["cost"]
    assert record == expected


def test_command_line_table_and_options(command):
    """Command line: without --json a table; the options stand for their keys."""
    options = ("--turns", "2", "--replicates", "1", "--seed", "5")
    shown = command("simulate", EXAMPLE, *QUICK, *options, "-v")
    assert shown.returncode == 0
    for words in ("power loss [W]", "not estimated", "1 replicate, seed 5", "rolling resistance", "effective samples"):
        assert words in shown.stdout
    quiet = command("simulate", EXAMPLE, *QUICK, *options, "-q")
    assert quiet.returncode == 0 and "note:" not in quiet.stdout
    record = json.loads(command("simulate", EXAMPLE, *QUICK, *options, "--json").stdout)
    assert (record["replicates"], record["seed"], record["scene"]["numerics"]["turns"]) == (1, 5, 2.0)


def test_command_line_out_writes_files(command, tmp_path):
    """Command line: --out writes result, history and pictures, and the result is the one that --json prints."""
    folder = tmp_path / "deep" / "run"
    shown = command("simulate", EXAMPLE, *QUICK, "--json", "--out", folder)
    assert shown.returncode == 0
    pictures = {"roller_loads.png", "cage_orbit.png", "pocket_forces.png", "stiffness.png"}
    names = {
        "result.json",
        "figures.csv",
        "bearing.rexs",
        "history.csv",
        *pictures,
        "report.html",
        "tables.xlsx",
        "made_by.json",
    }
    assert {path.name for path in folder.iterdir()} == names
    assert json.loads((folder / "result.json").read_text()) == json.loads(shown.stdout)
    lines = (folder / "history.csv").read_text().splitlines()
    columns = lines[0].split(",")
    assert columns[:4] == ["time_s", "cage_x_um", "cage_y_um", "cage_speed_rpm"]
    assert {"land_N", "pocket_1_N", "inner_10_N", "outer_slip_10_m_s"} <= set(columns)
    assert len(lines) == 1 + 4 * 512
    for picture in pictures:
        assert (folder / picture).read_bytes().startswith(b"\x89PNG")


def refused(shown, *words):
    """Bad input: exit code 2, sentences on standard error, no traceback, nothing else on standard output."""
    assert shown.returncode == 2, shown.stderr
    assert "Traceback" not in shown.stderr
    for word in words:
        assert word in shown.stderr
    return shown


def test_command_line_bad_input(command, tmp_path):
    """Command line: every fault is a line that names file, key, value and mend; exit code 2."""
    faulty = ("--set", "bearing.rollers=1", "--set", "cage.guidence=outer", "--set", "operation.radial_load_N=-3.0")
    shown = refused(command("simulate", EXAMPLE, *faulty), "bearing.rollers = 1", "guidance?", "radial_load_N = -3.0")
    assert shown.stdout == ""
    assert len(shown.stderr.splitlines()) == 3
    assert all(line.startswith(str(EXAMPLE)) for line in shown.stderr.splitlines())
    record = json.loads(refused(command("simulate", EXAMPLE, *faulty, "--json")).stdout)
    assert record["status"] == "refused" and len(record["faults"]) == 3

    refused(command("simulate", tmp_path / "none.toml"), "none.toml", "no such file")
    refused(command("simulate", EXAMPLE, "--set", "numerics.turns"), "key.path=value")
    (tmp_path / "file").write_text("")
    refused(command("simulate", EXAMPLE, *QUICK, "--out", tmp_path / "file"), "--out", "name another")


def test_command_line_usage_errors(command):
    """Command line: a wrong command, option or number of arguments is exit code 2 as well."""
    assert command("simulat").returncode == 2
    assert command("simulate").returncode == 2
    assert command("simulate", EXAMPLE, "--turns", "many").returncode == 2
    assert command("simulate", EXAMPLE, "--workers", "0").returncode == 2


def test_command_line_slip_of_a_unit_is_said_before_the_run(command):
    """Command line: a cage of 0.05 g takes a hundred times as long to simulate, so the first line says that the mass is unusual."""
    budget = "numerics.step_budget_per_turn=100"
    shown = command("simulate", EXAMPLE, *QUICK, "--set", "cage.mass_g=0.05", "--set", budget)
    first, plan, _ = shown.stderr.splitlines()
    assert first.startswith("note: cage.mass_g = 0.05: is outside the usual ") and plan.endswith(" at once")


def test_command_line_failing_run(command):
    """Command line: a run that cannot go on is exit code 1 and one sentence: which, where, why, what to do."""
    arguments = ("simulate", EXAMPLE, *QUICK, "--set", "numerics.step_budget_per_turn=100")
    shown = command(*arguments)
    assert (shown.returncode, shown.stdout) == (1, "")
    plan, sentence = shown.stderr.splitlines()
    assert plan.endswith(" at once")
    for words in ("replicate ", "seed 1", "shaft turn ", "step budget of 3600 used up", "raise numerics.step_budget"):
        assert words in sentence
    again = command(*arguments, "--json")
    assert again.returncode == 1
    assert json.loads(again.stdout)["status"].startswith("failed: replicate")
