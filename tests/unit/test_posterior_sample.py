"""A posterior sample on disk: what a calibration writes is what a scene reads, of every kind of key and choice."""

import json
import random
from pathlib import Path
from typing import Any

import pytest

from doe.report.sections.calibration import write_sample
from doe.unknown.inputs import values_of
from doe.workflow.input_sets import read_case, read_sample
from rbdyn.base.faults import InputError
from rbdyn.base.files import digest_of
from rbdyn.scene.uncertain import Law

EXAMPLE = Path(__file__).parents[2] / "examples" / "cylindrical_roller.toml"
# Values of a key as the scene has them.
TYPED = {
    "bearing.rollers": [9, 10, 12], "model.slices": [1, 31], "model.pocket_film": [True, False], "cage.guidance": ["outer", "inner"],
    "model.pocket_bar_stiffness_N_m": ["rigid", 5e7, 0.1 + 0.2], "cage.mass_g": [45.0, 44.99999999999999, 1e2],
    "lubricant.oil": ["ISO VG 32", "Mobil Jet Oil II"], "numerics.discard_turns": ["auto", 3.0],
}  # fmt: skip
# Choices that a law may state, whatever the key: what looks like another type, and what CSV puts in quotes.
STATED = [
    [True, False], [1, 2, 3], [1, 2.5, "x"], ["1", "2"], ["true", "false"], ["1e3", "nan", "inf"], ["a,b", 'c"d', "e\nf"], ["007", "7"],
    ["", "x"], [0.1, 1e-12, 1e12], [-1, 0, 10**18], ["yes", "no", "no1"], ["è", "１", "0x10"], [True, "1"], [1.0, "true"], ["1_000", "a b"],
]  # fmt: skip


def _same(one: Any, other: Any) -> bool:
    return type(one) is type(other) and one == other


def test_unit_every_kind_of_key_comes_back_from_the_sample_as_the_scene_has_it(tmp_path: Path) -> None:
    """Unit: whole numbers stay whole, booleans booleans, text text and numbers the same to the last bit."""
    draw = random.Random(3)
    rows = [{key: draw.choice(values) for key, values in TYPED.items()} for _ in range(60)]
    write_sample(rows, tmp_path / "posterior.csv")
    columns = read_sample(tmp_path / "posterior.csv", {})
    assert all(_same(columns[key][place], row[key]) for place, row in enumerate(rows) for key in TYPED)


@pytest.mark.parametrize("values", STATED, ids=repr)
@pytest.mark.parametrize("key", ["cage.guidance", "model.pocket_film", "bearing.rollers"])
def test_unit_choices_come_back_as_their_law_states_them(tmp_path: Path, key: str, values: list[Any]) -> None:
    """Unit: the law's own values decide, also where text looks like a number, a boolean or nothing."""
    law, draw = Law(law="choices", values=values), random.Random(len(values))
    rows = [{key: draw.choice(values)} for _ in range(30)]
    write_sample(rows, tmp_path / "posterior.csv")
    column = read_sample(tmp_path / "posterior.csv", {key: law})[key]
    assert len(column) == len(rows) and all(_same(read, row[key]) for read, row in zip(column, rows, strict=True))


def test_unit_a_sample_of_choices_gives_scenes(tmp_path: Path) -> None:
    """Unit: a sample of a whole number, a boolean and a word is accepted by the scene that named them."""
    laws = {
        "bearing.rollers": [9, 10],
        "model.pocket_film": [True, False],
        "model.pocket_bar_stiffness_N_m": [5e7, "rigid"],
    }
    lines = [f'"{key}" = {{law = "choices", values = {json.dumps(values)}}}' for key, values in laws.items()]
    uncertain = "\n".join(["", "[uncertain]", 'defaults = "none"', 'sample = "posterior.csv"', *lines, ""])
    (tmp_path / "scene.toml").write_text(EXAMPLE.read_text("utf-8") + uncertain, "utf-8")
    quantiles = [0.1, 0.4, 0.6, 0.9]
    columns = {key: values_of(Law(law="choices", values=values), quantiles) for key, values in laws.items()}
    write_sample(
        [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)],
        tmp_path / "posterior.csv",
    )
    case = read_case(tmp_path / "scene.toml", ("impact_force_N",), ())
    scenes = case.scenes(case.every, [{key: column[row] for key, column in case.sample.items()} for row in range(4)], 0)
    assert [scene.bearing.rollers for scene in scenes] == [9, 9, 10, 10]
    assert [scene.model.pocket_film for scene in scenes] == [True, True, False, False]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("cage.mass_g\n45\n4S\n46\n", "cage.mass_g in row 2 = '4S': is not a value of that key; rbdyn keys cage.mass_g lists which are"),
        ("cage.mass_g\n45\n-5\n46\n", "cage.mass_g in row 2 = -5: is not a value of that key"),
        ("cage.mass_g\n45\n\"\"\n46\n", "cage.mass_g in row 2 = '': is empty; fill it in or remove the row"),
        ("cage.mass_g\n45\n1e400\n", "cage.mass_g in row 2 = 1e400: is not a value of that key"),
        ("cage.mass_g\n45\n" + "9" * 5000, "is longer than 400 characters; write a shorter value"),
        ("bearing.rollers\n10\n10.5\n", "bearing.rollers in row 2 = 10.5: is not a value of that key"),
        ("bearing.rollers\n10\n" + "9" * 30 + "\n", "bearing.rollers in row 2 = 999999999999999999999999999999: is not a value"),
        ("model.pocket_film\ntrue\n1\n", "model.pocket_film in row 2 = 1: is not a value of that key"),
        ("cage.guidance\nouter\ntop\n", "cage.guidance in row 2 = 'top': is not a value of that key"),
        ("cage.mas_g\n45\n46\n", "column cage.mas_g: unknown key; did you mean cage.mass_g?"),
        ("cage\n45\n46\n", "cage in row 1 = 45: is not a value of that key"),
        (",cage.mass_g\n0,45\n1,46\n", "column 1 has no name; name it or remove it"),
        ("cage.mass_g\n45\n", "has one row; a sample needs two at least"),
    ],
)  # fmt: skip
def test_unit_a_cell_that_is_no_value_of_its_key_is_named(tmp_path: Path, text: str, words: str) -> None:
    """Unit: file, column, row, value and fix, whichever row it is."""
    (tmp_path / "posterior.csv").write_text(text, "utf-8")
    with pytest.raises(InputError) as refused:
        read_sample(tmp_path / "posterior.csv", {})
    assert refused.value.faults[0].startswith(f"{tmp_path / 'posterior.csv'}: ") and words in refused.value.faults[0]


def test_unit_a_record_that_is_no_record_casts_no_doubt(tmp_path: Path) -> None:
    """Unit: brackets without end or other JSON beside a sample are no record of a calibration."""
    sample = tmp_path / "posterior.csv"
    sample.write_text("cage.mass_g\n45\n46\n", "utf-8")
    uncertain = '\n[uncertain]\ndefaults = "none"\nsample = "posterior.csv"\n'
    (tmp_path / "scene.toml").write_text(EXAMPLE.read_text("utf-8") + uncertain, "utf-8")
    mine = {"verdict": "not\ncalibrated", "reasons": ["x" * 5000], "sha256": digest_of(sample.read_bytes())}
    for text in ("[" * 100_000, "9" * 5000, "[]", '{"verdict": 1}', json.dumps(mine)):
        sample.with_suffix(".json").write_text(text, "utf-8")
        doubt = read_case(tmp_path / "scene.toml", ("impact_force_N",), ()).doubt
        assert bool(doubt) is text.startswith('{"verdict": "not') and (doubt.isprintable() and len(doubt) <= 1000)
