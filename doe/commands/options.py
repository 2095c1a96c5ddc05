"""Options of several commands, and what they print while runs go on and after these."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rbdyn.base.command import checkpoint_message, flag, folder_option, progress_bar, valued

if TYPE_CHECKING:
    from doe.running.runner import Progress


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
    bool,
    flag(
        "--robust",
        says="Judge the pick over the unknown inputs of the scene; the table robust of a study asks for it too.",
    ),
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


@contextmanager
def keeping_runs(out: Path | None) -> Iterator[None]:
    """On Ctrl-C a sentence says that the store in ``out`` keeps the finished runs."""
    from doe.running.store import STORE

    with checkpoint_message(None if out is None else out / STORE):
        yield


@contextmanager
def bars(quiet: bool) -> "Iterator[Callable[[str, int, int], None]]":
    """``progress(stage, done, total)`` on a terminal, one bar at a time for which it has room."""
    with ExitStack() as stack:
        stage, last = "", 0
        bar: Progress | None = None

        def progress(title: str, done: int, total: int) -> None:
            nonlocal stage, last, bar
            if bar is None or title != stage or done < last:
                stack.close()
                bar = stack.enter_context(progress_bar(title, quiet))
            stage, last = title, done
            bar(done, total)

        yield progress
