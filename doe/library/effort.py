"""How the functions of ``doe`` run: arguments checked, threads or a cluster, progress, and the folder that keeps the runs."""

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from doe.running.runner import AgendaKeeper, Progress, agenda_in
from doe.running.store import StoppedError, Store, at_work
from doe.workflow.runs import STORE
from rbdyn.base.faults import LONGEST_NAME, InputError, RunError, one_line, path_of, refuse
from rbdyn.base.folder import OutputFolder, output_folder
from rbdyn.base.pace import Notice
from rbdyn.base.page import REPORT_FILES, with_report
from rbdyn.result import write_json

if TYPE_CHECKING:
    from doe.clearance import Simulations
    from doe.library.answer import Answer

# Rows of tables by the name of their CSV file.
Tables = Mapping[str, Sequence[Mapping[str, Any]]]
# ``progress(stage, done, total)``: called as the runs of a stage end.
Follow = Callable[[str, int, int], None] | None


class Effort(NamedTuple):
    """How to run: ``workers`` threads (None: all processors) or the cluster of a ``scheduler``'s address.

    ``retry``: repeat runs that failed before. ``follow`` hears of runs that end, ``notice`` of their number and time.
    """

    workers: int | None = None
    scheduler: str | None = None
    retry: bool = False
    follow: Follow = None
    notice: Notice = None

    def progress(self, title: str) -> Progress:
        """Progress of the stage of this title."""

        def progress(done: int, total: int) -> None:
            if self.follow is not None:
                self.follow(title, done, total)

        return progress

    @property
    def threads(self) -> int:
        """Number of threads. Raises InputError unless it is a whole number from 1."""
        from rbdyn.dynamics.ensemble import threads_of

        return threads_of(self.workers)

    @contextmanager
    def agenda(
        self,
        folder: Path,
        command: str,
        options: Mapping[str, bool] | None = None,
        inputs: str = "",
        question: str = "",
    ) -> Iterator[AgendaKeeper]:
        """The agenda of a command in the store of its folder, for ``doe status``.

        ``inputs``: digest of the inputs of its answer; ``question``: digest of all that decides its runs.
        """
        with agenda_in(folder / STORE, command, self.threads, options, inputs, self.notice, question) as agenda:
            yield agenda

    @contextmanager
    def simulations(self, folder: Path, source: Path, agenda: AgendaKeeper) -> "Iterator[Simulations]":
        """Simulations for the file ``source``, stored in a folder and counted in an agenda."""
        from doe.clearance import Simulations

        with Store(folder / STORE, source.stem) as store:
            progress = agenda.announced(self.progress)
            yield Simulations(store, self.workers, self.scheduler, self.retry, progress, agenda)

    @contextmanager
    def folder(self, out: Path | None) -> Iterator[Path]:
        """The stated folder, or one that lasts as long as the runs."""
        if out is not None:
            yield out
            return
        with tempfile.TemporaryDirectory() as folder:
            try:
                yield Path(folder)
            except StoppedError as error:
                raise RunError("{}; without --out no finished run is kept: {}".format(*error.args)) from None


def path_given(argument: Any, name: str) -> Path:
    """The argument ``name`` of a call as a path. Raises InputError where it is none."""
    try:
        return path_of(argument)
    except InputError:
        shown = one_line(repr(argument), LONGEST_NAME)
        raise InputError([f"{name} = {shown}: must be the path of a file or a folder; check the call"]) from None


def texts_given(argument: Any, name: str, example: str) -> list[str]:
    """The argument ``name`` of a call as a list of texts; None is an empty one. Raises InputError for anything else."""
    if argument is None:
        return []
    # The order of a set changes from one process to the next.
    words = "a set has no order; write" if isinstance(argument, set | frozenset) else "must be"
    valid = isinstance(argument, list | tuple) and all(isinstance(text, str) for text in argument)
    refuse([] if valid else [f"{name} = {one_line(repr(argument), LONGEST_NAME)}: {words} a list such as {example}"])
    return list(argument)


@contextmanager
def registered(source: Path, folder: Path | None) -> Iterator[None]:
    """Register that the file ``source`` runs in a folder, for ``doe status``; nothing without a folder."""
    if folder is None:
        yield
        return
    with at_work(source, folder / STORE):
        yield


def step_folder(
    out: Path | None, step: str, tables: Sequence[str], force: bool
) -> AbstractContextManager[OutputFolder]:
    """Folder of a step alone, such as "fit", and of the CSV files of its ``tables``; see ``saved``."""
    reports = (*REPORT_FILES, *(f"{step}_{name}" for name in REPORT_FILES))
    return output_folder(out, "doe", (f"{step}.json", *(f"{table}.csv" for table in tables), *reports), force=force)


def saved(folder: OutputFolder, name: str, answer: "Answer", tables: Callable[[], Tables]) -> tuple[str, ...]:
    """Write the answer of a step into its folder, if there is one; names of the files.

    These are its JSON record ``name``, its ``tables`` as CSV, report.html of its blocks and tables.xlsx. In the folder of a
    finished study the last two begin with the name of the step, so that the study keeps its own.
    """
    if folder.path is None or answer.identity is None:
        return ()
    from rbdyn.base.records import save_table

    def write(stage: Path) -> list[str]:
        write_json(stage / name, answer.as_dict())
        rows_by_file = tables()
        for table, rows in rows_by_file.items():
            save_table(rows, stage / table)
        return [name, *rows_by_file]

    prefix = f"{Path(name).stem}_" if (folder.path / "summary.json").exists() else ""
    identity = answer.identity
    return tuple(folder.write(lambda stage: with_report(stage, identity, answer.blocks, write, prefix)))
