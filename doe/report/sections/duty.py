"""The duty of a study: pick against baseline at each point, worst points, the cost of the compromise, life and energy."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

from doe.report.sections.record import (
    LIMITS,
    SIGNS_NOTE,
    Factor,
    Record,
    change,
    factors,
    half_width,
    part,
    responses,
    signed,
    value_text,
)
from doe.report.still import COLOURS, GUIDE, Still, name_marks
from rbdyn.base.blocks import Block, Detail, Figures, Paragraph, Section, Table
from rbdyn.base.faults import one_line
from rbdyn.base.words import chance, label, quantity, shown, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The figure over all points, by its aggregate.
OVER_DUTY = {
    "mean": "the mean by shares of the time",
    "worst": "the worst point",
    "worst_relative": "the worst ratio to the baseline at the same point",
}
OPERATING = "operating_clearances_mm"
# Verdicts on limits, the worst first.
WORST_FIRST = ("broken", "undecided", "kept")
POWER, SLIP = "power_loss_W", "cage_slip"
# Of a picture of gains [pt]: height of a row, of all else, and width of a letter of a name.
ROW, AROUND, LETTER = 26.0, 64.0, 6.0
LONGEST = 24  # letters of a name in a picture


def duty(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """The points of the duty with all figures there."""
    caption = "Gain of the pick over the baseline at each point, and over the duty, with 95 % intervals."
    pictures = Figures([still.svg for still in gain_stills(summary)], caption, "duty")
    blocks = [_points(summary), pictures, *costs(summary), *_clearances(summary), figures(summary)]
    return Section("duty", "The duty", blocks) if part(summary, "duty") else None


def at_points(summary: Record) -> list[Block]:
    """What an engineer acts on: verdicts at each point, the worst points, the dearest compromise, life and energy."""
    points = part(summary, "duty", "points") or []
    names = _with_goal(points)
    rows = [
        [point["name"], _percent(point.get("share")), *(signed(part(point, "gains", name)) for name in names), limits]
        for point, limits in zip(points, map(lambda point: _limits(summary, point["name"]), points), strict=True)
    ]
    header = ("point", "share", *(quantity(name)[0] for name in names), "limits")
    return [
        Table("Pick against baseline at each point of the duty (95 % intervals)", header, rows, SIGNS_NOTE),
        Paragraph(_aggregates(summary), "small"),
        Paragraph(_losses(points), "warning"),
        Paragraph(_worst(summary)),
        Paragraph(_dearest(points)),
        Paragraph(_life(summary)),
        Paragraph(_energy(points)),
    ]


def _with_goal(points: Sequence[Record]) -> list[str]:
    """Responses with a goal, which have gains, in the order of the study."""
    return list(dict.fromkeys(name for point in points for name in point.get("gains") or {}))


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100.0 * share:.3g} %"


def _limits(summary: Record, point: str) -> str:
    """The worst verdict on limits at a point; empty without limits there."""
    verdicts = {
        limit.get("verdict") for name, limit in (part(summary, "limits") or {}).items() if name.startswith(f"{point}: ")
    }
    return next((LIMITS[verdict] for verdict in WORST_FIRST if verdict in verdicts), "")


def _aggregates(summary: Record) -> str:
    """How each response follows from its figures at the points."""
    groups: dict[str, list[str]] = {}
    for name, aggregate in (part(summary, "duty", "aggregate") or {}).items():
        groups.setdefault(aggregate, []).append(quantity(name)[0])
    parts = [f"for {' and '.join(names)} {OVER_DUTY[aggregate]}" for aggregate, names in groups.items()]
    return f"Over the duty: {'; '.join(parts)}." if parts else ""


def _losses(points: Sequence[Record]) -> str:
    """Points at which the pick is worse than the baseline, whatever it gains elsewhere; empty without any."""
    losses = [
        f"{quantity(name)[0]} {change(gain)} at {point['name']}"
        for point in points
        for name, gain in (point.get("gains") or {}).items()
        if gain.get("verdict") == "worse"
    ]
    return f"The pick is worse than the baseline at some points: {', '.join(losses)}." if losses else ""


def _worst(summary: Record) -> str:
    """The likeliest worst point of each response that is a worst one, with its probability, at pick and baseline."""
    at_pick, at_baseline = (part(summary, "duty", "worst", name) or {} for name in ("pick", "baseline"))
    sentences = []
    for name, worst in at_pick.items():
        before = at_baseline.get(name)
        as_before = before is not None and before["point"] == worst["point"]
        other = ", as at the baseline" if as_before else f", at the baseline {_odds(before)}" if before else ""
        sentences.append(f"Worst point of {quantity(name)[0]} at the pick: {_odds(worst)}{other}.")
    return " ".join(sentences)


def _odds(worst: Record) -> str:
    return f"{worst['point']} (probability {chance(worst['probability'])})"


def _dearest(points: Sequence[Record]) -> str:
    """What the compromise costs where that exceeds the errors of the surfaces; empty without picks of single points."""
    costs = [
        (gain["percent"], quantity(name)[0], change(gain), point["name"])
        for point in points
        for name, gain in (part(point, "own", "gains_over_pick") or {}).items()
        if gain.get("verdict") == "better"
    ]
    if not any(part(point, "own") for point in points):
        return ""
    if not costs:
        return "The compromise costs no point more than the errors of its surfaces: no pick for one point alone is better there."
    _, words, size, name = max(costs)
    return f"The compromise costs most at {name}: a pick for that point alone has {words} {size} on its surfaces."


def _life(summary: Record) -> str:
    """Life over the duty at baseline and pick; empty where it has no end."""
    before, after = (part(summary, "duty", "life", name) or {} for name in ("baseline", "pick"))
    if before.get("L10_h") is None or after.get("L10_h") is None:
        return ""
    gain = 100.0 * (after["L10_h"] / before["L10_h"] - 1.0)
    damage = after.get("damage") or {}
    most = max(damage, key=lambda name: damage[name], default="")
    share = f", {100.0 * damage[most]:.0f} % of the damage at {most}" if len(damage) > 1 else ""
    return (
        f"Life over the duty, L10r: {shown(before['L10_h'], 3)} h at the baseline, {shown(after['L10_h'], 3)} h at the pick "
        f"({gain:+.2g} %); equivalent load {shown(after.get('equivalent_load_N'), 4)} N{share}."
    )


def _energy(points: Sequence[Record]) -> str:
    """Energy lost in an hour of the duty, and mean cage slip, where these are responses."""
    power, slip = (_means(points, name) for name in (POWER, SLIP))
    sentences = []
    if power:
        sentences.append(
            f"Energy lost in an hour of the duty: {power[0]} Wh at the baseline, {power[1]} Wh at the pick."
        )
    if slip:
        sentences.append(f"Mean cage slip by shares of the time: {slip[0]} at the baseline, {slip[1]} at the pick.")
    return " ".join(sentences)


def _means(points: Sequence[Record], name: str) -> list[str]:
    """Means of a figure at baseline and pick by shares of the time, with their half-widths; none where a point lacks it."""
    means = []
    for end in ("baseline", "pick"):
        shares = [(point["share"], part(point, end, name)) for point in points if point["share"] > 0.0]
        if not shares or any(value is None for _, value in shares):
            return []
        halves = [(share, half_width(value)) for share, value in shares]
        known = [share * half for share, half in halves if half is not None]
        mean = math.fsum(share * value["value"] for share, value in shares)
        means.append(with_error(mean, math.hypot(*known) if len(known) == len(shares) else None))
    return means


def _points(summary: Record) -> Table:
    """The points as the study states them, with their lives."""
    points = part(summary, "duty", "points") or []
    lives = [part(summary, "duty", "life", name, "point_hours") or {} for name in ("baseline", "pick")]
    rows = [
        (
            point["name"],
            _percent(point.get("share")),
            ", ".join(point.get("set") or []),
            *(shown(hours.get(point["name"]), 3) for hours in lives),
        )
        for point in points
    ]
    header = ("point", "share of time", "keys of the scene", "life at the baseline [h]", "at the pick [h]")
    note = "Life at each point alone: ISO/TS 16281, static loads at the operating clearance."
    return Table("Points of the duty", header, rows, note if any(lives) else "", text_columns=(2,))


def costs(summary: Record) -> Iterator[Block]:
    """The pick of each point alone, and by how much it is better there than the study's pick."""
    points = part(summary, "duty", "points") or []
    names, columns = _with_goal(points), factors(summary)
    rows = [
        [
            point["name"],
            *(factor.text(part(point, "own", "factors", factor.name)) for factor in columns),
            *(signed(part(point, "own", "gains_over_pick", name)) for name in names),
        ]
        for point in points
        if part(point, "own")
    ]
    header = ("point", *(label(factor.name) for factor in columns), *(quantity(name)[0] for name in names))
    note = f"Change from the study's pick to that of the point alone, on the surfaces of its runs. {SIGNS_NOTE}"
    yield Table("What the compromise costs", header, rows, note)
    yield from (Paragraph(point["own_note"]) for point in points if point.get("own_note"))


def _clearances(summary: Record) -> Iterator[Block]:
    """Clearances in operation at every point, where fits, temperatures or rotation change them."""
    points = part(summary, "duty", "points") or []
    columns = [factor for factor in factors(summary) if any(part(one, OPERATING, factor.name) for one in points)]
    rows = [
        [
            point["name"],
            *(
                factor.text(part(point, OPERATING, factor.name, end))
                for factor in columns
                for end in ("baseline", "pick")
            ),
        ]
        for point in points
    ]
    header = ("point", *(f"{label(factor.name)}, {end}" for factor in columns for end in ("baseline", "pick")))
    yield Table("Clearances in operation at every point", header, rows if columns else [])


def gain_stills(summary: Record) -> list[Still]:
    """A picture a response with a goal: its gain at each point and over the duty."""
    points = part(summary, "duty", "points") or []
    stills = []
    for name in _with_goal(points):
        gains = {point["name"]: part(point, "gains", name) for point in points}
        gains |= {"over the duty": part(summary, "gains", name)}
        rows = [
            (one_line(row, LONGEST), gain) for row, gain in gains.items() if gain and gain.get("percent") is not None
        ]
        words = f"Gain in {quantity(name)[0]} at {len(points)} points of the duty"
        width = LETTER * max((len(row) for row, _ in rows), default=0)
        still = Still(words, partial(_gains, name, rows), height=AROUND + ROW * len(rows), left_margin=width + 16.0)
        stills += [still] if rows else []
    return stills


def _gains(name: str, rows: Sequence[tuple[str, Record]], axis: "Axes") -> None:
    """Gains with their intervals, the first row above."""
    for place, (row, gain) in enumerate(rows):
        half = gain.get("error_percent") or 0.0
        axis.plot([gain["percent"] - half, gain["percent"] + half], [place, place], color=COLOURS["blue"])
        marker = "D" if place == len(rows) - 1 else "o"
        (mark,) = axis.plot([gain["percent"]], [place], marker, color=COLOURS["blue"])
        name_marks(mark, "mark", [f"{row}: {change(gain)}"])
    axis.axvline(0.0, **GUIDE)
    axis.set_yticks(range(len(rows)), [row for row, _ in rows])
    axis.set(ylim=(len(rows) - 0.5, -0.5), xlabel=f"gain in {quantity(name)[0]} [%]")


def figures(summary: Record) -> Table:
    """Every response at every point, at baseline and pick."""
    header = ("point", "figure", "unit", "baseline", "pick", "change")
    rows = [
        (
            row["point"],
            *quantity(row["response"]),
            value_text(row["baseline"]),
            value_text(row["pick"]),
            signed(row["gain"]),
        )
        for row in _figures(summary)
    ]
    return Table(
        "Simulated figures at every point (95 % intervals)", header, rows, text_columns=(1, 2), detail=Detail.ALL
    )


def _figures(summary: Record) -> Iterator[dict[str, Any]]:
    names = [response["name"] for response in responses(summary)]
    for point in part(summary, "duty", "points") or []:
        for name in names:
            if part(point, "pick", name):
                ends = {end: part(point, end, name) for end in ("baseline", "pick")}
                yield {"point": point["name"], "response": name, **ends, "gain": part(point, "gains", name)}


def duty_rows(summary: Record) -> list[dict[str, Any]]:
    """Rows of duty_points.csv: a response at a point, with the cost of the compromise and the worst verdict on its limits."""
    shares = {point["name"]: point["share"] for point in part(summary, "duty", "points") or []}
    own = {point["name"]: point.get("own") for point in part(summary, "duty", "points") or []}
    rows = []
    for row in _figures(summary):
        point, name, gain = row["point"], row["response"], row["gain"] or {}
        cost = part(own[point] or {}, "gains_over_pick", name) or {}
        rows.append(
            {
                "point": point,
                "share": shares[point],
                "response": name,
                **{end: row[end]["value"] for end in ("baseline", "pick")},
                **{f"{end}_error": half_width(row[end]) for end in ("baseline", "pick")},
                "improvement_percent": gain.get("percent"),
                "improvement_error_percent": gain.get("error_percent"),
                "verdict": gain.get("verdict", ""),
                "own_pick_percent": cost.get("percent"),
                "own_pick_error_percent": cost.get("error_percent"),
                "limit_verdict": part(summary, "limits", f"{point}: {name}", "verdict") or "",
            }
        )
    return rows


def in_operation(summary: Record, factor: Factor, end: str) -> tuple[float | None, str]:
    """Clearance in operation of the "pick" or the "baseline", over a duty the least, and the name of its point; without a duty none."""
    points = {
        point["name"]: part(point, OPERATING, factor.name, end) for point in part(summary, "duty", "points") or []
    }
    plays = {name: float(play) for name, play in points.items() if play is not None}
    if not plays:
        return part(summary, OPERATING, factor.name, end), ""
    least = min(plays, key=plays.__getitem__)
    return plays[least], least


def least_words(summary: Record) -> str:
    """' They are the least over the duty: at take-off.', with the factors at each point where these differ."""
    at: dict[str, list[str]] = {}
    for factor in factors(summary):
        if point := in_operation(summary, factor, "pick")[1]:
            at.setdefault(point, []).append(factor.words)
    if not at:
        return ""
    where = [point if len(at) == 1 else f"{', '.join(names)} at {point}" for point, names in at.items()]
    return f" They are the least over the duty: {'at ' if len(at) == 1 else ''}{'; '.join(where)}."
