"""``doe study``."""

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import typer

from doe.commands.options import Direct, Quiet, Retry, Robust, Scheduler, StudyOut, StudyPath, Verbose
from doe.commands.steps import keeping_runs
from rbdyn.cli.options import Json, Workers
from rbdyn.cli.terminal import FAILED, guarded, output_folder, print_json, progress_bar


def study(
    path: StudyPath,
    out: StudyOut = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    direct: Direct = False,
    robust: Robust = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Design, simulate, fit, optimise, confirm and dimension in one go; resumes by itself."""
    folder = out or Path(f"{path.stem}_results")
    with guarded(as_json), keeping_runs(folder, path), ExitStack() as bars:
        from doe.study_file import Study

        loaded = Study.load(path)
        output_folder(folder, "doe", path)
        from doe.study.finished import finished, inputs_digest

        if not (verbose or retry) and (record := finished(folder, inputs_digest(loaded, direct, robust))):
            if not as_json:
                print((folder / "answer.txt").read_text(encoding="utf-8"), end="")
                print(f"finished before, nothing has changed since: {folder} holds {', '.join(record['files'])}")
            _leave_by(record, as_json)
            return
        from doe.report.steps.fit import print_fit
        from doe.report.study.answer import print_outcome, print_verdict
        from doe.report.study.files import write
        from doe.study.whole import run_study

        outcome = run_study(
            loaded,
            folder,
            workers,
            lambda title: bars.enter_context(progress_bar(title, quiet or as_json)),
            scheduler,
            retry,
            direct,
            robust,
        )
        bars.close()
        record = write(outcome, folder)
        if not as_json:
            print_verdict(outcome)
            if verbose:
                print_fit(outcome.surfaces, factors=loaded.factors)
            print_outcome(outcome, quiet)
            print(f"{outcome.cost['total_s']:.1f} s, of which design runs {outcome.cost['design_s']:.1f} s")
            print(f"written to {folder}: {', '.join(record['files'])}")
        _leave_by(record, as_json)


def _leave_by(record: dict[str, Any], as_json: bool) -> None:
    """With the record printed where that is asked for; a study whose pick did not keep its limits has failed."""
    if as_json:
        print_json(record)
    if record["status"] != "ok":
        print(record["limits_sentence"], file=sys.stderr)
        raise typer.Exit(FAILED)
