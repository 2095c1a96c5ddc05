"""Notes of a result: what its reader must know, each with a code, whose level says how bad it is.

``CODES`` is the one list of codes. A note is a sentence, so that it can be written wherever text is; it begins with its subject
and a colon. Notes of one code that differ in their subjects or figures are merged for the first screen.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from enum import StrEnum
from typing import Any, NamedTuple, Self


class Level(StrEnum):
    """How bad a note is: the bearing or the choice is in danger, the figures need a second look, or a remark."""

    DANGER = "danger"
    WARNING = "warning"
    NOTE = "note"


class Code(NamedTuple):
    """Level and meaning of a code; ``general``: about the model or the inputs at large, which no first screen shows."""

    level: Level
    meaning: str
    general: bool = False


DANGER, WARNING, NOTE = Level
# By level, those that matter most first: what is wrong with the bearing, with the figures, with what is known.
CODES: dict[str, Code] = {
    "seizure": Code(DANGER, "the cage or the bearing seizes at its temperatures, or a clearance in operation is nearly lost"),
    "overload": Code(DANGER, "pressure above the shakedown limit: no elastic theory holds, and the results apply to no real bearing"),
    "heat": Code(DANGER, "a loss that no flow of oil removes, or temperatures without a steady state or above a ceiling"),
    "failed": Code(DANGER, "no answer: no equilibrium, or a search that failed"),
    "dent": Code(DANGER, "pressure that dents a raceway by the rule of ISO 76"),
    "overspeed": Code(DANGER, "speed beyond twice the reference speed"),
    "short-life": Code(DANGER, "life below the hours of the duty"),
    "broken-limit": Code(DANGER, "the selected design violates a limit, or no point meets all of them"),
    "missed-chain": Code(DANGER, "a dimension chain has no parts that keep its tolerance"),
    "worse": Code(DANGER, "the selected design is worse than the baseline in a response"),
    "extrapolation": Code(DANGER, "a result rests on a fit outside the region of its runs"),
    "no-shoulder": Code(DANGER, "balls carry load where their raceway has no shoulder"),
    "loose-ring": Code(DANGER, "no ball touches the inner raceway"),
    "corner": Code(WARNING, "some runs of a design meet a danger, which the note names"),
    "open-limit": Code(WARNING, "a limit at the selected design is too near its bound for the error"),
    "chain": Code(WARNING, "a dimension chain is not solved, or wider than the gains allow"),
    "clearance": Code(WARNING, "more than half of a cage clearance is lost in operation, or balls get a preload"),
    "fast": Code(WARNING, "speed above the reference speed, where a bearing needs more cooling than usual"),
    "unit": Code(WARNING, "a value that looks like another unit"),
    "designation": Code(WARNING, "dimensions that contradict the designation"),
    "power-balance": Code(WARNING, "power supplied and lost differ: the tolerance of the steps is too loose"),
    "drift": Code(WARNING, "results drift over the counted turns, or the run is too short to show its transient"),
    "numerical-error": Code(WARNING, "a result may be off by its steps, or this error is unknown"),
    "few-samples": Code(WARNING, "too few independent samples for a sure statistical error"),
    "target": Code(WARNING, "the target of --target is not met"),
    "maker-loss": Code(WARNING, "the power loss is far from SKF's friction model"),
    "thin-film": Code(WARNING, "the oil film is thinner than the roughness under a law of full films"),
    "light-load": Code(WARNING, "the load is below manufacturers' minimum loads against skidding"),
    "omission": Code(WARNING, "the model leaves out an effect that is large here"),
    "undecided": Code(WARNING, "the heat balance is not decided, or some sets of its inputs have no steady state"),
    "unverified": Code(WARNING, "a formula is used where it was not verified"),
    "starved": Code(WARNING, "the oil is so thick that SKF's formula removes its friction"),
    "shoulder": Code(WARNING, "a contact ellipse climbs over a shoulder"),
    "gyroscopic-slip": Code(WARNING, "balls slip about the axis of the gyroscopic moment"),
    "tipped-ring": Code(WARNING, "a free ring tips more than a shaft lets it"),
    "other-roots": Code(WARNING, "other equilibria exist under the same load"),
    "optimum": Code(WARNING, "an optimum of a scan lies at an end of its range, or two optima differ"),
    "off-map": Code(WARNING, "a point of the duty lies off the map, or changes keys that the map does not"),
    "versions": Code(WARNING, "other versions computed the result"),
    "point": Code(DANGER, "a point of the duty failed"),
    "windows": Code(WARNING, "two results have values over different windows"),
    "few-replicates": Code(NOTE, "so few replicates that only large differences are significant"),
    "tolerances": Code(WARNING, "no tolerances, or too fine ones, satisfy the requirements of the study"),
    "region": Code(WARNING, "the region of the study moved to where its clearances in operation stay above their floors"),
    "missing-column": Code(WARNING, "a table of runs has no column of a response of its study, which is left out"),
    "lost-runs": Code(WARNING, "runs or input sets failed and are left out"),
    "cage-class": Code(WARNING, "front and selected design of a study stay away from runs whose cage violates its limit"),
    "inputs": Code(WARNING, "the ranges of unknown inputs are doubtful, or keys of the study override it"),
    "emulator": Code(WARNING, "an emulator explains too little, or a range has too few input sets"),
    "advice": Code(WARNING, "the study can be made better by a setting, which the note names"),
    "jitter": Code(NOTE, "the cage does not whirl, so the whirl deviation ratio has little meaning"),
    "oil-drag": Code(NOTE, "cage slip rests on the drag of oil films"),
    "traction-law": Code(NOTE, "cage slip depends on the form of the traction law"),
    "oil-fraction": Code(NOTE, "the oil fraction that follows from a flow is a guess"),
    "clear-balls": Code(NOTE, "some balls are clear of a raceway"),
    "table": Code(NOTE, "how a table was read"),
    "remark": Code(NOTE, "any other remark"),
    "definition": Code(NOTE, "how a result is defined", True),
    "estimate": Code(NOTE, "inputs are estimated, with their error", True),
    "left-out": Code(NOTE, "the model leaves out an effect", True),
    "lengthened": Code(NOTE, "runs were lengthened because results drifted", True),
    "method": Code(NOTE, "how the steps were computed", True),
}  # fmt: skip


class Note(str):
    """A sentence with its ``code``. Raises KeyError for a code that ``CODES`` does not list."""

    code: str
    level: Level

    def __new__(cls, code: str, text: str) -> Self:
        note = super().__new__(cls, text)
        note.code, note.level = code, CODES[code].level
        return note

    def __reduce__(self) -> tuple[type[Self], tuple[str, str]]:
        return type(self), (self.code, str(self))

    def as_dict(self) -> dict[str, Any]:
        """JSON form."""
        return {"level": str(self.level), "code": self.code, "text": str(self)}

    @classmethod
    def of(cls, note: "Note | Mapping[str, Any]") -> "Note":
        """A note, or that of a JSON form. Raises KeyError or TypeError for anything else."""
        return note if isinstance(note, Note) else cls(note["code"], note["text"])

    def about(self, places: str) -> "Note":
        """The note with the ``places`` that it is about, such as points of a duty."""
        return Note(self.code, f"{self} ({places})")


Notes = tuple[Note, ...]
# Codes by the first words of the status of a result without a sound answer; codes of simulated figures that no bearing has, each
# with the status that it gives the result.
LOST_CLEARANCE = "lost clearance"
STATUS_CODES = {
    "overloaded": "overload",
    "seizure": "seizure",
    LOST_CLEARANCE: "seizure",
    "too hot": "heat",
    "no steady state": "heat",
    "undecided": "undecided",
}
IMPOSSIBLE = {"overload": "overloaded", "heat": "too hot"}


UNDECIDED = "undecided: "  # how the note of such a status begins


def status_notes(status: str) -> Notes:
    """The ``status`` of a result, with its reason behind a colon, as a note; none where the answer is sound."""
    kind = status.partition(":")[0]
    return () if kind in ("ok", "steady") else (Note(STATUS_CODES.get(kind, "failed"), status),)


def status_of(notes: Iterable[Note]) -> str:
    """The status of figures with these notes: "ok", or what makes them impossible."""
    return next((IMPOSSIBLE[note.code] for note in notes if note.code in IMPOSSIBLE), "ok")


def ranked(notes: Iterable[Note]) -> list[Note]:
    """Notes once each, the worst first; of one level in the order of their codes."""
    levels, codes = list(Level), list(CODES)
    return sorted(dict.fromkeys(notes), key=lambda note: (levels.index(note.level), codes.index(note.code)))


def merged(
    notes: Mapping[str, Iterable[Note]], place: str, least: Level = NOTE, same: Callable[[str], str] = str
) -> Notes:
    """Notes of several results by their names: one that all have stands once, any other names those that have it.

    ``place``: such as "at {}", of the names. ``least``: level from which notes count. ``same``: what notes that are one have in
    common; the first of them stands for all.
    """
    groups: dict[tuple[str, str], tuple[Note, dict[str, None]]] = {}
    for name, found in notes.items():
        for note in found:
            if list(Level).index(note.level) <= list(Level).index(least):
                groups.setdefault((note.code, same(note)), (note, {}))[1][name] = None
    return tuple(
        note if len(names) == len(notes) else note.about(place.format(", ".join(names)))
        for note, names in groups.values()
    )


def of_level(notes: Iterable[Note], level: Level) -> list[Note]:
    """Notes of a level, once each."""
    return [note for note in dict.fromkeys(notes) if note.level == level]


def verdict(notes: Iterable[Note], further: int = 0) -> str:
    """The first danger, else that there is none, with what is undecided and the number of warnings, ``further`` ones among them."""
    notes = condensed(notes)
    dangers, warnings = of_level(notes, DANGER), len(of_level(notes, WARNING)) + further
    warned = f"{warnings} warning{'s' if warnings > 1 else ''}" if warnings else ""
    if not dangers:
        undecided = next((note for note in notes if note.startswith(UNDECIDED)), "")
        found = "No danger found" + undecided.replace(UNDECIDED, ", but the temperatures are undecided: ")
        return "; ".join(filter(None, [found, warned]))
    return dangers[0]


# Figures in a note, and the places and numbers of runs at its end: notes of a code that differ in these alone are one.
NUMBER, PLACES = re.compile(r"[-+]?\d[\d.,]*(?:e[-+]?\d+)?"), re.compile(r"(?: \([^()]*\))+$")


def condensed(notes: Iterable[Note]) -> list[Note]:
    """Notes ``ranked``, those of one code that say the same of several things in one sentence.

    They say the same where they share the words behind the subject that may stand before the first colon, figures apart: the
    first of them then lists the other subjects; without other subjects it stands for all.
    """
    groups: dict[tuple[str, str], list[Note]] = {}
    for note in ranked(notes):
        groups.setdefault((note.code, NUMBER.sub("#", PLACES.sub("", _parted(note)[1]))), []).append(note)
    return [_merged(group) for group in groups.values()]


def _merged(group: list[Note]) -> Note:
    subjects = list(dict.fromkeys(_parted(note)[0] for note in group))
    further = f"; likewise {', '.join(subjects[1:])}" if len(subjects) > 1 else ""
    return Note(group[0].code, f"{group[0]}{further}") if further else group[0]


def _parted(note: Note) -> tuple[str, str]:
    """Subject and statement."""
    subject, colon, statement = note.partition(": ")
    return (subject, statement) if colon else ("", subject)
