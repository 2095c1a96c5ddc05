"""What the stages of a command still cost, by what its runs took so far."""

from doe.running.agenda import Agenda
from rbdyn.records.forecast import Forecast, Measured

# Scatter of the time of a unit of work between runs at other points: clearances and inputs decide how long figures drift.
SCATTER = 0.35
# What a stage takes besides its runs, at least and at most, over what it takes about.
BESIDES = (0.5, 2.0)


def forecast_of(agenda: Agenda, at_once: float, measured: Measured, growth: float = 1.0) -> Forecast | None:
    """What is left of an agenda with so many runs at once; None where nothing was measured and runs are left.

    ``growth``: how many times as long as those measured the runs may become, where these have not ended.
    """
    left = agenda.stages[agenda.place :]
    runs = agenda.runs_left
    turns = tuple(sum(stage.left[end] * stage.each for stage in left) for end in (0, 1))
    if measured.pace is None and runs[1]:
        return None
    pace, factors = measured.pace or 0.0, measured.factors(max(runs[0], 1), SCATTER)
    besides_s = agenda.crowd * sum(stage.besides_s for stage in left)
    ran_s = [pace * work * factor / at_once for work, factor in zip(turns, factors, strict=True)]
    low, high = (ran + besides_s * share for ran, share in zip(ran_s, BESIDES, strict=True))
    longest_s = high + (growth - 1.0) * ran_s[1] if growth > 1.0 else 0.0
    return Forecast(runs, (turns[0], turns[1]), (low, high), round(at_once), longest_s, steps=True)
