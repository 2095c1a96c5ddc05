"""One validated scene of a ball bearing: single row or double-decker, its load, its model."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal, Self, cast

from pydantic import Field, model_validator

from rbdyn.faults import Strict
from rbdyn.fields import Positive, or_refuse
from rbdyn.materials import Material
from rbdyn.scene.ball_rings import ring_faults
from rbdyn.scene.bearing import CustomMaterial, MaterialName
from rbdyn.scene.form_errors import FormErrors, faults
from rbdyn.scene.lubricant import Lubricant
from rbdyn.scene.mounting import Mounting, material_of
from rbdyn.scene.operation import Speed
from rbdyn.scene.reading import SceneFile

BALL_KINDS = ("angular_contact_ball", "deep_groove_ball", "double_decker_ball")
# How far a contact angle and a clearance that are both given may differ before they contradict each other.
AGREED_DEG = 0.2

Force = Annotated[float, Field(ge=-1e8, le=1e8)]
Moment = Annotated[float, Field(ge=-1e7, le=1e7)]
GrooveFactor = Annotated[float, Field(gt=0.5, le=1.0)]


class BallRow(Strict):
    """Geometry of one row of balls.

    A groove factor is the groove's radius over the ball's diameter. Either the unloaded contact angle a_0 or the diametral
    clearance P_d is given, one follows from the other: cos a_0 = 1 - P_d/(2 B), B = (f_i + f_o - 1) D. A negative
    clearance, an interference, has a contact angle of 0.
    """

    balls: Annotated[int, Field(ge=3, le=500)]
    ball_diameter_mm: Annotated[float, Field(ge=0.1, le=500.0)]
    pitch_diameter_mm: Annotated[float, Field(ge=1.0, le=10000.0)]
    inner_groove_factor: GrooveFactor
    outer_groove_factor: GrooveFactor
    contact_angle_deg: Annotated[float, Field(ge=0.0, lt=90.0)] | None = None
    radial_clearance_mm: Annotated[float, Field(ge=-2.0, le=5.0)] | None = None
    # What mounting changes of the diametral clearance after the contact angle was measured; negative takes clearance away.
    clearance_change_um: Annotated[float, Field(ge=-2000.0, le=2000.0)] = 0.0
    # Basic dynamic capacity of the catalogue; by ISO 281 from the dimensions where left out.
    dynamic_capacity_N: Positive | None = None  # noqa: N815
    # Load at which the most loaded ball has a pressure of 4200 MPa (ISO 76); by Hertz from the dimensions where left out.
    static_capacity_N: Positive | None = None  # noqa: N815
    # Bore of the inner and outside diameter of the outer ring: only for the growth of rotating rings.
    bore_mm: Positive | None = None
    outside_diameter_mm: Positive | None = None

    @model_validator(mode="after")
    def _fits(self) -> BallRow:
        faults = []
        chord = self.pitch_diameter_mm * math.sin(math.pi / self.balls)
        if chord <= self.ball_diameter_mm:
            faults.append(
                f"balls = {self.balls}: balls of {self.ball_diameter_mm:g} mm do not fit on a pitch circle of "
                f"{self.pitch_diameter_mm:g} mm, where each has {chord:.4g} mm; take fewer or smaller ones"
            )
        if self.ball_diameter_mm >= self.pitch_diameter_mm:
            faults.append(
                f"ball_diameter_mm = {self.ball_diameter_mm:g}: leaves no inner raceway on a pitch circle of "
                f"{self.pitch_diameter_mm:g} mm; make the ball smaller"
            )
        # Only a contact angle that is known tells where the races are.
        return or_refuse(self, faults + (self._clearance_faults() or self._ring_faults()))

    def _clearance_faults(self) -> list[str]:
        angle, clearance = self.contact_angle_deg, self.radial_clearance_mm
        if angle is None and clearance is None:
            return ["contact_angle_deg: missing; give it or radial_clearance_mm"]
        if clearance is None:
            return []
        gap = self.groove_centre_distance_mm
        if clearance >= 2.0 * gap:
            return [
                f"radial_clearance_mm = {clearance:g}: grooves with centres {gap:.4g} mm apart cannot hold a ball with "
                f"that much; make it less than {2.0 * gap:.4g}"
            ]
        if angle is None:
            return []
        implied = math.degrees(math.acos(min(1.0 - clearance / (2.0 * gap), 1.0)))
        if abs(implied - angle) > AGREED_DEG:
            clearance_of_angle = 2.0 * gap * (1.0 - math.cos(math.radians(angle)))
            return [
                f"contact_angle_deg = {angle:g} and radial_clearance_mm = {clearance:g} contradict each other: that clearance "
                f"gives {implied:.4g} deg, that angle {clearance_of_angle:.4g} mm; leave one out, and give what mounting "
                "changes as clearance_change_um"
            ]
        return []

    def _ring_faults(self) -> list[str]:
        faults = []
        reach = self.ball_diameter_mm * math.cos(self.contact_angle)
        if self.bore_mm is not None and self.bore_mm >= self.pitch_diameter_mm - reach:
            faults.append(
                f"bore_mm = {self.bore_mm:g}: leaves no inner ring under a raceway of "
                f"{self.pitch_diameter_mm - reach:.4g} mm; make it smaller"
            )
        if self.outside_diameter_mm is not None and self.outside_diameter_mm <= self.pitch_diameter_mm + reach:
            faults.append(
                f"outside_diameter_mm = {self.outside_diameter_mm:g}: leaves no outer ring over a raceway of "
                f"{self.pitch_diameter_mm + reach:.4g} mm; make it larger"
            )
        return faults

    @property
    def groove_centre_distance_mm(self) -> float:
        """B = (f_i + f_o - 1) D: distance of the groove centres where a ball just touches both [mm]."""
        return (self.inner_groove_factor + self.outer_groove_factor - 1.0) * self.ball_diameter_mm

    @property
    def contact_angle(self) -> float:
        """Unloaded contact angle [rad], given or from the clearance; 0 for an interference."""
        if self.radial_clearance_mm is None:
            assert self.contact_angle_deg is not None
            return math.radians(self.contact_angle_deg)
        return math.acos(min(1.0 - self.radial_clearance_mm / (2.0 * self.groove_centre_distance_mm), 1.0))

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


class MiddleRing(Strict):
    """The ring between the rows of a double-decker bearing: it floats, and only friction turns it."""

    # Its speed, where it is known; otherwise by speed_split.
    speed_rpm: Speed | None = None
    # "oil": rows of equal oil friction (Hu et al., eq 13); "torque_balance": oil and load after Palmgren; needs [lubricant].
    speed_split: Literal["oil", "torque_balance"] = "oil"
    # Palmgren's f0 of each row: oil mist 1.7, grease 2, oil bath 3.3, oil jet 6.6 as commonly cited.
    inner_oil_factor: Positive = 3.3
    outer_oil_factor: Positive = 3.3
    # fixed: it stays square to the outer ring; as operation.tilt where left out.
    tilt: Literal["free", "fixed"] | None = None
    # Axial distance of the inner row's ball plane from the outer row's, the bearing unloaded.
    axial_offset_mm: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 0.0


class DoubleDecker(Strict):
    """Two rows one inside the other; the ring between them floats."""

    kind: Literal["double_decker_ball"]
    inner: BallRow
    outer: BallRow
    middle: MiddleRing = MiddleRing()

    @model_validator(mode="after")
    def _nests(self) -> DoubleDecker:
        below, above = self.inner.raceway_diameters_mm[1], self.outer.raceway_diameters_mm[0]
        if below < above:
            return self
        raise ValueError(
            f"bearing.outer.pitch_diameter_mm = {self.outer.pitch_diameter_mm:g}: leaves no middle ring between raceways of "
            f"{below:.4g} and {above:.4g} mm; make it larger, or the inner row smaller"
        )

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Race of the inner ring and race of the outer ring."""
        return self.inner.raceway_diameters_mm[0], self.outer.raceway_diameters_mm[1]


class Prescribed(Strict):
    """Displacements of the inner ring that are prescribed instead of loads; those left out follow from the load."""

    x_mm: Annotated[float, Field(ge=-10.0, le=10.0)] | None = None
    y_mm: Annotated[float, Field(ge=-10.0, le=10.0)] | None = None
    z_mm: Annotated[float, Field(ge=-10.0, le=10.0)] | None = None
    tilt_x_mrad: Annotated[float, Field(ge=-200.0, le=200.0)] | None = None
    tilt_y_mrad: Annotated[float, Field(ge=-200.0, le=200.0)] | None = None

    @property
    def values(self) -> tuple[float | None, ...]:
        """x, y, z, tilt x, tilt y in mm and mrad; None where left out."""
        return self.x_mm, self.y_mm, self.z_mm, self.tilt_x_mrad, self.tilt_y_mrad


# Order of the components of load and displacement.
COMPONENTS = ("x", "y", "z", "tilt_x", "tilt_y")


class BallOperation(Strict):
    """Speeds and load on the inner ring. x is radial, z axial; the outer ring is the reference."""

    inner_speed_rpm: Speed = 0.0
    outer_speed_rpm: Speed = 0.0
    # Along x; instead of load_N.
    radial_load_N: Force | None = None  # noqa: N815
    axial_load_N: Force | None = None  # noqa: N815
    load_N: Annotated[list[Force], Field(min_length=3, max_length=3)] | None = None  # noqa: N815
    moment_Nm: Annotated[list[Moment], Field(min_length=2, max_length=2)] | None = None  # noqa: N815
    # fixed: the shaft holds the ring at operation.prescribed.tilt_x_mrad and tilt_y_mrad, 0 where left out, as a shaft in two
    # bearings does; a lone ring is free: a 7208 under 1000 N across and 1500 N along the axis tips by 3 mrad and lasts half as long.
    tilt: Literal["free", "fixed"] = "fixed"
    prescribed: Prescribed = Prescribed()
    # A spring's axial force, on top of the load; or how far nut and spacer push the inner ring in after it touches.
    preload_N: Force = 0.0  # noqa: N815
    preload_um: Annotated[float, Field(ge=-2000.0, le=2000.0)] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> BallOperation:
        faults = []
        if self.load_N is not None and (self.radial_load_N is not None or self.axial_load_N is not None):
            faults.append(
                "operation.load_N and operation.radial_load_N or axial_load_N contradict each other: give the one or the others"
            )
        if self.moment_Nm is not None and self.tilt == "fixed" and any(self.moment_Nm):
            faults.append(
                f"operation.moment_Nm = {self.moment_Nm}: has no effect on a ring whose tilt is fixed; leave it out or set "
                "operation.tilt = 'free'"
            )
        if self.preload_um is not None:
            if self.preload_N:
                faults.append(
                    f"operation.preload_um = {self.preload_um:g} and operation.preload_N = {self.preload_N:g} contradict each "
                    "other: preload by displacement or by force"
                )
            if self.prescribed.z_mm is not None:
                faults.append(
                    f"operation.preload_um = {self.preload_um:g} and operation.prescribed.z_mm = {self.prescribed.z_mm:g} "
                    "both prescribe the axial displacement; leave one out"
                )
        load = dict(zip(COMPONENTS, (*self.load, *self.moment), strict=True))
        for name, value in zip(COMPONENTS, self.given, strict=True):
            by_tilt = name.startswith("tilt") and self.tilt == "fixed"
            by_nut = name == "z" and self.preload_um is not None
            if value is not None and load[name] != 0.0 and not (by_tilt or by_nut):
                faults.append(
                    f"operation.prescribed: the {name} displacement is prescribed, so the load of {load[name]:g} along it would be "
                    "lost; leave one out"
                )
        return or_refuse(self, faults)

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
    def given(self) -> tuple[float | None, ...]:
        """Prescribed displacements x, y, z [mm] and tilts [mrad]; None where the load rules."""
        x, y, z, tilt_x, tilt_y = self.prescribed.values
        if self.preload_um is not None:
            z = 1e-3 * self.preload_um
        if self.tilt == "fixed":
            tilt_x, tilt_y = tilt_x or 0.0, tilt_y or 0.0
        return x, y, z, tilt_x, tilt_y


class BallModel(Strict):
    """Hypotheses and solver."""

    # Which race balls roll on without spin; "hybrid" weighs both by friction, "common_cage" knows no gyroscopic moment.
    raceway_control: Literal["outer", "inner", "half", "hybrid", "common_cage"] = "outer"
    # "unsigned" drops the sign of the gyroscopic moment, as many texts do; with the inner ring turning it is negative.
    gyroscopic: bool | Literal["unsigned"] = True
    # Race control sets in as the inner contact load rises to this share of the centrifugal force; below, balls go with the cage.
    # A smaller share lets a light ball have several orbits: its centrifugal force then changes faster than its load.
    light_load_share: Annotated[float, Field(ge=1e-3, le=10.0)] = 0.3
    # Largest friction coefficient that may hold a ball's gyroscopic moment: beyond that of any oiled or boundary contact, so
    # that it only ends what no friction could hold; the ball then slips about that axis.
    friction_limit: Annotated[float, Field(ge=1e-3, le=10.0)] = 0.3
    # Growth of rotating rings: of a thick ring, or by the formula of Hu et al. (double-decker papers) for comparison.
    ring_expansion: bool = False
    ring_expansion_form: Literal["thick_ring", "paper"] = "thick_ring"
    solver: Literal["convex", "finite_search", "newton"] = "convex"


class BallMaterials(Strict):
    """What balls and rings are made of: a name, or a table of numbers. A ring left out is as ``rings``."""

    ball: MaterialName | CustomMaterial = "bearing_steel"
    rings: MaterialName | CustomMaterial = "bearing_steel"
    inner_ring: MaterialName | CustomMaterial | None = None
    middle_ring: MaterialName | CustomMaterial | None = None
    outer_ring: MaterialName | CustomMaterial | None = None


class BallScene(SceneFile):
    """Everything the equilibrium of a ball bearing needs."""

    bearing: BallBearing | DoubleDecker
    operation: BallOperation
    model: BallModel = BallModel()
    materials: BallMaterials = BallMaterials()
    lubricant: Lubricant | None = None
    # What ``quasistatic.runout_model.follow_ring`` follows; ``rbdyn.equilibrium`` is that of the perfect bearing.
    errors: FormErrors | None = None
    mounting: Mounting | None = None

    @model_validator(mode="after")
    def _rings_known(self) -> Self:
        return or_refuse(self, ring_faults(self))

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        bearing = data.get("bearing")
        double = isinstance(bearing, dict) and bearing.get("kind") == "double_decker_ball"
        return cast(type[Self], DoubleDeckerScene if double else SingleRowScene)

    def material(self, part: str) -> Material:
        """Material of 'ball', 'inner_ring', 'middle_ring' or 'outer_ring' in SI."""
        chosen = getattr(self.materials, part)
        return material_of(self.materials.rings if chosen is None else chosen)


class SingleRowScene(BallScene):
    """A scene of one row."""

    bearing: BallBearing

    @model_validator(mode="after")
    def _errors_fit(self) -> SingleRowScene:
        row = self.bearing
        if self.errors is None:
            return self
        return or_refuse(self, faults(self.errors, row.balls, row.ball_diameter_mm, row.pitch_diameter_mm))


class DoubleDeckerScene(BallScene):
    """A scene of two rows one inside the other."""

    bearing: DoubleDecker

    @model_validator(mode="after")
    def _solvable(self) -> DoubleDeckerScene:
        found = []
        if self.errors is not None:
            found.append("errors: form errors are followed for one row of balls only; take the table away")
        if self.model.solver != "convex":
            found.append(f"model.solver = {self.model.solver!r}: solves one row of balls only; leave it out for two")
        return or_refuse(self, found)
