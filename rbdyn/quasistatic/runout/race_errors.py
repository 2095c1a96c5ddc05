"""Form errors of a ball bearing: what each ball meets of them while the rings turn.

Ball plane of one ball, origin in the centre of curvature of the outer groove (axial, radial):
- roundness: the groove stands w further out. The inner groove centre moves by +w_i, against the outer one by -w_o.
- side-sway and other axial waviness: the same axially. Order 1 is the side-sway (Zhou et al. 2024, eqs 9-10).
- groove radius: the groove is dr wider while its bottom stays. Its centre gives way radially by dr and its reach grows
  by dr, so a contact at the angle alpha opens by dr (1 - cos alpha). What it does to the contact stiffness (a part in
  ten thousand for a micrometre) is left out.
- ball: half its diameter error, and its sphericity w at the contact, shorten both reaches. The contacts lie opposite
  (eqs 11-12): even orders add up and odd orders cancel. Taken round the great circle that rolls, about an axis that
  keeps its place in the ball.

Outer errors stay with the outer ring, inner errors turn with the inner ring, balls travel with the cage.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import MethodError
from rbdyn.base.words import counted


@dataclass(frozen=True)
class Waviness:
    """Sum of amplitude cos(order (angle - phase)) over harmonics: orders [-], amplitudes [m], phases [rad]."""

    order: Whole
    amplitude: Array
    phase: Array

    def at(self, angle: Array) -> Array:
        """Deviation [m] at angles on the ring [rad], of their shape."""
        total = np.zeros_like(angle)
        for order, amplitude, phase in zip(self.order, self.amplitude, self.phase, strict=True):
            total += amplitude * np.cos(order * (angle - phase))
        return total

    @property
    def height(self) -> float:
        """Peak to valley around the ring [m]."""
        fine = 16 * int(self.order.max(initial=1))
        trace = self.at(np.linspace(0.0, 2.0 * math.pi, max(fine, 720), endpoint=False))
        return float(np.ptp(trace))

    def scaled(self, factor: float) -> "Waviness":
        """The same form, ``factor`` times as high."""
        return Waviness(self.order, factor * self.amplitude, self.phase)

    def plus(self, other: "Waviness") -> "Waviness":
        """Both together."""
        return Waviness(
            np.concatenate((self.order, other.order)),
            np.concatenate((self.amplitude, other.amplitude)),
            np.concatenate((self.phase, other.phase)),
        )


def waviness(*harmonics: tuple[int, float, float]) -> Waviness:
    """Waviness of (order, amplitude [m], phase [rad]) each; none for a perfect form."""
    order, amplitude, phase = np.array(harmonics, float).reshape(-1, 3).T
    return Waviness(order.astype(np.int64), amplitude, phase)


PERFECT = waviness()


def random_waviness(lowest: int, highest: int, height: float, decay: float, draw: np.random.Generator) -> Waviness:
    """Orders ``lowest`` to ``highest`` in random phases, together ``height`` [m] from peak to valley.

    Amplitudes fall as order^-decay on the average; each is spread as the radius of a normal cloud (Rayleigh).
    """
    order = np.arange(lowest, highest + 1)
    amplitude = order.astype(float) ** -decay * draw.rayleigh(size=order.size)
    form = Waviness(order, amplitude, draw.uniform(0.0, 2.0 * math.pi, order.size))
    return form.scaled(height / form.height)


@dataclass(frozen=True)
class RaceErrors:
    """Form errors of one row of Z balls.

    ``ball_diameter``: each ball's diameter less the nominal one [m], (Z,). ``sphericity``: waviness round each ball; its
    angle is that of the inner contact from a mark on the ball.
    """

    ball_diameter: Array
    sphericity: tuple[Waviness, ...]
    inner_roundness: Waviness = PERFECT
    outer_roundness: Waviness = PERFECT
    inner_sway: Waviness = PERFECT
    outer_sway: Waviness = PERFECT
    inner_groove_radius: Waviness = PERFECT
    outer_groove_radius: Waviness = PERFECT

    @property
    def balls(self) -> int:
        """Number of balls Z."""
        return self.ball_diameter.size


def perfect(balls: int) -> RaceErrors:
    """A row of ``balls`` without errors, to start from."""
    return RaceErrors(np.zeros(balls), (PERFECT,) * balls)


class Turning(NamedTuple):
    """Turns of each part while the inner ring makes one against the outer: rings, cage, balls against the cage."""

    inner: float
    outer: float
    cage: float
    spin: float


def rolling(ball_diameter: float, pitch_diameter: float, contact_angle: float, outer: float = 0.0) -> Turning:
    """Rolling without slip, one cage speed for all balls.

    Diameters in m, the angle in rad; ``outer``: turns of the outer ring (0: it stands, -1: the inner ring stands).
    omega_c = (omega_i (1 - g) + omega_o (1 + g))/2, spin = (omega_i - omega_o) (1 - g^2) dm/(2D), g = D cos(alpha)/dm.
    Raises MethodError unless 0 < D < dm.
    """
    if not 0.0 < ball_diameter < pitch_diameter:
        raise MethodError(
            f"a ball of {ball_diameter:g} m on a pitch circle of {pitch_diameter:g} m: it must be smaller"
        )
    gamma = ball_diameter * math.cos(contact_angle) / pitch_diameter
    cage = 0.5 * ((1.0 + outer) * (1.0 - gamma) + outer * (1.0 + gamma))
    spin = 0.5 * pitch_diameter / ball_diameter * (1.0 - gamma**2)
    return Turning(1.0 + outer, outer, cage, spin)


class BallPath(NamedTuple):
    """What each ball meets, step by step: changes [m] of the row it stands in, (steps, Z) each.

    ``ring_angle``: turn of the inner ring [rad], (steps,). ``azimuth`` of the balls [rad]. ``axial, radial``: place of
    the inner groove centre against the outer one. ``inner_reach, outer_reach``: groove radius less ball radius.
    """

    ring_angle: Array
    azimuth: Array
    axial: Array
    radial: Array
    inner_reach: Array
    outer_reach: Array


def ball_path(errors: RaceErrors, turning: Turning, steps: int, turns: int = 1, start: float = 0.0) -> BallPath:
    """Follow the balls through ``turns`` turns of the inner ring against the outer, ``steps`` to a turn.

    ``start``: azimuth of the first ball at the first step [rad]. Raises MethodError unless steps and turns are positive.
    """
    if steps < 1 or turns < 1:
        raise MethodError(
            f"{counted(turns, 'turn')} of {counted(steps, 'step')} make no path; give at least one of each"
        )
    z = errors.balls
    turn = 2.0 * math.pi * np.arange(steps * turns)[:, np.newaxis] / steps
    azimuth = start + turning.cage * turn + 2.0 * math.pi * np.arange(z) / z
    on_inner, on_outer = azimuth - turning.inner * turn, azimuth - turning.outer * turn
    wider_inner, wider_outer = (errors.inner_groove_radius.at(on_inner), errors.outer_groove_radius.at(on_outer))
    # Contacts: the inner one at the angle that the ball has spun, the outer one opposite.
    spun = turning.spin * turn[:, 0]
    inner_contact = np.stack([form.at(spun) for form in errors.sphericity], axis=1)
    outer_contact = np.stack([form.at(spun + math.pi) for form in errors.sphericity], axis=1)
    larger = 0.5 * errors.ball_diameter
    return BallPath(
        ring_angle=turning.inner * turn[:, 0],
        azimuth=azimuth,
        axial=errors.inner_sway.at(on_inner) - errors.outer_sway.at(on_outer),
        radial=errors.inner_roundness.at(on_inner) - errors.outer_roundness.at(on_outer) + wider_inner + wider_outer,
        inner_reach=wider_inner - inner_contact - larger,
        outer_reach=wider_outer - outer_contact - larger,
    )
