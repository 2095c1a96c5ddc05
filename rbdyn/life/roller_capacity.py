"""Load ratings of a cylindrical roller bearing (ISO 281 and ISO 76, f_c as it is commonly cited), and the radial loads below
which makers expect its rollers to skid."""

from rbdyn.faults import MethodError
from rbdyn.fields import RPM

# Life of a race falls with the fourth power of its load; 9/8 is the slope of the Weibull line.
LOAD_LIFE = 4.0
WEIBULL = 9.0 / 8.0
LAMINA_EXPONENT = LOAD_LIFE * WEIBULL
# lambda nu: what ISO 281 takes off for edge stress and uneven loads, which laminae describe themselves.
REDUCTION = 0.83
# Reference speed times pitch diameter [mm/min] of 170 sizes of a catalogue (NU, series 10, 2, 22, 3, 23), within 9 %.
REFERENCE_SPEED_FACTOR = 5.5e5
REFERENCE_SPEED = REFERENCE_SPEED_FACTOR * 1e-3 * RPM  # [m/s]
# k_r of SKF's rule over its tables of cylindrical roller bearings.
SMALLEST_FACTOR, LARGEST_FACTOR = 0.1, 0.3


def capacity_factor(gamma: float) -> float:
    """f_c of a radial roller bearing (ISO 281, in N and mm) at gamma = roller over pitch diameter.

    Raises MethodError unless 0 < gamma < 1.
    """
    if not 0.0 < gamma < 1.0:
        raise MethodError(f"gamma = {gamma:g}: the roller must be smaller than the pitch circle")
    ratio = (1.0 - gamma) / (1.0 + gamma)
    races = (1.0 + (1.04 * ratio ** (143.0 / 108.0)) ** LAMINA_EXPONENT) ** (-1.0 / LAMINA_EXPONENT)
    shape = gamma ** (2.0 / 9.0) * (1.0 - gamma) ** (29.0 / 27.0) / (1.0 + gamma) ** 0.25
    return 208.0 * REDUCTION * shape * races


def dynamic_capacity(
    rollers: int,
    roller_diameter: float,
    effective_length: float,
    pitch_diameter: float,
    rows: int = 1,
    rating_factor: float = 1.1,
) -> float:
    """Basic dynamic radial load rating C_r [N] by ISO 281, for catalogues that give none; lengths in m.

    C_r = b_m f_c (i L)^(7/9) Z^(3/4) D^(29/27) in N and mm; ``rating_factor`` b_m is 1.1 for machined cylindrical
    roller bearings of contemporary steel. Raises MethodError as ``capacity_factor``.
    """
    factor = rating_factor * capacity_factor(roller_diameter / pitch_diameter)
    sizes = (rows * effective_length * 1e3) ** (7.0 / 9.0) * (roller_diameter * 1e3) ** (29.0 / 27.0)
    return factor * sizes * rollers**0.75


def static_capacity(rollers: int, roller_diameter: float, effective_length: float, pitch_diameter: float) -> float:
    """Basic static radial load rating C_0r [N] of one row by ISO 76, 44 (1 - D/d_m) Z L D in N and mm; lengths in m."""
    gamma = roller_diameter / pitch_diameter
    return 44e6 * (1.0 - gamma) * rollers * effective_length * roller_diameter


def minimum_loads(
    pitch_diameter: float,
    speed: float,
    dynamic_capacity: float,
    static_capacity: float,
    listed: tuple[float, float] | None = None,
) -> dict[str, float]:
    """Least radial load [N] by rule: of a bearing of this pitch diameter [m], capacities [N], at this speed [rad/s].

    SKF: k_r (6 + 4 n/n_r) (d_m/100 mm)^2 kN, and 0.02 C. Timken: 0.04 C. NTN: 0.04 C0. They differ by a factor of four, and to
    meet them did not always suffice in tests of a NU 215 (Dawoud et al. 2023). ``listed``: k_r and the reference speed n_r
    [rad/s] of the catalogue; where it is None k_r is from 0.1 to 0.3 and n_r as usual for the diameter.
    """
    usual = REFERENCE_SPEED / pitch_diameter
    factors = {SMALLEST_FACTOR: usual, LARGEST_FACTOR: usual} if listed is None else dict([listed])
    by_speed = {
        f"SKF, k_r = {factor:g}": 1e3 * factor * (6.0 + 4.0 * abs(speed) / reference) * (pitch_diameter / 0.1) ** 2
        for factor, reference in factors.items()
    }
    return {
        **by_speed,
        "SKF, 0.02 C": 0.02 * dynamic_capacity,
        "Timken, 0.04 C": 0.04 * dynamic_capacity,
        "NTN, 0.04 C0": 0.04 * static_capacity,
    }
