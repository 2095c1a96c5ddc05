"""Whether the pick beats the baseline over what is not known of the scene, and which unknown input decides it.

Both designs are simulated at the same input sets. Sets of which a gain is in doubt get more replicates, those nearest to
nothing first, until the share of further runs that the study allows is spent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from doe import clearance
from doe.arrays import Array, Whole
from doe.clearance import Simulations
from doe.pareto import Goals
from doe.running.failure import Failure
from doe.study.goals import goals_of
from doe.study.input_sets import Case, case_of, coordinates, run, screened
from doe.study_file import Study
from doe.unknown import laws
from doe.unknown.decision import Better, better, decides, in_doubt
from rbdyn.faults import set_key
from rbdyn.scene.unknown import Input, value_of

# Rounds of further replicates: each as many again as there are, so that a set gets 2, 4, 8 and 16.
ROUNDS, ROUND_SEEDS = 3, 10_000
FRESH = 8192


@dataclass(frozen=True)
class Decider:
    """An unknown input that decides: the value where the better design changes, None where none does, and what knowing it
    is worth in chances of choosing rightly."""

    key: str
    flip: Any
    worth: float


@dataclass(frozen=True)
class Robust:
    """The judgement: ``responses`` with a goal, how likely each and all gains are, deciding inputs by worth, the two
    that are worth most together, how well inputs foretell each gain, what a screening left out, and the cost in runs."""

    responses: list[str]
    better: Better
    decides: list[Decider]
    pair: tuple[str, str, float] | None
    foretold: list[float]
    inputs: list[Input]
    screened: dict[str, float]
    pairs: int
    runs: int
    doubtful: int
    failures: tuple[Failure, ...]


def declared(study: Study) -> bool:
    """Whether the study or its scene declares what is not known."""
    return study.file.uncertain is not None or "uncertain" in clearance.read_scene(study)


def check_robust(study: Study) -> None:
    """Raises InputError where what is not known of the study's scene is declared wrongly."""
    _case(study).copula(_case(study).every)


def judge(study: Study, pick: Array, simulations: Simulations) -> Robust:
    """Judge the pick (k,) beside the baseline. Raises InputError, RunError, KeyboardInterrupt."""
    case, goals = _case(study), goals_of(study)
    inputs, rest = screened(case, simulations)
    factor, seed = case.copula(inputs), case.uncertain.seed
    quantiles = coordinates(len(inputs), study.file.robust.points, seed, factor)
    designs = {"baseline": _at(study, study.baseline), "pick": _at(study, pick)}
    pairs, failures = _simulated(case, inputs, quantiles, designs, simulations, 0, [])
    spent, allowed = 2 * len(pairs.quantiles), round(2 * len(pairs.quantiles) * (1.0 + study.file.robust.settle))
    replicates = case.replicates
    rows = in_doubt(*_gains(goals, pairs)[:2])
    for again in range(ROUNDS):
        # As many replicates again as there are; a run of twice the replicates counts as two.
        many = 2**again
        rows = rows[: max(allowed - spent, 0) // (2 * many)]
        if rows.size == 0:
            break
        more = [f"numerics.replicates={replicates * many}"]
        new, lost = _simulated(
            case, inputs, pairs.quantiles[rows], designs, simulations, (again + 1) * ROUND_SEEDS, more
        )
        rows, spent, failures = rows[new.places], spent + 2 * many * len(rows), (*failures, *lost)
        pairs = pairs.joined(rows, new)
        still = in_doubt(*_gains(goals, pairs)[:2])
        rows = still[np.isin(still, rows)]
    gains, variances, freedom = _gains(goals, pairs)
    found = decides(pairs.quantiles, gains, variances, freedom, coordinates(len(inputs), FRESH, seed + 1, factor), seed)
    return Robust(
        [study.responses[index] for index in goals.objectives],
        better(gains, variances, seed),
        [Decider(inputs[one.place].key, _value(case, inputs[one.place], one.flip), one.worth) for one in found.inputs],
        None if found.pair is None else (inputs[found.pair[0]].key, inputs[found.pair[1]].key, found.pair[2]),
        found.foretold,
        inputs,
        rest,
        len(gains),
        spent,
        int(in_doubt(gains, variances).size),
        failures,
    )


@dataclass(frozen=True)
class _Pairs:
    """Both designs at the same input sets: ``places`` of these in what was asked for, their quantiles (n, d), outputs,
    variances and degrees of freedom (2, n, m)."""

    places: Whole
    quantiles: Array
    outputs: Array
    variances: Array
    freedom: Whole

    def joined(self, rows: Whole, other: "_Pairs") -> "_Pairs":
        """The same, at some rows joined with as many replicates more."""
        outputs, variances, freedom = self.outputs.copy(), self.variances.copy(), self.freedom.copy()
        outputs[:, rows] = 0.5 * (outputs[:, rows] + other.outputs)
        variances[:, rows] = 0.25 * (variances[:, rows] + other.variances)
        freedom[:, rows] += other.freedom + 1
        return replace(self, outputs=outputs, variances=variances, freedom=freedom)


def _simulated(
    case: Case,
    inputs: Sequence[Input],
    quantiles: Array,
    designs: Mapping[str, Sequence[str]],
    simulations: Simulations,
    seeds: int,
    more: Sequence[str],
) -> tuple[_Pairs, tuple[Failure, ...]]:
    """Both designs at input sets; one at which either failed is left out."""
    both = [
        run(
            case,
            inputs,
            quantiles,
            simulations,
            seeds,
            [*design, *more],
            f"input sets of the {name}, from seed {seeds},",
        )
        for name, design in designs.items()
    ]
    first, second = (sets.places for sets in both)
    places = first[np.isin(first, second)]
    kept = [np.flatnonzero(np.isin(sets.places, places)) for sets in both]
    outputs, variances, freedom = (
        np.array([array[rows] for array, rows in zip(arrays, kept, strict=True)])
        for arrays in zip(*((sets.outputs, sets.variances, sets.freedom) for sets in both), strict=True)
    )
    lost = tuple(failure for sets in both for failure in sets.failures)
    return _Pairs(places, quantiles[places], outputs, variances, freedom), lost


def _case(study: Study) -> Case:
    """The study's scene with what is not known of it; factors are known."""
    path = study.beside(study.scene.file)
    data = clearance.read_scene(study)
    for override in study.scene.set:
        set_key(data, override)
    fixed = frozenset(factor.key for factor in study.file.factor)
    return case_of(str(path), data, study.responses, study.file.uncertain, fixed)


def _at(study: Study, point: Array) -> list[str]:
    """Overrides of the scene at factor values (k,)."""
    return [f"{factor.key}={float(x)!r}" for factor, x in zip(study.file.factor, point, strict=True)]


def _gains(goals: Goals, pairs: _Pairs) -> tuple[Array, Array, Whole]:
    """Relative gains of the pick (n, q), their variances, and the degrees of freedom behind these."""
    index = goals.objectives
    scale = np.abs(pairs.outputs[0][:, index])
    before, after = (goals.costs(each) for each in pairs.outputs)
    gains = (before - after) / scale
    noise, other = (each[:, index] for each in pairs.variances)
    # The baseline stands in the denominator too.
    return gains, (other + (1.0 - gains) ** 2 * noise) / scale**2, pairs.freedom[:, :, index].sum(axis=0)


def _value(case: Case, one: Input, quantile: float | None) -> Any:
    """Value of an input at a quantile, in its own unit."""
    if quantile is None:
        return None
    (value,) = laws.values_of(one.law, np.array([quantile]))
    return value if one.law.times is None else value * value_of(case.scene, one.law.times)
