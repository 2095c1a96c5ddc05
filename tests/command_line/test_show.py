"""The command ``rbdyn show`` as a user meets it, and the moving pictures it writes."""

import json
import re

import numpy as np
import pytest
from conftest import EXAMPLE, SHORT

from rbdyn.base.faults import InputError
from rbdyn.cli.show import request_of
from rbdyn.plots import roller

QUICK = [part for assignment in SHORT for part in ("--set", assignment)]
PICTURES = {
    "cage_orbit.png", "forces.png", "whirl.png", "poincare.png", "spectra.png", "roller_loads.png", "sliding.png",
    "power.png",
}  # fmt: skip


@pytest.fixture(scope="module")
def saved(command, tmp_path_factory):
    """A folder with a short result, as ``rbdyn simulate --out`` leaves it."""
    folder = tmp_path_factory.mktemp("run")
    assert command("simulate", EXAMPLE, *QUICK, "--out", folder, "-q").returncode == 0
    return folder


@pytest.fixture(scope="module")
def shown(command, saved, tmp_path_factory):
    """All that ``rbdyn show`` can write, and its JSON; the film in a quarter of its frames."""
    folder = tmp_path_factory.mktemp("shown")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(roller, "FRAMES_PER_TURN", 11)
        done = command("show", saved, "--out", folder, "--animate", "--json")
    assert (done.returncode, done.stderr) == (0, "")
    return folder, json.loads(done.stdout)


@pytest.fixture(scope="module")
def page(shown):
    """The player and the data in it."""
    text = (shown[0] / "bearing.html").read_text(encoding="utf-8")
    (data,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.DOTALL)
    return text, json.loads(data)


def test_show_writes_pictures_samples_and_figures(saved, shown):
    """Show: every file it names is there; orbit.json is what --json prints; the motion is that of simulate, to the bit."""
    folder, record = shown
    written = {path.name for path in folder.iterdir()}
    assert written == {*record["files"], "made_by.json"}
    written.remove("made_by.json")
    assert written - {"bearing.gif", "bearing.mp4"} == PICTURES | {"orbit.json", "history.csv", "bearing.html"}
    for name in PICTURES:
        assert (folder / name).read_bytes().startswith(b"\x89PNG")
    assert json.loads((folder / "orbit.json").read_text()) == record
    assert (folder / "history.csv").read_bytes() == (saved / "history.csv").read_bytes()


def test_show_figures(shown):
    """Show: the figures that were asked for, in their places and of a sensible size."""
    record = shown[1]
    assert (record["format"], record["status"], record["turns"], record["replicate"]) == ("rbdyn.orbit/2", "ok", 4, 1)
    assert record["notes"] == [] and record["pocket_bar_stiffness_N_m"] == 5e7
    assert 9000.0 < record["cage_speed_rpm"] < 10000.0
    quantiles = list(record["whirl_ratio_quantiles"].values())
    assert quantiles == sorted(quantiles) and len(quantiles) == 5
    assert 0.0 < record["eccentricity_um"]["mean"] < record["eccentricity_um"]["guide_clearance"] == 75.0
    hit = record["largest"]["pocket"]
    assert hit["force_N"] > 10.0 and 0.0 < hit["time_ms"] < 10.0 and 1 <= hit["roller"] <= 10
    assert record["largest"]["dry_land"] == {"force_N": 0.0, "time_ms": None, "roller": None}
    assert record["races"]["inner"]["pressure_GPa"] == pytest.approx(1.4, abs=0.3)
    assert {"frequency_Hz", "amplitude"} == set(record["spectra"]["eccentricity_um"][0])


def test_show_states_the_class_of_the_result(saved, shown, page):
    """Show: the verdict of all replicates in orbit.json and in the title of the player."""
    verdict = json.loads((saved / "result.json").read_text())["verdict"]
    assert shown[1]["verdict"] == verdict
    assert page[1]["title"].endswith(f"; cage: {verdict['class']}")


def test_show_film_moves(shown):
    """Show: the moving picture has more than one frame."""
    from PIL import Image

    film = shown[0] / next(name for name in shown[1]["files"] if name.startswith("bearing.") and name[-1] != "l")
    if film.suffix == ".gif":
        with Image.open(film) as frames:
            assert frames.n_frames > 20
            first = np.asarray(frames.convert("RGB"))
            frames.seek(10)
            assert (np.asarray(frames.convert("RGB")) != first).any()
    else:
        assert film.read_bytes()[4:8] == b"ftyp"


def test_show_player_stands_alone(page):
    """Show: the player fetches nothing, is small, has a still picture for paper, and controls that keys reach."""
    text, _ = page
    assert "http" not in text and "{{" not in text
    assert not re.search(r"<(link|img|iframe|object)\b|\bsrc\s*=|url\((?!#)|@import|\bfetch\(|import\(", text)
    assert len(text.encode()) < 3e6
    assert "<svg" in text and text.count('<circle class="roller"') == 10
    for control in ('<button id="play"', '<input id="frame" type="range"', 'id="speed"', 'id="magnify"', "keydown"):
        assert control in text


def test_show_player_data_is_the_motion(page, saved):
    """Show: rounded frames of the samples: every roller between its pocket walls and on the races, where it touches."""
    data = page[1]
    frames, rollers = data["frames"], data["rollers"]
    assert frames > 300 and rollers == 10
    for name in ("ahead_um", "out_um", "spin", "outer_load_N", "inner_load_N", "pocket_load_N"):
        assert len(data[name]) == frames * rollers
    for name in ("time_us", "inner_angle", "cage_angle", "cage_x_um", "cage_y_um", "ring_x_um", "land_load_N"):
        assert len(data[name]) == frames
    assert 1.0 < data["magnification"] <= data["largest_magnification"]
    out, load = np.array(data["out_um"]), np.array(data["outer_load_N"])
    # An outer contact is a roller within a few micrometres beyond the clearance, but not inside it.
    assert (out[load > 0.0] > 1e3 * data["outer_gap"] - 0.1).all() and out.max() < 1e3 * data["outer_gap"] + 20.0
    away = np.hypot(data["cage_x_um"], data["cage_y_um"]).max()
    assert np.abs(data["ahead_um"]).max() < 1e3 * data["pocket_gap"] + away + 20.0


def test_show_prints_a_table_beside_the_result(command, saved):
    """Show: by default it writes into a folder beside the result, whose file may be named; other turns and replicates."""
    done = command("show", saved / "result.json", "--turns", "1", "--replicate", "2", "-v")
    assert done.returncode == 0, done.stderr
    for words in (
        "1 shaft turns of replicate 2, seed 1",
        "Cage: not judged, because runs of",
        "whirl speed over cage speed",
        "never touched",
        "Peaks of the spectrum of eccentricity",
    ):
        assert words in done.stdout
    assert {path.name for path in (saved / "show").iterdir()} == PICTURES | {
        "orbit.json",
        "history.csv",
        "made_by.json",
    }
    assert len((saved / "show" / "history.csv").read_text().splitlines()) == 1 + 512


def test_show_bad_input(command, saved, tmp_path):
    """Show: no such file, not a result, turns or replicates it has not: a sentence each, exit code 2."""
    (tmp_path / "other.json").write_text('{"format": "other/1"}')
    (tmp_path / "half.json").write_text('{"format": ')
    for path, words in (
        (tmp_path / "none.json", "none.json: cannot be read"),
        (tmp_path, "result.json: cannot be read"),
        (tmp_path / "other.json", "format is other/1"),
        (tmp_path / "half.json", "not a saved simulation result"),
    ):
        done = command("show", path)
        assert (done.returncode, done.stdout) == (2, "")
        assert words in done.stderr and len(done.stderr.splitlines()) == 1
    with pytest.raises(InputError) as refused:
        request_of(saved, 5.0, 3)
    turns, replicate = refused.value.faults
    assert "--turns 5: the result counted 4 turns" in turns
    assert "--replicate 3: the result has 2" in replicate
    with pytest.raises(InputError, match=r"--turns 0\.01:"):
        request_of(saved, 0.01, 1)
    assert json.loads(command("show", tmp_path, "--json").stdout)["status"] == "refused"


def test_show_few_samples(command, tmp_path):
    """Show: motion in so few samples that no roller was seen in some directions has all but a life."""
    coarse = "--set", "numerics.samples_per_turn=8", "--turns", "3"
    assert command("simulate", EXAMPLE, *QUICK, *coarse, "--out", tmp_path, "-q").returncode == 0
    assert request_of(tmp_path, 3.0, 1).turns == 3.0
    done = command("show", tmp_path, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    life = json.loads(done.stdout)["life"]
    assert life["L10_h"] is None and life["method"].startswith("none: no roller passed some of the 72 sectors")


def test_show_other_versions(saved, tmp_path):
    """Show: a result of other versions is shown with a warning."""
    record = json.loads((saved / "result.json").read_text())
    assert request_of(saved, None, 1).notes == ()
    record["versions"]["numba"] = "0.1"
    (tmp_path / "result.json").write_text(json.dumps(record))
    (note,) = request_of(tmp_path, None, 1).notes
    assert "numba 0.1 then and" in note
