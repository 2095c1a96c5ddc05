"""Geometry and kinematics of a scene, and the sizes by which errors are measured. SI."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.hertz_line import palmgren
from rbdyn.dynamics.state import Layout, layout
from rbdyn.materials import equivalent_modulus
from rbdyn.scene import Scene


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


def kinematics(
    scene: Scene, inner_speed: float | None = None, outer_speed: float | None = None
) -> Kinematics:
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


def cage_inertia(scene: Scene) -> float:
    """Given, or that of a plain ring between the land and the far rim of the estimated cage body [kg m^2]."""
    if scene.cage.inertia_kg_mm2 is not None:
        return scene.cage.inertia_kg_mm2 * 1e-6
    side = {"outer": -1.0, "inner": 1.0, "roller": 1.0}[scene.cage.guidance]
    rim = scene.bearing.pitch_diameter_mm + side * scene.bearing.roller_diameter_mm / 3.0
    return scene.cage.mass_g * 1e-3 * (scene.land_diameter_mm**2 + rim**2) * 1e-6 / 8.0


def needs_clock(scene: Scene) -> bool:
    """Whether anything depends on time or on the angle of a ring."""
    operation, bearing = scene.operation, scene.bearing
    turning_form = bearing.inner_waviness or (bearing.outer_waviness and operation.outer_speed_rpm != 0.0)
    return bool(
        operation.schedule
        or operation.rotating_load_N > 0.0
        or operation.unbalance_g_mm > 0.0
        or turning_form
    )


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


def absolute_tolerance(scene: Scene, rtol: float) -> NDArray[np.float64]:
    """Tolerance of each state component: ``rtol`` of the approach or contact speed that the component can make.

    Infinite for the clock, which the method integrates exactly.
    """
    scale, state = scales(scene), layout_of(scene)
    roller, cage = 0.5e-3 * scene.bearing.roller_diameter_mm, 0.5e-3 * scene.bearing.pitch_diameter_mm
    rollers = np.repeat(
        [scale.length, scale.length, scale.speed, scale.speed, scale.speed / roller], state.rollers
    )
    positions, speeds = [scale.length, scale.length], [scale.speed, scale.speed]
    bodies = [*positions, scale.length / cage, *speeds, scale.speed / cage, *positions, *speeds]
    bodies += [*positions, *speeds] if state.support is not None else []
    clock = [math.inf] * 3 if state.clock is not None else []
    return rtol * np.concatenate((rollers, np.array(bodies + clock)))
