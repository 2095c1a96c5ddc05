"""``doe fit``."""

from typing import Annotated

from doe.commands.options import Data, Out, Quiet, Retry, Scheduler, StudyPath, Workers
from doe.commands.steps import Effort, fitted, keeping_runs, save
from rbdyn.cli.options import Json, flag
from rbdyn.cli.terminal import guarded, hand_over


def fit(
    path: StudyPath,
    data: Data = None,
    out: Out = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[
        bool, flag("--verbose", "-v", says="Also residual, leverage and Cook's distance of each run.")
    ] = False,
) -> None:
    """Fit the response surfaces and print their analysis of variance."""
    with guarded(as_json), keeping_runs(out):
        from doe.report.steps.fit import fit_record, fit_tables, print_fit
        from doe.study.surfaces import with_rivals

        loaded, surfaces = fitted(path, data, Effort(out, workers, scheduler, retry, quiet or as_json))
        surfaces = with_rivals(surfaces)
        record = fit_record(surfaces)
        save(out, path, "fit.json", record)
        if out is not None:
            import pandas as pd

            for name, rows in fit_tables(surfaces).items():
                pd.DataFrame(rows).to_csv(out / name, index=False)
        hand_over(lambda: record, as_json, lambda: print_fit(surfaces, quiet, verbose, loaded.factors))
