"""The path without an option against the general path fed with the option's neutral value: the same right-hand side.

``test_invariants`` runs this interpreted: each pair is another set of law types. Neutral values are put into the
parameters by hand, for a scene that says them builds the plain path.
"""

import functools
import math

import numpy as np
import pytest
from conftest import UNSAMPLED, law_types, make, right_hand_side, state_near_contact
from interpreted_invariants import REWRITTEN, on_both

from rbdyn.accuracy.variants import OPTIONS
from rbdyn.contact.cage_film import PocketFilm, ShortJournalFilm
from rbdyn.contact.damping import HuntCrossleyDamping, NoDamping, ViscousDamping
from rbdyn.contact.hertz_line import LineContact, LineContactOnBar, PowerLineContact
from rbdyn.contact.rolling_resistance import (
    LayerFilm,
    NoRollingResistance,
    OpenFilm,
    RollingResistance,
    StarvedRollingResistance,
)
from rbdyn.contact.traction import (
    BlendedFourConstantTraction,
    CoulombTraction,
    FourConstantTraction,
    NoTraction,
    SurfaceAxes,
    TractionSurface,
)
from rbdyn.dynamics.forces.bodies import CylinderDrag, NoDrag, SupportedRing
from rbdyn.dynamics.forces.cage import (
    DryContact,
    InnerGuide,
    LippedPocket,
    LubricatedPocket,
    NoContact,
    NoFilm,
    NoGuide,
    NoPocket,
    OuterGuide,
)
from rbdyn.dynamics.forces.schedule import ClockedDrive, Constant, Ramps, SmoothRamps, Steps
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.losses import LOAD

# Round-off of the sums, relative to the largest of each kind of derivative, power or load. Both paths compute the
# overlaps, which are differences of positions, from the same numbers in the same order.
ROUND_OFF = 1e-13
# More than any contact of this bearing can open [m].
OUT_OF_REACH = 1.0


def races(**laws):
    """Both races with these laws."""
    return lambda bearing: on_both(bearing, **{key: lambda _, new=new: new for key, new in laws.items()})


def pocket(change):
    """The bearing with a pocket made from its own."""
    return lambda bearing: bearing._replace(pocket=change(bearing.pocket))


def guide(change):
    """The bearing with a guide land made from its own."""
    return lambda bearing: bearing._replace(guide=change(bearing.guide))


def clocked(kind):
    """The bearing driven by the clock as it is without: speed and load by schedules of this kind that never change."""

    def change(bearing):
        steady, times = bearing.drive, np.array([0.0, 1e-3])
        speed, load = (
            Constant(value) if kind is Constant else kind(times, np.full(2, value))
            for value in (steady.inner_speed, steady.load_x)
        )
        return bearing._replace(drive=ClockedDrive(60, speed, 0.0, load, 0.0, 0.0))

    return change


def itself(bearing):
    """The plain bearing."""
    return bearing


def on_bar(stiffness):
    """Pocket contacts on a cross-bar."""
    return pocket(lambda p: p._replace(contact=LineContactOnBar(p.contact.stiffness, stiffness)))


def rigid(bearing):
    """Pocket contacts without a cross-bar."""
    return pocket(lambda p: p._replace(contact=LineContact(p.contact.stiffness)))(bearing)


# Constants of exp in every cell: a coefficient of exp(-700), which is nothing against any other.
NO_TABLE = TractionSurface(
    SurfaceAxes(1.0, 1.0, 3.5, 0.0, 0.1, 3.5), np.concatenate((np.full((16, 1), -700.0), np.zeros((16, 15))), axis=1), 4
)
NO_POCKET_FILM = PocketFilm(0.0, 0.0, 0.0, 0.0, 1e-6)
NO_GUIDE = guide(lambda g: NoGuide())

# What leaves the option out, and the general path with a value that says nothing.
NEUTRAL = {
    "contact law of Houpert": (
        itself, lambda b: on_both(b, contact=lambda race: PowerLineContact(race.contact.stiffness, 10.0 / 9.0))
    ),
    "logarithmic profile, 31 slices": (itself, REWRITTEN["31 slices"]),
    "tilt, 31 slices": (itself, REWRITTEN["31 slices, tilt of nothing"]),
    "unequal rollers": (itself, REWRITTEN["rollers of equal radii"]),
    "two-lobed outer race": (itself, REWRITTEN["waves of no height"]),
    "wavy inner race, with clock": (itself, lambda b: clocked(Constant)(REWRITTEN["waves of no height"](b))),
    "traction by pressure and temperature": (races(traction=NoTraction()), races(traction=NO_TABLE)),
    "mixed friction": (itself, REWRITTEN["asperities that carry nothing"]),
    "dry traction": (races(traction=NoTraction()), races(traction=CoulombTraction(0.0, 0.02))),
    "without traction": (races(traction=NoTraction()), races(traction=FourConstantTraction(0.0, 0.0, 1.0, 0.0))),
    "without race damping": (races(damping=NoDamping()), races(damping=ViscousDamping(0.0, 1e7))),
    "without rolling resistance": (races(rolling=NoRollingResistance()), races(rolling=RollingResistance(0.0, 1.0))),
    "starved inlets": (
        itself, lambda b: on_both(b, rolling=lambda race: StarvedRollingResistance(*race.rolling, 1.0, 0.0, 0.0, 0.0))
    ),
    "films at open inner contacts": (itself, lambda b: b._replace(open_film=OpenFilm(0.0, 0.0, 1e-6))),
    "pocket film": (itself, pocket(lambda p: LubricatedPocket(p, NO_POCKET_FILM, p.half_clearance, p.nominal_radius))),
    "rigid pocket bars": (rigid, on_bar(1e30)),
    "without pockets": (pocket(lambda p: NoPocket()), pocket(lambda p: p._replace(half_clearance=OUT_OF_REACH))),
    "guidance on the inner ring": (NO_GUIDE, guide(lambda g: InnerGuide(g.radius, NoFilm(), NoContact()))),
    "guidance by the rollers": (
        NO_GUIDE,
        lambda b: NO_GUIDE(b)._replace(
            pocket=LippedPocket(b.pocket, 0.02, OUT_OF_REACH, 0.0045, LineContact(1e9), NoDamping(), NoTraction())
        ),
    ),
    "dry land": (
        guide(lambda g: g._replace(film=NoFilm())),
        guide(lambda g: g._replace(film=ShortJournalFilm(0.0, 0.0, *g.film[2:]))),
    ),
    "without land": (
        NO_GUIDE,
        guide(lambda g: OuterGuide(g.radius, ShortJournalFilm(0.0, 0.0, *g.film[2:]),
                                   DryContact(OUT_OF_REACH, *g.dry[1:]))),
    ),
    "cage imbalance": (itself, REWRITTEN["no imbalance"]),
    "outer ring turns": (itself, REWRITTEN["outer ring at no speed"]),
    "outer ring on a support": (itself, lambda b: b._replace(outer_ring=SupportedRing(60, 0.5, 2e7, 2e3))),
    "rotating load, with clock": (itself, clocked(Constant)),
    "speed and load by schedule": (itself, clocked(Ramps)),
    "gravity": (itself, REWRITTEN["no weight"]),
    "without drag": (lambda b: b._replace(drag=NoDrag()), lambda b: b._replace(drag=CylinderDrag(0.0))),
    # Further laws, which no line of the table of options stands for.
    "film of a layer thinner than every gap": (itself, lambda b: b._replace(open_film=LayerFilm(1.0, 1.0, 1e-6, 1e6))),
    "schedule in steps": (itself, clocked(Steps)),
    "schedule in smooth ramps": (itself, clocked(SmoothRamps)),
    "traction at rest": (
        itself, lambda b: on_both(b, traction=lambda race: BlendedFourConstantTraction(*race.traction, 0.0))
    ),
    "restitution of one": (
        pocket(lambda p: p._replace(damping=NoDamping())),
        pocket(lambda p: p._replace(damping=HuntCrossleyDamping(0.0))),
    ),
    "race damping by restitution": (races(damping=NoDamping()), races(damping=HuntCrossleyDamping(0.0))),
}  # fmt: skip
# Options without a neutral value.
OTHERS = {
    "tangential elasticity": "its coefficients are states; test_tangential_elasticity holds its limit",
    "contact law of ISO/TS 16281": "the plain law with another constant",
    "contact law of Dowson and Higginson": "a logarithm is no power at any value",
}


@functools.cache
def plain_outcome(seed):
    """State and right-hand side of the plain bearing, which half of the pairs are compared with."""
    scene = make(UNSAMPLED)
    y = state_near_contact(scene, seed)
    return y, right_hand_side(roller_bearing(scene), y)


def assert_same(plain, general, clock):
    """Derivatives of the plain state, powers and loads agree to round-off; with a clock, the load's work is power."""
    for block in np.split(np.arange(60), [20, 40, 50, 53, 56, 58]):
        mine, theirs = general.dy[block], plain.dy[block]
        assert np.abs(mine - theirs).max() <= ROUND_OFF * np.abs(theirs).max()
    mine, theirs = (np.delete(one.power, LOAD) if clock else one.power for one in (general, plain))
    assert np.abs(mine - theirs).max() <= ROUND_OFF * np.abs(theirs).max()
    assert np.abs(general.loads - plain.loads).max() <= ROUND_OFF * plain.loads.max()


def test_unit_every_option_is_accounted_for():
    """Unit: each option of the cost table has a neutral value or a reason why there is none."""
    assert set(OPTIONS) <= set(NEUTRAL) | set(OTHERS)
    assert set(NEUTRAL).isdisjoint(OTHERS) and set(OTHERS) <= set(OPTIONS)


@pytest.mark.parametrize("name", NEUTRAL)
def test_unit_plain_path_equals_the_general_one(name):
    """Unit: contacts open, closed and sliding, in six states."""
    leave_out, put_in = NEUTRAL[name]
    bearing = roller_bearing(make(UNSAMPLED))
    special, general = leave_out(bearing), put_in(bearing)
    assert law_types(special) != law_types(general)
    clock = isinstance(general.drive, ClockedDrive)
    added = [2e-4, 2.0, 0.0] if clock else [0.0] * 4 if isinstance(general.outer_ring, SupportedRing) else []
    touched = 0.0
    for seed in range(6):
        y, plain = plain_outcome(seed)
        if leave_out is not itself:
            plain = right_hand_side(special, y)
        assert_same(plain, right_hand_side(general, np.append(y, added)), clock)
        touched = max(touched, plain.loads[1])
    assert touched > 10.0 and math.isfinite(touched)
