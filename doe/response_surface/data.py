"""The runs that a surface is fitted to, and whether they can be."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from doe.arrays import Array, Rows, Whole
from doe.designs.evaluation import block_contrasts
from doe.designs.model import Terms
from doe.response_surface.least_squares import dependent_columns
from rbdyn.base.words import are, counted
from rbdyn.faults import MethodError


@dataclass(frozen=True, eq=False)
class Data:
    """Runs of one response.

    ``points`` (n, k) coded, ``values`` (n,); ``standard_errors`` (n,) of the values or None where they are not
    all known; ``replicates`` (n,) behind each standard error (0: unknown); ``block`` (n,) label of each run;
    ``centre`` and ``step`` (k,) actual value at coded 0 and per coded unit; ``without``: places of factors that no term is
    made of.
    """

    points: Array
    values: Array
    standard_errors: Array | None
    replicates: Whole
    block: Whole
    centre: Array
    step: Array
    without: Collection[int] = ()

    def rows(self, rows: Rows) -> "Data":
        """The runs of these rows alone."""
        errors = None if self.standard_errors is None else self.standard_errors[rows]
        per_run = self.points[rows], self.values[rows], errors, self.replicates[rows], self.block[rows]
        return Data(*per_run, self.centre, self.step, self.without)

    @property
    def block_columns(self) -> Array:
        """Columns that tell the blocks apart, each of mean zero, shape (n, blocks - 1).

        The surface then stands for the mean over all runs, and blocks that are orthogonal leave it as it is.
        """
        return block_contrasts(self.block)


def checked(
    name: str,
    coded: ArrayLike,
    values: ArrayLike,
    centre: ArrayLike,
    step: ArrayLike,
    standard_errors: ArrayLike | None,
    replicates: ArrayLike | None,
    block: ArrayLike | None,
    without: Collection[int] = (),
) -> Data:
    """Runs as arrays. Raises MethodError when shapes differ, a number is not finite, or all values are equal."""
    points, response = np.asarray(coded, float), np.asarray(values, float)
    if points.ndim != 2 or response.shape != (len(points),):
        shapes = f"points of shape {points.shape} and values of shape {response.shape}"
        raise MethodError(f"{name}: {shapes} do not match; give one row of factors and one value a run")
    if not np.isfinite(points).all():
        raise MethodError(f"{name}: a coded factor is not a finite number; mend or leave out that run")
    bad = np.flatnonzero(~np.isfinite(response))
    if bad.size:
        given = f"the value of run {bad[0] + 1} is {response[bad[0]]}"
        raise MethodError(f"{name}: {given}; mend or leave out that run")
    errors = None if standard_errors is None else np.broadcast_to(standard_errors, response.shape)
    known = errors is not None and bool((np.isfinite(errors) & (errors > 0)).all())
    return Data(
        points=points,
        values=response,
        standard_errors=np.array(errors, float) if known else None,
        replicates=_whole(replicates, len(points)),
        block=_whole(block, len(points)),
        centre=np.array(np.broadcast_to(centre, points.shape[1]), float),
        step=np.array(np.broadcast_to(step, points.shape[1]), float),
        without=without,
    )


def check_errors(name: str, standard_errors: ArrayLike | None) -> None:
    """Raises MethodError unless every run has a positive standard error, as weighting by them needs."""
    mend = 'give each run a positive error or use weighting = "equal"'
    if standard_errors is None:
        raise MethodError(f'{name}: weighting = "replicates" needs the errors of the runs; {mend}')
    errors = np.atleast_1d(np.asarray(standard_errors, float))
    bad = np.flatnonzero(~(np.isfinite(errors) & (errors > 0)))
    if bad.size:
        given = f"the error of run {bad[0] + 1} is {errors[bad[0]]:g}"
        raise MethodError(f'{name}: {given}, but weighting = "replicates" needs positive ones; {mend}')


def check_size(name: str, model: str, terms: Terms, block: Whole) -> None:
    """Raises MethodError when runs, by the ``block`` (n,) of each, are too few for the terms and the blocks."""
    runs, more = len(block), len(np.unique(block)) - 1
    size = len(terms) + more
    if runs <= size:
        blocks = f", {more} for the blocks" if more else ""
        least = f"{size + 1} ({len(terms)} terms{blocks} and one to judge the fit) or choose a simpler model"
        raise MethodError(
            f"{name}: {counted(runs, 'run')} {are(runs)} too few for the {model} model; give at least {least}"
        )


def check_matrix(name: str, model: str, terms: Terms, matrix: Array) -> None:
    """Raises MethodError when runs cannot tell the columns apart.

    ``matrix`` (n, p) holds the columns of ``terms``, then those of the blocks.
    """
    if dependent := dependent_columns(matrix):
        names = dict.fromkeys(terms[column] if column < len(terms) else "the blocks" for column in dependent)
        what = f"{', '.join(sorted(names))} from the other terms of the {model} model (its matrix is singular)"
        raise MethodError(f"{name}: the runs cannot tell {what}; add design points or choose a simpler model")


def _whole(labels: ArrayLike | None, size: int) -> Whole:
    if labels is None:
        return np.zeros(size, dtype=np.int64)
    return np.array(np.broadcast_to(labels, size)).astype(np.int64)
