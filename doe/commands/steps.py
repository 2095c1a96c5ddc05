"""One step of a study alone: ``doe design``, ``doe fit``, ``doe front`` and ``doe chain``."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from doe.commands.options import Data, Out, Quiet, Retry, Save, Scheduler, StudyPath, bars, keeping_runs
from rbdyn.base.blocks import Detail
from rbdyn.base.command import FAILED, Force, Json, Workers, flag, guarded, hand_over, notice, valued
from rbdyn.base.terminal import show


def design(
    path: StudyPath,
    out: Save = None,
    force: Force = False,
    as_json: Json = False,
    as_csv: Annotated[bool, flag("--csv", says="Print a CSV table and nothing else.")] = False,
    quiet: Annotated[bool, flag("--quiet", "-q", says="Actual values only.")] = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also seeds and leverages.")] = False,
) -> None:
    """Print the design: every run, and how well the runs identify the terms of the models."""
    with guarded(as_json):
        from doe.library.steps import design
        from doe.report.sections.design import print_csv

        answer, detail = design(path, out, force), Detail.of(quiet, verbose)
        hand_over(
            answer.as_dict,
            as_json,
            lambda: print_csv(answer.result) if as_csv else show(answer.screen(), detail),
            None if as_csv else answer.folder,
            answer.files,
        )


def fit(
    path: Annotated[
        Path | None, typer.Argument(metavar="STUDY.toml", help="Study to fit; none for a table alone.")
    ] = None,
    data: Data = None,
    factor: Annotated[
        list[str] | None,
        valued("NAME", "Column of --data that is a factor, without STUDY; repeatable.", "all numbers but --response"),
    ] = None,
    response: Annotated[
        list[str] | None,
        valued("NAME", "Column of --data to be fitted, without STUDY; repeatable.", "all numbers but --factor"),
    ] = None,
    model: Annotated[
        str | None,
        valued("NAME", "linear, interaction, pure_quadratic, quadratic or reduced, without STUDY.", "quadratic"),
    ] = None,
    out: Out = None,
    force: Force = False,
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
        from doe.library.steps import fit

        with bars(quiet or as_json) as progress:
            effort = (workers, scheduler, retry, progress, notice(quiet))
            answer = fit(path, data, factor or (), response or (), model, out, *effort, force)
        detail = Detail.of(quiet, verbose)
        hand_over(answer.as_dict, as_json, lambda: show(answer.screen(), detail), answer.folder, answer.files)


Point = Annotated[
    str | None,
    valued(
        "A,B,...|NAME=A,...",
        "Also predict this point on the surfaces: factor values in order, or by name (the rest at the baseline).",
        "none",
    ),
]


def front(
    path: StudyPath,
    data: Data = None,
    out: Out = None,
    force: Force = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    point: Point = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also every point of the front.")] = False,
) -> None:
    """Find the Pareto front on the response surfaces."""
    with guarded(as_json), keeping_runs(out):
        from doe.library.steps import front

        with bars(quiet or as_json) as progress:
            answer = front(path, data, out, point, workers, scheduler, retry, progress, notice(quiet), force)
        detail = Detail.of(quiet, verbose)
        hand_over(answer.as_dict, as_json, lambda: show(answer.screen(), detail), answer.folder, answer.files)


def chain(
    path: Annotated[
        Path, typer.Argument(metavar="CHAIN.toml", help="Dimension chain to solve, or several in tables named chain.")
    ],
    out: Save = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Annotated[bool, flag("--quiet", "-q", says="Parts only.")] = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also yields by distribution, quantiles, classes.")] = False,
) -> None:
    """Solve dimension chains: limits, yield, contributions, allocation. A chain that misses its limits ends with exit code 1."""
    with guarded(as_json):
        from doe.library.steps import chain

        answer = chain(path, out, force)
        detail = Detail.of(quiet, verbose)
        hand_over(answer.as_dict, as_json, lambda: show(answer.screen(), detail), answer.folder, answer.files)
        several = "chains" in answer
        for name, status in answer.refused.items():
            print(f"{path}: {f'chain {name}: ' if several else ''}{status}", file=sys.stderr)
        if answer.refused:
            raise typer.Exit(FAILED)
