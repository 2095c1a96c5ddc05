"""Sweeps of ball bearings that were interrupted: they go on from what is kept, to the same bits."""

import numpy as np
import pytest
from conftest import ROOT

from rbdyn.quasistatic import sweep as sweeps
from rbdyn.quasistatic.sweep import sweep
from rbdyn.scene import BallScene

SPEED, LOAD = "operation.inner_speed_rpm", "operation.axial_load_N"


def scene_with(*assignments, file="angular_contact_ball.toml"):
    return BallScene.load(ROOT / "examples" / file, assignments)


@pytest.mark.parametrize(
    ("scene", "keys"),
    [
        (scene_with(), {SPEED: np.linspace(5e3, 30e3, 40).tolist()}),
        (scene_with("model.solver=finite_search"), {SPEED: np.linspace(5e3, 9e3, 12).tolist(), "bearing.balls": [15, 16]}),
        (scene_with(file="double_decker.toml"), {LOAD: np.linspace(200.0, 900.0, 6).tolist()}),
    ],
    ids=["a single row", "another solver", "double-decker"],
)  # fmt: skip
def test_an_interrupted_sweep_goes_on_to_the_same_bits(scene, keys, tmp_path, monkeypatch):
    """Unit: stopped by Ctrl-C, what is done is kept; the rest alone is solved, and no figure differs."""
    monkeypatch.setattr(sweeps, "ROW", 2)
    whole, path, seen = sweep(scene, keys), tmp_path / "sweep.part", []

    def stop(done, total):
        seen.append(done)
        if len(seen) == 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(scene, keys, stop, path)
    assert path.exists()
    path.with_name("other").write_bytes(path.read_bytes())
    resumed = sweep(scene, keys, None, path)
    assert not path.exists()
    for name, column in whole.columns.items():
        assert np.array_equal(resumed.columns[name], column, equal_nan=True), name
    assert (resumed.statuses, resumed.notes, resumed.cold) == (whole.statuses, whole.notes, whole.cold)
    assert resumed.balls().equals(whole.balls())
    # Of another sweep, or broken: all is solved.
    other = path.with_name("other")
    assert sweep(scene, {**keys, SPEED: [5e3, 6e3]}, None, other).statuses
    path.write_bytes(b"PK nonsense")
    assert sweep(scene, keys, None, path).statuses == whole.statuses


def test_a_resumed_sweep_solves_only_what_is_left(tmp_path, monkeypatch):
    """Unit: whole rows of what was done are not solved again; a row that was spoilt, and those after it, are."""
    monkeypatch.setattr(sweeps, "ROW", 10)
    path, seen = tmp_path / "sweep.part", []

    def stop(done, total):
        seen.append(done)
        if done == 34:
            raise KeyboardInterrupt

    keys = {SPEED: np.linspace(5e3, 30e3, 60).tolist()}
    with pytest.raises(KeyboardInterrupt):
        sweep(scene_with(), keys, stop, path)
    kept = path.read_text()
    seen.clear()
    sweep(scene_with(), keys, lambda done, total: seen.append(done), path)
    assert seen == list(range(31, 61))
    first, second, third = filter(None, kept.splitlines())
    path.write_text("\n".join((first, second[:-9], third)))
    seen.clear()
    sweep(scene_with(), keys, lambda done, total: seen.append(done), path)
    assert seen == list(range(11, 61))
