"""How a bearing is mounted: fits, temperatures, shaft and housing."""

from collections.abc import Iterator
from typing import Annotated, Protocol

from pydantic import Field

from rbdyn.base.faults import Consistent
from rbdyn.base.fields import SI, NonNegative, Positive
from rbdyn.scene.bearing import CustomMaterial, MaterialName

Celsius = Annotated[float, Field(ge=-200.0, le=1000.0)]
# Beyond this share of its diameter a fit is a slip of the unit: a heavy press fit has a thousandth.
LARGEST_FIT = 0.005


class Raceways(Protocol):
    """A bearing that can be mounted: of rollers or of balls."""

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Diameters of inner and outer raceway where the rolling elements touch."""


def raceway_radii(bearing: Raceways) -> tuple[float, float]:
    """Radii of inner and outer raceway where the rolling elements touch [m]."""
    inner, outer = bearing.raceway_diameters_mm
    return 0.5e-3 * inner, 0.5e-3 * outer


class Mounting(Consistent):
    """Fits, temperatures, shaft and housing. With this table, bearing.radial_clearance_mm is that of the loose parts, and the
    clearances of the cage are those of its drawing: fits, heat and rotation change all of them.

    Each temperature is that of a whole part.
    """

    bore_mm: Positive
    """Bore of the inner ring."""
    outside_diameter_mm: Positive
    """Outside diameter of the outer ring."""
    shaft_bore_mm: NonNegative = 0.0
    """Bore of the shaft; 0 is a solid one."""
    housing_diameter_mm: Positive
    """Outer diameter of the housing."""
    inner_interference_um: float = 0.0
    """Diametral interference of inner ring and shaft at the reference temperature; negative is loose."""
    outer_interference_um: float = 0.0
    """Diametral interference of outer ring and housing at the reference temperature; negative is loose."""
    reference_temperature_C: Celsius = 20.0  # noqa: N815
    """Temperature of the drawing, at which diameters, interferences and clearance were measured."""
    inner_ring_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the inner ring; the reference temperature where left out."""
    outer_ring_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the outer ring; the reference temperature where left out."""
    roller_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of rollers or balls; the mean of the rings where left out."""
    cage_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the cage; where left out the mean of the rollers and of the ring that guides it, that of the rollers
    where they guide it. Of roller bearings."""
    shaft_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the shaft; that of the inner ring where left out."""
    housing_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the housing; that of the outer ring where left out."""
    shaft_material: MaterialName | CustomMaterial = "bearing_steel"
    """Material of the shaft."""
    housing_material: MaterialName | CustomMaterial = "bearing_steel"
    """Material of the housing."""
    rotation: bool = True
    """Whether rotation widens the rings and the cage."""

    bore, outside_diameter, shaft_bore, housing_diameter = SI("mm"), SI("mm"), SI("mm"), SI("mm")
    inner_interference, outer_interference = SI("um"), SI("um")

    def faults(self) -> Iterator[str]:
        if self.shaft_bore_mm >= self.bore_mm:
            yield (
                f"mounting.shaft_bore_mm = {self.shaft_bore_mm:g}: leaves no shaft in a bearing bore of "
                f"{self.bore_mm:g} mm; make it smaller, 0 for a solid shaft"
            )
        if self.outside_diameter_mm <= self.bore_mm:
            what = f"mounting.outside_diameter_mm = {self.outside_diameter_mm:g}"
            yield f"{what}: not above the bore of {self.bore_mm:g} mm; make it larger"
        if self.housing_diameter_mm <= self.outside_diameter_mm:
            what = f"mounting.housing_diameter_mm = {self.housing_diameter_mm:g}"
            yield f"{what}: leaves no housing around a bearing of {self.outside_diameter_mm:g} mm; make it larger"
        for key, diameter in (
            ("inner_interference_um", self.bore_mm),
            ("outer_interference_um", self.outside_diameter_mm),
        ):
            interference = getattr(self, key)
            if abs(interference) > LARGEST_FIT * diameter * 1e3:
                what = f"mounting.{key} = {interference:g}: out of proportion to a fit of {diameter:g} mm"
                yield f"{what}; give micrometres, at most {LARGEST_FIT * diameter * 1e3:g}"


def misfits(mounting: Mounting, bearing: Raceways) -> Iterator[str]:
    """One sentence for each way in which the mounting does not suit the bearing."""
    inner, outer = bearing.raceway_diameters_mm
    if mounting.bore_mm >= inner:
        what = f"mounting.bore_mm = {mounting.bore_mm:g}: leaves no inner ring under a raceway of {inner:g} mm"
        yield f"{what}; make it smaller"
    if mounting.outside_diameter_mm <= outer:
        what = f"mounting.outside_diameter_mm = {mounting.outside_diameter_mm:g}"
        yield f"{what}: leaves no outer ring over a raceway of {outer:g} mm; make it larger"
