"""A chain that misses its limits: by how much, why, and whether a yield or selective assembly would meet them."""

from collections.abc import Callable, Sequence

from doe.dimension_chain.allocation import SAMPLES, Allocation, cheapest
from doe.dimension_chain.closing import interval, middle
from doe.dimension_chain.links import SLACK, Chain, ClosingLink, Mode, Part, Selective, stated_parts
from doe.dimension_chain.yields import SelectiveAssembly, classes_needed, moments, standard_error
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record

FEWEST_CLASSES = 2
# Largest yield that random assemblies can show to be reached, two standard errors below 1.
SURE_YIELD = 1.0 - 2.0 * standard_error(1.0, SAMPLES)
# Whether a changed chain is accepted, and its matched assemblies where only they keep the limits.
Judge = Callable[[Chain], tuple[bool, SelectiveAssembly | None]]


class Miss(Record):
    """By how much the closing link misses, mm: beyond the lower and the upper limit, and its tolerance beyond their distance.

    ``mode``: criterion of the chain. ``yield_short``: share of the assemblies that a yield misses; None in other modes.
    """

    mode: Mode
    below_mm: float
    above_mm: float
    width_mm: float
    yield_short: float | None


class Remedy(Record):
    """What would meet a refused chain, in a sentence with the keys to write.

    ``mode_yield``: yield with mode = "yield", None where the chain has it; ``mode_yield_meets``: whether that is the target.
    ``selective_yield``: share of the matched assemblies within the limits with ``selective_classes`` of the ``selective_pair``;
    None where two parts do not vary, or no number of classes meets the limits.
    """

    sentence: str
    mode_yield: float | None
    mode_yield_meets: bool
    selective_yield: float | None
    selective_classes: int | None
    selective_pair: tuple[str, str] | None


def miss_of(search: Allocation, parts: Sequence[Part], share: float) -> Miss:
    """The miss of judged parts whose yield is ``share``."""
    limits, mode = search.chain.closing_link, search.mode
    low, high = interval(search.function, parts, mode)
    return Miss(
        mode=mode,
        below_mm=max(limits.lower_mm - low, 0.0),
        above_mm=max(high - limits.upper_mm, 0.0),
        width_mm=max(high - low - search.chain.width_mm, 0.0),
        yield_short=max(search.chain.allocate.target_yield - share, 0.0) if mode == "yield" else None,
    )


def stated_reason(search: Allocation, parts: Sequence[Part], share: float, nearest: Sequence[Part] | None) -> str:
    """Why stated deviations miss the limits, and the nearest sizes that meet them, if there are any."""
    limits, mode, width = search.chain.closing_link, search.mode, search.chain.width_mm
    low, high = interval(search.function, parts, mode)
    free = {link.name for link in search.chain.free}
    as_stated = {part.name: part.text for part in parts}
    kind = "RSS" if mode == "rss" else "worst-case"
    reached = f"{share:.4g} of {search.chain.allocate.target_yield:g}" if mode == "yield" else f"{share:.4g}"
    changed = [part for part in nearest or () if part.name in free and part.text != as_stated[part.name]]
    sizes = ", ".join(f"{part.name} {part.text}" for part in changed)
    return (
        f"the given deviations put the closing link at {low:+.4f} to {high:+.4f} mm, outside {limits.lower_mm:.4f} to "
        f"{limits.upper_mm:.4f} mm; {kind} tolerance {high - low:.4f} of {width:.4f} mm, yield {reached}; "
        + (f"the nearest that fits is {sizes}" if sizes else "no sizes that are free to change fit")
    )


def allocated_reason(search: Allocation) -> str:
    """Why no tolerances can be allocated: the fixed links, the narrowest processes, or the resolution of the drawing."""
    chain, limits = search.chain, search.chain.closing_link
    bare = search.parts({link.name: 0.0 for link in chain.free})
    if search.mode == "yield" and not search.function.linear and chain.allocate.target_yield > SURE_YIELD:
        return (
            f"allocate.target_yield = {chain.allocate.target_yield:g}: {SAMPLES} random assemblies cannot show it for a chain with "
            f'functions; write at most {SURE_YIELD:g}, or mode = "worst_case"'
        )
    if search.mode == "yield" and (share := search.sure_yield(bare)) < chain.allocate.target_yield:
        low, high = search.tails(bare)
        return (
            f"allocate.target_yield = {chain.allocate.target_yield:g}: the fixed links alone give {share:.4g}; narrow or "
            f"unfix one, or widen the limits to more than {_interval(limits, high - low)}"
        )
    low, high = interval(search.function, bare, search.mode)
    if search.mode != "yield" and high - low > SLACK and chain.width_mm <= high - low + SLACK:
        return (
            f"the fixed links consume {high - low:.4f} mm of the closing link's {chain.width_mm:.4f} mm; narrow or unfix "
            f"one, or widen the limits to more than {_interval(limits, high - low)}"
        )
    if tight := _narrow_curves(search, high - low):
        return f"{tight}; widen the limits or permit narrower tolerances"
    low, high = interval(search.function, search.narrowest(), search.mode)
    return (
        f"rounded to allocate.resolution_mm = {search.resolution:g}, the narrowest tolerances put the closing link at "
        f"{low:.4f} to {high:.4f} mm, outside {limits.lower_mm:.4f} to {limits.upper_mm:.4f} mm; write a finer "
        "resolution_mm, or widen the limits"
    )


def _narrow_curves(search: Allocation, fixed: float) -> str:
    """Message on cost curves whose narrowest tolerances exceed the limits; empty for others."""
    chain = search.chain
    if chain.allocate.method != "cost" or search.mode == "yield":
        return ""
    width = chain.width_mm - fixed if search.mode == "worst_case" else (chain.width_mm**2 - fixed**2) ** 0.5
    slopes = search.function.sensitivities(middle(search.narrowest()))
    curves = [link.cost for link in chain.free if link.cost is not None]
    try:
        cheapest(curves, [slopes[link.name] for link in chain.free], width, search.mode)
    except MethodError as error:
        return str(error)
    return ""


def _interval(limits: ClosingLink, width: float) -> str:
    """Text of the limits with the same middle and another width."""
    middle_mm = (limits.lower_mm + limits.upper_mm) / 2
    return f"{middle_mm - width / 2:.4f} to {middle_mm + width / 2:.4f} mm"


def remedy_of(search: Allocation, parts: Sequence[Part], share: float, accepted: Judge) -> Remedy:
    """Whether mode = "yield", or selective assembly of two parts, would meet the limits that ``parts`` miss.

    ``share``: of their random assemblies within the limits. ``accepted``: judges a changed chain as it will be judged once its file has the change.
    """
    chain, target = search.chain, search.chain.allocate.target_yield
    reached, meets = None, False
    if search.mode != "yield":
        changed = chain.model_copy(update={"allocate": chain.allocate.model_copy(update={"mode": "yield"})})
        meets = accepted(changed)[0]
        reached = share if chain.is_stated and not search.function.linear else _yield_of(changed)
    selective = _selective(search, parts, accepted)
    sentences = [
        *([_yield_sentence(reached, target)] if meets and reached is not None else []),
        *([_selective_sentence(chain, *selective)] if selective is not None else []),
    ]
    if not sentences:
        other = "" if reached is None else f'mode = "yield" (yield {reached:.4g} of {target:g}) nor '
        sentences = [f"{'Neither' if other else 'No'} {other}selective assembly meets the limits."]
    return Remedy(
        sentence=" ".join(sentences),
        mode_yield=reached,
        mode_yield_meets=meets,
        selective_yield=None if selective is None else selective[1].good,
        selective_classes=None if selective is None else selective[1].classes,
        selective_pair=None if selective is None else (selective[0].first, selective[0].second),
    )


def _yield_sentence(reached: float, target: float) -> str:
    return f'Write mode = "yield" under allocate to meet the limits: a yield of {reached:.6f}, where target_yield is {target:g}.'


def _selective_sentence(chain: Chain, settings: Selective, assembly: SelectiveAssembly) -> str:
    pair = f'first = "{settings.first}", second = "{settings.second}"'
    table = f"selective = {{ {pair}, classes = {settings.classes} }}"
    if chain.selective is not None:
        table = f"classes = {settings.classes} under selective"
    return (
        f"Write {table} to meet the limits by matching: a yield of {assembly.good:.6f} of the pairs, "
        f"with {100 * assembly.matched:.1f} % of the parts paired."
    )


def _yield_of(chain: Chain) -> float:
    """Yield by which a chain with mode = "yield" is judged: of its stated parts, or of those that this mode allocates."""
    search = Allocation(chain)
    try:
        return search.sure_yield(
            stated_parts(chain.link) if chain.is_stated else search.allocated() or search.narrowest()
        )
    except MethodError:
        return 0.0


def keeps_limits(chain: Chain, assembly: SelectiveAssembly) -> bool:
    """Whether matched parts keep the limits in the mode of the chain: in the worst case of all classes, or by their yield."""
    limits, (low, high) = chain.closing_link, assembly.worst_case_mm
    if chain.allocate.mode == "yield":
        return assembly.good >= chain.allocate.target_yield
    return limits.lower_mm - SLACK <= low and high <= limits.upper_mm + SLACK


def _selective(
    search: Allocation, parts: Sequence[Part], accepted: Judge
) -> tuple[Selective, SelectiveAssembly] | None:
    """The fewest classes of two parts that keep the limits: those of the chain, or the two that scatter most."""
    chain = search.chain
    slopes = search.function.sensitivities(middle(parts))
    spreads = {
        part.name: slopes[part.name] ** 2 * moments(part, part.distribution)[1]
        for part in parts
        if part.origin != "temperature"
    }
    varying = sorted((name for name, spread in spreads.items() if spread > SLACK**2), key=lambda name: -spreads[name])
    if chain.selective is None and len(varying) < FEWEST_CLASSES:
        return None
    settings = chain.selective or Selective(first=varying[0], second=varying[1], classes=FEWEST_CLASSES)
    candidates = [2, 3, 4, 6, 8, 12]
    if chain.allocate.mode != "yield":
        candidates = [
            max(count, FEWEST_CLASSES)
            for count in (classes_needed(search.function, parts, chain.closing_link, settings),)
            if count is not None
        ]
    for classes in candidates:
        changed = settings.model_copy(update={"classes": classes})
        _, matched = accepted(chain.model_copy(update={"selective": changed}))
        if matched is not None:
            return changed, matched
    return None
