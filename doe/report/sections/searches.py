"""The search in few runs: how far its front came, run by run, beside other fronts, and where each run was spent and why."""

from collections.abc import Sequence

from doe.report.sections.blocks import Block, Figures, Heading, Table
from doe.report.sections.plot import Plot, legend, span
from doe.report.sections.record import Record, factors, part
from rbdyn.records.words import label, shown, with_error

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
        blocks.append(Figures([_progress(adaptive, known), _lines(adaptive, known)], SCALE))
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


def reached_lines(adaptive: Record) -> list[tuple[str, str, float, float]]:
    """Fronts beside that of the search: role, what they are, hypervolume and its 95 % half width (0: not known)."""
    compared = adaptive["compared"]
    found = [("surrogate", "front on the surfaces, by the same emulators", compared["surfaces"], 0.0)]
    if direct := compared.get("direct"):
        words = f"direct front of {direct['evaluations']} evaluations, by its own fresh runs"
        found.append(("direct", words, direct["hypervolume"], direct["error"]))
    return found


def reached_text(hypervolume: float, error: float) -> str:
    """A hypervolume with its error, if that is known."""
    return with_error(hypervolume, error) if error else f"{hypervolume:.3f}"


def _progress(adaptive: Record, search: Sequence[float]) -> str:
    """Hypervolume against runs."""
    history, fresh = adaptive["history"], adaptive["compared"]["fresh"]
    end = history[-1]["runs"] + adaptive["fresh"]
    lines = reached_lines(adaptive)
    heights = [y + side * e for _, _, y, e in lines for side in (-1, 1)] + [fresh["hypervolume"] - fresh["error"]]
    known = [
        *search,
        *heights,
        *(y + side * each["deviation"] for y, each in zip(search, history, strict=True) for side in (-1, 1)),
    ]
    plot = Plot((history[0]["runs"] - 4.0, end + 4.0), span(known), ("runs", "hypervolume"))
    for role, _, height, error in lines:
        plot.line([(plot.x[0], height), (plot.x[1], height)], role)
        plot.cross((plot.x[1] - 2.0, height), (None, error), "error")
    points = [(float(each["runs"]), y) for each, y in zip(history, search, strict=True)]
    for point, each in zip(points, history, strict=True):
        plot.cross(point, (None, each["deviation"]), "error")
    plot.line(points, "front")
    plot.dots(points, "front", radius=3.4, titles=[f"{x:.0f} runs: {y:.3f}" for x, y in points])
    plot.cross((end, fresh["hypervolume"]), (None, fresh["error"]), "error")
    plot.symbol((end, fresh["hypervolume"]), SHAPES["fresh"], "fresh", "its points, simulated afresh")
    return plot.svg(
        f"Hypervolume of the search rises from {search[0]:.3f} to {search[-1]:.3f} in {history[-1]['runs']} runs"
    )


def _lines(adaptive: Record, search: Sequence[float]) -> str:
    """What the lines are, with their numbers."""
    fresh = adaptive["compared"]["fresh"]
    entries = [
        (
            "line",
            "front",
            f"search, foretold by its last emulators: {search[-1]:.3f} in the end; bars: what they doubted then",
        ),
        (SHAPES["fresh"], "fresh", f"its points by fresh runs: {with_error(fresh['hypervolume'], fresh['error'])}"),
    ]
    lines = reached_lines(adaptive)
    entries += [("line", role, f"{words}: {reached_text(y, error)}") for role, words, y, error in lines]
    return legend(entries)


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
