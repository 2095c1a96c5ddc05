"""Largest Lyapunov exponent: how fast two runs that start all but alike part. Positive means chaos.

Two trajectories with repeated renormalisation (Benettin, Galgani, Giorgilli and Strelcyn 1980): the second starts a
small separation away, and every tenth of a turn the growth is noted and the separation drawn back to its size.
"""

import math
import time

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.records import Record, derived, keyed, outside_json
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.integrators.records import DERIVATIVES
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import absolute_tolerance
from rbdyn.dynamics.run import Run, with_numerics
from rbdyn.dynamics.statistics.batch_means import student_half_width
from rbdyn.scene import Scene

RENORMALISE_TURNS = 0.1
# In the norm of the error control: lengths in approaches of a race contact (about a micrometre), speeds likewise.
SEPARATION = 1e-3
# Per step and in the same norm: the errors of some hundred steps, grown a little, stay below the separation.
RTOL = 1e-7
# Turns in which the separation turns into the direction of fastest growth; they do not count.
ALIGN_TURNS = 3.0
# The interval rests on the scatter of blocks, none shorter than a turn: longer than the growth remembers.
BLOCKS, SHORTEST_BLOCK_TURNS = 20, 1.0


class LyapunovExponent(Record):
    """Largest exponent [1/s] and a shaft turn, with the half-widths of their 95 % intervals, None where there is one block.

    ``blocks``: exponents of the parts of the run [1/s], (blocks,); ``separation``, ``rtol``: in the norm of the errors.
    """

    per_second: float
    half_width: float | None = keyed("per_second_half_width")
    per_turn: float = derived(lambda self: self.per_second * self.turn_s)
    per_turn_half_width: float | None = derived(
        lambda self: None if self.half_width is None else self.half_width * self.turn_s
    )
    turns: float
    separation: float
    rtol: float
    cost: dict[str, float]
    turn_s: float = outside_json()
    blocks: Array = outside_json()


def lyapunov_exponent(
    scene: Scene, turns: float = 100.0, replicate: int = 0, separation: float = SEPARATION, rtol: float = RTOL
) -> LyapunovExponent:
    """Largest Lyapunov exponent over ``turns`` counted shaft turns, after the discarded ones. Raises RunError.

    ``separation`` and ``rtol`` are fractions of the same error scales; the exponent does not depend on them as long as
    rtol << separation << 1 (a ratio of 1e-4; at 1e-2 the errors of the integrator part the runs, not the motion). The
    half-width is Student's t over blocks of a twentieth of the turns; None for less than two turns.
    """
    started = time.perf_counter()
    scene = with_numerics(scene, turns=turns + ALIGN_TURNS)
    bearing, stop = roller_bearing(scene), Stop()
    leader = Run(scene, bearing, replicate, rtol, stop)
    follower = Run(scene, bearing, replicate, rtol, stop)
    begin = scene.numerics.warm_up_turns
    follower.choose_method()
    leader.to(begin)
    follower.carry.clock[:] = leader.carry.clock
    # The clock of a scene that depends on time has no scale, and is not moved apart.
    weight = 1.0 / absolute_tolerance(scene, bearing, 1.0)
    draw = np.random.default_rng(np.random.SeedSequence(scene.numerics.seed, spawn_key=(replicate, 1)))
    apart = np.where(weight > 0.0, draw.standard_normal(weight.size), 0.0)
    apart[weight > 0.0] /= weight[weight > 0.0]
    derivatives = int(leader.carry.counts[DERIVATIVES])
    intervals = round((turns + ALIGN_TURNS) / RENORMALISE_TURNS)
    growth = np.empty(intervals)
    for index in range(intervals):
        # Back to the size of the separation, in the direction in which the runs parted.
        apart *= separation / _norm(apart, weight)
        follower.carry.y[:] = leader.carry.y + apart
        # The first stage is that of the new state.
        leader.carry.counts[DERIVATIVES] = follower.carry.counts[DERIVATIVES] = 0
        until = begin + (index + 1) * RENORMALISE_TURNS
        for run in (leader, follower):
            run.to(until)
            derivatives += int(run.carry.counts[DERIVATIVES])
        apart = np.where(weight > 0.0, follower.carry.y - leader.carry.y, 0.0)
        growth[index] = math.log(_norm(apart, weight) / separation)
    counted = growth[round(ALIGN_TURNS / RENORMALISE_TURNS) :] / (RENORMALISE_TURNS * scene.turn_s)
    count = max(min(BLOCKS, int(turns / SHORTEST_BLOCK_TURNS)), 1)
    blocks = np.array([part.mean() for part in np.array_split(counted, count)])
    return LyapunovExponent(
        per_second=float(counted.mean()),
        half_width=student_half_width(blocks),
        turn_s=scene.turn_s,
        blocks=blocks,
        turns=turns,
        separation=separation,
        rtol=rtol,
        cost={"wall_s": time.perf_counter() - started, "rhs_evaluations": derivatives},
    )


def _norm(difference: Array, weight: Array) -> float:
    return float(np.linalg.norm(difference * weight))
