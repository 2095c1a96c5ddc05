"""What a notebook calls: each public function takes a scene or the path of its file, and refuses anything else in a sentence."""

import importlib
import inspect
import multiprocessing
import pickle
import pkgutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from short_studies import short_study

import doe
import rbdyn

EXAMPLES = Path(__file__).parents[2] / "examples"
ROLLERS, BALLS = EXAMPLES / "cylindrical_roller.toml", EXAMPLES / "deep_groove_ball.toml"
DOUBLE = EXAMPLES / "double_decker.toml"
STUDY, TABLE = EXAMPLES / "clearance_study.toml", EXAMPLES / "ccd_table4.csv"
FUNCTIONS = ("study", "uncertainty", "calibrate", "design", "fit", "front", "chain")
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
    "path = 5: must be the path of a file or a folder": lambda: doe.study(5),
    "data = None: must be the path": lambda: doe.calibrate(ROLLERS, None),
    "out = 3: must be the path": lambda: doe.design(STUDY, out=3),
    "nowhere.toml: no such file": lambda: doe.chain("nowhere.toml"),
    "nowhere.csv: no such file": lambda: doe.fit(STUDY, "nowhere.csv"),
    "fit: nothing to fit": lambda: doe.fit(),
    "responses = 'impact_force_N': must be a list such as": lambda: doe.fit(data=TABLE, responses="impact_force_N"),
    "--model: ": lambda: doe.fit(STUDY, TABLE, model="linear"),
    "--point foo: no such factor": lambda: doe.front(STUDY, TABLE, point={"foo": 1.0}),
    "--point 0.02,0.1: give a value for each factor": lambda: doe.front(STUDY, TABLE, point=[0.02, 0.1]),
    "point = 5: must be values by factor": lambda: doe.front(STUDY, TABLE, point=5),
    "points = 15: must be a power of two": lambda: doe.uncertainty(ROLLERS, points=15),
    "--points 24: no power of two; take 16": lambda: doe.uncertainty(ROLLERS, points=24),
    "target = [0.1]: must be a number": lambda: doe.uncertainty(ROLLERS, target=[0.1]),
    "--target ten: not a number": lambda: doe.uncertainty(ROLLERS, target="ten"),
    "overrides = 'a=b': must be a list such as": lambda: doe.uncertainty(ROLLERS, overrides="a=b"),
    "overrides = 'cage.mass_g=7': must be a list": lambda: rbdyn.simulate(ROLLERS, overrides="cage.mass_g=7"),
    "cage.mas_g: unknown key; did you mean mass_g?": lambda: rbdyn.simulate(ROLLERS, overrides=["cage.mas_g=5"]),
    "scene: cage.mas_g: unknown key": lambda: rbdyn.history(rbdyn.Scene.load(ROLLERS), 1.0, overrides=["cage.mas_g=5"]),
    "operation.inner_sped_rpm: unknown key; did you": lambda: rbdyn.equilibrium(
        BALLS, overrides=["operation.inner_sped_rpm=1"]
    ),
}


@pytest.mark.parametrize("sentence", CALLS)
def test_unit_faults_of_a_call_are_sentences(sentence, tmp_path, monkeypatch, capsys):
    """Unit: InputError with one line for each fault, which survives another process; nothing is printed or written."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(rbdyn.InputError) as refused:
        CALLS[sentence]()
    error = refused.value
    (line,) = error.faults
    assert sentence in line == str(error) and len(line) < 200
    assert pickle.loads(pickle.dumps(error)).faults == error.faults
    assert capsys.readouterr() == ("", "") and list(tmp_path.iterdir()) == []


def test_unit_overrides_may_come_one_by_one():
    """Unit: an iterator of overrides is read once and whole."""
    assert rbdyn.Scene.load(ROLLERS, (each for each in SHORT)).numerics.replicates == 1


def test_unit_dir_shows_what_is_public():
    """Unit: public names and the version, nothing of the machinery; no submodule hides a function."""
    for package in (doe, rbdyn):
        shown = dir(package)
        assert set(shown) == {*package.__all__, "__version__"} and shown == sorted(shown)
        assert all(getattr(package, name) is not None for name in shown)
        modules = {module.name for module in pkgutil.iter_modules(package.__path__)}
        assert modules.isdisjoint(package.__all__)
        with pytest.raises(AttributeError, match=f"module '{package.__name__}' has no attribute 'nothing'"):
            package.nothing  # noqa: B018
    for module in pkgutil.iter_modules(doe.__path__, "doe."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    assert all(inspect.isfunction(getattr(doe, name)) for name in FUNCTIONS)


@pytest.mark.parametrize(
    "function", [*(getattr(doe, name) for name in FUNCTIONS), rbdyn.simulate, rbdyn.history, rbdyn.equilibrium]
)
def test_unit_help_of_a_function_names_every_argument(function):
    """Unit: each argument with its kind in the signature and its meaning in the docstring, and the errors it raises."""
    signature, text = inspect.signature(function, eval_str=False), inspect.getdoc(function)
    silent = {
        "scene",
        "turns",
        "replicate",
        "start",
        "stop",
    }  # said in the first sentence, or of the library's own loops
    assert all(one.annotation is not inspect.Parameter.empty for one in signature.parameters.values())
    assert [name for name in signature.parameters if f"``{name}" not in text and name not in silent] == []
    assert "Raises" in text and "InputError" in text


def test_unit_a_study_that_runs_refuses_its_workers(tmp_path):
    """Unit: the number of threads is checked before anything runs."""
    with pytest.raises(rbdyn.InputError, match="workers = 0: must be a whole number from 1"):
        doe.study(short_study(tmp_path), tmp_path / "out", workers=0)


def test_command_line_import_of_doe_is_light():
    """Import: ``import doe`` loads itself alone, and its errors nothing heavy."""
    program = "import sys, doe; dir(doe); print([name for name in sys.modules if name.partition('.')[0] in ('rbdyn', 'numpy', 'typer', 'rich') or name.startswith('doe.')])"
    assert subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True).stdout == "[]\n"


def test_unit_figures_of_balls_are_attributes_by_their_keys():
    """Unit: each key of a ball bearing's JSON is an attribute; a result without an equilibrium says why it has none."""
    for path in (BALLS, DOUBLE):
        result = rbdyn.equilibrium(path)
        record, names = result.as_dict(), dir(result)
        assert {"displacement_mm", "stiffness", "residual_N"} <= record.keys() <= {*names}
        assert result.displacement_mm == record["displacement_mm"] and result.scene == record["scene"]
        kept = pickle.loads(pickle.dumps(result))
        assert kept.stiffness == result.stiffness and repr(kept) == repr(result)
        with pytest.raises(AttributeError, match="BallResult has no attribute 'lives'"):
            _ = result.lives
    lost = rbdyn.equilibrium(BALLS, overrides=["operation.radial_load_N=1e7", "operation.axial_load_N=0.0"])
    with pytest.raises(AttributeError, match="has no attribute 'life'; there is no equilibrium"):
        _ = lost.life


def test_unit_figures_of_rollers_are_attributes_by_their_keys(outer_result):
    """Unit: every key of a simulation's JSON is an attribute of the same name, and the reverse."""
    record = outer_result.as_dict()
    stated = {key for key, value in record.items() if value is not None}
    fields = {name for name, value in vars(outer_result).items() if value is not None} - {"figures"}
    assert fields | outer_result.figures.keys() == stated == {key for key in stated if hasattr(outer_result, key)}
    assert record["impact_force_N"]["value"] == outer_result.impact_force_N.value
    kept = pickle.loads(pickle.dumps(outer_result))
    assert kept == outer_result and len(repr(kept)) < 320


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["spawn", "joblib"])
def test_invariant_simulate_in_other_processes_gives_the_same(kind):
    """Invariant: the same bits in processes that start from nothing, and a fault comes back as it was raised."""
    simulate, scenes = partial(rbdyn.simulate, overrides=SHORT), [ROLLERS, str(ROLLERS)]
    wrong = partial(rbdyn.simulate, overrides=["cage.mas_g=5"])
    here = simulate(ROLLERS)
    if kind == "joblib":
        from joblib import Parallel, delayed

        there = Parallel(n_jobs=2)(delayed(simulate)(scene) for scene in scenes)
        with pytest.raises(rbdyn.InputError, match="unknown key"):
            Parallel(n_jobs=2)(delayed(wrong)(scene) for scene in scenes)
    else:
        with ProcessPoolExecutor(2, multiprocessing.get_context(kind)) as pool:
            there = list(pool.map(simulate, scenes))
            with pytest.raises(rbdyn.InputError, match="unknown key"):
                list(pool.map(wrong, scenes))
    assert all(result.quantities == here.quantities for result in there)
