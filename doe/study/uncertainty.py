"""What is not known of a scene and what it does to its outputs: ``doe uncertainty``."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

from doe import clearance
from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.running.failure import Failure, sentence
from doe.unknown import laws, plan, screening
from doe.unknown.sensitivity import Index, Indices, sobol
from doe.unknown.spread import Emulated, Runs, Spread, emulated, spread_of
from rbdyn.faults import InputError, RunError, read_toml, set_key
from rbdyn.result import Quantity, SimulationResult
from rbdyn.scene import Scene, rollers_only
from rbdyn.scene.uncertain import Uncertain
from rbdyn.scene.unknown import Input, inputs_of, value_of, with_values

OUTPUTS = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm")
# Fresh input sets of the emulator, input sets at most, and the share of them that may be impossible or fail.
FRESH, MOST, HOLES = 8192, 512, 0.05
# An end of the range is known whose standard error is below this share of its width, unless another is asked for.
TARGET = 0.1
SCREENING_SEEDS = 500_000
NORMAL = 1.96  # half-width of a 95 % interval over its standard deviation


@dataclass(frozen=True)
class Sets:
    """Input sets that were run: their quantiles (n, d), values of the inputs, outputs (n, m), variances of these (n, m) and
    the degrees of freedom behind them (n, m); what became of the others."""

    quantiles: Array
    inputs: list[dict[str, Any]]
    outputs: Array
    variances: Array
    freedom: Whole
    failures: tuple[Failure, ...]
    impossible: tuple[str, ...]


@dataclass(frozen=True)
class OutputRange:
    """One output: at the scene's own inputs with its errors, its range over what is not known, and which input makes it."""

    nominal: Quantity
    spread: Spread
    indices: Indices | None
    floor: Index | None


@dataclass(frozen=True)
class Uncertainty:
    """Everything a report needs. ``screened``: inputs left at their value, with the largest share that each had in an
    output's main effects."""

    path: Path
    inputs: list[Input]
    screened: Mapping[str, float]
    outputs: Mapping[str, OutputRange]
    sets: Sets
    seed: int
    notes: tuple[str, ...]


@dataclass(frozen=True)
class _Case:
    """A scene file with what is asked of it."""

    source: str
    data: dict[str, Any]
    scene: Scene
    uncertain: Uncertain
    every: list[Input]

    def scenes(self, inputs: Sequence[Input], values: Sequence[Mapping[str, Any]], seed: int) -> list[Scene | str]:
        """A scene an input set, or why there is none."""
        by_key = {each.key: each.law for each in self.every}
        keys = {each.key for each in inputs}
        # What multiplies an input that varies goes with it, in the ratio that the scene has.
        tied = {
            key: value_of(self.scene, key) / value_of(self.scene, law.times)
            for key, law in by_key.items()
            if key not in keys and law.times in keys
        }
        found: list[Scene | str] = []
        for number, row in enumerate(values):
            overrides = [*self.uncertain.set, f"numerics.seed={seed + number}"]
            try:
                tables = with_values(self.data, self.source, by_key, {**row, **tied})
                found.append(Scene.from_dict(tables, self.source, overrides))
            except InputError as error:
                found.append(str(error.faults[0]))
        return found


def find_uncertainty(
    path: Path, overrides: Sequence[str], simulations: Simulations, points: int | None = None, target: float = TARGET
) -> Uncertainty:
    """Range of every output of a scene over its unknown inputs, and which of them makes it.

    ``points``: input sets to start from, a power of two, as the scene says where left out; they are doubled, up to 512,
    until the ends of every range are known to ``target`` of its width. Raises InputError, RunError, KeyboardInterrupt.
    """
    case = _read(path, overrides)
    asked = case.uncertain.points if points is None else points
    if not case.every:
        raise InputError(
            [
                f"{path}: uncertain: nothing is unknown; name keys as \"table.key\" = {{law = ...}} or take out defaults = 'none'"
            ]
        )
    (nominal,) = simulations.run([case.scene], ["as the scene says"], simulations.progress("as the scene says"))
    if isinstance(nominal, Failure):
        raise RunError(f"{path}: as the scene says: {nominal.cause}")
    inputs, screened = _screened(case, simulations)
    seed = case.uncertain.seed
    factor = laws.copula([each.key for each in inputs], _pairs(case.uncertain, inputs))
    # One input more than there are, which does nothing: what the indices say of it is their floor.
    fresh = _coordinates(plan.nested(len(inputs) + 1, FRESH, seed + 1), factor)
    count = asked
    while True:
        sets = _run(case, inputs, _coordinates(plan.nested(len(inputs) + 1, count, seed), factor), simulations)
        fitted = [_emulated(sets, nominal, place) for place in range(len(OUTPUTS))]
        spreads = [spread_of(runs, each, fresh, seed) for runs, each in fitted]
        if count >= MOST or all(each.known <= target for each in spreads):
            break
        count *= 2
    outputs = {
        name: _output(nominal, name, spread, each, len(inputs), seed, independent=factor is None)
        for name, spread, (_, each) in zip(OUTPUTS, spreads, fitted, strict=True)
    }
    return Uncertainty(path, inputs, screened, outputs, sets, seed, _notes(sets, spreads, count, target))


def check_points(points: int | None) -> None:
    """Raises InputError unless the number of input sets is a power of two."""
    if points is not None and points & (points - 1):
        raise InputError([f"--points {points}: no power of two; take {2 ** (points.bit_length() - 1)}"])


def _read(path: Path, overrides: Sequence[str]) -> _Case:
    data = copy.deepcopy(read_toml(path))
    for override in overrides:
        set_key(data, override)
    scene = rollers_only(Scene.from_dict(data, str(path)))
    uncertain = scene.uncertain or Uncertain()
    return _Case(str(path), data, scene, uncertain, inputs_of(scene, data, uncertain))


def _pairs(uncertain: Uncertain, inputs: Sequence[Input]) -> list[Any]:
    present = {each.key for each in inputs}
    return [pair for pair in uncertain.correlation if present.issuperset(pair.keys)]


def _coordinates(quantiles: Array, factor: Array | None) -> Array:
    """Quantiles of dependent inputs; the last one, which does nothing, depends on none."""
    return np.column_stack([laws.dependent(quantiles[:, :-1], factor), quantiles[:, -1]])


def _screened(case: _Case, simulations: Simulations) -> tuple[list[Input], dict[str, float]]:
    """The inputs that vary, of too many those that matter; and the largest share of each of the others."""
    every = case.every
    if len(every) <= case.uncertain.inputs:
        return every, {}
    quantiles = plan.two_levels(len(every))
    sets = _run(case, every, np.column_stack([quantiles, np.full(len(quantiles), 0.5)]), simulations, SCREENING_SEEDS)
    logs = np.log(np.maximum(sets.outputs, 1e-12))
    share = screening.shares(sets.quantiles[:, :-1], logs)
    declared = [place for place, each in enumerate(every) if each.key in case.uncertain.laws]
    stay = screening.kept(share, declared, case.uncertain.inputs)
    left = [place for place in range(len(every)) if place not in stay]
    return [every[place] for place in stay], {every[place].key: float(share[place].max()) for place in left}


def _run(case: _Case, inputs: Sequence[Input], quantiles: Array, simulations: Simulations, seeds: int = 0) -> Sets:
    """Run input sets. Raises RunError where too many are impossible or fail."""
    values = laws.table_of({each.key: each.law for each in inputs}, quantiles)
    title = "screening" if seeds else "input sets"
    scenes = case.scenes(inputs, values, case.scene.numerics.seed + clearance.INPUT_SEEDS + seeds)
    possible = [place for place, scene in enumerate(scenes) if isinstance(scene, Scene)]
    labels = [f"{title} {place + 1}" for place in possible]
    ran = simulations.run([scene for scene in scenes if isinstance(scene, Scene)], labels, simulations.progress(title))
    good = [(place, result) for place, result in zip(possible, ran, strict=True) if not isinstance(result, Failure)]
    failures = tuple(result for result in ran if isinstance(result, Failure))
    impossible = tuple(scene for scene in scenes if isinstance(scene, str))
    if len(scenes) - len(good) > HOLES * len(scenes):
        why = sentence(failures) if failures else impossible[0]
        raise RunError(
            f"{len(scenes) - len(good)} of {len(scenes)} input sets gave no result, more than {100.0 * HOLES:g} %: {why}; "
            "narrow the laws of the inputs"
        )
    outputs, errors, samples = clearance.figures(OUTPUTS, [result for _, result in good])
    freedom = np.maximum(samples - 1, 1)
    variances = (np.nan_to_num(errors) / student.ppf(0.975, freedom)) ** 2
    places = [place for place, _ in good]
    return Sets(
        quantiles[places], [values[place] for place in places], outputs, variances, freedom, failures, impossible
    )


def _emulated(sets: Sets, nominal: SimulationResult, place: int) -> tuple[Runs, Emulated]:
    numerical = _quantity(nominal, OUTPUTS[place]).numerical_error or 0.0
    runs = Runs(
        sets.quantiles,
        sets.outputs[:, place],
        sets.variances[:, place],
        sets.freedom[:, place],
        (numerical / NORMAL) ** 2,
    )
    return runs, emulated(runs)


def _quantity(nominal: SimulationResult, name: str) -> Quantity:
    return Quantity.from_dict(nominal.as_dict()[name])


def _output(
    nominal: SimulationResult, name: str, spread: Spread, fitted: Emulated, inputs: int, seed: int, *, independent: bool
) -> OutputRange:
    quantity = _quantity(nominal, name)
    if not (spread.by_emulator and independent):
        return OutputRange(quantity, spread, None, None)
    found = sobol(fitted, inputs + 1, seed)
    return OutputRange(quantity, spread, Indices(found.first[:-1], found.total[:-1]), found.total[-1])


def _notes(sets: Sets, spreads: Sequence[Spread], count: int, target: float) -> tuple[str, ...]:
    notes = []
    lost = len(sets.failures) + len(sets.impossible)
    if lost:
        notes.append(
            f"{lost} input sets gave no result and are left out: {(*map(str, sets.failures), *sets.impossible)[0]}"
        )
    for name, spread in zip(OUTPUTS, spreads, strict=True):
        if spread.hidden:
            notes.append(
                f"{name}: noise hides the inputs; raise numerics.replicates or numerics.turns in uncertain.set"
            )
        elif not spread.by_emulator:
            notes.append(
                f"{name}: emulators foretell too little of it (Q2 {spread.q2:.2f} of at most {spread.ceiling:.2f}) to say which "
                "input makes it"
            )
        if spread.known > target:
            notes.append(
                f"{name}: after {count} input sets an end of its range is known to {100.0 * spread.known:.0f} % of its width only"
            )
    return tuple(notes)
