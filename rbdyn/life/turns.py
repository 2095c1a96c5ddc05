"""Life in turns of one ring against the other, as time."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Life:
    """Turns of the inner ring against the outer in 1e6; infinite without a load."""

    million_turns: float

    def hours(self, inner_speed: float, outer_speed: float = 0.0) -> float:
        """Life in hours at ring speeds [rad/s]; infinite where they do not turn against each other."""
        speed = abs(inner_speed - outer_speed)
        return self.million_turns * 1e6 * 2.0 * math.pi / speed / 3600.0 if speed > 0.0 else math.inf
