"""The command ``rbdyn``. Physics is imported inside the commands, so that help comes at once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rbdyn.terminal import guarded, output_folder, print_json, print_table, progress_bar

if TYPE_CHECKING:
    from rbdyn.result import SimulationResult
    from rbdyn.scene import Scene

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

# Length of the history that --out draws.
TRACE_TURNS = 10.0

SceneFile = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene to simulate.")]
Set = Annotated[
    list[str] | None, typer.Option("--set", metavar="KEY.PATH=VALUE", help="Replace a key; repeatable.")
]
Turns = Annotated[float | None, typer.Option(help="Counted shaft turns [numerics.turns].")]
Replicates = Annotated[int | None, typer.Option(help="Seeded replicates [numerics.replicates].")]
Seed = Annotated[int | None, typer.Option(help="Seed [numerics.seed].")]
Workers = Annotated[int | None, typer.Option(min=1, help="Threads; all processors by default.")]
Out = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Write result.json, history.csv and pictures here.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress, no notes.")]
Verbose = Annotated[bool, typer.Option("--verbose", "-v", help="Also print power terms and cost.")]


@app.callback()
def main() -> None:
    """Dynamics of rolling bearings: forces, whirl and power loss with their errors."""


@app.command()
def simulate(
    scene: SceneFile,
    assignments: Set = None,
    turns: Turns = None,
    replicates: Replicates = None,
    seed: Seed = None,
    workers: Workers = None,
    out: Out = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Simulate a cylindrical roller bearing: impact force, whirl deviation ratio, power loss."""
    with guarded(as_json):
        from rbdyn.scene import Scene

        shorthand = {"turns": turns, "replicates": replicates, "seed": seed}
        overrides = [
            *(assignments or []),
            *(f"numerics.{k}={v}" for k, v in shorthand.items() if v is not None),
        ]
        loaded = Scene.load(scene, overrides)
        folder = output_folder(out) if out else None
        from rbdyn.dynamics.simulate import simulate as run_scene

        with progress_bar("simulating", quiet or as_json) as progress:
            result = run_scene(loaded, workers, progress)
        if folder:
            _write(loaded, result, folder)
        if as_json:
            print_json(result.as_dict())
        else:
            _print(result, quiet, verbose)
            if folder:
                print(f"written to {folder}: result.json, history.csv, cage_orbit.png, pocket_forces.png")


@app.command()
def accuracy(
    scene: SceneFile,
    assignments: Set = None,
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Write accuracy.json, .csv and .png here.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Also versions.")] = False,
) -> None:
    """Show error against run time: bias of every output and cost at each tolerance."""
    with guarded(as_json):
        from rbdyn.scene import Scene

        loaded = Scene.load(scene, assignments or [])
        folder = output_folder(out) if out else None
        from rbdyn import accuracy as study

        with progress_bar("tolerances", quiet or as_json) as progress:
            rows = study.work_precision(loaded, progress=progress)
        files = study.write(rows, loaded, folder) if folder else []
        if as_json:
            print_json(study.record(rows, loaded))
            return
        header = ("rtol", "ms a turn", "ns a right-hand side", "steps a turn", "power gap", *study.OUTPUTS)
        cells = [
            (
                f"{row.rtol:g}",
                f"{row.turn_ms:.2f}",
                f"{row.rhs_ns:.0f}",
                f"{row.steps_per_turn:.0f}",
                f"{100.0 * row.power_gap:.2g} %",
                *(
                    f"{100.0 * row.bias[name]:+.2f} ± {100.0 * row.bias_error[name]:.2f} %"
                    for name in study.OUTPUTS
                ),
            )
            for row in rows
        ]
        print_table(f"bias against rtol {rows[-1].rtol:g}, 95 % errors", header, cells)
        print(study.conclusion(rows, loaded))
        print(
            f"{loaded.numerics.replicates} replicates of {loaded.numerics.turns:g} turns; {study.processor()}"
        )
        if folder:
            print(f"written to {folder}: {', '.join(files)}")


def _write(scene: Scene, result: SimulationResult, folder: Path) -> None:
    import pandas as pd

    from rbdyn import plots
    from rbdyn.dynamics.simulate import trace

    result.save(folder / "result.json")
    history = trace(scene, min(TRACE_TURNS, scene.numerics.turns))
    columns = {
        "time_s": history.time,
        "cage_x_um": history.cage_x * 1e6,
        "cage_y_um": history.cage_y * 1e6,
        **{f"pocket_{j + 1}_N": load for j, load in enumerate(history.pocket_load.T)},
    }
    pd.DataFrame(columns).to_csv(folder / "history.csv", index=False, float_format="%.6g")
    title = f"first {min(TRACE_TURNS, scene.numerics.turns):g} counted shaft turns"
    plots.cage_orbit({title: history}, [scene.guide_clearance_m], folder / "cage_orbit.png")
    plots.pocket_forces({title: history}, folder / "pocket_forces.png")


def _print(result: SimulationResult, quiet: bool, verbose: bool) -> None:
    def shown(error: float | None) -> str:
        return "not estimated" if error is None else f"± {error:.2g}"

    figures = {
        f"largest roller/cage force in {result.impact_window_turns:g} shaft turns [N]": result.impact_force,
        "whirl deviation ratio": result.whirl_deviation_ratio,
        "power loss [W]": result.power_loss,
        "cage speed [rpm]": result.cage_speed_rpm,
        "cage slip": result.cage_slip,
    }
    rows = [
        (label, f"{figure.value:.5g}", shown(figure.statistical_error), shown(figure.numerical_error))
        for label, figure in figures.items()
    ]
    print_table("", ("figure", "value", "statistical error (95 %)", "numerical error (95 %)"), rows)
    print(
        f"race loads up to {result.max_inner_load:.0f} N (inner), {result.max_outer_load:.0f} N (outer); power balance "
        f"closes to {100.0 * result.power_gap:.2g} %; {result.replicates} replicates, seed {result.seed}; "
        f"{result.cost['wall_s']:.2f} s, {result.cost['compile_s']:.1f} s to load or compile"
    )
    if verbose:
        terms = [(term.replace("_", " "), f"{power:.4g}") for term, power in result.power_terms.items()]
        gap = result.power_gap * result.power_loss.value
        print_table(f"power lost, each to ± {gap:.2g} W (gap of the power balance)", ("term", "W"), terms)
        print_table("cost", ("", ""), [(key, f"{value:.6g}") for key, value in result.cost.items()])
    if not quiet:
        for note in result.notes:
            print(f"note: {note}")


def run() -> None:
    """Entry point of the command."""
    app()
