"""Runs points: what the store has is read, the rest is run and stored as it ends.

Where points run is the business of an engine: threads of this process, or the workers of a cluster.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from doe.running.failure import Failure
from doe.running.store import Point, RunResult, Sound, Store


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

    ``begin`` notes that a point is under way, ``keep`` stores how it has ended, ``give`` hands that over.
    """

    begin: Callable[[Point], None]
    keep: Callable[[Point, Ran], None]
    give: Callable[[Point, Ran], None]


Engine = Callable[[Sequence[Point], Ledger], None]


def run_points(
    points: Sequence[Point], store: Store, engine: Engine, progress: Progress, sound: Sound, retry: bool = False
) -> dict[str, RunResult]:
    """Results and failures of points, by key.

    What is stored and not ``sound`` is run again; with ``retry`` also what failed. Raises RunError when the store cannot be
    written, KeyboardInterrupt on Ctrl-C; either way all finished runs stay stored.
    """
    wanted = {point.key: point for point in points}
    outcomes: dict[str, RunResult] = {}

    def keep(point: Point, ran: Ran) -> None:
        if ran.result is not None:
            store.put(point.key, ran.result, seconds=ran.seconds, host=ran.host, pid=ran.pid)
        elif not ran.lost:
            store.fail(point.key, ran.why, seconds=ran.seconds)

    def give(point: Point, ran: Ran) -> None:
        failure = Failure(point.label, ran.why, point.run, dict(point.factors))
        outcomes[point.key] = failure if ran.result is None else ran.result
        progress(len(outcomes), len(wanted))

    if retry:
        store.forget_failures(points)
    outcomes |= store.outcomes(list(wanted.values()), sound)
    progress(len(outcomes), len(wanted))
    if missing := [point for key, point in wanted.items() if key not in outcomes]:
        try:
            engine(missing, Ledger(store.begin, keep, give))
        finally:
            store.release()
    return outcomes
