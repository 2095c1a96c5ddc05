"""Measurements on a rig: a CSV table with a row for each operating condition, and its columns as ``doe keys`` lists them.

Further columns are named by keys of the scene, such as operation.inner_speed_rpm.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, create_model

from doe.study_file.table import gap_notes
from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, Strict, refuse
from rbdyn.base.notes import Notes
from rbdyn.base.records import Record
from rbdyn.base.tables.sheet import UNKNOWN, InputColumn, InputTable, Limits, listed, read_sheet
from rbdyn.base.words import counted, quantity
from rbdyn.dynamics.figures import FIGURES, Figure
from rbdyn.result import TEMPERATURES
from rbdyn.scene.keys import key_values, unknown_keys
from rbdyn.scene.uncertain import Calibrate, Uncertain

# Outputs of a simulation that can be measured; the others are not positive throughout. Temperatures count in degrees Celsius.
# Of each output the accuracy of its sensor in percent, where a table states none.
ACCURACIES = {figure.key: figure.accuracy for figure in FIGURES if figure.accuracy}
OUTPUTS = tuple(ACCURACIES)
SD, ACCURACY, TURNS, HOLD, SPEED = "_sd", "_accuracy_percent", "turns", "hold", "cage_speed_rpm"
YES, NO = ("1", "yes", "true"), ("", "0", "no", "false")
# Measured values in any unit in use, and accuracies.
MEASURED, PERCENT = Limits(1e12, 1e-12, "positive"), Limits(100.0, 1e-6, "not negative")
# Fewest training rows; most rows, whose joint covariance is quickly solved; most conditions, each with its own seeds.
FEWEST, MOST_ROWS, MOST_CONDITIONS = 3, 1000, 200
# The row in a sentence on a cell, and words on a cell that no other column's value has replaced.
ROW, ABSENT = re.compile(r" in row (\d+)"), re.compile(r": is missing;")


class Row(Record):
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


class Rig(Record):
    """A rig's table: its rows, the scene keys and the measured outputs among its columns, and notes on how it was read.

    ``accuracies``: by output, the standard deviation of an offset of all its rows, as a share."""

    path: Path
    rows: list[Row]
    keys: tuple[str, ...]
    outputs: tuple[str, ...]
    accuracies: dict[str, float]
    notes: Notes

    @property
    def conditions(self) -> list[dict[str, Any]]:
        """The distinct conditions, in the order of their first rows."""
        return [dict(condition) for condition in dict.fromkeys(tuple(row.keys.items()) for row in self.rows)]


def read_rig(path: Path) -> Rig:
    """Read a rig's table. Raises InputError with all its faults."""
    sheet = read_sheet(path)
    keys, outputs = _keys_and_outputs(sheet)
    if len(sheet.rows) > MOST_ROWS:
        raise InputError(f"{path}: has {len(sheet.rows)} rows; give {MOST_ROWS} at most, such as means of alike ones")
    cells, faults = _cells(sheet, keys)
    accuracies, slips = _accuracies(cells, outputs)
    faults += [fault for place in range(len(sheet.rows)) for fault in _faults(cells, place, outputs)]
    faults = [*_shifted(sheet, faults), *slips]
    training = sum(cells.text(HOLD, place).lower() not in YES for place in range(len(sheet.rows)))
    if training < FEWEST:
        faults.append(f"{path}: only {counted(training, 'row')} not on hold; at least {FEWEST} are needed")
    refuse(faults)
    rows = [_row(cells, place, outputs) for place in range(len(sheet.rows))]
    gaps = {name: np.array([row.values.get(name, math.nan) for row in rows]) for name in outputs if name in sheet}
    rig = Rig(path, rows, keys, outputs, accuracies, (*sheet.notes, *gap_notes(path, gaps)))
    if len(rig.conditions) > MOST_CONDITIONS:
        raise InputError(f"{path}: has {len(rig.conditions)} operating conditions; give {MOST_CONDITIONS} at most")
    return rig


class _Cells(Record):
    """Columns of a rig's table: all of them as texts, ``numbers`` (NaN where unknown), and values of scene ``keys``."""

    path: Path
    columns: Mapping[str, InputColumn]
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


def _keys_and_outputs(sheet: InputTable) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Scene keys and outputs among the columns. Raises InputError for any other column."""
    sheet.refuse_nameless()
    names = [name for name in sheet.header if name]
    keys = tuple(name for name in names if "." in name)
    outputs = tuple(name for name in names if name in OUTPUTS)
    columns = {*keys, *outputs, *(name + end for name in outputs for end in (SD, ACCURACY)), TURNS, HOLD}
    faults = [f"{sheet.path}: {fault}" for fault in unknown_keys(keys)]
    faults += [f"{sheet.path}: {_unknown(name)}" for name in names if name not in columns]
    if not outputs:
        faults.append(f"{sheet.path}: no measured output; add a column of {listed(OUTPUTS)}")
    if not keys:
        faults.append(
            f"{sheet.path}: no operating condition; add a column of a scene key such as operation.inner_speed_rpm"
        )
    refuse(faults)
    return keys, outputs


def _unknown(name: str) -> str:
    for end in (SD, ACCURACY):
        if name.endswith(end):
            output = listed([name.removesuffix(end)])
            return f"column {listed([name])}: no output {output} is measured here; add it or remove this"
    if name == "cage_slip":
        return "column cage_slip: may be nothing or less; give cage_speed_rpm, which means the same"
    return (
        f"column {listed([name])}: neither a key of a scene (table.key), an output ({listed(OUTPUTS)}), its {SD} "
        f"or {ACCURACY}, {TURNS} nor {HOLD}; rename or remove it"
    )


def _cells(sheet: InputTable, keys: Sequence[str]) -> tuple[_Cells, list[str]]:
    """The columns of the table, and a sentence for each cell without a value of its column."""
    columns = {name: sheet.column(name) for name in sheet.places}
    numbers, values, faults = dict[str, Array](), dict[str, list[Any]](), list[str]()
    for name, column in columns.items():
        if name in keys:
            values[name], slips = key_values(column)
        elif name == HOLD:
            continue
        else:
            numbers[name], slips = column.numbers(PERCENT if name.endswith(ACCURACY) else MEASURED, UNKNOWN)
        faults += slips
    return _Cells(sheet.path, columns, numbers, values), faults


def _accuracies(cells: _Cells, outputs: Sequence[str]) -> tuple[dict[str, float], list[str]]:
    """Accuracies by output, and a sentence for each sensor with more than one."""
    shares, faults = dict[str, float](), list[str]()
    for name in outputs:
        column = cells.numbers.get(name + ACCURACY, np.empty(0))
        stated: list[int] = np.flatnonzero(~np.isnan(column)).tolist()
        other = [place for place in stated if column[place] != column[stated[0]]]
        if other:
            words = f"is {column[stated[0]]:g} in row {stated[0] + 1}; a sensor has one accuracy in all rows"
            faults.append(cells.fault(name + ACCURACY, other[0], words))
        shares[name] = (float(column[stated[0]]) if stated else ACCURACIES[name]) / 100.0
    return shares, faults


def _shifted(sheet: InputTable, faults: list[str]) -> list[str]:
    """The faults of cells, or a single sentence where most rows have values of other columns, as of shifted ones."""
    rows = [(fault, found[1]) for fault in faults if (found := ROW.search(fault))]
    alien = [(fault, row) for fault, row in rows if not ABSENT.search(fault)]
    count = len({row for _, row in rows})
    if len({row for _, row in alien}) < FEWEST or 2 * count <= len(sheet.rows):
        return faults
    words = f"{count} of {len(sheet.rows)} rows have cells that do not fit their columns, which may be shifted"
    return [f"{alien[0][0]}; {words}"]


def _faults(cells: _Cells, place: int, outputs: Sequence[str]) -> Iterator[str]:
    """Sentences on cells of a row that are missing or without use."""
    measured = [name for name in outputs if cells.states(name, place)]
    for name in outputs:
        if cells.states(name + SD, place) and name not in measured:
            words = "has no use in this row; leave it out, or add the measurement that it belongs to"
            yield cells.fault(name + SD, place, words)
    for name in measured:
        value, sd = cells.number(name, place), cells.number(name + SD, place)
        if value is not None and sd is not None and sd >= value:
            yield cells.fault(name + SD, place, f"is not below the value itself, {value:g}; check the columns")
        if name in TEMPERATURES and not cells.states(name + SD, place):
            yield cells.fault(name + SD, place, "is missing; give the standard deviation of the thermometer [K]")
        elif not (cells.states(name + SD, place) or cells.states(TURNS, place)):
            yield cells.fault(
                name + SD, place, f"is missing; give it, or {TURNS} for the scatter of a run of so many shaft turns"
            )
    if not measured:
        yield f"{cells.path}: row {place + 1}: nothing measured; remove it"
    if cells.text(HOLD, place).lower() not in (*YES, *NO):
        yield cells.fault(HOLD, place, "is neither yes nor no; write 1 for a row that is held out, else 0")


def _row(cells: _Cells, place: int, outputs: Sequence[str]) -> Row:
    """A row without faults."""
    keys = {key: values[place] for key, values in cells.keys.items()}
    values = {name: value for name in outputs if (value := cells.number(name, place)) is not None}
    sds = {name: cells.number(name + SD, place) for name in values}
    return Row(place + 1, keys, values, sds, cells.number(TURNS, place), cells.text(HOLD, place).lower() in YES)


Positive = Annotated[float, Field(gt=0.0)]
Percent = Annotated[float, Field(ge=0.0, le=100.0)]


class SceneTables(Strict):
    """Tables of a scene for doe uncertainty and doe calibrate; all other tables are described by rbdyn keys."""

    uncertain: Uncertain | None = None
    """Unknown inputs of the scene, with laws or documented ranges: doe uncertainty varies them, doe calibrate estimates them."""
    calibrate: Calibrate | None = None
    """Settings of doe calibrate, which estimates the unknown inputs; no run depends on them."""


class Rows(Strict):
    """Columns of RIG.csv next to those named by keys of the scene and by outputs.

    Of each output NAME_sd is the scatter of the single row, and NAME_accuracy_percent the offset that all rows share."""

    turns: Positive | None = None
    """Shaft turns of the measurement. Effect: without a stated standard deviation, the scatter of a simulation of this length
    is used."""
    hold: Literal["1", "yes", "true", "0", "no", "false"] | None = None
    """Whether the row is held out of the calibration to test it: 1 if held out, otherwise 0."""


def _columns(figure: Figure) -> dict[str, Any]:
    """The measured output, its scatter and the accuracy of its sensor."""
    words, heat = quantity(figure.key)[0], figure.kind == "temperature"
    offset = f"standard deviation of one offset of all rows, {figure.accuracy:g} unless stated"
    texts = {
        "": f"Measured {figure.meaning}{', of a scene with [thermal]' if heat else ''}.",
        "_sd": f"Standard deviation of the measured {words}; {'turns do not replace it' if heat else 'or give turns'}.",
        "_accuracy_percent": f"Accuracy of the sensor of the {words}: {offset}.",
    }
    return {
        figure.key + end: ((Percent if "percent" in end else Positive) | None, Field(None, description=text))
        for end, text in texts.items()
    }


_OUTPUTS = {name: column for figure in FIGURES if figure.accuracy for name, column in _columns(figure).items()}
RigTable = create_model("RigTable", __base__=Rows, __module__=__name__, **_OUTPUTS)
