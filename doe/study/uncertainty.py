"""What is not known of a scene and what it does to its outputs: ``doe uncertainty``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from doe.clearance import Simulations
from doe.running.failure import Failure
from doe.study.input_sets import NORMAL, Sets, read_case, run, screened
from doe.threads import one_thread
from doe.unknown.joint import Joint
from doe.unknown.sensitivity import Indices, shapley, sobol
from doe.unknown.spread import Emulated, Runs, Share, Spread, emulated, spread_of
from rbdyn.faults import RunError
from rbdyn.records.words import are, counted
from rbdyn.result import Quantity, SimulationResult
from rbdyn.scene.unknown import Input

OUTPUTS = ("impact_force_N", "whirl_deviation_ratio", "power_loss_W", "cage_speed_rpm")
# Fresh input sets of the emulator, and input sets that are run at most.
FRESH, MOST = 8192, 512
# An end of the range is known whose standard error is below this share of its width, unless another is asked for.
TARGET = 0.1


@dataclass(frozen=True)
class OutputRange:
    """One output: at the scene's own inputs with its errors, its range over what is not known, and which input makes it: by
    Sobol' ``indices``, where inputs depend on each other by ``shapley`` effects, where emulators are not trusted by none.
    ``floor``: what an input seems to make that does nothing."""

    nominal: Quantity
    spread: Spread
    indices: Indices | None = None
    shapley: list[Share] | None = None
    floor: Share | None = None

    @property
    def shares(self) -> list[Share] | None:
        """What each input makes: its total index, or its Shapley effect."""
        return self.shapley if self.indices is None else self.indices.total


@dataclass(frozen=True)
class Uncertainty:
    """Everything a report needs. ``screened``: inputs left at their value, with the largest share that each had in an
    output's main effects."""

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
    until the ends of every range are known to ``target`` of its width. Raises InputError, RunError, KeyboardInterrupt.
    """
    case = read_case(path, OUTPUTS, overrides)
    asked = case.uncertain.points if points is None else points
    (nominal,) = simulations.run([case.scene], ["as the scene says"], simulations.progress("as the scene says"))
    if isinstance(nominal, Failure):
        raise RunError(f"{path}: as the scene says: {nominal.cause}")
    inputs, rest = screened(case, simulations)
    seed = case.uncertain.seed
    joint = case.joint(inputs)
    fresh = joint.sets(FRESH, seed + 1)
    count = asked
    while True:
        sets = run(case, inputs, joint.sets(count, seed), simulations)
        fitted = [_emulated(sets, nominal, place) for place in range(len(OUTPUTS))]
        spreads = [spread_of(runs, each, fresh, seed) for runs, each in fitted]
        if count >= MOST or all(each.known <= target for each in spreads):
            break
        count *= 2
    outputs = {
        name: _output(_quantity(nominal, name), spread, each, joint, seed)
        for name, spread, (_, each) in zip(OUTPUTS, spreads, fitted, strict=True)
    }
    return Uncertainty(path, inputs, rest, outputs, sets, seed, _notes(case.notes, sets, spreads, count, target))


def _emulated(sets: Sets, nominal: SimulationResult, place: int) -> tuple[Runs, Emulated]:
    numerical = _quantity(nominal, OUTPUTS[place]).numerical_error or 0.0
    ran = sets.outputs[:, place], sets.variances[:, place], sets.freedom[:, place]
    runs = Runs(sets.quantiles, *ran, (numerical / NORMAL) ** 2)
    return runs, emulated(runs)


def _quantity(nominal: SimulationResult, name: str) -> Quantity:
    return Quantity.from_dict(nominal.as_dict()[name])


def _output(nominal: Quantity, spread: Spread, fitted: Emulated, joint: Joint, seed: int) -> OutputRange:
    if not spread.by_emulator:
        return OutputRange(nominal, spread)
    if not joint.independent:
        *effects, floor = shapley(fitted, joint, seed)
        return OutputRange(nominal, spread, shapley=effects, floor=floor)
    found = sobol(fitted, joint.inputs + 1, seed)
    return OutputRange(nominal, spread, Indices(found.first[:-1], found.total[:-1]), floor=found.total[-1])


def _notes(of_case: Sequence[str], sets: Sets, spreads: Sequence[Spread], count: int, target: float) -> tuple[str, ...]:
    notes = [*of_case]
    lost = len(sets.failures) + len(sets.impossible)
    if lost:
        why = (*map(str, sets.failures), *sets.impossible)[0]
        notes.append(f"{counted(lost, 'input set')} gave no result and {are(lost)} left out: {why}")
    for name, spread in zip(OUTPUTS, spreads, strict=True):
        if spread.hidden:
            mend = "raise numerics.replicates or numerics.turns in uncertain.set"
            notes.append(f"{name}: noise hides the inputs; {mend}")
        elif not spread.by_emulator:
            notes.append(
                f"{name}: emulators foretell too little of it (Q2 {spread.q2:.2f} of at most {spread.ceiling:.2f}) to say which "
                "input makes it"
            )
        if spread.known > target and not spread.hidden:
            known = f"known to {100.0 * spread.known:.0f} % of its width only"
            notes.append(f"{name}: after {count} input sets an end of its range is {known}")
    return tuple(notes)
