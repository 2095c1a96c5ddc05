"""Chances and ranges over unknown inputs, by input sets that the tool did not choose.

``python examples/benchmarks/independent_sets.py STUDY.toml`` draws sets of all unknown inputs of the study's scene by numpy's
own generator through the laws' inverse distributions, simulates the baseline and the pick at each by ``rbdyn.simulate``, and
prints beside each other: in how many sets the pick is better, with Wilson's 95 % interval, and what ``doe study --robust``
states; which share of the sets lies within the 5 to 95 % ranges that ``doe uncertainty`` states. No plan, screening or emulator of
the tool is used for the sets. ``--tool-seeds 1,2`` asks the tool again with other seeds of its input sets; ``--pick x,y,z``
spares the study; ``--keep FILE.npz`` keeps the simulated sets for the next time.
"""

import argparse
import json
import math
import subprocess
import sys
import tomllib
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy import stats

import rbdyn
from rbdyn.scene.uncertain import Law, Uncertain
from rbdyn.scene.unknown import Input, inputs_of, value_of

OUTPUTS = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm")
# Every set is run as long as this, whatever the tool takes.
RUNS = ("turns=40", "discard_turns=20", "replicates=2", "extend=false", "companion=false")
Z = float(stats.norm.ppf(0.975))


def distribution(law: Law) -> Any:
    """The law of a number, as scipy has it."""
    low, high = law.low, law.high
    if law.law == "log_uniform":
        return stats.loguniform(low, high)
    if law.law == "triangular":
        return stats.triang((law.mode - low) / (high - low), low, high - low)
    if law.law == "normal":
        ends = (-np.inf if low is None else low, np.inf if high is None else high)
        return stats.truncnorm(*((end - law.mean) / law.sd for end in ends), law.mean, law.sd)
    return stats.uniform(low, high - low)


def draws(law: Law, count: int, random: np.random.Generator) -> list[Any]:
    """Values of a law."""
    if law.law == "choices":
        weights = np.array(law.weights or [1.0] * len(law.values))
        return [law.values[place] for place in random.choice(len(weights), count, p=weights / weights.sum())]
    return distribution(law).ppf(random.random(count)).tolist()


def scene_at(path: Path, inputs: Sequence[Input], row: Mapping[str, Any], more: Sequence[str]) -> rbdyn.Scene:
    """The scene at one set: plain values and multiples of them first, then multiples of what the scene has with these."""
    laws = {each.key: each.law for each in inputs}
    values = {key: row[key] for key, law in laws.items() if law.times is None}
    values |= {key: row[key] * values[law.times] for key, law in laws.items() if law.times in values}
    base = rbdyn.Scene.load(path, [*(f"{key}={value!r}" for key, value in values.items()), *more])
    values |= {key: row[key] * value_of(base, law.times) for key, law in laws.items() if key not in values}
    return rbdyn.Scene.load(path, [*(f"{key}={value!r}" for key, value in values.items()), *more])


def outputs_at(scenes: Sequence[rbdyn.Scene], workers: int) -> np.ndarray:
    """Outputs (n, m) of scenes; NaN of one that fails."""

    def one(scene: rbdyn.Scene) -> list[float]:
        try:
            record = rbdyn.simulate(scene, workers=1, notice=None).as_dict()
        except rbdyn.RunError:
            return [math.nan] * len(OUTPUTS)
        return [record[name]["value"] for name in OUTPUTS]

    first = one(scenes[0])
    with ThreadPoolExecutor(workers) as pool:
        return np.array([first, *pool.map(one, scenes[1:])])


def wilson(share: float, count: int) -> tuple[float, float]:
    """95 % interval of a share of independent sets (Wilson 1927)."""
    middle = (share + Z * Z / (2.0 * count)) / (1.0 + Z * Z / count)
    half = Z / (1.0 + Z * Z / count) * math.sqrt(share * (1.0 - share) / count + Z * Z / (4.0 * count * count))
    return middle - half, middle + half


def tool(*words: str) -> dict[str, Any]:
    """What a command of ``doe`` answers as JSON."""
    ended = subprocess.run([sys.executable, "-m", "doe", *words, "--json"], capture_output=True, text=True, check=False)
    if not ended.stdout.startswith("{"):
        raise SystemExit(f"doe {' '.join(words)}: {ended.stderr.strip()}")
    return dict(json.loads(ended.stdout))


def seeded(path: Path, seed: int, folder: Path) -> Path:
    """The study with another seed of its input sets, beside itself so that its paths hold."""
    text = path.read_text(encoding="utf-8")
    table = tomllib.loads(text)
    if "uncertain" in table:
        raise SystemExit(f"{path}: has a table [uncertain]; leave out --tool-seeds")
    other = path.parent / f".{path.stem}_{folder.name}_{seed}.toml"
    other.write_text(f"{text}\n[uncertain]\nseed = {seed}\n", encoding="utf-8")
    return other


def independent(
    path: Path, study: Mapping[str, Any], pick: Sequence[float], args: argparse.Namespace
) -> tuple[Any, Any]:
    """Outputs (n, m) of the baseline and of the pick at sets of all unknown inputs."""
    table = tomllib.loads(path.read_text(encoding="utf-8"))
    keys = [factor["key"] for factor in study["factor"]]
    scene = rbdyn.Scene.load(path)
    inputs = inputs_of(scene, table, scene.uncertain or Uncertain(), dict.fromkeys(keys, "a factor of the study"))
    random = np.random.default_rng(args.seed)
    columns = {each.key: draws(each.law, args.sets, random) for each in inputs}
    print(f"{args.sets} sets of {len(inputs)} unknown inputs, seed {args.seed}", flush=True)
    found = []
    for point in ([study["baseline"][factor["name"]] for factor in study["factor"]], pick):
        at = [f"{key}={value!r}" for key, value in zip(keys, point, strict=True)]
        scenes = [
            scene_at(
                path,
                inputs,
                {key: column[place] for key, column in columns.items()},
                [
                    *at,
                    *(f"numerics.{each}" for each in RUNS),
                    f"numerics.seed={900_000_000 + args.seed * 10_000 + place}",
                ],
            )
            for place in range(args.sets)
        ]
        found.append(outputs_at(scenes, args.workers))
    return tuple(found)


def main() -> None:
    """Simulate, ask the tool, compare."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("study", type=Path, nargs="?", default=Path("examples/clearance_study.toml"))
    options.add_argument("--sets", type=int, default=256)
    options.add_argument("--seed", type=int, default=20_261_123)
    options.add_argument("--tool-seeds", default="1")
    options.add_argument("--pick", default="")
    options.add_argument("--keep", type=Path)
    options.add_argument("--workers", type=int, default=1)
    args = options.parse_args()
    study = tomllib.loads(args.study.read_text(encoding="utf-8"))
    scene = args.study.parent / study["scene"]["file"]
    seeds = [int(each) for each in args.tool_seeds.split(",") if each]
    with TemporaryDirectory() as name:
        folder = Path(name)
        answers = {seed: asked(args.study, scene, seed, folder) for seed in seeds}
    factors = [factor["name"] for factor in study["factor"]]
    picks = [[answer[0]["pick"]["factors"][name] for name in factors] for answer in answers.values()]
    pick = [float(each) for each in args.pick.split(",")] if args.pick else picks[0]
    if args.keep and args.keep.exists():
        base, other = (np.load(args.keep)[name] for name in ("base", "pick"))
    else:
        base, other = independent(scene, study, pick, args)
        if args.keep:
            np.savez(args.keep, base=base, pick=other)
    compare(study, base, other, answers)


if __name__ == "__main__":
    main()
