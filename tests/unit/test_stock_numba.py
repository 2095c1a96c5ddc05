"""numba changes its inner parts from release to release: what compiles kernels without them, and that the bits are the same."""

import logging
import sys

import numba
import numba.core.codegen
import numba.core.compiler
import numba.core.datamodel.manager
import numpy as np
import pytest
from cached_entries import line
from conftest import EXAMPLE, ROOT, SHORT
from stock_numba import by_stock

import rbdyn.compiled
from rbdyn.compiled import kernel, parts

# One body of each kind of function, compiled by the program below and here.
PROGRAM = """
import json, sys
from small_kernels import answers
from rbdyn.compiled.kernel import compiler_notes
print(json.dumps({"notes": compiler_notes(), "answers": answers()}))
"""


@pytest.fixture
def anew(monkeypatch, tmp_path):
    """``anew()``: look for working parts as a first process does."""
    monkeypatch.setattr(kernel, "cache_folder", lambda: tmp_path / "cache")

    def look():
        monkeypatch.delitem(sys.modules, "rbdyn.compiled.parts", raising=False)
        monkeypatch.delattr(rbdyn.compiled, "parts", raising=False)
        return kernel.working_parts()

    return look


def test_unit_this_numba_has_what_parts_need():
    """Unit: with the numba that is installed kernels are compiled from its parts, and nothing is noted."""
    assert kernel.OWN_COMPILER is parts and kernel.WHY_STOCK == "" and kernel.compiler_notes() == ()


@pytest.mark.parametrize(
    ("owner", "name", "error"),
    [
        (numba.core.codegen, "JITCodeLibrary", "ImportError"),
        (numba.core.datamodel.manager.DataModelManager, "chain", "AttributeError"),
        (numba.core.types.Integer, "from_bitwidth", "AttributeError"),
    ],
)
def test_unit_a_name_that_numba_lost_is_stated(anew, monkeypatch, owner, name, error):
    """Unit: a name lost at import, in the body of a class or while compiling: stock numba, and one sentence of why."""
    monkeypatch.delattr(owner, name)
    found, why = anew()
    assert found is None and why.startswith(error) and name in why and why.isprintable()
    monkeypatch.setattr(kernel, "WHY_STOCK", why)
    (note,) = kernel.compiler_notes()
    assert numba.__version__ in note and name in note


def test_unit_a_wrong_answer_of_the_self_test_is_stated(anew, monkeypatch):
    """Unit: parts that compile, and compile wrongly, are not taken."""
    monkeypatch.setattr(np, "array_equal", lambda one, other: False)
    found, why = anew()
    assert found is None and "self-test" in why


def test_unit_the_self_test_runs_once(anew, monkeypatch, tmp_path):
    """Unit: a self-test that passed is not run again with the same versions and code; one that failed is."""
    calls = []

    def self_test():
        calls.append(1)
        if len(calls) == 1:
            raise RuntimeError("first")

    with pytest.raises(RuntimeError, match="first"):
        kernel._test_once(self_test)
    for _ in range(3):
        kernel._test_once(self_test)
    assert len(calls) == 2


def test_unit_nothing_of_numba_is_replaced():
    """Unit: an index that counts from the end works in functions of other packages, compiled after ours."""

    @numba.njit
    def last(values):
        return values[-1]

    assert last(np.array([1.0, 2.0])) == 2.0
    assert numba.np.arrayobj.fix_integer_index.__module__ == "numba.np.arrayobj"


@pytest.mark.parametrize("name", ["_reduce", "_rebuild"])
def test_unit_a_cache_that_numba_cannot_serve_is_stated(tmp_path, monkeypatch, caplog, name):
    """Unit: where results of the compiler cannot be written down entries compile anew, and one warning says so."""
    kernel.warn_once.cache_clear()
    monkeypatch.delattr(numba.core.compiler.CompileResult, name)
    monkeypatch.setattr(kernel, "cache_folder", lambda: tmp_path / "cache")
    with caplog.at_level(logging.WARNING, "rbdyn"):
        assert [kernel.entry(line)(x) for x in (0.5, 7)] == [2.5, 22]
    (sentence,) = caplog.messages
    assert name in sentence and numba.__version__ in sentence and not (tmp_path / "cache").exists()


@pytest.mark.slow
def test_unit_both_ways_give_the_same_bits():
    """Unit: laws, choices, settled sums and every elementary function, by parts here and by stock numba in another process."""
    from small_kernels import answers

    stock = by_stock("-c", PROGRAM, RBDYN_STOCK_NUMBA="1")
    assert "RBDYN_STOCK_NUMBA" in stock["notes"][0]
    assert stock["answers"] == answers()


@pytest.mark.parametrize(
    "arguments",
    [
        ("ball", ROOT / "examples" / "angular_contact_ball.toml"),
        ("simulate", EXAMPLE, *(part for assignment in SHORT for part in ("--set", assignment))),
    ],
)
def test_unit_verbosely_a_command_names_the_compiler(command, monkeypatch, arguments):
    """Unit: one note with ``-v`` where stock numba compiles, none without it, none where it does not."""
    monkeypatch.setattr(kernel, "WHY_STOCK", "ImportError: a name")
    for options, notes in (((), 0), (("-v",), 1)):
        assert command(*arguments, *options).stdout.count("stock numba") == notes
    monkeypatch.setattr(kernel, "WHY_STOCK", "")
    assert "stock numba" not in command(*arguments, "-v").stdout
