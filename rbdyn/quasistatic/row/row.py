"""Geometry of one row of balls: what the equations of equilibrium need to know, in SI."""

from typing import NamedTuple

import numpy as np

from rbdyn.arrays import Array


class Row(NamedTuple):
    """One row of Z balls between two rings. Arrays have shape (Z,), lengths are in m.

    ``cosine, sine``: of the azimuth of each ball. ``axial, radial``: place of the inner groove centre before any
    displacement, form errors, clearance and ring growth included. ``inner_reach, outer_reach``: groove radius less ball
    radius. ``inner_stiffness, outer_stiffness``: K of Q = K delta^1.5 [N/m^1.5]. ``lever``: radius R_i of the circle of
    inner groove centres. ``inner_groove_radius``: f_i D, the lever of a friction force about the groove centre.
    ``centrifugal_force``: that of a ball at the common cage speed [N]; ``rest_deflection``: how deep a ball that only this
    force loads presses into the outer race; ``rest_energy``: what
    that stores less the work of the force [J].
    """

    cosine: Array
    sine: Array
    axial: Array
    radial: Array
    inner_reach: Array
    outer_reach: Array
    inner_stiffness: float
    outer_stiffness: float
    lever: float
    inner_groove_radius: float
    centrifugal_force: float
    rest_deflection: float
    rest_energy: float


def component_lengths(lever: float) -> Array:
    """What makes lengths of (x, y, z, theta_x, theta_y) and forces of (Fx, Fy, Fz, Mx, My): times and over (1, 1, 1, R, R)."""
    return np.array([1.0, 1.0, 1.0, lever, lever])


def at_rest(centrifugal_force: float, outer_stiffness: float) -> tuple[float, float]:
    """Outer deflection [m] under the centrifugal force alone, and energy [J] there."""
    deflection = float((centrifugal_force / outer_stiffness) ** (2.0 / 3.0))
    return deflection, -0.6 * centrifugal_force * deflection
