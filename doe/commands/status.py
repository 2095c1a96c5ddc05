"""``doe status``."""

from pathlib import Path
from typing import Annotated

from doe.commands.options import Quiet, StudyPath
from rbdyn.cli.options import Json, folder_option
from rbdyn.cli.terminal import guarded, hand_over


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
        from doe.report.steps.status import print_status
        from doe.study.status import folder_of, study_status
        from doe.study_file import Study

        loaded = Study.load(path)
        record = study_status(loaded, out or folder_of(loaded))
        hand_over(lambda: record, as_json, lambda: print_status(record, quiet))
