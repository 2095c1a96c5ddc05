"""How names and numbers are written for people, and the small tables that a notebook shows of a record."""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

# Unit by the end of a name; the longest that fits counts.
UNITS = {
    "mm": "mm", "um": "µm", "mm_um": "mm, µm", "m": "m", "deg": "deg", "mrad": "mrad", "rpm": "rpm", "m_s": "m/s", "m_s2": "m/s²",
    "s": "s", "ms": "ms", "h": "h", "hz": "Hz", "N": "N", "Nm": "N m", "N_m": "N/m", "N_s_m": "N s/m", "s_m": "s/m", "W": "W",
    "MPa": "MPa", "GPa": "GPa", "1_GPa": "1/GPa", "mPas": "mPa s", "C_mm2_s": "°C, mm²/s", "g": "g", "kg": "kg", "g_mm": "g mm",
    "kg_mm2": "kg mm²", "kg_m3": "kg/m³", "C": "°C", "K": "K", "per_K": "1/K", "1e_6_K": "1e-6/K", "percent": "%",
}  # fmt: skip
MOST_PARTS = 3
# Whole names that end like a unit and have none.
UNITLESS = {"mu_m"}
# A number below this many digits before the point is written without an exponent.
PLAIN_BELOW = 1e7
# What is smaller is left over from rounding.
NOISE = 1e-12
MARK = re.compile(r"\{\{([A-Z]+)\}\}")


def quantity(name: str) -> tuple[str, str]:
    """'impact_force_N' as ('impact force', 'N'); the unit is empty where the name has none."""
    words = name.split("_")
    plain = name.rpartition(".")[2] in UNITLESS
    for parts in range(min(MOST_PARTS, len(words) - 1), 0, -1):
        if not plain and (end := "_".join(words[-parts:])) in UNITS:
            return " ".join(words[:-parts]), UNITS[end]
    return " ".join(words), ""


def label(name: str) -> str:
    """'impact_force_N' as 'impact force [N]'."""
    words, unit = quantity(name)
    return f"{words} [{unit}]" if unit else words


def shown(value: Any, digits: int = 4) -> str:
    """A value for a table: numbers to ``digits`` significant ones; nothing for what is undefined."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(shown(each, digits) for each in value)
    if not isinstance(value, float):
        return str(value)
    if not math.isfinite(value):
        return ""
    text = f"{0.0 if abs(value) < NOISE else value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < PLAIN_BELOW else text


def decimals(error: float) -> int:
    """Decimals that show two significant digits of an error."""
    return min(max(1 - math.floor(math.log10(error)), 0), 9)


def with_error(value: float | None, error: float | None) -> str:
    """'87.09 ± 0.35': the error to two digits, the value to the same place."""
    if value is None or error is None or not math.isfinite(error) or error <= 0.0:
        return shown(value, 5)
    places = decimals(error)
    return f"{value:.{places}f} ± {error:.{places}f}"


def improvement(gain: float, error: float | None, goal: str, unit: str = "%") -> str:
    """'3.30 ± 0.62 % less' of an improvement with its 95 % half-width: which way the response itself went.

    ``goal``: "min" or "max", else the distance from a target is what grew less.
    """
    better, worse = {"min": ("less", "more"), "max": ("more", "less")}.get(goal, ("off target less", "off target more"))
    size = with_error(abs(gain), error) if error else f"{abs(gain):.2f}"
    return f"{size} {unit}".rstrip() + f" {worse if gain < 0.0 else better}"


class Figure(NamedTuple):
    """A figure of a result: what it is, its value, the half-width of its 95 % interval where there is one, its unit."""

    words: str
    value: float | None
    error: float | None
    unit: str


class Brief:
    """A result that a notebook shows as a line or a small table of figures, not as all that it holds."""

    def brief(self) -> tuple[str, list[Figure]]:
        """What is to be known beside the figures, and these."""
        raise NotImplementedError

    def __repr__(self) -> str:
        remark, figures = self.brief()
        told = [f"{each.words} {with_error(each.value, each.error)} {each.unit}".rstrip() for each in figures[:4]]
        return f"<{type(self).__name__}: {', '.join([*told, remark])}>"

    def _repr_html_(self) -> str:
        remark, figures = self.brief()
        rows = [(each.words, with_error(each.value, each.error), each.unit) for each in figures]
        return html_table(f"{type(self).__name__}: {remark}", ("figure", "value ± 95 %", "unit"), rows)


def filled_page(template: str, marks: Mapping[str, str]) -> str:
    """A page with its ``{{MARKS}}`` put in; in one pass, so that nothing put in can be taken for a mark."""
    return MARK.sub(lambda mark: marks[mark[1]], template)


def html_table(title: str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table as HTML: the first column of words, the others of figures."""
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join(
        f'<tr><th style="text-align:left">{escape(row[0])}</th>'
        + "".join(f"<td>{escape(cell)}</td>" for cell in row[1:])
        + "</tr>"
        for row in rows
    )
    return f"<table><caption>{escape(title)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
