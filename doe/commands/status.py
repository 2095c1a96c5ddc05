"""``doe status``."""

from pathlib import Path
from typing import Annotated, Any

import typer

from doe.commands.options import Quiet
from rbdyn.base.faults import InputError
from rbdyn.base.forecast import duration, span
from rbdyn.base.options import Json, folder_option
from rbdyn.base.terminal import guarded, hand_over, print_table
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
    """Show where a study stands: its stage, runs done, failed by cause, running, missing, time spent and left."""
    with guarded(as_json):
        from doe.workflow.status import status_of

        if out is not None and out.exists() and not out.is_dir():
            raise InputError([f"--out {out}: is a file; name the folder of the results"])
        record = status_of(path, out)
        hand_over(lambda: record, as_json, lambda: print_status(record, quiet))


def print_status(record: dict[str, Any], quiet: bool) -> None:
    """A line of counts, one of where they were read, one of stages and one of time; unless ``quiet`` also who runs what, and
    why points failed."""
    points, state = record["points"], record["status"]
    counts = ", ".join(f"{points[kind]} {kind}" for kind in ("done", "failed", "running", "missing"))
    if record["stage"]:
        state += f", {'in stage' if state == 'running' else 'ended in stage'} {record['stage']}"
    kind = "design points" if any(each["name"] == "design runs" for each in record["stages"]) else "runs"
    print(f"{record['study']}: {state}; of {points['total']} {kind} {counts}")
    read = "read from" if Path(record["store"]).exists() else "nothing has run yet in"
    print(f"{read} {record['store']}")
    if record["stages"]:
        listed = ", ".join(_stage(each) for each in record["stages"])
        print(f"{record['command']}, {counted(len(record['stages']), 'step')}: {listed}")
    if record["stopped_by"]:
        print(f"stopped by: {record['stopped_by']}")
    left, runs = "not known yet", ""
    if record["left_s"] is not None:
        left = _span(record["left_s"])
        left += f" ({span(*record['left_range_s'])})" if record["left_s"] else ""
    if (most := record["runs_left"][1]) > 0:
        fewest = record["runs_left"][0]
        runs = f"; runs left {fewest if fewest == most else f'{fewest} to {most}'}"
    print(f"time spent {_span(record['spent_s'])} of one thread{runs}; time left {left}")
    if record["predicted_s"] is not None:
        took = "" if record["took_s"] is None else f"; it took {duration(record['took_s'])}"
        print(f"predicted for the last command from its start: {span(*record['predicted_s'])}{took}")
    if quiet:
        return
    other = {kind: number for kind, number in record["other"].items() if number}
    if other:
        print(f"other runs: {', '.join(f'{number} {kind}' for kind, number in other.items())}")
    if record["running"]:
        rows = [
            (each["label"], each["host"], str(each["pid"]), each["since"], _span(each["for_s"]))
            for each in record["running"]
        ]
        print_table("running", ("", "host", "process", "since", "for"), rows)
    for group in record["failures"]:
        print(f"failed: {', '.join(group['labels'])}: {group['cause']}")


def _stage(stage: dict[str, Any]) -> str:
    """A step and how far it is; a range where nobody knows yet how many runs it takes."""
    name, done, runs, most = (stage[key] for key in ("name", "done", "runs", "most"))
    if stage["state"] == "done":
        return f"{name} {done}" if runs else f"{name} done"
    if not most:
        return name if stage["state"] == "to come" else f"{name} running"
    return f"{name} {done} of {max(runs, done)}{f' to {most}' if most > max(runs, done) else ''}"


def _span(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"
