"""Whether the pick beats the baseline while inputs are unknown, and which input decides it; gains of designs at the same input sets, and
the front of these gains.

Both designs are simulated at the same input sets. Sets of which a gain is in doubt get more replicates, those nearest to
nothing first, until the share of further runs that the study allows is spent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Any

import numpy as np

from doe import clearance
from doe.clearance import Simulations
from doe.emulator import pooled_variances
from doe.pareto import Goals, InfeasibleError, ParetoFront, front
from doe.running.store import Failure
from doe.study_file import Study
from doe.threads import one_thread
from doe.unknown import inputs as unknown
from doe.unknown.decision import Better, better, in_doubt, odds, shrunk
from doe.unknown.inputs import nested
from doe.unknown.propagation import Emulated, Runs, Share, emulated
from doe.unknown.worth import Decides, Deciding, Interval, Verdict, decides
from doe.workflow.goals import goals_of, region_of, rounded_within
from doe.workflow.input_sets import ROUND_SEEDS, Case, Sets, case_of, declared, run, run_notes, strongest
from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import set_key
from rbdyn.scene.unknown import Input, is_number


@dataclass(frozen=True)
class Pairs:
    """p designs at the same input sets: ``places`` of these in what was asked for, their quantiles (n, d), outputs, variances
    and degrees of freedom (p, n, m); ``effort`` (n,): how many times the replicates of the first runs."""

    places: Whole
    quantiles: Array
    outputs: Array
    variances: Array
    freedom: Whole
    effort: Whole

    def at(self, rows: Whole) -> "Pairs":
        """The same at some rows, each as often as it is named."""
        outputs, variances, freedom = self.outputs[:, rows], self.variances[:, rows], self.freedom[:, rows]
        return Pairs(self.places[rows], self.quantiles[rows], outputs, variances, freedom, self.effort[rows])

    def joined(self, rows: Whole, other: "Pairs") -> "Pairs":
        """The same, at some rows joined with as many replicates more."""
        outputs, variances, freedom = self.outputs.copy(), self.variances.copy(), self.freedom.copy()
        outputs[:, rows] = 0.5 * (outputs[:, rows] + other.outputs)
        variances[:, rows] = 0.25 * (variances[:, rows] + other.variances)
        freedom[:, rows] += other.freedom + 1
        effort = self.effort.copy()
        effort[rows] *= 2
        return replace(self, outputs=outputs, variances=variances, freedom=freedom, effort=effort)

    def gains(self, goals: Goals, design: int = 1) -> tuple[Array, Array]:
        """Relative gains (n, q) of a design over the first, and their variances, smoothed over the inputs: of a row's own few
        replicates they are guesses, whose mean a few large ones make."""
        both = [0, design]
        gains, variances = relative_gains(goals, self.outputs[both], self.variances[both])
        freedom = self.freedom[both][:, :, goals.objectives].sum(axis=0)
        once = self.effort[:, None] * variances
        smooth = [pooled_variances(self.quantiles, *each) for each in zip(once.T, freedom.T, strict=True)]
        return gains, np.column_stack(smooth) / self.effort[:, None]

    def values(self, response: int, design: int = 1) -> tuple[Array, Array]:
        """Values (n,) of a response of a design, and their variances, smoothed over the inputs as those of gains are."""
        once = self.effort * self.variances[design][:, response]
        smooth = pooled_variances(self.quantiles, once, self.freedom[design][:, response])
        return self.outputs[design][:, response], smooth / self.effort


def relative_gains(goals: Goals, outputs: Array, variances: Array) -> tuple[Array, Array]:
    """Relative gains (n, q) of the second design over the first of outputs (2, n, m), and their variances."""
    index = goals.objectives
    scale = np.abs(outputs[0][:, index])
    before, after = (goals.costs(each) for each in outputs)
    gains = (before - after) / scale
    noise, other = (each[:, index] for each in variances)
    # The first is in the denominator too.
    return gains, (other + (1.0 - gains) ** 2 * noise) / scale**2


def simulated(
    case: Case,
    inputs: Sequence[Input],
    quantiles: Array,
    designs: Mapping[str, Sequence[str]],
    simulations: Simulations,
    seeds: int = 0,
    more: Sequence[str] = (),
) -> tuple[Pairs, tuple[Failure, ...]]:
    """Designs, each as overrides of the scene, at input sets; one at which any failed is left out."""
    given, title = (case, inputs, quantiles, simulations, seeds), f"input sets of the {{}}, from seed {seeds},"
    every = [run(*given, [*design, *more], title.format(name)) for name, design in designs.items()]
    places = reduce(np.intersect1d, (sets.places for sets in every))
    kept = [np.flatnonzero(np.isin(sets.places, places)) for sets in every]
    outputs, variances, freedom = (
        np.array([array[rows] for array, rows in zip(arrays, kept, strict=True)])
        for arrays in zip(*((sets.outputs, sets.variances, sets.freedom) for sets in every), strict=True)
    )
    lost = tuple(failure for sets in every for failure in sets.failures)
    effort = np.ones(len(places), dtype=np.int64)
    return Pairs(places, quantiles[places], outputs, variances, freedom, effort), lost


JOINT_SEEDS = 200_000
# Input sets over which the search averages, those at which points are simulated, and how many points.
SEARCHED, CONFIRMED, POINTS = 128, 128, 3
POPULATION, GENERATIONS = 60, 40


@dataclass(frozen=True, eq=False)
class Held:
    """A design simulated over the unknown inputs: its point (k,), why this one, how likely it gains, and the mean or the
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
        note = "no point keeps the limits over the unknown inputs"
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


# Rounds of further replicates: each as many again as there are, so that a set gets 2, 4, 8 and 16.
ROUNDS = 3
FRESH = 8192


@dataclass(frozen=True)
class Decider:
    """An unknown input that decides: the value where the better design changes, None where none does, what measuring it is
    worth in chances of the right choice, whether the pick is better above that value, and 95 % intervals, None of a flip that
    is not sure to exist."""

    key: str
    flip: Any
    worth: float
    above: bool
    flip_interval: tuple[Any, Any] | None
    worth_interval: Interval


@dataclass(frozen=True)
class Decision:
    """Whether the first of the deciding inputs decides: the verdict, keys of the inputs that may, the best first, about how many
    pairs it takes to decide between them, and the 95 % interval of what the best pair is worth, None without a pair."""

    verdict: Verdict
    rivals: list[str]
    needed: float
    pair_interval: Interval | None


@dataclass(frozen=True)
class Robust:
    """The judgement: ``responses`` with a goal, how likely each and all gains are, deciding inputs by worth, the two
    that are worth most together, how well inputs predict each gain, by how much the chance of all gains changes with ranges
    half as wide, the front of points that hold over the inputs, None where the study wants none, the inputs, which all vary in
    every set, ``screened``: those that no emulator of a gain covers, with the largest share that the main effect of each makes of
    a gain, the cost in runs, the ``decision`` which of the deciding inputs is first, notes: what is to be doubted of a posterior
    sample, which keys do not vary, and the ``odds`` that the pick keeps all limits of a response, by its name."""

    responses: list[str]
    better: Better
    decides: list[Decider]
    pair: tuple[str, str, float] | None
    explained: list[float]
    halved: float
    front: RobustFront | None
    inputs: list[Input]
    screened: dict[str, float]
    pairs: int
    runs: int
    doubtful: int
    failures: tuple[Failure, ...]
    decision: Decision
    notes: tuple[str, ...] = ()
    odds: Mapping[str, Share] = field(default_factory=dict)


def robust_advice(study: Study) -> list[str]:
    """Where the scene names estimates, what a judgement over them would answer and cost; else nothing."""
    if "uncertain" not in clearance.read_scene(study):
        return []
    runs = round(2 * study.file.robust.points * (1.0 + study.file.robust.settle))
    return [
        "the scene names values that are estimates: --robust counts in how many of 100 cases the pick is better in spite of "
        f"them, by {runs} short simulations and more for a front; doe uncertainty shows what they do to each figure"
    ]


def check_robust(study: Study) -> None:
    """Raises InputError where the unknown inputs of the study's scene are declared wrongly."""
    case_of_study(study)


@one_thread
def judge(study: Study, pick: Array, simulations: Simulations) -> Robust:
    """Judge the pick (k,) next to the baseline. Raises InputError, RunError, KeyboardInterrupt."""
    case, goals = case_of_study(study), goals_of(study)
    joint, seed = case.joint(case.every), case.uncertain.seed
    quantiles = joint.sets(study.file.robust.points, seed)
    designs = {
        "baseline": clearance.assignments(study.at(()), study.baseline),
        "pick": clearance.assignments(study, pick),
    }
    pairs, failures = simulated(case, case.every, quantiles, designs, simulations)
    spent, allowed = 2 * len(pairs.quantiles), round(2 * len(pairs.quantiles) * (1.0 + study.file.robust.settle))
    replicates = case.replicates
    rows = in_doubt(*pairs.gains(goals))
    for again in range(ROUNDS):
        # As many replicates again as there are; a run of twice the replicates counts as two.
        many = 2**again
        rows = rows[: max(allowed - spent, 0) // (2 * many)]
        if rows.size == 0:
            break
        more = [f"numerics.replicates={replicates * many}"]
        seeds = (again + 1) * ROUND_SEEDS
        new, lost = simulated(case, case.every, pairs.quantiles[rows], designs, simulations, seeds, more)
        rows, spent, failures = rows[new.places], spent + 2 * many * len(rows), (*failures, *lost)
        pairs = pairs.joined(rows, new)
        still = in_doubt(*pairs.gains(goals))
        rows = still[np.isin(still, rows)]
    gains, variances = pairs.gains(goals)
    # Of inputs outside these the gains know as scatter.
    places, rest = strongest(case, pairs.quantiles, gains)
    inputs, columns = [case.every[place] for place in places], [*places, -1]
    fresh = joint.sets(FRESH, seed + 1)[:, columns]
    knowable = [place for place, each in enumerate(inputs) if each.law.kind == "unknown"]
    found = decides(
        pairs.quantiles[:, columns], gains, variances, fresh, seed, _read(case, inputs, fresh, seed), knowable
    )
    front = None
    if study.file.robust.front != "none":
        front, more_runs, lost = find_robust_front(study, case, pairs, pick, simulations)
        spent, failures = spent + more_runs, (*failures, *lost)
    deciders, pair, decision = _of_keys(case, inputs, found)
    judged = better(gains, variances, seed), deciders, pair, found.foretold, found.halved, front
    cost = len(gains), spent, int(in_doubt(gains, variances).size)
    wanted = [study.responses[index] for index in goals.objectives]
    notes = *case.notes, *run_notes(case, study.scene.set, "scene.set: ", "other runs of the study")
    return Robust(wanted, *judged, case.every, rest, *cost, failures, decision, notes, limit_odds(study, pairs, seed))


def limit_odds(study: Study, pairs: Pairs, seed: int) -> dict[str, Share]:
    """How likely the pick, the second of the pairs, keeps all limits of each limited response over the unknown inputs."""
    goals = goals_of(study)
    return {
        study.responses[index]: odds(*pairs.values(index), float(goals.lower[index]), float(goals.upper[index]), seed)
        for index in sorted({index for index, _, _ in goals.limited})
    }


def case_of_study(study: Study) -> Case:
    """The study's scene with its unknown inputs; factors are known."""
    path = study.beside(study.scene.file)
    data = clearance.read_scene(study)
    for override in study.scene.set:
        set_key(data, override, f"{study.path}: scene.set")
    keys = *(factor.key for factor in study.file.factor), *(each.key for each in study.file.category)
    fixed = dict.fromkeys(keys, "a factor of the study")
    return case_of(str(path), data, study.responses, study.file.uncertain, fixed, study.path)


def _read(case: Case, inputs: Sequence[Input], fresh: Array, seed: int) -> Array:
    """Quantiles (k, d + 1) of what is read of input sets: those of the inputs, of measured ones with the measurement's error."""
    random, read = np.random.default_rng(seed), fresh.copy()
    for place, each in enumerate(inputs):
        if each.law.measurable is not None:
            values = abs(case.unit(each)) * np.array(unknown.values_of(each.law, fresh[:, place]), float)
            read[:, place] = unknown.ranks(values + each.law.measurable * random.standard_normal(len(values)))
    return read


def _of_keys(
    case: Case, inputs: Sequence[Input], found: Decides
) -> tuple[list[Decider], tuple[str, str, float] | None, Decision]:
    """What decides, by keys and values of the inputs."""

    def decider(one: Deciding) -> Decider:
        at, value = inputs[one.place], lambda quantile: _value(case, inputs[one.place], quantile)
        low, high = (None, None) if one.flip_interval is None else map(value, one.flip_interval)
        # Choices have no order, hence no interval.
        interval = (low, high) if is_number(low) else None
        return Decider(at.key, value(one.flip), one.worth, one.above, interval, one.worth_interval)

    keys, both = [each.key for each in inputs], found.pair
    decision = Decision(
        found.verdict, [keys[place] for place in found.rivals], found.needed, None if both is None else both.interval
    )
    pair = None if both is None else (keys[both.places[0]], keys[both.places[1]], both.worth)
    return [decider(one) for one in found.inputs], pair, decision


def _value(case: Case, one: Input, quantile: float | None) -> Any:
    """Value of an input at a quantile, in its own unit."""
    if quantile is None:
        return None
    (value,) = unknown.values_of(one.law, np.array([quantile]))
    return value if one.law.times is None else value * case.unit(one)
