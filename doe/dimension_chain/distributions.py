"""Distributions of a part between its limits: quantiles, shares below a size, means and variances.

A normal part has the standard deviation T/(6 capability), a truncated normal the same before the cut at its
limits; uniform and triangular parts fill the tolerance about its middle.
"""

from math import exp, pi, sqrt

import numpy as np
from scipy.special import ndtr, ndtri

from doe.arrays import Array
from doe.dimension_chain.links import Distribution, Part

FILLING = ("uniform", "triangular")  # the tolerance from end to end
NORMAL_REACH = 9.0  # standard deviations beyond which a normal part has a share below 1e-18
# A normal cut to fewer standard deviations than this is a uniform one to 1e-10; its own formulas lose their digits there.
FLAT = 1e-4


def standard_limits(part: Part) -> tuple[float, float]:
    """Limits of a part in standard deviations from its mean; the part must have a tolerance."""
    return (part.lower_mm - part.mean_mm) / part.sigma_mm, (part.upper_mm - part.mean_mm) / part.sigma_mm


def resolved(part: Part, kind: Distribution) -> Distribution:
    """The distribution, or "uniform" where a truncated normal is as flat as one between the limits of the part."""
    if kind != "truncated_normal" or part.tolerance_mm == 0:
        return kind
    low, high = standard_limits(part)
    return "uniform" if high - low < FLAT else kind


def frame(part: Part, kind: Distribution) -> tuple[float, float]:
    """Scale and shift, mm, that make deviations from the nominal of standard numbers."""
    return (part.tolerance_mm, part.lower_mm) if kind in FILLING else (part.sigma_mm, part.mean_mm)


def quantile(part: Part, kind: Distribution, probability: Array) -> Array:
    """Deviation from the nominal, mm, below which a part lies with each probability."""
    if part.tolerance_mm == 0:
        return np.full_like(probability, part.lower_mm)
    kind = resolved(part, kind)
    scale, shift = frame(part, kind)
    if kind == "triangular":
        root = np.sqrt(np.minimum(probability, 1 - probability) / 2)
        return shift + scale * np.where(probability < 0.5, root, 1 - root)
    if kind == "truncated_normal":
        below, above = (ndtr(limit) for limit in standard_limits(part))
        probability = below + (above - below) * probability
    return shift + scale * (probability if kind == "uniform" else ndtri(probability))


def share_below(part: Part, kind: Distribution, deviation: Array) -> Array:
    """Share of a part's production below each deviation from the nominal, mm."""
    if part.tolerance_mm == 0:
        return (deviation >= part.lower_mm).astype(float)
    kind = resolved(part, kind)
    scale, shift = frame(part, kind)
    place = (deviation - shift) / scale
    if kind in FILLING:
        place = np.clip(place, 0.0, 1.0)
        return place if kind == "uniform" else np.where(place < 0.5, 2 * place**2, 1 - 2 * (1 - place) ** 2)
    if kind == "normal":
        return ndtr(place)
    below, above = (ndtr(limit) for limit in standard_limits(part))
    return np.clip((ndtr(place) - below) / (above - below), 0.0, 1.0)


def moments(part: Part, kind: Distribution) -> tuple[float, float]:
    """Mean deviation from the nominal, mm, and variance, mm^2."""
    if part.tolerance_mm == 0:
        return part.lower_mm, 0.0
    kind = resolved(part, kind)
    if kind in FILLING:
        return part.middle_mm, part.tolerance_mm**2 / (12 if kind == "uniform" else 24)
    if kind == "normal":
        return part.mean_mm, part.sigma_mm**2
    low, high = standard_limits(part)
    share = float(ndtr(high) - ndtr(low))
    shift = (_density(low) - _density(high)) / share
    spread = 1 + (low * _density(low) - high * _density(high)) / share - shift**2
    return part.mean_mm + part.sigma_mm * shift, part.sigma_mm**2 * spread


def support(part: Part, kind: Distribution) -> tuple[float, float]:
    """Least and greatest deviation from the nominal, mm; a normal part's as far as it matters."""
    if kind != "normal":
        return part.lower_mm, part.upper_mm
    reach = NORMAL_REACH * part.sigma_mm
    return part.mean_mm - reach, part.mean_mm + reach


def _density(z: float) -> float:
    return exp(-z * z / 2) / sqrt(2 * pi)
