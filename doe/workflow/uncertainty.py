"""Ranges of a scene's outputs over its unknown inputs, and the share of each input: ``doe uncertainty``."""

from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from doe.clearance import Simulations, responses_of, work_of
from doe.duty import Simulated
from doe.running.runner import ANSWER, Stage
from doe.running.store import Failure
from doe.unknown import propagation
from doe.workflow import input_sets
from doe.workflow.input_sets import Case, Sets, declared, override_notes, replicated_sets
from rbdyn.base.arrays import Array, one_thread
from rbdyn.base.faults import LONGEST_NAME, RunError, one_line, refuse
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record, derived, outside_json, spread
from rbdyn.base.words import NORMAL, are, counted
from rbdyn.dynamics.figures import FIGURES, of_kind, why_missing
from rbdyn.result import TEMPERATURES, Quantity
from rbdyn.scene.unknown import UnknownInput

# Outputs of every scene; those with a heat balance also have their temperatures, those with a start its least clearances.
OUTPUTS = tuple(figure.key for figure in FIGURES if figure.judged)
# Fresh input sets of the emulator, and most input sets that run.
FRESH, MOST = 8192, 512
# Default of the standard error of a range's end, as a share of the range's width.
TARGET = 0.1
# Share of noise in an output's variance beyond which all runs get more replicates, and the largest factor on these.
NOISY, MOST_EFFORT = 0.1, 4
# Range of an output that does not vary, as a share of it.
STILL = 1e-9
# Share of the variance that an emulator explains; a smaller one has a note.
WHOLE = 0.9


class OutputRange(Record):
    """One output: its ``nominal`` value at the scene's own inputs, its range over all unknown inputs, and variances by cause.

    The share of each input of its emulator is a Sobol' index, ``first`` and ``total``, or a ``shapley`` effect if inputs depend on
    each other; all are None unless the emulator is ``trusted``. ``floor``: apparent share of an input without effect. ``q2``, ``ceiling``:
    share of the variance that the emulator predicts, and the most possible; ``explained``: share that its inputs explain.
    """

    nominal: Quantity = spread()
    input: propagation.Range
    variance: propagation.VarianceShares
    first: dict[str, propagation.Share] | None
    total: dict[str, propagation.Share] | None
    shapley: dict[str, propagation.Share] | None
    floor: propagation.Share | None
    q2: float
    ceiling: float
    trusted: bool
    name: str = outside_json()
    explained: float = outside_json()

    @property
    def hidden(self) -> bool:
        """Whether simulation noise exceeds the effect of the inputs."""
        return self.variance.inputs == 0.0

    @property
    def shares(self) -> dict[str, propagation.Share]:
        """Share of each input, its total index or its Shapley effect; empty where they are unknown."""
        return self.total or self.shapley or {}


class Uncertainty(Record, kw_only=True):
    """Ranges of a scene's outputs by name. ``inputs``: all unknown inputs, which vary in every set of ``sets``.

    ``screened``: by key of the inputs outside all emulators, the largest share of an output's variance by the main effect.
    """

    format: str = derived(lambda self: "doe.uncertainty/2")
    scene: str
    responses: dict[str, OutputRange]
    inputs: list[UnknownInput]
    screened: dict[str, float]
    runs: int = derived(lambda self: len(self.sets.places))
    failed: int = derived(lambda self: len(self.sets.failures) + len(self.sets.impossible))
    seed: int
    notes: Notes
    sets: Sets = outside_json()

    @property
    def keys(self) -> list[str]:
        """Inputs of the emulators."""
        return [entry.key for entry in self.inputs if entry.key not in self.screened]


@one_thread
def find_uncertainty(
    path: Path,
    overrides: Sequence[str],
    simulations: Simulations,
    points: int | None = None,
    target: float = TARGET,
    figures: Sequence[str] = (),
) -> Uncertainty:
    """Range of each output of a scene over its unknown inputs, and the share of each input.

    ``points``: input sets to begin with, a power of two; by default those of the scene. They double, up to 512, until the
    standard errors of the ends of every range are below ``target`` of its width. If noise is more than a tenth of an
    output's variance, all sets get more replicates. ``figures``: further outputs. Raises InputError, RunError, KeyboardInterrupt.
    """
    case = _case_of(path, overrides, figures)
    count = case.uncertain.points if points is None else points
    (nominal,) = simulations.run([case.scene], ["scene values"], simulations.progress("scene values"))
    if isinstance(nominal, Failure):
        raise RunError(f"{path}: at the scene values: {nominal.cause}")
    refuse(
        f"--figure {name}: {path} does not give it; leave it out"
        for name in case.outputs
        if name not in nominal.responses
    )
    seed, joint, effort = case.uncertain.seed, case.joint(case.every), 1
    fresh_sets, idle = joint.sets(FRESH, seed + 1), dict[str, float]()
    while True:
        case, sets = _varying(case, replicated_sets(case, joint.sets(count, seed), simulations, effort), idle)
        fitted = [_emulated(case, sets, nominal, place) for place in range(len(case.outputs))]
        ranges = [propagation.range_of(emulator, fresh_sets, seed) for _, emulator in fitted]
        if effort < MOST_EFFORT and any(propagation.variance_by_cause(*pair).simulation > NOISY for pair in fitted):
            effort *= 2
        elif count < MOST and any(interval.relative_error > target for interval in ranges):
            count *= 2
        else:
            break
    outputs = [
        _output(case, nominal, name, interval, *pair, fresh_sets)
        for name, interval, pair in zip(case.outputs, ranges, fitted, strict=True)
    ]
    covered_places = {place for _, emulator in fitted for place in emulator.columns.tolist()}
    outside_shares = input_sets.shares_outside(case, covered_places, sets.quantiles, sets.signals)
    still = "in every input set, because no unknown input changes it"
    idle_notes = [Note("remark", f"{name}: it is {value:.5g} {still}") for name, value in idle.items()]
    further = override_notes(case, overrides, "the run at the scene's own inputs")
    notes = _notes([*idle_notes, *case.notes, *further], sets, outputs, count, target)
    return Uncertainty(
        scene=str(path),
        responses={output.name: output for output in outputs},
        inputs=[UnknownInput.of(entry) for entry in case.every],
        screened=outside_shares,
        seed=seed,
        notes=notes,
        sets=sets,
    )


def _case_of(path: Path, overrides: Sequence[str], figures: Sequence[str] = ()) -> Case:
    """The scene with its unknown inputs and outputs, ``figures`` among them. Raises InputError."""
    case = input_sets.read_case(path, OUTPUTS, overrides)
    names = responses_of(case.scene.thermal is not None)
    refuse(
        f"--figure {one_line(name, LONGEST_NAME)}: not a result of this scene; choose one of {', '.join(names)}"
        for name in figures
        if name not in names
    )
    heat = () if case.scene.thermal is None else tuple(TEMPERATURES)
    least = (figure.key for figure in of_kind("start") if figure.worst == "least")
    plays = (key for key in least if why_missing(case.scene, key) is None)
    return replace(case, outputs=tuple(dict.fromkeys((*OUTPUTS, *heat, *plays, *figures))))


def _varying(case: Case, sets: Sets, idle: dict[str, float]) -> tuple[Case, Sets]:
    """The case and its sets with the outputs that vary; those that are one number in all sets are put into ``idle``."""
    values = sets.outputs.values
    varies = np.ptp(values, axis=0) > STILL * np.abs(values).max(axis=0)
    idle |= {name: float(values[0, place]) for place, name in enumerate(case.outputs) if not varies[place]}
    names = tuple(name for name, varying in zip(case.outputs, varies, strict=True) if varying)
    return replace(case, outputs=names), replace(sets, outputs=sets.outputs.at((slice(None), varies)))


def _emulated(case: Case, sets: Sets, nominal: Simulated, place: int) -> tuple[propagation.Runs, propagation.Emulated]:
    numerical = nominal.responses[case.outputs[place]].numerical_error or 0.0
    runs = propagation.Runs(sets.quantiles, *sets.outputs.at((slice(None), place)), (numerical / NORMAL) ** 2)
    return runs, propagation.emulated(runs, case.uncertain.inputs, declared(case))


def _output(
    case: Case,
    nominal: Simulated,
    name: str,
    interval: propagation.Range,
    runs: propagation.Runs,
    fitted: propagation.Emulated,
    fresh_sets: Array,
) -> OutputRange:
    inputs, seed = [case.every[place] for place in fitted.columns[:-1]], case.uncertain.seed
    by_key = dict[str, dict[str, propagation.Share] | None](first=None, total=None, shapley=None)
    floor, joint = None, case.joint(inputs)
    if fitted.trusted:
        effects = propagation.sobol(fitted, joint.inputs + 1, seed)._asdict() if joint.independent else {}
        effects = effects or {"shapley": propagation.shapley(fitted, joint, seed)}
        # The last is that of an input without effect.
        by_key |= {
            kind: dict(zip((entry.key for entry in inputs), shares, strict=False)) for kind, shares in effects.items()
        }
        floor = (effects.get("total") or effects["shapley"])[-1]
    return OutputRange.from_attributes(
        fitted,
        nominal=nominal.responses[name],
        input=interval,
        variance=propagation.variance_by_cause(runs, fitted),
        **by_key,
        floor=floor,
        name=name,
        explained=propagation.explained(fitted, fitted(fresh_sets), propagation.residual_variance(fitted.emulator)),
    )


def _notes(
    case_notes: Collection[Note], sets: Sets, outputs: Sequence[OutputRange], count: int, target: float
) -> Notes:
    notes = [*case_notes]
    lost_sets = len(sets.failures) + len(sets.impossible)
    if lost_sets:
        cause = (*map(str, sets.failures), *sets.impossible)[0]
        lost = f"{counted(lost_sets, 'input set')} gave no result and {are(lost_sets)} left out: {cause}"
        notes.append(Note("lost-runs", lost))
    for output in outputs:
        name, error, sentence = output.name, output.input.relative_error, ""
        if output.hidden:
            sentence = (
                f"{name}: simulation noise exceeds the effect of the inputs; raise numerics.replicates or "
                "numerics.turns in uncertain.set"
            )
        elif not output.trusted:
            sentence = (
                f"{name}: its emulator predicts too little (Q2 {output.q2:.2f} of at most {output.ceiling:.2f}) to "
                "give the shares of inputs"
            )
        elif output.explained < WHOLE:
            sentence = (
                f"{name}: the inputs named explain {100.0 * output.explained:.0f} % of its variance; the rest is other "
                "inputs and the error of the emulator"
            )
        notes += [Note("emulator", sentence)] if sentence else []
        if error > target and not output.hidden:
            sentence = (
                f"{name}: after {count} input sets the standard error of an end of its range is "
                f"{100.0 * error:.0f} % of its width"
            )
            notes.append(Note("emulator", sentence))
    return tuple(notes)


def uncertainty_stages(path: Path, overrides: Sequence[str], points: int | None) -> list[Stage]:
    """Stages of ``doe uncertainty`` with ``points`` input sets, by default those of the scene. Raises InputError.

    The sets and their replicates may double later.
    """
    case = _case_of(path, overrides)
    count = case.uncertain.points if points is None else points
    return [
        Stage.of("scene values", 1, work_of(case.scene)),
        Stage.of("input sets", count, input_sets.work_of_set(case), most=MOST_EFFORT * max(count, MOST)),
        Stage(ANSWER),
    ]
