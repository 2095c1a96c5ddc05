"""``doe fit``."""

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from doe.commands.options import Data, Out, Quiet, Retry, Scheduler
from doe.commands.steps import Effort, fitted, keeping_runs, save
from rbdyn.base.blocks import Block, Detail, Note, Paragraph
from rbdyn.base.faults import InputError, refuse
from rbdyn.base.options import Json, Workers, flag, valued
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import guarded, hand_over

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
        from doe.report.steps.fit import fit_record, fit_tables
        from doe.workflow.surfaces import unrivalled, with_rivals

        surfaces = fitted(loaded, data, Effort(out, workers, scheduler, retry, quiet or as_json))
        surfaces = with_rivals(surfaces)
        remarks = [*notes, *unrivalled(surfaces)]
        record = fit_record(surfaces) | ({"notes": remarks} if remarks else {})
        save(out, loaded.path, "fit.json", record)
        if out is not None:
            from rbdyn.base.records import save_table

            for name, rows in fit_tables(surfaces).items():
                save_table(rows, out / name)
        hand_over(lambda: record, as_json, lambda: show(_answer(record, loaded, data, path), Detail.of(quiet, verbose)))


def _answer(record: dict[str, Any], study: "Study", data: Path | None, path: Path | None) -> list[Block]:
    """What a table was taken for without a study, notes, and the fits."""
    from doe.report.sections.contents import readable
    from doe.report.sections.fits import fit_blocks
    from doe.report.sections.record import known

    taken = (
        (
            f"{data}: factors {', '.join(study.factors)}; responses {', '.join(study.responses)}; coded -1 and +1 are "
            "the ends of a factor's range"
        )
        if path is None
        else ""
    )
    remarks = [Note(remark, Detail.LEAST) for remark in record.get("notes", ())]
    fits = [
        block
        for name, fitted in known(record["responses"]).items()
        for block in fit_blocks(name, fitted, study.factors)
    ]
    return [Paragraph(taken), *remarks, *readable(fits, {})]


def _study(path: Path | None, data: Path | None, named: Mapping[str, Any]) -> "tuple[Study, tuple[str, ...]]":
    """The study of the file; without one, of the table and what the command names of it, with notes. Raises InputError."""
    from doe.study_file import Study
    from doe.study_file.study import study_of_table

    if path is not None:
        refuse(f"--{option}: {path} says it; leave out one or the other" for option, given in named.items() if given)
        return Study.load(path), ()
    if data is None:
        raise InputError(
            ["fit: nothing to fit; give STUDY.toml, or --data TABLE.csv with --factor NAME or --response NAME"]
        )
    return study_of_table(data, named["factor"] or [], named["response"] or [], named["model"] or "quadratic")
