"""Runs of points, and the agenda of a command: its stages, what its runs took, and what is left.

Results in the store are read; the other points run on an engine, and each is stored as it ends. A live process keeps its
agenda as a note in the store, and states early how long the command will take.
"""

import json
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Self

from pydantic import TypeAdapter

from doe.running.store import Failure, Point, RunResult, Sound, Store
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.forecast import Forecast, Measured, Notice


@dataclass(frozen=True)
class RunOutcome:
    """The outcome of a run: its result or the cause of its failure, and where it ran, if not in this process.

    A lost run, unlike a failed one, is not stored: the next resumption runs it.
    """

    result: dict[str, Any] | None
    cause: str | None
    seconds: float
    host: str | None = None
    pid: int | None = None
    lost: bool = False

    @property
    def why(self) -> str:
        """The cause of a missing result."""
        return self.cause or "no result"


Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Ledger:
    """Entries of an engine on its points: ``begin`` notes a start, ``keep`` stores an outcome, ``give`` hands it over.

    All but ``give`` may be called in any thread.
    """

    begin: Callable[[Point], None]
    keep: Callable[[Point, RunOutcome], None]
    give: Callable[[Point, RunOutcome], None]


Engine = Callable[[Sequence[Point], Ledger], None]


def run_points(
    points: Sequence[Point], store: Store, engine: Engine, progress: Progress, sound: Sound, retry: bool = False
) -> dict[str, RunResult]:
    """Results and failures of points, by key.

    Stored results that are not ``sound`` run again, with ``retry`` also failures. Raises RunError if the store cannot be
    written, KeyboardInterrupt on Ctrl-C; finished runs stay stored.
    """
    points_by_key = {point.key: point for point in points}
    outcomes: dict[str, RunResult] = {}

    def keep(point: Point, outcome: RunOutcome) -> None:
        if outcome.result is not None:
            store.put(point.key, outcome.result, seconds=outcome.seconds, host=outcome.host, pid=outcome.pid)
        elif not outcome.lost:
            store.fail(point.key, outcome.why, seconds=outcome.seconds)

    def give(point: Point, outcome: RunOutcome) -> None:
        failure = Failure(point.label, outcome.why, point.run, dict(point.factors))
        outcomes[point.key] = failure if outcome.result is None else outcome.result
        progress(len(outcomes), len(points_by_key))

    if retry:
        store.forget_failures(points)
    outcomes |= store.outcomes(list(points_by_key.values()), sound)
    progress(len(outcomes), len(points_by_key))
    if missing := [point for key, point in points_by_key.items() if key not in outcomes]:
        try:
            engine(missing, Ledger(store.begin, keep, give))
        finally:
            store.release()
    return outcomes


# Kind of the notes of agendas in a store.
NOTE = "agenda "
# The last stage of every command, and the typical wall time [s] of its files.
ANSWER, ANSWER_S = "answer", 8.0


@dataclass
class Stage:
    """A stage of a command: its expected ``runs``, their ``work`` (shaft turns), and the finished part of both.

    ``titles``: beginnings of the titles of its progress. ``besides_s``: wall time [s] apart from its runs. ``fewest``,
    ``most``: runs at least and at most, None for ``runs``. ``announced_runs``: runs asked for so far. ``stored_runs``: runs
    by an earlier process. ``since``: when it began [s since the epoch]. ``seconds``: time [s] of ``measured_work`` in this
    process.
    """

    name: str
    titles: tuple[str, ...] = ()
    runs: int = 0
    work: float = 0.0
    finished_runs: int = 0
    finished_work: float = 0.0
    besides_s: float = 0.0
    since: float | None = None
    seconds: float = 0.0
    measured_work: float = 0.0
    fewest: int | None = None
    most: int | None = None
    announced_runs: int = 0
    stored_runs: int = 0

    @classmethod
    def of(
        cls, name: str, runs: int, work: float, *titles: str, fewest: int | None = None, most: int | None = None
    ) -> Self:
        """A stage of ``runs`` runs of ``work`` each; its titles begin with its name by default."""
        return cls(name, titles or (name,), runs, runs * work, fewest=fewest, most=most)

    @property
    def work_per_run(self) -> float:
        """Work of a run."""
        return self.work / self.runs if self.runs else 0.0

    @property
    def runs_left(self) -> tuple[int, int]:
        """Runs left, at least and at most."""
        ends = self.runs if self.fewest is None else self.fewest, max(self.runs, self.most or 0)
        low, high = (max(end, self.announced_runs) - max(self.finished_runs, self.stored_runs) for end in ends)
        return max(low, 0), max(high, 0)


@dataclass
class Agenda:
    """The stages of a command, which of them is under way, and what its runs took.

    ``command``: its name. ``options`` and ``inputs`` (a digest) identify the answer, ``question`` (a digest) also its runs.
    ``place``: the stage under way. ``measured``: times of runs on one thread. ``crowd``: wall time over processor time, 1 on
    an idle machine.

    ``prediction_s``: least and largest wall time [s] of the command from ``begin`` on, None before the prediction;
    ``took_s``: its wall time at the end. ``files``: names of the answer's files, once written. ``fault``: what ended the
    command.
    """

    command: str
    options: dict[str, bool]
    inputs: str
    threads: int
    stages: list[Stage]
    begin: float = 0.0
    place: int = 0
    question: str = ""
    measured: Measured = field(default_factory=Measured)
    crowd: float = 1.0
    prediction_s: tuple[float, float] | None = None
    took_s: float | None = None
    files: list[str] | None = None
    fault: str = ""

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Read a note. Raises ValueError for any other text."""
        agenda = TypeAdapter(cls).validate_json(text, strict=True)
        if not 0 <= agenda.place < max(len(agenda.stages), 1):
            raise ValueError(agenda.place)
        return agenda

    @property
    def stage(self) -> Stage | None:
        """The stage under way; None before the first."""
        return self.stages[self.place] if self.begin and self.stages and self.stages[self.place].since else None

    @property
    def runs_left(self) -> tuple[int, int]:
        """Runs left to the end, at least and at most."""
        ranges = [stage.runs_left for stage in self.stages[self.place :]]
        return sum(low for low, _ in ranges), sum(high for _, high in ranges)

    def stages_left(self) -> list[tuple[Stage, float]]:
        """The stage under way and those to come, each with the work left of it."""
        return [
            (stage, stage.work - max(stage.finished_work, stage.stored_runs * stage.work_per_run))
            for stage in self.stages[self.place :]
        ]


def agendas_of(store: Store) -> list[tuple[Agenda, bool]]:
    """Agendas noted in a store, the newest last, and whether the process of each still lives."""
    agendas = []
    for text, alive in store.notes(NOTE):
        # A spoilt note is skipped.
        with suppress(ValueError):
            agendas.append((Agenda.from_json(text), alive))
    return sorted(agendas, key=lambda pair: pair[0].begin)


# Scatter of the time of a unit of work between points, whose clearances and inputs decide how long figures drift.
SCATTER = 0.35
# Least and largest time of a stage apart from its runs, over the typical one.
BESIDES = (0.5, 2.0)


def forecast_of(agenda: Agenda, at_once: float, measured: Measured, growth: float = 1.0) -> Forecast | None:
    """Forecast of what is left of an agenda with ``at_once`` runs at once; None if runs are left and none was measured.

    ``growth``: factor by which runs that have not ended may become longer than measured.
    """
    stages = agenda.stages[agenda.place :]
    runs = agenda.runs_left
    turns = tuple(sum(stage.runs_left[end] * stage.work_per_run for stage in stages) for end in (0, 1))
    if measured.pace is None and runs[1]:
        return None
    pace, factors = measured.pace or 0.0, measured.factors(max(runs[0], 1), SCATTER)
    besides_s = agenda.crowd * sum(stage.besides_s for stage in stages)
    ran_s = [pace * work * factor / at_once for work, factor in zip(turns, factors, strict=True)]
    low, high = (ran + besides_s * share for ran, share in zip(ran_s, BESIDES, strict=True))
    longest_s = high + (growth - 1.0) * ran_s[1] if growth > 1.0 else 0.0
    return Forecast(runs, (turns[0], turns[1]), (low, high), round(at_once), longest_s, steps=True)


# The prediction is stated after this many ended runs, or after this time [s] by the runs under way.
ENOUGH, LOOK_S = 2, 5.0
# Largest crowd: runs that take longer wait for something else than a processor.
MOST_CROWD = 10.0


@dataclass
class AgendaKeeper:
    """Keeper of the agenda of a live process: it notes every change in the store at ``path``, once stages are planned.

    ``notice``: receiver of the sentence with the prediction.
    """

    path: Path
    agenda: Agenda
    notice: Notice = None
    _store: Store | None = None
    _keys: dict[int, dict[str, float]] = field(default_factory=dict)
    _under_way: dict[str, tuple[float, float]] = field(default_factory=dict)
    _works: Mapping[str, float] = field(default_factory=dict)
    _stated_s: float = 0.0
    _growth: float = 1.0
    _cluster: bool = False
    # Wall and processor time [s] at which the engine began, and how many processors it has work for; None between engines.
    _engine_since: tuple[float, float, int] | None = None
    _shared: float = 1.0
    _lock: threading.RLock = field(default_factory=threading.RLock)
    _began: float = field(default_factory=time.monotonic)

    @property
    def elapsed_s(self) -> float:
        """Wall time [s] of the command so far, whatever the clock was set to meanwhile."""
        return time.monotonic() - self._began

    def plan(self, stages: Sequence[Stage]) -> None:
        """Plan the stages, after all checks and before anything runs. Raises as ``Store``.

        The agenda replaces those of ended processes. It inherits their pace, and for the same question the number of runs
        of each stage.
        """
        self.agenda.stages = list(stages)
        if self._store is None:
            self._store = Store(self.path)
            if earlier := agendas_of(self._store):
                self._take_over(earlier[-1][0])
            self._store.sign(NOTE)
        self._note()

    def state_first(self, measured: Measured) -> Forecast | None:
        """State what is left before anything runs, by ``measured`` turns of its kind or the pace of an earlier command.

        Returns the forecast, with the time from the start of the command on; None where no pace is known.
        """
        with self._lock:
            pace = self.agenda.measured if self.agenda.measured.number else measured
            forecast = forecast_of(self.agenda, float(self.agenda.threads), pace) if self.agenda.stages else None
            if forecast is None or not forecast.runs[1]:
                return forecast
            self.agenda.prediction_s = forecast.whole_s(self.elapsed_s)
            self._stated_s = self.agenda.prediction_s[1]
            self._note()
        if self.notice is not None:
            self.notice(forecast.sentence)
        return forecast._replace(seconds=self.agenda.prediction_s)

    def _take_over(self, earlier: Agenda) -> None:
        self.agenda.measured, self.agenda.crowd = earlier.measured, earlier.crowd
        if earlier.question != self.agenda.question:
            return
        runs_made = {stage.name: max(stage.finished_runs, stage.stored_runs) for stage in earlier.stages}
        for stage in self.agenda.stages:
            stage.stored_runs = runs_made.get(stage.name, 0)

    def announced(self, progress: Callable[[str], Progress]) -> Callable[[str], Progress]:
        """The same progress of stages by title, which also enters each stage in the agenda."""

        def announce(title: str) -> Progress:
            names = [place for place, stage in enumerate(self.agenda.stages) if title.startswith(stage.titles)]
            places_ahead = [place for place in names if place >= self.agenda.place]
            if places_ahead:
                self._enter(places_ahead[0])
            return progress(title)

        return announce

    def enter(self, name: str) -> None:
        """Enter the stage of that name; the rest of earlier stages is not needed."""
        self._enter([stage.name for stage in self.agenda.stages].index(name))

    def _enter(self, place: int) -> None:
        stage = self.agenda.stages[place]
        self.agenda.place, stage.since = place, stage.since or time.time()
        self._note()

    def counting(self, works: Mapping[str, float], progress: Progress) -> Progress:
        """The same progress of runs with ``works`` by key, which also counts them in the stage under way."""
        agenda, place = self.agenda, self.agenda.place
        if not agenda.stages:
            return progress
        stage, stage_works = agenda.stages[place], self._keys.setdefault(place, {})
        new_works = {key: work for key, work in works.items() if key not in stage_works}
        earlier_runs, earlier_work, repeats = stage.finished_runs, stage.finished_work, len(works) - len(new_works)
        stage_works.update(new_works)
        stage.runs, stage.work = max(stage.runs, len(stage_works)), max(stage.work, sum(stage_works.values()))
        stage.announced_runs = len(stage_works)

        def count(number: int, total: int) -> None:
            new_runs = max(number - repeats, 0)
            stage.finished_runs = earlier_runs + new_runs
            stage.finished_work = earlier_work + (
                sum(new_works.values()) * new_runs / len(new_works) if new_works else 0.0
            )
            self._note()
            if agenda.measured.number >= ENOUGH:
                self._state(agenda.measured)
            progress(number, total)

        return count

    def timed(self, engine: Engine, works: Mapping[str, float], growth: float = 1.0, cluster: bool = False) -> Engine:
        """The same engine, of threads or of a ``cluster``, which also measures its runs.

        ``growth``: factor by which runs may become longer than planned.
        """
        agenda, place = self.agenda, self.agenda.place
        self._works, self._growth, self._cluster = works, growth, cluster

        def run(points: Sequence[Point], ledger: Ledger) -> None:
            # Threads without a point of their own share those of the others.
            shared = self._shared = 1.0 if cluster else max(agenda.threads / len(points), 1.0)
            busy = min(agenda.threads, len(points), os.cpu_count() or 1)
            self._engine_since = time.perf_counter(), time.process_time(), busy

            def end(point: Point, outcome: RunOutcome) -> None:
                with self._lock:
                    self._under_way.pop(point.key, None)
                    if outcome.result is not None:
                        seconds = shared * outcome.seconds
                        agenda.measured = agenda.measured.plus(works[point.key], seconds)
                        if agenda.stages:
                            agenda.stages[place].measured_work += works[point.key]
                            agenda.stages[place].seconds += seconds
                ledger.give(point, outcome)

            engine(points, replace(ledger, give=end))
            with self._lock:
                self._look_about()
                self._engine_since = None

        return run

    def hear(self, key: str, share: float, seconds: float) -> None:
        """Note that a run under way has made a ``share`` of its work in ``seconds``; called in any thread."""
        with self._lock:
            self._under_way[key] = share * self._works[key], self._shared * seconds
            start = self._engine_since
            if self.agenda.prediction_s or start is None or time.perf_counter() - start[0] < LOOK_S:
                return
            measured, growth = self.agenda.measured, 1.0
            if not measured.number:
                growth = self._growth
                for work, spent in self._under_way.values():
                    measured = measured.plus(work, spent)
            self._state(measured, growth)

    def _state(self, measured: Measured, growth: float = 1.0) -> None:
        """State the prediction once, and again if the command takes longer than the stated maximum."""
        with self._lock:
            self._look_about()
            forecast = forecast_of(self.agenda, self._at_once, measured, growth) if self.agenda.stages else None
            if forecast is None or not forecast.notable:
                return
            whole_s = forecast.whole_s(self.elapsed_s)
            if whole_s[0] <= self._stated_s:
                return
            self._stated_s = whole_s[1]
            self.agenda.prediction_s = self.agenda.prediction_s or whole_s
            self._note()
        if self.notice is not None:
            self.notice(forecast.sentence)

    def _look_about(self) -> None:
        """Measure by the runs under way how busy the machine is with other work."""
        if self._engine_since is None or self._cluster:
            return
        wall, processor, busy = self._engine_since
        spent, used = time.perf_counter() - wall, time.process_time() - processor
        if spent >= 1.0 and used > 0.0:
            self.agenda.crowd = min(max(spent * busy / used, 1.0), MOST_CROWD)

    @property
    def _at_once(self) -> float:
        """Number of runs at once: threads, or the current runs of a cluster."""
        if not self._cluster or self._store is None:
            return float(self.agenda.threads)
        return float(max(len(self._store.running()), 1))

    def finish(self, files: Sequence[str]) -> None:
        """Note that all files of the answer are written."""
        self.agenda.files, self.agenda.took_s = list(files), self.elapsed_s
        self._note()

    def fail(self, fault: str) -> None:
        """Note that the command ends without an answer."""
        self.agenda.fault = fault
        self._note()

    def close(self) -> None:
        """Close the store."""
        if self._store is not None:
            self._store.close()

    def _note(self) -> None:
        with self._lock:
            if self._store is not None:
                self._store.note(NOTE, json.dumps(asdict(self.agenda)))


@contextmanager
def agenda_in(
    path: Path,
    command: str,
    threads: int,
    options: Mapping[str, bool] | None = None,
    inputs: str = "",
    notice: Notice = None,
    question: str = "",
) -> Iterator[AgendaKeeper]:
    """An agenda in the store at ``path`` for as long as the command runs; its stages are planned later."""
    agenda = Agenda(command, dict(options or {}), inputs, threads, [], time.time(), question=question or inputs)
    keeper = AgendaKeeper(path, agenda, notice)
    try:
        yield keeper
    except KeyboardInterrupt:
        keeper.fail("interrupted")
        raise
    except (InputError, RunError) as error:
        keeper.fail(str(error))
        raise
    finally:
        keeper.close()
