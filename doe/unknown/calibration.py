"""Inputs of a simulation from measurements: waves of history matching, then a sampled posterior that is simulated again.

History matching: input sets at which the simulation cannot be what was measured are ruled out, in waves.

The implausibility of a cell is |z - m|/sqrt(V): the distance of the measured value from the emulator's mean in standard
deviations of rig, emulator, integration and discrepancy together. New input sets spread over what is left.

Source: Vernon, Goldstein and Bower, Galaxy formation: a Bayesian uncertainty analysis, Bayesian Analysis 5 (2010) 619.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy import special

from doe.unknown.inputs import nested
from doe.unknown.likelihood import BY_ROW, Cells, Errors, Joint, Measured, fit_cells, joint
from doe.unknown.posterior import PARTICLES, Sampled, sampled
from rbdyn.base.arrays import Array, Mask, Whole

RULED_OUT = 3.0
# Emulators are good enough whose variance is below this share of the rest, and volumes steady that change by less than this.
GOOD, STEADY = 0.25, 0.1
# Rounds in which points that are left beget others, where few are left.
ROUNDS = 12


def implausibility(cells: Cells, measured: Measured, quantiles: Array) -> tuple[Array, Array]:
    """Implausibility (n, k) of the training cells at quantiles (n, d), and the share (n, k) that the emulator has in what
    the cell is compared with row by row."""
    learnt = measured.learnt
    mean, doubt = (each[:, learnt] for each in cells.predict(quantiles))
    emulator = (doubt**2).sum(axis=2) + cells.rest[learnt]
    square = measured.scales[measured.output[learnt]] ** 2
    apart, rig = np.abs(measured.values[learnt] - mean), measured.variances[learnt]
    whole = np.sqrt(emulator + rig + (1.0 + BY_ROW**2) * square)
    return apart / whole, emulator / (rig + BY_ROW**2 * square)


def plausible(implausible: Array, wave: int) -> Mask:
    """Which input sets (n,) are left: in the first wave one cell may be off, as emulators are poor still."""
    place = max(implausible.shape[1] - (2 if wave == 0 else 1), 0)
    worst = np.partition(implausible, place, axis=1)[:, place]
    return worst < RULED_OUT


def ruling_out(implausible: Array) -> Whole:
    """Places of the cells that rule out every input set (n, k); where none does so alone, of the worst."""
    alone = np.flatnonzero((implausible >= RULED_OUT).all(axis=0))
    return alone if alone.size else np.argsort(-np.median(implausible, axis=0))[:2]


def more_sets(left: Array, fits: Callable[[Array], Mask], wanted: int, random: np.random.Generator) -> Array:
    """At least ``wanted`` quantiles where there are as many, of those left (n, d) and of others next to them that fit."""
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


# Input sets of a wave: so many, and so many an input; candidates that show what is left; sets that try the posterior.
FEWEST, EACH, CANDIDATES, TRIED = 64, 10, 16384, 50
# Emulators miss where squared residuals of the posterior's simulations average more than this.
MISSED = 2.0


class Batch(NamedTuple):
    """Simulated cells (n, c) in logarithms at quantiles (n, d), their variances (n, c) and degrees of freedom (n, c)."""

    quantiles: Array
    values: Array
    variances: Array
    freedom: Whole

    def joined(self, other: "Batch") -> "Batch":
        """Both."""
        return Batch(*(np.concatenate(each) for each in zip(self, other, strict=True)))


@dataclass(frozen=True, eq=False)
class Unknowns:
    """``inputs`` that are to be found: ``at`` turns normal scores (n, d) into quantiles, as they depend on each other."""

    inputs: int
    at: Callable[[Array], Array] = special.ndtr


@dataclass(frozen=True, eq=False)
class Matched:
    """What was found. ``volumes``: share of the prior that each wave left; ``refuted``: places of the cells that rule out
    everything, else none; ``sampled``: the posterior, None where everything is refuted and the simulation is taken as exact;
    ``tried``: its simulations, and the mean square ``misfit`` of the emulators there."""

    measured: Measured
    unknowns: Unknowns
    batch: Batch
    cells: Cells
    volumes: list[float]
    refuted: list[int]
    sampled: Sampled | None
    tried: Batch | None
    misfit: float

    def quantiles(self, points: Array) -> Array:
        """Quantiles (n, d) of the inputs of particles."""
        return self.unknowns.at(points[:, : self.unknowns.inputs])

    def errors(self, points: Array) -> Errors:
        """Errors of the simulation at particles, by output."""
        return self.measured.errors(points[:, self.unknowns.inputs :])

    def joint(self, points: Array) -> Joint:
        """Measured cells at particles."""
        return joint(self.cells, self.measured, self.quantiles(points), self.errors(points))


Simulate = Callable[[Array, int], Batch]


def sets_a_wave(inputs: int) -> int:
    """Input sets that a wave simulates for so many unknown inputs."""
    return max(FEWEST, EACH * inputs)


def matched(
    simulate: Simulate, measured: Measured, unknowns: Unknowns, seed: int, waves: int = 4, particles: int = PARTICLES
) -> Matched:
    """Find the inputs whose simulation is like what was measured.

    ``simulate(quantiles, number)`` runs input sets of the stage of that number. Raises what that raises, and RunError.
    """
    random = np.random.default_rng(seed)
    count, inputs = sets_a_wave(unknowns.inputs), unknowns.inputs
    candidates = nested(inputs, CANDIDATES, seed)
    points, volumes, refuted, batch, cells = candidates[:count], list[float](), list[int](), None, None
    for wave in range(waves):
        new = simulate(_dependent(unknowns, points), wave)
        measured = measured.with_scales(new.values) if batch is None else measured
        batch = new if batch is None else batch.joined(new)
        cells = _emulated(batch, measured, cells)
        apart, share = implausibility(cells, measured, _dependent(unknowns, candidates))
        fits = plausible(apart, wave)
        volumes.append(float(fits.mean()))
        if not fits.any():
            refuted = measured.learnt[ruling_out(apart)].tolist()
            break
        steady = wave > 0 and abs(volumes[-1] - volumes[-2]) < STEADY * volumes[-2]
        if steady or float(np.median(share[fits], axis=0).max()) < GOOD or wave == waves - 1:
            break
        points = _spread_over(candidates[fits], unknowns, cells, measured, wave, count, random)
    assert batch is not None and cells is not None
    found = Matched(measured, unknowns, batch, cells, volumes, refuted, None, None, 0.0)
    # A larger discrepancy than was allowed may still show patterns; an exact simulation that is refuted shows nothing.
    return found if refuted and not measured.scales.any() else _posterior(simulate, found, seed, particles, random)


def _posterior(simulate: Simulate, found: Matched, seed: int, particles: int, random: np.random.Generator) -> Matched:
    """Sample, simulate some of the posterior; where emulators miss it, they learn from that and it is sampled again."""
    for stage in (0, 1):
        size = found.unknowns.inputs + found.measured.scales.size
        sample = sampled(partial(_density, found), size, seed, particles)
        rows = random.choice(particles, TRIED, replace=False)
        tried = simulate(found.quantiles(sample.points[rows]), 100 + stage)
        found = replace(found, sampled=sample, tried=tried, misfit=_misfit(found.cells, tried))
        if found.misfit < MISSED:
            break
        if stage == 0:
            batch = found.batch.joined(tried)
            found = replace(found, batch=batch, cells=_emulated(batch, found.measured, found.cells))
    return found


def _density(found: Matched, points: Array) -> Array:
    return found.joint(points).log_density(found.measured.values, found.measured.learnt)


def _dependent(unknowns: Unknowns, quantiles: Array) -> Array:
    return unknowns.at(special.ndtri(quantiles.clip(1e-9, 1.0 - 1e-9)))


def _spread_over(
    left: Array,
    unknowns: Unknowns,
    cells: Cells,
    measured: Measured,
    wave: int,
    count: int,
    random: np.random.Generator,
) -> Array:
    def fits(quantiles: Array) -> Mask:
        return plausible(implausibility(cells, measured, _dependent(unknowns, quantiles))[0], wave)

    candidates = more_sets(left, fits, 4 * count, random)
    if len(candidates) > 20 * count:
        candidates = random.permutation(candidates)[: 20 * count]
    return spread_out(candidates, count)


def _emulated(batch: Batch, measured: Measured, before: Cells | None) -> Cells:
    compared = measured.variances + (BY_ROW * measured.scales[measured.output]) ** 2
    # An exact rig and no discrepancy still leave what the runs themselves scatter.
    compared = np.maximum(compared, 1e-3 * batch.values.var(axis=0) + 1e-12)
    return fit_cells(*batch, compared=compared, before=before)


def _misfit(cells: Cells, tried: Batch) -> float:
    """Mean square of how far simulations lie from the emulators, in their doubt and the runs' own error."""
    mean, doubt = cells.predict(tried.quantiles)
    whole = (doubt**2).sum(axis=2) + cells.rest + tried.variances.mean(axis=0)
    return float(((tried.values - mean) ** 2 / whole).mean())
