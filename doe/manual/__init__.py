"""What ``doe`` adds to the manual that ``rbdyn manual`` writes: its chapters, which stand next to it, its command, its keys, its drawing (``drawings``)."""

from pathlib import Path
from typing import Any

from typer.main import get_command

from doe.cli import app
from doe.commands.keys import kinds
from doe.manual.drawings import drawings
from doe.report.files import confirmation_sheet, reference_sheet
from doe.report.sections.calibration import cell_sheet
from doe.report.sections.chain import part_sheet
from doe.report.sections.chain import share_sheet as chain_shares
from doe.report.sections.design import run_sheet
from doe.report.sections.duty import DUTY_POINTS
from doe.report.sections.fit import ANOVA, RUNS, TERMS
from doe.report.sections.robust import DECIDERS
from doe.report.sections.unknown import input_sheet, range_sheet, set_sheet, share_sheet
from rbdyn.base.table import Column, Sheet
from rbdyn.scene.keys import Part


def part() -> Part:
    """The part that the entry point names."""
    return Part("doe", Path(__file__).parent, get_command(app), kinds(), drawings, tables)


def tables() -> dict[str, list[Sheet[Any]]]:
    """The files of tables that the commands write."""
    factors, responses = ["{factor}"], ["{response}"]
    front = (
        *Column[Any]("{}", unit="of the name", meaning="point, and its prediction").of([*factors, *responses]),
        *Column[Any](
            "{}_error", unit="of the response", meaning="half width of its 95 % interval, with `--adaptive`"
        ).of(responses),
    )
    study: list[Sheet[Any]] = [
        run_sheet(factors, responses),
        ANOVA,
        TERMS,
        RUNS,
        Sheet("", front, file="front.csv", content="A row a point of the front."),
        confirmation_sheet(factors),
        Sheet("", DUTY_POINTS, file="duty_points.csv", content="A row a response at each point of a duty."),
        part_sheet({}),
        chain_shares({}),
        reference_sheet(factors, responses),
    ]
    deciders = Sheet(
        "", DECIDERS, file="decides.csv", content="The inputs that decide between the pick and the original."
    )
    unknown = [
        set_sheet(["{key}"], responses),
        range_sheet(()),
        share_sheet(()),
        input_sheet(()),
        deciders,
        cell_sheet(()),
    ]
    return {"Tables of a study": study, "Tables of unknown inputs": unknown}
