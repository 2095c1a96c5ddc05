"""Orbit and spin of a ball that rolls on both races: centrifugal force and gyroscopic moment with their derivatives.

Rolling without slip at both contacts (Harris, *Rolling Bearing Analysis*), pitch angle beta by ``control``:

    w_m = [w_in N cos(a_o - b) + w_out P cos(a_i - b)] / [N cos(a_o - b) + P cos(a_i - b)],
    w_R = (w_out - w_in) N P / (g [N cos(a_o - b) + P cos(a_i - b)]),
    F_c = m d_m w_m^2/2,  M_g = J w_R w_m sin b.

Numerators and denominators are of one degree in (cos b, sin b), so no angle is ever computed. w_R counts positive where
the outer ring turns faster: with the inner ring turning M_g is negative, and the friction that balances it pushes the ball
the other way than where the sign is dropped, as many texts do.
"""

from typing import Any

from rbdyn.compiled.kernel import kernel


@kernel
def orbit_and_spin(spinning: Any, share: float, ci: float, si: float, co: float, so: float) -> tuple[Any, Any]:
    """F_c [N] and M_g [N m] of a ball, each with its derivatives by inner angle, outer angle and inner ``share``.

    Contact angles are given by cosine and sine. Returns ((F_c, by a_i, by a_o, by share), (M_g, ...)).
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
    whole = 1.0 / (n * at_o + p * at_i)
    whole_i = n_i * at_o + n * at_o_i + p * at_i_i
    whole_o = n * at_o_o + p_o * at_i + p * at_i_o
    whole_s = n * at_o_s + p * at_i_s
    lead = n * at_o * whole
    lead_i = (n_i * at_o + n * at_o_i - lead * whole_i) * whole
    lead_o = (n * at_o_o - lead * whole_o) * whole
    lead_s = (n * at_o_s - lead * whole_s) * whole
    tip = n * p * rise * whole
    tip_i = (n_i * p * rise + n * p * rise_i - tip * whole_i) * whole
    tip_o = (n * p_o * rise + n * p * rise_o - tip * whole_o) * whole
    tip_s = (n * p * rise_s - tip * whole_s) * whole
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
