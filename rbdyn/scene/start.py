"""Start of a cold machine: keys of ``[thermal.start]``, and their contradictions with oil, bearing and operating point."""

from collections.abc import Iterator
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field

from rbdyn.base.faults import Consistent, InputError, InSI, NonNegative, Positive, Strict
from rbdyn.base.words import counted
from rbdyn.scene.lubricant import THICKEST, Lubricant, OilCelsius
from rbdyn.scene.operation import SLOWEST_RPM, Load

if TYPE_CHECKING:
    from rbdyn.scene import Scene
    from rbdyn.thermal.start import Course

MOST_POINTS = 60
# Speed over the reference speed of a catalogue, above which a unit is wrong or the bearing is another one.
MOST_OF_REFERENCE = 2.0
# Longest schedule [s]: a week.
LONGEST = 7.0 * 24.0 * 3600.0
# Keys of [thermal.start] that state temperatures at the start.
ORIGINS = ("from_C", "from_parts_C", "from_point")
Pace = Annotated[float, Field(ge=0.0, le=1e6)]


class StartSchedule(Consistent):
    """Speed and load over time: linear between the points, constant after the last. A step takes two points a second apart."""

    time_s: Annotated[list[NonNegative], Field(min_length=1, max_length=MOST_POINTS)]
    """Times of the points from the start of the machine, the first 0."""
    speed_rpm: list[Pace] | None = None
    """Speed of the inner ring at each time, without a sign. Where the inner ring is at rest it is the speed of the outer ring.
    The other ring keeps the ratio of [operation]. Default: the speed of [operation]."""
    load_N: list[Load] | None = None  # noqa: N815
    """Radial load at each time. Default: the load of [operation]."""
    speed = InSI[list[float] | None]("rpm")

    def faults(self) -> Iterator[str]:
        times, name = self.time_s, "thermal.start.schedule"
        if times[0] != 0.0:
            yield f"{name}.time_s: begins at {times[0]:g} s; give the speed and load of the start at 0"
        for place, (before, after) in enumerate(pairwise(times), 2):
            if after <= before:
                yield f"{name}.time_s: times must rise, but {after:g} s (point {place}) follows {before:g} s; sort them"
        if times[-1] > LONGEST:
            yield f"{name}.time_s: ends after {times[-1]:g} s, more than a week ({LONGEST:g} s); give seconds"
        for key in ("speed_rpm", "load_N"):
            values = getattr(self, key)
            if values is not None and len(values) != len(times):
                yield (
                    f"{name}.{key}: {counted(len(values), 'value')} for {counted(len(times), 'time')}; give one value for each "
                    "time"
                )
        if self.speed_rpm is None and self.load_N is None:
            yield f"{name}: has neither speed nor load; give speed_rpm or load_N"
        elif self.speed_rpm is not None and len(self.speed_rpm) == len(times) and max(self.speed_rpm) < SLOWEST_RPM:
            yield f"{name}.speed_rpm: the machine stands still at every time; give a speed of at least {SLOWEST_RPM:g}"


class Start(Strict):
    """Warming of a cold machine: temperatures and clearances over time until they are steady. Rings warm before the housing, so
    clearances are often least after one to five minutes.

    The heat of rollers follows a few short simulations, at most ten, from which it is interpolated over temperature, speed and load;
    that of balls is SKF's friction at every moment.
    """

    from_C: OilCelsius | None = None  # noqa: N815
    """Temperature of all parts and of the oil at the start. Default: thermal.ambient_C."""
    from_parts_C: Annotated[list[OilCelsius], Field(min_length=6, max_length=6)] | None = None  # noqa: N815
    """Temperatures of oil, outer ring, inner ring, rollers, housing and shaft at the start, instead of from_C. For example,
    use the temperatures of a result at another operating point."""
    from_point: dict[str, Any] | None = None
    """Keys of the scene with their values at another operating point, such as {"operation.inner_speed_rpm" = 800}, instead of
    from_C. The machine begins with the steady temperatures of that point."""
    schedule: StartSchedule | None = None
    """Speed and load over time. Default: the operating point from the start on."""
    housing_widths: Positive = 1.7
    """Length of housing that warms with the bearing, in widths of the bearing: 1 to 3. The heavier the housing, the longer the
    inner ring stays warmer than the outer one."""
    shaft_widths: Positive = 2.2
    """Length of shaft that warms with the bearing, in widths of the bearing: 1 to 5."""

    @property
    def widths(self) -> tuple[float, float]:
        """Widths of the bearing over which housing and shaft count."""
        return self.housing_widths, self.shaft_widths

    def temperatures(self, ambient: float) -> list[float]:
        """Temperatures of the parts at the start [C], with ``ambient`` around the machine."""
        return self.from_parts_C or [ambient if self.from_C is None else self.from_C] * 6

    def course(self, speed: float, load: float) -> "Course":
        """Speed [rad/s] and load [N] over time: those of the schedule, else ``speed`` and ``load`` of the operating point."""
        import numpy as np

        from rbdyn.thermal.start import Course

        times = [0.0] if self.schedule is None else self.schedule.time_s
        speeds, loads = (None, None) if self.schedule is None else (self.schedule.speed, self.schedule.load_N)
        speeds, loads = speeds or [speed] * len(times), loads or [load] * len(times)
        return Course(*(np.array(column, dtype=np.float64) for column in (times, speeds, loads)))


def start_faults(
    start: Start | None, lubricant: Lubricant, ambient: float, ceiling: float, reference_rpm: float | None
) -> Iterator[str]:
    """Contradictions of a start with the oil and the reference speed of a catalogue, if any.

    ``ambient``: temperature around the machine; ``ceiling``: of the oil [C].
    """
    if start is None:
        return
    stated = [f"thermal.start.{key}" for key in ORIGINS if getattr(start, key) is not None]
    if len(stated) > 1:
        yield f"{stated[0]} and {stated[1]} both state the temperatures at the start; leave one out"
    cold, name = (ambient, "thermal.ambient_C") if start.from_C is None else (start.from_C, "thermal.start.from_C")
    if start.from_parts_C is not None:
        cold, name = start.from_parts_C[0], "thermal.start.from_parts_C, oil"
    oil = lubricant.at(cold)
    thickness = 1e6 * oil.viscosity / oil.density
    if cold >= ceiling:
        yield f"{name} = {cold:g}: not below the ceiling of the oil, {ceiling:g} C (thermal.oil_ceiling_C); start colder"
    elif thickness > THICKEST:
        yield (
            f"{name} = {cold:g}: the oil has {thickness:.2g} mm2/s there, above the {THICKEST:g} of its law; start warmer or take a "
            "thinner oil"
        )
    fastest = max((start.schedule and start.schedule.speed_rpm) or [0.0])
    if reference_rpm is not None and fastest > MOST_OF_REFERENCE * reference_rpm:
        yield (
            f"thermal.start.schedule.speed_rpm: reaches {fastest:g}, above twice the reference speed of {reference_rpm:g} rpm; "
            "lower it or check its unit"
        )


def point_before(scene: "Scene") -> "Scene | None":
    """The scene at the operating point whose steady temperatures its machine has at the start; None without one. Raises InputError."""
    start = None if scene.thermal is None else scene.thermal.start
    if start is None or start.from_point is None:
        return None
    try:
        return scene.changed({"thermal.start": None, **start.from_point})
    except InputError as error:
        raise InputError([f"thermal.start.from_point: {fault}" for fault in error.faults]) from None
