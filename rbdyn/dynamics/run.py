"""One replicate under way: its integrator, its memory and where it is; and the choice of its method.

An explicit method integrates a run, or the linearly implicit method where stability limits the steps. A step of that method
costs about nine explicit ones, so it pays only where it can be much longer. "auto" tries both on a copy of the run over
the same stretch and counts right-hand sides. It reads no clock, so equal scenes choose alike.
"""

import math
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError, RunError
from rbdyn.base.notes import Note, Notes
from rbdyn.dynamics.ensemble import Pace, Stop
from rbdyn.dynamics.forces.cage import Impacts, has_stopping_film
from rbdyn.dynamics.forces.equations import OF_MOTION, RollerBearing, mechanical_energy, without
from rbdyn.dynamics.forces.race_samples import RaceSamples
from rbdyn.dynamics.forces.state import CAGE_X, INNER_ANGLE, OUTER_ANGLE, RING_X, name
from rbdyn.dynamics.integrators import advance
from rbdyn.dynamics.integrators.runge_kutta import DormandPrince
from rbdyn.dynamics.parameters import state
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene

# A run looks for interruptions between so many steps: some hundredths of a second, half a second by the implicit method.
STEPS_AT_ONCE = 10_000
STATUSES = tuple(advance.Status)
LARGEST_STEP_TURNS = 0.02
SMALLEST_STEP_TURNS = 1e-12


class Run:
    """One replicate under way: parameters, integrator memory and where it is.

    ``longest_step`` [s] limits the steps. ``begin``: state of an earlier run where it begins. ``method``: "auto" until its first step, where the scene leaves it open;
    ``spent_s``: time that its steps took; ``pace``: states the time of all runs and knows this one by its ``ticket``.
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
        begin: Array | None = None,
    ) -> None:
        self.scene, self.bearing, self.replicate, self.stop = scene, bearing, replicate, stop
        self.pace, self.spent_s = pace, 0.0
        self.ticket = 0 if pace is None else pace.enter()
        self.rtol, self.longest_step = rtol, longest_step
        self.layout = state.layout_of(scene)
        seeds = np.random.SeedSequence(scene.numerics.seed, spawn_key=(replicate,))
        if begin is None:
            begin = state.start_state(scene, bearing, np.random.default_rng(seeds), state.wall_of(scene, replicate))
        numerics = scene.numerics
        self.method: str = numerics.method
        self.explicit = explicit_method(scene)
        self.chosen = False
        first_method = self.explicit if self.method == "auto" else self.method
        first_step = 1e-3 * state.scales(scene).length / state.scales(scene).speed
        self.carry = advance.carry_from(
            begin.copy(), bearing.rollers, first_step, method_of(first_method, scene, bearing)
        )
        self.tally = advance.empty_tally(
            bearing.rollers, isinstance(bearing.impacts, Impacts), isinstance(bearing.samples, RaceSamples)
        )
        self.sample_step = scene.turn_s / numerics.samples_per_turn
        self.control = self._control_by(first_method)

    def trace(self, spacing: float, room: int) -> None:
        """From now on trace the centre of the cage, x and y, and of the ring that moves and guides it, so many seconds apart.

        The reader of ``carry.trace`` empties it before so many samples have filled its ``room``.
        """
        bodies = [self.layout.first_body + CAGE_X]
        if self.scene.cage.guidance == "inner":
            bodies.append(self.layout.first_body + RING_X)
        elif self.layout.support is not None:
            bodies.append(self.layout.support)
        components = [place for body in bodies for place in (body, body + 1)]
        self.carry = self.carry._replace(trace=advance.trace_of(components, spacing, room))
        self.carry.clock[advance.TRACED] = self.carry.clock[advance.NOW]

    def choose_method(self) -> None:
        """Replace "auto" by the cheaper method, and even the steps of Verlet where that counts, by a trial from where the run is."""
        if self.chosen or self.method not in ("auto", "verlet"):
            return
        scene, bearing = self.scene, self.bearing
        # Elastic contacts have no stiff traction, and the implicit method has no room for their coefficients.
        compared = self.method == "auto" and not scene.traction.elasticity
        self.chosen, self.method = True, self.explicit
        slow = state.light_contact(scene) is not None
        evened = slow and self.method == "verlet" and self.longest_step == math.inf
        if not (compared or evened):
            return
        short = self._control_by(self.explicit)._replace(step_budget=steps_as_cheap(self.explicit, TRIAL_STEPS))
        trial = trial_of(scene, bearing, short, self.carry, self.tally, self.sample_step)
        if compared:
            short = self._control_by("rosenbrock")._replace(step_budget=TRIAL_STEPS)
            if implicit_is_cheaper(scene, bearing, short, trial, self.tally, self.sample_step):
                self.method = "rosenbrock"
                # The implicit method shows no stiffness of its own.
                self.carry.stiffness[:] = trial.end.stiffness
                self.carry = self.carry._replace(method=method_of(self.method, scene, bearing))
                self.control = self._control_by(self.method)._replace(step_budget=self.control.step_budget)
                return
        if evened and (has_stopping_film(bearing.guide) or held_by_stability(trial.end.stiffness) >= STIFF_SHARE):
            even = min(self.control.largest_step, EVEN_SHARE * trial.mean_step)
            self.control = self.control._replace(largest_step=even)

    def _control_by(self, method: str) -> advance.Control:
        numerics = self.scene.numerics
        turns = numerics.turns + numerics.warm_up_turns
        return advance.Control(
            1.0 / state.absolute_tolerance(self.scene, self.bearing, self.rtol, method),
            SMALLEST_STEP_TURNS * self.scene.turn_s,
            min(LARGEST_STEP_TURNS * self.scene.turn_s, self.longest_step),
            self._budget(turns),
        )

    def allow(self, turns: float) -> None:
        """Raise the budget of steps to that of so many shaft turns since the start."""
        self.control = self.control._replace(step_budget=max(self.control.step_budget, self._budget(turns)))

    def _budget(self, turns: float) -> int:
        steps = steps_as_cheap(self.explicit, self.scene.numerics.step_budget_per_turn)
        return int(min(steps * math.ceil(turns), 2**62))

    def to(self, turns: float) -> None:
        """Advance to a time given in shaft turns since the start. Raises RunError or CancelledError."""
        end = turns * self.scene.turn_s
        # The first choice compiles the methods that it compares.
        self.choose_method()
        started = time.perf_counter() - self.spent_s
        budget = self.control.step_budget
        while True:
            self.stop.check()
            control = self.control._replace(step_budget=min(self.steps + STEPS_AT_ONCE, budget))
            code = advance.advance(self.bearing, control, self.carry, self.tally, end, self.sample_step)
            status = STATUSES[code]
            self.spent_s = time.perf_counter() - started
            if self.pace is not None:
                turned = float(self.carry.clock[advance.NOW]) / self.scene.turn_s
                self.pace.look(self.ticket, self.spent_s, turned)
            if status is advance.Status.FINISHED:
                return
            if status is not advance.Status.STEP_BUDGET or self.steps >= budget:
                raise RunError(self._why(status))

    @property
    def steps(self) -> int:
        """Steps tried, the refused ones included."""
        return int(self.carry.counts[advance.ACCEPTED] + self.carry.counts[advance.REJECTED])

    def forget(self) -> None:
        """Start counting here: empty the tally and sample from now on."""
        for sums in self.tally:
            sums[:] = 0.0
        self.carry.clock[advance.SAMPLE] = self.carry.clock[advance.NOW]

    def clock_angles(self) -> Array:
        """Angles of inner and outer ring [rad] since the start."""
        clock = self.layout.clock
        if clock is None:
            return self.carry.clock[advance.NOW] * np.array(self.scene.operation.speeds)
        return self.carry.y[clock + INNER_ANGLE : clock + OUTER_ANGLE + 1].copy()

    def energies(self) -> tuple[float, float, float]:
        """Kinetic, elastic and potential energy [J] of the present state."""
        energies: tuple[float, float, float] = mechanical_energy(without(self.bearing, OF_MOTION), self.carry.y)
        return energies

    def _why(self, status: advance.Status) -> str:
        time_s = self.carry.clock[advance.NOW]
        message, remedy = status.value
        component, step = name(int(self.carry.counts[advance.WORST]), self.layout), self.carry.clock[advance.STEP]
        reason = message.format(component=component, step=step, spent_s=self.spent_s, **self.control._asdict())
        if status is advance.Status.STEP_BUDGET and self.scene.numerics.method in EXPLICIT:
            remedy = f"take numerics.method = auto, {remedy}"
        return (
            f"replicate {self.replicate + 1} (seed {self.scene.numerics.seed}) stopped at t = {time_s:.6g} s, shaft turn "
            f"{time_s / self.scene.turn_s:.4g}: {reason}; {remedy}"
        )


def with_numerics(scene: Scene, **changes: Any) -> Scene:
    """The scene with other numerics, which are not validated."""
    return scene.model_copy(update={"numerics": scene.numerics.model_copy(update=changes)})


def prepare(scene: Scene, bearing: RollerBearing) -> float:
    """Compile, or load from disk, what the scene needs; returns the seconds that it took."""
    started = time.perf_counter()
    run = Run(scene, bearing, 0, scene.numerics.rtol, Stop())
    run.to(0.0)
    run.energies()
    return time.perf_counter() - started


EXPLICIT = ("rk45", "verlet")
# From this tolerance on one right-hand side a step saves more of them than the fifth order does. There is no trial, which
# would compile both.
LOOSE_FROM = 5e-3
# From this share of steps limited by stability on a run counts as stiff.
STIFF_SHARE = 0.5
# Length of the trial, after as long a start, and its steps at most.
TRIAL_TURNS, TRIAL_STEPS = 0.05, 20_000
# In a slow bearing rollers outside the load zone hardly press, and jump. Steps of Verlet whose size changes act on that like a
# damping. So the run takes even steps where stability limits them, this share of the mean step of the trial. The loss of the bearing
# of Chen et al. 2022 at 2000, 1000 and 500 rpm is then off by 0.0, 0.4 and 0.5 +- 0.1 instead of 0.7, 1.2 and 0.7 %, its whirl at
# 1000 rpm by -0.6 +- 1.8 instead of -4.2 +- 2.1 %. With elastic contacts an NU 2205 at 1326 rpm loses -0.02 instead of 0.4 +- 0.06 % too
# much, its whirl goes from 0.985 to 0.996 +- 0.004; so does an NU 2208 at 0 C and 1000 rpm whose cage a film stops, from 0.35 +- 0.1 to 0.0 %.
EVEN_SHARE = 0.85
# The implicit method takes 100 to 500 steps a turn, however stiff the bearing: below this number of right-hand sides a turn the
# explicit one is cheaper, and a limit by stability deserves no note.
FEWEST_PER_TURN = 8000
# Processor time of the implicit method over that of the explicit one, per right-hand side: linear algebra, and
# right-hand sides of one roller that fill no vectors (10 rollers, measured).
IMPLICIT_OVERHEAD = 3.0


def steps_as_cheap(method: str, steps: int) -> int:
    """Steps of a method that cost as much as so many ``steps`` of Dormand and Prince: six of Verlet are one."""
    return 6 * steps if method == "verlet" else steps


def explicit_method(scene: Scene) -> str:
    """The explicit method that a scene starts with: the one it names, else "verlet" or, at tight tolerances, "rk45".

    For the bearing of Chen et al. 2022 verlet at 1e-2 takes 890 right-hand sides a turn, and rk45 2510 at 1e-3, the loosest at
    which it is free of bias. At 2000 rpm stability limits both, to 7000 and 24 700.
    """
    if scene.numerics.method in EXPLICIT:
        return scene.numerics.method
    return "rk45" if scene.numerics.rtol < LOOSE_FROM else "verlet"


def method_of(name: str, scene: Scene, bearing: RollerBearing) -> Any:
    """The method "rk45", "verlet" or "rosenbrock" for this bearing."""
    if name == "rosenbrock":
        if scene.traction.elasticity:
            raise MethodError(
                "the implicit method knows no traction coefficients as states; leave out traction.elasticity"
            )
        from rbdyn.dynamics.integrators.rosenbrock import rodas

        return rodas(state.layout_of(scene), bearing, state.increments(scene, bearing))
    if name == "verlet":
        from rbdyn.dynamics.integrators.verlet import Verlet

        return Verlet(2 * bearing.rollers)
    return DormandPrince()


class Trial(NamedTuple):
    """A stretch of a run by its explicit method, after as long a start: memory at both ends, and why it ended; the run does not change."""

    start: advance.Carry
    end: advance.Carry
    status: int

    @property
    def ended(self) -> bool:
        """Whether nothing but its budget of steps kept it from its end."""
        return self.status in (advance.FINISHED, advance.STEP_BUDGET)

    @property
    def duration(self) -> float:
        """Time that it took [s]."""
        return float(self.end.clock[advance.NOW] - self.start.clock[advance.NOW])

    @property
    def mean_step(self) -> float:
        """Mean step [s]; infinite without a step."""
        steps = int(self.end.counts[advance.ACCEPTED])
        return self.duration / steps if steps else math.inf

    @property
    def derivatives(self) -> int:
        """Right-hand sides."""
        return int(self.end.counts[advance.DERIVATIVES] - self.start.counts[advance.DERIVATIVES])


def trial_of(
    scene: Scene,
    bearing: RollerBearing,
    control: advance.Control,
    carry: advance.Carry,
    tally: advance.Tally,
    sample_step: float,
) -> Trial:
    """The ``Trial`` from where a run is."""
    trial_s = TRIAL_TURNS * scene.turn_s
    run, book = _copy(carry), _copy_tally(tally)
    run.clock[advance.TRACED] = math.inf
    status = advance.advance(bearing, control, run, book, trial_s, sample_step)
    start = _copy(run)
    for counts in (start.counts, run.counts):
        counts[[advance.ACCEPTED, advance.REJECTED]] = 0
    run.stiffness[:] = 0.0
    if status in (advance.FINISHED, advance.STEP_BUDGET):
        status = advance.advance(bearing, control, run, book, run.clock[advance.NOW] + trial_s, sample_step)
    return Trial(start, run, status)


def implicit_is_cheaper(
    scene: Scene,
    bearing: RollerBearing,
    control: advance.Control,
    trial: Trial,
    tally: advance.Tally,
    sample_step: float,
) -> bool:
    """Whether "rosenbrock" with its step ``control`` goes through a stiff ``trial`` at a lower price, or that one could not go on."""
    if not trial.ended:
        return True
    turns = trial.duration / scene.turn_s
    if held_by_stability(trial.end.stiffness) < STIFF_SHARE or trial.derivatives < FEWEST_PER_TURN * turns:
        return False
    run = _copy(trial.start)._replace(method=method_of("rosenbrock", scene, bearing))
    end = trial.end.clock[advance.NOW]
    if advance.advance(bearing, control, run, _copy_tally(tally), end, sample_step) != advance.FINISHED:
        return False
    taken = int(run.counts[advance.DERIVATIVES] - trial.start.counts[advance.DERIVATIVES])
    return IMPLICIT_OVERHEAD * taken < trial.derivatives


def _copy_tally(tally: advance.Tally) -> advance.Tally:
    return advance.Tally(*(sums.copy() for sums in tally))


def _copy(carry: advance.Carry) -> advance.Carry:
    """A copy that shares only the work space."""
    data: dict[str, Any] = {key: part.copy() for key, part in carry._asdict().items() if isinstance(part, np.ndarray)}
    return carry._replace(**data)


def held_by_stability(stiffness: Sequence[float] | np.ndarray) -> float:
    """Share of the explicit steps tested that stability limited, not accuracy."""
    return float(stiffness[advance.LIMITED] / stiffness[advance.TESTED]) if stiffness[advance.TESTED] > 0.0 else 0.0


def largest_eigenvalue(stiffness: Sequence[float] | np.ndarray) -> float:
    """Mean |eigenvalue| [1/s] of the motion that limited them; zero where none did."""
    return (
        float(stiffness[advance.EIGENVALUES] / stiffness[advance.LIMITED]) if stiffness[advance.LIMITED] > 0.0 else 0.0
    )


def stiffness_cost(runs: Sequence[Replicate]) -> dict[str, float]:
    """Stiffness in the cost of a result: share of steps limited by stability, |eigenvalue| [1/s], runs by the implicit method."""
    total = np.sum([run.stiffness for run in runs], axis=0)
    return {
        "held_by_stability": held_by_stability(total),
        "eigenvalue_1_s": largest_eigenvalue(total),
        "implicit_runs": sum(run.method == "rosenbrock" for run in runs),
    }


def stiffness_notes(scene: Scene, runs: Sequence[Replicate]) -> Notes:
    """Notes on stiffness and method."""
    cost = stiffness_cost(runs)
    if cost["implicit_runs"] and scene.numerics.method == "auto":
        sentence = (
            f"method: {cost['implicit_runs']:g} of {len(runs)} runs use the linearly implicit one, because stability would limit "
            "explicit steps and a trial showed it to be cheaper"
        )
        return (Note("method", sentence),)
    turns = sum(float(run.durations.sum()) for run in runs) / scene.turn_s
    derivatives = sum(run.derivatives for run in runs)
    if cost["held_by_stability"] < STIFF_SHARE or derivatives < FEWEST_PER_TURN * turns:
        return ()
    limit = (
        f"method: stability, not accuracy, limits {100.0 * cost['held_by_stability']:.0f} % of the steps: the fastest motion takes "
        f"{1.0 / cost['eigenvalue_1_s']:.2g} s, a shaft turn {scene.turn_s:.2g} s; looser tolerances save nothing"
    )
    if scene.numerics.method in EXPLICIT:
        return (
            Note(
                "method", f"{limit}; let numerics.method = 'auto' try the implicit method, or soften the stiffest law"
            ),
        )
    return (Note("method", f"{limit}; soften the stiffest law (traction slope, film floor, light cage)"),)
