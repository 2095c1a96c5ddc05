"""A row of balls at the temperatures that its own friction keeps up: heat balance and equilibrium in one loop.

The map from temperatures to those that balance their heat is exact to round-off, so a search whose slopes are central differences
finds the fixed point to ``TOLERANCE`` (``rbdyn.thermal.fixed_point``). These slopes also give the gain of the loop, and the
ranges of the temperatures over the documented inputs of the balance follow from full solutions.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM, InputError
from rbdyn.base.notes import Note, Notes
from rbdyn.life.balls import FASTEST
from rbdyn.life.friction import ANGULAR_GEOMETRY, DEEP_GROOVE_GEOMETRY, starvation_factor
from rbdyn.quasistatic.heat import Heat, at_temperatures, balance, term_shares
from rbdyn.quasistatic.result import BallResult
from rbdyn.quasistatic.row.model import clearance_of, row_of
from rbdyn.scene.ball import SingleRowScene
from rbdyn.scene.input_ranges import Ranges, input_ranges
from rbdyn.scene.notes import heat_notes
from rbdyn.scene.thermal import Temperatures, Thermal, inlet_temperature, oil_ceiling
from rbdyn.thermal.fixed_point import Search, State, model_of, steady_state
from rbdyn.thermal.losses import HeatModel, gain, log_viscosity
from rbdyn.thermal.network import NODES, carried_off

# Deviation from the balance that counts as none [K]; half of the difference of temperatures that gives slopes [K].
TOLERANCE, DIFFERENCE = 1e-9, 0.01
# Deviation from the balance of an input set of a range [K].
RANGE_TOLERANCE = 0.1
# SKF's friction over the heat of ISO 15312 at the reference speeds of 8 deep groove and 6 angular contact bearings of series 60 to
# 64, 72 and 73 in that catalogue.
LEVELS = {"deep_groove_ball": "0.67 to 0.93", "angular_contact_ball": "1.9 to 2.7"}

# K_Z of SKF's starvation factor by kind, and a factor far below those of bearings at their reference speed.
GEOMETRIES = {"deep_groove_ball": DEEP_GROOVE_GEOMETRY, "angular_contact_ball": ANGULAR_GEOMETRY}
STARVED = 0.1


def slopes_at(scene: SingleRowScene, temperatures: Array) -> Array:
    """dM/dT (4, 4) by central differences. Raises InputError where the bearing is impossible next to these temperatures [C]."""
    assert scene.lubricant is not None
    columns, viscosity = [], log_viscosity(scene.lubricant.at)
    for step in DIFFERENCE * np.eye(len(NODES)):
        above, below = (balance(scene, temperatures + sign * step, viscosity).image for sign in (1.0, -1.0))
        columns.append((above - below) / (2.0 * DIFFERENCE))
    return np.array(columns).T


def steady_temperatures(scene: SingleRowScene) -> Search:
    """Search for steady temperatures of a scene with [thermal].

    It starts at the first guess of the oil's temperature, and where that leads to no stable state also at that of the cold bearing.
    Raises InputError where the bearing is impossible even when cold.
    """
    assert scene.thermal is not None and scene.lubricant is not None
    cold = np.full(len(NODES), inlet_temperature(scene.thermal, scene.lubricant))
    guess = np.full(len(NODES), scene.lubricant.temperature_C)
    for start in (guess, cold):
        search = steady_state(partial(balance, scene), start, cold, _exact_slopes, partial(_model, scene), TOLERANCE)
        if search.status == "steady":
            break
    return search


def _exact_slopes(state: State, near: HeatModel) -> tuple[Array, float]:
    return near.image_slopes(state.temperatures), 0.0


def _model(scene: SingleRowScene, states: Sequence[State]) -> HeatModel:
    """Model of the balance about the last state with its slopes, or with those of all states where a neighbour is impossible."""
    try:
        return states[-1].model.with_image_slopes(slopes_at(scene, states[-1].temperatures))
    except InputError:
        return model_of(states)


def with_temperatures(
    scene: SingleRowScene, solve: Callable[[SingleRowScene], BallResult], ranged: bool = True
) -> BallResult:
    """The result of a scene with [thermal], at its steady temperatures; without such, its temperatures and the path alone.

    ``solve`` gives the result of a scene at stated temperatures. ``ranged``: with ranges over the inputs of the balance.
    """
    try:
        search = steady_temperatures(scene)
    except InputError as error:
        return _seized_cold(scene, str(error.faults[0]), solve)
    last, slopes = search.last, search.slopes
    found: Heat = last.run
    nodes = dict(zip(NODES, last.temperatures.tolist(), strict=True))
    status, reason = str(search.status), f"{search.reason}; gain of the loop {gain(slopes):.2g}"
    if status == "steady":
        status, reason = ceiling_verdict(scene, nodes)
    hot = solve(at_temperatures(scene, Temperatures(**nodes)))
    ranges = ranges_of(scene, last, slopes) if ranged and search.status == "steady" else None
    steady = status == "steady"
    return replace(
        hot,
        status=hot.status if steady else f"{status}: {reason}",
        report=hot.report if steady else None,
        temperatures_C=nodes,
        thermal=_record(scene, search, found, ranges) | {"status": status} | ({} if steady else {"reason": reason}),
        notes=(*_notes(scene, found, ranges), *(hot.notes or ())) if hot.is_equilibrium else None,
        rows=hot.rows if steady else (),
        scene=scene.model_dump(mode="json"),
    )


def _seized_cold(scene: SingleRowScene, reason: str, solve: Callable[[SingleRowScene], BallResult]) -> BallResult:
    """The result of a bearing that is impossible before any heat."""
    assert scene.thermal is not None and scene.lubricant is not None
    nodes = dict.fromkeys(NODES, inlet_temperature(scene.thermal, scene.lubricant))
    cold = solve(at_temperatures(scene, Temperatures(**nodes)))
    thermal = {"status": "seizure", "reason": reason, "gain": None, "path_C": [nodes]}
    input_scene = scene.model_dump(mode="json")
    return replace(cold, status=f"seizure: {reason}", temperatures_C=nodes, thermal=thermal, scene=input_scene)


def ceiling_verdict(scene: SingleRowScene, nodes: dict[str, float]) -> tuple[str, str]:
    """Status and reason of steady temperatures [C]: "too hot" with oil above its ceiling."""
    assert scene.thermal is not None and scene.lubricant is not None
    ceiling = oil_ceiling(scene.thermal, scene.lubricant)
    if nodes["oil"] <= ceiling:
        return "steady", ""
    return (
        "too hot",
        f"the oil reaches {nodes['oil']:.0f} C, above its ceiling of {ceiling:g} C (thermal.oil_ceiling_C)",
    )


def ranges_of(scene: SingleRowScene, state: State, slopes: Array) -> Ranges:
    """Ranges of steady temperatures over the documented inputs of the balance, by a full solution for each input set."""
    assert scene.thermal is not None and scene.lubricant is not None
    cold = np.full(len(NODES), inlet_temperature(scene.thermal, scene.lubricant))
    about = state.model.with_image_slopes(slopes)

    def near(states: Sequence[State]) -> HeatModel:
        return states[-1].model._replace(rest=about.rest)

    def full(thermal: Thermal, start: Array) -> Array | None:
        changed = scene.model_copy(update={"thermal": thermal})
        map_of_set = partial(balance, changed, viscosity=about.losses.log_viscosity)
        search = steady_state(map_of_set, start, cold, _exact_slopes, near, RANGE_TOLERANCE)
        return search.last.temperatures if search.status == "steady" else None

    def clearances(nodes: Array, thermal: Thermal) -> dict[str, float]:
        changed = scene.model_copy(update={"thermal": thermal})
        return {"radial_um": 1e6 * clearance_of(row_of(at_temperatures(changed, Temperatures(*nodes.tolist()))).row)[0]}

    return input_ranges(scene, about, lambda share: term_shares(scene, share), clearances, {}, full=full)


def _record(scene: SingleRowScene, search: Search, found: Heat, ranges: Ranges | None) -> dict[str, Any]:
    inner, outer = found.scene.operation.speeds
    speed = abs(inner - outer)
    return {
        "status": "",
        "gain": gain(search.slopes),
        "heat_W": dict(zip(NODES, found.heat.tolist(), strict=True)),
        **_geometry(scene, found),
        "friction_W": {"rolling": speed * found.moments.rolling, "sliding": speed * found.moments.sliding},
        "friction_loads_N": found.loads._asdict(),
        "carried_off_W": carried_off(found.conductances, found.boundaries, search.last.image),
        "conductances_W_K": found.conductances._asdict(),
        **({"ranges": None} if ranges is None else ranges.as_dict()),
        "path_C": [dict(zip(NODES, state.temperatures.tolist(), strict=True)) for state in search.states],
        "path_heat_W": [float(state.run.heat.sum()) for state in search.states],
        "path_clearance_um": [1e6 * clearance_of(state.run.model.row)[0] for state in search.states],
    }


def _geometry(scene: SingleRowScene, found: Heat) -> dict[str, Any]:
    """Diametral clearance and unloaded contact angle, drawn and in operation."""
    drawn = row_of(scene.model_copy(update={"mounting": None, "thermal": None}))
    sizes = {"drawn": clearance_of(drawn.row), "operating": clearance_of(found.model.row)}
    return {
        "clearance_um": {name: 1e6 * clearance for name, (clearance, _) in sizes.items()},
        "unloaded_angle_deg": {name: math.degrees(angle) for name, (_, angle) in sizes.items()},
    }


def _notes(scene: SingleRowScene, found: Heat, ranges: Ranges | None) -> Notes:
    """What the heat balance leaves open."""
    kind, (inner, outer), mounting = scene.bearing.kind, scene.operation.speeds, scene.mounting
    thermal, lubricant, hot = scene.thermal, scene.lubricant, found.scene.lubricant
    assert mounting is not None and mounting.width is not None
    assert thermal is not None and lubricant is not None and hot is not None
    level = (
        f"temperatures: their heat is SKF's friction model, {LEVELS[kind]} times the heat of ISO 15312 at reference speed, which no "
        "range includes"
    )
    notes = [Note("left-out", level)]
    fast = abs(inner - outer) * 0.5 * (mounting.bore + mounting.outside_diameter)
    if fast > FASTEST[kind]:
        sentence = (
            f"temperatures: n d_m = {1e-3 * fast / RPM:.2g} million mm/min is above the reference speeds of such bearings, where SKF's "
            "friction was not verified"
            + ("; at 1.4 million it was 2.9 times the loss in NASA TP-2275" if kind == "angular_contact_ball" else "")
        )
        notes.append(Note("unverified", sentence))
    oil = hot.in_service
    sizes = mounting.bore, mounting.outside_diameter, inner - outer, oil.viscosity / oil.density
    rest = starvation_factor(GEOMETRIES[kind], *sizes, lubricant.supply)
    if rest < STARVED:
        sentence = (
            f"temperatures: SKF's starvation factor of {rest:.2g} removes the rolling friction of so thick an oil; the heat is "
            "too low; take a thinner oil or warm it"
        )
        notes.append(Note("starved", sentence))
    notes += [] if ranges is None else ranges.notes
    return (*notes, *heat_notes(thermal, lubricant, mounting, mounting.width))
