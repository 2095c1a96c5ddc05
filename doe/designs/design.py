"""A design of experiments as a record, and the classical designs: central composite, of three levels, and space-filling.

A ``Design`` has points with their blocks and kinds, and the order of the runs. Points are in coded units: centre 0, corners
of the cube -1 and +1, one column a factor. ``to_actual`` and ``to_coded`` convert them; ``replicate_groups`` finds replicates.

- Central composite designs extend two-level factorials, full or fractional, which may be divided into blocks.
- Box-Behnken designs have three levels and no corners: all points but the centre are on one sphere.
- Definitive screening designs have about twice as many runs as factors.
- Full factorials, Latin hypercubes and Sobol sequences fill the box from -1 to +1.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from rbdyn.base.arrays import Array, Rows, Whole
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record
from rbdyn.base.words import counted

Region = Literal["ball", "box"]
SAME_POINT = 1e-9  # coded units within which two runs are replicates


class Design(Record, eq=False):
    """Runs of a design in the order of execution.

    ``coded`` (n, k): points in coded units. ``block`` (n,): number of the block of each run, from 0. ``kind`` (n,): kind of
    each point, "cube", "axial", "edge", "grid", "sample", "screening", "optimal", "centre" or "added" in place of a
    failed run. ``order`` (n,): place
    of each run in the standard order, which identifies the run in any order. ``region``: where the design is to predict, a
    ball through its outermost points or a box. ``reach``: half-range of every factor in coded units.
    """

    coded: Array
    block: Rows
    kind: tuple[str, ...]
    order: Rows
    reach: float
    region: Region

    @property
    def extent(self) -> float:
        """Radius of the ball, or half-width of the box, of the region."""
        return float(np.linalg.norm(self.coded, axis=1).max()) if self.region == "ball" else self.reach

    @property
    def block_numbers(self) -> list[int]:
        """Number of the block of each run from 1, as in tables and files."""
        return [int(number) + 1 for number in self.block]

    @property
    def blocks(self) -> int:
        """Number of blocks."""
        return int(self.block.max()) + 1

    def by_blocks(self, seed: int | None = None) -> Self:
        """The design sorted by blocks, within each in standard order.

        With a ``seed`` the order within a block is random.
        """
        ties = np.arange(len(self.coded))
        if seed is not None:
            ties = np.random.default_rng(seed).permutation(len(self.coded))
        return self.rows(np.lexsort((ties, self.block)))

    def rows(self, rows: Rows) -> Self:
        """The design of these runs, in this order."""
        kind = tuple(self.kind[row] for row in rows)
        return replace(self, coded=self.coded[rows], block=self.block[rows], kind=kind, order=self.order[rows])


def design_of_parts(parts: Sequence[tuple[str, Array]], blocks: Sequence[int], reach: float, region: Region) -> Design:
    """A design in standard order from (kind, points) parts, with the block of every run."""
    coded = np.vstack([points for _, points in parts]) + 0.0  # no negative zeros
    kinds = tuple(kind for kind, points in parts for _ in points)
    return Design(coded, np.array(blocks, dtype=np.intp), kinds, np.arange(len(coded)), reach, region)


def replicate_groups(points: Array, block: Whole | None = None) -> Whole:
    """First run at the same point as each run (n, k), within its block where ``block`` is given; shape (n,)."""
    first = np.empty(len(points), np.int64)
    for place, point in enumerate(points):
        # Run by run: all distances of ten thousand runs at once would take gigabytes.
        same = np.abs(points[: place + 1] - point).max(axis=1) <= SAME_POINT
        if block is not None:
            same &= block[: place + 1] == block[place]
        first[place] = same.argmax()
    return first


def to_actual(coded: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Actual factor values of coded points (..., k); ``centre`` and ``step`` (k,) are in actual units."""
    return np.asarray(centre, float) + np.asarray(coded, float) * np.asarray(step, float)


def to_coded(actual: ArrayLike, centre: ArrayLike, step: ArrayLike) -> Array:
    """Coded values of actual points (..., k); the inverse of `to_actual`.

    Raises MethodError when a step is zero.
    """
    step = np.asarray(step, float)
    if np.any(step == 0):
        raise MethodError(f"step = {step.tolist()}: every step must differ from zero")
    return (np.asarray(actual, float) - np.asarray(centre, float)) / step


# Generators of the smallest regular fractions of resolution V or more: each further factor is the product of
# these factors. Box and Hunter, The 2^(k-p) fractional factorial designs II, Technometrics 3 (1961).
RESOLUTION_V = {5: ("ABCD",), 6: ("ABCDE",), 7: ("ABCDEF",), 8: ("ABCD", "ABEF")}


def central_composite(
    factors: int,
    *,
    alpha: float | str = "rotatable",
    centre_replicates: int = 6,
    cube: str = "full",
    blocks: bool = False,
) -> Design:
    """Central composite design in standard order.

    factors : number of factors k, at least 2.
    alpha : axial distance in coded units, or one of the words of `axial_distance`; "inscribed" is the
        rotatable design scaled to axial points at -1 and +1.
    centre_replicates : number of centre points, whose scatter estimates the pure error.
    cube : "full", or "resolution_v" for the tabulated fraction.
    blocks : whether cube and axial points are separate blocks, which share the centre points by `centre_shares`.

    Raises MethodError when a number is out of range, ``alpha`` or ``cube`` is unknown, the fraction is not tabulated, or the
    blocks are impossible.

    Source: Box and Hunter, Multi-factor experimental designs for exploring response surfaces,
    Ann. Math. Stat. 28 (1957) 195-241.
    """
    if factors < 2:
        raise MethodError(f"factors = {factors}: a central composite design needs at least 2 factors")
    if centre_replicates < 0:
        raise MethodError(f"centre_replicates = {centre_replicates}: must be at least 0")
    corners = cube_points(factors, cube)
    shares = centre_shares(factors, len(corners), alpha, centre_replicates)
    distance = axial_distance(factors, alpha, cube_runs=len(corners), centres=shares)
    axial = np.asarray(np.kron(np.eye(factors), [[-distance], [distance]]), float)
    if alpha == "inscribed":
        corners = corners / axial_distance(factors, "rotatable", cube_runs=len(corners))
    parts = [("cube", corners), ("axial", axial), ("centre", np.zeros((centre_replicates, factors)))]
    of_run = [0] * (len(corners) + len(axial) + centre_replicates)
    if blocks:
        of_run = [*[0] * len(corners), *[1] * len(axial), *[0] * shares[0], *[1] * shares[1]]
    ball = distance > 1.0 or alpha == "inscribed"
    return design_of_parts(parts, of_run, max(1.0, distance), "ball" if ball else "box")


def axial_distance(
    factors: int, alpha: float | str, *, cube_runs: int | None = None, centres: tuple[int, int] = (0, 0)
) -> float:
    """Axial distance in coded units, from a number or a word.

    There are k factors, F runs of the cube (``cube_runs``, by default 2^k) and N runs in all. ``centres`` are n0c centre
    points with the cube and n0s with the axial points:

    - "rotatable": F^(1/4); the variance of a predicted quadratic depends only on the distance from the centre
    - "spherical": sqrt(k); axial points are as far out as the corners of the cube
    - "orthogonal_blocks": alpha^2 = k (1 + n0s/(2k)) / (1 + n0c/F); cube and axial block shift no term
    - "orthogonal_columns": alpha^2 = (sqrt(F N) - F)/2; estimates of the square terms are independent
    - "practical": k^(1/4); the corners of the box that the axial points span are nearer to the runs than in a rotatable design
    - "face_centred": 1; "inscribed": 1, with a smaller cube

    Raises MethodError for an unknown word or a number that is not positive and finite.

    Source: Box and Hunter (1957), rotatability and blocks; Khuri and Cornell, Response Surfaces (1987), columns; documentation
    of Design-Expert (Stat-Ease), practical.
    """
    cube = 2**factors if cube_runs is None else cube_runs
    total = cube + 2 * factors + sum(centres)
    distances = {
        "rotatable": math.pow(cube, 0.25),
        "spherical": math.sqrt(factors),
        "orthogonal_blocks": math.sqrt(factors * (1 + centres[1] / (2 * factors)) / (1 + centres[0] / cube)),
        "orthogonal_columns": math.sqrt((math.sqrt(cube * total) - cube) / 2),
        "practical": math.pow(factors, 0.25),
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


def centre_shares(factors: int, cube_runs: int, alpha: float | str, centre_replicates: int) -> tuple[int, int]:
    """Numbers of centre points with the cube and with the axial points, of ``centre_replicates`` in all.

    The blocks disturb the surface least when their orthogonal axial distance is nearest to ``alpha``. For
    alpha = "orthogonal_blocks" the rotatable distance is the target.

    Raises MethodError for an unknown ``alpha``.
    """
    word = "rotatable" if alpha in ("orthogonal_blocks", "inscribed") else alpha
    target = axial_distance(factors, word, cube_runs=cube_runs, centres=(0, centre_replicates))

    def away(with_cube: int) -> float:
        shares = (with_cube, centre_replicates - with_cube)
        orthogonal = axial_distance(factors, "orthogonal_blocks", cube_runs=cube_runs, centres=shares)
        return abs(math.log(orthogonal / target))

    best = min(range(centre_replicates + 1), key=away)
    return best, centre_replicates - best


def cube_points(factors: int, cube: str = "full") -> Array:
    """Corners (n, k) in standard order, the first factor fastest.

    ``cube``: "full" for 2^k corners, "resolution_v" for the smallest tabulated fraction that confounds no main effect or
    two-factor interaction with another. Raises MethodError for an unknown word or a fraction that is not tabulated.
    """
    if cube not in ("full", "resolution_v"):
        raise MethodError(f'cube = {cube!r}: choose "full" or "resolution_v"')
    generators = RESOLUTION_V.get(factors, ()) if cube == "resolution_v" else ()
    if cube == "resolution_v" and not generators:
        raise MethodError(
            f"cube = 'resolution_v': no fraction of resolution V is tabulated for {factors} factors, only for "
            f'{min(RESOLUTION_V)} to {max(RESOLUTION_V)}; use cube = "full"'
        )
    basic = factors - len(generators)
    corners = np.array([corner[::-1] for corner in product((-1.0, 1.0), repeat=basic)])
    added = [corners[:, ["ABCDEFGH".index(letter) for letter in word]].prod(axis=1) for word in generators]
    return np.column_stack([corners, *added])


# Factors that vary together, in the order of the published tables, and how the design divides into blocks:
# by parts of that list (4 and 5 factors) or by the sign of the product of the three (6 and 7 factors).
TOGETHER = {
    3: ("AB", "AC", "BC"),
    4: ("AB", "CD", "AD", "BC", "AC", "BD"),
    5: ("AB", "AC", "CD", "DE", "BE", "AD", "AE", "BC", "BD", "CE"),
    6: ("ABD", "BCE", "CDF", "ADE", "BEF", "ACF"),
    7: ("DEF", "AFG", "BEG", "ABD", "CDG", "ACE", "BCF"),
}
BLOCKS = {4: 3, 5: 2, 6: 2, 7: 2}
MOST_SCREENED = 8  # factors; the primes 3, 5 and 7 give the conference matrices up to there


def box_behnken(factors: int, *, centre_replicates: int = 6, blocks: bool = False) -> Design:
    """Box-Behnken design in standard order, 3 to 7 factors.

    ``blocks``: the published division into orthogonal blocks (3 for 4 factors, 2 for 5 to 7), each with the same
    number of centre points.

    Raises MethodError when the number of factors is out of range or has no blocks, or the blocks cannot share the centre
    points.

    Source: Box and Behnken, Some new three level designs for the study of quantitative variables,
    Technometrics 2 (1960) 455-475.
    """
    if factors not in TOGETHER:
        raise MethodError(
            f"kind = 'box_behnken': tabulated for 3 to 7 factors, not for {factors}; use kind = \"central_composite\""
        )
    number = BLOCKS.get(factors, 1) if blocks else 1
    if blocks and number == 1:
        raise MethodError(f"blocks = true: a Box-Behnken design in {factors} factors has no orthogonal blocks")
    if centre_replicates % number:
        raise MethodError(
            f"centre_replicates = {centre_replicates}: {number} blocks need equal shares of the centre points; give "
            f"a multiple of {number}"
        )
    edges, of_run = [], []
    for place, letters in enumerate(TOGETHER[factors]):
        columns = ["ABCDEFG".index(letter) for letter in letters]
        for signs in product((-1.0, 1.0), repeat=len(columns)):
            point = np.zeros(factors)
            point[columns] = signs[::-1]
            edges.append(point)
            part = place * number // len(TOGETHER[factors])
            of_run.append(int(np.prod(signs) > 0) if len(columns) == 3 else part)
    parts = [("edge", np.array(edges)), ("centre", np.zeros((centre_replicates, factors)))]
    return design_of_parts(parts, [index % number for index in (*of_run, *range(centre_replicates))], 1.0, "ball")


def definitive_screening(factors: int, *, centre_replicates: int = 1) -> Design:
    """Definitive screening design in 2 to 8 factors: a conference matrix, its mirror image, and centre points.

    With one centre point an even number k of factors has 2k + 1 runs; an odd number takes the next even design without one
    column. Main effects are orthogonal to each other and to all squares and products. Squares are separable from each other
    and from products, but products not all from each other: its model is "pure_quadratic".

    Raises MethodError when the number of factors is out of range.

    Source: Jones and Nachtsheim, A class of three-level designs for definitive screening in the presence of
    second-order effects, J. Qual. Technol. 43 (2011) 1-15; Xiao, Lin and Bai, Constructing definitive screening designs
    using conference matrices, J. Qual. Technol. 44 (2012) 2-8.
    """
    if not 2 <= factors <= MOST_SCREENED:
        raise MethodError(
            f"kind = 'definitive_screening': is for 2 to {MOST_SCREENED} factors, not for {factors}; use kind = "
            '"d_optimal"'
        )
    half = conference_matrix(factors + factors % 2)[:, :factors]
    points = np.stack([half, -half], axis=1).reshape(-1, factors)
    parts = [("screening", points), ("centre", np.zeros((centre_replicates, factors)))]
    return design_of_parts(parts, [0] * (len(points) + centre_replicates), 1.0, "box")


def conference_matrix(order: int) -> Array:
    """C (n, n) with zeros on the diagonal, else -1 and 1, and C'C = (n - 1) I; n - 1 is an odd prime or 1.

    Source: Paley, On orthogonal matrices, J. Math. Phys. 12 (1933) 311-320.
    """
    prime = order - 1
    squares = {place * place % prime for place in range(1, prime)}
    character = np.array([0, *(1 if place in squares else -1 for place in range(1, prime))], float)
    places = np.arange(prime)
    matrix = np.ones((order, order))
    matrix[1:, 1:] = character[(places[:, None] - places) % prime]
    matrix[1:, 0] = -1.0 if prime % 4 == 3 else 1.0
    matrix[0, 0] = 0.0
    return matrix


MOST_RUNS = 10_000
# Above this number of runs a Latin hypercube is even without exchanges, which would take seconds.
MOST_EXCHANGED = 200


def full_factorial(factors: int, *, levels: int = 3, centre_replicates: int = 0) -> Design:
    """All combinations of ``levels`` equally spaced values of each factor, the first factor fastest.

    ``centre_replicates`` points are added at the centre. Raises MethodError beyond 10 000 combinations.
    """
    if (runs := levels**factors) > MOST_RUNS:
        raise MethodError(
            f"levels = {levels}: {counted(factors, 'factor')} give {runs} runs, more than {MOST_RUNS}; give "
            'fewer levels or use kind = "sobol"'
        )
    values = np.linspace(-1.0, 1.0, levels)
    return _space_filling(
        "grid", np.array([combination[::-1] for combination in product(values, repeat=factors)]), centre_replicates
    )


def latin_hypercube(factors: int, *, runs: int = 60, seed: int = 1, centre_replicates: int = 0) -> Design:
    """Latin hypercube: in every factor one run in each of ``runs`` equal intervals.

    For up to `MOST_EXCHANGED` runs, exchanges within columns lower the centred discrepancy. The ``seed`` fixes the design.

    Source: McKay, Beckman and Conover, Technometrics 21 (1979) 239-245; Fang, Li and Sudjianto, Design and
    Modeling for Computer Experiments (2006) (exchanges).
    """
    from scipy.stats import qmc

    exchanges = "random-cd" if runs <= MOST_EXCHANGED else None
    sample = qmc.LatinHypercube(factors, optimization=exchanges, seed=seed).random(runs)
    return _space_filling("sample", 2.0 * sample - 1.0, centre_replicates)


def sobol(factors: int, *, runs: int = 60, seed: int = 1, centre_replicates: int = 0) -> Design:
    """The first ``runs`` points of a scrambled Sobol sequence; a longer design starts with the same runs.

    Powers of two are the most even.

    Source: Sobol, USSR Comput. Math. Math. Phys. 7 (1967) 86-112; Owen, scrambling, J. Complexity 14 (1998).
    """
    from scipy.stats import qmc

    sample = qmc.Sobol(factors, seed=seed).random_base2(max(runs - 1, 1).bit_length())[:runs]
    return _space_filling("sample", 2.0 * sample - 1.0, centre_replicates)


def _space_filling(kind: str, points: Array, centre_replicates: int) -> Design:
    centres = np.zeros((centre_replicates, points.shape[1]))
    blocks = [0] * (len(points) + centre_replicates)
    return design_of_parts([(kind, points), ("centre", centres)], blocks, 1.0, "box")
