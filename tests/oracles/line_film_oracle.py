"""Reynolds's equation in the inlet of a line contact, solved three ways and without any code of rbdyn.

Rigid cylinders and Grubin's inlet by quadrature, an isothermal elastohydrodynamic contact by Newton's method. All give the
rolling force per surface, 1/2 int (h - h_m) p' dx, and start the pressure at a meniscus. Moes's numbers M = W/sqrt(U) and
L = G U^0.25 with U = 2 eta u/(E' R).
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.integrate import cumulative_trapezoid, quad
from scipy.optimize import brentq

FAR = 1e5


def rigid(meniscus):
    """Load over 24 eta u R/h0 and force over 12 sqrt(2) eta u sqrt(R/h0), h = h0 (1 + xi^2), from xi = -meniscus to where
    pressure and gradient vanish."""

    def over(function, end):
        # In s = arsinh(xi) a far meniscus is near.
        ends = math.asinh(-meniscus), math.asinh(end)
        return quad(lambda s: function(math.sinh(s)) * math.cosh(s), *ends, epsabs=1e-13, epsrel=1e-9, limit=400)[0]

    end = brentq(lambda e: over(lambda x: (x * x - e * e) / (1.0 + x * x) ** 3, e), 1e-6 * meniscus, min(meniscus, 0.6))
    load = -over(lambda x: x * (x * x - end * end) / (1.0 + x * x) ** 3, end)
    return load, over(lambda x: 0.5 * (x * x - end * end) ** 2 / (1.0 + x * x) ** 3, end)


def rigid_share(meniscus):
    """Distance of the meniscus in sqrt(2 R h0), h0 flooded, and share of the flooded force at the same load."""
    (load, force), (all_load, all_force) = rigid(meniscus), rigid(1e4)
    thinner = load / all_load
    return meniscus * math.sqrt(thinner), force / all_force / math.sqrt(thinner)


def hertz_gap(z):
    """Gap in b^2/(2 R) at a distance z b ahead of the edge; to 1e-6."""
    root = np.sqrt(z * (2.0 + z))
    return np.where(z < 1e-4, 4.0 * math.sqrt(2.0) / 3.0 * z**1.5, (1.0 + z) * root - np.log1p(z + root))


def grubin(dynamic_load, meniscus=FAR):
    """Film 2 R h/b^2 and force alpha E' F/Q of an inlet with the Hertz gap and viscosity exp(alpha p), where the reduced
    pressure reaches 1/alpha at the edge. ``dynamic_load`` 48 alpha eta u R^2/b^3 is that of Goksem and Hargreaves."""
    z = np.concatenate(([0.0], np.geomspace(1e-9, meniscus, 4000)))
    gap = hertz_gap(z)

    def risen(film):
        return cumulative_trapezoid(gap / (film + gap) ** 3, z, initial=0.0)

    film = math.exp(brentq(lambda log: dynamic_load * risen(math.exp(log))[-1] - 1.0, -30.0, 10.0))
    left = dynamic_load * risen(film)[1:]
    integrand = np.concatenate(([0.0], gap[1:] ** 2 / (film + gap[1:]) ** 3 / left))
    return film, 2.0 / math.pi * dynamic_load * np.trapezoid(integrand, z)


def goksem_hargreaves_share(dynamic_load, meniscus):
    """Their isothermal share of the flooded rolling traction, from their isothermal traction."""
    traction = math.exp(0.658228 * math.log(dynamic_load) - 0.162625)
    gap = float(hertz_gap(np.array(meniscus)))
    ahead = (3.0 * gap / (4.0 * math.sqrt(2.0) * traction)) ** (2.0 / 3.0)
    grown = 0.95 * dynamic_load**0.05 * ahead ** ((5.0 + dynamic_load) ** 0.068)
    return grown / (1.0 + grown)


@dataclass
class Contact:
    """What a solution needs: places x/b, elastic influence, steps, and what the oil does."""

    x: np.ndarray
    influence: np.ndarray
    reynolds: float  # 12 eta u R^2/(b^3 p_H)
    stiffness: float  # p_H/0.59 GPa of Dowson and Higginson's density; 0 for none

    def terms(self, p, h0, alpha):
        """Gap, density and its derivative, and the mobility rho h^3/(eta reynolds) between the places."""
        h = h0 + 0.5 * self.x**2 + self.influence @ p
        s = self.stiffness * np.maximum(p, 0.0)
        density, change = ((1.0 + 1.34 * s) / (1.0 + s), np.where(p > 0.0, 0.34 * self.stiffness / (1.0 + s) ** 2, 0.0))
        middle = 0.5 * (p[1:] + p[:-1])
        mobility = (0.5 * (h[1:] + h[:-1])) ** 3 / self.reynolds * np.exp(-alpha * np.maximum(middle, 0.0))
        return h, density, change, mobility * 0.5 * (density[1:] + density[:-1]), middle > 0.0


def elastic_influence(x):
    """Matrix of -1/pi int p ln|x - x'| dx' for pressures linear between the places."""

    def moment(s, power):
        size = np.abs(np.where(s == 0.0, 1.0, s))
        return s * np.log(size) - s if power == 0 else 0.5 * s * s * np.log(size) - 0.25 * s * s

    matrix = np.zeros((len(x), len(x)))
    for j in range(len(x) - 1):
        a, b = x[j] - x, x[j + 1] - x
        whole, first = (moment(b, k) - moment(a, k) for k in (0, 1))
        matrix[:, j] += (b * whole - first) / (x[j + 1] - x[j])
        matrix[:, j + 1] += (first - a * whole) / (x[j + 1] - x[j])
    return -matrix / math.pi


def places(meniscus, inner):
    """Even about the contact, ever wider to the meniscus and behind."""
    core = np.linspace(max(-1.35, -1.0 - meniscus), 1.35, inner)
    step, ahead, behind = core[1] - core[0], [core[0]], [core[-1]]
    width = step
    while ahead[-1] > -1.0 - meniscus:
        width *= 1.06
        ahead.append(ahead[-1] - width)
    if len(ahead) > 1:
        ahead = core[0] + (np.array(ahead) - core[0]) * (1.0 + meniscus + core[0]) / (core[0] - ahead[-1])
    width = step
    while behind[-1] < 4.0:
        width *= 1.1
        behind.append(behind[-1] + width)
    return np.concatenate((ahead[::-1], core[1:], behind[1:]))


def newton(contact, p, h0, alpha, enough=1e-9):
    """Flow equal everywhere with pressures below zero held there, load pi/2; steps cut to 0.15 of the Hertz pressure."""
    x, n = contact.x, len(contact.x)
    dx, penalty = np.diff(x), 1e6
    weight = 0.5 * (np.append(dx, 0.0) + np.append(0.0, dx))
    slope = np.hstack((contact.influence, np.ones((n, 1))))
    cell, inside = np.arange(n - 1), np.arange(1, n - 1)
    for _ in range(80):
        h, density, change, mobility, wet = contact.terms(p, h0, alpha)
        steep = np.diff(p) / dx
        residual = np.zeros(n + 1)
        residual[1:-2] = np.diff(mobility * steep - (density * h)[:-1]) - penalty * (weight * np.minimum(p, 0.0))[1:-1]
        residual[[0, n - 1, n]] = p[0], p[-1], weight @ p - 0.5 * math.pi
        flow = (3.0 * mobility * steep / (h[1:] + h[:-1]))[:, None] * (slope[1:] + slope[:-1])
        flow -= density[:-1, None] * slope[:-1]
        thick = np.where(wet, -0.5 * alpha * mobility * steep, 0.0)
        dense = mobility * steep / (density[1:] + density[:-1])
        flow[cell, cell] += thick - mobility / dx + dense * change[:-1] - (change * h)[:-1]
        flow[cell, cell + 1] += thick + mobility / dx + dense * change[1:]
        matrix = np.zeros((n + 1, n + 1))
        matrix[1:-2] = np.diff(flow, axis=0)
        matrix[inside, inside] -= np.where(p[1:-1] < 0.0, penalty * weight[1:-1], 0.0)
        matrix[0, 0] = matrix[n - 1, n - 1] = 1.0
        matrix[n, :n] = weight
        change_of = np.linalg.solve(matrix, -residual)
        largest = np.abs(change_of[:n]).max()
        share = min(1.0, 0.15 / largest)
        while (contact.terms(p + share * change_of[:n], h0 + share * change_of[n], alpha)[0]).min() <= 0.0:
            share *= 0.6
        p, h0 = p + share * change_of[:n], h0 + share * change_of[n]
        if largest < enough:
            return p, h0
    raise AssertionError(f"no solution at alpha p_H = {alpha}")


def elastohydrodynamic(m, viscous, meniscus, hertz_pressure=0.0, inner=280):
    """Force F/(E' R l)/U^0.75 per surface and central film h/(R sqrt(U)) at Moes's M and L = ``viscous``, with oil from
    ``meniscus`` half-widths ahead of the edge on; compressible where a Hertz pressure [Pa] is given."""
    x = places(meniscus, inner)
    contact = Contact(x, elastic_influence(x), 0.375 * math.pi**2 / m**2, hertz_pressure / 0.59e9)
    p, h0 = np.sqrt(np.maximum(1.0 - x**2, 0.0)), -0.2
    last = viscous * math.sqrt(m / (2.0 * math.pi))
    for alpha in np.arange(2.0, last, 2.0):
        p, h0 = newton(contact, p, h0, alpha, 1e-3)  # a start for the next
    p, h0 = newton(contact, p, h0, last)
    h = contact.terms(p, h0, last)[0]
    force = 0.5 * (h[1:] + h[:-1]) @ np.diff(np.maximum(p, 0.0))
    return (8.0 * m / math.pi) ** 1.5 / 8.0 * force, h[np.abs(x).argmin()] * 8.0 * m / math.pi
