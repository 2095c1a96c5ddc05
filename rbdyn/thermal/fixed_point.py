"""Temperatures that the heat they cause keeps up: a fixed point, its stability, and the verdict where there is none.

A map gives, for temperatures T of the nodes, the temperatures M(T) at which the network carries off the heat of T. Steady
temperatures are those with M(T) = T. From each state a model of the balance (``losses``), with what the states visited say about
it, gives the next one. Its solution is never colder than the surroundings, and a step that turns back is at most half as long as
the one before, so the search cannot swing. A simulation makes M noisy, so a state counts as steady within its noise.

Heat that rises faster with temperature than the network carries it off has no steady state. The temperatures of nodes follow
C dT/dt = G (M(T) - T), so a fixed point is stable where every eigenvalue of dM/dT has a real part below one. The largest is the
gain of the loop: negative where friction falls with viscosity, positive where a ring that warms takes clearance away. The verdict
"no steady state" needs a gain that is at least one beyond its error. A search that ends at its limits is undecided.
"""

from collections.abc import Callable, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError
from rbdyn.base.words import with_error
from rbdyn.thermal.losses import HOTTEST, LONGEST_STEP, HeatModel, film_powers, gain, no_residue

Status = Literal["steady", "undecided", "no steady state", "seizure", "too hot"]
# Most states of a search, and halvings of a step into an impossible state.
MOST_STATES, MOST_HALVINGS = 16, 6
# Deviation that counts as none [K], unless the noise is larger; noise that leaves temperatures unknown [K]; distance of states, in
# noise, from which models learn.
TOLERANCE, VAGUE, CLEAR = 0.2, 20.0, 3.0
# Gain near one, from which the model's solution would lie far beyond what its slopes are good for.
NEARLY_UNSTABLE = 0.95
# States from which the residue of a model is learned, and their distance at most [K].
LEARNED, NEAR = 3, 40.0
# Part of the steps between states in a direction, over the largest, from which slopes there are learned.
ALIKE = 0.1
# Smallest change of the logarithm of the viscosity, and share of the heat, from which the exponent of a film is learned.
VISCOSITY_CHANGE, POWER_SHARE = 0.2, 0.01


class State(NamedTuple):
    """Temperatures [C] of the nodes, those that balance their heat, the noise of these as 95 % half-widths [K], and the balance there.

    ``run``: what the map returns besides.
    """

    temperatures: Array
    image: Array
    noise: Array
    model: HeatModel
    run: Any = None

    @property
    def deviation(self) -> Array:
        """What balances the heat, less what causes it [K]."""
        return self.image - self.temperatures

    def closes(self, tolerance: float = TOLERANCE) -> bool:
        """Whether the heat balances within the tolerance [K] or the noise."""
        return bool(np.all(np.abs(self.deviation) <= np.maximum(tolerance, self.noise)))


# The map. Raises InputError for an impossible state.
Balance = Callable[[Array], State]
# Slopes dM/dT (4, 4) at a state, and the error of their gain, by runs next to it or by the model of the search.
Slopes = Callable[[State, HeatModel], tuple[Array, float]]
# The steady state as far as it needs no further balance, None where it does.
Estimate = Callable[[State], State | None]
# The model of the balance about the last state, from all states.
Model = Callable[[Sequence[State]], HeatModel]


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


def learned(slopes: Array, steps: Array, changes: Array, alike: float = 1e-12) -> Array:
    """Slopes changed least (Frobenius) so that they give the ``changes`` (k, n) along the ``steps`` (k, n).

    Directions in which these have less than the part ``alike`` of the largest show nothing.
    """
    steps, changes = np.atleast_2d(steps), np.atleast_2d(changes)
    return np.asarray(slopes + (changes - steps @ slopes.T).T @ np.linalg.pinv(steps.T, rcond=alike))


def model_of(states: Sequence[State]) -> HeatModel:
    """Model of the balance about the last state: viscosity by its exponents, and the residue that near states show beyond that."""
    last = states[-1]
    model = last.model
    for other in states[:-1]:
        exponents = film_powers(model.losses, other.model.losses, VISCOSITY_CHANGE, POWER_SHARE)
        model = model._replace(losses=model.losses._replace(exponents=exponents))
    steps, missing = [], []
    for other in states[-1 - LEARNED : -1]:
        step = other.temperatures - last.temperatures
        noise = max(float(last.noise.max()), float(other.noise.max()), 1e-9)
        if CLEAR * noise < np.abs(step).max() <= NEAR:
            steps.append(step)
            missing.append(other.model.matrix @ other.deviation - model.excess(other.temperatures))
    if not steps:
        return model
    return model._replace(residue=learned(no_residue(), np.array(steps), np.array(missing), ALIKE))


def next_step(model: HeatModel, state: State, before: Array | None) -> Array:
    """Step (4,) [K] to the stable solution of the model; where that has none, by its slopes or, if these are unstable, without its residue.

    ``before``: the step that led here. A step that turns back is at most half as long.
    """
    slopes, balanced = model.image_slopes(state.temperatures), model.balanced()
    if model.is_stable(balanced, NEARLY_UNSTABLE):
        step = balanced - state.temperatures
    elif gain(slopes) < NEARLY_UNSTABLE:
        step = np.asarray(np.linalg.solve(np.eye(len(slopes)) - slopes, state.deviation), float)
    else:
        step = model._replace(residue=no_residue()).balanced() - state.temperatures
    longest = LONGEST_STEP
    if before is not None and float(step @ before) < 0.0:
        longest = min(longest, 0.5 * float(np.abs(before).max()))
    return np.asarray(step * min(1.0, longest / max(float(np.abs(step).max()), 1e-12)))


def steady_state(
    balance: Balance,
    start: Array,
    cold: Array,
    measured: Slopes,
    model: Model = model_of,
    tolerance: float = TOLERANCE,
    estimate: Estimate | None = None,
) -> Search:
    """Search for steady temperatures from ``start`` [C].

    ``cold``: temperatures before any heat, towards which an impossible start moves. ``tolerance`` [K]. ``estimate``: ends
    the search where it answers. Raises InputError where the bearing is impossible even when cold.
    """
    visited, fault, step = [_possible_start(balance, start, cold)], "", None
    while True:
        state, near = visited[-1], model(visited)
        slopes = near.image_slopes(state.temperatures)
        vague = float(state.noise.max())
        if state.closes(tolerance) and vague <= VAGUE:
            return _judged(tuple(visited), measured(state, near), "steady", "")
        if estimate is not None and (known := estimate(state)) is not None:
            return _judged((*visited, known), measured(known, known.model), "steady", "")
        if len(visited) >= MOST_STATES:
            reason = f"{len(visited)} states did not settle; the last misses its balance by {np.abs(state.deviation).max():.2g} K"
            if vague > VAGUE:
                reason = (
                    f"the heat of short runs leaves the temperatures open by {vague:.2g} K; lengthen numerics.turns"
                )
            status: Status = "seizure" if fault else "undecided"
            return Search(status, tuple(visited), slopes, fault or reason)
        step = next_step(near, state, step)
        room = HOTTEST - float(state.temperatures.max())
        if room < 1.0 and step[state.temperatures.argmax()] > -1.0:
            reason = f"the heat drives a temperature beyond {HOTTEST:g} C"
            return _judged(tuple(visited), measured(state, near), "too hot", reason)
        following, fault = _possible_step(balance, state, step)
        if following is None:
            return Search("seizure", tuple(visited), slopes, fault)
        visited.append(following)
        step = following.temperatures - state.temperatures


def _judged(states: tuple[State, ...], measured: tuple[Array, float], status: Status, reason: str) -> Search:
    """The search with a status that holds for a gain below one, or without a steady state or undecided."""
    slopes, error = measured
    largest = gain(slopes)
    if largest - error >= 1.0:
        words = f"the thermal loop gain is {largest:.2g}, so heat grows faster with temperature than it is removed"
        return Search("no steady state", states, slopes, f"{reason}; {words}" if reason else words)
    if largest >= 1.0 and status == "steady":
        reason = f"the thermal loop gain is {with_error(largest, error)}, so the state may be unstable; lengthen numerics.turns"
        return Search("undecided", states, slopes, reason)
    return Search(status, states, slopes, reason)


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
