"""How often the stated 95 % intervals of figures of damage contain the truth.

    python examples/benchmarks/damage_coverage.py SCENE.toml ... [--repeats 40] [--set KEY=VALUE ...]

Each scene runs ``--repeats`` times with other seeds. The truth is one run of ten times the replicates at a hundredth of the tolerance,
whose own error counts too: at a tenth the longer steps of rk45 show peaks between their ends less well. A row states the share of intervals that contain it, the mean half-width and the bias of the runs.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import rbdyn
from rbdyn.dynamics.figures import DAMAGE
from rbdyn.result import Quantity
from rbdyn.scene import Scene

TRUTH_SEED, TRUTH_TIMES = 987_654, 10


def errors_of(quantity: Quantity) -> float:
    """Half-width of statistical and numerical error together."""
    return math.hypot(quantity.statistical_error or 0.0, quantity.numerical_error or 0.0)


def rows_of(path: Path, repeats: int, sets: list[str]) -> list[str]:
    """A row for each figure that every run has."""
    numerics = Scene.load(path, sets).numerics
    truth_sets = [
        f"numerics.replicates={TRUTH_TIMES * numerics.replicates}",
        f"numerics.rtol={0.01 * numerics.rtol!r}",
        f"numerics.seed={TRUTH_SEED}",
        "numerics.companion=false",
    ]
    truth = rbdyn.simulate(path, notice=None, overrides=[*sets, *truth_sets]).damage or {}
    runs = [
        rbdyn.simulate(path, notice=None, overrides=[*sets, f"numerics.seed={5000 + 37 * number}"]).damage or {}
        for number in range(repeats)
    ]
    rows = []
    for key in (figure.key for figure in DAMAGE):
        found = [run[key] for run in runs if key in run]
        if key not in truth or len(found) < repeats:
            rows.append(f"{path.stem:16}{key:28}{'in ' + str(len(found)) + ' runs':>12}")
            continue
        exact, doubt = truth[key].value, errors_of(truth[key])
        held = sum(abs(one.value - exact) <= math.hypot(errors_of(one), doubt) for one in found)
        half = sum(map(errors_of, found)) / repeats
        bias = sum(one.value for one in found) / repeats - exact
        rows.append(f"{path.stem:16}{key:28}{held / repeats:12.3f}{exact:12.4g}{half:12.3g}{bias:+12.3g}")
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="+", type=Path)
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--set", action="append", default=[], dest="sets")
    asked = parser.parse_args()
    print(f"{'scene':16}{'figure':28}{'coverage':>12}{'truth':>12}{'half-width':>12}{'bias':>12}")
    for path in asked.scenes:
        print("\n".join(rows_of(path, asked.repeats, asked.sets)), flush=True)


if __name__ == "__main__":
    main()
