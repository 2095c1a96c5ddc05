"""Film between a roller and a plane pocket wall: wedge, squeeze and shear of a rigid cylinder in isoviscous oil."""

from __future__ import annotations

import math
from typing import NamedTuple

from rbdyn.kernel import kernel


class PocketFilm(NamedTuple):
    """Scales of the film forces for a film thickness h, which never counts as less than ``floor``."""

    wedge: float  # Martin's load is wedge * u/h, u the entrainment speed [N s]
    squeeze: float  # squeeze force is squeeze * h^-1.5 * closing speed [N s m^0.5]
    shear: float  # sliding force is shear * U/sqrt(h) [N s m^-0.5]
    rolling: float  # rolling force per surface is rolling * u/sqrt(h) [N s m^-0.5]
    floor: float  # [m]


def pocket_film(viscosity: float, radius: float, length: float, floor: float, fill: float) -> PocketFilm:
    """Film of a roller of ``radius`` and ``length`` [m] on a wall that is covered with oil over a share ``fill``.

    Reynolds' equation for a rigid cylinder on a plane: load 4.895 eta u l R/h (Martin 1916), rolling force
    4.60 eta u l sqrt(R/h) per surface, squeeze force 3 sqrt(2) pi eta l (R/h)^1.5 (-dh/dt), shear of the parabolic
    gap pi sqrt(2) eta U l sqrt(R/h).
    """
    scale = fill * viscosity * length
    return PocketFilm(
        wedge=4.895 * scale * radius,
        squeeze=3.0 * math.sqrt(2.0) * math.pi * scale * radius**1.5,
        shear=math.pi * math.sqrt(2.0) * scale * math.sqrt(radius),
        rolling=4.60 * scale * math.sqrt(radius),
        floor=floor,
    )


@kernel
def wall_film(film, gap, closing, roller_surface, wall_surface):
    """Film on one wall: (push [N] that parts roller and wall, net tangential force on the roller [N], sum of the shear
    on the roller's surface [N], power lost [W]).

    ``gap`` [m] may be negative; ``closing`` [m/s]; surface speeds along the wall at the contact [m/s], the roller's
    seen from the contact. Cavitation: a parting film does not pull. Each surface is held back by the rolling force;
    on the round one the pressure pushes twice as much the other way, through its centre.
    """
    h = max(gap, film.floor)
    root = 1.0 / math.sqrt(h)
    entrainment = 0.5 * (roller_surface + wall_surface)
    push = film.wedge * abs(entrainment) / h + film.squeeze * root * root * root * max(closing, 0.0)
    sliding = film.shear * root * (wall_surface - roller_surface)
    rolling = film.rolling * root * entrainment
    on_roller = sliding - rolling
    power = sliding * (wall_surface - roller_surface) + 2.0 * rolling * entrainment + push * closing
    return push, sliding + rolling, on_roller, power
