"""How every picture looks: colours told apart by all eyes, axes, saving. matplotlib is set up here."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Okabe and Ito 2008: told apart with any common colour blindness, and in grey by lightness.
BLUE, ORANGE, GREEN, VERMILION, SKY, PURPLE = (
    "#0072B2", "#E69F00", "#009E73", "#D55E00", "#56B4E9", "#CC79A7",
)  # fmt: skip
GREY = "#555555"
OUTER, INNER, POCKET = BLUE, VERMILION, GREEN


def plain(axis: Axes) -> None:
    """A light grid and no box."""
    axis.grid(alpha=0.25, linewidth=0.6)
    axis.set_axisbelow(True)
    axis.spines[["top", "right"]].set_visible(False)


def save(figure: Figure, path: Path) -> None:
    """Fit the labels, write the file, let go of the figure."""
    figure.tight_layout()
    figure.savefig(path, dpi=130)
    plt.close(figure)
