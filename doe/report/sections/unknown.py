"""Unknown inputs: their effect on the figures of a scene (``doe uncertainty``) and on the pick of a study (``--robust``)."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from doe.report.sections.calibration import write_sample
from doe.report.summary import SENSES, Summary
from doe.unknown.propagation import SHARE_LEVEL, Share
from doe.workflow.judgement import Decider, Robust
from doe.workflow.uncertainty import OutputRange, Uncertainty
from rbdyn.base.blocks import Block, Bullets, Column, Paragraph, Section, Sheet, Table, columns_of, with_notes
from rbdyn.base.files import write_json
from rbdyn.base.records import Record, written
from rbdyn.base.words import all_of, counted, quantity, shown
from rbdyn.scene.unknown import UnknownInput

# Most inputs that a sentence names, and the least share of one.
CAUSES_NAMED, LEAST_SHARE_NAMED = 2, 0.1
RANGES: tuple[Column[OutputRange], ...] = (
    Column("output", at="name", cell=lambda output: quantity(output.name)[0], meaning="figure"),
    Column("value", at=("nominal", "value"), screen=False, meaning="value in the scene file, with its 95 % error"),
    Column("error", at=("nominal", "stated_error"), screen=False),
    Column("low_5_percent", at=("input", "low"), screen=False, meaning="range over the unknown inputs"),
    Column("median", at=("input", "median"), screen=False),
    Column("high_95_percent", at=("input", "high"), screen=False),
    Column(
        "simulation_percent",
        ".1f",
        "simulation",
        at=lambda output: 100.0 * output.variance.simulation,
        meaning="share of the variance of a single run by cause",
    ),
    Column("numerical_percent", ".1f", "integration", at=lambda output: 100.0 * output.variance.numerical),
    Column("inputs_percent", ".1f", "inputs", at=lambda output: 100.0 * output.variance.inputs),
)


class InputShare(Record):
    """An input's share of the variance of an output, with its interval."""

    output: str = written("figure")
    input: str = written("key of the input")
    share_percent: float = written("share of the variance, with its interval")
    low_percent: float
    high_percent: float


INPUTS: tuple[Column[UnknownInput], ...] = (
    Column("input", at="key", meaning="key of the input"),
    *(
        Column(key, at=("law", key), screen=False, meaning="law of the input and its numbers")
        for key in ("law", "low", "high", "times")
    ),
    Column("range", at=("law", "words"), text=True, meaning="its range in words"),
    Column("source", words="source of the range", at="reason", text=True, meaning="source of the range"),
)


def range_sheet(outputs: Iterable[OutputRange]) -> Sheet[OutputRange]:
    """A row an output."""
    content = "The range of each output over the unknown inputs, and its variance by cause."
    return Sheet("Variance of a single run by cause [%]", RANGES, list(outputs), file="ranges.csv", content=content)


def share_sheet(outputs: Iterable[OutputRange]) -> Sheet[InputShare]:
    """A row an output and input."""
    rows = [
        InputShare(output.name, key, *(100.0 * number for number in share))
        for output in outputs
        for key, share in output.shares.items()
    ]
    content = "The share of each input in the variance of each output."
    return Sheet("", columns_of(InputShare), rows, file="shares.csv", content=content)


def input_sheet(inputs: Iterable[UnknownInput], *columns: Column[UnknownInput]) -> Sheet[UnknownInput]:
    """A row an unknown input, with further ``columns``."""
    content = "Every unknown input with its range."
    return Sheet(
        "Inputs, ranges and sources", (*INPUTS, *columns), list(inputs), file="unknown_inputs.csv", content=content
    )


def set_sheet(keys: Iterable[str], outputs: Iterable[str]) -> Sheet[Any]:
    """The columns of input sets."""
    columns = (
        *Column[Any]("{}", unit="of the key", meaning="value of each unknown input").of(keys),
        *Column[Any]("{}", unit="of the name", meaning="outputs of that set; not in `posterior.csv`").of(outputs),
    )
    content = (
        "One row per input set: of `doe uncertainty` with its outputs, of `doe calibrate` drawn from the posterior."
    )
    return Sheet("", columns, file="input_sets.csv, posterior.csv", content=content)


def set_rows(uncertainty: Uncertainty) -> list[dict[str, Any]]:
    """Inputs and outputs of each input set."""
    sets = uncertainty.sets
    return [
        {
            **{entry.key: values[entry.key] for entry in uncertainty.inputs},
            **dict(zip(uncertainty.responses, figures, strict=True)),
        }
        for values, figures in zip(sets.inputs, sets.outputs.values.tolist(), strict=True)
    ]


def range_sentence(output: OutputRange) -> str:
    """'impact force 87.1 ± 0.4 N; 60 to 132 N in 90 % of the cases over the unknown inputs; the bar stiffness causes 87 %'."""
    words, unit = quantity(output.name)
    nominal, ends = output.nominal, output.input
    head = f"{words} {nominal.text} {unit}".rstrip()
    if output.hidden:
        return f"{head}; simulation noise exceeds the effect of the inputs"
    interval = f"{shown(ends.low)} to {shown(ends.high)} {unit}".rstrip()
    outside = "" if ends.low <= nominal.value <= ends.high else ", which excludes the scene's own value"
    return f"{head}; {interval} in 90 % of the cases over the unknown inputs{outside}; {_causes(output)}"


def _causes(output: OutputRange) -> str:
    if output.floor is None:
        return "the decisive input is unknown"
    least = max(output.floor.high, LEAST_SHARE_NAMED)
    ranked = sorted(((share, key) for key, share in output.shares.items() if share.value > least), reverse=True)
    return (
        all_of(f"{key} causes {100.0 * share.value:.0f} %" for share, key in ranked[:CAUSES_NAMED])
        or "no input dominates"
    )


def uncertainty_blocks(uncertainty: Uncertainty) -> list[Block]:
    """A sentence for each output, shares of its variance by input and by cause, screened inputs, and notes."""
    outputs = list(uncertainty.responses.values())
    rows = [(key, *(_share(output.shares.get(key)) for output in outputs)) for key in uncertainty.keys]
    floor = ("an input that does nothing", *(_share(output.floor) for output in outputs))
    header = ("input", *(quantity(output.name)[0] for output in outputs))
    caption = f"{_caption(outputs)} [%], {100.0 * SHARE_LEVEL:.0f} % intervals"
    screened = ""
    if uncertainty.screened:
        most = max(uncertainty.screened, key=lambda key: uncertainty.screened[key])
        screened = (
            f"{counted(len(uncertainty.screened), 'further input')} varied in every set, but no emulator includes them: "
            f"none alone causes more than {100.0 * uncertainty.screened[most]:.2g} % of an output's variance ({most})."
        )
    answer: list[Block] = [
        Bullets([range_sentence(output) for output in outputs]),
        Table(caption, header, [*rows, floor]),
        range_sheet(outputs).block,
        Paragraph(screened),
    ]
    return with_notes(uncertainty.notes, answer, judged=False)


def _caption(outputs: Iterable[OutputRange]) -> str:
    """The caption of the shares."""
    if any(output.shapley for output in outputs):
        return "Share of the variance over all inputs, divided among dependent inputs (Shapley)"
    return "Share of the variance over all inputs that remains while an input is unknown"


def _share(share: Share | None) -> str:
    return "" if share is None else share.of_hundred


def write_uncertainty(uncertainty: Uncertainty, folder: Path) -> None:
    """uncertainty.json, input_sets.csv, ranges.csv, shares.csv and uncertainty.png."""
    write_json(folder / "uncertainty.json", uncertainty.as_dict())
    rows, outputs = set_rows(uncertainty), uncertainty.responses.values()
    write_sample(rows, folder / "input_sets.csv")
    range_sheet(outputs).save(folder)
    share_sheet(outputs).save(folder)
    draw_uncertainty(uncertainty, folder / "uncertainty.png")


def draw_uncertainty(uncertainty: Uncertainty, path: Path) -> None:
    """A column an output: above the runs of the input sets with the scene's own value, below what each input makes of them."""
    from rbdyn.plots.style import BLUE, GREY, ORANGE, save, subplots

    count, keys = len(uncertainty.responses), [key.partition(".")[2] for key in uncertainty.keys]
    figure, axes = subplots(2, count, figsize=(3.4 * count + 2.0, 3.0 + 0.28 * len(keys)), squeeze=False,
                                height_ratios=(1.0, 0.14 * len(keys) + 0.3))  # fmt: skip
    for column, (name, output) in enumerate(uncertainty.responses.items()):
        above, below = axes[:, column]
        words, unit = quantity(name)
        above.hist(uncertainty.sets.outputs.values[:, column], bins=24, color=BLUE, alpha=0.45)
        above.axvspan(output.input.low, output.input.high, color=BLUE, alpha=0.12, label="5 to 95 % of the cases")
        above.axvline(output.nominal.value, color=ORANGE, label="scene values")
        above.set(xlabel=f"{words} [{unit}]" if unit else words, ylabel="input sets" if column == 0 else "")
        if output.floor is None:
            below.text(0.5, 0.5, "unknown", transform=below.transAxes, ha="center", color=GREY)
        else:
            places, shares = [uncertainty.keys.index(key) for key in output.shares], list(output.shares.values())
            below.barh(places, [100.0 * share.value for share in shares], color=BLUE, alpha=0.6)
            below.hlines(
                places, [100.0 * share.low for share in shares], [100.0 * share.high for share in shares], color=GREY
            )
            below.axvline(100.0 * output.floor.high, color=GREY, linestyle=":")
        below.set(yticks=range(len(keys)), yticklabels=keys if column == 0 else [], xlim=(0.0, 100.0),
                  ylim=(len(keys) - 0.5, -0.5), xlabel="share of the variance [%]")  # fmt: skip
    axes[0, 0].legend(fontsize=8)
    save(figure, path)


DECIDER_COLUMNS: tuple[Column[Decider], ...] = (
    Column("input", at="key", meaning="key of the input"),
    Column(
        "worth",
        words="points of chance gained by measuring it",
        cell=lambda decider: Share(decider.worth, *decider.worth_interval).of_hundred,
        meaning="gain in the chance of the right choice by measuring it, with its interval",
    ),
    Column("worth_low", at=("worth_interval", 0), screen=False),
    Column("worth_high", at=("worth_interval", 1), screen=False),
    Column("flip", 3, "flips at", meaning="value at which the choice changes, with its interval"),
    Column("flip_low", at=("flip_interval", 0), screen=False),
    Column("flip_high", at=("flip_interval", 1), screen=False),
    Column(
        "",
        words="95 % interval",
        cell=lambda decider: " to ".join(shown(end, 3) for end in decider.flip_interval or ()),
        text=True,
    ),
    Column(
        "pick_above",
        words="selected is better",
        cell=lambda decider: "above" if decider.pick_above else "below",
        text=True,
        meaning="whether the selected design is better above the flip",
    ),
)
DECIDERS = Sheet(
    "Inputs that decide", DECIDER_COLUMNS, note="Points: by how much of 100 the chance of the right choice rises.",
    file="decides.csv", content="The inputs that decide between the selected design and the baseline.",
)  # fmt: skip


def robustness(summary: Summary) -> Section | None:
    """Odds that the pick is better, the inputs that decide it, and every unknown input with its range and source."""
    robust = summary.robust
    if robust is None:
        return None
    inputs, sets, runs = len(robust.inputs), counted(robust.pairs, "input set"), counted(robust.runs, "run")
    blocks: list[Block] = [
        Bullets(robust.sentences),
        _odds(robust),
        _limits(summary),
        decider_sheet(robust).block,
        Paragraph(robust.undecided or ""),
        Paragraph(f"{counted(inputs, 'input')} varied together in {sets}, {runs}.", "small"),
        robust_input_sheet(robust).block,
    ]
    return Section("unknown", "Unknown inputs", blocks)


def _odds(robust: Robust) -> Table:
    """Probability of each gain, and the share of its variance over the inputs that the emulators explain."""
    rows = [
        (quantity(name)[0], share.of_hundred, _percent(robust.explained[name]))
        for name, share in robust.chances.gains.items()
    ]
    header = ("response", "selected better [%]", "explained by the inputs")
    every = ("all of these", robust.chances.all.of_hundred, "")
    return Table("Probability that the selected design is better than the baseline", header, [*rows, every])


def _limits(summary: Summary) -> Table:
    """Odds that each limit is kept over the unknown inputs."""
    rows = [
        (quantity(name)[0], f"{SENSES[limit.limit.sense]} {shown(limit.limit.bound)}", limit.odds.of_hundred)
        for name, limit in summary.limits.items()
        if limit.odds
    ]
    return Table("Limits over the unknown inputs", ("response", "limit", "met [%]"), rows, text_columns=(1,))


def decider_sheet(robust: Robust) -> Sheet[Decider]:
    """By input: what measuring it is worth, and the value at which the choice flips."""
    return replace(DECIDERS, rows=robust.decides)


def robust_input_sheet(robust: Robust) -> Sheet[UnknownInput]:
    """Each input with its range and the source of that; a screened one with its largest share of a variance."""
    screened = Column[UnknownInput](
        "", words="screened, share of a variance", cell=lambda entry: _percent(robust.screened.get(entry.key))
    )
    return input_sheet(robust.inputs, screened)


def _percent(share: float | None) -> str:
    return "" if share is None else f"{shown(100.0 * share, 2)} %"
