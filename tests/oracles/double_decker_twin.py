"""The 4Z and more equations of a double-decker bearing written out plainly, in numpy, from the drawing alone.

An oracle for tests: no code shared with ``rbdyn.quasistatic``. Hertz by complete elliptic integrals of mpmath; orbit and spin of
a ball from the two conditions of rolling, solved as a linear system for each ball.
"""

import functools
import math
from dataclasses import dataclass

import mpmath
import numpy as np

SHARES = {"outer": 0.0, "inner": 1.0, "half": 0.5, "common_cage": 0.0}


@dataclass(frozen=True)
class Drawing:
    """One row: numbers of the drawing and of the operating point, SI."""

    balls: int
    diameter: float
    pitch: float
    inner_factor: float
    outer_factor: float
    angle: float
    inner_speed: float
    outer_speed: float
    density: float
    inner_modulus: float
    outer_modulus: float
    inner_share: float = 0.0
    gyroscopic: bool = True
    growth: float = 0.0
    light_load_share: float = 0.3


def drawings(scene):
    """Both rows of a double-decker scene whose outer ring stands."""
    turning, bearing = scene.operation.inner_speed_rpm * math.pi / 30.0, scene.bearing
    pitches = [row.pitch_diameter_mm for row in (bearing.inner, bearing.outer)]
    middle = turning * pitches[0] ** 4.5 / (pitches[0] ** 4.5 + pitches[1] ** 4.5)
    rings = [scene.material(f"{part}_ring") for part in ("inner", "middle", "outer")]
    ball = scene.material("ball")
    touch = [
        [1e-3 * (row.pitch_diameter_mm + side * row.ball_diameter_mm * math.cos(row.contact_angle)) / 2 for side in (-1, 1)]
        for row in (bearing.inner, bearing.outer)
    ]  # fmt: skip
    growths = [0.0, 0.0]
    if scene.model.ring_expansion:
        bore = 0.5e-3 * bearing.inner.bore_mm
        lower = spin_growth(rings[1], middle, touch[0][1], touch[1][0], touch[0][1])
        growths[0] = spin_growth(rings[0], turning, bore, touch[0][0], touch[0][0]) - lower
        growths[1] = spin_growth(rings[1], middle, touch[0][1], touch[1][0], touch[1][0])
    return [
        Drawing(
            row.balls, 1e-3 * row.ball_diameter_mm, 1e-3 * row.pitch_diameter_mm, row.inner_groove_factor,
            row.outer_groove_factor, row.contact_angle, *speeds, ball.density,
            *(2.0 / sum((1.0 - part.poisson_ratio**2) / part.elastic_modulus for part in (ball, ring)) for ring in pair),
            SHARES[scene.model.raceway_control], scene.model.raceway_control != "common_cage", growth,
            scene.model.light_load_share,
        )
        for row, speeds, pair, growth in zip(
            (bearing.inner, bearing.outer), ((turning, middle), (middle, 0.0)), (rings[:2], rings[1:]), growths, strict=True
        )
    ]  # fmt: skip


def spin_growth(material, speed, a, b, r):
    """Radial growth of a free ring a to b at r, general form of the rotating disk."""
    n = material.poisson_ratio
    terms = (3 + n) * (1 - n) * (a**2 + b**2) + (1 + n) * (3 + n) * a**2 * b**2 / r**2 - (1 - n**2) * r**2
    return material.density * speed**2 * r / (8.0 * material.elastic_modulus) * terms


@functools.cache
def hertz(diameter, factor, side, modulus):
    """K of Q = K delta^1.5: ``side`` = +g/(1-g) for an inner race, -g/(1+g) for an outer one; ``modulus`` = E'."""
    groove = 1.0 / (factor * diameter)
    along = 2.0 / diameter + 2.0 * side / diameter
    across = 2.0 / diameter - groove
    total, difference = along + across, abs(along - across)

    def mismatch(k):
        m = 1 - 1 / k**2
        e, f = mpmath.ellipe(m), mpmath.ellipk(m)
        return ((k**2 + 1) * e - 2 * f) / ((k**2 - 1) * e) - difference / total

    k = mpmath.findroot(mismatch, (1.5, 60.0), solver="anderson", tol=1e-13)
    m = 1 - 1 / k**2
    e, f = mpmath.ellipe(m), mpmath.ellipk(m)
    # Harris: delta = delta* [3 Q/(2 sum rho) 2/E']^(2/3) sum rho/2, delta* = 2F/pi [pi/(2 k^2 E)]^(1/3).
    star = 2 * f / mpmath.pi * (mpmath.pi / (2 * k**2 * e)) ** (mpmath.mpf(1) / 3)
    unit = star * (3 / (total * modulus)) ** (mpmath.mpf(2) / 3) * total / 2
    return float(unit ** (-mpmath.mpf(3) / 2))


def orbit(row, inner_angle, outer_angle):
    """Orbit speed and spin of a ball that rolls on both races, with its pitch angle beta [rad/s, rad/s, rad]."""
    g = row.diameter / row.pitch
    # Inner and outer share of the spin moments, each over the spin that beta leaves on its race.
    wi, wo = row.inner_share, 1.0 - row.inner_share
    p, n = 1.0 + g * math.cos(outer_angle), 1.0 - g * math.cos(inner_angle)
    rise = wo * math.sin(outer_angle) / p + wi * math.sin(inner_angle) / n
    run = wo * (math.cos(outer_angle) + g) / p + wi * (math.cos(inner_angle) - g) / n
    beta = math.atan2(rise, run)
    ro = 0.5 * (row.pitch + row.diameter * math.cos(outer_angle))
    ri = 0.5 * (row.pitch - row.diameter * math.cos(inner_angle))
    half = 0.5 * row.diameter
    # (w_o - w_m) r_o = w_R D/2 cos(a_o - b), (w_i - w_m) r_i = -w_R D/2 cos(a_i - b).
    matrix = [[ro, half * math.cos(outer_angle - beta)], [ri, -half * math.cos(inner_angle - beta)]]
    orbiting, spin = np.linalg.solve(matrix, [row.outer_speed * ro, row.inner_speed * ri])
    return orbiting, spin, beta


def row_forces(row, displacement, balls):
    """Residual (Z, 2) of the balls [N]; force and moment (5,) that the inner ring needs; those put on the outer ring.

    ``displacement``: of the inner against the outer ring. Moments about the middles of the circles of groove centres.
    """
    d, g = row.diameter, row.diameter * math.cos(row.angle) / row.pitch
    gap = (row.inner_factor + row.outer_factor - 1.0) * d
    inner_lever = 0.5 * row.pitch + (row.inner_factor - 0.5) * d * math.cos(row.angle)
    outer_lever = 0.5 * row.pitch - (row.outer_factor - 0.5) * d * math.cos(row.angle)
    ki = hertz(d, row.inner_factor, g / (1.0 - g), row.inner_modulus)
    ko = hertz(d, row.outer_factor, -g / (1.0 + g), row.outer_modulus)
    mass = row.density * math.pi * d**3 / 6.0
    cage = 0.5 * (row.inner_speed * (1.0 - g) + row.outer_speed * (1.0 + g))
    light = row.light_load_share * 0.5 * mass * row.pitch * cage**2
    residual, inner, outer = np.zeros((row.balls, 2)), np.zeros(5), np.zeros(5)
    for j, (x, y) in enumerate(balls):
        psi = 2.0 * math.pi * j / row.balls
        c, s = math.cos(psi), math.sin(psi)
        a1 = gap * math.sin(row.angle) + displacement[2]
        a1 += inner_lever * (displacement[3] * s - displacement[4] * c)
        a2 = gap * math.cos(row.angle) + row.growth + displacement[0] * c + displacement[1] * s
        ai, ao = math.atan2(a1 - x, a2 - y), math.atan2(x, y)
        qi = ki * max(math.hypot(a1 - x, a2 - y) - (row.inner_factor - 0.5) * d, 0.0) ** 1.5
        qo = ko * max(math.hypot(x, y) - (row.outer_factor - 0.5) * d, 0.0) ** 1.5
        pull, moment = 0.5 * mass * row.pitch * cage**2, 0.0
        if row.gyroscopic:
            orbiting, spin, beta = orbit(row, ai, ao)
            part = min(qi / light, 1.0)
            follow = part**2 * (3.0 - 2.0 * part)
            pull += follow * (0.5 * mass * row.pitch * orbiting**2 - pull)
            moment = follow * mass * d**2 / 10.0 * spin * orbiting * math.sin(beta)
        ti, to = (2.0 * share * moment / d for share in (row.inner_share, 1.0 - row.inner_share))
        on_ball = qi * math.sin(ai) - ti * math.cos(ai), qi * math.cos(ai) + ti * math.sin(ai)
        on_outer = qo * math.sin(ao) - to * math.cos(ao), qo * math.cos(ao) + to * math.sin(ao)
        residual[j] = on_ball[0] - on_outer[0], on_ball[1] - on_outer[1] + pull
        inner_turn = inner_lever * on_ball[0] + row.inner_factor * d * ti
        outer_turn = outer_lever * on_outer[0] - row.outer_factor * d * to
        inner += [on_ball[1] * c, on_ball[1] * s, on_ball[0], inner_turn * s, -inner_turn * c]
        outer += [on_outer[1] * c, on_outer[1] * s, on_outer[0], outer_turn * s, -outer_turn * c]
    return residual, inner, outer


def residuals(inner_row, outer_row, offset, inner_ring, middle_ring, inner_balls, outer_balls, load):
    """All equations: balls of both rows [N], inner ring and middle ring (5,) each [N, N m].

    ``inner_ring, middle_ring``: displacements (5,) against the outer ring, of the planes of their (inner) groove centres.
    ``offset``: axial distance of the inner row's ball plane from the outer row's.
    """
    sin_i, sin_o = math.sin(inner_row.angle), math.sin(outer_row.angle)
    # Planes, from the ball plane of the outer row.
    plane_0 = offset + (inner_row.inner_factor - 0.5) * inner_row.diameter * sin_i
    plane_1 = offset - (inner_row.outer_factor - 0.5) * inner_row.diameter * sin_i
    plane_2 = (outer_row.inner_factor - 0.5) * outer_row.diameter * sin_o
    there = np.array(middle_ring, float)
    there[:2] += (plane_0 - plane_2) * np.array([middle_ring[4], -middle_ring[3]])
    inner_left, needs, puts = row_forces(inner_row, np.asarray(inner_ring) - there, inner_balls)
    outer_left, holds, _ = row_forces(outer_row, middle_ring, outer_balls)
    puts = puts.copy()
    puts[3:] += (plane_1 - plane_2) * np.array([-puts[1], puts[0]])
    return inner_left, outer_left, np.asarray(load) - needs, puts - holds
