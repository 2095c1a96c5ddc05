"""The page of measured figures: its commands name files and keys that exist."""

from __future__ import annotations

import shlex
import tomllib
from datetime import date
from pathlib import Path

import measured_page as page
import pytest

from rbdyn.accuracy.report import Report

ROOT = Path(__file__).parents[2]
WHOLE = tomllib.loads(Path(page.__file__).with_name("measured.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("line", [line for part in WHOLE["part"] for line in part["commands"]])
def test_unit_commands_name_files_and_keys_that_exist(line, monkeypatch):
    """Unit: the page would find every file and every key that its commands name."""
    monkeypatch.chdir(ROOT)
    for word in shlex.split(line):
        assert not word.startswith(("examples/", "tests/")) or (ROOT / word).exists()
    if line.startswith("rbdyn accuracy"):
        monkeypatch.setattr(page, "study", lambda *given: Report("x", {}, [], [], {}))
        page._run(line, None)


@pytest.mark.parametrize("day", ["2026-01-31", date.today().isoformat()], ids=["past", "today"])
def test_unit_a_part_of_another_day_says_so(tmp_path, day):
    """Unit: a part that is not run keeps its tables with their date, and says so unless that is today's."""
    file, block = tmp_path / "page.md", f"*Measured {day}; times include compiling; a machine.*\n\n`a command`, 1 s:\n"
    file.write_text(f"<!-- study -->\n{block}<!-- /study -->\n", encoding="utf-8")
    for _ in range(2):
        page._write(
            file, WHOLE, page.kept_blocks(file.read_text(encoding="utf-8"), [part["name"] for part in WHOLE["part"]])
        )
        found = file.read_text(encoding="utf-8")
        first, _, rest = block.partition("\n")
        why = (
            "" if day == date.today().isoformat() else f"*Kept: not run for the page of {date.today().isoformat()}.*\n"
        )
        assert f"<!-- study -->\n{first}\n{why}{rest}<!-- /study -->" in found
