"""Commands that are functions of the library, and those that only read: ``doe status`` and ``doe keys``."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from doe.running.runner import count_of
from rbdyn.base.blocks import Block, Bullets, Detail, Paragraph, Table
from rbdyn.base.command import (
    FAILED,
    Force,
    Json,
    Set,
    Workers,
    alarm,
    as_command,
    checkpoint_message,
    flag,
    folder_option,
    guarded,
    hand_over,
    notice,
    option_of,
    print_json,
    progress_bar,
    valued,
    verbose_flag,
)
from rbdyn.base.faults import InputError
from rbdyn.base.records import plain
from rbdyn.base.terminal import show
from rbdyn.base.words import counted, duration
from rbdyn.scene.keys import AsSchema, Word
from rbdyn.scene.keys import run as explain

if TYPE_CHECKING:
    from pydantic import BaseModel

    from doe.library.answer import Answer
    from doe.running.runner import Progress


StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study file.")]
Data = Annotated[Path | None, valued("TABLE.csv", "Use this table of runs instead of simulations.", "simulated runs")]
Scheduler = Annotated[
    str | None, valued("ADDRESS", "Run on the dask cluster with this scheduler.", "threads of this machine")
]
Retry = Annotated[bool, flag("--retry", help="Run failed points again.")]
Part = Annotated[
    str | None, valued("K/N", "Run only part K of N, for a queue; without it gather all parts.", "all runs")
]
Adaptive = Annotated[
    bool, flag("--adaptive", help="Search the Pareto front with emulators (few extra runs) and select from it.")
]
Robust = Annotated[
    bool,
    flag(
        "--robust",
        help="Compute the probability that the selected design is better despite unknown inputs; automatic with the table robust.",
    ),
]
STORE = "Folder of results and of the store of finished runs."
Out = Annotated[Path | None, folder_option(STORE)]
Save = Annotated[Path | None, folder_option("Write the JSON record to this folder.")]
Quiet = Annotated[bool, flag("--quiet", "-q", help="Print only the answer, without progress.")]
Verbose = Annotated[
    bool,
    flag(
        "--verbose",
        "-v",
        help="Add every confirmed point, chains, the published table, the analysis of variance, all notes in full.",
    ),
]


def keeping_runs(out: Path | None) -> AbstractContextManager[None]:
    """On Ctrl-C a sentence says that the store in ``out`` keeps the finished runs."""
    from doe.running.store import STORE

    return checkpoint_message(None if out is None else out / STORE)


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


ScenePath = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene file of a roller bearing.")]
Texts = list[str] | None
# How runs are made, of every command that simulates.
RUNS = {"workers": Workers, "scheduler": Scheduler, "retry": Retry}

study = command(
    "study",
    "Run a complete study: design, simulate, fit, optimise, confirm and dimension. Resumes after an interruption.",
    "results",
    path=StudyPath,
    out=Annotated[Path | None, folder_option(STORE, "STUDY_results")],
    part=Part,
    **RUNS,
    adaptive=Adaptive,
    robust=Robust,
    quiet=Quiet,
    verbose=Verbose,
)
run = command(
    "run",
    "Simulate every row of a table of scenes, even if some fail. Resumes after an interruption.",
    "results",
    "run_answer",
    table=Annotated[
        Path, typer.Argument(metavar="TABLE", help="CSV, xlsx or parquet: one row per run, one column per scene key.")
    ],
    scene=Annotated[Path | None, valued("SCENE.toml", "Scene file of rows without one.", "column scene", "--scene")],
    part=Part,
    overrides=Set,
    out=Annotated[Path | None, folder_option(STORE, "TABLE_results")],
    **RUNS,
    quiet=Quiet,
)
design = command(
    "design",
    "Print the design: every run, and how well the runs identify the terms of each model.",
    path=StudyPath,
    out=Save,
    as_csv=Annotated[bool, flag("--csv", help="Print only one CSV table.")],
    quiet=Annotated[bool, flag("--quiet", "-q", help="Print only actual values.")],
    verbose=Annotated[bool, verbose_flag("Add seeds and leverages.")],
)
fit = command(
    "fit",
    "Fit the response surfaces and print their analysis of variance.",
    path=Annotated[Path | None, typer.Argument(metavar="STUDY.toml", help="Study file; none for a table alone.")],
    data=Data,
    factors=Annotated[
        Texts,
        valued(
            "NAME",
            "Column of --data that is a factor, without STUDY; repeatable.",
            "all numbers but --response",
            "--factor",
        ),
    ],
    responses=Annotated[
        Texts,
        valued(
            "NAME",
            "Column of --data to be fitted, without STUDY; repeatable.",
            "all numbers but --factor",
            "--response",
        ),
    ],
    model=Annotated[
        str | None,
        valued("NAME", "linear, interaction, pure_quadratic, quadratic or reduced, without STUDY.", "quadratic"),
    ],
    out=Out,
    **RUNS,
    quiet=Quiet,
    verbose=Annotated[bool, verbose_flag("Add residual, leverage and Cook's distance of each run.")],
)
front = command(
    "front",
    "Find the Pareto front on the response surfaces.",
    path=StudyPath,
    data=Data,
    out=Out,
    **RUNS,
    point=Annotated[
        str | None,
        valued(
            "A,B,...|NAME=A,...",
            "Predict the responses at this point: factor values in order, or by name (the rest at the baseline).",
            "none",
        ),
    ],
    quiet=Quiet,
    verbose=Annotated[bool, verbose_flag("Add every point of the front.")],
)
chain = command(
    "chain",
    "Solve dimension chains: limits, yield, contributions, allocation. Exits with code 1 if a chain misses its limits.",
    path=Annotated[
        Path, typer.Argument(metavar="CHAIN.toml", help="Dimension chain to solve, or several in tables named chain.")
    ],
    out=Save,
    quiet=Annotated[bool, flag("--quiet", "-q", help="Print only the parts.")],
    verbose=Annotated[bool, verbose_flag("Add yields by distribution, quantiles, classes.")],
)
uncertainty = command(
    "uncertainty",
    "Vary the unknown inputs: range of each result, and how much each input contributes.",
    "uncertainty",
    path=ScenePath,
    points=Annotated[int | None, valued("N", "Input sets to begin with, a power of two.", "128", min=16, max=512)],
    target=Annotated[
        str | None, valued("SHARE", "Allowed standard error of the ends of a range, as a share of its width.", "10%")
    ],
    figures=Annotated[
        Texts,
        valued(
            "NAME",
            "Add a result, such as land_film_power_W or outer_max_pressure_MPa; repeatable.",
            "impact, whirl, loss, cage speed, temperatures",
            "--figure",
        ),
    ],
    overrides=Set,
    out=Annotated[Path | None, folder_option(STORE, "SCENE_uncertainty")],
    **RUNS,
    quiet=Quiet,
)
calibrate = command(
    "calibrate",
    "Estimate unknown inputs from test-rig measurements, and check whether the model is calibrated.",
    "calibration",
    path=ScenePath,
    data=Annotated[
        Path,
        typer.Option(metavar="RIG.csv", help="Measurements, one row per condition: scene keys, results, their _sd."),
    ],
    free=Annotated[Texts, valued("KEY", "Estimate this key; repeatable.", "all unknown inputs", "--free")],
    overrides=Set,
    out=Annotated[Path | None, folder_option(STORE, "SCENE_calibration")],
    **RUNS,
    quiet=Quiet,
)


def keys(word: Word = None, as_schema: AsSchema = False, as_json: Json = False) -> None:
    """Explain every key of a study, a dimension chain and a calibration, and the columns of measured tables."""
    with guarded(as_json):
        explain(files() if as_schema else kinds(), word, as_schema, as_json)


def files() -> "dict[str, type[BaseModel]]":
    """The kinds of TOML files that ``doe`` reads next to scenes."""
    from doe.dimension_chain.links import Chain
    from doe.dimension_chain.reading import Chains
    from doe.study_file import StudyFile

    return {"study": StudyFile, "chain": Chain, "file of chains": Chains}


def kinds() -> "dict[str, type[BaseModel]]":
    """These, the tables of a scene that ``doe`` reads, and the tables of measurements, whose keys are columns."""
    from doe.workflow.rig import RigTable, SceneTables

    measured = "measurements on a rig, column"
    return {**files(), "unknown inputs and calibration of a scene": SceneTables, measured: RigTable}


def status(
    path: Annotated[
        Path,
        typer.Argument(
            metavar="FILE", help="Study, scene of an uncertainty analysis or calibration, or table of doe run."
        ),
    ],
    out: Annotated[
        Path | None,
        folder_option(
            "Folder of the runs.",
            "where it runs, otherwise STUDY_results, TABLE_results, SCENE_uncertainty or _calibration",
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show the progress of a study: stage, finished and failed runs (with cause), running and missing runs, time."""
    with guarded(as_json):
        from doe.workflow.status import status_of

        if out is not None and out.exists() and not out.is_dir():
            raise InputError(f"--out {out}: is a file; name the folder of the results")
        record = status_of(path, out)
        hand_over(lambda: record, as_json, lambda: show(status_blocks(record), Detail.of(quiet)))


def status_blocks(record: Mapping[str, Any]) -> list[Block]:
    """Counts of runs, their store, the steps and the time; not quietly also who runs what, and why points failed."""
    store = record["store"]
    other = ", ".join(f"{number} {state}" for state, number in record["other"].items() if number)
    rows = [
        (run["label"], run["host"], str(run["pid"]), run["since"], duration(run["for_s"])) for run in record["running"]
    ]
    causes = [f"Failed: {', '.join(group['labels'])}: {group['cause']}" for group in record["failures"]]
    return [
        Paragraph(_counts(record), "statement"),
        Paragraph(f"Read from {store}" if Path(store).exists() else f"Nothing has run yet in {store}", "small"),
        Paragraph(_steps(record)),
        Paragraph(f"Stopped by: {record['stopped_by']}" if record["stopped_by"] else ""),
        Paragraph(_runs_left(record)),
        Paragraph(f"Other runs: {other}" if other else "", detail=Detail.USUAL),
        Table("Running", ("", "host", "process", "since", "for"), rows, detail=Detail.USUAL),
        Bullets(causes, detail=Detail.USUAL),
    ]


def _counts(record: Mapping[str, Any]) -> str:
    """The state, its stage, and the runs by what became of them."""
    state, stage, points = record["status"], record["stage"], record["points"]
    if stage:
        state = f"running, in stage {stage}" if state == "running" else f"{state}, ended in stage {stage}"
    runs = "design points" if any(step["name"] == "design runs" for step in record["stages"]) else "runs"
    counts = (
        ", ".join(f"{points[key]} {key}" for key in ("done", "failed", "running")) + f", {points['missing']} to come"
    )
    return f"{record['study']}: {state}; of {points['total']} {runs} {counts}"


def _steps(record: Mapping[str, Any]) -> str:
    """The command with its steps; empty where none is planned."""
    steps = record["stages"]
    return f"{record['command']}, {counted(len(steps), 'step')}: {', '.join(map(_step, steps))}" if steps else ""


def _step(step: Mapping[str, Any]) -> str:
    """A step with its finished runs; a range where the number of its runs is not yet known."""
    name, count, runs, most = (step[key] for key in ("name", "done", "runs", "most"))
    if step["state"] == "done":
        return f"{name} {count}" if runs else f"{name} done"
    if not most:
        return name if step["state"] == "to come" else f"{name} running"
    fewest = max(runs, count)
    return f"{name} {count} of {count_of((fewest, most))}"


def _runs_left(record: Mapping[str, Any]) -> str:
    """The time that runs took, and the runs that are left."""
    left = count_of((record["runs_left"][0], record["runs_left"][1]))
    return f"Time spent {duration(record['spent_s'])} of one thread" + ("" if left == "0" else f"; runs to come {left}")
