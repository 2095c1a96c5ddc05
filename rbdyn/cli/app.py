"""The command ``rbdyn``: simulate, map, accuracy and show; ``ball``, ``new``, ``keys`` and ``manual`` stand beside."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from rbdyn.cli import options as given
from rbdyn.cli import terminal
from rbdyn.cli.ball import ball
from rbdyn.cli.keys import command as keys
from rbdyn.cli.manual.command import manual
from rbdyn.cli.new import new
from rbdyn.records.cells import save_table
from rbdyn.records.forecast import span
from rbdyn.records.words import counted, error_alone

if TYPE_CHECKING:
    from rbdyn.dynamics.slip_map import SlipMap
    from rbdyn.result import SimulationResult
    from rbdyn.scene import Scene

app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False)

# Length of the history that --out draws.
TRACE_TURNS = 10.0
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
        files = _write(loaded, result, folder) if folder else []
        terminal.hand_over(result.as_dict, as_json, lambda: _print(result, quiet, verbose), folder, files)


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


def _print_map(mapped: "SlipMap") -> None:
    header = ("load [N]", *(f"{value:g} rpm" for value in mapped.speeds_rpm))
    rows = [
        (f"{value:g}", *(f"{100.0 * slip:.3g} %" if slip == slip else "failed" for slip in row))
        for value, row in zip(mapped.loads_N, mapped.grid("cage_slip"), strict=True)
    ]
    terminal.print_table("cage slip", header, rows)
    print(f"{counted(len(mapped.points), 'point')} in {mapped.wall_s:.1f} s, seed {mapped.seed}")


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
        from rbdyn.cli.ranges import axis_values
        from rbdyn.dynamics import slip_map as study

        axes = axis_values(speed, "--speed"), axis_values(load, "--load")
        points = folder / study.POINTS if folder else None
        with terminal.keeping(points), terminal.progress_bar("mapping", quiet or as_json, workers) as progress:
            mapped = study.slip_map(loaded, *axes, workers, progress, points, terminal.notice(quiet))
        files = _write_map(mapped, folder) if folder else []
        terminal.hand_over(mapped.as_dict, as_json, lambda: _print_map(mapped), folder, files)
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
    from rbdyn.dynamics.target import target_of
    from rbdyn.faults import InputError

    if turns is not None or replicates is not None:
        raise InputError([f"--target {target}: chooses turns and replicates itself; drop --turns and --replicates"])
    return target_of(target)


def _write(scene: "Scene", result: "SimulationResult", folder: Path) -> list[str]:
    from rbdyn import plots
    from rbdyn.dynamics.motion.history import history, most_turns

    result.save(folder / "result.json")
    turns = min(TRACE_TURNS, scene.numerics.turns, most_turns(scene))
    shown = history(scene, turns, notice=None)  # the simulation has stated its pace
    save_table(shown.table(), folder / "history.csv", "%.6g")
    title = f"first {turns:g} counted shaft turns"
    plots.cage_orbit({title: shown}, folder / "cage_orbit.png")
    plots.pocket_forces({title: shown}, folder / "pocket_forces.png")
    return ["result.json", "history.csv", "cage_orbit.png", "pocket_forces.png"]


def _print(result: "SimulationResult", quiet: bool, verbose: bool) -> None:
    from rbdyn.compiled.kernel import compiler_notes

    def shown(error: float | None) -> str:
        return "not estimated" if error is None else error_alone(error)

    contact = {"largest of it by contact alone, without the film [N]": result.impact_contact_force}
    orbit = result.cage_orbit_radius_share
    figures = {
        f"largest roller/cage force in {counted(result.impact_window_turns, 'shaft turn')} [N]": result.impact_force,
        **({} if result.impact_contact_force == result.impact_force else contact),
        "whirl deviation ratio": result.whirl_deviation_ratio,
        **({} if orbit is None else {"radius of the cage's orbit over its radial play": orbit}),
        "power loss [W]": result.power_loss,
        "cage speed [rpm]": result.cage_speed_rpm,
        "cage slip": result.cage_slip,
    }
    header = ("figure", "value", "statistical error (95 %)", "numerical error (95 %)", "effective samples")
    rows = []
    for label, of in figures.items():
        errors = shown(of.statistical_error), shown(of.numerical_error)
        rows.append((label, of.shown, *errors, f"{of.effective_samples:.0f}"))
    columns = len(header) if verbose else -1
    terminal.print_table("", header[:columns], [row[:columns] for row in rows])
    if result.target is not None:
        _print_target(result.target)
    loads = f"{result.max_inner_load:.0f} N (inner), {result.max_outer_load:.0f} N (outer)"
    runs = f"{counted(result.replicates, 'replicate')}, seed {result.seed}"
    took = (
        f"{result.cost['wall_s']:.2f} s{_predicted(result.cost)}, {result.cost['compile_s']:.1f} s to load or compile"
    )
    print(f"race loads up to {loads}; power balance closes to {100.0 * result.power_gap:.2g} %; {runs}; {took}")
    for race, at in result.races.items():
        film = f", film {at['central_film_um']:.2g} um, lambda {at['lambda_ratio']:.2g}" if "lambda_ratio" in at else ""
        pressed = f"{at['max_pressure_MPa']:.0f} MPa over {at['half_width_um']:.0f} um each way"
        print(f"{race} race at its largest load: {pressed}{film}")
    if result.scene.get("mounting"):
        _print_clearances(result.clearance)
    if result.friction_check is not None:
        print(_friction_line(result.friction_check))
    if verbose:
        if result.transient_turns is not None:
            print(f"transient: {counted(result.transient_turns, 'shaft turn')}")
        terms = [(term.replace("_", " "), f"{power:.4g}") for term, power in result.power_terms.items()]
        terms += [
            (f"rolling resistance, {race} race", f"{power:.4g}") for race, power in result.rolling_resistance.items()
        ]
        gap = result.power_gap * result.power_loss.value
        terminal.print_table(f"power lost; the power balance closes to {gap:.2g} W", ("term", "W"), terms)
        terminal.print_table("cost", ("", ""), [(key, f"{value:.6g}") for key, value in result.cost.items()])
    terminal.print_notes([*result.notes, *(compiler_notes() if verbose else ())], quiet)


def _predicted(cost: dict[str, float]) -> str:
    """What was stated of the wall time on the way, if anything."""
    if "predicted_most_s" not in cost:
        return ""
    return f" (predicted: {span(cost['predicted_least_s'], cost['predicted_most_s'])})"


def _print_clearances(clearance: dict[str, Any]) -> None:
    """What makes each clearance in operation, the radial one with its fits one by one."""
    plays = {
        "clearance": clearance,
        "guide clearance": clearance.get("guide"),
        "pocket clearance": clearance.get("pocket"),
    }
    for name, play in plays.items():
        if play is not None:
            numbers = {part.replace("_", " "): value for part, value in play.items() if isinstance(value, float)}
            print(f"{name}: {', '.join(f'{part} {value:+.1f} um' for part, value in numbers.items())}")


def _friction_line(check: dict[str, float | None]) -> str:
    """The maker's friction in a line; [N mm] and [W]."""
    power, rolling, sliding, heat, ratio = check.values()
    model = (
        f"SKF's model {power:.3g} W (rolling {rolling:.3g}, sliding {sliding:.3g} N mm), ISO 15312 heat {heat:.3g} W"
    )
    share = "no ratio at zero load or speed" if ratio is None else f"power loss is {ratio:.2f} of SKF's"
    return f"maker's friction: {model}; {share}"


def _print_target(target: dict[str, Any]) -> None:
    chosen, cost = target["chosen"], target["cost"]
    errors = target["relative_error"].items()
    reached = ", ".join(f"{name} {'unknown' if e is None else f'{100.0 * e:.2g} %'}" for name, e in errors)
    aim = f"target {100.0 * target['asked']:g} % {'met' if target['met'] else 'not met'} ({reached})"
    runs = (
        f"{counted(chosen['replicates'], 'replicate')} of {counted(chosen['turns'], 'turn')} at rtol {chosen['rtol']:g}"
    )
    spent = f"{cost['rhs_evaluations'] / 1e6:.1f} million right-hand sides"
    pilots = f"{cost['pilot_rhs_evaluations'] / 1e6:.1f} of them for pilots"
    print(f"{aim} by {runs}; {spent}, {pilots}; the seconds are those of pilots and all runs")


@app.command()
def show(
    result: Annotated[Path, typer.Argument(metavar="RESULT", help="A result.json, or a folder that holds one.")],
    out: Annotated[Path | None, given.folder_option("Write here.", "'show' beside the result")] = None,
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
            lambda: record, as_json, lambda: motion.print_record(record, quiet, verbose), folder, record["files"]
        )
