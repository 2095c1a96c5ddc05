"""D- and I-optimal designs: so many runs as estimate a model best, all new or added to runs that were made.

Source: Meyer and Nachtsheim, The coordinate-exchange algorithm for constructing exact optimal experimental designs,
Technometrics 37 (1995) 60-69; exchange formulas of Fedorov, Theory of Optimal Experiments (1972).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from doe.designs.design import Design, assembled
from doe.designs.model import Terms, model_matrix, model_terms
from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError
from rbdyn.base.words import counted

Criterion = Literal["d", "i"]
FEWEST, MOST = 4, 40  # random designs that exchanges start from; the best is kept
WORK = 30_000  # coordinates times terms, of all these designs together, beyond which they are fewer
MOST_RUNS = 500  # exchanges among more take minutes
# Of the half width of the box, on which coordinates lie: finer ones gain next to nothing and part replicates.
PARTS = 20
GRID = np.linspace(-1.0, 1.0, 9)  # of the first exchanges; then coordinates move by so many parts:
MOVES = (2, 1)
SWEEPS = 20  # through all coordinates, at most, with one step
LEAST = 1e-5  # share by which an exchange improves a design at least
RIDGE = 1e-6  # keeps designs that do not estimate all terms comparable


def optimal(
    factors: int,
    *,
    criterion: Criterion,
    runs: int,
    seed: int = 1,
    terms: Terms | None = None,
    levels: Sequence[ArrayLike | None] | None = None,
    made: ArrayLike = (),
    block: ArrayLike | None = None,
    centre_replicates: int = 0,
) -> Design:
    """Add ``runs`` runs to those made such that all together estimate a model as well as they can.

    criterion : "d", the largest determinant of X'X and so the smallest joint region of the coefficients; "i", the least
        mean variance of predictions over the box.
    terms : of the model, with "1"; the quadratic's unless given.
    levels : of each factor the coded values that it may take, None for any; all may take any unless given.
    made : coded points (m, k) of runs that were made, which stay as they are and come first; the box from -1 to 1 grows
        until it holds them.
    block : of each of these, from 0 (m,); where there are several blocks, the new runs make one more.
    centre_replicates : centre points besides.

    The same seed gives the same design. Raises MethodError when the runs are too few for the terms, or too many.
    """
    from doe.designs.evaluation import block_contrasts, moment_matrix

    terms = model_terms(factors, "quadratic") if terms is None else terms
    old = np.asarray(made, float).reshape(-1, factors)
    groups = np.zeros(len(old), np.int64) if block is None else np.asarray(block, np.int64)
    new = int(groups.max(initial=0)) + 1 if len(np.unique(groups)) > 1 else 0
    fixed = np.vstack([old, np.zeros((centre_replicates, factors))])
    needed = len(terms) + len(np.unique([*groups, new])) - 1
    if len(fixed) + runs < needed:
        least, model = needed + 1 - len(fixed), counted(len(terms), "term")
        if len(fixed):
            few = f"with {len(fixed)} given or at the centre too few for a model of {model}"
        else:
            few = f"too few for a model of {model}"
        raise MethodError(f"runs = {runs}: {few}; give at least {least}")
    if runs > MOST_RUNS:
        raise MethodError(
            f"runs = {runs}: exchanges among more than {MOST_RUNS} take long; give fewer, or kind = 'sobol'"
        )
    reach = max(1.0, float(np.abs(old).max(initial=0.0)))
    blocks = np.concatenate([groups, np.full(centre_replicates + runs, new)])
    contrasts = block_contrasts(blocks)
    rows = np.hstack([model_matrix(fixed / reach, terms), contrasts[: len(fixed)]])
    size = len(terms)
    weights = np.zeros((rows.shape[1],) * 2)
    weights[:size, :size] = moment_matrix(terms, factors, "box", 1.0)
    exchange = Exchange(
        terms,
        contrasts[-1],
        rows.T @ rows + RIDGE * np.eye(rows.shape[1]),
        weights if criterion == "i" else None,
        [None if each is None else np.asarray(each, float) / reach for each in levels or [None] * factors],
    )
    points = exchange.best(exchange.starts(runs, np.random.default_rng(seed)))
    kinds = [("given", old), ("centre", fixed[len(old) :]), ("optimal", reach * points[np.lexsort(points.T)])]
    return assembled(kinds, blocks.tolist(), reach, "box")


def _on_parts(number: ArrayLike) -> Array:
    """Coordinates of so many parts, within the box; quotients, which have the same bits whatever they were made by."""
    return np.asarray(np.rint(np.asarray(number, float)).clip(-PARTS, PARTS) / PARTS)


@dataclass(frozen=True, eq=False)
class Exchange:
    """Exchanges of coordinates in many designs (s, n, k) of new runs side by side, in the box from -1 to 1.

    ``beside`` (b,) stands in the row of every new run for the blocks, ``made`` (p, p) is X'X of the runs that stay;
    ``moments`` (p, p) weigh the variances of an I-optimal design, None for a D-optimal one.
    """

    terms: Terms
    beside: Array
    made: Array
    moments: Array | None
    levels: Sequence[Array | None]

    def starts(self, runs: int, random: np.random.Generator) -> Array:
        """Random designs."""
        shape = min(max(WORK // (runs * len(self.levels) * len(self.made)), FEWEST), MOST), runs
        columns = [
            _on_parts(random.integers(-PARTS, PARTS, shape, endpoint=True))
            if each is None
            else random.choice(each, shape)
            for each in self.levels
        ]
        return np.stack(columns, axis=-1)

    def best(self, points: Array) -> Array:
        """The best of the designs after all exchanges that improve them, first over a grid, then by smaller steps."""
        for parts in (0, *MOVES):
            self._sweep(points, parts)
        # Rounded, lest the last bits of equals choose among them.
        return np.asarray(points[int(np.round(self._loss(points), 9).argmin())])

    def _rows(self, points: Array) -> Array:
        columns = model_matrix(points, self.terms)
        return np.concatenate([columns, np.broadcast_to(self.beside, (*columns.shape[:-1], self.beside.size))], axis=-1)

    def _information(self, points: Array) -> Array:
        rows = self._rows(points)
        return np.asarray(self.made + np.swapaxes(rows, -1, -2) @ rows)

    def _loss(self, points: Array) -> Array:
        information = self._information(points)
        if self.moments is None:
            return -np.linalg.slogdet(information)[1]
        return np.log(np.trace(np.linalg.inv(information) @ self.moments, axis1=-2, axis2=-1))

    def _sweep(self, points: Array, parts: int) -> None:
        """Exchange each coordinate of the designs, in place, for a neighbour so many ``parts`` away, 0 for any on the grid,
        until none improves any design."""
        for _ in range(SWEEPS):
            inverse, improved = np.asarray(np.linalg.inv(self._information(points)), float), False
            for run in range(points.shape[1]):
                for factor, levels in enumerate(self.levels):
                    beside = _on_parts(PARTS * points[:, run, factor, None] + [-parts, parts]) if parts else GRID
                    improved |= self._exchange(points, inverse, (run, factor), beside if levels is None else levels)
            if not improved:
                return

    def _exchange(self, points: Array, inverse: Array, place: tuple[int, int], given: Array) -> bool:
        """Exchange one coordinate, a run's and a factor's, for the best of those given, (c,) or (s, c), where that improves a
        design; update the ``inverse`` (s, p, p)."""
        run, factor = place
        trial = np.repeat(points[:, run, None], given.shape[-1], axis=1)
        trial[..., factor] = given
        old, new = self._rows(points[:, run]), self._rows(trial)
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
        """By what share each of the ``new`` rows (s, c, p) in place of the ``old`` (s, p) raises the determinant, or lowers the
        mean variance, of the designs; -1 where it leaves a term untold."""
        ahead = new @ inverse
        behind = np.einsum("sij,sj->si", inverse, old)
        at_new, between = (ahead * new).sum(axis=-1), np.einsum("scj,sj->sc", ahead, old)
        at_old = (behind * old).sum(axis=-1)[:, None]
        ratio = (1.0 + at_new) * (1.0 - at_old) + between**2
        if self.moments is None:
            return np.asarray(ratio - 1.0)
        weighed = ahead @ self.moments
        of_new, both = (weighed * ahead).sum(axis=-1), np.einsum("scj,sj->sc", weighed, behind)
        of_old = ((behind @ self.moments) * behind).sum(axis=-1)[:, None]
        whole = (inverse * self.moments).sum(axis=(-1, -2))[:, None]
        less = (1.0 - at_old) * of_new + 2.0 * between * both - (1.0 + at_new) * of_old
        told = ratio > RIDGE
        return np.where(told, less / (whole * np.where(told, ratio, 1.0)), -1.0)
