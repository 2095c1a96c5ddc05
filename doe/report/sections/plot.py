"""Pictures of a front that scripts mark points in, as SVG: axes with tidy ticks, points, lines, symbols.

Colours come from the style sheet by role. Pictures in which nothing changes are ``doe.report.still``.
"""

import math
from collections.abc import Iterable, Sequence
from html import escape

from doe.report.still import Point

Range = tuple[float, float]

# Corners of symbols of radius 1, so that no mark is told by its colour alone.
STAR = [
    ((1.0 if spike % 2 == 0 else 0.45) * math.sin(spike * math.pi / 5), -(1.0 if spike % 2 == 0 else 0.45) * math.cos(spike * math.pi / 5))
    for spike in range(10)
]  # fmt: skip
ARM = [(-0.4, -1.2), (0.4, -1.2), (0.4, -0.4)]
SYMBOLS = {
    "square": [(-0.8, -0.8), (0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)],
    "diamond": [(0.0, -1.1), (1.1, 0.0), (0.0, 1.1), (-1.1, 0.0)],
    "triangle": [(0.0, -1.1), (1.0, 0.8), (-1.0, 0.8)],
    "down": [(0.0, 1.1), (1.0, -0.8), (-1.0, -0.8)],
    "plus": [(x * c - y * s, x * s + y * c) for c, s in ((1, 0), (0, 1), (-1, 0), (0, -1)) for x, y in ARM],
    "hexagon": [(math.sin(k * math.pi / 3), math.cos(k * math.pi / 3)) for k in range(6)],
    "star": [(1.35 * u, 1.35 * v) for u, v in STAR],
}


def ticks(low: float, high: float, wanted: int = 5) -> list[float]:
    """Multiples of 1, 2 or 5 times a power of ten within a range."""
    raw = (high - low) / wanted
    decade = 10.0 ** math.floor(math.log10(raw))
    step = next(digit * decade for digit in (1.0, 2.0, 5.0, 10.0) if digit * decade >= raw * (1.0 - 1e-9))
    first = math.ceil(low / step - 1e-9)
    return [step * number for number in range(first, math.floor(high / step + 1e-9) + 1)]


def tick_text(value: float, all_ticks: Sequence[float]) -> str:
    """As many decimals as the distance of the ticks needs."""
    step = abs(all_ticks[1] - all_ticks[0]) if len(all_ticks) > 1 else abs(value) or 1.0
    if step >= 1e5 or step < 1e-5:
        return f"{value:.3g}"
    return f"{value:.{max(-math.floor(math.log10(step) + 1e-9), 0)}f}"


def span(values: Iterable[float], margin: float = 0.06) -> Range:
    """A range that holds all finite values, with a margin; never empty."""
    finite = [value for value in values if math.isfinite(value)] or [0.0]
    low, high = min(finite), max(finite)
    room = margin * (high - low) or 0.1 * abs(high) or 1.0
    return low - room, high + room


class Plot:
    """A picture in the making: add marks, then ask for the SVG."""

    LEFT, RIGHT, TOP, BOTTOM = 58.0, 12.0, 12.0, 44.0
    width, height = 340.0, 270.0

    def __init__(self, x: Range, y: Range, labels: tuple[str, str]) -> None:
        self.x, self.y, self.labels = x, y, labels
        self.marks: list[str] = []

    def place(self, x: float, y: float) -> Point:
        """Pixels of a point."""
        wide, high = self.width - self.LEFT - self.RIGHT, self.height - self.TOP - self.BOTTOM
        u = self.LEFT + wide * (x - self.x[0]) / (self.x[1] - self.x[0])
        v = self.TOP + high * (self.y[1] - y) / (self.y[1] - self.y[0])
        return u, v

    def dots(self, points: Sequence[Point], role: str, first: int) -> None:
        """Round points, numbered from ``first`` for the scripts of the page."""
        for number, point in enumerate(points, first):
            u, v = self.place(*point)
            self.marks.append(f'<circle class="dot {role}" data-point="{number}" cx="{u:.1f}" cy="{v:.1f}" r="2.6"/>')

    def line(self, points: Iterable[Point], role: str) -> None:
        """A line through points."""
        places = " ".join(f"{u:.1f},{v:.1f}" for u, v in (self.place(*point) for point in points))
        self.marks.append(f'<polyline class="line {role}" points="{places}"/>')

    def symbol(self, point: Point, shape: str, role: str, title: str) -> None:
        """A marked point."""
        self.marks.append(symbol(*self.place(*point), shape, role, title=title))

    def cross(self, point: Point, error: tuple[float | None, float | None], role: str) -> None:
        """Error bars of half-widths along x and y, as far as the frame reaches."""
        x, y = point
        for along, ((low, high), half) in enumerate(zip((self.x, self.y), error, strict=True)):
            if half:
                ends = max(point[along] - half, low), min(point[along] + half, high)
                self.line([(x, end) if along else (end, y) for end in ends], role)

    def svg(self, words: str, extra: str = "") -> str:
        """The picture; ``words`` describe it to those who cannot see it, ``extra`` are further attributes."""
        told = f'viewBox="0 0 {self.width:g} {self.height:g}" role="img" aria-label="{escape(words)}"{extra}'
        return f'<svg class="plot" {told}>{self._axes()}{"".join(self.marks)}</svg>'

    def _axes(self) -> str:
        left, right = self.LEFT, self.width - self.RIGHT
        top, bottom = self.TOP, self.height - self.BOTTOM
        parts = [f'<rect class="frame" x="{left}" y="{top}" width="{right - left:g}" height="{bottom - top:g}"/>']
        for value in (across := ticks(*self.x)):
            u, _ = self.place(value, self.y[0])
            parts.append(f'<line class="grid" x1="{u:.1f}" x2="{u:.1f}" y1="{top}" y2="{bottom}"/>')
            parts.append(f'<text x="{u:.1f}" y="{bottom + 15}" text-anchor="middle">{tick_text(value, across)}</text>')
        for value in (upward := ticks(*self.y)):
            _, v = self.place(self.x[0], value)
            parts.append(f'<line class="grid" y1="{v:.1f}" y2="{v:.1f}" x1="{left}" x2="{right}"/>')
            parts.append(f'<text x="{left - 5}" y="{v + 4:.1f}" text-anchor="end">{tick_text(value, upward)}</text>')
        middle, height = 0.5 * (left + right), 0.5 * (top + bottom)
        below, beside = (escape(words) for words in self.labels)
        parts.append(f'<text class="axis" x="{middle:g}" y="{self.height - 8:g}" text-anchor="middle">{below}</text>')
        parts.append(
            f'<text class="axis" transform="translate(13 {height:g}) rotate(-90)" text-anchor="middle">{beside}</text>'
        )
        return "".join(parts)


def symbol(u: float, v: float, shape: str, role: str, radius: float = 5.5, title: str = "") -> str:
    """A symbol at a place in pixels."""
    corners = " ".join(f"{u + radius * p:.1f},{v + radius * q:.1f}" for p, q in SYMBOLS[shape])
    words = f"<title>{escape(title)}</title>" if title else ""
    return f'<polygon class="symbol {role}" points="{corners}">{words}</polygon>'


def wide_svg(width: float, height: float, words: str, drawn: Iterable[str], extra: str = "") -> str:
    """A picture across the page of marks that are ``drawn`` already; ``words`` describe it."""
    told = f'viewBox="0 0 {width:g} {height:g}" role="img" aria-label="{escape(words)}"{extra}'
    return f'<div class="scroll"><svg class="plot wide" {told}>{"".join(drawn)}</svg></div>'


def legend(entries: Sequence[tuple[str, str, str]]) -> str:
    """Symbols and what they mean, (shape or "dot" or "line", role, words), as a line of HTML."""
    drawn = []
    for shape, role, words in entries:
        if shape == "dot":
            mark = f'<circle class="dot {role}" cx="8" cy="8" r="3.2"/>'
        elif shape == "line":
            mark = f'<polyline class="line {role}" points="0,8 16,8"/>'
        else:
            mark = symbol(8.0, 8.0, shape, role)
        drawn.append(f'<span><svg class="key" viewBox="0 0 16 16" aria-hidden="true">{mark}</svg>{escape(words)}</span>')  # fmt: skip
    return f'<p class="legend">{"".join(drawn)}</p>'
