"""How gains, tolerances and probabilities are written for people; names and numbers by ``rbdyn.base.words``."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from doe.pareto.manufacture import Interval, percent
from rbdyn.base.words import improvement

# Limits by their sense in a record.
SENSES = {"<=": "≤", ">=": "≥"}


def probability(value: float | None) -> str:
    """A p-value, four decimals at most."""
    if value is None or not math.isfinite(value):
        return ""
    return "< 0.0001" if value < 1e-4 else f"{value:.4f}"


def rounded_down(width: float) -> str:
    """A half width in two digits and no wider: 0.001875 as '0.0018'."""
    if width <= 0.0:
        return "0"
    digit = math.floor(math.log10(width)) - 1
    return f"{math.floor(width / 10.0**digit * (1.0 + 1e-12)) * 10.0**digit:.{max(-digit, 0)}f}"


def of_hundred(share: Sequence[float]) -> str:
    """'87 (80 to 92)' of a share with the ends of its interval: in how many of 100 cases."""
    value, low, high = (100.0 * each for each in share)
    return f"{value:.0f} ({low:.0f} to {high:.0f})"


def share_with_interval(share: float, interval: Sequence[float] | None) -> str:
    """'95.0 % (71.3 to 99.8 %)' of a share with the ends of its interval."""
    known = "" if interval is None else f" ({Interval(*interval).words})"
    return f"{percent(share)} %{known}"


def half_width(record: Mapping[str, Any]) -> float | None:
    """95 % half-width of a quantity: its error, or its statistical and numerical error together.

    None where the statistical error is unknown, as for ``Quantity.stated_error``.
    """
    if record.get("error") is not None:
        return float(record["error"])
    statistical = record.get("statistical_error")
    return None if statistical is None else math.hypot(statistical, record.get("numerical_error") or 0.0)


def change(gain: Mapping[str, Any]) -> str:
    """'11.16 ± 0.65 % less' of a gain; nothing where it is unknown."""
    value = gain.get("percent")
    return "" if value is None else improvement(value, gain.get("error_percent"), gain.get("goal", "min"))


def moved(part: Mapping[str, Any]) -> str:
    """'+0.0200' of a part whose nominal was moved, else nothing."""
    return f"{part['moved_mm']:+.4f}" if part.get("moved_mm") else ""


def dimension(part: Mapping[str, Any]) -> str:
    """'9.2900 0/-0.0050' of a part's nominal and deviations."""

    def deviation(value: float) -> str:
        return "0" if value == 0.0 else f"{value:+.4f}"

    return f"{part['nominal_mm']:.4f} {deviation(part['upper_mm'])}/{deviation(part['lower_mm'])}"
