"""Number types and helpers of input tables."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import AfterValidator, Field


def _not_vanishing(value: float) -> float:
    if value < SMALLEST:
        raise ValueError(f"must be at least {SMALLEST:g}; check the unit")
    return value


Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
# Wide enough for any unit in use, narrow enough that no product of them overflows.
SMALLEST, LARGEST = 1e-12, 1e12
# A ring for rollers of half a millimetre has 7 mg.
LIGHTEST_RING_KG = 1e-6
NotVanishing = AfterValidator(_not_vanishing)
Positive = Annotated[float, Field(gt=0.0, le=LARGEST), NotVanishing]
NonNegative = Annotated[float, Field(ge=0.0, le=LARGEST)]


def or_refuse(table: Any, faults: list[str]) -> Any:
    """The table, or a ValueError with all its faults, one a line."""
    if faults:
        raise ValueError("\n".join(faults))
    return table
