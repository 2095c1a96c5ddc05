"""Least and greatest closing link: worst case over the limits of the parts, and root sum square.

Where the chain is linear both are sums. Otherwise the worst case is looked for at every corner of the limits and at
points between them; the best point is polished where it is no corner. The root sum square then takes the local
sensitivities at mid-tolerance.
"""

from collections.abc import Sequence
from itertools import product
from math import sqrt

import numpy as np

from doe.arrays import Array
from doe.dimension_chain.closing import ClosingFunction, middle
from doe.dimension_chain.links import DIGITS, Interval, Mode, Part

CORNERS = 12  # functions of more parts are looked at in as many random corners as those have
BETWEEN = 512  # points between the corners


def interval(function: ClosingFunction, parts: Sequence[Part], mode: Mode) -> Interval:
    """Least and greatest closing link, mm: by root sum square about mid-tolerance in mode "rss", else worst case."""
    return linear_interval(function, parts, mode) if mode == "rss" or function.linear else _searched(function, parts)


def linear_interval(function: ClosingFunction, parts: Sequence[Part], mode: Mode) -> Interval:
    """The same with the closing link made linear at mid-tolerance; exact for a linear chain."""
    sizes = middle(parts)
    centre, slopes = float(function.value(sizes)), function.sensitivities(sizes)
    half = total([abs(slopes[part.name]) * part.tolerance_mm for part in parts], mode) / 2
    return round(centre - half, DIGITS), round(centre + half, DIGITS)


def total(tolerances: Sequence[float], mode: Mode) -> float:
    """Sum of tolerances, or the root of the sum of their squares in mode "rss"."""
    return sqrt(sum(t * t for t in tolerances)) if mode == "rss" else sum(tolerances)


def _searched(function: ClosingFunction, parts: Sequence[Part]) -> Interval:
    """Worst case with the parts that functions use searched and the others at the limit that their sign asks for."""
    bent = [part for part in parts if part.name in function.arguments]
    straight = [part for part in parts if part.name not in function.arguments]
    ends = []
    for sign in (1, -1):
        rest = 0.0
        for part in straight:
            coefficient = function.coefficients[part.name]
            rest += coefficient * (part.nominal_mm + (part.lower_mm if sign * coefficient > 0 else part.upper_mm))
        ends.append(rest + sign * _least(function, bent, sign))
    return round(ends[0], DIGITS), round(ends[1], DIGITS)


def _least(function: ClosingFunction, parts: list[Part], sign: int) -> float:
    """Least of sign times the share of the closing link that the given parts have."""
    varying = [part for part in parts if part.tolerance_mm > 0]
    nominals = {part.name: np.asarray(part.nominal_mm + part.lower_mm) for part in parts}

    def value(places: Array) -> Array:
        """At places (n, k) from 0 to 1 between the limits."""
        sizes: dict[str, Array] = dict(nominals)
        for part, place in zip(varying, places.T, strict=True):
            sizes[part.name] = part.nominal_mm + part.lower_mm + part.tolerance_mm * place
        shares = sum(function.coefficients[part.name] * sizes[part.name] for part in parts)
        return np.broadcast_to(sign * (shares + function.bent(sizes)), len(places))

    generator = np.random.default_rng(0)
    if len(varying) <= CORNERS:
        corners = np.array(list(product((0.0, 1.0), repeat=len(varying)))).reshape(2 ** len(varying), len(varying))
    else:
        corners = generator.integers(0, 2, (2**CORNERS, len(varying))).astype(float)
    at_corners = value(corners)
    lowest = float(at_corners.min())
    if not varying:
        return lowest
    inside = generator.random((BETWEEN, len(varying)))
    at_inside = value(inside)
    if len(varying) <= CORNERS and at_inside.min() >= lowest:
        return lowest
    from scipy.optimize import minimize

    start = inside[at_inside.argmin()] if at_inside.min() < lowest else corners[at_corners.argmin()]
    scale = max(part.tolerance_mm for part in varying)
    optimum = minimize(lambda place: float(value(place[None, :])[0]) / scale, start, bounds=[(0.0, 1.0)] * len(varying))
    return min(lowest, scale * float(optimum.fun))
