"""The search in few runs: how far its front came, run by run, compared with other fronts, and where each run was spent and why."""

from collections.abc import Sequence
from functools import partial
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

from doe.report.sections.record import Record, factors, part
from doe.report.still import COLOURS, SMALL, Still, name_marks
from rbdyn.base.blocks import Block, Figures, Heading, Table
from rbdyn.base.words import label, shown, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Runs = dict[str, list[tuple[Record, int]]]
# Marker and colour of the runs made for each reason.
MARKS = {
    "design": ("s", "blue"),
    "improvement": ("h", "orange"),
    "check": ("D", "green"),
    "extension": ("^", "purple"),
    "fresh": ("P", "ink"),
}
AREA = 7.0  # of a run of one replicate [pt²]
# Size of a picture with a legend beneath, where no point lies, and letters in a line of it.
HIGH, BOTTOM, LETTERS = 338.0, 112.0, 56
BENEATH: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.45, -0.17)}
SCALE = (
    "Hypervolume: how much of all combinations of the responses, from the best to the worst of each on these fronts, a front "
    "leaves behind it; larger is better, and all fronts are on one scale."
)
SPENT = "Where each run was spent and why; the larger a mark, the more replicates. Star: the pick."


def in_few_runs(summary: Record) -> list[Block]:
    """The search in pictures, and its batches."""
    history, reached = part(summary, "adaptive", "history") or [], part(summary, "adaptive", "compared", "search") or []
    blocks: list[Block] = [Heading("The search in few runs")] if history else []
    for stills, caption in zip(search_stills(summary), (SCALE, SPENT), strict=True):
        if stills:
            blocks.append(Figures([each.svg for each in stills], caption))
    rows = [
        (shown(each["runs"]), f"{volume:.3f}", with_error(each["left"], each["deviation"]), each["why"])
        for each, volume in zip(history, reached, strict=False)
        if {"runs", "left", "deviation", "why"} <= set(each)
    ]
    header = ("runs", "hypervolume", "still to gain", "next runs for")
    return [*blocks, Table("Adaptive search, batch by batch", header, rows, text_columns=(3,))]


def spent_runs(summary: Record) -> Runs:
    """Factors and replicates of all runs of a search by why they were made, the fresh ones at its points last."""
    found: Runs = {}
    for each in part(summary, "adaptive", "points") or []:
        found.setdefault(each["why"], []).append((each["factors"], each["replicates"]))
    if found:
        usual = part(summary, "asked", "replicates") or 1
        found["fresh"] = [(each["factors"], usual) for each in part(summary, "adaptive", "front") or []]
    return found


class Curve(NamedTuple):
    """Hypervolumes of a front after ``runs``, all along without any, with what they are in doubt by (0: not known)."""

    role: str
    words: str
    runs: list[float]
    reached: list[float]
    doubt: list[float]


def curves(adaptive: Record) -> list[Curve]:
    """The search, its points by their fresh runs, and the front on the surfaces."""
    compared, history = adaptive["compared"], adaptive["history"]
    runs, doubt = ([float(each[key]) for each in history] for key in ("runs", "deviation"))
    search, fresh = compared["search"], compared["fresh"]
    told = f"search, predicted by its last emulators: {search[-1]:.3f} in the end; bars: their uncertainty then"
    words = f"its points by their fresh runs: {with_error(fresh['hypervolume'], fresh['error'])}"
    beside = f"front on the surfaces, by the same emulators: {compared['surfaces']:.3f}"
    return [
        Curve("front", told, runs, search, doubt),
        Curve("fresh", words, [runs[-1] + adaptive["fresh"]], [fresh["hypervolume"]], [fresh["error"]]),
        Curve("surrogate", beside, [], [compared["surfaces"]], [0.0]),
    ]


def search_stills(summary: Record) -> tuple[list[Still], list[Still]]:
    """Hypervolume against runs, and the runs over the first factor and each other one; either as far as it is known."""
    adaptive = part(summary, "adaptive") or {}
    history, reached = adaptive.get("history") or [], part(adaptive, "compared", "search") or []
    progress, places = [], []
    if history and len(reached) == len(history):
        lines = curves(adaptive)
        ends = f"{lines[0].reached[0]:.3f} to {lines[0].reached[-1]:.3f} in {lines[0].runs[-1]:.0f} runs"
        words = f"Hypervolume of the search rises from {ends}"
        progress.append(Still(words, partial(_progress, lines), height=HIGH, bottom=BOTTOM))
    if spent := spent_runs(summary):
        first, *others = factors(summary)
        for other in others:
            words = f"{sum(map(len, spent.values()))} runs over {label(first.name)} and {label(other.name)}"
            draw = partial(_where, spent, part(summary, "pick"), first.name, other.name)
            places.append(Still(words, draw, height=HIGH, bottom=BOTTOM))
    return progress, places


def _progress(lines: Sequence[Curve], axis: "Axes") -> None:
    """Hypervolume against runs; a front of no runs of its own is a line with a band."""
    for role, words, runs, reached, doubt in lines:
        mark, colour = MARKS.get(role, ("o", "blue" if runs else "quiet"))
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


def _where(spent: Runs, pick: Record | None, one: str, two: str, axis: "Axes") -> None:
    """All runs over two factors."""
    for why, runs in spent.items():
        mark, colour = MARKS[why]
        x, y = ([at[name] for at, _ in runs] for name in (one, two))
        sizes = [AREA * count for _, count in runs]
        points = axis.scatter(
            x, y, sizes, COLOURS[colour], marker=mark, edgecolors=COLOURS["paper"], linewidths=0.8, label=why
        )
        name_marks(points, why, [f"{why}, {count} replicates" for _, count in runs])
    if pick:
        (star,) = axis.plot(
            pick[one],
            pick[two],
            "*",
            color=COLOURS["vermilion"],
            markeredgecolor=COLOURS["paper"],
            markersize=15,
            label="pick",
        )
        name_marks(star, "pick", ["pick"])
    axis.set(xlabel=label(one), ylabel=label(two))
    axis.legend(ncol=3, markerscale=0.8, title="size: replicates", title_fontsize=SMALL, **BENEATH)
