"""Lists of numbers as they are typed on a command line."""

from itertools import pairwise

import numpy as np

from rbdyn.base.faults import InputError

# Each value of an axis is a point that is run and kept whole.
MOST_VALUES = 10_000


def axis_values(text: str, option: str) -> list[float]:
    """Values of ``start:stop:count`` (evenly spaced) or ``a,b,c``. Raises InputError naming ``option``."""
    fix = "write start:stop:count or values with commas, rising"
    values = listed(text, f"{option} {text}", fix, 0, MOST_VALUES)
    if not values or not np.isfinite(values).all() or any(b <= a for a, b in pairwise(values)):
        raise InputError([f"{option} {text}: the values must rise; {fix}"])
    return values


def listed(text: str, named: str, fix: str, fewest: int, most: int) -> list[float]:
    """The same in any order, from ``fewest`` to ``most`` where they are counted. Raises InputError, nothing made yet."""
    try:
        if ":" not in text:
            return [float(value) for value in text.split(",")]
        start, stop, count = text.split(":")
        if int(count) > most:
            raise InputError([f"{named}: {count} values are more than the {most} that memory has room for; take fewer"])
        if int(count) >= fewest:
            return [float(value) for value in np.linspace(float(start), float(stop), int(count))]
    except ValueError:
        pass
    raise InputError([f"{named}: not a list of numbers; {fix}"])
