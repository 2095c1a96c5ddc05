"""Double-decker ball bearing: two rows of balls with a floating middle ring, its equilibrium and its speed.

Hu et al. (finite initial value search, section 2.2) solve 4Z + 4 equations at once. These are block triangular. Relative to
the middle ring, the inner row is a bearing under the load on the inner ring. Its balls load the middle ring and so the outer
row. This load has outer contact forces, the friction that balances the gyroscopic moments, and the moments of both. The rows
depend on each other only where a displacement of the inner ring is prescribed. Then Newton's method solves for the
displacement of the middle ring, with the stiffnesses of both rows in series.

Displacements refer to three planes: P0 of the inner row's inner groove centres, P1 of its outer ones, and P2 of the outer
row's inner ones. The displacement of the middle ring is that of P2. All are small: moments act on the undisplaced grooves.

Only the friction of the two layers drives the middle ring. At its speed the torque of the inner layer equals the braking
torque of the outer layer. The torque after Palmgren is M = M0 + M1, M0 of the oil and M1 of the load. His formulas are in
N mm, mm, rpm and mm^2/s; all values here are in SI.

The factors are those commonly cited after Palmgren and Harris (Rolling Bearing Analysis), not verified in the books. f0 of
angular contact ball bearings is 1.7 for oil mist, 2 for grease, 3.3 for an oil bath and 6.6 for an oil jet. f1 is
z (P0/C0)^y, with z = 0.001, y = 0.33 for angular contact and z = 0.0004 to 0.0006, y = 0.55 for deep groove bearings.
"""

import math
from typing import Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Mask
from rbdyn.base.faults import RPM, given
from rbdyn.base.records import finite
from rbdyn.contact.point_contact import PointContact
from rbdyn.life import balls
from rbdyn.mounting.rings import GrooveChange
from rbdyn.quasistatic.result import MiddleRing, RingLoad, displacement_record
from rbdyn.quasistatic.row.ball import CommonCage, Control, FixedShare
from rbdyn.quasistatic.row.equilibrium import OK, Solution, solve, without_noise
from rbdyn.quasistatic.row.model import RowModel, contacts, row_model
from rbdyn.quasistatic.row.ring import Row, component_lengths
from rbdyn.scene.ball import BallRow, DoubleDeckerScene
from rbdyn.scene.fits import layer_changes

# Newton on the middle ring: target of the residual over the largest force, and its limit where rounding allows no better.
AIM, ACCEPTED = 1e-11, 1e-8
STEPS, SHORTEST = 60, 1e-4
# Starts of Newton's method: shares of a prescribed displacement in the outer row.
SHARES = (0.5, 0.1, 0.9)
# Step of the differences over the deflection of the most loaded contact: truncation and rounding are both near 1e-7.
DIFFERENCE = 1e-3
LOST = "no equilibrium of the middle ring was found; give a displacement that the bearing can reach, or loads"


# Solutions of the inner and the outer row nearby.
Start = tuple[Solution, Solution] | None


class Layer(NamedTuple):
    """One row of balls and its raceway control."""

    row: Row
    control: Control


class Stack(NamedTuple):
    """Two layers and the middle ring between them. Lengths in m.

    ``outer_lever``: radius of the circle of the inner layer's outer groove centres; ``outer_groove_radius``: their f_o D.
    ``arm_0, arm_1``: axial distance of the planes P0 and P1 from P2.
    """

    inner: Layer
    outer: Layer
    outer_lever: float
    outer_groove_radius: float
    arm_0: float
    arm_1: float


class DoubleDeckerSolution(NamedTuple):
    """Equilibrium of both layers.

    ``displacement`` (5,): of the inner ring relative to the outer ring; ``inner.displacement`` is relative to the middle ring.
    ``middle_displacement`` (5,) of the middle ring; ``middle_load`` (5,): load of the inner balls on it. ``reaction`` (5,):
    load that the inner ring takes. ``residual``: largest unbalanced force of balls and rings [N]. ``steps``: of Newton on the
    middle ring, 0 where loads alone rule. ``status``: "ok", or the cause of the failure. ``stack``: both layers; ``free``:
    components (5,) in which the middle ring can move.
    """

    inner: Solution
    outer: Solution
    displacement: Array
    middle_displacement: Array
    middle_load: Array
    reaction: Array
    residual: float
    steps: int
    status: str
    stack: Stack
    free: Mask

    @property
    def is_equilibrium(self) -> bool:
        """Whether this is an equilibrium."""
        return self.status == OK

    @property
    def stiffness(self) -> Array:
        """Stiffness (5, 5) of both layers in series: ``reaction`` by ``displacement`` while the middle ring follows.

        Computed on demand by ten more solves of the inner row.
        """
        to_inner, free = plane_transfer(self.stack.arm_0), self.free
        # Balance of the middle ring: (K_o + G T) dq_m = G dq with G the derivative of its load.
        onto_by = _onto_by_relative(self.stack, self.inner)
        stiffness = (self.outer.stiffness + onto_by @ to_inner)[np.ix_(free, free)]
        follows = np.zeros((5, 5))
        follows[free] = np.linalg.lstsq(stiffness, onto_by[free], rcond=1e-12)[0]
        joint = self.inner.stiffness @ (np.eye(5) - to_inner @ follows)
        return without_noise(joint, np.abs(joint).max())


def outer_friction(layer: Layer, solution: Solution) -> Array:
    """Friction forces (Z,) [N] at the outer race by its share of the gyroscopic moments, T_o = lambda_o M_g/D."""
    control = layer.control
    if isinstance(control, CommonCage):
        return np.zeros_like(solution.outer_load)
    share = np.zeros_like(solution.outer_load)
    if isinstance(control, FixedShare):
        share += control.inner
    else:
        row = layer.row
        inner = control.inner_weight * (solution.inner_load / row.inner_stiffness) ** (4.0 / 3.0)
        outer = (solution.outer_load / row.outer_stiffness) ** (4.0 / 3.0)
        share += inner / np.maximum(inner + outer, np.finfo(float).tiny)
    return 2.0 * (1.0 - share) * solution.gyroscopic_moment / control.spinning.ball_diameter


def load_on_middle_ring(stack: Stack, solution: Solution) -> Array:
    """Load (5,) at P2 [N, N m] of the inner layer's balls on the middle ring.

    Each groove gets the force Q_o (sin, cos) - T_o (cos, -sin), axial and radial. Friction adds the couple -f_o D T_o about
    the groove centre. The sum is the load on the inner ring plus the centrifugal forces, which need not cancel.
    """
    row = stack.inner.row
    friction = outer_friction(stack.inner, solution)
    s, c = np.sin(solution.outer_angle), np.cos(solution.outer_angle)
    axial = solution.outer_load * s - friction * c
    radial = solution.outer_load * c + friction * s
    turn = stack.outer_lever * axial - stack.outer_groove_radius * friction
    at_groove = np.array([radial @ row.cosine, radial @ row.sine, axial.sum(), turn @ row.sine, -(turn @ row.cosine)])
    return plane_transfer(stack.arm_1).T @ at_groove


def plane_transfer(arm: float) -> Array:
    """Matrix (5, 5) from the displacement of a plane to that of a plane ``arm`` [m] along the axis.

    Its transpose transfers a load in the other direction.
    """
    matrix = np.eye(5)
    matrix[0, 4], matrix[1, 3] = arm, -arm
    return matrix


def solve_double_decker(
    stack: Stack,
    load: Array,
    constraint: Array | None = None,
    middle_constraint: Array | None = None,
    start: Start = None,
) -> DoubleDeckerSolution:
    """Equilibrium under ``load`` (5,) [N, N m] on the inner ring, at P0.

    ``constraint`` (5,): prescribed displacements of the inner ring relative to the outer ring [m, rad]. ``middle_constraint``
    (5,): those of the middle ring, zero tilts of which keep it square. Both are NaN where forces rule. ``start``: solutions
    of both rows nearby. Nothing is raised where there is no equilibrium: see ``status``.
    """
    load = np.asarray(load, float)
    constraint = np.full(5, np.nan) if constraint is None else np.asarray(constraint, float)
    middle_constraint = np.full(5, np.nan) if middle_constraint is None else np.asarray(middle_constraint, float)
    to_inner = plane_transfer(stack.arm_0)
    rigid = ~np.isnan(constraint)
    free = np.isnan(middle_constraint)
    # A prescribed component depends on the middle ring only through components that are free to move.
    coupled = rigid & (to_inner[:, free] != 0.0).any(axis=1)
    if not coupled.any():
        relative = np.where(rigid, constraint - to_inner @ np.where(free, 0.0, middle_constraint), np.nan)
        inner = solve(*stack.inner, load, relative, start[0] if start else None)
        onto = load_on_middle_ring(stack, inner)
        outer = solve(*stack.outer, onto, middle_constraint, start[1] if start else None)
        return _result(stack, free, inner, outer, onto, 0)
    starts = [start[1].displacement] if start else []
    starts += [_shared_displacement(stack, load, constraint, middle_constraint, share) for share in SHARES]
    best: DoubleDeckerSolution | None = None
    for first in starts:
        reached = _follow(stack, load, constraint, free, np.where(free, first, middle_constraint), start)
        if reached.is_equilibrium:
            return reached
        if best is None or reached.residual < best.residual:
            best = reached
    return given(best)


def _shared_displacement(stack: Stack, load: Array, constraint: Array, middle_constraint: Array, share: float) -> Array:
    """Displacement of the middle ring if the outer row takes the ``share`` of the prescribed displacement, the inner row the rest."""
    inner = solve(*stack.inner, load, (1.0 - share) * constraint)
    there = np.where(np.isnan(middle_constraint), share * constraint, middle_constraint)
    return solve(*stack.outer, load_on_middle_ring(stack, inner), there).displacement


def _follow(
    stack: Stack, load: Array, constraint: Array, free: Mask, middle: Array, start: Start
) -> DoubleDeckerSolution:
    """Newton on the free components of the middle ring's displacement, guarded by the length of its unbalanced force."""
    to_inner = plane_transfer(stack.arm_0)
    rigid = ~np.isnan(constraint)
    unit = component_lengths(stack.outer.row.lever)

    def rows(middle: Array, inner: Solution | None, outer: Solution | None) -> tuple[Solution, Solution, Array]:
        inner = solve(*stack.inner, load, np.where(rigid, constraint - to_inner @ middle, np.nan), inner)
        outer = solve(*stack.outer, np.zeros(5), middle, outer)
        return inner, outer, (load_on_middle_ring(stack, inner) - outer.reaction) / unit

    def length(unbalance: Array, inner: Solution, outer: Solution) -> float:
        return float(np.linalg.norm(unbalance[free])) if inner.is_equilibrium and outer.is_equilibrium else np.inf

    inner, outer, unbalance = rows(middle, start[0] if start else None, start[1] if start else None)
    size, steps = length(unbalance, inner, outer), 0
    while steps < STEPS and size > AIM * _largest(inner, outer) and np.isfinite(size):
        onto_by_middle = _onto_by_relative(stack, inner) @ _relative_by_middle(inner.stiffness, rigid, to_inner)
        matrix = ((outer.stiffness - onto_by_middle) / np.outer(unit, unit))[np.ix_(free, free)]
        # Where both rows are unloaded there is no stiffness: the shortest step of least squares.
        move = np.zeros(5)
        move[free] = np.linalg.lstsq(matrix, unbalance[free], rcond=1e-12)[0]
        steps, scale = steps + 1, 1.0
        while scale > SHORTEST:
            trial = rows(middle + scale * move / unit, inner, outer)
            shorter = length(trial[2], trial[0], trial[1])
            if shorter < size:
                break
            scale *= 0.5
        else:
            break
        middle, (inner, outer, unbalance), size = middle + scale * move / unit, trial, shorter
    return _result(stack, free, inner, outer, load_on_middle_ring(stack, inner), steps)


def _largest(inner: Solution, outer: Solution) -> float:
    return float(max(inner.outer_load.max(initial=0.0), outer.outer_load.max(initial=0.0), 1e-12))


def _relative_by_middle(stiffness: Array, rigid: Mask, to_inner: Array) -> Array:
    """Derivative (5, 5) of the inner row's displacement by the middle ring's: rigid components oppose it, the rest balances."""
    follows = np.zeros((5, 5))
    follows[rigid] = -to_inner[rigid]
    loose = ~rigid
    if loose.any():
        pull = stiffness[np.ix_(loose, rigid)] @ follows[rigid]
        follows[loose] = np.linalg.lstsq(stiffness[np.ix_(loose, loose)], -pull, rcond=1e-12)[0]
    return follows


def _onto_by_relative(stack: Stack, inner: Solution) -> Array:
    """Derivative (5, 5) of the load on the middle ring by the inner row's displacement, balls in balance."""
    row = stack.inner.row
    deflection = (max(float(inner.outer_load.max()), 1e-6) / row.outer_stiffness) ** (2.0 / 3.0)
    steps = DIFFERENCE * deflection / component_lengths(row.lever)
    columns = []
    for k, step in enumerate(steps):
        ends = []
        for side in (-0.5, 0.5):
            displacement = inner.displacement.copy()
            displacement[k] += side * step
            ends.append(load_on_middle_ring(stack, solve(*stack.inner, np.zeros(5), displacement, inner)))
        columns.append((ends[1] - ends[0]) / step)
    return np.stack(columns, axis=1)


def _result(
    stack: Stack, free: Mask, inner: Solution, outer: Solution, onto: Array, steps: int
) -> DoubleDeckerSolution:
    to_inner = plane_transfer(stack.arm_0)
    unbalance = (onto - outer.reaction)[free & (np.arange(5) < 3)]
    residual = float(max(inner.residual, outer.residual, np.abs(unbalance).max(initial=0.0)))
    status = next((row.status for row in (inner, outer) if not row.is_equilibrium), OK)
    if status == OK and residual > ACCEPTED * _largest(inner, outer):
        status = LOST
    return DoubleDeckerSolution(
        inner=inner,
        outer=outer,
        displacement=inner.displacement + to_inner @ outer.displacement,
        middle_displacement=outer.displacement,
        middle_load=without_noise(onto, _largest(inner, outer)),
        reaction=inner.reaction,
        residual=residual,
        steps=steps,
        status=status,
        stack=stack,
        free=free,
    )


OIL_BATH = 3.3
ANGULAR_CONTACT = (0.001, 0.33)
# Y0 of P0 = 0.5 Fr + Y0 Fa for a single angular contact ball bearing (ISO 76), by contact angle [deg].
AXIAL_FACTORS = {15: 0.46, 20: 0.42, 25: 0.38, 30: 0.33, 35: 0.29, 40: 0.26, 45: 0.22}
# Below nu n = 2000 (mm^2/s rpm) the oil's torque no longer follows the speed.
SLOWEST_TERM = 160.0
HALVINGS = 200
Status = Literal["given", "shared", "inner layer stands", "outer layer stands", "undetermined", "no relative speed"]


class LayerFriction(NamedTuple):
    """Friction between the races of one layer.

    ``pitch_diameter`` [m], ``kinematic_viscosity`` [m^2/s] at the layer's temperature, ``load_torque`` M1 [N m],
    ``oil_factor`` f0 [-].
    """

    pitch_diameter: float
    kinematic_viscosity: float
    load_torque: float = 0.0
    oil_factor: float = OIL_BATH

    def torque(self, speed: float) -> float:
        """Friction torque [N m] at a relative speed of the races [rad/s]; at 0 the breakaway torque."""
        return self.load_torque + oil_torque(speed, self.pitch_diameter, self.kinematic_viscosity, self.oil_factor)


class SpeedSplit(NamedTuple):
    """Speed of the middle ring [rad/s], its share of the relative speed of the rings, and its torque [N m].

    ``share`` = (middle - outer)/(inner - outer). A layer stands where the other cannot overcome its breakaway torque.
    "undetermined": both torques are equal and constant; the share is then that of oil alone.
    """

    speed: float
    share: float
    torque: float
    status: Status


def oil_torque(speed: float, pitch_diameter: float, kinematic_viscosity: float, oil_factor: float = OIL_BATH) -> float:
    """Palmgren's torque of the oil [N m] at a speed [rad/s] of either sense.

    M0 = 1e-7 f0 (nu n)^(2/3) dm^3 above nu n = 2000 and 160e-7 f0 dm^3 below, in N mm. At this limit the printed rules
    differ by 0.8 %. Here the larger one counts; they meet at nu n = 2024.
    """
    turning = kinematic_viscosity * 1e6 * abs(speed) / RPM
    return 1e-10 * oil_factor * max(turning ** (2.0 / 3.0), SLOWEST_TERM) * (pitch_diameter * 1e3) ** 3


def static_equivalent_load(radial_load: float, axial_load: float, contact_angle: float) -> float:
    """P0 = 0.5 Fr + Y0 Fa, but not below Fr [N], of an angular contact ball bearing (ISO 76); angle [rad].

    Y0 is linear between the tabled angles and constant beyond them.
    """
    factor = float(np.interp(math.degrees(contact_angle), list(AXIAL_FACTORS), list(AXIAL_FACTORS.values())))
    return max(0.5 * abs(radial_load) + factor * abs(axial_load), abs(radial_load))


def load_torque(
    radial_load: float, axial_load: float, contact_angle: float, pitch_diameter: float, static_capacity: float
) -> float:
    """Palmgren's torque of the load M1 = f1 P1 dm [N m], f1 = z (P0/C0)^y of angular contact ball bearings.

    P1 = 0.9 Fa cot(alpha0) - 0.1 Fr, but not below Fr. Loads and capacity [N], angle > 0 [rad], diameter [m].
    """
    radial, axial = abs(radial_load), abs(axial_load)
    scale, exponent = ANGULAR_CONTACT
    rating = static_equivalent_load(radial, axial, contact_angle) / static_capacity
    friction_load = max(0.9 * axial / math.tan(contact_angle) - 0.1 * radial, radial)
    return scale * rating**exponent * friction_load * pitch_diameter


def oil_share(inner_pitch: float, outer_pitch: float) -> float:
    """Share of the middle ring in the relative speed where only oil causes friction: Dip^4.5/(Dip^4.5 + Dop^4.5).

    Source: Hu et al., paper on the contact angle of a double-decker bearing, eq 13, without derivation. It follows from
    Palmgren's M0 with equal f0 and viscosity in both layers: (n_i - n_m)^(2/3) Dip^3 = n_m^(2/3) Dop^3, so
    (n_i - n_m)/n_m = (Dop/Dip)^4.5. The smaller layer is the faster one.
    """
    return 1.0 / (1.0 + (outer_pitch / inner_pitch) ** 4.5)


def balanced_split(
    inner: LayerFriction, outer: LayerFriction, inner_speed: float, outer_speed: float = 0.0
) -> SpeedSplit:
    """Speed of the middle ring at which both layers have the same friction torque.

    As the middle ring turns faster, the inner layer's torque falls and the outer layer's rises. Bisection finds their only
    root; without a root a layer stands. Speeds [rad/s] have either sign. Drag on the middle ring and the torque of its
    seals are omitted, as in Hu et al.
    """
    difference = inner_speed - outer_speed
    if difference == 0.0:
        return SpeedSplit(inner_speed, math.nan, 0.0, "no relative speed")

    def surplus(share: float) -> float:
        return inner.torque((1.0 - share) * difference) - outer.torque(share * difference)

    def split(share: float, torque: float, status: Status) -> SpeedSplit:
        # Where a layer stands, the speed is exactly that of a ring.
        speed = inner_speed if share == 1.0 else outer_speed + share * difference
        return SpeedSplit(speed, share, math.copysign(torque, difference), status)

    first, last = surplus(0.0), surplus(1.0)
    if first == last == 0.0:
        share = oil_share(inner.pitch_diameter, outer.pitch_diameter)
        return split(share, inner.torque(0.0), "undetermined")
    if first <= 0.0:
        return split(0.0, inner.torque(difference), "outer layer stands")
    if last >= 0.0:
        return split(1.0, outer.torque(difference), "inner layer stands")
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (middle, high) if surplus(middle) > 0.0 else (low, middle)
    return split(high, outer.torque(high * difference), "shared")


class DoubleDeckerModel(NamedTuple):
    """Two rows as the solver takes them, and the middle ring.

    ``middle_constraint`` (5,): prescribed displacements of the middle ring, NaN where it floats. ``split``: its speed.
    ``changes``: of the grooves of the inner and the outer row.
    """

    stack: Stack
    inner: RowModel
    outer: RowModel
    middle_constraint: Array
    split: SpeedSplit
    changes: tuple[GrooveChange, GrooveChange]


def double_decker_of(scene: DoubleDeckerScene) -> DoubleDeckerModel:
    """Both rows of a scene, with the ring growth that the scene states."""
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
    middle_constraint = np.full(5, math.nan)
    if (middle.tilt or scene.operation.tilt) == "fixed":
        middle_constraint[3:] = 0.0
    return DoubleDeckerModel(stack, inner, outer, middle_constraint, split, changes)


def middle_speed(scene: DoubleDeckerScene) -> SpeedSplit:
    """Speed of the middle ring: stated, by oil alone (Hu et al., eq 13), or by the torques of oil and load."""
    middle, (inner_speed, outer_speed) = scene.bearing.middle, scene.operation.speeds
    difference = inner_speed - outer_speed
    if middle.speed is not None:
        share = (middle.speed - outer_speed) / difference if difference != 0.0 else math.nan
        return SpeedSplit(middle.speed, share, math.nan, "given")
    if middle.speed_split == "oil":
        share = oil_share(1.0, scene.bearing.pitch_ratio)
        status: Status = "shared" if difference != 0.0 else "no relative speed"
        return SpeedSplit(outer_speed + share * difference, share, math.nan, status)
    return balanced_split(*layer_frictions(scene), inner_speed, outer_speed)


def layer_frictions(scene: DoubleDeckerScene) -> tuple[LayerFriction, LayerFriction]:
    """Friction of the inner and the outer row, both under the scene's load; prescribed displacements add no friction."""
    oil = given(scene.lubricant).in_service
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
    """Static capacity C0 [N], from the catalogue or from its defining pressure."""
    catalogue = row.static_capacity_N
    return balls.static_capacity(row.balls, row.rated_angle, races) if catalogue is None else catalogue


def middle_ring(model: DoubleDeckerModel, solution: DoubleDeckerSolution) -> MiddleRing:
    """The middle ring as reported."""
    split = model.split
    return MiddleRing(
        **displacement_record(solution.middle_displacement),
        speed_rpm=split.speed / RPM,
        speed_share=finite(split.share),
        speed_status=split.status,
        friction_torque_Nmm=finite(1e3 * split.torque),
        load=RingLoad.of(solution.middle_load),
    )
