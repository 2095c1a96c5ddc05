"""Replicates that run until their figures have settled.

Replicates start in groups from states that are clearly different. A run has settled where the groups agree, and the later half
of the counted turns with the earlier one, within the error of a figure or a hundredth of it (``error_bars``). Until then every
replicate goes on until it is twice as long, and again, up to ``numerics.extend_limit`` times the turns asked for; each time the
last half counts. Companions run just as far. Nothing depends on the clock or on the number of threads.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple, Protocol

from rbdyn.base.faults import RunError
from rbdyn.base.notes import Note, Notes
from rbdyn.dynamics.ensemble import Outcome, Pace, Reporter, Stop, in_turn, run_all
from rbdyn.dynamics.recording import batches_of
from rbdyn.dynamics.statistics.error_bars import settled, start_of_counting
from rbdyn.dynamics.statistics.metrics import Companions, companions_of
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene


class Stage(NamedTuple):
    """Length of the replicates: batch from which they count, turns after the warm-up, and whether they were lengthened."""

    first: int
    turns: float
    lengthened: bool = False


@dataclass(frozen=True)
class Ensemble:
    """Replicates and companions as they are counted, and the ``plan`` by which companions are integrated.

    ``since``: batch from which they would count if they had settled at once; ``fault``: why companions that were asked for are missing;
    ``transient_turns``: shaft turns of the transient, None where it is unknown; ``notes``: on the length of the runs.
    """

    runs: list[Replicate]
    companions: list[Replicate]
    plan: Companions
    since: int
    fault: str | None
    transient_turns: float | None
    notes: Notes


# Factor by which a run that has not settled gets longer.
GROWTH = 2.0


class Growing(Protocol):
    """A replicate that can always go on, such as a recording."""

    def to(self, counted: float, /) -> Replicate:
        """Go on until so many turns after the warm-up [shaft turns]. Raises RunError or CancelledError."""
        ...


# Begins a replicate, or a companion where a plan says how.
Start = Callable[[int, Companions | None, Stop], Growing]


def run_until_settled(
    scene: Scene, start: Start, workers: int | None, progress: Reporter, stop: Stop, pace: Pace | None = None
) -> Ensemble:
    """Run the replicates of a scene until they have settled, then their companions just as far.

    ``pace``: hears of runs that get longer. Raises RunError when a replicate cannot go on, KeyboardInterrupt.
    """
    numerics = scene.numerics
    team = Team(start, range(numerics.replicates), None, workers, stop, progress, numerics.companions)
    stage = Stage(-1, whole_windows(scene) if scene.extends else numerics.turns)
    begin = None
    while True:
        runs = team.to(stage.turns)
        if begin is None:
            begin = start_of_counting(scene, runs)
            stage = stage._replace(first=begin.first)
        runs = [run.counted_from(stage.first) for run in runs]
        longer = next_stage(scene, runs, stage, begin.first) if scene.extends else None
        if longer is None:
            break
        if pace is not None:
            more = in_turn(scene, pace.threads, longer.turns - stage.turns)
            pace.lengthen(more, numerics.warm_up_turns + longer.turns)
        stage = longer
    notes = (*begin.notes, *length_notes(scene, runs, stage, begin.first))
    plan = companions_of(scene, runs)
    if not numerics.companions:
        return Ensemble(runs, [], plan, begin.first, None, begin.turns, notes)
    others = Team(start, range(numerics.companions), plan, workers, Stop(outer=stop), progress, 0, team.ended)
    try:
        companions = [run.counted_from(stage.first) for run in others.to(stage.turns)]
    except RunError as error:
        fault = f"a companion at numerics.rtol = {plan.rtol:g} could not continue ({error})"
        return Ensemble(runs, [], plan, begin.first, fault, begin.turns, notes)
    return Ensemble(runs, companions, plan, begin.first, None, begin.turns, notes)


@dataclass
class Team:
    """Recordings that go on together, in threads.

    The progress has counted ``ended`` runs so far, and counts runs ``to_come`` of other teams.
    """

    start: Start
    replicates: range
    plan: Companions | None
    workers: int | None
    stop: Stop
    progress: Reporter
    to_come: int
    ended: int = 0
    recordings: dict[int, Growing] = field(default_factory=dict)

    def to(self, turns: float) -> list[Replicate]:
        """All of them after so many turns past the warm-up. Raises RunError, KeyboardInterrupt."""
        total = self.ended + len(self.replicates) + self.to_come
        runs: dict[int, Replicate] = {}

        def go_on(replicate: int) -> Replicate:
            if replicate not in self.recordings:
                self.recordings[replicate] = self.start(replicate, self.plan, self.stop)
            return self.recordings[replicate].to(turns)

        def collect(outcome: Outcome[Replicate]) -> None:
            runs[outcome.place] = outcome.result()
            self.ended += 1
            if self.progress is not None:
                self.progress(self.ended, total)

        run_all([partial(go_on, replicate) for replicate in self.replicates], self.workers, self.stop, collect)
        return [runs[place] for place in range(len(self.replicates))]


def whole_windows(scene: Scene) -> float:
    """The turns that a scene counts, rounded up to whole impact windows."""
    window = scene.impact_window_turns
    return math.ceil(scene.numerics.turns / window - 1e-9) * window


def next_stage(scene: Scene, runs: Sequence[Replicate], stage: Stage, since: int) -> Stage | None:
    """How to go on from counted ``runs``: None where they have settled, or beyond the scene's limit or memory.

    The runs first make up for turns that ``discard_turns = "auto"`` takes from those counted.
    """
    numerics, window = scene.numerics, scene.impact_window_turns
    warm_up, batches = numerics.warm_up_turns, batches_of(scene)
    longest = numerics.extend_limit * (warm_up + numerics.turns) * (1.0 + 1e-9)
    missing = numerics.turns - runs[0].duration / scene.turn_s
    if missing > 1e-6 * numerics.turns:
        most = math.floor((longest - warm_up) / window + 1e-9) * window
        longer = stage._replace(turns=min(stage.turns + math.ceil(missing / window - 1e-9) * window, most))
        return longer if longer.turns > stage.turns and fits(scene, longer.turns) else None
    if settled(runs, since):
        return None
    turns = grown(scene, stage)
    if warm_up + turns > longest or not fits(scene, turns):
        return None
    counted = math.ceil(0.5 * (warm_up + turns) / window) * batches.per_window
    return Stage(batches.count(turns) - counted, turns, lengthened=True)


def grown(scene: Scene, stage: Stage) -> float:
    """Turns after the warm-up, in whole windows, of a run lengthened once more."""
    warm_up, window = scene.numerics.warm_up_turns, scene.impact_window_turns
    return math.ceil((GROWTH * (warm_up + stage.turns) - warm_up) / window - 1e-9) * window


def fits(scene: Scene, turns: float) -> bool:
    """Whether all replicates and companions have memory for so many turns after the warm-up."""
    return batches_of(scene).count(turns) <= scene.numerics.most_batches


def length_notes(scene: Scene, runs: Sequence[Replicate], stage: Stage, since: int) -> Notes:
    """Notes on the length of the runs and on the turns that count."""
    numerics, turn_s = scene.numerics, scene.turn_s
    notes, counted = list[Note](), runs[0].duration / turn_s
    if stage.lengthened:
        dropped = float(runs[0].durations[: stage.first].sum()) / turn_s
        sentence = (
            f"length: figures drifted: {dropped + counted:.4g} shaft turns per replicate instead of "
            f"{numerics.warm_up_turns + numerics.turns:.4g}; the last {counted:.4g} are counted (numerics.extend = false "
            "forbids it)"
        )
        notes.append(Note("lengthened", sentence))
    if scene.operation.schedule is None and not settled(runs, since):
        fix = (
            "raise numerics.extend_limit" if scene.extends else "lengthen numerics.turns or set numerics.extend = true"
        )
        if not fits(scene, grown(scene, stage)):
            fix = "take fewer replicates: there is no memory for longer ones"
        sentence = (
            f"transient: figures still drift over the {counted:.4g} turns counted, or differ by how replicates start, so no "
            f"statistical error is known; {fix}"
        )
        notes.append(Note("drift", sentence))
    return tuple(notes)
