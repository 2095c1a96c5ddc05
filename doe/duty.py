"""A run over a duty: its scene at every point, and one result whose figures are those of all points together.

The result answers for the responses of a study like that of one simulation. Points are taken in the order of their names, and
those with one scene are one, so that neither the order of the tables nor a point stated twice changes a figure.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from doe.running.store import Failure, Point, without_numbers
from doe.study_file import Study
from doe.study_file.sections import Aggregate, at_point
from doe.study_file.study import PointResponse
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import InputError, RunError, key_path
from rbdyn.base.notes import Notes, merged
from rbdyn.base.records import Record, finite
from rbdyn.dynamics.figures import FIGURES
from rbdyn.result import FrictionCheck, Quantity, SimulationResult, arrays_of
from rbdyn.scene import Scene
from rbdyn.scene.duty import AMBIENT, starting
from rbdyn.verdict.orbits import CageVerdict

if TYPE_CHECKING:
    from doe.emulator import NoisyValues
    from rbdyn.base.estimate import Estimate


# Parts of the replicates of minor points, which are in proportion to their share over that of the main one: so the mean is known best.
PARTS = (4, 2)
# Figures whose mean over time is that of their inverse.
HARMONIC = {figure.key for figure in FIGURES if figure.harmonic}


class Rule(NamedTuple):
    """How a response follows from its figures at the points, and its goal, which decides what is worse.

    ``harmonic``: the mean over time is that of the inverse figures, as of lives.
    """

    aggregate: Aggregate
    goal: str
    target: float | None
    harmonic: bool = False

    def badness(self, values: Array) -> Array:
        """Values on a scale on which the largest is the worst."""
        if self.target is not None:
            return np.asarray(np.abs(values - self.target))
        return -values if self.goal == "max" else values

    def value(self, badness: Array, worst: Array) -> Array:
        """Inverse of `badness`; ``worst``: values on whose side of a target the answer lies."""
        if self.target is not None:
            return np.asarray(self.target + np.where(worst < self.target, -badness, badness))
        return -badness if self.goal == "max" else badness

    def over(self, figures: "Estimate", weights: Array) -> "tuple[Estimate, Array]":
        """The response (n,) of figures (n, p) at points with ``weights`` (p,), and the odds (n, p) of each to be the worst.

        Those of worst_relative are ratios already; the odds of a mean are the weights.
        """
        if self.aggregate == "mean":
            mean = figures.inverse.mean(weights).inverse if self.harmonic else figures.mean(weights)
            return mean, np.broadcast_to(weights, figures.value.shape)
        badness = self.badness(figures.value)
        worst, odds = figures._replace(value=badness).largest()
        at_worst = figures.value[np.arange(len(badness)), badness.argmax(axis=1)]
        return worst._replace(value=self.value(worst.value, at_worst)), odds


class Duty(Record):
    """Shares of the time and overrides by point, in the order of the names; rules of the responses by name of their figure.

    ``origins``: from which state points begin, by name, of those that state it. ``limits``: point and figure of each response that is a limit at a point. ``groups``: names of points, those with one scene
    together; empty where nobody has compared the scenes.
    """

    shares: Mapping[str, float]
    overrides: Mapping[str, Sequence[str]]
    rules: Mapping[str, Rule]
    limits: tuple[tuple[str, str], ...] = ()
    groups: tuple[tuple[str, ...], ...] = ()
    origins: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, study: Study) -> "Duty | None":
        """The duty of a study; None without one."""
        rules = {
            response.name: Rule(response.aggregate, response.goal, response.target, response.name in HARMONIC)
            for response in study.file.response
            if not isinstance(response, PointResponse)
        }
        sets = {point.name: point.set for point in study.file.duty}
        limits = [
            (response.point, response.figure) for response in study.file.response if isinstance(response, PointResponse)
        ]
        overrides = {name: sets[name] for name in study.shares}
        origins = {point.name: point.origin for point in study.file.duty if point.origin is not None}
        return cls(study.shares, overrides, rules, tuple(limits), origins=origins) if study.shares else None

    def started(self, scenes: Mapping[str, Scene]) -> dict[str, Scene]:
        """Scenes by point, with the start of their machine where it begins in another state. Raises InputError."""
        found = dict(scenes)
        for name, origin in self.origins.items():
            if origin == AMBIENT:
                found[name] = starting(scenes[name])
                continue
            paths = [key_path(override) for point in (name, origin) for override in self.overrides[point]]
            stated = scenes[origin].model_dump(mode="json", exclude_unset=True)
            point = {".".join(path): _entry(stated, path) for path in paths}
            found[name] = starting(scenes[name], point=point)
        return found

    @property
    def relative(self) -> bool:
        """Whether a response compares with the baseline."""
        return any(rule.aggregate == "worst_relative" for rule in self.rules.values())

    @property
    def keys(self) -> list[str]:
        """Keys of the scene that its points set."""
        return [".".join(key_path(override)) for overrides in self.overrides.values() for override in overrides]

    @property
    def main(self) -> str:
        """The point with the largest share of the time."""
        return max(self.shares, key=lambda name: self.shares[name])

    @property
    def minor(self) -> dict[tuple[str, ...], int]:
        """By overrides of points with a small share of the time, the part of the replicates that they have where all goals are means over it."""
        if any(rule.aggregate != "mean" for rule in self.rules.values() if rule.goal != "none"):
            return {}
        shares = defaultdict[tuple[str, ...], float](float)
        for name, overrides in self.overrides.items():
            shares[tuple(overrides)] += self.shares[name]
        most = max(shares.values())
        parts = {
            overrides: next((part for part in PARTS if part * share <= most), 1) for overrides, share in shares.items()
        }
        return {overrides: part for overrides, part in parts.items() if part > 1}

    @property
    def columns(self) -> list[str]:
        """Names of all figures at all points, point by point."""
        return [at_point(point, figure) for point in self.shares for figure in self.rules]

    def responses(self, outputs: "NoisyValues", smooth: Array) -> "NoisyValues":
        """Responses of a study (p, n, m), of p designs at n input sets.

        They follow from the figures at all points (p, n, c), in the order of `columns`, which have the same inputs in each row:
        the worst point is that of the row. Its simulation takes the ``smooth`` variances, for those of a row's few replicates
        scatter widely. Ratios are those to the first design.
        """
        shape = (*smooth.shape[:2], len(self.shares), len(self.rules))
        tables = [array.reshape(shape) for array in (*outputs, smooth)]
        names = list(self.shares)
        places = [names.index(group[0]) for group in self.groups]
        columns = [
            self._response(rule, *(array[:, :, places, figure] for array in tables))
            for figure, rule in enumerate(self.rules.values())
        ]
        figures = list(self.rules)
        columns += [
            tuple(array[:, :, names.index(point), figures.index(figure)] for array in tables[:3])
            for point, figure in self.limits
        ]
        values, errors, degrees = (np.stack(arrays, axis=-1) for arrays in zip(*columns, strict=True))
        return outputs._replace(values=values, variances=errors, freedom=degrees.astype(np.int64))

    def _response(
        self, rule: Rule, values: Array, variances: Array, freedom: Whole, smooth: Array
    ) -> tuple[Array, ...]:
        """A response (p, n) of its figure at groups of points (p, n, g)."""
        from rbdyn.base.estimate import Estimate

        if rule.aggregate == "worst_relative":
            ratios = values / values[0]
            variances, smooth = ((ours + ratios**2 * ours[0]) / values[0] ** 2 for ours in (variances, smooth))
            # The first design is exactly 1 of itself.
            values, variances[0], smooth[0] = ratios, 0.0, 0.0
        if values.shape[2] == 1:
            return values[..., 0], variances[..., 0], freedom[..., 0].astype(float)
        normal = np.full(values.shape, np.inf)
        parts = (variances, freedom.astype(float)) if rule.aggregate == "mean" else (smooth, normal)
        flat = [array.reshape(-1, values.shape[2]) for array in (values, *parts)]
        figure, _ = rule.over(Estimate(flat[0], np.sqrt(flat[1]), flat[2]), self.weights(self.groups))
        degrees = (
            np.minimum(figure.freedom, freedom.sum(axis=2).ravel()) if rule.aggregate == "mean" else freedom.min(axis=2)
        )
        return tuple(
            np.asarray(array).reshape(values.shape[:2]) for array in (figure.value, figure.error**2, np.floor(degrees))
        )

    def weights(self, groups: Sequence[Sequence[str]]) -> Array:
        """Shares (g,) of groups of points that are one."""
        return np.array([math.fsum(self.shares[name] for name in group) for group in groups])


def _entry(tables: Any, path: Sequence[str]) -> Any:
    """Entry of nested tables; None where they have none."""
    for key in path:
        tables = tables.get(key) if isinstance(tables, Mapping) else None
    return tables


class DutyScenes(Record):
    """A run over a duty: a scene by name of each point.

    ``baseline``: scenes of the original design by point, whose figures those of a worst_relative response are divided by; empty
    without such a response. ``baseline_errors``: whether their errors count. In runs from which surfaces and emulators are
    fitted they do not: the divisor is one for all of these and is no scatter of a run.
    """

    duty: Duty
    scenes: Mapping[str, Scene]
    baseline: Mapping[str, Scene] = field(default_factory=dict)
    baseline_errors: bool = False

    @property
    def main(self) -> Scene:
        """The scene at the point with the largest share of the time."""
        return self.scenes[self.duty.main]


# What a study simulates at values of its factors: a scene, or one at each point of its duty.
Run = Scene | DutyScenes


def over_points(duty: Duty | None, scenes: Callable[[Sequence[str]], list[Scene | str]]) -> list[Run | str]:
    """Runs of ``scenes`` with the overrides of a point, or of none without a duty. A sentence in place of a scene replaces the run."""
    if duty is None:
        return [*scenes(())]
    columns = [scenes(overrides) for overrides in duty.overrides.values()]
    runs = list[Run | str]()
    for row in zip(*columns, strict=True):
        possible = {name: scene for name, scene in zip(duty.shares, row, strict=True) if isinstance(scene, Scene)}
        faults = [f"at {name}: {fault}" for name, fault in zip(duty.shares, row, strict=True) if isinstance(fault, str)]
        try:
            runs.append(faults[0] if faults else DutyScenes(duty, duty.started(possible)))
        except InputError as error:
            runs.append(error.faults[0])
    return runs


def points_in(duty: Duty | None) -> int:
    """Simulations of a run: one at each point of a duty with another scene, one without a duty."""
    return 1 if duty is None else len(duty.groups)


def scenes_of(run: Run) -> list[Scene]:
    """All scenes of a run, without those of the baseline."""
    return [run] if isinstance(run, Scene) else list(run.scenes.values())


def scene_at(run: Run, point: str) -> Scene:
    """The scene of a run at a point of the duty; without one, its only scene."""
    return run if isinstance(run, Scene) else run.scenes[point]


def labelled_scenes(run: Run) -> list[tuple[str, Scene]]:
    """Scenes of a run with what their labels say besides that of the run, those of its baseline first."""
    if isinstance(run, Scene):
        return [("", run)]
    baseline = [(f"baseline at {name}", scene) for name, scene in run.baseline.items()]
    return baseline + [(f"at {name}", scene) for name, scene in run.scenes.items()]


def main_scene(run: Run) -> Scene:
    """The scene of a run that stands for it in a picture: over a duty, at the point with the largest share of the time."""
    return run if isinstance(run, Scene) else run.main


class DutyResult(Record):
    """Results of a run by point, in the order of the names, and of the baseline if its figures count.

    ``groups``: names of points, those with one scene together.
    """

    duty: Duty
    points: Mapping[str, SimulationResult]
    groups: tuple[tuple[str, ...], ...]
    baseline: Mapping[str, SimulationResult] = field(default_factory=dict)
    baseline_errors: bool = False

    @property
    def responses(self) -> dict[str, Quantity]:
        """Every figure at every point, and every response. Raises RunError."""
        every = {
            at_point(point, name): figure
            for point, figures in self.at_points.items()
            for name, figure in figures.items()
        }
        return every | {name: figure for name, (figure, _) in self._responses.items()}

    @cached_property
    def at_points(self) -> dict[str, dict[str, Quantity]]:
        """Figures by point; those that a run does not report are left out."""
        return {point: self._figures(result) for point, result in self.points.items()}

    @cached_property
    def _baseline_figures(self) -> dict[str, dict[str, Quantity]]:
        return {point: self._figures(result) for point, result in self.baseline.items()}

    def _figures(self, result: SimulationResult) -> dict[str, Quantity]:
        responses = result.responses
        return {name: responses[name] for name in self.duty.rules if name in responses}

    @property
    def worst(self) -> dict[str, tuple[str, float]]:
        """By response that is a worst one: the likeliest worst point and the probability that it is."""
        return {name: worst for name, (_, worst) in self._responses.items() if worst is not None}

    @cached_property
    def _responses(self) -> dict[str, tuple[Quantity, tuple[str, float] | None]]:
        responses = {}
        for figure, rule in self.duty.rules.items():
            names = [group[0] for group in self.groups]
            if not all(figure in self.at_points[name] for name in names):
                continue
            if rule.aggregate == "worst_relative":
                if not self.baseline:
                    continue
                parts = [self._ratio(name, figure) for name in names]
            else:
                parts = [self.at_points[name][figure] for name in names]
            quantity, odds = _over_points(rule, parts, self.duty.weights(self.groups))
            place = int(odds.argmax())
            compares = rule.aggregate == "mean" or (rule.aggregate == "worst_relative" and self._is_baseline)
            responses[figure] = quantity, None if compares else (names[place], float(odds[place]))
        return responses

    @property
    def _is_baseline(self) -> bool:
        return all(self.points[name].scene == self.baseline[name].scene for name in self.points)

    def _ratio(self, point: str, figure: str) -> Quantity:
        """A figure over that of the baseline at the same point; of the baseline itself exactly 1."""
        value, divisor = self.at_points[point][figure], self._baseline_figures[point].get(figure)
        if divisor is None:
            raise RunError(f"{figure} of the baseline at {point}: the run does not report it")
        if not divisor.value > (divisor.error or 0.0):
            raise RunError(
                f"{figure} of the baseline at {point} is {divisor}, not above 0 by more than its error, so that no ratio to it "
                'exists; write aggregate = "worst" or "mean"'
            )
        if self.points[point].scene == self.baseline[point].scene:
            return Quantity(1.0, 0.0, 0.0, value.effective_samples)
        return quotient(value, divisor, self.baseline_errors)

    @property
    def notes(self) -> Notes:
        """Notes of all points, each once: those that not every point has name their points."""
        return merged({group[0]: self.points[group[0]].notes for group in self.groups}, "at {}", same=without_numbers)

    @property
    def power_terms_W(self) -> dict[str, float]:  # noqa: N802
        """Parts of the power loss, weighted by the shares of the time."""
        if len(self.groups) == 1:
            return self.points[self.groups[0][0]].power_terms_W
        terms = dict.fromkeys(name for result in self.points.values() for name in result.power_terms_W)
        return {
            name: math.fsum(
                share * self.points[point].power_terms_W.get(name, 0.0) for point, share in self.duty.shares.items()
            )
            for name in terms
        }

    @property
    def friction_check(self) -> FrictionCheck | None:
        """The maker's friction; None over several points, where it is that of none."""
        return self.points[self.groups[0][0]].friction_check if len(self.groups) == 1 else None

    @property
    def cage_orbit_radius_share(self) -> Quantity | None:
        """Radius of the cage's orbit over its play at the point where it is least."""
        orbits = [self.points[group[0]].cage_orbit_radius_share for group in self.groups]
        return min((orbit for orbit in orbits if orbit is not None), key=lambda orbit: orbit.value, default=None)

    @property
    def jitters(self) -> bool:
        """Whether the cage only jitters at any point, so that its whirl there is none."""
        return any(result.jitters for result in self.points.values())

    @property
    def jitter_points(self) -> tuple[str, ...]:
        """Points at which the cage only jitters; none where it does so at all of them."""
        names = [name for name, result in self.points.items() if result.jitters]
        return tuple(names) if len(names) < len(self.points) else ()


Simulated = SimulationResult | DutyResult
# Key of the only scene and result without a duty.
OPERATION = "operation"


def results_at(result: Simulated) -> Mapping[str, SimulationResult]:
    """Results by point of the duty, or under OPERATION."""
    return result.points if isinstance(result, DutyResult) else {OPERATION: result}


def cages_of(result: Simulated) -> dict[str, CageVerdict]:
    """Verdict on the cage by point of the duty, or under OPERATION; empty where its scene leaves it out."""
    return {name: run.verdict for name, run in results_at(result).items() if run.verdict is not None}


def result_of(
    run: Run, label: str, outcomes: Sequence[tuple[Point, SimulationResult | Failure]]
) -> "SimulationResult | DutyResult | Failure":
    """Result of a run of those of its scenes; the failure of any of them names its point."""
    results = [result for _, result in outcomes]
    if isinstance(run, Scene):
        return results[0]
    words = [words for words, _ in labelled_scenes(run)]
    causes = [f"{where}: {part.cause}" for where, part in zip(words, results, strict=True) if isinstance(part, Failure)]
    last = outcomes[-1][0]
    if causes:
        return Failure(label, "; ".join(dict.fromkeys(causes)), last.run, dict(last.factors))
    sound = [result for result in results if isinstance(result, SimulationResult)]
    ours, names = len(run.baseline), list(run.scenes)
    groups = dict[str, list[str]]()
    for name, (point, _) in zip(names, outcomes[ours:], strict=True):
        groups.setdefault(point.key, []).append(name)
    return DutyResult(
        run.duty,
        dict(zip(names, sound[ours:], strict=True)),
        tuple(map(tuple, groups.values())),
        dict(zip(run.baseline, sound[:ours], strict=True)),
        run.baseline_errors,
    )


def _over_points(rule: Rule, parts: Sequence[Quantity], weights: Array) -> tuple[Quantity, Array]:
    """One quantity of those at the points, and the odds (p,) of each to be the worst.

    Numerical errors of a method have one sign at all points, so that they add: by the weights, or by the odds.
    """
    from rbdyn.base.estimate import Estimate, quantile

    counted = [place for place, weight in enumerate(weights) if weight > 0.0 or rule.aggregate != "mean"]
    if len(counted) == 1:
        return parts[counted[0]], np.eye(len(parts))[counted[0]]
    values, halves, _, freedom = arrays_of([parts])
    figure, (odds,) = rule.over(Estimate(values, halves / quantile(freedom), freedom), weights)
    possible = [(share, part) for share, part in zip(odds.tolist(), parts, strict=True) if share > 0.0]
    known = [share * part.numerical_error for share, part in possible if part.numerical_error is not None]
    numerical = math.fsum(known) if len(known) == len(possible) else None
    samples = min(part.effective_samples for _, part in possible)
    return _quantity(figure.value.item(), figure, numerical, samples), odds


def quotient(value: Quantity, divisor: Quantity, with_errors: bool) -> Quantity:
    """Ratio to a positive quantity, to first order in their independent errors; ``with_errors``: whether those of the divisor count."""
    from rbdyn.base.estimate import Estimate, quantile

    scale, ratio, samples = divisor.value, value.value / divisor.value, value.effective_samples
    if not with_errors:
        half, numerical = (error and error / scale for error in (value.statistical_error, value.numerical_error))
        return Quantity(ratio, half, numerical, samples, value.degrees_of_freedom)
    _, *halves, freedom = arrays_of([value, divisor])
    statistical, numerical_errors = (np.array([1.0, abs(ratio)]) * pair / scale for pair in halves)
    ours, theirs = (
        Estimate(*figure) for figure in zip(statistical, statistical / quantile(freedom), freedom, strict=True)
    )
    known = finite(float(numerical_errors.sum()))
    return _quantity(ratio, ours - theirs, known, min(samples, divisor.effective_samples))


def _quantity(value: float, figure: "Estimate", numerical: float | None, samples: float) -> Quantity:
    """A quantity with the error of an estimate, whose freedom is rounded down."""
    from rbdyn.base.estimate import quantile

    freedom, error = float(np.squeeze(figure.freedom)), float(np.squeeze(figure.error))
    joint = math.floor(freedom + 1e-9) if math.isfinite(freedom) else None
    return Quantity(value, finite(error * float(quantile(joint or math.inf))), numerical, samples, joint)
