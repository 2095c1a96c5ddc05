"""The house: imports run one way, few files lie loose, files and functions stay short."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]
SOURCES = [path for package in ("rbdyn", "doe") for path in (ROOT / package).rglob("*.py")]
LONGEST_FILE, LONGEST_FUNCTION, MOST_AT_THE_ROOT = 360, 70, 6


def test_invariant_no_circle_of_imports():
    """Invariant: no module imports itself through others, imports inside functions and for typing only counted."""
    graph = grimp.build_graph("rbdyn", "doe", cache_dir=None)
    below = {
        module: {
            imported
            for imported in graph.find_modules_directly_imported_by(module)
            if not module.startswith(f"{imported}.")  # a module may name its own package
        }
        for module in graph.modules
    }
    assert below["rbdyn.cli"] == {"rbdyn.cli.app", "rbdyn.cli.loading", "rbdyn.cli.streams"}, "lazy imports count"
    try:
        TopologicalSorter(below).prepare()
    except CycleError as error:
        pytest.fail(f"circle: {' -> '.join(error.args[1])}")


def test_invariant_files_and_functions_stay_short():
    """Invariant: no file above 360 lines, no function above 70, six files at the root of rbdyn."""
    long = []
    for path in SOURCES:
        text = path.read_text(encoding="utf-8")
        if text.count("\n") > LONGEST_FILE:
            long.append(f"{path.name}: {text.count(chr(10))} lines")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef) and node.end_lineno - node.lineno + 1 > LONGEST_FUNCTION:
                long.append(f"{path.name}: {node.name}")
    assert not long
    assert len(list((ROOT / "rbdyn").glob("*.py"))) <= MOST_AT_THE_ROOT
