"""Every solver of the equilibrium over seeded random ball bearings: how many it solves, how fast.

8 to 32 balls of 3 to 40 mm, contact angles of 0 to 45 deg, D n up to 3e6 mm/min, loads over seven decades, clearance and
interference, standing and turning rings, every raceway control, tilt free and fixed. A case is kept as the tables of its
scene file; ``posed`` builds from them what a solver takes, past the validation that a file goes through. The scene of the
command gives materials, gyroscopic moment, friction limit and light load share. The slow solvers see only the first so many
cases. Times are of the second of two calls from Python, those of MINPACK's and the search's of one.

``python examples/benchmarks/ball_battery.py [SCENE.toml] [--scenes N]``
"""

import math
import sys
import time
from collections.abc import Callable, Sequence
from operator import attrgetter
from pathlib import Path
from typing import Any, NamedTuple

import minpack
import numpy as np
from ball_solvers import WHOLE, Success, causes, fared, success_table
from studies import main

from rbdyn.accuracy.ball_solvers import Problem, Solver
from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.base.blocks import Table
from rbdyn.properties.materials import MATERIALS, Material
from rbdyn.quasistatic.finite_search import loaded
from rbdyn.quasistatic.full_system import system_of, unknowns
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.quasistatic.row.model import row_model
from rbdyn.quasistatic.row.ring import component_lengths
from rbdyn.scene.ball import BallBearing, BallModel, BallScene
from rbdyn.scene.operation import BallOperation, Prescribed

CONTROLS = ("outer", "inner", "half", "hybrid", "common_cage")
LOADS = ("radial", "axial", "combined", "moment", "preload_force", "preload_displacement")
SCENES = 5000
SEED = 1
# Ranges; logarithmic where they span decades.
BALLS = (8, 32)
BALL_DIAMETER_MM = (3.0, 40.0)
CROWDING = (1.15, 1.6)  # pitch circle over the balls laid side by side
LARGEST_ANGLE_DEG = 45.0
GROOVE_FACTOR = (0.505, 0.54)
SPEED_FACTOR = (1e3, 3e6)  # pitch diameter [mm] times speed [rpm]
LOAD_DECADES = (-1.0, 6.0)  # log10 of N for the largest ball; others with the square of the diameter
CLEARANCE_CHANGE_UM = 40.0
PRELOAD_UM = (0.5, 50.0)
TILT_MRAD = 2.0
# Shares of the scenes.
DEEP_GROOVE, OUTER_TURNS, STANDING, FITTED, TILT_FIXED = 0.15, 0.3, 0.1, 0.5, 0.3


class Case(NamedTuple):
    """One scene: its number, its kind of load, and its tables as in a file."""

    number: int
    load: str
    bearing: dict[str, Any]
    operation: dict[str, Any]
    model: dict[str, Any]

    @property
    def control(self) -> str:
        """Raceway control."""
        return str(self.model["raceway_control"])


def cases(count: int = SCENES, seed: int = SEED, **model: Any) -> list[Case]:
    """The first ``count`` scenes of the battery of this seed; ``model``: keys of [model] besides the raceway control."""
    draw = np.random.default_rng(seed)
    return [_case(draw, number, model) for number in range(count)]


def posed(case: Case, ball: Material | None = None, rings: Material | None = None) -> Problem:
    """Row, control, load and prescribed displacements of a case; bearing steel unless told."""
    steel = MATERIALS["bearing_steel"]
    ball, rings = ball or steel, rings or steel
    prescribed = Prescribed.model_construct(**case.operation.get("prescribed", {}))
    operation = BallOperation.model_construct(**{**case.operation, "prescribed": prescribed})
    drawing, model = BallBearing.model_construct(**case.bearing), BallModel.model_construct(**case.model)
    built = row_model(drawing, model, ball, rings, rings, *operation.speeds)
    load, given = np.array([*operation.load, *operation.moment]), np.array(operation.displacements, float)
    return Problem(built.row, built.control, load, given)


def _case(draw: np.random.Generator, number: int, model: dict[str, Any]) -> Case:
    bearing = _bearing(draw)
    diameter, pitch = bearing["ball_diameter_mm"], bearing["pitch_diameter_mm"]
    force = 10.0 ** draw.uniform(*LOAD_DECADES) * (diameter / BALL_DIAMETER_MM[1]) ** 2
    kind = LOADS[int(draw.integers(len(LOADS)))]
    operation = {**_speeds(draw, pitch), **_load(draw, kind, float(force), 1e-3 * pitch), "tilt": "free"}
    if kind != "moment" and draw.random() < TILT_FIXED:
        operation["tilt"] = "fixed"
        if draw.random() < 0.5:
            tilt_x, tilt_y = (float(tilt) for tilt in draw.uniform(-TILT_MRAD, TILT_MRAD, 2))
            operation["prescribed"] = {"tilt_x_mrad": tilt_x, "tilt_y_mrad": tilt_y}
    return Case(number, kind, bearing, operation, {**model, "raceway_control": CONTROLS[number % len(CONTROLS)]})


def _bearing(draw: np.random.Generator) -> dict[str, Any]:
    balls = int(draw.integers(BALLS[0], BALLS[1] + 1))
    diameter = _log_uniform(draw, BALL_DIAMETER_MM)
    pitch = max(diameter * balls / math.pi * float(draw.uniform(*CROWDING)), 2.5 * diameter)
    deep = draw.random() < DEEP_GROOVE
    inner, outer = (float(factor) for factor in draw.uniform(*GROOVE_FACTOR, 2))
    bearing = {
        "kind": "deep_groove_ball" if deep else "angular_contact_ball",
        "balls": balls,
        "ball_diameter_mm": diameter,
        "pitch_diameter_mm": pitch,
        "contact_angle_deg": 0.0 if deep else float(draw.uniform(0.0, LARGEST_ANGLE_DEG)),
        "inner_groove_factor": inner,
        "outer_groove_factor": outer,
    }
    if draw.random() < FITTED:
        bearing["clearance_change_um"] = float(draw.uniform(-CLEARANCE_CHANGE_UM, CLEARANCE_CHANGE_UM))
    return bearing


def _speeds(draw: np.random.Generator, pitch_mm: float) -> dict[str, float]:
    inner = _log_uniform(draw, SPEED_FACTOR) / pitch_mm
    outer = float(draw.uniform(-1.0, 1.0)) * inner if draw.random() < OUTER_TURNS else 0.0
    if draw.random() < STANDING:
        inner, outer = 0.0, 0.0
    return {"inner_speed_rpm": inner, "outer_speed_rpm": outer}


def _load(draw: np.random.Generator, kind: str, force: float, pitch: float) -> dict[str, Any]:
    """Tables of a load of so many N on a bearing of this pitch diameter [m]."""
    way = float(draw.uniform(0.0, 2.0 * math.pi))
    across = 0.7 * force * math.cos(way), 0.7 * force * math.sin(way)
    if kind == "radial":
        return {"radial_load_N": force}
    if kind == "axial":
        return {"axial_load_N": force}
    if kind == "combined":
        return {"load_N": [*across, float(draw.uniform(0.1, 1.0)) * force]}
    if kind == "moment":
        moment = [float(part) for part in force * pitch * draw.uniform(-0.5, 0.5, 2)]
        return {"load_N": [0.5 * across[0], 0.5 * across[1], force], "moment_Nm": moment}
    if kind == "preload_force":
        return {"load_N": [*across, 0.0], "preload_N": float(draw.uniform(0.1, 1.0)) * force}
    return {"load_N": [*across, 0.0], "preload_um": _log_uniform(draw, PRELOAD_UM)}


def _log_uniform(draw: np.random.Generator, limits: tuple[float, float]) -> float:
    return float(math.exp(draw.uniform(math.log(limits[0]), math.log(limits[1]))))


SOLVERS: dict[str, Solver] = {**WHOLE, **minpack.SOLVERS}
# A tenth of a second and more for a scene they fail on.
SLOW = {"MINPACK LM": 500, "finite search": 500}
FAST = ("convex", "plain Newton")
OURS = "convex"
# What the battery takes of the scene's model.
MODEL = ("gyroscopic", "light_load_share", "friction_limit")
# Balls whose loads differ by more than this share of the largest are in another equilibrium.
SAME = 1e-6
_control, _kind_of_load = attrgetter("control"), attrgetter("load")


class Run(NamedTuple):
    """One solver on one case."""

    case: Case
    solver: str
    solution: Solution
    solve_us: float


def study(scene: BallScene, progress: Reporter = None, scenes: int = SCENES) -> Report:
    """The first ``scenes`` cases by every solver."""
    drawn = cases(scenes, SEED, **{key: getattr(scene.model, key) for key in MODEL})
    ball, rings = scene.material("ball"), scene.material("inner_ring")
    problems = [posed(case, ball, rings) for case in drawn]
    sizes = {name: min(SLOW.get(name, scenes), scenes) for name in SOLVERS}
    counted = Progress(progress, sum(sizes.values()))
    runs = {name: run(name, drawn[:size], problems, counted) for name, size in sizes.items()}
    ours = runs[OURS]
    by_control, by_load = _by_kind(ours, CONTROLS, _control), _by_kind(ours, LOADS, _kind_of_load)
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
            _share_table("solved by load", LOADS, runs, _kind_of_load),
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
    solver, runs = SOLVERS[name], []
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
        if r.solution.is_equilibrium and own.solution.is_equilibrium:
            gap = np.abs(r.solution.outer_load - own.solution.outer_load).max()
            count += bool(gap > SAME * own.solution.outer_load.max())
    return count


def _refused_by_rule_a(runs: Sequence[Run], problems: Sequence[Problem]) -> int:
    """Equilibria in which some deflection is not above 0."""
    count = 0
    for r, problem in zip(runs, problems, strict=False):
        if r.solution.is_equilibrium:
            system = system_of(problem.row, problem.load, problem.fixed)
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
        solved = [r.solution.is_equilibrium for r in series if kind_of(r.case) == kind]
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
    from rbdyn.plots.style import METHOD_COLOURS, Named, label_ends, plain, save, subplots

    figure, axis = subplots(figsize=(7.6, 5.0))
    axis.set(xscale="log", xlabel="time of a call [us]", ylim=(0.0, 103.0))
    axis.set_ylabel("share of scenes solved within it [%]")
    plain(axis)
    ends: list[Named] = []
    for (name, series), colour in zip(runs.items(), METHOD_COLOURS, strict=False):
        solved = np.sort([run.solve_us for run in series if run.solution.is_equilibrium])
        if solved.size:
            share = 100.0 * np.arange(1, solved.size + 1) / len(series)
            axis.step(solved, share, where="post", color=colour, linewidth=2.0 if colour == "black" else 1.2)
            ends.append(([(float(solved[0]), float(share[0])), (float(solved[-1]), float(share[-1]))], name, colour))
    axis.margins(x=0.15)
    label_ends(axis, ends)
    save(figure, path)


if __name__ == "__main__":
    sys.exit(main(study, __doc__, "angular_contact_ball.toml", scenes=SCENES))
