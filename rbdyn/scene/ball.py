"""Scene of a ball bearing, single row or double-decker: drawing, load and model."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, ClassVar, Literal, Self, cast

from pydantic import Field, model_validator

from rbdyn.base.faults import RPM, SI, Consistent, OptionalSI, Positive, Strict, given
from rbdyn.base.notes import Notes
from rbdyn.properties.materials import Material
from rbdyn.scene.bearing import CustomMaterial, MaterialName, material_of
from rbdyn.scene.form_errors import FormErrors, misfits
from rbdyn.scene.lubricant import Lubricant
from rbdyn.scene.notes import ball_unit_notes
from rbdyn.scene.operation import BallOperation, Mounting, Speed
from rbdyn.scene.operation import misfits as mounting_faults
from rbdyn.scene.reading import SceneFile
from rbdyn.scene.thermal import NO_MOUNTING, Thermal, oil_ceiling, start_faults, thermal_faults, with_first_guess

# Largest difference of a stated contact angle from that of a stated clearance.
AGREED_DEG = 0.2

# Estimated shoulder height over the ball's diameter, and how far a steep contact angle stays below its shoulder.
SHOULDER, BELOW_SHOULDER_DEG = 0.2, 20.0

GrooveFactor = Annotated[float, Field(gt=0.5, le=1.0)]


class BallRow(Consistent):
    """Geometry of one row of balls, with a contact angle, a clearance or both in agreement."""

    balls: Annotated[int, Field(ge=3, le=500)]
    """Number of balls."""
    ball_diameter_mm: Annotated[float, Field(ge=0.1, le=500.0)]
    """Diameter of a ball."""
    pitch_diameter_mm: Annotated[float, Field(ge=1.0, le=10000.0)]
    """Diameter of the circle through the balls' centres."""
    inner_groove_factor: GrooveFactor
    """Radius of the inner groove divided by the ball diameter. Typical: 0.515 to 0.53 in catalogue bearings."""
    outer_groove_factor: GrooveFactor
    """Radius of the outer groove divided by the ball diameter. Typical: 0.515 to 0.53 in catalogue bearings."""
    contact_angle_deg: Annotated[float, Field(ge=0.0, lt=90.0)] | None = None
    """Unloaded contact angle a_0. Default: from radial_clearance_mm by cos a_0 = 1 - P_d/(2 B), B = (f_i + f_o - 1) D."""
    radial_clearance_mm: Annotated[float, Field(ge=-2.0, le=5.0)] | None = None
    """Diametral clearance P_d; negative is an interference with a contact angle of 0. Default: from contact_angle_deg."""
    clearance_change_um: Annotated[float, Field(ge=-2000.0, le=2000.0)] = 0.0
    """Change of the diametral clearance by mounting, after measurement of the contact angle; negative is a reduction."""
    dynamic_capacity_N: Positive | None = None  # noqa: N815
    """Basic dynamic load rating from the catalogue. Default: calculated from the dimensions by ISO 281."""
    static_capacity_N: Positive | None = None  # noqa: N815
    """Static load rating: the load at which the most loaded ball has a pressure of 4200 MPa (ISO 76). Default: calculated from
    the dimensions by Hertz."""
    inner_shoulder_height_mm: Positive | None = None
    """Height of the inner-ring shoulder above the groove bottom. Take half the difference between the catalogue's shoulder
    diameter and the raceway diameter. Default (estimate): 0.2 ball diameters. Example: a spindle bearing of 15 degrees (pitch
    18 mm, balls 4.485 mm, shoulders 15.74 and 21.4 mm) has 0.25 ball diameters inside and 0.12 outside. For contact angles
    above about 32 degrees the default reaches 20 degrees beyond the contact angle. Effect: a note warns if a contact ellipse
    runs over the shoulder."""
    outer_shoulder_height_mm: Positive | None = None
    """Height of the outer-ring shoulder above the groove bottom. Default (estimate): 0.2 ball diameters."""
    bore_mm: Positive | None = None
    """Bore of the inner ring, for ring expansion by rotation."""
    outside_diameter_mm: Positive | None = None
    """Outside diameter of the outer ring, for ring expansion by rotation."""

    ball_diameter, pitch_diameter, groove_centre_distance = SI("mm"), SI("mm"), SI("mm")
    radial_clearance, bore, outside_diameter = OptionalSI("mm"), OptionalSI("mm"), OptionalSI("mm")

    def faults(self) -> Iterator[str]:
        chord = self.pitch_diameter_mm * math.sin(math.pi / self.balls)
        if chord <= self.ball_diameter_mm:
            yield (
                f"balls = {self.balls}: balls of {self.ball_diameter_mm:g} mm do not fit on a pitch circle of "
                f"{self.pitch_diameter_mm:g} mm, where each has {chord:.4g} mm; take fewer or smaller ones"
            )
        if self.ball_diameter_mm >= self.pitch_diameter_mm:
            yield (
                f"ball_diameter_mm = {self.ball_diameter_mm:g}: leaves no inner raceway on a pitch circle of "
                f"{self.pitch_diameter_mm:g} mm; make the ball smaller"
            )
        yield from self._shoulder_faults()
        # The diameters of the races need a valid contact angle.
        yield from self._clearance_faults() or self._ring_faults()

    def _shoulder_faults(self) -> Iterator[str]:
        for race, factor in zip(("inner", "outer"), self.groove_factors, strict=True):
            height = getattr(self, f"{race}_shoulder_height_mm")
            if height is not None and height >= factor * self.ball_diameter_mm:
                yield (
                    f"{race}_shoulder_height_mm = {height:g}: not below the groove radius of "
                    f"{factor * self.ball_diameter_mm:.4g} mm; make it lower"
                )

    def _clearance_faults(self) -> list[str]:
        angle, clearance = self.contact_angle_deg, self.radial_clearance_mm
        if angle is None and clearance is None:
            return ["contact_angle_deg: missing; give it or radial_clearance_mm"]
        if clearance is None:
            return []
        gap = self.groove_centre_distance_mm
        if clearance >= 2.0 * gap:
            return [
                f"radial_clearance_mm = {clearance:g}: too large for grooves with centres {gap:.4g} mm apart; make it less than "
                f"{2.0 * gap:.4g}"
            ]
        if angle is None:
            return []
        implied = math.degrees(math.acos(min(1.0 - clearance / (2.0 * gap), 1.0)))
        if abs(implied - angle) > AGREED_DEG:
            clearance_of_angle = 2.0 * gap * (1.0 - math.cos(math.radians(angle)))
            return [
                f"contact_angle_deg = {angle:g} and radial_clearance_mm = {clearance:g} contradict each other: that clearance gives "
                f"{implied:.4g} deg, that angle {clearance_of_angle:.4g} mm; leave one out, and state a change by mounting as "
                "clearance_change_um"
            ]
        return []

    def _ring_faults(self) -> Iterator[str]:
        reach = self.ball_diameter_mm * math.cos(self.contact_angle)
        if self.bore_mm is not None and self.bore_mm >= self.pitch_diameter_mm - reach:
            race = self.pitch_diameter_mm - reach
            yield f"bore_mm = {self.bore_mm:g}: leaves no inner ring under a raceway of {race:.4g} mm; make it smaller"
        if self.outside_diameter_mm is not None and self.outside_diameter_mm <= self.pitch_diameter_mm + reach:
            race = self.pitch_diameter_mm + reach
            yield (
                f"outside_diameter_mm = {self.outside_diameter_mm:g}: leaves no outer ring over a raceway of {race:.4g} mm; "
                "make it larger"
            )

    @property
    def groove_centre_distance_mm(self) -> float:
        """B = (f_i + f_o - 1) D: distance of the groove centres where a ball just touches both [mm]."""
        return (self.inner_groove_factor + self.outer_groove_factor - 1.0) * self.ball_diameter_mm

    @property
    def groove_factors(self) -> tuple[float, float]:
        """Groove factors, inner and outer."""
        return self.inner_groove_factor, self.outer_groove_factor

    def shoulder_angle(self, race: Literal["inner", "outer"]) -> float:
        """Contact angle at which the groove of a race ends [rad]: cos = 1 - h/(f D), h the height of the shoulder."""
        height = getattr(self, f"{race}_shoulder_height_mm")
        factor = getattr(self, f"{race}_groove_factor")
        if height is not None:
            return math.acos(1.0 - height / (factor * self.ball_diameter_mm))
        steep = min(self.contact_angle + math.radians(BELOW_SHOULDER_DEG), 0.5 * math.pi)
        return max(math.acos(1.0 - SHOULDER / factor), steep)

    @property
    def contact_angle(self) -> float:
        """Unloaded contact angle [rad], stated or from the clearance; 0 for an interference."""
        if self.radial_clearance_mm is None:
            return math.radians(given(self.contact_angle_deg))
        return math.acos(min(1.0 - self.radial_clearance_mm / (2.0 * self.groove_centre_distance_mm), 1.0))

    @property
    def rated_angle(self) -> float:
        """Nominal contact angle of load ratings [rad]."""
        return self.contact_angle

    @property
    def both_ways(self) -> bool:
        """Whether rings have shoulders on both sides, so that balls also carry at negative angles."""
        return self.contact_angle == 0.0

    @property
    def gamma(self) -> float:
        """Ball over pitch diameter, in the plane of the unloaded contacts: D cos a_0/d_m."""
        return self.ball_diameter_mm * math.cos(self.contact_angle) / self.pitch_diameter_mm

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Diameters at which balls touch both races at the unloaded contact angle [mm]."""
        reach = self.ball_diameter_mm * math.cos(self.contact_angle)
        return self.pitch_diameter_mm - reach, self.pitch_diameter_mm + reach

    @property
    def interference_m(self) -> float:
        """Outward radial shift of the inner groove by interference and mounting [m]; negative with clearance."""
        clearance = self.radial_clearance_mm or 0.0
        return 0.5e-3 * max(-clearance, 0.0) - 0.5e-6 * self.clearance_change_um


class BallBearing(BallRow):
    """A single row: angular contact or deep groove."""

    kind: Literal["angular_contact_ball", "deep_groove_ball"]
    """Kind of bearing."""

    @property
    def rated_angle(self) -> float:
        """Nominal contact angle of load ratings [rad]: 0 of a deep groove bearing (ISO 281), whatever its clearance."""
        return 0.0 if self.kind == "deep_groove_ball" else self.contact_angle

    @property
    def both_ways(self) -> bool:
        """Whether rings have shoulders on both sides, as those of a deep groove bearing."""
        return self.kind == "deep_groove_ball" or super().both_ways


class MiddleRing(Strict):
    """The floating ring between the rows of a double-decker bearing, which friction alone turns."""

    speed_rpm: Speed | None = None
    """Speed of the middle ring. Default: by speed_split."""
    speed_split: Literal["oil", "torque_balance"] = "oil"
    """Condition for the speed of the middle ring. "oil": equal oil friction of both rows (Hu et al., eq 13);
    "torque_balance": equal torque from oil and load after Palmgren, which needs [lubricant]."""
    inner_oil_factor: Positive = 3.3
    """Palmgren's f0 of the inner row. Typical: 1.7 for oil mist, 2 for grease, 3.3 for an oil bath and 6.6 for an oil jet."""
    outer_oil_factor: Positive = 3.3
    """Palmgren's f0 of the outer row. Use: rows with other oil supplies; friction of both sets the middle ring's speed."""
    tilt: Literal["free", "fixed"] | None = None
    """Whether the middle ring can tilt against the outer ring. Default: as operation.tilt."""
    axial_offset_mm: Annotated[float, Field(ge=-1000.0, le=1000.0)] = 0.0
    """Axial distance between the ball planes of the inner and the outer row in the unloaded bearing."""
    speed, axial_offset = OptionalSI("rpm"), SI("mm")


class DoubleDecker(Consistent):
    """Two concentric rows with a floating ring between them."""

    kind: Literal["double_decker_ball"]
    """Kind of bearing."""
    inner: BallRow
    """Row on the inner ring."""
    outer: BallRow
    """Row in the outer ring."""
    middle: MiddleRing = MiddleRing()
    """Ring between the rows."""

    def faults(self) -> Iterator[str]:
        below, above = self.inner.raceway_diameters_mm[1], self.outer.raceway_diameters_mm[0]
        if not below < above:
            yield (
                f"bearing.outer.pitch_diameter_mm = {self.outer.pitch_diameter_mm:g}: leaves no middle ring between raceways of "
                f"{below:.4g} and {above:.4g} mm; make it larger, or the inner row smaller"
            )

    @property
    def pitch_ratio(self) -> float:
        """Pitch circle of the outer row over that of the inner one."""
        return self.outer.pitch_diameter_mm / self.inner.pitch_diameter_mm

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Diameters of the races of the inner and the outer ring [mm]."""
        return self.inner.raceway_diameters_mm[0], self.outer.raceway_diameters_mm[1]


BALL_KINDS = ("angular_contact_ball", "deep_groove_ball", "double_decker_ball")


class BallModel(Strict):
    """Assumptions and solver."""

    raceway_control: Literal["outer", "inner", "half", "hybrid", "common_cage"] = "outer"
    """Raceway on which balls roll without spin. "hybrid" weights both raceways by friction; "common_cage" has no gyroscopic
    moment."""
    gyroscopic: bool | Literal["unsigned"] = True
    """Whether balls have a gyroscopic moment. "unsigned" drops its sign, as many texts do; it is negative for a rotating inner
    ring."""
    light_load_share: Annotated[float, Field(ge=1e-3, le=10.0)] = 0.3
    """Ratio of the inner contact load to the centrifugal force at which raceway control is complete. Below it balls move with
    the cage. Effect: a smaller ratio allows several orbits of a lightly loaded ball, whose centrifugal force then changes
    faster than its load."""
    friction_limit: Annotated[float, Field(ge=1e-3, le=10.0)] = 0.3
    """Largest friction coefficient against a ball's gyroscopic moment. The default exceeds the friction of any oiled or
    boundary contact, so it acts only where no friction suffices. The ball then slips about that axis."""
    ring_expansion: bool = False
    """Whether rings expand by rotation."""
    ring_expansion_form: Literal["thick_ring", "paper"] = "thick_ring"
    """Formula of the ring expansion: a thick ring, or the formula of Hu et al. (double-decker papers) for comparison."""
    solver: Literal["convex", "finite_search"] = "convex"
    """Solver of the equilibrium. convex: guarded Newton method, which converges from any start. finite_search: the search of
    Hu et al. 2021, for comparison."""


class BallMaterials(Strict):
    """Materials of balls and rings: a name, or a table of properties."""

    ball: MaterialName | CustomMaterial = "bearing_steel"
    """Material of the balls."""
    rings: MaterialName | CustomMaterial = "bearing_steel"
    """Material of all rings without a key of their own."""
    inner_ring: MaterialName | CustomMaterial | None = None
    """Material of the inner ring. Default: as rings."""
    middle_ring: MaterialName | CustomMaterial | None = None
    """Material of the middle ring of a double-decker bearing. Default: as rings."""
    outer_ring: MaterialName | CustomMaterial | None = None
    """Material of the outer ring. Default: as rings."""


class BallScene(SceneFile):
    """Input of the equilibrium of a ball bearing; built, validated, changed and read like ``Scene``."""

    UNSAVED: ClassVar[Mapping[str, Any]] = {"thermal": None}

    bearing: BallBearing | DoubleDecker
    """The drawing: one row, or two rows with a ring between them."""
    operation: BallOperation
    """Speeds and load."""
    model: BallModel = BallModel()
    """Assumptions and solver."""
    materials: BallMaterials = BallMaterials()
    """Materials of balls and rings."""
    lubricant: Lubricant | None = None
    """Oil, for film thickness and the heat balance."""
    errors: FormErrors | None = None
    """Form errors of grooves and balls, from which runout is computed. The equilibrium is computed without them."""
    mounting: Mounting | None = None
    """Fits, temperatures, shaft and housing."""
    thermal: Thermal | None = None
    """Heat balance that computes the temperatures of a single row; Default: temperatures are given by lubricant and mounting.
    Needs [mounting] with bore, outside and housing diameter and the width of the rings, and without temperatures of parts.
    Also needs lubricant.oil_flow_l_min with oil_inlet_temperature_C, or a lubricant.supply without a flow: bath, drop, oil_air
    or grease. rbdyn new --ambient 25 writes all of this."""

    @model_validator(mode="before")
    @classmethod
    def _first_guess(cls, data: Any) -> Any:
        return with_first_guess(data) if isinstance(data, Mapping) and data.get("thermal") is not None else data

    def faults(self) -> Iterable[str]:
        """One sentence for each missing diameter or oil, and for each contradiction."""
        yield from _thermal_faults(self)
        if self.mounting is not None:
            yield from _mounted_faults(self.mounting, self)
        elif self.model.ring_expansion:
            yield from _unmounted_faults(self)
        inner, outer = self.outermost_rows
        middle = None if inner is outer else self.bearing.middle  # type: ignore[union-attr]
        if middle is not None and middle.speed_split == "torque_balance" and middle.speed_rpm is None:
            if self.lubricant is None:
                yield (
                    "lubricant: missing; bearing.middle.speed_split = 'torque_balance' needs its viscosity, so add it or set 'oil'"
                )
            for name, row in (("inner", inner), ("outer", outer)):
                if row.contact_angle == 0.0:
                    yield (
                        f"bearing.{name}.contact_angle_deg = 0: has no load torque after Palmgren; set "
                        "bearing.middle.speed_split = 'oil' or give bearing.middle.speed_rpm"
                    )

    @property
    def outermost_rows(self) -> tuple[BallRow, BallRow]:
        """The row on the inner ring and that in the outer ring, which is the same row except in a double-decker bearing."""
        bearing = self.bearing
        return (bearing.inner, bearing.outer) if isinstance(bearing, DoubleDecker) else (bearing, bearing)

    @property
    def unit_notes(self) -> Notes:
        """Sentences on values that look like another unit."""
        bearing = self.bearing
        double = isinstance(bearing, DoubleDecker)
        names = ("bearing.inner", "bearing.outer") if double else ("bearing",)
        rows = dict(zip(names, self.outermost_rows, strict=False))
        return ball_unit_notes(rows, self.lubricant, self.mounting)

    @property
    def summary(self) -> str:
        """The scene in one line."""
        rows = dict.fromkeys(f"{row.balls} x {row.ball_diameter_mm:g} mm" for row in self.outermost_rows)
        point = self.operation
        keys = point.model_dump(exclude_unset=True)
        loads = ", ".join(f"{key} = {value}" for key, value in keys.items() if "load" in key)
        return f"{self.bearing.kind}, balls {' and '.join(rows)}, {point.inner_speed_rpm:g} rpm, {loads or 'no load'}"

    @classmethod
    def _of_kind(cls, data: dict[str, Any]) -> type[Self]:
        bearing = data.get("bearing")
        double = isinstance(bearing, dict) and bearing.get("kind") == "double_decker_ball"
        return cast(type[Self], DoubleDeckerScene if double else SingleRowScene)

    def material(self, part: str) -> Material:
        """Material of 'ball', 'inner_ring', 'middle_ring' or 'outer_ring' in SI."""
        material = getattr(self.materials, part)
        return material_of(self.materials.rings if material is None else material)


class SingleRowScene(BallScene):
    """A scene of one row."""

    bearing: BallBearing
    """Dimensions of a single row, as on its drawing."""

    def faults(self) -> Iterable[str]:
        """Faults of any ball bearing, else those of form errors."""
        row, faults = self.bearing, super().faults()
        if self.errors is None:
            return faults
        return tuple(faults) or misfits(self.errors, row.balls, row.ball_diameter_mm, row.pitch_diameter_mm)


class DoubleDeckerScene(BallScene):
    """A scene of two concentric rows."""

    bearing: DoubleDecker
    """Dimensions of two rows with a ring between them, as on their drawing."""

    def faults(self) -> Iterator[str]:
        """Faults of any ball bearing, else keys for a single row."""
        faults = list(super().faults())
        yield from faults
        if not faults and self.errors is not None:
            yield "errors: runout is computed for a single row of balls only; remove the table"
        if not faults and self.model.solver != "convex":
            yield f"model.solver = {self.model.solver!r}: solves a single row of balls only; leave it out for two rows"


def _unmounted_faults(scene: BallScene) -> Iterator[str]:
    inner, outer = scene.outermost_rows
    operation = scene.operation
    prefix = ("bearing.", "bearing.") if inner is outer else ("bearing.inner.", "bearing.outer.")
    if operation.inner_speed_rpm != 0.0 and inner.bore_mm is None:
        yield (
            f"{prefix[0]}bore_mm: missing, but the rotating inner ring needs it to expand; add it, or set "
            "model.ring_expansion = false"
        )
    paper = scene.model.ring_expansion_form == "paper"
    if operation.outer_speed_rpm != 0.0 and outer.outside_diameter_mm is None and not paper:
        yield (
            f"{prefix[1]}outside_diameter_mm: missing, but the rotating outer ring needs it to expand; add it, or set "
            "model.ring_expansion = false"
        )
    if paper and inner is not outer and outer.bore_mm is None:
        yield "bearing.outer.bore_mm: missing, but model.ring_expansion_form = 'paper' needs it for the middle ring; add it"


def _mounted_faults(mounting: Mounting, scene: BallScene) -> Iterator[str]:
    inner, outer = scene.outermost_rows
    yield from mounting_faults(mounting, scene.bearing, inner.ball_diameter_mm)
    if mounting.cage_temperature_C is not None:
        yield f"mounting.cage_temperature_C = {mounting.cage_temperature_C:g}: the model of ball bearings has no cage; leave it out"
    for key, seat, row in (
        ("bore_mm", mounting.bore_mm, inner),
        ("outside_diameter_mm", mounting.outside_diameter_mm, outer),
    ):
        diameter = getattr(row, key)
        if diameter is not None and diameter != seat:
            yield (
                f"mounting.{key} = {seat:g} and the bearing's {key} = {diameter:g} contradict each other: leave out the second"
            )
    for row in {id(row): row for row in (inner, outer)}.values():
        if row.clearance_change_um != 0.0:
            yield (
                f"clearance_change_um = {row.clearance_change_um:g} and [mounting] both state the change by mounting; "
                "leave one out"
            )
    if scene.model.ring_expansion and scene.model.ring_expansion_form == "paper":
        yield "model.ring_expansion_form = 'paper' has no fits; remove [mounting] or set 'thick_ring'"


def _thermal_faults(scene: BallScene) -> Iterator[str]:
    """Contradictions of the heat balance of a ball bearing, one sentence each."""
    thermal, (inner, outer) = scene.thermal, scene.outermost_rows
    if scene.lubricant is not None:
        yield from thermal_faults(None if inner is not outer else thermal, scene.lubricant, scene.mounting, None)
        if inner is not outer and scene.lubricant.film_temperature == "parts":
            yield "lubricant.film_temperature = 'parts': is for a single row of balls; write 'oil'"
    if thermal is None:
        return
    if inner is not outer:
        yield "[thermal]: balances the heat of a single row of balls, not of two; remove the table"
        return
    if scene.lubricant is None:
        yield "lubricant: missing, but [thermal] needs its viscosity for the friction; add the table"
        if scene.mounting is None:
            yield NO_MOUNTING
    if scene.operation.inner_speed_rpm == scene.operation.outer_speed_rpm:
        yield f"operation.inner_speed_rpm = {scene.operation.inner_speed_rpm:g}: [thermal] needs rings that turn against each other; change it"
    for key, usual in (("cage_offset_K", 0.0), ("cage_ceiling_C", None)):
        if (value := getattr(thermal, key)) != usual:
            yield f"thermal.{key} = {value:g}: the model of ball bearings has no cage; leave it out"
    if thermal.near is not None:
        yield "[thermal.near]: shortens simulations of rollers; the balance of ball bearings has none; remove it"
    start, oil, mounting = thermal.start, scene.lubricant, scene.mounting
    if start is not None and oil is not None and mounting is not None:
        from rbdyn.life.balls import FASTEST

        fastest = 2.0 * FASTEST[scene.bearing.kind] / (mounting.bore + mounting.outside_diameter) / RPM
        yield from start_faults(start, oil, thermal.ambient_C, oil_ceiling(thermal, oil), round(fastest, -2))
        if start.schedule and start.schedule.load_N and scene.operation.displacements[0] is not None:
            yield "thermal.start.schedule.load_N: has no effect, since operation.prescribed.x_mm holds the ring; leave one out"
    if scene.errors is not None:
        yield "[thermal] and [errors]: runout is computed at stated temperatures; leave out one of them"
