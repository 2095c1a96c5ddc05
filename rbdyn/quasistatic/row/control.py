"""Raceway control: which race a ball spins on, and who takes its gyroscopic moment.

A ball cannot roll without spin on both races. Let its spin moments be proportional to spin speed with weights w_i and
w_o: their balance is linear in the pitch angle beta of the ball's axis,

    tan beta = [w_o sin a_o/P + w_i sin a_i/N] / [w_o (cos a_o + g)/P + w_i (cos a_i - g)/N],
    P = 1 + g cos a_o,  N = 1 - g cos a_i,  g = D/d_m.

w_i = 0 is Jones's outer raceway control, w_o = 0 inner control, equal weights share evenly; with the friction moments
w = Q a E(k) of a Hertz ellipse (up to a common factor) it is the friction-weighted hybrid. The friction forces that take
the gyroscopic moment are shared alike: lambda_i = 2 s, lambda_o = 2 (1 - s) with s = w_i/(w_i + w_o).

One common cage speed with no gyroscopic moment is the hypothesis without any of this.
"""

from typing import NamedTuple


class Spinning(NamedTuple):
    """What orbit and spin of a ball depend on besides its contact angles. SI.

    ``ratio``: g = D/d_m. ``orbit_mass``: half the ball's mass times the pitch diameter, F_c = orbit_mass w_m^2 [kg m].
    ``inertia``: J of the ball [kg m^2], 0 where no gyroscopic moment is wanted. ``turning``: -1 keeps the sign of the ball's spin
    for an inner ring that turns faster, +1 drops it. ``blend_load``: inner contact load [N] from which on a ball
    follows the race control; unloaded it goes with the cage. ``friction``: largest coefficient that may hold a gyroscopic moment.
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
    """Weights from friction: ``inner_weight`` (a E/Q^(1/3)) K^(4/3) of the inner race over that of the outer, so that
    w_i/w_o = inner_weight (delta_i/delta_o)^2."""

    inner_weight: float
    spinning: Spinning


Control = CommonCage | FixedShare | FrictionShare
