"""``doe status``."""

from pathlib import Path

from doe.commands.options import Out, Quiet, StudyPath
from rbdyn.cli.options import Json
from rbdyn.cli.terminal import guarded, hand_over


def status(path: StudyPath, out: Out = None, as_json: Json = False, quiet: Quiet = False) -> None:
    """Tell where a study stands: done, failed by cause, running, missing, time spent and left."""
    with guarded(as_json):
        from doe.report.steps.status import print_status
        from doe.study.status import study_status
        from doe.study_file import Study

        record = study_status(Study.load(path), out or Path(f"{path.stem}_results"))
        hand_over(lambda: record, as_json, lambda: print_status(record, quiet))
