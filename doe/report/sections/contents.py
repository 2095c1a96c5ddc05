"""All sections of a report in the order in which they are read; what the summary does not hold is left out. The last ones
stand here: a published table, settings, versions, cost, notes, failures."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import PurePath
from typing import Any

from doe.report.sections import answer, bearing, experiments, fits, fronts, parts
from doe.report.sections.experiments import failure_table
from doe.report.sections.record import Record, factors, part, record_table, responses
from rbdyn.base.blocks import Block, Bullets, Detail, Note, Paragraph, Section, Table, says
from rbdyn.base.words import label, quantity, shown


def reference(summary: Record, motion: Mapping[str, Any]) -> Section:
    """Levels, effects and ranks next to a published table, with the reasons for what differs."""
    levels, effects, words = [], [], []
    for name, each in (part(summary, "beside_reference") or {}).items():
        for whose in ("ours", "theirs"):
            known = each.get(f"{whose}_min_mean_max") or ("",) * 3
            ranks = shown(each.get("rank_correlation"), 2) if whose == "ours" else ""
            levels.append((f"{label(name)}, {whose}", *map(shown, known), ranks))
        for factor, effect in (each.get("linear_effects") or {}).items():
            sign = "same" if effect.get("same_sign") else "opposite"
            sizes = (_effect(effect, whose) for whose in ("ours", "theirs"))
            effects.append((label(name), label(factor), *sizes, sign))
        words.append(" ".join(filter(None, (each.get("verdict"), each.get("why")))))
    levels_header = ("response", "least", "mean", "largest", "rank correlation")
    header = ("response", "factor", "ours", "theirs", "sign")
    caption = "Linear effects a coded unit (* significant at 5 %)"
    blocks: list[Block] = [
        Bullets([text for text in words if text], detail=Detail.USUAL),
        Table("Levels", levels_header, levels, detail=Detail.USUAL),
        Table(caption, header, effects, text_columns=(1, 4), detail=Detail.USUAL),
    ]
    return Section("reference", "Compared with the published table", blocks)


def _effect(effect: Record, whose: str) -> str:
    """An effect, starred where it is significant."""
    size = effect.get(whose)
    return "" if size is None else f"{size:+.3g}{'*' if effect.get(f'{whose}_significant') else ''}"


def settings(summary: Record, motion: Mapping[str, Any]) -> Section | None:
    """Seeds, versions and cost: what it takes to get the same numbers again."""
    captions = (("seeds", "Seeds"), ("versions", "Versions"), ("cost", "Cost, times in seconds"))
    tables = [record_table(caption, part(summary, key)) for key, caption in captions]
    return Section("settings", "Settings, versions, cost", tables)


def notes(summary: Record, motion: Mapping[str, Any]) -> Section:
    """What failed, and limits of the model that the runs met."""
    failures = failure_table(part(summary, "failures") or [])
    return Section(
        "notes", "Notes and failures", [failures, *(Note(str(note)) for note in part(summary, "notes") or [])]
    )


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
    """Sections with something to say, of a record without what is undefined (``known``)."""
    found = [chapter(summary, motion or {}) for chapter in CHAPTERS]
    whole = [replace(each, blocks=readable(each.blocks, summary)) for each in found if each]
    return [section for section in whole if section.blocks]


def readable(blocks: Iterable[Block], summary: Record) -> list[Block]:
    """Blocks with something to say: quantities by their words in sentences, tables without empty columns."""
    names = [*(each.name for each in factors(summary)), *(each["name"] for each in responses(summary))]
    # The longest first, for a name may begin with another.
    words = {name: quantity(name)[0] for name in sorted(names, key=len, reverse=True)}
    return [_spelt(block, words) for block in blocks if says(block)]


def _spelt(block: Block, words: Mapping[str, str]) -> Block:
    def spelt(text: str) -> str:
        for name, spoken in words.items():
            text = text.replace(name, spoken)
        return text

    match block:
        case Paragraph(text) | Note(text):
            return replace(block, text=spelt(text))
        case Bullets(items):
            return replace(block, items=[spelt(item) for item in items])
        case Table():
            return block.without_empty_columns()
    return block


def title(summary: Record) -> str:
    """What the study was called, or the name of its file in words."""
    asked = summary.get("asked") or {}
    stem = PurePath(asked.get("study_file") or "clearance study").stem.replace("_", " ")
    return asked.get("title") or stem[:1].upper() + stem[1:]
