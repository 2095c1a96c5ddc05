"""The path of a ring that turns over form errors of grooves and balls, from equilibrium to equilibrium.

``RaceErrors`` hold the form errors, ``ball_path`` the geometry that each ball meets, and ``follow`` solves the ``RingPath``.
Outer errors stay with the outer ring, inner errors turn with the inner ring, balls travel with the cage. In the plane of a
ball, with the origin at the centre of curvature of the outer groove, positions are (axial, radial):

- roundness w: the groove is w further out. The inner groove centre moves by +w_i, relative to the outer one by -w_o.
- side-sway and other axial waviness: the same in axial direction. Order 1 is the side-sway (Zhou et al. 2024, eqs 9-10).
- groove radius: the groove is dr wider with its bottom in place. Its centre moves radially by dr and its reach grows by
  dr, so that a contact at the angle alpha opens by dr (1 - cos alpha). The change of the contact stiffness is neglected,
  one part in ten thousand for a micrometre.
- ball: half its diameter error, and its sphericity w at the contact, reduce both reaches. The contacts are opposite (eqs
  11-12): even orders add up and odd orders cancel. The ball rolls on a great circle, about an axis fixed in the ball.

The runout of a path has limits by tolerance class (ISO 492). Three independent measures describe the radial motion:

- ``indicator``: reading of a fixed indicator, its largest range over all directions, as in the class limits K_ia. An
  eccentric groove shows as twice its eccentricity.
- ``minimum_zone``, ``least_squares``: distance between two concentric circles around the orbit of the ring's centre. The
  first is the minimum zone of ISO 1101, the "distance between the maximum and minimum envelope circles" of Zhou et al. 2024.
  An eccentric groove moves the centre on a circle and does not show.
- ``error_motion``: range of a fixed indicator's reading less its best-fitting once-per-turn part, as for spindles.

``tolerance_classes.csv`` has the limits of radial ball bearings with their sources.
"""

import math
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from scipy.optimize import linprog

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.blocks import Column, Sheet, frame_of
from rbdyn.base.faults import MethodError, RunError
from rbdyn.base.records import Record
from rbdyn.properties import table
from rbdyn.quasistatic.row.ball import Control
from rbdyn.quasistatic.row.newton import FIGURES, LARGEST_LOAD, RESIDUAL, Task, boundary_conditions, space, walk
from rbdyn.quasistatic.row.ring import RING, Row, component_lengths

if TYPE_CHECKING:
    import pandas as pd


ToleranceClass = Literal["P2", "P4", "P5", "P6", "normal"]


class RunningAccuracy(Record):
    """Largest permitted runouts [m]; None where the class sets no limit or no source is known.

    ``radial``: K_ia, of the assembled bearing's inner ring; ``face``: S_d, of its side face with the bore; ``axial``:
    S_ia, of the assembled bearing's inner ring; ``outer_radial``: K_ea, of the assembled bearing's outer ring.
    """

    radial: float
    face: float | None
    axial: float | None
    outer_radial: float | None


def running_accuracy(
    tolerance_class: ToleranceClass, bore: float, outside_diameter: float | None = None
) -> RunningAccuracy:
    """Limits of a class for a bore and, for K_ea, an outside diameter [m]. Raises MethodError for a bore outside the tables."""
    row = _row(tolerance_class, "bore", 1e3 * bore)
    if row is None:
        rows = _rows(tolerance_class, "bore")
        raise MethodError(
            f"a bore of {1e3 * bore:g} mm is outside the table of class {tolerance_class}; give one above "
            f"{rows[0]['above']} mm and up to {rows[-1]['up_to']} mm"
        )
    outer = None if outside_diameter is None else _row(tolerance_class, "outside", 1e3 * outside_diameter)
    limits = (*(row[name] for name in ("K_ia", "S_d", "S_ia")), outer["K_ea"] if outer else "")
    return RunningAccuracy(*(1e-6 * float(limit) if limit else None for limit in limits))  # type: ignore[arg-type]


def _rows(tolerance_class: str, part: str) -> list[dict[str, str]]:
    return [row for row in table("tolerance_classes") if (row["class"], row["of"]) == (tolerance_class, part)]


def _row(tolerance_class: str, part: str, millimetres: float) -> dict[str, str] | None:
    """The row of a class for a bore, or an outside diameter."""
    rows = _rows(tolerance_class, part)
    if not rows or millimetres <= float(rows[0]["above"]):
        return None
    return next((row for row in rows if millimetres <= float(row["up_to"]) * (1.0 + 1e-12)), None)


# Number of positions of the axial indicator round the face.
PLACES = 72
STEPS = 60


class Runout(Record):
    """Runout of a path of whole turns.

    ``axial``: range of the axial displacement. ``face``: range of an axial indicator at the worst position on the ring's
    face, tilt included. Synchronous: indicator reading of the mean over turns at equal ring angle. Asynchronous: largest
    spread between turns at equal ring angle, zero for one turn.
    """

    indicator_um: float
    minimum_zone_um: float
    least_squares_um: float
    error_motion_um: float
    axial_um: float
    face_um: float
    synchronous_radial_um: float
    asynchronous_radial_um: float
    synchronous_axial_um: float
    asynchronous_axial_um: float
    turns: int


def runout(path: Array, turns: int, face_radius: float) -> Runout:
    """Runout of a path (turns * steps, 5) of displacements x, y, z [m], theta_x, theta_y [rad].

    ``face_radius``: radius at which an axial indicator touches the ring [m].
    """
    steps = len(path) // turns
    orbit, axial = path[:, :2], path[:, 2]
    # About the mean, the small motion loses no digits.
    orbit = orbit - orbit.mean(axis=0)
    by_turn, axial_by_turn = orbit.reshape(turns, steps, 2), axial.reshape(turns, steps)
    angle = 2.0 * math.pi * np.arange(len(path)) / steps
    return Runout(
        indicator_um=1e6 * diameter(orbit),
        minimum_zone_um=1e6 * minimum_zone(orbit).width,
        least_squares_um=1e6 * least_squares_circle(orbit).width,
        error_motion_um=1e6 * max(error_motion(angle, reading) for reading in orbit.T),
        axial_um=1e6 * float(np.ptp(axial)),
        face_um=1e6 * face_runout(path, face_radius),
        synchronous_radial_um=1e6 * diameter(by_turn.mean(axis=0)),
        asynchronous_radial_um=1e6 * max(diameter(by_turn[:, step]) for step in range(steps)),
        synchronous_axial_um=1e6 * float(np.ptp(axial_by_turn.mean(axis=0))),
        asynchronous_axial_um=1e6 * float(np.ptp(axial_by_turn, axis=0).max()),
        turns=turns,
    )


def face_runout(path: Array, radius: float, places: int = PLACES) -> float:
    """Largest range [m] of an axial indicator at ``radius`` [m] over ``places`` fixed positions round the face."""
    place = 2.0 * math.pi * np.arange(places) / places
    lift = path[:, 3:4] * np.sin(place) - path[:, 4:5] * np.cos(place)
    return float(np.ptp(path[:, 2:3] + radius * lift, axis=0).max())


def error_motion(angle: Array, reading: Array) -> float:
    """Least range [m] of readings less a once-per-turn part c cos(angle) + s sin(angle).

    A linear programme gives the minimum zone of the polar plot of the readings (ANSI B89.3.4), in the limit of a large
    base circle.
    """
    scale = float(np.ptp(reading))
    if scale == 0.0:
        return 0.0
    wave = np.column_stack((np.cos(angle), np.sin(angle)))
    ones, none = np.ones((len(angle), 1)), np.zeros((len(angle), 1))
    level = (reading - reading.mean()) / scale
    optimum = linprog(
        [0.0, 0.0, 1.0, -1.0],
        A_ub=np.vstack((np.hstack((-wave, -ones, none)), np.hstack((wave, none, ones)))),
        b_ub=np.concatenate((-level, level)),
        bounds=[(None, None)] * 4,
        method="highs",
    )
    return scale * float(np.ptp(level - wave @ optimum.x[:2]))


class Zone(NamedTuple):
    """Two circles about one centre (x, y) with all points between them; radii in the unit of the points."""

    x: float
    y: float
    inner: float
    outer: float

    @property
    def width(self) -> float:
        """Difference of the radii."""
        return self.outer - self.inner


def convex_hull(points: Array) -> Array:
    """Corners of the convex hull of (n, 2) points, anticlockwise; of points on a line its ends, of equal points one."""
    ordered = np.unique(points, axis=0)
    if len(ordered) < 3:
        return ordered

    def chain(places: Array) -> list[tuple[float, float]]:
        corners: list[tuple[float, float]] = []
        for x, y in places.tolist():
            while len(corners) > 1:
                (ax, ay), (bx, by) = corners[-2], corners[-1]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                    break
                corners.pop()
            corners.append((x, y))
        return corners

    return np.array(chain(ordered)[:-1] + chain(ordered[::-1])[:-1])


def diameter(points: Array) -> float:
    """Largest distance between two of (n, 2) points: the largest reading of an indicator in any fixed direction."""
    corners = convex_hull(points)
    if len(corners) < 2:
        return 0.0
    apart = corners[:, np.newaxis] - corners
    return float(np.sqrt((apart**2).sum(axis=2).max()))


def least_squares_circle(points: Array) -> Zone:
    """Zone about the centre of the least-squares circle (Gauss-Newton on the distances, from the mean)."""
    centre = points.mean(axis=0)
    for _ in range(STEPS):
        away = points - centre
        distance = np.hypot(*away.T)
        if distance.min() == 0.0:
            break
        # r - u.d = R: unknown step d of the centre and radius R.
        directions = away / distance[:, np.newaxis]
        system = np.column_stack((directions, np.ones(len(points))))
        step = np.linalg.lstsq(system, distance, rcond=1e-10)[0][:2]
        # The best circle of nearly flat points is far away: the centre must stay near the points.
        limit = np.ptp(points, axis=0).max()
        if np.hypot(*step) > limit:
            break
        centre = centre + step
        if np.hypot(*step) <= 1e-14 * limit:
            break
    return zone_about(points, *centre)


def zone_about(points: Array, x: float, y: float) -> Zone:
    """The zone of (n, 2) points about the centre (x, y)."""
    distance = np.hypot(points[:, 0] - x, points[:, 1] - y)
    return Zone(float(x), float(y), float(distance.min()), float(distance.max()))


def minimum_zone(points: Array) -> Zone:
    """Narrowest zone with its centre within the convex hull of (n, 2) points.

    Without that bound an elongated orbit would be between circles of infinite radius. Starting from the least-squares
    centre, linear programmes with linearised distances minimise the width over steps within a trust region. At the optimum
    four points touch the circles, where the method converges quadratically. The minimum is local; for points round a
    centre it is the minimum zone.
    """
    corners = convex_hull(points)
    size = float(np.ptp(points, axis=0).max())
    if len(corners) < 3:
        return zone_about(points, *corners.mean(axis=0))
    along = np.roll(corners, -1, axis=0) - corners
    normal = np.column_stack((along[:, 1], -along[:, 0])) / np.hypot(*along.T)[:, np.newaxis]
    offset = (normal * corners).sum(axis=1)
    best = least_squares_circle(points)
    if np.any(normal @ (best.x, best.y) > offset):
        best = zone_about(points, *points.mean(axis=0))
    # Distances below this are rounding.
    rounding = 8.0 * np.finfo(float).eps * float(np.abs(points).max())
    trust = size
    for _ in range(STEPS):
        step, width = _best_step(points, best, normal, offset, trust)
        gain = best.width - width
        if gain <= max(1e-10 * best.width, rounding):
            return best
        trial = zone_about(points, best.x + step[0], best.y + step[1])
        if best.width - trial.width < 0.25 * gain:
            trust = 0.25 * min(trust, max(float(np.abs(step).max()), 1e-12 * size))
        if trial.width < best.width:
            best = trial
    return best


def _best_step(points: Array, zone: Zone, normal: Array, offset: Array, trust: float) -> tuple[Array, float]:
    """Step of the centre to the narrowest linearised zone, and the width of that zone."""
    away = points - (zone.x, zone.y)
    distance = np.hypot(*away.T)
    # For a centre at a point, any direction is valid.
    directions = away / np.maximum(distance, np.finfo(float).tiny)[:, np.newaxis]
    middle, scale = 0.5 * (zone.inner + zone.outer), max(zone.width, math.ulp(zone.outer))
    ones = np.ones((len(points), 1))
    # Unknowns in units of the width: step (2), outer and inner radius above the middle of the zone.
    reading = (distance - middle)[:, np.newaxis] / scale
    inside = np.hstack((-directions, -ones, 0.0 * ones))
    outside = np.hstack((directions, 0.0 * ones, ones))
    within = np.hstack((normal, np.zeros((len(normal), 2))))
    room = (offset - normal @ (zone.x, zone.y)) / scale
    optimum = linprog(
        [0.0, 0.0, 1.0, -1.0],
        A_ub=np.vstack((inside, outside, within)),
        b_ub=np.concatenate((-reading[:, 0], reading[:, 0], np.maximum(room, 0.0))),
        bounds=[(-trust / scale, trust / scale)] * 2 + [(None, None)] * 2,
        method="highs",
    )
    if not optimum.success:
        return np.zeros(2), zone.width
    return scale * optimum.x[:2], float(scale * optimum.fun)


class Waviness(Record):
    """Sum of amplitude cos(order (angle - phase)) over harmonics: orders [-], amplitudes [m], phases [rad]."""

    order: Whole
    amplitude: Array
    phase: Array

    def deviation(self, angle: Array) -> Array:
        """Deviation [m] at angles on the ring [rad], of their shape."""
        total = np.zeros_like(angle)
        for order, amplitude, phase in zip(self.order, self.amplitude, self.phase, strict=True):
            total += amplitude * np.cos(order * (angle - phase))
        return total

    @property
    def height(self) -> float:
        """Peak to valley around the ring [m]."""
        fine = 16 * int(self.order.max(initial=1))
        trace = self.deviation(np.linspace(0.0, 2.0 * math.pi, max(fine, 720), endpoint=False))
        return float(np.ptp(trace))

    def scaled(self, factor: float) -> "Waviness":
        """The same form, ``factor`` times as high."""
        return Waviness(self.order, factor * self.amplitude, self.phase)

    def plus(self, other: "Waviness") -> "Waviness":
        """Both together."""
        return Waviness(
            np.concatenate((self.order, other.order)),
            np.concatenate((self.amplitude, other.amplitude)),
            np.concatenate((self.phase, other.phase)),
        )


def waviness(*harmonics: tuple[int, float, float]) -> Waviness:
    """Waviness of harmonics (order, amplitude [m], phase [rad]); without any, a perfect form."""
    order, amplitude, phase = np.array(harmonics, float).reshape(-1, 3).T
    return Waviness(order.astype(np.int64), amplitude, phase)


PERFECT = waviness()


def random_waviness(lowest: int, highest: int, height: float, decay: float, draw: np.random.Generator) -> Waviness:
    """Waviness of orders ``lowest`` to ``highest`` in random phases, ``height`` [m] from peak to valley.

    Amplitudes are Rayleigh distributed, with a mean that falls as order^-decay.
    """
    order = np.arange(lowest, highest + 1)
    amplitude = order.astype(float) ** -decay * draw.rayleigh(size=order.size)
    form = Waviness(order, amplitude, draw.uniform(0.0, 2.0 * math.pi, order.size))
    return form.scaled(height / form.height)


class RaceErrors(Record):
    """Form errors of one row of Z balls.

    ``ball_diameter`` (Z,): diameter of each ball less the nominal one [m]. ``sphericity``: waviness round each ball, by the
    angle of the inner contact from a mark on the ball.
    """

    ball_diameter: Array
    sphericity: tuple[Waviness, ...]
    inner_roundness: Waviness = PERFECT
    outer_roundness: Waviness = PERFECT
    inner_sway: Waviness = PERFECT
    outer_sway: Waviness = PERFECT
    inner_groove_radius: Waviness = PERFECT
    outer_groove_radius: Waviness = PERFECT

    @property
    def balls(self) -> int:
        """Number of balls Z."""
        return self.ball_diameter.size


def perfect(balls: int) -> RaceErrors:
    """Errors of a perfect row of ``balls``."""
    return RaceErrors(np.zeros(balls), (PERFECT,) * balls)


class Turning(NamedTuple):
    """Turns of each part for one turn of the inner ring relative to the outer: rings, cage, balls relative to the cage."""

    inner: float
    outer: float
    cage: float
    spin: float


def rolling(ball_diameter: float, pitch_diameter: float, contact_angle: float, outer: float = 0.0) -> Turning:
    """Rolling without slip, one cage speed for all balls.

    Diameters in m, the angle in rad. ``outer``: turns of the outer ring; at 0 it stands, at -1 the inner ring stands.
    omega_c = (omega_i (1 - g) + omega_o (1 + g))/2, spin = (omega_i - omega_o) (1 - g^2) dm/(2D), g = D cos(alpha)/dm.
    """
    gamma = ball_diameter * math.cos(contact_angle) / pitch_diameter
    cage = 0.5 * ((1.0 + outer) * (1.0 - gamma) + outer * (1.0 + gamma))
    spin = 0.5 * pitch_diameter / ball_diameter * (1.0 - gamma**2)
    return Turning(1.0 + outer, outer, cage, spin)


class BallPath(NamedTuple):
    """Geometry at each ball at each step: changes [m] of the row, (steps, Z) each.

    ``ring_angle`` (steps,): turn of the inner ring [rad]. ``azimuth`` of the balls [rad]. ``axial, radial``: position of
    the inner groove centre relative to the outer one. ``inner_reach, outer_reach``: groove radius less ball radius.
    """

    ring_angle: Array
    azimuth: Array
    axial: Array
    radial: Array
    inner_reach: Array
    outer_reach: Array


def ball_path(errors: RaceErrors, turning: Turning, steps: int, turns: int = 1, start: float = 0.0) -> BallPath:
    """Ball path of ``turns`` turns of the inner ring relative to the outer, with ``steps`` a turn.

    ``start``: azimuth of the first ball at the first step [rad].
    """
    z = errors.balls
    turn = 2.0 * math.pi * np.arange(steps * turns)[:, np.newaxis] / steps
    azimuth = start + turning.cage * turn + 2.0 * math.pi * np.arange(z) / z
    on_inner, on_outer = azimuth - turning.inner * turn, azimuth - turning.outer * turn
    wider_inner, wider_outer = (
        errors.inner_groove_radius.deviation(on_inner),
        errors.outer_groove_radius.deviation(on_outer),
    )
    # The inner contact is at the spin angle of the ball, the outer one opposite.
    spun = turning.spin * turn[:, 0]
    inner_contact = np.stack([form.deviation(spun) for form in errors.sphericity], axis=1)
    outer_contact = np.stack([form.deviation(spun + math.pi) for form in errors.sphericity], axis=1)
    larger = 0.5 * errors.ball_diameter
    return BallPath(
        ring_angle=turning.inner * turn[:, 0],
        azimuth=azimuth,
        axial=errors.inner_sway.deviation(on_inner) - errors.outer_sway.deviation(on_outer),
        radial=errors.inner_roundness.deviation(on_inner)
        - errors.outer_roundness.deviation(on_outer)
        + wider_inner
        + wider_outer,
        inner_reach=wider_inner - inner_contact - larger,
        outer_reach=wider_outer - outer_contact - larger,
    )


class RingPath(Record):
    """Path of the inner ring. ``path`` (steps, 5): displacements x, y, z [m], theta_x, theta_y [rad].

    ``ring_angle`` (steps,) [rad]. ``largest_load`` (steps,): of any ball on any race [N]. ``residual``: largest unbalanced
    force of all steps [N]. ``newton_steps``: of all steps together.
    """

    ring_angle: Array
    path: Array
    largest_load: Array
    residual: float
    newton_steps: int
    turns: int

    def runout(self, face_radius: float) -> Runout:
        """Runout of the path; ``face_radius``: radius at which an axial indicator touches the ring [m]."""
        return runout(self.path, self.turns, face_radius)

    def table(self) -> "pd.DataFrame":
        """A row a step, units in the column names."""
        return frame_of(RUNOUT.columns, self)


RUNOUT: Sheet[RingPath] = Sheet(
    "",
    (
        Column("ring_angle_deg", at=lambda ring: np.degrees(ring.ring_angle), meaning="how far the ring has turned"),
        Column("x_um", at=lambda ring: 1e6 * ring.path[:, 0], meaning="place of the inner ring"),
        Column("y_um", at=lambda ring: 1e6 * ring.path[:, 1]),
        Column("z_um", at=lambda ring: 1e6 * ring.path[:, 2]),
        Column("tilt_x_urad", unit="µrad", at=lambda ring: 1e6 * ring.path[:, 3], meaning="its tilts"),
        Column("tilt_y_urad", unit="µrad", at=lambda ring: 1e6 * ring.path[:, 4]),
        Column("largest_load_N", at="largest_load", meaning="largest load of a ball"),
    ),
    file="runout.csv",
    content="One row per step of the turning ring, of `rbdyn ball` with `[errors]` in the scene.",
)


def follow(
    row: Row, control: Control, load: Array, balls: BallPath, turns: int, constraint: Array | None = None
) -> RingPath:
    """Solve the equilibrium at every step of ``balls``, each from the step before.

    The changes of ``balls`` are added to the positions and reaches of the nominal ``row``. Other arguments are those of
    ``equilibrium.solve``. Raises RunError naming the first step without an equilibrium.
    """
    steps, size = balls.azimuth.shape
    force, free, displacement = boundary_conditions(row, load, constraint)
    # Positions and reaches have the same order in ``Row`` and ``BallPath``.
    places = (start + change for start, change in zip(row[2:6], balls[2:6], strict=True))
    changes = np.stack((np.cos(balls.azimuth), np.sin(balls.azimuth), *places))
    # ``walk`` overwrites its row.
    start = Row._make((*np.zeros((6, size)), *row[6:]))
    state = space(size)
    state.q[:] = displacement
    path, figures = np.zeros((steps, RING)), np.zeros((steps, FIGURES))
    reached, newton_steps = walk(Task(control, start, force, free), changes, state, path, figures)
    if reached < steps:
        raise RunError(
            f"runout: no equilibrium at step {reached + 1} of {steps}; reduce the form errors or raise the load"
        )
    return RingPath(
        ring_angle=balls.ring_angle,
        path=path / component_lengths(row.lever),
        largest_load=figures[:, LARGEST_LOAD],
        residual=float(figures[:, RESIDUAL].max()),
        newton_steps=newton_steps,
        turns=turns,
    )
