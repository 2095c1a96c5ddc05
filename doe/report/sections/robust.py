"""The chapter on unknown inputs of ``doe study --robust``: inputs with ranges and sources, odds, what decides; and its tables."""

from collections.abc import Mapping
from typing import Any

from doe.report.sections.record import SENSES
from doe.report.sections.unknown import input_sheet
from doe.report.summary import Summary
from doe.unknown.propagation import Share
from doe.workflow.judgement import Decider, Robust
from rbdyn.base.blocks import Block, Bullets, Paragraph, Section, Table
from rbdyn.base.table import Column, Sheet
from rbdyn.base.words import counted, quantity, shown
from rbdyn.scene.unknown import UnknownInput

DECIDERS: tuple[Column[Decider], ...] = (
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
        words="pick is better",
        cell=lambda decider: "above" if decider.pick_above else "below",
        text=True,
        meaning="whether the pick is better above the flip",
    ),
)


def unknown(summary: Summary, motion: Mapping[str, Any]) -> Section | None:
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
    header = ("response", "pick better in 100 cases", "explained by the inputs")
    every = ("all of these", robust.chances.all.of_hundred, "")
    return Table("Odds that the pick is better than the original", header, [*rows, every])


def _limits(summary: Summary) -> Table:
    """Odds that each limit is kept over the unknown inputs."""
    rows = [
        (quantity(name)[0], f"{SENSES[limit.limit.sense]} {shown(limit.limit.bound)}", limit.odds.of_hundred)
        for name, limit in summary.limits.items()
        if limit.odds
    ]
    return Table("Limits over the unknown inputs", ("response", "limit", "kept in 100 cases"), rows, text_columns=(1,))


def decider_sheet(robust: Robust) -> Sheet[Decider]:
    """By input: what measuring it is worth, and the value at which the choice flips."""
    note = "Points: by how much of 100 the chance of the right choice rises."
    content = "The inputs that decide between the pick and the original, by worth."
    return Sheet("Inputs that decide", DECIDERS, robust.decides, note, file="decides.csv", content=content)


def robust_input_sheet(robust: Robust) -> Sheet[UnknownInput]:
    """Each input with its range and the source of that; a screened one with its largest share of a variance."""
    screened = Column[UnknownInput](
        "", words="screened, share of a variance", cell=lambda entry: _percent(robust.screened.get(entry.key))
    )
    return input_sheet(robust.inputs, screened)


def _percent(share: float | None) -> str:
    return "" if share is None else f"{shown(100.0 * share, 2)} %"
