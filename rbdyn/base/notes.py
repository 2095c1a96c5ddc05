"""Notes of a result: what its reader must know, each with a code, whose level says how bad it is.

``CODES`` is the one list of codes. A note is a sentence, so that it can be written wherever text is.
"""

from enum import StrEnum
from typing import Any, Self


class Level(StrEnum):
    """How bad a note is: the bearing or the choice is in danger, the figures need a second look, or a remark."""

    DANGER = "danger"
    WARNING = "warning"
    NOTE = "note"


# Level of each code.
CODES: dict[str, Level] = {
    "seizure": Level.DANGER,
    "nearly lost": Level.DANGER,
    "too hot": Level.DANGER,
    "region": Level.WARNING,
    "failed runs": Level.WARNING,
    "remark": Level.NOTE,
}


class Note(str):
    """A sentence with its ``code``. Raises KeyError for a code that ``CODES`` does not list."""

    code: str
    level: Level

    def __new__(cls, code: str, text: str) -> Self:
        note = super().__new__(cls, text)
        note.code, note.level = code, CODES[code]
        return note

    def __reduce__(self) -> tuple[type[Self], tuple[str, str]]:
        return type(self), (self.code, str(self))

    def as_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {"level": str(self.level), "code": self.code, "text": str(self)}
