"""One row from a scene: parameters of the kernels in SI, load and constraint."""

import math
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Mask
from rbdyn.base.faults import InputError
from rbdyn.contact.point_contact import PointContact, ball_on_race
from rbdyn.mounting.rings import UNCHANGED, GrooveChange
from rbdyn.properties.materials import Material, equivalent_modulus
from rbdyn.quasistatic.row.ball import CommonCage, Control, FixedShare, FrictionShare, Spinning
from rbdyn.quasistatic.row.equilibrium import NO_LOAD
from rbdyn.quasistatic.row.ring import Row, at_rest
from rbdyn.scene.ball import BallModel, BallRow, BallScene, SingleRowScene
from rbdyn.scene.fits import row_change

INNER_SHARE = {"outer": 0.0, "inner": 1.0, "half": 0.5}
# Least blend load [N], which keeps quotients finite where nothing turns.
VANISHING = 1e-200
# Share of the largest ball load below which a ball is idle: its angle and its gyroscopic moment do no harm.
IDLE = 1e-3


def carrying(loads: Array) -> Mask:
    """Whether balls carry their ``loads`` [N] (Z,) on a raceway; idle ones do not."""
    return np.asarray(loads > max(NO_LOAD, IDLE * loads.max()))


class RowModel(NamedTuple):
    """One row with its raceway control, as ``equilibrium.solve`` takes them, and its contacts."""

    row: Row
    control: Control
    inner_contact: PointContact
    outer_contact: PointContact


def contacts(drawing: BallRow, ball: Material, inner: Material, outer: Material) -> tuple[PointContact, PointContact]:
    """Hertz contacts of a ball with the inner and the outer race."""
    diameter, gamma = drawing.ball_diameter, drawing.gamma
    return (
        ball_on_race(diameter, drawing.inner_groove_factor, gamma, equivalent_modulus(ball, inner)),
        ball_on_race(diameter, drawing.outer_groove_factor, -gamma, equivalent_modulus(ball, outer)),
    )


def cage_speed(drawing: BallRow, inner_speed: float, outer_speed: float) -> float:
    """Common cage speed at the unloaded contact angle [rad/s], the rings at speeds [rad/s]."""
    return 0.5 * (inner_speed * (1.0 - drawing.gamma) + outer_speed * (1.0 + drawing.gamma))


def row_model(
    drawing: BallRow,
    model: BallModel,
    ball: Material,
    inner: Material,
    outer: Material,
    inner_speed: float,
    outer_speed: float,
    change: GrooveChange = UNCHANGED,
) -> RowModel:
    """One row of balls between two rings that turn at ``inner_speed`` and ``outer_speed`` [rad/s].

    ``change``: of the grooves by rotation, fits and temperature.
    """
    z = drawing.balls
    azimuth = 2.0 * math.pi * np.arange(z) / z
    diameter, pitch = drawing.ball_diameter, drawing.pitch_diameter
    angle, between = drawing.contact_angle, drawing.groove_centre_distance
    to_inner, to_outer = contacts(drawing, ball, inner, outer)
    mass = ball.density * math.pi * diameter**3 / 6.0
    cage = cage_speed(drawing, inner_speed, outer_speed)
    pull = 0.5 * mass * pitch * cage**2
    resting = at_rest(pull, to_outer.stiffness)
    row = Row(
        cosine=np.cos(azimuth),
        sine=np.sin(azimuth),
        axial=np.full(z, between * math.sin(angle)),
        radial=np.full(z, between * math.cos(angle) + drawing.interference_m + change.radial),
        inner_reach=np.full(z, (drawing.inner_groove_factor - 0.5) * diameter + change.inner_reach),
        outer_reach=np.full(z, (drawing.outer_groove_factor - 0.5) * diameter + change.outer_reach),
        inner_stiffness=to_inner.stiffness,
        outer_stiffness=to_outer.stiffness,
        lever=0.5 * pitch + (drawing.inner_groove_factor - 0.5) * diameter * math.cos(angle),
        inner_groove_radius=drawing.inner_groove_factor * diameter,
        centrifugal_force=pull,
        rest_deflection=resting[0],
        rest_energy=resting[1],
    )
    spinning = Spinning(
        ratio=diameter / pitch,
        ball_diameter=diameter,
        orbit_mass=0.5 * mass * pitch,
        inertia=0.1 * mass * diameter**2 if model.gyroscopic else 0.0,
        turning=1.0 if model.gyroscopic == "unsigned" else -1.0,
        inner_speed=inner_speed,
        outer_speed=outer_speed,
        blend_load=max(model.light_load_share * pull, VANISHING),
        friction=model.friction_limit,
    )
    return RowModel(row, control_of(model, spinning, cage, to_inner, to_outer), to_inner, to_outer)


def control_of(
    model: BallModel, spinning: Spinning, cage: float, to_inner: PointContact, to_outer: PointContact
) -> Control:
    """Parameters of the raceway control of the scene."""
    if model.raceway_control == "common_cage":
        return CommonCage(cage)
    if model.raceway_control == "hybrid":
        weights = [
            contact.semi_major * contact.elliptic_second * contact.stiffness ** (4.0 / 3.0)
            for contact in (to_inner, to_outer)
        ]
        return FrictionShare(weights[0] / weights[1], spinning)
    return FixedShare(INNER_SHARE[model.raceway_control], spinning)


def row_of(scene: SingleRowScene) -> RowModel:
    """The row of a single-row scene, with the ring growth that the scene states.

    Raises InputError for a scene whose heat balance would have to decide the growth first.
    """
    if scene.thermal is not None:
        raise InputError(
            "[thermal]: is for the equilibrium and for --sweep alone; state temperatures in [mounting] instead"
        )
    ball, inner, outer = (scene.material(part) for part in ("ball", "inner_ring", "outer_ring"))
    return row_model(scene.bearing, scene.model, ball, inner, outer, *scene.operation.speeds, row_change(scene))


def load_of(scene: BallScene) -> Array:
    """Load on the inner ring, (Fx, Fy, Fz [N], Mx, My [N m])."""
    return np.array([*scene.operation.load, *scene.operation.moment])


def constraint_of(scene: BallScene) -> Array:
    """Prescribed displacements [m, rad], NaN where the load rules."""
    return np.array(scene.operation.displacements, float)


def clearance_of(row: Row) -> tuple[float, float]:
    """Diametral clearance [m] of a row with its growth, and its unloaded contact angle [rad], 0 for an interference."""
    reach, radial = float(row.inner_reach[0] + row.outer_reach[0]), float(row.radial[0])
    return 2.0 * (reach - radial), math.acos(min(radial / reach, 1.0))
