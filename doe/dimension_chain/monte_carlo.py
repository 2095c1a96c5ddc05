"""Monte Carlo of assemblies: the same bits whatever the number of threads.

Assemblies are drawn in chunks of one size, each with a random stream of its own (`numpy.random.SeedSequence.spawn`),
and every part takes one normal and one uniform number; all distributions share them. Numbers of a truncated normal
are those of the normal with what lies outside the limits drawn again.
"""

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.special import ndtr, ndtri

from doe.arrays import Array
from doe.dimension_chain.closing import ClosingFunction
from doe.dimension_chain.distributions import standard_limits
from doe.dimension_chain.links import SLACK, ClosingLink, Distribution, Part

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
