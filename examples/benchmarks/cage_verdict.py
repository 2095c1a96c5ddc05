"""Class of the cage at default numerics against runs of sixteen times the length, on seeded bearings of `rbdyn new`.

python examples/benchmarks/cage_verdict.py [--seeds N] [--times N] [--moving]: about half an hour for ten bearings on two cores. A bearing
is in the catalogue or on a drawing, guided by a ring or its rollers, at 0.5 to 2 times the speed and 0.02 to 1 times the load that the
command takes by default. With `--moving` it is the example's bearing at 0.5 to 1 times its speed, and no static load holds the cage. Odd
seeds have preloaded rollers that guide it, with pocket friction of 0.03 to 0.4, even seeds a load that rotates with the shaft. A row
states both classes with their replicates, and whether classes that are named agree.

Seeds 1 to 10: held in both in all ten, none undecided; 95 to 194 s of processor time each for the long runs of the last six. With
`--moving`, circling in both in eight; two are undecided in both, since the start decides between circling and fast whirl (pocket
friction of 0.182 and 0.337: fast whirl in 3 and 5 of 8 replicates, in 2 and 4 of 6 long ones).
"""

import argparse
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np

import rbdyn
from rbdyn.scene import Scene

EXAMPLE = Path(__file__).resolve().parents[1] / "cylindrical_roller.toml"
DESIGNATIONS = ("NU206", "NU210", "NU308", "NU1014", "NU2311", "N215")
OILS = ("ISO VG 22", "ISO VG 68", "ISO VG 220")
# Classes that state no class of a bearing.
OPEN = ("undecided", "not judged")
# As few as can name a class.
LONG_REPLICATES = 6


def seeded(seed: int) -> tuple[str, Scene]:
    """A bearing in words, and its scene at a speed and a load of its own."""
    draw = np.random.default_rng(seed)
    guidance, oil = str(draw.choice(["outer", "inner", "roller"])), str(draw.choice(OILS))
    if seed % 2:
        arguments = [str(draw.choice(DESIGNATIONS))]
    else:
        size, rollers = int(draw.choice([7, 9, 12])), int(draw.integers(11, 18))
        pitch = 1.25 * size * rollers / np.pi
        arguments = ["own", "--rollers", str(rollers), "--roller", f"{size}x{size}", "--pitch", f"{pitch:.0f}"]
    new = subprocess.run(
        [sys.executable, "-m", "rbdyn", "new", *arguments, "--guidance", guidance, "--oil", oil],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    scene = Scene.from_dict(tomllib.loads(new.stdout))
    speed = scene.operation.inner_speed_rpm * float(np.exp(draw.uniform(np.log(0.5), np.log(2.0))))
    load = scene.operation.radial_load_N * float(np.exp(draw.uniform(np.log(0.02), 0.0)))
    scene = scene.overridden([f"operation.inner_speed_rpm={speed:.4g}", f"operation.radial_load_N={load:.4g}"])
    return f"{arguments[0]}, {guidance}, {oil}, {speed:.4g} rpm, {load:.4g} N", scene


def moving(seed: int) -> tuple[str, Scene]:
    """The example's bearing without the static load that holds its cage, in words and as a scene."""
    draw = np.random.default_rng((seed, 1))
    scene = Scene.load(EXAMPLE)
    speed, load = (value * float(draw.uniform(0.5, 1.0)) for value in (24_000.0, 1300.0))
    words, changes = f"{speed:.0f} rpm", {"operation.inner_speed_rpm": f"{speed:.0f}", "operation.radial_load_N": 0}
    if seed % 2:
        friction = float(np.exp(draw.uniform(np.log(0.03), np.log(0.4))))
        changes |= {
            "cage.guidance": "roller",
            "bearing.radial_clearance_mm": -0.01,
            "model.pocket_friction": f"{friction:.3g}",
        }
        words += f", cage on preloaded rollers, pocket friction {friction:.3g}"
    else:
        friction = float(draw.choice([0.05, 0.1, 0.3]))
        changes |= {
            "operation.rotating_load_N": f"{load:.4g}",
            "model.guide_land": "dry",
            "model.land_friction": friction,
        }
        words += f", {load:.4g} N rotate, dry land with friction {friction:g}"
    return words, scene.overridden([f"{key}={value}" for key, value in changes.items()])


def judged(scene: Scene) -> tuple[str, str, float]:
    """Class, the verdict in words, and the time it took [s]."""
    started = time.perf_counter()
    found = rbdyn.simulate(scene, notice=None).verdict
    assert found is not None
    return found.name, found.words, time.perf_counter() - started


def main(seeds: int, times: int, without_static_load: bool) -> None:
    """Print a row a bearing, and the counts."""
    counts = {"agree": 0, "differ": 0, "open": 0}
    for seed in range(1, seeds + 1):
        words, scene = moving(seed) if without_static_load else seeded(seed)
        turns = times * scene.numerics.turns
        long = scene.overridden(
            [
                f"numerics.turns={turns:g}",
                f"numerics.replicates={LONG_REPLICATES}",
                "numerics.extend=false",
                "numerics.companion=false",
            ]
        )
        short_class, short_words, short_s = judged(scene)
        long_class, long_words, long_s = judged(long)
        kind = "open" if {short_class, long_class} & set(OPEN) else "agree" if short_class == long_class else "differ"
        counts[kind] += 1
        print(
            f"{seed}: {words}\n   default {short_words} [{short_s:.0f} s]\n   {times} x {long_words} [{long_s:.0f} s]",
            flush=True,
        )
    print(", ".join(f"{count} {kind}" for kind, count in counts.items()))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--times", type=int, default=16)
    parser.add_argument("--moving", action="store_true", help="cages that no static load holds")
    options = parser.parse_args()
    main(options.seeds, options.times, options.moving)
