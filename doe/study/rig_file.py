"""Measurements on a rig: a CSV table, a row an operating condition with what was measured there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from doe.study.rig_signals import KINDS, cage_speed, whirl
from doe.study_file.table import fields, listed
from rbdyn.faults import InputError, refuse
from rbdyn.records.cells import NUMBER
from rbdyn.records.words import counted

# What can be measured, by its name in the results of a simulation; the others of these are no positive numbers.
OUTPUTS = ("impact_force_N", "impact_contact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm")
SD, TURNS, HOLD = "_sd", "turns", "hold"
FILE, KIND, PULSES, SPEED = "signal_file", "signal_kind", "pulses_per_turn", "cage_speed_rpm"
ORBIT, CUTOFF, STILL, WHIRL = "orbit", "cutoff_hz", "still_file", "whirl_deviation_ratio"
# Keys of what turns once a shaft turn, and of the filter that the simulated whirl gets.
SHAFTS = "operation.inner_speed_rpm", "operation.outer_speed_rpm"
FILTER = "numerics.whirl_cutoff_hz", "numerics.whirl_notches_hz"
YES, NO = ("1", "yes", "true"), ("", "0", "no", "false")
# Rows that teach.
FEWEST = 3


@dataclass(frozen=True)
class Row:
    """A row: its number in the file, values of scene keys, measured values by output with their standard deviations (None
    where the scatter of ``turns`` shaft turns is to be taken), and whether it is ``held`` out to try what was learned."""

    number: int
    keys: dict[str, Any]
    values: dict[str, float]
    sds: dict[str, float | None]
    turns: float | None
    held: bool


@dataclass(frozen=True)
class Rig:
    """A rig's table: its rows, the scene keys that are its columns, the outputs that were measured, what signals lack."""

    path: Path
    rows: list[Row]
    keys: tuple[str, ...]
    outputs: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def conditions(self) -> list[dict[str, Any]]:
        """Different conditions, in their order."""
        return [dict(each) for each in dict.fromkeys(tuple(row.keys.items()) for row in self.rows)]


def read_rig(path: Path) -> Rig:
    """Read a rig's table. Raises InputError with all faults."""
    header, rows = fields(path)
    header = [name.strip() for name in header]
    keys = tuple(name for name in header if "." in name)
    outputs = tuple(name for name in header if name in OUTPUTS)
    if FILE in header:
        signals = [row for row in rows if row[header.index(FILE)].strip()]
        kinds = [row[header.index(KIND)].strip() if KIND in header else "" for row in signals]
        outputs = tuple(dict.fromkeys([*outputs, *(WHIRL if kind == ORBIT else SPEED for kind in kinds)]))
    known = {*keys, *outputs, *(name + SD for name in outputs), TURNS, HOLD, FILE, KIND, PULSES, CUTOFF, STILL}
    faults = [f"{path}: {_unknown(name, outputs)}" for name in header if name not in known]
    twice = [name for name in dict.fromkeys(header) if header.count(name) > 1]
    faults += [f"{path}: column {name} comes twice; remove one" for name in twice]
    if not outputs:
        faults.append(f"{path}: no measured output; add a column of {listed(OUTPUTS)}")
    if not keys:
        faults.append(f"{path}: no operating condition; add a column of a scene key such as operation.inner_speed_rpm")
    refuse(faults)
    notes = list[str]()
    found = [
        _row(dict(zip(header, map(str.strip, row), strict=True)), number, keys, outputs, path, faults, notes)
        for number, row in enumerate(rows, 1)
    ]
    teaching = sum(not row.held for row in found)
    if teaching < FEWEST:
        faults.append(f"{path}: {counted(teaching, 'row')} to learn from; give {FEWEST} at least that are not on hold")
    refuse(faults)
    return Rig(path, found, keys, outputs, tuple(notes))


def _unknown(name: str, outputs: Sequence[str]) -> str:
    if name.endswith(SD):
        return f"column {listed([name])}: no output {listed([name.removesuffix(SD)])} is measured here; add it or remove this"
    if name == "cage_slip":
        return "column cage_slip: may be nothing or less; give cage_speed_rpm, which tells the same"
    return (
        f"column {listed([name])}: neither a key of a scene (table.key), an output ({listed(OUTPUTS)}), its {SD}, "
        f"{TURNS} nor {HOLD}; rename or remove it"
    )


def _row(
    cells: Mapping[str, str], place: int, keys: Sequence[str], outputs: Sequence[str], path: Path, faults: list[str],
    notes: list[str],
) -> Row:  # fmt: skip
    where = f"{path}: row {place}"

    def number(name: str) -> float | None:
        text = cells.get(name, "")
        if text in ("", "nan"):
            return None
        if NUMBER.fullmatch(text) and float(text) > 0.0:
            return float(text)
        faults.append(f"{where}: {name} = {text!r}: not a positive number; mend it")
        return 1.0

    before = len(faults)
    values = {name: value for name in outputs if (value := number(name)) is not None}
    sds, turns, cutoff = {name: number(name + SD) for name in values}, number(TURNS), number(CUTOFF)
    scene_keys, notches = {key: _value(cells[key]) for key in keys}, tuple[float, ...]()
    if cells.get(FILE) and len(faults) == before:
        try:
            if cells.get(KIND) == ORBIT:
                notches = _runout(scene_keys, values.get(SPEED))
                values[WHIRL], sds[WHIRL], told = _orbit(cells, path, where, cutoff, notches)
            else:
                values[SPEED], sds[SPEED], told = _signal(cells, path, where)
            notes += [told] if told else []
        except InputError as error:
            faults += error.faults
    elif not values and not cells.get(FILE):
        faults.append(f"{where}: nothing measured; remove it")
    if cutoff is not None and WHIRL in values:
        # The simulated whirl is filtered alike.
        scene_keys |= dict(zip(FILTER, (cutoff, notches), strict=True))
    faults += [
        f"{where}: {name}{SD} is missing; give it, or {TURNS} for the scatter of a run of so many shaft turns"
        for name, sd in sds.items()
        if sd is None and turns is None
    ]
    faults += [f"{where}: {key} is missing; every row needs a value" for key in keys if not cells[key]]
    hold = cells.get(HOLD, "").lower()
    if hold not in (*YES, *NO):
        faults.append(f"{where}: {HOLD} = {hold!r}: write 1 for a row that is held out, else 0")
    return Row(place, scene_keys, values, sds, turns, hold in YES)


def _signal(cells: Mapping[str, str], path: Path, where: str) -> tuple[float, float, str | None]:
    kind, pulses = cells.get(KIND, ""), cells.get(PULSES, "") or "1"
    if kind not in KINDS:
        raise InputError([f"{where}: {KIND} = {kind!r}: unknown; choose {' or '.join(KINDS)}"])
    if not pulses.isdecimal() or int(pulses) < 1:
        raise InputError([f"{where}: {PULSES} = {pulses!r}: not a whole number of pulses a cage turn; mend it"])
    return cage_speed(path.parent / cells[FILE], kind, int(pulses))


def _orbit(
    cells: Mapping[str, str], path: Path, where: str, cutoff: float | None, notches: tuple[float, ...]
) -> tuple[float, float, str | None]:
    if cutoff is None:
        raise InputError([f"{where}: {CUTOFF} is missing; give the frequency below which the orbit counts"])
    still = cells.get(STILL)
    return whirl(path.parent / cells[FILE], cutoff, notches, path.parent / still if still else None)


def _runout(keys: Mapping[str, Any], cage: float | None) -> tuple[float, ...]:
    """Frequencies [Hz] of the row's shaft and cage, as far as it tells them."""
    speeds = [abs(speed) for key in SHAFTS if isinstance(speed := keys.get(key), int | float)]
    return tuple(speed / 60.0 for speed in dict.fromkeys([*speeds, cage or 0.0]) if speed > 0.0)


def _value(text: str) -> Any:
    """A field as TOML would give it."""
    if NUMBER.fullmatch(text):
        return int(text) if text.lstrip("+-").isdigit() else float(text)
    return {"true": True, "false": False}.get(text.lower(), text)
