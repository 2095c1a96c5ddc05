"""Lubricant film of a guide land: the short journal bearing."""

import math
from typing import NamedTuple

from rbdyn.compiled.elementary import fast_atan
from rbdyn.compiled.kernel import kernel


class ShortJournalFilm(NamedTuple):
    """Lubricated guide land(s); the film thickness never counts as less than ``floor``."""

    force_scale: float  # sum over lands of fill * eta R L^3/c^2 [N s]
    shear_scale: float  # sum over lands of fill * 2 pi eta R^3 L/c [N m s]
    clearance: float  # c, radial [m]
    largest_eccentricity: float  # 1 - floor/c [-]


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


@kernel
def journal_film_force(
    force_scale: float, eccentricity: float, radial_rate: float, wedge_rate: float
) -> tuple[float, float]:
    """Radial and tangential film force [N] on the journal of a short bearing that carries no tension.

    ``eccentricity`` e/c < 1; ``radial_rate`` = d(eccentricity)/dt [1/s]; ``wedge_rate`` = eccentricity times
    (sum of the two spin rates - 2 whirl rate) [1/s]. Radial is along the eccentricity, tangential 90 degrees
    ahead in the sense of rotation.

    The pressure of the short bearing has the sign of 2 radial_rate cos(theta) - wedge_rate sin(theta), positive on
    exactly half the circle; over that half all integrals are elementary in Sommerfeld's angle gamma. With
    radial_rate = 0 the result is Ocvirk's half-film.
    """
    a, b = 2.0 * radial_rate, -wedge_rate
    size = math.sqrt(a * a + b * b)
    if size == 0.0:
        return 0.0, 0.0
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
    return half * (a * integral_cc + b * integral_sc), half * (a * integral_sc + b * integral_ss)
