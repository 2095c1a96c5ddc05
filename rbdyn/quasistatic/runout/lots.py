"""Runout of many bearings at once: races and balls drawn at random, answered in proportion.

Each bearing of a lot has races of a given height (roundness and side-sway, peak to valley) in random orders and phases
and balls with random diameters and sphericity. Only the orders that pass the balls (``linear_response``) reach the ring,
each as one wave: a bearing's reading is the real part of a short sum, and a lot is a product of two matrices.

Under a purely axial load all balls are alike, so one ball represents all: an error e of the ball at the azimuth psi moves
the ring by e g_x along psi, by e g_z axially, and tilts it by e g_tilt about the axis 90 degrees ahead of psi. Around
Z equal balls all orders of a groove cancel but n = kZ +- 1, which shift and tilt, and n = kZ, which moves axially.

Race limits for a runout class: Zhou et al. 2024 turn a homogenisation coefficient round; here a lot of bearings is drawn and its
yield counted. The runout of a lot is linear in the limits and so is found for all of them at once; full equilibria of some
bearings then set the size, and the design is confirmed on a fresh lot, in proportion and in full.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import MethodError, RunError
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.ring import Row
from rbdyn.quasistatic.runout.race_errors import RaceErrors, Turning, Waviness, ball_path
from rbdyn.quasistatic.runout.turn import follow

# Error of one ball in the differences [m]: far below any deflection, far above the solver's round-off.
SMALL_ERROR = 1e-8
CHANGES = ("axial", "radial", "inner_reach", "outer_reach")
Waves = NDArray[np.complex128]
# Kinds of race errors in the order of all arrays here.
RACES = ("inner_roundness", "outer_roundness", "inner_sway", "outer_sway")


class LinearResponse(NamedTuple):
    """Displacement by unit change [m] of one ball, (4,) for axial, radial, inner_reach and outer_reach.

    ``radial`` towards the ball [-], ``axial`` [-], ``tilt`` about the axis 90 degrees ahead of the ball [rad/m].
    """

    radial: Array
    axial: Array
    tilt: Array


def linear_response(row: Row, control: Control, load: Array, given: Array | None = None) -> LinearResponse:
    """Response of a row of equal, evenly spaced balls under an axial load, by central differences.

    Arguments as of ``equilibrium.solve``. Raises MethodError where load or row single out a direction, and RunError
    with the reason where there is no equilibrium.
    """
    if np.any(np.delete(load, 2)):
        raise MethodError("load: runout answers in proportion only under a purely axial load; set the rest to 0")
    if any(np.ptp(getattr(row, name)) > 0.0 for name in CHANGES):
        raise MethodError("row: balls differ already; give the nominal row")
    middle = _settled(solve(row, control, load, given))
    slopes = []
    for name in CHANGES:
        ends = []
        for change in (-SMALL_ERROR, SMALL_ERROR):
            changed = getattr(row, name).copy()
            changed[0] += change
            ends.append(_settled(solve(row._replace(**{name: changed}), control, load, given, middle)))
        slopes.append((ends[1].displacement - ends[0].displacement) / (2.0 * SMALL_ERROR))
    x, y, z, theta_x, theta_y = np.array(slopes).T
    cosine, sine = row.cosine[0], row.sine[0]
    return LinearResponse(x * cosine + y * sine, z, theta_y * cosine - theta_x * sine)


def _settled(solution: Solution) -> Solution:
    if not solution.found:
        raise RunError(f"runout of the nominal bearing: {solution.status}")
    return solution


@dataclass(frozen=True)
class Lot:
    """How the parts of a lot vary. Lengths in m.

    ``lowest_order, highest_order, decay``: of each race error; amplitudes fall as order^-decay on the average and are
    Rayleigh distributed. ``smallest_height``: heights are spread evenly from this share of the limit to the limit; 1 has
    every race just pass inspection. ``ball_diameter_spread``: standard deviation within a bearing.
    ``sphericity_orders, sphericity``: orders on each ball and the amplitude of each, phases random.
    """

    lowest_order: int = 1
    highest_order: int = 40
    decay: float = 1.0
    smallest_height: float = 1.0
    ball_diameter_spread: float = 0.0
    sphericity_orders: tuple[int, ...] = (2, 3, 4)
    sphericity: float = 0.0


class Parts(NamedTuple):
    """Parts of the bearings of a lot. ``races``: complex amplitudes (4, bearings, orders) of forms of limit one;
    ``diameter``: (bearings, Z) and ``sphericity``: complex amplitudes (bearings, orders, Z), in m."""

    order: Whole
    races: Waves
    diameter: Array
    sphericity_order: Whole
    sphericity: Waves


def draw_parts(lot: Lot, balls: int, bearings: int, seed: int) -> Parts:
    """Draw the parts of a number of bearings; a wave is Re(c exp(i order angle))."""
    draw = np.random.default_rng(seed)
    order = np.arange(lot.lowest_order, lot.highest_order + 1)
    shape = (len(RACES), bearings, order.size)
    races = order.astype(float) ** -lot.decay * (draw.standard_normal(shape) + 1j * draw.standard_normal(shape))
    angle = np.linspace(0.0, 2.0 * math.pi, max(16 * lot.highest_order, 360), endpoint=False)
    wave = np.exp(1j * order[:, np.newaxis] * angle)
    heights = np.stack([np.ptp((kind @ wave).real, axis=1) for kind in races])
    share = draw.uniform(lot.smallest_height, 1.0, heights.shape)
    ball_orders = np.array(lot.sphericity_orders, np.int64)
    phase = draw.uniform(0.0, 2.0 * math.pi, (bearings, ball_orders.size, balls))
    return Parts(
        order=order,
        races=races * (share / heights)[..., np.newaxis],
        diameter=lot.ball_diameter_spread * draw.standard_normal((bearings, balls)),
        sphericity_order=ball_orders,
        sphericity=lot.sphericity * np.exp(1j * phase),
    )


def bearing_errors(parts: Parts, bearing: int, limits: Array) -> RaceErrors:
    """Form errors of one bearing of the lot at the limits [m] of ``RACES``."""

    def form(order: Whole, amplitude: Waves) -> Waviness:
        return Waviness(order, np.abs(amplitude), -np.angle(amplitude) / order)

    forms = {name: form(parts.order, limits[k] * parts.races[k, bearing]) for k, name in enumerate(RACES)}
    balls = tuple(form(parts.sphericity_order, amplitude) for amplitude in parts.sphericity[bearing].T)
    return RaceErrors(parts.diameter[bearing], balls, **forms)


class Readings(NamedTuple):
    """Readings of indicators [m] through the turns, (bearings, steps): from races of limit one, and from the balls.

    ``radial``: along x; ``face``: on the inner ring's face at the azimuth of x.
    """

    radial: Array
    face: Array
    radial_balls: Array
    face_balls: Array


def readings(
    parts: Parts, response: LinearResponse, turning: Turning, steps: int, turns: int, face_radius: float
) -> Readings:
    """Follow the indicators: ``radial`` and ``face`` are (4, bearings, steps), one for each of ``RACES``."""
    z = parts.diameter.shape[1]
    turn = 2.0 * math.pi * np.arange(steps * turns) / steps
    cage, inner, outer = turning.cage * turn, turning.inner * turn, turning.outer * turn
    passing = np.isin(parts.order % z, (0, 1, z - 1))
    order, races = parts.order[passing], parts.races[..., passing]
    # An error of a ball at psi reads Re(e g exp(i psi)) radially and e (g_z - r Re(tilt exp(i psi))) on the face.
    radial, face = [], []
    for kind, name in enumerate(RACES):
        change, sign = (1 if "roundness" in name else 0), (-1.0 if name.startswith("outer") else 1.0)
        relative = cage - (outer if name.startswith("outer") else inner)
        shifting, lifting = _passing(order, relative, cage, z)
        radial.append((races[kind] @ (sign * response.radial[change] * shifting)).real)
        on_face = response.axial[change] * lifting - face_radius * response.tilt[change] * shifting
        face.append((races[kind] @ (sign * on_face)).real)
    coefficients, (shift, tilt), lift = _ball_waves(parts, response, turning.spin * turn, cage)
    of_balls = (coefficients @ shift).real, (coefficients @ (lift - face_radius * tilt)).real
    return Readings(np.array(radial), np.array(face), *of_balls)


def _passing(order: Whole, relative: Array, cage: Array, z: int) -> tuple[Waves, Waves]:
    """Waves (orders, steps) by which unit amplitudes c of Re(c exp(i n angle)) shift and lift the ring.

    Sum over the balls of Re(c exp(i n phi_j)) exp(i psi_j) with phi_j = psi_j - ring angle: nothing but for n = kZ -+ 1.
    """
    n = order[:, np.newaxis]
    with_balls, against = (n + 1) % z == 0, (n - 1) % z == 0
    # The real part of conj(c) w is that of c conj(w).
    turning_on, turning_back = np.exp(1j * (n * relative + cage)), np.exp(1j * (n * relative - cage))
    shifting = 0.5 * z * (with_balls * turning_on + against * turning_back)
    return shifting, z * (n % z == 0) * np.exp(1j * n * relative)


def _ball_waves(
    parts: Parts, response: LinearResponse, spun: Array, cage: Array
) -> tuple[Waves, tuple[Waves, Waves], Waves]:
    """Coefficients (bearings, waves) of the balls' errors, and those waves (waves, steps): shift, tilt, lift."""
    z = parts.diameter.shape[1]
    around = np.exp(2j * math.pi * np.arange(z) / z)
    # A larger ball takes half of its excess from both reaches.
    half = -0.5 * (parts.diameter @ around)
    coefficients = [half]
    gains = [(response.radial[2:].sum(), response.tilt[2:].sum(), 0.0)]
    waves = [np.exp(1j * cage)]
    for k, order in enumerate(parts.sphericity_order):
        amplitude = parts.sphericity[:, k]
        # The outer contact lies opposite: even orders add up, odd ones cancel.
        opposite = -np.array([1.0, (-1.0) ** order])
        shift, tilt, lift = (gain[2:] @ opposite for gain in (response.radial, response.tilt, response.axial))
        coefficients += [0.5 * (amplitude @ around), 0.5 * (amplitude @ around.conj()), amplitude.sum(axis=1)]
        waves += [np.exp(1j * (order * spun + cage)), np.exp(1j * (order * spun - cage)), np.exp(1j * order * spun)]
        gains += [(shift, tilt, 0.0), (shift, tilt, 0.0), (0.0, 0.0, lift)]
    shift, tilt, lift = np.array(gains).T[..., np.newaxis] * np.array(waves)
    return np.array(coefficients).T, (shift, tilt), lift


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
    lot: Lot,
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
    response = linear_response(bench.row, bench.control, bench.load, bench.given)
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
        **dict(zip(RACES, limits.tolist(), strict=True)),
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


def runouts(read: Readings, limits: Sequence[float] | Array) -> tuple[Array, Array]:
    """Radial and face runout [m] of each bearing of a lot at the limits [m] of ``RACES``."""
    radial = np.tensordot(limits, read.radial, 1) + read.radial_balls
    face = np.tensordot(limits, read.face, 1) + read.face_balls
    return np.ptp(radial, axis=1), np.ptp(face, axis=1)


def full_runouts(bench: Bench, parts: Parts, limits: Array, bearing: int) -> tuple[float, float]:
    """Radial and face runout [m] of one bearing of a lot by full equilibria, read as in ``readings``."""
    errors = bearing_errors(parts, bearing, limits)
    path = ball_path(errors, bench.turning, bench.steps, bench.turns)
    place = follow(bench.row, bench.control, bench.load, path, bench.turns, bench.given).path
    return float(np.ptp(place[:, 0])), float(np.ptp(place[:, 2] - bench.face_radius * place[:, 4]))


def full_lot(bench: Bench, parts: Parts, limits: Array, count: int) -> Array:
    """Full runouts [m] of the first ``count`` bearings of a lot, (count, 2)."""
    return np.array([full_runouts(bench, parts, limits, bearing) for bearing in range(count)])


def _lot(bench: Bench, lot: Lot, response: LinearResponse, bearings: int, seed: int) -> tuple[Parts, Readings]:
    parts = draw_parts(lot, len(bench.row.axial), bearings, seed)
    return parts, readings(parts, response, bench.turning, bench.steps, bench.turns, bench.face_radius)


def _widest(shares: Array, read: Readings, allowed: Array, wanted: float) -> Array:
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


def compare(bench: Bench, parts: Parts, read: Readings, limits: Array, allowed: Array, count: int) -> FullCheck:
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
