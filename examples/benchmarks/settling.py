#!/usr/bin/env python3
"""How long runs get, and how often their statistical errors hold the truth: nine scenes, many repeats from one pool of runs.

    python examples/benchmarks/settling.py [SCENE ...] [--replicates 96] [--repeats 200] [--team 4]

Of every scene many long replicates are made once, half of them in each group of starts. A repeat draws as many as a run has (the
fewest of any example unless told) from both groups in turn, and goes through the very code of a simulation: where counting
starts, settling, lengthening, errors. The truth is the later half of all replicates, at the same tolerance, so that the
statistical error alone is judged. "In vain" are runs that a settled scene lengthens: repeats that begin in the later half of
long replicates. "None" are repeats that have not settled at their limit and state no interval.
"""

import argparse
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rbdyn.dynamics.ensemble import Outcome, Stop, run_all
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import Recording, batches_of, run_until_settled
from rbdyn.dynamics.run import Run, prepare, with_numerics
from rbdyn.dynamics.statistics.error_bars import quantities
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.result import Quantity
from rbdyn.scene import Scene

EXAMPLE = Path(__file__).resolve().parents[1] / "cylindrical_roller.toml"
FIGURES = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm")
TEAM, TURNS, DISCARD, SEED = 4, 40.0, 20.0, 1
# Kinds of starts of replicates, in turn: two of each group.
KINDS = 4
# Length over that asked for, beyond which a run was lengthened.
LONGER = 1.01


def clearances(radial: float, guide: float, pocket: float) -> tuple[str, ...]:
    """The example at other clearances [mm]."""
    return (
        f"bearing.radial_clearance_mm={radial}",
        f"cage.guide_clearance_mm={guide}",
        f"cage.pocket_clearance_mm={pocket}",
    )


# Of each scene its words for ``rbdyn new`` or none, keys that differ, and how long replicates are, in runs of a repeat.
SCENES: dict[str, tuple[tuple[str, ...], tuple[str, ...], int]] = {
    "example": ((), (), 8),
    "pick": ((), clearances(0.025, 0.214, 0.221), 8),
    "loose": ((), clearances(0.025, 0.2, 0.35), 8),
    "slow": ((), clearances(0.028, 0.15, 0.35), 8),
    "inner-guided": ((), ("cage.guidance=inner",), 4),
    "roller-guided": ((), ("cage.guidance=roller",), 4),
    "2000 rpm, 4 kN": ((), ("operation.inner_speed_rpm=2000", "operation.radial_load_N=4000"), 4),
    "NU206": (("NU206", "--speed", "9000", "--load", "1500", "--oil", "ISO VG 32"), (), 4),
    "own": (
        ("own", "--rollers", "12", "--roller", "8x8", "--pitch", "60", "--speed", "20000", "--load", "1000"),
        (),
        8,
    ),
    "N308, cold": (("N308", "--load", "200", "--oil", "ISO VG 100", "--temperature", "5"), (), 8),
}


@dataclass(frozen=True)
class Pooled:
    """A replicate of the pool as a recording: what it was like after so many turns, from batch ``skip`` on."""

    scene: Scene
    run: Replicate
    skip: int = 0

    def to(self, turns: float) -> Replicate:
        """The replicate after so many turns past the warm-up."""
        batches, run = batches_of(self.scene), self.run
        part = slice(self.skip, self.skip + batches.count(turns))
        ends, count = slice(part.start, part.stop + 1), len(run.durations)
        over_batches: dict[str, Any] = {
            name: array for name, array in vars(run).items() if isinstance(array, np.ndarray) and len(array) == count
        }
        arrays: dict[str, Any] = {name: array[part] for name, array in over_batches.items()}
        return replace(run, first=batches.first, energy=run.energy[ends], **arrays)


def scene_of(name: str, team: int = TEAM) -> tuple[Scene, int]:
    """A scene as it is repeated, and how many times as long its replicates are."""
    words, keys, length = SCENES[name]
    with tempfile.TemporaryDirectory() as folder:
        path = EXAMPLE
        if words:
            path = Path(folder, "scene.toml")
            path.write_text(
                subprocess.run(
                    [sys.executable, "-m", "rbdyn", "new", *words], check=True, capture_output=True, text=True
                ).stdout
            )
        scene = Scene.load(path, list(keys))
    return with_numerics(
        scene,
        turns=TURNS,
        discard_turns=DISCARD,
        replicates=team,
        companion=False,
        extend=True,
        extend_limit=float(length),
    ), length


def pool_of(scene: Scene, length: int, replicates: int, workers: int | None) -> list[Replicate]:
    """Replicates that are so many times as long as a repeat asks for."""
    bearing, stop, runs = roller_bearing(scene), Stop(), dict[int, Replicate]()
    prepare(scene, bearing)
    turns = length * (TURNS + DISCARD) - DISCARD

    def one(number: int) -> Replicate:
        return Recording(Run(scene, bearing, number, scene.numerics.rtol, stop)).to(turns)

    def ended(each: Outcome[Replicate]) -> None:
        runs[each.place] = each.result()

    run_all([partial(one, number) for number in range(replicates)], workers, stop, ended)
    return [runs[number] for number in range(replicates)]


def repeat(scene: Scene, team: Sequence[Replicate], skip: int = 0) -> tuple[float, dict[str, Quantity]]:
    """Length of the runs over that asked for, and the figures with their statistical errors."""
    ensemble = run_until_settled(
        scene, lambda number, companions, stop: Pooled(scene, team[number], skip), 1, None, Stop()
    )
    figures = quantities(scene, ensemble.runs, [], 1.0, ensemble.since)
    return float(ensemble.runs[0].durations.sum()) / scene.turn_s / (TURNS + DISCARD), figures


def team_of(pool: Sequence[Replicate], size: int, random: np.random.Generator) -> list[Replicate]:
    """Replicates of a repeat: as in a run, every kind of start in turn."""
    kinds = [random.permutation(np.arange(kind, len(pool), KINDS)) for kind in range(KINDS)]
    return [pool[kinds[place % KINDS][place // KINDS]] for place in range(size)]


def row(name: str, replicates: int, repeats: int, team: int, workers: int | None) -> tuple[str, list[float]]:
    """A scene's row of the table, and the shares that hold the truth."""
    started = time.perf_counter()
    scene, length = scene_of(name, team)
    pool, random = pool_of(scene, length, replicates, workers), np.random.default_rng(SEED)
    middle = len(pool[0].durations) // 2
    truth = quantities(scene, [run.counted_from(middle) for run in pool], [], 1.0)
    teams = [team_of(pool, team, random) for _ in range(repeats)]
    lengths, figures = zip(*(repeat(scene, team) for team in teams), strict=True)
    # As long as the later half allows.
    settled = with_numerics(scene, extend_limit=0.5 * length)
    vain = [repeat(settled, team, middle)[0] > LONGER for team in teams] if length > 4 else []
    cells, shares = [], []
    for figure in FIGURES:
        exact, doubt = truth[figure].value, truth[figure].statistical_error or 0.0
        stated = [
            (each[figure].value, error) for each in figures if (error := each[figure].statistical_error) is not None
        ]
        errors = [error for _, error in stated]
        held = [abs(value - exact) <= math.hypot(error, doubt) for value, error in stated]
        shares.append(float(np.mean(held)))
        cells.append(f"{shares[-1]:.2f} ({100.0 * float(np.mean(errors)) / abs(exact):.2g} %)")
    longer, none = float(np.mean(np.array(lengths) > LONGER)), 1.0 - len(stated) / repeats
    spent = f"{len(pool)} x {length * (TURNS + DISCARD):g}, {time.perf_counter() - started:.0f} s"
    in_vain = f"{float(np.mean(vain)):.3f}" if vain else ""
    return (
        f"| {name} | {' | '.join(cells)} | {np.mean(lengths):.2f} | {longer:.2f} | {in_vain} | {none:.2f} | {spent} |",
        shares,
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", metavar="SCENE", help=f"of {', '.join(SCENES)}; all unless named")
    parser.add_argument("--replicates", type=int, default=96)
    parser.add_argument("--repeats", type=int, default=200)
    parser.add_argument(
        "--team", type=int, default=TEAM, help="replicates of a repeat (4, as examples/duty_study.toml)"
    )
    parser.add_argument("--workers", type=int)
    asked = parser.parse_args()
    if alien := [name for name in asked.scenes if name not in SCENES]:
        parser.error(f"{', '.join(alien)}: no such scene")
    print(
        f"{asked.team} replicates of {TURNS:g} turns after {DISCARD:g}; {asked.repeats} repeats; share that holds the truth (mean half-width)"
    )
    print("\n| scene | impact | whirl | loss | cage speed | length | lengthened | in vain | none | pool |")
    print("|---|---|---|---|---|---|---|---|---|---|", flush=True)
    shares: list[float] = []
    for name in asked.scenes or SCENES:
        text, found = row(name, asked.replicates, asked.repeats, asked.team, asked.workers)
        shares += found
        print(text, flush=True)
    print(f"\npooled {np.mean(shares):.3f}, lowest {min(shares):.2f}")


if __name__ == "__main__":
    main()
