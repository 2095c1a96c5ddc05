"""Raw signals of a rig as what the simulation states: the mean cage speed with its error by batch means.

A mean over time needs no filter on either side. Pulses are taken a whole cage turn at a time, which takes out how unevenly
their marks are spaced.
"""

from pathlib import Path

import numpy as np

from doe.arrays import Array
from doe.study_file.table import NUMBER, fields
from rbdyn.faults import InputError

# What a signal holds: its columns.
KINDS = {"cage_pulses": ("t_s",), "cage_speed": ("t_s", "cage_speed_rpm")}
# A turn that takes longer than so many usual ones has lost a pulse.
LOST = 1.5
# A mean by fewer turns or samples has no error worth stating.
FEWEST = 20


def cage_speed(path: Path, kind: str, pulses_per_turn: int) -> tuple[float, float, str | None]:
    """Mean cage speed [rpm], its standard deviation, and what is to be told of gaps. Raises InputError."""
    from rbdyn.dynamics.statistics.batch_means import estimate

    time, *rest = _columns(path, KINDS[kind])
    if not (np.diff(time) > 0.0).all():
        raise InputError([f"{path}: t_s does not rise from line to line; sort it and remove repeated ones"])
    told = None
    if kind == "cage_pulses":
        took = np.diff(time[::pulses_per_turn])
        whole = took <= LOST * np.median(took) if took.size else np.zeros(0, bool)
        told = (
            f"{path}: {(~whole).sum()} of {took.size} turns lack pulses and are left out" if not whole.all() else None
        )
        moments = np.column_stack([np.full(whole.sum(), 60.0), took[whole]])
    else:
        # Each sample counts for the time to the next one.
        moments = np.column_stack([rest[0][:-1] * np.diff(time), np.diff(time)])
    if len(moments) < FEWEST:
        raise InputError([f"{path}: {len(moments)} turns or samples; {FEWEST} at least tell an error, measure longer"])
    found = estimate([moments], lambda sums: sums[..., 0] / sums[..., 1])
    if not found.value > 0.0 or not found.half_width:
        raise InputError([f"{path}: no cage speed above nothing that varies; check the signal"])
    return found.value, found.half_width / 1.96, told


def _columns(path: Path, names: tuple[str, ...]) -> list[Array]:
    header, rows = fields(path)
    header = [name.strip() for name in header]
    if missing := [name for name in names if name not in header]:
        raise InputError([f"{path}: column {missing[0]} is missing; add it"])
    found = []
    for name in names:
        texts = [row[header.index(name)].strip() for row in rows]
        if bad := next((text for text in texts if not NUMBER.fullmatch(text)), None):
            raise InputError([f"{path}: {name} = {bad!r}: not a number; mend it"])
        found.append(np.array(texts, float))
    return found
