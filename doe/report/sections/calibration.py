"""Calibration by measurements on a rig: what they identify of the inputs, as blocks, tables, files and pictures."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from doe.unknown.calibration import Trial, allowance_words
from doe.unknown.posterior import Combination
from doe.workflow import identification
from rbdyn.base.blocks import Block, Bullets, Column, Paragraph, Sheet, with_notes
from rbdyn.base.files import digest_of, intact, read_json, sign, write_json
from rbdyn.base.html import REPORT, with_report
from rbdyn.base.identity import Identity
from rbdyn.base.tables.sheet import text_of
from rbdyn.base.words import NORMAL, all_of, counted, duration, quantity, shown
from rbdyn.base.workbook import NAME as WORKBOOK
from rbdyn.scene.unknown import Input

POSTERIOR = "doe.posterior/1"
RECORD, SAMPLE, OF_SAMPLE = "calibration.json", identification.SAMPLE_FILE, "posterior.json"
CORNER, COMPARED, MEASURED = "corner.png", "measured.png", "measured.csv"
FILES = (RECORD, MEASURED, SAMPLE, OF_SAMPLE, CORNER, COMPARED, REPORT, WORKBOOK)
# Least move of an input by an unseen offset that is named next to the largest, in standard deviations; most of them.
MOVED, MOST_MOVED = 0.5, 3
# Most inputs of a corner plot, those that contract most; share of their ranges that it omits at either end.
SHOWN, END = 8, 1e-3


# Key, contraction and posterior of an input; name and answer of an output.
InputRow = tuple[str, float, identification.InputAnswer]
OutputRow = tuple[str, identification.OutputAnswer]


INPUTS: tuple[Column[InputRow], ...] = (
    Column("input", at=0, meaning="key of the input"),
    Column("", words="before", at=(2, "before_words"), form=str, text=True),
    Column("", words="after", at=(2, "after_words"), form=str, text=True),
    Column("median", at=(2, "median"), meaning="median of the posterior"),
    Column("contraction", ".2f", at=1, meaning="1 - sd after / sd before"),
    Column("seen", words="", at=(2, "seen"), form=str, text=True, meaning="whether it was learned"),
    Column("low", at=(2, "low"), screen=False, meaning="densest 90 % after"),
    Column("high", at=(2, "high"), screen=False),
    Column("before_low", at=(2, "before", 0), screen=False, meaning="range before"),
    Column("before_high", at=(2, "before", 1), screen=False),
)
OUTPUTS: tuple[Column[OutputRow], ...] = (
    Column("output", at=0, meaning="figure"),
    Column("explained", at=(1, "explained"), meaning="whether the simulation explains it"),
    Column("allowed", at=(1, "allowed"), meaning="allowed error of the simulation"),
    Column("accuracy_percent", at=(1, "accuracy_percent"), meaning="accuracy of the sensor"),
    Column("evidence", at=(1, "evidence"), meaning="Bayes factor of a larger error"),
    Column("resolution", at=(1, "resolution"), meaning="largest offset that would not be seen"),
)
CELLS: tuple[Column[identification.Cell], ...] = (
    Column("row", meaning="row of the table"),
    Column("output", meaning="figure"),
    Column("measured", meaning="measured value with its standard deviation"),
    Column("sd"),
    Column("held", meaning="whether its row is held out"),
    Column("as_the_scene_says", meaning="simulated at the scene values"),
    Column("residual", meaning="distance from its prediction by the others, in standard deviations"),
)


def input_sheet(calibration: identification.Calibration) -> Sheet[InputRow]:
    """A row an input, those that contract most first."""
    learned, answers = calibration.learnt.learned, calibration.inputs
    rows = sorted(((key, learned[key], answer) for key, answer in answers.items()), key=lambda row: -row[1])
    choices = dict.fromkeys(value for answer in answers.values() for value in answer.shares or ())
    shares = Column[InputRow]("share_{}", at=(2, "shares", "{}"), screen=False, meaning="share of a choice").of(choices)
    caption = "Inputs: 5 to 95 % before, the densest 90 % or more after, which may reach an end of the range"
    return Sheet(caption, (*INPUTS, *shares), rows)


def output_sheet(calibration: identification.Calibration) -> Sheet[OutputRow]:
    """A row an output."""
    return Sheet("", OUTPUTS, list(calibration.outputs.items()))


def cell_sheet(
    cells: Sequence[identification.Cell], moments: Sequence[str] = ("before", "after")
) -> Sheet[identification.Cell]:
    """A row a measured value, with its predictions before and after the calibration."""
    columns = [*CELLS]
    for when in moments:
        for place, end in enumerate(("5_percent", "median", "95_percent")):
            columns.append(Column(f"{when}_{end}", at=(when, place), meaning=f"predicted {when} the calibration"))
    content = "One row per measured value: measured, simulated and predicted."
    return Sheet("", columns, cells, file=MEASURED, content=content)


def measured_sheet(calibration: identification.Calibration) -> Sheet[identification.Cell]:
    """The measured values of a calibration; without a posterior nothing is predicted after it."""
    return cell_sheet(calibration.cells, ("before", "after") if calibration.posterior else ("before",))


def blocks(calibration: identification.Calibration) -> list[Block]:
    """The verdict with its reasons, inputs, identified combinations, outputs, the quality of predictions, and notes."""
    calibrated = calibration.verdict == identification.CALIBRATED
    explained = [_output_words(*item) for item in calibration.outputs.items() if item[1].evidence is not None]
    answer: list[Block] = [
        Paragraph(verdict_words(calibration), "statement" if calibrated else "warning"),
        Bullets([] if calibrated else _hidden(calibration)),
        input_sheet(calibration).block,
        Bullets([*map(_combination, calibration.learnt.combinations), *explained]),
        Bullets([*_prediction_quality(calibration.held_out), *_outliers(calibration)]),
        Paragraph(_screened(calibration.screened)),
        Paragraph(_cost_words(calibration.cost), "small"),
    ]
    return with_notes(calibration.notes, answer, judged=False)


def verdict_words(calibration: identification.Calibration) -> str:
    """The verdict with its reasons, or with what could hide from a calibration that nothing contradicts."""
    calibrated = calibration.verdict == identification.CALIBRATED
    sentences = "; ".join(_hidden(calibration) if calibrated else calibration.reasons)
    return f"{calibration.verdict}{': ' if sentences else ''}{sentences}"


def _combination(combination: Combination) -> str:
    """The accuracy of a product of powers of inputs."""
    powers = " · ".join(f"{key}^{power:.2g}" for key, power in combination.powers.items())
    known = f"known to {combination.sd_percent:.2g} % (before {combination.sd_percent_before:.2g} %)"
    return f"identified combination {powers}: {known}"


def _prediction_quality(trial: Trial | None) -> list[str]:
    """How well values are predicted that were not learned from."""
    if trial is None:
        return []
    width = trial.width
    return [
        f"{trial.rows}: {trial.inside} of {trial.cells} values in their 90 % interval, CRPS {trial.crps:.2g} "
        f"(before {trial.crps_before:.2g})",
        f"width of predictions: residuals of {counted(width.cells, 'value')} scatter {width.ratio:.2g} times the predicted "
        f"scatter (chance {100.0 * width.chance:.2g} %)",
    ]


def _outliers(calibration: identification.Calibration) -> list[str]:
    """Outliers among the measured values, and the contraction without them."""
    sentences = [
        f"{quantity(cell.output)[0]} of row {cell.row} is {cell.residual:.1f} standard deviations off its prediction by the others"
        for cell in calibration.outliers
    ]
    if calibration.without_outliers:
        learned = ", ".join(f"{key} {share:.2f}" for key, share in calibration.without_outliers.items())
        sentences.append(f"contraction without these: {learned}")
    return sentences


def _screened(screened: Mapping[str, float]) -> str:
    if not screened:
        return ""
    most = max(screened, key=lambda key: screened[key])
    return (
        f"{counted(len(screened), 'further input')} kept at the scene's value: screening found no effect above "
        f"{100.0 * screened[most]:.2g} % of an output's variance ({most})."
    )


def _cost_words(cost: identification.Cost | None) -> str:
    """What the calibration took."""
    if cost is None:
        return ""
    return f"{counted(cost.runs, 'run')} of {shown(cost.turns, 3)} shaft turns in all took {duration(cost.seconds)}."


def _output_words(name: str, output: identification.OutputAnswer) -> str:
    """The discrepancy of an output that has one, and what is allowed."""
    assert output.discrepancy is not None and output.allowed is not None
    median, low, high = (100.0 * value for value in output.discrepancy)
    words = "explained" if output.explained else "not explained"
    allowed = allowance_words(output.allowed, 0.01 * output.accuracy_percent)
    off = f"{quantity(name)[0]}: {words}, {median:+.2g} % off its level ({low:+.2g} to {high:+.2g}), {allowed}"
    return f"{off}, Bayes factor {output.evidence:.3g}"


def _hidden(calibration: identification.Calibration) -> list[str]:
    """What could hide in each output."""
    outputs = calibration.outputs.items()
    return [
        _hidden_words(quantity(name)[0], output, output.resolution) for name, output in outputs if output.resolution
    ]


def _hidden_words(name: str, output: identification.OutputAnswer, resolution: float) -> str:
    """The offset of an output's sensor that would not be seen, and the inputs that it moves most."""
    shares = sorted(output.moves_sd.items(), key=lambda pair: -abs(pair[1]))
    named = [key for place, (key, share) in enumerate(shares[:MOST_MOVED]) if place == 0 or abs(share) >= MOVED]
    moves = all_of(f"{key} by {shown(output.moves[key], 2)}" for key in named)
    words = f"an offset of the {name} below {shown(100.0 * resolution, 2)} % would not be seen"
    return f"{words} and moves {moves}" if moves else words


def write(calibration: identification.Calibration, folder: Path, identity: Identity) -> None:
    """Tables, the posterior sample with its verdict, pictures, the page and the workbook of these, calibration.json."""
    with_report(folder, FILES, identity, partial(blocks, calibration), partial(_write_parts, calibration))
    # Last, as it marks the folder as complete.
    write_json(folder / RECORD, calibration.as_dict())


def signed(calibration: identification.Calibration) -> identification.Calibration:
    """The calibration with the digest by which a folder's record is recognized as unchanged."""
    record = calibration.as_dict()
    sign(record)
    return replace(calibration, sha256=record["sha256"])


def _write_parts(calibration: identification.Calibration, folder: Path) -> None:
    """measured.csv, the posterior sample with its verdict, and the pictures."""
    measured_sheet(calibration).save(folder)
    draw_compared(calibration.cells, folder / COMPARED)
    if calibration.evidence is not None and calibration.posterior:
        write_sample(calibration.evidence.sample, folder / SAMPLE)
        record = calibration.as_dict()
        origin = {name: record[name] for name in ("verdict", "reasons", "scene", "data", "made_of")}
        sha256 = digest_of((folder / SAMPLE).read_bytes())
        write_json(folder / OF_SAMPLE, {"format": POSTERIOR, "sample": SAMPLE, "sha256": sha256, **origin})
        draw_corner(calibration, calibration.evidence, folder / CORNER)


def write_sample(rows: Sequence[Mapping[str, Any]], path: Path) -> None:
    """A posterior sample as CSV, a row an input set by key, which reads as the same values."""
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file).writerows(map(text_of, row) for row in (list(rows[0]), *(row.values() for row in rows)))


def files_of(calibration: identification.Calibration) -> list[str]:
    """Names of the files of a calibration."""
    absent = () if calibration.posterior else (SAMPLE, OF_SAMPLE, CORNER)
    return [name for name in FILES if name not in absent]


def stored(folder: Path, made_of: str) -> identification.Calibration | None:
    """The calibration in a folder, if the same code made it for the same question and its files are complete."""
    try:
        record = read_json(folder / RECORD)
        calibration = identification.Calibration.from_dict(record)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    complete = intact(record) and calibration.made_of == made_of
    return calibration if complete and all((folder / name).exists() for name in files_of(calibration)) else None


def draw_corner(calibration: identification.Calibration, evidence: identification.Evidence, path: Path) -> None:
    """The posterior of the inputs that contract most: each over its range before, each pair as a cloud."""
    from rbdyn.plots.style import BLUE, GREY, save, subplots

    learned, inputs = calibration.learnt.learned, evidence.inputs
    ranked = sorted(range(len(inputs)), key=lambda place: -learned[inputs[place].key])
    places = [place for place in ranked if inputs[place].law.law != "choices"][:SHOWN]
    columns = [[row[inputs[place].key] for row in evidence.sample] for place in places]
    ranges = [evidence.values(place, (END, 1.0 - END)) for place in places]
    count = max(len(places), 1)
    figure, axes = subplots(count, count, figsize=(1.7 * count + 1.5, 1.7 * count + 0.8), squeeze=False)
    for (down, across), axis in np.ndenumerate(axes):
        if across > down or not places:
            axis.set_visible(False)
            continue
        key, other = (inputs[places[place]] for place in (across, down))
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
    title = f"inputs after the measurements, over their ranges before; {calibration.verdict}"
    figure.suptitle(title, fontsize=8, color=GREY)
    save(figure, path)


def _scale(entry: Input) -> str:
    return "log" if entry.law.law == "log_uniform" else "linear"


def _along(entry: Input, low: float, high: float, count: int) -> list[float]:
    """Evenly spread values of an input's range."""
    values: list[float] = (np.geomspace if _scale(entry) == "log" else np.linspace)(low, high, count).tolist()
    return values


def draw_compared(cells: Sequence[identification.Cell], path: Path) -> None:
    """A panel for each output: deviations of the simulation before and after, by row, in percent of the measured values."""
    from rbdyn.plots.style import BLUE, GREY, ORANGE, VERMILION, save, subplots

    outputs = list(dict.fromkeys(cell.output for cell in cells))
    figure, axes = subplots(1, len(outputs), figsize=(4.2 * len(outputs), 3.6), squeeze=False)
    for axis, name in zip(axes[0], outputs, strict=True):
        data = [cell for cell in cells if cell.output == name]
        rows, measured = [cell.row for cell in data], np.array([cell.measured for cell in data])
        predictions = {"before": [cell.before for cell in data], "after": [cell.after for cell in data if cell.after]}
        for key, colour, width in (("before", GREY, 9.0), ("after", BLUE, 5.0)):
            if predictions[key]:
                low, middle, high = 100.0 * (np.array(predictions[key]).T / measured - 1.0)
                words = f"simulated, 5 to 95 % of the inputs {key}"
                axis.vlines(rows, low, high, color=colour, linewidth=width, alpha=0.35, label=words)
                axis.plot(rows, middle, "_", color=colour, markersize=8)
        nominal = np.array([cell.as_the_scene_says for cell in data])
        axis.plot(rows, 100.0 * (nominal / measured - 1.0), "x", color=ORANGE, markersize=4, label="scene values")
        for in_trial, mark, words in ((False, "o", "measured, 95 %"), (True, "s", "measured and held out")):
            errors = {cell.row: 100.0 * NORMAL * cell.sd / cell.measured for cell in data if cell.held is in_trial}
            if errors:
                axis.errorbar([*errors], [0.0] * len(errors), yerr=[*errors.values()], fmt=mark, color=VERMILION,
                              markersize=3.5, label=words)  # fmt: skip
        axis.set(xlabel="row", ylabel=f"{quantity(name)[0]}, off measured [%]", xticks=rows)
    handles, words = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, words, fontsize=7, loc="lower center", ncols=len(words))
    save(figure, path)
