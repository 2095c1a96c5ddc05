"""What an adaptive search found, in sentences: the pick first, then why it ended, what limits the pick, how far to trust it."""

import math
from collections.abc import Sequence

import numpy as np

from doe.study_file import Study
from doe.workflow.adaptive import Adaptive, Compared, Pull, near_limits, pulls
from doe.workflow.whole import StudyResult
from rbdyn.base.words import counted, improvement, quantity, with_error

SURE = 1.5  # root mean square miss in standard deviations up to which emulators knew how little they know
HELD = {
    "scene": "beyond it the bearing would lose its operating clearance",
    "moves": "where the region has been moved as often as it may be",
    "": "where the responses turn",
    "end": "where the region searched ends",
}


def search_sentences(outcome: StudyResult) -> list[str]:
    """All of it; empty without an adaptive search."""
    adaptive, study = outcome.adaptive, outcome.study
    if adaptive is None or outcome.compared is None:
        return []
    return [
        _answer(outcome),
        spent_sentence(study, adaptive),
        held_sentence(outcome),
        trust_sentence(study, adaptive),
        beside_sentence(adaptive, outcome.compared),
    ]


def _answer(outcome: StudyResult) -> str:
    study, before = outcome.study, outcome.study.at(()).categories
    point = zip(study.factors, outcome.pick.point.tolist(), strict=True)
    places = [_place(*each) for at, each in enumerate(point) if at not in study.inactive]
    places += [f"{name} = {kind} (baseline: {before[name]})" for name, kind in study.categories.items()]
    places += [f"no {study.factors[at]}, which means nothing there" for at in study.inactive]
    gained = [f"{each.response} {improvement(each.percent, None, each.goal)}" for each in outcome.gains["pick"]]
    return f"The pick has {_listed(places)}: by simulation {_listed(gained)} than the baseline."


def spent_sentence(study: Study, adaptive: Adaptive) -> str:
    """What the search spent, why it ended, how far its region grew."""
    found, last = adaptive.found, adaptive.found.history[-1]
    left = 100.0 * last.left / last.hypervolume if last.hypervolume > 0.0 else math.nan
    moved = dict.fromkeys((face.factor, int(face.side > 0)) for face, _ in found.moves)
    grown = [_place(study.factors[place[0]], float(adaptive.edges[place]), " to") for place in moved]
    return (
        f"The search ended because {found.stopped}: {counted(len(found.spent), 'run')} of design and search and {found.fresh} fresh ones at "
        f"its points and the baseline, in {adaptive.seconds:.0f} s from the end of the design on, with at most {left:.1f} % of the "
        f"hypervolume of its front still to gain.{f' Its region grew: {_listed(grown)}.' if grown else ''}"
    )


def held_sentence(outcome: StudyResult) -> str:
    """What limits the pick at every factor, the limits that it is near to, chains whose parts cannot be made."""
    study, adaptive = outcome.study, outcome.adaptive
    assert adaptive is not None
    held: dict[str, list[str]] = {}
    for each in pulls(study, adaptive, outcome.pick.point):
        beyond = math.nan if each.face is None else each.face.better
        odds = "" if math.isnan(beyond) else f" (the front goes on beyond with a probability of {beyond:.2f})"
        held.setdefault(_why(study, each), []).append(f"{_place(each.factor, each.at)}{odds}")
    why = [f"{_listed(places)}, {words}" for words, places in held.items()]
    why += [f"the limit {each.shown} is near" for each in near_limits(adaptive, study, outcome.limits)]
    refused = [name for name, each in outcome.chains.items() if each.refused]
    why += [f"the parts of dimension chain {name} cannot be made" for name in refused]
    return f"What limits the pick: {'; '.join(why)}."


def _why(study: Study, pull: Pull) -> str:
    """What holds one factor."""
    if pull.face is not None:
        return _end(study, pull.factor) if pull.face.held == "allowed" else HELD[pull.face.held]
    ways = [f"where {_listed(pull.turn)} {'turns' if len(pull.turn) == 1 else 'turn'}"] if pull.turn else []
    gaining = (pull.more, "more"), (pull.less, "less")
    ways += [f"{_listed(names)} would gain with {way}" for names, way in gaining if names]
    return " and ".join(ways) or "where nothing changes much"


def _end(study: Study, name: str) -> str:
    """Why the region may not grow at a factor."""
    ends = study.file.factor[study.factors.index(name)].allowed
    if ends is None:
        return "at the edge of the design region; set allowed = [low, high] to search further"
    return f"where allowed = {ends} ends" if study.file.adaptive.extend else "where extend = false keeps the search"


def trust_sentence(study: Study, adaptive: Adaptive) -> str:
    """How well the emulators predicted the fresh runs at their front."""
    found, front = adaptive.found, adaptive.found.front
    wanted = [study.responses[index] for index in front.goals.objectives]
    flattered = [f"{name} by {100.0 * x:.1f} %" for name, x in zip(wanted, front.optimism.tolist(), strict=True)]
    missed = np.hypot(found.bias, found.spread).tolist()
    errors = [f"{name} {times:.1f}" for name, times in zip(study.responses, missed, strict=True)]
    sure = [name for name, times in zip(study.responses, missed, strict=True) if times > SURE]
    claim = (
        f"so their stated uncertainty of {_listed(sure)} is too small" if sure else "as their stated uncertainty allows"
    )
    return (
        f"At {counted(len(front.points), 'front point')} the emulators were optimistic on average by these shares of the front's range: "
        f"{_listed(flattered)}. Their RMS errors in standard deviations are {_listed(errors)}, {claim}. "
        "The front is reported by these fresh runs alone."
    )


def beside_sentence(adaptive: Adaptive, compared: Compared) -> str:
    """The hypervolumes of the front and of those beside it."""
    predicted, (fresh, error) = float(compared.search[-1]), compared.fresh
    points = len(adaptive.found.front.points)
    share = f" ({100.0 * compared.surfaces / predicted:.0f} % of the first)" if predicted > 0.0 else ""
    fronts = [
        f"front predicted {predicted:.3f}",
        f"its {counted(points, 'point')} by their fresh runs {with_error(fresh, 1.96 * error)}",
        f"front on the surfaces, by the same emulators, {compared.surfaces:.3f}{share}",
    ]
    return f"Hypervolumes on one scale, with the noise of their runs alone: {'; '.join(fronts)}."


def _place(name: str, value: float, before: str = "") -> str:
    words, unit = quantity(name)
    return f"{words}{before} {value:.4g} {unit}".rstrip()


def _listed(parts: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))
