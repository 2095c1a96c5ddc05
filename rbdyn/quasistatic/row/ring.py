"""Forces on the inner ring with the balls eliminated.

The unknowns are the ring's displacement q = (x, y, z, R theta_x, R theta_y) [m], tilts times the lever R = R_i so that all five
are lengths, and the place X_j of each ball. The Jacobian is an arrow: 2 x 2 blocks for the balls, bordered by the ring.
Eliminating the balls (Schur complement) leaves 5 x 5 and costs O(Z).
"""

from __future__ import annotations

from typing import Any

from rbdyn.compiled.kernel import kernel, routine
from rbdyn.quasistatic.row.ball import ball_forces, deflection, line, spring
from rbdyn.quasistatic.row.place import groove_centre, lifted, rest, settle

RING = 5
# Columns of the work space of a ball: Newton step (axial, radial), its change with A (four), open or loaded, then the lines
# of both contacts (axial, radial) and what the geometry has deeper than the ball's depths [m].
BALL_WORK = 13
LOADED, INNER_LINE, OUTER_LINE, INNER_GAP, OUTER_GAP = 6, 7, 9, 11, 12
# Columns of ``balls``: place (axial, radial) and depth of the contacts (inner, outer) [m].
AXIAL, RADIAL, INNER_DEPTH, OUTER_DEPTH, BALL = range(5)
# Residual over the contact loads of a ball that counts as settled.
SETTLED = 1e-11
# A Newton step leaves at least this share of a depth.
LEFT = 0.2
# Sums that ``assemble`` leaves in ``sums``; from TAKEN on what the ring takes [N].
ENERGY, UNBALANCE, WORST, LARGEST, TAKEN = range(5)
SUMS = TAKEN + RING


@kernel
def measure(row: Any, j: int, a_axial: float, a_radial: float, balls: Any) -> None:
    """Set the depths of ball j to what its place tells."""
    x, y = balls[j, AXIAL], balls[j, RADIAL]
    balls[j, INNER_DEPTH] = deflection(a_axial - x, a_radial - y, row.inner_reach[j])
    balls[j, OUTER_DEPTH] = deflection(x, y, row.outer_reach[j])


@kernel
def astray(convex: bool, ra: float, rr: float, fa: float, fr: float) -> bool:
    """Whether a ball is so far from balance that it is better settled by itself: Newton's step would tell nothing."""
    lacking, held = max(abs(ra), abs(rr)), max(abs(fa), abs(fr))
    return lacking > 0.3 * held if convex else held == 0.0


@routine
def assemble(
    control: Any, strength: float, mixed: bool, row: Any, load: Any, q: Any, balls: Any, matrix: Any, vector: Any,
    work: Any, sums: Any,
) -> None:  # fmt: skip
    """Ring forces at ``q`` and ``balls``, with the balls eliminated.

    ``mixed``: whether the depths in ``balls`` are unknowns of their own; else they are set to what the places tell.
    Fills ``matrix`` (5, 5), the derivative of the load that the ring takes by q where every ball stays in balance [N/m];
    ``vector`` (5,), the load less what the ring takes once the balls have moved into balance to first order [N];
    ``work`` (Z, BALL_WORK) for ``follow``; ``sums``: energy [J], the squared length of the balls' residuals [N^2], the largest
    of them [N], the largest force [N] and what the ring takes. Moments and couples count over the lever. Lifted balls are put
    to rest.
    """
    vector[:] = load
    matrix[:, :] = 0.0
    energy, unbalance, worst, largest = 0.0, 0.0, 0.0, 0.0
    taken_x, taken_y, taken_z, taken_u, taken_v = 0.0, 0.0, 0.0, 0.0, 0.0
    one = 1.0 / row.lever
    for j in range(row.cosine.size):
        a_axial, a_radial = groove_centre(row, q, j)
        if lifted(row, j, a_axial, a_radial):
            rest(row, j, balls, a_axial, a_radial)
            work[j, LOADED] = 0.0
            largest = max(largest, row.centrifugal_force)
            # By its place: at rest on the outer race.
            energy += row.rest_energy
            continue
        if work[j, LOADED] == 0.0:
            settle(row, j, a_axial, a_radial, SETTLED, balls)
            measure(row, j, a_axial, a_radial, balls)
            work[j, LOADED] = 1.0
        elif not mixed:
            measure(row, j, a_axial, a_radial, balls)
        for attempt in range(2):
            (ra, rr), (fa, fr, fm), by_a, by_x, ring_a, ring_x, pull, _ = ball_forces(
                control, strength, row, a_axial, a_radial, balls[j, AXIAL], balls[j, RADIAL],
                balls[j, INNER_DEPTH], balls[j, OUTER_DEPTH],
            )  # fmt: skip
            if attempt == 1 or not astray(strength == 0.0, ra, rr, fa, fr):
                break
            settle(row, j, a_axial, a_radial, SETTLED, balls)
            measure(row, j, a_axial, a_radial, balls)
        x, y = balls[j, AXIAL], balls[j, RADIAL]
        qi, ki = spring(balls[j, INNER_DEPTH], row.inner_stiffness)
        qo, ko = spring(balls[j, OUTER_DEPTH], row.outer_stiffness)
        energy += 0.4 * (qi * balls[j, INNER_DEPTH] + qo * balls[j, OUTER_DEPTH])
        energy -= row.centrifugal_force * (y - row.outer_reach[j])
        unbalance += ra * ra + rr * rr
        worst = max(worst, abs(ra), abs(rr))
        largest = max(largest, abs(fa), abs(fr), abs(pull))
        c, s = row.cosine[j], row.sine[j]
        turn = fa + fm * one
        taken_x += fr * c
        taken_y += fr * s
        taken_z += fa
        taken_u += turn * s
        taken_v -= turn * c
        if mixed:
            # What the places tell beyond the depths goes into the step, not into the forces.
            one_i, si, ci = line(a_axial - x, a_radial - y)
            one_o, so, co = line(x, y)
            gap_i = 1.0 / one_i - row.inner_reach[j] - balls[j, INNER_DEPTH]
            gap_o = 1.0 / one_o - row.outer_reach[j] - balls[j, OUTER_DEPTH]
            slip = max(abs(gap_i) * ki, abs(gap_o) * ko)
            worst = max(worst, slip)
            unbalance += slip * slip
            work[j, INNER_LINE], work[j, INNER_LINE + 1], work[j, INNER_GAP] = si, ci, gap_i
            work[j, OUTER_LINE], work[j, OUTER_LINE + 1], work[j, OUTER_GAP] = so, co, gap_o
            ia, ir, oa, or_ = gap_i * si, gap_i * ci, gap_o * so, gap_o * co
            ra += by_a[0] * ia + by_a[1] * ir + (by_x[0] + by_a[0]) * oa + (by_x[1] + by_a[1]) * or_
            rr += by_a[2] * ia + by_a[3] * ir + (by_x[2] + by_a[2]) * oa + (by_x[3] + by_a[3]) * or_
            fa += ring_a[0] * ia + ring_a[1] * ir + (ring_x[0] + ring_a[0]) * oa + (ring_x[1] + ring_a[1]) * or_
            fr += ring_a[2] * ia + ring_a[3] * ir + (ring_x[2] + ring_a[2]) * oa + (ring_x[3] + ring_a[3]) * or_
            fm += ring_a[4] * ia + ring_a[5] * ir + (ring_x[4] + ring_a[4]) * oa + (ring_x[5] + ring_a[5]) * or_
        determinant = by_x[0] * by_x[3] - by_x[1] * by_x[2]
        if determinant == 0.0:
            # Squeezed by less than the spacing of numbers: as good as lifted.
            work[j, LOADED] = 0.0
            continue
        # The ball moves by -B^-1 (residual + R dA): B = d residual/dX, R = d residual/dA.
        one_b = 1.0 / determinant
        b0, b1, b2, b3 = by_x[3] * one_b, -by_x[1] * one_b, -by_x[2] * one_b, by_x[0] * one_b
        da, dr = -(b0 * ra + b1 * rr), -(b2 * ra + b3 * rr)
        m0, m1 = -(b0 * by_a[0] + b1 * by_a[2]), -(b0 * by_a[1] + b1 * by_a[3])
        m2, m3 = -(b2 * by_a[0] + b3 * by_a[2]), -(b2 * by_a[1] + b3 * by_a[3])
        work[j, 0], work[j, 1] = da, dr
        work[j, 2], work[j, 3], work[j, 4], work[j, 5] = m0, m1, m2, m3
        ta = fa + ring_x[0] * da + ring_x[1] * dr
        tr = fr + ring_x[2] * da + ring_x[3] * dr
        tm = ta + (fm + ring_x[4] * da + ring_x[5] * dr) * one
        aa = ring_a[0] + ring_x[0] * m0 + ring_x[1] * m2
        ar = ring_a[1] + ring_x[0] * m1 + ring_x[1] * m3
        ra_, rr_ = ring_a[2] + ring_x[2] * m0 + ring_x[3] * m2, ring_a[3] + ring_x[2] * m1 + ring_x[3] * m3
        ma = aa + (ring_a[4] + ring_x[4] * m0 + ring_x[5] * m2) * one
        mr = ar + (ring_a[5] + ring_x[4] * m1 + ring_x[5] * m3) * one
        vector[0] -= tr * c
        vector[1] -= tr * s
        vector[2] -= ta
        vector[3] -= tm * s
        vector[4] += tm * c
        cc, cs, ss = c * c, c * s, s * s
        matrix[0, 0] += rr_ * cc
        matrix[0, 1] += rr_ * cs
        matrix[1, 1] += rr_ * ss
        matrix[0, 2] += ra_ * c
        matrix[1, 2] += ra_ * s
        matrix[0, 3] += ra_ * cs
        matrix[0, 4] -= ra_ * cc
        matrix[1, 3] += ra_ * ss
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
    matrix[1, 0] = matrix[0, 1]
    matrix[1, 4] = -matrix[0, 3]
    matrix[4, 1] = -matrix[3, 0]
    matrix[4, 3] = matrix[3, 4]
    for i, taken in enumerate((taken_x, taken_y, taken_z, taken_u, taken_v)):
        energy -= load[i] * q[i]
        sums[TAKEN + i] = taken
        largest = max(largest, abs(load[i]))
    sums[ENERGY], sums[UNBALANCE], sums[WORST], sums[LARGEST] = energy, unbalance, worst, largest


@routine
def follow(row: Any, step: Any, scale: float, work: Any, start: Any, balls: Any) -> None:
    """Move the balls from ``start`` by ``scale`` times the Newton step that goes with the ring's ``step`` [m]."""
    for j in range(row.cosine.size):
        for i in range(BALL):
            balls[j, i] = start[j, i]
        if work[j, LOADED] > 0.0:
            c, s = row.cosine[j], row.sine[j]
            axial = step[2] + step[3] * s - step[4] * c
            radial = step[0] * c + step[1] * s
            x = work[j, 0] + work[j, 2] * axial + work[j, 3] * radial
            y = work[j, 1] + work[j, 4] * axial + work[j, 5] * radial
            balls[j, AXIAL] += scale * x
            balls[j, RADIAL] += scale * y
            inner = work[j, INNER_GAP] + work[j, INNER_LINE] * (axial - x) + work[j, INNER_LINE + 1] * (radial - y)
            outer = work[j, OUTER_GAP] + work[j, OUTER_LINE] * x + work[j, OUTER_LINE + 1] * y
            balls[j, INNER_DEPTH] = max(start[j, INNER_DEPTH] + scale * inner, LEFT * start[j, INNER_DEPTH])
            balls[j, OUTER_DEPTH] = max(start[j, OUTER_DEPTH] + scale * outer, LEFT * start[j, OUTER_DEPTH])
