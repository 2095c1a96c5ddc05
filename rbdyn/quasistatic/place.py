"""Places in the plane of a ball: the inner groove centre, a ball clear of the inner race, a ball at rest between both."""

from __future__ import annotations

import math
from typing import Any

from rbdyn.kernel import kernel
from rbdyn.quasistatic.ball import contact, tangent

SETTLING_STEPS = 20
SHORTEST = 1e-6
# Residual over the contact loads of a ball that counts as settled.
SETTLED = 1e-6


@kernel
def groove_centre(row: Any, q: Any, j: int) -> tuple[float, float]:
    """Place (axial, radial) of the inner groove centre at ball j [m]."""
    c, s = row.cosine[j], row.sine[j]
    return row.axial[j] + q[2] + q[3] * s - q[4] * c, row.radial[j] + q[0] * c + q[1] * s


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
    u, v = a_axial - x, a_radial - y
    inner = max(math.sqrt(u * u + v * v) - row.inner_reach[j], 0.0)
    outer = max(math.sqrt(x * x + y * y) - row.outer_reach[j], 0.0)
    elastic = row.inner_stiffness * inner * inner * math.sqrt(inner)
    elastic += row.outer_stiffness * outer * outer * math.sqrt(outer)
    return 0.4 * elastic - row.centrifugal_force * (y - row.outer_reach[j])


@kernel
def settle(row: Any, j: int, a_axial: float, a_radial: float, balls: Any) -> None:
    """Put ball j where its energy is least for a fixed ring, orbiting with the cage: guarded Newton in two unknowns."""
    if lifted(row, j, a_axial, a_radial):
        rest(row, j, balls, a_axial, a_radial)
        return
    pull = row.centrifugal_force
    length = math.sqrt(a_axial * a_axial + a_radial * a_radial)
    squeeze = max(length - row.inner_reach[j] - row.outer_reach[j], 0.0)
    soft = row.inner_stiffness ** (2.0 / 3.0)
    outer = squeeze * soft / (soft + row.outer_stiffness ** (2.0 / 3.0))
    if row.outer_stiffness * outer * math.sqrt(outer) > pull:
        share = (row.outer_reach[j] + outer) / length
        balls[j, 0], balls[j, 1] = a_axial * share, a_radial * share
    else:
        rest(row, j, balls, a_axial, a_radial)
    if pull == 0.0:
        return
    x, y = balls[j, 0], balls[j, 1]
    energy = contact_energy(row, j, a_axial, a_radial, x, y)
    for _ in range(SETTLING_STEPS):
        qi, ki, _, one_i, si, ci = contact(a_axial - x, a_radial - y, row.inner_reach[j], row.inner_stiffness)
        qo, ko, _, one_o, so, co = contact(x, y, row.outer_reach[j], row.outer_stiffness)
        iaa, iar, irr = tangent(qi, ki, one_i, si, ci)
        oaa, oar, orr = tangent(qo, ko, one_o, so, co)
        aa, ar, rr = iaa + oaa, iar + oar, irr + orr
        fa, fr = qi * si - qo * so, qi * ci - qo * co + pull
        if abs(fa) + abs(fr) < SETTLED * (qi + qo):
            break
        one = 1.0 / (aa * rr - ar * ar)
        da, dr = (rr * fa - ar * fr) * one, (aa * fr - ar * fa) * one
        scale, moved = 1.0, False
        while scale > SHORTEST and not moved:
            trial = contact_energy(row, j, a_axial, a_radial, x + scale * da, y + scale * dr)
            if trial < energy:
                x, y, energy, moved = x + scale * da, y + scale * dr, trial, True
            scale *= 0.5
        if not moved:
            break
    balls[j, 0], balls[j, 1] = x, y
