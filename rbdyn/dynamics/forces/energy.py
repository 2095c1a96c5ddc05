"""Mechanical energy of a state, against which the powers are balanced."""

import math

from rbdyn.compiled.kernel import entry, kernel
from rbdyn.contact.hertz_line import line_energy
from rbdyn.dynamics.forces.cage_body import cage_kinetic_energy, mass_centre
from rbdyn.dynamics.forces.drive import load_potential
from rbdyn.dynamics.forces.equations import motions, pocket_direction
from rbdyn.dynamics.forces.gravity import height_energy
from rbdyn.dynamics.forces.guide_land import guide_energy
from rbdyn.dynamics.forces.pocket import pocket_energy
from rbdyn.dynamics.forces.race_form import form_at
from rbdyn.dynamics.forces.races import roller_radius
from rbdyn.dynamics.forces.ring_motion import support_energy


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
