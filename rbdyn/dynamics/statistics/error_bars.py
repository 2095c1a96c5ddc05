"""Figures of a scene with their error bars: end of the transient, settling, slow change, and notes on large errors.

MSER-5 on the mean of the replicates finds the transient. The marginal standard error rule (White 1997, *Simulation* 69, 323;
MSER-5: White, Cobb and Spratt 2000) works on means of five batches. It drops the head of the series, at most half of the
run, without which the rest has the smallest standard error of its mean. Averaging the replicates first (Welch 1983) keeps the
transient and lowers the noise. On stationary noise the rule would still drop a little. So a head counts as a transient only
if its mean differs from that of the rest beyond their scatter.

Cages have slow regimes. Loose ones change the way they whirl over 20 to 400 shaft turns, at random moments, so no curve
fitted to a start shows its limit, and replicates that begin alike agree with each other all the while. So they begin in
groups, from states that are clearly different (``parameters.state``). One test says whether a run has settled: nested R-hat
(Margossian, Hoffman, Sountsov, Riou-Durand, Vehtari and Gelman 2024, *Bayesian Analysis*), which compares the variance
between the means of groups, and between those of earlier and later halves, with the variance within. Two groups and two halves
leave one difference each, and R-hat^2 - 1 is proportional to the square of its Student's t. So the threshold is one of t,
which knows how few replicates there are. Differences are of independent replicates and need no memory of the series. The test
covers each figure and the mean speed of the cage's centre, which shows a change of regime first. Its level is that of all
differences together (Holm 1979, *Scandinavian Journal of Statistics* 6, 65): one settled run in twenty is lengthened in
vain. A difference within the error of its figure, or below a hundredth of it, lengthens no run.

A difference d with standard error s that lengthens nothing still hides a bias. If a transient at least halves from one half to
the next, the mean over both is off by at most 3 d/2. The groups come from either side of what they settle to, so their mean is
off by at most d/2. Where any figure is likelier than not to differ, the transient is not over, and sqrt(d^2 + s^2) of every
figure counts so. Elsewhere the part of d above its noise counts, max(|d| - s, 0).

Some regimes last for good. Of the replicates of the bearing of Chen et al. 2022 one in 25 ends in another one, at loose
clearances one in 8. A regime without any of n replicates has a share of about 1/(n + 1) (Laplace's rule of succession). Its
distance is estimated by the stretch of two impact windows, of any replicate, with the figure farthest from the mean of all.
The product of both counts too.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import quantity as words_of
from rbdyn.dynamics.figures import FIGURES, WHIRL_SPEED
from rbdyn.dynamics.forces.state import POCKET_LOAD
from rbdyn.dynamics.parameters.state import GROUPS
from rbdyn.dynamics.statistics.batch_means import autocorrelation_time, estimate, student_chance, student_factor
from rbdyn.dynamics.statistics.metrics import Runs, quantity
from rbdyn.dynamics.statistics.replicate import Replicate, Statistic
from rbdyn.losses import SHAFT
from rbdyn.result import Quantity
from rbdyn.scene import Scene

GROUP = 5
# Fewer means of five batches show no transient.
FEWEST_GROUPS = 8
# Standard errors by which the mean of a head must differ: more than the usual two or three, since it is the worst of many.
SIGNIFICANT = 4.0
# From so many replicates on their differences are tested; fewer are tested by batch means.
FEWEST_REPLICATES = 3
# Share of settled runs in which a figure seems to differ: of those that are lengthened, and of those whose errors count the
# whole difference, which costs no turn.
FALSE_ALARMS, DOUBT = 0.05, 0.5
# Difference of a figure, over the figure, for which no run is lengthened.
NEGLIGIBLE = 1e-2
# Impact windows in a stretch.
STRETCH = 2
# Mean of a transient that halves from half to half, over the difference of the halves: (1 + q)/(2 (1 - q)), q = 1/2. Mean of
# two groups, over their difference, where the truth is anywhere between them.
BIAS_OF_HALVES, BIAS_OF_GROUPS = 1.5, 0.5


def find_transient(series: Array) -> int | None:
    """Batches of the transient of one series, a multiple of five; None where it is too short to decide."""
    groups = len(series) // GROUP
    if groups < FEWEST_GROUPS:
        return None
    means = series[: groups * GROUP].reshape(groups, GROUP).mean(axis=1)
    # Means and variances of all tails at once, about the mean so that digits do not cancel.
    tails = (means - means.mean())[::-1]
    count = np.arange(1, groups + 1)
    mean = np.cumsum(tails) / count
    spread = np.maximum(np.cumsum(tails**2) - count * mean**2, 0.0) / count**2
    half = (groups + 1) // 2
    dropped = half - int(np.argmin(spread[::-1][: half + 1][::-1]))
    start, tail = means[:dropped], means[dropped:]
    if dropped == 0:
        return 0
    error = math.sqrt(tail.var(ddof=1) * autocorrelation_time([tail]) * (1.0 / len(start) + 1.0 / len(tail)))
    return dropped * GROUP if abs(float(start.mean() - tail.mean())) > SIGNIFICANT * error else 0


def series_of(runs: Runs) -> dict[str, Array]:
    """Impact force, whirl and power loss of each batch, averaged over the replicates."""

    def whirl(run: Replicate) -> Array:
        samples, total, squares = run.whirl.T
        mean = total / samples
        return np.sqrt(np.maximum(squares / samples - mean**2, 0.0)) / np.where(mean > 0.0, mean, 1.0)

    return {
        "impact_force_N": np.mean([run.largest[:, POCKET_LOAD] for run in runs], axis=0),
        "whirl_deviation_ratio": np.mean([whirl(run) for run in runs], axis=0),
        "power_loss_W": np.mean([run.work[:, :SHAFT].sum(axis=1) / run.durations for run in runs], axis=0),
    }


class Start(NamedTuple):
    """Batch at which counting starts, transient of the whole run [shaft turns], and notes for the result.

    ``turns``: None where the run is too short to show it or follows a schedule.
    """

    first: int
    turns: float | None
    notes: Notes


def start_of_counting(scene: Scene, runs: Runs) -> Start:
    """Where counting starts: after ``numerics.discard_turns``, or after the transient where that is "auto"."""
    numerics, run = scene.numerics, runs[0]
    if scene.operation.schedule is not None:
        return Start(run.first, None, ())
    transients = [batches for series in series_of(runs).values() if (batches := find_transient(series)) is not None]
    transient = max(transients, default=None)  # the longest; None where the run is too short to decide
    if transient is None:
        fewest = GROUP * FEWEST_GROUPS * run.durations[0] / scene.turn_s
        sentence = (
            f"transient: the run is too short to show it: {fewest:g} shaft turns are needed; lengthen numerics.turns"
        )
        return Start(run.first, None, (Note("drift", sentence),))
    turns = round(float(run.durations[:transient].sum()) / scene.turn_s, 6)
    if numerics.discard_turns == "auto":
        # At least one impact window counts.
        return Start(min(transient, len(run.durations) - run.per_window), turns, ())
    return Start(run.first, turns, ())


TESTED = (*(it.trend or it for figure in FIGURES if figure.tested and (it := figure.statistic)), WHIRL_SPEED)


class Difference(NamedTuple):
    """A figure in one half or group less that in the other: mean, standard error, degrees of freedom of that.

    ``figure``: size of the figure; ``share``: bias of the mean of both, over the difference.
    """

    size: float
    error: float
    freedom: int
    figure: float
    share: float

    @property
    def chance(self) -> float:
        """Chance that a settled run shows as large a difference."""
        if self.size == 0.0:
            return 1.0
        return student_chance(self.size / self.error, self.freedom) if self.error > 0.0 else 0.0

    def bias(self, moving: bool) -> float:
        """Bias of the mean: by the whole difference where figures are ``moving``, elsewhere by its part above noise."""
        size = math.hypot(self.size, self.error) if moving else max(abs(self.size) - self.error, 0.0)
        return self.share * size


def differences_of(figure: Statistic, runs: Runs) -> list[Difference]:
    """Later half of the counted turns less the earlier one, and the second group of starts less the first.

    None where the turns are too few to decide; none of groups where all replicates but two start alike.
    """
    moments = [figure.moments(run) for run in runs]
    rows = min(len(part) for part in moments)
    half = rows // 2
    if half == 0:
        return []
    size = abs(float(figure.of_sums(np.sum([part.sum(axis=0) for part in moments], axis=0))))
    early, late = ([part[rows - 2 * half : rows - half] for part in moments], [part[-half:] for part in moments])
    groups = [[part for part, run in zip(moments, runs, strict=True) if run.group == group] for group in range(GROUPS)]
    if len(runs) < FEWEST_REPLICATES:
        halves = _by_batches(figure, early, late, BIAS_OF_HALVES, size)
        apart = _by_batches(figure, groups[0], groups[1], BIAS_OF_GROUPS, size) if all(groups) else None
        return [each for each in (halves, apart) if each is not None]
    change = _values(figure, late) - _values(figure, early)
    error = float(change.std(ddof=1)) / math.sqrt(len(runs))
    found = [Difference(float(change.mean()), error, len(runs) - 1, size, BIAS_OF_HALVES)]
    if all(groups):
        first, second = (_values(figure, group) for group in groups)
        freedom = len(runs) - GROUPS
        within = sum(float(group.var()) * len(group) for group in (first, second)) / freedom
        error = math.sqrt(within * (1.0 / len(first) + 1.0 / len(second)))
        found.append(Difference(float(second.mean() - first.mean()), error, freedom, size, BIAS_OF_GROUPS))
    return found


def _values(figure: Statistic, moments: Sequence[Array]) -> Array:
    """The figure of each replicate."""
    return np.array([float(figure.of_sums(part.sum(axis=0))) for part in moments])


def _by_batches(
    figure: Statistic, before: Sequence[Array], after: Sequence[Array], share: float, size: float
) -> Difference | None:
    """Difference of two sets of moments whose errors come from batch means; None where these are too few."""
    parts = [estimate(part, figure.of_sums) for part in (before, after)]
    halves = [part.half_width for part in parts if part.half_width is not None]
    if len(halves) < len(parts):
        return None
    freedom = max(sum(len(part) for part in after) - 1, 1)
    error = math.hypot(*halves) / student_factor(freedom)
    return Difference(parts[1].value - parts[0].value, error, freedom, size, share)


def disagreements(runs: Runs, false_alarms: float) -> list[tuple[Statistic, Difference]]:
    """The tested differences that are beyond scatter; the share ``false_alarms`` of settled runs has any."""
    found = [(figure, each) for figure in TESTED for each in differences_of(figure, runs)]
    ranked = sorted(found, key=lambda each: each[1].chance)
    settled = (each.chance > false_alarms / (len(ranked) - place) for place, (_, each) in enumerate(ranked))
    return ranked[: next((place for place, is_settled in enumerate(settled) if is_settled), len(ranked))]


def drifting(runs: Runs) -> bool:
    """Whether any figure may still change, so that the errors of all must cover it."""
    return bool(disagreements(runs, DOUBT))


def settled(runs: Runs, since: int) -> bool:
    """Whether halves and groups of the runs agree: within scatter, a hundredth of the figure, or its error.

    ``since``: batch from which the runs show their regimes.
    """
    return all(
        abs(each.size) <= max(NEGLIGIBLE * each.figure, _settled_error(figure, runs, since))
        for figure, each in disagreements(runs, FALSE_ALARMS)
    )


def _settled_error(figure: Statistic, runs: Runs, since: int) -> float:
    """Half-width of a figure whose runs agree."""
    scatter = estimate([figure.moments(run) for run in runs], figure.of_sums).half_width
    return math.hypot(scatter or 0.0, unseen_regime(figure, runs, since))


def unseen_regime(figure: Statistic, runs: Runs, since: int) -> float:
    """Effect on the mean of a regime that no counted replicate is in, estimated by all stretches from batch ``since`` on."""
    counted = np.sum([figure.moments(run).sum(axis=0) for run in runs], axis=0)
    middle, farthest = float(figure.of_sums(counted)), 0.0
    for run in runs:
        kept = run.counted_from(since)
        moments = figure.moments(kept)
        stretches = max(len(kept.durations[since:]) // (STRETCH * kept.per_window), 1)
        for part in np.array_split(moments, min(stretches, len(moments))):
            farthest = max(farthest, abs(float(figure.of_sums(part.sum(axis=0))) - middle))
    return farthest / (len(runs) + 1)


def slow_change(figure: Statistic, tested: Statistic, runs: Runs, since: int, *, moving: bool) -> float:
    """Half-width that slow change adds to a figure of steady runs: differences and unseen regimes, as root sum of squares.

    ``moving``: whether any figure of the runs is ``drifting``; then the transient is not over for this one either.
    """
    differences = (difference for statistic in {figure, tested} for difference in differences_of(statistic, runs))
    bias = max((each.bias(moving) for each in differences), default=0.0)
    return math.hypot(bias, unseen_regime(figure, runs, since))


# Figures whose errors have notes, in words.
JUDGED = {figure.key: words_of(figure.key)[0] for figure in FIGURES if figure.judged}
# Fewer effective samples leave the half-width itself uncertain by a quarter and more.
FEW_SAMPLES = 10.0
# Numerical errors in the notes: above a twentieth of the value, or above a hundredth where they dominate the sum.
LARGE, NOTICEABLE = 0.05, 0.01
# Companions tighter than the run let scatter alone make the numerical error up to two and a half times the statistical one.
RULES = 3.0


def after_transient(scene: Scene, runs: Runs, companions: Runs) -> tuple[list[Replicate], list[Replicate], Start]:
    """Replicates and companions, counted from the start of counting, and that start."""
    start = start_of_counting(scene, runs)
    ours, theirs = ([run.counted_from(start.first) for run in series] for series in (runs, companions))
    return ours, theirs, start


def quantities(
    scene: Scene, runs: Runs, companions: Runs, share: float, since: int | None = None
) -> dict[str, Quantity]:
    """Every figure that follows from batches, with its errors, by its key; those of parts too.

    Those of the whole bearing have no statistical error where the runs have not settled. ``share`` of the difference from the
    companions is the bias of the runs. ``since``: batch from which the replicates show their regimes; unless given, that from
    which they count.
    """
    steady = scene.operation.schedule is None
    since = runs[0].first if since is None else since
    figures, moving = {}, steady and drifting(runs)
    unknown = moving and not settled(runs, since)
    for figure in FIGURES:
        statistic, scale = figure.statistic, figure.scale_in(scene)
        if statistic is None or scale is None or not figure.is_defined(runs):
            continue
        # Most scenes have no work at all of some losses.
        counts = steady and figure.slow and any(statistic.moments(run)[:, 1].any() for run in runs)
        slow = slow_change(statistic, statistic.trend or statistic, runs, since, moving=moving) if counts else 0.0
        found = quantity(statistic, runs, companions, share, slow, scale, figure.balanced)
        if unknown and figure.slow and figure.kind == "bearing":
            found = replace(found, statistical_error=None, degrees_of_freedom=None)
        figures[figure.key] = found
    return figures


def error_notes(
    scene: Scene, figures: dict[str, Quantity], fault: str | None, tighter: float | None = None
) -> Iterator[Note]:
    """Notes on errors that are large or uncertain, each with its fix.

    ``tighter``: the tolerance that removes a numerical error; a tenth of the scene's unless given.
    """
    if fault is not None:
        yield Note("numerical-error", f"numerical error: it is not estimated; {fault}")
    few = {name: figures[name].effective_samples for name in JUDGED if not _enough(figures[name])}
    if few:
        listed = ", ".join(f"{JUDGED[name]} {count:.1f}" for name, count in few.items())
        sentence = (
            f"statistical error: fewer than {FEW_SAMPLES:.0f} effective samples make it uncertain ({listed}). "
            "Raise numerics.turns or numerics.replicates"
        )
        yield Note("few-samples", sentence)
    for name in JUDGED:
        yield from _numerical_notes(scene, JUDGED[name], figures[name], tighter)


def _enough(figure: Quantity) -> bool:
    return figure.effective_samples >= FEW_SAMPLES or figure.statistical_error == 0.0


def _numerical_notes(scene: Scene, name: str, figure: Quantity, tighter: float | None) -> Iterator[Note]:
    error, statistical, size = figure.numerical_error, figure.statistical_error, abs(figure.value)
    if error is None or statistical is None or size == 0.0:
        return
    biased = error > RULES * statistical
    if error <= (NOTICEABLE if biased else LARGE) * size:
        return
    rtol, percent = scene.numerics.rtol, f"{100.0 * error / size:.2g} %"
    if biased:
        tolerance = f"{tighter or 0.1 * rtol:.1g}"
        fix = f"); tighten numerics.rtol = {rtol:g} to {tolerance}"
    else:
        fix = ", mostly scatter); raise numerics.turns or numerics.replicates"
    yield Note("numerical-error", f"{name}: may be off by {percent} (numerical error{fix}")
