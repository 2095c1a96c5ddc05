"""Heat of a roller bearing at temperatures: conductances of its parts, the nodes that each power heats, and the films of losses."""

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, given
from rbdyn.base.notes import Note
from rbdyn.contact.rolling_resistance import rolling_force
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.parameters.model import rolling_contacts, rolling_law
from rbdyn.dynamics.parameters.state import LoadDistribution, load_distribution
from rbdyn.dynamics.parameters.validity import spin_windage
from rbdyn.losses import INNER_ROLLING, LOSSES, POWER_TERMS, POWERS, ROLLING
from rbdyn.scene import Scene
from rbdyn.scene.notes import catalogue_entry
from rbdyn.scene.thermal import Thermal, inlet_temperature
from rbdyn.thermal.losses import GUIDES, TERMS, Effusivities, HeatModel, Losses, no_residue, shares
from rbdyn.thermal.network import (
    NODES,
    OIL,
    ROLLERS,
    Boundaries,
    CageSize,
    Conductances,
    cavity_volume,
    matrix,
    race_contact,
    source,
    surface_coefficient,
    surfaces,
)
from rbdyn.thermal.oil_fraction import fraction_notes, residence


def _terms_of_powers() -> Array:
    """Terms of the heat from the powers of a simulation, (terms, powers): rolling resistance is that of both races there."""
    powers = (*POWER_TERMS, *[""] * (POWERS - len(POWER_TERMS)))
    rows = np.array([[float(loss.name == power) for power in powers] for loss in LOSSES])
    for race, inner in (("outer", -1.0), ("inner", 1.0)):
        rows[TERMS.index(f"{race}_rolling_resistance"), INNER_ROLLING] = inner
    rows[TERMS.index("outer_rolling_resistance"), ROLLING] = 1.0
    return rows


TERMS_OF_POWERS = _terms_of_powers()


class Network(NamedTuple):
    """Network of a bearing at temperatures.

    ``term_shares`` (terms, 4): of each node in each term of ``losses.TERMS``. ``windage`` [W]: a loss that no power of the simulation
    has.
    """

    conductances: Conductances
    boundaries: Boundaries
    term_shares: Array
    windage: float

    @property
    def shares(self) -> Array:
        """Shares (powers, 4) of the nodes in the powers of a simulation, in the order of ``POWER_TERMS`` and what follows there."""
        return np.asarray(TERMS_OF_POWERS.T @ self.term_shares)

    def terms(self, powers: Array) -> Array:
        """Losses (terms,) [W] of the powers of a simulation (powers,)."""
        losses = TERMS_OF_POWERS @ powers
        losses[TERMS.index("spin_windage")] = self.windage
        return np.asarray(losses)

    @property
    def offset(self) -> Array:
        """Temperatures [C] of the nodes without the powers of the simulation, (4,)."""
        heat = self.windage * self.term_shares[TERMS.index("spin_windage")] + source(self.conductances, self.boundaries)
        return np.asarray(np.linalg.solve(matrix(self.conductances), heat))

    @property
    def weights(self) -> Array:
        """Rise of each node by each power [K/W], (4, powers)."""
        return np.asarray(np.linalg.solve(matrix(self.conductances), self.shares.T))


def network_of(hot: Scene, thermal: Thermal, bearing: RollerBearing) -> Network:
    """Network of a scene at temperatures, by its oil, contacts and sizes; ``bearing``: parameters of the scene."""
    boundaries = Boundaries(inlet_temperature(thermal, hot.lubricant), thermal.ambient_C)
    shares_of_terms = term_shares(hot, thermal.film_share_to_oil)
    return Network(_conductances(hot, thermal, bearing), boundaries, shares_of_terms, spin_windage(hot))


def term_shares(hot: Scene, film_to_oil: float) -> Array:
    """Shares (terms, 4) of the nodes in each term of ``losses.TERMS``, with ``film_to_oil`` of the heat of films in the oil."""
    effusivities = Effusivities(*(hot.material(part).effusivity for part in ("rings", "roller", "cage")))
    return shares(effusivities, hot.cage.guidance, film_to_oil)


def heat_model(hot: Scene, network: Network, temperatures: Array, powers: Array, viscosity: Array) -> HeatModel:
    """Model of the balance about a state: ``temperatures`` (4,) [C], ``powers`` of the simulation, ``viscosity``: ``log_viscosity``."""
    films = np.zeros((len(LOSSES), len(NODES)))
    for row, loss in enumerate(LOSSES):
        surface = GUIDES[hot.cage.guidance] if loss.film == "guide" else loss.film
        for node in (OIL, OIL) if surface is None else (NODES.index(surface), ROLLERS):
            films[row, node] += 0.5
    exponents = np.array([loss.exponent for loss in LOSSES])
    losses = Losses(temperatures, network.terms(powers), exponents, films, viscosity)
    return HeatModel(losses, network.term_shares, network.conductances, network.boundaries, no_residue())


def ring_width(scene: Scene) -> float:
    """Width of the rings [m], stated or that of the designation. Raises InputError without either."""
    width = given(scene.mounting).width
    if width is not None:
        return width
    listed = catalogue_entry(scene.bearing)
    if listed is None:
        raise InputError("mounting.width_mm: missing; the heat balance needs the width of the rings")
    return 1e-3 * listed[1].width


def _conductances(hot: Scene, thermal: Thermal, bearing: RollerBearing) -> Conductances:
    mounting, lubricant, cage, geometry = given(hot.mounting), hot.lubricant, hot.cage, hot.geometry
    oil, width = hot.oil(), ring_width(hot)
    radii = geometry.land_radius, geometry.rim_radius
    size = CageSize(max(radii), min(radii), hot.bearing.roller_length + cage.lands * cage.land_width)
    rollers = hot.bearing.rollers, geometry.roller_radius, hot.bearing.roller_length
    areas = surfaces(geometry.raceways, width, *rollers, size)
    film = thermal.surface_factor * surface_coefficient(oil, geometry.motion.cage_speed, hot.bearing.pitch_diameter)
    loads = load_distribution(hot, bearing, hot.operation.largest_load_N)
    contacts = rolling_contacts(hot)
    parts = hot.material("rings"), hot.material("roller")
    races = {
        race: thermal.contact_factor
        * race_contact(getattr(loads, race), contacts[race], hot.oil(race), *parts, lubricant.inlet_distance)
        if contacts[race].entrainment_speed > 0.0
        else 0.0
        for race in ("outer", "inner")
    }
    return Conductances(
        **thermal.ways_out(lubricant, oil, mounting, width),
        oil_outer=film * areas.outer,
        oil_inner=film * areas.inner,
        oil_rollers=film * (areas.rollers + areas.cage),
        outer_rollers=races["outer"],
        inner_rollers=races["inner"],
    )


# Distances of inlets at which the rolling resistance is computed, in half-widths.
DISTANCES = np.geomspace(1.0, 200.0, 17)


def loss_levels(hot: Scene, bearing: RollerBearing) -> dict[str, Callable[[float], Array]]:
    """By key of a scene, the losses (terms,) at a value of it over those at its own, at the static loads of the rollers.

    Rolling resistance follows its factor and the inlet; without any there are no such keys.
    """
    factor, distance = hot.model.rolling_resistance_factor, hot.lubricant.inlet_distance
    if hot.model.rolling_resistance == "off" or factor == 0.0:
        return {}
    rolling = np.array([term.endswith("rolling_resistance") for term in TERMS])
    loads = load_distribution(hot, bearing, hot.operation.largest_load_N)
    forces = np.log([_rolling_force(hot, loads, ratio) for ratio in DISTANCES])
    usual = math.log(_rolling_force(hot, loads, distance))

    def at_distance(value: float) -> Array:
        level = np.exp(np.interp(math.log(value), np.log(DISTANCES), forces) - usual)
        return np.where(rolling, level, 1.0)

    return {
        "model.rolling_resistance_factor": lambda value: np.where(rolling, value / factor, 1.0),
        "lubricant.inlet_distance": at_distance,
    }


def _rolling_force(hot: Scene, loads: LoadDistribution, distance: float | None) -> float:
    """Rolling resistance of all loaded rollers on both races [N] with the oil beginning at a distance."""
    starved = hot.model_copy(update={"lubricant": hot.lubricant.model_copy(update={"inlet_distance": distance})})
    total = 0.0
    for race, radius in zip(("outer", "inner"), hot.geometry.reduced_radii, strict=True):
        law, speed = rolling_law(starved, hot.oil(race), radius), abs(hot.geometry.motion.entrainment)
        total += sum(rolling_force(law, float(load), speed) for load in getattr(loads, race).ravel() if load > 0.0)
    return total


def cavity_of(scene: Scene) -> float:
    """Free volume between the raceways, over the width of the rings [m^3]."""
    geometry = scene.geometry
    volume = geometry.roller_mass / scene.material("roller").density
    cage = scene.cage.mass / scene.material("cage").density
    return cavity_volume(geometry.raceways, ring_width(scene), scene.bearing.rollers, volume, cage)


def flow_notes(hot: Scene) -> Iterator[Note]:
    """Notes where the oil fraction that follows from a flow is a guess; none without a flow."""
    flow, (inner, outer) = hot.lubricant.oil_flow, hot.operation.speeds
    if flow is not None and hot.mounting is not None:
        stay = residence(hot.lubricant.oil_fraction, cavity_of(hot), flow, hot.geometry.motion.cage_speed)
        yield from fraction_notes(inner - outer, hot.bearing.pitch_diameter, stay)
