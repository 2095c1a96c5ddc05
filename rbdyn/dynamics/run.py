"""One replicate under way: integrator, memory, where it stands, and at which pace it goes on."""

import itertools
import logging
import math
import threading
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RunError
from rbdyn.base.forecast import LONG_S, Forecast, Measured, Notice, duration
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.equations import RollerBearing, mechanical_energy
from rbdyn.dynamics.forces.state import INNER_ANGLE, OUTER_ANGLE, name
from rbdyn.dynamics.integrators import records as at
from rbdyn.dynamics.integrators.advance import advance
from rbdyn.dynamics.integrators.method import EXPLICIT, cheaper_method, explicit_method, method_of
from rbdyn.dynamics.integrators.records import Control, Status, carry_from, empty_tally
from rbdyn.dynamics.parameters.state import absolute_tolerance, layout_of, scales, start_state
from rbdyn.scene import Scene

# Runs are looked at once they have been under way for this time [s], then at every doubling of it; the budget of steps of
# one run after this time of its own [s].
FIRST_LOOK_S, BUDGET_LOOK_S = 1.0, 10.0
# Scatter of the time of a shaft turn between runs of one scene, and between scenes of other speeds and loads.
ALIKE, UNLIKE = 0.1, 0.4
# A companion takes from so many to so many times the time of a run, by its tolerance and its longest step.
COMPANION = (0.6, 1.5)


def log(sentence: str) -> None:
    """A sentence as a warning of the logger "rbdyn", which Python writes to standard error unless stated otherwise."""
    logging.getLogger("rbdyn").warning(sentence)


@dataclass
class Pace:
    """Time that ``runs`` of so many shaft turns, then ``companions`` of them, take on so many threads, as those under way show it.

    ``growth``: how many times as long they may become; ``scatter``: relative standard deviation of a turn's time between runs.
    ``predicted``: time of all of it [s], the least and the most, once that was stated.
    """

    scene: Scene
    notice: Notice
    runs: int
    turns: float
    threads: int
    growth: float = 1.0
    companions: int = 0
    scatter: float = ALIKE
    predicted: tuple[float, float] | None = field(default=None, init=False)
    _under_way: dict[int, tuple[float, float]] = field(default_factory=dict, init=False)
    _tickets: "itertools.count[int]" = field(default_factory=itertools.count, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def __post_init__(self) -> None:
        self._look_s, self._spent_s, self._stated_s, self._short_of_steps = FIRST_LOOK_S, 0.0, 0.0, False

    def enter(self) -> int:
        """A number by which a run that begins is known."""
        return next(self._tickets)

    def look(self, run: int, spent_s: float, turns: float, steps: int, budget: int) -> None:
        """Look at a run that took so many seconds for so many shaft turns and steps, of which it has a budget.

        States what is left of all runs once, and again where they prove to take longer than the most that was stated.
        """
        if self.notice is None or turns <= 0.0:
            return
        sentences = []
        with self._lock:
            before_s, _ = self._under_way.get(run, (0.0, 0.0))
            self._under_way[run] = spent_s, turns
            self._spent_s += spent_s - before_s
            elapsed_s = self._spent_s / min(len(self._under_way), self.threads)
            if elapsed_s >= self._look_s:
                self._look_s = 2.0 * elapsed_s
                forecast, low_s = self._forecast(elapsed_s)
                if forecast.notable and forecast.runs[1] and low_s > self._stated_s:
                    low, high = (elapsed_s + each for each in forecast.seconds)
                    self.predicted = self.predicted or (low, max(high, elapsed_s + forecast.longest_s))
                    self._stated_s = max(high, elapsed_s + forecast.longest_s)
                    sentences.append(forecast.sentence)
            budget_s = spent_s / steps * budget
            short = spent_s >= BUDGET_LOOK_S and budget_s < spent_s / turns * self.turns
            if short and budget_s >= LONG_S and not self._short_of_steps:
                self._short_of_steps = True
                sentences.append(self._budget_sentence(budget_s))
        for sentence in sentences:
            self.notice(sentence)

    def _forecast(self, elapsed_s: float) -> tuple[Forecast, float]:
        """What is left, and the least time of all runs [s], those that have ended included."""
        counts, each = self.runs + self.companions, self._under_way.values()
        done = sum(turns for _, turns in each)
        # What a run was lengthened by is nothing that the others have made.
        asked = sum(min(turns, self.turns) for _, turns in each)
        gone_s = elapsed_s * asked / done
        ended = sum(turns >= self.turns * (1.0 - 1e-9) for _, turns in each)
        left, measured = max(counts - ended, 0), Measured(len(each), done, self._spent_s)
        first, rest = (math.ceil(number / self.threads) for number in (self.runs, self.companions))
        low, high = (
            factor * (measured.pace or 0.0) * self.turns * (first + companion * rest)
            for factor, companion in zip(measured.factors(left, self.scatter), COMPANION, strict=True)
        )
        seconds = max(low - gone_s, 0.0), max(high - gone_s, 0.0)
        longest_s = self.growth * high - elapsed_s if self.growth > 1.0 else 0.0
        turns = max(counts * self.turns - asked, 0.0)
        return Forecast((left, left), (turns, turns), seconds, self.threads, longest_s, remedy=self._remedy), low

    def _budget_sentence(self, budget_s: float) -> str:
        per_turn = self.scene.numerics.step_budget_per_turn
        spent = f"after about {duration(budget_s)} (numerics.step_budget_per_turn = {per_turn})"
        return f"runs will use up their budget of steps {spent} at this pace; {self._remedy} to shorten them"

    @property
    def _remedy(self) -> str:
        numerics = self.scene.numerics
        shorter = ["model.slices"] if self.scene.slices > 1 else []
        shorter += ["numerics.turns", *(["numerics.replicates"] if numerics.replicates > 1 else [])]
        return f"reduce {' or '.join([', '.join(shorter[:-1]), shorter[-1]] if shorter[1:] else shorter)}"


# Interruptions are looked for between so many steps: some hundredths of a second, of the implicit method half a one.
STEPS_AT_ONCE = 10_000
LARGEST_STEP_TURNS = 0.02
SMALLEST_STEP_TURNS = 1e-12


class Run:
    """One replicate under way: parameters, integrator memory and where it stands.

    ``longest_step`` [s] bounds the steps. ``method``: "auto" until its first step, where the scene
    leaves it open; ``spent_s``: time that its steps took; ``pace``: what states the time that this and its like take,
    by whose number, the ``ticket``, it knows the run.
    """

    def __init__(
        self,
        scene: Scene,
        bearing: RollerBearing,
        replicate: int,
        rtol: float,
        stop: Stop,
        pace: Pace | None = None,
        longest_step: float = math.inf,
    ) -> None:
        self.scene, self.bearing, self.replicate, self.stop = scene, bearing, replicate, stop
        self.pace, self.spent_s = pace, 0.0
        self.ticket = 0 if pace is None else pace.enter()
        self.rtol, self.longest_step = rtol, longest_step
        self.layout = layout_of(scene)
        seeds = np.random.SeedSequence(scene.numerics.seed, spawn_key=(replicate,))
        y = start_state(scene, bearing, np.random.default_rng(seeds))
        numerics = scene.numerics
        self.method: str = numerics.method
        self.explicit = explicit_method(numerics.method, numerics.rtol)
        allotted = self.explicit if self.method == "auto" else self.method
        first_step = 1e-3 * scales(scene).length / scales(scene).speed
        self.carry = carry_from(y, bearing.rollers, first_step, method_of(allotted, scene, bearing))
        self.tally = empty_tally()
        self.sample_step = scene.turn_s / numerics.samples_per_turn
        self.control = self._control_by(allotted)

    def choose_method(self) -> None:
        """Settle "auto" by a trial from where the run stands, which is left as it is."""
        if self.method != "auto":
            return
        memory = self.carry, self.tally, self.sample_step
        self.method, stiffness = cheaper_method(self.scene, self.bearing, self.explicit, self._control_by, *memory)
        if self.method == "rosenbrock":
            # The implicit method does not see what it overcomes.
            self.carry.stiffness[:] = stiffness
            self.carry = self.carry._replace(method=method_of(self.method, self.scene, self.bearing))
            self.control = self._control_by(self.method)._replace(step_budget=self.control.step_budget)

    def _control_by(self, method: str) -> Control:
        numerics = self.scene.numerics
        turns = numerics.turns + numerics.warm_up_turns
        return Control(
            1.0 / absolute_tolerance(self.scene, self.bearing, self.rtol, method),
            SMALLEST_STEP_TURNS * self.scene.turn_s,
            min(LARGEST_STEP_TURNS * self.scene.turn_s, self.longest_step),
            int(min(numerics.step_budget_per_turn * math.ceil(turns), 2**62)),
        )

    def allow(self, turns: float) -> None:
        """Let the budget of steps last for so many shaft turns since the start, at least."""
        budget = int(min(self.scene.numerics.step_budget_per_turn * math.ceil(turns), 2**62))
        self.control = self.control._replace(step_budget=max(self.control.step_budget, budget))

    def to(self, turns: float) -> None:
        """Advance to a time given in shaft turns since the start. Raises RunError or CancelledError."""
        started = time.perf_counter() - self.spent_s
        self.choose_method()
        budget, end = self.control.step_budget, turns * self.scene.turn_s
        while True:
            self.stop.check()
            short = self.control._replace(step_budget=min(self.steps + STEPS_AT_ONCE, budget))
            status = list(Status)[advance(self.bearing, short, self.carry, self.tally, end, self.sample_step)]
            self.spent_s = time.perf_counter() - started
            if self.pace is not None:
                turned = float(self.carry.clock[at.NOW]) / self.scene.turn_s
                self.pace.look(self.ticket, self.spent_s, turned, self.steps, budget)
            if status is Status.FINISHED:
                return
            if status is not Status.STEP_BUDGET or self.steps >= budget:
                raise RunError(self._why(status))

    @property
    def steps(self) -> int:
        """Steps made, the refused ones too."""
        return int(self.carry.counts[at.ACCEPTED] + self.carry.counts[at.REJECTED])

    def forget(self) -> None:
        """Start counting here: empty the tally and sample from now on."""
        for kept in self.tally:
            kept[:] = 0.0
        self.carry.clock[at.SAMPLE] = self.carry.clock[at.NOW]

    def clock_angles(self) -> Array:
        """Angles of inner and outer ring [rad] since the start."""
        clock = self.layout.clock
        if clock is None:
            return self.carry.clock[at.NOW] * np.array(self.scene.operation.speeds)
        return self.carry.y[clock + INNER_ANGLE : clock + OUTER_ANGLE + 1].copy()

    def _why(self, status: Status) -> str:
        time_s = self.carry.clock[at.NOW]
        message, remedy = status.value
        component, step = name(int(self.carry.counts[at.WORST]), self.layout), self.carry.clock[at.STEP]
        message = message.format(component=component, step=step, spent_s=self.spent_s, **self.control._asdict())
        explicit = status is Status.STEP_BUDGET and self.scene.numerics.method in EXPLICIT
        where = f"replicate {self.replicate + 1} (seed {self.scene.numerics.seed}) stopped at t = {time_s:.6g} s"
        why = f"shaft turn {time_s / self.scene.turn_s:.4g}: {message}"
        return f"{where}, {why}; {'take numerics.method = auto, ' if explicit else ''}{remedy}"


def with_numerics(scene: Scene, **changes: Any) -> Scene:
    """The scene with other numerics, which are not validated."""
    return scene.model_copy(update={"numerics": scene.numerics.model_copy(update=changes)})


def prepare(scene: Scene, bearing: RollerBearing) -> float:
    """Compile, or fetch from disk, what the scene needs; returns the seconds it took."""
    started = time.perf_counter()
    run = Run(scene, bearing, 0, scene.numerics.rtol, Stop())
    run.to(0.0)
    mechanical_energy(bearing, run.carry.y)
    return time.perf_counter() - started
