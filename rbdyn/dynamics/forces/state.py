"""Layout of the state vector: 5 Z + 10 numbers, each kind of roller coordinate contiguous, then what a scene adds.

[0, Z)     roller x [m]            5Z + 0, 1   cage x, y [m]
[Z, 2Z)    roller y [m]            5Z + 2      cage angle [rad]
[2Z, 3Z)   roller vx [m/s]         5Z + 3, 4   cage vx, vy [m/s]
[3Z, 4Z)   roller vy [m/s]         5Z + 5      cage speed [rad/s]
[4Z, 5Z)   roller spin [rad/s]     5Z + 6 ... 9  inner ring x, y [m], vx, vy [m/s]

An outer ring on a support adds its x, y [m], vx, vy [m/s]; a scene that depends on time or on a ring's angle adds
time [s], inner ring angle and outer ring angle [rad].
"""

from __future__ import annotations

from typing import NamedTuple

ROLLER_PARTS = ("x", "y", "vx", "vy", "spin")
BODY_PARTS = (
    ("cage", "x"),
    ("cage", "y"),
    ("cage", "angle"),
    ("cage", "vx"),
    ("cage", "vy"),
    ("cage", "speed"),
    ("inner ring", "x"),
    ("inner ring", "y"),
    ("inner ring", "vx"),
    ("inner ring", "vy"),
)
SUPPORT_PARTS = (("outer ring", "x"), ("outer ring", "y"), ("outer ring", "vx"), ("outer ring", "vy"))
CLOCK_PARTS = (("time", ""), ("inner ring", "angle"), ("outer ring", "angle"))
CAGE_X, CAGE_Y, CAGE_ANGLE, CAGE_VX, CAGE_VY, CAGE_SPEED, RING_X, RING_Y, RING_VX, RING_VY = range(10)
TIME, INNER_ANGLE, OUTER_ANGLE = range(3)


class Layout(NamedTuple):
    """Where the parts that a scene adds begin; None where it adds none."""

    rollers: int
    size: int
    support: int | None
    clock: int | None


def layout(rollers: int, supported: bool, clocked: bool) -> Layout:
    """Layout for a number of rollers, with an outer ring on a support or not, with a clock or not."""
    size = 5 * rollers + len(BODY_PARTS)
    support = size if supported else None
    size += len(SUPPORT_PARTS) * supported
    clock = size if clocked else None
    return Layout(rollers, size + len(CLOCK_PARTS) * clocked, support, clock)


def name(index: int, layout: Layout) -> str:
    """What a state component is, in words: 'roller 3 spin', 'cage vx'. Rollers count from 1."""
    if index < 5 * layout.rollers:
        return f"roller {index % layout.rollers + 1} {ROLLER_PARTS[index // layout.rollers]}"
    parts = [*BODY_PARTS, *(SUPPORT_PARTS if layout.support else ()), *(CLOCK_PARTS if layout.clock else ())]
    return " ".join(parts[index - 5 * layout.rollers]).strip()
