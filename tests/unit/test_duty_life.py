"""Life over a duty: closed forms of Palmgren and Miner and of the equivalent load, and the static loads behind each life."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_life import static_loads as by_standard

from rbdyn.contact.hertz_line import iso_16281
from rbdyn.contact.profile import logarithmic_relief, slice_centres
from rbdyn.dynamics.part_figures import roller_duty_life, static_life
from rbdyn.life import BALL_EXPONENT, ROLLER_EXPONENT, Life, LoadCase, duty_life, equivalent_load
from rbdyn.life.rollers import RollerContacts, static_loads
from rbdyn.properties.materials import MATERIALS, equivalent_modulus

CAPACITY = 1e4


def case(share: float, speed: float, load: float, exponent: float = ROLLER_EXPONENT) -> LoadCase:
    """A point whose life is (C/P)^p million turns."""
    return LoadCase(
        share, speed, load, Life((CAPACITY / load) ** exponent if load else math.inf, load, load, CAPACITY, CAPACITY)
    )


def test_closed_form_equal_points():
    """Closed form: equal points have the life and the load of one of them, whatever their shares."""
    alone = case(1.0, 100.0, 500.0)
    parts = duty_life([case(share, 100.0, 500.0) for share in (0.2, 0.5, 0.3)], ROLLER_EXPONENT)
    assert parts.hours == pytest.approx(alone.hours, rel=1e-14)
    assert parts.million_turns == pytest.approx(alone.life.million_turns, rel=1e-14)
    assert parts.equivalent_load == pytest.approx(500.0, rel=1e-14)
    assert parts.damage == pytest.approx((0.2, 0.5, 0.3), rel=1e-14)
    whole = duty_life([alone], ROLLER_EXPONENT)
    assert whole.hours == alone.hours and whole.damage == (1.0,)


def test_closed_form_two_points_by_hand():
    """Closed form: at one speed 1000 N for half the time and 2000 N for the other, P_m = ((1 + 2^p)/2)^(1/p) kN."""
    for exponent in (BALL_EXPONENT, ROLLER_EXPONENT):
        cases = [case(0.5, 100.0, 1000.0, exponent), case(0.5, 100.0, 2000.0, exponent)]
        life = duty_life(cases, exponent)
        assert life.equivalent_load == pytest.approx(1000.0 * ((1.0 + 2.0**exponent) / 2.0) ** (1.0 / exponent))
        assert life.hours == pytest.approx(2.0 / (1.0 / cases[0].hours + 1.0 / cases[1].hours))
        assert life.damage[1] / life.damage[0] == pytest.approx(2.0**exponent)
        assert life.point_hours == tuple(one.hours for one in cases)
        assert life.million_turns == pytest.approx((CAPACITY / life.equivalent_load) ** exponent)


def test_closed_form_share_of_time_and_of_turns():
    """Closed form: a tenth of the time at nine times the speed is half of the turns, so the load counts by half."""
    cases = [case(0.9, -100.0, 1000.0), case(0.1, 900.0, 2000.0)]
    by_turns = equivalent_load(cases, ROLLER_EXPONENT)
    assert by_turns == pytest.approx(1000.0 * ((1.0 + 2.0**ROLLER_EXPONENT) / 2.0) ** (1.0 / ROLLER_EXPONENT))
    by_time = 1000.0 * (0.9 + 0.1 * 2.0**ROLLER_EXPONENT) ** (1.0 / ROLLER_EXPONENT)
    assert by_turns > 1.1 * by_time
    life = duty_life(cases, ROLLER_EXPONENT)
    assert life.mean_speed == pytest.approx(180.0)
    turns_an_hour = 180.0 * 3600.0 / (2.0 * math.pi) * 1e-6
    assert life.million_turns == pytest.approx(life.hours * turns_an_hour)


def test_limit_points_without_damage():
    """Limit: a point without load or turns does no damage; a duty of such points has no end, and a record without it."""
    half = duty_life([case(0.5, 100.0, 1000.0), case(0.5, 100.0, 0.0)], ROLLER_EXPONENT)
    assert half.hours == pytest.approx(2.0 * case(1.0, 100.0, 1000.0).hours) and half.damage == (1.0, 0.0)
    assert half.equivalent_load == pytest.approx(1000.0 * 0.5 ** (1.0 / ROLLER_EXPONENT))
    still = duty_life([case(1.0, 0.0, 1000.0)], ROLLER_EXPONENT)
    assert math.isinf(still.hours) and math.isnan(still.equivalent_load) and still.damage == (0.0,)
    assert still.figures.as_dict() == {"L10_h": None, "L10_Mrev": None, "equivalent_load_N": None}
    assert duty_life([case(1.0, 10.0, 0.0)], ROLLER_EXPONENT).equivalent_load == 0.0


@settings(max_examples=50, deadline=None)
@given(
    points=st.lists(st.tuples(st.floats(0.01, 1.0), st.floats(1.0, 1e4), st.floats(1.0, 1e5)), min_size=1, max_size=12)
)
def test_invariant_equivalent_load_has_the_life_of_the_duty(points):
    """Invariant: where each life is (C/P)^p, so is that of the duty with P_m, which lies between its loads; order is nothing."""
    whole = sum(share for share, _, _ in points)
    cases = [case(share / whole, speed, load) for share, speed, load in points]
    life = duty_life(cases, ROLLER_EXPONENT)
    assert life.million_turns == pytest.approx((CAPACITY / life.equivalent_load) ** ROLLER_EXPONENT, rel=1e-9)
    loads = [one.load for one in cases]
    assert min(loads) * (1.0 - 1e-12) <= life.equivalent_load <= max(loads) * (1.0 + 1e-12)
    assert sum(life.damage) == pytest.approx(1.0)
    assert duty_life(cases[::-1], ROLLER_EXPONENT).hours == pytest.approx(life.hours, rel=1e-12)


def contacts(length: float, relief: np.ndarray) -> RollerContacts:
    """Contacts of a steel roller with the same drop at both races."""
    steel = MATERIALS["bearing_steel"]
    return RollerContacts(iso_16281(equivalent_modulus(steel, steel), length).stiffness, (relief[None], relief[None]))


@pytest.mark.parametrize("clearance", [0.02, 0.0, -0.01])
def test_literature_static_loads_are_those_of_the_standard(clearance):
    """Literature: without centrifugal force both races bear the laminae of ISO/TS 16281, c_s = 35948 l^(8/9)/n in series."""
    slices, length, diameter, load = 31, 3.5, 9.0, 1300.0
    relief = logarithmic_relief(slice_centres(slices, length * 1e-3), diameter * 1e-3, length * 1e-3)
    inner, outer = static_loads(contacts(length * 1e-3, relief), 10, load, clearance * 1e-3)
    expected = by_standard(10, diameter, length, load, slices, True, clearance)
    assert inner == pytest.approx(expected, rel=2e-3, abs=1e-3)  # E of steel in the standard's c_L
    assert outer == pytest.approx(inner, rel=1e-9, abs=1e-9)


def test_invariant_static_loads_are_in_balance():
    """Invariant: inner loads carry the radial load; each outer one exceeds its inner one by the centrifugal force."""
    relief = np.zeros(1)
    azimuth = 2.0 * np.pi * np.arange(14) / 14
    for load, clearance, thrown in ((800.0, 3e-5, 60.0), (20.0, 1e-4, 500.0), (5000.0, -1e-5, 10.0), (0.0, 1e-5, 50.0)):
        inner, outer = static_loads(contacts(7e-3, relief), 14, load, clearance, thrown)
        assert inner.shape == outer.shape == (1, 14, 1)
        assert inner[0, :, 0] @ np.cos(azimuth) == pytest.approx(load, rel=1e-9, abs=1e-9)
        assert outer - inner == pytest.approx(np.full(inner.shape, thrown), rel=1e-9)
        assert inner[0, 1:, 0] == pytest.approx(inner[0, :0:-1, 0], rel=1e-8, abs=1e-9)


def test_physics_static_life_is_that_of_a_slow_simulation(outer):
    """Trend: at 4000 rpm under 3000 N the loads of a simulated turn give the life of the static loads within 5 %."""
    from rbdyn.dynamics.motion import history

    slow = outer.changed({"operation.inner_speed_rpm": 4000.0, "operation.radial_load_N": 3000.0})
    assert static_life(slow).million_turns == pytest.approx(history(slow, 2.0).life().million_turns, rel=0.05)


def test_trend_clearance_and_tilt_shorten_the_static_life(outer):
    """Trend: more clearance loads fewer rollers, a tilt the ends of a profiled one; both shorten the life."""
    lives = [
        static_life(outer.changed({"bearing.radial_clearance_mm": mm})).million_turns for mm in (0.0, 0.02, 0.05, 0.1)
    ]
    assert lives == sorted(lives, reverse=True) and lives[0] > 1.02 * lives[-1]
    level, tilted = (
        static_life(outer.changed({"bearing.roller_profile": "logarithmic", "bearing.tilt_mrad": mrad}))
        for mrad in (0.0, 2.0)
    )
    assert tilted.million_turns < 0.99 * level.million_turns


def test_unit_duty_of_scenes_is_that_of_their_lives(outer):
    """Unit: the duty of two scenes is made of their static lives, relative speeds and radial loads."""
    scenes = [outer, outer.changed({"operation.inner_speed_rpm": 6000.0, "operation.radial_load_N": 400.0})]
    life = roller_duty_life(scenes, (0.25, 0.75))
    hours = [static_life(scene).hours(*scene.operation.speeds) for scene in scenes]
    assert life.point_hours == pytest.approx(hours)
    assert 1.0 / life.hours == pytest.approx(0.25 / hours[0] + 0.75 / hours[1])
    assert life.equivalent_load == pytest.approx(
        ((0.25 * 24000.0 * 1300.0 ** (10 / 3) + 0.75 * 6000.0 * 400.0 ** (10 / 3)) / (0.25 * 24000.0 + 0.75 * 6000.0))
        ** 0.3
    )
