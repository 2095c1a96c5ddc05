"""Raw signals of a rig as what the simulation states, with its error by batch means: mean cage speed, whirl deviation ratio.

A mean over time needs no filter on either side. Pulses are taken a whole cage turn at a time, which takes out how unevenly
their marks are spaced. Whirl needs a velocity: an orbit is filtered as the simulated one is (``filtered_whirl``).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from doe.arrays import Array
from doe.study_file.table import Limits, read_sheet
from rbdyn.base.words import counted
from rbdyn.faults import InputError, refuse

# What a signal holds: its columns, of which some may have another unit.
KINDS = {
    "cage_pulses": ("t_s",),
    "cage_speed": ("t_s", "cage_speed_rpm"),
    "orbit": ("t_s", "x_um or x_m", "y_um or y_m"),
}
# Any unit in use; finer steps of time are round-off, and their inverse overflows.
SAMPLED, FINEST = Limits(1e12), 1e-12
# A turn that takes longer than so many usual ones has lost a pulse.
LOST = 1.5
# A mean by fewer turns or samples has no error worth stating.
FEWEST = 20
# Batches of an orbit: as many as this, of so many periods of the cutoff at least; periods of a record of noise.
MOST_PARTS, PERIODS, STILL_PERIODS = 400, 10, 20
# Intervals of an even signal are alike within this share.
EVEN = 0.1
# Noise may have this share of the mean square of a speed: its part in the mean is known to first order.
LOUDEST = 0.25


class Mean(NamedTuple):
    """A mean over a signal, its standard deviation, and what is to be said of gaps or noise, if anything."""

    value: float
    sd: float
    note: str | None


def cage_speed(path: Path, kind: str, pulses_per_turn: int) -> Mean:
    """Mean cage speed [rpm]. Raises InputError."""
    from rbdyn.dynamics.statistics.batch_means import estimate

    time, *rest = _columns(path, KINDS[kind])
    if not (np.diff(time) >= FINEST).all():
        row = int(np.argmin(np.diff(time) >= FINEST)) + 2
        raise InputError(
            [f"{path}: t_s in row {row} does not rise by {FINEST:g} s at least; sort it, or check the unit"]
        )
    note = None
    if kind == "cage_pulses":
        took = np.diff(time[::pulses_per_turn])
        whole = took <= LOST * np.median(took) if took.size else np.zeros(0, bool)
        lost = f"{(~whole).sum()} of {counted(took.size, 'turn')} lack pulses and are left out"
        note = None if whole.all() else f"{path}: {lost}"
        moments = np.column_stack([np.full(whole.sum(), 60.0), took[whole]])
    else:
        # Each sample counts for the time to the next one.
        moments = np.column_stack([rest[0][:-1] * np.diff(time), np.diff(time)])
    if len(moments) < FEWEST:
        few = f"{counted(len(moments), 'turn')} or samples; {FEWEST} at least tell an error, measure longer"
        raise InputError([f"{path}: {few}"])
    mean = estimate([moments], lambda sums: sums[..., 0] / sums[..., 1])
    if not mean.value > 0.0 or not mean.half_width:
        raise InputError([f"{path}: no cage speed above nothing that varies; check the signal"])
    return Mean(mean.value, mean.half_width / 1.96, note)


def whirl(path: Path, cutoff: float, notches: Sequence[float], still: Path | None) -> Mean:
    """Whirl deviation ratio below ``cutoff`` without ``notches`` [Hz].

    ``still``: a record of the rig at rest. Noise of variance s^2 in each component adds 2 s^2 to the mean square of the
    speed v and, to first order, s^2/(2 v) to v. Raises InputError.
    """
    from rbdyn.dynamics.statistics.batch_means import estimate
    from rbdyn.dynamics.statistics.filtered_whirl import NOTCH_PERIODS, sums_until
    from rbdyn.dynamics.statistics.metrics import WHIRL_DEVIATION_RATIO

    speed, periods = _filtered(path, cutoff, notches, FEWEST * PERIODS)
    quiet = np.zeros(1) if still is None else _filtered(still, cutoff, notches, STILL_PERIODS)[0]
    noise = float((quiet**2).mean()) / 2.0
    if 2.0 * noise > LOUDEST * float((speed**2).mean()):
        loud = f"has more than {100.0 * LOUDEST:g} % of the mean square speed of {path.name}"
        raise InputError([f"{still}: {loud}; lower cutoff_hz"])
    nearly = np.maximum(speed, np.sqrt(noise))
    mean = speed - noise / (2.0 * nearly) if noise else speed
    moments = np.stack([np.ones_like(speed), mean, speed**2 - 2.0 * noise])
    parts = min(int(periods / PERIODS), MOST_PARTS)
    ends = len(speed) * np.arange(1, parts + 1) // parts
    ratio = estimate([sums_until(moments, ends)], WHIRL_DEVIATION_RATIO.of_sums)
    if not ratio.value > 0.0 or not ratio.half_width:
        raise InputError([f"{path}: a speed of the cage's centre that varies no more than noise; check the signal"])
    noisy = [f"without a still_file noise below {cutoff:g} Hz counts as whirl"] if still is None else []
    slow = [f"{each:g} Hz" for each in notches if each * periods / cutoff < NOTCH_PERIODS]
    short = [f"runout at {' and '.join(slow)} counts as whirl, of which it has fewer than {NOTCH_PERIODS:g} periods"]
    note = "; ".join([*noisy, *(short if slow else [])])
    return Mean(ratio.value, ratio.half_width / 1.96, f"{path}: {note}" if note else None)


def _filtered(path: Path, cutoff: float, notches: Sequence[float], fewest: int) -> tuple[Array, float]:
    """Filtered speed [m/s] of an orbit, and how many periods of the cutoff it has, which are ``fewest`` at least."""
    from rbdyn.dynamics.statistics.filtered_whirl import filtered_speed
    from rbdyn.scene.laws import SAMPLES_A_PERIOD

    time, *place = _columns(path, KINDS["orbit"])
    interval = (time[-1] - time[0]) / max(len(time) - 1, 1)
    if not (np.abs(np.diff(time) - interval) < EVEN * interval).all() or not interval >= FINEST:
        raise InputError([f"{path}: t_s does not rise evenly; give samples at equal intervals"])
    rate = 1.0 / interval
    if rate * (1.0 + 1e-6) < SAMPLES_A_PERIOD * cutoff:
        few = f"{rate:.4g} samples a second are fewer than {SAMPLES_A_PERIOD} a period of cutoff_hz = {cutoff:g}"
        raise InputError([f"{path}: {few}; sample faster or give {rate / SAMPLES_A_PERIOD:.4g} at most"])
    periods = len(time) * cutoff / rate
    if periods < fewest:
        raise InputError(
            [f"{path}: shorter than {fewest} periods of cutoff_hz = {cutoff:g}; measure longer or raise it"]
        )
    return filtered_speed(np.stack(place), rate, cutoff, notches), periods


def _columns(path: Path, names: tuple[str, ...]) -> list[Array]:
    """Numbers in SI of the columns, each of which may have one of several units. Raises InputError."""
    sheet, numbers, faults = read_sheet(path), list[Array](), list[str]()
    for name in names:
        units = [one for one in name.split(" or ") if one in sheet]
        if len(units) == 1:
            values, slips = sheet.column(units[0]).numbers(SAMPLED)
            numbers.append(values * (1e-6 if units[0].endswith("_um") else 1.0))
            faults += slips
        else:
            fix = "are both there; keep one" if units else "is missing; add it"
            faults.append(f"{path}: column {' and '.join(units) or name} {fix}")
    refuse(faults)
    return numbers
