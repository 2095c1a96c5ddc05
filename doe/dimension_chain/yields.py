"""Yield: share of assemblies within the limits, by Monte Carlo, by convolution, by the normal law."""

from collections.abc import Sequence
from math import sqrt

import numpy as np
from scipy.special import ndtr

from doe.arrays import Array
from doe.dimension_chain.closing import ClosingFunction, middle
from doe.dimension_chain.distributions import moments, share_below, support
from doe.dimension_chain.links import SLACK, ClosingLink, Distribution, Interval, Part
from doe.dimension_chain.monte_carlo import Assemblies

LATTICE = 1 << 13  # points over the reach of the closing link
MILLION = 1e6


def sampled_ppm(drawn: Assemblies) -> dict[str, dict[str, float]]:
    """Assemblies per million below and above the limits, with standard errors, by law."""
    rates: dict[str, dict[str, float]] = {law: {} for law in drawn.below}
    for side, counts in (("low", drawn.below), ("high", drawn.above)):
        for law, count in counts.items():
            share = count / drawn.samples
            rates[law][f"{side}_ppm"] = MILLION * share
            rates[law][f"{side}_standard_error_ppm"] = MILLION * standard_error(share, drawn.samples)
    return rates


def standard_error(share: float, samples: int) -> float:
    """Half the Wilson interval of one standard deviation: 1/(2 samples) where all or none pass."""
    return sqrt(share * (1 - share) / samples + 1 / (4 * samples**2)) / (1 + 1 / samples)


def exact_shares(
    function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink, law: Distribution | None = None
) -> Interval:
    """Shares of the assemblies of a linear chain below and above the limits, without sampling.

    ``law`` for all parts alike, or each part's own. All parts but that of the widest reach are put on a lattice and
    convolved; the widest is integrated exactly. Errors of the lattice are of second order, near 1e-8 of the share.
    """
    bounds = (limits.lower_mm - SLACK, limits.upper_mm + SLACK)
    kinds = {part.name: law or part.distribution for part in parts}
    terms = [part for part in parts if part.tolerance_mm * function.coefficients[part.name] != 0]
    sizes = {part.name: part.nominal_mm + (0.0 if part in terms else part.lower_mm) for part in parts}
    nominal = sum(function.coefficients[name] * size for name, size in sizes.items())
    if not terms:
        return float(nominal < bounds[0]), float(nominal > bounds[1])
    if set(kinds[part.name] for part in terms) == {"normal"}:
        mean, deviation = closing_moments(function, parts, "normal")
        return float(ndtr((bounds[0] - mean) / deviation)), float(ndtr((mean - bounds[1]) / deviation))
    reaches = {part.name: _reach(function, part, kinds[part.name]) for part in terms}
    terms.sort(key=lambda part: reaches[part.name][1] - reaches[part.name][0])
    *others, widest = terms
    places, shares = _lattice(function, others, kinds, reaches)
    coefficient = function.coefficients[widest.name]
    reached = []
    for bound in bounds:
        below = share_below(widest, kinds[widest.name], (bound - nominal - places) / coefficient)
        # No product of BLAS: its threads would cost more than they save and change the last bit.
        reached.append(float((shares * (below if coefficient > 0 else 1 - below)).sum()))
    return min(max(reached[0], 0.0), 1.0), min(max(1 - reached[1], 0.0), 1.0)


def normal_yield(function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink) -> float:
    """Yield if the closing link were normal with the mean and variance of the linear chain."""
    mean, deviation = closing_moments(function, parts, None)
    low, high = limits.lower_mm - SLACK, limits.upper_mm + SLACK
    if deviation == 0:
        return float(low <= mean <= high)
    return float(ndtr((high - mean) / deviation) - ndtr((low - mean) / deviation))


def closing_moments(function: ClosingFunction, parts: Sequence[Part], law: Distribution | None) -> Interval:
    """Mean and standard deviation of the closing link, made linear at mid-tolerance, mm."""
    sizes = middle(parts)
    slopes = function.sensitivities(sizes)
    mean, variance = float(function.value(sizes)), 0.0
    for part in parts:
        shift, spread = moments(part, law or part.distribution)
        mean += slopes[part.name] * (shift - part.middle_mm)
        variance += slopes[part.name] ** 2 * spread
    return mean, sqrt(variance)


def _reach(function: ClosingFunction, part: Part, kind: Distribution) -> Interval:
    ends = [function.coefficients[part.name] * end for end in support(part, kind)]
    return min(ends), max(ends)


def _lattice(
    function: ClosingFunction, parts: Sequence[Part], kinds: dict[str, Distribution], reaches: dict[str, Interval]
) -> tuple[Array, Array]:
    """Places, mm, and shares of the sum of coefficient times deviation of the parts."""
    if not parts:
        return np.zeros(1), np.ones(1)
    start = sum(reaches[part.name][0] for part in parts)
    step = (sum(reaches[part.name][1] for part in parts) - start) / LATTICE
    length = 2 * LATTICE
    spectrum = np.ones(length // 2 + 1, complex)
    for part in parts:
        low, high = reaches[part.name]
        count = int(np.ceil((high - low) / step)) + 2
        # Shares of the cells about low, low + step, ...
        edges: Array = (low + step * (np.arange(count + 1, dtype=float) - 0.5)) / function.coefficients[part.name]
        spectrum = spectrum * np.fft.rfft(np.abs(np.diff(share_below(part, kinds[part.name], edges))), length)
    return start + step * np.arange(length, dtype=float), np.fft.irfft(spectrum, length)
