"""Records: what stands where in their JSON form, what is read back and what is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chains import read_chain

from doe.dimension_chain import solve
from rbdyn import BallResult, BallScene, InputError, SimulationResult, equilibrium
from rbdyn.base.records import Record, derived, keyed, outside_json, spread
from rbdyn.dynamics.slip_map import Point
from rbdyn.result import Quantity

EXAMPLES = Path(__file__).parents[2] / "examples"
SINGLE, DOUBLE = EXAMPLES / "angular_contact_ball.toml", EXAMPLES / "double_decker.toml"


class Part(Record):
    """A record within another."""

    size: float
    names: tuple[str, ...] = ()


class Whole(Record, kw_only=True):
    """One of everything."""

    twice: float = derived(lambda self: 2.0 * self.first, "sums", "twice")
    first: float = keyed("sums", "first")
    part: Part
    hidden: Any = outside_json(default=None)
    table: dict[str, Part] = spread()
    note: str | None = None
    values: Any = keyed("array")


def whole() -> Whole:
    """A record with a spread table, an array and no note."""
    table = {"left": Part(1.0), "right": Part(2.0, ("a", "b"))}
    return Whole(first=3.0, part=Part(4), table=table, values=np.arange(3), hidden=object())


def test_unit_keys_and_their_order():
    """Unit: fields in their order, under their paths; no hidden one, and none that is None by default."""
    assert json.dumps(whole().as_dict()) == (
        '{"sums": {"twice": 6.0, "first": 3.0}, "part": {"size": 4, "names": []}, '
        '"left": {"size": 1.0, "names": []}, "right": {"size": 2.0, "names": ["a", "b"]}, "array": [0, 1, 2]}'
    )


def test_unit_what_was_written_is_read():
    """Unit: the JSON form gives the record again, tuples as tuples, with its note where there is one."""
    data = {**json.loads(json.dumps(whole().as_dict())), "note": "told"}
    found = Whole.from_dict(data)
    assert found.table == whole().table and found.part == Part(4.0) and found.twice == 6.0
    assert found.note == "told" and found.hidden is None and found.as_dict().pop("note") == "told"


@pytest.mark.parametrize(
    ("key", "value"),
    [("sums", {}), ("sums", 3), ("part", None), ("part", {"size": "4", "names": []}), ("left", 1.0), ("note", 2),
     ("part", {"size": True, "names": []}), ("part", {"size": 1.0, "names": [1]}), ("part", {"size": 1.0, "names": "a"})],
)  # fmt: skip
def test_unit_what_is_no_such_record_is_refused(key, value):
    """Unit: a key that lacks, and a value of another kind than its field is declared to be."""
    data = json.loads(json.dumps(whole().as_dict())) | {key: value}
    with pytest.raises((KeyError, TypeError)):
        Whole.from_dict(data)


def test_invariant_saved_results_load_as_they_were(outer_result, tmp_path):
    """Invariant: results of rollers and of balls, found and not, and points of a map, are the same once saved and loaded."""
    results = [outer_result, *(equilibrium(BallScene.load(file)) for file in (SINGLE, DOUBLE))]
    results.append(equilibrium(BallScene.load(SINGLE, ["operation.radial_load_N=1e7"])))
    assert not results[-1].is_equilibrium and "balls" not in results[-1].as_dict()
    for result in results:
        result.save(tmp_path / "result.json")
        assert type(result).load(tmp_path / "result.json").as_dict() == result.as_dict()
    found = {name: Quantity(1.0, 0.1, None, 9.0) for name in ("cage_slip", "power_loss_W")}
    for point in (Point(1e4, 500.0, "ok", found, 1e-3), Point(1e4, 500.0, "failed: lost", {}, None)):
        assert Point.from_dict(json.loads(json.dumps(point.as_dict()))) == point


def test_invariant_json_shares_nothing(outer_result):
    """Invariant: whoever changes the JSON form, however deep, changes no result."""
    chain = solve(read_chain(EXAMPLES / "pocket_chain.toml"), samples=100)
    for record in (outer_result, equilibrium(BallScene.load(SINGLE)), chain):
        before = json.dumps(record.as_dict())
        emptied(record.as_dict())
        assert json.dumps(record.as_dict()) == before


def emptied(value: Any) -> None:
    """Empty all tables and lists within a value."""
    if isinstance(value, dict | list):
        for each in value.values() if isinstance(value, dict) else value:
            emptied(each)
        value.clear()


@pytest.mark.parametrize(
    ("kind", "file", "spoil", "what"),
    [
        (SimulationResult, None, lambda data: data["races"].update(inner=3), "simulation result"),
        (BallResult, SINGLE, lambda data: data["balls"].append(3), "equilibrium"),
        (BallResult, DOUBLE, lambda data: data["inner"].pop("balls"), "equilibrium"),
        (BallResult, SINGLE, lambda data: [data.pop(key) for key in list(data) if key not in KEPT], "equilibrium"),
    ],
)
def test_unit_a_result_that_is_not_whole_is_one_sentence(outer_result, tmp_path, kind, file, spoil, what):
    """Unit: a file that lost a part, or has another in its place, says so and what to do."""
    data = (outer_result if file is None else equilibrium(BallScene.load(file))).as_dict()
    spoil(data)
    path = tmp_path / "result.json"
    path.write_text(json.dumps(data))
    with pytest.raises(InputError) as caught:
        kind.load(path)
    assert caught.value.faults == [f"{path}: not a whole {what}; run the scene again"]


# What a result without an equilibrium has; one that is "ok" needs more.
KEPT = ("format", "status", "raceway_control", "solver", "cost", "versions", "scene")
