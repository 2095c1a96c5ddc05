"""What a shaft turn of catalogue bearings costs over that of the example, with and without tangential elasticity.

``python examples/benchmarks/catalogue_price.py`` simulates named and seeded scenes of ``rbdyn new`` both ways: as they are written, and
with ``traction.elasticity = false``, whose traction follows the steady law at once. Processor time of one thread; each way the
example runs first and last, and its mean turn is the unit. Slip, loss, impact and whirl stand with the difference of both ways in units of
their joint statistical error. ``--drawn N`` seeded scenes, ``--turns``, ``--replicates`` set the effort, ``--only`` picks named scenes.
``--studies`` adds the processor time of the study that ``doe new`` writes for each, over that of the example's: minutes a bearing.
"""

import argparse
import math
import resource
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np

from rbdyn import Scene, SimulationResult, simulate
from rbdyn.properties import table
from rbdyn.properties.catalogue import envelope, read_designation

EXAMPLE = Path(__file__).parents[1] / "cylindrical_roller.toml"
NAMED = {
    "NU 210, defaults": ("NU210",),
    "NU 210, 6000 rpm, 2 kN, VG 32": ("NU210", "--speed", "6000", "--load", "2000", "--oil", "ISO VG 32"),
    "NU 206, 9000 rpm, 1.5 kN, VG 32": ("NU206", "--speed", "9000", "--load", "1500", "--oil", "ISO VG 32"),
    "NU 320, defaults": ("NU320",),
}
WAYS = {"elastic": "true", "steady": "false"}
FIGURES = ("power_loss_W", "cage_slip", "impact_force_N", "whirl_deviation_ratio")
Row = list[str]


def drawn(count: int, seed: int) -> dict[str, tuple[str, ...]]:
    """Seeded scenes: listed sizes to 100 mm bore, 0.3 to 1 of their reference speed, 0.02 to 0.15 of C, three oils, 50 to 90 C."""
    draw = np.random.default_rng(seed)
    sizes = [
        row["size"] for row in table("cylindrical_rollers") if float(row["bore"]) <= 100.0 and row["reference_speed"]
    ]
    scenes: dict[str, tuple[str, ...]] = {}
    for size in draw.choice(sizes, count, replace=False):
        box = envelope(read_designation(f"NU{size}"))
        assert box.reference_speed is not None and box.dynamic_capacity is not None
        speed, load = draw.uniform(0.3, 1.0) * box.reference_speed, draw.uniform(0.02, 0.15) * box.dynamic_capacity
        oil, warm = draw.choice([32, 68, 150]), draw.uniform(50.0, 90.0)
        point = (
            "--speed",
            f"{speed:.0f}",
            "--load",
            f"{load:.0f}",
            "--oil",
            f"ISO VG {oil}",
            "--temperature",
            f"{warm:.0f}",
        )
        scenes[f"NU {size}, {speed:.0f} rpm, {load:.0f} N, VG {oil}, {warm:.0f} C"] = (f"NU{size}", *point)
    return scenes


def simulated(data: dict[str, object], turns: float, replicates: int, *keys: str) -> SimulationResult:
    """A scene, not lengthened, on one thread."""
    length = (
        f"turns={turns:g}",
        f"discard_turns={turns:g}",
        f"replicates={replicates}",
        f"impact_window_turns={turns:g}",
    )
    numbers = (f"numerics.{key}" for key in (*length, "extend=false", "companion=false"))
    return simulate(Scene.from_dict(data, "scene", [*numbers, *keys]), workers=1)


def study_s(scene: str) -> float:
    """Processor time [s] of the study of a scene as ``doe new`` writes it, on one thread."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.toml").write_text(scene, encoding="utf-8")
        new = ("new", str(folder / "scene.toml"), "--out", str(folder / "study.toml"))
        study = ("study", str(folder / "study.toml"), "--out", str(folder / "out"), "--workers", "1", "--quiet")
        subprocess.run([sys.executable, "-m", "doe", *new], check=True, capture_output=True)
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        # A study whose limits or parts are missed ends with another code.
        subprocess.run([sys.executable, "-m", "doe", *study], capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        if not (folder / "out" / "summary.json").exists():
            return math.nan
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def turn_ms(result: SimulationResult) -> float:
    """Processor time of a shaft turn [ms]."""
    return 1e3 * result.cost["cpu_s"] / result.cost["turns"]


def row_of(name: str, results: dict[str, SimulationResult], example_ms: float) -> Row:
    """Price of both ways, right-hand sides, and how far the figures of both ways are apart."""
    prices = [f"{turn_ms(result) / example_ms:.1f}" for result in results.values()]
    evaluations = [f"{result.cost['rhs_evaluations'] / result.cost['turns']:.0f}" for result in results.values()]
    methods = ["implicit" if result.cost["implicit_runs"] else "explicit" for result in results.values()]
    apart = []
    for figure in FIGURES:
        one, other = (result.quantities[figure] for result in results.values())
        scatter = math.hypot(one.statistical_error or 0.0, other.statistical_error or 0.0)
        apart.append(f"{(one.value - other.value) / scatter:+.1f}")
    gaps = [f"{100.0 * result.power_balance.relative_gap:.1g}" for result in results.values()]
    return [name, *prices, *evaluations, methods[1], *gaps, *apart]


def main(turns: float, replicates: int, count: int, seed: int, only: str | None, studies: bool) -> None:
    """Simulate and print the table."""
    example = tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))
    unit = turn_ms(simulated(example, 4.0 * turns, replicates))
    both, prices = {}, dict[str, list[str]]()
    study_unit = study_s(EXAMPLE.read_text(encoding="utf-8")) if studies else math.nan
    for name, words in (NAMED | drawn(count, seed)).items():
        if only is not None and only not in name:
            continue
        made = subprocess.run(
            [sys.executable, "-m", "rbdyn", "new", *words], check=True, capture_output=True, text=True
        )
        data = tomllib.loads(made.stdout)
        prices[name] = [f"{study_s(made.stdout) / study_unit:.1f}"] if studies else []
        both[name] = {way: simulated(data, turns, replicates, f"traction.elasticity={on}") for way, on in WAYS.items()}
    unit = 0.5 * (unit + turn_ms(simulated(example, 4.0 * turns, replicates)))
    rows = [[*row_of(name, results, unit), *prices[name]] for name, results in both.items()]
    header = ["bearing", "turn over the example's: elastic", "steady", "right-hand sides a turn: elastic", "steady", "steady by",
              "power gap %: elastic", "steady", "loss apart", "slip apart", "impact apart", "whirl apart", *(["a study over the example's"] if studies else [])]  # fmt: skip
    for row in (header, ["---"] * len(header), *rows):
        print(f"| {' | '.join(row)} |")
    print(
        f"\nA turn of the example takes {unit:.2f} ms of one thread; columns `apart` are differences over their joint 95 % error."
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--turns", type=float, default=8.0)
    parser.add_argument("--replicates", type=int, default=4)
    parser.add_argument("--drawn", type=int, default=10)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only")
    parser.add_argument("--studies", action="store_true")
    given = parser.parse_args()
    main(given.turns, given.replicates, given.drawn, given.seed, given.only, given.studies)
