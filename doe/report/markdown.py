"""A study as Markdown: the same answer and tables as the page, with links to the pictures."""

from collections.abc import Sequence

from doe.report.sections import sections
from doe.report.sections.contents import title
from doe.report.sections.record import Record, known
from rbdyn.base.render import markdown


def markdown_report(summary: Record, pictures: Sequence[str] = ()) -> str:
    """Markdown of the record of ``doe study --json``; ``pictures`` are files next to it."""
    clean = known(dict(summary))
    return markdown.page(title(clean), sections(clean), pictures)
