"""Heat by node from power terms, surfaces and seats by plain sizes, the oil fraction, and conduction of materials."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn.contact.film_thickness import RollingContact
from rbdyn.life.rollers import iso_15312_heat, seat_heat
from rbdyn.losses import POWER_TERMS
from rbdyn.properties.catalogue import envelope, read_designation
from rbdyn.properties.materials import MATERIALS, oil_at
from rbdyn.scene.bearing import CustomMaterial, material_of
from rbdyn.thermal.losses import TERMS, Effusivities, heat_partition, shares
from rbdyn.thermal.network import NODES, CageSize, cavity_volume, half_space_contact, race_contact, seats, surfaces
from rbdyn.thermal.oil_fraction import CM3_PER_MINUTE, fraction_notes, oil_fraction, residence

RPM = math.pi / 30.0
OIL = oil_at("MIL-L-7808", 100.0)
STEEL = MATERIALS["bearing_steel"]
CONTACT = RollingContact(3.57e-3, 3.5e-3, 226.4e9, 26.0)
positive = st.floats(100.0, 3e4)


def test_unit_terms_are_those_of_a_simulation():
    """Unit: each loss of a simulation has its row, with rolling resistance by race, and windage besides."""
    by_race = {"outer_rolling_resistance", "inner_rolling_resistance"}
    assert set(TERMS) == set(POWER_TERMS) - {"rolling_resistance"} | by_race | {"spin_windage"}
    assert len(set(TERMS)) == len(TERMS)


@settings(max_examples=60, deadline=None)
@given(
    st.builds(Effusivities, positive, positive, positive),
    st.sampled_from(["outer", "inner", "roller"]),
    st.floats(0.0, 1.0),
)
def test_unit_all_power_becomes_heat(effusivities, guidance, film_to_oil):
    """Unit: shares are between 0 and 1, and each row sums to 1; a support's damper heats no node."""
    array = shares(effusivities, guidance, film_to_oil)
    assert array.shape == (len(TERMS), len(NODES)) and array.min() >= 0.0
    expected = [0.0 if term == "support_damping" else 1.0 for term in TERMS]
    assert array.sum(axis=1) == pytest.approx(expected, rel=1e-14)


def test_unit_heat_by_term():
    """Unit: like steels share the heat of traction evenly, land heat reaches the guiding ring, drag the oil."""
    steel = STEEL.effusivity
    guided = {side: shares(Effusivities(steel, steel, steel), side, 0.5) for side in ("outer", "inner", "roller")}
    row = {term: guided["outer"][TERMS.index(term)] for term in TERMS}
    assert row["outer_race_traction"] == pytest.approx([0.0, 0.5, 0.0, 0.5])
    assert row["inner_race_traction"] == pytest.approx([0.0, 0.0, 0.5, 0.5])
    assert row["inner_rolling_resistance"] == pytest.approx([0.5, 0.0, 0.25, 0.25])
    assert row["race_damping"] == pytest.approx([0.0, 0.25, 0.25, 0.5])
    assert row["land_film"] == pytest.approx([0.5, 0.25, 0.0, 0.25])
    assert row["roller_drag"] == pytest.approx([1.0, 0.0, 0.0, 0.0])
    land = TERMS.index("land_friction")
    assert guided["inner"][land] == pytest.approx([0.0, 0.0, 0.5, 0.5])
    assert guided["roller"][land] == pytest.approx([0.0, 0.0, 0.0, 1.0])


def test_unit_share_of_the_oil_in_a_film():
    """Unit: at 0 a film heats its walls alone, at 1 its oil alone; drag and dry friction do not depend on it; shares are linear in it."""
    dry, half, wet = (shares(Effusivities(1.0, 2.0, 3.0), "outer", share) for share in (0.0, 0.5, 1.0))
    film = TERMS.index("outer_rolling_resistance")
    assert dry[film] == pytest.approx([0.0, 0.5, 0.0, 0.5]) and wet[film] == pytest.approx([1.0, 0.0, 0.0, 0.0])
    assert half == pytest.approx(0.5 * (dry + wet))
    for term in ("roller_drag", "pocket_friction", "outer_race_traction"):
        assert np.array_equal(dry[TERMS.index(term)], wet[TERMS.index(term)])


def test_unit_errors_of_heat():
    """Unit: heat sums to the power; the covariance of heat is that of powers between the shares."""
    powers = np.arange(1.0, len(TERMS) + 1.0)
    array = shares(Effusivities(1.0, 2.0, 3.0), "inner", 0.3)
    without = np.array([term != "support_damping" for term in TERMS])
    assert (array.T @ powers).sum() == pytest.approx(powers[without].sum(), rel=1e-14)
    covariance = np.diag(np.arange(len(TERMS), dtype=float))
    one = np.ones(len(NODES))
    assert one @ (array.T @ covariance @ array) @ one == pytest.approx(np.diag(covariance)[without].sum())


def test_unit_heat_partition():
    """Unit: half for like bodies; a polymer cage takes 4 % from steel."""
    assert heat_partition(3.0, 3.0) == 0.5
    assert heat_partition(MATERIALS["peek"].effusivity, STEEL.effusivity) == pytest.approx(0.044, abs=0.002)


def test_unit_effusivities_of_materials():
    """Unit: sqrt(k rho c) of each material is that of an own sum, within the 15 % of their inputs."""
    known = {"bearing_steel": 12980.0, "m50": 9500.0, "bronze": 14100.0, "peek": 600.0}
    for name, effusivity in known.items():
        assert MATERIALS[name].effusivity == pytest.approx(effusivity, rel=0.01)
    assert MATERIALS["m50"].conductivity == 25.0


def test_unit_conduction_of_own_materials():
    """Unit: stated conduction counts; else a metal has that of steel, a polymer that of a polymer; unstated keys are not saved."""
    numbers = {"elastic_modulus_GPa": 200.0, "poisson_ratio": 0.3, "density_kg_m3": 7800.0}
    plain = CustomMaterial(**numbers)
    assert plain.model_dump() == {**numbers, "thermal_expansion_1e_6_K": 12.0}
    assert plain.model_dump_json() == (
        '{"elastic_modulus_GPa":200.0,"poisson_ratio":0.3,"density_kg_m3":7800.0,"thermal_expansion_1e_6_K":12.0}'
    )
    metal, polymer = material_of(plain), material_of(CustomMaterial(**{**numbers, "elastic_modulus_GPa": 5.0}))
    assert (metal.conductivity, metal.heat_capacity) == (STEEL.conductivity, STEEL.heat_capacity)
    assert (polymer.conductivity, polymer.heat_capacity) == (0.25, 1500.0)
    stated = CustomMaterial(**numbers, conductivity_W_mK=96.0, heat_capacity_J_kgK=900.0)
    assert (material_of(stated).conductivity, material_of(stated).heat_capacity) == (96.0, 900.0)
    assert CustomMaterial(**stated.model_dump()) == stated


def test_unit_race_contact():
    """Unit: film and bodies in series; open contacts conduct nothing; angles of one roller average."""
    one = race_contact(np.array([674.0]), CONTACT, OIL, STEEL, STEEL)
    assert race_contact(np.array([674.0, 0.0, 674.0]), CONTACT, OIL, STEEL, STEEL) == pytest.approx(2.0 * one)
    assert race_contact(np.array([[674.0], [0.0]]), CONTACT, OIL, STEEL, STEEL) == pytest.approx(0.5 * one)
    assert race_contact(np.zeros(3), CONTACT, OIL, STEEL, STEEL) == 0.0
    width = math.sqrt(8.0 * 674.0 / 3.5e-3 * CONTACT.radius / (math.pi * CONTACT.equivalent_modulus))
    bodies = half_space_contact(width, 3.5e-3, 26.0, STEEL.effusivity, STEEL.effusivity)
    film = 2.0 * width * 3.5e-3 * OIL.conductivity / 2e-7
    found = race_contact(np.array([674.0]), CONTACT, OIL, STEEL, STEEL, film=2e-7)
    assert found == pytest.approx(1.0 / (1.0 / bodies + 1.0 / film), rel=1e-12)
    assert race_contact(np.array([674.0]), CONTACT, OIL, STEEL, STEEL, film=0.0) == pytest.approx(bodies, rel=1e-12)
    assert race_contact(np.array([674.0]), CONTACT, OIL, STEEL, STEEL, inlet_distance=0.5) > 1.1 * one


def test_unit_surfaces_and_cavity():
    """Unit: a bearing of two rollers and a thin cage, counted by hand."""
    found = surfaces((2.0, 1.0), 0.5, 2, 0.1, 0.3, CageSize(1.6, 1.4, 0.4))
    assert found.outer == pytest.approx(2.0 * math.pi) and found.inner == pytest.approx(math.pi)
    assert found.rollers == pytest.approx(2.0 * (2.0 * math.pi * 0.1 * 0.3 + 2.0 * math.pi * 0.01))
    hoop = 2.0 * math.pi * 3.0 * 0.4 - 4.0 * 0.06
    assert found.cage == pytest.approx(hoop + 2.0 * math.pi * (1.6**2 - 1.4**2) + 4.0 * 0.5 * 0.2)
    assert cavity_volume((2.0, 1.0), 0.5, 2, 0.01, 0.1) == pytest.approx(1.5 * math.pi - 0.12)


@pytest.mark.parametrize("name", ["NU 204", "NU 210", "NU 320", "NU 2312"])
def test_unit_seats_share_the_heat_of_iso_15312(name):
    """Unit: both seats together carry the heat of ISO 15312 at 50 K, in the ratio of their diameters, small and large."""
    sizes = envelope(read_designation(name))
    housing, shaft = seats(1e-3 * sizes.bore, 1e-3 * sizes.outside, 1e-3 * sizes.width)
    assert 50.0 * (housing + shaft) == pytest.approx(iso_15312_heat(sizes), rel=1e-13)
    assert housing / shaft == pytest.approx(sizes.outside / sizes.bore, rel=1e-13)
    assert seat_heat(0.02) == pytest.approx(320.0 * 0.02 * 50.0)
    assert seat_heat(0.1) == pytest.approx(320.0 * 0.1 * 50.0 * 2.0**-0.34)


def test_unit_oil_fraction():
    """Unit: the fraction scales with its factor up to its cap; notes outside its range."""
    flow, speed, pitch = 1e-3 / 60.0, 24000.0 * RPM, 0.0435
    usual = oil_fraction(flow, speed, pitch)
    assert oil_fraction(flow, speed, pitch, 0.6) == pytest.approx(0.6 * usual)
    assert oil_fraction(flow, -speed, pitch) == usual
    assert oil_fraction(flow, 0.05 * speed, pitch) == 0.15
    assert residence(0.1, 1e-5, 1e-5, 2.0 * math.pi) == pytest.approx(0.1)
    assert tuple(fraction_notes(speed, pitch, 4.0)) == ()
    slow, short = fraction_notes(0.1 * speed, pitch, 0.5)
    assert slow.startswith("oil fraction: 0.1 million mm/min is outside") and "0.5 turns of the cage" in short
    assert oil_fraction(1000.0 * CM3_PER_MINUTE, speed, pitch) == pytest.approx(usual, rel=1e-12)
