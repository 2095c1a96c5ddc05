"""Goals of the responses and the front of STUDY.toml."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rbdyn.faults import Strict


class Goal(Strict):
    """What is wanted of a response."""

    goal: Literal["min", "max"] = "min"


class Front(Strict):
    """NSGA-II on the surfaces, within the box of the design's axial points."""

    population: Annotated[int, Field(ge=8, le=10000)] = 100
    generations: Annotated[int, Field(ge=1, le=100000)] = 200
    seed: Annotated[int, Field(ge=0)] = 1
