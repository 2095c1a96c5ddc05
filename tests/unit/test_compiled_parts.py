"""How kernels are compiled into what Python calls."""

import os
import subprocess
import sys
from typing import Any, NamedTuple

import numpy as np
import pytest
from conftest import ROOT
from numba import types
from numpy.typing import NDArray

from rbdyn.compiled.kernel import entry, kernel, routine


class Nothing(NamedTuple):
    """A law without parameters."""


class Pair(NamedTuple):
    """Of one type."""

    low: float
    high: float


class Nest(NamedTuple):
    """Of many."""

    pair: Pair
    nothing: Nothing
    on: bool
    terms: int
    values: NDArray[np.float64]


@routine
def longer(nest: Any, x: Any) -> Any:
    """Called from two places."""
    total = nest.pair.high * x if nest.on else nest.pair.low
    for i in range(nest.terms):
        total += nest.values[i]
    return Pair(total, x)


@kernel
def small(nest: Any, x: Any) -> Any:
    """The first of them."""
    return longer(nest, 2.0 * x)


@entry
def whole(nest: Any, x: Any) -> Any:
    """The second."""
    first, second = small(nest, x), longer(nest, first_of(nest))
    return Nest(Pair(first.low, second.low), nest.nothing, not nest.on, nest.terms, nest.values)


@kernel
def first_of(nest: Any) -> Any:
    """A number out of the nest."""
    return nest.values[0]


def test_unit_named_tuples_come_through_whole() -> None:
    values = np.array([0.25, 1.5, -4.0])
    for on in (True, False):
        given = Nest(Pair(3.0, 7.0), Nothing(), on, 2, values)
        pair, nothing, off, terms, same = whole(given, 0.5)
        first, second = (7.0, 1.75) if on else (3.0, 3.0)
        assert pair == (first + 1.75, second + 1.75)
        assert (nothing, off, terms) == ((), not on, 2) and np.array_equal(same, values)


def test_unit_a_routine_is_called_where_a_kernel_is_copied() -> None:
    # Whatever compiled it first: options that are not set are those of the caller.
    @routine
    def apart(x: float) -> float:
        return x + 1.0

    @kernel
    def around(x: float) -> float:
        return 2.0 * apart(x)

    around.compile((types.float64,))
    assert [next(iter(each.overloads.values())).fndesc.inline for each in (apart, around)] == [False, True]


COUNTING_FUNCTIONS = r"""
import re, sys
import rbdyn
from rbdyn.dynamics.integrators.advance import advance

short = ["numerics.turns=1", "numerics.discard_turns=0", "numerics.extend=false", "numerics.replicates=1"]
rbdyn.simulate(sys.argv[1], overrides=[*short, *sys.argv[2:]], notice=None)
(compiled,) = advance.overloads.values()
for function in re.split(r"^define ", compiled.library.get_llvm_str(), flags=re.M)[1:]:
    if "call void @NRT_incref" in function:
        print(*re.findall(r"\d+([a-z_]+)B\d+v\d+", function.partition("{")[0])[:1])
"""


@pytest.mark.slow
@pytest.mark.parametrize("overrides", [[], ["traction.model=thermal_newtonian", "model.open_contact_film=true"]])
def test_invariant_no_step_counts_references(tmp_path, overrides):
    """Invariant: atomic instructions count references to arrays at the call of ``advance``, and where it creates arrays; they
    took a tenth of a scene with tables."""
    scene = ROOT / "examples" / "cylindrical_roller.toml"
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    ran = subprocess.run(
        [sys.executable, "-c", COUNTING_FUNCTIONS, scene, *overrides], env=environment, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    assert set(ran.stdout.split()) == {"advance", "refine_peak"}
