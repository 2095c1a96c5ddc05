"""Synthetic rigs whose truth is known: how often ``doe calibrate`` says what is right of them.

``python examples/benchmarks/rigs.py surrogate`` hands rigs in closed form to the method, hundreds if asked for;
``python examples/benchmarks/rigs.py simulated`` simulates the example bearing, both the rigs and their calibration, in short
runs. Kinds of rigs: ``sound`` has inputs drawn from their laws and sensors of their stated accuracy; ``ends`` has two inputs
within 2 % of an end; of ``sensor`` the loss reads 12 % high, the impact 20 % low, or the loss 20 % high, which ``stated``
gives as accuracy; ``law`` has other physics: in closed form a land without loss, or a rolling loss that the load changes less;
where the bearing is simulated a dry land, or no rolling resistance. ``sound``, ``ends`` and ``stated`` should end "calibrated",
``law`` "not calibrated". The offset of a sensor that inputs can imitate cannot be found: then what is stated to be able to hide
must hold it. Of all hidden values 85 % or more should lie in their 90 % intervals.

``--rigs N`` of each kind, ``--only KIND``, ``--first N`` to skip rigs; ``--out FOLDER`` keeps runs, records and answers, and
a rig whose answer by the same code is there is not calibrated again. ``widths`` counts how often predictions of known width
are rejected, in ``--rigs`` many tables.
"""

import argparse
import csv
import json
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array

EXAMPLES = Path(__file__).resolve().parents[1]
SOUND, ENDS, SENSOR, LAW, STATED = KINDS = ("sound", "ends", "sensor", "law", "stated")
BIASED = ((1, 1.12), (0, 0.8), (1, 1.2))  # the output that a biased sensor reads, loss or impact, and by how many times
PARTICLES = 2000  # of rigs in closed form
NEAR = (0.005, 0.02, 0.98, 0.995)  # hidden quantiles near an end


class Answer(NamedTuple):
    """What became of a rig: its kind, number, verdict, reasons, and which hidden values lie in their intervals.

    ``hides``: by output, the offset that is stated not to be seen, as a share."""

    kind: str
    number: int
    verdict: str
    reasons: list[str]
    covered: list[bool]
    hides: list[float | None]

    @property
    def right(self) -> bool:
        """Whether the verdict is, or states that an offset as large as that of the sensor would not be seen."""
        calibrated = self.verdict == "calibrated"
        if self.kind == SENSOR and calibrated:
            place, factor = BIASED[self.number % len(BIASED)]
            return (self.hides[place] or 0.0) > np.exp(abs(np.log(factor))) - 1.0
        return calibrated == (self.kind in (SOUND, ENDS, STATED))


def offsets(kind: str, number: int, accuracies: Array, random: np.random.Generator) -> Array:
    """Factors (m,) by which sensors read the outputs: of a biased one its bias, else as their accuracies say."""
    factors = np.exp(accuracies * random.standard_normal(accuracies.size))
    if kind in (SENSOR, STATED):
        place, factor = BIASED[number % len(BIASED)]
        factors[place] = factor
    return factors


def stated(kind: str, number: int, accuracies: Array) -> Array:
    """Accuracies (m,) that a rig states: the usual ones, of a sensor whose bias is ``stated`` that bias."""
    place, factor = BIASED[number % len(BIASED)]
    size = abs(float(np.log(factor)))
    return np.where((np.arange(accuracies.size) == place) & (kind == STATED), size, accuracies)


def hidden(kind: str, inputs: int, random: np.random.Generator) -> Array:
    """Quantiles (d,) of the hidden inputs of a rig."""
    quantiles = random.random(inputs)
    if kind == ENDS:
        quantiles[random.permutation(inputs)[:2]] = random.choice(NEAR, 2)
    return quantiles


# The example bearing, in runs so short that a rig costs a minute or two; the rigs have the same runs, many of them.
SHORT = [
    "numerics.turns=5", "numerics.discard_turns=3", "numerics.impact_window_turns=1", "numerics.replicates=2",
    "numerics.extend=false", "numerics.companion=false",
]  # fmt: skip
REPLICATES = 16
LAWS = {
    "model.pocket_bar_stiffness_N_m": ("log_uniform", 1e7, 2e8),
    "lubricant.oil_fraction": ("log_uniform", 0.005, 0.1),
    "model.drag_coefficient": ("log_uniform", 0.3, 1.2),
    "model.pocket_friction": ("uniform", 0.02, 0.12),
    "cage.mass_g": ("uniform", 40.0, 50.0),
}
CONDITIONS = [(6e3, 600.0), (6e3, 2600.0), (12e3, 1300.0), (15e3, 600.0), (18e3, 2600.0), (21e3, 1300.0),
              (24e3, 600.0), (24e3, 2600.0)]  # fmt: skip
# What is measured, and with which standard deviation as a share; the order is that of ``BIASED``.
MEASURED = {"impact_force_N": 0.03, "power_loss_W": 0.015, "cage_speed_rpm": 0.0005}
OTHER_LAWS = ({"model.guide_land": "dry"}, {"model.rolling_resistance": "off"})


def simulated_rig(folder: Path, kind: str, number: int) -> tuple[Path, Path, dict[str, float]]:
    """Scene and table of a rig of the example bearing, and its hidden values by key."""
    from doe.unknown.inputs import values_of
    from doe.workflow.rig import ACCURACIES
    from rbdyn.dynamics.simulate import simulate
    from rbdyn.scene import Scene
    from rbdyn.scene.uncertain import Law

    random = np.random.default_rng([number, KINDS.index(kind)])
    quantiles = hidden(kind, len(LAWS), random)
    truth = {
        key: float(values_of(Law(law=law, low=low, high=high), np.array([quantile]))[0])  # type: ignore[arg-type]
        for (key, (law, low, high)), quantile in zip(LAWS.items(), quantiles, strict=True)
    }
    settings: dict[str, Any] = {key: json.loads(text) for key, _, text in (each.partition("=") for each in SHORT)}
    settings |= {"numerics.replicates": REPLICATES, "numerics.seed": 1000 + number}
    settings |= OTHER_LAWS[number % len(OTHER_LAWS)] if kind == LAW else {}
    base = Scene.load(EXAMPLES / "cylindrical_roller.toml")
    accuracies = np.array([ACCURACIES[name] / 100.0 for name in MEASURED])
    reads, grades = offsets(kind, number, accuracies, random), stated(kind, number, accuracies)
    rows = []
    for speed, load in CONDITIONS:
        at = {"operation.inner_speed_rpm": speed, "operation.radial_load_N": load}
        figures = simulate(base.changed({**truth, **settings, **at})).as_dict()
        cells = []
        for (name, sd), factor in zip(MEASURED.items(), reads.tolist(), strict=True):
            value = figures[name]["value"] * factor
            # Of the runs' own scatter the table states as much as of the sensor's.
            own = np.hypot(sd, (figures[name]["statistical_error"] or 0.0) / 1.96 / figures[name]["value"])
            cells += [repr(value * (1.0 + sd * random.standard_normal())), repr(value * float(own))]
        rows.append([speed, load, *cells, *(100.0 * grades).tolist()])
    header = [*at, *(column for name in MEASURED for column in (name, f"{name}_sd"))]
    header += [f"{name}_accuracy_percent" for name in MEASURED]
    scene, rig = folder / "scene.toml", folder / f"rig_{kind}_{number}.csv"
    with rig.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows([header, *rows])
    declared = "".join(
        f'"{key}" = {{ law = "{law}", low = {low}, high = {high} }}\n' for key, (law, low, high) in LAWS.items()
    )
    text = (EXAMPLES / "cylindrical_roller.toml").read_text("utf-8")
    text += f'\n[uncertain]\ndefaults = "none"\nset = {json.dumps(SHORT)}\n{declared}\n[calibrate]\nwaves = 1\n'
    scene.write_text(text, "utf-8")
    return scene, rig, truth


def simulated(folder: Path, kind: str, number: int) -> Answer:
    """Calibrate a rig of the example bearing; rigs in one folder share the runs of the first wave."""
    from doe.clearance import Simulations
    from doe.running.store import Store
    from doe.workflow.calibration import find_calibration, read_question

    scene, rig, truth = simulated_rig(folder, kind, number)
    question = read_question(scene, rig, (), ())
    with Store(folder / "study.sqlite", "rigs") as store:
        simulations = Simulations(store, 1, None, False, lambda title: lambda done, total: None)
        found = find_calibration(question, simulations)
    (folder / f"record_{kind}_{number}.json").write_text(
        json.dumps({**found.as_dict(), "truth": truth}, indent=1), "utf-8"
    )
    ranges: Any = found.inputs
    covered = [ranges[key].low <= value <= ranges[key].high for key, value in truth.items() if ranges]
    resolutions = [output.resolution for output in found.outputs.values()]
    return Answer(kind, number, found.verdict, found.reasons, covered, resolutions)


# A bearing in closed form: impact, loss and cage speed in eight conditions of speed and load, of a bar's stiffness, the oil's
# share, the land's fill and the pocket's friction; what a run scatters, and the sensors' standard deviations, as shares.
SPEED, LOAD = np.tile([0.25, 0.5, 0.75, 1.0], 2), np.repeat([0.5, 2.0], 4)
ROWS, INPUTS, OUTPUTS = SPEED.size, 4, ("impact", "loss", "cage speed")
SCATTER = np.repeat([0.03, 0.01, 0.0002], ROWS)
SENSORS, ACCURATE = np.repeat([0.03, 0.015, 0.0005], ROWS), np.array([0.1, 0.03, 0.001])
OTHER_FORMS: tuple[dict[str, float], ...] = ({"land": 0.0}, {"power": 0.15})
OUTPUT, ROW = np.repeat(np.arange(3), ROWS), np.tile(np.arange(ROWS), 3)


def closed_form(quantiles: Array, land: float = 1.0, power: float = 0.4) -> Array:
    """Logarithms (n, 24) of the outputs at quantiles (n, 4) of the inputs; ``land``: whether the land has its loss;
    ``power`` of the load in the rolling loss."""
    stiffness, oil, fill, friction = (column[:, None] for column in quantiles.T)
    impact = 80.0 * 20.0 ** (0.35 * (stiffness - 0.5)) * SPEED * LOAD**0.15 * (1.0 + 0.3 * fill * (1.0 - SPEED))
    drag, pocket = 20.0 * 20.0 ** (oil - 0.5) * SPEED**3, 60.0 * (0.02 + 0.1 * friction) * SPEED * LOAD**0.3
    film = land * 50.0 * (0.5 + 0.5 * fill) * SPEED**2
    rolling = 150.0 * SPEED**1.3 * LOAD**power
    slip = 0.002 * (drag + 0.3 * pocket - 0.5 * film) / (rolling + 5.0)
    return np.log(np.hstack([impact + 20.0 * SPEED**2, rolling + drag + film + pocket, 1.0 - slip]))


def surrogate(kind: str, number: int) -> Answer:
    """Calibrate a rig in closed form."""
    from doe.unknown.calibration import MISSED, Batch, Unknowns, judge, matched, objections
    from doe.unknown.posterior import Measured, densest_intervals, learnt

    random = np.random.default_rng([number, KINDS.index(kind)])
    truth = hidden(kind, INPUTS, random)
    other = OTHER_FORMS[number % len(OTHER_FORMS)] if kind == LAW else {}
    values = closed_form(truth[None], **other)[0]
    values += np.log(offsets(kind, number, ACCURATE, random))[OUTPUT] + SENSORS * random.standard_normal(values.size)
    by_default = np.full(len(OUTPUTS), np.nan)
    measured = Measured(
        values, SENSORS**2, OUTPUT, ROW, by_default, np.zeros(values.size, bool), stated(kind, number, ACCURATE)
    )

    def simulate(quantiles: Array, stage: int) -> Batch:
        simulated = closed_form(quantiles)
        noisy = simulated + SCATTER * random.standard_normal(simulated.shape)
        stated = SCATTER**2 * random.chisquare(4, simulated.shape) / 4.0
        return Batch(quantiles, noisy, stated, np.full(simulated.shape, 4))

    found = matched(simulate, measured, Unknowns(INPUTS), number, particles=PARTICLES)
    assert found.sampled is not None
    quantiles = found.quantiles(found.sampled.points)
    nothing = np.full((2, INPUTS), np.nan)
    taught = learnt("abcd", quantiles, np.full(quantiles.shape, np.nan), nothing)
    judgement = judge(found, OUTPUTS, number)
    reasons = objections(judgement, has_learned=taught.has_learned, emulated=found.misfit < MISSED)
    reasons += ["refuted"] if found.refuted else []
    low, high = densest_intervals(quantiles)
    verdict = "not calibrated" if reasons else "calibrated"
    hides = [None if each.unseen is None else float(np.expm1(each.unseen.offset)) for each in judgement.outputs]
    return Answer(kind, number, verdict, reasons, ((truth >= low) & (truth <= high)).tolist(), hides)


def widths(repeats: int, cells: int, factor: float) -> float:
    """Share of ``repeats`` tables, of three correlated cells a row, whose predictions are ``factor`` times too wide, that
    are rejected."""
    from doe.unknown.width import scores_of, width

    random, rejected = np.random.default_rng([cells, int(100 * factor)]), 0
    root = np.linalg.cholesky(0.6 + 0.4 * np.eye(3))
    for _ in range(repeats):
        rows = (root @ random.standard_normal((cells // 3, 3, 1)))[:, :, 0] / factor
        parts = [scores_of(random.standard_normal((1000, 3)) @ root.T, row, np.arange(3)) for row in rows]
        rejected += width(parts).rejected
    return rejected / repeats


def table(answers: Sequence[Answer]) -> Iterator[str]:
    """Lines: by kind how many verdicts are right and how many hidden values are covered, and what the reasons were."""
    from doe.unknown.decision import wilson

    for kind in dict.fromkeys(each.kind for each in answers):
        own = [each for each in answers if each.kind == kind]
        right = sum(each.right for each in own)
        low, high = wilson(right / len(own), len(own))
        yield f"{kind:8} {right} of {len(own)} verdicts right ({100.0 * low:.0f} to {100.0 * high:.0f} %)"
        covered = [inside for each in own for inside in each.covered]
        yield f"{'':8} {sum(covered)} of {len(covered)} hidden values in their 90 % intervals"
        counts = Counter(reason.partition(":")[0] for each in own for reason in each.reasons)
        yield from (f"{'':8} {count} x {reason}" for reason, count in counts.most_common(4))
    covered = [inside for each in answers for inside in each.covered]
    if covered:
        yield f"all together: {np.mean(covered):.3f} of {len(covered)} hidden values in their 90 % intervals"


def answer(what: str, folder: Path, kind: str, number: int) -> Answer:
    """What becomes of a rig, from the folder where the same code has answered before."""
    from doe.clearance import SIMULATION
    from rbdyn.base.files import code_version

    path = folder / f"{what}_{kind}_{number}.json"
    version = code_version(SIMULATION, "doe.workflow.calibration")
    if path.exists() and (kept := json.loads(path.read_text("utf-8")))["version"] == version:
        return Answer(**kept["answer"])
    one = surrogate(kind, number) if what == "surrogate" else simulated(folder, kind, number)
    path.write_text(json.dumps({"version": version, "answer": one._asdict()}), "utf-8")
    return one


def main() -> None:
    """Read the arguments, calibrate, and count."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("surrogate", "simulated", "widths"))
    parser.add_argument("--rigs", type=int, default=4, help="rigs of each kind (4)")
    parser.add_argument("--first", type=int, default=0, help="number of the first (0)")
    parser.add_argument("--only", choices=KINDS, action="append", help="kinds of rigs; repeatable (all)")
    parser.add_argument("--out", type=Path, help="folder of runs and records of simulated rigs")
    asked = parser.parse_args()
    if asked.what == "widths":
        for cells in (12, 24, 48):
            shares = ", ".join(f"{by:g} times: {100.0 * widths(asked.rigs, cells, by):.1f} %" for by in (0.5, 1.0, 2.0))
            print(
                f"{cells} cells, predictions too wide by a factor; rejected of {asked.rigs} tables: {shares}",
                flush=True,
            )
        return
    answers = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = asked.out or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        for number in range(asked.first, asked.first + asked.rigs):
            for kind in asked.only or KINDS:
                one = answer(asked.what, folder, kind, number)
                reasons = "; ".join(one.reasons)
                print(
                    f"{kind} {number}: {one.verdict} {sum(one.covered)}/{len(one.covered)} {reasons[:160]}",
                    file=sys.stderr,
                    flush=True,
                )
                answers.append(one)
    print("\n".join(table(answers)))


if __name__ == "__main__":
    main()
