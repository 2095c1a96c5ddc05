"""Share of oil in the cavity of a bearing under a jet, from the oil flow.

The formula is unverified: it is from memory, no source of it was read, and its factor is an unknown input (0.6 to 1.6). Measured
against one: a simulation with a share fitted to a 35 mm bearing had 70 % too little loss in one of 120 mm, so the share must
depend on size and flow. The residence time of the oil checks its order.
"""

import math
from collections.abc import Iterator

from rbdyn.base.faults import RPM
from rbdyn.base.notes import Note

# X = SCALE W^FLOW_EXPONENT/(n d_m^DIAMETER_EXPONENT), W in cm^3/min, n in rpm, d_m in mm.
SCALE, FLOW_EXPONENT, DIAMETER_EXPONENT = 1e5, 0.37, 1.7
LARGEST = 0.15
# Pitch diameter times speed [mm/min] for which the formula is meant.
SLOWEST, FASTEST = 1e6, 4e6
# Turns of the cage that oil usually stays in the cavity.
SHORTEST_STAY, LONGEST_STAY = 1.0, 10.0
CM3_PER_MINUTE = 1e-6 / 60.0  # [m^3/s]


def oil_fraction(volume_flow: float, speed: float, pitch_diameter: float, factor: float = 1.0) -> float:
    """Volume of oil over volume of the oil-air mixture [-], at most 0.15; unverified.

    X = factor 1e5 W^0.37/(n d_m^1.7): ``volume_flow`` W [m^3/s], ``speed`` n of one ring against the other [rad/s],
    ``pitch_diameter`` d_m [m]; none of them is 0.
    """
    flow = volume_flow / CM3_PER_MINUTE
    share = SCALE * flow**FLOW_EXPONENT / (abs(speed) / RPM * (1e3 * pitch_diameter) ** DIAMETER_EXPONENT)
    return min(factor * share, LARGEST)


def residence(fraction: float, cavity: float, volume_flow: float, cage_speed: float) -> float:
    """Turns of the cage that oil stays in the free volume ``cavity`` [m^3]: X V n_c/W, at ``cage_speed`` [rad/s]."""
    return fraction * cavity * abs(cage_speed) / (2.0 * math.pi) / volume_flow


def fraction_notes(speed: float, pitch_diameter: float, stay: float) -> Iterator[Note]:
    """Sentences where the formula is outside its range or the residence ``stay`` in cage turns is unusual."""
    fast = abs(speed) / RPM * 1e3 * pitch_diameter  # [mm/min]
    if not SLOWEST <= fast <= FASTEST:
        sentence = (
            f"oil fraction: {1e-6 * fast:.2g} million mm/min is outside the {1e-6 * SLOWEST:g} to {1e-6 * FASTEST:g} million of its "
            "formula; state lubricant.oil_fraction if it is known"
        )
        yield Note("oil-fraction", sentence)
    if not SHORTEST_STAY <= stay <= LONGEST_STAY:
        sentence = (
            f"oil fraction: oil stays for {stay:.2g} turns of the cage, outside the usual {SHORTEST_STAY:g} to {LONGEST_STAY:g}; "
            "check lubricant.oil_flow_l_min"
        )
        yield Note("oil-fraction", sentence)
