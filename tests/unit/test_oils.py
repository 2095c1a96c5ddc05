"""Oils by grade and data sheet, what a scene makes of them, loads below the makers' minimum, cages without a land."""

import dataclasses
import math

import numpy as np
import pytest

from rbdyn.base.faults import InputError
from rbdyn.contact.rheology import LimitingShear
from rbdyn.dynamics.parameters.model import _rheology, roller_bearing
from rbdyn.dynamics.parameters.state import start_state
from rbdyn.dynamics.parameters.validity import light_load_notes
from rbdyn.life.rollers import minimum_loads
from rbdyn.properties.materials import oil_at
from rbdyn.properties.oils import (
    BASE_OILS,
    GOLD_SPREAD,
    GRADES,
    JET_OIL_II,
    NamedOil,
    Walther,
    grade_oil,
    oil_named,
    viscosity_at_100,
    viscosity_index,
)
from rbdyn.scene import Scene
from rbdyn.scene.ball import BallScene
from rbdyn.scene.lubricant import Lubricant


def lubricant(**keys):
    return Lubricant.model_validate({"oil": "ISO VG 32", "temperature_C": 70.0, **keys})


@pytest.mark.parametrize(
    ("at_40", "at_100", "index"),
    [(73.30, 8.86, 92), (22.83, 5.05, 156), (53.47, 7.80, 111)],
    ids=["below", "above", "near"],
)
def test_literature_examples_of_d2270(at_40, at_100, index):
    """Literature: the three worked examples of ASTM D2270, to the whole number that the standard asks for."""
    assert round(viscosity_index(at_40, at_100)) == index
    # A whole index leaves the viscosity at 100 C open by that much.
    assert viscosity_at_100(at_40, index) == pytest.approx(at_100, rel=2e-3)


def test_literature_grades_with_an_index_of_95():
    """Literature: viscosities at 100 C of the ISO grades by the table of D2270, which another program interpolates."""
    table = (2.64, 3.38, 4.25, 5.29, 6.65, 8.53, 11.07, 14.55, 18.75, 23.96, 30.35)
    assert [viscosity_at_100(grade, 95.0) for grade in GRADES] == pytest.approx(table, abs=0.011)


@pytest.mark.parametrize("index", [0.0, 50.0, 99.99, 100.01, 140.0, 200.0])
@pytest.mark.parametrize("grade", GRADES[2:])
def test_invariant_index_goes_there_and_back(grade, index):
    """Invariant: the viscosity found for an index has that index, within the seams of the tabulated pieces."""
    assert viscosity_index(grade, viscosity_at_100(grade, index)) == pytest.approx(index, abs=0.6)


def test_unit_no_index_below_two():
    """Unit: where D2270 defines no index, none is made up."""
    with pytest.raises(ValueError, match="no viscosity index"):
        viscosity_index(5.0, 1.9)
    with pytest.raises(ValueError, match="no oil of 10 mm2/s"):
        viscosity_at_100(10.0, 400.0 * 3)


@pytest.mark.parametrize("celsius", [0.0, 20.0, 70.0, 150.0])
def test_literature_viscosity_at_other_temperatures(celsius):
    """Literature: through 40 and 100 C alone, D341 meets the published fit of MIL-L-7808 elsewhere within 1 %."""

    def kinematic(at):
        oil = oil_at("MIL-L-7808", at)
        return 1e6 * oil.viscosity / oil.density

    found = Walther.through((40.0, kinematic(40.0)), (100.0, kinematic(100.0)))
    assert found.viscosity(celsius) == pytest.approx(kinematic(celsius), rel=0.011)


def test_literature_jet_oil():
    """Literature: Mobil Jet Oil II has the constants of D341 that public code quotes for it, 9.3116 and 3.6661."""
    assert JET_OIL_II.viscosity == pytest.approx((9.3116, 3.6661), rel=2e-4)
    assert JET_OIL_II.at_temperature(15.0).density == 1003.5


@pytest.mark.parametrize(
    ("base", "first", "second", "within"),
    [
        ("mineral", -2.28e7, 2.26e5, GOLD_SPREAD),
        ("PAO", -5.73e7, 3.90e5, GOLD_SPREAD),
        ("naphthenic", -7.23e7, 3.48e5, 0.32),
    ],
)
def test_literature_pressure_coefficient(base, first, second, within):
    """Literature: Gold's form lies below alpha = 1/(a1 + a2 T) as measured on oils of VG 100, within the spread stated."""
    oil = grade_oil(100.0, BASE_OILS[base])
    ratio = [
        oil.at_temperature(c).pressure_coefficient * (first + second * (c + 273.15)) for c in (40.0, 60.0, 80.0, 100.0)
    ]
    assert all(1.0 - within < each < 1.0 for each in ratio)


def test_literature_gold_constants():
    """Literature: s and t of Gold's alpha = s nu^t; mineral oils press harder than PAO, esters and polyglycols."""
    gold = {name: oil.gold for name, oil in BASE_OILS.items()}
    assert gold["mineral"] == (0.9904, 0.1390) and gold["PAO"] == (0.7382, 0.1335)
    assert gold["ester"] == (0.6605, 0.1360) and gold["PAG"] == (0.5489, 0.1485)
    plain = Walther.through((40.0, 100.0), (100.0, 11.07))
    assert grade_oil(100.0, BASE_OILS["mineral"]).at_temperature(100.0).pressure_coefficient == pytest.approx(
        0.9904e-8 * plain.viscosity(100.0) ** 0.1390, rel=1e-3
    )


@pytest.mark.parametrize("base", BASE_OILS)
def test_unit_slope_is_the_derivative(base):
    """Unit: the slope of the viscosity against a difference quotient, over all grades from -20 to 150 C."""
    for grade in (10.0, 100.0, 460.0):
        oil = grade_oil(grade, BASE_OILS[base])
        for celsius in (-20.0, 40.0, 150.0):
            quotient = (
                oil.at_temperature(celsius - 1e-3).viscosity - oil.at_temperature(celsius + 1e-3).viscosity
            ) / 2e-3
            assert oil.at_temperature(celsius).viscosity_slope == pytest.approx(quotient, rel=1e-6)
            assert all(
                math.isfinite(value) and value > 0.0 for value in dataclasses.astuple(oil.at_temperature(celsius))
            )


def test_unit_data_sheet_of_a_grade_is_that_grade():
    """Unit: two points of a grade's own line and its density give the grade back, in any order of the points."""
    grade = grade_oil(46.0, BASE_OILS["PAO"])
    points = [[celsius, grade.viscosity.viscosity(celsius)] for celsius in (80.0, 20.0)]
    told = {"oil": "data_sheet", "base_oil": "PAO", "viscosities_C_mm2_s": points, "density_kg_m3": grade.density}
    found = lubricant(**told).in_service
    assert dataclasses.astuple(found) == pytest.approx(dataclasses.astuple(grade.at_temperature(70.0)), rel=1e-9)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("ISO VG 32", NamedOil("ISO VG 32")),
        ("vg15 pao", NamedOil("ISO VG 15", "PAO")),
        ("  VG  220  PAG ", NamedOil("ISO VG 220", "PAG")),
        ("grease iso vg 100 mineral", NamedOil("ISO VG 100", "mineral", True)),
        ("7808", NamedOil("MIL-L-7808")),
        ("MIL-PRF-23699G", NamedOil("MIL-L-23699")),
        ("mil-l-85734", NamedOil("MIL-L-85734")),
        ("Jet Oil II", NamedOil("Mobil Jet Oil II")),
    ],
)
def test_unit_oils_as_they_are_asked_for(text, found):
    """Unit: usual spellings of an oil."""
    assert oil_named(text) == found


@pytest.mark.parametrize("text", ["", "ISO VG 33", "VG 32 butter", "castor", "32", "VG 99999999999999999999"])
def test_unit_unknown_oils(text):
    """Unit: what is no oil is refused with what may be written."""
    with pytest.raises(ValueError, match="write ISO VG 10, 15"):
        oil_named(text)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"oil": "MIL-L-7808", "base_oil": "PAO"}, "base_oil = PAO: contradicts lubricant.oil = 'MIL-L-7808', which"),
        ({"oil": "Mobil Jet Oil II", "density_kg_m3": 900.0}, "lubricant.density_kg_m3 = 900.0"),
        ({"viscosities_C_mm2_s": [[40.0, 32.0], [100.0, 5.4]]}, "which implies it; leave out one of them"),
        ({"oil": "data_sheet"}, "lubricant.density_kg_m3: missing"),
        ({"oil": "data_sheet"}, "lubricant.viscosities_C_mm2_s: missing"),
        ({"oil": "data_sheet", "viscosity_index": 95.0}, "lubricant.viscosity_index = 95.0: contradicts lubricant.oil"),
        ({"oil": "data_sheet", "viscosities_C_mm2_s": [[40.0, 5.0], [100.0, 32.0]], "density_kg_m3": 880.0}, "must fall"),
        ({"oil": "data_sheet", "viscosities_C_mm2_s": [[40.0, 5.0, 1.0], [100.0]], "density_kg_m3": 880.0}, "each point"),
        ({"oil": "ISO VG 33"}, "choose one of"),
        ({"viscosity_index": float("nan")}, "is not a finite number"),
    ],
)  # fmt: skip
def test_unit_faults_of_an_oil(keys, words, make_scene):
    """Unit: an oil that contradicts itself or lacks something is refused in a sentence that names key and mend."""
    data = make_scene().model_dump(mode="json", exclude={"traction"})
    data["lubricant"] = {"oil": "ISO VG 32", "temperature_C": 70.0, **keys}
    with pytest.raises(InputError) as refused:
        Scene.from_dict(data)
    assert any(words in fault and "lubricant" in fault for fault in refused.value.faults), refused.value.faults


def test_unit_traction_follows_the_oil(make_scene):
    """Unit: new oils bring the traction of their base; whoever asks for a model or a curve keeps it, jet oils keep the old."""
    assert make_scene().traction.model == "four_constant"
    mineral, pao = (
        make_scene("lubricant.oil='ISO VG 32'"),
        make_scene("lubricant.oil='ISO VG 32'", "lubricant.base_oil=PAO"),
    )
    assert (mineral.traction.model, mineral.traction.limiting_shear_ratio) == ("limiting_shear", 0.047)
    assert (pao.traction.model, pao.traction.limiting_shear_ratio) == ("limiting_shear", 0.035)
    assert _rheology(pao, pao.lubricant.in_service) == LimitingShear(
        pao.lubricant.in_service.viscosity, pao.lubricant.in_service.pressure_coefficient, 0.035
    )
    jet = make_scene("lubricant.oil='Mobil Jet Oil II'").traction
    assert (jet.model, jet.rheology_oil) == ("thermal_newtonian", "MIL-L-23699")
    assert make_scene("lubricant.oil='ISO VG 32'", "traction.mu_m=0.06").traction.model == "four_constant"
    assert (
        make_scene("lubricant.oil='ISO VG 32'", "traction.limiting_shear_ratio=0.06").traction.limiting_shear_ratio
        == 0.06
    )
    with pytest.raises(InputError, match=r"has no constants of ISO VG 32; set traction\.rheology_oil"):
        make_scene("lubricant.oil='ISO VG 32'", "traction.model=thermal_newtonian")


def test_unit_estimates_are_told_and_scenes_go_there_and_back(make_scene):
    """Unit: what is estimated of an oil is told; a scene that tells nothing new is saved as before, another as it was."""
    assert make_scene().lubricant.estimates == ()
    saved = make_scene().model_dump(mode="json")["lubricant"]
    assert not {"base_oil", "viscosity_index", "viscosities_C_mm2_s", "density_kg_m3"} & set(saved)
    scene = make_scene("lubricant.oil='ISO VG 100'", "lubricant.base_oil=PAG", "lubricant.viscosity_index=210.0")
    assert Scene.from_dict(scene.model_dump(mode="json")) == scene
    (told,) = scene.lubricant.estimates
    assert all(
        word in told for word in ("ISO VG 100 (PAG)", "D341", "index of 210", "by Gold, within 25 %", "by base oil")
    )
    (alike,) = lubricant(oil="MIL-L-85734").estimates
    assert "is treated as MIL-L-23699" in alike
    (known,) = lubricant(viscosity_mPas=9.0, pressure_coefficient_1_GPa=15.0).estimates
    assert "D341" not in known and "Gold" not in known


def test_unit_oils_of_balls_are_told_too(deep_groove):
    """Unit: the equilibrium of a ball bearing tells what is estimated of its oil."""
    from rbdyn import equilibrium

    deep_groove["lubricant"] = {"oil": "ISO VG 68", "temperature_C": 70.0}
    (note,) = (note for note in equilibrium(BallScene.from_dict(deep_groove)).notes if "lubricant" in note)
    assert "ISO VG 68 (mineral) is estimated at 70 C" in note


@pytest.fixture
def deep_groove():
    """Tables of the example of a deep groove ball bearing."""
    from conftest import ROOT

    from rbdyn.base.faults import read_toml

    return read_toml(ROOT / "examples" / "deep_groove_ball.toml")


def test_literature_minimum_loads_of_a_nu_215():
    """Literature: at 5000 rpm 3.0, 6.0 and 6.2 kN by three rules; the fourth, with k_r = 0.15 of a table, gives 1.5 kN."""
    found = minimum_loads(0.1035, 5000.0 * math.pi / 30.0, 150e3, 156e3)
    assert [found[rule] for rule in ("SKF, 0.02 C", "Timken, 0.04 C", "NTN, 0.04 C0")] == pytest.approx(
        [3000, 6000, 6240]
    )
    low, high = (1.5 * found["SKF, k_r = 0.1"], 0.5 * found["SKF, k_r = 0.3"])
    assert low == pytest.approx(high) == pytest.approx(1530.0, rel=0.03)


def test_unit_light_loads_are_told(make_scene):
    """Unit: a load below a rule is told with all rules, one above all of them is not."""
    (note,) = light_load_notes(make_scene("operation.radial_load_N=100.0"))
    assert "100 N is below 5 of 5" in note and "Timken, 0.04 C" in note
    assert light_load_notes(make_scene("operation.radial_load_N=3000.0")) == ()


def test_unit_rollers_guide_a_cage_without_a_land(make_scene):
    """Unit: under guidance by the rollers no guide clearance is needed, and one that is given changes no law."""
    data = make_scene("cage.guidance=roller").model_dump(mode="json")
    given = Scene.from_dict(data)
    del data["cage"]["guide_clearance_mm"]
    bare = Scene.from_dict(data)
    assert bare.guide_clearance_m is None and type(roller_bearing(bare)) is type(roller_bearing(given))
    draw = np.random.default_rng(1)
    assert np.isfinite(start_state(bare, roller_bearing(bare), draw)).all()
    data["cage"]["guidance"] = "outer"
    with pytest.raises(InputError, match=r"cage\.guide_clearance_mm: missing; add it"):
        Scene.from_dict(data)
