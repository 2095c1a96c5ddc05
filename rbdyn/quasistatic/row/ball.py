"""One ball: raceway control, orbit and spin, its forces and those on the inner ring, all with their derivatives.

Sources: Jones, A general theory for elastically constrained ball and radial roller bearings (1960); Harris, *Rolling Bearing Analysis*.

Raceway control decides on which race a ball spins and how the races share its gyroscopic moment. A ball cannot roll without
spin on both races. Each spin moment is the spin speed times a weight, w_i or w_o. Their balance is linear in the tangent of
the pitch angle b of the ball's axis:

    tan b = rise/run;
    rise = w_o sin a_o/P + w_i sin a_i/N;
    run = w_o (cos a_o + g)/P + w_i (cos a_i - g)/N;
    P = 1 + g cos a_o;  N = 1 - g cos a_i;  g = D/d_m.

w_i = 0 is Jones's outer raceway control, w_o = 0 inner control; equal weights share evenly. The friction-weighted hybrid
takes the friction moments of the Hertz ellipses, w = Q a E(k). The friction forces that balance the gyroscopic moment are
shared by the same weights: lambda_i = 2 s, lambda_o = 2 (1 - s) with s = w_i/(w_i + w_o). The simplest hypothesis has one
common cage speed and no gyroscopic moment.

Orbit w_m, spin w_R, centrifugal force F_c and gyroscopic moment M_g follow from rolling without slip at both contacts:

    K = N cos(a_o - b) + P cos(a_i - b);
    w_m = [w_in N cos(a_o - b) + w_out P cos(a_i - b)] / K;
    w_R = (w_out - w_in) N P / (g K);
    F_c = m d_m w_m^2/2;  M_g = J w_R w_m sin b.

Numerators and denominators have the same degree in (cos b, sin b), so no angle is computed. w_R is positive where the outer
ring turns faster. With a turning inner ring M_g is therefore negative. Many texts drop this sign; friction then pushes the
ball the other way.

Balance of a ball, with the friction forces T = lambda M_g/D:

    axial   Q_i sin a_i - Q_o sin a_o
            - T_i cos a_i + T_o cos a_o = 0,
    radial  Q_i cos a_i - Q_o cos a_o
            + T_i sin a_i - T_o sin a_o + F_c = 0.

The ball puts on the ring the axial force Q_i sin a_i - T_i cos a_i and the radial force Q_i cos a_i + T_i sin a_i. Friction
adds the couple f_i D T_i about the groove centre.
"""

import math
from typing import Any, NamedTuple

from rbdyn.compiled.kernel import kernel, law, law_of


class Spinning(NamedTuple):
    """Parameters of the orbit and spin of a ball, next to its contact angles. SI.

    ``ratio``: g = D/d_m. ``orbit_mass``: half the ball's mass times the pitch diameter, F_c = orbit_mass w_m^2 [kg m].
    ``inertia``: J of the ball [kg m^2], 0 without a gyroscopic moment. ``turning``: -1 keeps the sign of the ball's spin
    for an inner ring that turns faster, +1 drops it. ``blend_load``: inner contact load [N] above which the race control
    rules the ball; an unloaded ball orbits with the cage. ``friction``: largest coefficient that may balance a gyroscopic moment.
    """

    ratio: float
    ball_diameter: float
    orbit_mass: float
    inertia: float
    turning: float
    inner_speed: float
    outer_speed: float
    blend_load: float
    friction: float


class CommonCage(NamedTuple):
    """All balls orbit at one speed; no gyroscopic moment."""

    cage_speed: float


class FixedShare(NamedTuple):
    """Weights of the spin moments fixed: ``inner`` = w_i/(w_i + w_o), 0 for outer and 1 for inner raceway control."""

    inner: float
    spinning: Spinning


class FrictionShare(NamedTuple):
    """Weights from friction, w_i/w_o = inner_weight (delta_i/delta_o)^2.

    ``inner_weight``: (a E/Q^(1/3)) K^(4/3) of the inner race over that of the outer.
    """

    inner_weight: float
    spinning: Spinning


Control = CommonCage | FixedShare | FrictionShare


@kernel
def orbit_and_spin(spinning: Any, share: float, ci: float, si: float, co: float, so: float) -> tuple[Any, Any]:
    """F_c [N] and M_g [N m] of a ball, each with its derivatives by inner angle, outer angle and inner ``share``.

    The contact angles enter by cosine and sine. Returns ((F_c, by a_i, by a_o, by share), (M_g, ...)).
    """
    g = spinning.ratio
    outer = 1.0 - share
    p, n = 1.0 + g * co, 1.0 - g * ci
    one_p, one_n = 1.0 / p, 1.0 / n
    flat = 1.0 - g * g
    # tan b = rise/run.
    rise = outer * so * one_p + share * si * one_n
    run = outer * (co + g) * one_p + share * (ci - g) * one_n
    rise_i = share * (ci - g) * one_n * one_n
    run_i = -share * si * flat * one_n * one_n
    rise_o = outer * (co + g) * one_p * one_p
    run_o = -outer * so * flat * one_p * one_p
    rise_s = si * one_n - so * one_p
    run_s = (ci - g) * one_n - (co + g) * one_p
    # cos(a - b) over the common length of (run, rise).
    at_o, at_i = co * run + so * rise, ci * run + si * rise
    at_o_i = co * run_i + so * rise_i
    at_o_o = co * run_o + so * rise_o + co * rise - so * run
    at_o_s = co * run_s + so * rise_s
    at_i_i = ci * run_i + si * rise_i + ci * rise - si * run
    at_i_o = ci * run_o + si * rise_o
    at_i_s = ci * run_s + si * rise_s
    n_i, p_o = g * si, -g * so
    inverse = 1.0 / (n * at_o + p * at_i)
    inverse_i = n_i * at_o + n * at_o_i + p * at_i_i
    inverse_o = n * at_o_o + p_o * at_i + p * at_i_o
    inverse_s = n * at_o_s + p * at_i_s
    lead = n * at_o * inverse
    lead_i = (n_i * at_o + n * at_o_i - lead * inverse_i) * inverse
    lead_o = (n * at_o_o - lead * inverse_o) * inverse
    lead_s = (n * at_o_s - lead * inverse_s) * inverse
    tip = n * p * rise * inverse
    tip_i = (n_i * p * rise + n * p * rise_i - tip * inverse_i) * inverse
    tip_o = (n * p_o * rise + n * p * rise_o - tip * inverse_o) * inverse
    tip_s = (n * p * rise_s - tip * inverse_s) * inverse
    difference = spinning.inner_speed - spinning.outer_speed
    orbit = spinning.outer_speed + difference * lead
    pull = 2.0 * spinning.orbit_mass * orbit * difference
    spin = spinning.turning * spinning.inertia * difference / g
    force = (spinning.orbit_mass * orbit * orbit, pull * lead_i, pull * lead_o, pull * lead_s)
    moment = (
        spin * orbit * tip,
        spin * (difference * lead_i * tip + orbit * tip_i),
        spin * (difference * lead_o * tip + orbit * tip_o),
        spin * (difference * lead_s * tip + orbit * tip_s),
    )
    return force, moment


# Share of the friction limit up to which a contact balances the whole gyroscopic moment.
STICKING = 0.8
# Cosine of the inner angle (78 deg) below which a ball lies across the groove, so that rolling on both races fades out.
ACROSS = 0.2


@kernel
def line(axial: float, radial: float) -> tuple[float, float, float]:
    """1/length [1/m], sine and cosine of the angle of a line between two centres (axial, radial) [m] apart."""
    inverse = 1.0 / math.sqrt(axial * axial + radial * radial)
    return inverse, axial * inverse, radial * inverse


@kernel
def deflection(axial: float, radial: float, reach: float) -> float:
    """Depth [m] of the contact of two bodies with centres (axial, radial) [m] apart; 0 where it is open."""
    return max(math.sqrt(axial * axial + radial * radial) - reach, 0.0)


@kernel
def spring(depth: float, stiffness: float) -> tuple[float, float]:
    """Load [N] and normal stiffness [N/m] of a Hertz contact ``depth`` [m] deep."""
    root = stiffness * math.sqrt(depth)
    return root * depth, 1.5 * root


@kernel
def tangent(load: float, normal: float, inverse: float, s: float, c: float) -> tuple[float, float, float]:
    """Derivative of a contact's force by the place of its end: axial/axial, axial/radial, radial/radial [N/m]."""
    side = load * inverse
    return side + (normal - side) * s * s, (normal - side) * s * c, side + (normal - side) * c * c


@kernel
def smoothstep(part: float) -> tuple[float, float]:
    """Smooth rise from 0 at 0 to 1 at 1 without slope at either end, and its slope."""
    part = min(part, 1.0)
    return part * part * (3.0 - 2.0 * part), 6.0 * part * (1.0 - part)


@kernel
def friction_force(force: float, limit: float) -> tuple[float, float, float]:
    """Friction force [N] of a contact that needs ``force`` and can give at most ``limit`` > 0; its derivatives by both.

    It is the whole force up to the share STICKING of the limit, then approaches the limit smoothly.
    """
    beyond = (abs(force) / limit - STICKING) / (1.0 - STICKING)
    if beyond <= 0.0:
        return force, 1.0, 0.0
    inverse = 1.0 / (1.0 + beyond)
    part = STICKING + (1.0 - STICKING) * beyond * inverse
    slope = inverse * inverse
    side = 1.0 if force > 0.0 else -1.0
    return side * part * limit, slope, side * (part - abs(force) / limit * slope)


@law_of(FixedShare)
def spin_share(control: Any, inner_deflection: float, outer_deflection: float) -> tuple[float, float, float]:
    """Inner share s of spin and gyroscopic moment, and its derivatives by the deflections [1/m]."""
    return control.inner, 0.0, 0.0


@spin_share.body(FrictionShare)
def _by_friction(control: Any, inner_deflection: float, outer_deflection: float) -> tuple[float, float, float]:
    inner = control.inner_weight * inner_deflection * inner_deflection
    outer = outer_deflection * outer_deflection
    share = inner / (inner + outer)
    both = 2.0 * share * (1.0 - share)
    return share, both / inner_deflection, -both / outer_deflection


@law_of(CommonCage)
def has_race_control(control: Any) -> bool:
    """Whether the raceway control differs from one common cage speed."""
    return False


@has_race_control.body(FixedShare, FrictionShare)
def _always(control: Any) -> bool:
    return True


@law
def ball_forces(
    control: Any, strength: float, row: Any, a_axial: float, a_radial: float, x: float, y: float, di: float, do: float
) -> Any:
    """Forces on a ball and on the ring, with their derivatives.

    The ball's centre is X = (x, y), the inner groove centre A = (a_axial, a_radial); the contacts are ``di`` and ``do`` deep [m].
    The depths are separate unknowns: the lines between the centres give only the angles. Derivatives by position treat a
    change along a line as a change of depth.

    ``strength``: from 0, the common cage speed, to 1, the full race control of orbit and moment.
    Returns (residual, ring, residual by A, residual by X, ring by A, ring by X, F_c [N], M_g [N m]). The residual is
    (axial, radial) [N], the ring's part (axial, radial [N], couple [N m]); derivatives are row by row [N/m, N].
    """


@kernel
def elastic_forces(row: Any, a_axial: float, a_radial: float, x: float, y: float, di: float, do: float) -> Any:
    """``ball_forces`` of a ball that orbits with the cage: contact springs and the common centrifugal force."""
    one_i, si, ci = line(a_axial - x, a_radial - y)
    one_o, so, co = line(x, y)
    qi, ki = spring(di, row.inner_stiffness)
    qo, ko = spring(do, row.outer_stiffness)
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


@ball_forces.body(CommonCage)
def _going_with_the_cage(control, strength, row, a_axial, a_radial, x, y, di, do):
    return elastic_forces(row, a_axial, a_radial, x, y, di, do)


@kernel
def race_control_forces(control: Any, strength: float, row: Any, inner: Any, outer: Any, di: float, do: float) -> Any:
    """Centrifugal force F_c and friction forces T_i and T_o [N] by the race control, then M_g [N m].

    Each force is (value, derivatives by inner angle, outer angle, inner depth, outer depth). ``inner, outer``: sine,
    cosine, load and stiffness of the contacts.
    """
    (si, ci, qi, ki), (so, co, qo, ko) = inner, outer
    spinning = control.spinning
    share, share_i, share_o = spin_share(control, di, do)
    (f, f_i, f_o, f_s), (m, m_i, m_o, m_s) = orbit_and_spin(spinning, share, ci, si, co, so)
    # A lightly loaded ball, or one across the groove, orbits with the cage; otherwise the race control alone rules.
    loaded, loaded_q = smoothstep(qi / spinning.blend_load)
    level, level_c = smoothstep(ci / ACROSS)
    follow = strength * loaded * level
    follow_d = strength * level * loaded_q / spinning.blend_load * ki
    follow_a = -strength * loaded * level_c / ACROSS * si
    beyond = f - row.centrifugal_force
    moment = follow * m
    by_diameter = 2.0 / spinning.ball_diameter
    ti, to = share * moment * by_diameter, (1.0 - share) * moment * by_diameter
    pull_1, pull_2 = follow * f_i + follow_a * beyond, follow * f_o
    pull_3, pull_4 = follow_d * beyond + follow * f_s * share_i, follow * f_s * share_o
    in_share = m * share * by_diameter
    out_share = m * (1.0 - share) * by_diameter
    grow_i = (m_s * share + m) * by_diameter
    grow_o = (m_s * (1.0 - share) - m) * by_diameter
    ti_1, ti_2 = follow * m_i * share * by_diameter + follow_a * in_share, follow * m_o * share * by_diameter
    ti_3, ti_4 = follow_d * in_share + follow * grow_i * share_i, follow * grow_i * share_o
    to_1 = follow * m_i * (1.0 - share) * by_diameter + follow_a * out_share
    to_2 = follow * m_o * (1.0 - share) * by_diameter
    to_3, to_4 = follow_d * out_share + follow * grow_o * share_i, follow * grow_o * share_o
    # No contact takes more than friction allows.
    friction_i, slope_i, by_load_i = friction_force(ti, spinning.friction * qi)
    friction_o, slope_o, by_load_o = friction_force(to, spinning.friction * qo)
    by_load_i, by_load_o = by_load_i * spinning.friction * ki, by_load_o * spinning.friction * ko
    return (
        (row.centrifugal_force + follow * beyond, (pull_1, pull_2, pull_3, pull_4)),
        (friction_i, (slope_i * ti_1, slope_i * ti_2, slope_i * ti_3 + by_load_i, slope_i * ti_4)),
        (friction_o, (slope_o * to_1, slope_o * to_2, slope_o * to_3, slope_o * to_4 + by_load_o)),
        moment,
    )


@kernel
def by_places(slopes: Any, ic: float, is_: float, oc: float, os_: float, sines: Any) -> tuple[float, ...]:
    """Derivatives of a force of ``race_control_forces`` by the inner line u = A - X and the outer line X, (axial, radial) each.

    An angle turns with (c, -s)/length, a depth grows along (s, c); ``sines``: si, ci, so, co.
    """
    by_1, by_2, by_3, by_4 = slopes
    si, ci, so, co = sines
    return by_1 * ic + by_3 * si, -by_1 * is_ + by_3 * ci, by_2 * oc + by_4 * so, -by_2 * os_ + by_4 * co


@ball_forces.body(FixedShare, FrictionShare)
def _rolling(control, strength, row, a_axial, a_radial, x, y, di, do):
    one_i, si, ci = line(a_axial - x, a_radial - y)
    one_o, so, co = line(x, y)
    qi, ki = spring(di, row.inner_stiffness)
    qo, ko = spring(do, row.outer_stiffness)
    if strength == 0.0 or qi <= 0.0 or qo <= 0.0 or ci <= 0.0:
        return elastic_forces(row, a_axial, a_radial, x, y, di, do)
    aa, ar, rr = tangent(qi, ki, one_i, si, ci)
    oaa, oar, orr = tangent(qo, ko, one_o, so, co)
    pulls, inner, outer, moment = race_control_forces(
        control, strength, row, (si, ci, qi, ki), (so, co, qo, ko), di, do
    )
    (pull, pull_by), (ti, ti_by), (to, to_by) = pulls, inner, outer
    ic, is_, oc, os_ = ci * one_i, si * one_i, co * one_o, so * one_o
    sines = si, ci, so, co
    pull_ua, pull_ur, pull_xa, pull_xr = by_places(pull_by, ic, is_, oc, os_, sines)
    ti_ua, ti_ur, ti_xa, ti_xr = by_places(ti_by, ic, is_, oc, os_, sines)
    to_ua, to_ur, to_xa, to_xr = by_places(to_by, ic, is_, oc, os_, sines)
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
