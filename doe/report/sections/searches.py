"""The search in few runs: how far its front came, run by run, compared with other fronts, and where each run was spent and why."""

from typing import NamedTuple

from doe.report.sections.plot import Plot, legend, span
from doe.report.sections.record import Record, factors, part
from rbdyn.base.blocks import Block, Figures, Heading, Table
from rbdyn.base.words import label, shown, with_error

# Shape of the runs made for each reason; the style sheet has their colours.
SHAPES = {"design": "square", "improvement": "hexagon", "check": "diamond", "extension": "triangle", "fresh": "plus"}
RADIUS = 1.6  # of a run of one replicate, so that areas are as the replicates
SCALE = (
    "Hypervolume: how much of all combinations of the responses, from the best to the worst of each on these fronts, a front "
    "leaves behind it; larger is better, and all fronts are on one scale."
)
SPENT = "Where each run was spent and why; the larger a mark, the more replicates. Star: the pick."


def in_few_runs(summary: Record) -> list[Block]:
    """The search in pictures, and its batches."""
    adaptive = part(summary, "adaptive") or {}
    history, known = adaptive.get("history") or [], part(adaptive, "compared", "search") or []
    blocks: list[Block] = [Heading("The search in few runs")] if history else []
    if history and len(known) == len(history):
        entries = [(SHAPES.get(each.role, "line"), each.role, each.words) for each in curves(adaptive)]
        blocks.append(Figures([_progress(adaptive), legend(entries)], SCALE))
    if spent := spent_runs(summary):
        given = factors(summary)
        pairs = [_where(summary, spent, given[0].name, other.name) for other in given[1:]]
        entries = [(SHAPES[why], why, why) for why in SHAPES if why in spent]
        blocks.append(Figures([*pairs, legend([*entries, ("star", "pick", "pick")])], SPENT))
    rows = [
        (shown(each["runs"]), f"{reached:.3f}", with_error(each["left"], each["deviation"]), each["why"])
        for each, reached in zip(history, known, strict=False)
        if {"runs", "left", "deviation", "why"} <= set(each)
    ]
    header = ("runs", "hypervolume", "still to gain", "next runs for")
    return [*blocks, Table("Adaptive search, batch by batch", header, rows, text_columns=(3,))]


def spent_runs(summary: Record) -> dict[str, list[tuple[Record, int]]]:
    """Factors and replicates of all runs of a search by why they were made, the fresh ones at its points last."""
    found: dict[str, list[tuple[Record, int]]] = {}
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


def _progress(adaptive: Record) -> str:
    """Hypervolume against runs."""
    drawn = curves(adaptive)
    ends = [y + side * e for each in drawn for y, e in zip(each.reached, each.doubt, strict=True) for side in (-1, 1)]
    plot = Plot(span(x for each in drawn for x in each.runs), span(ends), ("runs", "hypervolume"))
    for role, words, runs, reached, doubt in drawn:
        points = list(zip(runs or plot.x, reached if runs else 2 * reached, strict=True))
        plot.line(points, role)
        for point, error in zip(points, doubt if runs else (), strict=False):
            plot.cross(point, (None, error), "error")
        if role in SHAPES:
            plot.symbol(points[0], SHAPES[role], role, words)
        elif runs:
            plot.dots(points, role, radius=3.4, titles=[f"{x:.0f} runs: {y:.3f}" for x, y in points])
    first, last = drawn[0].reached[0], drawn[0].reached[-1]
    return plot.svg(f"Hypervolume of the search rises from {first:.3f} to {last:.3f} in {drawn[0].runs[-1]:.0f} runs")


def _where(summary: Record, spent: dict[str, list[tuple[Record, int]]], one: str, two: str) -> str:
    """All runs over two factors."""
    every = [at for runs in spent.values() for at, _ in runs]
    plot = Plot(span(at[one] for at in every), span(at[two] for at in every), (label(one), label(two)))
    for why, runs in spent.items():
        for at, count in runs:
            plot.symbol((at[one], at[two]), SHAPES[why], why, f"{why}, {count} replicates", RADIUS * count**0.5)
    if pick := part(summary, "pick"):
        plot.symbol((pick[one], pick[two]), "star", "pick", "pick", 7.0)
    return plot.svg(f"{sum(map(len, spent.values()))} runs over {label(one)} and {label(two)}")
