"""The page of measured figures: its commands name files and keys that exist."""

import shlex
import tomllib
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
