"""Cage slip over speed and load."""

from pathlib import Path

import numpy as np

from rbdyn.dynamics.slip_map import SlipMap
from rbdyn.plots.style import plt, save

PANELS = (
    ("cage_slip", "cage slip [%]", 100.0),
    ("power_loss_W", "power loss [W]", 1.0),
    ("impact_force_N", "largest roller/cage force [N]", 1.0),
    ("whirl_deviation_ratio", "whirl deviation ratio", 1.0),
)


def draw(slip_map: SlipMap, path: Path) -> None:
    """A panel a figure, values written into the cells; failed points stay white."""
    speeds, loads = slip_map.speeds_rpm, slip_map.loads_N
    width = max(4.2, 0.85 * len(speeds) + 2.0)
    figure, axes = plt.subplots(2, 2, figsize=(2.0 * width, 2.0 * max(3.2, 0.5 * len(loads) + 1.8)))
    for axis, (name, label, unit) in zip(axes.ravel(), PANELS, strict=True):
        values = unit * slip_map.grid(name)
        image = axis.imshow(values, origin="lower", aspect="auto", cmap="cividis")
        middle = np.nanmean([np.nanmin(values), np.nanmax(values)]) if np.isfinite(values).any() else 0.0
        for (row, column), value in np.ndenumerate(values):
            text = f"{value:.3g}" if np.isfinite(value) else "failed"
            colour = "white" if np.isfinite(value) and value < middle else "black"
            axis.text(column, row, text, ha="center", va="center", fontsize=8, color=colour)
        axis.set_xticks(range(len(speeds)), [f"{speed:g}" for speed in speeds])
        axis.set_yticks(range(len(loads)), [f"{load:g}" for load in loads])
        axis.set(xlabel="inner speed [rpm]", ylabel="radial load [N]", title=label)
        figure.colorbar(image, ax=axis)
    save(figure, path)
