"""Replicates of a scene, gathered with error bars."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from functools import cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.dynamics.energy import mechanical_energy
from rbdyn.dynamics.ensemble import Ended, Stop, run_all
from rbdyn.dynamics.equations import LOADS, LOSSES, POWERS, RollerBearing
from rbdyn.dynamics.error_bars import error_notes, quantities
from rbdyn.dynamics.geometry import absolute_tolerance, layout_of, scales, shaft_speeds
from rbdyn.dynamics.left_out import heat_notes, left_out_notes
from rbdyn.dynamics.method import (
    EXPLICIT,
    advance_by,
    cheaper_method,
    explicit_method,
    pair_of,
    stiffness_cost,
    stiffness_notes,
)
from rbdyn.dynamics.metrics import Replicate
from rbdyn.dynamics.model import roller_bearing
from rbdyn.dynamics.race_lanes import scratch
from rbdyn.dynamics.race_report import race_notes, race_report
from rbdyn.dynamics.recording import Recording, record
from rbdyn.dynamics.runge_kutta import FINISHED, NOT_FINITE, STEP_BUDGET, STEP_UNDERFLOW, Carry, Control, Tally
from rbdyn.dynamics.settling import Ensemble, run_until_settled
from rbdyn.dynamics.start import start_state
from rbdyn.dynamics.state import INNER_ANGLE, OUTER_ANGLE, name
from rbdyn.faults import RunError
from rbdyn.result import SimulationResult, versions
from rbdyn.scene import Scene

# Interruptions are looked for between so many steps: some hundredths of a second, of the implicit method half a one.
STEPS_AT_ONCE = 10_000
LARGEST_STEP_TURNS = 0.02
SMALLEST_STEP_TURNS = 1e-12
PI_START_ERROR = 1e-4
# Beyond this relative gap of the power balance a result warns of its tolerance.
LARGEST_POWER_GAP = 0.005

# What was prepared in this process: method and types of the laws. Scenes of the same need not wait for it again.
_prepared: set[Any] = set()


class Run:
    """One replicate under way: parameters, integrator memory and where it stands."""

    def __init__(self, scene: Scene, bearing: RollerBearing, replicate: int, rtol: float, stop: Stop) -> None:
        self.scene, self.bearing, self.replicate, self.stop = scene, bearing, replicate, stop
        self.rtol = rtol
        self.layout = layout_of(scene)
        seeds = np.random.SeedSequence(scene.numerics.seed, spawn_key=(replicate,))
        y = start_state(scene, bearing, np.random.default_rng(seeds))
        numerics = scene.numerics
        explicit = explicit_method(numerics.method, numerics.rtol)
        n = y.size
        first_step = 1e-3 * scales(scene).length / scales(scene).speed
        self.carry = Carry(
            y=y,
            k=np.zeros((7, n)),
            stage=np.zeros(n),
            power=np.zeros((7, POWERS)),
            loads=np.zeros((7, LOADS)),
            scratch=scratch(bearing.rollers),
            clock=np.array([0.0, first_step, PI_START_ERROR, 0.0, 0.0]),
            counts=np.zeros(4, dtype=np.int64),
            stiffness=np.zeros(3),
            pair=pair_of(explicit),
        )
        self.tally = Tally(np.zeros(POWERS), np.zeros(LOADS), np.zeros(LOADS), np.zeros(3))
        self.sample_step = scene.turn_s / numerics.samples_per_turn
        self.method: str = numerics.method
        control_by = cache(self._control_by)
        if self.method == "auto":
            self.method, stiffness = cheaper_method(
                scene, bearing, explicit, control_by, self.carry, self.tally, self.sample_step
            )
            # The implicit method does not see what it overcomes.
            self.carry.stiffness[:] = stiffness if self.method == "rosenbrock" else 0.0
        self.control = control_by(self.method)
        self.advance = advance_by(self.method, scene, bearing)

    def _control_by(self, method: str) -> Control:
        numerics = self.scene.numerics
        turns = numerics.turns + numerics.warm_up_turns
        return Control(
            1.0 / absolute_tolerance(self.scene, self.bearing, self.rtol, method),
            SMALLEST_STEP_TURNS * self.scene.turn_s,
            LARGEST_STEP_TURNS * self.scene.turn_s,
            int(min(numerics.step_budget_per_turn * math.ceil(turns), 2**62)),
        )

    def allow(self, turns: float) -> None:
        """Let the budget of steps last for so many shaft turns since the start, at least."""
        budget = int(min(self.scene.numerics.step_budget_per_turn * math.ceil(turns), 2**62))
        self.control = self.control._replace(step_budget=max(self.control.step_budget, budget))

    def to(self, turns: float) -> None:
        """Advance to a time given in shaft turns since the start. Raises RunError or CancelledError."""
        counts, budget = self.carry.counts, self.control.step_budget
        while True:
            self.stop.check()
            short = self.control._replace(step_budget=min(int(counts[:2].sum()) + STEPS_AT_ONCE, budget))
            status = self.advance(
                self.bearing, short, self.carry, self.tally, turns * self.scene.turn_s, self.sample_step
            )
            if status == FINISHED:
                return
            if status != STEP_BUDGET or counts[:2].sum() >= budget:
                raise RunError(self._why(status))

    def forget(self) -> None:
        """Start counting here: empty the tally and sample from now on."""
        for kept in self.tally:
            kept[:] = 0.0
        self.carry.clock[3] = self.carry.clock[0]

    def clock_angles(self) -> NDArray[np.float64]:
        """Angles of inner and outer ring [rad] since the start."""
        clock = self.layout.clock
        if clock is None:
            return self.carry.clock[0] * np.array(shaft_speeds(self.scene))
        return self.carry.y[clock + INNER_ANGLE : clock + OUTER_ANGLE + 1].copy()

    def _why(self, status: int) -> str:
        time_s = self.carry.clock[0]
        where = (
            f"replicate {self.replicate + 1} (seed {self.scene.numerics.seed}) stopped at t = {time_s:.6g} s, "
            f"shaft turn {time_s / self.scene.turn_s:.4g}"
        )
        component = name(int(self.carry.counts[3]), self.layout)
        if status == STEP_UNDERFLOW:
            return (
                f"{where}: the step fell below {self.control.smallest_step:.2g} s because of {component}; "
                "loosen numerics.rtol or soften the law that acts on it (damping, friction blend, film floor)"
            )
        if status == NOT_FINITE:
            return f"{where}: {component} is not finite at any step size; check the laws that act on it"
        return (
            f"{where}: step budget of {self.control.step_budget} used up (last step {self.carry.clock[1]:.2g} s); "
            f"{'take numerics.method = auto, ' if self.scene.numerics.method in EXPLICIT else ''}raise "
            "numerics.step_budget_per_turn, loosen numerics.rtol, or soften the stiffest law"
        )


def run_replicate(scene: Scene, bearing: RollerBearing, replicate: int, rtol: float, stop: Stop) -> Replicate:
    """Run one replicate, the transient included. Raises RunError or CancelledError."""
    return record(Run(scene, bearing, replicate, rtol, stop))


def prepare(scene: Scene, bearing: RollerBearing) -> float:
    """Compile, or fetch from disk, what the scene needs; returns the seconds it took."""
    started = time.perf_counter()
    run = Run(scene, bearing, 0, scene.numerics.rtol, Stop())
    run.to(0.0)
    mechanical_energy(bearing, run.carry.y)
    return time.perf_counter() - started


def _types(parameters: Any) -> Any:
    """Types of parameters and of those inside, which decide what is compiled."""
    if isinstance(parameters, tuple):
        return type(parameters), *map(_types, parameters)
    return type(parameters)


def simulate(
    scene: Scene,
    workers: int | None = None,
    progress: Callable[[int, int], None] | None = None,
    stop: Stop | None = None,
    target: float | None = None,
) -> SimulationResult:
    """Simulate all replicates of a scene.

    ``workers``: threads, all processors by default; the result does not depend on it. ``progress(done, total)`` is
    called after every run. ``target``: relative error to reach, for which tolerance, turns and replicates are chosen
    (``rbdyn.dynamics.target``). Raises RunError when a replicate cannot go on, InputError for an impossible target,
    KeyboardInterrupt on Ctrl-C.
    """
    if target is not None:
        from rbdyn.dynamics.target import reach

        return reach(scene, target, workers, progress, stop)
    stop = Stop(outer=stop)
    bearing = roller_bearing(scene)
    compile_s = 0.0
    method = scene.numerics.method, explicit_method(scene.numerics.method, scene.numerics.rtol)
    if (laws := (method, _types(bearing))) not in _prepared:
        compile_s = prepare(scene, bearing)
        _prepared.add(laws)
    started = time.perf_counter()

    def recording(replicate: int, rtol: float, stop: Stop) -> Recording:
        return Recording(Run(scene, bearing, replicate, rtol, stop))

    ensemble = run_until_settled(scene, recording, workers, progress, stop)
    wall_s = time.perf_counter() - started
    return _gather(scene, ensemble, wall_s, compile_s)


def run_series(
    scene: Scene,
    bearing: RollerBearing,
    tolerances: Sequence[float],
    workers: int | None,
    progress: Callable[[int, int], None] | None,
    stop: Stop,
) -> list[list[Replicate]]:
    """All replicates of a scene at each tolerance, in order. Raises RunError or KeyboardInterrupt."""
    replicates = range(scene.numerics.replicates)
    tasks = [partial(run_replicate, scene, bearing, index, rtol, stop) for rtol in tolerances for index in replicates]
    runs: dict[int, Replicate] = {}

    def ended(one: Ended[Replicate]) -> None:
        runs[one.place] = one.result()
        if progress is not None:
            progress(len(runs), len(tasks))

    run_all(tasks, workers, stop, ended)
    return [[runs[place * len(replicates) + index] for index in replicates] for place in range(len(tolerances))]


def _gather(scene: Scene, ensemble: Ensemble, wall_s: float, compile_s: float) -> SimulationResult:
    runs, companions = ensemble.runs, ensemble.companions
    everything = [*runs, *companions]
    figures = quantities(scene, runs, companions, ensemble.since)
    power_gap = max(run.power_gap for run in runs)
    inner_load, outer_load = (max(getattr(run, f"max_{race}_load") for run in runs) for race in ("inner", "outer"))
    races = race_report(scene, inner_load, outer_load)
    return SimulationResult(
        status="ok",
        impact_force=figures["impact_force_N"],
        impact_contact_force=figures["impact_contact_force_N"],
        whirl_deviation_ratio=figures["whirl_deviation_ratio"],
        power_loss=figures["power_loss_W"],
        cage_speed_rpm=figures["cage_speed_rpm"],
        cage_slip=figures["cage_slip"],
        power_gap=power_gap,
        power_terms={
            term: float(np.average([run.power(term) for run in runs], weights=[run.duration for run in runs]))
            for term in LOSSES
        },
        max_inner_load=inner_load,
        max_outer_load=outer_load,
        max_land_load=max(run.max_land_load for run in runs),
        races=races,
        clearance=clearance_report(scene),
        impact_window_turns=scene.impact_window_turns,
        transient_turns=ensemble.transient_turns,
        counted_turns=runs[0].duration / scene.turn_s,
        cost={
            "wall_s": wall_s,
            "compile_s": compile_s,
            "cpu_s": sum(run.cpu_s for run in everything),
            "steps": sum(run.accepted_steps for run in everything),
            "rejected_steps": sum(run.rejected_steps for run in everything),
            "rhs_evaluations": sum(run.derivatives for run in everything),
            "turns": sum(float(run.durations.sum()) for run in everything) / scene.turn_s,
            **stiffness_cost(runs),
        },
        replicates=scene.numerics.replicates,
        seed=scene.numerics.seed,
        notes=(
            *scene.unit_notes,
            *race_notes(scene, races),
            *heat_notes(scene, figures["power_loss_W"].value),
            *_notes(scene, power_gap),
            *left_out_notes(scene, figures["power_loss_W"].value),
            *ensemble.notes,
            *error_notes(scene, figures, ensemble.fault),
            *stiffness_notes(scene, runs),
        ),
        versions=versions(),
        scene=scene.model_dump(mode="json"),
    )


def clearance_report(scene: Scene) -> dict[str, float]:
    """Diametral clearance as drawn and in operation, and what changed it [um]."""
    drawn = scene.bearing.radial_clearance_mm * 1e3
    mounted = scene.mounted_clearance
    if mounted is None:
        return {"drawn": drawn, "operating": drawn}
    parts = ("inner_fit", "outer_fit", "temperature", "rotation", "operating")
    return {"drawn": drawn, **{part: getattr(mounted, part) * 1e6 for part in parts}}


def _notes(scene: Scene, power_gap: float) -> tuple[str, ...]:
    notes = []
    if power_gap > LARGEST_POWER_GAP:
        notes.append(
            f"power balance closes only to {100.0 * power_gap:.2g} %: numerics.rtol = {scene.numerics.rtol:g} is too "
            "loose for this scene; loose tolerances bias impact and whirl upward, power loss downward; tighten it tenfold"
        )
    if scene.traction.model == "four_constant":
        notes.append(
            "traction: one load-independent set of constants; lightly loaded rollers are driven too hard and "
            "skidding is under-predicted"
        )
    if scene.traction.model == "thermal_newtonian" and scene.lubricant.viscosity_mPas is not None:
        notes.append(
            "traction: follows the oil and its temperature, not lubricant.viscosity_mPas, which the films use; choose "
            "traction.rheology_oil to suit it"
        )
    return tuple(notes)
