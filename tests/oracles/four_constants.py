"""Four-constant law of traction, fitted to a curve by least squares."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class FourConstantFit(NamedTuple):
    """(a + b u) exp(-c u) + d with a = -d, and the root mean square by which it misses the curve."""

    a: float  # [-]
    b: float  # [s/m]
    c: float  # [s/m]
    d: float  # [-]
    rms: float  # [-]


def fit_four_constants(slip: NDArray[np.float64], traction: NDArray[np.float64]) -> FourConstantFit:
    """Least-squares fit of (A + B u) exp(-C u) + D with A = -D to traction coefficients at slips [m/s] >= 0.

    B and D are held >= 0, so that the law never drives. For each C both follow from a linear fit; C is the best of a
    dense scan, refined. Where the curve has no peak in the range, only the curve is well determined, not A, C and D.
    """
    slip, traction = np.asarray(slip, float), np.asarray(traction, float)

    def linear(c: float) -> tuple[float, float, float]:
        decay = np.exp(-c * slip)
        basis = np.stack((slip * decay, 1.0 - decay))
        candidates = [np.linalg.lstsq(basis.T, traction, rcond=None)[0]]
        if candidates[0].min() < 0.0:
            single = np.maximum(basis @ traction, 0.0) / np.maximum((basis**2).sum(axis=1), 1e-300)
            candidates = [np.array([single[0], 0.0]), np.array([0.0, single[1]])]
        square, b, d = min((float(np.mean((v @ basis - traction) ** 2)), *map(float, v)) for v in candidates)
        return square, b, d

    scan = np.geomspace(1e-2, 1e3, 300) / slip.max()
    best = int(np.argmin([linear(float(c))[0] for c in scan]))
    low, high = (float(scan[max(best - 1, 0)]), float(scan[min(best + 1, scan.size - 1)]))
    for _ in range(60):  # golden section
        left, right = high - 0.6180339887498949 * (high - low), low + 0.6180339887498949 * (high - low)
        low, high = (low, right) if linear(left)[0] < linear(right)[0] else (left, high)
    c = 0.5 * (low + high)
    square, b, d = linear(c)
    return FourConstantFit(-d, b, c, d, math.sqrt(square))
