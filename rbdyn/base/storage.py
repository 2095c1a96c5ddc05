"""Checkpoints of long commands: finished parts, a line each in a file next to the results, from which a command resumes.

Each line begins with the SHA-256 of the rest; a damaged line is ignored.
"""

import hashlib
import json
import os
from pathlib import Path
from typing import Any

from rbdyn.base.digests import source_digest
from rbdyn.base.files import naming, versions


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
    rest = {key: value for key, value in record.items() if key != "sha256"}
    return record.get("sha256") == digest_of(json.dumps(rest))


def digest_of(content: str | bytes) -> str:
    """SHA-256 of a text or of the content of a file."""
    return hashlib.sha256(content.encode() if isinstance(content, str) else content).hexdigest()
