"""Rating life of a simulated bearing: ISO/TS 16281 with the loads that every roller saw instead of static ones."""

from __future__ import annotations

import math

import numpy as np

from rbdyn.dynamics.history import History
from rbdyn.dynamics.life import ReferenceLife, Turning, dynamic_capacity, reference_life
from rbdyn.dynamics.model import race_contact_law
from rbdyn.dynamics.slice_loads import slice_loads


def rating_life(history: History) -> ReferenceLife:
    """Reference life from the contact loads of a history, which should span whole cage turns.

    Loads spread over the slices as at rest. Edge stresses count where the roller has a profile; a plain cylinder's
    ends would need a half-space solution. Rings that turn see the mean over all rollers, a ring at rest each place.
    """
    scene, drawing = history.scene, history.scene.bearing
    diameter, pitch = drawing.roller_diameter_mm * 1e-3, drawing.pitch_diameter_mm * 1e-3
    capacity = drawing.dynamic_capacity_N or dynamic_capacity(
        drawing.rollers, diameter, drawing.effective_length_mm * 1e-3, pitch
    )
    nx, ny = np.cos(history.azimuth), np.sin(history.azimuth)
    inner, outer = (
        slice_loads(race_contact_law(scene, race), scene.slices, 0.5 * diameter, loads, nx, ny)
        for race, loads in (("inner", history.inner_load), ("outer", history.outer_load))
    )
    inner_turns, outer_turns = scene.operation.inner_speed_rpm != 0.0, scene.operation.outer_speed_rpm != 0.0
    turning: Turning = "inner" if not outer_turns else "both" if inner_turns else "outer"
    return reference_life(
        inner,
        outer,
        capacity=capacity,
        gamma=diameter / pitch,
        turning=turning,
        angle=np.mod(history.azimuth, 2.0 * math.pi),
        edges=drawing.roller_profile != "cylinder",
    )
