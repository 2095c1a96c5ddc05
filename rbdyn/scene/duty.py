"""Duty of a machine: points of operation, each with its share of the time and the keys of the scene that it changes.

The ``[[duty]]`` tables of a study are also those of a file of their own, so that both can mark a map.
"""

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from rbdyn.base.faults import (
    Consistent,
    InputError,
    Name,
    NonNegative,
    assignment_faults,
    key_path,
    read_toml,
    refuse,
    validated,
)
from rbdyn.life.duty import SHARE_ROUNDING
from rbdyn.scene import Scene
from rbdyn.scene.thermal import first_guess_faults
from rbdyn.scene.uncertain import DECLARATIONS, SEEDS

MOST_POINTS = 12
# Keys that a point may not set, with the reasons.
OF_EVERY_POINT = {
    ("numerics", "seed"): SEEDS,
    ("numerics", "replicates"): "each kind of run has its own number of them; leave it out",
    ("uncertain",): DECLARATIONS,
    ("calibrate",): DECLARATIONS,
}


class DutyPoint(Consistent):
    """A point of the duty: its share of the time, and what changes in the scene there."""

    name: Name
    """Name of the point in tables and messages."""
    share: NonNegative
    """Share of the time; the shares of all points sum to 1. A point of share 0 counts for worst figures and limits only."""
    set: list[str] = []
    """Overrides of the scene's keys at this point, as "key=value": operation, temperatures, oil flow; not of factors and seeds."""

    def faults(self) -> Iterator[str]:
        if ": " in self.name:
            yield f"name = {self.name!r}: must not have a colon with a space; leave it out"


class DutyTables(Consistent):
    """The duty in a file."""

    duty: list[DutyPoint]
    """The points of operation."""
    normalise_shares: bool = False
    """Whether the shares may have any sum, such as hours: they are then divided by it."""

    def faults(self) -> Iterator[str]:
        yield from point_faults(self.duty, self.normalise_shares)


def point_faults(
    points: Sequence[DutyPoint], normalise: bool, claims: Mapping[tuple[str, ...], str] | None = None
) -> Iterator[str]:
    """A sentence for each fault of the points of a duty; ``claims``: further keys that no point may set, with the reasons."""
    if len(points) > MOST_POINTS:
        yield f"duty: has {len(points)} points, more than {MOST_POINTS}; join or leave out some"
    names = Counter(point.name for point in points)
    yield from (f"duty.name = {name!r}: used more than once; name each once" for name in names if names[name] > 1)
    total = math.fsum(point.share for point in points)
    if not total > 0.0:
        yield "duty.share: is 0 at every point; state the shares of the time"
    elif not normalise and abs(total - 1.0) > SHARE_ROUNDING:
        yield f"duty.share: sums to {total:.6g} over all points, not to 1; change a share or write normalise_shares = true"
    for point in points:
        yield from assignment_faults(f"duty.set of {point.name}", point.set, {**(claims or {}), **OF_EVERY_POINT})


def read_duty(path: Path) -> list[DutyPoint]:
    """Points of the ``[[duty]]`` tables of a file; its other tables are not read. Raises InputError with all faults."""
    tables = read_toml(path)
    if not tables.get("duty"):
        raise InputError([f"{path}: duty: missing; add a [[duty]] table for each point of operation"])
    return validated(DutyTables, {key: tables[key] for key in DutyTables.model_fields if key in tables}, str(path)).duty


def duty_scenes(scene: Scene, points: Sequence[DutyPoint], source: str) -> list[Scene]:
    """The scene at each point, in their order. Raises InputError with the faults of all points, which name ``source``."""
    scenes, faults = [], list[str]()
    for point in points:
        try:
            scenes.append(scene.overridden(point.set))
            refuse(
                first_guess_faults(
                    scenes[-1].thermal, scenes[-1].lubricant, {".".join(key_path(text) or ()) for text in point.set}
                )
            )
        except InputError as error:
            faults += [f"{source}: duty {point.name!r}: {fault.removeprefix('scene: ')}" for fault in error.faults]
    refuse(faults)
    return scenes
