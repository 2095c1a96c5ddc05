"""Confirmation of points by simulation: gains over the baseline with their errors, and the verdict on each limit.

Intervals are Student's at the degrees of freedom of the errors. A limit is kept, broken or undecided.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from doe.clearance import Simulations
from doe.duty import OPERATION, DutyResult, Run, Simulated, cages_of, results_at
from doe.running.store import Failure
from doe.unknown.propagation import Share
from doe.workflow.problem import Problem
from doe.workflow.runs import EstimatedValue
from doe.workflow.surfaces import gain_verdict
from rbdyn.base.arrays import Array, one_thread
from rbdyn.base.estimate import Estimate, chance_above, one_sided, standard_errors, times_wider
from rbdyn.base.faults import InputError, RunError
from rbdyn.base.notes import DANGER, Note, Notes, condensed, of_level
from rbdyn.base.records import Record, derived, finite, keyed, outside_json, spread
from rbdyn.base.words import chance, decimals, improvement, quantity, with_error
from rbdyn.result import TEMPERATURES, FrictionCheck, Quantity, SimulatedValue, arrays_of
from rbdyn.scene import Scene
from rbdyn.scene.thermal import simulated_scene
from rbdyn.verdict.orbits import CageVerdict

WHIRL = "whirl_deviation_ratio"
# Beginning of the names of points that were simulated as the pick.
TRY = "try_"
# Verdicts on gains: the first is good news, the others are not.
REAL, LOSS, NOISE = ("real, more than its error", "a real loss, more than its error", "not significant")

Verdict = Literal["kept", "undecided", "broken"]
# From the best to the worst.
ORDER: tuple[Verdict, ...] = ("kept", "undecided", "broken")


def point_words(name: str) -> str:
    """The name of a confirmed point as people read it."""
    return {
        "pick": "selected design",
        "without_tolerances": "design selected without tolerances",
        "pick_of_surfaces": "design selected on the surfaces",
    }.get(name, name.replace("_", " "))


class Choice(Record):
    """A point (k,) in factor units, at the resolution of the drawing, and the reason for its choice."""

    point: Array
    reason: str


class Confirmed(Record):
    """Simulated responses (m,) at a point, with 95 % statistical and numerical half-widths.

    Intervals use `error`: the root sum square of both half-widths, as of independent errors. ``freedom`` (m,): degrees
    of freedom of the statistical half-widths, infinite unless stated, as those of the numerical ones are.

    ``reason``: why the point was chosen. ``result``: that of its simulation, None for figures at a point of a duty alone.
    """

    point: Array
    values: Array
    statistical: Array
    numerical: Array
    reason: str = ""
    freedom: Array | None = None
    result: Simulated | None = None

    @property
    def at_points(self) -> Mapping[str, Mapping[str, Quantity]]:
        """Figures of the simulation by point of the duty; empty without a duty."""
        return self.result.at_points if isinstance(self.result, DutyResult) else {}

    @property
    def hot(self) -> dict[str, Scene]:
        """Scenes at the temperatures of their runs by point of the duty, or under OPERATION; empty without a heat balance."""
        results = {} if self.result is None else results_at(self.result)
        return {name: simulated_scene(run) for name, run in results.items() if run.thermal is not None}

    def scenes(self, study: Problem) -> dict[str, Scene]:
        """Scenes of its runs by point of the duty, or under OPERATION; with a heat balance at the temperatures of these runs."""
        run = study.confirmation_run(self.point)
        return ({OPERATION: run} if isinstance(run, Scene) else dict(run.scenes)) | self.hot

    @property
    def cages(self) -> dict[str, CageVerdict]:
        """Verdict on the cage by point of the duty, or under "operation"; empty where its scene leaves it out."""
        return {} if self.result is None else cages_of(self.result)

    @property
    def dangers(self) -> Notes:
        """Dangers of its runs."""
        return () if self.result is None else tuple(of_level(condensed(self.result.notes), DANGER))

    @property
    def error(self) -> Array:
        """Joint 95 % half-widths (m,); NaN where neither part is known."""
        mask = np.isfinite(self.statistical) | np.isfinite(self.numerical)
        joint: Array = np.hypot(np.nan_to_num(self.statistical), np.nan_to_num(self.numerical))
        return np.where(mask, joint, np.nan)

    @property
    def estimate(self) -> Estimate:
        """The responses with their standard errors, 0 where unknown."""
        freedom = np.full_like(self.values, np.inf) if self.freedom is None else self.freedom
        numerical = standard_errors(self.numerical, np.inf)
        return Estimate(self.values, standard_errors(self.statistical, freedom), freedom, numerical)

    @property
    def standard_error(self) -> Array:
        """Joint standard errors (m,), 0 where unknown."""
        return np.asarray(np.hypot(self.estimate.error, self.estimate.numerical))

    @property
    def joint_freedom(self) -> Array:
        """Degrees of freedom (m,) of the joint errors."""
        return self.estimate.joint.freedom


class Gain(Record):
    """Relative improvement [%] of a response at a point over the baseline, with its 95 % half-width.

    ``verdict``: whether the change exceeds its error; ``goal``: "min", "max" or a target; ``freedom``: degrees of freedom
    of the error.
    """

    percent: float
    error_percent: float
    goal: str = "min"
    verdict: str = derived(lambda self: gain_verdict(self.percent, self.error_percent))
    freedom: float = outside_json(default=np.inf)

    def error_among(self, count: int) -> float:
        """Half-width that holds together with those of ``count`` gains."""
        return self.error_percent * float(times_wider(self.freedom, count))


class LostPickError(RunError):
    """The pick could not be simulated."""


def simulate_original(study: Problem, simulations: Simulations) -> Confirmed:
    """The original design, simulated with fresh seeds. Raises RunError where it fails, InputError, KeyboardInterrupt."""
    run = study.confirmation_run(study.baseline)
    (result,) = simulations.run([run], ["baseline"], simulations.progress("baseline"))
    if isinstance(result, Failure):
        raise RunError(f"the baseline design cannot be simulated: {result}")
    return confirmed_from(study, Choice(study.baseline, "the baseline design"), result)


def run_where_possible(study: Problem, point: Array) -> Run | None:
    """The confirmation run of a point (k,) in factor units; None where no bearing has these values."""
    try:
        return study.confirmation_run(point)
    except InputError:
        return None


@one_thread
def confirm(
    study: Problem, baseline: Confirmed, choices: Mapping[str, Choice], simulations: Simulations
) -> tuple[dict[str, Confirmed], list[Failure]]:
    """Simulate the choices with fresh seeds. Returns the simulated points, the ``baseline`` first, and the failures.

    All but the pick and its tries are simulated in brief; their numerical errors are those of the baseline in proportion. Raises
    LostPickError where the pick cannot be simulated, InputError, KeyboardInterrupt.
    """
    brief = [name for name in choices if name != "pick" and not name.startswith(TRY)]
    runs = [study.confirmation_run(choice.point, in_brief=name in brief) for name, choice in choices.items()]
    results = simulations.run(runs, list(choices), simulations.progress("confirmation"))
    confirmed, failures = {"baseline": baseline}, []
    for (name, choice), result in zip(choices.items(), results, strict=True):
        if not isinstance(result, Failure):
            found = confirmed_from(study, choice, result)
            confirmed[name] = replace(found, numerical=_in_proportion(baseline, found)) if name in brief else found
        elif name == "pick":
            raise LostPickError(f"confirmation of the {point_words(name)}{str(result).removeprefix(name)}")
        else:
            failures.append(result)
    return confirmed, failures


def _in_proportion(known: Confirmed, found: Confirmed) -> Array:
    """Numerical half-widths (m,) at a point by those at another one, whose share of the values they have."""
    shares = np.divide(found.values, known.values, out=np.ones_like(found.values), where=known.values != 0.0)
    return known.numerical * np.abs(shares)


def confirmed_from(study: Problem, choice: Choice, result: Simulated) -> Confirmed:
    """The study's responses of a simulation at a chosen point."""
    responses = result.responses
    values, statistical, numerical, freedom = arrays_of([responses.get(name) for name in study.responses])
    return Confirmed(choice.point, values, statistical, numerical, choice.reason, freedom, result)


def gains(study: Problem, baseline: Confirmed, pick: Confirmed) -> dict[str, Gain]:
    """Improvements by response of those with a goal; the errors of both runs are independent."""
    goals = study.goals
    objectives = goals.objectives
    change = baseline.estimate - pick.estimate
    error, freedom = change.half_width, change.freedom
    scale = 100.0 / np.abs(baseline.values[objectives])
    percent = (goals.costs(baseline.values) - goals.costs(pick.values)) * scale
    columns = zip(objectives, percent, error[objectives] * scale, freedom[objectives], strict=True)
    return {
        study.responses[index]: Gain(float(p), float(e), study.file.response[index].goal, float(dof))
        for index, p, e, dof in columns
    }


def worse_notes(gains: Mapping[str, Gain]) -> Notes:
    """A note on a pick that is worse than the baseline, by its simulated ``gains`` by response."""
    worse = [
        f"{quantity(name)[0]} {improvement(gain.percent, gain.error_percent, gain.goal)}"
        for name, gain in gains.items()
        if gain.verdict == "worse"
    ]
    return (Note("worse", f"the selected design is worse than the baseline: {', '.join(worse)}"),) if worse else ()


def whirl_sentence(study: Problem, confirmed: Mapping[str, Confirmed]) -> str:
    """A warning that the whirl deviation ratio, which has a goal, is that of a trembling cage; else empty."""
    radii = []
    for name in ("baseline", "pick"):
        result = confirmed[name].result
        if result is not None and result.jitters and result.cage_orbit_radius_share is not None:
            points = ", ".join(result.jitter_points) if isinstance(result, DutyResult) else ""
            where = f"{point_words(name)}{f' ({points})' if points else ''}"
            radii.append(f"{where} {result.cage_orbit_radius_share.value:.2g}")
    if WHIRL not in study.aims or not radii:
        return ""
    return f"Do not choose by the {WHIRL}: the cage does not whirl (orbit over clearance: {', '.join(radii)})."


def statement(gains: Mapping[str, Gain]) -> str:
    """Whether the gains by response are real, in words.

    A gain is real if it exceeds its error; the intervals of all gains hold together with 95 % (Bonferroni).
    """
    count = len(gains)
    by_words = {
        REAL: [name for name, gain in gains.items() if gain.percent > gain.error_among(count)],
        LOSS: [name for name, gain in gains.items() if -gain.percent > gain.error_among(count)],
        NOISE: [name for name, gain in gains.items() if abs(gain.percent) <= gain.error_among(count)],
    }
    parts = [f"{', '.join(names)}: {words}" for words, names in by_words.items() if names]
    intervals = f" (verdicts that hold for all {count} together)" if count > 1 else ""
    return f"Simulated changes from the baseline{intervals}: {'; '.join(parts)}."


class Limit(Record, kw_only=True):
    """A limit of a ``response`` (left out where a table is by response), its simulated ``value`` and the verdict.

    ``error``: joint 95 % half-width of the value, None if unknown; ``probability`` of keeping the bound, by that error.
    ``margin``: one-sided error at the probability that the study asks for.
    """

    response: str = keyed("response", default=None)
    bound: float
    sense: str
    value: float
    verdict: Verdict
    error: float | None
    probability: float | None
    margin: float = outside_json(default=0.0)

    @classmethod
    def judged(
        cls,
        response: str,
        sense: str,
        bound: float,
        value: float,
        error: float,
        one_sided: float,
        freedom: float = math.inf,
    ) -> "Limit":
        """A limit judged at a value with a half-width ``error`` of ``freedom`` degrees of freedom, NaN if unknown.

        Kept by more than the one-sided error, which is ``one_sided`` times the error, broken by more than the error, else
        undecided.
        """
        room, margin = bound - value if sense == "<=" else value - bound, one_sided * error
        verdict: Verdict = "kept" if room > margin else "broken" if -room > error else "undecided"
        if error > 0.0:
            probability = float(chance_above(room, error, freedom))
        else:
            probability = math.nan if math.isnan(error) else float(room >= 0.0)
        return cls(
            response=response,
            bound=bound,
            sense=sense,
            value=value,
            verdict=verdict,
            error=finite(error),
            probability=finite(probability),
            margin=float(np.nan_to_num(margin)),
        )

    @property
    def room(self) -> float:
        """How far the value is on the good side of the bound; negative beyond it."""
        return self.bound - self.value if self.sense == "<=" else self.value - self.bound

    @property
    def nameless(self) -> "Limit":
        """The limit without its response."""
        return replace(self, response=None)  # type: ignore[arg-type]

    @property
    def badness(self) -> tuple[int, float]:
        """The larger, the worse."""
        return ORDER.index(self.verdict), -self.room

    @property
    def bound_words(self) -> str:
        """'impact force <= 40 N'."""
        words, unit = quantity(self.response)
        return f"{words} {self.sense} {self.bound:g} {unit}".rstrip()

    @property
    def excess_words(self) -> str:
        """'3.2 ± 1.1 N' of a value beyond its bound."""
        return f"{with_error(-self.room, self.error)} {quantity(self.response)[1]}".rstrip()

    @property
    def keepable(self) -> float:
        """The nearest bound, to a digit below the error, that the value keeps with the demanded probability; NaN without a value."""
        if math.isnan(self.value):
            return math.nan
        sign = 1.0 if self.sense == "<=" else -1.0
        edge = self.value + sign * max(self.margin, 0.0)
        unit = 10.0 ** -decimals(self.margin if self.margin > 0.0 else 1e-2 * abs(edge) or 1.0)
        return float(f"{unit * (math.floor(sign * edge / unit) + 1.0) * sign:.12g}")

    @property
    def text(self) -> str:
        """The limit with its value in words."""
        probability = "error unknown" if self.probability is None else f"probability {chance(self.probability)}"
        return f"{self.response} {self.sense} {self.bound:g} (simulated {with_error(self.value, self.error)}, {probability})"


def every_limit(study: Problem, confirmed: Confirmed) -> list[Limit]:
    """All limits of the study at a simulated point; the lower and the upper limit of a response are two."""
    freedom = confirmed.joint_freedom
    sides = one_sided(freedom, study.file.confirmation.limit_probability).tolist()
    columns = (confirmed.values.tolist(), confirmed.error.tolist(), sides, freedom.tolist())
    figures = list(zip(*columns, strict=True))
    return [
        Limit.judged(study.responses[index], sense, bound, *figures[index])
        for index, sense, bound in study.goals.limited
    ]


def class_limits(study: Problem, confirmed: Confirmed) -> list[Limit]:
    """The limit on the class of the cage at a simulated point, of a duty at the worst of its points; none where the study has none.

    The value is the share of bearings alike with one of the classes, which is the probability of keeping the limit.
    """
    classes, verdicts = study.file.limits.classes, confirmed.cages.values()
    if not classes or not verdicts:
        return []
    limits = []
    for found in verdicts:
        kept, share = found.is_one_of(classes), round(found.share_of(classes), 3)
        limits.append(
            Limit(
                response=study.file.limits.share_of_classes,
                bound=found.least_share,
                sense=">=",
                value=share,
                verdict="undecided" if kept is None else "kept" if kept else "broken",
                error=None,
                probability=share,
            )
        )
    return [max(limits, key=lambda limit: limit.badness)]


def limits_of(study: Problem, confirmed: Confirmed) -> list[Limit]:
    """The limits of the study at a simulated point, one per response."""
    worst = worst_limits([*every_limit(study, confirmed), *class_limits(study, confirmed)])
    return sorted(worst.values(), key=lambda limit: [*study.responses, limit.response].index(limit.response))


def worst_limits(limits: Sequence[Limit]) -> dict[str, Limit]:
    """By response the limit with the worse verdict, or with less room."""
    worst: dict[str, Limit] = {}
    for limit in limits:
        if limit.response not in worst or limit.badness > worst[limit.response].badness:
            worst[limit.response] = limit
    return worst


def verdict_of(limits: Sequence[Limit]) -> Verdict:
    """The worst verdict; kept without limits."""
    return max((limit.verdict for limit in limits), key=ORDER.index, default="kept")


class Balance(Record):
    """Heat balance of a point: 5, 50 and 95 % of its temperatures and clearances over its inputs; None without ranges."""

    ranges: dict[str, tuple[float, ...]] | None


class ConfirmedPoint(Record, kw_only=True):
    """A simulated point as reports show it, with the limits there and, except for the baseline, the gains over that.

    ``every_limit``: the lower and the upper limit of a response apart; ``limits``: by response the worse of them. ``cage``: class of the
    cage by point of the duty, or under "operation".
    """

    factors: dict[str, float]
    reason: str
    responses: dict[str, SimulatedValue]
    power_terms_W: dict[str, float]  # noqa: N815
    limits: dict[str, Limit]
    every_limit: list[Limit]
    cage: dict[str, CageVerdict]
    friction_check: FrictionCheck | None = None
    temperatures_C: dict[str, EstimatedValue] | None = None  # noqa: N815
    thermal: Balance | None = None
    gains: dict[str, Gain] | None = None
    statement: str | None = None

    @classmethod
    def of(cls, study: Problem, point: Confirmed, gains: dict[str, Gain] | None) -> "ConfirmedPoint":
        """A simulated point of a study; ``gains`` over the baseline, None for that itself."""
        columns = (point.values.tolist(), map(finite, point.statistical), map(finite, point.numerical))
        result = point.result
        assert result is not None
        balance = None if isinstance(result, DutyResult) else result.thermal
        return cls(
            factors=study.by_factor(point.point),
            reason=point.reason,
            responses=dict(zip(study.responses, map(SimulatedValue, *columns), strict=True)),
            power_terms_W=dict(result.power_terms_W),
            limits={limit.response: limit.nameless for limit in limits_of(study, point)},
            every_limit=[*every_limit(study, point), *class_limits(study, point)],
            cage=point.cages,
            friction_check=result.friction_check,
            temperatures_C=_temperatures(result),
            thermal=None if balance is None else Balance(balance.ranges.figures),
            gains=gains,
            statement=None if gains is None else statement(gains),
        )


def _temperatures(result: Simulated) -> dict[str, EstimatedValue] | None:
    """Steady temperatures by response; None without a heat balance, and over a duty."""
    if isinstance(result, DutyResult) or result.temperatures_C is None:
        return None
    nodes = {name: result.temperatures_C[node] for name, node in TEMPERATURES.items()}
    return {name: EstimatedValue(figure.value, figure.stated_error) for name, figure in nodes.items()}


class PickLimit(Record):
    """A limit at the pick, and the ``odds`` [p, low, high] that the pick keeps all limits of the response over the unknown inputs.

    The odds are None where they were not asked for.
    """

    limit: Limit = spread()
    odds: Share | None

    @property
    def verdict(self) -> Verdict:
        """The verdict by simulation."""
        return self.limit.verdict
