"""Runs of points, and the agenda of a command: its stages, and how many of their runs are left.

Results in the store are read; the other points run on an engine, and each is stored as it ends. A live process keeps its
agenda as a note in the store. It states the number of runs before they start, and after the first how long the rest takes.

The engine of a cluster runs points on the workers of a dask scheduler, by dask.distributed. Jobs of a queue run parts of a table
or a study, each into a store of its own, which are gathered.
"""

import json
import logging
import queue
import threading
import time
import uuid
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Self

from pydantic import TypeAdapter

from doe.running.store import STORE, Failure, Point, RunResult, Sound, StoppedError, Store
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.records import Record
from rbdyn.base.words import NOTABLE_S, Notice, counted, estimate


class RunOutcome(Record):
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


class Ledger(Record):
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
# The last stage of every command.
ANSWER = "answer"


@dataclass
class Stage:
    """A stage of a command: its expected ``runs``, their ``work`` (shaft turns), and how many have finished.

    ``titles``: beginnings of the titles of its progress. ``fewest``, ``most``: runs at least and at most, None for ``runs``.
    ``announced_runs``: runs asked for so far. ``stored_runs``: runs by an earlier process.
    """

    name: str
    titles: tuple[str, ...] = ()
    runs: int = 0
    work: float = 0.0
    finished_runs: int = 0
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
    def past_runs(self) -> int:
        """Finished runs, by this process or an earlier one."""
        return max(self.finished_runs, self.stored_runs)

    @property
    def work_left(self) -> float:
        """Expected work of the runs left."""
        return self.work * (1.0 - self.past_runs / self.runs) if self.runs > self.past_runs else 0.0

    @property
    def most_work_left(self) -> float:
        """Work of the runs left if all are needed."""
        return self.work * self.runs_left[1] / self.runs if self.runs else 0.0

    @property
    def runs_left(self) -> tuple[int, int]:
        """Runs left, at least and at most."""
        ends = self.runs if self.fewest is None else self.fewest, max(self.runs, self.most or 0)
        low, high = (max(end, self.announced_runs) - self.past_runs for end in ends)
        return max(low, 0), max(high, 0)


@dataclass
class Agenda:
    """The stages of a command, and which of them is under way.

    ``command``: its name. ``options`` and ``inputs`` (a digest) identify the answer, ``question`` (a digest) also its runs.
    ``place``: the stage under way, once ``entered``. ``files``: names of the answer's files, once written. ``fault``: what
    ended the command.
    """

    command: str
    options: dict[str, bool]
    inputs: str
    threads: int
    stages: list[Stage]
    begin: float = 0.0
    place: int = 0
    entered: bool = False
    question: str = ""
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
        return self.stages[self.place] if self.entered and self.stages else None

    @property
    def runs_left(self) -> tuple[int, int]:
        """Runs left to the end, at least and at most."""
        ranges = [stage.runs_left for stage in self.stages[self.place :]]
        return sum(low for low, _ in ranges), sum(high for _, high in ranges)

    @property
    def plan(self) -> str:
        """'22 to 25 runs (design runs 20, confirmation 2 to 5), 2 at once': the runs to come."""
        parts = [(stage.name, count_of(stage.runs_left)) for stage in self.stages if stage.runs_left[1]]
        listed = f" ({', '.join(f'{name} {count}' for name, count in parts)})" if parts[1:] else ""
        return f"{count_of(self.runs_left)} {'run' if self.runs_left == (1, 1) else 'runs'}{listed}, {self.threads} at once"


def count_of(ends: tuple[int, int]) -> str:
    """'2 to 5': a number of runs at least and at most, one where they are equal."""
    return f"{ends[0]} to {ends[1]}" if ends[0] < ends[1] else f"{ends[1]}"


def agendas_of(store: Store) -> list[tuple[Agenda, bool]]:
    """Agendas noted in a store, the newest last, and whether the process of each still lives."""
    agendas = []
    for text, alive in store.notes(NOTE):
        # A spoilt note is skipped.
        with suppress(ValueError):
            agendas.append((Agenda.from_json(text), alive))
    return sorted(agendas, key=lambda pair: pair[0].begin)


@dataclass
class AgendaKeeper:
    """Keeper of the agenda of a live process: it notes every change in the store at ``path``, once stages are planned.

    ``notice``: receiver of the plan, and of the estimate of its time after the first run.
    """

    path: Path
    agenda: Agenda
    notice: Notice = None
    _store: Store | None = None
    _keys: dict[int, dict[str, float]] = field(default_factory=dict)
    _shorter_by: Sequence[str] = ()
    _steps_s: float = 0.0
    _estimated: bool = False
    _why: str = ""
    _lock: threading.RLock = field(default_factory=threading.RLock)
    _began: float = field(default_factory=time.monotonic)

    @property
    def elapsed_s(self) -> float:
        """Wall time [s] of the command so far, whatever the clock was set to meanwhile."""
        return time.monotonic() - self._began

    def plan(self, stages: Sequence[Stage], shorter_by: Sequence[str] = (), steps_s: float = 0.0) -> None:
        """Plan the stages, after all checks and before anything runs, and state their runs. Raises as ``Store``.

        ``shorter_by``: what makes the plan smaller; ``steps_s``: typical time [s] of what is no run. The agenda replaces those
        of ended processes. It takes over the number of runs of each stage of the same question.
        """
        self.agenda.stages, self._shorter_by, self._steps_s = list(stages), shorter_by, steps_s
        if self._store is None:
            self._store = Store(self.path)
            if earlier := agendas_of(self._store):
                self._take_over(earlier[-1][0])
            self._store.sign(NOTE)
        self._note()
        if self.notice is not None and self.agenda.runs_left[1]:
            self.notice(self.agenda.plan)

    def _take_over(self, earlier: Agenda) -> None:
        if earlier.question != self.agenda.question:
            return
        runs_made = {stage.name: stage.past_runs for stage in earlier.stages}
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
        self.agenda.place, self.agenda.entered = place, True
        self._note()

    def counting(self, works: Mapping[str, float], progress: Progress) -> Progress:
        """The same progress of runs with ``works`` by key, which also counts them in the stage under way.

        The time of more runs than planned is estimated anew.
        """
        agenda, place = self.agenda, self.agenda.place
        if not agenda.stages:
            return progress
        stage, stage_works = agenda.stages[place], self._keys.setdefault(place, {})
        new_works = {key: work for key, work in works.items() if key not in stage_works}
        earlier_runs, repeats = stage.finished_runs, len(works) - len(new_works)
        stage_works.update(new_works)
        if len(stage_works) > stage.runs:
            self._estimated, self._why = False, f"{stage.name}: {counted(len(stage_works), 'run')} in all; "
        stage.runs, stage.work = max(stage.runs, len(stage_works)), max(stage.work, sum(stage_works.values()))
        stage.announced_runs = len(stage_works)

        def count(number: int, total: int) -> None:
            stage.finished_runs = earlier_runs + max(number - repeats, 0)
            self._note()
            progress(number, total)

        return count

    def timed(self, engine: Engine, works: Mapping[str, float], cluster: bool = False) -> Engine:
        """The same engine, of threads or of a ``cluster``; after its first run the time of all that follow is estimated."""
        threads = self.agenda.threads

        def run(points: Sequence[Point], ledger: Ledger) -> None:
            # Threads without a point of their own share those of the others.
            shared = 1.0 if cluster else max(threads / len(points), 1.0)

            def end(point: Point, outcome: RunOutcome) -> None:
                ledger.give(point, outcome)
                if outcome.result is not None and not self._estimated:
                    seconds = outcome.seconds - outcome.result.get("cost", {}).get("compile_s", 0.0)
                    running = len(self._store.running()) + 1 if cluster and self._store is not None else threads
                    self._estimate(shared * max(seconds, 0.0) / works[point.key] / running)

            engine(points, replace(ledger, give=end))

        return run

    def _estimate(self, pace_s: float) -> None:
        """State the time of all that is left, where a unit of work takes so long [s]; a short time is not worth a sentence."""
        self._estimated = True
        stages = self.agenda.stages[self.agenda.place :]
        rest_s, most_s = (
            pace_s * sum(works) + self._steps_s
            for works in ([stage.work_left for stage in stages], [stage.most_work_left for stage in stages])
        )
        if self.notice is not None and rest_s >= NOTABLE_S:
            self.notice(f"{self._why}{estimate(rest_s, self._shorter_by, most_s)}")

    def finish(self, files: Sequence[str]) -> None:
        """Note that all files of the answer are written."""
        self.agenda.files = list(files)
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


# Longest waits [s] for a scheduler to shake hands, to accept a client, and to have a worker.
KNOCK_S, CONNECT_S, WORKERS_S = 2.0, 4.0, 10.0
# Longest wait [s] of a study under way for new workers.
DESERTED_S = 60.0
# Interval [s] between looks at the cluster.
LOOK_S = 1.0


def run_on_cluster(
    address: str,
    work: Callable[[str], RunOutcome],
    tasks: Sequence[str],
    on_end: Callable[[int, RunOutcome], None],
    on_begin: Callable[[int], None] = lambda place: None,
) -> None:
    """Run ``work`` on each text of ``tasks``; hand over its place at its begin, and its place and outcome at its end.

    ``on_begin`` is called in another thread. A task whose worker is lost runs again on another; one that is lost repeatedly
    is handed over as lost. Raises InputError without a cluster, or if its workers run other code; StoppedError if it goes
    away.
    """
    with _client(address) as client:
        # All tasks are submitted at once, so that workers which join later find work.
        topic = f"rbdyn-{uuid.uuid4().hex}"
        client.subscribe_topic(topic, lambda event: on_begin(event[1]))
        announced = partial(_work_with_event, work, topic)
        futures = dict(enumerate(client.map(announced, range(len(tasks)), list(tasks), pure=False)))
        answers: queue.SimpleQueue[int] = queue.SimpleQueue()
        for number, future in futures.items():
            future.add_done_callback(lambda _, number=number: answers.put(number))
        deserted_s = 0.0
        while futures:
            place = -1
            try:
                place = answers.get(timeout=LOOK_S)
                outcome = futures[place].result(timeout=LOOK_S)
            except (queue.Empty, TimeoutError):
                # A result lost with its worker is computed again on another.
                if place in futures:
                    answers.put(place)
                is_broken = place in futures and futures[place].status == "error"
                running = client.status == "running"
                deserted_s = 0.0 if running and client.scheduler_info(n_workers=-1)["workers"] else deserted_s + LOOK_S
                if is_broken or client.status != "running" or deserted_s > DESERTED_S:
                    raise _loss(address, client) from None
                continue
            except InputError:
                raise
            except (CancelledError, OSError, MemoryError) as error:
                raise _loss(address, client) from error
            except Exception as error:
                outcome = RunOutcome(None, f"its workers were lost ({error})", 0.0, lost=True)
            # An unreleased result would run again if its worker were lost.
            futures.pop(place).release()
            on_end(place, outcome)


def _work_with_event(work: Callable[[str], RunOutcome], topic: str, place: int, text: str) -> RunOutcome:
    """Work on a worker, after an event that it begins."""
    from distributed import get_worker

    get_worker().log_event(topic, place)
    return work(text)


def _loss(address: str, client: Any) -> StoppedError:
    """Error of a cluster that has lost its workers or its scheduler."""
    fix = "start again when the cluster is back"
    if client.status == "running":
        return StoppedError(f"--scheduler {address}: its workers are gone", fix)
    return StoppedError(f"--scheduler {address}: the scheduler is gone", fix)


async def _knock(address: str) -> None:
    """Shake hands with the scheduler, because a client without a scheduler would leave threads behind."""
    import asyncio

    from distributed.comm import connect

    # The limit of connect alone would not end the wait for a server that accepts and stays silent.
    comm = await asyncio.wait_for(connect(address, timeout=KNOCK_S), KNOCK_S)
    await comm.close()


@contextmanager
def _client(address: str) -> Iterator[Any]:
    import asyncio

    where = f"--scheduler {address}"
    try:
        import distributed
    except ImportError:
        raise InputError(f"{where}: needs the package distributed; pip install 'rbdyn[cluster]'") from None
    # Errors are reported here in a sentence, not by its log.
    for name in logging.root.manager.loggerDict:
        if name.split(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        asyncio.run(_knock(address))
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    # Any server may answer at the address, with any error.
    except Exception:
        raise InputError(f"{where}: no dask scheduler answers there within {KNOCK_S:g} s; check the address") from None
    try:
        try:
            client.wait_for_workers(1, timeout=WORKERS_S)
        except TimeoutError:
            raise InputError(f"{where}: has no workers; start some with dask worker {address}") from None
        yield client
    finally:
        client.close(timeout=CONNECT_S)


# Part k of n: every n-th run from the k-th.
Part = tuple[int, int]


def rows_of(part: Part | None) -> slice:
    """Places of the runs of a part; those of all runs without one."""
    return slice(None) if part is None else slice(part[0] - 1, None, part[1])


def part_folder(folder: Path, part: Part | None) -> Path:
    """Folder of the store of a part within that of its table."""
    return folder if part is None else folder / f"part-{part[0]}-of-{part[1]}"


def part_stores(folder: Path) -> list[Path]:
    """Stores of all parts in the folder of a table or a study."""
    return sorted(folder.glob(f"part-*-of-*/{STORE}"))


def refuse_other_parts(folder: Path, question: str) -> None:
    """Raises InputError where the folder has a part of another table or study, or by other code, than that of this digest."""
    for path in part_stores(folder):
        with Store(path, read_only=True) as store:
            questions = {agenda.question for agenda, _ in agendas_of(store)}
        if questions - {question}:
            raise InputError(
                f"--out {folder}: {path.parent.name} is a part of another input, or another version of rbdyn made it; remove it "
                "or name another folder"
            )


def gather(folder: Path) -> None:
    """Take over the runs of all parts into the store of their folder. Raises as ``Store``."""
    if stores := part_stores(folder):
        with Store(folder / STORE) as store:
            for path in stores:
                store.adopt(path)
