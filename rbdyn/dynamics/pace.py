"""How long runs take at their pace: stated early where that is long. No figure of a run depends on it."""

import logging
import math
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

from rbdyn.base.words import counted
from rbdyn.scene import Scene

# What is done with a sentence on the time that runs take; None where nobody asks.
Notice = Callable[[str], object] | None
# A run is looked at after this time [s] and then at every doubling; what all runs take is stated beyond LONG_S.
FIRST_LOOK_S, LONG_S = 10.0, 300.0


def log(sentence: str) -> None:
    """A sentence as a warning of the logger "rbdyn", which Python writes to standard error unless told otherwise."""
    logging.getLogger("rbdyn").warning(sentence)


@dataclass
class Pace:
    """Time that ``runs`` equal runs of so many shaft turns take on so many threads, as those under way show it.

    ``growth``: how many times as long they may become.
    """

    scene: Scene
    notice: Notice
    runs: int
    turns: float
    threads: int
    growth: float = 1.0
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def __post_init__(self) -> None:
        self._look_s, self._stated_s = FIRST_LOOK_S, 0.5 * LONG_S

    def look(self, spent_s: float, turns: float, steps: int, budget: int) -> None:
        """Look at a run that took so many seconds for so many shaft turns and steps, of which it has a budget.

        States the time of all runs where it is long, and again where it proves to be twice as long.
        """
        if self.notice is None or spent_s < self._look_s or turns <= 0.0:
            return
        with self._lock:
            if spent_s < self._look_s:
                return
            self._look_s = 2.0 * spent_s
            run_s, budget_s = spent_s / turns * self.turns, spent_s / steps * budget
            rounds = math.ceil(self.runs / self.threads)
            whole_s = rounds * min(run_s, budget_s)
            if whole_s < 2.0 * self._stated_s:
                return
            self._stated_s = whole_s
            sentence = self._sentence(whole_s, spent_s / turns, budget_s if budget_s < run_s else None)
        self.notice(sentence)

    def _sentence(self, whole_s: float, turn_s: float, budget_s: float | None) -> str:
        if budget_s is not None:
            per_turn = self.scene.numerics.step_budget_per_turn
            spent = f"after about {duration(budget_s)} (numerics.step_budget_per_turn = {per_turn})"
            return f"runs will use up their budget of steps {spent} at this pace; {self._remedy}"
        runs = f"{counted(self.runs, 'run')} of {counted(self.turns, 'shaft turn')} at {duration(turn_s)} each"
        longer = f", up to {self.growth:g} times that where figures drift" if self.growth > 1.0 else ""
        return f"all runs take about {duration(whole_s)} at this pace: {runs}, {self.threads} at once{longer}; {self._remedy}"

    @property
    def _remedy(self) -> str:
        numerics = self.scene.numerics
        shorter = ["model.slices"] if self.scene.slices > 1 else []
        shorter += ["numerics.turns", *(["numerics.replicates"] if numerics.replicates > 1 else [])]
        return f"reduce {' or '.join([', '.join(shorter[:-1]), shorter[-1]] if shorter[1:] else shorter)} to shorten it"


def duration(seconds: float) -> str:
    """A time in the unit that suits it, to two digits."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0)):
        if seconds >= 2.0 * size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{seconds:.2g} s"
