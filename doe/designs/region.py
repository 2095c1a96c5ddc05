"""The region where a design is meant to predict: its moments, its points, its directions."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from doe.arrays import Array
from doe.designs.design import Region
from doe.designs.model import term_powers

SAMPLE = 12  # base-2 logarithm of the size of the quasi-random sample of a region


def moment_matrix(terms: Sequence[str], factors: int, region: Region, reach: float) -> Array:
    """Mean over the region of the products of any two terms, shape (p, p).

    ``reach``: radius of the ball or half-width of the box. Closed form: in a box the mean of x^m is
    reach^m/(m + 1) for each factor and even m; for the ball see Folland, Am. Math. Mon. 108 (2001) 446-448.
    """
    from scipy.special import gammaln

    powers = term_powers(terms, factors)
    both = powers[:, None, :] + powers[None, :, :]
    degree = both.sum(axis=-1)
    if region == "box":
        means = np.prod(1.0 / (both + 1.0), axis=-1)
    else:
        on_sphere = gammaln(factors / 2) - gammaln((factors + degree) / 2)
        on_sphere += (gammaln((both + 1) / 2) - gammaln(0.5)).sum(axis=-1)
        means = np.exp(on_sphere) * factors / (factors + degree)
    return np.where((both % 2 == 1).any(axis=-1), 0.0, means * reach**degree)


def directions(factors: int) -> Array:
    """Unit vectors (3^k - 1, k) to the middle of every face, edge and corner of a cube."""
    towards = np.array([each for each in product((-1.0, 0.0, 1.0), repeat=factors) if any(each)])
    return towards / np.linalg.norm(towards, axis=1, keepdims=True)


def sample(factors: int, region: Region, reach: float) -> Array:
    """Evenly spread points (4096, k) of the region, always the same ones."""
    from scipy.stats import norm, qmc

    if region == "box":
        return reach * (2.0 * qmc.Sobol(factors, seed=0).random_base2(SAMPLE) - 1.0)
    unit = qmc.Sobol(factors + 1, seed=0).random_base2(SAMPLE)
    normal = norm.ppf(unit[:, :-1].clip(1e-12, 1 - 1e-12))
    radius = reach * unit[:, -1:] ** (1.0 / factors)
    return radius * normal / np.linalg.norm(normal, axis=1, keepdims=True)


def lattice(factors: int, reach: float) -> Array:
    """Regular points of a box with its corners, faces and centre: five levels a factor, three beyond six factors."""
    levels = np.linspace(-reach, reach, 5 if factors <= 6 else 3)
    return np.array(list(product(levels, repeat=factors)))
