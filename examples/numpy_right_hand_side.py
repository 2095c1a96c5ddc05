"""The roller bearing on one page: its right-hand side in plain numpy, and what compiled code is worth beside it.

    python examples/numpy_right_hand_side.py [SCENE.toml] [--turns 0.25]

``right_hand_side`` holds the laws that a scene has by default: Palmgren contacts with viscous damping, four-constant
traction and rolling resistance on round races, elastic cross-bars, a short journal film over a dry land, drag. All
rollers at once, as one would write it in numpy. The script runs SciPy's RK45 on it and prints how many times faster
``rbdyn`` is at equal error.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, NamedTuple

import numpy as np
import typer
from numpy.typing import NDArray

from rbdyn.base.faults import InputError

Array = NDArray[np.float64]
EXAMPLE = Path(__file__).parent / "cylindrical_roller.toml"
EXPONENT = 10.0 / 9.0
RTOLS = (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)
LAWS = [
    # Sums and samples, which exert nothing.
    "Impacts",
    "RaceSamples",
    "RaceScale",
    "EqualRollers",
    "RoundRace",
    "LineContact",
    "ViscousDamping",
    "FourConstantTraction",
    "RollingResistance",
    "RigidContact",
    "NoOpenFilm",
    "Pocket",
    "LineContactOnBar",
    "HuntCrossleyDamping",
    "CoulombTraction",
    "OuterGuide",
    "ShortJournalFilm",
    "DryContact",
    "CylinderDrag",
    "BalancedCage",
    "HeldRing",
    "SteadyDrive",
    "NoGravity",
]


class Pull(NamedTuple):
    """Of one contact a roller: force (2, Z) and moment on the roller, moment on the ring or cage about its centre."""

    force: Array
    moment: Array
    ring_moment: Array


def race(
    law: Any, side: float, roller_radius: float, at: Array, velocity: Array, spin: Array, ring_speed: float
) -> Pull:
    """Race on rollers at ``at`` (2, Z) with ``velocity`` (2, Z) from the ring's centre; side +1 outer, -1 inner."""
    distance = np.hypot(*at)
    nx, ny = at / distance
    closing = side * (velocity[0] * nx + velocity[1] * ny)
    tangential = velocity[1] * nx - velocity[0] * ny
    overlap = side * (distance - law.radius) + roller_radius
    approach = np.maximum(overlap, 1e-18)
    elastic = np.where(overlap > 0.0, law.contact.stiffness * approach**EXPONENT, 0.0)
    stiffness = EXPONENT * elastic / approach
    engaged = np.minimum(approach * law.damping.per_engagement, 1.0)
    engaged = engaged**2 * (3.0 - 2.0 * engaged)
    damping = law.damping.scale * np.sqrt(stiffness) * engaged
    load = np.where(overlap > 0.0, np.maximum(elastic + damping * closing, 0.0), 0.0)

    # The surfaces meet half an approach below the roller's, and slide there.
    lever = side * (roller_radius - 0.5 * approach)
    ring_lever = distance + lever
    slip = ring_speed * ring_lever - tangential - spin * lever
    gupta, speed = law.traction, np.abs(slip)
    traction = np.copysign((gupta.a + gupta.b * speed) * np.exp(-gupta.c * speed) + gupta.d, slip) * load

    orbit = tangential / distance
    entrainment = 0.5 * ((spin - orbit) * lever + (ring_speed - orbit) * ring_lever)
    u, q = np.maximum(np.abs(entrainment), 1e-12), np.maximum(load, 1e-30)
    rolling = law.rolling.force_scale * np.sqrt(q * u) / (1.0 + law.rolling.regime_scale * q**5 / u**2.5) ** 0.1
    rolling = np.copysign(rolling, entrainment)

    along = traction + rolling * (ring_lever + lever) / distance
    normal = -side * load
    force = np.array([normal * nx - along * ny, normal * ny + along * nx])
    return Pull(force, lever * (traction - rolling), -ring_lever * (traction + rolling))


def bar_load(contact: Any, approach: Array) -> Array:
    """Load of a line contact in series with a bar: Newton on y, y^9 being the indentation, from above the root."""
    ratio, y = contact.stiffness / contact.bar_stiffness, approach ** (1.0 / 9.0)
    for _ in range(8):
        y -= (ratio * y**10 + y**9 - approach) / (10.0 * ratio * y**9 + 9.0 * y**8)
    return contact.stiffness * y**10


def pocket(law: Any, ex: Array, ey: Array, at: Array, velocity: Array, spin: Array, cage_speed: float) -> Pull:
    """Pocket walls on rollers at ``at`` (2, Z) from the cage's centre; (ex, ey): mid-lines of the pockets."""
    offset, height = at[1] * ex - at[0] * ey, at[0] * ex + at[1] * ey
    wall, approach = np.sign(offset), np.abs(offset) - law.half_clearance
    load = np.zeros_like(offset)
    touching = approach > 0.0
    if touching.any():
        closing = wall * (velocity[1] * ex - velocity[0] * ey - cage_speed * height)
        elastic = bar_load(law.contact, approach[touching])
        load[touching] = np.maximum(elastic * (1.0 + 1.5 * law.damping.alpha * closing[touching]), 0.0)
    lever = wall * law.nominal_radius
    slip = -cage_speed * (offset + lever) - (velocity[0] * ex + velocity[1] * ey - spin * lever)
    friction = law.friction.coefficient * np.tanh(slip / law.friction.blend_speed) * load
    normal = -wall * load
    force = np.array([friction * ex - normal * ey, friction * ey + normal * ex])
    return Pull(force, -lever * friction, -height * normal + (offset + lever) * friction)


def land(guide: Any, at: Array, velocity: Array, cage_speed: float) -> tuple[Array, float]:
    """Force on a cage guided by the outer ring, at rest, and moment about its centre: film, and dry contact."""
    film, dry = guide.film, guide.dry
    offset = np.hypot(*at)
    n = at / offset if offset > 0.0 else np.array([1.0, 0.0])
    t = np.array([-n[1], n[0]])
    closing, whirling = velocity @ n, velocity @ t
    e = min(offset / film.clearance, film.largest_eccentricity)
    a, b = 2.0 * closing / film.clearance, 2.0 * whirling / film.clearance - e * cage_speed
    size, root = np.hypot(a, b), np.sqrt(1.0 - e**2)
    radial = across = 0.0
    if size > 0.0:
        # Pressure over the half circle where it is positive, in Sommerfeld's angle (Booker's integrals).
        c, s = b / size, -a / size
        c_1, s_1 = (c - e) / (1.0 - e * c), root * s / (1.0 - e * c)
        c_2, s_2 = (-c - e) / (1.0 + e * c), -root * s / (1.0 + e * c)
        gamma = np.arctan2(s_2 * c_1 - c_2 * s_1, c_2 * c_1 + s_2 * s_1) % (2.0 * np.pi)
        twice = s_2 * c_2 - s_1 * c_1
        cc = (0.5 * (gamma + twice) + e * (2.0 * (s_2 - s_1) + e * gamma)) / root**5
        sc = (0.5 * (s_2**2 - s_1**2) - e * (c_2 - c_1)) / root**4
        ss = 0.5 * (gamma - twice) / root**3
        radial = -0.5 * film.force_scale * (a * cc + b * sc)
        across = -0.5 * film.force_scale * (a * sc + b * ss)
    moment = -film.shear_scale * cage_speed / root - 0.5 * offset * across
    approach = offset - dry.play
    if approach > 0.0:
        elastic = dry.contact.stiffness * approach**EXPONENT
        load = max(elastic * (1.0 + 1.5 * dry.damping.alpha * closing), 0.0)
        slip = -cage_speed * guide.radius - whirling
        friction = dry.friction.coefficient * np.tanh(slip / dry.friction.blend_speed) * load
        radial, across, moment = radial - load, across + friction, moment + guide.radius * friction
    return radial * n + across * t, moment


def laws_of(parameters: Any) -> set[str]:
    """Names of the laws that a bearing is made of."""
    parts = [part for part in parameters if hasattr(part, "_fields")]
    return {type(part).__name__ for part in parts if type(part).__name__ != "Race"}.union(*map(laws_of, parts))


class NumpyRightHandSide:
    """f(t, y) -> dy/dt of a bearing with the default laws, from the parameters of its compiled twin.

    Raises InputError for any other law.
    """

    def __init__(self, bearing: Any) -> None:
        others = sorted(laws_of(bearing) - set(LAWS))
        if others:
            raise InputError([f"{', '.join(others)}: not on this page; take a scene of default laws"])
        self.bearing, self.calls = bearing, 0

    def __call__(self, t: float, y: Array) -> Array:
        """Derivative of the state, laid out as in ``rbdyn.dynamics.forces.state``."""
        self.calls += 1
        b = self.bearing
        z = b.rollers
        place, velocity, spin = y[: 2 * z].reshape(2, z), y[2 * z : 4 * z].reshape(2, z), y[4 * z : 5 * z]
        cage, cage_velocity, ring, ring_velocity = (y[5 * z : 5 * z + 2], y[5 * z + 3 : 5 * z + 5], y[-4:-2], y[-2:])
        angle, cage_speed = y[5 * z + 2], y[5 * z + 5]
        cosine, sine = np.cos(angle), np.sin(angle)
        ex, ey = cosine * b.pocket_cos - sine * b.pocket_sin, sine * b.pocket_cos + cosine * b.pocket_sin
        radius = b.sizes.radius

        def seen(centre: Array, centre_velocity: Array) -> tuple[Array, Array, Array]:
            return place - centre[:, np.newaxis], velocity - centre_velocity[:, np.newaxis], spin

        outer = race(b.outer, 1.0, radius, place, velocity, spin, 0.0)
        inner = race(b.inner, -1.0, radius, *seen(ring, ring_velocity), b.drive.inner_speed)
        walls = pocket(b.pocket, ex, ey, *seen(cage, cage_velocity), cage_speed)
        drag = -b.drag.factor * np.hypot(*velocity) * velocity
        on_cage, cage_moment = land(b.guide, cage, cage_velocity, cage_speed)
        on_cage = on_cage - walls.force.sum(axis=1)
        load = np.array([b.drive.load_x, 0.0])
        return np.concatenate(
            (
                y[2 * z : 4 * z],
                ((outer.force + inner.force + walls.force + drag) / b.roller_mass).ravel(),
                (outer.moment + inner.moment + walls.moment) / b.roller_inertia,
                cage_velocity,
                [cage_speed],
                on_cage / b.cage.mass,
                [(cage_moment + walls.ring_moment.sum()) / b.cage.inertia],
                ring_velocity,
                (load - inner.force.sum(axis=1)) / b.inner_ring_mass,
            )
        )


def main(
    scene: Annotated[Path, typer.Argument(help="A scene of default laws.")] = EXAMPLE,
    turns: Annotated[float, typer.Option(help="Shaft turns to integrate, at most 1.")] = 0.25,
) -> None:
    """Print error and time of SciPy's RK45 on the numpy right-hand side, and how many times faster rbdyn is."""
    from rbdyn.base.command import guarded

    with guarded(as_json=False):
        compare(scene, turns)


def compare(scene: Path, turns: float) -> None:
    """Measure both and print. Raises InputError, RunError."""
    from rbdyn import Scene
    from rbdyn.accuracy.methods import (
        OURS,
        Method,
        attempts_of,
        by_scipy,
        compiling,
        curve,
        reference,
        starts_after_transient,
        table,
        times_faster,
    )
    from rbdyn.accuracy.report import processor
    from rbdyn.base.terminal import show

    stretches = starts_after_transient(Scene.load(scene), turns)
    ready = by_scipy("RK45", lambda stretch: NumpyRightHandSide(stretch.bearing))
    plain = Method("SciPy RK45 on numpy", True, RTOLS, ready)
    compiling(stretches[0], (plain,))
    known = reference(stretches)
    attempts = [found for method in (OURS, plain) for found in attempts_of(method, stretches, known)]
    show([table(attempts, turns)])
    ratio = times_faster(*(curve(attempts, method.name, known.floor(turns)) for method in (OURS, plain)))
    if ratio is None:
        print("the two have no range of errors in common")
    else:
        print(
            f"{OURS.name} is {ratio.mean:.0f} times faster at equal position error ({ratio.least:.0f} to "
            f"{ratio.greatest:.0f}, errors {ratio.low:.1g} to {ratio.high:.1g} m); {processor()}"
        )


if __name__ == "__main__":
    typer.run(main)
