"""One replicate under way: integrator, memory and where it stands."""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.energy import mechanical_energy
from rbdyn.dynamics.forces.equations import LOADS, POWERS, RollerBearing
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.forces.state import INNER_ANGLE, OUTER_ANGLE, name
from rbdyn.dynamics.integrators.method import EXPLICIT, advance_by, cheaper_method, explicit_method, pair_of
from rbdyn.dynamics.integrators.runge_kutta import (
    FINISHED,
    NOT_FINITE,
    STEP_BUDGET,
    STEP_UNDERFLOW,
    Carry,
    Control,
    Tally,
)
from rbdyn.dynamics.parameters.scales import absolute_tolerance, layout_of, scales
from rbdyn.dynamics.parameters.start import start_state
from rbdyn.faults import RunError
from rbdyn.scene import Scene

# Interruptions are looked for between so many steps: some hundredths of a second, of the implicit method half a one.
STEPS_AT_ONCE = 10_000
LARGEST_STEP_TURNS = 0.02
SMALLEST_STEP_TURNS = 1e-12
PI_START_ERROR = 1e-4


class Run:
    """One replicate under way: parameters, integrator memory and where it stands.

    ``method``: "auto" until its first step, where the scene leaves it open.
    """

    def __init__(self, scene: Scene, bearing: RollerBearing, replicate: int, rtol: float, stop: Stop) -> None:
        self.scene, self.bearing, self.replicate, self.stop = scene, bearing, replicate, stop
        self.rtol = rtol
        self.layout = layout_of(scene)
        seeds = np.random.SeedSequence(scene.numerics.seed, spawn_key=(replicate,))
        y = start_state(scene, bearing, np.random.default_rng(seeds))
        numerics = scene.numerics
        self.method: str = numerics.method
        self.explicit = explicit_method(numerics.method, numerics.rtol)
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
            pair=pair_of(self.explicit),
        )
        self.tally = Tally(np.zeros(POWERS), np.zeros(LOADS), np.zeros(LOADS), np.zeros(3))
        self.sample_step = scene.turn_s / numerics.samples_per_turn
        allotted = self.explicit if self.method == "auto" else self.method
        self.control = self._control_by(allotted)
        self.advance = advance_by(allotted, scene, bearing)

    def choose_method(self) -> None:
        """Settle "auto" by a trial from where the run stands, which is left as it is."""
        if self.method != "auto":
            return
        self.method, stiffness = cheaper_method(
            self.scene, self.bearing, self.explicit, self._control_by, self.carry, self.tally, self.sample_step
        )
        if self.method == "rosenbrock":
            # The implicit method does not see what it overcomes.
            self.carry.stiffness[:] = stiffness
            self.control = self._control_by(self.method)._replace(step_budget=self.control.step_budget)
            self.advance = advance_by(self.method, self.scene, self.bearing)

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
        self.choose_method()
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
            return self.carry.clock[0] * np.array(self.scene.operation.speeds)
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
