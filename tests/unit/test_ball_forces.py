"""Forces on one ball: against 40 digits for every raceway control, derivatives, smoothness, textbook law, action and reaction."""

import math

import numpy as np
import pytest
from ball_oracle import Bearing, derivatives
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp
from numba import njit

from rbdyn import BallScene
from rbdyn.properties.materials import MATERIALS
from rbdyn.quasistatic.row.ball import ball_forces, friction_force, smoothstep
from rbdyn.quasistatic.row.model import row_of

CONTROLS = ("common_cage", "outer", "inner", "half", "hybrid")
STEEL = MATERIALS["bearing_steel"]


def table_of(control, **model):
    """A 7008-like bearing, both rings turning."""
    return {
        "bearing": {
            "kind": "angular_contact_ball",
            "balls": 15,
            "ball_diameter_mm": 8.0,
            "pitch_diameter_mm": 54.0,
            "contact_angle_deg": 25.0,
            "inner_groove_factor": 0.52,
            "outer_groove_factor": 0.53,
        },
        "operation": {"inner_speed_rpm": 28_000.0, "outer_speed_rpm": -3_000.0},
        "model": {"raceway_control": control, **model},
    }


MODELS = {name: row_of(BallScene.from_dict(table_of(name))) for name in CONTROLS}
EXACT = {name: Bearing(table_of(name), STEEL, STEEL) for name in CONTROLS}


@njit
def compiled_forces(control, strength, row, a_axial, a_radial, x, y, di, do):
    return ball_forces(control, strength, row, a_axial, a_radial, x, y, di, do)


def places(model, inner_angle, outer_angle, di, do):
    """Inner groove centre and ball centre of a ball that touches at these angles [rad], so deep [m]."""
    row = model.row
    outer, inner = row.outer_reach[0] + do, row.inner_reach[0] + di
    x, y = outer * math.sin(outer_angle), outer * math.cos(outer_angle)
    return x + inner * math.sin(inner_angle), y + inner * math.cos(inner_angle), x, y


def by_digits(exact, place, di, do):
    """Residual and ring forces (5,) and their derivatives (5, 4) by A and X, the depths exactly ``di`` and ``do``."""
    a_axial, a_radial, x, y = (mp.mpf(value) for value in place)
    reach_i = mp.sqrt((a_axial - x) ** 2 + (a_radial - y) ** 2) - mp.mpf(di)
    reach_o = mp.sqrt(x**2 + y**2) - mp.mpf(do)

    def forces(*at):
        residual, ring, _, _ = exact.ball(*at, reach_i, reach_o)
        return (*residual, *ring)

    values = np.array([float(value) for value in forces(a_axial, a_radial, x, y)])
    return values, derivatives(forces, a_axial, a_radial, x, y)


def told_by(function, model, place, di, do):
    """The same from the code under test."""
    residual, ring, by_a, by_x, ring_a, ring_x, _, _ = function(model.control, 1.0, model.row, *place, di, do)
    slopes = np.vstack((np.reshape((*by_a, *ring_a), (5, 2)).T, np.reshape((*by_x, *ring_x), (5, 2)).T)).T
    return np.array([*residual, *ring]), slopes


DEPTH = st.floats(-7.0, -4.3).map(lambda power: 10.0**power)


@pytest.mark.parametrize("name", CONTROLS)
@given(inner=st.floats(-0.3, 1.5), spread=st.floats(-0.2, 0.4), di=DEPTH, do=DEPTH)
@settings(max_examples=25, deadline=None)
def test_oracle_forces_and_derivatives(name, inner, spread, di, do):
    """Oracle: residual, ring force and couple and all 20 derivatives against 40 digits, compiled and interpreted.

    From a few millinewton, where a ball goes with the cage and friction is at its limit, to kilonewtons.
    """
    model, exact = MODELS[name], EXACT[name]
    place = places(model, inner, max(inner - spread, -0.4), di, do)
    values, slopes = by_digits(exact, place, di, do)
    lever = np.array([1.0, 1.0, 1.0, 1.0, model.row.inner_groove_radius])
    force = model.row.inner_stiffness * di**1.5 + model.row.outer_stiffness * do**1.5
    force += 5.0 * model.row.centrifugal_force
    # An angle turns by 1/reach, a depth grows by itself: both may carry all of a force.
    stiff = force * (1.0 / model.row.inner_reach[0] + 1.5 / di + 1.5 / do)
    for function in (compiled_forces, ball_forces):
        found, turned = told_by(function, model, place, di, do)
        assert np.abs((found - values) / lever).max() < 1e-12 * force
        assert np.abs((turned - slopes) / lever[:, None]).max() < 1e-11 * stiff


@pytest.mark.parametrize("name", CONTROLS)
def test_unit_strength_leads_from_the_cage_to_the_race_control(name):
    """Unit: without strength the forces are those of one common cage speed; with half of it F_c lies half way."""
    model = MODELS[name]
    place = places(model, 0.6, 0.4, 12e-6, 11e-6)
    none, half, full = (
        compiled_forces(model.control, strength, model.row, *place, 12e-6, 11e-6) for strength in (0.0, 0.5, 1.0)
    )
    cage = MODELS["common_cage"]
    expected = compiled_forces(cage.control, 0.0, cage.row, *place, 12e-6, 11e-6)
    for part, wanted in zip(none, expected, strict=True):
        assert part == pytest.approx(wanted, rel=1e-14)
    assert half[6] == pytest.approx(0.5 * (none[6] + full[6]), rel=1e-14)
    assert half[7] == pytest.approx(0.5 * full[7], rel=1e-14)


@pytest.mark.parametrize("name", ["outer", "inner", "half", "hybrid"])
def test_unit_textbook_law_where_nothing_is_blended(name):
    """Unit: a loaded ball at a usual angle, its friction within 0.8 of the limit, meets the textbook equations to 1e-14."""
    model, row = MODELS[name], MODELS[name].row
    ai, ao, di, do = 0.62, 0.41, 14e-6, 13e-6
    residual, ring, *_, pull, moment = compiled_forces(model.control, 1.0, row, *places(model, ai, ao, di, do), di, do)
    qi, qo = row.inner_stiffness * di**1.5, row.outer_stiffness * do**1.5
    spinning = model.control.spinning
    if name == "hybrid":
        weight = model.control.inner_weight * (di / do) ** 2
        share = weight / (1.0 + weight)
    else:
        share = model.control.inner
    ti, to = (2.0 * part * moment / spinning.ball_diameter for part in (share, 1.0 - share))
    assert abs(ti) < 0.8 * spinning.friction * qi and abs(to) < 0.8 * spinning.friction * qo
    assert qi > spinning.blend_load and math.cos(ai) > 0.2 and abs(moment) > 1e-3
    axial = qi * math.sin(ai) - qo * math.sin(ao) - ti * math.cos(ai) + to * math.cos(ao)
    radial = qi * math.cos(ai) - qo * math.cos(ao) + ti * math.sin(ai) - to * math.sin(ao) + pull
    scale = qi + qo
    # The angles go through places and come back with the rounding of lengths.
    assert residual == pytest.approx((axial, radial), rel=0.0, abs=2e-14 * scale)
    expected = qi * math.sin(ai) - ti * math.cos(ai), qi * math.cos(ai) + ti * math.sin(ai)
    assert ring[:2] == pytest.approx(expected, rel=2e-14)
    assert ring[2] == pytest.approx(row.inner_groove_radius * ti, rel=2e-14)


@pytest.mark.parametrize("name", ["outer", "hybrid"])
@pytest.mark.parametrize("what", ["light load", "across the groove", "friction at its limit"])
def test_unit_blends_have_no_kink(name, what):
    """Unit: forces and derivatives from both sides of where each blend begins agree: the law is C1."""
    model = MODELS[name]
    spinning, row = model.control.spinning, model.row
    di = do = 8e-6
    ai, ao = 0.6, 0.4
    if what == "light load":
        di = (spinning.blend_load / row.inner_stiffness) ** (2.0 / 3.0)
    elif what == "across the groove":
        ai, ao = math.acos(0.2), 1.2
    else:
        told = compiled_forces(model.control, 1.0, row, *places(model, ai, ao, di, do), di, do)
        inner, outer = (
            stiffness * depth**1.5 for stiffness, depth in ((row.inner_stiffness, di), (row.outer_stiffness, do))
        )
        share = 0.0
        if name == "hybrid":
            weight = model.control.inner_weight
            share = weight / (1.0 + weight)
        used = max(share / inner, (1.0 - share) / outer) * 2.0 * abs(told[7]) / spinning.ball_diameter
        model = model._replace(control=model.control._replace(spinning=spinning._replace(friction=used / 0.8)))
    sides = []
    for off in (1.0 - 1e-9, 1.0 + 1e-9):
        place = places(model, ai * (off if what == "across the groove" else 1.0), ao, di * off, do)
        sides.append(told_by(compiled_forces, model, place, di * off, do))
    (low, low_slopes), (high, high_slopes) = sides
    assert np.abs(low - high).max() < 1e-7 * np.abs(low).max()
    assert np.abs(low_slopes - high_slopes).max() < 1e-6 * np.abs(low_slopes).max()


def test_unit_open_contacts_carry_nothing_of_the_race_control():
    """Unit: a ball clear of either race feels its springs and the common cage's centrifugal force only."""
    model = MODELS["outer"]
    for di, do in ((0.0, 9e-6), (9e-6, 0.0)):
        place = places(model, 0.6, 0.4, di, do)
        told = compiled_forces(model.control, 1.0, model.row, *place, di, do)
        cage = compiled_forces(MODELS["common_cage"].control, 1.0, model.row, *place, di, do)
        assert told == cage and told[7] == 0.0


@pytest.mark.parametrize("function", [smoothstep, smoothstep.py_func])
def test_unit_gradually_is_smooth(function):
    """Unit: from 0 to 1, level at both ends and beyond; its slope is its derivative."""
    assert function(0.0) == (0.0, 0.0) and function(1.0) == (1.0, 0.0) and function(7.0) == (1.0, 0.0)
    for part in np.linspace(0.01, 0.99, 23):
        assert function(part)[1] == pytest.approx(
            (function(part + 1e-6)[0] - function(part - 1e-6)[0]) / 2e-6, rel=1e-8
        )


@pytest.mark.parametrize("function", [friction_force, friction_force.py_func])
def test_unit_held_is_smooth_and_bounded(function):
    """Unit: all of a force up to 0.8 of the limit, never the limit itself; odd; value and slopes meet at 0.8."""
    for limit in (0.1, 30.0):
        for part in (0.0, 0.4, 0.79):
            assert function(part * limit, limit) == (part * limit, 1.0, 0.0)
        below, above = function(0.8 * limit, limit), function(0.8 * limit * (1.0 + 1e-12), limit)
        assert above == pytest.approx(below, rel=1e-10, abs=1e-10)
        for part in (0.9, 1.0, 3.0, 1e6):
            value, by_force, by_limit = function(part * limit, limit)
            assert 0.8 * limit < value < limit
            assert function(-part * limit, limit) == (-value, by_force, -by_limit)
            step = 1e-6
            forward = function(part * limit * (1.0 + step), limit)[0] - function(part * limit * (1.0 - step), limit)[0]
            assert by_force == pytest.approx(forward / (2.0 * step * part * limit), rel=1e-4)
            wider = function(part * limit, limit * (1.0 + step))[0] - function(part * limit, limit * (1.0 - step))[0]
            assert by_limit == pytest.approx(wider / (2.0 * step * limit), rel=1e-4)
