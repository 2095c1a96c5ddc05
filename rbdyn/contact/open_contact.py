"""Oil film of a roller and a raceway that do not touch: a rigid cylinder pair at the gap that is left.

Reynolds' equation over the gap h + x^2/(2 R), with pressure that begins at the meniscus and ends with its slope. In
X = x/sqrt(2 R h), with the meniscus at -M and the film's end at X_e, I_n(X) being the integral of (1 + X^2)^-n:

    I_2 - (1 + X_e^2) I_3 = 0 between -M and X_e,    F = I_1 - (1 + X_e^2) I_2.

Each surface rolls against 6 sqrt(2) eta l sqrt(R/h) u F, which flooded is 4.601 eta l u sqrt(R/h). Behind its end the oil
runs on in streamers that carry what passes there. Sliding shears film and streamers by sqrt(2) eta U l sqrt(R/h) S.
The push of the film is left out: it is a few newtons, well below what loads a roller anywhere.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.kernel import kernel

# No film ends farther out: that of a flooded pair ends at 0.47513.
FLOODED_END = 0.4754
MARTIN = 4.895
BISECTIONS = 60


class OpenFilm(NamedTuple):
    """Film at gaps well above ``touching_gap``; below it 1/sqrt(h) fades as h/(h^2 + touching_gap^2)^0.75."""

    rolling_scale: float  # rolling force per surface is rolling_scale u/sqrt(h) [N s m^-0.5]
    shear_scale: float  # sliding force is shear_scale U/sqrt(h) [N s m^-0.5]
    touching_gap: float  # [m]


class Inlet(NamedTuple):
    """Shape integrals of the film of a rigid pair: its end X_e, rolling force F and shear S."""

    end: float
    rolling: float
    shear: float


def _integrals(x: float) -> tuple[float, float, float]:
    """Integrals from 0 to x of (1 + X^2)^-n for n = 1, 2, 3."""
    square = 1.0 + x * x
    first = math.atan(x)
    second = 0.5 * (first + x / square)
    return first, second, 0.25 * x / square**2 + 0.75 * second


def inlet(distance: float) -> Inlet:
    """Film that begins at ``distance`` > 0 ahead of the middle, in sqrt(2 R h); ``math.inf`` is flooded."""
    ahead = (0.5 * math.pi, 0.25 * math.pi, 0.1875 * math.pi) if math.isinf(distance) else _integrals(distance)
    low, high = 0.0, min(distance, FLOODED_END)
    for _ in range(BISECTIONS):
        end = 0.5 * (low + high)
        behind = _integrals(end)
        beyond = ahead[1] + behind[1] < (1.0 + end * end) * (ahead[2] + behind[2])
        low, high = (low, end) if beyond else (end, high)
    behind = _integrals(high)
    passing = 1.0 + high * high
    rolling = ahead[0] + behind[0] - passing * (ahead[1] + behind[1])
    streamers = passing * (0.25 * math.pi - behind[1])
    return Inlet(high, rolling, ahead[0] + behind[0] + streamers)


def open_film(
    viscosity: float, radius: float, length: float, inlet_distance: float | None, reduction: float, touching_gap: float
) -> OpenFilm:
    """Film of a pair of reduced ``radius`` and ``length`` [m] in oil of ``viscosity`` [Pa s].

    ``inlet_distance``: where the oil begins ahead of the middle in half-widths sqrt(2 R h), None flooded; ``reduction``:
    what heating leaves of the rolling force, times a factor of one's own; ``touching_gap`` [m].
    """
    shape = inlet(math.inf if inlet_distance is None else inlet_distance)
    scale = math.sqrt(2.0 * radius) * viscosity * length
    return OpenFilm(6.0 * scale * shape.rolling * reduction, scale * shape.shear, touching_gap)


def touching_gap(
    viscosity: float, radius: float, length: float, entrainment_speed: float, stiffness: float, roughness: float
) -> float:
    """Gap [m] at which oil holds surfaces apart that would just touch, at least ``roughness`` [m].

    There the rigid pair bears as much, 4.895 eta u R l/h (Martin 1916), as a contact of ``stiffness`` [N/m^(10/9)] at an
    approach of that size.
    """
    gap = (MARTIN * viscosity * entrainment_speed * radius * length / stiffness) ** (9.0 / 19.0)
    return max(gap, roughness)


@kernel
def film_forces(film, overlap, entrainment_speed, slip):
    """(rolling force on each surface, sliding force on the roller) [N], signed as the speeds [m/s]; 0 in contact.

    ``overlap`` [m]: minus the gap.
    """
    gap = max(-overlap, 0.0)
    size = math.sqrt(gap * gap + film.touching_gap * film.touching_gap)
    root = gap / (size * math.sqrt(size))
    return film.rolling_scale * root * entrainment_speed, film.shear_scale * root * slip
