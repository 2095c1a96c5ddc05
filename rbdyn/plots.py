"""Pictures of a simulation. matplotlib is loaded here and nowhere else in the package."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt

if TYPE_CHECKING:
    from rbdyn.accuracy import Row
    from rbdyn.dynamics.simulate import Trace

SHOWN_POCKETS = 3


def cage_orbit(traces: Mapping[str, Trace], radial_clearances: Sequence[float | None], path: Path) -> None:
    """Path of the cage centre: in its guide clearance above, enlarged below, a column a trace.

    ``radial_clearances`` in m; None where no land guides the cage.
    """
    figure, axes = plt.subplots(2, len(traces), figsize=(4.8 * len(traces), 9.0), squeeze=False)
    for column, (title, trace), clearance in zip(axes.T, traces.items(), radial_clearances, strict=True):
        x, y = trace.cage_x * 1e6, trace.cage_y * 1e6
        for axis in column:
            axis.plot(x, y, linewidth=0.6, color="tab:blue")
            axis.plot(x[0], y[0], "o", markersize=4, color="tab:green", label="start")
            axis.plot(x[-1], y[-1], "s", markersize=4, color="tab:red", label="end")
            axis.set_aspect("equal", adjustable="datalim")
            axis.set_xlabel("cage centre, along the load [µm]")
            axis.set_ylabel("across [µm]")
            axis.grid(alpha=0.3)
        if clearance is not None:
            angle = np.linspace(0.0, 2.0 * np.pi, 361)
            circle = clearance * 1e6 * np.array([np.cos(angle), np.sin(angle)])
            column[0].plot(*circle, "k--", linewidth=0.8, label="guide clearance")
        column[0].set_title(title)
        column[1].set_title("enlarged")
    axes[0][0].legend(loc="upper right", fontsize=8)
    _save(figure, path)


def pocket_forces(traces: Mapping[str, Trace], path: Path) -> None:
    """Wall forces of the pockets with the largest forces over time, a panel a trace."""
    figure, axes = plt.subplots(len(traces), 1, figsize=(9.0, 3.0 * len(traces)), squeeze=False, sharex=True)
    for axis, (title, trace) in zip(axes[:, 0], traces.items(), strict=True):
        order = np.argsort(-np.abs(trace.pocket_load).max(axis=0))[:SHOWN_POCKETS]
        for pocket in sorted(order):
            axis.plot(
                trace.time * 1e3, trace.pocket_load[:, pocket], linewidth=0.8, label=f"pocket {pocket + 1}"
            )
        axis.axhline(0.0, color="black", linewidth=0.6)
        axis.set_title(title)
        axis.set_ylabel("wall force [N]\nfront +, rear −")
        axis.grid(alpha=0.3)
        axis.legend(loc="upper right", fontsize=8)
    axes[-1, 0].set_xlabel("time after the transient [ms]")
    _save(figure, path)


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
    _save(figure, path)


def _save(figure: plt.Figure, path: Path) -> None:
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)
