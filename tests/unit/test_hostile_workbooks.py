"""Workbooks that no spreadsheet writes are refused in a sentence, within bounds of time and memory; careless ones never misread."""

import gc
import random
import re
import resource
import time
import zipfile
from pathlib import Path

import pytest
from raw_workbook import BOOK, HEADER, MAIN, SHEET, STRINGS, STYLES, book, row, sheet, write

from doe.study_file.table import read_table
from rbdyn.base.faults import InputError
from rbdyn.base.tables import workbook
from rbdyn.base.tables.sheet import read_sheet


def end_of(path: Path | str) -> str:
    """The faults of a table of a, b and y without the path, or "read"."""
    try:
        read_table(Path(path), ["a", "b"], ["y"], Path("S.toml"))
    except InputError as error:
        return "\n".join(error.faults).replace(f"{path}: ", "")
    return "read"


def test_a_sound_raw_workbook_is_read(tmp_path):
    """The helper's own workbook holds two runs."""
    table = read_table(write(tmp_path / "t.xlsx"), ["a", "b"], ["y"], Path("S.toml"))
    assert table.actual.tolist() == [[1.0, 2.5]] * 2 and table.values.tolist() == [[2.5]] * 2


@pytest.mark.parametrize("number", ["-5", "0", "1", "1048577", "999999999999", "x", ""])
def test_a_row_number_that_no_sheet_has_is_refused(tmp_path, number):
    """Below the first, repeated, beyond the last of Excel, no number."""
    shown = end_of(write(tmp_path / "t.xlsx", {SHEET: sheet(row(number))}))
    where = f": row number {number} after 1" if number not in ("-5", "x", "") else ""
    assert shown == f"is a damaged workbook (sheet 'Runs'{where}); open it in Excel and save it again"


@pytest.mark.parametrize("cell", ["B3", "A2", "ZZZZ2", "C-1", "C0"])
def test_a_cell_that_is_not_where_it_says_is_refused(tmp_path, cell):
    """In another row, before the cell to its left, beyond the last column, in no row."""
    cells = '<c r="B2"><v>1</v></c>', f'<c r="{cell}"><v>1</v></c>'
    shown = end_of(write(tmp_path / "t.xlsx", {SHEET: sheet(row(2, *cells))}))
    assert shown.startswith("is a damaged workbook (sheet 'Runs'")
    assert f"cell {cell} in row 2" in shown or cell in ("ZZZZ2", "C-1")


FORMULAS = {
    "array": ('<c r="C2"><f t="array" ref="C2:C2">A2</f></c>', "C2"),
    "array of two": ('<c r="C2"><f t="array" ref="C2:C3">A2:A3</f><v>1</v></c>', "C3"),
    "data table": ('<c r="C2"><f t="dataTable" ref="C2:C3" dt2D="0" dtr="0" r1="A1"/><v>1</v></c>', "C3"),
    "empty value": ('<c r="C2"><f>A2</f><v></v></c>', "C2"),
    "shared": ('<c r="C2"><f t="shared" si="0"/></c>', "C2"),
}


@pytest.mark.parametrize("kind", FORMULAS)
def test_a_formula_without_a_saved_value_is_no_empty_cell(tmp_path, kind):
    """A formula of every kind, and the cells that one formula fills."""
    formula, name = FORMULAS[kind]
    rows = (
        row(2, '<c r="A2"><v>1</v></c><c r="B2"><v>1</v></c>', formula),
        row(3, '<c r="A3"><v>2</v></c><c r="B3"><v>1</v></c>'),
    )
    shown = end_of(write(tmp_path / "t.xlsx", {SHEET: sheet(*rows)}))
    assert shown == f"cell {name} of sheet 'Runs': {workbook.UNCALCULATED}"


def test_values_that_the_writer_left_to_excel_are_not_trusted(tmp_path):
    """A program that writes 0 for every formula asks for a calculation on opening; a saved empty text is a value."""
    formula = '<c r="A2"><v>1</v></c><c r="B2"><v>1</v></c>', '<c r="C2"><f>A2*7</f><v>0</v></c>'
    parts = {SHEET: sheet(row(2, *formula)), BOOK: book(("Runs", "visible"), after='<calcPr fullCalcOnLoad="1"/>')}
    assert "cell C2 of sheet 'Runs': has a formula without" in end_of(write(tmp_path / "t.xlsx", parts))
    parts[BOOK] = book(("Runs", "visible"))
    assert end_of(write(tmp_path / "t.xlsx", parts)) == "read"
    parts[SHEET] = sheet(row(2, formula[0], '<c r="C2"><v>1</v></c>', '<c r="D2" t="str"><f>""</f><v></v></c>'))
    assert end_of(write(tmp_path / "t.xlsx", parts)) == "read"


def test_the_first_visible_sheet_is_read_and_hidden_rows_are_named(tmp_path):
    """A hidden first sheet is read only by its name."""
    other = "xl/worksheets/sheet2.xml"
    hidden = row(4, *(f'<c r="{letter}4"><v>7</v></c>' for letter in "ABC"), keys='hidden="1"')
    parts = {BOOK: book(("Old", "hidden"), ("New", "visible")), other: sheet(row(3), hidden)}
    path = write(tmp_path / "t.xlsx", parts, sheets=2)
    found, old = read_sheet(path), read_sheet(Path(f"{path}:old"))
    assert found.rows[1] == ["7", "7", "7"] and old.rows[1] == ["1", "2.5", "2.5"]
    assert found.notes[0].endswith(
        "with its 1 hidden row, the first visible of 2 (Old, New); t.xlsx:NAME names another"
    )


def test_a_span_of_time_is_no_number_and_asks_for_no_decimal_comma(tmp_path):
    """One and a half days in a cell of hours; a text with a comma between words."""
    cells = [f'<c r="{letter}2"><v>1</v></c>' for letter in "AB"]
    path = write(tmp_path / "t.xlsx", {SHEET: sheet(row(2, *cells, '<c r="C2" s="1"><v>5.5</v></c>'))})
    assert end_of(path) == "y in row 1 (cell C2) = '132:00:00': is a time of day or a span of time; format the cell as a number and write a plain one"  # fmt: skip
    words = '<c r="C2" t="inlineStr"><is><t>1 day, later</t></is></c>'
    assert "write a plain one" in end_of(write(tmp_path / "t.xlsx", {SHEET: sheet(row(2, *cells, words))}))


def test_a_date_in_an_east_asian_format_is_no_number(tmp_path):
    """These formats have numbers and no code in a file."""
    styles = f'<styleSheet xmlns="{MAIN}"><cellXfs><xf numFmtId="0"/><xf numFmtId="31"/></cellXfs></styleSheet>'
    cells = [f'<c r="{letter}2"><v>1</v></c>' for letter in "AB"]
    parts = {STYLES: styles, SHEET: sheet(row(2, *cells, '<c r="C2" s="1"><v>45000</v></c>'))}
    assert "y in row 1 (cell C2) = '2023-03-15': is a date" in end_of(write(tmp_path / "t.xlsx", parts))


def cells_of(count: int) -> str:
    """A row of that many numbers."""
    return f'<row r="2">{"<c><v>1</v></c>" * count}</row>'


# Entities, each twenty times the one before.
LAUGHS = "".join(f'<!ENTITY a{n} "{20 * f"&a{n - 1};"}">' for n in range(1, 9))
LAUGHING = f'<!DOCTYPE x [<!ENTITY a0 "1">{LAUGHS}]>' + sheet('<row r="2"><c r="A2"><v>&a8;</v></c></row>')
HOSTILE = {
    "comment": ({SHEET: sheet(row(2), before=f"<!--{'x' * 60_000_000}-->")}, f"part {SHEET} unpacks to 60 MB"),
    "shorter comment": ({SHEET: sheet(row(2), before=f"<!--{'x' * 45_000_000}-->")}, f"part {SHEET} unpacks to 45 MB"),
    "styles": ({STYLES: f"<styleSheet xmlns='{MAIN}'><cellXfs>{'<xf/>' * 2_000_000}</cellXfs></styleSheet>"}, "unpacks to 10 MB"),
    "texts": ({STRINGS: f"<sst xmlns='{MAIN}'>{'<si/>' * 3_000_000}</sst>"}, "unpacks to 15 MB"),
    "wide": ({SHEET: sheet(cells_of(17_000))}, "has more than 16384 columns"),
    "wide and long": ({SHEET: sheet(cells_of(16_000), *(row(n) for n in range(3, 100)))}, "has more than 1000000 cells"),
    "long cell": ({SHEET: sheet(f'<row r="2"><c r="A2" t="str"><v>{"1" * 40_000}</v></c></row>')}, "more than 32767 characters"),
    "deep": ({SHEET: sheet(row(2), "<a>" * 3_000_000, "</a>" * 3_000_000)}, f"part {SHEET} unpacks to"),
    "entities": ({SHEET: LAUGHING}, "is a damaged workbook ("),
    "parts": ({f"part{n}": "" for n in range(10_001)}, "has more than 10000 parts"),
}  # fmt: skip


@pytest.mark.parametrize("kind", HOSTILE)
def test_a_hostile_workbook_is_refused_in_seconds(tmp_path, kind):
    """Each bound of the reader, with the processor time and the memory of its refusal."""
    parts, words = HOSTILE[kind]
    path = write(tmp_path / "t.xlsx", parts)
    before, started = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.thread_time()
    assert words in end_of(path)
    assert time.thread_time() - started < 10.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300_000


def test_rows_have_a_bound_too(tmp_path, monkeypatch):
    """The same bound, made small."""
    path = write(tmp_path / "t.xlsx", {SHEET: sheet(*(row(n) for n in range(2, 5000)))})
    monkeypatch.setattr(workbook, "MOST_ROWS", 1000)
    assert "has more than 1000 rows" in end_of(path)


def odd_workbook(draw: random.Random) -> dict[str, str]:
    """Parts of a workbook with up to four odd cells, rows, formats, texts or tags in a random place."""
    rows = [
        [f'<c r="{letter}{n}"><v>{draw.choice((n, n / 8, -n, 1e9))}</v></c>' for letter in "ABC"] for n in range(2, 7)
    ]
    keys = [f'r="{n}"' for n in range(2, 7)]
    for _ in range(draw.randint(0, 4)):
        r, c = draw.randrange(5), draw.randrange(3)
        place = f"{'ABC'[c]}{r + 2}"
        value = draw.choice(
            [
                "",
                "1",
                "nan",
                "1e999",
                "-1,5",
                "0,5 mm",
                "1.234",
                "9" * 30,
                "x" * draw.choice((3, 40_000)),
                "=A1",
                "#N/A",
            ]
        )
        kind = draw.choice(["n", "s", "str", "b", "e", "d", "inlineStr", "q"])
        shared = draw.choice(
            ["", "<f>A1</f>", '<f t="array" ref="A1:C9"/>', '<f t="dataTable" ref="B2:XFD1048576"/>', '<f t="shared"/>']
        )
        rows[r][c] = draw.choice([
            f'<c r="{place}" t="{kind}">{shared}<v>{value}</v></c>',
            f'<c r="{place}" s="{draw.choice((0, 1, 2, -1, 99999999999))}"><v>{draw.choice((0, 1.5, -3, 45000, 1e15))}</v></c>',
            f'<c r="{place}" t="inlineStr"><is><t>{value}</t><rPh><t>{value}</t></rPh></is></c>',
            f'<c r="{draw.choice(("A1", "XFE2", place, "", "b2", "A99999999"))}"><v>1</v></c>', "", f"<a><b>{value}</b></a>",
        ])  # fmt: skip
        if draw.random() < 0.2:
            keys[r] = draw.choice(['r="-5"', 'r="0"', 'r="1048576"', 'r="99999999999"', "", f'r="{r + 2}" hidden="1"'])
    text = sheet(*(f"<row {key}>{''.join(cells)}</row>" for key, cells in zip(keys, rows, strict=True)))
    parts = {SHEET: text.replace(HEADER, draw.choice([HEADER] * 9 + ["", HEADER + HEADER]))}
    if draw.random() < 0.3:
        name = draw.choice([SHEET, STYLES, STRINGS, BOOK, "xl/_rels/workbook.xml.rels", "_rels/.rels"])
        parts[name] = draw.choice(
            ["", "<x/>", "<a" * 99, text, '<?xml version="1.0" encoding="utf-7"?><x/>', book(("A", "hidden")), "\0"]
        )
    return parts


@pytest.mark.slow
def test_fuzz_odd_workbooks_give_their_numbers_or_a_sentence(tmp_path, request):
    """Fuzz: 1000 workbooks of odd parts; each is read with the numbers that stand in it, or refused, within a second."""
    draw, ends = random.Random(1), {"read": 0, "refused": 0}
    # To collect what other tests left takes more than a second by itself.
    request.addfinalizer(gc.unfreeze)
    gc.freeze()
    for number in range(1000):
        path = write(tmp_path / "t.xlsx", odd_workbook(draw))
        started = time.thread_time()
        try:
            table = read_table(path, ["a", "b"], ["y"], Path("S.toml"))
        except InputError as error:
            assert all(fault.startswith((f"{path}", "and ")) and len(fault) < 1500 for fault in error.faults), number
            ends["refused"] += 1
        else:
            with zipfile.ZipFile(path) as archive:
                text = archive.read(SHEET).decode()
            there = {float(form.replace(",", ".")) for form in re.findall(r">([-+]?[0-9.,]+(?:e[-+]?[0-9]+)?)<", text)}
            assert set(table.actual.ravel().tolist()) <= there, number
            ends["read"] += 1
        assert time.thread_time() - started < 1.0
    assert min(ends.values()) > 100, ends
