"""Offsets of a sensor that a calibration does not see, because unknown inputs can imitate them, and what they do to the inputs.

An offset of an output is found by the Bayes factor of a bias beyond the allowed one. Near the posterior's mean the cells are
linear in the normal scores x of the inputs, with slopes G; their prior is N(0, I), and the errors that are allowed have the
covariance C. An offset o in all rows of output j, a vector 1_j, is then estimated with the variance 1/(1_j' M^-1 1_j), where
M = C + G G' without the bias of that output. What inputs imitate makes this variance large. The largest offset that is not seen
is the one at which the factor reaches what counts as strong. Taken for inputs it moves their mean by G'(C + G G')^-1 1_j o.

Sources: Kass and Raftery, Bayes factors, J. Am. Statist. Assoc. 90 (1995) 773 (10: strong evidence); Brynjarsdottir and O'Hagan,
Learning about physical parameters: the importance of model discrepancy, Inverse Problems 30 (2014) 114007 (inputs that take up
a discrepancy).
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy import optimize, special

from doe.unknown.posterior import Cells, Errors, Measured, joint
from rbdyn.base.arrays import Array

# Bayes factor that is strong evidence of an error beyond the allowed one; half of these errors are offsets of whole outputs.
STRONG, OFFSETS = 10.0, 0.5
# Half of the difference of normal scores that slopes are taken over; sizes of a half-normal distribution for its integral.
STEP = 0.5
SIZES = special.ndtri(0.5 + 0.5 * (np.arange(400) + 0.5) / 400)


class Unseen(NamedTuple):
    """The largest offset of an output that is not seen, in logarithms, and by how much it moves the scores (d,) of inputs."""

    offset: float
    moves: Array


def unseen_offsets(
    cells: Cells, measured: Measured, quantiles: Callable[[Array], Array], centre: Array
) -> list[Unseen | None]:
    """The largest unseen offset of each output; None of an exact simulation, and of an output that is only held out.

    ``centre`` (d,): mean of the posterior in normal scores, of which ``quantiles`` are those of the prior.
    """
    learnt, inputs = measured.learnt, centre.size
    steps = STEP * np.eye(inputs)
    means = cells.mean(quantiles(np.vstack([centre + steps, centre - steps])))[:, learnt]
    slopes = (means[:inputs] - means[inputs:]).T / (2.0 * STEP)
    scales = measured.scales[None]
    at = joint(cells, measured, quantiles(centre[None]), Errors(scales, scales, np.zeros(scales.shape, bool)))
    own, roots = at.own[0, learnt], np.hstack([at.roots[0, learnt], slopes])
    listed = list[Unseen | None]()
    for place, scale in enumerate(measured.scales):
        offset = (measured.output[learnt] == place).astype(float)
        if scale == 0.0 or not offset.any():
            listed.append(None)
            continue
        # The first columns of the roots are the biases of the outputs.
        variance = 1.0 / float(offset @ _weighed(own, np.delete(roots, place, axis=1), offset))
        size = _largest(variance, float(scale), float(measured.wide[place]), float(measured.accuracy[place]))
        listed.append(Unseen(size, size * (slopes.T @ _weighed(own, roots, offset))))
    return listed


def _weighed(own: Array, roots: Array, vector: Array) -> Array:
    """The ``vector`` (k,) times the inverse of diag(own) + UU', by Woodbury's identity."""
    scaled = roots / own[:, None]
    inner = np.eye(roots.shape[1]) + roots.T @ scaled
    weighed: Array = vector / own - scaled @ np.linalg.solve(inner, scaled.T @ vector)
    return weighed


def _largest(variance: float, scale: float, wide: float, accuracy: float) -> float:
    """The offset whose estimate, of this ``variance``, makes the Bayes factor strong."""

    def missing(offset: float) -> float:
        wider, allowed = (_log_density(offset, variance + accuracy**2, size) for size in (wide, scale))
        return float(np.log(STRONG / OFFSETS) - (wider - allowed))

    high = float(np.sqrt(variance) + wide)
    while missing(high) > 0.0:
        high *= 2.0
    return float(optimize.brentq(missing, 0.0, high))


def _log_density(offset: float, variance: float, scale: float) -> float:
    """Logarithm of the density of an estimated offset with a bias whose scale is half-normal."""
    total = variance + (scale * SIZES) ** 2
    return float(special.logsumexp(-0.5 * (offset**2 / total + np.log(2.0 * np.pi * total))) - np.log(SIZES.size))
