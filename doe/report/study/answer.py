"""A study on the terminal: the blocks of its report that a person acts on, the answer last, where the eye is."""

from dataclasses import replace
from typing import Any

from doe.report.sections.answer import advice, changes, verdict
from doe.report.sections.contents import notes, readable, reference
from doe.report.sections.experiments import failure_table
from doe.report.sections.fits import diagnostics
from doe.report.sections.record import known, part
from rbdyn.base.blocks import Block, Detail, Heading
from rbdyn.base.render import terminal


def answer_text(record: dict[str, Any]) -> str:
    """answer.txt, of the record of ``doe study --json``."""
    clean = known(record)
    failures = failure_table(part(clean, "failures") or [])
    return terminal.text(readable([*verdict(clean), *advice(clean), failures], clean))


def blocks(record: dict[str, Any]) -> list[Block]:
    """What the terminal shows of the record of ``doe study --json``: the verdict first, the fits only to who asks for all."""
    clean = known(record)
    fits = [replace(block, detail=Detail.ALL) for block in diagnostics(clean, {}).blocks]
    published = reference(clean, {})
    context = readable([*published.blocks, changes(clean)], clean)
    titles = (published.title if part(clean, "beside_reference") else "", "The answer" if context else "")
    before, after = (Heading(title, detail=Detail.USUAL) for title in titles)
    answer = [*advice(clean), *notes(clean, {}).blocks]
    return readable([*verdict(clean), *fits, before, *context, after, *answer], clean)
