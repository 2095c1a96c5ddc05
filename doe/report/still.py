"""Still pictures: marks on one pair of axes that matplotlib draws, as SVG in the page or as PNG in a file.

A picture is described first and drawn when a page or a file asks for it, so a report without pictures loads no matplotlib.
Every colour is a role of the style sheet ``report.css``. SVG names the role, so that a picture is light, dark or on paper as
its page is; PNG takes the light colour.
"""

import io
import json
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

from rbdyn.base.records import Record

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
MARGIN = 12.0  # of the axes to the upper and the right edge [pt]
WIDEST = 400.0  # width [pt] above which a picture goes across the page, and scrolls where that is narrow
NOT_DRAWN = ("metadata", "style", "clipPath")
INHERITED = "inherited"  # in place of the style of a mark whose group has it
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none", "text.parse_math": False, "font.size": FONT, "axes.labelsize": 12.0, "legend.fontsize": SMALL,
    "text.color": COLOURS["ink"], "axes.labelcolor": COLOURS["ink"], "axes.edgecolor": COLOURS["line"],
    "xtick.labelcolor": COLOURS["ink"], "ytick.labelcolor": COLOURS["ink"], "grid.color": COLOURS["grid"],
    "xtick.major.size": 0.0, "ytick.major.size": 0.0, "xtick.major.pad": 4.0, "ytick.major.pad": 4.0, "axes.axisbelow": True,
    "axes.grid": True, "axes.linewidth": 1.0, "grid.linewidth": 1.0, "axes.formatter.useoffset": False, "axes.unicode_minus": True,
    "axes.xmargin": 0.06, "axes.ymargin": 0.06, "lines.markersize": 6.5, "lines.linewidth": 1.8, "legend.frameon": False,
    "axes.prop_cycle": f"cycler('color', ['{COLOURS['blue']}'])",
}  # fmt: skip


class Still(Record):
    """A picture of one pair of axes.

    words : what it shows, for readers who cannot see it; no two pictures of a page have the same
    draw : puts marks and labels on the axes
    width, height : of the picture [pt]; the axes keep ``left_margin``, ``bottom_margin`` and MARGIN from its edges
    data : what scripts of the page read of it, by the name of the attribute behind ``data-``
    """

    words: str
    draw: "Callable[[Axes], None]"
    width: float = 340.0
    height: float = 270.0
    left_margin: float = 58.0
    bottom_margin: float = 44.0
    top_margin: float = MARGIN
    data: Mapping[str, str] = field(default_factory=dict)

    @property
    def frame(self) -> tuple[float, float, float, float]:
        """Left, upper, right and lower edge of the axes from the upper left corner [pt]."""
        return self.left_margin, self.top_margin, self.width - MARGIN, self.height - self.bottom_margin

    def svg(self) -> str:
        """The picture for a page, the same text for the same marks: no date, no random name."""
        import matplotlib

        buffer = io.StringIO()
        metadata = dict.fromkeys(("Date", "Creator", "Format", "Type"))
        with matplotlib.rc_context({**STYLE, "svg.hashsalt": self.words}):
            _figure([self], 1).savefig(buffer, format="svg", transparent=True, metadata=metadata)
        return _page_svg(ElementTree.fromstring(buffer.getvalue()), self)


def save(stills: Sequence[Still], path: Path) -> None:
    """The pictures in rows of three as one PNG, of four in two rows; all as wide as the first."""
    import matplotlib

    from rbdyn.plots.style import PNG

    with matplotlib.rc_context(STYLE):
        _figure(stills, 2 if len(stills) == 4 else 3).savefig(path, dpi=130, pil_kwargs=PNG)


def name_marks(artist: "Artist", role: str, titles: Sequence[str] = ()) -> None:
    """Give marks the class ``role`` in SVG and the words that a page shows under the pointer, one for each mark in order."""
    artist.set_gid(json.dumps({"class": role, "titles": list(titles)}))


def _figure(stills: Sequence[Still], columns: int) -> Any:
    from matplotlib.figure import Figure
    from matplotlib.ticker import MaxNLocator

    first, columns = stills[0], min(columns, len(stills))
    heights = [max(still.height for still in stills[at : at + columns]) for at in range(0, len(stills), columns)]
    wide, high = first.width * columns, sum(heights)
    figure = Figure(figsize=(wide / 72.0, high / 72.0))
    for place, still in enumerate(stills):
        row, column = divmod(place, columns)
        near, upper, right, lower = still.frame
        corner = (column * first.width + near) / wide, (sum(heights[row:]) - lower) / high
        axis = figure.add_axes((*corner, (right - near) / wide, (lower - upper) / high))
        for side in (axis.xaxis, axis.yaxis):
            side.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
        still.draw(axis)
    return figure


def _page_svg(root: ElementTree.Element, still: Still) -> str:
    """The SVG of matplotlib as an element of a page: colours by role, no names but those that it refers to itself."""
    wide = still.width > WIDEST
    size = f'viewBox="0 0 {still.width:g} {still.height:g}"'
    words = f'role="img" aria-label="{escape(still.words)}"'
    data = "".join(f' data-{name}="{escape(text)}"' for name, text in still.data.items())
    picture = f'<svg class="{"plot wide" if wide else "plot"}" {size} {words}{data}>{_inside(root)}</svg>'
    return f'<div class="scroll">{picture}</div>' if wide else picture


def _inside(node: ElementTree.Element, in_definition: bool = False) -> str:
    return escape((node.text or "").strip()) + "".join(_element(child, in_definition) for child in node)


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
        return _mark_group(node, marks["class"], marks["titles"])
    if tag == "path" and not in_definition and node.get("style", "") in ("fill: none", ""):
        return ""
    inside = _inside(node, in_definition or tag == "defs")
    if tag == "defs" and not inside:
        return ""
    words = "".join(f' {key}="{escape(value)}"' for key, value in _attributes(node, tag, in_definition))
    return f"<{tag}{words}>{inside}</{tag}>" if inside else f"<{tag}{words}/>"


def _mark_group(node: ElementTree.Element, role: str, titles: Sequence[str]) -> str:
    """A group of marks of one class with a title in each mark; a style that all marks have is written once, for the group."""
    marks = list(_marks(node))
    for mark, title in zip(marks, titles, strict=False):
        ElementTree.SubElement(mark, "title").text = title
    styles = {mark.get("style", "") for mark in marks}
    words = f'class="{escape(role)}"'
    if len(marks) > 1 and len(styles) == 1 and (common := _style(styles.pop(), "path")):
        words += f' style="{common}"'
        for mark in marks:
            mark.set("style", INHERITED)
    return f"<g {words}>{_inside(node)}</g>"


def _marks(group: ElementTree.Element) -> Iterator[ElementTree.Element]:
    for child in group:
        tag = child.tag.rpartition("}")[2]
        if tag in ("use", "path"):
            yield child
        elif tag != "defs":
            yield from _marks(child)


def _attributes(node: ElementTree.Element, tag: str, in_definition: bool) -> Iterator[tuple[str, str]]:
    """Attributes that a page needs, to a tenth of a point; of the text's style only what the style sheet does not say."""
    for key, value in node.attrib.items():
        name = key.rpartition("}")[2]
        if name == "style":
            if value != INHERITED and (style := _style(value, tag)):
                yield "style", style
        elif name == "d":
            yield name, _rounded(_joined(value), 2) if in_definition else _path(value)
        elif name == "transform":
            if not value.startswith("rotate(-0"):
                yield name, _rounded(value, 1)
        elif name in ("x", "y"):
            yield name, _rounded(value, 1)
        elif name not in ("clip-path", "id") or (name == "id" and in_definition):
            yield name, value


def _style(text: str, tag: str) -> str:
    """Style in roles; a text has the family, size and colour of the style sheet unless its own differ."""
    parts = dict(part.split(": ", 1) for part in text.split("; ")) if text else {}
    if tag == "text":
        parts.pop("font-family", None)
        for key, usual in (("font-size", f"{FONT:g}px"), ("fill", COLOURS["ink"])):
            if parts.get(key) == usual:
                del parts[key]
    return ";".join(f"{key}:{ROLES.get(value, value)}" for key, value in parts.items())


def _path(text: str) -> str:
    """A path to a tenth of a point; one of open lines alone by its steps, which take half as many letters as its places."""
    if re.search(r"[^-MLe0-9.\s]", text):
        return _rounded(_joined(text), 1)
    steps, x, y = [], 0, 0
    for letter, *place in re.findall(r"([ML]) (\S+) (\S+)", text):
        u, v = (round(10.0 * float(number)) for number in place)
        steps.append(_step(u - x, "m" if letter == "M" else " ") + _step(v - y, " "))
        x, y = u, v
    return "".join(steps)


def _step(tenths: int, before: str) -> str:
    """Tenths of a point behind a letter or a space; a sign needs no space."""
    number = f"{tenths / 10.0:g}"
    if abs(tenths) < 10:
        number = number.replace("0.", ".")
    return number if before == " " and tenths < 0 else before + number


def _joined(text: str) -> str:
    """A path without spaces next to its letters."""
    return re.sub(r"\s*([MLHVCQz])\s*", r"\1", text).strip()


def _rounded(text: str, digits: int) -> str:
    """The text, its numbers to so many decimals."""
    return re.sub(r"-?\d+\.\d+", lambda number: f"{round(float(number[0]), digits):g}", text)
