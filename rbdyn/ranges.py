"""Lists of numbers as they are typed on a command line."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rbdyn.faults import InputError

# A list that a command line asks for by its count.
MOST_VALUES = 100_000


def numbers(text: str, least: int = 0) -> list[float]:
    """Numbers of ``start:stop:count``, from ``least`` to `MOST_VALUES`, or ``a,b,c``. Raises ValueError."""
    if ":" not in text:
        return [float(value) for value in text.split(",")]
    start, stop, count = text.split(":")
    if not least <= int(count) <= MOST_VALUES:
        raise ValueError(f"count = {count}: not from {least} to {MOST_VALUES}")
    return [float(value) for value in np.linspace(float(start), float(stop), int(count))]


def axis_values(text: str, option: str) -> list[float]:
    """Values of ``start:stop:count`` (evenly spaced) or ``a,b,c``. Raises InputError naming ``option``."""
    mend = "write start:stop:count or values with commas, rising"
    try:
        values = numbers(text)
    except ValueError:
        raise InputError([f"{option} {text}: not a list of numbers; {mend}"]) from None
    if not values or not np.isfinite(values).all() or any(b <= a for a, b in pairwise(values)):
        raise InputError([f"{option} {text}: the values must rise; {mend}"])
    return values
