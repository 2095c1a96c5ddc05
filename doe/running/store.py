"""Finished runs on disk: one row a run in sqlite, keyed by what determines its bits.

A result is there whole or not at all: sqlite appends it to its write-ahead log in frames with checksums, and a log that
was cut short is read up to the last whole transaction. Results are committed with ``synchronous = FULL``, that is, they
are on the disk when ``put`` returns; claims with ``NORMAL``, for a power cut frees them anyway. Each result also carries
its own SHA-256, so that a row spoilt later is told and run again, not read.

Several processes of one machine may use a store at once: whoever claims a run does it, the others wait for it.
"""

import json
import sqlite3
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

from doe.running.database import Database
from doe.running.failure import Failure
from doe.running.owner import BEAT_S, LEASE_S, Owner, this_process
from rbdyn.faults import InputError, RunError
from rbdyn.records.kept import digest_of


@dataclass(frozen=True)
class Point:
    """A run to do: its key, and what a reader of the store wants to know of it."""

    key: str
    label: str
    run: int | None = None
    factors: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class Claim:
    """A run that a live process has taken: who, and since when it is under way [s since the epoch]; None while it is queued."""

    key: str
    label: str
    run: int | None
    host: str
    pid: int
    since: float | None
    owner: str


@dataclass(frozen=True)
class EndedRun:
    """A run that is done or failed: how long it took [s], when it was claimed and ended [s since the epoch], by whom.

    ``seconds`` and ``started`` are None of a result that was put in by hand.
    """

    key: str
    status: str
    seconds: float | None
    started: float | None
    ended: float
    owner: str | None


Record = dict[str, Any]
RunResult = Record | Failure
# Whether a result is what the reader of the store takes it for; None: any is.
Sound = Callable[[Record], bool] | None


class Store(Database):
    """Results by key, failures with their cause, and claims on what is being run."""

    def __init__(self, path: Path, study: str = "", read_only: bool = False) -> None:
        """Open or make the store; ``study`` is noted with every run.

        Raises InputError for a file that is no store, or one of another version; RunError where the disk is full.
        """
        super().__init__(path, read_only)
        self._study, self._me, self._opened = study, this_process(), time.time()
        self._closed = threading.Event()
        self._beating: threading.Thread | None = None
        self._me.enter()

    def get(self, key: str) -> Record | None:
        """The stored result, or None."""
        outcome = self.outcomes([Point(key, key)]).get(key)
        return outcome if isinstance(outcome, dict) else None

    def outcomes(self, points: Sequence[Point], sound: Sound = None) -> dict[str, RunResult]:
        """Results and failures of those points that have ended, by key.

        A row spoilt on the disk, or whose result is not ``sound``, is told on standard error and counts as not there.
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

    def claim(self, points: Sequence[Point], sound: Sound = None, queued: bool = False) -> set[str]:
        """Take what nobody has done or is doing; returns the keys that are now ours to run.

        Claims of a process that is gone are taken over; a row spoilt, or whose result is not ``sound``, is not there. What is
        ``queued`` begins later, see ``begin``.
        """
        started = None if queued else time.time()
        mine, me = set(), self._me
        query = "SELECT owner, status, result, digest, cause FROM runs WHERE key = ?"
        with self._transaction(durable=False) as connection:
            self._sign(connection)
            live: dict[str, bool] = {}
            for point in points:
                row = connection.execute(query, (point.key,)).fetchone()
                if row is not None and row[1] != "claimed" and _outcome(point, sound, *row[1:]) is not None:
                    continue
                if row is not None and row[1] == "claimed":
                    if row[0] not in live:
                        live[row[0]] = self._lives(row[0])
                    if live[row[0]]:
                        continue
                factors = json.dumps(dict(point.factors))
                connection.execute(
                    "INSERT OR REPLACE INTO runs (key, status, study, label, run, factors, started, host, pid, owner) "
                    "VALUES (?, 'claimed', ?, ?, ?, ?, ?, ?, ?, ?)",
                    (point.key, self._study, point.label, point.run, factors, started, me.host, me.pid, me.token),
                )
                mine.add(point.key)
        return mine

    def begin(self, key: str) -> None:
        """A run that we have queued is under way from now on."""
        with self._transaction(durable=False) as connection:
            began = "UPDATE runs SET started = ? WHERE key = ? AND owner = ? AND status = 'claimed'"
            connection.execute(began, (time.time(), key, self._me.token))

    def _sign(self, connection: sqlite3.Connection) -> None:
        """Note that this owner lives, now and from time to time from here on."""
        me = self._me
        signed = me.token, me.host, me.machine, me.pid, me.born, time.time()
        connection.execute("INSERT OR REPLACE INTO owners VALUES (?, ?, ?, ?, ?, ?)", signed)
        if self._beating is None:
            self._beating = threading.Thread(target=self._beat, name="heartbeat", daemon=True)
            self._beating.start()

    def _beat(self) -> None:
        while not self._closed.wait(BEAT_S):
            # A sign that cannot be given now is given later; a full disk is told by the next result.
            with suppress(InputError, RunError), self._transaction(durable=False) as connection:
                if not self._closed.is_set():
                    self._sign(connection)

    def put(
        self, key: str, result: Record, *, seconds: float | None = None, host: str | None = None, pid: int | None = None
    ) -> None:
        """Keep a result; it is on the disk when this returns.

        An equal key already done is left, for equal keys have equal bits. ``host``, ``pid``: where it ran, if not here.
        """
        text = json.dumps(result)
        self._end(key, status="done", result=text, digest=digest_of(text), seconds=seconds, host=host, pid=pid)

    def fail(self, key: str, cause: str, *, seconds: float | None = None) -> None:
        """Keep why a run could not go on."""
        self._end(key, status="failed", cause=cause, seconds=seconds)

    def _end(self, key: str, **facts: Any) -> None:
        where = {"host": facts.get("host") or self._me.host, "pid": facts.get("pid") or self._me.pid}
        facts |= {"ended": time.time()} | where
        columns = ", ".join(facts)
        replaced = ", ".join(f"{name} = excluded.{name}" for name in facts)
        with self._transaction(durable=True) as connection:
            insert = f"INSERT INTO runs (key, study, {columns}) VALUES (?, ?{', ?' * len(facts)})"
            update = f"ON CONFLICT (key) DO UPDATE SET {replaced} WHERE runs.status = 'claimed'"
            connection.execute(f"{insert} {update}", (key, self._study, *facts.values()))

    def forget_failures(self, points: Sequence[Point]) -> None:
        """Let points be run again that failed before this store was opened."""
        with self._transaction(durable=True) as connection:
            connection.executemany(
                # One dated ahead was ended by another clock.
                "DELETE FROM runs WHERE status = 'failed' AND key = ? AND ended NOT BETWEEN ? AND ?",
                [(point.key, self._opened, time.time()) for point in points],
            )

    def sign(self, kind: str) -> None:
        """Note that this owner lives, from here on; notes of a ``kind`` by owners that are gone are taken away."""
        with self._transaction(durable=False) as connection:
            self._sign(connection)
            rows = connection.execute("SELECT name FROM meta WHERE name LIKE ? || '%'", (kind,)).fetchall()
            gone = [(name,) for (name,) in rows if not self._lives(name.removeprefix(kind))]
            connection.executemany("DELETE FROM meta WHERE name = ?", gone)

    def note(self, kind: str, text: str) -> None:
        """Keep a note of a ``kind``, one for each owner."""
        with self._transaction(durable=False) as connection:
            connection.execute("INSERT OR REPLACE INTO meta VALUES (?, ?)", (kind + self._me.token, text))

    def notes(self, kind: str) -> list[tuple[str, bool]]:
        """Notes of a ``kind``, each with whether its owner lives."""
        with self._lock, self._faults():
            rows = self._connection.execute("SELECT name, value FROM meta WHERE name LIKE ? || '%'", (kind,)).fetchall()
            return [(text, self._lives(name.removeprefix(kind))) for name, text in rows]

    def release(self) -> None:
        """Give back what was claimed and has not ended."""
        with self._transaction(durable=False) as connection:
            connection.execute("DELETE FROM runs WHERE status = 'claimed' AND owner = ?", (self._me.token,))

    def claims(self) -> list[Claim]:
        """Runs that live processes have taken."""
        with self._lock, self._faults():
            rows = self._connection.execute(
                "SELECT key, label, run, host, pid, iif(typeof(started) IN ('real', 'null'), started, 0.0), owner "
                "FROM runs WHERE status = 'claimed' ORDER BY started, run"
            ).fetchall()
            live = {owner: self._lives(owner) for owner in {row[-1] for row in rows}}
        return [Claim(*row) for row in rows if live[row[-1]]]

    def ended(self) -> list[EndedRun]:
        """All runs that have ended, oldest first."""
        seconds, started = (f"iif(typeof({name}) = 'real', {name}, NULL)" for name in ("seconds", "started"))
        query = f"SELECT key, status, {seconds}, {started}, ended, owner FROM runs WHERE status != 'claimed'"
        with self._lock, self._faults():
            rows = self._connection.execute(f"{query} AND typeof(ended) = 'real' ORDER BY ended")
            return [EndedRun(*row) for row in rows]

    def close(self) -> None:
        """Give back claims and close."""
        self._closed.set()
        # Claims that cannot be given back now are free as soon as this owner is seen to be gone.
        if self._beating is not None:
            with suppress(InputError, RunError):
                self.release()
            self._beating.join()
        self._me.leave()
        with self._lock:
            self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *ended: object) -> None:
        self.close()

    def _lives(self, owner: str) -> bool:
        """Whether an owner may still be at work; one that signed ahead of this machine's clock is told."""
        query = "SELECT host, machine, pid, born, owner, beat FROM owners WHERE owner = ?"
        row = self._connection.execute(query, (owner,)).fetchone()
        if row is None or not isinstance(row[5], float):
            return False
        lives, ahead = Owner(*row[:5]).lives(row[5]), row[5] - time.time()
        if lives and ahead > BEAT_S and row[1] != self._me.machine:
            what = f"process {row[2]} on {row[0]} gave its last sign of life {ahead:.0f} s ahead of this clock"
            mend = f"set both clocks right. Unless it gives another within {LEASE_S:g} s, its runs are taken over"
            self._tell([owner], f"{what}; {mend}")
        return lives


def _outcome(point: Point, sound: Sound, status: str, result: Any, digest: Any, cause: Any) -> RunResult | None:
    """What a row of an ended run tells; None where it is spoilt."""
    if status == "failed":
        return Failure(point.label, cause, point.run, dict(point.factors)) if isinstance(cause, str) else None
    if not isinstance(result, str) or digest_of(result) != digest:
        return None
    try:
        record = json.loads(result)
    except ValueError:
        return None
    return record if isinstance(record, dict) and (sound is None or sound(record)) else None
