"""Interference of a bearing of normal tolerances on a shaft and in a housing of ISO 286.

The ring's mean bore or outside diameter lies below its nominal by up to the tolerance of ISO 492, the seat about its own by the
class of ISO 286. Both are taken as normal, centred, six standard deviations wide: the mean interference is that of the middles,
and the deviations add as squares.

Mounting smooths the surfaces: NTN (Ball and Roller Bearings) subtracts 1 to 2.5 um from the interference of a ground shaft,
5 to 7 um from that of a machined one, as a bore of a housing is too. A loose fit is not smoothed.
"""

import math
import re
from typing import NamedTuple

from rbdyn.faults import MethodError
from rbdyn.properties.iso286 import fit_limits
from rbdyn.properties.iso492 import ring_limits

SHAFT = re.compile(r"(g|h|js?|k|m|n|p|r)[4-7]")
HOUSING = re.compile(r"(G|H|JS?|K|M|N|P)[5-8]")
# Middles of what smoothing takes from ground shafts and machined bores [um].
SHAFT_SMOOTHING, HOUSING_SMOOTHING = 1.75, 6.0
# Standard deviations in the width of a tolerance.
WIDTH = 6.0


class Interference(NamedTuple):
    """Diametral interference of a ring on its seat [um], negative is loose: mean, standard deviation and ends.

    ``smoothing``: what smoothing has taken of each of them.
    """

    mean: float
    sd: float
    low: float
    high: float
    smoothing: float


def shaft_interference(bore_mm: float, zone: str) -> Interference:
    """Of an inner ring on a shaft of a class such as "k5". Raises MethodError for a class or size that is not listed."""
    if not SHAFT.fullmatch(zone):
        raise MethodError(
            'is no tolerance class of a shaft such as "k5"; take g, h, j, js, k, m, n, p or r, grade 4 to 7'
        )
    return _interference(fit_limits(bore_mm, zone), ring_limits(bore_mm, "Normal bore"), SHAFT_SMOOTHING)


def housing_interference(outside_mm: float, zone: str) -> Interference:
    """Of an outer ring in a housing of a class such as "H7". Raises MethodError as ``shaft_interference``."""
    if not HOUSING.fullmatch(zone):
        raise MethodError(
            'is no tolerance class of a housing such as "H7"; take G, H, J, JS, K, M, N or P, grade 5 to 8'
        )
    return _interference(ring_limits(outside_mm, "Normal outside"), fit_limits(outside_mm, zone), HOUSING_SMOOTHING)


def _interference(inside: tuple[float, float], around: tuple[float, float], smoothing: float) -> Interference:
    """From lower and upper deviations [mm] of the part inside and of the part around it."""
    low, high = 1e3 * (inside[0] - around[1]), 1e3 * (inside[1] - around[0])
    mean = 0.5 * (low + high)
    sd = 1e3 * math.hypot(inside[1] - inside[0], around[1] - around[0]) / WIDTH
    loss = min(smoothing, max(mean, 0.0))
    return Interference(mean - loss, sd, low - loss, high - loss, loss)
