"""Temperatures of a machine while it warms: nodes with heat capacities, their heat by power laws about simulated moments.

C dT/dt = Q + b - G T. The housing and the shaft, which follow their rings by seats, are two more nodes than ``network`` has, and the
steady state is that of ``network``. The mechanics settles in milliseconds, so that each power follows the present state:

    P = sum_k w_k P_k (eta/eta_k)^p (n/n_k)^q (F/F_k)^r

over the moments k that were simulated, with viscosity eta of the film, speed n and load F. The weights w_k, exp(-(d/2)^2)/d of the
distance d from a moment, sum to 1. Conductances have the same weights. Nothing here knows a bearing.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM, RunError
from rbdyn.thermal.losses import DEGREES, HOTTEST, HeatModel
from rbdyn.thermal.network import INNER, NODES, OUTER, Boundaries, Conductances, matrix, source

if TYPE_CHECKING:
    from rbdyn.mounting.rings import MountedRings

WARMING_NODES = (*NODES, "housing", "shaft")
HOUSING, SHAFT = len(NODES), len(NODES) + 1
# Gap of a tight seat by its roughness [m]: filled with oil of 0.13 W/(m K) it conducts 1.5e5 W/(m^2 K).
ROUGHNESS = 0.87e-6
# Heat that ISO 15312 lets a seat pass, so that the seat itself conducts more than that: by this factor at least.
LEAST_SEAT = 2.0
# Tolerance of LSODA, relative and in kelvins.
TOLERANCE = 1e-7
# Rows a factor e of time, and the time from which they are so dense [s].
ROWS, FIRST = 16.0, 2.0
# Time constants of the slowest node after which a network at rest is steady: exp(-16) of 100 K are 1e-5 K.
SETTLED = 16.0
# Distance from the last temperatures that counts as steady [K]; change within a time constant that does not.
STEADY, MOVING = 1.0, 0.5
# Speed and load, over the largest of a course, below which the power laws see no further fall, or logarithms have no end.
SLOWEST, LIGHTEST = 1e-3, 1e-2
# Depth of a minimum below the ends of its column, over the span of that: less is noise of the integration.
LEAST_DIP = 1e-3
# Least and largest exponents of viscosity, speed and load.
LEAST_EXPONENTS, MOST_EXPONENTS = (0.0, 0.0, -1.0), (1.2, 4.0, 3.0)
# Spread of the exponents about their priors, over that of the logarithm of a power.
PRIOR_SPREAD = 30.0

NO_RATIOS: Mapping[str, float] = {}
# Net heat of the nodes (n,) [W] at a time [s] and temperatures (n,) [C].
NetHeat = Callable[[float, Array], Array]


class Seats(NamedTuple):
    """Conductances of the seats: outer ring to housing, inner ring to shaft [W/K]."""

    housing: float
    shaft: float


def seat(area: float, gap: float, conductivity: float, roughness: float) -> float:
    """Conductance of a seat of ``area`` [m^2] [W/K]: k A/(gap + roughness), with the radial ``gap`` [m], 0 for a tight fit.

    ``conductivity`` k of what fills it [W/(m K)]. ``roughness`` [m]: gap that a tight seat keeps.
    """
    return conductivity * area / (gap + roughness)


def seats_between(rings: "MountedRings", width: float, conductivity: float) -> Seats:
    """Conductances of both seats of rings of a width [m] at their temperatures [W/K]; oil of a conductivity fills their gaps."""
    radii = rings.outer_ring.outer_radius, rings.shaft.outer_radius
    areas = [2.0 * math.pi * radius * width for radius in radii]
    return Seats(*(seat(area, gap, conductivity, ROUGHNESS) for area, gap in zip(areas, rings.seat_gaps, strict=True)))


def capacities_of(
    rings: "MountedRings", width: float, widths: tuple[float, float], oil: float, rollers: float
) -> Array:
    """Heat capacities of ``WARMING_NODES`` [J/K] from those of ``oil`` and ``rollers``; rings have their whole width [m] between seat
    and raceway, housing and shaft count over ``widths`` of it."""
    outer, inner, housing, shaft = (
        ring.heat_capacity(width) for ring in (rings.outer_ring, rings.inner_ring, rings.housing, rings.shaft)
    )
    return np.array([oil, outer, inner, rollers, widths[0] * housing, widths[1] * shaft])


class WarmingConductances(NamedTuple):
    """Conductances between ``WARMING_NODES`` and out of them [W/K]; those of ``network`` but for the ways out of the rings."""

    flow: float
    sump: float
    oil_outer: float
    oil_inner: float
    oil_rollers: float
    outer_rollers: float
    inner_rollers: float
    outer_housing: float
    inner_shaft: float
    housing_ambient: float
    shaft_ambient: float


def warming_conductances(conductances: Conductances, seats: Seats) -> WarmingConductances:
    """Conductances of which the rings, in series with their seats, lose what they do in ``network``."""
    found = {name: value for name, value in conductances._asdict().items() if name in WarmingConductances._fields}
    for ring, part, way_out, between in (
        ("outer", "housing", conductances.outer_ambient, seats.housing),
        ("inner", "shaft", conductances.inner_ambient, seats.shaft),
    ):
        between = max(between, LEAST_SEAT * way_out)
        found[f"{ring}_{part}"] = between
        found[f"{part}_ambient"] = way_out * between / (between - way_out) if way_out else 0.0
    return WarmingConductances(**found)


class Surroundings(NamedTuple):
    """How the heat of a bearing leaves it: its conductances, those of its seats, and the temperatures around it."""

    conductances: Conductances
    seats: Seats
    boundaries: Boundaries

    @property
    def warming(self) -> WarmingConductances:
        """Conductances between ``WARMING_NODES``."""
        return warming_conductances(self.conductances, self.seats)

    def network(self, ratios: Mapping[str, float] = NO_RATIOS) -> tuple[Array, Array]:
        """``warming_network`` with conductances times ratios by name."""
        scaled = {name: ratio * getattr(self.conductances, name) for name, ratio in ratios.items()}
        varied = self._replace(conductances=self.conductances._replace(**scaled))
        return warming_network(varied.warming, self.boundaries)


def padded(of_nodes: Array) -> Array:
    """Columns of ``NODES`` as those of ``WARMING_NODES``."""
    none = np.zeros((*of_nodes.shape[:-1], len(WARMING_NODES) - len(NODES)))
    return np.concatenate((of_nodes, none), axis=-1)


def warming_network(conductances: WarmingConductances, boundaries: Boundaries) -> tuple[Array, Array]:
    """G (6, 6) [W/K] and b (6,) [W] of ``WARMING_NODES``."""
    g, couplings = conductances, np.zeros((len(WARMING_NODES),) * 2)
    inside = Conductances(
        g.flow, g.oil_outer, g.oil_inner, g.oil_rollers, g.outer_rollers, g.inner_rollers, 0.0, 0.0, g.sump
    )
    couplings[: len(NODES), : len(NODES)] = matrix(inside)
    inflow = np.append(source(inside, boundaries), [g.housing_ambient, g.shaft_ambient] * np.array(boundaries.ambient))
    for ring, part, between, outside in (
        (OUTER, HOUSING, g.outer_housing, g.housing_ambient),
        (INNER, SHAFT, g.inner_shaft, g.shaft_ambient),
    ):
        couplings[ring, ring] += between
        couplings[part, part] += between + outside
        couplings[ring, part] -= between
        couplings[part, ring] -= between
    return couplings, inflow


class Course(NamedTuple):
    """Speed and load over time, linear between ``times`` [s] and constant before and after."""

    times: Array
    speeds: Array
    loads: Array

    def at(self, time: float | Array) -> tuple[Array, Array]:
        """Speed and load at times, without a sign."""
        return np.asarray(np.interp(time, self.times, self.speeds)), np.asarray(np.interp(time, self.times, self.loads))

    def logarithms(self, time: float | Array) -> Array:
        """Logarithms of speed and load at times (..., 2)."""
        return self.logarithms_of(*self.at(time))

    def logarithms_of(self, speed: float | Array, load: float | Array) -> Array:
        """Logarithms of a speed and a load (..., 2), which a machine at rest or without load keeps finite."""
        floors = SLOWEST * self.speeds.max(), LIGHTEST * max(self.loads.max(), 1e-9)
        return np.log(np.stack([np.maximum(speed, floors[0]), np.maximum(load, floors[1])], axis=-1))


class Moment(NamedTuple):
    """A simulated moment: temperatures (6,) [C], logarithms of speed and load (2,), powers (terms,) [W], its network."""

    temperatures: Array
    course: Array
    powers: Array
    network: tuple[Array, Array]


class Law(NamedTuple):
    """Heat and network between moments (k).

    ``exponents`` (terms, 3): of viscosity, speed and load. ``films`` (terms, 6): weights of the nodes in the temperature of the
    film of a term. ``shares`` (terms, 6): of the nodes in its heat. ``log_viscosity``: at ``DEGREES``. ``reach``: ``reaches`` of
    the distances.
    """

    temperatures: Array
    courses: Array
    powers: Array
    matrices: Array
    sources: Array
    exponents: Array
    films: Array
    shares: Array
    log_viscosity: Array
    reach: tuple[Array, Array]

    def viscosities(self, temperatures: Array) -> Array:
        """Logarithm of the viscosity in each film (..., terms) at temperatures of the nodes (..., 6)."""
        return np.asarray(np.interp(temperatures @ self.films.T, DEGREES, self.log_viscosity))

    def distances(self, temperatures: Array, course: Array) -> Array:
        """Largest distance over its reach from each moment (..., k): of a film, what else the reach has, speed or load."""
        return np.maximum(*(np.abs(part).max(axis=-1) for part in self._apart(temperatures, course)))

    def weights(self, temperatures: Array, course: Array) -> Array:
        """Weights of the moments (..., k)."""
        warmer, other = ((part**2).sum(axis=-1) for part in self._apart(temperatures, course))
        squares = 1e-12 + warmer + other
        # Next to linear between two moments; beyond twice the reach the nearer ones count alone.
        near = np.exp(0.25 * (squares.min(axis=-1, keepdims=True) - squares)) / np.sqrt(squares)
        return np.asarray(near / near.sum(axis=-1, keepdims=True))

    def _apart(self, temperatures: Array, course: Array) -> tuple[Array, Array]:
        warmer = (temperatures[..., np.newaxis, :] - self.temperatures) @ self.reach[0].T
        return warmer, (course[..., np.newaxis, :] - self.courses) / self.reach[1]

    def powers_at(self, temperatures: Array, course: Array, weights: Array) -> Array:
        """Powers (..., terms) [W]."""
        changes = self.viscosities(temperatures)[..., np.newaxis, :] - self.viscosities(self.temperatures)
        growth = changes * self.exponents[:, 0] + (course[..., np.newaxis, :] - self.courses) @ self.exponents[:, 1:].T
        return np.asarray(np.einsum("...k,...kt->...t", weights, self.powers * np.exp(growth)))

    def heat(self, temperatures: Array, course: Array, running: Array | float = 1.0) -> Array:
        """Heat of the nodes (..., 6) [W]; ``running``: 0 for a machine at rest, whose power laws end above rest."""
        powers = self.powers_at(temperatures, course, self.weights(temperatures, course))
        return np.asarray(np.asarray(running)[..., np.newaxis] * (powers @ self.shares))

    def net_heat(self, course: Course) -> NetHeat:
        """Heat less what the network carries off, over a course."""

        def net(time: float, temperatures: Array) -> Array:
            speed, load = course.at(time)
            logarithms, running = course.logarithms_of(speed, load), float(speed > 0.0)
            weights = self.weights(temperatures, logarithms)
            powers = running * self.powers_at(temperatures, logarithms, weights)
            outflows = np.einsum("...knm,...m->...kn", self.matrices, temperatures) - self.sources
            heat = np.einsum("...t,...tn->...n", powers, self.shares)
            return np.asarray(heat - np.einsum("...k,...kn->...n", weights, outflows))

        return net


def law_of(moments: Sequence[Moment], model: HeatModel, reach: tuple[Array, Array]) -> Law:
    """The law through moments, with exponents ``fitted`` to them about those of a ``model``.

    A film's force follows viscosity times speed, so that its power begins with one more exponent.
    """
    losses, viscous = model.losses, model.losses.exponents
    law = Law(
        temperatures=np.array([moment.temperatures for moment in moments]),
        courses=np.array([moment.course for moment in moments]),
        powers=np.array([moment.powers for moment in moments]),
        matrices=np.array([moment.network[0] for moment in moments]),
        sources=np.array([moment.network[1] for moment in moments]),
        exponents=np.column_stack((viscous, 1.0 + viscous, np.zeros_like(viscous))),
        films=padded(losses.films),
        shares=padded(model.shares),
        log_viscosity=losses.log_viscosity,
        reach=reach,
    )
    return law._replace(exponents=fitted_exponents(law))


def fitted_exponents(law: Law) -> Array:
    """Exponents (terms, 3) of viscosity, speed and load from the moments: least squares about those of the law.

    A term without power at a moment keeps its prior. So does one whose moments do not differ.
    """
    exponents = law.exponents.copy()
    viscosities = law.viscosities(law.temperatures)
    for term in np.flatnonzero((law.powers > 0.0).all(axis=0)):
        causes = np.column_stack((viscosities[:, term], law.courses))
        causes = causes - causes.mean(axis=0)
        power = np.log(law.powers[:, term])
        missing = power - power.mean() - causes @ exponents[term]
        stacked = np.vstack((causes, np.eye(3) / PRIOR_SPREAD))
        exponents[term] += np.linalg.lstsq(stacked, np.concatenate((missing, np.zeros(3))), rcond=None)[0]
    return np.asarray(np.clip(exponents, LEAST_EXPONENTS, MOST_EXPONENTS))


class Warming(NamedTuple):
    """Temperatures (rows, ..., nodes) [C] at times (rows,) [s]."""

    times: Array
    temperatures: Array

    @property
    def is_hot(self) -> bool:
        """Whether a temperature passes what any oil bears."""
        return bool(self.temperatures.max() > HOTTEST)

    def until(self, rows: int) -> "Warming":
        """The first rows."""
        return Warming(self.times[:rows], self.temperatures[:rows])

    def until_hot(self) -> "Warming":
        """The rows up to the first above what any oil bears."""
        # An event of the solver can fail on the interpolant of LSODA, so the end is cut here.
        over = np.flatnonzero(self.temperatures.reshape(len(self.times), -1).max(axis=1) > HOTTEST)
        return self.until(int(over[0]) + 1) if over.size else self


def rows_of(end: float, breaks: Sequence[float] = ()) -> Array:
    """Times of rows [s] from 0 to ``end``: dense at the start and after each of the ``breaks``."""
    bounds = [0.0, *sorted({time for time in breaks if 0.0 < time < end}), end]
    parts = [np.zeros(1)]
    for first, last in pairwise(bounds):
        count = max(round(ROWS * np.log1p((last - first) / FIRST)), 2)
        parts.append(first + FIRST * np.expm1(np.linspace(0.0, np.log1p((last - first) / FIRST), count + 1)[1:]))
        parts[-1][-1] = last
    return np.concatenate(parts)


def integrate(
    capacities: Array,
    net: NetHeat,
    start: Array,
    end: float,
    breaks: Sequence[float] = (),
    tolerance: float = TOLERANCE,
) -> Warming:
    """Temperatures from ``start`` (..., n) [C] until ``end`` [s]: C dT/dt = net heat, by LSODA.

    ``capacities`` C (..., n) [J/K]; further axes are machines that do not meet. ``breaks``: times [s] at which the net heat has a
    kink or a step. ``tolerance``: relative, and absolute in kelvins. Raises RunError where LSODA fails.
    """
    from scipy.integrate import solve_ivp

    shape, band = np.shape(start), np.shape(start)[-1] - 1
    flat = np.array(start, dtype=np.float64).ravel()
    # Machines that do not meet have a Jacobian of blocks.
    bands = {"lband": band, "uband": band} if flat.size > band + 1 else {}

    def rise(time: float, nodes: Array) -> Array:
        return np.asarray(net(time, nodes.reshape(shape)) / capacities).ravel()

    times, found = rows_of(end, breaks), [flat[np.newaxis]]
    for first, last in pairwise([0.0, *sorted({time for time in breaks if 0.0 < time < end}), end]):
        rows = times[(times > first) & (times <= last)]
        part = solve_ivp(
            rise, (first, last), found[-1][-1], method="LSODA", t_eval=rows, rtol=tolerance, atol=tolerance, **bands
        )
        if not part.success:
            raise RunError(f"temperatures over time: the integration ends at {part.t[-1]:.3g} s: {part.message}")
        found.append(part.y.T)
    return Warming(times, np.concatenate(found).reshape(-1, *shape))


def columns(
    course: Course,
    rows: Warming,
    heat: Array,
    conductances: Array,
    figures: Mapping[str, Array],
    bands: Mapping[str, Array],
) -> dict[str, Any]:
    """Columns over time to six digits: operating point, temperatures, ``heat`` (rows, 6) of the nodes, conductances, figures, and
    bands of their ranges."""

    def short(column: Array) -> list[float]:
        return [float(f"{value:.6g}") for value in column]

    def table(names: Sequence[str], columns: Array) -> dict[str, list[float]]:
        return {name: short(column) for name, column in zip(names, columns.T, strict=True)}

    speeds, loads = course.at(rows.times)
    return {
        "time_s": short(rows.times),
        "speed_rpm": short(speeds / RPM),
        "load_N": short(loads),
        "temperatures_C": table(WARMING_NODES, rows.temperatures),
        "heat_W": table(WARMING_NODES, heat),
        "conductances_W_K": table(WarmingConductances._fields, conductances),
        "figures": {name: short(column) for name, column in figures.items()},
        "ranges": {name: tuple(short(row) for row in band) for name, band in bands.items()},
    }


def slowest(capacities: Array, couplings: Array) -> float:
    """Time constant of the slowest mode of a network [s]: infinite where a node has no way out."""
    rates = np.linalg.eigvals(couplings / capacities[:, np.newaxis]).real
    return float(1.0 / rates.min()) if rates.min() > 0.0 else np.inf


def settled_times(times: Array, table: Array, within: float) -> Array:
    """First time [s] from which all columns of the ``table`` (rows, ..., n) stay ``within`` the last ones."""
    moving = np.abs(table - table[-1]).max(axis=-1) > within
    last = len(times) - 1 - moving[::-1].argmax(axis=0)
    return np.where(moving.any(axis=0), times[np.minimum(last + 1, len(times) - 1)], times[0])


def leasts_of(times: Array, values: Array) -> tuple[Array, Array, Array]:
    """Least of each column (rows, ...), its time [s], and whether it is a minimum inside: lower than both ends by a share of the span.

    A parabola through three rows refines it.
    """
    least, place = values.min(axis=0), values.argmin(axis=0)
    inside = np.minimum(values[0], values[-1]) - least > LEAST_DIP * np.ptp(values, axis=0)
    if len(times) < 3:
        return least, times[place], inside
    middle = np.clip(place, 1, len(times) - 2)
    (t0, t1, t2), (v0, v1, v2) = (
        (times[middle + step] for step in (-1, 0, 1)),
        (np.take_along_axis(values, (middle + step)[np.newaxis], 0)[0] for step in (-1, 0, 1)),
    )
    before, after = (v1 - v0) / (t1 - t0), (v2 - v1) / (t2 - t1)
    bend = (after - before) / (t2 - t0)
    refined = inside & (v1 <= v0) & (v1 <= v2) & (bend > 0.0)
    bend = np.where(refined, bend, 1.0)
    slope = before + bend * (t1 - t0)
    shift = np.where(refined, -0.5 * slope / bend, 0.0)
    return least + shift * (slope + bend * shift), times[place] + shift, inside
