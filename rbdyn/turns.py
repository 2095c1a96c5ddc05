"""Turns of one ring against the other, as time."""

from __future__ import annotations

import math


def hours(million_turns: float, inner_speed: float, outer_speed: float = 0.0) -> float:
    """Hours that ``million_turns`` 1e6 turns take at ring speeds [rad/s]; infinite where they do not turn against each other."""
    speed = abs(inner_speed - outer_speed)
    return million_turns * 1e6 * 2.0 * math.pi / speed / 3600.0 if speed > 0.0 else math.inf
