"""Response surfaces of a study in perspective as PNG files."""

from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.ticker import MaxNLocator

from doe.response_surface import Surface
from doe.workflow.problem import Problem
from doe.workflow.settings import Asked
from rbdyn.base.words import label, quantity


def response_surface(study: Problem, surface: Surface, path: Path) -> None:
    """Surface over the first factor and each other one, the rest at their centre, with contours below."""
    factors, response = len(study.factors), Asked.of(study).response(surface.name)
    reach = study.design.reach
    grid = np.linspace(-reach, reach, 41)
    figure = plt.figure(figsize=(6.2 * (factors - 1), 5.2))
    for panel in range(1, factors):
        coded = np.zeros((grid.size, grid.size, factors))
        coded[..., 0], coded[..., panel] = np.meshgrid(grid, grid, indexing="ij")
        actual = study.actual(coded)
        values = surface.predict(coded)
        axis = figure.add_subplot(1, factors - 1, panel, projection="3d")
        x, y = actual[..., 0], actual[..., panel]
        axis.plot_surface(x, y, values, cmap="viridis", alpha=0.9, linewidth=0)
        span = np.ptp(values) or abs(float(values.mean())) or 1.0
        floor = values.min() - 0.35 * span
        axis.contour(x, y, values, zdir="z", offset=floor, cmap="viridis", levels=10, linewidths=0.9)
        top = values.max()
        for bound in response.bounds:
            if floor < bound < top + 0.5 * span:
                corners = [np.array([[side[0, 0], side[0, -1]], [side[-1, 0], side[-1, -1]]]) for side in (x, y)]
                plane = np.full((2, 2), bound)
                axis.plot_surface(*corners, plane, color="tab:red", alpha=0.25, linewidth=0)
                top = max(top, bound)
            if values.min() < bound < values.max():
                axis.contour(x, y, values, zdir="z", offset=floor, colors="tab:red", levels=[bound], linewidths=2.0)
        axis.set_zlim(floor, top)
        axis.set_xlabel(label(study.factors[0]), labelpad=8)
        axis.set_ylabel(label(study.factors[panel]), labelpad=8)
        axis.set_zlabel(response.label)
        rest = [place for place in range(1, factors) if place != panel]
        named = ((*quantity(study.factors[place]), study.centre[place]) for place in rest)
        fixed_factors = [f"{words} {centre:g} {unit}".rstrip() for words, unit, centre in named]
        notes = [*fixed_factors, *(f"limit {bound:g} in red" for bound in response.bounds)]
        axis.set_title(f"({'abcdefg'[panel - 1]}) {', '.join(notes)}", fontsize=10)
        axis.tick_params(labelsize=8)
        for side in (axis.xaxis, axis.yaxis, axis.zaxis):
            side.set_major_locator(MaxNLocator(4))
        axis.view_init(elev=24, azim=-128)
    figure.subplots_adjust(left=0.02, right=0.92, bottom=0.06, top=0.94, wspace=0.12)
    figure.savefig(path, dpi=130)
    plt.close(figure)
