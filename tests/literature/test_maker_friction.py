"""The maker's friction and minimum load, and how a scene that states a designation is compared with them."""

import json
import math
from dataclasses import replace

import pytest
from conftest import ROOT
from synthetic_study import summary
from typer.testing import CliRunner

from doe.report.sections.answer import power
from doe.report.summary import Summary
from rbdyn import Scene
from rbdyn.base.faults import InputError
from rbdyn.cli.app import app
from rbdyn.dynamics.parameters.validity import friction_check, friction_notes, light_load_notes
from rbdyn.life import friction, rollers
from rbdyn.life.rollers import minimum_loads
from rbdyn.properties.catalogue import Envelope, envelope, read_designation

# Size, bore, outside diameter, width [mm], R1, reference speed [rpm], 0.05 C0 [N], and of a calculation apart from this
# package, with ISO VG 32 at 70 C: SKF's power and the heat of ISO 15312 [W].
BEARINGS = [
    ("204", 20, 47, 14, 1.09e-6, 16000, 1100, 83, 47), ("208", 40, 80, 18, 1.09e-6, 9500, 2650, 193, 109),
    ("210", 50, 90, 20, 1.09e-6, 8500, 3475, 250, 141), ("215", 75, 130, 25, 1.09e-6, 5600, 7800, 428, 258),
    ("220", 100, 180, 34, 1.09e-6, 4000, 15250, 671, 479), ("308", 40, 90, 23, 1.09e-6, 8000, 3900, 208, 150),
    ("314", 70, 150, 35, 1.09e-6, 4800, 11400, 467, 387), ("320", 100, 215, 47, 1.09e-6, 3200, 22000, 732, 744),
    ("1020", 100, 150, 24, 1.12e-6, 5000, 5700, 515, 302), ("2210", 50, 90, 23, 1.40e-6, 8500, 4400, 346, 162),
]  # fmt: skip
RPM = math.pi / 30.0
KEYS = {
    "skf_power_W", "skf_rolling_moment_N_mm", "skf_sliding_moment_N_mm", "iso_15312_heat_W", "ratio",
    "skf_starvation_factor",
}  # fmt: skip
NAMES = [f"NU {each[0]}" for each in BEARINGS]


def moments_in_mm(bore, outside, first, rpm, load, cst, k_rs):
    """SKF's rolling and sliding moment in its own units, mm, rpm, N, mm^2/s: N mm."""
    mean = (bore + outside) / 2
    ish = 1 / (1 + 1.84e-9 * (rpm * mean) ** 1.28 * cst**0.64)
    rs = 1 / math.e ** (k_rs * cst * rpm * (bore + outside) * (5.1 / 2 / (outside - bore)) ** 0.5)
    bl = 1 / math.e ** (2.6e-8 * (rpm * cst) ** 1.4 * mean)
    return first * mean**2.41 * load**0.31 * (cst * rpm) ** 0.6 * ish * rs, 0.0015 * mean * load * (0.02 + 0.1 * bl)


@pytest.mark.parametrize("bearing", BEARINGS, ids=NAMES)
def test_literature_skf_moments(bearing):
    """Literature: SKF's formulas as typed apart in their own units, slow and fast, for a bath and for grease."""
    size, bore, outside, _, first, rpm, load, _, _ = bearing
    series = read_designation(f"NU{size}").series
    for speed in (0.01 * rpm, 0.3 * rpm, rpm):
        for cst in (3.0, 11.0, 60.0):
            for supply, k_rs in ((None, 3e-8), ("bath", 3e-8), ("jet", 3e-8), ("oil_air", 6e-8), ("grease", 6e-8)):
                running = friction.Running(1e-3 * bore, 1e-3 * outside, speed * RPM, 1e-6 * cst, supply)
                found = rollers.skf_moments(series, running, load)
                expected = moments_in_mm(bore, outside, first, speed, load, cst, k_rs)
                assert [1e3 * each for each in found] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("bearing", BEARINGS, ids=NAMES)
def test_literature_friction_check_at_the_reference_speed(bearing, make_scene):
    """Literature: the check of a scene gives SKF's power and the heat of ISO 15312 of a calculation made apart, within 1 %."""
    size, bore, outside, width, _, rpm, load, skf, heat = bearing
    sizes = envelope(read_designation(f"NU{size}"))
    assert (sizes.bore, sizes.outside, sizes.width, sizes.reference_speed) == (bore, outside, width, rpm)
    assert 50.0 * (sizes.static_capacity or 0.0) * 1e-3 == pytest.approx(load)
    oil = ('lubricant.oil="ISO VG 32"', "lubricant.temperature_C=70.0")
    point = (f"operation.inner_speed_rpm={rpm}", f"operation.radial_load_N={float(load)}")
    scene = make_scene(f'bearing.designation="NU {size}"', "lubricant.supply=bath", *oil, *point)
    check = friction_check(scene, 2.5 * skf)
    assert check is not None and check.as_dict().keys() == KEYS
    assert check.skf_power_W == pytest.approx(skf, rel=0.01)
    assert check.iso_15312_heat_W == pytest.approx(heat, abs=0.6)
    total = check.skf_rolling_moment_N_mm + check.skf_sliding_moment_N_mm
    assert check.skf_power_W == pytest.approx(1e-3 * total * rpm * RPM)
    assert check.ratio == pytest.approx(2.5 * skf / check.skf_power_W)
    (note,) = friction_notes(check)
    assert "2.5 times the" in note and "W of SKF's friction model, outside 0.5 to 2" in note


def test_unit_cold_oil_has_no_ratio(make_scene):
    """Unit: exp(-3e-8 nu n (d + D) sqrt(5.1/(2 (D - d)))) below 0.1 leaves no rolling friction to compare with, and a note says so."""
    point = (
        'lubricant.oil="ISO VG 220"',
        "lubricant.temperature_C=0.0",
        "operation.inner_speed_rpm=600.0",
        "lubricant.supply=bath",
    )
    scene = make_scene('bearing.designation="NU 2212"', *point)
    check = friction_check(scene, 500.0)
    nu = 1e6 * scene.oil().viscosity / scene.oil().density
    factor = math.exp(-3e-8 * nu * 600.0 * (60.0 + 110.0) * math.sqrt(5.1 / (2.0 * 50.0)))
    assert check is not None and check.ratio is None
    assert check.skf_starvation_factor == pytest.approx(factor, rel=1e-9) and factor < 0.1
    (note,) = friction_notes(check)
    assert note.code == "starved" and f"factor of {factor:.2g}" in note


def test_unit_limits_of_the_factors():
    """Unit: slow bearings are neither heated nor starved and slide at the boundary, fast ones in the film; axial load slides."""
    slow, thick = 1e-6 * RPM, 1e-4
    rollers_geometry, rollers_film = rollers.ROLLER_GEOMETRY, rollers.FILM_FRICTION
    sizes = 0.05, 0.09
    assert friction.inlet_heating_factor(0.07, slow, thick) == pytest.approx(1.0, abs=1e-9)
    assert friction.starvation_factor(
        rollers_geometry, friction.Running(*sizes, slow, thick, "grease")
    ) == pytest.approx(1.0, abs=1e-9)
    assert friction.sliding_friction(rollers_film, 0.07, slow, thick) == pytest.approx(0.12)
    assert friction.sliding_friction(rollers_film, 0.07, 1e5 * RPM, thick) == pytest.approx(0.02)
    fast = 8500.0 * RPM, 11e-6
    bath = friction.starvation_factor(rollers_geometry, friction.Running(*sizes, *fast, "bath"))
    assert friction.starvation_factor(rollers_geometry, friction.Running(*sizes, *fast, "grease")) == pytest.approx(
        bath**2
    )
    assert friction.inlet_heating_factor(0.07, *fast) < 1.0 and bath < 1.0
    radial, both = (rollers.skf_moments("2", friction.Running(*sizes, *fast), 3e3, axial) for axial in (0.0, 500.0))
    assert both.rolling == radial.rolling
    assert both.sliding - radial.sliding == pytest.approx(1e-3 * 0.16 * 70.0**0.9 * 500.0 * 0.02, rel=1e-3)


def test_literature_heat_of_large_seats():
    """Literature: above 50 000 mm^2 the heat flow density falls with the power -0.34 of the seat, without a step."""
    small, large = (Envelope(100.0, 200.0, width) for width in (5e4 / (300.0 * math.pi), 1e5 / (300.0 * math.pi)))
    assert rollers.iso_15312_heat(small) == pytest.approx(0.016 * 5e4)
    assert rollers.iso_15312_heat(large) == pytest.approx(0.016 * 1e5 * 2.0**-0.34)


def test_unit_no_check_without_a_model(make_scene):
    """Unit: none without a designation or with a schedule, no ratio without load, and no note on an unknown or usual ratio."""
    assert friction_check(make_scene(), 100.0) is None and friction_notes(None) == ()
    named = 'bearing.designation="NU 210"'
    schedule = "operation.schedule={time_s=[0.0, 1.0], radial_load_N=[100.0, 200.0]}"
    assert friction_check(make_scene(named, schedule), 100.0) is None
    idle = friction_check(make_scene(named, "operation.radial_load_N=0.0"), 100.0)
    assert idle is not None and idle.ratio is None and idle.skf_power_W == 0.0 and friction_notes(idle) == ()
    usual = friction_check(make_scene(named), 100.0)
    assert usual is not None
    for ratio, notes in ((0.49, 1), (0.51, 0), (1.99, 0), (2.01, 1)):
        assert len(friction_notes(replace(usual, ratio=ratio))) == notes


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("XY99", "bearing.designation = 'XY99': is not a known designation"),
        ("NU 299", "bearing.designation = 'NU 299': is not in the tables here; correct it or leave it out"),
        ("6208 C3", "bearing.designation = '6208 C3': is a ball bearing; name the cylindrical roller bearing"),
        ("NU 210 V", "bearing.designation = 'NU 210 V': suffix V is a bearing without a cage"),
    ],
)
def test_unit_unknown_designations_are_refused(make_scene, text, words):
    """Unit: one sentence with the key, the designation and what to do."""
    with pytest.raises(InputError) as refused:
        make_scene(f'bearing.designation="{text}"')
    (fault,) = refused.value.faults
    assert words in fault


def test_command_line_one_note_on_other_dimensions(tmp_path):
    """Command line: what ``rbdyn new`` writes agrees with its designation, whose other sizes give one note with every key."""
    for name in (*NAMES, "NU 1005", "NU 2320", "NJ 306 ECP"):
        ran = CliRunner().invoke(app, ["new", name, "--json"])
        assert ran.exit_code == 0, ran.stderr
        tables = json.loads(ran.stdout)
        assert tables["bearing"]["designation"] == name and Scene.from_dict(tables).catalogue_notes == ()
    other = Scene.from_dict(tables, "scene", ["bearing.designation=NU 310"])
    (note,) = other.catalogue_notes
    assert note.startswith(
        "bearing.designation = 'NU 310': its catalogue sizes disagree with bearing.pitch_diameter_mm = "
    )
    assert "bearing.roller_diameter_mm = " in note


def test_literature_minimum_load_by_series(make_scene):
    """Literature: k_r (6 + 4 n/n_r)(d_m/100)^2 kN with the factor of the series and the catalogue's reference speed."""
    for (size, *_), factor in zip(BEARINGS, (0.15,) * 8 + (0.1, 0.2), strict=True):
        assert rollers.SERIES[read_designation(f"NU{size}").series].minimum_load == factor
    assert minimum_loads(0.07, 4250.0 * RPM, 0.0, 0.0, (0.15, 8500.0 * RPM))["SKF, k_r = 0.15"] == pytest.approx(588.0)
    point = ("operation.inner_speed_rpm=4250.0", "operation.radial_load_N=100.0")
    (note,) = light_load_notes(make_scene('bearing.designation="NU 210"', *point))
    assert "0.59 kN (SKF, k_r = 0.15)" in note and "of 4 manufacturers' minimum loads" in note


def test_command_line_states_the_makers_friction(tmp_path):
    """Command line: one line in the answer of a scene with a designation, null in JSON without one."""
    words = ("turns=2", "discard_turns=1", "replicates=2", "impact_window_turns=1", "extend=false", "companion=false")
    quick = [part for each in words for part in ("--set", f"numerics.{each}")]
    scene = str(ROOT / "examples" / "cylindrical_roller.toml")
    plain = CliRunner().invoke(app, ["simulate", scene, *quick, "--json"])
    assert json.loads(plain.stdout)["friction_check"] is None
    named = [*quick, "--set", "bearing.designation=NU 1005"]
    ran = CliRunner().invoke(app, ["simulate", scene, *named, "--json"])
    result = json.loads(ran.stdout)
    assert (
        result["friction_check"].keys() == KEYS and result["power_loss_W"] == json.loads(plain.stdout)["power_loss_W"]
    )
    shown = CliRunner().invoke(app, ["simulate", scene, *named])
    (line,) = [line for line in shown.stdout.splitlines() if line.startswith("friction by SKF's model ")]
    assert (
        f"power loss is {result['friction_check']['ratio']:.2f} of SKF's" in line
        and "heat at the reference speed by ISO 15312" in line
    )


def test_unit_a_study_states_the_makers_friction():
    """Unit: below the powers of confirmed points stands their ratio to SKF's; nothing without a designation."""
    terms = {"power_terms_W": {"rolling_resistance": 100.0, "land_film": 20.0}}
    check = dict.fromkeys(KEYS, 1.0) | {"skf_power_W": 80.0}
    points = {"baseline": {**terms, "friction_check": check | {"ratio": 1.5}},
              "pick": {**terms, "friction_check": check | {"ratio": 1.4}}}  # fmt: skip

    def stated(changes: dict[str, dict]) -> str:
        record = summary()
        for name, change in changes.items():
            record["confirmation"][name] |= change
        return str(power(Summary.from_dict(record)).blocks)

    named, plain = stated(points), stated({"baseline": terms, "pick": terms})
    assert "over the 80 W of SKF's friction model: baseline 1.50, selected design 1.40." in named
    assert "SKF" not in plain
