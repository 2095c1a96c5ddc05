"""Tables of numbers that stand beside this package as CSV."""

import csv
import functools
from pathlib import Path

FOLDER = Path(__file__).parent


@functools.cache
def table(name: str) -> list[dict[str, str]]:
    """Rows of a table, by column; lines that start with # tell its source."""
    lines = (FOLDER / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
