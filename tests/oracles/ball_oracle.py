"""Ball bearings in equilibrium once more, to 30 digits and without any code of rbdyn: rolling from velocity vectors, Hertz
contacts by elliptic integrals, forces on every ball and on the ring from a drawing.

Axes of a ball are (axial, radial, along the orbit); with e_z x e_r = e_psi a rotation (w_z, w_r) moves the point (z, r) along
the orbit by w_z r - w_r z. A number context of mpmath does the sums: ``mp`` or, in doubles, ``fp``.
"""

import math

import numpy as np
from mpmath import fp, mp

mp.dps = 40
STICKING, ACROSS = "0.8", "0.2"
SHARES = {"outer": 0, "inner": 1, "half": 0.5}


class Rolling:
    """A ball that rolls on both races without slip, its spin moments in balance with weights ``share`` and 1 - ``share``.

    ``g`` is D/d_m, contact angles stand as (sine, cosine), ring speeds in rad/s. ``orbit`` is w_m, ``axial`` and ``radial``
    the whole rotation of the ball, ``inner_spin, outer_spin`` that about the contact normals against the rings.
    """

    def __init__(self, context, g, share, inner, outer, inner_speed, outer_speed):
        si, ci = inner
        so, co = outer
        # Unknown: orbit speed, axial and radial rotation. Lengths in units of half the pitch diameter.
        slip_outer = (1, g * co, -g * so, outer_speed * (1 + g * co))
        slip_inner = (1, -g * ci, g * si, inner_speed * (1 - g * ci))
        spin = (
            0,
            (1 - share) * so + share * si,
            (1 - share) * co + share * ci,
            (1 - share) * so * outer_speed + share * si * inner_speed,
        )
        self.orbit, self.axial, self.radial = cramer(slip_outer, slip_inner, spin)
        self.outer_slip = self.orbit + g * (self.axial * co - self.radial * so) - slip_outer[3]
        self.inner_slip = self.orbit - g * (self.axial * ci - self.radial * si) - slip_inner[3]
        self.outer_spin = (self.axial - outer_speed) * so + self.radial * co
        self.inner_spin = (self.axial - inner_speed) * si + self.radial * ci


def cramer(*rows):
    """Solution of three equations in three unknowns, the right-hand side in the fourth column."""

    def determinant(*columns):
        a, b, c = ([row[i] for i in columns] for row in rows)
        return (
            a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
        )

    whole = determinant(0, 1, 2)
    return determinant(3, 1, 2) / whole, determinant(0, 3, 2) / whole, determinant(0, 1, 3) / whole


def gradually(context, part):
    """Smooth step from 0 to 1."""
    return context.one if part >= 1 else part * part * (3 - 2 * part)


def held(context, force, limit):
    """What friction of at most ``limit`` leaves of a force."""
    sticking = context.mpf(STICKING)
    used = abs(force) / limit
    if used <= sticking:
        return force
    beyond = (used - sticking) / (1 - sticking)
    return (1 if force > 0 else -1) * limit * (sticking + (1 - sticking) * beyond / (1 + beyond))


class Hertz:
    """Contact of a ball on a race: K of Q = K delta^1.5 and the weight a E/Q^(1/3) of its spin moment."""

    def __init__(self, diameter, factor, gamma, modulus):
        along, across = 2 * gamma / (1 - gamma), 1 / factor
        total = 4 - across + along
        wanted, curvature = (across + along) / total, total / diameter

        def miss(log_k):
            k2 = mp.exp(2 * log_k)
            first, second = mp.ellipk(1 - 1 / k2), mp.ellipe(1 - 1 / k2)
            return ((k2 + 1) * second - 2 * first) / ((k2 - 1) * second) - wanted

        k = mp.exp(mp.findroot(miss, mp.log(10)))
        first, second = mp.ellipk(1 - 1 / k**2), mp.ellipe(1 - 1 / k**2)
        stretch = mp.cbrt(2 * k**2 * second / mp.pi)
        scale = 3 / (curvature * modulus)
        compliance = 2 * first / mp.pi / stretch * scale ** (mp.mpf(2) / 3) * curvature / 2
        self.stiffness = compliance ** mp.mpf("-1.5")
        self.spin_weight = stretch * mp.cbrt(scale) * second


class Bearing:
    """A row of balls from the tables of a scene (``bearing``, ``operation``, ``model``) and its materials."""

    def __init__(self, table, ball, ring, context=mp):
        number = mp.mpf
        self.context = context
        drawing, operation, model = table["bearing"], table["operation"], table.get("model", {})
        self.control = model.get("raceway_control", "outer")
        diameter, pitch = (number(drawing[key]) / 1000 for key in ("ball_diameter_mm", "pitch_diameter_mm"))
        fi, fo = (number(drawing[key]) for key in ("inner_groove_factor", "outer_groove_factor"))
        between = (fi + fo - 1) * diameter
        if "contact_angle_deg" in drawing:
            angle = mp.radians(number(drawing["contact_angle_deg"]))
        else:
            angle = mp.acos(1 - number(drawing["radial_clearance_mm"]) / 1000 / (2 * between))
        gamma = diameter * mp.cos(angle) / pitch
        modulus = 2 / sum((1 - number(m.poisson_ratio) ** 2) / number(m.elastic_modulus) for m in (ball, ring))
        inner, outer = Hertz(diameter, fi, gamma, modulus), Hertz(diameter, fo, -gamma, modulus)
        mass = number(ball.density) * mp.pi * diameter**3 / 6
        w_in, w_out = (number(operation.get(key, 0)) * mp.pi / 30 for key in ("inner_speed_rpm", "outer_speed_rpm"))
        cage = (w_in * (1 - gamma) + w_out * (1 + gamma)) / 2
        values = {
            "diameter": diameter,
            "g": diameter / pitch,
            "reach_i": (fi - number("0.5")) * diameter,
            "reach_o": (fo - number("0.5")) * diameter,
            "k_i": inner.stiffness,
            "k_o": outer.stiffness,
            "weight": inner.spin_weight / outer.spin_weight,
            "axial": between * mp.sin(angle),
            "radial": between * mp.cos(angle),
            "lever": pitch / 2 + (fi - number("0.5")) * diameter * mp.cos(angle),
            "groove": fi * diameter,
            "orbit_mass": mass * pitch / 2,
            "inertia": mass * diameter**2 / 10 if model.get("gyroscopic", True) else number(0),
            "w_in": w_in,
            "w_out": w_out,
            "pull": mass * pitch / 2 * cage**2,
            "light": number(model.get("light_load_share", 0.3)),
            "friction": number(model.get("friction_limit", 0.3)),
        }
        for name, value in values.items():
            setattr(self, name, context.mpf(value))
        self.size = drawing["balls"]
        self.azimuth = [2 * context.pi * j / self.size for j in range(self.size)]

    def ball(self, a_axial, a_radial, x, y, reach_i=None, reach_o=None):
        """(residual axial, radial), (ring axial, radial, couple), loads, F_c and M_g of a ball at (x, y)."""
        context = self.context
        reach_i, reach_o = (self.reach_i if reach_i is None else reach_i, self.reach_o if reach_o is None else reach_o)
        u, v = a_axial - x, a_radial - y
        length_i, length_o = context.sqrt(u * u + v * v), context.sqrt(x * x + y * y)
        si, ci, so, co = u / length_i, v / length_i, x / length_o, y / length_o
        di, do = max(length_i - reach_i, context.zero), max(length_o - reach_o, context.zero)
        qi, qo = self.k_i * di * context.sqrt(di), self.k_o * do * context.sqrt(do)
        pull, moment, ti, to = self.pull, context.zero, context.zero, context.zero
        if self.control != "common_cage" and qi > 0 and qo > 0 and ci > 0:
            share = SHARES.get(self.control)
            if share is None:
                # Spin moments go as Q a E, and a as Q^(1/3).
                four_thirds = context.mpf(4) / 3
                inner, outer = self.weight * qi**four_thirds, qo**four_thirds
                share = inner / (inner + outer)
            motion = Rolling(context, self.g, share, (si, ci), (so, co), self.w_in, self.w_out)
            follow = gradually(context, ci / context.mpf(ACROSS))
            if self.pull > 0:
                follow *= gradually(context, qi / (self.light * self.pull))
            pull += follow * (self.orbit_mass * motion.orbit**2 - self.pull)
            # The friction turns the ball's momentum along with the orbit: the couple on the ball is J w_m w_r about e_psi,
            # and forces T on both contacts turn it by -(T_i + T_o) D/2.
            moment = -follow * self.inertia * motion.orbit * motion.radial
            ti = held(context, 2 * share * moment / self.diameter, self.friction * qi)
            to = held(context, 2 * (1 - share) * moment / self.diameter, self.friction * qo)
        ring = (qi * si - ti * ci, qi * ci + ti * si, self.groove * ti)
        residual = (ring[0] - qo * so + to * co, ring[1] - qo * co - to * so + pull)
        return residual, ring, (qi, qo), (pull, moment)

    def place(self, q, j):
        """Inner groove centre at ball j for the displacement q, tilts in rad."""
        s, c = self.context.sin(self.azimuth[j]), self.context.cos(self.azimuth[j])
        return self.axial + q[2] + self.lever * (q[3] * s - q[4] * c), self.radial + q[0] * c + q[1] * s

    def residual(self, q, balls, load):
        """All equations: what the ring lacks (5), then both of each ball [N, N m]."""
        lacking, rest = list(load), []
        for j, (x, y) in enumerate(balls):
            forces, ring, _, _ = self.ball(*self.place(q, j), x, y)
            s, c = self.context.sin(self.azimuth[j]), self.context.cos(self.azimuth[j])
            turn = self.lever * ring[0] + ring[2]
            for i, taken in enumerate((ring[1] * c, ring[1] * s, ring[0], turn * s, -turn * c)):
                lacking[i] -= taken
            rest.extend(forces)
        return lacking + rest


def root(exact, rough, q, balls, load, free, rounds=12):
    """Root of all equations near (q, balls) and its largest residual.

    Newton's steps with the Jacobian of ``rough``, the same bearing in doubles: each gains the digits to which that is true,
    until those of ``exact`` are used up. ``free``: which displacements the load rules.
    """
    size, h = exact.size, 1e-10
    unknown = np.concatenate([q, np.ravel(balls)]).astype(float)
    keep = np.concatenate((np.asarray(free, bool), np.ones(2 * size, bool)))

    def lacking(bearing, values):
        values = list(values)
        pairs = list(zip(values[5::2], values[6::2], strict=True))
        return bearing.residual(values[:5], pairs, [bearing.context.mpf(part) for part in load])

    jacobian = np.zeros((5 + 2 * size, 5 + 2 * size))
    for i in np.flatnonzero(keep):
        step = np.zeros(unknown.size)
        step[i] = h
        ahead, behind = (np.array(lacking(rough, unknown + side * step)) for side in (1, -1))
        jacobian[:, i] = (ahead - behind) / (2 * h)
    inverse = np.linalg.inv(jacobian[np.ix_(keep, keep)])
    values = [mp.mpf(value) for value in unknown]
    for _ in range(rounds):
        rest = [part for part, wanted in zip(lacking(exact, values), keep, strict=True) if wanted]
        worst = max(abs(part) for part in rest)
        if worst < mp.mpf(10) ** -30:
            break
        # In doubles the step keeps its digits whatever its size.
        step = inverse @ np.array([float(part / worst) for part in rest])
        for i, change in zip(np.flatnonzero(keep), step, strict=True):
            values[i] -= worst * mp.mpf(change)
    return values[:5], list(zip(values[5::2], values[6::2], strict=True)), worst


def derivatives(function, *arguments):
    """Derivatives of a function with many values by each argument, by differences with 20 figures to spare."""
    h = mp.mpf(10) ** -13
    columns = []
    for i in range(len(arguments)):
        ahead, behind = ([*arguments] for _ in range(2))
        step = h * max(abs(arguments[i]), mp.mpf(10) ** -4)
        ahead[i] += step
        behind[i] -= step
        columns.append([float((a - b) / (2 * step)) for a, b in zip(function(*ahead), function(*behind), strict=True)])
    return np.array(columns).T


def doubled(table, ball, ring):
    """The bearing to 40 digits and in doubles."""
    return Bearing(table, ball, ring), Bearing(table, ball, ring, fp)


def angles(a_axial, a_radial, x, y):
    """Inner and outer contact angle in doubles."""
    return math.atan2(a_axial - x, a_radial - y), math.atan2(x, y)
