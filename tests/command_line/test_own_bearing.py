"""The tutorials of the manual, step by step: their commands run, and what they quote is what these print."""

import math
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

import doe.manual
import rbdyn.cli.manual

FOLDERS = [Path(doe.manual.__file__).parent, Path(rbdyn.cli.manual.__file__).with_name("prose")]
CHAPTERS = [path for folder in FOLDERS for path in sorted(folder.glob("2*.md"))]
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
# Figures are those of one machine; on another the motion parts from them within a turn, and errors scatter.
CLOSE = 0.15


def told(line):
    """Words of a line without its numbers, and its numbers, each with its first error or 0; gains that are little more are left out."""
    bare = re.sub(r"\+\d\S*", "", " ".join(line.split()))
    bare = re.sub(r"(± \S+) ± \S+", r"\1", bare)
    numbers = re.findall(rf"({NUMBER.pattern})(?: ± ({NUMBER.pattern}))?", bare)
    words = NUMBER.sub("#", re.sub(r"± \S+", "", bare))
    return words, [(float(value), float(error or 0.0)) for value, error in numbers]


def agrees(one, other):
    """Whether two numbers are close, or differ by no more than their errors."""
    (first, error), (second, other_error) = one, other
    return abs(first - second) <= max(CLOSE * abs(second), math.hypot(error, other_error))


def blocks(chapter):
    """Fenced blocks of a chapter: language, text."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", chapter.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


@pytest.mark.slow
@pytest.mark.parametrize("chapter", CHAPTERS, ids=lambda path: path.stem)
def test_own_bearing_runs_as_told(tmp_path, chapter):
    """Command line: every step of a tutorial in order; the limit is put where it says; quoted lines are printed."""
    printed, quoted = "", 0
    for language, text in blocks(chapter):
        if language == "sh":
            command, _, into = text.strip().partition(" > ")
            program, *words = shlex.split(command)
            ran = subprocess.run([sys.executable, "-m", program, *words], cwd=tmp_path, capture_output=True, text=True)
            assert ran.returncode == 0, ran.stderr
            printed = ran.stdout
            if into:
                (tmp_path / into).write_text(printed, encoding="utf-8")
        elif text.startswith("[[response]]"):
            study = tmp_path / "study.toml"
            whole = study.read_text(encoding="utf-8")
            assert whole.count(text.replace("upper = 135.0\n", "")) == 1
            study.write_text(whole.replace(text.replace("upper = 135.0\n", ""), text), encoding="utf-8")
        else:
            lines = list(map(told, printed.splitlines()))
            for line in text.splitlines():
                words, numbers = told(line)
                # The front is flat in some clearances, where another machine may pick others: its verdicts are words.
                sure = numbers if program == "rbdyn" else numbers[: 2 if "≤" in line else 1]
                alike = [found for same, found in lines if same == words]
                assert any(all(map(agrees, found, sure)) for found in alike if len(found) == len(numbers)), line
                quoted += 1
    assert quoted > 9


def test_own_bearing_starts_as_told(tmp_path):
    """Command line: the scene of the first step has the lines that the chapter quotes."""
    (_, first), (_, quoted) = blocks(CHAPTERS[0])[:2]
    _, *words = shlex.split(first.partition(" > ")[0])
    ran = subprocess.run([sys.executable, "-m", "rbdyn", *words], cwd=tmp_path, capture_output=True, text=True)
    for line in quoted.splitlines():
        assert line in ran.stdout.splitlines()
