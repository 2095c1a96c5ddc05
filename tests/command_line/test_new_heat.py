"""Heat by options of ``rbdyn new``, and the files that ``rbdyn new`` and ``doe new`` write."""

import json
import random
import tomllib

import pytest
from doe_command import doe

from rbdyn.scene import Scene
from rbdyn.scene.ball import BallScene
from rbdyn.scene.unknown import inputs_of

OWN = ("own", "--rollers", "14", "--roller", "8x8", "--pitch", "65")
BALLS = ("own", "--balls", "16", "--ball", "9.525", "--pitch", "65", "--contact-angle", "25")
FLOW = ("--oil-flow", "0.4", "--oil-inlet", "60")
SHORT = ("turns=2", "discard_turns=1", "replicates=2", "impact_window_turns=1", "companion=false", "extend=false")
STATUSES = {"steady", "undecided", "no steady state", "seizure", "too hot"}


def scene_of(command, *arguments):
    """The tables that ``rbdyn new`` writes."""
    written = command("new", *arguments, "--json")
    assert written.returncode == 0, written.stderr
    return json.loads(written.stdout)


@pytest.mark.parametrize(
    ("arguments", "supply"),
    [
        ((*OWN, *FLOW, "--ambient", "25"), "jet"),
        ((*OWN, *FLOW, "--lubrication", "bath"), "bath"),
        ((*OWN, "--ambient", "25"), "bath"),
        (("NU210", "--ambient", "25", "--lubrication", "drop", "--shaft", "m5"), "drop"),
        (("NU210", "--ambient", "25", "--oil", "grease VG 100"), "grease"),
        (("6208", "--ambient", "25"), "bath"),
        ((*BALLS, *FLOW, "--lubrication", "oil-air"), "oil_air"),
    ],
)
def test_command_line_heat_by_options(command, arguments, supply):
    """Command line: the heat balance has what it needs and nothing that it computes or that contradicts it."""
    scene = scene_of(command, *arguments)
    flows = "--oil-flow" in arguments
    assert scene["thermal"] == {"ambient_C": 25.0 if "--ambient" in arguments else 20.0}
    assert not [key for key in scene["mounting"] if key.endswith("_C")] and scene["mounting"]["width_mm"] > 0.0
    oil = scene["lubricant"]
    assert oil["supply"] == supply and "temperature_C" not in oil
    assert (oil.get("oil_flow_l_min"), oil.get("oil_inlet_temperature_C")) == ((0.4, 60.0) if flows else (None, None))
    if scene["bearing"]["kind"] != "cylindrical_roller":
        assert BallScene.from_dict(scene).thermal is not None
        return
    assert ("oil_fraction" in oil) != flows
    estimated = scene["uncertain"]["estimated"]
    assert ("lubricant.oil_fraction" in estimated) != flows
    assert not {"lubricant.temperature_C", "mounting.inner_ring_temperature_C"} & {*estimated}
    base = Scene.from_dict(scene)
    inputs = {entry.key for entry in inputs_of(base, scene, base.uncertain)}
    assert {"thermal.surface_factor", "thermal.housing_factor"} <= inputs


def test_command_line_what_heat_assumes_says_so(command):
    """Command line: fits, supply and surroundings that nobody stated are assumed, in words next to them."""
    text = command("new", *OWN, *FLOW).stdout
    lines = {line.partition(" ")[0]: line.partition("# ")[2] for line in text.splitlines()}
    assert lines["supply"] == "assumed: oil jet" and lines["ambient_C"].endswith("assumed, as of ISO 15312")
    assert lines["[mounting]"].startswith("shaft k5 (not stated, usual), housing H7 (not stated, usual)")
    assert "These temperatures are assumed" not in text
    assert "--ambient" in command("new", "NU210", "--shaft", "k5").stdout
    assert "These temperatures" not in command("new", "NU210").stdout


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("--oil-flow", "1"), "--oil-flow 1: needs the temperature at which the oil flows in; add --oil-inlet"),
        (("--oil-inlet", "60"), "--oil-inlet 60: has no effect without a flow; add --oil-flow"),
        (("--ambient", "20", "--temperature", "70"), "--temperature 70: --ambient 20 computes the temperatures"),
        (("--ambient", "20", "--lubrication", "jet"), "--lubrication jet: with --ambient it needs --oil-flow"),
        ((*FLOW, "--oil", "grease VG 100"), "--oil-flow 0.4: contradicts a grease, which does not flow"),
        (("--oil-flow", "400", "--oil-inlet", "60"), "--oil-flow 400: is outside the usual 0 to 43.2; if 400 mL/min"),
        (("--oil-flow", "1", "--oil-inlet", "150"), "--oil-inlet 150: not below 120, the usual ceiling"),
        (("--ambient", "300"), "--ambient 300: must be from -60 to 220 C; if 300 K are meant, write 26.85"),
    ],
)
def test_command_line_heat_refused(command, arguments, sentence):
    """Command line: what contradicts a heat balance is one sentence that begins with the option."""
    refused = command("new", "NU210", *arguments)
    (line,) = refused.stderr.splitlines()
    assert refused.returncode == 2 and refused.stdout == "" and line.startswith(sentence), line


def test_command_line_a_new_file(command, tmp_path):
    """Command line: --out writes what is printed otherwise, over nothing without --force; a study finds its scene."""
    path, study = tmp_path / "scenes" / "my.toml", tmp_path / "my study.toml"
    missing = command("new", "NU210", "--out", path)
    assert missing.returncode == 2 and "missing folder" in missing.stderr
    path.parent.mkdir()
    written = command("new", "NU210", "--out", path)
    assert written.stdout == f"written to {path}; next: rbdyn simulate {path}\n"
    assert path.read_text(encoding="utf-8") == command("new", "NU210").stdout
    refused = command("new", "6208", "--out", path)
    assert refused.returncode == 2 and refused.stderr.startswith(f"--out {path}: exists; add --force")
    assert tomllib.loads(path.read_text(encoding="utf-8"))["bearing"]["kind"] == "cylindrical_roller"
    assert doe("new", path, "--out", study).stdout == f"written to {study}; next: doe study '{study}'\n"
    assert doe("new", path, "--out", study).returncode == 2
    read = doe("new", path, "--out", path, "--force")
    assert read.returncode == 2 and "is a file that this command reads" in read.stderr
    assert tomllib.loads(study.read_text(encoding="utf-8"))["scene"]["file"] == "scenes/my.toml"
    assert len(json.loads(doe("design", study, "--json").stdout)["runs"]) == 20
    over = command("new", "6208", "--out", path, "--force", "--json")
    assert json.loads(over.stdout) == tomllib.loads(path.read_text(encoding="utf-8"))
    assert [file.name for file in path.parent.iterdir()] == ["my.toml"]


def combination(seed):
    """Arguments of a random bearing with heat: rollers or balls, grease, bath, drop, oil-air or jet."""
    draw = random.Random(seed)
    supply = ("grease", "bath", "jet", "drop", "oil-air")[seed % 5]
    rollers = seed % 4 != 3
    names = (
        ("NU210", "NU2206 ECP", "N308", "NU1012 MA", "NJ 2312") if rollers else ("6208", "7210B", "6005 C3", "7012C")
    )
    own = OWN if rollers else BALLS
    bearing = own if draw.random() < 0.4 else (draw.choice(names),)
    heat = ["--ambient", f"{draw.uniform(-10, 50):.0f}"]
    if supply == "jet":
        heat += ["--oil-flow", f"{draw.uniform(0.1, 2.0):.2f}", "--oil-inlet", f"{draw.uniform(30, 90):.0f}"]
    oil = draw.choice(("VG 32", "VG 68 PAO", "VG 100", "VG 15 ester"))
    lubrication = ("--oil", f"grease {oil}") if supply == "grease" else ("--oil", oil, "--lubrication", supply)
    cage = ("--cage-material", draw.choice(("peek", "brass"))) if rollers and not bearing[0].endswith("ECP") else ()
    cage = () if bearing == ("NU1012 MA",) else cage
    fits = ("--shaft", draw.choice(("k5", "m5")), "--housing", draw.choice(("H7", "J7"))) if draw.random() < 0.5 else ()
    speed = draw.uniform(500, 9000)
    return (*bearing, *heat, *lubrication, *cage, *fits, "--speed", f"{speed:.0f}")


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2, 4, 8, 3, 7, 11, 15, 19])
def test_command_line_scenes_with_heat_run(command, tmp_path, seed):
    """Command line: rollers, then balls, each with every supply; a scene with heat ends steady or with a status, never refused."""
    path = tmp_path / "hot.toml"
    written = command("new", *combination(seed), "--out", path)
    assert written.returncode == 0, written.stderr
    ball = "ball" in tomllib.loads(path.read_text(encoding="utf-8"))["bearing"]["kind"]
    short = [part for text in SHORT for part in ("--set", f"numerics.{text}")]
    ran = command("ball", path, "--json") if ball else command("simulate", path, "--json", *short)
    assert ran.returncode in (0, 1), ran.stderr
    assert json.loads(ran.stdout)["thermal"]["status"] in STATUSES
