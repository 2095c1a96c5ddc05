"""The duty of a study: pick against baseline at each point, worst points, the cost of the compromise, life and energy."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from doe.report.sections.record import (
    LIMITS,
    SIGNS_NOTE,
    Record,
    change,
    factors,
    half_width,
    part,
    responses,
    signed,
    value_text,
)
from rbdyn.base.blocks import Block, Detail, Paragraph, Section, Table
from rbdyn.base.words import chance, label, quantity, shown, with_error

# The figure over all points, by its aggregate.
OVER_DUTY = {
    "mean": "the mean by shares of the time",
    "worst": "that of the worst point",
    "worst_relative": "the worst ratio to the baseline at the same point",
}
# Verdicts on limits, the worst first.
WORST_FIRST = ("broken", "undecided", "kept")
POWER = "power_loss_W"


def duty(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """The points of the duty with all figures there."""
    blocks = [_points(summary), *_costs(summary), figures(summary)]
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
        Paragraph(_energy(summary)),
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
    parts = [f"{' and '.join(names)} {OVER_DUTY[aggregate]}" for aggregate, names in groups.items()]
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
        f"Life over the duty, L10r: {shown(before['L10_h'], 4)} h at the baseline, {shown(after['L10_h'], 4)} h at the pick "
        f"({gain:+.2g} %); equivalent load {shown(after.get('equivalent_load_N'), 4)} N{share}."
    )


def _energy(summary: Record) -> str:
    """Energy lost in an hour of the duty, where the power loss is a response."""
    points = part(summary, "duty", "points") or []
    means = [mean for name in ("baseline", "pick") if (mean := _mean_power(points, name)) is not None]
    if len(means) < 2:
        return ""
    before, after = (with_error(*mean) for mean in means)
    return f"Energy lost in an hour of the duty: {before} Wh at the baseline, {after} Wh at the pick."


def _mean_power(points: Sequence[Record], end: str) -> tuple[float, float | None] | None:
    """Mean power loss [W] by shares of the time with its half-width; None where a point lacks it."""
    powers = [(point["share"], part(point, end, POWER)) for point in points if point["share"] > 0.0]
    if not powers or any(power is None for _, power in powers):
        return None
    mean, halves = (
        math.fsum(share * power["value"] for share, power in powers),
        [half_width(power) for _, power in powers],
    )
    known = [share * half for (share, _), half in zip(powers, halves, strict=True) if half is not None]
    return mean, math.hypot(*known) if len(known) == len(powers) else None


def _points(summary: Record) -> Table:
    """The points as the study states them, with their lives."""
    points = part(summary, "duty", "points") or []
    lives = [part(summary, "duty", "life", name, "point_hours") or {} for name in ("baseline", "pick")]
    rows = [
        (
            point["name"],
            _percent(point.get("share")),
            ", ".join(point.get("set") or []),
            *(shown(hours.get(point["name"]), 4) for hours in lives),
        )
        for point in points
    ]
    header = ("point", "share of time", "keys of the scene", "life at the baseline [h]", "at the pick [h]")
    note = "Life at each point alone: ISO/TS 16281, static loads at the operating clearance."
    return Table("Points of the duty", header, rows, note if any(lives) else "", text_columns=(2,))


def _costs(summary: Record) -> Iterator[Block]:
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
