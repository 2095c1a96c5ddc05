"""What is asked of a scene and a rig's table: checked before anything runs."""

import copy
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from doe import clearance
from doe.study.input_sets import Case, case_of, check_overrides, impossible, overriding, tables_of
from doe.study.rig_file import Rig, read_rig
from rbdyn.faults import Claims, InputError, key_path, refuse
from rbdyn.records.kept import code_version, digest_of
from rbdyn.scene import Scene
from rbdyn.scene.uncertain import RUN_KEYS, Uncertain, documented
from rbdyn.scene.unknown import Input, put


class Question(NamedTuple):
    """A scene with what is not known of it, the inputs that are ``sought``, a rig's table, and notes."""

    case: Case
    sought: list[Input]
    rig: Rig
    notes: tuple[str, ...]


def question_of(question: Question) -> str:
    """What tells one question from another: its scene, its rig, what is sought, and the code that answers it."""
    case, sought, rig, _ = question
    sought_of = [[each.key, each.law.model_dump(mode="json")] for each in sought]
    declared = [case.uncertain.model_dump(mode="json"), case.scene.calibrate.model_dump(mode="json")]
    rows = [[row.keys, row.values, row.sds, row.turns, row.held] for row in rig.rows]
    scene = case.scene.model_dump(mode="json")
    version = code_version(clearance.SIMULATION, "doe.study.calibration")
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
    varies = "varies, so it has no one value to be found; it keeps the scene's value, or its ratio to the key that it multiplies"
    check_overrides(overrides, sought, fixed)
    notes = [
        *rig.notes,
        *case.remarks,
        *overriding(case, overrides),
        *(f"{each.key} {varies}" for each in case.every if each.law.kind == "varies"),
    ]
    refuse(
        f"--free {key}: its documented range does not count in this scene (rbdyn keys {key}); give it a law"
        for key in free
        if key not in {each.key for each in case.every}
    )
    refuse([] if sought else [f"{path}: uncertain: nothing is unknown that could be found; name keys with a law"])
    if case.scene.calibrate.discrepancy == "none":
        exact = "discrepancy = none: the simulation is taken as exact"
        notes.append(f"{exact}; where it is not, intervals are far too narrow")
    else:
        refuse(
            f"{path}: calibrate.discrepancy: {name} is not measured; known are {', '.join(rig.outputs)}"
            for name in case.scene.calibrate.discrepancy
            if name not in rig.outputs
        )
    # What is wrong at one condition alone is told once.
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
