"""The record of a whole study, shaped like summary.json, and its gains, shares and probabilities written for people.

Every page, screen and table of a study reads it. Names and plain numbers are written by ``rbdyn.base.words``.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from doe.dimension_chain import ChainResult
from doe.pareto.manufacture import Interval, percent
from doe.response_surface.statistics import Fits
from doe.running.store import Cause
from doe.workflow.confirmation import ConfirmedPoint, Gain, PickLimit, point_words
from doe.workflow.duty import DutyAnswer
from doe.workflow.front_record import EstimatedPoint, SearchResult, SurfaceFront
from doe.workflow.judgement import Robust
from doe.workflow.obstacles import Obstacles
from doe.workflow.parts import Made
from doe.workflow.pick import Edge
from doe.workflow.problem import Asked, Settings
from doe.workflow.runs import StudyDesign
from doe.workflow.surfaces import PredictedGain, PublishedComparison
from doe.workflow.tolerances import FactorTolerance, KeptGain
from rbdyn.base.blocks import Block, Bullets, Detail, Figures, Heading, Paragraph, Remarks, Table, Verdict, has_content
from rbdyn.base.identity import Identity
from rbdyn.base.notes import Note
from rbdyn.base.records import Record
from rbdyn.base.words import improvement, label, quantity

# Limits by their sense in a record.
SENSES = {"<=": "≤", ">=": "≥"}
VERDICTS = {"better": "▲ better", "worse": "▼ worse", "within error": "● within error"}
SIGNS_NOTE = "▲ better, ▼ worse, ● within its 95 % error."
LIMITS = {"kept": "✓ met", "broken": "✗ violated", "undecided": "? undecided"}


class Summary(Record, kw_only=True):
    """A finished study: settings, design, surfaces, front, the pick with its confirmation, and what was asked for besides.

    ``duty``, ``adaptive``, ``robust`` and ``tolerances`` are None where the study has none.
    """

    format: str
    identity: Identity
    status: str
    limits: dict[str, PickLimit]
    obstacles: Obstacles
    tried: int
    edge: Edge
    asked: Settings
    design: StudyDesign
    fit: Fits
    front: SurfaceFront
    pick_on_surfaces: EstimatedPoint
    pick: dict[str, Any]
    operating_clearances_mm: dict[str, dict[str, float]]
    clearance_class: str
    confirmation: dict[str, ConfirmedPoint]
    gains: dict[str, Gain]
    statement: str
    whirl_sentence: str
    rivals_sentences: list[str]
    chains: dict[str, ChainResult]
    made: dict[str, Made]
    missed_chains: dict[str, str]
    published_comparisons: dict[str, PublishedComparison]
    notes: list[Note]
    failures: list[Cause]
    cost: dict[str, float]
    versions: dict[str, str]
    inputs: str
    seeds: dict[str, int]
    duty: DutyAnswer | None = None
    adaptive: SearchResult | None = None
    robust: Robust | None = None
    tolerances: dict[str, FactorTolerance] | None = None
    tolerances_gains: dict[str, KeptGain] | None = None
    tolerances_sentence: str | None = None
    tolerances_warning: str | None = None


def by_point(
    caption: str,
    asked: Asked,
    points: Mapping[str, Any],
    cell: Callable[[Any, str], str],
    detail: Detail = Detail.LEAST,
    further: int = 0,
) -> Table:
    """A row a point, which has ``factors``, and a ``cell`` for each response; ``further`` decimals of factors beyond the drawing's."""
    rows = [
        [
            point_words(name),
            *(factor.text(point.factors[factor.name], further) for factor in asked.factors),
            *(cell(point, response) for response in asked.names),
        ]
        for name, point in points.items()
    ]
    return Table(caption, ["point", *map(label, asked.columns), *map(label, asked.names)], rows, detail=detail)


def nearest(asked: Asked, place: Mapping[str, float], candidates: Mapping[str, Mapping[str, float]]) -> str:
    """Name of the candidate whose factors are nearest to those of a place in coded units.

    A pick is simulated at the resolution of the drawing, so its factors are not those of the front to the digit.
    """

    def distance(name: str) -> float:
        steps = [abs(candidates[name][factor.name] - place[factor.name]) / factor.step for factor in asked.factors]
        return math.hypot(*steps)

    return min(candidates, key=distance)


def readable(blocks: Iterable[Block], asked: Asked | None = None) -> list[Block]:
    """Blocks with something to say: what was ``asked`` by its words in sentences, tables without empty columns.

    A response that is a ratio to the baseline over a duty has no unit in tables and pictures.
    """
    names = [] if asked is None else [*asked.columns, *asked.names]
    # The longest first, for a name may begin with another.
    words = {name: quantity(name)[0] for name in sorted(names, key=len, reverse=True)}
    ratios = {
        label(response.name): response.label for response in (asked.responses if asked else ()) if response.is_ratio
    }
    return [_without_unit(_spelt(block, words), ratios) for block in blocks if has_content(block)]


def _without_unit(block: Block, ratios: Mapping[str, str]) -> Block:
    """The block with these labels replaced in its captions, cells and pictures, but not as figures at a point."""

    def plain(text: str) -> str:
        for with_unit, words in ratios.items():
            text = re.sub(rf"(?<!: ){re.escape(with_unit)}", words, text)
        return text

    def drawn(picture: str | Callable[[], str]) -> str | Callable[[], str]:
        return plain(picture) if isinstance(picture, str) else lambda: plain(picture())

    match block:
        case _ if not ratios:
            return block
        case Heading(text):
            return replace(block, text=plain(text))
        case Table():
            rows = [[plain(cell) for cell in row] for row in block.rows]
            return replace(block, caption=plain(block.caption), header=[*map(plain, block.header)], rows=rows)
        case Figures():
            return replace(block, pictures=[*map(drawn, block.pictures)], caption=plain(block.caption))
    return block


def _spelt(block: Block, words: Mapping[str, str]) -> Block:
    def spelt(text: str) -> str:
        for name, spoken in words.items():
            text = text.replace(name, spoken)
        return text

    match block:
        case Verdict(notes=notes) | Remarks(notes=notes):
            return replace(block, notes=tuple(Note(note.code, spelt(note)) for note in notes))
        case Paragraph(text):
            return replace(block, text=spelt(text))
        case Bullets(items):
            return replace(block, items=[spelt(item) for item in items])
        case Table():
            return block.without_empty_columns()
    return block


def share_with_interval(share: float, interval: Sequence[float] | None) -> str:
    """'95.0 % (71.3 to 99.8 %)' of a share with the ends of its interval."""
    ends = "" if interval is None else f" ({Interval(*interval).words})"
    return f"{percent(share)} %{ends}"


def sign_of(gain: Gain | PredictedGain) -> str:
    """The verdict of a gain with a sign that needs no colour."""
    return VERDICTS[gain.verdict]


def signed(gain: Gain | PredictedGain) -> str:
    """A gain with the sign of its verdict."""
    return f"{sign_of(gain)[:1]} {change(gain)}"


def change(gain: Gain | PredictedGain) -> str:
    """'11.16 ± 0.65 % less' of a gain."""
    return improvement(gain.percent, gain.error_percent, gain.goal)
