"""What runs still cost, predicted from those measured: runs, shaft turns and wall time, in one sentence for all commands."""

import math
from collections.abc import Callable
from typing import NamedTuple

from rbdyn.base.words import are, counted

# What is done with a sentence on the time that runs take; None where nobody asks.
Notice = Callable[[str], object] | None
# What ends sooner [s] needs no sentence; what takes longer than LONG_S one that says how to shorten it.
NOTABLE_S, LONG_S = 5.0, 300.0
# Scatter of the pace of runs that are alike is known as well as from so many degrees of freedom before any is measured.
PRIOR_FREEDOM = 4.0
# A run takes at least this time [s], by the resolution of clocks.
SHORTEST_S = 1e-6
# Standard deviations that a range reaches to each side.
REACH = 2.0


class Measured(NamedTuple):
    """Runs that were measured: how many, their work, their time [s], the mean logarithm of each one's pace, and the sum of the
    squared deviations from that mean."""

    number: int = 0
    work: float = 0.0
    seconds: float = 0.0
    logarithm: float = 0.0
    squares: float = 0.0

    def plus(self, work: float, seconds: float) -> "Measured":
        """With one more run (Welford's recurrence)."""
        number, one = self.number + 1, math.log(max(seconds, SHORTEST_S) / work)
        mean = self.logarithm + (one - self.logarithm) / number
        squares = self.squares + (one - self.logarithm) * (one - mean)
        return Measured(number, self.work + work, self.seconds + seconds, mean, squares)

    @property
    def pace(self) -> float | None:
        """Time of a unit of work [s]; None before anything was measured."""
        return self.seconds / self.work if self.work > 0.0 else None

    def factors(self, left: float, scatter: float) -> tuple[float, float]:
        """By which factors, at least and at most, so many runs that are left may take another time than the mean pace says;
        ``scatter``: standard deviation of the logarithm of a run's pace that is expected before any is measured."""
        freedom = PRIOR_FREEDOM + max(self.number - 1, 0)
        deviation = math.sqrt((PRIOR_FREEDOM * scatter**2 + self.squares) / freedom)
        half = REACH * deviation * math.sqrt(1.0 / max(self.number, 1) + 1.0 / max(left, 1.0))
        return math.exp(-half), math.exp(half)


class Forecast(NamedTuple):
    """What is left: runs, shaft turns and wall time [s], each the least and the most, and how many runs go at once.

    ``longest_s``: time where every run is lengthened as far as it may be, 0 where that is in the range; ``steps``: whether
    steps without runs are in the time; ``remedy``: what shortens it.
    """

    runs: tuple[int, int]
    turns: tuple[float, float]
    seconds: tuple[float, float]
    threads: int
    longest_s: float = 0.0
    steps: bool = False
    remedy: str = ""

    @property
    def notable(self) -> bool:
        """Whether it takes long enough for a sentence."""
        return max(self.seconds[1], self.longest_s) >= NOTABLE_S

    @property
    def sentence(self) -> str:
        """All of it in words."""
        steps = " with all steps to the report" if self.steps else ""
        longer = f", up to {duration(self.longest_s)} where figures drift" if self.longest_s > self.seconds[1] else ""
        long = max(self.seconds[1], self.longest_s) >= LONG_S
        remedy = f"; {self.remedy} to shorten it" if self.remedy and long else ""
        if not self.runs[1]:
            return f"no run is left; the steps to the report take {span(*self.seconds)}"
        low, high = self.runs
        runs = counted(high, "run") if low == high else f"{low} to {counted(high, 'run')}"
        return (
            f"{runs} of {_between(*self.turns)} shaft {'turn' if self.turns[1] == 1 else 'turns'} in all {are(high)} "
            f"left: {self.threads} at once, {'it takes' if high == 1 else 'they take'} "
            f"{span(*self.seconds)}{steps}{longer}{remedy}"
        )


def duration(seconds: float) -> str:
    """A time in the unit that suits it, to two digits."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0)):
        if seconds >= 2.0 * size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{seconds:.2g} s"


def span(low: float, high: float) -> str:
    """'12 to 15 s': two times, with one unit where both have the same; one where they look alike."""
    (number, unit), last = duration(low).split(" "), duration(high)
    if f"{number} {unit}" == last:
        return f"about {last}"
    return f"{number if last.endswith(f' {unit}') else f'{number} {unit}'} to {last}"


def _between(low: float, high: float) -> str:
    """Two counts, to three digits; one where they look alike."""
    first, last = (f"{float(f'{value:.3g}'):.0f}" if value >= 10.0 else f"{value:.3g}" for value in (low, high))
    return first if first == last else f"{first} to {last}"
