"""Runs points: what the store has is read, the rest is claimed, run, and stored as it ends.

Where points run is the business of an engine: threads of this process, or the workers of a cluster.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from doe.running.failure import Failure
from doe.running.store import Point, RunResult, Sound, Store

# What other processes have done is looked at as often as this [s].
POLL_S = 0.25


@dataclass(frozen=True)
class Ran:
    """A run that has ended: its result, or why it could not go on; where it ran unless in this process.

    One that was lost, not one that failed, leaves no trace in the store: the next resumption runs it.
    """

    result: dict[str, Any] | None
    cause: str | None
    seconds: float
    host: str | None = None
    pid: int | None = None
    lost: bool = False

    @property
    def why(self) -> str:
        """Why there is no result."""
        return self.cause or "no result"


Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Ledger:
    """Where an engine enters what becomes of points, in any thread but for ``give``.

    ``take`` claims points that begin at once, ``queue`` such as wait for a worker until they ``begin``; both return those that
    are ours to run. ``keep`` stores how a point has ended, ``give`` hands that over.
    """

    take: Callable[[Sequence[Point]], list[Point]]
    queue: Callable[[Sequence[Point]], list[Point]]
    begin: Callable[[Point], None]
    keep: Callable[[Point, Ran], None]
    give: Callable[[Point, Ran], None]


Engine = Callable[[Sequence[Point], Ledger], None]


def run_points(
    points: Sequence[Point], store: Store, engine: Engine, progress: Progress, sound: Sound, retry: bool = False
) -> dict[str, RunResult]:
    """Results and failures of points, by key. What other live processes are running is waited for, not run again.

    What is stored and not ``sound`` is run again; with ``retry`` also what failed. Raises RunError when the store cannot be
    written, KeyboardInterrupt on Ctrl-C; either way all finished runs stay stored and claims are given back.
    """
    wanted = {point.key: point for point in points}
    outcomes: dict[str, RunResult] = {}

    def take(free: Sequence[Point], queued: bool = False) -> list[Point]:
        mine = store.claim(free, sound, queued)
        return [point for point in free if point.key in mine]

    def keep(point: Point, ran: Ran) -> None:
        if ran.result is not None:
            store.put(point.key, ran.result, seconds=ran.seconds, host=ran.host, pid=ran.pid)
        elif not ran.lost:
            store.fail(point.key, ran.why, seconds=ran.seconds)

    def give(point: Point, ran: Ran) -> None:
        failure = Failure(point.label, ran.why, point.run, dict(point.factors))
        outcomes[point.key] = failure if ran.result is None else ran.result
        progress(len(outcomes), len(wanted))

    ledger = Ledger(take, partial(take, queued=True), lambda point: store.begin(point.key), keep, give)
    if retry:
        store.forget_failures(list(wanted.values()))
    try:
        while True:
            outcomes |= store.outcomes(_left(wanted, outcomes), sound)
            progress(len(outcomes), len(wanted))
            if not (left := _left(wanted, outcomes)):
                return outcomes
            taken = {claim.key for claim in store.claims()}
            if free := [point for point in left if point.key not in taken]:
                engine(free, ledger)
            else:
                time.sleep(POLL_S)
    finally:
        store.release()


def _left(wanted: dict[str, Point], outcomes: dict[str, RunResult]) -> list[Point]:
    return [point for key, point in wanted.items() if key not in outcomes]
