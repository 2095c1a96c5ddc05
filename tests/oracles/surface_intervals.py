"""Intervals of a fitted surface by Student's t, on the scale of the response."""

import numpy as np
from scipy import special

from doe.response_surface import Surface
from doe.response_surface.least_squares import backward, forward, slope


def interval(surface: Surface, coded, level: float = 0.95, extra: float = 0.0):
    """Lower and upper limit of the mean response at coded points (n, k), ``extra`` added to the variance of the fit."""
    middle, error = surface.predict(coded), surface.prediction_standard_error(coded)
    power = 1.0 if surface.transform is None else surface.transform
    half = special.stdtrit(surface.interval_dof, (1 + level) / 2) * np.sqrt((error * slope(middle, power)) ** 2 + extra)
    if surface.transform is None:
        return middle - half, middle + half
    return tuple(backward(forward(middle, power) + sign * half, power) for sign in (-1.0, 1.0))


def new_run_interval(surface: Surface, coded, level: float = 0.95):
    """The same of a single new run."""
    return interval(surface, coded, level, surface.residual_mean_square)
