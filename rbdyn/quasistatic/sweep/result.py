"""What a sweep reports, saves and loads."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.records import finite, plain, save_table
from rbdyn.base.words import counted
from rbdyn.quasistatic.result import ball_columns, ball_records
from rbdyn.result import read_record, versions, write_json

if TYPE_CHECKING:
    import pandas as pd

FORMAT = "rbdyn.sweep/2"
OK = "ok"


@dataclass(frozen=True)
class SweepResult:
    """Equilibria over a grid of scene keys, in the order of ``keys``, the last one running fastest.

    ``keys``: values of each key; ``columns``: a figure a point, units in the names, NaN where ``statuses`` shows why there is no
    equilibrium. ``figures``: by row of balls, those of each ball in SI as (points, (points, Z, 6)), a pair a number Z of balls;
    empty in a loaded sweep. ``notes``: "about" what, the "note" of the first point and all "points" that it is about, counted from 0 in
    the order of the table. ``cold``: points not started from their neighbour. ``wall_s``: what they took.
    """

    keys: dict[str, tuple[float, ...]]
    columns: dict[str, Array]
    statuses: tuple[str, ...]
    cold: int
    wall_s: float
    scene: dict[str, Any]
    figures: dict[str, list[tuple[Whole, Array]]] = field(default_factory=dict, repr=False)
    notes: list[dict[str, Any]] = field(default_factory=list)

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each key."""
        return tuple(len(values) for values in self.keys.values())

    @property
    def status(self) -> str:
        """ "ok", or how many points failed."""
        count = sum(status != OK for status in self.statuses)
        return OK if count == 0 else f"{count} of {counted(len(self.statuses), 'point')} failed"

    @property
    def failures(self) -> dict[str, list[int]]:
        """Points without an equilibrium by cause, counted from 0 in the order of the table.

        A cause is what a status says before its colon; figures of the point stand behind it.
        """
        causes: dict[str, list[int]] = {}
        for place, status in enumerate(self.statuses):
            if status != OK:
                causes.setdefault(status.partition(":")[0], []).append(place)
        return causes

    def at(self, place: int) -> dict[str, float]:
        """Values of the keys at a point."""
        indices = np.unravel_index(place, self.shape)
        return {key: values[int(index)] for (key, values), index in zip(self.keys.items(), indices, strict=True)}

    def where(self, places: Sequence[int]) -> str:
        """How many points, and at which values of the keys the first of them lies."""
        first = ", ".join(f"{key} = {value:g}" for key, value in self.at(places[0]).items())
        return f"{counted(len(places), 'point')}{', the first' if len(places) > 1 else ''} at {first}"

    def grid(self, column: str) -> Array:
        """A column over the grid, one axis a key. Raises KeyError for an unknown one."""
        return self.columns[column].reshape(self.shape)

    def table(self) -> "pd.DataFrame":
        """A row a point: keys, figures, status, and what its notes are about."""
        import pandas as pd

        words: list[list[str]] = [[] for _ in self.statuses]
        for note in self.notes:
            for place in note["points"]:
                words[place].append(note["about"])
        about = ["; ".join(each) for each in words]
        return pd.DataFrame({**self._places(), **self.columns, "status": self.statuses, "notes": about})

    def balls(self) -> "pd.DataFrame":
        """A row a ball and point: keys, row of balls, ball from 1, then as ``BallResult.table``.

        Points that failed have none. Raises RuntimeError for a loaded sweep, which does not know its balls.
        """
        import pandas as pd

        if not self.figures:
            raise RuntimeError("a loaded sweep does not know its balls; run it again")
        frames = []
        places = self._places()
        solved = np.array([status == OK for status in self.statuses])
        for name, groups in self.figures.items():
            for points, balls in groups:
                good = points[solved[points]]
                size = balls.shape[1]
                columns = {key: np.repeat(values[good], size) for key, values in places.items()}
                columns["row"] = np.full(good.size * size, name)
                columns["ball"] = np.tile(np.arange(1, size + 1), good.size)
                shown = ball_columns(balls[solved[points]])
                frames.append(pd.DataFrame(columns | {key: value.ravel() for key, value in shown.items()}))
        return pd.concat(frames, ignore_index=True)

    def balls_at(self, place: int) -> dict[str, list[dict[str, float]]]:
        """Records of the balls of a point, by row; as those of ``BallResult``. Raises RuntimeError as ``balls``."""
        if not self.figures:
            raise RuntimeError("a loaded sweep does not know its balls; run it again")
        records = {}
        for name, groups in self.figures.items():
            records[name] = ball_records(next(balls[points == place] for points, balls in groups if place in points)[0])
        return records

    def points(self) -> list[dict[str, Any]]:
        """A record a point, None where a figure is infinite or was not found."""
        places, names = self._places(), list(self.columns)
        values = [[finite(value) for value in self.columns[name].tolist()] for name in names]
        keys = [column.tolist() for column in places.values()]
        return [
            {
                **dict(zip(places, (column[place] for column in keys), strict=True)),
                "status": status,
                **(dict(zip(names, (column[place] for column in values), strict=True)) if status == OK else {}),
            }
            for place, status in enumerate(self.statuses)
        ]

    def as_dict(self) -> dict[str, Any]:
        """JSON form, which shares nothing with the sweep: the table by points, where the sweep holds it by columns."""
        return {
            "format": FORMAT,
            "status": self.status,
            "keys": {key: list(values) for key, values in self.keys.items()},
            "points": self.points(),
            "failures": [
                {"cause": cause, "points": len(at), "first": self.at(at[0]), "status": self.statuses[at[0]]}
                for cause, at in self.failures.items()
            ],
            "notes": plain(self.notes),
            "cost": {"wall_s": self.wall_s, "cold_starts": self.cold},
            "versions": versions(),
            "scene": plain(self.scene),
        }

    def save(self, path: Path | str) -> None:
        """Write the table as CSV where the name ends so, else everything as JSON."""
        if str(path).endswith(".csv"):
            save_table(self.table(), path, "%.9g")
        else:
            write_json(path, self.as_dict())

    @classmethod
    def load(cls, path: Path | str) -> "SweepResult":
        """Read a sweep saved as JSON. Raises InputError when the file is missing or not such a sweep."""
        return read_record(path, FORMAT, "sweep", cls._of_json)

    @classmethod
    def _of_json(cls, data: dict[str, Any]) -> "SweepResult":
        keys = {key: tuple(values) for key, values in data["keys"].items()}
        points = data["points"]
        names = dict.fromkeys(name for point in points for name in point if name not in (*keys, "status"))
        columns = {name: np.array([_number(point, name) for point in points], dtype=np.float64) for name in names}
        cost = data["cost"]
        statuses = tuple(point["status"] for point in points)
        return cls(keys, columns, statuses, cost["cold_starts"], cost["wall_s"], data["scene"], notes=data["notes"])

    def _places(self) -> dict[str, NDArray[Any]]:
        """Values of the keys at every point, a column a key."""
        grids = np.meshgrid(*(np.array(values) for values in self.keys.values()), indexing="ij")
        return {key: grid.ravel() for key, grid in zip(self.keys, grids, strict=True)}


def _number(point: dict[str, Any], name: str) -> float:
    """Of a saved figure; only a life without a load is null in a point that has its equilibrium."""
    if point["status"] != OK:
        return math.nan
    value = point[name]
    if value is None:
        return math.inf if name.startswith("L10") or "_L10" in name else math.nan
    return float(value)
