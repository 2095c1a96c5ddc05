"""One declaration of columns gives block, records, frame, file and the manual's rows."""

from pathlib import Path

import pandas as pd

from rbdyn.base.blocks import Column, Sheet, columns_of
from rbdyn.base.records import Record, shown
from rbdyn.base.words import value_alone


class Row(Record):
    """A row with an error, a share, a figure of files and one of no table."""

    name: str = shown("part", meaning="name of the part")
    force_N: float = shown("force [N]", error="force_error", meaning="mean and its half-width")  # noqa: N815
    force_error: float
    slip: float | None = shown("slip", ".1f %", meaning="cage slip", missing="none")
    tries: dict[str, float] = shown("", screen=False, files=False)


COLUMNS = (
    *columns_of(Row),
    *Column[Row]("{}_tries", at=("tries", "{}"), words="tries, {}", meaning="tries").of(("first", "second")),
)
ROWS = (Row("a", 12.3456, 0.12, 0.25, {"first": 1.5}), Row("b", 7.0, 0.0, None, {}))
SHEET = Sheet("Parts", COLUMNS, ROWS, file="parts.csv", content="A row a part.")


def test_screen_writes_values_with_errors() -> None:
    block = SHEET.block
    assert block.header == ["part", "force [N]", "slip", "tries, first", "tries, second"]
    assert block.rows == [["a", "12.35 ± 0.12", "25.0 %", "1.5", ""], ["b", "7", "none", "", ""]]


def test_files_have_every_value_in_the_order_of_the_columns(tmp_path: Path) -> None:
    assert SHEET.records[0] == {
        "name": "a", "force_N": 12.3456, "force_error": 0.12, "slip": 0.25, "first_tries": 1.5, "second_tries": None,
    }  # fmt: skip
    assert SHEET.save(tmp_path) == "parts.csv"
    assert list(pd.read_csv(tmp_path / "parts.csv").columns) == SHEET.keys
    assert list(Sheet("Parts", COLUMNS).frame.columns) == SHEET.keys


def test_error_without_a_column_follows_its_value() -> None:
    sheet = Sheet("", (Column("x", value_alone, error="x_error"), Column("y")), [{"x": 1.234, "x_error": 0.1}])
    assert sheet.records == [{"x": 1.234, "x_error": 0.1, "y": None}]
    assert sheet.block.rows == [["1.23", ""]]


def test_manual_joins_columns_that_share_a_meaning() -> None:
    assert SHEET.manual.splitlines() == [
        "### parts.csv",
        "",
        "A row a part.",
        "",
        "| column | unit | meaning |",
        "|---|---|---|",
        "| `name` |  | name of the part |",
        "| `force_N`, `force_error` | N | mean and its half-width |",
        "| `slip` |  | cage slip |",
        "| `first_tries`, `second_tries` |  | tries |",
    ]
