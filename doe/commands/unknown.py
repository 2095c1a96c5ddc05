"""Unknown inputs of a scene: ``doe uncertainty`` and ``doe calibrate``."""

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from doe.commands.options import Quiet, Retry, Scheduler, keeping_runs, noted_agenda, print_predicted, simulations_in
from rbdyn.base.blocks import Detail
from rbdyn.base.command import Json, Set, Workers, folder_option, guarded, hand_over, output_folder, valued
from rbdyn.base.faults import no_power_of_two, refuse
from rbdyn.base.identity import identity_line
from rbdyn.base.page import write_with_report
from rbdyn.base.terminal import show


def uncertainty(
    path: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene of a roller bearing.")],
    points: Annotated[
        int | None, valued("N", "Input sets to begin with, a power of two.", "128", min=16, max=512)
    ] = None,
    target: Annotated[
        str, typer.Option(metavar="SHARE", help="Standard error of the ends of a range, as a share of its width.")
    ] = "10%",
    overrides: Set = None,
    out: Annotated[
        Path | None, folder_option("Folder of results and of the store of finished runs.", "SCENE_uncertainty")
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """List the unknown inputs of a scene, the range of every output over them, and the share of each input."""
    folder = out or Path(f"{path.stem}_uncertainty")
    with guarded(as_json), keeping_runs(folder, path):
        from doe.report.identity import scene_identity
        from doe.report.sections.unknown import uncertainty_blocks, uncertainty_record, write_uncertainty
        from doe.running.runner import ANSWER
        from doe.workflow.status import content_digest, runs_digest
        from doe.workflow.uncertainty import find_uncertainty, uncertainty_stages
        from rbdyn.dynamics.target import target_of

        refuse([] if points is None else no_power_of_two("--points ", points))
        accuracy = target_of(target)
        output_folder(folder, "doe", path)
        inputs, runs = content_digest(path), runs_digest(path, overrides or ())
        with noted_agenda(folder, "doe uncertainty", workers, quiet, inputs=inputs, question=runs) as agenda:
            agenda.plan(uncertainty_stages(path, overrides or (), points))
            with simulations_in(folder, path, workers, scheduler, retry, quiet or as_json, agenda) as simulations:
                result = find_uncertainty(path, overrides or (), simulations, points, accuracy)
            agenda.enter(ANSWER)
            answer = partial(uncertainty_blocks, result)
            identity = scene_identity("doe uncertainty", path, overrides or ())
            files = write_with_report(folder, identity, answer, partial(write_uncertainty, result, folder))
            agenda.finish(files)
        hand_over(
            lambda: uncertainty_record(result),
            as_json,
            lambda: show([identity_line(identity), *answer()], Detail.of(quiet)),
            folder,
            files,
        )
        print_predicted(agenda, as_json)


def calibrate(
    path: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene of a roller bearing.")],
    data: Annotated[
        Path,
        typer.Option(metavar="RIG.csv", help="Measurements, a row for each condition: scene keys, outputs, their _sd."),
    ],
    free: Annotated[
        list[str] | None, valued("KEY", "Key to identify; repeatable.", "all unknown inputs", "--free")
    ] = None,
    overrides: Set = None,
    out: Annotated[
        Path | None, folder_option("Folder of results and of the store of finished runs.", "SCENE_calibration")
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Identify the unknown inputs of a scene from measurements on a rig, and state whether it may be called calibrated."""
    folder = out or Path(f"{path.stem}_calibration")
    with guarded(as_json), keeping_runs(folder, path):
        from doe.report.identity import scene_identity
        from doe.report.sections.calibration import blocks, files_of, record_of, stored, write
        from doe.running.runner import ANSWER
        from doe.workflow.calibration import calibration_stages, find_calibration, question_of, read_question
        from doe.workflow.status import content_digest

        question = read_question(path, data, free or (), overrides or ())
        identity = question_of(question)
        scene = scene_identity("doe calibrate", path, overrides or (), data)
        output_folder(folder, "doe", path)
        record, noted = None if retry else stored(folder, identity), None
        if record is None:
            inputs = content_digest(path)
            with noted_agenda(folder, "doe calibrate", workers, quiet, inputs=inputs, question=identity) as agenda:
                agenda.plan(calibration_stages(question))
                with simulations_in(folder, path, workers, scheduler, retry, quiet or as_json, agenda) as simulations:
                    result = find_calibration(question, simulations)
                agenda.enter(ANSWER)
                record = record_of(result, identity)
                write_with_report(folder, scene, partial(blocks, record), partial(write, result, record, folder))
                agenda.finish(files_of(record))
                noted = agenda
        finished_record = record
        hand_over(
            lambda: finished_record,
            as_json,
            lambda: show([identity_line(scene), *blocks(finished_record)], Detail.of(quiet)),
            folder,
            files_of(finished_record),
        )
        print_predicted(noted, as_json)
