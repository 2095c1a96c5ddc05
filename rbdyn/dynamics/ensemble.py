"""Independent runs side by side, in threads since compiled code runs outside the GIL; and the pace at which they go on.

Which thread takes a run, and in which order runs end, changes nothing in them: every run has its own state and seed.
"""

import itertools
import logging
import math
import os
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from numbers import Integral
from typing import TYPE_CHECKING, Generic, TypeVar

from rbdyn.base.faults import LONGEST_NAME, InputError, RunError, given, one_line
from rbdyn.base.words import NOTABLE_S, Notice, counted, estimate

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
        return given(self.value)


def threads_of(workers: int | None) -> int:
    """Number of threads: as given, else all processors. Raises InputError unless it is a whole number from 1."""
    if workers is None:
        return os.cpu_count() or 1
    if isinstance(workers, bool) or not isinstance(workers, Integral) or workers < 1:
        value = one_line(repr(workers), LONGEST_NAME)
        raise InputError(f"workers = {value}: must be a whole number from 1; leave it out for all processors")
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
    first, waiting, places = deque[Callable[[], T]](), iter(runs), itertools.count()
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
        return first.popleft() if first else next(waiting, None)

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


# The time of the runs is estimated once they took this time [s], from the end of the first or, of slow ones, after EARLY_S.
LOOK_S, EARLY_S = 2.0, 20.0


def log(sentence: str) -> None:
    """A sentence as a warning of the logger "rbdyn", which Python writes to standard error by default."""
    logging.getLogger("rbdyn").warning(sentence)


@dataclass
class Pace:
    """One estimate of the time of planned runs, by those under way.

    ``turns``: shaft turns of the plan, which each of ``threads`` threads makes one after the other; ``first``: those of a first
    run. ``keys``: what shortens the plan. ``estimate_s``: estimated time of the whole plan [s], once stated.
    """

    notice: Notice
    turns: float
    first: float
    threads: int
    keys: Sequence[str] = ()
    estimate_s: float | None = field(default=None, init=False)
    _why: str = field(default="", init=False)
    _under_way: dict[int, tuple[float, float]] = field(default_factory=dict, init=False)
    _tickets: "itertools.count[int]" = field(default_factory=itertools.count, init=False)
    _lock: threading.Lock = field(default_factory=threading.Lock, init=False)

    def enter(self) -> int:
        """The number of a run that begins, by which ``look`` knows it."""
        return next(self._tickets)

    def lengthen(self, turns: float, length: float) -> None:
        """Add so many turns to the plan, whose runs get so long; they are estimated anew."""
        with self._lock:
            self.turns += turns
            if self.estimate_s is not None:
                self.estimate_s, self._why = None, f"results drift, so all runs continue to {length:.4g} shaft turns: "

    def look(self, run: int, spent_s: float, turns: float) -> None:
        """Look at a run that took so many seconds for so many shaft turns; the estimate is stated once there is a rest worth it."""
        if self.notice is None or turns <= 0.0:
            return
        with self._lock:
            self._under_way[run] = spent_s, turns
            if self.estimate_s is not None:
                return
            spent, made = (sum(part) for part in zip(*self._under_way.values(), strict=True))
            elapsed_s = spent / min(len(self._under_way), self.threads)
            ended = turns >= self.first * (1.0 - 1e-9)
            rest_s = spent / made * self.turns - elapsed_s
            if elapsed_s < (LOOK_S if ended else EARLY_S) or rest_s < NOTABLE_S:
                return
            self.estimate_s = elapsed_s + rest_s
        self.notice(f"{self._why}{estimate(rest_s, self.keys)}")


def in_turn(scene: "Scene", threads: int = 1, length: float | None = None) -> float:
    """Shaft turns of replicates and companions, by default of the scene's length, that each thread makes one after the other."""
    numerics = scene.numerics
    length = numerics.warm_up_turns + numerics.turns if length is None else length
    return length * (math.ceil(numerics.replicates / threads) + math.ceil(numerics.companions / threads))


def plan_of(scene: "Scene", threads: int, points: int = 1) -> str:
    """The runs of a scene at so many points, before they start."""
    numerics = scene.numerics
    heat = "" if scene.thermal is None else " after shorter ones for the temperatures"
    runs = counted(points * (numerics.replicates + numerics.companions), "run")
    return f"{runs} of {numerics.warm_up_turns + numerics.turns:.4g} shaft turns{heat}, {threads} at once"


def keys_of(scene: "Scene") -> list[str]:
    """Keys of a scene that make its runs shorter."""
    keys = ["model.slices"] if scene.slices > 1 else []
    return [*keys, "numerics.turns", *(["numerics.replicates"] if scene.numerics.replicates > 1 else [])]
