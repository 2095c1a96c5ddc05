"""A table of scenes from Python: ``run`` returns its rows with their figures as a frame, ``run_answer`` also what failed.

A person sees how many rows ended, the span of the main figures, and the causes of failures.
"""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any, ClassVar

from doe.library.answer import Answer, Rows, optional_path, part_given, path_given, registered, texts_given
from doe.workflow.effort import Effort, Follow
from rbdyn.base.blocks import Block, Column, Paragraph, Sheet, columns_of, with_notes
from rbdyn.base.faults import InputError
from rbdyn.base.files import write_json
from rbdyn.base.folder import output_folder
from rbdyn.base.notes import Note
from rbdyn.base.records import Record, shown
from rbdyn.base.words import Notice, counted, label

if TYPE_CHECKING:
    import pandas as pd

    from doe.running.store import Cause
    from doe.workflow.scene_table import RowRun

RUN_FILES = ("runs.csv", "runs.json")
# Typical wall time [s] of what is no run.
STEPS_S = 1.0
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


CAUSES: "tuple[Column[Cause], ...]" = (
    Column("cause", text=True),
    Column("count", "d", "rows", at=lambda cause: len(cause.runs)),
    Column("names", words="which", at=lambda cause: _names(cause.labels), text=True),
)


def _names(labels: Sequence[str]) -> str:
    further = len(labels) - ROWS_NAMED
    return ", ".join([*labels[:ROWS_NAMED], *([f"{further} more"] if further > 0 else [])])


def _dangers(runs: "Sequence[RowRun]") -> list[Note]:
    """The dangers of rows, those that differ in their numbers alone once."""
    from doe.running.store import alike

    groups = alike([(run.row.name, note) for run in runs for note in run.dangers], itemgetter(1))
    return [
        group[0][1].about(
            f"in {'row' if len(group) == 1 else 'rows'} {_names([name for name, _ in group])}"
            f"{'; values of the first' if len({note for _, note in group}) > 1 else ''}"
        )
        for group in groups
    ]


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class RunsAnswer(Answer):
    """Rows of a table of scenes with their figures. Tables: "runs" (a row a scene), "failures" (a row a cause).

    ``runs``: every row with its figures or its fault; ``part``: words on the part of the table, empty for the whole.
    """

    runs: "Sequence[RowRun]" = field(default=())
    part: str = ""
    shows_unmet: ClassVar[bool] = True

    @property
    def unmet(self) -> list[str]:
        """How many rows failed."""
        failed = len(self.record["failures"])
        where = "the table runs" if self.folder is None else "runs.csv"
        return [f"{failed} of {counted(len(self.runs), 'row')} failed; {where} says which and why"] if failed else []

    def __getitem__(self, key: str) -> Any:
        return [run.as_dict() for run in self.runs] if key == "rows" else super().__getitem__(key)

    @property
    def causes(self) -> "Sheet[Cause]":
        """A row a cause of failures."""
        from doe.running.store import grouped

        return Sheet("Rows that failed", CAUSES, grouped(run.failure for run in self.runs if run.figures is None))

    @property
    def spans(self) -> Sheet[Span]:
        """A row a main figure over all rows that are done."""
        from rbdyn.dynamics.figures import FIGURES

        spans = []
        for name in (figure.key for figure in FIGURES if figure.key in SHOWN):
            if numbers := [(value, run.row.name) for run in self.runs if (value := run.value(name)) is not None]:
                (low, low_row), (high, high_row) = min(numbers), max(numbers)
                spans.append(Span(name, low, low_row, median(value for value, _ in numbers), high, high_row))
        return Sheet("Results over all rows", columns_of(Span), spans)

    def blocks(self) -> list[Block]:
        failed = len(self.record["failures"])
        ended = f"{len(self.runs) - failed} of {counted(len(self.runs), 'row')} done, {failed} failed"
        gathers = "the same command without --part gathers all parts"
        further = f"; this is {self.part}, and {gathers}" if self.part else ""
        tables = [sheet.block for sheet in (self.spans, self.causes) if sheet.rows]
        return with_notes(self.record["notes"], [Paragraph(f"{ended}{further}"), *tables], judged=False)

    def rows(self) -> Mapping[str, Rows]:
        return {"runs": [run.cells for run in self.runs], "failures": self.causes.records}

    def brief(self) -> str:
        failed = len(self.record["failures"])
        return f"{counted(len(self.runs), 'row')}, {failed} failed{f', {self.part}' if self.part else ''}"


def run(
    table: "Path | str | pd.DataFrame",
    scene: Path | str | None = None,
    out: Path | str | None = None,
    part: str | None = None,
    overrides: Sequence[str] = (),
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> "pd.DataFrame":
    """Simulate every row of a table of scenes, as ``doe run``; a frame with its figures, in the order of the table.

    - ``table``: a frame, or a file of text, a workbook or parquet: columns "name", "scene" (a file next to the table), "designation",
      "replicates", "seed", and keys of a scene such as "operation.inner_speed_rpm"; an empty cell leaves a key as it is
    - ``scene``: SCENE.toml of rows without one; ``overrides`` of its keys in all rows, such as ``["cage.mass_g=50"]``
    - ``out``: folder of the files and the store of runs; finished rows are found there. ``part``: "K/N" runs every N-th row
      from the K-th into a store of its own there, which a call without it takes over
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed rows
    - ``progress(stage, done, total)``: called as rows end; ``notice(sentence)``: called with the number of rows and their time
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    A failed row has "failed" as its status and its fault; the others run. Columns are keys and figures with their units, and
    after each figure the half-width of its 95 % interval. Raises InputError with all faults of the whole table.
    """
    return run_answer(table, scene, out, part, overrides, workers, scheduler, retry, progress, notice, force).table()


def run_answer(
    table: "Path | str | pd.DataFrame",
    scene: Path | str | None = None,
    out: Path | str | None = None,
    part: str | None = None,
    overrides: Sequence[str] = (),
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> RunsAnswer:
    """What the command ``doe run`` prints; arguments as those of ``run``."""
    from doe.library.studies import SHORTER
    from doe.running.runner import gather, part_folder, refuse_other_parts, rows_of
    from doe.workflow.scene_table import RowRun, read_scene_table, rows_stage, run_rows, table_digest
    from rbdyn.base.html import REPORT_FILES, write_with_report
    from rbdyn.base.identity import identity_of

    content: Any = table if hasattr(table, "columns") else path_given(table, "table")
    base, target = optional_path(scene, "scene"), optional_path(out, "out")
    assignments = texts_given(overrides, "overrides", '["cage.mass_g=50"]')
    effort = Effort(workers, scheduler, retry, progress, notice)
    share = part_given(part)
    if share is not None and target is None:
        raise InputError(f"--part {part}: needs --out DIR, the folder that all parts share")
    folder = None if target is None else part_folder(target, share)
    source = content if isinstance(content, Path) else None
    with ExitStack() as stack:
        output = stack.enter_context(output_folder(folder, "doe", (*RUN_FILES, *REPORT_FILES), force=force))
        scenes = read_scene_table(content, base, assignments)
        rows, digest = scenes.rows[rows_of(share)], table_digest(scenes)
        if not rows:
            raise InputError(f"--part {part}: has no row, since the table has {len(scenes.rows)}; name fewer parts")
        if target is not None:
            refuse_other_parts(target, digest)
        output.claim(source, *([] if base is None else [base]))
        stack.enter_context(registered(source, folder) if source is not None else nullcontext())
        place = stack.enter_context(effort.folder(folder))
        if share is None:
            gather(place)
        with effort.agenda(place, "doe run", inputs=digest) as agenda:
            agenda.plan([rows_stage(scenes, rows)], SHORTER, STEPS_S)
            with effort.simulations(place, scenes.path, agenda) as simulations:
                runs = list(run_rows(scenes, rows, simulations))
            words = "" if share is None else f"part {share[0]} of {share[1]}"
            record = _record(runs, scenes.notes, "" if folder is None else str(folder / "runs.csv"))
            identity = identity_of("doe run", {}, [file for file in (source, base) if file is not None])
            answer = RunsAnswer(record, folder, (), identity=identity, runs=runs, part=words)

            def write(stage: Path) -> None:
                from rbdyn.base.records import save_rows

                save_rows(lambda: (run.cells for run in runs), stage / "runs.csv")
                write_json(stage / "runs.json", record, RowRun.as_dict)

            written = write_with_report(output, identity, answer.blocks, write)
            agenda.finish(written)
    return replace(answer, files=tuple(written))


def _record(runs: "Sequence[RowRun]", notes: Sequence[Any], table: str) -> dict[str, Any]:
    """The JSON of the command."""
    failures = [run for run in runs if run.figures is None]
    return {
        "status": "failed" if failures else "ok",
        "rows": runs,
        "failures": [{"row": run.row.number, "name": run.row.name, "cause": run.cause} for run in failures],
        "table": table or None,
        "notes": [*_dangers(runs), *notes],
    }
