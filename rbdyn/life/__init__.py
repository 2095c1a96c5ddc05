"""Fatigue life, and what makers say of friction and skidding.

- ``rollers``, ``balls``: ratings from dimensions (ISO 281, ISO 76) and life from the loads of each rolling element (ISO/TS 16281)
- ``maker_friction``: SKF's friction model and the heat of ISO 15312

Here is what both kinds of bearing share: the life of a bearing in turns of one ring against the other, as time, and what of its
races it rests on.
"""

import math
from dataclasses import dataclass
from typing import Literal

from rbdyn.base.records import finite

# The rings that turn against the load.
Turning = Literal["inner", "outer", "both"]


def turning_rings(inner_speed: float, outer_speed: float) -> Turning:
    """Which rings turn against a load that keeps its direction; the inner one where nothing turns."""
    if outer_speed == 0.0:
        return "inner"
    return "outer" if inner_speed == 0.0 else "both"


@dataclass(frozen=True)
class Life:
    """Life that nine bearings, or rows, in ten reach.

    ``million_turns``: L10 in 1e6 turns of the inner ring against the outer; infinite without a load.
    ``inner_load, outer_load``: the steady load on every ball or roller that would do as much [N], against the
    ``inner_capacity, outer_capacity`` of the races [N].
    """

    million_turns: float
    inner_load: float
    outer_load: float
    inner_capacity: float
    outer_capacity: float

    def as_record(self, inner_speed: float, outer_speed: float) -> dict[str, float | None]:
        """What a report says of it, hours at ring speeds [rad/s]; None where nothing is loaded, or nothing turns."""
        return {"L10_Mrev": finite(self.million_turns), "L10_h": finite(self.hours(inner_speed, outer_speed))}

    def hours(self, inner_speed: float, outer_speed: float = 0.0) -> float:
        """Life in hours at ring speeds [rad/s]; infinite where they do not turn against each other."""
        speed = abs(inner_speed - outer_speed)
        return self.million_turns * 1e6 * 2.0 * math.pi / speed / 3600.0 if speed > 0.0 else math.inf
