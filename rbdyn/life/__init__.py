"""Fatigue life, and makers' rules on friction and minimum load.

- ``rollers``, ``balls``: ratings from dimensions (ISO 281, ISO 76) and life from the loads of each rolling element (ISO/TS 16281)
- ``duty``: life over points with shares of the time (Palmgren and Miner), and the equivalent load
- ``rollers`` also: minimum loads, SKF's friction model and the heat of ISO 15312
- ``friction``: what SKF's model has in common for all kinds, and its moments of ball bearings

This file has what both kinds of bearing share: the life in turns of one ring against the other and in hours, with the loads and
capacities of the races behind it.
"""

import math
from dataclasses import dataclass
from typing import Literal

from rbdyn.base.records import finite

# Rings that rotate relative to the load.
Turning = Literal["inner", "outer", "both"]


def turning_rings(inner_speed: float, outer_speed: float) -> Turning:
    """Rings that rotate relative to a load of constant direction; the inner one where both stand still."""
    if outer_speed == 0.0:
        return "inner"
    return "outer" if inner_speed == 0.0 else "both"


@dataclass(frozen=True)
class Life:
    """Life that 90 % of bearings, or rows, reach.

    ``million_turns``: L10 in 1e6 turns of the inner ring against the outer ring; infinite without a load. ``inner_load,
    outer_load``: the equivalent constant load on each ball or roller [N]. ``inner_capacity, outer_capacity``: the load of the
    races for one million turns [N].
    """

    million_turns: float
    inner_load: float
    outer_load: float
    inner_capacity: float
    outer_capacity: float

    def as_record(self, inner_speed: float, outer_speed: float) -> dict[str, float | None]:
        """Life for a report, in turns and in hours at ring speeds [rad/s]; None for an infinite life."""
        return {"L10_Mrev": finite(self.million_turns), "L10_h": finite(self.hours(inner_speed, outer_speed))}

    def hours(self, inner_speed: float, outer_speed: float = 0.0) -> float:
        """Life in hours at ring speeds [rad/s]; infinite without relative speed."""
        speed = abs(inner_speed - outer_speed)
        return self.million_turns * 1e6 * 2.0 * math.pi / speed / 3600.0 if speed > 0.0 else math.inf
