"""Sections on fronts: points, picks, tolerances and their plots."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from html import escape
from itertools import combinations
from typing import TYPE_CHECKING, Any

from doe.report.sections.answer import tolerances
from doe.report.sections.plot import Plot, Range, legend, span, symbol, tick_text, ticks, wide_svg
from doe.report.sections.record import Factor, Record, factors, nearest, part, responses
from doe.report.sections.searches import in_few_runs
from doe.report.still import Point, Still
from doe.report.words import SENSES, change, half_width, share_with_interval
from rbdyn.base.blocks import Block, Bullets, Detail, Figures, Paragraph, Section, Table, Widget
from rbdyn.base.words import chance, counted, error_alone, label, quantity, shown, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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


def pair_plots(
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
            plot.dots([_pair(point, one, two) for point in each.points], each.role, each.first)
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


def hypervolume(history: Sequence[float]) -> Still:
    """Hypervolume by generation."""
    words = f"Hypervolume rises from {shown(history[0])} to {shown(history[-1])} in {len(history)} generations"
    return Still(words, partial(_hypervolume, history), width=400.0, height=220.0)


def _hypervolume(history: Sequence[float], axis: "Axes") -> None:
    axis.plot(range(1, len(history) + 1), history)
    axis.set(xlim=(0.0, len(history)), xlabel="generation", ylabel="hypervolume")


# Points of a front that are drawn; more cannot be told apart.
MOST_POINTS = 400


def fronts(summary: Record) -> list[Front]:
    """The front on the surfaces and those compared with it, each sorted by the first response and thinned."""
    names = [each["name"] for each in responses(summary)]
    found: list[Front] = []
    for role, words, points in (
        ("front", "on the surfaces", part(summary, "front", "front")),
        ("robust", "with tolerances", part(summary, "front", "tolerance_aware", "front")),
        ("direct", "found in few runs, simulated", part(summary, "adaptive", "front")),
    ):
        whole = [point for point in points or [] if complete(point, summary)]
        if not whole or not names:
            continue
        whole.sort(key=lambda point: point["responses"][names[0]])
        share = max(len(whole) / MOST_POINTS, 1.0)
        kept = [whole[int(number * share)] for number in range(round(len(whole) / share))]
        found.append(Front(role, words, kept, sum(len(each.points) for each in found)))
    return found


def complete(point: Record, summary: Record) -> bool:
    """Whether every factor and response of a point is known, so that it can be drawn."""
    values = [part(point, "factors", each.name) for each in factors(summary)]
    values += [part(point, "responses", each["name"]) for each in responses(summary)]
    return None not in values


def picks(summary: Record) -> dict[str, Record]:
    """Baseline and picks that the front names, by name; "pick" is the one that the study stands by.

    That is the pick of the front, or the one that reckons with tolerances; then the other goes "without tolerances".
    """
    plain = part(summary, "front", "pick")
    named = {"knee": part(summary, "front", "knee")} | (part(summary, "front", "picks") or {})
    named = {name.replace("_", " "): point for name, point in named.items() if point}
    chosen = nearest(summary, part(summary, "pick"), ({"": plain} if plain else {}) | named)
    if chosen and plain:
        overtaken = {name: point for name, point in named.items() if name != chosen}
        named = overtaken | {"without tolerances": plain, "pick": named[chosen]}
    elif plain:
        named["pick"] = plain
    # The surfaces at the pick itself, which stands on the resolution of the drawing.
    if rounded := part(summary, "pick_on_surfaces"):
        named["pick"] = rounded
    baseline = part(summary, "front", "baseline")
    return ({"baseline": baseline} if baseline else {}) | named


def front(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Pictures that answer to the pointer, the picks, and what they are compared with."""
    record = part(summary, "front")
    if not record:
        return None
    sets = fronts(summary)
    names = [each["name"] for each in responses(summary)]
    marks = picks(summary)
    blocks: list[Block] = []
    if sets and len(names) > 1:
        confirmed = part(summary, "confirmation") or {}
        drawn = {name: point for name, point in marks.items() if complete(point, summary)}
        blocks.append(Widget("front"))
        pairs = pair_plots(names, sets, drawn, confirmed, bounds(summary))
        blocks.append(Figures([*pairs, legend_of(sets, drawn, confirmed, bool(bounds(summary)))], "", "pairs"))
        caption = "Each line is a point of the front: its clearances to the left, its responses to the right."
        blocks.append(Figures([parallel(factors(summary), names, sets, drawn)], caption, "parallel"))
    where = "of the pick without tolerances" if "without tolerances" in marks else "of the pick"
    blocks += [_picks(summary, names, marks), _gains(f"Changes on the surfaces {where}", record.get("predicted_gains"))]
    blocks += [Paragraph(record.get("statement") or ""), *_doubt(record)]
    blocks += [_limits(record.get("constraints"), f"Limits on the surfaces {where}"), tolerances(summary)]
    blocks += [*_search(record), *_beside(summary), *_given_point(record)]
    return Section("front", "Pareto front", blocks)


def front_blocks(summary: Record) -> list[Block]:
    """What ``doe front`` says: the front as in a report, and every point of it to who asks for all."""
    names = [each["name"] for each in responses(summary)]
    points = {str(number): point for number, point in enumerate(part(summary, "front", "front") or [], 1)}
    every = replace(_picks(summary, names, points), caption="Every point of the front", detail=Detail.ALL)
    section = front(summary, {})
    return [every, *(section.blocks if section else ())]


def bounds(summary: Record) -> dict[str, list[float]]:
    """Limits of every response that has any."""
    given = {each["name"]: [each.get("lower"), each.get("upper")] for each in responses(summary)}
    return {name: [x for x in ends if x is not None] for name, ends in given.items() if ends != [None, None]}


def _picks(summary: Record, names: Sequence[str], marks: Mapping[str, Record]) -> Table:
    given = factors(summary)
    rows = [
        [
            name,
            *(each.text(part(point, "factors", each.name), 1) for each in given),
            *(with_error(part(point, "responses", response), part(point, "errors", response)) for response in names),
        ]
        for name, point in marks.items()
    ]
    header = ["point", *(label(each.name) for each in given), *map(label, names)]
    size = [len(part(summary, "front", "front") or []), part(summary, "front", "archive")]
    of = f", {size[0]} of {size[1]} points" if all(size) else ""
    return Table(f"Picks of the Pareto front on the surfaces{of} (95 % intervals of the mean)", header, rows)


def _gains(caption: str, gains: Record | None) -> Table:
    """Gains on the surfaces, and by how much two single runs would differ anyway."""
    rows = []
    for name, gain in (gains or {}).items():
        scatter = gain.get("single_run_scatter_percent")
        rows.append(
            (label(name), change(gain), str(gain.get("verdict") or ""), f"{error_alone(scatter)} %" if scatter else "")
        )
    header = ("response", "change", "verdict", "scatter of two single runs")
    return Table(caption, header, rows, text_columns=(2,))


def _doubt(record: Record) -> list[Block]:
    """What the choice flatters, how sure the pick dominates, and why it is the pick."""
    gains = record.get("predicted_gains") or {}
    luck = {name: gain.get("selection_optimism_percent") for name, gain in gains.items()}
    flattered = ", ".join(
        f"{quantity(name)[0]} {percent:+.2f} %" for name, percent in luck.items() if percent is not None
    )
    sentences = [f"Selection bias to expect in these gains: {flattered}." if flattered else ""]
    if sure := record.get("pick_dominates_baseline"):
        odds = with_error(sure.get("probability"), 1.96 * (sure.get("standard_error") or 0.0))
        pick = "the pick without tolerances" if record.get("tolerance_aware") else "the pick"
        drawn = f"On {sure['draws']} surfaces" if sure.get("draws") else "On surfaces"
        sentences.append(
            f"{drawn} drawn from their errors {pick} dominates the baseline with probability {odds} (error of the draws alone)."
        )
    reason = part(record, "pick", "reason")
    return [*map(Paragraph, sentences), Paragraph(f"Pick on the surfaces: {reason}." if reason else "", "small")]


def _limits(limits: Sequence[Record] | None, caption: str) -> Table:
    rows = [
        (
            f"{label(limit['response'])} {SENSES[limit['sense']]} {shown(limit['limit'])}",
            with_error(limit["value"], limit.get("error")),
            shown(limit.get("kept")),
            "" if limit.get("probability") is None else chance(limit["probability"]),
            shown(limit.get("demanded_probability")),
        )
        for limit in limits or []
        if {"response", "sense", "limit", "value"} <= set(limit)
    ]
    header = ("limit", "value", "kept by the value", "probability of keeping it", "demanded")
    return Table(caption, header, rows)


def _given_point(record: Record) -> list[Block]:
    """A point that was asked for, against the baseline and the front."""
    point = record.get("point")
    if not point:
        return []
    dominating, whole = point["dominated_by"], counted(len(record["front"]), "point")
    verb = "dominates" if dominating == 1 else "dominate"
    return [
        _gains("Changes on the surfaces of the point asked for", point["predicted_gains"]),
        Bullets([*point["sentences"], point["statement"]]),
        _limits(point["constraints"], "Limits on the surfaces at the point asked for"),
        Paragraph(f"{dominating} of the {whole} of the front {verb} it."),
    ]


def _search(record: Record) -> list[Block]:
    known = [
        f"{words} {shown(record[key])}"
        for key, words in (("generations", "generations"), ("evaluations", "evaluations"), ("seed", "seed"),
                           ("hypervolume", "hypervolume"), ("largest_hypervolume", "of at most"),
                           ("archive", "points in the archive"), ("feasible_share", "feasible share"))
        if record.get(key) is not None
    ]  # fmt: skip
    blocks: list[Block] = [Paragraph(f"NSGA-II: {', '.join(known)}.", "small")] if known else []
    history = [value for value in record.get("hypervolume_history") or [] if value is not None]
    if history and record.get("hypervolume") is not None:
        near = next((number for number, each in enumerate(history, 1) if each >= 0.99 * record["hypervolume"]), None)
        blocks.append(Paragraph(f"99 % of the hypervolume after generation {near}." if near else "", "small"))
    if len(history) > 2:
        blocks.append(Figures([hypervolume(history).svg], "Hypervolume by generation: flat at the end means found."))
    return blocks


def _beside(summary: Record) -> list[Block]:
    """The fronts found in other ways."""
    blocks: list[Block] = []
    if aware := part(summary, "front", "tolerance_aware"):
        blocks += _with_tolerances(summary, aware)
    return [*blocks, *in_few_runs(summary)]


def _with_tolerances(summary: Record, aware: Record) -> list[Block]:
    """What the responses are at the ends of the tolerances, what that costs, and whether the picks survive it."""
    names = [each["name"] for each in responses(summary)]
    widths = ", ".join(f"{label(name)} within ± {width:g}" for name, width in (aware.get("half_widths") or {}).items())
    share = aware.get("quantile")
    kind = "worst case" if share is None else f"{100 * share:g} % of the parts keep"
    pick, survival = aware.get("pick") or {}, aware.get("survival") or {}
    points = {
        "baseline": aware.get("baseline_robust"),
        "plain pick": aware.get("plain_pick_robust"),
        "pick with tolerances": pick.get("robust"),
        "the same, nominal": pick.get("responses"),
    }
    rows = [(point, *(shown(values.get(name), 5) for name in names)) for point, values in points.items() if values]
    sentences = [f"Front with tolerances: {counted(len(aware.get('front') or []), 'point')}."]
    if pick.get("factors"):
        place = ", ".join(
            f"{each.words} {each.text(part(pick, 'factors', each.name), 1)} {each.unit}".rstrip()
            for each in factors(summary)
        )
        reason = f"; {pick['reason']}" if pick.get("reason") else ""
        sentences.append(f"Pick with tolerances: {place}{reason}.")
    if aware.get("nominal_loss_percent") is not None:
        less = f"{aware['nominal_loss_percent']:.2f} % less hypervolume than the plain one in nominal values"
        percent = aware.get("robust_gain_percent")
        more = "" if percent is None else f", and {percent:.2f} % more at the ends of the tolerances"
        sentences.append(f"The front with tolerances has {less}{more}.")
    if None not in (survival.get("plain_pick"), survival.get("pick")):
        plain, with_them = (
            share_with_interval(survival[name], survival.get(f"{name}_interval")) for name in ("plain_pick", "pick")
        )
        sentences.append(
            f"Parts that still dominate the baseline: {plain} at the plain pick, {with_them} at the other."
        )
    sentences.append(survival.get("open_errors") or "")
    if aware.get("plain_pick_inside") is False:
        sentences.append("The tolerance box of the plain pick reaches out of the region: its figures are extrapolated.")
    caption = f"At the ends of the tolerances, {widths}: {kind}" if widths else f"At the ends of the tolerances: {kind}"
    return [Table(caption, ["point", *map(label, names)], rows), *map(Paragraph, sentences)]
