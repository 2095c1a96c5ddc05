"""Thermal network of a bearing: conductances [W/K] from sizes, speeds and materials, and steady temperatures of its four nodes.

The nodes are the oil in the cavity, the outer ring with its housing, the inner ring with its shaft, and the rollers with their
cage. The oil is fully mixed, so it leaves at the temperature of its node. In steady state G T = Q + b: ``matrix`` times the
temperatures is the heat of the nodes plus the ``source`` of inlet and surroundings.

Surfaces are the weakest part: published coefficients of the film between a bearing and its oil span 110 to 6750 W/(m^2 K) in one
bearing. The flat plate is in their middle; its factor is an unknown input (0.2 to 3), to fit to one measured temperature.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.contact.film_thickness import RollingContact, film_in_service, half_width
from rbdyn.life.rollers import SEAT_RISE, seat_heat
from rbdyn.properties.materials import Material, Oil

# Harris takes a third of the cage's speed as the speed of the oil past the surfaces (from memory).
OIL_SPEED_SHARE = 1.0 / 3.0
# Local coefficient of a laminar boundary layer on a flat plate (Pohlhausen). Harris prints 0.0332 (from memory).
FLAT_PLATE = 0.332
# Coefficient of the walls that the oil of a bath wets beside the seat, over the area of the seat [W/(m^2 K)] (assumed, 100 to 300).
SUMP = 150.0


def oil_flow(volume_flow: float, oil: Oil, share: float = 1.0) -> float:
    """Heat capacity of an oil stream [W/K]: ``share`` of the ``volume_flow`` [m^3/s] that passes through the bearing, V rho c_p.

    27 to 30 W/K for 1 L/min. Of a jet, 0.3 to 0.9 enters (assumed).
    """
    return share * volume_flow * oil.density * oil.heat_capacity


def flat_plate(oil: Oil, speed: float, length: float) -> float:
    """Heat transfer coefficient [W/(m^2 K)] of oil at ``speed`` [m/s] over a plate of ``length`` [m]: 0 at rest.

    h = 0.332 k Pr^(1/3) sqrt(u/(nu x)) with Pr = eta c_p/k and nu = eta/rho.
    """
    prandtl = oil.viscosity * oil.heat_capacity / oil.conductivity
    return (
        FLAT_PLATE
        * oil.conductivity
        * prandtl ** (1.0 / 3.0)
        * math.sqrt(speed * oil.density / (oil.viscosity * length))
    )


def surface_coefficient(oil: Oil, cage_speed: float, pitch_diameter: float) -> float:
    """Coefficient of rings, rollers and cage in pure oil [W/(m^2 K)]: a flat plate as long as the pitch diameter [m].

    The oil passes at a third of the speed of the cage [rad/s] at the pitch circle.
    """
    return flat_plate(oil, OIL_SPEED_SHARE * abs(cage_speed) * 0.5 * pitch_diameter, pitch_diameter)


class Surfaces(NamedTuple):
    """Surfaces that meet the oil [m^2]: of the outer ring, the inner ring, all rollers, and the cage."""

    outer: float
    inner: float
    rollers: float
    cage: float


class CageSize(NamedTuple):
    """A window cage as a hoop: largest and smallest radius, width [m]."""

    outer_radius: float
    inner_radius: float
    width: float


def surfaces(
    raceways: tuple[float, float],
    width: float,
    rollers: int,
    roller_radius: float,
    roller_length: float,
    cage: CageSize,
) -> Surfaces:
    """Surfaces from plain sizes [m]: raceway radii of outer and inner ring, bearing width, rollers, and cage.

    A ring has the cylinder of its raceway over the width. Its faces, which housing and shaft cover in part, are left out. A roller
    has its cylinder and both ends. The cage has both cylinders less the windows, both side faces, and the walls of its pockets.
    """
    outer, inner = raceways
    cylinder = 2.0 * math.pi * roller_radius * roller_length
    window = 2.0 * roller_radius * roller_length
    thickness = cage.outer_radius - cage.inner_radius
    hoop = 2.0 * math.pi * (cage.outer_radius + cage.inner_radius) * cage.width - 2.0 * rollers * window
    faces = 2.0 * math.pi * (cage.outer_radius**2 - cage.inner_radius**2)
    walls = 2.0 * rollers * (2.0 * roller_radius + roller_length) * thickness
    return Surfaces(
        2.0 * math.pi * outer * width,
        2.0 * math.pi * inner * width,
        rollers * (cylinder + 2.0 * math.pi * roller_radius**2),
        max(hoop, 0.0) + faces + walls,
    )


def cavity_volume(
    raceways: tuple[float, float], width: float, rollers: int, roller_volume: float, cage: float
) -> float:
    """Free volume between the raceways over the width, less rollers and cage [m^3]."""
    outer, inner = raceways
    return math.pi * (outer**2 - inner**2) * width - rollers * roller_volume - cage


def half_space_contact(half_width: Any, length: Any, speed: float, first: float, second: float) -> Any:
    """Conductance of a moving line contact without a film [W/K]: two half-spaces that meet for the time t = 2b/u.

    Half-spaces of effusivities e1 and e2 [W s^0.5/(m^2 K)] meet at a temperature that stays constant. The heat flow of unit
    difference is e1 e2/(e1 + e2)/sqrt(pi t); over the time t it gives 2 e1 e2/(e1 + e2) sqrt(t/pi) to each area, and new area
    arrives at the rate u l. So G = 2 e1 e2/(e1 + e2) l sqrt(2 b u/pi), e l sqrt(2 b u/pi) for like bodies. Half-width b and
    ``length`` l [m], ``speed`` u of both surfaces [m/s]. Between two contacts the surfaces are taken to recover fully.
    """
    both = first * second / (first + second)
    return 2.0 * both * length * np.sqrt(2.0 * half_width * speed / math.pi)


def race_contact(
    loads: Array,
    contact: RollingContact,
    oil: Oil,
    ring: Material,
    roller: Material,
    inlet_distance: float | None = None,
    film: Any = None,
) -> float:
    """Conductance of all contacts of a race [W/K]: of each loaded roller 1/G = h/(2 b l k_oil) + 1/G_half_spaces.

    ``loads`` [N]: of the rollers on this race, (rollers,), or of each roller at several angles, (angles, rollers); then the mean
    over the angles counts. A contact without load conducts nothing. ``film`` [m]: thickness of the shape of ``loads``, by default
    that of the oil in service with its ``inlet_distance``.
    """
    loads = np.atleast_2d(np.asarray(loads, dtype=np.float64))
    loaded = loads > 0.0
    bearing = np.where(loaded, loads, 1.0)
    width = half_width(contact, bearing)
    thickness = film_in_service(contact, oil, bearing, inlet_distance) if film is None else np.asarray(film)
    bodies = half_space_contact(width, contact.length, contact.entrainment_speed, ring.effusivity, roller.effusivity)
    resistance = thickness / (2.0 * width * contact.length * oil.conductivity) + 1.0 / bodies
    return float(np.where(loaded, 1.0 / resistance, 0.0).sum(axis=1).mean())


def sump(outside: float, width: float) -> float:
    """Conductance of the oil of a bath to the surroundings by the walls that it wets [W/K], over pi D B of the seat, sizes in m.

    The heat of ISO 15312 is that through the seats alone.
    """
    return SUMP * math.pi * outside * width


def seats(bore: float, outside: float, width: float) -> tuple[float, float]:
    """Conductances of outer ring and inner ring to the surroundings through their seats [W/K], sizes in m.

    The heat of ISO 15312 at 50 K over pi B (D + d): 320 W/(m^2 K) up to 50 000 mm^2. The part of pi B D leaves by the housing, that of
    pi B d by the shaft. An actual housing differs by a factor of two (0.5 to 2).
    """
    total = seat_heat(math.pi * width * (bore + outside)) / SEAT_RISE
    return total * outside / (bore + outside), total * bore / (bore + outside)


NODES = ("oil", "outer", "inner", "rollers")
OIL, OUTER, INNER, ROLLERS = range(len(NODES))


class Conductances(NamedTuple):
    """Conductances of the network [W/K], none negative; arrays (...) for many networks.

    ``flow``: heat capacity of the oil stream through the cavity. ``oil_outer``, ``oil_inner``, ``oil_rollers``: surfaces to the oil.
    ``outer_rollers``, ``inner_rollers``: race contacts. ``outer_ambient``, ``inner_ambient``: through housing and shaft.
    ``sump``: from the oil of a bath through the walls of the housing, not through the seat.
    """

    flow: Any
    oil_outer: Any
    oil_inner: Any
    oil_rollers: Any
    outer_rollers: Any
    inner_rollers: Any
    outer_ambient: Any
    inner_ambient: Any
    sump: Any = 0.0


class Boundaries(NamedTuple):
    """Temperatures of the oil at its inlet and of the surroundings [C]."""

    inlet: float
    ambient: float


def matrix(conductances: Conductances) -> Array:
    """G [W/K], (..., 4, 4): symmetric, and positive definite where each node has a way out."""
    couplings, ways_out, _ = _parts(conductances, Boundaries(0.0, 0.0))
    return np.asarray((ways_out + couplings.sum(axis=-1))[..., np.newaxis] * np.eye(len(NODES)) - couplings)


def source(conductances: Conductances, boundaries: Boundaries) -> Array:
    """b [W], (..., 4): what inlet and surroundings would bring in if all nodes were at 0 C."""
    return _parts(conductances, boundaries)[2]


def temperatures(conductances: Conductances, boundaries: Boundaries, heat: Array) -> Array:
    """Temperatures of the nodes [C], (4,), from the heat that arises in each [W], (4,).

    The elimination adds only positive numbers: diagonals are sums over the remaining nodes, as in Grassmann, Taksar and Heyman 1985.
    So temperatures are exact to round-off even where contacts conduct 1e9 times better than the ways out. Each node
    needs a way out for its heat, which a scene has.
    """
    # Rises above the surroundings keep the digits that a reference far away would cost.
    boundaries_above = Boundaries(boundaries.inlet - boundaries.ambient, 0.0)
    couplings, ways_out, inflow = _parts(conductances, boundaries_above)
    right = np.asarray(heat, dtype=np.float64) + inflow
    sums = np.empty(len(NODES))
    for node in reversed(range(len(NODES))):
        others = couplings[node, :node]
        sums[node] = ways_out[node] + others.sum()
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
    """Couplings between nodes (..., 4, 4), with a zero diagonal; ways out of each node (..., 4) [W/K]; source (..., 4) [W]."""
    g = Conductances(*np.broadcast_arrays(*conductances))
    couplings = np.zeros((*g.flow.shape, len(NODES), len(NODES)))
    pairs = {
        (OIL, OUTER): g.oil_outer,
        (OIL, INNER): g.oil_inner,
        (OIL, ROLLERS): g.oil_rollers,
        (OUTER, ROLLERS): g.outer_rollers,
        (INNER, ROLLERS): g.inner_rollers,
    }
    for (first, second), value in pairs.items():
        couplings[..., first, second] = couplings[..., second, first] = value
    ways_out = np.stack([g.flow + g.sump, g.outer_ambient, g.inner_ambient, 0.0 * g.flow], axis=-1)
    inflow = boundaries.ambient * ways_out
    inflow[..., OIL] += g.flow * (boundaries.inlet - boundaries.ambient)
    return couplings, ways_out, inflow
