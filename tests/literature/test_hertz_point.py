"""Point contact: tables, closed forms, an independent root, limits and symmetry."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq
from scipy.special import ellipe, ellipkm1

from rbdyn.contact import point_contact as hertz
from rbdyn.properties.materials import MATERIALS, equivalent_modulus

STEEL = equivalent_modulus(MATERIALS["bearing_steel"], MATERIALS["bearing_steel"])

# Harris, Rolling Bearing Analysis, table of dimensionless contact parameters: F, a*, b*, delta*.
HARRIS = [
    (0.0, 1.0, 1.0, 1.0),
    (0.1075, 1.0760, 0.9318, 0.9974),
    (0.3204, 1.2623, 0.8114, 0.9761),
    (0.4795, 1.4556, 0.7278, 0.9429),
    (0.5916, 1.6440, 0.6687, 0.9077),
    (0.6716, 1.8258, 0.6245, 0.8733),
    (0.7332, 2.011, 0.5881, 0.8394),
    (0.7948, 2.265, 0.5480, 0.7961),
    (0.83495, 2.494, 0.5186, 0.7602),
    (0.87366, 2.800, 0.4863, 0.7169),
    (0.90999, 3.233, 0.4499, 0.6636),
    (0.93657, 3.738, 0.4166, 0.6112),
    (0.95738, 4.395, 0.3830, 0.5551),
    (0.97290, 5.267, 0.3490, 0.4960),
    (0.983797, 6.448, 0.3150, 0.4352),
    (0.990902, 8.062, 0.2814, 0.3745),
    (0.995112, 10.222, 0.2497, 0.3176),
    (0.997300, 12.789, 0.2232, 0.2705),
    (0.9989156, 17.974, 0.1882, 0.2106),
    (0.9998527, 37.38, 0.1305, 0.11995),
]


def contact_area(contact, load):
    """Area of the contact ellipse [m^2], pi a b, under a load [N]."""
    return math.pi * contact.semi_major * contact.semi_minor * np.cbrt(load) ** 2


def hamrock_brewe(curvature_sum, curvature_difference):
    """Ellipticity and stiffness of steel by fits: k = 1.0339 (R_y/R_x)^0.636 (Brewe and Hamrock 1977).

    E = 1.0003 + 0.5968 R_x/R_y and K = 1.5277 + 0.6023 ln(R_y/R_x), made for R_y/R_x from 1 to 100.
    """
    ratio = (1.0 + curvature_difference) / (1.0 - curvature_difference)
    k, first, second = 1.0339 * ratio**0.636, 1.5277 + 0.6023 * math.log(ratio), 1.0003 + 0.5968 / ratio
    ellipse = (math.pi / (2.0 * k**2 * second)) ** (1.0 / 3.0)
    approach = first / math.pi * ellipse * (3.0 / (curvature_sum * STEEL)) ** (2.0 / 3.0) * curvature_sum
    return k, approach**-1.5


@pytest.mark.parametrize(("difference", "major", "minor", "approach"), HARRIS)
def test_literature_dimensionless_parameters(difference, major, minor, approach):
    """Literature: a*, b* and delta* of Harris, to their printed digits (S = 3, E' = 1 make them the constants)."""
    contact = hertz.point_contact(3.0, difference, 1.0)
    assert contact.semi_major == pytest.approx(major, rel=2.5e-4)
    assert contact.semi_minor == pytest.approx(minor, abs=7e-5)
    assert contact.stiffness ** (-2.0 / 3.0) / 1.5 == pytest.approx(approach, abs=4e-4)


def test_literature_curvatures_of_two_bearings():
    """Literature: Harris's 209 (D 12.7, d_m 65, f 0.52) and 218 (D 22.23, d_m 125.3, 40 deg, f 0.5232)."""
    gamma = 12.7 / 65.0
    inner, outer = (hertz.race_curvature(12.7, 0.52, sign * gamma) for sign in (1.0, -1.0))
    assert inner == pytest.approx((0.202, 0.9399), rel=2e-3)
    assert outer == pytest.approx((0.1378, 0.9120), rel=5e-4)
    gamma = 22.23 * math.cos(math.radians(40.0)) / 125.3
    assert gamma == pytest.approx(0.1359, abs=5e-5)
    assert hertz.race_curvature(22.23, 0.5232, gamma) == pytest.approx((0.108, 0.9260), rel=2e-3)


def test_closed_form_of_a_sphere_on_a_plane():
    """Closed form: a^3 = 3 Q R/(2 E'), delta = a^2/R, p_0 = (3 Q E'^2/(2 pi^3 R^2))^(1/3); and the crossed cylinders."""
    radius, load = 5e-3, 80.0
    contact = hertz.point_contact(2.0 / radius, 0.0, STEEL)
    semi_axis = (1.5 * load * radius / STEEL) ** (1.0 / 3.0)
    assert contact.ellipticity == 1.0
    assert contact.elliptic_second == pytest.approx(0.5 * math.pi, rel=1e-15)
    assert contact.semi_major * np.cbrt(load) == pytest.approx(semi_axis, rel=1e-14)
    assert (load / contact.stiffness) ** (2.0 / 3.0) == pytest.approx(semi_axis**2 / radius, rel=1e-14)
    assert contact.stiffness == pytest.approx(2.0 / 3.0 * STEEL * math.sqrt(radius), rel=1e-14)
    pressure = (1.5 * load * STEEL**2 / (math.pi**3 * radius**2)) ** (1.0 / 3.0)
    assert hertz.peak_pressure(contact, load) == pytest.approx(pressure, rel=1e-14)
    assert contact_area(contact, load) == pytest.approx(math.pi * semi_axis**2, rel=1e-14)


@settings(max_examples=60, deadline=None)
@given(st.floats(-10.0, -1e-3), st.booleans())
def test_oracle_ellipticity_by_another_root(exponent, near_line):
    """Oracle: bisection of the defining equation with scipy's elliptic integrals, from near circle to near line."""
    difference = 1.0 - 10.0**exponent if near_line else 10.0 ** max(exponent, -3.0)
    contact = hertz.point_contact(100.0, difference, STEEL)

    def miss(log_k):
        complement = math.exp(-2.0 * log_k)
        first, second = ellipkm1(complement), ellipe(1.0 - complement)
        return 2.0 * complement * (first - second) / ((1.0 - complement) * second) - (1.0 - difference)

    log_k = brentq(miss, 1e-6, 30.0, xtol=1e-15, rtol=1e-14)
    assert math.log(contact.ellipticity) == pytest.approx(log_k, rel=1e-9)
    first, second = ellipkm1(math.exp(-2.0 * log_k)), ellipe(-math.expm1(-2.0 * log_k))
    approach = (
        first
        / math.pi
        * (math.pi / (2.0 * math.exp(2.0 * log_k) * second)) ** (1.0 / 3.0)
        * (3.0 / (100.0 * STEEL)) ** (2.0 / 3.0)
        * 100.0
    )
    assert contact.stiffness == pytest.approx(approach**-1.5, rel=1e-9)
    assert contact.elliptic_second == pytest.approx(second, rel=1e-9)


@settings(max_examples=60, deadline=None)
@given(st.floats(0.0, 1.0, exclude_max=True), st.floats(1.0, 1e4), st.floats(1e-2, 1e4))
def test_invariant_pressure_carries_the_load(difference, total, load):
    """Invariant: 2/3 p_0 pi a b = Q; lengths scale as 1/S; F of the found ellipse is F again."""
    contact = hertz.point_contact(total, difference, STEEL)
    carried = 2.0 / 3.0 * hertz.peak_pressure(contact, load) * contact_area(contact, load)
    assert carried == pytest.approx(load, rel=1e-13)
    twice = hertz.point_contact(2.0 * total, difference, STEEL)
    assert twice.semi_major == pytest.approx(contact.semi_major * 2.0 ** (-1.0 / 3.0), rel=1e-13)
    assert twice.stiffness == pytest.approx(contact.stiffness / math.sqrt(2.0), rel=1e-13)
    again = hertz.ellipse(math.log(contact.ellipticity))
    assert again.curvature_difference == pytest.approx(difference, rel=1e-10, abs=1e-14)
    assert again.curvature_difference + again.curvature_complement == pytest.approx(1.0, abs=1e-14)


def test_limit_circle_is_reached_smoothly():
    """Limit: k - 1 -> 4 F/3 and all constants of the circle as F -> 0."""
    circle = hertz.point_contact(100.0, 0.0, STEEL)
    for difference in (1e-14, 1e-10, 1e-6):
        contact = hertz.point_contact(100.0, difference, STEEL)
        assert contact.ellipticity - 1.0 == pytest.approx(4.0 / 3.0 * difference, rel=1e-5, abs=5e-16)
        assert contact.stiffness == pytest.approx(circle.stiffness, rel=1e-11)


@pytest.mark.parametrize("groove", [0.515, 0.52, 0.53, 0.56])
@pytest.mark.parametrize("gamma", [-0.3, -0.1, 0.0, 0.1, 0.3])
def test_fit_of_brewe_and_hamrock_agrees(groove, gamma):
    """Cross-check: the fits are within 3.1 % in stiffness and ellipticity for R_y/R_x from 7 to 49."""
    exact = hertz.ball_on_race(10e-3, groove, gamma, STEEL)
    ellipticity, stiffness = hamrock_brewe(*hertz.race_curvature(10e-3, groove, gamma))
    assert stiffness == pytest.approx(exact.stiffness, rel=0.031)
    assert ellipticity == pytest.approx(exact.ellipticity, rel=0.031)
    assert stiffness != pytest.approx(exact.stiffness, rel=1e-6)


def test_inner_race_is_softer_and_bears_more_pressure():
    """The convex race: smaller ellipse across the rolling direction, more pressure, less stiffness."""
    inner, outer = (hertz.ball_on_race(10e-3, 0.52, gamma, STEEL) for gamma in (0.2, -0.2))
    assert hertz.peak_pressure(inner, 100.0) > hertz.peak_pressure(outer, 100.0)
    assert inner.stiffness < outer.stiffness
    loads = np.array([0.0, 1.0, 8.0])
    assert hertz.peak_pressure(inner, loads) == pytest.approx(hertz.peak_pressure(inner, 1.0) * np.array([0, 1, 2]))
