"""Calibration of a scene's unknown inputs by measurements on a rig: ``doe calibrate``.

The question, a scene and a table, is checked before anything runs.
"""

import copy
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from doe import clearance
from doe.clearance import Simulations
from doe.emulator import NoisyValues
from doe.running.runner import ANSWER, Stage
from doe.running.store import Failure
from doe.unknown import inputs as unknown
from doe.unknown.calibration import TRIED, Batch, Unknowns, matched, sets_a_wave
from doe.unknown.posterior import Measured
from doe.unknown.width import OFTEN, power_of
from doe.workflow import input_sets
from doe.workflow.identification import BEFORE, Calibration, Design, Evidence, identified
from doe.workflow.input_sets import Case, check_holes, impossible, laws_of, outcomes, tables_of
from doe.workflow.rig import MOST_CONDITIONS, SPEED, Rig, read_rig
from rbdyn.base.arrays import Array, one_thread
from rbdyn.base.faults import Claims, InputError, RunError, key_path, put_key, refuse
from rbdyn.base.files import code_version, digest_of
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import NORMAL, counted
from rbdyn.result import TEMPERATURES, SimulationResult
from rbdyn.scene import Scene
from rbdyn.scene.thermal import first_guess_faults
from rbdyn.scene.uncertain import RUN_KEYS, Law, Uncertain, documented
from rbdyn.scene.unknown import Input


class Question(NamedTuple):
    """A scene with its unknown inputs, the ``targets`` among them, a rig's table, and notes."""

    case: Case
    targets: list[Input]
    rig: Rig
    notes: Notes


def question_of(question: Question) -> str:
    """Digest of a question: its scene, its rig, its targets, and the code that answers it."""
    case, targets, rig, _ = question
    target_laws = [[target.key, target.law.model_dump(mode="json")] for target in targets]
    declared = [case.uncertain.model_dump(mode="json"), case.scene.calibrate.model_dump(mode="json")]
    rows = [[row.keys, row.values, row.sds, row.turns, row.hold] for row in rig.rows]
    rows.append([rig.accuracies])
    scene = case.scene.model_dump(mode="json")
    version = code_version(clearance.SIMULATION, "doe.workflow.calibration")
    content = [version, scene, declared, target_laws, rows, case.source, str(rig.path)]
    return digest_of(json.dumps(content, sort_keys=True))


def read_question(path: Path, data: Path, free: Sequence[str], overrides: Sequence[str]) -> Question:
    """The question about a scene and a rig's table; ``free``: keys of the targets, by default all unknown ones.

    Raises InputError with all faults, before anything runs.
    """
    rig = read_rig(data)
    tables = tables_of(path, overrides)
    base = Scene.from_dict(tables, str(path))
    uncertain = getattr(base, "uncertain", None) or Uncertain()
    refuse([f"{path}: uncertain.sample: is a result of calibration; leave it out"] if uncertain.sample else [])
    documented_keys, law_keys = {entry.key for entry in documented()}, set(uncertain.laws)
    override_claims = Claims({key_path(override): override for override in uncertain.assignments})
    refuse(
        [
            f"{data}: column {key}: {reason}"
            for key in rig.keys
            if (reason := RUN_KEYS.reason_for(tuple(key.split("."))))
        ]
        + [f"{data}: column {fault}" for fault in first_guess_faults(base.thermal, base.lubricant, rig.keys)]
        + [
            f"{data}: column {key} is a target too ({path}: uncertain or --free); take it out of one of them"
            for key in rig.keys
            if key in law_keys or key in free
        ]
        + [
            f'--free {key}: has neither a law in uncertain nor a documented range; write uncertain."{key}" = {{law = ...}}'
            for key in free
            if key not in law_keys and key not in documented_keys
        ]
        + [
            f"--free {key}: uncertain.set gives its value; take it out there"
            for key in free
            if override_claims.reason_for(tuple(key.split(".")))
        ]
    )
    estimated = [*uncertain.estimated, *(key for key in free if key not in law_keys)]
    changes = {"estimated": estimated, "defaults": "documented"}
    declared = uncertain.model_copy(update=changes if free else {})
    fixed = {key: f"a column of {data}" for row in rig.rows for key in row.keys}
    case = input_sets.case_of(str(path), tables, rig.outputs, declared, fixed)
    targets = [
        candidate for candidate in case.every if candidate.law.kind == "unknown" and (not free or candidate.key in free)
    ]
    input_sets.check_overrides(overrides, targets, fixed)
    notes = [
        *rig.notes,
        *case.remarks,
        *input_sets.override_notes(case, overrides),
        *(_varies(candidate) for candidate in case.every if candidate.law.kind == "varies"),
    ]
    refuse(
        f"--free {key}: its documented range does not apply to this scene (rbdyn keys {key}); give it a law"
        for key in free
        if key not in {candidate.key for candidate in case.every}
    )
    refuse([*_vain_question(case, rig, targets), *_endless_question(case, rig, targets)])
    if case.scene.calibrate.discrepancy == "none":
        exact = "discrepancy = none: the simulation counts as exact; if it is not, intervals are far too narrow"
        notes.append(Note("inputs", exact))
    else:
        refuse(
            f"{path}: calibrate.discrepancy: {name} is not measured; name one of {', '.join(rig.outputs)}"
            for name in case.scene.calibrate.discrepancy
            if name not in rig.outputs
        )
    refuse(_impossible_conditions(cases_of(case, rig), rig))
    return Question(case, targets, rig, tuple(notes))


def _varies(candidate: Input) -> Note:
    sentence = "varies, so it has no single value to identify; it keeps the scene's value, or its ratio to the key that it multiplies"
    return Note("inputs", f"{candidate.key}: {sentence}")


def _vain_question(case: Case, rig: Rig, targets: Sequence[Input]) -> Iterator[str]:
    """Faults of a question without targets or of one condition, and of measured temperatures that no heat balance of the scene computes."""
    if not targets:
        yield f"{case.source}: uncertain: no unknown input is declared; add one with a law"
    names = [name for name in rig.outputs if name in TEMPERATURES and case.scene.thermal is None]
    if len(rig.conditions) == 1:
        yield f"{rig.path}: all rows have one operating condition, so none predicts another; measure at two at least"
    fix = f"{case.source} has no [thermal], which computes temperatures; add that table there or remove the column"
    yield from (f"{rig.path}: column {name}: {fix}" for name in names)


def _endless_question(case: Case, rig: Rig, targets: Sequence[Input]) -> Iterator[str]:
    """The fault of a question that takes more runs than a calibration may have."""
    most = sum(max(stage.runs, stage.most or 0) for stage in _stages(case, rig, targets, 1.0))
    if most > MOST_RUNS:
        fix = "give fewer conditions, fewer targets (--free) or fewer waves (calibrate.waves)"
        conditions = counted(len(rig.conditions), "operating condition")
        yield f"{rig.path}: {conditions} take up to {most} runs, {MOST_RUNS} at most; {fix}"


def _impossible_conditions(cases: Sequence[Case], rig: Rig) -> dict[str, None]:
    """Faults of the scene at the conditions, each once, and of cages that are measured faster than both rings."""
    faults = dict.fromkeys(fault for condition in cases for fault in impossible(condition))
    conditions, rows = rig.conditions, list[tuple[int, float, float]]()
    for row in rig.rows:
        rings = cases[conditions.index(row.keys)].scene.operation
        fastest = max(abs(rings.inner_speed_rpm), abs(rings.outer_speed_rpm))
        if row.values.get(SPEED, 0.0) > fastest:
            rows.append((row.number, row.values[SPEED], fastest))
    if rows:
        number, speed, fastest = rows[0]
        where = (
            f"{rig.path}: {SPEED} in row {number} = {speed:g}: is above {fastest:g} rpm, the speed of the faster ring"
        )
        faults[f"{where} ({len(rows)} of {len(rig.rows)} rows); check the columns and the unit"] = None
    return faults


def cases_of(case: Case, rig: Rig) -> list[Case]:
    """The case at each condition of the rig. Raises InputError for impossible conditions."""
    cases, faults = [], dict[str, None]()
    first = {tuple(rig_row.keys.items()): rig_row.number for rig_row in reversed(rig.rows)}
    for keys in rig.conditions:
        row = first[tuple(keys.items())]
        tables, scene_of = copy.deepcopy(case.data), f"{rig.path}: row {row}"
        try:
            for key, value in keys.items():
                put_key(tables, key, list(value) if isinstance(value, tuple) else value, scene_of)
            scene = Scene.from_dict(tables, scene_of)
            cases.append(replace(case, data=tables, scene=scene, source=scene_of, home=scene_of))
        except InputError as error:
            faults |= dict.fromkeys(error.faults)
    refuse(faults)
    return cases


# Most runs of a calibration: of 200 conditions and eight unknown inputs in two waves, or some 80 conditions in four.
MOST_RUNS = 50_000
# Seeds of a stage and of a condition in it.
STAGE_SEEDS, CONDITION_SEEDS = 200_000, 1_000


@dataclass
class _Rows:
    """Simulations at all conditions: a case for each condition, and (condition, output) of each measured cell."""

    cases: list[Case]
    inputs: list[Input]
    outputs: tuple[str, ...]
    cells: list[tuple[int, int]]
    simulations: Simulations
    runs: int = 0

    def simulate(self, quantiles: Array, stage: int) -> Batch:
        """Input sets at all conditions. Raises RunError if too many are impossible or fail."""
        title = f"wave {stage + 1}" if stage < 100 else "posterior"
        values = unknown.table_of(laws_of(self.inputs), quantiles)
        first = clearance.CALIBRATION_SEEDS + stage * STAGE_SEEDS
        scenes = [
            scene
            for place, case in enumerate(self.cases)
            for scene in case.scenes(self.inputs, values, case.scene.numerics.seed + first + place * CONDITION_SEEDS)
        ]
        labels = [
            f"{title}, input set {n + 1}, condition {c + 1}" for c in range(len(self.cases)) for n in range(len(values))
        ]
        results = self.run(scenes, labels, title)
        table = [results[place :: len(values)] for place in range(len(values))]
        complete = [n for n, row in enumerate(table) if not any(isinstance(outcome, Failure | str) for outcome in row)]
        failures = [outcome for outcome in results if isinstance(outcome, Failure)]
        impossible = [outcome for outcome in results if isinstance(outcome, str)]
        check_holes(len(table) - len(complete), len(table), failures, impossible, " at some condition")
        return Batch(quantiles[complete], *self.figures([result for n in complete for result in table[n]]))

    def run(self, scenes: Sequence[Scene | str], labels: Sequence[str], title: str) -> list[Any]:
        """Results, failures, or why there is no scene."""
        self.runs += sum(isinstance(scene, Scene) for scene in scenes)
        return outcomes(scenes, labels, self.simulations, title)

    def figures(self, results: Sequence[SimulationResult]) -> NoisyValues:
        """Cells (n, c) in logarithms of results by condition."""
        conditions, names = np.array(self.cells).T
        sets = np.arange(0, len(results), len(self.cases))[:, None]
        # The order of cells in memory decides the last bits of sums over the sets.
        cells = input_sets.outputs_with_scatter(self.outputs, results).at((np.asfortranarray(sets + conditions), names))
        outputs = cells.values
        if not (outputs > 0.0).all():
            name = self.outputs[names[int(np.argmin(outputs.min(axis=0)))]]
            raise RunError(
                f"{name}: is 0 or less in a simulation, so its logarithm cannot be compared; leave its column out"
            )
        return NoisyValues(np.log(outputs), cells.variances / outputs**2, cells.freedom)


@one_thread
def find_calibration(question: Question, simulations: Simulations) -> Calibration:
    """Identify the unknown inputs of a scene from a rig's table. Raises RunError, KeyboardInterrupt."""
    case, targets, rig, notes = question
    conditions = rig.conditions
    cases = cases_of(case, rig)
    inputs, fixed_shares = input_sets.screen_inputs(replace(case, every=targets), simulations)
    places = [(row, name) for row in rig.rows for name in row.values]
    cell_places = [(conditions.index(row.keys), rig.outputs.index(name)) for row, name in places]
    rows = _Rows(cases, inputs, rig.outputs, cell_places, simulations)
    nominal, variances, turns, numerical = _nominal(rows)
    measured = _measured(rows, rig, variances, turns, numerical)
    settings = case.scene.calibrate
    match = matched(rows.simulate, measured, _unknowns(inputs), settings.seed, settings.waves)
    cells = [(row.number, name) for row, name in places]
    prior_cells = match.cells.mean(
        match.unknowns.quantiles(np.random.default_rng(0).standard_normal((BEFORE, len(inputs))))
    )
    evidence = Evidence(
        made_of=question_of(question),
        case=case,
        rig=rig,
        inputs=inputs,
        screened=fixed_shares,
        cells=cells,
        nominal=nominal,
        match=match,
        before=prior_cells,
        runs=rows.runs,
        notes=notes,
        design=design_of(question),
    )
    return identified(evidence)


def _nominal(rows: _Rows) -> tuple[Array, Array, Array, Array]:
    """Cells (c,) at the scene's own inputs: logarithms, variances of one run, counted turns, numerical variances."""
    scenes = [
        Scene.from_dict(case.data, case.source, [*case.uncertain.assignments, "numerics.companion=true"])
        for case in rows.cases
    ]
    labels = [f"scene values, condition {place + 1}" for place in range(len(scenes))]
    results = rows.run(scenes, labels, "scene values")
    for result, label in zip(results, labels, strict=True):
        if isinstance(result, Failure):
            raise RunError(f"{label}: {result.cause}")
    values, variances, _ = rows.figures(results)
    turns = np.array([result.counted_turns * result.replicates for result in results])
    numerical = [
        (results[condition].responses[rows.outputs[name]].numerical_error or 0.0) / NORMAL / np.exp(value)
        for (condition, name), value in zip(rows.cells, values[0], strict=True)
    ]
    return values[0], variances[0], turns[[condition for condition, _ in rows.cells]], np.array(numerical) ** 2


def _measured(rows: _Rows, rig: Rig, variances: Array, turns: Array, numerical: Array) -> Measured:
    scales = rows.cases[0].scene.calibrate.discrepancy
    cells = [(row, name) for row in rig.rows for name in row.values]
    relative_variances = []
    for place, (row, name) in enumerate(cells):
        sd = row.sds[name]
        # The measurement scatters like a run of as many turns.
        relative_variances.append(
            (sd / row.values[name]) ** 2 if sd else variances[place] * turns[place] / (row.turns or 1.0)
        )
    conditions, outputs = np.array(rows.cells).T
    return Measured(
        np.log([row.values[name] for row, name in cells]),
        np.array(relative_variances) + numerical,
        outputs,
        conditions,
        np.array([0.0 if scales == "none" else scales.get(name, np.nan) for name in rig.outputs]),
        np.array([row.hold for row, _ in cells]),
        np.array([rig.accuracies[name] for name in rig.outputs]),
    )


def design_of(question: Question) -> Design:
    """What the table's conditions and outputs alone let a calibration claim, before anything runs."""
    rig, seed = question.rig, question.case.scene.calibrate.seed
    cells = [
        (rig.conditions.index(row.keys), rig.outputs.index(name), row.hold) for row in rig.rows for name in row.values
    ]
    row, output, hold = np.array(cells).T
    power = power_of(output, row, hold.astype(bool), seed)
    if power.enough:
        return Design(power, "")
    outputs, needed = len(rig.outputs), _conditions_needed(len(rig.outputs), len(rig.conditions), seed)
    shares = f"{100.0 * power.wide:.0f} % of such tables, twice too narrow in {100.0 * power.narrow:.0f} %"
    return Design(
        power,
        f"{counted(power.cells, 'predicted value')} cannot judge intervals: twice too wide would show in {shares}, and "
        f"{100.0 * OFTEN:.0f} % are needed; measure {counted(outputs, 'output')} at {needed} conditions",
    )


def _conditions_needed(outputs: int, fewest: int, seed: int) -> int:
    """Number of conditions, ``fewest`` at least, that judge predictions where all outputs are measured at each."""
    for conditions in range(fewest, MOST_CONDITIONS):
        row = np.repeat(np.arange(conditions), outputs)
        if power_of(np.tile(np.arange(outputs), conditions), row, np.zeros(row.size, bool), seed).enough:
            return conditions
    return MOST_CONDITIONS


def _unknowns(inputs: Sequence[Input]) -> Unknowns:
    laws = [unknown_input.law for unknown_input in inputs]
    choices = {place: law for place, law in enumerate(laws) if isinstance(law, Law) and law.law == "choices"}

    def quantiles_at(scores: Array) -> Array:
        quantiles = special.ndtr(scores)
        for place, law in choices.items():
            quantiles[:, place] = unknown.quantiles_of(law, unknown.values_of(law, quantiles[:, place]))
        return quantiles

    return Unknowns(len(inputs), quantiles_at)


def calibration_stages(question: Question) -> list[Stage]:
    """Stages of ``doe calibrate``; fewer waves may do. Raises InputError."""
    return _stages(question.case, question.rig, question.targets, input_sets.work_of_set(question.case))


def _stages(case: Case, rig: Rig, targets: Sequence[Input], work: float) -> list[Stage]:
    conditions = len(rig.conditions)
    screening_runs = _screening_runs(replace(case, every=list(targets)))
    waves, sets = case.scene.calibrate.waves, sets_a_wave(min(len(targets), case.uncertain.inputs)) * conditions
    return [
        *([Stage.of("screening", screening_runs, work)] if screening_runs else []),
        Stage.of("scene values", conditions, work),
        Stage.of("waves", waves * sets, work, "wave", fewest=sets),
        # If emulators miss the posterior, it is simulated once more.
        Stage.of("posterior", TRIED * conditions, work, most=2 * TRIED * conditions),
        Stage(ANSWER),
    ]


def _screening_runs(case: Case) -> int:
    """Runs of a screening, which only too many inputs need; else 0."""
    candidates = [candidate for candidate in case.every if candidate.key not in case.sample]
    if len(case.every) <= case.uncertain.inputs or not candidates:
        return 0
    return len(unknown.screening_design(len(candidates)))
