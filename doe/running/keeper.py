"""The agenda of a live process, noted in its store while it goes on; early on it states what is left to run."""

import json
import os
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from doe.running.runner import NOTE, Agenda, Engine, Ledger, Progress, Ran, Stage, agendas_of, forecast_of
from doe.running.store import Point, Store
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.forecast import Measured, Notice

# What is left is stated once so many runs have ended, or after this time [s] by those under way.
ENOUGH, LOOK_S = 2, 5.0
# Runs that wait for something else than a processor are no crowd beyond this.
MOST_CROWD = 10.0


@dataclass
class AgendaKeeper:
    """An agenda of a live process, noted in the store at ``path`` whenever something of it changes, once it is planned.

    ``notice``: what to do with the sentence on what is left.
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

    def plan(self, stages: Sequence[Stage]) -> None:
        """Take up the stages, before anything runs and after all was checked. Raises as ``Store``.

        Agendas of processes that are gone make room; what a unit of work took them is taken over, and how many runs of each
        stage they made, where the same was asked.
        """
        self.agenda.stages = list(stages)
        if self._store is None:
            self._store = Store(self.path)
            if before := agendas_of(self._store):
                self._take_over(before[-1][0])
            self._store.sign(NOTE)
        self._note()

    def _take_over(self, before: Agenda) -> None:
        self.agenda.measured, self.agenda.crowd = before.measured, before.crowd
        if before.asked != self.agenda.asked:
            return
        made = {stage.name: max(stage.done, stage.stored) for stage in before.stages}
        for stage in self.agenda.stages:
            stage.stored = made.get(stage.name, 0)

    def announced(self, progress: Callable[[str], Progress]) -> Callable[[str], Progress]:
        """The same progress of stages by title, each of which also goes into the agenda."""

        def announce(title: str) -> Progress:
            names = [place for place, stage in enumerate(self.agenda.stages) if title.startswith(stage.titles)]
            ahead = [place for place in names if place >= self.agenda.place]
            if ahead:
                self._enter(ahead[0])
            return progress(title)

        return announce

    def enter(self, name: str) -> None:
        """The stage of that name begins; what is left of earlier ones is not needed."""
        self._enter([stage.name for stage in self.agenda.stages].index(name))

    def _enter(self, place: int) -> None:
        stage = self.agenda.stages[place]
        self.agenda.place, stage.since = place, stage.since or time.time()
        self._note()

    def counting(self, works: Mapping[str, float], progress: Progress) -> Progress:
        """The same progress of runs of so much work by key, which also counts them in the stage under way."""
        agenda, place = self.agenda, self.agenda.place
        if not agenda.stages:
            return progress
        stage, known = agenda.stages[place], self._keys.setdefault(place, {})
        fresh = {key: work for key, work in works.items() if key not in known}
        before, before_work, again = stage.done, stage.done_work, len(works) - len(fresh)
        known.update(fresh)
        stage.runs, stage.work = max(stage.runs, len(known)), max(stage.work, sum(known.values()))
        stage.announced = len(known)

        def count(done: int, total: int) -> None:
            more = max(done - again, 0)
            stage.done = before + more
            stage.done_work = before_work + (sum(fresh.values()) * more / len(fresh) if fresh else 0.0)
            self._note()
            if agenda.measured.number >= ENOUGH:
                self._state(agenda.measured)
            progress(done, total)

        return count

    def timed(self, engine: Engine, works: Mapping[str, float], growth: float = 1.0, cluster: bool = False) -> Engine:
        """The same engine, of threads or of a ``cluster``; what its runs take counts. ``growth``: how many times as long they
        may become."""
        agenda, place = self.agenda, self.agenda.place
        self._works, self._growth, self._cluster = works, growth, cluster

        def run(points: Sequence[Point], ledger: Ledger) -> None:
            # The threads that have no point of their own share those of the others.
            shared = self._shared = 1.0 if cluster else max(agenda.threads / len(points), 1.0)
            busy = min(agenda.threads, len(points), os.cpu_count() or 1)
            self._engine_since = time.perf_counter(), time.process_time(), busy

            def end(point: Point, ran: Ran) -> None:
                with self._lock:
                    self._under_way.pop(point.key, None)
                    if ran.result is not None:
                        seconds = shared * ran.seconds
                        agenda.measured = agenda.measured.plus(works[point.key], seconds)
                        if agenda.stages:
                            agenda.stages[place].measured_work += works[point.key]
                            agenda.stages[place].seconds += seconds
                ledger.give(point, ran)

            engine(points, replace(ledger, give=end))
            with self._lock:
                self._look_about()
                self._engine_since = None

        return run

    def hear(self, key: str, share: float, seconds: float) -> None:
        """A run under way has made that share of its work in so many seconds; called in any thread."""
        with self._lock:
            self._under_way[key] = share * self._works[key], self._shared * seconds
            since = self._engine_since
            if self.agenda.predicted or since is None or time.perf_counter() - since[0] < LOOK_S:
                return
            measured, growth = self.agenda.measured, 1.0
            if not measured.number:
                growth = self._growth
                for work, spent in self._under_way.values():
                    measured = measured.plus(work, spent)
            self._state(measured, growth)

    def _state(self, measured: Measured, growth: float = 1.0) -> None:
        """State what is left, once, and again where it proves to take longer than the most that was stated."""
        with self._lock:
            self._look_about()
            forecast = forecast_of(self.agenda, self._at_once, measured, growth) if self.agenda.stages else None
            if forecast is None or not forecast.notable:
                return
            elapsed_s = time.time() - self.agenda.begin
            low, high = (elapsed_s + each for each in forecast.seconds)
            if low <= self._stated_s:
                return
            self._stated_s = max(high, elapsed_s + forecast.longest_s)
            self.agenda.predicted = self.agenda.predicted or (low, self._stated_s)
            self._note()
        if self.notice is not None:
            self.notice(forecast.sentence)

    def _look_about(self) -> None:
        """How busy the machine is with other things, by the runs under way."""
        if self._engine_since is None or self._cluster:
            return
        wall, processor, busy = self._engine_since
        spent, used = time.perf_counter() - wall, time.process_time() - processor
        if spent >= 1.0 and used > 0.0:
            self.agenda.crowd = min(max(spent * busy / used, 1.0), MOST_CROWD)

    @property
    def _at_once(self) -> float:
        """Runs that go at once: threads, or what a cluster has under way."""
        if not self._cluster or self._store is None:
            return float(self.agenda.threads)
        return float(max(len(self._store.running()), 1))

    def finish(self, files: Sequence[str]) -> None:
        """All files of the answer are written."""
        self.agenda.files, self.agenda.took_s = list(files), time.time() - self.agenda.begin
        self._note()

    def fail(self, fault: str) -> None:
        """The command ends without an answer."""
        self.agenda.fault = fault
        self._note()

    def close(self) -> None:
        """The process has nothing more to do."""
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
    asked: str = "",
) -> Iterator[AgendaKeeper]:
    """An agenda in the store at ``path`` for as long as the command runs; its stages are planned later."""
    agenda = Agenda(command, dict(options or {}), inputs, threads, [], time.time(), asked=asked or inputs)
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
