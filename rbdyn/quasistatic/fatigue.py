"""Fatigue life of the row of a scene: which ratings its drawing gives, and which ring turns against the load."""

from rbdyn.life import Life, Turning
from rbdyn.life.balls import dynamic_capacity, rated_capacities, row_life
from rbdyn.quasistatic.row.equilibrium import Solution
from rbdyn.scene.ball import BallRow

# ISO 281 grants grooves closer than its table's no more than the table.
CLOSEST_RATED = 0.52


def capacity_of(drawing: BallRow) -> float:
    """C_r of a row [N]: the catalogue's where the drawing has it, else by ISO 281 from the dimensions."""
    if drawing.dynamic_capacity_N is not None:
        return drawing.dynamic_capacity_N
    inner, outer = (max(factor, CLOSEST_RATED) for factor in drawing.groove_factors)
    sizes = drawing.balls, drawing.ball_diameter, drawing.pitch_diameter, drawing.contact_angle
    return dynamic_capacity(*sizes, inner, outer)


def reference_capacities(drawing: BallRow) -> tuple[float, float]:
    """Ball loads [N] that the inner and the outer race bear for 1e6 turns by ISO/TS 16281."""
    angle = drawing.contact_angle
    return rated_capacities(capacity_of(drawing), drawing.balls, drawing.gamma, angle, *drawing.groove_factors)


def solution_life(solution: Solution, capacities: tuple[float, float], turning: Turning = "inner") -> Life:
    """Life of a row in equilibrium."""
    return row_life(solution.inner_load, solution.outer_load, capacities, turning)
