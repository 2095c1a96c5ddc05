"""The folder that ``--out`` names: what a command may write there, its lock, and the list of the files that it made.

A folder belongs to one command and one file. Its ``made_by.json`` names both, and lists each file made with its SHA-256. A
command writes over a file only if it is on that list and unchanged, or with ``force``; it never writes over a file that it
read. Names that differ only in case count as one, because some disks take them for one. A link counts as a file of
somebody else.

All files of a command are first written to a folder within the folder and then moved into place, so an interruption leaves
whole files: old ones, or new ones.

One process at a time writes to a folder, any number may read it. Its lock is an exclusive transaction of an empty sqlite database in the folder. The system ends it with its process, so no lock
outlives its owner and no clock is read. All users in one process share the lock, unless one asks to be alone. The last one
removes the file.
"""

import os
import shutil
import socket
import sqlite3
import threading
import unicodedata
import uuid
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, TypeVar

from rbdyn.base.faults import InputError, files_read, read_bytes, record_read, recorded_reads, refuse
from rbdyn.base.files import digest_of, digest_of_file, naming, read_json, write_json
from rbdyn.base.streams import Uninterrupted

T = TypeVar("T")
# File that names the command and the input of a folder of results, and the folder of files that are not yet whole.
MARK, PARTIAL = "made_by.json", ".made_by.partial"
LOCK = ".made_by.lock"
OWN = {MARK, PARTIAL, LOCK, f"{LOCK}-journal"}
# Most names in a sentence.
FILES_NAMED = 3


class OutputFolder:
    """An output folder of a command; without a ``path`` nothing is written.

    ``files``: patterns of the names that the command may write. ``keeps``: names of files that it changes while it runs.
    """

    def __init__(
        self, path: Path | None, command: str, files: Sequence[str], keeps: Sequence[str] = (), force: bool = False
    ) -> None:
        self.path, self.files, self._command, self._force, self._keeps = path, files, command, force, keeps
        self._patterns = [_folded(name) for name in (*files, *keeps, MARK)]
        self._mark: dict[str, Any] = {}
        self._locked = self._new = False

    def claim(self, source: Path | None = None, *others: Path) -> None:
        """Make the folder and lock it for results of the file ``source``; ``others``: files that are read later.

        Raises InputError before anything is written: where a file is in the way, for the folder of another command or file,
        and where another process works in the folder.
        """
        path = self.path
        if path is None:
            return
        owner = self._owner(path, source)
        for other in others:
            record_read(other)
        try:
            self._check(path, owner)
            self._new = not path.exists()
            path.mkdir(parents=True, exist_ok=True)
            if seize_lock(path, alone=True) is None:
                raise InputError(
                    f"--out {path}: {self._holder(path)} works in it; wait until it has ended, or name another folder"
                )
            self._locked = True
            earlier = self._check(path, owner)
            shutil.rmtree(path / PARTIAL, ignore_errors=True)
            made = _resolved(path, _lists(earlier)) | dict.fromkeys(self._keeps)
            self._mark = {**owner, "process": f"process {os.getpid()} on {socket.gethostname()}", "files": made}
            write_json(path / MARK, self._mark)
        except (OSError, sqlite3.Error) as error:
            reason = getattr(error, "strerror", None) or error
            raise InputError(f"--out {path}: cannot be written to ({reason}); name another folder") from None

    def write(self, make: Callable[[Path], T], last: str = "") -> T:
        """Let ``make`` write files into a folder, and move them into this one; returns what ``make`` returns.

        ``last``: the file that marks the others as complete. Its old version goes first and its new one comes last. Raises
        InputError where a file of somebody else has come into the way meanwhile; OSError that names its file.
        """
        assert self.path is not None
        stage = self.path / PARTIAL
        try:
            stage.mkdir(exist_ok=True)
            with naming(lambda: self.path / _newest(stage)):  # type: ignore[operator]
                made = make(stage)
            with Uninterrupted():
                self._move(self.path, stage, last)
        finally:
            shutil.rmtree(stage, ignore_errors=True)
        return made

    def close(self) -> None:
        """Free the lock; a folder that the command made for nothing goes."""
        if self.path is None or not self._locked:
            return
        with suppress(OSError):
            names = set(os.listdir(self.path))
            if self._new and names <= OWN:
                (self.path / MARK).unlink()
            else:
                made = self._mark["files"].items()
                self._mark["files"] = {name: digest for name, digest in made if digest or name in names}
                write_json(self.path / MARK, {key: value for key, value in self._mark.items() if key != "process"})
        self._locked = False
        free_lock(self.path)
        if self._new:
            with suppress(OSError):
                self.path.rmdir()

    def _owner(self, path: Path, source: Path | None) -> dict[str, str]:
        """The command, its file relative to the folder, so that both can move together, and the digest of that file.

        A file that can be read only once, such as a pipe, has no place.
        """
        if source is None:
            return {"command": self._command, "file": "", "sha256": ""}
        digest, real = digest_of(read_bytes(source)), os.path.realpath(source)
        file = os.path.relpath(real, os.path.realpath(path)) if os.path.isfile(real) else ""
        return {"command": self._command, "file": file, "sha256": digest}

    def _holder(self, path: Path) -> str:
        """The process that works in the folder, in words."""
        with suppress(OSError, ValueError, KeyError, TypeError):
            return str(read_json(path / MARK)["process"])
        return "another process"

    def _check(self, path: Path, owner: dict[str, str]) -> dict[str, Any]:
        """The note of the command that wrote here before; empty without one. Raises InputError."""
        try:
            entries = {entry.name: entry for entry in os.scandir(path)}
        except FileNotFoundError:
            return {}
        earlier: dict[str, Any] = {}
        try:
            if MARK in entries:
                earlier = _checked(read_json(path / MARK), entries[MARK])
        except (OSError, ValueError, KeyError, TypeError):
            if not self._force:
                raise InputError(
                    f"--out {path}: its {MARK} cannot be read; name another folder, remove this one or add --force"
                ) from None
        if earlier and entries.keys() - OWN and not self._force and not _same_owner(owner, earlier):
            source = os.path.normpath(path / earlier["file"]) if earlier["file"] else "another input"
            raise InputError(
                f"--out {path}: holds results of {earlier['command']} from {source}; "
                "name another folder or remove this one"
            )
        refuse(self._conflicts(path, entries.values(), _lists(earlier)))
        return earlier

    def _conflicts(self, path: Path, entries: Iterable[os.DirEntry[str]], made: dict[str, Any]) -> Iterator[str]:
        """Sentences on the entries of the folder that the command would write over and must not."""
        inputs, folders, foreign = list[str](), list[str](), list[str]()
        for entry in sorted(entries, key=lambda entry: entry.name):
            if not any(fnmatchcase(_folded(entry.name), pattern) for pattern in self._patterns):
                continue
            if entry.is_dir():
                folders.append(entry.name)
            elif _is_read(entry):
                inputs.append(entry.name)
            elif not self._force and not _is_ours(entry, made):
                foreign.append(entry.name)
        if inputs:
            yield f"--out {path}: {_listed(inputs)} would be written over, but this command reads it; name another folder"
        if folders:
            yield f"--out {path}: {_listed(folders)} is a folder where a file belongs; move it away or name another folder"
        if foreign:
            yield (
                f"--out {path}: {_listed(foreign)} would be written over, but {self._command} did not make it or it was changed "
                "since; name another folder, move it away or add --force"
            )

    def _move(self, path: Path, stage: Path, last: str) -> None:
        """Move all files of ``stage`` into place. At every moment the note lists what is in the folder."""
        names = sorted((entry.name for entry in os.scandir(stage)), key=lambda name: (name == last, name))
        for name in names:
            assert any(fnmatchcase(_folded(name), pattern) for pattern in self._patterns), f"{name} is not declared"
        folded = {_folded(name) for name in names}
        present = [entry for entry in os.scandir(path) if _folded(entry.name) in folded]
        refuse(self._conflicts(path, present, self._mark))
        made = self._mark["files"]
        self._mark["replaced"] = {entry.name: _digest(Path(entry.path)) for entry in present if entry.is_file()}
        made |= {name: digest_of_file(stage / name) for name in names}
        write_json(path / MARK, self._mark)
        if last:
            (path / last).unlink(missing_ok=True)
        for name in names:
            os.replace(stage / name, path / name)
        del self._mark["replaced"]
        write_json(path / MARK, self._mark)


@contextmanager
def output_folder(
    path: Path | None, command: str, files: Sequence[str], keeps: Sequence[str] = (), force: bool = False
) -> Iterator[OutputFolder]:
    """The folder ``path`` of a command, which notes all files that the command reads from now on; see ``OutputFolder``.

    The command must claim it once it has read its input, and before it runs anything.
    """
    folder = OutputFolder(path, command, files, keeps, force)
    with recorded_reads():
        try:
            yield folder
        finally:
            folder.close()


def files_in(folder: Path, patterns: Sequence[str]) -> list[str]:
    """Names of the files in a folder, in the order of the patterns of a command."""
    names = sorted(os.listdir(folder))
    return [name for pattern in patterns for name in names if fnmatchcase(name, pattern)]


def _folded(name: str) -> str:
    """A name as disks compare it that take capitals and small letters for one."""
    return unicodedata.normalize("NFC", name).casefold()


def _lists(mark: dict[str, Any]) -> dict[str, Any]:
    """The lists of a note: files made, and of an interrupted command also those that it was replacing."""
    return {name: dict(mark[name]) for name in ("files", "replaced") if name in mark} or {"files": {}}


def _checked(mark: Any, entry: os.DirEntry[str]) -> dict[str, Any]:
    """The note as read. Raises ValueError, KeyError or TypeError for anything else."""
    texts = [mark[key] for key in ("command", "file", "sha256")]
    lists = [value for pairs in _lists(mark).values() for value in pairs.values()]
    if entry.is_symlink() or "files" not in mark or not all(isinstance(text, str) for text in texts):
        raise TypeError(mark)
    if not all(value is None or isinstance(value, str) for value in lists):
        raise TypeError(lists)
    return dict(mark)


def _same_owner(owner: dict[str, str], other: dict[str, Any]) -> bool:
    """Whether two notes are of one command on one file: the same place or the same content."""
    same_place = owner["file"] != "" and owner["file"] == other["file"]
    return owner["command"] == other["command"] and (same_place or owner["sha256"] == other["sha256"])


def _is_read(entry: os.DirEntry[str]) -> bool:
    """Whether an entry is a file that the command read, under any name."""
    with suppress(OSError):
        status = os.stat(entry.path)
        return (status.st_dev, status.st_ino) in files_read()
    return False


def _is_ours(entry: os.DirEntry[str], made: dict[str, Any]) -> bool:
    """Whether the lists of a note hold the file as it is."""
    digests = [names[entry.name] for names in _lists(made).values() if entry.name in names]
    if entry.name == MARK:
        return not entry.is_symlink()
    if entry.is_symlink() or not digests:
        return False
    return None in digests or _digest(Path(entry.path)) in digests


def _resolved(path: Path, lists: dict[str, Any]) -> dict[str, str | None]:
    """The files of a note with the digest of each that an interrupted command did not come to replace."""
    old = {name: digest for name, digest in lists.get("replaced", {}).items() if digest == _digest(path / name)}
    return lists["files"] | old


def _digest(path: Path) -> str:
    """SHA-256 of a file; empty where it cannot be read."""
    with suppress(OSError):
        return digest_of_file(path)
    return ""


def _newest(stage: Path) -> str:
    """Name of the file that was written last."""
    entries = sorted(os.scandir(stage), key=lambda entry: entry.stat().st_mtime_ns)
    return entries[-1].name if entries else ""


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - FILES_NAMED} more" if len(names) > FILES_NAMED else ""
    return f"{', '.join(names[:FILES_NAMED])}{more}"


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
            connection = _connected(Path(path, LOCK))
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
                Path(path, LOCK).unlink(missing_ok=True)
            session.connection.close()
            del _sessions[path]


def is_locked(folder: Path) -> bool:
    """Whether a process works in a folder. It changes nothing."""
    path = os.path.realpath(folder)
    with _guard:
        if path in _sessions:
            return True
    lock = Path(path, LOCK)
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
