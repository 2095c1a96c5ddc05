"""The record of a whole study, shaped like summary.json: what every page, screen and table of it reads."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from doe.report.sections.record import drop_undefined
from doe.response_surface.statistics import Fits
from doe.workflow.asked import Settings
from doe.workflow.judgement import Robust
from rbdyn.base.identity import Identity
from rbdyn.base.notes import Note
from rbdyn.base.records import Record


class Summary(Record, kw_only=True):
    """A finished study: settings, design, surfaces, front, the pick with its confirmation, and what was asked for besides.

    ``duty``, ``adaptive``, ``robust`` and ``tolerances`` are None where the study has none.
    """

    format: str
    identity: Identity
    status: str
    limits: Any
    limits_sentence: str
    obstacles: Any
    tried: int
    edge: Any
    asked: Settings
    design: Any
    fit: Fits
    front: Any
    pick_on_surfaces: Any
    pick: dict[str, Any]
    operating_clearances_mm: dict[str, dict[str, float]]
    clearance_class: str
    confirmation: Any
    gains: Any
    statement: str
    whirl_sentence: str
    rivals_sentences: list[str]
    chains: Any
    made: Any
    missed_chains: dict[str, str]
    beside_reference: Any
    notes: list[Note]
    failures: Any
    cost: dict[str, float]
    versions: dict[str, str]
    inputs: str
    seeds: dict[str, int]
    duty: Any = None
    adaptive: Any = None
    robust: Robust | None = None
    tolerances: Any = None
    tolerances_gains: Any = None
    tolerances_sentence: str | None = None
    tolerances_warning: str | None = None


def restored(record: "Summary | Mapping[str, Any]") -> Summary:
    """The record of a study, also from its JSON; parts that have no Record of their own lose what is undefined."""
    if isinstance(record, Summary):
        return record
    untyped = {item.name for item in fields(Summary) if item.type is Any}
    return Summary.from_dict({key: drop_undefined(part) if key in untyped else part for key, part in record.items()})
