"""Stated numerical error of ``rbdyn simulate`` compared with the true one, figure by figure and scene by scene.

``python examples/benchmarks/numerical_error.py`` runs each scene as it is, with its companions, and its truth: rtol 1e-6,
with steps that leave a roller lying lightly on the outer race a numerical damping ratio of 2e-6, and a twentieth of that
of the race, at most. Runs and truths
are of the same length, have seeds of their own, and none is lengthened. The bias of a figure is the difference of both
means, known to a noise that comes from the scatter of the replicates. A cell holds where the bias less 1.96 noises is
within the stated numerical error; a bias counts as resolved beyond three noises. "plain" is what companions at ten times
the tolerance alone would state. Slip counts in percentage points, all else in percent of the truth.

``--only WORD,...`` chooses scenes whose name holds a word, ``--size`` replicates, counted and discarded turns, ``--dear``
that of scenes whose truth takes a tenth of a second a turn and more. Truths stand in a file beside this script, or in ``--truths FILE``, and
are simulated again where that lacks them or where works of their first tenth of a turn have changed. ``--out FILE`` writes a
table as CSV. The table depends on nothing but the size: not on the clock, nor on the number of ``--workers``.
"""

import argparse
import csv
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

from rbdyn.dynamics.ensemble import Outcome, Stop, run_all
from rbdyn.dynamics.figures import BEARING
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.parameters.state import light_contact
from rbdyn.dynamics.recording import recording_of
from rbdyn.dynamics.run import prepare, with_numerics
from rbdyn.dynamics.statistics.batch_means import student_factor
from rbdyn.dynamics.statistics.metrics import (
    LEAST_DAMPING,
    Companions,
    companions_of,
    longest_step,
    quantity,
    usual_companions,
)
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.result import Quantity
from rbdyn.scene import Scene

EXAMPLES = Path(__file__).resolve().parents[1]
TRUTHS = Path(__file__).with_name("numerical_truths.json")
EXAMPLE = str(EXAMPLES / "cylindrical_roller.toml")
JUDGED = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm", "cage_slip")
# The truth: tolerance, numerical damping ratio of a light contact at most, the same over that of the race, seed.
TRUE_RTOL, TRUE_DAMPING, TRUE_SHARE, TRUE_SEED = 1e-6, 2e-6, 0.05, 987_654
# Shaft turns of a truth by which it is recognised.
PROBE_TURNS = 0.1
# Noises by which a bias must hold, and beyond which it counts as resolved.
HOLD, RESOLVED = 1.96, 3.0
# Goals: share of cells that hold, and median of stated over true error where that is resolved.
COVERED, BLANKET = 0.93, 3.0


class Case(NamedTuple):
    """A scene: its name, its file or the words of ``rbdyn new``, the keys that differ, and whether its truth is dear."""

    name: str
    source: str | tuple[str, ...]
    keys: tuple[str, ...] = ()
    dear: bool = False


class Size(NamedTuple):
    """Replicates, and shaft turns that each counts and discards."""

    replicates: int
    turns: float
    discard: float


class Row(NamedTuple):
    """One cell, in percent: bias, its noise (a standard deviation), stated error, the one of plain companions."""

    scene: str
    figure: str
    truth: float
    bias: float
    noise: float
    stated: float
    plain: float

    @property
    def holds(self) -> bool:
        """Whether the stated error holds the bias as far as this is known."""
        return abs(self.bias) - HOLD * self.noise <= self.stated

    @property
    def resolved(self) -> bool:
        """Whether the bias is beyond its noise."""
        return abs(self.bias) > RESOLVED * self.noise


def point(speed: float, load: float, dear: bool = False) -> Case:
    """The example at another speed [rpm] and load [N]."""
    keys = f"operation.inner_speed_rpm={speed}", f"operation.radial_load_N={load}"
    return Case(f"{speed:g} rpm, {load:g} N", EXAMPLE, keys, dear)


CASES = (
    point(2000, 4000),
    point(2000, 1300),
    point(3500, 4000),
    point(6000, 4000),
    point(12000, 1300),
    Case("example", EXAMPLE),
    Case("inner guidance", EXAMPLE, ("cage.guidance=inner",)),
    Case("NU215", str(EXAMPLES / "published" / "nu215.toml")),
    point(1000, 8000, dear=True),
    point(700, 1300, dear=True),
    point(700, 20000, dear=True),
    Case("new NU1010", ("NU1010", "--oil", "Jet Oil II", "--temperature", "100"), dear=True),
    Case("new NU320", ("NU320",), dear=True),
    Case("new NU206", ("NU206",), dear=True),
)


def scene_of(case: Case, size: Size, folder: Path) -> Scene:
    """The scene at this size."""
    path = Path(case.source) if isinstance(case.source, str) else folder / "new.toml"
    if not isinstance(case.source, str):
        words = [sys.executable, "-m", "rbdyn", "new", *case.source]
        path.write_text(subprocess.run(words, capture_output=True, text=True, check=True).stdout, "utf-8")
    keys = ("turns", size.turns), ("discard_turns", size.discard), ("replicates", size.replicates)
    return Scene.load(path, [*case.keys, *(f"numerics.{key}={value}" for key, value in keys), "numerics.extend=false"])


def replicates(scene: Scene, count: int, plan: Companions | None, workers: int) -> list[Replicate]:
    """So many replicates of the scene, or companions that are integrated by a plan."""
    bearing = roller_bearing(scene)
    runs: dict[int, Replicate] = {}

    def ended(one: Outcome[Replicate]) -> None:
        runs[one.place] = one.result()

    def run(index: int) -> Replicate:
        return recording_of(scene, bearing, None, index, plan, Stop()).to(scene.numerics.turns)

    tasks = [partial(run, index) for index in range(count)]
    run_all(tasks, workers, Stop(), ended)
    return [runs[place] for place in range(count)]


def true_plan(scene: Scene) -> Companions:
    """How the truth is integrated."""
    light = light_contact(scene)
    race = LEAST_DAMPING if light is None else max(light.damping, LEAST_DAMPING)
    damping = min(TRUE_DAMPING, TRUE_SHARE * race)
    step = math.inf if light is None else longest_step(light, damping, "rk45")
    return Companions(TRUE_RTOL, "rk45", step, 1.0)


def figures_of(runs: Sequence[Replicate], companions: Sequence[Replicate], share: float) -> dict[str, Quantity]:
    """Figures without what slow change may add, for runs and truths are of one length."""
    judged: list[Any] = [figure for figure in BEARING if figure.key in JUDGED]
    return {figure.key: quantity(figure.statistic, runs, companions, share, 0.0, figure.scale) for figure in judged}


def truth_of(scene: Scene, workers: int) -> dict[str, tuple[float, float]]:
    """Value and standard error of each figure."""
    plan, count = true_plan(scene), scene.numerics.replicates
    figures = figures_of(replicates(with_numerics(scene, seed=TRUE_SEED), count, plan, workers), [], 1.0)
    return {name: (one.value, noise(one, count)) for name, one in figures.items()}


def noise(figure: Quantity, replicates: int) -> float:
    """Standard error of a figure, of which the half-width is Student's."""
    return (figure.statistical_error or 0.0) / student_factor(replicates - 1)


def rows_of(case: Case, scene: Scene, truth: dict[str, tuple[float, float]], workers: int) -> tuple[list[Row], float]:
    """The cells of a scene, and right-hand sides with its companions over those with plain ones."""
    count, others = scene.numerics.replicates, scene.numerics.companions
    runs = replicates(scene, count, None, workers)
    plan, usual = companions_of(scene, runs), usual_companions(scene)
    theirs = replicates(scene, others, plan, workers)
    plain = theirs if plan == usual else replicates(scene, others, usual, workers)
    stated, before = figures_of(runs, theirs, plan.share), figures_of(runs, plain, usual.share)
    rows = []
    for name in JUDGED:
        (exact, doubt), one = truth[name], stated[name]
        percent = 100.0 if name == "cage_slip" else 100.0 / abs(exact)
        parts = (
            one.value - exact, math.hypot(noise(one, count), doubt),
            one.numerical_error or 0.0, before[name].numerical_error or 0.0,
        )  # fmt: skip
        rows.append(Row(case.name, name, exact, *(percent * part for part in parts)))
    work = [sum(run.derivatives for run in group) for group in (runs, theirs, plain)]
    return rows, (work[0] + work[1]) / (work[0] + work[2])


def words(rows: Sequence[Row], costs: dict[str, float]) -> list[str]:
    """What the cells say together."""
    good, sharp = [row for row in rows if row.holds], [row for row in rows if row.resolved]
    before = sum(row._replace(stated=row.plain).holds for row in rows)
    ratios = sorted(row.stated / abs(row.bias) for row in sharp)
    sentences = [
        f"{len(good)} of {len(rows)} cells hold ({100.0 * len(good) / len(rows):.0f} %, goal {100.0 * COVERED:.0f}); "
        f"{before} would by companions at ten times the tolerance alone.",
        f"{len(sharp)} biases are resolved; the median of stated over true error there is "
        f"{f'{median(ratios):.2g} (goal at most {BLANKET:g})' if ratios else 'unknown'}.",
        *(f"Too small: {row.scene}, {row.figure}." for row in rows if not row.holds),
    ]
    own = [row.stated / row.plain for row in rows if row.scene == "example"]
    if own:
        sentences.append(f"Stated errors of the example are at most {max(own):.3g} times those by plain companions.")
    dear = {name: cost for name, cost in costs.items() if cost > 1.0}
    if dear:
        listed = ", ".join(f"{name} {cost:.2f}" for name, cost in dear.items())
        sentences.append(f"Right-hand sides over those with plain companions: {listed}; elsewhere 1.")
    return sentences


def size_of(text: str) -> Size:
    """Three numbers, such as 8,20,10."""
    count, turns, discard = text.split(",")
    return Size(int(count), float(turns), float(discard))


def probe_of(scene: Scene) -> list[float]:
    """Works [J] of the start of a truth, by which a change of the laws shows."""
    short = with_numerics(scene, turns=PROBE_TURNS, discard_turns=0.0, replicates=1, seed=TRUE_SEED)
    return [float(work) for work in replicates(short, 1, true_plan(scene), 1)[0].work.sum(axis=0)]


def kept_truth(path: Path | None, case: Case, scene: Scene, workers: int) -> dict[str, tuple[float, float]]:
    """The truth of a scene from a file that has it by the same laws, else simulated and written there."""
    truths = json.loads(path.read_text("utf-8")) if path is not None and path.exists() else {}
    numerics, probe = scene.numerics, probe_of(scene)
    size = f"{numerics.replicates} x ({numerics.discard_turns:g} + {numerics.turns:g}) turns"
    kept = truths.get(f"{case.name}, {size}")
    if kept is None or not same(kept["probe"], probe):
        kept = {"probe": probe, "figures": truth_of(scene, workers)}
        if path is not None:
            path.write_text(json.dumps({**truths, f"{case.name}, {size}": kept}, indent=1) + "\n", "utf-8")
    return {name: (value, doubt) for name, (value, doubt) in kept["figures"].items()}


def same(ours: Sequence[float], theirs: Sequence[float]) -> bool:
    """Whether two probes are of the same laws, for machines differ in the last digits."""
    size = max(map(abs, ours))
    return len(ours) == len(theirs) and all(
        math.isclose(one, other, rel_tol=1e-5, abs_tol=1e-7 * size) for one, other in zip(ours, theirs, strict=True)
    )


def main() -> None:
    """Read the arguments, measure, and say what holds; leaves with 1 where a goal is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="words of the scenes to measure, such as NU,example (all)")
    parser.add_argument(
        "--size", type=size_of, default=Size(16, 20.0, 10.0), help="replicates,turns,discarded (16,20,10)"
    )
    parser.add_argument("--dear", type=size_of, default=Size(8, 6.0, 2.0), help="the same of dear scenes (8,6,2)")
    parser.add_argument("--truths", type=Path, default=TRUTHS, help="JSON file that keeps truths (beside this script)")
    parser.add_argument("--out", type=Path, help="CSV file of all cells")
    parser.add_argument("--workers", type=int, default=2, help="threads (2)")
    asked = parser.parse_args()
    wanted = [word for word in asked.only.split(",") if word]
    rows: list[Row] = []
    costs = {}
    print(f"{'scene':24} {'figure':22} {'truth':>10} {'bias %':>9} {'noise %':>8} {'stated %':>8} {'plain %':>8} holds")
    for case in (case for case in CASES if not wanted or any(word in case.name for word in wanted)):
        size = asked.dear if case.dear else asked.size
        with tempfile.TemporaryDirectory() as folder:
            scene = scene_of(case, size, Path(folder))
        prepare(scene, roller_bearing(scene))
        truth = kept_truth(asked.truths, case, scene, asked.workers)
        cells, costs[case.name] = rows_of(case, scene, truth, asked.workers)
        for row in cells:
            numbers = f"{row.truth:10.5g} {row.bias:+9.2g} {row.noise:8.2g} {row.stated:8.2g} {row.plain:8.2g}"
            verdict = ("no", "yes")[row.holds] + ", resolved" * row.resolved
            print(f"{row.scene:24} {row.figure:22} {numbers} {verdict}", flush=True)
        rows += cells
    print(*words(rows, costs), sep="\n")
    if asked.out:
        with asked.out.open("w", encoding="utf-8", newline="") as file:
            csv.writer(file).writerows([(*Row._fields, "holds"), *((*row, row.holds) for row in rows)])


if __name__ == "__main__":
    main()
