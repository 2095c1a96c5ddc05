"""``doe study``."""

import sys
from pathlib import Path
from typing import Any

import typer

from doe.commands.options import Adaptive, Quiet, Retry, Robust, Scheduler, StudyOut, StudyPath, Verbose
from doe.commands.steps import keeping_runs, noted_agenda, print_predicted, stages
from rbdyn.base.blocks import Detail
from rbdyn.base.options import Json, Workers
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import FAILED, guarded, output_folder, print_json


def study(
    path: StudyPath,
    out: StudyOut = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    adaptive: Adaptive = False,
    robust: Robust = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Design, simulate, fit, optimise, confirm and dimension in one go; resumes by itself."""
    folder = out or Path(f"{path.stem}_results")
    with guarded(as_json), keeping_runs(folder, path):
        from doe.study_file import Study

        loaded = Study.load(path)
        output_folder(folder, "doe", path)
        from doe.workflow.status import finished, inputs_digest

        digest = inputs_digest(loaded, adaptive, robust)
        if not (verbose or retry) and (record := finished(folder, digest)):
            if not as_json:
                print((folder / "answer.txt").read_text(encoding="utf-8"), end="")
                print(f"finished before, nothing has changed since: {folder} holds {', '.join(record['files'])}")
            _leave_by(record, as_json)
            return
        from doe.report.study.files import write
        from doe.report.study.summary import blocks
        from doe.workflow.whole import run_study

        options = {"adaptive": adaptive, "robust": robust}
        with noted_agenda(folder, "doe study", workers, quiet, options, digest) as agenda:
            with stages(quiet or as_json, workers) as progress:
                bars = agenda.announced(progress)
                outcome = run_study(loaded, folder, workers, bars, scheduler, retry, **options, agenda=agenda)
            record = write(outcome, folder)
            agenda.finish(record["files"])
        if not as_json:
            show(blocks(record), Detail.of(quiet, verbose))
            print(f"{outcome.cost['total_s']:.1f} s, of which design runs {outcome.cost['design_s']:.1f} s")
            print_predicted(agenda, as_json)
            print(f"written to {folder}: {', '.join(record['files'])}")
        _leave_by(record, as_json)


def _leave_by(record: dict[str, Any], as_json: bool) -> None:
    """With the record printed where that is asked for; a study whose pick did not keep its limits has failed."""
    if as_json:
        print_json(record)
    if record["status"] != "ok":
        print(record["limits_sentence"], file=sys.stderr)
        raise typer.Exit(FAILED)
