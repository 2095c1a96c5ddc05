"""Runout of many bearings at once: races and balls drawn at random, answered in proportion.

Each bearing of a lot has races of a given height (roundness and side-sway, peak to valley) in random orders and phases
and balls with random diameters and sphericity. Only the orders that pass the balls (``linear_runout``) reach the ring,
each as one wave: a bearing's reading is the real part of a short sum, and a lot is a product of two matrices.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.arrays import Array
from rbdyn.quasistatic.runout.linear import LinearResponse
from rbdyn.quasistatic.runout.race_errors import RaceErrors, Turning, Waviness

Waves = NDArray[np.complex128]
# Kinds of race errors in the order of all arrays here.
RACES = ("inner_roundness", "outer_roundness", "inner_sway", "outer_sway")


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

    order: NDArray[np.int64]
    races: Waves
    diameter: Array
    sphericity_order: NDArray[np.int64]
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

    def form(order: NDArray[np.int64], amplitude: Waves) -> Waviness:
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
    return Readings(
        np.array(radial), np.array(face), (coefficients @ shift).real, (coefficients @ (lift - face_radius * tilt)).real
    )


def _passing(order: NDArray[np.int64], relative: Array, cage: Array, z: int) -> tuple[Waves, Waves]:
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
