"""The command ``rbdyn ball``. Physics is imported inside it, so that help comes at once."""

import sys
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any

from rbdyn.base.command import Console, Delivery, SceneFile, Set, alarm, result_command, valued
from rbdyn.base.faults import InputError
from rbdyn.base.html import REPORT_FILES
from rbdyn.base.identity import identity_of
from rbdyn.base.notes import status_notes
from rbdyn.base.words import all_of
from rbdyn.scene import BallScene, Scene, balls_only

if TYPE_CHECKING:
    from rbdyn.quasistatic.result import BallResult


# Names of the files of an equilibrium, of its studies and of all pictures, in the order of their list.
STUDIES = ("sweep", "preload", "clearance", "wear", "race_limits")
FILES = (
    "result.json", "start.csv", "start.png", "balls.csv", *(f"{name}.{kind}" for name in STUDIES for kind in ("json", "csv")),
    "loads.png", "angles.png", "section.png", "pressure_and_life.png", "stiffness.png", "azimuth.png", "map.png", "runout.csv",
    *REPORT_FILES,
)  # fmt: skip

VALUES = "start:stop:count or a,b,c"


def study_option(metavar: str, help: str) -> Any:
    """An option that asks for a study instead of the equilibrium."""
    return valued(metavar, help, "equilibrium only")


@result_command(
    "rbdyn ball",
    FILES,
    "Write JSON, tables and pictures to this folder.",
    "Add the stiffness matrix and cost.",
    ("sweep.part",),
)
def ball(
    console: Console,
    scene: SceneFile,
    assignments: Set = None,
    sweeps: Annotated[
        list[str] | None,
        valued("KEY=VALUES", f"Vary a number of the scene, {VALUES}; repeatable for a grid.", "one point", "--sweep"),
    ] = None,
    preload: Annotated[str | None, study_option("N", f"Stress and life over axial preload, {VALUES}.")] = None,
    clearance: Annotated[str | None, study_option("UM", f"Stress and life over diametral clearance, {VALUES}.")] = None,
    wear: Annotated[str | None, study_option("UM", f"Stress and life over ball wear (diameter), {VALUES}.")] = None,
    race_limits: Annotated[
        str | None, study_option("CLASS", "Raceway errors with which bearings meet class P2, P4 or P5.")
    ] = None,
    target_yield: Annotated[
        float | None, valued("SHARE", "Share of bearings that must meet --race-limits.", "0.95", "--yield")
    ] = None,
    seed: Annotated[
        int | None, valued("N", "Seed of form errors, or of --race-limits.", "errors.seed; 1 for --race-limits", min=0)
    ] = None,
) -> Delivery:
    """Calculate the equilibrium of a ball bearing: contact angles, loads, stiffness, stress, life."""
    loaded = balls_only(Scene.load(scene, assignments or []))
    if seed is not None and race_limits is None:
        loaded = _seeded(loaded, seed)
    studies = {"preload": preload, "clearance": clearance, "wear": wear, "race_limits": race_limits}
    requested = _requested(sweeps, target_yield, studies)
    from rbdyn.cli import ball_studies

    if sweeps:
        return ball_studies.run_sweep(console, loaded, sweeps, scene)
    for name, value in requested.items():
        share, draw = 0.95 if target_yield is None else target_yield, 1 if seed is None else seed
        return ball_studies.run(console, loaded, name, value, share, draw, scene)
    console.folder.claim(scene)
    from rbdyn.quasistatic.bearing import equilibrium

    result, path = ball_studies.with_runout(loaded, equilibrium(loaded))
    return Delivery(
        identity_of("rbdyn ball", result.scene, [scene]),
        result.as_dict,
        partial(ball_studies.equilibrium_blocks, result),
        partial(ball_studies.write_equilibrium, result, path),
        not result.is_equilibrium,
        lambda: _print_failure(result, console.as_json),
    )


def _print_failure(result: "BallResult", as_json: bool) -> None:
    if not result.is_equilibrium:
        subject = "no equilibrium" if result.thermal is None else "temperatures"
        alarm(status_notes(result.status) if as_json else ())
        if not as_json:
            print(f"{subject}: {result.status}", file=sys.stderr)


def _requested(sweeps: list[str] | None, target_yield: float | None, studies: dict[str, str | None]) -> dict[str, str]:
    """The study asked for, with its values. Raises InputError for two, and for a yield of none."""
    requested = {name: value for name, value in studies.items() if value is not None}
    flags = [f"--{name.replace('_', '-')}" for name in (*(["sweep"] if sweeps else []), *requested)]
    if len(flags) > 1:
        raise InputError(f"{all_of(flags)}: are studies of their own; choose one")
    if target_yield is not None and studies["race_limits"] is None:
        raise InputError(f"--yield {target_yield:g}: is a share of --race-limits; add that or leave it out")
    return requested


def _seeded(scene: BallScene, seed: int) -> BallScene:
    """The scene with other draws of its form errors. Raises InputError where there are none."""
    if scene.errors is None:
        raise InputError(
            f"--seed {seed}: no random numbers are used here; it is for the table errors and --race-limits"
        )
    return scene.changed({"errors.seed": seed})
