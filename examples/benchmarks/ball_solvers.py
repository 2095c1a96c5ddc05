"""Solvers of the equilibrium of one scene: residual against time, and how often each succeeds nearby.

``python examples/benchmarks/ball_solvers.py [SCENE.toml]``: the convex solver, plain Newton and the finite search of Hu et al.
2021 start cold and stop after more and more iterations, see ``rbdyn.accuracy.ball_solvers``. Then load and speed of the scene
vary at random, with a seed.
"""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
from plain_newton import plain_newton
from studies import main

from rbdyn.accuracy.ball_solvers import (
    LIMITS,
    SHIPPED,
    Attempt,
    Problem,
    Solver,
    attempts_table,
    draw,
    problem_of,
    timed,
    work_precision,
)
from rbdyn.accuracy.report import Progress, Report, Reporter, records, reported
from rbdyn.base.blocks import Column, Sheet, Table, columns_of
from rbdyn.base.records import Record, shown
from rbdyn.quasistatic import finite_search
from rbdyn.quasistatic.row import equilibrium
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.scene.ball import SingleRowScene

PERTURBATIONS = 200
SEED = 1
# Decades each way of each component of the load, and of the speed.
LOAD_DECADES, SPEED_DECADES = 1.0, 0.5
# The limit counts Newton steps, or iterations of all searches.
LIMITED: dict[str, Solver] = {**SHIPPED, "plain Newton": plain_newton, "finite search": finite_search.solve}
WHOLE: dict[str, Solver] = {**LIMITED, "convex": equilibrium.solve}


class Success(Record):
    """How a solver fares over many problems: share solved; median, 99 % and longest time [us]; median steps; causes."""

    solver: str
    problems: int = shown("scenes")
    solved: float = shown("solved", ".2f %")
    median_us: float = shown("median [us]", ".0f")
    slow_us: float = shown("99 % [us]", ".0f")
    longest_us: float = shown("longest [us]", ".0f")
    median_steps: float = shown("steps", ".0f")
    causes: dict[str, int]

    @property
    def interval(self) -> tuple[float, float]:
        """95 % interval of the share solved."""
        return share(round(self.solved * self.problems), self.problems)

    @property
    def shown_share(self) -> str:
        """The share solved with its interval, in words."""
        low, high = self.interval
        return f"{100.0 * self.solved:.2f} % ({100.0 * low:.1f} to {100.0 * high:.1f})"


def share(count: int, total: int) -> tuple[float, float]:
    """95 % interval of a share by ``count`` of ``total`` cases (Wilson 1927, J. Am. Stat. Assoc. 22, 209)."""
    z, observed = 1.96, count / total
    spread = math.sqrt(observed * (1.0 - observed) / total + (0.5 * z / total) ** 2)
    middle, scale = observed + 0.5 * z * z / total, 1.0 + z * z / total
    return max((middle - z * spread) / scale, 0.0), min((middle + z * spread) / scale, 1.0)


def study(
    scene: SingleRowScene, progress: Reporter = None, limits: Sequence[int] = LIMITS, perturbations: int = PERTURBATIONS
) -> Report:
    """The comparison as a report. Raises RunError where there is no equilibrium."""
    counted = Progress(progress, len(LIMITED) * (len(limits) + perturbations))
    attempts = work_precision(problem_of(scene), limits, counted, LIMITED)
    nearby = perturbed(scene, perturbations)
    rows = [_fared(name, solver, nearby, counted) for name, solver in WHOLE.items()]
    sentence, written = conclusion(attempts, rows), records(attempts)
    draws = {"count": perturbations, "seed": SEED, "load_decades": LOAD_DECADES, "speed_decades": SPEED_DECADES}
    return reported(
        "solvers",
        (attempts_table(attempts), success_table(f"{perturbations} seeded scenes nearby", rows)),
        (*causes(rows), sentence),
        written,
        lambda path: draw(attempts, path),
        "rbdyn.accuracy.solvers/1",
        rows=written,
        nearby=records(rows),
        perturbations=draws,
        conclusion=sentence,
    )


def perturbed(scene: SingleRowScene, count: int, seed: int = SEED) -> list[Problem]:
    """Problems of the scene with other loads and speeds: each component, and both speeds together, times 10^u."""
    draw = np.random.default_rng(seed)
    problems = []
    for _ in range(count):
        load = [part * 10.0 ** draw.uniform(-LOAD_DECADES, LOAD_DECADES) for part in scene.operation.load]
        moment = [part * 10.0 ** draw.uniform(-LOAD_DECADES, LOAD_DECADES) for part in scene.operation.moment]
        faster = 10.0 ** draw.uniform(-SPEED_DECADES, SPEED_DECADES)
        operation = scene.operation.model_copy(
            update={
                "radial_load_N": None,
                "axial_load_N": None,
                "load_N": load,
                "moment_Nm": moment,
                "preload_N": 0.0,
                "inner_speed_rpm": scene.operation.inner_speed_rpm * faster,
                "outer_speed_rpm": scene.operation.outer_speed_rpm * faster,
            }
        )
        problems.append(problem_of(scene.model_copy(update={"operation": operation})))
    return problems


def fared(name: str, solutions: Sequence[Solution], took_us: Sequence[float]) -> Success:
    """Summary of many solutions and their times [us]."""
    why = Counter(solution.status for solution in solutions if not solution.is_equilibrium)
    return Success(
        name,
        len(solutions),
        sum(solution.is_equilibrium for solution in solutions) / len(solutions),
        float(np.median(took_us)),
        float(np.percentile(took_us, 99.0)),
        float(np.max(took_us)),
        float(np.median([solution.steps for solution in solutions])),
        dict(why.most_common()),
    )


def success_table(title: str, rows: Sequence[Success], first: str = "solver") -> Table:
    """Table of how solvers fare."""
    return Sheet(title, (Column("solver", words=first, files=False), *columns_of(Success)), rows).block


def causes(rows: Sequence[Success]) -> list[str]:
    """A sentence for each solver that failed somewhere."""
    reasons = {row.solver: "; ".join(f"{count} x {why}" for why, count in row.causes.items()) for row in rows}
    return [f"{solver} failed: {whys}" for solver, whys in reasons.items() if whys]


def conclusion(attempts: Sequence[Attempt], rows: Sequence[Success]) -> str:
    """Which solver to take: the fastest of those whose share solved does not differ from the best."""
    reached: dict[str, float] = {}
    for attempt in attempts:
        if attempt.status == "ok":
            reached[attempt.solver] = min(attempt.solve_us, reached.get(attempt.solver, float("inf")))
    most_reliable = max(rows, key=lambda row: row.solved)
    alike = [row for row in rows if row.interval[1] >= most_reliable.interval[0]]
    best = min(alike, key=lambda row: row.median_us)
    rivals = ", ".join(f"{row.solver} {row.shown_share}" for row in alike if row is not best)
    times = ", ".join(f"{name} {took:.0f} us" for name, took in sorted(reached.items(), key=lambda it: it[1]))
    sentences = (
        f"To an equilibrium of this scene: {times or 'none'}. Take {best.solver}: it solves {best.shown_share} of "
        f"{best.problems} scenes nearby, half of them within {best.median_us:.0f} us"
    )
    return f"{sentences}; so many scenes do not separate its reliability from {rivals}." if rivals else f"{sentences}."


def _fared(name: str, solver: Solver, problems: Sequence[Problem], counted: Progress) -> Success:
    solutions, times = [], []
    for problem in problems:
        solution, took = timed(solver, problem, 1)
        solutions.append(solution)
        times.append(took)
        counted.step()
    return fared(name, solutions, times)


if __name__ == "__main__":
    raise SystemExit(main(study, __doc__, "angular_contact_ball.toml", perturbations=PERTURBATIONS))
