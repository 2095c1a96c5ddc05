"""One step of a study alone: ``doe design``, ``doe fit``, ``doe front`` and ``doe chain``."""

import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from doe.commands.options import Data, Effort, Out, Quiet, Retry, Save, Scheduler, StudyPath, fitted, keeping_runs, save
from rbdyn.base.blocks import Block, Detail, Note, Paragraph
from rbdyn.base.command import BAD_INPUT, Json, Workers, flag, guarded, hand_over, valued
from rbdyn.base.faults import InputError, refuse
from rbdyn.base.terminal import show

if TYPE_CHECKING:
    from doe.study_file import Study
    from rbdyn.base.identity import Identity


def design(
    path: StudyPath,
    out: Save = None,
    as_json: Json = False,
    as_csv: Annotated[bool, flag("--csv", says="Print a CSV table and nothing else.")] = False,
    quiet: Annotated[bool, flag("--quiet", "-q", says="Actual values only.")] = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also seeds and leverages.")] = False,
) -> None:
    """Print the design: every run, and how well the runs identify the terms of the models."""
    with guarded(as_json):
        from doe.report.identity import study_identity
        from doe.report.sections.design import design_blocks, design_record, design_tables, print_csv
        from doe.study_file import Study
        from doe.workflow.runs import design_of, evaluation
        from doe.workflow.whole import check_study

        loaded = Study.load(path)
        # Without a scene the runs are made elsewhere, and only the design itself is checked.
        if loaded.file.scene and loaded.path_of(loaded.scene.file).exists():
            check_study(loaded)
        points = design_of(loaded)
        record = design_record(loaded, points, evaluation(loaded, points))
        tables, answer = partial(design_tables, record), partial(design_blocks, record)
        files = save(out, path, "design.json", record, tables, partial(study_identity, "doe design", loaded), answer)
        detail = Detail.of(quiet, verbose)
        hand_over(
            lambda: record,
            as_json,
            lambda: print_csv(record) if as_csv else show(answer(), detail),
            None if as_csv else out,
            files,
        )


def _show(identity: "Callable[[], Identity]", answer: Callable[[], Sequence[Block]], detail: Detail) -> None:
    """Print the bearing, or else the input files, with point and date, then the answer."""
    from rbdyn.base.identity import identity_line

    show([identity_line(identity(), Detail.USUAL), *answer()], detail)


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
    with guarded(as_json), ExitStack() as contexts:
        loaded, notes = _study_or_table(path, data, {"factor": factor, "response": response, "model": model})
        contexts.enter_context(keeping_runs(out, loaded.path))
        from doe.report.identity import study_identity
        from doe.report.sections.fit import fit_record, fit_tables
        from doe.workflow.surfaces import unrivalled, with_rivals

        surfaces = fitted(loaded, data, Effort(out, workers, scheduler, retry, quiet or as_json))
        surfaces = with_rivals(surfaces)
        remarks = [*notes, *unrivalled(surfaces)]
        record = fit_record(surfaces) | ({"notes": remarks} if remarks else {})
        answer, identity = (
            partial(_fit_answer, record, loaded, data, path),
            partial(study_identity, "doe fit", loaded, data),
        )
        files = save(out, loaded.path, "fit.json", record, partial(fit_tables, surfaces), identity, answer)
        hand_over(lambda: record, as_json, lambda: _show(identity, answer, Detail.of(quiet, verbose)), out, files)


def _fit_answer(record: dict[str, Any], study: "Study", data: Path | None, path: Path | None) -> list[Block]:
    """The factors and responses of a table without a study, notes, and the fits."""
    from doe.report.sections.fit import fit_blocks
    from doe.report.sections.record import drop_undefined, readable

    columns = (
        f"{data}: factors {', '.join(study.factors)}; responses {', '.join(study.responses)}; coded -1 and +1 are the ends of "
        "a factor's range"
    )
    remarks = [Note(remark, Detail.LEAST) for remark in record.get("notes", ())]
    fits = [
        block
        for name, fitted in drop_undefined(record["responses"]).items()
        for block in fit_blocks(name, fitted, study.factors)
    ]
    return [Paragraph(columns if path is None else ""), *remarks, *readable(fits, {})]


def _study_or_table(
    path: Path | None, data: Path | None, options: Mapping[str, Any]
) -> "tuple[Study, tuple[str, ...]]":
    """The study of the file, or else that of the table with the options that name its columns; and notes.

    Raises InputError.
    """
    from doe.study_file import Study
    from doe.study_file.study import study_of_table

    if path is not None:
        refuse(
            f"--{option}: {path} states it; leave out one or the other" for option, value in options.items() if value
        )
        return Study.load(path), ()
    if data is None:
        raise InputError(
            ["fit: nothing to fit; give STUDY.toml, or --data TABLE.csv with --factor NAME or --response NAME"]
        )
    return study_of_table(data, options["factor"] or [], options["response"] or [], options["model"] or "quadratic")


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
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    point: Point = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also every point of the front.")] = False,
) -> None:
    """Find the Pareto front on the response surfaces."""
    with guarded(as_json), keeping_runs(out, path):
        from doe.report.identity import study_identity
        from doe.report.sections.answer import asked_record
        from doe.report.sections.front import front_record, front_tables, given_point_record
        from doe.study_file import Study
        from doe.workflow.front import check_goals, find_front, with_survival

        loaded = Study.load(path)
        check_goals(loaded)
        values = None if point is None else _point(loaded, point)
        effort = Effort(out, workers, scheduler, retry, quiet or as_json)
        surfaces = fitted(loaded, data, effort)
        pareto = with_survival(loaded, surfaces, find_front(loaded, surfaces))
        record = front_record(loaded, surfaces, pareto)
        if values is not None:
            import numpy as np

            record["point"] = given_point_record(loaded, surfaces, pareto, np.array(values))
        answer = partial(_front_answer, {"asked": asked_record(loaded), "front": record})
        identity = partial(study_identity, "doe front", loaded, data)
        files = save(out, path, "front.json", record, partial(front_tables, record), identity, answer)
        hand_over(lambda: record, as_json, lambda: _show(identity, answer, Detail.of(quiet, verbose)), out, files)


def _front_answer(summary: dict[str, Any]) -> list[Block]:
    """The front's section of a report; ``asked`` holds its factors and responses, ``front`` its record."""
    from doe.report.sections.front import front_blocks
    from doe.report.sections.record import drop_undefined, readable

    clean = drop_undefined(summary)
    return readable(front_blocks(clean), clean)


def _point(study: "Study", text: str) -> list[float]:
    """Factor values of ``--point``. Raises InputError with every fault."""
    from collections import Counter
    from math import nan

    from doe.study_file.table import RUN, is_number

    values = study.by_factor(study.baseline)
    parts = [part.strip() for part in text.split(",")]
    by_name = any("=" in part for part in parts)
    if not by_name and len(parts) != len(study.factors):
        raise InputError([f"--point {text}: give a value for each factor ({', '.join(study.factors)}), or name=value"])
    pairs = [part.partition("=")[::2] for part in parts] if by_name else list(zip(study.factors, parts, strict=True))
    stripped = [(name.strip(), number.strip()) for name, number in pairs]
    counts = Counter(name for name, _ in stripped)
    faults = [f"--point {name}: given {count} times; give it once" for name, count in counts.items() if count > 1]
    for name, number in stripped:
        if name not in values:
            faults.append(f"--point {name}: no such factor; name one of {', '.join(values)}")
            continue
        value = float(number) if is_number(number) else nan
        if RUN.contains(value):
            values[name] = value
        else:
            faults.append(f"--point {name} = {number}: {RUN.fault(value)}")
    refuse(faults)
    return list(values.values())


def chain(
    path: Annotated[
        Path, typer.Argument(metavar="CHAIN.toml", help="Dimension chain to solve, or several in tables named chain.")
    ],
    out: Save = None,
    as_json: Json = False,
    quiet: Annotated[bool, flag("--quiet", "-q", says="Parts only.")] = False,
    verbose: Annotated[bool, flag("--verbose", "-v", says="Also yields by distribution, quantiles, classes.")] = False,
) -> None:
    """Solve dimension chains: limits, yield, contributions, allocation. A chain that misses its limits is refused."""
    with guarded(as_json):
        from doe.dimension_chain import is_several, read_chains, solve
        from doe.report.sections.chain import chain_blocks, chain_tables, chains_record
        from rbdyn.base.identity import identity_of

        several = is_several(path)
        results, faults = {}, []
        for name, chain_table in read_chains(path).items():
            try:
                results[name] = solve(chain_table, source=f'{path}: chain "{name}"' if several else str(path))
            except InputError as error:
                faults += error.faults
        refuse(faults)
        record = chains_record(results) if several else next(iter(results.values())).as_dict()

        def answer() -> list[Block]:
            return [block for name, result in results.items() for block in chain_blocks(name, result.as_dict())]

        identity = partial(identity_of, "doe chain", {}, [path])
        files = save(out, path, "chain.json", record, partial(chain_tables, results), identity, answer)
        hand_over(lambda: record, as_json, lambda: _show(identity, answer, Detail.of(quiet, verbose)), out, files)
        refused = {name: result.status for name, result in results.items() if result.refused}
        for name, status in refused.items():
            print(f"{path}: {f'chain {name}: ' if several else ''}{status}", file=sys.stderr)
        if refused:
            raise typer.Exit(BAD_INPUT)
