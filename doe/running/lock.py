"""One process at a time works on a store of runs: its lock, and a note of which study runs in which folder.

The lock is an exclusive transaction of an empty database next to the store. The system ends it with its process, however
that ends, so nothing has to be given back and no clock is read. All stores that a process opens on one file share it.
"""

import json
import sqlite3
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from rbdyn.base.cache import user_cache
from rbdyn.result import read_json

# How long to wait for one who looks whether the lock is free, or is just ending [s].
PATIENCE_S = 2.0
# A note of a study in whose folder nobody works is stale once it is so old [s]; a younger one may be about to begin.
STALE_S = 60.0


@dataclass
class _Session:
    """A lock of this process, and how many stores share it."""

    connection: sqlite3.Connection
    token: str = field(default_factory=lambda: uuid.uuid4().hex)
    users: int = 0


_sessions: dict[Path, _Session] = {}
_guard = threading.Lock()


def seize(store: Path) -> str | None:
    """Take the lock of a store for this process, or share the one it has; returns its token, None where another process has
    it. Each token wants one ``free``. Raises sqlite3.Error where the folder cannot be written."""
    path = store.resolve()
    with _guard:
        if path not in _sessions:
            connection = sqlite3.connect(_file(path), timeout=PATIENCE_S, isolation_level=None, check_same_thread=False)
            try:
                connection.execute("BEGIN EXCLUSIVE")
            except sqlite3.Error as error:
                connection.close()
                if _is_busy(error):
                    return None
                raise
            _sessions[path] = _Session(connection)
        _sessions[path].users += 1
        return _sessions[path].token


def free(store: Path) -> None:
    """Give back what ``seize`` gave; the lock opens with the last one."""
    path = store.resolve()
    with _guard:
        session = _sessions[path]
        session.users -= 1
        if not session.users:
            session.connection.close()
            del _sessions[path]


def is_held(store: Path) -> bool:
    """Whether a process works on a store. Changes nothing."""
    path = store.resolve()
    with _guard:
        if path in _sessions:
            return True
    with suppress(OSError):
        if not _file(path).exists():
            return False
        with closing(sqlite3.connect(f"{_file(path).as_uri()}?mode=ro", timeout=0.0, uri=True)) as connection:
            try:
                connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
            except sqlite3.Error as error:
                return _is_busy(error)
    return False


def _file(store: Path) -> Path:
    return store.with_name(f"{store.name}-lock")


def _is_busy(error: sqlite3.Error) -> bool:
    return getattr(error, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)


@contextmanager
def at_work(study: Path, store: Path) -> Iterator[None]:
    """Note, while it lasts, that this process runs the study of a file on a store.

    Where no note can be written the study runs all the same, and is found by its folder only.
    """
    place = _place()
    note = None if place is None else place / f"{uuid.uuid4().hex}.json"
    with suppress(OSError):
        # A process that was killed has left its note.
        for other in _notes():
            if time.time() - other.path.stat().st_mtime > STALE_S and not is_held(Path(other.store)):
                other.path.unlink(missing_ok=True)
        if note is not None:
            note.parent.mkdir(parents=True, exist_ok=True)
            content = {"study": str(study.resolve()), "store": str(store.resolve())}
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
        mine = {Path(note.store) for note in _notes() if note.study == str(study.resolve())}
        return sorted(store.parent for store in mine if is_held(store))
    return []


class _Note(NamedTuple):
    path: Path
    study: str
    store: str


def _place() -> Path | None:
    base = user_cache()
    return None if base is None else base / "rbdyn" / "at_work"


def _notes() -> Iterator[_Note]:
    place = _place()
    for path in () if place is None else place.glob("*.json"):
        # One that is being written or has just been taken away shows nothing, nor does one that was spoilt.
        with suppress(OSError, ValueError, TypeError, KeyError):
            content = read_json(path)
            study, store = content["study"], content["store"]
            if isinstance(study, str) and isinstance(store, str) and "\0" not in store and Path(store).name:
                yield _Note(path, study, store)
