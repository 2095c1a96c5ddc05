"""Values and results that no bearing has: refused where impossible, told in a sentence where another unit is likely."""

import math
from pathlib import Path

import pytest

from rbdyn.base.faults import InputError
from rbdyn.contact.film_thickness import half_width
from rbdyn.dynamics.parameters.model import rolling_contacts
from rbdyn.dynamics.parameters.validity import heat_notes, race_notes, race_report
from rbdyn.dynamics.simulate import simulate
from rbdyn.result import Film, RollerContact
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
FITS = "mounting={bore_mm=27.0, outside_diameter_mm=60.0, housing_diameter_mm=80.0, inner_ring_temperature_C=383.0}"


@pytest.mark.parametrize(
    ("assignment", "mend"),
    [
        ("cage.mass_g=0.11", "outside the usual 2.98 to 1.19e+03; if 0.11 kg are meant, write 110"),
        ("bearing.radial_clearance_mm=0.000065", "if 6.5e-05 m are meant, write 0.065"),
        ("cage.pocket_clearance_mm=0.000065", "if 6.5e-05 m are meant, write 0.065"),
        ("cage.pocket_clearance_mm=4.0", "if 4 um are meant, write 0.004"),
        ("lubricant.temperature_C=343.0", "outside the usual -60 to 220; if 343 K are meant, write 69.85"),
        ("cage.mass_g=100000.0", "check its unit"),
        ("lubricant.race_roughness_um=50.0", "if 50 nm are meant, write 0.05"),
        ("lubricant.viscosity_mPas=0.0029", "if 0.0029 Pa s are meant, write 2.9"),
        (FITS, "if 383 K are meant, write 109.9"),
        ("model.pocket_bar_stiffness_N_m=50.0", "usual 5.5e+04 to 1.1e+10; if 50 N/um are meant, write 5e+07"),
        ("model.pocket_bar_stiffness_N_m=5000.0", "if 5000 N/mm are meant, write 5e+06"),
        ("lubricant.pressure_coefficient_1_GPa=1e-8", "outside the usual 2 to 80; if 1e-08 1/Pa are meant, write 10"),
        ("lubricant.pressure_coefficient_1_GPa=0.0125", "if 0.0125 1/MPa are meant, write 12.5"),
        ("cage.inertia_kg_mm2=2.2e-5", "outside the usual 1.41 to 563; if 2.2e-05 kg m2 are meant, write 22"),
        ("cage.inertia_kg_mm2=22000.0", "if 22000 g mm2 are meant, write 22"),
    ],
)
def test_unit_a_value_in_another_unit_says_which(make_scene, assignment, mend):
    """Unit: one sentence with key, value, what is usual and what the number would be in the unit of the key."""
    (note,) = make_scene(assignment).unit_notes
    key = "mounting.inner_ring_temperature_C" if assignment == FITS else assignment.partition("=")[0]
    assert note.startswith(f"{key} = ") and note.endswith(mend)


def test_unit_ordinary_values_are_not_suspected(make_scene):
    """Unit: the examples, the corners and extremes of their study, clearances of 1 um and 2 mm, a cage of PEEK."""
    for name in ("cylindrical_roller.toml", "all_options.toml"):
        assert Scene.load(EXAMPLES / name).unit_notes == ()
    for clearance in ("0.0", "0.001", "-0.004", "-0.000065", "0.1"):
        assert make_scene(f"bearing.radial_clearance_mm={clearance}").unit_notes == ()
    for clearance in ("0.001", "2.0"):
        changes = (f"cage.pocket_clearance_mm={clearance}", "cage.guide_clearance_mm=1.0", "cage.guidance=roller")
        assert make_scene(*changes).unit_notes == ()
    assert make_scene("materials.cage=peek", "cage.mass_g=7.0").unit_notes == ()
    for stiffness in ("rigid", "1e6", "1e9"):
        assert make_scene(f"model.pocket_bar_stiffness_N_m={stiffness}").unit_notes == ()
    assert make_scene("cage.inertia_kg_mm2=15.0", "lubricant.pressure_coefficient_1_GPa=5.0").unit_notes == ()
    assert make_scene("lubricant.temperature_C=-40.0", "lubricant.roller_roughness_um=1.0").unit_notes == ()


def test_unit_a_refused_clearance_says_what_was_meant(make_scene):
    """Unit: 65 nm of guide clearance are refused in one sentence, with the metres that were meant; other faults keep theirs."""
    with pytest.raises(InputError) as caught:
        make_scene("cage.guide_clearance_mm=0.000065", "numerics.turns=1e-3")
    first, second = caught.value.faults
    assert "model.land_film_floor_um" in first and first.endswith("if 6.5e-05 m are meant, write 0.065")
    assert "numerics.turns" in second and "usual" not in second


def test_unit_kelvin_beyond_the_range_say_so(make_scene):
    """Unit: 373.15 is refused as a temperature in Celsius, with that of 373.15 K."""
    with pytest.raises(InputError, match=r"lubricant.temperature_C = 373.15: .*if 373.15 K are meant, write 100"):
        make_scene("lubricant.temperature_C=373.15")


@pytest.mark.parametrize(
    "key",
    [
        "bearing.inner_ring_mass_kg", "support.outer_ring_mass_kg", "cage.guide_clearance_mm", "cage.pocket_clearance_mm",
        "lubricant.roller_roughness_um", "model.land_fill", "model.pocket_restitution", "traction.limiting_shear_ratio",
    ],
)  # fmt: skip
def test_unit_denormal_numbers_are_refused(make_scene, key):
    """Unit: 5e-324, above zero by its letter, is below every range."""
    support = ("support.stiffness_N_m=1e7", "support.damping_N_s_m=1e3") if key.startswith("support") else ()
    with pytest.raises(InputError) as caught:
        make_scene(*support, f"{key}=5e-324")
    assert [key in fault and "must be at least 1e-" in fault for fault in caught.value.faults] == [True]


def test_closed_form_a_load_that_flattens_a_roller(make_scene):
    """Closed form: refused where Hertz's contact under 5 F/Z is as wide as the roller, accepted just below."""
    contact = rolling_contacts(make_scene())["inner"]
    # Half-width 4.5 mm under Q = F/2 of ten rollers; it grows with the root of the load.
    limit = 2.0 * (4.5e-3 / float(half_width(contact, 1.0))) ** 2
    make_scene(f"operation.radial_load_N={0.999 * limit}")
    with pytest.raises(
        InputError, match=r"operation.radial_load_N = .*: a roller of 9 mm would have a contact 9 mm wide"
    ):
        make_scene(f"operation.radial_load_N={1.001 * limit}")


def test_unit_races_tell_dents_and_thin_films(make_scene, outer):
    """Unit: a note from 4000 MPa on, and from lambda = 1 down unless the law knows of asperities or of no film."""

    def contact(pressure: float = 3999.0, ratio: float = 1.01) -> RollerContact:
        return RollerContact(pressure, 90.0, Film(0.2, 0.1, ratio))

    sound = contact()
    assert tuple(race_notes(outer, {"inner": sound, "outer": sound})) == ()
    (note,) = race_notes(outer, {"inner": sound, "outer": contact(4001.0)})
    assert note.startswith("outer raceway: dented by 4001 MPa, more than the 4000 MPa of ISO 76") and "rollers" in note
    dents = [next(race_notes(outer, {"inner": contact(pressure)})).code for pressure in (5311.0, 5313.0)]
    assert dents == ["dent", "overload"]
    thin = {"inner": contact(ratio=0.4), "outer": contact(ratio=0.3)}
    (note,) = race_notes(outer, thin)
    assert "lambda is 0.3 on the outer raceway" in note and "traction.friction = 'mixed'" in note
    mixed = ("traction.model=thermal_newtonian", "traction.friction=mixed")
    for changes in (mixed, ("traction.model=coulomb",), ("traction.model=off",)):
        assert tuple(race_notes(make_scene(*changes), thin)) == ()
    assert tuple(race_notes(outer, race_report(outer, 730.0, 790.0))) == ()
    assert tuple(race_notes(outer, {"inner": RollerContact(1000.0, 90.0)})) == ()


def test_unit_heat_that_no_oil_carries_off(outer):
    """Unit: 3.3 W/mm2 of 2 pi 43.5 mm x 5 mm, 4510 W, are the limit; the note counts the oil, 27 W/K a litre a minute."""
    limit = 3.3 * 2.0 * math.pi * 43.5 * 5.0
    assert heat_notes(outer, 0.99 * limit) == ()
    (note,) = heat_notes(outer, 1.01 * limit)
    assert note.code == "heat" and "which is not realistic" in note and f"{1.01 * limit / 2700.0:.2g} L/min" in note
    assert note.endswith("mPa s at 100 °C)")


def test_unit_a_result_carries_its_notes(make_scene, outer_result):
    """Unit: a run of an overloaded bearing with rough races in oil of 343 C tells all three; the plain one tells none."""
    words = ("MPa of ISO 76", "film: lambda", "if 343 K are meant")
    bad = make_scene(
        "operation.radial_load_N=20000.0", "lubricant.roller_roughness_um=0.5", "lubricant.temperature_C=343.0",
        "numerics.turns=0.2", "numerics.discard_turns=0.0", "numerics.replicates=1", "numerics.companion=false",
        "numerics.extend=false", "numerics.impact_window_turns=0.2",
    )  # fmt: skip
    notes = simulate(bad).notes
    assert all(any(word in note for note in notes) for word in words)
    assert not any(word in note for note in outer_result.notes for word in (*words, "usual", "sheds"))
