"""``rbdyn new own``: a scene of one's own rollers or balls, what it estimates, and every sentence of refusal."""

import json
import math
import re
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rbdyn.base.faults import InputError, MethodError
from rbdyn.draft.options import Options, clearance_of, conformity_of, roller_size
from rbdyn.draft.text import scene_text
from rbdyn.properties import table
from rbdyn.properties.catalogue import Envelope, envelope, read_designation, roller_interior
from rbdyn.properties.drawing import BallDrawing, RollerDrawing, ball_boundary, roller_boundary
from rbdyn.scene import Scene

ROLLERS = ("own", "--rollers", "16", "--roller", "7x7", "--pitch", "60")
BALLS = ("own", "--balls", "16", "--ball", "9.525", "--pitch", "65", "--contact-angle", "25")
POINT = ("--speed", "3000", "--load", "2000")
OIL = (
    "--oil castor: is not a known oil; write ISO VG 10, 15, 22, 32, 46, 68, 100, 150, 220, 320 or 460 (with grease before it, "
    "mineral, naphthenic, PAO, ester, PAG behind it), 7808, 23699, 85734 or Jet Oil II. Own data: oil = 'data_sheet' in [lubricant]"
)
QUICK = ("turns=3", "discard_turns=2", "replicates=2", "impact_window_turns=1", "companion=false", "extend=false")
SET = [part for assignment in QUICK for part in ("--set", f"numerics.{assignment}")]


@pytest.mark.parametrize("text", ["7.5x8", "7.5 x 8", "7.5X8", " 7.5×8 ", "7.5*8", "7.5x8.0 mm"])
def test_unit_roller_sizes(text):
    """Unit: diameter x length in the usual spellings."""
    assert roller_size(text) == (7.5, 8.0)


@pytest.mark.parametrize(
    ("reader", "text", "sentence"),
    [
        (roller_size, "7,5x8", "has a decimal comma; write 7.5x8"),
        (roller_size, "7", 'is not a diameter x length in mm; write 7x7, or "7 x 7" in quotes'),
        (roller_size, "7x7x7", 'is not a diameter x length in mm; write 7x7, or "7 x 7" in quotes'),
        (roller_size, "7.5.1x7", 'is not a diameter x length in mm; write 7x7, or "7 x 7" in quotes'),
        (roller_size, "0.2x7", "its diameter must be from 1 to 150 mm; fix it"),
        (roller_size, "7x700", "its length must be from 0.5 to 400 mm; fix it"),
        (clearance_of, "0,02", "has a decimal comma; write 0.02"),
        (clearance_of, "20", "must be from -0.2 to 2 mm; if 20 um are meant, write 0.02"),
        (clearance_of, "nan", "is not a finite number; write a plain number"),
        (clearance_of, "C9", "is not a clearance class; choose one of C2, CN, C3, C4, C5, or write millimetres, as 0.02"),
        (conformity_of, "0.5", "must be groove radius over ball diameter, from 0.501 to 0.7; write 0.52, or 0.515/0.525 for inner and outer"),
        (conformity_of, "0,52", "has a decimal comma; write 0.52"),
    ],
)  # fmt: skip
def test_unit_texts_that_are_refused(reader, text, sentence):
    """Unit: one sentence with the fix."""
    with pytest.raises(MethodError, match=f"^{re.escape(sentence)}$"):
        reader(text)


def test_unit_clearances_and_conformities():
    """Unit: a class or millimetres; one groove factor or two."""
    assert (clearance_of(" c3 "), clearance_of("-0.01")) == ("C3", -0.01)
    assert (conformity_of("0.52"), conformity_of("0.515/0.525")) == ((0.52, 0.52), (0.515, 0.525))


@pytest.mark.parametrize(
    ("arguments", "sentences"),
    [
        (("own",), ["own: neither rollers nor balls are stated; write own --rollers 16 --roller 7x7 --pitch 60, or own --balls 16 --ball 9.525 --pitch 65 --contact-angle 25"]),
        ((*ROLLERS, "NU210"), ["DESIGNATION NU210: is a second bearing next to own; leave one of them out"]),
        ((*ROLLERS, "--ball", "9"), ["--rollers 16 --roller 7x7 and --ball 9: a bearing has rollers or balls; leave out one kind"]),
        (("own", "--rollers", "16"), ["--roller: missing; write diameter x length of a roller in mm, as 7x7", "--pitch: missing; write the diameter of the circle through the centres in mm, as 60"]),
        (("own", "--ball", "9"), ["--balls: missing; write the number of balls, as 16", "--pitch: missing; write the diameter of the circle through the centres in mm, as 60", "--contact-angle: missing; write it in degrees, as 25, or --clearance of a deep groove bearing"]),
        ((*ROLLERS, "--rollers", "30"), ["--rollers 30: rollers of 7 mm overlap on --pitch 60, where each has 6.272 mm; take at most 25"]),
        ((*ROLLERS, "--rollers", "26"), ["--rollers 26: leaves bars of 0.0222 mm between the pockets of a cage on --pitch 60; take at most 25"]),
        ((*ROLLERS, "--rollers", "16.5"), ["--rollers 16.5: must be a whole number from 3 to 500; fix it"]),
        ((*ROLLERS, "--pitch", "6"), ["--pitch 6: leaves no inner raceway under rollers of 7 mm; enlarge it"]),
        ((*ROLLERS, "--pitch", "60,5"), ["--pitch 60,5: has a decimal comma; write 60.5"]),
        ((*ROLLERS, "--pitch", "7 cm"), ["--pitch 7 cm: has a unit; write 70"]),
        ((*ROLLERS, "--width", "6.5"), ["--roller 7x7: is longer than the ring of --width 6.5; shorten the roller or widen the ring"]),
        ((*ROLLERS, "--bore", "54", "--outside", "66"), ["--bore 54: leaves no inner ring under a raceway of 53 mm; make it smaller", "--outside 66: leaves no outer ring over a raceway of 67 mm; make it larger"]),
        ((*ROLLERS, "--clearance", "0.8"), ["--clearance 0.8: is out of proportion to rollers of 7 mm; write millimetres, below 0.7"]),
        ((*ROLLERS, "--clearance", "0.5"), ["--clearance 0.5: is outside the usual 0.0005 to 0.3; if 0.5 um are meant, write 0.0005"]),
        ((*ROLLERS, "--guidance", "middle"), ["--guidance middle: guides no cage; choose one of outer, inner, roller"]),
        ((*ROLLERS, "--preload", "10", "--speed", "0"), ["--preload 10: is one of ball bearings; leave it out", "--speed 0: a run is counted in shaft turns; give at least 0.1"]),
        ((*ROLLERS, "--load", "9e6"), ["--load 9e6: a roller of 7 mm would have a contact 7.88 mm wide; reduce the load or check its unit"]),
        ((*ROLLERS, "--width", "140"), ["--width 140: leaves side rings of a cage out of proportion to such rollers; narrow it"]),
        (("own", "--rollers", "44", "--roller", "3x19", "--pitch", "47.4", "--cage-material", "polyamide"), ["--rollers 44: leaves bars of a cage that are too slender for such rollers; take fewer or shorter ones"]),
        (("own", "--rollers", "30", "--roller", "30x30", "--pitch", "600"), ["--clearance CN: CN is listed to a bore of 400 mm, not of 539.2 mm; take a smaller bearing, another class, or give the clearance in mm"]),
        ((*BALLS, "--oil", "castor", "--pitch", "x"), ["--pitch x: is not a number; write a plain number in mm", OIL]),
        ((*BALLS, "--balls", "30"), ["--balls 30: balls of 9.525 mm overlap on --pitch 65, where each has 6.794 mm; take at most 21"]),
        ((*BALLS, "--ball", "70"), ["--pitch 65: leaves no inner raceway under balls of 70 mm; enlarge it"]),
        ((*BALLS, "--clearance", "0.02"), ["--clearance 0.02: contradicts --contact-angle 25, which gives it; leave one out"]),
        ((*BALLS, "--guidance", "inner", "--cage-material", "peek", "--lubrication", "jet"), ["--guidance inner: is one of cylindrical roller bearings; leave it out", "--cage-material peek: is one of cylindrical roller bearings; leave it out", "--lubrication jet: is one of cylindrical roller bearings; leave it out"]),
        ((*BALLS, "--width", "8"), ["--ball 9.525: is wider than the ring of --width 8; take a smaller ball or widen the ring"]),
        ((*BALLS, "--bore", "60"), ["--bore 60: leaves no inner ring under a raceway of 56.37 mm; make it smaller"]),
        ((*BALLS, "--contact-angle", "95"), ["--contact-angle 95: must be from 0 to 85 degrees; fix it"]),
        (("own", "--balls", "9", "--ball", "8", "--pitch", "40", "--clearance", "0.9"), ["--clearance 0.9: too large for grooves with centres 0.4 mm apart; make it less than 0.8"]),
        (("NU210", "--pitch", "60"), ["--pitch 60: is of a bearing of one's own; leave it out, or write own instead of NU210"]),
        (("NU210MB", "--guidance", "outer"), ["--guidance outer: contradicts the cage MB of NU 210 MB; leave one out"]),
        (("NU210", "C3", "--clearance", "0.1"), ["--clearance 0.1: contradicts C3 of NU 210 C3; leave one out"]),
    ],
)  # fmt: skip
def test_command_line_faults(command, arguments, sentences):
    """Command line: option, value and fix in one sentence; all faults at once; exit 2; the same as JSON."""
    refused = command("new", *arguments)
    lines = refused.stderr.splitlines()
    assert (refused.returncode, refused.stdout) == (2, "")
    assert sorted(lines) == sorted(sentences)
    assert json.loads(command("new", *arguments, "--json").stdout)["faults"] == lines


def scene_of(command, *arguments):
    written = command("new", *arguments, "--json")
    assert written.returncode == 0, written.stderr
    return json.loads(written.stdout)


@pytest.mark.parametrize("designation", ["NU210", "NU315", "N204", "NU2210", "NU 320"])
def test_command_line_rollers_as_of_the_catalogue(command, designation):
    """Command line: a drawing with a catalogue bearing's sizes gives the scene of its designation, but for what is listed."""
    listed = scene_of(command, designation, *POINT, "--shaft", "m5", "--guidance", "inner")
    size, drawn = envelope(read_designation(designation)), listed["bearing"]
    own = scene_of(
        command, "own", "--rollers", drawn["rollers"], "--roller", f"{drawn['roller_diameter_mm']}x{drawn['roller_length_mm']}",
        "--pitch", drawn["pitch_diameter_mm"], "--bore", size.bore, "--outside", size.outside, "--width", size.width,
        *POINT, "--shaft", "m5", "--guidance", "inner",
    )  # fmt: skip
    assert {"designation", "dynamic_capacity_N"} == listed["bearing"].keys() - own["bearing"].keys()
    for key in ("designation", "dynamic_capacity_N"):
        del listed["bearing"][key]
    # Rollers that are counted leave no doubt of the bars between them.
    listed["uncertain"]["estimated"].remove("cage.bar_width_mm")
    if designation != "NU2210":  # whose series has a cage of its own thickness
        assert own == listed
    else:
        # No catalogue gives its rollers; a drawing does.
        listed["uncertain"]["estimated"].remove("bearing.roller_diameter_mm")
        assert {**own, "cage": {}} == {**listed, "cage": {}}


@pytest.mark.parametrize(("designation", "kind"), [("7208B", "--contact-angle"), ("6208", "--clearance")])
def test_command_line_balls_as_of_the_catalogue(command, designation, kind):
    """Command line: the same of balls, by contact angle or by clearance."""
    listed = scene_of(command, designation, *POINT)
    drawn = listed["bearing"]
    value = {"--contact-angle": drawn.get("contact_angle_deg"), "--clearance": "CN"}[kind]
    own = scene_of(
        command, "own", "--balls", drawn["balls"], "--ball", drawn["ball_diameter_mm"], "--pitch", drawn["pitch_diameter_mm"],
        kind, value, "--bore", drawn["bore_mm"], "--outside", drawn["outside_diameter_mm"], *POINT,
    )  # fmt: skip
    assert own == listed


def test_literature_boundary_of_a_drawing():
    """Literature: bore, outside diameter and width of the 46 sizes that list both raceways, nine in ten within the errors stated."""
    errors = []
    for row in table("cylindrical_rollers"):
        size = envelope(read_designation(f"N{row['size']}"))
        if size.inner_raceway is None or size.outer_raceway is None:
            continue
        inside = roller_interior(size, narrow=False)
        drawing = RollerDrawing(inside.rollers, inside.roller_diameter, inside.roller_length, inside.pitch_diameter)
        blind, half = roller_boundary(drawing, None, None, None), roller_boundary(drawing, size.bore, None, None)
        assert half.bore_by == "stated" and "+-0.04" in half.outside_by and "+-0.08" in blind.bore_by
        wider = (size.width - drawing.length) / drawing.diameter
        errors.append(
            [
                abs(blind.bore - size.bore) / drawing.diameter <= 0.08,
                abs(blind.outside - size.outside) / drawing.diameter <= 0.08,
                abs(half.outside - size.outside) / drawing.diameter <= 0.04,
                0.39 <= wider <= 0.82,
            ]
        )
    assert len(errors) == 46
    for within in zip(*errors, strict=True):
        assert sum(within) >= 0.88 * len(errors)


def test_unit_boundary_of_unusual_drawings():
    """Unit: where no usual ring fits there is one all the same, and its source says so."""
    few = roller_boundary(RollerDrawing(4, 20.0, 20.0, 33.0), None, None, None)
    assert 0.0 < few.bore < 13.0 and "no usual ring" in few.bore_by and few.outside > 53.0
    thin = roller_boundary(RollerDrawing(200, 2.0, 2.0, 300.0), 295.0, None, None)
    assert thin.outside > 302.0
    balls = ball_boundary(BallDrawing(9, 8.0, 40.0, None), 20.0, None, None)
    assert (balls.outside, balls.width) == (60.0, 13.6) and "+-2 %" in balls.outside_by


def test_command_line_comments_state_sources(command):
    """Command line: what is stated says so, each estimate its rule and error; a block between few rollers is no bar."""
    text = command("new", *ROLLERS, "--bore", "46").stdout
    lines = dict(line.split(" # ", 1) for line in text.splitlines() if " # " in line)
    comments = {key.split(" =")[0].strip(): comment.strip() for key, comment in lines.items()}
    assert {comments[key] for key in ("rollers", "roller_diameter_mm", "roller_length_mm", "pitch_diameter_mm")} == {
        "stated"
    }
    assert comments["effective_length_mm"] == "estimated: chamfers of 0.35 mm, 0.05 diameters, take both ends; +-5 %"
    for key in (
        "inner_ring_mass_kg",
        "mass_g",
        "land_width_mm",
        "bar_width_mm",
        "bar_thickness_mm",
        "side_ring_width_mm",
    ):
        assert comments[key].startswith("estimated: ")
    assert comments["mass_g"].endswith("+-40 %") and comments["side_ring_width_mm"].endswith("+-50 %")
    assert text.startswith("# 16 rollers of 7 x 7 mm on a pitch diameter of 60 mm, C = 25.6 kN by ISO 281")
    assert "# Bore 46 mm, stated." in text and "# Width 10.8 mm, estimated: roller + 0.54 roller diameters" in text
    assert "designation" not in tomllib.loads(text)["bearing"]
    few = command("new", "own", "--rollers", "5", "--roller", "7x7", "--pitch", "90").stdout
    assert re.search(r"bar_width_mm = 14\.0 +# estimated: 2 roller diameters; a block", few)
    mixed = command("new", *ROLLERS, "--cage-material", "PEEK").stdout
    assert "# stated: peek; assumed: guided by the outer ring" in mixed
    balls = command("new", *BALLS, "--conformity", "0.515/0.525").stdout
    assert re.search(r"outer_groove_factor = 0\.525 +# stated", balls)
    assert re.search(r"bore_mm = 49\.1 +# estimated: pitch diameter - ball/0\.6, \+-0\.17 ball diameters", balls)


# What a drawing's faults name, and what of a mounted one names keys that no option has.
NAMED = re.compile(r"(--[a-z-]+( \S+)?( --[a-z-]+ \S+)*( and .*)?|own): ")


@settings(max_examples=60, deadline=None)
@given(
    diameter=st.floats(1.5, 60.0),
    slender=st.floats(0.5, 4.0),
    around=st.floats(1.3, 15.0),
    filling=st.floats(0.15, 1.05),
    guidance=st.sampled_from(["outer", "inner", "roller", None]),
    material=st.sampled_from(["peek", "bronze", "polyamide", None]),
    width=st.sampled_from([None, 0.9, 1.1, 2.0]),
)
def test_invariant_a_drawing_gives_a_scene_or_names_an_option(
    diameter, slender, around, filling, guidance, material, width
):
    """Invariant: whatever is drawn gives a scene that validates, or sentences that begin with the option at fault."""
    pitch = around * diameter
    texts = {"--rollers": str(max(3, int(filling * math.pi * around))), "--pitch": f"{pitch:.4g}", "--oil": "VG 68"}
    texts |= {"--roller": f"{diameter:.4g}x{slender * diameter:.4g}", "--temperature": "70", "--clearance": "0.02"}
    texts |= {"--guidance": guidance, "--cage-material": material}
    texts["--width"] = None if width is None else f"{width * slender * diameter:.4g}"
    try:
        scene = Scene.from_dict(tomllib.loads(scene_text("own", Options(texts))))
        assert scene.bearing.effective_length_mm < scene.bearing.roller_length_mm and scene.cage.mass_g > 0.0
    except InputError as error:
        assert all(NAMED.match(fault) for fault in error.faults), error.faults


def test_command_line_a_class_beyond_its_table_is_one_sentence(command):
    """Command line: also the class of the seat that is not stated, whose size may lie outside the tables."""
    refused = command(
        "new", "own", "--rollers", "30", "--roller", "30x30", "--pitch", "480", "--clearance", "0.1", "--shaft", "k5"
    )
    assert refused.returncode == 2 and len(refused.stderr.splitlines()) == 1
    assert refused.stderr.startswith("--shaft k5: ")


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ("--rollers", "12", "--roller", "5x5", "--pitch", "30"),
        ("--rollers", "18", "--roller", "13x22", "--pitch", "95", "--guidance", "inner", "--cage-material", "peek"),
        ("--rollers", "5", "--roller", "30x30", "--pitch", "120", "--guidance", "roller", "--lubrication", "jet"),
    ],
)
def test_command_line_own_rollers_run_at_once(command, tmp_path, arguments):
    """Command line: what is written simulates as it stands, without a maker's friction, for it has no designation."""
    path = tmp_path / "own.toml"
    path.write_text(command("new", "own", *arguments).stdout, encoding="utf-8")
    ran = command("simulate", path, "--json", *SET)
    assert ran.returncode == 0, ran.stderr
    result = json.loads(ran.stdout)
    assert result["friction_check"] is None and result["status"] == "ok" and result["power_loss_W"]["value"] > 0.0


@pytest.mark.parametrize(
    "arguments", [BALLS, ("own", "--balls", "9", "--ball", "8", "--pitch", "40", "--clearance", "C3")]
)
def test_command_line_own_balls_run_at_once(command, tmp_path, arguments):
    """Command line: the same of balls, by contact angle and by clearance."""
    path = tmp_path / "own.toml"
    path.write_text(command("new", *arguments).stdout, encoding="utf-8")
    record = json.loads(command("ball", path, "--json").stdout)
    assert record["status"] == "ok" and record["life"]["L10_h"] > 100.0


def test_unit_envelope_of_a_drawing():
    """Unit: boundary dimensions without sources."""
    box = ball_boundary(BallDrawing(9, 8.0, 40.0, 15.0), None, None, 12.0)
    assert box.envelope == Envelope(box.bore, box.outside, 12.0) and box.width_by == "stated"
