"""Two-level factorials, full and fractional, and their division into blocks. Corners at -1 and +1."""

from itertools import combinations, product

import numpy as np

from doe.arrays import Array, Rows

# Generators of the smallest regular fractions of resolution V or more: each added factor is the product of
# the named ones. Box and Hunter, The 2^(k-p) fractional factorial designs II, Technometrics 3 (1961).
RESOLUTION_V = {5: ("ABCD",), 6: ("ABCDE",), 7: ("ABCDEF",), 8: ("ABCD", "ABEF")}


def cube_points(factors: int, cube: str = "full") -> Array:
    """Corners (n, k) in standard order, the first factor fastest.

    ``cube``: "full" for 2^k corners, "resolution_v" for the smallest tabulated fraction in which no main
    effect or two-factor interaction is confused with another. Raises ValueError where none is tabulated or
    the word is unknown.
    """
    if cube not in ("full", "resolution_v"):
        raise ValueError(f'cube = {cube!r}: choose "full" or "resolution_v"')
    generators = RESOLUTION_V.get(factors, ()) if cube == "resolution_v" else ()
    if cube == "resolution_v" and not generators:
        tabulated = f"tabulated for {factors} factors, only for {min(RESOLUTION_V)} to {max(RESOLUTION_V)}"
        raise ValueError(f"cube = 'resolution_v': no fraction of resolution V is {tabulated}; use cube = \"full\"")
    basic = factors - len(generators)
    corners = np.array([corner[::-1] for corner in product((-1.0, 1.0), repeat=basic)])
    added = [corners[:, ["ABCDEFGH".index(letter) for letter in word]].prod(axis=1) for word in generators]
    return np.column_stack([corners, *added])


def corner_blocks(corners: Array, blocks: int) -> Rows:
    """Block (n,) of each corner, such that no block effect is confused with a term up to second order.

    Blocks are told by the signs of interactions of three or more factors, the longest that serve; their
    products must not be short either. Raises ValueError where no such division exists.
    """
    if blocks == 1:
        return np.zeros(len(corners), dtype=np.intp)
    count = corners.shape[1]
    longest_first = (word for size in range(count, 2, -1) for word in combinations(range(count), size))
    words = [corners[:, word].prod(axis=1) for word in longest_first]
    short = _short_products(corners)
    clear = [word for word in words if not np.abs(short.T @ word).any()]
    if blocks == 2 and clear:
        return (clear[0] > 0).astype(np.intp)
    if blocks == 4:
        for one, two in combinations(clear, 2):
            between = one * two
            if not np.abs(short.T @ between).any():
                return (2 * (one > 0) + (two > 0)).astype(np.intp)
    what = f"cube_blocks = {blocks}: {len(corners)} corners of {corners.shape[1]} factors cannot be divided so without"
    raise ValueError(f"{what} confusing a block with a second-order term; use fewer blocks or a larger cube")


def _short_products(corners: Array) -> Array:
    """Columns of the constant, the factors and the products of two."""
    pairs = [corners[:, pair].prod(axis=1) for pair in combinations(range(corners.shape[1]), 2)]
    return np.column_stack([np.ones(len(corners)), corners, *pairs])
