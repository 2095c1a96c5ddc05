"""The effect of unknown inputs: on the figures of a scene (``doe uncertainty``), and on a pick (``doe study --robust``).

Each as JSON and in sentences; the figures of a scene also as tables, files and a picture.
"""

import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from doe.report.sections.record import of_hundred
from doe.unknown.decision import Better
from doe.unknown.propagation import CONFIDENCE, Share
from doe.workflow.robust import Decider, Robust, RobustFront
from doe.workflow.uncertainty import OutputRange, Uncertainty
from rbdyn.base.blocks import Block, Bullets, Paragraph, Table, with_notes
from rbdyn.base.records import plain, save_table
from rbdyn.base.tables.sheet import text_of
from rbdyn.base.words import counted, quantity, shown, with_error
from rbdyn.result import write_json
from rbdyn.scene.unknown import is_number

FORMAT = "doe.uncertainty/2"
# Most inputs that a sentence names, and the least share of one.
NAMED, WORTH = 2, 0.1


def uncertainty_record(uncertainty: Uncertainty) -> dict[str, Any]:
    """JSON record of ``doe uncertainty``."""
    sets = uncertainty.sets
    return {
        "format": FORMAT,
        "scene": str(uncertainty.path),
        "responses": {name: _output(output) for name, output in uncertainty.outputs.items()},
        "inputs": [
            {"key": entry.key, "law": entry.law.model_dump(exclude_none=True), "reason": entry.reason}
            for entry in uncertainty.inputs
        ],
        "screened": dict(uncertainty.screened),
        "runs": len(sets.outputs),
        "failed": len(sets.failures) + len(sets.impossible),
        "seed": uncertainty.seed,
        "notes": plain(uncertainty.notes),
    }


def _output(output: OutputRange) -> dict[str, Any]:
    spread, indices, shapley, keys = output.spread, output.indices, output.shapley, output.keys
    return {
        **output.nominal.as_dict(),
        "input": {"low": spread.low, "median": spread.median, "high": spread.high, "errors": list(spread.errors)},
        "variance": spread.variance,
        "first": None if indices is None else dict(zip(keys, map(list, indices.first), strict=True)),
        "total": None if indices is None else dict(zip(keys, map(list, indices.total), strict=True)),
        "shapley": None if shapley is None else dict(zip(keys, map(list, shapley), strict=True)),
        "floor": None if output.floor is None else list(output.floor),
        "q2": spread.q2,
        "ceiling": spread.ceiling,
        "trusted": spread.by_emulator,
    }


def range_sentence(name: str, output: OutputRange) -> str:
    """'impact force 87.1 ± 0.4 N; 60 to 132 N in 90 % of the cases over the unknown inputs; the bar stiffness causes 87 %'."""
    words, unit = quantity(name)
    nominal, spread = output.nominal, output.spread
    head = f"{words} {with_error(nominal.value, nominal.stated_error)} {unit}".rstrip()
    ends = f"{shown(spread.low)} to {shown(spread.high)} {unit}".rstrip()
    if spread.hidden:
        return f"{head}; simulation noise exceeds the effect of the inputs"
    outside = "" if spread.low <= nominal.value <= spread.high else ", which excludes the scene's own value"
    return f"{head}; {ends} in 90 % of the cases over the unknown inputs{outside}; {_decides(output)}"


def _decides(output: OutputRange) -> str:
    if output.shares is None or output.floor is None:
        return "the decisive input is unknown"
    floor = output.floor.high
    ranked = sorted(zip(output.shares, output.keys, strict=True), reverse=True)
    above = [(index, key) for index, key in ranked if index.value > max(floor, WORTH)][:NAMED]
    return " and ".join(f"{key} causes {100.0 * index.value:.0f} %" for index, key in above) or "no input dominates"


def uncertainty_blocks(uncertainty: Uncertainty) -> list[Block]:
    """A sentence for each output, shares of its variance by input and by cause, screened inputs, and notes."""
    shares = [_by_key(output) for output in uncertainty.outputs.values()]
    rows = [(key, *(_share(column.get(key)) for column in shares)) for key in _keys(uncertainty)]
    floor = ("an input that does nothing", *(_share(output.floor) for output in uncertainty.outputs.values()))
    header = ("input", *(quantity(name)[0] for name in uncertainty.outputs))
    caption = f"{_what(uncertainty)} [%], {100.0 * CONFIDENCE:.0f} % intervals"
    parts = [
        (quantity(name)[0], *(f"{100.0 * share:.1f}" for share in output.spread.variance.values()))
        for name, output in uncertainty.outputs.items()
    ]
    sources = ("output", "simulation", "integration", "inputs")
    screened = ""
    if uncertainty.screened:
        most = max(uncertainty.screened, key=lambda key: uncertainty.screened[key])
        screened = (
            f"{counted(len(uncertainty.screened), 'further input')} varied in every set, but no emulator includes them: "
            f"none alone causes more than {100.0 * uncertainty.screened[most]:.2g} % of an output's variance ({most})."
        )
    answer: list[Block] = [
        Bullets([range_sentence(name, output) for name, output in uncertainty.outputs.items()]),
        Table(caption, header, [*rows, floor]),
        Table("Variance of a single run by cause [%]", sources, parts),
        Paragraph(screened),
    ]
    return with_notes(uncertainty.notes, answer, judged=False)


def _by_key(output: OutputRange) -> dict[str, Share]:
    """Shares of each input of an output's emulator; empty where they are unknown."""
    return dict(zip(output.keys, output.shares or (), strict=output.shares is not None))


def _keys(uncertainty: Uncertainty) -> list[str]:
    """Inputs of the emulators."""
    return [entry.key for entry in uncertainty.inputs if entry.key not in uncertainty.screened]


def _what(uncertainty: Uncertainty) -> str:
    """The caption of the shares."""
    if any(output.shapley for output in uncertainty.outputs.values()):
        return "Share of the variance over all inputs, divided among dependent inputs (Shapley)"
    return "Share of the variance over all inputs that remains while an input is unknown"


def _share(share: Share | None) -> str:
    return "" if share is None else of_hundred(share)


def write_uncertainty(uncertainty: Uncertainty, folder: Path) -> list[str]:
    """uncertainty.json, input_sets.csv, ranges.csv, shares.csv and uncertainty.png; returns their names."""
    write_json(folder / "uncertainty.json", uncertainty_record(uncertainty))
    keys = [entry.key for entry in uncertainty.inputs]
    with (folder / "input_sets.csv").open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(map(text_of, [*keys, *uncertainty.outputs]))
        for values, outputs in zip(uncertainty.sets.inputs, uncertainty.sets.outputs.tolist(), strict=True):
            table.writerow(map(text_of, [*(values[key] for key in keys), *outputs]))
    save_table(_range_rows(uncertainty), folder / "ranges.csv")
    save_table(_share_rows(uncertainty), folder / "shares.csv")
    draw_uncertainty(uncertainty, folder / "uncertainty.png")
    return ["uncertainty.json", "input_sets.csv", "ranges.csv", "shares.csv", "uncertainty.png"]


def _range_rows(uncertainty: Uncertainty) -> list[dict[str, Any]]:
    """A row an output: its value as the scene says, its range over the inputs, its variance by cause [%]."""
    return [
        {
            "output": name,
            "value": output.nominal.value,
            "error": output.nominal.stated_error,
            "low_5_percent": output.spread.low,
            "median": output.spread.median,
            "high_95_percent": output.spread.high,
            **{f"{cause}_percent": 100.0 * share for cause, share in output.spread.variance.items()},
        }
        for name, output in uncertainty.outputs.items()
    ]


def _share_rows(uncertainty: Uncertainty) -> list[dict[str, Any]]:
    """A row an output and input: the input's share of the variance [%] with its interval."""
    return [
        {
            "output": name,
            "input": key,
            "share_percent": 100.0 * share.value,
            "low_percent": 100.0 * share.low,
            "high_percent": 100.0 * share.high,
        }
        for name, output in uncertainty.outputs.items()
        for key, share in _by_key(output).items()
    ]


def draw_uncertainty(uncertainty: Uncertainty, path: Path) -> None:
    """A column an output: above the runs of the input sets with the scene's own value, below what each input makes of them."""
    from rbdyn.plots.style import BLUE, GREY, ORANGE, plain, plt, save

    whole, count = _keys(uncertainty), len(uncertainty.outputs)
    keys = [key.partition(".")[2] for key in whole]
    figure, axes = plt.subplots(2, count, figsize=(3.4 * count + 2.0, 3.0 + 0.28 * len(keys)), squeeze=False,
                                height_ratios=(1.0, 0.14 * len(keys) + 0.3))  # fmt: skip
    for column, (name, output) in enumerate(uncertainty.outputs.items()):
        above, below = axes[:, column]
        words, unit = quantity(name)
        above.hist(uncertainty.sets.outputs[:, column], bins=24, color=BLUE, alpha=0.45)
        above.axvspan(output.spread.low, output.spread.high, color=BLUE, alpha=0.12, label="5 to 95 % of the cases")
        above.axvline(output.nominal.value, color=ORANGE, label="as the scene says")
        above.set(xlabel=f"{words} [{unit}]" if unit else words, ylabel="input sets" if column == 0 else "")
        plain(above)
        plain(below)
        by_key = _by_key(output)
        if output.shares is None or output.floor is None:
            below.text(0.5, 0.5, "unknown", transform=below.transAxes, ha="center", color=GREY)
        else:
            places, shares = [whole.index(key) for key in by_key], list(by_key.values())
            below.barh(places, [100.0 * share.value for share in shares], color=BLUE, alpha=0.6)
            below.hlines(
                places, [100.0 * share.low for share in shares], [100.0 * share.high for share in shares], color=GREY
            )
            below.axvline(100.0 * output.floor.high, color=GREY, linestyle=":")
        below.set(yticks=range(len(keys)), yticklabels=keys if column == 0 else [], xlim=(0.0, 100.0),
                  ylim=(len(keys) - 0.5, -0.5), xlabel="share of the variance [%]")  # fmt: skip
    axes[0, 0].legend(fontsize=8)
    save(figure, path)


# Share of cases from which gains hold; least increase in the chance of the right choice that is listed.
NEARLY_ALL, LEAST = 0.9, 1e-3
# Inputs named where the decisive one is undecided; most pairs that a study allows.
CANDIDATES, MOST_PAIRS = 4, 1024
# Share of a gain's variance below which inputs explain too little to call none decisive.
EXPLAINED = 0.5


def robust_record(robust: Robust, factors: Sequence[str]) -> dict[str, Any]:
    """JSON of ``doe study --robust``."""
    return {
        **_better(robust.responses, robust.better),
        "decides": [
            {
                "key": decider.key,
                "flip": decider.flip,
                "worth": decider.worth,
                "pick_above": decider.above,
                "flip_interval": None if decider.flip_interval is None else list(decider.flip_interval),
                "worth_interval": list(decider.worth_interval),
            }
            for decider in robust.decides
            if decider.worth > LEAST and robust.decision.verdict == "decided"
        ],
        "undecided": _undecided(robust) if robust.decision.verdict == "undecided" else None,
        "pair": _pair(robust),
        "halved": _halved(robust),
        "front": None if robust.front is None else _front(robust.front, robust.responses, factors),
        "foretold": dict(zip(robust.responses, robust.explained, strict=True)),
        "inputs": [
            {"key": entry.key, "law": entry.law.model_dump(exclude_none=True), "reason": entry.reason}
            for entry in robust.inputs
        ],
        "screened": dict(robust.screened),
        "pairs": robust.pairs,
        "runs": robust.runs,
        "doubtful": robust.doubtful,
        "sentences": robust_sentences(robust, factors),
    }


def _better(responses: Sequence[str], better: Better) -> dict[str, Any]:
    shares = {name: list(share) for name, share in zip(responses, better.gains, strict=True)}
    return {"better": shares, "all": list(better.all)}


def _front(front: RobustFront, names: Sequence[str], factors: Sequence[str]) -> dict[str, Any]:
    def named(keys: Sequence[str], values: Any) -> dict[str, float]:
        return dict(zip(keys, map(float, values), strict=True))

    return {
        "points": [
            {"factors": named(factors, point), "gains": named(names, gains)}
            for point, gains in zip(front.points, front.gains, strict=True)
        ],
        "confirmed": [
            {
                "name": name,
                "reason": point.reason,
                "factors": named(factors, point.point),
                "gains": named(names, point.gains),
                **_better(names, point.better),
            }
            for name, point in front.confirmed.items()
        ],
        "q2": named(names, front.q2),
        "note": front.note,
    }


def robust_sentences(robust: Robust, factors: Sequence[str]) -> list[str]:
    """The probability that the pick is better, the decisive input, the effect of the ranges, and a safer point."""
    chances = ", ".join(
        f"{quantity(name)[0]} {of_hundred(share)} %"
        for name, share in zip(robust.responses, robust.better.gains, strict=True)
    )
    whole = robust.better.all
    robust_gains, dependent_gains = "The gains hold over the unknown inputs", "The gains depend on the unknown inputs"
    statement = robust_gains if whole.value >= NEARLY_ALL else dependent_gains
    return [
        f"Probability that the pick is better: {chances}; in all of these {of_hundred(whole)} %. {statement} "
        f"({counted(len(robust.inputs), 'input')}, {robust.pairs} input sets, both designs at each).",
        _decision(robust),
        *_of_front(robust, factors),
        f"With ranges half as wide it would be better in all with a probability of about {100.0 * _halved(robust):.0f} %.",
        *(f"{note}." for note in robust.notes),
    ]


def _halved(robust: Robust) -> float:
    """Probability of all gains with ranges half as wide."""
    return min(max(robust.better.all.value + robust.halved, 0.0), 1.0)


def _of_front(robust: Robust, factors: Sequence[str]) -> list[str]:
    front = robust.front
    if front is None or not front.confirmed:
        return [] if front is None else [f"Robust front: {front.note}."]
    pick, *others = front.confirmed.values()
    best = max(others, key=lambda point: point.better.all.value)
    lost = [quantity(name)[0] for name, q2 in zip(robust.responses, front.q2, strict=True) if q2 < EXPLAINED]
    doubt = f"; the emulators predict little of {' and '.join(lost)}, so a better one may exist" if lost else ""
    if best.better.all.value <= pick.better.all.value:
        return [
            f"No simulated point of the robust front is better in all responses in more cases than the pick{doubt}."
        ]
    place = ", ".join(
        f"{quantity(name)[0]} {shown(float(x))} {quantity(name)[1]}".rstrip()
        for name, x in zip(factors, best.point, strict=True)
    )
    return [
        f"Safer alternative: {place} (better in all responses in {of_hundred(best.better.all)} of 100 cases; the pick at the "
        f"same input sets in {of_hundred(pick.better.all)}){doubt}."
    ]


def _pair(robust: Robust) -> dict[str, Any] | None:
    interval = robust.decision.pair_interval
    if robust.pair is None or interval is None:
        return None
    return {"keys": list(robust.pair[:2]), "worth": robust.pair[2], "worth_interval": list(interval)}


def _decision(robust: Robust) -> str:
    """The decisive input, that none is worth measuring, or that more pairs are needed to decide."""
    verdict = robust.decision.verdict
    first = _decided if verdict == "decided" else _undecided if verdict == "undecided" else _nothing
    return f"{first(robust)}{_together(robust)}"


def _decided(robust: Robust) -> str:
    best = robust.decides[0]
    return f"Most decisive unknown: {best.key}.{_flip(best)} Measuring it raises the chance of the right choice by {_points(best)} points."


def _flip(best: Decider) -> str:
    """The side of the flip on which the original is better."""
    # Choices have no order.
    if not is_number(best.flip):
        return ""
    if best.flip_interval is None:
        return " The value at which it changes the choice is too uncertain to state."
    unit, side = quantity(best.key)[1], "Below" if best.above else "Above"
    low, high = (shown(float(end), 3) for end in best.flip_interval)
    return f" {side} {shown(best.flip, 3)} ({low} to {high}) {unit}".rstrip() + " keep the original."


def _undecided(robust: Robust) -> str:
    """The inputs that may be decisive, and how many pairs would decide between them."""
    decision = robust.decision
    worths = {decider.key: _points(decider) for decider in robust.decides}
    best, *rest = decision.rivals
    others = "".join(f", {key} by {worths[key]}" for key in rest[: CANDIDATES - 1])
    more = len(rest) - CANDIDATES + 1
    if more > 0:
        others += f", {counted(more, 'other input')} by less"
    many = 2 ** math.ceil(math.log2(decision.needed)) if decision.needed <= MOST_PAIRS else 0
    enough = (
        f"About {many} pairs would decide ([robust] points = {many})"
        if many
        else f"More than {MOST_PAIRS} pairs, the most that [robust] points allows, would be needed to decide"
    )
    return (
        "Undecided which unknown is most decisive: measuring "
        f"{best} raises the chance of the right choice by {worths[best]} points{others}. {enough}{_lost(robust)}."
    )


def _nothing(robust: Robust) -> str:
    """The sentence that no input is worth measuring, with the most that any could be worth."""
    p = robust.better.all.value
    most = min(max((decider.worth_interval[1] for decider in robust.decides), default=0.0), 1.0 - max(p, 1.0 - p))
    return (
        "No measurement of one unknown is worth making: it would raise the chance of the right choice by at most "
        f"{math.ceil(100.0 * most):.0f} points{_lost(robust)}."
    )


def _lost(robust: Robust) -> str:
    """The gains that the inputs hardly explain, so that no input can show as decisive."""
    explained = zip(robust.responses, robust.explained, strict=True)
    lost = [quantity(name)[0] for name, share in explained if share < EXPLAINED]
    return f"; the inputs explain less than half of the gain in {' and '.join(lost)}" if lost else ""


def _together(robust: Robust) -> str:
    """The worth of measuring the best pair."""
    interval = robust.decision.pair_interval
    if robust.pair is None or interval is None:
        return ""
    first, second, worth = robust.pair
    return f" Measuring {first} and {second} together raises that chance by {_hundredths(worth, interval)} points."


def _points(one: Decider) -> str:
    return _hundredths(one.worth, one.worth_interval)


def _hundredths(value: float, interval: Sequence[float]) -> str:
    """'12 (8 to 15)': a gain in a chance, in points of a hundred, with its interval."""
    low, high = interval
    return of_hundred((value, low, high))
