"""The Pareto front: its picks, the gains and limits there, and the front with tolerances."""

from collections.abc import Mapping, Sequence
from typing import Any

from doe.report.sections.answer import tolerances
from doe.report.sections.front_pictures import Front, drawn_pairs, hypervolume, pair_stills, parallel_still
from doe.report.sections.record import SENSES, change, nearest, share_with_interval
from doe.report.sections.search import in_few_runs
from doe.report.still import Still
from doe.report.summary import Summary
from doe.workflow.confirmation import ConfirmedPoint, point_words
from doe.workflow.front_record import (
    WITHOUT,
    EstimatedPoint,
    Point,
    StatedPoint,
    SurfaceFront,
    SurfaceLimit,
    ToleranceFront,
)
from doe.workflow.judgement import ConfirmedGain, GainPoint, RobustFront
from doe.workflow.problem import Asked
from doe.workflow.surfaces import PredictedGain
from rbdyn.base.blocks import Block, Bullets, Column, Detail, Figures, Paragraph, Section, Sheet, Table, Widget
from rbdyn.base.words import NORMAL, chance, counted, error_alone, label, quantity, shown, with_error

# Points of a front that are drawn; more cannot be told apart.
MOST_POINTS = 400
FACTOR: Column[Point] = Column("{}", at=("factors", "{}"), unit="of the name", meaning="point, and its prediction")
RESPONSE: Column[Point] = Column("{}", at=("responses", "{}"), unit="of the name", meaning="point, and its prediction")


def front_sheet(factors: Sequence[str], responses: Sequence[str], points: Sequence[Point] = ()) -> Sheet[Point]:
    """The points of a front."""
    columns = (*FACTOR.of(factors), *RESPONSE.of(responses))
    return Sheet("Front", columns, points, file="front.csv", content="One row per point of the front.")


def front(summary: Summary, motion: Mapping[str, Any]) -> Section:
    """Pictures that answer to the pointer, the picks, and what they are compared with."""
    marks, result = picks(summary), summary.front
    where = f"of the {WITHOUT}" if "without_tolerances" in marks else "of the selected design"
    blocks = _pictures(summary.asked, fronts(summary), marks, summary.confirmation)
    blocks += _judged(summary.asked, result, marks, where)
    blocks += [tolerances(summary.tolerances or {}), Paragraph(summary.tolerances_sentence or ""), *_search(result)]
    blocks += _with_tolerances(summary.asked, result.tolerance_aware)
    return Section("front", "Pareto front", [*blocks, *in_few_runs(summary)])


def front_blocks(asked: Asked, result: SurfaceFront) -> list[Block]:
    """What ``doe front`` reports: the front as in a report, and at full detail every point of it."""
    points = {str(number): point for number, point in enumerate(result.front, 1)}
    marks = _marks(result, {"knee": result.knee, **result.picks, "pick": result.pick})
    return [
        _picks("Every point of the front", asked, points, Detail.ALL),
        *_pictures(asked, _fronts(asked, result), marks, {}),
        *_judged(asked, result, marks, "of the selected design"),
        *_search(result),
        *_with_tolerances(asked, result.tolerance_aware),
        *_stated_point(result),
    ]


def _judged(asked: Asked, result: SurfaceFront, marks: Mapping[str, Point], where: str) -> list[Block]:
    """The picks, the gains and limits at the pick, and what to think of them."""
    size = f"{len(result.front)} of {result.archive} points"
    return [
        _picks(f"Selected points of the front on the surfaces, {size} (95 % intervals of the mean)", asked, marks),
        _gains(f"Changes on the surfaces {where}", result.predicted_gains),
        Paragraph(result.statement),
        *_doubt(result),
        _limits(f"Limits on the surfaces {where}", result.constraints),
    ]


def _fronts(asked: Asked, result: SurfaceFront, searched: Sequence[Point] = ()) -> list[Front]:
    aware, name = result.tolerance_aware, asked.names[0]
    sets = []
    for role, words, points in (
        ("front", "on the surfaces", result.front),
        ("robust", "with tolerances", [] if aware is None else aware.front),
        ("direct", "of the search in few runs, simulated", searched),
    ):
        ordered = sorted(points, key=lambda point: point.responses[name])
        step = max(len(ordered) / MOST_POINTS, 1.0)
        if ordered:
            sets.append(Front(role, words, [ordered[int(n * step)] for n in range(round(len(ordered) / step))]))
    return sets


def fronts(summary: Summary) -> list[Front]:
    """The front on the surfaces and those compared with it, each sorted by the first response and thinned."""
    return _fronts(summary.asked, summary.front, () if summary.adaptive is None else summary.adaptive.front)


def picks(summary: Summary) -> dict[str, Point]:
    """Baseline and picks of the front by name; "pick" is the one of the study.

    That is the pick of the front, or the one with tolerances; then the other is "without_tolerances".
    """
    result = summary.front
    rules: dict[str, Point] = {"knee": result.knee, **result.picks}
    overtaking = nearest(
        summary.asked, summary.pick, {"": result.pick.factors} | {k: p.factors for k, p in rules.items()}
    )
    if overtaking:
        del rules[overtaking]
        rules["without_tolerances"] = result.pick
    # The surfaces at the pick itself, which is rounded to the resolution of the drawing.
    return _marks(result, rules | {"pick": summary.pick_on_surfaces})


def _marks(result: SurfaceFront, points: Mapping[str, Point]) -> dict[str, Point]:
    return {"baseline": result.baseline, **points}


def _pictures(
    asked: Asked, sets: Sequence[Front], marks: Mapping[str, Point], confirmed: Mapping[str, ConfirmedPoint]
) -> list[Block]:
    """The controls, pairs of responses with one legend, and parallel coordinates; none without a front of two responses."""
    if not sets or len(asked.names) < 2:
        return []
    caption = "Each line is a point of the front: its clearances to the left, its responses to the right."
    across = parallel_still(asked.factors, asked.names, sets, marks)
    return [
        Widget("front"),
        Figures([still.svg for still in _pairs(asked, sets, marks, confirmed)], "", "pairs"),
        Figures([across.svg], caption, "parallel"),
    ]


def _pairs(
    asked: Asked, sets: Sequence[Front], marks: Mapping[str, Point], confirmed: Mapping[str, ConfirmedPoint]
) -> list[Still]:
    """A picture for each pair of responses, and their legend."""
    limits = {response.name: response.bounds for response in asked.responses if response.bounds}
    pairs = drawn_pairs([response.goal for response in asked.responses])
    return pair_stills(asked.names, pairs, sets, marks, confirmed, limits)


def front_stills(summary: Summary) -> list[Still]:
    """Pairs of responses with the fronts, and baseline and picks both on the surfaces and simulated."""
    return _pairs(summary.asked, fronts(summary), picks(summary), summary.confirmation)


def robust_stills(front: RobustFront | None) -> list[Still]:
    """Pairs of gains that hold over the unknown inputs: predicted along the front, and simulated; none without a front."""
    if front is None or not front.confirmed:
        return []
    names = {name: f"gain in {quantity(name)[0]}_percent" for name in front.q2}

    def placed(point: GainPoint | ConfirmedGain) -> Point:
        return Point(point.factors, {names[name]: 100.0 * gain for name, gain in point.gains.items()})

    predicted = Front("front", "by emulators", [placed(point) for point in front.points])
    marks = {point.name.removeprefix("robust "): placed(point) for point in front.confirmed}
    return pair_stills([*names.values()], drawn_pairs(["min"] * len(names)), [predicted], marks)


def _picks(caption: str, asked: Asked, marks: Mapping[str, Point], detail: Detail = Detail.LEAST) -> Table:
    rows = [
        [
            point_words(name),
            *(factor.text(point.factors[factor.name], 1) for factor in asked.factors),
            *(with_error(point.responses[response], _error(point, response)) for response in asked.names),
        ]
        for name, point in marks.items()
    ]
    return Table(caption, ["point", *map(label, asked.columns), *map(label, asked.names)], rows, detail=detail)


def _error(point: Point, response: str) -> float | None:
    return point.errors[response] if isinstance(point, EstimatedPoint) else None


def _gains(caption: str, gains: Mapping[str, PredictedGain]) -> Table:
    """Gains on the surfaces, and by how much two single runs would differ anyway."""
    rows = [
        (label(name), change(gain), gain.verdict, f"{error_alone(gain.scatter)} %" if gain.scatter else "")
        for name, gain in gains.items()
    ]
    return Table(caption, ("response", "change", "verdict", "scatter of two single runs"), rows, text_columns=(2,))


def _doubt(result: SurfaceFront) -> list[Block]:
    """The selection bias of the gains, the probability that the pick dominates the baseline, and why it is the pick."""
    optimism = {name: gain.selection_optimism_percent for name, gain in result.predicted_gains.items()}
    biases = ", ".join(
        f"{quantity(name)[0]} {percent:+.2f} %" for name, percent in optimism.items() if percent is not None
    )
    dominance = result.pick_dominates_baseline
    odds = with_error(dominance.probability, NORMAL * dominance.standard_error)
    pick = "The selected design" if result.tolerance_aware is None else f"The {WITHOUT}"
    return [
        Paragraph(f"Selection bias to expect in these gains: {biases}." if biases else ""),
        Paragraph(
            f"{pick} dominates the baseline with probability {odds} on {dominance.draws} surfaces drawn from their errors (error of the draws alone)."
        ),
        Paragraph(f"Selected on the surfaces: {result.pick.reason}.", "small"),
    ]


LIMITS: tuple[Column[SurfaceLimit], ...] = (
    Column("limit", cell=lambda limit: f"{label(limit.response)} {SENSES[limit.sense]} {shown(limit.limit)}"),
    Column("value", error="error"),
    Column("kept", words="met by the value"),
    Column("probability", chance, "probability of meeting it"),
    Column("demanded_probability", words="required"),
)


def _limits(caption: str, limits: Sequence[SurfaceLimit]) -> Table:
    return Sheet(caption, LIMITS, limits).block


def _stated_point(result: SurfaceFront) -> list[Block]:
    """The point that ``doe front --point`` states, compared with the baseline and the front."""
    point: StatedPoint | None = result.point
    if point is None:
        return []
    size = counted(len(result.front), "point")
    return [
        _gains("Changes on the surfaces at the stated point", point.predicted_gains),
        Bullets([*point.sentences, point.statement]),
        _limits("Limits on the surfaces at the stated point", point.constraints),
        Paragraph(f"The stated point is dominated by {point.dominated_by} of the {size} of the front."),
    ]


def _search(result: SurfaceFront) -> list[Block]:
    """The genetic search behind the front and how far it converged."""
    figures = (
        (result.generations, "generations"), (result.evaluations, "evaluations"), (result.seed, "seed"),
        (result.hypervolume, "hypervolume"), (result.largest_hypervolume, "of at most"),
        (result.archive, "points in the archive"), (result.feasible_share, "feasible share"),
    )  # fmt: skip
    history = result.hypervolume_history
    near = next((number for number, size in enumerate(history, 1) if size >= 0.99 * result.hypervolume), None)
    blocks: list[Block] = [
        Paragraph(f"NSGA-II: {', '.join(f'{words} {shown(value)}' for value, words in figures)}.", "small"),
        Paragraph(f"The search had 99 % of the hypervolume after generation {near}." if near else "", "small"),
    ]
    if len(history) > 2:
        caption = "Hypervolume by generation: a flat end means that the search converged."
        blocks.append(Figures([hypervolume(history).svg], caption))
    return blocks


def _with_tolerances(asked: Asked, aware: ToleranceFront | None) -> list[Block]:
    """The responses at the ends of the tolerances, what these cost, and the share of parts that still dominate the baseline."""
    if aware is None:
        return []
    widths = ", ".join(f"{label(name)} within ± {width:g}" for name, width in aware.half_widths.items())
    kind = "worst case" if aware.quantile is None else f"{100 * aware.quantile:g} % of the parts keep"
    points = {
        "baseline": aware.baseline_robust,
        WITHOUT: aware.plain_pick_robust,
        "selected design": aware.pick.robust,
        "selected design, nominal": aware.pick.responses,
    }
    rows = [(point, *(shown(values.get(name), 5) for name in asked.names)) for point, values in points.items()]
    place = ", ".join(
        f"{factor.words} {factor.text(aware.pick.factors[factor.name], 1)} {factor.unit}".rstrip()
        for factor in asked.factors
    )
    percent, survival = aware.robust_gain_percent, aware.survival
    more = "" if percent is None else f" and {percent:.2f} % more at the ends of the tolerances"
    sentences = [
        f"Front with tolerances: {counted(len(aware.front), 'point')}.",
        f"Selected design: {place}; {aware.pick.reason}.",
        f"Compared with the front without tolerances, it has {aware.nominal_loss_percent:.2f} % less hypervolume at nominal values{more}.",
    ]
    if survival.plain_pick is not None and survival.pick is not None:
        plain = share_with_interval(survival.plain_pick, survival.plain_pick_interval)
        at_pick = share_with_interval(survival.pick, survival.pick_interval)
        sentences.append(f"Parts that still beat the baseline: {plain} ({WITHOUT}), {at_pick} (selected).")
    sentences.append(survival.open_errors)
    if not aware.plain_pick_inside:
        sentences.append(
            f"The tolerances of the {WITHOUT} reach out of the design region: its results are extrapolated."
        )
    table = Table(f"At the ends of the tolerances, {widths}: {kind}", ["point", *map(label, asked.names)], rows)
    return [table, *map(Paragraph, sentences)]
