"""How names and numbers are written for people: units, sensible digits, errors, tolerances."""

import math
from collections.abc import Mapping
from typing import Any

UNITS = {
    "mm": "mm", "um": "µm", "N": "N", "W": "W", "rpm": "rpm", "s": "s", "ms": "ms", "h": "h", "MPa": "MPa",
    "GPa": "GPa", "percent": "%", "K": "K", "g": "g",
}  # fmt: skip
# A number below this many digits before the point is written without an exponent.
PLAIN_BELOW = 1e7


def quantity(name: str) -> tuple[str, str]:
    """'impact_force_N' as ('impact force', 'N'); the unit is empty where the name has none."""
    words = name.split("_")
    if len(words) > 1 and words[-1] in UNITS:
        return " ".join(words[:-1]), UNITS[words[-1]]
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
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < PLAIN_BELOW else text


def probability(value: float | None) -> str:
    """A p-value, four decimals at most."""
    if value is None or not math.isfinite(value):
        return ""
    return "< 0.0001" if value < 1e-4 else f"{value:.4f}"


def decimals(error: float) -> int:
    """Decimals that show two significant digits of an error."""
    return min(max(1 - math.floor(math.log10(error)), 0), 9)


def with_error(value: float | None, error: float | None) -> str:
    """'87.09 ± 0.35': the error to two digits, the value to the same place."""
    if value is None or error is None or not math.isfinite(error) or error <= 0.0:
        return shown(value, 5)
    places = decimals(error)
    return f"{value:.{places}f} ± {error:.{places}f}"


def rounded_down(width: float) -> str:
    """A half width in two digits and no wider: 0.001875 as '0.0018'."""
    if width <= 0.0:
        return "0"
    digit = math.floor(math.log10(width)) - 1
    return f"{math.floor(width / 10.0**digit * (1.0 + 1e-12)) * 10.0**digit:.{max(-digit, 0)}f}"


def half_width(record: Mapping[str, Any]) -> float | None:
    """95 % half-width of a quantity: its error, or its statistical and numerical error together."""
    parts = [record.get(key) for key in ("error", "statistical_error", "numerical_error")]
    known = [part for part in parts if part is not None]
    return math.hypot(*known) if known else None


def percentage(record: Mapping[str, Any]) -> str:
    """'+11.16 ± 0.65 %' of a gain."""
    value, error = record.get("percent"), record.get("error_percent")
    if value is None:
        return ""
    if not error:
        return f"{value:+.2f} %"
    places = decimals(error)
    return f"{value:+.{places}f} ± {error:.{places}f} %"


def dimension(part: Mapping[str, Any]) -> str:
    """'9.2900 0/-0.0050' of a part's nominal and deviations."""

    def deviation(value: float) -> str:
        return "0" if value == 0.0 else f"{value:+.4f}"

    return f"{part['nominal_mm']:.4f} {deviation(part['upper_mm'])}/{deviation(part['lower_mm'])}"
