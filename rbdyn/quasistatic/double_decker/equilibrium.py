"""Equilibrium of a double-decker ball stack: two rows of balls with a floating middle ring between them.

Hu et al. (finite initial value search, section 2.2) solve 4Z + 4 equations at once. They are block triangular: seen from
the middle ring, the inner row is a bearing of its own under the load on the inner ring; what its balls leave on the middle
ring (outer contact forces, friction that takes the gyroscopic moments, and their moments) loads the outer row. Only where a
displacement of the inner ring is prescribed do the rows depend on each other: then Newton on the displacement of the middle
ring, with the stiffnesses of both rows in series.

Displacements count in three planes: P0 of the inner row's inner groove centres, P1 of its outer ones, P2 of the outer
row's inner ones. A displacement of the middle ring is that of P2. All small: moments act on the undisplaced grooves.
"""

from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Mask
from rbdyn.quasistatic.row.ball import CommonCage, Control, FixedShare
from rbdyn.quasistatic.row.equilibrium import OK, Solution, solve, without_noise
from rbdyn.quasistatic.row.ring import Row, component_lengths

# Newton on the middle ring: force left over, relative to the largest force, and where rounding allows no better.
AIM, ACCEPTED = 1e-11, 1e-8
STEPS, SHORTEST = 60, 1e-4
# Where Newton starts: share of a prescribed displacement that the outer row takes.
SHARES = (0.5, 0.1, 0.9)
# Step of the differences, in deflections of the most loaded contact: truncation and rounding both near 1e-7.
DIFFERENCE = 1e-3
LOST = "the middle ring found no equilibrium; give a displacement that the bearing can reach, or loads"


# Inner and outer row nearby.
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

    ``displacement`` (5,): of the inner ring against the outer ring; ``inner.displacement`` is that against the middle ring.
    ``middle_displacement`` (5,) and ``middle_load`` (5,): of the middle ring, and what the inner balls put on it.
    ``reaction`` (5,): the load that the inner ring takes. ``residual``: largest force left over [N], balls and rings.
    ``steps``: of Newton on the middle ring, 0 where loads alone rule. ``status``: "ok" or why there is none. ``stack, free``: what
    was solved, and the components (5,) in which the middle ring is free to move.
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
    def found(self) -> bool:
        """Whether this is an equilibrium."""
        return self.status == OK

    @property
    def stiffness(self) -> Array:
        """Stiffness (5, 5) of both layers in series: ``reaction`` by ``displacement`` while the middle ring follows.

        Computed when asked for: it takes ten more solves of the inner row.
        """
        to_inner, free = carried(self.stack.arm_0), self.free
        # Middle ring in balance: (K_o + G T) dq_m = G dq with G the derivative of its load; what the inner row then feels.
        onto_by = _onto_by_relative(self.stack, self.inner)
        whole = (self.outer.stiffness + onto_by @ to_inner)[np.ix_(free, free)]
        follows = np.zeros((5, 5))
        follows[free] = np.linalg.lstsq(whole, onto_by[free], rcond=1e-12)[0]
        joint = self.inner.stiffness @ (np.eye(5) - to_inner @ follows)
        return without_noise(joint, np.abs(joint).max())


def outer_friction(layer: Layer, solution: Solution) -> Array:
    """Friction forces (Z,) [N] at the outer race that take their part of the gyroscopic moments, T_o = lambda_o M_g/D."""
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
    """Load (5,) at P2 [N, N m] that the inner layer's balls put on the middle ring.

    On each groove Q_o (sin, cos) - T_o (cos, -sin), axial and radial, and the couple -f_o D T_o of friction about the
    groove centre. Their sum is the load on the inner ring but for the centrifugal forces, which need not cancel.
    """
    row = stack.inner.row
    friction = outer_friction(stack.inner, solution)
    s, c = np.sin(solution.outer_angle), np.cos(solution.outer_angle)
    axial = solution.outer_load * s - friction * c
    radial = solution.outer_load * c + friction * s
    turn = stack.outer_lever * axial - stack.outer_groove_radius * friction
    at_groove = np.array([radial @ row.cosine, radial @ row.sine, axial.sum(), turn @ row.sine, -(turn @ row.cosine)])
    return carried(stack.arm_1).T @ at_groove


def carried(arm: float) -> Array:
    """Matrix (5, 5) from the displacement of a plane to that of one ``arm`` [m] along the axis; its transpose brings a
    load back."""
    matrix = np.eye(5)
    matrix[0, 4], matrix[1, 3] = arm, -arm
    return matrix


def solve_double_decker(
    stack: Stack, load: Array, given: Array | None = None, middle_given: Array | None = None, start: Start = None
) -> DoubleDeckerSolution:
    """Equilibrium under ``load`` (5,) [N, N m] on the inner ring, at P0.

    ``given`` (5,): prescribed displacements of the inner ring against the outer ring [m, rad]; ``middle_given`` (5,): of the
    middle ring (zeros in its tilts hold it square); both NaN where forces rule. ``start``: inner and outer row nearby. Never raises
    for want of an equilibrium: see ``status``.
    """
    load = np.asarray(load, float)
    given = np.full(5, np.nan) if given is None else np.asarray(given, float)
    middle_given = np.full(5, np.nan) if middle_given is None else np.asarray(middle_given, float)
    to_inner = carried(stack.arm_0)
    held = ~np.isnan(given)
    free = np.isnan(middle_given)
    # A prescribed component depends on the middle ring only through components that are free to move.
    coupled = held & (to_inner[:, free] != 0.0).any(axis=1)
    if not coupled.any():
        relative = np.where(held, given - to_inner @ np.where(free, 0.0, middle_given), np.nan)
        inner = solve(*stack.inner, load, relative, start[0] if start else None)
        onto = load_on_middle_ring(stack, inner)
        outer = solve(*stack.outer, onto, middle_given, start[1] if start else None)
        return _result(stack, free, inner, outer, onto, 0)
    starts = [start[1].displacement] if start else []
    starts += [_shared_out(stack, load, given, middle_given, share) for share in SHARES]
    best: DoubleDeckerSolution | None = None
    for first in starts:
        middle = np.where(free, first, middle_given)
        reached = _follow(stack, load, given, free, middle, start)
        if reached.found:
            return reached
        if best is None or reached.residual < best.residual:
            best = reached
    assert best is not None
    return best


def _shared_out(stack: Stack, load: Array, given: Array, middle_given: Array, share: float) -> Array:
    """Displacement of the middle ring where each row takes its ``share`` of what is prescribed, and the load of the rest."""
    inner = solve(*stack.inner, load, (1.0 - share) * given)
    there = np.where(np.isnan(middle_given), share * given, middle_given)
    return solve(*stack.outer, load_on_middle_ring(stack, inner), there).displacement


def _follow(stack: Stack, load: Array, given: Array, free: Mask, middle: Array, start: Start) -> DoubleDeckerSolution:
    """Newton on the free components of the middle ring's displacement, guarded by the length of what is left over."""
    to_inner = carried(stack.arm_0)
    held = ~np.isnan(given)
    unit = component_lengths(stack.outer.row.lever)

    def rows(middle: Array, inner: Solution | None, outer: Solution | None) -> tuple[Solution, Solution, Array]:
        inner = solve(*stack.inner, load, np.where(held, given - to_inner @ middle, np.nan), inner)
        outer = solve(*stack.outer, np.zeros(5), middle, outer)
        return inner, outer, (load_on_middle_ring(stack, inner) - outer.reaction) / unit

    def length(left: Array, inner: Solution, outer: Solution) -> float:
        return float(np.linalg.norm(left[free])) if inner.found and outer.found else np.inf

    inner, outer, left = rows(middle, start[0] if start else None, start[1] if start else None)
    size, steps = length(left, inner, outer), 0
    while steps < STEPS and size > AIM * _largest(inner, outer) and np.isfinite(size):
        onto_by_middle = _onto_by_relative(stack, inner) @ _relative_by_middle(inner.stiffness, held, to_inner)
        matrix = ((outer.stiffness - onto_by_middle) / np.outer(unit, unit))[np.ix_(free, free)]
        # Where both rows stand open there is no stiffness: the least step of least squares.
        move = np.zeros(5)
        move[free] = np.linalg.lstsq(matrix, left[free], rcond=1e-12)[0]
        steps, scale = steps + 1, 1.0
        while scale > SHORTEST:
            trial = rows(middle + scale * move / unit, inner, outer)
            shorter = length(trial[2], trial[0], trial[1])
            if shorter < size:
                break
            scale *= 0.5
        else:
            break
        middle, (inner, outer, left), size = middle + scale * move / unit, trial, shorter
    return _result(stack, free, inner, outer, load_on_middle_ring(stack, inner), steps)


def _largest(inner: Solution, outer: Solution) -> float:
    return float(max(inner.outer_load.max(initial=0.0), outer.outer_load.max(initial=0.0), 1e-12))


def _relative_by_middle(stiffness: Array, held: Mask, to_inner: Array) -> Array:
    """How the inner row's displacement follows the middle ring: held components against it, the others in balance."""
    follows = np.zeros((5, 5))
    follows[held] = -to_inner[held]
    loose = ~held
    if loose.any():
        pull = stiffness[np.ix_(loose, held)] @ follows[held]
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
            at = inner.displacement.copy()
            at[k] += side * step
            ends.append(load_on_middle_ring(stack, solve(*stack.inner, np.zeros(5), at, inner)))
        columns.append((ends[1] - ends[0]) / step)
    return np.stack(columns, axis=1)


def _result(
    stack: Stack, free: Mask, inner: Solution, outer: Solution, onto: Array, steps: int
) -> DoubleDeckerSolution:
    to_inner = carried(stack.arm_0)
    left = (onto - outer.reaction)[free & (np.arange(5) < 3)]
    residual = float(max(inner.residual, outer.residual, np.abs(left).max(initial=0.0)))
    status = next((row.status for row in (inner, outer) if not row.found), OK)
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
