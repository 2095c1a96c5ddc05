"""Error against run time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rbdyn.plots.style import plt, save

if TYPE_CHECKING:
    from rbdyn.accuracy import Row


def work_precision(rows: Sequence[Row], path: Path) -> None:
    """Bias of each output, with its 95 % error, against the time of a shaft turn."""
    figure, axis = plt.subplots(figsize=(7.0, 4.8))
    for name in rows[0].bias:
        time = [row.turn_ms for row in rows[:-1]]
        bias = [max(abs(row.bias[name]), 1e-6) for row in rows[:-1]]
        line = axis.plot(bias, time, "o-", markersize=4, label=name.replace("_", " "))[0]
        floor = max(row.bias_error[name] for row in rows)
        axis.axvline(floor, color=line.get_color(), linestyle=":", linewidth=0.9)
    axis.plot(
        [max(row.power_gap, 1e-6) for row in rows], [row.turn_ms for row in rows], "k^-", label="power gap"
    )
    for row in rows:
        axis.annotate(f"{row.rtol:g}", (max(row.power_gap, 1e-6), row.turn_ms), fontsize=7, xytext=(4, 3),
                      textcoords="offset points")  # fmt: skip
    axis.set_xscale("log")
    axis.set_yscale("log")
    axis.set_xlabel(
        "relative bias (dotted: its 95 % statistical error); relative power gap, marked with rtol"
    )
    axis.set_ylabel("processor time of a shaft turn [ms]")
    axis.grid(alpha=0.3, which="both")
    axis.legend(fontsize=8)
    save(figure, path)
