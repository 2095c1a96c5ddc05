"""One replicate recorded in equal batches of about a shaft turn, from its start to its end."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rbdyn.dynamics.energy import mechanical_energy
from rbdyn.dynamics.equations import LOADS, POWERS
from rbdyn.dynamics.geometry import raceway_radii, scales
from rbdyn.dynamics.metrics import Replicate
from rbdyn.dynamics.state import CAGE_ANGLE
from rbdyn.scene import Scene

if TYPE_CHECKING:
    from rbdyn.dynamics.simulate import Run

# Long enough that the step cut at a batch's end costs nothing, short against any memory worth finding.
BATCH_TURNS = 1.0
# Bounds what a very long run keeps.
MOST_BATCHES = 20_000


def batch_ends(scene: Scene) -> tuple[NDArray[np.float64], int, int]:
    """Ends of the batches [shaft turns], how many of them end the warm-up, and how many make an impact window.

    A whole number of batches fits an impact window; the last may be shorter.
    """
    numerics, window = scene.numerics, scene.impact_window_turns
    shortest = max(BATCH_TURNS, numerics.turns / MOST_BATCHES)
    per_window = max(round(window / shortest), 1)
    length = window / per_window
    warm_up = numerics.warm_up_turns
    first = math.ceil(warm_up / max(length, warm_up / MOST_BATCHES) - 1e-9) if warm_up else 0
    counted = math.ceil(numerics.turns / length - 1e-9)
    before = warm_up * np.arange(1, first + 1) / max(first, 1)
    after = np.minimum(np.arange(1, counted + 1) * length, numerics.turns)
    return np.concatenate((before, warm_up + after)), first, per_window


def record(run: Run) -> Replicate:
    """Run to the end, batch by batch. Raises RunError or CancelledError."""
    started = time.thread_time()
    scene, tally = run.scene, run.tally
    ends, first, per_window = batch_ends(scene)
    count, angle = len(ends), 5 * run.bearing.rollers + CAGE_ANGLE
    whirl, work, largest = np.empty((count, 3)), np.empty((count, POWERS)), np.empty((count, LOADS))
    cage, rolling = np.empty(count + 1), np.empty(count + 1)
    # Looked at only where the count may begin or ends.
    energy = np.full(count + 1, np.nan)
    begin = run.clock_angles()

    def look(place: int) -> None:
        cage[place] = run.carry.y[angle]
        rolling[place] = kinematic_cage_angle(scene, begin, run.clock_angles())
        if place in (first, count) or scene.numerics.discard_turns == "auto":
            energy[place] = sum(mechanical_energy(run.bearing, run.carry.y))

    look(0)
    for batch, end in enumerate(ends):
        if batch == first:
            run.forget()
        run.to(end)
        for kept, series in ((tally.whirl, whirl), (tally.work, work), (tally.largest, largest)):
            series[batch] = kept
            kept[:] = 0.0
        look(batch + 1)
    scale = scales(scene)
    return Replicate(
        first=first,
        per_window=per_window,
        durations=np.diff(ends, prepend=0.0) * scene.turn_s,
        whirl=whirl,
        work=work,
        largest=largest,
        cage_angle=np.diff(cage),
        kinematic_angle=np.diff(rolling),
        energy=energy,
        energy_scale=scale.load * scale.length,
        accepted_steps=int(run.carry.counts[0]),
        rejected_steps=int(run.carry.counts[1]),
        derivatives=int(run.carry.counts[2]),
        cpu_s=time.thread_time() - started,
        method=run.method,
        stiffness=run.carry.stiffness.copy(),
    )


def kinematic_cage_angle(scene: Scene, before: NDArray[np.float64], after: NDArray[np.float64]) -> float:
    """Angle [rad] that an epicyclic cage turns while inner and outer ring turn from ``before`` to ``after``."""
    outer, inner = raceway_radii(scene)
    turned = after - before
    return float((turned[0] * inner + turned[1] * outer) / (inner + outer))
