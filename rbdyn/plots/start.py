"""Picture of a start: temperatures and clearances over time, with their ranges over the inputs of the heat balance."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from rbdyn.clearances import REPORTED
from rbdyn.plots.style import BLUE, GREEN, GREY, INNER, ORANGE, OUTER, PURPLE, SKY, blank, plain, save
from rbdyn.result import StartResult

# Nodes in words with their colours; rings are full lines with a band.
NODES = {
    "rollers": ("rollers and cage", GREEN),
    "oil": ("oil", ORANGE),
    "inner": ("inner ring", INNER),
    "shaft": ("shaft", PURPLE),
    "outer": ("outer ring", OUTER),
    "housing": ("housing", SKY),
}
BANDED = ("inner", "outer")
# Figures of ball bearings whose largest value counts, in words.
OF_BALLS = {"axial_load_N": "axial load [N]", "contact_pressure_MPa": "contact pressure [MPa]"}
# Time shown over that to the steady state.
SHOWN = 1.5


def start(record: StartResult, path: Path) -> None:
    """Temperatures at the left, each clearance or load at the right with its extreme; lighter: 90 % over the inputs."""
    shown = {f"{clearance.name}_um": f"{clearance.name} clearance [µm]" for clearance in REPORTED} | OF_BALLS
    names = [name for name in shown if name in record.path.figures]
    figure = blank((10.0, 6.5))
    grid = figure.add_gridspec(len(names), 2)
    left = figure.add_subplot(grid[:, 0])
    times = np.array(record.path.time_s)
    end = times[-1] if record.time_to_steady_s is None else min(SHOWN * record.time_to_steady_s, times[-1])
    for node, (words, colour) in NODES.items():
        style = "-" if node in BANDED else "--"
        if node == "rollers" and record.contact_pressure_MPa is not None:
            words = "balls"
        left.plot(times, record.path.temperatures_C[node], style, color=colour, linewidth=1.6, label=words)
        if node in BANDED:
            low, high = record.path.ranges[node]
            left.fill_between(times, low, high, color=colour, alpha=0.12, linewidth=0.0)
    left.legend(fontsize=9, loc="lower right", frameon=False)
    _over_time(left, "temperature [°C]", end)
    for row, name in enumerate(names):
        _figure(figure.add_subplot(grid[row, 1], sharex=left), record, name, shown[name], end)
    figure.suptitle("Start of the cold machine; shaded: 90 % over the inputs of the heat balance", fontsize=11)
    save(figure, path)


def _figure(axis: Axes, record: StartResult, name: str, words: str, end: float) -> None:
    """A figure over time; the least clearance, or the largest of another figure, is marked with its time."""
    times, column = np.array(record.path.time_s), np.array(record.path.figures[name])
    if name in record.path.ranges:
        low, high = record.path.ranges[name]
        axis.fill_between(times, low, high, color=BLUE, alpha=0.15, linewidth=0.0)
    axis.plot(times, column, color=BLUE, linewidth=1.6)
    row = int(column.argmax() if name in OF_BALLS else column.argmin())
    axis.plot(times[row], column[row], "o", color=BLUE, markersize=5)
    unit = words[words.index("[") + 1 : -1]
    text = f"{column[row]:.4g} {unit} after {times[row]:.3g} s"
    near = times[row] > 0.6 * end
    axis.margins(y=0.2)
    axis.annotate(
        text, (times[row], column[row]), (-6.0 if near else 6.0, 5.0 if name in OF_BALLS else -13.0), textcoords="offset points", fontsize=9,
        ha="right" if near else "left",
    )  # fmt: skip
    if column.min() < 0.0:
        axis.axhline(0.0, color=GREY, linewidth=0.8)
    _over_time(axis, words, end)


def _over_time(axis: Axes, words: str, end: float) -> None:
    axis.set(xlabel="time from the start [s]", ylabel=words)
    axis.set_xlim(0.0, end)
    plain(axis)
