"""Simulations at chosen points, and whether what they gain over the baseline is more than their error."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import special

from doe import clearance
from doe.arrays import Array
from doe.clearance import Simulations
from doe.running.failure import Failure
from doe.study.goals import goals_of
from doe.study.predicted import verdict
from doe.study_file import Study
from doe.threads import one_thread
from rbdyn.faults import RunError
from rbdyn.records.record import Record, derived, keyed, outside_json
from rbdyn.records.words import improvement
from rbdyn.result import SimulationResult


@dataclass(frozen=True)
class Choice:
    """A point (k,) in factor units, at the resolution of the drawing, and why it was chosen."""

    point: Array
    reason: str


@dataclass(frozen=True)
class Confirmed:
    """Simulated responses (m,) at a point, with 95 % statistical and numerical half-widths.

    Every interval of a simulated response joins the two by `error`: the root sum square of the statistical and the
    numerical half-width, as of independent errors; that of a gain joins those of both of its runs in the same way.
    ``power_terms``: power losses [W] by contact; ``reason``: why the point was chosen.
    """

    point: Array
    values: Array
    statistical: Array
    numerical: Array
    power_terms: Mapping[str, float] = field(default_factory=dict)
    reason: str = ""

    @property
    def error(self) -> Array:
        """Joint 95 % half-widths (m,); NaN where neither part is known."""
        known = np.isfinite(self.statistical) | np.isfinite(self.numerical)
        joint: Array = np.hypot(np.nan_to_num(self.statistical), np.nan_to_num(self.numerical))
        return np.where(known, joint, np.nan)


class Gain(Record):
    """Relative improvement [%] of a response at a point over the baseline, with its 95 % half-width.

    ``verdict``: whether the change is larger than its error; ``goal``: what is wanted of the response.
    """

    response: str = outside_json()
    percent: float
    error: float = keyed("error_percent")
    goal: str = "min"
    verdict: str = derived(lambda self: verdict(self.percent, self.error))


@one_thread
def confirm(
    study: Study, choices: Mapping[str, Choice], simulations: Simulations
) -> tuple[dict[str, Confirmed], list[Failure]]:
    """Simulate the baseline and the choices with fresh seeds; returns what went well and what failed.

    Raises RunError where the baseline or the pick cannot be simulated, InputError, KeyboardInterrupt.
    """
    wanted = {"baseline": Choice(study.baseline, "the original design"), **choices}
    scenes = [
        clearance.confirmation_scene(study.at(()) if name == "baseline" else study, choice.point)
        for name, choice in wanted.items()
    ]
    results = simulations.run(scenes, list(wanted), simulations.progress("confirmation"))
    confirmed, failures = {}, []
    for (name, choice), result in zip(wanted.items(), results, strict=True):
        if not isinstance(result, Failure):
            confirmed[name] = confirmed_from(study, choice, result)
        elif name in ("baseline", "pick"):
            raise RunError(f"confirmation of the {result}")
        else:
            failures.append(result)
    return confirmed, failures


def confirmed_from(study: Study, choice: Choice, result: SimulationResult) -> Confirmed:
    """The study's responses of a simulation at a chosen point."""
    record = result.as_dict()
    quantities = [record[name] for name in study.responses]
    values, statistical, numerical = (
        np.array([np.nan if quantity[key] is None else quantity[key] for quantity in quantities])
        for key in ("value", "statistical_error", "numerical_error")
    )
    return Confirmed(choice.point, values, statistical, numerical, result.power_terms, choice.reason)


def gains(study: Study, baseline: Confirmed, pick: Confirmed) -> list[Gain]:
    """Improvements of all responses with a goal, with the joint errors of both runs as independent."""
    goals = goals_of(study)
    chosen = goals.objectives
    error = np.hypot(*(np.nan_to_num(each.error[chosen]) for each in (baseline, pick)))
    scale = 100.0 / np.abs(baseline.values[chosen])
    percent = (goals.costs(baseline.values) - goals.costs(pick.values)) * scale
    return [
        Gain(study.responses[index], float(p), float(e), study.file.response[index].goal)
        for index, p, e in zip(chosen, percent, error * scale, strict=True)
    ]


def statement(gains: Sequence[Gain]) -> str:
    """Whether the gains are real, in words.

    A gain counts as real where it is more than its error with all responses judged at once: the intervals are widened
    so that together they hold with 95 % (Bonferroni).
    """
    wider = float(special.ndtri(1.0 - 0.025 / len(gains)) / special.ndtri(0.975))
    by_words = {
        "real, more than its error": [gain for gain in gains if gain.percent > wider * gain.error],
        "a real loss, more than its error": [gain for gain in gains if -gain.percent > wider * gain.error],
        "inside its own noise: no gain is shown": [gain for gain in gains if abs(gain.percent) <= wider * gain.error],
    }
    parts = [
        f"{', '.join(f'{each.response} {improvement(each.percent, wider * each.error, each.goal)}' for each in group)}: {words}"
        for words, group in by_words.items()
        if group
    ]
    together = f" (intervals that hold for all {len(gains)} together)" if len(gains) > 1 else ""
    return f"Simulated changes from the baseline{together}: {'; '.join(parts)}."
