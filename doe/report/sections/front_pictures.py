"""Pictures of the Pareto front: every pair of responses, parallel coordinates, the genetic search, and the search in few runs.

They are stills. Those of the search in few runs show how far its front came, run by run, compared with other fronts, and where each
run was spent and why. ``front.js`` adds the marked point, which it finds by the axes that each picture states in ``data-front``.
"""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field, replace
from functools import partial
from itertools import combinations
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

from doe.report.still import COLOURS, SMALL, Point, Still, name_marks
from doe.report.summary import Summary
from doe.workflow.confirmation import ConfirmedPoint, point_words
from doe.workflow.front_record import Point as FrontPoint
from doe.workflow.front_record import SearchResult
from doe.workflow.problem import Factor
from rbdyn.base.records import Record
from rbdyn.base.words import label, quantity, shown, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Range = tuple[float, float]
# Two responses of a confirmed point, and the half-widths of their intervals.
Simulated = tuple[Point, tuple[float | None, float | None]]


# Marker, size [pt] and colour of a point by its name, so that no two are told apart by colour alone.
MARKS = {
    "baseline": ("s", 8.0, "ink"),
    "pick": ("*", 14.0, "vermilion"),
    "knee": ("D", 8.0, "orange"),
    "desirability": ("^", 9.0, "green"),
    "weights": ("v", 9.0, "purple"),
    "without_tolerances": ("P", 10.0, "vermilion"),
}


OTHER = ("h", 9.0, "purple")


# Colour of the points of a front, and whether they are rings.
FRONTS = {"front": ("blue", False), "robust": ("purple", True), "direct": ("green", True)}


DOT, RING = 5.2, 1.8  # diameter of a point and thickness of a ring [pt]


LEGEND_ROW = 17.0  # [pt]


PARALLEL: dict[str, Any] = {
    "width": 760.0, "height": 260.0, "left_margin": 12.0, "bottom_margin": 20.0, "top_margin": 40.0
}  # fmt: skip


# Most pictures of pairs of responses: those of six goals.
MOST_PAIRS = 15


# Width of a picture with parallel axes for each of them [pt].
AXIS_WIDTH = 96.0


# Look of a limit of a response.
LIMIT: dict[str, Any] = {"color": COLOURS["vermilion"], "linewidth": 1.6, "dashes": (4.4, 1.9)}


class Front(Record):
    """A set of points to look through; ``role`` tells them apart in pictures."""

    role: str
    words: str
    points: Sequence[FrontPoint]


class Coordinate(Record):
    """A factor or a response along which points are drawn: the ``kind`` of value, its name and its place among its kind."""

    kind: str
    name: str
    place: int
    ends: Range

    def values(self, points: Iterable[FrontPoint]) -> list[float]:
        """Its value at each point."""
        return [getattr(point, self.kind)[self.name] for point in points]

    def share(self, point: FrontPoint) -> float:
        """Where the value of a point is between the ends, 0 to 1."""
        low, high = self.ends
        return float((getattr(point, self.kind)[self.name] - low) / (high - low))


def drawn_pairs(goals: Sequence[str]) -> list[tuple[int, int]]:
    """Places of the pairs of responses that are drawn, of goals; where there are fewer than two, limited ones follow.

    A goal of "none" is that of a response that only has limits. There are never more than MOST_PAIRS.
    """
    aims = [place for place, goal in enumerate(goals) if goal != "none"]
    limited = [place for place, goal in enumerate(goals) if goal == "none"]
    return list(combinations(aims if len(aims) > 1 else [*aims, *limited], 2))[:MOST_PAIRS]


def near(bounds: Iterable[float], values: Iterable[float]) -> list[float]:
    """Limits no farther from the values than these are from each other; a farther one would leave no room for the front."""
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    return [bound for bound in bounds if 2.0 * low - high <= bound <= 2.0 * high - low]


class Fronts(Record):
    """Fronts that are drawn together, with ``marks`` by name, what simulation ``confirmed`` of them, and limits by response."""

    sets: Sequence[Front]
    marks: Mapping[str, FrontPoint]
    confirmed: Mapping[str, ConfirmedPoint] = field(default_factory=dict)
    limits: Mapping[str, Sequence[float]] = field(default_factory=dict)

    @property
    def points(self) -> list[FrontPoint]:
        """Points of all fronts, and the marks."""
        return [*(point for front in self.sets for point in front.points), *self.marks.values()]

    def pairs(self, goals: Mapping[str, str]) -> list[Still]:
        """The fronts over pairs of responses, whose ``goals`` are by name, and what the marks mean."""
        names = list(enumerate(goals))
        pairs = drawn_pairs(list(goals.values()))
        return [*(self._pair(names[x], names[y]) for x, y in pairs), self._legend()]

    def _pair(self, x: tuple[int, str], y: tuple[int, str]) -> Still:
        """The fronts over two responses, given as place and name, with limits nearby and with what simulation confirmed."""
        simulated = {name: _simulated(point, x[1], y[1]) for name, point in self.confirmed.items()}
        axes, drawn = [], dict[str, list[float]]()
        for along, (place, name) in enumerate((x, y)):
            values = [point.responses[name] for point in self.points] + [pair[0][along] for pair in simulated.values()]
            drawn[name] = near(self.limits.get(name, ()), values)
            axes.append(Coordinate("responses", name, place, span([*values, *drawn[name]])))
        words = f"Front: {quantity(y[1])[0]} on {quantity(x[1])[0]}"
        still = Still(words, partial(self._draw_pair, axes, simulated, drawn))
        return replace(still, data={"front": _data("pair", axes, still)})

    def _draw_pair(
        self,
        axes: Sequence[Coordinate],
        simulated: Mapping[str, Simulated],
        limits: Mapping[str, Sequence[float]],
        axis: "Axes",
    ) -> None:
        across, up = axes
        axis.set(xlim=across.ends, ylim=up.ends, xlabel=label(across.name), ylabel=label(up.name))
        for draw, response in ((axis.axvline, across), (axis.axhline, up)):
            for bound in limits.get(response.name, ()):
                draw(bound, **LIMIT)
        for front in self.sets:
            _dots(axis, front.role, across.values(front.points), up.values(front.points))
        for name, point in self.marks.items():
            _mark(axis, name, (point.responses[across.name], point.responses[up.name]))
        for name, (place, half_widths) in simulated.items():
            for line in error_bars(place, half_widths, (across.ends, up.ends)):
                axis.plot(*zip(*line, strict=True), color=COLOURS["ink"], linewidth=1.4)
            _mark(axis, name, place, simulated=True)

    def _legend(self) -> Still:
        """What the marks of the pictures mean; a hollow mark is the same point, simulated."""
        count = len(self.sets) + len(self.marks) + bool(self.confirmed) + bool(self.limits)
        longest = max((len(wrapped(name).splitlines()) for name in self.marks), default=1)
        height = 20.0 + LEGEND_ROW * (-(-count // 2) + longest - 1)
        words = "Marks of the pictures of the front"
        return Still(words, self._draw_legend, height=height, left_margin=4.0, bottom_margin=4.0)

    def _draw_legend(self, axis: "Axes") -> None:
        from matplotlib.lines import Line2D

        axis.set_axis_off()
        dot: dict[str, Any] = {"linestyle": "", "marker": "o"}
        handles = []
        for front in self.sets:
            colour, ring = FRONTS[front.role]
            look: dict[str, Any] = {"markerfacecolor": COLOURS["paper"], "markeredgewidth": RING} if ring else {}
            handles.append(
                Line2D([], [], **dot, **look, color=COLOURS[colour], markersize=DOT, label=f"front {front.words}")
            )
        for name in self.marks:
            marker, size, colour = MARKS.get(name, OTHER)
            look = {"color": COLOURS[colour], "markersize": size, "label": wrapped(name)}
            handles.append(Line2D([], [], linestyle="", marker=marker, **look))
        if self.confirmed:
            hollow: dict[str, Any] = {"markerfacecolor": COLOURS["paper"], "markersize": 8.0, "color": COLOURS["ink"]}
            handles.append(Line2D([], [], linestyle="", marker="s", **hollow, label="hollow: simulated"))
        if self.limits:
            handles.append(Line2D([], [], **LIMIT, label="limit"))
        axis.legend(handles=handles, ncol=2, loc="upper left", borderaxespad=0.0)

    def parallel(self, inputs: Sequence[Factor], names: Sequence[str]) -> Still:
        """Parallel coordinates: an axis for each factor and response, a line for each point."""
        keys = [("factors", place, factor.name) for place, factor in enumerate(inputs)]
        keys += [("responses", place, name) for place, name in enumerate(names)]
        axes = [
            Coordinate(kind, name, place, span((getattr(p, kind)[name] for p in self.points), 0.02))
            for kind, place, name in keys
        ]
        words = f"Parallel coordinates of {len(self.points) - len(self.marks)} points of the front"
        both = {name: self.marks[name] for name in ("baseline", "pick") if name in self.marks}
        look = PARALLEL | {"width": max(PARALLEL["width"], AXIS_WIDTH * len(axes))}
        still = Still(words, partial(_parallel, axes, self.sets, both), **look)
        return replace(still, data={"front": _data("parallel", axes, still)})


def _simulated(point: ConfirmedPoint, first: str, second: str) -> Simulated:
    """Two responses of a confirmed point with the half-widths of their intervals."""
    x, y = (point.responses[name] for name in (first, second))
    return (x.value, y.value), (x.stated_error, y.stated_error)


def _data(kind: str, axes: Sequence[Coordinate], still: Still) -> str:
    """What ``front.js`` needs to find a point: kind, place and ends of every axis, and the frame."""
    rows = [[axis.kind, axis.place, *axis.ends] for axis in axes]
    return json.dumps({"kind": kind, "axes": rows, "frame": still.frame}, separators=(",", ":"))


def error_bars(
    place: Point, half_widths: tuple[float | None, float | None], ends: tuple[Range, Range]
) -> list[list[Point]]:
    """Lines of half-widths along x and y about a place, as far as the frame reaches."""
    x, y = place
    lines: list[list[Point]] = []
    for along, ((low, high), half) in enumerate(zip(ends, half_widths, strict=True)):
        if half:
            tips = max(place[along] - half, low), min(place[along] + half, high)
            lines.append([(x, tip) if along else (tip, y) for tip in tips])
    return lines


def _dots(axis: "Axes", role: str, x: Sequence[float], y: Sequence[float]) -> None:
    """The points of a front as one path of round dots, a tenth of the text of a mark for each."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    # A line without any length would be no dot of a PNG.
    least = 1e-9 * (axis.get_xlim()[1] - axis.get_xlim()[0])
    corners = [corner for a, b in zip(x, y, strict=True) for corner in ((a, b), (a + least, b))]
    path = Path(corners, [Path.MOVETO, Path.LINETO] * len(x))
    path.should_simplify = False
    colour, ring = FRONTS[role]
    layers = [(colour, DOT)] if not ring else [(colour, DOT + 0.5 * RING), ("paper", DOT - 0.5 * RING)]
    for layer, (shade, width) in enumerate(layers):
        patch = PathPatch(
            path, edgecolor=COLOURS[shade], facecolor="none", linewidth=width, capstyle="round", snap=False
        )
        name_marks(patch, f"dots {role}" if layer == 0 else "inside")
        # Not as a patch: its extent, which the axes have, would take longer than the picture.
        axis.add_artist(patch)


def _mark(axis: "Axes", name: str, place: Point, simulated: bool = False) -> None:
    """A point with a name, hollow where it is simulated."""
    words = point_words(name)
    marker, size, shade = MARKS.get(name, OTHER)
    colour, paper = COLOURS[shade], COLOURS["paper"]
    face, edge, thick = (paper, colour, 1.6) if simulated else (colour, paper, 0.8)
    (line,) = axis.plot(
        *place, marker, markersize=size, markerfacecolor=face, markeredgecolor=edge, markeredgewidth=thick
    )
    name_marks(line, "mark", [f"{words}, simulated" if simulated else words])


def _parallel(axes: Sequence[Coordinate], sets: Sequence[Front], marks: Mapping[str, FrontPoint], axis: "Axes") -> None:
    from matplotlib.collections import LineCollection

    middles = [number + 0.5 for number in range(len(axes))]
    axis.set(xlim=(0.0, len(axes)), ylim=(0.0, 1.0), xticks=[], yticks=[])
    axis.spines[:].set_visible(False)
    for front in sets:
        lines = [
            [(x, coordinate.share(point)) for x, coordinate in zip(middles, axes, strict=True)]
            for point in front.points
        ]
        threads = LineCollection(lines, colors=COLOURS[FRONTS[front.role][0]], linewidths=0.6, alpha=0.35)
        name_marks(threads, f"threads {front.role}")
        axis.add_collection(threads, autolim=False)
    for name, point in marks.items():
        heights, dashes = [coordinate.share(point) for coordinate in axes], "--" if name == "baseline" else "-"
        axis.plot(middles, heights, dashes, color=COLOURS[MARKS[name][2]], linewidth=2.2)
        for place in zip(middles, heights, strict=True):
            _mark(axis, name, place)
    for number, coordinate in enumerate(axes):
        _upright(axis, number, coordinate)


def _upright(axis: "Axes", number: int, coordinate: Coordinate) -> None:
    """One of the parallel axes with its name and ticks."""
    from matplotlib.ticker import MaxNLocator, ScalarFormatter

    middle, (low, high) = number + 0.5, coordinate.ends
    axis.axvline(middle, color=COLOURS["line"], linewidth=1.0)
    # Names in two lines by turns, so that long ones keep apart.
    axis.annotate(label(coordinate.name), (middle, 1.0), (0.0, 24.0 - 18.0 * (number % 2)), textcoords="offset points",
                  ha="center", va="bottom", fontsize=12.0, annotation_clip=False)  # fmt: skip
    formatter = ScalarFormatter(useOffset=False)
    formatter.create_dummy_axis()
    assert formatter.axis is not None
    formatter.axis.set_view_interval(low, high)
    ticks = [x for x in MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(low, high) if low <= x <= high]
    for x, words in zip(ticks, formatter.format_ticks(ticks), strict=True):
        text = axis.text(middle - 0.05, (x - low) / (high - low), words, ha="right", va="center", fontsize=SMALL)
        name_marks(text, "halo")


def span(values: Iterable[float], margin: float = 0.06) -> Range:
    """A range that holds all finite values, with a margin; never empty."""
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    room = margin * (high - low) or 0.1 * abs(high) or 1.0
    return low - room, high + room


def hypervolume(history: Sequence[float]) -> Still:
    """Hypervolume by generation."""
    words = f"Hypervolume rises from {shown(history[0])} to {shown(history[-1])} in {len(history)} generations"
    return Still(words, partial(_hypervolume, history), width=400.0, height=220.0)


def _hypervolume(history: Sequence[float], axis: "Axes") -> None:
    axis.plot(range(1, len(history) + 1), history)
    axis.set(xlim=(0.0, len(history)), xlabel="generation", ylabel="hypervolume")


Runs = dict[str, list[tuple[dict[str, float], int]]]
# Marker and colour of the runs made for each reason.
RUN_MARKS = {
    "design": ("s", "blue"),
    "improvement": ("h", "orange"),
    "check": ("D", "green"),
    "extension": ("^", "purple"),
    "fresh": ("P", "ink"),
}
AREA = 7.0  # of a run of one replicate [pt²]
# Size of a picture with a legend beneath, where no point lies, and letters in a line of it.
WITH_LEGEND: dict[str, Any] = {"height": 338.0, "bottom_margin": 112.0}
LETTERS = 56
HALF = 24  # letters in a line of one of two columns
BENEATH: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.45, -0.17)}


def wrapped(name: str) -> str:
    """The words of a point in lines that one of two columns of a legend can hold."""
    return fill(point_words(name), HALF)


def spent_runs(summary: Summary, adaptive: SearchResult) -> Runs:
    """Factors and replicates of all runs of a search by why they were made, the fresh ones at its points last."""
    runs: Runs = {}
    for run in adaptive.points:
        runs.setdefault(run.why, []).append((run.factors, run.replicates))
    return runs | {"fresh": [(point.factors, summary.asked.replicates) for point in adaptive.front]}


class Curve(NamedTuple):
    """Hypervolumes of a front after ``runs`` with their half-widths (0: unknown); a front without runs has one."""

    role: str
    words: str
    runs: list[float]
    reached: list[float]
    doubt: list[float]


def curves(adaptive: SearchResult) -> list[Curve]:
    """Curves of the search, of its points by their fresh runs, and of the front on the surfaces."""
    volumes, fresh = adaptive.compared, adaptive.compared.fresh
    runs, doubt = ([float(getattr(state, key)) for state in adaptive.history] for key in ("runs", "deviation"))
    prediction = (
        f"search, predicted by its last emulators: {volumes.search[-1]:.3f} in the end; bars: their uncertainty then"
    )
    words = f"its points by their fresh runs: {with_error(fresh.hypervolume, fresh.error)}"
    surfaces = f"front on the surfaces, by the same emulators: {volumes.surfaces:.3f}"
    return [
        Curve("front", prediction, runs, volumes.search, doubt),
        Curve("fresh", words, [runs[-1] + adaptive.fresh], [fresh.hypervolume], [fresh.error]),
        Curve("surrogate", surfaces, [], [volumes.surfaces], [0.0]),
    ]


def search_stills(summary: Summary, adaptive: SearchResult) -> list[Still]:
    """Hypervolume against runs, and the runs over the first factor and each other one."""
    lines, spent = curves(adaptive), spent_runs(summary, adaptive)
    ends = f"{lines[0].reached[0]:.3f} to {lines[0].reached[-1]:.3f} in {lines[0].runs[-1]:.0f} runs"
    words = f"Hypervolume of the search rises from {ends}"
    first, *others = summary.asked.columns
    above = f"{sum(map(len, spent.values()))} runs over {label(first)} and"
    places = [
        Still(f"{above} {label(other)}", partial(_where, spent, summary.pick, first, other), **WITH_LEGEND)
        for other in others
    ]
    return [Still(words, partial(_progress, lines), **WITH_LEGEND), *places]


def _progress(lines: Sequence[Curve], axis: "Axes") -> None:
    """Hypervolume against runs; a front of no runs of its own is a line with a band."""
    for role, words, runs, reached, doubt in lines:
        mark, colour = RUN_MARKS.get(role, ("o", "blue" if runs else "quiet"))
        color, entry = COLOURS[colour], fill(words, LETTERS)
        if runs:
            line, _, _ = axis.errorbar(
                runs, reached, doubt, fmt=f"{mark}-", color=color, ecolor=COLOURS["ink"], capsize=3, label=entry
            )
            titles = [f"{x:.0f} runs: {y:.3f}" for x, y in zip(runs, reached, strict=True)]
            name_marks(line, role, titles)
        else:
            line = axis.axhline(reached[0], color=color, linestyle="--", label=entry)
            name_marks(line, role)
    axis.set(xlabel="runs", ylabel="hypervolume (larger is better)")
    axis.legend(**BENEATH)


def _where(spent: Runs, pick: Mapping[str, float], first: str, second: str, axis: "Axes") -> None:
    """All runs over two factors."""
    for why, runs in spent.items():
        mark, colour = RUN_MARKS[why]
        x, y = ([point[name] for point, _ in runs] for name in (first, second))
        sizes = [AREA * count for _, count in runs]
        points = axis.scatter(
            x, y, sizes, COLOURS[colour], marker=mark, edgecolors=COLOURS["paper"], linewidths=0.8, label=why
        )
        name_marks(points, why, [f"{why}, {count} replicates" for _, count in runs])
    look: dict[str, Any] = {"color": COLOURS["vermilion"], "markeredgecolor": COLOURS["paper"], "markersize": 15}
    (star,) = axis.plot(pick[first], pick[second], "*", **look, label="selected design")
    name_marks(star, "pick", ["selected design"])
    axis.set(xlabel=label(first), ylabel=label(second))
    axis.legend(ncol=3, markerscale=0.8, title="size: replicates", title_fontsize=SMALL, **BENEATH)
