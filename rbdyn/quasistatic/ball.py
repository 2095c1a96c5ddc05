"""Forces on one ball and on the inner ring from it, with their derivatives (PHYSICS of Jones 1960; Harris).

With T = lambda M_g/D the friction forces that take the gyroscopic moment:

    axial   Q_i sin a_i - Q_o sin a_o - T_i cos a_i + T_o cos a_o = 0,
    radial  Q_i cos a_i - Q_o cos a_o + T_i sin a_i - T_o sin a_o + F_c = 0;

on the ring: axial Q_i sin a_i - T_i cos a_i, radial Q_i cos a_i + T_i sin a_i, and the couple f_i D T_i of the friction about
the groove centre.
"""

from __future__ import annotations

import math
from typing import Any

from rbdyn.kernel import kernel, law
from rbdyn.quasistatic.ball_motion import orbit_and_spin
from rbdyn.quasistatic.control import CommonCage, FixedShare, FrictionShare


@kernel
def contact(axial: float, radial: float, reach: float, stiffness: float) -> tuple[float, ...]:
    """Load [N], normal stiffness [N/m], deflection [m], 1/length [1/m], sine and cosine of a contact between two centres
    (axial, radial) [m] apart; load and stiffness are 0 where it is open."""
    length = math.sqrt(axial * axial + radial * radial)
    inverse = 1.0 / length
    deflection = max(length - reach, 0.0)
    root = stiffness * math.sqrt(deflection)
    return root * deflection, 1.5 * root, deflection, inverse, axial * inverse, radial * inverse


@kernel
def tangent(load: float, normal: float, inverse: float, s: float, c: float) -> tuple[float, float, float]:
    """Derivative of a contact's force by the place of its end: axial/axial, axial/radial, radial/radial [N/m]."""
    side = load * inverse
    return side + (normal - side) * s * s, (normal - side) * s * c, side + (normal - side) * c * c


@law
def spin_share(control: Any, inner_deflection: float, outer_deflection: float) -> tuple[float, float, float]:
    """Inner share s of spin and gyroscopic moment, and its derivatives by the deflections [1/m]."""
    raise NotImplementedError


@spin_share.body(FixedShare)
def _fixed(control: Any, inner_deflection: float, outer_deflection: float) -> tuple[float, float, float]:
    return control.inner, 0.0, 0.0


@spin_share.body(FrictionShare)
def _by_friction(
    control: Any, inner_deflection: float, outer_deflection: float
) -> tuple[float, float, float]:
    inner = control.inner_weight * inner_deflection * inner_deflection
    outer = outer_deflection * outer_deflection
    share = inner / (inner + outer)
    both = 2.0 * share * (1.0 - share)
    return share, both / inner_deflection, -both / outer_deflection


@law
def ball_forces(
    control: Any, strength: float, row: Any, j: int, a_axial: float, a_radial: float, x: float, y: float
) -> Any:
    """Ball j with its centre at (x, y) and the inner groove centre at (a_axial, a_radial) [m].

    ``strength``: 0 to 1, how far the race control rules orbit and moment; the rest is the common cage speed.
    Returns (residual, ring, residual by A, residual by X, ring by A, ring by X): residual (axial, radial) [N]; ring
    (axial, radial [N], couple [N m]); derivatives row by row [N/m, N]; then F_c [N], M_g [N m].
    """


@ball_forces.body(CommonCage)
def _going_with_the_cage(control, strength, row, j, a_axial, a_radial, x, y):
    qi, ki, _, one_i, si, ci = contact(a_axial - x, a_radial - y, row.inner_reach[j], row.inner_stiffness)
    qo, ko, _, one_o, so, co = contact(x, y, row.outer_reach[j], row.outer_stiffness)
    aa, ar, rr = tangent(qi, ki, one_i, si, ci)
    oaa, oar, orr = tangent(qo, ko, one_o, so, co)
    pull = row.centrifugal_force
    return (
        (qi * si - qo * so, qi * ci - qo * co + pull),
        (qi * si, qi * ci, 0.0),
        (aa, ar, ar, rr),
        (-aa - oaa, -ar - oar, -ar - oar, -rr - orr),
        (aa, ar, ar, rr, 0.0, 0.0),
        (-aa, -ar, -ar, -rr, 0.0, 0.0),
        pull,
        0.0,
    )


@ball_forces.body(FixedShare, FrictionShare)
def _rolling(control, strength, row, j, a_axial, a_radial, x, y):
    qi, ki, di, one_i, si, ci = contact(a_axial - x, a_radial - y, row.inner_reach[j], row.inner_stiffness)
    qo, ko, do, one_o, so, co = contact(x, y, row.outer_reach[j], row.outer_stiffness)
    aa, ar, rr = tangent(qi, ki, one_i, si, ci)
    oaa, oar, orr = tangent(qo, ko, one_o, so, co)
    if qi <= 0.0 or qo <= 0.0:
        pull = row.centrifugal_force
        return (
            (qi * si - qo * so, qi * ci - qo * co + pull),
            (qi * si, qi * ci, 0.0),
            (aa, ar, ar, rr),
            (-aa - oaa, -ar - oar, -ar - oar, -rr - orr),
            (aa, ar, ar, rr, 0.0, 0.0),
            (-aa, -ar, -ar, -rr, 0.0, 0.0),
            pull,
            0.0,
        )
    spinning = control.spinning
    share, share_i, share_o = spin_share(control, di, do)
    (f, f_i, f_o, f_s), (m, m_i, m_o, m_s) = orbit_and_spin(spinning, share, ci, si, co, so)
    # A lightly loaded ball goes with the cage; from blend_load on the race control alone rules.
    part = min(qi / spinning.blend_load, 1.0)
    follow = strength * part * part * (3.0 - 2.0 * part)
    follow_d = strength * 6.0 * part * (1.0 - part) / spinning.blend_load * ki
    beyond = f - row.centrifugal_force
    pull = row.centrifugal_force + follow * beyond
    moment = follow * m
    by_diameter = 2.0 / spinning.ball_diameter
    ti, to = share * moment * by_diameter, (1.0 - share) * moment * by_diameter
    # By inner angle, outer angle, inner deflection, outer deflection.
    pull_1, pull_2 = follow * f_i, follow * f_o
    pull_3, pull_4 = follow_d * beyond + follow * f_s * share_i, follow * f_s * share_o
    in_share = (m * share + 0.0) * by_diameter
    out_share = m * (1.0 - share) * by_diameter
    grow_i = (m_s * share + m) * by_diameter
    grow_o = (m_s * (1.0 - share) - m) * by_diameter
    ti_1, ti_2 = follow * m_i * share * by_diameter, follow * m_o * share * by_diameter
    ti_3, ti_4 = follow_d * in_share + follow * grow_i * share_i, follow * grow_i * share_o
    to_1, to_2 = follow * m_i * (1.0 - share) * by_diameter, follow * m_o * (1.0 - share) * by_diameter
    to_3, to_4 = follow_d * out_share + follow * grow_o * share_i, follow * grow_o * share_o
    # Down to the places: an angle turns with (c, -s)/length, a deflection grows along (s, c).
    ic, is_ = ci * one_i, si * one_i
    oc, os_ = co * one_o, so * one_o
    pull_ua, pull_ur = pull_1 * ic + pull_3 * si, -pull_1 * is_ + pull_3 * ci
    pull_xa, pull_xr = pull_2 * oc + pull_4 * so, -pull_2 * os_ + pull_4 * co
    ti_ua, ti_ur = ti_1 * ic + ti_3 * si, -ti_1 * is_ + ti_3 * ci
    ti_xa, ti_xr = ti_2 * oc + ti_4 * so, -ti_2 * os_ + ti_4 * co
    to_ua, to_ur = to_1 * ic + to_3 * si, -to_1 * is_ + to_3 * ci
    to_xa, to_xr = to_2 * oc + to_4 * so, -to_2 * os_ + to_4 * co
    # Ring, by the inner line u = A - X and by the outer line X.
    ring_aa, ring_ar = aa - ti_ua * ci + ti * si * ic, ar - ti_ur * ci - ti * si * is_
    ring_ra, ring_rr = ar + ti_ua * si + ti * ci * ic, rr + ti_ur * si - ti * ci * is_
    ring_axa, ring_axr = -ti_xa * ci, -ti_xr * ci
    ring_rxa, ring_rxr = ti_xa * si, ti_xr * si
    res_aa, res_ar = ring_aa + to_ua * co, ring_ar + to_ur * co
    res_ra, res_rr = ring_ra - to_ua * so + pull_ua, ring_rr - to_ur * so + pull_ur
    res_axa = ring_axa - oaa + to_xa * co - to * so * oc
    res_axr = ring_axr - oar + to_xr * co + to * so * os_
    res_rxa = ring_rxa - oar - to_xa * so - to * co * oc + pull_xa
    res_rxr = ring_rxr - orr - to_xr * so + to * co * os_ + pull_xr
    couple = row.inner_groove_radius
    ring_axial, ring_radial = qi * si - ti * ci, qi * ci + ti * si
    return (
        (ring_axial - qo * so + to * co, ring_radial - qo * co - to * so + pull),
        (ring_axial, ring_radial, couple * ti),
        (res_aa, res_ar, res_ra, res_rr),
        (res_axa - res_aa, res_axr - res_ar, res_rxa - res_ra, res_rxr - res_rr),
        (ring_aa, ring_ar, ring_ra, ring_rr, couple * ti_ua, couple * ti_ur),
        (
            ring_axa - ring_aa,
            ring_axr - ring_ar,
            ring_rxa - ring_ra,
            ring_rxr - ring_rr,
            couple * (ti_xa - ti_ua),
            couple * (ti_xr - ti_ur),
        ),
        pull,
        moment,
    )
