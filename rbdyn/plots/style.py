"""How every picture looks: colours that all eyes distinguish, axes, saving. matplotlib is set up here."""

import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import matplotlib
import numpy as np

from rbdyn.base.arrays import Array

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

# Okabe and Ito 2008: distinct with any common colour blindness, and in grey by lightness.
BLUE, ORANGE, GREEN, VERMILION, SKY, PURPLE = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7",
)  # fmt: skip
GREY = "#555555"
OUTER, INNER, POCKET = BLUE, VERMILION, GREEN

# Where a label may stand next to the end of its line: offset [points] and alignment, best first.
SIDES: tuple[tuple[float, Literal["left", "center", "right"]], ...] = ((0.0, "center"), (7.0, "left"), (-7.0, "right"))
PLACES = [((right, up), side) for up in (9.0, 0.0, -9.0, 14.0, -14.0, 20.0, -20.0, 27.0) for right, side in SIDES]


def plain(axis: Axes) -> None:
    """A light grid and no box."""
    axis.grid(alpha=0.25, linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def save(figure: Figure, path: Path) -> None:
    """Fit the labels, write the file, let go of the figure."""
    figure.tight_layout()
    # What stands outside the axes, such as a legend, needs a page fitted to it.
    figure.savefig(path, dpi=130, bbox_inches="tight" if figure.legends else None)
    plt.close(figure)


def label_ends(axis: Axes, lines: Sequence[tuple[Sequence[tuple[float, float]], str, str]]) -> None:
    """Write (points, text, colour) of lines at one of their ends, where it covers no line and no other text.

    Call it last: limits and size of the axis must be final.
    """
    figure = axis.get_figure()
    assert isinstance(figure, Figure)
    figure.tight_layout()
    taken = [note.get_window_extent() for note in axis.texts]
    drawn = np.concatenate([_along(line) for line in axis.lines])
    inside = axis.get_window_extent()
    for points, text, colour in lines:
        note = axis.annotate(text, points[-1], xytext=(0.0, 0.0), textcoords="offset points", color=colour,
                             fontsize=8, va="center")  # fmt: skip
        for (shift, side), end in itertools.product(PLACES, (points[-1], points[0])):
            note.xy = end
            note.set_position(shift)
            note.set_horizontalalignment(side)
            box = note.get_window_extent()
            free = not any(box.overlaps(other) for other in taken) and box.count_contains(drawn) == 0
            if free and inside.x0 < box.x0 and box.x1 < inside.x1 and inside.y0 < box.y0 and box.y1 < inside.y1:
                break
        taken.append(box)


def _along(line: Line2D) -> Array:
    """Points all along a line, in pixels."""
    corners = line.get_transform().transform(line.get_xydata())
    share = np.linspace(0.0, 1.0, 40)[:, np.newaxis]
    pieces = [a + share * (b - a) for a, b in itertools.pairwise(corners)]
    return np.concatenate([corners, *pieces])
