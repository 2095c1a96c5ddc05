"""Geometry and kinematics of a scene, and the sizes by which errors are measured. SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.hertz_line import palmgren
from rbdyn.contact.traction import traction
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.forces.state import Layout, layout
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.scene import Scene

# Largest contact speed by which errors are measured, as a share of that of the faster race. Held at its limit of
# stability, the explicit method leaves the whole tolerance in every contact in every step, and contacts lose it: in a
# slow bearing that must stay small beside what rolling loses. The implicit method damps it.
SPEED_SHARES = {"rk45": 0.05, "rk43": 0.05, "rosenbrock": 1.0}
# Tolerance of the cage's speeds over that of a contact's. Only impacts change them, in two or three explicit steps each,
# which damp an impact where the races alone rule the steps: with it impact and whirl of the bearing of Chen et al. 2022
# are off by -0.14 +- 0.12 and -0.1 +- 0.4 % in 1970 right-hand sides of rk43 a turn, without it by -0.3 and -0.9 % in 1550.
# The implicit method damps less: whirl goes from +0.6 +- 1.1 to +0.2 +- 0.8 % for a hundredth more right-hand sides.
CAGE_SHARES = {"rk45": 0.01, "rk43": 0.01, "rosenbrock": 0.1}


@dataclass(frozen=True)
class Kinematics:
    """Rolling without slip: orbit (cage) speed and roller spin [rad/s], entrainment speed at the races [m/s]."""

    cage_speed: float
    roller_spin: float
    entrainment: float


@dataclass(frozen=True)
class Scales:
    """Characteristic load [N], approach [m] and speed [m/s] of a race contact, by which errors are measured."""

    load: float
    length: float
    speed: float


def raceway_radii(scene: Scene) -> tuple[float, float]:
    """Outer and inner raceway radius [m]; the mounted clearance is split evenly about the pitch circle."""
    pitch, roller = scene.bearing.pitch_diameter_mm, scene.bearing.roller_diameter_mm
    half = 0.5 * scene.mounted_clearance_mm
    return 0.5e-3 * (pitch + roller + half), 0.5e-3 * (pitch - roller - half)


def reduced_radii(scene: Scene) -> tuple[float, float]:
    """Reduced radius of the contact of roller and outer race, roller and inner race [m]."""
    outer, inner = raceway_radii(scene)
    roller = 0.5e-3 * scene.bearing.roller_diameter_mm
    return 1.0 / (1.0 / roller - 1.0 / outer), 1.0 / (1.0 / roller + 1.0 / inner)


def shaft_speeds(scene: Scene) -> tuple[float, float]:
    """Nominal speeds of inner and outer ring [rad/s]."""
    operation = scene.operation
    return operation.inner_speed_rpm * math.pi / 30.0, operation.outer_speed_rpm * math.pi / 30.0


def kinematics(scene: Scene, inner_speed: float | None = None, outer_speed: float | None = None) -> Kinematics:
    """Epicyclic speeds, cage = (inner R_i + outer R_o)/(R_i + R_o), at ring speeds [rad/s] or the nominal ones."""
    nominal = shaft_speeds(scene)
    inner_speed = nominal[0] if inner_speed is None else inner_speed
    outer_speed = nominal[1] if outer_speed is None else outer_speed
    outer, inner = raceway_radii(scene)
    cage = (inner_speed * inner + outer_speed * outer) / (inner + outer)
    radius = 0.5e-3 * scene.bearing.roller_diameter_mm
    spin = (outer_speed * outer - cage * (outer - radius)) / radius
    return Kinematics(cage, spin, (inner_speed - cage) * inner)


def roller_mass(scene: Scene) -> float:
    """Mass of a roller [kg], a plain cylinder."""
    diameter, length = scene.bearing.roller_diameter_mm * 1e-3, scene.bearing.roller_length_mm * 1e-3
    return scene.material("roller").density * math.pi / 4.0 * diameter**2 * length


def roller_radii(scene: Scene) -> NDArray[np.float64] | None:
    """Radius of each roller [m]; None where all are equal. A spread is drawn with the scene's seed, once for all
    replicates: it is one bearing that is simulated.
    """
    bearing = scene.bearing
    errors_um = bearing.roller_diameter_errors_um
    if errors_um is None and bearing.roller_diameter_spread_um > 0.0:
        draw = np.random.default_rng(np.random.SeedSequence(scene.numerics.seed, spawn_key=(2**31,)))
        errors_um = list(draw.normal(0.0, bearing.roller_diameter_spread_um, bearing.rollers))
    if errors_um is None or not any(errors_um):
        return None
    return 0.5e-3 * bearing.roller_diameter_mm + 0.5e-6 * np.array(errors_um)


def cage_rim_diameter(scene: Scene) -> float:
    """Diameter of the estimated cage body on the side away from the land [mm]."""
    side = {"outer": -1.0, "inner": 1.0, "roller": 1.0}[scene.cage.guidance]
    return scene.bearing.pitch_diameter_mm + side * scene.bearing.roller_diameter_mm / 3.0


def cage_inertia(scene: Scene) -> float:
    """Given, or that of a plain ring between the land and the far rim of the estimated cage body [kg m^2]."""
    if scene.cage.inertia_kg_mm2 is not None:
        return scene.cage.inertia_kg_mm2 * 1e-6
    rim = cage_rim_diameter(scene)
    return scene.cage.mass_g * 1e-3 * (scene.land_diameter_mm**2 + rim**2) * 1e-6 / 8.0


def needs_clock(scene: Scene) -> bool:
    """Whether anything depends on time or on the angle of a ring."""
    operation, bearing = scene.operation, scene.bearing
    turning_form = bearing.inner_waviness or (bearing.outer_waviness and operation.outer_speed_rpm != 0.0)
    return bool(operation.schedule or operation.rotating_load_N > 0.0 or operation.unbalance_g_mm > 0.0 or turning_form)


def layout_of(scene: Scene) -> Layout:
    """Layout of the state vector."""
    return layout(scene.bearing.rollers, scene.support is not None, needs_clock(scene))


def scales(scene: Scene) -> Scales:
    """Size of a race contact: the mean load share, or the centrifugal force, or the roller's weight."""
    mass, count = roller_mass(scene), scene.bearing.rollers
    centrifugal = mass * 0.5e-3 * scene.bearing.pitch_diameter_mm * kinematics(scene).cage_speed ** 2
    load = max(scene.operation.largest_load_N / count, centrifugal, 9.81 * mass)
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    approach = (load / palmgren(modulus, scene.bearing.effective_length_mm * 1e-3).stiffness) ** 0.9
    frequency = math.sqrt(10.0 / 9.0 * load / approach / mass)
    return Scales(load, approach, approach * frequency)


def fastest_surface(scene: Scene) -> float:
    """Largest speed of a raceway at any time [m/s]."""
    schedule, (outer, inner) = scene.operation.schedule, raceway_radii(scene)
    inner_speed, outer_speed = shaft_speeds(scene)
    scheduled = (schedule.inner_speed_rpm if schedule else None) or []
    inner_speeds = [inner_speed, *(rpm * math.pi / 30.0 for rpm in scheduled)]
    return max(abs(outer_speed) * outer, *(abs(speed) * inner for speed in inner_speeds))


def slip_scale(bearing: RollerBearing, load: float) -> float:
    """Slip [m/s] at which the tangent of the steeper traction curve at rest would reach its peak; infinite without
    traction. Slips must be known to a part of this, whatever the speed: beyond it friction is false.
    """
    slips = np.logspace(-9.0, 3.0, 241)
    scale = math.inf
    for race in (bearing.outer, bearing.inner):
        curve = np.array([traction(race.traction, float(slip), load) for slip in slips])
        slope = float(curve[0] / slips[0])
        scale = min(scale, float(curve.max()) / slope if slope > 0.0 else math.inf)
    return scale


def absolute_tolerance(scene: Scene, bearing: RollerBearing, rtol: float, method: str = "rk45") -> NDArray[np.float64]:
    """Tolerance of each state component: ``rtol`` of the approach or contact speed that the component can make.

    In a slow bearing the contact speed is at most the method's share of the speed of the faster race, and the approach
    shrinks with it. The spin of a roller counts by the slip it makes, at most the scale of the traction curve at the load
    of the most loaded roller (Stribeck). Speeds of the cage count by the method's share of a contact's. Infinite for the
    clock, which the method integrates exactly.
    """
    scale, state = scales(scene), layout_of(scene)
    speed = min(scale.speed, SPEED_SHARES[method] * fastest_surface(scene))
    length = scale.length * speed / scale.speed
    slip = min(speed, slip_scale(bearing, 5.0 * scale.load))
    roller, cage = 0.5e-3 * scene.bearing.roller_diameter_mm, 0.5e-3 * scene.bearing.pitch_diameter_mm
    sizes = {"m": length, "m/s": speed}
    own = CAGE_SHARES[method] * speed
    sizes_of = {
        "roller": sizes | {"rad/s": slip / roller},
        "cage": {"m": length, "rad": length / cage, "m/s": own, "rad/s": own / cage},
        "inner ring": sizes,
        "outer ring": sizes,
        "clock": {"s": math.inf, "rad": math.inf},
    }
    return rtol * state.each(lambda part: sizes_of[part.body][part.unit])
