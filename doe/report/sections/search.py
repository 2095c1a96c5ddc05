"""The search in few runs: its pictures and batches, and its sentences.

The pictures show how far its front came, run by run, compared with other fronts, and where each run was spent and why.
"""

import math
from collections.abc import Mapping, Sequence
from functools import partial
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from doe.report.still import COLOURS, SMALL, Still, name_marks
from doe.report.summary import Summary
from doe.workflow.adaptive import Adaptive, FrontComparison, Pull, near_limits, pulls
from doe.workflow.front_record import SearchResult
from doe.workflow.problem import Problem
from doe.workflow.whole import StudyResult
from rbdyn.base.blocks import Block, Bullets, Figures, Heading, Table
from rbdyn.base.words import counted, improvement, label, quantity, shown, with_error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Runs = dict[str, list[tuple[dict[str, float], int]]]
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
    "Hypervolume: share of all combinations of the responses, between the best and the worst of each on these fronts, that a "
    "front dominates. Larger is better; all fronts are on one scale."
)
SPENT = "Where each run was spent and why; the larger a mark, the more replicates. Star: the selected design."


def in_few_runs(summary: Summary) -> list[Block]:
    """The search in pictures, and its batches; nothing without one."""
    adaptive = summary.adaptive
    if adaptive is None:
        return []
    progress, *places = search_stills(summary, adaptive)
    rows = [
        (shown(state.runs), f"{volume:.3f}", with_error(state.remaining, state.remaining_error), state.why)
        for state, volume in zip(adaptive.history, adaptive.compared.search, strict=True)
    ]
    header = ("runs", "hypervolume", "expected further gain", "next runs for")
    return [
        Heading("The search in few runs"),
        Bullets(adaptive.sentences[1:]),
        Figures([progress.svg], SCALE),
        *([Figures([still.svg for still in places], SPENT)] if places else []),
        Table("Adaptive search, batch by batch", header, rows, text_columns=(3,)),
    ]


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
    places = [
        Still(
            f"{sum(map(len, spent.values()))} runs over {label(first)} and {label(other)}",
            partial(_where, spent, summary.pick, first, other),
            height=HIGH,
            bottom_margin=BOTTOM,
        )
        for other in others
    ]
    return [Still(words, partial(_progress, lines), height=HIGH, bottom_margin=BOTTOM), *places]


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


def _where(spent: Runs, pick: Mapping[str, float], one: str, two: str, axis: "Axes") -> None:
    """All runs over two factors."""
    for why, runs in spent.items():
        mark, colour = MARKS[why]
        x, y = ([point[name] for point, _ in runs] for name in (one, two))
        sizes = [AREA * count for _, count in runs]
        points = axis.scatter(
            x, y, sizes, COLOURS[colour], marker=mark, edgecolors=COLOURS["paper"], linewidths=0.8, label=why
        )
        name_marks(points, why, [f"{why}, {count} replicates" for _, count in runs])
    (star,) = axis.plot(
        pick[one],
        pick[two],
        "*",
        color=COLOURS["vermilion"],
        markeredgecolor=COLOURS["paper"],
        markersize=15,
        label="selected design",
    )
    name_marks(star, "pick", ["selected design"])
    axis.set(xlabel=label(one), ylabel=label(two))
    axis.legend(ncol=3, markerscale=0.8, title="size: replicates", title_fontsize=SMALL, **BENEATH)


SUFFICIENT_MISS = 1.5  # RMS error in standard deviations up to which the stated uncertainty of emulators is sufficient
CAUSES = {
    "scene": "beyond it the bearing would lose its operating clearance",
    "moves": "where the region was extended as often as allowed",
    "": "where the responses turn",
    "end": "at the edge of the searched region",
}


def search_sentences(outcome: StudyResult) -> list[str]:
    """All sentences on the search; none without one."""
    adaptive, study = outcome.adaptive, outcome.study
    if adaptive is None or outcome.front_comparison is None:
        return []
    return [
        _answer(outcome),
        spent_sentence(study, adaptive),
        limiting_sentence(outcome),
        trust_sentence(study, adaptive),
        comparison_sentence(adaptive, outcome.front_comparison),
    ]


def _answer(outcome: StudyResult) -> str:
    places = [_place(*value) for value in outcome.study.by_factor(outcome.pick.point).items()]
    gains = [f"{name} {improvement(gain.percent, None, gain.goal)}" for name, gain in outcome.gains["pick"].items()]
    return f"The selected design has {_listed(places)}: by simulation {_listed(gains)} than the baseline."


def spent_sentence(study: Problem, adaptive: Adaptive) -> str:
    """The runs and the time of the search, why it ended, and how far its region grew."""
    search, last = adaptive.search, adaptive.search.history[-1]
    scale = 100.0 / last.hypervolume if last.hypervolume > 0.0 else math.nan
    further = with_error(scale * last.remaining, scale * last.remaining_error)
    moved = dict.fromkeys((face.factor, int(face.side > 0)) for face, _ in search.moves)
    grown = [_place(study.factors[place[0]], float(adaptive.edges[place]), " to") for place in moved]
    runs = f"{counted(len(search.spent), 'run')} of design and search and {search.fresh} fresh runs at its points and the baseline"
    growth = f" Its region grew: {_listed(grown)}." if grown else ""
    return (
        f"The search ended because {search.stopped}. It took {runs}, in {adaptive.seconds:.0f} s after the end of the design. "
        f"A search without end is expected to gain {further} % more hypervolume (one standard deviation over the fronts that the "
        f"emulators allow).{growth}"
    )


def limiting_sentence(outcome: StudyResult) -> str:
    """What limits the pick: the cause at every factor, limits nearby, and chains whose parts cannot be made."""
    study, adaptive = outcome.study, outcome.adaptive
    assert adaptive is not None
    limits: dict[str, list[str]] = {}
    for pull in pulls(study, adaptive, outcome.pick.point):
        beyond = math.nan if pull.face is None else pull.face.better
        odds = "" if math.isnan(beyond) else f" (the front continues beyond with a probability of {beyond:.2f})"
        limits.setdefault(_why(study, pull), []).append(f"{_place(pull.factor, pull.value)}{odds}")
    why = [f"{_listed(places)}, {words}" for words, places in limits.items()]
    why += [f"the limit {limit.text} is near" for limit in near_limits(adaptive, study, outcome.limits)]
    refused = [name for name, chain in outcome.chains.items() if chain.refused]
    why += [f"the parts of dimension chain {name} cannot be made" for name in refused]
    return f"What limits the selected design: {'; '.join(why)}."


def _why(study: Problem, pull: Pull) -> str:
    """The cause that limits one factor."""
    if pull.face is not None:
        return _end(study, pull.factor) if pull.face.limited_by == "allowed" else CAUSES[pull.face.limited_by]
    ways = [f"where {_listed(pull.turn)} {'turns' if len(pull.turn) == 1 else 'turn'}"] if pull.turn else []
    gaining = (pull.more, "larger"), (pull.less, "smaller")
    ways += [f"{_listed(names)} would improve with a {size} value" for names, size in gaining if names]
    return " and ".join(ways) or "where no response changes much"


def _end(study: Problem, name: str) -> str:
    """Why the region cannot grow at a factor."""
    ends = study.file.factor[study.factors.index(name)].allowed
    if ends is None:
        return "at the edge of the design region; set allowed = [low, high] to search further"
    return (
        f"at an end of allowed = {ends}"
        if study.file.adaptive.extend
        else "at the edge of the design region, which extend = false fixes"
    )


def trust_sentence(study: Problem, adaptive: Adaptive) -> str:
    """How well the emulators predicted the fresh runs at their front."""
    search, front = adaptive.search, adaptive.search.front
    objectives = [study.responses[index] for index in front.goals.objectives]
    optimism = [f"{name} by {100.0 * x:.1f} %" for name, x in zip(objectives, front.optimism.tolist(), strict=True)]
    missed = np.hypot(search.bias, search.spread).tolist()
    errors = [f"{name} {times:.1f}" for name, times in zip(study.responses, missed, strict=True)]
    overconfident = [name for name, times in zip(study.responses, missed, strict=True) if times > SUFFICIENT_MISS]
    if overconfident:
        claim = f"so their stated uncertainty of {_listed(overconfident)} is too small"
    else:
        claim = "as their stated uncertainty allows"
    return (
        f"At {counted(len(front.points), 'front point')} the emulators were optimistic on average by these shares of the front's range: "
        f"{_listed(optimism)}. Their RMS errors in standard deviations are {_listed(errors)}, {claim}. "
        "The front is reported by these fresh runs alone."
    )


def comparison_sentence(adaptive: Adaptive, volumes: FrontComparison) -> str:
    """The hypervolumes of the front and of those that it is compared with."""
    prediction, fresh = volumes.search[-1], volumes.fresh
    points = len(adaptive.search.front.points)
    share = f" ({100.0 * volumes.surfaces / prediction:.0f} % of the first)" if prediction > 0.0 else ""
    fronts = [
        f"front predicted {prediction:.3f}",
        f"its {counted(points, 'point')} by their fresh runs {with_error(fresh.hypervolume, fresh.error)}",
        f"front on the surfaces, by the same emulators, {volumes.surfaces:.3f}{share}",
    ]
    return f"Hypervolumes on one scale, with the noise of their runs alone: {'; '.join(fronts)}."


def _place(name: str, value: float, before: str = "") -> str:
    words, unit = quantity(name)
    return f"{words}{before} {value:.4g} {unit}".rstrip()


def _listed(parts: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))
