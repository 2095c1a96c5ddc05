"""The front of what designs gain over the baseline while inputs are not known, and a few of its points simulated.

Runs spread over factors and inputs together, every unknown input in each, are compared with the baseline at the same input set:
emulators learn the gains themselves, in which levels that all designs share fall out. They cover the factors and the inputs that
matter most; what the others do to a gain is scatter, of which each input set of the search has its part. The search maximises
the mean, or a low quantile, of the gains over the inputs. Points that a search on emulators likes were also lucky, so some are
simulated at input sets of which the emulators saw none.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from doe import clearance
from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.pareto import Goals, InfeasibleError, ParetoFront, front
from doe.running.store import Failure
from doe.study.goals import goals_of, region_of, rounded_within
from doe.study.input_sets import Case, Sets, declared, run
from doe.study.pairs import Pairs, relative_gains, simulated
from doe.study_file import Study
from doe.unknown.decision import Better, better, shrunk
from doe.unknown.inputs import nested
from doe.unknown.propagation import Emulated, Runs, emulated

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
    """Points (f, k) and what emulators predict of their gains (f, q); ``confirmed`` by name, the plain pick first; ``q2`` of
    the emulators; ``note`` where there is no front."""

    points: Array
    gains: Array
    confirmed: Mapping[str, Held]
    q2: list[float]
    note: str = ""


def find_robust_front(
    study: Study, case: Case, pairs: Pairs, pick: Array, simulations: Simulations
) -> tuple[RobustFront, int, tuple[Failure, ...]]:
    """The front, the runs that it took, and those that failed; ``pairs``: the baseline and the pick at the study's input sets.

    Raises InputError, RunError, KeyboardInterrupt.
    """
    settings, goals, reach = study.file.robust, goals_of(study), region_of(study)
    low, high = study.actual(-reach), study.actual(reach)
    sets, places, rows = _runs(study, case, pairs, (low, high), simulations)
    predicted = _emulators(case, goals, sets, places, pairs.at(rows), (low, high))
    share = settings.quantile if settings.front == "quantile" else None
    spent, q2 = settings.points, [each.q2 for each in predicted.gain]
    try:
        found = front(
            lambda wanted: predicted.objectives(wanted, share),
            low,
            high,
            goals=predicted.goals,
            population=POPULATION,
            generations=GENERATIONS,
            seed=study.file.front.seed,
            baseline=study.baseline,
        )
    except InfeasibleError:
        note = "no point keeps the limits over what is not known"
        return RobustFront(low[None][:0], np.empty((0, len(q2))), {}, q2, note), spent, sets.failures
    chosen = {"pick": (pick, "the pick"), **_choices(study, found, predicted)}
    designs = {"baseline": clearance.assignments(study.at(()), study.baseline)}
    designs |= {name: clearance.assignments(study, point) for name, (point, _) in chosen.items()}
    rows = fresh_rows(settings.points)
    quantiles = case.joint(case.every).sets(1 << int(rows.max()).bit_length(), case.uncertain.seed)[rows]
    again, lost = simulated(case, case.every, quantiles, designs, simulations)
    confirmed = {}
    for number, (name, (point, reason)) in enumerate(chosen.items(), 1):
        gains, variances = again.gains(goals, number)
        held = _over_inputs(shrunk(gains, variances), share)
        confirmed[name] = Held(point, reason, better(gains, variances, case.uncertain.seed), held)
    # The baseline and the pick were there before, but for the sets that the study's own do not hold.
    spent += CONFIRMED * (len(chosen) - 1) + 2 * int((rows >= settings.points).sum())
    return RobustFront(found.points, found.values[:, : len(q2)], confirmed, q2), spent, (*sets.failures, *lost)


def fresh_rows(points: int) -> Whole:
    """Places of the input sets at which points are simulated: of the study's own the first half, of which emulators see the
    second, then such as come after them."""
    first = min(points // 2, CONFIRMED)
    return np.array([*range(first), *range(points, points + CONFIRMED - first)])


def _runs(
    study: Study, case: Case, pairs: Pairs, box: tuple[Array, Array], simulations: Simulations
) -> tuple[Sets, Array, Whole]:
    """Designs spread over the ``box`` at the second half of the study's input sets, as many as there are sets; places (n, k) of
    these designs between 0 and 1, and the row of the pairs at the same input set."""
    points, (low, high) = study.file.robust.points, box
    half = np.flatnonzero(pairs.places >= points // 2)
    even = nested(len(study.factors), points, case.uncertain.seed + 2)
    rows = np.resize(half, points)
    own = [clearance.assignments(study, point) for point in low + (high - low) * even]
    title = "runs of the robust front"
    sets = run(case, case.every, pairs.quantiles[rows], simulations, JOINT_SEEDS, (), title, own)
    return sets, even[sets.places], rows[sets.places]


def _emulators(
    case: Case, goals: Goals, sets: Sets, places: Array, base: Pairs, box: tuple[Array, Array]
) -> "_Predicted":
    """Emulators of the gains over the baseline ``base`` at the same input sets, and of limited responses."""
    factors = places.shape[1]
    always = [*range(factors), *(factors + place for place in declared(case))]
    cover = factors + case.uncertain.inputs, always
    at = np.hstack([places, sets.quantiles])
    gains, variances = relative_gains(
        goals, np.stack([base.outputs[0], sets.outputs]), np.stack([base.variances[0], sets.variances])
    )
    freedom = (base.freedom[0] + sets.freedom)[:, goals.objectives]
    columns = zip(gains.T, variances.T, freedom.T, strict=True)
    gain = [emulated(Runs(at, *each), *cover, logarithms=False) for each in columns]
    limited = [
        emulated(Runs(at, sets.outputs[:, index], sets.variances[:, index], sets.freedom[:, index]), *cover)
        for index, _, _ in goals.limited
    ]
    seed = case.uncertain.seed + 3
    random = np.random.default_rng(seed)
    # One row for all gains: what inputs outside the emulators do to them goes together.
    rows = random.integers(0, len(at), SEARCHED)
    rest = np.column_stack([each.residuals for each in gain])[rows]
    return _Predicted(gain, limited, goals, box, case.joint(case.every).sets(SEARCHED, seed), rest)


@dataclass(frozen=True, eq=False)
class _Predicted:
    """What emulators predict at ``sets`` (s, d + 1) of inputs: gains over the baseline, each set with the residual ``rest``
    (s, q) of a run, and limited responses."""

    gain: Sequence[Emulated]
    limited: Sequence[Emulated]
    wanted: Goals
    box: tuple[Array, Array]
    sets: Array
    rest: Array

    @property
    def goals(self) -> Goals:
        """Goals of ``objectives``: gains to be large, limited responses within their limits."""
        kinds = ["max"] * len(self.wanted.objectives) + ["none"] * len(self.wanted.limited)
        ends: dict[str, list[float | None]] = {side: [None] * len(kinds) for side in ("lower", "upper", "weight")}
        ends["weight"][: len(self.wanted.objectives)] = self.wanted.cost_weight.tolist()
        for place, (_, sense, limit) in enumerate(self.wanted.limited, len(self.wanted.objectives)):
            ends["lower" if sense == ">=" else "upper"][place] = limit
        return Goals.of(kinds, **ends)  # type: ignore[arg-type]

    def gains(self, points: Array) -> Array:
        """Relative gains (n, s, q) at points (n, k)."""
        return self._at_all(self.gain, points) + self.rest

    def objectives(self, points: Array, share: float | None) -> Array:
        """Mean or quantile of the gains at points (n, k), then of each limited response the mean or the quantile towards its
        limit."""
        columns = [_over_inputs(self.gains(points), share, axis=1)]
        for fitted, (_, sense, _) in zip(self.limited, self.wanted.limited, strict=True):
            towards = share if share is None or sense == ">=" else 1.0 - share
            columns.append(_over_inputs(self._at_all([fitted], points), towards, axis=1))
        return np.hstack(columns)

    def _at_all(self, fitted: Sequence[Emulated], points: Array) -> Array:
        """Outputs (n, s, e) of emulators at points (n, k) and all sets."""
        low, high = self.box
        coded = np.repeat((points - low) / (high - low), len(self.sets), axis=0)
        at_all = np.hstack([coded, np.tile(self.sets, (len(points), 1))])
        return np.stack([each(at_all).reshape(len(points), -1) for each in fitted], axis=-1)


def _over_inputs(values: Array, share: float | None, axis: int = 0) -> Array:
    """Mean, or quantile."""
    return values.mean(axis=axis) if share is None else np.quantile(values, share, axis=axis)


def _choices(study: Study, found: ParetoFront, predicted: _Predicted) -> dict[str, tuple[Array, str]]:
    """Points of the front that are worth a simulation, by name, and why."""
    together = (predicted.gains(found.points) > 0.0).all(axis=2).mean(axis=1)
    rows: dict[str, int] = {"surest": int(together.argmax())}
    rows.update({str(rule): row for rule, row in found.picks.items()})
    reasons = {"surest": "the likeliest of the robust front to gain in all"}
    chosen: dict[str, tuple[Array, str]] = {}
    for name, row in rows.items():
        point = rounded_within(study, found.points[row])
        if len(chosen) < POINTS and not any(np.array_equal(point, other) for other, _ in chosen.values()):
            chosen[f"robust {name}"] = point, reasons.get(name, f"the robust front's by {name}")
    return chosen
