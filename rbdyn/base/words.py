"""Names, numbers, values with errors, counts and times as text, and the small tables that a notebook shows of a record."""

import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from html import escape
from typing import Any, NamedTuple, TypeGuard

# Unit by the end of a name; the longest match counts.
UNITS = {
    "mm": "mm", "um": "µm", "mm_um": "mm, µm", "m": "m", "deg": "deg", "mrad": "mrad", "rpm": "rpm", "m_s": "m/s", "m_s2": "m/s²",
    "s": "s", "ms": "ms", "h": "h", "hz": "Hz", "l_min": "L/min", "N": "N", "Nm": "N m", "N_m": "N/m", "N_m_s": "N m/s", "N_s": "N s", "N_s_m": "N s/m", "N_per_um": "N/µm", "Nm_per_mrad": "N m/mrad", "Mrev": "million turns", "s_m": "s/m", "W": "W",
    "MPa": "MPa", "GPa": "GPa", "1_GPa": "1/GPa", "mPas": "mPa s", "C_mm2_s": "°C, mm²/s", "g": "g", "kg": "kg", "g_mm": "g mm",
    "kg_mm2": "kg mm²", "kg_m3": "kg/m³", "C": "°C", "K": "K", "per_K": "1/K", "1e_6_K": "1e-6/K", "percent": "%",
    "W_mK": "W/(m K)", "J_kgK": "J/(kg K)",
}  # fmt: skip
NORMAL = 1.96  # half-width of a 95 % interval over its standard error, of many degrees of freedom
MOST_PARTS = 3
# Whole names that end like a unit and have none.
UNITLESS = {"mu_m"}
# A number below this many digits before the point is written without an exponent.
PLAIN_BELOW = 1e7
# Smaller numbers are remainders of rounding.
NOISE = 1e-12
# A number with more decimals is written with an exponent.
MOST_DECIMALS = 9
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
    """A value for a table: a number to so many significant ``digits``; an empty text for an undefined value."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, list | tuple):
        return ", ".join(shown(item, digits) for item in value)
    if not isinstance(value, float):
        return str(value)
    if not math.isfinite(value):
        return ""
    text = f"{0.0 if abs(value) < NOISE else value:.{digits}g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < PLAIN_BELOW else text


def counted(number: float, noun: str) -> str:
    """'1 run', '2 runs', '0 classes': a number with its noun."""
    ending = "" if number == 1 else "es" if noun.endswith(("s", "x", "ch", "sh")) else "s"
    return f"{number:.0f} {noun}{ending}" if number == round(number) else f"{number:g} {noun}{ending}"


def are(number: float) -> str:
    """'is' or 'are', for a number of things."""
    return "is" if number == 1 else "are"


def decimals(error: float) -> int:
    """Decimal place of the second significant digit of an error: 2 of 0.35 and of 0.0996, -1 of 123."""
    return 1 - int(f"{error:.1e}".partition("e")[2])


def rounded(value: float, error: float) -> tuple[str, str]:
    """'87.09' and '0.35' for 87.0943 and 0.352: the error > 0 to two significant digits, the value to the same place.

    Very large and very small ones share an exponent: '2.31e-12' and '0.12e-12'.
    """
    places, largest = decimals(error), max(abs(value), error)
    if largest < PLAIN_BELOW and places <= MOST_DECIMALS:
        return _to_place(value, places), _to_place(error, places)
    power = int(f"{largest:e}".partition("e")[2])
    texts = [f"{_to_place(number / 10.0**power, places + power)}e{power}" for number in (value, error)]
    return texts[0], texts[1]


def _to_place(value: float, places: int) -> str:
    """A number to so many decimals; to tens, hundreds and so on where ``places`` is negative."""
    return f"{round(value, places) if places < 0 else value:z.{max(places, 0)}f}"


def with_error(value: float | None, error: float | None) -> str:
    """'87.09 ± 0.35': the error to two significant digits, the value to the same place, five digits without an error.

    This is the only function that writes a value with its error.
    """
    if value is None or not math.isfinite(value) or not has_size(error):
        return shown(value, 5)
    return " ± ".join(rounded(value, error))


def value_alone(value: float, error: float | None) -> str:
    """'87.09' without its error, to the same place."""
    return with_error(value, error).partition(" ± ")[0]


def signed_with_error(value: float, error: float | None) -> str:
    """'+1.00 ± 0.52' for a difference."""
    text = with_error(value, error)
    return text if text.startswith("-") or not math.isfinite(value) else f"+{text}"


def error_alone(error: float | None) -> str:
    """'± 0.35' without the value; an empty text for an unknown error."""
    if error == 0.0:
        return "± 0"
    return f"± {rounded(error, error)[1]}" if has_size(error) else ""


def has_size(error: float | None) -> TypeGuard[float]:
    """Whether an error is a positive finite number, by which a value can be rounded."""
    return error is not None and math.isfinite(error) and error > 0.0


def improvement(gain: float, error: float | None, goal: str, unit: str = "%") -> str:
    """'3.30 ± 0.62 % less' for an improvement with its 95 % half-width, in the direction of the response itself.

    ``goal``: "min" or "max"; any other is a target, whose distance decreases.
    """
    better, worse = {"min": ("less", "more"), "max": ("more", "less")}.get(goal, ("off target less", "off target more"))
    exact = f"{abs(gain):.2g}" if 0.0 < abs(gain) < 0.1 else f"{abs(gain):.2f}"
    size = with_error(abs(gain), error) if has_size(error) else exact
    return f"{size} {unit}".rstrip() + f" {worse if gain < 0.0 else better}"


def chance(probability: float) -> str:
    """A probability to three decimals, such as '0.978', or 'above 0.999' or 'below 0.001' near one and zero."""
    if probability > 0.9995:
        return "above 0.999"
    return "below 0.001" if probability < 0.0005 else f"{probability:.3f}"


def rounded_down(width: float) -> str:
    """A half width in two digits and no wider: 0.001875 as '0.0018'."""
    if width <= 0.0:
        return "0"
    digit = math.floor(math.log10(width)) - 1
    return f"{math.floor(width / 10.0**digit * (1.0 + 1e-12)) * 10.0**digit:.{max(-digit, 0)}f}"


class Figure(NamedTuple):
    """A figure of a result: its description, its value, the half-width of its 95 % interval if any, its unit."""

    words: str
    value: float | None
    error: float | None
    unit: str


class Brief:
    """A result that a notebook shows as a line or a small table of its main figures."""

    def brief(self) -> tuple[str, list[Figure]]:
        """A remark on the result, and its main figures."""
        raise NotImplementedError

    def __repr__(self) -> str:
        remark, figures = self.brief()
        texts = [f"{words} {with_error(value, error)} {unit}".rstrip() for words, value, error, unit in figures[:4]]
        return f"<{type(self).__name__}: {', '.join([*texts, remark])}>"

    def _repr_html_(self) -> str:
        remark, figures = self.brief()
        rows = [(words, with_error(value, error), unit) for words, value, error, unit in figures]
        return html_table(f"{type(self).__name__}: {remark}", ("figure", "value ± 95 %", "unit"), rows)


def filled_page(template: str, marks: Mapping[str, str]) -> str:
    """A page with the values of its ``{{MARKS}}``, inserted in one pass so that no value is read as a mark."""
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


def range_ends(quantiles: Sequence[float]) -> str:
    """First and last of several quantiles."""
    return f"{quantiles[0]:.0f} to {quantiles[-1]:.0f}"


# Function that takes a sentence on the runs; None where nobody listens.
Notice = Callable[[str], object] | None
# A shorter time [s] needs no sentence; a time above LONG_S needs one that says how to make the plan smaller.
NOTABLE_S, LONG_S = 5.0, 120.0
# How many times longer a plan may be before that is stated.
CLEARLY = 1.25


def estimate(seconds: float, keys: Sequence[str], most: float = 0.0) -> str:
    """'the rest takes about 12 min; reduce numerics.turns to shorten it': the time to come, with what shortens a long one.

    ``most``: the time [s] if every run that may follow is needed; it is stated where it is clearly longer.
    """
    longer = f", and up to {duration(most)} if more runs are needed" if most > CLEARLY * seconds else ""
    sentence = f"the rest takes about {duration(seconds)}{longer}"
    return f"{sentence}; reduce {any_of(keys)} to shorten it" if keys and max(seconds, most) >= LONG_S else sentence


def named(notice: Notice, name: str) -> Notice:
    """A notice whose sentences begin with the name of one of several simulations."""
    return None if notice is None else lambda sentence: notice(f"{name}: {sentence}")


def part_of(progress: Callable[[int, int], None] | None, place: int, count: int) -> Callable[[int, int], None] | None:
    """Progress of one of ``count`` simulations as that of all, where each has as many runs."""
    return None if progress is None else lambda done, total: progress(place * total + done, count * total)


def duration(seconds: float) -> str:
    """A time to two digits in a suitable unit."""
    for unit, size in (("days", 86400.0), ("h", 3600.0), ("min", 60.0), ("s", 1.0)):
        if seconds >= 2.0 * size:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    return f"{seconds:.2g} s"


def any_of(words: Sequence[str]) -> str:
    """'a, b or c'."""
    return f"{', '.join(words[:-1])} or {words[-1]}" if words[1:] else words[0]


def all_of(words: Iterable[str]) -> str:
    """'a, b and c'; empty without words."""
    *first, last = [*words] or [""]
    return f"{', '.join(first)} and {last}" if first else last
