"""``rbdyn accuracy`` on scenes of ``rbdyn new``: seeded ones, elastic contacts, some with heat, grease or a cage of PEEK.

``python tests/stiff/test_accuracy_of_new_scenes.py [SEED ...]`` runs all studies of ten scenes, or of those named, with the processor
time of each.
"""

import sys
import time
import tomllib
from functools import partial

import numpy as np
import pytest
from typer.testing import CliRunner

from rbdyn import accuracy
from rbdyn.accuracy import coverage, methods, variants
from rbdyn.cli.app import app
from rbdyn.scene import Scene

# Whole studies of short runs: what is tested is that each ends, not what it says.
SHORT = (
    "numerics.turns=4", "numerics.discard_turns=2", "numerics.replicates=2", "numerics.impact_window_turns=4",
    "numerics.extend=false",
)  # fmt: skip
# The tested scenes, one with grease and one with heat, share out the options and the extremes, each of which is compiled.
SEEDS = (2, 7)
CATALOGUE = ("NU210", "NU2208", "NU308", "NU1014", "NU2311", "N215")


def new_scene(seed: int) -> Scene:
    """A scene as ``rbdyn new`` writes it, by seed."""
    draw = np.random.default_rng(seed)
    if seed % 2:
        arguments = [str(draw.choice(CATALOGUE))]
    else:
        size = float(draw.choice([7.0, 9.0, 12.0]))
        rollers = int(draw.integers(11, 18))
        pitch = 1.25 * size * rollers / np.pi
        arguments = ["own", "--rollers", str(rollers), "--roller", f"{size:g}x{size:g}", "--pitch", f"{pitch:.0f}"]
        arguments += ["--speed", f"{draw.uniform(2000.0, 9000.0):.0f}", "--load", f"{draw.uniform(300.0, 2000.0):.0f}"]
    hot = seed in (1, 7)
    if seed in (2, 5):
        arguments += ["--oil", "grease VG 100"]
    elif not hot:
        arguments += ["--oil", f"ISO VG {draw.choice([22, 46, 100])}"]
    if seed in (3, 8):
        arguments += ["--cage-material", "peek"]
    if hot:
        arguments += ["--shaft", "k5", "--housing", "H7", "--ambient", "20"]
    done = CliRunner().invoke(app, ["new", *arguments])
    assert done.exit_code == 0, done.output
    return Scene.from_dict(tomllib.loads(done.stdout), f"seed {seed}", SHORT)


def short_study(study: str, scene: Scene) -> accuracy.Report:
    """A study with few repeats, of one start, whose references are compared after its own stretch alone."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(coverage, "REPEATS", 2)
        patch.setattr(coverage, "TRUTH_REPLICATES", 2)
        patch.setattr(coverage, "TRUTH_LENGTH", 2.0)
        patch.setattr(methods, "STARTS", 1)
        patch.setattr(methods, "starts_after_transient", partial(methods.starts_after_transient, starts=1))
        patch.setattr(methods, "SPANS", (methods.DEFAULT_TURNS,))
        patch.setattr(methods, "REPEATS", 1)
        return accuracy.study(study, scene)


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("study", accuracy.STUDIES)
def test_stiff_every_study_ends(study, seed, monkeypatch):
    """Stiff: each study of a scene with grease, and of one with heat, ends without a failure and says something of its scene."""
    share, cases = SEEDS.index(seed), variants.cases
    for option in sorted(variants.OPTIONS)[1 - share :: 2]:
        monkeypatch.delitem(variants.OPTIONS, option)
    monkeypatch.setattr(variants, "cases", lambda scene: dict([*cases(scene).items()][share::2]))
    report = short_study(study, new_scene(seed))
    assert report.record["status"] == "ok" and not report.failed
    assert report.tables[0].rows


if __name__ == "__main__":
    for number in map(int, sys.argv[1:] or range(10)):
        for name in accuracy.STUDIES:
            before = time.process_time()
            found = short_study(name, new_scene(number))
            print(
                f"seed {number} {name}: {'failed' if found.failed else found.record['status']}, {time.process_time() - before:.1f} s"
            )
