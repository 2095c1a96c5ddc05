"""``rbdyn new`` and ``doe new`` as a user meets them."""

import json
import math
import re
import subprocess
import sys
import tomllib

import pytest
from doe_command import doe
from typer.testing import CliRunner

from rbdyn.cli.app import app
from rbdyn.scene import Scene
from rbdyn.scene.unknown import inputs_of

QUICK = ("turns=3", "discard_turns=2", "replicates=2", "impact_window_turns=1", "companion=false", "extend=false")
SET = [part for assignment in QUICK for part in ("--set", f"numerics.{assignment}")]
NU_210 = ("NU210", "--speed", "6000", "--load", "2000", "--oil", "ISO VG 32", "--temperature", "70")
NU_1010 = ("NU", "1010", "--speed", "9000", "--load", "3000", "--oil", "VG 15 PAO", "--temperature", "60")


@pytest.mark.slow
@pytest.mark.parametrize(("arguments", "cage_rpm"), [(NU_210, 2532.0), (NU_1010, 3981.0)], ids=["NU 210", "NU 1010"])
def test_command_line_from_a_designation_to_a_run(command, tmp_path, arguments, cage_rpm):
    """Command line: a designation, an oil and an operating point give a scene that runs, its cage near the epicyclic speed."""
    written = command("new", *arguments)
    assert written.returncode == 0 and written.stderr == "" and "estimated" in written.stdout
    path = tmp_path / "my.toml"
    path.write_text(written.stdout, encoding="utf-8")
    ran = command("simulate", path, "--json", *SET)
    assert ran.returncode == 0, ran.stderr
    result = json.loads(ran.stdout)
    assert result["cage_speed_rpm"]["value"] == pytest.approx(cage_rpm, rel=0.03)
    assert 50.0 < result["power_loss_W"]["value"] < 1000.0
    assert any(note["text"].startswith("lubricant: ISO VG") for note in result["notes"])
    assert result["scene"]["traction"]["model"] == "limiting_shear"
    check = result["friction_check"]
    assert (
        check["ratio"] == pytest.approx(result["power_loss_W"]["value"] / check["skf_power_W"])
        and 0.5 < check["ratio"] < 2.0
    )


def test_command_line_balls_with_a_preload(command, tmp_path):
    """Command line: a 7208 with a preload has an equilibrium in which every ball bears."""
    path = tmp_path / "my.toml"
    asked = ("7208", "--speed", "6000", "--load", "1000", "--preload", "2500", "--oil", "grease VG 100")
    path.write_text(command("new", *asked).stdout, encoding="utf-8")
    record = json.loads(command("ball", path, "--json").stdout)
    assert record["status"] == "ok" and min(ball["inner_load_N"] for ball in record["balls"]) > 0.0
    assert record["life"]["L10_h"] > 1000.0


OWN = ("own", "--rollers", "16", "--roller", "7x7", "--pitch", "60", "--guidance", "inner")
PERCENT = re.compile(r"([a-z_]+) = ([0-9.]+) +# estimated: .*\+-(\d+) %$", re.MULTILINE)


@pytest.mark.parametrize("bearing", [("NU210",), ("NU1020",), ("NJ2208",), OWN, (*OWN, "--width", "12")])
def test_command_line_errors_of_a_cage_are_the_ranges_of_its_inputs(command, bearing):
    """Command line: +-N % in a comment of [cage] is what an analysis of unknown inputs varies, and the declared keys vary."""
    text = command("new", *bearing, *NU_210[1:]).stdout
    scene = Scene.from_dict(tables := tomllib.loads(text))
    laws = {entry.key: entry.law for entry in inputs_of(scene, tables, scene.uncertain)}
    stated = PERCENT.findall(text.partition("[cage]")[2].partition("\n[")[0])
    assert {"mass_g", "bar_thickness_mm", "side_ring_width_mm"} <= {key for key, *_ in stated}
    for key, _, percent in stated:
        law = laws[f"cage.{key}"]
        assert (law.low, law.high) == pytest.approx((1.0 - 0.01 * float(percent), 1.0 + 0.01 * float(percent)))
        assert law.times == f"cage.{key}"
    ring, land = laws["cage.side_ring_width_mm"], laws.get("cage.land_width_mm")
    assert land is None or (land.low, land.high) == (ring.low, ring.high)


def test_command_line_json_is_the_scene(command):
    """Command line: --json prints what reading the TOML gives, and loads no compiler."""
    told = json.loads(command("new", *NU_210, "--json").stdout)
    assert told == tomllib.loads(command("new", *NU_210).stdout)
    assert told["operation"] == {"inner_speed_rpm": 6000.0, "radial_load_N": 2000.0}
    program = "import sys; sys.argv = ['rbdyn', 'new', 'NU210']\nfrom rbdyn.cli import run\ntry:\n    run()\nexcept SystemExit:\n    pass\n"
    program += "print('numba' in sys.modules, 'pandas' in sys.modules, file=sys.stderr)"
    light = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert light.stderr.split() == ["False", "False"]


def test_command_line_suffixes_and_grease(command):
    """Command line: suffixes tell cage and clearance, grease starves, a size that is not listed takes its dimensions."""

    def scene(*arguments):
        return json.loads(command("new", *arguments, "--json").stdout)

    soft = scene("NU", "315", "TVP2", "C3", "--oil", "grease VG 100")
    assert soft["cage"]["guidance"] == "roller" and "guide_clearance_mm" not in soft["cage"]
    assert soft["materials"]["cage"]["density_kg_m3"] == 1300.0 and "pocket_bar_stiffness_N_m" not in soft["model"]
    starved = {"supply": "grease", "inlet_distance": 5.0, "oil_fraction": 0.005}
    assert "rolling_resistance_factor" not in soft["model"] and soft["lubricant"].items() >= starved.items()
    assert soft["bearing"]["radial_clearance_mm"] == pytest.approx(0.5e-3 * (65 + 100))
    own = scene("NU2210", "--bore", "51", "--outside", "91", "--width", "24", "--clearance", "c2")
    assert (
        not {"dynamic_capacity_N", "designation"} & own["bearing"].keys()
        and own["bearing"]["radial_clearance_mm"] == 0.025
    )
    ball = scene("6208-2RS", "C3")
    assert ball["bearing"]["radial_clearance_mm"] == 0.024 and "contact_angle_deg" not in ball["bearing"]


def test_unit_ring_classes_enter_the_fits():
    """Unit: a bearing of class P5 is 2 um narrower at 40 and 80 mm than a normal one; a tapered bore brings no interference."""

    def written(*arguments):
        ran = CliRunner().invoke(app, ["new", *arguments])
        assert ran.exit_code == 0, ran.output
        return ran.stdout, tomllib.loads(ran.stdout).get("mounting", {})

    (_, normal), (text, fine) = written("NU2208", "--shaft", "k5"), written("NU2208/P5", "--shaft", "k5")
    assert normal["inner_interference_um"] - fine["inner_interference_um"] == pytest.approx(2.0)
    assert fine["outer_interference_um"] - normal["outer_interference_um"] == pytest.approx(2.0)
    assert "bearing of class P5 (ISO 492)" in text and "Suffixes that change nothing" not in text
    spindle, ball = written("7014 CD/P4A", "--shaft", "k5")
    assert "class P4A, diameters as of P4" in spindle and ball["inner_interference_um"] == pytest.approx(10.25)
    _, tapered = written("N1014-K-M1-SP", "--clearance", "0.01", "--housing", "K6")
    assert tapered["inner_interference_um"] == 0.0
    assert "P5, tolerance class, which counts with --shaft" in written("NU2208/P5")[0]


def test_unit_fits_write_a_mounting():
    """Unit: classes of shaft and housing give interferences with their spread, warm rings, and clearances that they change."""

    def scene(*arguments):
        written = CliRunner().invoke(app, ["new", *arguments])
        assert written.exit_code == 0, written.output
        return tomllib.loads(written.stdout)

    fitted = scene("NU210", "--shaft", "m5", "--housing", "K7", "--temperature", "80")
    mounting, uncertain = fitted["mounting"], fitted["uncertain"]
    # Shaft 9 to 20 um, bore -12 to 0; outside -15 to 0, housing -25 to 10: less 1.75 um of smoothing where tight.
    assert mounting["inner_interference_um"] == pytest.approx(0.5 * (9 + 20) + 6 - 1.75)
    assert mounting["outer_interference_um"] == pytest.approx(0.0, abs=0.01)
    assert (mounting["bore_mm"], mounting["outside_diameter_mm"], mounting["housing_diameter_mm"]) == (
        50.0,
        90.0,
        135.0,
    )
    warm = [mounting[f"{part}_temperature_C"] for part in ("outer_ring", "inner_ring", "roller", "shaft")]
    assert warm == [80.0, 87.5, 87.5, 79.1] and "mounting.inner_ring_temperature_C" in uncertain["estimated"]
    law = uncertain["mounting.inner_interference_um"]
    assert law["kind"] == "varies" and law["sd"] == pytest.approx(math.hypot(11, 12) / 6, abs=0.01)
    assert (law["low"], law["mean"], law["high"]) == pytest.approx((7.25, 18.75, 30.25), abs=0.01)
    running = Scene.from_dict(fitted)
    assert running.mounted_clearance_mm < 0.9 * running.bearing.radial_clearance_mm
    assert running.clearances["guide"].operating < running.clearances["guide"].drawn
    # What is loose throughout has no effect, so no law; the seat that is not stated is the usual one.
    loose = scene("NU210", "--shaft", "k5")
    assert loose["mounting"]["outer_interference_um"] == -25.0
    assert (
        "mounting.outer_interference_um" not in loose["uncertain"]
        and "mounting.inner_interference_um" in loose["uncertain"]
    )
    plain = CliRunner().invoke(app, ["new", "NU210"]).stdout
    assert "mounting" not in tomllib.loads(plain) and "--shaft k5 --housing H7" in plain and "mounting." not in plain
    assert "--shaft" not in CliRunner().invoke(app, ["new", "NU210", "--housing", "H7"]).stdout
    assert scene("6208", "--housing", "N7")["mounting"]["inner_interference_um"] > 0.0


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((), {"supply": "bath", "inlet_distance": 5.0, "oil_fraction": 0.02}),
        (("--lubrication", "drop"), {"supply": "drop", "inlet_distance": 5.0, "oil_fraction": 0.005}),
        (("--lubrication", "oil-air"), {"supply": "oil_air", "inlet_distance": 5.0, "oil_fraction": 0.005}),
        (("--lubrication", "JET"), {"supply": "jet", "oil_fraction": 0.02}),
        (("--oil", "grease VG 100"), {"supply": "grease", "inlet_distance": 5.0, "oil_fraction": 0.005}),
    ],
)
def test_command_line_lubrication(command, arguments, expected):
    """Command line: each supply starves the inlets but a jet, which floods them; the inlet's distance is uncertain in all."""
    written = json.loads(command("new", "NU210", *arguments, "--json").stdout)
    assert written["lubricant"].items() >= expected.items()
    assert ("inlet_distance" in written["lubricant"]) == ("inlet_distance" in expected)
    assert (
        "lubricant.inlet_distance" in written["uncertain"]["estimated"]
        and written["bearing"]["designation"] == "NU 210"
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("NU210", "--lubrication", "mist"), ["--lubrication mist: is not a known lubrication method; choose one of"]),
        (("6208", "--lubrication", "bath"), ["--lubrication bath: is one of cylindrical roller bearings"]),
        (("NU210", "--lubrication", "grease"), ["--lubrication grease: --oil ISO VG 68 is not a grease; write"]),
        (("NU210", "--lubrication", "jet", "--oil", "grease VG 100"), ["jet: contradicts the grease of --oil"]),
        (("XY99",), ["DESIGNATION XY99: is not a known designation"]),
        (("6230",), ["add --bore, --outside and --width"]),
        (("NU210", "--oil", "castor"), ["--oil castor: is not a known oil; write ISO VG 10"]),
        (("NU210", "--load", "-5"), ["--load -5: must be from 0"]),
        (("NU210", "--load", "nan", "--temperature", "343"), ["--load nan", "if 343 K are meant, write 69.85"]),
        (("NU210", "--clearance", "C9"), ["--clearance C9: is not a clearance class; choose one of C2, CN"]),
        (("7208", "--clearance", "C3"), ["has a contact angle instead"]),
        (("NU210", "--speed", "0"), ["--speed 0: a run is counted in shaft turns"]),
        (("NU210", "--preload", "5"), ["--preload 5: is one of ball bearings"]),
        (("NU210", "--bore", "50"), ["--outside, --width: missing; give all of"]),
        (("NU210", "--bore", "50", "--outside", "40", "--width", "10"), ["--bore 50: not below --outside 40"]),
        (("NU210", "--bore", "50", "--outside", "52", "--width", "10"), ["leaves no room for rings and rollers"]),
        (("N1014-K-M1-SP",), ["N 1014 K M1 SP: a tapered bore is driven up its seat; add --clearance in mm"]),
        (("NU210K", "--clearance", "0.01", "--shaft", "k5"), ["--shaft k5: a tapered bore has no such seat"]),
        (("NU210P2", "--shaft", "k5"), ["--shaft k5: rings of class P2 are not listed here; choose one of Normal"]),
    ],
)
def test_command_line_bad_input(command, arguments, words):
    """Command line: each fault is one sentence with the option and its value; exit 2; the same as JSON."""
    refused = command("new", *arguments)
    assert refused.returncode == 2 and refused.stdout == ""
    assert len(refused.stderr.splitlines()) == len(words)
    assert all(word in refused.stderr for word in words), refused.stderr
    told = command("new", *arguments, "--json")
    assert told.returncode == 2 and json.loads(told.stdout)["faults"] == refused.stderr.splitlines()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("NU210", "--bore", "50", "--outside", "50.001", "--width", "20"), "NU210: leaves no room for rings and rollers; check"),
        (("6208", "--bore", "50", "--outside", "50.001", "--width", "20"), "6208: leaves no room for rings and balls; check"),
        (("7208", "--bore", "330.2", "--outside", "331.1", "--width", "480"), "--width 480: estimated inside: bearing.balls = "),
        (("NU210 \x01",), r"DESIGNATION NU210 \x01: suffix \x01 is not known"),
        (("NU210", "C3", "--clearance", "C4"), "--clearance C4: contradicts C3 of NU 210 C3; leave one out"),
        (("7208B", "C3"), "suffix C3: an angular contact bearing has a contact angle instead"),
        (("NU210", "--oil", "VG " + "9" * 5000), "is not a known oil"),
        (("NU210", "--speed", "1e400"), "--speed 1e400: is not a finite number"),
        (("NU210", "--shaft", "x9"), '--shaft x9: is not a tolerance class of a shaft such as "k5"; take g, h, j, js, k, m, n, p or r'),
        (("NU210", "--housing", "k7"), '--housing k7: is not a tolerance class of a housing such as "H7"; take G, H'),
        (("NU210", "--bore", "520", "--outside", "700", "--width", "80", "--shaft", "k5"), "not of 520 mm"),
        (("NU210", "--temperature", "-300"), "--temperature -300: must be from -60 to 220 C; fix it"),
    ],
)  # fmt: skip
def test_unit_nonsense_is_one_sentence(arguments, sentence):
    """Unit: what no bearing is ends in one printable line, with exit code 2 and no traceback."""
    refused = CliRunner().invoke(app, ["new", *arguments])
    assert isinstance(refused.exception, SystemExit) and refused.exit_code == 2 and refused.stdout == ""
    (line,) = refused.stderr.splitlines()
    assert sentence in line and line.isprintable() and len(line) < 400


def test_unit_a_scene_says_which_suffixes_change_nothing():
    """Unit: seals and tolerance classes stand in the heading with the reason why nothing follows from them."""
    head = CliRunner().invoke(app, ["new", "6208-2RS", "P5", "C3"]).stdout.splitlines()[:2]
    assert head[0].startswith("# 6208 2RS P5 C3, 40 x 80 x 18 mm")
    assert "2RS, seals or shields, whose friction is not modelled; P5, tolerance class" in head[1]
    assert "Suffixes" not in CliRunner().invoke(app, ["new", "NU210", "MA", "C3", "--clearance", "c3"]).stdout


@pytest.mark.parametrize(("designation", "factors"), [("NU210", 3), ("NU 210 M", 2)])
def test_command_line_study_of_a_new_scene(command, tmp_path, designation, factors):
    """Command line: ``doe new`` writes a study that ``doe design`` takes, with the clearances that act."""
    scene, path = tmp_path / 'my "own" # scene.toml', tmp_path / "study.toml"
    scene.write_text(command("new", designation).stdout, encoding="utf-8")
    written = doe("new", scene)
    assert written.returncode == 0, written.stderr
    path.write_text(written.stdout, encoding="utf-8")
    assert json.loads(doe("new", scene, "--json").stdout) == tomllib.loads(written.stdout)
    design = json.loads(doe("design", path, "--json").stdout)
    assert len(design["runs"]) == {3: 20, 2: 14}[factors]
    assert written.stdout.count("[[factor]]") == factors and len(written.stdout.split("resolution")) == factors + 1


def test_command_line_no_study_of_balls(command, tmp_path):
    """Command line: a ball bearing is not simulated in time, so has no study."""
    scene = tmp_path / "ball.toml"
    scene.write_text(command("new", "6208").stdout, encoding="utf-8")
    refused = doe("new", scene)
    assert refused.returncode == 2 and "use rbdyn ball" in refused.stderr and refused.stdout == ""
