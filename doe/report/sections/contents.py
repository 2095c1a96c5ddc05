"""All sections of a report in the order in which they are read; what the summary does not hold is left out. The last ones
stand here: a published table beside, settings, versions, cost, notes, failures."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import Any

from doe.report.sections import answer, bearing, experiments, fits, fronts, parts
from doe.report.sections.answer import record_table
from doe.report.sections.blocks import Block, Bullets, Section, Table, Words
from doe.report.sections.experiments import failure_table
from doe.report.sections.record import Record, factors, part, responses
from rbdyn.records.words import label, quantity, shown


def reference(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Levels, effects and ranks beside a published table, with the reasons for what differs."""
    levels, effects, words = [], [], []
    for name, each in (part(summary, "beside_reference") or {}).items():
        for whose in ("ours", "theirs"):
            known = each.get(f"{whose}_min_mean_max") or ("",) * 3
            levels.append((f"{label(name)}, {whose}", *map(shown, known)))
        for factor, effect in (each.get("linear_effects") or {}).items():
            sign = "same" if effect.get("same_sign") else "opposite"
            sizes = (shown(effect.get(whose), 3) for whose in ("ours", "theirs"))
            effects.append((label(name), label(factor), *sizes, sign))
        words.append(" ".join(filter(None, (each.get("verdict"), each.get("why")))))
    blocks: list[Block] = [Bullets([text for text in words if text])]
    blocks.append(Table("Levels", ("response", "least", "mean", "largest"), levels))
    header = ("response", "factor", "ours", "theirs", "sign")
    blocks.append(Table("Linear effects a coded unit", header, effects, text_columns=(1, 4)))
    return Section("reference", "Beside the published table", blocks)


def settings(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Seeds, versions and cost: what it takes to get the same numbers again."""
    captions = (("seeds", "Seeds"), ("versions", "Versions"), ("cost", "Cost, times in seconds"))
    tables = [record_table(caption, part(summary, key)) for key, caption in captions]
    return Section("settings", "Settings, versions, cost", tables)


def notes(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Limits of the model that the runs met, and what failed."""
    said = Bullets([str(note) for note in part(summary, "notes") or []])
    return Section("notes", "Notes and failures", [said, failure_table(part(summary, "failures") or [])])


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
    reference,
    settings,
    notes,
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
    asked = summary.get("asked") or {}
    stem = PurePath(asked.get("study_file") or "clearance study").stem.replace("_", " ")
    return asked.get("title") or stem[:1].upper() + stem[1:]
