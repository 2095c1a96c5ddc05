"""Tables as CSV that a spreadsheet opens without running anything: text that it would take for a formula has a quote in front.

Source: OWASP, CSV Injection.
"""

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import pandas as pd

# As every program writes it: float() would also take 1_000, nan and the digits of other scripts.
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# What a formula begins with, also behind quotes: these are text of their own.
FORMULA = re.compile(r"'*[=+\-@\t\r\n]")


def quoted_cell(value: Any) -> Any:
    """A cell as it is written: text that is no number and looks like a formula with one quote more in front."""
    formula = isinstance(value, str) and FORMULA.match(value) and not NUMBER.fullmatch(value)
    return f"'{value}" if formula else value


def plain_cell(text: str) -> str:
    """The text of a cell as it was before it was written."""
    return text[1:] if text.startswith("'") and FORMULA.match(text) else text


def save_table(
    table: "pd.DataFrame | Iterable[Mapping[str, Any]]", path: Path | str, float_format: str | None = None
) -> None:
    """Write a table, or its rows by column, as CSV without its index. Raises OSError."""
    import pandas as pd

    frame = table.copy() if isinstance(table, pd.DataFrame) else pd.DataFrame(list(table))
    for name, kind in frame.dtypes.items():
        if not pd.api.types.is_numeric_dtype(kind):
            frame[name] = frame[name].map(quoted_cell)
    frame.rename(columns=quoted_cell).to_csv(path, index=False, float_format=float_format)
