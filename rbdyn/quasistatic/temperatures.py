"""A row of balls at the temperatures that its own friction keeps up: heat balance and equilibrium in one loop.

The map from temperatures to those that balance their heat is exact to round-off, so a search whose slopes are central differences
finds the fixed point to ``TOLERANCE`` (``rbdyn.thermal.fixed_point``). These slopes also give the gain of the loop, and the
ranges of the temperatures over the documented inputs of the balance follow from full solutions.

The heat is that of SKF's friction model. The loads of the friction are those of the equilibrium at the temperatures of the nodes: a ring that warms changes clearance,
contact angle and, where it is fixed axially, its preload. A ball's own losses are not computed; SKF's rolling and sliding moment
are split over the nodes as those of rollers are (``rbdyn.thermal.losses``), half of each to either race.

SKF's model is for normal clearance. In a deep groove bearing the ball loads beyond those that carry the load count as preload;
angular contact bearings relieve a radial growth by their axial load, which the model has.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import RPM, InputError, given
from rbdyn.base.notes import Note, Notes
from rbdyn.contact import point_contact
from rbdyn.contact.point_contact import PointContact
from rbdyn.life import friction
from rbdyn.life.balls import FASTEST, static_capacity
from rbdyn.properties.catalogue import diameter_series
from rbdyn.properties.materials import MATERIALS, equivalent_modulus
from rbdyn.quasistatic.result import BallResult, Rating, overload, reference_capacities
from rbdyn.quasistatic.row.equilibrium import Solution, solve
from rbdyn.quasistatic.row.model import RowModel, cage_speed, clearance_of, constraint_of, load_of, row_of
from rbdyn.result import BallHeatBalance, ColdSeizure, Ranges
from rbdyn.scene.ball import SingleRowScene
from rbdyn.scene.fits import race_film_temperature
from rbdyn.scene.input_ranges import input_ranges
from rbdyn.scene.notes import heat_notes
from rbdyn.scene.operation import raceway_radii
from rbdyn.scene.thermal import Temperatures, Thermal, inlet_temperature, oil_ceiling, over_ceiling, part_temperatures
from rbdyn.thermal.fixed_point import Search, State, model_of, steady_state
from rbdyn.thermal.losses import TERMS, Effusivities, HeatModel, Losses, gain, log_viscosity, no_residue, shares
from rbdyn.thermal.network import (
    NODES,
    OIL,
    Boundaries,
    Conductances,
    carried_off,
    half_space_contact,
    surface_coefficient,
    temperatures,
)

# Series of SKF's table 3a by the diameter series of ISO 15.
SERIES = {"8": "618", "9": "619", "0": "60", "2": "62", "3": "63", "4": "64"}
# Sum of the ball loads over the radial load of a half load zone: J_a/J_r of Sjövall for point contacts.
HALF_ZONE = 0.2782 / 0.2288
# Integral of (1 - x^2)^(1/4) over 0 to 1: what an ellipse conducts over a rectangle of its axes, since strips at its ends are short.
ELLIPSE = 0.8740
MINERAL = ("mineral", "naphthenic")
# Exponent of the viscosity in SKF's rolling moment.
ROLLING_POWER = 0.6


def at_temperatures(
    scene: SingleRowScene, temperatures: Temperatures, seats: tuple[float, float] | None = None
) -> SingleRowScene:
    """The scene with stated temperatures in place of its heat balance; ``seats`` as of ``part_temperatures``.

    It is a copy without validation: temperatures are numbers of the balance, and an impossible bearing shows in its equilibrium.
    """
    thermal, lubricant, mounting = given(scene.thermal), given(scene.lubricant), given(scene.mounting)
    oil: dict[str, Any] = {"temperature_C": temperatures.oil, "film_temperature": "parts"}
    if lubricant.viscosity_mPas is not None:
        oil["viscosity_mPas"] = 1e3 * lubricant.at(temperatures.oil).viscosity
    parts = part_temperatures(thermal, temperatures, cage=False, seats=seats)
    tables = {
        "thermal": None,
        "lubricant": lubricant.model_copy(update=oil),
        "mounting": mounting.model_copy(update=parts),
    }
    return scene.model_copy(update=tables)


class Loads(NamedTuple):
    """Loads of the friction model [N]: radial, axial, and the sum of the ball loads of a radial preload."""

    radial: float
    axial: float
    preload: float


class Heat(NamedTuple):
    """A row at temperatures: its equilibrium, loads, friction moments [N m], the losses of each term [W], (terms,), the share of each
    node in these, (terms, 4), and its network."""

    scene: SingleRowScene
    model: RowModel
    solution: Solution
    loads: Loads
    moments: friction.FrictionMoments
    powers: Array
    shares: Array
    conductances: Conductances
    boundaries: Boundaries

    @property
    def heat(self) -> Array:
        """Heat of each node [W], (4,)."""
        return np.asarray(self.powers @ self.shares)


def static_capacity_of(scene: SingleRowScene, model: RowModel) -> float:
    """C_0 of the row [N], from the catalogue or else by ISO 76."""
    stated = scene.bearing.static_capacity_N
    if stated is not None:
        return stated
    return static_capacity(scene.bearing.balls, scene.bearing.rated_angle, (model.inner_contact, model.outer_contact))


def loads_of(scene: SingleRowScene, model: RowModel, solution: Solution) -> Loads:
    """Loads of the friction model from an equilibrium.

    The preload of a deep groove bearing is what the ball loads sum to beyond 1.22 F_r + F_a/sin alpha_F: no load zone without
    preload has more, if its clearance is normal.
    """
    x, y, z = np.abs(solution.reaction[:3]).tolist()
    radial = math.hypot(x, y)
    if scene.bearing.kind != "deep_groove_ball":
        return Loads(radial, z, 0.0)
    carries = HALF_ZONE * radial
    if z > 0.0:
        carries += z / math.sin(min(friction.deep_groove_angle(z, static_capacity_of(scene, model)), 0.5 * math.pi))
    return Loads(radial, z, max(float(solution.inner_load.sum()) - carries, 0.0))


def running_of(scene: SingleRowScene) -> friction.Running:
    """Sizes, speed and oil of a row at the temperature of its oil, for SKF's model."""
    lubricant, mounting, (inner, outer) = given(scene.lubricant), given(scene.mounting), scene.operation.speeds
    oil, sizes = lubricant.in_service, (mounting.bore, mounting.outside_diameter)
    return friction.Running(*sizes, inner - outer, oil.viscosity / oil.density, lubricant.supply)


def friction_of(scene: SingleRowScene, model: RowModel, loads: Loads) -> friction.FrictionMoments:
    """SKF's moments [N m] of a row at the temperature of its oil."""
    running, base = running_of(scene), given(scene.lubricant).base_oil_name
    film = friction.MINERAL_FILM if base in MINERAL else friction.SYNTHETIC_FILM
    if scene.bearing.kind == "deep_groove_ball":
        series = SERIES[diameter_series(1e3 * running.bore, 1e3 * running.outside)]
        assert series in friction.DEEP_GROOVE
        capacity = static_capacity_of(scene, model)
        return friction.deep_groove_moments(
            series, running, loads.radial, loads.axial, capacity, preload=loads.preload, film_friction=film
        )
    ratio = scene.material("ball").density / MATERIALS["bearing_steel"].density
    return friction.angular_contact_moments(running, loads.radial, loads.axial, density_ratio=ratio, film_friction=film)


def powers_of(scene: SingleRowScene, moments: friction.FrictionMoments) -> Array:
    """Losses in the order of ``losses.TERMS`` [W], (terms,): half of each moment's power at either race."""
    inner, outer = scene.operation.speeds
    rolling, sliding = (0.5 * abs(inner - outer) * moment for moment in moments)
    by_kind = {"race_traction": sliding, "rolling_resistance": rolling}
    return np.array([by_kind.get(term.partition("_")[2], 0.0) for term in TERMS])


def term_shares(scene: SingleRowScene, film_to_oil: float) -> Array:
    """Share of each node in the losses, (terms, 4), split like those of rollers; ``film_to_oil`` of the heat of films is the oil's."""
    ball, rows = scene.material("ball").effusivity, np.zeros((len(TERMS), len(NODES)))
    for race in ("outer", "inner"):
        ring = scene.material(f"{race}_ring").effusivity
        of_race = [place for place, term in enumerate(TERMS) if term.startswith(race)]
        rows[of_race] = shares(Effusivities(ring, ball, ring), "roller", film_to_oil)[of_race]
    return rows


def contact_conductance(scene: SingleRowScene, contact: PointContact, race: str, loads: Array) -> float:
    """Conductance of all balls to a race [W/K]: of each 1/G = h/(pi a b k_oil) + 1/G of two half-spaces that meet over an ellipse.

    The film h is that of pure rolling at the temperature of its surfaces, reduced by inlet heating; the oil in it conducts as
    at ambient pressure.
    """
    drawing, oil = scene.bearing, given(scene.lubricant).at(race_film_temperature(scene, race))
    ball, ring = scene.material("ball"), scene.material(f"{race}_ring")
    gamma = drawing.gamma if race == "inner" else -drawing.gamma
    speed = point_contact.entrainment_speed(drawing.pitch_diameter, drawing.gamma, *scene.operation.speeds)
    loaded = loads[loads > 0.0]
    if loaded.size == 0:
        return 0.0
    radius = point_contact.rolling_radius(drawing.ball_diameter, gamma)
    rolling = point_contact.RollingBall(contact, radius, equivalent_modulus(ball, ring), speed)
    film = point_contact.central_film(rolling, oil, loaded) * point_contact.thermal_factor(rolling, oil, loaded)
    across, along = contact.semi_major * np.cbrt(loaded), contact.semi_minor * np.cbrt(loaded)
    bodies = half_space_contact(along, 2.0 * ELLIPSE * across, speed, ring.effusivity, ball.effusivity)
    resistance = film / (math.pi * across * along * oil.conductivity) + 1.0 / bodies
    return float((1.0 / resistance).sum())


def conductances_of(scene: SingleRowScene, thermal: Thermal, model: RowModel, solution: Solution) -> Conductances:
    """Network of a row at temperatures. Its surfaces are the cylinders of the raceways over the width, and the balls; no cage."""
    lubricant, mounting, drawing = given(scene.lubricant), given(scene.mounting), scene.bearing
    oil, width = lubricant.in_service, given(mounting.width)
    inner, outer = raceway_radii(drawing)
    cage = cage_speed(drawing, *scene.operation.speeds)
    transfer = thermal.surface_factor * surface_coefficient(oil, cage, drawing.pitch_diameter)
    return Conductances(
        **thermal.ways_out(lubricant, oil, mounting, width),
        oil_outer=transfer * 2.0 * math.pi * outer * width,
        oil_inner=transfer * 2.0 * math.pi * inner * width,
        oil_rollers=transfer * drawing.balls * math.pi * drawing.ball_diameter**2,
        outer_rollers=thermal.contact_factor
        * contact_conductance(scene, model.outer_contact, "outer", solution.outer_load),
        inner_rollers=thermal.contact_factor
        * contact_conductance(scene, model.inner_contact, "inner", solution.inner_load),
    )


def heat_at(scene: SingleRowScene, nodes: Array, seats: tuple[float, float] | None = None) -> Heat:
    """The row of a scene with [thermal] at temperatures of its nodes (4,) [C]; ``seats`` as of ``part_temperatures``.

    Raises InputError where it has no equilibrium or is overloaded there.
    """
    thermal = given(scene.thermal)
    hot = at_temperatures(scene, Temperatures(*nodes.tolist()), seats)
    model = row_of(hot)
    solution = solve(model.row, model.control, load_of(hot), constraint_of(hot))
    status = solution.status
    if solution.is_equilibrium:
        rating = Rating(hot.bearing, model, reference_capacities(hot.bearing), hot.operation.speeds)
        status = overload(solution, rating) or status
    if status != solution.status or not solution.is_equilibrium:
        places = ", ".join(f"{node} {value:.4g}" for node, value in zip(NODES, nodes, strict=True))
        raise InputError(f"the bearing at {places} C: {status}")
    loads = loads_of(hot, model, solution)
    moments = friction_of(hot, model, loads)
    boundaries = Boundaries(inlet_temperature(thermal, given(scene.lubricant)), thermal.ambient_C)
    return Heat(
        hot,
        model,
        solution,
        loads,
        moments,
        powers_of(hot, moments),
        term_shares(hot, thermal.film_share_to_oil),
        conductances_of(hot, thermal, model, solution),
        boundaries,
    )


def balance(scene: SingleRowScene, nodes: Array, viscosity: Array | None = None) -> State:
    """The map of the fixed point: temperatures [C], and those at which the network carries off their heat.

    ``viscosity``: ``log_viscosity`` of the oil where another scene has it, which takes longer than all else. Raises InputError as ``heat_at``.
    """
    found = heat_at(scene, nodes)
    films = np.zeros((len(TERMS), len(NODES)))
    films[:, OIL] = 1.0
    exponents = np.array([ROLLING_POWER * term.endswith("rolling_resistance") for term in TERMS])
    if viscosity is None:
        viscosity = scene.once("log_viscosity", partial(log_viscosity, given(scene.lubricant).at))
    losses = Losses(nodes, found.powers, exponents, films, viscosity)
    model = HeatModel(losses, found.shares, found.conductances, found.boundaries, no_residue())
    image = temperatures(found.conductances, found.boundaries, found.heat)
    return State(nodes, image, np.zeros(len(NODES)), model, found)


# Deviation from the balance that counts as none [K]; half of the difference of temperatures that gives slopes [K].
TOLERANCE, DIFFERENCE = 1e-9, 0.01
# Deviation from the balance of an input set of a range [K].
RANGE_TOLERANCE = 0.1
# SKF's friction over the heat of ISO 15312 at the reference speeds of 8 deep groove and 6 angular contact bearings of series 60 to
# 64, 72 and 73 in that catalogue.
LEVELS = {"deep_groove_ball": "0.67 to 0.93", "angular_contact_ball": "1.9 to 2.7"}

# K_Z of SKF's starvation factor by kind.
GEOMETRIES = {"deep_groove_ball": friction.DEEP_GROOVE_GEOMETRY, "angular_contact_ball": friction.ANGULAR_GEOMETRY}


def slopes_at(scene: SingleRowScene, temperatures: Array) -> Array:
    """dM/dT (4, 4) by central differences. Raises InputError where the bearing is impossible next to these temperatures [C]."""
    columns = []
    for step in DIFFERENCE * np.eye(len(NODES)):
        above, below = (balance(scene, temperatures + sign * step).image for sign in (1.0, -1.0))
        columns.append((above - below) / (2.0 * DIFFERENCE))
    return np.array(columns).T


def steady_temperatures(scene: SingleRowScene) -> Search:
    """Search for steady temperatures of a scene with [thermal].

    It starts at the first guess of the oil's temperature, and where that leads to no stable state also at that of the cold bearing.
    Raises InputError where the bearing is impossible even when cold.
    """
    lubricant = given(scene.lubricant)
    cold = np.full(len(NODES), inlet_temperature(given(scene.thermal), lubricant))
    guess = np.full(len(NODES), lubricant.temperature_C)
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
) -> tuple[BallResult, Search | None]:
    """The result of a scene with [thermal], at its steady temperatures, and the search for them; without such, its temperatures and
    the path alone, and no search where the cold bearing is impossible.

    ``solve`` gives the result of a scene at stated temperatures. ``ranged``: with ranges over the inputs of the balance.
    """
    try:
        search = steady_temperatures(scene)
    except InputError as error:
        return _seized_cold(scene, str(error.faults[0]), solve), None
    last, slopes = search.last, search.slopes
    found: Heat = last.run
    nodes = dict(zip(NODES, last.temperatures.tolist(), strict=True))
    status, reason = str(search.status), f"{search.reason}; thermal loop gain {gain(slopes):.2g}"
    if status == "steady":
        status, reason = ceiling_verdict(scene, nodes)
    hot = solve(at_temperatures(scene, Temperatures(**nodes)))
    ranges = ranges_of(scene, last, slopes) if ranged and search.status == "steady" else Ranges(None)
    steady = status == "steady"
    result = replace(
        hot,
        status=hot.status if steady else f"{status}: {reason}",
        report=hot.report if steady else None,
        temperatures_C=nodes,
        thermal=_record(scene, search, ranges, status, reason or None),
        notes=(*_notes(scene, found, ranges), *(hot.notes or ())) if hot.is_equilibrium else None,
        rows=hot.rows if steady else (),
        scene=scene.model_dump(mode="json"),
    )
    return result, search


def _seized_cold(scene: SingleRowScene, reason: str, solve: Callable[[SingleRowScene], BallResult]) -> BallResult:
    """The result of a bearing that is impossible before any heat."""
    nodes = dict.fromkeys(NODES, inlet_temperature(given(scene.thermal), given(scene.lubricant)))
    cold = solve(at_temperatures(scene, Temperatures(**nodes)))
    thermal = ColdSeizure("seizure", reason, None, [nodes])
    input_scene = scene.model_dump(mode="json")
    return replace(cold, status=f"seizure: {reason}", temperatures_C=nodes, thermal=thermal, scene=input_scene)


def ceiling_verdict(scene: SingleRowScene, nodes: dict[str, float]) -> tuple[str, str]:
    """Status and reason of steady temperatures [C]: "too hot" with oil above its ceiling."""
    excess = over_ceiling("oil", nodes["oil"], oil_ceiling(given(scene.thermal), given(scene.lubricant)))
    return ("too hot", excess) if excess else ("steady", "")


def ranges_of(scene: SingleRowScene, state: State, slopes: Array) -> Ranges:
    """Ranges of steady temperatures over the documented inputs of the balance, by a full solution for each input set."""
    cold = np.full(len(NODES), inlet_temperature(given(scene.thermal), given(scene.lubricant)))
    about = state.model.with_image_slopes(slopes)

    def near(states: Sequence[State]) -> HeatModel:
        return states[-1].model._replace(residue=about.residue)

    def full(thermal: Thermal, start: Array) -> Array | None:
        changed = scene.model_copy(update={"thermal": thermal})
        map_of_set = partial(balance, changed, viscosity=about.losses.log_viscosity)
        search = steady_state(map_of_set, start, cold, _exact_slopes, near, RANGE_TOLERANCE)
        return search.last.temperatures if search.status == "steady" else None

    def radial(nodes: Array, thermal: Thermal) -> float:
        changed = scene.model_copy(update={"thermal": thermal})
        return 1e6 * clearance_of(row_of(at_temperatures(changed, Temperatures(*nodes.tolist()))).row)[0]

    def clearances(nodes: Array, thermals: Sequence[Thermal]) -> dict[str, Array]:
        return {"radial_um": np.array([*map(radial, nodes, thermals)])}

    return input_ranges(scene, about, lambda share: term_shares(scene, share), clearances, {}, full=full)


def _record(scene: SingleRowScene, search: Search, ranges: Ranges, status: str, reason: str | None) -> BallHeatBalance:
    found: Heat = search.last.run
    inner, outer = found.scene.operation.speeds
    speed = abs(inner - outer)
    drawn = row_of(scene.model_copy(update={"mounting": None, "thermal": None}))
    sizes = {"drawn": clearance_of(drawn.row), "operating": clearance_of(found.model.row)}
    return BallHeatBalance(
        status=status,
        gain=float(gain(search.slopes)),
        heat_W=dict(zip(NODES, found.heat.tolist(), strict=True)),
        clearance_um={name: 1e6 * clearance for name, (clearance, _) in sizes.items()},
        unloaded_angle_deg={name: math.degrees(angle) for name, (_, angle) in sizes.items()},
        friction_W={"rolling": speed * found.moments.rolling, "sliding": speed * found.moments.sliding},
        friction_loads_N=found.loads._asdict(),
        carried_off_W=carried_off(found.conductances, found.boundaries, search.last.image),
        conductances_W_K=found.conductances._asdict(),
        ranges=ranges,
        path_C=[dict(zip(NODES, state.temperatures.tolist(), strict=True)) for state in search.states],
        path_heat_W=[float(state.run.heat.sum()) for state in search.states],
        path_clearance_um=[1e6 * clearance_of(state.run.model.row)[0] for state in search.states],
        reason=reason,
    )


def _notes(scene: SingleRowScene, found: Heat, ranges: Ranges) -> Iterator[Note]:
    """What the heat balance leaves open."""
    kind, (inner, outer), mounting = scene.bearing.kind, scene.operation.speeds, given(scene.mounting)
    level = (
        f"temperatures: their heat is SKF's friction model, {LEVELS[kind]} times the heat of ISO 15312 at reference speed, which no "
        "range includes"
    )
    yield Note("left-out", level)
    fast = abs(inner - outer) * 0.5 * (mounting.bore + mounting.outside_diameter)
    if fast > FASTEST[kind]:
        sentence = (
            f"temperatures: n d_m = {1e-3 * fast / RPM:.2g} million mm/min is above the reference speeds of such bearings, where SKF's "
            "friction was not verified"
            + ("; at 1.4 million it was 2.9 times the loss in NASA TP-2275" if kind == "angular_contact_ball" else "")
        )
        yield Note("unverified", sentence)
    yield from starvation_note(found.scene, "temperatures")
    yield from ranges.notes
    yield from heat_notes(given(scene.thermal), given(scene.lubricant), mounting, given(mounting.width))


def starvation_note(hot: SingleRowScene, subject: str) -> Notes:
    """A note where SKF's starvation factor leaves hardly any rolling friction of a scene at stated temperatures."""
    factor = friction.starvation_factor(GEOMETRIES[hot.bearing.kind], running_of(hot))
    if factor >= friction.STARVED:
        return ()
    sentence = (
        f"{subject}: SKF's starvation factor of {factor:.2g} removes the rolling friction of so thick an oil, so the heat is "
        "too low. Take a thinner oil or warm it"
    )
    return (Note("starved", sentence),)
