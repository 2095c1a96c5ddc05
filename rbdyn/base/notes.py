"""Notes of a result: what its reader must know, each with a code, whose level says how bad it is.

``CODES`` is the one list of codes. A note is a sentence, so that it can be written wherever text is.
"""

from collections.abc import Iterable, Mapping
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
    "other_versions": Level.NOTE,
    "other_windows": Level.WARNING,
    "point_failed": Level.DANGER,
    "few_replicates": Level.NOTE,
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


def merged(notes: Mapping[str, Iterable[str]], least: Level = Level.NOTE) -> list[str]:
    """Notes of several results by their names: one that all have stands once, any other names those that have it.

    ``least``: level from which notes count; one without a code is a remark.
    """
    places: dict[str, list[str]] = {}
    codes: dict[str, str | None] = {}
    for name, texts in notes.items():
        for note in texts:
            level, codes[note] = (note.level, note.code) if isinstance(note, Note) else (Level.NOTE, None)
            if [*Level].index(level) <= [*Level].index(least):
                places.setdefault(note, []).append(name)
    found = list[str]()
    for text, names in places.items():
        whole, code = str(text) if len(names) == len(notes) else f"{', '.join(names)}: {text}", codes[text]
        found.append(whole if code is None else Note(code, whole))
    return found
