"""Independent runs side by side, in threads since compiled code runs outside the GIL; and the pace at which they go on.

Which thread takes a run, and in which order runs end, changes nothing in them: every run has its own state and seed.
"""

import itertools
import logging
import math
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from numbers import Integral
from typing import TYPE_CHECKING, Generic, TypeVar

from rbdyn.base.faults import LONGEST_NAME, InputError, RunError, one_line
from rbdyn.base.forecast import LONG_S, Forecast, Measured, Notice, duration

if TYPE_CHECKING:
    from rbdyn.scene import Scene

T = TypeVar("T")
# Called with (runs that ended, all runs) as they go on; None for nobody.
Reporter = Callable[[int, int], None] | None

# Time between two looks for Ctrl-C [s].
NAP_S = 0.2


class CancelledError(Exception):
    """The run was asked to stop."""


@dataclass
class Stop:
    """A request to stop that runs share; they look at it every few thousand steps. One with an ``outer`` heeds both."""

    outer: "Stop | None" = None
    event: threading.Event = field(default_factory=threading.Event)

    def check(self) -> None:
        """Raises CancelledError once a stop is requested."""
        if self.event.is_set():
            raise CancelledError
        if self.outer is not None:
            self.outer.check()


@dataclass(frozen=True)
class Outcome(Generic[T]):
    """How a run ended: its place among all, the run itself, and the value it returned or why it could not go on."""

    place: int
    run: Callable[[], T]
    value: T | None
    fault: RunError | None

    def result(self) -> T:
        """The value. Raises RunError."""
        if self.fault is not None:
            raise self.fault
        assert self.value is not None
        return self.value


def threads_of(workers: int | None) -> int:
    """Number of threads: as given, else all processors. Raises InputError unless it is a whole number from 1."""
    if workers is None:
        return os.cpu_count() or 1
    if isinstance(workers, bool) or not isinstance(workers, Integral) or workers < 1:
        value = one_line(repr(workers), LONGEST_NAME)
        raise InputError([f"workers = {value}: must be a whole number from 1; leave it out for all processors"])
    return int(workers)


def run_all(
    runs: Iterable[Callable[[], T]],
    workers: int | None,
    stop: Stop,
    collect: Callable[[Outcome[T]], Iterable[Callable[[], T]] | None],
) -> None:
    """Run all on ``workers`` threads (all processors by default) and hand the outcome of each to ``collect``.

    Threads that become free take the next of ``runs``; runs that ``collect`` returns come first. Places count runs in
    that order. What ``runs`` or ``collect`` raises, or Ctrl-C, stops the others at their next look at ``stop`` and is
    raised again. On Ctrl-C the runs that have ended by then are handed over first.
    """
    workers = threads_of(workers)
    pool = ThreadPoolExecutor(workers)
    first, rest, places = deque[Callable[[], T]](), iter(runs), itertools.count()
    pending: dict[Future[T], tuple[int, Callable[[], T]]] = {}

    def hand_over(futures: Iterable[Future[T]]) -> None:
        for future in sorted(futures, key=lambda future: pending[future][0]):
            place, run = pending.pop(future)
            try:
                outcome = Outcome(place, run, future.result(), None)
            except RunError as fault:
                outcome = Outcome(place, run, None, fault)
            first.extend(collect(outcome) or ())

    def next_run() -> Callable[[], T] | None:
        return first.popleft() if first else next(rest, None)

    try:
        while True:
            # One more than there are threads, so that none waits for its next run.
            while len(pending) <= workers and (run := next_run()) is not None:
                pending[pool.submit(run)] = next(places), run
            if not pending:
                break
            hand_over(wait(pending, timeout=NAP_S, return_when=FIRST_COMPLETED).done)
    except BaseException as error:
        stop.event.set()
        pool.shutdown(wait=True, cancel_futures=True)
        if isinstance(error, KeyboardInterrupt):
            hand_over([future for future in pending if not future.cancelled() and future.exception() is None])
        raise
    pool.shutdown()


# Runs are looked at after this time under way [s], then at every doubling of it; the budget of steps of one run after
# this time of its own [s].
FIRST_LOOK_S, BUDGET_LOOK_S = 1.0, 10.0
# Scatter of the time of a shaft turn between runs of one scene, and between scenes of other speeds and loads.
ALIKE, UNLIKE = 0.1, 0.4
# A companion takes from so many to so many times the time of a run, by its tolerance and its longest step.
COMPANION = (0.6, 1.5)


def log(sentence: str) -> None:
    """A sentence as a warning of the logger "rbdyn", which Python writes to standard error by default."""
    logging.getLogger("rbdyn").warning(sentence)


@dataclass
class Pace:
    """Time that ``runs`` of so many shaft turns take on so many threads, then ``companions``, as shown by those under way.

    ``growth``: how many times as long they may become; ``scatter``: relative standard deviation of a turn's time between
    runs. ``prediction``: least and most time of all of it [s], as stated first.
    """

    scene: "Scene"
    notice: Notice
    runs: int
    turns: float
    threads: int
    growth: float = 1.0
    companions: int = 0
    scatter: float = ALIKE
    prediction: tuple[float, float] | None = field(default=None, init=False)
    _under_way: dict[int, tuple[float, float]] = field(default_factory=dict, init=False)
    _tickets: "itertools.count[int]" = field(default_factory=itertools.count, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def __post_init__(self) -> None:
        self._look_s, self._spent_s, self._stated_s, self._short_of_steps = FIRST_LOOK_S, 0.0, 0.0, False

    def enter(self) -> int:
        """The number of a run that begins, by which ``look`` knows it."""
        return next(self._tickets)

    def look(self, run: int, spent_s: float, turns: float, steps: int, budget: int) -> None:
        """Look at a run that took so many seconds for so many shaft turns and steps, of which it has a budget.

        The time of all runs is stated once, and again where they prove to take longer than the most that was stated.
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
                forecast, least_s = self._forecast(elapsed_s)
                if forecast.notable and forecast.runs[1] and least_s > self._stated_s:
                    whole_s = forecast.whole_s(elapsed_s)
                    self.prediction, self._stated_s = self.prediction or whole_s, whole_s[1]
                    sentences.append(forecast.sentence)
            budget_s = spent_s / steps * budget
            short = spent_s >= BUDGET_LOOK_S and budget_s < spent_s / turns * self.turns
            if short and budget_s >= LONG_S and not self._short_of_steps:
                self._short_of_steps = True
                sentences.append(self._budget_sentence(budget_s))
        for sentence in sentences:
            self.notice(sentence)

    def _forecast(self, elapsed_s: float) -> tuple[Forecast, float]:
        """What is to come, and the least time of all runs [s], those that have ended included."""
        count, turns_run = self.runs + self.companions, [turns for _, turns in self._under_way.values()]
        total = sum(turns_run)
        # Turns by which a run was lengthened are no progress of the others.
        planned = sum(min(turns, self.turns) for turns in turns_run)
        progress_s = elapsed_s * planned / total
        ended = sum(turns >= self.turns * (1.0 - 1e-9) for turns in turns_run)
        to_come, measured = max(count - ended, 0), Measured(len(turns_run), total, self._spent_s)
        first, rest = (math.ceil(number / self.threads) for number in (self.runs, self.companions))
        low, high = (
            factor * (measured.pace or 0.0) * self.turns * (first + companion * rest)
            for factor, companion in zip(measured.factors(to_come, self.scatter), COMPANION, strict=True)
        )
        seconds = max(low - progress_s, 0.0), max(high - progress_s, 0.0)
        longest_s = self.growth * high - elapsed_s if self.growth > 1.0 else 0.0
        turns = max(count * self.turns - planned, 0.0)
        return Forecast((to_come, to_come), (turns, turns), seconds, self.threads, longest_s, remedy=self._remedy), low

    def _budget_sentence(self, budget_s: float) -> str:
        per_turn = self.scene.numerics.step_budget_per_turn
        return (
            f"runs will use up their budget of steps after about {duration(budget_s)} (numerics.step_budget_per_turn = "
            f"{per_turn}) at this pace; {self._remedy} to shorten them"
        )

    @property
    def _remedy(self) -> str:
        keys = ["model.slices"] if self.scene.slices > 1 else []
        keys += ["numerics.turns", *(["numerics.replicates"] if self.scene.numerics.replicates > 1 else [])]
        return f"reduce {' or '.join([', '.join(keys[:-1]), keys[-1]] if keys[1:] else keys)}"
