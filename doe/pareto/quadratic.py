"""Quadratics of coded factors: their exact range over a box, and their values all around a point at once.

A response surface of first or second order is such a quadratic, seen through a monotone ``link`` where the response
was transformed before it was fitted.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from itertools import product

import numpy as np

from doe.arrays import Array

EXACT_FACTORS = 4  # up to here every face of a box is searched; beyond, its corners and lines along the factors


def identity(values: Array) -> Array:
    """The link of a response that was fitted as it is."""
    return values


@dataclass(frozen=True, eq=False)
class Quadratic:
    """``link`` of constant + linear · x + x · matrix · x at coded points x; ``matrix`` (k, k) is symmetric."""

    constant: float
    linear: Array
    matrix: Array
    link: Callable[[Array], Array] = identity

    def predict(self, points: Array) -> Array:
        """Values (...) at coded points (..., k)."""
        return self.link(self._form(points))

    def around(self, centres: Array, offsets: Array) -> Array:
        """Values (n, s) at every centre (n, k) plus every offset (s, k)."""
        slopes = self.linear + 2.0 * centres @ self.matrix
        bend = np.einsum("sj,jk,sk->s", offsets, self.matrix, offsets)
        return self.link(self._form(centres)[:, None] + slopes @ offsets.T + bend)

    def range_over_box(self, centres: Array, half: Array) -> tuple[Array, Array]:
        """Smallest and largest value (n,) over the boxes centres (n, k) +- half (k,).

        An extreme of a quadratic over a box is a stationary point of one of the box's faces (corners and the box
        itself among them). Up to `EXACT_FACTORS` factors all are searched and the range is exact; beyond, the search
        starts at the best corner and goes along one factor after the other.
        """
        lowest, highest = _extremes(self, centres, half)
        ends = self.link(lowest), self.link(highest)
        return np.minimum(*ends), np.maximum(*ends)

    def _form(self, points: Array) -> Array:
        return self.constant + points @ self.linear + np.einsum("...j,jk,...k->...", points, self.matrix, points)


def _extremes(surface: Quadratic, centres: Array, half: Array) -> tuple[Array, Array]:
    free = [axis for axis in range(half.size) if half[axis] > 0.0]
    # On the box of offsets t in [-1, 1] of the free factors.
    scale = half[free]
    start = surface._form(centres)
    slopes = (surface.linear + 2.0 * centres @ surface.matrix)[:, free] * scale
    bend = surface.matrix[np.ix_(free, free)] * np.outer(scale, scale)
    if len(free) > EXACT_FACTORS:
        return start - _climb(-slopes, -bend), start + _climb(slopes, bend)
    follow, fixed = _faces(bend.tobytes(), len(free))
    # Stationary point of each face (faces, n, free); what falls outside the box is not on the face.
    offset = np.einsum("fij,nj->fni", follow, slopes) + fixed[:, None, :]
    change = (offset * slopes).sum(axis=-1) + np.einsum("fnj,jk,fnk->fn", offset, bend, offset)
    inside = (np.abs(offset) <= 1.0).all(axis=-1)
    lowest = np.where(inside, change, np.inf).min(axis=0)
    return start + lowest, start + np.where(inside, change, -np.inf).max(axis=0)


@lru_cache(maxsize=64)
def _faces(bend_bytes: bytes, free: int) -> tuple[Array, Array]:
    """Stationary points of all faces of the unit box, as follow @ slopes + fixed: (faces, k, k) and (faces, k).

    A face without curvature has its extremes on its own edge, which is a face too, and is left out.
    """
    bend = np.frombuffer(bend_bytes).reshape(free, free)
    follow, fixed = [], []
    for face in product((-1.0, 0.0, 1.0), repeat=free):
        inside = np.array(face) == 0.0
        part = np.ix_(inside, inside)
        if inside.any() and np.linalg.cond(bend[part]) > 1e12:
            continue
        solve, place = np.zeros((free, free)), np.array(face)
        if inside.any():
            solve[part] = np.linalg.inv(-2.0 * bend[part])
            place[inside] = solve[part] @ (2.0 * bend[inside] @ np.array(face))
        follow.append(solve)
        fixed.append(place)
    return np.array(follow), np.array(fixed)


def _climb(slopes: Array, bend: Array, sweeps: int = 20) -> Array:
    """Largest change (n,) found from the best corner along the factors in turn."""
    corners = np.array(list(product((-1.0, 1.0), repeat=slopes.shape[1])))
    at_corners = slopes @ corners.T + np.einsum("sj,jk,sk->s", corners, bend, corners)
    offset = corners[at_corners.argmax(axis=1)]
    for axis in list(range(slopes.shape[1])) * sweeps:
        curvature = bend[axis, axis]
        gradient = slopes[:, axis] + 2.0 * (offset @ bend[:, axis] - offset[:, axis] * curvature)
        tries = np.stack([-np.ones(len(slopes)), np.ones(len(slopes))])
        if curvature < 0.0:
            tries = np.vstack([tries, (-gradient / (2.0 * curvature)).clip(-1.0, 1.0)])
        best = (gradient * tries + curvature * tries**2).argmax(axis=0)
        offset[:, axis] = np.take_along_axis(tries, best[None], axis=0)[0]
    return (offset * slopes).sum(axis=1) + np.einsum("nj,jk,nk->n", offset, bend, offset)
