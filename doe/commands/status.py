"""``doe status``, which shows where a command stands."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from doe.commands.options import Quiet
from doe.running.runner import count_of
from rbdyn.base.blocks import Block, Bullets, Detail, Paragraph, Table
from rbdyn.base.command import Json, folder_option, guarded, hand_over
from rbdyn.base.faults import InputError
from rbdyn.base.pace import duration
from rbdyn.base.terminal import show
from rbdyn.base.words import counted


def status(
    path: Annotated[
        Path, typer.Argument(metavar="FILE.toml", help="Study, or scene of an uncertainty or calibration.")
    ],
    out: Annotated[
        Path | None,
        folder_option(
            "Folder of the runs.", "where it runs; if it does not, STUDY_results, SCENE_uncertainty or _calibration"
        ),
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Show where a study stands: its stage, runs done, failed by cause, running and to come."""
    with guarded(as_json):
        from doe.workflow.status import status_of

        if out is not None and out.exists() and not out.is_dir():
            raise InputError([f"--out {out}: is a file; name the folder of the results"])
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
