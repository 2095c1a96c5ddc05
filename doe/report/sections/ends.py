"""What stands at the end: a published table beside, settings, versions, cost, notes, failures."""

from collections.abc import Mapping
from typing import Any

from doe.report.sections.answer import record_table
from doe.report.sections.blocks import Block, Bullets, Section, Table
from doe.report.sections.experiments import failure_table
from doe.report.sections.record import Record, part
from rbdyn.records.words import label, shown


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
