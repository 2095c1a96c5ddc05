"""``doe status``."""

from pathlib import Path
from typing import Annotated, Any

from doe.commands.options import Quiet, StudyPath
from rbdyn.cli.options import Json, folder_option
from rbdyn.cli.terminal import guarded, hand_over, print_table


def status(
    path: StudyPath,
    out: Annotated[
        Path | None, folder_option("Folder of the study.", "where it runs; if it does not, STUDY_results")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tell where a study stands: done, failed by cause, running, missing, time spent and left."""
    with guarded(as_json):
        from doe.study.status import folder_of, study_status
        from doe.study_file import Study

        loaded = Study.load(path)
        record = study_status(loaded, out or folder_of(loaded))
        hand_over(lambda: record, as_json, lambda: print_status(record, quiet))


def print_status(record: dict[str, Any], quiet: bool) -> None:
    """A line of counts, one of where they were read and one of time; unless ``quiet`` also who runs what, and why points failed."""
    points = record["points"]
    counts = ", ".join(f"{points[kind]} {kind}" for kind in ("done", "failed", "running", "missing"))
    print(f"{record['study']}: {record['status']}; of {points['total']} design points {counts}")
    read = "read from" if Path(record["store"]).exists() else "nothing has run yet in"
    print(f"{read} {record['store']}")
    left = "not known yet" if record["left_s"] is None else _span(record["left_s"])
    print(f"time spent {_span(record['spent_s'])} of one thread; time left {left}")
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


def _span(seconds: float) -> str:
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 120 else f"{minutes // 60} h {minutes % 60} min"
