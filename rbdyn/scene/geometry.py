"""Radii, masses and speeds of a mounted roller bearing in SI, computed once for a scene."""

import math
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.records import Record
from rbdyn.scene import Scene


class Kinematics(NamedTuple):
    """Rolling without slip: orbit (cage) speed and roller spin [rad/s], entrainment speed at the races [m/s]."""

    cage_speed: float
    roller_spin: float
    entrainment: float


class Geometry(Record, eq=False):
    """Geometry from a drawing and its mounting.

    ``raceways``: radii of outer and inner raceway [m], with the mounted diametral ``clearance`` [m] split evenly about the pitch
    circle. ``roller_radii``: radius of each roller [m]; None where all have ``roller_radius``. ``land_radius``, ``rim_radius``:
    radii of the cage body at the land and opposite [m]. ``cage_inertia`` [kg m^2]: stated, or that of a plain ring between these
    radii. ``roller_mass`` [kg]: mass of a plain cylinder. ``centrifugal_force`` [N]: force on it at the nominal speed.
    """

    clearance: float
    raceways: tuple[float, float]
    roller_radius: float
    roller_radii: Array | None
    roller_mass: float
    centrifugal_force: float
    land_radius: float
    rim_radius: float
    cage_inertia: float
    motion: Kinematics

    @property
    def reduced_radii(self) -> tuple[float, float]:
        """Reduced radii of the contacts of a roller with the outer and the inner race [m]."""
        outer, inner = self.raceways
        return 1.0 / (1.0 / self.roller_radius - 1.0 / outer), 1.0 / (1.0 / self.roller_radius + 1.0 / inner)

    def rolling(self, inner_speed: float, outer_speed: float) -> Kinematics:
        """Kinematics at ring speeds [rad/s] other than the nominal ones of ``motion``."""
        return epicyclic(self.raceways, self.roller_radius, inner_speed, outer_speed)


def epicyclic(raceways: tuple[float, float], radius: float, inner_speed: float, outer_speed: float) -> Kinematics:
    """Rolling without slip at ring speeds [rad/s]: cage = (inner R_i + outer R_o)/(R_i + R_o)."""
    outer, inner = raceways
    cage = (inner_speed * inner + outer_speed * outer) / (inner + outer)
    return Kinematics(cage, (outer_speed * outer - cage * (outer - radius)) / radius, (inner_speed - cage) * inner)


def geometry_of(scene: Scene) -> Geometry:
    """Geometry of a scene."""
    bearing, cage = scene.bearing, scene.cage
    # Sums are in the unit of the drawing, so that they are exact there.
    pitch, roller, half = bearing.pitch_diameter_mm, bearing.roller_diameter_mm, 0.5 * scene.mounted_clearance_mm
    land, side = scene.land_diameter_mm, {"outer": -1.0, "inner": 1.0, "roller": 1.0}[cage.guidance]
    rim = pitch + side * roller / 3.0
    raceways = 0.5e-3 * (pitch + roller + half), 0.5e-3 * (pitch - roller - half)
    motion = epicyclic(raceways, 0.5e-3 * roller, *scene.operation.speeds)
    mass = scene.material("roller").density * math.pi / 4.0 * bearing.roller_diameter**2 * bearing.roller_length
    inertia = cage.mass * (land**2 + rim**2) * 1e-6 / 8.0 if cage.inertia is None else cage.inertia
    return Geometry(
        clearance=1e-3 * scene.mounted_clearance_mm,
        raceways=raceways,
        roller_radius=0.5e-3 * roller,
        roller_radii=_roller_radii(scene),
        roller_mass=mass,
        centrifugal_force=mass * 0.5e-3 * pitch * motion.cage_speed**2,
        land_radius=0.5e-3 * land,
        rim_radius=0.5e-3 * rim,
        cage_inertia=inertia,
        motion=motion,
    )


def _roller_radii(scene: Scene) -> Array | None:
    """Radii with the stated errors or a random spread, which the scene's seed fixes: all replicates run one bearing."""
    bearing = scene.bearing
    errors_um = bearing.roller_diameter_errors_um
    if errors_um is None and bearing.roller_diameter_spread_um > 0.0:
        draw = np.random.default_rng(np.random.SeedSequence(scene.numerics.seed, spawn_key=(2**31,)))
        errors_um = list(draw.normal(0.0, bearing.roller_diameter_spread_um, bearing.rollers))
    if errors_um is None or not any(errors_um):
        return None
    return 0.5e-3 * bearing.roller_diameter_mm + 0.5e-6 * np.array(errors_um)
