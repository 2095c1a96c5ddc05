"""The path of a ring that turns over form errors of grooves and balls, from equilibrium to equilibrium.

``RaceErrors`` hold the form errors, ``ball_path`` the geometry that each ball meets, and ``follow`` solves the ``RingPath``.
Outer errors stay with the outer ring, inner errors turn with the inner ring, balls travel with the cage. In the plane of a
ball, with the origin at the centre of curvature of the outer groove, positions are (axial, radial):

- roundness w: the groove is w further out. The inner groove centre moves by +w_i, relative to the outer one by -w_o.
- side-sway and other axial waviness: the same in axial direction. Order 1 is the side-sway (Zhou et al. 2024, eqs 9-10).
- groove radius: the groove is dr wider with its bottom in place. Its centre moves radially by dr and its reach grows by
  dr, so that a contact at the angle alpha opens by dr (1 - cos alpha). The change of the contact stiffness is neglected,
  one part in ten thousand for a micrometre.
- ball: half its diameter error, and its sphericity w at the contact, reduce both reaches. The contacts are opposite (eqs
  11-12): even orders add up and odd orders cancel. The ball rolls on a great circle, about an axis fixed in the ball.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import MethodError, RunError
from rbdyn.base.table import Column, Sheet, frame_of
from rbdyn.base.words import counted
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.newton import FIGURES, LARGEST_LOAD, RESIDUAL, Task, boundary_conditions, space, walk
from rbdyn.quasistatic.row.ring import RING, Row, component_lengths
from rbdyn.quasistatic.runout.measures import Runout, runout

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True)
class Waviness:
    """Sum of amplitude cos(order (angle - phase)) over harmonics: orders [-], amplitudes [m], phases [rad]."""

    order: Whole
    amplitude: Array
    phase: Array

    def deviation(self, angle: Array) -> Array:
        """Deviation [m] at angles on the ring [rad], of their shape."""
        total = np.zeros_like(angle)
        for order, amplitude, phase in zip(self.order, self.amplitude, self.phase, strict=True):
            total += amplitude * np.cos(order * (angle - phase))
        return total

    @property
    def height(self) -> float:
        """Peak to valley around the ring [m]."""
        fine = 16 * int(self.order.max(initial=1))
        trace = self.deviation(np.linspace(0.0, 2.0 * math.pi, max(fine, 720), endpoint=False))
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
    """Waviness of harmonics (order, amplitude [m], phase [rad]); without any, a perfect form."""
    order, amplitude, phase = np.array(harmonics, float).reshape(-1, 3).T
    return Waviness(order.astype(np.int64), amplitude, phase)


PERFECT = waviness()


def random_waviness(lowest: int, highest: int, height: float, decay: float, draw: np.random.Generator) -> Waviness:
    """Waviness of orders ``lowest`` to ``highest`` in random phases, ``height`` [m] from peak to valley.

    Amplitudes are Rayleigh distributed, with a mean that falls as order^-decay.
    """
    order = np.arange(lowest, highest + 1)
    amplitude = order.astype(float) ** -decay * draw.rayleigh(size=order.size)
    form = Waviness(order, amplitude, draw.uniform(0.0, 2.0 * math.pi, order.size))
    return form.scaled(height / form.height)


@dataclass(frozen=True)
class RaceErrors:
    """Form errors of one row of Z balls.

    ``ball_diameter`` (Z,): diameter of each ball less the nominal one [m]. ``sphericity``: waviness round each ball, by the
    angle of the inner contact from a mark on the ball.
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
    """Errors of a perfect row of ``balls``."""
    return RaceErrors(np.zeros(balls), (PERFECT,) * balls)


class Turning(NamedTuple):
    """Turns of each part for one turn of the inner ring relative to the outer: rings, cage, balls relative to the cage."""

    inner: float
    outer: float
    cage: float
    spin: float


def rolling(ball_diameter: float, pitch_diameter: float, contact_angle: float, outer: float = 0.0) -> Turning:
    """Rolling without slip, one cage speed for all balls.

    Diameters in m, the angle in rad. ``outer``: turns of the outer ring; at 0 it stands, at -1 the inner ring stands.
    omega_c = (omega_i (1 - g) + omega_o (1 + g))/2, spin = (omega_i - omega_o) (1 - g^2) dm/(2D), g = D cos(alpha)/dm.
    Raises MethodError unless 0 < D < dm.
    """
    if not 0.0 < ball_diameter < pitch_diameter:
        raise MethodError(
            f"a ball of {ball_diameter:g} m does not fit on a pitch circle of {pitch_diameter:g} m; make the ball smaller"
        )
    gamma = ball_diameter * math.cos(contact_angle) / pitch_diameter
    cage = 0.5 * ((1.0 + outer) * (1.0 - gamma) + outer * (1.0 + gamma))
    spin = 0.5 * pitch_diameter / ball_diameter * (1.0 - gamma**2)
    return Turning(1.0 + outer, outer, cage, spin)


class BallPath(NamedTuple):
    """Geometry at each ball at each step: changes [m] of the row, (steps, Z) each.

    ``ring_angle`` (steps,): turn of the inner ring [rad]. ``azimuth`` of the balls [rad]. ``axial, radial``: position of
    the inner groove centre relative to the outer one. ``inner_reach, outer_reach``: groove radius less ball radius.
    """

    ring_angle: Array
    azimuth: Array
    axial: Array
    radial: Array
    inner_reach: Array
    outer_reach: Array


def ball_path(errors: RaceErrors, turning: Turning, steps: int, turns: int = 1, start: float = 0.0) -> BallPath:
    """Ball path of ``turns`` turns of the inner ring relative to the outer, with ``steps`` a turn.

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
    wider_inner, wider_outer = (
        errors.inner_groove_radius.deviation(on_inner),
        errors.outer_groove_radius.deviation(on_outer),
    )
    # The inner contact is at the spin angle of the ball, the outer one opposite.
    spun = turning.spin * turn[:, 0]
    inner_contact = np.stack([form.deviation(spun) for form in errors.sphericity], axis=1)
    outer_contact = np.stack([form.deviation(spun + math.pi) for form in errors.sphericity], axis=1)
    larger = 0.5 * errors.ball_diameter
    return BallPath(
        ring_angle=turning.inner * turn[:, 0],
        azimuth=azimuth,
        axial=errors.inner_sway.deviation(on_inner) - errors.outer_sway.deviation(on_outer),
        radial=errors.inner_roundness.deviation(on_inner)
        - errors.outer_roundness.deviation(on_outer)
        + wider_inner
        + wider_outer,
        inner_reach=wider_inner - inner_contact - larger,
        outer_reach=wider_outer - outer_contact - larger,
    )


@dataclass(frozen=True)
class RingPath:
    """Path of the inner ring. ``path`` (steps, 5): displacements x, y, z [m], theta_x, theta_y [rad].

    ``ring_angle`` (steps,) [rad]. ``largest_load`` (steps,): of any ball on any race [N]. ``residual``: largest unbalanced
    force of all steps [N]. ``newton_steps``: of all steps together.
    """

    ring_angle: Array
    path: Array
    largest_load: Array
    residual: float
    newton_steps: int
    turns: int

    def runout(self, face_radius: float) -> Runout:
        """Runout of the path; ``face_radius``: radius at which an axial indicator touches the ring [m]."""
        return runout(self.path, self.turns, face_radius)

    def table(self) -> "pd.DataFrame":
        """A row a step, units in the column names."""
        return frame_of(RUNOUT.columns, self)


RUNOUT: Sheet[RingPath] = Sheet(
    "",
    (
        Column("ring_angle_deg", at=lambda ring: np.degrees(ring.ring_angle), meaning="how far the ring has turned"),
        Column("x_um", at=lambda ring: 1e6 * ring.path[:, 0], meaning="place of the inner ring"),
        Column("y_um", at=lambda ring: 1e6 * ring.path[:, 1]),
        Column("z_um", at=lambda ring: 1e6 * ring.path[:, 2]),
        Column("tilt_x_urad", unit="µrad", at=lambda ring: 1e6 * ring.path[:, 3], meaning="its tilts"),
        Column("tilt_y_urad", unit="µrad", at=lambda ring: 1e6 * ring.path[:, 4]),
        Column("largest_load_N", at="largest_load", meaning="largest load of a ball"),
    ),
    file="runout.csv",
    content="One row per step of the turning ring, of `rbdyn ball` with `[errors]` in the scene.",
)


def follow(
    row: Row, control: Control, load: Array, balls: BallPath, turns: int, constraint: Array | None = None
) -> RingPath:
    """Solve the equilibrium at every step of ``balls``, each from the step before.

    The changes of ``balls`` are added to the positions and reaches of the nominal ``row``. Other arguments are those of
    ``equilibrium.solve``. Raises RunError naming the first step without an equilibrium.
    """
    steps, size = balls.azimuth.shape
    force, free, displacement = boundary_conditions(row, load, constraint)
    # Positions and reaches have the same order in ``Row`` and ``BallPath``.
    places = (own + change for own, change in zip(row[2:6], balls[2:6], strict=True))
    changes = np.stack((np.cos(balls.azimuth), np.sin(balls.azimuth), *places))
    # ``walk`` overwrites its row.
    own = Row._make((*np.zeros((6, size)), *row[6:]))
    state = space(size)
    state.q[:] = displacement
    path, figures = np.zeros((steps, RING)), np.zeros((steps, FIGURES))
    reached, newton_steps = walk(Task(control, own, force, free), changes, state, path, figures)
    if reached < steps:
        raise RunError(
            f"runout: no equilibrium at step {reached + 1} of {steps}; reduce the form errors or raise the load"
        )
    return RingPath(
        ring_angle=balls.ring_angle,
        path=path / component_lengths(row.lever),
        largest_load=figures[:, LARGEST_LOAD],
        residual=float(figures[:, RESIDUAL].max()),
        newton_steps=newton_steps,
        turns=turns,
    )
