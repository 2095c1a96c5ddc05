"""Options of several commands, with the simulations, surfaces, agenda and record that follow from them."""

import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from rbdyn.base.command import checkpoint_message, flag, folder_option, notice, output_folder, progress_bar, valued
from rbdyn.base.faults import RunError

if TYPE_CHECKING:
    from doe.clearance import Simulations
    from doe.response_surface import Surface
    from doe.running.runner import AgendaKeeper, Progress
    from doe.study_file import Study
    from rbdyn.base.blocks import Block
    from rbdyn.base.identity import Identity


# Rows of tables by the name of their CSV file.
Tables = Mapping[str, Sequence[Mapping[str, Any]]]
StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study to run.")]
Data = Annotated[Path | None, valued("TABLE.csv", "Table of runs made elsewhere.", "runs are simulated")]
Scheduler = Annotated[
    str | None, valued("ADDRESS", "Run on the dask cluster of this scheduler.", "threads of this machine")
]
Retry = Annotated[bool, flag("--retry", says="Run points again that failed before.")]
Adaptive = Annotated[
    bool, flag("--adaptive", says="Also search the front in few runs, chosen by emulators; the pick is on it.")
]
Robust = Annotated[
    bool, flag("--robust", says="Judge the pick over the unknown inputs of the scene; also done if any are declared.")
]
Out = Annotated[Path | None, folder_option("Folder of results and of the store of finished runs.")]
StudyOut = Annotated[
    Path | None, folder_option("Folder of results and of the store of finished runs.", "STUDY_results")
]
Save = Annotated[Path | None, folder_option("Also write the JSON record here.")]
Quiet = Annotated[bool, flag("--quiet", "-q", says="No progress, only the answer.")]
Verbose = Annotated[
    bool,
    flag(
        "--verbose",
        "-v",
        says="Also every confirmed point, chains, the published table, the analysis of variance, all notes in full.",
    ),
]


def save(
    out: Path | None,
    source: Path,
    name: str,
    record: dict[str, Any],
    tables: Callable[[], Tables],
    identity: "Callable[[], Identity]",
    blocks: "Callable[[], Sequence[Block]]",
) -> list[str]:
    """Write a step of the file ``source`` into the folder of ``--out``, if there is one; returns the names of the files.

    These are its JSON record ``name``, its ``tables`` as CSV, report.html of its ``blocks`` and tables.xlsx. In the folder of a
    finished study the last two begin with the name of the step, so that the study keeps its own.
    """
    if out is None:
        return []
    from rbdyn.base.page import write_with_report
    from rbdyn.base.records import save_table
    from rbdyn.result import write_json

    folder = output_folder(out, "doe", source)

    def write() -> list[str]:
        write_json(folder / name, record)
        for table, rows in tables().items():
            save_table(rows, folder / table)
        return [name, *tables()]

    prefix = f"{Path(name).stem}_" if (folder / "summary.json").exists() else ""
    return write_with_report(folder, identity(), blocks, write, prefix)


@contextmanager
def keeping_runs(out: Path | None, source: Path) -> Iterator[None]:
    """Register that the file ``source`` runs in ``out``, for ``doe status``.

    On Ctrl-C a sentence says that the store in ``out`` keeps the finished runs.
    """
    from doe.running.store import at_work
    from doe.workflow.runs import STORE

    with (
        checkpoint_message(None if out is None else out / STORE),
        nullcontext() if out is None else at_work(source, out / STORE),
    ):
        yield


@contextmanager
def stages(quiet: bool, workers: int | None) -> "Iterator[Callable[[str], Progress]]":
    """Progress of stages by title, one after the other, because a terminal has room for one bar; ``workers`` run at once."""
    with ExitStack() as bars:

        def stage(title: str) -> "Progress":
            bars.close()
            return bars.enter_context(progress_bar(title, quiet, workers))

        yield stage


@contextmanager
def simulations_in(
    folder: Path,
    source: Path,
    workers: int | None,
    scheduler: str | None,
    retry: bool,
    quiet: bool,
    agenda: "AgendaKeeper | None" = None,
) -> "Iterator[Simulations]":
    """Simulations for the file ``source``, stored in a folder and counted in an agenda."""
    from doe.clearance import Simulations
    from doe.running.store import Store
    from doe.workflow.runs import STORE

    with Store(folder / STORE, source.stem) as store, stages(quiet, workers) as progress:
        progress = progress if agenda is None else agenda.announced(progress)
        yield Simulations(store, workers, scheduler, retry, progress, agenda)


@contextmanager
def noted_agenda(
    folder: Path,
    command: str,
    workers: int | None,
    quiet: bool,
    options: Mapping[str, bool] | None = None,
    inputs: str = "",
    question: str = "",
) -> "Iterator[AgendaKeeper]":
    """The agenda of a command in the store of its folder, for ``doe status``; unless ``quiet`` it states a prediction.

    ``inputs``: digest of the inputs of its answer; ``question``: digest of all that decides its runs.
    """
    from doe.running.runner import agenda_in
    from doe.workflow.runs import STORE

    threads = workers or os.cpu_count() or 1
    with agenda_in(folder / STORE, command, threads, options, inputs, notice(quiet), question) as agenda:
        yield agenda


def print_predicted(agenda: "AgendaKeeper | None", as_json: bool) -> None:
    """Print the time of a command compared with the prediction, if there was one."""
    from rbdyn.base.forecast import duration, span

    noted = None if agenda is None or as_json else agenda.agenda
    if noted is not None and noted.prediction_s is not None and noted.took_s is not None:
        print(f"The whole command took {duration(noted.took_s)}; predicted were {span(*noted.prediction_s)}")


class Effort(NamedTuple):
    """Options of the runs of a command: ``--out``, ``--workers``, ``--scheduler``, ``--retry``, and whether it is quiet."""

    out: Path | None
    workers: int | None
    scheduler: str | None
    retry: bool
    quiet: bool


def fitted(study: "Study", data: Path | None, effort: Effort) -> "list[Surface]":
    """Surfaces of a study, of a table or of simulated runs. Raises InputError, RunError, KeyboardInterrupt."""
    from doe.workflow.runs import read_runs, run_design
    from doe.workflow.surfaces import fit_surfaces

    if data is not None:
        return fit_surfaces(study, read_runs(study, data))
    out, workers, scheduler, retry, quiet = effort
    with _store_folder(out, study.path) as folder, progress_bar("design runs", quiet, workers) as progress:
        return fit_surfaces(study, run_design(study, folder, workers, progress, scheduler, retry))


@contextmanager
def _store_folder(out: Path | None, source: Path) -> Iterator[Path]:
    """The stated folder, or one that lasts as long as the command."""
    if out is not None:
        yield output_folder(out, "doe", source)
        return
    from doe.running.store import StoppedError

    with tempfile.TemporaryDirectory() as folder:
        try:
            yield Path(folder)
        except StoppedError as error:
            raise RunError("{}; without --out no finished run is kept: {}".format(*error.args)) from None
