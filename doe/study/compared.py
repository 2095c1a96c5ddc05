"""Fronts of one study beside each other on one scale: what an adaptive search reached run by run, and what other fronts reach."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from doe.arrays import Array
from doe.pareto.search import hypervolume, non_dominated
from doe.pareto.surrogate_loss import DRAWS, noisy_hypervolume
from doe.study.adaptive import Adaptive, costs_foretold
from doe.study.finished import inputs_digest
from doe.study_file import Study
from rbdyn.records.kept import intact
from rbdyn.result import read_json


@dataclass(frozen=True, eq=False)
class Compared:
    """Hypervolumes between ``ideal`` and ``nadir`` (q,), in costs, of the front foretold and the direct one together.

    By the last emulators: ``search`` (b,), of the fronts foretold before every batch and after the last, and ``surfaces``, of
    the polynomials' front as it is drawn. By the simulator, each with its standard error: ``fresh``, of the search's points by
    their fresh runs, and that of the direct front by its own. ``direct`` is what `kept_direct` found, None without.
    """

    ideal: Array
    nadir: Array
    search: Array
    surfaces: float
    fresh: tuple[float, float]
    direct: Mapping[str, Any] | None
    direct_reached: tuple[float, float] | None


def kept_direct(folder: Path, study: Study) -> dict[str, Any] | None:
    """What a finished direct search of this very study left in its folder, where nothing has changed since; else None.

    ``front``: points with their responses and the 95 % half widths of these; ``evaluations``; ``inputs``, the hash of all
    they follow from. The record of an adaptive search hands them on.
    """
    try:
        record = read_json(folder / "summary.json")
        if not intact(record):
            return None
        direct = record.get("direct")
        found = {**direct, "inputs": record["inputs"]} if direct else record["adaptive"]["compared"]["direct"]
        kept = {key: found[key] for key in ("inputs", "evaluations", "front")}
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    same = [inputs_digest(study, direct=True, robust=robust) for robust in (False, True)]
    return kept if kept["inputs"] in same else None


def compared(study: Study, adaptive: Adaptive, on_surfaces: Array, direct: Mapping[str, Any] | None) -> Compared:
    """Fronts of a search, of the surfaces, (n, k) in factor units, and of a direct search on one scale."""
    found, goals, reached = adaptive.found, adaptive.found.front.goals, None
    fronts = [goals.costs(found.foretold)]
    if direct is not None:
        values, errors = (_columns(study, direct["front"], key) for key in ("responses", "errors"))
        fronts.append(goals.costs(values))
    both = np.vstack(fronts)
    both = both[non_dominated(both)]
    scale = both.min(axis=0), both.max(axis=0)
    if direct is not None:
        known = np.nan_to_num(errors[:, goals.objectives]) / 1.96
        reached = noisy_hypervolume(fronts[1], known, *scale, DRAWS, found.front.seed)
    return Compared(
        *scale,
        search=np.array([hypervolume(goals.costs(found.emulators.predict(each)[0]), *scale) for each in found.fronts]),
        surfaces=hypervolume(costs_foretold(study, adaptive, on_surfaces), *scale),
        fresh=noisy_hypervolume(found.front.costs, found.front.cost_errors, *scale, DRAWS, found.front.seed),
        direct=direct,
        direct_reached=reached,
    )


def _columns(study: Study, front: list[Mapping[str, Any]], key: str) -> Array:
    return np.array([[point[key][name] for name in study.responses] for point in front], float)
