"""Motion of the rings, with the outer one held still at the centre; ``support`` has the one that gives way."""

from typing import NamedTuple

from rbdyn.compiled.kernel import law


class RingMotion(NamedTuple):
    """Centre [m] and its velocity [m/s], speed of rotation [rad/s], direction of the ring's mark."""

    x: float
    y: float
    vx: float
    vy: float
    speed: float
    cos: float
    sin: float


class HeldRing(NamedTuple):
    """Outer ring whose centre stays."""


@law
def outer_motion(ring, y, speed, cosine, sine):
    """Motion of the outer ring that turns at ``speed``."""


@outer_motion.body(HeldRing)
def _(ring, y, speed, cosine, sine):
    return RingMotion(0.0, 0.0, 0.0, 0.0, speed, cosine, sine)


@law
def support_motion(ring, gravity, force_x, force_y, y, row, dy):
    """Write the outer ring's derivatives under the forces [N] on it; returns the power lost in the damper [W]."""


@support_motion.body(HeldRing)
def _(ring, gravity, force_x, force_y, y, row, dy):
    return 0.0


@law
def support_energy(ring, gravity, y):
    """Kinetic, elastic and potential energy [J] of the outer ring on its support."""


@support_energy.body(HeldRing)
def _(ring, gravity, y):
    return 0.0, 0.0, 0.0
