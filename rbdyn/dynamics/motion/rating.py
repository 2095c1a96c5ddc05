"""Rating life of a simulated bearing: ISO/TS 16281 with the loads that every roller saw instead of static ones."""

import math

import numpy as np

from rbdyn.arrays import Array
from rbdyn.dynamics.forces.observe import slice_loads
from rbdyn.dynamics.parameters.model import race_contact_law
from rbdyn.life import turning_rings
from rbdyn.life.rollers import ReferenceLife, reference_life
from rbdyn.scene import Scene


def rating_life(scene: Scene, azimuth: Array, inner_load: Array, outer_load: Array) -> ReferenceLife:
    """Reference life from loads [N] of every roller over time at azimuths [rad], (rows, rollers) each; they should span
    whole cage turns.

    Loads spread over the slices as at rest. Edge stresses count where the roller has a profile; a plain cylinder's
    ends would need a half-space solution. Rings that turn see the mean over all rollers, a ring at rest each place.
    """
    drawing, radius = scene.bearing, 0.5 * scene.bearing.roller_diameter
    nx, ny = np.cos(azimuth), np.sin(azimuth)
    inner, outer = (
        slice_loads(race_contact_law(scene, race), scene.slices, radius, loads, nx, ny)
        for race, loads in (("inner", inner_load), ("outer", outer_load))
    )
    return reference_life(
        inner,
        outer,
        capacity=drawing.rated_capacity,
        gamma=drawing.diameter_ratio,
        turning=turning_rings(*scene.operation.speeds),
        angle=np.mod(azimuth, 2.0 * math.pi),
        edges=drawing.roller_profile != "cylinder",
    )
