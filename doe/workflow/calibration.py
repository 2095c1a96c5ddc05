"""Inputs of a scene from measurements on a rig: ``doe calibrate``. What is asked of scene and table is checked before anything runs."""

import copy
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy import special

from doe import clearance
from doe.clearance import Simulations
from doe.running.store import Failure
from doe.threads import one_thread
from doe.unknown import inputs as unknown
from doe.unknown.calibration import MISSED, Batch, Matched, Unknowns, matched
from doe.unknown.likelihood import Measured
from doe.unknown.posterior import Learnt, contraction, densest_intervals, learnt
from doe.unknown.verdict import FAR, Judgement, judge, objections, reweighed
from doe.workflow.input_sets import (
    NORMAL,
    Case,
    case_of,
    check_holes,
    check_overrides,
    impossible,
    outcomes,
    overriding,
    scattered,
    screened,
    tables_of,
)
from doe.workflow.rig import Rig, read_rig
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import Claims, InputError, RunError, key_path, refuse
from rbdyn.base.storage import code_version, digest_of
from rbdyn.base.words import quantity
from rbdyn.result import SimulationResult
from rbdyn.scene import Scene
from rbdyn.scene.uncertain import RUN_KEYS, Law, Uncertain, documented
from rbdyn.scene.unknown import Input, put, value_of


class Question(NamedTuple):
    """A scene with its unknown inputs, the inputs that are ``sought``, a rig's table, and notes."""

    case: Case
    sought: list[Input]
    rig: Rig
    notes: tuple[str, ...]


def question_of(question: Question) -> str:
    """What distinguishes one question from another: its scene, its rig, what is sought, and the code that answers it."""
    case, sought, rig, _ = question
    sought_of = [[each.key, each.law.model_dump(mode="json")] for each in sought]
    declared = [case.uncertain.model_dump(mode="json"), case.scene.calibrate.model_dump(mode="json")]
    rows = [[row.keys, row.values, row.sds, row.turns, row.held] for row in rig.rows]
    scene = case.scene.model_dump(mode="json")
    version = code_version(clearance.SIMULATION, "doe.workflow.calibration")
    told = [version, scene, declared, sought_of, rows, case.source, str(rig.path)]
    return digest_of(json.dumps(told, sort_keys=True))


def read_question(path: Path, data: Path, free: Sequence[str], overrides: Sequence[str]) -> Question:
    """What is asked of a scene and a rig's table; ``free``: keys that are sought, all unknown ones unless named.

    Raises InputError for all that is wrong with them, before anything runs.
    """
    rig = read_rig(data)
    tables = tables_of(path, overrides)
    base = Scene.from_dict(tables, str(path))
    given = getattr(base, "uncertain", None) or Uncertain()
    refuse([f"{path}: uncertain.sample: is what a calibration gives; leave it out"] if given.sample else [])
    known = {each.key for each in documented()}
    laid, settled = set(given.laws), Claims({key_path(each): each for each in given.set})
    refuse(
        [f"{data}: column {key}: {why}" for key in rig.keys if (why := RUN_KEYS.on(tuple(key.split("."))))]
        + [
            f"{data}: column {key} is sought too ({path}: uncertain or --free); take it out of one of them"
            for key in rig.keys
            if key in laid or key in free
        ]
        + [
            f'--free {key}: has neither a law in uncertain nor a documented range; write uncertain."{key}" = {{law = ...}}'
            for key in free
            if key not in laid and key not in known
        ]
        + [
            f"--free {key}: uncertain.set gives its value; take it out there"
            for key in free
            if settled.on(tuple(key.split(".")))
        ]
    )
    asked = [key for key in free if key not in laid]
    named = {"estimated": [*given.estimated, *asked], "defaults": "documented"}
    declared = given.model_copy(update=named if free else {})
    fixed = {key: f"a column of {data}" for row in rig.rows for key in row.keys}
    case = case_of(str(path), tables, rig.outputs, declared, fixed)
    sought = [each for each in case.every if each.law.kind == "unknown" and (not free or each.key in free)]
    check_overrides(overrides, sought, fixed)
    notes = [
        *rig.notes,
        *case.remarks,
        *overriding(case, overrides),
        *(
            (
                f"{each.key} varies, so it has no one value to be found; it keeps the scene's value, or its ratio to the "
                "key that it multiplies"
            )
            for each in case.every
            if each.law.kind == "varies"
        ),
    ]
    refuse(
        f"--free {key}: its documented range does not count in this scene (rbdyn keys {key}); give it a law"
        for key in free
        if key not in {each.key for each in case.every}
    )
    refuse([] if sought else [f"{path}: uncertain: no unknown input is declared; add one with a law"])
    if case.scene.calibrate.discrepancy == "none":
        notes.append(
            "discrepancy = none: the simulation is taken as exact; where it is not, intervals are far too narrow"
        )
    else:
        refuse(
            f"{path}: calibrate.discrepancy: {name} is not measured; known are {', '.join(rig.outputs)}"
            for name in case.scene.calibrate.discrepancy
            if name not in rig.outputs
        )
    # What is wrong at one condition alone is reported once.
    refuse(dict.fromkeys(fault for each in cases_of(case, rig) for fault in impossible(each)))
    return Question(case, sought, rig, tuple(notes))


def cases_of(case: Case, rig: Rig) -> list[Case]:
    """The case at every condition. Raises InputError for conditions that no scene has."""
    cases, faults = [], dict[str, None]()
    first = {tuple(each.keys.items()): each.number for each in reversed(rig.rows)}
    for keys in rig.conditions:
        row = first[tuple(keys.items())]
        tables, scene_of = copy.deepcopy(case.data), f"{rig.path}: row {row}"
        try:
            for key, value in keys.items():
                put(tables, key, list(value) if isinstance(value, tuple) else value)
            scene = Scene.from_dict(tables, scene_of)
            cases.append(replace(case, data=tables, scene=scene, source=scene_of, home=scene_of))
        except InputError as error:
            faults |= dict.fromkeys(error.faults)
    refuse(faults)
    return cases


# Seeds of a stage and of a condition in it.
STAGE_SEEDS, CONDITION_SEEDS = 200_000, 1_000
# Rows of the posterior sample, and input sets that show what was likely before.
SAMPLE, BEFORE = 1000, 2000


@dataclass(frozen=True)
class Calibration:
    """Everything a report needs. ``case`` is the scene with its unknowns, ``inputs`` those that were sought, ``screened`` what
    was left at its value; ``cells``: row, output; ``nominal``: cells as the scene says, in logarithms; ``before`` and ``after``:
    cells over the prior and the posterior (n, c); ``after`` and what is judged by it None where nothing is left."""

    case: Case
    rig: Rig
    inputs: list[Input]
    screened: dict[str, float]
    cells: list[tuple[int, str]]
    nominal: Array
    found: Matched
    before: Array
    after: Array | None
    learnt: Learnt | None
    judgement: Judgement | None
    without: dict[str, float] | None
    objections: tuple[str, ...]
    runs: int
    notes: tuple[str, ...]

    @property
    def verdict(self) -> str:
        """calibrated or not calibrated."""
        return "not calibrated" if self.reasons else "calibrated"

    @property
    def reasons(self) -> list[str]:
        """Why inputs may not be called calibrated."""
        cells = [self.cells[place] for place in self.found.refuted]
        told = ", ".join(f"{quantity(name)[0]} of row {row}" for row, name in cells)
        return [
            *(
                [
                    f"refuted: no input set within the laws gives what was measured within the allowed discrepancy: {told}"
                ]
                if cells
                else []
            ),
            *self.objections,
        ]

    @property
    def quantiles(self) -> Array:
        """Quantiles (n, d) of the inputs, as likely as the posterior."""
        if self.found.sampled is None:
            raise RunError("calibration: no input set is left to sample")
        points = self.found.sampled.points
        return self.found.quantiles(points[np.linspace(0, len(points) - 1, SAMPLE).astype(int)])

    @property
    def ends(self) -> Array:
        """Quantiles (2, d) between which the densest 90 % of the posterior of each input lie."""
        if self.found.sampled is None:
            raise RunError("calibration: no input set is left to sample")
        return densest_intervals(self.found.quantiles(self.found.sampled.points))

    @cached_property
    def sample(self) -> list[dict[str, Any]]:
        """What the scene has at each input, and at each key that multiplies one, in the input sets of ``quantiles``."""
        inputs = [each.key for each in self.inputs]
        tied = [each.key for each in self.case.every if each.key not in inputs and each.law.times in inputs]
        rows = unknown.table_of({each.key: each.law for each in self.inputs}, self.quantiles)
        scenes = self.case.scenes(self.inputs, rows, 0)
        # A set that is impossible in the scene itself, though not at the rig's conditions, is none.
        return [{key: value_of(each, key) for key in (*inputs, *tied)} for each in scenes if not isinstance(each, str)]

    def outliers(self) -> list[int]:
        """Places of the cells that the others predict badly."""
        return [] if self.judgement is None else np.flatnonzero(np.abs(self.judgement.residuals) > FAR).tolist()


@dataclass
class _Rows:
    """Simulations of all conditions: a case a condition, and where each measured cell is found in them."""

    cases: list[Case]
    inputs: list[Input]
    outputs: tuple[str, ...]
    cells: list[tuple[int, int]]
    simulations: Simulations
    runs: int = 0

    def simulate(self, quantiles: Array, stage: int) -> Batch:
        """Input sets at all conditions. Raises RunError where too many are impossible or fail."""
        title = f"wave {stage + 1}" if stage < 100 else "posterior"
        values = unknown.table_of({each.key: each.law for each in self.inputs}, quantiles)
        first = clearance.CALIBRATION_SEEDS + stage * STAGE_SEEDS
        scenes = [
            scene
            for place, case in enumerate(self.cases)
            for scene in case.scenes(self.inputs, values, case.scene.numerics.seed + first + place * CONDITION_SEEDS)
        ]
        labels = [
            f"{title}, input set {n + 1}, condition {c + 1}" for c in range(len(self.cases)) for n in range(len(values))
        ]
        ran = self.run(scenes, labels, title)
        table = [ran[place :: len(values)] for place in range(len(values))]
        good = [n for n, row in enumerate(table) if not any(isinstance(each, Failure | str) for each in row)]
        failures = [each for each in ran if isinstance(each, Failure)]
        impossible = [each for each in ran if isinstance(each, str)]
        check_holes(len(table) - len(good), len(table), failures, impossible, " at some condition")
        cells, variances, freedom = self.figures([each for n in good for each in table[n]])
        return Batch(quantiles[good], cells, variances, freedom)

    def run(self, scenes: Sequence[Scene | str], labels: Sequence[str], title: str) -> list[Any]:
        """Results, failures, or why there is no scene."""
        self.runs += sum(isinstance(scene, Scene) for scene in scenes)
        return outcomes(scenes, labels, self.simulations, title)

    def figures(self, results: Sequence[SimulationResult]) -> tuple[Array, Array, Whole]:
        """Cells (n, c) in logarithms, their variances and the degrees of freedom behind these, of results by condition."""
        outputs, variances, freedom = scattered(self.outputs, results)
        if not (outputs > 0.0).all():
            name = self.outputs[int(np.argmin(outputs.min(axis=0)))]
            raise RunError(
                f"{name}: is nothing in a simulation, so no share of it can be compared; leave its column out"
            )
        conditions, names = np.array(self.cells).T
        shape = (-1, len(self.cases), len(self.outputs))
        return (
            np.log(outputs).reshape(shape)[:, conditions, names],
            (variances / outputs**2).reshape(shape)[:, conditions, names],
            freedom.reshape(shape)[:, conditions, names],
        )


@one_thread
def find_calibration(question: Question, simulations: Simulations) -> Calibration:
    """Find the unknown inputs of a scene from a rig's table. Raises RunError, KeyboardInterrupt."""
    case, sought, rig, notes = question
    conditions = rig.conditions
    cases = cases_of(case, rig)
    inputs, rest = screened(replace(case, every=sought), simulations)
    places = [(row, name) for row in rig.rows for name in row.values]
    at = [(conditions.index(row.keys), rig.outputs.index(name)) for row, name in places]
    rows = _Rows(cases, inputs, rig.outputs, at, simulations)
    nominal, variances, turns, numerical = _nominal(rows)
    measured = _measured(rows, rig, variances, turns, numerical)
    asked = case.scene.calibrate
    found = matched(rows.simulate, measured, _unknowns(case, inputs), asked.seed, asked.waves)
    cells = [(row.number, name) for row, name in places]
    before = found.cells.mean(found.unknowns.at(np.random.default_rng(0).standard_normal((BEFORE, len(inputs)))))
    whole = Calibration(
        case, rig, inputs, rest, cells, nominal, found, before, None, None, None, None, (), rows.runs, notes
    )
    return whole if found.sampled is None else _judged(whole)


def _nominal(rows: _Rows) -> tuple[Array, Array, Array, Array]:
    """Cells as the scene says, in logarithms, variances of one run of each, its counted turns, variances by integration."""
    scenes = [
        Scene.from_dict(case.data, case.source, [*case.uncertain.set, "numerics.companion=true"]) for case in rows.cases
    ]
    labels = [f"as the scene says, condition {place + 1}" for place in range(len(scenes))]
    ran = rows.run(scenes, labels, "as the scene says")
    for result, label in zip(ran, labels, strict=True):
        if isinstance(result, Failure):
            raise RunError(f"{label}: {result.cause}")
    values, variances, _ = rows.figures(ran)
    turns = np.array([result.counted_turns * result.replicates for result in ran])
    records = [result.as_dict() for result in ran]
    numerical = [
        (records[condition][rows.outputs[name]]["numerical_error"] or 0.0) / NORMAL / np.exp(value)
        for (condition, name), value in zip(rows.cells, values[0], strict=True)
    ]
    return values[0], variances[0], turns[[condition for condition, _ in rows.cells]], np.array(numerical) ** 2


def _measured(rows: _Rows, rig: Rig, variances: Array, turns: Array, numerical: Array) -> Measured:
    scales = rows.cases[0].scene.calibrate.discrepancy
    cells = [(row, name) for row in rig.rows for name in row.values]
    found = []
    for place, (row, name) in enumerate(cells):
        sd = row.sds[name]
        # A run as long as the measurement scatters as that does.
        found.append((sd / row.values[name]) ** 2 if sd else variances[place] * turns[place] / (row.turns or 1.0))
    conditions, outputs = np.array(rows.cells).T
    return Measured(
        np.log([row.values[name] for row, name in cells]),
        np.array(found) + numerical,
        outputs,
        conditions,
        np.array([0.0 if scales == "none" else scales.get(name, np.nan) for name in rig.outputs]),
        np.array([row.held for row, _ in cells]),
    )


def _unknowns(case: Case, inputs: Sequence[Input]) -> Unknowns:
    factor = case.joint(inputs).factor
    given = [each.law for each in inputs]
    choices = {place: law for place, law in enumerate(given) if isinstance(law, Law) and law.law == "choices"}

    def at(scores: Array) -> Array:
        quantiles = special.ndtr(scores if factor is None else scores @ factor.T)
        for place, law in choices.items():
            quantiles[:, place] = unknown.quantiles_of(law, unknown.values_of(law, quantiles[:, place]))
        return quantiles

    return Unknowns(len(inputs), at)


def _judged(given: Calibration) -> Calibration:
    """What was learned, how well the rest is predicted, and what may be claimed."""
    found, seed = given.found, given.case.scene.calibrate.seed
    assert found.sampled is not None
    points = found.sampled.points
    judgement = judge(found, [quantity(name)[0] for name in given.rig.outputs], seed)
    quantiles = found.quantiles(points)
    prior = found.quantiles(np.random.default_rng(1).standard_normal((BEFORE, len(given.inputs))))
    gained = learnt(quantiles, _logarithms(given.inputs, quantiles), _logarithms(given.inputs, prior))
    against = objections(judgement, anything=gained.anything, emulated=found.misfit < MISSED)
    rows = np.linspace(0, len(points) - 1, SAMPLE).astype(int)
    after = found.cells.mean(quantiles[rows])
    notes = (
        *given.notes,
        *(
            f"{given.inputs[place].key}: the posterior crowds at an end of its range, which may be too narrow"
            for place in gained.narrow
        ),
    )
    whole = replace(given, after=after, learnt=gained, judgement=judgement, objections=tuple(against), notes=notes)
    return replace(whole, without=_without(whole))


def _without(given: Calibration) -> dict[str, float] | None:
    """Contraction by key without the cells that the others predict badly; None where there are no training cells."""
    found = given.found
    assert given.judgement is not None
    left = np.setdiff1d(found.measured.learnt, given.outliers())
    if left.size in (0, found.measured.learnt.size):
        return None
    points = reweighed(given.judgement.particles, left, given.case.scene.calibrate.seed)
    shares = contraction(found.quantiles(points)).tolist()
    return dict(zip((each.key for each in given.inputs), shares, strict=True))


def _logarithms(inputs: Sequence[Input], quantiles: Array) -> Array:
    """Logarithms (n, d) of inputs that are positive numbers; NaN of the others."""
    found = np.full(quantiles.shape, np.nan)
    for place, each in enumerate(inputs):
        if each.law.law != "choices":
            values = np.array(unknown.values_of(each.law, quantiles[:, place]))
            if (values > 0.0).all():
                found[:, place] = np.log(values)
    return found
