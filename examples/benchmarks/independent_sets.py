"""Chances and ranges over unknown inputs, by input sets that the tool did not choose.

``python examples/benchmarks/independent_sets.py STUDY.toml --pick X,Y,Z`` draws sets of all unknown inputs of the study's scene
by numpy's own generator through the laws' inverse distributions, simulates the baseline and the pick at each by
``rbdyn.simulate``, and prints next to each other: in how many of them the pick is better, with Wilson's 95 % interval, and what
the judgement of ``doe study --robust`` states; which share of the sets lies within the 5 to 95 % ranges that ``doe uncertainty``
states. No plan, screening or emulator of the tool chooses the sets. The scene's own values must be the baseline's.

``--tool-seeds 1,2`` asks the tool once a seed of its input sets; ``--out DIR`` keeps the sets and the tool's runs, from which an
interrupted comparison goes on.
"""

import argparse
import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from scipy import stats

import rbdyn
from doe.clearance import Simulations
from doe.running.store import Store
from doe.workflow.problem import Problem
from doe.workflow.robust import Robust, judge
from doe.workflow.uncertainty import OUTPUTS, Uncertainty, find_uncertainty
from rbdyn.scene.uncertain import Uncertain
from rbdyn.scene.unknown import Input, inputs_of, value_of

# Every set is run as long as this, whatever the tool takes.
RUNS = ("turns=40", "discard_turns=20", "replicates=2", "extend=false", "companion=false")
Z = float(stats.norm.ppf(0.975))
SEEDS = 900_000_000


def distribution(law: Any) -> Any:
    """The law of a number, as scipy has it."""
    low, high = law.low, law.high
    if law.law == "log_uniform":
        return stats.loguniform(low, high)
    if law.law == "normal":
        ends = (-np.inf if low is None else low, np.inf if high is None else high)
        return stats.truncnorm(*((end - law.mean) / law.sd for end in ends), law.mean, law.sd)
    return stats.uniform(low, high - low)


def draws(law: Any, count: int, random: np.random.Generator) -> list[Any]:
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
    values |= {
        key: row[key] * value_of(base, law.times) for key, law in laws.items() if law.times and key not in values
    }
    return rbdyn.Scene.load(path, [*(f"{key}={value!r}" for key, value in values.items()), *more])


def columns_of(study: Problem) -> list[str]:
    """Outputs of every scene, and other responses of the study."""
    return list(dict.fromkeys([*OUTPUTS, *study.responses]))


def outputs_at(scenes: Sequence[rbdyn.Scene], names: Sequence[str], workers: int) -> np.ndarray:
    """Outputs (n, m) of scenes; NaN of one that fails."""

    def one(scene: rbdyn.Scene) -> list[float]:
        try:
            found = rbdyn.simulate(scene, workers=1, notice=None).responses
        except rbdyn.RunError:
            return [math.nan] * len(names)
        return [found[name].value for name in names]

    first = one(scenes[0])  # compiles
    with ThreadPoolExecutor(workers) as pool:
        return np.array([first, *pool.map(one, scenes[1:])])


def wilson(share: float, count: int) -> tuple[float, float]:
    """95 % interval of a share of independent sets (Wilson 1927)."""
    middle = (share + Z * Z / (2.0 * count)) / (1.0 + Z * Z / count)
    half = Z / (1.0 + Z * Z / count) * math.sqrt(share * (1.0 - share) / count + Z * Z / (4.0 * count * count))
    return middle - half, middle + half


def independent(
    study: Problem, pick: Sequence[float], sets: int, seed: int, workers: int
) -> tuple[np.ndarray, np.ndarray]:
    """Outputs (n, m) of the baseline and of the pick at sets of all unknown inputs."""
    path = study.path_of(study.scene.file)
    scene, table = rbdyn.Scene.load(path), tomllib.loads(path.read_text(encoding="utf-8"))
    keys = [factor.key for factor in study.file.factor]
    inputs = inputs_of(scene, table, scene.uncertain or Uncertain(), dict.fromkeys(keys, "a factor"))
    random = np.random.default_rng(seed)
    columns = {each.key: draws(each.law, sets, random) for each in inputs}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    found = []
    for point in (study.baseline.tolist(), pick):
        at = [f"{key}={value!r}" for key, value in zip(keys, point, strict=True)]
        at += [f"numerics.{each}" for each in RUNS]
        seeds = (f"numerics.seed={SEEDS + 10_000 * seed + place}" for place in range(sets))
        scenes = [scene_at(path, inputs, row, [*at, own]) for row, own in zip(rows, seeds, strict=True)]
        found.append(outputs_at(scenes, columns_of(study), workers))
    return found[0], found[1]


def answers(study: Problem, pick: Sequence[float], seed: int, out: Path, workers: int) -> tuple[Robust, Uncertainty]:
    """What the tool states, with the seed of its input sets."""
    path = study.path_of(study.scene.file)
    declared = study.file.uncertain or rbdyn.Scene.load(path).uncertain or Uncertain()
    robust = study.file.robust.model_copy(update={"front": "none"})
    file = study.file.model_copy(update={"uncertain": declared.model_copy(update={"seed": seed}), "robust": robust})
    with Store(out / "runs.sqlite") as store:
        simulations = Simulations(store, workers, None, False, lambda title: lambda done, total: None)
        judged = judge(replace(study, file=file), np.array(pick), simulations)
        return judged, find_uncertainty(path, [f"uncertain.seed={seed}"], simulations)


def chances(study: Problem, base: np.ndarray, pick: np.ndarray, tool: Mapping[int, Robust]) -> Iterator[str]:
    """A line a response: in which share of the sets the pick is better, and what the tool states."""
    names = list(next(iter(tool.values())).chances.gains)
    goals = {each.name: each.goal for each in study.file.response}
    side = [1.0 if goals[name] == "max" else -1.0 for name in names]
    columns = [columns_of(study).index(name) for name in names]
    wins = (pick - base)[:, columns] * side > 0.0
    stated = {seed: [*each.chances.gains.values(), each.chances.all] for seed, each in tool.items()}
    for place, name in enumerate([*names, "all"]):
        won = wins.all(axis=1) if place == len(names) else wins[:, place]
        parts = [f"{name:24}", _chance(float(won.mean()), *wilson(float(won.mean()), len(won)))]
        yield "  ".join([*parts, *(_chance(*shares[place]) for shares in stated.values())])


def ranges(base: np.ndarray, tool: Mapping[int, Uncertainty]) -> Iterator[str]:
    """A line an output: the range of the sets, and of the tool the range and which share of the sets it holds."""
    for place, name in enumerate(OUTPUTS):
        values = base[:, place]
        low, high = np.quantile(values, [0.05, 0.95])
        parts = [f"{name:24}", f"{low:.4g} to {high:.4g}"]
        for each in tool.values():
            stated = each.responses[name].input
            within = float(((values >= stated.low) & (values <= stated.high)).mean())
            parts.append(f"{stated.low:.4g} to {stated.high:.4g} holds {within:.3f}")
        yield "  ".join(parts)


def _chance(share: float, low: float, high: float) -> str:
    return f"{100.0 * share:5.1f} ({100.0 * low:.1f} to {100.0 * high:.1f})"


def compare(args: argparse.Namespace, out: Path) -> None:
    """The independent sets, the tool's answers, and both next to each other."""
    study, pick, workers = Problem.load(args.study), [float(each) for each in args.pick.split(",")], args.workers
    path = out / f"sets_{args.sets}_{args.seed}.npz"
    if not path.exists():
        base, other = independent(study, pick, args.sets, args.seed, workers)
        np.savez(path, base=base, pick=other)
    with np.load(path) as kept:
        base, other = kept["base"], kept["pick"]
    whole = np.isfinite(base).all(axis=1) & np.isfinite(other).all(axis=1)
    base, other = base[whole], other[whole]
    seeds = [int(each) for each in args.tool_seeds.split(",")]
    tool = {seed: answers(study, pick, seed, out, workers) for seed in seeds}
    columns = ", ".join(f"the tool with seed {seed}" for seed in seeds)
    print(f"{len(base)} independent sets, {len(whole) - len(base)} failed; columns: these sets, {columns}")
    print("pick better in % of the sets (95 % interval)")
    print("\n".join(chances(study, base, other, {seed: each[0] for seed, each in tool.items()})))
    print("5 to 95 % of the sets, and which share of them the tool's 90 % range holds")
    print("\n".join(ranges(base, {seed: each[1] for seed, each in tool.items()})))


def main() -> None:
    """Simulate, ask the tool, compare."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("study", type=Path)
    options.add_argument("--pick", required=True, help="values of the factors, with commas")
    options.add_argument("--sets", type=int, default=256)
    options.add_argument("--seed", type=int, default=1, help="of the independent sets")
    options.add_argument("--tool-seeds", default="1", help="seeds of the tool's own sets, with commas")
    options.add_argument(
        "--out", type=Path, help="folder of the sets and of the tool's runs; none is kept unless given"
    )
    options.add_argument("--workers", type=int, default=2)
    args = options.parse_args()
    if args.out:
        args.out.mkdir(parents=True, exist_ok=True)
        compare(args, args.out)
    else:
        with TemporaryDirectory() as folder:
            compare(args, Path(folder))


if __name__ == "__main__":
    main()
