"""The command ``rbdyn ball``. Physics is imported inside it, so that help comes at once."""

import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.base.blocks import Detail
from rbdyn.base.command import (
    FAILED,
    Force,
    Json,
    Quiet,
    SceneFile,
    Set,
    alarm,
    deliver,
    folder_option,
    guarded,
    notice,
    valued,
    verbose_flag,
)
from rbdyn.base.faults import InputError
from rbdyn.base.folder import output_folder
from rbdyn.base.identity import identity_of
from rbdyn.base.notes import status_notes
from rbdyn.base.page import REPORT_FILES

if TYPE_CHECKING:
    from rbdyn.scene import BallScene

# Names of the files of an equilibrium, of a sweep, of the other studies and of all pictures; and what a sweep keeps.
EQUILIBRIUM_FILES, SWEEP_FILES = ("result.json", "balls.csv", "runout.csv"), ("sweep.json", "sweep.csv")
STUDY_FILES = tuple(
    f"{name}.{kind}" for name in ("preload", "clearance", "wear", "race_limits") for kind in ("json", "csv")
)
PICTURES = (
    "loads.png", "angles.png", "section.png", "pressure_and_life.png", "stiffness.png", "azimuth.png", "map.png",
)  # fmt: skip
FILES, KEPT = (*EQUILIBRIUM_FILES, *SWEEP_FILES, *STUDY_FILES, *PICTURES, *REPORT_FILES), ("sweep.part",)

VALUES, UNASKED = "start:stop:count or a,b,c", "the equilibrium alone"


def study_option(metavar: str, says: str) -> Any:
    """An option that asks for a study instead of the equilibrium."""
    return valued(metavar, f"{says}, instead.", UNASKED)


def ball(
    scene: SceneFile,
    assignments: Set = None,
    sweeps: Annotated[
        list[str] | None,
        valued("KEY=VALUES", f"Sweep a number of the scene, {VALUES}; repeatable for a grid.", "one point", "--sweep"),
    ] = None,
    preload: Annotated[str | None, study_option("N", f"Stress and life over axial preload, {VALUES}")] = None,
    clearance: Annotated[str | None, study_option("UM", "The same over the diametral clearance")] = None,
    wear: Annotated[str | None, study_option("UM", "The same over the diameter that balls lose")] = None,
    race_limits: Annotated[
        str | None, study_option("CLASS", "Race errors with which bearings meet P2, P4 or P5")
    ] = None,
    target_yield: Annotated[
        float | None, valued("SHARE", "Share of bearings that must meet --race-limits.", "0.95", "--yield")
    ] = None,
    seed: Annotated[
        int | None,
        valued("N", "Seed of form errors, or of the lot of --race-limits.", "errors.seed; of the lot 1", min=0),
    ] = None,
    out: Annotated[Path | None, folder_option("Write the result as JSON here, with its tables and pictures.")] = None,
    force: Force = False,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, verbose_flag("Also the stiffness matrix and cost.")] = False,
) -> None:
    """Find the equilibrium of a ball bearing: contact angles, loads, stiffness, stress, life."""
    with guarded(as_json), output_folder(out, "rbdyn ball", FILES, KEPT if sweeps else (), force) as folder:
        from rbdyn.scene import Scene, balls_only

        loaded = balls_only(Scene.load(scene, assignments or []))
        notice(quiet)
        if seed is not None and race_limits is None:
            loaded = _seeded(loaded, seed)
        studies = {"preload": preload, "clearance": clearance, "wear": wear, "race_limits": race_limits}
        requested = _requested(sweeps, target_yield, studies)
        if sweeps:
            from rbdyn.cli.ball_studies import run_sweep

            raise typer.Exit(run_sweep(loaded, sweeps, folder, scene, as_json, quiet))
        for name, value in requested.items():
            from rbdyn.cli.ball_studies import run as run_study

            share = 0.95 if target_yield is None else target_yield
            draw = 1 if seed is None else seed
            raise typer.Exit(run_study(loaded, name, value, share, draw, folder, scene, as_json, quiet))
        folder.claim(scene)
        from rbdyn.cli.ball_output import blocks, with_runout, write
        from rbdyn.quasistatic.bearing import equilibrium

        result, path = with_runout(loaded, equilibrium(loaded))
        identity = identity_of("rbdyn ball", result.scene, [scene])
        answer, files = partial(blocks, result), partial(write, result, path)
        deliver(folder, identity, result.as_dict, answer, files, as_json, Detail.of(quiet, verbose))
    if not result.is_equilibrium:
        if as_json:
            alarm(status_notes(result.status))
        else:
            subject = "no equilibrium" if result.thermal is None else "temperatures"
            print(f"{subject}: {result.status}", file=sys.stderr)
        raise typer.Exit(FAILED)


def _requested(sweeps: list[str] | None, target_yield: float | None, studies: dict[str, str | None]) -> dict[str, str]:
    """The study asked for, with its values. Raises InputError for two, and for a yield of none."""
    requested = {name: value for name, value in studies.items() if value is not None}
    flags = [f"--{name.replace('_', '-')}" for name in (*(["sweep"] if sweeps else []), *requested)]
    if len(flags) > 1:
        raise InputError([f"{' and '.join(flags)}: are studies of their own; choose one"])
    if target_yield is not None and studies["race_limits"] is None:
        raise InputError([f"--yield {target_yield:g}: is a share of --race-limits; add that or leave it out"])
    return requested


def _seeded(scene: "BallScene", seed: int) -> "BallScene":
    """The scene with other draws of its form errors. Raises InputError where there are none."""
    if scene.errors is None:
        raise InputError(
            [f"--seed {seed}: no random numbers are used here; it is for the table errors and --race-limits"]
        )
    return scene.changed({"errors.seed": seed})
