"""The command ``rbdyn ball``. Physics is imported inside it, so that help comes at once."""

from pathlib import Path
from typing import Annotated

import typer

from rbdyn.cli.options import Json, Quiet, SceneFile, Set, folder_option, verbose_flag
from rbdyn.cli.terminal import FAILED, guarded, hand_over, output_folder
from rbdyn.faults import InputError

STUDY = "the equilibrium alone"


def ball(
    scene: SceneFile,
    assignments: Set = None,
    sweeps: Annotated[
        list[str] | None,
        typer.Option(
            "--sweep",
            metavar="KEY=VALUES",
            help="Sweep a number of the scene, start:stop:count or a,b,c; repeatable for a grid.",
            show_default="one point",
        ),
    ] = None,
    preload: Annotated[
        str | None,
        typer.Option(
            metavar="N",
            help="Stress and life over axial preload, start:stop:count or a,b,c, instead.",
            show_default=STUDY,
        ),
    ] = None,
    clearance: Annotated[
        str | None,
        typer.Option(metavar="UM", help="The same over the diametral clearance, instead.", show_default=STUDY),
    ] = None,
    wear: Annotated[
        str | None,
        typer.Option(metavar="UM", help="The same over the diameter that balls lose, instead.", show_default=STUDY),
    ] = None,
    race_limits: Annotated[
        str | None,
        typer.Option(
            metavar="CLASS", help="Race errors with which bearings meet P2, P4 or P5, instead.", show_default=STUDY
        ),
    ] = None,
    wanted: Annotated[
        float | None,
        typer.Option("--yield", help="Share of bearings that must meet --race-limits.", show_default="0.95"),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            metavar="N",
            help="Seed of [errors], or of the lot of --race-limits.",
            show_default="errors.seed of the scene; of the lot 1",
        ),
    ] = None,
    out: Annotated[Path | None, folder_option("Write the result as JSON here, with its tables and pictures.")] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, verbose_flag("Also the stiffness matrix and cost.")] = False,
) -> None:
    """Find the equilibrium of a ball bearing: contact angles, loads, stiffness, stress, life."""
    with guarded(as_json):
        from rbdyn.scene import Scene, balls_only

        loaded = balls_only(Scene.load(scene, assignments or []))
        if seed is not None and race_limits is None:
            if loaded.errors is None:
                raise InputError([f"--seed {seed}: nothing is drawn here; it is for [errors] and --race-limits"])
            loaded = loaded.changed({"errors.seed": seed})
        studies = {"preload": preload, "clearance": clearance, "wear": wear, "race_limits": race_limits}
        requested = {name: value for name, value in studies.items() if value is not None}
        flags = [f"--{name.replace('_', '-')}" for name in (*(["sweep"] if sweeps else []), *requested)]
        if len(flags) > 1:
            raise InputError([f"{' and '.join(flags)}: are studies of their own; choose one"])
        if wanted is not None and race_limits is None:
            raise InputError([f"--yield {wanted:g}: is a share of --race-limits; add that or leave it out"])
        if sweeps:
            from rbdyn.cli.ball_sweep import run as run_sweep

            raise typer.Exit(run_sweep(loaded, sweeps, out, scene, as_json, quiet))
        for name, value in requested.items():
            from rbdyn.cli.ball_studies import run as run_study

            share = 0.95 if wanted is None else wanted
            draw = 1 if seed is None else seed
            raise typer.Exit(run_study(loaded, name, value, share, draw, out, scene, as_json, quiet))
        folder = output_folder(out, "rbdyn ball", scene) if out else None
        from rbdyn.cli.ball_output import print_result, with_runout, write
        from rbdyn.quasistatic.bearing import equilibrium

        result, path = with_runout(loaded, equilibrium(loaded))
        files = write(result, folder, path) if folder else []
        hand_over(result.as_dict, as_json, lambda: print_result(result, quiet, verbose), folder, files)
    if not result.found:
        raise typer.Exit(FAILED)
