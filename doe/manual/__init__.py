"""What ``doe`` adds to the manual that ``rbdyn manual`` writes: its chapters, which stand next to it, its command, its keys, its drawing."""

from pathlib import Path
from typing import Any

from typer.main import get_command

from doe.cli import app
from doe.commands.keys import kinds
from doe.manual.drawings import drawings
from doe.report.sections.design import run_sheet
from doe.report.sections.fit import ANOVA, RUNS, TERMS
from rbdyn.base.table import Sheet
from rbdyn.scene.keys import Part


def part() -> Part:
    """The part that the entry point names."""
    return Part("doe", Path(__file__).parent, get_command(app), kinds(), drawings, tables)


def tables() -> dict[str, list[Sheet[Any]]]:
    """The files of tables that the commands write."""
    return {"Tables of a study": [run_sheet(["{factor}"], ["{response}"]), ANOVA, TERMS, RUNS]}
