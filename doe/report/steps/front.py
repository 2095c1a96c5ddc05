"""The Pareto front, and the tolerance-aware one beside it, as JSON and on the terminal."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from doe.arrays import Array
from doe.pareto import ParetoFront
from doe.pareto.manufacture import ToleranceAware
from doe.pareto.search import REFERENCE, dominates
from doe.report.steps.confirmation import gains_record, point_record
from doe.report.words import change, share_with_interval
from doe.response_surface import Surface
from doe.study.back_off import SurfaceDoubt
from doe.study.drawn import half_widths, predict_all
from doe.study.edge import place_of
from doe.study.goals import goals_of
from doe.study.predicted import PredictedGain, predicted_gains, statement
from doe.study.shares import open_errors
from doe.study_file import Study
from rbdyn.cli.terminal import print_table
from rbdyn.records.record import finite
from rbdyn.records.words import chance, counted, error_alone, with_error


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


def print_front(record: dict[str, Any], verbose: bool = False) -> None:
    """Baseline, picks, gains and convergence of a front; verbosely, every point of it."""
    names = [*record["baseline"]["factors"], *record["baseline"]["responses"]]
    points = {name: record[name] for name in ("baseline", "knee", "pick")}
    points |= {f"pick by {rule}": point for rule, point in record["picks"].items()}
    points |= {"the point asked for": record["point"]} if "point" in record else {}
    if verbose:
        points |= {str(number): point for number, point in enumerate(record["front"], 1)}
    rows = [(name, *_cells(point)) for name, point in points.items()]
    title = f"Pareto front on the surfaces, {len(record['front'])} of {record['archive']} points"
    print_table(f"{title} (95 % intervals of the mean)", ("", *names), rows)
    _print_gains("the pick", record["predicted_gains"])
    sure = record["pick_dominates_baseline"]
    print(record["statement"])
    luck = {name: gain["selection_optimism_percent"] for name, gain in record["predicted_gains"].items()}
    flattered = ", ".join(f"{name} {percent:+.2f} %" for name, percent in luck.items())
    print(f"the rule picks what errors flatter; luck expected in these gains: {flattered}")
    chance = with_error(sure["probability"], 1.96 * sure["standard_error"])
    drawn = f"on {sure['draws']} surfaces drawn from their errors it dominates the baseline with probability {chance} (error of the draws alone)"
    print(f"pick: {record['pick']['reason']}; {drawn}")
    for limit in record["constraints"]:
        print(f"limit: {limit_sentence(limit)}")
    if record["feasible_share"] < 1.0:
        print(f"{100 * record['feasible_share']:.1f} % of the evaluated points keep all limits")
    _print_convergence(record)
    if "tolerance_aware" in record:
        print_tolerance_aware(record["tolerance_aware"])
    if "point" in record:
        point = record["point"]
        _print_gains("the point asked for", point["predicted_gains"])
        for sentence in [*point["sentences"], point["statement"]]:
            print(sentence)
        for limit in point["constraints"]:
            print(f"limit at the point asked for: {limit_sentence(limit)}")
        dominating, whole = point["dominated_by"], counted(len(record["front"]), "point")
        print(f"{dominating} of the {whole} of the front {'dominates' if dominating == 1 else 'dominate'} it")


def _print_convergence(record: dict[str, Any]) -> None:
    history, whole = record["hypervolume_history"], record["hypervolume"]
    reached = next(number for number, each in enumerate(history, 1) if each >= 0.99 * whole)
    size = f"hypervolume {whole:.4f} of {record['largest_hypervolume']:.3f}"
    when = f"generation {reached} of {record['generations']}, {record['evaluations']} evaluations"
    print(f"{size}; 99 % of it after {when}")


def _print_gains(whose: str, gains: dict[str, Any]) -> None:
    rows = []
    for name, gain in gains.items():
        scatter = gain["single_run_scatter_percent"]
        rows.append(
            (name, change(gain), gain["verdict"], "unknown" if scatter is None else f"{error_alone(scatter)} %")
        )
    header = ("", "against the baseline", "verdict", "scatter of two single runs")
    print_table(f"predicted gains of {whose}", header, rows)


def _cells(point: dict[str, Any]) -> list[str]:
    errors = point.get("errors", {})
    factors = [f"{x:.5g}" for x in point["factors"].values()]
    return factors + [with_error(x, errors.get(name)) for name, x in point["responses"].items()]


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


def limit_sentence(limit: Mapping[str, Any]) -> str:
    """A limit at a point of the surfaces in words, the probability reached beside the one demanded."""
    value = with_error(limit["value"], limit["error"])
    odds = f"kept with a probability {_of(limit['probability'])}, {limit['demanded_probability']:g} demanded"
    return f"{limit['response']} {limit['sense']} {limit['limit']:g}: {value} on the surfaces, {odds}"


def _of(probability: float) -> str:
    text = chance(probability)
    return text if text[0].isalpha() else f"of {text}"


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


def print_tolerance_aware(record: dict[str, Any]) -> None:
    """What the tolerances cost, and whether the picks survive them."""
    pick, names = record["pick"], list(record["baseline_robust"])
    widths = ", ".join(f"{name} within ± {width:g}" for name, width in record["half_widths"].items())
    kind = "worst case" if record["kind"] == "worst_case" else f"{100 * record['quantile']:g} % of the parts keep"
    rows = [
        ("baseline", *(f"{record['baseline_robust'][name]:.5g}" for name in names)),
        ("plain pick", *(f"{record['plain_pick_robust'][name]:.5g}" for name in names)),
        ("tolerance-aware pick", *(f"{pick['robust'][name]:.5g}" for name in names)),
        ("the same, nominal", *(f"{pick['responses'][name]:.5g}" for name in names)),
    ]
    print_table(f"after manufacture, {widths}: {kind}", ("", *names), rows)
    at = ", ".join(f"{name} = {x:.5g}" for name, x in pick["factors"].items())
    print(f"tolerance-aware pick: {at}; {pick['reason']}")
    less = f"{record['nominal_loss_percent']:.2f} % less hypervolume than the plain one in nominal values"
    percent, survival = record["robust_gain_percent"], record["survival"]
    more = "" if percent is None else f", and {percent:.2f} % more in what manufacture leaves"
    print(f"the tolerance-aware front has {less}{more}")
    plain, aware = (
        f"{share_with_interval(survival[name], survival[f'{name}_interval'])}" for name in ("plain_pick", "pick")
    )
    print(f"parts that still dominate the baseline: {plain} at the plain pick, {aware} at the tolerance-aware one")
    print(survival["open_errors"])
    if not record["plain_pick_inside"]:
        print("the tolerance box of the plain pick reaches out of the region: its figures are extrapolated")
