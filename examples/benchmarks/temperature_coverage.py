"""Temperatures of scenes with a heat balance: how often their intervals hold the truth, and what the fixed point costs.

python examples/benchmarks/temperature_coverage.py [--only WORD] [--repeats 40] [--workers 2]

Variants of examples/hot_roller.toml, each repeated with other seeds. The truth is one run of four times the replicates and turns at
a tenth of the tolerance, whose own error counts in the comparison. The cost is in simulations of the usual length without a heat balance, by shaft turns.
"""

import argparse
from pathlib import Path

import numpy as np

from rbdyn import Scene, simulate
from rbdyn.base.words import with_error
from rbdyn.result import SimulationResult

SCENE = Path(__file__).parents[1] / "hot_roller.toml"
# Keys of each variant by its name.
VARIANTS: dict[str, dict[str, float]] = {
    "as it is": {},
    "half the speed": {"operation.inner_speed_rpm": 12000.0},
    "three times the load": {"operation.radial_load_N": 3900.0},
    "tight": {"bearing.radial_clearance_mm": 0.012, "cage.guide_clearance_mm": 0.1, "cage.pocket_clearance_mm": 0.2},
    "little oil": {"lubricant.oil_flow_l_min": 0.2},
}
# Replicates and turns of the truth, and its tolerance, in those of the scene.
TRUER, TIGHTER = 4, 0.1


def truth_of(scene: Scene, workers: int | None) -> SimulationResult:
    """A run of the scene that is long and tight."""
    numerics = scene.numerics
    changes = {
        "numerics.replicates": TRUER * numerics.replicates,
        "numerics.turns": TRUER * numerics.turns,
        "numerics.rtol": TIGHTER * numerics.rtol,
        "numerics.companion": False,
        "numerics.seed": numerics.seed + 10_000,
    }
    return simulate(scene.changed(changes), workers, notice=None)


def usual_turns(scene: Scene) -> float:
    """Shaft turns of one simulation of the scene, companions included."""
    numerics = scene.numerics
    return (numerics.replicates + numerics.companions) * (numerics.warm_up_turns + numerics.turns)


def main() -> None:
    """Print a row a variant and node, and the share of all intervals that hold the truth."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", default="")
    parser.add_argument("--repeats", type=int, default=40)
    parser.add_argument("--workers", type=int)
    options = parser.parse_args()
    print("| variant | node | truth °C | mean °C | scatter K | stated K | held | most simulations |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    shares = []
    for name, keys in VARIANTS.items():
        if options.only not in name:
            continue
        scene = Scene.load(SCENE).changed(keys)
        truth = truth_of(scene, options.workers)
        seeds = range(scene.numerics.seed, scene.numerics.seed + options.repeats)
        results = [simulate(scene.changed({"numerics.seed": seed}), options.workers, notice=None) for seed in seeds]
        cost = max(result.cost["turns"] for result in results) / usual_turns(scene)
        assert truth.temperatures_C is not None
        for node, exact in truth.temperatures_C.items():
            figures = [result.temperatures_C[node] for result in results if result.temperatures_C is not None]
            values = np.array([figure.value for figure in figures])
            errors = np.array([figure.error for figure in figures], dtype=float)
            holds = np.abs(values - exact.value) <= np.hypot(errors, exact.error or 0.0)
            shares.append(holds.mean())
            print(
                f"| {name} | {node} | {with_error(exact.value, exact.error)} | {values.mean():.3f} "
                f"| {values.std(ddof=1):.4f} | {np.median(errors):.4f} | {holds.mean():.3f} | {cost:.2f} |",
                flush=True,
            )
    print(f"\nAll: {np.mean(shares):.3f} of the intervals hold the truth.")


if __name__ == "__main__":
    main()
