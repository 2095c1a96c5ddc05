"""Coded and actual units of factors."""

import numpy as np
from numpy.typing import ArrayLike

from doe.arrays import Array


def to_actual(coded: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Actual factor values of coded points (..., k); ``centre`` and ``step`` (k,) are in actual units."""
    return np.asarray(centre, float) + np.asarray(coded, float) * np.asarray(step, float)


def to_coded(actual: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Coded values of actual points (..., k); the inverse of `to_actual`.

    Raises ValueError when a step is zero.
    """
    step = np.asarray(step, float)
    if np.any(step == 0):
        raise ValueError(f"step = {step.tolist()}: every step must differ from zero")
    return (np.asarray(actual, float) - np.asarray(centre, float)) / step
