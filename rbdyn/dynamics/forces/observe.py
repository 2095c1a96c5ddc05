"""What happens at every contact in recorded states: loads, slips, heat. Compiled only where a history is asked for."""

from rbdyn.compiled.kernel import entry, kernel
from rbdyn.contact.tangential_elasticity import coefficient_of
from rbdyn.dynamics.forces.equations import motions, roller_pocket
from rbdyn.dynamics.forces.guide_land import guide_forces
from rbdyn.dynamics.forces.races import race_contact, roller_radius

# Rows of what is observed of each roller: loads [N] (that on the pocket wall, by contact and film, is positive on the
# front wall, where the roller drives the cage), slips [m/s] and heat [W] by traction and rolling.
OUTER_LOAD, INNER_LOAD, POCKET_LOAD, OUTER_SLIP, INNER_SLIP, OUTER_HEAT, INNER_HEAT = range(7)
OBSERVED = 7


@kernel
def race_observed(race, side, bearing, y, j, ring):
    """``race_contact`` of roller ``j``."""
    z = bearing.rollers
    return race_contact(
        race,
        side,
        roller_radius(bearing.sizes, j),
        y[j] - ring.x,
        y[z + j] - ring.y,
        y[2 * z + j] - ring.vx,
        y[3 * z + j] - ring.vy,
        y[4 * z + j],
        ring.speed,
        ring.cos,
        ring.sin,
        coefficient_of(race.tangential, y, j),
    )


@entry
def observe(bearing, states, rollers, land):
    """Fill ``rollers`` (OBSERVED, samples, rollers) and ``land`` (samples,), the dry load of the land [N]."""
    z = bearing.rollers
    for i in range(states.shape[0]):
        y = states[i]
        _, cage, inner, outer = motions(bearing, y)
        land[i] = guide_forces(bearing.guide, cage, inner, outer).load
        for j in range(z):
            on_outer = race_observed(bearing.outer, 1.0, bearing, y, j, outer)
            on_inner = race_observed(bearing.inner, -1.0, bearing, y, j, inner)
            wall = roller_pocket(bearing, y, cage, j)
            rollers[OUTER_LOAD, i, j] = on_outer.load
            rollers[INNER_LOAD, i, j] = on_inner.load
            rollers[POCKET_LOAD, i, j] = wall.on_wall
            rollers[OUTER_SLIP, i, j] = on_outer.slip
            rollers[INNER_SLIP, i, j] = on_inner.slip
            rollers[OUTER_HEAT, i, j] = on_outer.traction + on_outer.rolling
            rollers[INNER_HEAT, i, j] = on_inner.traction + on_inner.rolling
