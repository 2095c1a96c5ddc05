"""The record of a whole study, shaped like summary.json: what every page, screen and table of it reads."""

from typing import Any

from doe.dimension_chain import ChainResult
from doe.response_surface.statistics import Fits
from doe.running.store import Cause
from doe.workflow.confirmation import ConfirmedPoint, Gain, PickLimit
from doe.workflow.duty import DutyAnswer
from doe.workflow.front_record import EstimatedPoint, SearchResult, SurfaceFront
from doe.workflow.judgement import Robust
from doe.workflow.obstacles import Obstacles
from doe.workflow.parts import Made
from doe.workflow.pick import Edge
from doe.workflow.problem import Settings
from doe.workflow.runs import StudyDesign
from doe.workflow.surfaces import PublishedComparison
from doe.workflow.tolerances import FactorTolerance, KeptGain
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
    limits: dict[str, PickLimit]
    obstacles: Obstacles
    tried: int
    edge: Edge
    asked: Settings
    design: StudyDesign
    fit: Fits
    front: SurfaceFront
    pick_on_surfaces: EstimatedPoint
    pick: dict[str, Any]
    operating_clearances_mm: dict[str, dict[str, float]]
    clearance_class: str
    confirmation: dict[str, ConfirmedPoint]
    gains: dict[str, Gain]
    statement: str
    whirl_sentence: str
    rivals_sentences: list[str]
    chains: dict[str, ChainResult]
    made: dict[str, Made]
    missed_chains: dict[str, str]
    published_comparisons: dict[str, PublishedComparison]
    notes: list[Note]
    failures: list[Cause]
    cost: dict[str, float]
    versions: dict[str, str]
    inputs: str
    seeds: dict[str, int]
    duty: DutyAnswer | None = None
    adaptive: SearchResult | None = None
    robust: Robust | None = None
    tolerances: dict[str, FactorTolerance] | None = None
    tolerances_gains: dict[str, KeptGain] | None = None
    tolerances_sentence: str | None = None
    tolerances_warning: str | None = None
