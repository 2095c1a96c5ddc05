"""The film of a rigid cylinder on a plane without any fit: by quadrature, and by complementarity on a grid."""

import math

import numpy as np
from scipy.linalg import solve_banded
from scipy.optimize import brentq

NODES, WEIGHTS = np.polynomial.legendre.leggauss(80)


def quadrature_shape(entrainment, squeeze):
    """What ``film_shape`` stands for: (|u| W, u F, S), the film's end by a root, X = tan(g)."""
    if entrainment == 0.0:
        return math.pi / 8.0 * max(squeeze, 0.0), 0.0, math.pi
    sigma = squeeze / abs(entrainment)

    def film(edge):
        """X and the weights of integrals of (1 + X^2)^-3 over the film."""
        width = 0.5 * (math.atan(edge) + 0.5 * math.pi)
        g = width * (NODES + 1.0) - 0.5 * math.pi
        return np.tan(g), width * WEIGHTS * np.cos(g) ** 4

    def rise(edge):
        """The same of the pressure's slope."""
        x, weight = film(edge)
        return weight * (x - edge) * (x + edge - sigma)

    low, high = 0.375 * min(sigma, 0.0) - 1.0, max(sigma, 0.0) + 1.0
    edge = brentq(lambda edge: rise(edge).sum() / film(edge)[1].sum(), low, high, xtol=1e-15, rtol=1e-14)
    (x, _), slope = film(edge), rise(edge)
    g = abs(math.atan(edge))
    streamers = 0.5 * (0.5 * math.pi - g - math.sin(g) * math.cos(g)) / math.cos(g) ** 2
    push, held = -float(x @ slope), float((1.0 + x * x) @ slope)
    return abs(entrainment) * push, entrainment * held, 0.5 * math.pi + g + streamers


def complementary_film(viscosity, radius, gap, entrainment, closing, cells=6000):
    """(load, moment of the pressure over the radius, share of 1/h under shear [1]) a length, on a grid.

    Finite volumes of d/dx(h^3/(12 eta) dp/dx) = u dh/dx - V where p > 0, and of >= where p = 0: each node takes the
    smaller of pressure and residual, until none changes its mind (Howard's policy iteration).
    """
    width = math.sqrt(2.0 * radius * gap)
    x = width * np.sinh(np.linspace(-12.0, 12.0, cells + 1))
    faces = 0.5 * (x[1:] + x[:-1])

    def height(x):
        return gap + x * x / (2.0 * radius)

    conductance = height(faces) ** 3 / (12.0 * viscosity) / np.diff(x)
    source = closing * np.diff(faces) - entrainment * np.diff(height(faces))
    inner = x[1:-1]
    low, high = conductance[:-1], conductance[1:]
    size = low + high
    filled = np.ones(inner.size, bool)
    for _ in range(cells):
        bands = np.zeros((3, inner.size))
        bands[1] = 1.0
        bands[0, 1:] = np.where(filled, -high / size, 0.0)[:-1]
        bands[2, :-1] = np.where(filled, -low / size, 0.0)[1:]
        pressure = solve_banded((1, 1), bands, np.where(filled, source / size, 0.0))
        around = low * np.append(0.0, pressure[:-1]) + high * np.append(pressure[1:], 0.0)
        residual = pressure - (around + source) / size
        wanted = residual < pressure
        if (wanted == filled).all():
            break
        filled = wanted
    steps = 0.5 * (x[2:] - x[:-2])
    load = float(pressure @ steps)
    moment = -float((pressure * inner) @ steps) / radius
    # The oil leaves the film on the side to which it is drawn.
    edge = inner[filled][-1 if entrainment > 0.0 else 0] if filled.any() else inner[0]
    behind = ~filled if filled.any() else np.ones_like(filled)
    share = np.where(behind, np.minimum(height(edge) / height(inner), 1.0), 1.0)
    return load, moment, float((share / height(inner)) @ steps)
