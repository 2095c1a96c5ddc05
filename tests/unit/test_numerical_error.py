"""The benchmark of the stated numerical error: its judgement against hand calculations, its scenes and its truths."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import pytest

from rbdyn.dynamics.parameters.state import light_contact

BENCHMARKS = Path(__file__).parents[2] / "examples" / "benchmarks"


@pytest.fixture(scope="module")
def benchmark():
    """The script, imported without running it."""
    spec = importlib.util.spec_from_file_location("numerical_error", BENCHMARKS / "numerical_error.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def scenes(benchmark, tmp_path_factory):
    """Every scene of the benchmark, by name."""
    folder = tmp_path_factory.mktemp("scenes")
    return {case.name: benchmark.scene_of(case, benchmark.Size(2, 0.2, 0.0), folder) for case in benchmark.CASES}


def test_unit_truths_resolve_light_contacts(benchmark, scenes):
    """Unit: the step of a truth leaves a light contact the numerical damping ratio that it states, (h omega)^5/3600."""
    slow = scenes["2000 rpm, 4000 N"]
    plan = benchmark.true_plan(slow)
    assert (plan.longest_step * light_contact(slow).frequency) ** 5 / 3600.0 == pytest.approx(2e-6)
    assert plan.rtol == 1e-6 and benchmark.true_plan(scenes["example"]).longest_step == float("inf")


def test_invariant_shipped_truths_are_of_the_scenes(benchmark):
    """Invariant: each truth of the file beside the script is of one of its scenes and has every figure, of sixty cells at least."""
    kept = json.loads(benchmark.TRUTHS.read_text(encoding="utf-8"))
    names = {case.name for case in benchmark.CASES}
    assert {name.rpartition(", ")[0] for name in kept} <= names
    assert all(set(one["figures"]) == set(benchmark.JUDGED) for one in kept.values())
    assert sum(len(one["figures"]) for one in kept.values()) >= 60
