"""Yield of assemblies by Monte Carlo, by convolution and by the normal law, distributions of parts, and selective assembly.

A normal part has the standard deviation T/(6 capability), and so has a truncated normal part before truncation at its
limits. Uniform and triangular parts fill the tolerance about its middle.

``draw`` makes random assemblies in chunks of one size, each with its own random stream (`numpy.random.SeedSequence.spawn`).
Every part takes one normal and one uniform number, which all distributions share. A truncated normal takes the normal
numbers and draws those outside the limits again. ``exact_shares`` convolves the distributions of a linear chain.

In ``selective_assembly`` two parts are sorted into classes and matched class by class. Where their coefficients have
opposite signs, large parts go with large ones, else with small ones. In each class the surplus of one part remains unmatched
(Mansoor, Selective assembly: its analysis and applications, 1961).
"""

import os
from bisect import bisect_left
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from itertools import pairwise
from math import exp, pi, sqrt
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from doe.dimension_chain.closing import ClosingFunction, interval, middle
from doe.dimension_chain.links import DIGITS, SLACK, ClosingLink, Distribution, Interval, Part, Selective
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.records import Record, derived, keyed

FILLING = ("uniform", "triangular")  # the tolerance from end to end
NORMAL_REACH = 9.0  # standard deviations beyond which a normal part has a share below 1e-18
# Standard deviations between the limits below which a truncated normal is uniform to 1e-10, and its formulas lose digits.
FLAT = 1e-4


def standard_limits(part: Part) -> tuple[float, float]:
    """Limits of a part in standard deviations from its mean; the part must have a tolerance."""
    return (part.lower_mm - part.mean_mm) / part.sigma_mm, (part.upper_mm - part.mean_mm) / part.sigma_mm


def effective_law(part: Part, kind: Distribution) -> Distribution:
    """The distribution, or "uniform" for a truncated normal that is practically flat between the limits of the part."""
    if kind != "truncated_normal" or part.tolerance_mm == 0:
        return kind
    low, high = standard_limits(part)
    return "uniform" if high - low < FLAT else kind


def frame(part: Part, kind: Distribution) -> tuple[float, float]:
    """Scale and shift, mm, from standard numbers to deviations from the nominal."""
    return (part.tolerance_mm, part.lower_mm) if kind in FILLING else (part.sigma_mm, part.mean_mm)


def quantile(part: Part, kind: Distribution, probability: Array) -> Array:
    """Quantiles of a part's deviation from the nominal, mm, at each ``probability``."""
    if part.tolerance_mm == 0:
        return np.full_like(probability, part.lower_mm)
    kind = effective_law(part, kind)
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
    kind = effective_law(part, kind)
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
    kind = effective_law(part, kind)
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
    """Least and greatest deviation from the nominal, mm; of a normal part within ``NORMAL_REACH``."""
    if kind != "normal":
        return part.lower_mm, part.upper_mm
    reach = NORMAL_REACH * part.sigma_mm
    return part.mean_mm - reach, part.mean_mm + reach


def _density(z: float) -> float:
    return exp(-z * z / 2) / sqrt(2 * pi)


CHUNK = 1 << 14  # assemblies, of which a few columns fit in the second-level cache
RARE = 0.3  # share within the limits below which repeated draws would take too long
COMMON_LAWS: tuple[Distribution, ...] = ("normal", "truncated_normal", "uniform")  # laws of all parts together

Draws = dict[Distribution, tuple[Array, float, float]]
Laws = dict[str, Distribution | None]  # by key; None: each part's own


class Assemblies(Record):
    """Random assemblies: numbers below and above the limits, by the law of the parts.

    ``values`` (samples,): closing links, mm, with each part's own distribution ("as_given").
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
    laws: Sequence[Distribution] = COMMON_LAWS,
    threads: int | None = None,
) -> Assemblies:
    """Draw assemblies with each part's own distribution, and with each of ``laws`` for all parts.

    ``threads``: by default the number of processors; the result has the same bits for any number.
    Raises NoValueError where a function has no finite value.
    """
    values = np.empty(samples)
    starts = range(0, samples, CHUNK)
    streams = np.random.SeedSequence(seed).spawn(len(starts))
    distributions = {part.distribution for part in parts}
    # If all parts follow one of the laws, its assemblies serve for both.
    shared = distributions.pop() if len(distributions) == 1 and distributions <= set(laws) else None
    laws_by_key: Laws = {} if shared else {"as_given": None}
    laws_by_key |= {law: law for law in laws}

    def chunk(index: int) -> dict[str, Sequence[Any]]:
        out = values[starts[index] : starts[index] + CHUNK]
        closing = _closing(function, parts, laws_by_key, np.random.default_rng(streams[index]), len(out))
        np.copyto(out, closing[shared or "as_given"])
        low, high = limits.lower_mm - SLACK, limits.upper_mm + SLACK
        return {law: [np.count_nonzero(links < low), np.count_nonzero(links > high)] for law, links in closing.items()}

    with ThreadPoolExecutor(min(threads or os.cpu_count() or 1, len(starts))) as pool:
        counted = list(pool.map(chunk, range(len(starts))))
    outside = {law: np.sum([tally[law] for tally in counted], axis=0).tolist() for law in counted[0]}
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
        draws = _random_numbers(part, {law or part.distribution for law in laws.values()}, generator, count)
        for key, law in laws.items():
            numbers, scale, shift = draws[law or part.distribution]
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


def _random_numbers(part: Part, laws: set[Distribution], generator: np.random.Generator, count: int) -> Draws:
    """Random numbers for each law, with the scale and shift, mm, to deviations from the nominal."""
    if part.tolerance_mm == 0:
        return dict.fromkeys(laws, (np.zeros(count), 0.0, part.lower_mm))
    draws: Draws = {}
    if laws & {"normal", "truncated_normal"}:
        normal = generator.standard_normal(count)
        draws["normal"] = (normal, part.sigma_mm, part.mean_mm)
        if "truncated_normal" in laws:
            inside = _truncated_normal(normal, *standard_limits(part), generator)
            draws["truncated_normal"] = (inside, part.sigma_mm, part.mean_mm)
    if laws & {"uniform", "triangular"}:
        uniform = generator.random(count)
        draws["uniform"] = (uniform, part.tolerance_mm, part.lower_mm)
        if "triangular" in laws:
            # The sum of two uniform numbers is triangular.
            draws["triangular"] = (uniform + generator.random(count), part.tolerance_mm / 2, part.lower_mm)
    return draws


def _truncated_normal(normal: Array, low: float, high: float, generator: np.random.Generator) -> Array:
    """Truncated normal numbers: those outside the limits are drawn again until none is outside.

    If few are within the limits, they come from the inverse of the normal law instead.
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


def sampled_ppm(assemblies: Assemblies) -> dict[str, dict[str, float]]:
    """Assemblies per million below and above the limits, with standard errors, by law."""
    rates: dict[str, dict[str, float]] = {law: {} for law in assemblies.below}
    for side, counts in (("low", assemblies.below), ("high", assemblies.above)):
        for law, count in counts.items():
            share = count / assemblies.samples
            rates[law][f"{side}_ppm"] = MILLION * share
            rates[law][f"{side}_standard_error_ppm"] = MILLION * standard_error(share, assemblies.samples)
    return rates


def standard_error(share: float, samples: int) -> float:
    """Half the Wilson interval of one standard deviation: 1/(2 samples) where all or none pass."""
    return sqrt(share * (1 - share) / samples + 1 / (4 * samples**2)) / (1 + 1 / samples)


def exact_shares(
    function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink, law: Distribution | None = None
) -> Interval:
    """Shares of the assemblies of a linear chain below and above the limits, without sampling.

    ``law``: of all parts, by default each part's own. All parts but the one of the widest reach are convolved on a lattice;
    that one is integrated exactly. Errors of the lattice are of second order, near 1e-8 of the share.
    """
    bounds = (limits.lower_mm - SLACK, limits.upper_mm + SLACK)
    kinds = {part.name: law or part.distribution for part in parts}
    # A tolerance whose square underflows has no deviation.
    terms = [part for part in parts if (part.tolerance_mm * function.coefficients[part.name]) ** 2 != 0]
    sizes = {part.name: part.nominal_mm + (0.0 if part in terms else part.lower_mm) for part in parts}
    nominal = sum(function.coefficients[name] * size for name, size in sizes.items())
    if not terms:
        return float(nominal < bounds[0]), float(nominal > bounds[1])
    if set(kinds[part.name] for part in terms) == {"normal"}:
        mean, deviation = closing_moments(function, parts, "normal")
        return float(ndtr((bounds[0] - mean) / deviation)), float(ndtr((mean - bounds[1]) / deviation))
    reaches = {part.name: _reach(function, part, kinds[part.name]) for part in terms}
    terms.sort(key=lambda part: reaches[part.name][1] - reaches[part.name][0])
    *others, last = terms
    places, shares = _lattice(function, others, kinds, reaches)
    coefficient = function.coefficients[last.name]
    reached = []
    for bound in bounds:
        below = share_below(last, kinds[last.name], (bound - nominal - places) / coefficient)
        # Not a BLAS product, whose threads cost more than they save and change the last bit.
        reached.append(float((shares * (below if coefficient > 0 else 1 - below)).sum()))
    return min(max(reached[0], 0.0), 1.0), min(max(1 - reached[1], 0.0), 1.0)


def normal_yield(function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink) -> float:
    """Yield of a normal closing link with the mean and variance of the linear chain."""
    mean, deviation = closing_moments(function, parts, None)
    low, high = limits.lower_mm - SLACK, limits.upper_mm + SLACK
    if deviation == 0:
        return float(low <= mean <= high)
    return float(ndtr((high - mean) / deviation) - ndtr((low - mean) / deviation))


def closing_moments(function: ClosingFunction, parts: Sequence[Part], law: Distribution | None) -> Interval:
    """Mean and standard deviation of the closing link, linearised at mid-tolerance, mm."""
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
    """Lattice places, mm, and shares of the sum of coefficient times deviation over the parts."""
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


MOST_CLASSES = 100


class SelectiveAssembly(Record):
    """Result of selective assembly.

    ``matched``: share of the parts that find a partner in their class. ``good``: share of the matched assemblies within the
    limits, with its ``standard_error``; ``random``: that of random assemblies. ``total``: total yield, matched times good.
    ``worst_case_mm``: over all classes. ``edges_mm``: sizes between the classes. ``classes_needed``: least number of classes
    with a worst case within the limits, None above 100.
    """

    classes: int
    total: float = derived(lambda self: self.matched * self.good, "yield")
    matched: float
    good: float = keyed("good_of_matched")
    random: float
    standard_error: float
    matched_deviation_mm: float = keyed("standard_deviation_mm", "matched")
    random_deviation_mm: float = keyed("standard_deviation_mm", "random")
    worst_case_mm: Interval
    edges_mm: dict[str, list[float]] = keyed("class_limits_mm")
    classes_needed: int | None


def selective_assembly(
    function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink, settings: Selective
) -> SelectiveAssembly:
    """Selective assembly of ``settings.samples`` random parts of each link."""
    generator = np.random.default_rng(settings.seed)
    sizes = {}
    for part in parts:
        sizes[part.name] = part.nominal_mm + quantile(part, part.distribution, generator.random(settings.samples))
    pair = _pair(parts, settings)
    edges = [class_edges(part, settings.classes, settings.by) for part in pair]
    matches = _matches([sizes[part.name] for part in pair], edges, _opposed(function, parts, pair))
    closing = np.asarray(function.value(sizes))
    # The other parts are at random.
    mates = {part.name: sizes[part.name][index] for part, index in zip(pair, matches, strict=True)}
    matched = np.asarray(function.value({name: x[: len(matches[0])] for name, x in sizes.items()} | mates))
    good, random = _good(matched, limits), _good(closing, limits)
    return SelectiveAssembly(
        classes=settings.classes,
        matched=len(matched) / settings.samples,
        good=good,
        random=random,
        standard_error=standard_error(good, max(len(matched), 1)),
        matched_deviation_mm=float(matched.std()) if len(matched) else 0.0,
        random_deviation_mm=float(closing.std()),
        worst_case_mm=class_worst_case(function, parts, settings),
        edges_mm={part.name: np.round(edge, DIGITS).tolist() for part, edge in zip(pair, edges, strict=True)},
        classes_needed=classes_needed(function, parts, limits, settings),
    )


def class_edges(part: Part, classes: int, by: str) -> Array:
    """Sizes (classes + 1,), mm, between the classes, from the lower to the upper limit of the part.

    Sizes of a normal part beyond its limits belong to the first and the last class.
    """
    places = np.linspace(0.0, 1.0, classes + 1)
    if by == "width" or part.tolerance_mm == 0:
        deviations = part.lower_mm + part.tolerance_mm * places
    else:
        deviations = np.clip(quantile(part, part.distribution, places), part.lower_mm, part.upper_mm)
        deviations[[0, -1]] = part.lower_mm, part.upper_mm
    return part.nominal_mm + deviations


def class_worst_case(function: ClosingFunction, parts: Sequence[Part], settings: Selective) -> Interval:
    """Least and greatest closing link, mm, of parts within their limits matched class by class."""
    pair = _pair(parts, settings)
    edges = [class_edges(part, settings.classes, settings.by) for part in pair]
    bounds = [list(pairwise(edge.tolist())) for edge in edges]
    if not _opposed(function, parts, pair):
        bounds[1].reverse()
    ends = []
    for limits in zip(*bounds, strict=True):
        within = {
            part.name: replace(part, nominal_mm=0.0, upper_mm=high, lower_mm=low)
            for part, (low, high) in zip(pair, limits, strict=True)
        }
        ends.append(interval(function, [within.get(part.name, part) for part in parts], "worst_case"))
    return min(low for low, _ in ends), max(high for _, high in ends)


def classes_needed(
    function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink, settings: Selective
) -> int | None:
    """Fewest classes of a pair whose worst case keeps the limits; None where none do."""

    def enough(classes: int) -> bool:
        low, high = class_worst_case(function, parts, settings.model_copy(update={"classes": classes}))
        return limits.lower_mm - SLACK <= low and high <= limits.upper_mm + SLACK

    # More classes never widen the worst case.
    fewest = 1 + bisect_left(range(1, MOST_CLASSES + 1), True, key=enough)
    return fewest if fewest <= MOST_CLASSES else None


def _pair(parts: Sequence[Part], settings: Selective) -> tuple[Part, Part]:
    by_name = {part.name: part for part in parts}
    return by_name[settings.first], by_name[settings.second]


def _opposed(function: ClosingFunction, parts: Sequence[Part], pair: Sequence[Part]) -> bool:
    """Whether the two parts change the closing link in opposite directions, so that large parts go with large ones."""
    slopes = function.sensitivities(middle(parts))
    first, second = (slopes[part.name] for part in pair)
    return first * second < 0


def _matches(sizes: Sequence[Array], edges: Sequence[Array], opposed: bool) -> tuple[Rows, Rows]:
    """Indices of the matched first and second parts, class by class, without the surplus."""
    classes = len(edges[0]) - 1
    sorted_in = [np.searchsorted(edge[1:-1], size) for edge, size in zip(edges, sizes, strict=True)]
    if not opposed:
        sorted_in[1] = classes - 1 - sorted_in[1]
    order = [np.argsort(members, kind="stable") for members in sorted_in]
    starts = [np.concatenate(([0], np.bincount(members, minlength=classes).cumsum())) for members in sorted_in]
    matched: tuple[list[Rows], list[Rows]] = ([], [])
    for index in range(classes):
        scarce = min(int(start[index + 1] - start[index]) for start in starts)
        for pairs, members, start in zip(matched, order, starts, strict=True):
            pairs.append(members[start[index] : start[index] + scarce])
    return np.concatenate(matched[0]), np.concatenate(matched[1])


def _good(closing: Array, limits: ClosingLink) -> float:
    if not len(closing):
        return 0.0
    inside = (limits.lower_mm - SLACK <= closing) & (closing <= limits.upper_mm + SLACK)
    return float(inside.mean())
