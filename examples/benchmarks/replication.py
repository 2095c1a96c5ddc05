"""Statistical error against run time: how many replicates, and how many turns of each.

From one pool of replicates at each length: the half-width of the 95 % interval of a mean over n of them, with the
scatter of the whole pool (expected, not that of one lucky draw of n), and the time they take with the turns that each
discards. Independent samples narrow it as one over the root of all counted turns; the slopes tell whether they do.

``python examples/benchmarks/replication.py [SCENE.toml]``
"""

import math
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from studies import main

from rbdyn.accuracy.report import Progress, Report, Reporter, flat, records, reported
from rbdyn.accuracy.tolerances import MARGIN, OUTPUTS, about, percent
from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Column, Sheet, columns_of
from rbdyn.base.records import Record, shown
from rbdyn.base.words import NORMAL, with_error
from rbdyn.dynamics.ensemble import Stop
from rbdyn.dynamics.parameters.model import roller_bearing
from rbdyn.dynamics.recording import run_series
from rbdyn.dynamics.run import prepare, with_numerics
from rbdyn.dynamics.statistics.batch_means import student_factor
from rbdyn.scene import Scene

POOL = 32
TURNS = (10.0, 20.0, 40.0, 80.0)
COUNTS = (2, 4, 8, 16, 32)
# A slope known no better than this does not tell independent turns, -0.5, from ones that tell nothing new, 0.
SLOPE_ERROR = 0.25


class Row(Record):
    """So many replicates of so many counted turns: processor time [s], per output the relative half-width."""

    replicates: int = shown("replicates")
    turns: float = shown("turns each", "g")
    cpu_s: float = shown("processor s", ".2f")
    half_width: dict[str, float]


COLUMNS = (*columns_of(Row), *Column[Row]("{}", percent, "{} ±", at=("half_width", "{}"), files=False).of(OUTPUTS))


class Slope(Record):
    """Power of the counted turns with which the scatter between replicates falls, and its 95 % half-width; -0.5 where
    pieces of a run are independent."""

    power: float
    half_width: float

    @property
    def as_expected(self) -> bool | None:
        """Whether -0.5 lies within the error; None where that is too wide to tell."""
        if self.half_width > SLOPE_ERROR:
            return None
        return abs(self.power + 0.5) <= self.half_width


def study(
    scene: Scene, progress: Reporter = None, turns: Sequence[float] = TURNS, pool: int = POOL, sought: float = MARGIN
) -> Report:
    """Half-widths, how they fall, and what a choice of replicates buys. Raises RunError, KeyboardInterrupt."""
    values, cpu_s = pool_of_runs(scene, turns, pool, progress)
    rows = replication_rows(values, cpu_s, [count for count in COUNTS if count <= pool])
    slopes = {name: slope(turns, [values[length][name] for length in turns]) for name in OUTPUTS}
    sentences = conclusion(rows, slopes, scene, pool, sought)
    written = records(rows)
    return reported(
        "replicates",
        (Sheet("95 % half-widths, relative", COLUMNS, rows).block,),
        sentences,
        [flat(row, "half_width") for row in written],
        lambda path: _draw(rows, path),
        rows=written,
        slopes={name: asdict(one) for name, one in slopes.items()},
        conclusion=" ".join(sentences),
        pool=pool,
        sought=sought,
        discard_turns=scene.numerics.warm_up_turns,
    )


def pool_of_runs(
    scene: Scene, turns: Sequence[float], pool: int, progress: Reporter = None
) -> tuple[dict[float, dict[str, Array]], dict[float, float]]:
    """Per length the outputs of every replicate, and the mean processor time of one [s], discarded turns included.

    The window of the impact force is the shortest length throughout: over another the force would be another figure.
    """
    counted = Progress(progress, len(turns) * pool)
    values, cpu_s = {}, {}
    for length in turns:
        longer = with_numerics(scene, turns=length, replicates=pool, impact_window_turns=min(turns))
        bearing = roller_bearing(longer)
        prepare(longer, bearing)
        runs = run_series(longer, bearing, [scene.numerics.rtol], None, counted.step, Stop())[0]
        values[length] = {name: np.array([figure(run) for run in runs]) for name, figure in OUTPUTS.items()}
        cpu_s[length] = float(np.mean([run.cpu_s for run in runs]))
    return values, cpu_s


def replication_rows(
    values: dict[float, dict[str, Array]], cpu_s: dict[float, float], counts: Sequence[int]
) -> list[Row]:
    """Expected half-widths of means over each number of replicates of each length."""
    return [
        Row(
            replicates=count,
            turns=length,
            cpu_s=count * cpu_s[length],
            half_width={name: expected_half_width(sample, count) for name, sample in values[length].items()},
        )
        for length in values
        for count in counts
    ]


def expected_half_width(sample: Array, count: int) -> float:
    """Half-width for ``count`` replicates that scatter as the whole sample does, over the sample's mean."""
    relative = float(sample.std(ddof=1) / (abs(sample.mean()) or 1.0))
    return student_factor(count - 1) * relative / math.sqrt(count)


def slope(turns: Sequence[float], samples: Sequence[Array]) -> Slope:
    """Least squares of log scatter over log turns; ln s scatters by 1/sqrt(2 (n - 1)) for n normal values.

    The lengths share their beginnings, so their scatters do not err independently and the half-width is a rough one.
    """
    x = np.log(turns)
    y = [math.log(sample.std(ddof=1) / abs(sample.mean())) for sample in samples]
    centred = x - x.mean()
    return Slope(
        float(centred @ np.array(y) / (centred @ centred)),
        scatter_error(len(samples[0])) / math.sqrt(float(centred @ centred)),
    )


def scatter_error(pool: int) -> float:
    """95 % half-width of the logarithm of a standard deviation over ``pool`` normal values."""
    return NORMAL / math.sqrt(2.0 * (pool - 1))


def conclusion(
    rows: Sequence[Row], slopes: dict[str, Slope], scene: Scene, pool: int = POOL, sought: float = MARGIN
) -> list[str]:
    """Whether the error falls as it should, and what the scene's choice among the rows buys, as far as the scatter of
    ``pool`` replicates is known."""
    sentences = []
    for name, fall in slopes.items():
        verdict = "as independent turns do" if fall.as_expected else "not as independent turns do (-0.5)"
        if fall.as_expected is None:
            verdict = f"undecided: errors of {fall.half_width:.2g} hide a difference of {abs(fall.power + 0.5):.2g}"
            larger = about(1.0 + (pool - 1) * (fall.half_width / SLOPE_ERROR) ** 2)
            verdict += f"; a pool of about {larger} replicates tells"
        what = f"{name}: scatter falls with counted turns to the power {with_error(fall.power, fall.half_width)}"
        sentences.append(f"{what}, {verdict}.")
    sentences += [_choice(name, rows, scatter_error(pool), sought) for name in OUTPUTS]
    numerics = scene.numerics
    sentences.append(f"The scene has {numerics.replicates} of {numerics.turns:g}.")
    return sentences


def _choice(name: str, rows: Sequence[Row], unsure: float, sought: float) -> str:
    """The quickest choice whose half-width is at most the one sought even where the scatter is as large as it may be."""
    good = [row for row in rows if row.half_width[name] * math.exp(unsure) <= sought]
    if good:
        best = min(good, key=lambda row: row.cpu_s)
        return f"{name} within {percent(sought)}: {best.replicates} replicates of {best.turns:g} turns, {best.cpu_s:.2g} s."
    sharpest = min(rows, key=lambda row: row.half_width[name])
    width, most = sharpest.half_width[name], f"{sharpest.replicates} replicates of {sharpest.turns:g} turns"
    if width * math.exp(-unsure) > sought:
        by_root = about(sharpest.replicates * (width / sought) ** 2)
        return f"{name} within {percent(sought)}: more than {most}; by the square root about {by_root} of them."
    reach = f"{most} reach {percent(width)}, known to a factor of {math.exp(unsure):.2g}"
    return f"{name} within {percent(sought)}: undecided; {reach}."


def _draw(rows: Sequence[Row], path: Any) -> None:
    """Half-width of each output against processor time, a line a length of run; dashed: one over root of time."""
    from matplotlib.ticker import FuncFormatter, LogLocator

    from rbdyn.plots.style import (
        BLUE,
        GREEN,
        GREY,
        NAMES,
        ORANGE,
        PURPLE,
        SKY,
        VERMILION,
        Named,
        label_ends,
        logarithmic,
        save,
        subplots,
    )

    names = list(rows[0].half_width)
    lengths = list(dict.fromkeys(row.turns for row in rows))
    figure, axes = subplots(1, len(names), figsize=(12.0, 4.6), sharey=True)
    ends: list[list[Named]] = []
    for axis, name in zip(axes, names, strict=True):
        logarithmic(axis, "relative 95 % half-width", "processor time [s]" if axis is axes[0] else "")
        ends.append([])
        for length, colour in zip(lengths, (SKY, BLUE, GREEN, ORANGE, VERMILION, PURPLE), strict=False):
            points = [(row.half_width[name], row.cpu_s) for row in rows if row.turns == length]
            axis.plot(*zip(*points, strict=True), "o-", color=colour, markersize=4)
            ends[-1].append((points, f"{length:g} turns", colour))
        width, time = points[-1]
        axis.plot([width, 8.0 * width], [time, time / 64.0], "--", color=GREY, linewidth=0.9, zorder=0)
        axis.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        axis.xaxis.set_major_formatter(FuncFormatter(lambda value, place: f"{value:g}"))
        axis.set_title(NAMES[name], fontsize=10)
        axis.margins(0.12)
    axes[0].set_ylim(top=axes[0].get_ylim()[1] * 2.0)
    for axis, own in zip(axes, ends, strict=True):
        label_ends(axis, own)
    save(figure, path)


if __name__ == "__main__":
    sys.exit(main(study, __doc__))
