"""Fuzz: mutated inputs are read or refused in sentences of one bounded line, and quickly; nothing is simulated."""

import json
import random
import re
import shutil
from pathlib import Path

import pytest
from mutations import mutated, outcome

from doe.dimension_chain import read_chains
from doe.study_file.table import read_table as read_runs_table
from doe.workflow.design import design_of
from doe.workflow.problem import Problem
from doe.workflow.whole import check_study
from rbdyn.quasistatic.sweep import SweepResult
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENES = ("cylindrical_roller", "all_options", "angular_contact_ball", "angular_contact_7014", "deep_groove_ball",
          "double_decker", "published/nu215")  # fmt: skip
CHAINS = ("pocket_chain", "bearing_chains", "pocket_chain_as_printed", "guide_chain_options")
# A function of a chain's links is written in a language of its own, with tests of its own.
EXPRESSION = re.compile(rb"expression[^\n]*")


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """The examples' files, and saved results like those that the commands write."""
    folder = tmp_path_factory.mktemp("fuzz")
    for path in (*EXAMPLES.glob("*.toml"), *EXAMPLES.glob("published/*.toml"), EXAMPLES / "ccd_table4.csv"):
        shutil.copy(path, folder)
    quantity = {"value": 1.5, "statistical_error": 0.1, "numerical_error": None, "effective_samples": 4.0}
    names = (
        "impact_force_N",
        "impact_contact_force_N",
        "whirl_deviation_ratio",
        "power_loss_W",
        "cage_speed_rpm",
        "cage_slip",
    )
    result = {
        "format": SimulationResult.FORMAT, "status": "ok", **dict.fromkeys(names, quantity), "power_balance": {"relative_gap": 1e-3},
        "power_terms_W": {"drag": 2.0}, "rolling_resistance_W": {"outer": 1.0, "inner": 1.0}, "loads": {"max_inner_N": 1.0, "max_outer_N": 2.0, "max_land_N": 0.0},
        "races": {"inner": {"max_pressure_MPa": 900.0, "half_width_um": 90.0}}, "clearance_um": {"drawn": 20.0}, "friction_check": None, "impact_window_turns": 1.0,
        "transient_turns": None, "counted_turns": 2.0, "target": None, "cost": {"wall_s": 1.0}, "replicates": 2, "seed": 1,
        "notes": [{"level": "note", "code": "remark", "text": "none"}], "versions": {"rbdyn": "1"}, "scene": Scene.load(EXAMPLES / "cylindrical_roller.toml").model_dump(mode="json"),
    }  # fmt: skip
    sweep = {
        "format": SweepResult.FORMAT, "keys": {"operation.axial_load_N": [1.0, 2.0]}, "cost": {"wall_s": 1.0, "cold_starts": 1},
        "points": [{"operation.axial_load_N": x, "status": "ok", "x_mm": 0.1} for x in (1.0, 2.0)], "scene": {}, "notes": [],
    }  # fmt: skip
    for name, record in (("result", result), ("sweep", sweep)):
        (folder / f"{name}.json").write_text(json.dumps(record, indent=1), encoding="utf-8")
    return folder


def read_result(path: Path) -> object:
    """A saved result and its scene, as ``rbdyn show`` reads them."""
    return Scene.from_dict(SimulationResult.load(path).scene, f"{path}: scene")


def read_study(path: Path) -> object:
    """A study and its design, as ``doe design`` reads them."""
    study = Problem.load(path)
    if (study.file.design.runs, study.file.design.levels) <= (200, 3):
        design_of(study)
    return study


def read_table(path: Path) -> object:
    """A table of the paper's three responses, as ``doe fit --data`` reads it."""
    study = Problem.load(EXAMPLES / "clearance_study.toml")
    return read_runs_table(path, study.factors, study.responses[:3], study.path)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("read", "names", "count"),
    [
        (Scene.load, [f"{Path(name).name}.toml" for name in SCENES], 6000),
        (read_study, ["clearance_study.toml"], 4000),
        (lambda path: check_study(Problem.load(path)) or "checked", ["clearance_study.toml"], 300),
        (read_chains, [f"{name}.toml" for name in CHAINS], 4000),
        (read_table, ["ccd_table4.csv"], 3000),
        (read_result, ["result.json"], 2000),
        (SweepResult.load, ["sweep.json"], 1000),
    ],
    ids=["scenes", "studies", "checked studies", "chains", "tables", "results", "sweeps"],
)
def test_mutated_input_is_read_or_refused_in_sentences(folder, read, names, count):
    """Fuzz: every mutation of an example; what was refused or read is counted, so that neither is all."""
    draw, ends = random.Random(names[0]), []
    path = folder / f"mutated{Path(names[0]).suffix}"
    for number in range(count):
        whole = (folder / names[number % len(names)]).read_bytes()
        kept = EXPRESSION.findall(whole)
        data = mutated(draw, whole)
        if EXPRESSION.findall(data) != kept:
            continue
        path.write_bytes(data)
        try:
            ends.append(outcome(read, path))
        except BaseException as error:
            error.add_note(f"{names[number % len(names)]}, mutation {number}, is left in {path}")
            raise
    assert min(ends.count("read"), ends.count("refused")) > len(ends) // 50
