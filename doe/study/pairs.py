"""Designs at the same input sets: what they gain over the first of them, input set by input set."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.emulator import pooled_variances
from doe.pareto import Goals
from doe.running.store import Failure
from doe.study.input_sets import Case, run
from rbdyn.scene.unknown import Input


@dataclass(frozen=True)
class Pairs:
    """p designs at the same input sets: ``places`` of these in what was asked for, their quantiles (n, d), outputs, variances
    and degrees of freedom (p, n, m); ``effort`` (n,): how many times the replicates of the first runs."""

    places: Whole
    quantiles: Array
    outputs: Array
    variances: Array
    freedom: Whole
    effort: Whole

    def at(self, rows: Whole) -> "Pairs":
        """The same at some rows, each as often as it is named."""
        outputs, variances, freedom = self.outputs[:, rows], self.variances[:, rows], self.freedom[:, rows]
        return Pairs(self.places[rows], self.quantiles[rows], outputs, variances, freedom, self.effort[rows])

    def joined(self, rows: Whole, other: "Pairs") -> "Pairs":
        """The same, at some rows joined with as many replicates more."""
        outputs, variances, freedom = self.outputs.copy(), self.variances.copy(), self.freedom.copy()
        outputs[:, rows] = 0.5 * (outputs[:, rows] + other.outputs)
        variances[:, rows] = 0.25 * (variances[:, rows] + other.variances)
        freedom[:, rows] += other.freedom + 1
        effort = self.effort.copy()
        effort[rows] *= 2
        return replace(self, outputs=outputs, variances=variances, freedom=freedom, effort=effort)

    def gains(self, goals: Goals, design: int = 1) -> tuple[Array, Array]:
        """Relative gains (n, q) of a design over the first, and their variances, smoothed over the inputs: of a row's own few
        replicates they are guesses, whose mean a few large ones make."""
        both = [0, design]
        gains, variances = relative_gains(goals, self.outputs[both], self.variances[both])
        freedom = self.freedom[both][:, :, goals.objectives].sum(axis=0)
        once = self.effort[:, None] * variances
        smooth = [pooled_variances(self.quantiles, *each) for each in zip(once.T, freedom.T, strict=True)]
        return gains, np.column_stack(smooth) / self.effort[:, None]

    def values(self, response: int, design: int = 1) -> tuple[Array, Array]:
        """Values (n,) of a response of a design, and their variances, smoothed over the inputs as those of gains are."""
        once = self.effort * self.variances[design][:, response]
        smooth = pooled_variances(self.quantiles, once, self.freedom[design][:, response])
        return self.outputs[design][:, response], smooth / self.effort


def relative_gains(goals: Goals, outputs: Array, variances: Array) -> tuple[Array, Array]:
    """Relative gains (n, q) of the second design over the first of outputs (2, n, m), and their variances."""
    index = goals.objectives
    scale = np.abs(outputs[0][:, index])
    before, after = (goals.costs(each) for each in outputs)
    gains = (before - after) / scale
    noise, other = (each[:, index] for each in variances)
    # The first is in the denominator too.
    return gains, (other + (1.0 - gains) ** 2 * noise) / scale**2


def simulated(
    case: Case,
    inputs: Sequence[Input],
    quantiles: Array,
    designs: Mapping[str, Sequence[str]],
    simulations: Simulations,
    seeds: int = 0,
    more: Sequence[str] = (),
) -> tuple[Pairs, tuple[Failure, ...]]:
    """Designs, each as overrides of the scene, at input sets; one at which any failed is left out."""
    given, title = (case, inputs, quantiles, simulations, seeds), f"input sets of the {{}}, from seed {seeds},"
    every = [run(*given, [*design, *more], title.format(name)) for name, design in designs.items()]
    places = reduce(np.intersect1d, (sets.places for sets in every))
    kept = [np.flatnonzero(np.isin(sets.places, places)) for sets in every]
    outputs, variances, freedom = (
        np.array([array[rows] for array, rows in zip(arrays, kept, strict=True)])
        for arrays in zip(*((sets.outputs, sets.variances, sets.freedom) for sets in every), strict=True)
    )
    lost = tuple(failure for sets in every for failure in sets.failures)
    effort = np.ones(len(places), dtype=np.int64)
    return Pairs(places, quantiles[places], outputs, variances, freedom, effort), lost
