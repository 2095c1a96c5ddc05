"""Forces on the inner ring with the balls eliminated.

The unknowns are the ring's displacement q = (x, y, z, R theta_x, R theta_y) [m], tilts times the lever R = R_i so that all five
are lengths, and the place X_j of each ball. The Jacobian is an arrow: 2 x 2 blocks for the balls, bordered by the ring.
Eliminating the balls (Schur complement) leaves 5 x 5 and costs O(Z).
"""

from __future__ import annotations

from typing import Any

from rbdyn.kernel import kernel, routine
from rbdyn.quasistatic.ball import ball_forces
from rbdyn.quasistatic.place import contact_energy, groove_centre, lifted, rest, settle

RING = 5
# Columns of the work space of a ball: Newton step (axial, radial), its change with A (four), open or loaded.
BALL_WORK = 7
LOADED = 6
# Sums that ``assemble`` leaves in ``sums``; from TAKEN on what the ring takes [N].
ENERGY, UNBALANCE, WORST, LARGEST, TAKEN = range(5)
SUMS = TAKEN + RING


@kernel
def astray(strength: float, row: Any, ra: float, rr: float, fa: float, fr: float) -> bool:
    """Whether a ball is so far from balance that it is better settled by itself."""
    lacking, held = max(abs(ra), abs(rr)), max(abs(fa), abs(fr))
    if strength == 0.0:
        return lacking > 0.3 * held
    return held == 0.0


@routine
def assemble(
    control: Any,
    strength: float,
    row: Any,
    load: Any,
    q: Any,
    balls: Any,
    matrix: Any,
    vector: Any,
    work: Any,
    sums: Any,
) -> None:
    """Ring forces at ``q`` and ``balls``, with the balls eliminated.

    Fills ``matrix`` (5, 5), the derivative of the load that the ring takes by q where every ball stays in balance [N/m];
    ``vector`` (5,), the load less what the ring takes once the balls have moved into balance to first order [N];
    ``work`` (Z, BALL_WORK) for ``follow``; ``sums``: energy [J], the squared length of all residuals [N^2], the largest
    of them [N] and the largest force [N]. Moments and couples count over the lever. Lifted balls in ``balls`` are put to rest.
    """
    size = row.cosine.size
    for i in range(RING):
        vector[i] = load[i]
        for k in range(RING):
            matrix[i, k] = 0.0
    energy, unbalance, worst, largest = 0.0, 0.0, 0.0, 0.0
    taken_x, taken_y, taken_z, taken_u, taken_v = 0.0, 0.0, 0.0, 0.0, 0.0
    one = 1.0 / row.lever
    for j in range(size):
        a_axial, a_radial = groove_centre(row, q, j)
        if lifted(row, j, a_axial, a_radial):
            rest(row, j, balls, a_axial, a_radial)
            work[j, LOADED] = 0.0
            largest = max(largest, row.centrifugal_force)
            energy += contact_energy(row, j, a_axial, a_radial, balls[j, 0], balls[j, 1])
            continue
        work[j, LOADED] = 1.0
        for attempt in range(2):
            (ra, rr), (fa, fr, fm), by_a, by_x, ring_a, ring_x, pull, _ = ball_forces(
                control, strength, row, j, a_axial, a_radial, balls[j, 0], balls[j, 1]
            )
            # The ball's own force on the ring is small against what it lacks: Newton's step would tell nothing.
            if attempt == 1 or not astray(strength, row, ra, rr, fa, fr):
                break
            settle(row, j, a_axial, a_radial, balls)
        energy += contact_energy(row, j, a_axial, a_radial, balls[j, 0], balls[j, 1])
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
        # The ball moves by -B^-1 (residual + R dA): B = d residual/dX, R = d residual/dA.
        one_b = 1.0 / (by_x[0] * by_x[3] - by_x[1] * by_x[2])
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


@kernel
def follow(row: Any, step: Any, scale: float, work: Any, start: Any, balls: Any) -> None:
    """Move the balls from ``start`` by ``scale`` times the Newton step that goes with the ring's ``step`` [m]."""
    for j in range(row.cosine.size):
        balls[j, 0], balls[j, 1] = start[j, 0], start[j, 1]
        if work[j, LOADED] > 0.0:
            c, s = row.cosine[j], row.sine[j]
            axial = step[2] + step[3] * s - step[4] * c
            radial = step[0] * c + step[1] * s
            balls[j, 0] += scale * (work[j, 0] + work[j, 2] * axial + work[j, 3] * radial)
            balls[j, 1] += scale * (work[j, 1] + work[j, 4] * axial + work[j, 5] * radial)
