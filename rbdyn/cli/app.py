"""The command ``rbdyn``: simulate, map, accuracy and show; ``ball``, ``new``, ``keys`` and ``manual`` are modules of their own."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rbdyn.base import options as given
from rbdyn.base import terminal
from rbdyn.base.blocks import Block, Detail, Paragraph, Table
from rbdyn.base.records import save_table
from rbdyn.base.render.terminal import show as show_blocks
from rbdyn.base.words import counted
from rbdyn.cli.ball import ball
from rbdyn.cli.keys import command as keys
from rbdyn.cli.manual.command import manual
from rbdyn.cli.new import new

if TYPE_CHECKING:
    from rbdyn.dynamics.slip_map import SlipMap
    from rbdyn.scene import Scene

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)

# Options that ``rbdyn accuracy`` had, and what took their place.
SCRIPT = "run python examples/benchmarks/{}"
FORMER = {
    **{
        f"--{name}": f"write rbdyn accuracy SCENE.toml {name}"
        for name in ("methods", "coverage", "options", "stability")
    },
    "--slices": SCRIPT.format("slicing.py SCENE.toml"),
    "--replicates": SCRIPT.format("replication.py SCENE.toml"),
    "--scaling": SCRIPT.format("scaling.py SCENE.toml"),
    "--battery": SCRIPT.format("ball_battery.py SCENE.toml"),
    "--scenes": SCRIPT.format("ball_battery.py SCENE.toml --scenes N"),
    "--page": SCRIPT.format("measured_page.py FILE"),
    "--part": SCRIPT.format("measured_page.py FILE --part NAME"),
    "--repeats": "rbdyn accuracy SCENE.toml coverage makes 200 repeats",
    "--trajectory": "rbdyn accuracy SCENE.toml tolerances compares motions over 0.25 turns",
    "--sought-percent": "rbdyn accuracy SCENE.toml tolerances judges biases of 1 %",
}

app.command()(ball)
app.command("keys")(keys)
app.command()(new)
app.command()(manual)


@app.callback()
def main(version: given.Version = False) -> None:
    """Dynamics of rolling bearings: forces, whirl and power loss with their errors."""


@app.command()
def simulate(
    scene: given.SceneFile,
    assignments: given.Set = None,
    turns: given.Turns = None,
    replicates: given.Replicates = None,
    seed: given.Seed = None,
    workers: given.Workers = None,
    target: Annotated[
        str | None,
        given.valued(
            "2%",
            "Choose tolerance, turns and replicates so that impact, whirl and loss are known to this.",
            "those given",
        ),
    ] = None,
    out: given.Out = None,
    as_json: given.Json = False,
    quiet: given.Quiet = False,
    verbose: given.Verbose = False,
) -> None:
    """Simulate a cylindrical roller bearing: impact force, whirl deviation ratio, power loss."""
    with terminal.guarded(as_json):
        loaded = _rollers(scene, assignments, turns=turns, replicates=replicates, seed=seed)
        aim = None if target is None else _aim(target, turns, replicates)
        folder = terminal.output_folder(out, "rbdyn simulate", scene) if out else None
        from rbdyn.dynamics.simulate import simulate as run_scene

        with terminal.progress_bar("simulating", quiet or as_json, workers) as progress:
            result = run_scene(loaded, workers, progress, target=aim, notice=terminal.notice(quiet))
        loaded = type(loaded).from_dict(result.scene)
        from rbdyn.cli import simulation_output as answer

        files = answer.write(loaded, result, folder) if folder else []
        detail = Detail.of(quiet, verbose)
        terminal.hand_over(result.as_dict, as_json, lambda: show_blocks(answer.blocks(result), detail), folder, files)


@app.command(cls=given.refusing(FORMER))
def accuracy(
    scene: Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene to study.")],
    study: Annotated[
        str | None,
        typer.Argument(
            metavar="[tolerances|methods|coverage|options|stability]",
            help="Error by tolerance; other integrators, or solvers of a ball bearing; how often the stated intervals hold "
            "the truth; what each option costs; how extreme variants of the scene end.",
            show_default="tolerances; methods of a ball bearing",
        ),
    ] = None,
    assignments: given.Set = None,
    out: Annotated[Path | None, given.folder_option("Write the study as JSON, CSV and pictures here.")] = None,
    as_json: given.Json = False,
    quiet: given.Quiet = False,
    verbose: Annotated[bool, given.verbose_flag("Also versions.")] = False,
) -> None:
    """Show error against run time: of every output at each tolerance and of the motion; of a ball bearing, the solvers."""
    with terminal.guarded(as_json):
        from rbdyn import accuracy as studies
        from rbdyn.scene import Scene

        loaded = Scene.load(scene, assignments or [])
        name = studies.chosen(study, loaded)
        folder = terminal.output_folder(out, "rbdyn accuracy", scene) if out else None
        with terminal.progress_bar(name, quiet or as_json) as progress:
            report = studies.study(name, loaded, progress)
        files = studies.write(report, folder) if folder else []
        terminal.hand_over(lambda: report.record, as_json, lambda: studies.show(report, verbose), folder, files)
    if report.failed:
        raise typer.Exit(terminal.FAILED)


def map_blocks(mapped: "SlipMap") -> list[Block]:
    """Cage slip over speed and load, and what it cost."""
    header = ("load [N]", *(f"{value:g} rpm" for value in mapped.speeds_rpm))
    rows = [
        (f"{value:g}", *(f"{100.0 * slip:.3g} %" if slip == slip else "failed" for slip in row))
        for value, row in zip(mapped.loads_N, mapped.grid("cage_slip"), strict=True)
    ]
    spent = f"{counted(len(mapped.points), 'point')} in {mapped.wall_s:.1f} s, seed {mapped.seed}"
    return [Table("Cage slip", header, rows), Paragraph(spent)]


def _write_map(mapped: "SlipMap", folder: Path) -> list[str]:
    """Write map.json, map.csv and map.png; returns the file names."""
    from rbdyn.plots.roller import draw_slip_map
    from rbdyn.result import write_json

    write_json(folder / "map.json", mapped.as_dict())
    save_table(mapped.table(), folder / "map.csv")
    draw_slip_map(mapped, folder / "map.png")
    return ["map.json", "map.csv", "map.png"]


@app.command("map")
def slip_map(
    scene: given.SceneFile,
    speed: Annotated[str, typer.Option(metavar="RPM", help="Inner speeds: start:stop:count or a,b,c.")],
    load: Annotated[str, typer.Option(metavar="N", help="Radial loads: start:stop:count or a,b,c.")],
    assignments: given.Set = None,
    turns: given.Turns = None,
    replicates: given.Replicates = None,
    seed: given.Seed = None,
    workers: given.Workers = None,
    out: Annotated[
        Path | None, given.folder_option("Write map.json, map.csv and map.png here, and keep finished points.")
    ] = None,
    as_json: given.Json = False,
    quiet: given.Quiet = False,
) -> None:
    """Map cage slip, power loss, impact and whirl over speed and load."""
    with terminal.guarded(as_json):
        loaded = _rollers(scene, assignments, turns=turns, replicates=replicates, seed=seed)
        folder = terminal.output_folder(out, "rbdyn map", scene) if out else None
        from rbdyn.base.ranges import axis_values
        from rbdyn.dynamics import slip_map as study

        axes = axis_values(speed, "--speed"), axis_values(load, "--load")
        points = folder / study.POINTS if folder else None
        with terminal.keeping(points), terminal.progress_bar("mapping", quiet or as_json, workers) as progress:
            mapped = study.slip_map(loaded, *axes, workers, progress, points, terminal.notice(quiet))
        files = _write_map(mapped, folder) if folder else []
        terminal.hand_over(mapped.as_dict, as_json, lambda: show_blocks(map_blocks(mapped)), folder, files)
        for point in mapped.failed:
            print(f"{point.inner_speed_rpm:g} rpm, {point.radial_load_N:g} N {point.status}", file=sys.stderr)
    if mapped.failed:
        raise typer.Exit(terminal.FAILED)


def _rollers(path: Path, assignments: list[str] | None, **shorthand: float | None) -> "Scene":
    """Scene of a roller bearing, with keys of [numerics] that have options of their own. Raises InputError for any other."""
    from rbdyn.scene import Scene, rollers_only

    numerics = (f"numerics.{key}={value}" for key, value in shorthand.items() if value is not None)
    return rollers_only(Scene.load(path, [*(assignments or []), *numerics]))


def _aim(target: str, turns: float | None, replicates: int | None) -> float:
    """Relative error that ``--target`` asks for. Raises InputError."""
    from rbdyn.base.faults import InputError
    from rbdyn.dynamics.target import target_of

    if turns is not None or replicates is not None:
        raise InputError([f"--target {target}: chooses turns and replicates itself; drop --turns and --replicates"])
    return target_of(target)


@app.command()
def show(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="A result.json, or a folder that holds one.")],
    out: Annotated[Path | None, given.folder_option("Write here.", "'show' next to the result")] = None,
    turns: Annotated[float | None, given.valued("N", "Counted shaft turns to show.", "all, at most 20")] = None,
    replicate: Annotated[int, typer.Option(metavar="N", help="Which replicate, from 1.")] = 1,
    animate: Annotated[bool, given.flag("--animate", says="Also a moving picture and a player.")] = False,
    lyapunov: Annotated[bool, given.flag("--lyapunov", says="Also the largest Lyapunov exponent.")] = False,
    as_json: given.Json = False,
    quiet: given.Quiet = False,
    verbose: Annotated[bool, given.verbose_flag("Also peaks of the spectra.")] = False,
) -> None:
    """Show how the bearing of a saved result moves: pictures, history.csv and orbit.json."""
    with terminal.guarded(as_json):
        from rbdyn.cli import show as motion

        request = motion.request_of(result, turns, replicate)
        folder = terminal.output_folder(out or request.path.parent / "show", "rbdyn show", request.path)
        with terminal.progress_bar("showing", quiet or as_json) as progress:
            record = motion.write(request, folder, animate, lyapunov, progress, terminal.notice(quiet or as_json))
        terminal.hand_over(
            lambda: record,
            as_json,
            lambda: show_blocks(motion.blocks(record), Detail.of(quiet, verbose)),
            folder,
            record["files"],
        )
