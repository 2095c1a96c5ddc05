"""Run time over rollers and slices, memory over turns."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from rbdyn.plots.style import BLUE, GREY, plain, plt, save

if TYPE_CHECKING:
    from rbdyn.scaling import Scaling


def draw(found: Scaling, path: Path) -> None:
    """A panel a size, with the fitted line, and a panel of memory."""
    figure, axes = plt.subplots(1, 3, figsize=(12.0, 3.8), width_ratios=(1.0, 1.0, 0.6))
    for axis, (kind, line) in zip(axes, found.lines.items(), strict=False):
        points = found.points[kind]
        size = np.array([point.size for point in points])
        ends = np.array([0.0, size.max()])
        axis.plot(ends, 1e-3 * (line.fixed_ns + line.each_ns * ends), color=GREY, linewidth=1.0)
        axis.plot(size, [1e-3 * point.rhs_ns for point in points], "o", color=BLUE, markersize=5)
        axis.set_title(
            f"{line.fixed_ns:.0f} ns + {line.each_ns:.3g} ns each, r² = {line.r2:.4f}; "
            f"power n$^{{{line.exponent:.2f}}}$",
            fontsize=9,
        )
        axis.set_xlabel(kind if kind == "rollers" else "slices of a roller")
        axis.set_ylabel("time of a right-hand side [µs]")
        if size[0] == 1:
            whole = (1.0, 1e-3 * points[0].rhs_ns)
            axis.annotate("whole roller", whole, xytext=(8, -4), textcoords="offset points", fontsize=8)
        axis.set_xlim(-0.03 * size.max(), 1.05 * size.max())
        axis.set_ylim(bottom=0.0)
        plain(axis)
    bars = axes[-1].bar([f"{one.turns}" for one in found.memory], [one.peak_MiB for one in found.memory], 0.5,
                        color=BLUE)  # fmt: skip
    axes[-1].bar_label(bars, fmt="%.0f", fontsize=9)
    axes[-1].set_xlabel("counted shaft turns")
    axes[-1].set_ylabel("largest memory of the process [MiB]")
    axes[-1].margins(x=0.3, y=0.12)
    plain(axes[-1])
    save(figure, path)
