"""The right-hand side once more: plain numpy and loops, straight from the equations, with no kernel of ``rbdyn``.

It differs on purpose in how it gets there. Every contact is a pair of forces at a point in the plane, velocities of
the two surfaces come from rigid-body motion, moments from cross products; the rolling resistance comes from the
equilibrium of the film; the bar in series with a wall is solved by bracketing; the guide film is integrated over
angle. Parameters are worked out from the scene's own numbers.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import brentq

from rbdyn.lubricants import oil_at
from rbdyn.scene import Scene

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(300)


class Body:
    """A rigid body in the plane: centre, velocity, spin, and the force and moment gathered on it."""

    def __init__(self, centre, velocity, spin):
        self.centre, self.velocity, self.spin = np.array(centre), np.array(velocity), float(spin)
        self.force, self.moment = np.zeros(2), 0.0

    def velocity_at(self, point):
        arm = point - self.centre
        return self.velocity + self.spin * np.array([-arm[1], arm[0]])

    def push(self, force, point):
        self.force = self.force + force
        self.moment += cross(point - self.centre, force)


class Twin(NamedTuple):
    """Result: derivative of the state, powers in the order of LOSSES and the shaft, loads."""

    dy: Any
    power: Any
    loads: Any


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def turned(a):
    return np.array([-a[1], a[0]])


def modulus(first, second):
    return 2.0 / sum((1.0 - part.poisson_ratio**2) / part.elastic_modulus for part in (first, second))


def stiffness(scene, first, second, length):
    """Chen et al. 2022, eq 6, solved for the load: Palmgren's line contact [N/m^(10/9)]."""
    return (
        modulus(scene.material(first), scene.material(second))
        / 8.0
        * (1.0 / 0.39) ** (10.0 / 9.0)
        * length ** (8.0 / 9.0)
    )


def race_load(scene, approach):
    """Elastic load of a roller on a race, summed over slices of the profiled roller."""
    drawing = scene.bearing
    length = drawing.effective_length_mm * 1e-3
    k = stiffness(scene, "roller", "rings", length)
    profiled = drawing.roller_profile == "logarithmic"
    slices = scene.model.slices or (31 if profiled else 1)
    load = 0.0
    for s in range(slices):
        x = ((s + 0.5) / slices - 0.5) * length
        relief = (
            -0.00035 * drawing.roller_diameter_mm * 1e-3 * math.log(1.0 - (2.0 * x / length) ** 2)
            if profiled
            else 0.0
        )
        load += k / slices * max(approach - relief, 0.0) ** (10.0 / 9.0)
    return load


def wall_load(scene, approach):
    """Elastic load on a pocket wall: indentation plus bending of the bar make up the approach."""
    k = stiffness(scene, "roller", "cage", scene.bearing.effective_length_mm * 1e-3)
    bar = scene.model.pocket_bar_stiffness_N_m
    if bar == "rigid":
        return k * approach ** (10.0 / 9.0)
    indentation = brentq(
        lambda d: d + k * d ** (10.0 / 9.0) / bar - approach, 0.0, approach, xtol=1e-300, rtol=1e-15
    )
    return k * indentation ** (10.0 / 9.0)


def hunt_crossley(load, alpha, rate):
    return max(load * (1.0 + 1.5 * alpha * rate), 0.0)


def race_damped(scene, load, approach, rate, mass):
    laws = scene.model
    if laws.race_damping == "hunt_crossley":
        return hunt_crossley(load, laws.race_damping_alpha_s_m, rate)
    if laws.race_damping == "off":
        return load
    critical = 2.0 * math.sqrt(10.0 / 9.0 * load / approach * mass)
    share = min(approach / (laws.race_damping_engagement_um * 1e-6), 1.0)
    return max(load + laws.race_damping_ratio * critical * (3.0 * share**2 - 2.0 * share**3) * rate, 0.0)


def gupta_constants(table):
    """A, B, C, D from the peak: x exp(-(x - A)/x) = mu_m - mu_inf, B = (x - A)/u_m, C = B/x."""
    a, peak = table.mu_0 - table.mu_inf, table.mu_m - table.mu_inf
    x = brentq(
        lambda x: x * math.exp(-(x - a) / x) - peak,
        max(a, 1e-4 * abs(a)),
        100.0 * (abs(a) + peak),
        xtol=1e-300,
        rtol=1e-15,
    )
    b = (x - a) / table.u_m_m_s
    return a, b, b / x, table.mu_inf


def race_traction(scene, slip):
    table = scene.traction
    if table.model == "off":
        return 0.0
    if table.model == "coulomb":
        return table.coulomb * math.tanh(slip / table.blend_speed_m_s)
    a, b, c, d = gupta_constants(table)
    speed = abs(slip)
    mu = (a + b * speed) * math.exp(-c * speed) + d
    if table.mu_0 > 0.0:
        return mu * slip / math.hypot(slip, table.blend_speed_m_s)
    return math.copysign(mu, slip)


def rolling_resistance(scene, oil, radius, load, speed):
    """Biboulet and Houpert 2010 with Aihara's heating of the inlet, from the dimensionless groups."""
    if scene.model.rolling_resistance == "off" or load == 0.0:
        return 0.0
    drawing = scene.bearing
    length = drawing.effective_length_mm * 1e-3
    e = modulus(scene.material("roller"), scene.material("rings"))
    u, w = 2.0 * oil.viscosity * speed / (e * radius), load / (length * e * radius)
    regime = 1.4 / 1.45 * math.sqrt(w / math.sqrt(u))
    shaft, (outer, inner) = scene.operation.inner_speed_rpm * math.pi / 30.0, raceways(scene)
    entrainment = shaft * outer * inner / (outer + inner)
    thermal = 1.0 / (1.0 + 0.29 * (oil.viscosity_slope * entrainment**2 / oil.conductivity) ** 0.78)
    return thermal * 1.42 * math.sqrt(u * w) / (1.0 + regime**10) ** 0.1 * e * radius * length


def raceways(scene):
    pitch, roller = scene.bearing.pitch_diameter_mm, scene.bearing.roller_diameter_mm
    clearance = scene.bearing.radial_clearance_mm
    return (pitch + roller + 0.5 * clearance) / 2e3, (pitch - roller - 0.5 * clearance) / 2e3


def race(scene, oil, mass, ring, roller, encloses):
    """One race and one roller. Returns (load, powers in traction, rolling, damping)."""
    race_radius = raceways(scene)[0 if encloses else 1]
    radius = 0.5e-3 * scene.bearing.roller_diameter_mm
    between = roller.centre - ring.centre
    distance = math.hypot(*between)
    outward = between / distance
    to_race = outward if encloses else -outward
    approach = distance + radius - race_radius if encloses else race_radius + radius - distance
    if approach <= 0.0:
        return 0.0, 0.0, 0.0, 0.0
    rate = float((roller.velocity - ring.velocity) @ to_race)
    elastic = race_load(scene, approach)
    load = race_damped(scene, elastic, approach, rate, mass)
    point = roller.centre + to_race * (radius - 0.5 * approach)
    tangent = turned(outward)
    slip = float((ring.velocity_at(point) - roller.velocity_at(point)) @ tangent)
    traction = race_traction(scene, slip) * load
    roller.push(traction * tangent - load * to_race, point)
    ring.push(load * to_race - traction * tangent, point)

    # Rolling resistance, seen from the line of centres: both surfaces drag the film along at mean speed u, and it
    # holds each back with F_R. Pressure on a round surface points to its centre, so its resultants P on roller and
    # ring make no moment of their own. Equilibrium of the film: P_roller + P_ring = 2 F_R; moments about the ring's
    # centre: P_roller distance = 2 F_R lever.
    line_spin = float((roller.velocity - ring.velocity) @ tangent) / distance
    lever = float((point - ring.centre) @ outward)
    roller_surface = (roller.spin - line_spin) * float((point - roller.centre) @ outward)
    mean_speed = 0.5 * (roller_surface + (ring.spin - line_spin) * lever)
    reduced = 1.0 / (1.0 / radius + (-1.0 if encloses else 1.0) / race_radius)
    held = math.copysign(rolling_resistance(scene, oil, reduced, load, abs(mean_speed)), mean_speed)
    pressure = 2.0 * held * lever / distance
    roller.push(-held * tangent, point)
    roller.push(pressure * tangent, roller.centre)
    ring.push(-held * tangent, point)
    ring.push((2.0 * held - pressure) * tangent, ring.centre)
    return load, traction * slip, 2.0 * held * mean_speed, (load - elastic) * rate


def pocket(scene, roller, cage, mid_line):
    """One pocket, both walls. Returns (load, powers in friction, damping)."""
    if scene.model.pocket == "off":
        return 0.0, 0.0, 0.0
    radius = 0.5e-3 * scene.bearing.roller_diameter_mm
    half = 0.5e-3 * scene.cage.pocket_clearance_mm
    for to_wall in (turned(mid_line), -turned(mid_line)):
        approach = float((roller.centre - cage.centre) @ to_wall) - half
        if approach <= 0.0:
            continue
        # The approach is measured against the wall's plane, which turns with the cage about the foot of the centre.
        rate = float((roller.velocity - cage.velocity_at(roller.centre)) @ to_wall)
        elastic = wall_load(scene, approach)
        load = hunt_crossley(elastic, scene.model.pocket_damping_alpha_s_m, rate)
        point = roller.centre + radius * to_wall
        slip = float((cage.velocity_at(point) - roller.velocity_at(point)) @ mid_line)
        friction = scene.model.pocket_friction * math.tanh(slip / scene.traction.blend_speed_m_s) * load
        force = friction * mid_line - load * to_wall
        roller.push(force, point)
        cage.push(-force, point)
        return load, friction * slip, (load - elastic) * rate
    return 0.0, 0.0, 0.0


def guide(scene, oil, cage, ring):
    """Land: film and dry contact. Returns (dry load, powers in film, friction, damping)."""
    laws, drawing = scene.model, scene.cage
    if laws.guide_land == "off" or drawing.guidance == "roller":
        return 0.0, 0.0, 0.0, 0.0
    journal, bush = (cage, ring) if drawing.guidance == "outer" else (ring, cage)
    clearance = 0.5e-3 * drawing.guide_clearance_mm
    land = 0.5e-3 * scene.land_diameter_mm
    radius = land - clearance if drawing.guidance == "outer" else land
    between = journal.centre - bush.centre
    e = math.hypot(*between)
    to_land = between / e
    tangent = turned(to_land)
    relative = journal.velocity - bush.velocity
    closing, whirling = float(relative @ to_land), float(relative @ tangent)
    film_power, play = 0.0, clearance
    if laws.guide_land == "film":
        play = clearance - laws.land_film_floor_um * 1e-6
        epsilon = min(e, play) / clearance
        width, factor = drawing.land_width_mm * 1e-3, drawing.lands * laws.land_fill * oil.viscosity

        # Short bearing, h = c (1 - eps cos): d/dz(h^3/(12 eta) dp/dz) = dh/dt + (sum of spins)/2 dh/dangle. Integrated
        # over the width: -eta L^3/h^3 times the right side, which is positive on exactly half the circle.
        squeeze, wedge = closing, 0.5 * epsilon * clearance * (journal.spin + bush.spin) - whirling
        middle = math.atan2(-wedge, squeeze)
        angle = middle + 0.5 * math.pi * GAUSS_NODES
        film = clearance * (1.0 - epsilon * np.cos(angle))
        pressure = factor * width**3 / film**3 * (squeeze * np.cos(angle) - wedge * np.sin(angle))
        pressed = pressure * radius * 0.5 * math.pi * GAUSS_WEIGHTS
        radial, across = -float(pressed @ np.cos(angle)), -float(pressed @ np.sin(angle))
        shear = factor * 2.0 * math.pi * radius**3 * width * (journal.spin - bush.spin)
        shear /= clearance * math.sqrt(1.0 - epsilon**2)
        force = radial * to_land + across * tangent
        moments = (-shear - 0.5 * e * across, shear - 0.5 * e * across)
        film_power = -float(force @ relative) - moments[0] * journal.spin - moments[1] * bush.spin
        journal.push(force, journal.centre)
        bush.push(-force, bush.centre)
        journal.moment += moments[0]
        bush.moment += moments[1]
    approach = e - play
    if approach <= 0.0:
        return 0.0, film_power, 0.0, 0.0
    elastic = stiffness(scene, "cage", "rings", drawing.lands * drawing.land_width_mm * 1e-3) * approach ** (
        10.0 / 9.0
    )
    load = hunt_crossley(elastic, laws.land_damping_alpha_s_m, closing)
    point = journal.centre + radius * to_land
    slip = float((bush.velocity_at(point) - journal.velocity_at(point)) @ tangent)
    friction = laws.land_friction * math.tanh(slip / scene.traction.blend_speed_m_s) * load
    journal.push(friction * tangent - load * to_land, point)
    bush.push(load * to_land - friction * tangent, point)
    return load, film_power, friction * slip, (load - elastic) * closing


def inertia_of_cage(scene):
    """A plain ring between the land and the far rim: m (D^2 + d^2)/8."""
    if scene.cage.inertia_kg_mm2 is not None:
        return scene.cage.inertia_kg_mm2 * 1e-6
    side = -1.0 if scene.cage.guidance == "outer" else 1.0
    rim = scene.bearing.pitch_diameter_mm + side * scene.bearing.roller_diameter_mm / 3.0
    return scene.cage.mass_g * 1e-3 * (scene.land_diameter_mm**2 + rim**2) * 1e-6 / 8.0


def twin(scene: Scene, y: Any) -> Twin:
    """The derivative of a state, the powers and the largest loads."""
    drawing = scene.bearing
    z = drawing.rollers
    oil = oil_at(scene.lubricant.oil, scene.lubricant.temperature_C)
    diameter, length = drawing.roller_diameter_mm * 1e-3, drawing.roller_length_mm * 1e-3
    mass = scene.material("roller").density * math.pi * diameter**2 / 4.0 * length
    inertia = mass * diameter**2 / 8.0
    (cx, cy, cage_angle, cvx, cvy, cage_spin), (rx, ry, rvx, rvy) = y[5 * z : 5 * z + 6], y[5 * z + 6 :]
    cage = Body((cx, cy), (cvx, cvy), cage_spin)
    shaft = scene.operation.inner_speed_rpm * math.pi / 30.0
    inner, outer = Body((rx, ry), (rvx, rvy), shaft), Body((0.0, 0.0), (0.0, 0.0), 0.0)
    power, loads, dy = np.zeros(11), np.zeros(4), np.zeros(y.size)
    for j in range(z):
        roller = Body(y[[j, z + j]], y[[2 * z + j, 3 * z + j]], y[4 * z + j])
        angle = cage_angle + 2.0 * math.pi * j / z
        wall, friction, damping = pocket(scene, roller, cage, np.array([math.cos(angle), math.sin(angle)]))
        loads[0] = max(loads[0], wall)
        power[4] += friction
        power[5] += damping
        for term, ring, encloses in ((0, outer, True), (1, inner, False)):
            load, slipping, rolling, damping = race(scene, oil, mass, ring, roller, encloses)
            loads[1 + term] = max(loads[1 + term], load)
            power[term] += slipping
            power[2] += rolling
            power[3] += damping
        if scene.model.drag == "cylinder":
            density = scene.lubricant.oil_fraction * oil.density + (1.0 - scene.lubricant.oil_fraction) * 1.2
            area = diameter * length
            speed = math.hypot(*roller.velocity)
            resisted = -0.5 * density * scene.model.drag_coefficient * area * speed * roller.velocity
            roller.push(resisted, roller.centre)
            power[9] -= float(resisted @ roller.velocity)
        dy[[j, z + j]] = roller.velocity
        dy[[2 * z + j, 3 * z + j]] = roller.force / mass
        dy[4 * z + j] = roller.moment / inertia
    loads[3], power[6], power[7], power[8] = guide(
        scene, oil, cage, outer if scene.cage.guidance == "outer" else inner
    )
    power[10] = -inner.moment * shaft
    cage_mass, ring_mass = scene.cage.mass_g * 1e-3, drawing.inner_ring_mass_kg
    load = np.array([scene.operation.radial_load_N, 0.0])
    dy[5 * z : 5 * z + 6] = (
        *cage.velocity,
        cage.spin,
        *(cage.force / cage_mass),
        cage.moment / inertia_of_cage(scene),
    )
    dy[5 * z + 6 :] = (*inner.velocity, *((inner.force + load) / ring_mass))
    return Twin(dy, power, loads)
