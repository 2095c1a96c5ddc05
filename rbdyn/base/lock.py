"""Lock of a folder: one process at a time writes to it, any number may read it.

The lock is an exclusive transaction of an empty sqlite database in the folder. The system ends it with its process, so no lock
outlives its owner and no clock is read. All users in one process share the lock, unless one asks to be alone. The last one
removes the file.
"""

import os
import sqlite3
import threading
import uuid
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path

NAME = ".made_by.lock"
# Longest wait for a process that tests the lock or is just ending [s].
PATIENCE_S = 2.0


@dataclass
class _Session:
    """A lock of this process, and the number of its users."""

    connection: sqlite3.Connection
    token: str = field(default_factory=lambda: uuid.uuid4().hex)
    users: int = 0


_sessions: dict[str, _Session] = {}
_guard = threading.Lock()


def seize_lock(folder: Path, alone: bool = False) -> str | None:
    """Take or share the lock of a folder for this process. Returns its token, None if another process has it.

    ``alone``: also None if this process has it already. Each token needs one ``free_lock``. Raises sqlite3.Error for a
    folder that cannot be written.
    """
    path = os.path.realpath(folder)
    with _guard:
        if path in _sessions and alone:
            return None
        if path not in _sessions:
            connection = _connected(Path(path, NAME))
            if connection is None:
                return None
            _sessions[path] = _Session(connection)
        _sessions[path].users += 1
        return _sessions[path].token


def _connected(file: Path) -> sqlite3.Connection | None:
    """A connection that holds the file for itself; None if another process does."""
    while True:
        file.touch()
        before = _identity(file)
        connection = sqlite3.connect(file, timeout=PATIENCE_S, isolation_level=None, check_same_thread=False)
        try:
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.Error as error:
            connection.close()
            if is_busy(error):
                return None
            if _identity(file) != before:
                continue
            raise
        if before is not None and _identity(file) == before:
            return connection
        # The former owner has removed the file that was opened.
        connection.close()


def _identity(file: Path) -> tuple[int, int] | None:
    """What tells a file from a later one of its name; None without a file."""
    with suppress(OSError):
        status = file.stat()
        return status.st_ino, status.st_ctime_ns
    return None


def free_lock(folder: Path) -> None:
    """Give back a token of ``seize_lock``; the last one frees the lock."""
    path = os.path.realpath(folder)
    with _guard:
        session = _sessions[path]
        session.users -= 1
        if not session.users:
            with suppress(OSError):
                Path(path, NAME).unlink(missing_ok=True)
            session.connection.close()
            del _sessions[path]


def is_locked(folder: Path) -> bool:
    """Whether a process works in a folder. It changes nothing."""
    path = os.path.realpath(folder)
    with _guard:
        if path in _sessions:
            return True
    lock = Path(path, NAME)
    with suppress(OSError):
        if not lock.exists():
            return False
        with closing(sqlite3.connect(f"{lock.as_uri()}?mode=ro", timeout=0.0, uri=True)) as connection:
            try:
                connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
            except sqlite3.Error as error:
                return is_busy(error)
    return False


def is_busy(error: sqlite3.Error) -> bool:
    """Whether an error of sqlite says that another connection holds the file."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED)
