"""The front found in few runs, as plain numbers and in words."""

from typing import Any

import numpy as np

from doe.adaptive.emulators import LEAST_DEVIATION
from doe.arrays import Array, Rows
from doe.emulator.likelihood import JITTER
from doe.pareto.simulated import DRAWS, noisy_hypervolume
from doe.report.steps.confirmation import point_record
from doe.study_file import Study
from doe.workflow.adaptive import Adaptive, Compared, levels_at
from doe.workflow.runs import region_of
from rbdyn.records.record import finite


def adaptive_record(study: Study, adaptive: Adaptive) -> dict[str, Any]:
    """``front``: finalists by their fresh runs, with 95 % half widths; ``runs`` of design and search, ``fresh`` ones apart;
    ``hypervolume`` of the front foretold, on the scale of its own ideal and nadir; ``foretold``: the 200 points of that front that have most of its hypervolume; ``points``: every run of design and search with its replicates and why it was made."""
    found, front = adaptive.found, adaptive.found.front
    rows = zip(front.points, front.values, front.half_widths, strict=True)
    points = [
        point_record(study, at[: len(study.factors)], *rest) | {"factors": _factors(study, at)} for at, *rest in rows
    ]
    costs = front.goals.costs(found.foretold)
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
    """Hypervolumes between one ``ideal`` and ``nadir``, in costs: of the fronts foretold in the course of the ``search`` and of
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
    """The front that the emulators foretell, whole or some ``rows``, with 95 % half widths."""
    found = adaptive.found
    errors = [f"{name}_error" for name in study.responses]
    table = np.hstack([found.foretold, 1.96 * found.deviations])[rows].tolist()
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
