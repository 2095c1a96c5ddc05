"""Factors and the design of STUDY.toml."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from rbdyn.faults import Strict


class Factor(Strict):
    """A factor: its name in tables, its key in the scene, and its values at coded 0 and per coded unit.

    The pick is rounded to a multiple of ``resolution``, the smallest step that a drawing makes. ``tolerance`` is the
    half width of what manufacture makes of it.
    """

    name: Annotated[str, Field(min_length=1)]
    key: Annotated[str, Field(min_length=3)]
    centre: float
    step: Annotated[float, Field(gt=0.0)]
    resolution: Annotated[float, Field(gt=0.0)] | None = None
    tolerance: Annotated[float, Field(gt=0.0)] | None = None


class Design(Strict):
    """Central composite design."""

    kind: Literal["central_composite"] = "central_composite"
    alpha: Literal["rotatable"] | Annotated[float, Field(gt=0.0, le=10.0)] = "rotatable"
    centre_replicates: Annotated[int, Field(ge=0, le=100)] = 6
    seed: Annotated[int, Field(ge=0)] = 1
