"""Finished runs on disk: one row a run in sqlite, keyed by what determines its bits.

A result is there whole or not at all: sqlite appends it to its write-ahead log in frames with checksums, and a log that
was cut short is read up to the last whole transaction. Results are committed with ``synchronous = FULL``, that is, they
are on the disk when ``put`` returns; what is under way with ``NORMAL``, for a power cut ends it anyway. Each result also
carries its own SHA-256, so that a row spoilt later is reported and run again, not read.

One process at a time writes to a store (``lock``); any number may read it meanwhile.
"""

import json
import os
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from doe.running import lock
from doe.running.database import Database
from doe.running.failure import Failure
from rbdyn.faults import InputError
from rbdyn.records.kept import digest_of


@dataclass(frozen=True)
class Point:
    """A run to do: its key, and what a reader of the store wants to know of it."""

    key: str
    label: str
    run: int | None = None
    factors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class CurrentRun:
    """A run under way: which, where, and since when [s since the epoch]."""

    key: str
    label: str
    run: int | None
    host: str
    pid: int
    since: float


@dataclass(frozen=True)
class EndedRun:
    """A run that is done or failed: how long it took [s], when it began and ended [s since the epoch].

    ``seconds`` and ``started`` are None of a result that was put in by hand.
    """

    key: str
    status: str
    seconds: float | None
    started: float | None
    ended: float


Record = dict[str, Any]
RunResult = Record | Failure
# Whether a result is what the reader of the store takes it for; None: any is.
Sound = Callable[[Record], bool] | None


class Store(Database):
    """Results by key, failures with their cause, and what is being run."""

    def __init__(self, path: Path, study: str = "", read_only: bool = False) -> None:
        """Open or make the store; ``study`` is noted with every run.

        Raises InputError for a file that is no store, one of another version, or one that another process works on; RunError
        where the disk is full.
        """
        super().__init__(path, read_only)
        self._study, self._opened, self._token = study, time.time(), ""
        if not read_only:
            try:
                self._enter()
            except BaseException:
                self._connection.close()
                raise

    def _enter(self) -> None:
        """Take the lock; what an earlier process had under way is so no more."""
        with self._faults():
            token = lock.seize(self.path)
        if token is None:
            mend = "wait until it has ended, or name another folder"
            raise InputError([f"{self.path}: {self._holder()} works on it; {mend}"])
        self._token = token
        if self._meta("lock") == token:
            return
        try:
            with self._transaction(durable=False) as connection:
                connection.execute("DELETE FROM runs WHERE status = 'claimed'")
                facts = {"lock": token, "holder": f"process {os.getpid()} on {socket.gethostname()}"}
                connection.executemany("INSERT OR REPLACE INTO meta VALUES (?, ?)", facts.items())
        except BaseException:
            lock.free(self.path)
            raise

    def _meta(self, name: str) -> str | None:
        with self._lock, self._faults():
            row = self._connection.execute("SELECT value FROM meta WHERE name = ?", (name,)).fetchone()
        return None if row is None else str(row[0])

    def _holder(self) -> str:
        """Who works on the store, in words."""
        return self._meta("holder") or "another process"

    def get(self, key: str) -> Record | None:
        """The stored result, or None."""
        outcome = self.outcomes([Point(key, key)]).get(key)
        return outcome if isinstance(outcome, dict) else None

    def outcomes(self, points: Sequence[Point], sound: Sound = None) -> dict[str, RunResult]:
        """Results and failures of those points that have ended, by key.

        A row spoilt on the disk, or whose result is not ``sound``, is told on standard error and counts as not there.
        """
        outcomes, spoilt = dict[str, RunResult](), list[str]()
        query = "SELECT status, result, digest, cause FROM runs WHERE key = ? AND status != 'claimed'"
        with self._lock, self._faults():
            for point in points:
                if row := self._connection.execute(query, (point.key,)).fetchone():
                    if (outcome := _outcome(point, sound, *row)) is not None:
                        outcomes[point.key] = outcome
                    else:
                        spoilt.append(point.label)
        self._tell(spoilt, f"kept results that cannot be read count as not done: {', '.join(spoilt)}")
        return outcomes

    def begin(self, point: Point) -> None:
        """A run is under way from now on; what was kept of it, spoilt, makes room."""
        with self._transaction(durable=False) as connection:
            connection.execute(
                "INSERT OR REPLACE INTO runs (key, status, study, label, run, factors, started, host, pid) "
                "VALUES (?, 'claimed', ?, ?, ?, ?, ?, ?, ?)",
                (
                    *(point.key, self._study, point.label, point.run, json.dumps(dict(point.factors))),
                    *(time.time(), socket.gethostname(), os.getpid()),
                ),
            )

    def put(
        self, key: str, result: Record, *, seconds: float | None = None, host: str | None = None, pid: int | None = None
    ) -> None:
        """Keep a result; it is on the disk when this returns.

        An equal key already done is left, for equal keys have equal bits. ``host``, ``pid``: where it ran, if not here.
        """
        text = json.dumps(result)
        self._end(key, status="done", result=text, digest=digest_of(text), seconds=seconds, host=host, pid=pid)

    def fail(self, key: str, cause: str, *, seconds: float | None = None) -> None:
        """Keep why a run could not go on."""
        self._end(key, status="failed", cause=cause, seconds=seconds)

    def _end(self, key: str, **facts: Any) -> None:
        where = {"host": facts.get("host") or socket.gethostname(), "pid": facts.get("pid") or os.getpid()}
        facts |= {"ended": time.time()} | where
        columns = ", ".join(facts)
        replaced = ", ".join(f"{name} = excluded.{name}" for name in facts)
        with self._transaction(durable=True) as connection:
            insert = f"INSERT INTO runs (key, study, {columns}) VALUES (?, ?{', ?' * len(facts)})"
            update = f"ON CONFLICT (key) DO UPDATE SET {replaced} WHERE runs.status = 'claimed'"
            connection.execute(f"{insert} {update}", (key, self._study, *facts.values()))

    def forget_failures(self, points: Sequence[Point]) -> None:
        """Let points be run again that failed before this store was opened."""
        with self._transaction(durable=True) as connection:
            connection.executemany(
                # One dated ahead was ended by another clock.
                "DELETE FROM runs WHERE status = 'failed' AND key = ? AND ended NOT BETWEEN ? AND ?",
                [(point.key, self._opened, time.time()) for point in points],
            )

    def sign(self, kind: str) -> None:
        """Take away notes of a ``kind`` by earlier processes."""
        with self._transaction(durable=False) as connection:
            gone = "DELETE FROM meta WHERE name LIKE ? || '%' AND name != ?"
            connection.execute(gone, (kind, kind + self._token))

    def note(self, kind: str, text: str) -> None:
        """Keep a note of a ``kind``, one for each process."""
        with self._transaction(durable=False) as connection:
            connection.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (kind + self._token, text))

    def notes(self, kind: str) -> list[tuple[str, bool]]:
        """Notes of a ``kind``, each with whether its process lives."""
        live = kind + (self._meta("lock") or "") if lock.is_held(self.path) else None
        with self._lock, self._faults():
            rows = self._connection.execute("SELECT name, value FROM meta WHERE name LIKE ? || '%'", (kind,)).fetchall()
        return [(text, name == live) for name, text in rows]

    def release(self) -> None:
        """What has not ended is under way no more."""
        with self._transaction(durable=False) as connection:
            connection.execute("DELETE FROM runs WHERE status = 'claimed'")

    def running(self) -> list[CurrentRun]:
        """Runs that a live process has under way."""
        if not lock.is_held(self.path):
            return []
        with self._lock, self._faults():
            rows = self._connection.execute(
                "SELECT key, label, run, host, pid, iif(typeof(started) = 'real', started, 0.0) "
                "FROM runs WHERE status = 'claimed' ORDER BY started, run"
            ).fetchall()
        return [CurrentRun(*row) for row in rows]

    def ended(self) -> list[EndedRun]:
        """All runs that have ended, oldest first."""
        seconds, started = (f"iif(typeof({name}) = 'real', {name}, NULL)" for name in ("seconds", "started"))
        query = f"SELECT key, status, {seconds}, {started}, ended FROM runs WHERE status != 'claimed'"
        with self._lock, self._faults():
            rows = self._connection.execute(f"{query} AND typeof(ended) = 'real' ORDER BY ended")
            return [EndedRun(*row) for row in rows]

    def close(self) -> None:
        """Close the file, and open the lock unless another store of this process shares it."""
        with self._lock:
            self._connection.close()
        if self._token:
            self._token = ""
            lock.free(self.path)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *ended: object) -> None:
        self.close()


def _outcome(point: Point, sound: Sound, status: str, result: Any, digest: Any, cause: Any) -> RunResult | None:
    """What a row of an ended run tells; None where it is spoilt."""
    if status == "failed":
        return Failure(point.label, cause, point.run, dict(point.factors)) if isinstance(cause, str) else None
    if not isinstance(result, str) or digest_of(result) != digest:
        return None
    try:
        record = json.loads(result)
    except ValueError:
        return None
    return record if isinstance(record, dict) and (sound is None or sound(record)) else None
