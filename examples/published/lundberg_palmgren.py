"""Race capacities of a row of balls from the dimensions alone: Lundberg and Palmgren 1947, as the Sensors 2023 paper has it."""

from __future__ import annotations

import math

from rbdyn.life.balls import ball_size_term
from rbdyn.scene.ball import BallRow

LUNDBERG_PALMGREN = 98.1  # [N, mm]


def lundberg_palmgren_capacities(
    balls: int,
    ball_diameter: float,
    pitch_diameter: float,
    contact_angle: float,
    inner_groove_factor: float,
    outer_groove_factor: float,
) -> tuple[float, float]:
    """Ball load [N] that the inner and the outer race bear for 1e6 turns, from the dimensions [m, rad].

    98.1 (2f/(2f-1))^0.41 (1-+g)^1.39/(1+-g)^(1/3) (g/cos alpha)^0.3 D^1.8 Z^(-1/3) in N and mm, g = D cos(alpha)/d_m,
    upper signs inside (Sensors 2023, eq 8).
    """
    relative = ball_diameter / pitch_diameter
    gamma = relative * math.cos(contact_angle)

    def capacity(groove: float, signed: float) -> float:
        shape = (1.0 - signed) ** 1.39 / (1.0 + signed) ** (1.0 / 3.0) * relative**0.3
        close = (2.0 * groove / (2.0 * groove - 1.0)) ** 0.41
        return LUNDBERG_PALMGREN * close * shape * ball_size_term(ball_diameter) * balls ** (-1.0 / 3.0)

    return capacity(inner_groove_factor, gamma), capacity(outer_groove_factor, -gamma)


def plain_capacities(drawing: BallRow) -> tuple[float, float]:
    """Ball loads [N] that the races of a drawing bear for 1e6 turns: steel and finish of 1947, no b_m."""
    sizes = drawing.balls, drawing.ball_diameter, drawing.pitch_diameter, drawing.contact_angle
    return lundberg_palmgren_capacities(*sizes, *drawing.groove_factors)
