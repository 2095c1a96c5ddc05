"""The page, put together from its parts: sections, widgets with their scripts, data."""

import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from typing import Any

from doe.report.html.data import page_data
from doe.report.sections import sections
from doe.report.sections.contents import title
from doe.report.sections.record import Record, known
from rbdyn.base.blocks import Widget
from rbdyn.base.render import html
from rbdyn.base.words import filled_page

# In the order in which they need each other; the moving bearing is drawn by the script of ``rbdyn show``.
SCRIPTS = {
    "page": ("page.js", "tables.js"),
    "surface": ("model.js", "emulator.js", "viridis.js", "contours.js", "surface.js", "surface_view.js"),
    "front": ("front.js",),
    "bearing": ("motion.js",),
}


def html_report(summary: Record, motion: Mapping[str, Any] | None = None) -> str:
    """A study as one HTML page.

    summary : record of ``doe study --json``; parts that are missing or null are left out.
    motion : record of ``doe.clearance.motion_record``; without it nothing moves.
    """
    clean = known(dict(summary))
    moving = known(dict(motion or {}))
    found = sections(clean, moving)
    widgets = {block.name for section in found for block in section.blocks if isinstance(block, Widget)}
    marks = {
        "TITLE": escape(title(clean)),
        "STYLE": text("report.css"),
        "CONTENTS": "".join(f'<li><a href="#{each.key}">{escape(each.title)}</a></li>' for each in found),
        "SECTIONS": "\n".join(html.section(each, _widget) for each in found),
        "DATA": _json(page_data(clean, moving)),
        "SCRIPTS": "\n".join(f"<script>\n{script}</script>" for script in _scripts(widgets)),
    }
    return filled_page(text("page.html"), marks)


def text(name: str) -> str:
    """A file of this package."""
    return files("doe.report.html").joinpath(name).read_text(encoding="utf-8")


def _widget(name: str) -> str:
    """Controls of an interactive picture."""
    return text(f"{name}.html")


def _scripts(widgets: set[str]) -> list[str]:
    found = []
    for part, names in SCRIPTS.items():
        if part in widgets | {"page"}:
            if part == "bearing":
                found.append(files("rbdyn").joinpath("plots", "bearing.js").read_text(encoding="utf-8"))
            found += [text(name) for name in names]
    return found


def _json(record: Mapping[str, Any]) -> str:
    """Data inside a script element: no name in it can end the element."""
    return json.dumps(record, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
