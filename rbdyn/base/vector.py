"""Vector copies of the pictures that a command draws, for its page.

Whoever draws into a file asks ``is_copying`` and hands over the same picture as SVG by ``add_copy``.
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from html import escape
from pathlib import Path

_copies: ContextVar[dict[str, str] | None] = ContextVar("copies", default=None)
# What a page does not need of an SVG file: declarations, its style sheet (which would hold for the page), sizes, metadata.
FILE_ONLY = re.compile(r"^.*?(?=<svg)|<metadata>.*?</metadata>|<style.*?</style>|<!--.*?-->", re.DOTALL)
OPENING, VIEW = re.compile(r"<svg[^>]*>"), re.compile(r'viewBox="\S+ \S+ (\S+) [^"]*"')
NAME, REFERENCE = re.compile(r' id="([^"]*)"'), re.compile(r'(?:url\(#|href="#)([^)"]+)')


@contextmanager
def vector_copies() -> Iterator[dict[str, str]]:
    """SVG of the pictures that are drawn inside, by their names in words."""
    copies: dict[str, str] = {}
    token = _copies.set(copies)
    try:
        yield copies
    finally:
        _copies.reset(token)


def is_copying() -> bool:
    """Whether a page is made of the pictures that are drawn now."""
    return _copies.get() is not None


def add_copy(path: Path, svg: str) -> None:
    """Hand over the picture of a file as the text of an SVG file."""
    copies = _copies.get()
    if copies is not None:
        words = path.stem.replace("_", " ")
        copies[words] = inline(svg, words)


def inline(svg: str, words: str) -> str:
    """An SVG file as an element of a page; ``words`` are for readers who cannot see it. Names that nothing refers to are dropped."""
    bare = FILE_ONLY.sub("", svg)
    used = set(REFERENCE.findall(bare))
    bare = NAME.sub(lambda name: name[0] if name[1] in used else "", bare)
    view = VIEW.search(bare)
    box, width = (view[0], view[1]) if view else ("", "480")
    look = f'class="picture" style="max-width: {width}pt; stroke-linejoin: round; stroke-linecap: butt"'
    opening = f'<svg {box} {look} role="img" aria-label="{escape(words)}">'
    return OPENING.sub(lambda _: opening, bare, count=1).replace("xlink:href", "href")
