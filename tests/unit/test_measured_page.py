"""The page of measured figures: parts that run replace their tables, all others keep theirs and say so."""

from __future__ import annotations

import shlex
import subprocess
import sys
import tomllib
from contextlib import nullcontext
from pathlib import Path

import measured_page as page
import pytest

from rbdyn.accuracy.report import Report
from rbdyn.base.blocks import Table
from rbdyn.base.faults import InputError, RunError

ROOT = Path(__file__).parents[2]
WHOLE = tomllib.loads(Path(page.__file__).with_name("measured.toml").read_text(encoding="utf-8"))
NAMES = [part["name"] for part in WHOLE["part"]]


@pytest.fixture
def measured(tmp_path, monkeypatch):
    """``measured(*parts)``: the page after a run in which every command tells its own line, or fails where it is in ``bad``."""
    path = tmp_path / "measured.md"

    def run(*wanted, says="told", bad=()):
        def tell(line, progress):
            if line in bad:
                raise RunError(f"{line}: ended with 1")
            return f"{says} by {line}"

        monkeypatch.setattr(page, "_run", tell)
        found = page.measure(path, wanted, lambda title: nullcontext(lambda done, total: None))
        return found, path.read_text(encoding="utf-8")

    return run


def test_unit_parts_run_keep_or_fail(measured):
    """Unit: a new page says what was never measured; later a part that is not run, or fails, keeps its tables."""
    battery = next(part["commands"][0] for part in WHOLE["part"] if part["name"] == "battery")
    found, text = measured("battery", says="first")
    assert (
        found["battery"]["status"] == "ok"
        and found["battery"]["seconds"] >= 0.0
        and found["methods"] == {"status": "kept"}
    )
    assert f"first by {battery}" in text
    assert text.count(page.NEVER) == len(NAMES) - 1
    _, text = measured("methods", says="second")
    _, text = measured("methods", says="third")
    assert "first by" in text and "third by" in text and "second by" not in text
    assert text.count("*Kept: not run for the page of ") == 1
    found, text = measured("battery", says="fourth", bad=(battery,))
    assert found["battery"]["status"].startswith("failed: ")
    assert "first by" in text and "fourth by" not in text and "*Kept: failed on " in text


def test_unit_folder_is_one_for_a_part(measured):
    """Unit: commands of a part share an empty folder, which the page calls TMP."""
    _, text = measured("experiments")
    used = {
        line.split(" --out ")[1].split()[0] for line in text.splitlines() if line.startswith("told") and "--out" in line
    }
    assert len(used) == 1 and "TMP" not in used
    assert "`python examples/benchmarks/direct_front.py examples/clearance_study.toml --out TMP`, " in text


def test_unit_unknown_part_is_refused(measured):
    """Unit: one sentence with the parts that there are."""
    with pytest.raises(InputError, match="--part speed: is none; the parts are tolerances, "):
        measured("speed")


def test_unit_tables_become_markdown(monkeypatch):
    """Unit: tables of a study, with bars in cells, and its sentences; scene, keys and study are those of the command."""
    report = Report("x", {}, [Table("one", ("a", "b"), [("1|2", "3")])], ["So it is."], {})
    asked = []
    monkeypatch.setattr(page, "study", lambda *given: asked.append(given) or report)
    line = f"rbdyn accuracy {ROOT}/examples/cylindrical_roller.toml options --set numerics.turns=7"
    assert page._run(line, None).endswith("**one**\n\n| a | b |\n| --- | --- |\n| 1\\|2 | 3 |\n\nSo it is.")
    assert asked[0][0] == "options" and asked[0][1].numerics.turns == 7


def test_unit_other_commands_are_run_as_typed():
    """Unit: what they print stands as it is; their last word is told where they fail."""
    assert page._run("python -c 'print(6 * 7)'", None).endswith("```text\n42\n```")
    with pytest.raises(RunError, match=r"ended with 2, .*no_such\.toml"):
        page._run("rbdyn simulate no_such.toml", None)


def test_unit_shipped_page_is_what_the_command_writes():
    """Unit: every part of the shipped page has tables, and stands as the command would write it."""
    text = (ROOT / "examples" / "measured.md").read_text(encoding="utf-8")
    blocks = {name: text.split(f"<!-- {name} -->\n")[1].split(f"<!-- /{name} -->")[0] for name in NAMES}
    assert page.NEVER not in blocks.values()
    assert page._page(WHOLE, blocks) == text
    assert all(f"{name}," in WHOLE["words"] or f"{name}." in WHOLE["words"] for name in NAMES)


@pytest.mark.parametrize("line", [line for part in WHOLE["part"] for line in part["commands"]])
def test_unit_commands_name_files_and_keys_that_exist(line, monkeypatch):
    """Unit: the page would find every file and every key that its commands name."""
    monkeypatch.chdir(ROOT)
    for word in shlex.split(line):
        assert not word.startswith(("examples/", "tests/")) or (ROOT / word).exists()
    if line.startswith("rbdyn accuracy"):
        monkeypatch.setattr(page, "study", lambda *given: Report("x", {}, [], [], {}))
        page._run(line, None)


def test_script_refuses_an_unknown_part(tmp_path):
    """Script: one sentence, exit code 2, nothing written."""
    program = [sys.executable, page.__file__, tmp_path / "x.md", "--part", "speed"]
    ran = subprocess.run(program, capture_output=True, text=True, check=False)
    assert ran.returncode == 2 and ran.stderr.startswith("--part speed: is none; the parts are tolerances, ")
    assert not list(tmp_path.iterdir())
