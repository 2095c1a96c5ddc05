"""Heat of each node from the power lost in each term: one array of shares, so that errors of powers become errors of heat."""

from typing import Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.losses import LOSSES, Node, Partition
from rbdyn.thermal.network import NODES

# Names of the losses, in the order of the shares.
TERMS = tuple(loss.name for loss in LOSSES)
# Node of what guides the cage, by its guidance.
GUIDES: dict[str, Node] = {"outer": "outer", "inner": "inner", "roller": "rollers"}


class Effusivities(NamedTuple):
    """Thermal effusivities sqrt(k rho c) of rings, rollers and cage [W s^0.5/(m^2 K)]."""

    rings: float
    rollers: float
    cage: float


def heat_partition(first: float, second: float) -> float:
    """beta: share of the first of two surfaces of these effusivities that pass their contact at one speed."""
    return first / (first + second)


def shares(effusivities: Effusivities, guidance: Literal["outer", "inner", "roller"], film_to_oil: float) -> Array:
    """Share of each node of ``NODES`` in the heat of each term of ``TERMS``, (terms, nodes).

    Each row sums to 1, that of support damping to 0. ``guidance``: ring that guides the cage; under guidance by the rollers the
    heat of a land is that of rollers and cage. ``film_to_oil``: share of the oil in the heat of films and of rolling resistance.
    """
    partition = Partition(
        ring=heat_partition(effusivities.rings, effusivities.rollers),
        land=heat_partition(effusivities.rings, effusivities.cage),
        film=film_to_oil,
        guide=GUIDES[guidance],
    )
    array = np.zeros((len(TERMS), len(NODES)))
    for row, loss in enumerate(LOSSES):
        for node, share in loss.heats(partition):
            array[row, NODES.index(node)] += share
    return array
