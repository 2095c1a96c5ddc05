"""A run to a target accuracy: tolerance, turns and replicates at least cost for a total error asked of three figures.

Pilots over a ladder of tolerances measure scatter of a turn, bias over tolerance, power gap and right-hand sides of a turn.
For each tolerance these give the turns that bring numerical plus statistical error of each figure below the target, and
their cost. The cheapest choice is run and judged by its own error bars. If they are too wide, its measurements update the
model, and a longer or tighter run follows. The choice counts right-hand sides, not seconds, so equal scenes choose equally on
any machine. The cost of the result includes pilots and earlier runs.
"""

import math
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import LONGEST_NAME, InputError, one_line
from rbdyn.base.notes import Note
from rbdyn.base.records import Record
from rbdyn.base.words import NORMAL, Notice, counted
from rbdyn.dynamics.ensemble import Reporter, Stop, plan_of, threads_of
from rbdyn.dynamics.figures import FIGURES
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_series
from rbdyn.dynamics.run import prepare, with_numerics
from rbdyn.dynamics.statistics.batch_means import estimate
from rbdyn.dynamics.statistics.error_bars import after_transient
from rbdyn.dynamics.statistics.metrics import bias_scale, companion_tolerance, mean_gap, work_done
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.result import Quantity, SimulationResult, TargetRun
from rbdyn.scene import Scene

AIMED = {figure.key: figure.statistic for figure in FIGURES if figure.judged == "target" and figure.statistic}
# Their bias is seen over the tolerance, that of the loss by the power balance.
SCATTERED = [figure.key for figure in FIGURES if figure.judged == "target" and not figure.balanced]
LARGEST_TARGET = 0.5

LADDER = (0.1, 0.03, 0.01, 0.003)
PILOT_REPLICATES, PILOT_WINDOWS, PILOT_TURNS = 8, 2, 40.0
TOLERANCES = (0.1, 0.05, 0.02, 0.01, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 1e-5, 1e-6)
# Replicates of the example differ however long they run, so more of them show more than longer ones. They are as short as
# possible with at most a sixth of the turns in transients.
FEWEST_REPLICATES, WARM_UPS = 4, 5.0
# A first short run may misjudge the scatter: the least and the largest factor of the length of the next run.
GROWTH = (1.2, 4.0)
# The plan aims below the target, since pilots give the scatter to a tenth or two.
MARGIN = 0.9
MOST_RUNS = 3
# Counted turns of one run at most: minutes.
MOST_TURNS = 100_000.0
# A difference that is all scatter and its standard error together, over its 95 % half-width: sqrt(2) / 1.96.
NOISY_DIFFERENCE = 0.722
# Costs that add up over runs; the others are those of the reported run.
ADDED = ("wall_s", "compile_s", "cpu_s", "steps", "rejected_steps", "rhs_evaluations", "turns")


def target_of(text: str) -> float:
    """``2%`` or ``0.02`` as a fraction. Raises InputError for anything else."""
    number, percent = (text.strip()[:-1], 0.01) if text.strip().endswith("%") else (text, 1.0)
    try:
        return valid_target(float(number) * percent, text)
    except ValueError:
        raise InputError(f"--target {text}: not a number; write it as 2% or 0.02") from None


def valid_target(target: float, text: str | None = None) -> float:
    """The target. Raises InputError unless it is a fraction above 0 and at most a half; ``text``: as it was written."""
    if isinstance(target, bool) or not isinstance(target, int | float):
        raise InputError(f"target = {one_line(repr(target), LONGEST_NAME)}: must be a number such as 0.02")
    if not 0.0 < target <= LARGEST_TARGET:
        limit = f"{100.0 * LARGEST_TARGET:g} %"
        raise InputError(
            f"--target {text or f'{target:g}'}: must be above 0 and at most {limit}; write it as 2% or 0.02"
        )
    return target


class Choice(NamedTuple):
    """Tolerance, turns and replicates of a run, and the right-hand sides that it should take."""

    rtol: float
    turns: float
    replicates: int
    rhs_evaluations: float

    def applied(self, scene: Scene) -> Scene:
        """The scene with this choice."""
        return with_numerics(scene, rtol=self.rtol, turns=self.turns, replicates=self.replicates, companion=True)


class Model(Record):
    """Errors and costs of a scene. Relative to the figures, by name: ``scatter``, standard error of the mean of one turn, and
    ``bias``, bound of the bias over rtol. ``ladder``: tolerances, falling, with their power gaps and right-hand sides a turn.
    """

    scatter: dict[str, float]
    bias: dict[str, float]
    ladder: Array
    gaps: Array
    rhs_per_turn: Array

    def cost(self, rtol: float) -> float:
        """Right-hand sides a turn."""
        return _along(rtol, self.ladder, self.rhs_per_turn)

    def systematic(self, name: str, rtol: float) -> float:
        """Part of the numerical error that a longer run does not reduce."""
        if name in SCATTERED:
            return self.bias[name] * rtol
        return _along(rtol, self.ladder, np.maximum(self.gaps, 1e-12))


def reach(
    scene: Scene,
    target: float,
    simulate: Callable[..., SimulationResult],
    workers: int | None = None,
    progress: Reporter = None,
    stop: Stop | None = None,
    notice: Notice = None,
) -> SimulationResult:
    """``simulate`` until the total relative 95 % error of impact force, whirl ratio and power loss is at most ``target``.

    It replaces tolerance, turns and replicates of the scene. ``target`` of the result states choice, errors and cost, and a
    note says where the target was not met; ``cost`` sums pilots and all runs. Raises InputError, RunError, KeyboardInterrupt.
    """
    valid_target(target)
    model, pilots = measure(scene, workers, progress, stop, notice)
    spent = Counter(pilots)
    shortest, longest = 0.0, MOST_TURNS
    runs, met = 0, False
    while runs < MOST_RUNS and not met and shortest < MOST_TURNS:
        runs += 1
        choice = choose(model, scene, MARGIN * target, shortest, longest)
        planned = choice.applied(scene)
        if notice is not None:
            notice(f"chosen: {plan_of(planned, threads_of(workers))}")
        result = simulate(planned, workers, progress, stop)
        spent.update({key: result.cost[key] for key in ADDED})
        errors = {name: total_error(result.figures[name]) for name in AIMED}
        met = all(error is not None and error <= target for error in errors.values())
        model = learned(model, scene, choice, result)
        shortest, longest = (min(factor * choice.turns * choice.replicates, MOST_TURNS) for factor in GROWTH)
    cost = (int(part["rhs_evaluations"]) for part in (spent, pilots))
    record = TargetRun(target, met, errors, choice.rtol, choice.turns, choice.replicates, runs, *cost)
    notes = result.notes if met else (*result.notes, _shortfall(target, errors, result, choice))
    return replace(result, cost=result.cost | dict(spent), target=record, notes=notes)


def total_error(figure: Quantity) -> float | None:
    """Stated error over the value; None where a part of it is unknown, 0 where both parts are zero."""
    if figure.statistical_error is None or figure.numerical_error is None:
        return None
    error = figure.error or 0.0
    if error == 0.0:
        return 0.0
    return error / abs(figure.value) if figure.value != 0.0 else None


def measure(
    scene: Scene, workers: int | None, progress: Reporter, stop: Stop | None, notice: Notice = None
) -> tuple[Model, dict[str, float]]:
    """Pilots over the ladder of tolerances: their model and their cost (``ADDED``). Raises RunError."""
    numerics = scene.numerics
    turns = max(PILOT_WINDOWS * numerics.impact_window_turns, PILOT_TURNS)
    pilot = with_numerics(scene, turns=turns, replicates=PILOT_REPLICATES)
    bearing = roller_bearing(pilot)
    compile_s = prepare(pilot, bearing)
    started = time.perf_counter()
    if notice is not None:
        runs = len(LADDER) * PILOT_REPLICATES
        notice(
            f"{counted(runs, 'pilot run')} of {turns + numerics.warm_up_turns:.4g} shaft turns choose the runs that follow"
        )
    series = run_series(pilot, bearing, LADDER, workers, progress, Stop(outer=stop), notice)
    wall_s = time.perf_counter() - started
    per_turn = PILOT_REPLICATES * (turns + scene.numerics.warm_up_turns)
    derivatives = [sum(run.derivatives for run in runs) for runs in series]
    spent = {
        "wall_s": wall_s,
        "compile_s": compile_s,
        **work_done([run for runs in series for run in runs]),
        "turns": per_turn * len(LADDER),
    }
    series = [after_transient(pilot, runs, [])[0] for runs in series]
    scatter = {name: _scatter(name, series, scene) for name in AIMED}
    model = Model(
        scatter=scatter,
        bias={name: _bias(name, series, scatter[name], PILOT_REPLICATES * turns) for name in SCATTERED},
        ladder=np.array(LADDER),
        gaps=np.array([mean_gap(runs) for runs in series]),
        rhs_per_turn=np.array(derivatives) / per_turn,
    )
    return model, spent


def choose(model: Model, scene: Scene, target: float, shortest: float = 0.0, longest: float = MOST_TURNS) -> Choice:
    """The cheapest choice that meets the target with counted turns, in all, between ``shortest`` and ``longest``.

    Where none does, the choice with the smallest error.
    """
    candidates = []
    for rtol in TOLERANCES:
        needed = max(turns_needed(model, scene, rtol, target), shortest)
        if needed <= longest:
            candidates.append(_choice(model, scene, rtol, needed))
    if candidates:
        return min(candidates, key=lambda choice: choice.rhs_evaluations)

    def worst(rtol: float) -> float:
        return max(predicted_error(model, scene, name, rtol, longest) for name in AIMED)

    return _choice(model, scene, min(TOLERANCES, key=worst), longest)


def turns_needed(model: Model, scene: Scene, rtol: float, target: float) -> float:
    """Counted turns, in all, that bring every figure within the target; infinite where its bias alone is larger."""
    needed = 0.0
    for name in AIMED:
        room = target**2 - model.systematic(name, rtol) ** 2
        noise = _noise_factor(scene, rtol) * NORMAL * model.scatter[name]
        needed = max(needed, noise**2 / room if room > 0.0 else math.inf)
    return needed


def predicted_error(model: Model, scene: Scene, name: str, rtol: float, turns: float) -> float:
    """Total relative error of a figure after so many counted turns in all."""
    noise = _noise_factor(scene, rtol) * NORMAL * model.scatter[name] / math.sqrt(turns)
    return math.hypot(model.systematic(name, rtol), noise)


def learned(model: Model, scene: Scene, choice: Choice, result: SimulationResult) -> Model:
    """The model after a run: scatter of the run instead of the pilots, and its bias where that exceeds the scatter."""
    turns = choice.turns * choice.replicates
    scatter, bias, gaps = dict(model.scatter), dict(model.bias), model.gaps
    for name in AIMED:
        figure = result.figures[name]
        statistical, numerical = figure.statistical_error, figure.numerical_error
        if statistical is None or numerical is None or figure.value == 0.0:
            continue
        size = abs(figure.value)
        scatter[name] = statistical / size * math.sqrt(turns) / NORMAL
        if numerical <= 2.0 * _companion_noise(scene, choice.rtol) * statistical:
            continue
        if name in SCATTERED:
            bias[name] = numerical / size / choice.rtol
        else:
            gaps = gaps * max(numerical / size / model.systematic(name, choice.rtol), 1.0)
    return replace(model, scatter=scatter, bias=bias, gaps=gaps)


def _choice(model: Model, scene: Scene, rtol: float, needed: float) -> Choice:
    """At least the counted turns needed, in whole impact windows of as many replicates as are worth their transients."""
    numerics, window = scene.numerics, scene.numerics.impact_window_turns
    shortest = max(WARM_UPS * numerics.warm_up_turns, PILOT_WINDOWS * window, PILOT_TURNS)
    replicates = max(math.ceil(needed / shortest), FEWEST_REPLICATES)
    fewest = max(PILOT_WINDOWS, math.ceil(PILOT_TURNS / window))
    turns = max(math.ceil(needed / replicates / window), fewest) * window
    companions = math.ceil(numerics.companion_share * replicates - 1e-9)
    cost = replicates * model.cost(rtol) + companions * model.cost(companion_tolerance(rtol))
    return Choice(rtol, turns, replicates, (turns + numerics.warm_up_turns) * cost)


def _noise_factor(scene: Scene, rtol: float) -> float:
    """Total over statistical error without a bias, where the difference from companions is noise."""
    return math.hypot(1.0, NOISY_DIFFERENCE * _companion_noise(scene, rtol))


def _companion_noise(scene: Scene, rtol: float) -> float:
    """Half-width of the bias from scatter alone, over the statistical error (``rbdyn.dynamics.statistics.metrics``)."""
    return bias_scale(rtol) * math.sqrt(1.0 + 1.0 / scene.numerics.companion_share)


def _scatter(name: str, series: Sequence[Sequence[Replicate]], scene: Scene) -> float:
    """Relative standard error of one turn, from the error bars of all pilots."""
    figure = AIMED[name]
    squares = []
    for runs in series:
        mean = estimate([figure.moments(run) for run in runs], figure.of_sums)
        turns = sum(run.duration for run in runs) / scene.turn_s
        if mean.half_width is not None and mean.value != 0.0:
            squares.append((mean.half_width / mean.value) ** 2 * turns)
    return math.sqrt(float(np.mean(squares))) / NORMAL if squares else 0.0


def _bias(name: str, series: Sequence[Sequence[Replicate]], scatter: float, turns: float) -> float:
    """Relative bias over rtol: slope of the figure over the tolerance where that exceeds its scatter, else 0.

    ``turns``: of all replicates of one pilot.
    """
    figure = AIMED[name]
    values = [estimate([figure.moments(run) for run in runs], figure.of_sums).value for runs in series]
    if values[-1] == 0.0:
        return 0.0
    relative, away = np.array(values) / values[-1], np.array(LADDER) - np.mean(LADDER)
    slope = float(away @ relative / (away @ away))
    half_width = NORMAL * scatter / math.sqrt(turns * float(away @ away))
    return abs(slope) if abs(slope) > half_width else 0.0


def _along(rtol: float, ladder: Array, values: Array) -> float:
    """Values over the tolerance by powers of it: interpolated, and extrapolated from the two nearest."""
    x, y = np.log(ladder[::-1]), np.log(values[::-1])
    place = math.log(rtol)
    if x[0] <= place <= x[-1]:
        return math.exp(float(np.interp(place, x, y)))
    end, inner = (0, 1) if place < x[0] else (-1, -2)
    slope = (y[end] - y[inner]) / (x[end] - x[inner])
    return math.exp(float(y[end] + slope * (place - x[end])))


def _shortfall(target: float, errors: dict[str, float | None], result: SimulationResult, choice: Choice) -> Note:
    """Note on the figure that missed the target most, and on what limits it."""
    unknown = [name for name, error in errors.items() if error is None]
    if unknown:
        return Note(
            "target", f"target: {100.0 * target:g} % is not met: the relative error of {', '.join(unknown)} is unknown"
        )
    worst = max(errors, key=lambda name: errors[name] or 0.0)
    figure = result.figures[worst]
    statistical, numerical = figure.statistical_error or 0.0, figure.numerical_error or 0.0
    if numerical > statistical:
        limit = f"its numerical error at numerics.rtol = {choice.rtol:g} limits it"
    else:
        limit = f"its scatter over {choice.replicates} replicates of {choice.turns:g} turns limits it"
    sentence = (
        f"target: {100.0 * target:g} % is not met. {worst} is known to {100.0 * (errors[worst] or 0.0):.2g} %, and {limit}. Ask "
        "for less, or run longer by numerics.turns and numerics.replicates"
    )
    return Note("target", sentence)
