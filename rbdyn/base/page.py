"""A report as one HTML page that can be mailed: it fetches nothing and can be read without scripts and on paper.

``page`` fills the skeleton ``page.html`` with the style sheet ``report.css``. ``result_page`` is the page of a command that has a
result and pictures: the blocks of the terminal first, the table of the identity last.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from html import escape
from importlib.resources import files
from pathlib import Path

from rbdyn.base import html
from rbdyn.base.blocks import Block, Figures, Section, Table, Verdict, has_content
from rbdyn.base.folder import OutputFolder
from rbdyn.base.html import vector_copies
from rbdyn.base.identity import Identity, identity_line, identity_table
from rbdyn.base.words import filled_page
from rbdyn.base.workbook import NAME, write_workbook

REPORT = "report.html"
# Files that ``with_report`` adds to those of a command.
REPORT_FILES = (REPORT, NAME)
# Rows from which a table is folded.
LONG = 40


def write_with_report(
    folder: OutputFolder,
    identity: Identity | None,
    blocks: Callable[[], Sequence[Block]],
    write: Callable[[Path], Sequence[str]],
) -> list[str]:
    """Write ``with_report`` into the folder of a command, without an identity the files alone; names of the files, none without
    a folder. Raises OSError.
    """
    if folder.path is None:
        return []
    return folder.write(lambda stage: with_report(stage, identity, blocks, write) if identity else [*write(stage)])


def with_report(
    folder: Path,
    identity: Identity,
    blocks: Callable[[], Sequence[Block]],
    write: Callable[[Path], Sequence[str]],
    prefix: str = "",
) -> list[str]:
    """Let ``write`` write the files of a command into ``folder``, then report.html with its pictures and tables.xlsx.

    blocks : makes the blocks of the terminal
    write : writes the files and returns their names, which are returned with the two further ones
    prefix : before these two names, where the folder has others that must stay. Raises OSError.
    """
    with vector_copies() as pictures:
        names = list(write(folder))
    report, workbook = f"{prefix}{REPORT}", f"{prefix}{NAME}"
    (folder / report).write_text(result_page(identity, blocks(), pictures), encoding="utf-8")
    write_workbook(folder / workbook, [folder / name for name in names if name.endswith(".csv")], identity)
    return [*names, report, workbook]


def page(
    title: str,
    heading: str,
    sections: Iterable[Section],
    widget: Callable[[str], str] = lambda name: "",
    notice: str = "",
    scripts: str = "",
) -> str:
    """A whole page.

    title, heading : name of the window, and the first heading
    widget : writes the place of a named interactive picture
    notice, scripts : HTML before the sections, and after them
    """
    chapters = list(sections)
    marks = {
        "TITLE": escape(title),
        "HEADING": escape(heading),
        "STYLE": _text("report.css"),
        "CONTENTS": "".join(f'<li><a href="#{part.key}">{escape(part.title)}</a></li>' for part in chapters),
        "NOTICE": notice,
        "SECTIONS": "\n".join(html.section(part, widget) for part in chapters),
        "SCRIPTS": scripts,
    }
    return filled_page(_text("page.html"), marks)


def result_page(identity: Identity, blocks: Sequence[Block], pictures: Mapping[str, str]) -> str:
    """Page of a result: its verdict, its blocks at every detail with long tables folded, its pictures (SVG by name), its identity."""
    opening = "".join(html.render(block) for block in blocks if isinstance(block, Verdict) and has_content(block))
    blocks = [_folded(block) for block in blocks if not isinstance(block, Verdict)]
    drawn = [Figures([picture], name) for name, picture in pictures.items()]
    parts = [
        Section("result", "Result", [identity_line(identity), *blocks]),
        Section("pictures", "Pictures", drawn),
        identity_section(identity),
    ]
    return page(identity.title, identity.title, [part for part in parts if part.blocks], notice=opening)


def _folded(block: Block) -> Block:
    """A long table folded below its caption; any other block as it is."""
    if isinstance(block, Table) and block.caption and len(block.rows) > LONG:
        return replace(block, folded=True)
    return block


def identity_section(identity: Identity) -> Section:
    """Section of a page: bearing, operating point, date, version, hashes of the input files."""
    return Section("identity", "Bearing, operating point, inputs", [replace(identity_table(identity), caption="")])


def _text(name: str) -> str:
    """A file of the page."""
    return files("rbdyn.base").joinpath(name).read_text(encoding="utf-8")
