"""Pictures of a study as PNG files: response surfaces, the search, the Pareto front, and the robust front."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib
import numpy as np

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from doe.report import still
from doe.report.sections.duty import gain_stills
from doe.report.sections.front_pictures import drawn_pairs, near
from doe.report.sections.search import search_stills
from doe.report.summary import Summary
from doe.response_surface import Surface
from doe.workflow.judgement import RobustFront
from doe.workflow.problem import Problem
from doe.workflow.search_record import SearchResult
from doe.workflow.settings import Asked
from doe.workflow.whole import StudyResult
from rbdyn.base.words import label, quantity

# Most pictures in a row.
COLUMNS = 3


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
        for one in (axis.xaxis, axis.yaxis, axis.zaxis):
            one.set_major_locator(MaxNLocator(4))
        axis.view_init(elev=24, azim=-128)
    figure.subplots_adjust(left=0.02, right=0.92, bottom=0.06, top=0.94, wspace=0.12)
    figure.savefig(path, dpi=130)
    plt.close(figure)


def adaptive_search(summary: Summary, search: SearchResult, path: Path) -> None:
    """Hypervolume against runs compared with other fronts, and where each run was spent and why."""
    progress, places = search_stills(summary, search)
    still.save([progress, *places], COLUMNS, path)


def duty_gains(record: Summary, path: Path) -> None:
    """Gains at each point of a duty, of the record of a study."""
    still.save(gain_stills(record), COLUMNS, path)


def pareto_front(outcome: StudyResult, path: Path) -> None:
    """Pairs of goals: the fronts, and baseline and pick both on the surfaces and simulated."""
    study, surfaces, asked = outcome.study, outcome.study.surfaces, Asked.of(outcome.study)
    clouds = [("front on the surfaces", outcome.front.values, "tab:blue")]
    if outcome.front.tolerance_aware is not None:
        clouds.append(("front with tolerances", outcome.front.tolerance_aware.values, "tab:purple"))
    if outcome.adaptive is not None:
        search = outcome.adaptive.search
        clouds.append(("front predicted by emulators", search.predictions[search.representatives], "tab:olive"))
        clouds.append(("its points, simulated anew", outcome.adaptive.front.values, "tab:green"))
    for axis, (i, j) in _pairs(drawn_pairs([response.goal for response in asked.responses]), path):
        for words, values, color in clouds:
            axis.plot(values[:, i], values[:, j], ".", color=color, markersize=4, label=words)
        for words, point, marker, color in (
            ("baseline", outcome.baseline, "s", "black"),
            ("pick", outcome.pick, "*", "tab:red"),
        ):
            coded = study.coded(point.point)
            prediction = [float(surface.predict(coded)) for surface in surfaces]
            size = 13 if marker == "*" else 6
            for x, simulated, face in ((prediction, "on the surfaces", color), (point.values, "simulated", "none")):
                axis.plot(x[i], x[j], marker, mfc=face, color=color, markersize=size, label=f"{words} {simulated}")
        for draw, response in ((axis.axvline, i), (axis.axhline, j)):
            shown = [outcome.baseline.values[response], outcome.pick.values[response], *clouds[0][1][:, response]]
            for bound in near(asked.responses[response].bounds, shown):
                draw(bound, color="tab:red", linestyle="--", linewidth=1.2, label="limit")
        axis.set_xlabel(asked.responses[i].label)
        axis.set_ylabel(asked.responses[j].label)


def robust_front(front: RobustFront, path: Path) -> None:
    """Every pair of gains that hold over the unknown inputs: predicted along the front, and simulated."""
    responses = list(front.q2)
    for axis, (i, j) in _pairs(drawn_pairs(["min"] * len(responses)), path):
        across, up = ([100.0 * point.gains[responses[place]] for point in front.points] for place in (i, j))
        axis.plot(across, up, ".", color="tab:blue", markersize=4, label="predicted by emulators")
        for point, marker in zip(front.confirmed, "*o^v", strict=False):
            x, y = (100.0 * point.gains[responses[place]] for place in (i, j))
            words = f"{point.name}, simulated: better in all in {100.0 * point.chances.all.value:.0f} %"
            color = "tab:red" if marker == "*" else "black"
            axis.plot(x, y, marker, mfc="none", color=color, markersize=9, label=words)
        axis.axhline(0.0, color="tab:gray", linewidth=1.0)
        axis.axvline(0.0, color="tab:gray", linewidth=1.0)
        axis.set_xlabel(f"gain in {quantity(responses[i])[0]} [%]")
        axis.set_ylabel(f"gain in {quantity(responses[j])[0]} [%]")


def _pairs(pairs: Sequence[tuple[int, int]], path: Path) -> Iterator[tuple[Axes, tuple[int, int]]]:
    """Axes for every pair of responses to draw on, COLUMNS in a row, saved with one legend in the end."""
    columns = min(COLUMNS, max(len(pairs), 1))
    rows = max(-(-len(pairs) // columns), 1)
    figure, axes = plt.subplots(rows, columns, figsize=(5.0 * columns, 4.4 * rows), squeeze=False)
    for axis in axes.flat[len(pairs) :]:
        axis.set_axis_off()
    yield from zip(axes.flat, pairs, strict=False)
    for axis in axes.flat[: len(pairs)]:
        axis.grid(alpha=0.3)
        axis.xaxis.set_major_locator(MaxNLocator(5))  # seven long numbers such as 0.0035 would run into each other
    figure.tight_layout()
    # Below the figure, where no point lies; every mark once.
    marks = {words: mark for axis in axes.flat for mark, words in zip(*axis.get_legend_handles_labels(), strict=True)}
    figure.legend(marks.values(), marks, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=2 * columns, fontsize=8)
    figure.savefig(path, dpi=130, bbox_inches="tight")
    plt.close(figure)
