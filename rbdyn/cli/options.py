"""Arguments and options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene to simulate.")]
Set = Annotated[list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Replace a key; repeatable.")]
Turns = Annotated[float | None, typer.Option(help="Counted shaft turns [numerics.turns].")]
Replicates = Annotated[int | None, typer.Option(help="Seeded replicates [numerics.replicates].")]
Seed = Annotated[int | None, typer.Option(help="Seed [numerics.seed].")]
Workers = Annotated[int | None, typer.Option(min=1, help="Threads; all processors by default.")]
Out = Annotated[Path | None, typer.Option(metavar="DIR", help="Write result.json, history.csv and pictures here.")]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no notes.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Also print power terms and cost.")]
