"""Compiled code for other integrators: the right-hand side as a function of Python, and two explicit methods of fixed step.

Velocity Verlet is the usual method of particle codes (DEM). Forces here depend on velocity, so the second kick needs
a predicted velocity: with a = a(x, v),

    x' = x + h v + h^2/2 a,   v* = v + h a,   a' = a(x', v*),   v' = v + h/2 (a + a')

One right-hand side a step, because a' serves the next step; second order, because the error of v* is O(h^2). Components
without a position (spins, the clock) use the v-formulas.

Both methods keep a tally at step ends, as ours does: works by their own weights, largest loads, the whirl of the cage.
"""

import math
from typing import Any

import numba
import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.compiled.kernel import entry, kernel
from rbdyn.dynamics.forces import state
from rbdyn.dynamics.forces.equations import RollerBearing, derivative, derivative_once
from rbdyn.dynamics.forces.race_lanes import scratch
from rbdyn.dynamics.forces.state import LOADS, Layout
from rbdyn.dynamics.integrators.advance import book_whirl
from rbdyn.losses import POWERS


class BudgetSpent(Exception):  # noqa: N818
    """More right-hand sides were asked for than allowed."""


@entry
def right_hand_side(bearing, y, dy, power, loads, scratch):
    """Derivative of the state ``y`` (n,) into ``dy`` (1, n), powers [W] and largest loads [N] likewise."""
    derivative(bearing, y, 0, dy, power, loads, scratch)


class RightHandSide:
    """f(t, y) -> dy/dt of a bearing; counts its calls and raises BudgetSpent past ``budget`` of them.

    The state has its own time, so ``t`` is not read. Calls go straight to the machine code: a look-up of the types of the
    parameters would take twenty times as long as the right-hand side itself.
    """

    def __init__(self, bearing: RollerBearing, size: int, budget: int) -> None:
        self.bearing, self.size, self.budget, self.calls = bearing, size, budget, 0
        self._kept = np.zeros((1, POWERS)), np.zeros((1, LOADS)), scratch(bearing.rollers)
        arguments = (bearing, np.zeros(size), np.zeros((1, size)), *self._kept)
        signature = tuple(numba.typeof(argument) for argument in arguments)
        right_hand_side.compile(signature)
        self._compiled: Any = right_hand_side.overloads[signature].entry_point

    def __call__(self, t: float, y: Array) -> Array:
        dy = np.empty((1, y.size))
        self.fill(y, dy)
        return dy[0]

    def fill(self, y: Array, dy: Array) -> None:
        """Write the derivative of ``y`` (n,) into ``dy`` (1, n), contiguous. Raises ValueError for another size."""
        # The machine code checks neither size nor order, and SciPy also passes columns of a matrix.
        if y.size != self.size:
            raise ValueError(f"the state has {y.size} components, not {self.size}")
        self.calls += 1
        if self.calls > self.budget:
            raise BudgetSpent
        self._compiled(self.bearing, np.ascontiguousarray(y, dtype=np.float64), dy, *self._kept)


def velocity_of(layout: Layout) -> Whole:
    """For each state component the index of its velocity; -1 for what is not a position."""
    z, components = layout.rollers, layout.components
    owners = [(part.body, place % z if place < layout.first_body else 0) for place, part in enumerate(components)]
    places = {(owner, part.name): place for place, (owner, part) in enumerate(zip(owners, components, strict=True))}
    return np.array([places.get((owner, part.speed), -1) for owner, part in zip(owners, components, strict=True)])


@kernel
def all_finite(y):
    """Whether no component is NaN or infinite."""
    total = 0.0
    for i in range(y.size):
        total += y[i] - y[i]
    return total == 0.0


@kernel
def book(tally, y, body, loads):
    """Book the largest loads at the end of a step, and place and speed of the cage's centre as a sample of its whirl."""
    for force in range(LOADS):
        tally.largest[force] = max(tally.largest[force], loads[0, force])
    x, y_place = y[body + state.CAGE_X], y[body + state.CAGE_Y]
    book_whirl(tally.whirl, x, y_place, y[body + state.CAGE_VX], y[body + state.CAGE_VY])


@entry
def runge_kutta_4(bearing, y, step, steps, scratch, tally):
    """Advance ``y`` in place by ``steps`` steps of ``step`` [s] of the classical fourth-order method.

    Returns the number of steps made: fewer than ``steps`` where the state ceased to be finite.
    """
    n = y.size
    k, stage = np.zeros((4, n)), np.empty(n)
    power, loads = np.empty((4, POWERS)), np.empty((4, LOADS))
    for step_number in range(steps):
        for s in range(k.shape[0]):
            reach = 0.0 if s == 0 else step if s == 3 else 0.5 * step
            for i in range(n):
                stage[i] = y[i] + reach * k[max(s - 1, 0), i]
            derivative(bearing, stage, s, k, power, loads, scratch)
        book(tally, y, state.ROLLER_STATES * bearing.rollers, loads)
        for i in range(n):
            y[i] += step / 6.0 * (k[0, i] + 2.0 * (k[1, i] + k[2, i]) + k[3, i])
        for p in range(POWERS):
            tally.work[p] += step / 6.0 * (power[0, p] + 2.0 * (power[1, p] + power[2, p]) + power[3, p])
        if not all_finite(y):
            return step_number
    return steps


@entry
def velocity_verlet(bearing, velocity_of, y, step, steps, scratch, tally):
    """Advance ``y`` in place by ``steps`` steps of ``step`` [s] of velocity Verlet, with ``velocity_of(layout)``.

    Returns the number of steps made: fewer than ``steps`` where the state ceased to be finite.
    """
    n = y.size
    k, new = np.zeros((2, n)), np.empty(n)
    power, loads = np.empty((2, POWERS)), np.empty((2, LOADS))
    derivative_once(bearing, y, 0, k, power, loads, scratch)
    for step_number in range(steps):
        for i in range(n):
            new[i] = y[i] + step * k[0, i]
            if velocity_of[i] >= 0:
                new[i] += 0.5 * step * step * k[0, velocity_of[i]]
        derivative(bearing, new, 1, k, power, loads, scratch)
        for i in range(n):
            if velocity_of[i] < 0:
                new[i] = y[i] + 0.5 * step * (k[0, i] + k[1, i])
        for i in range(n):
            y[i] = new[i]
            k[0, i] = new[velocity_of[i]] if velocity_of[i] >= 0 else k[1, i]
        for p in range(POWERS):
            tally.work[p] += 0.5 * step * (power[0, p] + power[1, p])
            power[0, p] = power[1, p]
        for force in range(LOADS):
            loads[0, force] = loads[1, force]
        book(tally, y, state.ROLLER_STATES * bearing.rollers, loads)
        if not all_finite(y):
            return step_number
    return steps


def steps_of(duration: float, step: float) -> int:
    """Whole number of steps of about this size [s] in a duration [s]."""
    return max(math.ceil(duration / step - 1e-9), 1)
