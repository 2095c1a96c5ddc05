"""Advice of a refusal holds: what it says to write is accepted, and a file of another kind is named as what it is."""

import random
import re

import numpy as np
import pytest
from conftest import ROOT
from doe_command import doe

import doe as library
from doe.dimension_chain import Chain, solve
from doe.dimension_chain.reading import chain_from
from doe.library.answer import Answer, texts_given
from doe.library.studies import _points_faults
from doe.workflow.problem import Problem
from rbdyn.base.command import plain_number
from rbdyn.base.faults import InputError, MethodError, read_toml
from rbdyn.draft.options import clearance_of, roller_size
from rbdyn.dynamics.ensemble import threads_of
from rbdyn.scene import Scene

EXAMPLES = ROOT / "examples"
WRITE = re.compile(r"write (-?[\d.]+(?: ?x[\d.]+)?)$")


@pytest.mark.parametrize(
    ("text", "advice"), [("0,9kN", "900"), ("0,9", "0.9"), ("900 N", "900"), ("-1,5 kN", "-1500"), ("12.5N", "12.5")]
)
def test_a_number_with_a_comma_or_a_unit_is_told_what_to_write(text, advice):
    """A load as a user writes it."""
    with pytest.raises(MethodError) as refused:
        plain_number(text, "N")
    assert WRITE.search(str(refused.value))[1] == advice and math_of(advice) == float(advice)


def math_of(text: str) -> float:
    """The number that is read of an advice."""
    return plain_number(text, "N")


def test_fuzz_every_advice_on_a_number_is_accepted():
    """Fuzz: 1000 careless numbers, sizes and clearances; what is advised is read, and nothing that cannot be."""
    draw, advised = random.Random(1), 0
    readers = {"N": lambda text: plain_number(text, "N"), "mm": clearance_of, "x": roller_size}
    for _ in range(1000):
        kind = draw.choice(sorted(readers))
        number = draw.choice(["0,9", "0.9", "1,234", "1.234,5", "1,2,3", "9", "-0,1", "+1,5", ",5", "1 000", ""])
        text = number + draw.choice(["", " "]) + draw.choice(["", "N", "kN", "mm", "um", "C", "x7", "x7,5", "lb"])
        try:
            readers[kind](text)
        except MethodError as error:
            if advice := WRITE.search(str(error)):
                advised += 1
                readers[kind](advice[1])
    assert advised > 100


@pytest.mark.parametrize(
    ("load", "name", "kind"),
    [
        (Problem.load, "cylindrical_roller.toml", "this is a scene, not a study; give it to rbdyn simulate, rbdyn ball or doe new"),
        (Scene.load, "clearance_study.toml", "this is a study, not a scene; give it to doe study"),
        (Scene.load, "pocket_chain.toml", "this is a dimension chain, not a scene; give it to doe chain"),
        (Problem.load, "pocket_chain.toml", "this is a dimension chain, not a study; give it to doe chain"),
    ],
)  # fmt: skip
def test_a_file_of_another_kind_is_one_fault(load, name, kind):
    """Instead of an unknown key for each of its tables."""
    with pytest.raises(InputError) as refused:
        load(EXAMPLES / name)
    assert refused.value.faults == [f"{EXAMPLES / name}: {kind}"]


def test_a_fault_in_a_table_does_not_ask_for_the_table():
    """A ring that is smaller than its bore is no missing [mounting]."""
    with pytest.raises(InputError) as refused:
        Scene.load(EXAMPLES / "hot_roller.toml", ["mounting.bore_mm=9999"])
    assert len(refused.value.faults) == 1 and "mounting.outside_diameter_mm = 60" in refused.value.faults[0]


def test_an_empty_expression_is_the_fault_of_its_own_link():
    """Not of a link that only it uses."""
    data = {
        "closing_link": {"lower_mm": 0.0, "upper_mm": 1.0},
        "link": [
            {"name": "a", "coefficient": 0, "nominal_mm": 10.0},
            {"name": "b", "coefficient": 1, "nominal_mm": 0.5},
            {"name": "f", "coefficient": 1, "expression": ""},
        ],
    }
    with pytest.raises(InputError) as refused:
        chain_from(data, "c.toml")
    assert refused.value.faults == [
        'c.toml: link "f": expression = "": is not an arithmetic expression; write it like 0.5*(bore - shaft)'
    ]


def test_the_remedy_of_matched_classes_keeps_the_other_keys_of_the_table():
    """A chain with classes of equal share: what is written below changes their number only, and is accepted."""
    selective = {"first": "a", "second": "b", "classes": 2, "by": "probability", "samples": 5000}
    link = {"upper_mm": 0.05, "lower_mm": -0.05}
    data = {
        "closing_link": {"lower_mm": 9.97, "upper_mm": 10.03},
        "link": [{"name": "a", "coefficient": 1, "nominal_mm": 20.0, **link}, {"name": "b", "coefficient": -1, "nominal_mm": 10.0, **link}],
        "selective": selective,
    }  # fmt: skip
    result = solve(Chain.model_validate(data))
    classes = int(re.search(r"Write classes = (\d+) under selective to meet", result.remedy.sentence)[1])
    assert (
        result.refused
        and not solve(Chain.model_validate(data | {"selective": selective | {"classes": classes}})).refused
    )


def test_a_yield_that_random_assemblies_cannot_show_is_named():
    """0.999999 of a chain with functions, by 100 000 assemblies."""
    data = read_toml(EXAMPLES / "pocket_chain.toml")
    links = [{"name": name, "coefficient": sign, "nominal_mm": 10.0} for name, sign in (("a", 1), ("b", -1))]
    data = {
        "closing_link": {"lower_mm": -0.5, "upper_mm": 0.5},
        "link": [*links, {"name": "f", "coefficient": 1, "expression": "0.01*a*b - 1"}],
        "allocate": {"mode": "yield", "target_yield": 0.999999},
    }
    status = solve(Chain.model_validate(data)).status
    assert (
        "target_yield = 0.999999: 100000 random assemblies cannot show it" in status
        and "write at most 0.99999" in status
    )
    data["allocate"]["target_yield"] = 0.99999
    assert not solve(Chain.model_validate(data)).refused


def test_a_set_is_no_list_of_factors():
    """Its order, and with it the letters of the terms, changes from one process to the next."""
    with pytest.raises(InputError, match="a set has no order; write a list such as"):
        library.fit(data=EXAMPLES / "ccd_table4.csv", factors={"pocket_clearance_mm", "guide_clearance_mm"})
    assert texts_given(("a", "b"), "factors", "[]") == ["a", "b"]


def test_what_is_read_of_an_answer_does_not_change_it():
    """A table that is emptied."""
    answer = Answer({"pick": {"factors": {"a": 1.0}}})
    answer["pick"]["factors"].clear()
    answer["pick"].clear()
    assert answer["pick"] == {"factors": {"a": 1.0}}


def test_whole_numbers_of_numpy_are_whole_numbers():
    """Input sets and threads."""
    assert _points_faults(np.int64(16)) == [] and _points_faults(True) and _points_faults(16.0)
    assert threads_of(np.int64(2)) == 2


def test_help_shows_no_type_for_an_option_without_a_value(command):
    """Of the programs themselves and of a command."""
    for shown in (command("--help"), command("simulate", "--help"), doe("--help"), doe("fit", "--help")):
        assert shown.returncode == 0 and "--help" in shown.stdout and "bool" not in shown.stdout
