"""Input sets of a scene with unknown inputs: which inputs vary, the scenes at their values, and the runs of these."""

import copy
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.stats import t as student

from doe import clearance
from doe.clearance import Simulations, work_of
from doe.duty import Duty, Run, Simulated, cages_of, over_points
from doe.emulator import NoisyValues
from doe.running.store import Failure, sentence
from doe.unknown import inputs as unknown
from doe.unknown.inputs import Joint
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import (
    Claims,
    InputError,
    RunError,
    assignment_faults,
    key_path,
    one_line,
    read_toml,
    refuse,
    set_key,
    validated,
)
from rbdyn.base.files import digest_of, read_json
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record
from rbdyn.base.tables.sheet import read_sheet
from rbdyn.base.words import shown
from rbdyn.scene import Scene, rollers_only
from rbdyn.scene.keys import key_values, unknown_keys
from rbdyn.scene.uncertain import MARKING, Law, Sampled, Uncertain
from rbdyn.scene.unknown import Input, documented_of, inputs_of, is_number, value_of, with_values

HOLES = 0.05  # share of input sets that may be impossible or fail
SCREENING_SEEDS = 500_000
FARTHEST = np.array([1e-3, 1.0 - 1e-3])  # quantiles at which a law's scenes must be possible: no plan goes farther out
CHECKS = 16  # input sets that are checked before anything runs
ROUND_SEEDS = 10_000  # of further replicates of the same input sets


class Sets(Record):
    """Input sets with results, and the failures of the others.

    ``places`` (n,) in the plan, quantiles (n, d) and values of the inputs, outputs (n, m). ``impossible``: why a scene could not
    be built. ``cages`` (n,): part of the replicates whose cage has one of the classes of the case, at the worst point of a duty.
    """

    places: Whole
    quantiles: Array
    inputs: list[dict[str, Any]]
    outputs: NoisyValues
    failures: tuple[Failure, ...]
    impossible: tuple[str, ...]
    cages: Array

    @property
    def signals(self) -> Array:
        """Outputs (n, m) on the scale of the main effects: logarithms of those that are positive throughout."""
        values = self.outputs.values
        positive = (values > 0.0).all(axis=0)
        return np.where(positive, np.log(np.where(positive, values, 1.0)), values)

    def joined(self, other: "Sets") -> "Sets":
        """The common sets with the replicates of both, equally many of each."""
        places = np.intersect1d(self.places, other.places)
        ours, theirs = (np.flatnonzero(np.isin(sets.places, places)) for sets in (self, other))
        return Sets(
            places,
            self.quantiles[ours],
            [self.inputs[row] for row in ours],
            self.outputs.at(ours).averaged(other.outputs.at(theirs)),
            (*self.failures, *other.failures),
            self.impossible,
            0.5 * (self.cages[ours] + other.cages[theirs]),
        )


class Case(Record):
    """A scene file with its unknown inputs, ``every`` one, and the ``outputs`` that are studied.

    ``sample``: columns of a posterior sample by key, with the ``doubt`` about it in a sentence. ``remarks``: sentences on
    keys that do not vary. ``home``: the file that declares the inputs. With a ``duty`` outputs are figures at its points.
    ``classes``: that a study allows its cage.
    """

    source: str
    data: dict[str, Any]
    scene: Scene
    uncertain: Uncertain
    every: list[Input]
    outputs: tuple[str, ...]
    sample: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    doubt: str = ""
    remarks: Notes = ()
    home: str = ""
    duty: Duty | None = None
    classes: tuple[str, ...] = ()

    def scenes(
        self,
        inputs: Sequence[Input],
        values: Sequence[Mapping[str, Any]],
        seed: int,
        overrides: Sequence[str] = (),
        set_overrides: Sequence[Sequence[str]] = (),
    ) -> list[Scene | str]:
        """A scene for each input set, or the sentence why there is none.

        ``overrides`` apply to all sets, then ``set_overrides`` to each. Numbers that multiply another key's value
        multiply its value after these.
        """
        by_key = laws_of(self.every)
        keys = {unknown_input.key for unknown_input in inputs}
        # A fixed input that multiplies a varying one keeps its ratio to that.
        tied_values = {
            key: own_value / value_of(self.scene_of_sets, law.times)
            for key, law in by_key.items()
            if key not in keys and law.times in keys and is_number(own_value := value_of(self.scene_of_sets, key))
        }
        shared = self.tables(overrides)
        scenes: list[Scene | str] = []
        for number, row in enumerate(values):
            try:
                tables = copy.deepcopy(shared)
                for override in set_overrides[number] if set_overrides else ():
                    set_key(tables, override)
                tables.setdefault("numerics", {})["seed"] = seed + number
                varied = with_values(tables, self.source, by_key, {**row, **tied_values})
                scenes.append(Scene.from_dict(varied, self.source))
            except InputError as error:
                scenes.append(str(error.faults[0]))
        return scenes

    def tables(self, overrides: Sequence[str] = ()) -> dict[str, Any]:
        """Tables of the scene of input sets, with these ``overrides``. Raises InputError."""
        tables = copy.deepcopy(self.data)
        for override in (*self.uncertain.assignments, *overrides):
            set_key(tables, override, f"{self.home}: uncertain.set")
        return tables

    @cached_property
    def scene_of_sets(self) -> Scene:
        """The scene of input sets with all inputs at the scene's values. Raises InputError."""
        return rollers_only(Scene.from_dict(self.tables(), f"{self.home}: uncertain.set"))

    @property
    def notes(self) -> Notes:
        """Notes on the inputs: the doubt about the sample, and the remarks."""
        return (Note("inputs", self.doubt), *self.remarks) if self.doubt else self.remarks

    @property
    def replicates(self) -> int:
        """Replicates of a run."""
        return self.scene_of_sets.numerics.replicates

    def unit(self, unknown_input: Input) -> float:
        """Factor on the numbers of an input's law: the value of the key that it multiplies, or 1."""
        return 1.0 if unknown_input.law.times is None else float(value_of(self.scene_of_sets, unknown_input.law.times))

    def joint(self, inputs: Sequence[Input]) -> Joint:
        """The joint distribution of the inputs."""
        keys = [unknown_input.key for unknown_input in inputs]
        columns = tuple(place for place, key in enumerate(keys) if key in self.sample)
        rows = np.column_stack([unknown.ranks(self.sample[keys[place]]) for place in columns]) if columns else None
        return Joint(len(keys), rows, columns)


def laws_of(inputs: Sequence[Input]) -> dict[str, Law | Sampled]:
    """Laws of inputs by key."""
    return {unknown_input.key: unknown_input.law for unknown_input in inputs}


def tables_of(path: Path, overrides: Sequence[str]) -> dict[str, Any]:
    """Tables of a scene file with keys replaced. Raises InputError."""
    data = copy.deepcopy(read_toml(path))
    for override in overrides:
        set_key(data, override)
    return data


def read_case(path: Path, outputs: Sequence[str], overrides: Sequence[str]) -> Case:
    """A scene file with its unknown inputs. Raises InputError, also if no input is unknown."""
    case = case_of(str(path), tables_of(path, overrides), outputs)
    check_overrides(overrides, case.every)
    return case


NOTHING: Mapping[str, str] = MappingProxyType({})


def check_overrides(overrides: Sequence[str], inputs: Sequence[Input], fixed: Mapping[str, str] = NOTHING) -> None:
    """Raises InputError for overrides that no run has: of inputs, unless their ranges follow them, and of ``fixed`` keys."""
    claims = {
        unknown_input.key: (
            f"the {unknown_input.law.law} law of this unknown input replaces it; take one of them out, or multiply the value "
            "by times"
        )
        for unknown_input in inputs
        if unknown_input.law.times != unknown_input.key and not unknown_input.about_value
    }
    claims |= {key: f"is {what}, whose value each run has; leave it out" for key, what in fixed.items()}
    claimed = Claims({tuple(key.split(".")): reason for key, reason in claims.items()})
    refuse(
        f"--set {override}: {reason}" for override in overrides if (reason := claimed.reason_for(key_path(override)))
    )


def override_notes(case: Case, overrides: Sequence[str], runs: str = "") -> list[Note]:
    """Notes on the runs that each --set of a numerics key changes.

    Input sets have the keys of uncertain.set, so that only other ``runs``, if any, have the override.
    """
    notes = run_notes(case, overrides, "--set ", runs)
    clashing = {key_path(override) for override in _clashing(case, overrides)}
    numerics = [override for override in overrides if key_path(override)[:1] == ("numerics",)]
    others = [override for override in numerics if key_path(override) not in clashing]
    return [*notes, Note("remark", f"--set {', '.join(others)} changes every run")] if others else notes


def run_notes(case: Case, overrides: Sequence[str], source: str, runs: str = "") -> list[Note]:
    """A note on overrides by a ``source``, an option or a key, that uncertain.set replaces in the input sets, if any."""
    declared = {key_path(override): override for override in case.uncertain.assignments}
    clashing = _clashing(case, overrides)
    if not clashing:
        return []
    values = ", ".join(declared[key_path(override)] for override in clashing)
    change = f"changes {runs}, not the input sets: uncertain.set gives these"
    change = change if runs else "changes no run: uncertain.set gives all of them"
    return [Note("inputs", f"{source}{', '.join(clashing)} {change} {values}")]


def _clashing(case: Case, overrides: Sequence[str]) -> list[str]:
    """Overrides of numerics for which uncertain.set has another value."""
    paths = {key_path(override): override for override in case.uncertain.assignments}
    values = {path: override for path, override in paths.items() if path[:1] == ("numerics",)}
    return [override for override in overrides if values.get(key_path(override), override) != override]


def case_of(
    source: str,
    data: dict[str, Any],
    outputs: Sequence[str],
    declared: Uncertain | None = None,
    fixed: Mapping[str, str] = NOTHING,
    stated_in: Path | None = None,
) -> Case:
    """Tables of a scene with its unknown inputs.

    ``declared`` counts before the scene's own declarations, key by key; its paths start from the folder of the file that it
    is ``stated_in``. ``fixed``: by key what else sets it, such as a factor. Raises InputError, also if no input is unknown.
    """
    scene = rollers_only(Scene.from_dict(data, source))
    home = stated_in if declared and stated_in else Path(source)
    uncertain = declared or scene.uncertain or Uncertain()
    if declared and scene.uncertain:
        uncertain = validated(Uncertain, declared.over(scene.uncertain), f"{home} over {source}: uncertain")
    folder = (home if declared and declared.sample else Path(source)).parent
    sample = {} if uncertain.sample is None else read_sample(folder / uncertain.sample, uncertain.laws)
    ordered = ((key, [column[place] for place in np.argsort(unknown.ranks(column))]) for key, column in sample.items())
    columns = {key: Sampled(tuple(column)) for key, column in ordered}
    # Runs do not depend on declarations, and checking these again at every input set would be slow.
    plain = clearance.undeclared(data, scene)
    case = Case(source, plain, scene, uncertain, [], tuple(outputs), sample, home=str(home))
    refuse(f"{home}: {fault}" for fault in _set_faults(uncertain, fixed, sample))
    inputs = inputs_of(case.scene_of_sets, case.tables(), uncertain, fixed, columns, str(home))
    if not inputs:
        fix = "name keys as \"table.key\" = {law = ...} or leave out defaults = 'none'"
        raise InputError(f"{home}: uncertain: nothing is unknown; {fix}")
    keys = {unknown_input.key for unknown_input in inputs}
    inputs_without_set = inputs_of(case.scene_of_sets, plain, uncertain, fixed, columns)
    by_set = [unknown_input.key for unknown_input in inputs_without_set if unknown_input.key not in keys]
    active = keys | fixed.keys() | {*by_set, *MARKING}
    idle_keys = [key for key in uncertain.estimated if key not in active]
    doubt = "" if uncertain.sample is None else _doubt(folder / uncertain.sample)
    constant = {*by_set, *fixed, *keys}
    exact = [
        entry.key for entry in documented_of(case.scene_of_sets) if not entry.on_request and entry.key not in constant
    ]
    remarks = tuple(Note("inputs", text) for text in _remarks(len(keys), by_set, idle_keys, exact))
    case = replace(case, every=inputs, doubt=doubt, remarks=remarks)
    case.joint(inputs)
    refuse(impossible(case))
    return case


def _set_faults(uncertain: Uncertain, fixed: Mapping[str, str], sample: Iterable[str]) -> list[str]:
    """Faults of overrides in ``set`` without effect: each run or each row of the sample has its own value."""
    claims = {key: f"is {what}, whose value each run has; leave it out" for key, what in fixed.items()}
    claims |= dict.fromkeys(sample, "is a column of the sample; keep one of them")
    paths = {tuple(key.split(".")): reason for key, reason in claims.items()}
    return assignment_faults("uncertain.set", uncertain.set, paths)


def _remarks(varying: int, by_set: Sequence[str], idle_keys: Sequence[str], exact: Sequence[str]) -> Iterator[str]:
    """Remarks on keys that do not vary: stated ones, those that ``set`` fixes, and estimates without effect in the scene."""
    reasons = {"known by uncertain.set": by_set, "stated as exact, or left out by uncertain.defaults": exact}
    if by_set or exact:
        others = "; ".join(f"{reason}: {', '.join(keys)}" for reason, keys in reasons.items() if keys)
        yield f"{varying} of {varying + len(by_set) + len(exact)} inputs vary, the others count as exact ({others})"
    if idle_keys:
        yield f"estimated, but without effect in this scene, so they do not vary: {', '.join(idle_keys)}"


def read_sample(path: Path, declared: Mapping[str, Law]) -> dict[str, list[Any]]:
    """Columns of a posterior sample by key, with the values of ``declared`` laws or else of the keys in a scene.

    Raises InputError for cells that are no values of their key, and for fewer than two rows.
    """
    sheet = read_sheet(path)
    sheet.refuse_nameless()
    refuse(f"{path}: {fault}" for fault in unknown_keys(sheet.places))
    if len(sheet.rows) < 2:
        raise InputError(f"{path}: has one row; a sample needs two at least")
    columns, faults = dict[str, list[Any]](), list[str]()
    for key in sheet.places:
        choices = declared[key].values if key in declared else None
        columns[key], slips = key_values(sheet.column(key), choices or ())
        faults += slips
    refuse(faults)
    return columns


def _doubt(sample: Path) -> str:
    """The verdict on the calibration that made a posterior sample, unless that succeeded; empty without a record."""
    try:
        record = read_json(sample.with_suffix(".json"))
        verdict, unchanged = str(record["verdict"]), record["sha256"] == digest_of(sample.read_bytes())
        reason = next(iter(record["reasons"]), "")
    except (OSError, ValueError, KeyError, TypeError):
        return ""
    doubt = one_line(f"{sample.name} is of a rig that ended {verdict}: {reason}")
    return doubt if unchanged and verdict != "calibrated" else ""


def impossible(case: Case) -> Iterator[str]:
    """Faults of the scene at the ends of each declared law, at each choice, and at the extreme rows of a sample.

    If there are none, input sets of all inputs are checked too.
    """
    faults = [*_impossible_rows(case), *_impossible_values(case)]
    yield from faults
    if faults:
        return
    values = unknown.table_of(laws_of(case.every), case.joint(case.every).sets(CHECKS, case.uncertain.seed))
    runs = over_points(case.duty, lambda overrides: case.scenes(case.every, values, 0, overrides))
    sentences = [run for run in runs if isinstance(run, str)]
    if 2 * len(sentences) > CHECKS:
        yield f"{case.home}: uncertain: inputs are impossible together: {_bare(case, sentences[0])}; change their laws"


def _impossible_rows(case: Case) -> Iterator[str]:
    sampled = [unknown_input for unknown_input in case.every if unknown_input.key in case.sample]
    columns = {unknown_input.key: case.sample[unknown_input.key] for unknown_input in sampled}
    ends = {row for column in columns.values() for row in np.argsort(unknown.ranks(column))[[0, -1]].tolist()}
    for row in sorted(ends):
        (scene,) = case.scenes(sampled, [{key: column[row] for key, column in columns.items()}], 0)
        if isinstance(scene, str):
            yield f"{case.home}: uncertain.sample, row {row + 2}: {_bare(case, scene)}; take the row out"


def _impossible_values(case: Case) -> Iterator[str]:
    for unknown_input in case.every:
        if unknown_input.key in case.sample or unknown_input.reason != "declared":
            continue
        choices = unknown_input.law.values if unknown_input.law.law == "choices" else None
        for value in choices or dict.fromkeys(unknown.values_of(unknown_input.law, FARTHEST)):
            (scene,) = case.scenes([unknown_input], [{unknown_input.key: value}], 0)
            if isinstance(scene, str):
                yield f'{case.home}: uncertain."{unknown_input.key}" at {shown(value)}: {_bare(case, scene)}; change its law'
                break


def _bare(case: Case, fault: str) -> str:
    """A fault without the file of the scene."""
    return fault.removeprefix(f"{case.source}: ")


def screen_inputs(case: Case, simulations: Simulations) -> tuple[list[Input], dict[str, float]]:
    """The target inputs of a calibration, and by key of the others the largest share of an output's variance.

    Of too many inputs the most effective ones remain, and those that a sample or the scene declares. Raises RunError,
    InputError, KeyboardInterrupt.
    """
    inputs = case.every
    candidates = [unknown_input for unknown_input in inputs if unknown_input.key not in case.sample]
    if len(inputs) <= case.uncertain.inputs or not candidates:
        return inputs, {}
    quantiles = unknown.screening_design(len(candidates))
    with_middle = np.column_stack([quantiles, np.full(len(quantiles), 0.5)])
    sets = run(case, candidates, with_middle, simulations, SCREENING_SEEDS, title="screening")
    share = unknown.effect_shares(sets.quantiles[:, :-1], sets.signals)
    declared = [place for place, unknown_input in enumerate(candidates) if unknown_input.key in case.uncertain.laws]
    places = unknown.retained(share, declared, case.uncertain.inputs - len(inputs) + len(candidates))
    shares_of_fixed = {
        candidates[place].key: float(share[place].max()) for place in range(len(candidates)) if place not in places
    }
    return [unknown_input for unknown_input in inputs if unknown_input.key not in shares_of_fixed], shares_of_fixed


def run(
    case: Case,
    inputs: Sequence[Input],
    quantiles: Array,
    simulations: Simulations,
    seeds: int = 0,
    overrides: Sequence[str] = (),
    title: str = "input sets",
    set_overrides: Sequence[Sequence[str]] = (),
) -> Sets:
    """Run input sets, with ``overrides`` for all and ``set_overrides`` for each.

    Raises RunError if too many are impossible or fail, InputError, KeyboardInterrupt.
    """
    values = unknown.table_of(laws_of(inputs), quantiles)
    seed = case.scene.numerics.seed + clearance.INPUT_SEEDS + seeds
    runs = over_points(case.duty, lambda sets: case.scenes(inputs, values, seed, [*overrides, *sets], set_overrides))
    impossible = tuple(run for run in runs if isinstance(run, str))
    check_holes(len(impossible), len(runs), (), impossible)
    results = outcomes(runs, [f"{title} {place + 1}" for place in range(len(runs))], simulations, title)
    successes = [(place, result) for place, result in enumerate(results) if not isinstance(result, Failure | str)]
    failures = tuple(result for result in results if isinstance(result, Failure))
    check_holes(len(results) - len(successes), len(results), failures, impossible)
    outputs = outputs_with_scatter(case.outputs, [result for _, result in successes])
    places = np.array([place for place, _ in successes], dtype=np.int64)
    inputs_there = [values[place] for place in places]
    verdicts = [cages_of(result).values() for _, result in successes]
    cages = np.array([min((found.part_of(case.classes) for found in each), default=0.0) for each in verdicts])
    return Sets(places, quantiles[places], inputs_there, outputs, failures, impossible, cages)


def replicated_sets(case: Case, quantiles: Array, simulations: Simulations, effort: int) -> Sets:
    """Input sets at quantiles (n, d + 1) of every input with ``effort`` times the replicates, a power of two.

    The runs with half as many replicates are among them. Raises as ``run``.
    """
    sets = run(case, case.every, quantiles, simulations)
    for doubling in range(effort.bit_length() - 1):
        overrides = [f"numerics.replicates={case.replicates << doubling}"]
        sets = sets.joined(run(case, case.every, quantiles, simulations, (doubling + 1) * ROUND_SEEDS, overrides))
    return sets


def strongest_inputs(case: Case, quantiles: Array, signals: Array) -> tuple[list[int], dict[str, float]]:
    """Places of the inputs of emulators of signals (n, m) at quantiles (n, d + 1) of every input.

    They are the inputs that a sample or the scene declares and the most effective others, as many as the scene allows. By
    key of the rest, which vary too: the largest share of a signal's variance by its main effect.
    """
    places = unknown.strongest(quantiles[:, :-1], signals, case.uncertain.inputs, declared(case))
    return places, shares_outside(case, places, quantiles, signals)


def declared(case: Case) -> list[int]:
    """Places of the inputs that a sample or the scene declares."""
    keys = {*case.uncertain.laws, *case.sample}
    return [place for place, unknown_input in enumerate(case.every) if unknown_input.key in keys]


def shares_outside(case: Case, places: Collection[int], quantiles: Array, signals: Array) -> dict[str, float]:
    """By key of the inputs outside ``places``: the largest share of a signal's variance by the main effect."""
    share = unknown.main_effects(quantiles[:, :-1], signals).max(axis=1)
    return {
        unknown_input.key: float(share[place]) for place, unknown_input in enumerate(case.every) if place not in places
    }


def outcomes(
    runs: Sequence[Run | str], labels: Sequence[str], simulations: Simulations, title: str
) -> list[Simulated | Failure | str]:
    """Results or failures of runs; a sentence in place of a run is handed through. Raises KeyboardInterrupt."""
    possible = [(run, label) for run, label in zip(runs, labels, strict=True) if not isinstance(run, str)]
    progress = simulations.progress(title)
    results = iter(simulations.run([run for run, _ in possible], [label for _, label in possible], progress))
    return [run if isinstance(run, str) else next(results) for run in runs]


def check_holes(
    count: int, sets: int, failures: Sequence[Failure], impossible: Sequence[str], condition: str = ""
) -> None:
    """Raises RunError if too many input sets have no result."""
    if count > HOLES * sets:
        cause = sentence(failures) if failures else impossible[0]
        raise RunError(
            f"{count} of {sets} input sets gave no result{condition}, more than {100.0 * HOLES:g} %: {cause}; narrow the "
            "laws of the inputs"
        )


def outputs_with_scatter(names: Sequence[str], results: Sequence[Simulated]) -> NoisyValues:
    """Outputs (n, m) of results."""
    outputs, errors, samples = clearance.figures(names, results)
    freedom = np.maximum(samples - 1, 1)
    return NoisyValues(outputs, (np.nan_to_num(errors) / student.ppf(0.975, freedom)) ** 2, freedom)


def work_of_set(case: Case) -> float:
    """Shaft turns that the run of an input set takes at least."""
    return work_of(Scene.from_dict(case.data, case.source, case.uncertain.assignments))
