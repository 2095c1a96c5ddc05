"""Solvers of the equilibrium of ball bearings: residual against time, and share of scenes solved in time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import LogLocator

from rbdyn.plots.accuracy import MARKS, METHOD_COLOURS, Named, logarithmic
from rbdyn.plots.style import label_ends, plain, plt, save

if TYPE_CHECKING:
    from rbdyn.accuracy.ball_solvers import Attempt

# Below, a residual is rounding.
FLOOR = 1e-18


def residual_at_work(attempts: Sequence[Attempt], path: Path) -> None:
    """Residual of each solver stopped after more and more iterations, against its time."""
    figure, axis = plt.subplots(figsize=(7.6, 5.0))
    logarithmic(axis, "residual over the largest force", "time of a call [us]")
    axis.xaxis.set_major_locator(LogLocator(base=100.0, numticks=12))
    ends: list[Named] = []
    names = list(dict.fromkeys(attempt.solver for attempt in attempts))
    for name, mark, colour in zip(names, MARKS, METHOD_COLOURS, strict=False):
        points = [(max(a.residual, FLOOR), a.solve_us) for a in attempts if a.solver == name]
        axis.plot(*zip(*points, strict=True), mark, linestyle="-", color=colour, markersize=4.5,
                  linewidth=2.0 if name == names[0] else 1.0)  # fmt: skip
        ends.append((points, name, colour))
    axis.margins(0.12)
    label_ends(axis, ends)
    save(figure, path)


def solved_in_time(times_us: Mapping[str, Sequence[float | None]], path: Path) -> None:
    """Share of the scenes that each solver has solved within a time [us]; None where it failed."""
    figure, axis = plt.subplots(figsize=(7.6, 5.0))
    axis.set_xscale("log")
    axis.set_xlabel("time of a call [us]")
    axis.set_ylabel("share of scenes solved within it [%]")
    axis.set_ylim(0.0, 103.0)
    plain(axis)
    ends: list[Named] = []
    for (name, times), colour in zip(times_us.items(), METHOD_COLOURS, strict=False):
        solved = np.sort([took for took in times if took is not None])
        if solved.size:
            share = 100.0 * np.arange(1, solved.size + 1) / len(times)
            axis.step(solved, share, where="post", color=colour, linewidth=2.0 if colour == "black" else 1.2)
            ends.append(([(float(solved[0]), float(share[0])), (float(solved[-1]), float(share[-1]))], name, colour))
    axis.margins(x=0.15)
    label_ends(axis, ends)
    save(figure, path)
