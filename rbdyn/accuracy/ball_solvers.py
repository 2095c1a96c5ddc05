"""Solver of the equilibrium of one scene: residual against time.

It starts cold and stops after more and more iterations. Its residual is the largest of the full equations, over the largest
force of the scene. Times are the shortest of several runs of the whole call from Python, after a first that compiles.
``examples/benchmarks/ball_solvers.py`` compares it with others.
"""

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Sheet, Table, columns_of
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.records import Record, shown
from rbdyn.base.words import counted
from rbdyn.quasistatic import full_system
from rbdyn.quasistatic.row import equilibrium
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of
from rbdyn.quasistatic.row.ring import Row
from rbdyn.scene.ball import BallScene, SingleRowScene

# A residual below this is rounding.
ROUNDING = 1e-18
LIMITS = (1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 64, 128, 256, 512)
REPEATS = 5

Solver = Callable[..., Solution]
# The shipped solver; the limit counts Newton steps.
SHIPPED: dict[str, Solver] = {"convex": full_system.convex_with_limit}


class Problem(NamedTuple):
    """Input of a solver: ``solver(*problem)``; ``fixed`` displacements, NaN where free."""

    row: Row
    control: Control
    load: Array
    fixed: Array


class Attempt(Record):
    """One solver stopped after ``limit`` iterations: residual over the largest force, and time [us]."""

    solver: str = shown("solver")
    limit: int = shown("iterations at most")
    residual: float = shown("residual over largest force", ".1e")
    solve_us: float = shown("time [us]", ".0f")
    status: str


def study(scene: BallScene, progress: Reporter = None, limits: Sequence[int] = LIMITS) -> Report:
    """``rbdyn accuracy SCENE methods`` of a ball bearing. Raises InputError for two rows, RunError where there is no equilibrium."""
    if not isinstance(scene, SingleRowScene):
        raise InputError(f"bearing.kind = {scene.bearing.kind!r}: has no study of its solver; take one of its rows")
    attempts = work_precision(problem_of(scene), limits, Progress(progress, len(limits)))
    written = records(attempts)
    last = _until_solved(attempts)[-1]
    sentence = f"An equilibrium of this scene takes {last.solve_us:.0f} us in at most {counted(last.limit, 'step')}."
    return reported(
        "solvers",
        (attempts_table(attempts),),
        (sentence,),
        written,
        lambda path: draw(attempts, path),
        "rbdyn.accuracy.solvers/1",
        rows=written,
        conclusion=sentence,
    )


def attempts_table(attempts: Sequence[Attempt]) -> Table:
    """Table of the attempts of each solver up to the first that converges."""
    return Sheet("residual against time", columns_of(Attempt), _until_solved(attempts)).block


def problem_of(scene: SingleRowScene) -> Problem:
    """Problem of a scene."""
    row, control, *_ = row_of(scene)
    return Problem(row, control, load_of(scene), constraint_of(scene))


def work_precision(
    problem: Problem, limits: Sequence[int], progress: Progress, solvers: Mapping[str, Solver] = SHIPPED
) -> list[Attempt]:
    """Each solver stopped after each of ``limits`` iterations. Raises RunError where there is no equilibrium."""
    reference = equilibrium.solve(*problem)
    if not reference.is_equilibrium:
        raise RunError(f"there is nothing to compare: {reference.status}")
    scale = max(float(reference.inner_load.max()), float(reference.outer_load.max()), float(np.abs(problem.load).max()))
    attempts = []
    for name, solver in solvers.items():
        for limit in limits:
            solution, took = timed(solver, problem, REPEATS, limit=limit)
            attempts.append(Attempt(name, limit, solution.residual / scale, took, solution.status))
            progress.step()
    return attempts


def timed(solver: Solver, problem: Problem, repeats: int, **options: Any) -> tuple[Solution, float]:
    """Solution and shortest time [us] of ``repeats`` calls after a first."""
    solution = solver(*problem, **options)
    shortest = float("inf")
    for _ in range(repeats):
        began = time.perf_counter()
        solver(*problem, **options)
        shortest = min(shortest, time.perf_counter() - began)
    return solution, 1e6 * shortest


def _until_solved(attempts: Sequence[Attempt]) -> list[Attempt]:
    """Attempts of each solver up to the first that converges."""
    needed: list[Attempt] = []
    solved: set[str] = set()
    for attempt in attempts:
        if attempt.solver not in solved:
            needed.append(attempt)
        if attempt.status == "ok":
            solved.add(attempt.solver)
    return needed


def draw(attempts: Sequence[Attempt], path: Path) -> None:
    """Residual of each solver stopped after more and more iterations, against its time."""
    from matplotlib.ticker import LogLocator

    from rbdyn.plots.style import label_ends, logarithmic, method_lines, save, subplots

    figure, axis = subplots(figsize=(7.6, 5.0))
    logarithmic(axis, "residual over the largest force", "time of a call [us]")
    axis.xaxis.set_major_locator(LogLocator(base=100.0, numticks=12))
    lines: dict[str, list[tuple[float, float]]] = {}
    for a in _until_solved(attempts):
        lines.setdefault(a.solver, []).append((max(a.residual, ROUNDING), a.solve_us))
    ends, _ = method_lines(axis, lines)
    axis.margins(0.12)
    label_ends(axis, ends)
    save(figure, path)
