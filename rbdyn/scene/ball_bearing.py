"""Drawing of a ball bearing: its row of balls, or two rows with a ring between."""

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from rbdyn.faults import Consistent, Strict
from rbdyn.fields import SI, OptionalSI, Positive
from rbdyn.scene.operation import Speed

# How far a contact angle and a clearance that are both given may differ before they contradict each other.
AGREED_DEG = 0.2

GrooveFactor = Annotated[float, Field(gt=0.5, le=1.0)]


class BallRow(Consistent):
    """Geometry of one row of balls. Of contact angle and clearance one is given, or both that agree."""

    balls: Annotated[int, Field(ge=3, le=500)]
    """Number of balls."""
    ball_diameter_mm: Annotated[float, Field(ge=0.1, le=500.0)]
    """Diameter of a ball."""
    pitch_diameter_mm: Annotated[float, Field(ge=1.0, le=10000.0)]
    """Diameter of the circle through the balls' centres."""
    inner_groove_factor: GrooveFactor
    """Radius of the inner groove over the ball's diameter: 0.515 to 0.53 in catalogue bearings."""
    outer_groove_factor: GrooveFactor
    """Radius of the outer groove over the ball's diameter: 0.515 to 0.53 in catalogue bearings."""
    contact_angle_deg: Annotated[float, Field(ge=0.0, lt=90.0)] | None = None
    """Unloaded contact angle a_0; follows from radial_clearance_mm where left out: cos a_0 = 1 - P_d/(2 B), B = (f_i +
    f_o - 1) D."""
    radial_clearance_mm: Annotated[float, Field(ge=-2.0, le=5.0)] | None = None
    """Diametral clearance P_d; follows from contact_angle_deg where left out. Negative is an interference, with a
    contact angle of 0."""
    clearance_change_um: Annotated[float, Field(ge=-2000.0, le=2000.0)] = 0.0
    """What mounting changes of the diametral clearance after the contact angle was measured; negative takes clearance
    away."""
    dynamic_capacity_N: Positive | None = None  # noqa: N815
    """Basic dynamic capacity of the catalogue; by ISO 281 from the dimensions where left out."""
    static_capacity_N: Positive | None = None  # noqa: N815
    """Load at which the most loaded ball has a pressure of 4200 MPa (ISO 76); by Hertz from the dimensions where left
    out."""
    bore_mm: Positive | None = None
    """Bore of the inner ring; only for the growth of rotating rings."""
    outside_diameter_mm: Positive | None = None
    """Outside diameter of the outer ring; only for the growth of rotating rings."""

    ball_diameter, pitch_diameter, groove_centre_distance = SI("mm"), SI("mm"), SI("mm")
    radial_clearance, bore, outside_diameter = OptionalSI("mm"), OptionalSI("mm"), OptionalSI("mm")

    def faults(self) -> Iterator[str]:
        chord = self.pitch_diameter_mm * math.sin(math.pi / self.balls)
        if chord <= self.ball_diameter_mm:
            circle = f"a pitch circle of {self.pitch_diameter_mm:g} mm, where each has {chord:.4g} mm"
            what = f"balls = {self.balls}: balls of {self.ball_diameter_mm:g} mm do not fit on {circle}"
            yield f"{what}; take fewer or smaller ones"
        if self.ball_diameter_mm >= self.pitch_diameter_mm:
            circle = f"a pitch circle of {self.pitch_diameter_mm:g} mm"
            yield f"ball_diameter_mm = {self.ball_diameter_mm:g}: leaves no inner raceway on {circle}; make the ball smaller"
        # Only a contact angle that is known tells where the races are.
        yield from self._clearance_faults() or self._ring_faults()

    def _clearance_faults(self) -> list[str]:
        angle, clearance = self.contact_angle_deg, self.radial_clearance_mm
        if angle is None and clearance is None:
            return ["contact_angle_deg: missing; give it or radial_clearance_mm"]
        if clearance is None:
            return []
        gap = self.groove_centre_distance_mm
        if clearance >= 2.0 * gap:
            what = f"radial_clearance_mm = {clearance:g}: grooves with centres {gap:.4g} mm apart"
            return [f"{what} cannot hold a ball with that much; make it less than {2.0 * gap:.4g}"]
        if angle is None:
            return []
        implied = math.degrees(math.acos(min(1.0 - clearance / (2.0 * gap), 1.0)))
        if abs(implied - angle) > AGREED_DEG:
            clearance_of_angle = 2.0 * gap * (1.0 - math.cos(math.radians(angle)))
            what = f"contact_angle_deg = {angle:g} and radial_clearance_mm = {clearance:g} contradict each other"
            why = f"that clearance gives {implied:.4g} deg, that angle {clearance_of_angle:.4g} mm"
            return [f"{what}: {why}; leave one out, and give what mounting changes as clearance_change_um"]
        return []

    def _ring_faults(self) -> Iterator[str]:
        reach = self.ball_diameter_mm * math.cos(self.contact_angle)
        if self.bore_mm is not None and self.bore_mm >= self.pitch_diameter_mm - reach:
            race = f"a raceway of {self.pitch_diameter_mm - reach:.4g} mm"
            yield f"bore_mm = {self.bore_mm:g}: leaves no inner ring under {race}; make it smaller"
        if self.outside_diameter_mm is not None and self.outside_diameter_mm <= self.pitch_diameter_mm + reach:
            race = f"a raceway of {self.pitch_diameter_mm + reach:.4g} mm"
            yield f"outside_diameter_mm = {self.outside_diameter_mm:g}: leaves no outer ring over {race}; make it larger"

    @property
    def groove_centre_distance_mm(self) -> float:
        """B = (f_i + f_o - 1) D: distance of the groove centres where a ball just touches both [mm]."""
        return (self.inner_groove_factor + self.outer_groove_factor - 1.0) * self.ball_diameter_mm

    @property
    def groove_factors(self) -> tuple[float, float]:
        """Of the inner and the outer groove."""
        return self.inner_groove_factor, self.outer_groove_factor

    @property
    def contact_angle(self) -> float:
        """Unloaded contact angle [rad], given or from the clearance; 0 for an interference."""
        if self.radial_clearance_mm is None:
            assert self.contact_angle_deg is not None
            return math.radians(self.contact_angle_deg)
        return math.acos(min(1.0 - self.radial_clearance_mm / (2.0 * self.groove_centre_distance_mm), 1.0))

    @property
    def gamma(self) -> float:
        """Ball over pitch diameter, in the plane of the unloaded contacts: D cos a_0/d_m."""
        return self.ball_diameter_mm * math.cos(self.contact_angle) / self.pitch_diameter_mm

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Circles on which balls touch both races at the unloaded contact angle."""
        reach = self.ball_diameter_mm * math.cos(self.contact_angle)
        return self.pitch_diameter_mm - reach, self.pitch_diameter_mm + reach

    @property
    def interference_m(self) -> float:
        """What the inner groove is pushed outward by interference and mounting, radially [m]; negative with clearance."""
        given = self.radial_clearance_mm or 0.0
        return 0.5e-3 * max(-given, 0.0) - 0.5e-6 * self.clearance_change_um


class BallBearing(BallRow):
    """A single row: angular contact or deep groove."""

    kind: Literal["angular_contact_ball", "deep_groove_ball"]
    """Kind of bearing."""


class MiddleRing(Strict):
    """The ring between the rows of a double-decker bearing: it floats, and only friction turns it."""

    speed_rpm: Speed | None = None
    """Speed of the middle ring, where it is known; otherwise by speed_split."""
    speed_split: Literal["oil", "torque_balance"] = "oil"
    """What turns the middle ring. "oil": rows of equal oil friction (Hu et al., eq 13); "torque_balance": oil and load
    after Palmgren; needs [lubricant]."""
    inner_oil_factor: Positive = 3.3
    """Palmgren's f0 of the inner row: oil mist 1.7, grease 2, oil bath 3.3, oil jet 6.6 as commonly cited."""
    outer_oil_factor: Positive = 3.3
    """Palmgren's f0 of the outer row."""
    tilt: Literal["free", "fixed"] | None = None
    """fixed: the middle ring stays square to the outer ring; as operation.tilt where left out."""
    axial_offset_mm: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 0.0
    """Axial distance of the inner row's ball plane from the outer row's, the bearing unloaded."""
    speed, axial_offset = OptionalSI("rpm"), SI("mm")


class DoubleDecker(Consistent):
    """Two rows one inside the other; the ring between them floats."""

    kind: Literal["double_decker_ball"]
    """Kind of bearing."""
    inner: BallRow
    """The row on the inner ring."""
    outer: BallRow
    """The row in the outer ring."""
    middle: MiddleRing = MiddleRing()
    """The ring between the rows."""

    def faults(self) -> Iterator[str]:
        below, above = self.inner.raceway_diameters_mm[1], self.outer.raceway_diameters_mm[0]
        if not below < above:
            why = f"leaves no middle ring between raceways of {below:.4g} and {above:.4g} mm"
            mend = "make it larger, or the inner row smaller"
            yield f"bearing.outer.pitch_diameter_mm = {self.outer.pitch_diameter_mm:g}: {why}; {mend}"

    @property
    def pitch_ratio(self) -> float:
        """Pitch circle of the outer row over that of the inner one."""
        return self.outer.pitch_diameter_mm / self.inner.pitch_diameter_mm

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Race of the inner ring and race of the outer ring."""
        return self.inner.raceway_diameters_mm[0], self.outer.raceway_diameters_mm[1]
