"""Roller profiles: closed forms, limits, and the pressure that Lundberg's profile is made for."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from rbdyn.contact import profile
from rbdyn.properties.materials import MATERIALS, equivalent_modulus

STEEL = equivalent_modulus(MATERIALS["bearing_steel"], MATERIALS["bearing_steel"])
LENGTH = 12e-3


@pytest.mark.parametrize("slices", [1, 2, 31, 200])
def test_unit_slice_centres(slices):
    """Unit: centres are symmetric, evenly spaced, half a slice from the ends."""
    x = profile.slice_centres(slices, LENGTH)
    assert x == pytest.approx(-x[::-1], abs=1e-18)
    assert x[0] == pytest.approx(-0.5 * LENGTH * (1.0 - 1.0 / slices), abs=1e-18)
    assert np.diff(x) == pytest.approx(np.full(slices - 1, LENGTH / slices), rel=1e-12)


def test_unit_logarithmic_relief():
    """Unit: 0.00035 D ln[1/(1 - (2x/l)^2)] for short rollers; a flat middle and 0.0005 D for long ones."""
    x = np.array([-1.2e-3, 0.0, 0.7e-3, 1.7e-3])
    expected = 0.00035 * 9e-3 * np.log(1.0 / (1.0 - (2.0 * x / 3.5e-3) ** 2))
    assert profile.logarithmic_relief(x, 9e-3, 3.5e-3) == pytest.approx(expected, rel=1e-12)
    long = profile.logarithmic_relief(np.array([0.0, 2.4e-3, 10e-3]), 9e-3, 27.5e-3)
    assert long[:2].tolist() == [0.0, 0.0]  # the flat is 27.5 - 22.5 = 5 mm long
    inside = (2.0 * 10e-3 - 5e-3) / 22.5e-3
    assert long[2] == pytest.approx(-0.0005 * 9e-3 * math.log(1.0 - inside**2), rel=1e-12)


@given(radius=st.floats(1e-2, 1e4), share=st.floats(-1.0, 1.0))
@settings(max_examples=200, deadline=None)
def test_unit_crown_is_a_circle(radius, share):
    """Unit: (R - drop)^2 + x^2 = R^2 to round-off, x^2/(2R) for flat crowns, even in x."""
    x = share * 5e-3
    drop = float(profile.crowned_relief(np.array([x]), radius)[0])
    # The circle without its cancelling term: 2 R drop = x^2 + drop^2.
    assert 2.0 * radius * drop == pytest.approx(x**2 + drop**2, rel=1e-14, abs=1e-300)
    assert drop == float(profile.crowned_relief(np.array([-x]), radius)[0])
    # The next term of the series is x^4/(8 R^3).
    assert drop == pytest.approx(x**2 / (2.0 * radius), rel=0.3 * (x / radius) ** 2 + 1e-15, abs=1e-300)


def test_unit_crown_reaches_the_end_of_the_roller():
    """Unit: the drop of a half circle at its end is its radius."""
    assert profile.crowned_relief(np.array([5e-3]), 5e-3)[0] == pytest.approx(5e-3)


def displacement(x, half_width, load):
    """Approach of two steel half-spaces on the centre line at x, under a strip of Hertz's pressure of length LENGTH.

    Along the strip the integral of 1/r is known; across it, y = b sin t takes the root from the pressure.
    """

    def ring(t):
        y = half_width * abs(math.sin(t))
        along = math.asinh((0.5 * LENGTH - x) / y) + math.asinh((0.5 * LENGTH + x) / y)
        return 2.0 * load / (math.pi * LENGTH) * math.cos(t) ** 2 * along

    across = 2.0 * quad(ring, 0.0, 0.5 * math.pi, epsrel=1e-11)[0]
    return 2.0 / (math.pi * STEEL) * across


@pytest.mark.parametrize("load", [500.0, 20e3])
def test_literature_lundberg_presses_uniformly(load):
    """Literature: the drop is the displacement that an axially uniform Hertz pressure gives two half-spaces.

    The closed form leaves out terms of (b/distance to the end)^2/4.
    """
    half_width = 0.01 * LENGTH
    for share in (0.2, 0.5, 0.8, 0.95):
        x = share * 0.5 * LENGTH
        needed = displacement(0.0, half_width, load) - displacement(x, half_width, load)
        drop = float(profile.lundberg_relief(np.array([x]), LENGTH, load, STEEL)[0])
        scale = 2.0 * load / (math.pi * LENGTH * STEEL)
        assert drop == pytest.approx(needed, abs=scale * (half_width / (0.5 * LENGTH - x)) ** 2)


def test_unit_lundberg_scales():
    """Unit: proportional to the load, nil in the middle, infinite at the ends, even."""
    x = np.array([-0.5, -0.3, 0.0, 0.3, 0.5]) * LENGTH
    once, twice = (profile.lundberg_relief(x, LENGTH, load, STEEL) for load in (1e3, 2e3))
    assert twice[1:4] == pytest.approx(2.0 * once[1:4], rel=1e-14)
    assert once[2] == 0.0 and math.isinf(once[0]) and math.isinf(once[4]) and once[1] == once[3]


def test_unit_table_relief():
    """Unit: straight lines between points; one half is mirrored; a whole table may be lopsided."""
    half = ((0.0, 0.0), (2e-3, 0.0), (6e-3, 8e-6))
    x = np.array([-6e-3, -4e-3, 0.0, 1e-3, 3e-3, 6e-3])
    assert profile.table_relief(x, half) == pytest.approx([8e-6, 4e-6, 0.0, 0.0, 2e-6, 8e-6], rel=1e-12)
    lopsided = ((-6e-3, 12e-6), (0.0, 0.0), (6e-3, 6e-6))
    assert profile.table_relief(x, lopsided) == pytest.approx([12e-6, 8e-6, 0.0, 1e-6, 3e-6, 6e-6], rel=1e-12)
    # A half that starts off the middle is level there.
    assert profile.table_relief(np.array([0.0]), ((1e-3, 2e-6), (6e-3, 9e-6)))[0] == 2e-6


@given(share=st.floats(-0.999, 0.999), other=st.floats(-0.999, 0.999))
@settings(max_examples=100, deadline=None)
def test_invariant_drops_grow_outward(share, other):
    """Invariant: no profile is negative, and none rises again toward the end."""
    near, far = sorted((abs(share), abs(other)))
    x = np.array([near, far]) * 0.5 * LENGTH
    for drop in (
        profile.logarithmic_relief(x, 9e-3, LENGTH),
        profile.logarithmic_relief(x, 2e-3, LENGTH),
        profile.crowned_relief(x, 1.0),
        profile.lundberg_relief(x, LENGTH, 1e3, STEEL),
    ):
        assert 0.0 <= drop[0] <= drop[1]
