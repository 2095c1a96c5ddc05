"""The Pareto front: its picks, the gains and limits there, the front with tolerances, and the search in few runs with its sentences."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from doe.report.sections.answer import tolerances
from doe.report.sections.front_pictures import Front, Fronts, hypervolume, search_stills
from doe.report.still import Still
from doe.report.summary import SENSES, Summary, by_point, change, nearest, share_with_interval
from doe.workflow.adaptive import Adaptive, FrontComparison, Pull, near_limits, pulls
from doe.workflow.confirmation import ConfirmedPoint
from doe.workflow.front_record import WITHOUT, EstimatedPoint, Point, SurfaceFront, SurfaceLimit, ToleranceFront
from doe.workflow.judgement import ConfirmedGain, GainPoint, RobustFront
from doe.workflow.problem import Asked, Problem
from doe.workflow.surfaces import PredictedGain
from doe.workflow.whole import StudyResult
from rbdyn.base.blocks import Block, Bullets, Column, Detail, Figures, Heading, Paragraph, Section, Sheet, Table, Widget
from rbdyn.base.words import NORMAL, all_of, chance, counted, improvement, label, quantity, shown, with_error

# Points of a front that are drawn; more cannot be told apart.
MOST_POINTS = 400
FACTOR: Column[Point] = Column("{}", at=("factors", "{}"), unit="of the name", meaning="point, and its prediction")
RESPONSE: Column[Point] = Column("{}", at=("responses", "{}"), unit="of the name", meaning="point, and its prediction")


def front_sheet(factors: Sequence[str], responses: Sequence[str], points: Sequence[Point] = ()) -> Sheet[Point]:
    """The points of a front."""
    columns = (*FACTOR.of(factors), *RESPONSE.of(responses))
    return Sheet("Front", columns, points, file="front.csv", content="One row per point of the front.")


def front(summary: Summary) -> Section:
    """Pictures that answer to the pointer, the picks, and what they are compared with."""
    marks, result = picks(summary), summary.front
    where = f"of the {WITHOUT}" if "without_tolerances" in marks else "of the selected design"
    drawn = _drawn(summary.asked, fronts(summary), marks, summary.confirmation)
    blocks = _pictures(summary.asked, drawn)
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
        *_pictures(asked, _drawn(asked, _fronts(asked, result), marks, {})),
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


def _drawn(
    asked: Asked, sets: Sequence[Front], marks: Mapping[str, Point], confirmed: Mapping[str, ConfirmedPoint]
) -> Fronts:
    """The fronts of a study with the limits of its responses."""
    limits = {response.name: response.bounds for response in asked.responses if response.bounds}
    return Fronts(sets, marks, confirmed, limits)


def _pictures(asked: Asked, drawn: Fronts) -> list[Block]:
    """The controls, pairs of responses with one legend, and parallel coordinates; none without a front of two responses."""
    if not drawn.sets or len(asked.names) < 2:
        return []
    caption = "Each line is a point of the front: its clearances to the left, its responses to the right."
    return [
        Widget("front"),
        Figures([still.svg for still in drawn.pairs(_goals(asked))], "", "pairs"),
        Figures([drawn.parallel(asked.factors, asked.names).svg], caption, "parallel"),
    ]


def _goals(asked: Asked) -> dict[str, str]:
    return {response.name: response.goal for response in asked.responses}


def front_stills(summary: Summary) -> list[Still]:
    """Pairs of responses with the fronts, and baseline and picks both on the surfaces and simulated."""
    return _drawn(summary.asked, fronts(summary), picks(summary), summary.confirmation).pairs(_goals(summary.asked))


def robust_stills(front: RobustFront | None) -> list[Still]:
    """Pairs of gains that hold over the unknown inputs: predicted along the front, and simulated; none without a front."""
    if front is None or not front.confirmed:
        return []
    names = {name: f"gain in {quantity(name)[0]}_percent" for name in front.q2}

    def placed(point: GainPoint | ConfirmedGain) -> Point:
        return Point(point.factors, {names[name]: 100.0 * gain for name, gain in point.gains.items()})

    predicted = Front("front", "by emulators", [placed(point) for point in front.points])
    marks = {point.name.removeprefix("robust "): placed(point) for point in front.confirmed}
    return Fronts([predicted], marks).pairs(dict.fromkeys(names.values(), "min"))


def _picks(caption: str, asked: Asked, marks: Mapping[str, Point], detail: Detail = Detail.LEAST) -> Table:
    def cell(point: Point, name: str) -> str:
        return with_error(point.responses[name], point.errors[name] if isinstance(point, EstimatedPoint) else None)

    return by_point(caption, asked, marks, cell, detail, 1)


def _gains(caption: str, gains: Mapping[str, PredictedGain]) -> Table:
    """Gains on the surfaces."""
    rows = [(label(name), change(gain), gain.verdict) for name, gain in gains.items()]
    return Table(caption, ("response", "change", "verdict"), rows, text_columns=(2,))


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
    point = result.point
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
    table = Table(f"At the ends of the tolerances, {widths}: {kind}", ["point", *map(label, asked.names)], rows)
    return [table, *map(Paragraph, sentences)]


SCALE = (
    "Hypervolume: share of all combinations of the responses, between the best and the worst of each on these fronts, that a "
    "front dominates. Larger is better; all fronts are on one scale."
)
SPENT = "Where each run was spent and why; the larger a mark, the more replicates. Star: the selected design."


def in_few_runs(summary: Summary) -> list[Block]:
    """The search in pictures, and its batches; nothing without one."""
    adaptive = summary.adaptive
    if adaptive is None:
        return []
    progress, *places = search_stills(summary, adaptive)
    rows = [
        (shown(state.runs), f"{volume:.3f}", with_error(state.remaining, state.remaining_error), state.why)
        for state, volume in zip(adaptive.history, adaptive.compared.search, strict=True)
    ]
    header = ("runs", "hypervolume", "expected further gain", "next runs for")
    return [
        Heading("The search in few runs"),
        Bullets(adaptive.sentences[1:]),
        Figures([progress.svg], SCALE),
        *([Figures([still.svg for still in places], SPENT)] if places else []),
        Table("Adaptive search, batch by batch", header, rows, text_columns=(3,)),
    ]


SUFFICIENT_MISS = 1.5  # RMS error in standard deviations up to which the stated uncertainty of emulators is sufficient
CAUSES = {
    "scene": "beyond it the bearing would lose its operating clearance",
    "moves": "where the region was extended as often as allowed",
    "": "where the responses turn",
    "end": "at the edge of the searched region",
}


def search_sentences(outcome: StudyResult) -> list[str]:
    """All sentences on the search; none without one."""
    adaptive, study = outcome.adaptive, outcome.study
    if adaptive is None or outcome.front_comparison is None:
        return []
    return [
        _answer(outcome),
        spent_sentence(study, adaptive),
        limiting_sentence(outcome),
        trust_sentence(study, adaptive),
        comparison_sentence(adaptive, outcome.front_comparison),
    ]


def _answer(outcome: StudyResult) -> str:
    places = [_place(*value) for value in outcome.study.by_factor(outcome.pick.point).items()]
    gains = [f"{name} {improvement(gain.percent, None, gain.goal)}" for name, gain in outcome.gains["pick"].items()]
    return f"The selected design has {all_of(places)}: by simulation {all_of(gains)} than the baseline."


def spent_sentence(study: Problem, adaptive: Adaptive) -> str:
    """The runs and the time of the search, why it ended, and how far its region grew."""
    search, last = adaptive.search, adaptive.search.history[-1]
    scale = 100.0 / last.hypervolume if last.hypervolume > 0.0 else math.nan
    further = with_error(scale * last.remaining, scale * last.remaining_error)
    moved = dict.fromkeys((face.factor, int(face.side > 0)) for face, _ in search.moves)
    grown = [_place(study.factors[place[0]], float(adaptive.edges[place]), " to") for place in moved]
    runs = f"{counted(len(search.spent), 'run')} of design and search and {search.fresh} fresh runs at its points and the baseline"
    growth = f" Its region grew: {all_of(grown)}." if grown else ""
    return (
        f"The search ended because {search.stopped}. It took {runs}, in {adaptive.seconds:.0f} s after the end of the design. "
        f"A search without end is expected to gain {further} % more hypervolume (one standard deviation over the fronts that the "
        f"emulators allow).{growth}"
    )


def limiting_sentence(outcome: StudyResult) -> str:
    """What limits the pick: the cause at every factor, limits nearby, and chains whose parts cannot be made."""
    study, adaptive = outcome.study, outcome.adaptive
    assert adaptive is not None
    limits: dict[str, list[str]] = {}
    for pull in pulls(study, adaptive, outcome.pick.point):
        beyond = math.nan if pull.face is None else pull.face.better
        odds = "" if math.isnan(beyond) else f" (the front continues beyond with a probability of {beyond:.2f})"
        limits.setdefault(_why(study, pull), []).append(f"{_place(pull.factor, pull.value)}{odds}")
    why = [f"{all_of(places)}, {words}" for words, places in limits.items()]
    why += [f"the limit {limit.text} is near" for limit in near_limits(adaptive, study, outcome.limits)]
    refused = [name for name, chain in outcome.chains.items() if chain.refused]
    why += [f"the parts of dimension chain {name} cannot be made" for name in refused]
    return f"What limits the selected design: {'; '.join(why)}."


def _why(study: Problem, pull: Pull) -> str:
    """The cause that limits one factor."""
    if pull.face is not None:
        return _end(study, pull.factor) if pull.face.limited_by == "allowed" else CAUSES[pull.face.limited_by]
    ways = [f"where {all_of(pull.turn)} {'turns' if len(pull.turn) == 1 else 'turn'}"] if pull.turn else []
    gaining = (pull.more, "larger"), (pull.less, "smaller")
    ways += [f"{all_of(names)} would improve with a {size} value" for names, size in gaining if names]
    return " and ".join(ways) or "where no response changes much"


def _end(study: Problem, name: str) -> str:
    """Why the region cannot grow at a factor."""
    ends = study.file.factor[study.factors.index(name)].allowed
    if ends is None:
        return "at the edge of the design region; set allowed = [low, high] to search further"
    if study.file.adaptive.extend:
        return f"at an end of allowed = {ends}"
    return "at the edge of the design region, which extend = false fixes"


def trust_sentence(study: Problem, adaptive: Adaptive) -> str:
    """How well the emulators predicted the fresh runs at their front."""
    search, front = adaptive.search, adaptive.search.front
    optimism = [f"{name} by {100.0 * x:.1f} %" for name, x in zip(study.aims, front.optimism.tolist(), strict=True)]
    missed = np.hypot(search.bias, search.spread).tolist()
    errors = [f"{name} {times:.1f}" for name, times in zip(study.responses, missed, strict=True)]
    overconfident = [name for name, times in zip(study.responses, missed, strict=True) if times > SUFFICIENT_MISS]
    if overconfident:
        claim = f"so their stated uncertainty of {all_of(overconfident)} is too small"
    else:
        claim = "as their stated uncertainty allows"
    return (
        f"At {counted(len(front.points), 'front point')} the emulators were optimistic on average by these shares of the front's range: "
        f"{all_of(optimism)}. Their RMS errors in standard deviations are {all_of(errors)}, {claim}. "
        "The front is reported by these fresh runs alone."
    )


def comparison_sentence(adaptive: Adaptive, volumes: FrontComparison) -> str:
    """The hypervolumes of the front and of those that it is compared with."""
    prediction, fresh = volumes.search[-1], volumes.fresh
    points = len(adaptive.search.front.points)
    share = f" ({100.0 * volumes.surfaces / prediction:.0f} % of the first)" if prediction > 0.0 else ""
    fronts = [
        f"front predicted {prediction:.3f}",
        f"its {counted(points, 'point')} by their fresh runs {with_error(fresh.hypervolume, fresh.error)}",
        f"front on the surfaces, by the same emulators, {volumes.surfaces:.3f}{share}",
    ]
    return f"Hypervolumes on one scale, with the noise of their runs alone: {'; '.join(fronts)}."


def _place(name: str, value: float, before: str = "") -> str:
    words, unit = quantity(name)
    return f"{words}{before} {value:.4g} {unit}".rstrip()
