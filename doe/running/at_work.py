"""Which studies run just now and in which folder: a note of each, so that it can be found from its file alone."""

import json
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from doe.running.owner import Owner, this_process


@contextmanager
def at_work(study: Path, folder: Path) -> Iterator[None]:
    """Note, while it lasts, that this process runs the study of a file in a folder.

    Where no note can be written the study runs all the same, and is found by its folder only.
    """
    owner = this_process()
    owner.enter()
    note = _place() / f"{owner.token}.json"
    with suppress(OSError):
        note.parent.mkdir(parents=True, exist_ok=True)
        # A process that was killed has left its note.
        for other, _, gone in _notes():
            if gone.host == socket.gethostname() and not gone.lives(other.stat().st_mtime):
                other.unlink(missing_ok=True)
        told = {"study": str(study.resolve()), "folder": str(folder.resolve()), "owner": asdict(owner)}
        note.write_text(json.dumps(told), encoding="utf-8")
    try:
        yield
    finally:
        owner.leave()
        with suppress(OSError):
            note.unlink(missing_ok=True)


def folders_of(study: Path) -> list[Path]:
    """Folders in which live processes of this machine and user run the study of a file."""
    with suppress(OSError):
        return sorted(
            {
                Path(told["folder"])
                for note, told, owner in _notes()
                if told["study"] == str(study.resolve()) and owner.lives(note.stat().st_mtime)
            }
        )
    return []


def _place() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "rbdyn" / "at_work"


def _notes() -> Iterator[tuple[Path, dict[str, Any], Owner]]:
    for note in _place().glob("*.json"):
        # One that is being written or has just been taken away tells nothing.
        with suppress(OSError, ValueError, TypeError, KeyError):
            told = json.loads(note.read_text(encoding="utf-8"))
            yield note, told, Owner(**told["owner"])
