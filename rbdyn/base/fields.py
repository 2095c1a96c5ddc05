"""Number types and helpers of input tables."""

import math
from collections.abc import Iterable
from typing import Annotated, Any, Generic, TypeVar, cast

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
Number = Annotated[float, Field(ge=-LARGEST, le=LARGEST)]
# A figure may come from any table, in any unit: its fourth power does not overflow.
Figure = Annotated[float, Field(ge=-1e60, le=1e60)]
Positive = Annotated[float, Field(gt=0.0, le=LARGEST), NotVanishing]
NonNegative = Annotated[float, Field(ge=0.0, le=LARGEST)]
Share = Annotated[float, Field(gt=0.0, le=1.0), NotVanishing]


N = TypeVar("N")
RPM = math.pi / 30.0  # [rad/s]
TO_SI = {"mm": 1e-3, "um": 1e-6, "g": 1e-3, "g_mm": 1e-6, "kg_mm2": 1e-6, "MPa": 1e6, "mrad": 1e-3}
TO_SI |= {"deg": math.pi / 180.0, "rpm": RPM}


class InSI(Generic[N]):
    """SI value of a key that carries its unit: ``width = SI("mm")`` is ``width_mm`` in metres; None and lists as they are."""

    def __init__(self, unit: str) -> None:
        self.unit = unit

    def __set_name__(self, owner: type, name: str) -> None:
        self.key = f"{name}_{self.unit}"

    def __get__(self, table: Any, owner: type) -> N:
        def converted(value: Any) -> Any:
            return [converted(v) for v in value] if isinstance(value, list) else value and value * TO_SI[self.unit]

        return cast(N, converted(getattr(table, self.key)))


SI, OptionalSI = InSI[float], InSI[float | None]


def or_refuse(table: Any, faults: Iterable[str]) -> Any:
    """The table, or a ValueError with all its faults, one a line."""
    if lines := "\n".join(faults):
        raise ValueError(lines)
    return table


def no_power_of_two(name: str, count: int) -> list[str]:
    """The fault of a number that is no power of two; none of one that is."""
    return [f"{name}{count}: no power of two; take {2 ** (count.bit_length() - 1)}"] if count & (count - 1) else []
