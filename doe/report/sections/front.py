"""The Pareto front: its picks, the gains and limits there, the front with tolerances, and the record of ``doe front``."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from doe.pareto import ParetoFront
from doe.pareto.manufacture import ToleranceAware
from doe.pareto.search import REFERENCE, dominates
from doe.report.sections.answer import gains_record, point_record, tolerances
from doe.report.sections.front_pictures import Front, drawn_pairs, hypervolume, legend_still, pair_still, parallel_still
from doe.report.sections.record import SENSES, Record, change, factors, nearest, part, responses, share_with_interval
from doe.report.sections.search import in_few_runs
from doe.response_surface import Surface
from doe.workflow.confirmation import point_words
from doe.workflow.front import SurfaceDoubt, open_errors
from doe.workflow.pick import place_of
from doe.workflow.problem import Problem
from doe.workflow.surfaces import PredictedGain, half_widths, predict_all, predicted_gains, statement
from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Block, Bullets, Detail, Figures, Paragraph, Section, Table, Widget
from rbdyn.base.records import finite
from rbdyn.base.words import chance, counted, error_alone, label, quantity, shown, with_error

WITHOUT = point_words("without_tolerances")
# Points of a front that are drawn; more cannot be told apart.
MOST_POINTS = 400


def front(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Pictures that answer to the pointer, the picks, and what they are compared with."""
    record = part(summary, "front")
    if not record:
        return None
    names = [response["name"] for response in responses(summary)]
    marks = picks(summary)
    where = f"of the {WITHOUT}" if WITHOUT in marks else "of the pick"
    blocks = _pictures(summary, names, {name: point for name, point in marks.items() if complete(point, summary)})
    blocks += [_picks(summary, names, marks), _gains(f"Changes on the surfaces {where}", record.get("predicted_gains"))]
    blocks += [Paragraph(record.get("statement") or ""), *_doubt(record)]
    blocks += [
        _limits(record.get("constraints"), f"Limits on the surfaces {where}"),
        tolerances(part(summary, "tolerances") or {}),
    ]
    blocks.append(Paragraph(part(summary, "tolerances_sentence") or ""))
    blocks += [*_search(record), *_further_fronts(summary), *_stated_point(record)]
    return Section("front", "Pareto front", blocks)


def front_blocks(summary: Record) -> list[Block]:
    """What ``doe front`` reports: the front as in a report, and at full detail every point of it."""
    names = [response["name"] for response in responses(summary)]
    points = {str(number): point for number, point in enumerate(part(summary, "front", "front") or [], 1)}
    every = replace(_picks(summary, names, points), caption="Every point of the front", detail=Detail.ALL)
    section = front(summary, {})
    return [every, *(section.blocks if section else ())]


def front_tables(record: Record) -> dict[str, list[dict[str, Any]]]:
    """Rows of front.csv: the points of the front."""
    return {"front.csv": [{**point["factors"], **point["responses"]} for point in record["front"]]}


def fronts(summary: Record) -> list[Front]:
    """The front on the surfaces and those compared with it, each sorted by the first response and thinned."""
    names = [response["name"] for response in responses(summary)]
    sets: list[Front] = []
    for role, words, points in (
        ("front", "on the surfaces", part(summary, "front", "front")),
        ("robust", "with tolerances", part(summary, "front", "tolerance_aware", "front")),
        ("direct", "of the search in few runs, simulated", part(summary, "adaptive", "front")),
    ):
        whole = [point for point in points or [] if complete(point, summary)]
        if not whole or not names:
            continue
        whole.sort(key=lambda point: point["responses"][names[0]])
        step = max(len(whole) / MOST_POINTS, 1.0)
        sets.append(Front(role, words, [whole[int(number * step)] for number in range(round(len(whole) / step))]))
    return sets


def complete(point: Record, summary: Record) -> bool:
    """Whether every factor and response of a point is in the record, so that it can be drawn."""
    values = [part(point, "factors", factor.name) for factor in factors(summary)]
    values += [part(point, "responses", response["name"]) for response in responses(summary)]
    return None not in values


def picks(summary: Record) -> dict[str, Record]:
    """Baseline and picks of the front by name; "pick" is the one of the study.

    That is the pick of the front, or the one with tolerances; then the other is the pick without tolerances.
    """
    plain = part(summary, "front", "pick")
    points = {"knee": part(summary, "front", "knee")} | (part(summary, "front", "picks") or {})
    points = {name.replace("_", " "): point for name, point in points.items() if point}
    overtaking = nearest(summary, part(summary, "pick"), ({"": plain} if plain else {}) | points)
    if overtaking and plain:
        others = {name: point for name, point in points.items() if name != overtaking}
        points = others | {WITHOUT: plain, "pick": points[overtaking]}
    elif plain:
        points["pick"] = plain
    # The surfaces at the pick itself, which is rounded to the resolution of the drawing.
    if rounded := part(summary, "pick_on_surfaces"):
        points["pick"] = rounded
    baseline = part(summary, "front", "baseline")
    return ({"baseline": baseline} if baseline else {}) | points


def bounds(summary: Record) -> dict[str, list[float]]:
    """Limits of every response that has any."""
    ends = {response["name"]: [response.get("lower"), response.get("upper")] for response in responses(summary)}
    return {name: [x for x in pair if x is not None] for name, pair in ends.items() if pair != [None, None]}


def _pictures(summary: Record, names: Sequence[str], marks: Mapping[str, Record]) -> list[Block]:
    """The controls, pairs of responses with one legend, and parallel coordinates; none without a front of two responses."""
    sets = fronts(summary)
    if not sets or len(names) < 2:
        return []
    confirmed = part(summary, "confirmation") or {}
    limits = bounds(summary)
    goals = {response["name"]: str(response.get("goal")) for response in responses(summary)}
    pairs = [
        pair_still((one, names[one]), (two, names[two]), sets, marks, confirmed, limits)
        for one, two in drawn_pairs([goals.get(name, "min") for name in names])
    ]
    caption = "Each line is a point of the front: its clearances to the left, its responses to the right."
    across = parallel_still(factors(summary), names, sets, marks)
    stills = [*pairs, legend_still(sets, marks, bool(confirmed), bool(limits))]
    return [
        Widget("front"),
        Figures([still.svg for still in stills], "", "pairs"),
        Figures([across.svg], caption, "parallel"),
    ]


def _picks(summary: Record, names: Sequence[str], marks: Mapping[str, Record]) -> Table:
    columns = factors(summary)
    rows = [
        [
            name,
            *(factor.text(part(point, "factors", factor.name), 1) for factor in columns),
            *(with_error(part(point, "responses", response), part(point, "errors", response)) for response in names),
        ]
        for name, point in marks.items()
    ]
    header = ["point", *(label(factor.name) for factor in columns), *map(label, names)]
    size = [len(part(summary, "front", "front") or []), part(summary, "front", "archive")]
    points = f", {size[0]} of {size[1]} points" if all(size) else ""
    return Table(f"Picks of the Pareto front on the surfaces{points} (95 % intervals of the mean)", header, rows)


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
    """The selection bias of the gains, the probability that the pick dominates the baseline, and why it is the pick."""
    gains = record.get("predicted_gains") or {}
    optimism = {name: gain.get("selection_optimism_percent") for name, gain in gains.items()}
    biases = ", ".join(
        f"{quantity(name)[0]} {percent:+.2f} %" for name, percent in optimism.items() if percent is not None
    )
    sentences = [f"Selection bias to expect in these gains: {biases}." if biases else ""]
    if dominance := record.get("pick_dominates_baseline"):
        odds = with_error(dominance.get("probability"), 1.96 * (dominance.get("standard_error") or 0.0))
        pick = f"The {WITHOUT}" if record.get("tolerance_aware") else "The pick"
        draws = f"{dominance['draws']} surfaces" if dominance.get("draws") else "surfaces"
        sentences.append(
            f"{pick} dominates the baseline with probability {odds} on {draws} drawn from their errors (error of the draws alone)."
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


def _stated_point(record: Record) -> list[Block]:
    """The point that ``doe front --point`` states, compared with the baseline and the front."""
    point = record.get("point")
    if not point:
        return []
    size = counted(len(record["front"]), "point")
    return [
        _gains("Changes on the surfaces at the stated point", point["predicted_gains"]),
        Bullets([*point["sentences"], point["statement"]]),
        _limits(point["constraints"], "Limits on the surfaces at the stated point"),
        Paragraph(f"The stated point is dominated by {point['dominated_by']} of the {size} of the front."),
    ]


def _search(record: Record) -> list[Block]:
    """The genetic search behind the front and how far it converged."""
    figures = [
        f"{words} {shown(record[key])}"
        for key, words in (("generations", "generations"), ("evaluations", "evaluations"), ("seed", "seed"),
                           ("hypervolume", "hypervolume"), ("largest_hypervolume", "of at most"),
                           ("archive", "points in the archive"), ("feasible_share", "feasible share"))
        if record.get(key) is not None
    ]  # fmt: skip
    blocks: list[Block] = [Paragraph(f"NSGA-II: {', '.join(figures)}.", "small")] if figures else []
    history = [value for value in record.get("hypervolume_history") or [] if value is not None]
    if history and record.get("hypervolume") is not None:
        near = next((number for number, size in enumerate(history, 1) if size >= 0.99 * record["hypervolume"]), None)
        words = f"The search had 99 % of the hypervolume after generation {near}." if near else ""
        blocks.append(Paragraph(words, "small"))
    if len(history) > 2:
        blocks.append(
            Figures(
                [hypervolume(history).svg], "Hypervolume by generation: a flat end means that the search converged."
            )
        )
    return blocks


def _further_fronts(summary: Record) -> list[Block]:
    """The front with tolerances and the one of a search in few runs."""
    blocks: list[Block] = []
    if aware := part(summary, "front", "tolerance_aware"):
        blocks += _with_tolerances(summary, aware)
    return [*blocks, *in_few_runs(summary)]


def _with_tolerances(summary: Record, aware: Record) -> list[Block]:
    """The responses at the ends of the tolerances, what these cost, and the share of parts that still dominate the baseline."""
    names = [response["name"] for response in responses(summary)]
    widths = ", ".join(f"{label(name)} within ± {width:g}" for name, width in (aware.get("half_widths") or {}).items())
    share = aware.get("quantile")
    kind = "worst case" if share is None else f"{100 * share:g} % of the parts keep"
    pick, survival = aware.get("pick") or {}, aware.get("survival") or {}
    points = {
        "baseline": aware.get("baseline_robust"),
        WITHOUT: aware.get("plain_pick_robust"),
        "pick": pick.get("robust"),
        "pick, nominal": pick.get("responses"),
    }
    rows = [(point, *(shown(values.get(name), 5) for name in names)) for point, values in points.items() if values]
    sentences = [f"Front with tolerances: {counted(len(aware.get('front') or []), 'point')}."]
    if pick.get("factors"):
        place = ", ".join(
            f"{factor.words} {factor.text(part(pick, 'factors', factor.name), 1)} {factor.unit}".rstrip()
            for factor in factors(summary)
        )
        reason = f"; {pick['reason']}" if pick.get("reason") else ""
        sentences.append(f"Pick: {place}{reason}.")
    if aware.get("nominal_loss_percent") is not None:
        less = f"Compared with the front without tolerances, it has {aware['nominal_loss_percent']:.2f} % less hypervolume at nominal values"
        percent = aware.get("robust_gain_percent")
        more = "" if percent is None else f" and {percent:.2f} % more at the ends of the tolerances"
        sentences.append(f"{less}{more}.")
    if None not in (survival.get("plain_pick"), survival.get("pick")):
        shares = [
            share_with_interval(survival[name], survival.get(f"{name}_interval")) for name in ("plain_pick", "pick")
        ]
        sentences.append(
            f"Parts that still dominate the baseline: {shares[0]} at the {WITHOUT}, {shares[1]} at the pick."
        )
    sentences.append(survival.get("open_errors") or "")
    if aware.get("plain_pick_inside") is False:
        sentences.append(
            f"The tolerances of the {WITHOUT} reach out of the design region: its figures are extrapolated."
        )
    caption = f"At the ends of the tolerances, {widths}: {kind}" if widths else f"At the ends of the tolerances: {kind}"
    return [Table(caption, ["point", *map(label, names)], rows), *map(Paragraph, sentences)]


def front_record(study: Problem, surfaces: list[Surface], front: ParetoFront) -> dict[str, Any]:
    """JSON of ``doe front``: factor and response values in their own units and senses."""
    assert front.uncertainty is not None
    sure = front.uncertainty
    rows = zip(front.points, front.values, half_widths(surfaces, study.coded(front.points)), strict=True)
    points = [
        {**point_record(study, *row), "non_dominated_probability": float(probability)}
        for row, probability in zip(rows, sure.non_dominated, strict=True)
    ]
    gains = predicted_gains(study, surfaces, front.points[front.pick])
    place = place_of(study, front.points[front.pick])
    pick = "The pick" if front.tolerance_aware is None else f"The {WITHOUT}"
    picks: dict[str, Any] = {rule: points[row] for rule, row in front.picks.items()}
    record: dict[str, Any] = {
        "front": points,
        "hypervolume": front.hypervolume,
        "largest_hypervolume": REFERENCE ** front.costs.shape[1],
        "hypervolume_history": front.hypervolume_history.tolist(),
        "ideal": _extreme(study, front, front.costs.argmin(axis=0)),
        "nadir": _extreme(study, front, front.costs.argmax(axis=0)),
        "knee": points[front.knee],
        "pick": {
            **points[front.pick],
            "reason": front.pick_reason,
            "beyond_runs": place.beyond,
            "at_bounds": place.at_bounds,
        },
        "picks": picks,
        "baseline": predicted_record(study, surfaces, study.baseline),
        "pick_dominates_baseline": {
            "probability": sure.pick_dominates,
            "standard_error": sure.pick_dominates_error,
            "draws": sure.draws,
        },
        "predicted_gains": _with_optimism(gains, sure.optimism),
        "statement": f"{statement(gains)} {place.sentence(pick)}".rstrip(),
        "constraints": _limits_record(study, surfaces, front.points[front.pick]),
        "archive": front.archive_size,
        "feasible_share": front.feasible,
        **{key: getattr(front, key) for key in ("evaluations", "generations", "seed")},
    }
    if front.tolerance_aware is not None:
        record["tolerance_aware"] = tolerance_aware_record(study, surfaces, front.tolerance_aware)
        picks["tolerance_aware"] = record["tolerance_aware"]["pick"]
    return record


def predicted_record(study: Problem, surfaces: list[Surface], point: Array) -> dict[str, Any]:
    """Factors, responses on the surfaces and their 95 % half widths at a point in factor units."""
    coded = study.coded(point)[None]
    return point_record(study, point, predict_all(surfaces, coded)[0], half_widths(surfaces, coded)[0])


def given_point_record(study: Problem, surfaces: list[Surface], front: ParetoFront, point: Array) -> dict[str, Any]:
    """A point that was asked for: its gains over the baseline, and what the front makes of it."""
    gains = predicted_gains(study, surfaces, point)
    coded = study.coded(point)
    costs = study.goals.costs(predict_all(surfaces, coded[None])[0])
    place = place_of(study, point)
    return {
        **predicted_record(study, surfaces, point),
        "predicted_gains": gains_record(gains),
        "dominated_by": int(dominates(front.costs, costs).sum()),
        "beyond_runs": place.beyond,
        "at_bounds": place.at_bounds,
        "constraints": _limits_record(study, surfaces, point),
        "sentences": [gain.sentence for gain in gains],
        "statement": f"{statement(gains)} {place.sentence('The point')}".rstrip(),
    }


def _with_optimism(gains: list[PredictedGain], optimism: Array | None) -> dict[str, Any]:
    record = gains_record(gains)
    for gain, excess in zip(gains, [] if optimism is None else optimism.tolist(), strict=False):
        record[gain.response]["selection_optimism_percent"] = 100.0 * excess / abs(gain.baseline)
    return record


def _extreme(study: Problem, front: ParetoFront, rows: Any) -> dict[str, float]:
    """The responses with a goal where each is best or worst."""
    pairs = zip(front.goals.objectives, rows, strict=True)
    return {study.responses[index]: float(front.values[row, index]) for index, row in pairs}


def _limits_record(study: Problem, surfaces: list[Surface], point: Array) -> list[dict[str, Any]]:
    """Every limit at a point in factor units: what the surfaces say there, and the probability of keeping it."""
    coded = study.coded(point)
    values, errors = predict_all(surfaces, coded[None])[0], half_widths(surfaces, coded[None])[0]
    doubt = SurfaceDoubt(study, surfaces)
    return [
        {
            "response": study.responses[index],
            "sense": sense,
            "limit": limit,
            "value": float(values[index]),
            "error": finite(errors[index]),
            "kept": bool(values[index] <= limit if sense == "<=" else values[index] >= limit),
            "probability": doubt.kept_with(index, sense, limit, coded),
            "demanded_probability": study.file.confirmation.limit_probability,
        }
        for index, sense, limit in study.goals.limited
    ]


def tolerance_aware_record(study: Problem, surfaces: list[Surface], aware: ToleranceAware) -> dict[str, Any]:
    """JSON of a tolerance-aware front. ``robust``: what manufacture leaves of a response (of its distance from the
    target, where it has one).
    """
    goals = [response for response in study.file.response if response.goal != "none"]
    named = [response.name for response in goals]
    sign = np.array([-1.0 if response.goal == "max" else 1.0 for response in goals])

    def robust(costs: Array) -> dict[str, float]:
        return dict(zip(named, (sign * costs).tolist(), strict=True))

    points = study.actual(aware.points)
    front = [
        {
            "factors": study.by_factor(point),
            "responses": dict(zip(study.responses, values.tolist(), strict=True)),
            "robust": robust(costs),
        }
        for point, values, costs in zip(points, aware.values, aware.costs, strict=True)
    ]
    gains = predicted_gains(study, surfaces, points[aware.pick])
    return {
        "kind": aware.box.kind,
        "quantile": aware.box.quantile if aware.box.kind == "quantile" else None,
        "distribution": aware.box.distribution,
        "half_widths": study.by_factor(aware.box.half * study.step),
        "front": front,
        "hypervolume": aware.hypervolume,
        "pick": {**front[aware.pick], "reason": aware.pick_reason},
        "picks": {rule: front[row] for rule, row in aware.picks.items()},
        "baseline_robust": robust(aware.baseline_costs),
        "plain_pick_robust": robust(aware.plain_pick_costs),
        "plain_pick_inside": aware.plain_inside,
        "nominal_loss_percent": aware.nominal_loss_percent,
        "robust_gain_percent": finite(aware.robust_gain_percent),
        "pick_gains_percent": {gain.response: gain.percent for gain in gains},
        "survival": {
            "plain_pick": aware.plain_survives,
            "pick": aware.pick_survives,
            "standard_error": aware.survival_error,
            "plain_pick_interval": None if aware.plain_interval is None else list(aware.plain_interval),
            "pick_interval": None if aware.pick_interval is None else list(aware.pick_interval),
            "open_errors": open_errors(surfaces),
        },
    }
