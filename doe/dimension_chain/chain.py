"""Dimension chains: a closing link as the signed sum of parts, its tolerance, and tolerances that fit it.

The closing link is sum(c_i x_i) with signed coefficients c_i; a part has a nominal, an upper and a lower
deviation from it, all in mm, and a tolerance T = upper - lower. Unless given, the mean of a part is at
mid-tolerance; a normal part has T = 6 sigma. Worst case adds |c_i| T_i; root sum square (RSS) adds their
squares, about the mid-tolerance. Allocated deviations can only shorten the closing link, 0/-T on a part of
positive coefficient and +T/0 on one of negative; the nominal of one part is moved so that the closing link's
maximum meets its upper limit.

Source: ISO 286-1 for the tolerance unit and the grades, taken at the nominal itself (for nominals up to
500 mm) instead of at the mean of a range of sizes, and not rounded.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import cbrt, sqrt
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtr, ndtri
from scipy.stats import truncnorm

from rbdyn.faults import InputError, Strict, read_toml, validated

Array = NDArray[np.float64]
Distribution = Literal["normal", "truncated_normal", "uniform", "triangular"]
Mode = Literal["worst_case", "rss"]
Interval = tuple[float, float]

SLACK = 1e-9  # mm: round-off allowed at a limit
DIGITS = 12  # decimals in mm kept of an allocated size
GRADE_UNITS = (7, 10, 16, 25, 40, 64, 100, 160, 250, 400, 640, 1000, 1600, 2500)  # IT5 to IT18


class ClosingLink(Strict):
    """Limits of the closing link, mm."""

    lower_mm: float
    upper_mm: float


class Link(Strict):
    """One part. ``mean_mm`` is a deviation from the nominal, like ``upper_mm`` and ``lower_mm``."""

    name: str = Field(min_length=1)
    coefficient: float
    nominal_mm: float
    upper_mm: float | None = None
    lower_mm: float | None = None
    distribution: Distribution = "normal"
    mean_mm: float | None = None
    fixed: bool = False


class Allocate(Strict):
    """How tolerances are shared; ``adjust`` names the part whose nominal is moved.

    Default: the first part that is not fixed, of positive coefficient if there is one.
    """

    method: Literal["equal", "iso286"] = "equal"
    mode: Mode = "worst_case"
    grades: bool = False
    adjust: str | None = None


class Chain(Strict):
    """A closing link, its parts and the wish for their tolerances."""

    closing_link: ClosingLink
    link: list[Link] = Field(min_length=1)
    allocate: Allocate = Allocate()


@dataclass(frozen=True)
class Part:
    """A part with all its numbers, mm; ``mean_mm`` is a deviation from the nominal."""

    name: str
    coefficient: float
    nominal_mm: float
    upper_mm: float
    lower_mm: float
    distribution: Distribution
    mean_mm: float
    grade: str | None = None

    @property
    def tolerance_mm(self) -> float:
        """Width of the tolerance."""
        return self.upper_mm - self.lower_mm


@dataclass(frozen=True)
class ChainResult:
    """The closing link of a chain, mm, and the allocated parts.

    ``yields`` maps "as_given" (each part's own distribution), "normal", "truncated_normal" and "uniform" (all
    parts alike) to the share of assemblies within the limits. ``standard_error`` is the largest of these
    four: half the Wilson interval of one standard deviation, 1/(2 samples) where all or none pass.
    ``contributions`` are in percent, the variance by each part's own distribution.
    """

    nominal_mm: float
    worst_case_mm: Interval
    rss_mm: Interval
    yields: dict[str, float]
    standard_error: float
    contributions: dict[str, dict[str, float]]
    allocation: tuple[Part, ...]
    status: str

    def as_dict(self) -> dict[str, Any]:
        """Plain numbers, lists and dicts, ready for JSON."""
        shown = ("nominal_mm", "upper_mm", "lower_mm", "grade")
        return {
            "closing_link": {
                "nominal_mm": self.nominal_mm,
                "worst_case_mm": list(self.worst_case_mm),
                "rss_mm": list(self.rss_mm),
            },
            "yield": {**self.yields, "standard_error": self.standard_error},
            "contributions": self.contributions,
            "allocation": {part.name: {key: getattr(part, key) for key in shown} for part in self.allocation},
            "status": self.status,
        }


def read_chain(path: Path | str) -> Chain:
    """Read a chain from a TOML file; InputError names the file, every fault and its mend."""
    return chain_from(read_toml(path), str(path))


def chain_from(data: Mapping[str, Any], source: str) -> Chain:
    """Build a chain from a table; ``source`` names the file in the messages of InputError."""
    chain = validated(Chain, data, source)
    if found := faults(chain):
        raise InputError(f"{source}: {fault}" for fault in found)
    return chain


def solve(chain: Chain, *, samples: int = 1_000_000, seed: int = 1) -> ChainResult:
    """Intervals, yield, contributions and allocation of a chain.

    A chain without deviations is judged with the allocated ones (status "ok: deviations allocated"). A chain
    whose given deviations miss the limits, by the interval of its allocation mode, is refused: its status
    starts with "refused: " and names the numbers and the allocation. Otherwise the status is "ok".

    Raises InputError with every fault of the chain (see `faults`), or for fewer than one sample.
    """
    found = faults(chain) + ([f"samples = {samples}: must be at least 1"] if samples < 1 else [])
    if found:
        raise InputError(found)
    allocation = allocated(chain)
    given = [_part(link) for link in chain.link if link.upper_mm is not None]
    parts = given if len(given) == len(chain.link) else allocation
    yields = _yields(parts, chain.closing_link, samples, seed)
    return ChainResult(
        nominal_mm=round(sum(part.coefficient * part.nominal_mm for part in parts), DIGITS),
        worst_case_mm=interval(parts, "worst_case"),
        rss_mm=interval(parts, "rss"),
        yields=yields,
        standard_error=max(_standard_error(share, samples) for share in yields.values()),
        contributions=_contributions(parts),
        allocation=tuple(allocation),
        status=_status(chain, parts, allocation, yields["as_given"]),
    )


def interval(parts: Sequence[Part], mode: Mode) -> Interval:
    """Least and greatest closing link, mm, in worst case or by RSS about the mid-tolerance."""
    middle = sum(part.coefficient * (part.nominal_mm + (part.upper_mm + part.lower_mm) / 2) for part in parts)
    half = _total([abs(part.coefficient) * part.tolerance_mm for part in parts], mode) / 2
    return round(middle - half, DIGITS), round(middle + half, DIGITS)


def allocated(chain: Chain) -> list[Part]:
    """Parts with tolerances that together fill the closing link's limits, fixed ones as given.

    "equal" gives every part that is not fixed the same tolerance, "iso286" one in proportion to its
    tolerance unit. Snapped to grades, each gets the widest ISO 286 grade within that tolerance, or keeps it
    without a grade where even IT01 is wider.
    """
    rule = chain.allocate
    free = [link for link in chain.link if not link.fixed]
    iso = rule.method == "iso286"
    weights = {link.name: tolerance_unit(link.nominal_mm) if iso else 1.0 for link in free}
    width, consumed = _width(chain), _consumed(chain)
    rest = width - consumed if rule.mode == "worst_case" else sqrt(width**2 - consumed**2)
    share = rest / _total([abs(link.coefficient) * weights[link.name] for link in free], rule.mode)
    parts = [
        _part(link) if link.fixed else _allocated(link, share * weights[link.name], rule.grades)
        for link in chain.link
    ]
    wanted = rule.adjust or min(free, key=lambda link: link.coefficient < 0).name
    adjusted = next(part for part in parts if part.name == wanted)
    excess = chain.closing_link.upper_mm - interval(parts, rule.mode)[1]
    moved = round(adjusted.nominal_mm + excess / adjusted.coefficient, DIGITS)
    return [replace(part, nominal_mm=moved) if part is adjusted else part for part in parts]


def tolerance_unit(nominal_mm: float) -> float:
    """Standard tolerance unit i of ISO 286-1 in mm: 0.45 D^(1/3) + 0.001 D in um, D > 0 in mm."""
    return 1e-3 * (0.45 * cbrt(nominal_mm) + 0.001 * nominal_mm)


def grade_tolerances(nominal_mm: float) -> dict[str, float]:
    """Tolerance in mm of each grade IT01 to IT18 at a nominal, from the narrowest.

    IT01, IT0 and IT1 are linear in D, IT2 to IT4 a geometric series between IT1 and IT5, from IT5 on
    multiples of the tolerance unit.
    """
    coarse = [units * tolerance_unit(nominal_mm) for units in GRADE_UNITS]
    finest = [1e-3 * (a + b * nominal_mm) for a, b in ((0.3, 0.008), (0.5, 0.012), (0.8, 0.020))]
    between = [finest[-1] * (coarse[0] / finest[-1]) ** (step / 4) for step in (1, 2, 3)]
    names = ["IT01", *(f"IT{number}" for number in range(19))]
    return dict(zip(names, [*finest, *between, *coarse], strict=True))


def faults(chain: Chain) -> list[str]:
    """What is wrong with a chain, one sentence a fault with key, value and mend; empty if nothing is."""
    found = [fault for link in chain.link for fault in _link_faults(link, chain.allocate)]
    lower, upper = chain.closing_link.lower_mm, chain.closing_link.upper_mm
    if lower >= upper:
        found.append(f"closing_link.lower_mm = {lower:g}: must be below upper_mm = {upper:g}; swap them")
    counts = Counter(link.name for link in chain.link)
    repeated = [name for name, count in counts.items() if count > 1]
    found += [f'link.name = "{name}": used {counts[name]} times; name each once' for name in repeated]
    free = [link for link in chain.link if not link.fixed]
    bare = [link.name for link in free if link.upper_mm is None and link.lower_mm is None]
    if bare and len(bare) < len(free):
        found.append(
            f'link "{bare[0]}": no deviations, while other links that are not fixed have them; give all or '
            "none, or set fixed = true on those given"
        )
    return found + _allocation_faults(chain, [link.name for link in free])


def _link_faults(link: Link, rule: Allocate) -> list[str]:
    bare = link.upper_mm is None and link.lower_mm is None
    half = (link.upper_mm is None) != (link.lower_mm is None)
    lower, upper, mean = link.lower_mm or 0.0, link.upper_mm or 0.0, link.mean_mm
    shaped = link.distribution in ("uniform", "triangular")
    checks = [
        (link.coefficient == 0, "coefficient = 0: must not be zero; set it or remove the link"),
        (half, "only one of upper_mm and lower_mm is given; give both or neither"),
        (link.fixed and bare, "fixed = true without deviations; give upper_mm and lower_mm or unfix it"),
        (not half and lower > upper, f"lower_mm = {lower:g}: exceeds upper_mm = {upper:g}; swap them"),
        (
            not link.fixed and (rule.method == "iso286" or rule.grades) and link.nominal_mm <= 0,
            f"nominal_mm = {link.nominal_mm:g}: ISO 286 needs it positive; allocate otherwise or fix it",
        ),
        (mean is not None and bare, f"mean_mm = {mean}: needs deviations; give upper_mm and lower_mm"),
        (mean is not None and shaped, f'mean_mm = {mean}: not for "{link.distribution}"; remove it'),
        (
            mean is not None and not (bare or half) and not lower <= mean <= upper,
            f"mean_mm = {mean}: is a deviation from the nominal; put it between lower_mm and upper_mm",
        ),
    ]
    return [f'link "{link.name}": {sentence}' for bad, sentence in checks if bad]


def _allocation_faults(chain: Chain, free: list[str]) -> list[str]:
    if not free:
        return ["link.fixed = true on every link: nothing is left to allocate; unfix at least one"]
    found = []
    adjust = chain.allocate.adjust
    if adjust is not None and adjust not in free:
        kind = "is fixed" if any(link.name == adjust for link in chain.link) else "is no link"
        found.append(f'allocate.adjust = "{adjust}": {kind}; name one of {", ".join(free)}')
    width, consumed = _width(chain), _consumed(chain)
    if consumed > 0 and 0 < width <= consumed + SLACK:
        found.append(
            f"link.fixed = true: the fixed links consume {consumed:.4f} mm of the closing link's {width:.4f} "
            "mm; narrow or unfix one, or widen the limits"
        )
    return found


def _part(link: Link) -> Part:
    upper, lower = link.upper_mm or 0.0, link.lower_mm or 0.0
    mean = (upper + lower) / 2 if link.mean_mm is None else link.mean_mm
    return Part(link.name, link.coefficient, link.nominal_mm, upper, lower, link.distribution, mean)


def _allocated(link: Link, tolerance: float, snap: bool) -> Part:
    grade = None
    if snap:
        fitting = {name: t for name, t in grade_tolerances(link.nominal_mm).items() if t <= tolerance + SLACK}
        grade, tolerance = max(fitting.items(), key=lambda item: item[1], default=(None, tolerance))
    upper, lower = (0.0, -tolerance) if link.coefficient > 0 else (tolerance, 0.0)
    upper, lower = round(upper, DIGITS), round(lower, DIGITS)
    mean = (upper + lower) / 2
    return Part(link.name, link.coefficient, link.nominal_mm, upper, lower, link.distribution, mean, grade)


def _width(chain: Chain) -> float:
    return chain.closing_link.upper_mm - chain.closing_link.lower_mm


def _consumed(chain: Chain) -> float:
    """Share of the closing link's tolerance, mm, that the fixed links take."""
    fixed = [_part(link) for link in chain.link if link.fixed]
    return _total([abs(part.coefficient) * part.tolerance_mm for part in fixed], chain.allocate.mode)


def _total(tolerances: Sequence[float], mode: Mode) -> float:
    return sum(tolerances) if mode == "worst_case" else sqrt(sum(t * t for t in tolerances))


def _yields(parts: Sequence[Part], limits: ClosingLink, samples: int, seed: int) -> dict[str, float]:
    """Share within the limits by Monte Carlo; all distributions share one set of random numbers."""
    kinds: dict[str, Distribution | None] = {"as_given": None}
    kinds |= {"normal": "normal", "truncated_normal": "truncated_normal", "uniform": "uniform"}
    closing = {key: np.zeros(samples) for key in kinds}
    generator = np.random.default_rng(seed)
    for part in parts:
        probability = generator.random(samples)
        for key, kind in kinds.items():
            size = part.nominal_mm + _quantile(part, kind or part.distribution, probability)
            closing[key] += part.coefficient * size
    low, high = limits.lower_mm - SLACK, limits.upper_mm + SLACK
    return {key: float(((low <= sums) & (sums <= high)).mean()) for key, sums in closing.items()}


def _quantile(part: Part, kind: Distribution, probability: Array) -> Array:
    """Deviation from the nominal, mm, below which a part lies with each probability."""
    lower, width = part.lower_mm, part.tolerance_mm
    sigma = width / 6
    values: Array
    if sigma == 0:
        values = np.full_like(probability, lower)
    elif kind == "uniform":
        values = lower + width * probability
    elif kind == "triangular":
        root = np.sqrt(np.minimum(probability, 1 - probability) / 2)
        values = lower + width * np.where(probability < 0.5, root, 1 - root)
    else:
        if kind == "truncated_normal":
            below, above = ndtr((lower - part.mean_mm) / sigma), ndtr((part.upper_mm - part.mean_mm) / sigma)
            probability = below + (above - below) * probability
        values = part.mean_mm + sigma * ndtri(probability)
    return values


def _standard_error(share: float, samples: int) -> float:
    return sqrt(share * (1 - share) / samples + 1 / (4 * samples**2)) / (1 + 1 / samples)


def _contributions(parts: Sequence[Part]) -> dict[str, dict[str, float]]:
    spread = [part.coefficient**2 * _variance(part) for part in parts]
    reach = [abs(part.coefficient) * part.tolerance_mm for part in parts]
    return {
        part.name: {
            "variance_percent": 100 * variance / (sum(spread) or 1.0),
            "worst_case_percent": 100 * width / (sum(reach) or 1.0),
        }
        for part, variance, width in zip(parts, spread, reach, strict=True)
    }


def _variance(part: Part) -> float:
    width, sigma = part.tolerance_mm, part.tolerance_mm / 6
    if part.distribution == "truncated_normal" and sigma > 0:
        low, high = (part.lower_mm - part.mean_mm) / sigma, (part.upper_mm - part.mean_mm) / sigma
        return sigma**2 * float(truncnorm.var(low, high))
    return width**2 / {"uniform": 12, "triangular": 24}.get(part.distribution, 36)


def _status(chain: Chain, parts: list[Part], allocation: list[Part], share: float) -> str:
    if parts is allocation:
        return "ok: deviations allocated"
    limits, mode = chain.closing_link, chain.allocate.mode
    low, high = interval(parts, mode)
    if limits.lower_mm - SLACK <= low and high <= limits.upper_mm + SLACK:
        return "ok"
    nearest = ", ".join(
        f"{part.name} {part.nominal_mm:.4f} {_signed(part.upper_mm)}/{_signed(part.lower_mm)}"
        for part in allocation
    )
    kind = "worst-case" if mode == "worst_case" else "RSS"
    return (
        f"refused: the given deviations put the closing link at {low:+.4f} to {high:+.4f} mm where "
        f"{limits.lower_mm:.4f} to {limits.upper_mm:.4f} mm is allowed ({kind} tolerance {high - low:.4f} mm "
        f"where {_width(chain):.4f} mm is there, yield {share:.4g}); the nearest that fits is {nearest}"
    )


def _signed(deviation: float) -> str:
    return f"{deviation:+.4f}" if deviation else "0"
