"""Equilibrium of the bearing of a scene: what ``rbdyn.equilibrium`` and ``rbdyn ball`` call."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from rbdyn.contact.hertz_point import peak_pressure
from rbdyn.faults import InputError
from rbdyn.quasistatic.equilibrium import Solution
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
from rbdyn.scene.ball import SingleRowScene


def equilibrium(scene: BallScene | Scene, start: BallResult | None = None) -> BallResult:
    """Equilibrium of a ball bearing under its load: angles, loads, stiffness, stress and life.

    ``start``: a result nearby, which saves time. The result's ``status`` tells where there is none; nothing is raised for it.
    Raises InputError for a scene of rollers.
    """
    scene = balls_only(scene)
    if not isinstance(scene, SingleRowScene):
        raise InputError([f"bearing.kind = {scene.bearing.kind!r}: is not solved yet"])
    model = row_of(scene)
    warm = start.rows[0] if start is not None and start.rows else None
    began = time.perf_counter()
    solution = SOLVERS[scene.model.solver](model.row, model.control, load_of(scene), given_of(scene), warm)
    took = time.perf_counter() - began
    head = {
        "format": FORMAT,
        "status": solution.status,
        "raceway_control": scene.model.raceway_control,
        "solver": scene.model.solver,
    }
    tail = {
        "cost": {"solve_us": 1e6 * took},
        "versions": versions(),
        "scene": scene.model_dump(mode="json"),
    }
    if not solution.found:
        return BallResult({**head, **tail})
    return BallResult({**head, **row_record(model, solution), **tail}, (solution,))


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
