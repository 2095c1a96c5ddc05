"""Temperatures that the heat they cause keeps up: a fixed point, its stability, and the verdict where there is none.

A map gives, for temperatures T of the nodes, the temperatures M(T) at which the network carries off the heat of T. Steady
temperatures are those with M(T) = T. Newton's method on M(T) - T needs slopes dM/dT, which start as an estimate and learn from
the states visited (Broyden 1965). A simulation makes M noisy, so a state counts as steady within its noise.

Heat that rises faster with temperature than the network carries it off has no steady state. The temperatures of nodes follow
C dT/dt = G (M(T) - T), so a fixed point is stable where every eigenvalue of dM/dT has a real part below one. The largest is the
gain of the loop: negative where friction falls with viscosity, positive where a ring that warms takes clearance away.
"""

from collections.abc import Callable
from typing import Any, Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError

Status = Literal["steady", "no steady state", "seizure"]
# Most states of a search, and halvings of a step into an impossible state.
MOST_STATES, MOST_HALVINGS = 16, 6
# Longest step of a node [K], and temperature at which no oil lubricates [C].
LONGEST_STEP, HOTTEST = 40.0, 350.0
# Deviation that counts as none [K], unless the noise is larger; distance of states, in noise, from which slopes learn.
TOLERANCE, CLEAR = 0.2, 3.0
# Gain near one, from which Newton's step would go far beyond what the slopes are good for.
NEARLY_UNSTABLE = 0.95


class State(NamedTuple):
    """Temperatures [C] of the nodes, those that balance their heat, and the noise of these as 95 % half-widths [K].

    ``run``: what the map returns besides.
    """

    temperatures: Array
    image: Array
    noise: Array
    run: Any = None

    @property
    def deviation(self) -> Array:
        """What balances the heat, less what causes it [K]."""
        return self.image - self.temperatures


# The map. Raises InputError for an impossible state.
Balance = Callable[[Array], State]


class Search(NamedTuple):
    """Outcome of a search for steady temperatures.

    ``slopes``: dM/dT (n, n) at the last state. ``reason``: a sentence for any status but "steady".
    """

    status: Status
    states: tuple[State, ...]
    slopes: Array
    reason: str = ""

    @property
    def last(self) -> State:
        """The last possible state."""
        return self.states[-1]


def gain(slopes: Array) -> float:
    """Gain of the loop: largest real part of the eigenvalues of dM/dT; steady below one."""
    return float(np.linalg.eigvals(slopes).real.max())


def learned(slopes: Array, steps: Array, changes: Array) -> Array:
    """Slopes changed least (Frobenius) so that they give the ``changes`` (k, n) along the ``steps`` (k, n)."""
    steps, changes = np.atleast_2d(steps), np.atleast_2d(changes)
    return np.asarray(slopes + (changes - steps @ slopes.T).T @ np.linalg.pinv(steps.T))


def newton_step(slopes: Array, deviation: Array) -> Array:
    """Step to the fixed point by linear slopes, or along the deviation where these show no stable one.

    No node moves by more than LONGEST_STEP.
    """
    step = deviation
    if gain(slopes) < NEARLY_UNSTABLE:
        step = np.asarray(np.linalg.solve(np.eye(len(deviation)) - slopes, deviation), float)
    return np.asarray(step * min(1.0, LONGEST_STEP / max(float(np.abs(step).max()), 1e-12)))


def steady_state(
    balance: Balance, start: Array, slopes_at: Callable[[State], Array], cold: Array, tolerance: float = TOLERANCE
) -> Search:
    """Search for steady temperatures from ``start`` [C]; ``slopes_at`` estimates dM/dT (n, n) at the first state.

    ``cold``: temperatures before any heat, towards which an impossible start moves. ``tolerance`` [K]. Raises InputError where
    the bearing is impossible even when cold.
    """
    visited, fault = [_possible_start(balance, start, cold)], ""
    slopes = slopes_at(visited[0])
    while True:
        state = visited[-1]
        deviation = state.deviation
        if np.all(np.abs(deviation) <= np.maximum(tolerance, state.noise)):
            return Search("steady", tuple(visited), slopes)
        if len(visited) >= MOST_STATES and fault:
            return Search("seizure", tuple(visited), slopes, fault)
        if len(visited) >= MOST_STATES:
            reason = (
                f"{len(visited)} states did not settle; the last misses its balance by {np.abs(deviation).max():.2g} K"
            )
            return Search("no steady state", tuple(visited), slopes, reason)
        step = newton_step(slopes, deviation)
        if (state.temperatures + step).max() > HOTTEST:
            reason = f"the heat drives a temperature beyond {HOTTEST:g} C"
            return Search("no steady state", tuple(visited), slopes, reason)
        following, fault = _possible_step(balance, state, step)
        if following is None:
            return Search("seizure", tuple(visited), slopes, fault)
        visited.append(following)
        taken = following.temperatures - state.temperatures
        if np.abs(taken).max() > CLEAR * max(float(following.noise.max()), float(state.noise.max()), 1e-9):
            slopes = learned(slopes, taken, following.image - state.image)


def _possible_start(balance: Balance, start: Array, cold: Array) -> State:
    """State at the start, or half as far from the cold one, and so on. Raises InputError where even that is impossible."""
    for halvings in range(MOST_HALVINGS):
        try:
            return balance(cold + (start - cold) * 0.5**halvings)
        except InputError:
            continue
    return balance(cold)


def _possible_step(balance: Balance, state: State, step: Array) -> tuple[State | None, str]:
    """The state a step away, or half as far, and so on; None where all are impossible. And why the last impossible one is."""
    fault = ""
    for _ in range(MOST_HALVINGS):
        try:
            return balance(state.temperatures + step), fault
        except InputError as error:
            fault = str(error.faults[0])
        step = 0.5 * step
    return None, fault
