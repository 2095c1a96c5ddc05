"""Calibration by measurements on a rig: what they identify of the inputs, as blocks, JSON, tables and pictures."""

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from doe.unknown import inputs
from doe.unknown.calibration import allowance_words
from doe.unknown.offsets import Unseen
from doe.unknown.posterior import contraction_words
from doe.workflow.calibration import CALIBRATED, Calibration
from doe.workflow.input_sets import NORMAL
from rbdyn.base.arrays import Array
from rbdyn.base.blocks import Block, Bullets, Paragraph, Table, with_notes
from rbdyn.base.identity import Identity
from rbdyn.base.pace import duration
from rbdyn.base.page import REPORT, with_report
from rbdyn.base.records import plain, save_table
from rbdyn.base.storage import digest_of, intact, sign
from rbdyn.base.tables.sheet import text_of
from rbdyn.base.words import counted, quantity, shown
from rbdyn.base.workbook import NAME as WORKBOOK
from rbdyn.result import read_json, write_json
from rbdyn.scene.unknown import Input

FORMAT, POSTERIOR = "doe.calibration/2", "doe.posterior/1"
RECORD, SAMPLE, OF_SAMPLE = "calibration.json", "posterior.csv", "posterior.json"
CORNER, COMPARED, MEASURED = "corner.png", "measured.png", "measured.csv"
FILES = (RECORD, SAMPLE, OF_SAMPLE, CORNER, COMPARED, MEASURED, REPORT, WORKBOOK)
ENDS = (0.05, 0.5, 0.95)
TAUS = (0.5, 0.05, 0.95)
# Least move of an input by an unseen offset that is named next to the largest, in standard deviations; most of them.
MOVED, MOST_MOVED = 0.5, 3
# Most inputs of a corner plot, those that contract most; share of their ranges that it omits at either end.
SHOWN, END = 8, 1e-3


def record_of(calibration: Calibration, made_of: str) -> dict[str, Any]:
    """JSON record of ``doe calibrate``; ``made_of`` states the question that it answers."""
    keys = [entry.key for entry in calibration.inputs]
    posterior = calibration.match.sampled
    learnt, judgement = calibration.learnt, calibration.judgement
    trial = None if judgement is None else judgement.trial
    taus = (
        []
        if posterior is None
        else np.quantile(calibration.match.errors(posterior.points).level, TAUS, axis=0).T.tolist()
    )
    return {
        "format": FORMAT,
        "made_of": made_of,
        "scene": calibration.case.source,
        "data": str(calibration.rig.path),
        "verdict": calibration.verdict,
        "reasons": calibration.reasons,
        "learned": {} if learnt is None else dict(zip(keys, learnt.contraction.tolist(), strict=True)),
        "combinations": [
            {
                "powers": {keys[place]: power for place, power in combination.powers.items()},
                "sd_percent": 100.0 * combination.after,
                "sd_percent_before": 100.0 * combination.before,
            }
            for combination in (learnt.combinations if learnt else ())
        ],
        "discrepancy": dict(zip(calibration.rig.outputs, taus, strict=False)),
        "outputs": _outputs(calibration),
        "held_out": None if trial is None else {
            "rows": "held out" if trial.validation else "each condition in turn",
            "values": trial.cells,
            "inside_90_percent": trial.inside,
            "crps": trial.crps,
            "crps_before": trial.crps_before,
            "width": {
                "values": trial.width.cells,
                "ratio": trial.width.ratio,
                "chance": trial.width.chance,
                "power_too_wide": calibration.design.power.wide,
                "power_too_narrow": calibration.design.power.narrow,
            },
        },
        "posterior": None if posterior is None else SAMPLE,
        "inputs": {} if posterior is None else _inputs(calibration),
        "outliers": [_cell(calibration, place) for place in calibration.outliers()],
        "without_outliers": calibration.without,
        "cells": [_cell(calibration, place) for place in range(len(calibration.cells))],
        "log_evidence": None if posterior is None else posterior.log_evidence,
        "volumes": calibration.match.volumes,
        "screened": calibration.screened,
        "runs": calibration.runs,
        "seed": calibration.case.scene.calibrate.seed,
        "notes": plain(calibration.notes),
    }  # fmt: skip


def cost_of(runs: int, turns: float, seconds: float) -> dict[str, Any]:
    """Runs, shaft turns and wall time [s] until the files are written."""
    return {"runs": runs, "turns": turns, "seconds": seconds}


def _cost_words(cost: dict[str, Any]) -> str:
    """What the calibration took."""
    return f"{counted(cost['runs'], 'run')} of {shown(cost['turns'], 3)} shaft turns in all took {duration(cost['seconds'])}."


def _outputs(calibration: Calibration) -> dict[str, Any]:
    """Whether the model explains each output: discrepancy of its level, allowed scales, evidence, and what could hide."""
    refuted = {calibration.cells[place][1] for place in calibration.match.refuted}
    outputs = calibration.judgement.outputs if calibration.judgement else [None] * len(calibration.rig.outputs)
    return {
        name: {
            "explained": name not in refuted and explanation is not None and explanation.explained,
            "discrepancy": None if explanation is None else np.expm1(explanation.bias).tolist(),
            "allowed": None if explanation is None else explanation.allowed,
            "accuracy_percent": 100.0 * calibration.rig.accuracies[name],
            "evidence": None if explanation is None else explanation.evidence,
            **_unseen(calibration, None if explanation is None else explanation.unseen),
        }
        for name, explanation in zip(calibration.rig.outputs, outputs, strict=True)
    }


def _unseen(calibration: Calibration, unseen: Unseen | None) -> dict[str, Any]:
    """The largest offset that would not be seen, and by how much it moves each number among the inputs.

    ``moves``: in the units of the scene; ``moves_sd``: in standard deviations of the posterior."""
    match, posterior = calibration.match, calibration.match.sampled
    if unseen is None or posterior is None:
        return {"resolution": None, "moves": {}, "moves_sd": {}}
    scores = posterior.points[:, : len(calibration.inputs)]
    centre, sds = scores.mean(axis=0), scores.std(axis=0)
    quantiles = match.quantiles(np.array([centre, centre + unseen.moves]))
    moves, shares = dict[str, float](), dict[str, float]()
    for place, entry in enumerate(calibration.inputs):
        if entry.law.law != "choices":
            low, high = _between(calibration, place, quantiles[:, place])
            moves[entry.key], shares[entry.key] = high - low, float(unseen.moves[place] / sds[place])
    return {"resolution": float(np.expm1(unseen.offset)), "moves": moves, "moves_sd": shares}


def _inputs(calibration: Calibration) -> dict[str, Any]:
    listed, values, ends = dict[str, dict[str, Any]](), calibration.sample, calibration.ends
    for place, entry in enumerate(calibration.inputs):
        column = [row[entry.key] for row in values]
        if entry.law.law == "choices":
            listed[entry.key] = {
                "shares": {str(value): count / len(column) for value, count in Counter(column).items()}
            }
        else:
            low, high = _between(calibration, place, ends[:, place])
            listed[entry.key] = {"low": low, "median": float(np.median(column)), "high": high}
            listed[entry.key]["before"] = list(_between(calibration, place, np.array([ENDS[0], ENDS[-1]])))
        assert calibration.learnt is not None
        listed[entry.key]["seen"] = contraction_words(float(calibration.learnt.contraction[place]))
    return listed


def _between(calibration: Calibration, place: int, quantiles: Array) -> tuple[float, float]:
    """Values of the scene at two quantiles of an input's law."""
    entry = calibration.inputs[place]
    low, high = (calibration.case.unit(entry) * value for value in inputs.values_of(entry.law, quantiles))
    return low, high


def _cell(calibration: Calibration, place: int) -> dict[str, Any]:
    (row, name), measured = calibration.cells[place], calibration.match.measured
    value = float(np.exp(measured.values[place]))
    return {
        "row": row,
        "output": name,
        "measured": value,
        "sd": value * float(np.sqrt(measured.variances[place])),
        "held": bool(measured.validation[place]),
        "as_the_scene_says": float(np.exp(calibration.nominal[place])),
        "before": _ends(calibration.before[:, place]),
        "after": None if calibration.after is None else _ends(calibration.after[:, place]),
        "residual": None if calibration.judgement is None else float(calibration.judgement.residuals[place]),
    }


def _ends(logarithms: Array) -> list[float]:
    return np.exp(np.quantile(logarithms, ENDS)).tolist()


def blocks(record: dict[str, Any]) -> list[Block]:
    """The verdict with its reasons, inputs, identified combinations, outputs, the quality of predictions, and notes."""
    calibrated = record["verdict"] == CALIBRATED
    inputs = [
        (key, *_interval(row), f"{record['learned'][key]:.2f}", row["seen"])
        for key, row in sorted(record["inputs"].items(), key=lambda pair: -record["learned"][pair[0]])
    ]
    caption = "Inputs: 5 to 95 % before, the densest 90 % or more after, which may reach an end of the range"
    header = ("input", "before", "after", "median", "contraction", "")
    outputs = [
        _output_words(quantity(name)[0], explanation)
        for name, explanation in record["outputs"].items()
        if explanation["evidence"] is not None
    ]
    answer: list[Block] = [
        Paragraph(verdict_words(record), "statement" if calibrated else "warning"),
        Bullets([] if calibrated else _hidden(record)),
        Table(caption, header, inputs, text_columns=(1, 2, 5)),
        Bullets([*map(_combination, record["combinations"]), *outputs]),
        Bullets([*_prediction_quality(record["held_out"]), *_outliers(record)]),
        Paragraph(_screened(record["screened"])),
        Paragraph(_cost_words(record["cost"]) if "cost" in record else "", "small"),
    ]
    return with_notes(record["notes"], answer, judged=False)


def verdict_words(record: Mapping[str, Any]) -> str:
    """The verdict with its reasons, or with what could hide from a calibration that nothing contradicts."""
    sentences = "; ".join(_hidden(record) if record["verdict"] == CALIBRATED else record["reasons"])
    return f"{record['verdict']}{': ' if sentences else ''}{sentences}"


def _combination(combination: dict[str, Any]) -> str:
    """The accuracy of a product of powers of inputs."""
    powers = " · ".join(f"{key}^{power:.2g}" for key, power in combination["powers"].items())
    return f"identified combination {powers}: known to {combination['sd_percent']:.2g} % (before {combination['sd_percent_before']:.2g} %)"


def _prediction_quality(trial: dict[str, Any] | None) -> list[str]:
    """How well values are predicted that were not learned from."""
    if not trial:
        return []
    inside = f"{trial['inside_90_percent']} of {trial['values']} values in their 90 % interval"
    width = trial["width"]
    return [
        f"{trial['rows']}: {inside}, CRPS {trial['crps']:.2g} (before {trial['crps_before']:.2g})",
        f"width of predictions: residuals of {counted(width['values'], 'value')} scatter {width['ratio']:.2g} times the predicted "
        f"scatter (chance {100.0 * width['chance']:.2g} %)",
    ]


def _outliers(record: dict[str, Any]) -> list[str]:
    """Outliers among the measured values, and the contraction without them."""
    sentences = [
        f"{quantity(cell['output'])[0]} of row {cell['row']} is {cell['residual']:.1f} standard deviations off its prediction by the others"
        for cell in record["outliers"]
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


def _output_words(name: str, explanation: dict[str, Any]) -> str:
    """The discrepancy of an output, and what is allowed."""
    median, low, high = (100.0 * value for value in explanation["discrepancy"])
    words = "explained" if explanation["explained"] else "not explained"
    allowed = allowance_words(explanation["allowed"], 0.01 * explanation["accuracy_percent"])
    off = f"{name}: {words}, {median:+.2g} % off its level ({low:+.2g} to {high:+.2g}), {allowed}"
    return f"{off}, Bayes factor {explanation['evidence']:.3g}"


def _hidden(record: Mapping[str, Any]) -> list[str]:
    """What could hide in each output."""
    return [
        _hidden_words(quantity(name)[0], output) for name, output in record["outputs"].items() if output["resolution"]
    ]


def _hidden_words(name: str, output: Mapping[str, Any]) -> str:
    """The offset of an output's sensor that would not be seen, and the inputs that it moves most."""
    shares = sorted(output["moves_sd"].items(), key=lambda pair: -abs(pair[1]))
    named = [key for place, (key, share) in enumerate(shares[:MOST_MOVED]) if place == 0 or abs(share) >= MOVED]
    moves = " and ".join(f"{key} by {shown(output['moves'][key], 2)}" for key in named)
    words = f"an offset of the {name} below {shown(100.0 * output['resolution'], 2)} % would not be seen"
    return f"{words} and moves {moves}" if moves else words


def _interval(row: dict[str, Any]) -> tuple[str, str, str]:
    if "shares" in row:
        return "", ", ".join(f"{value} {100.0 * share:.0f} %" for value, share in row["shares"].items()), ""
    before, after = row["before"], (row["low"], row["high"])
    ranges = [f"{shown(low)} to {shown(high)}" for low, high in (before, after)]
    return ranges[0], ranges[1], shown(row["median"])


def write(calibration: Calibration, record: dict[str, Any], folder: Path, identity: Identity) -> None:
    """Tables, the posterior sample with its verdict, pictures, the page and the workbook of these, calibration.json."""
    with_report(folder, identity, partial(blocks, record), partial(_write_parts, calibration, record))
    # Last, as it marks the folder as complete.
    sign(record)
    write_json(folder / RECORD, record)


def _write_parts(calibration: Calibration, record: dict[str, Any], folder: Path) -> list[str]:
    """measured.csv, the posterior sample with its verdict, and the pictures; returns their names."""
    save_table(map(_measured_row, record["cells"]), folder / MEASURED)
    draw_compared(record, folder / COMPARED)
    if calibration.match.sampled is not None:
        write_sample(calibration.sample, folder / SAMPLE)
        origin = {name: record[name] for name in ("verdict", "reasons", "scene", "data", "made_of")}
        sha256 = digest_of((folder / SAMPLE).read_bytes())
        write_json(folder / OF_SAMPLE, {"format": POSTERIOR, "sample": SAMPLE, "sha256": sha256, **origin})
        draw_corner(calibration, record, folder / CORNER)
    return _parts(record)


def _measured_row(cell: Mapping[str, Any]) -> dict[str, Any]:
    """A measured value with its predictions before and after the calibration, as a row of a table."""
    alone = {key: value for key, value in cell.items() if key not in ("before", "after")}
    ends = ("5_percent", "median", "95_percent")
    predictions = {
        f"{when}_{end}": value
        for when in ("before", "after")
        for end, value in zip(ends, cell[when] or (), strict=False)
    }
    return alone | predictions


def write_sample(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """A posterior sample as CSV, a row an input set by key, which reads as the same values."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(map(text_of, row) for row in (list(rows[0]), *(row.values() for row in rows)))


def _parts(record: dict[str, Any]) -> list[str]:
    return [MEASURED, *((SAMPLE, OF_SAMPLE, CORNER) if record["posterior"] else ()), COMPARED]


def files_of(record: dict[str, Any]) -> list[str]:
    """Names of the files of a calibration."""
    return [RECORD, *_parts(record), REPORT, WORKBOOK]


def stored(folder: Path, made_of: str) -> dict[str, Any] | None:
    """The record in a folder, if the same code made it for the same question and its files are complete."""
    try:
        record = read_json(folder / RECORD)
        complete = intact(record) and record["made_of"] == made_of
        complete = complete and all((folder / name).exists() for name in files_of(record))
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return dict(record) if complete else None


def draw_corner(calibration: Calibration, record: dict[str, Any], path: Path) -> None:
    """The posterior of the inputs that contract most: each over its range before, each pair as a cloud."""
    from rbdyn.plots.style import BLUE, GREY, plain, plt, save

    ranked = sorted(range(len(calibration.inputs)), key=lambda place: -record["learned"][calibration.inputs[place].key])
    places = [place for place in ranked if calibration.inputs[place].law.law != "choices"][:SHOWN]
    columns = [[row[calibration.inputs[place].key] for row in calibration.sample] for place in places]
    ranges = [_between(calibration, place, np.array([END, 1.0 - END])) for place in places]
    count = max(len(places), 1)
    figure, axes = plt.subplots(count, count, figsize=(1.7 * count + 1.5, 1.7 * count + 0.8), squeeze=False)
    for (down, across), axis in np.ndenumerate(axes):
        if across > down or not places:
            axis.set_visible(False)
            continue
        plain(axis)
        key, other = (calibration.inputs[places[place]] for place in (across, down))
        ticks = _along(key, *ranges[across], 3)
        axis.set(xscale=_scale(key), xlim=ranges[across])
        axis.set_xticks(ticks, [f"{tick:.2g}" for tick in ticks])
        if across == down:
            axis.hist(columns[across], bins=_along(key, *ranges[across], 21), color=BLUE, alpha=0.6)
            axis.set_yticks([])
        else:
            style = {"markersize": 1.5, "alpha": 0.35, "rasterized": True}
            axis.plot(columns[across], columns[down], ".", color=BLUE, **style)
            ticks = _along(other, *ranges[down], 3)
            axis.set(yscale=_scale(other), ylim=ranges[down])
            axis.set_yticks(ticks, [f"{tick:.2g}" for tick in ticks])
        axis.tick_params(labelsize=6)
        axis.minorticks_off()
        if down == count - 1:
            axis.set_xlabel(key.key.replace(".", ".\n"), fontsize=6.5)
        if across == 0 and down > 0:
            axis.set_ylabel(other.key.replace(".", ".\n"), fontsize=6.5)
    title = f"inputs after the measurements, over their ranges before; {record['verdict']}"
    figure.suptitle(title, fontsize=8, color=GREY)
    save(figure, path)


def _scale(entry: Input) -> str:
    return "log" if entry.law.law == "log_uniform" else "linear"


def _along(entry: Input, low: float, high: float, count: int) -> list[float]:
    """Evenly spread values of an input's range."""
    values: list[float] = (np.geomspace if _scale(entry) == "log" else np.linspace)(low, high, count).tolist()
    return values


def draw_compared(record: dict[str, Any], path: Path) -> None:
    """A panel for each output: deviations of the simulation before and after, by row, in percent of the measured values."""
    from rbdyn.plots.style import BLUE, GREY, ORANGE, VERMILION, plain, plt, save

    outputs = list(dict.fromkeys(cell["output"] for cell in record["cells"]))
    figure, axes = plt.subplots(1, len(outputs), figsize=(4.2 * len(outputs), 3.6), squeeze=False)
    for axis, name in zip(axes[0], outputs, strict=True):
        plain(axis)
        own = [cell for cell in record["cells"] if cell["output"] == name]
        rows, measured = [cell["row"] for cell in own], np.array([cell["measured"] for cell in own])
        for key, colour, width in (("before", GREY, 9.0), ("after", BLUE, 5.0)):
            if own[0][key] is not None:
                low, middle, high = 100.0 * (np.array([cell[key] for cell in own]).T / measured - 1.0)
                words = f"simulated, 5 to 95 % of the inputs {key}"
                axis.vlines(rows, low, high, color=colour, linewidth=width, alpha=0.35, label=words)
                axis.plot(rows, middle, "_", color=colour, markersize=8)
        nominal = np.array([cell["as_the_scene_says"] for cell in own])
        axis.plot(rows, 100.0 * (nominal / measured - 1.0), "x", color=ORANGE, markersize=4, label="as the scene says")
        for in_trial, mark, words in ((False, "o", "measured, 95 %"), (True, "s", "measured and held out")):
            errors = {
                cell["row"]: 100.0 * NORMAL * cell["sd"] / cell["measured"] for cell in own if cell["held"] is in_trial
            }
            if errors:
                axis.errorbar([*errors], [0.0] * len(errors), yerr=[*errors.values()], fmt=mark, color=VERMILION,
                              markersize=3.5, label=words)  # fmt: skip
        axis.set(xlabel="row", ylabel=f"{quantity(name)[0]}, off measured [%]", xticks=rows)
    handles, words = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, words, fontsize=7, loc="lower center", ncols=len(words), bbox_to_anchor=(0.5, -0.06))
    save(figure, path)
