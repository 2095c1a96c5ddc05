"""Finished runs on disk: one row a run in sqlite, keyed by what determines its bits; failed points as records, grouped by cause.

A result is there whole or not at all: sqlite appends it to its write-ahead log in frames with checksums, and a log that
was cut short is read up to the last whole transaction. Results are committed with ``synchronous = FULL``, that is, they
are on the disk when ``put`` returns; what is under way with ``NORMAL``, for a power cut ends it anyway. Each result also
carries its own SHA-256, so that a row spoilt later is reported and run again, not read.

One process at a time writes to a store (``lock``); any number may read it meanwhile.
"""

import json
import os
import re
import socket
import sqlite3
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self, TypeVar

from doe.running import lock
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.storage import digest_of

T = TypeVar("T")

# Runs that fail alike say the same sentence with other numbers.
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


@dataclass(frozen=True)
class Failure:
    """A point that failed: its label, why, its number in the design (None outside of it) and its factors."""

    label: str
    cause: str
    run: int | None = None
    factors: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.label}: {self.cause}"


class StoppedError(RunError):
    """Runs that something from outside has stopped; arguments: what, and the fix after which they go on."""

    def __str__(self) -> str:
        return "{}; finished runs are kept: {}".format(*self.args)


def grouped(failures: Iterable[Failure]) -> list[dict[str, Any]]:
    """Failures by cause, the most frequent first: ``{"cause", "runs", "labels"}``.

    Causes that differ in their numbers only are one; the first of them stands for all.
    """
    groups = []
    for group in sorted(alike(failures, lambda failure: failure.cause), key=len, reverse=True):
        runs = [failure.run for failure in group if failure.run is not None]
        groups.append({"cause": group[0].cause, "runs": runs, "labels": [failure.label for failure in group]})
    return groups


def alike(items: Iterable[T], text: Callable[[T], str]) -> list[list[T]]:
    """Items whose texts differ in their numbers only, together."""
    groups: dict[str, list[T]] = {}
    for item in items:
        groups.setdefault(_NUMBER.sub("#", text(item)), []).append(item)
    return list(groups.values())


def sentence(failures: Sequence[Failure]) -> str:
    """All failures in one sentence: each cause once, with the points that it stopped."""
    return "; ".join(f"{', '.join(group['labels'])}: {group['cause']}" for group in grouped(failures))


FORMAT, VERSION = "doe.store", "2"
SCHEMA = (
    "CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL)",
    """CREATE TABLE runs (
        key TEXT PRIMARY KEY,
        status TEXT NOT NULL CHECK (status IN ('claimed', 'done', 'failed')),
        result TEXT, digest TEXT, cause TEXT,
        study TEXT, label TEXT, run INTEGER, factors TEXT,
        started REAL, ended REAL, seconds REAL, host TEXT, pid INTEGER
    )""",
)
# How long to wait for another process that writes [s].
PATIENCE_S = 30.0
# What fixes a complaint of sqlite.
PLACE = "see that its folder is there and that both can be written, or name another folder"
FIXES = {
    sqlite3.SQLITE_NOTADB: "it is no database; move it away or name another folder",
    sqlite3.SQLITE_CORRUPT: "it is damaged; move it away, its runs are then run again",
    sqlite3.SQLITE_BUSY: "another process holds it; start again when that has ended",
    sqlite3.SQLITE_CANTOPEN: PLACE,
    sqlite3.SQLITE_READONLY: PLACE,
}


class Database:
    """A file of runs, of this format and version. Raises as ``Store``."""

    def __init__(self, path: Path, read_only: bool) -> None:
        self.path = path
        self._lock = threading.RLock()
        self._reported: set[str] = set()
        if path.is_dir():
            raise InputError([f"{path}: is a folder where a file of runs belongs; move it away or name another folder"])
        with self._faults():
            self._connection = sqlite3.connect(
                _address(path, read_only), timeout=PATIENCE_S, isolation_level=None, check_same_thread=False, uri=True
            )
            # A text that cannot be decoded fails its digest.
            self._connection.text_factory = lambda raw: raw.decode("utf-8", "replace")
            try:
                self._check(read_only)
            except BaseException:
                self._connection.close()
                raise

    def _check(self, read_only: bool) -> None:
        tables = self._tables()
        if not tables and read_only:
            # Just made by a process that has not written to it yet.
            self._connection.close()
            self._connection = sqlite3.connect(":memory:", isolation_level=None, check_same_thread=False)
        if not tables:
            with self._transaction(durable=True) as connection:
                if not self._tables():
                    for statement in SCHEMA:
                        connection.execute(statement)
                    connection.executemany("INSERT INTO meta VALUES (?, ?)", [("format", FORMAT), ("version", VERSION)])
                tables = self._tables()
        meta = dict(self._connection.execute("SELECT name, value FROM meta")) if "meta" in tables else {}
        version = meta.get("version", "1") if meta.get("format") == FORMAT else ""
        # The first version was a bare table of results.
        if tables == {"runs"}:
            version = "1"
        if version != VERSION:
            newer = version.isdigit() and int(version) > int(VERSION)
            what = f"a store of version {version}, not {VERSION}" if version else "not a store of runs"
            fix = "install the newer doe that made it" if newer else "move it away"
            raise InputError([f"{self.path}: {what}; {fix} or name another folder"])
        (sound,) = self._connection.execute("PRAGMA quick_check(1)").fetchone()
        if sound != "ok":
            raise InputError([f"{self.path}: damaged ({sound}); move it away, its runs are then run again"])
        if not read_only:
            _patiently(self._connection, "PRAGMA journal_mode=WAL")

    def _tables(self) -> set[str]:
        rows = _patiently(self._connection, "SELECT name FROM sqlite_master WHERE type = 'table'")
        return {name for (name,) in rows}

    def _tell(self, things: Sequence[str], sentence: str) -> None:
        """Say it of things on standard error, unless it was said of all of them."""
        if not self._reported.issuperset(things):
            self._reported.update(things)
            print(f"{self.path}: {sentence}", file=sys.stderr)

    @contextmanager
    def _transaction(self, durable: bool) -> Iterator[sqlite3.Connection]:
        with self._lock, self._faults():
            connection = self._connection
            connection.execute(f"PRAGMA synchronous={'FULL' if durable else 'NORMAL'}")
            connection.execute("BEGIN IMMEDIATE")
            try:
                yield connection
                connection.execute("COMMIT")
            finally:
                if connection.in_transaction:
                    connection.execute("ROLLBACK")

    @contextmanager
    def _faults(self) -> Iterator[None]:
        """Turn what sqlite complains of into one sentence."""
        try:
            yield
        except sqlite3.Error as error:
            if getattr(error, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR):
                what, fix = f"{self.path}: cannot be written ({error})", "make room on the disk and start again"
                raise StoppedError(what, fix) from None
            fix = FIXES.get(getattr(error, "sqlite_errorcode", 0) & 0xFF, "move it away")
            raise InputError([f"{self.path}: cannot be used as a store of runs ({error}); {fix}"]) from None


def _address(path: Path, read_only: bool) -> str:
    """URI of the file. One that is only read is left alone wholly: no log is begun next to it."""
    if not read_only:
        return path.absolute().as_uri()
    logs = (path.with_name(path.name + end) for end in ("-wal", "-journal"))
    return f"{path.absolute().as_uri()}?mode=ro{'' if any(log.exists() for log in logs) else '&immutable=1'}"


def _patiently(connection: sqlite3.Connection, statement: str) -> list[Any]:
    """Run a statement that another process, which opens the store just now, may hold up."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            return connection.execute(statement).fetchall()
        except sqlite3.OperationalError as error:
            busy = getattr(error, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
            if not busy or time.monotonic() > deadline:
                raise
            time.sleep(0.05)


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
            fix = "wait until it has ended, or name another folder"
            raise InputError([f"{self.path}: {self._holder()} works on it; {fix}"])
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

        A row spoilt on the disk, or whose result is not ``sound``, is reported on standard error and counts as not there.
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
    """What a row of an ended run shows; None where it is spoilt."""
    if status == "failed":
        return Failure(point.label, cause, point.run, dict(point.factors)) if isinstance(cause, str) else None
    if not isinstance(result, str) or digest_of(result) != digest:
        return None
    try:
        record = json.loads(result)
    except ValueError:
        return None
    return record if isinstance(record, dict) and (sound is None or sound(record)) else None
