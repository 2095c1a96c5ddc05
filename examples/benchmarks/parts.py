"""The share of parts that keep the gains: as a study states it, and of parts drawn from its tolerances and simulated.

``python examples/benchmarks/parts.py STUDY.toml --out DIR`` takes the pick and the tolerances of a study that was finished in
DIR (``doe study STUDY.toml --out DIR``), draws ``--parts`` parts with a fixed seed, simulates each with ``--replicates``
replicates, and counts those that keep what the tolerances promise: the least of every gain that counts, over the simulated
baseline, and all limits. The interval of the count is Wilson's. Runs are kept in DIR.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from doe import clearance
from doe.clearance import Simulations
from doe.pareto.manufacture import Interval, percent, random_offsets
from doe.running.store import Failure, Store
from doe.unknown.decision import wilson
from doe.workflow.problem import Problem

# Seeds that no run of a study has.
SEEDS = 7_000_000


def main(path: Path, folder: Path, parts: int, replicates: int, workers: int | None) -> None:
    """Simulate parts, and print what was stated beside what was found."""
    study, record = Problem.load(path), json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    settings, goals, tolerances = study.file.tolerances, study.goals, record["tolerances"]
    if settings is None:
        raise SystemExit(f"{path}: has no [tolerances]; add that table")
    half = np.array([tolerances[name]["half_width"] if name in tolerances else 0.0 for name in study.factors])
    pick = np.array([record["pick"][name] for name in study.factors])
    made = pick + half * random_offsets(parts, half.size, settings.distribution, SEEDS)
    promised = [record["tolerances_gains"][study.responses[index]]["at_least_percent"] for index in goals.objectives]
    simulated = record["confirmation"]["baseline"]["responses"]
    levels = np.array([simulated[name]["value"] for name in study.responses])
    least = np.array([-np.inf if each is None else 0.01 * each for each in promised]) * abs(levels[goals.objectives])
    effort = [f"numerics.replicates={replicates}", "numerics.companion=false"]
    scenes = [study.scene_at(each, SEEDS + number, effort) for number, each in enumerate(made)]
    with Store(folder / "parts.sqlite", path.stem) as store:
        simulations = Simulations(store, workers, None, False, lambda title: lambda done, total: None)
        results = simulations.run(scenes, [f"part {number + 1}" for number in range(parts)], lambda done, total: None)
    sound = [result for result in results if not isinstance(result, Failure)]
    values = clearance.figures(study.responses, sound)[0]
    margin = goals.costs(levels) - least - goals.costs(values)
    kept = (margin >= 0.0) & (goals.violations(values, values) <= 0.0).all(axis=1, keepdims=True)
    share = next(iter(tolerances.values()))
    print(f"stated: {percent(share['probability'])} % ({Interval(*share['interval']).words}) of the parts")
    count = int(kept.all(axis=1).sum())
    found = Interval(*wilson(count / len(sound), len(sound)))
    print(f"simulated: {count} of {len(sound)}, {percent(count / len(sound))} % ({found.words})")
    for column, index in enumerate(goals.objectives):
        if promised[column] is not None:
            lost = int((margin[:, column] < 0.0).sum())
            print(f"  {study.responses[index]}: {lost} below the least gain, {promised[column]:.3g} %")


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("study", type=Path)
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--parts", type=int, default=40)
    options.add_argument("--replicates", type=int, default=4)
    options.add_argument("--workers", type=int)
    given = options.parse_args()
    main(given.study, given.out, given.parts, given.replicates, given.workers)
