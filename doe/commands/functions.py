"""Commands that are functions of the library: the whole study, its steps alone, and unknown inputs of a scene."""

from pathlib import Path
from typing import Annotated

import typer

from doe.commands.options import (
    Adaptive,
    Data,
    Out,
    Part,
    Quiet,
    Retry,
    Robust,
    Save,
    Scheduler,
    StudyOut,
    StudyPath,
    Verbose,
    command,
)
from rbdyn.base.command import Set, Workers, flag, folder_option, valued, verbose_flag

ScenePath = Annotated[Path, typer.Argument(metavar="SCENE.toml", help="Scene of a roller bearing.")]
STORE = "Folder of results and of the store of finished runs."
Texts = list[str] | None
# How runs are made, of every command that simulates.
RUNS = {"workers": Workers, "scheduler": Scheduler, "retry": Retry}

study = command(
    "study",
    "Design, simulate, fit, optimise, confirm and dimension in one go; resumes by itself.",
    "results",
    path=StudyPath,
    out=StudyOut,
    part=Part,
    **RUNS,
    adaptive=Adaptive,
    robust=Robust,
    quiet=Quiet,
    verbose=Verbose,
)
run = command(
    "run",
    "Simulate every row of a table of scenes; a failed row does not end the others. Resumes by itself.",
    "results",
    "run_answer",
    table=Annotated[
        Path, typer.Argument(metavar="TABLE", help="CSV, xlsx or parquet: a row a run, columns are keys of a scene.")
    ],
    scene=Annotated[Path | None, valued("SCENE.toml", "Scene of rows without one.", "the column scene", "--scene")],
    part=Part,
    overrides=Set,
    out=Annotated[Path | None, folder_option(STORE, "TABLE_results")],
    **RUNS,
    quiet=Quiet,
)
design = command(
    "design",
    "Print the design: every run, and how well the runs identify the terms of the models.",
    path=StudyPath,
    out=Save,
    as_csv=Annotated[bool, flag("--csv", says="Print a CSV table and nothing else.")],
    quiet=Annotated[bool, flag("--quiet", "-q", says="Actual values only.")],
    verbose=Annotated[bool, verbose_flag("Also seeds and leverages.")],
)
fit = command(
    "fit",
    "Fit the response surfaces and print their analysis of variance.",
    path=Annotated[Path | None, typer.Argument(metavar="STUDY.toml", help="Study to fit; none for a table alone.")],
    data=Data,
    factors=Annotated[
        Texts,
        valued(
            "NAME",
            "Column of --data that is a factor, without STUDY; repeatable.",
            "all numbers but --response",
            "--factor",
        ),
    ],
    responses=Annotated[
        Texts,
        valued(
            "NAME",
            "Column of --data to be fitted, without STUDY; repeatable.",
            "all numbers but --factor",
            "--response",
        ),
    ],
    model=Annotated[
        str | None,
        valued("NAME", "linear, interaction, pure_quadratic, quadratic or reduced, without STUDY.", "quadratic"),
    ],
    out=Out,
    **RUNS,
    quiet=Quiet,
    verbose=Annotated[bool, verbose_flag("Also residual, leverage and Cook's distance of each run.")],
)
front = command(
    "front",
    "Find the Pareto front on the response surfaces.",
    path=StudyPath,
    data=Data,
    out=Out,
    **RUNS,
    point=Annotated[
        str | None,
        valued(
            "A,B,...|NAME=A,...",
            "Also predict this point on the surfaces: factor values in order, or by name (the rest at the baseline).",
            "none",
        ),
    ],
    quiet=Quiet,
    verbose=Annotated[bool, verbose_flag("Also every point of the front.")],
)
chain = command(
    "chain",
    "Solve dimension chains: limits, yield, contributions, allocation. A chain that misses its limits ends with exit code 1.",
    path=Annotated[
        Path, typer.Argument(metavar="CHAIN.toml", help="Dimension chain to solve, or several in tables named chain.")
    ],
    out=Save,
    quiet=Annotated[bool, flag("--quiet", "-q", says="Parts only.")],
    verbose=Annotated[bool, verbose_flag("Also yields by distribution, quantiles, classes.")],
)
uncertainty = command(
    "uncertainty",
    "List the unknown inputs of a scene, the range of every output over them, and the share of each input.",
    "uncertainty",
    path=ScenePath,
    points=Annotated[int | None, valued("N", "Input sets to begin with, a power of two.", "128", min=16, max=512)],
    target=Annotated[
        str | None, valued("SHARE", "Standard error of the ends of a range, as a share of its width.", "10%")
    ],
    figures=Annotated[
        Texts,
        valued(
            "NAME",
            "A further output, such as land_film_power_W or outer_max_pressure_MPa; repeatable.",
            "impact, whirl, loss, cage speed, temperatures",
            "--figure",
        ),
    ],
    overrides=Set,
    out=Annotated[Path | None, folder_option(STORE, "SCENE_uncertainty")],
    **RUNS,
    quiet=Quiet,
)
calibrate = command(
    "calibrate",
    "Identify the unknown inputs of a scene from measurements on a rig, and state whether it may be called calibrated.",
    "calibration",
    path=ScenePath,
    data=Annotated[
        Path,
        typer.Option(metavar="RIG.csv", help="Measurements, a row for each condition: scene keys, outputs, their _sd."),
    ],
    free=Annotated[Texts, valued("KEY", "Key to identify; repeatable.", "all unknown inputs", "--free")],
    overrides=Set,
    out=Annotated[Path | None, folder_option(STORE, "SCENE_calibration")],
    **RUNS,
    quiet=Quiet,
)
