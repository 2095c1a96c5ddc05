"""Equilibrium of the bearing of a scene: what ``rbdyn.equilibrium`` and ``rbdyn ball`` call."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from rbdyn.contact.hertz_point import peak_pressure
from rbdyn.quasistatic.double_decker import Start, solve_double_decker
from rbdyn.quasistatic.double_decker_model import double_decker_of, load_record, middle_record
from rbdyn.quasistatic.equilibrium import Solution
from rbdyn.quasistatic.growth_model import growth_record, row_change
from rbdyn.quasistatic.model import RowModel, given_of, load_of, row_of
from rbdyn.quasistatic.result import (
    FORMAT,
    BallResult,
    ball_records,
    displacement_record,
    stiffness_record,
)
from rbdyn.quasistatic.solvers import SOLVERS
from rbdyn.result import versions
from rbdyn.scene import BallScene, Scene, balls_only
from rbdyn.scene.ball import DoubleDeckerScene, SingleRowScene


def equilibrium(scene: BallScene | Scene, start: BallResult | None = None) -> BallResult:
    """Equilibrium of a ball bearing under its load: angles, loads, stiffness, stress and life.

    ``start``: a result nearby, which saves time. The result's ``status`` tells where there is none; nothing is raised for it.
    Raises InputError for a scene of rollers.
    """
    scene = balls_only(scene)
    if isinstance(scene, DoubleDeckerScene):
        return _double_decker(scene, start)
    assert isinstance(scene, SingleRowScene)
    model = row_of(scene)
    warm = start.rows[0] if start is not None and start.rows else None
    began = time.perf_counter()
    solution = SOLVERS[scene.model.solver](model.row, model.control, load_of(scene), given_of(scene), warm)
    took = time.perf_counter() - began
    head, tail = _frame(scene, solution.status, took)
    if not solution.found:
        return BallResult({**head, **tail})
    grown = growth_record(scene, {"inner_less_outer_race": row_change(scene)})
    return BallResult({**head, **row_record(model, solution), **grown, **tail}, (solution,))


def _double_decker(scene: DoubleDeckerScene, start: BallResult | None) -> BallResult:
    model = double_decker_of(scene)
    warm = Start(*start.rows) if start is not None and len(start.rows) == 2 else None
    began = time.perf_counter()
    solution = solve_double_decker(model.stack, load_of(scene), given_of(scene), model.middle_given, warm)
    took = time.perf_counter() - began
    head, tail = _frame(scene, solution.status, took)
    if not solution.found:
        return BallResult({**head, **tail})
    rows = solution.inner, solution.outer
    layers = {
        name: row_record(layer, row)
        for name, layer, row in zip(("inner", "outer"), (model.inner, model.outer), rows, strict=True)
    }
    grown = growth_record(
        scene, dict(zip(("inner_less_middle_bore", "middle_less_outer_race"), model.changes, strict=True))
    )
    whole = {
        **displacement_record(solution.displacement),
        "stiffness": stiffness_record(solution.stiffness),
        "reaction": load_record(solution.reaction),
        "middle_ring": middle_record(model, solution),
        "residual_N": solution.residual,
        "iterations": solution.steps + sum(row.steps for row in rows),
    }
    return BallResult({**head, **whole, **layers, **grown, **tail}, rows)


def _frame(scene: BallScene, status: str, took: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """How every record begins and ends."""
    head = {
        "format": FORMAT,
        "status": status,
        "raceway_control": scene.model.raceway_control,
        "solver": scene.model.solver,
    }
    tail = {
        "cost": {"solve_us": 1e6 * took},
        "versions": versions(),
        "scene": scene.model_dump(mode="json"),
    }
    return head, tail


def row_record(model: RowModel, solution: Solution) -> dict[str, Any]:
    """What is reported of one row in equilibrium."""
    searches = {} if solution.searches is None else {"searches": solution.searches}
    return {
        **displacement_record(solution.displacement),
        "balls": ball_records(solution),
        "max_stress_MPa": {
            "inner": 1e-6 * float(np.max(peak_pressure(model.inner_contact, solution.inner_load))),
            "outer": 1e-6 * float(np.max(peak_pressure(model.outer_contact, solution.outer_load))),
        },
        "stiffness": stiffness_record(solution.stiffness),
        "residual_N": solution.residual,
        "iterations": solution.steps,
        **searches,
    }
