"""Pictures of fronts: pairs of responses, parallel coordinates, the course of the search."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import combinations

from doe.report.sections.plot import Plot, Point, Range, legend, span, symbol, tick_text, ticks, wide_svg
from doe.report.sections.record import Factor, Record, part
from doe.report.words import half_width
from rbdyn.base.words import label, quantity, shown

# Shape and role in the style sheet.
MARKS = {
    "baseline": ("square", "baseline"),
    "pick": ("star", "pick"),
    "knee": ("diamond", "knee"),
    "desirability": ("triangle", "desirability"),
    "weights": ("down", "weights"),
    "without tolerances": ("plus", "plain"),
}
OTHER = ("hexagon", "other")
WIDE, HIGH, LEFT, TOP, BOTTOM = 760.0, 260.0, 46.0, 40.0, 30.0


@dataclass(frozen=True)
class Front:
    """A set of points to look through; ``role`` tells them apart in pictures, ``first`` is the number of its first point."""

    role: str
    words: str
    points: list[Record]
    first: int


def pairs(
    names: Sequence[str],
    sets: Sequence[Front],
    marks: Mapping[str, Record],
    confirmed: Mapping[str, Record],
    bounds: Mapping[str, Sequence[float]],
) -> list[str]:
    """A picture for every pair of responses, with the ``bounds`` of either; points are numbered through all sets."""
    drawn = []
    for one, two in combinations(names, 2):
        simulated = {name: found for name, point in confirmed.items() if (found := _simulated(point, one, two))}
        whole = [_pair(point, one, two) for point in [*marks.values(), *(p for each in sets for p in each.points)]]
        whole += [place for place, _ in simulated.values()]
        across, up = bounds.get(one, ()), bounds.get(two, ())
        ranges = span([*(x for x, _ in whole), *across]), span([*(y for _, y in whole), *up])
        plot = Plot(*ranges, (label(one), label(two)))
        for bound in across:
            plot.line([(bound, plot.y[0]), (bound, plot.y[1])], "limit")
        for bound in up:
            plot.line([(plot.x[0], bound), (plot.x[1], bound)], "limit")
        for each in sets:
            plot.dots([_pair(point, one, two) for point in each.points], each.role, first=each.first)
        for name, point in marks.items():
            plot.symbol(_pair(point, one, two), *_mark(name), name)
        for name, (place, error) in simulated.items():
            shape, role = _mark(name)
            plot.cross(place, error, f"error {role}")
            plot.symbol(place, shape, f"hollow {role}", f"{name}, simulated")
        plot.marks.append('<circle class="chosen" r="7" cx="-50" cy="-50"/>')
        drawn.append(plot.svg(f"Front: {quantity(two)[0]} on {quantity(one)[0]}", ' data-front="pair"'))
    return drawn


def _pair(point: Record, one: str, two: str) -> Point:
    return point["responses"][one], point["responses"][two]


def _simulated(point: Record, one: str, two: str) -> tuple[Point, tuple[float | None, float | None]] | None:
    found = [part(point, "responses", name) or {} for name in (one, two)]
    x, y = (each.get("value") for each in found)
    return None if x is None or y is None else ((x, y), (half_width(found[0]), half_width(found[1])))


def _mark(name: str) -> tuple[str, str]:
    """Shape and role of a point."""
    return MARKS.get(name.replace("_", " "), OTHER)


def legend_of(
    sets: Sequence[Front], marks: Mapping[str, Record], confirmed: Mapping[str, Record], limited: bool
) -> str:
    """What the symbols of the pictures mean."""
    entries = [("dot", each.role, f"front {each.words}") for each in sets]
    entries += [(*_mark(name), name) for name in marks]
    hollow = ((*_mark(name), name.replace("_", " ")) for name in confirmed)
    entries += [(shape, f"hollow {role}", f"{words}, simulated") for shape, role, words in hollow]
    return legend(entries + [("line", "limit", "limit")] * limited)


def parallel(given: Sequence[Factor], names: Sequence[str], sets: Sequence[Front], marks: Mapping[str, Record]) -> str:
    """Parallel coordinates: an axis for each factor and response, a line for each point."""
    keys = [("factors", each.name) for each in given] + [("responses", name) for name in names]
    points = [point for each in sets for point in each.points]
    axes = [(kind, name, span((p[kind][name] for p in [*points, *marks.values()]), 0.02)) for kind, name in keys]
    parts = []
    for each in sets:
        for number, point in enumerate(each.points):
            parts.append(f'<polyline class="thread {each.role}" data-point="{each.first + number}" points="{_thread(point, axes)}"/>')  # fmt: skip
    for name, point in marks.items():
        if name in ("baseline", "pick"):
            corners, (shape, role) = _thread(point, axes), _mark(name)
            parts.append(f'<polyline class="thread mark {role}" points="{corners}"><title>{name}</title></polyline>')  # fmt: skip
            for corner in corners.split():
                u, v = (float(x) for x in corner.split(","))
                parts.append(symbol(u, v, shape, role, 4.0, name))
    parts.append('<polyline class="thread chosen" points=""/>')
    parts += [_axis(number, len(axes), name, limits) for number, (_, name, limits) in enumerate(axes)]
    words = f"Parallel coordinates of {len(points)} points of the front"
    return wide_svg(WIDE, HIGH, words, parts, ' data-front="parallel"')


def _across(number: int, axes: int) -> float:
    return LEFT + (WIDE - 2.0 * LEFT) * (number + 0.5) / axes


def _thread(point: Record, axes: Sequence[tuple[str, str, Range]]) -> str:
    corners = []
    for number, (kind, name, (low, high)) in enumerate(axes):
        v = TOP + (HIGH - TOP - BOTTOM) * (high - point[kind][name]) / (high - low)
        corners.append(f"{_across(number, len(axes)):.0f},{v:.1f}")
    return " ".join(corners)


def _axis(number: int, axes: int, name: str, limits: Range) -> str:
    u = _across(number, axes)
    # Names in two lines by turns, so that long ones keep apart.
    line = 14 + 18 * (number % 2)
    parts = [f'<line class="frame" x1="{u:.1f}" x2="{u:.1f}" y1="{TOP}" y2="{HIGH - BOTTOM}"/>']
    parts.append(f'<text class="axis" x="{u:.1f}" y="{line}" text-anchor="middle">{escape(label(name))}</text>')
    values = ticks(*limits, 4)
    for value in values:
        v = TOP + (HIGH - TOP - BOTTOM) * (limits[1] - value) / (limits[1] - limits[0])
        parts.append(f'<line class="frame" x1="{u - 3:.1f}" x2="{u:.1f}" y1="{v:.1f}" y2="{v:.1f}"/>')
        parts.append(f'<text class="beside" x="{u - 5:.1f}" y="{v + 4:.1f}" text-anchor="end">{tick_text(value, values)}</text>')  # fmt: skip
    return "".join(parts)


def hypervolume(history: Sequence[float]) -> str:
    """Hypervolume by generation."""
    plot = Plot((0.0, float(len(history))), span(history), ("generation", "hypervolume"), width=420.0, height=220.0)
    plot.line([(float(number), value) for number, value in enumerate(history, 1)], "front")
    return plot.svg(f"Hypervolume rises from {shown(history[0])} to {shown(history[-1])} in {len(history)} generations")
