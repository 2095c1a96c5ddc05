"""REXS files: bearings of a gearbox program as scenes, and results written for it."""

import tomllib
from pathlib import Path

import pytest
from in_process import in_process
from pytest import approx

import rbdyn
from rbdyn.base.faults import InputError
from rbdyn.properties.rexs import read_rexs

CATALOGUE = """<?xml version="1.0"?>
<model applicationId="test" version="1.1"><relations>
<relation id="7" type="side"><ref id="2" role="assembly"/><ref id="1" role="inner_part"/></relation>
</relations><components>
<component id="1" name="shaft" type="shaft"><attribute id="rotational_speed" unit="1 / min">-1400</attribute></component>
<component id="2" name="left" type="rolling_bearing_with_catalog_geometry">
 <attribute id="bearing_type" unit="none">radial_roller_bearing</attribute>
 <attribute id="name" unit="none">NUP204-E-XL-TVP2</attribute>
 <attribute id="static_capacity" unit="kN">24.7</attribute>
 <attribute id="force_acting_on_inner_component_v" unit="kN">0.3</attribute>
 <attribute id="force_acting_on_inner_component_w" unit="N">400</attribute>
 <attribute id="radial_clearance_class" unit="none">C3</attribute>
 <attribute id="shaft_tolerance_class" unit="none">k5</attribute>
 <attribute id="lubrication_type" unit="none">oil_injection</attribute>
</component>
<component id="3" name="oil" type="lubricant">
 <attribute id="viscosity_at_40_degree_celsius" unit="mm^2 / s">97</attribute>
 <attribute id="lubricant_type_iso_6336_2019" unit="none">polyalfaolefin</attribute>
</component>
OTHER</components></model>
"""
TAPERED = '<component id="9" name="T" type="rolling_bearing_with_catalog_geometry"><attribute id="bearing_type" unit="none">tapered_roller_bearing</attribute></component>'


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "box.rexs"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_catalogue_bearing_is_read_with_its_operating_point(tmp_path):
    """Command line: designation, load, speed of the shaft, class of clearance, seat, oil and its supply; the rest is named as not read."""
    path = written(tmp_path, CATALOGUE.replace("OTHER", ""))
    shown = in_process("rbdyn", "new", str(path))
    assert shown.returncode == 0, shown.stderr
    first, second, *_ = shown.stdout.splitlines()
    assert first.startswith(
        "# From box.rexs, bearing 2 (left). Taken: name, rotational_speed, force_acting_on_inner_component_v, "
    )
    assert second == "# Not read: static_capacity."
    scene = tomllib.loads(shown.stdout)
    assert scene["bearing"]["designation"] == "NUP 204 E XL TVP2" and scene["operation"]["inner_speed_rpm"] == -1400.0
    assert scene["operation"]["radial_load_N"] == 500.0 and scene["lubricant"]["oil"] == "ISO VG 100"
    assert scene["lubricant"]["base_oil"] == "PAO" and scene["lubricant"]["supply"] == "jet" and "mounting" in scene
    listed = tomllib.loads(
        in_process("rbdyn", "new", "NUP204-E-XL-TVP2-C3", "--load", "500", "--speed", "-1400").stdout
    )["bearing"]
    assert listed == scene["bearing"] | {"designation": "NUP 204 E XL TVP2 C3"}
    typed = tomllib.loads(in_process("rbdyn", "new", str(path), "--load", "700").stdout)
    assert typed["operation"]["radial_load_N"] == 700.0


def test_what_cannot_be_read_is_a_sentence(tmp_path):
    """Command line: a file without bearings, with several, with another kind, and no REXS at all."""
    both = written(tmp_path, CATALOGUE.replace("OTHER", TAPERED))
    assert "has 2 bearings; choose one by --bearing: 2 (left), 9 (T)" in in_process("rbdyn", "new", str(both)).stderr
    assert in_process("rbdyn", "new", str(both), "--bearing", "left").returncode == 0
    for text, bearing, words in (
        (CATALOGUE.replace("OTHER", TAPERED), "9", "bearing 9 (T) is a tapered roller bearing; rbdyn reads"),
        (CATALOGUE.replace("OTHER", ""), "8", "--bearing 8: is none of"),
        ("<model><components/></model>", None, "has no rolling bearing"),
        ("<svg/>", None, "no REXS file, since it begins with <svg>"),
        ("speed = 3", None, "no REXS file, or one with entities"),
    ):
        with pytest.raises(InputError) as refused:
            read_rexs(written(tmp_path, text), bearing)
        (sentence,) = refused.value.faults
        assert words in sentence
    assert in_process("rbdyn", "new", "NU210", "--bearing", "2").returncode == 2


# A short run.
SHORT = (
    "--turns", "0.2", "--replicates", "1", "--set", "numerics.discard_turns=0", "--set", "numerics.companion=false",
)  # fmt: skip


def test_a_written_file_is_read_again(tmp_path):
    """Command line: what a simulation writes for REXS gives a scene of the same bearing at the same point."""
    scene = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
    shown = in_process("rbdyn", "simulate", str(scene), *SHORT, "--out", str(tmp_path / "run"), "-q")
    assert shown.returncode == 0 and "bearing.rexs" in shown.stdout
    again = in_process("rbdyn", "new", str(tmp_path / "run" / "bearing.rexs"))
    assert again.returncode == 0, again.stderr
    read, before = tomllib.loads(again.stdout), rbdyn.Scene.load(scene)
    for key in ("rollers", "roller_diameter_mm", "roller_length_mm", "pitch_diameter_mm", "radial_clearance_mm"):
        assert read["bearing"][key] == approx(getattr(before.bearing, key), rel=1e-9), key
    assert read["operation"]["inner_speed_rpm"] == 24000.0 and read["operation"]["radial_load_N"] == 1300.0
    assert read["lubricant"]["temperature_C"] == before.lubricant.temperature_C


def test_a_raceway_without_a_load_is_written_without_a_pressure(tmp_path):
    """Command line: rollers without a radial load press only on the outer raceway, thrown out by rotation."""
    scene = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
    idle = ("--set", "operation.radial_load_N=0")
    shown = in_process("rbdyn", "simulate", str(scene), *SHORT, *idle, "--out", str(tmp_path / "run"), "-q")
    assert shown.returncode == 0, shown.stderr
    rexs = (tmp_path / "run" / "bearing.rexs").read_text()
    assert "pressure_outer_ring" in rexs and "pressure_inner_ring" not in rexs


def test_an_oil_of_no_known_grade_is_not_taken(tmp_path):
    """Unit: a class of ISO 3448 that no oil here has leaves the default, so that the bearing can be read all the same."""
    thick = written(tmp_path, CATALOGUE.replace("OTHER", "").replace(">97<", ">680<"))
    assert "--oil" not in read_rexs(thick).options
    assert in_process("rbdyn", "new", str(thick)).returncode == 0
