"""RODAS4: linearly implicit, for scenes whose explicit steps are held by stability and not by accuracy.

Six stages, order four with an embedded third-order result, stiffly accurate and L-stable, dense output of order three:
Hairer and Wanner, Solving ODEs II, IV.7 (method and coefficients of their code RODAS, in the form u_i that needs no
products with the Jacobian). Each stage solves (I/(gamma h) - J) u_i = f(y + sum a_ij u_j) + sum c_ij u_j/h.

It works in fixed axes; the Jacobian of a state is kept while steps from it are refused. Works are integrated as further
equations of the same method, w' = P(y): where a stiff slip makes the traction, no quadrature over interpolated states
would close the power balance.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import routine
from rbdyn.dynamics.forces.equations import POWERS, derivative_once
from rbdyn.dynamics.forces.state import PARTS
from rbdyn.dynamics.integrators import method_laws as laws
from rbdyn.dynamics.integrators.arrow_matrix import ArrowMatrix, factor, shifted, solve
from rbdyn.dynamics.integrators.jacobian import Differences, jacobian
from rbdyn.dynamics.integrators.records import DERIVATIVES

STAGES = 6
# Rows of a right-hand side, as integers of numpy: for each plain one it would be compiled anew.
START_ROW, NEXT_ROW, END_ROW = np.int64(0), np.int64(1), np.int64(STAGES)
GAMMA = 0.25
# Row s: weights of the stages before it in the state at which stage s is evaluated, and divided by h in its right side.
A = np.array(
    [
        [0, 0, 0, 0, 0],
        [1.544, 0, 0, 0, 0],
        [0.9466785280815826, 0.2557011698983284, 0, 0, 0],
        [3.314825187068521, 2.896124015972201, 0.9986419139977817, 0, 0],
        [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 0],
        [1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1],
    ]
)
C = np.array(
    [
        [0, 0, 0, 0, 0],
        [-5.6688, 0, 0, 0, 0],
        [-2.430093356833875, -0.2063599157091915, 0, 0, 0],
        [-0.1073529058151375, -9.594562251023355, -20.47028614809616, 0, 0],
        [7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160, 0],
        [8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054],
    ]
)
# Weights of stages 1 to 5 in the quadratic and the cubic part of the dense output.
D_2 = np.array([10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662])
D_3 = np.array([-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872])


class Rodas(NamedTuple):
    """The method and what one run of it works on. Arrays, changed in place; numbers as in ``method_laws``."""

    u: NDArray[np.float64]  # (6, n) stages
    work: NDArray[np.float64]  # (6, POWERS) stages of the works
    dense: NDArray[np.float64]  # (2, n) quadratic and cubic part of the dense output
    found: Differences
    factors: ArrowMatrix
    last: int = STAGES
    free: int = 1
    exponent: float = 0.25
    beta: float = 0.0
    rejected: float = 0.25


@laws.begin.body(Rodas)
def _(method, bearing, y, k, power, loads, scratch, clock, counts):
    derivative_once(bearing, y, START_ROW, k, power, loads, scratch)
    counts[DERIVATIVES] += 1
    return -1


@laws.trial_step.body(Rodas)
def _(method, refused, bearing, y, k, stage, power, loads, scratch, clock, counts, h):
    if not refused:
        # Right-hand sides of one roller count as their share.
        jacobian(bearing, y, stage, k, NEXT_ROW, power, loads, scratch, method.found)
        counts[DERIVATIVES] += PARTS + 1 + method.factors.bodies.shape[0]
    n, u, per_step = y.size, method.u, 1.0 / h
    shifted(method.found.matrix, per_step / GAMMA, method.factors)
    factor(method.factors)
    for s in range(u.shape[0]):
        if s > 0:
            for i in range(n):
                stage[i] = y[i]
            for p in range(s):
                for i in range(n):
                    stage[i] += A[s, p] * u[p, i]
            derivative_once(bearing, stage, s, k, power, loads, scratch)
        for i in range(n):
            u[s, i] = k[s, i]
        for p in range(s):
            weight = C[s, p] * per_step
            for i in range(n):
                u[s, i] += weight * u[p, i]
        solve(method.factors, u[s])
        stage_work(method, power, s, h)
    counts[DERIVATIVES] += STAGES - 1
    for i in range(n):
        stage[i] += u[STAGES - 1, i]


@routine
def stage_work(method, power, s, h):
    """Stage ``s`` of the works: they act on nothing, so that each follows from the stage of the state."""
    gradients, u = method.found.power, method.u
    for p in range(POWERS):
        rate = power[s, p]
        for i in range(u.shape[1]):
            rate += gradients[p, i] * u[s, i]
        for earlier in range(s):
            rate += C[s, earlier] / h * method.work[earlier, p]
        method.work[s, p] = GAMMA * h * rate


@laws.error_norm.body(Rodas)
def _(method, k, h, inverse_tolerance):
    total = 0.0
    for i in range(inverse_tolerance.size):
        scaled = method.u[STAGES - 1, i] * inverse_tolerance[i]
        total += scaled * scaled
    return math.sqrt(total)


@laws.step_error.body(Rodas)
def _(method, k, h, i):
    return method.u[STAGES - 1, i]


@laws.look_at_stiffness.body(Rodas)
def _(method, k, stiffness, h, inverse_tolerance):
    pass


@laws.end_step.body(Rodas)
def _(method, bearing, stage, k, power, loads, scratch, counts):
    derivative_once(bearing, stage, END_ROW, k, power, loads, scratch)
    counts[DERIVATIVES] += 1
    u, dense = method.u, method.dense
    for i in range(u.shape[1]):
        quadratic = cubic = 0.0
        for s in range(STAGES - 1):
            quadratic += D_2[s] * u[s, i]
            cubic += D_3[s] * u[s, i]
        dense[0, i], dense[1, i] = quadratic, cubic


@laws.interpolate.body(Rodas)
def _(method, y, end, k, h, theta, i):
    rest = 1.0 - theta
    return y[i] * rest + theta * (end[i] + rest * (method.dense[0, i] + theta * method.dense[1, i]))


@laws.work_done.body(Rodas)
def _(method, power, h, p):
    done = method.work[STAGES - 1, p]
    for s in range(STAGES - 1):
        done += A[STAGES - 1, s] * method.work[s, p]
    return done


@laws.to_fixed_axes_at.body(Rodas)
def _(method, clock, time, z, y):
    pass


@laws.next_frame.body(Rodas)
def _(method, clock, h, z, y, k):
    pass
