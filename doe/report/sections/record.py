"""Reading a summary, any optional part of which may be missing or null."""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from doe.report.words import probability
from rbdyn.base.blocks import Table
from rbdyn.base.words import label, quantity, shown

Record = Mapping[str, Any]
# Characters above which a value is a sentence, to be broken.
LONG = 40
# The efficiencies of a design go by a capital letter.
EFFICIENCY = re.compile(r"^efficiency \[%\], ([adgi])$")


def part(record: Record, *keys: str) -> Any:
    """The value under nested keys; None where any is missing or null."""
    found: Any = record
    for key in keys:
        if not isinstance(found, Mapping):
            return None
        found = found.get(key)
    return found


@dataclass(frozen=True)
class Factor:
    """A factor as asked. Without a study next to it, only its name is known."""

    name: str
    letter: str
    key: str | None = None
    centre: float | None = None
    step: float | None = None
    low: float | None = None
    high: float | None = None
    resolution: float | None = None
    tolerance: float | None = None

    @property
    def words(self) -> str:
        """Its name without the unit."""
        return quantity(self.name)[0]

    @property
    def unit(self) -> str:
        return quantity(self.name)[1]

    @property
    def decimals(self) -> int:
        """Of the resolution of the drawing, or three digits of the step."""
        scale = self.resolution or (self.step / 100.0 if self.step else None)
        return 4 if not scale else min(max(-math.floor(math.log10(scale) + 1e-9), 0), 9)

    def text(self, value: float | None, further: int = 0) -> str:
        """A value to the resolution of the drawing, or ``further`` decimals beyond."""
        return "" if value is None else f"{value:.{self.decimals + further}f}"


def factors(summary: Record) -> list[Factor]:
    """Factors in the study's order."""
    given = part(summary, "asked", "factors")
    if given:
        return [Factor(**{key: each.get(key) for key in Factor.__dataclass_fields__}) for each in given]
    names = part(summary, "design", "factors") or list(part(summary, "pick") or {})
    return [Factor(name, "ABCDEFGH"[place]) for place, name in enumerate(names)]


def responses(summary: Record) -> list[dict[str, Any]]:
    """Responses in the study's order: name, goal and what else was asked of them."""
    given = part(summary, "asked", "responses")
    if given:
        return [dict(each) for each in given]
    return [{"name": name} for name in part(summary, "design", "responses") or part(summary, "gains") or []]


def scalars(record: Record, prefix: str = "") -> Iterator[tuple[str, str]]:
    """Names and values of everything in nested tables; lists as one value."""
    for key, value in record.items():
        name = prefix + label(key)
        if isinstance(value, Mapping):
            yield from scalars(value, f"{name}, ")
        elif value is not None and not (isinstance(value, list) and value and isinstance(value[0], dict | list)):
            yield (
                EFFICIENCY.sub(lambda found: f"{found[1].upper()}-efficiency [%]", name),
                probability(value) if key == "p" else shown(value),
            )


def record_table(caption: str, record: Record | None, folded: bool = False) -> Table:
    """Everything in nested tables, a row each."""
    rows = list(scalars(record or {}))
    prose = (1,) if any(len(value) > LONG for _, value in rows) else ()
    return Table(caption, ("", "value"), rows, folded=folded, text_columns=prose)


def allocation(chain: Record) -> dict[str, Any]:
    """Parts of a dimension chain whose dimensions are known."""
    needed = {"nominal_mm", "upper_mm", "lower_mm"}
    return {name: each for name, each in (chain.get("allocation") or {}).items() if needed <= set(each)}


def nearest(summary: Record, place: Record | None, candidates: Mapping[str, Record]) -> str | None:
    """Name of the candidate whose factors lie nearest to a place in coded units; None without any.

    A pick is simulated at the resolution of the drawing, so its factors are not those of the front to the digit.
    """

    def apart(name: str) -> float:
        far = [
            abs(candidates[name]["factors"][each.name] - (place or {})[each.name]) / (each.step or 1.0)
            for each in factors(summary)
        ]
        return math.hypot(*far)

    names = {each.name for each in factors(summary)}
    whole = [name for name, each in candidates.items() if names <= set(each.get("factors") or {})]
    return min(whole, key=apart) if place and names <= set(place) and whole else None


def fits(summary: Record) -> dict[str, Any]:
    """Fitted surfaces by response."""
    fitted = part(summary, "fit", "responses") or {}
    return {name: each for name, each in fitted.items() if each.get("coefficients")}


def known(value: Any) -> Any:
    """The same record without what is undefined: null and NaN; in lists, where places count, they are None."""
    if isinstance(value, Mapping):
        return {key: found for key, each in value.items() if (found := known(each)) is not None}
    if isinstance(value, list | tuple):
        return [known(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
