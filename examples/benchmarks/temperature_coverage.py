"""Temperatures of a scene with a heat balance: how often their intervals hold the truth, and what the fixed point costs.

python examples/benchmarks/temperature_coverage.py SCENE.toml [--repeats 40] [--workers 2]

Each repeat has its own seed. The truth is the mean of one run with many replicates, long and at a tenth of the tolerance; its own
error is stated. The cost is in simulations of the scene without its heat balance, by shaft turns.
"""

import argparse
import math
from pathlib import Path

import numpy as np

from rbdyn import Scene, simulate
from rbdyn.result import SimulationResult

# Replicates and turns of the truth, in those of the scene, and its tolerance in that of the scene.
TRUER_REPLICATES, TRUER_TURNS, TRUER_TOLERANCE = 4, 4, 0.1


def truth_of(scene: Scene, workers: int | None) -> SimulationResult:
    """A run of the scene that is long and tight."""
    numerics = scene.numerics
    changes = {
        "numerics.replicates": TRUER_REPLICATES * numerics.replicates,
        "numerics.turns": TRUER_TURNS * numerics.turns,
        "numerics.rtol": TRUER_TOLERANCE * numerics.rtol,
        "numerics.companion": False,
        "numerics.seed": numerics.seed + 10_000,
    }
    return simulate(scene.changed(changes), workers, notice=None)


def usual_turns(scene: Scene) -> float:
    """Shaft turns of one simulation of the scene, companions included."""
    numerics = scene.numerics
    return (numerics.replicates + numerics.companions) * (numerics.warm_up_turns + numerics.turns)


def main() -> None:
    """Print the share of intervals that hold the truth, by node, and the cost."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", type=Path)
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    scene = Scene.load(options.scene)
    truth = truth_of(scene, options.workers)
    assert truth.temperatures_C is not None
    seeds = range(scene.numerics.seed, scene.numerics.seed + options.repeats)
    results = [simulate(scene.changed({"numerics.seed": seed}), options.workers, notice=None) for seed in seeds]
    print("node      truth [C]          mean [C]  scatter [K]  stated +- [K]  largest miss [K]  held")
    for node, exact in truth.temperatures_C.items():
        figures = [result.temperatures_C[node] for result in results if result.temperatures_C is not None]
        values = np.array([figure.value for figure in figures])
        errors = np.array([figure.error for figure in figures], dtype=float)
        held = np.mean(np.abs(values - exact.value) <= np.hypot(errors, exact.error or 0.0))
        print(
            f"{node:8} {exact.value:9.3f} +- {exact.error or math.nan:.3f} {values.mean():9.3f} {values.std(ddof=1):12.3f} "
            f"{np.median(errors):14.3f} {np.abs(values - exact.value).max():17.3f} {held:5.3f}"
        )
    turns = np.array([result.cost["balance_turns"] for result in results]) / usual_turns(scene)
    print(f"cost: {turns.mean():.2f} (at most {turns.max():.2f}) simulations of the usual length, all states included")


if __name__ == "__main__":
    main()
