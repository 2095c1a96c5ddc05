"""Independent runs side by side: in threads, since compiled code runs outside the GIL.

Which thread takes a run, and in which order runs end, changes nothing in them: every run has its own state and seed.
"""

import os
import threading
from collections import deque
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from itertools import count
from typing import Generic, TypeVar

from rbdyn.base.faults import LONGEST_NAME, InputError, RunError, one_line

T = TypeVar("T")
# Given (done, total) as something goes on, where anybody asks.
Reporter = Callable[[int, int], None] | None

# Ctrl-C is looked for as often as this [s].
NAP_S = 0.2


class CancelledError(Exception):
    """The run was asked to stop."""


@dataclass
class Stop:
    """Shared wish to stop; runs look at it every few thousand steps. A stop within another heeds both."""

    outer: "Stop | None" = None
    event: threading.Event = field(default_factory=threading.Event)

    def check(self) -> None:
        """Raises CancelledError when a stop is wished."""
        if self.event.is_set():
            raise CancelledError
        if self.outer is not None:
            self.outer.check()


@dataclass(frozen=True)
class Ended(Generic[T]):
    """A run that has ended: its place among all, the run itself, and what it found or why it could not go on."""

    place: int
    run: Callable[[], T]
    found: T | None
    fault: RunError | None

    def result(self) -> T:
        """What it found. Raises RunError."""
        if self.fault is not None:
            raise self.fault
        assert self.found is not None
        return self.found


def threads_of(workers: int | None) -> int:
    """Number of threads: as given, else all processors. Raises InputError for what is no such number."""
    if workers is None:
        return os.cpu_count() or 1
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        what = f"workers = {one_line(repr(workers), LONGEST_NAME)}: must be a whole number from 1"
        raise InputError([f"{what}; leave it out for all processors"])
    return workers


def run_all(
    runs: Iterable[Callable[[], T]],
    workers: int | None,
    stop: Stop,
    ended: Callable[[Ended[T]], Iterable[Callable[[], T]] | None],
) -> None:
    """Run all on ``workers`` threads (all processors by default) and hand over each as it ends.

    ``runs`` is drawn from as threads become free; runs that ``ended`` returns come before the rest. Places count runs in
    the order in which they are drawn. Whatever is raised, by ``runs``, ``ended`` or Ctrl-C, stops the others
    at their next look at ``stop`` and is raised on; on Ctrl-C what has ended by then is handed over first.
    """
    workers = threads_of(workers)
    pool = ThreadPoolExecutor(workers)
    first, rest, places = deque[Callable[[], T]](), iter(runs), count()
    pending: dict[Future[T], tuple[int, Callable[[], T]]] = {}

    def hand_over(done: Iterable[Future[T]]) -> None:
        for future in sorted(done, key=lambda each: pending[each][0]):
            place, run = pending.pop(future)
            try:
                one = Ended(place, run, future.result(), None)
            except RunError as fault:
                one = Ended(place, run, None, fault)
            first.extend(ended(one) or ())

    def draw() -> Callable[[], T] | None:
        return first.popleft() if first else next(rest, None)

    try:
        while True:
            # One more than there are threads, so that none waits for the next run to be drawn.
            while len(pending) <= workers and (run := draw()) is not None:
                pending[pool.submit(run)] = next(places), run
            if not pending:
                break
            hand_over(wait(pending, timeout=NAP_S, return_when=FIRST_COMPLETED).done)
    except BaseException as error:
        stop.event.set()
        pool.shutdown(wait=True, cancel_futures=True)
        if isinstance(error, KeyboardInterrupt):
            hand_over([one for one in pending if not one.cancelled() and one.exception() is None])
        raise
    pool.shutdown()
