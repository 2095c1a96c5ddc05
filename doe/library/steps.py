"""One step of a study alone: ``design``, ``fit``, ``front`` and ``chain``, and their answers."""

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from doe.library.answer import Answer, Rows, optional_path, path_given, registered, saved, step_folder, texts_given
from doe.workflow.effort import Effort, Follow
from rbdyn.base.blocks import Block, Paragraph, with_notes
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line, refuse
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import plain
from rbdyn.base.words import Notice, counted, quantity, with_error

if TYPE_CHECKING:
    from doe.dimension_chain import ChainResult
    from doe.response_surface.statistics import Fit
    from doe.workflow.design import DesignResult
    from doe.workflow.front_record import SurfaceFront
    from doe.workflow.problem import Asked, Problem


@dataclass(frozen=True, repr=False, eq=False)
class DesignAnswer(Answer):
    """The runs of a design and its quality. Tables: "runs" (actual values in the units of the factors), "coded", "terms"."""

    result: "DesignResult" = field(kw_only=True)

    def blocks(self) -> list[Block]:
        from doe.report.sections.design import design_blocks

        return with_notes(self.result.notes or (), design_blocks(self.result), judged=False)

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.design import coded_sheet, power_sheet

        runs, marks = self.result.runs, ("run", "standard", "kind", "block", "seed")
        return {
            "runs": [{**{key: getattr(run, key) for key in marks}, **run.factors} for run in runs],
            "coded": coded_sheet(self.result.factors, runs).records,
            "terms": power_sheet(self.result.evaluation).records,
        }

    def print_csv(self) -> None:
        """Print the runs as CSV."""
        from doe.report.sections.design import print_csv

        print_csv(self.result)

    def brief(self) -> str:
        runs, factors = counted(len(self.result.runs), "run"), ", ".join(self.result.factors)
        return f"{self.result.kind.replace('_', ' ')}, {runs} of {factors}"


def design(path: Path | str, out: Path | str | None = None, force: bool = False) -> DesignAnswer:
    """Design of a study, as ``doe design``: every run, and how well the runs identify the terms of the models.

    - ``path``: STUDY.toml; where its scene is missing only the design itself is checked
    - ``out``: folder for design.json; by default nothing is written
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    Raises InputError with all faults of the study.
    """
    from doe.report.sections.design import design_sheet
    from doe.workflow import problem, region, status, whole
    from doe.workflow.design import DesignResult

    path, folder = path_given(path, "path"), optional_path(out, "out")
    with step_folder(folder, "design", ("design",), force) as output:
        study = problem.Problem.load(path)
        # Without a scene the runs are made elsewhere, and only the design itself is checked.
        notes: Notes = ()
        if study.file.scene and study.path_of(study.scene.file).exists():
            with Effort().folder(folder) as store:
                study, notes = region.region_that_runs(study, store, Effort())
            whole.check_study(study)
        output.claim(path)
        result = DesignResult.of(study, study.design, notes)
        identity = status.study_identity("doe design", study)
        answer = DesignAnswer(result.as_dict(), folder, identity=identity, result=result)
        sheet = design_sheet(study.factors, result.runs)
        return replace(answer, files=saved(output, "design.json", answer, lambda: {sheet.file: sheet.records}))


@dataclass(frozen=True, repr=False, eq=False)
class FitAnswer(Answer):
    """Response surfaces. Tables: "quality" (a row a response), "anova", "coefficients" (in coded units), "runs" (residuals).

    ``fits``: of each response; ``factors``: names in the order of the letters of the terms; ``columns``: those of a table
    fitted without a study.
    """

    fits: "Sequence[Fit]" = ()
    factors: tuple[str, ...] = ()
    columns: str = ""

    def blocks(self) -> list[Block]:
        from doe.report.sections.fit import fit_blocks
        from doe.report.summary import readable

        fits = readable(fit_blocks(self.fits, self.factors))
        return with_notes(self.record.get("notes", ()), [Paragraph(self.columns), *fits], judged=False)

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.fit import fit_rows

        return fit_rows(self.fits)

    def brief(self) -> str:
        return ", ".join(f"{quantity(fit.name)[0]} {fit.model} R² {fit.r2:.3f}" for fit in self.fits)


def fit(
    path: Path | str | None = None,
    data: Path | str | None = None,
    factors: Sequence[str] = (),
    responses: Sequence[str] = (),
    model: str | None = None,
    out: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> FitAnswer:
    """Response surfaces with their analysis of variance, as ``doe fit``.

    - ``path``: STUDY.toml; None for a table alone
    - ``data``: table of runs made elsewhere; without it the runs of the study are simulated
    - ``factors``, ``responses``: columns of a table alone; ``model``: linear, interaction, pure_quadratic, quadratic (default)
      or reduced
    - ``out``: folder for the files and the store of runs; by default nothing is written
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed runs
    - ``progress(stage, done, total)``: called as runs end; ``notice(sentence)``: called with the number of runs before they start
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    Raises InputError with all faults of study, table or arguments, RunError where runs fail.
    """
    from doe.report.sections.fit import fit_files
    from doe.response_surface.statistics import fits_of
    from doe.workflow.status import study_identity
    from doe.workflow.surfaces import unrivalled, with_rivals

    table, folder, study_path = optional_path(data, "data"), optional_path(out, "out"), optional_path(path, "path")
    with step_folder(folder, "fit", ("anova", "coefficients", "runs"), force) as output, ExitStack() as stack:
        study, notes = _study_or_table(study_path, table, factors, responses, model)
        output.claim(study.path, *_read_later(study, table))
        stack.enter_context(registered(study.path, folder))
        study, reading = _surfaces(study, table, folder, Effort(workers, scheduler, retry, progress, notice))
        surfaces = with_rivals(study.surfaces)
        notes = (*reading, *notes, *unrivalled(surfaces))
        record = fits_of(surfaces).as_dict() | ({"notes": plain(notes)} if notes else {})
        columns = (
            f"{table}: factors {', '.join(study.factors)}; responses {', '.join(study.responses)}; coded -1 and +1 are the ends "
            "of a factor's range"
        )
        answer = FitAnswer(
            record,
            folder,
            fits=surfaces,
            factors=tuple(study.factors),
            columns=columns if path is None else "",
            identity=study_identity("doe fit", study, table),
        )
        return replace(answer, files=saved(output, "fit.json", answer, partial(fit_files, surfaces)))


def _study_or_table(
    path: Path | None, data: Path | None, factors: Any, responses: Any, model: str | None
) -> "tuple[Problem, Notes]":
    """The study of the file, or else that of the table with the options that name its columns; and notes.

    Raises InputError.
    """
    from doe.study_file.study import study_of_table
    from doe.workflow.problem import Problem

    factors = texts_given(factors, "factors", '["pocket_clearance_mm"]')
    responses = texts_given(responses, "responses", '["impact_force_N"]')
    if path is not None:
        options = {"factor": factors, "response": responses, "model": model}
        refuse(
            f"--{option}: {path} states it; leave out one or the other" for option, value in options.items() if value
        )
        return Problem.load(path), ()
    if data is None:
        raise InputError(
            "fit: nothing to fit; give STUDY.toml, or --data TABLE.csv with --factor NAME or --response NAME"
        )
    study, notes = study_of_table(data, factors, responses, model or "quadratic")
    return Problem(study.path, study.file), notes


def _read_later(study: "Problem", data: Path | None) -> list[Path]:
    """Files that a step reads only as it runs: those that its study names, and the table of runs."""
    from doe.workflow.status import named_files
    from rbdyn.base.tables.sheet import split_path

    named = [] if study.file.scene is None else named_files(study)
    return [split_path(path)[0] for path in (*named, *([] if data is None else [data]))]


def _surfaces(study: "Problem", data: Path | None, out: Path | None, effort: Effort) -> "tuple[Problem, Notes]":
    """The study with its region and its surfaces, of a table or of simulated runs, and notes on both.

    Raises InputError, RunError, KeyboardInterrupt.
    """
    from doe.workflow.region import region_that_runs
    from doe.workflow.runs import run_design, with_remaining
    from doe.workflow.surfaces import fit_surfaces, shared_runs

    if data is not None:
        study, runs = shared_runs(study, data, study.responses, "missing-column", "left out")
        return study.with_surfaces(fit_surfaces(study, runs)), runs.notes
    with effort.folder(out) as folder:
        study, notes = region_that_runs(study, folder, effort)
        if effort.notice is not None:
            effort.notice(f"{counted(len(study.design.coded), 'design run')}, {effort.threads} at once")
        with effort.simulations(folder, study.path) as simulations:
            runs = run_design(study, simulations, simulations.progress("design runs"))
        return with_remaining(study, runs).with_surfaces(fit_surfaces(study, runs)), notes


@dataclass(frozen=True, repr=False, eq=False)
class FrontAnswer(Answer):
    """The Pareto front on the surfaces. Tables: "front" (a row a point, factors and responses), "picks", "gains" of the pick.

    ``asked``: factors and responses of the study.
    """

    result: "SurfaceFront" = field(kw_only=True)
    asked: "Asked" = field(kw_only=True)

    def blocks(self) -> list[Block]:
        from doe.report.sections.front import front_blocks
        from doe.report.summary import readable

        return with_notes(self.result.notes or (), readable(front_blocks(self.asked, self.result), self.asked))

    def rows(self) -> Mapping[str, Rows]:
        picks = {"baseline": self.result.baseline, **self.result.picks}
        gains = self.result.predicted_gains
        return {
            "front": [point.row for point in self.result.front],
            "picks": [{"point": name, **point.row} for name, point in picks.items()],
            "gains": [{"response": name, **gain.as_dict()} for name, gain in gains.items()],
        }

    def brief(self) -> str:
        gains = self.result.predicted_gains.items()
        texts = [f"{quantity(name)[0]} {with_error(gain.percent, gain.error_percent)} %" for name, gain in gains]
        return f"{counted(len(self.result.front), 'point')}; predicted gains of the selected design {', '.join(texts)}"


def front(
    path: Path | str,
    data: Path | str | None = None,
    out: Path | str | None = None,
    point: Mapping[str, float] | Sequence[float] | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> FrontAnswer:
    """Pareto front on the response surfaces of a study, as ``doe front``.

    - ``path``: STUDY.toml; ``data``: table of runs made elsewhere, without which the runs are simulated
    - ``out``: folder for front.json and the store of runs; by default nothing is written
    - ``point``: also predict this point: values by factor (the rest at the baseline), or all of them in order, in the units
      of the factors
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed runs
    - ``progress(stage, done, total)``: called as runs end; ``notice(sentence)``: called with the number of runs before they start
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    Raises InputError with all faults of study, table or point, RunError where runs fail.
    """
    import numpy as np

    from doe.report.sections.front import front_sheet
    from doe.workflow.front import check_goals, find_front, out_of_reach, tolerances_out_of_reach, with_survival
    from doe.workflow.front_record import StatedPoint, SurfaceFront
    from doe.workflow.problem import Asked, Problem
    from doe.workflow.status import study_identity
    from doe.workflow.surfaces import extrapolation_notes

    path = path_given(path, "path")
    table, folder = optional_path(data, "data"), optional_path(out, "out")
    with step_folder(folder, "front", ("front",), force) as output, registered(path, folder):
        study = Problem.load(path)
        check_goals(study)
        values = None if point is None else _point(study, _point_text(point))
        output.claim(path, *_read_later(study, table))
        study, reading = _surfaces(study, table, folder, Effort(workers, scheduler, retry, progress, notice))
        pareto = with_survival(study, find_front(study))
        if pareto.violations is not None:
            raise out_of_reach(study, pareto.points[0], pareto.violations)
        if pareto.tolerance_violations is not None:
            reading = (*reading, Note("tolerances", tolerances_out_of_reach(study, pareto.tolerance_violations)))
        extrapolated = extrapolation_notes(study.surfaces, study.coded(pareto.points[pareto.pick]))
        notes = [*extrapolated, *reading]
        stated = None if values is None else StatedPoint.at(study, pareto, np.array(values))
        result = replace(SurfaceFront.of(study, pareto), notes=notes or None, point=stated)
        identity, asked = study_identity("doe front", study, table), Asked.of(study)
        answer = FrontAnswer(result.as_dict(), folder, result=result, asked=asked, identity=identity)
        sheet = front_sheet(study.factors, study.responses, result.front)
        return replace(answer, files=saved(output, "front.json", answer, lambda: {sheet.file: sheet.records}))


def _point_text(point: Any) -> str:
    """The text of ``--point`` for values by factor, or in the order of the factors. Raises InputError for anything else."""
    if isinstance(point, str):
        return point
    if isinstance(point, Mapping):
        return ",".join(f"{name}={value}" for name, value in point.items())
    if hasattr(point, "__iter__"):
        return ",".join(map(str, point))
    shown = one_line(repr(point), LONGEST_NAME)
    raise InputError(f"point = {shown}: must be values by factor, such as {{'pocket_clearance_mm': 0.3}}, or a list")


def _point(study: "Problem", text: str) -> list[float]:
    """Factor values of ``--point``. Raises InputError with every fault."""
    from collections import Counter
    from math import nan

    from doe.study_file.table import RUN
    from rbdyn.base.tables.sheet import is_number

    values = study.by_factor(study.baseline)
    parts = [part.strip() for part in text.split(",")]
    by_name = any("=" in part for part in parts)
    if not by_name and len(parts) != len(study.factors):
        raise InputError(f"--point {text}: give a value for each factor ({', '.join(study.factors)}), or name=value")
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


@dataclass(frozen=True, repr=False, eq=False)
class ChainAnswer(Answer):
    """Solved dimension chains. Tables: "parts" (dimensions with tolerances [mm]), "contributions" [%], "closing" [mm].

    ``chains``: the solution of each chain by its name; ``refused``: status of the chains that miss their limits, by name.
    """

    chains: Mapping[str, "ChainResult"] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)
    path: Path | None = None

    @property
    def unmet(self) -> list[str]:
        """Why chains miss their limits."""
        several = "chains" in self.record
        return [f"{self.path}: {f'chain {name}: ' if several else ''}{why}" for name, why in self.refused.items()]

    def blocks(self) -> list[Block]:
        from doe.report.sections.chain import chain_blocks

        return [block for name, chain in self.chains.items() for block in chain_blocks(name, chain)]

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.chain import allocation_sheet, closing_sheet, share_sheet

        return {
            "parts": allocation_sheet(self.chains).records,
            "contributions": share_sheet(self.chains).records,
            "closing": closing_sheet(self.chains).records,
        }

    def brief(self) -> str:
        return "; ".join(f"{name}: {chain.status}" for name, chain in self.chains.items())


def chain(path: Path | str, out: Path | str | None = None, force: bool = False) -> ChainAnswer:
    """Solution of a dimension chain, or of several, as ``doe chain``: limits, yield, contributions, tolerances of the parts.

    - ``path``: CHAIN.toml with one chain, or with several in tables named chain; sizes in mm
    - ``out``: folder for chain.json; by default nothing is written
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    A chain that misses its limits is listed in ``refused`` of the answer. Raises InputError with the faults of every chain.
    """
    from doe.dimension_chain import is_several, read_chains, solve
    from doe.report.sections.chain import chains_record, part_sheet, share_sheet
    from rbdyn.base.identity import identity_of

    path, folder = path_given(path, "path"), optional_path(out, "out")
    with step_folder(folder, "chain", ("part_dimensions", "contributions"), force) as output:
        several = is_several(path)
        chains = read_chains(path)
        output.claim(path)
        results, faults = {}, []
        for name, chain_table in chains.items():
            try:
                results[name] = solve(chain_table, source=f'{path}: chain "{name}"' if several else str(path))
            except InputError as error:
                faults += error.faults
        refuse(faults)
        record = chains_record(results) if several else next(iter(results.values())).as_dict()
        refused = {name: result.status for name, result in results.items() if result.refused}
        identity = identity_of("doe chain", {}, [path])
        answer = ChainAnswer(record, folder, chains=results, refused=refused, path=path, identity=identity)
        tables = {sheet.file: sheet.records for sheet in (part_sheet(results), share_sheet(results))}
        return replace(answer, files=saved(output, "chain.json", answer, lambda: tables))
