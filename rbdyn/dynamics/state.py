"""Layout of the state vector: 5 Z + 10 numbers, each kind of roller coordinate contiguous.

[0, Z)     roller x [m]            5Z + 0, 1   cage x, y [m]
[Z, 2Z)    roller y [m]            5Z + 2      cage angle [rad]
[2Z, 3Z)   roller vx [m/s]         5Z + 3, 4   cage vx, vy [m/s]
[3Z, 4Z)   roller vy [m/s]         5Z + 5      cage speed [rad/s]
[4Z, 5Z)   roller spin [rad/s]     5Z + 6 ... 9  inner ring x, y [m], vx, vy [m/s]
"""

from __future__ import annotations

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
CAGE_X, CAGE_Y, CAGE_ANGLE, CAGE_VX, CAGE_VY, CAGE_SPEED, RING_X, RING_Y, RING_VX, RING_VY = range(10)


def size(rollers: int) -> int:
    """Length of the state vector."""
    return 5 * rollers + len(BODY_PARTS)


def name(index: int, rollers: int) -> str:
    """What a state component is, in words: 'roller 3 spin', 'cage vx'. Rollers count from 1."""
    if index < 5 * rollers:
        return f"roller {index % rollers + 1} {ROLLER_PARTS[index // rollers]}"
    return " ".join(BODY_PARTS[index - 5 * rollers])
