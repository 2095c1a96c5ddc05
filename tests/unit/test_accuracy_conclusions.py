"""What the accuracy studies conclude: nothing from noisy tables, the right thing from sharp ones."""

from __future__ import annotations

import math

import ball_solvers
import method_bias
import numpy as np
import pytest
import replication
import slicing

from rbdyn.accuracy import tolerances
from rbdyn.accuracy.tolerances import (
    OUTPUTS,
    Bias,
    about,
    check_replicates,
    judged,
    overall,
    replicates_needed,
    turns_needed,
)
from rbdyn.base.faults import InputError
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
        (0.002, 0.001, "within"),
        (-0.009, 0.01, "within"),
        (0.011, 0.009, "beyond"),
        (-0.2, 0.05, "beyond"),
        (0.03, 0.05, "undecided"),
        (0.0, 0.02, "undecided"),
        (0.0, math.nan, "undecided"),
        (0.5, math.nan, "undecided"),
        (math.nan, 0.001, "undecided"),
        (0.5, math.inf, "undecided"),
    ],
)
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


def test_unit_methods_conclude_only_what_errors_allow(outer):
    """Unit: a method is called without bias only by a sharp row; failures and open balances count for nothing."""

    def rows(error):
        return [
            method_bias.Row("ours", "rtol 0.1", "ok", 1.0, 1e-2, Bias(*bias(0.0, error))),
            method_bias.Row("ours", "rtol 0.01", "ok", 1.2, 1e-4, Bias(*bias(0.002, error))),
            method_bias.Row("ours", "rtol 0.001", "ok", 1.4, 1e-5, Bias(*bias(0.001, error))),
            method_bias.Row("Verlet", "568 steps a turn", "ok", 0.5, 1e-4, Bias(*bias(0.3, error))),
            method_bias.Row("RK4", "284 steps a turn", "failed: not finite", None, None, None),
        ]

    noisy = method_bias.conclusion(rows(0.43), outer)
    assert noisy.startswith("Which method keeps its statistics is undecided: errors of 43 % hide")
    sharp = method_bias.conclusion(rows(0.003), outer)
    assert "ours 1.20 ms (rtol 0.01, errors at most 0.3 %)" in sharp
    assert "Verlet" not in sharp and "undecided" not in sharp
    none = method_bias.conclusion(rows(0.003)[3:], outer)
    assert none == "No method shows biases of at most 1 % and a power balance closed to 0.5 %."


def test_unit_slices_conclude_only_what_errors_allow(outer):
    """Unit: the load, which does not scatter, is told at any noise; the outputs only where their errors allow."""

    def rows(error):
        return [
            slicing.Row(*bias(size, error), slices, load, 1000.0)
            for slices, load, size in ((9, 0.02, 0.0), (31, 0.004, 0.003), (61, 0.001, 0.001), (241, 1e-4, 0.0))
        ]

    noisy, sharp = slicing.conclusion(rows(0.2), outer), slicing.conclusion(rows(0.003), outer)
    load = "31 slices are the fewest whose load is right within 0.5 %"
    assert noisy.startswith(load) and sharp.startswith(load)
    assert "undecided: errors of 20 % hide differences" in noisy and "measure at most" not in noisy
    assert sharp.endswith("At 31 the biases of the outputs measure at most 1 % (their errors at most 0.3 %).")
    coarse = [slicing.Row(*bias(0.0, 0.003), 9, 0.02, 900.0)]
    assert slicing.conclusion(coarse, outer) == "not even 9 slices keep the load within 0.5 %"


def test_unit_replicates_conclude_only_what_the_pool_allows(outer):
    """Unit: a pool of four does not tell a slope of -0.5 from none, nor a half-width to a factor of two."""
    draw = np.random.default_rng(2)
    turns = (10.0, 20.0, 40.0, 80.0)

    def study(pool, size):
        samples = {n: {name: 1.0 + size * draw.normal(size=pool) / math.sqrt(n) for name in OUTPUTS} for n in turns}
        rows = replication.replication_rows(samples, dict.fromkeys(turns, 1.0), (2, 4, 8, 16, 32))
        slopes = {name: replication.slope(turns, [samples[n][name] for n in turns]) for name in OUTPUTS}
        return " ".join(replication.conclusion(rows, slopes, outer, pool))

    few = study(4, 0.15)
    assert "undecided: errors of" in few and "as independent turns do" not in few
    assert "within 1 %: undecided; " in few
    many = study(400, 0.1)
    assert "undecided" not in many and "as independent turns do" in many
    assert "within 1 %: more than 32 replicates of 80 turns; by the square root about" in study(400, 2.0)


def test_unit_a_single_replicate_is_refused(make_scene):
    """Unit: one mean has no error to judge by."""
    with pytest.raises(InputError, match=r"numerics\.replicates = 1: .* give at least 2"):
        check_replicates(make_scene("numerics.replicates=1"))


def test_unit_solvers_are_told_apart_only_by_enough_scenes():
    """Unit: 19 of 20 beside 20 of 20 is no difference, 950 beside 1000 of 1000 is; Wilson's interval as published."""
    assert ball_solvers.share(81, 263) == pytest.approx((0.2553, 0.3662), abs=2e-4)  # Newcombe 1998, Table I
    assert ball_solvers.share(0, 20) == pytest.approx((0.0, 0.1611), abs=2e-4)

    def told(total):
        rows = [
            ball_solvers.Success(name, total, solved, median, median, median, 5.0, {})
            for name, solved, median in (("sure", 1.0, 60.0), ("quick", 0.95, 20.0))
        ]
        return ball_solvers.conclusion([], rows)

    assert "Take quick" in told(20) and "do not separate its reliability from sure" in told(20)
    assert "Take sure" in told(1000) and "do not separate" not in told(1000)
