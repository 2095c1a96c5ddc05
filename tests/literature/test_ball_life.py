"""Fatigue life and ratings of a row of balls: a commercial report, tables of the standards, closed forms, invariants."""

import importlib
import math
from pathlib import Path

import numpy as np
import pytest
import rigid_rings
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn import BallScene, equilibrium
from rbdyn.contact.point_contact import ball_on_race
from rbdyn.life import balls as life

GAMMA = 11.5 / 43.5
CAPACITY = 23400.0
MODULUS = 210e9 / (1.0 - 0.3**2)


@pytest.fixture
def published(monkeypatch):
    """A module beside the examples by its name, imported as they do."""
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples"))
    return lambda name: importlib.import_module(f"published.{name}")


def reported_row(clearance, lever=None):
    """Deep groove row of the commercial report: Z 7, D 11.5, d_m 43.5 mm, f 0.52 and 0.53, 210 GPa."""
    return rigid_rings.rigid_row(7, 11.5e-3, 43.5e-3, 0.52, 0.53, MODULUS, radial_clearance=clearance, lever=lever)


def reported_life(loads):
    """L10r [1e6 turns] of that row."""
    capacities = life.rated_capacities(CAPACITY, 7, GAMMA, 0.0, 0.52, 0.53)
    return life.row_life(loads, loads, capacities).million_turns


# Clearance [um], radial and axial load [N]; what the report prints: radial, axial displacement [um], tilt [mrad], L10r.
REPORT = [
    (0.0, 1000.0, 0.0, 15.1101, 0.0, 0.0, 13163.019),
    (0.0, 0.0, 1000.0, 0.0, 133.5381, 0.0, 2222.7318),
    (10.0, 1000.0, 0.0, 21.223, None, 0.0, 10795.7948),
    (10.0, 0.0, 1000.0, 0.0, 149.1717, 0.0, 3115.8781),
    (10.0, 1000.0, 1000.0, 19.5923, 146.4603, 2.6872, 1630.5367),
]


@pytest.mark.parametrize(("clearance", "radial", "axial", "x", "z", "tilt", "million"), REPORT)
def test_literature_commercial_report(clearance, radial, axial, x, z, tilt, million):
    """Literature: ISO/TS 16281 by a commercial tool, to the 1e-5 by which its own loads miss the balance.

    It counts the axial displacement from the middle of the play, and tilts the inner grooves about d_m/2 instead of
    the standard's R_i, which changes the tilt by 1.1 % and neither loads nor life.
    """
    row = reported_row(clearance * 1e-6, lever=0.5 * 43.5e-3)
    rest = rigid_rings.distribution(row, radial, axial)
    from_middle = rest.axial + row.groove_distance * math.sin(row.free_angle)
    assert 1e6 * rest.radial == pytest.approx(x, rel=3e-5, abs=1e-9)
    if z is not None:
        assert 1e6 * from_middle == pytest.approx(z, rel=3e-6, abs=1e-9)
    assert 1e3 * abs(rest.tilt) == pytest.approx(tilt, rel=5e-5, abs=1e-9)
    assert reported_life(rest.load) == pytest.approx(million, rel=7e-5)
    assert rest.residual < 1e-8
    standard = rigid_rings.distribution(reported_row(clearance * 1e-6), radial, axial)
    assert standard.load == pytest.approx(rest.load, rel=1e-9, abs=1e-6)


@pytest.mark.parametrize(("clearance", "radial", "axial", "x", "z", "tilt", "million"), REPORT)
def test_literature_commercial_report_of_a_scene(clearance, radial, axial, x, z, tilt, million):
    """Literature: the same report from a scene at rest. The standard rates by the nominal angle, 0, whatever the clearance."""
    steel = {"elastic_modulus_GPa": 210.0, "poisson_ratio": 0.3, "density_kg_m3": 7800.0}
    row = {"kind": "deep_groove_ball", "balls": 7, "ball_diameter_mm": 11.5, "pitch_diameter_mm": 43.5}
    grooves = {"inner_groove_factor": 0.52, "outer_groove_factor": 0.53, "radial_clearance_mm": 1e-3 * clearance}
    load = {"radial_load_N": radial, "axial_load_N": axial, "tilt": "free" if tilt else "fixed"}
    scene = {
        "bearing": {**row, **grooves, "dynamic_capacity_N": CAPACITY},
        "operation": load,
        "materials": {"ball": steel, "rings": steel},
    }
    found = equilibrium(BallScene.from_dict(scene))
    assert 1e3 * found.displacement_mm["x"] == pytest.approx(x, rel=1e-4, abs=1e-9)
    assert found.life.L10_Mrev == pytest.approx(million, rel=1e-4)


def test_closed_form_axial_load_and_clearance():
    """Closed form: under an axial load alone every ball bears F_a/(Z sin alpha); with cos(alpha) = A cos(alpha_0)/(A + delta)."""
    row = reported_row(10e-6)
    rest = rigid_rings.distribution(row, 0.0, 1000.0)
    angle, approach = rest.angle[0], rest.approach[0]
    assert rest.load == pytest.approx(np.full(7, 1000.0 / (7.0 * math.sin(angle))), rel=1e-11)
    stretched = row.groove_distance + approach
    assert math.cos(angle) == pytest.approx(row.groove_distance * math.cos(row.free_angle) / stretched, rel=1e-12)


def test_closed_form_radial_load_of_many_balls():
    """Closed form: without clearance Q_max = F_r/(Z J_r), J_r = 0.2288, and Stribeck's 4.37 for point contacts."""
    row = rigid_rings.rigid_row(400, 5e-3, 800e-3, 0.52, 0.53, MODULUS)
    rest = rigid_rings.distribution(row, 1e4, tilts=False)
    assert 1e4 / (400 * rest.load.max()) == pytest.approx(0.2288, abs=1e-4)
    assert 400 * rest.load.max() / 1e4 == pytest.approx(4.37, abs=5e-3)


@settings(max_examples=30, deadline=None)
@given(
    st.integers(5, 30),
    st.floats(0.0, 40e-6),
    st.floats(0.0, 3e3),
    st.floats(1.0, 3e3),
    st.floats(-3.0, 3.0),
    st.floats(0.0, 6.3),
)
def test_invariant_rings_take_the_load(balls, clearance, radial, axial, moment, first):
    """Invariant: forces and moment of the balls add up to the load, whatever it is; no ball pulls."""
    pitch = 8e-3 * balls
    row = rigid_rings.rigid_row(balls, 6e-3, pitch, 0.52, 0.53, MODULUS, radial_clearance=clearance)
    rest = rigid_rings.distribution(row, radial, axial, moment, first_ball=first)
    cosine = np.cos(first + 2.0 * np.pi * np.arange(balls) / balls)
    along, across = rest.load * np.sin(rest.angle), rest.load * np.cos(rest.angle)
    scale = 1e-7 * max(radial, axial, 2.0 * abs(moment) / pitch)
    assert across @ cosine == pytest.approx(radial, abs=scale)
    assert along.sum() == pytest.approx(axial, abs=scale)
    assert 0.5 * pitch * (along @ cosine) == pytest.approx(moment, abs=scale * pitch)
    assert np.all(rest.load >= 0.0)


def test_unit_a_row_without_a_load_is_refused():
    """Unit: nothing holds an unloaded ring; a clearance beyond the grooves is named."""
    with pytest.raises(ValueError, match="load"):
        rigid_rings.distribution(reported_row(0.0), 0.0)
    with pytest.raises(ValueError, match="clearance"):
        reported_row(-1e-6)


# f_c of ISO 281 for single-row radial and angular contact ball bearings.
CAPACITY_FACTORS = {
    0.05: 46.7, 0.06: 49.1, 0.08: 52.8, 0.10: 55.5, 0.12: 57.5, 0.14: 58.8, 0.16: 59.6,
    0.18: 59.9, 0.20: 59.9, 0.22: 59.6, 0.24: 59.0, 0.26: 58.2, 0.28: 57.1, 0.30: 56.0,
}  # fmt: skip


def test_literature_capacity_factor():
    """Literature: f_c as ISO 281 tabulates it, within 0.1 %."""
    for gamma, factor in CAPACITY_FACTORS.items():
        assert life.capacity_factor(gamma) == pytest.approx(factor, rel=1.2e-3)
    assert life.capacity_factor(0.2, 0.53, 0.53) < life.capacity_factor(0.2)


def static_races(ball_diameter, gamma):
    """Both contacts with grooves of 0.52 and 0.53, elastic constants of ISO/TR 10657, on which f_0 of ISO 76 rests."""
    return [ball_on_race(ball_diameter, f, g, 207e9 / (1.0 - 0.3**2)) for f, g in ((0.52, gamma), (0.53, -gamma))]


def test_literature_static_factor():
    """Literature: f_0 of ISO 76 for grooves of 0.52 and 0.53, within one of the last printed digit."""
    for gamma, factor in {0.0: 14.7, 0.01: 14.9, 0.05: 15.7, 0.10: 16.4, 0.20: 14.0}.items():
        assert life.static_capacity(1, 0.0, static_races(1e-3, gamma)) == pytest.approx(factor, abs=0.1)


def test_literature_catalogue_of_a_6206():
    """Literature: 9 balls of 9.525 mm on 46 mm; catalogues give C 19.5 to 20.3 kN, C_0 11.2 to 11.3 kN, f_0 near 14."""
    capacity = life.dynamic_capacity(9, 9.525e-3, 46e-3)
    static = life.static_capacity(9, 0.0, static_races(9.525e-3, 9.525 / 46.0))
    assert capacity == pytest.approx(19.5e3, rel=0.02)
    assert static == pytest.approx(11.25e3, rel=0.02)


@pytest.mark.parametrize(
    ("balls", "ball", "pitch", "catalogue"),
    [(9, 7.938, 39.0, 14.0), (9, 9.525, 46.0, 19.5), (9, 11.906, 60.0, 29.1), (8, 15.081, 65.0, 40.5)],
)
@pytest.mark.parametrize("grooves", [(0.515, 0.525), (0.52, 0.53)])
def test_literature_catalogue_of_four_bearings(balls, ball, pitch, catalogue, grooves):
    """Literature: C [kN] of a 6205, 6206, 6208 and 6308; ISO 281 has one f_c for all grooves up to 0.52 inside and 0.53 outside."""
    rated = life.rated_capacity(balls, 1e-3 * ball, 1e-3 * pitch, 0.0, *grooves)
    assert 1e-3 * rated == pytest.approx(catalogue, rel=0.007)
    wide = life.rated_capacity(balls, 1e-3 * ball, 1e-3 * pitch, 0.0, 0.53, 0.54)
    assert wide < rated


def test_capacity_scales_with_balls_rows_and_size():
    """Unit: Z^(2/3), i^0.7, cos(alpha)^0.7 at one gamma, D^1.8, and continuous where D^1.4 takes over."""
    one = life.dynamic_capacity(1, 10e-3, 50e-3)
    assert one == pytest.approx(1.3 * life.capacity_factor(0.2) * 10.0**1.8, rel=1e-13)
    assert life.dynamic_capacity(8, 10e-3, 50e-3, rows=2) == pytest.approx(one * 4.0 * 2.0**0.7, rel=1e-13)
    angle = math.radians(40.0)
    tilted = life.dynamic_capacity(1, 10e-3, 50e-3 * math.cos(angle), angle)
    assert tilted == pytest.approx(one * math.cos(angle) ** 0.7, rel=1e-13)
    assert life.ball_size_term(25.4e-3 + 1e-12) == pytest.approx(life.ball_size_term(25.4e-3), rel=2e-4)
    assert life.ball_size_term(50e-3) == pytest.approx(3.647 * 50.0**1.4, rel=1e-13)


def test_literature_load_factors(published):
    """Literature: table 3 of ISO 281 at its nodes, midway between angles, and the columns f_0 F_a/C_0 of 15 degrees."""
    iso281 = published("iso281")
    factors = iso281.load_factors(0.0, 1.38 * 9 * 100.0, 9, 10e-3)
    assert factors == pytest.approx((0.56, 1.45, 0.30))
    # At 15 degrees the standard enters with f_0 F_a/(i C_0), the relative load over cos(alpha).
    relative = 1.43 * math.cos(math.radians(15.0))
    assert iso281.load_factors(math.radians(15.0), relative * 900.0, 9, 10e-3) == pytest.approx(
        (0.44, 1.19, 0.47), rel=2e-3
    )
    assert iso281.load_factors(math.radians(40.0), 5.0, 9, 10e-3) == pytest.approx((0.35, 0.57, 1.14))
    assert iso281.load_factors(math.radians(22.5), 5.0, 9, 10e-3) == pytest.approx((0.42, 0.935, 0.625))
    assert iso281.load_factors(math.radians(45.0), 5.0, 9, 10e-3).axial == pytest.approx(0.5)
    with pytest.raises(ValueError, match="contact angle"):
        iso281.load_factors(math.radians(60.0), 5.0, 9, 10e-3)
    assert iso281.equivalent_load(100.0, 20.0, factors) == 100.0
    assert iso281.equivalent_load(100.0, 50.0, factors) == pytest.approx(56.0 + 72.5)
    assert iso281.equivalent_load(0.0, 50.0, factors) == pytest.approx(72.5)
    assert iso281.basic_life(1000.0, 100.0) == pytest.approx(1000.0)
    assert iso281.basic_life(1000.0, 0.0) == math.inf


@pytest.mark.parametrize("angle", [0.0, 15.0, 40.0])
@pytest.mark.parametrize("gamma", [0.1, 0.2])
def test_both_roads_to_the_race_capacities_meet(published, angle, gamma):
    """Oracle: Q_c from the dimensions is Q_c from C_r (without b_m and the 0.95), up to cos^0.3 and rounded constants."""
    radians = math.radians(angle)
    pitch = 10e-3 * math.cos(radians) / gamma
    direct = published("lundberg_palmgren").lundberg_palmgren_capacities(12, 10e-3, pitch, radians, 0.52, 0.53)
    capacity = life.dynamic_capacity(12, 10e-3, pitch, radians, 0.52, 0.53, rating_factor=1.0 / life.REDUCTION)
    rated = life.rated_capacities(capacity, 12, gamma, radians, 0.52, 0.53)
    scaled = np.array(rated) * math.cos(radians) ** -0.3
    assert scaled == pytest.approx(direct, rel=0.012)


def test_closed_form_even_loads():
    """Closed form: one load Q on all balls lives [(Q_ci/Q)^(-10/3) + (Q_ce/Q)^(-10/3)]^(-9/10), whichever ring turns."""
    loads = np.full(9, 50.0)
    for turning in ("inner", "outer", "both"):
        result = life.row_life(loads, loads, (900.0, 1200.0), turning)
        expected = ((900.0 / 50.0) ** (-10.0 / 3.0) + (1200.0 / 50.0) ** (-10.0 / 3.0)) ** -0.9
        assert result.million_turns == pytest.approx(expected, rel=1e-12)
    assert result.hours(100.0 * math.pi / 30.0, 40.0 * math.pi / 30.0) == pytest.approx(
        expected * 1e6 / 60.0 / 60.0, rel=1e-12
    )
    assert result.hours(5.0, 5.0) == math.inf
    assert life.row_life(0.0 * loads, 0.0 * loads, (900.0, 1200.0)).million_turns == math.inf


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(0.0, 1e3), min_size=12, max_size=12).filter(lambda q: max(q) > 1.0), st.floats(0.1, 10.0))
def test_invariants_of_life(loads, factor):
    """Invariant: cube law; order of the balls is nothing; standing races suffer more; samples of balls that go round
    make both races alike."""
    loads = np.array(loads)
    capacities = (900.0, 1200.0)
    base = life.row_life(loads, loads, capacities)
    assert life.row_life(factor * loads, factor * loads, capacities).million_turns == pytest.approx(
        base.million_turns * factor**-3.0, rel=1e-9
    )
    assert life.row_life(loads[::-1], loads[::-1], capacities) == pytest.approx(base) or math.isclose(
        life.row_life(loads[::-1], loads[::-1], capacities).million_turns, base.million_turns, rel_tol=1e-9
    )
    assert life.standing_race_load(loads[None]) >= life.turning_race_load(loads[None]) * (1.0 - 1e-12)
    rounds = np.array([np.roll(loads, k) for k in range(12)])
    assert life.standing_race_load(rounds) == pytest.approx(life.turning_race_load(rounds), rel=1e-9)


@pytest.mark.parametrize("tilts", [True, False])
def test_oracle_rigid_rings_are_the_full_model_at_rest(tilts):
    """Oracle: without speed the full model's two contacts in line are one spring: same place, loads and angles."""
    row = rigid_rings.rigid_row(
        10, 4.85e-3, 18e-3, 0.52, 0.53, MODULUS,
        free_contact_angle=math.radians(15.0), nominal_angle=math.radians(15.0),
    )  # fmt: skip
    rest = rigid_rings.distribution(row, 150.0, 90.0, tilts=tilts)
    steel = {"elastic_modulus_GPa": 210.0, "poisson_ratio": 0.3, "density_kg_m3": 7850.0}
    scene = BallScene.from_dict(
        {
            "bearing": {
                "kind": "angular_contact_ball",
                "balls": 10,
                "ball_diameter_mm": 4.85,
                "pitch_diameter_mm": 18.0,
                "contact_angle_deg": 15.0,
                "inner_groove_factor": 0.52,
                "outer_groove_factor": 0.53,
            },
            "operation": {"radial_load_N": 150.0, "axial_load_N": 90.0, "tilt": "free" if tilts else "fixed"},
            "materials": {"ball": steel, "rings": steel},
        }
    )
    solution = equilibrium(scene).rows[0]
    loaded = rest.load > 0.0
    assert solution.inner_load == pytest.approx(rest.load, rel=1e-6, abs=1e-6)
    assert solution.outer_load == pytest.approx(rest.load, rel=1e-6, abs=1e-6)
    assert solution.inner_angle[loaded] == pytest.approx(rest.angle[loaded], rel=1e-6)
    assert solution.displacement[[0, 2]] == pytest.approx((rest.radial, rest.axial), rel=1e-6)
    # A tilt about y lowers the axial place of the balls along x; the standard takes the sine.
    assert -solution.displacement[4] == pytest.approx(math.sin(rest.tilt), rel=1e-5, abs=1e-12)
