"""The front of what designs gain over the baseline while inputs are not known, and a few of its points simulated.

Runs spread over factors and inputs together teach emulators of the responses; the search maximises the mean, or a low quantile,
over the inputs of the gain over the baseline at the same inputs: levels that all designs share fall out. Points that a search
on emulators likes were also lucky, so some are simulated at input sets of which the emulators saw none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from doe import clearance
from doe.arrays import Array
from doe.clearance import Simulations
from doe.pareto import Goals, InfeasibleError, ParetoFront, front
from doe.running.failure import Failure
from doe.study.goals import goals_of, region_of, rounded_within
from doe.study.input_sets import Case, run
from doe.study.pairs import simulated
from doe.study_file import Study
from doe.unknown.decision import Better, better, shrunk
from doe.unknown.joint import Joint, nested
from doe.unknown.spread import Emulated, Runs, emulated
from rbdyn.scene.unknown import Input

JOINT_SEEDS = 200_000
# Input sets over which the search averages, those at which points are simulated, and how many points.
SEARCHED, CONFIRMED, POINTS = 128, 128, 3
POPULATION, GENERATIONS = 60, 40


@dataclass(frozen=True, eq=False)
class Held:
    """A design simulated over what is not known: its point (k,), why this one, how likely it gains, and the mean or the
    quantile (q,) of its gains."""

    point: Array
    reason: str
    better: Better
    gains: Array


@dataclass(frozen=True, eq=False)
class RobustFront:
    """Points (f, k) and what emulators foretell of their gains (f, q); ``confirmed`` by name, the plain pick first; ``q2`` of
    the emulators; ``note`` where there is no front."""

    points: Array
    gains: Array
    confirmed: Mapping[str, Held]
    q2: list[float]
    note: str = ""


def find_robust_front(
    study: Study, case: Case, inputs: Sequence[Input], joint: Joint, pick: Array, simulations: Simulations
) -> tuple[RobustFront, int, tuple[Failure, ...]]:
    """The front, the runs that it took, and those that failed. Raises InputError, RunError, KeyboardInterrupt."""
    settings, seed, goals = study.file.robust, case.uncertain.seed, goals_of(study)
    reach, factors = region_of(study), len(study.factors)
    low, high = study.actual(-reach), study.actual(reach)
    even = nested(factors + joint.inputs + 1, settings.points, seed + 2)
    points, quantiles = low + (high - low) * even[:, :factors], joint.placed(even[:, factors:])
    own = [clearance.assignments(study, point) for point in points]
    sets = run(case, inputs, quantiles, simulations, JOINT_SEEDS, (), "runs of the robust front", own)
    places = np.hstack([even[sets.places, :factors], sets.quantiles])
    fitted = [
        emulated(Runs(places, sets.outputs[:, each], sets.variances[:, each], sets.freedom[:, each]))
        for each in range(len(study.responses))
    ]
    foretold = _Foretold(fitted, goals, (low, high), joint.sets(SEARCHED, seed + 3), study.baseline)
    share = settings.quantile if settings.front == "quantile" else None
    spent, q2 = len(own), [fitted[index].q2 for index in goals.objectives]
    try:
        found = front(
            lambda wanted: foretold.kept(wanted, share),
            low,
            high,
            goals=foretold.goals,
            population=POPULATION,
            generations=GENERATIONS,
            seed=study.file.front.seed,
            baseline=study.baseline,
        )
    except InfeasibleError:
        note = "no point keeps the limits over what is not known"
        return RobustFront(low[None][:0], np.empty((0, len(q2))), {}, q2, note), spent, sets.failures
    chosen = {"pick": (pick, "the pick"), **_choices(study, found, foretold)}
    designs = {"baseline": clearance.assignments(study.at(()), study.baseline)}
    designs |= {name: clearance.assignments(study, point) for name, (point, _) in chosen.items()}
    pairs, lost = simulated(case, inputs, joint.sets(CONFIRMED, seed), designs, simulations)
    confirmed = {}
    for number, (name, (point, reason)) in enumerate(chosen.items(), 1):
        gains, variances = pairs.gains(goals, number)
        held = _over_inputs(shrunk(gains, variances), share)
        confirmed[name] = Held(point, reason, better(gains, variances, seed), held)
    spent += CONFIRMED * (len(chosen) - 1)
    return RobustFront(found.points, found.values[:, : len(q2)], confirmed, q2), spent, (*sets.failures, *lost)


@dataclass(frozen=True, eq=False)
class _Foretold:
    """What emulators of the responses foretell of gains over the baseline at ``sets`` (s, d + 1) of inputs."""

    fitted: Sequence[Emulated]
    wanted: Goals
    box: tuple[Array, Array]
    sets: Array
    baseline: Array

    @property
    def goals(self) -> Goals:
        """Goals of ``kept``: gains to be large, limited responses within their limits."""
        kinds = ["max"] * len(self.wanted.objectives) + ["none"] * len(self.wanted.limited)
        ends: dict[str, list[float | None]] = {side: [None] * len(kinds) for side in ("lower", "upper", "weight")}
        ends["weight"][: len(self.wanted.objectives)] = self.wanted.cost_weight.tolist()
        for place, (_, sense, limit) in enumerate(self.wanted.limited, len(self.wanted.objectives)):
            ends["lower" if sense == ">=" else "upper"][place] = limit
        return Goals.of(kinds, **ends)  # type: ignore[arg-type]

    def responses(self, points: Array) -> Array:
        """Responses (n, s, m) at points (n, k)."""
        low, high = self.box
        coded = np.repeat((points - low) / (high - low), len(self.sets), axis=0)
        at_all = np.hstack([coded, np.tile(self.sets, (len(points), 1))])
        return np.stack([each(at_all).reshape(len(points), -1) for each in self.fitted], axis=-1)

    def gains(self, values: Array) -> Array:
        """Relative gains (n, s, q) of responses (n, s, m)."""
        base = self.responses(self.baseline[None])
        return (self.wanted.costs(base) - self.wanted.costs(values)) / np.abs(base[..., self.wanted.objectives])

    def kept(self, points: Array, share: float | None) -> Array:
        """Mean or quantile of the gains at points (n, k), then of each limited response the mean or the quantile towards its
        limit."""
        values = self.responses(points)
        columns = [_over_inputs(self.gains(values), share, axis=1)]
        for index, sense, _ in self.wanted.limited:
            towards = share if share is None or sense == ">=" else 1.0 - share
            columns.append(_over_inputs(values[:, :, [index]], towards, axis=1))
        return np.hstack(columns)


def _over_inputs(values: Array, share: float | None, axis: int = 0) -> Array:
    """Mean, or quantile."""
    return values.mean(axis=axis) if share is None else np.quantile(values, share, axis=axis)


def _choices(study: Study, found: ParetoFront, foretold: _Foretold) -> dict[str, tuple[Array, str]]:
    """Points of the front that are worth a simulation, by name, and why."""
    together = (foretold.gains(foretold.responses(found.points)) > 0.0).all(axis=2).mean(axis=1)
    rows: dict[str, int] = {"surest": int(together.argmax())}
    rows.update({str(rule): row for rule, row in found.picks.items()})
    reasons = {"surest": "the likeliest of the robust front to gain in all"}
    chosen: dict[str, tuple[Array, str]] = {}
    for name, row in rows.items():
        point = rounded_within(study, found.points[row])
        if len(chosen) < POINTS and not any(np.array_equal(point, other) for other, _ in chosen.values()):
            chosen[f"robust {name}"] = point, reasons.get(name, f"the robust front's by {name}")
    return chosen
