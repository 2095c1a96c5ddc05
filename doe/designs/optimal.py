"""D- and I-optimal designs: the runs that estimate a model best, alone or added to earlier runs.

Where runs of a design failed, the points nearest to runs that went well remain of its region. A point is lost where a failed run lies nearer to it than any that went well: half-spaces midway between the two, so that
neither the shape nor the cause of what is lost needs to be known.

Source: Meyer and Nachtsheim, The coordinate-exchange algorithm for constructing exact optimal experimental designs,
Technometrics 37 (1995) 60-69; exchange formulas of Fedorov, Theory of Optimal Experiments (1972).
"""

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from doe.designs.design import Design, design_of_parts
from doe.designs.model import Terms, model_matrix, model_terms, moment_matrix
from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record
from rbdyn.base.words import counted

Criterion = Literal["d", "i"]
FEWEST, MOST = 4, 40  # random designs from which exchanges start; the best one is the result
WORK = 30_000  # coordinates times terms of all these designs together, above which there are fewer designs
MOST_RUNS = 500  # exchanges among more take minutes
# Coordinates are multiples of the half width of the box over GRID_STEPS: a finer grid gains little and separates replicates.
GRID_STEPS = 20
GRID = np.linspace(-1.0, 1.0, 9)  # of the first exchanges
MOVES = (2, 1)  # parts by which coordinates move in later exchanges
SWEEPS = 20  # largest number of passes through all coordinates with one step
LEAST = 1e-5  # least relative improvement of an exchange
RIDGE = 1e-6  # makes designs comparable that do not estimate all terms


def optimal(
    factors: int,
    *,
    criterion: Criterion,
    runs: int,
    seed: int = 1,
    terms: Terms | None = None,
    levels: Sequence[ArrayLike | None] | None = None,
    centre_replicates: int = 0,
) -> Design:
    """Design of ``runs`` new runs that estimate a model best.

    criterion : "d", the largest determinant of X'X and so the smallest joint region of the coefficients; "i", the least
        mean variance of predictions over the box.
    terms : of the model, with "1"; by default those of the quadratic.
    levels : coded values that each factor may take, None for any; by default all may take any.
    centre_replicates : number of additional centre points.

    The same seed gives the same design. Raises MethodError when the runs are too few for the terms, or too many.
    """
    terms = model_terms(factors, "quadratic") if terms is None else terms
    if centre_replicates + runs < len(terms):
        least, model = len(terms) + 1 - centre_replicates, counted(len(terms), "term")
        at_centre = f"with {centre_replicates} at the centre " if centre_replicates else ""
        raise MethodError(f"runs = {runs}: {at_centre}too few for a model of {model}; give at least {least}")
    if runs > MOST_RUNS:
        raise MethodError(
            f"runs = {runs}: exchanges among more than {MOST_RUNS} take long; give fewer, or kind = 'sobol'"
        )
    centre = np.zeros((centre_replicates, factors))
    rows = model_matrix(centre, terms)
    exchange = Exchange(
        terms,
        rows.T @ rows + RIDGE * np.eye(len(terms)),
        moment_matrix(terms, factors, "box", 1.0) if criterion == "i" else None,
        [None if values is None else np.asarray(values, float) for values in levels or [None] * factors],
    )
    points = exchange.best(exchange.starts(runs, np.random.default_rng(seed)))
    kinds = [("centre", centre), ("optimal", points[np.lexsort(points.T)])]
    return design_of_parts(kinds, [0] * (centre_replicates + runs), 1.0, "box")


def _on_parts(number: ArrayLike) -> Array:
    """Coordinates of a ``number`` of parts within the box, as quotients, so that equal coordinates have equal bits."""
    return np.asarray(np.rint(np.asarray(number, float)).clip(-GRID_STEPS, GRID_STEPS) / GRID_STEPS)


class Exchange(Record, eq=False):
    """Coordinate exchange in many designs (s, n, k) of new runs in parallel, in the box from -1 to 1.

    ``fixed_information`` (p, p): X'X of the runs at the centre. ``moments`` (p, p): weights of the variances of an I-optimal
    design, None for a D-optimal one.
    """

    terms: Terms
    fixed_information: Array
    moments: Array | None
    levels: Sequence[Array | None]

    def starts(self, runs: int, random: np.random.Generator) -> Array:
        """Random designs."""
        shape = min(max(WORK // (runs * len(self.levels) * len(self.fixed_information)), FEWEST), MOST), runs
        columns = [
            _on_parts(random.integers(-GRID_STEPS, GRID_STEPS, shape, endpoint=True))
            if values is None
            else random.choice(values, shape)
            for values in self.levels
        ]
        return np.stack(columns, axis=-1)

    def best(self, points: Array) -> Array:
        """The best design after all exchanges that improve them, first over a grid, then by smaller steps."""
        for parts in (0, *MOVES):
            self._sweep(points, parts)
        # Rounding makes equal designs equal, so that their last bits do not decide.
        return np.asarray(points[int(np.round(self._loss(points), 9).argmin())])

    def _information(self, points: Array) -> Array:
        rows = model_matrix(points, self.terms)
        return np.asarray(self.fixed_information + np.swapaxes(rows, -1, -2) @ rows)

    def _loss(self, points: Array) -> Array:
        information = self._information(points)
        if self.moments is None:
            return -np.linalg.slogdet(information)[1]
        return np.log(np.trace(np.linalg.inv(information) @ self.moments, axis1=-2, axis2=-1))

    def _sweep(self, points: Array, parts: int) -> None:
        """Exchange each coordinate of the designs, in place, until no exchange improves any design.

        Candidates are the neighbours ``parts`` away or, for 0, all values of the grid.
        """
        for _ in range(SWEEPS):
            inverse, improved = np.asarray(np.linalg.inv(self._information(points)), float), False
            for run in range(points.shape[1]):
                for factor, levels in enumerate(self.levels):
                    neighbours = (
                        _on_parts(GRID_STEPS * points[:, run, factor, None] + [-parts, parts]) if parts else GRID
                    )
                    improved |= self._exchange(points, inverse, (run, factor), neighbours if levels is None else levels)
            if not improved:
                return

    def _exchange(self, points: Array, inverse: Array, place: tuple[int, int], values: Array) -> bool:
        """Exchange one coordinate, of a run and a factor, for the best of ``values`` (c,) or (s, c); update ``inverse`` (s, p, p).

        Designs that no exchange improves stay.
        """
        run, factor = place
        trial = np.repeat(points[:, run, None], values.shape[-1], axis=1)
        trial[..., factor] = values
        old, new = model_matrix(points[:, run], self.terms), model_matrix(trial, self.terms)
        gain = self.gain(inverse, old, new)
        every = np.arange(len(points))
        best = np.round(gain, 9).argmax(axis=1)
        better = np.flatnonzero(gain[every, best] > LEAST)
        for sign, row in ((1.0, new[every, best]), (-1.0, old)):
            changed = np.einsum("sij,sj->si", inverse[better], row[better])
            within = 1.0 + sign * (changed * row[better]).sum(axis=1)
            inverse[better] -= sign * changed[:, :, None] * changed[:, None, :] / within[:, None, None]
        points[better, run] = trial[better, best[better]]
        return better.size > 0

    def gain(self, inverse: Array, old: Array, new: Array) -> Array:
        """Relative gain (s, c) of each of the ``new`` rows (s, c, p) in place of the ``old`` ones (s, p).

        It is the rise of the determinant or the fall of the mean variance, and -1 where a term is no longer estimable.
        """
        ahead = new @ inverse
        behind = np.einsum("sij,sj->si", inverse, old)
        at_new, between = (ahead * new).sum(axis=-1), np.einsum("scj,sj->sc", ahead, old)
        at_old = (behind * old).sum(axis=-1)[:, None]
        ratio = (1.0 + at_new) * (1.0 - at_old) + between**2
        if self.moments is None:
            return np.asarray(ratio - 1.0)
        weighted = ahead @ self.moments
        of_new, both = (weighted * ahead).sum(axis=-1), np.einsum("scj,sj->sc", weighted, behind)
        of_old = ((behind @ self.moments) * behind).sum(axis=-1)[:, None]
        variance = (inverse * self.moments).sum(axis=(-1, -2))[:, None]
        less = (1.0 - at_old) * of_new + 2.0 * between * both - (1.0 + at_new) * of_old
        estimable = ratio > RIDGE
        return np.where(estimable, less / (variance * np.where(estimable, ratio, 1.0)), -1.0)


class Remaining(Record, eq=False):
    """The region about coded points (n, k) of runs that went well (``ran``), apart from those that ``failed`` (f, k)."""

    ran: Array
    failed: Array

    def excess(self, coded: Array) -> Array:
        """How much nearer (n,) coded points (n, k) lie to a failed run than to one that went well; at most 0 in what remains."""
        return _distance(coded, self.ran) - _distance(coded, self.failed)


def _distance(points: Array, others: Array) -> Array:
    """Distance (n,) of points to the nearest of others."""
    nearest = np.full(len(points), np.inf)
    for other in others:
        np.minimum(nearest, np.linalg.norm(points - other, axis=1), out=nearest)
    return nearest


def added_points(points: Array, candidates: Array, terms: Terms, count: int) -> Array:
    """Points (count, k) among the candidates (c, k) that, with those of earlier runs (n, k), estimate the terms of a model best.

    One after another the candidate that raises the determinant of X'X most, the first of equal ones.

    Source: Dykstra, The augmentation of experimental data to maximize |X'X|, Technometrics 13 (1971) 682-688.
    """
    rows, columns = model_matrix(points, terms), model_matrix(candidates, terms)
    information = rows.T @ rows + RIDGE * np.eye(len(terms))
    places = []
    for _ in range(count):
        gains = np.einsum("ij,ij->i", columns @ np.linalg.inv(information), columns)
        # Last bits do not decide between equal gains.
        places.append(int((gains >= (1.0 - 1e-6) * gains.max()).argmax()))
        information += np.outer(columns[places[-1]], columns[places[-1]])
    return np.asarray(candidates[places])
