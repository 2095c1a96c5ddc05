"""Roller against raceway: normal load, traction and rolling resistance as one wrench at the contact point.

The wrench acts with opposite sign on roller and ring at the same point, so that force, moment and power balance
exactly. ``side`` is +1 for the outer race, whose ring encloses the roller, and -1 for the inner race. A raceway is round,
or has waviness and out-of-round as harmonics of its radius.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import VECTOR, kernel, law_of
from rbdyn.contact.damping import damped_load
from rbdyn.contact.hertz_line import around, line_load, root_stiffness
from rbdyn.contact.rolling_resistance import rolling_force
from rbdyn.contact.tangential import coefficient_of, response, steady_traction


class RoundRace(NamedTuple):
    """A perfect circle."""


class WavyRace(NamedTuple):
    """Radius R + sum_n (a_n cos(n phi) + b_n sin(n phi)), phi counted from a mark on the ring."""

    order: NDArray[np.int64]  # n
    cosine: NDArray[np.float64]  # a_n [m]
    sine: NDArray[np.float64]  # b_n [m]


class FormInLane(NamedTuple):
    """What ``form_at`` gives where a roller meets a wavy raceway."""

    rise: float  # [m]
    slope: float  # [m/rad]


def wavy_race(order: NDArray[np.int64], amplitude: NDArray[np.float64], phase: NDArray[np.float64]) -> WavyRace:
    """Harmonics of the radius: amplitude [m] cos(order (phi - phase)), so a lobe of the ring is at ``phase`` [rad]."""
    return WavyRace(order, amplitude * np.cos(order * phase), amplitude * np.sin(order * phase))


def largest_rise(form: RoundRace | WavyRace) -> float:
    """Upper bound of the radius above its mean [m]."""
    return float(np.hypot(form.cosine, form.sine).sum()) if isinstance(form, WavyRace) else 0.0


@kernel
def turned_multiple(order, cosine, sine):
    """cos(n phi), sin(n phi) from cos(phi), sin(phi), by squaring."""
    real, imaginary = 1.0, 0.0
    while order > 0:
        if order & 1:
            real, imaginary = real * cosine - imaginary * sine, real * sine + imaginary * cosine
        cosine, sine = cosine * cosine - sine * sine, 2.0 * cosine * sine
        order >>= 1
    return real, imaginary


@law_of(RoundRace)
def form_at(form, nx, ny, ring_cos, ring_sin):
    """Radius above the mean [m] and its slope over angle [m/rad], at the direction ``nx, ny`` from the ring's centre.

    ``ring_cos, ring_sin``: direction of the mark on the ring.
    """
    return 0.0, 0.0


@form_at.body(WavyRace)
def _(form, nx, ny, ring_cos, ring_sin):
    cosine, sine = nx * ring_cos + ny * ring_sin, ny * ring_cos - nx * ring_sin
    rise = slope = 0.0
    for i in range(form.order.size):
        real, imaginary = turned_multiple(form.order[i], cosine, sine)
        rise += form.cosine[i] * real + form.sine[i] * imaginary
        slope += form.order[i] * (form.sine[i] * real - form.cosine[i] * imaginary)
    return rise, slope


@form_at.body(FormInLane)
def _(form, nx, ny, ring_cos, ring_sin):
    return form.rise, form.slope


@law_of(RoundRace)
def without_waves(form):
    """The form as lanes read it, numbers alone."""
    return form


@without_waves.body(WavyRace)
def _(form):
    return FormInLane(0.0, 0.0)


@law_of(RoundRace)
def sloped(form, slope, size):
    """``slope`` times ``size``; nothing, and not computed, on a round race."""
    return 0.0


@sloped.body(WavyRace, FormInLane)
def _(form, slope, size):
    return slope * size


# Below this a speed is round-off; it keeps the roots of the laws finite.
SMALLEST_SPEED = 1e-12


class Race(NamedTuple):
    """One raceway: its radius [m], its laws, and ``reach``: distance of ring and roller centres beyond which they never touch [m]."""

    radius: float
    reach: float
    form: Any
    contact: Any
    damping: Any
    traction: Any
    rolling: Any
    tangential: Any


@kernel
def with_laws(race, traction, tangential):
    """The race with other laws of traction."""
    return Race(race.radius, race.reach, race.form, race.contact, race.damping, traction, race.rolling, tangential)


@kernel
def with_shape(race, form, contact):
    """A raceway of another form and law of load."""
    return Race(race.radius, race.reach, form, contact, race.damping, race.traction, race.rolling, race.tangential)


class EqualRollers(NamedTuple):
    """Rollers of one radius [m]."""

    radius: float


class UnequalRollers(NamedTuple):
    """Each roller with its own radius [m]; masses are those of the mean."""

    radii: NDArray[np.float64]  # padded to whole vectors


def unequal_rollers(radii: NDArray[np.float64]) -> UnequalRollers:
    """Rollers of these radii [m]."""
    return UnequalRollers(np.concatenate((radii, np.full(-len(radii) % VECTOR, radii[0]))))


@law_of(EqualRollers)
def roller_radius(sizes, number):
    """Radius of a roller [m]."""
    return sizes.radius


@roller_radius.body(UnequalRollers)
def _(sizes, number):
    return sizes.radii[number]


class RaceWrench(NamedTuple):
    """What a race does to a roller: force [N]; moments on the roller and on the ring about its centre [N m].

    Then the load [N], the powers lost [W], the slip [m/s] and the rate of the traction coefficient [1/s]. The force on the
    ring is the opposite.
    """

    x: float
    y: float
    roller_moment: float
    ring_moment: float
    load: float
    traction: float
    rolling: float
    damping: float
    slip: float
    coefficient_rate: float


class RaceApproach(NamedTuple):
    """How a roller meets a race: outward unit vector from ring to roller, 1/distance of the centres [1/m].

    Slope of the race's form and lean of the load [m/rad]; load [N], tangent stiffness of the contact [N/m] and power of
    its damping [W]; levers of roller and ring [m]; slip and entrainment [m/s].
    """

    nx: float
    ny: float
    inverse: float
    slope: float
    lean: float
    load: float
    stiffness: float
    damping: float
    roller_lever: float
    ring_lever: float
    slip: float
    entrainment: float


@kernel
def race_approach(race, side, radius, dx, dy, dvx, dvy, roller_spin, ring_speed, ring_cos, ring_sin):
    """``RaceApproach`` of one roller to one race; arguments as in ``race_contact``."""
    distance = math.sqrt(dx * dx + dy * dy)
    inverse = 1.0 / distance
    nx, ny = dx * inverse, dy * inverse
    rise, slope = form_at(race.form, nx, ny, ring_cos, ring_sin)
    # Terms that a round race lacks are subtracted: x - 0 is the one sum with zero that the compiler may drop.
    overlap = side * (distance - race.radius - rise) + radius
    tangential = dvy * nx - dvx * ny
    orbit_rate = tangential * inverse
    elastic, stiffness, approach, lean = line_load(race.contact, overlap, nx, ny)
    approach_rate = side * (dvx * nx + dvy * ny - sloped(race.form, slope, orbit_rate - ring_speed))
    approach_rate -= around(race.contact, -lean, orbit_rate)
    root = root_stiffness(race.contact, stiffness, approach)
    damped = damped_load(race.damping, elastic, root, approach, approach_rate)
    load = 0.0 if elastic == 0.0 else damped

    roller_lever = side * (radius - 0.5 * approach)
    ring_lever = distance + roller_lever
    slip = ring_speed * ring_lever - tangential - roller_spin * roller_lever

    # Seen from the line of centres both surfaces run in one direction, at the entrainment speed on average.
    roller_surface = (roller_spin - orbit_rate) * roller_lever
    ring_surface = (ring_speed - orbit_rate) * ring_lever
    return RaceApproach(
        nx,
        ny,
        inverse,
        slope,
        lean,
        load,
        stiffness,
        (load - elastic) * approach_rate,
        roller_lever,
        ring_lever,
        slip,
        0.5 * (roller_surface + ring_surface),
    )


@kernel
def race_wrench(race, side, approach, steady, coefficient):
    """``RaceWrench`` of a ``RaceApproach`` with its ``SteadyTraction`` and the traction coefficient of the state."""
    load, slip = approach.load, approach.slip
    speed = max(abs(approach.entrainment), SMALLEST_SPEED)
    tangential = response(race.tangential, steady, coefficient, load, slip, approach.stiffness)
    traction_force = tangential.coefficient * load
    resistance = rolling_force(race.rolling, load, speed)
    rolling = math.copysign(resistance, approach.entrainment)
    normal = -side * load
    along = traction_force + rolling * (approach.ring_lever + approach.roller_lever) * approach.inverse
    along -= sloped(race.form, approach.slope, normal * approach.inverse) + around(
        race.contact, approach.lean, load * approach.inverse
    )
    return RaceWrench(
        normal * approach.nx - along * approach.ny,
        normal * approach.ny + along * approach.nx,
        approach.roller_lever * (traction_force - rolling),
        -approach.ring_lever * (traction_force + rolling) - sloped(race.form, approach.slope, -normal),
        load,
        traction_force * slip,
        2.0 * rolling * approach.entrainment,
        approach.damping,
        slip,
        tangential.rate,
    )


@kernel
def race_contact(race, side, radius, dx, dy, dvx, dvy, roller_spin, ring_speed, ring_cos, ring_sin, coefficient):
    """``RaceWrench`` of one race on one roller; zero, but for round-off, where they do not touch.

    ``dx, dy, dvx, dvy``: position [m] and velocity [m/s] of the roller's centre less those of the ring's centre;
    spins [rad/s]; ``ring_cos, ring_sin``: direction of the ring's mark; ``coefficient``: traction coefficient, where it is a
    state.

    Load: Chen et al. 2022, eq 5-6; slip at the point that halves the approach: eq 7-10; rolling resistance with
    the pressure offset 2 F_R R_x/R_b: Biboulet and Houpert 2010. On a wavy race the load points along the gradient of
    the overlap: through the roller's centre, past the ring's. So it does between tilted races: their tilt is prescribed and
    bears the moment about the ring's centre.
    """
    approach = race_approach(race, side, radius, dx, dy, dvx, dvy, roller_spin, ring_speed, ring_cos, ring_sin)
    steady = steady_traction(race.tangential, race.traction, approach.slip, approach.load)
    return race_wrench(race, side, approach, steady, coefficient)


@kernel
def race_observed(race, side, bearing, y, j, ring):
    """``race_contact`` of roller ``j``."""
    z = bearing.rollers
    return race_contact(
        race,
        side,
        roller_radius(bearing.sizes, j),
        y[j] - ring.x,
        y[z + j] - ring.y,
        y[2 * z + j] - ring.vx,
        y[3 * z + j] - ring.vy,
        y[4 * z + j],
        ring.speed,
        ring.cos,
        ring.sin,
        coefficient_of(race.tangential, y, j),
    )
