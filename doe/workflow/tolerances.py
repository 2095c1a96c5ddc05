"""The widest tolerances about a pick: the gains that parts keep, the grades of the parts, and what letting a gain go would give.

A gain counts if [tolerances] names it in ``gains`` or ``at_least``. Without both, a predicted gain counts from three times the
smallest difference that matters; if none is so large, all real gains count. A gain that does not count is free: the
record says where its response lies among the parts.

Tolerances that need parts of a finer grade than the shop's are a warning. It names the gain that demands them, and the widest
tolerances without that gain.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from doe.pareto.manufacture import ToleranceBox, random_offsets
from doe.pareto.search import Goals
from doe.pareto.tolerance import RIM, Neighbourhood, Parts, WidestTolerances
from doe.study_file.sections import Tolerances
from doe.workflow.confirmation import Confirmed, gains
from doe.workflow.front import Draws, draws_of, keeping, open_errors, part_ends
from doe.workflow.parts import Grade, PartWidth, grades_of
from doe.workflow.problem import Problem
from doe.workflow.surfaces import predict_all
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.records import Record, derived, nullable, outside_json
from rbdyn.base.words import improvement, label, quantity, rounded_down, shown
from rbdyn.scene import Scene

ENOUGH = 3.0  # times the smallest difference that matters, from which a gain counts by default
GAIN = "the gain of "
MIDDLE = (0.025, 0.975)  # quantiles of a response among the parts


class KeptGain(Record):
    """A predicted gain of a response with a goal, the least of it that a part keeps, and the range of a gain that does not count.

    All are in percent of the baseline; the least is None for a gain that does not count, the range for one that does.
    """

    predicted_percent: float
    at_least_percent: float | None
    counts: bool = derived(lambda self: self.at_least_percent is not None)
    parts_percent: tuple[float, ...] | None = nullable(default=None)
    response: str = outside_json(default="")
    goal: str = outside_json(default="")

    @property
    def words(self) -> str:
        """'impact force'."""
        return quantity(self.response)[0]


def _counted(settings: Tolerances, percent: Mapping[str, float], real: Collection[str] | None) -> Collection[str]:
    """Names of the responses whose gains count."""
    if settings.gains is not None or settings.at_least:
        return {*(settings.gains or []), *settings.at_least}
    positive = [name for name, gain in percent.items() if gain > 0.0]
    large = [name for name in positive if percent[name] >= ENOUGH * settings.smallest_difference_percent]
    return large or [name for name in positive if real is None or name in real]


class WithoutGain(Record):
    """The tolerance of a factor without the ``gain`` that limits it."""

    gain: str
    half_width: float
    grade: str | None
    limited_by: str


class FactorTolerance(Record):
    """The widest tolerance of a factor, as a half width, with the share of parts that satisfy the requirements of the study.

    ``interval``: of that share with the errors of the surfaces. ``grade``, ``parts``: of ISO 286; None and empty where none is
    listed. ``without_limiting_gain`` is None where no grade is too fine or no gain limits.
    """

    half_width: float
    probability: float
    standard_error: float
    interval: tuple[float, ...]
    limited_by: str
    grade: str | None
    parts: dict[str, PartWidth]
    without_limiting_gain: WithoutGain | None

    @property
    def parts_words(self) -> str:
        """'IT6: guide land 16 µm, cage outside 16 µm'."""
        parts = [f"{label(name)} {shown(1e3 * part.width_mm)} µm" for name, part in self.parts.items()]
        return ": ".join(filter(None, (self.grade or "", ", ".join(parts))))


class PickTolerances(Record, eq=False):
    """The widest tolerances of a pick, with the ``demands`` on its gains and the ``grades`` of the parts by factor.

    ``relaxed``: the tolerances without the limiting gain, None where no grade is too fine or no gain limits.
    """

    settings: Tolerances
    factors: tuple[str, ...]
    widest: WidestTolerances
    demands: Sequence[KeptGain]
    grades: Mapping[str, Grade]
    relaxed: "PickTolerances | None" = None

    @property
    def half_widths(self) -> Array:
        """Half widths (k,) in factor units, NaN for factors without one."""
        return self.widest.half_widths

    @property
    def any_width(self) -> bool:
        """Whether parts may differ at all."""
        return bool((self.half_widths > 0.0).any())

    def allows(self, box: ToleranceBox | None, half_widths: Mapping[str, float]) -> bool:
        """Whether as many parts as the ``box`` requires keep all limits within the factors' own ``half_widths``."""
        widest = dict(zip(self.factors, self.half_widths.tolist(), strict=True))
        narrower = any(widest[name] < width * (1.0 - 1e-9) for name, width in half_widths.items())
        enough = box is not None and box.kind == "quantile" and self.widest.probability >= box.quantile
        return enough and not narrower

    @property
    def limiting_gain(self) -> str:
        """Response whose gain limits the tolerances; empty where a limit or the rim of the region does."""
        name = self.widest.limited_by
        return name.removeprefix(GAIN) if name.startswith(GAIN) else ""

    @property
    def too_fine(self) -> list[str]:
        """Factors whose parts need a finer grade than the shop's."""
        return [name for name, grade in self.grades.items() if grade.finer_than(self.settings.finest_grade)]

    @property
    def by_factor(self) -> dict[str, FactorTolerance]:
        """The tolerance of each factor that has one."""
        widest, relaxed, tolerances = self.widest, None if self.relaxed is None else self.relaxed.by_factor, {}
        for name, width, rim in zip(self.factors, widest.half_widths.tolist(), widest.at_rim, strict=True):
            if np.isnan(width):
                continue
            grade, without = self.grades.get(name), None
            if relaxed is not None:
                other = relaxed[name]
                without = WithoutGain(self.limiting_gain, other.half_width, other.grade, other.limited_by)
            tolerances[name] = FactorTolerance.from_attributes(
                widest,
                half_width=width,
                limited_by=RIM if rim else widest.limited_by,
                grade=None if grade is None else grade.name,
                parts={} if grade is None else grade.parts,
                without_limiting_gain=without,
            )
        return tolerances

    @property
    def by_gain(self) -> dict[str, KeptGain]:
        """The demands by response."""
        return {demand.response: demand for demand in self.demands}

    @property
    def sentence(self) -> str:
        """The tolerances, what limits them, and which gains count, in words."""
        if not self.any_width:
            return self.widest.sentence
        counted = [
            f"{demand.words} {shown(demand.at_least_percent, 2)} of {shown(demand.predicted_percent, 2)} %"
            for demand in self.demands
            if demand.counts
        ]
        kept = f"Gains that parts keep at least: {', '.join(counted)}." if counted else ""
        return " ".join(filter(None, [self.widest.sentence, kept, *self._rule_sentences(bool(counted))]))

    def _rule_sentences(self, counted: bool) -> list[str]:
        """The gains that do not count with the reason, and where their responses lie among the parts."""
        settings = self.settings
        free = [demand for demand in self.demands if not demand.counts]
        gains = ", ".join(
            f"{demand.words} {improvement(demand.predicted_percent, None, demand.goal)}" for demand in free
        )
        smallest = f"{ENOUGH:g} times the smallest difference that matters, {settings.smallest_difference_percent:g} %"
        if settings.gains is not None or settings.at_least:
            sentences = [f"[tolerances] does not name {gains}."] if free else []
        elif any(demand.predicted_percent >= ENOUGH * settings.smallest_difference_percent for demand in self.demands):
            verb = "does" if len(free) == 1 else "do"
            sentences = [f"A gain counts from {smallest}; {gains} {verb} not."] if free else []
        else:
            sentences = [f"No gain reaches {smallest}, so all real gains count."] if counted else []
            sentences += [f"Not real: {gains}."] if free else []
        if spread := ", ".join(_spread(demand) for demand in free if demand.parts_percent):
            sentences.append(f"In 95 % of these parts, compared with the baseline: {spread}.")
        return sentences

    @property
    def warning(self) -> str:
        """Parts of too fine a grade, what demands them, and what letting that go would give; empty if there are none."""
        at_rim = dict(zip(self.factors, self.widest.at_rim.tolist(), strict=True))
        rim, fine = ([name for name in self.too_fine if at_rim[name] is side] for side in (True, False))
        grade, limit, sentences = f"IT{self.settings.finest_grade}", self.widest.limited_by, list[str]()
        cause = f"{'Keeping' if limit.startswith(GAIN) else 'Meeting'} {_limit_words(limit)}"
        if fine and not self.any_width:
            sentences.append(f"{cause} leaves no tolerance.")
        elif fine:
            sentences.append(f"{cause} requires parts finer than {grade}: {self._listed(fine)}.")
        if fine and self.relaxed is not None:
            wider, limit = self.relaxed._listed(fine), _limit_words(self.relaxed.widest.limited_by)
            sentences.append(f"Without this requirement the tolerance could be {wider}, limited by {limit}.")
            sentences.append(_freed(self.relaxed.by_gain[self.limiting_gain]))
        elif fine:
            sentences.append("A design farther from this limit would allow wider tolerances.")
        if rim:
            sentences.append(
                f"The design region limits the tolerance to parts finer than {grade}: {self._listed(rim)}."
            )
            sentences.append("Try a wider region.")
        return " ".join(sentences)

    def _listed(self, names: Sequence[str]) -> str:
        """'guide clearance ± 0.018 mm (IT8)' of factors."""
        widths = dict(zip(self.factors, self.half_widths.tolist(), strict=True))
        return ", ".join(
            f"{quantity(name)[0]} within ± {rounded_down(widths[name])} mm ({self.grades[name].name})" for name in names
        )


def _spread(demand: KeptGain) -> str:
    """'power loss 0.90 % more to 1.20 % less' of a gain that does not count."""
    return f"{demand.words} {' to '.join(improvement(end, None, demand.goal) for end in demand.parts_percent or ())}"


def _freed(demand: KeptGain) -> str:
    """'Then 95 % of the parts improve power loss by 0.90 to 1.20 %.' of a gain that does not count."""
    low, high = demand.parts_percent or ()
    if low < 0.0:
        return f"Then 95 % of the parts have {_spread(demand)}."
    return f"Then 95 % of the parts improve {demand.words} by {low:.2f} to {high:.2f} %."


def _limit_words(limit: str) -> str:
    """What limits the tolerances, with a response by its words."""
    if limit.startswith(GAIN):
        return GAIN + quantity(limit.removeprefix(GAIN))[0]
    name, _, bound = limit.partition(" ")
    return limit if limit == RIM else f"the limit {' '.join((quantity(name)[0], bound, quantity(name)[1]))}".rstrip()


def _none(widest: WidestTolerances) -> WidestTolerances:
    """No tolerances, for a pick without a gain or a limit to keep."""
    sentence = "No tolerances follow, because the selected design has no gain to keep and no response has a limit."
    return replace(widest, half_widths=np.full_like(widest.half_widths, np.nan), limited_by="", sentence=sentence)


def _impossible(demands: Sequence[KeptGain]) -> str:
    """The first gain that the pick itself does not have, in a sentence; empty if it has them all."""
    for demand in demands:
        least, percent = demand.at_least_percent, demand.predicted_percent
        if least is not None and percent <= 0.0:
            return f"No tolerance is possible: the selected design has no gain in {demand.words} to keep; leave it out of [tolerances]."
        if least is not None and least > percent:
            return (
                f"No tolerance is possible: at_least.{demand.response} = {least:g} exceeds the gain of "
                f"{shown(percent, 3)} %; state less."
            )
    return ""


class PickParts(Record, eq=False):
    """Parts about a pick, a ``point`` (k,) in factor units: their responses, the gains there, and the widest tolerances.

    A part keeps its promise if all limits hold and each gain that counts has its least size. ``confirmed``: simulated
    points, "baseline" and "pick" among them; they narrow the errors of the surfaces and say which gains are real. ``scene``: the bearing at the
    point, whose parts have grades; without it none are stated.

    The levels at the pick and at the baseline are those simulated, if ``confirmed``. Parts may lie beyond the region by the
    factors' own tolerances. With ``neighbours``, about a pick of a search, ``search_draws`` draws the errors of the search.
    """

    study: Problem
    point: Array
    settings: Tolerances
    confirmed: Mapping[str, Confirmed] = field(default_factory=dict)
    neighbours: Neighbourhood | None = None
    search_draws: Draws | None = None
    scene: Scene | None = None
    limits: str = "all limits"

    def widest(self) -> PickTolerances | None:
        """The widest tolerances; None where no factor has a tolerance."""
        if self.study.rigid.all():
            return None
        demands = self.demands
        tolerances = self._tolerances(demands, self.search_draws or draws_of(self.study, self.confirmed))
        if not any(demand.counts for demand in demands) and not self.goals.limited:
            return replace(tolerances, widest=_none(tolerances.widest), demands=demands, grades={})
        gain = tolerances.limiting_gain
        if not gain or not tolerances.too_fine:
            return tolerances
        without = [replace(demand, at_least_percent=None) if demand.response == gain else demand for demand in demands]
        return replace(tolerances, relaxed=self._tolerances(without, None))

    @property
    def demands(self) -> list[KeptGain]:
        """Demands on the responses with a goal. Without a simulated pick every gain above zero is real."""
        settings, responses = self.settings, [self.study.file.response[index] for index in self.goals.objectives]
        percent = dict(zip((response.name for response in responses), self.percent.tolist(), strict=True))
        real = None
        if "pick" in self.confirmed:
            simulated = gains(self.study, self.confirmed["baseline"], self.confirmed["pick"])
            real = {name for name, gain in simulated.items() if gain.percent > gain.error_percent}
        counted = _counted(settings, percent, real)
        least = {
            name: settings.at_least.get(name, settings.keep * gain) for name, gain in percent.items() if name in counted
        }
        return [
            KeptGain(percent[response.name], least.get(response.name), response=response.name, goal=response.goal)
            for response in responses
        ]

    @cached_property
    def goals(self) -> Goals:
        """The goals of the study."""
        return self.study.goals

    @cached_property
    def free_factors(self) -> Rows:
        """Places of the factors that have a tolerance."""
        return np.flatnonzero(~self.study.rigid)

    @cached_property
    def ends(self) -> list[Array]:
        """Responses (1, m) at the baseline and at the pick: simulated if they are confirmed, else predicted."""
        if self.confirmed:
            return [self.confirmed[name].values[None] for name in ("baseline", "pick")]
        places = (self.study.baseline, self.point)
        return [predict_all(self.study.surfaces, self.study.coded(place)[None]) for place in places]

    @cached_property
    def reference(self) -> Array:
        """Costs (1, q) of the baseline."""
        return self.goals.costs(self.ends[0])

    @cached_property
    def gain(self) -> Array:
        """Predicted gains (q,) in costs."""
        return np.asarray((self.reference - self.goals.costs(self.ends[1]))[0])

    @cached_property
    def unit(self) -> Array:
        """Costs (q,) that are one percent of the baseline."""
        return np.abs(self.ends[0][0, self.goals.objectives]) / 100.0

    @property
    def percent(self) -> Array:
        """Predicted gains (q,) in percent of the baseline; of a baseline of zero, infinite."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(self.gain == 0.0, 0.0, self.gain / self.unit)

    @cached_property
    def _centre_values(self) -> Array:
        return predict_all(self.study.surfaces, self.study.coded(self.point)[None])

    def _costs(self, parts: Array) -> Array:
        """Costs and violations (samples, q + c) of parts (samples, f), values of the factors that have a tolerance."""
        points = np.tile(self.point, (len(parts), 1))
        points[:, self.free_factors] = parts
        coded = self.study.coded(points)
        values = predict_all(self.study.surfaces, coded) - self._centre_values + self.ends[1]
        if (here := self.neighbours) is not None:
            values = values + (coded - here.points) @ here.slopes[0]
        return np.hstack([self.goals.costs(values), self.goals.violations(values, values)])

    def _tolerances(self, demands: Sequence[KeptGain], draws: Draws | None) -> PickTolerances:
        """The widest tolerances that keep the demands; with ``draws``, the interval has the errors of the surfaces."""
        widest = self._widest(demands, draws)
        grades = {} if self.scene is None else grades_of(self.study, self.scene, self.point, widest.half_widths)
        demands = self._with_ranges(demands, widest)
        return PickTolerances(self.settings, tuple(self.study.factors), widest, demands, grades)

    def _widest(self, demands: Sequence[KeptGain], draws: Draws | None) -> WidestTolerances:
        study, settings, free = self.study, self.settings, self.free_factors
        percent = [-np.inf if demand.at_least_percent is None else demand.at_least_percent for demand in demands]
        least = np.array(percent) * np.maximum(self.unit, 1e-300)
        share = np.array([demand.counts and demand.response not in settings.at_least for demand in demands])
        least[share] = settings.keep * self.gain[share]
        slack = 1e-9 * np.abs(self.gain).max()
        no_violations = np.zeros((1, len(self.goals.limited)))
        half_widths = study.known_tolerances
        ratios = np.array([half_widths.get(name, np.nan) for name in study.factors])
        extent, (low, high), possible = np.nan_to_num(ratios), study.ends.T, part_ends(study).T
        low = np.minimum(low, np.maximum(self.point - extent, possible[0]))
        high = np.maximum(high, np.minimum(self.point + extent, possible[1]))
        count = None if draws is None else keeping(study, draws, self.point, free, least - slack)
        parts = Parts(
            objectives=self._costs,
            centre=self.point[free],
            limits=(np.hstack([self.reference - least, no_violations]) + slack)[0],
            lower=low[free],
            upper=high[free],
            names=self._names,
            promise=self._promise(demands),
            count_on_draws=count,
            open_errors=open_errors(self.study.surfaces, searched=self.neighbours is not None),
            **settings.model_dump(include={"probability", "distribution", "samples", "seed"}),
        )
        tolerances = parts.widest((study.step if np.isnan(ratios[free]).any() else ratios)[free])
        return replace(tolerances, sentence=_impossible(demands) or tolerances.sentence).among(free, self.point.size)

    def _promise(self, demands: Sequence[KeptGain]) -> str:
        """What parts keep, in words."""
        counted = any(demand.counts for demand in demands)
        return " and ".join(
            [*["keep the gains that count"] * counted, *[f"meet {self.limits}"] * bool(self.goals.limited)]
        )

    @property
    def _names(self) -> list[str]:
        """Names of the gains and limits."""
        responses = self.study.responses
        return [
            *(f"{GAIN}{name}" for name in self.study.aims),
            *(f"{responses[index]} {sense} {limit:g}" for index, sense, limit in self.goals.limited),
        ]

    def _with_ranges(self, demands: Sequence[KeptGain], widest: WidestTolerances) -> list[KeptGain]:
        """The demands with the ends [%] of the gains of 95 % of the parts, where these do not count."""
        half = np.nan_to_num(widest.half_widths[self.free_factors])
        settings = self.settings
        offsets = random_offsets(settings.samples, half.size, settings.distribution, settings.seed)
        costs = self._costs(self.point[self.free_factors] + half * offsets)
        ends = np.quantile(self.reference - costs[:, : len(demands)], MIDDLE, axis=0) / np.maximum(self.unit, 1e-300)
        return [
            demand if demand.counts else replace(demand, parts_percent=tuple(range_of_parts))
            for demand, range_of_parts in zip(demands, ends.T.tolist(), strict=True)
        ]
