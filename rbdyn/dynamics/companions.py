"""How companions are integrated, the runs by which the numerical error of others is known.

Companions at another tolerance show the bias that the tolerance leaves (``rbdyn.dynamics.statistics.metrics``). They do not
show that of a step which stability holds, for it is the same at every looser tolerance. Such a step hurts in slow bearings:
rollers outside the load zone lie on the outer race by their centrifugal force alone, and jump on it. A method damps
this vibration of frequency omega by (h omega)^5/C a radian. C follows from its stability function, for which |R(i x)| is
1 - x^6/C: 144 of Kutta's pair, 3600 of Dormand and Prince's (Hairer and Wanner, Solving ODEs II, IV.2), 11 500 of RODAS4,
which damps less where x is above 1.

What counts is this damping compared with that of the race at so light a load, which engages over an approach that light contacts
hardly make. At 2000 rpm and 4 kN the bearing of Chen et al. 2022 has a damping ratio of 4.9e-4 there. Its loss rises with
the logarithm of the damping, by 1.5 % a decade from 2e-5 to 2e-3, by 0.4 +- 0.4 % below and hardly beyond, whether the law or
the method damps: by 1.2 % at a numerical damping ratio of 8e-3, by 0.5 % at 6e-4, by 0.08 % at 2e-5 to 7e-5. Companions of such
runs take steps so short that a tenth of this bias is left, so ten ninths of their difference from the runs count.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from rbdyn.dynamics.parameters.state import LightContact, light_contact
from rbdyn.dynamics.statistics.metrics import FACTOR, Replicate, bias_scale, companion_tolerance
from rbdyn.scene import Scene

# C of each method.
DAMPING_SCALE = {"rk45": 3600.0, "rk43": 144.0, "rosenbrock": 11_500.0}
# Numerical damping of a light contact that counts, over that of the race.
DAMPED = 0.2
# Damping ratios between which the loss depends on them most: below the first something else ends the jumps, beyond the other
# rollers hardly jump.
LEAST_DAMPING, MOST_DAMPING = 2e-5, 2e-3
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
    light = light_contact(scene)
    if light is None:
        return usual_companions(scene)
    damping, method = max(
        (numerical_damping(light, mean_step(runs, one), one), one) for one in {run.method for run in runs}
    )
    race = max(light.damping, LEAST_DAMPING)
    if damping <= DAMPED * race:
        return usual_companions(scene)
    step = longest_step(light, resolved_damping(damping, race), method)
    return Companions(scene.numerics.rtol / FACTOR, method, step, FACTOR / (FACTOR - 1.0))


def resolved_damping(damping: float, race: float) -> float:
    """Numerical damping ratio that leaves 1/FACTOR of the bias of ``damping`` on top of that of the race, for a bias that grows
    with the logarithm of their sum."""
    return race * math.expm1(math.log1p(min(damping, max(MOST_DAMPING, DAMPED * race)) / race) / FACTOR)


def mean_step(runs: Sequence[Replicate], method: str) -> float:
    """Mean step [s] of the runs by a method."""
    own = [run for run in runs if run.method == method]
    return sum(float(run.durations.sum()) for run in own) / sum(run.accepted_steps for run in own)


def numerical_damping(light: LightContact, step: float, method: str) -> float:
    """Damping ratio that steps [s] of a method add to a light contact, at most."""
    return (step * light.frequency) ** 5 / DAMPING_SCALE[method]


def longest_step(light: LightContact, damping: float, method: str) -> float:
    """Step [s] of a method that adds so large a damping ratio."""
    return float((damping * DAMPING_SCALE[method]) ** 0.2 / light.frequency)
