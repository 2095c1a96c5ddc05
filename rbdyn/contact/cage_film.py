"""Oil films of the cage: on the guide land, a short journal bearing, and between a roller and a plane pocket wall.

The pocket's film is that of a rigid cylinder in isoviscous oil with rolling, sliding, closing and opening motion. It solves
Reynolds' equation over the gap h + x^2/(2 R) without negative pressures (Reynolds' boundary: pressure and slope vanish together).
So wedge and squeeze share one film with one end. In X = x/sqrt(2 R h) the film depends on sigma = V sqrt(2 R/h)/|u| alone, with V
the closing speed and u the entrainment speed. With the film's end at X_e:

    dP/dX = (X - X_e) (X + X_e - sigma)/(1 + X^2)^3,    sigma = [(I_2 - I_3) - X_e^2 I_3]/[A - X_e I_3],

I_n the integral of (1 + X^2)^-n from -infinity to X_e and A = -1/[4 (1 + X_e^2)^2]. Integrals over the film give the push
24 eta l R/h |u| W and, on each surface, the rolling force 6 sqrt(2) eta l sqrt(R/h) u F:

- closing alone: W = pi sigma/8, F = pi/3; the push is 3 sqrt(2) pi eta l (R/h)^1.5 V;
- steady: W = 0.2040, F = 0.5423; 4.895 eta l u R/h (Martin 1916) and 4.601 eta l u sqrt(R/h);
- fast opening: W = 16/(81 sigma^2), F = 16/(27 |sigma|); the push, 64/27 eta l |u|^3/V^2, vanishes.

Behind its end the oil continues in streamers, which fill the width in proportion to the flow there. Shear by sliding acts on
film and streamers: sqrt(2) eta U l sqrt(R/h) S, with S between 3 pi/4 and pi. The power of the pressure is 2 u times the rolling
force plus V times the push. It is the integral of h^3 (dp/dx)^2/(12 eta) and never negative.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.elementary import fast_atan, fma
from rbdyn.compiled.kernel import kernel


class ShortJournalFilm(NamedTuple):
    """Lubricated guide land(s) with a least film thickness ``floor``."""

    force_scale: float  # sum over lands of fill * eta R L^3/c^2 [N s]
    shear_scale: float  # sum over lands of fill * 2 pi eta R^3 L/c [N m s]
    clearance: float  # c, radial [m]
    largest_eccentricity: float  # 1 - floor/c [-]


class StoppingFilm(NamedTuple):
    """A film of thick oil, which stops the cage within a few vibrations of a contact; fields as in ``ShortJournalFilm``."""

    force_scale: float
    shear_scale: float
    clearance: float
    largest_eccentricity: float


def short_journal_film(
    viscosity: float, radius: float, width: float, lands: int, clearance: float, floor: float, fill: float
) -> ShortJournalFilm:
    """Film of ``lands`` equal lands of ``width`` [m] at ``radius`` [m] with radial ``clearance`` [m]."""
    return ShortJournalFilm(
        force_scale=lands * fill * viscosity * radius * width**3 / clearance**2,
        shear_scale=lands * fill * 2.0 * math.pi * viscosity * radius**3 * width / clearance,
        clearance=clearance,
        largest_eccentricity=1.0 - floor / clearance,
    )


class JournalFilm(NamedTuple):
    """Radial and tangential film force [N] on a journal, and by how much they fall per rate of the eccentricity [N s].

    ``resist_rr``: of the radial force, per radial rate; ``resist_tt``: of the tangential one, per tangential rate; ``resist_rt``:
    of either, per rate in the other direction.
    """

    radial: float
    across: float
    resist_rr: float
    resist_rt: float
    resist_tt: float


@kernel
def journal_film_force(force_scale: float, eccentricity: float, radial_rate: float, wedge_rate: float) -> JournalFilm:
    """``JournalFilm`` of a short bearing without tension in the film.

    ``eccentricity`` e/c < 1; ``radial_rate`` = d(eccentricity)/dt [1/s]; ``wedge_rate`` = eccentricity times
    (sum of the two spin rates - 2 whirl rate) [1/s]. Radial is along the eccentricity, tangential 90 degrees
    ahead in the sense of rotation.

    The pressure of the short bearing has the sign of 2 radial_rate cos(theta) - wedge_rate sin(theta), which is positive on
    exactly half the circle. Over that half all integrals are elementary in Sommerfeld's angle gamma. With radial_rate = 0 the
    result is Ocvirk's half-film. The pressure vanishes at the ends of that half, so their motion adds nothing to the resistance.
    """
    a, b = 2.0 * radial_rate, -wedge_rate
    size = math.sqrt(a * a + b * b)
    if size == 0.0:
        return JournalFilm(0.0, 0.0, 0.0, 0.0, 0.0)
    # The half circle of positive pressure starts at theta_1, where (cos, sin) = (b, -a)/size, ends opposite.
    inverse_size = 1.0 / size
    cos_1, sin_1 = b * inverse_size, -a * inverse_size
    root = math.sqrt(1.0 - eccentricity * eccentricity)
    inverse_root = 1.0 / root
    shift, rise = eccentricity * cos_1, root * sin_1
    both = 1.0 / (1.0 - shift * shift)
    scale_1, scale_2 = (1.0 + shift) * both, (1.0 - shift) * both
    c_1, s_1 = (cos_1 - eccentricity) * scale_1, rise * scale_1
    c_2, s_2 = (-cos_1 - eccentricity) * scale_2, -rise * scale_2
    # tan(gamma/2) = sqrt((1 + e)/(1 - e)) tan(theta/2), taken at both ends.
    gamma = math.pi - 2.0 * fast_atan(eccentricity * sin_1, root)
    sine, double_sine = s_2 - s_1, s_2 * c_2 - s_1 * c_1
    inverse = inverse_root * inverse_root
    along = 0.5 * (gamma + double_sine) + eccentricity * (2.0 * sine + eccentricity * gamma)
    mixed = 0.5 * (s_2 * s_2 - s_1 * s_1) - eccentricity * (c_2 - c_1)
    across = 0.5 * (gamma - double_sine)
    integral_cc = along * inverse * inverse * inverse_root
    integral_sc = mixed * inverse * inverse
    integral_ss = across * inverse * inverse_root
    half = -0.5 * force_scale
    return JournalFilm(
        half * (a * integral_cc + b * integral_sc),
        half * (a * integral_sc + b * integral_ss),
        force_scale * integral_cc,
        force_scale * integral_sc,
        force_scale * integral_ss,
    )


def stopping_rate(film: ShortJournalFilm, mass: float) -> float:
    """Sum of the rates at which a film stops a concentric journal of ``mass`` [kg] along and across its motion [1/s]."""
    return math.pi * film.force_scale / (film.clearance * mass)


class PocketFilm(NamedTuple):
    """Scales of the film forces for a film thickness h of at least ``floor``."""

    load: float  # push is load * |u| W/h [N s]
    reach: float  # sigma is reach * closing speed/(|u| sqrt(h)) [m^0.5]
    rolling: float  # rolling force per surface is rolling * u F/sqrt(h) [N s m^-0.5]
    shear: float  # sliding force is shear * U S/sqrt(h) [N s m^-0.5]
    floor: float  # [m]


def pocket_film(viscosity: float, radius: float, length: float, floor: float, fill: float) -> PocketFilm:
    """Film of a roller of ``radius`` and ``length`` [m] on a wall that is covered with oil over a share ``fill``."""
    scale = fill * viscosity * length
    return PocketFilm(
        load=24.0 * scale * radius,
        reach=math.sqrt(2.0 * radius),
        rolling=6.0 * math.sqrt(2.0) * scale * math.sqrt(radius),
        shear=math.sqrt(2.0) * scale * math.sqrt(radius),
        floor=floor,
    )


@kernel
def film_shape(entrainment, squeeze):
    """(|u| W [m/s], u F [m/s], S) for u = ``entrainment`` and u sigma = ``squeeze`` = V sqrt(2 R/h) [m/s] of any sign.

    Continuous except where both are zero; push and rolling force have continuous slopes. Minimax polynomials in
    s = sigma/(c + sqrt(c^2 + sigma^2)), c = 1.5, from -1 (opening) to 1 (closing), each with the factor of its decay. Those of W
    and F are exact at closing alone. Errors: 2e-5 of W, 9e-5 of F and 3e-3 of S.
    """
    rolling = 1.5 * abs(entrainment)
    size = math.sqrt(rolling * rolling + squeeze * squeeze)
    s = squeeze / (rolling + size + 1e-150)
    q = s * s
    push_even = fma(q, fma(q, fma(q, -0.005072486594, 0.025682489346), -0.065860494389), 0.11672845073)
    push_even = fma(q, fma(q, push_even, -0.1536401909), 0.13596921496)
    push_odd = fma(q, fma(q, fma(q, 0.0022681003687, -0.010738897703), 0.025251088542), -0.038733388365)
    push_odd = fma(q, fma(q, push_odd, 0.039270108325), -0.022036609111)
    rolling_even = fma(q, fma(q, fma(q, -0.01950886196, 0.05958009961), -0.05131959137), -0.07168920924)
    rolling_even = fma(q, rolling_even, 0.5422836794)
    rolling_odd = fma(q, fma(q, fma(q, -0.003514312274, 0.005046344219), -0.00678407838), 0.06950470557)
    shear_even = fma(q, fma(q, fma(q, -0.19791307, -0.00779131131), 0.877740417), 2.46133412)
    shear_odd = fma(q, fma(q, fma(q, -0.740088974, 1.94378141), -1.9319692), 0.728276131)
    outer = 1.0 + s
    push = size * (outer * outer * outer) * fma(s, push_odd, push_even)
    return push, entrainment * outer * fma(s, rolling_odd, rolling_even), fma(s, shear_odd, shear_even)


@kernel
def wall_film(film, gap, closing, roller_surface, wall_surface):
    """Film on one wall: push, net tangential force on the roller, shear force on the roller's surface [N], and power loss [W].

    The push separates roller and wall. ``gap`` [m] may be negative; ``closing`` [m/s]; surface speeds along the wall at the
    contact [m/s], that of the roller relative to the contact. The rolling force slows each surface. On the round surface the
    pressure acts through its centre with twice that force in the opposite direction.
    """
    h = max(gap, film.floor)
    root = 1.0 / math.sqrt(h)
    entrainment = 0.5 * (roller_surface + wall_surface)
    load, resistance, share = film_shape(entrainment, film.reach * root * closing)
    push = film.load * root * root * load
    sliding = film.shear * root * share * (wall_surface - roller_surface)
    rolling = film.rolling * root * resistance
    on_roller = sliding - rolling
    power = sliding * (wall_surface - roller_surface) + 2.0 * rolling * entrainment + push * closing
    return push, sliding + rolling, on_roller, power
