"""Limits of running accuracy by tolerance class of radial ball bearings (ISO 492); ``tolerance_classes.csv`` tells the sources."""

from dataclasses import dataclass
from typing import Literal, get_args

from rbdyn.faults import MethodError
from rbdyn.properties import table

ToleranceClass = Literal["P2", "P4", "P5", "P6", "normal"]


@dataclass(frozen=True)
class RunningAccuracy:
    """Largest permitted runouts [m]; None where no source was found or the class sets none.

    ``radial``: K_ia, of the assembled bearing's inner ring; ``face``: S_d, of its side face with the bore; ``axial``:
    S_ia, of the assembled bearing's inner ring; ``outer_radial``: K_ea, of the assembled bearing's outer ring.
    """

    radial: float
    face: float | None
    axial: float | None
    outer_radial: float | None


def running_accuracy(
    tolerance_class: ToleranceClass, bore: float, outside_diameter: float | None = None
) -> RunningAccuracy:
    """Limits of a class for a bore and, where K_ea is wanted, an outside diameter [m].

    Raises MethodError for a class or a bore that the tables do not hold.
    """
    if tolerance_class not in get_args(ToleranceClass):
        known = ", ".join(get_args(ToleranceClass))
        raise MethodError(f"tolerance class {tolerance_class!r} is not known; choose one of {known}")
    row = _row(tolerance_class, "bore", 1e3 * bore)
    if row is None:
        held = _rows(tolerance_class, "bore")
        reach = f"above {held[0]['above']} mm and up to {held[-1]['up_to']} mm"
        raise MethodError(f"a bore of {1e3 * bore:g} mm: class {tolerance_class} is held here {reach}")
    outer = None if outside_diameter is None else _row(tolerance_class, "outside", 1e3 * outside_diameter)
    limits = (*(row[name] for name in ("K_ia", "S_d", "S_ia")), outer["K_ea"] if outer else "")
    return RunningAccuracy(*(1e-6 * float(limit) if limit else None for limit in limits))  # type: ignore[arg-type]


def _rows(tolerance_class: str, of: str) -> list[dict[str, str]]:
    return [row for row in table("tolerance_classes") if (row["class"], row["of"]) == (tolerance_class, of)]


def _row(tolerance_class: str, of: str, millimetres: float) -> dict[str, str] | None:
    """The row of a class for a bore, or an outside diameter."""
    rows = _rows(tolerance_class, of)
    if not rows or millimetres <= float(rows[0]["above"]):
        return None
    return next((row for row in rows if millimetres <= float(row["up_to"]) * (1.0 + 1e-12)), None)
