"""Impacts of rollers in their pockets, from the first approach of a contact to its end, followed over the ends of steps."""

from rbdyn.compiled.kernel import kernel, law_of, routine
from rbdyn.dynamics.forces.cage import Impacts, NoImpacts, pocket_approach
from rbdyn.dynamics.forces.equations import cage_motion, pocket_direction, roller_count
from rbdyn.dynamics.forces.races import roller_radius
from rbdyn.dynamics.forces.state import APPROACH, EXPONENTS, NUMBER, PEAK, PEAK_POWERS, ROLLER_STATES, SQUARES

SLOWEST_APPROACH = 1e-30  # [m/s], for a contact that begins without one


@law_of(NoImpacts)
def book_impacts(impacts, bearing, y, gap, followed, sums):
    """Follow the contacts in all pockets over a step from ``y``, and book impacts that end.

    ``gap``: of ``Scratch`` at the end of the step. ``followed`` (FOLLOWED, rollers) and ``sums`` (rollers, IMPACT_SUMS) change
    in place.
    """


@book_impacts.body(Impacts)
def _(impacts, bearing, y, gap, followed, sums):
    # Without a branch, which the processor could not predict.
    changes = 0
    for j in range(roller_count(bearing)):
        followed[PEAK, j] = max(followed[PEAK, j], -gap[j])
        changes += 1 if (gap[j] < 0.0) != (followed[APPROACH, j] > 0.0) else 0
    if changes > 0:
        book_changes(impacts, bearing, y, gap, followed, sums)


@routine
def book_changes(impacts, bearing, y, gap, followed, sums):
    """``book_impacts`` where contacts begin or end."""
    for j in range(roller_count(bearing)):
        if gap[j] < 0.0:
            if followed[APPROACH, j] == 0.0:
                followed[APPROACH, j] = max(first_approach(bearing, y, j), SLOWEST_APPROACH)
        else:
            if followed[APPROACH, j] > impacts.speed:
                book_impact(impacts, followed[APPROACH, j], followed[PEAK, j], j, sums)
            followed[APPROACH, j] = followed[PEAK, j] = 0.0


@kernel
def book_impact(impacts, speed, peak, j, sums):
    """Add an impact of pocket ``j`` to its sums."""
    sums[j, NUMBER] += 1.0
    sums[j, SQUARES] += speed * speed
    sums[j, PEAK_POWERS] += peak**impacts.exponent
    sums[j, EXPONENTS] += impacts.exponent


@kernel
def first_approach(bearing, y, j):
    """Speed [m/s] at which roller ``j`` nears the nearest part of its pocket."""
    z = roller_count(bearing)
    cage = cage_motion(y, ROLLER_STATES * z)
    ex, ey = pocket_direction(bearing, cage.cos, cage.sin, j)
    dx, dy, dvx, dvy = y[j] - cage.x, y[z + j] - cage.y, y[2 * z + j] - cage.vx, y[3 * z + j] - cage.vy
    offset, height = dy * ex - dx * ey, dx * ex + dy * ey
    across, along = dvy * ex - dvx * ey - cage.speed * height, dvx * ex + dvy * ey + cage.speed * offset
    return pocket_approach(bearing.pocket, roller_radius(bearing.sizes, j), offset, height, across, along)
