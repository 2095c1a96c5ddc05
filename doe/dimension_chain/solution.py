"""All that is asked of a dimension chain, in one record."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from doe.dimension_chain.allocation import Allocation, total_cost
from doe.dimension_chain.closing import ClosingFunction, NoValueError, interval, linear_interval, middle
from doe.dimension_chain.links import DIGITS, SLACK, Chain, Distribution, Interval, Part, given_parts
from doe.dimension_chain.reading import faults
from doe.dimension_chain.selective_assembly import SelectiveAssembly, selective_assembly
from doe.dimension_chain.yields import (
    ALIKE,
    Assemblies,
    closing_moments,
    draw,
    exact_shares,
    moments,
    normal_yield,
    sampled_ppm,
    standard_error,
)
from rbdyn.base.faults import InputError
from rbdyn.base.records import Record, derived, keyed, outside_json

# Shares below the quantiles: the median, 95 %, and the 99.73 % of plus and minus three standard deviations.
QUANTILES = (0.00135, 0.025, 0.05, 0.5, 0.95, 0.975, 0.99865)
# What is reported of an allocated part.
ALLOCATED = ("nominal_mm", "upper_mm", "lower_mm", "grade", "moved_mm")


class Linearisation(Record):
    """How far a chain with functions is from its linear form at mid-tolerance, mm.

    ``worst_case_error_mm``: the larger distance of the linear worst case from the true one. ``mean_shift_mm`` and
    ``deviation_error_percent``: the linear mean and standard deviation less those of the Monte Carlo;
    the latter None where nothing varies.
    """

    linear_worst_case_mm: Interval
    worst_case_error_mm: float
    mean_shift_mm: float
    deviation_error_percent: float | None


class ChainResult(Record):
    """The closing link of a chain, mm, and the allocated parts.

    ``yields`` maps "as_given" (each part's own distribution), "normal", "truncated_normal" and "uniform" (all
    parts alike) to the share of assemblies within the limits, by Monte Carlo, ``standard_errors`` to half the Wilson
    interval of one standard deviation, 1/(2 samples) where all or none pass; ``standard_error`` is the largest.
    ``rejected`` are the assemblies per million below and above the limits; ``exact_yields`` the yields without
    sampling, None unless the chain is linear; ``normal_yield`` that of a normal closing link. ``contributions`` are
    in percent, the variance by each part's own distribution. ``mean_mm``, ``standard_deviation_mm`` and
    ``quantiles_mm`` belong to the Monte Carlo as given, and so do the capabilities ``cp`` and ``cpk``: the limits, and the
    nearer of them from the mean, over six and three standard deviations, None where nothing varies. ``cost`` is that of the allocation, where all have curves.
    """

    nominal_mm: float = keyed("closing_link", "nominal_mm")
    worst_case_mm: Interval = keyed("closing_link", "worst_case_mm")
    rss_mm: Interval = keyed("closing_link", "rss_mm")
    yields: dict[str, float] = keyed("yield")
    standard_error: float = derived(lambda self: max(self.standard_errors.values()), "yield", "standard_error")
    contributions: dict[str, dict[str, float]]
    allocated: dict[str, Any] = derived(
        lambda self: {part.name: {key: getattr(part, key) for key in ALLOCATED} for part in self.allocation},
        "allocation",
    )
    status: str
    mean_mm: float = keyed("distribution", "mean_mm")
    standard_deviation_mm: float = keyed("distribution", "standard_deviation_mm")
    cp: float | None = keyed("distribution", "cp")
    cpk: float | None = keyed("distribution", "cpk")
    quantiles_mm: dict[float, float] = keyed("distribution", "quantiles_mm")
    standard_errors: dict[str, float] = keyed("yield_standard_errors")
    rejected: dict[str, dict[str, float]]
    exact_yields: dict[str, float] | None = keyed("exact_yield")
    normal_yield: float
    linearisation: Linearisation | None
    cost: float | None
    selective: SelectiveAssembly | None = keyed("selective_assembly")
    samples: int
    seed: int
    allocation: tuple[Part, ...] = outside_json()

    @property
    def refused(self) -> bool:
        """Whether the given deviations miss the limits."""
        return self.status.startswith("refused")


def solve(chain: Chain, *, samples: int | None = None, seed: int | None = None, source: str = "") -> ChainResult:
    """Intervals, yield, contributions and allocation of a chain.

    A chain without deviations is judged with the allocated ones (status "ok: deviations allocated"). A chain
    whose given deviations miss the limits, by the interval or yield of its allocation mode, is refused: its status
    starts with "refused: " and names the numbers and the allocation. Otherwise the status is "ok". ``samples`` and
    ``seed`` are those of the chain unless given; ``source`` names the file in messages.

    Raises InputError with every fault of the chain (see `faults`), for fewer than one sample, or where a function has
    no finite value within the tolerances or at an assembly drawn.
    """
    samples = chain.monte_carlo.samples if samples is None else samples
    seed = chain.monte_carlo.seed if seed is None else seed
    sentences = faults(chain) + ([f"samples = {samples}: must be at least 1"] if samples < 1 else [])
    if sentences:
        raise InputError(sentences)
    try:
        return _solved(Allocation(chain), samples, seed)
    except NoValueError as error:
        raise InputError([f"{source}: {error}" if source else str(error)]) from None


def _solved(search: Allocation, samples: int, seed: int) -> ChainResult:
    chain, function, limits = search.chain, search.function, search.chain.closing_link
    allocation = search.allocated()
    given = all(link.has_deviations for link in chain.free)
    parts = given_parts(chain.link) if given else allocation
    drawn = draw(function, parts, limits, samples=samples, seed=seed)
    mean, deviation = float(drawn.values.mean()), float(drawn.values.std())
    nearer = min(limits.upper_mm - mean, mean - limits.lower_mm)
    varies = deviation > SLACK
    return ChainResult(
        nominal_mm=round(float(function.value({part.name: part.nominal_mm for part in parts})), DIGITS),
        worst_case_mm=interval(function, parts, "worst_case"),
        rss_mm=interval(function, parts, "rss"),
        yields=drawn.yields,
        standard_errors={law: standard_error(share, samples) for law, share in drawn.yields.items()},
        contributions=_contributions(function, parts),
        allocation=tuple(allocation),
        status=_status(search, parts, allocation, drawn.yields["as_given"], given),
        mean_mm=mean,
        standard_deviation_mm=deviation,
        quantiles_mm=dict(zip(QUANTILES, np.quantile(drawn.values, QUANTILES).tolist(), strict=True)),
        rejected=sampled_ppm(drawn),
        exact_yields=_exact(search, parts),
        normal_yield=normal_yield(function, parts, limits),
        cp=chain.width_mm / (6 * deviation) if varies else None,
        cpk=nearer / (3 * deviation) if varies else None,
        linearisation=None if function.linear else _linearisation(function, parts, drawn),
        cost=_cost(chain, allocation),
        selective=None if chain.selective is None else selective_assembly(function, parts, limits, chain.selective),
        samples=samples,
        seed=seed,
    )


def _contributions(function: ClosingFunction, parts: Sequence[Part]) -> dict[str, dict[str, float]]:
    """Percent of the variance, by each part's own distribution, and of the worst case; sensitivities at the middle."""
    slopes = function.sensitivities(middle(parts))
    spread = [slopes[part.name] ** 2 * moments(part, part.distribution)[1] for part in parts]
    reach = [abs(slopes[part.name]) * part.tolerance_mm for part in parts]
    shares = ([100 * each / (sum(column) or 1.0) for each in column] for column in (spread, reach))
    return {
        part.name: {"variance_percent": variance, "worst_case_percent": width}
        for part, variance, width in zip(parts, *shares, strict=True)
    }


def _exact(search: Allocation, parts: Sequence[Part]) -> dict[str, float] | None:
    if not search.function.linear:
        return None
    limits = search.chain.closing_link
    laws: dict[str, Distribution | None] = {"as_given": None, **{law: law for law in ALIKE}}
    return {key: 1 - sum(exact_shares(search.function, parts, limits, law)) for key, law in laws.items()}


def _linearisation(function: ClosingFunction, parts: Sequence[Part], drawn: Assemblies) -> Linearisation:
    linear, true = (rule(function, parts, "worst_case") for rule in (linear_interval, interval))
    mean, deviation = closing_moments(function, parts, None)
    sampled = float(drawn.values.std())
    return Linearisation(
        linear_worst_case_mm=linear,
        worst_case_error_mm=max(abs(a - b) for a, b in zip(linear, true, strict=True)),
        mean_shift_mm=mean - float(drawn.values.mean()),
        deviation_error_percent=100 * (deviation / sampled - 1) if sampled > 0 else None,
    )


def _cost(chain: Chain, allocation: Sequence[Part]) -> float | None:
    widths = {part.name: part.tolerance_mm for part in allocation}
    curves = {link.name: link.cost for link in chain.free if link.cost is not None}
    # What is not left any tolerance has no price.
    if len(curves) < len(chain.free) or not all(widths[name] for name in curves):
        return None
    return total_cost(list(curves.values()), [widths[name] for name in curves])


def _status(search: Allocation, parts: list[Part], allocation: list[Part], share: float, given: bool) -> str:
    if not given:
        rule = search.chain.allocate
        units = ", in proportion to ISO 286's tolerance units (grades = true narrows them to its grades)"
        return f"ok: deviations allocated{units if rule.method == 'iso286' and not rule.grades else ''}"
    if _kept(search, parts, share):
        return "ok"
    limits, mode, width = search.chain.closing_link, search.mode, search.chain.width_mm
    low, high = interval(search.function, parts, mode)
    free = {link.name for link in search.chain.free}
    nearest = ", ".join(f"{part.name} {part.text}" for part in allocation if part.name in free)
    kind = "RSS" if mode == "rss" else "worst-case"
    wanted = f" where a yield of {search.chain.allocate.target_yield:g} is wanted" if mode == "yield" else ""
    return (
        f"refused: the given deviations put the closing link at {low:+.4f} to {high:+.4f} mm where "
        f"{limits.lower_mm:.4f} to {limits.upper_mm:.4f} mm is allowed ({kind} tolerance {high - low:.4f} mm where "
        f"{width:.4f} mm is there, yield {share:.4g}{wanted}); the nearest that fits is {nearest}"
    )


def _kept(search: Allocation, parts: list[Part], share: float) -> bool:
    """Whether given parts keep the limits; a sampled yield is judged by the large Monte Carlo."""
    if search.mode == "yield" and not search.function.linear:
        return share >= search.chain.allocate.target_yield
    return search.kept(parts)
