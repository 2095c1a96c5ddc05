"""The front found in few runs, as plain numbers and in words."""

import math
from typing import Any

import numpy as np

from doe.arrays import Array, Rows, or_none
from doe.pareto.surrogate_loss import DRAWS, noisy_hypervolume
from doe.report.steps.confirmation import point_record
from doe.report.steps.emulators import emulators_record
from doe.study.adaptive import Adaptive, levels_at
from doe.study.goals import region_of
from doe.study_file import Study


def adaptive_record(study: Study, adaptive: Adaptive) -> dict[str, Any]:
    """``front``: finalists by their fresh runs, with 95 % half widths; ``runs`` of design and search, ``fresh`` ones apart;
    ``hypervolume`` of the front foretold, on the scale of its own ideal and nadir; ``foretold``: the 200 points of that front that have most of its hypervolume; ``points``: every run of design and search with its replicates and why it was made."""
    found, front = adaptive.found, adaptive.found.front
    rows = zip(front.points, front.values, 1.96 * front.standard_errors, strict=True)
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
                "gained": or_none(each.gained),
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
        "held": held_sentence(study, adaptive),
        "region": {name: ends for name, ends in zip(study.factors, adaptive.edges.tolist(), strict=True)},
        "points": [
            {"factors": _factors(study, point), "replicates": int(count), "why": why}
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
        "sentence": adaptive_sentence(study, adaptive),
    }


def adaptive_sentence(study: Study, adaptive: Adaptive) -> str:
    """What the search spent, why it ended, and whether its emulators were right."""
    found = adaptive.found
    last = found.history[-1]
    left = 100.0 * last.left / last.hypervolume if last.hypervolume > 0.0 else math.nan
    off = ", ".join(
        f"{name} {bias:+.1f} (scatter {spread:.1f})"
        for name, bias, spread in zip(study.responses, found.bias, found.spread, strict=True)
    )
    return (
        f"adaptive front: {len(found.spent)} runs of design and search and {found.fresh} fresh ones at its points in "
        f"{adaptive.seconds:.0f} s; it ended because {found.stopped}, with at most {left:.1f} % of its hypervolume to gain. "
        f"What the fresh runs missed the emulators by, in standard deviations: {off}. {held_sentence(study, adaptive)}{_kinds(adaptive.study)}"
    )


def _kinds(study: Study) -> str:
    """The categories of a search's pick; nothing without any."""
    before = study.at(()).categories
    pairs = [f"{name} = {kind} (baseline: {before[name]})" for name, kind in study.categories.items()]
    return f" The pick has {', '.join(pairs)}." if pairs else ""


def held_sentence(study: Study, adaptive: Adaptive) -> str:
    """What holds the pick foretold at the edges of the region that was searched in the end."""
    words = {
        "allowed": "by what is allowed there",
        "scene": "because no bearing that keeps its clearance in operation is possible beyond",
        "moves": "because the region is not moved more often",
        "": "because the responses turn there",
    }
    held = [
        f"{study.factors[face.factor]} at {_actual(study, face.factor, face.at):.4g} {words[face.held]} (the front goes on beyond "
        f"with a probability of {face.better:.2f})"
        for face in adaptive.found.faces
    ]
    return (
        f"The pick foretold is held in {'; '.join(held)}."
        if held
        else "The pick foretold lies inside the region searched."
    )


def _actual(study: Study, factor: int, coded: float) -> float:
    return float(study.centre[factor] + region_of(study)[factor] * study.step[factor] * coded)


def _factors(study: Study, point: Array) -> dict[str, Any]:
    """Numbers, as they are drawn, and categories of a point (k + c,) of the search, by name."""
    return study.by_factor(study.rounded(point[: len(study.factors)])) | study.at(levels_at(study, point)).categories


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
