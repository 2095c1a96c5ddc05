"""Commands made of the functions of the library, options of several of them, and what they print while runs go on."""

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.base.blocks import Detail
from rbdyn.base.command import (
    FAILED,
    Force,
    Json,
    alarm,
    as_command,
    checkpoint_message,
    flag,
    folder_option,
    guarded,
    notice,
    option_of,
    print_json,
    progress_bar,
    valued,
)
from rbdyn.base.records import plain
from rbdyn.base.terminal import show

if TYPE_CHECKING:
    from doe.library.answer import Answer
    from doe.running.runner import Progress


StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study to run.")]
Data = Annotated[Path | None, valued("TABLE.csv", "Table of runs made elsewhere.", "runs are simulated")]
Scheduler = Annotated[
    str | None, valued("ADDRESS", "Run on the dask cluster of this scheduler.", "threads of this machine")
]
Retry = Annotated[bool, flag("--retry", says="Run points again that failed before.")]
Part = Annotated[
    str | None, valued("K/N", "Run only part K of N, for a queue; without it all parts are gathered.", "all runs")
]
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


def command(name: str, about: str, kept: str = "", function: str = "", /, **options: Any) -> Callable[..., None]:
    """The command of the function ``name`` of ``doe``; ``about`` is its help.

    ``options``: annotation of each parameter that is an option, in their order, --force and --json apart; ``quiet``, ``verbose``
    and ``as_csv`` say what is printed. ``kept``: results are always in a folder, by default of the file's name and this. The function's own defaults hold for
    what is not stated. ``function``: its name where it is not that of the command.
    """

    def run(*stated: Any, **named: Any) -> None:
        bound = run.__signature__.bind(*stated, **named)  # type: ignore[attr-defined]
        bound.apply_defaults()
        values = bound.arguments
        as_json, as_csv, *levels = (values.pop(key, False) for key in ("as_json", "as_csv", "quiet", "verbose"))
        if kept and values["out"] is None:
            values["out"] = Path(f"{next(iter(values.values())).stem}_{kept}")
        with guarded(as_json), keeping_runs(values["out"]):
            import doe

            with bars(levels[0] or as_json) as progress:
                follow = {"progress": progress, "notice": notice(levels[0])} if "workers" in values else {}
                stated_values = {key: value for key, value in values.items() if value is not None}
                answer = getattr(doe, function or name)(**stated_values, **follow)
            if as_csv and not as_json:
                answer.print_csv()
            else:
                _hand_over(answer, as_json, Detail.of(*levels))

    before = {"out": (), "as_csv": (("as_json", Json),), "quiet": (("as_json", Json),)}
    kinds = dict[str, Any]()
    for key, kind in options.items():
        kinds |= dict(before.get(key, ())) | {key: kind} | ({"force": Force} if key == "out" else {})
    return as_command(run, name, about, list(map(option_of, kinds, kinds.values())))


def _hand_over(answer: "Answer", as_json: bool, detail: Detail) -> None:
    """Print the answer with its files; what it fails for ends with exit code 1, on standard error unless the screen has it."""
    if as_json:
        record = plain(answer.as_dict())
        print_json(record)
        alarm(note for note in record.get("notes", ()) if note["text"] not in answer.unmet)
    else:
        show(answer.screen(), detail)
        for line in answer.closing:
            print(line)
    if as_json or not (answer.shows_unmet and sys.stdout.isatty()):
        for sentence in answer.unmet:
            print(sentence, file=sys.stderr)
    if answer.unmet:
        raise typer.Exit(FAILED)
