"""``doe fit``."""

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from doe.commands.options import Data, Out, Quiet, Retry, Scheduler
from doe.commands.steps import Effort, fitted, keeping_runs, save
from rbdyn.cli.options import Json, Workers, flag, valued
from rbdyn.cli.terminal import guarded, hand_over
from rbdyn.faults import InputError, refuse

if TYPE_CHECKING:
    from doe.study_file import Study


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
    with guarded(as_json), ExitStack() as kept:
        loaded, notes = _study(path, data, {"factor": factor, "response": response, "model": model})
        kept.enter_context(keeping_runs(out, loaded.path))
        from doe.report.steps.fit import fit_record, fit_tables, print_fit
        from doe.study.surfaces import unrivalled, with_rivals

        surfaces = fitted(loaded, data, Effort(out, workers, scheduler, retry, quiet or as_json))
        surfaces = with_rivals(surfaces)
        remarks = [*notes, *unrivalled(surfaces)]
        record = fit_record(surfaces) | ({"notes": remarks} if remarks else {})
        save(out, loaded.path, "fit.json", record)
        if out is not None:
            from rbdyn.records.cells import save_table

            for name, rows in fit_tables(surfaces).items():
                save_table(rows, out / name)
        if path is None and not as_json:
            named = f"factors {', '.join(loaded.factors)}; responses {', '.join(loaded.responses)}"
            print(f"{data}: {named}; coded -1 and +1 are the ends of a factor's range")
        for remark in [] if as_json else remarks:
            print(f"note: {remark}")
        hand_over(lambda: record, as_json, lambda: print_fit(surfaces, quiet, verbose, loaded.factors))


def _study(path: Path | None, data: Path | None, named: Mapping[str, Any]) -> "tuple[Study, tuple[str, ...]]":
    """The study of the file; without one, of the table and what the command names of it, with notes. Raises InputError."""
    from doe.study_file import Study
    from doe.study_file.of_table import study_of_table

    if path is not None:
        refuse(f"--{option}: {path} says it; leave out one or the other" for option, given in named.items() if given)
        return Study.load(path), ()
    if data is None:
        mend = "give STUDY.toml, or --data TABLE.csv with --factor NAME or --response NAME"
        raise InputError([f"fit: nothing to fit; {mend}"])
    return study_of_table(data, named["factor"] or [], named["response"] or [], named["model"] or "quadratic")
