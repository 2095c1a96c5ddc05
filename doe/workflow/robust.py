"""The robust judgement: whether the pick beats the baseline over the unknown inputs, and which input decides it.

Both designs are simulated at the same input sets. Sets with a doubtful gain get more replicates, the smallest gains first,
until the further runs that the study allows are spent. The robust front holds points by their gains over the inputs.
"""

import math
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import replace
from functools import cached_property, reduce
from typing import Any

import numpy as np

from doe.clearance import Simulations
from doe.duty import Duty, points_in
from doe.emulator import NoisyValues
from doe.pareto import Goals, InfeasibleError, ParetoFront, front
from doe.running.runner import Stage
from doe.running.store import Failure
from doe.unknown import inputs as unknown
from doe.unknown.decision import DecisiveInputs, InputWorth, decisive_inputs, gain_chances, in_doubt, odds, shrunk
from doe.unknown.inputs import nested
from doe.unknown.propagation import Emulated, Runs, Share, emulated
from doe.workflow import input_sets
from doe.workflow.judgement import ConfirmedGain, Decider, Decision, GainPoint, Pair, Robust, RobustFront, worded
from doe.workflow.problem import Problem
from rbdyn.base.arrays import Array, Whole, one_thread
from rbdyn.base.estimate import wilson
from rbdyn.base.faults import InputError, key_path, refuse, set_key
from rbdyn.base.records import Record
from rbdyn.scene.unknown import Input, UnknownInput, is_number
from rbdyn.verdict.orbits import BLOCK_TURNS


class Pairs(Record):
    """p designs at the same n input sets.

    ``places`` (n,) of the sets in the plan, their quantiles (n, d), and the outputs (p, n, m).
    ``effort`` (n,): replicates over those of the first runs. Over a ``duty`` outputs are figures at its points.
    ``cages`` (p, n): part of the replicates whose cage has a class that the study allows.
    """

    places: Whole
    quantiles: Array
    outputs: NoisyValues
    effort: Whole
    cages: Array
    duty: Duty | None = None

    @cached_property
    def responses(self) -> NoisyValues:
        """Responses (p, n, m) of the study."""
        if self.duty is None:
            return self.outputs
        designs = map(self.outputs.at, range(len(self.outputs.values)))
        return self.duty.responses(
            self.outputs, np.array([design.smooth(self.quantiles, self.effort) for design in designs])
        )

    def rows(self, rows: Whole) -> "Pairs":
        """The same at these rows; a row may come more than once."""
        outputs = self.outputs.at((slice(None), rows))
        places, cages = self.places[rows], self.cages[:, rows]
        return Pairs(places, self.quantiles[rows], outputs, self.effort[rows], cages, self.duty)

    def joined(self, rows: Whole, other: "Pairs") -> "Pairs":
        """The same with as many replicates more at these rows."""
        outputs, effort, cages = deepcopy(self.outputs), self.effort.copy(), self.cages.copy()
        for array, means in zip(outputs, outputs.at((slice(None), rows)).averaged(other.outputs), strict=True):
            array[:, rows] = means
        effort[rows] *= 2
        cages[:, rows] = 0.5 * (cages[:, rows] + other.cages)
        return replace(self, outputs=outputs, effort=effort, cages=cages)

    def gains(self, goals: Goals, design: int = 1) -> tuple[Array, Array]:
        """Relative gains (n, q) of a design over the first, and their variances.

        The variances are smoothed over the inputs, because those of a row's few replicates scatter widely.
        """
        gains = relative_gains(goals, self.responses.at([0, design]))
        return gains.values, gains.smooth(self.quantiles, self.effort)

    def values(self, response: int, design: int = 1) -> tuple[Array, Array]:
        """Values (n,) of a response of a design, and their variances, smoothed over the inputs like those of gains."""
        figure = self.responses.at(design).at((slice(None), slice(response, response + 1)))
        return figure.values[:, 0], figure.smooth(self.quantiles, self.effort)[:, 0]


def relative_gains(goals: Goals, designs: NoisyValues) -> NoisyValues:
    """Relative gains (n, q) of the second design over the first, of responses (2, n, m)."""
    index = goals.objectives
    scale = np.abs(designs.values[0][:, index])
    base_costs, costs = (goals.costs(design) for design in designs.values)
    gains = (base_costs - costs) / scale
    base_variances, design_variances = (design[:, index] for design in designs.variances)
    # The first design is in the denominator too.
    variances = (design_variances + (1.0 - gains) ** 2 * base_variances) / scale**2
    return NoisyValues(gains, variances, designs.freedom[:, :, index].sum(axis=0))


def simulate_designs(
    case: input_sets.Case,
    quantiles: Array,
    designs: Mapping[str, Sequence[str]],
    simulations: Simulations,
    seeds: int = 0,
    overrides: Sequence[str] = (),
) -> tuple[Pairs, tuple[Failure, ...]]:
    """Simulate designs, each as overrides of the scene, at input sets; sets at which any design failed are left out."""
    shared, title = (case, case.every, quantiles, simulations, seeds), f"input sets of the {{}}, from seed {seeds},"
    sets_of_design = [
        input_sets.run(*shared, [*design, *overrides], title.format(name)) for name, design in designs.items()
    ]
    places = reduce(np.intersect1d, (sets.places for sets in sets_of_design))
    outputs = NoisyValues.stacked([sets.outputs.at(np.isin(sets.places, places)) for sets in sets_of_design])
    failures = tuple(failure for sets in sets_of_design for failure in sets.failures)
    effort = np.ones(len(places), dtype=np.int64)
    cages = np.array([sets.cages[np.isin(sets.places, places)] for sets in sets_of_design])
    return Pairs(places, quantiles[places], outputs, effort, cages, case.duty), failures


JOINT_SEEDS = 200_000
# Input sets over which the search averages, input sets at which points are simulated, and number of these points.
SEARCHED, CONFIRMED, POINTS = 128, 128, 3
POPULATION, GENERATIONS = 60, 40


def find_robust_front(
    study: Problem, case: input_sets.Case, pairs: Pairs, pick: Array, simulations: Simulations
) -> tuple[RobustFront, int, tuple[Failure, ...]]:
    """The front, its number of runs, and its failures; ``pairs``: the baseline and the pick at the study's input sets.

    Raises InputError, RunError, KeyboardInterrupt.
    """
    settings, goals, reach = study.file.robust, study.goals, study.reach
    low, high = study.actual(-reach), study.actual(reach)
    sets, places, rows = _runs(study, case, pairs, (low, high), simulations)
    emulators = _emulators(case, goals, sets, places, pairs.rows(rows), (low, high))
    share = settings.quantile if settings.front == "quantile" else None
    spent, q2 = settings.points, dict(zip(study.aims, (emulator.q2 for emulator in emulators.gain), strict=True))
    try:
        robust_front = front(
            lambda points: emulators.objectives(points, share),
            low,
            high,
            goals=emulators.goals,
            population=POPULATION,
            generations=GENERATIONS,
            seed=study.file.front.seed,
            baseline=study.baseline,
        )
    except InfeasibleError:
        note = "no point meets the limits over the unknown inputs"
        return RobustFront([], [], q2, note), spent, sets.failures
    candidates = {"pick": (pick, "the selected design"), **_choices(study, robust_front, emulators)}
    designs = {"baseline": study.assignments(study.baseline)}
    designs |= {name: study.assignments(point) for name, (point, _) in candidates.items()}
    rows = fresh_rows(settings.points)
    quantiles = case.joint(case.every).sets(1 << int(rows.max()).bit_length(), case.uncertain.seed)[rows]
    fresh_pairs, new_failures = simulate_designs(case, quantiles, designs, simulations)
    confirmed = list[ConfirmedGain]()
    for number, (name, (point, reason)) in enumerate(candidates.items(), 1):
        gains, variances = fresh_pairs.gains(goals, number)
        gained = dict(zip(study.aims, _over_inputs(shrunk(gains, variances), share).tolist(), strict=True))
        odds_of_gains = gain_chances(study.aims, gains, variances, case.uncertain.seed)
        confirmed.append(ConfirmedGain(name, reason, study.by_factor(point), gained, odds_of_gains))
    # The baseline and the pick ran before at the sets that are the study's own.
    spent += CONFIRMED * (len(candidates) - 1) + 2 * int((rows >= settings.points).sum())
    predicted = [
        GainPoint(study.by_factor(point), dict(zip(study.aims, gains, strict=False)))
        for point, gains in zip(robust_front.points, robust_front.values.tolist(), strict=True)
    ]
    return RobustFront(predicted, confirmed, q2), spent, (*sets.failures, *new_failures)


def fresh_rows(points: int) -> Whole:
    """Places of the input sets at which points are simulated: the first half of the study's own, then further ones.

    The emulators see the second half.
    """
    first = min(points // 2, CONFIRMED)
    return np.array([*range(first), *range(points, points + CONFIRMED - first)])


def _runs(
    study: Problem, case: input_sets.Case, pairs: Pairs, box: tuple[Array, Array], simulations: Simulations
) -> tuple[input_sets.Sets, Array, Whole]:
    """Runs of designs spread over the ``box`` at the second half of the study's input sets, as many as there are sets.

    Also the places (n, k) of these designs, from 0 to 1, and the rows (n,) of the pairs at the same input sets.
    """
    points, (low, high) = study.file.robust.points, box
    half = np.flatnonzero(pairs.places >= points // 2)
    even = nested(len(study.factors), points, case.uncertain.seed + 2)
    rows = np.resize(half, points)
    overrides = [study.assignments(point) for point in low + (high - low) * even]
    title = "runs of the robust front"
    sets = input_sets.run(case, case.every, pairs.quantiles[rows], simulations, JOINT_SEEDS, (), title, overrides)
    return sets, even[sets.places], rows[sets.places]


def _emulators(
    case: input_sets.Case, goals: Goals, sets: input_sets.Sets, places: Array, base: Pairs, box: tuple[Array, Array]
) -> "_GainEmulators":
    """Emulators of the gains over the baseline ``base`` at the same input sets, and of limited responses."""
    factors = places.shape[1]
    required = [*range(factors), *(factors + place for place in input_sets.declared(case))]
    cover = factors + case.uncertain.inputs, required
    positions = np.hstack([places, sets.quantiles])
    outputs = NoisyValues.stacked([base.outputs.at(0), sets.outputs])
    effort, cages = np.ones_like(sets.places), np.array([base.cages[0], sets.cages])
    designs = Pairs(sets.places, positions, outputs, effort, cages, base.duty).responses
    columns = zip(*(array.T for array in relative_gains(goals, designs)), strict=True)
    gain = [emulated(Runs(positions, *column), *cover, logarithms=False) for column in columns]
    limit_emulators = [
        emulated(Runs(positions, *designs.at((1, slice(None), index))), *cover) for index, _, _ in goals.limited
    ]
    seed = case.uncertain.seed + 3
    random = np.random.default_rng(seed)
    # One row for all gains, because inputs outside the emulators change them together.
    rows = random.integers(0, len(positions), SEARCHED)
    residuals = np.column_stack([emulator.residuals for emulator in gain])[rows]
    return _GainEmulators(gain, limit_emulators, goals, box, case.joint(case.every).sets(SEARCHED, seed), residuals)


class _GainEmulators(Record, eq=False):
    """Emulators of gains over the baseline and of limited responses, at ``sets`` (s, d + 1) of inputs.

    ``offset`` (s, q): a residual of a run for each set, which is added to the gains. ``box``: ends (k,) of the region.
    """

    gain: Sequence[Emulated]
    limited: Sequence[Emulated]
    study_goals: Goals
    box: tuple[Array, Array]
    sets: Array
    offset: Array

    @property
    def goals(self) -> Goals:
        """Goals of ``objectives``: large gains, and limited responses within their limits."""
        kinds = ["max"] * len(self.study_goals.objectives) + ["none"] * len(self.study_goals.limited)
        ends: dict[str, list[float | None]] = {side: [None] * len(kinds) for side in ("lower", "upper", "weight")}
        ends["weight"][: len(self.study_goals.objectives)] = self.study_goals.cost_weight.tolist()
        for place, (_, sense, limit) in enumerate(self.study_goals.limited, len(self.study_goals.objectives)):
            ends["lower" if sense == ">=" else "upper"][place] = limit
        return Goals.of(kinds, **ends)  # type: ignore[arg-type]

    def gains(self, points: Array) -> Array:
        """Relative gains (n, s, q) at points (n, k)."""
        return self._outputs(self.gain, points) + self.offset

    def objectives(self, points: Array, share: float | None) -> Array:
        """Mean or quantile of the gains at points (n, k), then of each limited response, that towards its limit."""
        columns = [_over_inputs(self.gains(points), share, axis=1)]
        for fitted, (_, sense, _) in zip(self.limited, self.study_goals.limited, strict=True):
            towards = share if share is None or sense == ">=" else 1.0 - share
            columns.append(_over_inputs(self._outputs([fitted], points), towards, axis=1))
        return np.hstack(columns)

    def _outputs(self, fitted: Sequence[Emulated], points: Array) -> Array:
        """Outputs (n, s, e) of emulators at points (n, k) and all sets."""
        low, high = self.box
        coded = np.repeat((points - low) / (high - low), len(self.sets), axis=0)
        positions = np.hstack([coded, np.tile(self.sets, (len(points), 1))])
        return np.stack([emulator(positions).reshape(len(points), -1) for emulator in fitted], axis=-1)


def _over_inputs(values: Array, share: float | None, axis: int = 0) -> Array:
    """Mean over the input sets, or the quantile at ``share``."""
    return values.mean(axis=axis) if share is None else np.quantile(values, share, axis=axis)


def _choices(study: Problem, pareto: ParetoFront, emulators: _GainEmulators) -> dict[str, tuple[Array, str]]:
    """Points of the front that are worth a simulation, by name, with the reason for each."""
    gains = emulators.gains(pareto.points)
    all_gain = (gains > 0.0).all(axis=2).mean(axis=1)
    # Of equally likely points, the one whose smallest gain is largest: an emulator may err in the sign of a gain near 0.
    smallest = np.quantile(gains, 0.05, axis=1).min(axis=1)
    rows: dict[str, int] = {"surest": int(np.lexsort((smallest, all_gain))[-1])}
    rows.update({str(rule): row for rule, row in pareto.picks.items()})
    reasons = {"surest": "the point of the robust front that most probably gains in all responses"}
    candidates: dict[str, tuple[Array, str]] = {}
    for name, row in rows.items():
        point = study.rounded_within(pareto.points[row])
        if len(candidates) < POINTS and not any(np.array_equal(point, other) for other, _ in candidates.values()):
            candidates[f"robust {name}"] = (point, reasons.get(name, f"selected from the robust front by {name}"))
    return candidates


# Rounds of further replicates; each doubles them, so that a set has 2, 4, 8 and 16.
ROUNDS = 3
FRESH = 8192


@one_thread
def judge(study: Problem, pick: Array, simulations: Simulations) -> Robust:
    """Judge the pick (k,) against the baseline. Raises InputError, RunError, KeyboardInterrupt."""
    case, goals = case_of_study(study), study.goals
    joint, seed = case.joint(case.every), case.uncertain.seed
    quantiles = joint.sets(study.file.robust.points, seed)
    designs = {"baseline": study.assignments(study.baseline), "pick": study.assignments(pick)}
    pairs, spent, failures = _pairs_in_rounds(study, case, quantiles, designs, simulations)
    gains, variances = pairs.gains(goals)
    # For the emulators, the effects of the other inputs are scatter.
    places, outside_shares = input_sets.strongest_inputs(case, pairs.quantiles, gains)
    inputs, columns = [case.every[place] for place in places], [*places, -1]
    fresh_sets = joint.sets(FRESH, seed + 1)[:, columns]
    knowable = [place for place, unknown_input in enumerate(inputs) if unknown_input.law.kind == "unknown"]
    analysis = decisive_inputs(pairs.quantiles[:, columns], gains, variances, fresh_sets, seed, knowable)
    front = None
    if study.file.robust.front != "none":
        front, more_runs, new_failures = find_robust_front(study, case, pairs, pick, simulations)
        spent, failures = spent + more_runs, (*failures, *new_failures)
    odds_of_gains = gain_chances(study.aims, gains, variances, seed)
    pair, decision = _decision_by_keys(case, inputs, analysis)
    robust = Robust(
        chances=odds_of_gains,
        undecided=None,
        pair=pair,
        halved=min(max(odds_of_gains.all.value + analysis.halved, 0.0), 1.0),
        front=front,
        explained=dict(zip(study.aims, analysis.explained, strict=True)),
        inputs=[UnknownInput.of(entry) for entry in case.every],
        screened=outside_shares,
        pairs=len(gains),
        runs=points_in(case.duty) * spent,
        doubtful=int(in_doubt(gains, variances).size),
        failures=failures,
        odds=limit_odds(study, pairs, seed),
    )
    notes = (*case.notes, *input_sets.run_notes(case, study.scene.set, "scene.set: ", "other runs of the study"))
    return worded(robust, decision, notes)


def _pairs_in_rounds(
    study: Problem,
    case: input_sets.Case,
    quantiles: Array,
    designs: Mapping[str, Sequence[str]],
    simulations: Simulations,
) -> tuple[Pairs, int, tuple[Failure, ...]]:
    """Both designs at the input sets, with further replicates where a gain is in doubt; runs spent; and failures."""
    goals, replicates = study.goals, case.replicates
    pairs, failures = simulate_designs(case, quantiles, designs, simulations)
    spent, budget = 2 * len(pairs.quantiles), round(2 * len(pairs.quantiles) * (1.0 + study.file.robust.settle))
    rows = in_doubt(*pairs.gains(goals))
    for round_number in range(ROUNDS):
        # The replicates double, and a run of twice the replicates counts as two.
        multiple = 2**round_number
        rows = rows[: max(budget - spent, 0) // (2 * multiple)]
        if rows.size == 0:
            break
        overrides = [f"numerics.replicates={replicates * multiple}"]
        seeds = (round_number + 1) * input_sets.ROUND_SEEDS
        quantiles = pairs.quantiles[rows]
        new_pairs, new_failures = simulate_designs(case, quantiles, designs, simulations, seeds, overrides)
        rows, spent, failures = rows[new_pairs.places], spent + 2 * multiple * len(rows), (*failures, *new_failures)
        pairs = pairs.joined(rows, new_pairs)
        doubtful = in_doubt(*pairs.gains(goals))
        rows = doubtful[np.isin(doubtful, rows)]
    return pairs, spent, failures


def limit_odds(study: Problem, pairs: Pairs, seed: int) -> dict[str, Share]:
    """By limited response, the probability that the pick, the second design, keeps its limits over the unknown inputs.

    That of the class of the cage is the mean part of the replicates that have one, with Wilson's interval of as many cases as input sets.
    """
    goals, limits, kept = study.goals, study.file.limits, float(pairs.cages[1].mean())
    of_class = {limits.share_of_classes: Share(kept, *wilson(kept, len(pairs.places)))} if limits.classes else {}
    return of_class | {
        study.responses[index]: odds(*pairs.values(index), float(goals.lower[index]), float(goals.upper[index]), seed)
        for index in sorted({index for index, _, _ in goals.limited})
    }


def case_of_study(study: Problem) -> input_sets.Case:
    """The study's scene with its unknown inputs; factors are none of them."""
    path = study.path_of(study.scene.file)
    data = deepcopy(study.scene_tables)
    for override in study.scene.set:
        set_key(data, override, f"{study.path}: scene.set")
    keys = [factor.key for factor in study.file.factor]
    duty = study.duty_with_groups
    fixed = dict.fromkeys([] if duty is None else duty.keys, "a key of the duty")
    fixed |= dict.fromkeys(keys, "a factor of the study")
    case = input_sets.case_of(str(path), data, study.responses, study.file.uncertain, fixed, study.path)
    if duty is not None:
        case = replace(case, outputs=tuple(duty.columns), duty=duty)
        refuse(input_sets.impossible(case))
    classes, sets, declared_runs = study.file.limits.classes, case.scene_of_sets, case.uncertain
    if classes and sets.cage_turns < BLOCK_TURNS:
        others = [text for text in declared_runs.set if key_path(text) != ("numerics", "turns")]
        if "set" in declared_runs.model_fields_set and len(others) < len(declared_runs.set):
            raise InputError(
                f"{case.home}: uncertain.set: input sets of {sets.cage_turns:.3g} cage turns are shorter than the {BLOCK_TURNS} that "
                "limits.cage.verdict needs; set numerics.turns there to more"
            )
        turns = math.ceil(sets.numerics.turns * BLOCK_TURNS / sets.cage_turns)
        longer = declared_runs.model_copy(update={"set": [*others, f"numerics.turns={turns}"]})
        case = replace(case, uncertain=longer)
    return replace(case, classes=classes)


def _decision_by_keys(
    case: input_sets.Case, inputs: Sequence[Input], analysis: DecisiveInputs
) -> tuple[Pair | None, Decision]:
    """The best pair and the decision, by keys and values of the inputs."""

    def decider(deciding: InputWorth) -> Decider:
        deciding_input = inputs[deciding.place]
        low, high = (_value(case, deciding_input, quantile) for quantile in deciding.flip_interval or (None, None))
        return Decider.from_attributes(
            deciding,
            key=deciding_input.key,
            flip=_value(case, deciding_input, deciding.flip),
            pick_above=deciding.above,
            # Choices have no order, and so no interval.
            flip_interval=(low, high) if is_number(low) else None,
        )

    keys, best = [unknown_input.key for unknown_input in inputs], analysis.pair
    pair = None if best is None else Pair((keys[best.places[0]], keys[best.places[1]]), best.worth, best.interval)
    rivals = [keys[place] for place in analysis.rivals]
    return pair, Decision(
        [decider(deciding) for deciding in analysis.inputs], analysis.verdict, rivals, analysis.needed
    )


def _value(case: input_sets.Case, unknown_input: Input, quantile: float | None) -> Any:
    """Value of an input at a quantile, in the unit of its key; None without a quantile."""
    if quantile is None:
        return None
    (value,) = unknown.values_of(unknown_input.law, np.array([quantile]))
    return value if unknown_input.law.times is None else value * case.unit(unknown_input)


def robust_stage(study: Problem) -> Stage:
    """The stage of a robust judgement: input sets of both designs, further replicates, the front and its simulations."""
    settings, case = study.file.robust, case_of_study(study)
    fewest, runs = 2 * settings.points, round(2 * settings.points * (1.0 + settings.settle))
    if settings.front != "none":
        new_sets = int((fresh_rows(settings.points) >= settings.points).sum())
        fewest += settings.points
        runs += settings.points + POINTS * CONFIRMED + 2 * new_sets
    titles = "input sets", "runs of the robust front"
    points = points_in(case.duty)
    return Stage.of("robust", points * runs, input_sets.work_of_set(case), *titles, fewest=points * fewest)
