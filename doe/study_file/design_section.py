"""Factors and the design of STUDY.toml."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from rbdyn.faults import Strict
from rbdyn.fields import LARGEST, Positive, or_refuse

# A name that heads a column of a table: one field whoever writes or reads it.
Name = Annotated[str, Field(max_length=100, pattern=r"""^[^\s,;"'\p{C}]([^,;"'\p{C}]*[^\s,;"'\p{C}])?$""")]
# Steps beside a value, or resolutions within a step, that are finer than this are lost in rounding.
FINEST = 1e-9


class Factor(Strict):
    """A factor: its name in tables, its key in the scene, and its values at coded 0 and per coded unit.

    The pick is rounded to a multiple of ``resolution``, the smallest step that a drawing makes. ``tolerance`` is the
    half width of what manufacture makes of it.
    """

    name: Name
    key: Annotated[str, Field(min_length=3)]
    centre: Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
    step: Positive
    resolution: Positive | None = None
    tolerance: Positive | None = None

    @model_validator(mode="after")
    def _levels_differ(self) -> Self:
        faults = []
        if self.step < FINEST * abs(self.centre):
            faults.append(f"step = {self.step:g}: is lost in rounding beside centre = {self.centre:g}; widen it")
        if self.resolution is not None and self.resolution < FINEST * self.step:
            faults.append(
                f"resolution = {self.resolution:g}: makes more than {1.0 / FINEST:g} steps of step = {self.step:g}; coarsen it"
            )
        return or_refuse(self, faults)


Kind = Literal["central_composite", "box_behnken", "full_factorial", "latin_hypercube", "sobol"]
Alpha = Literal["rotatable", "spherical", "orthogonal_blocks", "orthogonal_columns", "face_centred", "inscribed"]

# Keys that only some kinds of design know.
KEYS_OF = {
    "central_composite": {"alpha", "cube", "blocks", "cube_blocks"},
    "box_behnken": {"blocks"},
    "full_factorial": {"levels"},
    "latin_hypercube": {"runs"},
    "sobol": {"runs"},
}


class Design(Strict):
    """Which runs are made, and in which order.

    ``centre_replicates``: 6 for central composite and Box-Behnken designs unless given, else none. ``blocks``:
    orthogonal blocks, the cube in ``cube_blocks`` of them. ``levels`` of a full factorial, ``runs`` of a Latin
    hypercube or Sobol sequence. A run's seed is ``seed`` plus its place in the standard order, whatever ``order``.
    """

    kind: Kind = "central_composite"
    alpha: Alpha | Annotated[float, Field(gt=0.0, le=10.0)] = "rotatable"
    cube: Literal["full", "resolution_v"] = "full"
    centre_replicates: Annotated[int, Field(ge=0, le=100)] | None = None
    blocks: bool = False
    cube_blocks: Literal[1, 2, 4] = 1
    levels: Annotated[int, Field(ge=2, le=100)] = 3
    runs: Annotated[int, Field(ge=2, le=10000)] = 60
    order: Literal["standard", "random"] = "standard"
    seed: Annotated[int, Field(ge=0)] = 1

    @property
    def centres(self) -> int:
        """Number of centre points."""
        if self.centre_replicates is not None:
            return self.centre_replicates
        return 6 if self.kind in ("central_composite", "box_behnken") else 0

    @model_validator(mode="after")
    def _keys_belong_to_the_kind(self) -> Self:
        alien = set().union(*KEYS_OF.values()) - KEYS_OF[self.kind]
        faults = [
            f"{key}: kind = {self.kind!r} has no such key; remove it or choose another kind"
            for key in type(self).model_fields
            if key in alien & self.model_fields_set
        ]
        if self.cube_blocks > 1 and not self.blocks:
            faults.append(f"cube_blocks = {self.cube_blocks}: needs blocks; write blocks = true beside it")
        return or_refuse(self, faults)
