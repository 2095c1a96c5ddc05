"""Where the transient of a run ends, found from its series: MSER-5 on the mean of the replicates.

The marginal standard error rule (White 1997, *Simulation* 69, 323; MSER-5: White, Cobb and Spratt 2000) drops the head
of the series without which the rest has the smallest standard error of its mean, on means of five batches and over
at most half of the run. Replicates are averaged first (Welch 1983), which leaves the transient and lowers the noise. On
stationary noise the rule would still drop a little; so a head counts as a transient only if its mean differs from that
of the rest beyond their scatter.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rbdyn.arrays import Array
from rbdyn.dynamics.forces.equations import POCKET_LOAD, SHAFT
from rbdyn.dynamics.statistics.batch_means import autocorrelation_time
from rbdyn.dynamics.statistics.metrics import Replicate
from rbdyn.scene import Scene

GROUP = 5
# Means of five batches without which nothing can be said.
FEWEST_GROUPS = 8
# Standard errors by which the mean of a head must differ: the head is the worst of many, so more than the usual two or three.
SIGNIFICANT = 4.0


def find_transient(series: Array) -> int | None:
    """Batches of the transient of one series, a multiple of five; None where it is too short to tell."""
    groups = len(series) // GROUP
    if groups < FEWEST_GROUPS:
        return None
    means = series[: groups * GROUP].reshape(groups, GROUP).mean(axis=1)
    # Means and variances of all tails at once, about the mean lest digits cancel.
    tails = (means - means.mean())[::-1]
    count = np.arange(1, groups + 1)
    mean = np.cumsum(tails) / count
    spread = np.maximum(np.cumsum(tails**2) - count * mean**2, 0.0) / count**2
    half = (groups + 1) // 2
    dropped = half - int(np.argmin(spread[::-1][: half + 1][::-1]))
    head, rest = means[:dropped], means[dropped:]
    if dropped == 0:
        return 0
    error = math.sqrt(rest.var(ddof=1) * autocorrelation_time([rest]) * (1.0 / len(head) + 1.0 / len(rest)))
    return dropped * GROUP if abs(float(head.mean() - rest.mean())) > SIGNIFICANT * error else 0


def series_of(runs: Sequence[Replicate]) -> dict[str, Array]:
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
    """Where counting starts: batch, transient found in the whole run [shaft turns] (None where the run is too short or
    follows a schedule), and what a result has to say about both."""

    first: int
    turns: float | None
    notes: tuple[str, ...]


def start_of_counting(scene: Scene, runs: Sequence[Replicate]) -> Start:
    """Where to start counting, as ``numerics.discard_turns`` asks: after so many turns, or after the transient."""
    numerics, run = scene.numerics, runs[0]
    if scene.operation.schedule is not None:
        return Start(run.first, None, ())
    known = [batches for series in series_of(runs).values() if (batches := find_transient(series)) is not None]
    transient = max(known, default=None)  # the longest; None where the run is too short to tell
    if transient is None:
        fewest = GROUP * FEWEST_GROUPS * run.durations[0] / scene.turn_s
        note = f"the run is too short to show its transient: {fewest:g} shaft turns are needed; lengthen numerics.turns"
        return Start(run.first, None, (note,))
    turns = round(float(run.durations[:transient].sum()) / scene.turn_s, 6)
    if numerics.discard_turns == "auto":
        # An impact window at least must be left to count.
        first = min(transient, len(run.durations) - run.per_window)
        return Start(first, turns, ())
    return Start(run.first, turns, ())
