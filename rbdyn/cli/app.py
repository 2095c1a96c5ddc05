"""The command ``rbdyn``: simulate, map, accuracy and show; other modules have ``ball``, ``new``, ``keys`` and ``manual``."""

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.base import command
from rbdyn.base.blocks import Block, Detail, Paragraph, Table, with_notes
from rbdyn.base.command import Console, Delivery, result_command
from rbdyn.base.faults import InputError, assignment_faults, axis_values, key_path, refuse
from rbdyn.base.folder import output_folder
from rbdyn.base.html import REPORT_FILES
from rbdyn.base.identity import identity_of
from rbdyn.base.terminal import show as show_blocks
from rbdyn.base.words import counted, label
from rbdyn.cli.ball import ball
from rbdyn.cli.compare import compare
from rbdyn.cli.manual import describe_keys, manual
from rbdyn.cli.new import new
from rbdyn.scene import Scene, rollers_only
from rbdyn.scene.duty import AXES

if TYPE_CHECKING:
    from rbdyn.cli.simulation_output import MapDuty
    from rbdyn.dynamics.slip_map import SlipMap

# Names of the files of each command in the order of their list, besides those of ``REPORT_FILES``; a map also keeps its finished points.
SIMULATION_FILES = (
    "result.json",
    "figures.csv",
    "bearing.rexs",
    "history.csv",
    "roller_loads.png",
    "cage_orbit.png",
    "pocket_forces.png",
    "stiffness.png",
    "start.csv",
    "start.png",
)
DUTY_FILES = ("duty.json", "points.csv")
MAP_FILES, MAP_POINTS = ("map.json", "map.csv", "duty.csv", "map.png"), "map_points.jsonl"
STIFFNESS_FILES = ("stiffness.json", "stiffness.csv", "stiffness.png")
ACCURACY_FILES = tuple(
    f"{name}.{kind}"
    for kind in ("json", "csv", "png")
    for name in ("accuracy", "trajectory", "methods", "coverage", "options", "stability", "solvers")
)
SHOW_FILES = (
    "orbit.json", "history.csv", "cage_orbit.png", "forces.png", "whirl.png", "poincare.png", "spectra.png", "roller_loads.png",
    "sliding.png", "power.png", "bearing.html", "bearing.mp4", "bearing.gif",
)  # fmt: skip

app = command.Program()


@app.callback()
def main(version: command.Version = False) -> None:
    """Dynamics of rolling bearings: forces, whirl and power loss with their errors."""


@result_command(
    "rbdyn simulate",
    (*SIMULATION_FILES, *DUTY_FILES, *REPORT_FILES),
    "Write result.json, history.csv and pictures to this folder.",
    "Add power terms and cost.",
)
def simulate(
    console: Console,
    scene: command.SceneFile,
    assignments: command.Set = None,
    turns: command.Turns = None,
    replicates: command.Replicates = None,
    seed: command.Seed = None,
    workers: command.Workers = None,
    target: Annotated[
        str | None,
        command.valued(
            "2%",
            "Choose tolerance, turns and replicates for this relative error of impact force, whirl ratio and power loss.",
            "as given",
        ),
    ] = None,
    duty: Annotated[
        Path | None,
        command.valued(
            "FILE", "Simulate a duty cycle: CSV with name, share or hours, and keys; or TOML.", "one point", "--duty"
        ),
    ] = None,
) -> Delivery:
    """Simulate a cylindrical roller bearing at one point or over a duty cycle: impact force, whirl deviation ratio, power loss."""
    loaded = _rollers(scene, assignments, turns=turns, replicates=replicates, seed=seed)
    aim = None if target is None else _aim(target, turns, replicates)
    if duty is not None:
        return _over_duty(console, loaded, (scene, duty), aim, workers)
    console.folder.claim(scene)
    from rbdyn.dynamics.ensemble import plan_of, threads_of
    from rbdyn.dynamics.simulate import simulate as run_scene

    if (say := console.notice) is not None:
        # A slip of a unit can make the run take hours, so it is said before.
        for sentence in (*loaded.unit_notes, *[plan_of(loaded, threads_of(workers))] * (aim is None)):
            say(sentence)
    with console.progress("simulating") as progress:
        result = run_scene(loaded, workers, progress, target=aim, notice=say)
    from rbdyn.cli import simulation_output
    from rbdyn.scene.thermal import simulated_scene

    failed = result.status != "ok"
    return Delivery(
        identity_of("rbdyn simulate", result.scene, [scene]),
        result.as_dict,
        partial(simulation_output.blocks, result, console.folder.path),
        partial(simulation_output.write, simulated_scene(result), result),
        failed,
        lambda: command.alarm(result.notes if failed and not console.as_json else ()),
    )


def _over_duty(
    console: Console, scene: Scene, files: tuple[Path, Path], aim: float | None, workers: int | None
) -> Delivery:
    """Simulate every point of a duty, of the ``files`` of scene and duty. Raises InputError before anything runs."""
    from rbdyn.scene.duty import duty_scenes, read_duty

    points = read_duty(files[1])
    duty_scenes(scene, points, str(files[1]))
    console.folder.claim(*files)
    from rbdyn.cli.simulation_output import simulated_blocks, write_simulated
    from rbdyn.dynamics.duty_simulation import simulate_duty

    with console.progress("simulating") as progress:
        found = simulate_duty(scene, points, workers, progress, aim, console.notice)
    places = zip(*((point.inner_speed_rpm, point.radial_load_N) for point in found.points), strict=True)
    identity = identity_of("rbdyn simulate --duty", found.scene, files, swept=dict(zip(AXES, places, strict=True)))
    answer, write = partial(simulated_blocks, found), partial(write_simulated, found)
    return Delivery(identity, found.as_dict, answer, write, bool(found.failed))


@result_command("rbdyn accuracy", ACCURACY_FILES, "Write JSON, CSV and pictures to this folder.", "Add versions.")
def accuracy(
    console: Console,
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene file to examine.")],
    study: Annotated[
        str | None,
        typer.Argument(
            metavar="[tolerances|methods|coverage|options|stability]",
            help="Error by tolerance, other integrators or ball solver, coverage of intervals, cost of options, or extreme variants.",
            show_default="tolerances; methods of a ball bearing",
        ),
    ] = None,
    assignments: command.Set = None,
) -> Delivery:
    """Compare error and run time for different tolerances and integrators; for a ball bearing, measure the solver."""
    from rbdyn import accuracy as studies

    loaded = Scene.load(scene, assignments or [])
    name = studies.study_name(study, loaded)
    console.folder.claim(scene)
    with console.progress(name) as progress:
        report = studies.study(name, loaded, progress)
    return Delivery(None, lambda: report.record, lambda: report.blocks, partial(studies.write, report), report.failed)


def map_blocks(mapped: "SlipMap", duty: "MapDuty | None" = None) -> list[Block]:
    """Cage slip and class of the cage over both axes, what it cost, and the points of a duty."""
    from rbdyn.dynamics.slip_map import axis_value

    along, up = mapped.axes
    header = (label(up.rpartition(".")[2]), *(axis_value(along, value) for value in mapped.columns))
    rows = [
        (f"{value:g}", *(f"{100.0 * slip:.3g} %" if slip == slip else "failed" for slip in row))
        for value, row in zip(mapped.rows, mapped.grid("cage_slip"), strict=True)
    ]
    spent = f"{counted(len(mapped.points), 'point')} in {mapped.wall_s:.1f} s, seed {mapped.seed}"
    cages = [(f"{value:g}", *row) for value, row in zip(mapped.rows, mapped.cages, strict=False)]
    classes = Table("Class of the cage by its orbit, with the replicates that have it", header, cages)
    answer = [Table("Cage slip", header, rows), classes, Paragraph(spent), *(duty.blocks if duty else [])]
    return with_notes((*mapped.notes, *(duty.notes if duty else ())), answer)


def _write_map(mapped: "SlipMap", duty: "MapDuty | None", folder: Path) -> None:
    """Write map.json, map.csv and map.png, with a duty also duty.csv."""
    from rbdyn.base.files import write_json
    from rbdyn.dynamics.slip_map import map_sheet
    from rbdyn.life import life_sheet
    from rbdyn.plots.roller import draw_slip_map

    write_json(folder / "map.json", _map_record(mapped, duty))
    map_sheet(mapped.points).save(folder)
    draw_slip_map(mapped, folder / "map.png", duty.marks if duty else {})
    if duty is not None:
        life_sheet(duty.points).save(folder)


def _map_record(mapped: "SlipMap", duty: "MapDuty | None") -> dict[str, Any]:
    return mapped.as_dict() | ({} if duty is None else {"duty": duty.as_dict()})


@result_command(
    "rbdyn map",
    (*MAP_FILES, *STIFFNESS_FILES, *REPORT_FILES),
    "Write tables and a picture to this folder, and keep finished points there.",
    keeps=(MAP_POINTS,),
)
def slip_map(
    console: Console,
    scene: command.SceneFile,
    speed: Annotated[str | None, command.valued("RPM", "Inner-ring speeds: start:stop:count or a,b,c.", "one")] = None,
    load: Annotated[str | None, command.valued("N", "Radial loads: start:stop:count or a,b,c.", "one")] = None,
    sweep: Annotated[
        list[str] | None,
        command.valued(
            "KEY=VALUES", "Vary any other key instead of speed or load; repeatable.", "speed and load", "--sweep"
        ),
    ] = None,
    duty: Annotated[
        Path | None,
        command.valued("FILE", "Mark the operating points of this file, such as a study's.", "none", "--duty"),
    ] = None,
    stiffness: Annotated[
        bool,
        command.flag(
            "--stiffness",
            help="Map the stiffness of a roller or ball bearing, for rotor dynamics programs such as ROSS.",
        ),
    ] = False,
    load_angle: Annotated[
        float,
        command.valued("DEG", "Load direction from the x axis of the stiffness; -90 if gravity acts along -y.", "0"),
    ] = 0.0,
    loss_factor: Annotated[
        float, command.valued("ETA", "Damping of the stiffness, c = ETA k/speed.", "0, no damping")
    ] = 0.0,
    assignments: command.Set = None,
    turns: command.Turns = None,
    replicates: command.Replicates = None,
    seed: command.Seed = None,
    workers: command.Workers = None,
) -> Delivery:
    """Map cage slip, power loss, impact, whirl and cage class over two keys, or stiffness over speed and load."""
    swept = _map_axes(speed, load, sweep or [])
    (along, columns), (up, rows) = swept.items()
    if (along, up) != AXES and (stiffness or duty):
        raise InputError(
            f"--sweep {' '.join(sweep or [])}: --stiffness and --duty need a map over --speed and --load; state these"
        )
    if stiffness:
        if duty is not None:
            raise InputError(f"--duty {duty}: marks points of a map of cage slip; leave it or --stiffness out")
        from rbdyn.cli.stiffness import over_speed

        chosen = Scene.load(scene, _with_numerics(assignments, turns=turns, replicates=replicates, seed=seed))
        return over_speed(console, scene, chosen, (columns, rows), load_angle, loss_factor, workers)
    if load_angle or loss_factor:
        raise InputError("--load-angle, --loss-factor: belong to --stiffness; state that too, or leave them out")
    loaded = _rollers(scene, assignments, turns=turns, replicates=replicates, seed=seed)
    from rbdyn.cli.simulation_output import map_duty
    from rbdyn.dynamics.slip_map import slip_map as run_map

    marked = None if duty is None else map_duty(loaded, duty, columns, rows)
    console.folder.claim(scene)
    points = console.folder.path / MAP_POINTS if console.folder.path else None
    with command.checkpoint_message(points), console.progress("mapping") as progress:
        mapped = run_map(loaded, columns, rows, workers, progress, points, console.notice, (along, up))
    inputs = [scene] if duty is None else [scene, duty]
    return Delivery(
        identity_of("rbdyn map", loaded.model_dump(mode="json"), inputs, swept=swept),
        partial(_map_record, mapped, marked),
        partial(map_blocks, mapped, marked),
        partial(_write_map, mapped, marked),
        bool(mapped.failed),
        lambda: _print_failed(mapped),
    )


def _map_axes(speed: str | None, load: str | None, others: Sequence[str]) -> dict[str, list[float]]:
    """Values of the two axes of a map by key, speed first and load last. Raises InputError with all faults of their keys."""
    refuse(assignment_faults("--sweep", others, {("numerics",): "belongs to all points; state it by --set"}))
    stated = [(AXES[0], speed, "--speed")] if speed is not None else []
    stated += [
        (".".join(key_path(text)), text.partition("=")[2], f"--sweep {text.partition('=')[0]}") for text in others
    ]
    stated += [(AXES[1], load, "--load")] if load is not None else []
    if len({key for key, *_ in stated}) != 2 or len(stated) != 2:
        raise InputError(
            f"--speed, --load, --sweep: a map has two axes, and {len(stated)} are stated; state two different ones"
        )
    stated.sort(key=lambda entry: (entry[0] == AXES[1]) - (entry[0] == AXES[0]))
    return {key: axis_values(values, option) for key, values, option in stated}


def _print_failed(mapped: "SlipMap") -> None:
    for point in mapped.failed:
        print(f"{point.place(mapped.axes)}: {point.status}", file=sys.stderr)


def _rollers(path: Path, assignments: list[str] | None, **shorthand: float | None) -> Scene:
    """Scene of a roller bearing, with keys of [numerics] that have options of their own. Raises InputError for any other."""
    return rollers_only(Scene.load(path, _with_numerics(assignments, **shorthand)))


def _with_numerics(assignments: list[str] | None, **shorthand: float | None) -> list[str]:
    """Assignments, and those of keys of [numerics] that have options of their own."""
    numerics = [f"numerics.{key}={value}" for key, value in shorthand.items() if value is not None]
    return [*(assignments or []), *numerics]


def _aim(target: str, turns: float | None, replicates: int | None) -> float:
    """Relative error that ``--target`` asks for. Raises InputError."""
    from rbdyn.dynamics.target import target_of

    if turns is not None or replicates is not None:
        raise InputError(f"--target {target}: chooses turns and replicates itself; drop --turns and --replicates")
    return target_of(target)


def show(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="A result.json, or a folder with one.")],
    out: Annotated[Path | None, command.folder_option("Write to this folder.", "show, next to the result")] = None,
    force: command.Force = False,
    turns: Annotated[float | None, command.valued("N", "Counted shaft turns to show.", "all, at most 20")] = None,
    replicate: Annotated[int, typer.Option(metavar="N", help="Number of the replicate, from 1.")] = 1,
    animate: Annotated[bool, command.flag("--animate", help="Add a film and a page that plays the motion.")] = False,
    as_json: command.Json = False,
    quiet: command.Quiet = False,
    verbose: Annotated[bool, command.verbose_flag("Add peaks of the spectra.")] = False,
) -> None:
    """Write pictures and time histories of a saved simulation."""
    target = out or (result if result.is_dir() else result.parent) / "show"
    with command.guarded(as_json), output_folder(target, "rbdyn show", SHOW_FILES, force=force) as folder:
        from rbdyn.cli import show as motion_output

        request = motion_output.request_of(result, turns, replicate)
        folder.claim(request.path)
        with command.progress_bar("showing", quiet or as_json) as progress:
            notice = command.notice(quiet or as_json)
            record = folder.write(lambda stage: motion_output.write(request, stage, animate, progress, notice))
        command.hand_over(
            lambda: record,
            as_json,
            lambda: show_blocks(motion_output.blocks(record), Detail.of(quiet, verbose)),
            target,
            record["files"],
        )


COMMANDS = {"new": new, "simulate": simulate, "show": show, "map": slip_map, "ball": ball, "compare": compare}
for name, function in {**COMMANDS, "accuracy": accuracy, "keys": describe_keys, "manual": manual}.items():
    app.command(name)(function)
