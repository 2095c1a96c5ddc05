"""Cases of ``tests/golden`` where numba lacks a name that ``rbdyn.compiled.parts`` needs: their numbers by stock numba.

``by_stock`` runs this file in a process of its own, with the names of the cases. Standard output: JSON with the notes on the
compiler and the numbers of each case.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

TESTS = Path(__file__).parents[1]


def by_stock(*arguments: str, **environment: str) -> Any:
    """The JSON that a Python process of its own prints."""
    path = os.pathsep.join(
        map(str, (TESTS.parent, TESTS, *(TESTS / name for name in ("golden", "helpers", "oracles"))))
    )
    found = subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, check=False,
        env={**os.environ, **environment, "PYTHONPATH": path},
    )  # fmt: skip
    assert found.returncode == 0, found.stderr
    return json.loads(found.stdout)


def print_cases(*cases: str) -> None:
    """Print the numbers of golden cases, compiled by a numba that lost a name."""
    import numba.core.codegen

    del numba.core.codegen.JITCodeLibrary

    from regenerate import computed

    from rbdyn.compiled.kernel import compiler_notes

    print(json.dumps({"notes": compiler_notes(), "cases": {case: computed(case) for case in cases}}))


if __name__ == "__main__":
    print_cases(*sys.argv[1:])
