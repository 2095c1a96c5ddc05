"""Steady temperatures of a bearing: four nodes and the conductances between them.

The nodes are the oil in the cavity, the outer ring with its housing, the inner ring with its shaft, and the rollers with their
cage. The oil is fully mixed, so it leaves at the temperature of its node. In steady state G T = Q + b: ``matrix`` times the
temperatures is the heat of the nodes plus the ``source`` of inlet and surroundings.
"""

from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError

NODES = ("oil", "outer", "inner", "rollers")
OIL, OUTER, INNER, ROLLERS = range(len(NODES))


class Conductances(NamedTuple):
    """Conductances of the network [W/K], none negative.

    ``flow``: heat capacity of the oil stream through the cavity. ``oil_outer``, ``oil_inner``, ``oil_rollers``: surfaces to the oil.
    ``outer_rollers``, ``inner_rollers``: race contacts. ``outer_ambient``, ``inner_ambient``: through housing and shaft.
    ``sump``: from the oil of a bath through the walls of the housing, not through the seat.
    """

    flow: float
    oil_outer: float
    oil_inner: float
    oil_rollers: float
    outer_rollers: float
    inner_rollers: float
    outer_ambient: float
    inner_ambient: float
    sump: float = 0.0


class Boundaries(NamedTuple):
    """Temperatures of the oil at its inlet and of the surroundings [C]."""

    inlet: float
    ambient: float


def matrix(conductances: Conductances) -> Array:
    """G [W/K], (4, 4): symmetric, and positive definite where each node has a way out."""
    couplings, ways_out, _ = _parts(conductances, Boundaries(0.0, 0.0))
    return np.diag(ways_out + couplings.sum(axis=1)) - couplings


def source(conductances: Conductances, boundaries: Boundaries) -> Array:
    """b [W], (4,): what inlet and surroundings would bring in if all nodes were at 0 C."""
    return _parts(conductances, boundaries)[2]


def temperatures(conductances: Conductances, boundaries: Boundaries, heat: Array) -> Array:
    """Temperatures of the nodes [C], (4,), from the heat that arises in each [W], (4,).

    The elimination adds only positive numbers: diagonals are sums over the remaining nodes, as in Grassmann, Taksar and Heyman 1985.
    So temperatures are exact to round-off even where contacts conduct 1e9 times better than the ways out. Raises MethodError
    for a negative or infinite conductance and for a node without a way out for its heat.
    """
    # Rises above the surroundings keep the digits that a reference far away would cost.
    boundaries_above = Boundaries(boundaries.inlet - boundaries.ambient, 0.0)
    couplings, ways_out, inflow = _parts(conductances, boundaries_above)
    right = np.asarray(heat, dtype=np.float64) + inflow
    sums = np.empty(len(NODES))
    for node in reversed(range(len(NODES))):
        others = couplings[node, :node]
        sums[node] = ways_out[node] + others.sum()
        if not sums[node] > 0.0:
            raise MethodError(
                f"{NODES[node]}: no conductance leads heat out; give an oil flow, a housing or a shaft that removes it"
            )
        shares = others / sums[node]
        ways_out[:node] += shares * ways_out[node]
        right[:node] += shares * right[node]
        couplings[:node, :node] += np.outer(shares, others)
        np.fill_diagonal(couplings, 0.0)
    rises = np.empty(len(NODES))
    for node in range(len(NODES)):
        rises[node] = (right[node] + couplings[node, :node] @ rises[:node]) / sums[node]
    return boundaries.ambient + rises


def carried_off(conductances: Conductances, boundaries: Boundaries, temperatures: Array) -> dict[str, float]:
    """Heat that leaves by "oil flow", "sump", "housing" and "shaft" [W]; in steady state their sum is the heat of all nodes."""
    oil, outer, inner, _ = temperatures
    return {
        "oil flow": float(conductances.flow * (oil - boundaries.inlet)),
        "sump": float(conductances.sump * (oil - boundaries.ambient)),
        "housing": float(conductances.outer_ambient * (outer - boundaries.ambient)),
        "shaft": float(conductances.inner_ambient * (inner - boundaries.ambient)),
    }


def _parts(conductances: Conductances, boundaries: Boundaries) -> tuple[Array, Array, Array]:
    """Couplings between nodes (4, 4), with a zero diagonal; ways out of each node (4,) [W/K]; source (4,) [W]."""
    for name, value in conductances._asdict().items():
        if not 0.0 <= value < np.inf:
            raise MethodError(
                f"conductance {name} = {value:g} W/K: must be zero or positive and finite; check its sizes"
            )
    g = conductances
    couplings = np.zeros((len(NODES), len(NODES)))
    pairs = {
        (OIL, OUTER): g.oil_outer,
        (OIL, INNER): g.oil_inner,
        (OIL, ROLLERS): g.oil_rollers,
        (OUTER, ROLLERS): g.outer_rollers,
        (INNER, ROLLERS): g.inner_rollers,
    }
    for (first, second), value in pairs.items():
        couplings[first, second] = couplings[second, first] = value
    ways_out = np.array([g.flow + g.sump, g.outer_ambient, g.inner_ambient, 0.0])
    inflow = boundaries.ambient * ways_out
    inflow[OIL] += g.flow * (boundaries.inlet - boundaries.ambient)
    return couplings, ways_out, inflow
