"""One row of balls in SI: geometry, rest positions of the balls, and forces on the inner ring with the balls eliminated.

The unknowns are the ring's displacement q = (x, y, z, R theta_x, R theta_y) [m] and the position X_j of each ball. Tilts
are multiplied by the lever R = R_i, so that all five components are lengths. The Jacobian is an arrow: 2 x 2 blocks for the
balls, bordered by the ring. Eliminating the balls (Schur complement) leaves a 5 x 5 system and costs O(Z).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.kernel import kernel, routine
from rbdyn.quasistatic.row.ball import ball_forces, deflection, line, spring, tangent


class Row(NamedTuple):
    """One row of Z balls between two rings. Arrays have shape (Z,), lengths are in m.

    ``cosine, sine``: of the azimuth of each ball. ``axial, radial``: position of the inner groove centre before any
    displacement, form errors, clearance and ring growth included. ``inner_reach, outer_reach``: groove radius less ball
    radius. ``inner_stiffness, outer_stiffness``: K of Q = K delta^1.5 [N/m^1.5]. ``lever``: radius R_i of the circle of
    inner groove centres. ``inner_groove_radius``: f_i D, the lever of a friction force about the groove centre.
    ``centrifugal_force``: that of a ball at the common cage speed [N]. ``rest_deflection``: depth of the outer contact of a
    ball under this force alone. ``rest_energy``: its elastic energy less the work of the force [J].
    """

    cosine: Array
    sine: Array
    axial: Array
    radial: Array
    inner_reach: Array
    outer_reach: Array
    inner_stiffness: float
    outer_stiffness: float
    lever: float
    inner_groove_radius: float
    centrifugal_force: float
    rest_deflection: float
    rest_energy: float


def component_lengths(lever: float) -> Array:
    """Factors (1, 1, 1, R, R): displacements times them are lengths [m], loads over them are forces [N]."""
    return np.array([1.0, 1.0, 1.0, lever, lever])


def at_rest(centrifugal_force: float, outer_stiffness: float) -> tuple[float, float]:
    """Outer deflection [m] under the centrifugal force alone, and energy [J] there."""
    deflection = float((centrifugal_force / outer_stiffness) ** (2.0 / 3.0))
    return deflection, -0.6 * centrifugal_force * deflection


# A light ball slides along a curved, narrow valley of its energy.
SETTLING_STEPS = 300
SHORTEST = 1e-7


@kernel
def groove_centre(row: Any, q: Any, j: int) -> tuple[float, float]:
    """Position (axial, radial) of the inner groove centre at ball j [m]."""
    c, s = row.cosine[j], row.sine[j]
    return row.axial[j] + q[2] + q[3] * s - q[4] * c, row.radial[j] + q[0] * c + q[1] * s


@kernel
def centre_shift(row: Any, j: int, step: Any) -> tuple[float, float]:
    """Shift (axial, radial) of the inner groove centre at ball j by a ``step`` (5,) of the ring, in the step's unit."""
    c, s = row.cosine[j], row.sine[j]
    return step[2] + step[3] * s - step[4] * c, step[0] * c + step[1] * s


@kernel
def is_lifted(row: Any, j: int, a_axial: float, a_radial: float) -> bool:
    """Whether ball j is clear of the inner race while its centrifugal force alone presses it to the outer race."""
    if row.centrifugal_force > 0.0:
        high = a_radial - row.outer_reach[j] - row.rest_deflection
        reach = row.inner_reach[j]
        return a_axial * a_axial + high * high <= reach * reach
    reach = row.inner_reach[j] + row.outer_reach[j]
    return a_axial * a_axial + a_radial * a_radial <= reach * reach


@kernel
def put_at_rest(row: Any, j: int, balls: Any, a_axial: float, a_radial: float) -> None:
    """Put a lifted ball at rest on the outer race, or without centrifugal force on the line of centres."""
    if row.centrifugal_force > 0.0:
        balls[j, 0] = 0.0
        balls[j, 1] = row.outer_reach[j] + row.rest_deflection
    else:
        share = row.outer_reach[j] / max(math.sqrt(a_axial * a_axial + a_radial * a_radial), 1e-30)
        balls[j, 0] = a_axial * share
        balls[j, 1] = a_radial * share


@kernel
def contact_energy(row: Any, j: int, a_axial: float, a_radial: float, x: float, y: float) -> float:
    """Elastic energy of both contacts of ball j less the work of the common centrifugal force [J]."""
    inner = deflection(a_axial - x, a_radial - y, row.inner_reach[j])
    outer = deflection(x, y, row.outer_reach[j])
    elastic = row.inner_stiffness * inner * inner * math.sqrt(inner)
    elastic += row.outer_stiffness * outer * outer * math.sqrt(outer)
    return 0.4 * elastic - row.centrifugal_force * (y - row.outer_reach[j])


@kernel
def balance(row: Any, j: int, a_axial: float, a_radial: float, x: float, y: float) -> tuple[float, ...]:
    """Energy [J], contact loads [N], force (axial, radial) on ball j and its stiffness, orbiting with the cage."""
    one_i, si, ci = line(a_axial - x, a_radial - y)
    one_o, so, co = line(x, y)
    di, do = deflection(a_axial - x, a_radial - y, row.inner_reach[j]), deflection(x, y, row.outer_reach[j])
    qi, ki = spring(di, row.inner_stiffness)
    qo, ko = spring(do, row.outer_stiffness)
    iaa, iar, irr = tangent(qi, ki, one_i, si, ci)
    oaa, oar, orr = tangent(qo, ko, one_o, so, co)
    pull = row.centrifugal_force
    energy = 0.4 * (qi * di + qo * do) - pull * (y - row.outer_reach[j])
    return energy, qi + qo, qi * si - qo * so, qi * ci - qo * co + pull, iaa + oaa, iar + oar, irr + orr


@kernel
def wedge(row: Any, j: int, a_axial: float, a_radial: float) -> tuple[float, float]:
    """Outermost position where ball j just touches both races; on the line of centres where it is squeezed."""
    length = math.sqrt(a_axial * a_axial + a_radial * a_radial)
    ri, ro = row.inner_reach[j], row.outer_reach[j]
    cos_a, sin_a = a_radial / length, a_axial / length
    squeeze = length - ri - ro
    if squeeze > 0.0:
        soft = row.inner_stiffness ** (2.0 / 3.0)
        along = ro + squeeze * soft / (soft + row.outer_stiffness ** (2.0 / 3.0))
        return along * sin_a, along * cos_a
    along = 0.5 * (length + (ro - ri) * (ro + ri) / length)
    across = math.sqrt(max(ro * ro - along * along, 0.0))
    if sin_a < 0.0:
        across = -across
    return along * sin_a - across * cos_a, along * cos_a + across * sin_a


@kernel
def settle(row: Any, j: int, a_axial: float, a_radial: float, share: float, balls: Any) -> None:
    """Put ball j, orbiting with the cage, at its least energy for a fixed ring: guarded Newton in two unknowns.

    It stops when the unbalanced force is below ``share`` of the contact loads.
    """
    if is_lifted(row, j, a_axial, a_radial):
        put_at_rest(row, j, balls, a_axial, a_radial)
        return
    x, y = wedge(row, j, a_axial, a_radial)
    pull = row.centrifugal_force
    if pull == 0.0:
        balls[j, 0], balls[j, 1] = x, y
        return
    out = 1.0 + row.rest_deflection / row.outer_reach[j]
    x, y = x * out, y * out
    high = row.outer_reach[j] + row.rest_deflection
    at_rest = contact_energy(row, j, a_axial, a_radial, 0.0, high)
    if at_rest < contact_energy(row, j, a_axial, a_radial, x, y):
        x, y = 0.0, high
    energy, contact_load, fa, fr, aa, ar, rr = balance(row, j, a_axial, a_radial, x, y)
    damping = 0.0
    for _ in range(SETTLING_STEPS):
        residual = abs(fa) + abs(fr)
        if residual < share * contact_load:
            break
        inverse = 1.0 / ((aa + damping) * (rr + damping) - ar * ar)
        da = ((rr + damping) * fa - ar * fr) * inverse
        dr = ((aa + damping) * fr - ar * fa) * inverse
        scale, moved = 1.0, False
        while scale > SHORTEST and not moved:
            trial, contact_load_, fa_, fr_, aa_, ar_, rr_ = balance(
                row, j, a_axial, a_radial, x + scale * da, y + scale * dr
            )
            # Near the minimum, rounding hides differences of the energy; the forces still show them.
            if trial < energy or abs(fa_) + abs(fr_) < 0.5 * residual:
                x, y, moved = x + scale * da, y + scale * dr, True
                energy, contact_load, fa, fr, aa, ar, rr = trial, contact_load_, fa_, fr_, aa_, ar_, rr_
            scale *= 0.5
        if not moved and damping > 0.0:
            break
        damping = 0.0 if moved else 1e-2 * (aa + rr)
    balls[j, 0], balls[j, 1] = x, y


RING = 5
# Columns of the work space of a ball: Newton step (axial, radial), its derivative by A (four), the flag of a loaded ball,
# the lines of both contacts (axial, radial), and the depths of the geometry less those of the ball [m].
BALL_WORK = 13
LOADED, INNER_LINE, OUTER_LINE, INNER_GAP, OUTER_GAP = 6, 7, 9, 11, 12
# Columns of ``balls``: position (axial, radial) and depth of the contacts (inner, outer) [m].
AXIAL, RADIAL, INNER_DEPTH, OUTER_DEPTH, BALL = range(5)
# Sums over the balls; from REACTION on, the load that the ring takes [N].
ENERGY, UNBALANCE, WORST, LARGEST, REACTION = range(5)
SUMS = REACTION + RING
# Residual over the contact loads below which a ball counts as settled.
BALANCE = 1e-11
# Least share of a depth that remains after a Newton step.
LEAST_DEPTH_SHARE = 0.2


@kernel
def measure(row: Any, j: int, a_axial: float, a_radial: float, balls: Any) -> None:
    """Set the depths of ball j by its position."""
    x, y = balls[j, AXIAL], balls[j, RADIAL]
    balls[j, INNER_DEPTH] = deflection(a_axial - x, a_radial - y, row.inner_reach[j])
    balls[j, OUTER_DEPTH] = deflection(x, y, row.outer_reach[j])


@kernel
def diverges(convex: bool, forces: Any) -> bool:
    """Whether a ball is so far from balance that Newton's step is useless and the ball must be settled alone."""
    (ra, rr), (fa, fr, _) = forces[0], forces[1]
    residual, force = max(abs(ra), abs(rr)), max(abs(fa), abs(fr))
    return residual > 0.3 * force if convex else force == 0.0


@kernel
def forces_on(control: Any, strength: float, row: Any, j: int, a_axial: float, a_radial: float, balls: Any) -> Any:
    """``ball_forces`` of ball j at its position."""
    return ball_forces(
        control, strength, row, a_axial, a_radial, balls[j, AXIAL], balls[j, RADIAL], balls[j, INNER_DEPTH],
        balls[j, OUTER_DEPTH],
    )  # fmt: skip


@kernel
def add_up(row: Any, j: int, forces: Any, springs: Any, balls: Any, sums: Any) -> None:
    """Add energy, residual and ring forces of ball j to ``sums``."""
    (ra, rr), (fa, fr, fm), _, _, _, _, pull, _ = forces
    (qi, _), (qo, _) = springs
    sums[ENERGY] += 0.4 * (qi * balls[j, INNER_DEPTH] + qo * balls[j, OUTER_DEPTH])
    sums[ENERGY] -= row.centrifugal_force * (balls[j, RADIAL] - row.outer_reach[j])
    sums[UNBALANCE] += ra * ra + rr * rr
    sums[WORST] = max(sums[WORST], abs(ra), abs(rr))
    sums[LARGEST] = max(sums[LARGEST], abs(fa), abs(fr), abs(pull))
    c, s = row.cosine[j], row.sine[j]
    turn = fa + fm * (1.0 / row.lever)
    sums[REACTION] += fr * c
    sums[REACTION + 1] += fr * s
    sums[REACTION + 2] += fa
    sums[REACTION + 3] += turn * s
    sums[REACTION + 4] -= turn * c


@kernel
def extrapolation(force: float, by_a: Any, by_x: Any, gaps: Any) -> float:
    """``force`` where the ``gaps`` (axial, radial) of the inner and the outer contact are closed, from its derivatives."""
    outer_a, outer_r = by_x[0] + by_a[0], by_x[1] + by_a[1]
    return force + (by_a[0] * gaps[0] + by_a[1] * gaps[1] + outer_a * gaps[2] + outer_r * gaps[3])


@kernel
def close_gaps(
    row: Any, j: int, a_axial: float, a_radial: float, forces: Any, springs: Any, balls: Any, work: Any, sums: Any
) -> Any:
    """Residual and ring forces of ball j with its gaps closed: the step counts its position beyond its depths."""
    (ra, rr), (fa, fr, fm), by_a, by_x, ring_a, ring_x, _, _ = forces
    x, y = balls[j, AXIAL], balls[j, RADIAL]
    one_i, si, ci = line(a_axial - x, a_radial - y)
    one_o, so, co = line(x, y)
    gap_i = 1.0 / one_i - row.inner_reach[j] - balls[j, INNER_DEPTH]
    gap_o = 1.0 / one_o - row.outer_reach[j] - balls[j, OUTER_DEPTH]
    (_, ki), (_, ko) = springs
    slip = max(abs(gap_i) * ki, abs(gap_o) * ko)
    sums[WORST] = max(sums[WORST], slip)
    sums[UNBALANCE] += slip * slip
    work[j, INNER_LINE], work[j, INNER_LINE + 1], work[j, INNER_GAP] = si, ci, gap_i
    work[j, OUTER_LINE], work[j, OUTER_LINE + 1], work[j, OUTER_GAP] = so, co, gap_o
    gaps = gap_i * si, gap_i * ci, gap_o * so, gap_o * co
    residual = extrapolation(ra, by_a[:2], by_x[:2], gaps), extrapolation(rr, by_a[2:], by_x[2:], gaps)
    force = extrapolation(fa, ring_a[:2], ring_x[:2], gaps), extrapolation(fr, ring_a[2:4], ring_x[2:4], gaps)
    return residual, (*force, extrapolation(fm, ring_a[4:], ring_x[4:], gaps))


@kernel
def eliminate_ball(row: Any, j: int, residual: Any, ring: Any, forces: Any, one_b: float, work: Any) -> Any:
    """Step of ball j into ``work``; its force (axial, radial, couple) on the ring after it, and that by A (six).

    The ball moves by -B^-1 (residual + R dA): B = d residual/dX with 1/determinant ``one_b``, R = d residual/dA.
    """
    (ra, rr), (fa, fr, fm), (_, _, by_a, by_x, ring_a, ring_x, _, _) = residual, ring, forces
    b0, b1, b2, b3 = by_x[3] * one_b, -by_x[1] * one_b, -by_x[2] * one_b, by_x[0] * one_b
    da, dr = -(b0 * ra + b1 * rr), -(b2 * ra + b3 * rr)
    m0, m1 = -(b0 * by_a[0] + b1 * by_a[2]), -(b0 * by_a[1] + b1 * by_a[3])
    m2, m3 = -(b2 * by_a[0] + b3 * by_a[2]), -(b2 * by_a[1] + b3 * by_a[3])
    work[j, 0], work[j, 1] = da, dr
    work[j, 2], work[j, 3], work[j, 4], work[j, 5] = m0, m1, m2, m3
    inverse = 1.0 / row.lever
    ta = fa + ring_x[0] * da + ring_x[1] * dr
    tr = fr + ring_x[2] * da + ring_x[3] * dr
    tm = ta + (fm + ring_x[4] * da + ring_x[5] * dr) * inverse
    aa = ring_a[0] + ring_x[0] * m0 + ring_x[1] * m2
    ar = ring_a[1] + ring_x[0] * m1 + ring_x[1] * m3
    ra_, rr_ = ring_a[2] + ring_x[2] * m0 + ring_x[3] * m2, ring_a[3] + ring_x[2] * m1 + ring_x[3] * m3
    ma = aa + (ring_a[4] + ring_x[4] * m0 + ring_x[5] * m2) * inverse
    mr = ar + (ring_a[5] + ring_x[4] * m1 + ring_x[5] * m3) * inverse
    return (ta, tr, tm), (aa, ar, ra_, rr_, ma, mr)


@kernel
def add_to_ring(c: float, s: float, force: Any, stiffness: Any, matrix: Any, vector: Any) -> None:
    """Add a ball of ``eliminate_ball`` at the azimuth (c, s) to the ring's system, without the entries known by symmetry."""
    (ta, tr, tm), (aa, ar, ra, rr, ma, mr) = force, stiffness
    vector[0] -= tr * c
    vector[1] -= tr * s
    vector[2] -= ta
    vector[3] -= tm * s
    vector[4] += tm * c
    cc, cs, ss = c * c, c * s, s * s
    matrix[0, 0] += rr * cc
    matrix[0, 1] += rr * cs
    matrix[1, 1] += rr * ss
    matrix[0, 2] += ra * c
    matrix[1, 2] += ra * s
    matrix[0, 3] += ra * cs
    matrix[0, 4] -= ra * cc
    matrix[1, 3] += ra * ss
    matrix[2, 0] += ar * c
    matrix[2, 1] += ar * s
    matrix[2, 2] += aa
    matrix[2, 3] += aa * s
    matrix[2, 4] -= aa * c
    matrix[3, 0] += mr * cs
    matrix[3, 1] += mr * ss
    matrix[3, 2] += ma * s
    matrix[3, 3] += ma * ss
    matrix[3, 4] -= ma * cs
    matrix[4, 0] -= mr * cc
    matrix[4, 2] -= ma * c
    matrix[4, 4] += ma * cc


@routine
def assemble(task: Any, strength: float, mixed: bool, state: Any) -> None:
    """Ring forces at ``state.q`` and ``state.balls``, with the balls eliminated.

    ``mixed``: whether the depths in ``state.balls`` are separate unknowns; else the positions set them. Fills

    - ``state.matrix``: derivative by q of the load that the ring takes while every ball stays in balance [N/m]
    - ``state.vector``: the load less that of the ring once the balls have moved into balance, to first order [N]
    - ``state.work``: for ``follow``
    - ``state.sums``: energy [J], squared length of the balls' residuals [N^2], the largest residual [N], the largest force [N]
      and the load that the ring takes

    Moments and couples are divided by the lever. Lifted balls are put to rest.
    """
    # Arrays leave their tuple once: inside the loop, numba would count references.
    control, row, load, q, balls, work = task.control, task.row, task.load, state.q, state.balls, state.work
    matrix, vector, sums = state.matrix, state.vector, state.sums
    for i in range(RING):
        vector[i] = load[i]
    matrix[:, :] = 0.0
    sums[:] = 0.0
    for j in range(row.cosine.size):
        a_axial, a_radial = groove_centre(row, q, j)
        if is_lifted(row, j, a_axial, a_radial):
            put_at_rest(row, j, balls, a_axial, a_radial)
            work[j, LOADED] = 0.0
            sums[LARGEST] = max(sums[LARGEST], row.centrifugal_force)
            # The energy of a ball at rest on the outer race.
            sums[ENERGY] += row.rest_energy
            continue
        if work[j, LOADED] == 0.0:
            settle(row, j, a_axial, a_radial, BALANCE, balls)
            work[j, LOADED] = 1.0
            measure(row, j, a_axial, a_radial, balls)
        elif not mixed:
            measure(row, j, a_axial, a_radial, balls)
        forces = forces_on(control, strength, row, j, a_axial, a_radial, balls)
        if diverges(strength == 0.0, forces):
            settle(row, j, a_axial, a_radial, BALANCE, balls)
            measure(row, j, a_axial, a_radial, balls)
            forces = forces_on(control, strength, row, j, a_axial, a_radial, balls)
        springs = spring(balls[j, INNER_DEPTH], row.inner_stiffness), spring(balls[j, OUTER_DEPTH], row.outer_stiffness)
        add_up(row, j, forces, springs, balls, sums)
        residual, ring, by_x = forces[0], forces[1], forces[3]
        if mixed:
            residual, ring = close_gaps(row, j, a_axial, a_radial, forces, springs, balls, work, sums)
        determinant = by_x[0] * by_x[3] - by_x[1] * by_x[2]
        if determinant == 0.0:
            # Squeezed by less than the spacing of numbers, the ball counts as lifted.
            work[j, LOADED] = 0.0
            continue
        force, stiffness = eliminate_ball(row, j, residual, ring, forces, 1.0 / determinant, work)
        add_to_ring(row.cosine[j], row.sine[j], force, stiffness, matrix, vector)
    matrix[1, 0] = matrix[0, 1]
    matrix[1, 4] = -matrix[0, 3]
    matrix[4, 1] = -matrix[3, 0]
    matrix[4, 3] = matrix[3, 4]
    for i in range(RING):
        sums[ENERGY] -= load[i] * q[i]
        sums[LARGEST] = max(sums[LARGEST], abs(load[i]))


@kernel
def unbalance(task: Any, state: Any) -> tuple[float, float]:
    """Squared length of all residuals [N^2] and the largest residual [N], the ring's free components included."""
    sums, load, free = state.sums, task.load, task.free
    total, worst = sums[UNBALANCE], sums[WORST]
    for i in range(RING):
        residual = (load[i] - sums[REACTION + i]) * free[i]
        total += residual * residual
        worst = max(worst, abs(residual))
    return total, worst


@kernel
def ball_step(row: Any, j: int, step: Any, work: Any) -> tuple[float, float, float, float]:
    """Shifts [m] by the ring's ``step``: of the inner groove centre at ball j, then of the ball, (axial, radial) each."""
    axial, radial = centre_shift(row, j, step)
    x = work[j, 0] + work[j, 2] * axial + work[j, 3] * radial
    return axial, radial, x, work[j, 1] + work[j, 4] * axial + work[j, 5] * radial


@routine
def follow(row: Any, scale: float, work: Any, state: Any) -> None:
    """Move ring and balls from ``state.old_q`` and ``state.old_balls`` by ``scale`` times the Newton step; ``work``: that of the balls."""
    start, balls, step, q, old_q = state.old_balls, state.balls, state.step, state.q, state.old_q
    for i in range(RING):
        q[i] = old_q[i] + scale * step[i]
    for j in range(row.cosine.size):
        for i in range(BALL):
            balls[j, i] = start[j, i]
        if work[j, LOADED] > 0.0:
            axial, radial, x, y = ball_step(row, j, step, work)
            balls[j, AXIAL] += scale * x
            balls[j, RADIAL] += scale * y
            inner = work[j, INNER_GAP] + work[j, INNER_LINE] * (axial - x) + work[j, INNER_LINE + 1] * (radial - y)
            outer = work[j, OUTER_GAP] + work[j, OUTER_LINE] * x + work[j, OUTER_LINE + 1] * y
            balls[j, INNER_DEPTH] = max(
                start[j, INNER_DEPTH] + scale * inner, LEAST_DEPTH_SHARE * start[j, INNER_DEPTH]
            )
            balls[j, OUTER_DEPTH] = max(
                start[j, OUTER_DEPTH] + scale * outer, LEAST_DEPTH_SHARE * start[j, OUTER_DEPTH]
            )
