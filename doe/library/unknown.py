"""Unknown inputs of a scene: ``uncertainty`` and ``calibrate``, and their answers."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from numbers import Integral
from pathlib import Path
from typing import TYPE_CHECKING, Any

from doe.library.answer import Answer, Rows, optional_path, path_given, registered, texts_given
from doe.workflow.effort import Effort, Follow
from rbdyn.base.blocks import Block
from rbdyn.base.faults import LONGEST_NAME, no_power_of_two, one_line, refuse
from rbdyn.base.folder import output_folder
from rbdyn.base.words import Notice, counted, quantity, shown

if TYPE_CHECKING:
    from doe.workflow.identification import Calibration
    from doe.workflow.uncertainty import Uncertainty
    from rbdyn.base.table import Sheet


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
        sheets: dict[str, Sheet[Any]] = {
            "ranges": range_sheet(outputs),
            "shares": share_sheet(outputs),
            "inputs": input_sheet(self.uncertainty.inputs),
        }
        return {name: sheet.records for name, sheet in sheets.items()} | {"sets": set_rows(self.uncertainty)}

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
    from doe.report.identity import scene_identity
    from doe.report.sections.unknown import write_uncertainty
    from doe.running.runner import ANSWER
    from doe.workflow.status import content_digest, runs_digest
    from doe.workflow.uncertainty import find_uncertainty, uncertainty_stages
    from rbdyn.base.page import REPORT_FILES, write_with_report
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
            agenda.plan(uncertainty_stages(path, assignments, points), ("--points", *SHORTER), STEPS_S)
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

        sheets: dict[str, Sheet[Any]] = {
            "inputs": input_sheet(self.calibration),
            "outputs": output_sheet(self.calibration),
            "cells": measured_sheet(self.calibration),
        }
        return {name: sheet.records for name, sheet in sheets.items()}

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
    from doe.report.identity import scene_identity
    from doe.report.sections.calibration import FILES, RECORD, files_of, signed, stored, write
    from doe.running.runner import ANSWER
    from doe.workflow.calibration import calibration_stages, design_of, find_calibration, question_of, read_question
    from doe.workflow.identification import Cost
    from doe.workflow.status import content_digest

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
