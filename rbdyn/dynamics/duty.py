"""Life of a roller bearing, also over a duty, and its stiffness, from static loads by ISO/TS 16281; nothing is simulated for them."""

from collections.abc import Sequence
from functools import partial

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.contact.hertz_line import iso_16281
from rbdyn.dynamics.parameters.model import roller_relief
from rbdyn.life import ROLLER_EXPONENT, DutyLife, LoadCase, duty_life, turning_rings
from rbdyn.life.rollers import ReferenceLife, RollerContacts, Stiffness, reference_life, static_loads, static_stiffness
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.scene import Scene


def static_life(scene: Scene) -> ReferenceLife:
    """Reference life of ISO/TS 16281 at the operating clearance, by its laminae and its own line contact.

    The load is the steady one in line with the rotating one, of a schedule the largest. Gravity, form errors and a flexible support
    are left out. Edge stresses count where the roller has a profile, as in ``motion.rating_life``.
    """
    drawing, geometry = scene.bearing, scene.geometry
    angle = 2.0 * np.pi * np.arange(drawing.rollers) / drawing.rollers
    inner, outer = static_loads(
        static_contacts(scene, angle),
        drawing.rollers,
        scene.operation.largest_load_N,
        geometry.clearance,
        geometry.centrifugal_force,
    )
    return reference_life(
        inner,
        outer,
        capacity=drawing.rated_capacity,
        gamma=drawing.diameter_ratio,
        turning=turning_rings(*scene.operation.speeds),
        edges=drawing.roller_profile != "cylinder",
    )


def row_stiffness(scene: Scene, clearance: float | None = None) -> Stiffness:
    """Stiffness of the row, mean over a pitch, by the loads, contacts and omissions of ``static_life``.

    ``clearance``: diametral [m], by default the operating one. Raises MethodError where no roller carries load.
    """
    geometry = scene.geometry
    return static_stiffness(
        partial(static_contacts, scene),
        scene.bearing.rollers,
        scene.operation.largest_load_N,
        geometry.clearance if clearance is None else clearance,
        geometry.centrifugal_force,
    )


def static_contacts(scene: Scene, angle: Array) -> RollerContacts:
    """Contacts of rollers at these azimuths (n,) from the load [rad]."""
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    line = iso_16281(modulus, scene.bearing.effective_length).stiffness
    return RollerContacts(line, (_relief(scene, "inner", angle), _relief(scene, "outer", angle)))


def _relief(scene: Scene, race: str, angle: Array) -> Array:
    """Profile drop less the rise by tilt at the slice centres [m], (1, slices), or (n, slices) with a tilt."""
    drawing, slices = scene.bearing, scene.slices
    drop = roller_relief(scene, slices)[None]
    if drawing.tilt == 0.0:
        return drop
    from rbdyn.contact.profile import slice_centres

    share = drawing.inner_tilt_share if race == "inner" else 1.0 - drawing.inner_tilt_share
    tilt = drawing.tilt * share * np.cos(angle - drawing.tilt_direction)
    return np.asarray(drop - tilt[:, None] * slice_centres(slices, drawing.effective_length))


def roller_duty_life(scenes: Sequence[Scene], shares: Sequence[float]) -> DutyLife:
    """Life over a duty from the scene at each point and its share of time; loads are the radial ones.

    Raises MethodError for shares that do not sum to 1.
    """
    cases = [load_case(scene, share) for scene, share in zip(scenes, shares, strict=True)]
    return duty_life(cases, ROLLER_EXPONENT)


def load_case(scene: Scene, share: float) -> LoadCase:
    """The scene as a point of a duty with this share of the time."""
    inner, outer = scene.operation.speeds
    return LoadCase(share, inner - outer, scene.operation.largest_load_N, static_life(scene))
