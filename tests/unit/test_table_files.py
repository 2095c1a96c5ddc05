"""Tables as spreadsheets of several countries write them: the same numbers, or a sentence; never other numbers."""

import csv
import datetime
import io
import json
import math
import random
import zipfile
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest
from conftest import ROOT
from doe_command import doe
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.special import stdtrit
from short_studies import paper_study

from doe.study_file.table import RUN, read_table
from doe.workflow.runs import read_runs
from doe.workflow.surfaces import drawn_responses, fit_surfaces, residual_correlation
from rbdyn.base.faults import InputError
from rbdyn.base.tables.sheet import read_sheet

TABLE = ROOT / "examples" / "ccd_table4.csv"
STUDY = ROOT / "examples" / "clearance_study.toml"
NAMES = ["a", "Kräfte", "y"]
GROUPS = ["", ".", ",", "'", "\u00a0", "\u202f"]


def numeral(value: float, form: str, decimal: str, group: str) -> str:
    """A number as a program writes it with these marks."""
    text = repr(value) if form == "repr" else format(value, form)
    whole, point, rest = text.partition(".")
    sign, digits = ("-", whole[1:]) if whole.startswith("-") else ("", whole)
    if group and digits.isdigit() and "e" not in text:
        head = len(digits) % 3 or 3
        digits = group.join([digits[:head], *(digits[at : at + 3] for at in range(head, len(digits), 3))])
    return sign + digits + (decimal + rest if point else "")


@st.composite
def tables(draw) -> tuple[bytes, list[list[float]]]:
    """Bytes of a table of numbers and words, and its numbers."""
    separator, decimal = draw(st.sampled_from(",;\t")), draw(st.sampled_from(".,"))
    # A point between commas is a decimal point, as every program writes it.
    group = draw(st.sampled_from([mark for mark in GROUPS if mark != decimal and (mark, separator) != (".", ",")]))
    forms = draw(st.lists(st.sampled_from(["repr", ".0f", ".1f", ".3f", ".4g", ".2e"]), min_size=3, max_size=3))
    values = st.floats(-1e7, 1e7).map(lambda value: round(value, 4)) | st.integers(-99999, 99999).map(float)
    numbers = draw(st.lists(st.lists(values, min_size=3, max_size=3), min_size=1, max_size=6))
    texts = [[numeral(value, form, decimal, group) for value, form in zip(row, forms, strict=True)] for row in numbers]
    plain = [[float(format(value, form) if form != "repr" else value) for value, form in zip(row, forms, strict=True)] for row in numbers]  # fmt: skip
    empty = draw(st.integers(0, 2))
    quoting = draw(st.sampled_from([csv.QUOTE_MINIMAL, csv.QUOTE_ALL]))
    file = io.StringIO(newline="")
    writer = csv.writer(
        file, delimiter=separator, quoting=quoting, lineterminator=draw(st.sampled_from(["\r\n", "\n"]))
    )
    writer.writerow([*NAMES, "Wer, wo; was", *[""] * empty])
    writer.writerows([*row, draw(st.sampled_from(["Müller", "n/a", "x, y", "Tag 3"])), *[""] * empty] for row in texts)
    writer.writerows([[""] * (4 + empty)] * draw(st.integers(0, 2)))
    encoding = draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "cp1252"]))
    text = file.getvalue()
    return text.encode(encoding if group != "\u202f" or encoding != "cp1252" else "utf-8"), plain


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(table=tables())
def test_fuzz_any_table_gives_its_numbers_or_a_sentence(tmp_path, table):
    """Fuzz: separator, decimal mark, thousands, encoding, quotes and empty cells at the ends, in any combination."""
    data, numbers = table
    path = tmp_path / "t.csv"
    path.write_bytes(data)
    sheet = read_sheet(path)
    for place, name in enumerate(NAMES):
        values, faults = sheet.column(name).numbers(RUN)
        assert len(values) == len(numbers)
        for row, value in enumerate(values.tolist()):
            assert value == numbers[row][place] or (math.isnan(value) and faults)
        assert all(fault.startswith(f"{path}: {name} in row ") for fault in faults)


def workbook(path: Path, rows: list[list[object]], title: str = "Tabelle1") -> Path:
    """A workbook of one sheet."""
    book = openpyxl.Workbook()
    book.active.title = title
    for row in rows:
        book.active.append(row)
    book.save(path)
    return path


def fault_of(path: Path) -> str:
    """The one sentence by which a table of a, b and y is refused."""
    with pytest.raises(InputError) as refused:
        read_table(path, ["a", "b"], ["y"], Path("S.toml"))
    (fault,) = refused.value.faults
    assert fault.startswith(f"{path}: ")
    return fault


def written_abroad(folder: Path) -> dict[str, str]:
    """The example table as German Excel writes it, as a workbook, and with numbers as text in a second sheet.

    Paths with the manner in which each is read.
    """
    texts = pd.read_csv(TABLE, dtype=str)
    german = texts.map(lambda text: text.replace(".", ","))
    with_umlauts = german.assign(Kräfte="nach Maß")
    with_umlauts.to_csv(folder / "t.csv", sep=";", index=False, encoding="cp1252", lineterminator="\r\n")
    pd.read_csv(TABLE).to_excel(folder / "t.xlsx", index=False)
    with pd.ExcelWriter(folder / "words.xlsx") as writer:
        pd.DataFrame({"Notiz": ["x"]}).to_excel(writer, sheet_name="Deckblatt", index=False)
        german.to_excel(writer, sheet_name="Läufe", index=False)
    return {
        "t.csv": "read with semicolons and decimal commas in Windows-1252",
        "t.xlsx": "read from sheet 'Sheet1'",
        "words.xlsx:läufe": "read with decimal commas from sheet 'Läufe'",
    }


def test_the_example_as_german_excel_writes_it_has_the_same_numbers_bit_for_bit(tmp_path):
    """Semicolons, decimal commas, Windows-1252 with an umlaut; a workbook; one whose numbers are text."""
    names = pd.read_csv(TABLE).columns[1:].tolist()
    expected = read_table(TABLE, names[:3], names[3:], STUDY)
    for name, manner in written_abroad(tmp_path).items():
        table = read_table(tmp_path / name, names[:3], names[3:], STUDY)
        assert table.notes == (f"{tmp_path / name}: {manner}",)
        assert (table.actual == expected.actual).all() and (table.values == expected.values).all()
    with pytest.raises(InputError) as refused:
        read_table(tmp_path / "words.xlsx", names[:3], names[3:], STUDY)
    assert refused.value.faults[-1].endswith(
        "from sheet 'Deckblatt', the first of 2 (Deckblatt, Läufe); words.xlsx:NAME names another"
    )


def test_cells_of_a_workbook_are_named_in_its_own_way(tmp_path):
    """A date made of 1.2, a formula that was never computed, its fault, a unit, and a doubtful text."""
    cases = {
        "is a date, which Excel makes of numbers such as 1.2": datetime.datetime(2026, 2, 1),
        "is the fault of a formula; correct it": "#DIV/0!",
        "is not a finite number; write a plain one": "12 N",
        "may mean 1234 or 1.234; write 1234 or 1.2340": "1.234",
    }
    for words, cell in cases.items():
        path = workbook(tmp_path / "t.xlsx", [["a", "b", "y"], [1, 2, 3], [], [1.5, 2, cell]])
        fault = fault_of(path)
        assert f"y in row 2 (cell C4) = {'1.234' if cell == '1.234' else ''}" in fault and words in fault
    path = workbook(tmp_path / "t.xlsx", [["a", "b", "y"], [1, 2, "=A2*2"], [1.5, 2, 4]])
    assert "cell C2 of sheet 'Tabelle1': has a formula without a saved value" in fault_of(path)


def test_numbers_of_a_workbook_are_never_in_doubt(tmp_path):
    """1.234 stored as a number is 1.234, all digits count, and text next to it is read by its own marks."""
    whole = workbook(tmp_path / "whole.xlsx", [["a", "b", "y", None], [1.234, "0,5", 1234], [2, "1.234,5", 0.3]])
    path = tmp_path / "t.xlsx"
    with zipfile.ZipFile(whole) as archive, zipfile.ZipFile(path, "w") as copy:
        for name in archive.namelist():
            # Excel itself writes all digits, the library sixteen.
            copy.writestr(name, archive.read(name).replace(b"<v>0.3</v>", b"<v>0.30000000000000004</v>"))
    table = read_table(path, ["a", "b"], ["y"], Path("S.toml"))
    assert table.actual.tolist() == [[1.234, 0.5], [2.0, 1234.5]]
    assert table.values.tolist() == [[1234.0], [0.1 + 0.2]]
    assert table.notes == (f"{path}: read with decimal commas and points between thousands from sheet 'Tabelle1'",)


def test_what_is_no_workbook_is_refused_in_one_sentence(tmp_path):
    """A renamed text, an old or encrypted workbook, other archives, and a workbook under a wrong name."""
    path = tmp_path / "t.xlsx"
    path.write_text("a,b,y\n1,2,3\n")
    assert "is not an Excel workbook; give a table of text a name that ends in .csv" in fault_of(path)
    path.write_bytes(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(600))
    assert "is an encrypted or an old workbook (.xls); save it as .xlsx without a password" in fault_of(path)
    old = tmp_path / "t.xls"
    old.write_bytes(path.read_bytes())
    assert "save it as .xlsx or as CSV" in fault_of(old)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("content.xml", "<x/>")
    assert "is a damaged workbook (its parts); open it in Excel and save it again" in fault_of(path)
    path.write_bytes(b"")
    assert "is not an Excel workbook" in fault_of(path)
    assert "is empty; write a header" in fault_of(workbook(tmp_path / "empty.xlsx", []))
    assert "has a header and no rows" in fault_of(workbook(tmp_path / "names.xlsx", [["a", "b", "y"]]))
    whole = workbook(tmp_path / "whole.xlsx", [["a", "b", "y"], [1, 2, 3]])
    (tmp_path / "whole.csv").write_bytes(whole.read_bytes())
    assert "is not a text table; save it as .xlsx or as CSV" in fault_of(tmp_path / "whole.csv")
    with pytest.raises(InputError, match="has no sheet 'Runs'; name one of Tabelle1"):
        read_sheet(Path(f"{whole}:Runs"))
    assert "no such file" in fault_of(tmp_path / "none.xlsx")


def test_fuzz_damaged_workbooks_give_their_numbers_or_a_sentence(tmp_path):
    """Fuzz: bytes of a workbook changed, left out or doubled, and parts of its XML changed."""
    draw, ends = random.Random(1), {"read": 0, "refused": 0}
    whole = workbook(tmp_path / "whole.xlsx", [["a", "b", "y"], [1, 2, 3.25], [4, 5, 6.5]])
    with zipfile.ZipFile(whole) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    path = tmp_path / "t.xlsx"
    for number in range(120):
        if number % 2:
            path.write_bytes(damaged(draw, whole.read_bytes()))
        else:
            changed = draw.choice(sorted(parts))
            with zipfile.ZipFile(path, "w") as archive:
                for name, data in parts.items():
                    archive.writestr(name, damaged(draw, data) if name == changed else data)
        try:
            read_table(path, ["a", "b"], ["y"], Path("S.toml"))
            ends["read"] += 1
        except InputError as error:
            assert all(fault.startswith(f"{path}: ") for fault in error.faults)
            ends["refused"] += 1
    assert min(ends.values()) > 5


def damaged(draw: random.Random, data: bytes) -> bytes:
    """Bytes with some changed, left out or doubled."""
    at, length = draw.randrange(len(data)), draw.choice((1, 1, 4, 40))
    new = draw.choice((b"", bytes(draw.randrange(256) for _ in range(length)), 2 * data[at : at + length]))
    return data[:at] + new + data[at + length :]


def test_draws_of_surfaces_on_different_rows_pair_the_errors_of_common_runs(tmp_path):
    """With all rows the draws are those of before; a gap changes its own response, and correlations use common rows."""
    study = paper_study()
    table = pd.read_csv(TABLE)
    table.to_csv(tmp_path / "whole.csv", index=False)
    table.loc[4, "power_loss_W"] = None
    table.to_csv(tmp_path / "gap.csv", index=False)
    whole, gap = (fit_surfaces(study, read_runs(study, tmp_path / name)) for name in ("whole.csv", "gap.csv"))
    residuals = np.array([[run.residual for run in surface.diagnostics.runs] for surface in gap[:2]])
    assert residual_correlation(gap)[0, 1] == pytest.approx(np.corrcoef(residuals)[0, 1], abs=0.02)
    other = np.insert([run.residual for run in gap[2].diagnostics.runs], 4, 0.0)
    sizes = np.linalg.norm(residuals[0]) * np.linalg.norm(other)
    assert residual_correlation(gap)[0, 2] == pytest.approx(residuals[0] @ other / sizes)
    draws = [
        np.concatenate(list(drawn_responses(surfaces, np.zeros((1, 3)), 400, 1)))[:, 0] for surfaces in (whole, gap)
    ]
    assert np.allclose(draws[0].mean(axis=0), draws[1].mean(axis=0), rtol=0.02)
    # Half of the draws lie within the quartiles of Student's distribution.
    quartiles = [
        surface.prediction_standard_error(np.zeros(3)) * stdtrit(surface.interval_dof, 0.75) for surface in gap
    ]
    reach = np.subtract(*np.quantile(draws[1], [0.75, 0.25], axis=0)) / 2.0
    assert reach == pytest.approx(quartiles, rel=0.25)
    assert np.corrcoef(draws[1].T)[0, 1] == pytest.approx(residual_correlation(gap)[0, 1], abs=0.15)


@pytest.mark.slow
def test_a_front_stands_on_all_rows_that_each_response_has(tmp_path):
    """The front of a table with a gap is near that of the whole table, and a note names row and response."""
    table = pd.read_csv(TABLE)
    table.loc[4, "power_loss_W"] = None
    table.to_csv(tmp_path / "t.csv", sep=";", decimal=",", index=False)
    shown = doe("front", STUDY, "--data", tmp_path / "t.csv", "--json")
    record = json.loads(shown.stdout)
    assert [note["text"] for note in record["notes"]] == [
        f"{tmp_path / 't.csv'}: read with semicolons and decimal commas",
        f"{tmp_path / 't.csv'}: power_loss_W has no value in row 5; it does without that row, which serves the others",
        f"{tmp_path / 't.csv'} has no column of pocket_impact_power_W, which is left out",
    ]
    assert record["front"]
    table["power_loss_W"] = ""
    table.to_csv(tmp_path / "t.csv", index=False)
    refused = doe("front", STUDY, "--data", tmp_path / "t.csv", "--json")
    assert (
        refused.returncode == 2 and "power_loss_W in row 1 = '': is not a finite number; fill it in" in refused.stderr
    )
