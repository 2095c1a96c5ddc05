"""Fuzz: random [uncertain] tables are honoured in every scene that they make, or refused in sentences; nothing is simulated."""

import copy
import math
import random
import tomllib
import warnings
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from doe.study_file.study import StudyFile
from doe.unknown import inputs
from doe.workflow.input_sets import Case, case_of
from doe.workflow.problem import Problem
from doe.workflow.robust import case_of_study
from rbdyn.base.faults import LONGEST_SENTENCE, MOST_FAULTS, InputError, key_path, read_toml, validated
from rbdyn.scene import Scene
from rbdyn.scene.unknown import FOLLOWING, value_of

EXAMPLES = Path(__file__).parents[2] / "examples"
SCENE, STUDY = EXAMPLES / "cylindrical_roller.toml", EXAMPLES / "clearance_study.toml"
RANGES = {
    "bearing.inner_ring_mass_kg": (0.5, 2.0), "bearing.effective_length_mm": (3.2, 3.7), "bearing.tilt_mrad": (0.01, 0.1),
    "cage.mass_g": (40.0, 50.0), "cage.imbalance_um": (1.0, 40.0), "cage.land_width_mm": (2.0, 4.0),
    "cage.inertia_kg_mm2": (15.0, 30.0), "cage.land_diameter_mm": (48.0, 51.0), "cage.pocket_contact_length_mm": (2.0, 4.0),
    "lubricant.temperature_C": (80.0, 120.0), "lubricant.viscosity_mPas": (2.0, 5.0), "lubricant.oil_fraction": (0.01, 0.1),
    "model.land_fill": (0.2, 0.9), "model.pocket_friction": (0.02, 0.1), "model.pocket_bar_stiffness_N_m": (1e7, 1e8),
    "model.pocket_restitution": (0.4, 0.8), "operation.radial_load_N": (800.0, 1500.0), "traction.mu_m": (0.045, 0.06),
    "traction.mu_inf": (0.02, 0.04), "cage.pocket_clearance_mm": (0.25, 0.35),
}  # fmt: skip
CHOICES: dict[str, list[Any]] = {
    "model.drag": ["off", "cylinder"], "cage.guidance": ["outer", "inner"], "bearing.rollers": [8, 9, 10],
    "model.pocket_film": [True, False], "model.line_contact": ["palmgren", "iso16281", "houpert"],
    "materials.cage": ["bronze", "brass", "aisi_4340"], "traction.model": ["four_constant", "eyring"],
    "model.pocket_bar_stiffness_N_m": ["rigid", 5e7],
}  # fmt: skip
SETS = (
    "cage.lands=1", "model.drag=off", "cage.imbalance_um=7.0", "numerics.turns=10", "numerics.replicates=3", "cage.mass_g=44.0",
    "traction.model=eyring", "traction.friction=mixed", "lubricant.temperature_C=90.0", "operation.unbalance_g_mm=3.0",
    "model.pocket_film=true", "cage.guide_clearance_mm=0.2",
)  # fmt: skip
ESTIMATED = (
    "cage.mass_g", "lubricant.temperature_C", "model.land_fill", "traction.model", "lubricant.roller_roughness_um",
)  # fmt: skip
EXTREMES = [
    0, 0.0, -1.0, 1e300, -1e300, 1e308, math.nan, math.inf, 1e-300, 5e-324, 1e12, 1e-12, -1e12, True, "x", "", [], {}, None,
    10**18, "cage.mass_g", [1.0, 2.0], "é\n", "a" * 3000,
]  # fmt: skip
KEYS = [
    "cage", "cage.", ".mass_g", "cage.masss_g", "Cage.mass_g", "cage.mass_g.x", "numerics.seed", "numerics.rtol", "uncertain.points",
    "calibrate.seed", "operation.schedule", "operation.schedule.shape", "bearing.outer_waviness", "materials.cage.density_kg_m3",
    "bearing.kind", "bearing.radial_clearance_mm", "traction.constants", "format", "cage.mass_g\n", "a" * 3000, "support.stiffness_N_m",
]  # fmt: skip


def law_of(draw: random.Random, key: str) -> dict[str, Any]:
    """A law of a key of the example."""
    if key in CHOICES and (key not in RANGES or draw.random() < 0.3):
        law: dict[str, Any] = {"law": "choices", "values": list(CHOICES[key])}
        if draw.random() < 0.5:
            law["weights"] = [draw.choice([0.01, 0.5, 2.0, 100.0]) for _ in law["values"]]
        return law
    low, high = sorted(draw.uniform(*RANGES[key]) for _ in range(2))
    times = draw.choice([None, None, None, key, draw.choice(sorted(RANGES))])
    if times == key:
        low, high = 0.9, 0.9 + draw.uniform(0.01, 0.1)
    elif times:
        low, high = (end / (0.5 * sum(RANGES[times])) for end in (low, high))
    kind = draw.choice(["uniform", "log_uniform", "normal", "normal"])
    law = {"law": kind, **({"kind": "varies"} if draw.random() < 0.1 else {}), **({"times": times} if times else {})}
    if kind == "normal":
        middle, sd = 0.5 * (low + high), (high - low) / 6.0
        return {**law, "mean": middle, "sd": sd, **({"low": low, "high": high} if draw.random() < 0.5 else {})}
    return {**law, "low": low, "high": high}


def table_of(draw: random.Random, folder: Path) -> dict[str, Any]:
    """An [uncertain] table that is valid as often as not."""
    keys = draw.sample(sorted({*RANGES, *CHOICES}), draw.choice([0, 1, 2, 3, 5]))
    table: dict[str, Any] = {key: law_of(draw, key) for key in keys}
    if draw.random() < 0.6:
        table["defaults"] = "none"
    if draw.random() < 0.3:
        table["estimated"] = draw.sample(ESTIMATED, draw.choice([1, 2]))
    if draw.random() < 0.5:
        table["set"] = draw.sample(SETS, draw.choice([1, 2, 3]))
    if draw.random() < 0.1:
        columns = draw.sample(sorted(RANGES), draw.choice([1, 2]))
        rows = [",".join(repr(draw.uniform(*RANGES[key])) for key in columns) for _ in range(draw.choice([1, 2, 40]))]
        (folder / "sample.csv").write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
        table["sample"] = "sample.csv"
    return table


def spoilt(draw: random.Random, table: dict[str, Any]) -> dict[str, Any]:
    """The table with one or two changes that may spoil it."""
    table = copy.deepcopy(table)
    for _ in range(draw.choice([1, 1, 2])):
        declared = [key for key, law in table.items() if isinstance(law, dict) and "law" in law]
        one = draw.choice(declared) if declared else "cage.mass_g"
        law = table[one] if one in table else table.setdefault(one, law_of(draw, one))
        kind = draw.choice((0, 1, *range(3, 10)))
        if kind == 0:
            names = ["low", "high", "mean", "sd", "times", "values", "weights"]
            law[draw.choice([*(3 * [name for name in names if name in law]), *names])] = draw.choice(EXTREMES)
        elif kind == 1:
            table[draw.choice(KEYS)] = law
        elif kind == 3:
            before = table["set"] if isinstance(table.get("set"), list) else []
            table["set"] = [*before, draw.choice([f"{one}=1.0", "numerics.seed=3", "x", "=", *KEYS, *SETS])]
        elif kind == 4:
            law["times"] = draw.choice(draw.choice([KEYS, [*CHOICES, *RANGES], declared or KEYS]))
        elif kind == 5:
            table[draw.choice(["points", "seed", "inputs", "sample", "defaults", "set"])] = draw.choice(EXTREMES)
        elif kind == 6:
            law["law"] = draw.choice(["uniform", "normal", "log_uniform", "choices", "beta"])
        elif kind == 7:
            law.pop(draw.choice(sorted(law)))
        elif kind == 8 and "values" in law:
            law["weights"] = [draw.choice([1e308, 1.7e308]) for _ in CHOICES.get(one, [0, 1])]
        elif kind == 8:
            law[draw.choice(["low", "high", "mean", "sd", "sd"])] = draw.choice([-1e308, -1e13, 1e13, 1e308])
        else:
            stiffness = "model.pocket_bar_stiffness_N_m"
            table[stiffness] = {"law": "choices", "values": draw.choice([["rigid", 5e7], [3e7, 5e7]])}
            table["cage.mass_g"] = {"law": "uniform", "low": 8e-7, "high": 1e-6, "times": stiffness}
    return table


def study_with(draw: random.Random, folder: Path, table: dict[str, Any]) -> tuple[Case, list[str]]:
    """The case of the example study with the table, and a design of it as assignments."""
    data = read_toml(STUDY)
    if draw.random() < 0.3:
        data["scene"] = {**data["scene"], "set": draw.sample(SETS, 2)}
    study = Problem(
        folder / "study.toml", validated(StudyFile, {**data, "uncertain": table}, str(folder / "study.toml"))
    )
    point = study.centre + study.step * np.array([draw.uniform(-1.0, 1.0) for _ in study.factors])
    return case_of_study(study), study.assignments(point)


def check(case: Case, table: dict[str, Any], design: list[str], seed: int) -> int:
    """Whether scenes at input sets have what the lists say; returns how many scenes there are."""
    declared = {key for key, law in table.items() if isinstance(law, dict)}
    keys = [each.key for each in case.every]
    assert keys == sorted(set(keys)) and declared <= {*keys} and {*case.sample} <= {*keys}
    assert all(key in keys or any(key in remark for remark in case.remarks) for key in table.get("estimated", ()))
    joint = case.joint(case.every)
    listed = inputs.table_of({each.key: each.law for each in case.every}, joint.sets(4, seed))
    for each in case.every:
        assert math.isfinite(case.unit(each)) and case.unit(each) != 0.0
        for values in listed:
            check_law(each.law, values[each.key])
    scenes = [scene for scene in case.scenes(case.every, listed, seed, design)]
    for number, (scene, values) in enumerate(zip(scenes, listed, strict=True)):
        if isinstance(scene, Scene):
            assert scene.numerics.seed == seed + number
            check_scene(case, scene, values, design)
        else:
            assert scene.isprintable() and len(scene) <= LONGEST_SENTENCE
    return sum(isinstance(scene, Scene) for scene in scenes)


def check_law(law: Any, value: Any) -> None:
    """Whether a value is one of its law."""
    if law.law in ("choices", "sample"):
        assert value in law.values
    else:
        assert (law.low is None or value >= law.low) and (law.high is None or value <= law.high)


def check_scene(case: Case, scene: Scene, values: dict[str, Any], design: list[str]) -> None:
    """Whether a scene has the values that are listed for it, those of ``set`` and of its design."""
    given = case.tables(design)
    for each in case.every:
        key, base, value = each.key, each.law.times, values[each.key]
        if base is None:
            assert value_of(scene, key) == value, key
        elif base != key and (base in values or base not in FOLLOWING):
            assert value_of(scene, key) == pytest.approx(value * value_of(scene, base), rel=1e-12), key
        elif base == key and not FOLLOWING & {*values} - {key}:
            before = copy.deepcopy(scene._tables)
            table, _, name = key.rpartition(".")
            if name in given.get(table, {}):
                before[table][name] = given[table][name]
            else:
                del before[table][name]
            try:
                own = value_of(Scene.from_dict(before), key)
            except InputError:
                continue
            assert value_of(scene, key) == pytest.approx(value * own, rel=1e-12), key
    for assignment in (*case.uncertain.set, *design):
        asked = assignment.partition("=")[2]
        try:
            wanted = tomllib.loads(f"x = {asked}")["x"]
        except tomllib.TOMLDecodeError:
            wanted = asked
        assert value_of(scene, ".".join(key_path(assignment))) == wanted, assignment


@pytest.mark.slow
@pytest.mark.parametrize("where", ["scene", "study"])
def test_what_is_declared_unknown_is_honoured_or_refused(tmp_path: Path, fuzz_cases: int, where: str) -> None:
    """Fuzz: in each scene of an input set stands what is listed for it; the rest is refused in printable sentences."""
    draw, ends, scenes = random.Random(where), Counter[str](), 0
    for each in (SCENE, *EXAMPLES.glob("*.csv")):
        (tmp_path / each.name).write_bytes(each.read_bytes())
    for number in range(fuzz_cases):
        table = table_of(draw, tmp_path)
        table = spoilt(draw, table) if draw.random() < 0.5 else table
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                if where == "study":
                    case, design = study_with(draw, tmp_path, table)
                else:
                    data = {**read_toml(SCENE), "uncertain": table}
                    case, design = case_of(str(tmp_path / "scene.toml"), data, ("impact_force_N",)), []
                scenes += check(case, table, design, number)
            ends["read"] += 1
        except InputError as error:
            ends["refused"] += 1
            assert 1 <= len(error.faults) <= MOST_FAULTS
            for fault in error.faults:
                assert fault.isprintable() and 10 < len(fault) <= LONGEST_SENTENCE, fault
        except BaseException as error:
            error.add_note(f"case {number}: {table}")
            raise
    assert min(ends["read"], ends["refused"]) > fuzz_cases // 5 and scenes > ends["read"]
