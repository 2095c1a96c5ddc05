"""How companions are integrated, the runs by which the numerical error of others is known.

Companions at another tolerance show the bias that the tolerance leaves (``rbdyn.dynamics.statistics.bias``). They do not
show that of a step which stability holds, for it is the same at every looser tolerance. Such a step hurts in slow bearings:
rollers outside the load zone lie on the outer race by their centrifugal force alone, and jump on it. An explicit pair damps
this vibration of frequency omega by (h omega)^5/C a radian. C follows from its stability function, for which |R(i x)| is
1 - x^6/C: 144 of Kutta's pair, 3600 of Dormand and Prince's (Hairer and Wanner, Solving ODEs II, IV.2). At 2000 rpm and 4 kN
the bearing of Chen et al. 2022 has 1.2 % too much rolling resistance at a numerical damping ratio of 8e-3, 0.5 % at 6e-4
and 0.08 % at 2e-5 to 7e-5, whichever the pair. Companions of such runs take steps short enough for this vibration. A tenth of the bias is
left in them, so ten ninths of their difference from the runs count.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from rbdyn.dynamics.parameters.scales import light_contact_frequency
from rbdyn.dynamics.statistics.bias import FACTOR, bias_scale, companion_tolerance
from rbdyn.dynamics.statistics.metrics import Replicate
from rbdyn.scene import Scene

# C of each explicit pair.
DAMPING_SCALE = {"rk45": 3600.0, "rk43": 144.0}
# Numerical damping ratio of a light contact that counts, and the one of companions that resolve it.
DAMPED, RESOLVED = 1e-4, 2e-5
# Tolerance over that of runs whose steps stability holds, at which the tolerance itself makes them short enough.
TIGHT = 1e-4


class Companions(NamedTuple):
    """How companions are integrated: tolerance, method, longest step [s]; and which share of the difference between runs and
    companions is taken for the bias of the runs."""

    rtol: float
    method: str
    longest_step: float
    share: float

    @property
    def resolve_more(self) -> bool:
        """Whether they take shorter steps than their tolerance asks for."""
        return math.isfinite(self.longest_step)


def usual_companions(scene: Scene) -> Companions:
    """Companions of runs whose steps the tolerance rules."""
    numerics = scene.numerics
    return Companions(companion_tolerance(numerics.rtol), numerics.method, math.inf, bias_scale(numerics.rtol))


def companions_of(scene: Scene, runs: Sequence[Replicate]) -> Companions:
    """Companions of these runs, by the steps that they took."""
    frequency, methods = light_contact_frequency(scene), {run.method for run in runs}
    method = methods.pop()
    if frequency is None or methods or method not in DAMPING_SCALE:
        return usual_companions(scene)
    scale = DAMPING_SCALE[method]
    step = sum(float(run.durations.sum()) for run in runs) / sum(run.accepted_steps for run in runs)
    if (step * frequency) ** 5 <= DAMPED * scale:
        return usual_companions(scene)
    return Companions(
        scene.numerics.rtol / FACTOR, method, (RESOLVED * scale) ** 0.2 / frequency, FACTOR / (FACTOR - 1.0)
    )
