"""Central composite designs in coded units: centre 0, cube corners -1 and +1, one column a factor. Their cubes:
two-level factorials, full and fractional, and their division into blocks."""

import math
from itertools import combinations, product

import numpy as np

from doe.arrays import Array, Rows
from doe.designs.design import Design, assembled
from rbdyn.faults import MethodError

# Generators of the smallest regular fractions of resolution V or more: each added factor is the product of
# the named ones. Box and Hunter, The 2^(k-p) fractional factorial designs II, Technometrics 3 (1961).
RESOLUTION_V = {5: ("ABCD",), 6: ("ABCDE",), 7: ("ABCDEF",), 8: ("ABCD", "ABEF")}


def central_composite(
    factors: int,
    *,
    alpha: float | str = "rotatable",
    centre_replicates: int = 6,
    cube: str = "full",
    blocks: bool = False,
    cube_blocks: int = 1,
) -> Design:
    """Central composite design in standard order.

    factors : number of factors k, at least 2.
    alpha : axial distance in coded units, or one of the words of `axial_distance`; "inscribed" is the
        rotatable design shrunk until its axial points lie at -1 and +1.
    centre_replicates : number of centre points, from whose scatter pure error is estimated.
    cube : "full", or "resolution_v" for the tabulated fraction.
    blocks : run cube and axial points in blocks of their own, the centre points shared between them by
        `centre_shares`.
    cube_blocks : blocks of the cube, 1, 2 or 4 (with ``blocks``).

    Raises MethodError when a number is out of its range, ``alpha`` or ``cube`` is an unknown word, no fraction is
    tabulated, or the blocks are impossible.

    Source: Box and Hunter, Multi-factor experimental designs for exploring response surfaces,
    Ann. Math. Stat. 28 (1957) 195-241.
    """
    if factors < 2:
        raise MethodError(f"factors = {factors}: a central composite design needs at least 2 factors")
    if centre_replicates < 0:
        raise MethodError(f"centre_replicates = {centre_replicates}: must be at least 0")
    corners = cube_points(factors, cube)
    number = cube_blocks if blocks else 1
    shares = centre_shares(factors, len(corners), alpha, centre_replicates, number)
    distance = axial_distance(factors, alpha, cube_runs=len(corners), centres=shares)
    axial = np.asarray(np.kron(np.eye(factors), [[-distance], [distance]]), float)
    if alpha == "inscribed":
        corners = corners / axial_distance(factors, "rotatable", cube_runs=len(corners))
    parts = [("cube", corners), ("axial", axial), ("centre", np.zeros((centre_replicates, factors)))]
    of_run = [0] * (len(corners) + len(axial) + centre_replicates)
    if blocks:
        of_cube = corner_blocks(corners, number).tolist()
        of_centres = [each % number for each in range(shares[0])] + [number] * shares[1]
        of_run = [*of_cube, *[number] * len(axial), *of_centres]
    ball = distance > 1.0 or alpha == "inscribed"
    return assembled(parts, of_run, max(1.0, distance), "ball" if ball else "box")


def axial_distance(
    factors: int, alpha: float | str, *, cube_runs: int | None = None, centres: tuple[int, int] = (0, 0)
) -> float:
    """Axial distance in coded units, from a number or a word.

    With k factors, F runs of the cube (``cube_runs``; 2^k unless given), ``centres`` centre points with the
    cube and with the axial points, and N runs in all:

    - "rotatable": F^(1/4); the variance of a predicted quadratic depends on the distance from the centre only
    - "spherical": sqrt(k); axial points as far out as the corners of the cube
    - "orthogonal_blocks": alpha^2 = k (1 + n0s/(2k)) / (1 + n0c/F); cube and axial block shift no term
    - "orthogonal_columns": alpha^2 = (sqrt(F N) - F)/2; square terms are estimated independently of each other
    - "face_centred": 1; "inscribed": 1, with the cube shrunk

    Raises MethodError for an unknown word or a number that is not positive and finite.

    Source: Box and Hunter (1957), rotatability and blocks; Khuri and Cornell, Response Surfaces (1987), columns.
    """
    cube = 2**factors if cube_runs is None else cube_runs
    total = cube + 2 * factors + sum(centres)
    distances = {
        "rotatable": math.pow(cube, 0.25),
        "spherical": math.sqrt(factors),
        "orthogonal_blocks": math.sqrt(factors * (1 + centres[1] / (2 * factors)) / (1 + centres[0] / cube)),
        "orthogonal_columns": math.sqrt((math.sqrt(cube * total) - cube) / 2),
        "face_centred": 1.0,
        "inscribed": 1.0,
    }
    if isinstance(alpha, str):
        if alpha not in distances:
            words = ", ".join(f'"{word}"' for word in distances)
            raise MethodError(f"alpha = {alpha!r}: write {words} or a positive number")
        return distances[alpha]
    if not (math.isfinite(alpha) and alpha > 0):
        raise MethodError(f"alpha = {alpha}: must be a positive number")
    return float(alpha)


def centre_shares(
    factors: int, cube_runs: int, alpha: float | str, centre_replicates: int, cube_blocks: int = 1
) -> tuple[int, int]:
    """Centre points with the cube and with the axial points, of ``centre_replicates`` in all.

    The share whose orthogonal blocking is nearest to the axial distance that is asked for (the rotatable one
    for alpha = "orthogonal_blocks"), so that blocks disturb the surface least; every block of the cube gets
    the same number.

    Raises MethodError for an unknown ``alpha``.
    """
    asked = "rotatable" if alpha in ("orthogonal_blocks", "inscribed") else alpha
    wanted = axial_distance(factors, asked, cube_runs=cube_runs, centres=(0, centre_replicates))

    def away(with_cube: int) -> float:
        shares = (with_cube, centre_replicates - with_cube)
        orthogonal = axial_distance(factors, "orthogonal_blocks", cube_runs=cube_runs, centres=shares)
        return abs(math.log(orthogonal / wanted))

    best = min(range(0, centre_replicates + 1, cube_blocks), key=away)
    return best, centre_replicates - best


def cube_points(factors: int, cube: str = "full") -> Array:
    """Corners (n, k) in standard order, the first factor fastest.

    ``cube``: "full" for 2^k corners, "resolution_v" for the smallest tabulated fraction in which no main
    effect or two-factor interaction is confused with another. Raises MethodError where none is tabulated or
    the word is unknown.
    """
    if cube not in ("full", "resolution_v"):
        raise MethodError(f'cube = {cube!r}: choose "full" or "resolution_v"')
    generators = RESOLUTION_V.get(factors, ()) if cube == "resolution_v" else ()
    if cube == "resolution_v" and not generators:
        tabulated = f"tabulated for {factors} factors, only for {min(RESOLUTION_V)} to {max(RESOLUTION_V)}"
        raise MethodError(f"cube = 'resolution_v': no fraction of resolution V is {tabulated}; use cube = \"full\"")
    basic = factors - len(generators)
    corners = np.array([corner[::-1] for corner in product((-1.0, 1.0), repeat=basic)])
    added = [corners[:, ["ABCDEFGH".index(letter) for letter in word]].prod(axis=1) for word in generators]
    return np.column_stack([corners, *added])


def corner_blocks(corners: Array, blocks: int) -> Rows:
    """Block (n,) of each corner, such that no block effect is confused with a term up to second order.

    Blocks are told by the signs of interactions of three or more factors, the longest that serve; their
    products must not be short either. Raises MethodError where no such division exists.
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
    raise MethodError(f"{what} confusing a block with a second-order term; use fewer blocks or a larger cube")


def _short_products(corners: Array) -> Array:
    """Columns of the constant, the factors and the products of two."""
    pairs = [corners[:, pair].prod(axis=1) for pair in combinations(range(corners.shape[1]), 2)]
    return np.column_stack([np.ones(len(corners)), corners, *pairs])
