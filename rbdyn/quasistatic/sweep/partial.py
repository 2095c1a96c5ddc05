"""What an interrupted sweep leaves beside its results: the same sweep goes on from there, to the same bits."""

import functools
import io
import json
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.arrays import Array
from rbdyn.quasistatic.result import Remark
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.records.digest import content_of, with_digest
from rbdyn.result import whole_file

Arrays = dict[str, NDArray[Any]]


class Partial(NamedTuple):
    """The file ``path`` for the sweep ``key``; without a path nothing is kept."""

    path: Path | None
    key: str

    def read(self) -> Arrays:
        """The arrays kept, none where there is no such file, it is of another sweep, or broken."""
        if self.path is None:
            return {}
        try:
            with np.load(io.BytesIO(content_of(self.path.read_bytes())), allow_pickle=False) as file:
                arrays = dict(file)
        except (OSError, ValueError):
            return {}
        return arrays if str(arrays.pop("key", "")) == self.key else {}

    def write(self, arrays: Mapping[str, Any]) -> None:
        """Keep arrays in place of those before, whole or not at all. Raises OSError."""
        if self.path is None:
            return
        file = io.BytesIO()
        np.savez(file, key=self.key, **arrays)
        with whole_file(self.path) as new:
            new.write_bytes(with_digest(file.getvalue()))

    def remove(self) -> None:
        """Remove the file, for the sweep is done. One that cannot be removed does no harm: the key tells what it is of."""
        if self.path is not None:
            with suppress(OSError):
                self.path.unlink()


class Solved(NamedTuple):
    """One point: status, figures, those of each ball by row of balls, remarks, solutions of the rows, and whether the start
    was not the point before."""

    status: str
    figures: dict[str, float]
    balls: dict[str, Array]
    remarks: list[Remark]
    rows: tuple[Solution, ...]
    cold: bool


def as_text(points: list[Solved]) -> str:
    """The points as JSON, every number with all its digits."""
    told = [(*point[:3], [(one.word, one.sentence(0)) for one in point.remarks], *point[4:]) for point in points]
    return json.dumps(told, default=np.ndarray.tolist)


def from_text(text: str) -> list[Solved]:
    """Inverse of ``as_text``."""
    return [
        Solved(
            status,
            figures,
            {name: np.array(values) for name, values in balls.items()},
            [Remark(word, np.array([True]), functools.partial(lambda said, _: said, said)) for word, said in remarks],
            tuple(Solution._make(np.array(x) if isinstance(x, list) else x for x in row) for row in rows),
            cold,
        )
        for status, figures, balls, remarks, rows, cold in json.loads(text)
    ]
