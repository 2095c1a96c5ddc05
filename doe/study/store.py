"""Finished runs on disk: one row a run in sqlite, keyed by what determines its bits.

A result is there whole or not at all: sqlite appends it to its write-ahead log in frames with checksums, and a log that
was cut short is read up to the last whole transaction. Results are committed with ``synchronous = FULL``, that is, they
are on the disk when ``put`` returns; claims with ``NORMAL``, for a power cut frees them anyway. Each result also carries
its own SHA-256, so that a row spoilt later is run again, not read.

Several processes of one machine may use a store at once: whoever claims a run does it, the others wait for it.
"""

from __future__ import annotations

import hashlib
import json
import sqlite3
import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any

from doe.study.failure import Failure
from doe.study.owner import BEAT_S, Owner, this_process
from rbdyn.faults import InputError, RunError

FORMAT, VERSION = "doe.store", "2"
SCHEMA = (
    "CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL)",
    "CREATE TABLE owners (owner TEXT PRIMARY KEY, host TEXT, machine TEXT, pid INTEGER, born TEXT, beat REAL)",
    """CREATE TABLE runs (
        key TEXT PRIMARY KEY,
        status TEXT NOT NULL CHECK (status IN ('claimed', 'done', 'failed')),
        result TEXT, digest TEXT, cause TEXT,
        study TEXT, label TEXT, run INTEGER, factors TEXT,
        started REAL, ended REAL, seconds REAL, host TEXT, pid INTEGER, owner TEXT
    )""",
)
# How long to wait for another process that writes [s].
PATIENCE_S = 30.0


@dataclass(frozen=True)
class Point:
    """A run to do: its key, and what a reader of the store wants to know of it."""

    key: str
    label: str
    run: int | None = None
    factors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Claim:
    """A run that a live process has taken: who, and since when [s since the epoch]."""

    key: str
    label: str
    run: int | None
    host: str
    pid: int
    since: float
    owner: str


@dataclass(frozen=True)
class EndedRun:
    """A run that is done or failed: how long it took [s], when it was claimed and ended [s since the epoch], by whom.

    ``seconds`` and ``started`` are None of a result that was put in by hand.
    """

    key: str
    status: str
    seconds: float | None
    started: float | None
    ended: float
    owner: str | None


class Store:
    """Results by key, failures with their cause, and claims on what is being run."""

    def __init__(self, path: Path, study: str = "", read_only: bool = False) -> None:
        """Open or make the store; ``study`` is noted with every run.

        Raises InputError for a file that is no store, or one of another version; RunError where the disk is full.
        """
        self.path, self._study = path, study
        self._lock, self._closed = threading.RLock(), threading.Event()
        self._me = this_process()
        self._opened = time.time()
        self._beating: threading.Thread | None = None
        with self._faults():
            self._connection = sqlite3.connect(
                _address(path, read_only), timeout=PATIENCE_S, isolation_level=None, check_same_thread=False, uri=True
            )
            try:
                self._check(read_only)
            except BaseException:
                self._connection.close()
                raise
        self._me.enter()

    def _check(self, read_only: bool) -> None:
        tables = self._tables()
        if not tables and read_only:
            # Just made by a process that has not written to it yet.
            self._connection.close()
            self._connection = sqlite3.connect(":memory:", isolation_level=None, check_same_thread=False)
        if not tables:
            with self._transaction(durable=True) as connection:
                tables = self._tables()
                if not tables:
                    for statement in SCHEMA:
                        connection.execute(statement)
                    connection.executemany("INSERT INTO meta VALUES (?, ?)", [("format", FORMAT), ("version", VERSION)])
                    tables = self._tables()
        meta = dict(self._connection.execute("SELECT name, value FROM meta")) if "meta" in tables else {}
        found = meta.get("version", "1") if meta.get("format") == FORMAT else ""
        # The first version was a bare table of results.
        if tables == {"runs"}:
            found = "1"
        if found != VERSION:
            what = f"a store of version {found}, not {VERSION}" if found else "not a store of runs"
            raise InputError([f"{self.path}: {what}; move it away or name another folder"])
        (sound,) = self._connection.execute("PRAGMA quick_check(1)").fetchone()
        if sound != "ok":
            raise InputError([f"{self.path}: damaged ({sound}); move it away"])
        if not read_only:
            _patiently(self._connection, "PRAGMA journal_mode=WAL")

    def _tables(self) -> set[str]:
        found = _patiently(self._connection, "SELECT name FROM sqlite_master WHERE type = 'table'")
        return {name for (name,) in found}

    def get(self, key: str) -> dict[str, Any] | None:
        """The stored result, or None."""
        found = self.outcomes([Point(key, key)]).get(key)
        return found if isinstance(found, dict) else None

    def outcomes(self, points: Sequence[Point]) -> dict[str, dict[str, Any] | Failure]:
        """Results and failures of those points that have ended, by key."""
        found: dict[str, dict[str, Any] | Failure] = {}
        query = "SELECT status, result, digest, cause FROM runs WHERE key = ? AND status != 'claimed'"
        with self._lock, self._faults():
            for point in points:
                row = self._connection.execute(query, (point.key,)).fetchone()
                if row is None:
                    continue
                status, result, digest, cause = row
                if status == "failed":
                    found[point.key] = Failure(point.label, cause, point.run, dict(point.factors))
                elif _digest(result) == digest:
                    found[point.key] = json.loads(result)
        return found

    def claim(self, points: Sequence[Point]) -> set[str]:
        """Take what nobody has done or is doing; returns the keys that are now ours to run.

        Claims of a process that is gone are taken over, and a row spoilt on the disk counts as not there.
        """
        mine = set()
        with self._transaction(durable=False) as connection:
            self._sign(connection)
            live: dict[str, bool] = {}
            for point in points:
                row = connection.execute(
                    "SELECT status, owner, result, digest FROM runs WHERE key = ?", (point.key,)
                ).fetchone()
                if row is not None and not self._free(connection, live, *row):
                    continue
                connection.execute(
                    "INSERT OR REPLACE INTO runs (key, status, study, label, run, factors, started, host, pid, owner) "
                    "VALUES (?, 'claimed', ?, ?, ?, ?, ?, ?, ?, ?)",
                    (
                        point.key,
                        self._study,
                        point.label,
                        point.run,
                        json.dumps(dict(point.factors)),
                        time.time(),
                        self._me.host,
                        self._me.pid,
                        self._me.token,
                    ),
                )
                mine.add(point.key)
        return mine

    def _free(
        self, connection: sqlite3.Connection, live: dict[str, bool], status: str, owner: str, *result: str
    ) -> bool:
        if status != "claimed":
            return status == "done" and _digest(result[0]) != result[1]
        if owner not in live:
            live[owner] = _lives(connection, owner)
        return not live[owner]

    def _sign(self, connection: sqlite3.Connection) -> None:
        """Note that this owner lives, now and from time to time from here on."""
        me = self._me
        connection.execute(
            "INSERT OR REPLACE INTO owners VALUES (?, ?, ?, ?, ?, ?)",
            (me.token, me.host, me.machine, me.pid, me.born, time.time()),
        )
        if self._beating is None:
            self._beating = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
            self._beating.start()

    def _beat(self) -> None:
        while not self._closed.wait(BEAT_S):
            # A sign that cannot be given now is given later; a full disk is told by the next result.
            with suppress(InputError, RunError), self._transaction(durable=False) as connection:
                if not self._closed.is_set():
                    self._sign(connection)

    def put(
        self,
        key: str,
        result: dict[str, Any],
        *,
        seconds: float | None = None,
        host: str | None = None,
        pid: int | None = None,
    ) -> None:
        """Keep a result; it is on the disk when this returns.

        An equal key already done is left, for equal keys have equal bits. ``host``, ``pid``: where it ran, if not here.
        """
        text = json.dumps(result)
        self._end(key, "done", text, _digest(text), None, seconds, host, pid)

    def fail(self, key: str, cause: str, *, seconds: float | None = None) -> None:
        """Keep why a run could not go on."""
        self._end(key, "failed", None, None, cause, seconds, None, None)

    def _end(self, key: str, status: str, *facts: Any) -> None:
        names = ("result", "digest", "cause", "seconds", "host", "pid", "ended", "status")
        result, digest, cause, seconds, host, pid = facts
        where = (host or self._me.host, pid or self._me.pid)
        values = (result, digest, cause, seconds, *where, time.time(), status)
        with self._transaction(durable=True) as connection:
            connection.execute(
                f"INSERT INTO runs (key, study, {', '.join(names)}) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?) ON CONFLICT (key) "
                f"DO UPDATE SET {', '.join(f'{name} = excluded.{name}' for name in names)} WHERE runs.status = 'claimed'",
                (key, self._study, *values),
            )

    def forget_failures(self, points: Sequence[Point]) -> None:
        """Let points be run again that failed before this store was opened."""
        with self._transaction(durable=True) as connection:
            connection.executemany(
                "DELETE FROM runs WHERE status = 'failed' AND key = ? AND ended < ?",
                [(point.key, self._opened) for point in points],
            )

    def release(self) -> None:
        """Give back what was claimed and has not ended."""
        with self._transaction(durable=False) as connection:
            connection.execute("DELETE FROM runs WHERE status = 'claimed' AND owner = ?", (self._me.token,))

    def claims(self) -> list[Claim]:
        """Runs that live processes have taken."""
        with self._lock, self._faults():
            rows = self._connection.execute(
                "SELECT key, label, run, host, pid, started, owner FROM runs WHERE status = 'claimed' "
                "ORDER BY started, run"
            ).fetchall()
            live = {owner: _lives(self._connection, owner) for owner in {row[-1] for row in rows}}
        return [Claim(*row) for row in rows if live[row[-1]]]

    def ended(self) -> list[EndedRun]:
        """All runs that have ended, oldest first."""
        query = "SELECT key, status, seconds, started, ended, owner FROM runs WHERE status != 'claimed' ORDER BY ended"
        with self._lock, self._faults():
            return [EndedRun(*row) for row in self._connection.execute(query)]

    def close(self) -> None:
        """Give back claims and close."""
        self._closed.set()
        # Claims that cannot be given back now are free as soon as this owner is seen to be gone.
        if self._beating is not None:
            with suppress(InputError, RunError):
                self.release()
            self._beating.join()
        self._me.leave()
        with self._lock:
            self._connection.close()

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

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
                raise RunError(
                    f"{self.path}: cannot be written ({error}); finished runs are kept: make room on the disk and start "
                    "again"
                ) from None
            raise InputError([f"{self.path}: cannot be used as a store of runs ({error}); move it away"]) from None


def run_key(scene: dict[str, Any], version: str) -> str:
    """Key of a run: hash of its resolved scene and of the version that ran it."""
    text = json.dumps([version, scene], sort_keys=True)
    return _digest(text)


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _address(path: Path, read_only: bool) -> str:
    """URI of the file. One that is only read is left alone wholly: no log is begun beside it."""
    if not read_only:
        return path.absolute().as_uri()
    logs = (path.with_name(path.name + end) for end in ("-wal", "-journal"))
    return f"{path.absolute().as_uri()}?mode=ro{'' if any(log.exists() for log in logs) else '&immutable=1'}"


def _lives(connection: sqlite3.Connection, owner: str) -> bool:
    row = connection.execute(
        "SELECT host, machine, pid, born, owner, beat FROM owners WHERE owner = ?", (owner,)
    ).fetchone()
    return row is not None and Owner(*row[:5]).lives(row[5])


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
