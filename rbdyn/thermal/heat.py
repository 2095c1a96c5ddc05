"""Heat of each node from the power lost in each term: one array of shares, so that errors of powers become errors of heat.

| term | heats |
|---|---|
| race traction | ring beta, rollers 1 - beta |
| rolling resistance, of each race | oil f, ring and rollers (1 - f)/2 each |
| race damping | rollers 1/2, each ring 1/4 |
| pocket friction and damping | rollers with cage |
| pocket film | oil f, rollers with cage 1 - f |
| land film | oil f, guiding ring and cage (1 - f)/2 each |
| land friction and damping | guiding ring beta, cage 1 - beta |
| roller drag, windage of spin | oil |
| support damping | no node: the damper has an oil of its own |

Two surfaces that slide on each other share the heat by beta = e1 sqrt(u1)/(e1 sqrt(u1) + e2 sqrt(u2)) with the effusivity
e = sqrt(k rho c) and the speed u at which each passes the contact (Blok, from memory). Those of races that roll, and of a
land whose contact whirls, are taken as equal. The share f of a film's heat that its oil takes along is ``film_to_oil``. Walls of
equal area share the rest, and the shares of race damping are assumptions.
"""

from typing import Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError
from rbdyn.thermal.network import INNER, NODES, OIL, OUTER, ROLLERS

# Power terms in the order of the shares: those of a simulation, its rolling resistance by race, and the estimate of windage.
TERMS = (
    "outer_race_traction",
    "inner_race_traction",
    "outer_rolling_resistance",
    "inner_rolling_resistance",
    "race_damping",
    "pocket_friction",
    "pocket_damping",
    "pocket_film",
    "land_film",
    "land_friction",
    "land_damping",
    "roller_drag",
    "support_damping",
    "spin_windage",
)


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
    to_ring = heat_partition(effusivities.rings, effusivities.rollers)
    to_land = heat_partition(effusivities.rings, effusivities.cage)
    guide = {"outer": OUTER, "inner": INNER, "roller": ROLLERS}[guidance]
    walls = 1.0 - film_to_oil
    by_term: dict[str, tuple[tuple[int, float], ...]] = {
        "outer_race_traction": ((OUTER, to_ring), (ROLLERS, 1.0 - to_ring)),
        "inner_race_traction": ((INNER, to_ring), (ROLLERS, 1.0 - to_ring)),
        "outer_rolling_resistance": ((OIL, film_to_oil), (OUTER, 0.5 * walls), (ROLLERS, 0.5 * walls)),
        "inner_rolling_resistance": ((OIL, film_to_oil), (INNER, 0.5 * walls), (ROLLERS, 0.5 * walls)),
        "race_damping": ((OUTER, 0.25), (INNER, 0.25), (ROLLERS, 0.5)),
        "pocket_friction": ((ROLLERS, 1.0),),
        "pocket_damping": ((ROLLERS, 1.0),),
        "pocket_film": ((OIL, film_to_oil), (ROLLERS, walls)),
        "land_film": ((OIL, film_to_oil), (guide, 0.5 * walls), (ROLLERS, 0.5 * walls)),
        "land_friction": ((guide, to_land), (ROLLERS, 1.0 - to_land)),
        "land_damping": ((guide, to_land), (ROLLERS, 1.0 - to_land)),
        "roller_drag": ((OIL, 1.0),),
        "support_damping": (),
        "spin_windage": ((OIL, 1.0),),
    }
    array = np.zeros((len(TERMS), len(NODES)))
    for row, term in enumerate(TERMS):
        for node, share in by_term[term]:
            array[row, node] += share
    return array


def power_vector(power_terms: dict[str, float], rolling: dict[str, float], windage: float = 0.0) -> Array:
    """Powers in the order of ``TERMS`` [W], (terms,): of a simulation by name, and its rolling resistance by "outer", "inner".

    A term that is missing counts as zero. Heat of the nodes is ``shares(...).T @ power_vector(...)``, and covariances of powers C become
    shares.T @ C @ shares. Raises MethodError for a term that heats no known node.
    """
    by_name = {name: power for name, power in power_terms.items() if name != "rolling_resistance"}
    by_name |= {f"{race}_rolling_resistance": power for race, power in rolling.items()}
    by_name["spin_windage"] = windage
    if alien := sorted(set(by_name) - set(TERMS)):
        raise MethodError(f"power term {', '.join(alien)}: heats no node; add its share to rbdyn/thermal/heat.py")
    return np.array([by_name.get(term, 0.0) for term in TERMS])
