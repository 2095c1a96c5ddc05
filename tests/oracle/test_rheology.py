"""Traction of an oil film from its rheology, and the film itself: published numbers, closed forms and limits."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from four_constants import fit_four_constants
from scipy.integrate import quad
from scipy.special import iv, modstruve

from rbdyn.contact import film_thickness as films
from rbdyn.contact import rheology
from rbdyn.properties.materials import oil_at

INNER = films.RollingContact(3.57e-3, 3.5e-3, 226.4e9, 26.2)
OUTER = INNER._replace(radius=5.43e-3)
FILM = 0.2e-6

# Least-squares A-D for the inner contact at 26 m/s and slips of 0 to 10 m/s, A = -D, computed apart from this code:
# oil, temperature [C], p_H [GPa], B [s/m], C [s/m], D, peak of the curve, rms of the fit.
TABLE = [
    ("MIL-L-7808", 80, 0.4, 0.0019, 0.049, 0.0007, 0.0119, 0.0001),
    ("MIL-L-7808", 80, 0.6, 0.0037, 0.090, 0.0000, 0.0150, 0.0001),
    ("MIL-L-7808", 80, 0.8, 0.0063, 0.176, 0.0084, 0.0187, 0.0002),
    ("MIL-L-7808", 80, 1.0, 0.0115, 0.346, 0.0175, 0.0246, 0.0002),
    ("MIL-L-7808", 80, 1.2, 0.0269, 0.533, 0.0223, 0.0338, 0.0004),
    ("MIL-L-7808", 80, 1.4, 0.0625, 0.744, 0.0266, 0.0477, 0.0014),
    ("MIL-L-7808", 100, 0.4, 0.0013, 0.030, 0.0000, 0.0095, 0.0000),
    ("MIL-L-7808", 100, 0.6, 0.0025, 0.062, 0.0000, 0.0131, 0.0001),
    ("MIL-L-7808", 100, 0.8, 0.0052, 0.110, 0.0000, 0.0173, 0.0001),
    ("MIL-L-7808", 100, 1.0, 0.0082, 0.242, 0.0149, 0.0228, 0.0002),
    ("MIL-L-7808", 100, 1.2, 0.0178, 0.420, 0.0221, 0.0312, 0.0002),
    ("MIL-L-7808", 100, 1.4, 0.0429, 0.614, 0.0275, 0.0440, 0.0008),
    ("MIL-L-7808", 120, 0.4, 0.0002, 0.029, 0.0217, 0.0069, 0.0000),
    ("MIL-L-7808", 120, 0.6, 0.0016, 0.040, 0.0000, 0.0104, 0.0001),
    ("MIL-L-7808", 120, 0.8, 0.0034, 0.078, 0.0000, 0.0152, 0.0001),
    ("MIL-L-7808", 120, 1.0, 0.0067, 0.143, 0.0049, 0.0205, 0.0002),
    ("MIL-L-7808", 120, 1.2, 0.0115, 0.309, 0.0201, 0.0280, 0.0002),
    ("MIL-L-7808", 120, 1.4, 0.0276, 0.492, 0.0271, 0.0395, 0.0004),
    ("MIL-L-23699", 80, 0.4, 0.0030, 0.077, 0.0000, 0.0138, 0.0001),
    ("MIL-L-23699", 80, 0.6, 0.0057, 0.147, 0.0038, 0.0165, 0.0001),
    ("MIL-L-23699", 80, 0.8, 0.0098, 0.332, 0.0152, 0.0217, 0.0002),
    ("MIL-L-23699", 80, 1.0, 0.0246, 0.539, 0.0197, 0.0302, 0.0004),
    ("MIL-L-23699", 80, 1.2, 0.0615, 0.778, 0.0236, 0.0439, 0.0014),
    ("MIL-L-23699", 80, 1.4, 0.1463, 1.090, 0.0278, 0.0658, 0.0036),
    ("MIL-L-23699", 100, 0.4, 0.0019, 0.051, 0.0000, 0.0111, 0.0001),
    ("MIL-L-23699", 100, 0.6, 0.0040, 0.101, 0.0000, 0.0145, 0.0001),
    ("MIL-L-23699", 100, 0.8, 0.0067, 0.227, 0.0118, 0.0189, 0.0002),
    ("MIL-L-23699", 100, 1.0, 0.0153, 0.424, 0.0185, 0.0263, 0.0002),
    ("MIL-L-23699", 100, 1.2, 0.0400, 0.642, 0.0232, 0.0381, 0.0008),
    ("MIL-L-23699", 100, 1.4, 0.0992, 0.908, 0.0278, 0.0570, 0.0024),
    ("MIL-L-23699", 120, 0.4, 0.0011, 0.032, 0.0005, 0.0080, 0.0000),
    ("MIL-L-23699", 120, 0.6, 0.0024, 0.070, 0.0000, 0.0118, 0.0001),
    ("MIL-L-23699", 120, 0.8, 0.0054, 0.132, 0.0016, 0.0160, 0.0001),
    ("MIL-L-23699", 120, 1.0, 0.0093, 0.315, 0.0158, 0.0221, 0.0002),
    ("MIL-L-23699", 120, 1.2, 0.0244, 0.520, 0.0215, 0.0321, 0.0003),
    ("MIL-L-23699", 120, 1.4, 0.0637, 0.755, 0.0266, 0.0479, 0.0014),
]


def load_at(contact, pressure):
    """Load that makes a Hertz pressure."""
    return 2.0 * math.pi * contact.radius * contact.length * pressure**2 / contact.equivalent_modulus


def test_oracle_four_constants_of_the_thermal_curve():
    """Oracle: 36 published sets of A-D, oil by temperature by pressure, to the digits they are printed with.

    Refitting all 36 curves gives their rms to half a digit (and 1e-5 for slips sampled elsewhere), and their peaks
    to 1 % (0.7 % at worst, of which half a digit is up to 0.7 %). The printed constants themselves miss our curves
    by the rms stated, to half a digit, for 26 of the 36; by up to 1e-4 more for 10, where half a digit of B, up to
    4e-4 in the coefficient, explains it.
    """
    contact, slip = INNER._replace(entrainment_speed=26.0), np.linspace(0.0, 10.0, 201)
    within = 0
    for name, celsius, pressure, b, c, d, peak, rms in TABLE:
        oil, load = oil_at(name, celsius), load_at(contact, pressure * 1e9)
        film = films.film_in_service(contact, oil, load)
        law = rheology.thermal_newtonian(name, celsius, oil.conductivity)
        curve = rheology.traction_coefficient(law, contact, slip, load, film)
        fit = fit_four_constants(slip, curve)
        assert fit.a == -fit.d and min(fit.b, fit.c, fit.d) >= 0.0
        assert fit.rms == pytest.approx(rms, abs=6e-5)
        assert curve.max() == pytest.approx(peak, rel=0.01)
        miss = math.sqrt(np.mean(((b * slip - d) * np.exp(-c * slip) + d - curve) ** 2))
        assert miss < rms + 1e-4
        within += miss < rms + 0.5e-4
    assert within == 26


def test_oracle_fit_finds_the_constants_of_its_own_law():
    """Oracle: constants that made a curve come back, to 1e-6, and the curve to 1e-9."""
    slip = np.linspace(0.0, 10.0, 101)
    fit = fit_four_constants(slip, (0.10178 * slip - 0.036) * np.exp(-1.54727 * slip) + 0.036)
    assert (fit.a, fit.b, fit.c, fit.d) == pytest.approx((-0.036, 0.10178, 1.54727, 0.036), rel=1e-6)
    assert fit.rms < 1e-9


def test_literature_oil_pressure_coefficients():
    """Literature: 11.8, 8.6, 7.6, 6.8, 5.9 per GPa for MIL-L-7808 at 40 to 150 C; held below -40 C, always positive."""
    for celsius, value in ((40.0, 11.8), (80.0, 8.6), (100.0, 7.6), (120.0, 6.8), (150.0, 5.9)):
        assert oil_at("MIL-L-7808", celsius).pressure_coefficient * 1e9 == pytest.approx(value, abs=0.05)
    assert oil_at("MIL-L-7808", -60.0).pressure_coefficient == pytest.approx(
        oil_at("MIL-L-7808", -40.0).pressure_coefficient
    )
    # No printed value for the other oil: its formula by hand at 5.0 mPa s.
    by_hand = math.exp(1.15607 * math.log(5.0e-3) - 17.496) / 5.0e-3
    assert oil_at("MIL-L-23699", 100.0).pressure_coefficient == pytest.approx(by_hand, rel=0.01)


def test_literature_film_of_the_papers_bearing():
    """Literature: 0.20 and 0.23 um at 100 C, 0.15 and 0.18 um at 120 C, heating 0.88 to 0.91, Lambda 1.25 to 1.5.

    Loads are not printed with the values: 674 N gives the films at 100 C to half a digit; at 120 C they come out at
    0.152 and 0.180. The heating is 0.877 to 0.885 at 674 N and 0.899 to 0.902 at the 54 N of an unloaded roller.
    Lambda with 0.1 um each is 1.21 to 1.45 with heating and 1.38 to 1.64 without; the printed range lies between.
    """
    for celsius, inner, outer in ((100.0, 0.20, 0.23), (120.0, 0.15, 0.18)):
        oil = oil_at("MIL-L-7808", celsius)
        assert films.central_film(INNER, oil, 674.0) * 1e6 == pytest.approx(inner, abs=0.0055)
        assert films.film_in_service(OUTER, oil, 674.0) * 1e6 < outer
    oil = oil_at("MIL-L-7808", 100.0)
    for contact in (INNER, OUTER):
        for load in (674.0, 387.0, 54.0):
            assert 0.875 < films.thermal_factor(contact, oil, load) < 0.915
    loaded = films.lambda_ratio(films.film_in_service(INNER, oil, 674.0), 0.1e-6, 0.1e-6)
    light = films.lambda_ratio(films.film_in_service(OUTER, oil, 387.0), 0.1e-6, 0.1e-6)
    assert 1.15 < loaded < light < 1.6
    assert films.hertz_pressure(INNER, 674.0) == pytest.approx(1.39e9, rel=5e-3)


def test_unit_film_groups():
    """Unit: exponents of speed, load and pressure coefficient; heating and starvation only thin; sliding heats."""
    oil = oil_at("MIL-L-7808", 100.0)
    faster = INNER._replace(entrainment_speed=2.0 * INNER.entrainment_speed)
    for film, speed, load in ((films.central_film, 0.69, -0.10), (films.minimum_film, 0.70, -0.13)):
        one = film(INNER, oil, 500.0)
        assert film(faster, oil, 500.0) == pytest.approx(2.0**speed * one, rel=1e-12)
        assert film(INNER, oil, 1000.0) == pytest.approx(2.0**load * one, rel=1e-12)
    assert films.minimum_film(INNER, oil, 500.0) < films.central_film(INNER, oil, 500.0)
    factor = [films.thermal_factor(INNER, oil, 500.0, slip) for slip in (0.0, 1.0, 5.0, 20.0)]
    assert all(0.0 < b < a < 1.0 for a, b in pairwise(factor))
    cold = oil_at("MIL-L-7808", -40.0)
    assert 0.0 < films.thermal_factor(faster, cold, 5000.0) < 0.1
    starved = [float(films.film_in_service(INNER, oil, 500.0, d)) for d in (1e-3, 0.1, 1.0, 10.0)]
    assert starved == sorted(starved) and starved[0] < 0.1 * starved[-1]
    assert starved[-1] <= films.film_in_service(INNER, oil, 500.0)
    # Halving of the half-width, and of the pressure, with a quarter of the load.
    assert films.half_width(INNER, 100.0) == pytest.approx(0.5 * films.half_width(INNER, 400.0), rel=1e-12)
    mean = 500.0 / (2.0 * films.half_width(INNER, 500.0) * INNER.length)
    assert films.hertz_pressure(INNER, 500.0) == pytest.approx(4.0 / math.pi * mean, rel=1e-12)


def test_colder_oil_has_no_thinner_film():
    """Limit: with viscosity and its slope alone, films grow until inlet heating holds them; the fit alone let them fall by ten."""
    oil = oil_at("MIL-L-23699", 20.0)
    thicker = np.logspace(-3.0, 5.0, 60)
    for speed in (3.0, 10.0, 30.0):
        contact = INNER._replace(entrainment_speed=speed)
        films_m = [
            films.film_in_service(
                contact, replace(oil, viscosity=k * oil.viscosity, viscosity_slope=k * oil.viscosity_slope), 8000.0
            )
            for k in thicker
        ]
        slopes = np.diff(np.log(films_m)) / np.diff(np.log(thicker))
        assert np.all(slopes > 0.0) and slopes[-1] == pytest.approx(0.69 - 0.67, abs=1e-6)


def test_unit_lightest_load_is_where_two_films_meet():
    """Unit: Martin's film of rigid cylinders, 4.9 R U/W, equals the elastic one there, to round-off."""
    for oil in (oil_at("MIL-L-7808", 100.0), oil_at("MIL-L-23699", 20.0)):
        load = films.lightest_load(INNER, oil)
        rigid = 4.9 * oil.viscosity * INNER.entrainment_speed * INNER.radius * INNER.length / load
        assert films.central_film(INNER, oil, load) == pytest.approx(rigid, rel=1e-10)


def closed_form_slope(viscosity, alpha, load, film):
    """d mu/d slip of a Newtonian oil at one temperature: (2 eta/(p_H h)) (I_1 + L_{-1})(alpha p_H)."""
    peak = films.hertz_pressure(INNER, load)
    x = alpha * peak
    return 2.0 * viscosity / (peak * film) * (iv(1, x) + modstruve(-1, x))


@pytest.mark.parametrize("load", [40.0, 674.0, 3000.0])
def test_oracle_newtonian_slope(load):
    """Oracle: at small slip the thermal and the Eyring oil are Newtonian: modified Bessel and Struve functions.

    To 1e-6: the quadrature gives 1e-8, and what is left of heating and of Eyring's bend is of second order.
    """
    slip = 1e-9
    expected = closed_form_slope(0.016, 5.2e-9, load, FILM)
    thermal = rheology.ThermalNewtonian(0.016, 5.2e-9, 0.045, 0.133)
    assert rheology.traction_coefficient(thermal, INNER, slip, load, FILM) == pytest.approx(expected * slip, rel=1e-6)
    eyring = rheology.Eyring(0.016, 5.2e-9, 1e9)
    assert rheology.traction_coefficient(eyring, INNER, slip, load, FILM) == pytest.approx(expected * slip, rel=1e-6)
    limiting = rheology.LimitingShear(0.016, 5.2e-9, 0.07)
    # At the edge of the contact the limit is low at any slip: there the sum is off by 1e-5.
    assert rheology.traction_coefficient(limiting, INNER, slip, load, FILM) == pytest.approx(expected * slip, rel=2e-5)


def test_unit_large_shear():
    """Unit: limiting shear ends at its ratio; capped oils stay below theirs; hot oil loses its grip."""
    limiting = rheology.LimitingShear(2.87e-3, 7.6e-9, 0.07)
    assert rheology.traction_coefficient(limiting, INNER, 1e6, 674.0, FILM) == pytest.approx(0.07, rel=1e-12)
    slips = np.geomspace(1e-6, 1e4, 200)
    for law in (rheology.Eyring(2.87e-3, 2e-8, 5e6, 0.05), rheology.thermal_newtonian("MIL-L-23699", 40.0, 0.13, 0.05)):
        curve = rheology.traction_coefficient(law, INNER, slips, 3000.0, FILM)
        assert curve.max() < 0.05 and (curve > 0.0).all()
    hot = rheology.thermal_newtonian("MIL-L-7808", 100.0, 0.133)
    curve = rheology.traction_coefficient(hot, INNER, slips, 674.0, FILM)
    assert curve[-1] < 0.01 * curve.max()


@pytest.mark.parametrize(
    ("law", "tolerance"),
    [
        (rheology.ThermalNewtonian(0.016, 5.2e-9, 0.045, 0.133), 1e-11),
        (rheology.ThermalNewtonian(0.016, 5.2e-9, 0.045, 0.133, 0.1), 5e-4),
        (rheology.Eyring(2.87e-3, 7.6e-9, 5e6), 3e-7),
        (rheology.Eyring(2.87e-3, 7.6e-9, 5e6, 0.1), 3e-7),
        (rheology.LimitingShear(2.87e-3, 7.6e-9, 0.07), 2e-5),
    ],
)
def test_oracle_quadrature(law, tolerance):
    """Oracle: the fixed sum against adaptive quadrature, to the errors that its comment states."""
    for load in (54.0, 674.0, 5200.0):
        peak = float(films.hertz_pressure(INNER, load))
        for slip in (1e-4, 1e-2, 0.1, 1.0, 10.0):

            def integrand(angle, peak=peak, slip=slip):
                return float(law.stress(peak * math.cos(angle), slip, FILM)) * math.cos(angle)

            exact = quad(integrand, 0.0, 0.5 * math.pi, epsabs=0.0, epsrel=1e-12, limit=500)[0]
            found = rheology.traction_coefficient(law, INNER, slip, load, FILM)
            assert found == pytest.approx(4.0 / (math.pi * peak) * exact, rel=tolerance)


def test_unit_all_oils_and_broadcasting():
    """Unit: six oils at any temperature give positive, finite curves that rise with pressure at small slip."""
    slips, loads = np.geomspace(1e-4, 50.0, 7)[:, np.newaxis], np.array([50.0, 500.0, 1500.0])
    for name in rheology.OIL_CONSTANTS:
        for celsius in (-40.0, 20.0, 100.0, 250.0):
            law = rheology.thermal_newtonian(name, celsius, 0.13)
            curve = rheology.traction_coefficient(law, INNER, slips, loads, FILM)
            assert curve.shape == (7, 3)
            assert np.isfinite(curve).all() and (curve > 0.0).all()
            assert (np.diff(curve[0]) > 0.0).all()
            one = rheology.traction_coefficient(law, INNER, slips[3, 0], loads[1], FILM)
            assert one == pytest.approx(curve[3, 1], rel=1e-12)
    assert rheology.traction_coefficient(law, INNER, 0.0, 100.0, FILM) == 0.0
    with pytest.raises(KeyError):
        rheology.thermal_newtonian("water", 20.0, 0.13)


def test_literature_body_creep():
    """Literature: Carter's creep xi = (mu_0 b/R)[1 - sqrt(1 - mu/mu_0)] is mu b/(2 R) at small traction.

    A film that is all but solid follows it; a soft one is left alone (to the square of the ratio of slopes).
    """
    slip, load = 1e-6, 674.0
    solid = rheology.with_body_creep(1e3 * slip, INNER, slip, load)
    width = films.half_width(INNER, load)
    assert width == pytest.approx(88e-6, rel=0.01)  # b = 4 R p_H/E', with p_H = 1.394 GPa
    assert solid / slip == pytest.approx(2.0 * INNER.radius / (width * 26.2), rel=1e-5)
    assert rheology.with_body_creep(0.05 * slip, INNER, slip, load) == pytest.approx(0.05 * slip, rel=2e-4)
    assert rheology.with_body_creep(0.05, INNER, 10.0, load) == pytest.approx(0.05, rel=1e-5)
