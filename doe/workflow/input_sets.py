"""Input sets of a scene with unknown inputs: which inputs vary, the scenes at values of them, their runs; and columns of tables that are keys
of a scene.


"""

import copy
import difflib
import math
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any, get_args

import numpy as np
from pydantic import BaseModel, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo
from scipy.stats import t as student

from doe import clearance
from doe.clearance import Simulations
from doe.running.store import Failure, sentence
from doe.study_file.table import LONGEST_NUMBER, WHOLE, Column, read_sheet
from doe.study_file.table import is_number as is_numeral
from doe.unknown import inputs as unknown
from doe.unknown.inputs import Joint
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import (
    LONGEST_NAME,
    MOST_FAULTS,
    Claims,
    InputError,
    RunError,
    assignment_faults,
    key_path,
    one_line,
    read_toml,
    refuse,
    set_key,
)
from rbdyn.base.storage import digest_of
from rbdyn.base.words import shown
from rbdyn.result import SimulationResult, read_json
from rbdyn.scene import Scene, rollers_only
from rbdyn.scene.uncertain import Law, Sampled, Uncertain
from rbdyn.scene.unknown import Input, inputs_of, is_number, put, value_of, with_values

# Of a whole number, as in TOML.
LARGEST_BITS = 63


def key_values(column: Column, choices: Sequence[Any] = ()) -> tuple[list[Any], list[str]]:
    """Values (n,) of the scene's key that a column is named by, and a sentence for each cell that has none.

    One of the ``choices`` that the key's law states stays as it is stated; else the key's type in a scene decides what is
    number, boolean or text.
    """
    adapter, known = _adapter(column.name), dict[str, Any]()
    faults = []
    for row, text in enumerate(column.texts):
        if text not in known:
            known[text] = next(_accepted(text, adapter, choices), None)
        if known[text] is None:
            faults.append(column.fault(row, _words(column.name, text)))
    return [known[text] for text in column.texts], faults


def unknown_keys(keys: Iterable[str]) -> list[str]:
    """A sentence for each column whose name is no key of a scene; the first ones name the nearest key."""
    sentences = list[str]()
    for key in keys:
        table, _, name = key.rpartition(".")
        known = _fields(key)
        if name not in known:
            # To look for the nearest name takes longer than all else; nobody reads beyond the first sentences.
            near = difflib.get_close_matches(name[:LONGEST_NAME], known, n=1) if len(sentences) < MOST_FAULTS else []
            fix = f"did you mean {table}.{near[0]}?" if near else "rename or remove it"
            sentences.append(f"column {one_line(key, LONGEST_NAME)}: unknown key; {fix}")
    return sentences


def _readings(text: str) -> list[Any]:
    """What a text may mean, the narrowest type first."""
    readings: list[Any] = [text.lower() == "true"] if text.lower() in ("true", "false") else []
    if is_numeral(text) and math.isfinite(float(text)):
        whole = WHOLE.fullmatch(text) and int(text).bit_length() <= LARGEST_BITS
        readings += [int(text), float(text)] if whole else [float(text)]
    return [*readings, text]


def _accepted(text: str, adapter: TypeAdapter[Any], choices: Sequence[Any]) -> Iterator[Any]:
    """Values that a text may stand for, the likeliest first."""
    readings = _readings(text)
    stated = [choice for choice in choices if any(_alike(choice, reading) for reading in readings)]
    if len(stated) == 1:
        yield stated[0]
    for reading in stated or readings:
        try:
            yield adapter.validate_python(reading, strict=True)
        except ValidationError:
            continue


def _alike(choice: Any, reading: Any) -> bool:
    """Whether a reading is a choice: of one type, or both numbers."""
    if isinstance(choice, str) and isinstance(reading, str):
        return choice.strip() == reading
    kinds = {type(choice), type(reading)}
    return (len(kinds) == 1 or kinds == {int, float}) and bool(choice == reading)


def _words(key: str, text: str) -> str:
    if not text:
        return "is empty; fill it in or remove the row"
    if len(text) > LONGEST_NUMBER:
        return f"is longer than {LONGEST_NUMBER} characters; write a shorter value"
    return f"is no value of that key; rbdyn keys {key} lists which are"


def _adapter(key: str) -> TypeAdapter[Any]:
    """What accepts the values of a dotted key of a scene."""
    field = _fields(key)[key.rpartition(".")[2]]
    limited: Any = Annotated[field.annotation, *field.metadata] if field.metadata else field.annotation
    return TypeAdapter(limited)


def _fields(key: str) -> dict[str, FieldInfo]:
    """Fields of the table that a dotted key is in; none where no scene has that table."""
    models: list[type[BaseModel]] = [Scene]
    for part in key.split(".")[:-1]:
        fields = [model.model_fields[part] for model in models if part in model.model_fields]
        models = [inner for field in fields for inner in _models(field.annotation)]
    return {name: field for model in models for name, field in model.model_fields.items()}


def _models(annotation: Any) -> list[type[BaseModel]]:
    """Tables that an annotation allows."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for each in get_args(annotation) for model in _models(each)]


# Share of input sets that may be impossible or fail.
HOLES = 0.05
SCREENING_SEEDS = 500_000
NORMAL = 1.96  # half-width of a 95 % interval over its standard deviation
# Quantiles of a law at which its scenes must be possible: no plan of as many input sets as we run goes farther out.
ENDS = np.array([1e-3, 1.0 - 1e-3])
NOTHING: Mapping[str, str] = MappingProxyType({})
# Input sets that are tried before anything runs.
TRIED = 16
# Seeds of further replicates of the same input sets.
ROUND_SEEDS = 10_000


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

    @property
    def signals(self) -> Array:
        """Outputs (n, m) as main effects are looked for in them: logarithms of those that are positive throughout."""
        positive = (self.outputs > 0.0).all(axis=0)
        return np.where(positive, np.log(np.where(positive, self.outputs, 1.0)), self.outputs)

    def joined(self, other: "Sets") -> "Sets":
        """The sets that both have, with the replicates of both, which are as many in each."""
        places = np.intersect1d(self.places, other.places)
        ours, theirs = (np.flatnonzero(np.isin(each.places, places)) for each in (self, other))
        return Sets(
            places,
            self.quantiles[ours],
            [self.inputs[row] for row in ours],
            0.5 * (self.outputs[ours] + other.outputs[theirs]),
            0.25 * (self.variances[ours] + other.variances[theirs]),
            self.freedom[ours] + other.freedom[theirs] + 1,
            (*self.failures, *other.failures),
            self.impossible,
        )


@dataclass(frozen=True)
class Case:
    """A scene file with its unknown inputs: ``every`` input, ``outputs`` that are looked at, by key what stands in the
    rows of a posterior ``sample``, what is to be doubted of that, in a sentence, ``remarks`` on keys that do not vary, and the file that declares all this as ``home``."""

    source: str
    data: dict[str, Any]
    scene: Scene
    uncertain: Uncertain
    every: list[Input]
    outputs: tuple[str, ...]
    sample: Mapping[str, Sequence[Any]] = field(default_factory=dict)
    doubt: str = ""
    remarks: tuple[str, ...] = ()
    home: str = ""

    def scenes(
        self,
        inputs: Sequence[Input],
        values: Sequence[Mapping[str, Any]],
        seed: int,
        more: Sequence[str] = (),
        own: Sequence[Sequence[str]] = (),
    ) -> list[Scene | str]:
        """A scene an input set, or why there is none; ``more`` overrides come last, then the set's ``own``.

        Numbers that multiply another key's value multiply what the overrides left there.
        """
        by_key = {each.key: each.law for each in self.every}
        keys = {each.key for each in inputs}
        # What multiplies an input that varies goes with it, in the ratio that the scene has.
        tied = {
            key: own_value / value_of(self.ran, law.times)
            for key, law in by_key.items()
            if key not in keys and law.times in keys and is_number(own_value := value_of(self.ran, key))
        }
        shared = self.tables(more)
        scenes: list[Scene | str] = []
        for number, row in enumerate(values):
            try:
                tables = copy.deepcopy(shared)
                for override in own[number] if own else ():
                    set_key(tables, override)
                put(tables, "numerics.seed", seed + number)
                scenes.append(Scene.from_dict(with_values(tables, self.source, by_key, {**row, **tied}), self.source))
            except InputError as error:
                scenes.append(str(error.faults[0]))
        return scenes

    def tables(self, more: Sequence[str] = ()) -> dict[str, Any]:
        """Tables of the scene as input sets run it, with ``more`` overrides. Raises InputError."""
        tables = copy.deepcopy(self.data)
        for override in (*self.uncertain.set, *more):
            set_key(tables, override, f"{self.home}: uncertain.set")
        return tables

    @cached_property
    def ran(self) -> Scene:
        """The scene as input sets run it, before any input has another value. Raises InputError."""
        return rollers_only(Scene.from_dict(self.tables(), f"{self.home}: uncertain.set"))

    @property
    def notes(self) -> tuple[str, ...]:
        """What a reader must know of the inputs."""
        return (self.doubt, *self.remarks) if self.doubt else self.remarks

    @property
    def replicates(self) -> int:
        """Replicates of a run."""
        return self.ran.numerics.replicates

    def unit(self, each: Input) -> float:
        """What the numbers of an input's law multiply."""
        return 1.0 if each.law.times is None else float(value_of(self.ran, each.law.times))

    def joint(self, inputs: Sequence[Input]) -> Joint:
        """How the inputs depend on each other. Raises InputError where correlations contradict each other."""
        keys = [each.key for each in inputs]
        pairs = [pair for pair in self.uncertain.correlation if set(keys).issuperset(pair.keys)]
        columns = tuple(place for place, key in enumerate(keys) if key in self.sample)
        rows = np.column_stack([unknown.ranks(self.sample[keys[place]]) for place in columns]) if columns else None
        return Joint(len(keys), unknown.copula(keys, pairs, self.home), rows, columns)


def tables_of(path: Path, overrides: Sequence[str]) -> dict[str, Any]:
    """Tables of a scene file with keys replaced. Raises InputError."""
    data = copy.deepcopy(read_toml(path))
    for override in overrides:
        set_key(data, override)
    return data


def read_case(path: Path, outputs: Sequence[str], overrides: Sequence[str]) -> Case:
    """A scene file with its unknown inputs. Raises InputError, also where all is known."""
    case = case_of(str(path), tables_of(path, overrides), outputs)
    check_overrides(overrides, case.every)
    return case


def check_overrides(overrides: Sequence[str], inputs: Sequence[Input], fixed: Mapping[str, str] = NOTHING) -> None:
    """Raises InputError for overrides of a scene that no run has: of inputs, unless their laws multiply them, and of keys
    ``fixed`` as something else."""
    claims = {
        each.key: (
            f"the {each.law.law} law of this unknown input replaces it; take one of them out, or multiply the value "
            "by times"
        )
        for each in inputs
        if each.law.times != each.key
    }
    claims |= {key: f"is {what}, whose value each run has; leave it out" for key, what in fixed.items()}
    claimed = Claims({tuple(key.split(".")): reason for key, reason in claims.items()})
    refuse(f"--set {each}: {reason}" for each in overrides if (reason := claimed.on(key_path(each))))


def overriding(case: Case, overrides: Sequence[str], runs: str = "") -> list[str]:
    """Which runs each --set of a numerics key changes: input sets have the keys of uncertain.set, so that only other ``runs``
    follow the override, none where there are no others."""
    notes = run_notes(case, overrides, "--set ", runs)
    clashing = {key_path(each) for each in _clashing(case, overrides)}
    rest = [each for each in overrides if (path := key_path(each))[:1] == ("numerics",) and path not in clashing]
    return [*notes, *([f"--set {', '.join(rest)} changes every run"] if rest else [])]


def run_notes(case: Case, overrides: Sequence[str], by: str, runs: str = "") -> list[str]:
    """That input sets have values of uncertain.set where overrides ``by`` an option or a key have others, if so."""
    given = {key_path(each): each for each in case.uncertain.set}
    clashing = _clashing(case, overrides)
    what = f"changes {runs}, not the input sets" if runs else "changes no run"
    return (
        [
            f"{by}{', '.join(clashing)} {what}: uncertain.set gives {'these' if runs else 'all of them'} "
            f"{', '.join(given[key_path(each)] for each in clashing)}"
        ]
        if clashing
        else []
    )


def _clashing(case: Case, overrides: Sequence[str]) -> list[str]:
    """Overrides of numerics for which uncertain.set has another value."""
    given = {path: each for each in case.uncertain.set if (path := key_path(each))[:1] == ("numerics",)}
    return [each for each in overrides if given.get(key_path(each), each) != each]


def case_of(
    source: str,
    data: dict[str, Any],
    outputs: Sequence[str],
    declared: Uncertain | None = None,
    fixed: Mapping[str, str] = NOTHING,
    stated_in: Path | None = None,
) -> Case:
    """Tables of a scene with its unknown inputs.

    ``declared`` counts instead of the scene's own, with paths from the folder of the file that it is ``stated_in``; keys
    ``fixed`` vary otherwise, each as what it says. Raises InputError, also where all is known.
    """
    scene = rollers_only(Scene.from_dict(data, source))
    uncertain = declared or scene.uncertain or Uncertain()
    home = stated_in if declared and stated_in else Path(source)
    sample = {} if uncertain.sample is None else read_sample(home.parent / uncertain.sample, uncertain.laws)
    ordered = ((key, [column[place] for place in np.argsort(unknown.ranks(column))]) for key, column in sample.items())
    columns = {key: Sampled(tuple(column)) for key, column in ordered}
    # A run depends on no declaration; to check them all again at every input set would take long.
    plain = {table: keys for table, keys in data.items() if table != "uncertain"}
    case = Case(source, plain, scene, uncertain, [], tuple(outputs), sample, home=str(home))
    refuse(f"{home}: {fault}" for fault in _set_faults(uncertain, fixed, sample))
    every = inputs_of(case.ran, case.tables(), uncertain, fixed, columns, str(home))
    if not every:
        raise InputError(
            [
                f'{home}: uncertain: nothing is unknown; name keys as "table.key" = {{law = ...}} or leave out '
                "defaults = 'none'"
            ]
        )
    keys = {each.key for each in every}
    by_set = [each.key for each in inputs_of(case.ran, plain, uncertain, fixed, columns) if each.key not in keys]
    idle = [key for key in uncertain.estimated if key not in keys | fixed.keys() and key not in by_set]
    doubt = "" if uncertain.sample is None else _doubt(home.parent / uncertain.sample)
    case = replace(case, every=every, doubt=doubt, remarks=tuple(_remarks(by_set, idle)))
    case.joint(every)
    refuse(impossible(case))
    return case


def _set_faults(uncertain: Uncertain, fixed: Mapping[str, str], sample: Iterable[str]) -> list[str]:
    """What ``set`` replaces in vain, because each run or each row of the sample has a value of its own."""
    claims = {key: f"is {what}, whose value each run has; leave it out" for key, what in fixed.items()}
    claims |= dict.fromkeys(sample, "is a column of the sample; keep one of them")
    paths = {tuple(key.split(".")): reason for key, reason in claims.items()}
    return assignment_faults("uncertain.set", uncertain.set, paths)


def _remarks(by_set: Sequence[str], idle: Sequence[str]) -> Iterator[str]:
    """Which keys would vary if ``set`` gave them no value, and which are called estimates but mean nothing in the scene."""
    if by_set:
        yield f"known by uncertain.set, so without their documented range: {', '.join(by_set)}"
    if idle:
        yield f"estimated, but without effect in this scene, so they do not vary: {', '.join(idle)}"


def read_sample(path: Path, declared: Mapping[str, Law]) -> dict[str, list[Any]]:
    """Columns of a posterior sample by key; of a choice, what its ``declared`` law or else the key in a scene has there.

    Raises InputError for cells that are no values of their key, and for fewer than two rows.
    """
    sheet = read_sheet(path)
    sheet.refuse_nameless()
    refuse(f"{path}: {fault}" for fault in unknown_keys(sheet.places))
    if len(sheet.rows) < 2:
        raise InputError([f"{path}: has one row; a sample needs two at least"])
    columns, faults = dict[str, list[Any]](), list[str]()
    for key in sheet.places:
        choices = declared[key].values if key in declared else None
        columns[key], slips = key_values(sheet.column(key), choices or ())
        faults += slips
    refuse(faults)
    return columns


def _doubt(sample: Path) -> str:
    """What the record next to a posterior sample says of its calibration, unless that succeeded; empty without a record."""
    try:
        record = read_json(sample.with_suffix(".json"))
        verdict, same = str(record["verdict"]), record["sha256"] == digest_of(sample.read_bytes())
        reason = next(iter(record["reasons"]), "")
    except (OSError, ValueError, KeyError, TypeError):
        return ""
    doubt = one_line(f"{sample.name} is of a rig that ended {verdict}: {reason}")
    return doubt if same and verdict != "calibrated" else ""


def impossible(case: Case) -> Iterator[str]:
    """What is wrong with the scene at an end of each declared law and at each choice, one by one, and at rows of a sample with
    an end of a column; where nothing is, with input sets of all of them."""
    faults = [*_impossible_rows(case), *_impossible_values(case)]
    yield from faults
    if faults:
        return
    sets = case.joint(case.every).sets(TRIED, case.uncertain.seed)
    scenes = case.scenes(case.every, unknown.table_of({each.key: each.law for each in case.every}, sets), 0)
    why = [each for each in scenes if isinstance(each, str)]
    if 2 * len(why) > TRIED:
        yield f"{case.home}: uncertain: inputs are impossible together: {_bare(case, why[0])}; change their laws"


def _impossible_rows(case: Case) -> Iterator[str]:
    sampled = [each for each in case.every if each.key in case.sample]
    ends = {row for each in sampled for row in np.argsort(unknown.ranks(case.sample[each.key]))[[0, -1]].tolist()}
    for row in sorted(ends):
        (scene,) = case.scenes(sampled, [{each.key: case.sample[each.key][row] for each in sampled}], 0)
        if isinstance(scene, str):
            yield f"{case.home}: uncertain.sample, row {row + 2}: {_bare(case, scene)}; take the row out"


def _impossible_values(case: Case) -> Iterator[str]:
    for each in case.every:
        if each.key in case.sample or each.reason != "declared":
            continue
        choices = each.law.values if each.law.law == "choices" else None
        for value in choices or dict.fromkeys(unknown.values_of(each.law, ENDS)):
            (scene,) = case.scenes([each], [{each.key: value}], 0)
            if isinstance(scene, str):
                yield f'{case.home}: uncertain."{each.key}" at {shown(value)}: {_bare(case, scene)}; change its law'
                break


def _bare(case: Case, fault: str) -> str:
    """A fault without the file of the scene."""
    return fault.removeprefix(f"{case.source}: ")


def screened(case: Case, simulations: Simulations) -> tuple[list[Input], dict[str, float]]:
    """The inputs that a calibration looks for, of too many those that matter; and the largest share of each of the others.

    What a sample or the scene declares stays. Raises RunError, InputError, KeyboardInterrupt.
    """
    every, tried = case.every, [each for each in case.every if each.key not in case.sample]
    if len(every) <= case.uncertain.inputs or not tried:
        return every, {}
    quantiles = unknown.screening_design(len(tried))
    with_middle = np.column_stack([quantiles, np.full(len(quantiles), 0.5)])
    sets = run(case, tried, with_middle, simulations, SCREENING_SEEDS, title="screening")
    share = unknown.effect_shares(sets.quantiles[:, :-1], sets.signals)
    declared = [place for place, each in enumerate(tried) if each.key in case.uncertain.laws]
    stay = unknown.retained(share, declared, case.uncertain.inputs - len(every) + len(tried))
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
    values = unknown.table_of({each.key: each.law for each in inputs}, quantiles)
    scenes = case.scenes(inputs, values, case.scene.numerics.seed + clearance.INPUT_SEEDS + seeds, more, own)
    lost = [scene for scene in scenes if isinstance(scene, str)]
    check_holes(len(lost), len(scenes), (), lost)
    ran = outcomes(scenes, [f"{title} {place + 1}" for place in range(len(scenes))], simulations, title)
    good = [(place, result) for place, result in enumerate(ran) if not isinstance(result, Failure | str)]
    failures = tuple(result for result in ran if isinstance(result, Failure))
    impossible = tuple(result for result in ran if isinstance(result, str))
    check_holes(len(ran) - len(good), len(ran), failures, impossible)
    outputs, variances, freedom = scattered(case.outputs, [result for _, result in good])
    places = np.array([place for place, _ in good], dtype=np.int64)
    inputs_there = [values[place] for place in places]
    return Sets(places, quantiles[places], inputs_there, outputs, variances, freedom, failures, impossible)


def replicated(case: Case, quantiles: Array, simulations: Simulations, effort: int) -> Sets:
    """Input sets (n, d + 1) of every input with ``effort`` times the replicates of one run, a power of two, those of half as
    many among them. Raises as ``run``."""
    sets = run(case, case.every, quantiles, simulations)
    for again in range(effort.bit_length() - 1):
        more = [f"numerics.replicates={case.replicates << again}"]
        sets = sets.joined(run(case, case.every, quantiles, simulations, (again + 1) * ROUND_SEEDS, more))
    return sets


def strongest(case: Case, quantiles: Array, signals: Array) -> tuple[list[int], dict[str, float]]:
    """Places of the inputs that emulators of signals (n, m) at quantiles (n, d + 1) of every input cover: what a sample or the
    scene declares, and of the rest what matters most, as many as the scene allows. By key of the others, which vary all the
    same, the largest share of a signal's variance that their main effect makes."""
    always = declared(case)
    places = unknown.strongest(quantiles[:, :-1], signals, case.uncertain.inputs, always)
    return places, outside(case, places, quantiles, signals)


def declared(case: Case) -> list[int]:
    """Places of the inputs that a sample or the scene declares."""
    keys = {*case.uncertain.laws, *case.sample}
    return [place for place, each in enumerate(case.every) if each.key in keys]


def outside(case: Case, places: Collection[int], quantiles: Array, signals: Array) -> dict[str, float]:
    """By key of the inputs at no ``places``: the largest share of a signal's variance that their main effect makes."""
    share = unknown.main_effects(quantiles[:, :-1], signals).max(axis=1)
    return {each.key: float(share[place]) for place, each in enumerate(case.every) if place not in places}


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
        raise RunError(
            f"{lost} of {sets} input sets gave no result{where}, more than {100.0 * HOLES:g} %: {why}; narrow the "
            "laws of the inputs"
        )


def scattered(names: Sequence[str], results: Sequence[SimulationResult]) -> tuple[Array, Array, Whole]:
    """Outputs (n, m) of results, their variances by what replicates scatter, and the degrees of freedom behind these."""
    outputs, errors, samples = clearance.figures(names, results)
    freedom = np.maximum(samples - 1, 1)
    return outputs, (np.nan_to_num(errors) / student.ppf(0.975, freedom)) ** 2, freedom
