"""Values of a rig's table from raw signals: mean cage speed, whirl deviation ratio and impact pulses, with their deviations.

    python examples/rig_signals.py cage_pulses pulses.csv --pulses-per-turn 3
    python examples/rig_signals.py orbit orbit.csv --cutoff 500 --notch 200 --still rest.csv
    python examples/rig_signals.py impact_force trace.csv --threshold 10 --bandwidth 5000
    python examples/rig_signals.py simulated SCENE.toml --threshold 10 --bandwidth 5000

A signal is a table of text, a workbook or parquet, and MDF4 or TDMS where asammdf or nptdms is installed. Each prints columns of RIG.csv for ``doe calibrate``, or the pulses of a simulated motion. Errors are by batch means.

A mean over time needs no filter. Pulses of a wheel are counted by whole cage turns, so that uneven spacing of their marks
cancels. Whirl needs a velocity: an orbit is filtered as ``numerics.whirl_cutoff_hz`` filters the simulated one, so give the
cutoff as a column of that key.

Impact pulses: a force, sampled evenly, is low-passed and its absolute value is taken. A pulse is a stretch above the
threshold. Its height is the largest force in it, at the vertex of the parabola through the largest sample and its neighbours.
Its impulse is the integral of the force over it, and its time is that of its height. The dead time starts at a pulse: further
pulses within it belong to the first, which gets the larger height and both impulses. Stretches that the record cuts at an end
are left out.

The low pass is a Gaussian that halves the power at the bandwidth f: exp(-ln 2/2 (nu/f)^2), of standard deviation
sqrt(ln 2)/(2 pi f) = 0.133/f in time. It has no overshoot, so one pulse never makes two. A pulse far shorter than 1/f, of
impulse J, becomes a Gaussian of height J f sqrt(2 pi/ln 2) = 3.01 J f. Its height then shows the impulse alone. Only pulses
longer than that show the stiffness of what they hit: a half sine of height H lasts pi J/(2 H) = pi sqrt(m/k).

A sensor sees every pulse through its own bandwidth and its sampling. So measured and simulated forces are low-passed by the
same Gaussian, whose bandwidth lies below that of the sensor.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
import typer
from scipy.ndimage import gaussian_filter1d

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, read_bytes, refuse
from rbdyn.base.tables.sheet import InputTable, Limits, read_sheet, sheet_of_frame
from rbdyn.base.words import counted
from rbdyn.dynamics.figures import WHIRL_DEVIATION_RATIO
from rbdyn.dynamics.motion import history
from rbdyn.dynamics.statistics.batch_means import estimate
from rbdyn.dynamics.statistics.metrics import NOTCH_PERIODS, filtered_speed, sums_until
from rbdyn.scene import Scene
from rbdyn.scene.laws import SAMPLES_A_PERIOD

if TYPE_CHECKING:
    import pandas as pd

# Columns of each kind of signal; some may have one of two units.
KINDS = {
    "cage_pulses": ("t_s",),
    "cage_speed": ("t_s", "cage_speed_rpm"),
    "orbit": ("t_s", "x_um or x_m", "y_um or y_m"),
    "impact_force": ("t_s", "force_N or force_kN"),
    "impact_acceleration": ("t_s", "acceleration_m_s2"),
    "impact_pulses": ("t_s", "height_N or height_kN"),
}
TIME = "t_s"
# Packages that read the files of measuring systems, by the end of a name.
MEASURED = {".mf4": "asammdf", ".mdf": "asammdf", ".tdms": "nptdms"}
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


# Standard deviation in time, and height over impulse of a very short pulse, times and over the bandwidth.
SPREAD = math.sqrt(math.log(2.0)) / (2.0 * math.pi)
SHORTEST = math.sqrt(2.0 * math.pi / math.log(2.0))
# Standard deviations after which the filter ends: the rest is 6e-7 of it.
REACH = 5.0
# Pulses at most this many times as long as the filter leaves the shortest ones: their heights show the impulse alone.
AS_SHORT = 1.25
# Samples of a simulated force in a period of the bandwidth: no sensor filters it before, so it needs more than a measured one.
SIMULATED_SAMPLES = 20


class Mean(NamedTuple):
    """A mean over a signal, its standard deviation, and a note on gaps or noise, if any."""

    value: float
    sd: float
    note: str | None


def cage_speed(path: Path, kind: str, pulses_per_turn: int) -> Mean:
    """Mean cage speed [rpm]. Raises InputError."""
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


class Pulses(NamedTuple):
    """Pulses of one force in the order of their times [s]: heights [N] and impulses [N s]."""

    time: Array
    height: Array
    impulse: Array


def low_passed(force: Array, rate: float, bandwidth: float) -> Array:
    """Force (samples, ...) sampled at ``rate`` [Hz], without what is faster than ``bandwidth`` [Hz]; the ends repeat."""
    return np.asarray(gaussian_filter1d(force, SPREAD * rate / bandwidth, axis=0, mode="nearest", truncate=REACH))


def pulses_of(force: Array, rate: float, threshold: float, dead_time: float) -> Pulses:
    """Pulses of a force (samples,) [N] that is low-passed; ``rate`` [Hz], ``threshold`` [N], ``dead_time`` [s]."""
    size = np.abs(force)
    edges = np.diff((size >= threshold).astype(np.int8))
    begins, ends = np.flatnonzero(edges > 0) + 1, np.flatnonzero(edges < 0) + 1
    # A stretch from the first sample on has no begin, one to the last sample no end.
    ends = ends[np.searchsorted(ends, begins[0]) :] if begins.size else ends[:0]
    begins = begins[: ends.size]
    if not begins.size:
        return Pulses(np.zeros(0), np.zeros(0), np.zeros(0))
    peaks = _highest(size, begins, ends)
    before, top, after = size[peaks - 1], size[peaks], size[np.minimum(peaks + 1, size.size - 1)]
    bend = np.minimum(before - 2.0 * top + after, 0.0)
    shift = np.divide(0.5 * (before - after), bend, out=np.zeros(peaks.size), where=bend < 0.0)
    heights = top - 0.25 * (before - after) * shift
    pulses = Pulses((peaks + shift) / rate, heights, _impulses(size, begins, ends, threshold) / rate)
    return without_echoes(pulses, dead_time)


def _highest(size: Array, begins: Whole, ends: Whole) -> Whole:
    """Places of the largest sample in each stretch, the first of equal ones."""
    stretches = zip(begins.tolist(), ends.tolist(), strict=True)
    return np.array([begin + int(size[begin:end].argmax()) for begin, end in stretches])


def _impulses(size: Array, begins: Whole, ends: Whole, threshold: float) -> Array:
    """Sums of trapezoids [N samples] over each stretch, from crossing to crossing of the threshold on straight lines."""
    total = np.concatenate([[0.0], np.cumsum(size)])
    inside = total[ends] - total[begins] - 0.5 * (size[begins] + size[ends - 1])
    for first, beyond in ((begins, begins - 1), (ends - 1, ends)):
        rise = size[first] - size[beyond]
        share = np.divide(size[first] - threshold, rise, out=np.zeros(rise.size), where=rise > 0.0)
        inside = inside + 0.5 * share * (size[first] + threshold)
    return np.asarray(inside)


def without_echoes(pulses: Pulses, dead_time: float) -> Pulses:
    """The pulses, each with those that follow within the ``dead_time`` [s] as one."""
    firsts, place = list[int](), 0
    while place < pulses.time.size:
        firsts.append(place)
        place = max(int(np.searchsorted(pulses.time, pulses.time[place] + dead_time)), place + 1)
    if len(firsts) == pulses.time.size:
        return pulses
    heights, impulses = np.maximum.reduceat(pulses.height, firsts), np.add.reduceat(pulses.impulse, firsts)
    return Pulses(pulses.time[firsts], heights, impulses)


def pulse_sums(pulses: Pulses, ends: Array) -> Array:
    """Number of pulses, sums of heights [N] and of impulses [N s], (parts, 3), over parts that end at times ``ends`` [s]."""
    parts = np.searchsorted(ends, pulses.time, side="left")
    weights = (np.ones(pulses.time.size), pulses.height, pulses.impulse)
    return np.column_stack([np.bincount(parts, weight, len(ends) + 1)[: len(ends)] for weight in weights])


def as_short_as_the_filter(height: float, impulse: float, bandwidth: float) -> bool:
    """Whether pulses of a mean height [N] and impulse [N s] are as short as a low pass [Hz] lets them be."""
    return impulse * bandwidth * SHORTEST < AS_SHORT * height


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
) -> tuple[Pulses, tuple[float, float], list[str]]:
    """Pulses of a sampled force [N], begin and end of the record [s], and notes. Raises InputError."""

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


def _signals(path: Path) -> InputTable:
    """The table of a file: text, a workbook or parquet, MDF by asammdf and TDMS by nptdms where these are installed.

    The time of both is the column "t_s"; other columns have the names of their channels. Raises InputError.
    """
    kind = path.suffix.lower()
    if kind not in MEASURED:
        return read_sheet(path)
    package = MEASURED[kind]
    read_bytes(path)
    try:
        frame = _mdf(path) if package == "asammdf" else _tdms(path)
    except ImportError:
        raise InputError([f"{path}: is read by {package}; pip install {package}, or export it as CSV"]) from None
    except Exception:
        raise InputError([f"{path}: cannot be read by {package}; check the file, or export it as CSV"]) from None
    return sheet_of_frame(frame, path)


def _mdf(path: Path) -> "pd.DataFrame":
    """All channels of an MDF file, interpolated at the times of every one."""
    from asammdf import MDF

    with MDF(path) as file:
        frame = file.to_dataframe()
    frame.insert(0, TIME, frame.index.to_numpy())
    return frame


def _tdms(path: Path) -> "pd.DataFrame":
    """Channels of the first group of a TDMS file, whose waveforms have a time."""
    from nptdms import TdmsFile

    group = TdmsFile.read(path).groups()[0]
    frame = group.as_dataframe(time_index=True)
    frame.insert(0, TIME, frame.index.to_numpy())
    return frame


def _columns(path: Path, names: tuple[str, ...]) -> list[Array]:
    """Numbers in SI of the columns, each of which may have one of several units. Raises InputError."""
    sheet, numbers, faults = _signals(path), list[Array](), list[str]()
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


def simulated_pulses(scene: Scene, turns: float, setting: PulseSetting) -> dict[str, float]:
    """Rate at a pocket [Hz], mean height [N] and mean impulse [N s] of the pulses of one replicate, over all its pockets."""
    per_turn = max(math.ceil(SIMULATED_SAMPLES * setting.bandwidth * scene.turn_s), 8)
    motion = history(scene, turns, samples_per_turn=per_turn)
    rate = per_turn / scene.turn_s
    walls = low_passed(motion.pocket_load, rate, setting.bandwidth).T
    pulses = [pulses_of(wall, rate, setting.threshold, setting.dead_time) for wall in walls]
    heights, impulses = (
        np.concatenate(column) for column in zip(*((p.height, p.impulse) for p in pulses), strict=True)
    )
    seconds = len(motion.time) / rate * len(walls)
    number = max(heights.size, 1)
    return {
        "pulse_rate_hz": heights.size / seconds,
        "pulse_height_N": float(heights.sum() / number),
        "pulse_impulse_N_s": float(impulses.sum() / number),
    }


def main(
    kind: Annotated[str, typer.Argument(help=f"Kind of signal: {', '.join(KINDS)}; or simulated.")],
    path: Annotated[Path, typer.Argument(help="Signal file, or the scene of a simulated motion.")],
    pulses_per_turn: Annotated[int, typer.Option(help="Pulses in a turn of the cage.")] = 1,
    cutoff: Annotated[float, typer.Option(help="Frequency below which an orbit counts [Hz].")] = 500.0,
    notch: Annotated[list[float] | None, typer.Option(help="Frequency of a runout [Hz]; repeatable.")] = None,
    still: Annotated[Path | None, typer.Option(help="Record of the rig at rest.")] = None,
    threshold: Annotated[float, typer.Option(help="Force above which a pulse counts [N].")] = 10.0,
    bandwidth: Annotated[float, typer.Option(help="Gaussian low pass of the force [Hz].")] = 5000.0,
    dead_time_ms: Annotated[float, typer.Option(help="Time after a pulse in which further ones belong to it.")] = 0.0,
    sensor_mass_g: Annotated[float, typer.Option(help="Force over acceleration, from a tap with a hammer.")] = 1000.0,
    turns: Annotated[float, typer.Option(help="Shaft turns of a simulated motion.")] = 100.0,
) -> None:
    """Print the columns of a rig's table that a signal gives, each with its standard deviation."""
    mass = 1e-3 * sensor_mass_g if kind == "impact_acceleration" else None
    setting = PulseSetting(threshold, bandwidth, 1e-3 * dead_time_ms, mass)
    if kind == "simulated":
        for name, value in simulated_pulses(Scene.load(path), turns, setting).items():
            print(f"{name},{value:.6g}")
        return
    if kind not in KINDS:
        raise typer.BadParameter(f"{kind}: is no kind of signal; choose {', '.join(KINDS)} or simulated")
    try:
        if kind == "orbit":
            means, note = {"whirl_deviation_ratio": whirl(path, cutoff, notch or (), still)}, None
        elif kind in (*TRACES, *LISTS):
            means, note = impact_pulses(path, kind, setting)
        else:
            means, note = {"cage_speed_rpm": cage_speed(path, kind, pulses_per_turn)}, None
    except InputError as error:
        raise typer.BadParameter("; ".join(map(str, error.faults))) from None
    for name, mean in means.items():
        print(f"{name},{mean.value:.6g}\n{name}_sd,{mean.sd:.3g}")
        note = mean.note or note
    if note:
        print(note)


if __name__ == "__main__":
    typer.run(main)
