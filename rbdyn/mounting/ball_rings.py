"""From a scene to the growth of its races: rotation alone, or fits, temperatures and rotation of a mounted bearing."""

from typing import Any, NamedTuple

from rbdyn.fields import RPM
from rbdyn.mounting.fits import mounted_rings
from rbdyn.mounting.ring_growth import UNCHANGED, GrooveChange, groove_change, printed_growth
from rbdyn.mounting.rings import MountedRings, Ring
from rbdyn.records.record import finite
from rbdyn.scene.ball import BallScene, DoubleDeckerScene, SingleRowScene
from rbdyn.scene.ball_bearing import BallRow
from rbdyn.scene.mounting import raceway_radii


class RingPair(NamedTuple):
    """The rings on the shaft and in the housing, with the pressures of their fits [Pa] and the balls' rise [K].

    None for a ring that does not change.
    """

    inner: Ring | None
    outer: Ring | None
    inner_pressure: float = 0.0
    outer_pressure: float = 0.0
    ball_rise: float = 0.0


def mounted_of(scene: BallScene) -> MountedRings | None:
    """Shaft, rings and housing of a mounted bearing; None where the scene tells no mounting."""
    if scene.mounting is None:
        return None
    materials = scene.material("inner_ring"), scene.material("outer_ring")
    return mounted_rings(scene.mounting, scene.bearing, *materials, *scene.operation.speeds)


def row_change(scene: SingleRowScene) -> GrooveChange:
    """What growth does to a single row."""
    if not changes(scene):
        return UNCHANGED
    if printed(scene):
        return GrooveChange(_printed(scene, scene.bearing, "inner_ring", scene.operation.inner_speed), 0.0, 0.0)
    rings = _pair(scene)
    return _between(scene, scene.bearing, rings.inner, rings.outer, rings)


def layer_changes(scene: DoubleDeckerScene, middle_speed: float) -> tuple[GrooveChange, GrooveChange]:
    """What growth does to the inner and to the outer row of a double-decker, its middle ring at a speed [rad/s].

    The printed form knows inner ring and middle ring, each at the pitch circle of the row outside it, and no growth of the
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
    """Whether the scene asks for any growth."""
    return scene.model.ring_expansion or scene.mounting is not None


def printed(scene: BallScene) -> bool:
    """Whether growth follows the printed form of Hu et al."""
    return scene.model.ring_expansion_form == "paper" and scene.mounting is None


def growth_record(scene: BallScene, names: dict[str, GrooveChange]) -> dict[str, Any]:
    """What is reported of growth and fits; empty where the scene asks for none."""
    if not changes(scene):
        return {}
    record: dict[str, Any] = {"ring_growth_um": {name: 1e6 * change.radial for name, change in names.items()}}
    rings = mounted_of(scene)
    if rings is not None:
        record["fits"] = {
            "inner_pressure_MPa": 1e-6 * rings.inner_pressure,
            "outer_pressure_MPa": 1e-6 * rings.outer_pressure,
            # null: at no speed.
            "inner_ring_loosens_rpm": finite(rings.loosening_speed / RPM),
            "inner_ring_loose": rings.inner_pressure == 0.0,
        }
    return record


def _pair(scene: BallScene) -> RingPair:
    rings = mounted_of(scene)
    if rings is not None:
        pressures = rings.inner_pressure, rings.outer_pressure
        return RingPair(rings.inner_ring, rings.outer_ring, *pressures, rings.element_temperature_rise)
    (below, above), (inner_speed, outer_speed) = scene.outermost_rows, scene.operation.speeds
    inner_race, outer_race = raceway_radii(scene.bearing)
    inner = outer = None
    # A standing ring does not grow, and its bore or outside need not be known.
    if inner_speed != 0.0:
        assert below.bore is not None
        inner = Ring(0.5 * below.bore, inner_race, scene.material("inner_ring"), speed=inner_speed)
    if outer_speed != 0.0:
        assert above.outside_diameter is not None
        outer = Ring(outer_race, 0.5 * above.outside_diameter, scene.material("outer_ring"), speed=outer_speed)
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
    assert row.bore is not None
    return printed_growth(row.pitch_diameter, row.bore, scene.material(ring), speed)
