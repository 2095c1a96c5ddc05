"""How every picture looks: colours that all eyes distinguish, axes, labels, saving; matplotlib is set up here.

Error against run time: error to the right, time upwards, both logarithmic; lower left is better.
"""

import io
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from rbdyn.base.arrays import Array
from rbdyn.base.html import add_copy, is_copying

# Okabe and Ito 2008: distinct with any common colour blindness, and in grey by lightness.
BLUE, ORANGE, GREEN, VERMILION, SKY, PURPLE = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7",
)  # fmt: skip
GREY = "#555555"
PNG = {"compress_level": 3}  # as small as by the level 6 of Pillow, in two thirds of the time
OUTER, INNER = BLUE, VERMILION

# Places of a label next to the end of its line: offset [points] and alignment, best first.
SIDES: tuple[tuple[float, Literal["left", "center", "right"]], ...] = ((0.0, "center"), (7.0, "left"), (-7.0, "right"))
PLACES = [((right, up), side) for up in (9.0, 0.0, -9.0, 14.0, -14.0, 20.0, -20.0, 27.0) for right, side in SIDES]


def plain(axis: Axes) -> None:
    """A light grid and no box."""
    axis.grid(alpha=0.25, linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def blank(size: tuple[float, float], dpi: float | None = None) -> Figure:
    """A figure of a size [in]. Without pyplot, whose import takes a fifth of a second for windows that no command has."""
    figure = Figure(size, dpi)
    FigureCanvasAgg(figure)
    return figure


def subplots(*shape: int, figsize: tuple[float, float], grid: bool = True, **options: Any) -> tuple[Figure, Any]:
    """A figure of a size [in] and its axes in rows and columns; maps have no ``grid``."""
    figure = blank(figsize)
    axes = figure.subplots(*shape, **options)
    if grid:
        for axis in figure.axes:
            plain(axis)
    return figure, axes


def save(figure: Figure, path: Path) -> None:
    """Fit the labels above the legend of the figure, write the file, hand a copy to the page that is made."""
    legends = [legend.get_window_extent().height for legend in figure.legends]
    figure.tight_layout(rect=(0.0, max(legends, default=0.0) / figure.bbox.height, 1.0, 1.0))
    figure.savefig(path, dpi=130, pil_kwargs=PNG)
    if is_copying():
        text = io.StringIO()
        # No date and no random name, so that equal pictures are equal texts.
        metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        with matplotlib.rc_context({"svg.fonttype": "none", "svg.hashsalt": path.name}):
            figure.savefig(text, format="svg", metadata=metadata)
        add_copy(path, text.getvalue())


def label_ends(axis: Axes, lines: Sequence[tuple[Sequence[tuple[float, float]], str, str]]) -> None:
    """Write (points, text, colour) of lines at one of their ends, where the text covers no line and no other text.

    Call it last: limits and size of the axis must be final.
    """
    figure = axis.get_figure()
    assert isinstance(figure, Figure)
    figure.tight_layout()
    boxes = [note.get_window_extent() for note in axis.texts]
    points_of_lines = np.concatenate([_along(line) for line in axis.lines])
    inside = axis.get_window_extent()
    for points, text, colour in lines:
        note = axis.annotate(text, points[-1], xytext=(0.0, 0.0), textcoords="offset points", color=colour,
                             fontsize=8, va="center")  # fmt: skip
        for (shift, side), end in itertools.product(PLACES, (points[-1], points[0])):
            note.xy = end
            note.set_position(shift)
            note.set_horizontalalignment(side)
            box = note.get_window_extent()
            free = not any(box.overlaps(other) for other in boxes) and box.count_contains(points_of_lines) == 0
            if free and inside.x0 < box.x0 and box.x1 < inside.x1 and inside.y0 < box.y0 and box.y1 < inside.y1:
                break
        boxes.append(box)


def _along(line: Line2D) -> Array:
    """Points all along a line, in pixels."""
    corners = line.get_transform().transform(line.get_xydata())
    share = np.linspace(0.0, 1.0, 40)[:, np.newaxis]
    pieces = [a + share * (b - a) for a, b in itertools.pairwise(corners)]
    return np.concatenate([corners, *pieces])


# Colours of the classes of a cage by its orbit.
CAGE_COLOURS = {
    "held": BLUE, "circling": GREEN, "fast whirl": VERMILION, "rattling": ORANGE, "wandering": PURPLE, "undecided": GREY,
    "not judged": GREY,
}  # fmt: skip
COLOURS = {"impact_force_N": VERMILION, "whirl_deviation_ratio": ORANGE, "power_loss_W": BLUE}
NAMES = {"impact_force_N": "impact force", "whirl_deviation_ratio": "whirl ratio", "power_loss_W": "power loss"}
# Ours is black; the others share a colour a family and differ by mark.
MARKS = ("o", "s", "D", "^", "v", "P", "X", "<", ">", "h")
METHOD_COLOURS = ("black", GREEN, SKY, BLUE, PURPLE, VERMILION, ORANGE, "#8C510A", GREY, "#7A6BB0", "#B8860B")
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


def biases_at_work(
    rows: Sequence[Any], path: Path, margin: float, labels: tuple[str, str], time: str, line: tuple[str, str], mark: str
) -> None:
    """Bias of each output against the field ``time`` of the rows, and a named line of another field with marks.

    ``line``: name and field; ``mark``: field written at the points of that line.
    """
    figure, axis = subplots(figsize=(7.6, 5.0))
    logarithmic(axis, *labels)
    times, errors, marks = ([getattr(row, name) for row in rows] for name in (time, line[1], mark))
    ends = outputs_at_work(axis, rows, times, margin)
    ends.append(marked(axis, line[0], errors, times, [f"{value:g}" for value in marks]))
    axis.margins(0.12)
    axis.axvline(margin, color=GREY, linewidth=0.8, linestyle=":")
    axis.set_title(
        f"grey: {mark}; whiskers: to bias plus 95 % error; open marks: that error hides whether it is {100.0 * margin:g} %",
        fontsize=9,
        color=GREY,
    )
    label_ends(axis, ends)
    save(figure, path)


def method_lines(axis: Axes, lines: Mapping[str, Points]) -> tuple[list[Named], dict[str, str]]:
    """A line for each method with points, the first one bold: input of ``label_ends``, and the colours of all."""
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


def outputs_at_work(axis: Axes, rows: Sequence[Any], times: Sequence[float], margin: float) -> list[Named]:
    """Bias of each output of all rows but the last, the reference, with a whisker to bias plus error.

    Marks are open where the verdict is undecided.
    """
    ends: list[Named] = []
    for name, colour in COLOURS.items():
        points = [(max(abs(row.bias[name]), SMALLEST_BIAS), time) for row, time in zip(rows, times, strict=True)]
        for point, row in zip(points[:-1], rows, strict=False):
            filled = row.verdict_of(name, margin) != "undecided"
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
