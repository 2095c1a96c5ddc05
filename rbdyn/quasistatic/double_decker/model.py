"""From a scene to the two rows of a double-decker bearing, its middle ring and how its speed divides between its layers; what is
reported of that ring.

Nothing drives the middle ring but the friction of the layers: it turns at the speed at which the torque that the inner
layer hands on equals the one with which the outer layer brakes it. Friction after Palmgren:
M = M0 + M1, M0 of the oil, M1 of the load. His formulas are in N mm, mm, rpm and mm^2/s; everything here is in SI.

Factors as commonly cited after Palmgren and Harris (Rolling Bearing Analysis), from memory and not checked against the
books. f0 of angular contact ball bearings: oil mist 1.7, grease 2, oil bath 3.3, oil jet 6.6. f1 = z (P0/C0)^y with
z = 0.001, y = 0.33 for angular contact and z = 0.0004 to 0.0006, y = 0.55 for deep groove.
"""

import math
from typing import Any, Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError
from rbdyn.base.fields import RPM
from rbdyn.base.records import finite
from rbdyn.contact.hertz_point import PointContact
from rbdyn.life import balls
from rbdyn.mounting.fits import layer_changes
from rbdyn.mounting.rings import GrooveChange
from rbdyn.quasistatic.double_decker.equilibrium import DoubleDeckerSolution, Layer, Stack
from rbdyn.quasistatic.result import displacement_record
from rbdyn.quasistatic.row.model import RowModel, contacts, row_model
from rbdyn.scene.ball import BallRow, DoubleDeckerScene

OIL_BATH = 3.3
ANGULAR_CONTACT = (0.001, 0.33)
# Y0 of P0 = 0.5 Fr + Y0 Fa for a single angular contact ball bearing (ISO 76), by contact angle [deg].
AXIAL_FACTORS = {15: 0.46, 20: 0.42, 25: 0.38, 30: 0.33, 35: 0.29, 40: 0.26, 45: 0.22}
# Below nu n = 2000 (mm^2/s rpm) the oil's torque no longer follows the speed.
SLOWEST_TERM = 160.0
HALVINGS = 200
Status = Literal["given", "shared", "inner layer stands", "outer layer stands", "undetermined", "no relative speed"]


class LayerFriction(NamedTuple):
    """What holds the races of one layer together.

    ``pitch_diameter`` [m], ``kinematic_viscosity`` [m^2/s] at the layer's temperature, ``load_torque`` M1 [N m],
    ``oil_factor`` f0 [-].
    """

    pitch_diameter: float
    kinematic_viscosity: float
    load_torque: float = 0.0
    oil_factor: float = OIL_BATH

    def torque(self, speed: float) -> float:
        """Friction torque [N m] at a speed of race against race [rad/s], its breakaway torque at 0."""
        return self.load_torque + oil_torque(speed, self.pitch_diameter, self.kinematic_viscosity, self.oil_factor)


class SpeedSplit(NamedTuple):
    """Speed of the middle ring [rad/s], its share of the whole relative speed, the torque through it [N m].

    ``share`` = (middle - outer)/(inner - outer). A layer stands where the other cannot overcome its breakaway torque.
    ``undetermined``: the torques of both are equal and constant; the share is then that of oil alone.
    """

    speed: float
    share: float
    torque: float
    status: Status


def oil_torque(speed: float, pitch_diameter: float, kinematic_viscosity: float, oil_factor: float = OIL_BATH) -> float:
    """Palmgren's torque of the oil [N m] at a speed [rad/s] of either sense.

    M0 = 1e-7 f0 (nu n)^(2/3) dm^3 above nu n = 2000 and 160e-7 f0 dm^3 below, in N mm. The printed limit leaves a step
    down of 0.8 %: here the larger of both rules, which meet at nu n = 2024.
    """
    turning = kinematic_viscosity * 1e6 * abs(speed) / RPM
    return 1e-10 * oil_factor * max(turning ** (2.0 / 3.0), SLOWEST_TERM) * (pitch_diameter * 1e3) ** 3


def static_equivalent_load(radial_load: float, axial_load: float, contact_angle: float) -> float:
    """P0 = 0.5 Fr + Y0 Fa, but not below Fr [N], of an angular contact ball bearing (ISO 76); angle [rad].

    Y0 runs straight between the tabled angles and keeps its first and last value beyond them.
    """
    factor = float(np.interp(math.degrees(contact_angle), list(AXIAL_FACTORS), list(AXIAL_FACTORS.values())))
    return max(0.5 * abs(radial_load) + factor * abs(axial_load), abs(radial_load))


def load_torque(
    radial_load: float, axial_load: float, contact_angle: float, pitch_diameter: float, static_capacity: float
) -> float:
    """Palmgren's torque of the load M1 = f1 P1 dm [N m], f1 = z (P0/C0)^y of angular contact ball bearings.

    P1 = 0.9 Fa cot(alpha0) - 0.1 Fr, but not below Fr. Loads and capacity [N], angle [rad], diameter [m].
    Raises MethodError unless angle and capacity are positive.
    """
    if static_capacity <= 0.0 or contact_angle <= 0.0:
        given = f"a static capacity of {static_capacity:g} N and a contact angle of {contact_angle:g} rad"
        raise MethodError(f"{given} give no load torque; both must be greater than 0")
    radial, axial = abs(radial_load), abs(axial_load)
    scale, exponent = ANGULAR_CONTACT
    rating = static_equivalent_load(radial, axial, contact_angle) / static_capacity
    friction_load = max(0.9 * axial / math.tan(contact_angle) - 0.1 * radial, radial)
    return scale * rating**exponent * friction_load * pitch_diameter


def oil_share(inner_pitch: float, outer_pitch: float) -> float:
    """Share of the middle ring in the relative speed where oil alone rubs: Dip^4.5/(Dip^4.5 + Dop^4.5).

    Hu et al., paper on the contact angle of a double-decker bearing, eq 13. They give no derivation; it is Palmgren's M0
    with equal f0 and viscosity in both layers: (n_i - n_m)^(2/3) Dip^3 = n_m^(2/3) Dop^3, so
    (n_i - n_m)/n_m = (Dop/Dip)^4.5. The faster layer is the small one.
    """
    return 1.0 / (1.0 + (outer_pitch / inner_pitch) ** 4.5)


def balanced_split(
    inner: LayerFriction, outer: LayerFriction, inner_speed: float, outer_speed: float = 0.0
) -> SpeedSplit:
    """Speed of the middle ring at which both layers rub with one torque.

    The inner layer's torque falls and the outer's rises as the middle ring gains on the outer: one root at most, found by
    bisection; where there is none, a layer stands. Speeds [rad/s] of either sense. Drag on the middle ring itself and
    the torque of its own seals are left out, as in Hu et al.
    """
    whole = inner_speed - outer_speed
    if whole == 0.0:
        return SpeedSplit(inner_speed, math.nan, 0.0, "no relative speed")

    def surplus(share: float) -> float:
        return inner.torque((1.0 - share) * whole) - outer.torque(share * whole)

    def split(share: float, torque: float, status: Status) -> SpeedSplit:
        # Exactly a ring's speed where a layer stands.
        speed = inner_speed if share == 1.0 else outer_speed + share * whole
        return SpeedSplit(speed, share, math.copysign(torque, whole), status)

    first, last = surplus(0.0), surplus(1.0)
    if first == last == 0.0:
        share = oil_share(inner.pitch_diameter, outer.pitch_diameter)
        return split(share, inner.torque(0.0), "undetermined")
    if first <= 0.0:
        return split(0.0, inner.torque(whole), "outer layer stands")
    if last >= 0.0:
        return split(1.0, outer.torque(whole), "inner layer stands")
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if surplus(middle) > 0.0 else (low, middle)
    return split(high, outer.torque(high * whole), "shared")


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
        share = oil_share(1.0, scene.bearing.pitch_ratio)
        status: Status = "shared" if whole != 0.0 else "no relative speed"
        return SpeedSplit(outer_speed + share * whole, share, math.nan, status)
    return balanced_split(*layer_frictions(scene), inner_speed, outer_speed)


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
        torque = load_torque(math.hypot(x, y), axial, row.contact_angle, row.pitch_diameter, capacity)
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
