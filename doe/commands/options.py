"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from rbdyn.base.options import flag, folder_option, valued

StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study to run.")]
Data = Annotated[Path | None, valued("TABLE.csv", "Table of runs made elsewhere.", "runs are simulated")]
Scheduler = Annotated[
    str | None, valued("ADDRESS", "Run on the dask cluster of this scheduler.", "threads of this machine")
]
Retry = Annotated[bool, flag("--retry", says="Run points again that failed before.")]
Adaptive = Annotated[
    bool, flag("--adaptive", says="Also search the front in few runs, chosen by emulators; the pick is of it.")
]
Robust = Annotated[
    bool,
    flag("--robust", says="Judge the pick over the unknown inputs of the scene; also done where that is declared."),
]
Out = Annotated[Path | None, folder_option("Folder of results and of the store of finished runs.")]
StudyOut = Annotated[
    Path | None, folder_option("Folder of results and of the store of finished runs.", "STUDY_results")
]
Save = Annotated[Path | None, folder_option("Also write the JSON record here.")]
Quiet = Annotated[bool, flag("--quiet", "-q", says="No progress, only the answer.")]
Verbose = Annotated[bool, flag("--verbose", "-v", says="Also print the analysis of variance.")]
