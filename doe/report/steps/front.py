"""What ``doe front`` reports: the front on surfaces, or the one that an adaptive search found."""

import math
from collections.abc import Sequence
from string import ascii_uppercase
from typing import Any

import numpy as np

from doe.adaptive.emulators import LEAST_DEVIATION
from doe.emulator.likelihood import JITTER
from doe.pareto import ParetoFront
from doe.pareto.manufacture import ToleranceAware
from doe.pareto.search import REFERENCE, dominates
from doe.pareto.simulated import DRAWS, noisy_hypervolume
from doe.report.steps.confirmation import gains_record, point_record
from doe.response_surface import Surface
from doe.study_file import Study
from doe.workflow.adaptive import Adaptive, Compared, Pull, levels_at, near_limits, pulls
from doe.workflow.front import SurfaceDoubt, open_errors
from doe.workflow.goals import goals_of, known_tolerances, region_of
from doe.workflow.pick import place_of
from doe.workflow.surfaces import PredictedGain, half_widths, predict_all, predicted_gains, statement
from doe.workflow.whole import StudyResult
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.records import finite
from rbdyn.base.words import counted, improvement, quantity, with_error

SURE = 1.5  # root mean square miss in standard deviations up to which emulators knew how little they know
HELD = {
    "scene": "beyond it the bearing would lose its operating clearance",
    "moves": "where the region has been moved as often as it may be",
    "": "where the responses turn",
    "end": "where the region searched ends",
}


def search_sentences(outcome: StudyResult) -> list[str]:
    """All of it; empty without an adaptive search."""
    adaptive, study = outcome.adaptive, outcome.study
    if adaptive is None or outcome.compared is None:
        return []
    return [
        _answer(outcome),
        spent_sentence(study, adaptive),
        held_sentence(outcome),
        trust_sentence(study, adaptive),
        beside_sentence(adaptive, outcome.compared),
    ]


def _answer(outcome: StudyResult) -> str:
    study, before = outcome.study, outcome.study.at(()).categories
    point = zip(study.factors, outcome.pick.point.tolist(), strict=True)
    places = [_place(*each) for at, each in enumerate(point) if at not in study.inactive]
    places += [f"{name} = {kind} (baseline: {before[name]})" for name, kind in study.categories.items()]
    places += [f"no {study.factors[at]}, which means nothing there" for at in study.inactive]
    gained = [f"{each.response} {improvement(each.percent, None, each.goal)}" for each in outcome.gains["pick"]]
    return f"The pick has {_listed(places)}: by simulation {_listed(gained)} than the baseline."


def spent_sentence(study: Study, adaptive: Adaptive) -> str:
    """What the search spent, why it ended, how far its region grew."""
    found, last = adaptive.found, adaptive.found.history[-1]
    left = 100.0 * last.left / last.hypervolume if last.hypervolume > 0.0 else math.nan
    moved = dict.fromkeys((face.factor, int(face.side > 0)) for face, _ in found.moves)
    grown = [_place(study.factors[place[0]], float(adaptive.edges[place]), " to") for place in moved]
    return (
        f"The search ended because {found.stopped}: {counted(len(found.spent), 'run')} of design and search and {found.fresh} fresh ones at "
        f"its points and the baseline, in {adaptive.seconds:.0f} s from the end of the design on, with at most {left:.1f} % of the "
        f"hypervolume of its front still to gain.{f' Its region grew: {_listed(grown)}.' if grown else ''}"
    )


def held_sentence(outcome: StudyResult) -> str:
    """What limits the pick at every factor, the limits that it is near to, chains whose parts cannot be made."""
    study, adaptive = outcome.study, outcome.adaptive
    assert adaptive is not None
    held: dict[str, list[str]] = {}
    for each in pulls(study, adaptive, outcome.pick.point):
        beyond = math.nan if each.face is None else each.face.better
        odds = "" if math.isnan(beyond) else f" (the front goes on beyond with a probability of {beyond:.2f})"
        held.setdefault(_why(study, each), []).append(f"{_place(each.factor, each.at)}{odds}")
    why = [f"{_listed(places)}, {words}" for words, places in held.items()]
    why += [f"the limit {each.shown} is near" for each in near_limits(adaptive, study, outcome.limits)]
    refused = [name for name, each in outcome.chains.items() if each.refused]
    why += [f"the parts of dimension chain {name} cannot be made" for name in refused]
    return f"What limits the pick: {'; '.join(why)}."


def _why(study: Study, pull: Pull) -> str:
    """What holds one factor."""
    if pull.face is not None:
        return _end(study, pull.factor) if pull.face.held == "allowed" else HELD[pull.face.held]
    ways = [f"where {_listed(pull.turn)} {'turns' if len(pull.turn) == 1 else 'turn'}"] if pull.turn else []
    gaining = (pull.more, "larger"), (pull.less, "smaller")
    ways += [f"{_listed(names)} would improve with a {size} value" for names, size in gaining if names]
    return " and ".join(ways) or "where nothing changes much"


def _end(study: Study, name: str) -> str:
    """Why the region may not grow at a factor."""
    ends = study.file.factor[study.factors.index(name)].allowed
    if ends is None:
        return "at the edge of the design region; set allowed = [low, high] to search further"
    return f"where allowed = {ends} ends" if study.file.adaptive.extend else "where extend = false keeps the search"


def trust_sentence(study: Study, adaptive: Adaptive) -> str:
    """How well the emulators predicted the fresh runs at their front."""
    found, front = adaptive.found, adaptive.found.front
    wanted = [study.responses[index] for index in front.goals.objectives]
    flattered = [f"{name} by {100.0 * x:.1f} %" for name, x in zip(wanted, front.optimism.tolist(), strict=True)]
    missed = np.hypot(found.bias, found.spread).tolist()
    errors = [f"{name} {times:.1f}" for name, times in zip(study.responses, missed, strict=True)]
    sure = [name for name, times in zip(study.responses, missed, strict=True) if times > SURE]
    claim = (
        f"so their stated uncertainty of {_listed(sure)} is too small" if sure else "as their stated uncertainty allows"
    )
    return (
        f"At {counted(len(front.points), 'front point')} the emulators were optimistic on average by these shares of the front's range: "
        f"{_listed(flattered)}. Their RMS errors in standard deviations are {_listed(errors)}, {claim}. "
        "The front is reported by these fresh runs alone."
    )


def beside_sentence(adaptive: Adaptive, compared: Compared) -> str:
    """The hypervolumes of the front and of those that it is compared with."""
    predicted, (fresh, error) = float(compared.search[-1]), compared.fresh
    points = len(adaptive.found.front.points)
    share = f" ({100.0 * compared.surfaces / predicted:.0f} % of the first)" if predicted > 0.0 else ""
    fronts = [
        f"front predicted {predicted:.3f}",
        f"its {counted(points, 'point')} by their fresh runs {with_error(fresh, 1.96 * error)}",
        f"front on the surfaces, by the same emulators, {compared.surfaces:.3f}{share}",
    ]
    return f"Hypervolumes on one scale, with the noise of their runs alone: {'; '.join(fronts)}."


def _place(name: str, value: float, before: str = "") -> str:
    words, unit = quantity(name)
    return f"{words}{before} {value:.4g} {unit}".rstrip()


def _listed(parts: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))


def adaptive_record(study: Study, adaptive: Adaptive) -> dict[str, Any]:
    """``front``: finalists by their fresh runs, with 95 % half widths; ``runs`` of design and search, ``fresh`` ones apart;
    ``hypervolume`` of the predicted front, on the scale of its own ideal and nadir; ``foretold``: the 200 points of that front that have most of its hypervolume; ``points``: every run of design and search with its replicates and why it was made."""
    found, front = adaptive.found, adaptive.found.front
    rows = zip(front.points, front.values, front.half_widths, strict=True)
    points = [
        point_record(study, at[: len(study.factors)], *rest) | {"factors": _factors(study, at)} for at, *rest in rows
    ]
    costs = front.goals.costs(found.predictions)
    scale = costs.min(axis=0), costs.max(axis=0)
    fresh = noisy_hypervolume(front.costs, front.cost_errors, *scale, DRAWS, front.seed)
    return {
        "front": points,
        "pick": {**points[front.pick], "reason": front.pick_reason},
        "runs": len(found.spent),
        "fresh": found.fresh,
        "hypervolume": found.history[-1].reached,
        "hypervolume_fresh": fresh[0],
        "hypervolume_fresh_error": 1.96 * fresh[1],
        "history": [
            {
                "runs": each.runs,
                "hypervolume": each.reached,
                "deviation": each.deviation,
                "gained": finite(each.gained),
                "left": each.left,
                "why": each.why,
            }
            for each in found.history
        ],
        "stopped": found.stopped,
        "extended": [
            {
                "factor": study.factors[face.factor],
                "side": "upper" if face.side > 0 else "lower",
                "from": _actual(study, face.factor, face.at),
                "to": _actual(study, face.factor, to),
            }
            for face, to in found.moves
        ],
        "region": {name: ends for name, ends in zip(study.factors, adaptive.edges.tolist(), strict=True)},
        "points": [
            {"factors": _factors(study, point, drawn=why != "design"), "replicates": int(count), "why": why}
            for point, count, why in zip(found.searched.points, found.spent, found.why, strict=True)
        ],
        "foretold_points": len(found.archive),
        "foretold": archive_table(study, adaptive, found.shown),
        "missed": {
            name: {"bias": float(bias), "spread": float(spread)}
            for name, bias, spread in zip(study.responses, found.bias, found.spread, strict=True)
        },
        "emulators": emulators_record(study, adaptive),
        "failed": len(adaptive.failures),
        "seed": front.seed,
        "seconds": adaptive.seconds,
        "emulator_seconds": found.seconds,
    }


def compared_record(study: Study, adaptive: Adaptive, compared: Compared) -> dict[str, Any]:
    """Hypervolumes between one ``ideal`` and ``nadir``, in costs: of the predicted fronts in the course of the ``search`` and of
    the ``surfaces``' front by the last emulators; of the search's points, ``fresh``, by their fresh runs, with 95 % half
    widths."""
    names = [study.responses[index] for index in adaptive.front.goals.objectives]
    return {
        **{key: dict(zip(names, getattr(compared, key).tolist(), strict=True)) for key in ("ideal", "nadir")},
        "search": compared.search.tolist(),
        "surfaces": compared.surfaces,
        "fresh": {"hypervolume": compared.fresh[0], "error": 1.96 * compared.fresh[1]},
    }


def _actual(study: Study, factor: int, coded: float) -> float:
    return float(study.centre[factor] + region_of(study)[factor] * study.step[factor] * coded)


def _factors(study: Study, point: Array, drawn: bool = True) -> dict[str, Any]:
    """Numbers, as they are drawn where they are, and categories of a point (k + c,) of the search, by name."""
    numbers = point[: len(study.factors)]
    return study.by_factor(study.rounded(numbers) if drawn else numbers) | study.at(levels_at(study, point)).categories


def archive_table(study: Study, adaptive: Adaptive, rows: Rows | slice = slice(None)) -> list[dict[str, Any]]:
    """The front that the emulators predict, whole or some ``rows``, with 95 % half widths."""
    found = adaptive.found
    errors = [f"{name}_error" for name in study.responses]
    table = np.hstack([found.predictions, 1.96 * found.deviations])[rows].tolist()
    names = [*study.responses, *errors]
    return [
        _factors(study, at) | dict(zip(names, row, strict=True))
        for at, row in zip(found.archive[rows], table, strict=True)
    ]


def emulators_record(study: Study, adaptive: Adaptive) -> dict[str, Any]:
    """Mean and standard deviation of every response without its scatter, anywhere.

    The coordinates of a point are x = (factor - ``centre``) / ``half_range``, and of each of the ``categories`` 1 for the level
    that it has and 0 for each other one; ``pick``: that of the pick. Factors in the places that ``inactive`` lists by level are
    at 0 there. A response that has ``shares`` s of factors knows these by ln(1 + s x)/s. ``points`` (n, k) are the runs'
    factors, ``kinds`` (n, c) the places of their levels. A response is a trend of ``terms`` with ``coefficients``, A the first factor, and a process: the
    covariances of the point with the runs, Matern of smoothness 5/2 with ``lengths`` a coordinate and ``variance``, times
    ``weights`` (n,). The runs' ``values`` (n,) have the variances ``noise`` (n,). The deviation is that of universal kriging
    times ``stretch``, ``least`` at least.
    """
    emulators, numbers = adaptive.found.emulators, len(study.factors)
    runs = emulators.runs.points
    categories = zip(study.file.category, adaptive.study.levels, strict=True)
    responses = {}
    each_one = zip(study.responses, emulators.each, emulators.stretch.tolist(), emulators.shares, strict=True)
    for name, one, stretch, shares in each_one:
        given = one.hyperparameters
        responses[name] = {
            "terms": list(one.terms),
            "coefficients": one.solution.coefficients.tolist(),
            "lengths": given.lengths.tolist(),
            "variance": given.variance,
            "weights": one.solution.weights.tolist(),
            "values": one.values.tolist(),
            "noise": (one.variances + given.nugget + JITTER * given.variance).tolist(),
            "stretch": stretch,
            "shares": list(shares),
            "least": LEAST_DEVIATION * float(abs(one.values).max()),
        }
    return {
        "centre": study.centre.tolist(),
        "half_range": (region_of(study) * study.step).tolist(),
        "categories": [
            {
                "name": each.name,
                "levels": list(each.categories),
                "pick": place,
                "inactive": [[*map(study.factors.index, each.inactive_at(at))] for at in range(len(each.categories))],
            }
            for each, place in categories
        ],
        "points": runs[:, :numbers].tolist(),
        "kinds": [levels_at(study, point) for point in runs],
        "responses": responses,
    }


def asked_record(study: Study) -> dict[str, Any]:
    """Factors with their ranges and responses with their goals."""
    reach, known = region_of(study), known_tolerances(study)
    low, high = (study.actual(side * reach) for side in (-1.0, 1.0))
    return {
        "factors": [
            {
                "letter": letter,
                **factor.model_dump(include={"name", "key", "centre", "step", "resolution"}),
                "low": float(low[index]),
                "high": float(high[index]),
                "tolerance": known.get(factor.name),
            }
            for index, (letter, factor) in enumerate(zip(ascii_uppercase, study.file.factor, strict=False))
        ],
        "responses": [response.model_dump() for response in study.file.response],
    }


def front_record(study: Study, surfaces: list[Surface], front: ParetoFront) -> dict[str, Any]:
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
    pick = "The pick" if front.tolerance_aware is None else "The pick without tolerances"
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
        "constraints": _limits(study, surfaces, front.points[front.pick]),
        "archive": front.archive_size,
        "feasible_share": front.feasible,
        **{key: getattr(front, key) for key in ("evaluations", "generations", "seed")},
    }
    if front.tolerance_aware is not None:
        record["tolerance_aware"] = tolerance_aware_record(study, surfaces, front.tolerance_aware)
        picks["tolerance_aware"] = record["tolerance_aware"]["pick"]
    return record


def predicted_record(study: Study, surfaces: list[Surface], point: Array) -> dict[str, Any]:
    """Factors, responses on the surfaces and their 95 % half widths at a point in factor units."""
    coded = study.coded(point)[None]
    return point_record(study, point, predict_all(surfaces, coded)[0], half_widths(surfaces, coded)[0])


def given_point_record(study: Study, surfaces: list[Surface], front: ParetoFront, point: Array) -> dict[str, Any]:
    """A point that was asked for: its gains over the baseline, and what the front makes of it."""
    gains = predicted_gains(study, surfaces, point)
    coded = study.coded(point)
    costs = goals_of(study).costs(predict_all(surfaces, coded[None])[0])
    place = place_of(study, point)
    return {
        **predicted_record(study, surfaces, point),
        "predicted_gains": gains_record(gains),
        "dominated_by": int(dominates(front.costs, costs).sum()),
        "beyond_runs": place.beyond,
        "at_bounds": place.at_bounds,
        "constraints": _limits(study, surfaces, point),
        "sentences": [gain.sentence for gain in gains],
        "statement": f"{statement(gains)} {place.sentence('The point')}".rstrip(),
    }


def _with_optimism(gains: list[PredictedGain], optimism: Array | None) -> dict[str, Any]:
    record = gains_record(gains)
    for gain, excess in zip(gains, [] if optimism is None else optimism.tolist(), strict=False):
        record[gain.response]["selection_optimism_percent"] = 100.0 * excess / abs(gain.baseline)
    return record


def _extreme(study: Study, front: ParetoFront, rows: Any) -> dict[str, float]:
    """The responses with a goal where each is best or worst."""
    pairs = zip(front.goals.objectives, rows, strict=True)
    return {study.responses[index]: float(front.values[row, index]) for index, row in pairs}


def _limits(study: Study, surfaces: list[Surface], point: Array) -> list[dict[str, Any]]:
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
        for index, sense, limit in goals_of(study).limited
    ]


def tolerance_aware_record(study: Study, surfaces: list[Surface], found: ToleranceAware) -> dict[str, Any]:
    """JSON of a tolerance-aware front. ``robust``: what manufacture leaves of a response (of its distance from the
    target, where it has one).
    """
    wanted = [response for response in study.file.response if response.goal != "none"]
    named = [response.name for response in wanted]
    sign = np.array([-1.0 if response.goal == "max" else 1.0 for response in wanted])

    def robust(costs: Array) -> dict[str, float]:
        return dict(zip(named, (sign * costs).tolist(), strict=True))

    points = study.actual(found.points)
    front = [
        {
            "factors": study.by_factor(point),
            "responses": dict(zip(study.responses, values.tolist(), strict=True)),
            "robust": robust(costs),
        }
        for point, values, costs in zip(points, found.values, found.costs, strict=True)
    ]
    gains = predicted_gains(study, surfaces, points[found.pick])
    return {
        "kind": found.box.kind,
        "quantile": found.box.quantile if found.box.kind == "quantile" else None,
        "distribution": found.box.distribution,
        "half_widths": study.by_factor(found.box.half * study.step),
        "front": front,
        "hypervolume": found.hypervolume,
        "pick": {**front[found.pick], "reason": found.pick_reason},
        "picks": {rule: front[row] for rule, row in found.picks.items()},
        "baseline_robust": robust(found.baseline_costs),
        "plain_pick_robust": robust(found.plain_pick_costs),
        "plain_pick_inside": found.plain_inside,
        "nominal_loss_percent": found.nominal_loss_percent,
        "robust_gain_percent": finite(found.robust_gain_percent),
        "pick_gains_percent": {gain.response: gain.percent for gain in gains},
        "survival": {
            "plain_pick": found.plain_survives,
            "pick": found.pick_survives,
            "standard_error": found.survival_error,
            "plain_pick_interval": None if found.plain_interval is None else list(found.plain_interval),
            "pick_interval": None if found.pick_interval is None else list(found.pick_interval),
            "open_errors": open_errors(surfaces),
        },
    }
