"""Numbers of things in words."""

import re

import pytest
from conftest import EXAMPLE
from instant_runs import instant_result

from rbdyn.base.notes import Note
from rbdyn.base.words import all_of, are, counted, improvement
from rbdyn.scene import Scene


@pytest.mark.parametrize(
    ("number", "noun", "words"),
    [
        (0, "note", "0 notes"), (1, "note", "1 note"), (2, "note", "2 notes"), (1.0, "turn", "1 turn"),
        (1.5, "turn", "1.5 turns"), (1, "class", "1 class"), (3, "class", "3 classes"),
        (12345678, "run", "12345678 runs"), (1234567, "point", "1234567 points"),
    ],
)  # fmt: skip
def test_unit_number_of_things_has_its_plural(number, noun, words):
    """Unit: one thing stands in the singular, all other numbers of them in the plural, whole numbers in full."""
    assert counted(number, noun) == words
    assert are(number) == ("is" if number == 1 else "are")


@pytest.mark.parametrize(
    ("gain", "error", "words"),
    [
        (3.304, 0.62, "3.30 ± 0.62 % less"),
        (-3.304, None, "3.30 % more"),
        (0.0016265, 0.0, "0.0016 % less"),
        (0.0, None, "0.00 % less"),
    ],
)
def test_unit_a_small_exact_change_keeps_two_digits(gain, error, words):
    """Unit: an exact change below 0.1 does not round to nothing."""
    assert improvement(gain, error, "min") == words


def test_unit_result_of_one_note_counts_one_note():
    """Unit: what a notebook shows of a result."""
    from dataclasses import replace

    result = replace(instant_result(Scene.load(EXAMPLE)), notes=(Note("remark", "only this"),), replicates=1)
    shown = repr(result) + result._repr_html_()
    assert "1 note" in shown and "1 replicate," in shown
    assert not re.search(r"\b1 (notes|replicates)", shown)


@pytest.mark.parametrize(
    ("names", "words"), [([], ""), (["a"], "a"), (["a", "b"], "a and b"), (["a", "b", "c"], "a, b and c")]
)
def test_unit_all_names_are_listed_with_commas_and_one_and(names: list[str], words: str) -> None:
    assert all_of(iter(names)) == words
