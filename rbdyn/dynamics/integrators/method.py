"""Which method integrates a run: an explicit pair, or the linearly implicit one where stability holds its steps.

A step of the second costs about nine of the first, so it pays only where it can be much longer. "auto" tries both on a
copy of the run, over the same stretch, and counts right-hand sides; no clock is read, so that equal scenes choose alike.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rbdyn.base.faults import MethodError
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.integrators import records as at
from rbdyn.dynamics.integrators.advance import advance
from rbdyn.dynamics.integrators.records import FINISHED, STEP_BUDGET, Carry, Control, Tally
from rbdyn.dynamics.integrators.runge_kutta import DormandPrince, Kutta
from rbdyn.dynamics.statistics.metrics import Replicate
from rbdyn.scene import Scene

EXPLICIT = ("rk45", "rk43")
# From this tolerance on the third-order error estimate of Kutta's pair asks for fewer right-hand sides than the fifth order
# saves. No trial: it would compile both.
KUTTA_FROM = 5e-3
# The trial: this long, this many steps at most, after as long a start.
TRIAL_TURNS, TRIAL_STEPS = 0.05, 20_000
# Share of steps held by stability from which a run counts as stiff.
STIFF_SHARE = 0.5
# The implicit method takes 100 to 500 steps a turn of a bearing however stiff: below this the explicit one is cheaper,
# and steps at their limit of stability are nothing to speak of.
FEWEST_STEPS_PER_TURN = 2000
# Processor time of the implicit method over that of the explicit one, per right-hand side: linear algebra, and
# right-hand sides of one roller that fill no vectors (10 rollers, measured).
IMPLICIT_OVERHEAD = 3.0


def explicit_method(method: str, rtol: float) -> str:
    """The explicit pair that a scene of this method and tolerance starts with, "rk45" or "rk43".

    For the bearing of Chen et al. 2022 rk43 at 1e-2 takes 1890 right-hand sides a turn, rk45 2510 at 1e-3, the loosest at
    which it is free of bias; at 1e-3 rk43 takes 3590.
    """
    if method in EXPLICIT:
        return method
    return "rk43" if rtol >= KUTTA_FROM else "rk45"


def method_of(name: str, scene: Scene, bearing: RollerBearing) -> Any:
    """The method "rk45", "rk43" or "rosenbrock" for this bearing."""
    if name == "rosenbrock":
        if scene.traction.elasticity:
            raise MethodError(
                "the implicit method knows no traction coefficients as states; leave out traction.elasticity"
            )
        from rbdyn.dynamics.integrators.implicit import rodas

        return rodas(scene, bearing)
    return Kutta() if name == "rk43" else DormandPrince()


def cheaper_method(
    scene: Scene,
    bearing: RollerBearing,
    pair: str,
    control_by: Callable[[str], Control],
    carry: Carry,
    tally: Tally,
    sample_step: float,
) -> tuple[str, np.ndarray]:
    """ "rosenbrock" where the explicit method ``pair`` is stiff and a trial shows the other cheaper, else ``pair``; and the
    stiffness that the trial saw.

    ``control_by(method)`` is the step control; ``carry`` and ``tally`` stand at the start of the run and are left as they are.
    """
    # Elastic contacts have no stiff traction, and the implicit method has no room for their coefficients.
    if scene.traction.elasticity:
        return pair, np.zeros(at.STIFFNESS)
    trial_s = TRIAL_TURNS * scene.turn_s
    short = control_by(pair)._replace(step_budget=TRIAL_STEPS)
    run, book = _copy(carry), Tally(*(kept.copy() for kept in tally))
    status = advance(bearing, short, run, book, trial_s, sample_step)
    start = _copy(run)
    derivatives = int(run.counts[at.DERIVATIVES])
    for counts in (start.counts, run.counts):
        counts[:] = 0
        counts[at.DERIVATIVES] = derivatives
    run.stiffness[:] = 0.0
    if status in (FINISHED, STEP_BUDGET):
        status = advance(bearing, short, run, book, run.clock[at.NOW] + trial_s, sample_step)
    if status not in (FINISHED, STEP_BUDGET):
        return "rosenbrock", run.stiffness
    turns = (run.clock[at.NOW] - start.clock[at.NOW]) / scene.turn_s
    steps = run.counts[at.ACCEPTED] + run.counts[at.REJECTED]
    if held_by_stability(run.stiffness) < STIFF_SHARE or steps < FEWEST_STEPS_PER_TURN * turns:
        return pair, run.stiffness
    start = start._replace(method=method_of("rosenbrock", scene, bearing))
    short = control_by("rosenbrock")._replace(step_budget=TRIAL_STEPS)
    if advance(bearing, short, start, book, run.clock[at.NOW], sample_step) != FINISHED:
        return pair, run.stiffness
    cost = IMPLICIT_OVERHEAD * (start.counts[at.DERIVATIVES] - derivatives)
    return "rosenbrock" if cost < run.counts[at.DERIVATIVES] - derivatives else pair, run.stiffness


def _copy(carry: Carry) -> Carry:
    """A run of its own from here on; only the work space is shared."""
    own: dict[str, Any] = {name: part.copy() for name, part in carry._asdict().items() if isinstance(part, np.ndarray)}
    return carry._replace(**own)


def held_by_stability(stiffness: Sequence[float] | np.ndarray) -> float:
    """Share of the explicit steps looked at that stability held, not accuracy."""
    return float(stiffness[at.HELD] / stiffness[at.LOOKED_AT]) if stiffness[at.LOOKED_AT] > 0.0 else 0.0


def largest_eigenvalue(stiffness: Sequence[float] | np.ndarray) -> float:
    """Mean |eigenvalue| [1/s] of the motion that held them; zero where none did."""
    return float(stiffness[at.EIGENVALUES] / stiffness[at.HELD]) if stiffness[at.HELD] > 0.0 else 0.0


def stiffness_cost(runs: Sequence[Replicate]) -> dict[str, float]:
    """What the cost of a result says about stiffness: share of steps, |eigenvalue| [1/s], runs by the implicit method."""
    total = np.sum([run.stiffness for run in runs], axis=0)
    return {
        "held_by_stability": held_by_stability(total),
        "eigenvalue_1_s": largest_eigenvalue(total),
        "implicit_runs": sum(run.method == "rosenbrock" for run in runs),
    }


def stiffness_notes(scene: Scene, runs: Sequence[Replicate]) -> tuple[str, ...]:
    """What a reader should know of stiffness and method."""
    cost = stiffness_cost(runs)
    if cost["implicit_runs"] and scene.numerics.method == "auto":
        return (
            f"method: {cost['implicit_runs']:g} of {len(runs)} runs by the linearly implicit one, because stability would "
            "hold the explicit steps and a trial showed it cheaper",
        )
    turns = sum(float(run.durations.sum()) for run in runs) / scene.turn_s
    steps = sum(run.accepted_steps + run.rejected_steps for run in runs)
    if cost["held_by_stability"] < STIFF_SHARE or steps < FEWEST_STEPS_PER_TURN * turns:
        return ()
    time_s = 1.0 / cost["eigenvalue_1_s"]
    fix = "numerics.method = 'auto' tries the implicit one; " if scene.numerics.method in EXPLICIT else ""
    return (
        f"steps are held by stability, not accuracy, in {100.0 * cost['held_by_stability']:.0f} % of the run: the fastest "
        f"motion takes {time_s:.2g} s, a shaft turn {scene.turn_s:.2g} s; {fix}looser tolerances save nothing, "
        "softening the stiffest law (traction slope, film floor, light cage) does",
    )
