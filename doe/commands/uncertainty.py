"""``doe uncertainty``."""

from pathlib import Path
from typing import Annotated

import typer

from doe.commands.options import Quiet, Retry, Scheduler
from doe.commands.steps import keeping_runs, noted_agenda, print_predicted, simulations_in
from rbdyn.base.blocks import Detail
from rbdyn.base.faults import refuse
from rbdyn.base.fields import no_power_of_two
from rbdyn.base.options import Json, Set, Workers, folder_option, valued
from rbdyn.base.render.terminal import show
from rbdyn.base.terminal import guarded, hand_over, output_folder


def uncertainty(
    path: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene of a roller bearing.")],
    points: Annotated[
        int | None, valued("N", "Input sets to start from, a power of two.", "128", min=16, max=512)
    ] = None,
    target: Annotated[str, typer.Option(metavar="SHARE", help="How well the ends of a range are to be known.")] = "10%",
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
    """List the unknown inputs of a scene, what they do to every output, and which input decides."""
    folder = out or Path(f"{path.stem}_uncertainty")
    with guarded(as_json), keeping_runs(folder, path):
        from doe.report.steps.uncertainty import blocks, record_of, write
        from doe.running.runner import ANSWER
        from doe.workflow.stages_unknown import uncertainty_stages
        from doe.workflow.status import content_digest, runs_digest
        from doe.workflow.uncertainty import find_uncertainty
        from rbdyn.dynamics.target import target_of

        refuse([] if points is None else no_power_of_two("--points ", points))
        accuracy = target_of(target)
        output_folder(folder, "doe", path)
        inputs, runs = content_digest(path), runs_digest(path, overrides or ())
        with noted_agenda(folder, "doe uncertainty", workers, quiet, inputs=inputs, asked=runs) as agenda:
            agenda.plan(uncertainty_stages(path, overrides or (), points))
            with simulations_in(folder, path, workers, scheduler, retry, quiet or as_json, agenda) as simulations:
                found = find_uncertainty(path, overrides or (), simulations, points, accuracy)
            agenda.enter(ANSWER)
            files = write(found, folder)
            agenda.finish(files)
        hand_over(lambda: record_of(found), as_json, lambda: show(blocks(found), Detail.of(quiet)), folder, files)
        print_predicted(agenda, as_json)
