"""Commands that simulate, from Python: the whole ``study``, ``uncertainty`` and ``calibrate``, and their answers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from doe.library.answer import Answer, Rows, optional_path, part_given, path_given, registered, texts_given
from doe.workflow.effort import Effort, Follow
from rbdyn.base.blocks import Block, Bullets, Paragraph, Section
from rbdyn.base.faults import LONGEST_NAME, no_power_of_two, one_line, refuse
from rbdyn.base.folder import output_folder
from rbdyn.base.words import Notice, counted, improvement, quantity, shown

if TYPE_CHECKING:
    from doe.report.summary import Summary
    from doe.workflow.identification import Calibration
    from doe.workflow.parts import Made
    from doe.workflow.tolerances import FactorTolerance
    from doe.workflow.uncertainty import Uncertainty


# Patterns of the names of all files of a study.
STUDY_FILES = (
    "report.html", "answer.txt", "summary.json", "tables.xlsx", "design_runs.csv", "anova.csv", "coefficients.csv",
    "runs.csv", "front.csv", "confirmation.csv", "part_dimensions.csv", "duty_points.csv", "unknown_inputs.csv", "decides.csv",
    "published_comparisons.csv", "surface_*.png", "pareto_front.png", "robust_front.png", "adaptive_search.png", "duty_gains.png",
    "cage_orbit.png", "pocket_forces.png",
)  # fmt: skip


@dataclass(frozen=True, repr=False, eq=False)
class StudyAnswer(Answer):
    """Selected clearances with their gains, limits and parts.

    Tables: "gains" (one row per response: baseline and pick, simulated), "pick" (one row per factor), "runs", "front", "confirmation"
    (all simulated points), "parts" (dimensions [mm]), and "quality", "anova", "coefficients" of the fits. Over a duty also
    "duty" (one row per response at each of its points).

    ``finished_before``: whether the answer was read from the folder, because nothing had changed since.
    """

    finished_before: bool = False
    shows_unmet: ClassVar[bool] = True

    @property
    def closing(self) -> list[str]:
        """The time that it took unless it was finished before, and its files."""
        files = ", ".join(self.files)
        if self.finished_before:
            return [f"Finished before, nothing has changed since: {self.folder} holds {files}"]
        cost = self.record["cost"]
        spent = f"{cost['total_s']:.1f} s, of which design runs {cost['design_s']:.1f} s"
        return [spent, f"written to {self.folder}: {files}"]

    @property
    def unmet(self) -> list[str]:
        """What keeps the study from its demands, such as a missed limit or chain."""
        return [*self.record["obstacles"]["sentences"]]

    @cached_property
    def summary(self) -> "Summary":
        """The record with its parts as attributes."""
        from doe.report.summary import Summary

        return Summary.from_dict(self.record)

    def blocks(self) -> list[Block]:
        from doe.report.files import blocks

        return blocks(self.summary)

    def sections(self) -> list[Section]:
        from doe.report.page import sections

        return sections(self.summary)

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.chain import allocation_sheet
        from doe.report.sections.duty import duty_figures
        from doe.report.sections.fit import fit_rows

        searched = self.summary.adaptive
        fits = fit_rows([*self.summary.fit.responses.values()])
        return {
            "gains": self._gains(),
            "pick": self._factors(),
            "runs": [
                {
                    "run": run.run,
                    "kind": run.kind,
                    **run.factors,
                    **{name: measured.value for name, measured in run.responses.items()},
                    **{f"{name}_error": measured.error for name, measured in run.responses.items()},
                }
                for run in self.summary.design.points
            ],
            "front": [point.row for point in (searched or self.summary.front).front],
            "confirmation": [
                {"point": name, **point.factors, "response": response, **value.as_dict()}
                for name, point in self.summary.confirmation.items()
                for response, value in point.responses.items()
            ],
            "parts": allocation_sheet(self.summary.chains).records,
            **{name: fits[name] for name in ("quality", "anova", "coefficients")},
            **({"duty": duty_figures(self.summary).records} if self.summary.duty else {}),
        }

    def _gains(self) -> Rows:
        gains, points, rows = self.summary.gains, self.summary.confirmation, []
        for name, pick in points["pick"].responses.items():
            gain = gains.get(name)
            rows.append(
                {
                    "response": name,
                    "baseline": points["baseline"].responses[name].value,
                    "pick": pick.value,
                    "gain_percent": None if gain is None else gain.percent,
                    "gain_error_percent": None if gain is None else gain.error_percent,
                    "verdict": None if gain is None else gain.verdict,
                }
            )
        return rows

    def _factors(self) -> Rows:
        baseline = self.summary.confirmation["baseline"].factors
        widths: dict[str, FactorTolerance | Made] = {**(self.summary.tolerances or {}), **self.summary.made}
        return [
            {
                "factor": name,
                "baseline": baseline.get(name),
                "pick": value,
                "half_width": widths[name].half_width if name in widths else None,
            }
            for name, value in self.summary.pick.items()
        ]

    def brief(self) -> str:
        from doe.report.summary import LIMITS

        changes = [
            f"{quantity(name)[0]} {improvement(gain.percent, gain.error_percent, gain.goal)}"
            for name, gain in self.summary.gains.items()
        ]
        judged = self.summary.confirmation["pick"].every_limit
        limits = [f"{limit.bound_words} {LIMITS[limit.verdict]}" for limit in judged]
        return ", ".join([*changes, *limits])


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class PartAnswer(Answer):
    """Design runs of a part of a study, which a call without ``part`` takes over. Table: "failures"."""

    words: str = ""

    @property
    def unmet(self) -> list[str]:
        """How many runs failed."""
        runs, failed = self.record["runs"], len(self.record["failures"])
        return [f"{failed} of {counted(runs, 'run')} failed in {self.words}"] if failed else []

    def blocks(self) -> list[Block]:
        done = self.record["runs"] - len(self.record["failures"])
        gathers = "the same command without --part gathers all parts and answers"
        causes = [f"{failure['label']}: {failure['cause']}" for failure in self.record["failures"]]
        return [
            Paragraph(f"{self.words}: {done} of {counted(self.record['runs'], 'design run')} done; {gathers}"),
            Bullets(causes),
        ]

    @property
    def closing(self) -> list[str]:
        """Where its store is."""
        return [f"kept in {self.folder}"]

    def rows(self) -> Mapping[str, Rows]:
        return {"failures": self.record["failures"]}

    def brief(self) -> str:
        return f"{self.words}, {counted(self.record['runs'], 'design run')}"


def study(
    path: Path | str,
    out: Path | str | None = None,
    part: str | None = None,
    adaptive: bool = False,
    robust: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> StudyAnswer | PartAnswer:
    """The whole study of a bearing's clearances, as ``doe study``: design, runs, surfaces, front, pick, tolerances, parts.

    - ``path``: STUDY.toml; ``out``: folder of the report and the store of runs, by default STUDY_results in the current one.
      A finished answer and finished runs are found there, so an interrupted study goes on where it stopped
    - ``part``: "K/N" makes only every N-th design run from the K-th, in a store of its own in ``out``; a call without it takes
      all parts over
    - ``adaptive``: also search the front in few runs, chosen by emulators; the pick is then on it
    - ``robust``: judge the pick over the unknown inputs of the scene; the table robust of a study asks for it too
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed runs
    - ``progress(stage, done, total)``: called as runs end; ``notice(sentence)``: called with the number of runs, with their time,
      and with what no run can change
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    A broken limit is in ``answer["status"]`` and ``answer["limits"]``. Raises InputError with all faults of the
    study, RunError where too many runs fail.
    """
    from doe.running.runner import gather, refuse_other_parts
    from doe.workflow.problem import Problem
    from doe.workflow.status import finished_record, inputs_digest

    path = path_given(path, "path")
    folder = optional_path(out, "out") or Path(f"{path.stem}_results")
    effort, share = Effort(workers, scheduler, retry, progress, notice), part_given(part)
    if share is not None:
        return _part(path, folder, share, effort, force)
    with output_folder(folder, "doe", STUDY_FILES, force=force) as output, registered(path, folder):
        loaded = Problem.load(path)
        digest = inputs_digest(loaded, adaptive, robust)
        if not retry and (record := finished_record(folder, digest)):
            return StudyAnswer(record, folder, tuple(record["files"]), finished_before=True)
        refuse_other_parts(folder, inputs_digest(loaded))
        output.claim(path)
        gather(folder)
        from doe.report.files import write
        from doe.workflow.whole import run_study, unmet_chains

        if notice is not None:
            for sentence in unmet_chains(loaded):
                notice(sentence)
        options = {"adaptive": adaptive, "robust": robust}
        with effort.agenda(folder, "doe study", options, digest) as agenda:
            outcome = run_study(loaded, folder, effort, **options, agenda=agenda)
            record = output.write(partial(write, outcome), last="summary.json")
            agenda.finish(record["files"])
    return StudyAnswer(record, folder, tuple(record["files"]))


def _part(path: Path, target: Path, share: tuple[int, int], effort: Effort, force: bool) -> PartAnswer:
    """The design runs of a part. Raises as ``study``."""
    from doe.running import runner, store
    from doe.workflow import problem, status, whole

    folder = runner.part_folder(target, share)
    with output_folder(folder, "doe", (), force=force) as output, registered(path, folder):
        loaded = problem.Problem.load(path)
        digest = status.inputs_digest(loaded)
        runner.refuse_other_parts(target, digest)
        output.claim(path)
        with effort.agenda(folder, "doe study", inputs=digest) as agenda:
            results = whole.run_part(loaded, folder, effort, share, agenda)
            agenda.finish([])
    failures = [
        {"label": result.label, "cause": result.cause} for result in results if isinstance(result, store.Failure)
    ]
    record = {"status": "failed" if failures else "ok", "part": list(share), "runs": len(results), "failures": failures}
    return PartAnswer(record, folder, (), words=f"part {share[0]} of {share[1]}")


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class UncertaintyAnswer(Answer):
    """Ranges of a scene's outputs over its unknown inputs. Tables: "ranges", "shares" (of the variance), "inputs", "sets".

    ``uncertainty``: input sets with their runs, in the units of the scene.
    """

    uncertainty: "Uncertainty"

    def blocks(self) -> list[Block]:
        from doe.report.sections.unknown import uncertainty_blocks

        return uncertainty_blocks(self.uncertainty)

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.unknown import input_sheet, range_sheet, set_rows, share_sheet

        outputs = self.uncertainty.responses.values()
        return {
            "ranges": range_sheet(outputs).records,
            "shares": share_sheet(outputs).records,
            "inputs": input_sheet(self.uncertainty.inputs).records,
            "sets": set_rows(self.uncertainty),
        }

    def brief(self) -> str:
        ranges = []
        for name, output in self.uncertainty.responses.items():
            words, unit = quantity(name)
            ranges.append(f"{words} {shown(output.input.low, 3)} to {shown(output.input.high, 3)} {unit}".rstrip())
        return f"{', '.join(ranges)} in 90 % of the cases; {counted(self.uncertainty.runs, 'input set')}"


def uncertainty(
    path: Path | str,
    points: int | None = None,
    target: float | str = 0.1,
    overrides: Sequence[str] = (),
    out: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    figures: Sequence[str] = (),
    force: bool = False,
) -> UncertaintyAnswer:
    """Range of every output of a scene over its unknown inputs, and the share of each input, as ``doe uncertainty``.

    - ``path``: SCENE.toml of a roller bearing; ``overrides`` of its keys, such as ``["cage.mass_g=50"]``
    - ``points``: input sets to begin with, a power of two from 16 to 512; by default those of the scene
    - ``target``: standard error of the ends of a range, as a fraction of its width, such as 0.1 or "10%"
    - ``out``: folder of the files and the store of runs, by default SCENE_uncertainty; finished runs are found there
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed runs
    - ``progress(stage, done, total)``: called as runs end; ``notice(sentence)``: called with the number of runs, then with their time
    - ``figures``: further outputs, such as ``["outer_max_pressure_MPa"]``
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    Raises InputError with all faults of scene or arguments, RunError where too many runs fail.
    """
    from doe.report.sections.unknown import write_uncertainty
    from doe.running.runner import ANSWER
    from doe.workflow.status import content_digest, runs_digest, scene_identity
    from doe.workflow.uncertainty import find_uncertainty, uncertainty_stages
    from rbdyn.base.html import REPORT_FILES, write_with_report
    from rbdyn.dynamics.target import target_of, valid_target

    path, assignments = path_given(path, "path"), texts_given(overrides, "overrides", '["cage.mass_g=50"]')
    folder = optional_path(out, "out") or Path(f"{path.stem}_uncertainty")
    effort = Effort(workers, scheduler, retry, progress, notice)
    outputs = texts_given(figures, "figures", '["outer_max_pressure_MPa"]')
    refuse(_points_faults(points))
    points = None if points is None else int(points)
    accuracy = target_of(target) if isinstance(target, str) else valid_target(target)
    names = (*UNCERTAINTY_FILES, *REPORT_FILES)
    with output_folder(folder, "doe", names, force=force) as output, registered(path, folder):
        inputs, runs = content_digest(path), runs_digest(path, assignments)
        output.claim(path)
        with effort.agenda(folder, "doe uncertainty", inputs=inputs, question=runs) as agenda:
            agenda.plan(
                uncertainty_stages(path, assignments, points),
                ("--points", *SHORTER, "the accuracy of --target"),
                STEPS_S,
            )
            with effort.simulations(folder, path, agenda) as simulations:
                result = find_uncertainty(path, assignments, simulations, points, accuracy, outputs)
            agenda.enter(ANSWER)
            identity = scene_identity("doe uncertainty", path, assignments)
            answer = UncertaintyAnswer(result.as_dict(), folder, (), identity=identity, uncertainty=result)
            files = write_with_report(output, identity, answer.blocks, partial(write_uncertainty, result))
            agenda.finish(files)
    return replace(answer, files=tuple(files))


# What makes the runs of a scene shorter, and the typical time [s] of what is no run.
SHORTER, STEPS_S = ("numerics.turns", "numerics.replicates"), 5.0
UNCERTAINTY_FILES = ("uncertainty.json", "input_sets.csv", "ranges.csv", "shares.csv", "uncertainty.png")
FEWEST_SETS, MOST_SETS = 16, 512


def _points_faults(points: Any) -> list[str]:
    """Faults of the number of input sets."""
    if points is None:
        return []
    if isinstance(points, bool) or not isinstance(points, Integral) or not FEWEST_SETS <= int(points) <= MOST_SETS:
        value = one_line(repr(points), LONGEST_NAME)
        return [f"points = {value}: must be a power of two from {FEWEST_SETS} to {MOST_SETS}"]
    return no_power_of_two("--points ", int(points))


@dataclass(frozen=True, repr=False, eq=False, kw_only=True)
class CalibrationAnswer(Answer):
    """What measurements on a rig say about the unknown inputs. Tables: "inputs", "outputs", "cells" (measured, predicted)."""

    calibration: "Calibration"

    def blocks(self) -> list[Block]:
        from doe.report.sections.calibration import blocks

        return blocks(self.calibration)

    def rows(self) -> Mapping[str, Rows]:
        from doe.report.sections.calibration import input_sheet, measured_sheet, output_sheet

        return {
            "inputs": input_sheet(self.calibration).records,
            "outputs": output_sheet(self.calibration).records,
            "cells": measured_sheet(self.calibration).records,
        }

    def brief(self) -> str:
        from doe.report.sections.calibration import verdict_words

        words = one_line(verdict_words(self.calibration), 4 * LONGEST_NAME)
        return f"{words}, {counted(self.calibration.runs, 'run')}"


def calibrate(
    path: Path | str,
    data: Path | str,
    free: Sequence[str] = (),
    overrides: Sequence[str] = (),
    out: Path | str | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    retry: bool = False,
    progress: Follow = None,
    notice: Notice = None,
    force: bool = False,
) -> CalibrationAnswer:
    """Unknown inputs of a scene from measurements on a rig, and whether it may be called calibrated, as ``doe calibrate``.

    - ``path``: SCENE.toml of a roller bearing; ``overrides`` of its keys, such as ``["cage.mass_g=50"]``
    - ``data``: RIG.csv, a row for each condition: scene keys, outputs in the units of their names, their ``_sd``
    - ``free``: keys to identify, by default all unknown inputs
    - ``out``: folder of the files and the store of runs, by default SCENE_calibration; a finished answer is read from there
    - ``workers``: threads, all processors by default; ``scheduler``: address of a dask cluster; ``retry``: repeat failed runs
      and the answer
    - ``progress(stage, done, total)``: called as runs end; ``notice(sentence)``: called with the number of runs, then with their time
    - ``force``: also write over files in ``out`` that no command of ``doe`` made

    Raises InputError with all faults of scene, table or arguments, RunError where too many runs fail.
    """
    from doe.report.sections.calibration import FILES, RECORD, files_of, signed, stored, write
    from doe.running.runner import ANSWER
    from doe.workflow.calibration import calibration_stages, design_of, find_calibration, question_of, read_question
    from doe.workflow.identification import Cost
    from doe.workflow.status import content_digest, scene_identity

    path, table = path_given(path, "path"), path_given(data, "data")
    folder, example = optional_path(out, "out") or Path(f"{path.stem}_calibration"), '["cage.mass_g"]'
    free, assignments = texts_given(free, "free", example), texts_given(overrides, "overrides", example)
    effort = Effort(workers, scheduler, retry, progress, notice)
    with output_folder(folder, "doe", FILES, force=force) as output, registered(path, folder):
        question = read_question(path, table, free, assignments)
        identity, scene = question_of(question), scene_identity("doe calibrate", path, assignments, table)
        if not retry and (result := stored(folder, identity)) is not None:
            return CalibrationAnswer(
                result.as_dict(), folder, tuple(files_of(result)), identity=scene, calibration=result
            )
        output.claim(path)
        inputs = content_digest(path)
        with effort.agenda(folder, "doe calibrate", inputs=inputs, question=identity) as agenda:
            agenda.plan(calibration_stages(question), ("the conditions of the table", *SHORTER), STEPS_S)
            if notice is not None and (doubt := design_of(question).doubt):
                notice(doubt)
            with effort.simulations(folder, path, agenda) as simulations:
                result = find_calibration(question, simulations)
                turns, took_s = simulations.turns, agenda.elapsed_s
            agenda.enter(ANSWER)
            result = signed(replace(result, cost=Cost(result.runs, turns, took_s)))
            output.write(lambda stage: write(result, stage, scene), last=RECORD)
            agenda.finish(files_of(result))
    return CalibrationAnswer(result.as_dict(), folder, tuple(files_of(result)), identity=scene, calibration=result)
