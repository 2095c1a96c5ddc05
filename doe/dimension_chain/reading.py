"""Chains from TOML, one or several with names in a file, and their faults, one sentence each with key, value and fix."""

from collections import Counter
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from doe.dimension_chain.allocation import Allocation
from doe.dimension_chain.closing import NoValueError, is_part, press_fit_factor, quotation, used_links
from doe.dimension_chain.links import Chain, Link, coded_limits
from rbdyn.base.faults import MethodError, Strict, read_toml, refuse, validated
from rbdyn.base.words import all_of
from rbdyn.properties.tolerances import LARGEST, position_limits


def faults(chain: Chain) -> list[str]:
    """All faults of a chain; empty if there is none."""
    used = _used(chain.link)
    sentences = [fault for link in chain.link for fault in _link_faults(link, chain, link.name in used)]
    lower, upper = chain.closing_link.lower_mm, chain.closing_link.upper_mm
    if lower >= upper:
        sentences.append(f"closing_link.lower_mm = {lower:g}: must be below upper_mm = {upper:g}; swap them")
    counts = Counter(link.name for link in chain.link)
    repeated = [name for name, count in counts.items() if count > 1]
    sentences += [f'link.name = "{name}": used {counts[name]} times; name each once' for name in repeated]
    sentences += _reference_faults(chain) + _selective_faults(chain)
    sentences += _allocation_faults(chain, [link.name for link in chain.free if link.coefficient or link.name in used])
    # Whether the parts can close the chain is defined only for one without other faults.
    try:
        return sentences or _closing_faults(chain)
    except NoValueError as error:
        return [str(error)]


def _used(links: list[Link]) -> set[str]:
    names: set[str] = set()
    for link in links:
        # An invalid expression may use any link.
        unread = _sentence(partial(used_links, link)) is not None
        names |= {other.name for other in links} if unread else set(used_links(link))
    return names


def _link_faults(link: Link, chain: Chain, used: bool) -> list[str]:
    if not link.is_dimension:
        return _function_faults(link)
    rule = chain.allocate
    bare = not link.has_deviations and link.lower_mm is None
    half = (link.upper_mm is None) != (link.lower_mm is None)
    lower, upper, mean = link.lower_mm or 0.0, link.upper_mm or 0.0, link.mean_mm
    shaped = link.distribution in ("uniform", "triangular")
    free, iso = link in chain.free, rule.method == "iso286" or rule.grades
    lettered = link.position not in ("unilateral", "symmetric")
    size, idle = f"nominal_mm = {link.nominal:g}", link.coefficient == 0 and not used
    large = free and rule.grades and link.nominal > LARGEST
    priceless = free and rule.method == "cost" and link.cost is None
    twice = link.fit is not None and (link.upper_mm is not None or link.lower_mm is not None)
    checks = [
        (link.nominal_mm is None, "nominal_mm: missing; add it"),
        (idle, "coefficient = 0: must not be zero; set it, remove the link, or use it in a function"),
        (half, "only one of upper_mm and lower_mm is given; give both or neither"),
        (link.fixed and bare, "fixed = true without deviations; give upper_mm and lower_mm or unfix it"),
        (not half and lower > upper, f"lower_mm = {lower:g}: exceeds upper_mm = {upper:g}; swap them"),
        (free and iso and link.nominal <= 0, f"{size}: ISO 286 needs it positive; allocate otherwise or fix it"),
        (large, f"{size}: the grades here end at {LARGEST} mm; set grades = false or fix it"),
        (priceless, 'method = "cost" needs a curve; give cost = { b = ..., k = ... } or fix it'),
        (mean is not None and bare, f"mean_mm = {mean}: needs deviations; give upper_mm and lower_mm"),
        (mean is not None and shaped, f'mean_mm = {mean}: not for "{link.distribution}"; remove it'),
        (twice, f'fit = "{link.fit}": already sets the deviations; remove upper_mm and lower_mm, or the fit'),
    ]
    sentences = [sentence for bad, sentence in checks if bad]
    if link.fit is not None and (unknown := _sentence(lambda: coded_limits(link))):
        sentences.append(f'fit = "{link.fit}": {unknown}')
    elif link.fit is not None:
        lower, upper = coded_limits(link)
    if mean is not None and not (bare or half) and not lower <= mean <= upper:
        sentences.append(f"mean_mm = {mean}: is a deviation from the nominal; put it between lower_mm and upper_mm")
    if free and lettered and (outside := _sentence(lambda: position_limits(link.nominal, link.position, 0.0))):
        sentences.append(f'position = "{link.position}": {outside}')
    return [f'link "{link.name}": {sentence}' for sentence in sentences]


def _function_faults(link: Link) -> list[str]:
    """Faults of a link that is a function, such as keys of a dimension."""
    kinds = [key for key in ("press_fit", "thermal_growth", "expression") if getattr(link, key) is not None]
    sentences = [f"{all_of(kinds)} contradict; a link is one of them"] if len(kinds) > 1 else []
    alien = [key for key in ("nominal_mm", "upper_mm", "lower_mm", "fit", "mean_mm", "cost") if getattr(link, key)]
    sentences += [f"{key} = {getattr(link, key)}: a link of kind {kinds[0]} has none; remove it" for key in alien]
    rise = link.thermal_growth
    if rise and rise.lower_K > rise.upper_K:
        sentences.append(f"lower_K = {rise.lower_K:g}: exceeds upper_K = {rise.upper_K:g}; swap them")
    if unread := _sentence(lambda: used_links(link)):
        sentences.append(f"expression = {quotation(link.expression or '')}: {unread}")
    return [f'link "{link.name}": {sentence}' for sentence in sentences]


def _reference_faults(chain: Chain) -> list[str]:
    """Faults of functions: unknown links, later links, and links that do not fit the function."""
    sentences = []
    before: dict[str, Link] = {}
    for link in chain.link:
        if _sentence(partial(used_links, link)) is None:
            names = used_links(link)
            sentences += [
                f'link "{link.name}": uses "{name}", which is not an earlier link; name one of '
                f"{', '.join(before) or 'those placed before it'}"
                for name in names
                if name not in before
            ]
            grown = link.thermal_growth and before.get(link.thermal_growth.of)
            if grown and not (grown.is_dimension and grown.nominal > 0):
                sentences.append(
                    f'link "{link.name}": thermal_growth.of = "{grown.name}": must be a positive dimension'
                )
        bore = link.press_fit and before.get(link.press_fit.bore)
        if link.press_fit and bore and (wrong := _sentence(partial(press_fit_factor, link.press_fit, bore.nominal))):
            sentences.append(f'link "{link.name}": press_fit: {wrong}')
        before.setdefault(link.name, link)
    return sentences


def _selective_faults(chain: Chain) -> list[str]:
    if chain.selective is None:
        return []
    parts = [link.name for link in chain.link if is_part(link)]
    pair = {"first": chain.selective.first, "second": chain.selective.second}
    alien = {key: name for key, name in pair.items() if name not in parts}
    sentences = [
        f'selective.{key} = "{name}": is not a part; name one of {", ".join(parts)}' for key, name in alien.items()
    ]
    if pair["first"] == pair["second"]:
        sentences.append(f'selective.second = "{pair["second"]}": is the first part too; name another')
    return sentences


def _allocation_faults(chain: Chain, free: list[str]) -> list[str]:
    if not free:
        return ["link.fixed = true on every link: no tolerance is left to allocate; unfix at least one link"]
    adjust = chain.allocate.adjust
    if adjust is not None and adjust not in free:
        if any(link.name == adjust for link in chain.link):
            return [f'allocate.adjust = "{adjust}": is fixed; name one of {", ".join(free)}']
        return [f'allocate.adjust = "{adjust}": is not a link; name one of {", ".join(free)}']
    return []


def _closing_faults(chain: Chain) -> list[str]:
    """Faults of parts that cannot bring the closing link to its limits, or do not change it."""
    if chain.is_stated and not any(link.fit is None for link in chain.free):
        return []
    search = Allocation(chain)
    if lost := _sentence(partial(search.parts, {link.name: 0.0 for link in chain.free})):
        return [f'allocate.adjust = "{search.adjusted.name}": {lost}']
    idle = _sentence(search.linear_rule)
    return [f'allocate.method = "{chain.allocate.method}": {idle}'] if idle else []


def _sentence(attempt: Callable[[], object]) -> str | None:
    """Message of a MethodError, None without one; a NoValueError, which names its link, passes on."""
    try:
        attempt()
    except NoValueError:
        raise
    except MethodError as error:
        return str(error)
    return None


class NamedChain(Chain):
    """A chain among others."""

    name: Annotated[str, Field(min_length=1)]
    """Name of the chain."""


class Chains(Strict):
    """A file of several chains."""

    chain: Annotated[list[NamedChain], Field(min_length=1)]
    """Dimension chains of this file."""


def chain_from(data: Mapping[str, Any], source: str) -> Chain:
    """Build a chain from a table; ``source`` names the file in the messages of InputError."""
    chain = validated(Chain, data, source)
    refuse(f"{source}: {fault}" for fault in faults(chain))
    return chain


def is_several(path: Path | str) -> bool:
    """Whether a TOML file has several chains with names. Raises InputError where it cannot be read."""
    return "chain" in read_toml(path)


def read_chains(path: Path | str) -> dict[str, Chain]:
    """The chains of a TOML file by name; a single chain has the name of the file.

    Raises InputError with the faults of all chains at once.
    """
    path = Path(path)
    data, source = read_toml(path), str(path)
    if "factor" in data:
        fault = "is a study, whose chains follow its selected clearances; run doe study, or write its chains to their own file"
        refuse([f"{source}: {fault}"])
    if "chain" not in data:
        return {path.stem: chain_from(data, source)}
    chains = validated(Chains, data, source).chain
    counts = Counter(chain.name for chain in chains)
    sentences = [f'chain.name = "{name}": used {n} times; name each once' for name, n in counts.items() if n > 1]
    sentences += [f'chain "{chain.name}": {fault}' for chain in chains for fault in faults(chain)]
    refuse(f"{source}: {fault}" for fault in sentences)
    return {chain.name: chain for chain in chains}
