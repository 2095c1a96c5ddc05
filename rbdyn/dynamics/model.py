"""From a scene to what the kernels read: geometry, masses and the chosen laws, in SI."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.damping import HuntCrossleyDamping, NoDamping, ViscousDamping
from rbdyn.contact.film import (
    NoRollingResistance,
    aihara_thermal_factor,
    biboulet_houpert,
    short_journal_film,
)
from rbdyn.contact.hertz_line import (
    LineContact,
    LineContactOnBar,
    SlicedLineContact,
    logarithmic_relief,
    palmgren_stiffness,
    slice_centres,
)
from rbdyn.contact.traction import (
    BlendedFourConstantTraction,
    CoulombTraction,
    FourConstantTraction,
    NoTraction,
    four_constants,
)
from rbdyn.dynamics.drag import NoDrag, cylinder_drag
from rbdyn.dynamics.equations import RollerBearing
from rbdyn.dynamics.guide_land import DryContact, InnerGuide, NoFilm, NoGuide, OuterGuide
from rbdyn.dynamics.pocket import NoPocket, Pocket
from rbdyn.dynamics.races import Race
from rbdyn.lubricants import Oil, oil_at
from rbdyn.materials import equivalent_modulus
from rbdyn.scene import Scene

# Slices where a profile needs them (ISO/TS 16281 asks for at least 30).
PROFILE_SLICES = 31


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


def roller_bearing(scene: Scene) -> RollerBearing:
    """Parameters of the equations of motion."""
    drawing = scene.bearing
    diameter, length = drawing.roller_diameter_mm * 1e-3, drawing.roller_length_mm * 1e-3
    outer_radius, inner_radius = raceway_radii(scene)
    mass = scene.material("roller").density * math.pi / 4.0 * diameter**2 * length
    angles = 2.0 * np.pi * np.arange(drawing.rollers) / drawing.rollers
    oil = lubricant(scene)
    contact = _race_contact(scene)
    damping = _race_damping(scene, mass)
    traction = _race_traction(scene)
    laws = scene.model
    drag: Any = NoDrag()
    if laws.drag == "cylinder" and laws.drag_coefficient > 0.0:
        drag = cylinder_drag(
            oil.density, scene.lubricant.oil_fraction, laws.drag_coefficient, diameter, length
        )
    return RollerBearing(
        rollers=drawing.rollers,
        roller_radius=0.5 * diameter,
        roller_mass=mass,
        roller_inertia=mass * diameter**2 / 8.0,
        outer=Race(outer_radius, contact, damping, traction, _rolling(scene, oil, outer_radius, -1.0)),
        inner=Race(inner_radius, contact, damping, traction, _rolling(scene, oil, inner_radius, 1.0)),
        pocket=_pocket(scene),
        pocket_cos=np.cos(angles),
        pocket_sin=np.sin(angles),
        guide=_guide(scene, oil),
        drag=drag,
        cage_mass=scene.cage.mass_g * 1e-3,
        cage_inertia=cage_inertia(scene),
        ring_mass=drawing.inner_ring_mass_kg,
        ring_speed=scene.operation.inner_speed_rpm * math.pi / 30.0,
        radial_load=float(scene.operation.radial_load_N),
    )


def raceway_radii(scene: Scene) -> tuple[float, float]:
    """Outer and inner raceway radius [m]; the radial clearance is split evenly about the pitch circle."""
    pitch, roller = scene.bearing.pitch_diameter_mm, scene.bearing.roller_diameter_mm
    half = 0.5 * scene.bearing.radial_clearance_mm
    return 0.5e-3 * (pitch + roller + half), 0.5e-3 * (pitch - roller - half)


def kinematics(scene: Scene) -> Kinematics:
    """Epicyclic speeds: cage = inner speed R_i/(R_i + R_o) with a fixed outer ring."""
    outer, inner = raceway_radii(scene)
    shaft = scene.operation.inner_speed_rpm * math.pi / 30.0
    cage = shaft * inner / (inner + outer)
    radius = 0.5e-3 * scene.bearing.roller_diameter_mm
    return Kinematics(cage, -cage * (outer - radius) / radius, (shaft - cage) * inner)


def lubricant(scene: Scene) -> Oil:
    """The oil of the scene at its temperature."""
    oil = oil_at(scene.lubricant.oil, scene.lubricant.temperature_C)
    if scene.lubricant.viscosity_mPas is None:
        return oil
    viscosity = scene.lubricant.viscosity_mPas * 1e-3
    return replace(oil, viscosity=viscosity, viscosity_slope=oil.viscosity_slope * viscosity / oil.viscosity)


def cage_inertia(scene: Scene) -> float:
    """Given, or that of a plain ring between the land and the far rim of the estimated cage body [kg m^2]."""
    if scene.cage.inertia_kg_mm2 is not None:
        return scene.cage.inertia_kg_mm2 * 1e-6
    side = {"outer": -1.0, "inner": 1.0, "roller": 1.0}[scene.cage.guidance]
    rim = scene.bearing.pitch_diameter_mm + side * scene.bearing.roller_diameter_mm / 3.0
    return scene.cage.mass_g * 1e-3 * (scene.land_diameter_mm**2 + rim**2) * 1e-6 / 8.0


def scales(bearing: RollerBearing, scene: Scene) -> Scales:
    """Size of a race contact: the mean load share, or the centrifugal force, or the roller's weight."""
    cage = kinematics(scene).cage_speed
    centrifugal = bearing.roller_mass * 0.5e-3 * scene.bearing.pitch_diameter_mm * cage**2
    load = max(bearing.radial_load / bearing.rollers, centrifugal, 9.81 * bearing.roller_mass)
    stiffness = _palmgren(scene, "roller", "rings", scene.bearing.effective_length_mm)
    approach = (load / stiffness) ** 0.9
    frequency = math.sqrt(10.0 / 9.0 * load / approach / bearing.roller_mass)
    return Scales(load, approach, approach * frequency)


def absolute_tolerance(bearing: RollerBearing, scene: Scene, rtol: float) -> NDArray[np.float64]:
    """Tolerance of each state component: ``rtol`` of the approach or contact speed that the component can make."""
    scale = scales(bearing, scene)
    roller, cage = bearing.roller_radius, 0.5e-3 * scene.bearing.pitch_diameter_mm
    rollers = np.repeat(
        [scale.length, scale.length, scale.speed, scale.speed, scale.speed / roller], bearing.rollers
    )
    positions, speeds = [scale.length, scale.length], [scale.speed, scale.speed]
    bodies = np.array([*positions, scale.length / cage, *speeds, scale.speed / cage, *positions, *speeds])
    return rtol * np.concatenate((rollers, bodies))


def _palmgren(scene: Scene, first: str, second: str, length_mm: float) -> float:
    return palmgren_stiffness(
        equivalent_modulus(scene.material(first), scene.material(second)), length_mm * 1e-3
    )


def _race_contact(scene: Scene) -> LineContact | SlicedLineContact:
    stiffness = _palmgren(scene, "roller", "rings", scene.bearing.effective_length_mm)
    profiled = scene.bearing.roller_profile == "logarithmic"
    slices = scene.model.slices or (PROFILE_SLICES if profiled else 1)
    if slices == 1 and not profiled:
        return LineContact(stiffness)
    length = scene.bearing.effective_length_mm * 1e-3
    relief = np.zeros(slices)
    if profiled:
        relief = logarithmic_relief(
            slice_centres(slices, length), scene.bearing.roller_diameter_mm * 1e-3, length
        )
    return SlicedLineContact(stiffness / slices, relief)


def _race_damping(scene: Scene, roller_mass: float) -> NoDamping | ViscousDamping | HuntCrossleyDamping:
    laws = scene.model
    if laws.race_damping == "viscous":
        return ViscousDamping(laws.race_damping_ratio, roller_mass, 1e6 / laws.race_damping_engagement_um)
    if laws.race_damping == "hunt_crossley":
        return HuntCrossleyDamping(laws.race_damping_alpha_s_m)
    return NoDamping()


def _race_traction(scene: Scene) -> Any:
    table = scene.traction
    if table.model == "four_constant":
        constants = four_constants(table.mu_0, table.mu_m, table.mu_inf, table.u_m_m_s)
        if table.mu_0 > 0.0:
            return BlendedFourConstantTraction(*constants, table.blend_speed_m_s)
        return FourConstantTraction(*constants)
    if table.model == "coulomb":
        return _friction(scene, table.coulomb)
    return NoTraction()


def _friction(scene: Scene, coefficient: float) -> NoTraction | CoulombTraction:
    return CoulombTraction(coefficient, scene.traction.blend_speed_m_s) if coefficient > 0.0 else NoTraction()


def _hunt_crossley(alpha: float) -> NoDamping | HuntCrossleyDamping:
    return HuntCrossleyDamping(alpha) if alpha > 0.0 else NoDamping()


def _rolling(scene: Scene, oil: Oil, race_radius: float, curvature: float) -> Any:
    if scene.model.rolling_resistance == "off":
        return NoRollingResistance()
    roller_radius = 0.5e-3 * scene.bearing.roller_diameter_mm
    # The entrainment speed varies little: the heating of the inlet is that at the kinematic speed.
    heating = aihara_thermal_factor(oil.viscosity_slope, oil.conductivity, kinematics(scene).entrainment)
    return biboulet_houpert(
        oil.viscosity,
        equivalent_modulus(scene.material("roller"), scene.material("rings")),
        1.0 / (1.0 / roller_radius + curvature / race_radius),
        scene.bearing.effective_length_mm * 1e-3,
        heating,
    )


def _pocket(scene: Scene) -> NoPocket | Pocket:
    laws = scene.model
    if laws.pocket == "off":
        return NoPocket()
    stiffness = _palmgren(scene, "roller", "cage", scene.bearing.effective_length_mm)
    bar = laws.pocket_bar_stiffness_N_m
    return Pocket(
        0.5e-3 * scene.cage.pocket_clearance_mm,
        LineContact(stiffness) if bar == "rigid" else LineContactOnBar(stiffness, float(bar)),
        _hunt_crossley(laws.pocket_damping_alpha_s_m),
        _friction(scene, laws.pocket_friction),
    )


def _guide(scene: Scene, oil: Oil) -> NoGuide | OuterGuide | InnerGuide:
    laws, cage = scene.model, scene.cage
    if laws.guide_land == "off" or cage.guidance == "roller":
        return NoGuide()
    clearance = 0.5e-3 * cage.guide_clearance_mm
    land = 0.5e-3 * scene.land_diameter_mm
    journal = land - clearance if cage.guidance == "outer" else land
    film: Any = NoFilm()
    play = clearance
    if laws.guide_land == "film":
        floor = laws.land_film_floor_um * 1e-6
        play -= floor
        film = short_journal_film(
            oil.viscosity, journal, cage.land_width_mm * 1e-3, cage.lands, clearance, floor, laws.land_fill
        )
    dry = DryContact(
        play,
        LineContact(_palmgren(scene, "cage", "rings", cage.lands * cage.land_width_mm)),
        _hunt_crossley(laws.land_damping_alpha_s_m),
        _friction(scene, laws.land_friction),
    )
    return OuterGuide(journal, film, dry) if cage.guidance == "outer" else InnerGuide(journal, film, dry)
