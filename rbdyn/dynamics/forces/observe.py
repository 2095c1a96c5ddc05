"""What happens in recorded states, outside the time integration: loads, slips and heat at every contact, loads of slices, and the
mechanical energy against which the powers are balanced.

Compiled only where it is asked for.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry, kernel
from rbdyn.contact.hertz_line import (
    SlicedLineContact,
    TiltedLineContact,
    closed_load,
    line_energy,
    line_load,
    slice_drop,
)
from rbdyn.contact.tangential_elasticity import coefficient_of
from rbdyn.dynamics.forces.bodies import cage_kinetic_energy, mass_centre, support_energy
from rbdyn.dynamics.forces.drive import load_potential
from rbdyn.dynamics.forces.equations import motions, pocket_direction, roller_pocket
from rbdyn.dynamics.forces.guide_land import guide_energy, guide_forces
from rbdyn.dynamics.forces.pocket import pocket_energy
from rbdyn.dynamics.forces.races import form_at, race_contact, roller_radius
from rbdyn.dynamics.forces.surroundings import height_energy


@kernel
def race_energy(race, side, radius, dx, dy, ring):
    """Elastic energy [J] of one race contact; ``dx, dy``: roller's centre less the ring's [m]."""
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    rise, _ = form_at(race.form, nx, ny, ring.cos, ring.sin)
    return line_energy(race.contact, side * (distance - race.radius - rise) + radius, nx, ny)


@entry
def mechanical_energy(bearing, y):
    """(kinetic, elastic, potential) energy [J] of a state. The rotation of the rings, being prescribed, is left out."""
    z = bearing.rollers
    _, cage, inner, outer = motions(bearing, y)
    kinetic, elastic, potential = support_energy(bearing.outer_ring, bearing.gravity, y)
    kinetic += cage_kinetic_energy(bearing.cage, cage.vx, cage.vy, cage.cos, cage.sin, cage.speed)
    kinetic += 0.5 * bearing.inner_ring_mass * (inner.vx**2 + inner.vy**2)
    elastic += guide_energy(bearing.guide, cage.x, cage.y, inner.x, inner.y, outer.x, outer.y)
    centre_x, centre_y = mass_centre(bearing.cage, cage.x, cage.y, cage.cos, cage.sin)
    potential += load_potential(bearing.drive, inner.x)
    potential += height_energy(bearing.gravity, bearing.cage.mass, centre_x, centre_y)
    potential += height_energy(bearing.gravity, bearing.inner_ring_mass, inner.x, inner.y)
    for j in range(z):
        x, y_ = y[j], y[z + j]
        radius = roller_radius(bearing.sizes, j)
        kinetic += 0.5 * bearing.roller_mass * (y[2 * z + j] ** 2 + y[3 * z + j] ** 2)
        kinetic += 0.5 * bearing.roller_inertia * y[4 * z + j] ** 2
        potential += height_energy(bearing.gravity, bearing.roller_mass, x, y_)
        elastic += race_energy(bearing.outer, 1.0, radius, x - outer.x, y_ - outer.y, outer)
        elastic += race_energy(bearing.inner, -1.0, radius, x - inner.x, y_ - inner.y, inner)
        ex, ey = pocket_direction(bearing, cage.cos, cage.sin, j)
        elastic += pocket_energy(bearing.pocket, radius, ex, ey, x - cage.x, y_ - cage.y)
    return kinetic, elastic, potential


BISECTIONS = 60


@entry
def spread(contact, largest_overlap, loads, nx, ny, slices):
    """Fill ``slices`` (contacts, slices) with the share of each of ``loads`` (contacts,) [N].

    ``nx, ny`` (contacts,): directions of the rollers from the ring's centre. A load that needs more than
    ``largest_overlap`` [m] is cut there.
    """
    for i in range(loads.size):
        low, high = -largest_overlap, largest_overlap
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            if line_load(contact, middle, nx[i], ny[i])[0] < loads[i]:
                low = middle
            else:
                high = middle
        for k in range(slices.shape[1]):
            overlap = high - slice_drop(contact, k, nx[i], ny[i])
            slices[i, k] = contact.share[k] * closed_load(contact.whole, overlap)[0]


def slice_loads(
    contact: Any,
    count: int,
    roller_radius: float,
    loads: NDArray[np.float64],
    nx: NDArray[np.float64],
    ny: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Loads [N] of ``count`` slices, shape (*loads.shape, count), of contacts of total ``loads`` [N].

    A roller that is not cut into slices bears evenly.
    """
    if not isinstance(contact, SlicedLineContact | TiltedLineContact):
        return np.repeat(loads[..., None] / count, count, axis=-1)
    result = np.empty((loads.size, count))
    spread(contact, roller_radius, loads.ravel(), nx.ravel(), ny.ravel(), result)
    return result.reshape(*loads.shape, count)


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
