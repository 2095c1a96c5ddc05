"""How long the runs of a scene take, as those under way show it. No figure of a run depends on it."""

import itertools
import logging
import math
import threading
from dataclasses import dataclass, field

from rbdyn.records.forecast import LONG_S, Forecast, Measured, Notice, duration
from rbdyn.scene import Scene

# Runs are looked at once they have been under way for this time [s], then at every doubling of it; the budget of steps of
# one run after this time of its own [s].
FIRST_LOOK_S, BUDGET_LOOK_S = 1.0, 10.0
# Scatter of the time of a shaft turn between runs of one scene, and between scenes of other speeds and loads.
ALIKE, UNLIKE = 0.1, 0.4
# A companion takes from so many to so many times the time of a run, by its tolerance and its longest step.
COMPANION = (0.6, 1.5)


def log(sentence: str) -> None:
    """A sentence as a warning of the logger "rbdyn", which Python writes to standard error unless told otherwise."""
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
