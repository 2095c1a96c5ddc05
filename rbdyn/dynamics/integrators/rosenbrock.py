"""RODAS4: linearly implicit, for scenes whose explicit steps are held by stability and not by accuracy.

Six stages, order four with an embedded third-order result, stiffly accurate and L-stable, dense output of order three:
Hairer and Wanner, Solving ODEs II, IV.7 (method and coefficients of their code RODAS, in the form u_i that needs no
products with the Jacobian). Each stage solves (I/(gamma h) - J) u_i = f(y + sum a_ij u_j) + sum c_ij u_j/h.

The error norm and the per-component tolerances are those of ``runge_kutta``. Works are integrated as further equations
of the same method, w' = P(y): where a stiff slip makes the traction, no quadrature over interpolated states would close
the power balance.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry, kernel, routine
from rbdyn.dynamics.forces.equations import LOADS, POCKET_CONTACT_LOAD, POCKET_LOAD, POWERS, derivative_once
from rbdyn.dynamics.forces.state import CAGE_VX, CAGE_VY
from rbdyn.dynamics.integrators.arrow_matrix import PARTS, ArrowMatrix, factor, shifted, solve
from rbdyn.dynamics.integrators.booking import PEAK_POINTS, book_peaks, book_point, book_whirl
from rbdyn.dynamics.integrators.jacobian import Differences, jacobian
from rbdyn.dynamics.integrators.runge_kutta import (
    FINISHED,
    GROW,
    NOT_FINITE,
    SAFETY,
    SHRINK,
    STEP_BUDGET,
    STEP_UNDERFLOW,
)

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


class Workspace(NamedTuple):
    """What one run of the method works on. Arrays, changed in place."""

    u: NDArray[np.float64]  # (6, n) stages
    work: NDArray[np.float64]  # (6, POWERS) stages of the works
    dense: NDArray[np.float64]  # (2, n) quadratic and cubic part of the dense output
    y_new: NDArray[np.float64]
    found: Differences
    factors: ArrowMatrix


@routine
def trial_step(bearing, carry, work, h):
    """Stages of a step of size ``h`` from ``carry.y``; the end state goes to ``work.y_new``, its error is the last stage."""
    n = carry.y.size
    u, stage, per_step = work.u, carry.stage, 1.0 / h
    shifted(work.found.matrix, per_step / GAMMA, work.factors)
    factor(work.factors)
    for s in range(u.shape[0]):
        if s > 0:
            for i in range(n):
                stage[i] = carry.y[i]
            for p in range(s):
                for i in range(n):
                    stage[i] += A[s, p] * u[p, i]
            derivative_once(bearing, stage, s, carry.k, carry.power, carry.loads, carry.scratch)
        for i in range(n):
            u[s, i] = carry.k[s, i]
        for p in range(s):
            weight = C[s, p] * per_step
            for i in range(n):
                u[s, i] += weight * u[p, i]
        solve(work.factors, u[s])
        stage_work(carry.power, work, s, h)
    for i in range(n):
        work.y_new[i] = stage[i] + u[s, i]


@routine
def stage_work(power, work, s, h):
    """Stage ``s`` of the works: they act on nothing, so that each follows from the stage of the state."""
    gradients, u = work.found.power, work.u
    for p in range(POWERS):
        rate = power[s, p]
        for i in range(u.shape[1]):
            rate += gradients[p, i] * u[s, i]
        for earlier in range(s):
            rate += C[s, earlier] / h * work.work[earlier, p]
        work.work[s, p] = GAMMA * h * rate


@routine
def error_norm(error, inverse_tolerance):
    """Euclidean norm of the embedded error over the tolerances; any NaN comes through."""
    total = 0.0
    for i in range(error.size):
        scaled = error[i] * inverse_tolerance[i]
        total += scaled * scaled
    return math.sqrt(total)


@routine
def worst_component(error, inverse_tolerance):
    """Component that limits the step: the first that is not finite, else the one of the largest error."""
    worst = 0
    for i in range(error.size):
        if not math.isfinite(error[i]):
            return i
        if abs(error[i]) * inverse_tolerance[i] > abs(error[worst]) * inverse_tolerance[worst]:
            worst = i
    return worst


@routine
def prepare_dense(work):
    """Quadratic and cubic part of the dense output of the step just made."""
    u, dense = work.u, work.dense
    for i in range(u.shape[1]):
        quadratic = cubic = 0.0
        for s in range(STAGES - 1):
            quadratic += D_2[s] * u[s, i]
            cubic += D_3[s] * u[s, i]
        dense[0, i], dense[1, i] = quadratic, cubic


@kernel
def interpolate(carry, work, theta, i):
    """Component ``i`` at the fraction ``theta`` of the step."""
    rest = 1.0 - theta
    return carry.y[i] * rest + theta * (work.y_new[i] + rest * (work.dense[0, i] + theta * work.dense[1, i]))


@routine
def refine_peak(bearing, carry, work, h, tally):
    """Look inside a step for its largest pocket loads: eight points, then the vertex of a parabola."""
    values = np.empty((2, PEAK_POINTS + 2))
    book_point(values, 0, carry.loads, 0)
    book_point(values, PEAK_POINTS + 1, carry.loads, STAGES)
    spacing = 1.0 / (PEAK_POINTS + 1)
    for p in range(1, PEAK_POINTS + 1):
        for i in range(carry.y.size):
            carry.stage[i] = interpolate(carry, work, p * spacing, i)
        derivative_once(bearing, carry.stage, NEXT_ROW, carry.k, carry.power, carry.loads, carry.scratch)
        book_point(values, p, carry.loads, 1)
    book_peaks(values, carry.clock[0], h, tally)


@routine
def keep(bearing, carry, work, h, tally, sample_step):
    """Book an accepted step: work, largest loads, samples. Row 6 belongs to its end, as in ``runge_kutta``.

    Returns whether a stage saw a new largest pocket load.
    """
    loads, time = carry.loads, carry.clock[0]
    prepare_dense(work)
    for p in range(POWERS):
        done = work.work[STAGES - 1, p]
        for s in range(STAGES - 1):
            done += A[STAGES - 1, s] * work.work[s, p]
        tally.work[p] += done
    on_wall = contact = 0.0
    for s in range(1, STAGES + 1):
        on_wall = max(on_wall, loads[s, POCKET_LOAD])
        contact = max(contact, loads[s, POCKET_CONTACT_LOAD])
    for force in range(LOADS):
        if loads[STAGES, force] > tally.largest[force]:
            tally.largest[force] = loads[STAGES, force]
            tally.largest_time[force] = time + h
    body = PARTS * bearing.rollers
    while carry.clock[3] <= time + h:
        theta = (carry.clock[3] - time) / h
        vx, vy = (interpolate(carry, work, theta, body + CAGE_VX), interpolate(carry, work, theta, body + CAGE_VY))
        book_whirl(tally.whirl, vx, vy)
        carry.clock[3] += sample_step
    return on_wall > tally.largest[POCKET_LOAD] or contact > tally.largest[POCKET_CONTACT_LOAD]


@entry
def advance_implicit(bearing, control, carry, tally, work, t_end, sample_step):
    """As ``runge_kutta.advance``, with ``work`` beside it, in fixed axes. ``counts[2]`` counts the right-hand sides, those
    of one roller as their share.
    """
    clock, counts, y = carry.clock, carry.counts, carry.y
    error_of = work.u[STAGES - 1]
    derivative_once(bearing, y, START_ROW, carry.k, carry.power, carry.loads, carry.scratch)
    counts[2] += 1
    grow, fresh = GROW, False
    while clock[0] < t_end:
        if counts[0] + counts[1] >= control.step_budget:
            return STEP_BUDGET
        if not fresh:
            jacobian(bearing, y, carry.stage, carry.k, NEXT_ROW, carry.power, carry.loads, carry.scratch, work.found)
            counts[2] += PARTS + 1 + work.factors.bodies.shape[0]
            fresh = True
        remaining = t_end - clock[0]
        last = clock[1] >= remaining
        h = remaining if last else clock[1]
        trial_step(bearing, carry, work, h)
        counts[2] += STAGES - 1
        error = error_norm(error_of, control.inverse_tolerance)
        if error <= 1.0:
            derivative_once(bearing, work.y_new, END_ROW, carry.k, carry.power, carry.loads, carry.scratch)
            counts[2] += 1
            if keep(bearing, carry, work, h, tally, sample_step):
                refine_peak(bearing, carry, work, h, tally)
                counts[2] += PEAK_POINTS
            counts[0] += 1
            clock[0] = t_end if last else clock[0] + h
            for i in range(y.size):
                y[i] = work.y_new[i]
                carry.k[0, i] = carry.k[STAGES, i]
            for p in range(POWERS):
                carry.power[0, p] = carry.power[STAGES, p]
            for force in range(LOADS):
                carry.loads[0, force] = carry.loads[STAGES, force]
            error = max(error, 1e-4)
            factor = min(max(SAFETY * error**-0.25, SHRINK), grow)
            proposal = min(h * factor, control.largest_step)
            clock[1] = max(proposal, clock[1]) if last else proposal
            clock[2] = error
            grow, fresh = GROW, False
        else:
            counts[1] += 1
            finite = math.isfinite(error)
            shrink = max(SAFETY * error**-0.25, SHRINK) if finite else SHRINK
            if h * shrink < control.smallest_step:
                counts[3] = worst_component(error_of, control.inverse_tolerance)
                return STEP_UNDERFLOW if finite else NOT_FINITE
            clock[1] = h * shrink
            grow = 1.0
    return FINISHED
