"""Validity of the model for a scene: effects left out, the maker's friction, pressure and film of each race.

Each effect left out has the change that it would make and, where possible, an estimate of its size.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from rbdyn.base.faults import RPM
from rbdyn.base.notes import LOST_CLEARANCE, Note, Notes, status_of
from rbdyn.base.words import all_of, shown
from rbdyn.contact.film_thickness import half_width, hertz_pressure
from rbdyn.contact.hertz_line import ROLLERS, palmgren, pressure_notes
from rbdyn.contact.rolling_resistance import THINNEST_LAYER, inlet
from rbdyn.dynamics.forces.bodies import AIR_DENSITY
from rbdyn.dynamics.parameters.model import film_of, oil_layer, race_contact_law, rolling_contacts
from rbdyn.life import rollers
from rbdyn.life.friction import STARVED, Running, starvation_factor
from rbdyn.properties.materials import SOFTEST_METAL, equivalent_modulus
from rbdyn.result import FrictionCheck, RollerContact
from rbdyn.scene import Scene
from rbdyn.scene.notes import catalogue_entry, clearance_notes, speed_notes
from rbdyn.scene.unknown import documented_of

# Film over roughness below which asperities bear part of the load.
FULL_FILM = 1.0
SMALLEST_LOAD = 1e-3  # [N]: a race with less counts as unloaded


def race_report(scene: Scene, inner_load: float, outer_load: float) -> dict[str, RollerContact]:
    """Contacts of "inner" and "outer" at the largest loads [N]; one without a load is missing.

    With a profile or a tilt the pressure is that of the most loaded slice, of a roller where the tilt is largest.
    """
    contacts, count, report = rolling_contacts(scene), scene.slices, dict[str, RollerContact]()
    for name, load in (("inner", inner_load), ("outer", outer_load)):
        if load < SMALLEST_LOAD:
            continue
        most = load if count == 1 else _most_loaded_slice(scene, name, load)
        contact = contacts[name]._replace(length=contacts[name].length / count)
        pressure, width = float(hertz_pressure(contact, most)) * 1e-6, float(half_width(contact, most)) * 1e6
        report[name] = RollerContact(pressure, width, film_of(scene, name, contacts[name], load))
    return report


def race_notes(scene: Scene, races: Mapping[str, RollerContact]) -> Iterator[Note]:
    """Notes where ``races`` of a report exceed their laws: dents, and films too thin for the friction of a full one."""
    pressures = {name: 1e6 * race.max_pressure_MPa for name, race in races.items()}
    for name, most in pressures.items():
        yield from pressure_notes(most, ROLLERS, name)
    law, films = scene.traction, {name: race.film.lambda_ratio for name, race in races.items() if race.film}
    thinnest = min(films, key=films.__getitem__, default=None)
    if thinnest and films[thinnest] < FULL_FILM and law.friction == "film" and law.model not in ("coulomb", "off"):
        sentence = (
            f"film: lambda is {films[thinnest]:.2g} on the {thinnest} raceway, below {FULL_FILM:g}, so asperities touch but only film "
            "friction counts. Set traction.friction = 'mixed', or check lubricant.temperature_C and the roughnesses"
        )
        yield Note("thin-film", sentence)


def _most_loaded_slice(scene: Scene, race: str, load: float) -> float:
    """Load [N] of the slice that bears most of ``load`` [N] on a race, where the tilt is largest."""
    from rbdyn.dynamics.forces.observe import slice_loads

    direction = scene.bearing.tilt_direction
    nx, ny = np.array([math.cos(direction)]), np.array([math.sin(direction)])
    law = race_contact_law(scene, race)
    return float(slice_loads(law, scene.slices, scene.geometry.roller_radius, np.array([load]), nx, ny).max())


# A ratio of simulated to maker's loss outside this range gets a note. SKF's model differs from ISO 15312 by a factor of two.
USUAL_RATIO = (0.5, 2.0)


def friction_check(scene: Scene, power_loss: float) -> FrictionCheck | None:
    """SKF's moments [N mm] and power, the heat of ISO 15312, and the simulated ``power_loss`` [W] over SKF's power.

    At the speed, load and oil of the scene; the load is the steady one in line with the rotating one. None without a
    designation, or with a schedule. The ratio is None where SKF's power is zero (no load, or no speed) or its rolling friction is
    starved away.
    """
    listed = catalogue_entry(scene.bearing)
    if listed is None or scene.operation.schedule is not None:
        return None
    named, sizes = listed
    inner, outer = scene.operation.speeds
    oil, load = scene.oil(), scene.operation.largest_load_N
    lengths = 1e-3 * sizes.bore, 1e-3 * sizes.outside
    running = Running(*lengths, inner - outer, oil.viscosity / oil.density, scene.lubricant.supply)
    moments = rollers.skf_moments(named.series, running, load)
    power = sum(moments) * abs(inner - outer)
    factor = starvation_factor(rollers.ROLLER_GEOMETRY, running)
    ratio = power_loss / power if power > 0.0 and factor >= STARVED else None
    return FrictionCheck(
        power, 1e3 * moments.rolling, 1e3 * moments.sliding, rollers.iso_15312_heat(sizes), ratio, factor
    )


def friction_notes(check: FrictionCheck | None) -> Notes:
    """A note where the simulated power loss is far from SKF's, or the oil too thick for SKF's formula."""
    low, high = USUAL_RATIO
    if check is not None and check.skf_starvation_factor < STARVED:
        sentence = (
            f"power loss: it is not compared with SKF's friction model, whose starvation factor of {check.skf_starvation_factor:.2g} "
            "removes the rolling friction of so thick an oil"
        )
        return (Note("starved", sentence),)
    if check is None or check.ratio is None or low <= check.ratio <= high:
        return ()
    sentence = (
        f"power loss: it is {shown(check.ratio, 2)} times the {shown(check.skf_power_W, 3)} W of SKF's friction model, outside {low:g} to {high:g}. "
        "Compare the power terms, the oil and lubricant.supply"
    )
    return (Note("maker-loss", sentence),)


# Shares of the power loss from which a note states a power that was left out, and from which it is a warning.
NOTED_SHARE, LARGE_SHARE = 0.03, 0.2
# An oil jet carried 1.4 kW off a 35 mm ball bearing at 72 000 rpm with seats, pi B (D + d), of 4270 mm^2 (NASA TP-2275) [W/m^2].
# Ten times as much is beyond any cooling. Oil absorbs 27 W/K at a litre a minute (SKF), over at most some 100 K [W min/L].
JET_COOLED, TOO_HOT, OIL_HEAT = 0.33e6, 10.0, 2700.0


# Share of C below which films decide the slip: an NU 210 at 6000 rpm slips by 0.7 % under 0.03 C, by 28 % under 0.003 C.
FILM_DRIVEN = 0.01
# Cage slip from which the form of the traction law matters.
NOTED_SLIP, LAW = 0.01, "traction.model"


class LeftOut(NamedTuple):
    """An effect that the model leaves out: name, change that it would make, way to estimate it.

    ``power``: its estimate for a scene [W], None without one; ``matters``: whether it matters in a scene, without an estimate.
    """

    name: str
    changes: str
    estimate: str
    power: Callable[[Scene], float] | None = None
    matters: Callable[[Scene], bool] | None = None


def disc_moment(density: float, viscosity: float, speed: float, radius: float) -> float:
    """Moment on both faces of a disc that turns at ``speed`` [rad/s] in a fluid at rest [N m].

    rho w^2 r^5 C_n/2 with C_n = 3.87/Re^0.5 below Re = rho r^2 w/eta = 3e5, 0.146/Re^0.2 above (von Karman 1921).
    """
    reynolds = density * radius**2 * speed / viscosity
    if reynolds == 0.0:
        return 0.0
    factor = 3.87 / math.sqrt(reynolds) if reynolds < 3e5 else 0.146 / reynolds**0.2
    return 0.5 * density * speed**2 * radius**5 * factor


def friction_factor(reynolds: float) -> float:
    """Shear over dynamic pressure at the surface of a cylinder that turns freely, Re = rho w r^2/eta > 0.

    Laminar 4/Re, exact; else 1/sqrt(f) = -0.6 + 4.07 log10(Re sqrt(f)), measured by Theodorsen and Regier 1944.
    """
    root = 0.1
    for _ in range(40):
        # Below Re = 80 the curve is under the laminar line, and far below it has no root: any large value serves.
        root = 1.0 / max(-0.6 + 4.07 * math.log10(max(reynolds * root, 1.0)), 4.0)
    return max(root**2, 4.0 / reynolds)


def cylinder_moment(density: float, viscosity: float, speed: float, radius: float, length: float) -> float:
    """Moment on the surface of a cylinder that turns in a fluid at rest, rho w^2 r^2 f/2 over 2 pi r l [N m]."""
    reynolds = density * radius**2 * speed / viscosity
    if reynolds == 0.0:
        return 0.0
    stress = 0.5 * density * (speed * radius) ** 2 * friction_factor(reynolds)
    return stress * 2.0 * math.pi * radius**2 * length


def spin_windage(scene: Scene) -> float:
    """Power of rollers that spin and a cage that turns in the oil-air mixture, next to the rollers' orbital drag [W].

    Ends and surfaces of rollers, which turn against pockets that turn with the cage; side faces of the cage, and its rim
    off the land over the width of its lands. The mixture has the density X rho_oil + (1 - X) rho_air and the viscosity
    of the oil.
    """
    drawing, cage, motion = scene.bearing, scene.cage, scene.geometry.motion
    oil, share = scene.oil(), scene.lubricant.oil_fraction
    mixture = share * oil.density + (1.0 - share) * AIR_DENSITY, oil.viscosity
    spin, turning = abs(motion.roller_spin - motion.cage_speed), abs(motion.cage_speed)
    radius, length = scene.geometry.roller_radius, drawing.roller_length
    roller = disc_moment(*mixture, spin, radius) + cylinder_moment(*mixture, spin, radius, length)
    rim, land = scene.geometry.rim_radius, scene.geometry.land_radius
    faces = disc_moment(*mixture, turning, max(rim, land)) - disc_moment(*mixture, turning, min(rim, land))
    off_land = cylinder_moment(*mixture, turning, rim, cage.lands * cage.land_width)
    return drawing.rollers * roller * spin + (faces + off_land) * turning


def open_inner_films(scene: Scene) -> float:
    """Power of the oil films between inner race and the rollers that it does not load [W]; 0 where the scene has them.

    Each film takes 2 u times 4.601 eta u l sqrt(R/h), averaged over the circle, with the gap h = c - (c + d) cos psi. The ring
    is displaced by the radial clearance c and the approach d of the most loaded roller (Stribeck: 5 F/Z). With an inlet distance
    a film has the share of it that the oil layer feeds.
    """
    clearance = 0.5 * scene.geometry.clearance
    if clearance <= 0.0 or scene.model.open_contact_film:
        return 0.0
    count, length = scene.bearing.rollers, scene.bearing.effective_length
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    load = 5.0 * scene.operation.largest_load_N / count
    approach = 2.0 * (load / palmgren(modulus, length).stiffness) ** 0.9
    angle = (np.arange(2000) + 0.5) * math.pi / 2000
    gap = clearance - (clearance + approach) * np.cos(angle)
    speed, oil = scene.geometry.motion.entrainment, scene.oil("inner")
    gap = gap[gap > 0.0]
    powers = 2.0 * 4.601 * oil.viscosity * speed**2 * length * np.sqrt(scene.geometry.reduced_radii[1] / gap)
    if scene.lubricant.inlet_distance is not None:
        filled = np.linspace(0.0, 1.0, 41)[1:-1] ** 2
        shares = [inlet(math.sqrt(1.0 / part - 1.0)).rolling / inlet(math.inf).rolling for part in filled]
        part = gap / max(oil_layer(scene), THINNEST_LAYER)
        powers *= np.interp(np.sqrt(part), np.sqrt([0.0, *filled, 1.0]), [1.0, *shares, 0.0])
    return count * float(powers.sum()) / angle.size


LEFT_OUT = (
    LeftOut(
        "windage of spinning rollers and cage",
        "more power loss",
        "discs M = rho w^2 r^5 C_n/2 and cylinders M = f rho w^2 r^2/2 2 pi r^2 l in the oil-air mixture",
        power=spin_windage,
    ),
    LeftOut(
        "oil films at unloaded inner contacts",
        "more power loss, and a pull on the rollers outside the load zone that lessens cage slip",
        "2 u 4.601 eta u l sqrt(R/h) a roller, h its gap",
        power=open_inner_films,
    ),
    LeftOut(
        "churning of a sump",
        "more power loss",
        "none: the level of a bath is unknown, and lubricant.oil_fraction includes what rollers plough through",
    ),
    LeftOut(
        "skew of rollers",
        "axial sliding in the raceways and forces on the cage outside its middle plane",
        "none: it needs motion out of the plane; tilted rings cause it",
        matters=lambda scene: scene.bearing.tilt != 0.0,
    ),
    LeftOut(
        "contact of roller ends and flanges",
        "friction at the flanges, which limits the skew of rollers",
        "none: it needs motion along the axis; tilted rings load the flanges",
        matters=lambda scene: scene.bearing.tilt != 0.0,
    ),
    LeftOut(
        "elastic deformation of the cage ring",
        "lower impacts and load shared by several pockets; bars bend by model.pocket_bar_stiffness_N_m, the ring does not",
        f"none: it matters in cages below {SOFTEST_METAL * 1e-9:g} GPa",
        matters=lambda scene: scene.material("cage").elastic_modulus < SOFTEST_METAL,
    ),
)


def left_out_notes(scene: Scene, power_loss: float) -> Iterator[Note]:
    """Notes on effects that the model leaves out and that matter in this scene, of the simulated ``power_loss`` [W]."""
    for item in LEFT_OUT:
        if item.power is not None:
            power = item.power(scene)
            if power > NOTED_SHARE * power_loss > 0.0:
                share = power / power_loss
                size = f"{100.0 * share:.2g} %" if share < 1.0 else f"{shown(share, 2)} times the simulated loss"
                code = "omission" if share > LARGE_SHARE else "left-out"
                sentence = (
                    f"not modelled: {item.name}, which would cause about {shown(power, 2)} W ({size}) {item.changes}"
                )
                yield Note(code, sentence)
        elif item.matters is not None and item.matters(scene):
            yield Note("left-out", f"not modelled: {item.name}, which would cause {item.changes}")


def limit_notes(scene: Scene) -> Notes:
    """Notes on clearances in operation that are nearly lost, and on a speed beyond the limits of such bearings."""
    inner, outer = scene.operation.speeds
    listed = catalogue_entry(scene.bearing)
    reference = None if listed is None or listed[1].reference_speed is None else listed[1].reference_speed * RPM
    mounting = scene.mounting
    running = {} if mounting is None else scene.running_clearances(mounting)
    floors = {name: clear.floor for name, clear in running.items()}
    return (
        *clearance_notes(scene.clearances, floors),
        *speed_notes(inner - outer, scene.bearing.pitch_diameter, reference),
    )


def status(scene: Scene, notes: Notes) -> str:
    """Status of figures with these ``notes``; "lost clearance" without a heat balance, which alone tells whether a preload lasts."""
    mounting, found = scene.mounting, status_of(notes)
    if found != "ok" or mounting is None or scene.thermal is not None:
        return found
    return LOST_CLEARANCE if any(clear.lost for clear in scene.running_clearances(mounting).values()) else found


def light_load_notes(scene: Scene) -> Notes:
    """A note where even the largest load is below the minimum load of a maker, with every maker's rule.

    A designation gives the factor k_r and the reference speed of SKF's rule, and the mean diameter of bore and outside.
    """
    drawing, operation = scene.bearing, scene.operation
    inner, outer = operation.speeds
    diameter, of_series = drawing.pitch_diameter, None
    if (listed := catalogue_entry(drawing)) is not None:
        named, box = listed
        diameter = 0.5e-3 * (box.bore + box.outside)
        usual = rollers.REFERENCE_SPEED / diameter
        of_series = rollers.SERIES[named.series].minimum_load, (box.reference_speed or usual / RPM) * RPM
    capacities = drawing.rated_capacity, rollers.static_capacity(*drawing.rated_sizes)
    rules = rollers.minimum_loads(diameter, inner - outer, *capacities, of_series)
    load = operation.largest_load_N
    missed = sum(load < least for least in rules.values())
    if not missed:
        return ()
    rising = sorted(rules.items(), key=lambda item: item[1])
    loads = ", ".join(f"{1e-3 * least:.2g} kN ({rule})" for rule, least in rising)
    sentence = (
        f"load: {load:.4g} N is below {missed} of {len(rules)} manufacturers' minimum loads against skidding: {loads}. "
        "Rollers may skid, but these rules are not reliable: check cage_slip"
    )
    return (Note("light-load", sentence),)


def film_drive_notes(scene: Scene) -> Notes:
    """A note where the load is so small that oil films, and no longer loaded contacts, drive the rollers."""
    load, capacity = scene.operation.largest_load_N, scene.bearing.rated_capacity
    if load >= FILM_DRIVEN * capacity:
        return ()
    limit = f"{100.0 * FILM_DRIVEN:g} % of C = {1e-3 * capacity:.3g} kN"
    if scene.model.open_contact_film:
        films = "are flooded, because lubricant.inlet_distance is not set"
        if scene.lubricant.inlet_distance is not None:
            layer = oil_layer(scene)
            films = f"fill gaps up to {1e6 * layer:.2g} um, as lubricant.inlet_distance and the load set it"
            films = (
                films
                if layer > 0.0
                else "are missing, because no loaded inner contact feeds them by lubricant.inlet_distance"
            )
        films = f"films at open contacts {films}. Compare results over the range of that key"
    else:
        films = "films at unloaded inner contacts are off. Set model.open_contact_film = true"
    sentence = f"load: {load:.4g} N is below {limit}. At such loads oil films drive the cage, and {films}"
    return (Note("oil-drag", sentence),)


def traction_law_notes(scene: Scene, slip: float) -> Notes:
    """A note where the cage slips so much that the form of the traction law decides how slip changes with a clearance or the oil."""
    laws = {law for entry in documented_of(scene) if entry.key == LAW for law in entry.values or ()}
    others = sorted(laws - {scene.traction.model})
    if slip < NOTED_SLIP or scene.traction.model == "off" or not others:
        return ()
    sentence = (
        f"cage slip: {100.0 * slip:.2g} % depends on {LAW} = '{scene.traction.model}' (as does its change with temperature "
        f"and clearance). Compare {all_of(map(repr, others))}, which doe uncertainty draws where [uncertain] names the key"
    )
    return (Note("traction-law", sentence),)


def slip_notes(scene: Scene, slip: float) -> Notes:
    """Notes on what a cage ``slip`` rests on: the traction law, oil films, and a load below what makers ask for."""
    return (*traction_law_notes(scene, slip), *film_drive_notes(scene), *light_load_notes(scene))


def heat_notes(scene: Scene, power_loss: float) -> Notes:
    """A note where a power loss [W] is more than any oil carries off; the model leaves out the temperatures that it causes."""
    drawing, oil = scene.bearing, scene.lubricant
    heat = power_loss / (2.0 * math.pi * drawing.pitch_diameter * drawing.roller_length)
    if heat <= TOO_HOT * JET_COOLED:
        return ()
    sentence = (
        f"heat: a power loss of {power_loss:.3g} W is {heat / JET_COOLED:.2g} times the heat that a jet has removed from such a surface. "
        f"Removing it needs {power_loss / OIL_HEAT:.2g} L/min of oil that warms by 100 K, which is not realistic. Check the speed, the load "
        f"and the oil ({1e3 * oil.in_service.viscosity:.3g} mPa s at {oil.temperature_C:.4g} °C)"
    )
    return (Note("heat", sentence),)
