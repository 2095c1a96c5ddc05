"""Finished runs on disk: one row a run in sqlite, keyed by what determines its bits."""

from __future__ import annotations

import hashlib
import json
import sqlite3
from pathlib import Path
from types import TracebackType
from typing import Any

from rbdyn.faults import InputError

SCHEMA = "CREATE TABLE IF NOT EXISTS runs (key TEXT PRIMARY KEY, result TEXT NOT NULL) WITHOUT ROWID"


class Store:
    """Results by key. A row is written whole or not at all, so a killed study loses no finished run."""

    def __init__(self, path: Path) -> None:
        """Open or make the store. Raises InputError when the file is something else or cannot be written."""
        try:
            self._connection = sqlite3.connect(path, timeout=30.0, isolation_level=None)
            self._connection.execute("PRAGMA journal_mode=WAL")
            self._connection.execute(SCHEMA)
        except sqlite3.Error as error:
            raise InputError([f"{path}: cannot be used as a store of runs ({error}); move it away"]) from None

    def get(self, key: str) -> dict[str, Any] | None:
        """The stored result, or None."""
        row = self._connection.execute("SELECT result FROM runs WHERE key = ?", (key,)).fetchone()
        return None if row is None else json.loads(row[0])

    def put(self, key: str, result: dict[str, Any]) -> None:
        """Keep a result; an equal key already there is left, for equal keys have equal bits."""
        self._connection.execute("INSERT OR IGNORE INTO runs VALUES (?, ?)", (key, json.dumps(result)))

    def __enter__(self) -> Store:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._connection.close()


def run_key(scene: dict[str, Any], version: str) -> str:
    """Key of a run: hash of its resolved scene and of the version that ran it."""
    text = json.dumps([version, scene], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
