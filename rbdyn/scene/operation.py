"""Operating conditions of roller and ball bearings: speeds and loads, support of the outer ring, mounting with fits and temperatures."""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Protocol

from pydantic import Field

from rbdyn.base.faults import LIGHTEST_RING_KG, SI, Consistent, InSI, NonNegative, OptionalSI, Positive, Sparse, Strict
from rbdyn.base.words import counted
from rbdyn.scene.bearing import CustomMaterial, MaterialName

Speed = Annotated[float, Field(ge=-1e6, le=1e6)]
Load = Annotated[float, Field(ge=0.0, le=1e7)]
SLOWEST_RPM = 0.1


class Schedule(Consistent):
    """Inner speed and radial load over time, constant before the first and after the last point."""

    time_s: Annotated[list[NonNegative], Field(min_length=1)]
    """Times of the points from the start of the run, discarded turns included."""
    inner_speed_rpm: list[Speed] | None = None
    """Speed of the inner ring at each time."""
    radial_load_N: list[Load] | None = None  # noqa: N815
    """Radial load at each time."""
    shape: Literal["linear", "smooth", "step"] = "smooth"
    """Shape between points: "linear", "smooth" (half cosines), or "step" (constant until the next time)."""
    inner_speed = InSI[list[float] | None]("rpm")

    def faults(self) -> Iterator[str]:
        columns = {"inner_speed_rpm": self.inner_speed_rpm, "radial_load_N": self.radial_load_N}
        yield from schedule_faults("operation.schedule", self.time_s, columns)


def schedule_faults(name: str, times: Sequence[float], columns: Mapping[str, Sequence[float] | None]) -> Iterator[str]:
    """Faults of the times [s] of a schedule and of its columns of speed and load, of which it needs one."""
    for place, (before, after) in enumerate(pairwise(times), 2):
        if after <= before:
            yield f"{name}.time_s: times must rise, but {after:g} s (point {place}) follows {before:g} s; sort them"
    for key, values in columns.items():
        if values is not None and len(values) != len(times):
            numbers = f"{counted(len(values), 'value')} for {counted(len(times), 'time')}"
            yield f"{name}.{key}: {numbers}; give one value for each time"
    if all(values is None for values in columns.values()):
        yield f"{name}: has neither speed nor load; give {' or '.join(columns)}"


class Operation(Consistent):
    """Operating conditions. The radial load acts on the inner ring along x.

    A shaft turn, the unit of a run's length, is one at ``inner_speed_rpm``, or at ``outer_speed_rpm`` where the inner ring stands
    still. A schedule does not change it.
    """

    inner_speed_rpm: Speed
    """Speed of the inner ring; negative is clockwise."""
    radial_load_N: Load  # noqa: N815
    """Load on the inner ring along x."""
    outer_speed_rpm: Speed = 0.0
    """Speed of the outer ring."""
    rotating_load_N: Load = 0.0  # noqa: N815
    """Load that rotates with the inner ring."""
    unbalance_g_mm: NonNegative = 0.0
    """Unbalance of the shaft; its force grows with the square of the speed."""
    gravity_m_s2: NonNegative = 0.0
    """Acceleration of gravity, 9.81 where it matters. Default: off, because weights are small compared with centrifugal
    forces."""
    gravity_direction_deg: float = 0.0
    """Direction of gravity, measured from the load. Use: a gear or a belt loads the bearing, not the weight."""
    schedule: Schedule | None = None
    """Inner speed and radial load over time, instead of constant values."""
    unbalance, gravity_direction = SI("g_mm"), SI("deg")

    def faults(self) -> Iterator[str]:
        if max(abs(self.inner_speed_rpm), abs(self.outer_speed_rpm)) < SLOWEST_RPM:
            yield (
                f"operation.inner_speed_rpm = {self.inner_speed_rpm:g}: a run needs shaft turns; give at least {SLOWEST_RPM:g}, or "
                "set operation.outer_speed_rpm"
            )

    @property
    def speeds_rpm(self) -> tuple[float, float]:
        """Nominal speeds of inner and outer ring [rpm]."""
        return self.inner_speed_rpm, self.outer_speed_rpm

    @property
    def speeds(self) -> tuple[float, float]:
        """Nominal speeds of inner and outer ring [rad/s]."""
        return self.inner_speed_rpm * math.pi / 30.0, self.outer_speed_rpm * math.pi / 30.0

    @property
    def fastest_inner_speed(self) -> float:
        """Largest inner speed of the schedule, or the nominal one, as a magnitude [rad/s]."""
        speeds = (self.schedule.inner_speed_rpm if self.schedule else None) or [self.inner_speed_rpm]
        return max(abs(speed) for speed in speeds) * math.pi / 30.0

    @property
    def largest_load_N(self) -> float:  # noqa: N802
        """Largest load along x at any time, with the rotating load in the same direction [N]."""
        scheduled = (self.schedule.radial_load_N if self.schedule else None) or [self.radial_load_N]
        return max(scheduled) + self.rotating_load_N + self.unbalance * self.fastest_inner_speed**2

    @property
    def turn_s(self) -> float:
        """Duration of one shaft turn [s]."""
        inner, outer = abs(self.inner_speed_rpm), abs(self.outer_speed_rpm)
        return 60.0 / (inner if inner >= SLOWEST_RPM else outer)


Force = Annotated[float, Field(ge=-1e8, le=1e8)]
Moment = Annotated[float, Field(ge=-1e7, le=1e7)]


class Prescribed(Strict):
    """Prescribed displacements of the inner ring; a displacement without a value follows from the load."""

    x_mm: Annotated[float, Field(ge=-10.0, le=10.0)] | None = None
    """Displacement along x, the direction of the radial load."""
    y_mm: Annotated[float, Field(ge=-10.0, le=10.0)] | None = None
    """Displacement along y."""
    z_mm: Annotated[float, Field(ge=-10.0, le=10.0)] | None = None
    """Axial displacement."""
    tilt_x_mrad: Annotated[float, Field(ge=-200.0, le=200.0)] | None = None
    """Tilt about x."""
    tilt_y_mrad: Annotated[float, Field(ge=-200.0, le=200.0)] | None = None
    """Tilt about y."""

    @property
    def values(self) -> tuple[float | None, ...]:
        """x, y, z, tilt x, tilt y in mm and mrad; None where the load decides."""
        return self.x_mm, self.y_mm, self.z_mm, self.tilt_x_mrad, self.tilt_y_mrad


# Order of the components of load and displacement.
COMPONENTS = ("x", "y", "z", "tilt_x", "tilt_y")


class BallOperation(Consistent):
    """Speeds, and loads on the inner ring against the outer ring; x is radial, z axial."""

    inner_speed_rpm: Speed = 0.0
    """Speed of the inner ring."""
    outer_speed_rpm: Speed = 0.0
    """Speed of the outer ring."""
    radial_load_N: Force | None = None  # noqa: N815
    """Load along x; instead of load_N."""
    axial_load_N: Force | None = None  # noqa: N815
    """Load along z, the axis; instead of load_N."""
    load_N: Annotated[list[Force], Field(min_length=3, max_length=3)] | None = None  # noqa: N815
    """Load along x, y, z."""
    moment_Nm: Annotated[list[Moment], Field(min_length=2, max_length=2)] | None = None  # noqa: N815
    """Moments about x and y."""
    tilt: Literal["free", "fixed"] = "fixed"
    """Whether the inner ring can tilt. fixed: the shaft keeps it at operation.prescribed.tilt_x_mrad and tilt_y_mrad (default
    0), like a shaft in two bearings. free: it tilts with the load. Effect: a free 7208 under 1000 N radial and 1500 N axial
    tilts by 3 mrad, which halves its life."""
    prescribed: Prescribed = Prescribed()
    """Prescribed displacements of the inner ring instead of loads."""
    preload_N: Force = 0.0  # noqa: N815
    """Axial force of a preload spring, added to the load."""
    preload_um: Annotated[float, Field(ge=-2000.0, le=2000.0)] | None = None
    """Axial displacement of the inner ring by nut and spacer after first contact, instead of preload_N."""
    inner_speed, outer_speed = SI("rpm"), SI("rpm")

    def faults(self) -> Iterator[str]:
        if self.load_N is not None and (self.radial_load_N is not None or self.axial_load_N is not None):
            yield (
                "operation.load_N and operation.radial_load_N or axial_load_N contradict each other: give the first or the others"
            )
        if self.moment_Nm is not None and self.tilt == "fixed" and any(self.moment_Nm):
            yield (
                f"operation.moment_Nm = {self.moment_Nm}: has no effect on a ring whose tilt is fixed; leave it out or set "
                "operation.tilt = 'free'"
            )
        if self.preload_um is not None:
            if self.preload_N:
                yield (
                    f"operation.preload_um = {self.preload_um:g} and operation.preload_N = {self.preload_N:g} contradict each "
                    "other: preload by displacement or by force"
                )
            if self.prescribed.z_mm is not None:
                yield (
                    f"operation.preload_um = {self.preload_um:g} and operation.prescribed.z_mm = {self.prescribed.z_mm:g} both "
                    "prescribe the axial displacement; leave one out"
                )
        for name, value, load in zip(COMPONENTS, self.displacements, (*self.load, *self.moment), strict=True):
            if value is None or load == 0.0 or (name == "z" and self.preload_um is not None):
                continue
            if self.tilt == "free" or not name.startswith("tilt"):
                yield (
                    f"operation.prescribed: the {name} displacement is prescribed, so the load of {load:g} along it has no effect; "
                    "leave one out"
                )

    @property
    def speeds(self) -> tuple[float, float]:
        """Speeds of inner and outer ring [rad/s]."""
        return self.inner_speed, self.outer_speed

    @property
    def load(self) -> tuple[float, float, float]:
        """Force on the inner ring, the preload by force included [N]."""
        x, y, z = self.load_N or (self.radial_load_N or 0.0, 0.0, self.axial_load_N or 0.0)
        return x, y, z + self.preload_N

    @property
    def moment(self) -> tuple[float, float]:
        """Moment on the inner ring about x and y [N m]."""
        x, y = self.moment_Nm or (0.0, 0.0)
        return x, y

    @property
    def displacements(self) -> tuple[float | None, ...]:
        """Prescribed displacements x, y, z [m] and tilts [rad]; None where the load decides."""
        x, y, z, tilt_x, tilt_y = self.prescribed.values
        if self.preload_um is not None:
            z = 1e-3 * self.preload_um
        if self.tilt == "fixed":
            tilt_x, tilt_y = tilt_x or 0.0, tilt_y or 0.0
        return tuple(None if value is None else 1e-3 * value for value in (x, y, z, tilt_x, tilt_y))


class Support(Strict):
    """Flexible, damped support of the outer ring: a squirrel cage (1e7 to 1e8 N/m) with a squeeze film (1e3 to 1e4 N s/m)."""

    stiffness_N_m: Positive  # noqa: N815
    """Stiffness of the outer ring's support: 1e7 to 1e8 N/m for a squirrel cage."""
    damping_N_s_m: NonNegative  # noqa: N815
    """Damping of the outer ring's support: 1e3 to 1e4 N s/m for a squeeze film."""
    outer_ring_mass_kg: Annotated[float, Field(ge=LIGHTEST_RING_KG, le=1e5)] = 0.5
    """Mass of the outer ring and of the parts that move with it."""


Celsius = Annotated[float, Field(ge=-200.0, le=1000.0)]
# Largest plausible interference as a share of the diameter: a heavy press fit has a thousandth.
LARGEST_FIT = 0.005


class Raceways(Protocol):
    """A roller or ball bearing that can be mounted."""

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Diameters of inner and outer raceway where the rolling elements touch [mm]."""


def raceway_radii(bearing: Raceways) -> tuple[float, float]:
    """Radii of inner and outer raceway where the rolling elements touch [m]."""
    inner, outer = bearing.raceway_diameters_mm
    return 0.5e-3 * inner, 0.5e-3 * outer


class Mounting(Consistent, Sparse):
    """Fits, temperatures, shaft and housing.

    With this table, bearing.radial_clearance_mm is the clearance before mounting and the clearances of the cage are those of
    its drawing. Fits, temperature and rotation change all of them. Each part has one temperature.
    """

    UNSAVED: ClassVar[Mapping[str, Any]] = {"width_mm": None}

    bore_mm: Positive
    """Bore of the inner ring."""
    outside_diameter_mm: Positive
    """Outside diameter of the outer ring."""
    width_mm: Positive | None = None
    """Width of the rings, through whose seats [thermal] removes heat. Default: from bearing.designation."""
    shaft_bore_mm: NonNegative = 0.0
    """Bore of the shaft; 0 is a solid shaft."""
    housing_diameter_mm: Positive
    """Outer diameter of the housing."""
    inner_interference_um: float = 0.0
    """Diametral interference of inner ring and shaft at the reference temperature; negative is a loose fit."""
    outer_interference_um: float = 0.0
    """Diametral interference of outer ring and housing at the reference temperature; negative is a loose fit."""
    reference_temperature_C: Celsius = 20.0  # noqa: N815
    """Temperature of the drawing, at which diameters, interferences and clearance hold. Default: as ISO 1. Use: parts
    measured at another temperature."""
    inner_ring_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the inner ring. Default: the reference temperature."""
    outer_ring_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the outer ring. Default: the reference temperature."""
    roller_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of rollers or balls. Default: the mean of the rings."""
    cage_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the cage of a roller bearing. Default: the mean of the rollers and the guiding ring, or the temperature
    of the rollers where they guide it."""
    shaft_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the shaft. Default: as the inner ring."""
    housing_temperature_C: Celsius | None = None  # noqa: N815
    """Temperature of the housing. Default: as the outer ring."""
    shaft_material: MaterialName | CustomMaterial = "bearing_steel"
    """Material of the shaft."""
    housing_material: MaterialName | CustomMaterial = "bearing_steel"
    """Material of the housing."""
    rotation: bool = True
    """Whether rotation widens the rings and the cage."""

    width = OptionalSI("mm")
    bore, outside_diameter, shaft_bore, housing_diameter = SI("mm"), SI("mm"), SI("mm"), SI("mm")
    inner_interference, outer_interference = SI("um"), SI("um")

    def faults(self) -> Iterator[str]:
        if self.shaft_bore_mm >= self.bore_mm:
            yield (
                f"mounting.shaft_bore_mm = {self.shaft_bore_mm:g}: leaves no shaft in a bearing bore of "
                f"{self.bore_mm:g} mm; make it smaller, 0 for a solid shaft"
            )
        if self.outside_diameter_mm <= self.bore_mm:
            yield (
                f"mounting.outside_diameter_mm = {self.outside_diameter_mm:g}: not above the bore of {self.bore_mm:g} mm; "
                "make it larger"
            )
        if self.housing_diameter_mm <= self.outside_diameter_mm:
            yield (
                f"mounting.housing_diameter_mm = {self.housing_diameter_mm:g}: leaves no housing around a bearing of "
                f"{self.outside_diameter_mm:g} mm; make it larger"
            )
        for key, diameter in (
            ("inner_interference_um", self.bore_mm),
            ("outer_interference_um", self.outside_diameter_mm),
        ):
            interference = getattr(self, key)
            if abs(interference) > LARGEST_FIT * diameter * 1e3:
                yield (
                    f"mounting.{key} = {interference:g}: out of proportion to a fit of {diameter:g} mm; give micrometres, at most "
                    f"{LARGEST_FIT * diameter * 1e3:g}"
                )


def misfits(mounting: Mounting, bearing: Raceways, element_width: float = 0.0) -> Iterator[str]:
    """One sentence for each contradiction of mounting and bearing, whose elements are ``element_width`` wide [mm]."""
    inner, outer = bearing.raceway_diameters_mm
    if mounting.bore_mm >= inner:
        yield f"mounting.bore_mm = {mounting.bore_mm:g}: leaves no inner ring under a raceway of {inner:g} mm; make it smaller"
    if mounting.outside_diameter_mm <= outer:
        yield (
            f"mounting.outside_diameter_mm = {mounting.outside_diameter_mm:g}: leaves no outer ring over a raceway of {outer:g} mm; "
            "make it larger"
        )
    if mounting.width_mm is not None and mounting.width_mm < element_width:
        yield (
            f"mounting.width_mm = {mounting.width_mm:g}: less than {element_width:g} mm of its rolling elements; give the width of the "
            "rings in mm"
        )
