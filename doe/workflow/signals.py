"""Raw signals of a rig: mean cage speed, whirl and impact pulses, with errors by batch means.

A mean over time needs no filter. Pulses are counted by whole cage turns, so that uneven spacing of their marks cancels.
Whirl needs a velocity: an orbit is filtered like the simulated one (``filtered_whirl``). So are the forces of impacts
(``rbdyn.dynamics.statistics.pulses``), whose impulses and heights a sensor sees through its own bandwidth.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, refuse
from rbdyn.base.tables.sheet import Limits, read_sheet
from rbdyn.base.words import counted

if TYPE_CHECKING:
    from rbdyn.dynamics.statistics.pulses import Pulses

# Columns of each kind of signal; some may have one of two units.
KINDS = {
    "cage_pulses": ("t_s",),
    "cage_speed": ("t_s", "cage_speed_rpm"),
    "orbit": ("t_s", "x_um or x_m", "y_um or y_m"),
    "impact_force": ("t_s", "force_N or force_kN"),
    "impact_acceleration": ("t_s", "acceleration_m_s2"),
    "impact_pulses": ("t_s", "height_N or height_kN"),
}
# Kinds of signals with impact pulses: traces, which are sampled evenly, and lists, whose pulses a logger took.
TRACES, LISTS = ("impact_force", "impact_acceleration"), ("impact_pulses",)
# Units that are not those of SI, by the end of a name.
UNITS = {"_um": 1e-6, "_kN": 1e3}
# Values in any unit in use; finer steps of time are round-off, and their inverse overflows.
SAMPLED, FINEST = Limits(1e12), 1e-12
# A turn that takes longer than this many median turns has lost a pulse.
LOST = 1.5
# Turns or samples that the error of a mean needs.
FEWEST_SAMPLES = 20
# Batches of an orbit at most, periods of the cutoff in each at least, and periods of a record of noise at least.
MOST_PARTS, PERIODS, STILL_PERIODS = 400, 10, 20
# Intervals of an even signal are alike within this share, and their mean is that of the sensor's clock within the next.
EVEN, CLOCK = 0.1, 2e-4
# Largest share of noise in the mean square of a speed: its effect on the mean is known to first order.
LOUDEST = 0.25
# Impact pulses that an error needs, and those in a part of the record at least.
FEWEST_PULSES, PULSES_A_PART = 100, 5
# Threshold over the background of a trace, by its median absolute deviation, below which noise may count as pulses.
CLEAR = 4.0
# Share of equal largest samples above the threshold from which a sensor seems to be at the end of its range.
CLIPPED = 0.01


class Mean(NamedTuple):
    """A mean over a signal, its standard deviation, and a note on gaps or noise, if any."""

    value: float
    sd: float
    note: str | None


def cage_speed(path: Path, kind: str, pulses_per_turn: int) -> Mean:
    """Mean cage speed [rpm]. Raises InputError."""
    from rbdyn.dynamics.statistics.batch_means import estimate

    time, *speeds = _columns(path, KINDS[kind])
    if not (np.diff(time) >= FINEST).all():
        row = int(np.argmin(np.diff(time) >= FINEST)) + 2
        raise InputError(
            [f"{path}: t_s in row {row} does not rise by {FINEST:g} s at least; sort it, or check the unit"]
        )
    note = None
    if kind == "cage_pulses":
        turn_times = np.diff(time[::pulses_per_turn])
        complete = turn_times <= LOST * np.median(turn_times) if turn_times.size else np.zeros(0, bool)
        if not complete.all():
            turns = counted(turn_times.size, "turn")
            note = f"{path}: {(~complete).sum()} of {turns} lack pulses and are left out"
        moments = np.column_stack([np.full(complete.sum(), 60.0), turn_times[complete]])
    else:
        # Each sample counts for the time to the next one.
        moments = np.column_stack([speeds[0][:-1] * np.diff(time), np.diff(time)])
    if len(moments) < FEWEST_SAMPLES:
        turns = counted(len(moments), "turn")
        raise InputError([f"{path}: {turns} or samples are too few for an error; measure at least {FEWEST_SAMPLES}"])
    mean = estimate([moments], lambda sums: sums[..., 0] / sums[..., 1])
    if not mean.value > 0.0 or not mean.half_width:
        raise InputError([f"{path}: no positive, varying cage speed; check the signal"])
    return Mean(mean.value, mean.half_width / 1.96, note)


def whirl(path: Path, cutoff: float, notches: Sequence[float], rest_record: Path | None) -> Mean:
    """Whirl deviation ratio below ``cutoff`` without ``notches`` [Hz].

    ``rest_record``: a record of the rig at rest. Noise of variance s^2 in each component adds 2 s^2 to the mean square of the
    speed v and, to first order, s^2/(2 v) to v. Raises InputError.
    """
    from rbdyn.dynamics.statistics.batch_means import estimate
    from rbdyn.dynamics.statistics.metrics import NOTCH_PERIODS, WHIRL_DEVIATION_RATIO, sums_until

    speed, periods = _filtered(path, cutoff, notches, FEWEST_SAMPLES * PERIODS)
    quiet = np.zeros(1) if rest_record is None else _filtered(rest_record, cutoff, notches, STILL_PERIODS)[0]
    noise = float((quiet**2).mean()) / 2.0
    if 2.0 * noise > LOUDEST * float((speed**2).mean()):
        raise InputError(
            [
                f"{rest_record}: has more than {100.0 * LOUDEST:g} % of the mean square speed of {path.name}; lower cutoff_hz"
            ]
        )
    nearly = np.maximum(speed, np.sqrt(noise))
    mean = speed - noise / (2.0 * nearly) if noise else speed
    moments = np.stack([np.ones_like(speed), mean, speed**2 - 2.0 * noise])
    parts = min(int(periods / PERIODS), MOST_PARTS)
    ends = len(speed) * np.arange(1, parts + 1) // parts
    ratio = estimate([sums_until(moments, ends)], WHIRL_DEVIATION_RATIO.of_sums)
    if not ratio.value > 0.0 or not ratio.half_width:
        raise InputError([f"{path}: a speed of the cage's centre that varies no more than noise; check the signal"])
    noisy = [f"without a still_file noise below {cutoff:g} Hz counts as whirl"] if rest_record is None else []
    slow = [f"{frequency:g} Hz" for frequency in notches if frequency * periods / cutoff < NOTCH_PERIODS]
    short = [f"runout at {' and '.join(slow)} counts as whirl, of which it has fewer than {NOTCH_PERIODS:g} periods"]
    note = "; ".join([*noisy, *(short if slow else [])])
    return Mean(ratio.value, ratio.half_width / 1.96, f"{path}: {note}" if note else None)


def _filtered(path: Path, cutoff: float, notches: Sequence[float], least_periods: int) -> tuple[Array, float]:
    """Filtered speed [m/s] of an orbit, and its number of periods of the cutoff, ``least_periods`` at least."""
    from rbdyn.dynamics.statistics.metrics import filtered_speed
    from rbdyn.scene.laws import SAMPLES_A_PERIOD

    time, *place = _columns(path, KINDS["orbit"])
    rate = _rate(path, time, SAMPLES_A_PERIOD, "cutoff_hz", cutoff)
    periods = len(time) * cutoff / rate
    if periods < least_periods:
        raise InputError(
            [f"{path}: shorter than {least_periods} periods of cutoff_hz = {cutoff:g}; measure longer or raise it"]
        )
    return filtered_speed(np.stack(place), rate, cutoff, notches), periods


def _rate(path: Path, time: Array, fewest: int, name: str, frequency: float) -> float:
    """Samples a second of an even signal, at least the ``fewest`` a period of the ``frequency`` [Hz]. Raises InputError."""
    interval = (time[-1] - time[0]) / max(len(time) - 1, 1)
    if not (np.abs(np.diff(time) - interval) < EVEN * interval).all() or not interval >= FINEST:
        raise InputError([f"{path}: t_s does not rise evenly; give samples at equal intervals"])
    rate = float(1.0 / interval)
    if rate * (1.0 + CLOCK) < fewest * frequency:
        raise InputError(
            [
                f"{path}: {rate:.4g} samples a second are fewer than {fewest} a period of {name} = "
                f"{frequency:g}; sample faster or give {rate / fewest:.4g} at most"
            ]
        )
    return rate


class PulseSetting(NamedTuple):
    """How impact pulses are taken: threshold [N], bandwidth [Hz], dead time [s].

    ``mass``: ratio of force and acceleration at the sensor [kg], for a signal of acceleration.
    """

    threshold: float
    bandwidth: float
    dead_time: float
    mass: float | None = None


def impact_pulses(path: Path, kind: str, setting: PulseSetting) -> tuple[dict[str, Mean], str | None]:
    """Figures of impact pulses by output, as a simulation defines them, and a note on the signal, if any.

    A list of pulses has no impulses. Each figure's error is that of batch means over parts of the record; that of the rate
    covers one pulse too few or too many at least. Raises InputError.
    """
    from rbdyn.dynamics.statistics.batch_means import estimate
    from rbdyn.dynamics.statistics.pulses import Pulses, pulse_sums, without_echoes

    time, values = _columns(path, KINDS[kind])
    if kind in LISTS:
        if not (np.diff(time) >= 0.0).all():
            raise InputError([f"{path}: t_s does not rise from pulse to pulse; sort the rows by it"])
        heights = np.abs(values)
        high = heights >= setting.threshold
        listed = Pulses(time[high], heights[high], np.zeros(int(high.sum())))
        pulses, notes = without_echoes(listed, setting.dead_time), list[str]()
        # From pulse to pulse: the last one ends the record.
        begin, end, counted_pulses = (*time[[0, -1]], pulses.time.size - 1) if time.size else (0.0, 0.0, 0)
    else:
        pulses, (begin, end), notes = _pulses_of_trace(path, time, values * (setting.mass or 1.0), setting)
        counted_pulses = pulses.time.size
    if counted_pulses < FEWEST_PULSES:
        raise InputError(
            [
                f"{path}: only {counted(pulses.time.size, 'pulse')} above threshold_N = {setting.threshold:g}; at least "
                f"{FEWEST_PULSES} are needed, so measure longer or lower it"
            ]
        )
    ends = np.linspace(begin, end, min(counted_pulses // PULSES_A_PART, MOST_PARTS) + 1)[1:]
    sums = np.column_stack([np.full(len(ends), ends[0] - begin), pulse_sums(pulses, ends)])
    figures = {"pulse_rate_hz": (0, 1), "pulse_height_N": (1, 2), "pulse_impulse_N_s": (1, 3)}
    if kind in LISTS:
        del figures["pulse_impulse_N_s"]
    means = {}
    for name, (over, of) in figures.items():
        mean = estimate([sums[:, [over, of]]], lambda both: both[..., 1] / np.maximum(both[..., 0], 1e-300))
        least = mean.value / counted_pulses if over == 0 else 0.0
        sd = max((mean.half_width or 0.0) / 1.96, least)
        if not sd > 1e-9 * mean.value:
            raise InputError([f"{path}: all pulses have one height; check the range of the sensor"])
        means[name] = Mean(mean.value, sd, None)
    return means, f"{path}: {'; '.join(notes)}" if notes else None


def _pulses_of_trace(
    path: Path, time: Array, force: Array, setting: PulseSetting
) -> "tuple[Pulses, tuple[float, float], list[str]]":
    """Pulses of a sampled force [N], begin and end of the record [s], and notes. Raises InputError."""
    from rbdyn.dynamics.statistics.pulses import as_short_as_the_filter, low_passed, pulses_of
    from rbdyn.scene.laws import SAMPLES_A_PERIOD

    threshold, bandwidth = setting.threshold, setting.bandwidth
    rate = _rate(path, time, SAMPLES_A_PERIOD, "bandwidth_hz", bandwidth)
    filtered, notes = low_passed(force, rate, bandwidth), list[str]()
    background = 1.4826 * float(np.median(np.abs(filtered - np.median(filtered))))
    if threshold < CLEAR * background:
        notes.append(f"threshold_N = {threshold:g} is below {CLEAR:g} times the background of {background:.2g} N")
    size = np.abs(force)
    high, largest = int((size >= threshold).sum()), int((size == size.max()).sum())
    if largest > max(CLIPPED * high, 2.0):
        notes.append(
            f"{largest} samples are the largest one, {size.max():.4g} N; the sensor may be at the end of its range"
        )
    pulses = pulses_of(filtered, rate, threshold, setting.dead_time)
    if pulses.time.size and as_short_as_the_filter(pulses.height.mean(), pulses.impulse.mean(), bandwidth):
        notes.append(
            "the pulses are as short as bandwidth_hz allows, so their height shows the impulse, not the stiffness"
        )
    return pulses, (0.0, len(force) / rate), notes


def _columns(path: Path, names: tuple[str, ...]) -> list[Array]:
    """Numbers in SI of the columns, each of which may have one of several units. Raises InputError."""
    sheet, numbers, faults = read_sheet(path), list[Array](), list[str]()
    for name in names:
        units = [unit for unit in name.split(" or ") if unit in sheet]
        if len(units) == 1:
            values, slips = sheet.column(units[0]).numbers(SAMPLED)
            numbers.append(values * next((unit for end, unit in UNITS.items() if units[0].endswith(end)), 1.0))
            faults += slips
        else:
            repetition = f"{path}: columns {' and '.join(units)} are both there; keep one"
            faults.append(repetition if units else f"{path}: column {name} is missing; add it")
    refuse(faults)
    return numbers
