"""A cold roller bearing that warms: short simulations of a few moments, and temperatures and clearances over time between them.

The first moments are the cold machine and its steady state. Another is simulated in the first stretch of the course where a film is
15 K, a clearance 10 % of the cold one, or speed or load a factor from the nearest one; each makes the course anew
(``rbdyn.thermal.start``). Errors: the root sum of squares of what the scatter of each moment's power loss moves, and, for the
interpolation, what leaving out every other moment moves. Ranges over the inputs of the balance, with the masses of housing and
shaft, are those of as many courses.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM, InputError, RunError, given
from rbdyn.base.notes import Note, Notes, status_notes
from rbdyn.base.records import finite
from rbdyn.base.words import NORMAL, all_of
from rbdyn.clearances import DIFFERENCE
from rbdyn.dynamics.figures import POWER_LOSS
from rbdyn.dynamics.parameters.heat import loss_levels, term_shares
from rbdyn.dynamics.parameters.start import Machine, Path, Simulated, at_point, capacities, clearances_at, seats_of
from rbdyn.dynamics.parameters.state import load_distribution
from rbdyn.dynamics.parameters.validity import race_report
from rbdyn.dynamics.statistics.metrics import quantity, work_done
from rbdyn.dynamics.temperatures import Balance, Balanced, verdict_of
from rbdyn.result import (
    PRESSURE,
    SEIZING,
    SETTLING,
    START_FIGURES,
    LeastClearance,
    Quantity,
    SimulationResult,
    StartMoment,
    StartPath,
    StartResult,
)
from rbdyn.scene import Scene, input_ranges
from rbdyn.scene.thermal import Temperatures, at_temperatures, ceilings, point_before, turning_speed
from rbdyn.thermal import start as warming
from rbdyn.thermal.fixed_point import State
from rbdyn.thermal.losses import HOTTEST
from rbdyn.thermal.network import INNER, NODES, OIL, OUTER, ROLLERS

# Short simulations at most, and failures of them: next to a seizure they take long and fail.
MOST_SIMULATIONS, MOST_FAILURES = 10, 2
# Moments from which a seizure is known where each half of them gives it too.
SURE = 4
# Distances from a simulated moment at most: of a film [K], of a clearance over the cold one and at least [um], of the logarithms of
# speed and load.
FILM_REACH, CLEARANCE_REACH, LEAST_REACH, POINT_REACH = 15.0, 0.1, 2.5, 0.35
# Speed over the largest below which the power laws serve without a simulation: such heat is a tenth and less.
SLOW = 0.25
# Distance from the nearest moment, over its reach, that a note states.
FAR = 2.0
# Tolerance of courses for ranges.
ROUGH = 1e-5


class Failure(NamedTuple):
    """A moment whose simulation failed: its time [s], temperatures (6,) [C], and why."""

    time: float
    nodes: Array
    reason: str


def with_start(balanced: Balanced) -> SimulationResult:
    """The result of a scene with the start of its cold machine, or a note why there is none. Raises KeyboardInterrupt."""
    result, balance = balanced.result, balanced.balance
    try:
        start, notes, runs = _start(balanced)
    except InputError as error:
        note = Note("seizure", f"start: the cold machine cannot run: {error.faults[0]}")
        return replace(result, status=_status(result, "seizure"), notes=(note, *result.notes))
    except RunError as error:
        note = Note("failed", f"start: it cannot be computed: {error}")
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
    runs, failures, before = list[Balance](), list[Failure](), _parts_before(balance)
    machine = _machine(balance.scene, state, before[0])
    first = _first_time(machine.course)
    simulated = [_steady_moment(machine), _moment(machine, balance, runs, first, machine.cold)]
    while True:
        law = _law(machine, simulated)
        path = _path(machine, law)
        place, distance = _farthest(machine, law, path, failures)
        if _seizures(machine, law, path, simulated):
            distance = 0.0
        if distance <= 1.0 or len(runs) >= MOST_SIMULATIONS or len(failures) >= MOST_FAILURES:
            break
        time, nodes = float(path.rows.times[place]), path.rows.temperatures[place]
        try:
            simulated.append(_moment(machine, balance, runs, time, nodes))
        except (InputError, RunError) as error:
            failures.append(Failure(time, nodes, str(error).partition(";")[0]))
    start, notes = _result(machine, law, path, simulated, distance)
    return start, (*notes, *_failure_notes(failures)), [*before[1], *runs]


def _parts_before(balance: Balance) -> tuple[list[float] | None, list[Balance]]:
    """Temperatures of the parts at the start [C] where another operating point gives them, by short runs. Raises InputError, RunError."""
    scene = point_before(balance.scene)
    if scene is None:
        return None, []
    before = Balance(scene, balance.simulate)
    verdict = verdict_of(before)
    if not verdict.steady:
        raise RunError(f"the operating point before it has no steady temperatures: {verdict.status}")
    nodes = verdict.temperatures.tolist()
    return [*nodes, nodes[OUTER], nodes[INNER]], [before]


def _machine(scene: Scene, state: State, before: Sequence[float] | None) -> Machine:
    thermal, hot = given(scene.thermal), state.run.hot
    start = given(thermal.start)
    cold = np.array(before or start.temperatures(thermal.ambient_C), dtype=np.float64)
    course = start.course(turning_speed(scene.operation.speeds), scene.operation.radial_load_N)
    parts, boundaries = capacities(hot, thermal), state.model.boundaries
    matrix, _ = warming.Surroundings(state.model.conductances, seats_of(hot), boundaries).network()
    end = float(course.times[-1]) + warming.SETTLED * warming.slowest(parts, matrix)
    return Machine(scene, hot, thermal, parts, course, cold, state, boundaries, end)


def _first_time(course: warming.Course) -> float:
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
    return _simulated(machine, state, None, nodes, turning_speed(scene.operation.speeds), scene.operation.radial_load_N)


def _moment(machine: Machine, balance: Balance, runs: list[Balance], time: float, nodes: Array) -> Simulated:
    """A moment by a short simulation. Raises InputError where the bearing is impossible there, RunError."""
    speed, load = (float(value) for value in machine.course.at(time))
    at = Balance(at_point(machine.scene, speed, load), balance.simulate)
    runs.append(at)
    state = at.at(nodes[: len(NODES)], seats=(float(nodes[warming.HOUSING]), float(nodes[warming.SHAFT])))
    return _simulated(machine, state, time, nodes, speed, load)


def _simulated(
    machine: Machine, state: State, time: float | None, nodes: Array, speed: float, load: float
) -> Simulated:
    trial = state.run
    around = warming.Surroundings(trial.network.conductances, seats_of(trial.hot), machine.boundaries)
    loss = quantity(POWER_LOSS, trial.ensemble.runs, [], 0.0, 0.0)
    logarithms = machine.course.logarithms_of(speed, load)
    moment = warming.Moment(nodes, logarithms, state.model.losses.powers, around.network())
    return Simulated(moment, time, speed, load, around, (loss.statistical_error or 0.0) / loss.value)


def _law(machine: Machine, simulated: Sequence[Simulated]) -> warming.Law:
    """The law through all moments."""
    return warming.law_of([each.moment for each in simulated], machine.state.model, _reach(machine))


def _reach(machine: Machine) -> tuple[Array, Array]:
    """Changes of films and clearances by a kelvin of each node over how far a moment reaches, and the reach of speed and load."""
    middle = np.append(machine.state.temperatures, machine.state.temperatures[[OUTER, INNER]])
    nodes = np.vstack((machine.cold, middle, middle + np.eye(len(middle))))
    plays, _ = clearances_at(machine.hot, machine.thermal, nodes)
    slopes = [(play[2:] - play[1]) / max(CLEARANCE_REACH * abs(play[0]), LEAST_REACH) for play in plays.values()]
    films = warming.padded(machine.state.model.losses.films)
    rows = films[np.abs(films).sum(axis=1) > 0.0]
    return np.vstack((np.unique(rows, axis=0) / FILM_REACH, slopes)), np.full(2, POINT_REACH)


def _course_of(machine: Machine, law: warming.Law, capacities: Array, tolerance: float) -> warming.Warming:
    """Temperatures from the cold machine until the slowest node is steady, of many machines where the law has more axes."""
    start = np.broadcast_to(machine.cold, np.shape(capacities))
    breaks = machine.course.times.tolist()
    return warming.integrate(capacities, law.net_heat(machine.course), start, machine.end, breaks, tolerance)


def _path(machine: Machine, law: warming.Law) -> Path:
    """The course up to a temperature that no oil bears, or to a clearance that is lost."""
    rows = _course_of(machine, law, machine.capacities, 1e-2 * ROUGH).until_hot()
    figures, left = machine.clearances(rows)
    lost = {name: int(np.flatnonzero(play <= 0.0)[0]) for name, play in left.items() if (play <= 0.0).any()}
    seizing = min(lost, key=lost.__getitem__, default=None)
    end = len(rows.times) if seizing is None else lost[seizing] + 1
    return Path(rows.until(end), _with_lead(rows, figures, end), seizing)


def _with_lead(rows: warming.Warming, figures: Mapping[str, Array], end: int) -> dict[str, Array]:
    """Clearances and the lead of the inner ring in the first rows."""
    lead = rows.temperatures[..., INNER] - rows.temperatures[..., OUTER]
    return {name: column[:end] for name, column in {**figures, DIFFERENCE: lead}.items()}


def _farthest(machine: Machine, law: warming.Law, path: Path, failures: Sequence[Failure]) -> tuple[int, float]:
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
    machine: Machine, law: warming.Law, path: Path, simulated: Sequence[Simulated], distance: float
) -> tuple[StartResult, Notes]:
    status, reason = _verdict(machine, law, path)
    if seizures := _seizures(machine, law, path, simulated):
        reason += f", by half of the simulations after {seizures[0]:.3g} to {seizures[-1]:.3g} s"
    values, ranges = _figures(machine, path.rows, path.figures), _ranges(machine, law, path, simulated)
    settled = status in ("steady", "too hot")
    pressure, growth = _race_pressure(machine, path)
    values |= {PRESSURE: np.array(pressure), SEIZING: np.array(ranges.share_of_seizure)}
    errors = _errors(machine, law, path, simulated)
    errors[PRESSURE] = Errors(*(growth * error for error in errors["radial_um"]))
    errors[SEIZING] = Errors(_share_error(ranges.share_of_seizure), 0.0)
    figures = {
        key: Quantity(float(values[place]), *errors[place], float(len(simulated)), None)
        for key, figure in START_FIGURES.items()
        if (place := figure.name) in values and math.isfinite(values[place]) and (settled or not place.endswith("_s"))
    }
    least = {figure.name: figures[key] for key, figure in START_FIGURES.items() if key in figures}
    plays = {
        name: LeastClearance(least[name], float(values[f"{name}_time_s"]) if values[f"{name}_inside"] else None)
        for name in path.figures
        if name != DIFFERENCE
    }
    start = StartResult.from_attributes(
        ranges,
        status=status,
        reason=reason or None,
        radial_um=plays["radial_um"],
        guide_um=plays.get("guide_um"),
        pocket_um=plays["pocket_um"],
        temperature_difference_K=least[DIFFERENCE],
        time_to_steady_s=float(values[SETTLING]) if settled else None,
        race_pressure_MPa=finite(pressure),
        quantities=figures,
        capacities_J_K=dict(zip(warming.WARMING_NODES, machine.capacities.tolist(), strict=True)),
        boundaries_C=machine.boundaries._asdict(),
        moments=tuple(_record(each) for each in simulated),
        path=StartPath(**_columns(machine, law, path, simulated, ranges.bands)),
    )
    return start, tuple(_notes(machine, start, distance))


def _figures(machine: Machine, rows: warming.Warming, columns: Mapping[str, Array]) -> dict[str, Array]:
    """Figures of each machine: least clearances with their times and whether they are minima, largest lead, time to steady.

    A clearance without a minimum is least at the start, or when the machine is steady.
    """
    settled = warming.settled_times(rows.times, rows.temperatures, warming.STEADY)
    found = {SETTLING: np.maximum(settled, machine.course.times[-1])}
    for name, column in columns.items():
        if name == DIFFERENCE:
            found[name] = -warming.leasts_of(rows.times, -column)[0]
            continue
        found[name], time, inside = warming.leasts_of(rows.times, column)
        found[f"{name}_inside"] = inside
        found[f"{name}_time_s"] = np.where(inside, time, np.where(column[0] <= column[-1], 0.0, found[SETTLING]))
    return found


def _verdict(machine: Machine, law: warming.Law, path: Path) -> tuple[str, str]:
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
    operating = turning_speed(operation.speeds), operation.radial_load_N
    ends_there = tuple(machine.course.at(times[-1])) == operating
    gap = float(np.abs(nodes[-1, : len(NODES)] - machine.state.temperatures).max())
    if ends_there and gap > warming.STEADY:
        return (
            "undecided",
            f"it ends {gap:.0f} K from the steady state, since {MOST_SIMULATIONS} short simulations are too few",
        )
    parts = {"oil": nodes[:, OIL], "cage": nodes[:, ROLLERS] + machine.thermal.cage_offset_K}
    for part, ceiling in ceilings(machine.scene).items():
        if (over := np.flatnonzero(parts[part] > ceiling)).size:
            return "too hot", f"after {times[over[0]]:.3g} s the {part} passes its ceiling of {ceiling:g} C"
    imbalance = law.net_heat(machine.course)(float(times[-1]), nodes[-1]) / machine.capacities
    if np.abs(imbalance).max() * warming.slowest(machine.capacities, law.matrices[0]) > warming.MOVING:
        return "undecided", f"{at} the temperatures still move"
    return "steady", ""


class Errors(NamedTuple):
    """Statistical error of a figure, and that of the interpolation between moments."""

    statistical: float
    numerical: float


def _halves(simulated: Sequence[Simulated]) -> list[list[Simulated]]:
    """Moments without every other one of those in between, the odd or the even ones; without any in between the steady state alone."""
    ends, between = simulated[:2], sorted(simulated[2:], key=lambda each: each.time or 0.0)
    return [[*ends, *between[place::2]] for place in (0, 1)] if between else [[*ends[:1]]]


def _seizures(machine: Machine, law: warming.Law, path: Path, simulated: Sequence[Simulated]) -> list[float]:
    """Moments [s] at which a part seizes by all moments and by each half of them; none unless all agree that it does."""
    if len(simulated) < SURE or _verdict(machine, law, path)[0] != "seizure":
        return []
    laws = [_law(machine, half) for half in _halves(simulated)]
    paths = [(law, path), *((each, _path(machine, each)) for each in laws)]
    agreed = all(_verdict(machine, *each)[0] == "seizure" for each in paths)
    return sorted(float(each.rows.times[-1]) for _, each in paths) if agreed else []


def _errors(machine: Machine, law: warming.Law, path: Path, simulated: Sequence[Simulated]) -> dict[str, Errors]:
    """Errors of each figure.

    Statistical: root sum of squares of what the scatter of each moment's power moves. Interpolation: the larger change by leaving
    out every other moment in between, the odd or the even ones, with exponents fitted to the others alone. These have twice the
    spacing, so that a method of first order moves by its own error and one of second order by three times that. Of a least or largest
    value it is the largest change of its column until then, for that at one time may vanish by chance, and no such value moves by more.
    """
    scatter = np.diag([each.scatter for each in simulated])
    powers = law.powers * (1.0 + scatter[:, :, np.newaxis])
    many = np.broadcast_to(machine.capacities, (len(simulated), len(warming.WARMING_NODES)))
    (base, columns), (moved, _) = (
        _rough(machine, *changed) for changed in ((law, machine.capacities), (law._replace(powers=powers), many))
    )
    coarse = [_rough(machine, _law(machine, half), machine.capacities) for half in _halves(simulated)]

    def change(name: str, other: dict[str, Array], over_time: dict[str, Array]) -> float:
        if name not in columns:
            return abs(float(other[name] - base[name]))
        both = np.array([columns[name], over_time[name]])[:, : len(path.rows.times)]
        until = (both.argmax(axis=1) if name == DIFFERENCE else both.argmin(axis=1)).max()
        return float(np.abs(both[1] - both[0])[: until + 1].max())

    return {
        name: Errors(float(np.sqrt(((moved[name] - value) ** 2).sum())), max(change(name, *each) for each in coarse))
        for name, value in base.items()
        if not name.endswith("_inside")
    }


def _share_error(share: float) -> float:
    """Half-width of the 95 % interval of a share of ``SETS`` (Agresti and Coull)."""
    count = input_ranges.SETS + 4.0
    middle = (share * input_ranges.SETS + 2.0) / count
    return NORMAL * math.sqrt(middle * (1.0 - middle) / count)


def _rough(machine: Machine, law: warming.Law, capacities: Array) -> tuple[dict[str, Array], dict[str, Array]]:
    """Figures of each machine that does not end early, and its columns over time."""
    rows = _course_of(machine, law, capacities, ROUGH)
    columns = _with_lead(rows, machine.clearances(rows)[0], len(rows.times))
    return _figures(machine, rows, columns), columns


def _ranges(machine: Machine, law: warming.Law, path: Path, simulated: Sequence[Simulated]) -> input_ranges.StartRanges:
    """Ranges over the inputs of the balance and the masses of housing and shaft."""
    scene, hot = machine.scene, machine.hot
    levels = loss_levels(hot, machine.state.run.bearing)
    sets = input_ranges.input_sets(
        scene, levels, [] if scene.uncertain is None else scene.uncertain.estimated, input_ranges.STARTING
    )
    varied = list(input_ranges.varied_inputs(machine.thermal, sets, levels))
    many = input_ranges.law_of_sets(law, [each.around for each in simulated], varied, partial(term_shares, hot))
    rows = _course_of(machine, many, np.array([capacities(hot, thermal) for thermal, *_ in varied]), ROUGH)
    plays, left = machine.clearances(rows, input_ranges.together([thermal for thermal, *_ in varied]))
    figures = _with_lead(rows, plays, len(rows.times))
    seizing = np.any([(play <= 0.0).any(axis=0) for play in left.values()], axis=0)
    seizing = seizing | (rows.temperatures.max(axis=(0, 2)) > HOTTEST)
    found = _figures(machine, rows, figures)
    minima = {name: float(np.mean(found.pop(f"{name}_inside"))) for name in plays}
    ranges = {name: tuple(np.quantile(column, input_ranges.QUANTILES).tolist()) for name, column in found.items()}
    bands = input_ranges.bands_of(rows, figures, len(path.rows.times))
    return input_ranges.StartRanges(ranges, bands, tuple(sets), float(np.mean(seizing)), minima)


def _race_pressure(machine: Machine, path: Path) -> tuple[float, float]:
    """Largest pressure of the races under their static loads where the radial clearance is least [MPa], and its change by 1 um of that.

    NaN and 0 where the bearing is impossible there.
    """
    row = int(path.figures["radial_um"].argmin())
    speed, load = (float(value) for value in machine.course.at(path.rows.times[row]))
    point = at_point(machine.scene, max(speed, SLOW * machine.course.speeds.max()), load)
    found = list[tuple[float, float]]()
    for warmer in (0.0, 1.0):
        nodes = path.rows.temperatures[row] + warmer * np.eye(len(warming.WARMING_NODES))[INNER]
        try:
            hot = at_temperatures(
                point, Temperatures(*nodes[: len(NODES)].tolist()), tuple(nodes[len(NODES) :].tolist())
            )
        except InputError:
            return math.nan, 0.0
        # Contact laws and rollers are those of the steady state: only the raceways move.
        bearing, raceways = machine.state.run.bearing, hot.geometry.raceways
        races = (
            race._replace(radius=radius) for race, radius in zip((bearing.outer, bearing.inner), raceways, strict=True)
        )
        loads = load_distribution(hot, bearing._replace(**dict(zip(("outer", "inner"), races, strict=True))), load)
        report = race_report(hot, float(loads.inner.max()), float(loads.outer.max()))
        pressure = max((race.max_pressure_MPa for race in report.values()), default=0.0)
        found.append((pressure, 1e6 * hot.geometry.clearance))
    (pressure, play), (other, tighter) = found
    return pressure, abs((other - pressure) / (tighter - play)) if tighter != play else 0.0


def _record(each: Simulated) -> StartMoment:
    nodes = dict(zip(warming.WARMING_NODES, each.moment.temperatures.tolist(), strict=True))
    return StartMoment(each.time, each.speed / RPM, each.load, nodes, float(each.moment.powers.sum()))


def _columns(
    machine: Machine, law: warming.Law, path: Path, simulated: Sequence[Simulated], bands: Mapping[str, Array]
) -> dict[str, Any]:
    times, nodes = path.rows.times, path.rows.temperatures
    speeds, _ = machine.course.at(times)
    logarithms = machine.course.logarithms(times)
    heat = law.heat(nodes, logarithms, (speeds > 0.0).astype(float))
    conductances = law.weights(nodes, logarithms) @ np.array([each.around.warming for each in simulated])
    return warming.columns(machine.course, path.rows, heat, conductances, path.figures, bands)


def _failure_notes(failures: Sequence[Failure]) -> Notes:
    if not failures:
        return ()
    times = all_of(f"{failure.time:.3g} s" for failure in failures)
    sentence = (
        f"start: simulations after {times} failed, so that their neighbours give the heat there; {failures[0].reason}"
    )
    return (Note("lost-runs", sentence),)


def _notes(machine: Machine, start: StartResult, distance: float) -> Iterator[Note]:
    yield from status_notes(f"{start.status}: start: {start.reason}" if start.reason else start.status)
    yield from start.lost_clearance if machine.scene.bearing.radial_clearance > 0.0 else ()
    yield from start.seizure_notes("a part")
    if distance > FAR:
        sentence = (
            f"start: after {MOST_SIMULATIONS} short simulations some moments are {distance:.2g} times as far apart as intended; the errors "
            "of its results include that"
        )
        yield Note("numerical-error", sentence)
