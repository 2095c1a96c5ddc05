"""One validated scene of a ball bearing: single row or double-decker, its load, its model."""

from collections.abc import Iterable, Iterator
from typing import Annotated, Any, Literal, Self, cast

from pydantic import Field

from rbdyn.faults import Consistent, Strict
from rbdyn.fields import SI
from rbdyn.properties.materials import Material
from rbdyn.scene.ball_bearing import BallBearing, BallRow, DoubleDecker
from rbdyn.scene.bearing import CustomMaterial, MaterialName
from rbdyn.scene.form_errors import FormErrors
from rbdyn.scene.form_errors import misfits as form_faults
from rbdyn.scene.lubricant import Lubricant
from rbdyn.scene.mounting import Mounting, material_of
from rbdyn.scene.mounting import misfits as mounting_faults
from rbdyn.scene.operation import Speed
from rbdyn.scene.reading import SceneFile

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
    """Everything the equilibrium of a ball bearing needs; made, checked, changed and read as ``Scene`` tells."""

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
        """One sentence for each diameter or oil that is missing, and for each that is told twice in different ways."""
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
        return tuple(faults) or form_faults(self.errors, row.balls, row.ball_diameter_mm, row.pitch_diameter_mm)


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
            what = f"clearance_change_um = {row.clearance_change_um:g} and [mounting] both tell what mounting changes"
            yield f"{what}; leave one out"
    if scene.model.ring_expansion and scene.model.ring_expansion_form == "paper":
        yield "model.ring_expansion_form = 'paper' knows no fits; take [mounting] away or set it to 'thick_ring'"
