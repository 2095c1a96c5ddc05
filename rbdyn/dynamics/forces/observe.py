"""Contacts in recorded states, outside the time integration: loads, slips and heat of each, and loads of slices.

Compiled on request only.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry
from rbdyn.contact.hertz_line import SlicedLineContact, TiltedLineContact, closed_load, line_load, slice_drop, slice_of
from rbdyn.dynamics.forces.cage import guide_forces
from rbdyn.dynamics.forces.equations import motions, roller_pocket
from rbdyn.dynamics.forces.races import race_observed

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
        count = slices.shape[1]
        for k in range(count):
            overlap = high - slice_drop(contact, slice_of(contact, contact.place[k]), nx[i], ny[i])
            slices[i, k] = closed_load(contact.line, overlap)[0] / count


def slice_loads(
    contact: Any,
    count: int,
    roller_radius: float,
    loads: NDArray[np.float64],
    nx: NDArray[np.float64],
    ny: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Loads [N] of ``count`` slices, shape (*loads.shape, count), of contacts of total ``loads`` [N].

    A roller without slices bears evenly.
    """
    if not isinstance(contact, SlicedLineContact | TiltedLineContact):
        return np.repeat(loads[..., None] / count, count, axis=-1)
    result = np.empty((loads.size, count))
    spread(contact, roller_radius, loads.ravel(), nx.ravel(), ny.ravel(), result)
    return result.reshape(*loads.shape, count)


# Rows observed of each roller: loads [N], slips [m/s], and heat [W] by traction and rolling. The load on the pocket wall, by
# contact and film, is positive on the front wall, where the roller drives the cage.
OUTER_LOAD, INNER_LOAD, POCKET_LOAD, OUTER_SLIP, INNER_SLIP, OUTER_HEAT, INNER_HEAT = range(7)
OBSERVED = 7


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
