"""Runout of many bearings at once, with random races and balls and a linear response, and race limits for a runout class.

Each bearing of a lot has races of stated height (roundness and side-sway, peak to valley) in random orders and phases. Its
balls have random diameters and sphericity. The balls transmit only some orders to the ring (``linear_response``), each as one
wave. The reading of a bearing is therefore the real part of a short sum, and that of a lot a product of two matrices.

Under a purely axial load all balls are equal, so one ball represents all. An error e of the ball at the azimuth psi moves
the ring by e g_x along psi and by e g_z axially. It tilts the ring by e g_tilt about the axis 90 degrees ahead of psi. Of the
orders n of a groove, the Z equal balls cancel all but two kinds: n = kZ +- 1 shift and tilt the ring, n = kZ move it axially.

For race limits, Zhou et al. 2024 invert a homogenisation coefficient. Here ``design`` draws a lot of bearings and counts its
yield. The runout is linear in the limits and therefore known for all limits at once. Full equilibria of some bearings correct
the size of the limits, and a fresh lot confirms the design, linearly and in full.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.blocks import Sheet, columns_of
from rbdyn.base.faults import InputError, MethodError, RunError
from rbdyn.base.records import Record, keyed, outside_json, shown
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.model import constraint_of, load_of, row_of
from rbdyn.quasistatic.row.ring import Row
from rbdyn.quasistatic.runout import turn
from rbdyn.quasistatic.runout.turn import PERFECT, RaceErrors, RingPath, Turning, Waviness, ball_path, follow, waviness
from rbdyn.scene.ball import BallScene, SingleRowScene
from rbdyn.scene.bearing import Harmonic
from rbdyn.scene.form_errors import GROOVES, FormErrors, RandomWaviness

# Error of one ball in the differences [m]: far below any deflection, far above the solver's rounding.
SMALL_ERROR = 1e-8
CHANGES = ("axial", "radial", "inner_reach", "outer_reach")
Waves = NDArray[np.complex128]
# Kinds of race errors in the order of all arrays here.
RACES = ("inner_roundness", "outer_roundness", "inner_sway", "outer_sway")


class LinearResponse(NamedTuple):
    """Displacement of the ring by a unit change [m] at one ball, (4,) for axial, radial, inner_reach and outer_reach.

    ``radial`` towards the ball [-], ``axial`` [-], ``tilt`` about the axis 90 degrees ahead of the ball [rad/m].
    """

    radial: Array
    axial: Array
    tilt: Array


def linear_response(row: Row, control: Control, load: Array, constraint: Array | None = None) -> LinearResponse:
    """Response of a row of equal, evenly spaced balls under an axial load, by central differences.

    Arguments are those of ``equilibrium.solve``. Raises MethodError for another load, and RunError with
    the cause where there is no equilibrium.
    """
    if np.any(np.delete(load, 2)):
        raise MethodError(
            "load: the linear response of runout needs a purely axial load; set the other components to 0"
        )
    middle = _equilibrium(solve(row, control, load, constraint))
    slopes = []
    for name in CHANGES:
        ends = []
        for change in (-SMALL_ERROR, SMALL_ERROR):
            changed = getattr(row, name).copy()
            changed[0] += change
            ends.append(_equilibrium(solve(row._replace(**{name: changed}), control, load, constraint, middle)))
        slopes.append((ends[1].displacement - ends[0].displacement) / (2.0 * SMALL_ERROR))
    x, y, z, theta_x, theta_y = np.array(slopes).T
    cosine, sine = row.cosine[0], row.sine[0]
    return LinearResponse(x * cosine + y * sine, z, theta_y * cosine - theta_x * sine)


def _equilibrium(solution: Solution) -> Solution:
    if not solution.is_equilibrium:
        raise RunError(f"runout of the nominal bearing: {solution.status}")
    return solution


class Lot(Record):
    """Distribution of the parts of a lot. Lengths in m.

    ``lowest_order, highest_order, decay``: of each race error; amplitudes are Rayleigh distributed, with a mean that falls as
    order^-decay. ``smallest_height``: heights are uniform between this share of the limit and the limit; with 1 every race
    is at its limit. ``ball_diameter_spread``: standard deviation within a bearing. ``sphericity_orders, sphericity``: orders
    on each ball and their amplitude, with random phases.
    """

    lowest_order: int = 1
    highest_order: int = 40
    decay: float = 1.0
    smallest_height: float = 1.0
    ball_diameter_spread: float = 0.0
    sphericity_orders: tuple[int, ...] = (2, 3, 4)
    sphericity: float = 0.0


class Parts(NamedTuple):
    """Parts of the bearings of a lot.

    ``races`` (4, bearings, orders): complex amplitudes for a limit of one. ``diameter`` (bearings, Z): errors of the balls [m].
    ``sphericity`` (bearings, orders, Z): complex amplitudes [m].
    """

    order: Whole
    races: Waves
    diameter: Array
    sphericity_order: Whole
    sphericity: Waves


def draw_parts(lot: Lot, balls: int, bearings: int, seed: int) -> Parts:
    """Random parts of a number of bearings; the wave of an amplitude c is Re(c exp(i order angle))."""
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
    """Indicator readings [m] during the turns, (bearings, steps), by races of limit one and by the balls.

    ``radial``: along x; ``face``: on the inner ring's face at the azimuth of x.
    """

    radial: Array
    face: Array
    radial_balls: Array
    face_balls: Array


def readings(
    parts: Parts, response: LinearResponse, turning: Turning, steps: int, turns: int, face_radius: float
) -> Readings:
    """Readings of a lot; ``radial`` and ``face`` are (4, bearings, steps), in the order of ``RACES``."""
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

    The sum over the balls of Re(c exp(i n phi_j)) exp(i psi_j), phi_j = psi_j - ring angle, is zero except for n = kZ -+ 1.
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
    """Coefficients (bearings, waves) of the balls' errors, and their waves (waves, steps): shift, tilt and lift."""
    z = parts.diameter.shape[1]
    around = np.exp(2j * math.pi * np.arange(z) / z)
    # A larger ball reduces both reaches by half of its excess.
    coefficients = [-0.5 * (parts.diameter @ around)]
    gains = [(response.radial[2:].sum(), response.tilt[2:].sum(), 0.0)]
    waves = [np.exp(1j * cage)]
    for k, order in enumerate(parts.sphericity_order):
        amplitude = parts.sphericity[:, k]
        # The outer contact is opposite: even orders add up, odd ones cancel.
        opposite = -np.array([1.0, (-1.0) ** order])
        shift, tilt, lift = (gain[2:] @ opposite for gain in (response.radial, response.tilt, response.axial))
        coefficients += [0.5 * (amplitude @ around), 0.5 * (amplitude @ around.conj()), amplitude.sum(axis=1)]
        waves += [np.exp(1j * (order * spun + cage)), np.exp(1j * (order * spun - cage)), np.exp(1j * order * spun)]
        gains += [(shift, tilt, 0.0), (shift, tilt, 0.0), (0.0, 0.0, lift)]
    shift, tilt, lift = np.array(gains).T[..., np.newaxis] * np.array(waves)
    return np.array(coefficients).T, (shift, tilt), lift


# Bisections of a size, to one part in ten thousand.
HALVINGS = 14
REFINEMENTS = 3
SWAY_SHARES = tuple(2.0 ** (0.5 * k) for k in range(-6, 7))


class FullCheck(Record):
    """Check of the linear response by full equilibria of the first bearings of a lot.

    ``radial_rms, face_rms``: differences of linear and full runouts over their limits. ``agreeing``: number of the
    ``bearings`` with the same verdict on the class. ``gap``: share that meets the class in full less the linear share, with
    its standard error, which assumes at least one different verdict.
    """

    bearings: int
    radial_rms: float
    face_rms: float
    agreeing: int
    gap: float
    gap_error: float


class RaceHeights(Record):
    """Heights of the errors of a race."""

    race: str = shown("race", meaning="inner or outer")
    roundness_um: float = shown(
        "roundness up to [µm]", ".3g", meaning="largest roundness and side-sway that meet the class"
    )
    sway_um: float = shown("side-sway up to [µm]", ".3g")


def race_sheet(*races: RaceHeights) -> Sheet[RaceHeights]:
    """A row a race."""
    content = "One row per raceway, of `rbdyn ball --race-limits`."
    return Sheet("", columns_of(RaceHeights), races, file="race_limits.csv", content=content)


class RaceLimits(Record, kw_only=True):
    """Limits on the heights of race errors, and their yield.

    ``tolerance_class``: of ``radial_limit_um`` and ``axial_limit_um``, its limits K_ia and S_ia. ``yielded``: share of a fresh lot
    that meets both, with its standard error. It is counted on many linear responses and corrected by full equilibria of some bearings
    (``check``); ``proportional`` is the share without that correction. Homogenisation: 95 % quantile of the radial
    runout over the sum of both roundness limits, and of the face runout over the sum of both side-sway limits.
    """

    tolerance_class: str | None = keyed("class", default=None)
    target_yield: float = keyed("wanted")
    inner_roundness_um: float
    outer_roundness_um: float
    inner_sway_um: float
    outer_sway_um: float
    radial_limit_um: float
    axial_limit_um: float
    yielded: float = keyed("yield")
    standard_error: float
    proportional: float = keyed("yield_in_proportion")
    radial_homogenisation: float = keyed("homogenisation", "radial")
    axial_homogenisation: float = keyed("homogenisation", "axial")
    bearings: int
    solved: int = keyed("solved_in_full")
    seed: int
    check: FullCheck | None = outside_json()


class Bench(Record):
    """Measurement of runout: a nominal row under an axial load, as in ``equilibrium.solve``.

    ``face_radius``: radius at which the axial indicator touches the inner ring [m]. ``steps`` a turn, ``turns`` of the ring.
    """

    row: Row
    control: Control
    load: Array
    turning: Turning
    face_radius: float
    steps: int = 120
    turns: int = 2
    constraint: Array | None = None


def design(
    bench: Bench,
    lot: Lot,
    *,
    radial_limit: float,
    axial_limit: float,
    target_yield: float = 0.95,
    outer_share: float = 1.0,
    sway_shares: Sequence[float] = SWAY_SHARES,
    bearings: int = 4000,
    seed: int = 1,
    solved: int = 0,
) -> RaceLimits:
    """Largest race errors with which the share ``target_yield`` of a lot keeps both runouts [m].

    ``outer_share``: limit of an outer race over that of the inner race. ``sway_shares``: trial ratios of side-sway limits
    to roundness limits; the one with the largest product of all limits is selected, so that no limit is needlessly tight.
    ``solved``: number of bearings with full equilibria, in each correction of the size and in the fresh lot; with 0 all
    is linear. Raises MethodError where the balls alone fail the class or no race error reaches the ring, and as
    ``linear_response`` and ``turn.follow``.
    """
    if not 0.0 < target_yield < 1.0:
        raise MethodError(f"yield = {target_yield:g}: must be between 0 and 1; give a share such as 0.95")
    response = linear_response(bench.row, bench.control, bench.load, bench.constraint)
    parts, read = _lot(bench, lot, response, bearings, seed)
    allowed = np.array([radial_limit, axial_limit])
    shares = (np.array([1.0, outer_share, share, share * outer_share]) for share in sway_shares)
    trials = (_largest_limits(ratios, read, allowed, target_yield) for ratios in shares)
    limits = max(trials, key=lambda trial: float(trial.prod()))
    for _ in range(REFINEMENTS if solved else 0):
        # Runout is nearly proportional to the size of the races, so scaling brings its quantile to the limit. The linear
        # response gives the quantile of the lot, and a few bearings the ratio of full to linear runouts.
        reached = (np.column_stack(runouts(read, limits)) / allowed).max(axis=1)
        full = (full_lot(bench, parts, limits, solved) / allowed).max(axis=1)
        larger = np.quantile(full, target_yield) / np.quantile(reached[:solved], target_yield)
        limits = limits / float(larger * np.quantile(reached, target_yield))
    # A design is optimistic on its own lot, so a fresh lot counts.
    parts, read = _lot(bench, lot, response, bearings, seed + 1)
    radial, face = runouts(read, limits)
    good = (radial <= radial_limit) & (face <= axial_limit)
    check = compare(bench, parts, read, limits, allowed, solved) if solved else None
    proportional = float(good.mean())
    gap, gap_error = (0.0, 0.0) if check is None else (check.gap, check.gap_error)
    return RaceLimits(
        target_yield=target_yield,
        **{f"{race}_um": 1e6 * limit for race, limit in zip(RACES, limits.tolist(), strict=True)},
        radial_limit_um=1e6 * radial_limit,
        axial_limit_um=1e6 * axial_limit,
        yielded=min(proportional + gap, 1.0),
        standard_error=math.hypot(math.sqrt(proportional * (1.0 - proportional) / bearings), gap_error),
        proportional=proportional,
        radial_homogenisation=float(np.quantile(radial, 0.95) / limits[:2].sum()),
        axial_homogenisation=float(np.quantile(face, 0.95) / limits[2:].sum()),
        bearings=bearings,
        solved=solved,
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
    path = ball_path(bearing_errors(parts, bearing, limits), bench.turning, bench.steps, bench.turns)
    place = follow(bench.row, bench.control, bench.load, path, bench.turns, bench.constraint).path
    return float(np.ptp(place[:, 0])), float(np.ptp(place[:, 2] - bench.face_radius * place[:, 4]))


def full_lot(bench: Bench, parts: Parts, limits: Array, count: int) -> Array:
    """Full runouts [m] of the first ``count`` bearings of a lot, (count, 2)."""
    return np.array([full_runouts(bench, parts, limits, bearing) for bearing in range(count)])


def _lot(bench: Bench, lot: Lot, response: LinearResponse, bearings: int, seed: int) -> tuple[Parts, Readings]:
    parts = draw_parts(lot, len(bench.row.axial), bearings, seed)
    return parts, readings(parts, response, bench.turning, bench.steps, bench.turns, bench.face_radius)


def _largest_limits(shares: Array, read: Readings, allowed: Array, target_yield: float) -> Array:
    """Largest limits in the ratio ``shares`` with which the share ``target_yield`` keeps the ``allowed`` runouts."""
    radial_races, face_races = np.tensordot(shares, read.radial, 1), np.tensordot(shares, read.face, 1)

    def passes(size: float) -> bool:
        radial = np.ptp(size * radial_races + read.radial_balls, axis=1)
        face = np.ptp(size * face_races + read.face_balls, axis=1)
        return float(((radial <= allowed[0]) & (face <= allowed[1])).mean()) >= target_yield

    if not passes(0.0):
        raise MethodError("the balls alone fail the class; use better balls or a wider class")
    low, high = 0.0, float(allowed[0])
    while passes(high):
        if high > 1e6 * allowed[0]:
            raise MethodError("no order of these raceway errors reaches the ring; give the lot more orders")
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


# Largest number of steps times balls of a path; each needs 1.4 kB.
MOST_PLACES = 1_000_000


def follow_ring(scene: BallScene) -> RingPath:
    """Path of the inner ring of a scene over its form errors, with the turns and steps that they state.

    Raises InputError for a scene without form errors or of two rows, and RunError where an equilibrium is missing.
    """
    row = single_row(scene)
    if row.errors is None:
        raise InputError("errors: missing; a bearing without form errors has no runout, add the table")
    steps, turns, balls = row.errors.steps, row.errors.turns, row.bearing.balls
    if (places := steps * turns * balls) > MOST_PLACES:
        raise InputError(
            f"errors.steps = {steps}, errors.turns = {turns}: with {balls} balls these are {places} places, more than the "
            f"{MOST_PLACES} that memory has room for; take fewer steps or turns"
        )
    bench = bench_of(row)
    path = turn.ball_path(errors_of(row.errors, balls), bench.turning, steps, turns)
    return follow(bench.row, bench.control, bench.load, path, turns, bench.constraint)


def bench_of(scene: BallScene, face_radius: float | None = None, steps: int = 120, turns: int = 2) -> Bench:
    """The nominal bearing of a scene under its load, with its runout measurement.

    ``face_radius``: radius at which an axial indicator touches the inner ring [m], by default that of its groove bottom.
    Raises InputError for two rows.
    """
    row = single_row(scene)
    model, bearing, (inner, outer) = row_of(row), row.bearing, row.operation.speeds
    sizes = bearing.ball_diameter, bearing.pitch_diameter, bearing.contact_angle
    # Turns are those of the inner ring relative to the outer ring, which stands if neither turns.
    turning = turn.rolling(*sizes, outer / (inner - outer) if inner != outer else 0.0)
    radius = model.row.lever - model.row.inner_groove_radius if face_radius is None else face_radius
    return Bench(model.row, model.control, load_of(row), turning, radius, steps, turns, constraint_of(row))


def single_row(scene: BallScene) -> SingleRowScene:
    """The scene, if of one row. Raises InputError."""
    if not isinstance(scene, SingleRowScene):
        raise InputError(
            "bearing.kind = 'double_decker_ball': runout is for one row of balls only; choose such a bearing"
        )
    return scene


def errors_of(errors: FormErrors, balls: int) -> RaceErrors:
    """Form errors of a scene in SI, with those drawn by its seed.

    Each kind of error has its own random stream, so that adding one does not change the others.
    """
    streams = [np.random.default_rng(child) for child in np.random.SeedSequence(errors.seed).spawn(8)]
    forms = {
        key.replace("side_", ""): _form(getattr(errors, key), getattr(errors, f"{key}_random"), draw)
        for key, draw in zip(GROOVES, streams, strict=False)
    }
    larger = errors.ball_diameter_errors(streams[6].standard_normal(balls))
    sphericity = [PERFECT] * balls
    for harmonic in errors.ball_sphericity:
        phases = streams[7].uniform(0.0, 2.0 * math.pi, balls)
        for ball in range(balls) if harmonic.balls is None else [number - 1 for number in harmonic.balls]:
            phase = phases[ball] if harmonic.phase is None else harmonic.phase
            wave = waviness((harmonic.order, harmonic.amplitude, phase))
            sphericity[ball] = sphericity[ball].plus(wave)
    return RaceErrors(larger, tuple(sphericity), **forms)


def _form(harmonics: list[Harmonic], random: RandomWaviness | None, draw: np.random.Generator) -> Waviness:
    form = waviness(*((wave.order, wave.amplitude, wave.phase) for wave in harmonics))
    if random is None:
        return form
    return form.plus(turn.random_waviness(random.lowest_order, random.highest_order, random.height, random.decay, draw))
