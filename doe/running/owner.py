"""Which process works on a run, and whether it still lives; which studies run just now and in which folder: a note of each,
so that it can be found from its file alone."""

import functools
import json
import os
import socket
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import NamedTuple

from rbdyn.records.user_cache import user_cache
from rbdyn.result import read_json

# A process of another machine that has not given a sign of life for so long [s] counts as gone. One whose clock is behind
# by more than this seems gone too soon, and its runs are run twice; of one dated ahead see ``Owner.lives``.
LEASE_S = 60.0
# Signs of life are given as often as this [s].
BEAT_S = 5.0

# Owners of this process whose store is open.
_open: set[str] = set()
# Last sign of life of owners elsewhere, and when this process first saw it [s], by a clock that nobody sets.
_seen: dict[str, tuple[float, float]] = {}


@dataclass(frozen=True)
class Owner:
    """One open store of one process. ``machine`` tells apart hosts, their boots and their spaces of process numbers;
    ``born`` tells apart processes that had the same number one after the other."""

    host: str
    machine: str
    pid: int
    born: str
    token: str = field(default_factory=lambda: uuid.uuid4().hex)

    def enter(self) -> None:
        """This owner lives from here on."""
        _open.add(self.token)

    def leave(self) -> None:
        """This owner is gone, even if its process lives on."""
        _open.discard(self.token)

    def lives(self, beat: float) -> bool:
        """Whether it may still be at work; ``beat``: its last sign of life [s since the epoch].

        On the same machine the process itself is looked at, so a killed one is known at once; elsewhere a lease runs, from
        the sign's date, or, where that lies ahead of this machine's clock, from when the sign was first seen here.
        """
        if self.machine != _machine():
            if _seen.get(self.token, (None,))[0] != beat:
                _seen[self.token] = (beat, time.monotonic())
            return time.time() - beat < LEASE_S and time.monotonic() - _seen[self.token][1] < LEASE_S
        if self.pid == os.getpid() and self.born == _born(self.pid):
            return self.token in _open
        return _born(self.pid) == self.born


def this_process() -> Owner:
    """A new owner in this process."""
    return Owner(socket.gethostname(), _machine(), os.getpid(), _born(os.getpid()))


@functools.cache
def _machine() -> str:
    boot, space = "", ""
    with suppress(OSError):
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
    with suppress(OSError):
        space = os.readlink("/proc/self/ns/pid")
    return f"{socket.gethostname()}/{boot}/{space}"


def _born(pid: int) -> str:
    """When a process of this machine started, in the words of its system; empty when there is no such process."""
    try:
        # Field 2 is the name in brackets, which may hold blanks; state is field 3, start time field 22.
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except FileNotFoundError:
        return "" if Path("/proc/self/stat").exists() else _answers(pid)
    except OSError:
        return ""
    # A killed process that nobody has fetched yet is a zombie: it does nothing any more.
    return "" if fields[0] in "ZX" else fields[19]


def _answers(pid: int) -> str:
    """The same where the system has no /proc: only whether it lives."""
    try:
        os.kill(pid, 0)
    except OSError as error:
        return "" if isinstance(error, ProcessLookupError) else "alive"
    return "alive"


@contextmanager
def at_work(study: Path, folder: Path) -> Iterator[None]:
    """Note, while it lasts, that this process runs the study of a file in a folder.

    Where no note can be written the study runs all the same, and is found by its folder only.
    """
    owner, place = this_process(), _place()
    owner.enter()
    note = None if place is None else place / f"{owner.token}.json"
    with suppress(OSError):
        # A process that was killed has left its note.
        for other in _notes():
            if other.owner.host == socket.gethostname() and not other.owner.lives(other.path.stat().st_mtime):
                other.path.unlink(missing_ok=True)
        if note is not None:
            note.parent.mkdir(parents=True, exist_ok=True)
            content = {"study": str(study.resolve()), "folder": str(folder.resolve()), "owner": asdict(owner)}
            note.write_text(json.dumps(content), encoding="utf-8")
    try:
        yield
    finally:
        owner.leave()
        with suppress(OSError):
            if note is not None:
                note.unlink(missing_ok=True)


def folders_of(study: Path) -> list[Path]:
    """Folders in which live processes of this machine and user run the study of a file."""
    with suppress(OSError):
        return sorted(
            {
                Path(note.folder)
                for note in _notes()
                if note.study == str(study.resolve()) and note.owner.lives(note.path.stat().st_mtime)
            }
        )
    return []


class _Note(NamedTuple):
    path: Path
    study: str
    folder: str
    owner: Owner

    @property
    def whole(self) -> bool:
        """Whether each field is of the kind that was written."""
        texts = (self.study, self.folder, *(getattr(self.owner, name) for name in ("host", "machine", "born", "token")))
        return all(isinstance(text, str) for text in texts) and type(self.owner.pid) is int


def _place() -> Path | None:
    base = user_cache()
    return None if base is None else base / "rbdyn" / "at_work"


def _notes() -> Iterator[_Note]:
    place = _place()
    for path in () if place is None else place.glob("*.json"):
        # One that is being written or has just been taken away tells nothing, nor does one that was spoilt.
        with suppress(OSError, ValueError, TypeError, KeyError):
            content = read_json(path)
            note = _Note(path, content["study"], content["folder"], Owner(**content["owner"]))
            if note.whole:
                yield note
