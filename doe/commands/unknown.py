"""Unknown inputs of a scene: ``doe uncertainty`` and ``doe calibrate``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from doe.commands.options import Quiet, Retry, Scheduler, bars, keeping_runs
from rbdyn.base.blocks import Detail
from rbdyn.base.command import Force, Json, Set, Workers, folder_option, guarded, hand_over, notice, valued
from rbdyn.base.terminal import show

if TYPE_CHECKING:
    from doe.library.answer import Answer


def uncertainty(
    path: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene of a roller bearing.")],
    points: Annotated[
        int | None, valued("N", "Input sets to begin with, a power of two.", "128", min=16, max=512)
    ] = None,
    target: Annotated[
        str, typer.Option(metavar="SHARE", help="Standard error of the ends of a range, as a share of its width.")
    ] = "10%",
    figure: Annotated[
        list[str] | None,
        valued(
            "NAME",
            "A further output, such as land_film_power_W or outer_max_pressure_MPa; repeatable.",
            "impact, whirl, loss, cage speed, temperatures",
            "--figure",
        ),
    ] = None,
    overrides: Set = None,
    out: Annotated[
        Path | None, folder_option("Folder of results and of the store of finished runs.", "SCENE_uncertainty")
    ] = None,
    force: Force = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """List the unknown inputs of a scene, the range of every output over them, and the share of each input."""
    folder = out or Path(f"{path.stem}_uncertainty")
    with guarded(as_json), keeping_runs(folder):
        from doe.library.unknown import uncertainty
        from rbdyn.dynamics.target import target_of

        with bars(quiet or as_json) as progress:
            answer = uncertainty(
                path,
                points,
                target_of(target),
                overrides or (),
                folder,
                workers,
                scheduler,
                retry,
                progress,
                notice(quiet),
                figure or (),
                force,
            )
        _hand_over(answer, as_json, quiet)


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
    force: Force = False,
    workers: Workers = None,
    scheduler: Scheduler = None,
    retry: Retry = False,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Identify the unknown inputs of a scene from measurements on a rig, and state whether it may be called calibrated."""
    folder = out or Path(f"{path.stem}_calibration")
    with guarded(as_json), keeping_runs(folder):
        from doe.library.unknown import calibrate

        with bars(quiet or as_json) as progress:
            answer = calibrate(
                path,
                data,
                free or (),
                overrides or (),
                folder,
                workers,
                scheduler,
                retry,
                progress,
                notice(quiet),
                force,
            )
        _hand_over(answer, as_json, quiet)


def _hand_over(answer: "Answer", as_json: bool, quiet: bool) -> None:
    """Print the answer with the names of its files."""
    detail = Detail.of(quiet)
    hand_over(answer.as_dict, as_json, lambda: show(answer.screen(), detail), answer.folder, answer.files)
