"""Input sets of a scene whose inputs are not known: which inputs vary, the scenes at values of them, their runs."""

import copy
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import t as student

from doe import clearance
from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.running.failure import Failure, sentence
from doe.study_file.table import fields
from doe.unknown import laws, screening
from doe.unknown.joint import Joint
from rbdyn.faults import InputError, RunError, read_toml, refuse, set_key
from rbdyn.records.cells import NUMBER
from rbdyn.records.kept import digest_of
from rbdyn.records.words import shown
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene, rollers_only
from rbdyn.scene.uncertain import Sampled, Uncertain
from rbdyn.scene.unknown import Input, inputs_of, value_of, with_values

# Share of input sets that may be impossible or fail.
HOLES = 0.05
SCREENING_SEEDS = 500_000
NORMAL = 1.96  # half-width of a 95 % interval over its standard deviation
# Quantiles of a law at which its scenes must be possible: no plan of as many input sets as we run goes farther out.
ENDS = np.array([1e-3, 1.0 - 1e-3])


@dataclass(frozen=True)
class Sets:
    """Input sets that were run: their ``places`` in what was asked for, their quantiles (n, d), values of the inputs, outputs (n, m), variances of these (n, m) and
    the degrees of freedom behind them (n, m); what became of the others."""

    places: Whole
    quantiles: Array
    inputs: list[dict[str, Any]]
    outputs: Array
    variances: Array
    freedom: Whole
    failures: tuple[Failure, ...]
    impossible: tuple[str, ...]


@dataclass(frozen=True)
class Case:
    """A scene file with what is not known of it: ``every`` input, ``outputs`` that are looked at, by key what stands in the
    rows of a posterior ``sample``, and what is to be doubted of that, in a sentence."""

    source: str
    data: dict[str, Any]
    scene: Scene
    uncertain: Uncertain
    every: list[Input]
    outputs: tuple[str, ...]
    sample: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    doubt: str = ""

    def scenes(
        self,
        inputs: Sequence[Input],
        values: Sequence[Mapping[str, Any]],
        seed: int,
        more: Sequence[str] = (),
        own: Sequence[Sequence[str]] = (),
    ) -> list[Scene | str]:
        """A scene an input set, or why there is none; ``more`` overrides come last, then the set's ``own``."""
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
            overrides = [*self.uncertain.set, f"numerics.seed={seed + number}", *more]
            overrides += own[number] if own else ()
            try:
                tables = with_values(self.data, self.source, by_key, {**row, **tied})
                found.append(Scene.from_dict(tables, self.source, overrides))
            except InputError as error:
                found.append(str(error.faults[0]))
        return found

    @property
    def replicates(self) -> int:
        """Replicates of a run."""
        return Scene.from_dict(self.data, self.source, self.uncertain.set).numerics.replicates

    def unit(self, each: Input) -> float:
        """What the numbers of an input's law multiply."""
        return 1.0 if each.law.times is None else float(value_of(self.scene, each.law.times))

    def joint(self, inputs: Sequence[Input]) -> Joint:
        """How the inputs depend on each other. Raises InputError where correlations contradict each other."""
        keys = [each.key for each in inputs]
        pairs = [pair for pair in self.uncertain.correlation if set(keys).issuperset(pair.keys)]
        columns = tuple(place for place, key in enumerate(keys) if key in self.sample)
        rows = np.column_stack([laws.ranks(self.sample[keys[place]]) for place in columns]) if columns else None
        return Joint(len(keys), laws.copula(keys, pairs), rows, columns)


def tables_of(path: Path, overrides: Sequence[str]) -> dict[str, Any]:
    """Tables of a scene file with keys replaced. Raises InputError."""
    data = copy.deepcopy(read_toml(path))
    for override in overrides:
        set_key(data, override)
    return data


def read_case(path: Path, outputs: Sequence[str], overrides: Sequence[str]) -> Case:
    """A scene file with what is not known of it. Raises InputError, also where all is known."""
    return case_of(str(path), tables_of(path, overrides), outputs)


def case_of(
    source: str,
    data: dict[str, Any],
    outputs: Sequence[str],
    declared: Uncertain | None = None,
    fixed: frozenset[str] = frozenset(),
    beside: Path | None = None,
) -> Case:
    """Tables of a scene with what is not known of it; ``declared``, in the folder ``beside``, counts instead of the scene's
    own, keys ``fixed`` vary otherwise. Raises InputError, also where all is known."""
    scene = rollers_only(Scene.from_dict(data, source))
    uncertain = declared or scene.uncertain or Uncertain()
    folder = beside if declared and beside else Path(source).parent
    sample = {} if uncertain.sample is None else read_sample(folder / uncertain.sample)
    ordered = ((key, [column[place] for place in np.argsort(laws.ranks(column))]) for key, column in sample.items())
    found = {key: Sampled(tuple(column)) for key, column in ordered}
    every = inputs_of(scene, data, uncertain, fixed, found)
    if not every:
        mend = "name keys as \"table.key\" = {law = ...} or leave out defaults = 'none'"
        raise InputError([f"{source}: uncertain: nothing is unknown; {mend}"])
    doubt = "" if uncertain.sample is None else _doubt(folder / uncertain.sample)
    case = Case(source, data, scene, uncertain, every, tuple(outputs), sample, doubt)
    case.joint(every)
    refuse(impossible(case))
    return case


def read_sample(path: Path) -> dict[str, list[Any]]:
    """Columns of a posterior sample by key: numbers, or choices. Raises InputError, also for fewer than two rows."""
    header, rows = fields(path)
    if len(rows) < 2:
        raise InputError([f"{path}: has one row; a sample needs two at least"])
    columns: dict[str, list[Any]] = {}
    for key, *texts in zip(header, *rows, strict=True):
        numbers = all(NUMBER.fullmatch(text.strip()) for text in texts)
        columns[key] = [float(text) if numbers else text.strip() for text in texts]
    return columns


def _doubt(sample: Path) -> str:
    """What the record beside a posterior sample says of its calibration, unless that succeeded; empty without a record."""
    try:
        record = json.loads(sample.with_suffix(".json").read_text(encoding="utf-8"))
        verdict, same = record["verdict"], record["sha256"] == digest_of(sample.read_bytes())
        reason = next(iter(record["reasons"]), "")
    except (OSError, ValueError, KeyError, TypeError):
        return ""
    return f"{sample.name} is of a rig that ended {verdict}: {reason}" if same and verdict != "calibrated" else ""


def impossible(case: Case) -> Iterator[str]:
    """What is wrong with the scene at an end of each declared law, one by one, and at rows of a sample with an end of a column."""
    sampled = [each for each in case.every if each.key in case.sample]
    ends = {row for each in sampled for row in np.argsort(laws.ranks(case.sample[each.key]))[[0, -1]].tolist()}
    for row in sorted(ends):
        (found,) = case.scenes(sampled, [{each.key: case.sample[each.key][row] for each in sampled}], 0)
        if isinstance(found, str):
            yield f"{case.source}: uncertain.sample, row {row + 2}: {found.removeprefix(f'{case.source}: ')}; take the row out"
    for each in case.every:
        if each.key in case.sample or each.reason != "declared":
            continue
        for value in dict.fromkeys(laws.values_of(each.law, ENDS)):
            (found,) = case.scenes([each], [{each.key: value}], 0)
            if isinstance(found, str):
                why = found.removeprefix(f"{case.source}: ")
                yield f'{case.source}: uncertain."{each.key}" at {shown(value)}: {why}; mend its law'
                break


def screened(case: Case, simulations: Simulations) -> tuple[list[Input], dict[str, float]]:
    """The inputs that vary, of too many those that matter; and the largest share of each of the others.

    What a sample or the scene declares stays. Raises RunError, InputError, KeyboardInterrupt.
    """
    every, tried = case.every, [each for each in case.every if each.key not in case.sample]
    if len(every) <= case.uncertain.inputs or not tried:
        return every, {}
    quantiles = screening.two_levels(len(tried))
    with_middle = np.column_stack([quantiles, np.full(len(quantiles), 0.5)])
    sets = run(case, tried, with_middle, simulations, SCREENING_SEEDS, title="screening")
    positive = (sets.outputs > 0.0).all(axis=0)
    outputs = np.where(positive, np.log(np.where(positive, sets.outputs, 1.0)), sets.outputs)
    share = screening.shares(sets.quantiles[:, :-1], outputs)
    declared = [place for place, each in enumerate(tried) if each.key in case.uncertain.laws]
    stay = screening.kept(share, declared, case.uncertain.inputs - len(every) + len(tried))
    left = {tried[place].key: float(share[place].max()) for place in range(len(tried)) if place not in stay}
    return [each for each in every if each.key not in left], left


def run(
    case: Case,
    inputs: Sequence[Input],
    quantiles: Array,
    simulations: Simulations,
    seeds: int = 0,
    more: Sequence[str] = (),
    title: str = "input sets",
    own: Sequence[Sequence[str]] = (),
) -> Sets:
    """Run input sets, with overrides ``more`` for all and its ``own`` for each. Raises RunError where too many are impossible or fail, InputError, KeyboardInterrupt."""
    values = laws.table_of({each.key: each.law for each in inputs}, quantiles)
    scenes = case.scenes(inputs, values, case.scene.numerics.seed + clearance.INPUT_SEEDS + seeds, more, own)
    ran = outcomes(scenes, [f"{title} {place + 1}" for place in range(len(scenes))], simulations, title)
    good = [(place, result) for place, result in enumerate(ran) if not isinstance(result, Failure | str)]
    failures = tuple(result for result in ran if isinstance(result, Failure))
    impossible = tuple(result for result in ran if isinstance(result, str))
    check_holes(len(ran) - len(good), len(ran), failures, impossible)
    outputs, variances, freedom = scattered(case.outputs, [result for _, result in good])
    places = np.array([place for place, _ in good], dtype=np.int64)
    inputs_there = [values[place] for place in places]
    return Sets(places, quantiles[places], inputs_there, outputs, variances, freedom, failures, impossible)


def outcomes(
    scenes: Sequence[Scene | str], labels: Sequence[str], simulations: Simulations, title: str
) -> list[SimulationResult | Failure | str]:
    """Of each scene its result or failure, of what is no scene why. Raises KeyboardInterrupt."""
    possible = [(scene, label) for scene, label in zip(scenes, labels, strict=True) if isinstance(scene, Scene)]
    asked, named = [scene for scene, _ in possible], [label for _, label in possible]
    ran = iter(simulations.run(asked, named, simulations.progress(title)))
    return [next(ran) if isinstance(scene, Scene) else scene for scene in scenes]


def check_holes(lost: int, sets: int, failures: Sequence[Failure], impossible: Sequence[str], where: str = "") -> None:
    """Raises RunError where too many input sets are lost."""
    if lost > HOLES * sets:
        why = sentence(failures) if failures else impossible[0]
        many = f"{lost} of {sets} input sets gave no result{where}, more than {100.0 * HOLES:g} %"
        raise RunError(f"{many}: {why}; narrow the laws of the inputs")


def scattered(names: Sequence[str], results: Sequence[SimulationResult]) -> tuple[Array, Array, Whole]:
    """Outputs (n, m) of results, their variances by what replicates scatter, and the degrees of freedom behind these."""
    outputs, errors, samples = clearance.figures(names, results)
    freedom = np.maximum(samples - 1, 1)
    return outputs, (np.nan_to_num(errors) / student.ppf(0.975, freedom)) ** 2, freedom
