"""Decimal commas, decimal points and thousands separators: which mark a table has, and its numbers as plain ones.

A mark is taken only where a cell of the table shows it beyond doubt: "0,15" and "1.234,5" do, "1,234" does not.
"""

import re
from collections import Counter
from collections.abc import Iterable
from typing import NamedTuple

from rbdyn.base.records import NUMBER

POINT, COMMA = ".", ","
# A number with one mark, and one that may have a thousands separator or three decimals.
WITH_MARK = re.compile(r"[+-]?(?:\d+([.,])\d*|([.,])\d+)(?:[eE][+-]?\d+)?", re.ASCII)
UNSURE = re.compile(r"([+-]?[1-9]\d{0,2})([.,])(\d{3})", re.ASCII)
# Thousands in groups: by points, commas, spaces that do not break, or apostrophes, as in Switzerland.
GROUPED = re.compile(
    r"[+-]?[1-9]\d{0,2}(?P<group>[.,'\u2019\u00a0\u202f])\d{3}(?:(?P=group)\d{3})*(?:(?P<decimal>[.,])\d*)?", re.ASCII
)
GROUPS = {
    ".": "points",
    ",": "commas",
    "'": "apostrophes",
    "\u2019": "apostrophes",
    "\u00a0": "spaces",
    "\u202f": "spaces",
}


class Exact(str):
    """Text of a number that a program stored as a number: no mark of it is in doubt."""

    __slots__ = ()

    def strip(self, chars: str | None = None, /) -> "Exact":
        """The text itself, which has no blanks at its ends."""
        return self


class Marks(NamedTuple):
    """The decimal mark of a table, None where no number shows it.

    ``sure``: whether no number shows the other one. ``groups``: what separates thousands in some numbers.
    """

    decimal: str | None
    sure: bool = True
    groups: frozenset[str] = frozenset()

    def plain(self, text: str) -> tuple[str, str]:
        """The number of a cell with a decimal point, and the reason where it is in doubt; any other text as it is."""
        if isinstance(text, Exact):
            return text, ""
        if unsure := UNSURE.fullmatch(text):
            return self._unsure(text, *unsure.groups())
        mark, group = _shown(text)
        if mark is None and not group:
            return text, ""
        if mark not in (None, self.decimal):
            return (
                text,
                f"has a decimal {_name(mark)} and other numbers a decimal {_name(self.decimal)}; write one of them",
            )
        return (text.replace(group, "") if group else text).replace(COMMA, POINT), ""

    @property
    def words(self) -> list[str]:
        """What is unusual in them."""
        commas = ["decimal commas"] if self.decimal == COMMA else []
        return [*commas, *sorted({f"{GROUPS[group]} between thousands" for group in self.groups})]

    def _unsure(self, text: str, head: str, mark: str, tail: str) -> tuple[str, str]:
        """A number like 1,234."""
        if self.sure and mark == self.decimal:
            return f"{head}{POINT}{tail}", ""
        if self.sure and self.decimal and mark in self.groups:
            return head + tail, ""
        decimal = self.decimal or mark
        fix = f"{head}{decimal}{tail}" if decimal != mark else f"{text}0"
        return text, f"may mean {head}{tail} or {head}{decimal}{tail}; write {head}{tail} or {fix}"


def marks_of(texts: Iterable[str], default: str | None) -> Marks:
    """The marks of a table by all its cells; ``default``: the decimal mark where no cell shows one."""
    decimals, groups = Counter[str](), set[str]()
    for text in texts:
        if isinstance(text, Exact) or UNSURE.fullmatch(text):
            continue
        mark, group = _shown(text)
        decimals[mark or ""] += mark is not None
        groups |= {group} if group else set()
    # Points win a draw: they are what tables here are written with.
    decimal = COMMA if decimals[COMMA] > decimals[POINT] else POINT if decimals[POINT] else default
    return Marks(decimal, not (decimals[COMMA] and decimals[POINT]), frozenset(groups))


def is_like_number(text: str) -> bool:
    """Whether a text is a number with any marks."""
    return NUMBER.fullmatch(text) is not None or bool(WITH_MARK.fullmatch(text) or GROUPED.fullmatch(text))


def _shown(text: str) -> tuple[str | None, str]:
    """The decimal mark that a number shows, None without one, and its thousands separator; of any other text nothing."""
    if match := WITH_MARK.fullmatch(text):
        return match[1] or match[2], ""
    if grouped := GROUPED.fullmatch(text):
        group, decimal = grouped["group"], grouped["decimal"]
        if group == decimal:
            return None, ""
        return decimal or {POINT: COMMA, COMMA: POINT}.get(group), group
    return None, ""


def _name(mark: str | None) -> str:
    return "comma" if mark == COMMA else "point"
