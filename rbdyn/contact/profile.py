"""Roller profiles: how far a roller's surface drops below a cylinder at an axial position [m].

A drop is a positive radial distance [m]; every function takes positions from the roller's middle [m].
"""

import math
from collections.abc import Sequence

import numpy as np

from rbdyn.base.arrays import Array


def slice_centres(slices: int, length: float) -> Array:
    """Axial positions of the slice centres from the roller's middle [m] (Chen et al. 2022, eq 2)."""
    # Whole numbers first: both halves are then equal to the last bit.
    return np.asarray((2.0 * np.arange(1, slices + 1) - 1.0 - slices) / (2.0 * slices) * length)


def logarithmic_relief(position: Array, diameter: float, length: float) -> Array:
    """Reference profile drop of ISO/TS 16281 at axial ``position`` [m], for rollers of l <= 2.5 D and longer.

    P(x) = 0.00035 D ln[1/(1 - (2x/l)^2)]; longer rollers keep a flat middle of l - 2.5 D and 0.0005 D.
    """
    flat = max(length - 2.5 * diameter, 0.0)
    factor = 0.0005 if flat > 0.0 else 0.00035
    inside = np.clip((2.0 * np.abs(position) - flat) / (length - flat), 0.0, None)
    return np.asarray(-factor * diameter * np.log1p(-(inside**2)))


def crowned_relief(position: Array, crown_radius: float) -> Array:
    """Drop of a full crown, an exact circle of ``crown_radius`` [m] that spans the roller: R - sqrt(R^2 - x^2)."""
    # The difference R - sqrt(R^2 - x^2) would lose all digits where the drop is small compared with the radius.
    squared = position**2
    return np.asarray(squared / (crown_radius + np.sqrt(crown_radius**2 - squared)))


def lundberg_relief(position: Array, length: float, design_load: float, equivalent_modulus: float) -> Array:
    """Drop that presses uniformly along the contact at ``design_load`` [N] (Lundberg 1939).

    P(x) = 2Q/(pi l E') ln[1/(1 - (2x/l)^2)] with E' of ``rbdyn.properties.materials.equivalent_modulus`` [Pa]: the surface
    displacement of both half-spaces under a line load Q/l of length l, less that at its middle. It suits one contact of the
    roller and is infinite at the very ends.
    """
    inside = 2.0 * position / length
    factor = 2.0 * design_load / (math.pi * length * equivalent_modulus)
    with np.errstate(divide="ignore"):
        return np.asarray(-factor * np.log1p(-(inside**2)))


def table_relief(position: Array, points: Sequence[tuple[float, float]]) -> Array:
    """Drop by straight lines between measured ``points`` = ((x, drop), ...) [m].

    Points with all x >= 0 describe one half and are mirrored about the middle; between the middle and the first point the mirrored
    table is level. x rises and spans every position.
    """
    x, drop = np.array(points).T
    return np.asarray(np.interp(np.abs(position) if x[0] >= 0.0 else position, x, drop))
