"""The answer an engineer acts on, the settings of the study, the points that simulation confirmed, their power by term and motion.

The sections are blocks of the record of a study; the ``..._record`` functions write that record from results.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

from doe.clearance import DrawnMotion
from doe.report.sections.chain import DRAWN, NAMES, estimates_note, part_sheet, refusal_blocks, yield_words
from doe.report.sections.duty import at_points, in_operation, least_words
from doe.report.still import COLOURS, FONT, GUIDE, SMALL, Still, name_marks
from doe.report.summary import (
    LIMITS,
    SENSES,
    SIGNS_NOTE,
    Summary,
    by_point,
    change,
    nearest,
    share_with_interval,
    sign_of,
    signed,
)
from doe.unknown.propagation import Share
from doe.workflow.confirmation import LOSS, NOISE, REAL, ConfirmedPoint, Gain, Limit, point_words
from doe.workflow.parts import Made
from doe.workflow.pick import Edge
from doe.workflow.problem import Factor, Response
from doe.workflow.tolerances import FactorTolerance
from rbdyn.base.blocks import Block, Column, Detail, Figures, Paragraph, Role, Section, Sheet, Table, Widget
from rbdyn.base.identity import identity_line
from rbdyn.base.notes import DANGER, of_level
from rbdyn.base.words import all_of, chance, counted, label, quantity, range_ends, rounded_down, shown, with_error
from rbdyn.clearances import CLEARANCES, other_ranges
from rbdyn.result import TEMPERATURES

if TYPE_CHECKING:
    from matplotlib.axes import Axes


# Meaning of a clearance of the scene, by its key.
MEANINGS = {clearance.key: clearance.meaning for clearance in CLEARANCES}
GRADE = "grade of the parts"
# Share of the cases over the unknown inputs from which a verdict counts as good news.
NEARLY_ALL = 0.9
SENTENCE_END = re.compile(r"(?<=\.) (?=[A-Z])")
LIMITS_NOTE = "A limit is met or violated if the value is on that side of it by more than its error, otherwise undecided. The probability of meeting it follows from that error."


def first_screen(summary: Summary) -> list[Block]:
    """Bearing, point and date, the chosen clearances, the verdicts on limits, the gains, the parts to make, and why this point.

    Over a duty the verdicts at each of its points follow the gains.
    """
    return [
        identity_line(summary.identity),
        *_clearances(summary),
        *_judged(summary),
        Paragraph(_cages(summary), detail=Detail.ALL if _class_in_table(summary) else Detail.LEAST),
        *_gained(summary),
        *at_points(summary),
        *_parts_to_make(summary),
        *_reasons(summary),
    ]


def _judged(summary: Summary) -> list[Block]:
    """Limits with their verdicts and the odds of keeping them over the unknown inputs, or the command that computes these."""
    odds = [limit.odds.value for limit in summary.limits.values() if limit.odds]
    table = _limits_judged(summary)
    if summary.obstacles.limits or summary.obstacles.cage or not summary.limits:
        # The dangers above say which limits are missed, and by how much.
        return [table, *([_command_for_odds(summary)] if summary.limits else ())]
    if min(odds, default=1.0) < NEARLY_ALL:
        return [table, Paragraph("The selected design does not meet every limit over the unknown inputs.", "warning")]
    everywhere = " and over the unknown inputs" if odds else ""
    kept = Paragraph(f"The selected design meets every limit{everywhere}.", "statement", Detail.ALL)
    return [table, kept, _command_for_odds(summary)]


def _cages(summary: Summary) -> str:
    """The class of the cage at the baseline and at the pick, or where the points of a duty differ at each; empty without it."""
    before, after = (summary.confirmation[name].cage for name in ("baseline", "pick"))
    if not before or not after:
        return ""
    pairs = {point: (before[point].short_words, after[point].short_words) for point in after if point in before}
    if len(set(pairs.values())) > 1:
        return f"Cage: {'; '.join(f'{point}: {old} at the baseline, {new} at the selected design' for point, (old, new) in pairs.items())}."
    old, new = next(iter(pairs.values()))
    everywhere = ", at every point of the duty" if len(pairs) > 1 else ""
    if old == new:
        return f"Cage: {old} at baseline and selected design{everywhere}."
    return f"Cage: {old} at the baseline, {new} at the selected design{everywhere}."


def _class_in_table(summary: Summary) -> bool:
    """Whether the table of limits has the class of the cage, by a limit on it without a duty."""
    return not summary.duty and any(name not in summary.asked.names for name in summary.limits)


def _command_for_odds(summary: Summary) -> Paragraph:
    """What states the odds, where these are unknown."""
    return Paragraph("" if summary.robust else "Add --robust for probabilities over unknown inputs.")


def _gained(summary: Summary) -> list[Block]:
    """The gains with their verdicts, and the odds of them over the unknown inputs or the command that computes these."""
    text, robust = summary.statement, summary.robust
    role, bad = _role_of_gains(summary.gains, text), of_level(summary.notes, DANGER)
    sentences = robust.sentences if robust else []
    # Only the first two sentences are verdicts: the odds of the gains, and what decides.
    first: Role = "statement" if robust and robust.chances.all.value >= NEARLY_ALL else "warning"
    second: Role = "warning" if robust and robust.undecided else ""
    further: list[Role] = [""] * len(sentences)
    return [
        _gains(summary),
        # The verdict says so too, unless it names dangers.
        Paragraph(text, role, Detail.USUAL if bad else Detail.ALL),
        *(Paragraph(sentence, role) for sentence, role in zip(sentences, [first, second, *further], strict=False)),
        _robust_points(summary),
        *([] if summary.limits else [_command_for_odds(summary)]),
        Paragraph(summary.whirl_sentence, "warning"),
    ]


def good_news(summary: Summary) -> str:
    """The gains that are real and the limits, before the words on dangers."""
    count = len(summary.gains)
    real = [name for name, gain in summary.gains.items() if gain.percent > gain.error_among(count)]
    if not real:
        return "No response improves by more than its error."
    named = len(real) < 3
    words = all_of(quantity(name)[0] for name in real) if named else f"{len(real)} of {count} responses"
    subject = (
        f"All {count} responses improve"
        if len(real) == count > 1
        else f"{words[:1].upper()}{words[1:]} improve{'s' * (len(real) == 1)}"
    )
    extent = f" ({len(real)} of {counted(count, 'response')})" if named and len(real) < count else ""
    limits = (
        " and every limit is met" if summary.limits and not (summary.obstacles.limits or summary.obstacles.cage) else ""
    )
    return f"{subject}{extent}{limits}."


def _role_of_gains(gains: Mapping[str, Gain], text: str) -> Role:
    """Good news only where every gain is real; a loss, or no gain at all, is bad news."""
    verdicts = {gain.verdict for gain in gains.values()} or {"better"}
    if "worse" in verdicts or LOSS in text or "better" not in verdicts or (NOISE in text and REAL not in text):
        return "warning"
    return "" if "within error" in verdicts or NOISE in text else "statement"


def _reasons(summary: Summary) -> list[Block]:
    """Why this point and no other one, what limits it, and where it lies."""
    search = summary.adaptive
    return [
        Paragraph(f"Why this point: {summary.confirmation['pick'].reason}."),
        Paragraph(search.sentences[0] if search else ""),
        *map(Paragraph, summary.rivals_sentences),
        Paragraph(search.held if search else ""),
        _edge(summary.edge),
    ]


def _edge(edge: Edge) -> Paragraph:
    """Where the pick lies in the region; the change beyond a bound is in the section of the confirmation."""
    bounds = [
        f"the {bound.side} bound of {name} ({f'{shown(bound.bound)} {quantity(name)[1]}'.rstrip()})"
        for name, bound in edge.factors.items()
    ]
    if bounds:
        return Paragraph(f"The selected design is near {all_of(bounds)}: try a wider region.", "warning")
    inside = not edge.beyond_runs
    return Paragraph(f"{edge.sentence.partition('; ')[0].rstrip('.')}.", detail=Detail.ALL if inside else Detail.LEAST)


def _parts_to_make(summary: Summary) -> list[Block]:
    """Parts of every dimension chain, and what a refused one takes and needs; all else is in a section of its own."""
    chains = summary.chains
    sheet = part_sheet(chains)
    chain_name, part_name = NAMES
    columns = (
        part_name,
        replace(chain_name, text=True),
        replace(DRAWN, words="dimension [mm]"),
        Column[Any]("grade", at=(2, "graded"), text=True),
        Column[Any]("moved", words="moved [mm]", at=(2, "shift")),
    )
    note = "; ".join(f"{label(name)}: {yield_words(chain)}" for name, chain in chains.items())
    table = replace(sheet, caption="Parts to make", columns=columns, note=note).block
    estimates = estimates_note({name: size for chain in chains.values() for name, size in chain.drawn_sizes.items()})
    return [
        table,
        Paragraph(estimates, "warning"),
        *(block for name, chain in chains.items() for block in refusal_blocks(name, chain)),
    ]


def _clearances(summary: Summary) -> list[Block]:
    """The pick with its tolerances next to the baseline, the meaning of its clearances, and the class of the bearing."""
    inputs = [factor for factor in summary.asked.factors if factor.name in summary.pick]
    plays = [MEANINGS[factor.key] for factor in inputs if factor.key in MEANINGS]
    meaning = f"Clearances: {', '.join(plays)}." if plays else ""
    if meaning and summary.operating_clearances_mm:
        meaning += " Clearances in operation include the effects of fits, heat and rotation."
        meaning += least_words(summary)
    widest = SENTENCE_END.split(summary.tolerances_sentence or "")
    too_fine = summary.tolerances_warning or ""
    return [
        replace(_selected(summary, inputs), note=meaning),
        Paragraph(summary.clearance_class),
        *_temperatures(summary.confirmation),
        Paragraph("" if too_fine in summary.obstacles.tolerances else too_fine, "warning"),
        Paragraph(widest[0]),
        Paragraph(" ".join(widest[1:2]), detail=Detail.ALL),
    ]


def _temperatures(points: Mapping[str, ConfirmedPoint]) -> list[Block]:
    """Steady temperatures at baseline and pick, and what the inputs of the heat balance leave open; nothing without a balance."""
    baseline, pick = points["baseline"].temperatures_C, points["pick"].temperatures_C
    if baseline is None or pick is None:
        return []
    balance = points["pick"].thermal
    ranges = None if balance is None else balance.ranges
    rows = [
        (quantity(name)[0], baseline[name].text, figure.text, range_ends(ranges[TEMPERATURES[name]]) if ranges else "")
        for name, figure in pick.items()
    ]
    header = ("steady state [°C]", "baseline", "selected", "selected, over inputs (90 %)")
    note = "Inputs: unknown conductances, shares of the heat and level of the loss. Errors: of the simulation (95 %)."
    others = [Paragraph(f"The selected design {other_ranges(ranges)}.", "small")] if ranges else []
    return [Table("Temperatures", header, rows, note), *others]


def _robust_points(summary: Summary) -> Table:
    """Pick and points of the robust front: the gain that holds over the unknown inputs, and in how many cases there is one."""
    names, inputs = summary.asked.names, summary.asked.factors
    front = summary.robust and summary.robust.front
    rows = [
        [
            point_words(point.name.removeprefix("robust ")),
            *(factor.text(point.factors[factor.name], 1) for factor in inputs),
            *(_gain_and_share(point.gains.get(name), point.chances.gains.get(name)) for name in names),
            _gain_and_share(None, point.chances.all),
        ]
        for point in (front.confirmed if front else ())
    ]
    header = ("", *(label(factor.name) for factor in inputs), *(quantity(name)[0] for name in names), "all")
    note = "Gain over the baseline that holds over the unknown inputs, and the probability of a gain in per cent."
    return Table("Over the unknown inputs", header, rows, note)


def _gain_and_share(gain: float | None, share: Share | None) -> str:
    gain_text = "" if gain is None else f"{100.0 * gain:.1f} %, "
    return "" if share is None else f"{gain_text}{share.of_hundred}"


def _selected(summary: Summary, inputs: Sequence[Factor]) -> Table:
    """The pick of each factor with its tolerance, the baseline, both in operation, and the grade of the parts."""

    def tolerance(factor: Factor) -> str:
        width = tolerance_of(summary, factor)
        return f"± {rounded_down(width)}" if width else ""

    baseline = summary.confirmation["baseline"].factors
    columns: tuple[Column[Factor], ...] = (
        Column("", words="", cell=lambda factor: label(factor.name)),
        Column("", words="selected", cell=lambda factor: factor.text(summary.pick[factor.name])),
        Column("", words="tolerance", cell=tolerance),
        Column("", words="baseline", cell=lambda factor: factor.text(baseline[factor.name])),
        Column("", words="in operation", cell=lambda factor: factor.text(in_operation(summary, factor, "pick")[0])),
        Column(
            "",
            words="baseline in operation",
            cell=lambda factor: factor.text(in_operation(summary, factor, "baseline")[0]),
        ),
        Column("", words=GRADE, cell=lambda factor: next((w.grade for w in _widths(summary, factor) if w.grade), "")),
    )
    return replace(Sheet("Selected clearances", columns, inputs).block.without_empty_columns(), tiles=(GRADE,))


def _widths(summary: Summary, factor: Factor) -> list[Made | FactorTolerance]:
    """What the parts of a factor are made to, and its widest tolerance."""
    widths = (summary.made.get(factor.name), (summary.tolerances or {}).get(factor.name))
    return [width for width in widths if width is not None]


def tolerance_of(summary: Summary, factor: Factor) -> float | None:
    """Half-width of the tolerance of a factor: that its parts are made to, else the widened one of the pick, else as stated."""
    return next((width.half_width for width in _widths(summary, factor) if width.half_width), factor.tolerance)


def _gains(summary: Summary) -> Table:
    before, after = (summary.confirmation[name].responses for name in ("baseline", "pick"))
    rows = [(label(name), before[name].text, after[name].text, signed(gain)) for name, gain in summary.gains.items()]
    header = ("response", "baseline", "selected", "change")
    where = " over the duty" if summary.duty else ""
    note = ", ".join(part for part in SIGNS_NOTE.rstrip(".").split(", ") if any(part[0] in row[-1] for row in rows))
    return Table(f"Changes{where} confirmed by simulation (95 % intervals)", header, rows, f"{note}." if note else "")


def limits(summary: Summary) -> Table:
    """Limits judged by simulation at every confirmed point."""
    rows = [
        (point_words(name), _bound(limit), with_error(limit.value, limit.error), *_verdict(limit))
        for name, point in summary.confirmation.items()
        for limit in point.every_limit
    ]
    header = ("point", "limit", "simulated", "verdict", "probability")
    return Table("Limits judged by simulation, every point", header, rows, LIMITS_NOTE, text_columns=(1, 3))


def _limits_judged(summary: Summary) -> Table:
    """Every limit at the baseline and at the pick, and the odds that the pick keeps all those of a response."""
    points = [summary.confirmation[name] for name in ("baseline", "pick")]
    rows = []
    for base, limit in zip(*(point.every_limit for point in points), strict=True):
        odds, classes = summary.limits[limit.response].odds, ["", ""]
        if limit.response not in summary.asked.names and not summary.duty:
            classes = [f" ({cage.cell})" for point in points for cage in (point.cage or {}).values()]
        rows.append(
            (
                _bound(limit),
                f"{with_error(limit.value, limit.error)}{classes[1]}",
                *_verdict(limit),
                odds.of_hundred if odds else "",
                f"{LIMITS[base.verdict][:1]} {with_error(base.value, base.error)}{classes[0]}",
            )
        )
    header = ("limit", "selected", "verdict", "probability", "met over unknown inputs [%]", "baseline")
    return Table("Limits judged by simulation", header, rows, text_columns=(2,))


def _bound(limit: Limit) -> str:
    return f"{label(limit.response)} {SENSES[limit.sense]} {shown(limit.bound)}"


def _verdict(limit: Limit) -> tuple[str, str]:
    """The verdict with its sign, and the probability of keeping the limit."""
    return LIMITS[limit.verdict], "" if limit.probability is None else chance(limit.probability)


FACTORS: tuple[Column[Factor], ...] = (
    Column("factor", cell=lambda factor: f"{factor.letter}: {label(factor.name)}"),
    Column("key", words="key of the scene", text=True),
    Column("centre", cell=lambda factor: factor.text(factor.centre)),
    Column("step"),
    Column("region", cell=lambda factor: f"{factor.text(factor.low)} to {factor.text(factor.high)}"),
    Column("resolution"),
    Column("tolerance", cell=lambda factor: f"± {shown(factor.tolerance)}" if factor.tolerance else ""),
)


def settings(summary: Summary) -> Section:
    """Factors, responses and scene as the study states them."""
    asked = summary.asked
    effort = (
        f"{shown(asked.design_replicates)} replicates per design run, {shown(asked.turns)} counted shaft turns per replicate, "
        f"{shown(asked.confirmation_replicates)} replicates per confirmed point"
    )
    goals = [(label(response.name), *_goal(response)) for response in asked.responses]
    columns = ("response", "goal", "limits", "weight", "model")
    values = [
        (f"{table}.{key}", shown(value, 6))
        for table, keys in asked.scene.items()
        if isinstance(keys, Mapping)
        for key, value in keys.items()
        if value is not None and not isinstance(value, Mapping)
    ]
    blocks: list[Block] = [
        Paragraph(f"Study {asked.study_file}, scene {asked.scene_file}; {effort}."),
        Sheet("Factors", FACTORS, asked.factors).block,
        Table("Responses", columns, goals, text_columns=(1, 4)),
        Table("Scene: the bearing and its operation", ("key", "value"), values, folded=True),
    ]
    return Section("asked", "What was asked", blocks)


def _goal(response: Response) -> tuple[str, str, str, str]:
    goal = {"min": "small", "max": "large", "none": "watched"}.get(response.goal, response.goal)
    if response.target is not None:
        goal = f"at {shown(response.target)}"
    ends = ((response.lower, "≥"), (response.upper, "≤"))
    limits = [f"{sign} {shown(bound)}" for bound, sign in ends if bound is not None]
    return goal, ", ".join(limits), shown(response.weight), response.model


def confirmation(summary: Summary) -> Section:
    """Simulated responses at every confirmed point compared with those that the surfaces predicted."""
    points, asked = summary.confirmation, summary.asked
    caption = "Simulated with fresh seeds (95 % intervals)"
    blocks: list[Block] = [by_point(caption, asked, points, lambda point, name: point.responses[name].text)]
    # The surfaces predict the gains of their own pick, which another may have overtaken.
    name = nearest(asked, summary.front.pick.factors, {name: point.factors for name, point in points.items()})
    simulated = points[name].gains or {}
    rows = [
        [
            label(response),
            change(gain),
            *((change(simulated[response]), sign_of(simulated[response])) if response in simulated else ("", "")),
        ]
        for response, gain in summary.front.predicted_gains.items()
    ]
    columns = ("response", "on the surfaces", "simulated", "verdict")
    caption = f"Gains predicted by the surfaces and simulated, {point_words(name)}"
    blocks.append(Table(caption, columns, rows, text_columns=(3,)))
    blocks += [changes(summary), limits(summary), Paragraph(summary.edge.sentence)]
    reasons = [(point_words(name), point.reason) for name, point in points.items() if point.reason]
    blocks.append(Table("Why these points", ("point", "reason"), reasons, text_columns=(1,)))
    return Section("confirmation", "Confirmation", blocks)


def changes(summary: Summary) -> Table:
    """Gains over the baseline at every confirmed point that has any."""
    asked, caption = summary.asked, "Changes from the baseline at every confirmed point"
    points = {name: point for name, point in summary.confirmation.items() if point.gains}
    table = by_point(caption, asked, points, lambda point, name: _signed(point.gains.get(name)), Detail.ALL)
    header = ("point", *map(label, asked.columns), *(quantity(name)[0] for name in asked.names))
    return replace(table, header=header, note=SIGNS_NOTE)


def _signed(gain: Gain | None) -> str:
    return "" if gain is None else signed(gain)


WIDTHS: tuple[Column[tuple[str, FactorTolerance]], ...] = (
    Column("factor", label, at=0),
    Column("tolerance", cell=lambda row: f"± {rounded_down(row[1].half_width or 0.0)}"),
    Column("share", share_with_interval, "share of the parts (95 %)", error=(1, "interval"), at=(1, "probability")),
    Column("grade", str, "grade of the parts, their widths", at=(1, "parts_words"), text=True),
    Column("limited_by", label, "limited by", at=(1, "limited_by"), text=True),
)


def tolerances(widths: Mapping[str, FactorTolerance]) -> Table:
    """The widest tolerances that keep the gain."""
    return Sheet("Widest tolerances that keep the gains", WIDTHS, list(widths.items())).block


ROW = 34.0  # height of the bars of a term [pt]


def power(summary: Summary) -> Section:
    """Power by term at the confirmed points, baseline and pick as bars."""
    confirmed = {point_words(name): point for name, point in summary.confirmation.items()}
    points = {name: point.power_terms_W for name, point in confirmed.items() if point.power_terms_W}
    every = list(dict.fromkeys(term for terms in points.values() for term in terms))
    # Terms of laws that the scene leaves out are zero everywhere.
    terms = [term for term in every if any(watts.get(term) for watts in points.values())]
    terms.sort(key=lambda term: -abs(next(iter(points.values())).get(term, 0.0)))
    rows = [[term.replace("_", " "), *(_watts(terms_of.get(term)) for terms_of in points.values())] for term in terms]
    notes = ["Terms that are zero everywhere are left out."] if len(terms) < len(every) else []
    notes += _maker(confirmed)
    bars = {name: points[name] for name in map(point_words, ("baseline", "pick")) if name in points}
    blocks: list[Block] = [
        *([Figures([power_bars(terms, bars).svg], "Power loss by cause.")] if bars else []),
        Table("Power loss by term", ["term", *(f"{name} [W]" for name in points)], rows, " ".join(notes)),
    ]
    return Section("power", "Power by term", blocks)


def _maker(confirmed: Mapping[str, ConfirmedPoint]) -> list[str]:
    """A sentence on the friction by the maker's model, where the scene states a designation."""
    checks = {name: point.friction_check for name, point in confirmed.items() if point.friction_check}
    shares = [f"{name} {check.ratio:.2f}" for name, check in checks.items() if check.ratio]
    if not shares:
        return []
    power = next(iter(checks.values())).skf_power_W
    return [f"Power loss over the {power:.3g} W of SKF's friction model: {', '.join(shares)}."]


def _watts(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}" if abs(value) < 100.0 else f"{value:.1f}"


def motion(motion: Mapping[str, DrawnMotion]) -> Section | None:
    """Orbits of the cage centre, and the moving bearing."""
    if not motion:
        return None
    path = "Path of the cage centre about the guide centre, and enlarged; triangle: start, square: end."
    caption = f"{path} The radius of the dashed circle is half of the diametral guide clearance."
    pictures = [orbit(name, run, guided).svg for guided in (True, False) for name, run in motion.items()]
    return Section("motion", "Motion of the bearing", [Figures(pictures, caption), Widget("bearing")])


def orbit(name: str, motion: DrawnMotion, guided: bool) -> Still:
    """Cage centre along and across the load: in the whole guide clearance, or enlarged."""
    title = f"{name}{'' if guided else ', enlarged'}"
    radius = motion.guide_radius_um if guided else None
    return Still(f"Cage orbit at the {title}", partial(_orbit, title, *motion.orbit_um, radius), height=326.0)


def _orbit(title: str, x: Sequence[float], y: Sequence[float], radius: float | None, axis: "Axes") -> None:
    if radius:
        angles = [math.radians(step) for step in range(0, 361, 3)]
        axis.plot(
            [radius * math.cos(angle) for angle in angles], [radius * math.sin(angle) for angle in angles], **GUIDE
        )
    axis.plot(x, y, linewidth=0.5)
    for place, mark, colour, words in ((0, "^", "orange", "start"), (-1, "s", "vermilion", "end")):
        (point,) = axis.plot(
            x[place], y[place], mark, color=COLOURS[colour], markeredgecolor=COLOURS["paper"], markersize=9
        )
        name_marks(point, words, [words])
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(xlabel=f"{title}: along the load [µm]", ylabel="across [µm]")


def power_bars(terms: Sequence[str], points: Mapping[str, Mapping[str, float]]) -> Still:
    """A row of bars a term, one for each point."""
    words = f"Power loss by term, {all_of(points)}"
    return Still(
        words, partial(_power_bars, terms, points), width=640.0, height=56.0 + ROW * len(terms), left_margin=110.0
    )  # fmt: skip


def _power_bars(terms: Sequence[str], points: Mapping[str, Mapping[str, float]], axis: "Axes") -> None:
    thick = 0.8 / len(points)
    looks = (("steel", "edge"), ("blue", "blue"))
    for place, ((name, watts), (fill, edge)) in enumerate(zip(points.items(), looks, strict=False)):
        values = [watts.get(term) or 0.0 for term in terms]
        rows = [row + thick * (place - 0.5 * (len(points) - 1)) for row in range(len(terms))]
        bars = axis.barh(rows, values, thick, color=COLOURS[fill], edgecolor=COLOURS[edge], linewidth=0.8, label=name)
        axis.bar_label(bars, [f"{value:.4g}" for value in values], padding=3, fontsize=SMALL, color=COLOURS["quiet"])
    axis.set_yticks(range(len(terms)), [term.replace("_", " ") for term in terms])
    axis.margins(x=0.12)
    axis.set(ylim=(len(terms) - 0.5, -0.5), xlabel="power loss [W]")
    axis.grid(axis="y", visible=False)
    axis.spines[:].set_visible(False)
    axis.legend(loc="lower right", fontsize=FONT)
