"""Coded and actual units of factors."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def to_actual(coded: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Actual factor values of coded points (..., k); ``centre`` and ``step`` (k,) are in actual units."""
    actual: Array = np.asarray(centre, float) + np.asarray(coded, float) * np.asarray(step, float)
    return actual


def to_coded(actual: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Coded values of actual points (..., k); the inverse of `to_actual`.

    Raises ValueError when a step is zero.
    """
    step = np.asarray(step, float)
    if np.any(step == 0):
        raise ValueError(f"step = {step.tolist()}: every step must differ from zero")
    coded: Array = (np.asarray(actual, float) - np.asarray(centre, float)) / step
    return coded
