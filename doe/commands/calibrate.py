"""``doe calibrate``."""

from pathlib import Path
from typing import Annotated

import typer

from doe.commands.options import Quiet, Retry, Scheduler
from doe.commands.steps import keeping_runs, noted_agenda, print_predicted, simulations_in
from rbdyn.base.blocks import Detail
from rbdyn.base.options import Json, Set, Workers, folder_option, valued
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import guarded, hand_over, output_folder


def calibrate(
    path: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene of a roller bearing.")],
    data: Annotated[
        Path, typer.Option(metavar="RIG.csv", help="Measurements, a row a condition: scene keys, outputs, their _sd.")
    ],
    free: Annotated[
        list[str] | None, valued("KEY", "Key to be found; repeatable.", "all that is unknown", "--free")
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
        from doe.report.steps.calibrate import blocks, files_of, record_of, stored, write
        from doe.running.runner import ANSWER
        from doe.workflow.calibration import find_calibration, question_of, read_question
        from doe.workflow.stages_unknown import calibration_stages
        from doe.workflow.status import content_digest

        asked = read_question(path, data, free or (), overrides or ())
        made_of = question_of(asked)
        output_folder(folder, "doe", path)
        record, noted = None if retry else stored(folder, made_of), None
        if record is None:
            inputs = content_digest(path)
            with noted_agenda(folder, "doe calibrate", workers, quiet, inputs=inputs, asked=made_of) as agenda:
                agenda.plan(calibration_stages(asked))
                with simulations_in(folder, path, workers, scheduler, retry, quiet or as_json, agenda) as simulations:
                    found = find_calibration(asked, simulations)
                agenda.enter(ANSWER)
                record = record_of(found, made_of)
                write(found, record, folder)
                agenda.finish(files_of(record))
                noted = agenda
        known = record
        hand_over(lambda: known, as_json, lambda: show(blocks(known), Detail.of(quiet)), folder, files_of(known))
        print_predicted(noted, as_json)
