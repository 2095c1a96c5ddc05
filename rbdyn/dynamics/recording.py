"""One replicate recorded in equal batches of about a shaft turn, from its start until its figures no longer drift.

Replicates run until their figures have settled. They start in groups from states that are clearly different. A run has settled where the groups agree, and the later half
of the counted turns with the earlier one, within the error of a figure or a hundredth of it (``error_bars``). Until then every
replicate goes on until it is twice as long, and again, up to ``numerics.extend_limit`` times the turns asked for; each time the
last half counts. Companions run just as far. Nothing depends on the clock or on the number of threads.
"""

import math
import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple, Protocol

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.faults import RunError, given
from rbdyn.base.notes import Note, Notes
from rbdyn.base.records import Record
from rbdyn.base.words import Notice
from rbdyn.dynamics.ensemble import Outcome, Pace, Reporter, Stop, in_turn, run_all, threads_of
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.forces.state import CAGE_ANGLE, CAGE_X
from rbdyn.dynamics.integrators import advance
from rbdyn.dynamics.parameters.model import pocket_width
from rbdyn.dynamics.parameters.state import group_of, scales
from rbdyn.dynamics.run import Run, with_numerics
from rbdyn.dynamics.statistics.error_bars import settled, start_of_counting
from rbdyn.dynamics.statistics.metrics import Companions, companions_of, filtered_speed, speed_sums
from rbdyn.dynamics.statistics.replicate import Replicate
from rbdyn.scene import Scene
from rbdyn.scene.laws import MOST_OF_A_RUN, MOST_SAMPLES

# Columns of the whirl of a tally that become ``whirl`` and ``orbit`` of a replicate.
SPEED_SUMS, PLACE_SUMS = (
    (advance.SAMPLES, advance.SPEEDS, advance.SQUARES),
    (advance.SAMPLES, advance.PLACES_X, advance.PLACES_Y, advance.PLACE_SQUARES),
)
# Long enough that the step cut at the end of a batch costs nothing, short compared with any memory that matters.
BATCH_TURNS = 1.0


class Batches(Record):
    """How a run is cut: ends of the batches of the warm-up, length of all others [shaft turns], batches of an impact window."""

    warm_up: Array
    length: float
    per_window: int

    @property
    def first(self) -> int:
        """Batches of the warm-up."""
        return len(self.warm_up)

    @property
    def window(self) -> float:
        """Length of an impact window [shaft turns]."""
        return self.length * self.per_window

    def count(self, counted: float) -> int:
        """Batches of a run of so many turns after the warm-up [shaft turns]."""
        return self.first + math.ceil(counted / self.length - 1e-9)

    def ends(self, counted: float) -> Array:
        """Ends of all batches [shaft turns] of a run of so many turns after the warm-up; the last may be shorter."""
        begin = float(self.warm_up[-1]) if self.first else 0.0
        after = np.minimum(np.arange(1, self.count(counted) - self.first + 1) * self.length, counted)
        return np.concatenate((self.warm_up, begin + after))


def batches_of(scene: Scene) -> Batches:
    """How the scene's runs are cut."""
    numerics, window = scene.numerics, scene.impact_window_turns
    shortest = max(BATCH_TURNS, numerics.turns / MOST_OF_A_RUN)
    per_window = max(round(window / shortest), 1)
    length = window / per_window
    warm_up = numerics.warm_up_turns
    first = math.ceil(warm_up / max(length, warm_up / MOST_OF_A_RUN) - 1e-9) if warm_up else 0
    return Batches(warm_up * np.arange(1, first + 1) / max(first, 1), length, per_window)


class Recording:
    """A run under way and its record, batch by batch; it can always go on."""

    def __init__(self, run: Run, traced: bool = False) -> None:
        self.run, self.batches = run, batches_of(run.scene)
        # Places of the cage's centre about its guide, x and y in turn, and the counts of a trace in each batch.
        self._path, self._traced = array("f"), list[Whole]()
        self._most = 2 * int(MOST_SAMPLES / run.scene.numerics.replicates)
        if traced and (spacing := run.scene.cage_sample_s) is not None:
            longest = max(np.diff(self.batches.ends(self.batches.window), prepend=0.0)) * run.scene.turn_s
            run.trace(spacing, math.ceil(longest / spacing) + 2)
        self._begin = run.clock_angles()
        # Whirl, work and largest loads of each batch in turn, as plain numbers: an array for each would take twice the memory.
        self._ends, self._booked = [0.0], array("d")
        self._looks = [self._look()]
        # Places of the cage's centre, x and y in turn, and how many samples there were at the end of each batch.
        self._places, self._sampled = array("d"), list[int]()
        self._cpu_s = 0.0

    def to(self, counted: float) -> Replicate:
        """Go on until so many turns after the warm-up [shaft turns]. Raises RunError or CancelledError."""
        started = time.thread_time()
        run, tally = self.run, self.run.tally
        ends = self.batches.ends(counted)
        run.allow(float(ends[-1]))
        for end in ends[self._batches :]:
            if self._batches == self.batches.first:
                run.forget()
            self._go(float(end))
            for sums in (tally.whirl, tally.work, tally.largest, tally.impacts, tally.races):
                self._booked.frombytes(sums.tobytes())
                sums[:] = 0.0
            if run.carry.trace.components.size:
                self._take_trace()
            self._ends.append(float(end))
            self._looks.append(self._look())
        self._cpu_s += time.thread_time() - started
        return self.replicate

    def _take_trace(self) -> None:
        """Take the samples of a batch from the trace; those that memory does not hold are the oldest."""
        trace = self.run.carry.trace
        places = trace.samples[: trace.counts[0]]
        about = places[:, :2] - places[:, 2:] if places.shape[1] > 2 else places
        self._path.frombytes(about.astype(np.float32).tobytes())
        del self._path[: max(len(self._path) - self._most, 0)]
        self._traced.append(trace.counts.copy())
        trace.counts[:] = 0

    @property
    def _batches(self) -> int:
        return len(self._ends) - 1

    @property
    def replicate(self) -> Replicate:
        """The record so far, counted from the end of the warm-up."""
        run, scale, tally = self.run, scales(self.run.scene), self.run.tally
        booked = np.array(self._booked).reshape(self._batches, -1)
        parts = np.split(
            booked, np.cumsum([sums.size for sums in (tally.whirl, tally.work, tally.largest, tally.impacts)]), axis=1
        )
        motion, work, largest, impacts, races = (np.ascontiguousarray(part) for part in parts)
        # Contiguous too: the order of memory decides the last bit of sums.
        speeds, places = (np.ascontiguousarray(motion[:, columns]) for columns in (SPEED_SUMS, PLACE_SUMS))
        cage, rolling, energy = np.array(self._looks).T
        return Replicate(
            first=self.batches.first,
            per_window=self.batches.per_window,
            durations=np.diff(self._ends) * run.scene.turn_s,
            whirl=self._filtered_whirl() if self._places else speeds,
            orbit=places,
            pocket_width=pocket_width(run.scene),
            work=work,
            largest=largest,
            impacts=impacts.reshape(len(self._ends) - 1, *tally.impacts.shape),
            races=races.reshape(len(self._ends) - 1, *tally.races.shape),
            cage_angle=np.diff(cage),
            kinematic_angle=np.diff(rolling),
            energy=energy,
            energy_scale=scale.load * scale.length,
            accepted_steps=int(run.carry.counts[advance.ACCEPTED]),
            rejected_steps=int(run.carry.counts[advance.REJECTED]),
            derivatives=int(run.carry.counts[advance.DERIVATIVES]),
            cpu_s=self._cpu_s,
            method=run.method,
            stiffness=run.carry.stiffness.copy(),
            group=group_of(run.scene, run.replicate),
            cage_path=np.array(self._path, dtype=float).view(complex),
            traced=np.array(self._traced),
            end=run.carry.y.copy(),
        )

    def _go(self, end: float) -> None:
        """Go on to the end of a batch [shaft turns]. Steps end at the samples of a filtered whirl."""
        run, per_turn = self.run, self.run.scene.whirl_samples_per_turn
        if per_turn:
            first = run.layout.first_body + CAGE_X
            while (sample := len(self._places) // 2 / per_turn) <= end:
                run.to(sample)
                self._places.extend(run.carry.y[first : first + 2].tolist())
            self._sampled.append(len(self._places) // 2)
        run.to(end)

    def _filtered_whirl(self) -> Array:
        scene = self.run.scene
        places, rate = np.array(self._places).reshape(-1, 2).T, scene.whirl_samples_per_turn / scene.turn_s
        cutoff, notches = given(scene.numerics.whirl_cutoff_hz), scene.numerics.whirl_notches_hz
        return speed_sums(filtered_speed(places, rate, cutoff, notches), self._sampled)

    def _look(self) -> tuple[float, float, float]:
        """Present cage angle, kinematic cage angle [rad] and mechanical energy [J]."""
        run = self.run
        return (
            float(run.carry.y[run.layout.first_body + CAGE_ANGLE]),
            kinematic_cage_angle(run.scene, self._begin, run.clock_angles()),
            sum(run.energies()),
        )


def recording_of(
    scene: Scene,
    bearing: RollerBearing,
    pace: Pace | None,
    replicate: int,
    companions: Companions | None,
    stop: Stop,
    starts: Sequence[Array] = (),
) -> Recording:
    """The recording of a replicate, or of a companion of it where ``companions`` says how that is integrated.

    ``starts``: states of earlier runs where replicates begin; empty for a start of their own.
    """
    begin = starts[replicate] if starts else None
    if companions is None:
        return Recording(Run(scene, bearing, replicate, scene.numerics.rtol, stop, pace, begin=begin), traced=True)
    # The budget covers twice the steps of the longest step.
    needed = math.ceil(2.0 * scene.turn_s / companions.longest_step)
    budget = max(scene.numerics.step_budget_per_turn, needed)
    companion = with_numerics(scene, method=companions.method, step_budget_per_turn=budget)
    return Recording(Run(companion, bearing, replicate, companions.rtol, stop, pace, companions.longest_step, begin))


def record(run: Run) -> Replicate:
    """Run for the turns of its scene. Raises RunError or CancelledError."""
    return Recording(run).to(run.scene.numerics.turns)


def run_replicate(
    scene: Scene, bearing: RollerBearing, replicate: int, rtol: float, stop: Stop, pace: Pace | None = None
) -> Replicate:
    """Run one replicate at a tolerance, from the start on. Raises RunError or CancelledError."""
    return record(Run(scene, bearing, replicate, rtol, stop, pace))


def run_series(
    scene: Scene,
    bearing: RollerBearing,
    rtols: Sequence[float],
    workers: int | None,
    progress: Reporter,
    stop: Stop,
    notice: Notice = None,
) -> list[list[Replicate]]:
    """All replicates of a scene at each tolerance, in order. Raises RunError or KeyboardInterrupt."""
    replicates = range(scene.numerics.replicates)
    turns = scene.numerics.warm_up_turns + scene.numerics.turns
    threads = threads_of(workers)
    rounds = math.ceil(len(rtols) * len(replicates) / threads)
    pace = Pace(notice, rounds * turns, turns, threads)
    tasks = [partial(run_replicate, scene, bearing, index, rtol, stop, pace) for rtol in rtols for index in replicates]
    runs: dict[int, Replicate] = {}

    def collect(outcome: Outcome[Replicate]) -> None:
        runs[outcome.place] = outcome.result()
        if progress is not None:
            progress(len(runs), len(tasks))

    run_all(tasks, workers, stop, collect)
    return [[runs[place * len(replicates) + index] for index in replicates] for place in range(len(rtols))]


def kinematic_cage_angle(scene: Scene, before: Array, after: Array) -> float:
    """Angle [rad] that an epicyclic cage turns while inner and outer ring turn from ``before`` to ``after``."""
    outer, inner = scene.geometry.raceways
    turned = after - before
    return float((turned[0] * inner + turned[1] * outer) / (inner + outer))


class Stage(NamedTuple):
    """Length of the replicates: batch from which they count, turns after the warm-up, and whether they were lengthened."""

    first: int
    turns: float
    lengthened: bool = False


class Ensemble(Record):
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

    @property
    def ends(self) -> list[Array]:
        """Last states of the replicates."""
        return [run.end for run in self.runs]


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


def length_notes(scene: Scene, runs: Sequence[Replicate], stage: Stage, since: int) -> Iterator[Note]:
    """Notes on the length of the runs and on the turns that count."""
    numerics, turn_s, counted = scene.numerics, scene.turn_s, runs[0].duration / scene.turn_s
    if stage.lengthened:
        dropped = float(runs[0].durations[: stage.first].sum()) / turn_s
        sentence = (
            f"length: results drifted, so each replicate was extended from {numerics.warm_up_turns + numerics.turns:.4g} to "
            f"{dropped + counted:.4g} shaft turns. The last {counted:.4g} count. Set numerics.extend = false to prevent this"
        )
        yield Note("lengthened", sentence)
    if scene.operation.schedule is None and not settled(runs, since):
        fix = (
            "Raise numerics.extend_limit" if scene.extends else "Lengthen numerics.turns or set numerics.extend = true"
        )
        if not fits(scene, grown(scene, stage)):
            fix = "Take fewer replicates: there is not enough memory for longer ones"
        sentence = (
            f"transient: results still drift over the {counted:.4g} counted turns, or differ by how replicates start, so no "
            f"statistical error is known. {fix}"
        )
        yield Note("drift", sentence)
