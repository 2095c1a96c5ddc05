"""Rolling resistance, flooded and starved: against Reynolds's equation solved three ways, in its limits, and in a run."""

import math

import line_film_oracle as oracle
import numpy as np
import pytest
from conftest import make
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit

from rbdyn.base.faults import InputError
from rbdyn.contact import film_thickness
from rbdyn.contact import rolling_resistance as rolling
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing, rolling_law
from rbdyn.dynamics.recording import run_replicate

MODULUS, RADIUS, LENGTH, VISCOSITY, PRESSURE_COEFFICIENT = 2.264e11, 5e-3, 10e-3, 0.01, 1.5e-8
FLOODED = rolling.biboulet_houpert(VISCOSITY, MODULUS, RADIUS, LENGTH, 0.9)


@njit
def compiled(law, load, speed):
    return rolling.rolling_force(law, load, speed)


def starved(distance, coefficient=PRESSURE_COEFFICIENT):
    return rolling.starved(FLOODED, VISCOSITY, coefficient, MODULUS, RADIUS, LENGTH, distance)


def at_moes(m, viscous, distance=None):
    """Force of the law over E' R l U^0.75, without reduction, at Moes's M and L."""
    speed_number = 1e-10
    speed = 0.5 * speed_number * MODULUS * RADIUS / VISCOSITY
    load = m * math.sqrt(speed_number) * MODULUS * RADIUS * LENGTH
    law = FLOODED if distance is None else starved(distance, viscous / speed_number**0.25 / MODULUS)
    return rolling.rolling_force(law, load, speed) / 0.9 / (MODULUS * RADIUS * LENGTH) / speed_number**0.75


def test_oracle_rigid_cylinders():
    """Oracle: Martin's load 4.89 and 4.60 of shear per surface by quadrature, 1.47 sqrt(U W), beside 1.42 of the law (4 %)."""
    load, force = oracle.rigid(1e4)
    assert 24.0 * load == pytest.approx(rolling.RIGID_LOAD, rel=5e-4)
    assert 12.0 * math.sqrt(2.0) * force == pytest.approx(4.600, abs=1e-3)
    per_root = 12.0 * math.sqrt(2.0) * force / math.sqrt(2.0 * 24.0 * load)
    assert per_root == pytest.approx(1.47, abs=2e-3)
    assert pytest.approx(per_root, rel=0.04) == rolling.RIGID_FORCE


def test_oracle_rigid_inlet_share():
    """Oracle: the closed form is within 0.006 of the quadrature under the same load, and meets both its limits."""
    for meniscus in (0.1, 0.3, 0.6, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 10.0, 20.0, 40.0):
        distance, share = oracle.rigid_share(meniscus)
        assert rolling.rigid_inlet_share(distance) == pytest.approx(share, abs=0.006)
    distance, share = oracle.rigid_share(0.1)
    assert pytest.approx(distance / share, rel=2e-3) == rolling.NEAR_MENISCUS
    far = oracle.rigid(1e4)[1]
    assert pytest.approx(0.5 / far, rel=2e-3) == rolling.FAR_MENISCUS


@pytest.mark.parametrize("dynamic_load", [0.01, 0.1, 1.0, 10.0, 50.0])
def test_oracle_elastic_inlet_share(dynamic_load):
    """Oracle: the shares of the closed form are within 0.032 of the quadrature over Grubin's inlet, those of Goksem and
    Hargreaves within 0.1; the film of that inlet starves as ``film_thickness`` has it, within 0.025 for D up to 1, and
    their traction is its force within 10 % from D = 1 on."""
    film, force = oracle.grubin(dynamic_load)
    for distance in (0.1, 0.3, 1.0, 3.0, 10.0, 30.0):
        gap = rolling.gap_ahead(distance)
        share = 1.0 / (1.0 + 2.0 * dynamic_load / (math.pi * force * math.sqrt(gap)) + 0.3 * math.pi * force / gap)
        starved_film, starved_force = oracle.grubin(dynamic_load, distance)
        assert share == pytest.approx(starved_force / force, abs=0.032)
        assert oracle.goksem_hargreaves_share(dynamic_load, distance) == pytest.approx(starved_force / force, abs=0.1)
        if dynamic_load > 1.0:
            continue
        contact = film_thickness.RollingContact(RADIUS, LENGTH, MODULUS, 1.0)
        width = float(film_thickness.half_width(contact, 1e3))
        fitted = film_thickness.starvation_factor(contact, 1e3, film * width**2 / (2.0 * RADIUS), distance)
        assert float(fitted) == pytest.approx(starved_film / film, abs=0.025)
    if dynamic_load >= 1.0:
        traction = math.exp(0.658228 * math.log(dynamic_load) - 0.162625)
        assert force == pytest.approx(traction, rel=0.1)


@pytest.mark.parametrize(
    ("m", "viscous", "hertz_pressure"),
    [(1.4, 9.0, 1e9), (5.0, 9.0, 1e9), (20.0, 13.0, 1e9), (20.0, 5.0, 0.7e9), (20.0, 5.0, 0.0)],
)
def test_oracle_elastohydrodynamic_contact(m, viscous, hertz_pressure):
    """Oracle: flooded, the law is within 17 % of full solutions, 14 % with compressible oil; the starved share is within
    0.045 of theirs at 5 half-widths and more; their film is that of Dowson and Toyoda within 15 %."""
    far = max(40.0, 300.0 / m)
    flooded, film = oracle.elastohydrodynamic(m, viscous, far, hertz_pressure)
    assert at_moes(m, viscous) == pytest.approx(flooded, rel=0.14 if hertz_pressure else 0.17)
    # Dowson and Toyoda's central film.
    u = 0.5e-10
    toyoda = 3.06 * u**0.69 * (viscous / (2.0 * u) ** 0.25) ** 0.56 * (m * math.sqrt(2.0 * u)) ** -0.10
    assert film == pytest.approx(toyoda / math.sqrt(2.0 * u), rel=0.15)
    for distance in (5.0, 10.0, 20.0):
        share = oracle.elastohydrodynamic(m, viscous, distance, hertz_pressure)[0] / flooded
        assert at_moes(m, viscous, distance) / at_moes(m, viscous) == pytest.approx(share, abs=0.045)


@given(load=st.floats(1e-10, 1e6), speed=st.floats(1e-8, 1e3))
@settings(max_examples=100, deadline=None)
def test_unit_starved_force_in_its_limits(load, speed):
    """Unit: rises with the distance from nothing to the flooded force, never above it; compiled equals interpreted."""
    flooded = rolling.rolling_force(FLOODED, load, speed)
    distances = (1e-12, 1e-3, 0.1, 1.0, 10.0, 100.0, 1e12)
    forces = np.array([rolling.rolling_force(starved(distance), load, speed) for distance in distances])
    assert (np.diff(forces) > 0.0).all()
    assert 0.0 < forces[0] < 1e-8 * flooded
    assert forces[-1] == pytest.approx(flooded, rel=1e-9)
    assert compiled(starved(10.0), load, speed) == pytest.approx(forces[4], rel=1e-12)


@given(speed=st.floats(1e-6, 1e2), distance=st.floats(1e-3, 1e3))
@settings(max_examples=50, deadline=None)
def test_unit_starved_force_rises_with_load(speed, distance):
    """Unit: from nothing, up to the load of a few GPa; what the meniscus takes of a light contact is the rigid share."""
    law = starved(distance)
    forces = [rolling.rolling_force(law, load, speed) for load in np.geomspace(1e-12, 1e5, 60)]
    assert (np.diff(forces) > -1e-12 * np.array(forces[1:])).all()
    assert forces[0] < 1e-5 * forces[-1]
    light = forces[0] / rolling.rolling_force(FLOODED, 1e-12, speed)
    assert light <= rolling.rigid_inlet_share(distance) * (1.0 + 1e-9)


def test_unit_gap_ahead_joins_its_series():
    """Unit: the two forms of the gap agree where they meet (to the next term of the series, 0.15 of the distance)."""
    assert rolling.gap_ahead(0.99999e-4) == pytest.approx(rolling.gap_ahead(1e-4), rel=4e-5)
    assert rolling.gap_ahead(1e4) == pytest.approx(1e8, rel=3e-4)


def test_unit_flooded_scene_is_the_plain_law():
    """Unit: without a distance the law is flooded; the factor multiplies it, and with a distance both apply."""
    scene, starved_scene = make(), make("lubricant.inlet_distance=10.0")
    oil = scene.lubricant.in_service
    plain = rolling_law(scene, oil, 4e-3)
    assert isinstance(plain, rolling.RollingResistance)
    assert rolling_law(make("model.rolling_resistance_factor=1.0"), oil, 4e-3) == plain
    less = rolling_law(make("model.rolling_resistance_factor=0.8"), oil, 4e-3)
    assert less.force_scale == pytest.approx(0.8 * plain.force_scale, rel=1e-15)
    short = rolling_law(starved_scene, oil, 4e-3)
    assert isinstance(short, rolling.StarvedRollingResistance)
    assert short.force_scale == pytest.approx(plain.force_scale * short.rigid_share, rel=1e-15)


@pytest.mark.parametrize("value", ["0.0", "-1.0", "5.1"])
def test_unit_factor_out_of_range_is_refused(value):
    """Unit: a sentence that names the key."""
    with pytest.raises(InputError, match=r"model\.rolling_resistance_factor"):
        make(f"model.rolling_resistance_factor={value}")


@pytest.mark.slow
def test_invariant_power_balance_of_a_starved_run():
    """Invariant: what the starved law takes in power it takes in force: the balance closes as when flooded (0.1 %)."""
    gaps, powers = [], []
    for more in ((), ("lubricant.inlet_distance=3.0",)):
        scene = make(*more)
        run = run_replicate(scene, roller_bearing(scene), 0, scene.numerics.rtol, Stop())
        gaps.append(run.power_gap)
        powers.append(run.power("rolling_resistance"))
    assert max(abs(gap) for gap in gaps) < 1e-3
    assert 0.5 * powers[0] < powers[1] < 0.9 * powers[0]
