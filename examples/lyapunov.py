"""Largest Lyapunov exponent of a bearing: how fast two runs with almost the same start separate; positive means chaos.

``python examples/lyapunov.py SCENE.toml [--turns N]`` prints it a shaft turn, with its 95 % interval. It follows two
trajectories with repeated renormalisation (Benettin, Galgani, Giorgilli and Strelcyn 1980). The second starts a small
separation away. Every tenth of a turn its growth is noted, and the separation is reset to its first size.
"""

import argparse
import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rbdyn import Scene
from rbdyn.base.arrays import Array
from rbdyn.base.words import with_error
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.integrators.advance import DERIVATIVES
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import absolute_tolerance
from rbdyn.dynamics.run import Run, with_numerics
from rbdyn.dynamics.statistics.batch_means import student_half_width

RENORMALISE_TURNS = 0.1
# In the norm of the error control: lengths in approaches of a race contact (about a micrometre), speeds likewise.
SEPARATION = 1e-3
# Per step and in the same norm: the errors of some hundred steps, after a little growth, stay below the separation.
RTOL = 1e-7
# Turns in which the separation turns into the direction of fastest growth; they do not count.
ALIGN_TURNS = 3.0
# The interval comes from the scatter of blocks, none shorter than a turn: longer than the memory of the growth.
BLOCKS, SHORTEST_BLOCK_TURNS = 20, 1.0


class Exponent(NamedTuple):
    """Largest exponent a shaft turn, the half-width of its 95 % interval (None of one block), and those of the ``blocks``."""

    per_turn: float
    half_width: float | None
    blocks: Array


def lyapunov_exponent(
    scene: Scene, turns: float = 100.0, replicate: int = 0, separation: float = SEPARATION, rtol: float = RTOL
) -> Exponent:
    """Largest Lyapunov exponent over ``turns`` counted shaft turns, after the discarded ones. Raises RunError.

    ``separation`` and ``rtol`` are fractions of the same error scales; the exponent does not depend on them as long as
    rtol << separation << 1 (a ratio of 1e-4; at 1e-2 the errors of the integrator part the runs, not the motion). The
    half-width is Student's t over blocks of a twentieth of the turns; None for less than two turns.
    """
    scene = with_numerics(scene, turns=turns + ALIGN_TURNS)
    bearing, stop = roller_bearing(scene), Stop()
    leader = Run(scene, bearing, replicate, rtol, stop)
    follower = Run(scene, bearing, replicate, rtol, stop)
    begin = scene.numerics.warm_up_turns
    follower.choose_method()
    leader.to(begin)
    follower.carry.clock[:] = leader.carry.clock
    # The clock of a scene that depends on time has no scale, and both runs share it.
    weight = 1.0 / absolute_tolerance(scene, bearing, 1.0)
    draw = np.random.default_rng(np.random.SeedSequence(scene.numerics.seed, spawn_key=(replicate, 1)))
    apart = np.where(weight > 0.0, draw.standard_normal(weight.size), 0.0)
    apart[weight > 0.0] /= weight[weight > 0.0]
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
        apart = np.where(weight > 0.0, follower.carry.y - leader.carry.y, 0.0)
        growth[index] = math.log(_norm(apart, weight) / separation)
    counted = growth[round(ALIGN_TURNS / RENORMALISE_TURNS) :] / RENORMALISE_TURNS
    count = max(min(BLOCKS, int(turns / SHORTEST_BLOCK_TURNS)), 1)
    blocks = np.array([part.mean() for part in np.array_split(counted, count)])
    return Exponent(float(blocks.mean()), student_half_width(blocks), blocks)


def _norm(difference: Array, weight: Array) -> float:
    return float(np.linalg.norm(difference * weight))


def main() -> None:
    """Print the exponent of a scene."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--turns", type=float, default=100.0)
    given = parser.parse_args()
    found = lyapunov_exponent(Scene.load(given.scene), given.turns)
    print(f"largest Lyapunov exponent a shaft turn: {with_error(found.per_turn, found.half_width)}")


if __name__ == "__main__":
    main()
