"""What a person sees of a table of scenes: how many rows ended, the span of the main figures, and the causes of failures."""

from collections.abc import Sequence

import numpy as np

from doe.running.store import Cause
from doe.workflow.scene_table import RowRun, causes_of
from rbdyn.base.blocks import Block, Column, Paragraph, Sheet, columns_of, with_notes
from rbdyn.base.notes import Notes
from rbdyn.base.records import Record, shown
from rbdyn.base.words import counted, label
from rbdyn.dynamics.figures import FIGURES

# Rows that a table names of one cause.
ROWS_NAMED = 8
# Figures of rollers that every row has and that its screen shows.
SHOWN = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_slip")


class Span(Record):
    """A figure over all rows: the least, the median and the largest value, and the names of the rows with the ends."""

    figure: str = shown("figure", label)
    low: float = shown("least")
    low_row: str = shown("in row", text=True)
    median: float = shown("median")
    high: float = shown("largest")
    high_row: str = shown("in row", text=True)


CAUSES: tuple[Column[Cause], ...] = (
    Column("cause", text=True, meaning="cause of the failure"),
    Column("count", "d", "rows", at=lambda cause: len(cause.runs), meaning="number of rows that failed for it"),
    Column("names", words="which", at=lambda cause: _names(cause), text=True, meaning="names of the first of them"),
)


def _names(cause: Cause) -> str:
    further = len(cause.labels) - ROWS_NAMED
    return ", ".join([*cause.labels[:ROWS_NAMED], *([f"{further} more"] if further > 0 else [])])


def cause_sheet(runs: Sequence[RowRun]) -> Sheet[Cause]:
    """A row a cause of failures."""
    return Sheet("Rows that failed", CAUSES, causes_of(runs), content="The causes of failed rows of a table of scenes.")


def span_sheet(runs: Sequence[RowRun]) -> Sheet[Span]:
    """A row a main figure over all rows that are done."""
    spans = []
    for name in (figure.key for figure in FIGURES if figure.key in SHOWN):
        if numbers := [(value, run.row.name) for run in runs if (value := run.value(name)) is not None]:
            (low, low_row), (high, high_row) = min(numbers), max(numbers)
            spans.append(Span(name, low, low_row, float(np.median([value for value, _ in numbers])), high, high_row))
    return Sheet("Results over all rows", columns_of(Span), spans)


def scene_run_blocks(runs: Sequence[RowRun], part: str, notes: Notes) -> list[Block]:
    """The answer of ``doe run``."""
    failed = sum(run.figures is None for run in runs)
    ended = f"{len(runs) - failed} of {counted(len(runs), 'row')} done, {failed} failed"
    further = f"; this is {part}, and the same command without --part gathers all parts" if part else ""
    spans, causes = span_sheet(runs), cause_sheet(runs)
    tables = [sheet.block for sheet in (spans, causes) if sheet.rows]
    return with_notes(notes, [Paragraph(f"{ended}{further}"), *tables], judged=False)
