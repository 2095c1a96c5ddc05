"""Yield: the share of assemblies within the limits, by Monte Carlo, by convolution, by the normal law; and how parts are distributed.

A normal part has the standard deviation T/(6 capability), a truncated normal the same before the cut at its
limits; uniform and triangular parts fill the tolerance about its middle.

Assemblies are drawn in chunks of one size, each with a random stream of its own (`numpy.random.SeedSequence.spawn`),
and every part takes one normal and one uniform number; all distributions share them. Numbers of a truncated normal
are those of the normal with what lies outside the limits drawn again.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from math import exp, pi, sqrt
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from doe.dimension_chain.closing import ClosingFunction, middle
from doe.dimension_chain.links import SLACK, ClosingLink, Distribution, Interval, Part
from rbdyn.base.arrays import Array

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


CHUNK = 1 << 14  # assemblies: a handful of columns of them stays in the second-level cache
RARE = 0.3  # share within the limits below which drawing again would last too long
ALIKE: tuple[Distribution, ...] = ("normal", "truncated_normal", "uniform")  # laws for all parts alike

Drawn = dict[Distribution, tuple[Array, float, float]]
Laws = dict[str, Distribution | None]  # by key; None: each part's own


@dataclass(frozen=True)
class Assemblies:
    """Assemblies drawn: how many fall below and above the limits, by the law of the parts.

    ``values`` (samples,) are the closing links, mm, with each part's own distribution ("as_given").
    """

    samples: int
    below: dict[str, int]
    above: dict[str, int]
    values: Array

    @property
    def yields(self) -> dict[str, float]:
        """Share of the assemblies that lie within the limits, by law."""
        return {law: 1 - (self.below[law] + self.above[law]) / self.samples for law in self.below}


def draw(
    function: ClosingFunction,
    parts: Sequence[Part],
    limits: ClosingLink,
    *,
    samples: int,
    seed: int,
    laws: Sequence[Distribution] = ALIKE,
    threads: int | None = None,
) -> Assemblies:
    """Draw assemblies with each part's own distribution, and with all parts of each of ``laws``.

    ``threads``: as many as there are processors unless given; they change no bit of the result.
    Raises NoValueError where a function has no finite value.
    """
    values = np.empty(samples)
    starts = range(0, samples, CHUNK)
    streams = np.random.SeedSequence(seed).spawn(len(starts))
    own = {part.distribution for part in parts}
    # Parts that all follow one law need no draw of their own.
    shared = own.pop() if len(own) == 1 and own <= set(laws) else None
    wanted: Laws = {} if shared else {"as_given": None}
    wanted |= {law: law for law in laws}

    def chunk(index: int) -> dict[str, Sequence[Any]]:
        out = values[starts[index] : starts[index] + CHUNK]
        closing = _closing(function, parts, wanted, np.random.default_rng(streams[index]), len(out))
        np.copyto(out, closing[shared or "as_given"])
        low, high = limits.lower_mm - SLACK, limits.upper_mm + SLACK
        return {law: [np.count_nonzero(each < low), np.count_nonzero(each > high)] for law, each in closing.items()}

    with ThreadPoolExecutor(min(threads or os.cpu_count() or 1, len(starts))) as pool:
        counted = list(pool.map(chunk, range(len(starts))))
    outside = {law: np.sum([each[law] for each in counted], axis=0).tolist() for law in counted[0]}
    if shared is not None:
        outside["as_given"] = outside[shared]
    below, above = ({key: outside[key][side] for key in ("as_given", *laws)} for side in (0, 1))
    return Assemblies(samples, below, above, values)


def _closing(
    function: ClosingFunction, parts: Sequence[Part], laws: Laws, generator: np.random.Generator, count: int
) -> dict[str, Array]:
    """Closing links of one chunk by each of the ``laws``."""
    sums = {key: np.zeros(count) for key in laws}
    offsets = dict.fromkeys(laws, 0.0)
    sizes: dict[str, dict[str, Array]] = {key: {} for key in laws}
    work = np.empty(count)
    for part in parts:
        coefficient = function.coefficients[part.name]
        drawn = _drawn(part, {law or part.distribution for law in laws.values()}, generator, count)
        for key, law in laws.items():
            numbers, scale, shift = drawn[law or part.distribution]
            if part.name in function.arguments:
                sizes[key][part.name] = part.nominal_mm + shift + scale * numbers
            if coefficient:
                np.multiply(numbers, coefficient * scale, out=work)
                sums[key] += work
                offsets[key] += coefficient * (part.nominal_mm + shift)
    for key in laws:
        sums[key] += offsets[key]
        if not function.linear:
            sums[key] += function.bent(sizes[key])
    return sums


def _drawn(part: Part, laws: set[Distribution], generator: np.random.Generator, count: int) -> Drawn:
    """For each law random numbers and the scale and shift, mm, that make deviations from the nominal of them."""
    if part.tolerance_mm == 0:
        return dict.fromkeys(laws, (np.zeros(count), 0.0, part.lower_mm))
    drawn: Drawn = {}
    if laws & {"normal", "truncated_normal"}:
        normal = generator.standard_normal(count)
        drawn["normal"] = (normal, part.sigma_mm, part.mean_mm)
        if "truncated_normal" in laws:
            inside = _redrawn(normal, *standard_limits(part), generator)
            drawn["truncated_normal"] = (inside, part.sigma_mm, part.mean_mm)
    if laws & {"uniform", "triangular"}:
        uniform = generator.random(count)
        drawn["uniform"] = (uniform, part.tolerance_mm, part.lower_mm)
        if "triangular" in laws:
            # The sum of two uniform numbers is triangular.
            drawn["triangular"] = (uniform + generator.random(count), part.tolerance_mm / 2, part.lower_mm)
    return drawn


def _redrawn(normal: Array, low: float, high: float, generator: np.random.Generator) -> Array:
    """Normal numbers with those outside the limits drawn again until none is left.

    Where few lie within, numbers by the inverse of the normal law instead.
    """
    below, above = float(ndtr(low)), float(ndtr(high))
    if above - below < RARE:
        return np.clip(ndtri(below + (above - below) * generator.random(len(normal))), low, high)
    numbers = normal.copy()
    outside = np.flatnonzero((numbers < low) | (numbers > high))
    while len(outside):
        numbers[outside] = generator.standard_normal(len(outside))
        again = numbers[outside]
        outside = outside[(again < low) | (again > high)]
    return numbers


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
