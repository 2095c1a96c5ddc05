"""Whether the pick beats the baseline over what is not known of the scene, and which unknown input decides it.

Both designs are simulated at the same input sets. Sets of which a gain is in doubt get more replicates, those nearest to
nothing first, until the share of further runs that the study allows is spent.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from doe import clearance
from doe.arrays import Array
from doe.clearance import Simulations
from doe.running.store import Failure
from doe.study.goals import goals_of
from doe.study.input_sets import ROUND_SEEDS, Case, case_of, run_notes, strongest
from doe.study.pairs import Pairs, simulated
from doe.study.robust_front import RobustFront, find_robust_front
from doe.study_file import Study
from doe.threads import one_thread
from doe.unknown import inputs as unknown
from doe.unknown.decision import Better, better, in_doubt, odds
from doe.unknown.propagation import Share
from doe.unknown.worth import Decides, Deciding, Interval, Verdict, decides
from rbdyn.faults import set_key
from rbdyn.scene.unknown import Input, is_number

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
    that are worth most together, how well inputs foretell each gain, by how much the chance of all gains changes with ranges
    half as wide, the front of points that hold over the inputs, None where the study wants none, the inputs, which all vary in
    every set, ``screened``: those that no emulator of a gain covers, with the largest share that the main effect of each makes of
    a gain, the cost in runs, the ``decision`` which of the deciding inputs is first, notes: what is to be doubted of a posterior
    sample, which keys do not vary, and the ``odds`` that the pick keeps all limits of a response, by its name."""

    responses: list[str]
    better: Better
    decides: list[Decider]
    pair: tuple[str, str, float] | None
    foretold: list[float]
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
    """Where the scene names estimates, what a judgement over them would tell and cost; else nothing."""
    if "uncertain" not in clearance.read_scene(study):
        return []
    runs = round(2 * study.file.robust.points * (1.0 + study.file.robust.settle))
    return [
        "the scene names values that are estimates: --robust tells in how many of 100 cases the pick is better in spite of "
        f"them, by {runs} short simulations and more for a front; doe uncertainty tells what they do to each figure"
    ]


def check_robust(study: Study) -> None:
    """Raises InputError where what is not known of the study's scene is declared wrongly."""
    case_of_study(study)


@one_thread
def judge(study: Study, pick: Array, simulations: Simulations) -> Robust:
    """Judge the pick (k,) beside the baseline. Raises InputError, RunError, KeyboardInterrupt."""
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
    """The study's scene with what is not known of it; factors are known."""
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
