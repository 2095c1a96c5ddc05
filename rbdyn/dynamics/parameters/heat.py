"""Thermal network of a roller bearing at temperatures: conductances of its parts, and the nodes that each power heats."""

from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError
from rbdyn.dynamics.forces.equations import INNER_ROLLING, LOSSES, POWERS, ROLLING, RollerBearing
from rbdyn.dynamics.parameters.model import rolling_contacts
from rbdyn.dynamics.parameters.state import load_distribution
from rbdyn.dynamics.parameters.validity import spin_windage
from rbdyn.scene import Scene
from rbdyn.scene.notes import catalogue_entry
from rbdyn.scene.thermal import Thermal, inlet_temperature
from rbdyn.thermal.conductances import (
    CageSize,
    cavity_volume,
    oil_flow,
    race_contact,
    seats,
    surface_coefficient,
    surfaces,
)
from rbdyn.thermal.heat import TERMS, Effusivities, shares
from rbdyn.thermal.network import NODES, OIL, Boundaries, Conductances, matrix, source
from rbdyn.thermal.oil_fraction import fraction_notes, residence


class Network(NamedTuple):
    """Network of a bearing at temperatures.

    ``shares`` (powers, 4): of each node in each power of the simulation, in the order of ``equations.LOSSES`` and what follows
    there. ``windage`` (4,) [W]: heat that no power of the simulation has.
    """

    conductances: Conductances
    boundaries: Boundaries
    shares: Array
    windage: Array

    @property
    def offset(self) -> Array:
        """Temperatures [C] of the nodes without the powers of the simulation, (4,)."""
        heat = self.windage + source(self.conductances, self.boundaries)
        return np.asarray(np.linalg.solve(matrix(self.conductances), heat))

    @property
    def weights(self) -> Array:
        """Rise of each node by each power [K/W], (4, powers)."""
        return np.asarray(np.linalg.solve(matrix(self.conductances), self.shares.T))


def network_of(hot: Scene, thermal: Thermal, bearing: RollerBearing) -> Network:
    """Network of a scene at temperatures, by its oil, contacts and sizes; ``bearing``: parameters of the scene."""
    windage = np.zeros(len(NODES))
    windage[OIL] = spin_windage(hot)
    boundaries = Boundaries(inlet_temperature(thermal, hot.lubricant), thermal.ambient_C)
    return Network(_conductances(hot, thermal, bearing), boundaries, _power_shares(hot), windage)


def ring_width(scene: Scene) -> float:
    """Width of the rings [m], stated or that of the designation. Raises InputError without either."""
    assert scene.mounting is not None
    if scene.mounting.width is not None:
        return scene.mounting.width
    listed = catalogue_entry(scene.bearing)
    if listed is None:
        raise InputError(["mounting.width_mm: missing; the heat balance needs the width of the rings"])
    return 1e-3 * listed[1].width


def _conductances(hot: Scene, thermal: Thermal, bearing: RollerBearing) -> Conductances:
    mounting, lubricant, cage, geometry = hot.mounting, hot.lubricant, hot.cage, hot.geometry
    assert mounting is not None
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
    housing, shaft = seats(mounting.bore, mounting.outside_diameter, width)
    flow = lubricant.oil_flow
    return Conductances(
        flow=0.0 if flow is None else oil_flow(flow, oil, thermal.oil_share),
        oil_outer=film * areas.outer,
        oil_inner=film * areas.inner,
        oil_rollers=film * (areas.rollers + areas.cage),
        outer_rollers=races["outer"],
        inner_rollers=races["inner"],
        outer_ambient=thermal.housing_factor * housing,
        inner_ambient=thermal.housing_factor * shaft,
    )


def flow_notes(hot: Scene) -> tuple[str, ...]:
    """Notes where the oil fraction that follows from a flow is a guess; none without a flow."""
    flow, geometry = hot.lubricant.oil_flow, hot.geometry
    if flow is None or hot.mounting is None:
        return ()
    inner, outer = hot.operation.speeds
    volume = geometry.roller_mass / hot.material("roller").density
    cage = hot.cage.mass / hot.material("cage").density
    cavity = cavity_volume(geometry.raceways, ring_width(hot), hot.bearing.rollers, volume, cage)
    stay = residence(hot.lubricant.oil_fraction, cavity, flow, geometry.motion.cage_speed)
    return fraction_notes(inner - outer, hot.bearing.pitch_diameter, stay)


def _power_shares(hot: Scene) -> Array:
    """Shares (powers, 4) of the nodes in the powers of a simulation."""
    effusivities = Effusivities(*(hot.material(part).effusivity for part in ("rings", "roller", "cage")))
    of_term = dict(zip(TERMS, shares(effusivities, hot.cage.guidance), strict=True))
    rows = np.zeros((POWERS, len(NODES)))
    for place, loss in enumerate(LOSSES):
        if place != ROLLING:
            rows[place] = of_term[loss]
    # The rolling resistance is that of both races, and its inner part follows on its own.
    rows[ROLLING] = of_term["outer_rolling_resistance"]
    rows[INNER_ROLLING] = of_term["inner_rolling_resistance"] - of_term["outer_rolling_resistance"]
    return rows
