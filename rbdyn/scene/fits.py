"""Rings, fits, operating clearances and growth of ball races from the mounting table of a scene."""

from typing import Any, NamedTuple

from rbdyn.base.faults import RPM, given
from rbdyn.base.records import Record, finite
from rbdyn.mounting.cage import CageBody, CageClearances, guide_clearance, pocket_circle_shift, pocket_clearance
from rbdyn.mounting.rings import (
    UNCHANGED,
    GrooveChange,
    MountedClearance,
    MountedRings,
    Ring,
    groove_change,
    mounted_clearance,
    printed_growth,
)
from rbdyn.properties.materials import Material
from rbdyn.scene.ball import BallRow, BallScene, DoubleDeckerScene, SingleRowScene
from rbdyn.scene.bearing import Bearing, Cage, Materials, material_of
from rbdyn.scene.operation import Mounting, Raceways, raceway_radii


class RunningSpeeds(NamedTuple):
    """Speeds of inner ring, outer ring and cage [rad/s]."""

    inner: float
    outer: float
    cage: float


def mounted_rings(
    mounting: Mounting,
    bearing: Raceways,
    inner_material: Material,
    outer_material: Material,
    inner_speed: float,
    outer_speed: float = 0.0,
) -> MountedRings:
    """Rings of a scene's bearing, of rollers or balls, as mounted, at speeds [rad/s] of shaft and housing.

    Raises ValueError where ``rbdyn.scene.operation.faults`` finds any.
    """
    reference = mounting.reference_temperature_C
    inner_rise = _rise(mounting.inner_ring_temperature_C, reference, 0.0)
    outer_rise = _rise(mounting.outer_ring_temperature_C, reference, 0.0)
    shaft_rise = _rise(mounting.shaft_temperature_C, reference, inner_rise)
    housing_rise = _rise(mounting.housing_temperature_C, reference, outer_rise)
    element_rise = _rise(mounting.roller_temperature_C, reference, 0.5 * (inner_rise + outer_rise))
    inner_speed, outer_speed = (inner_speed, outer_speed) if mounting.rotation else (0.0, 0.0)

    shaft_bore, bore = 0.5 * mounting.shaft_bore, 0.5 * mounting.bore
    outside, housing_outside = 0.5 * mounting.outside_diameter, 0.5 * mounting.housing_diameter
    inner_race, outer_race = raceway_radii(bearing)
    return MountedRings(
        shaft=Ring(shaft_bore, bore, material_of(mounting.shaft_material), shaft_rise, inner_speed),
        inner_ring=Ring(bore, inner_race, inner_material, inner_rise, inner_speed),
        outer_ring=Ring(outer_race, outside, outer_material, outer_rise, outer_speed),
        housing=Ring(outside, housing_outside, material_of(mounting.housing_material), housing_rise, outer_speed),
        inner_interference=mounting.inner_interference,
        outer_interference=mounting.outer_interference,
        element_temperature_rise=element_rise,
    )


def operating_clearance(
    mounting: Mounting, bearing: Bearing, materials: Materials, inner_speed: float, outer_speed: float = 0.0
) -> MountedClearance:
    """Diametral clearance of a scene's roller bearing as mounted, at speeds [rad/s] of shaft and housing.

    ``bearing.radial_clearance_mm`` is the clearance before mounting. Raises ValueError as ``mounted_rings``.
    """
    material = material_of(materials.rings)
    rings = mounted_rings(mounting, bearing, material, material, inner_speed, outer_speed)
    return mounted_clearance(bearing.radial_clearance, rings, bearing.roller_diameter, material_of(materials.roller))


def cage_temperature_rise(mounting: Mounting, guidance: str, rings: MountedRings) -> float:
    """Rise of a cage above the drawing [K]: stated, else the mean of the rollers and the guiding ring."""
    rollers = rings.element_temperature_rise
    guides = {"outer": rings.outer_ring.temperature_rise, "inner": rings.inner_ring.temperature_rise, "roller": rollers}
    return _rise(mounting.cage_temperature_C, mounting.reference_temperature_C, 0.5 * (rollers + guides[guidance]))


def cage_clearances(
    mounting: Mounting, bearing: Bearing, cage: Cage, materials: Materials, land_diameter: float, speeds: RunningSpeeds
) -> CageClearances:
    """Clearances of a scene's cage as mounted, with its land on a ring at ``land_diameter`` [m].

    The keys of ``cage`` are clearances of the drawing. Raises ValueError as ``mounted_rings``.
    """
    material, roller = material_of(materials.rings), material_of(materials.roller)
    rings = mounted_rings(mounting, bearing, material, material, speeds.inner, speeds.outer)
    rise = cage_temperature_rise(mounting, cage.guidance, rings)
    turning = speeds.cage if mounting.rotation else 0.0
    body = CageBody(material_of(materials.cage), cage.hoop_modulus_share, rise, turning)
    hot_roller = bearing.roller_diameter, roller, rings.element_temperature_rise
    play, lip = cage.guide_clearance, cage.lip_clearance
    return CageClearances(
        None
        if cage.guidance == "roller" or play is None
        else guide_clearance(play, 0.5 * land_diameter, cage.guidance, rings, body),
        pocket_clearance(cage.pocket_clearance, *hot_roller, body),
        None if lip is None else pocket_clearance(lip, *hot_roller, body),
        pocket_circle_shift(0.5 * bearing.pitch_diameter, rings, body),
    )


def _rise(temperature: float | None, reference: float, otherwise: float) -> float:
    return otherwise if temperature is None else temperature - reference


class RingPair(NamedTuple):
    """The rings on the shaft and in the housing (None without growth), the pressures of their fits [Pa] and the balls' rise [K]."""

    inner: Ring | None
    outer: Ring | None
    inner_pressure: float = 0.0
    outer_pressure: float = 0.0
    ball_rise: float = 0.0


def mounted_of(scene: BallScene) -> MountedRings | None:
    """Shaft, rings and housing of a mounted bearing; None where the scene has no mounting."""
    if scene.mounting is None:
        return None
    materials = scene.material("inner_ring"), scene.material("outer_ring")
    return mounted_rings(scene.mounting, scene.bearing, *materials, *scene.operation.speeds)


def race_film_temperature(scene: BallScene, race: str) -> float:
    """Temperature of the film between balls and the "inner" or "outer" race of a single row [C].

    That of the oil, or with ``film_temperature = "parts"`` the mean of both surfaces.
    """
    lubricant, mounting = given(scene.lubricant), scene.mounting
    if lubricant.film_temperature == "oil" or mounting is None:
        return lubricant.temperature_C
    rings = given(mounted_of(scene))
    ring = rings.inner_ring if race == "inner" else rings.outer_ring
    return mounting.reference_temperature_C + 0.5 * (ring.temperature_rise + rings.element_temperature_rise)


def row_change(scene: SingleRowScene) -> GrooveChange:
    """Changes of a single row by growth."""
    if not changes(scene):
        return UNCHANGED
    if printed(scene):
        return GrooveChange(_printed(scene, scene.bearing, "inner_ring", scene.operation.inner_speed), 0.0, 0.0)
    rings = _pair(scene)
    return _between(scene, scene.bearing, rings.inner, rings.outer, rings)


def layer_changes(scene: DoubleDeckerScene, middle_speed: float) -> tuple[GrooveChange, GrooveChange]:
    """Changes of the inner and the outer row of a double-decker bearing by growth, its middle ring at a speed [rad/s].

    The printed form has inner ring and middle ring only, each at the pitch circle of the row outside it. It has no growth of the
    middle ring's bore. A mounted middle ring has the mean temperature of the other two.
    """
    if not changes(scene):
        return UNCHANGED, UNCHANGED
    bearing = scene.bearing
    if printed(scene):
        inner = _printed(scene, bearing.inner, "inner_ring", scene.operation.inner_speed)
        middle_growth = _printed(scene, bearing.outer, "middle_ring", middle_speed)
        return GrooveChange(inner, 0.0, 0.0), GrooveChange(middle_growth, 0.0, 0.0)
    rings = _pair(scene)
    still = scene.mounting is not None and not scene.mounting.rotation
    races = raceway_radii(bearing.inner)[1], raceway_radii(bearing.outer)[0]
    rise = 0.5 * sum(ring.temperature_rise for ring in (rings.inner, rings.outer) if ring is not None)
    middle = Ring(*races, scene.material("middle_ring"), rise, 0.0 if still else middle_speed)
    below, above = (bearing.inner, rings.inner, middle), (bearing.outer, middle, rings.outer)
    return _between(scene, *below, rings), _between(scene, *above, rings)


def changes(scene: BallScene) -> bool:
    """Whether the scene includes growth."""
    return scene.model.ring_expansion or scene.mounting is not None


def printed(scene: BallScene) -> bool:
    """Whether growth follows the printed form of Hu et al."""
    return scene.model.ring_expansion_form == "paper" and scene.mounting is None


class Fits(Record):
    """Pressures between rings and seats, and whether the inner ring is loose; ``inner_ring_loosens_rpm``: None at no speed."""

    inner_pressure_MPa: float  # noqa: N815
    outer_pressure_MPa: float  # noqa: N815
    inner_ring_loosens_rpm: float | None
    inner_ring_loose: bool


def growth_record(scene: BallScene, names: dict[str, GrooveChange]) -> dict[str, Any]:
    """Growth and fits as reported; empty for a scene without growth."""
    if not changes(scene):
        return {}
    record: dict[str, Any] = {"ring_growth_um": {name: 1e6 * change.radial for name, change in names.items()}}
    rings = mounted_of(scene)
    if rings is not None:
        pressures = 1e-6 * rings.inner_pressure, 1e-6 * rings.outer_pressure
        record["fits"] = Fits(*pressures, finite(rings.loosening_speed / RPM), rings.inner_pressure == 0.0)
    return record


def _pair(scene: BallScene) -> RingPair:
    rings = mounted_of(scene)
    if rings is not None:
        pressures = rings.inner_pressure, rings.outer_pressure
        return RingPair(rings.inner_ring, rings.outer_ring, *pressures, rings.element_temperature_rise)
    (below, above), (inner_speed, outer_speed) = scene.outermost_rows, scene.operation.speeds
    inner_race, outer_race = raceway_radii(scene.bearing)
    inner = outer = None
    # A ring at rest does not grow, so its bore or outside diameter may be missing.
    if inner_speed != 0.0:
        inner = Ring(0.5 * given(below.bore), inner_race, scene.material("inner_ring"), speed=inner_speed)
    if outer_speed != 0.0:
        outer = Ring(outer_race, 0.5 * given(above.outside_diameter), scene.material("outer_ring"), speed=outer_speed)
    return RingPair(inner, outer)


def _between(scene: BallScene, row: BallRow, inner: Ring | None, outer: Ring | None, rings: RingPair) -> GrooveChange:
    return groove_change(
        inner,
        outer,
        row.ball_diameter,
        row.groove_factors,
        row.contact_angle,
        ball_material=scene.material("ball"),
        ball_temperature_rise=rings.ball_rise,
        inner_pressure=rings.inner_pressure if inner is rings.inner else 0.0,
        outer_pressure=rings.outer_pressure if outer is rings.outer else 0.0,
    )


def _printed(scene: BallScene, row: BallRow, ring: str, speed: float) -> float:
    if speed == 0.0:
        return 0.0
    return printed_growth(row.pitch_diameter, given(row.bore), scene.material(ring), speed)
