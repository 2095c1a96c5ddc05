"""``doe chain``."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from doe.commands.options import Save
from doe.commands.steps import save
from rbdyn.base.blocks import Detail
from rbdyn.base.faults import InputError, refuse
from rbdyn.base.options import Json, flag
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import BAD_INPUT, guarded, hand_over


def chain(
    path: Annotated[
        Path, typer.Argument(metavar="CHAIN.toml", help="Dimension chain to solve, or several in tables named chain.")
    ],
    out: Save = None,
    as_json: Json = False,
    quiet: Annotated[bool, flag("--quiet", "-q", says="Parts only.")] = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also yields by distribution, quantiles, classes.")] = False,
) -> None:
    """Solve dimension chains: limits, yield, contributions, allocation. One that misses its limits is refused."""
    with guarded(as_json):
        from doe.dimension_chain import is_several, read_chains, solve
        from doe.report.sections.parts import chain_blocks
        from doe.report.steps.fit import chains_record

        several = is_several(path)
        results, faults = {}, []
        for name, each in read_chains(path).items():
            try:
                results[name] = solve(each, source=f'{path}: chain "{name}"' if several else str(path))
            except InputError as error:
                faults += error.faults
        refuse(faults)
        record = chains_record(results) if several else next(iter(results.values())).as_dict()
        save(out, path, "chain.json", record)

        def answer() -> None:
            for name, result in results.items():
                show(chain_blocks(name, result.as_dict()), Detail.of(quiet, verbose))

        hand_over(lambda: record, as_json, answer)
        refused = {name: result.status for name, result in results.items() if result.refused}
        for name, status in refused.items():
            print(f"{path}: {f'chain {name}: ' if several else ''}{status}", file=sys.stderr)
        if refused:
            raise typer.Exit(BAD_INPUT)
