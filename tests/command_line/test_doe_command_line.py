"""Command line of ``doe``: exit codes, messages, JSON contract, what is imported."""

import json
from pathlib import Path

import pytest
from doe_command import doe, invoke, loaded_by

EXAMPLES = Path(__file__).parents[2] / "examples"
STUDY, TABLE = str(EXAMPLES / "clearance_study.toml"), str(EXAMPLES / "ccd_table4.csv")


def brief_study(folder: Path) -> str:
    """The example study with a small search for its front."""
    text = Path(STUDY).read_text(encoding="utf-8")
    for usual, brief in (
        ('tolerance_aware = "quantile"', 'tolerance_aware = "none"'),
        ("population = 100", "population = 20"),
        ("generations = 200", "generations = 10"),
    ):
        assert usual in text
        text = text.replace(usual, brief)
    (folder / "brief.toml").write_text(text, encoding="utf-8")
    return str(folder / "brief.toml")


def test_help_loads_nothing_heavy():
    assert loaded_by(invoke("--help")) == set()


def test_fit_loads_no_compiler_no_optimiser_no_plots():
    assert loaded_by(invoke("fit", STUDY, "--data", TABLE, "--json")) & {"numba", "pymoo", "matplotlib"} == set()


def test_chain_loads_no_compiler_and_no_tables():
    chain = str(EXAMPLES / "pocket_chain_as_printed.toml")
    assert loaded_by(invoke("chain", chain, "--json")) & {"numba", "pymoo", "sklearn", "matplotlib"} == set()


def test_design_has_the_published_runs():
    shown = doe("design", STUDY, "--json")
    assert shown.returncode == 0
    record = json.loads(shown.stdout)
    assert len(record["runs"]) == 20
    axial = sorted({round(run["factors"]["pocket_clearance_mm"], 5) for run in record["runs"]})
    # Table 3 of Chen et al. 2022, pocket clearance.
    assert axial == [0.21591, 0.25, 0.3, 0.35, 0.38409]
    assert len({run["seed"] for run in record["runs"]}) == 20
    lines = doe("design", STUDY, "--csv").stdout.splitlines()
    assert lines[0] == "run,radial_clearance_mm,guide_clearance_mm,pocket_clearance_mm"
    assert len(lines) == 21


def test_fit_json_keeps_the_contract():
    record = json.loads(doe("fit", STUDY, "--data", TABLE, "--json").stdout)
    assert list(record["responses"]) == ["impact_force_N", "whirl_deviation_ratio", "power_loss_W"]
    whirl = record["responses"]["whirl_deviation_ratio"]
    assert set(whirl) >= {
        "model", "coefficients", "anova", "lack_of_fit", "pure_error", "r2", "adjusted_r2", "predicted_r2",
        "press", "cv_percent", "adequate_precision", "stationary_point",
    }  # fmt: skip
    assert list(whirl["coefficients"]) == ["1", "A", "B", "C", "AB", "AC", "BC", "A^2", "B^2", "C^2"]
    sources = [row["source"] for row in whirl["anova"]]
    assert {"model", "residual", "lack_of_fit", "pure_error", "total"} <= set(sources)
    assert set(whirl["stationary_point"]) == {"coded", "actual", "eigenvalues", "nature"}
    # Linear effects of eq 22 of Chen et al. 2022 that survive in Table 4 as printed.
    assert whirl["coefficients"]["B"] == pytest.approx(-0.062, abs=5e-4)
    assert record["responses"]["power_loss_W"]["coefficients"]["C"] == pytest.approx(-27.49, abs=5e-3)


def test_front_json_keeps_the_contract(tmp_path):
    record = json.loads(doe("front", brief_study(tmp_path), "--data", TABLE, "--json").stdout)
    assert {"front", "hypervolume", "ideal", "nadir", "knee", "baseline", "generations", "seed"} <= set(record)
    assert {"factors", "responses", "errors"} <= set(record["front"][0])


def test_printed_chain_of_the_paper_is_refused_with_the_numbers():
    shown = doe("chain", str(EXAMPLES / "pocket_chain_as_printed.toml"), "--json")
    assert shown.returncode == 1
    record = json.loads(shown.stdout)
    assert record["status"].startswith("refused")
    assert record["closing_link"]["worst_case_mm"] == pytest.approx([-0.05, 0.05])
    for number in ("-0.0500", "+0.0500", "0.2800", "0.2900", "9.290 "):
        assert number in shown.stderr
    assert "Traceback" not in shown.stderr


def test_right_chain_is_accepted():
    shown = doe("chain", str(EXAMPLES / "pocket_chain.toml"), "--json")
    assert shown.returncode == 0
    record = json.loads(shown.stdout)
    assert record["allocation"]["pocket_width"] == {
        "nominal_mm": 9.29, "upper_mm": 0.0, "lower_mm": -0.005, "grade": None, "moved_mm": -0.01,
    }  # fmt: skip
    assert {"closing_link", "yield", "contributions", "allocation", "status"} <= set(record)


@pytest.mark.parametrize(
    ("arguments", "name", "quiet", "verbose"),
    [
        (["design", STUDY], "design.json", "run", "seed"),
        (["fit", STUDY, "--data", TABLE], "fit.json", "Significant at", "sum of squares"),
        (["front", "brief", "--data", TABLE], "front.json", "baseline", "hypervolume"),
        (["chain", str(EXAMPLES / "pocket_chain.toml")], "chain.json", "pocket width", "Contributions"),
    ],
)
def test_quiet_says_less_and_out_keeps_the_record(arguments, name, quiet, verbose, tmp_path, monkeypatch):
    monkeypatch.setattr("doe.workflow.surfaces.MOST_RIVALLED", 0)
    arguments = [brief_study(tmp_path) if each == "brief" else each for each in arguments]
    less = doe(*arguments, "--quiet", "--out", str(tmp_path))
    more = doe(*arguments, "--verbose")
    assert less.returncode == more.returncode == 0, less.stderr + more.stderr
    assert quiet in less.stdout and verbose in more.stdout
    assert len(less.stdout) < len(more.stdout)
    record = json.loads((tmp_path / name).read_text(encoding="utf-8"))
    assert record == json.loads(doe(*arguments, "--json").stdout)


@pytest.mark.parametrize("command", ["study", "design", "fit", "front", "chain"])
def test_missing_file_is_one_sentence(command, tmp_path):
    out = ["--out", str(tmp_path / "out")] if command == "study" else []
    shown = doe(command, "nowhere.toml", *out)
    assert shown.returncode == 2
    assert shown.stderr.strip() == "nowhere.toml: no such file; check the path"
    assert shown.stdout == ""
    assert not (tmp_path / "out").exists()


def test_all_faults_of_a_study_at_once(tmp_path):
    text = Path(STUDY).read_text(encoding="utf-8")
    path = tmp_path / "bad.toml"
    path.write_text(
        text.replace("step = 0.005", "step = -0.005")
        .replace('goal = "min"', 'goal = "mininum"', 1)
        .replace("population", "poplation"),
        encoding="utf-8",
    )
    shown = doe("study", str(path), "--json")
    assert shown.returncode == 2
    assert json.loads(shown.stdout)["faults"] == shown.stderr.strip().splitlines()
    for words in (("factor[1].step = -0.005", "greater than 0"), ("response[1].goal", "'target' or 'none'")):
        assert any(all(word in line for word in words) for line in shown.stderr.splitlines())
    assert "front.poplation: unknown key; did you mean population?" in shown.stderr
