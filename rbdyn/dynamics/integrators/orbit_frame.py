"""A frame that turns with the rollers through one step.

Rollers run round the bearing thousands of times farther than they move against each other. In fixed axes a step must
follow that circle, and its stages, which cut the corner, jolt the stiff race contacts; in a frame that turns with
the rollers they all but stand still. So their coordinates are integrated in such a frame, an exact change of variables
(Lawson 1967, for a linear part that is a rotation), while forces are still those of the fixed axes.

The frame stands in the fixed axes at the start of the step and has turned by phi at the time t of the step, with
tan(phi/2) = rate t/2: cosine, sine and speed of such a turn are rational, and it is as smooth.
"""

from typing import NamedTuple

from rbdyn.compiled.kernel import kernel


class Turn(NamedTuple):
    """Frame at one time: cosine and sine of its angle and its speed [rad/s]."""

    cosine: float
    sine: float
    speed: float


@kernel
def turn_of(rate, time):
    """Frame of ``rate`` [rad/s] at a time [s] since the start of the step."""
    tangent = 0.5 * rate * time
    share = 1.0 / (1.0 + tangent * tangent)
    return Turn((1.0 - tangent * tangent) * share, 2.0 * tangent * share, rate * share)


@kernel
def mean_orbit_rate(z, y):
    """Angular momentum of all rollers about the origin over their moment of inertia [rad/s]."""
    momentum = inertia = 0.0
    for j in range(z):
        momentum += y[j] * y[3 * z + j] - y[z + j] * y[2 * z + j]
        inertia += y[j] * y[j] + y[z + j] * y[z + j]
    return momentum / inertia


@kernel
def turned(turn, along, across):
    """A vector of the frame in the fixed axes."""
    return turn.cosine * along - turn.sine * across, turn.sine * along + turn.cosine * across


@kernel
def seen(turn, x_rate, y_rate, x, y):
    """What the frame sees of the rate of change of a vector (x, y)."""
    x_rate, y_rate = x_rate + turn.speed * y, y_rate - turn.speed * x
    return turn.cosine * x_rate + turn.sine * y_rate, turn.cosine * y_rate - turn.sine * x_rate


@kernel
def to_fixed_axes(turn, z, y):
    """Turn positions and velocities of the rollers in ``y`` from the frame into the fixed axes."""
    for i in range(z):
        y[i], y[z + i] = turned(turn, y[i], y[z + i])
        y[2 * z + i], y[3 * z + i] = turned(turn, y[2 * z + i], y[3 * z + i])


@kernel
def rates_to_frame(turn, z, y, row, dy):
    """Turn rates of change of the rollers in row ``row`` of ``dy`` into those that the frame sees; ``y``: fixed axes."""
    for i in range(z):
        dy[row, i], dy[row, z + i] = seen(turn, dy[row, i], dy[row, z + i], y[i], y[z + i])
        dy[row, 2 * z + i], dy[row, 3 * z + i] = seen(
            turn, dy[row, 2 * z + i], dy[row, 3 * z + i], y[2 * z + i], y[3 * z + i]
        )


@kernel
def rates_to_fixed_axes(turn, z, y, row, dy):
    """Inverse of ``rates_to_frame``."""
    for first in (0, 2 * z):
        for i in range(first, first + z):
            along, across = turned(turn, dy[row, i], dy[row, z + i])
            dy[row, i], dy[row, z + i] = along - turn.speed * y[z + i], across + turn.speed * y[i]
