"""Unknown inputs of a scene and what they do to its outputs: ``doe uncertainty``."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from doe.clearance import Simulations
from doe.running.store import Failure
from doe.threads import one_thread
from doe.unknown.propagation import (
    Emulated,
    Indices,
    Runs,
    Share,
    Spread,
    emulated,
    explained,
    residual_variance,
    shapley,
    sobol,
    spread_of,
)
from doe.workflow.input_sets import NORMAL, Case, Sets, declared, outside, overriding, read_case, replicated
from rbdyn.base.arrays import Array
from rbdyn.base.faults import RunError
from rbdyn.base.words import are, counted
from rbdyn.result import Quantity, SimulationResult
from rbdyn.scene.unknown import Input

OUTPUTS = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm")
# Fresh input sets of the emulator, and input sets that are run at most.
FRESH, MOST = 8192, 512
# An end of the range is known whose standard error is below this share of its width, unless another is asked for.
TARGET = 0.1
# Share of noise in the variance of an output's single runs beyond which all get more replicates, and how many times as many.
NOISY, MOST_EFFORT = 0.1, 4
# Share of the variance that an emulator must explain before nothing is said of the rest.
WHOLE = 0.9


@dataclass(frozen=True)
class OutputRange:
    """One output: at the scene's own inputs with its errors, its range over all unknown inputs, and which input makes it: by
    Sobol' ``indices``, where inputs depend on each other by ``shapley`` effects, where emulators are not trusted by none; both
    in the order of ``keys``, the inputs of its emulator, as shares of the variance over all inputs, of which these together
    make ``explained``. ``floor``: what an input seems to make that does nothing."""

    nominal: Quantity
    spread: Spread
    keys: list[str]
    explained: float
    indices: Indices | None = None
    shapley: list[Share] | None = None
    floor: Share | None = None

    @property
    def shares(self) -> list[Share] | None:
        """What each input makes: its total index, or its Shapley effect."""
        return self.shapley if self.indices is None else self.indices.total


@dataclass(frozen=True)
class Uncertainty:
    """Everything a report needs. ``inputs``: all vary in every set; ``screened``: those of no emulator, with the largest share
    of an output's variance that the main effect of each makes."""

    path: Path
    inputs: list[Input]
    screened: Mapping[str, float]
    outputs: Mapping[str, OutputRange]
    sets: Sets
    seed: int
    notes: tuple[str, ...]


@one_thread
def find_uncertainty(
    path: Path, overrides: Sequence[str], simulations: Simulations, points: int | None = None, target: float = TARGET
) -> Uncertainty:
    """Range of every output of a scene over its unknown inputs, and which of them makes it.

    ``points``: input sets to start from, a power of two, as the scene says where left out; they are doubled, up to 512,
    until the ends of every range are known to ``target`` of its width. Where noise is more than a tenth of an output's variance
    all sets get more replicates. Raises InputError, RunError, KeyboardInterrupt.
    """
    case = read_case(path, OUTPUTS, overrides)
    count = case.uncertain.points if points is None else points
    (nominal,) = simulations.run([case.scene], ["as the scene says"], simulations.progress("as the scene says"))
    if isinstance(nominal, Failure):
        raise RunError(f"{path}: as the scene says: {nominal.cause}")
    seed, joint, effort = case.uncertain.seed, case.joint(case.every), 1
    fresh = joint.sets(FRESH, seed + 1)
    while True:
        sets = replicated(case, joint.sets(count, seed), simulations, effort)
        fitted = [_emulated(case, sets, nominal, place) for place in range(len(OUTPUTS))]
        spreads = [spread_of(runs, each, fresh, seed) for runs, each in fitted]
        if effort < MOST_EFFORT and any(each.variance["simulation"] > NOISY for each in spreads):
            effort *= 2
        elif count < MOST and any(each.known > target for each in spreads):
            count *= 2
        else:
            break
    outputs = {
        name: _output(case, _quantity(nominal, name), spread, each, fresh)
        for name, spread, (_, each) in zip(OUTPUTS, spreads, fitted, strict=True)
    }
    covers = {place for _, each in fitted for place in each.columns.tolist()}
    rest = outside(case, covers, sets.quantiles, sets.signals)
    notes = _notes(
        [*case.notes, *overriding(case, overrides, "the run at the scene's own inputs")], sets, outputs, count, target
    )
    return Uncertainty(path, case.every, rest, outputs, sets, seed, notes)


def _emulated(case: Case, sets: Sets, nominal: SimulationResult, place: int) -> tuple[Runs, Emulated]:
    numerical = _quantity(nominal, OUTPUTS[place]).numerical_error or 0.0
    ran = sets.outputs[:, place], sets.variances[:, place], sets.freedom[:, place]
    runs = Runs(sets.quantiles, *ran, (numerical / NORMAL) ** 2)
    return runs, emulated(runs, case.uncertain.inputs, declared(case))


def _quantity(nominal: SimulationResult, name: str) -> Quantity:
    return Quantity.from_dict(nominal.as_dict()[name])


def _output(case: Case, nominal: Quantity, spread: Spread, fitted: Emulated, fresh: Array) -> OutputRange:
    inputs = [case.every[place] for place in fitted.columns[:-1]]
    made = explained(fitted, fitted(fresh), residual_variance(fitted.emulator))
    known, seed = (nominal, spread, [each.key for each in inputs], made), case.uncertain.seed
    if not spread.by_emulator:
        return OutputRange(*known)
    joint = case.joint(inputs)
    if not joint.independent:
        *effects, floor = shapley(fitted, joint, seed)
        return OutputRange(*known, shapley=effects, floor=floor)
    found = sobol(fitted, joint.inputs + 1, seed)
    return OutputRange(*known, Indices(found.first[:-1], found.total[:-1]), floor=found.total[-1])


def _notes(
    before: Collection[str], sets: Sets, outputs: Mapping[str, OutputRange], count: int, target: float
) -> tuple[str, ...]:
    notes = [*before]
    lost = len(sets.failures) + len(sets.impossible)
    if lost:
        why = (*map(str, sets.failures), *sets.impossible)[0]
        notes.append(f"{counted(lost, 'input set')} gave no result and {are(lost)} left out: {why}")
    for name, output in outputs.items():
        spread = output.spread
        if spread.hidden:
            notes.append(
                f"{name}: simulation noise exceeds the effect of the inputs; raise numerics.replicates or "
                "numerics.turns in uncertain.set"
            )
        elif not spread.by_emulator:
            notes.append(
                f"{name}: its emulator predicts too little (Q2 {spread.q2:.2f} of at most {spread.ceiling:.2f}) to "
                "say which input makes it"
            )
        elif output.explained < WHOLE:
            notes.append(
                f"{name}: the inputs named make {100.0 * output.explained:.0f} % of its variance; other inputs "
                "and what the emulator misses make the rest"
            )
        if spread.known > target and not spread.hidden:
            notes.append(
                f"{name}: after {count} input sets an end of its range is known to {100.0 * spread.known:.0f} % of "
                "its width only"
            )
    return tuple(notes)
