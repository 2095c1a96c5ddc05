"""What a notebook calls: each public function takes a scene or the path of its file, and refuses anything else in a sentence."""

from pathlib import Path

import numpy as np
import pytest

import rbdyn

EXAMPLES = Path(__file__).parents[2] / "examples"
ROLLERS, BALLS = EXAMPLES / "cylindrical_roller.toml", EXAMPLES / "deep_groove_ball.toml"
DOUBLE = EXAMPLES / "double_decker.toml"
SHORT = [
    "numerics.turns=2",
    "numerics.discard_turns=0",
    "numerics.replicates=1",
    "numerics.companion=false",
    "numerics.extend=false",
]


@pytest.fixture(scope="module")
def short_file(tmp_path_factory):
    """A scene of a roller bearing that runs in no time, as a file."""
    path = tmp_path_factory.mktemp("scene") / "short.toml"
    numerics = "\n".join(SHORT).replace("numerics.", "")
    path.write_text(f"{ROLLERS.read_text(encoding='utf-8')}\n[numerics]\n{numerics}\n", encoding="utf-8")
    return path


def test_unit_public_functions_take_the_path_of_a_scene(short_file):
    """Unit: simulate, history and equilibrium of a path, as text or not, are those of the scene that it holds."""
    scene = rbdyn.Scene.load(short_file)
    whole = rbdyn.simulate(scene).power_loss_W
    assert rbdyn.simulate(str(short_file)).power_loss_W == whole == rbdyn.simulate(short_file).power_loss_W
    motion = rbdyn.history(scene, 0.1)
    for given in (short_file, str(short_file)):
        assert np.array_equal(rbdyn.history(given, np.float64(0.1), np.int64(0)).cage_x, motion.cage_x)
    balls = rbdyn.equilibrium(rbdyn.Scene.load(BALLS)).report
    assert rbdyn.equilibrium(BALLS).report == balls == rbdyn.equilibrium(str(BALLS)).report


@pytest.mark.parametrize("function", [rbdyn.simulate, rbdyn.equilibrium, lambda scene: rbdyn.history(scene, 1.0)])
@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        (5, "scene = 5: must be a Scene or the path of a scene file"),
        (None, "scene = None: must be a Scene or the path"),
        ({}, "scene = {}: must be a Scene or the path of a scene file; Scene.from_dict takes tables"),
        (b"a.toml", "must be a Scene or the path"),
        (["x" * 1000], "must be a Scene or the path"),
        ("nowhere.toml", "nowhere.toml: no such file"),
        (EXAMPLES, "cannot be read"),
        ("a\0b", "cannot be read"),
    ],
)
def test_unit_public_functions_refuse_what_is_no_scene(function, given, sentence):
    """Unit: one sentence of one line names what was given."""
    with pytest.raises(rbdyn.InputError) as refused:
        function(given)
    (line,) = refused.value.faults
    assert sentence in line and line.isprintable() and len(line) < 200


CALLS = {
    "bearing.kind = 'deep_groove_ball': is not simulated": lambda: rbdyn.simulate(BALLS),
    "bearing.kind = 'deep_groove_ball': is not": lambda: rbdyn.history(BALLS, 1.0),
    "bearing.kind = 'cylindrical_roller': has no balls": lambda: rbdyn.equilibrium(ROLLERS),
    "workers = 0: must be a whole number from 1": lambda: rbdyn.simulate(ROLLERS, workers=0),
    "workers = '2': must be": lambda: rbdyn.simulate(ROLLERS, workers="2"),
    "target = '2%': must be a number": lambda: rbdyn.simulate(ROLLERS, target="2%"),
    "--target nan: must be above 0": lambda: rbdyn.simulate(ROLLERS, target=float("nan")),
    "start = 'x': must be a result of equilibrium": lambda: rbdyn.equilibrium(BALLS, start="x"),
    "solution of each of its 2 rows": lambda: rbdyn.equilibrium(DOUBLE, start=rbdyn.equilibrium(BALLS)),
    "turns = nan: must be a number of shaft turns": lambda: rbdyn.history(ROLLERS, float("nan")),
    "turns = '1': must be a number": lambda: rbdyn.history(ROLLERS, "1"),
    "turns = -1: shorter than one of 512 samples": lambda: rbdyn.history(ROLLERS, -1.0),
    "turns = 1e+09: there is memory for": lambda: rbdyn.history(ROLLERS, 1e9),
    "replicate = -1: must be a whole number from 0": lambda: rbdyn.history(ROLLERS, 1.0, -1),
    "samples_per_turn = 0: must be a whole number from 1": lambda: rbdyn.history(ROLLERS, 1.0, 0, 0),
    "path = 5: must be the path of a file": lambda: rbdyn.load(5),
    "path = None: must be the path of a file": lambda: rbdyn.Scene.load(None),
    "scene = 'a.toml': must be a dict of tables; Scene.load reads": lambda: rbdyn.Scene.from_dict("a.toml"),
    "Scene('a.toml'): takes tables by keyword; Scene.load reads": lambda: rbdyn.Scene("a.toml"),
    "overrides = 'cage.mass_g=5': must be a list": lambda: rbdyn.Scene.load(ROLLERS, "cage.mass_g=5"),
    "overrides = [5]: must be a list": lambda: rbdyn.Scene.load(ROLLERS, [5]),
    "changes = 'cage.mass_g=5': must be a dict": lambda: rbdyn.Scene.load(ROLLERS).changed("cage.mass_g=5"),
}


@pytest.mark.parametrize("sentence", CALLS)
def test_unit_public_functions_name_a_bad_argument(sentence):
    """Unit: the wrong kind of bearing, and arguments that there cannot be, are one sentence each."""
    with pytest.raises(rbdyn.InputError) as refused:
        CALLS[sentence]()
    (line,) = refused.value.faults
    assert sentence in line and len(line) < 200


def test_unit_overrides_may_come_one_by_one():
    """Unit: an iterator of overrides is read once and whole."""
    assert rbdyn.Scene.load(ROLLERS, (each for each in SHORT)).numerics.replicates == 1
