"""Simulations at chosen points, and whether what they gain over the baseline is more than their error."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy import special

from doe import clearance
from doe.arrays import Array
from doe.clearance import Simulations
from doe.running.store import Failure
from doe.study.goals import goals_of
from doe.study.intervals import LEVEL, joint_freedom, standard_errors, times_wider
from doe.study.predicted import verdict
from doe.study_file import Study
from doe.threads import one_thread
from rbdyn.base.words import improvement
from rbdyn.faults import RunError
from rbdyn.records.record import Record, derived, keyed, outside_json
from rbdyn.result import SimulationResult

WHIRL = "whirl_deviation_ratio"


@dataclass(frozen=True)
class Choice:
    """A point (k,) in factor units, at the resolution of the drawing, and why it was chosen."""

    point: Array
    reason: str


@dataclass(frozen=True)
class Confirmed:
    """Simulated responses (m,) at a point, with 95 % statistical and numerical half-widths.

    Every interval of a simulated response joins the two by `error`: the root sum square of the statistical and the
    numerical half-width, as of independent errors. ``freedom`` (m,): degrees of freedom of the statistical ones, infinitely
    many unless given; the numerical ones have that. ``power_terms``: power losses [W] by contact; ``reason``: why the point
    was chosen; ``orbit_share``: radius of the cage's orbit over its play where that is of a jitter, else None;
    ``friction_check``: the maker's friction, None without a designation.
    """

    point: Array
    values: Array
    statistical: Array
    numerical: Array
    power_terms: Mapping[str, float] = field(default_factory=dict)
    reason: str = ""
    freedom: Array | None = None
    orbit_share: float | None = None
    friction_check: Mapping[str, float | None] | None = None

    @property
    def error(self) -> Array:
        """Joint 95 % half-widths (m,); NaN where neither part is known."""
        known = np.isfinite(self.statistical) | np.isfinite(self.numerical)
        joint: Array = np.hypot(np.nan_to_num(self.statistical), np.nan_to_num(self.numerical))
        return np.where(known, joint, np.nan)

    @property
    def parts(self) -> tuple[list[Array], list[Array]]:
        """Statistical and numerical standard errors (m,), 0 where unknown, and the degrees of freedom of each."""
        many = np.full_like(self.values, np.inf)
        freedom = [many if self.freedom is None else self.freedom, many]
        halves = (self.statistical, self.numerical)
        return [standard_errors(*each) for each in zip(halves, freedom, strict=True)], freedom

    @property
    def standard_error(self) -> Array:
        """Joint standard errors (m,), 0 where unknown."""
        return np.asarray(np.hypot(*self.parts[0]))

    @property
    def joint_freedom(self) -> Array:
        """Degrees of freedom (m,) of the joint errors."""
        return joint_freedom(*self.parts)


class Gain(Record):
    """Relative improvement [%] of a response at a point over the baseline, with its 95 % half-width.

    ``verdict``: whether the change is larger than its error; ``goal``: what is wanted of the response; ``freedom``: degrees
    of freedom of the error.
    """

    response: str = outside_json()
    percent: float
    error: float = keyed("error_percent")
    goal: str = "min"
    verdict: str = derived(lambda self: verdict(self.percent, self.error))
    freedom: float = outside_json(default=np.inf)

    def error_among(self, count: int) -> float:
        """Half-width that holds together with those of so many gains."""
        return self.error * float(times_wider(self.freedom, count))


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
    behind = [quantity.get("degrees_of_freedom") or np.inf for quantity in quantities]
    errors = statistical, numerical
    terms, check, orbit = result.power_terms, result.friction_check, result.cage_orbit_radius_share
    jitter = orbit.value if orbit is not None and result.jitters else None
    return Confirmed(choice.point, values, *errors, terms, choice.reason, np.array(behind), jitter, check)


def gains(study: Study, baseline: Confirmed, pick: Confirmed) -> list[Gain]:
    """Improvements of all responses with a goal, with the joint errors of both runs as independent."""
    goals = goals_of(study)
    chosen = goals.objectives
    error, freedom = error_of_difference(baseline, pick)
    scale = 100.0 / np.abs(baseline.values[chosen])
    percent = (goals.costs(baseline.values) - goals.costs(pick.values)) * scale
    columns = zip(chosen, percent, error[chosen] * scale, freedom[chosen], strict=True)
    return [
        Gain(study.responses[index], float(p), float(e), study.file.response[index].goal, float(behind))
        for index, p, e, behind in columns
    ]


def error_of_difference(one: Confirmed, other: Confirmed) -> tuple[Array, Array]:
    """95 % half-widths (m,) of the differences of two simulated points, and the degrees of freedom behind them (Welch)."""
    errors, behind = zip(one.parts, other.parts, strict=True)
    every, freedom = [*errors[0], *errors[1]], joint_freedom([*errors[0], *errors[1]], [*behind[0], *behind[1]])
    total = np.sqrt(np.sum([each**2 for each in every], axis=0))
    return total * special.stdtrit(freedom, 0.5 + 0.5 * LEVEL), freedom


def whirl_sentence(study: Study, confirmed: Mapping[str, Confirmed]) -> str:
    """Where a study has a goal for the whirl deviation ratio and that is of a jitter, at baseline or pick; else empty."""
    wanted = [study.responses[index] for index in goals_of(study).objectives]
    shares = {name: confirmed[name].orbit_share for name in ("baseline", "pick")}
    known = {name: share for name, share in shares.items() if share is not None}
    if WHIRL not in wanted or not known:
        return ""
    radii = " and ".join(f"{share:.2g} of its play at the {name}" for name, share in known.items())
    return f"{WHIRL} is that of a jitter, not of a whirl: the cage's orbit has a radius of {radii}."


def statement(gains: Sequence[Gain]) -> str:
    """Whether the gains are real, in words.

    A gain counts as real where it is more than its error with all responses judged at once: the intervals are widened
    so that together they hold with 95 % (Bonferroni).
    """
    count = len(gains)
    by_words = {
        "real, more than its error": [gain for gain in gains if gain.percent > gain.error_among(count)],
        "a real loss, more than its error": [gain for gain in gains if -gain.percent > gain.error_among(count)],
        "inside its own noise: no gain is shown": [
            gain for gain in gains if abs(gain.percent) <= gain.error_among(count)
        ],
    }
    parts = [
        f"{', '.join(_improved(each, count) for each in group)}: {words}" for words, group in by_words.items() if group
    ]
    together = f" (intervals that hold for all {len(gains)} together)" if len(gains) > 1 else ""
    return f"Simulated changes from the baseline{together}: {'; '.join(parts)}."


def _improved(gain: Gain, count: int) -> str:
    """A gain in words, with the error that holds together with those of so many."""
    return f"{gain.response} {improvement(gain.percent, gain.error_among(count), gain.goal)}"
