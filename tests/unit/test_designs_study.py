"""The design of a study: settings, seeds, faults in sentences, what the command prints."""

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from doe.cli import app
from doe.designs import central_composite
from doe.workflow.design import check_runs, design_of, evaluation
from doe.workflow.problem import Problem
from rbdyn.base.faults import InputError

EXAMPLES = Path(__file__).parents[2] / "examples"
EXAMPLE = EXAMPLES / "clearance_study.toml"


def study_file(folder: Path, design: str, factors: int = 3, model: str = "quadratic") -> Path:
    """A study of some factors with the given lines under [design]."""
    lines = ["[scene]", 'file = "scene.toml"', "[design]", design]
    for number in range(factors):
        lines += ["[[factor]]", f'name = "f{number}"', f'key = "table.f{number}"', "centre = 10.0", "step = 2.0"]
    for name in ("one", "two"):
        lines += ["[[response]]", f'name = "{name}"', f'model = "{model}"']
    path = folder / "study.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


def shown(path: Path, *options: str) -> str:
    """What ``doe design`` prints, on an exit code of 0."""
    result = CliRunner().invoke(app, ["design", str(path), *options])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_example_study_keeps_its_points_order_and_seeds():
    record = json.loads(shown(EXAMPLE, "--json"))
    coded = np.array([list(run["coded"].values()) for run in record["runs"]])
    assert np.array_equal(coded, central_composite(3, alpha=8**0.25, centre_replicates=6).coded)
    assert [run["seed"] for run in record["runs"]] == list(range(1, 21))
    assert [run["kind"] for run in record["runs"]] == ["cube"] * 8 + ["axial"] * 6 + ["centre"] * 6
    assert record["evaluation"]["model"] == "quadratic"
    assert len(record["evaluation"]["leverage"]) == 20


def test_random_order_gives_every_point_its_own_seed(tmp_path):
    text = EXAMPLE.read_text(encoding="utf-8").replace("[design]", '[design]\norder = "random"')
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    (tmp_path / "cylindrical_roller.toml").write_bytes((EXAMPLES / "cylindrical_roller.toml").read_bytes())
    study, plain = Problem.load(tmp_path / "study.toml"), Problem.load(EXAMPLE)
    design = study.design
    mixed = study.design_scenes(study.centre + design.coded * study.step, design.order.tolist())
    given = plain.design_scenes(plain.centre + plain.design.coded * plain.step)
    assert [scene.numerics.seed for scene in mixed] != [scene.numerics.seed for scene in given]
    assert {scene.model_dump_json() for scene in mixed} == {scene.model_dump_json() for scene in given}


@pytest.mark.parametrize(
    ("lines", "factors", "runs", "reach"),
    [
        ('kind = "box_behnken"\nblocks = true', 4, 30, 1.0),
        ('cube = "resolution_v"', 5, 32, 2.0),
        ('alpha = "spherical"\ncentre_replicates = 4', 3, 18, 3**0.5),
        ("alpha = 2", 3, 20, 2.0),
        ('kind = "full_factorial"', 3, 27, 1.0),
        ('kind = "latin_hypercube"\nruns = 25\ncentre_replicates = 3', 3, 28, 1.0),
        ('kind = "sobol"\nruns = 40\nseed = 9', 3, 40, 1.0),
        ('kind = "d_optimal"\nruns = 12', 3, 12, 1.0),
        ('kind = "i_optimal"\nruns = 10\ncentre_replicates = 3\norder = "random"', 3, 13, 1.0),
    ],
)
def test_every_kind_is_built_and_evaluated(tmp_path, lines, factors, runs, reach):
    study = Problem.load(study_file(tmp_path, lines, factors))
    design = study.design
    assert design.coded.shape == (runs, factors)
    assert design.reach == pytest.approx(reach)
    found = evaluation(study, design)
    assert found.region.shape == ("box" if reach == 1.0 and factors == 3 else "ball")
    assert 0.0 < found.efficiency_percent["g"] <= 100.0


@pytest.mark.parametrize(
    ("lines", "factors", "words"),
    [
        ('alpha = "rotable"', 3, ["design.alpha = 'rotable': choose one of 'rotatable'"]),
        ('cube = "resolution_v"', 4, ["design.cube = 'resolution_v'", "4 factors, only for 5 to 8"]),
        ('kind = "box_behnken"', 8, ["design.kind = 'box_behnken': tabulated for 3 to 7 factors, not for 8"]),
        ('kind = "box_behnken"\nblocks = true', 3, ["design.blocks = true", "no orthogonal blocks"]),
        ("levels = 4", 3, ["design.levels: kind = 'central_composite' has no"]),
        ('kind = "sobol"\nalpha = 1.5', 3, ["design.alpha: kind = 'sobol' has no such key"]),
        ('kind = "definitive_screening"\nruns = 5', 3, ["design.runs: kind = 'definitive_screening' has no such key"]),
        ('kind = "d_optimal"', 3, ["design.runs: missing; kind = 'd_optimal' needs the number of runs to make"]),
        ('kind = "i_optimal"\nruns = 9', 3, ["design.runs = 9: too few for a model of 10 terms; give at least 11"]),
        ('kind = "full_factorial"\nlevels = 30', 4, ["design.levels = 30: 4 factors give 810000 runs"]),
    ],
)  # fmt: skip
def test_impossible_settings_are_named(tmp_path, lines, factors, words):
    path = study_file(tmp_path, lines, factors)
    with pytest.raises(InputError) as refused:
        design_of(Problem.load(path))
    assert all(word in str(refused.value) for word in words), str(refused.value)
    assert all(fault.startswith(f"{path}: design.") for fault in refused.value.faults)


@pytest.mark.parametrize(
    ("lines", "model", "words"),
    [
        ('kind = "sobol"\nruns = 10', "quadratic", "the 10 runs of the design are too few; it needs 11 (10 terms and"),
        ('kind = "sobol"\nruns = 4', "linear", "it needs 5 (4 terms and one to judge the fit)"),
        ('kind = "full_factorial"\nlevels = 2\ncentre_replicates = 4', "reduced", "cannot separate B^2, C^2 from"),
        ('kind = "d_optimal"\nruns = 10', "quadratic", "choose a simpler model (pure_quadratic or interaction"),
        ('kind = "definitive_screening"', "quadratic", "it needs 11 (10 terms and one to judge the fit)"),
        ('alpha = "spherical"\ncentre_replicates = 0', "quadratic", "cannot separate C^2 from the other terms"),
    ],
)
def test_runs_that_do_not_suffice_are_named_for_every_response(tmp_path, lines, model, words):
    path = study_file(tmp_path, lines, 3, model)
    with pytest.raises(InputError) as refused:
        check_runs(Problem.load(path), Problem.load(path).design)
    for number, fault in enumerate(refused.value.faults, 1):
        assert fault.startswith(f"{path}: response[{number}].model = '{model}': ")
        assert words in fault
    assert len(refused.value.faults) == 2


def test_command_prints_blocks_and_what_the_design_can_tell(tmp_path):
    path = study_file(tmp_path, 'alpha = "orthogonal_blocks"\nblocks = true\norder = "random"')
    text = shown(path, "--verbose")
    for words in ("block", "seed", "D 13.7", "orthogonal to the terms", "VIF", "power for 2 sigma", "lack of fit 5"):
        assert words in text
    assert "VIF" not in shown(path, "--quiet")
    rows = shown(path, "--csv").splitlines()
    assert rows[0] == "run,block,f0,f1,f2"
    assert [row.split(",")[1] for row in rows[1:]] == ["1"] * 12 + ["2"] * 8
