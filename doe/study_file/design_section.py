"""Factors and the design of STUDY.toml."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from rbdyn.faults import Consistent
from rbdyn.fields import Number, Positive

# A name that heads a column of a table: one field whoever writes or reads it.
Name = Annotated[str, Field(max_length=100, pattern=r"""^[^\s,;"'\p{C}]([^,;"'\p{C}]*[^\s,;"'\p{C}])?$""")]
# Steps beside a value, or resolutions within a step, that are finer than this are lost in rounding.
FINEST = 1e-9


class Factor(Consistent):
    """A factor: its name, its key in the scene, its values."""

    name: Name
    """Name of the factor in tables and messages."""
    key: Annotated[str, Field(min_length=3)] = ""
    """Its key in the scene, such as cage.pocket_clearance_mm; needed beside [scene]."""
    centre: Number
    """Value at coded 0."""
    step: Positive
    """Change of the value per coded unit."""
    resolution: Positive | None = None
    """Smallest step that a drawing makes, to which the pick is rounded; not rounded where left out."""
    tolerance: Positive | None = None
    """Half width of what manufacture makes of it."""
    whole: bool = False
    """Whether only whole numbers are made, such as rollers; runs and pick are rounded to them."""
    allowed: Annotated[list[Number], Field(min_length=2, max_length=2)] | None = None
    """Ends as far as an adaptive search may go beyond the region of the design; not at all where left out."""

    def faults(self) -> Iterator[str]:
        if self.step < FINEST * abs(self.centre):
            yield f"step = {self.step:g}: is lost in rounding beside centre = {self.centre:g}; widen it"
        if self.resolution is not None and self.resolution < FINEST * self.step:
            steps = f"makes more than {1.0 / FINEST:g} steps of step = {self.step:g}"
            yield f"resolution = {self.resolution:g}: {steps}; coarsen it"
        if self.whole and self.resolution is not None:
            yield f"resolution = {self.resolution:g}: whole = true has none but 1; leave it out"
        if self.whole and self.tolerance is not None:
            yield f"tolerance = {self.tolerance:g}: whole = true has none; leave it out"
        if self.whole and self.step < 1.0:
            yield f"step = {self.step:g}: is less than a whole number; widen it"

    @property
    def finest(self) -> float | None:
        """Smallest step that is made."""
        return 1.0 if self.whole else self.resolution


class Category(Consistent):
    """A factor without numbers, which only the adaptive search changes; a whole design is made at each of its values."""

    name: Name
    """Name of the factor in tables and messages."""
    key: Annotated[str, Field(min_length=3)]
    """Its key in the scene, such as cage.guidance."""
    categories: Annotated[list[str | bool], Field(min_length=2, max_length=8)]
    """Values of the key; the first is the baseline's."""
    inactive: dict[str, list[str]] = {}
    """By value, the names of factors that mean nothing there, such as {roller = ["guide_clearance_mm"]}: their keys stay as
    the scene has them."""

    def inactive_at(self, place: int) -> list[str]:
        """Names of the factors that mean nothing at the value in this place."""
        return self.inactive.get(_in_toml(self.categories[place]), [])

    def faults(self) -> Iterator[str]:
        values = [_in_toml(each) for each in self.categories]
        mend, alien = f"write one of {', '.join(values)}", [name for name in self.inactive if name not in values]
        yield from (f"inactive.{name}: is none of the categories; {mend}" for name in alien)
        if len(self.categories) > len({*map(str, self.categories)}):
            yield f"categories = {self.categories}: name each value once"


def _in_toml(value: str | bool) -> str:
    return value if isinstance(value, str) else str(value).lower()


Kind = Literal[
    "central_composite", "box_behnken", "full_factorial", "latin_hypercube", "sobol", "definitive_screening",
    "d_optimal", "i_optimal",
]  # fmt: skip
Alpha = Literal["rotatable", "spherical", "orthogonal_blocks", "orthogonal_columns", "face_centred", "inscribed"]

# Keys that only some kinds of design know.
KEYS_OF = {
    "central_composite": {"alpha", "cube", "blocks", "cube_blocks"},
    "box_behnken": {"blocks"},
    "full_factorial": {"levels"},
    "latin_hypercube": {"runs"},
    "sobol": {"runs"},
    "definitive_screening": set[str](),
    "d_optimal": {"runs", "augment"},
    "i_optimal": {"runs", "augment"},
}
# Runs at the centre unless told.
CENTRES = {"central_composite": 6, "box_behnken": 6, "definitive_screening": 1}


class Design(Consistent):
    """Which runs are made, and in which order. Optimal ones are so for the terms of all response models."""

    kind: Kind = "central_composite"
    """Kind of design."""
    alpha: Alpha | Annotated[float, Field(gt=0.0, le=10.0)] = "rotatable"
    """Distance of the star points of a central composite design in coded units, by a rule or as a number."""
    cube: Literal["full", "resolution_v"] = "full"
    """Cube of a central composite design: all corners, or a fraction of resolution V."""
    centre_replicates: Annotated[int, Field(ge=0, le=100)] | None = None
    """Runs at the centre: 6 for central composite and Box-Behnken designs where left out, 1 for definitive screening, else
    none."""
    blocks: bool = False
    """Whether the runs are made in orthogonal blocks."""
    cube_blocks: Literal[1, 2, 4] = 1
    """Blocks into which the cube is cut; needs blocks = true."""
    levels: Annotated[int, Field(ge=2, le=100)] = 3
    """Levels a factor of a full factorial."""
    runs: Annotated[int, Field(ge=2, le=10000)] = 60
    """Runs of a Latin hypercube or Sobol sequence; of an optimal design, which has no default, those beside runs that are
    given or at the centre."""
    augment: str | None = None
    """Table of runs that were made, beside the study: an optimal design keeps them as they are and adds its own, so that all
    together tell most. Runs that this study made in standard order with this seed are not simulated again in its folder."""
    order: Literal["standard", "random"] = "standard"
    """Order of the runs. A run's seed is seed plus its place in the standard order, whatever this is."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the design and of its runs."""

    @property
    def centres(self) -> int:
        """Number of centre points."""
        return CENTRES.get(self.kind, 0) if self.centre_replicates is None else self.centre_replicates

    def faults(self) -> Iterator[str]:
        alien = self.model_fields_set & set().union(*KEYS_OF.values()) - KEYS_OF[self.kind]
        mend = f"kind = {self.kind!r} has no such key; remove it or choose another kind"
        yield from (f"{key}: {mend}" for key in type(self).model_fields if key in alien)
        if self.kind in ("d_optimal", "i_optimal") and "runs" not in self.model_fields_set:
            yield f"runs: missing; kind = {self.kind!r} needs the number of runs to make"
        if self.cube_blocks > 1 and not self.blocks:
            yield f"cube_blocks = {self.cube_blocks}: needs blocks; write blocks = true beside it"
