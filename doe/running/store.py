"""Store of runs on disk: a row for each run in sqlite, by a key of what determines its bits; and the lock of the store.

A result is stored wholly or not at all. sqlite appends it to a write-ahead log in frames with checksums, and reads a
truncated log up to the last whole transaction. Results are committed with ``synchronous = FULL``: they are on the disk when
``put`` returns. Runs under way are committed with ``NORMAL``, because a power cut ends them anyway. Each result has its own
SHA-256, so that a row spoilt later is reported and run again.

One process at a time writes to a store, by the lock of its folder; any number may read it. All stores of one process in one
folder share the lock. A registration states which study runs in which folder.
"""

import json
import os
import re
import socket
import sqlite3
import sys
import threading
import time
import uuid
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import field
from pathlib import Path
from typing import Any, NamedTuple, Self, TypeVar

from rbdyn.base import records
from rbdyn.base.digests import user_cache
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.files import digest_of, read_json
from rbdyn.base.folder import free_lock, is_busy, is_locked, seize_lock
from rbdyn.base.streams import Uninterrupted, escaped
from rbdyn.base.words import shown

T = TypeVar("T")

# Numbers in a sentence: runs that fail for one cause differ only in these.
_NUMBER = re.compile(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?")


class Failure(records.Record):
    """A failed point: its label, the cause, its number in the design (None outside of it) and its factors."""

    label: str
    cause: str
    run: int | None = None
    factors: dict[str, float] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.label}: {self.cause}"


class StoppedError(RunError):
    """Runs were stopped from outside; arguments: the cause, and the fix after which they go on."""

    def __str__(self) -> str:
        return "{}; finished runs are kept: {}".format(*self.args)


class Cause(records.Record):
    """A cause of failures, with their runs, numbered from 1, and their labels."""

    cause: str = records.shown("cause")
    runs: list[int] = records.shown("runs", cell=lambda failure: shown(failure.labels or failure.runs), text=True)
    labels: list[str]


def grouped(failures: Iterable[Failure]) -> list[Cause]:
    """Failures by cause, the most frequent first.

    Causes that differ only in their numbers are one, under the first of them.
    """
    groups = []
    for group in sorted(alike(failures, lambda failure: failure.cause), key=len, reverse=True):
        runs = [failure.run for failure in group if failure.run is not None]
        groups.append(Cause(group[0].cause, runs, [failure.label for failure in group]))
    return groups


def alike(items: Iterable[T], text: Callable[[T], str]) -> list[list[T]]:
    """Groups of items whose texts differ only in their numbers."""
    groups: dict[str, list[T]] = {}
    for item in items:
        groups.setdefault(without_numbers(text(item)), []).append(item)
    return list(groups.values())


def without_numbers(text: str) -> str:
    """A text with a mark for each number."""
    return _NUMBER.sub("#", text)


def sentence(failures: Sequence[Failure]) -> str:
    """All failures in one sentence: each cause once, with its points."""
    return "; ".join(f"{', '.join(group.labels)}: {group.cause}" for group in grouped(failures))


# Name of the store in a folder of results.
STORE = "study.sqlite"
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
# Longest wait for another process that writes [s].
PATIENCE_S = 30.0
# Fixes by the error code of sqlite.
PLACE = "make sure that its folder exists and that both can be written, or name another folder"
FIXES = {
    sqlite3.SQLITE_NOTADB: "it is not a database; move it away or name another folder",
    sqlite3.SQLITE_CORRUPT: "it is damaged; move it away, its runs are then run again",
    sqlite3.SQLITE_BUSY: "another process holds it; start again when that has ended",
    sqlite3.SQLITE_CANTOPEN: PLACE,
    sqlite3.SQLITE_READONLY: PLACE,
}


class Database:
    """A file of runs in this format and version. Raises as ``Store``."""

    def __init__(self, path: Path, read_only: bool) -> None:
        self.path = path
        self._lock = threading.RLock()
        self._reported: set[str] = set()
        if path.is_dir():
            raise InputError(f"{path}: is a folder where a file of runs belongs; move it away or name another folder")
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
            # Another process has just made it and not yet written to it.
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
        # The first version had only a table of results.
        if tables == {"runs"}:
            version = "1"
        if version != VERSION:
            if not version:
                raise InputError(f"{self.path}: not a store of runs; move it away or name another folder")
            newer = version.isdigit() and int(version) > int(VERSION)
            fix = "install the newer doe that made it" if newer else "move it away"
            raise InputError(f"{self.path}: a store of version {version}, not {VERSION}; {fix} or name another folder")
        (sound,) = self._connection.execute("PRAGMA quick_check(1)").fetchone()
        if sound != "ok":
            raise InputError(f"{self.path}: damaged ({sound}); move it away, its runs are then run again")
        if not read_only:
            _patiently(self._connection, "PRAGMA journal_mode=WAL")

    def _tables(self) -> set[str]:
        rows = _patiently(self._connection, "SELECT name FROM sqlite_master WHERE type = 'table'")
        return {name for (name,) in rows}

    def _tell(self, things: Sequence[str], sentence: str) -> None:
        """Print a sentence on standard error, unless all ``things`` were reported before."""
        if not self._reported.issuperset(things):
            self._reported.update(things)
            print(escaped(f"{self.path}: {sentence}"), file=sys.stderr)

    @contextmanager
    def _transaction(self, durable: bool) -> Iterator[sqlite3.Connection]:
        # Ctrl-C between the lock, the begin of the transaction and its end would leave both taken.
        with Uninterrupted(), self._lock, self._faults():
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
        """Raises InputError or StoppedError with one sentence for an error of sqlite."""
        try:
            yield
        except sqlite3.Error as error:
            if getattr(error, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_FULL, sqlite3.SQLITE_IOERR):
                cause = f"{self.path}: cannot be written ({error})"
                raise StoppedError(cause, "free space on the disk and start again") from None
            fix = FIXES.get(getattr(error, "sqlite_errorcode", 0) & 0xFF, "move it away")
            raise InputError(f"{self.path}: cannot be used as a store of runs ({error}); {fix}") from None


def _address(path: Path, read_only: bool) -> str:
    """URI of the file. Reading alone changes nothing: no log is begun next to the file."""
    if not read_only:
        return path.absolute().as_uri()
    logs = (path.with_name(path.name + end) for end in ("-wal", "-journal"))
    return f"{path.absolute().as_uri()}?mode=ro{'' if any(log.exists() for log in logs) else '&immutable=1'}"


def _patiently(connection: sqlite3.Connection, statement: str) -> list[Any]:
    """Run a statement that another process may delay while it opens the store."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        try:
            return connection.execute(statement).fetchall()
        except sqlite3.OperationalError as error:
            if not is_busy(error) or time.monotonic() > deadline:
                raise
            time.sleep(0.05)


class Point(records.Record):
    """A run to do: its key, label, number in the design and factors."""

    key: str
    label: str
    run: int | None = None
    factors: Mapping[str, float] = field(default_factory=dict)


class CurrentRun(records.Record):
    """A run under way: its key, label and number, where it runs, and since when [s since the epoch]."""

    key: str
    label: str
    run: int | None
    host: str
    pid: int
    since: float


class EndedRun(records.Record):
    """An ended run: its status, "done" or "failed", and its duration [s], None for a result without one."""

    key: str
    status: str
    seconds: float | None


Record = dict[str, Any]
RunResult = Record | Failure
# Check of a stored result by the reader of the store; None: every result is sound.
Sound = Callable[[Record], bool] | None


class Store(Database):
    """Results by key, failures with their causes, and current runs."""

    def __init__(self, path: Path, study: str = "", read_only: bool = False) -> None:
        """Open or make the store; ``study`` is noted with each run.

        Raises InputError for a file that is no store, has another version, or belongs to another live process; RunError if
        the disk is full.
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
        """Take the lock, and end the current runs of earlier processes."""
        with self._faults():
            token = seize_lock(self.path.parent)
        if token is None:
            raise InputError(
                f"{self.path}: {self._holder()} works on it; wait until it has ended, or name another folder"
            )
        self._token = token
        if self._meta("lock") == token:
            return
        try:
            with self._transaction(durable=False) as connection:
                connection.execute("DELETE FROM runs WHERE status = 'claimed'")
                facts = {"lock": token, "holder": f"process {os.getpid()} on {socket.gethostname()}"}
                connection.executemany("INSERT OR REPLACE INTO meta VALUES (?, ?)", facts.items())
        except BaseException:
            free_lock(self.path.parent)
            raise

    def _meta(self, name: str) -> str | None:
        with self._lock, self._faults():
            row = self._connection.execute("SELECT value FROM meta WHERE name = ?", (name,)).fetchone()
        return None if row is None else str(row[0])

    def _holder(self) -> str:
        """The process that works on the store, in words."""
        return self._meta("holder") or "another process"

    def get(self, key: str) -> Record | None:
        """The stored result, or None."""
        outcome = self.outcomes([Point(key, key)]).get(key)
        return outcome if isinstance(outcome, dict) else None

    def outcomes(self, points: Sequence[Point], sound: Sound = None) -> dict[str, RunResult]:
        """Results and failures of the points that have ended, by key.

        A row that is spoilt or not ``sound`` is reported on standard error and counts as missing.
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
        """Note that a run is under way from now on; it replaces a spoilt row."""
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
        """Store a result; it is on the disk when this returns.

        A finished row of the same key stays, because equal keys have equal bits. ``host``, ``pid``: where it ran, if not here.
        """
        text = json.dumps(result)
        self._end(key, status="done", result=text, digest=digest_of(text), seconds=seconds, host=host, pid=pid)

    def fail(self, key: str, cause: str, *, seconds: float | None = None) -> None:
        """Store the cause of a failed run."""
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

    def adopt(self, path: Path) -> None:
        """Copy ended runs from the store at ``path`` that this one lacks. Raises as ``Store``."""
        with Store(path, read_only=True) as other, other._faults():
            columns = (
                "key, status, result, digest, cause, study, label, run, factors, started, ended, seconds, host, pid"
            )
            rows = other._connection.execute(f"SELECT {columns} FROM runs WHERE status != 'claimed'")
            with self._transaction(durable=True) as connection:
                marks = ", ".join("?" * len(columns.split(",")))
                connection.executemany(f"INSERT OR IGNORE INTO runs ({columns}) VALUES ({marks})", rows)

    def forget_failures(self, points: Sequence[Point]) -> None:
        """Delete failures of points from before this store was opened, so that they run again."""
        with self._transaction(durable=True) as connection:
            connection.executemany(
                # A failure in the future was dated by another clock.
                "DELETE FROM runs WHERE status = 'failed' AND key = ? AND ended NOT BETWEEN ? AND ?",
                [(point.key, self._opened, time.time()) for point in points],
            )

    def sign(self, kind: str) -> None:
        """Delete notes of a ``kind`` by earlier processes."""
        with self._transaction(durable=False) as connection:
            statement = "DELETE FROM meta WHERE name LIKE ? || '%' AND name != ?"
            connection.execute(statement, (kind, kind + self._token))

    def note(self, kind: str, text: str) -> None:
        """Store the note of a ``kind``; each process has one."""
        with self._transaction(durable=False) as connection:
            connection.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (kind + self._token, text))

    def notes(self, kind: str) -> list[tuple[str, bool]]:
        """Notes of a ``kind``, each with whether its process lives."""
        live = kind + (self._meta("lock") or "") if is_locked(self.path.parent) else None
        with self._lock, self._faults():
            rows = self._connection.execute("SELECT name, value FROM meta WHERE name LIKE ? || '%'", (kind,)).fetchall()
        return [(text, name == live) for name, text in rows]

    def release(self) -> None:
        """Delete runs that have not ended."""
        with self._transaction(durable=False) as connection:
            connection.execute("DELETE FROM runs WHERE status = 'claimed'")

    def running(self) -> list[CurrentRun]:
        """Runs that a live process has under way."""
        if not is_locked(self.path.parent):
            return []
        with self._lock, self._faults():
            rows = self._connection.execute(
                "SELECT key, label, run, host, pid, iif(typeof(started) = 'real', started, 0.0) "
                "FROM runs WHERE status = 'claimed' ORDER BY started, run"
            ).fetchall()
        return [CurrentRun(*row) for row in rows]

    def ended(self) -> list[EndedRun]:
        """All runs that have ended, oldest first."""
        with self._lock, self._faults():
            rows = self._connection.execute(
                "SELECT key, status, iif(typeof(seconds) = 'real', seconds, NULL) FROM runs "
                "WHERE status != 'claimed' AND typeof(ended) = 'real' ORDER BY ended"
            )
            return [EndedRun(*row) for row in rows]

    def close(self) -> None:
        """Close the file, and free the lock unless another store of this process shares it."""
        with self._lock:
            self._connection.close()
        if self._token:
            self._token = ""
            free_lock(self.path.parent)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *ended: object) -> None:
        self.close()


def _outcome(point: Point, sound: Sound, status: str, result: Any, digest: Any, cause: Any) -> RunResult | None:
    """Result or failure in the row of an ended run; None for a spoilt row."""
    if status == "failed":
        return Failure(point.label, cause, point.run, dict(point.factors)) if isinstance(cause, str) else None
    if not isinstance(result, str) or digest_of(result) != digest:
        return None
    try:
        record = json.loads(result)
    except ValueError:
        return None
    return record if isinstance(record, dict) and (sound is None or sound(record)) else None


# Age [s] from which a registration without a lock is stale; a younger one may be about to begin.
STALE_S = 60.0


@contextmanager
def at_work(study: Path, store: Path) -> Iterator[None]:
    """Register, while the context lasts, that this process runs the study of a file on a store.

    Without a writable registry the study runs too, and is found by its folder only.
    """
    place = _registry()
    note = None if place is None else place / f"{uuid.uuid4().hex}.json"
    with suppress(OSError):
        # A killed process leaves its registration behind.
        for other in _registrations():
            if time.time() - other.path.stat().st_mtime > STALE_S and not is_locked(Path(other.store).parent):
                other.path.unlink(missing_ok=True)
        if note is not None:
            note.parent.mkdir(parents=True, exist_ok=True)
            content = {"study": os.path.realpath(study), "store": os.path.realpath(store)}
            note.write_text(json.dumps(content), encoding="utf-8")
    try:
        yield
    finally:
        with suppress(OSError):
            if note is not None:
                note.unlink(missing_ok=True)


def folders_of(study: Path) -> list[Path]:
    """Folders in which live processes of this machine and user run the study of a file."""
    with suppress(OSError):
        mine = {Path(note.store) for note in _registrations() if note.study == os.path.realpath(study)}
        return sorted(store.parent for store in mine if is_locked(store.parent))
    return []


class _Registration(NamedTuple):
    path: Path
    study: str
    store: str


def _registry() -> Path | None:
    base = user_cache()
    return None if base is None else base / "rbdyn" / "at_work"


def _registrations() -> Iterator[_Registration]:
    place = _registry()
    for path in () if place is None else place.glob("*.json"):
        # Unfinished, deleted and spoilt registrations are skipped.
        with suppress(OSError, ValueError, TypeError, KeyError):
            content = read_json(path)
            study, store = content["study"], content["store"]
            if isinstance(study, str) and isinstance(store, str) and "\0" not in store and Path(store).name:
                yield _Registration(path, study, store)
