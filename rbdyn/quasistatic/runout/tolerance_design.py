"""Errors that the races of a bearing may have so that it meets a runout class with a given yield.

Zhou et al. 2024 turn a homogenisation coefficient round; here a lot of bearings is drawn and its yield counted. The
runout of a lot is linear in the limits and so is found for all of them at once; full equilibria of some bearings then set the size,
and the design is confirmed on a fresh lot, in proportion and in full.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rbdyn.arrays import Array
from rbdyn.faults import MethodError
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.row import Row
from rbdyn.quasistatic.runout import lots
from rbdyn.quasistatic.runout.race_errors import Turning, ball_path
from rbdyn.quasistatic.runout.turn import follow

# Bisections of a size: to a ten-thousandth.
HALVINGS = 14
REFINEMENTS = 3
SWAY_SHARES = tuple(2.0 ** (0.5 * k) for k in range(-6, 7))


@dataclass(frozen=True)
class FullCheck:
    """What full equilibria of the first bearings of a lot say about the proportion.

    Differences of the runouts in proportion from the full ones over the limit: root mean square, radial and face. ``agreeing``: bearings of ``bearings`` on which both say alike whether the class is met. ``gap``: share that
    meets it in full less share in proportion, with its standard error (as if one at least had differed).
    """

    bearings: int
    radial_rms: float
    face_rms: float
    agreeing: int
    gap: float
    gap_error: float


@dataclass(frozen=True)
class RaceLimits:
    """Limits [m] on the heights of race errors, and what they yield.

    ``radial_limit, axial_limit``: K_ia and S_ia that were to be met [m]. ``yielded``: share of a fresh lot that meets
    both, with its standard error: counted in proportion on many and corrected by what full equilibria of some say
    (``check``). ``proportional``: without that correction.
    ``homogenisation``: 95 % quantile of the radial runout over the sum of both roundness limits, and of the face runout
    over the sum of both side-sways.
    """

    inner_roundness: float
    outer_roundness: float
    inner_sway: float
    outer_sway: float
    radial_limit: float
    axial_limit: float
    yielded: float
    standard_error: float
    proportional: float
    homogenisation: tuple[float, float]
    bearings: int
    seed: int
    check: FullCheck | None


@dataclass(frozen=True)
class Bench:
    """How runout is measured: a nominal row under an axial load, as ``equilibrium.solve`` takes them.

    ``face_radius``: where the axial indicator touches the inner ring [m]; ``steps`` to a turn, ``turns`` of the ring.
    """

    row: Row
    control: Control
    load: Array
    turning: Turning
    face_radius: float
    steps: int = 120
    turns: int = 2
    given: Array | None = None


def design(
    bench: Bench,
    lot: lots.Lot,
    *,
    radial_limit: float,
    axial_limit: float,
    wanted: float = 0.95,
    outer_share: float = 1.0,
    sway_shares: Sequence[float] = SWAY_SHARES,
    bearings: int = 4000,
    seed: int = 1,
    solved: int = 0,
) -> RaceLimits:
    """Largest race errors with which the share ``wanted`` of a lot keeps both runouts [m].

    ``outer_share``: limit of an outer race over that of the inner one. ``sway_shares``: side-sway limits over roundness
    limits that are tried; the one that leaves the largest product of both is taken, so that neither is held tight for
    the other's sake. ``solved``: how many bearings are solved in full, again and again to set the size of all limits and
    once more of the fresh lot; 0 leaves all to the proportion. Raises MethodError where the balls alone
    fail the class or no race error reaches the ring, and as ``linear_response`` and ``turn.follow``.
    """
    if not 0.0 < wanted < 1.0:
        raise MethodError(f"wanted = {wanted:g}: a yield lies between 0 and 1; give a share such as 0.95")
    response = lots.linear_response(bench.row, bench.control, bench.load, bench.given)
    parts, read = _lot(bench, lot, response, bearings, seed)
    allowed = np.array([radial_limit, axial_limit])
    shares = (np.array([1.0, outer_share, share, share * outer_share]) for share in sway_shares)
    limits = max((_widest(each, read, allowed, wanted) for each in shares), key=lambda tried: float(tried.prod()))
    for _ in range(REFINEMENTS if solved else 0):
        # Runout all but follows the size of the races: its quantile is brought to the limit. That of the lot is known in
        # proportion, and from a few bearings how much larger the full one is.
        reached = (np.column_stack(runouts(read, limits)) / allowed).max(axis=1)
        full = (full_lot(bench, parts, limits, solved) / allowed).max(axis=1)
        larger = np.quantile(full, wanted) / np.quantile(reached[:solved], wanted)
        limits = limits / float(larger * np.quantile(reached, wanted))
    # A design is best on the lot that it was fitted to: count it on another.
    parts, read = _lot(bench, lot, response, bearings, seed + 1)
    radial, face = runouts(read, limits)
    good = (radial <= radial_limit) & (face <= axial_limit)
    check = compare(bench, parts, read, limits, allowed, solved) if solved else None
    proportional = float(good.mean())
    gap, gap_error = (0.0, 0.0) if check is None else (check.gap, check.gap_error)
    return RaceLimits(
        **dict(zip(lots.RACES, limits.tolist(), strict=True)),
        radial_limit=radial_limit,
        axial_limit=axial_limit,
        yielded=min(proportional + gap, 1.0),
        standard_error=math.hypot(math.sqrt(proportional * (1.0 - proportional) / bearings), gap_error),
        proportional=proportional,
        homogenisation=(
            float(np.quantile(radial, 0.95) / limits[:2].sum()),
            float(np.quantile(face, 0.95) / limits[2:].sum()),
        ),
        bearings=bearings,
        seed=seed,
        check=check,
    )


def runouts(read: lots.Readings, limits: Sequence[float] | Array) -> tuple[Array, Array]:
    """Radial and face runout [m] of each bearing of a lot at the limits [m] of ``RACES``."""
    radial = np.tensordot(limits, read.radial, 1) + read.radial_balls
    face = np.tensordot(limits, read.face, 1) + read.face_balls
    return np.ptp(radial, axis=1), np.ptp(face, axis=1)


def full_runouts(bench: Bench, parts: lots.Parts, limits: Array, bearing: int) -> tuple[float, float]:
    """Radial and face runout [m] of one bearing of a lot by full equilibria, read as in ``readings``."""
    errors = lots.bearing_errors(parts, bearing, limits)
    path = ball_path(errors, bench.turning, bench.steps, bench.turns)
    place = follow(bench.row, bench.control, bench.load, path, bench.turns, bench.given).path
    return float(np.ptp(place[:, 0])), float(np.ptp(place[:, 2] - bench.face_radius * place[:, 4]))


def full_lot(bench: Bench, parts: lots.Parts, limits: Array, count: int) -> Array:
    """Full runouts [m] of the first ``count`` bearings of a lot, (count, 2)."""
    return np.array([full_runouts(bench, parts, limits, bearing) for bearing in range(count)])


def _lot(
    bench: Bench, lot: lots.Lot, response: lots.LinearResponse, bearings: int, seed: int
) -> tuple[lots.Parts, lots.Readings]:
    parts = lots.draw_parts(lot, len(bench.row.axial), bearings, seed)
    return parts, lots.readings(parts, response, bench.turning, bench.steps, bench.turns, bench.face_radius)


def _widest(shares: Array, read: lots.Readings, allowed: Array, wanted: float) -> Array:
    """Largest limits in these shares with which the share ``wanted`` keeps what is ``allowed``, by bisection."""
    radial_races, face_races = np.tensordot(shares, read.radial, 1), np.tensordot(shares, read.face, 1)

    def passes(size: float) -> bool:
        radial = np.ptp(size * radial_races + read.radial_balls, axis=1)
        face = np.ptp(size * face_races + read.face_balls, axis=1)
        return float(((radial <= allowed[0]) & (face <= allowed[1])).mean()) >= wanted

    if not passes(0.0):
        raise MethodError("the balls alone fail the class; take better balls or a wider class")
    low, high = 0.0, float(allowed[0])
    while passes(high):
        if high > 1e6 * allowed[0]:
            raise MethodError("no order of these race errors reaches the ring; let the lot have more orders")
        low, high = high, 2.0 * high
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if passes(middle) else (low, middle)
    return low * shares


def compare(
    bench: Bench, parts: lots.Parts, read: lots.Readings, limits: Array, allowed: Array, count: int
) -> FullCheck:
    """Solve the first ``count`` bearings of a lot in full; ``allowed``: radial and face runout of the class [m]."""
    full = full_lot(bench, parts, limits, count)
    proportional = np.column_stack(runouts(read, limits))[:count]
    off = (proportional - full) / allowed
    radial_rms, face_rms = np.sqrt((off**2).mean(axis=0)).tolist()
    better = np.all(full <= allowed, axis=1).astype(int) - np.all(proportional <= allowed, axis=1)
    differing = int(np.abs(better).sum())
    return FullCheck(
        bearings=count,
        radial_rms=radial_rms,
        face_rms=face_rms,
        agreeing=count - differing,
        gap=float(better.mean()),
        gap_error=math.sqrt(max(differing, 1)) / count,
    )
