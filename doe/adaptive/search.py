"""The search: design, batches where most is to be gained, a check of what is foretold, fresh runs at the finalists.

What a search believes of the points that it chose is flattered by the errors that made it choose them. So the last runs are
made afresh at the finalists and alone are reported, as at the end of `doe.pareto.direct`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.stats import qmc

from doe.adaptive.border import Place, faces, grown, outermost
from doe.adaptive.candidates import Region, candidates, front_rows
from doe.adaptive.emulators import Emulators, fit_emulators
from doe.adaptive.improvement import DRAWS, WORTH, Levels, batch, known_of, levels_of
from doe.adaptive.result import AdaptiveFront, Batch
from doe.adaptive.runs import Border, Evaluate, Face, Runs
from doe.adaptive.settling import CHECKS, as_foretold, missed, nothing_gained
from doe.arrays import Array, Whole
from doe.emulator.emulator import THREADS
from doe.pareto.archive import best_for_hypervolume, hypervolume, spread
from doe.pareto.direct import DirectFront, Samples
from doe.pareto.goals import Goals
from doe.pareto.nsga2 import InfeasibleError
from doe.pareto.picks import NAMES, Rule, pick_all

FRESH = 0.3  # of the budget: fresh runs at the finalists, as in a direct search
SHOWN, FEW = 200, 2048  # points of a front foretold that are shown, and levels, by which its hypervolume is told


@dataclass(frozen=True)
class Plan:
    """How a search goes: ``budget`` of runs, those of the design and the fresh ones included; runs a ``batch``; ``seed``.

    A run has from ``least`` to ``most`` replicates, a fresh one ``usual``, and the ``pick`` is made by that rule.
    """

    budget: int
    batch: int = 8
    seed: int = 1
    least: int = 2
    most: int = 16
    usual: int = 8
    pick: Rule = "knee"

    @property
    def fresh(self) -> int:
        """Fresh runs."""
        return round(FRESH * self.budget)


# Tells of the state after a batch, and of how many runs are done of all.
Tell = Callable[[Batch, int, int], None]


def adaptive_front(
    evaluate: Evaluate,
    centre: Array,
    step: Array,
    region: Region,
    design: Runs,
    goals: Goals,
    plan: Plan,
    baseline: Array,
    tell: Tell = lambda state, done, total: None,
    border: Border | None = None,
) -> AdaptiveFront:
    """Find the front; the same seed and the same runs give the same bits.

    ``centre`` and ``step`` (k,) turn coded units into those of the factors, in which ``evaluate`` is asked and the
    ``baseline`` is given. ``design`` are the first runs. The region may grow as far as the ``border``, not at all without one.

    Raises ValueError where the budget has no room for the design, a batch and the fresh runs, or too few runs go well;
    InfeasibleError where no run comes near to keeping the limits.
    """
    check_budget(plan, len(design.points))
    with THREADS.limit(limits=1):
        search = _Search(
            evaluate, centre, step, region, goals, plan, design, tell, border, why=["design"] * len(design.points)
        )
        stopped = search.spend()
        return search.finish(baseline, stopped)


def check_budget(plan: Plan, design: int) -> None:
    """Raises ValueError where the budget has no room for the runs of the design, a batch and the fresh runs."""
    searched = design + plan.batch
    if searched > plan.budget - plan.fresh:
        least = next(budget for budget in range(searched, 4 * searched) if budget - round(FRESH * budget) >= searched)
        raise ValueError(
            f"budget = {plan.budget}: {design} runs of the design, a batch of {plan.batch} and {plan.fresh} fresh runs at the end "
            f"do not fit; give at least {least}"
        )


@dataclass(eq=False)
class _Search:
    """A search under way; ``runs`` are all so far, failed ones too."""

    evaluate: Evaluate
    centre: Array
    step: Array
    region: Region
    goals: Goals
    plan: Plan
    runs: Runs
    tell: Tell
    border: Border | None
    history: list[Batch] = field(default_factory=list)
    fronts: list[Array] = field(default_factory=list)
    why: list[str] = field(default_factory=list)
    moves: list[tuple[Face, float]] = field(default_factory=list)
    emulators: Emulators | None = None
    seconds: float = 0.0

    def spend(self) -> str:
        """Make batches until the budget is spent or nothing is left to gain; returns which."""
        room, since = self.plan.budget - self.plan.fresh, -1
        while True:
            started = time.perf_counter()
            emulators = self._fit()
            random = np.random.default_rng([self.plan.seed, len(self.history)])
            points = candidates(emulators, self.region, random, self.runs.points)
            levels, left, state = self._state(emulators, points, random)
            count = min(self.plan.batch, room - len(self.runs.points))
            rows, _ = batch(emulators, points, levels, left, count, self.region.apart)
            check = nothing_gained(self.history, since) and count >= CHECKS
            if check:
                rows = self._check(emulators, points, levels)
            chosen, why = points[rows], "" if not rows else "check" if check else "improvement"
            if self.history and rows and (beyond := self._beyond(emulators, points, count, random)) is not None:
                chosen, why, check, since = beyond, "extension", False, len(self.history)
            self.history.append(replace(state, why=why))
            self.tell(self.history[-1], len(self.runs.points), self.plan.budget)
            replicates = self._replicates(emulators, chosen)
            self.seconds += time.perf_counter() - started
            if not rows:
                return "the budget is spent" if count <= 0 else "no point is left that may gain"
            fresh = self._run(chosen, replicates)
            self.runs, self.why = self.runs.plus(fresh), [*self.why, *[why] * len(chosen)]
            if check:
                if as_foretold(emulators, fresh):
                    return "batches gained nothing more and fresh runs on the front were as foretold"
                since = len(self.history) - 1

    def _fit(self) -> Emulators:
        good = int(self.runs.good.sum())
        if good < 2 + len(self.centre):
            raise ValueError(f"only {good} runs went well; emulators need {2 + len(self.centre)}")
        self.emulators = fit_emulators(self.goals, self.runs, self.emulators, self.region.levels, self.region.inactive)
        return self.emulators

    def _state(self, emulators: Emulators, points: Array, random: np.random.Generator) -> tuple[Levels, Array, Batch]:
        """Levels, the probability that each is still to be gained (u,), and where the search stands.

        What is gained is gained by the front foretold, not by the runs: these fill it up whatever they tell.
        """
        everything = np.vstack([points, emulators.runs.points])
        rows, costs = front_rows(emulators, everything)
        deviations = emulators.predict(everything)[1][:, self.goals.objectives]
        levels = levels_of(costs[rows], (costs - deviations).min(axis=0), random)
        draws = emulators.draws(DRAWS, random)
        shown = everything[rows[spread(costs[rows], SHOWN)]]
        known = known_of(levels, emulators, draws(emulators.runs.points))
        before = self.fronts[-1] if self.fronts else shown[:0]
        few = levels.first(FEW)
        at, was, best = (known_of(few, emulators, draws(part)).hypervolumes for part in (shown, before, everything))
        self.fronts.append(shown)
        gained = float((at - was).mean()) if len(self.fronts) > 1 else float("nan")
        state = Batch(
            len(emulators.runs.points), float(at.mean()), float(at.std()), gained, float((best - at).mean()), ""
        )
        return levels, known.left, state

    def _faces(self, emulators: Emulators, points: Array, random: np.random.Generator) -> list[Face]:
        """Faces that the pick foretold lies at."""
        place = Place(emulators, self.region, points, len(self.moves))
        border = self.border or Border(self.region.low, self.region.high, lambda corners: False)
        return faces(place, border, self.plan.pick, random)

    def _beyond(self, emulators: Emulators, points: Array, count: int, random: np.random.Generator) -> Array | None:
        """Move the face that is worth it, and give points (n, k) all over what is new; None where no face is."""
        if self.border is None or (face := outermost(self._faces(emulators, points, random))) is None:
            return None
        self.region = grown(self.border, self.region, face.factor, face.side)
        low, high = self.region.low.copy(), self.region.high.copy()
        self.moves.append((face, float((high if face.side > 0 else low)[face.factor])))
        (low if face.side > 0 else high)[face.factor] = face.at
        even = qmc.Sobol(low.size, seed=random).random_base2(count.bit_length())[:count]
        return self.region.snap(low + (high - low) * even)

    def _check(self, emulators: Emulators, points: Array, levels: Levels) -> list[int]:
        """Rows of points spread over the front foretold."""
        rows, _ = front_rows(emulators, points)
        chosen, _ = batch(emulators, points[rows], levels, np.ones(len(levels.at)), CHECKS, self.region.apart)
        return rows[chosen].tolist()

    def _replicates(self, emulators: Emulators, points: Array) -> Whole:
        """As many (n,) as make the scatter of a run small beside what is not known of it."""
        columns = self.goals.objectives
        single, deviations = emulators.scatter(points)[:, columns], emulators.predict(points)[1][:, columns]
        wanted = np.ceil((single / (WORTH * deviations**2)).max(axis=1))
        return wanted.clip(self.plan.least, self.plan.most).astype(np.int64)

    def _run(self, points: Array, replicates: Whole) -> Runs:
        values, errors, freedom = self.evaluate(self.centre + self.step * points, replicates)
        return Runs(points, values, errors, freedom, replicates)

    def finish(self, baseline: Array, stopped: str) -> AdaptiveFront:
        """Fresh runs at the finalists."""
        started = time.perf_counter()
        emulators = self._fit()
        random = np.random.default_rng([self.plan.seed, len(self.history), 1])
        failed = self.runs.points[~self.runs.good]
        points = candidates(emulators, self.region, random, failed, 3)
        rows, costs = front_rows(emulators, points)
        self._check_limits(emulators, points)
        archive = points[rows]
        levels = levels_of(costs[rows], costs[rows].min(axis=0), random)
        chosen, _ = batch(emulators, archive, levels, np.ones(len(levels.at)), self.plan.fresh - 1, self.region.apart)
        finalists = archive[sorted(chosen, key=lambda row: costs[rows][row, 0])]
        foretold, deviations = emulators.predict(archive)
        self.seconds += time.perf_counter() - started
        original = (baseline - self.centre) / self.step
        usual = np.full(len(finalists) + 1, self.plan.usual)
        fresh = self._run(np.vstack([finalists, original]), usual)
        ours, base = fresh.rows(slice(-1)), fresh.rows(slice(-1, None))
        if not ours.good.any():
            raise ValueError("every run at the finalists failed; see the failures of the runs")
        off = missed(emulators, ours.rows(ours.good))
        return AdaptiveFront(
            front=self._front(emulators, ours, base, fresh),
            archive=self.centre + self.step * archive,
            shown=best_for_hypervolume(costs[rows], SHOWN),
            foretold=foretold,
            deviations=deviations,
            emulators=emulators,
            region=self.region,
            history=tuple(self._on_one_scale(emulators, costs[rows])),
            fronts=tuple(self.fronts),
            moves=tuple(self.moves),
            faces=tuple(self._faces(emulators, points, random)),
            searched=Samples(self.centre + self.step * self.runs.points, self.runs.values, self.runs.errors),
            why=tuple(self.why),
            spent=self.runs.replicates,
            bias=off.mean(axis=0),
            spread=off.std(axis=0, ddof=1 if len(off) > 1 else 0),
            fresh=len(usual),
            stopped=stopped,
            seconds=self.seconds,
        )

    def _on_one_scale(self, emulators: Emulators, front: Array) -> list[Batch]:
        """The history with the hypervolumes of all fronts foretold, by the last emulators, on the scale of the last front
        (f, q)."""
        ideal, nadir = front.min(axis=0), front.max(axis=0)
        reached = [hypervolume(self.goals.costs(emulators.predict(each)[0]), ideal, nadir) for each in self.fronts]
        return [replace(each, reached=value) for each, value in zip(self.history, reached, strict=True)]

    def _check_limits(self, emulators: Emulators, points: Array) -> None:
        """Raises InfeasibleError where nothing foretold is likely to keep all limits, with the nearest point."""
        means, deviations = emulators.predict(points)
        kept = emulators.kept(means, deviations)
        if kept.max() < 0.5 and (violations := self.goals.violations(means, means)).size:
            row = int((violations / violations.max(axis=0).clip(1e-300)).sum(axis=1).argmin())
            if violations[row].any():
                raise InfeasibleError(self.centre + self.step * points[row], violations[row])

    def _front(self, emulators: Emulators, ours: Runs, base: Runs, fresh: Runs) -> DirectFront:
        """The finalists as their fresh runs found them, picked by what was believed before."""
        goals, kept = self.goals, ours.good
        believed = goals.costs(emulators.predict(ours.points[kept])[0])
        values, errors = ours.values[kept], np.nan_to_num(ours.errors[kept])
        costs = goals.costs(values)
        base_values = base.values[0] if base.good.all() else None
        picks, among = pick_all(believed, goals, None if base_values is None else goals.costs(base_values))
        span = np.ptp(costs, axis=0)
        actual = [self.centre + self.step * part.points for part in (ours.rows(kept), self.runs, self.runs.plus(fresh))]
        failed = actual[2][~self.runs.plus(fresh).good]
        return DirectFront(
            points=actual[0],
            values=values,
            standard_errors=errors,
            costs=costs,
            cost_errors=errors[:, goals.objectives],
            optimism=(costs - believed).mean(axis=0) / np.where(span > 0.0, span, 1.0),
            pick=picks[self.plan.pick],
            pick_reason=f"{NAMES[self.plan.pick]} {among}",
            baseline_values=base_values,
            repeats=1,
            failures=np.unique(failed, axis=0),
            evaluations=len(self.runs.points) + len(fresh.points),
            generations=len(self.history),
            seed=self.plan.seed,
            goals=goals,
            searched=Samples(actual[1], self.runs.values, self.runs.errors),
        )
