"""History matching: input sets at which the simulation cannot be what was measured are ruled out, in waves.

The implausibility of a cell is |z - m|/sqrt(V): the distance of the measured value from the emulator's mean in standard
deviations of rig, emulator, integration and discrepancy together. New input sets spread over what is left.

Source: Vernon, Goldstein and Bower, Galaxy formation: a Bayesian uncertainty analysis, Bayesian Analysis 5 (2010) 619.
"""

from collections.abc import Callable

import numpy as np
from scipy import special

from doe.arrays import Array, Mask, Whole
from doe.unknown.cells import Cells
from doe.unknown.discrepancy import BY_ROW, Measured

RULED_OUT = 3.0
# Emulators are good enough whose variance is below this share of the rest, and volumes steady that change by less than this.
GOOD, STEADY = 0.25, 0.1
# Rounds in which points that are left beget others, where few are left.
ROUNDS = 12


def implausibility(cells: Cells, measured: Measured, quantiles: Array) -> tuple[Array, Array]:
    """Implausibility (n, k) of the cells that teach at quantiles (n, d), and the share (n, k) that the emulator has in what
    the cell is compared with row by row."""
    learnt = measured.learnt
    mean, doubt = (each[:, learnt] for each in cells.predict(quantiles))
    emulator = (doubt**2).sum(axis=2) + cells.rest[learnt]
    square = measured.scales[measured.output[learnt]] ** 2
    apart, rig = np.abs(measured.values[learnt] - mean), measured.variances[learnt]
    whole = np.sqrt(emulator + rig + (1.0 + BY_ROW**2) * square)
    return apart / whole, emulator / (rig + BY_ROW**2 * square)


def kept(implausible: Array, wave: int) -> Mask:
    """Which input sets (n,) are left: in the first wave one cell may be off, as emulators are poor still."""
    place = max(implausible.shape[1] - (2 if wave == 0 else 1), 0)
    worst = np.partition(implausible, place, axis=1)[:, place]
    return worst < RULED_OUT


def ruling_out(implausible: Array) -> Whole:
    """Places of the cells that rule out every input set (n, k); where none does so alone, of the worst."""
    alone = np.flatnonzero((implausible >= RULED_OUT).all(axis=0))
    return alone if alone.size else np.argsort(-np.median(implausible, axis=0))[:2]


def more(left: Array, fits: Callable[[Array], Mask], wanted: int, random: np.random.Generator) -> Array:
    """At least ``wanted`` quantiles where there are as many, of those left (n, d) and of others beside them that fit."""
    for _ in range(ROUNDS):
        if len(left) >= wanted or len(left) < 3:
            break
        scores = special.ndtri(left)
        first, second, third = random.integers(0, len(left), (3, 4 * wanted))
        tried = special.ndtr(scores[first] + 0.5 * (scores[second] - scores[third]))
        tried = tried.clip(1e-6, 1.0 - 1e-6)
        left = np.vstack([left, tried[fits(tried)]])
    return left


def spread_out(candidates: Array, count: int) -> Array:
    """``count`` of the candidates (n, d), each the farthest from the first and from those before it."""
    distance = ((candidates - candidates[0]) ** 2).sum(axis=1)
    places: list[int] = []
    for _ in range(min(count, len(candidates))):
        places.append(int(np.argmax(distance)))
        distance = np.minimum(distance, ((candidates - candidates[places[-1]]) ** 2).sum(axis=1))
    return candidates[places]
