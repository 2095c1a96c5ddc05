"""Cylindrical roller bearings by standards and makers' rules: ratings, fatigue life, minimum load and friction.

Ratings and life: ISO 281:2007, ISO 76 and ISO/TS 16281:2008. The source is programs that implement ISO/TS 16281, not its text.
They agree on the capacities, the exponents 4, 4.5 and -8/9 and the edge stress (formulas 47-48, 56-57 and 60-65). A commercial
report has the same capacities and sum. f_c and b_m follow common citations of ISO 281, not its text. Lubrication, cleanliness
and the fatigue limit (a_ISO) are left out: this is the reference life L10r.

Friction: SKF's model (Rolling Bearings, catalogue of 2013; its formulas are in mm, N, rpm and mm^2/s, here all is in SI) and the
heat of ISO 15312. Comments mark constants from memory. SKF's model is not a measurement: at the reference speed it gives 0.94 to
2.2 times the heat of ISO 15312.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM, MethodError
from rbdyn.life import Life, Turning
from rbdyn.life.friction import FrictionMoments, Running, inlet_heating_factor, sliding_friction, starvation_factor
from rbdyn.properties.catalogue import Envelope

# Life of a race falls with the fourth power of its load; 9/8 is the slope of the Weibull line.
LOAD_LIFE = 4.0
WEIBULL = 9.0 / 8.0
LAMINA_EXPONENT = LOAD_LIFE * WEIBULL
# lambda nu: reduction in ISO 281 for edge stress and uneven loads, which laminae represent themselves.
REDUCTION = 0.83
# Reference speed times pitch diameter [mm/min] of 170 sizes of a catalogue (NU, series 10, 2, 22, 3, 23), within 9 %.
REFERENCE_SPEED_FACTOR = 5.5e5
REFERENCE_SPEED = REFERENCE_SPEED_FACTOR * 1e-3 * RPM  # [m/s]
# k_r of SKF's rule over its tables of cylindrical roller bearings.
SMALLEST_FACTOR, LARGEST_FACTOR = 0.1, 0.3


def capacity_factor(gamma: float) -> float:
    """f_c of a radial roller bearing (ISO 281, in N and mm) at gamma = roller over pitch diameter."""
    ratio = (1.0 - gamma) / (1.0 + gamma)
    races = (1.0 + (1.04 * ratio ** (143.0 / 108.0)) ** LAMINA_EXPONENT) ** (-1.0 / LAMINA_EXPONENT)
    shape = gamma ** (2.0 / 9.0) * (1.0 - gamma) ** (29.0 / 27.0) / (1.0 + gamma) ** 0.25
    return 208.0 * REDUCTION * shape * races


def dynamic_capacity(
    rollers: int,
    roller_diameter: float,
    effective_length: float,
    pitch_diameter: float,
    rows: int = 1,
    rating_factor: float = 1.1,
) -> float:
    """Basic dynamic radial load rating C_r [N] by ISO 281, for bearings without a catalogue value; lengths in m.

    C_r = b_m f_c (i L)^(7/9) Z^(3/4) D^(29/27) in N and mm; ``rating_factor`` b_m is 1.1 for machined cylindrical
    roller bearings of contemporary steel.
    """
    factor = rating_factor * capacity_factor(roller_diameter / pitch_diameter)
    sizes = (rows * effective_length * 1e3) ** (7.0 / 9.0) * (roller_diameter * 1e3) ** (29.0 / 27.0)
    return factor * sizes * rollers**0.75


def static_capacity(rollers: int, roller_diameter: float, effective_length: float, pitch_diameter: float) -> float:
    """Basic static radial load rating C_0r [N] of one row by ISO 76, 44 (1 - D/d_m) Z L D in N and mm; lengths in m."""
    gamma = roller_diameter / pitch_diameter
    return 44e6 * (1.0 - gamma) * rollers * effective_length * roller_diameter


def minimum_loads(
    pitch_diameter: float,
    speed: float,
    dynamic_capacity: float,
    static_capacity: float,
    listed: tuple[float, float] | None = None,
) -> dict[str, float]:
    """Least radial load [N] by rule: of a bearing of this pitch diameter [m], capacities [N], at this speed [rad/s].

    SKF: k_r (6 + 4 n/n_r) (d_m/100 mm)^2 kN, and 0.02 C. Timken: 0.04 C. NTN: 0.04 C0. They differ by a factor of four and were
    not always sufficient in tests of a NU 215 (Dawoud et al. 2023). ``listed``: k_r and the reference speed n_r [rad/s] of the
    catalogue; None for k_r from 0.1 to 0.3 and the usual n_r of the diameter.
    """
    usual = REFERENCE_SPEED / pitch_diameter
    factors = {SMALLEST_FACTOR: usual, LARGEST_FACTOR: usual} if listed is None else dict([listed])
    by_speed = {
        f"SKF, k_r = {factor:g}": 1e3 * factor * (6.0 + 4.0 * abs(speed) / reference) * (pitch_diameter / 0.1) ** 2
        for factor, reference in factors.items()
    }
    return {
        **by_speed,
        "SKF, 0.02 C": 0.02 * dynamic_capacity,
        "Timken, 0.04 C": 0.04 * dynamic_capacity,
        "NTN, 0.04 C0": 0.04 * static_capacity,
    }


class ReferenceLife(Life):
    """Reference rating life L10r; ``equivalent_load``: the radial load P_ref of equal life by ISO 281 [N]."""

    equivalent_load: float


def race_capacities(capacity: float, rollers: int, gamma: float, rows: int = 1) -> tuple[float, float]:
    """Roller load [N] that the inner and the outer race bear for 1e6 turns: Q_ci, Q_ce of ISO/TS 16281.

    0.378 and 0.364 are J_r/J_1 and J_r/J_2 of Lundberg and Palmgren with half of the rollers loaded.
    """
    inner_to_outer = 1.038 * ((1.0 - gamma) / (1.0 + gamma)) ** (143.0 / 108.0)
    roller_capacity = capacity / (REDUCTION * rollers * rows ** (7.0 / 9.0))
    inner = roller_capacity / 0.378 * (1.0 + inner_to_outer**LAMINA_EXPONENT) ** (1.0 / LAMINA_EXPONENT)
    outer = roller_capacity / 0.364 * (1.0 + inner_to_outer**-LAMINA_EXPONENT) ** (1.0 / LAMINA_EXPONENT)
    return inner, outer


def edge_stress(slices: int) -> Array:
    """Factors on the lamina loads for stress at the roller's edges, one a lamina (ISO/TS 16281, formula 60).

    f_k = 1 - 0.01/ln[1.985 |2k - n - 1|/(2n - 2)]: 2.3 at the ends, 1 in the middle and for a single lamina. Meant
    for the logarithmic reference profile, medium loads and tilts below 4 minutes of arc.
    """
    if slices == 1:
        return np.ones(1)
    k = np.arange(1, slices + 1)
    off_middle = np.abs(2 * k - slices - 1) / (2.0 * slices - 2.0)
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 - 0.01 / np.log(1.985 * off_middle))


def turning_race_load(loads: Array) -> Array:
    """Equivalent lamina loads [N] of a race that rotates relative to the load, from (samples, rollers, slices).

    Every point of it meets every load in turn: one fourth-power mean over samples and rollers.
    """
    return np.asarray(np.mean(loads**LOAD_LIFE, axis=(0, 1)) ** (1.0 / LOAD_LIFE))


def standing_race_load(loads: Array, angle: Array | None = None, positions: int = 72) -> Array:
    """Equivalent lamina loads [N] of a race at rest relative to the load, from (samples, rollers, slices).

    Each place on it has its own loads: a fourth-power mean over time at each place, then a mean of the power 4.5 over the places.
    ``angle``: place of each roller on that race [rad], (samples, rollers), sorted into ``positions`` equal sectors; None for
    rollers at fixed places. Raises MethodError for a sector without any roller.
    """
    powers = loads**LOAD_LIFE
    if angle is None:
        damage = np.mean(powers, axis=0)
    else:
        turn = np.mod(angle, 2.0 * math.pi) / (2.0 * math.pi)
        sector = np.minimum((turn * positions).astype(np.int64), positions - 1)
        visits = np.bincount(sector.ravel(), minlength=positions)
        if not np.all(visits):
            raise MethodError(f"no roller passed some of the {positions} sectors; give more samples or fewer sectors")
        damage = np.zeros((positions, loads.shape[2]))
        np.add.at(damage, sector, powers)
        damage /= visits[:, None]
    return np.asarray(np.mean(damage**WEIBULL, axis=0) ** (1.0 / LAMINA_EXPONENT))


def reference_life(
    inner: Array,
    outer: Array,
    *,
    capacity: float,
    gamma: float,
    turning: Turning = "inner",
    angle: Array | None = None,
    positions: int = 72,
    edges: bool = True,
) -> ReferenceLife:
    """Reference rating life of one row of rollers from the loads on their laminae.

    ``inner, outer``: loads [N] on the inner and the outer race, (samples, rollers, slices) or (samples, rollers), samples evenly
    spaced in time. ``capacity``: C_r [N], of a catalogue or ``dynamic_capacity``. ``gamma``: roller over pitch diameter.
    ``turning``: the rings that rotate relative to the load. ``angle``: place of each roller on the ring at rest relative to the
    load [rad], (samples, rollers); None for rollers at fixed places. ``edges``: whether ``edge_stress`` raises the lamina loads.
    """
    inner, outer = (loads if loads.ndim == 3 else loads[:, :, None] for loads in (inner, outer))
    _, rollers, slices = inner.shape
    factor = edge_stress(slices) if edges else np.ones(slices)

    def equivalent(loads: Array, turns: bool) -> float:
        lamina = turning_race_load(loads) if turns else standing_race_load(loads, angle, positions)
        load = float(np.sum((factor * lamina) ** LAMINA_EXPONENT) ** (1.0 / LAMINA_EXPONENT))
        # A lamina has the share n^(-7/9) of the capacity of its roller; the result refers to the whole roller.
        return load * slices ** (7.0 / 9.0)

    inner_load = equivalent(inner, turning != "outer")
    outer_load = equivalent(outer, turning != "inner")
    inner_capacity, outer_capacity = race_capacities(capacity, rollers, gamma)
    damage = (inner_load / inner_capacity) ** LAMINA_EXPONENT + (outer_load / outer_capacity) ** LAMINA_EXPONENT
    life = damage ** (-1.0 / WEIBULL) if damage > 0.0 else math.inf
    return ReferenceLife(life, inner_load, outer_load, inner_capacity, outer_capacity, capacity * life**-0.3)


LINE_EXPONENT = 10.0 / 9.0
# Newton's steps, with bisection where one leaves its bracket, and the relative error of the sum of forces at which they end.
BALANCE_STEPS, BALANCE_ERROR = 200, 1e-13


class RollerContacts(NamedTuple):
    """Contacts of a row of rollers for its static loads: K of Q = K delta^(10/9) of one race [N/m^(10/9)], roller to race.

    ``relief``: approach that a lamina lacks at a race because of profile and tilt [m], of the inner and the outer race, each
    (rollers, slices) or (1, slices).
    """

    stiffness: float
    relief: tuple[Array, Array]


def static_loads(
    contacts: RollerContacts, rollers: int, load: float, clearance: float, centrifugal: float = 0.0
) -> tuple[Array, Array]:
    """Loads [N] of the laminae on the inner and the outer race, each (1, rollers, slices), under a radial ``load`` [N].

    ISO/TS 16281: the ring is displaced by d along the load, so the races approach at azimuth phi by d cos(phi) - s/2, with the
    diametral operating ``clearance`` s [m]. One roller is under the load. Both contacts of a roller share the approach. The
    outer race bears also its ``centrifugal`` force [N], which the standard leaves out.
    """
    angle = 2.0 * math.pi * np.arange(rollers) / rollers
    most = max(float(np.max(relief)) for relief in contacts.relief)
    solid = sum((force / contacts.stiffness) ** (1.0 / LINE_EXPONENT) for force in (load, centrifugal))
    reach = 0.5 * max(clearance, 0.0) + 2.0 * (solid + most)

    def balance(displacement: float) -> float:
        inner, _ = _race_loads(contacts, displacement * np.cos(angle) - 0.5 * clearance, centrifugal)
        return float(inner.sum(axis=1) @ np.cos(angle)) - load

    displacement = _rising_root(balance, -reach, reach, BALANCE_ERROR * load) if load > 0.0 else 0.0
    inner, outer = _race_loads(contacts, displacement * np.cos(angle) - 0.5 * clearance, centrifugal)
    return inner[None], outer[None]


def _rising_root(function: Callable[[float], float], low: float, high: float, error: float) -> float:
    """Where a rising function is zero within ``error``: false position with the Illinois rule; low and high are on its two sides."""
    at_low, at_high, last = function(low), function(high), 0.0
    for _ in range(BALANCE_STEPS):
        place = high - at_high * (high - low) / (at_high - at_low)
        value = function(place)
        if abs(value) <= error or not low < place < high:
            break
        # The end that stays twice counts half, or it would stay to the last.
        half = 0.5 if value * last > 0.0 else 1.0
        if value < 0.0:
            low, at_low, at_high = place, value, half * at_high
        else:
            high, at_high, at_low = place, value, half * at_low
        last = value
    return place


def _race_loads(contacts: RollerContacts, approach: Array, centrifugal: float) -> tuple[Array, Array]:
    """Loads of the laminae (rollers, slices) on both races where these approach by ``approach`` (rollers,) [m].

    The approach at the outer race is the root of Q_o - Q_i - F_c, which rises with it.
    """
    inner_relief, outer_relief = contacts.relief
    lamina = contacts.stiffness / inner_relief.shape[1]

    def loads(approach: Array, relief: Array) -> Array:
        return np.asarray(lamina * np.clip(approach[:, None] - relief, 0.0, None) ** LINE_EXPONENT)

    low = np.full(approach.shape, float(np.min(outer_relief)))
    thrown = (centrifugal / contacts.stiffness) ** (1.0 / LINE_EXPONENT)
    high = np.maximum(approach - np.min(inner_relief), np.max(outer_relief) + thrown)
    high = np.maximum(high, low)
    # A roller without load rests at the high end, and of the others nearly linear forces lead from there.
    outside = high
    for _ in range(BALANCE_STEPS):
        inner, outer = loads(approach - outside, inner_relief), loads(outside, outer_relief)
        excess = outer.sum(axis=1) - inner.sum(axis=1) - centrifugal
        balanced = np.abs(excess) <= BALANCE_ERROR * (outer.sum(axis=1) + centrifugal)
        if balanced.all():
            break
        # dQ/d delta = K^0.9 (10/9) Q^0.1
        slope = LINE_EXPONENT * lamina**0.9 * (outer**0.1 + inner**0.1).sum(axis=1)
        low, high = np.where(excess < 0.0, outside, low), np.where(excess < 0.0, high, outside)
        newton = outside - np.divide(excess, slope, out=np.full(excess.shape, np.inf), where=slope > 0.0)
        inside = np.where((newton > low) & (newton < high), newton, 0.5 * (low + high))
        # A step from a root is none, which would count as one out of the bracket.
        outside = np.where(balanced, outside, inside)
    return inner, outer


class SeriesFactors(NamedTuple):
    """Factors of one dimension series: R1 and S1 of SKF's friction model, and k_r of its minimum load."""

    rolling: float
    sliding: float
    minimum_load: float


# k_r of series 10 is from memory; the others were read.
SERIES = {
    "10": SeriesFactors(1.12e-6, 0.17, 0.10),
    "2": SeriesFactors(1.09e-6, 0.16, 0.15),
    "22": SeriesFactors(1.40e-6, 0.16, 0.20),
    "3": SeriesFactors(1.09e-6, 0.16, 0.15),
    "23": SeriesFactors(1.48e-6, 0.16, 0.25),
}
RADIAL_SLIDING = 0.0015  # S2
ROLLER_GEOMETRY = 5.1  # K_Z of cylindrical roller bearings with a cage
FILM_FRICTION = 0.02
# ISO 15312: heat flow density at 50 K above the surroundings, up to a seat of 50 000 mm^2; above it falls with the power
# -0.34 of the seat (from memory) [W/mm^2], [mm^2].
HEAT_FLOW, LARGE_SEAT, LARGE_SEAT_EXPONENT = 0.016, 5e4, -0.34
SEAT_RISE = 50.0  # [K]


def skf_moments(series: str, running: Running, radial_load: float, axial_load: float = 0.0) -> FrictionMoments:
    """Frictional moments of a bearing with a cage by SKF's model.

    M_rr = phi_ish phi_rs R1 d_m^2.41 F_r^0.31 (nu n)^0.6 and M_sl = (S1 d_m^0.9 F_a + S2 d_m F_r) mu_sl, d_m = (d + D)/2.
    Loads [N]. Raises KeyError for a series that is not in ``SERIES``.
    """
    bore, outside, speed, viscosity, _ = running
    factors, mean = SERIES[series], 0.5 * (bore + outside)
    diameter, flow = mean * 1e3, abs(speed) / RPM * viscosity * 1e6
    reduction = inlet_heating_factor(mean, speed, viscosity) * starvation_factor(ROLLER_GEOMETRY, running)
    rolling = reduction * factors.rolling * diameter**2.41 * radial_load**0.31 * flow**0.6
    sliding = factors.sliding * diameter**0.9 * axial_load + RADIAL_SLIDING * diameter * radial_load
    slides = sliding_friction(FILM_FRICTION, mean, speed, viscosity)
    return FrictionMoments(1e-3 * rolling, 1e-3 * sliding * slides)


def iso_15312_heat(sizes: Envelope) -> float:
    """Heat flow from a bearing through its seats pi B (D + d) at 70 C in surroundings of 20 C [W].

    The conditions of the reference speed: 0.05 C0, 12 mm^2/s at 70 C, a bath to the middle of the lowest roller.
    """
    return _heat_of_seat(math.pi * sizes.width * (sizes.bore + sizes.outside))


def seat_heat(seat: float) -> float:
    """Heat flow of ISO 15312 through a seat [m^2] that is ``SEAT_RISE`` warmer than the surroundings [W]."""
    return _heat_of_seat(1e6 * seat)


def _heat_of_seat(seat: float) -> float:
    """Heat flow [W] through a seat [mm^2]."""
    return HEAT_FLOW * seat * max(seat / LARGE_SEAT, 1.0) ** LARGE_SEAT_EXPONENT


class Stiffness(NamedTuple):
    """Stiffness of a row of rollers under a static radial load, x along the load and y across it.

    ``matrix``: dF/dx (2, 2) [N/m], mean over a pitch of the rollers; ``travel``: how far the shaft's centre moves over a pitch along
    and across the load, peak to peak [m].
    """

    matrix: Array
    travel: tuple[float, float]

    @property
    def along(self) -> float:
        """K_xx [N/m]."""
        return float(self.matrix[0, 0])

    @property
    def across(self) -> float:
        """K_yy [N/m]."""
        return float(self.matrix[1, 1])


def turned(matrix: Array, angle: float) -> Array:
    """A matrix (2, 2) in axes that see the first axis of its own at ``angle`` [rad]."""
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])
    return np.asarray(turn @ matrix @ turn.T)


# Relative errors of the forces on a roller and on the ring; the most steps to a contact and halvings of a step of the ring; the
# spring that holds a ring in a step, as a share of the stiffness at first.
CONTACT_ERROR, PLACE_ERROR, CONTACT_STEPS, HALVINGS, LEAST_SPRING = 1e-11, 1e-9, 60, 60, 1e-9
# Place of the rollers, as a share of their pitch, next to the one where one roller alone is under the load: on both sides of it
# the shaft is farthest from the line of the load.
FARTHEST_PLACE = 1e-3


def static_stiffness(
    contacts_at: Callable[[Array], RollerContacts],
    rollers: int,
    load: float,
    clearance: float,
    centrifugal: float = 0.0,
    places: int = 64,
    *,
    symmetric: bool = False,
) -> Stiffness:
    """dF/dx of the static loads of ISO/TS 16281, mean over ``places`` of the rollers within a pitch.

    ``contacts_at``: contacts of rollers at these azimuths (n,) from the load [rad]; others as of ``static_loads``. ``symmetric``: rings
    without tilt, so that places in one half of the pitch mirror those in the other, and forces across do not couple with those
    along the load. Raises MethodError where no roller carries load, and where no balance is found.
    """
    share, coupled = (0.5, np.eye(2)) if symmetric else (1.0, np.ones((2, 2)))
    place = np.concatenate((share * (np.arange(places) + 0.5) / places, (FARTHEST_PLACE, 1.0 - FARTHEST_PLACE)))
    angle = 2.0 * math.pi * (np.arange(rollers) + place[:, None]) / rollers
    contacts, normals = contacts_at(angle.ravel()), np.stack((np.cos(angle), np.sin(angle)), axis=1)
    centres, matrices = _balanced(contacts, normals, load, clearance, centrifugal)
    mirrored = np.concatenate((centres, centres * (1.0, -1.0))) if symmetric else centres
    moved = np.ptp(mirrored, axis=0)
    return Stiffness(coupled * np.mean(matrices[:places], axis=0), (float(moved[0]), float(moved[1])))


def _balanced(
    contacts: RollerContacts, normals: Array, load: float, clearance: float, centrifugal: float
) -> tuple[Array, Array]:
    """Centres of the inner ring (places, 2) [m] that bear the load along x, and dF/dx there (places, 2, 2) [N/m].

    Newton's method with shortened steps; ``normals`` (places, 2, rollers).
    """

    def response(centres: Array) -> tuple[Array, Array, Array]:
        approach = np.einsum("pi,pij->pj", centres, normals) - 0.5 * clearance
        loads, slopes = (each.reshape(approach.shape) for each in _pressed(contacts, approach.ravel(), centrifugal))
        missing = np.array([load, 0.0]) - np.einsum("pij,pj->pi", normals, loads)
        return missing, np.einsum("pij,pj,pkj->pik", normals, slopes, normals), loads.sum(axis=1)

    most = max(float(np.max(relief)) for relief in contacts.relief)
    reach = max(clearance, 0.0) / math.cos(math.pi / normals.shape[2])
    solid = sum((force / contacts.stiffness) ** (1.0 / LINE_EXPONENT) for force in (load, centrifugal))
    start = 0.5 * reach + 2.0 * (most + solid)
    centres = np.tile((start, 0.0), (len(normals), 1))
    missing, matrix, carried = response(centres)
    # Nothing holds a ring sideways that a single roller bears: a slight spring does in each step.
    spring = LEAST_SPRING * np.trace(matrix, axis1=1, axis2=2).max() * np.eye(2)
    for _ in range(BALANCE_STEPS):
        # Under a preload the loads of the rollers cancel, and their own errors remain.
        unbalanced = np.linalg.norm(missing, axis=1) > PLACE_ERROR * np.maximum(load, carried)
        if not unbalanced.any():
            if not np.all(carried > 0.0):
                raise MethodError("no roller carries load, so no stiffness is defined; give a load or an interference")
            return centres, matrix
        step = np.linalg.solve(matrix + spring, missing[:, :, None])[:, :, 0] * unbalanced[:, None]
        ahead = np.einsum("pi,pi->p", missing, step)
        for _ in range(HALVINGS):
            tried = response(centres + step)
            # The energy is convex: a step is too long where its force turns back.
            beyond = unbalanced & (np.einsum("pi,pi->p", tried[0], step) < -0.5 * ahead)
            if not beyond.any():
                break
            step[beyond] *= 0.5
            ahead[beyond] *= 0.5
        centres, (missing, matrix, carried) = centres + step, tried
    raise MethodError(f"no static balance was found for a load of {load:g} N; give a load or an interference")


def _pressed(contacts: RollerContacts, approach: Array, centrifugal: float) -> tuple[Array, Array]:
    """Loads on the inner race [N] and their slopes by the ``approach`` of the races [N/m], each (n,); both 0 of a roller off it."""
    inner_relief, outer_relief = (
        np.broadcast_to(relief, (len(approach), relief.shape[1])) for relief in contacts.relief
    )
    lamina = contacts.stiffness / inner_relief.shape[1]
    loads, slopes = np.zeros((2, len(approach)))

    def race(gap: Array, relief: Array) -> tuple[Array, Array]:
        """Load and slope of a contact."""
        depth = np.clip(gap[:, None] - relief, 0.0, None)
        root = lamina * depth ** (LINE_EXPONENT - 1.0)
        return (root * depth).sum(axis=1), LINE_EXPONENT * root.sum(axis=1)

    # Where the inner race only just touches, the outer one bears the centrifugal force or more.
    end = approach - inner_relief.min(axis=1)
    pressed = np.flatnonzero(race(end, outer_relief)[0] > centrifugal)
    approach, inner_relief, outer_relief = approach[pressed], inner_relief[pressed], outer_relief[pressed]
    low, high = outer_relief.min(axis=1), end[pressed]
    outside = 0.5 * (low + high)
    for _ in range(CONTACT_STEPS):
        outer, outer_slope = race(outside, outer_relief)
        inner, inner_slope = race(approach - outside, inner_relief)
        excess = outer - inner - centrifugal
        if np.all(np.abs(excess) <= CONTACT_ERROR * (outer + centrifugal)):
            break
        low, high = np.where(excess < 0.0, outside, low), np.where(excess < 0.0, high, outside)
        newton = outside - excess / (outer_slope + inner_slope)
        outside = np.where((newton > low) & (newton < high), newton, 0.5 * (low + high))
    loads[pressed], slopes[pressed] = inner, inner_slope * outer_slope / (inner_slope + outer_slope)
    return loads, slopes
