"""Places in the plane of a ball: the inner groove centre, a ball clear of the inner race, a ball at rest between both."""

import math
from typing import Any

from rbdyn.compiled.kernel import kernel
from rbdyn.quasistatic.row.ball import deflection, line, spring, tangent

# A light ball slides along a curved, narrow valley of its energy.
SETTLING_STEPS = 300
SHORTEST = 1e-7


@kernel
def groove_centre(row: Any, q: Any, j: int) -> tuple[float, float]:
    """Place (axial, radial) of the inner groove centre at ball j [m]."""
    c, s = row.cosine[j], row.sine[j]
    return row.axial[j] + q[2] + q[3] * s - q[4] * c, row.radial[j] + q[0] * c + q[1] * s


@kernel
def moved_centre(row: Any, j: int, step: Any) -> tuple[float, float]:
    """How far a ``step`` (5,) of the ring moves the inner groove centre at ball j, (axial, radial) in the unit of the step."""
    c, s = row.cosine[j], row.sine[j]
    return step[2] + step[3] * s - step[4] * c, step[0] * c + step[1] * s


@kernel
def lifted(row: Any, j: int, a_axial: float, a_radial: float) -> bool:
    """Whether ball j, pressed to the outer race by its centrifugal force alone, is clear of the inner race."""
    if row.centrifugal_force > 0.0:
        high = a_radial - row.outer_reach[j] - row.rest_deflection
        reach = row.inner_reach[j]
        return a_axial * a_axial + high * high <= reach * reach
    reach = row.inner_reach[j] + row.outer_reach[j]
    return a_axial * a_axial + a_radial * a_radial <= reach * reach


@kernel
def rest(row: Any, j: int, balls: Any, a_axial: float, a_radial: float) -> None:
    """Put a lifted ball where it rests: on the outer race, or without centrifugal force on the line of centres."""
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
    """Where ball j just touches both races, the outermost such place; on the line of centres where it is squeezed."""
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
    """Put ball j where its energy is least for a fixed ring, orbiting with the cage: guarded Newton in two unknowns.

    Until no more than the share ``settled`` of its contact loads is out of balance.
    """
    if lifted(row, j, a_axial, a_radial):
        rest(row, j, balls, a_axial, a_radial)
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
    energy, held, fa, fr, aa, ar, rr = balance(row, j, a_axial, a_radial, x, y)
    damping = 0.0
    for _ in range(SETTLING_STEPS):
        lacking = abs(fa) + abs(fr)
        if lacking < share * held:
            break
        one = 1.0 / ((aa + damping) * (rr + damping) - ar * ar)
        da = ((rr + damping) * fa - ar * fr) * one
        dr = ((aa + damping) * fr - ar * fa) * one
        scale, moved = 1.0, False
        while scale > SHORTEST and not moved:
            trial, held_, fa_, fr_, aa_, ar_, rr_ = balance(row, j, a_axial, a_radial, x + scale * da, y + scale * dr)
            # Near the bottom the energy no longer tells better from worse, the forces still do.
            if trial < energy or abs(fa_) + abs(fr_) < 0.5 * lacking:
                x, y, moved = x + scale * da, y + scale * dr, True
                energy, held, fa, fr, aa, ar, rr = trial, held_, fa_, fr_, aa_, ar_, rr_
            scale *= 0.5
        if not moved and damping > 0.0:
            break
        damping = 0.0 if moved else 1e-2 * (aa + rr)
    balls[j, 0], balls[j, 1] = x, y
