"""Static load of the inner ring: how its rollers sit between the races, and how they share the load."""

import math

from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.contact.hertz_line import line_load
from rbdyn.dynamics.forces.races import form_at, roller_radius

TRIES = 60
BALANCED = 1e-11  # of the forces at the ends of the bracket
ROUND_OFF = 1e-15  # of a radius
FIRST_APPROACH = 1e-6  # [m], from which a bracket of approaches is widened


@kernel
def race_loads(bearing, j, radius, angle, ring_x):
    """Static loads [N] of roller ``j`` at (radius, angle): outer race, inner race with the ring at (ring_x, 0)."""
    own_radius = roller_radius(bearing.sizes, j)
    cosine, sine = math.cos(angle), math.sin(angle)
    rise, _ = form_at(bearing.outer.form, cosine, sine, 1.0, 0.0)
    overlap = radius + own_radius - bearing.outer.radius - rise
    outer = line_load(bearing.outer.contact, overlap, cosine, sine)[0]
    dx, dy = radius * cosine - ring_x, radius * sine
    distance = math.sqrt(dx * dx + dy * dy)
    nx, ny = dx / distance, dy / distance
    rise, _ = form_at(bearing.inner.form, nx, ny, 1.0, 0.0)
    overlap = bearing.inner.radius + rise + own_radius - distance
    return outer, line_load(bearing.inner.contact, overlap, nx, ny)[0]


@kernel
def narrowed(low, below, high, above, moved, middle, force):
    """Bracket with the forces at its ends after a try, and which end moved: +1 the high one, -1 the low one, 0 none yet.

    False position: an end that stays for a second time counts half (Illinois), so that both close in.
    """
    if force > 0.0:
        return low, 0.5 * below if moved > 0 else below, middle, force, 1
    return middle, force, high, 0.5 * above if moved < 0 else above, -1


@kernel
def seat_force(bearing, j, radius, angle, ring_x, orbit_speed):
    """Outer load less inner load and centrifugal force [N]."""
    outer, inner = race_loads(bearing, j, radius, angle, ring_x)
    return outer - inner - bearing.roller_mass * radius * orbit_speed**2


@routine
def seated_radius(bearing, j, angle, ring_x, orbit_speed):
    """Orbit radius [m] at which outer load balances inner load and centrifugal force."""
    low = bearing.outer.radius - roller_radius(bearing.sizes, j)
    width, below = FIRST_APPROACH, seat_force(bearing, j, low, angle, ring_x, orbit_speed)
    high, above = low, below
    while above <= 0.0 and high < 2.0 * bearing.outer.radius:
        low, below, high, width = high, above, high + width, 2.0 * width
        above = seat_force(bearing, j, high, angle, ring_x, orbit_speed)
    while below > 0.0 and low > bearing.inner.radius:
        low, high, above, width = low - width, low, below, 2.0 * width
        below = seat_force(bearing, j, low, angle, ring_x, orbit_speed)
    # A light roller is balanced only as well as the bits of its radius allow.
    enough = BALANCED * max(abs(below), abs(above)) + ROUND_OFF * high * (above - below) / (high - low)
    moved = 0
    for _ in range(TRIES):
        middle = (low * above - high * below) / (above - below)
        force = seat_force(bearing, j, middle, angle, ring_x, orbit_speed)
        if abs(force) <= enough:
            return middle
        low, below, high, above, moved = narrowed(low, below, high, above, moved, middle, force)
    return high


@routine
def static_force(bearing, angles, orbit_speed, ring_x, radii):
    """Force along x [N] that the rollers at ``angles`` hold against a ring at (ring_x, 0); fills their orbit radii."""
    force = 0.0
    for j in range(angles.size):
        radii[j] = seated_radius(bearing, j, angles[j], ring_x, orbit_speed)
        force += race_loads(bearing, j, radii[j], angles[j], ring_x)[1] * math.cos(angles[j])
    return force


@entry
def static_share(bearing, angles, orbit_speed, load, radii):
    """Ring displacement along x [m] under a load [N] along x; fills the orbit radii [m] of rollers at ``angles``.

    The force rises with the displacement, which is negative where the form of the races alone pushes harder.
    """
    reach = roller_radius(bearing.sizes, 0)
    low, high = -1e-5, 1e-5
    while static_force(bearing, angles, orbit_speed, high, radii) < load and high < reach:
        low, high = high, 2.0 * high
    while static_force(bearing, angles, orbit_speed, low, radii) > load and low > -reach:
        low, high = 2.0 * low, low
    below = static_force(bearing, angles, orbit_speed, low, radii) - load
    above = static_force(bearing, angles, orbit_speed, high, radii) - load
    enough = BALANCED * max(abs(below), abs(above))
    if below >= 0.0 or above <= 0.0:
        # No load within the play, or more than the bracket holds.
        return 0.5 * (low + high) if below == above else low if below >= 0.0 else high
    middle = high
    moved = 0
    for _ in range(TRIES):
        middle = (low * above - high * below) / (above - below)
        force = static_force(bearing, angles, orbit_speed, middle, radii) - load
        if abs(force) <= enough:
            break
        low, below, high, above, moved = narrowed(low, below, high, above, moved, middle, force)
    return middle
