"""The compiled right-hand side as a Python function dy/dt = f(t, y), for the integrators of others."""

from typing import Any

import numba
import numpy as np

from rbdyn.arrays import Array
from rbdyn.compiled.kernel import entry
from rbdyn.dynamics.forces.equations import LOADS, POWERS, RollerBearing, derivative
from rbdyn.dynamics.forces.race_lanes import scratch


class BudgetSpent(Exception):  # noqa: N818
    """More right-hand sides were asked for than allowed."""


@entry
def right_hand_side(bearing, y, dy, power, loads, scratch):
    """Derivative of the state ``y`` (n,) into ``dy`` (1, n), powers [W] and largest loads [N] likewise."""
    derivative(bearing, y, 0, dy, power, loads, scratch)


class RightHandSide:
    """f(t, y) -> dy/dt of a bearing; counts its calls and raises BudgetSpent past ``budget`` of them.

    The state carries its own time, so ``t`` is not read. The machine code is called without looking up the types of
    the parameters each time, which would take twenty times as long as the right-hand side itself.
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
        # The machine code takes size and order on trust; SciPy also hands over columns of a matrix.
        if y.size != self.size:
            raise ValueError(f"the state has {y.size} components, not {self.size}")
        self.calls += 1
        if self.calls > self.budget:
            raise BudgetSpent
        self._compiled(self.bearing, np.ascontiguousarray(y, dtype=np.float64), dy, *self._kept)
