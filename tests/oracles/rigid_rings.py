"""Load distribution of a ball bearing at rest between rigid rings, by ISO/TS 16281: no ball forces, one contact angle.

Both contacts of a ball act as one spring c_P between the centres of the grooves. The approach is convex in the
displacements, so the equilibrium is the one minimum of an energy, found by guarded Newton steps from anywhere.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rbdyn.contact.point_contact import ball_on_race

# A step is too long where the energy rises again this steeply, as a share of how it fell.
RISE = 0.9


class RigidRow(NamedTuple):
    """One row of balls at rest, SI."""

    balls: int
    spring: float  # c_P of both contacts in series [N/m^1.5]
    groove_distance: float  # A, between the centres of curvature of the grooves, unloaded [m]
    free_angle: float  # alpha_0 [rad]
    lever: float  # R_i, of the inner groove's centre of curvature [m]
    pitch_diameter: float  # [m]


class Distribution(NamedTuple):
    """Where the inner ring comes to rest."""

    radial: float  # delta_r [m]
    axial: float  # delta_a from where both flanks just touch at the free angle [m]
    tilt: float  # psi [rad]
    load: NDArray[np.float64]  # Q_j [N], (Z,)
    angle: NDArray[np.float64]  # alpha_j [rad], (Z,)
    approach: NDArray[np.float64]  # delta_j [m], (Z,)
    residual: float  # largest force out of balance [N]


def free_angle(radial_clearance: float, groove_distance: float) -> float:
    """Free contact angle alpha_0 [rad] of a diametral clearance s: cos(alpha_0) = 1 - s/(2 A).

    Raises ValueError for a clearance outside 0 to 2 A.
    """
    if not 0.0 <= radial_clearance <= 2.0 * groove_distance:
        raise ValueError(
            f"radial clearance {radial_clearance * 1e3:g} mm must lie between 0 and {2e3 * groove_distance:g} mm"
        )
    return math.acos(1.0 - radial_clearance / (2.0 * groove_distance))


def rigid_row(
    balls: int,
    ball_diameter: float,
    pitch_diameter: float,
    inner_groove_factor: float,
    outer_groove_factor: float,
    equivalent_modulus: float,
    *,
    free_contact_angle: float | None = None,
    radial_clearance: float = 0.0,
    nominal_angle: float = 0.0,
    lever: float | None = None,
) -> RigidRow:
    """Row from its dimensions [m, rad]. Give the free contact angle or else the diametral clearance.

    ``nominal_angle`` sets gamma of the race curvatures. ``lever``: R_i of the tilting inner groove; None takes the
    standard's d_m/2 + (r_i - D/2) cos(alpha_0). Raises ValueError as ``ball_on_race`` and ``free_angle``.
    """
    gamma = ball_diameter * math.cos(nominal_angle) / pitch_diameter
    inner = ball_on_race(ball_diameter, inner_groove_factor, gamma, equivalent_modulus)
    outer = ball_on_race(ball_diameter, outer_groove_factor, -gamma, equivalent_modulus)
    distance = (inner_groove_factor + outer_groove_factor - 1.0) * ball_diameter
    angle = free_angle(radial_clearance, distance) if free_contact_angle is None else free_contact_angle
    offset = (inner_groove_factor - 0.5) * ball_diameter * math.cos(angle)
    return RigidRow(
        balls=balls,
        spring=(inner.stiffness ** (-2.0 / 3.0) + outer.stiffness ** (-2.0 / 3.0)) ** -1.5,
        groove_distance=distance,
        free_angle=angle,
        lever=0.5 * pitch_diameter + offset if lever is None else lever,
        pitch_diameter=pitch_diameter,
    )


def distribution(
    row: RigidRow,
    radial_load: float,
    axial_load: float = 0.0,
    moment: float = 0.0,
    *,
    tilts: bool = True,
    first_ball: float = 0.0,
    most_steps: int = 200,
) -> Distribution:
    """Rest of the inner ring under loads [N] and a moment [N m] in one plane.

    ``first_ball``: angle of ball 0 from that plane [rad]. ``tilts``: whether the ring may tilt; if not, the moment is whatever holds it. delta_j and the balance follow
    ISO/TS 16281, which takes moments at d_m/2. Raises ValueError without a load, RuntimeError when no equilibrium is found.
    """
    cosine = np.cos(first_ball + 2.0 * np.pi * np.arange(row.balls) / row.balls)
    axial_free = row.groove_distance * math.sin(row.free_angle)
    radial_free = row.groove_distance * math.cos(row.free_angle)
    # Directions of radial, axial and tilting motion at each ball; the tilt counts as the sine times the lever.
    radial_part = np.stack([cosine, np.zeros(row.balls), np.zeros(row.balls)])
    axial_part = np.stack([np.zeros(row.balls), np.ones(row.balls), cosine])
    applied = np.array([radial_load, axial_load, moment / (0.5 * row.pitch_diameter)])
    free = np.array([True, True, tilts])
    if not np.any(applied[free]):
        raise ValueError("a row without a load rests anywhere in its play; give a radial or an axial load or a moment")

    def state(place: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
        axial, radial = axial_free + place @ axial_part, radial_free + place @ radial_part
        span = np.hypot(axial, radial)
        return axial, radial, span, np.maximum(span - row.groove_distance, 0.0)

    def rise(place: NDArray[np.float64]) -> NDArray[np.float64]:
        axial, radial, span, approach = state(place)
        along = (axial / span) * axial_part + (radial / span) * radial_part
        return np.where(free, along @ (row.spring * approach**1.5) - applied, 0.0)

    scale = (np.abs(applied).max() / row.spring) ** (2.0 / 3.0)
    # Off the axis of symmetry, where a row without clearance has no axial stiffness.
    place = np.array([scale, math.copysign(scale, axial_load) if axial_load else 0.0, 0.0])
    place[1] += math.copysign(math.sqrt(scale * row.groove_distance), axial_load) if axial_load else -axial_free
    residual = math.inf
    for _ in range(most_steps):
        axial, radial, span, approach = state(place)
        load = row.spring * approach**1.5
        along = (axial / span) * axial_part + (radial / span) * radial_part
        across = (radial / span) * axial_part - (axial / span) * radial_part
        gap = np.where(free, along @ load - applied, 0.0)
        residual = float(np.abs(gap).max())
        if residual <= 1e-13 * np.abs(applied).max():
            break
        hessian = (along * (1.5 * row.spring * np.sqrt(approach))) @ along.T
        hessian += (across * (load / span)) @ across.T
        hessian[~free] = hessian[:, ~free] = 0.0
        hessian += np.diag(np.where(free, 1e-12 * np.trace(hessian) + 1e-300, 1.0))
        step = -np.linalg.solve(hessian, gap)
        # Beyond the groove distance the quadratic model means nothing.
        step *= min(1.0, row.groove_distance / max(float(np.abs(step).max()), 1e-300))
        while rise(place + step) @ step > -RISE * (gap @ step) and np.abs(step).max() > 1e-15 * scale:
            step = 0.5 * step
        place = place + step
    if not residual <= 1e-7 * np.abs(applied).max():
        raise RuntimeError(f"no equilibrium of the row: {residual:g} N are out of balance")
    return Distribution(
        radial=float(place[0]),
        axial=float(place[1]),
        tilt=math.asin(place[2] / row.lever),
        load=load,
        angle=np.arctan2(axial, radial),
        approach=approach,
        residual=residual,
    )
