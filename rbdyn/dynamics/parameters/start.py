"""A cold roller bearing that warms: capacities of its parts, seats, clearances at temperatures, course, and records of these."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM, given
from rbdyn.dynamics.parameters.heat import cavity_of, ring_width
from rbdyn.mounting.rings import MountedRings
from rbdyn.scene import Scene
from rbdyn.scene.fits import mounted_rings
from rbdyn.scene.thermal import Temperatures, Thermal, part_temperatures, turning_speed
from rbdyn.thermal import start as warming
from rbdyn.thermal.fixed_point import State
from rbdyn.thermal.network import NODES, Boundaries

# Names of clearances in JSON by those of a scene.
NAMES = {"radial": "radial_um", "guide": "guide_um", "pocket": "pocket_um"}


def capacities(scene: Scene, thermal: Thermal) -> Array:
    """Heat capacities of ``WARMING_NODES`` [J/K], from the drawing.

    The oil is what the cavity holds: full for a bath, which has as much again at its sides, else the oil fraction.
    """
    rollers = (
        scene.bearing.rollers * scene.geometry.roller_mass * scene.material("roller").heat_capacity
        + scene.cage.mass * scene.material("cage").heat_capacity
    )
    oil = scene.oil()
    fill = 1.0 if scene.lubricant.supply == "bath" else scene.lubricant.oil_fraction
    full = fill * cavity_of(scene) * oil.density * oil.heat_capacity
    return warming.capacities_of(_rings(scene), ring_width(scene), given(thermal.start).widths, full, rollers)


def _rings(scene: Scene) -> MountedRings:
    material = scene.material("rings")
    return mounted_rings(given(scene.mounting), scene.bearing, material, material, *scene.operation.speeds)


def seats_of(hot: Scene) -> warming.Seats:
    """Conductances of both seats of a scene at temperatures: the gap of a loose fit has oil [W/K]."""
    return warming.seats_between(_rings(hot), ring_width(hot), hot.oil().conductivity)


class Clearances(NamedTuple):
    """Diametral clearances at temperatures [um] by their name in JSON, and what is left of others before parts touch [um]."""

    figures: dict[str, Array]
    left: dict[str, Array]


def clearances_at(hot: Scene, thermal: Thermal, temperatures: Array, speed_ratio: Array | float = 1.0) -> Clearances:
    """Clearances at temperatures (..., 6) [C] and speeds over that of the scene; rotation changes them by its square.

    ``hot``: the scene with stated temperatures, whose own do not count. ``left``: of what seizes, by name.
    """
    nodes = Temperatures(*np.moveaxis(temperatures[..., : len(NODES)], -1, 0))
    keys = part_temperatures(
        thermal, nodes, seats=(temperatures[..., warming.HOUSING], temperatures[..., warming.SHAFT])
    )
    turning = given(hot.mounting).model_copy(update=keys)
    found = [_clearances(hot, turning), _clearances(hot, turning.model_copy(update={"rotation": False}))]

    def blend(name: str, place: int) -> Array:
        fast, still = (1e6 * np.asarray(each[place][name]) for each in found)
        return np.asarray(still + (fast - still) * speed_ratio**2 + 0.0 * nodes.outer)

    return Clearances(*({name: blend(name, place) for name in found[0][place]} for place in (0, 1)))


def _clearances(hot: Scene, mounting: Any) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
    """Clearances [m], and how much of those that may not be lost is left."""
    plays = {NAMES[name]: play for name, play in hot.clearances_of(mounting).items()}
    running = hot.running_clearances(mounting)
    left = {name: play.play.operating - play.touching for name, play in running.items() if math.isfinite(play.touching)}
    return plays, left


def at_point(scene: Scene, speed: float, load: float) -> Scene:
    """The scene at another speed [rad/s] and load [N]; both rings keep their ratio. Raises InputError."""
    if (speed, load) == (turning_speed(scene.operation.speeds), scene.operation.radial_load_N):
        return scene
    inner, outer = (speed / turning_speed(scene.operation.speeds) * value / RPM for value in scene.operation.speeds)
    return scene.changed(
        {"operation.inner_speed_rpm": inner, "operation.outer_speed_rpm": outer, "operation.radial_load_N": load}
    )


class Machine(NamedTuple):
    """What stays over a start: scene, scene at temperatures, capacities (6,) [J/K], course, temperatures at the start (6,), state.

    ``end``: time after which the slowest node is steady [s].
    """

    scene: Scene
    hot: Scene
    thermal: Thermal
    capacities: Array
    course: warming.Course
    cold: Array
    state: State
    boundaries: Boundaries
    end: float

    def clearances(
        self, rows: warming.Warming, thermal: Thermal | None = None
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Clearances [um] by name over time, and what is left of those that may not be lost."""
        speeds = self.course.at(rows.times)[0] / turning_speed(self.scene.operation.speeds)
        ratios = speeds.reshape(-1, *[1] * (rows.temperatures.ndim - 2))
        return clearances_at(self.hot, thermal or self.thermal, rows.temperatures, ratios)


class Path(NamedTuple):
    """A course of temperatures with its clearances [um] and the lead of the inner ring [K] by name, until a part seizes.

    ``seizing``: the clearance that is lost at the end, if any.
    """

    rows: warming.Warming
    figures: dict[str, Array]
    seizing: str | None


class Simulated(NamedTuple):
    """A simulated moment: the ``moment`` of the law, its time [s], speed [rad/s], load [N], what is ``around`` it, and its power's error."""

    moment: warming.Moment
    time: float | None
    speed: float
    load: float
    around: warming.Surroundings
    scatter: float
