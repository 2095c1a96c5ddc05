"""Still pictures: marks on one pair of axes that matplotlib draws, as SVG in the page or as PNG in a file.

A picture is described first and drawn when a page or a file asks for it, so that a report without pictures loads no
matplotlib. Every colour is a role of the style sheet ``report.css``: SVG names the role, so that it is light, dark or on
paper as its page is; PNG takes the light colour.
"""

import io
import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

Point = tuple[float, float]

# Light colours of the style sheet by role.
COLOURS = {
    "ink": "#1c2329", "quiet": "#55606a", "paper": "#ffffff", "line": "#c3cad1", "grid": "#e3e7ea", "edge": "#6a737b",
    "steel": "#cdd6df", "blue": "#0072b2", "vermilion": "#c44e00", "green": "#00795a", "orange": "#9c6f16", "purple": "#a04a80",
}  # fmt: skip
ROLES = {colour: f"var(--{role})" for role, colour in COLOURS.items()}
# Look of a line that guides the eye and is no data.
GUIDE: dict[str, Any] = {"color": COLOURS["quiet"], "linewidth": 1.1, "linestyle": "--"}
FONT = 11.0  # size of letters [pt], that of ``svg.plot`` in the style sheet
SMALL = 10.0
WIDEST = 400.0  # width [pt] above which a picture goes across the page, and scrolls where that is narrow
NOT_DRAWN = ("metadata", "style", "clipPath")
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none", "text.parse_math": False, "font.size": FONT, "axes.labelsize": 12.0, "legend.fontsize": SMALL,
    "text.color": COLOURS["ink"], "axes.labelcolor": COLOURS["ink"], "axes.edgecolor": COLOURS["line"],
    "xtick.labelcolor": COLOURS["ink"], "ytick.labelcolor": COLOURS["ink"], "grid.color": COLOURS["grid"],
    "xtick.major.size": 0.0, "ytick.major.size": 0.0, "xtick.major.pad": 4.0, "ytick.major.pad": 4.0, "axes.axisbelow": True,
    "axes.grid": True, "axes.linewidth": 1.0, "grid.linewidth": 1.0, "axes.formatter.useoffset": False, "axes.unicode_minus": True,
    "axes.xmargin": 0.06, "axes.ymargin": 0.06, "lines.markersize": 6.5, "lines.linewidth": 1.8, "legend.frameon": False,
    "axes.prop_cycle": f"cycler('color', ['{COLOURS['blue']}'])",
}  # fmt: skip


@dataclass(frozen=True)
class Still:
    """A picture of one pair of axes.

    words : what it shows, for readers who cannot see it; no two pictures of a page have the same
    draw : puts marks and labels on the axes
    width, height : of the picture [pt]; the margins to the axes are ``left`` and ``bottom``, and 12 pt at the other sides
    """

    words: str
    draw: "Callable[[Axes], None]"
    width: float = 340.0
    height: float = 270.0
    left: float = 58.0
    bottom: float = 44.0

    def svg(self) -> str:
        """The picture for a page, the same text for the same marks: no date, no random name."""
        import matplotlib

        written = io.StringIO()
        metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        with matplotlib.rc_context({**STYLE, "svg.hashsalt": self.words}):
            _figure([self], 1).savefig(written, format="svg", transparent=True, metadata=metadata)
        return _page_svg(ElementTree.fromstring(written.getvalue()), self)


def save(stills: Sequence[Still], columns: int, path: Path) -> None:
    """The pictures next to each other as one PNG, so many in a row; all as large as the first."""
    import matplotlib

    with matplotlib.rc_context(STYLE):
        _figure(stills, columns).savefig(path, dpi=130)


def name_marks(artist: "Artist", role: str, titles: Sequence[str] = ()) -> None:
    """Give marks the class ``role`` in SVG and the words that a page shows under the pointer, one for each mark in order."""
    artist.set_gid(json.dumps({"class": role, "titles": list(titles)}))


def _figure(stills: Sequence[Still], columns: int) -> Any:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    first, columns = stills[0], min(columns, len(stills))
    rows = -(-len(stills) // columns)
    wide, high = first.width * columns, first.height * rows
    figure = Figure(figsize=(wide / 72.0, high / 72.0))
    for place, still in enumerate(stills):
        row, column = divmod(place, columns)
        corner = (column * first.width + still.left) / wide, ((rows - 1 - row) * first.height + still.bottom) / high
        size = (still.width - still.left - 12.0) / wide, (still.height - still.bottom - 12.0) / high
        axis = figure.add_axes((*corner, *size))
        for one in (axis.xaxis, axis.yaxis):
            one.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        still.draw(axis)
    return figure


def _page_svg(root: ElementTree.Element, still: Still) -> str:
    """The SVG of matplotlib as an element of a page: colours by role, no names but those that it refers to itself."""
    wide = still.width > WIDEST
    size = f'viewBox="0 0 {still.width:g} {still.height:g}"'
    words = f'role="img" aria-label="{escape(still.words)}"'
    picture = f'<svg class="{"plot wide" if wide else "plot"}" {size} {words}>{_inside(root)}</svg>'
    return f'<div class="scroll">{picture}</div>' if wide else picture


def _inside(node: ElementTree.Element, in_definition: bool = False) -> str:
    return escape((node.text or "").strip()) + "".join(_element(each, in_definition) for each in node)


def _element(node: ElementTree.Element, in_definition: bool = False) -> str:
    """An element with what is in it; groups without a class leave only what is in them, invisible paths nothing."""
    tag = node.tag.rpartition("}")[2]
    if tag in NOT_DRAWN:
        return ""
    name = node.get("id", "")
    if tag == "g":
        if not name.startswith("{"):
            return _inside(node, in_definition)
        marks = json.loads(name)
        _put_titles(node, marks["titles"])
        return f'<g class="{escape(marks["class"])}">{_inside(node)}</g>'
    if tag == "path" and not in_definition and node.get("style", "") in ("fill: none", ""):
        return ""
    inside = _inside(node, in_definition or tag == "defs")
    if tag == "defs" and not inside:
        return ""
    words = "".join(f' {key}="{escape(value)}"' for key, value in _attributes(node, tag, in_definition))
    return f"<{tag}{words}>{inside}</{tag}>" if inside else f"<{tag}{words}/>"


def _put_titles(group: ElementTree.Element, titles: Sequence[str]) -> None:
    """A title in each mark of a group."""
    for mark, title in zip(_marks(group), titles, strict=False):
        ElementTree.SubElement(mark, "title").text = title


def _marks(group: ElementTree.Element) -> Iterator[ElementTree.Element]:
    for each in group:
        tag = each.tag.rpartition("}")[2]
        if tag in ("use", "path"):
            yield each
        elif tag != "defs":
            yield from _marks(each)


def _attributes(node: ElementTree.Element, tag: str, in_definition: bool) -> Iterator[tuple[str, str]]:
    """Attributes that a page needs, to a tenth of a point; of the text's style only what the style sheet does not say."""
    for key, value in node.attrib.items():
        name = key.rpartition("}")[2]
        if name == "style":
            if style := _style(value, tag):
                yield "style", style
        elif name == "d":
            lines = re.sub(r"\s*([MLHVCQz])\s*", r"\1", value).strip()
            yield name, _rounded(lines, 2 if in_definition else 1)
        elif name == "transform":
            if not value.startswith("rotate(-0"):
                yield name, _rounded(value, 1)
        elif name in ("x", "y"):
            yield name, _rounded(value, 1)
        elif name not in ("clip-path", "id") or (name == "id" and in_definition):
            yield name, value


def _style(text: str, tag: str) -> str:
    """Style in roles; a text has the family, size and colour of the style sheet unless its own differ."""
    parts = dict(each.split(": ", 1) for each in text.split("; "))
    if tag == "text":
        parts.pop("font-family", None)
        for key, usual in (("font-size", f"{FONT:g}px"), ("fill", COLOURS["ink"])):
            if parts.get(key) == usual:
                del parts[key]
    return ";".join(f"{key}:{ROLES.get(value, value)}" for key, value in parts.items())


def _rounded(text: str, digits: int) -> str:
    """The text, its numbers to so many decimals."""
    return re.sub(r"-?\d+\.\d+", lambda number: f"{round(float(number[0]), digits):g}", text)
