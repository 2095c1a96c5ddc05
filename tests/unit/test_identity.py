"""The identity of a result: bearing and operating point in words, date, version, hashes of the input files."""

import hashlib
from datetime import date
from importlib.metadata import version
from pathlib import Path

import pytest

from rbdyn.base.identity import Identity, drawing_words, identity_line, identity_of, identity_table, point_words
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"


def tables(name: str, *changes: str) -> dict:
    return Scene.load(EXAMPLES / name, changes).model_dump(mode="json")


@pytest.mark.parametrize(
    ("name", "drawing", "point"),
    [
        (
            "cylindrical_roller.toml",
            "cylindrical roller bearing, 10 rollers 9 x 5 mm, pitch diameter 43.5 mm",
            "24000 rpm, 1300 N radial, MIL-L-7808 at 100 °C",
        ),
        (
            "angular_contact_7014.toml",
            "angular contact ball bearing, 18 balls 12.7 mm, pitch diameter 90 mm, contact angle 15°",
            "30 rpm, 500 N axial",
        ),
        (
            "double_decker.toml",
            "double-decker ball bearing, 17 balls 3 mm, pitch diameter 18 mm, contact angle 15° inside, 21 balls 4.25 mm, pitch "
            "diameter 33.5 mm, contact angle 15° outside",
            "10000 rpm, 200 N radial, 200 N axial",
        ),
    ],
)
def test_words_of_scenes(name: str, drawing: str, point: str) -> None:
    scene = tables(name)
    assert drawing_words(scene["bearing"]) == drawing
    assert point_words(scene) == point


def test_further_loads_are_named() -> None:
    words = point_words(tables("all_options.toml"))
    assert "outer ring -3000 rpm" in words and "50 N rotating" in words and "schedule" in words
    assert point_words(tables("angular_contact_ball.toml", "operation.preload_um=5")).endswith("preload 5 µm")


def test_designation_names_the_bearing(tmp_path: Path) -> None:
    scene = {"bearing": {**tables("cylindrical_roller.toml")["bearing"], "designation": "NU 210"}}
    (tmp_path / "scene.toml").write_text("x = 1\n")
    identity = identity_of("rbdyn simulate", scene, [tmp_path / "scene.toml", tmp_path / "missing.toml"])
    assert identity.title == "NU 210: rbdyn simulate"
    assert identity.files == {"scene.toml": hashlib.sha256(b"x = 1\n").hexdigest()[:12]}
    assert (identity.date, identity.version) == (date.today().isoformat(), version("rbdyn"))
    assert identity_line(identity).text == f"NU 210; {identity.date}"
    assert [row[0] for row in identity_table(identity).rows][:2] == ["bearing", "drawing"]
    assert Identity.from_dict(identity.as_dict()) == identity


def test_result_without_a_bearing_is_known_by_its_files(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "chain.toml").write_text(folder)
    paths = [tmp_path / folder / "chain.toml" for folder in ("one", "two")]
    identity = identity_of("doe chain", {}, paths, "2026-01-31")
    assert identity.title == "chain.toml: doe chain" and identity_line(identity).text.endswith("; 2026-01-31")
    assert list(identity.files) == ["chain.toml", str(paths[1])]
