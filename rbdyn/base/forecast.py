"""Cost of the runs that remain, predicted from finished ones: runs, shaft turns and wall time, and the time left meanwhile."""

import math
import time
from bisect import bisect_left
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from rbdyn.base.words import counted

# Function that takes a sentence on the run time; None where it is not reported.
Notice = Callable[[str], object] | None
# A shorter time [s] needs no sentence; a time above LONG_S needs a sentence that names the remedy.
NOTABLE_S, LONG_S = 5.0, 300.0
# Weight of the expected scatter of the pace before any run is measured, in degrees of freedom.
PRIOR_FREEDOM = 4.0
# Least time of a run [s]: the resolution of clocks.
SHORTEST_S = 1e-6
# Half-width of a range of times, in standard deviations.
REACH = 2.0
# Ends of runs that the time left looks back on: the pace may change on the way.
LOOK_BACK = 256
# A first report within this time [s] counts runs of an earlier command.
AT_ONCE_S = 0.2


def named(notice: Notice, name: str) -> Notice:
    """A notice whose sentences begin with the name of one of several simulations."""
    return None if notice is None else lambda sentence: notice(f"{name}: {sentence}")


def part_of(progress: Callable[[int, int], None] | None, place: int, count: int) -> Callable[[int, int], None] | None:
    """Progress of one of ``count`` simulations as that of all, where each has as many runs."""
    return None if progress is None else lambda done, total: progress(place * total + done, count * total)


class Measured(NamedTuple):
    """Measured runs: their number, work and time [s], the mean logarithm of their pace and the sum of its squared deviations."""

    number: int = 0
    work: float = 0.0
    seconds: float = 0.0
    logarithm: float = 0.0
    squares: float = 0.0

    def plus(self, work: float, seconds: float) -> "Measured":
        """The record with one more run (Welford's recurrence)."""
        number, logarithm = self.number + 1, math.log(max(seconds, SHORTEST_S) / work)
        mean = self.logarithm + (logarithm - self.logarithm) / number
        squares = self.squares + (logarithm - self.logarithm) * (logarithm - mean)
        return Measured(number, self.work + work, self.seconds + seconds, mean, squares)

    @property
    def pace(self) -> float | None:
        """Time of a unit of work [s]; None before the first run."""
        return self.seconds / self.work if self.work > 0.0 else None

    def factors(self, runs: float, scatter: float) -> tuple[float, float]:
        """Smallest and largest ratio of the time of so many further ``runs`` to the time by the mean pace.

        ``scatter``: expected standard deviation of the logarithm of a run's pace before any run is measured.
        """
        freedom = PRIOR_FREEDOM + max(self.number - 1, 0)
        deviation = math.sqrt((PRIOR_FREEDOM * scatter**2 + self.squares) / freedom)
        half = REACH * deviation * math.sqrt(1.0 / max(self.number, 1) + 1.0 / max(runs, 1.0))
        return math.exp(-half), math.exp(half)


class Forecast(NamedTuple):
    """Remaining runs, shaft turns and wall time [s], each as least and most, and the number of runs at once.

    ``longest_s``: time where every run is extended to its limit, 0 where the range covers it. ``steps``: whether the time
    includes steps without runs. ``remedy``: how to shorten it.
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
        """Whether the time deserves a sentence."""
        return max(self.seconds[1], self.longest_s) >= NOTABLE_S

    def whole_s(self, elapsed_s: float) -> tuple[float, float]:
        """Least and most time [s] from the start to the end, ``elapsed_s`` after the start."""
        return elapsed_s + self.seconds[0], elapsed_s + max(self.seconds[1], self.longest_s)

    @property
    def sentence(self) -> str:
        """The forecast in words."""
        if not self.runs[1]:
            return f"no run remains; the steps to the report take {span(*self.seconds)}"
        low, high = self.runs
        runs = counted(high, "run") if low == high else f"{low} to {counted(high, 'run')}"
        turns = f"{_count_range(*self.turns)} shaft {'turn' if self.turns[1] == 1 else 'turns'}"
        steps = " with all steps to the report" if self.steps else ""
        longest = f", up to {duration(self.longest_s)} if figures drift" if self.longest_s > self.seconds[1] else ""
        long = max(self.seconds[1], self.longest_s) >= LONG_S
        remedy = f"; {self.remedy} to shorten it" if self.remedy and long else ""
        verb = "remains" if high == 1 else "remain"
        return f"{runs} of {turns} in all {verb}, {self.threads} at once: {span(*self.seconds)}{steps}{longest}{remedy}"


def duration(seconds: float) -> str:
    """A time to two digits in a suitable unit."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0)):
        if seconds >= 2.0 * size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{seconds:.2g} s"


def span(low: float, high: float) -> str:
    """'12 to 15 s': two times with a common unit written once; one where both round to the same."""
    (number, unit), last = duration(low).split(" "), duration(high)
    if f"{number} {unit}" == last:
        return f"about {last}"
    return f"{number if last.endswith(f' {unit}') else f'{number} {unit}'} to {last}"


def _count_range(low: float, high: float) -> str:
    """'120 to 480': two counts to three digits, one where both round to the same."""
    first, last = (f"{float(f'{value:.3g}'):.0f}" if value >= 10.0 else f"{value:.3g}" for value in (low, high))
    return first if first == last else f"{first} to {last}"


class Remaining:
    """Time left of runs of about equal length, so many ``workers`` at once.

    As many run as there are workers, so a run began when the one as many places before it ended. The first ones, which also
    wait for compilation, count only until others have ended.
    """

    def __init__(self, workers: int = 1, clock: Callable[[], float] = time.monotonic) -> None:
        self._workers, self._clock = max(workers, 1), clock
        self._ends = deque([(0, clock())], maxlen=LOOK_BACK)
        self._total = 0

    def update(self, count: int, total: int) -> None:
        """Record how many of all runs have ended by now."""
        self._total, now = total, self._clock()
        last, since = self._ends[-1]
        if len(self._ends) == 1 and (count == last or now - since < AT_ONCE_S):
            self._ends[0] = count, now
        elif count > last:
            self._ends.append((count, now))

    @property
    def seconds(self) -> float | None:
        """Time left [s]; None until a second run has ended."""
        last = self._ends[-1][0]
        if self._total <= last:
            return 0.0 if self._total else None
        first, workers = self._ends[0][0], min(self._workers, self._total - self._ends[0][0])
        if last < first + 2:
            return None
        duration = self._duration(first, workers, last)
        remaining, now = self._total - last, self._clock()
        running = range(last + 1, last + min(workers, remaining) + 1)
        starts = [self._end(max(place - workers, first)) for place in running]
        # A run that takes longer than the others may end at any time.
        free = sorted(max(start + duration - now, 0.0) for start in starts)
        rounds, more = divmod(remaining - len(free), len(free))
        return max(time_free + duration * (rounds + (place < more)) for place, time_free in enumerate(free))

    def _duration(self, first: int, workers: int, last: int) -> float:
        """Duration of a run [s], from the runs that began as another ended; before there are any, from all."""
        since = next(place for place, _ in self._ends if place >= min(first + workers, last))
        if since < last:
            starts, ends = (sum(self._end(place - back) for back in range(workers)) for place in (since, last))
            return (ends - starts) / (last - since)
        begin = self._ends[0][1]
        whole = sum(self._end(place) - begin for place in range(last - min(workers, last - first) + 1, last + 1))
        return whole / (last - first)

    def _end(self, place: int) -> float:
        """Time [s] at which the run at a place, from 1, ended; for runs before the first recorded end, that end."""
        return self._ends[min(bisect_left(self._ends, place, key=lambda end: end[0]), len(self._ends) - 1)][1]


def clock_words(seconds: float | None) -> str:
    """Time left as h:mm:ss; dashes before it can be estimated."""
    if seconds is None:
        return "-:--:--"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"
