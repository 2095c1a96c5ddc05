"""Matern correlation of smoothness 5/2 with a length a factor, and random functions that have it.

Sources: Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), eqs 4.17 and 5.9; Rahimi and Recht, Random
features for large-scale kernel machines (2007).
"""

from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array

FREEDOM = 5  # of Student's distribution that is the spectral density of the Matern correlation 5/2


def squares(first: Array, second: Array) -> Array:
    """Squared distances (k, n, m) along each factor of points (n, k) and (m, k)."""
    return (first.T[:, :, None] - second.T[:, None, :]) ** 2


def correlation(first: Array, second: Array, lengths: Array) -> Array:
    """Correlation (n, m) of points (n, k) and (m, k)."""
    a, b = first / lengths, second / lengths
    apart = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None] - 2.0 * (a @ b.T)
    far = np.sqrt(5.0 * apart.clip(0.0))
    return (1.0 + far + far**2 / 3.0) * np.exp(-far)


def with_falls(along: Array, lengths: Array) -> tuple[Array, Array]:
    """Correlation (n, n) of squared distances ``along`` (k, n, n), and what its derivative by the logarithm of a length is over
    the squared distance along that factor in lengths (n, n)."""
    far = np.sqrt(5.0 * np.tensordot(1.0 / lengths**2, along, axes=1))
    fall = np.exp(-far)
    steep = (1.0 + far) * fall
    return steep + far**2 / 3.0 * fall, (5.0 / 3.0) * steep


class Features(NamedTuple):
    """Cosines of random frequencies (k, f) and phases (f,): weighted by standard normals, a random function of variance 1."""

    frequencies: Array
    phases: Array

    def __call__(self, points: Array) -> Array:
        """Values (n, f) at points (n, k)."""
        return np.sqrt(2.0 / self.phases.size) * np.cos(points @ self.frequencies + self.phases)


def random_features(lengths: Array, count: int, random: np.random.Generator) -> Features:
    """Features whose correlation is the Matern one on average."""
    normal = random.standard_normal((lengths.size, count)) / lengths[:, None]
    return Features(
        normal * np.sqrt(FREEDOM / random.chisquare(FREEDOM, count)), random.uniform(0.0, 2.0 * np.pi, count)
    )
