"""What the accuracy studies conclude: nothing from noisy tables, the right thing from sharp ones."""

import math

import numpy as np
import pytest

from rbdyn.accuracy import tolerances
from rbdyn.accuracy.tolerances import OUTPUTS, about, judged, overall, replicates_needed, turns_needed
from rbdyn.dynamics.statistics.batch_means import student_factor, student_half_width

RTOLS = (0.1, 0.02, 0.01, 1e-4)


def bias(size, error):
    """The same bias and error of every output."""
    return dict.fromkeys(OUTPUTS, 1.0), dict.fromkeys(OUTPUTS, size), dict.fromkeys(OUTPUTS, error)


def tolerance_rows(sizes, error, gaps=(1e-2, 1e-4, 1e-5, 1e-7)):
    """Rows of the tolerances study; the last is the reference."""
    return [
        tolerances.Row(*bias(size, error), rtol, 1.0, 600.0, 340.0, gap)
        for rtol, size, gap in zip(RTOLS, (*sizes, 0.0), gaps, strict=True)
    ]


@pytest.mark.parametrize(
    ("value", "error", "verdict"),
    [
        (0.002, 0.001, "within"), (-0.009, 0.01, "within"), (0.011, 0.009, "beyond"), (-0.2, 0.05, "beyond"),
        (0.03, 0.05, "undecided"), (0.0, 0.02, "undecided"), (0.0, math.nan, "undecided"),
        (0.5, math.nan, "undecided"), (math.nan, 0.001, "undecided"), (0.5, math.inf, "undecided"),
    ],
)  # fmt: skip
def test_unit_judged(value, error, verdict):
    """Unit: an error above what is sought decides only what stands out of it."""
    assert judged(value, error, 0.01) == judged(-value, error, 0.01) == verdict


def test_unit_overall():
    """Unit: one bias settles it, one doubt leaves it open."""
    assert overall(["within", "undecided", "beyond"]) == "beyond"
    assert overall(["within", "undecided"]) == "undecided"
    assert overall(["within", "within"]) == "within"


def test_unit_needed_by_the_root_of_turns_and_replicates():
    """Unit: half the error takes four times the turns; so many replicates of the same scatter have the error sought."""
    assert turns_needed(0.04, 100.0, 0.01) == pytest.approx(1600.0)
    assert turns_needed(0.01, 100.0, 0.01) == pytest.approx(100.0)
    few = student_half_width(np.array([-1.0, 1.0]) / math.sqrt(2.0))  # two replicates of scatter 1
    for sought in (1.0, 0.3, 0.05):
        needed = replicates_needed(few, 2, sought)
        assert student_factor(needed - 1) / math.sqrt(needed) <= 1.01 * sought
        assert student_factor(needed - 2) / math.sqrt(needed - 1) >= 0.99 * sought
    assert [about(count) for count in (0.3, 7.0, 43.2, 1234.0, 99.5, 100.0)] == [
        "1", "7", "44", "1300", "100", "100",
    ]  # fmt: skip


def test_unit_noisy_tolerances_conclude_nothing(outer):
    """Unit: errors of 20 % choose no tolerance, whatever the biases; the power balance, without scatter, still tells."""
    for sizes in ((0.0, 0.0, 0.0), (0.05, 0.14, 0.02)):
        told = tolerances.conclusion(tolerance_rows(sizes, 0.2), outer)
        assert told.startswith("undecided: errors of 20 % hide differences of")
        assert "is the loosest" not in told and "measure at most" not in told
        expected = turns_needed(0.2, outer.numerics.turns)
        assert f"numerics.turns to about {about(expected)} " in told
        expected = replicates_needed(0.2, outer.numerics.replicates)
        assert told.endswith(f"numerics.replicates to about {about(expected)}")
    # The loosest, whose balance does not close, is out without statistics.
    assert "rtol 0.1" not in told


def test_unit_sharp_tolerances_conclude(outer):
    """Unit: errors of 0.2 % name the loosest tolerance within 1 %, tighter where that is sought."""
    rows = tolerance_rows((0.03, 0.004, 0.001), 0.002, gaps=(1e-4, 1e-4, 1e-5, 1e-7))
    assert tolerances.conclusion(rows, outer).startswith("rtol 0.02 is the loosest whose biases measure at most 1 %")
    told = tolerances.conclusion(rows, outer, 0.003)
    assert told.startswith("rtol 0.01 is the loosest whose biases measure at most 0.3 % (their errors at most 0.2 %)")
    biased = tolerance_rows((0.03, 0.02, 0.02), 0.002)
    assert "no tolerance looser than the reference, rtol 0.0001," in tolerances.conclusion(biased, outer)
    assert tolerances.conclusion(rows[-1:], outer).startswith("no tolerance looser than the reference")


def test_unit_mixed_tolerances_conclude_what_they_can(outer):
    """Unit: one sharp row among noisy ones is named, and is not called the loosest."""
    rows = tolerance_rows((0.0, 0.0, 0.0), 0.05)
    rows[2] = tolerances.Row(*bias(0.001, 0.002), 0.01, 1.0, 600.0, 340.0, 1e-5)
    told = tolerances.conclusion(rows, outer)
    assert told.startswith("rtol 0.01 is one whose biases measure at most 1 % (their errors at most 0.2 %)")
    assert "Looser ones are undecided: errors of 5 % hide differences of 0 %" in told
