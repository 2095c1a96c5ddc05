"""A roller bearing at the temperatures that its own friction keeps up: heat balance, simulation and clearances in one loop.

A state is a set of temperatures of oil, rings and rollers. The scene at these temperatures is simulated, the network carries off
the heat of the losses, and the temperatures that this gives are compared with those assumed (``rbdyn.thermal.fixed_point``). Short
runs come first; a run of the scene's own length at the end gives the figures, whose temperatures it also corrects by the last
small step. Temperatures are steady only if the heat of that run balances within its error. All runs have the seed of the scene.

Errors of the temperatures are those of the heat, divided by 1 - dM/dT of the loop, as for any other figure: each temperature is
a weighted sum of the losses. The gain of the loop comes from two more short runs, with all nodes 5 K warmer and with the inner
ring alone 5 K warmer; where it is near one, the other nodes follow. Ranges over the documented inputs of the balance, which are
far wider than these errors, follow from 256 sets of the model of the search with the slopes measured there.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError, RunError, given
from rbdyn.base.notes import Note, Notes, status_notes, status_of
from rbdyn.dynamics.ensemble import Reporter
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.parameters import heat
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.part_figures import at_temperatures_with_errors
from rbdyn.dynamics.recording import Ensemble
from rbdyn.dynamics.run import with_numerics
from rbdyn.dynamics.statistics.error_bars import drifting, slow_change
from rbdyn.dynamics.statistics.metrics import quantity, work_done
from rbdyn.dynamics.statistics.replicate import Replicate, Statistic, mean
from rbdyn.result import HeatBalance, Quantity, Ranges, SimulationResult
from rbdyn.scene import Scene
from rbdyn.scene.input_ranges import input_ranges, together
from rbdyn.scene.notes import heat_notes
from rbdyn.scene.thermal import Temperatures, Thermal, at_temperatures, inlet_temperature, part_temperatures, too_hot
from rbdyn.thermal.fixed_point import CLEAR, TOLERANCE, VAGUE, State, learned, model_of, next_step, steady_state
from rbdyn.thermal.losses import HOTTEST, HeatModel, gain, log_viscosity, no_residue
from rbdyn.thermal.network import NODES, carried_off

POWER_LOSS = "power_loss_W"
# Replicates of a short run, and its counted turns as a share of those of the scene.
SHORT_REPLICATES, SHORT_SHARE = 2, 0.2
# Short states of a search at least: two for the balance, and two for the gain of its loop.
SHORT_STATES = 4
# Usual short simulations of a start.
START_STATES = 5
# Warmer nodes of the runs that measure the gain [K].
WARMER = 5.0
# Rise of all nodes by the heat [K], up to which the losses of one state serve elsewhere, and solutions of the network that follow.
SLIGHT, SLIGHT_STEPS = 1.0, 3
# Gain from which all nodes are measured, and random sets of noise that give its error.
DOUBTFUL, NOISES = 0.7, 64
# Runs of the scene's own length at most: the last deviates by less than the tolerance after one or two.
MOST_WHOLE_RUNS = 4
# Share of the last step that counts as error: its slopes of about 0.3 are known within a third.
LAST_STEP = 0.1

# A search from a similar bearing finds the temperatures in the turns that do not count: usual and least turns of a part, most
# further parts, the share of the first and of another part that counts in it, and turns that do not count after a small step.
PART_TURNS, LEAST_PART, MORE_PARTS, LATE_SHARES, RESUMED_TURNS = 10.0, 4.0, 2, (0.4, 0.7), 3.0
# Steps [K] of such a search: up to which the bearings are similar, and from which its slopes serve.
SIMILAR, SMALL = 25.0, 3.0
# Deviation [K] up to which its last step corrects the temperatures and the loss without another run: a tenth of it is an error.
CORRECTED = 1.0

# Simulates a scene by its parameters, from given states if any: replicates, and the time that they took.
Simulate = Callable[[Scene, RollerBearing, Reporter, Sequence[Array]], tuple[Ensemble, dict[str, float]]]
# The result of simulated replicates.
Gather = Callable[[Scene, Ensemble, dict[str, float]], SimulationResult]


class Trial(NamedTuple):
    """A simulated state: the scene at its temperatures, its parameters and network, and its replicates with their time [s]."""

    hot: Scene
    bearing: RollerBearing
    network: heat.Network
    ensemble: Ensemble
    clock: dict[str, float]


def temperature_figures(state: Array, network: heat.Network, slopes: Array) -> list[Statistic]:
    """Steady temperature of each node [C] as a statistic of the replicates of a state (4,).

    T + (1 - dM/dT)^-1 (M - T), with M = offset + weights times the powers. With slopes of 0 it is M, which balances the heat.
    """
    response = np.linalg.inv(np.eye(len(state)) - slopes)
    constants = state + response @ (network.offset - state)
    return [
        _weighted(weights, constant) for weights, constant in zip(response @ network.weights, constants, strict=True)
    ]


def _weighted(weights: Array, constant: float) -> Statistic:
    """Constant plus weighted sum of the mean powers."""

    def moments(run: Replicate) -> Array:
        return np.column_stack((run.durations, run.work @ weights + constant * run.durations))[run.first :]

    return Statistic(moments, mean)


def powers_of(runs: Sequence[Replicate]) -> Array:
    """Mean powers [W] in the order of ``POWER_TERMS`` and what follows there."""
    work = np.sum([run.work[run.first :].sum(axis=0) for run in runs], axis=0)
    return np.asarray(work / sum(run.duration for run in runs))


def short(scene: Scene) -> Scene:
    """The scene with runs long enough for its heat alone."""
    numerics = scene.numerics
    return with_numerics(
        scene,
        turns=max(SHORT_SHARE * numerics.turns, min(numerics.turns, 5.0)),
        replicates=min(SHORT_REPLICATES, numerics.replicates),
        companion=False,
        extend=False,
        whirl_cutoff_hz=None,
        whirl_notches_hz=[],
    )


def short_turns(scene: Scene, threads: int = 1) -> tuple[float, float]:
    """Shaft turns of the short runs of a search that each thread makes one after the other, and those of one run."""
    if scene.thermal is not None and scene.thermal.near is not None:
        parts, length = _parts(scene)
        more = parts * length + RESUMED_TURNS - scene.numerics.warm_up_turns
        return math.ceil(scene.numerics.replicates / threads) * more, length
    few = short(scene).numerics
    length = few.warm_up_turns + few.turns
    states = SHORT_STATES + (0 if scene.thermal is None or scene.thermal.start is None else START_STATES)
    return states * math.ceil(few.replicates / threads) * length, length


class Balance:
    """Map from temperatures to those that balance their heat, by short runs or by those of the scene."""

    def __init__(self, scene: Scene, simulate: Simulate) -> None:
        self.scene, self.simulate, self.thermal = scene, simulate, given(scene.thermal)
        self.compile_s, self.wall_s = 0.0, 0.0
        self.viscosity = log_viscosity(scene.lubricant.at)
        self.runs: list[Replicate] = []

    @property
    def turns(self) -> float:
        """Shaft turns of all runs, short ones included."""
        return sum(float(run.durations.sum()) for run in self.runs) / self.scene.turn_s

    @property
    def cold(self) -> Array:
        """Temperatures before any heat [C]."""
        return np.full(len(NODES), inlet_temperature(self.thermal, self.scene.lubricant))

    def at(
        self,
        temperatures: Array,
        cut: Callable[[Scene], Scene] = short,
        progress: Reporter = None,
        seats: tuple[float, float] | None = None,
        starts: Sequence[Array] = (),
    ) -> State:
        """The state, by the runs of a ``cut`` scene. Raises InputError where it is impossible, RunError, KeyboardInterrupt.

        ``starts``: states where the replicates begin, if any. ``seats``: temperatures of housing and shaft where these do not follow their rings at once [C].
        """
        hot = at_temperatures(self.scene, Temperatures(*temperatures.tolist()), seats)
        # The numerics of a short run change no parameter, and tables of traction take a quarter of a second.
        bearing = roller_bearing(hot)
        network = heat.network_of(hot, self.thermal, bearing)
        ensemble, clock = self.simulate(cut(hot), bearing, progress, starts)
        self.compile_s += clock["compile_s"]
        self.wall_s += clock["wall_s"]
        self.runs += [*ensemble.runs, *ensemble.companions]
        flat = np.zeros((len(NODES), len(NODES)))
        figures = [
            quantity(figure, ensemble.runs, [], 0.0, 0.0) for figure in temperature_figures(temperatures, network, flat)
        ]
        image = np.array([figure.value for figure in figures])
        noise = np.array([figure.statistical_error or 0.0 for figure in figures])
        model = heat.heat_model(hot, network, temperatures, powers_of(ensemble.runs), self.viscosity)
        return State(temperatures, image, noise, model, Trial(hot, bearing, network, ensemble, clock))

    def slight(self, state: State) -> State | None:
        """The balance of a heat that warms no node by 1 K, from the losses of a state and networks without a simulation; else None."""
        model, nodes = state.model, state.model.balanced()
        for _ in range(SLIGHT_STEPS):
            if model.rise(nodes) > SLIGHT:
                return None
            try:
                hot = at_temperatures(self.scene, Temperatures(*nodes.tolist()))
                model = model._replace(
                    conductances=heat.network_of(hot, self.thermal, roller_bearing(hot)).conductances
                )
            except InputError:
                return None
            nodes = model.balanced()
        return State(nodes, nodes, state.noise, model)


def measured_slopes(balance: Balance, state: State, near: HeatModel) -> tuple[Array, float]:
    """Slopes after more short runs next to a state, and the error of their gain (95 %).

    Where the heat warms no node by 5 K the estimate serves: such heat cannot run away. Else all nodes are moved, then the inner
    ring alone; the other nodes follow where the gain is near one. A warmer ring that makes the bearing impossible is replaced by a
    colder one.
    """
    slopes = near._replace(residue=no_residue()).image_slopes(state.temperatures)
    if near.rise(state.temperatures) < WARMER:
        return slopes, 0.0
    alone = np.eye(len(NODES))
    inner = NODES.index("inner")
    steps, changes, noises = list[Array](), list[Array](), list[Array]()
    for place, direction in enumerate((np.ones(len(NODES)), alone[inner], *np.delete(alone, inner, axis=0)[1:])):
        if place == 2 and gain(learned(slopes, np.array(steps), np.array(changes)) if steps else slopes) < DOUBTFUL:
            break
        for step in (WARMER * direction, -WARMER * direction):
            try:
                moved = balance.at(np.minimum(state.temperatures + step, HOTTEST))
            except InputError:
                continue
            steps.append(moved.temperatures - state.temperatures)
            changes.append(moved.image - state.image)
            noises.append(np.hypot(moved.noise, state.noise))
            break
    taken = [place for place, step in enumerate(steps) if np.abs(step).max() > 0.5 * WARMER]
    if not taken:
        return slopes, 0.0
    moves, seen, noise = (np.array(rows)[taken] for rows in (steps, changes, noises))
    generator = np.random.default_rng(balance.scene.numerics.seed)
    gains = [
        gain(learned(slopes, moves, seen + 0.5 * noise * generator.normal(size=seen.shape))) for _ in range(NOISES)
    ]
    return learned(slopes, moves, seen), 2.0 * float(np.std(gains))


def corrected(state: State, slopes: Array) -> Array:
    """Steady temperatures [C] by one Newton step from a state, not colder than the surroundings and not hotter than any oil."""
    step = np.linalg.solve(np.eye(len(NODES)) - slopes, state.deviation)
    return np.asarray(np.clip(state.temperatures + step, state.model.coldest, HOTTEST))


class Verdict(NamedTuple):
    """What short runs say: status and reason of the search, slopes dM/dT, states visited, and where to run at length [C].

    ``ends``: last states of the replicates, from which these go on; empty where the run at length begins anew.
    """

    status: str
    reason: str
    slopes: Array
    path: list[State]
    temperatures: Array
    ends: Sequence[Array] = ()

    @property
    def steady(self) -> bool:
        """Whether there is a steady state."""
        return self.status == "steady"


def verdict_of(balance: Balance) -> Verdict:
    """Search by short runs, and the gain of the loop where it ends.

    Raises InputError where the bearing is impossible even at the temperature of its surroundings, RunError, KeyboardInterrupt.
    """
    first = np.full(len(NODES), balance.scene.lubricant.temperature_C)
    search = steady_state(
        balance.at,
        first,
        balance.cold,
        lambda state, near: measured_slopes(balance, state, near),
        estimate=balance.slight,
    )
    last = search.last
    temperatures = corrected(last, search.slopes) if search.status == "steady" else last.temperatures
    return Verdict(search.status, search.reason, search.slopes, [*search.states], temperatures)


def near_verdict(balance: Balance) -> Verdict | None:
    """Search from the balance of a similar bearing by the turns of all replicates that do not count; None where it is not similar.

    Replicates go on from part to part of their transient, at temperatures that follow from the part before.
    """
    near = balance.thermal.near
    if near is None:
        return None
    slopes, temperatures, path, ends = np.array(near.slopes), np.array(near.temperatures_C), list[State](), ()
    parts, length = _parts(balance.scene)
    for part in range(parts + MORE_PARTS):
        try:
            state = balance.at(temperatures, partial(_part, length, LATE_SHARES[min(part, 1)]), starts=ends)
        except (InputError, RunError):
            return None
        if (
            path
            and CLEAR * max(state.noise.max(), 1e-9) < np.abs(step := state.temperatures - path[-1].temperatures).max()
        ):
            slopes = learned(slopes, step, state.image - path[-1].image)
        if gain(slopes) >= DOUBTFUL or state.noise.max() > VAGUE:
            return None
        path.append(state)
        temperatures = np.minimum(
            state.temperatures + next_step(state.model.with_image_slopes(slopes), state, None), HOTTEST
        )
        ends, size = state.run.ensemble.ends, np.abs(temperatures - state.temperatures).max()
        if size > SIMILAR:
            return None
        if part + 1 >= parts and size < SMALL:
            return Verdict("steady", "", slopes, path, temperatures, ends)
    return None


def _parts(scene: Scene) -> tuple[int, float]:
    """Number and turns of the parts of a search from a similar bearing.

    One part and the turns after its step are the turns that do not count. A transient of more parts is slow, and goes on after the last step.
    """
    turns = scene.numerics.warm_up_turns
    number = max(round(turns / PART_TURNS), 1)
    return number, turns / number if number > 1 else max(turns - RESUMED_TURNS, LEAST_PART)


def _part(length: float, late: float, scene: Scene) -> Scene:
    """The scene with runs of a part of so many turns, of which the share ``late`` counts."""
    counted = {"turns": late * length, "discard_turns": (1.0 - late) * length}
    return with_numerics(short(scene), **counted, replicates=scene.numerics.replicates)


def _resumed(scene: Scene) -> Scene:
    """The scene with runs that go on from settled states."""
    return with_numerics(scene, discard_turns=min(RESUMED_TURNS, scene.numerics.warm_up_turns))


class Balanced(NamedTuple):
    """A result at steady temperatures, or at the last possible ones, with its balance and the states visited."""

    result: SimulationResult
    balance: Balance
    path: list[State]


def with_temperatures(
    scene: Scene, simulate: Simulate, gather: Gather, progress: Reporter = None, only_steady: bool = False
) -> Balanced:
    """The result of a scene with [thermal]; ``only_steady``: or RunError once short runs show no steady state. Raises as ``verdict_of``."""
    balance = Balance(scene, simulate)
    verdict = near_verdict(balance) or verdict_of(balance)
    if only_steady and not verdict.steady:
        raise RunError(f"{verdict.status}: {verdict.reason}")
    path, temperatures, ends = verdict.path, verdict.temperatures, verdict.ends
    for _ in range(MOST_WHOLE_RUNS if verdict.steady else 1):
        state = balance.at(temperatures, _resumed if ends else lambda scene: scene, progress, starts=ends)
        ends = ends and state.run.ensemble.ends
        path.append(state)
        temperatures = corrected(state, verdict.slopes)
        if closes := _closes(state, verdict.slopes, CORRECTED if ends else TOLERANCE):
            break
    status, reason = verdict.status, verdict.reason
    if verdict.steady and not closes:
        status, reason = "undecided", _open_reason(state, verdict.slopes)
    return Balanced(_result(balance, path, verdict.slopes, status, reason, gather), balance, path)


def _closes(state: State, slopes: Array, tolerance: float) -> bool:
    """Whether the heat of a run balances within the tolerance [K] or its error, and this is small enough to know the temperatures."""
    step = corrected(state, slopes) - state.temperatures
    return state._replace(image=state.temperatures + step).closes(tolerance) and float(state.noise.max()) <= VAGUE


def _open_reason(state: State, slopes: Array) -> str:
    step, noise = np.abs(corrected(state, slopes) - state.temperatures).max(), state.noise.max()
    return (
        f"after {MOST_WHOLE_RUNS} runs of full length the temperatures still move by {step:.2g} K, and their noise is {noise:.2g} K; "
        "lengthen numerics.turns or raise numerics.replicates"
    )


def steady_scene(scene: Scene, simulate: Simulate) -> Scene:
    """The scene at its steady temperatures by short runs. Raises as ``verdict_of``, and RunError where it has none or is too hot."""
    verdict = verdict_of(Balance(scene, simulate))
    if not verdict.steady:
        raise RunError(f"temperatures: {verdict.status}: {verdict.reason}")
    if excess := too_hot(scene, dict(zip(NODES, verdict.temperatures.tolist(), strict=True))):
        raise RunError(f"temperatures: too hot: {excess}")
    return at_temperatures(scene, Temperatures(*verdict.temperatures.tolist()))


def _result(
    balance: Balance, path: Sequence[State], slopes: Array, status: str, reason: str, gather: Gather
) -> SimulationResult:
    scene, state = balance.scene, path[-1]
    trial: Trial = state.run
    steady = status == "steady"
    temperatures = _quantities(trial, state, slopes if steady else np.zeros_like(slopes), steady)
    values = {node: figure.value for node, figure in temperatures.items()}
    if steady and (excess := too_hot(scene, values)):
        status, reason = "too hot", excess
    result = gather(
        trial.hot, trial.ensemble, {**trial.clock, "compile_s": balance.compile_s, "wall_s": balance.wall_s}
    )
    figures = result.figures
    if steady and scene.thermal is not None and scene.thermal.near is not None:
        figures = figures | {POWER_LOSS: _shifted(figures[POWER_LOSS], heat_to_steady(state, slopes))}
    network = trial.network
    of_nodes = network.terms(powers_of(trial.ensemble.runs)) @ network.term_shares
    ranges = _ranges(scene, trial.hot, path, slopes) if steady else Ranges(None)
    thermal = HeatBalance(
        status=status,
        reason=reason or None,
        gain=float(gain(slopes)),
        slopes=slopes.tolist() if steady else None,
        heat_W=dict(zip(NODES, of_nodes.tolist(), strict=True)),
        windage_W=network.windage,
        carried_off_W=carried_off(network.conductances, network.boundaries, state.image),
        conductances_W_K=network.conductances._asdict(),
        ranges=ranges,
        oil_fraction=trial.hot.lubricant.oil_fraction,
        path_C=[dict(zip(NODES, visited.temperatures.tolist(), strict=True)) for visited in path],
    )
    return replace(
        result,
        figures=figures,
        status=status_of(result.notes) if status == "steady" else status,
        temperatures_C=temperatures,
        part_figures=at_temperatures_with_errors(scene, result.part_figures or {}, temperatures),
        thermal=thermal,
        scene=scene.model_dump(mode="json"),
        cost={**result.cost, **work_done(balance.runs), "turns": balance.turns, "states": len(path)},
        notes=(*_notes(scene, trial.hot, status, reason, ranges), *_new(result.notes, scene, trial.hot, status)),
    )


def heat_to_steady(state: State, slopes: Array) -> float:
    """Heat of the steady state less that of a state next to it [W]: 1'G dM/dT (T* - T)."""
    return float((state.model.matrix @ slopes @ (corrected(state, slopes) - state.temperatures)).sum())


def _shifted(loss: Quantity, more: float) -> Quantity:
    """A loss [W] that is so much larger, whose slopes are as uncertain as those of the last step."""
    numerical = None if loss.numerical_error is None else math.hypot(loss.numerical_error, LAST_STEP * more)
    return replace(loss, value=loss.value + more, numerical_error=numerical)


def _ranges(scene: Scene, hot: Scene, path: Sequence[State], slopes: Array) -> Ranges:
    """Ranges over the unknown inputs of the balance, about the steady state next to the last one, by the model of the search."""
    mounting = given(hot.mounting)

    def clearances(nodes: Array, thermals: Sequence[Thermal]) -> dict[str, Array]:
        parts = part_temperatures(together(thermals), Temperatures(*nodes.T))
        plays = hot.clearances_of(mounting.model_copy(update=parts))
        return {f"{name}_um": 1e6 * play + np.zeros(len(nodes)) for name, play in plays.items()}

    about = model_of(path).with_image_slopes(slopes)
    estimated = [] if scene.uncertain is None else scene.uncertain.estimated
    return input_ranges(
        scene,
        about,
        lambda share: heat.term_shares(hot, share),
        clearances,
        heat.loss_levels(hot, path[-1].run.bearing),
        estimated,
    )


def _quantities(trial: Trial, state: State, slopes: Array, steady: bool) -> dict[str, Quantity]:
    """Temperatures of the nodes with their errors; those of the state itself where none is steady."""
    ensemble = trial.ensemble
    moving = drifting(ensemble.runs)
    step = LAST_STEP * np.abs(corrected(state, slopes) - state.temperatures)
    figures = {}
    for place, figure in enumerate(temperature_figures(state.temperatures, trial.network, slopes)):
        slow = slow_change(figure, figure, ensemble.runs, ensemble.since, moving=moving)
        node = quantity(figure, ensemble.runs, ensemble.companions, ensemble.plan.share, slow)
        numerical = math.hypot(node.numerical_error or 0.0, float(step[place]))
        figures[NODES[place]] = (
            replace(node, numerical_error=numerical)
            if steady
            else replace(node, value=float(state.temperatures[place]), statistical_error=None, numerical_error=None)
        )
    return figures


def _new(notes: Notes, scene: Scene, hot: Scene, status: str) -> list[Note]:
    """Notes without those that the ``status`` says too, or that take a computed temperature for one in another unit."""
    computed = set(hot.unit_notes) - set(scene.unit_notes)
    return [note for note in notes if note not in computed and note.code != status]


def _notes(scene: Scene, hot: Scene, status: str, reason: str, ranges: Ranges) -> Iterator[Note]:
    """Notes of the heat balance: its verdict, what its inputs leave open, and where the oil fraction is a guess."""
    yield from status_notes(f"{status}: {reason}")
    yield from ranges.notes
    yield from heat_notes(given(scene.thermal), scene.lubricant, given(scene.mounting), heat.ring_width(scene))
    yield from heat.flow_notes(hot)
