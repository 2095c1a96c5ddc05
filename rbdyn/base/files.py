"""Files of results: JSON that is written as a whole or not at all, and the versions that the bits of a result depend on.

A long command resumes from its checkpoint: finished parts, a line each in a file next to the results. Each line begins with the SHA-256 of the rest; a damaged line is ignored.
"""

import functools
import hashlib
import json
import os
import platform
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any, TypeVar

from rbdyn.base.digests import source_digest
from rbdyn.base.faults import InputError, check_bounds, path_of, read_text

Saved = TypeVar("Saved")
# Read from the installed files, which takes half a millisecond.
version_of = functools.cache(version)


def read_record(path: Path | str, form: str, what: str, restore: Callable[[dict[str, Any]], Saved]) -> Saved:
    """A ``what`` saved as JSON in the format ``form``, made by ``restore``.

    Raises InputError when the file is missing, has another format or is not whole.
    """
    if not path_of(path).is_file():
        raise InputError(f"{path}: cannot be read (no such file); check the path")
    text = read_text(Path(path))
    try:
        data = json.loads(text)
    except (ValueError, RecursionError):
        data = None
    saved = data.get("format") if isinstance(data, dict) else None
    if saved != form:
        same = isinstance(saved, str) and saved.partition("/")[0] == form.partition("/")[0]
        if not isinstance(saved, str):
            raise InputError(f"{path}: not a saved {what}; check the path")
        fix = "run the scene again" if same else f"name a saved {what}"
        raise InputError(f"{path}: format is {saved}, not {form}; {fix}")
    try:
        return restore(check_bounds(data, str(path)))
    except (AttributeError, KeyError, TypeError, ValueError):
        raise InputError(f"{path}: not a whole {what}; run the scene again") from None


def read_json(path: Path | str) -> Any:
    """JSON of a file. Raises OSError, and ValueError where it is no JSON or nested too deep."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except RecursionError:
        raise ValueError("nested too deep") from None


def write_json(path: Path | str, data: Mapping[str, Any], record: Callable[[Any], Any] | None = None) -> None:
    """Write JSON so that an interruption, or another process, leaves the old file or the new one, never a part of it.

    The text is written as it is made, and ``record`` gives that of each object that JSON does not know, one at a time.
    """
    with whole_file(path) as new, new.open("w", encoding="utf-8") as file:
        json.dump(data, file, indent=1, allow_nan=False, default=record)
        file.write("\n")


def place_of_file(path: Path | str) -> Path:
    """The path of a file to write. Raises InputError where no file can be."""
    path = path_of(path)
    if path.is_dir() or not path.name:
        raise InputError(f"{path}: is a folder; name a file in it")
    if not path.parent.is_dir():
        raise InputError(f"{path}: missing folder {path.parent}; make it first")
    return path


@contextmanager
def whole_file(path: Path | str) -> Iterator[Path]:
    """A file to write, which then replaces ``path``: a reader gets the old one or the new one.

    A failure or an interruption leaves no part of the new one. Raises InputError for a path where no file can be.
    """
    path = place_of_file(path)
    partial = path.with_name(f"{path.name}.{os.getpid()}.partial")
    try:
        with naming(lambda: path):
            yield partial
            os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def naming(path: Callable[[], Path]) -> Iterator[None]:
    """Let an error of the disk name a file, which it does not do where writing fails: ``path`` finds it then."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno is not None:
            error.filename = str(path())
        raise


def versions() -> dict[str, str]:
    """Versions that the bits of a result depend on."""
    packages = {name: version_of(name) for name in ("rbdyn", "numpy", "numba")}
    return {**packages, "python": platform.python_version(), "machine": platform.machine()}


class Checkpoint:
    """Records by key in the file ``path``; None saves nothing."""

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self._records: dict[str, Any] = {}
        if path is not None and path.exists():
            for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
                digest, _, text = line.partition(" ")
                if digest == digest_of(text):
                    self._records.update([json.loads(text)])

    def get(self, key: str) -> Any:
        """The record of a key, or None."""
        return self._records.get(key)

    def put(self, key: str, record: Any) -> None:
        """Save a record; it is on the disk when this returns. Raises OSError."""
        if self.path is None:
            return
        text = json.dumps([key, record])
        # The line break comes first, in case an interrupted write left a partial line.
        path = self.path
        with naming(lambda: path), path.open("a", encoding="utf-8") as file:
            file.write(f"\n{digest_of(text)} {text}\n")
            file.flush()
            os.fsync(file.fileno())


def run_key(scene: dict[str, Any], version: str) -> str:
    """Key of a run: hash of its resolved scene and of the version that runs it."""
    return digest_of(json.dumps([version, scene], sort_keys=True))


def code_version(*modules: str) -> str:
    """Version of all that decides the bits of a run: packages, and the code that these modules run."""
    packages = {name: version for name, version in versions().items() if name != "python"}
    return json.dumps({**packages, "sources": source_digest(*modules)}, sort_keys=True)


def sign(record: dict[str, Any]) -> None:
    """Put the digest of all other keys under ``sha256``, by which ``intact`` recognizes an unchanged record."""
    record.pop("sha256", None)
    record["sha256"] = digest_of(json.dumps(record))


def intact(record: dict[str, Any]) -> bool:
    """Whether a record from JSON is unchanged since ``sign``."""
    content = {key: value for key, value in record.items() if key != "sha256"}
    return record.get("sha256") == digest_of(json.dumps(content))


def digest_of_file(path: Path) -> str:
    """SHA-256 of a file, which is not held as a whole. Raises OSError."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def digest_of(content: str | bytes) -> str:
    """SHA-256 of a text or of the content of a file."""
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()
