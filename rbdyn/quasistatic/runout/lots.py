"""Runout of many bearings at once: races and balls drawn at random, answered in proportion.

Each bearing of a lot has races of a given height (roundness and side-sway, peak to valley) in random orders and phases
and balls with random diameters and sphericity. Only the orders that pass the balls (``linear_response``) reach the ring,
each as one wave: a bearing's reading is the real part of a short sum, and a lot is a product of two matrices.

Under a purely axial load all balls are alike, so one ball tells all: an error e of the ball at the azimuth psi moves
the ring by e g_x along psi, by e g_z axially, and tilts it by e g_tilt about the axis 90 degrees ahead of psi. Around
Z equal balls all orders of a groove cancel but n = kZ +- 1, which shift and tilt, and n = kZ, which moves axially.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.arrays import Array, Whole
from rbdyn.faults import MethodError, RunError
from rbdyn.quasistatic.row.control import Control
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.row import Row
from rbdyn.quasistatic.runout.race_errors import RaceErrors, Turning, Waviness

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
