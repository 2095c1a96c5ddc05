"""Options that several commands share."""

from pathlib import Path
from typing import Annotated

import typer

from rbdyn.cli.options import flag

StudyPath = Annotated[Path, typer.Argument(metavar="STUDY.toml", help="Study to run.")]
Data = Annotated[Path | None, typer.Option(metavar="TABLE.csv", help="Runs of a table instead of simulated ones.")]
Workers = Annotated[int | None, typer.Option(min=1, help="Threads; all processors by default.")]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Run on the dask cluster of this scheduler instead of threads.")
]
Retry = Annotated[bool, flag("--retry", says="Run points again that failed before.")]
Direct = Annotated[
    bool, flag("--direct", says="Also search the front on the simulator itself and tell what surfaces lose.")
]
Robust = Annotated[
    bool, flag("--robust", says="Judge the pick over what is not known of the scene; also done where that is declared.")
]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Folder of results and of the store of finished runs.")]
Save = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="Also write the JSON record here.")]
Quiet = Annotated[bool, flag("--quiet", "-q", says="No progress, only the answer.")]
Verbose = Annotated[bool, flag("--verbose", "-v", says="Also print the analysis of variance.")]
