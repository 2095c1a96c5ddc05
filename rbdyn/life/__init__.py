"""Fatigue life, and makers' rules on friction and minimum load.

- ``rollers``, ``balls``: ratings from dimensions (ISO 281, ISO 76) and life from the loads of each rolling element (ISO/TS 16281)
- ``rollers`` also: minimum loads, SKF's friction model and the heat of ISO 15312
- ``friction``: what SKF's model has in common for all kinds, and its moments of ball bearings

This file has what both kinds of bearing share: the life in turns of one ring against the other and in hours, with the loads and
capacities of the races behind it; and the life over a duty, which are points with shares of the time.

Damage adds up by Palmgren and Miner: an hour at a point takes 1/L_h of the life there, so 1/L_h = sum q_i/L_h,i with shares of
time q_i. In turns the weights are n_i q_i: a fast point counts more than its share of time. The equivalent load is
P_m = (sum P_i^p n_i q_i/sum n_i q_i)^(1/p), p = 3 for balls and 10/3 for rollers (ISO 281 and makers' catalogues). A constant load
P_m gives the same damage wherever each life is (C/P_i)^p.
"""

import math
from collections.abc import Sequence
from typing import Any, Literal

from rbdyn.base.blocks import Sheet, columns_of
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, finite, shown

# Rings that rotate relative to the load.
Turning = Literal["inner", "outer", "both"]


def turning_rings(inner_speed: float, outer_speed: float) -> Turning:
    """Rings that rotate relative to a load of constant direction; the inner one where both stand still."""
    if outer_speed == 0.0:
        return "inner"
    return "outer" if inner_speed == 0.0 else "both"


class Life(Record):
    """Life that 90 % of bearings, or rows, reach.

    ``million_turns``: L10 in 1e6 turns of the inner ring against the outer ring; infinite without a load. ``inner_load,
    outer_load``: the equivalent constant load on each ball or roller [N]. ``inner_capacity, outer_capacity``: the load of the
    races for one million turns [N].
    """

    million_turns: float
    inner_load: float
    outer_load: float
    inner_capacity: float
    outer_capacity: float

    def figures(self, inner_speed: float, outer_speed: float) -> "LifeFigures":
        """Life for a report, at ring speeds [rad/s]."""
        return LifeFigures(finite(self.million_turns), finite(self.hours(inner_speed, outer_speed)))

    def hours(self, inner_speed: float, outer_speed: float = 0.0) -> float:
        """Life in hours at ring speeds [rad/s]; infinite without relative speed."""
        speed = abs(inner_speed - outer_speed)
        return self.million_turns * 1e6 * 2.0 * math.pi / speed / 3600.0 if speed > 0.0 else math.inf


class LifeFigures(Record):
    """Reference life in turns and in hours; None for an infinite life."""

    L10_Mrev: float | None
    L10_h: float | None
    method: str = "ISO/TS 16281"


BALL_EXPONENT, ROLLER_EXPONENT = 3.0, 10.0 / 3.0
# Largest difference of the sum of shares from 1 that rounding explains.
SHARE_ROUNDING = 1e-6


class LoadCase(Record):
    """A point of a duty: share of the time, speed of inner against outer ring [rad/s], equivalent load P [N], life there."""

    share: float
    speed: float
    load: float
    life: Life

    @property
    def hours(self) -> float:
        """Life in hours if the machine ran at this point alone; infinite without a load or without relative speed."""
        return self.life.hours(self.speed)


class DutyLife(Record):
    """Life over a duty that 90 % of bearings reach.

    ``hours``, ``million_turns``: infinite without damage; the turns are those of the inner ring against the outer ring.
    ``equivalent_load``: P_m [N]; NaN where nothing turns. ``mean_speed``: mean over time of the relative speed [rad/s].
    ``point_hours``: life at each point alone [h]; ``damage``: share of the damage that each point does, zeros without damage.
    """

    hours: float
    million_turns: float
    equivalent_load: float
    mean_speed: float
    point_hours: tuple[float, ...]
    damage: tuple[float, ...]

    @property
    def figures(self) -> "DutyLifeFigures":
        """The life for a report."""
        return DutyLifeFigures(finite(self.hours), finite(self.million_turns), finite(self.equivalent_load))


class DutyLifeFigures(Record):
    """Life over a duty in hours and in turns, and the equivalent load; None for an infinite or unknown figure."""

    L10_h: float | None
    L10_Mrev: float | None
    equivalent_load_N: float | None  # noqa: N815


class PointLife(Record):
    """A point of a duty: share of the time, speed and load, life of ISO/TS 16281 there and share of the damage over the duty.

    The life is None where it has no end or is unknown.
    """

    name: str = shown("point", meaning="point, and its share of the time")
    share: float = shown("share of time", ".4g %")
    inner_speed_rpm: float = shown("speed [rpm]", "g", meaning="speed and load of the point")
    radial_load_N: float = shown("load [N]", "g")  # noqa: N815
    L10_h: float | None = shown(
        "life [h]",
        3,
        meaning="life by ISO/TS 16281 if the machine ran at this point alone, by static loads at the operating clearance",
    )
    damage_share: float | None = shown(
        "share of damage", ".3g %", meaning="share of the damage that the point does (Palmgren and Miner)"
    )


def life_sheet(points: Sequence[Any]) -> Sheet[Any]:
    """Points of a duty with their lives."""
    return Sheet(
        "Duty",
        columns_of(PointLife),
        points,
        file="duty.csv",
        content="One row per point of the duty, of `rbdyn map --duty`.",
    )


def equivalent_load(cases: Sequence[LoadCase], exponent: float) -> float:
    """P_m [N] of a duty with the load-life ``exponent`` p; NaN where nothing turns."""
    turns = [case.share * abs(case.speed) for case in cases]
    if not sum(turns) > 0.0:
        return math.nan
    largest = max(case.load for case in cases)
    if largest == 0.0:
        return 0.0
    # Loads over the largest one, so that no power overflows.
    powers = [(case.load / largest) ** exponent * turn for case, turn in zip(cases, turns, strict=True)]
    return float(largest * (sum(powers) / sum(turns)) ** (1.0 / exponent))


def duty_life(cases: Sequence[LoadCase], exponent: float) -> DutyLife:
    """Life over a duty by Palmgren and Miner, from the life at each point; ``exponent``: p of the equivalent load."""
    rates = [case.share / case.hours for case in cases]
    rate = sum(rates)
    hours = 1.0 / rate if rate > 0.0 else math.inf
    mean_speed = sum(case.share * abs(case.speed) for case in cases)
    return DutyLife(
        hours=hours,
        million_turns=hours * 3600.0 * mean_speed / (2.0 * math.pi) * 1e-6 if rate > 0.0 else math.inf,
        equivalent_load=equivalent_load(cases, exponent),
        mean_speed=mean_speed,
        point_hours=tuple(case.hours for case in cases),
        damage=tuple(value / rate if rate > 0.0 else 0.0 for value in rates),
    )


def life_notes(life: float, hours: float) -> Notes:
    """A note on a ``life`` [h] below the ``hours`` of the duty: the sum of its shares, where it is not that of shares of 1."""
    if abs(hours - 1.0) <= SHARE_ROUNDING or life >= hours:
        return ()
    return (Note("short-life", f"life: {life:.3g} h over the duty is below its {hours:.6g} h (the sum of the shares)"),)
