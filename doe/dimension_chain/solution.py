"""Solution of a dimension chain: intervals, yields, contributions, allocation and selective assembly in one record."""

from collections.abc import Sequence
from functools import partial
from math import sqrt
from typing import NamedTuple

import numpy as np

from doe.dimension_chain import links, refusal, yields
from doe.dimension_chain.allocation import Allocation, total_cost
from doe.dimension_chain.closing import ClosingFunction, NoValueError, interval, linear_interval, middle
from doe.dimension_chain.links import SLACK, Chain, Distribution, Interval, Part, grade_words, size_text, stated_parts
from doe.dimension_chain.reading import faults
from doe.dimension_chain.yields import Assemblies, SelectiveAssembly, draw, moments, normal_yield, standard_error
from rbdyn.base.faults import InputError, MethodError
from rbdyn.base.records import Record, derived, keyed, outside_json, shown, written

# Probabilities of the quantiles, up to those of plus and minus three standard deviations.
QUANTILES = (0.00135, 0.025, 0.05, 0.5, 0.95, 0.975, 0.99865)
MATCHED = "ok: matched in"


class AllocatedSize(Record):
    """Nominal, deviations and grade of a part, and by how much its nominal moved, mm."""

    nominal_mm: float = written("nominal, and the deviations from it")
    upper_mm: float = written("")
    lower_mm: float = written("")
    grade: str | None = shown(
        "grade", cell=lambda size: size.graded, text=True, meaning="grade of ISO 286-1, where one was chosen"
    )
    moved_mm: float = shown(
        "nominal moved [mm]", cell=lambda size: size.shift, meaning="by how much the nominal moved from the scene's"
    )

    @property
    def drawn(self) -> str:
        """The size as a drawing states it, '9.290 0/-0.005'."""
        return size_text(self.nominal_mm, self.upper_mm, self.lower_mm)

    @property
    def graded(self) -> str:
        """The grade in words."""
        return self.grade or ""

    @property
    def shift(self) -> str:
        """'+0.020' of a nominal that moved, else nothing."""
        return size_text(0.0, self.moved_mm, 0.0).split()[1].partition("/")[0] if self.moved_mm else ""

    @property
    def source(self) -> str:
        """Where the deviations come from; empty where the record does not say."""
        return ""


class PartSize(AllocatedSize):
    """A part to make: also the code that states its size, where that comes from, a class of ISO 286 within a seat, whether its
    nominal is an estimate, its grade in words, and the size on the drawing."""

    fit: str | None = written("code that states the deviations, such as H7")
    origin: str = shown(
        "deviations",
        cell=lambda size: size.source,
        text=True,
        meaning="where the deviations come from: stated, allocated, or a growth by temperature",
    )
    iso_class: str | None = written("class of ISO 286-1 within the limits of a seat")
    estimated: bool = written("whether the nominal is an estimate, which the drawing has to state")
    grade_words: str | None = shown("", screen=False, files=False)
    text: str = shown("", screen=False, files=False)

    @property
    def drawn(self) -> str:
        """The size as its drawing states it."""
        return self.text

    @property
    def graded(self) -> str:
        """'IT7, m6 within' of a part: its grade, and of a seat the class of ISO 286 within its limits."""
        within = f"{self.iso_class} within" if self.iso_class else ""
        return ", ".join(word for word in (self.grade_words or self.grade, within) if word)

    @property
    def source(self) -> str:
        """Where the deviations come from."""
        return self.origin


class Linearisation(Record):
    """Errors of the linear form at mid-tolerance of a chain with functions, mm.

    ``worst_case_error_mm``: larger distance of the linear worst case from the true one. ``mean_shift_mm``,
    ``deviation_error_percent``: linear mean and standard deviation compared with the Monte Carlo; the latter is None without
    any variation.
    """

    linear_worst_case_mm: Interval
    worst_case_error_mm: float
    mean_shift_mm: float
    deviation_error_percent: float | None


class ChainResult(Record):
    """The closing link of a chain, mm, and the allocated parts.

    Laws are "as_given" (each part's own distribution), "normal", "truncated_normal" and "uniform" (of all parts).

    - ``yields``: share of assemblies within the limits, by law, by Monte Carlo
    - ``standard_errors``: half the Wilson interval of one standard deviation, 1/(2 samples) where all or none pass;
      ``standard_error``: the largest of them
    - ``rejected``: assemblies per million below and above the limits, by law
    - ``exact_yields``: without sampling, None unless the chain is linear; ``normal_yield``: of a normal closing link
    - ``contributions``: percent of the variance, by each part's own distribution, and of the worst case
    - ``mean_mm``, ``standard_deviation_mm``, ``quantiles_mm``: of the Monte Carlo with the law "as_given"
    - ``cp``, ``cpk``: tolerance over six standard deviations, and distance of the mean from the nearer limit over three; None
      without variation
    - ``cost``: of the allocation, None unless all parts have curves
    - ``parts``: sizes for the drawing, which all other figures describe: stated ones as they are written, allocated ones on the
      steps of ``resolution_mm``; ``allocation``: the same, or the nearest that meet the limits where stated ones do not
    - ``contributions_mm``: what each part takes of the worst case and of six standard deviations of the closing link
    - ``missed``, ``remedy``: by how much a refused chain misses, and what would meet it; else None
    """

    nominal_mm: float = keyed("closing_link", "nominal_mm")
    worst_case_mm: Interval = keyed("closing_link", "worst_case_mm")
    rss_mm: Interval = keyed("closing_link", "rss_mm")
    yields: dict[str, float] = keyed("yield")
    standard_error: float = derived(lambda self: max(self.standard_errors.values()), "yield", "standard_error")
    contributions: dict[str, dict[str, float]]
    allocated: dict[str, AllocatedSize] = keyed("allocation")
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
    limits_mm: Interval
    resolution_mm: float
    sizes: dict[str, PartSize] = keyed("parts")
    contributions_mm: dict[str, dict[str, float]]
    missed: refusal.Miss | None
    remedy: refusal.Remedy | None
    allocation: tuple[Part, ...] = outside_json(default=())
    parts: tuple[Part, ...] = outside_json(default=())

    @property
    def refused(self) -> bool:
        """Whether the parts miss the limits."""
        return self.status.startswith("refused")

    @property
    def drawn_sizes(self) -> dict[str, PartSize]:
        """The parts on a drawing, where growths by temperature do not stand."""
        return {name: size for name, size in self.sizes.items() if size.origin != "temperature"}


def solve(chain: Chain, *, samples: int | None = None, seed: int | None = None, source: str = "") -> ChainResult:
    """Intervals, yield, contributions and allocation of a chain.

    A chain without deviations gets the allocated ones (status "ok: deviations allocated"). Where stated deviations, or the
    narrowest allocated ones, exceed the limits, by the interval or yield of the allocation mode, the status starts with
    "refused: " and states the figures. Otherwise it is "ok". A chain that only ``selective`` assembly keeps within its limits
    is "ok" too. ``samples`` and ``seed`` are by default those of the chain; ``source`` names the file in messages.

    Raises InputError with all faults of the chain (see `faults`), for fewer than one sample, and where a function has no
    finite value.
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
    judged = _judged(search, samples, seed)
    parts, assemblies, matched = judged.parts, judged.assemblies, judged.matched
    mean, deviation = float(assemblies.values.mean()), float(assemblies.values.std())
    nearer = min(limits.upper_mm - mean, mean - limits.lower_mm)
    varies = deviation > SLACK
    percent, sizes = _contributions(function, parts)
    verdict = _verdict(search, judged, partial(_accepted, samples=samples, seed=seed))
    return ChainResult(
        nominal_mm=round(float(function.value({part.name: part.nominal_mm for part in parts})), links.DIGITS),
        worst_case_mm=interval(function, parts, "worst_case"),
        rss_mm=interval(function, parts, "rss"),
        yields=assemblies.yields,
        standard_errors={law: standard_error(share, samples) for law, share in assemblies.yields.items()},
        contributions=percent,
        allocated={part.name: AllocatedSize.from_attributes(part) for part in verdict.nearest or parts},
        sizes={part.name: PartSize.from_attributes(part, grade_words=grade_words(part)) for part in parts},
        allocation=tuple(verdict.nearest or parts),
        status=verdict.status,
        mean_mm=mean,
        standard_deviation_mm=deviation,
        quantiles_mm=dict(zip(QUANTILES, np.quantile(assemblies.values, QUANTILES).tolist(), strict=True)),
        rejected=yields.sampled_ppm(assemblies),
        exact_yields=_exact(search, parts),
        normal_yield=normal_yield(function, parts, limits),
        cp=chain.width_mm / (6 * deviation) if varies else None,
        cpk=nearer / (3 * deviation) if varies else None,
        linearisation=None if function.linear else _linearisation(function, parts, assemblies),
        cost=_cost(chain, parts),
        selective=matched,
        samples=samples,
        seed=seed,
        parts=tuple(parts),
        limits_mm=(limits.lower_mm, limits.upper_mm),
        resolution_mm=chain.allocate.resolution_mm,
        contributions_mm=sizes,
        missed=verdict.missed,
        remedy=verdict.remedy,
    )


class _Verdict(Record):
    """Status of judged parts; for refused ones also the miss, the remedy and the nearest parts that meet the limits."""

    status: str
    missed: refusal.Miss | None = None
    remedy: refusal.Remedy | None = None
    nearest: list[Part] | None = None


class _Judged(NamedTuple):
    """The parts of a chain with their random and matched assemblies, and the status that accepts them; None: refused."""

    parts: list[Part]
    assemblies: Assemblies
    matched: SelectiveAssembly | None
    status: str | None

    @property
    def share(self) -> float:
        """Share of the random assemblies within the limits."""
        return self.assemblies.yields["as_given"]


def _judged(search: Allocation, samples: int, seed: int) -> _Judged:
    chain, function, limits = search.chain, search.function, search.chain.closing_link
    allocation = None if chain.is_stated else search.allocated()
    parts = stated_parts(chain.link) if chain.is_stated else allocation or search.narrowest()
    assemblies = draw(function, parts, limits, samples=samples, seed=seed)
    matched = None if chain.selective is None else yields.selective_assembly(function, parts, limits, chain.selective)
    status = None
    if allocation is not None:
        status = _allocated_status(chain)
    elif chain.is_stated and _fits(search, parts, assemblies.yields["as_given"]):
        status = "ok"
    elif matched is not None and refusal.keeps_limits(chain, matched):
        status = f"{MATCHED} {matched.classes} classes; random assemblies violate the limits"
    return _Judged(parts, assemblies, matched, status)


def _accepted(chain: Chain, samples: int, seed: int) -> tuple[bool, SelectiveAssembly | None]:
    """Whether `solve` accepts a changed chain, and its matched assemblies where only they keep the limits."""
    if faults(chain):
        return False, None
    try:
        status = (judged := _judged(Allocation(chain), samples, seed)).status
    except MethodError:
        return False, None
    return status is not None, judged.matched if (status or "").startswith(MATCHED) else None


def _with_sizes(chain: Chain, parts: Sequence[Part]) -> Chain:
    """The chain with the sizes of parts stated in its links."""
    sizes = {part.name: {key: getattr(part, key) for key in ("nominal_mm", "upper_mm", "lower_mm")} for part in parts}
    free = {link.name for link in chain.free}
    sized = [link.model_copy(update=sizes[link.name]) if link.name in free else link for link in chain.link]
    return chain.model_copy(update={"link": sized})


def _verdict(search: Allocation, judged: _Judged, accepted: refusal.Judge) -> _Verdict:
    if judged.status is not None:
        return _Verdict(judged.status)
    chain, parts, share = search.chain, judged.parts, judged.share
    # Sizes that a code states, such as those of bought rings, are no proposals. Where a move of one nominal is enough, the stated
    # tolerances stay.
    proposals = (
        (search.moved, search.allocated) if chain.is_stated and any(link.fit is None for link in chain.free) else ()
    )
    found = (propose() for propose in proposals)
    nearest = next((sizes for sizes in found if sizes and accepted(_with_sizes(chain, sizes))[0]), None)
    reason = (
        refusal.stated_reason(search, parts, share, nearest) if chain.is_stated else refusal.allocated_reason(search)
    )
    remedy = refusal.remedy_of(search, parts, share, accepted)
    return _Verdict(f"refused: {reason}", refusal.miss_of(search, parts, share), remedy, nearest)


def _allocated_status(chain: Chain) -> str:
    rule = chain.allocate
    if rule.method == "iso286" and not rule.grades:
        return "ok: deviations allocated, in proportion to ISO 286's tolerance units (grades = true narrows them to its grades)"
    return "ok: deviations allocated"


def _contributions(
    function: ClosingFunction, parts: Sequence[Part]
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, float]]]:
    """What each part takes of the closing link's scatter, in percent and in mm; sensitivities at the middle.

    In percent of the variance, by each part's own distribution, and of the worst case; in mm of the worst case and of six standard
    deviations.
    """
    slopes, percent, sizes = function.sensitivities(middle(parts)), {}, {}
    variances = [moments(part, part.distribution)[1] for part in parts]
    spread = [slopes[part.name] ** 2 * variance for part, variance in zip(parts, variances, strict=True)]
    reach = [abs(slopes[part.name]) * part.tolerance_mm for part in parts]
    totals = [sum(column) or 1.0 for column in (spread, reach)]
    for part, variance, scatter, width in zip(parts, variances, spread, reach, strict=True):
        shares = {"variance_percent": 100 * scatter / totals[0], "worst_case_percent": 100 * width / totals[1]}
        six_sigma = 6 * abs(slopes[part.name]) * sqrt(variance)
        percent[part.name], sizes[part.name] = shares, {"worst_case_mm": width, "six_sigma_mm": six_sigma}
    return percent, sizes


def _exact(search: Allocation, parts: Sequence[Part]) -> dict[str, float] | None:
    if not search.function.linear:
        return None
    limits = search.chain.closing_link
    laws: dict[str, Distribution | None] = {"as_given": None, **{law: law for law in yields.COMMON_LAWS}}
    return {key: 1 - sum(yields.exact_shares(search.function, parts, limits, law)) for key, law in laws.items()}


def _linearisation(function: ClosingFunction, parts: Sequence[Part], assemblies: Assemblies) -> Linearisation:
    linear, true = (rule(function, parts, "worst_case") for rule in (linear_interval, interval))
    mean, deviation = yields.closing_moments(function, parts, None)
    sampled = float(assemblies.values.std())
    return Linearisation(
        linear_worst_case_mm=linear,
        worst_case_error_mm=max(abs(a - b) for a, b in zip(linear, true, strict=True)),
        mean_shift_mm=mean - float(assemblies.values.mean()),
        deviation_error_percent=100 * (deviation / sampled - 1) if sampled > 0 else None,
    )


def _cost(chain: Chain, allocation: Sequence[Part]) -> float | None:
    widths = {part.name: part.tolerance_mm for part in allocation}
    curves = {link.name: link.cost for link in chain.free if link.cost is not None}
    # A tolerance of zero has no finite cost.
    if len(curves) < len(chain.free) or not all(widths[name] for name in curves):
        return None
    return total_cost(list(curves.values()), [widths[name] for name in curves])


def _fits(search: Allocation, parts: list[Part], share: float) -> bool:
    """Whether given parts keep the limits; a sampled yield is judged by the large Monte Carlo."""
    if search.mode == "yield" and not search.function.linear:
        return share >= search.chain.allocate.target_yield
    return search.fits(parts)
