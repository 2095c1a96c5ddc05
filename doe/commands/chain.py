"""``doe chain``."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from doe.commands.options import Json, Save
from doe.commands.steps import save
from rbdyn.terminal import BAD_INPUT, guarded, print_json


def chain(
    path: Annotated[Path, typer.Argument(metavar="CHAIN.toml", help="Dimension chain to solve.")],
    out: Save = None,
    as_json: Json = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Parts only.")] = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Also yields and contributions.")] = False,
) -> None:
    """Solve a dimension chain: limits, yield, contributions, allocation. One that misses its limits is refused."""
    with guarded(as_json):
        from doe.dimension_chain import read_chain, solve
        from doe.report.chain import print_chain

        result = solve(read_chain(path))
        save(out, "chain.json", result.as_dict())
        if as_json:
            print_json(result.as_dict())
        else:
            print_chain(path.stem, result, quiet, verbose)
        if result.status.startswith("refused"):
            print(f"{path}: {result.status}", file=sys.stderr)
            raise typer.Exit(BAD_INPUT)
