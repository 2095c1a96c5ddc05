"""Running conditions: speeds, loads, how they change over time, and the support of the outer ring."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Annotated, Literal

from pydantic import Field

from rbdyn.base.faults import Consistent, Strict
from rbdyn.base.fields import LIGHTEST_RING_KG, SI, InSI, NonNegative, Positive
from rbdyn.base.words import counted

Speed = Annotated[float, Field(ge=-1e6, le=1e6)]
Load = Annotated[float, Field(ge=0.0, le=1e7)]
SLOWEST_RPM = 0.1


class Schedule(Consistent):
    """Inner speed and radial load over time; before the first and after the last point values stay."""

    time_s: Annotated[list[NonNegative], Field(min_length=1)]
    """Times of the points, from the start of the run, the discarded turns included."""
    inner_speed_rpm: list[Speed] | None = None
    """Speed of the inner ring at each time."""
    radial_load_N: list[Load] | None = None  # noqa: N815
    """Radial load at each time."""
    shape: Literal["linear", "smooth", "step"] = "smooth"
    """"linear" and "smooth" (half cosines) run from point to point; "step" holds each value until the next time."""
    inner_speed = InSI[list[float] | None]("rpm")

    def faults(self) -> Iterator[str]:
        times = self.time_s
        for i, (a, b) in enumerate(pairwise(times)):
            if b <= a:
                yield (
                    f"operation.schedule.time_s: times must rise, but {b:g} s (point {i + 2}) follows {a:g} s; sort "
                    "them"
                )
        for key in ("inner_speed_rpm", "radial_load_N"):
            values = getattr(self, key)
            if values is not None and len(values) != len(times):
                yield f"operation.schedule.{key}: {counted(len(values), 'value')} for {counted(len(times), 'time')}; give one a time"
        if self.inner_speed_rpm is None and self.radial_load_N is None:
            yield "operation.schedule: schedules nothing; give inner_speed_rpm or radial_load_N"


class Operation(Consistent):
    """Running conditions. The radial load acts on the inner ring along x.

    Shaft turns, in which runs are counted, are those at ``inner_speed_rpm`` (or ``outer_speed_rpm`` where the inner
    ring stands), also where a schedule changes the speed.
    """

    inner_speed_rpm: Speed
    """Speed of the inner ring; negative turns clockwise."""
    radial_load_N: Load  # noqa: N815
    """Load on the inner ring along x."""
    outer_speed_rpm: Speed = 0.0
    """Speed of the outer ring."""
    rotating_load_N: Load = 0.0  # noqa: N815
    """Load that turns with the inner ring."""
    unbalance_g_mm: NonNegative = 0.0
    """Unbalance of the shaft; its force grows with the square of the speed."""
    gravity_m_s2: NonNegative = 0.0
    """Acceleration of gravity; off unless given, for weight is small compared with centrifugal forces. 9.81 where it counts.
    """
    gravity_direction_deg: float = 0.0
    """Direction of gravity, from that of the load."""
    schedule: Schedule | None = None
    """Inner speed and radial load over time, instead of constant ones."""
    unbalance, gravity_direction = SI("g_mm"), SI("deg")

    def faults(self) -> Iterator[str]:
        if max(abs(self.inner_speed_rpm), abs(self.outer_speed_rpm)) < SLOWEST_RPM:
            yield (
                f"operation.inner_speed_rpm = {self.inner_speed_rpm:g}: a run is counted in shaft turns; give at "
                f"least {SLOWEST_RPM:g}, or turn the outer ring"
            )

    @property
    def speeds(self) -> tuple[float, float]:
        """Nominal speeds of inner and outer ring [rad/s]."""
        return self.inner_speed_rpm * math.pi / 30.0, self.outer_speed_rpm * math.pi / 30.0

    @property
    def fastest_inner_speed(self) -> float:
        """Largest inner speed of the schedule, or the nominal one, either way round [rad/s]."""
        speeds = (self.schedule.inner_speed_rpm if self.schedule else None) or [self.inner_speed_rpm]
        return max(abs(speed) for speed in speeds) * math.pi / 30.0

    @property
    def largest_load_N(self) -> float:  # noqa: N802
        """Largest load along x at any time, with the rotating load in line [N]."""
        scheduled = (self.schedule.radial_load_N if self.schedule else None) or [self.radial_load_N]
        fastest = self.fastest_inner_speed
        return max(scheduled) + self.rotating_load_N + self.unbalance * fastest**2

    @property
    def turn_s(self) -> float:
        """Duration of one shaft turn [s]."""
        inner, outer = abs(self.inner_speed_rpm), abs(self.outer_speed_rpm)
        return 60.0 / (inner if inner >= SLOWEST_RPM else outer)


class Support(Strict):
    """Flexible, damped support of the outer ring: a squirrel cage (1e7 to 1e8 N/m) with a squeeze film (1e3 to 1e4 N s/m)."""

    stiffness_N_m: Positive  # noqa: N815
    """Stiffness of the outer ring's support: 1e7 to 1e8 N/m for a squirrel cage."""
    damping_N_s_m: NonNegative  # noqa: N815
    """Damping of the outer ring's support: 1e3 to 1e4 N s/m for a squeeze film."""
    outer_ring_mass_kg: Annotated[float, Field(ge=LIGHTEST_RING_KG, le=1e5)] = 0.5
    """Outer ring with what moves with it."""
