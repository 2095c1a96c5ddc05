"""Basic rating life of a single row of balls from its loads by ISO 281: X and Y of its table 3, P, and L10.

The factors are table 3 as it is commonly restated, not taken from the standard's text.
Lengths in m, angles in rad.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

LIFE_EXPONENT = 3.0
# Table 3, single row. Relative axial load F_a/(Z D^2) [MPa]; it times 1/cos(alpha) is f_0 F_a/C_0.
RELATIVE_AXIAL = (0.172, 0.345, 0.689, 1.03, 1.38, 2.07, 3.45, 5.17, 6.89)
_Row = tuple[float, ...]
_RADIAL: tuple[float, _Row, _Row] = (
    0.56,
    (2.3, 1.99, 1.71, 1.55, 1.45, 1.31, 1.15, 1.04, 1.0),
    (0.19, 0.22, 0.26, 0.28, 0.3, 0.34, 0.38, 0.42, 0.44),
)
# Contact angle [deg]: X, Y, e. From 20 degrees on the axial load no longer matters.
FACTORS: dict[float, tuple[float, _Row, _Row]] = {
    0.0: _RADIAL,
    5.0: _RADIAL,
    10.0: (
        0.46,
        (1.88, 1.71, 1.52, 1.41, 1.34, 1.23, 1.1, 1.01, 1.0),
        (0.29, 0.32, 0.36, 0.38, 0.4, 0.44, 0.49, 0.54, 0.54),
    ),
    15.0: (
        0.44,
        (1.47, 1.4, 1.3, 1.23, 1.19, 1.12, 1.02, 1.0, 1.0),
        (0.38, 0.4, 0.43, 0.46, 0.47, 0.5, 0.55, 0.56, 0.56),
    ),
    20.0: (0.43, (1.0,) * 9, (0.57,) * 9),
    25.0: (0.41, (0.87,) * 9, (0.68,) * 9),
    30.0: (0.39, (0.76,) * 9, (0.80,) * 9),
    35.0: (0.37, (0.66,) * 9, (0.95,) * 9),
    40.0: (0.35, (0.57,) * 9, (1.14,) * 9),
    45.0: (0.33, (0.50,) * 9, (1.34,) * 9),
}


class LoadFactors(NamedTuple):
    """P = X F_r + Y F_a where F_a > e F_r, else P = F_r."""

    radial: float  # X
    axial: float  # Y
    threshold: float  # e


def load_factors(contact_angle: float, axial_load: float, balls: int, ball_diameter: float) -> LoadFactors:
    """X, Y and e of a single row (ISO 281, table 3), interpolated over angle and relative axial load.

    Deep groove bearings have contact angle 0 here. Beyond its ends the table's last column is held. Raises ValueError
    for angles outside 0 to 45 degrees.
    """
    degrees = math.degrees(contact_angle)
    angles = list(FACTORS)
    if not angles[0] <= degrees <= angles[-1] + 1e-9:
        raise ValueError(f"contact angle {degrees:g} deg: ISO 281 gives load factors from 0 to 45 deg")
    relative = abs(axial_load) / (balls * (ball_diameter * 1e3) ** 2)

    def over_angle(values: list[float]) -> float:
        return float(np.interp(degrees, angles, values))

    rows = list(FACTORS.values())
    return LoadFactors(
        radial=over_angle([row[0] for row in rows]),
        axial=over_angle([float(np.interp(relative, RELATIVE_AXIAL, row[1])) for row in rows]),
        threshold=over_angle([float(np.interp(relative, RELATIVE_AXIAL, row[2])) for row in rows]),
    )


def equivalent_load(radial_load: float, axial_load: float, factors: LoadFactors) -> float:
    """Dynamic equivalent radial load P [N] of a single row: X F_r + Y F_a, or F_r where F_a <= e F_r."""
    radial, axial = abs(radial_load), abs(axial_load)
    return radial if axial <= factors.threshold * radial else factors.radial * radial + factors.axial * axial


def basic_life(capacity: float, load: float) -> float:
    """Basic rating life L10 = (C/P)^3 in 1e6 turns by ISO 281; infinite without a load."""
    return (capacity / load) ** LIFE_EXPONENT if load > 0.0 else math.inf
