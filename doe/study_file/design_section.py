"""Factors and the design of STUDY.toml."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

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
    def _keys_belong_to_the_kind(self) -> Design:
        alien = set().union(*KEYS_OF.values()) - KEYS_OF[self.kind]
        faults = [
            f"{key}: kind = {self.kind!r} has no such key; remove it or choose another kind"
            for key in type(self).model_fields
            if key in alien & self.model_fields_set
        ]
        if self.cube_blocks > 1 and not self.blocks:
            faults.append(f"cube_blocks = {self.cube_blocks}: needs blocks; write blocks = true beside it")
        if faults:
            raise ValueError("\n".join(faults))
        return self
