"""How the load of a roller spreads over its slices: for contact pressure and life, outside the time integration."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry
from rbdyn.contact.hertz_line import SlicedLineContact, TiltedLineContact, closed_load, line_load, slice_drop

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
