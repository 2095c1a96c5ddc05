"""Properties of materials, oils, tolerances and catalogue bearings by name.

- ``materials``: elastic constants, density and expansion of solids; jet oils over temperature
- ``oils``: grades and data sheets
- ``tolerances``: limits of shafts, housings and rings (ISO 286, ISO 492), and the interference of a ring on its seat
- ``catalogue``: designations, boundary dimensions, and the estimated interior of a bearing
- ``drawing``: what a drawing of one's own leaves open; ``rexs``: bearings of gearbox programs

Tables of numbers are CSV and TOML files in this folder; ``table`` reads the CSV files.
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
