"""The right-hand side once more: plain numpy and loops, straight from the equations, with no kernel of ``rbdyn``.

It differs on purpose in how it gets there. Every contact is a pair of forces at a point in the plane, velocities of
the two surfaces come from rigid-body motion, moments from cross products; the force of a wavy race is virtual work by
a complex step; films carry no moment of their own; an unbalanced cage moves about its centre of mass; the guide
film is integrated over angle. The scalar laws stand in ``numpy_twin_laws``.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from film_oracle import quadrature_shape
from numpy_twin_laws import (
    alpha_of,
    elastic_traction,
    hunt_crossley,
    oil_of,
    open_film,
    palmgren_stiffness,
    race_damped,
    race_load,
    race_traction,
    raceways,
    roller_errors,
    roller_mass,
    rolling_resistance,
    scheduled,
    wall_load,
)

from rbdyn.scene import Scene

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(300)
NAMES = (
    "outer_race_traction", "inner_race_traction", "rolling_resistance", "race_damping", "pocket_friction",
    "pocket_damping", "pocket_film", "land_film", "land_friction", "land_damping", "roller_drag", "support_damping",
    "shaft", "load", "inner_rolling", "pocket_force", "pocket_squeeze",
)  # fmt: skip
POWERS = {name: index for index, name in enumerate(NAMES)}


class Body:
    """A rigid body in the plane: centre, velocity, spin, and the force and moment gathered on it."""

    def __init__(self, centre, velocity, spin, angle=0.0):
        self.centre, self.velocity, self.spin = np.array(centre), np.array(velocity), float(spin)
        self.angle, self.force, self.moment = angle, np.zeros(2), 0.0

    def velocity_at(self, point):
        return self.velocity + self.spin * turned(point - self.centre)

    def push(self, force, point):
        self.force = self.force + force
        self.moment += cross(point - self.centre, force)


class Twin(NamedTuple):
    """Result: derivative of the state, powers in the order of ``POWERS``, largest loads."""

    dy: Any
    power: Any
    loads: Any


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def turned(a):
    return np.array([-a[1], a[0]])


def race_overlap(scene, encloses, radius, between, ring_angle):
    """Overlap of a roller's middle with a race whose harmonics have turned by ``ring_angle``; complex as well."""
    surface = raceways(scene)[0 if encloses else 1]
    # The azimuth is counted from the real place, as the arctangent of two arguments knows no complex ones.
    near = np.real(between)
    azimuth = math.atan2(near[1], near[0]) + np.arctan(cross(near, between) / (near @ between))
    for harmonic in scene.bearing.outer_waviness if encloses else scene.bearing.inner_waviness:
        phase = math.radians(harmonic.phase_deg)
        surface += harmonic.amplitude_um * 1e-6 * np.cos(harmonic.order * (azimuth - ring_angle - phase))
    distance = np.sqrt(between @ between)
    return distance + radius - surface if encloses else surface + radius - distance


def race(scene, mass, ring, roller, radius, encloses, coefficient):
    """One race and one roller. Returns (load, powers in traction, rolling, damping, rate of the traction coefficient)."""
    between = roller.centre - ring.centre
    distance = math.hypot(*between)
    outward = between / distance
    to_race, tangent = (outward if encloses else -outward), turned(outward)

    def overlap(shift, turn):
        return race_overlap(scene, encloses, radius, between + shift, ring.angle + turn)

    middle = float(overlap(np.zeros(2), 0.0))
    elastic, stiffness, approach, lean = race_load(scene, encloses, middle, math.atan2(between[1], between[0]))
    film = (0.0, 0.0)
    if scene.model.open_contact_film and not encloses and middle < 0.0:
        film = open_contact(scene, ring, roller, radius, -middle)
    if elastic == 0.0:
        return 0.0, *film, 0.0, elastic_traction(scene, 0.0, abs, coefficient, 0.0, 0.0)[1]
    if scene.bearing.outer_waviness if encloses else scene.bearing.inner_waviness:
        # Virtual work: the load times how the overlap changes with the centre and with the angle of the ring, each by
        # a step of 1e-30 along the imaginary axis, which loses no digits.
        gradient = np.array([overlap(1e-30j * axis, 0.0).imag / 1e-30 for axis in np.eye(2)])
        by_angle = overlap(np.zeros(2), 1e-30j).imag / 1e-30
    else:
        gradient, by_angle = to_race, 0.0
    gradient = gradient + lean / distance * tangent
    rate = float((roller.velocity - ring.velocity) @ gradient) + by_angle * ring.spin
    load = race_damped(scene, elastic, stiffness, approach, rate, mass)
    roller.push(-load * gradient, roller.centre)
    ring.push(load * gradient, ring.centre)
    ring.moment -= load * by_angle

    point = roller.centre + to_race * (radius - 0.5 * approach)
    slip = float((ring.velocity_at(point) - roller.velocity_at(point)) @ tangent)
    # Rolling resistance, seen from the line of centres: both surfaces drag the film along at mean speed u, and it
    # holds each back with F_R. Pressure on a round surface points to its centre, so its resultants P on roller and
    # ring make no moment of their own. Equilibrium of the film: P_roller + P_ring = 2 F_R; moments about the ring's
    # centre: P_roller distance = 2 F_R lever.
    line_spin = float((roller.velocity - ring.velocity) @ tangent) / distance
    lever = float((point - ring.centre) @ outward)
    roller_surface = (roller.spin - line_spin) * float((point - roller.centre) @ outward)
    mean_speed = 0.5 * (roller_surface + (ring.spin - line_spin) * lever)

    def curve(speed):
        return race_traction(scene, encloses, speed, load)

    acting, following = elastic_traction(scene, load, curve, coefficient, slip, stiffness)
    traction = acting * load
    roller.push(traction * tangent, point)
    ring.push(-traction * tangent, point)
    held = math.copysign(rolling_resistance(scene, encloses, load, abs(mean_speed)), mean_speed)
    pressure = 2.0 * held * lever / distance
    roller.push(-held * tangent, point)
    roller.push(pressure * tangent, roller.centre)
    ring.push(-held * tangent, point)
    ring.push((2.0 * held - pressure) * tangent, ring.centre)
    return load, traction * slip + film[0], 2.0 * held * mean_speed + film[1], (load - elastic) * rate, following


def open_contact(scene, ring, roller, radius, gap):
    """Film between the inner ring and a roller that does not touch it. Returns its powers by sliding and by rolling."""
    between = roller.centre - ring.centre
    distance = math.hypot(*between)
    outward = between / distance
    tangent, point = turned(outward), roller.centre - radius * outward
    rolling, sliding = open_film(scene, gap)
    slip = float((ring.velocity_at(point) - roller.velocity_at(point)) @ tangent)
    roller.push(sliding * slip * tangent, point)
    ring.push(-sliding * slip * tangent, point)
    line_spin = float((roller.velocity - ring.velocity) @ tangent) / distance
    mean_speed = 0.5 * ((ring.spin - line_spin) * (distance - radius) - (roller.spin - line_spin) * radius)
    held = rolling * mean_speed
    # As under load: shear holds both surfaces back, pressure on each points to its centre.
    pressure = 2.0 * held * (distance - radius) / distance
    roller.push(-held * tangent, point)
    roller.push(pressure * tangent, roller.centre)
    ring.push(-held * tangent, point)
    ring.push((2.0 * held - pressure) * tangent, ring.centre)
    return sliding * slip**2, 2.0 * held * mean_speed


def touch(scene, roller, cage, point, to_wall, along, approach):
    """Dry contact of a roller with a plane of the cage. Returns (load, powers in friction, damping)."""
    if approach <= 0.0:
        return 0.0, 0.0, 0.0
    # The approach is measured against the plane, which turns with the cage about the foot of the roller's centre.
    rate = float((roller.velocity - cage.velocity_at(roller.centre)) @ to_wall)
    elastic = wall_load(scene, approach)
    load = hunt_crossley(elastic, alpha_of(scene, "pocket"), rate)
    slip = float((cage.velocity_at(point) - roller.velocity_at(point)) @ along)
    friction = scene.model.pocket_friction * math.tanh(slip / scene.traction.blend_speed_m_s) * load
    force = friction * along - load * to_wall
    roller.push(force, point)
    cage.push(-force, point)
    return load, friction * slip, (load - elastic) * rate


def film_on_wall(scene, roller, cage, point, to_wall, along, gap):
    """Rigid cylinder on a plane in isoviscous oil, seen from axes that turn with the plane. Returns (push, powers lost, by closing)."""
    laws = scene.model
    radius = 0.5e-3 * scene.bearing.roller_diameter_mm
    h = max(gap, laws.pocket_film_floor_um * 1e-6)
    length = scene.cage.pocket_contact_length_mm or scene.bearing.roller_length_mm
    weight = laws.pocket_fill * oil_of(scene).viscosity * length * 1e-3

    def seen(body, place):
        """Velocity of a body at a place, less that of the roller's centre, in axes that turn with the cage."""
        return float((body.velocity_at(place) - roller.velocity - cage.spin * turned(place - roller.centre)) @ along)

    round_speed, plane_speed = seen(roller, point), seen(cage, point)
    entrainment = 0.5 * (round_speed + plane_speed)
    closing = float((roller.velocity - cage.velocity_at(roller.centre)) @ to_wall)
    slender = math.sqrt(2.0 * radius / h)
    pressed, rolled, sheared = quadrature_shape(entrainment, slender * closing)
    push = 24.0 * weight * radius / h * pressed
    couette = weight * slender * sheared * (plane_speed - round_speed)
    held = 6.0 * weight * slender * rolled

    film = Body(cage.centre, (0.0, 0.0), 0.0)
    before = roller.force, roller.moment
    for force, place in (
        (-push * to_wall, roller.centre),
        ((couette - held) * along, point),
        (2.0 * held * along, roller.centre),
    ):
        roller.push(force, place)
        film.push(-force, place)
    cage.force, cage.moment = cage.force + film.force, cage.moment + film.moment
    force, moment = roller.force - before[0], roller.moment - before[1]
    lost = -float(force @ roller.velocity - force @ cage.velocity)
    return push, lost - moment * roller.spin - film.moment * cage.spin, push * closing


def pocket(scene, roller, cage, radius, mid_line):
    """One pocket: walls, films, lips. Returns (force on a wall, contact load, powers in friction, damping, film, squeeze)."""
    if scene.model.pocket == "off":
        return np.zeros(6)
    # Pocket and lips are cut for the nominal roller.
    larger = radius - 0.5e-3 * scene.bearing.roller_diameter_mm
    half, laws, result = 0.5 * scene.pocket_clearance_m - larger, scene.model, np.zeros(6)
    floor = laws.pocket_film_floor_um * 1e-6 if laws.pocket_film else 0.0
    for to_wall in (turned(mid_line), -turned(mid_line)):
        gap = half - float((roller.centre - cage.centre) @ to_wall)
        point = roller.centre + radius * to_wall
        load, friction, damping = touch(scene, roller, cage, point, to_wall, mid_line, floor - gap)
        push, film, squeeze = 0.0, 0.0, 0.0
        if laws.pocket_film:
            push, film, squeeze = film_on_wall(scene, roller, cage, point, to_wall, mid_line, gap)
        on_wall, contact = max(result[0], load + push), max(result[1], load)
        result = np.array((on_wall, contact, *np.add(result[2:], (friction, damping, film, squeeze))))
    if scene.cage.lip_clearance_mm is not None:
        play, orbit = 0.5 * scene.lip_clearance_m - larger, 0.5 * sum(raceways(scene))
        for side in (1.0, -1.0):
            height = side * (float((roller.centre - cage.centre) @ mid_line) - orbit)
            point = roller.centre + side * radius * mid_line
            load, friction, damping = touch(
                scene, roller, cage, point, side * mid_line, turned(mid_line), height - play
            )
            result = np.array((*np.maximum(result[:2], load), *np.add(result[2:], (friction, damping, 0.0, 0.0))))
    return result


def guide(scene, cage, ring):
    """Land: film and dry contact. Returns (dry load, powers in film, friction, damping)."""
    laws, drawing = scene.model, scene.cage
    if laws.guide_land == "off" or drawing.guidance == "roller":
        return 0.0, 0.0, 0.0, 0.0
    journal, bush = (cage, ring) if drawing.guidance == "outer" else (ring, cage)
    clearance = 0.5 * scene.guide_play_m
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
        width, factor = drawing.land_width_mm * 1e-3, drawing.lands * laws.land_fill * oil_of(scene).viscosity

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
    length = drawing.lands * drawing.land_width_mm * 1e-3
    elastic = palmgren_stiffness(scene, "cage", "rings", length) * approach ** (10.0 / 9.0)
    load = hunt_crossley(elastic, alpha_of(scene, "land"), closing)
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


def cage_accelerations(scene, cage, gravity):
    """Newton and Euler about the centre of mass, then back to the geometric centre as a rigid body."""
    mass = scene.cage.mass_g * 1e-3
    offset = scene.cage.imbalance_um * 1e-6 * np.array([math.cos(cage.angle), math.sin(cage.angle)])
    spin_up = (cage.moment - cross(offset, cage.force)) / inertia_of_cage(scene)
    acceleration = cage.force / mass + gravity
    return acceleration - spin_up * turned(offset) + cage.spin**2 * offset, spin_up


def twin(scene: Scene, y: Any) -> Twin:
    """The derivative of a state, the powers and the largest loads."""
    drawing, operation, support = scene.bearing, scene.operation, scene.support
    z = drawing.rollers
    oil, radii, mass = oil_of(scene), roller_errors(scene), roller_mass(scene)
    inertia = mass * (drawing.roller_diameter_mm * 1e-3) ** 2 / 8.0
    down = math.radians(operation.gravity_direction_deg)
    gravity = operation.gravity_m_s2 * np.array([math.cos(down), math.sin(down)])

    elastic = scene.traction.elasticity
    coefficients = y[-2 * z :].reshape(2, z) if elastic else np.zeros((2, z))
    rest = list(y[5 * z + 10 : -2 * z] if elastic else y[5 * z + 10 :])
    ring = [rest.pop(0) for _ in range(4)] if support is not None else [0.0] * 4
    clocked = len(rest) == 3
    time, inner_angle, outer_angle = rest if clocked else (0.0, 0.0, 0.0)
    shaft = scheduled(scene, "inner_speed_rpm", time) * math.pi / 30.0
    cage_state, inner_state = y[5 * z : 5 * z + 6], y[5 * z + 6 : 5 * z + 10]
    cage = Body(cage_state[:2], cage_state[3:5], cage_state[5], cage_state[2])
    inner = Body(inner_state[:2], inner_state[2:], shaft, inner_angle)
    outer = Body(ring[:2], ring[2:], operation.outer_speed_rpm * math.pi / 30.0, outer_angle)

    power, loads, dy = np.zeros(len(POWERS)), np.zeros(5), np.zeros(y.size)
    following = np.zeros((2, z))
    for j in range(z):
        roller = Body(y[[j, z + j]], y[[2 * z + j, 3 * z + j]], y[4 * z + j])
        angle = cage.angle + 2.0 * math.pi * j / z
        wall = pocket(scene, roller, cage, radii[j], np.array([math.cos(angle), math.sin(angle)]))
        loads[[0, 4]] = np.maximum(loads[[0, 4]], wall[:2])
        power[4:7] += wall[2:5]
        power[[POWERS["pocket_force"], POWERS["pocket_squeeze"]]] += wall[0], wall[5]
        for term, body, encloses in ((0, outer, True), (1, inner, False)):
            contact = race(scene, mass, body, roller, radii[j], encloses, coefficients[term, j])
            load, slipping, rolling, damping, following[term, j] = contact
            loads[1 + term] = max(loads[1 + term], load)
            power[[term, 2, 3]] += slipping, rolling, damping
            power[POWERS["inner_rolling"]] += 0.0 if encloses else rolling
        if scene.model.drag == "cylinder":
            density = scene.lubricant.oil_fraction * oil.density + (1.0 - scene.lubricant.oil_fraction) * 1.2
            area = drawing.roller_diameter_mm * drawing.roller_length_mm * 1e-6
            speed = math.hypot(*roller.velocity)
            resisted = -0.5 * density * scene.model.drag_coefficient * area * speed * roller.velocity
            roller.push(resisted, roller.centre)
            power[POWERS["roller_drag"]] -= float(resisted @ roller.velocity)
        dy[[j, z + j]] = roller.velocity
        dy[[2 * z + j, 3 * z + j]] = roller.force / mass + gravity
        dy[4 * z + j] = roller.moment / inertia
    loads[3], *land = guide(scene, cage, outer if scene.cage.guidance == "outer" else inner)
    power[7:10] = land

    whirling = operation.rotating_load_N + operation.unbalance_g_mm * 1e-6 * shaft**2
    load = np.array([scheduled(scene, "radial_load_N", time), 0.0])
    load = load + whirling * np.array([math.cos(inner_angle), math.sin(inner_angle)])
    power[POWERS["shaft"]] = -inner.moment * inner.spin - outer.moment * outer.spin
    power[POWERS["load"]] = float(load @ inner.velocity) if clocked else 0.0
    acceleration, spin_up = cage_accelerations(scene, cage, gravity)
    dy[5 * z : 5 * z + 6] = (*cage.velocity, cage.spin, *acceleration, spin_up)
    inner_acceleration = (inner.force + load) / drawing.inner_ring_mass_kg + gravity
    dy[5 * z + 6 : 5 * z + 10] = (*inner.velocity, *inner_acceleration)
    extra = []
    if support is not None:
        held = outer.force - support.stiffness_N_m * outer.centre - support.damping_N_s_m * outer.velocity
        extra = [*outer.velocity, *(held / support.outer_ring_mass_kg + gravity)]
        power[POWERS["support_damping"]] = support.damping_N_s_m * float(outer.velocity @ outer.velocity)
    extra += [1.0, inner.spin, outer.spin] if clocked else []
    dy[5 * z + 10 :] = [*extra, *following.ravel()] if elastic else extra
    return Twin(dy, power, loads)
