"""What runs still cost: one sentence for all commands, and a range that narrows as runs are measured."""

import math
from functools import reduce

import pytest

from doe.running.runner import BESIDES, Agenda, Stage, forecast_of
from rbdyn.base.forecast import Forecast, Measured, duration, span


@pytest.mark.parametrize(
    ("seconds", "words"),
    [
        (0.0123, "0.012 s"),
        (2.34, "2.3 s"),
        (119.0, "120 s"),
        (150.0, "2.5 min"),
        (1440.0, "24 min"),
        (9000.0, "2.5 h"),
        (1e6, "12 days"),
    ],
)
def test_unit_a_duration_has_two_digits_and_the_unit_that_suits_it(seconds, words):
    """Unit: seconds, minutes, hours and days."""
    assert duration(seconds) == words


@pytest.mark.parametrize(
    ("ends", "words"),
    [((12.0, 15.0), "12 to 15 s"), ((90.0, 150.0), "90 s to 2.5 min"), ((150.0, 150.4), "about 2.5 min")],
)
def test_unit_a_span_names_a_unit_once(ends, words):
    """Unit: equal units, other units, equal words."""
    assert span(*ends) == words


@pytest.mark.parametrize(
    ("left", "sentence"),
    [
        (
            Forecast((38, 55), (3800.0, 5500.0), (35.0, 150.0), 2, steps=True),
            "38 to 55 runs of 3800 to 5500 shaft turns in all remain, 2 at once: 35 s to 2.5 min with all steps to the "
            "report",
        ),
        (
            Forecast((1, 1), (120.0, 120.0), (12.0, 15.0), 4, 96.0, remedy="reduce numerics.turns"),
            "1 run of 120 shaft turns in all remains, 4 at once: 12 to 15 s, up to 96 s if figures drift",
        ),
        (
            Forecast((8, 8), (960.0, 960.0), (250.0, 400.0), 2, remedy="reduce numerics.turns"),
            "8 runs of 960 shaft turns in all remain, 2 at once: 4.2 to 6.7 min; reduce numerics.turns to shorten it",
        ),
        (Forecast((0, 0), (0.0, 0.0), (8.0, 30.0), 2, steps=True), "no run remains; the steps to the report take 8 to 30 s"),
    ],
)  # fmt: skip
def test_unit_a_forecast_is_one_sentence(left, sentence):
    """Unit: a range of runs, a single run that may be lengthened, a long time with its remedy, steps alone."""
    assert left.sentence == sentence


def test_unit_a_range_narrows_as_runs_are_measured_and_widens_with_their_scatter():
    """Unit: the range holds the mean pace; twenty equal runs narrow it, twenty unlike ones do less."""
    few, many, unlike = (
        reduce(lambda measured, seconds: measured.plus(10.0, seconds), times, Measured())
        for times in ([2.0, 2.0], [2.0] * 20, [1.0, 4.0] * 10)
    )
    assert few.pace == many.pace == pytest.approx(0.2) and unlike.pace == pytest.approx(0.25)
    spans = [math.log(high / low) for low, high in (each.factors(20, 0.35) for each in (few, many, unlike))]
    assert spans[1] < 0.5 * spans[0] and spans[1] < spans[2]
    # Logarithms of 1 and 4 in equal parts have the deviation ln 2.
    deviation = math.sqrt(unlike.squares / 20)
    assert deviation == pytest.approx(math.log(2.0))


def test_unit_stages_to_the_end_count_with_what_they_run_at_least_and_at_most():
    """Unit: what is done or stored of a stage is not left; steps without runs take longer on a busy machine."""
    design = Stage.of("design runs", 20, 10.0)
    design.finished_runs, design.stored_runs = 5, 8
    stages = [design, Stage("front", besides_s=6.0), Stage.of("confirmation", 5, 30.0, fewest=2, most=8)]
    agenda = Agenda("doe study", {}, "", 2, stages)
    assert agenda.runs_left == (12 + 2, 12 + 8)
    assert forecast_of(agenda, 2, Measured()) is None
    measured = Measured().plus(10.0, 1.0).plus(10.0, 1.0)
    idle = forecast_of(agenda, 2, measured)
    assert idle is not None and idle.turns == (12 * 10.0 + 2 * 30.0, 12 * 10.0 + 8 * 30.0)
    low, high = measured.factors(14, 0.35)
    ends = (0.1 * 180.0 * low / 2 + 6.0 * BESIDES[0], 0.1 * 360.0 * high / 2 + 6.0 * BESIDES[1])
    assert idle.seconds == pytest.approx(ends)
    agenda.crowd = 3.0
    busy = forecast_of(agenda, 2, measured)
    assert busy is not None and busy.seconds[0] - idle.seconds[0] == pytest.approx(2.0 * 6.0 * BESIDES[0])
    longer = forecast_of(agenda, 2, measured, growth=8.0)
    assert longer is not None and longer.longest_s == pytest.approx(busy.seconds[1] + 7.0 * 0.1 * 360.0 * high / 2)
