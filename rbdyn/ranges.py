"""Lists of numbers as they are typed on a command line."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from rbdyn.faults import InputError


def axis_values(text: str, option: str) -> list[float]:
    """Values of ``start:stop:count`` (evenly spaced) or ``a,b,c``. Raises InputError naming ``option``."""
    mend = "write start:stop:count or values with commas, rising"
    try:
        if ":" in text:
            start, stop, count = text.split(":")
            values = [float(value) for value in np.linspace(float(start), float(stop), int(count))]
        else:
            values = [float(value) for value in text.split(",")]
    except ValueError:
        raise InputError([f"{option} {text}: not a list of numbers; {mend}"]) from None
    if not values or not np.isfinite(values).all() or any(b <= a for a, b in pairwise(values)):
        raise InputError([f"{option} {text}: the values must rise; {mend}"])
    return values
