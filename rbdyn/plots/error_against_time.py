"""Error against run time: error to the right, time upwards, both logarithmic; lower left is better."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rbdyn.plots.style import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILION, label_ends, plain, plt, save

COLOURS = {"impact_force_N": VERMILION, "whirl_deviation_ratio": ORANGE, "power_loss_W": BLUE}
NAMES = {"impact_force_N": "impact force", "whirl_deviation_ratio": "whirl ratio", "power_loss_W": "power loss"}
# Ours stands out; the others share a colour a family and differ by mark.
MARKS = ("o", "s", "D", "^", "v", "P", "X", "<", ">", "h")
METHOD_COLOURS = ("black", GREEN, SKY, BLUE, PURPLE, VERMILION, ORANGE, "#8C510A", GREY, "#7A6BB0")
SMALLEST_BIAS = 1e-6

Points = Sequence[tuple[float, float]]
Named = tuple[Points, str, str]  # points, text and colour of a line


def logarithmic(axis: Axes, across: str, up: str) -> None:
    """Both axes logarithmic, named."""
    axis.set(xscale="log", yscale="log", xlabel=across, ylabel=up)
    axis.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.yaxis.set_major_formatter(FuncFormatter(lambda value, place: f"{value:g}"))
    axis.yaxis.set_minor_formatter(NullFormatter())
    axis.xaxis.set_minor_formatter(NullFormatter())
    plain(axis)


def biases_at_work(
    rows: Sequence[Any], path: Path, sought: float, labels: tuple[str, str], time: str, line: tuple[str, str], mark: str
) -> None:
    """Bias of each output against the field ``time`` of the rows, next to a named line of another field, whose points bear
    the field ``mark``."""
    figure, axis = plt.subplots(figsize=(7.6, 5.0))
    logarithmic(axis, *labels)
    times, errors, marks = ([getattr(row, name) for row in rows] for name in (time, line[1], mark))
    ends = outputs_at_work(axis, rows, times, sought)
    ends.append(marked(axis, line[0], errors, times, [f"{each:g}" for each in marks]))
    axis.margins(0.12)
    axis.axvline(sought, color=GREY, linewidth=0.8, linestyle=":")
    axis.set_title(
        f"grey: {mark}; whiskers: to bias plus 95 % error; open marks: that error hides whether it is {100.0 * sought:g} %",
        fontsize=9,
        color=GREY,
    )
    label_ends(axis, ends)
    save(figure, path)


def method_lines(axis: Axes, lines: Mapping[str, Points]) -> tuple[list[Named], dict[str, str]]:
    """A line a method, the first of them bold, where it has points: what ``label_ends`` takes, and the colours of all."""
    colours, first = dict(zip(lines, METHOD_COLOURS, strict=False)), next(iter(lines))
    ends: list[Named] = []
    for (name, points), mark in zip(lines.items(), MARKS, strict=False):
        if points:
            axis.plot(*zip(*points, strict=True), mark, linestyle="-", color=colours[name], markersize=4.5,
                      linewidth=2.0 if name == first else 1.0)  # fmt: skip
            ends.append((points, name, colours[name]))
    return ends, colours


def failed_at_the_edge(axis: Axes, failures: dict[str, tuple[list[float], str]]) -> None:
    """Crosses at the right edge, at the time it took to fail; names next to them, one above the other."""
    edge = axis.get_yaxis_transform()
    lowest = 0.0
    for name, (times, colour) in sorted(failures.items(), key=lambda failure: max(failure[1][0])):
        axis.plot([1.0] * len(times), times, "x", color=colour, clip_on=False, transform=edge)
        height = max(axis.transAxes.inverted().transform(edge.transform((1.0, max(times))))[1], lowest)
        axis.annotate(f"{name} failed", (1.0, height), xycoords="axes fraction", fontsize=7, color=colour,
                      va="center", xytext=(6, 0), textcoords="offset points", annotation_clip=False)  # fmt: skip
        lowest = height + 0.025


def outputs_at_work(axis: Axes, rows: Sequence[Any], times: Sequence[float], sought: float) -> list[Named]:
    """Bias of each output of all rows but the last, the reference, with a whisker as far as its error reaches; open
    marks where that hides it."""
    ends: list[Named] = []
    for name, colour in COLOURS.items():
        points = [(max(abs(row.bias[name]), SMALLEST_BIAS), time) for row, time in zip(rows, times, strict=True)]
        for point, row in zip(points[:-1], rows, strict=False):
            filled = row.verdict_of(name, sought) != "undecided"
            reach = [point[0], point[0] + row.bias_error[name]]
            axis.plot(reach, [point[1]] * 2, color=colour, linewidth=0.8, alpha=0.6)
            axis.plot(*point, "o", color=colour, markersize=5, markerfacecolor=colour if filled else "white")
        ends.append((points[:-1], NAMES[name], colour))
    return ends


def marked(axis: Axes, name: str, errors: Sequence[float], times: Sequence[float], marks: Sequence[str]) -> Named:
    """A black line whose points bear marks."""
    errors = [max(error, SMALLEST_BIAS) for error in errors]
    axis.plot(errors, times, "k^-", linewidth=1.2, markersize=5)
    for error, time, mark in zip(errors, times, marks, strict=True):
        axis.annotate(mark, (error, time), fontsize=7, color=GREY, xytext=(-5, -9),
                      textcoords="offset points", ha="right")  # fmt: skip
    return list(zip(errors, times, strict=True)), name, "black"
