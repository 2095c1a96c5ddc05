"""``doe front``."""

from __future__ import annotations

from typing import Annotated

import typer

from doe.commands.options import Data, Json, Out, Quiet, Retry, Scheduler, StudyPath, Workers
from doe.commands.steps import fitted, save
from rbdyn.terminal import guarded, print_json


def front(
    path: StudyPath,
    data: Data = None,
    out: Out = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Also every point of the front.")] = False,
) -> None:
    """Find the Pareto front on the response surfaces."""
    with guarded(as_json):
        from doe.report.front import front_record, print_front
        from doe.study.front import find_front

        loaded, surfaces = fitted(path, data, out, workers, quiet or as_json, scheduler, retry)
        record = front_record(loaded, surfaces, find_front(loaded, surfaces))
        save(out, "front.json", record)
        if as_json:
            print_json(record)
        else:
            print_front(record, verbose)
