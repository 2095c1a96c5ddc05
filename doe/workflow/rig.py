"""Measurements on a rig: a CSV table with a row for each operating condition, and raw signals with errors by batch means.

A mean over time needs no filter. Pulses are counted by whole cage turns, so that uneven spacing of their marks cancels.
Whirl needs a velocity: an orbit is filtered like the simulated one (``filtered_whirl``).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from doe.study_file.table import UNKNOWN, Column, Limits, Sheet, gap_notes, listed, read_sheet
from doe.workflow.input_sets import key_values, unknown_keys
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, refuse
from rbdyn.base.words import counted

# Columns of each kind of signal; some may have one of two units.
KINDS = {
    "cage_pulses": ("t_s",),
    "cage_speed": ("t_s", "cage_speed_rpm"),
    "orbit": ("t_s", "x_um or x_m", "y_um or y_m"),
}
# Values in any unit in use; finer steps of time are round-off, and their inverse overflows.
SAMPLED, FINEST = Limits(1e12), 1e-12
# A turn that takes longer than this many median turns has lost a pulse.
LOST = 1.5
# Turns or samples that the error of a mean needs.
FEWEST_SAMPLES = 20
# Batches of an orbit at most, periods of the cutoff in each at least, and periods of a record of noise at least.
MOST_PARTS, PERIODS, STILL_PERIODS = 400, 10, 20
# Intervals of an even signal are alike within this share.
EVEN = 0.1
# Largest share of noise in the mean square of a speed: its effect on the mean is known to first order.
LOUDEST = 0.25


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
    interval = (time[-1] - time[0]) / max(len(time) - 1, 1)
    if not (np.abs(np.diff(time) - interval) < EVEN * interval).all() or not interval >= FINEST:
        raise InputError([f"{path}: t_s does not rise evenly; give samples at equal intervals"])
    rate = 1.0 / interval
    if rate * (1.0 + 1e-6) < SAMPLES_A_PERIOD * cutoff:
        raise InputError(
            [
                f"{path}: {rate:.4g} samples a second are fewer than {SAMPLES_A_PERIOD} a period of cutoff_hz = "
                f"{cutoff:g}; sample faster or give {rate / SAMPLES_A_PERIOD:.4g} at most"
            ]
        )
    periods = len(time) * cutoff / rate
    if periods < least_periods:
        raise InputError(
            [f"{path}: shorter than {least_periods} periods of cutoff_hz = {cutoff:g}; measure longer or raise it"]
        )
    return filtered_speed(np.stack(place), rate, cutoff, notches), periods


def _columns(path: Path, names: tuple[str, ...]) -> list[Array]:
    """Numbers in SI of the columns, each of which may have one of several units. Raises InputError."""
    sheet, numbers, faults = read_sheet(path), list[Array](), list[str]()
    for name in names:
        units = [unit for unit in name.split(" or ") if unit in sheet]
        if len(units) == 1:
            values, slips = sheet.column(units[0]).numbers(SAMPLED)
            numbers.append(values * (1e-6 if units[0].endswith("_um") else 1.0))
            faults += slips
        else:
            repetition = f"{path}: columns {' and '.join(units)} are both there; keep one"
            faults.append(repetition if units else f"{path}: column {name} is missing; add it")
    refuse(faults)
    return numbers


# Outputs of a simulation that can be measured; the others are not positive throughout.
OUTPUTS = ("impact_force_N", "impact_contact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm")
SD, TURNS, HOLD = "_sd", "turns", "hold"
FILE, KIND, PULSES, SPEED = "signal_file", "signal_kind", "pulses_per_turn", "cage_speed_rpm"
ORBIT, CUTOFF, STILL, WHIRL = "orbit", "cutoff_hz", "still_file", "whirl_deviation_ratio"
# Keys of the speeds whose runout is filtered out, and of the filter of the simulated whirl.
SHAFTS = "operation.inner_speed_rpm", "operation.outer_speed_rpm"
FILTER = "numerics.whirl_cutoff_hz", "numerics.whirl_notches_hz"
YES, NO = ("1", "yes", "true"), ("", "0", "no", "false")
# Measured values in any unit in use; pulses per turn of the finest encoders.
MEASURED, COUNTED = Limits(1e12, 1e-12, "positive"), Limits(1e6, sign="positive", whole=True)
# Fewest training rows; most rows, whose joint covariance is quickly solved; most conditions, each with its own seeds.
FEWEST, MOST_ROWS, MOST_CONDITIONS = 3, 1000, 200


@dataclass(frozen=True)
class Row:
    """A row: its number in the file, values of scene keys, and measured values by output.

    ``sds``: standard deviations by output; None stands for the scatter of ``turns`` shaft turns. ``hold``: whether the row
    is left out of the calibration to test it.
    """

    number: int
    keys: dict[str, Any]
    values: dict[str, float]
    sds: dict[str, float | None]
    turns: float | None
    hold: bool


@dataclass(frozen=True)
class Rig:
    """A rig's table: its rows, the scene keys and the measured outputs among its columns, and notes on its signals."""

    path: Path
    rows: list[Row]
    keys: tuple[str, ...]
    outputs: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def conditions(self) -> list[dict[str, Any]]:
        """The distinct conditions, in the order of their first rows."""
        return [dict(condition) for condition in dict.fromkeys(tuple(row.keys.items()) for row in self.rows)]


def read_rig(path: Path) -> Rig:
    """Read a rig's table with the signals that it names. Raises InputError with all faults of the table, or of the signals."""
    sheet = read_sheet(path)
    keys, outputs = _keys_and_outputs(sheet)
    if len(sheet.rows) > MOST_ROWS:
        raise InputError([f"{path}: has {len(sheet.rows)} rows; give {MOST_ROWS} at most, such as means of alike ones"])
    cells, faults = _cells(sheet, keys)
    faults += [fault for place in range(len(sheet.rows)) for fault in _faults(cells, place, outputs)]
    training = sum(cells.text(HOLD, place).lower() not in YES for place in range(len(sheet.rows)))
    if training < FEWEST:
        faults.append(f"{path}: only {counted(training, 'row')} not on hold; at least {FEWEST} are needed")
    refuse(faults)
    rows, notes = [], []
    for place in range(len(sheet.rows)):
        try:
            row, note = _row(cells, place, outputs)
        except InputError as error:
            faults += error.faults
            continue
        rows.append(row)
        notes += [note] if note else []
    refuse(faults)
    gaps = {name: np.array([row.values.get(name, math.nan) for row in rows]) for name in outputs}
    rig = Rig(path, rows, keys, outputs, (*sheet.notes, *gap_notes(path, gaps), *dict.fromkeys(notes)))
    if len(rig.conditions) > MOST_CONDITIONS:
        raise InputError([f"{path}: has {len(rig.conditions)} operating conditions; give {MOST_CONDITIONS} at most"])
    return rig


@dataclass(frozen=True)
class _Cells:
    """Columns of a rig's table: all of them as texts, ``numbers`` (NaN where unknown), and values of scene ``keys``."""

    path: Path
    columns: Mapping[str, Column]
    numbers: Mapping[str, Array]
    keys: Mapping[str, Sequence[Any]]

    def text(self, name: str, place: int) -> str:
        """The text in a row, empty where there is no such column."""
        return self.columns[name].texts[place] if name in self.columns else ""

    def number(self, name: str, place: int) -> float | None:
        """The number in a row; None where it is unknown."""
        value = float(self.numbers[name][place]) if name in self.numbers else math.nan
        return None if math.isnan(value) else value

    def states(self, name: str, place: int) -> bool:
        """Whether a row has a value."""
        return self.text(name, place).lower() not in (UNKNOWN if name in self.numbers else ("",))

    def fault(self, name: str, place: int, words: str) -> str:
        """A sentence on the cell of a row."""
        if self.states(name, place):
            return self.columns[name].fault(place, words)
        return f"{self.path}: {name} in row {place + 1}: {words}"


def _keys_and_outputs(sheet: Sheet) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Scene keys and outputs among the columns, or of signals. Raises InputError for any other column."""
    sheet.refuse_nameless()
    names = [name for name in sheet.header if name]
    keys = tuple(name for name in names if "." in name)
    kinds = sheet.column(KIND).texts if KIND in sheet else ()
    signals = [WHIRL if kind == ORBIT else SPEED for kind in kinds if kind in KINDS]
    outputs = tuple(dict.fromkeys([*(name for name in names if name in OUTPUTS), *signals]))
    columns = {*keys, *outputs, *(name + SD for name in outputs), TURNS, HOLD, FILE, KIND, PULSES, CUTOFF, STILL}
    faults = [f"{sheet.path}: {fault}" for fault in unknown_keys(keys)]
    faults += [f"{sheet.path}: {_unknown(name, outputs)}" for name in names if name not in columns]
    if not outputs:
        faults.append(f"{sheet.path}: no measured output; add a column of {listed(OUTPUTS)}")
    if not keys:
        faults.append(
            f"{sheet.path}: no operating condition; add a column of a scene key such as operation.inner_speed_rpm"
        )
    if CUTOFF in sheet:
        faults += [f"{sheet.path}: column {key}: {CUTOFF} sets that key; remove one" for key in FILTER if key in sheet]
    refuse(faults)
    return keys, outputs


def _unknown(name: str, outputs: Sequence[str]) -> str:
    if name.endswith(SD):
        return f"column {listed([name])}: no output {listed([name.removesuffix(SD)])} is measured here; add it or remove this"
    if name == "cage_slip":
        return "column cage_slip: may be nothing or less; give cage_speed_rpm, which means the same"
    return (
        f"column {listed([name])}: neither a key of a scene (table.key), an output ({listed(OUTPUTS)}), its {SD}, "
        f"{TURNS} nor {HOLD}; rename or remove it"
    )


def _cells(sheet: Sheet, keys: Sequence[str]) -> tuple[_Cells, list[str]]:
    """The columns of the table, and a sentence for each cell without a value of its column."""
    columns = {name: sheet.column(name) for name in sheet.places}
    numbers, values, faults = dict[str, Array](), dict[str, list[Any]](), list[str]()
    for name, column in columns.items():
        if name in keys:
            values[name], slips = key_values(column)
        elif name in (HOLD, FILE, KIND, STILL):
            continue
        else:
            numbers[name], slips = column.numbers(COUNTED if name == PULSES else MEASURED, UNKNOWN)
        faults += slips
    return _Cells(sheet.path, columns, numbers, values), faults


def _faults(cells: _Cells, place: int, outputs: Sequence[str]) -> Iterator[str]:
    """Sentences on cells of a row that are missing, twice there, or without use."""
    kind = cells.text(KIND, place) if cells.states(FILE, place) else ""
    signal = WHIRL if kind == ORBIT else SPEED if kind in KINDS else None
    if cells.states(FILE, place) and signal is None:
        yield cells.fault(KIND, place, f"is no kind of signal; choose {', '.join(KINDS)}")
        return
    measured = [name for name in outputs if cells.states(name, place)]
    used = {PULSES: kind == "cage_pulses", STILL: kind == ORBIT, CUTOFF: WHIRL in (signal, *measured)}
    used |= {KIND: cells.states(FILE, place)} | {name + SD: name in measured for name in outputs}
    for name, serves in used.items():
        if cells.states(name, place) and not serves:
            yield cells.fault(
                name, place, "has no use in this row; leave it out, or add the measurement that it belongs to"
            )
    for name in measured:
        if not (cells.states(name + SD, place) or cells.states(TURNS, place)):
            yield cells.fault(
                name + SD, place, f"is missing; give it, or {TURNS} for the scatter of a run of so many shaft turns"
            )
    if signal in measured:
        yield cells.fault(str(signal), place, f"comes from {FILE} too; leave out one")
    if kind == ORBIT and not cells.states(CUTOFF, place):
        yield cells.fault(CUTOFF, place, "is missing; give the frequency below which the orbit counts")
    if not measured and not cells.states(FILE, place):
        yield f"{cells.path}: row {place + 1}: nothing measured; remove it"
    if cells.text(HOLD, place).lower() not in (*YES, *NO):
        yield cells.fault(HOLD, place, "is neither yes nor no; write 1 for a row that is held out, else 0")


def _row(cells: _Cells, place: int, outputs: Sequence[str]) -> tuple[Row, str | None]:
    """A row without faults, and a note on its signal. Raises InputError for a signal that cannot be read."""
    keys = {key: values[place] for key, values in cells.keys.items()}
    values = {name: value for name in outputs if (value := cells.number(name, place)) is not None}
    sds = {name: cells.number(name + SD, place) for name in values}
    cutoff, turns, notches, note = cells.number(CUTOFF, place), cells.number(TURNS, place), tuple[float, ...](), None
    if cells.states(FILE, place):
        signal, kind = cells.path.parent / cells.text(FILE, place), cells.text(KIND, place)
        if kind == ORBIT:
            assert cutoff is not None
            notches = _runout(keys, values.get(SPEED))
            rest_record = cells.path.parent / cells.text(STILL, place) if cells.states(STILL, place) else None
            mean = whirl(signal, cutoff, notches, rest_record)
        else:
            mean = cage_speed(signal, kind, int(cells.number(PULSES, place) or 1))
        name = WHIRL if kind == ORBIT else SPEED
        values[name], sds[name], note = mean
    if cutoff is not None:
        # The simulated whirl has the same filter.
        keys |= dict(zip(FILTER, (cutoff, notches), strict=True))
    return Row(place + 1, keys, values, sds, turns, cells.text(HOLD, place).lower() in YES), note


def _runout(keys: Mapping[str, Any], cage: float | None) -> tuple[float, ...]:
    """Frequencies [Hz] of the row's shafts and cage, as far as the row states them."""
    speeds = [abs(speed) for key in SHAFTS if isinstance(speed := keys.get(key), int | float)]
    return tuple(speed / 60.0 for speed in dict.fromkeys([*speeds, cage or 0.0]) if speed > 0.0)
