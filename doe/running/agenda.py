"""What a command still has to run: its stages with their runs, noted in the store while it goes on.

The note outlives the process, so that the state of a command that was killed can be read from its folder.
"""

import json
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Self

from pydantic import TypeAdapter

from doe.running.runner import Engine, Ledger, Progress, Ran
from doe.running.store import Point, Store
from rbdyn.faults import InputError, RunError

# Names of the notes in a store, each followed by the owner's token.
NOTE = "agenda "
# The last stage of every command, and the wall time [s] that the files of an answer take about.
ANSWER, ANSWER_S = "answer", 8.0


@dataclass
class Stage:
    """A part of a command: the ``runs`` that it makes as far as is known, their ``work`` (in shaft turns), how much of both
    is ``done``, and the wall time [s] that it takes besides. ``titles``: how the titles of its progress begin."""

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

    @classmethod
    def of(cls, name: str, runs: int, work: float, *titles: str) -> Self:
        """A stage of so many runs of so much work each; its titles begin with its name unless others are given."""
        return cls(name, titles or (name,), runs, runs * work)


@dataclass
class Agenda:
    """The stages of a command, which of them is under way, and what a unit of work took.

    ``command`` in words; ``options`` and ``inputs`` (a digest) tell for what its answer stands; ``files`` are the names of the
    answer's files once all are written; ``fault`` is what ended the command.
    """

    command: str
    options: dict[str, bool]
    inputs: str
    threads: int
    stages: list[Stage]
    begin: float = 0.0
    place: int = 0
    work: float = 0.0
    seconds: float = 0.0
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

    def left(self) -> list[tuple[Stage, float]]:
        """The stage under way and those to come, each with the work that is left of it."""
        return [(stage, stage.work - stage.done_work) for stage in self.stages[self.place :]]


@dataclass
class AgendaKeeper:
    """An agenda of a live process, noted in the store at ``path`` whenever something of it changes, once it is planned."""

    path: Path
    agenda: Agenda
    _store: Store | None = None
    _keys: dict[int, dict[str, float]] = field(default_factory=dict)

    def plan(self, stages: Sequence[Stage]) -> None:
        """Take up the stages, before anything runs and after all was checked. Raises as ``Store``.

        Agendas of processes that are gone make room; what a unit of work took them is taken over.
        """
        if self._store is None:
            self._store = Store(self.path)
            if before := agendas_of(self._store):
                self.agenda.work, self.agenda.seconds = before[-1][0].work, before[-1][0].seconds
            self._store.sign(NOTE)
        self.agenda.stages = list(stages)
        self._note()

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

        def count(done: int, total: int) -> None:
            more = max(done - again, 0)
            stage.done = before + more
            stage.done_work = before_work + (sum(fresh.values()) * more / len(fresh) if fresh else 0.0)
            self._note()
            progress(done, total)

        return count

    def timed(self, engine: Engine, works: Mapping[str, float]) -> Engine:
        """The same engine; what its runs take counts."""
        agenda, place = self.agenda, self.agenda.place

        def run(points: Sequence[Point], ledger: Ledger) -> None:
            def end(point: Point, ran: Ran) -> None:
                if ran.result is not None:
                    agenda.work += works[point.key]
                    agenda.seconds += ran.seconds
                    if agenda.stages:
                        agenda.stages[place].measured_work += works[point.key]
                        agenda.stages[place].seconds += ran.seconds
                ledger.give(point, ran)

            engine(points, replace(ledger, give=end))

        return run

    def finish(self, files: Sequence[str]) -> None:
        """All files of the answer are written."""
        self.agenda.files = list(files)
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
        if self._store is not None:
            self._store.note(NOTE, json.dumps(asdict(self.agenda)))


@contextmanager
def agenda_in(
    path: Path, command: str, threads: int, options: Mapping[str, bool] | None = None, inputs: str = ""
) -> Iterator[AgendaKeeper]:
    """An agenda in the store at ``path`` for as long as the command runs; its stages are planned later."""
    keeper = AgendaKeeper(path, Agenda(command, dict(options or {}), inputs, threads, [], time.time()))
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


def agendas_of(store: Store) -> list[tuple[Agenda, bool]]:
    """Agendas noted in a store, the newest last, and whether the process of each still lives."""
    agendas = []
    for text, alive in store.notes(NOTE):
        # What cannot be read tells nothing.
        with suppress(ValueError):
            agendas.append((Agenda.from_json(text), alive))
    return sorted(agendas, key=lambda each: each[0].begin)
