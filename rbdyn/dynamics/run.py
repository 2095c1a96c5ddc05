"""One replicate under way: integrator, memory and where it stands."""

import math
import time
from typing import Any

import numpy as np

from rbdyn.arrays import Array
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.equations import RollerBearing, mechanical_energy
from rbdyn.dynamics.forces.state import INNER_ANGLE, OUTER_ANGLE, name
from rbdyn.dynamics.integrators import records as at
from rbdyn.dynamics.integrators.advance import advance
from rbdyn.dynamics.integrators.method import EXPLICIT, cheaper_method, explicit_method, method_of
from rbdyn.dynamics.integrators.records import Control, Status, carry_from, empty_tally
from rbdyn.dynamics.pace import Pace
from rbdyn.dynamics.parameters.scales import absolute_tolerance, layout_of, scales
from rbdyn.dynamics.parameters.start import start_state
from rbdyn.faults import RunError
from rbdyn.scene import Scene

# Interruptions are looked for between so many steps: some hundredths of a second, of the implicit method half a one.
STEPS_AT_ONCE = 10_000
LARGEST_STEP_TURNS = 0.02
SMALLEST_STEP_TURNS = 1e-12


class Run:
    """One replicate under way: parameters, integrator memory and where it stands.

    ``longest_step`` [s] bounds the steps. ``method``: "auto" until its first step, where the scene
    leaves it open; ``spent_s``: time that its steps took; ``pace``: what states the time that this and its like take,
    by whose number, the ``ticket``, it knows the run.
    """

    def __init__(
        self,
        scene: Scene,
        bearing: RollerBearing,
        replicate: int,
        rtol: float,
        stop: Stop,
        pace: Pace | None = None,
        longest_step: float = math.inf,
    ) -> None:
        self.scene, self.bearing, self.replicate, self.stop = scene, bearing, replicate, stop
        self.pace, self.spent_s = pace, 0.0
        self.ticket = 0 if pace is None else pace.enter()
        self.rtol, self.longest_step = rtol, longest_step
        self.layout = layout_of(scene)
        seeds = np.random.SeedSequence(scene.numerics.seed, spawn_key=(replicate,))
        y = start_state(scene, bearing, np.random.default_rng(seeds))
        numerics = scene.numerics
        self.method: str = numerics.method
        self.explicit = explicit_method(numerics.method, numerics.rtol)
        allotted = self.explicit if self.method == "auto" else self.method
        first_step = 1e-3 * scales(scene).length / scales(scene).speed
        self.carry = carry_from(y, bearing.rollers, first_step, method_of(allotted, scene, bearing))
        self.tally = empty_tally()
        self.sample_step = scene.turn_s / numerics.samples_per_turn
        self.control = self._control_by(allotted)

    def choose_method(self) -> None:
        """Settle "auto" by a trial from where the run stands, which is left as it is."""
        if self.method != "auto":
            return
        memory = self.carry, self.tally, self.sample_step
        self.method, stiffness = cheaper_method(self.scene, self.bearing, self.explicit, self._control_by, *memory)
        if self.method == "rosenbrock":
            # The implicit method does not see what it overcomes.
            self.carry.stiffness[:] = stiffness
            self.carry = self.carry._replace(method=method_of(self.method, self.scene, self.bearing))
            self.control = self._control_by(self.method)._replace(step_budget=self.control.step_budget)

    def _control_by(self, method: str) -> Control:
        numerics = self.scene.numerics
        turns = numerics.turns + numerics.warm_up_turns
        return Control(
            1.0 / absolute_tolerance(self.scene, self.bearing, self.rtol, method),
            SMALLEST_STEP_TURNS * self.scene.turn_s,
            min(LARGEST_STEP_TURNS * self.scene.turn_s, self.longest_step),
            int(min(numerics.step_budget_per_turn * math.ceil(turns), 2**62)),
        )

    def allow(self, turns: float) -> None:
        """Let the budget of steps last for so many shaft turns since the start, at least."""
        budget = int(min(self.scene.numerics.step_budget_per_turn * math.ceil(turns), 2**62))
        self.control = self.control._replace(step_budget=max(self.control.step_budget, budget))

    def to(self, turns: float) -> None:
        """Advance to a time given in shaft turns since the start. Raises RunError or CancelledError."""
        started = time.perf_counter() - self.spent_s
        self.choose_method()
        budget, end = self.control.step_budget, turns * self.scene.turn_s
        while True:
            self.stop.check()
            short = self.control._replace(step_budget=min(self.steps + STEPS_AT_ONCE, budget))
            status = list(Status)[advance(self.bearing, short, self.carry, self.tally, end, self.sample_step)]
            self.spent_s = time.perf_counter() - started
            if self.pace is not None:
                turned = float(self.carry.clock[at.NOW]) / self.scene.turn_s
                self.pace.look(self.ticket, self.spent_s, turned, self.steps, budget)
            if status is Status.FINISHED:
                return
            if status is not Status.STEP_BUDGET or self.steps >= budget:
                raise RunError(self._why(status))

    @property
    def steps(self) -> int:
        """Steps made, the refused ones too."""
        return int(self.carry.counts[at.ACCEPTED] + self.carry.counts[at.REJECTED])

    def forget(self) -> None:
        """Start counting here: empty the tally and sample from now on."""
        for kept in self.tally:
            kept[:] = 0.0
        self.carry.clock[at.SAMPLE] = self.carry.clock[at.NOW]

    def clock_angles(self) -> Array:
        """Angles of inner and outer ring [rad] since the start."""
        clock = self.layout.clock
        if clock is None:
            return self.carry.clock[at.NOW] * np.array(self.scene.operation.speeds)
        return self.carry.y[clock + INNER_ANGLE : clock + OUTER_ANGLE + 1].copy()

    def _why(self, status: Status) -> str:
        time_s = self.carry.clock[at.NOW]
        message, remedy = status.value
        component, step = name(int(self.carry.counts[at.WORST]), self.layout), self.carry.clock[at.STEP]
        message = message.format(component=component, step=step, spent_s=self.spent_s, **self.control._asdict())
        explicit = status is Status.STEP_BUDGET and self.scene.numerics.method in EXPLICIT
        where = f"replicate {self.replicate + 1} (seed {self.scene.numerics.seed}) stopped at t = {time_s:.6g} s"
        why = f"shaft turn {time_s / self.scene.turn_s:.4g}: {message}"
        return f"{where}, {why}; {'take numerics.method = auto, ' if explicit else ''}{remedy}"


def with_numerics(scene: Scene, **changes: Any) -> Scene:
    """The scene with other numerics, which are not validated."""
    return scene.model_copy(update={"numerics": scene.numerics.model_copy(update=changes)})


def prepare(scene: Scene, bearing: RollerBearing) -> float:
    """Compile, or fetch from disk, what the scene needs; returns the seconds it took."""
    started = time.perf_counter()
    run = Run(scene, bearing, 0, scene.numerics.rtol, Stop())
    run.to(0.0)
    mechanical_energy(bearing, run.carry.y)
    return time.perf_counter() - started
