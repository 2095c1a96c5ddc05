"""Film of a ball on a race: exact derivative, published forms, limits."""

import math

import numpy as np
import pytest

from rbdyn.contact import film_thickness as line
from rbdyn.contact import point_contact as films
from rbdyn.contact.point_contact import ball_on_race, peak_pressure
from rbdyn.properties.materials import MATERIALS, equivalent_modulus, oil_at

STEEL = equivalent_modulus(MATERIALS["bearing_steel"], MATERIALS["bearing_steel"])
OIL = oil_at("MIL-L-23699", 80.0)
DIAMETER, PITCH, GAMMA = 12.7e-3, 70e-3, 12.7 * math.cos(math.radians(40.0)) / 70.0
SPEED = films.entrainment_speed(PITCH, GAMMA, 10000.0 * math.pi / 30.0)
RACES = {
    name: films.RollingBall(
        ball_on_race(DIAMETER, 0.52, gamma, STEEL), films.rolling_radius(DIAMETER, gamma), STEEL, SPEED
    )
    for name, gamma in (("inner", GAMMA), ("outer", -GAMMA))
}
BALLS = pytest.mark.parametrize("ball", RACES.values(), ids=RACES)


@BALLS
@pytest.mark.parametrize("load", [1.0, 50.0, 2000.0])
def test_film_stiffness_is_the_exact_derivative(ball, load):
    """Rate: central differences of the film over the load meet -1/stiffness with their second order."""
    errors = []
    for step in (0.04, 0.02, 0.01):
        films_around = films.central_film(ball, OIL, load * np.array([1.0 - step, 1.0 + step]))
        slope = np.diff(films_around)[0] / (2.0 * step * load)
        errors.append(abs(slope * films.film_stiffness(ball, OIL, load) + 1.0))
    assert errors[-1] < 2e-4
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)


@BALLS
def test_literature_form_of_the_stiffness(ball):
    """Literature: Chang, Hu and Cao 2024, eq 15, 10/1.8023 E' R_x [U^0.67 G^0.53 W^-1.067 (1 - 0.61 e^(-0.73 k))]^-1."""
    load = 200.0
    stiffness = STEEL * ball.radius
    u, g, w = (OIL.viscosity * SPEED / stiffness, OIL.pressure_coefficient * STEEL, load / (stiffness * ball.radius))
    shape = 1.0 - 0.61 * math.exp(-0.73 * ball.contact.ellipticity)
    printed = 10.0 / 1.8023 * stiffness / (u**0.67 * g**0.53 * w**-1.067 * shape)
    assert films.film_stiffness(ball, OIL, load) == pytest.approx(printed, rel=2e-5)


@BALLS
def test_exponents_of_speed_material_and_load(ball):
    """Unit: doubling speed, pressure coefficient or load multiplies the films by the powers of Hamrock and Dowson."""
    twice = ball._replace(entrainment_speed=2.0 * SPEED)
    thick = oil_at("MIL-L-23699", 80.0)
    for film, powers in ((films.central_film, (0.67, -0.067)), (films.minimum_film, (0.68, -0.073))):
        base = film(ball, thick, 100.0)
        assert film(twice, thick, 100.0) / base == pytest.approx(2.0 ** powers[0], rel=1e-12)
        assert film(ball, thick, 200.0) / base == pytest.approx(2.0 ** powers[1], rel=1e-12)


def test_film_is_thinner_inside_and_thinnest_off_the_middle():
    """The inner contact is more curved; the thinnest film lies below the central one; heating takes some away."""
    loads = np.array([10.0, 100.0, 1000.0])
    for ball in RACES.values():
        assert np.all(films.minimum_film(ball, OIL, loads) < films.central_film(ball, OIL, loads))
        factor = films.thermal_factor(ball, OIL, loads)
        assert np.all((factor > 0.1) & (factor < 1.0)) and np.all(np.diff(factor) < 0.0)
        assert np.all(films.thermal_factor(ball, OIL, loads, slip=1.0) < factor)
    assert np.all(films.central_film(RACES["inner"], OIL, loads) < films.central_film(RACES["outer"], OIL, loads))


def test_thermal_factor_is_the_one_of_line_contacts_at_equal_pressure():
    """Unit: the same Hertz pressure and speed give the same factor in either kind of contact."""
    ball = RACES["inner"]
    pressure = peak_pressure(ball.contact, 300.0)
    roller = line.RollingContact(4e-3, 5e-3, STEEL, SPEED)
    load = 2.0 * math.pi * 4e-3 * 5e-3 * pressure**2 / STEEL
    assert films.thermal_factor(ball, OIL, 300.0) == pytest.approx(line.thermal_factor(roller, OIL, load), rel=1e-13)


def test_limit_of_long_ellipses_is_near_the_line_contact():
    """Limit: for k -> infinity the central film is within a quarter of Dowson and Toyoda's at the same peak pressure."""
    contact = ball_on_race(DIAMETER, 0.5003, GAMMA, STEEL)
    assert contact.ellipticity > 60.0
    ball = films.RollingBall(contact, films.rolling_radius(DIAMETER, GAMMA), STEEL, SPEED)
    load = 1000.0
    pressure = peak_pressure(contact, load)
    roller = line.RollingContact(ball.radius, 1.0, STEEL, SPEED)
    line_load = 2.0 * math.pi * ball.radius * pressure**2 / STEEL
    ratio = films.central_film(ball, OIL, load) / line.central_film(roller, OIL, line_load)
    assert ratio == pytest.approx(1.0, abs=0.25)


def test_kinematics_of_the_published_check():
    """Literature: D 12.7, d_m 70, 40 deg, 10000 rpm inside: cage 4305.1 rpm, so the ring passes the cage at 5694.9 rpm."""
    cage = 4305.1 * math.pi / 30.0
    ring = 10000.0 * math.pi / 30.0
    at_inner = (ring - cage) * 0.5 * PITCH * (1.0 - GAMMA)
    at_outer = cage * 0.5 * PITCH * (1.0 + GAMMA)
    assert at_inner == pytest.approx(SPEED, rel=1e-5)
    assert at_outer == pytest.approx(SPEED, rel=1e-5)
    assert films.rolling_radius(DIAMETER, GAMMA) == pytest.approx(
        1.0 / (2.0 / DIAMETER * (1.0 + GAMMA / (1.0 - GAMMA)))
    )
