"""Selective assembly: two parts sorted into classes and matched class by class.

Where their coefficients have opposite signs a large one goes with a large one, otherwise with a small one. A class
in which one part is scarcer leaves the surplus of the other unmatched (Mansoor, Selective assembly: its analysis and
applications, 1961).
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from doe.dimension_chain.closing import ClosingFunction, interval, middle
from doe.dimension_chain.links import DIGITS, SLACK, ClosingLink, Interval, Part, Selective
from doe.dimension_chain.yields import quantile, standard_error
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.records import Record, derived, keyed

MOST_CLASSES = 100


class SelectiveAssembly(Record):
    """What matching in classes gives.

    ``matched`` is the share of the pairs made of which each class holds both parts; ``good`` the share of the matched
    assemblies within the limits, with its ``standard_error``, ``random`` that of assemblies at random. The yield of
    the ``whole`` is matched times good. ``worst_case_mm`` holds over all classes, ``edges_mm`` are the sizes at which
    each part is sorted. ``classes_needed``: the fewest classes whose worst case keeps the limits, None above 100.
    """

    classes: int
    whole: float = derived(lambda self: self.matched * self.good, "yield")
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
    function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink, wish: Selective
) -> SelectiveAssembly:
    """Sort, match and judge ``wish.samples`` of every part; see `SelectiveAssembly`."""
    generator = np.random.default_rng(wish.seed)
    sizes = {}
    for part in parts:
        sizes[part.name] = part.nominal_mm + quantile(part, part.distribution, generator.random(wish.samples))
    pair = _pair(parts, wish)
    edges = [class_edges(part, wish.classes, wish.by) for part in pair]
    chosen = _matches([sizes[part.name] for part in pair], edges, _opposed(function, parts, pair))
    closing = np.asarray(function.value(sizes))
    # What is not sorted comes as it comes.
    mates = {part.name: sizes[part.name][index] for part, index in zip(pair, chosen, strict=True)}
    matched = np.asarray(function.value({name: x[: len(chosen[0])] for name, x in sizes.items()} | mates))
    good, random = _good(matched, limits), _good(closing, limits)
    return SelectiveAssembly(
        classes=wish.classes,
        matched=len(matched) / wish.samples,
        good=good,
        random=random,
        standard_error=standard_error(good, max(len(matched), 1)),
        matched_deviation_mm=float(matched.std()) if len(matched) else 0.0,
        random_deviation_mm=float(closing.std()),
        worst_case_mm=class_worst_case(function, parts, wish),
        edges_mm={part.name: np.round(each, DIGITS).tolist() for part, each in zip(pair, edges, strict=True)},
        classes_needed=_classes_needed(function, parts, limits, wish),
    )


def class_edges(part: Part, classes: int, by: str) -> Array:
    """Sizes (classes + 1,), mm, that part the classes, from the lower to the upper limit of the part.

    What a normal part has beyond its limits belongs to the first and the last class.
    """
    places = np.linspace(0.0, 1.0, classes + 1)
    if by == "width" or part.tolerance_mm == 0:
        deviations = part.lower_mm + part.tolerance_mm * places
    else:
        deviations = np.clip(quantile(part, part.distribution, places), part.lower_mm, part.upper_mm)
        deviations[[0, -1]] = part.lower_mm, part.upper_mm
    return part.nominal_mm + deviations


def class_worst_case(function: ClosingFunction, parts: Sequence[Part], wish: Selective) -> Interval:
    """Least and greatest closing link, mm, of parts within their limits matched class by class."""
    pair = _pair(parts, wish)
    edges = [class_edges(part, wish.classes, wish.by) for part in pair]
    bounds = [list(pairwise(each.tolist())) for each in edges]
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


def _classes_needed(
    function: ClosingFunction, parts: Sequence[Part], limits: ClosingLink, wish: Selective
) -> int | None:
    def enough(classes: int) -> bool:
        low, high = class_worst_case(function, parts, wish.model_copy(update={"classes": classes}))
        return limits.lower_mm - SLACK <= low and high <= limits.upper_mm + SLACK

    # More classes never widen the worst case.
    fewest = 1 + bisect_left(range(1, MOST_CLASSES + 1), True, key=enough)
    return fewest if fewest <= MOST_CLASSES else None


def _pair(parts: Sequence[Part], wish: Selective) -> tuple[Part, Part]:
    by_name = {part.name: part for part in parts}
    return by_name[wish.first], by_name[wish.second]


def _opposed(function: ClosingFunction, parts: Sequence[Part], pair: Sequence[Part]) -> bool:
    """Whether the two parts work against each other, so that large goes with large."""
    slopes = function.sensitivities(middle(parts))
    first, second = (slopes[part.name] for part in pair)
    return first * second < 0


def _matches(sizes: Sequence[Array], edges: Sequence[Array], opposed: bool) -> tuple[Rows, Rows]:
    """Indices of the first and second parts that go together, class by class, the surplus left out."""
    classes = len(edges[0]) - 1
    sorted_in = [np.searchsorted(edge[1:-1], size) for edge, size in zip(edges, sizes, strict=True)]
    if not opposed:
        sorted_in[1] = classes - 1 - sorted_in[1]
    order = [np.argsort(each, kind="stable") for each in sorted_in]
    starts = [np.concatenate(([0], np.bincount(each, minlength=classes).cumsum())) for each in sorted_in]
    matched: tuple[list[Rows], list[Rows]] = ([], [])
    for index in range(classes):
        scarce = min(int(start[index + 1] - start[index]) for start in starts)
        for taken, each, start in zip(matched, order, starts, strict=True):
            taken.append(each[start[index] : start[index] + scarce])
    return np.concatenate(matched[0]), np.concatenate(matched[1])


def _good(closing: Array, limits: ClosingLink) -> float:
    if not len(closing):
        return 0.0
    inside = (limits.lower_mm - SLACK <= closing) & (closing <= limits.upper_mm + SLACK)
    return float(inside.mean())
