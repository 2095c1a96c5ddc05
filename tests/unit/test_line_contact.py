"""Line contact: four laws and their slices against published numbers, against each other, and their own derivatives."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numba import njit
from scipy.integrate import quad
from scipy.optimize import brentq

from rbdyn.contact import hertz_line
from rbdyn.contact.profile import crowned_relief, logarithmic_relief, slice_centres
from rbdyn.properties.materials import MATERIALS, Material, equivalent_modulus

STEEL = equivalent_modulus(MATERIALS["bearing_steel"], MATERIALS["bearing_steel"])
LENGTH, GAMMA = 3.5e-3, 9.0 / 43.5
INNER_RADIUS = 1.0 / (1.0 / 4.5e-3 + 1.0 / 17.25e-3)
PLAIN = {
    "palmgren": hertz_line.palmgren(STEEL, LENGTH),
    "iso16281": hertz_line.iso_16281(STEEL, LENGTH),
    "houpert": hertz_line.houpert(STEEL, LENGTH, INNER_RADIUS),
    "logarithmic, inner": hertz_line.dowson_higginson(STEEL, LENGTH, -GAMMA),
    "logarithmic, outer": hertz_line.dowson_higginson(STEEL, LENGTH, GAMMA),
}
CENTRES = slice_centres(31, LENGTH)
RELIEF = logarithmic_relief(CENTRES, 9e-3, LENGTH)
ON_BAR = hertz_line.LineContactOnBar(3.73e8, 5e7)
CUT = {
    "profiled": hertz_line.slice_contact(PLAIN["palmgren"], RELIEF, CENTRES, 0.0, 0.0),
    "tilted": hertz_line.slice_contact(PLAIN["houpert"], np.zeros(31), CENTRES, 1e-3, 0.4),
    "profiled and tilted, logarithmic": hertz_line.slice_contact(
        PLAIN["logarithmic, inner"], crowned_relief(CENTRES, 1.0), CENTRES, -2e-3, -1.0
    ),
}
ULP = 2.3e-16


compiled_whole = njit(lambda contact, approach: hertz_line.whole_load(contact, approach))
compiled_whole_energy = njit(lambda contact, approach: hertz_line.whole_energy(contact, approach))
compiled_line = njit(lambda contact, overlap, nx, ny: hertz_line.line_load(contact, overlap, nx, ny))
compiled_line_energy = njit(lambda contact, overlap, nx, ny: hertz_line.line_energy(contact, overlap, nx, ny))


def approach_at(contact, load):
    """Approach [m] at which a plain law gives a load, by bracketing its logarithm."""
    excess = lambda t: math.log(compiled_whole(contact, math.exp(t))[0] / load)  # noqa: E731
    return math.exp(brentq(excess, math.log(1e-16), math.log(5e-4), xtol=1e-14))


def test_literature_palmgren():
    """Literature: 5.285e8 N/m^(10/9) for steel of 3.5 mm; delta = 3.84e-5 Q^0.9/l^0.8 (mm, N) to its three digits."""
    palmgren_steel = Material(206e9, 0.3, 7800.0)
    modulus = equivalent_modulus(palmgren_steel, palmgren_steel)
    assert hertz_line.palmgren(modulus, 3.5e-3).stiffness == pytest.approx(5.285e8, rel=1e-3)  # four digits
    for load in (50.0, 500.0, 5000.0):
        for length in (2.0, 3.5, 20.0):
            approach = 1e3 * (load / hertz_line.palmgren(STEEL, length * 1e-3).stiffness) ** 0.9
            assert approach == pytest.approx(3.84e-5 * load**0.9 / length**0.8, rel=0.01)


def test_literature_iso_16281():
    """Literature: 35948 l^(8/9) N/mm^(10/9) for both races in series, hence 77650 for one (four digits)."""
    contact = hertz_line.iso_16281(2.0 * 206e9 / (2.0 * 0.91), 1e-3)
    assert contact.stiffness * 1e-3 ** (10.0 / 9.0) == pytest.approx(77650.0, rel=1e-4)


# Approaches [um] worked out by hand from the formulas as printed, at 50, 200, 500 and 800 N.
APPROACHES = {
    "palmgren": (0.477, 1.660, 3.787, 5.781),
    "iso16281": (0.493, 1.716, 3.915, 5.976),
    "logarithmic, inner": (0.494, 1.754, 4.016, 6.124),
    "logarithmic, outer": (0.477, 1.686, 3.848, 5.854),
    "houpert": (0.450, 1.637, 3.843, 5.953),
}


@pytest.mark.parametrize("name", APPROACHES)
def test_literature_approaches(name):
    """Literature: approaches of the bearing of Chen et al. 2022 by each law, to 1 % (Houpert's radius: 2 %)."""
    for load, expected in zip((50.0, 200.0, 500.0, 800.0), APPROACHES[name], strict=True):
        tolerance = 0.02 if name == "houpert" else 0.01
        assert approach_at(PLAIN[name], load) * 1e6 == pytest.approx(expected, rel=tolerance)


def test_literature_laws_lie_close():
    """Literature: from 50 to 800 N any law lies within 7 % of Palmgren's."""
    for load in (50.0, 200.0, 500.0, 800.0):
        palmgren = approach_at(PLAIN["palmgren"], load)
        for contact in PLAIN.values():
            assert approach_at(contact, load) == pytest.approx(palmgren, rel=0.07)


@given(load=st.floats(-6.0, 5.0).map(lambda exponent: 10.0**exponent), outer=st.booleans())
@settings(max_examples=300, deadline=None)
def test_oracle_logarithmic_law_inverts(load, outer):
    """Oracle: load to approach by the formula as printed, and back by the law, to 1e-12 from 1e-6 to 1e5 N."""
    gamma = GAMMA if outer else -GAMMA
    argument = math.pi * STEEL * LENGTH**2 / (load * (1.0 + gamma))
    approach = 2.0 * load / (math.pi * STEEL * LENGTH) * math.log(argument)
    contact = hertz_line.dowson_higginson(STEEL, LENGTH, gamma)
    assert compiled_whole(contact, approach)[0] == pytest.approx(load, rel=1e-12)
    assert hertz_line.whole_load(contact, approach)[0] == pytest.approx(load, rel=1e-12)


@pytest.mark.parametrize("contact", [*PLAIN.values(), ON_BAR], ids=[*PLAIN, "on bar"])
@given(approach=st.floats(-9.0, -4.3).map(lambda exponent: 10.0**exponent))
@settings(max_examples=40, deadline=None)
def test_oracle_derivatives_of_plain_laws(contact, approach):
    """Oracle: the energy's slope is the load, the load's the stiffness, by central differences of fourth order.

    Steps of 1e-3 of the approach err by 1e-12, and round-off by 1e-13 over a step.
    """
    step = 1e-3 * approach

    def slope(function):
        near, far = function(approach + step) - function(approach - step), function(approach + 2.0 * step)
        return (8.0 * near - far + function(approach - 2.0 * step)) / (12.0 * step)

    load, stiffness = compiled_whole(contact, approach)
    assert slope(lambda d: compiled_whole_energy(contact, d)) == pytest.approx(load, rel=3e-10)
    assert slope(lambda d: compiled_whole(contact, d)[0]) == pytest.approx(stiffness, rel=3e-10)


def slices_of(contact):
    return [hertz_line.slice_of(contact, k) for k in range(contact.share.size)]


@pytest.mark.parametrize("contact", CUT.values(), ids=CUT.keys())
@given(overlap=st.floats(-1e-6, 1e-5), azimuth=st.floats(-math.pi, math.pi))
@settings(max_examples=60, deadline=None)
def test_oracle_derivatives_of_sliced_laws(contact, overlap, azimuth):
    """Oracle: the same for sliced and tilted contacts, while no slice is about to close."""
    nx, ny, step = math.cos(azimuth), math.sin(azimuth), 1e-11
    slices = slices_of(contact)
    assume(min(abs(overlap - hertz_line.slice_drop(contact, one, nx, ny)) for one in slices) > 1e-9)
    load, stiffness, approach, lean = compiled_line(contact, overlap, nx, ny)
    ends = [overlap + step, overlap - step]
    energies = [compiled_line_energy(contact, end, nx, ny) for end in ends]
    loads = [compiled_line(contact, end, nx, ny)[0] for end in ends]
    # Round-off of the overlap, 2e-21 m, and of energies of millijoules, over a step of 1e-11 m.
    assert (energies[0] - energies[1]) / (2.0 * step) == pytest.approx(load, rel=1e-6, abs=1e-6)
    assert (loads[0] - loads[1]) / (2.0 * step) == pytest.approx(stiffness, rel=1e-5, abs=10.0)
    assert (load > 0.0) == (stiffness > 0.0) and approach > 0.0
    turn = 1e-7
    turned = [
        compiled_line_energy(contact, overlap, math.cos(azimuth + by), math.sin(azimuth + by)) for by in (turn, -turn)
    ]
    # A turn lifts the ends of the roller by some 2e-10 m.
    assume(min(abs(overlap - hertz_line.slice_drop(contact, one, nx, ny)) for one in slices) > 1e-8)
    assert (turned[0] - turned[1]) / (2.0 * turn) == pytest.approx(lean * load, rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("contact", [*PLAIN.values(), *CUT.values()], ids=[*PLAIN, *CUT])
def test_unit_open_contact_carries_nothing(contact):
    """Unit: across a gap load and energy are exactly nil; NaN is not taken for a gap."""
    for gap in (-1e-5, -1e-3, -1.0):
        load, _, approach, _ = compiled_line(contact, gap, 1.0, 0.0)
        assert load == 0.0 and approach > 0.0
        assert compiled_line_energy(contact, gap, 1.0, 0.0) == 0.0
    assert math.isnan(compiled_line(contact, math.nan, 1.0, 0.0)[0])


@pytest.mark.parametrize("slices", [1, 2, 7, 31, 200])
@pytest.mark.parametrize("name", ["palmgren", "logarithmic, inner", "houpert"])
def test_unit_slices_of_a_cylinder_sum_to_one(name, slices):
    """Unit: without a profile any number of slices gives the same load, stiffness and energy, to round-off."""
    positions = slice_centres(slices, LENGTH)
    level = hertz_line.slice_contact(PLAIN[name], np.zeros(slices), positions, 0.0, 0.0)
    tilted = hertz_line.slice_contact(PLAIN[name], np.zeros(slices), positions, 1e-3, 0.0)
    for overlap in (1e-9, 1e-6, 1e-5):
        whole = (*compiled_line(PLAIN[name], overlap, 1.0, 0.0), compiled_whole_energy(PLAIN[name], overlap))
        # Ninety degrees from where the tilt is largest, the rings are parallel.
        for contact, nx, ny in ((level, 1.0, 0.0), (tilted, 0.0, 1.0)):
            found = (*compiled_line(contact, overlap, nx, ny), compiled_line_energy(contact, overlap, nx, ny))
            assert found == pytest.approx(whole, rel=4.0 * ULP * max(slices, 4))


def test_oracle_slices_of_a_tilted_cylinder():
    """Oracle: a tilt that opens one end loads a length c of the roller: Q = (9/19) K/l theta^(10/9) c^(19/9)."""
    tilt, stiffness = 2e-3, PLAIN["palmgren"].stiffness
    contact = hertz_line.slice_contact(PLAIN["palmgren"], np.zeros(2001), slice_centres(2001, LENGTH), tilt, 0.0)
    for touching in (1e-3, 2e-3, 3e-3):
        # The overlap of the middle, where the end of the loaded length just touches.
        overlap = tilt * (touching - 0.5 * LENGTH)
        expected = 9.0 / 19.0 * stiffness / LENGTH * tilt ** (10.0 / 9.0) * touching ** (19.0 / 9.0)
        for nx in (1.0, -1.0):
            # Midpoints of 2001 slices: the sum errs as their square, but for the last, half-loaded one.
            assert compiled_line(contact, overlap, nx, 0.0)[0] == pytest.approx(expected, rel=1e-5)


def test_literature_31_slices_are_enough():
    """Literature: ISO/TS 16281 asks for 30 slices: 31 and 301 agree to 1 % under load, profiled or tilted."""
    for tilt in (0.0, 1e-3):
        coarse, fine = (
            hertz_line.slice_contact(
                PLAIN["palmgren"],
                logarithmic_relief(slice_centres(n, LENGTH), 9e-3, LENGTH),
                slice_centres(n, LENGTH),
                tilt,
                0.0,
            )
            for n in (31, 301)
        )
        for overlap in (2e-6, 5e-6, 1e-5):
            expected = compiled_line(fine, overlap, 1.0, 0.0)[0]
            assert compiled_line(coarse, overlap, 1.0, 0.0)[0] == pytest.approx(expected, rel=0.01)


@given(approach=st.floats(1e-10, 1e-3), stiffness=st.floats(1e6, 1e10), bar=st.floats(1e5, 1e10))
@settings(max_examples=150, deadline=None)
def test_oracle_line_contact_on_bar(approach, stiffness, bar):
    """Oracle: indentation plus bar deflection make up the approach, as bracketing finds it."""
    load, _ = compiled_whole(hertz_line.LineContactOnBar(stiffness, bar), approach)
    indentation = brentq(
        lambda d: d + stiffness * d ** (10.0 / 9.0) / bar - approach, 0.0, approach, xtol=1e-300, rtol=1e-15
    )
    # The load is a tenth power of the unknown, which Halley's method leaves within some ulps.
    assert load == pytest.approx(stiffness * indentation ** (10.0 / 9.0), rel=1e-13)


@pytest.mark.parametrize("name", [*PLAIN, *CUT, "on bar"])
def test_oracle_energy_is_the_integral_of_load(name):
    """Oracle: stored energy against adaptive quadrature, whose own error is asked to be 1e-12."""
    contact = (PLAIN | CUT).get(name)
    for overlap in (3e-7, 2e-6, 2e-5):
        if contact is None:
            load, energy = (lambda d: compiled_whole(ON_BAR, max(d, 1e-18))[0], compiled_whole_energy(ON_BAR, overlap))
        else:
            load, energy = (
                lambda d: compiled_line(contact, d, 0.6, 0.8)[0],
                compiled_line_energy(contact, overlap, 0.6, 0.8),
            )
        kinks = [0.0, overlap]
        if name in CUT:
            kinks = [-5e-6, overlap] + [hertz_line.slice_drop(contact, one, 0.6, 0.8) for one in slices_of(contact)]
        # Slices on either side of the middle close together, but for round-off.
        points = sorted({round(point, 14) for point in kinks if point < overlap} | {overlap})
        integral = sum(quad(load, a, b, epsrel=1e-12, epsabs=0.0)[0] for a, b in pairwise(points))
        assert energy == pytest.approx(integral, rel=1e-9)


@pytest.mark.parametrize("name", [*PLAIN, *CUT])
def test_unit_contact_compiled_equals_interpreted(name):
    """Unit: load, stiffness and energy agree compiled and interpreted, to a few ulps of each slice."""
    contact = (PLAIN | CUT)[name]
    for overlap in map(float, np.logspace(-9, -4, 20)):
        found = (*compiled_line(contact, overlap, 0.6, 0.8), compiled_line_energy(contact, overlap, 0.6, 0.8))
        expected = (
            *hertz_line.line_load(contact, overlap, 0.6, 0.8),
            hertz_line.line_energy(contact, overlap, 0.6, 0.8),
        )
        # The kernels that a law calls stay compiled; contraction costs an ulp a term.
        assert found == pytest.approx(expected, rel=1e-12)


@njit
def compiled_root(contact, approach):
    load, stiffness = hertz_line.whole_load(contact, approach)
    return load, stiffness, hertz_line.root_stiffness(contact, stiffness, approach)


@pytest.mark.parametrize("name", PLAIN)
@given(approach=st.floats(1e-12, 1e-4))
@settings(max_examples=40, deadline=None)
def test_unit_root_stiffness_is_the_root(name, approach):
    """Unit: the root of the stiffness, by whatever way a law has it, squares to the stiffness to a few ulps."""
    load, stiffness, root = compiled_root(PLAIN[name], approach)
    assert root * root == pytest.approx(stiffness, rel=4e-15)
    if isinstance(PLAIN[name], hertz_line.LineContact):
        assert load == pytest.approx(PLAIN[name].stiffness * approach ** (10.0 / 9.0), rel=1e-14)
