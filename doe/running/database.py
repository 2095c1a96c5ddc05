"""The sqlite file beneath a store: opened, checked, written in transactions; what goes wrong is one sentence with its mend."""

import sqlite3
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from doe.running.failure import StoppedError
from rbdyn.faults import InputError

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
# What mends a complaint of sqlite.
PLACE = "see that its folder is there and that both can be written, or name another folder"
MENDS = {
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
            mend = "install the newer doe that made it" if newer else "move it away"
            raise InputError([f"{self.path}: {what}; {mend} or name another folder"])
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
                what, mend = f"{self.path}: cannot be written ({error})", "make room on the disk and start again"
                raise StoppedError(what, mend) from None
            mend = MENDS.get(getattr(error, "sqlite_errorcode", 0) & 0xFF, "move it away")
            raise InputError([f"{self.path}: cannot be used as a store of runs ({error}); {mend}"]) from None


def _address(path: Path, read_only: bool) -> str:
    """URI of the file. One that is only read is left alone wholly: no log is begun beside it."""
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
