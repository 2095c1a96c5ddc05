"""What ``doe`` adds to the manual that ``rbdyn manual`` writes: its chapters, which stand next to it, its command, its keys, its drawing."""

from pathlib import Path
from typing import Any

from typer.main import get_command

from doe.cli import app
from doe.commands.keys import kinds
from doe.manual.drawings import drawings
from doe.report.files import confirmation_sheet, reference_sheet
from doe.report.sections.design import run_sheet
from doe.report.sections.duty import DUTY_POINTS
from doe.report.sections.fit import ANOVA, RUNS, TERMS
from rbdyn.base.table import Sheet
from rbdyn.scene.keys import Part


def part() -> Part:
    """The part that the entry point names."""
    return Part("doe", Path(__file__).parent, get_command(app), kinds(), drawings, tables)


def tables() -> dict[str, list[Sheet[Any]]]:
    """The files of tables that the commands write."""
    factors, responses = ["{factor}"], ["{response}"]
    study: list[Sheet[Any]] = [
        run_sheet(factors, responses),
        ANOVA,
        TERMS,
        RUNS,
        confirmation_sheet(factors),
        Sheet("", DUTY_POINTS, file="duty_points.csv", content="A row a response at each point of a duty."),
        reference_sheet(factors, responses),
    ]
    return {"Tables of a study": study}
