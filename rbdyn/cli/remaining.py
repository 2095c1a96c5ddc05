"""How long the rest of a row of runs takes, from when those before it ended. Loads nothing."""

import time
from bisect import bisect_left
from collections import deque
from collections.abc import Callable

# Ends that are looked back on: what a run takes may change on the way.
LOOK_BACK = 256
# A first report that comes within this time [s] tells of runs that were there before.
AT_ONCE_S = 0.2


class Remaining:
    """Time left of runs, so many ``workers`` at once, that take about equally long.

    As many run as there are workers, so a run began when the one as many places before it ended. The first ones, which also
    wait for what is compiled, count only until others have ended.
    """

    def __init__(self, workers: int = 1, clock: Callable[[], float] = time.monotonic) -> None:
        self._workers, self._clock = max(workers, 1), clock
        self._ends = deque([(0, clock())], maxlen=LOOK_BACK)
        self._total = 0

    def update(self, done: int, total: int) -> None:
        """So many of all runs have ended by now."""
        self._total, now = total, self._clock()
        last, since = self._ends[-1]
        if len(self._ends) == 1 and (done == last or now - since < AT_ONCE_S):
            self._ends[0] = done, now
        elif done > last:
            self._ends.append((done, now))

    @property
    def seconds(self) -> float | None:
        """Time left [s]; None until a second run has ended."""
        done = self._ends[-1][0]
        if self._total <= done:
            return 0.0 if self._total else None
        first, workers = self._ends[0][0], min(self._workers, self._total - self._ends[0][0])
        if done < first + 2:
            return None
        each = self._each(first, workers, done)
        left, now = self._total - done, self._clock()
        running = range(done + 1, done + min(workers, left) + 1)
        begun = [self._end(max(place - workers, first)) for place in running]
        # One that takes longer than the others may end at any time.
        free = sorted(max(start + each - now, 0.0) for start in begun)
        rounds, more = divmod(left - len(free), len(free))
        return max(time_free + each * (rounds + (place < more)) for place, time_free in enumerate(free))

    def _each(self, first: int, workers: int, done: int) -> float:
        """What a run takes, by those that began as another ended; before there are any, by all."""
        since = next(count for count, _ in self._ends if count >= min(first + workers, done))
        if since < done:
            starts, ends = (sum(self._end(place - back) for back in range(workers)) for place in (since, done))
            return (ends - starts) / (done - since)
        begin = self._ends[0][1]
        whole = sum(self._end(place) - begin for place in range(done - min(workers, done - first) + 1, done + 1))
        return whole / (done - first)

    def _end(self, place: int) -> float:
        """When the run at a place, from 1, ended; those before the first known one, when that was."""
        return self._ends[min(bisect_left(self._ends, place, key=lambda each: each[0]), len(self._ends) - 1)][1]


def clock_words(seconds: float | None) -> str:
    """Time left as h:mm:ss; dashes while it is not known."""
    if seconds is None:
        return "-:--:--"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"
