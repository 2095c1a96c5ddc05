"""``doe fit``."""

from __future__ import annotations

from doe.commands.options import Data, Json, Out, Quiet, Retry, Scheduler, StudyPath, Workers
from doe.commands.steps import fitted, save
from rbdyn.terminal import guarded, print_json


def fit(
    path: StudyPath,
    data: Data = None,
    out: Out = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit the response surfaces and print their analysis of variance."""
    with guarded(as_json):
        from doe.report.fit import fit_record, print_fit

        _, surfaces = fitted(path, data, out, workers, quiet or as_json, scheduler, retry)
        record = fit_record(surfaces)
        save(out, "fit.json", record)
        if as_json:
            print_json(record)
        else:
            print_fit(surfaces, quiet)
