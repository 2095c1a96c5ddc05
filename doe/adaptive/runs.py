"""Runs of a noisy simulator with what their replicates tell."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from doe.arrays import Array, Mask, Whole


class Runs(NamedTuple):
    """Runs at points (n, k) in coded units of the region, which is -1 to 1 at the start of a search.

    ``values`` (n, m), NaN where a run failed; standard ``errors`` (n, m) of these, their degrees of ``freedom`` (n, m; 0:
    unknown), and ``replicates`` (n,).
    """

    points: Array
    values: Array
    errors: Array
    freedom: Whole
    replicates: Whole

    @property
    def good(self) -> Mask:
        """Whether each run gave all its values, (n,)."""
        return np.asarray(np.isfinite(self.values).all(axis=1))

    def rows(self, which: Any) -> Runs:
        """Some of them."""
        return Runs(*(part[which] for part in self))

    def plus(self, more: Runs) -> Runs:
        """These and more."""
        return Runs(*(np.concatenate(both) for both in zip(self, more, strict=True)))


class Border(NamedTuple):
    """How far the faces of a region may be moved: to ``low`` and ``high`` (k,) in coded units, as long as runs are ``possible``
    at all corners (c, k) of it."""

    low: Array
    high: Array
    possible: Callable[[Array], bool]


class Face(NamedTuple):
    """A face that the pick lies ``at`` (coded): of a ``factor``, upper (``side`` 1) or lower (-1); ``better`` is the chance that
    the front goes on beyond. ``held`` by "allowed", "scene" (no run is possible beyond), "moves" (no more are made) or, "",
    by that chance alone."""

    factor: int
    side: int
    at: float
    better: float
    held: str


# Runs points (n, k) in factor units with (n,) replicates each, every row with a seed of its own: values, errors, freedom.
Evaluate = Callable[[Array, Whole], tuple[Array, Array, Whole]]
