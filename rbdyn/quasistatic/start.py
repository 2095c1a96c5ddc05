"""A cold row of balls that warms: temperatures, clearance, axial load and contact pressure over time.

SKF's friction has no scatter, so the heat of every moment is that of its own equilibrium, and the course is exact but for the tolerance
of its integration (``rbdyn.thermal.start``). A machine of another input of the balance would need a course of its own: there the
heat is interpolated between moments of this course and, in a second round, of those that its neighbours reach.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, RunError, given
from rbdyn.base.notes import Note, Notes, status_notes
from rbdyn.clearances import DIFFERENCE
from rbdyn.life.friction import NO_AXIAL_LOAD
from rbdyn.quasistatic.result import BallResult, Rating, pressures, reference_capacities
from rbdyn.quasistatic.row.model import clearance_of
from rbdyn.quasistatic.temperatures import Heat, heat_at, starvation_note, static_capacity_of, term_shares
from rbdyn.result import GreatestValue, LeastClearance, Quantity, StartPath, StartResult
from rbdyn.scene import input_ranges
from rbdyn.scene.ball import SingleRowScene
from rbdyn.scene.fits import mounted_of, row_change
from rbdyn.scene.operation import raceway_radii
from rbdyn.scene.thermal import Temperatures, Thermal, oil_ceiling, part_temperatures, turning_speed
from rbdyn.thermal import start as warming
from rbdyn.thermal.fixed_point import Search
from rbdyn.thermal.losses import COLDEST, HOTTEST
from rbdyn.thermal.network import INNER, NODES, OIL, OUTER, cavity_volume

# Figures whose largest value counts.
AXIAL = "axial_load_N"
LOADS = (AXIAL, "contact_pressure_MPa")
GREATEST = (DIFFERENCE, *LOADS)
# Changes of the oil [K], of the clearance [um], and of the logarithms of speed and load within reach of a moment of a range; moments.
FILM_REACH, CLEARANCE_REACH, POINT_REACH, MOST_MOMENTS = 15.0, 2.5, 0.35, 16
# Tolerance of the course that states the error, and of those of ranges.
ROUGH, ROUGHEST = 1e-5, 1e-3
# Temperatures above what any oil bears over which a machine of a range stops to warm [K].
HELD = 10.0
# Half of the difference of temperatures that gives the slopes of the net heat [K].
STEP = 0.01


class Here(NamedTuple):
    """A machine at a moment: its heat, what is ``around`` it, network, and figures by name."""

    heat: Heat
    around: warming.Surroundings
    network: tuple[Array, Array]
    figures: dict[str, float]

    def net(self, nodes: Array) -> Array:
        """Heat of the nodes less what the network carries off (6,) [W], that of a machine at rest too."""
        matrix, inflow = self.network
        return warming.padded(self.heat.heat) + inflow - matrix @ nodes


class Machine(NamedTuple):
    """What stays over a start: scene, capacities (6,) [J/K], course, temperatures at the start (6,) [C], the last state of the search
    for the steady one, and the time after which the slowest node is steady [s]."""

    scene: SingleRowScene
    thermal: Thermal
    capacities: Array
    course: warming.Course
    cold: Array
    search: Search
    end: float

    def at(self, time: float, nodes: Array) -> Here:
        """The machine at a time and temperatures (6,). Raises InputError where it has no equilibrium or is overloaded."""
        speed, load = (float(value) for value in self.course.at(time))
        least = warming.SLOWEST * float(self.course.speeds.max())
        found = heat_at(at_point(self.scene, max(speed, least), load), nodes[: len(NODES)], _seat_nodes(nodes))
        if speed == 0.0:
            found = found._replace(powers=np.zeros_like(found.powers))
        rating = Rating(self.scene.bearing, found.model, reference_capacities(self.scene.bearing), (0.0, 0.0))
        axial, small = found.loads.axial, NO_AXIAL_LOAD * static_capacity_of(found.scene, found.model)
        figures = {
            "radial_um": 1e6 * clearance_of(found.model.row)[0],
            DIFFERENCE: float(nodes[INNER] - nodes[OUTER]),
            AXIAL: float(f"{axial:.9g}") if axial > small else 0.0,
            "contact_pressure_MPa": 1e-6 * max(pressures(found.solution, rating).values()),
        }
        around = _surroundings(found)
        return Here(found, around, around.network(), figures)

    def warmed(self, tolerance: float) -> warming.Warming:
        """Temperatures until the slowest node is steady, or one passes what any oil bears."""
        last = np.zeros(len(warming.WARMING_NODES))

        def net(time: float, nodes: Array) -> Array:
            # Beyond an impossible bearing the heat stays, so that the integration ends; rows from there on are cut.
            nonlocal last
            share = _held(nodes)
            if share:
                # Trial steps of a slow course overshoot to temperatures at which no oil is stated.
                with suppress(InputError):
                    last = self.at(time, np.maximum(nodes, COLDEST)).net(nodes)
            return last * share

        return warming.integrate(
            self.capacities, net, self.cold, self.end, self.course.times.tolist(), tolerance
        ).until_hot()


def _held(nodes: Array) -> Array:
    """Share of the net heat (..., 1) that warms a machine: it ends over ``HELD``, so that what runs away stays there without a step."""
    return np.clip(1.0 - (nodes.max(axis=-1, keepdims=True) - HOTTEST) / HELD, 0.0, 1.0)


class Path(NamedTuple):
    """The course of a machine with its state and figures in each row, until it is impossible by the ``fault``, if it is."""

    rows: warming.Warming
    here: list[Here]
    figures: dict[str, Array]
    fault: str

    def extreme(self, name: str, step: int = 1) -> tuple[float, float, bool]:
        """As ``leasts_of``, or the largest of ``GREATEST``; of each ``step``-th row."""
        sign = -1.0 if name in GREATEST else 1.0
        value, time, inside = warming.leasts_of(self.rows.times[::step], sign * self.figures[name][::step])
        return sign * float(value), float(time), bool(inside)


def with_start(scene: SingleRowScene, search: Search, result: BallResult, ranged: bool) -> BallResult:
    """The result of a scene with the start of its cold machine, or with a status where this is impossible from the first moment.

    A start that cannot be integrated leaves the result as it is, with a note.
    """
    assert result.notes is not None or not result.is_equilibrium
    try:
        start, notes = _start(scene, search, ranged)
    except InputError as error:
        return replace(result, status=f"seizure: start: the cold machine: {error.faults[0]}", report=None, rows=())
    except RunError as error:
        failed = Note("failed", f"start: it cannot be computed: {error}")
        return replace(result, notes=None if result.notes is None else (failed, *result.notes))
    result = replace(result, start=start, notes=None if result.notes is None else (*notes, *result.notes))
    if result.status != "ok" or start.status not in ("seizure", "too hot", "no steady state"):
        return result
    return replace(result, status=f"{start.status}: start: {start.reason}", report=None, rows=())


def at_point(scene: SingleRowScene, speed: float, load: float) -> SingleRowScene:
    """The scene at another speed [rad/s] and radial load [N]; both rings keep their ratio, and the load its direction."""
    operation, ratio = scene.operation, speed / turning_speed(scene.operation.speeds)
    x, y, z = operation.load_N or (operation.radial_load_N or 0.0, 0.0, operation.axial_load_N or 0.0)
    radial = math.hypot(x, y)
    keys: dict[str, Any] = {
        f"{ring}_speed_rpm": ratio * getattr(operation, f"{ring}_speed_rpm") for ring in ("inner", "outer")
    }
    if load != radial:
        across = [x * load / radial, y * load / radial] if radial else [load, 0.0]
        keys |= {"radial_load_N": None, "axial_load_N": None, "load_N": [*across, z]}
    return scene.model_copy(update={"operation": operation.model_copy(update=keys)})


def _seat_nodes(nodes: Array) -> tuple[float, float]:
    return float(nodes[warming.HOUSING]), float(nodes[warming.SHAFT])


def _surroundings(heat: Heat) -> warming.Surroundings:
    rings, width = given(mounted_of(heat.scene)), given(given(heat.scene.mounting).width)
    seats = warming.seats_between(rings, width, given(heat.scene.lubricant).in_service.conductivity)
    return warming.Surroundings(heat.conductances, seats, heat.boundaries)


def capacities(hot: SingleRowScene, widths: tuple[float, float]) -> Array:
    """Heat capacities of ``WARMING_NODES`` [J/K]; the model has no cage. The oil fills the cavity of a bath, else its fraction of it."""
    rings, lubricant, width, row = mounted_of(hot), given(hot.lubricant), given(given(hot.mounting).width), hot.bearing
    ball, oil, (inner, outer) = hot.material("ball"), lubricant.in_service, raceway_radii(row)
    volume = math.pi * row.ball_diameter**3 / 6.0
    cavity = cavity_volume((outer, inner), width, row.balls, volume, 0.0)
    fill = 1.0 if lubricant.supply == "bath" else lubricant.oil_fraction
    balls = row.balls * volume * ball.density * ball.heat_capacity
    return warming.capacities_of(given(rings), width, widths, fill * cavity * oil.density * oil.heat_capacity, balls)


def _machine(scene: SingleRowScene, search: Search) -> Machine:
    thermal, found = given(scene.thermal), search.last.run
    start = given(thermal.start)
    cold = np.array(start.temperatures(thermal.ambient_C), dtype=np.float64)
    course = start.course(turning_speed(scene.operation.speeds), math.hypot(*scene.operation.load[:2]))
    parts = capacities(found.scene, start.widths)
    matrix, _ = _surroundings(found).network()
    end = float(course.times[-1]) + warming.SETTLED * warming.slowest(parts, matrix)
    return Machine(scene, thermal, parts, course, cold, search, end)


def _start(scene: SingleRowScene, search: Search, ranged: bool) -> tuple[StartResult, Notes]:
    """The start with its notes. Raises InputError where the cold bearing is impossible."""
    machine = _machine(scene, search)
    path = _path(machine, warming.TOLERANCE)
    status, reason = _verdict(machine, path)
    found = {name: path.extreme(name) for name in path.figures}
    errors = _errors(machine, path)
    quantities = {name: Quantity(found[name][0], 0.0, errors[name], float(len(path.here)), None) for name in found}
    times = {name: time if inside else None for name, (_, time, inside) in found.items()}
    ranges = _ranges(machine, path) if ranged else input_ranges.StartRanges({}, {}, (), 0.0)
    settled = max(
        warming.settled_times(path.rows.times, path.rows.temperatures, warming.STEADY), machine.course.times[-1]
    )
    conductances = np.array([here.around.warming for here in path.here])
    heat = np.array([warming.padded(here.heat.heat) for here in path.here])
    columns = warming.columns(machine.course, path.rows, heat, conductances, path.figures, ranges.bands)
    start = StartResult.from_attributes(
        ranges,
        status=status,
        reason=reason or None,
        radial_um=LeastClearance(quantities["radial_um"], times["radial_um"]),
        temperature_difference_K=quantities[DIFFERENCE],
        axial_load_N=GreatestValue(quantities[AXIAL], times[AXIAL]) if AXIAL in quantities else None,
        contact_pressure_MPa=GreatestValue(quantities["contact_pressure_MPa"], times["contact_pressure_MPa"]),
        time_to_steady_s=float(settled) if status in ("steady", "too hot") else None,
        race_pressure_MPa=None,
        capacities_J_K=dict(zip(warming.WARMING_NODES, machine.capacities.tolist(), strict=True)),
        boundaries_C=search.last.run.boundaries._asdict(),
        moments=(),
        path=StartPath(**columns),
    )
    return start, tuple(_notes(path, start))


def _path(machine: Machine, tolerance: float) -> Path:
    """The course of a machine. Raises InputError where it is impossible from the first moment."""
    rows, here, fault = machine.warmed(tolerance), list[Here](), ""
    for time, nodes in zip(rows.times, rows.temperatures, strict=True):
        try:
            here.append(machine.at(float(time), nodes))
        except InputError as error:
            fault = str(error.faults[0])
            break
    if not here:
        raise InputError([fault])
    figures = {name: np.array([each.figures[name] for each in here]) for name in here[0].figures}
    if not figures[AXIAL].any():
        del figures[AXIAL]
    return Path(rows.until(len(here)), here, figures, fault)


def _gain(machine: Machine, time: float, nodes: Array) -> float:
    """Gain of heat and temperature at a moment: above one a small rise grows. Infinite next to an impossible bearing."""
    try:
        slopes = [
            (machine.at(time, nodes + step).net(nodes + step) - machine.at(time, nodes - step).net(nodes - step))
            / (2.0 * STEP)
            for step in STEP * np.eye(len(nodes))
        ]
    except InputError:
        return math.inf
    matrix, _ = machine.at(time, nodes).network
    return float(np.linalg.eigvals(np.eye(len(nodes)) + np.linalg.solve(matrix, np.array(slopes).T)).real.max())


def _runaway(machine: Machine, path: Path) -> str:
    """When and why heat grows faster than it leaves until the end of a course; empty where it does not."""
    row = len(path.here)
    while row > 0 and _gain(machine, float(path.rows.times[row - 1]), path.rows.temperatures[row - 1]) > 1.0:
        row -= 1
    if row == len(path.here):
        return ""
    here = path.here[row].figures
    return (
        f"the preload runs away: from {path.rows.times[row]:.3g} s on the thermal loop gain is above 1. There the inner ring is "
        f"{here[DIFFERENCE]:.0f} K over the outer one and a contact has {here['contact_pressure_MPa']:.0f} MPa; "
    )


def _verdict(machine: Machine, path: Path) -> tuple[str, str]:
    """Status of a start, and why it is not steady."""
    times, nodes = path.rows.times, path.rows.temperatures
    if path.fault:
        return "seizure", f"{_runaway(machine, path)}after {times[-1]:.3g} s {path.fault}"
    if path.rows.is_hot:
        runaway = _runaway(machine, path)
        reason = f"{runaway}after {times[-1]:.3g} s a temperature passes what any oil bears"
        return "seizure" if runaway else "no steady state", reason
    operating = turning_speed(machine.scene.operation.speeds), math.hypot(*machine.scene.operation.load[:2])
    ends_there = tuple(machine.course.at(times[-1])) == operating
    gap = float(np.abs(nodes[-1, : len(NODES)] - machine.search.last.temperatures).max())
    ceiling = oil_ceiling(machine.thermal, given(machine.scene.lubricant))
    if (over := np.flatnonzero(nodes[:, OIL] > ceiling)).size:
        return "too hot", f"after {times[over[0]]:.3g} s the oil passes its ceiling of {ceiling:g} C"
    if ends_there and machine.search.status == "steady" and gap > warming.STEADY:
        return "undecided", f"it ends {gap:.0f} K from the steady state of the first guess, so the balance has several"
    last = path.here[-1]
    imbalance = last.net(nodes[-1]) / machine.capacities
    if np.abs(imbalance).max() * warming.slowest(machine.capacities, last.network[0]) > warming.MOVING:
        return "undecided", f"after {times[-1]:.3g} s the temperatures still move"
    return "steady", ""


def _errors(machine: Machine, path: Path) -> dict[str, float]:
    """Error of each extreme: what a rougher integration and every second row change."""
    rough = _path(machine, ROUGH)
    return {
        name: abs(rough.extreme(name)[0] - path.extreme(name)[0])
        + abs(path.extreme(name, 2)[0] - path.extreme(name)[0])
        for name in path.figures
    }


def radial_clearance(hot: SingleRowScene, thermal: Thermal, nodes: Array) -> Array:
    """Diametral clearance [um] at temperatures (..., 6) [C] and the speed of a scene at stated temperatures."""
    at = Temperatures(*np.moveaxis(nodes[..., : len(NODES)], -1, 0))
    keys = part_temperatures(thermal, at, cage=False, seats=(nodes[..., warming.HOUSING], nodes[..., warming.SHAFT]))
    change = row_change(hot.model_copy(update={"mounting": given(hot.mounting).model_copy(update=keys)}))
    row, angle = hot.bearing, hot.bearing.contact_angle
    between = row.groove_centre_distance
    radial = between * math.cos(angle) + row.interference_m + change.radial
    return np.asarray(2e6 * (between + change.inner_reach + change.outer_reach - radial))


def _reach(machine: Machine) -> tuple[Array, Array]:
    """Changes of oil and clearance by a kelvin of each node over how far a moment reaches, and the reach of speed and load."""
    middle = np.append(machine.search.last.temperatures, machine.search.last.temperatures[[OUTER, INNER]])
    plays = radial_clearance(
        machine.search.last.run.scene, machine.thermal, np.vstack((middle, middle + np.eye(len(middle))))
    )
    return np.vstack((np.eye(len(middle))[OIL] / FILM_REACH, (plays[1:] - plays[0]) / CLEARANCE_REACH)), np.full(
        2, POINT_REACH
    )


def _cover(places: Array, taken: Array, most: int) -> list[int]:
    """Rows of ``places`` (P, n), at most some, after which none is farther than 1 from all of those and of the ``taken`` (k, n)."""
    chosen = list[int]()
    apart = np.full(len(places), np.inf)
    for each in taken:
        apart = np.minimum(apart, np.abs(places - each).max(axis=1))
    while len(chosen) < most and apart.max() > 1.0:
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.abs(places - places[chosen[-1]]).max(axis=1))
    return chosen


class Moments(NamedTuple):
    """Moments of the power laws with their place among oil, clearance, speed and load, and places that are impossible."""

    here: list[Here]
    moments: list[warming.Moment]
    places: list[Array]
    impossible: list[Array]

    def add(self, machine: Machine, time: float, nodes: Array, place: Array) -> None:
        """A moment at a time and temperatures of another machine."""
        try:
            here = machine.at(time, nodes)
        except InputError:
            self.impossible.append(place)
            return
        self.here.append(here)
        self.moments.append(warming.Moment(nodes, machine.course.logarithms(time), here.heat.powers, here.network))
        self.places.append(place)


def _ranges(machine: Machine, path: Path) -> input_ranges.StartRanges:
    """Ranges over the inputs of the balance and the masses of housing and shaft.

    The first moments are those of the course; the courses of the input sets add as many as they need.
    """
    scene, reach = machine.scene, _reach(machine)
    sets = input_ranges.input_sets(scene, (), (), input_ranges.STARTING)
    varied = list(input_ranges.varied_inputs(machine.thermal, sets, {}))
    moments = Moments([], [], [], [])
    rows, of_sets = path.rows.temperatures[:, np.newaxis], path.rows
    for most in (MOST_MOMENTS // 2, MOST_MOMENTS):
        flat = rows.reshape(-1, len(warming.WARMING_NODES))
        times = np.repeat(of_sets.times, rows.shape[1])
        logarithms = machine.course.logarithms(times)
        places = np.hstack((np.minimum(flat, HOTTEST) @ reach[0].T, logarithms / reach[1]))
        taken = np.array([*moments.places, *moments.impossible]).reshape(-1, places.shape[1])
        for place in _cover(places, taken, most - len(taken)):
            moments.add(machine, float(times[place]), np.minimum(flat[place], HOTTEST), places[place])
        law = warming.law_of(moments.moments, machine.search.last.model, reach)
        law = input_ranges.law_of_sets(law, [here.around for here in moments.here], varied, partial(term_shares, scene))
        of_sets = _many(machine, law, varied)
        rows = of_sets.temperatures
    thermals = [thermal for thermal, *_ in varied]
    figures = _clearances_of_sets(machine, of_sets, thermals)
    largest, impossible = _loads_of_sets(machine, law, moments, of_sets, figures, thermals)
    seizing = impossible | (rows.max(axis=(0, 2)) > HOTTEST)
    bands = input_ranges.bands_of(of_sets, figures, len(path.rows.times))
    found = input_ranges.course_ranges(of_sets, figures)
    found |= {name: tuple(np.nanquantile(column, input_ranges.QUANTILES).tolist()) for name, column in largest.items()}
    return input_ranges.StartRanges(found, bands, tuple(sets), float(np.mean(seizing)))


def _many(machine: Machine, law: warming.Law, varied: Sequence[Any]) -> warming.Warming:
    """Courses of the input sets."""
    hot = machine.search.last.run.scene
    parts = np.array([capacities(hot, thermal.start.widths) for thermal, *_ in varied])
    start, breaks = np.broadcast_to(machine.cold, parts.shape), machine.course.times.tolist()
    net = law.net_heat(machine.course)

    return warming.integrate(
        parts, lambda time, nodes: net(time, nodes) * _held(nodes), start, machine.end, breaks, ROUGHEST
    )


def _clearances_of_sets(machine: Machine, rows: warming.Warming, thermals: Sequence[Thermal]) -> dict[str, Array]:
    """Clearances [um] and leads of the inner ring [K] (rows, sets)."""
    hot, speeds = machine.search.last.run.scene, machine.course.at(rows.times)[0]
    lag = machine.thermal.model_copy(update={"shaft_lag": np.array([thermal.shaft_lag for thermal in thermals])})
    still = hot.model_copy(update={"mounting": hot.mounting.model_copy(update={"rotation": False})})
    turning, resting = (radial_clearance(scene, lag, rows.temperatures) for scene in (hot, still))
    ratios = (speeds / turning_speed(hot.operation.speeds))[:, np.newaxis]
    lead = rows.temperatures[..., INNER] - rows.temperatures[..., OUTER]
    return {"radial_um": resting + (turning - resting) * ratios**2, DIFFERENCE: lead}


def _loads_of_sets(
    machine: Machine,
    law: warming.Law,
    moments: Moments,
    rows: warming.Warming,
    figures: Mapping[str, Array],
    thermals: Sequence[Thermal],
) -> tuple[dict[str, Array], Array]:
    """Largest axial loads and pressures (sets,), and which sets have no equilibrium: each solved where the moments, the clearance and the
    end of its course let one expect the largest."""
    weights = law.weights(rows.temperatures, machine.course.logarithms(rows.times)[:, np.newaxis])
    expected = [weights @ np.array([here.figures[name] for here in moments.here]) for name in LOADS]
    last = len(rows.times) - 1
    found, impossible = np.full((len(LOADS), len(thermals)), np.nan), np.zeros(len(thermals), dtype=bool)
    for place, thermal in enumerate(thermals):
        varied = machine._replace(scene=machine.scene.model_copy(update={"thermal": thermal}))
        least = int(figures["radial_um"][:, place].argmin())
        for row in {least, last, *(int(column[:, place].argmax()) for column in expected)}:
            nodes = rows.temperatures[row, place]
            try:
                here = varied.at(float(rows.times[row]), np.minimum(nodes, HOTTEST))
            except InputError:
                impossible[place] = True
                continue
            found[:, place] = np.fmax(found[:, place], [here.figures[name] for name in LOADS])
    return {
        name: column for name, column in zip(LOADS, found, strict=True) if np.nan_to_num(column).max() > 0.0
    }, impossible


def _notes(path: Path, start: StartResult) -> Iterator[Note]:
    yield from status_notes(f"{start.status}: start: {start.reason}" if start.reason else start.status)
    yield from start.seizure_notes("the bearing")
    if path.here[0].heat.scene.bearing.kind == "deep_groove_ball":
        yield from start.lost_clearance
    yield from starvation_note(path.here[0].heat.scene, f"start at {path.rows.temperatures[0, OIL]:.4g} C")
