"""Properties by name.

- ``materials``: elastic constants, density, expansion
- ``lubricants``: an oil, and jet oils over temperature; ``oils``: grades and data sheets
- ``tolerances``: limits of shafts, housings and rings (ISO 286, ISO 492), and the interference of a ring on its seat
- ``catalogue``: what a designation says of a bearing, and what is inside it

Tables of numbers stand as CSV and TOML in this folder; ``table`` reads the former.
"""

import csv
import functools
from pathlib import Path

FOLDER = Path(__file__).parent


@functools.cache
def table(name: str) -> list[dict[str, str]]:
    """Rows of a table, by column; lines that start with # show its source."""
    lines = (FOLDER / f"{name}.csv").read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(line for line in lines if not line.startswith("#")))
