"""Runs points: what the store has is read, the rest is run and stored as it ends; and what a command still has to run, noted in the store
while it goes on.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Self

from pydantic import TypeAdapter

from doe.running.store import Failure, Point, RunResult, Sound, Store
from rbdyn.base.forecast import Forecast, Measured


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


# Names of the notes in a store, each followed by the owner's token.
NOTE = "agenda "
# The last stage of every command, and the wall time [s] that the files of an answer take about.
ANSWER, ANSWER_S = "answer", 8.0


@dataclass
class Stage:
    """A part of a command: the ``runs`` that it makes as far as is known, their ``work`` (in shaft turns), how much of both
    is ``done``, and the wall time [s] that it takes besides. ``titles``: how the titles of its progress begin.

    ``fewest``, ``most``: runs that it makes at least and at most, None where these are ``runs``; ``announced``: runs that were
    asked for so far; ``stored``: runs that an earlier process has made of it.
    """

    name: str
    titles: tuple[str, ...] = ()
    runs: int = 0
    work: float = 0.0
    done: int = 0
    done_work: float = 0.0
    besides_s: float = 0.0
    # When it began [s since the epoch]; time [s] that runs of so much work took this process.
    since: float | None = None
    seconds: float = 0.0
    measured_work: float = 0.0
    fewest: int | None = None
    most: int | None = None
    announced: int = 0
    stored: int = 0

    @classmethod
    def of(
        cls, name: str, runs: int, work: float, *titles: str, fewest: int | None = None, most: int | None = None
    ) -> Self:
        """A stage of so many runs of so much work each; its titles begin with its name unless others are given."""
        return cls(name, titles or (name,), runs, runs * work, fewest=fewest, most=most)

    @property
    def each(self) -> float:
        """Work of a run."""
        return self.work / self.runs if self.runs else 0.0

    @property
    def left(self) -> tuple[int, int]:
        """Runs that are left, at least and at most."""
        ends = self.runs if self.fewest is None else self.fewest, max(self.runs, self.most or 0)
        low, high = (max(end, self.announced) - max(self.done, self.stored) for end in ends)
        return max(low, 0), max(high, 0)


@dataclass
class Agenda:
    """The stages of a command, which of them is under way, and what its runs took.

    ``command`` in words; ``options`` and ``inputs`` (a digest) identify what its answer is for, ``asked`` also by which runs;
    ``measured``: what runs took, of one thread each; ``crowd``: wall time over processor time, 1 on an idle machine; ``predicted``: wall time of the
    command from ``begin`` on [s], the least and the most, once that was predicted, and ``took_s`` what it was; ``files`` are
    the names of the answer's files once all are written; ``fault`` is what ended the command.
    """

    command: str
    options: dict[str, bool]
    inputs: str
    threads: int
    stages: list[Stage]
    begin: float = 0.0
    place: int = 0
    asked: str = ""
    measured: Measured = field(default_factory=Measured)
    crowd: float = 1.0
    predicted: tuple[float, float] | None = None
    took_s: float | None = None
    files: list[str] | None = None
    fault: str = ""

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read a note. Raises ValueError for what is none."""
        agenda = TypeAdapter(cls).validate_json(text, strict=True)
        if not 0 <= agenda.place < max(len(agenda.stages), 1):
            raise ValueError(agenda.place)
        return agenda

    @property
    def stage(self) -> Stage | None:
        """The stage under way; None before the first one."""
        return self.stages[self.place] if self.begin and self.stages and self.stages[self.place].since else None

    @property
    def runs_left(self) -> tuple[int, int]:
        """Runs that are left to the end, at least and at most."""
        ahead = [stage.left for stage in self.stages[self.place :]]
        return sum(low for low, _ in ahead), sum(high for _, high in ahead)

    def left(self) -> list[tuple[Stage, float]]:
        """The stage under way and those to come, each with the work that is left of it."""
        return [
            (stage, stage.work - max(stage.done_work, stage.stored * stage.each)) for stage in self.stages[self.place :]
        ]


def agendas_of(store: Store) -> list[tuple[Agenda, bool]]:
    """Agendas noted in a store, the newest last, and whether the process of each still lives."""
    agendas = []
    for text, alive in store.notes(NOTE):
        # What cannot be read shows nothing.
        with suppress(ValueError):
            agendas.append((Agenda.from_json(text), alive))
    return sorted(agendas, key=lambda each: each[0].begin)


# Scatter of the time of a unit of work between runs at other points: clearances and inputs decide how long figures drift.
SCATTER = 0.35
# What a stage takes besides its runs, at least and at most, over what it takes about.
BESIDES = (0.5, 2.0)


def forecast_of(agenda: Agenda, at_once: float, measured: Measured, growth: float = 1.0) -> Forecast | None:
    """What is left of an agenda with so many runs at once; None where nothing was measured and runs are left.

    ``growth``: how many times as long as those measured the runs may become, where these have not ended.
    """
    left = agenda.stages[agenda.place :]
    runs = agenda.runs_left
    turns = tuple(sum(stage.left[end] * stage.each for stage in left) for end in (0, 1))
    if measured.pace is None and runs[1]:
        return None
    pace, factors = measured.pace or 0.0, measured.factors(max(runs[0], 1), SCATTER)
    besides_s = agenda.crowd * sum(stage.besides_s for stage in left)
    ran_s = [pace * work * factor / at_once for work, factor in zip(turns, factors, strict=True)]
    low, high = (ran + besides_s * share for ran, share in zip(ran_s, BESIDES, strict=True))
    longest_s = high + (growth - 1.0) * ran_s[1] if growth > 1.0 else 0.0
    return Forecast(runs, (turns[0], turns[1]), (low, high), round(at_once), longest_s, steps=True)
