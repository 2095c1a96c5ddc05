"""The search in few runs: its pictures and batches, its sentences, and its record.

The pictures show how far its front came, run by run, compared with other fronts, and where each run was spent and why.
"""

import math
from collections.abc import Sequence
from functools import partial
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from doe.adaptive.emulators import LEAST_DEVIATION
from doe.pareto.front import NOISE_DRAWS, noisy_hypervolume
from doe.report.sections.record import Record, part
from doe.report.still import COLOURS, SMALL, Still, name_marks
from doe.workflow.adaptive import Adaptive, FrontComparison, Pull, near_limits, pulls
from doe.workflow.problem import Problem
from doe.workflow.surface_front import EstimatedPoint
from doe.workflow.whole import StudyResult
from rbdyn.base.arrays import Array, Rows
from rbdyn.base.blocks import Block, Bullets, Figures, Heading, Table
from rbdyn.base.records import finite
from rbdyn.base.words import counted, improvement, label, quantity, shown, with_error

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
    "Hypervolume: share of all combinations of the responses, between the best and the worst of each on these fronts, that a "
    "front dominates. Larger is better; all fronts are on one scale."
)
SPENT = "Where each run was spent and why; the larger a mark, the more replicates. Star: the pick."


def in_few_runs(summary: Record) -> list[Block]:
    """The search in pictures, and its batches."""
    history, reached = part(summary, "adaptive", "history") or [], part(summary, "adaptive", "compared", "search") or []
    blocks: list[Block] = [Heading("The search in few runs")] if history else []
    blocks.append(Bullets((part(summary, "adaptive", "sentences") or [])[1:]))
    for stills, caption in zip(search_stills(summary), (SCALE, SPENT), strict=True):
        if stills:
            blocks.append(Figures([still.svg for still in stills], caption))
    rows = [
        (shown(state["runs"]), f"{volume:.3f}", with_error(state["left"], state["left_error"]), state["why"])
        for state, volume in zip(history, reached, strict=False)
        if {"runs", "left", "left_error", "why"} <= set(state)
    ]
    header = ("runs", "hypervolume", "expected further gain", "next runs for")
    return [*blocks, Table("Adaptive search, batch by batch", header, rows, text_columns=(3,))]


def spent_runs(summary: Record) -> Runs:
    """Factors and replicates of all runs of a search by why they were made, the fresh ones at its points last."""
    runs: Runs = {}
    for run in part(summary, "adaptive", "points") or []:
        runs.setdefault(run["why"], []).append((run["factors"], run["replicates"]))
    if runs:
        usual = part(summary, "asked", "replicates") or 1
        runs["fresh"] = [(point["factors"], usual) for point in part(summary, "adaptive", "front") or []]
    return runs


class Curve(NamedTuple):
    """Hypervolumes of a front after ``runs`` with their half-widths (0: unknown); a front without runs has one."""

    role: str
    words: str
    runs: list[float]
    reached: list[float]
    doubt: list[float]


def curves(adaptive: Record) -> list[Curve]:
    """Curves of the search, of its points by their fresh runs, and of the front on the surfaces."""
    volumes, history = adaptive["compared"], adaptive["history"]
    runs, doubt = ([float(state[key]) for state in history] for key in ("runs", "deviation"))
    search, fresh = volumes["search"], volumes["fresh"]
    prediction = f"search, predicted by its last emulators: {search[-1]:.3f} in the end; bars: their uncertainty then"
    words = f"its points by their fresh runs: {with_error(fresh['hypervolume'], fresh['error'])}"
    surfaces = f"front on the surfaces, by the same emulators: {volumes['surfaces']:.3f}"
    return [
        Curve("front", prediction, runs, search, doubt),
        Curve("fresh", words, [runs[-1] + adaptive["fresh"]], [fresh["hypervolume"]], [fresh["error"]]),
        Curve("surrogate", surfaces, [], [volumes["surfaces"]], [0.0]),
    ]


def search_stills(summary: Record) -> tuple[list[Still], list[Still]]:
    """Hypervolume against runs, and the runs over the first factor and each other one; either if it is in the record."""
    adaptive = part(summary, "adaptive") or {}
    history, reached = adaptive.get("history") or [], part(adaptive, "compared", "search") or []
    progress, places = [], []
    if history and len(reached) == len(history):
        lines = curves(adaptive)
        ends = f"{lines[0].reached[0]:.3f} to {lines[0].reached[-1]:.3f} in {lines[0].runs[-1]:.0f} runs"
        words = f"Hypervolume of the search rises from {ends}"
        progress.append(Still(words, partial(_progress, lines), height=HIGH, bottom_margin=BOTTOM))
    if spent := spent_runs(summary):
        first, *others = summary.asked.factors
        for other in others:
            words = f"{sum(map(len, spent.values()))} runs over {label(first.name)} and {label(other.name)}"
            draw = partial(_where, spent, part(summary, "pick"), first.name, other.name)
            places.append(Still(words, draw, height=HIGH, bottom_margin=BOTTOM))
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
        x, y = ([point[name] for point, _ in runs] for name in (one, two))
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
    return f"The pick has {_listed(places)}: by simulation {_listed(gains)} than the baseline."


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
        odds = "" if math.isnan(beyond) else f" (the front goes on beyond with a probability of {beyond:.2f})"
        limits.setdefault(_why(study, pull), []).append(f"{_place(pull.factor, pull.value)}{odds}")
    why = [f"{_listed(places)}, {words}" for words, places in limits.items()]
    why += [f"the limit {limit.text} is near" for limit in near_limits(adaptive, study, outcome.limits)]
    refused = [name for name, chain in outcome.chains.items() if chain.refused]
    why += [f"the parts of dimension chain {name} cannot be made" for name in refused]
    return f"What limits the pick: {'; '.join(why)}."


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
    prediction, (fresh, error) = float(volumes.search[-1]), volumes.fresh
    points = len(adaptive.search.front.points)
    share = f" ({100.0 * volumes.surfaces / prediction:.0f} % of the first)" if prediction > 0.0 else ""
    fronts = [
        f"front predicted {prediction:.3f}",
        f"its {counted(points, 'point')} by their fresh runs {with_error(fresh, 1.96 * error)}",
        f"front on the surfaces, by the same emulators, {volumes.surfaces:.3f}{share}",
    ]
    return f"Hypervolumes on one scale, with the noise of their runs alone: {'; '.join(fronts)}."


def _place(name: str, value: float, before: str = "") -> str:
    words, unit = quantity(name)
    return f"{words}{before} {value:.4g} {unit}".rstrip()


def _listed(parts: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))


def adaptive_record(study: Problem, adaptive: Adaptive) -> dict[str, Any]:
    """JSON of a search.

    front : its points by their fresh runs, with 95 % half widths
    runs, fresh : numbers of runs of design and search, and of fresh ones
    hypervolume : of the predicted front, on the scale of its own ideal and nadir
    predicted_front : the 200 points of the predicted front that have most of its hypervolume
    points : every run of design and search, with its replicates and its reason
    """
    search, front = adaptive.search, adaptive.search.front
    rows = zip(front.points, front.values, front.half_widths, strict=True)
    points = [
        EstimatedPoint.of(study, point, *rest).as_dict() | {"factors": _factors(study, point)} for point, *rest in rows
    ]
    costs = front.goals.costs(search.predictions)
    scale = costs.min(axis=0), costs.max(axis=0)
    fresh = noisy_hypervolume(front.costs, front.cost_errors, *scale, NOISE_DRAWS, front.seed)
    return {
        "front": points,
        "pick": {**points[front.pick], "reason": front.pick_reason},
        "runs": len(search.spent),
        "fresh": search.fresh,
        "hypervolume": search.history[-1].reached,
        "hypervolume_fresh": fresh[0],
        "hypervolume_fresh_error": 1.96 * fresh[1],
        "history": [
            {
                "runs": state.runs,
                "hypervolume": state.reached,
                "deviation": state.deviation,
                "gained": finite(state.gained),
                "left": state.remaining,
                "left_error": state.remaining_error,
                "why": state.why,
            }
            for state in search.history
        ],
        "stopped": search.stopped,
        "extended": [
            {
                "factor": study.factors[face.factor],
                "side": "upper" if face.side > 0 else "lower",
                "from": _actual(study, face.factor, face.position),
                "to": _actual(study, face.factor, to),
            }
            for face, to in search.moves
        ],
        "region": {name: ends for name, ends in zip(study.factors, adaptive.edges.tolist(), strict=True)},
        "points": [
            {"factors": _factors(study, point, rounded=why != "design"), "replicates": int(count), "why": why}
            for point, count, why in zip(search.searched.points, search.spent, search.why, strict=True)
        ],
        "predicted_front_points": len(search.archive),
        "predicted_front": archive_table(study, adaptive, search.representatives),
        "missed": {
            name: {"bias": float(bias), "spread": float(spread)}
            for name, bias, spread in zip(study.responses, search.bias, search.spread, strict=True)
        },
        "emulators": emulators_record(study, adaptive),
        "failed": len(adaptive.failures),
        "seed": front.seed,
        "seconds": adaptive.seconds,
        "emulator_seconds": search.seconds,
    }


def compared_record(study: Problem, adaptive: Adaptive, volumes: FrontComparison) -> dict[str, Any]:
    """Hypervolumes between one ``ideal`` and ``nadir``, in costs.

    search, surfaces : by the last emulators, of the predicted fronts in the course of the search, and of the surfaces' front
    fresh : of the search's points by their fresh runs, with a 95 % half width
    """
    names = [study.responses[index] for index in adaptive.front.goals.objectives]
    return {
        **{key: dict(zip(names, getattr(volumes, key).tolist(), strict=True)) for key in ("ideal", "nadir")},
        "search": volumes.search.tolist(),
        "surfaces": volumes.surfaces,
        "fresh": {"hypervolume": volumes.fresh[0], "error": 1.96 * volumes.fresh[1]},
    }


def _actual(study: Problem, factor: int, coded: float) -> float:
    return float(study.centre[factor] + study.reach[factor] * study.step[factor] * coded)


def _factors(study: Problem, point: Array, rounded: bool = True) -> dict[str, float]:
    """Factors of a point (k,) of the search by name, rounded as on the drawing unless stated otherwise."""
    return study.by_factor(study.rounded(point) if rounded else point)


def archive_table(study: Problem, adaptive: Adaptive, rows: Rows | slice = slice(None)) -> list[dict[str, Any]]:
    """Rows of the front that the emulators predict, all by default, with 95 % half widths."""
    search = adaptive.search
    errors = [f"{name}_error" for name in study.responses]
    table = np.hstack([search.predictions, 1.96 * search.deviations])[rows].tolist()
    names = [*study.responses, *errors]
    return [
        _factors(study, point) | dict(zip(names, row, strict=True))
        for point, row in zip(search.archive[rows], table, strict=True)
    ]


def emulators_record(study: Problem, adaptive: Adaptive) -> dict[str, Any]:
    """Emulators of every response for the scripts of the page: mean and standard deviation without scatter, anywhere.

    The coordinates of a point are x = (factor - ``centre``) / ``half_range``; ``points`` (n, k) are those of the runs. A response
    with ``shares`` s of factors uses ln(1 + s x)/s of these.

    A response is a trend of ``terms`` with ``coefficients``, A being the first factor, plus a process: the covariances of the point
    with the runs times ``weights`` (n,). They are Matern of smoothness 5/2, with ``lengths`` by coordinate and ``variance``. The
    runs' ``values`` (n,) have the variances ``noise`` (n,), the coefficients the prior variances ``coefficient_variances``. The
    deviation is that of the posterior times ``stretch``, and ``least`` at least.
    """
    emulators = adaptive.search.emulators
    responses = {}
    each_one = zip(study.responses, emulators.by_response, emulators.stretch.tolist(), emulators.shares, strict=True)
    for name, one, stretch, shares in each_one:
        hyperparameters = one.hyperparameters
        responses[name] = {
            "terms": list(one.terms),
            "coefficients": one.coefficients.tolist(),
            "coefficient_variances": one.term_variances.tolist(),
            "lengths": hyperparameters.lengths.tolist(),
            "variance": hyperparameters.variance,
            "weights": one.weights.tolist(),
            "values": one.values.tolist(),
            "noise": one.noise.tolist(),
            "stretch": stretch,
            "shares": list(shares),
            "least": LEAST_DEVIATION * float(abs(one.values).max()),
        }
    return {
        "centre": study.centre.tolist(),
        "half_range": (study.reach * study.step).tolist(),
        "points": emulators.runs.points.tolist(),
        "responses": responses,
    }
