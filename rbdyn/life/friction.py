"""SKF's friction model: what all kinds of bearing share, and the moments of ball bearings.

Source: SKF General Catalogue 6000 in its Russian edition, pages 89 to 105: tables 2a, 3, 3a and 5, all of them read; its formulas are in mm,
N, rpm and mm^2/s, here all is in SI. Constants from elsewhere have a comment. Drag of an oil bath and friction of seals are left
out. The model is a maker's, not a measurement, and is meant for speeds up to the reference speed and for normal clearance. Its
terms of n^2 in angular contact bearings grow far beyond what was measured above that: see ``angular_contact_moments``.
"""

import math
from typing import NamedTuple

from rbdyn.base.faults import RPM

# K_rs: 3e-8 for baths and jets, 6e-8 for grease and oil-air; SKF has no drop feed, which is treated as a bath.
STARVATION, SCARCE_STARVATION = 3e-8, 6e-8
# A starvation factor far below those of bearings at their reference speed.
STARVED = 0.1
SCARCE = ("grease", "oil_air")
# mu_bl of a rotating bearing: 0.12 in the catalogue of 2018 (from memory); the older ones have 0.15 for all.
BOUNDARY_FRICTION = 0.12


class FrictionMoments(NamedTuple):
    """Rolling and sliding frictional moment [N m], without drag of a bath and without seals."""

    rolling: float
    sliding: float


class Running(NamedTuple):
    """A bearing that runs: bore and outside diameter [m], speed [rad/s], kinematic viscosity [m^2/s] and ``lubricant.supply`` of its oil."""

    bore: float
    outside: float
    speed: float
    viscosity: float
    supply: str | None = None


def inlet_heating_factor(mean_diameter: float, speed: float, viscosity: float) -> float:
    """phi_ish, reduction of the rolling moment by inlet shear heating: 1/(1 + 1.84e-9 (n d_m)^1.28 nu^0.64).

    Mean diameter [m], speed [rad/s], kinematic viscosity [m^2/s].
    """
    fast = abs(speed) / RPM * mean_diameter * 1e3
    return 1.0 / (1.0 + 1.84e-9 * fast**1.28 * (viscosity * 1e6) ** 0.64)


def starvation_factor(geometry: float, running: Running) -> float:
    """phi_rs, reduction of the rolling moment by starvation: exp(-K_rs nu n (d + D) sqrt(K_Z/(2 (D - d)))).

    ``geometry``: K_Z of the kind of bearing.
    """
    constant = SCARCE_STARVATION if running.supply in SCARCE else STARVATION
    inner, outer = running.bore * 1e3, running.outside * 1e3
    room = math.sqrt(geometry / (2.0 * (outer - inner)))
    return math.exp(-constant * running.viscosity * 1e6 * abs(running.speed) / RPM * (inner + outer) * room)


def sliding_friction(film_friction: float, mean_diameter: float, speed: float, viscosity: float) -> float:
    """mu_sl = phi_bl mu_bl + (1 - phi_bl) mu_EHL with phi_bl = exp(-2.6e-8 (n nu)^1.4 d_m); units as above."""
    flow = abs(speed) / RPM * viscosity * 1e6
    boundary = math.exp(-2.6e-8 * flow**1.4 * mean_diameter * 1e3)
    return boundary * BOUNDARY_FRICTION + (1.0 - boundary) * film_friction


def _moments(
    rolling: float, sliding: float, geometry: float, film_friction: float, running: Running
) -> FrictionMoments:
    """M_rr = phi_ish phi_rs G_rr (nu n)^0.6 and M_sl = G_sl mu_sl from the variables G_rr and G_sl of SKF's table 2a."""
    bore, outside, speed, viscosity, _ = running
    mean, flow = 0.5 * (bore + outside), abs(speed) / RPM * viscosity * 1e6
    reduction = inlet_heating_factor(mean, speed, viscosity) * starvation_factor(geometry, running)
    slides = sliding_friction(film_friction, mean, speed, viscosity)
    return FrictionMoments(1e-3 * reduction * rolling * flow**0.6, 1e-3 * sliding * slides)


class DeepGroove(NamedTuple):
    """R1, R2, S1 and S2 of a series of deep groove ball bearings."""

    rolling: float
    axial_rolling: float
    sliding: float
    axial_sliding: float


# Table 3a, by series.
DEEP_GROOVE = {
    "60": DeepGroove(4.1e-7, 1.7, 3.73e-3, 14.6),
    "62": DeepGroove(3.9e-7, 1.7, 3.23e-3, 36.5),
    "63": DeepGroove(3.7e-7, 1.7, 2.84e-3, 92.8),
    "64": DeepGroove(3.6e-7, 1.7, 2.43e-3, 198.0),
    "160": DeepGroove(4.3e-7, 1.7, 4.63e-3, 4.25),
    "618": DeepGroove(4.7e-7, 1.7, 6.50e-3, 0.78),
    "619": DeepGroove(4.3e-7, 1.7, 4.75e-3, 3.6),
}
# Table 3, single row: R1, R2, R3, S1, S2, S3.
ANGULAR_ROLLING = (5.03e-7, 1.97, 1.90e-12)
ANGULAR_SLIDING = (1.30e-2, 0.68, 1.91e-12)
# K_Z of single rows, table 5.
DEEP_GROOVE_GEOMETRY, ANGULAR_GEOMETRY = 3.1, 4.4
# mu_EHL of ball bearings: mineral and synthetic oils.
MINERAL_FILM, SYNTHETIC_FILM = 0.05, 0.04
# Axial load over C0 below which it counts as none: the round-off of an equilibrium.
NO_AXIAL_LOAD = 1e-9
# Radial load whose half load zone slides as much as a preload that sums to one over all balls. Sliding grows with the power 5/3
# of a ball's load: 4.37 (mean of cos^2.5 over the zone and 0 elsewhere)^0.6 is 1.80. For rolling, by the power 0.54, the same
# sum is 1.70, which is R2 of table 3a: SKF's axial loads are those of all balls alike.
PRELOAD_SLIDING = 1.80


def deep_groove_angle(axial_load: float, static_capacity: float) -> float:
    """alpha_F = 24.6 (F_a/C0)^0.24 degrees [rad], the contact angle of normal clearance under an axial load."""
    return math.radians(24.6 * (axial_load / static_capacity) ** 0.24)


def deep_groove_moments(
    series: str,
    running: Running,
    radial_load: float,
    axial_load: float,
    static_capacity: float,
    *,
    preload: float = 0.0,
    film_friction: float = MINERAL_FILM,
) -> FrictionMoments:
    """Frictional moments of a single row deep groove ball bearing.

    G_rr = R1 d_m^1.96 (F_r + R2 F_a/sin alpha_F)^0.54 and G_sl = S1 d_m^-0.145 (F_r^5 + S2 d_m^1.5 F_a^4/sin alpha_F)^(1/3), without
    axial load S1 d_m^-0.26 F_r^(5/3). This step at the first axial load is the maker's: a factor of d_m^0.115.

    ``preload``: sum of the ball loads [N] beyond those that carry the load, by lost clearance. It is no part of SKF's model, which
    is for normal clearance. It loads all balls alike, as an axial load does, so it is added to F_a/sin alpha_F; it slides as a radial
    load of 1/1.80 of it. Loads >= 0 and capacity C0 [N]. Raises KeyError
    for a series that is not in ``DEEP_GROOVE``.
    """
    r1, r2, s1, s2 = DEEP_GROOVE[series]
    mean = 0.5e3 * (running.bore + running.outside)
    fifth = radial_load**5 + (preload / PRELOAD_SLIDING) ** 5
    if axial_load > NO_AXIAL_LOAD * static_capacity:
        sine = math.sin(min(deep_groove_angle(axial_load, static_capacity), 0.5 * math.pi))
        rolling = radial_load + r2 * (axial_load / sine + preload)
        sliding = s1 * mean**-0.145 * (fifth + s2 * mean**1.5 * axial_load**4 / sine) ** (1.0 / 3.0)
    else:
        rolling = radial_load + r2 * preload
        sliding = s1 * mean**-0.26 * fifth ** (1.0 / 3.0)
    rolling = r1 * mean**1.96 * rolling**0.54
    return _moments(rolling, sliding, DEEP_GROOVE_GEOMETRY, film_friction, running)


def angular_contact_moments(
    running: Running,
    radial_load: float,
    axial_load: float,
    *,
    density_ratio: float = 1.0,
    film_friction: float = MINERAL_FILM,
) -> FrictionMoments:
    """Frictional moments of a single row angular contact ball bearing, of any contact angle.

    G_rr = R1 d_m^1.97 (F_r + R3 d_m^4 n^2 + R2 F_a)^0.54 and G_sl = S1 d_m^0.26 ((F_r + S3 d_m^4 n^2)^(4/3) + S2 F_a^(4/3)). The terms
    of n^2 are centrifugal: ``density_ratio``, density of the balls over that of steel, scales them (SKF has 0.41 for silicon
    nitride, its density over that of steel). Units as ``deep_groove_moments``.

    At 1.4 to 3.5 million n d_m the model gives 2.9 to 17 times the loss of a 35 mm bearing in NASA TP-2275, without the terms of n^2
    0.33 to 0.21 times.
    """
    (r1, r2, r3), (s1, s2, s3) = ANGULAR_ROLLING, ANGULAR_SLIDING
    mean = 0.5e3 * (running.bore + running.outside)
    turning = density_ratio * mean**4 * (running.speed / RPM) ** 2
    rolling = r1 * mean**1.97 * (radial_load + r3 * turning + r2 * axial_load) ** 0.54
    sliding = s1 * mean**0.26 * ((radial_load + s3 * turning) ** (4.0 / 3.0) + s2 * axial_load ** (4.0 / 3.0))
    return _moments(rolling, sliding, ANGULAR_GEOMETRY, film_friction, running)
