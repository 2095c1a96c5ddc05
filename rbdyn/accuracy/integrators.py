"""Every integrator behind one door: ours, fixed steps, SciPy's and CVODE, all on the same right-hand side.

``method.ready(stretch, setting)`` sets up and returns a call that integrates once; only that call is timed. All
adaptive methods get the same absolute tolerance, a fraction ``setting`` of each component's scale, and no relative
one; they weigh it by norms of their own, so they are to be compared at equal error, never at equal setting.
"""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rbdyn.accuracy.fixed_step import BudgetSpent, RightHandSide, runge_kutta_4, steps_of, velocity_of, velocity_verlet
from rbdyn.base.arrays import Array
from rbdyn.base.faults import RunError
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.integrators.records import ACCEPTED, DERIVATIVES, NOW
from rbdyn.dynamics.parameters.state import scales
from rbdyn.dynamics.run import Run, with_numerics
from rbdyn.scene import Scene

# Right-hand sides a turn past which a method counts as failed.
BUDGET_PER_TURN = 4_000_000
# The least relative tolerance that SciPy takes: next to the absolute ones it is round-off.
NO_RELATIVE_TOLERANCE = 2.3e-14


@dataclass(frozen=True)
class Stretch:
    """From the state ``start`` (n,) over so many shaft turns; ``scale`` (n,): the size of each component's errors."""

    scene: Scene
    bearing: RollerBearing
    start: Array
    turns: float
    scale: Array

    @property
    def duration(self) -> float:
        """Its length [s]."""
        return self.turns * self.scene.turn_s


class NotInstalledError(RunError):
    """A method whose package is missing."""


class Arrived(NamedTuple):
    """State at the end, right-hand sides it took."""

    y: Array
    derivatives: int


class Method(NamedTuple):
    """``ready(stretch, setting)`` gives the timed call, which raises RunError. Settings, loosest first: tolerances of
    an ``adaptive`` method, else steps in contact times (approach over speed of a race contact)."""

    name: str
    adaptive: bool
    settings: tuple[float, ...]
    ready: Callable[[Stretch, float], Callable[[], Arrived]]

    def label(self, stretch: Stretch, setting: float) -> str:
        """A setting in words."""
        if self.adaptive:
            return f"rtol {setting:g}"
        return f"{steps_of(stretch.duration, fixed_step(stretch.scene, setting)) / stretch.turns:.0f} steps a turn"


def ready_ours(stretch: Stretch, rtol: float) -> Callable[[], Arrived]:
    """As in a simulation, with everything that one keeps: works, largest loads, whirl."""
    limits = {"turns": stretch.turns, "discard_turns": 0.0, "step_budget_per_turn": BUDGET_PER_TURN, "method": "rk45"}
    scene = with_numerics(stretch.scene, **limits)
    return _over(stretch, Run(scene, stretch.bearing, 0, rtol, Stop()))


def _over(stretch: Stretch, run: Run) -> Callable[[], Arrived]:
    """The call that takes a run over a stretch."""
    run.carry.y[:] = stretch.start

    def go() -> Arrived:
        run.to(stretch.turns)
        return Arrived(run.carry.y, int(run.carry.counts[DERIVATIVES]))

    return go


def fixed_step(scene: Scene, contact_times: float) -> float:
    """A step given in contact times [s]."""
    scale = scales(scene)
    return contact_times * scale.length / scale.speed


class FixedStepRun(Run):
    """A run whose steps are fixed: about ``step`` [s], cut so that a whole number of them fits each leg."""

    def __init__(self, scene: Scene, bearing: RollerBearing, replicate: int, step: float, verlet: bool) -> None:
        super().__init__(scene, bearing, replicate, 1.0, Stop())
        self.step, self.verlet, self.pairs = step, verlet, velocity_of(self.layout)

    def to(self, turns: float) -> None:
        """Advance to a time given in shaft turns since the start. Raises RunError where the state explodes."""
        carry, turn_s = self.carry, self.scene.turn_s
        duration = turns * turn_s - carry.clock[NOW]
        if duration <= 0.0:
            return
        steps = steps_of(duration, self.step)
        rest = (carry.y, duration / steps, steps, carry.scratch, self.tally)
        done = velocity_verlet(self.bearing, self.pairs, *rest) if self.verlet else runge_kutta_4(self.bearing, *rest)
        carry.clock[NOW] += duration * done / steps
        carry.counts[ACCEPTED] += done
        carry.counts[DERIVATIVES] += done if self.verlet else 4 * done
        if done < steps:
            raise RunError(f"not finite after {carry.clock[NOW] / turn_s:.2g} turns")


def by_fixed_step(verlet: bool) -> Callable[..., Callable[[], Arrived]]:
    """``ready`` of velocity Verlet, or else of the classical Runge-Kutta method."""

    def ready(stretch: Stretch, contact_times: float) -> Callable[[], Arrived]:
        step = fixed_step(stretch.scene, contact_times)
        return _over(stretch, FixedStepRun(stretch.scene, stretch.bearing, 0, step, verlet))

    return ready


def compiled(stretch: Stretch) -> RightHandSide:
    """The compiled right-hand side with the budget of a stretch."""
    return RightHandSide(stretch.bearing, stretch.start.size, int(BUDGET_PER_TURN * stretch.turns))


def by_scipy(name: str, function: Callable[[Stretch], Any] = compiled) -> Callable[..., Callable[[], Arrived]]:
    """``ready`` of a method of scipy.integrate.solve_ivp, on the right-hand side that ``function(stretch)`` gives."""

    def ready(stretch: Stretch, rtol: float) -> Callable[[], Arrived]:
        from scipy.integrate import solve_ivp

        right_hand_side = function(stretch)
        options = {"method": name, "rtol": NO_RELATIVE_TOLERANCE, "atol": rtol * stretch.scale}

        def go() -> Arrived:
            with warnings.catch_warnings(), np.errstate(all="ignore"):
                warnings.simplefilter("ignore")
                try:
                    solution = solve_ivp(right_hand_side, (0.0, stretch.duration), stretch.start, **options)
                except (BudgetSpent, ValueError) as error:  # its LU refuses a Jacobian that is not finite
                    raise RunError(_why(error)) from None
            if not solution.success:
                raise RunError(str(solution.message))
            return Arrived(solution.y[:, -1], right_hand_side.calls)

        return go

    return ready


def by_cvode(name: str) -> Callable[..., Callable[[], Arrived]]:
    """``ready`` of CVODE (SUNDIALS) by scikit-sundae, with "Adams" or "BDF" formulas; raises NotInstalledError."""

    def ready(stretch: Stretch, rtol: float) -> Callable[[], Arrived]:
        try:
            from sksundae.cvode import CVODE
        except ImportError:
            raise NotInstalledError("not installed: pip install 'rbdyn[bench]'") from None
        right_hand_side = compiled(stretch)
        spent: list[BudgetSpent] = []

        def fill(t: float, y: Array, dy: Array) -> None:
            try:
                right_hand_side.fill(y, dy.reshape(1, -1))
            except BudgetSpent as error:
                # No exception gets through its C code: a derivative that is not finite ends the run.
                spent.append(error)
                dy[:] = np.nan

        steps = int(BUDGET_PER_TURN * stretch.turns) + 1
        solver = CVODE(fill, method=name, rtol=NO_RELATIVE_TOLERANCE, atol=rtol * stretch.scale, max_num_steps=steps)

        def go() -> Arrived:
            solver.init_step(0.0, stretch.start)
            solution = solver.step(stretch.duration, tstop=stretch.duration)
            if spent:
                raise RunError(_why(spent[0]))
            if not solution.success:
                raise RunError(str(solution.message))
            return Arrived(solution.y, right_hand_side.calls)

        return go

    return ready


def _why(error: Exception) -> str:
    return f"over {BUDGET_PER_TURN} right-hand sides a turn" if isinstance(error, BudgetSpent) else str(error)


def _decades(first: int, last: int) -> tuple[float, ...]:
    return tuple(10.0**-power for power in range(first, last + 1))


def _halved(first: float, count: int) -> tuple[float, ...]:
    return tuple(first * 0.5**k for k in range(count))


OURS = Method("rbdyn RK45", True, (1e-1, 3e-2, 1e-2, *_decades(3, 10)), ready_ours)
RUNGE_KUTTA_4 = Method("RK4, fixed step", False, _halved(4.0, 9), by_fixed_step(verlet=False))
VELOCITY_VERLET = Method("velocity Verlet", False, _halved(4.0, 11), by_fixed_step(verlet=True))
SCIPY_RK45 = Method("SciPy RK45", True, _decades(0, 9), by_scipy("RK45"))
DOP853 = Method("SciPy DOP853", True, _decades(0, 10), by_scipy("DOP853"))
COMPILED = (OURS, RUNGE_KUTTA_4, VELOCITY_VERLET)
METHODS = (
    *COMPILED,
    SCIPY_RK45,
    DOP853,
    Method("SciPy LSODA", True, _decades(0, 8), by_scipy("LSODA")),
    Method("SciPy Radau", True, _decades(0, 5), by_scipy("Radau")),
    Method("SciPy BDF", True, _decades(0, 5), by_scipy("BDF")),
    Method("CVODE Adams", True, _decades(0, 8), by_cvode("Adams")),
    Method("CVODE BDF", True, _decades(0, 6), by_cvode("BDF")),
)
