"""How long the slow motions of a bearing take to relax, from its linearised equations of motion.

Contacts ring in microseconds, but the cage's spin, the velocity of its centre and the spins of the rollers lose a
disturbance only as fast as braking and driving moments change with them: in the time inertia over slope of the moments.
Most moments act in passing contacts, so the slope is the mean over states of the running bearing. A run that counts fewer
turns than a few such times shows the start of the bearing, not its steady figures, and no test of drift can see that.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbdyn.arrays import Array
from rbdyn.dynamics.forces.state import CAGE_SPEED, CAGE_VX, CAGE_VY
from rbdyn.dynamics.integrators.advance import advance
from rbdyn.dynamics.integrators.records import carry_from, empty_tally
from rbdyn.dynamics.parameters.scales import absolute_tolerance, layout_of, scales
from rbdyn.dynamics.run import Run

MOTIONS = ("the spin of the cage", "the motion of the cage's centre", "the spin of the rollers")
# Change of a speed by which slopes are taken, over the speed that a contact can make.
INCREMENT = 1e-4
# Time after which accelerations are read, over that of a contact: short of any change.
READING = 1e-6


class Linearised:
    """Reads decay rates in states along the way of a run."""

    def __init__(self, run: Run) -> None:
        scene = run.scene
        state, z, scale = layout_of(scene), scene.bearing.rollers, scales(scene)
        cage = state.first_body
        self.run, self.reading_s = run, READING * scale.length / scale.speed
        self.motions = ([cage + CAGE_SPEED], [cage + CAGE_VX, cage + CAGE_VY], list(range(4 * z, 5 * z)))
        self.increments = INCREMENT * absolute_tolerance(scene, run.bearing, 1.0)
        first = state.coefficients
        self.coefficients = [] if first is None else list(range(first, state.size))
        self.book = empty_tally()

    def decay_rates(self) -> Array:
        """Rates [1/s] at which each of ``MOTIONS`` decays in the present state of the run, which stays as it is."""
        at_rest, following, rates = self._accelerations([]), self.coefficients, []
        if following:
            # Each coefficient follows its steady value at a rate of its own.
            alone = (at_rest - self._accelerations(following))[following] / self.increments[following]
        for places in self.motions:
            change = self._accelerations(places) - at_rest
            if following:
                change = self._accelerations(places, change[following] / alone) - at_rest
            rates.append(-float(np.mean(change[places] / self.increments[places])))
        return np.array(rates)

    def _accelerations(self, places: Sequence[int], coefficients: Array | None = None) -> Array:
        """Rates of change of the state where the speeds at some places are larger by their increments, and the traction
        coefficients, where they are states, by ``coefficients``.
        """
        run, y = self.run, self.run.carry.y.copy()
        y[places] += self.increments[places]
        if coefficients is not None:
            y[self.coefficients] += coefficients
        probe = carry_from(y, run.bearing.rollers, self.reading_s, run.carry.method)
        advance(run.bearing, run.control, probe, self.book, self.reading_s, run.scene.turn_s)
        return probe.k[0]


class Relaxation(NamedTuple):
    """The slowest motion and the time [s] in which it relaxes."""

    motion: str
    time_s: float


def slowest(rates: Array) -> Relaxation | None:
    """Slowest motion by decay rates (states, motions) [1/s]; None where no state was looked at or none of them decays.

    Few states tell a rate roughly: it counts as one standard error larger, so that no run is lengthened for noise. A motion
    that does not decay even so excites itself, and has no relaxation time.
    """
    count = len(rates)
    if count < 2:
        return None
    likely = rates.mean(axis=0) + rates.std(axis=0, ddof=1) / math.sqrt(count)
    times = [Relaxation(name, 1.0 / rate) for name, rate in zip(MOTIONS, likely.tolist(), strict=True) if rate > 0.0]
    return max(times, key=lambda each: each.time_s, default=None)
