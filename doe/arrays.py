"""Arrays by what they hold, and a number that may be unknown."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]
Whole = NDArray[np.int64]


def or_none(value: float) -> float | None:
    """A number for JSON; None for what is not known."""
    return None if np.isnan(value) else float(value)
