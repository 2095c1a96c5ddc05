"""Fuzz: rig tables, samples and tables without a study are read as they are written, or refused in sentences; nothing is simulated."""

import csv
import io
import random
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mutations import EXTREMES, mutated, outcome

from doe.study_file.study import study_of_table
from doe.workflow.input_sets import read_sample
from doe.workflow.rig import OUTPUTS, Rig, read_rig
from doe.workflow.runs import read_runs
from rbdyn.base.faults import InputError
from rbdyn.scene.uncertain import Law

# What a hand or another program writes for a number.
SLIPS = ["", " ", "nan", "inf", "-1", "0", "-0", "1e400", "-1e-300", "1e13", "1e-13", "5000", "2", "0x10", "1_000", "１２", "3,5", "25O",
         "2024-01-01", "10:30", "true", "False", "yes", "no", "hold", "1.", ".5", "+7", "1e3", "9" * 399, "9" * 401, "9" * 5000, "1e-9",
         "auto", "rigid", "outer", "\0", "a\nb", '"', ";", "\ufeff1", "12 N", "1e", "--1", "4e", "007"]  # fmt: skip
KEYS: dict[str, list[str]] = {
    "operation.inner_speed_rpm": ["12000", "18000.0", "2.4e4", "-9000"], "operation.radial_load_N": ["600", "1300.5", "2000"],
    "bearing.rollers": ["9", "10", "+11"], "model.pocket_film": ["true", "False"], "cage.guidance": ["outer", "inner"],
    "model.pocket_bar_stiffness_N_m": ["rigid", "5e7"], "lubricant.temperature_C": ["70", "99.5"],
}  # fmt: skip
CHOICES = {
    "cage.guidance": ["outer", "inner", "1"],
    "model.pocket_film": [True, False, "x"],
    "bearing.rollers": [9, 10, 11.5],
}


def written(rows: Sequence[Sequence[str]]) -> bytes:
    """Rows as CSV."""
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue().encode("utf-8", "surrogatepass")


def cells(data: bytes) -> tuple[list[str], list[list[str]]]:
    """Header and rows as a CSV reader of one's own has them; lines of blanks and empty columns at the end are none."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("cp1252")
    head = next(line for line in text.splitlines() if line.strip(" ,;\t"))
    # The commas below a single name are decimal ones.
    separator = max(";,\t", key=head.count)
    rows = [[field.strip() for field in row] for row in csv.reader(io.StringIO(text, newline=""), delimiter=separator)]
    rows = [row for row in rows if row == [""] or any(row)]
    rows = rows if any(len(row) > 1 for row in rows) else [row for row in rows[:1] if any(row)] + rows[1:]
    width = max(len("\0".join(row).rstrip("\0").split("\0")) for row in rows)
    rows = [[*row, *[""] * width][:width] for row in rows]
    return rows[0], rows[1:]


def number(text: str) -> float:
    """The number of a cell; no comma here separates thousands."""
    return float(text.replace(",", "."))


def changed(draw: random.Random, rows: list[list[str]]) -> bytes:
    """A table with nothing, some cells, a column's unit, the structure or any bytes changed."""
    kind = draw.randrange(9)
    if kind < 4:
        for _ in range(kind):
            row = draw.randrange(1, len(rows)) if draw.random() < 0.9 else 0
            extreme = draw.choice(EXTREMES).decode("utf-8", "replace")
            rows[row][draw.randrange(len(rows[row]))] = extreme if draw.random() < 0.3 else draw.choice(SLIPS)
    elif kind == 4:
        place = draw.randrange(len(rows[0]))
        again = draw.random() < 0.5
        rows = [[*row, row[place]] if again else row[:place] + row[place + 1 :] for row in rows]
    elif kind == 5:
        data = written(rows)
        return draw.choice(
            [
                b"\xef\xbb\xbf" + data,
                data.replace(b",", b";"),
                data.replace(b"\r\n", b"\n\n"),
                data.replace(b",", b" , "),
            ]
        )
    elif kind == 6:
        place, power = draw.randrange(len(rows[0])), draw.choice((-320, -40, -14, -9, -3, 3, 9, 12, 40, 300))
        rows = [rows[0], *([*row[:place], f"{row[place]}e{power}", *row[place + 1 :]] for row in rows[1:])]
    data = written(rows)
    return mutated(draw, data) if kind > 6 else data


def rig_rows(draw: random.Random) -> list[list[str]]:
    """A rig's table: some keys, outputs, deviations or turns and rows on hold."""
    keys = draw.sample(list(KEYS), draw.randrange(1, 5))
    outputs = draw.sample(OUTPUTS, draw.randrange(1, 4))
    accuracy = [f"{name}_accuracy_percent" for name in outputs if draw.random() < 0.3]
    header = [*keys, *outputs, *(f"{name}_sd" for name in outputs), "turns", "hold", *accuracy]
    rows = [header]
    for _ in range(draw.randrange(3, 9)):
        measured = [f"{draw.lognormvariate(3.0, 2.0):.{draw.randrange(1, 17)}g}" for _ in outputs]
        sds = [draw.choice(["", repr(0.05 * float(value)), "1e-3"]) for value in measured]
        # Only a thermometer has to state its deviation.
        sds = [sd or "1e-3" if name.endswith("_C") else sd for name, sd in zip(outputs, sds, strict=True)]
        turns = draw.choice(["40", "1e3"]) if "" in sds else ""
        rows.append(
            [
                *(draw.choice(KEYS[key]) for key in keys),
                *measured,
                *sds,
                turns,
                draw.choice(["", "0", "no"]),
                *(draw.choice(("", "4")) for _ in accuracy),
            ]
        )
    return rows


def check_rig(data: bytes, rig: Rig) -> None:
    """Every cell is where it belongs, as it is written."""
    header, rows = cells(data)
    assert len(rig.rows) == len(rows)
    for fields, row in zip(rows, rig.rows, strict=True):
        texts = {name: text for name, text in zip(header, fields, strict=True) if text}
        for name, text in texts.items():
            blank = text.lower() == "nan"
            if "." in name:
                check_value(name, text, row.keys[name])
            elif name in OUTPUTS:
                assert (name in row.values and row.values[name] == number(text)) or blank
            elif name.removesuffix("_accuracy_percent") in OUTPUTS:
                stated = rig.accuracies[name.removesuffix("_accuracy_percent")]
                assert blank or stated == pytest.approx(0.01 * number(text), rel=1e-12)
            elif name.removesuffix("_sd") in OUTPUTS:
                assert (row.sds.get(name.removesuffix("_sd")) == number(text)) or blank
            elif name == "turns":
                assert row.turns == number(text) or (blank and row.turns is None)
            else:
                assert name == "hold", f"{name} = {text!r} is ignored"
                assert row.hold == (text.lower() in ("1", "yes", "true"))
        assert set(row.values) == {name for name in texts if name in OUTPUTS and texts[name].lower() != "nan"}


def check_value(name: str, text: str, value: Any) -> None:
    """A value of a key is what a text says."""
    if isinstance(value, bool):
        assert text.lower() == str(value).lower()
    elif isinstance(value, str):
        assert text == value
    else:
        assert number(text) == value
        assert name != "bearing.rollers" or isinstance(value, int) or not value.is_integer()


def read_and_check(
    path: Path, read: Callable[[Path], Any], check: Callable[[bytes, Any], None]
) -> Callable[[Path], Any]:
    """Reads a file with all warnings as errors, and checks what comes of it."""

    def both(_: Path) -> Any:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            result = read(path)
        check(path.read_bytes(), result)
        return result

    return both


def run_cases(
    path: Path, count: int, seed: int, make: Callable[[random.Random], list[list[str]]], read: Callable[[Path], Any], check: Callable[[bytes, Any], None]
) -> None:  # fmt: skip
    """Draw cases; neither what is read nor what is refused is nearly all."""
    draw, ends, start = random.Random(seed), [], time.perf_counter()
    for number in range(count):
        path.write_bytes(changed(draw, make(draw)))
        try:
            ends.append(outcome(read_and_check(path, read, check), path))
        except BaseException as error:
            error.add_note(f"case {number} is left in {path}")
            raise
    print(
        f"{path.name}: {ends.count('read')} read, {ends.count('refused')} refused in {time.perf_counter() - start:.0f} s"
    )
    assert min(ends.count("read"), ends.count("refused")) > count // 10


@pytest.mark.slow
def test_rig_tables_are_read_as_written_or_refused(tmp_path, fuzz_cases):
    """Fuzz: each row's conditions, measurements, deviations, turns and hold are those of its cells."""
    run_cases(tmp_path / "rig.csv", fuzz_cases, 1, rig_rows, read_rig, check_rig)


def careless_rig(draw: random.Random) -> list[list[str]]:
    """A sound rig with whole columns: speed and load, then two or three outputs, each with its deviation, and hold."""
    outputs = draw.sample(
        ("impact_force_N", "power_loss_W", "cage_speed_rpm", "whirl_deviation_ratio"), draw.randrange(2, 4)
    )
    sizes = {"impact_force_N": 60.0, "power_loss_W": 150.5, "cage_speed_rpm": 5000.0, "whirl_deviation_ratio": 0.5}
    columns = [column for name in outputs for column in (name, f"{name}_sd")]
    rows = [["operation.inner_speed_rpm", "operation.radial_load_N", *columns, "hold"]]
    for _ in range(draw.randrange(4, 12)):
        values = [sizes[name] * draw.uniform(0.5, 1.5) for name in outputs]
        cells = [f"{each:.5g}" for value in values for each in (value, value * draw.uniform(0.003, 0.05))]
        rows.append(
            [
                str(draw.randrange(9000, 25000)),
                f"{draw.uniform(300.0, 3000.0):.1f}",
                *cells,
                draw.choice(("", "0", "1", "no")),
            ]
        )
    return rows


def shifted(draw: random.Random, rows: list[list[str]]) -> list[list[str]]:
    """The cells one or more columns beside their names: an index or a blank in front, a column lost, or two exchanged."""
    kind, width = draw.randrange(5), len(rows[0])
    first, second = draw.choice([(0, 2), (1, 3), (2, 3), (4, 5), (3, 4)])
    order = list(range(width))
    order[first], order[second] = order[second], order[first]
    moved = [
        [str(number), *row] if kind == 0 else [str(number), *row[:-1]] if kind == 1 else ["", *row[:-1]] if kind == 2
        else [*row[1:], ""] if kind == 3 else [row[place] for place in order]
        for number, row in enumerate(rows[1:], 1)
    ]  # fmt: skip
    return [rows[0], *moved]


@pytest.mark.slow
def test_careless_rigs_ask_the_same_question_or_get_one_sentence(tmp_path, fuzz_cases):
    """Fuzz: marks, separators and encodings change nothing; shifted columns are refused in one sentence, or are as plausible."""
    draw, path, ends = (
        random.Random(7),
        tmp_path / "rig.csv",
        {"same": 0, "one sentence": 0, "several": 0, "plausible": 0, "too few rows": 0},
    )
    for _ in range(fuzz_cases):
        rows = careless_rig(draw)
        path.write_bytes(written(rows))
        if sum(row[-1] != "1" for row in rows[1:]) < 3:
            assert outcome(read_rig, path) == "refused"
            ends["too few rows"] += 1
            continue
        plain = read_rig(path)
        if draw.random() < 0.5:
            mark, comma = draw.choice(((";", ","), (";", "."), ("\t", ","), ("\t", "."), (",", ".")))
            body = [[cell.replace(".", comma) for cell in row] for row in rows[1:]]
            text = "\r\n".join(mark.join(row) for row in (rows[0], *body)) + "\r\n"
            path.write_bytes(text.encode(draw.choice(("utf-8", "utf-8-sig", "utf-16"))))
            again = read_rig(path)
            assert (again.rows, again.outputs, again.accuracies) == (plain.rows, plain.outputs, plain.accuracies)
            ends["same"] += 1
            continue
        path.write_bytes(written(shifted(draw, rows)))
        try:
            read_rig(path)
            ends["plausible"] += 1
        except InputError as error:
            ends["one sentence" if len(error.faults) == 1 else "several"] += 1
    print(ends)
    assert ends["same"] > fuzz_cases // 4 and ends["one sentence"] > 5 * (ends["plausible"] + ends["several"])


@pytest.mark.slow
def test_samples_are_read_as_written_or_refused(tmp_path, fuzz_cases):
    """Fuzz: each value of a posterior sample is that of its cell, of the law's or the scene's type."""
    laws = {key: Law(law="choices", values=values) for key, values in CHOICES.items()}

    def make(draw: random.Random) -> list[list[str]]:
        keys = draw.sample(list(KEYS), draw.randrange(1, 6))
        return [keys, *([draw.choice(KEYS[key]) for key in keys] for _ in range(draw.randrange(2, 12)))]

    def check(data: bytes, columns: dict[str, list[Any]]) -> None:
        header, rows = cells(data)
        assert list(columns) == [name for name in header if name]
        for place, name in enumerate(header):
            texts = [row[place] for row in rows]
            for text, value in zip(texts, columns[name] if name else texts, strict=True):
                check_value(name, text, value)
                assert name or not text

    run_cases(tmp_path / "posterior.csv", fuzz_cases, 2, make, lambda path: read_sample(path, laws), check)


@pytest.mark.slow
def test_tables_without_a_study_lose_no_column(tmp_path, fuzz_cases):
    """Fuzz: every column is a factor, a response, known by its name or in a note, and its numbers are those of its cells."""
    path = tmp_path / "table.csv"

    def make(draw: random.Random) -> list[list[str]]:
        kinds = {
            "a": "25",
            "b": "-1.5e-3",
            "y": "7",
            "who": "me",
            "date": "2024-01-01",
            "y_error": "0.1",
            "b_error": "2",
            "block": "1",
        }
        names = ["a", *draw.sample(list(kinds)[1:], draw.randrange(1, len(kinds)))]
        random_cells = (
            [f"{draw.gauss(0.0, 9.0):.6g}" if name in "aby" else kinds[name] for name in names]
            for _ in range(draw.randrange(3, 9))
        )
        return [names, *random_cells]

    def read(path: Path) -> Any:
        study, notes = study_of_table(path, ["a"], [], "linear")
        return study.responses, notes, read_runs(study, path)

    def check(data: bytes, result: Any) -> None:
        (responses, notes, runs), (header, rows) = result, cells(data)
        for place, name in enumerate(header):
            texts = [row[place] for row in rows]
            noted = any(
                word in note
                for note in notes
                for word in (f" {name} (", f": {name}", f", {name}", f"column {place + 1}")
            )
            if name == "a" or name in responses:
                values = runs.actual[:, 0] if name == "a" else runs.values[:, responses.index(name)]
                for value, text in zip(values.tolist(), texts, strict=True):
                    gap = name in responses and text.lower() in ("", "nan")
                    assert np.isnan(value) if gap else value == number(text)
            elif name.removesuffix("_error") in responses:
                errors = runs.errors[:, responses.index(name.removesuffix("_error"))].tolist()
                assert all(
                    text.lower() in ("", "nan") or number(text) == error
                    for text, error in zip(texts, errors, strict=True)
                )
            else:
                assert name in ("block", "run", "replicates") or noted or not any(texts), name

    run_cases(path, fuzz_cases, 4, make, read, check)
