"""All sections of a report in the order in which they are read; what the summary does not hold is left out."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import Any

from doe.report.sections import answer, bearing, ends, experiments, fits, fronts, parts
from doe.report.sections.blocks import Block, Bullets, Section, Table, Words
from doe.report.sections.record import Record, factors, responses
from rbdyn.records.words import quantity

CHAPTERS = (
    answer.answer,
    answer.settings,
    experiments.design,
    fits.surfaces,
    fits.diagnostics,
    fronts.front,
    answer.confirmation,
    parts.chains,
    bearing.power,
    bearing.motion,
    ends.reference,
    ends.settings,
    ends.notes,
)


def sections(summary: Record, motion: Mapping[str, Any] | None = None) -> list[Section]:
    """Sections with something to say."""
    found = [chapter(summary, motion or {}) for chapter in CHAPTERS]
    names = [*(each.name for each in factors(summary)), *(each["name"] for each in responses(summary))]
    words = {name: quantity(name)[0] for name in names}
    whole = [(each, [_readable(block, words) for block in each.blocks if _says(block)]) for each in found if each]
    return [replace(section, blocks=blocks) for section, blocks in whole if blocks]


def _says(block: Block) -> bool:
    """Whether there is anything in a block: a table has rows, a list items, a paragraph words."""
    match block:
        case Table(rows=content) | Bullets(items=content) | Words(text=content):
            return bool(content)
    return True


def _readable(block: Block, words: Mapping[str, str]) -> Block:
    """Sentences with quantities by their words; tables without empty columns."""

    def spelt(text: str) -> str:
        for name, spoken in words.items():
            text = text.replace(name, spoken)
        return text

    match block:
        case Words(text):
            return replace(block, text=spelt(text))
        case Bullets(items):
            return Bullets([spelt(item) for item in items])
        case Table():
            return block.without_empty_columns()
    return block


def title(summary: Record) -> str:
    """What the study was called, or the name of its file in words."""
    settings = summary.get("asked") or {}
    stem = PurePath(settings.get("study_file") or "clearance study").stem.replace("_", " ")
    return settings.get("title") or stem[:1].upper() + stem[1:]
