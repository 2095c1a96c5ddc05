"""From a scene to the two rows of a double-decker bearing and its middle ring, and what is reported of that ring."""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.arrays import Array
from rbdyn.contact.hertz_point import PointContact
from rbdyn.fields import RPM
from rbdyn.life import balls
from rbdyn.mounting.fits import layer_changes
from rbdyn.mounting.rings import GrooveChange
from rbdyn.quasistatic.double_decker import speed_split
from rbdyn.quasistatic.double_decker.equilibrium import DoubleDeckerSolution, Layer, Stack
from rbdyn.quasistatic.double_decker.speed_split import LayerFriction, SpeedSplit, Status
from rbdyn.quasistatic.result import displacement_record
from rbdyn.quasistatic.row.model import RowModel, contacts, row_model
from rbdyn.records.record import finite
from rbdyn.scene.ball import BallRow, DoubleDeckerScene


class DoubleDeckerModel(NamedTuple):
    """Two rows as the solver takes them, and what became of middle ring and races.

    ``middle_given`` (5,): what is prescribed of the middle ring, NaN where it floats. ``split``: its speed; ``changes``: of
    the grooves of inner and outer row.
    """

    stack: Stack
    inner: RowModel
    outer: RowModel
    middle_given: Array
    split: SpeedSplit
    changes: tuple[GrooveChange, GrooveChange]


def double_decker_of(scene: DoubleDeckerScene) -> DoubleDeckerModel:
    """Both rows of a scene, its rings grown as far as the scene asks for."""
    below, above, middle = scene.bearing.inner, scene.bearing.outer, scene.bearing.middle
    ball, inner_ring, ring, outer_ring = (
        scene.material(p) for p in ("ball", "inner_ring", "middle_ring", "outer_ring")
    )
    inner_speed, outer_speed = scene.operation.speeds
    split = middle_speed(scene)
    changes = layer_changes(scene, split.speed)
    inner = row_model(below, scene.model, ball, inner_ring, ring, inner_speed, split.speed, changes[0])
    outer = row_model(above, scene.model, ball, ring, outer_ring, split.speed, outer_speed, changes[1])
    diameter = below.ball_diameter
    back = (below.outer_groove_factor - 0.5) * diameter
    offset = middle.axial_offset
    # Planes of groove centres, from the ball plane of the outer row.
    plane_0 = offset + (below.inner_groove_factor - 0.5) * diameter * math.sin(below.contact_angle)
    plane_1 = offset - back * math.sin(below.contact_angle)
    plane_2 = (above.inner_groove_factor - 0.5) * above.ball_diameter * math.sin(above.contact_angle)
    stack = Stack(
        inner=Layer(inner.row, inner.control),
        outer=Layer(outer.row, outer.control),
        outer_lever=0.5 * below.pitch_diameter - back * math.cos(below.contact_angle),
        outer_groove_radius=below.outer_groove_factor * diameter,
        arm_0=plane_0 - plane_2,
        arm_1=plane_1 - plane_2,
    )
    middle_given = np.full(5, math.nan)
    if (middle.tilt or scene.operation.tilt) == "fixed":
        middle_given[3:] = 0.0
    return DoubleDeckerModel(stack, inner, outer, middle_given, split, changes)


def middle_speed(scene: DoubleDeckerScene) -> SpeedSplit:
    """Speed of the middle ring: as given, of oil alone (Hu et al., eq 13), or from the torques of oil and load."""
    middle, (inner_speed, outer_speed) = scene.bearing.middle, scene.operation.speeds
    whole = inner_speed - outer_speed
    if middle.speed is not None:
        share = (middle.speed - outer_speed) / whole if whole != 0.0 else math.nan
        return SpeedSplit(middle.speed, share, math.nan, "given")
    if middle.speed_split == "oil":
        share = speed_split.oil_share(1.0, scene.bearing.pitch_ratio)
        status: Status = "shared" if whole != 0.0 else "no relative speed"
        return SpeedSplit(outer_speed + share * whole, share, math.nan, status)
    return speed_split.balanced_split(*layer_frictions(scene), inner_speed, outer_speed)


def layer_frictions(scene: DoubleDeckerScene) -> tuple[LayerFriction, LayerFriction]:
    """Friction of inner and outer row under the scene's load, which both carry; prescribed displacements give none."""
    assert scene.lubricant is not None
    oil = scene.lubricant.in_service
    viscosity = oil.viscosity / oil.density
    x, y, axial = scene.operation.load
    middle = scene.bearing.middle
    rows = ("inner", "middle", scene.bearing.inner), ("middle", "outer", scene.bearing.outer)
    frictions = []
    for (under, over, row), factor in zip(rows, (middle.inner_oil_factor, middle.outer_oil_factor), strict=True):
        materials = (scene.material(part) for part in ("ball", f"{under}_ring", f"{over}_ring"))
        capacity = static_capacity(row, contacts(row, *materials))
        torque = speed_split.load_torque(math.hypot(x, y), axial, row.contact_angle, row.pitch_diameter, capacity)
        frictions.append(LayerFriction(row.pitch_diameter, viscosity, torque, factor))
    return frictions[0], frictions[1]


def static_capacity(row: BallRow, races: tuple[PointContact, PointContact]) -> float:
    """Static capacity C0 [N], of the catalogue or from the pressure that defines it."""
    given = row.static_capacity_N
    return balls.static_capacity(row.balls, row.contact_angle, races) if given is None else given


def middle_record(model: DoubleDeckerModel, solution: DoubleDeckerSolution) -> dict[str, Any]:
    """What is reported of the middle ring."""
    split = model.split
    return {
        **displacement_record(solution.middle_displacement),
        "speed_rpm": split.speed / RPM,
        "speed_share": finite(split.share),
        "speed_status": split.status,
        "friction_torque_Nmm": finite(1e3 * split.torque),
        **load_record(solution.middle_load),
    }


def load_record(load: Array) -> dict[str, Any]:
    """Load (5,) on a ring."""
    force, moment = load[:3].tolist(), load[3:].tolist()
    return {"load_N": dict(zip("xyz", force, strict=True)), "moment_Nm": dict(zip("xy", moment, strict=True))}
