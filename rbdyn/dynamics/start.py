"""A cold roller bearing that warms: short simulations of a few moments, and temperatures and clearances over time between them.

The first moments are the cold machine and its steady state. Another is simulated in the first stretch of the course where a film is
15 K, a clearance 10 % of the cold one, or speed or load a factor from the nearest one; each makes the course anew
(``rbdyn.thermal.start``). Errors: the root sum of squares of what the scatter of each moment's power loss moves, and, for the
interpolation, the sum of what leaving out each moment in between moves. Ranges over the inputs of the balance, with the masses of
housing and shaft, are those of as many courses.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM, InputError, RunError
from rbdyn.base.notes import Note, Notes, status_notes
from rbdyn.clearances import DIFFERENCE
from rbdyn.dynamics.figures import POWER_LOSS
from rbdyn.dynamics.parameters.heat import loss_levels, term_shares
from rbdyn.dynamics.parameters.start import at_point, capacities, clearances_at, seats_of, turning_speed
from rbdyn.dynamics.parameters.state import load_distribution
from rbdyn.dynamics.parameters.validity import race_report
from rbdyn.dynamics.statistics.metrics import quantity, work_done
from rbdyn.dynamics.temperatures import Balance, Balanced
from rbdyn.result import LeastClearance, Quantity, SimulationResult, StartMoment, StartResult
from rbdyn.scene import Scene
from rbdyn.scene.input_ranges import QUANTILES, STARTING, course_ranges, input_sets, varied_inputs
from rbdyn.scene.thermal import Temperatures, Thermal, at_temperatures, ceilings
from rbdyn.thermal.fixed_point import State
from rbdyn.thermal.losses import HOTTEST
from rbdyn.thermal.network import INNER, NODES, OIL, OUTER, ROLLERS, Boundaries, Conductances
from rbdyn.thermal.start import (
    HOUSING,
    MOVING,
    SETTLED,
    SHAFT,
    STEADY,
    WARMING_NODES,
    Course,
    Law,
    Moment,
    Seats,
    Warming,
    columns,
    law_of,
    least_of,
    settling_time,
    slowest,
    warming,
    warming_conductances,
    warming_network,
)

# Short simulations at most, and failures of them: next to a seizure they take long and fail.
MOST_SIMULATIONS, MOST_FAILURES = 10, 2
# Distances from a simulated moment at most: of a film [K], of a clearance over the cold one and at least [um], of the logarithms of
# speed and load.
FILM_REACH, CLEARANCE_REACH, LEAST_REACH, POINT_REACH = 15.0, 0.1, 2.5, 0.35
# Speed over the largest below which the power laws serve without a simulation: such heat is a tenth and less.
SLOW = 0.25
# Distance from the nearest moment, over its reach, that a note states.
FAR = 2.0
# Tolerance of courses for ranges.
ROUGH = 1e-5


class Simulated(NamedTuple):
    """A simulated moment: the ``moment`` of the law, its time [s], speed [rad/s], load [N], conductances, and its power's error."""

    moment: Moment
    time: float | None
    speed: float
    load: float
    conductances: Conductances
    seats: Seats
    scatter: float


class Failure(NamedTuple):
    """A moment whose simulation failed: its time [s], temperatures (6,) [C], and why."""

    time: float
    nodes: Array
    reason: str


class Machine(NamedTuple):
    """What stays over a start: scene, scene at temperatures, capacities (6,) [J/K], course, temperatures at the start (6,), state.

    ``end``: time after which the slowest node is steady [s].
    """

    scene: Scene
    hot: Scene
    thermal: Thermal
    capacities: Array
    course: Course
    cold: Array
    state: State
    boundaries: Boundaries
    end: float

    def clearances(self, rows: Warming, thermal: Thermal | None = None) -> tuple[dict[str, Array], dict[str, Array]]:
        """Clearances [um] by name over time, and what is left of those that may not be lost."""
        speeds = self.course.at(rows.times)[0] / turning_speed(self.scene)
        ratios = speeds.reshape(-1, *[1] * (rows.temperatures.ndim - 2))
        return clearances_at(self.hot, thermal or self.thermal, rows.temperatures, ratios)


class Path(NamedTuple):
    """A course of temperatures with its clearances [um] and the lead of the inner ring [K] by name, until a part seizes.

    ``seizing``: the clearance that is lost at the end, if any.
    """

    rows: Warming
    figures: dict[str, Array]
    seizing: str | None

    def least(self, name: str) -> tuple[float, float, bool]:
        """As ``least_of``; of the lead of the inner ring, the largest."""
        if name != DIFFERENCE:
            return least_of(self.rows.times, self.figures[name])
        value, time, inside = least_of(self.rows.times, -self.figures[name])
        return -value, time, inside


def with_start(balanced: Balanced) -> SimulationResult:
    """The result of a scene with the start of its cold machine, or a note why there is none. Raises KeyboardInterrupt."""
    result, balance = balanced.result, balanced.balance
    try:
        start, notes, runs = _start(balanced)
    except InputError as error:
        note = Note("seizure", f"start: the cold machine: {error.faults[0]}")
        return replace(result, status=_status(result, "seizure"), notes=(note, *result.notes))
    except RunError as error:
        note = Note("failed", f"start: the cold machine: {error}")
        return replace(result, notes=(note, *result.notes))
    cost = {**result.cost, **work_done([*balance.runs, *(run for each in runs for run in each.runs)])}
    turns = balance.turns + sum(each.turns for each in runs)
    clock = {key: cost[key] + sum(getattr(each, key) for each in runs) for key in ("wall_s", "compile_s")}
    return replace(
        result,
        start=start,
        status=_status(result, start.status),
        notes=(*notes, *result.notes),
        cost={**cost, **clock, "turns": turns, "states": result.cost["states"] + len(start.moments) - 1},
    )


def _status(result: SimulationResult, start: str) -> str:
    """Status of a result whose machine may not survive its start."""
    return start if result.status == "ok" and start in ("seizure", "too hot", "no steady state") else result.status


def _start(balanced: Balanced) -> tuple[StartResult, Notes, list[Balance]]:
    """The start with its notes, and the balances that simulated for it. Raises InputError where the cold bearing is impossible."""
    balance, state = balanced.balance, balanced.path[-1]
    machine = _machine(balance.scene, state)
    runs, failures = list[Balance](), list[Failure]()
    first = _first_time(machine.course)
    simulated = [_steady_moment(machine), _moment(machine, balance, runs, first, machine.cold)]
    while True:
        law = _law(machine, simulated)
        path = _path(machine, law)
        place, distance = _farthest(machine, law, path, failures)
        if distance <= 1.0 or len(runs) >= MOST_SIMULATIONS or len(failures) >= MOST_FAILURES:
            break
        time, nodes = float(path.rows.times[place]), path.rows.temperatures[place]
        try:
            simulated.append(_moment(machine, balance, runs, time, nodes))
        except (InputError, RunError) as error:
            failures.append(Failure(time, nodes, str(error).partition(";")[0]))
    start, notes = _result(machine, law, path, simulated, distance)
    return start, (*notes, *_failure_notes(failures)), runs


def _machine(scene: Scene, state: State) -> Machine:
    thermal, hot = scene.thermal, state.run.hot
    assert thermal is not None and thermal.start is not None
    start = thermal.ambient_C if thermal.start.from_C is None else thermal.start.from_C
    cold = np.array(thermal.start.from_parts_C or [start] * len(WARMING_NODES), dtype=np.float64)
    course = thermal.start.course(turning_speed(scene), scene.operation.radial_load_N)
    parts, boundaries = capacities(hot, thermal), state.model.boundaries
    whole, _ = warming_network(warming_conductances(state.model.conductances, seats_of(hot)), boundaries)
    end = float(course.times[-1]) + SETTLED * slowest(parts, whole)
    return Machine(scene, hot, thermal, parts, course, cold, state, boundaries, end)


def _first_time(course: Course) -> float:
    """First time at which the machine is fast enough for a simulation [s]."""
    fast = np.flatnonzero(course.speeds >= SLOW * course.speeds.max())[0]
    if fast == 0:
        return 0.0
    times, speeds = course.times[fast - 1 : fast + 1], course.speeds[fast - 1 : fast + 1]
    return float(np.interp(SLOW * course.speeds.max(), speeds, times))


def _steady_moment(machine: Machine) -> Simulated:
    """The steady state, which is simulated already, as a moment."""
    scene, state = machine.scene, machine.state
    nodes = np.append(state.temperatures, [state.temperatures[OUTER], state.temperatures[INNER]])
    return _simulated(machine, state, None, nodes, turning_speed(scene), scene.operation.radial_load_N)


def _moment(machine: Machine, balance: Balance, runs: list[Balance], time: float, nodes: Array) -> Simulated:
    """A moment by a short simulation. Raises InputError where the bearing is impossible there, RunError."""
    speed, load = (float(value) for value in machine.course.at(time))
    at = Balance(at_point(machine.scene, speed, load), balance.simulate)
    runs.append(at)
    state = at.at(nodes[: len(NODES)], seats=(float(nodes[HOUSING]), float(nodes[SHAFT])))
    return _simulated(machine, state, time, nodes, speed, load)


def _simulated(
    machine: Machine, state: State, time: float | None, nodes: Array, speed: float, load: float
) -> Simulated:
    trial = state.run
    conductances, seats = trial.network.conductances, seats_of(trial.hot)
    loss = quantity(POWER_LOSS, trial.ensemble.runs, [], 0.0, 0.0)
    network = warming_network(warming_conductances(conductances, seats), machine.boundaries)
    logarithms = machine.course.logarithms_of(speed, load)
    moment = Moment(nodes, logarithms, state.model.losses.powers, network)
    return Simulated(moment, time, speed, load, conductances, seats, (loss.statistical_error or 0.0) / loss.value)


def _law(machine: Machine, simulated: Sequence[Simulated]) -> Law:
    """The law through all moments. A film's force follows viscosity times speed, so that its power begins with one more exponent."""
    model = machine.state.model
    viscous = model.losses.exponents
    priors = np.column_stack((viscous, 1.0 + viscous, np.zeros_like(viscous)))
    films = _padded(model.losses.films)
    moments = [each.moment for each in simulated]
    return law_of(moments, films, _padded(model.shares), model.losses.log_viscosity, priors, _reach(machine, films))


def _padded(of_nodes: Array) -> Array:
    """Columns of ``NODES`` as those of ``WARMING_NODES``."""
    none = np.zeros((*of_nodes.shape[:-1], len(WARMING_NODES) - len(NODES)))
    return np.concatenate((of_nodes, none), axis=-1)


def _reach(machine: Machine, films: Array) -> tuple[Array, Array]:
    """Changes of films and clearances by a kelvin of each node over how far a moment reaches, and the reach of speed and load."""
    middle = np.append(machine.state.temperatures, machine.state.temperatures[[OUTER, INNER]])
    nodes = np.vstack((machine.cold, middle, middle + np.eye(len(middle))))
    plays, _ = clearances_at(machine.hot, machine.thermal, nodes)
    slopes = [(play[2:] - play[1]) / max(CLEARANCE_REACH * abs(play[0]), LEAST_REACH) for play in plays.values()]
    rows = films[np.abs(films).sum(axis=1) > 0.0]
    return np.vstack((np.unique(rows, axis=0) / FILM_REACH, slopes)), np.full(2, POINT_REACH)


def _course_of(machine: Machine, law: Law, capacities: Array, tolerance: float) -> Warming:
    """Temperatures from the cold machine until the slowest node is steady, of many machines where the law has more axes."""
    start = np.broadcast_to(machine.cold, np.shape(capacities))
    breaks = machine.course.times.tolist()
    return warming(capacities, law.net_heat(machine.course), start, machine.end, breaks, tolerance)


def _path(machine: Machine, law: Law) -> Path:
    """The course up to a temperature that no oil bears, or to a clearance that is lost."""
    rows = _course_of(machine, law, machine.capacities, 1e-2 * ROUGH).until_hot()
    figures, left = machine.clearances(rows)
    lost = {name: int(np.flatnonzero(play <= 0.0)[0]) for name, play in left.items() if (play <= 0.0).any()}
    seizing = min(lost, key=lost.__getitem__, default=None)
    end = len(rows.times) if seizing is None else lost[seizing] + 1
    return Path(rows.until(end), _with_lead(rows, figures, end), seizing)


def _with_lead(rows: Warming, figures: Mapping[str, Array], end: int) -> dict[str, Array]:
    """Clearances and the lead of the inner ring in the first rows."""
    lead = rows.temperatures[..., INNER] - rows.temperatures[..., OUTER]
    return {name: column[:end] for name, column in {**figures, DIFFERENCE: lead}.items()}


def _farthest(machine: Machine, law: Law, path: Path, failures: Sequence[Failure]) -> tuple[int, float]:
    """The row to simulate next, among those fast enough for it, and how far the farthest row is from its nearest moment.

    It is the farthest one of the first rows out of reach, up to twice the reach: what follows rests on extrapolation. Rows in reach of a simulation that failed do not count.
    """
    times, nodes = path.rows.times, path.rows.temperatures
    course = machine.course.logarithms(times)
    apart = law.distances(nodes, course).min(axis=-1)
    for failure in failures:
        alone = law._replace(
            temperatures=failure.nodes[np.newaxis], courses=machine.course.logarithms(failure.time)[np.newaxis]
        )
        apart = np.where(alone.distances(nodes, course)[:, 0] <= 1.0, 0.0, apart)
    speeds = machine.course.at(times)[0]
    apart = np.where(speeds >= SLOW * speeds.max(), apart, 0.0)
    beyond = apart > 1.0
    first = int(beyond.argmax())
    stretch = apart[first : first + int(np.append(~beyond[first:], True).argmax())]
    twice = np.flatnonzero(stretch > 2.0)
    return first + (int(twice[0]) if twice.size else int(stretch.argmax()) if stretch.size else 0), float(apart.max())


def _result(
    machine: Machine, law: Law, path: Path, simulated: Sequence[Simulated], distance: float
) -> tuple[StartResult, Notes]:
    times, steady = path.rows.times, path.rows.temperatures[-1]
    status, reason = _verdict(machine, law, path)
    errors = _errors(machine, law, path, simulated)
    values = {name: path.least(name) for name in path.figures}
    quantities = {name: Quantity(values[name][0], *errors[name], float(len(simulated)), None) for name in path.figures}
    after = machine.course.times[-1]
    settled = settling_time(times, path.rows.temperatures, steady, STEADY) if status in ("steady", "too hot") else None
    plays = {
        name: LeastClearance(quantities[name], values[name][1] if values[name][2] else None)
        for name in path.figures
        if name != DIFFERENCE
    }
    ranges = _ranges(machine, law, path, simulated)
    start = StartResult(
        status=status,
        reason=reason or None,
        radial_um=plays["radial_um"],
        guide_um=plays.get("guide_um"),
        pocket_um=plays["pocket_um"],
        temperature_difference_K=quantities[DIFFERENCE],
        time_to_steady_s=None if settled is None else max(settled, float(after)),
        race_pressure_MPa=_race_pressure(machine, path),
        ranges=ranges.figures,
        inputs=ranges.inputs,
        share_of_seizure=ranges.seizing,
        capacities_J_K=dict(zip(WARMING_NODES, machine.capacities.tolist(), strict=True)),
        boundaries_C=machine.boundaries._asdict(),
        moments=tuple(_record(each) for each in simulated),
        path=_columns(machine, law, path, simulated, ranges.bands),
    )
    return start, _notes(machine, start, distance)


def _verdict(machine: Machine, law: Law, path: Path) -> tuple[str, str]:
    """Status of a start, and why it is not steady."""
    times, nodes = path.rows.times, path.rows.temperatures
    at = f"after {times[-1]:.3g} s"
    if path.seizing is not None:
        return "seizure", f"{at} the {path.seizing} clearance of the cage is lost"
    if path.rows.is_hot:
        if path.figures["radial_um"][-1] < 0.0:
            return "seizure", f"{at} the radial clearance is lost and the heat runs away"
        return "no steady state", f"{at} a temperature passes what any oil bears"
    operation = machine.scene.operation
    ends_there = tuple(machine.course.at(times[-1])) == (turning_speed(machine.scene), operation.radial_load_N)
    gap = float(np.abs(nodes[-1, : len(NODES)] - machine.state.temperatures).max())
    if ends_there and gap > STEADY:
        return (
            "undecided",
            f"it ends {gap:.0f} K from the steady state, since {MOST_SIMULATIONS} short simulations are too few",
        )
    parts = {"oil": nodes[:, OIL], "cage": nodes[:, ROLLERS] + machine.thermal.cage_offset_K}
    for part, ceiling in ceilings(machine.scene).items():
        if (over := np.flatnonzero(parts[part] > ceiling)).size:
            return "too hot", f"after {times[over[0]]:.3g} s the {part} passes its ceiling of {ceiling:g} C"
    rest = law.net_heat(machine.course)(float(times[-1]), nodes[-1]) / machine.capacities
    if np.abs(rest).max() * slowest(machine.capacities, law.matrices[0]) > MOVING:
        return "undecided", f"{at} the temperatures still move"
    return "steady", ""


def _errors(
    machine: Machine, law: Law, path: Path, simulated: Sequence[Simulated]
) -> dict[str, tuple[float | None, float | None]]:
    """Statistical and numerical error of each figure: by the scatter of the moments, and without each of those in between."""
    scatter = np.diag([each.scatter for each in simulated])
    powers = law.powers * (1.0 + scatter[:, :, np.newaxis])
    many = np.broadcast_to(machine.capacities, (len(simulated), len(WARMING_NODES)))
    moved = _extremes(machine, law._replace(powers=powers), many)
    base = _extremes(machine, law, machine.capacities)
    fewer = [_extremes(machine, law.without(place), machine.capacities) for place in range(2, len(simulated))]
    errors = dict[str, tuple[float | None, float | None]]()
    for name, value in base.items():
        statistical = float(np.sqrt(((moved[name] - value) ** 2).sum()))
        errors[name] = statistical, math.fsum(abs(float(other[name] - value)) for other in fewer)
    return errors


def _extremes(machine: Machine, law: Law, capacities: Array) -> dict[str, Array]:
    """Least clearances and the largest lead of each machine."""
    rows = _course_of(machine, law, capacities, ROUGH)
    figures = _with_lead(rows, machine.clearances(rows)[0], len(rows.times))
    return {name: column.max(axis=0) if name == DIFFERENCE else column.min(axis=0) for name, column in figures.items()}


class InputRanges(NamedTuple):
    """Ranges of figures, bands of columns over time (two rows each), the inputs, and the share of the sets that seize."""

    figures: dict[str, tuple[float, ...]]
    bands: dict[str, Array]
    inputs: tuple[str, ...]
    seizing: float


def _ranges(machine: Machine, law: Law, path: Path, simulated: Sequence[Simulated]) -> InputRanges:
    """Ranges over the inputs of the balance and the masses of housing and shaft."""
    scene, hot = machine.scene, machine.hot
    levels = loss_levels(hot, machine.state.run.bearing)
    sets = input_sets(scene, levels, [] if scene.uncertain is None else scene.uncertain.estimated, STARTING)
    varied = list(varied_inputs(machine.thermal, sets, levels))
    dry, wet = (_padded(term_shares(hot, share)) for share in (0.0, 1.0))
    networks = [[_varied_network(machine, each, ratios) for each in simulated] for _, ratios, _ in varied]
    many = law._replace(
        powers=law.powers * np.array([level for *_, level in varied])[:, np.newaxis, :],
        shares=np.array([dry + thermal.film_share_to_oil * (wet - dry) for thermal, *_ in varied]),
        matrices=np.array([[whole for whole, _ in row] for row in networks]),
        sources=np.array([[inflow for _, inflow in row] for row in networks]),
    )
    rows = _course_of(machine, many, np.array([capacities(hot, thermal) for thermal, *_ in varied]), ROUGH)
    keys = {name: np.array([getattr(each, name) for each, *_ in varied]) for name in ("shaft_lag", "cage_offset_K")}
    plays, left = machine.clearances(rows, machine.thermal.model_copy(update=keys))
    figures = _with_lead(rows, plays, len(rows.times))
    nodes = dict(zip(WARMING_NODES, np.moveaxis(rows.temperatures, -1, 0), strict=True))
    bands = {
        name: np.quantile(column, [QUANTILES[0], QUANTILES[-1]], axis=1)[:, : len(path.rows.times)]
        for name, column in {**nodes, **figures}.items()
    }
    seizing = np.any([(play <= 0.0).any(axis=0) for play in left.values()], axis=0)
    seizing = seizing | (rows.temperatures.max(axis=(0, 2)) > HOTTEST)
    return InputRanges(course_ranges(rows, figures), bands, tuple(sets), float(np.mean(seizing)))


def _varied_network(machine: Machine, each: Simulated, ratios: Mapping[str, float]) -> tuple[Array, Array]:
    """Network of a moment with conductances times ratios."""
    scaled = {name: ratio * getattr(each.conductances, name) for name, ratio in ratios.items()}
    conductances = warming_conductances(each.conductances._replace(**scaled), each.seats)
    return warming_network(conductances, machine.boundaries)


def _race_pressure(machine: Machine, path: Path) -> float | None:
    """Largest pressure of the races under their static loads where the radial clearance is least [MPa]; None where some is left."""
    from rbdyn.dynamics.parameters.model import roller_bearing

    column = path.figures["radial_um"]
    row = int(column.argmin())
    if column[row] > 0.0:
        return None
    speed, load = (float(value) for value in machine.course.at(path.rows.times[row]))
    nodes = path.rows.temperatures[row]
    point = at_point(machine.scene, max(speed, SLOW * machine.course.speeds.max()), load)
    seats = float(nodes[HOUSING]), float(nodes[SHAFT])
    try:
        hot = at_temperatures(point, Temperatures(*nodes[: len(NODES)].tolist()), seats)
    except InputError:
        return None
    loads = load_distribution(hot, roller_bearing(hot), hot.operation.largest_load_N)
    report = race_report(hot, float(loads.inner.max()), float(loads.outer.max()))
    return max((race["max_pressure_MPa"] for race in report.values()), default=None)


def _record(each: Simulated) -> StartMoment:
    nodes = dict(zip(WARMING_NODES, each.moment.temperatures.tolist(), strict=True))
    return StartMoment(each.time, each.speed / RPM, each.load, nodes, float(each.moment.powers.sum()))


def _columns(
    machine: Machine, law: Law, path: Path, simulated: Sequence[Simulated], bands: Mapping[str, Array]
) -> dict[str, Any]:
    times, nodes = path.rows.times, path.rows.temperatures
    speeds, _ = machine.course.at(times)
    logarithms = machine.course.logarithms(times)
    heat = law.heat(nodes, logarithms, (speeds > 0.0).astype(float))
    of_moments = [warming_conductances(each.conductances, each.seats) for each in simulated]
    conductances = law.weights(nodes, logarithms) @ np.array(of_moments)
    return columns(machine.course, path.rows, heat, conductances, path.figures, bands)


def _failure_notes(failures: Sequence[Failure]) -> Notes:
    if not failures:
        return ()
    times = " and ".join(f"{failure.time:.3g} s" for failure in failures)
    sentence = (
        f"start: simulations after {times} failed, so that their neighbours give the heat there; {failures[0].reason}"
    )
    return (Note("lost-runs", sentence),)


def _notes(machine: Machine, start: StartResult, distance: float) -> Notes:
    notes = list(status_notes(f"{start.status}: start: {start.reason}" if start.reason else start.status))
    notes += start.lost_clearance if machine.scene.bearing.radial_clearance > 0.0 else ()
    if start.status == "steady" and start.share_of_seizure > 0.0:
        share = f"{100.0 * start.share_of_seizure:.0f} % of the input sets ({', '.join(start.inputs)})"
        notes.append(Note("undecided", f"start: a part seizes in {share}"))
    if distance > FAR:
        sentence = (
            f"start: after {MOST_SIMULATIONS} short simulations some moments are {distance:.2g} times as far apart as meant; the errors "
            "of its figures count that"
        )
        notes.append(Note("numerical-error", sentence))
    return tuple(notes)
