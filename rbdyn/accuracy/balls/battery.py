"""Every solver over the battery of random scenes (``rbdyn.accuracy.balls.cases``): how many it solves, how fast.

The scene gives materials, gyroscopic moment, friction limit and light load share; all else is the battery's. The slow solvers see only the
first so many scenes. Times are of the second of two calls from Python, those of MINPACK's and the search's of one.
"""

import time
from collections.abc import Callable, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rbdyn.accuracy.balls.cases import CONTROLS, LOADS, SCENES, SEED, Case, Problem, cases, posed
from rbdyn.accuracy.balls.solvers import WHOLE, Success, causes, fared, success_table
from rbdyn.accuracy.report import Progress, Report, Reporter, Table, records, reported
from rbdyn.quasistatic.rivals.finite_search import loaded
from rbdyn.quasistatic.rivals.full_system import system_of, unknowns
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.quasistatic.row.ring import component_lengths
from rbdyn.scene.ball import BallScene

# A tenth of a second and more for a scene they fail on.
SLOW = {"MINPACK LM": 500, "finite search": 500}
FAST = ("convex", "plain Newton")
OURS = "convex"
# What the battery takes of the scene's model.
MODEL = ("gyroscopic", "light_load_share", "friction_limit")
# Balls whose loads differ by more than this share of the largest are in another equilibrium.
SAME = 1e-6
_control, _load = attrgetter("control"), attrgetter("load")


class Run(NamedTuple):
    """One solver on one case."""

    case: Case
    solver: str
    solution: Solution
    solve_us: float


def study(scene: BallScene, progress: Reporter = None, scenes: int = SCENES) -> Report:
    """``rbdyn accuracy --battery``, its first ``scenes`` scenes."""
    drawn = cases(scenes, SEED, **{key: getattr(scene.model, key) for key in MODEL})
    ball, rings = scene.material("ball"), scene.material("inner_ring")
    problems = [posed(case, ball, rings) for case in drawn]
    sizes = {name: min(SLOW.get(name, scenes), scenes) for name in WHOLE}
    counted = Progress(progress, sum(sizes.values()))
    runs = {name: run(name, drawn[:size], problems, counted) for name, size in sizes.items()}
    ours = runs[OURS]
    by_control, by_load = _by_kind(ours, CONTROLS, _control), _by_kind(ours, LOADS, _load)
    solvers = [_fared(name, series) for name, series in runs.items()]
    others = {name: _elsewhere(series, ours) for name, series in runs.items() if name != OURS}
    refused = _refused_by_rule_a(runs["finite search"], problems)
    fewer = [f"{name} on the first {size}" for name, size in sizes.items() if size < scenes]
    slow, sentence = f" ({', '.join(fewer)}: too slow for all)" if fewer else "", conclusion(solvers)
    return reported(
        "battery",
        (
            success_table("convex solver, by raceway control", by_control, "control"),
            success_table("convex solver, by load", by_load, "load"),
            _steps_table(ours),
            success_table(f"solvers on the same scenes{slow}", solvers),
            _share_table("solved by load", LOADS, runs, _load),
            _share_table("solved by raceway control", CONTROLS, runs, _control),
        ),
        (
            *causes(solvers),
            *(f"{name}: {count} of its equilibria are others than ours" for name, count in others.items() if count),
            f"rule a as printed refuses {refused} of the equilibria that the finite search found, for their unloaded balls",
            sentence,
        ),
        [_flat(r) for series in runs.values() for r in series],
        lambda path: _draw(runs, path),
        "rbdyn.accuracy.battery/1",
        scenes=scenes,
        seed=SEED,
        by_control=records(by_control),
        by_load=records(by_load),
        solvers=records(solvers),
        another_equilibrium=others,
        refused_by_rule_a=refused,
        conclusion=sentence,
    )


def run(name: str, drawn: Sequence[Case], problems: Sequence[Problem], counted: Progress) -> list[Run]:
    """One solver over cases; what compiles is compiled before."""
    solver, runs = WHOLE[name], []
    for problem in problems[: len(CONTROLS)]:
        solver(*problem)
    for case, problem in zip(drawn, problems, strict=False):
        if name in FAST:
            solver(*problem)
        began = time.perf_counter()
        solution = solver(*problem)
        runs.append(Run(case, name, solution, 1e6 * (time.perf_counter() - began)))
        counted.step()
    return runs


def conclusion(rows: Sequence[Success]) -> str:
    """Who solves most, and how the others compare."""
    best, *rest = sorted(rows, key=lambda row: -row.solved)
    others = ", ".join(f"{row.solver} {row.shown_share}" for row in rest)
    what = f"{best.solver} solves {best.shown_share} of {best.problems} random scenes"
    return f"{what}, half of them within {best.median_us:.0f} us; {others}; 95 % intervals."


def _fared(name: str, runs: Sequence[Run]) -> Success:
    return fared(name, [r.solution for r in runs], [r.solve_us for r in runs])


def _by_kind(runs: Sequence[Run], kinds: Sequence[str], kind_of: Callable[[Case], str]) -> list[Success]:
    """How the cases of each kind fared, of the kinds that were drawn."""
    groups = {kind: [r for r in runs if kind_of(r.case) == kind] for kind in kinds}
    return [_fared(kind, series) for kind, series in groups.items() if series]


def _elsewhere(runs: Sequence[Run], ours: Sequence[Run]) -> int:
    """Equilibria that differ from ours on the same scene."""
    count = 0
    for r, own in zip(runs, ours, strict=False):
        if r.solution.found and own.solution.found:
            gap = np.abs(r.solution.outer_load - own.solution.outer_load).max()
            count += bool(gap > SAME * own.solution.outer_load.max())
    return count


def _refused_by_rule_a(runs: Sequence[Run], problems: Sequence[Problem]) -> int:
    """Equilibria in which some deflection is not above 0."""
    count = 0
    for r, problem in zip(runs, problems, strict=False):
        if r.solution.found:
            system = system_of(problem.row, problem.load, problem.given)
            q = r.solution.displacement * component_lengths(problem.row.lever)
            count += not loaded(system, unknowns(system, q, r.solution.balls))
    return count


def _steps_table(runs: Sequence[Run]) -> Table:
    """Newton steps of the convex solver and its continuations, by control."""
    cells = []
    for control in CONTROLS:
        own = [r.solution for r in runs if r.case.control == control]
        if steps := [solution.steps for solution in own]:
            share = f"{np.median(steps):.0f}", f"{np.percentile(steps, 99.0):.0f}", f"{max(steps)}"
            cells.append((control, *share, f"{sum(solution.strides > 0 for solution in own)}"))
    return Table("Newton steps of the convex solver", ("control", "median", "99 %", "most", "continued"), cells)


def _share_table(title: str, kinds: Sequence[str], runs: dict[str, list[Run]], kind_of: Callable[[Case], str]) -> Table:
    """Share that each solver solves of the scenes of each kind."""

    def share(series: list[Run], kind: str) -> str:
        solved = [r.solution.found for r in series if kind_of(r.case) == kind]
        return f"{100.0 * np.mean(solved):.1f} %" if solved else ""

    return Table(title, ("", *runs), [[kind, *(share(series, kind) for series in runs.values())] for kind in kinds])


def _flat(of: Run) -> dict[str, Any]:
    """One line of the sheet."""
    case, solution = of.case, of.solution
    return {
        "scene": case.number,
        "control": case.control,
        "load": case.load,
        "solver": of.solver,
        "status": solution.status,
        "solve_us": of.solve_us,
        "steps": solution.steps,
        "searches": solution.searches,
        "residual_N": solution.residual,
    }


def _draw(runs: dict[str, list[Run]], path: Path) -> None:
    """Share of the scenes that each solver has solved within a time [us]."""
    from rbdyn.accuracy.rollers.pictures import METHOD_COLOURS, Named
    from rbdyn.plots.style import label_ends, plain, plt, save

    figure, axis = plt.subplots(figsize=(7.6, 5.0))
    axis.set(xscale="log", xlabel="time of a call [us]", ylim=(0.0, 103.0))
    axis.set_ylabel("share of scenes solved within it [%]")
    plain(axis)
    ends: list[Named] = []
    for (name, series), colour in zip(runs.items(), METHOD_COLOURS, strict=False):
        solved = np.sort([run.solve_us for run in series if run.solution.found])
        if solved.size:
            share = 100.0 * np.arange(1, solved.size + 1) / len(series)
            axis.step(solved, share, where="post", color=colour, linewidth=2.0 if colour == "black" else 1.2)
            ends.append(([(float(solved[0]), float(share[0])), (float(solved[-1]), float(share[-1]))], name, colour))
    axis.margins(x=0.15)
    label_ends(axis, ends)
    save(figure, path)
