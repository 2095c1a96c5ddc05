"""How long the next step is: a PI controller on the error of a step over its tolerance (Hairer, Norsett and Wanner, Solving
ODEs I, II.4), which with ``beta`` = 0 is the plain one.

The error of a step is the Euclidean norm of all components, each over its own absolute tolerance, and not averaged
over them: it is never smaller than that of the worst component, however many rollers there are.
"""

import math

from rbdyn.compiled.elementary import rough_power
from rbdyn.compiled.kernel import kernel, routine
from rbdyn.dynamics.integrators import method_laws as laws
from rbdyn.dynamics.integrators.records import ERROR, STEP

SAFETY, SHRINK, GROW = 0.9, 0.2, 10.0


@kernel
def after_accepted(method, clock, h, cut, error, refused, largest_step):
    """Set the step after one of ``h`` [s] that was accepted. ``cut``: it ended early, which says nothing against the step it
    was cut from; ``refused``: the one before was refused, so that this is no time to grow.
    """
    error = max(error, 1e-4)
    factor = SAFETY * rough_power(error, -method.exponent) * rough_power(clock[ERROR], method.beta)
    proposal = min(h * min(max(factor, SHRINK), 1.0 if refused else GROW), largest_step)
    clock[STEP] = max(proposal, clock[STEP]) if cut else proposal
    clock[ERROR] = error


@kernel
def shortened(method, h, error):
    """Step [s] in place of one of ``h`` that was refused."""
    return h * (max(SAFETY * rough_power(error, -method.rejected), SHRINK) if math.isfinite(error) else SHRINK)


@routine
def worst_component(method, k, h, inverse_tolerance):
    """Component that limits the step: the first that is not finite, else the one of the largest error."""
    worst, largest = 0, -1.0
    for i in range(inverse_tolerance.size):
        e = abs(laws.step_error(method, k, h, i)) * inverse_tolerance[i]
        if not math.isfinite(e):
            return i
        if e > largest:
            worst, largest = i, e
    return worst
