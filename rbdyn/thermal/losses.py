"""The heat balance about a state: losses by the viscosity of their films, the nodes that they heat, and what else changes.

A film's loss is P = P0 (eta/eta0)^p at the temperature of its surfaces. Oil that warms loses viscosity, so this heat falls while
the heat carried off rises, and the balance has one solution. It lies above the coldest surroundings: no loss is negative, and the
network only mixes temperatures. Newton's method comes to it by steps that never overshoot from the cold side, because the balance
is concave there. Whatever else moves heat, such as lost clearance, is ``residue``, linear in the temperatures.
"""

from collections.abc import Callable, Mapping
from typing import Any, Literal, NamedTuple, Self

import numpy as np

from rbdyn.base.arrays import Array, Mask
from rbdyn.losses import LOSSES, Node, Partition
from rbdyn.properties.materials import Oil
from rbdyn.thermal.network import NODES, Boundaries, Conductances, matrix, source

# Temperature at which no oil lubricates, and the coldest one of a stated oil [C].
HOTTEST, COLDEST = 350.0, -60.0
# Longest step of Newton's method, end of its steps [K], and their number at most.
LONGEST_STEP, LAST_STEP, MOST_STEPS = 40.0, 1e-9, 200
# Deviation of the model from its balance that counts as none [K].
CLOSED = 1e-3
DEGREES = np.arange(COLDEST, HOTTEST + 0.5)


class Losses(NamedTuple):
    """Losses about a state.

    ``temperatures`` (4,) [C] of the nodes and ``powers`` (terms,) [W] of the state; ``exponents`` (terms,) of the viscosity;
    ``films`` (terms, 4): weights of the nodes in the temperature of the film of a loss; ``log_viscosity``: of the oil at whole
    degrees from COLDEST to HOTTEST.
    """

    temperatures: Array
    powers: Array
    exponents: Array
    films: Array
    log_viscosity: Array

    def viscosities(self, nodes: Array) -> Array:
        """Logarithm of the viscosity in each film (..., terms) at temperatures of the nodes (..., 4)."""
        return np.asarray(np.interp(nodes @ self.films.T, DEGREES, self.log_viscosity))

    def at(self, nodes: Array) -> Array:
        """Losses (..., terms) [W] at temperatures of the nodes (..., 4) [C]."""
        change = self.viscosities(nodes) - self.viscosities(self.temperatures)
        return np.asarray(self.powers * np.exp(self.exponents * change))

    def slopes(self, nodes: Array) -> Array:
        """dP/dT (..., terms, 4) [W/K]."""
        films = nodes @ self.films.T
        change = np.interp(films + 0.5, DEGREES, self.log_viscosity) - np.interp(
            films - 0.5, DEGREES, self.log_viscosity
        )
        return np.asarray((self.at(nodes) * self.exponents * change)[..., np.newaxis] * self.films)


def log_viscosity(oil_at: Callable[[float], Oil]) -> Array:
    """Logarithm of an oil's viscosity at whole degrees, as of ``Losses``."""
    return np.log([oil_at(float(degree)).viscosity for degree in DEGREES])


def film_powers(losses: Losses, other: Losses, least_change: float, least_share: float) -> Array:
    """Exponents (terms,) by which the losses of two states follow the viscosity, where this differs enough, else those of the first.

    Its logarithm must differ by ``least_change``, and both powers exceed ``least_share`` of all. A loss that starvation or heat of
    the inlet holds follows the viscosity less, so exponents stay in 0 to 1.2.
    """
    change = losses.viscosities(losses.temperatures) - losses.viscosities(other.temperatures)
    clear = (losses.exponents > 0.0) & (np.abs(change) >= least_change)
    for state in (losses, other):
        clear &= state.powers > least_share * max(float(state.powers.sum()), 0.0)
    ratios = np.where(clear, losses.powers, 1.0) / np.where(clear, other.powers, 1.0)
    return np.where(clear, np.clip(np.log(ratios) / np.where(clear, change, 1.0), 0.0, 1.2), losses.exponents)


class HeatModel(NamedTuple):
    """Losses about a state, ``shares`` (terms, 4) of the nodes in these, the network, and ``residue`` (4, 4) [W/K] of the heat's slopes.

    Of many models about one state, powers, shares and conductances are arrays (n, ...).
    """

    losses: Losses
    shares: Array
    conductances: Conductances
    boundaries: Boundaries
    residue: Array

    @property
    def matrix(self) -> Array:
        """G [W/K], (..., 4, 4)."""
        return matrix(self.conductances)

    @property
    def coldest(self) -> Array:
        """Temperature of the colder surroundings of those that exchange heat (...) [C]: no node is colder."""
        conductances, (inlet, ambient) = self.conductances, self.boundaries
        out = conductances.outer_ambient + conductances.inner_ambient + conductances.sump
        by_oil = np.where(np.asarray(out) > 0.0, min(inlet, ambient), inlet)
        return np.where(np.asarray(conductances.flow) > 0.0, by_oil, ambient)

    def heat(self, nodes: Array) -> Array:
        """Heat of the nodes (..., 4) [W] at their temperatures (..., 4) [C]."""
        by_films = (self.losses.at(nodes)[..., np.newaxis, :] @ self.shares)[..., 0, :]
        return np.asarray(by_films + (nodes - self.losses.temperatures) @ self.residue.T)

    def heat_slopes(self, nodes: Array) -> Array:
        """dQ/dT (..., 4, 4) [W/K]."""
        return np.asarray(np.einsum("...tn,...tm->...nm", self.shares, self.losses.slopes(nodes)) + self.residue)

    def excess(self, nodes: Array) -> Array:
        """Heat less what the network carries off (..., 4) [W]: zero where the heat balances."""
        carried = (self.matrix @ nodes[..., np.newaxis])[..., 0]
        return np.asarray(self.heat(nodes) + source(self.conductances, self.boundaries) - carried)

    def rise(self, nodes: Array) -> float:
        """Largest rise of a node by the heat at temperatures (4,) [C], [K]."""
        return float(np.linalg.solve(self.matrix, self.heat(nodes)).max())

    def image_slopes(self, nodes: Array) -> Array:
        """dM/dT (..., 4, 4) of the temperatures M that carry the heat off."""
        return np.asarray(np.linalg.solve(self.matrix, self.heat_slopes(nodes)))

    def with_image_slopes(self, slopes: Array) -> Self:
        """The model with the residue that gives it the slopes dM/dT at its state."""
        viscous = self._replace(residue=np.zeros_like(self.residue)).heat_slopes(self.losses.temperatures)
        return self._replace(residue=self.matrix @ slopes - viscous)

    def balanced(self) -> Array:
        """Temperatures (..., 4) [C] that balance their heat, between the coldest surroundings and HOTTEST."""
        matrix, coldest = self.matrix, self.coldest[..., np.newaxis]
        nodes = np.clip(self.losses.temperatures, coldest, HOTTEST)
        for _ in range(MOST_STEPS):
            step = solved(matrix - self.heat_slopes(nodes), self.excess(nodes))
            longest = np.abs(step).max(axis=-1, keepdims=True)
            step *= np.minimum(1.0, LONGEST_STEP / np.maximum(longest, LAST_STEP))
            before, nodes = nodes, np.clip(nodes + step, coldest, HOTTEST)
            if np.abs(nodes - before).max() < LAST_STEP:
                break
        return np.asarray(nodes)

    def is_stable(self, nodes: Array, most: float = 1.0) -> Mask:
        """Whether the temperatures (..., 4) of ``balanced`` are a balance of the model below HOTTEST, with a gain below ``most``."""
        image = solved(self.matrix, self.excess(nodes))
        balance = (np.abs(image).max(axis=-1) < CLOSED) & (nodes.max(axis=-1) < HOTTEST)
        return np.asarray(balance & (gain(self.image_slopes(nodes)) < most))

    def varied(self, ratios: Mapping[str, Array], powers: Array, shares: Array) -> Self:
        """Models with conductances (n,) and ``powers`` (n, terms) times ratios, and other ``shares`` (n, terms, 4)."""
        scaled = {name: ratio * getattr(self.conductances, name) for name, ratio in ratios.items()}
        losses = self.losses._replace(powers=powers * self.losses.powers)
        return self._replace(losses=losses, shares=shares, conductances=self.conductances._replace(**scaled))


def gain(slopes: Array) -> Any:
    """Gain of the loop (...): largest real part of the eigenvalues of dM/dT (..., 4, 4); steady below one."""
    return np.linalg.eigvals(slopes).real.max(axis=-1)


def solved(matrices: Array, right: Array) -> Array:
    """Solutions (..., 4) of systems (..., 4, 4) with right sides (..., 4)."""
    return np.asarray(np.linalg.solve(matrices, right[..., np.newaxis])[..., 0])


def no_residue() -> Array:
    """Slopes of a balance that follows the viscosity alone (4, 4)."""
    return np.zeros((len(NODES), len(NODES)))


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
