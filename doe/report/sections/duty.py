"""The duty of a study: pick against baseline at each point, worst points, the cost of the compromise, life and energy."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from doe.report.still import COLOURS, GUIDE, Still, name_marks
from doe.report.summary import LIMITS, SIGNS_NOTE, Summary, change, signed
from doe.study_file.sections import at_point
from doe.workflow.confirmation import ORDER, Gain, PickLimit
from doe.workflow.duty import AtPoint, DutyAnswer, LifeOverDuty
from doe.workflow.problem import Factor
from doe.workflow.surfaces import PredictedGain
from rbdyn.base.blocks import Block, Column, Detail, Figures, Paragraph, Section, Sheet, Table
from rbdyn.base.faults import one_line
from rbdyn.base.words import all_of, label, quantity, shown, with_error
from rbdyn.result import SimulatedValue

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# The figure over all points, by its aggregate.
OVER_DUTY = {
    "mean": "the mean by shares of the time",
    "worst": "the worst point",
    "worst_relative": "the worst ratio to the baseline at the same point",
}
POWER, SLIP = "power_loss_W", "cage_slip"
# Of a picture of gains [pt]: height of a row, of all else, and width of a letter of a name.
ROW, AROUND, LETTER = 26.0, 64.0, 6.0
LONGEST = 24  # letters of a name in a picture


def duty(summary: Summary) -> Section | None:
    """The points of the duty with all figures there."""
    if summary.duty is None:
        return None
    caption = "Gain of the selected design over the baseline at each point, and over the duty, with 95 % intervals."
    pictures = Figures([still.svg for still in gain_stills(summary)], caption, "duty")
    blocks = [_points(summary.duty), pictures, *costs(summary), _clearances(summary), duty_figures(summary).block]
    return Section("duty", "The duty", blocks)


def at_points(summary: Summary) -> list[Block]:
    """What an engineer acts on: verdicts at each point, the worst points, the dearest compromise, life and energy."""
    if summary.duty is None:
        return []
    points = summary.duty.points
    names = _with_goal(points)
    rows = [
        [
            point.name,
            _percent(point.share),
            *(signed(point.gains[name]) if name in point.gains else "" for name in names),
            _limits(summary, point.name),
        ]
        for point in points
    ]
    header = ("point", "share", *(quantity(name)[0] for name in names), "limits")
    return [
        Table("Selected design against baseline at each point of the duty (95 % intervals)", header, rows, SIGNS_NOTE),
        Paragraph(_aggregates(summary.duty), "small"),
        Paragraph(_losses(points), "warning"),
        Paragraph(_worst(summary.duty)),
        Paragraph(_dearest(points)),
        Paragraph(_life(summary.duty.life)),
        Paragraph(_energy(points)),
    ]


def _with_goal(points: Sequence[AtPoint]) -> list[str]:
    """Responses with a goal, which have gains, in the order of the study."""
    return list(dict.fromkeys(name for point in points for name in point.gains))


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"


def _limits(summary: Summary, point: str) -> str:
    """The worst verdict on limits at a point; empty without limits there."""
    verdicts = [limit.verdict for name, limit in summary.limits.items() if name.startswith(f"{point}: ")]
    return LIMITS[max(verdicts, key=ORDER.index)] if verdicts else ""


def _aggregates(duty: DutyAnswer) -> str:
    """How each response follows from its figures at the points."""
    groups: dict[str, list[str]] = {}
    for name, aggregate in duty.aggregate.items():
        groups.setdefault(aggregate, []).append(quantity(name)[0])
    parts = [f"for {all_of(names)} {OVER_DUTY[aggregate]}" for aggregate, names in groups.items()]
    return f"Over the duty: {'; '.join(parts)}." if parts else ""


def _losses(points: Sequence[AtPoint]) -> str:
    """Points at which the pick is worse than the baseline, whatever it gains elsewhere; empty without any."""
    losses = [
        f"{quantity(name)[0]} {change(gain)} at {point.name}"
        for point in points
        for name, gain in point.gains.items()
        if gain.verdict == "worse"
    ]
    return f"The selected design is worse than the baseline at some points: {', '.join(losses)}." if losses else ""


def _worst(duty: DutyAnswer) -> str:
    """The likeliest worst point of each response that is a worst one, with its probability, at pick and baseline."""
    sentences = []
    for name, worst in duty.worst["pick"].items():
        before = duty.worst["baseline"].get(name)
        as_before = before is not None and before.point == worst.point
        other = ", as at the baseline" if as_before else f", at the baseline {before.words}" if before else ""
        sentences.append(f"Worst point of {quantity(name)[0]} at the selected design: {worst.words}{other}.")
    return " ".join(sentences)


def _dearest(points: Sequence[AtPoint]) -> str:
    """What the compromise costs where that exceeds the errors of the surfaces; empty without picks of single points."""
    costs = [
        (gain.percent, quantity(name)[0], change(gain), point.name)
        for point in points
        if point.own
        for name, gain in point.own.gains_over_pick.items()
        if gain.verdict == "better"
    ]
    if not any(point.own for point in points):
        return ""
    if not costs:
        return "The compromise costs no point more than the errors of its surfaces: no design for one point alone is better there."
    _, words, size, name = max(costs)
    return f"The compromise costs most at {name}: a design for that point alone has {words} {size} on its surfaces."


def _life(life: Mapping[str, LifeOverDuty]) -> str:
    """Life over the duty at baseline and pick; empty where it has no end."""
    before, after = life["baseline"], life["pick"]
    if before.L10_h is None or after.L10_h is None:
        return ""
    gain = 100.0 * (after.L10_h / before.L10_h - 1.0)
    most = max(after.damage, key=after.damage.__getitem__)
    share = f", {100.0 * after.damage[most]:.0f} % of the damage at {most}" if len(after.damage) > 1 else ""
    return (
        f"Life over the duty, L10r: {shown(before.L10_h, 3)} h at the baseline, {shown(after.L10_h, 3)} h at the selected design "
        f"({gain:+.2g} %); equivalent load {shown(after.equivalent_load_N, 4)} N{share}."
    )


def _energy(points: Sequence[AtPoint]) -> str:
    """Energy lost in an hour of the duty, and mean cage slip, where these are responses."""
    power, slip = (_means(points, name) for name in (POWER, SLIP))
    sentences = []
    if power:
        sentences.append(
            f"Energy lost in an hour of the duty: {power[0]} Wh at the baseline, {power[1]} Wh at the selected design."
        )
    if slip:
        sentences.append(f"Mean cage slip by time fraction: {slip[0]} (baseline), {slip[1]} (selected).")
    return " ".join(sentences)


def _means(points: Sequence[AtPoint], name: str) -> list[str]:
    """Means of a figure at baseline and pick by shares of the time, with their half-widths; none where a point lacks it."""
    timed = [point for point in points if point.share > 0.0]
    if not timed or any(name not in end for point in timed for end in (point.baseline, point.pick)):
        return []
    means = []
    for values in ([point.baseline[name] for point in timed], [point.pick[name] for point in timed]):
        shares = [point.share for point in timed]
        errors = [value.stated_error for value in values]
        known = [share * error for share, error in zip(shares, errors, strict=True) if error is not None]
        mean = math.fsum(share * value.value for share, value in zip(shares, values, strict=True))
        means.append(with_error(mean, math.hypot(*known) if len(known) == len(shares) else None))
    return means


def _points(duty: DutyAnswer) -> Table:
    """The points as the study states them, with their lives."""
    lives = [duty.life[name].point_hours for name in ("baseline", "pick")]
    columns: tuple[Column[AtPoint], ...] = (
        Column("name", words="point"),
        Column("share", _percent, "share of time"),
        Column("set", words="keys of the scene", cell=_keys, text=True),
        Column("", words="life at the baseline [h]", cell=lambda point: shown(lives[0][point.name], 3)),
        Column("", words="at the selected design [h]", cell=lambda point: shown(lives[1][point.name], 3)),
    )
    note = "Life at each point alone: ISO/TS 16281, static loads at the operating clearance."
    return Sheet("Points of the duty", columns, duty.points, note).block


def _keys(point: AtPoint) -> str:
    return ", ".join([*point.overrides, *([f"from {point.origin}"] if point.origin else [])])


def costs(summary: Summary) -> Iterator[Block]:
    """The pick of each point alone, and by how much it is better there than the study's pick."""
    if summary.duty is None:
        return
    points, asked = summary.duty.points, summary.asked
    names = _with_goal(points)
    rows = [
        [
            point.name,
            *(factor.text(point.own.factors[factor.name]) for factor in asked.factors),
            *(signed(point.own.gains_over_pick[name]) for name in names),
        ]
        for point in points
        if point.own
    ]
    header = ("point", *map(label, asked.columns), *(quantity(name)[0] for name in names))
    note = f"Change from the selected design to one for this point alone, on the surfaces of its runs. {SIGNS_NOTE}"
    yield Table("What the compromise costs", header, rows, note)
    yield from (Paragraph(point.own_note) for point in points if point.own_note)


def _clearances(summary: Summary) -> Table:
    """Clearances in operation at every point, where fits, temperatures or rotation change them."""
    points = [] if summary.duty is None else summary.duty.points
    columns = [
        (factor, end)
        for factor in summary.asked.factors
        if any(factor.name in point.operating_clearances_mm for point in points)
        for end in ("baseline", "pick")
    ]
    rows = [
        [point.name, *(factor.text(point.operating_clearances_mm[factor.name][end]) for factor, end in columns)]
        for point in points
    ]
    header = ("point", *(f"{label(factor.name)}, {end}" for factor, end in columns))
    return Table("Clearances in operation at every point", header, rows if columns else [])


def gain_stills(summary: Summary) -> list[Still]:
    """A picture a response with a goal: its gain at each point and over the duty."""
    points = [] if summary.duty is None else summary.duty.points
    stills = []
    for name in _with_goal(points):
        gains = {point.name: point.gains.get(name) for point in points} | {"over the duty": summary.gains.get(name)}
        rows = [(one_line(row, LONGEST), gain) for row, gain in gains.items() if gain is not None]
        words = f"Gain in {quantity(name)[0]} at {len(points)} points of the duty"
        width = LETTER * max((len(row) for row, _ in rows), default=0)
        still = Still(words, partial(_gains, name, rows), height=AROUND + ROW * len(rows), left_margin=width + 16.0)
        stills.append(still)
    return stills


def _gains(name: str, rows: Sequence[tuple[str, Gain]], axis: "Axes") -> None:
    """Gains with their intervals, the first row above."""
    for place, (row, gain) in enumerate(rows):
        ends = [gain.percent - gain.error_percent, gain.percent + gain.error_percent]
        axis.plot(ends, [place, place], color=COLOURS["blue"])
        marker = "D" if place == len(rows) - 1 else "o"
        (mark,) = axis.plot([gain.percent], [place], marker, color=COLOURS["blue"])
        name_marks(mark, "mark", [f"{row}: {change(gain)}"])
    axis.axvline(0.0, **GUIDE)
    axis.set_yticks(range(len(rows)), [row for row, _ in rows])
    axis.set(ylim=(len(rows) - 0.5, -0.5), xlabel=f"gain in {quantity(name)[0]} [%]")


class DutyFigure(NamedTuple):
    """A response at a point of the duty: simulated at baseline and pick, its gain and that of the pick of the point alone."""

    point: AtPoint
    response: str
    limit: PickLimit | None
    baseline: SimulatedValue
    pick: SimulatedValue
    gain: Gain | None
    cost: PredictedGain | None

    @classmethod
    def of(cls, point: AtPoint, response: str, limit: PickLimit | None) -> "DutyFigure":
        """A response with its ``limit`` there; gains are None without a goal, costs also without a pick of the point."""
        cost = None if point.own is None else point.own.gains_over_pick.get(response)
        ends = point.baseline[response], point.pick[response]
        return cls(point, response, limit, *ends, point.gains.get(response), cost)


DUTY_COLUMNS: tuple[Column[DutyFigure], ...] = (
    Column("point", at=("point", "name"), meaning="point of operation, and its share of the time"),
    Column("share", at=("point", "share"), screen=False, meaning="point of operation, and its share of the time"),
    Column(
        "response",
        words="figure",
        cell=lambda row: quantity(row.response)[0],
        text=True,
        meaning="the response of this row, as simulated at the point",
    ),
    Column("", words="unit", cell=lambda row: quantity(row.response)[1], text=True),
    Column(
        "baseline",
        at=("baseline", "value"),
        cell=lambda row: row.baseline.text,
        unit="of the response",
        meaning="means there",
    ),
    Column("pick", words="selected", at=("pick", "value"), cell=lambda row: row.pick.text),
    Column(
        "baseline_error",
        at=("baseline", "stated_error"),
        screen=False,
        unit="of the response",
        meaning="half widths of the 95 % intervals",
    ),
    Column("pick_error", at=("pick", "stated_error"), screen=False),
    Column(
        "improvement_percent",
        words="change",
        at=("gain", "percent"),
        cell=lambda row: "" if row.gain is None else signed(row.gain),
        meaning="gain of the selected design on the baseline at the point, positive where better, and its half width",
    ),
    Column("improvement_error_percent", at=("gain", "error_percent"), screen=False),
    Column(
        "verdict",
        at=lambda row: "" if row.gain is None else row.gain.verdict,
        screen=False,
        meaning="better, worse or within error",
    ),
    Column(
        "own_pick_percent",
        at=("cost", "percent"),
        screen=False,
        meaning="cost of the compromise: improvement of the design for this point alone over the selected design, by its surfaces, and its half width",
    ),
    Column("own_pick_error_percent", at=("cost", "error_percent"), screen=False),
    Column(
        "limit_verdict",
        at=lambda row: "" if row.limit is None else row.limit.verdict,
        screen=False,
        meaning="verdict on the limit of the response at the point",
    ),
)
DUTY_POINTS = Sheet(
    "Simulated results at every point (95 % intervals)", DUTY_COLUMNS, detail=Detail.ALL, file="duty_points.csv",
    content="One row per response at each point of a duty.",
)  # fmt: skip


def duty_figures(summary: Summary) -> Sheet[DutyFigure]:
    """Every response at every point, at baseline and pick."""
    rows = [
        DutyFigure.of(point, name, summary.limits.get(at_point(point.name, name)))
        for point in (summary.duty.points if summary.duty else ())
        for name in summary.asked.names
        if name in point.pick
    ]
    return replace(DUTY_POINTS, rows=rows)


def in_operation(summary: Summary, factor: Factor, end: str) -> tuple[float | None, str]:
    """Clearance in operation of the "pick" or the "baseline", over a duty the least, and the name of its point; without a duty none."""
    points = [] if summary.duty is None else summary.duty.points
    plays = {point.name: point.operating_clearances_mm.get(factor.name, {}).get(end) for point in points}
    known = {name: play for name, play in plays.items() if play is not None}
    if not known:
        return summary.operating_clearances_mm.get(factor.name, {}).get(end), ""
    least = min(known, key=known.__getitem__)
    return known[least], least


def least_words(summary: Summary) -> str:
    """' They are the least over the duty: at take-off.', with the factors at each point where these differ."""
    at: dict[str, list[str]] = {}
    for factor in summary.asked.factors:
        if point := in_operation(summary, factor, "pick")[1]:
            at.setdefault(point, []).append(factor.words)
    if not at:
        return ""
    where = [point if len(at) == 1 else f"{', '.join(names)} at {point}" for point, names in at.items()]
    return f" They are the least over the duty: {'at ' if len(at) == 1 else ''}{'; '.join(where)}."
