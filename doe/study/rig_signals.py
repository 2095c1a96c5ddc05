"""Raw signals of a rig as what the simulation states, with its error by batch means: mean cage speed, whirl deviation ratio.

A mean over time needs no filter on either side. Pulses are taken a whole cage turn at a time, which takes out how unevenly
their marks are spaced. Whirl needs a velocity: an orbit is filtered as the simulated one is (``filtered_whirl``).
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from doe.arrays import Array
from doe.study_file.table import fields
from rbdyn.faults import InputError
from rbdyn.records.cells import NUMBER
from rbdyn.records.words import counted

# What a signal holds: its columns, of which some may have another unit.
KINDS = {
    "cage_pulses": ("t_s",),
    "cage_speed": ("t_s", "cage_speed_rpm"),
    "orbit": ("t_s", "x_um or x_m", "y_um or y_m"),
}
# A turn that takes longer than so many usual ones has lost a pulse.
LOST = 1.5
# A mean by fewer turns or samples has no error worth stating.
FEWEST = 20
# Batches of an orbit: as many as this, of so many periods of the cutoff at least.
MOST_PARTS, PERIODS = 400, 10
# Intervals of an even signal are alike within this share.
EVEN = 0.1
# Noise may have this share of the mean square of a speed: its part in the mean is known to first order.
LOUDEST = 0.25


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
        lost = f"{(~whole).sum()} of {counted(took.size, 'turn')} lack pulses and are left out"
        told = None if whole.all() else f"{path}: {lost}"
        moments = np.column_stack([np.full(whole.sum(), 60.0), took[whole]])
    else:
        # Each sample counts for the time to the next one.
        moments = np.column_stack([rest[0][:-1] * np.diff(time), np.diff(time)])
    if len(moments) < FEWEST:
        raise InputError(
            [f"{path}: {counted(len(moments), 'turn')} or samples; {FEWEST} at least tell an error, measure longer"]
        )
    found = estimate([moments], lambda sums: sums[..., 0] / sums[..., 1])
    if not found.value > 0.0 or not found.half_width:
        raise InputError([f"{path}: no cage speed above nothing that varies; check the signal"])
    return found.value, found.half_width / 1.96, told


def whirl(path: Path, cutoff: float, notches: Sequence[float], still: Path | None) -> tuple[float, float, str | None]:
    """Whirl deviation ratio below ``cutoff`` without ``notches`` [Hz], its standard deviation, and what is to be told.

    ``still``: a record of the rig at rest. Noise of variance s^2 in each component adds 2 s^2 to the mean square of the
    speed v and, to first order, s^2/(2 v) to v. Raises InputError.
    """
    from rbdyn.dynamics.statistics.batch_means import estimate
    from rbdyn.dynamics.statistics.filtered_whirl import sums_until
    from rbdyn.dynamics.statistics.metrics import WHIRL_DEVIATION_RATIO

    speed, rate = _filtered(path, cutoff, notches)
    noise = 0.0 if still is None else float((_filtered(still, cutoff, notches)[0] ** 2).mean()) / 2.0
    if 2.0 * noise > LOUDEST * float((speed**2).mean()):
        loud = f"has more than {100.0 * LOUDEST:g} % of the mean square speed of {path.name}"
        raise InputError([f"{still}: {loud}; lower cutoff_hz"])
    parts = min(int(len(speed) * cutoff / rate / PERIODS), MOST_PARTS)
    if parts < FEWEST:
        short = f"shorter than {FEWEST * PERIODS} periods of cutoff_hz = {cutoff:g}"
        raise InputError([f"{path}: {short}; measure longer or raise it"])
    nearly = np.maximum(speed, np.sqrt(noise))
    mean = speed - noise / (2.0 * nearly) if noise else speed
    moments = np.stack([np.ones_like(speed), mean, speed**2 - 2.0 * noise])
    ends = len(speed) * np.arange(1, parts + 1) // parts
    found = estimate([sums_until(moments, ends)], WHIRL_DEVIATION_RATIO.of_sums)
    if not found.value > 0.0 or not found.half_width:
        raise InputError([f"{path}: a speed of the cage's centre that varies no more than noise; check the signal"])
    told = f"{path}: without a still_file noise below {cutoff:g} Hz counts as whirl" if still is None else None
    return found.value, found.half_width / 1.96, told


def _filtered(path: Path, cutoff: float, notches: Sequence[float]) -> tuple[Array, float]:
    """Filtered speed [m/s] of an orbit and its sampling rate [Hz]."""
    from rbdyn.dynamics.statistics.filtered_whirl import filtered_speed
    from rbdyn.scene.laws import SAMPLES_A_PERIOD

    time, *place = _columns(path, KINDS["orbit"])
    interval = (time[-1] - time[0]) / max(len(time) - 1, 1)
    if not (np.abs(np.diff(time) - interval) < EVEN * interval).all() or not interval > 0.0:
        raise InputError([f"{path}: t_s does not rise evenly; give samples at equal intervals"])
    rate = 1.0 / interval
    if rate * (1.0 + 1e-6) < SAMPLES_A_PERIOD * cutoff:
        few = f"{rate:.4g} samples a second are fewer than {SAMPLES_A_PERIOD} a period of cutoff_hz = {cutoff:g}"
        raise InputError([f"{path}: {few}; sample faster or give {rate / SAMPLES_A_PERIOD:.4g} at most"])
    return filtered_speed(np.stack(place), rate, cutoff, notches), rate


def _columns(path: Path, names: tuple[str, ...]) -> list[Array]:
    header, rows = fields(path)
    header = [name.strip() for name in header]
    if missing := [name for name in names if not set(name.split(" or ")).intersection(header)]:
        raise InputError([f"{path}: column {missing[0]} is missing; add it"])
    found = []
    for name in (next(one for one in name.split(" or ") if one in header) for name in names):
        texts = [row[header.index(name)].strip() for row in rows]
        if bad := next((text for text in texts if not NUMBER.fullmatch(text)), None):
            raise InputError([f"{path}: {name} = {bad!r}: not a number; mend it"])
        found.append(np.array(texts, float) * (1e-6 if name.endswith("_um") else 1.0))
    return found
