"""What measurements on a rig identify of a scene's inputs: as blocks, as JSON, as tables and as pictures."""

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from doe.study_file.table import text_of
from doe.unknown import inputs
from doe.unknown.posterior import seen
from doe.workflow.calibration import Calibration
from doe.workflow.input_sets import NORMAL
from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Block, Bullets, Detail, Note, Paragraph, Table
from rbdyn.base.storage import digest_of, intact, sign
from rbdyn.base.words import counted, quantity, shown
from rbdyn.result import read_json, write_json
from rbdyn.scene.unknown import Input

FORMAT, POSTERIOR = "doe.calibration/1", "doe.posterior/1"
RECORD, SAMPLE, OF_SAMPLE = "calibration.json", "posterior.csv", "posterior.json"
CORNER, COMPARED = "corner.png", "measured.png"
ENDS = (0.05, 0.5, 0.95)
TAUS = (0.5, 0.05, 0.95)
OFFSET = "A constant offset is absorbed by the discrepancy; only differences between rows and outputs identify inputs."
# Inputs that a corner plot shows at most, those that were learned best; what it leaves out at the ends of their ranges.
SHOWN, END = 8, 1e-3


def record_of(found: Calibration, made_of: str) -> dict[str, Any]:
    """JSON record of ``doe calibrate``; ``made_of`` states what it was asked of."""
    keys = [each.key for each in found.inputs]
    posterior = found.found.sampled
    learnt, judgement = found.learnt, found.judgement
    tried = None if judgement is None else judgement.trial
    taus = [] if posterior is None else np.quantile(found.found.errors(posterior.points).level, TAUS, axis=0).T.tolist()
    return {
        "format": FORMAT,
        "made_of": made_of,
        "scene": found.case.source,
        "data": str(found.rig.path),
        "verdict": found.verdict,
        "reasons": found.reasons,
        "learned": {} if learnt is None else dict(zip(keys, learnt.contraction.tolist(), strict=True)),
        "combinations": [
            {
                "powers": {keys[place]: power for place, power in each.powers.items()},
                "sd_percent": 100.0 * each.after,
                "sd_percent_before": 100.0 * each.before,
            }
            for each in (learnt.combinations if learnt else ())
        ],
        "discrepancy": dict(zip(found.rig.outputs, taus, strict=False)),
        "outputs": _outputs(found),
        "held_out": None if tried is None else {
            "rows": "held out" if tried.held else "each condition in turn",
            "values": tried.cells,
            "inside_90_percent": tried.inside,
            "crps": tried.crps,
            "crps_before": tried.crps_before,
            "width": {
                "values": tried.width.cells,
                "ratio": tried.width.ratio,
                "chance": tried.width.chance,
                "power_too_wide": tried.width.power[0],
                "power_too_narrow": tried.width.power[1],
            },
        },
        "posterior": None if posterior is None else SAMPLE,
        "inputs": {} if posterior is None else _inputs(found),
        "outliers": [_cell(found, place) for place in found.outliers()],
        "without_outliers": found.without,
        "cells": [_cell(found, place) for place in range(len(found.cells))],
        "log_evidence": None if posterior is None else posterior.log_evidence,
        "volumes": found.found.volumes,
        "screened": found.screened,
        "runs": found.runs,
        "seed": found.case.scene.calibrate.seed,
        "notes": list(found.notes),
    }  # fmt: skip


def _outputs(found: Calibration) -> dict[str, Any]:
    """Of each output whether the model explains it: shares by which it is off its level, allowed and seen at least."""
    refuted = {found.cells[place][1] for place in found.found.refuted}
    outputs = found.judgement.outputs if found.judgement else [None] * len(found.rig.outputs)
    return {
        name: {
            "explained": name not in refuted and each is not None and each.explained,
            "discrepancy": None if each is None else np.expm1(each.bias).tolist(),
            "allowed": None if each is None else each.allowed,
            "evidence": None if each is None else each.evidence,
            "resolution": None if each is None or each.resolution is None else float(np.expm1(each.resolution)),
        }
        for name, each in zip(found.rig.outputs, outputs, strict=True)
    }


def _inputs(found: Calibration) -> dict[str, Any]:
    listed, values, ends = dict[str, dict[str, Any]](), found.sample, found.ends
    for place, each in enumerate(found.inputs):
        column = [row[each.key] for row in values]
        if each.law.law == "choices":
            listed[each.key] = {"shares": {str(value): count / len(column) for value, count in Counter(column).items()}}
        else:
            low, high = _between(found, place, ends[:, place])
            listed[each.key] = {"low": low, "median": float(np.median(column)), "high": high}
            listed[each.key]["before"] = list(_between(found, place, np.array([ENDS[0], ENDS[-1]])))
        assert found.learnt is not None
        listed[each.key]["seen"] = seen(float(found.learnt.contraction[place]))
    return listed


def _between(found: Calibration, place: int, quantiles: Array) -> tuple[float, float]:
    """What the scene has at two quantiles of an input's law."""
    each = found.inputs[place]
    low, high = (found.case.unit(each) * value for value in inputs.values_of(each.law, quantiles))
    return low, high


def _cell(found: Calibration, place: int) -> dict[str, Any]:
    (row, name), measured = found.cells[place], found.found.measured
    value = float(np.exp(measured.values[place]))
    return {
        "row": row,
        "output": name,
        "measured": value,
        "sd": value * float(np.sqrt(measured.variances[place])),
        "held": bool(measured.held[place]),
        "as_the_scene_says": float(np.exp(found.nominal[place])),
        "before": _ends(found.before[:, place]),
        "after": None if found.after is None else _ends(found.after[:, place]),
        "residual": None if found.judgement is None else float(found.judgement.residuals[place]),
    }


def _ends(logarithms: Array) -> list[float]:
    return np.exp(np.quantile(logarithms, ENDS)).tolist()


def blocks(record: dict[str, Any]) -> list[Block]:
    """The verdict with its reasons, the inputs, identified combinations, each output, how well the rest is predicted, notes."""
    reasons = "; ".join(record["reasons"])
    inputs = [
        (key, *_interval(each), f"{record['learned'][key]:.2f}", each["seen"])
        for key, each in sorted(record["inputs"].items(), key=lambda pair: -record["learned"][pair[0]])
    ]
    caption = "Inputs: 5 to 95 % before, the densest 90 % after, which may reach an end of the range"
    header = ("input", "before", "after", "median", "contraction", "")
    outputs = [
        _output_words(quantity(name)[0], each)
        for name, each in record["outputs"].items()
        if each["evidence"] is not None
    ]
    return [
        Paragraph(f"{record['verdict']}{': ' if reasons else ''}{reasons}", "statement"),
        Table(caption, header, inputs, text_columns=(1, 2, 5)),
        Bullets([*map(_combination, record["combinations"]), *outputs]),
        Paragraph(OFFSET if inputs else ""),
        Bullets([*_predicted(record["held_out"]), *_outliers(record)]),
        Paragraph(_screened(record["screened"])),
        *(Note(note, Detail.LEAST) for note in record["notes"]),
    ]


def _combination(each: dict[str, Any]) -> str:
    """How well a product of powers is known."""
    powers = " · ".join(f"{key}^{power:.2g}" for key, power in each["powers"].items())
    return f"identified combination {powers}: known to {each['sd_percent']:.2g} % (before {each['sd_percent_before']:.2g} %)"


def _predicted(tried: dict[str, Any] | None) -> list[str]:
    """How well what was not learned from is predicted."""
    if not tried:
        return []
    inside = f"{tried['inside_90_percent']} of {tried['values']} values in their 90 % interval"
    width = tried["width"]
    return [
        f"{tried['rows']}: {inside}, CRPS {tried['crps']:.2g} (before {tried['crps_before']:.2g})",
        f"width of predictions: residuals of {counted(width['values'], 'value')} scatter {width['ratio']:.2g} times as much as "
        f"predicted (chance {100.0 * width['chance']:.2g} %)",
    ]


def _outliers(record: dict[str, Any]) -> list[str]:
    """Values far off the others, and what is learned without them."""
    sentences = [
        f"{quantity(each['output'])[0]} of row {each['row']} is {each['residual']:.1f} standard deviations off the others"
        for each in record["outliers"]
    ]
    if record["without_outliers"]:
        learned = ", ".join(f"{key} {share:.2f}" for key, share in record["without_outliers"].items())
        sentences.append(f"contraction without these: {learned}")
    return sentences


def _screened(screened: dict[str, float] | None) -> str:
    if not screened:
        return ""
    most = max(screened, key=lambda key: screened[key])
    return (
        f"{counted(len(screened), 'further input')} kept at the scene's value: screening found no effect above "
        f"{100.0 * screened[most]:.2g} % of an output's variance ({most})."
    )


def _output_words(name: str, each: dict[str, Any]) -> str:
    """By how much an output is off its level, what is allowed, and what would be seen."""
    median, low, high = (100.0 * value for value in each["discrepancy"])
    words = "explained" if each["explained"] else "not explained"
    off = f"{name}: {words}, {median:+.2g} % off its level ({low:+.2g} to {high:+.2g}), {100.0 * each['allowed']:.2g} % allowed"
    least = (
        "" if each["resolution"] is None else f"; an offset below {100.0 * each['resolution']:.2g} % would not be seen"
    )
    return f"{off}, Bayes factor {each['evidence']:.3g}{least}"


def _interval(each: dict[str, Any]) -> tuple[str, str, str]:
    if "shares" in each:
        return "", ", ".join(f"{value} {100.0 * share:.0f} %" for value, share in each["shares"].items()), ""
    before, after = each["before"], (each["low"], each["high"])
    told = [f"{shown(low)} to {shown(high)}" for low, high in (before, after)]
    return told[0], told[1], shown(each["median"])


def write(found: Calibration, record: dict[str, Any], folder: Path) -> None:
    """calibration.json, the posterior sample with its verdict, and the pictures."""
    draw_compared(record, folder / COMPARED)
    if found.found.sampled is not None:
        write_sample(found.sample, folder / SAMPLE)
        told = {name: record[name] for name in ("verdict", "reasons", "scene", "data", "made_of")}
        sha256 = digest_of((folder / SAMPLE).read_bytes())
        write_json(folder / OF_SAMPLE, {"format": POSTERIOR, "sample": SAMPLE, "sha256": sha256, **told})
        draw_corner(found, record, folder / CORNER)
    # Last, for it says that all is there.
    sign(record)
    write_json(folder / RECORD, record)


def write_sample(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """A posterior sample as CSV, a row an input set by key, which reads as the same values."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(map(text_of, row) for row in (list(rows[0]), *(each.values() for each in rows)))


def files_of(record: dict[str, Any]) -> list[str]:
    """Names of the files of a calibration."""
    return [RECORD, *((SAMPLE, OF_SAMPLE, CORNER) if record["posterior"] else ()), COMPARED]


def stored(folder: Path, made_of: str) -> dict[str, Any] | None:
    """The record in a folder, where it was made of the same question by the same code and its files are there."""
    try:
        record = read_json(folder / RECORD)
        whole = intact(record) and record["made_of"] == made_of
        whole = whole and all((folder / name).exists() for name in files_of(record))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return dict(record) if whole else None


def draw_corner(found: Calibration, record: dict[str, Any], path: Path) -> None:
    """The posterior of the inputs that were learned best: each over its range before, each pair as a cloud."""
    from rbdyn.plots.style import BLUE, GREY, plain, plt, save

    ranked = sorted(range(len(found.inputs)), key=lambda place: -record["learned"][found.inputs[place].key])
    chosen = [place for place in ranked if found.inputs[place].law.law != "choices"][:SHOWN]
    columns = [[row[found.inputs[place].key] for row in found.sample] for place in chosen]
    ranges = [_between(found, place, np.array([END, 1.0 - END])) for place in chosen]
    count = max(len(chosen), 1)
    figure, axes = plt.subplots(count, count, figsize=(1.7 * count + 1.5, 1.7 * count + 0.8), squeeze=False)
    for (down, across), axis in np.ndenumerate(axes):
        if across > down or not chosen:
            axis.set_visible(False)
            continue
        plain(axis)
        key, other = (found.inputs[chosen[place]] for place in (across, down))
        ticks = _along(key, *ranges[across], 3)
        axis.set(xscale=_scale(key), xlim=ranges[across])
        axis.set_xticks(ticks, [f"{tick:.2g}" for tick in ticks])
        if across == down:
            axis.hist(columns[across], bins=_along(key, *ranges[across], 21), color=BLUE, alpha=0.6)
            axis.set_yticks([])
        else:
            axis.plot(columns[across], columns[down], ".", color=BLUE, markersize=1.5, alpha=0.35)
            ticks = _along(other, *ranges[down], 3)
            axis.set(yscale=_scale(other), ylim=ranges[down])
            axis.set_yticks(ticks, [f"{tick:.2g}" for tick in ticks])
        axis.tick_params(labelsize=6)
        axis.minorticks_off()
        if down == count - 1:
            axis.set_xlabel(key.key.replace(".", ".\n"), fontsize=6.5)
        if across == 0 and down > 0:
            axis.set_ylabel(other.key.replace(".", ".\n"), fontsize=6.5)
    title = f"inputs after the measurements, over their range before; {record['verdict']}"
    figure.suptitle(title, fontsize=8, color=GREY)
    save(figure, path)


def _scale(each: Input) -> str:
    return "log" if each.law.law == "log_uniform" else "linear"


def _along(each: Input, low: float, high: float, count: int) -> list[float]:
    """Evenly spread values of an input's range."""
    found: list[float] = (np.geomspace if _scale(each) == "log" else np.linspace)(low, high, count).tolist()
    return found


def draw_compared(record: dict[str, Any], path: Path) -> None:
    """A panel an output: by how much the simulation was off before and after, by row, in percent of what was measured."""
    from rbdyn.plots.style import BLUE, GREY, ORANGE, VERMILION, plain, plt, save

    outputs = list(dict.fromkeys(each["output"] for each in record["cells"]))
    figure, axes = plt.subplots(1, len(outputs), figsize=(4.2 * len(outputs), 3.6), squeeze=False)
    for axis, name in zip(axes[0], outputs, strict=True):
        plain(axis)
        own = [each for each in record["cells"] if each["output"] == name]
        rows, measured = [each["row"] for each in own], np.array([each["measured"] for each in own])
        for key, colour, width in (("before", GREY, 9.0), ("after", BLUE, 5.0)):
            if own[0][key] is not None:
                low, middle, high = 100.0 * (np.array([each[key] for each in own]).T / measured - 1.0)
                words = f"simulated, 5 to 95 % of the inputs {key}"
                axis.vlines(rows, low, high, color=colour, linewidth=width, alpha=0.35, label=words)
                axis.plot(rows, middle, "_", color=colour, markersize=8)
        said = np.array([each["as_the_scene_says"] for each in own])
        axis.plot(rows, 100.0 * (said / measured - 1.0), "x", color=ORANGE, markersize=4, label="as the scene says")
        for held, mark, words in ((False, "o", "measured, 95 %"), (True, "s", "measured and held out")):
            errors = {
                each["row"]: 100.0 * NORMAL * each["sd"] / each["measured"] for each in own if each["held"] is held
            }
            if errors:
                axis.errorbar([*errors], [0.0] * len(errors), yerr=[*errors.values()], fmt=mark, color=VERMILION,
                              markersize=3.5, label=words)  # fmt: skip
        axis.set(xlabel="row", ylabel=f"{quantity(name)[0]}, off measured [%]", xticks=rows)
    handles, words = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, words, fontsize=7, loc="lower center", ncols=len(words), bbox_to_anchor=(0.5, -0.06))
    save(figure, path)
