"""Radial loads below which makers of cylindrical roller bearings expect the rollers to skid."""

from rbdyn.fields import RPM

# Reference speed times pitch diameter [mm/min] of 170 sizes of a catalogue (NU, series 10, 2, 22, 3, 23), within 9 %.
REFERENCE_SPEED_FACTOR = 5.5e5
REFERENCE_SPEED = REFERENCE_SPEED_FACTOR * 1e-3 * RPM  # [m/s]
# k_r of SKF's rule over its tables of cylindrical roller bearings.
SMALLEST_FACTOR, LARGEST_FACTOR = 0.1, 0.3


def minimum_loads(
    pitch_diameter: float, speed: float, dynamic_capacity: float, static_capacity: float
) -> dict[str, float]:
    """Least radial load [N] by rule: of a bearing of this pitch diameter [m], capacities [N], at this speed [rad/s].

    SKF: k_r (6 + 4 n/n_r) (d_m/100 mm)^2 kN, whose k_r and reference speed n_r stand in tables: the former from 0.1 to 0.3,
    the latter as usual for the diameter; and 0.02 C. Timken: 0.04 C. NTN: 0.04 C0. They differ by a factor of four, and to
    meet them did not always suffice in tests of a NU 215 (Dawoud et al. 2023).
    """
    by_speed = 1e3 * (6.0 + 4.0 * abs(speed) * pitch_diameter / REFERENCE_SPEED) * (pitch_diameter / 0.1) ** 2
    return {
        f"SKF, k_r = {SMALLEST_FACTOR:g}": SMALLEST_FACTOR * by_speed,
        f"SKF, k_r = {LARGEST_FACTOR:g}": LARGEST_FACTOR * by_speed,
        "SKF, 0.02 C": 0.02 * dynamic_capacity,
        "Timken, 0.04 C": 0.04 * dynamic_capacity,
        "NTN, 0.04 C0": 0.04 * static_capacity,
    }
