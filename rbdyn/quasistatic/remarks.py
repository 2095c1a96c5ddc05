"""What to beware of at one equilibrium or at many: balls clear of a race, dents, steep angles, slip, a ring that tips."""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from rbdyn.arrays import Array, Mask
from rbdyn.contact.hertz_point import PointContact, peak_pressure
from rbdyn.contact.static_limit import BALLS, dent_sentence
from rbdyn.quasistatic.row.control import FixedShare, FrictionShare
from rbdyn.quasistatic.row.equilibrium import INNER_ANGLE, INNER_LOAD, MOMENT, OUTER_LOAD
from rbdyn.quasistatic.row.model import RowModel
from rbdyn.scene.ball import BallRow, BallScene

# A contact at a steeper angle lies beyond any shoulder [rad].
STEEPEST = math.radians(80.0)
# Beyond, oiled contacts slip about the axis of the gyroscopic moment.
OILED_FRICTION = 0.07
# Makers allow angular contact bearings about this misalignment, deep groove ones up to three times as much [rad].
TIPPED = 1e-3
# A ball load [N] that is left over from rounding.
NO_LOAD = 1e-9


class Rating(NamedTuple):
    """What pressure, life and remarks need of a row beside its loads: capacities of both races [N], speeds of both rings [rad/s]."""

    drawing: BallRow
    model: RowModel
    capacities: tuple[float, float]
    speeds: tuple[float, float]


class Remark(NamedTuple):
    """Something unusual: in a word, at which of n points, and what to say of one of them."""

    word: str
    where: Mask
    say: Callable[[int], str]
    row: str = ""

    def sentence(self, place: int) -> str:
        """The sentence for a point, with the row of balls that it is about where there are two."""
        return self.row + self.say(place)


def pressures(balls: Array, ratings: Sequence[Rating]) -> dict[str, Array]:
    """Largest Hertz pressure (n,) on each race [Pa] of ``balls`` (n, Z, FIGURES)."""
    peaks = {}
    for race, place in (("inner", INNER_LOAD), ("outer", OUTER_LOAD)):
        contact = PointContact(*np.array([getattr(rating.model, f"{race}_contact") for rating in ratings]).T)
        peaks[race] = peak_pressure(contact, balls[:, :, place].max(axis=1))
    return peaks


def overloads(balls: Array, ratings: Sequence[Rating]) -> dict[int, str]:
    """Points whose loads no contact can carry, and why: an ellipse as long as its groove is deep."""
    causes: dict[int, str] = {}
    for race, place in (("inner", INNER_LOAD), ("outer", OUTER_LOAD)):
        loads = balls[:, :, place]
        factor = np.array([getattr(rating.drawing, f"{race}_groove_factor") for rating in ratings])
        groove = factor * np.array([rating.drawing.ball_diameter for rating in ratings])
        unit = np.array([getattr(rating.model, f"{race}_contact").semi_major for rating in ratings])
        half = unit * np.cbrt(loads.max(axis=1))
        for k in np.flatnonzero(half > groove).tolist():
            ball = f"the ball at {360.0 * loads[k].argmax() / loads.shape[1]:.0f} deg would bear {loads[k].max():.4g} N"
            why = f"over {2e3 * half[k]:.3g} mm across a groove of {1e3 * groove[k]:.3g} mm radius, which no contact can; lessen the load"
            causes.setdefault(k, f"overloaded: {ball} on the {race} race, {why}")
    return causes


def needed_friction(balls: Array, ratings: Sequence[Rating]) -> Array:
    """Largest friction coefficient (n,) that a contact needs to hold its part of the gyroscopic moment, 2 s M_g/(D Q)."""
    inner, outer = balls[:, :, INNER_LOAD], balls[:, :, OUTER_LOAD]
    controls = [rating.model.control for rating in ratings]
    # One sweep has one kind of control.
    if not isinstance(controls[0], FixedShare | FrictionShare):
        return np.zeros(len(ratings))
    share = np.array([[control[0]] for control in controls])
    diameter = np.array([[rating.drawing.ball_diameter] for rating in ratings])
    with np.errstate(divide="ignore", invalid="ignore"):
        if isinstance(controls[0], FrictionShare):
            models = [rating.model for rating in ratings]
            ratio = np.array([[m.outer_contact.stiffness / m.inner_contact.stiffness] for m in models])
            weight = share * (inner / outer * ratio) ** (4.0 / 3.0)
            share = weight / (1.0 + weight)
        pull = 2.0 * np.abs(balls[:, :, MOMENT]) / diameter
        needed = np.maximum(share * pull / inner, (1.0 - share) * pull / outer)
    return np.where((inner > 0.0) & (outer > 0.0), needed, 0.0).max(axis=1)


def remarks(balls: Array, ratings: Sequence[Rating], name: str = "") -> list[Remark]:
    """Remarks on n equilibria of a row, ``balls`` (n, Z, FIGURES); ``name`` of the row, where there are two."""
    row = f"{name} row: " if name else ""
    touching, angle = balls[:, :, INNER_LOAD] > NO_LOAD, np.degrees(balls[:, :, INNER_ANGLE])
    size = touching.shape[1]
    clear = size - touching.sum(axis=1)
    steepest = np.where(touching, np.abs(angle), 0.0).max(axis=1)
    steep = steepest > math.degrees(STEEPEST)
    turned = np.sum(touching & (angle < 0.0), axis=1)
    shouldered = np.array([rating.drawing.contact_angle > 0.0 for rating in ratings])
    needed, (inner, outer) = needed_friction(balls, ratings), pressures(balls, ratings).values()
    # fmt: off
    listed = [
        ("unloaded", clear == size, lambda k:
            "no ball touches the inner race, so nothing tells where the ring is; load it or take away clearance"),
        ("clear balls", (clear > 0) & (clear < size), lambda k: f"{clear[k]} of {size} balls are clear of the inner race"),
        ("inner dent", inner > BALLS, lambda k: dent_sentence(float(inner[k]), BALLS, "inner")),
        ("outer dent", outer > BALLS, lambda k: dent_sentence(float(outer[k]), BALLS, "outer")),
        ("steep angle", steep, lambda k:
            f"inner angles reach {steepest[k]:.0f} deg, beyond any shoulder: rotation throws the inner ring off its balls; "
            "preload it axially or slow down"),
        ("negative angle", shouldered & (turned > 0) & ~steep, lambda k:
            f"{turned[k]} balls bear at negative angles, where an angular contact bearing has no shoulder; turn the thrust "
            "round, or pair the bearing"),
        ("gyroscopic slip", needed > OILED_FRICTION, lambda k:
            f"the gyroscopic moment needs a friction coefficient of {needed[k]:.2f}, more than oil gives: the balls slip "
            "about that axis; raise the load or lower the speed"),
    ]
    # fmt: on
    return [Remark(row + word, where, say, row) for word, where, say in listed]


def tipping(tilts: Array, scene: BallScene) -> Remark:
    """Remark on a ring that is free to tilt and does, from ``tilts`` (n, 2) [rad]."""
    held = np.array([value is not None for value in scene.operation.given[3:]])
    tilt = np.hypot(*np.where(held, 0.0, tilts).T)
    # fmt: off
    return Remark("tipped ring", tilt > TIPPED, lambda k:
        f"the free ring tips by {1e3 * tilt[k]:.2g} mrad ({math.degrees(tilt[k]) * 60.0:.0f} arc minutes), more than a shaft lets a "
        "mounted one; set operation.tilt = 'fixed' where a shaft holds it")
    # fmt: on


def sentences(given: Sequence[Remark]) -> list[str]:
    """What remarks say of the first equilibrium."""
    return [remark.sentence(0) for remark in given if remark.where[0]]
