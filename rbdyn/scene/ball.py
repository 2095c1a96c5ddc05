"""One validated scene of a ball bearing, single row or double-decker: its drawing, form errors of grooves and balls, load and model."""

import math
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, cast

from pydantic import Field

from rbdyn.base.faults import Consistent, Strict
from rbdyn.base.fields import SI, NonNegative, NotVanishing, OptionalSI, Positive
from rbdyn.base.words import counted
from rbdyn.properties.materials import Material
from rbdyn.scene.bearing import CustomMaterial, Harmonic, MaterialName, material_of
from rbdyn.scene.lubricant import Lubricant
from rbdyn.scene.mounting import Mounting
from rbdyn.scene.mounting import misfits as mounting_faults
from rbdyn.scene.operation import Speed
from rbdyn.scene.reading import SceneFile

if TYPE_CHECKING:
    from rbdyn.base.arrays import Array


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
        # Only a contact angle that is known shows where the races are.
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
            fix = "make it larger, or the inner row smaller"
            yield f"bearing.outer.pitch_diameter_mm = {self.outer.pitch_diameter_mm:g}: {why}; {fix}"

    @property
    def pitch_ratio(self) -> float:
        """Pitch circle of the outer row over that of the inner one."""
        return self.outer.pitch_diameter_mm / self.inner.pitch_diameter_mm

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Race of the inner ring and race of the outer ring."""
        return self.inner.raceway_diameters_mm[0], self.outer.raceway_diameters_mm[1]


Order = Annotated[int, Field(ge=1, le=2000)]
# Beyond this share of the ball it is no form error but a slip of the unit.
LARGEST_ERROR = 0.01


class RandomWaviness(Strict):
    """Waves in random phases, ``lowest_order`` to ``highest_order``."""

    lowest_order: Order = 1
    """Lowest order of the waves drawn."""
    highest_order: Order
    """Highest order of the waves drawn."""
    height_um: Annotated[float, Field(gt=0.0, le=500.0), NotVanishing]
    """Height from peak to valley of all waves together."""
    decay: Annotated[float, Field(ge=0.0, le=10.0)] = 1.0
    """Amplitudes fall as order^-decay on the average; ground raceways: between 1 and 2."""
    height = SI("um")


class BallHarmonic(Strict):
    """One harmonic of the sphericity of balls, from order 2: order 1 is no form."""

    order: Annotated[int, Field(ge=2, le=2000)]
    """Waves around a ball, from 2: order 1 is no form."""
    amplitude_um: Annotated[float, Field(ge=-500.0, le=500.0)]
    """Amplitude of the ball's radius."""
    phase_deg: float | None = None
    """Angle of a crest; drawn for each ball by errors.seed where left out."""
    balls: list[Annotated[int, Field(ge=1)]] | None = None
    """Numbers of the balls that have it, from 1; every ball where left out."""
    amplitude, phase = SI("um"), OptionalSI("deg")


class FormErrors(Consistent):
    """Form errors of grooves and balls, and how finely and how long the turning ring is followed.

    Each error of a groove is given by its harmonics, drawn at random, or both added.
    """

    inner_roundness: list[Harmonic] = []
    """Radial harmonics of the inner groove."""
    outer_roundness: list[Harmonic] = []
    """Radial harmonics of the outer groove."""
    inner_side_sway: list[Harmonic] = []
    """Axial harmonics of the inner groove: order 1 is side-sway proper, others axial waviness."""
    outer_side_sway: list[Harmonic] = []
    """Axial harmonics of the outer groove: order 1 is side-sway proper, others axial waviness."""
    inner_groove_radius: list[Harmonic] = []
    """Harmonics of the inner groove's radius, the width of the groove at a fixed bottom."""
    outer_groove_radius: list[Harmonic] = []
    """Harmonics of the outer groove's radius, the width of the groove at a fixed bottom."""
    inner_roundness_random: RandomWaviness | None = None
    """Radial waves of the inner groove drawn by errors.seed, on top of the given ones."""
    outer_roundness_random: RandomWaviness | None = None
    """Radial waves of the outer groove drawn by errors.seed, on top of the given ones."""
    inner_side_sway_random: RandomWaviness | None = None
    """Axial waves of the inner groove drawn by errors.seed, on top of the given ones."""
    outer_side_sway_random: RandomWaviness | None = None
    """Axial waves of the outer groove drawn by errors.seed, on top of the given ones."""
    inner_groove_radius_random: RandomWaviness | None = None
    """Waves of the inner groove's radius drawn by errors.seed, on top of the given ones."""
    outer_groove_radius_random: RandomWaviness | None = None
    """Waves of the outer groove's radius drawn by errors.seed, on top of the given ones."""
    ball_sphericity: list[BallHarmonic] = []
    """Harmonics of the balls' radius."""
    ball_diameter_errors_um: list[float] | None = None
    """Each ball's diameter less the nominal one, instead of ball_diameter_spread_um."""
    ball_diameter_spread_um: NonNegative = 0.0
    """Standard deviation of a seeded normal spread of the balls' diameters."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of all that is drawn."""
    steps: Annotated[int, Field(ge=8, le=100_000)] = 360
    """Steps to a turn of the inner ring against the outer."""
    turns: Annotated[int, Field(ge=1, le=10_000)] = 8
    """Turns of the inner ring that are followed, since the cage does not come round with the ring."""

    def faults(self) -> Iterator[str]:
        for key in GROOVES:
            drawn = getattr(self, f"{key}_random")
            if drawn is not None and drawn.lowest_order > drawn.highest_order:
                what = f"errors.{key}_random.lowest_order = {drawn.lowest_order}"
                yield f"{what}: above highest_order = {drawn.highest_order}; swap them"
        if self.ball_diameter_errors_um is not None and self.ball_diameter_spread_um > 0.0:
            what = "errors.ball_diameter_errors_um and errors.ball_diameter_spread_um contradict each other"
            yield f"{what}: give the errors or their spread, not both"
        highest = self.highest_order
        if 2 * highest >= self.steps:
            what = f"errors.steps = {self.steps}: too few to show order {highest}"
            yield f"{what}, which needs more than two steps a wave; take at least {2 * highest + 1}"

    def ball_diameter_errors(self, normal: "Array") -> "Array":
        """Each ball's diameter less the nominal one [m], as given or with the spread of standard ``normal`` numbers."""
        import numpy as np

        given, spread = self.ball_diameter_errors_um, self.ball_diameter_spread_um
        return 1e-6 * (spread * normal if given is None else np.array(given))

    @property
    def highest_order(self) -> int:
        """Highest order of a groove; 0 where all are perfect."""
        given = [wave.order for key in GROOVES for wave in getattr(self, key)]
        drawn = [getattr(self, f"{key}_random") for key in GROOVES]
        return max(given + [wave.highest_order for wave in drawn if wave is not None], default=0)


GROOVES = tuple(key for key in FormErrors.model_fields if f"{key}_random" in FormErrors.model_fields)


def misfits(errors: FormErrors, balls: int, ball_diameter_mm: float, pitch_diameter_mm: float) -> Iterator[str]:
    """What does not go with a row of ``balls`` on a pitch circle, one sentence each."""
    given = errors.ball_diameter_errors_um
    if given is not None and len(given) != balls:
        yield f"errors.ball_diameter_errors_um: {counted(len(given), 'value')} for {balls} balls; give one a ball"
    limit = LARGEST_ERROR * ball_diameter_mm * 1e3
    if any(abs(error) > limit for error in given or []) or errors.ball_diameter_spread_um > limit:
        yield f"errors: ball diameters beyond {limit:g} um, a hundredth of the ball; give micrometres"
    for number, harmonic in enumerate(errors.ball_sphericity, 1):
        alien = [ball for ball in harmonic.balls or [] if ball > balls]
        if alien:
            yield f"errors.ball_sphericity[{number}].balls: ball {alien[0]} of {balls}; balls count from 1 to {balls}"
    # A ball spins dm/(2 D) times a turn, or a little less.
    fastest = max((wave.order for wave in errors.ball_sphericity), default=0) * pitch_diameter_mm / ball_diameter_mm
    if fastest >= errors.steps:
        spinning = f"balls that spin {0.5 * pitch_diameter_mm / ball_diameter_mm:.3g} times a turn"
        what = f"errors.steps = {errors.steps}: too few to show errors.ball_sphericity on {spinning}"
        yield f"{what}; take at least {int(fastest) + 1}"


BALL_KINDS = ("angular_contact_ball", "deep_groove_ball", "double_decker_ball")

Force = Annotated[float, Field(ge=-1e8, le=1e8)]
Moment = Annotated[float, Field(ge=-1e7, le=1e7)]


class Prescribed(Strict):
    """Displacements of the inner ring that are prescribed instead of loads; those left out follow from the load."""

    x_mm: Annotated[float, Field(ge=-10.0, le=10.0)] | None = None
    """Displacement along x, the radial load's direction."""
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
        """x, y, z, tilt x, tilt y in mm and mrad; None where left out."""
        return self.x_mm, self.y_mm, self.z_mm, self.tilt_x_mrad, self.tilt_y_mrad


# Order of the components of load and displacement.
COMPONENTS = ("x", "y", "z", "tilt_x", "tilt_y")


class BallOperation(Consistent):
    """Speeds and load on the inner ring. x is radial, z axial; the outer ring is the reference."""

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
    """fixed: the shaft holds the ring at operation.prescribed.tilt_x_mrad and tilt_y_mrad, 0 where left out, as a shaft
    in two bearings does; a lone ring is free: a 7208 under 1000 N across and 1500 N along the axis tips by 3 mrad and
    lasts half as long."""
    prescribed: Prescribed = Prescribed()
    """Displacements of the inner ring instead of loads."""
    preload_N: Force = 0.0  # noqa: N815
    """Axial force of a spring, on top of the load; a sweep of it replaces it."""
    preload_um: Annotated[float, Field(ge=-2000.0, le=2000.0)] | None = None
    """How far nut and spacer push the inner ring in after it touches; instead of preload_N."""
    inner_speed, outer_speed = SI("rpm"), SI("rpm")

    def faults(self) -> Iterator[str]:
        if self.load_N is not None and (self.radial_load_N is not None or self.axial_load_N is not None):
            why = "operation.load_N and operation.radial_load_N or axial_load_N contradict each other"
            yield f"{why}: give the one or the others"
        if self.moment_Nm is not None and self.tilt == "fixed" and any(self.moment_Nm):
            what = f"operation.moment_Nm = {self.moment_Nm}: has no effect on a ring whose tilt is fixed"
            yield f"{what}; leave it out or set operation.tilt = 'free'"
        if self.preload_um is not None:
            if self.preload_N:
                what = f"operation.preload_um = {self.preload_um:g} and operation.preload_N = {self.preload_N:g}"
                yield f"{what} contradict each other: preload by displacement or by force"
            if self.prescribed.z_mm is not None:
                both = f"operation.preload_um = {self.preload_um:g} and operation.prescribed.z_mm = {self.prescribed.z_mm:g}"
                yield f"{both} both prescribe the axial displacement; leave one out"
        for name, value, load in zip(COMPONENTS, self.given, (*self.load, *self.moment), strict=True):
            if value is None or load == 0.0 or (name == "z" and self.preload_um is not None):
                continue
            if self.tilt == "free" or not name.startswith("tilt"):
                what = f"operation.prescribed: the {name} displacement is prescribed"
                yield f"{what}, so the load of {load:g} along it would be lost; leave one out"

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
    def given(self) -> tuple[float | None, ...]:
        """Prescribed displacements x, y, z [m] and tilts [rad]; None where the load rules."""
        x, y, z, tilt_x, tilt_y = self.prescribed.values
        if self.preload_um is not None:
            z = 1e-3 * self.preload_um
        if self.tilt == "fixed":
            tilt_x, tilt_y = tilt_x or 0.0, tilt_y or 0.0
        return tuple(None if value is None else 1e-3 * value for value in (x, y, z, tilt_x, tilt_y))


class BallModel(Strict):
    """Hypotheses and solver."""

    raceway_control: Literal["outer", "inner", "half", "hybrid", "common_cage"] = "outer"
    """Which race balls roll on without spin; "hybrid" weighs both by friction, "common_cage" knows no gyroscopic
    moment."""
    gyroscopic: bool | Literal["unsigned"] = True
    """Whether balls have a gyroscopic moment; "unsigned" drops its sign, as many texts do: with the inner ring turning
    it is negative."""
    light_load_share: Annotated[float, Field(ge=1e-3, le=10.0)] = 0.3
    """Race control sets in as the inner contact load rises to this share of the centrifugal force; below, balls go with
    the cage. A smaller share lets a light ball have several orbits: its centrifugal force then changes faster than its
    load."""
    friction_limit: Annotated[float, Field(ge=1e-3, le=10.0)] = 0.3
    """Largest friction coefficient that may hold a ball's gyroscopic moment: beyond that of any oiled or boundary
    contact, so that it only ends what no friction could hold; the ball then slips about that axis."""
    ring_expansion: bool = False
    """Whether rotation widens the rings."""
    ring_expansion_form: Literal["thick_ring", "paper"] = "thick_ring"
    """Growth of a thick ring, or by the formula of Hu et al. (double-decker papers) for comparison."""
    solver: Literal["convex", "finite_search", "newton"] = "convex"
    """convex: guarded Newton method, from anywhere; finite_search: the search of Hu et al. 2021; newton: Newton's
    method from the loaded ring. The last two are for comparison."""


class BallMaterials(Strict):
    """What balls and rings are made of: a name, or a table of numbers. A ring left out is as ``rings``."""

    ball: MaterialName | CustomMaterial = "bearing_steel"
    """Material of the balls."""
    rings: MaterialName | CustomMaterial = "bearing_steel"
    """Material of all rings that have no key of their own."""
    inner_ring: MaterialName | CustomMaterial | None = None
    """Material of the inner ring; as rings where left out."""
    middle_ring: MaterialName | CustomMaterial | None = None
    """Material of the middle ring of a double-decker; as rings where left out."""
    outer_ring: MaterialName | CustomMaterial | None = None
    """Material of the outer ring; as rings where left out."""


class BallScene(SceneFile):
    """Everything the equilibrium of a ball bearing needs; made, checked, changed and read as in ``Scene``."""

    bearing: BallBearing | DoubleDecker
    """The drawing: one row, or two rows with a ring between."""
    operation: BallOperation
    """Speeds and load."""
    model: BallModel = BallModel()
    """Hypotheses and solver."""
    materials: BallMaterials = BallMaterials()
    """What balls and rings are made of."""
    lubricant: Lubricant | None = None
    """The oil, for film thickness and life."""
    errors: FormErrors | None = None
    """Form errors of grooves and balls, whose runout is followed; the equilibrium is that of the perfect bearing."""
    mounting: Mounting | None = None
    """Fits, temperatures, shaft and housing."""

    def faults(self) -> Iterable[str]:
        """One sentence for each diameter or oil that is missing, and for each that is stated twice in different ways."""
        if self.mounting is not None:
            yield from _mounted_faults(self.mounting, self)
        elif self.model.ring_expansion:
            yield from _unmounted_faults(self)
        inner, outer = self.outermost_rows
        middle = None if inner is outer else self.bearing.middle  # type: ignore[union-attr]
        if middle is not None and middle.speed_split == "torque_balance" and middle.speed_rpm is None:
            if self.lubricant is None:
                needs = "bearing.middle.speed_split = 'torque_balance' needs its viscosity"
                yield f"lubricant: missing; {needs}, or set 'oil'"
            for name, row in (("inner", inner), ("outer", outer)):
                if row.contact_angle == 0.0:
                    what = f"bearing.{name}.contact_angle_deg = 0: has no load torque after Palmgren"
                    yield f"{what}; set bearing.middle.speed_split = 'oil' or give bearing.middle.speed_rpm"

    @property
    def outermost_rows(self) -> tuple[BallRow, BallRow]:
        """The row on the inner ring and that in the outer ring: one and the same but in a double-decker bearing."""
        bearing = self.bearing
        return (bearing.inner, bearing.outer) if isinstance(bearing, DoubleDecker) else (bearing, bearing)

    @property
    def summary(self) -> str:
        """The scene in a line."""
        rows = dict.fromkeys(f"{row.balls} x {row.ball_diameter_mm:g} mm" for row in self.outermost_rows)
        point = self.operation
        given = point.model_dump(exclude_unset=True)
        loads = ", ".join(f"{key} = {value}" for key, value in given.items() if "load" in key)
        return f"{self.bearing.kind}, balls {' and '.join(rows)}, {point.inner_speed_rpm:g} rpm, {loads or 'no load'}"

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
    """The drawing of a single row."""

    def faults(self) -> Iterable[str]:
        """Those of both kinds, else those of form errors."""
        row, faults = self.bearing, super().faults()
        if self.errors is None:
            return faults
        return tuple(faults) or misfits(self.errors, row.balls, row.ball_diameter_mm, row.pitch_diameter_mm)


class DoubleDeckerScene(BallScene):
    """A scene of two rows one inside the other."""

    bearing: DoubleDecker
    """The drawing of two rows with a ring between."""

    def faults(self) -> Iterator[str]:
        """Those of both kinds, else what is meant for one row."""
        faults = list(super().faults())
        yield from faults
        if not faults and self.errors is not None:
            yield "errors: form errors are followed for one row of balls only; take the table away"
        if not faults and self.model.solver != "convex":
            yield f"model.solver = {self.model.solver!r}: solves one row of balls only; leave it out for two"


def _unmounted_faults(scene: BallScene) -> Iterator[str]:
    inner, outer = scene.outermost_rows
    turning = scene.operation
    speed = "turns; the growth of its ring needs it; add it, or set model.ring_expansion = false"
    prefix = ("bearing.", "bearing.") if inner is outer else ("bearing.inner.", "bearing.outer.")
    if turning.inner_speed_rpm != 0.0 and inner.bore_mm is None:
        yield f"{prefix[0]}bore_mm: missing; the inner ring {speed}"
    paper = scene.model.ring_expansion_form == "paper"
    if turning.outer_speed_rpm != 0.0 and outer.outside_diameter_mm is None and not paper:
        yield f"{prefix[1]}outside_diameter_mm: missing; the outer ring {speed}"
    if paper and inner is not outer and outer.bore_mm is None:
        why = "model.ring_expansion_form = 'paper' takes it for the middle ring's"
        yield f"bearing.outer.bore_mm: missing; {why}; add it"


def _mounted_faults(mounting: Mounting, scene: BallScene) -> Iterator[str]:
    inner, outer = scene.outermost_rows
    yield from mounting_faults(mounting, scene.bearing)
    if mounting.cage_temperature_C is not None:
        yield f"mounting.cage_temperature_C = {mounting.cage_temperature_C:g}: a ball bearing has no cage here; leave it out"
    for key, mounted, row in (
        ("bore_mm", mounting.bore_mm, inner),
        ("outside_diameter_mm", mounting.outside_diameter_mm, outer),
    ):
        drawn = getattr(row, key)
        if drawn is not None and drawn != mounted:
            what = f"mounting.{key} = {mounted:g} and the bearing's {key} = {drawn:g} contradict each other"
            yield f"{what}: leave the bearing's out"
    for row in {id(row): row for row in (inner, outer)}.values():
        if row.clearance_change_um != 0.0:
            what = f"clearance_change_um = {row.clearance_change_um:g} and [mounting] both give what mounting changes"
            yield f"{what}; leave one out"
    if scene.model.ring_expansion and scene.model.ring_expansion_form == "paper":
        yield "model.ring_expansion_form = 'paper' knows no fits; take [mounting] away or set it to 'thick_ring'"
