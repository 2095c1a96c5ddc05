"""From a scene to what the kernels read, in SI: geometry, masses and the chosen laws, traction of each race and its film.

Parts that only some scenes need are imported where they are built, so that a scene without them never loads them.
"""

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.base.faults import InputError
from rbdyn.contact import film_thickness, traction
from rbdyn.contact import rolling_resistance as resistance
from rbdyn.contact.cage_film import StoppingFilm, short_journal_film, stopping_rate
from rbdyn.contact.damping import HuntCrossleyDamping, NoDamping, ViscousDamping
from rbdyn.contact.hertz_line import LineContactOnBar, dowson_higginson, houpert, iso_16281, palmgren, slice_contact
from rbdyn.contact.tangential import ElasticContact, RigidContact
from rbdyn.contact.traction import CoulombTraction, NoTraction, dry_friction
from rbdyn.dynamics.forces import bodies
from rbdyn.dynamics.forces import cage as cage_laws
from rbdyn.dynamics.forces.equations import RollerBearing
from rbdyn.dynamics.forces.race_lanes import NoOpenFilm
from rbdyn.dynamics.forces.race_samples import NoRaceSamples, RaceSamples, RaceScale
from rbdyn.dynamics.forces.races import EqualRollers, Race, RoundRace, largest_rise, unequal_rollers, wavy_race
from rbdyn.dynamics.parameters.state import contact_approach, layout_of, load_distribution, scales
from rbdyn.properties.materials import Oil, equivalent_modulus
from rbdyn.result import Film
from rbdyn.scene import Scene
from rbdyn.scene.bearing import Harmonic
from rbdyn.scene.lubricant import RHEOLOGIES

if TYPE_CHECKING:
    from rbdyn.contact.rheology import Rheology
    from rbdyn.dynamics.forces.schedule import ClockedDrive


# The slip of rollers that do not move is twice the entrainment speed.
LARGEST_SLIP_RATIO = 2.0
# A table starts at the load where the film turns elastohydrodynamic, but spans at least this ratio of loads.
SMALLEST_RANGE = 10.0
# Entrainment speeds [m/s] up to this are round-off.
ROLLING = 1e-9
# It ends at the static capacity of a roller contact (ISO 76: 4 GPa), beyond which no oil law is valid.
LARGEST_PRESSURE = 4e9
# Largest error of a table, as a share of its largest coefficient.
LARGEST_ERROR = 0.01


def race_traction(
    scene: Scene, contact: film_thickness.RollingContact, oil: Oil, largest_load: float, race: str = "outer"
) -> Any:
    """Traction law of a race, "outer" or "inner", by one of its contacts.

    ``oil``: at the temperature of that film; a table covers loads up to ``largest_load`` [N]. The film is that of pure
    rolling. Raises InputError where a model needs a film and nothing rolls.
    """
    table = scene.traction
    if table.elasticity and not contact.entrainment_speed > ROLLING:
        raise InputError("traction.elasticity = true: needs contacts that roll, which raceways do not; leave it out")
    if table.model not in RHEOLOGIES and table.friction == "film":
        return _load_independent(scene)
    if not contact.entrainment_speed > ROLLING:
        key = f"traction.model = '{table.model}'" if table.model in RHEOLOGIES else "traction.friction = 'mixed'"
        raise InputError(f"{key}: needs a film, but the raceways do not roll; choose another")
    law = _surface(scene, race, contact, oil, largest_load) if table.model in RHEOLOGIES else _load_independent(scene)
    return _mixed(scene, law, contact, oil) if table.friction == "mixed" else law


def rolling_contacts(scene: Scene) -> dict[str, film_thickness.RollingContact]:
    """The "outer" and "inner" contact of a whole roller, rolling at the nominal speed."""
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    length, speed = scene.bearing.effective_length, abs(scene.geometry.motion.entrainment)
    return {
        race: film_thickness.RollingContact(radius, length, modulus, speed)
        for race, radius in zip(("outer", "inner"), scene.geometry.reduced_radii, strict=True)
    }


def film_of(scene: Scene, race: str, contact: film_thickness.RollingContact, load: float) -> Film | None:
    """Film of a contact at a load [N] > 0 in pure rolling at the nominal speed, starved where asked; None where races do not roll."""
    if contact.entrainment_speed == 0.0:
        return None
    oil = scene.oil(race)
    central = float(film_thickness.film_in_service(contact, oil, load, scene.lubricant.inlet_distance))
    minimum = film_thickness.thermal_factor(contact, oil, load) * film_thickness.minimum_film(contact, oil, load)
    return Film(central * 1e6, float(minimum) * 1e6, float(_lambda(scene, central)))


def _load_independent(scene: Scene) -> Any:
    table = scene.traction
    if table.model == "coulomb":
        return traction.dry_friction(table.coulomb, table.blend_speed_m_s)
    if table.model == "off":
        return traction.NoTraction()
    if table.constants is not None:
        a, b, c, d = table.constants
        at_rest = a + d
    else:
        a, b, c, d = traction.four_constants(table.mu_0, table.mu_m, table.mu_inf, table.u_m_m_s)
        at_rest = table.mu_0
    if at_rest > 0.0:
        return traction.BlendedFourConstantTraction(a, b, c, d, table.blend_speed_m_s)
    return traction.FourConstantTraction(a, b, c, d)


def _surface(scene: Scene, race: str, contact: film_thickness.RollingContact, oil: Oil, largest_load: float) -> Any:
    fit = _film_table(_rheology(scene, oil, race), contact, oil, scene.lubricant.inlet_distance, largest_load)
    if fit.error > LARGEST_ERROR:
        raise InputError(
            f"traction.model = '{scene.traction.model}': its table is off by {100.0 * fit.error:.2g} % of the peak up to "
            f"{largest_load:.4g} N; raise lubricant.temperature_C or choose another model"
        )
    return fit.surface


# The designs of a study share most of their tables, which take 25 ms each.
@lru_cache(maxsize=64)
def _film_table(
    rheology: "Rheology", contact: film_thickness.RollingContact, oil: Oil, distance: float | None, largest_load: float
) -> traction.SurfaceFit:
    """Table of the traction coefficient of a film, with the inlet ``distance`` of its oil."""
    from rbdyn.contact.rheology import traction_coefficient, with_body_creep

    def coefficient(slip: Any, load: Any) -> Any:
        film = film_thickness.film_in_service(contact, oil, load, distance)
        alone = traction_coefficient(rheology, contact, slip, load, film)
        return with_body_creep(alone, contact, slip, load)

    capacity = 2.0 * math.pi * contact.radius * contact.length * LARGEST_PRESSURE**2
    largest_load = min(largest_load, capacity / contact.equivalent_modulus)
    smallest_load = min(film_thickness.lightest_load(contact, oil), largest_load / SMALLEST_RANGE)
    largest_slip = LARGEST_SLIP_RATIO * contact.entrainment_speed
    return traction.traction_surface(coefficient, largest_load, smallest_load, largest_slip)


def _rheology(scene: Scene, oil: Oil, race: str = "outer") -> "Rheology":
    from rbdyn.contact.rheology import Eyring, LimitingShear, thermal_newtonian

    table = scene.traction
    if table.model == "thermal_newtonian":
        name = table.rheology_oil or scene.lubricant.oil
        temperature = getattr(scene.film_temperatures_C, race)
        return thermal_newtonian(name, temperature, oil.conductivity, table.largest_shear_ratio)
    if table.model == "eyring":
        return Eyring(oil.viscosity, oil.pressure_coefficient, table.eyring_stress, table.largest_shear_ratio)
    return LimitingShear(oil.viscosity, oil.pressure_coefficient, table.limiting_shear_ratio)


def _mixed(scene: Scene, fluid: Any, contact: film_thickness.RollingContact, oil: Oil) -> traction.MixedTraction:
    table = scene.traction
    # The film varies as Q^-0.1. Heating and starvation vary little with the load: they are those of the most loaded roller,
    # 5 F/Z (Stribeck).
    stribeck = 5.0 * scene.operation.largest_load_N / scene.bearing.rollers
    load = max(stribeck, film_thickness.lightest_load(contact, oil))
    film = film_thickness.film_in_service(contact, oil, load, scene.lubricant.inlet_distance)
    ratio_at_one = float(_lambda(scene, film)) * load**0.1
    return traction.MixedTraction(
        fluid,
        table.boundary_friction,
        table.blend_speed_m_s,
        table.asperity_b * ratio_at_one**table.asperity_c,
        0.1 * table.asperity_c,
    )


def _lambda(scene: Scene, film: Any) -> Any:
    lubricant = scene.lubricant
    return film_thickness.lambda_ratio(film, lubricant.roller_roughness, lubricant.race_roughness)


# Load up to which the traction coefficient of an elastic contact fades in, as a share of the load of the most loaded roller.
LIGHT_LOAD = 0.01
# The largest contact load that a traction surface must cover, in multiples of the largest load on the shaft.
TRACTION_RANGE = 4.0


def roller_bearing(scene: Scene) -> RollerBearing:
    """Parameters of the equations of motion."""
    drawing, geometry = scene.bearing, scene.geometry
    mass, radii = geometry.roller_mass, geometry.roller_radii
    angles = 2.0 * np.pi * np.arange(drawing.rollers) / drawing.rollers
    bearing = RollerBearing(
        rollers=drawing.rollers,
        sizes=EqualRollers(geometry.roller_radius) if radii is None else unequal_rollers(radii),
        roller_mass=mass,
        roller_inertia=mass * drawing.roller_diameter**2 / 8.0,
        outer=_race(scene, "outer"),
        inner=_race(scene, "inner"),
        open_film=_open_film(scene, scene.oil("inner")),
        pocket=_pocket(scene, scene.oil("pocket")),
        pocket_cos=np.cos(angles),
        pocket_sin=np.sin(angles),
        guide=_guide(scene, scene.oil("land")),
        drag=_drag(scene, scene.oil("cavity")),
        cage=_cage(scene),
        outer_ring=_outer_ring(scene),
        inner_ring_mass=drawing.inner_ring_mass_kg,
        drive=_drive(scene),
        gravity=_gravity(scene),
        impacts=_impacts(scene),
        samples=NoRaceSamples(),
    )
    bearing = bearing._replace(samples=_race_samples(scene, bearing))
    if not isinstance(bearing.open_film, resistance.LayerFilm):
        return bearing
    # The loads that lay the oil do not depend on its film.
    return bearing._replace(open_film=_open_film(scene, scene.oil("inner"), oil_layer(scene, bearing)))


def oil_layer(scene: Scene, bearing: RollerBearing | None = None) -> float:
    """Largest gap [m] that oil fills at the inner race: h_s = h_c + gap_ahead(m) b^2/(2 R) of the mean loaded inner contact.

    m is lubricant.inlet_distance, b the half-width at that contact's load and h_c its film. The oil of a loaded contact begins
    there, and the same oil feeds the open contacts. Without a loaded contact, or an inlet distance,
    it is 0. ``bearing``: parameters of the
    scene with any film, for a caller that has them.

    The layer is a constant of a scene, by its static loads over a turn, the temperature of its films and its operating
    clearance, so a heat balance finds it anew at each of its temperatures. The load is the root mean square over a turn of the
    steady and the rotating load. Speed changes h_c alone, which is that of the nominal speed like every film. A schedule leaves
    the layer at the nominal load and speed: what runs far from them is a scene of its own.
    """
    return scene.once("oil_layer", lambda: _oil_layer(scene, bearing or roller_bearing(scene)))


def _mean_load(scene: Scene) -> float:
    """Root mean square over a turn of steady and rotating load [N]."""
    operation = scene.operation
    turning = operation.rotating_load_N + operation.unbalance * operation.speeds[0] ** 2
    return math.hypot(operation.radial_load_N, turning)


def _oil_layer(scene: Scene, bearing: RollerBearing) -> float:
    distance = scene.lubricant.inlet_distance
    inner = load_distribution(scene, bearing, _mean_load(scene)).inner
    if distance is None or not np.any(inner > 0.0):
        return 0.0
    load, contact, film = float(inner[inner > 0.0].mean()), rolling_contacts(scene)["inner"], 0.0
    if contact.entrainment_speed > ROLLING:
        film = float(film_thickness.film_in_service(contact, scene.oil("inner"), load, distance))
    return film + resistance.gap_ahead(distance) * float(film_thickness.half_width(contact, load)) ** 2 / (
        2.0 * contact.radius
    )


def _modulus(scene: Scene, first: str, second: str) -> float:
    return equivalent_modulus(scene.material(first), scene.material(second))


def _race(scene: Scene, which: str) -> Race:
    place, geometry = ("outer", "inner").index(which), scene.geometry
    radius, reduced, radii = geometry.raceways[place], geometry.reduced_radii[place], geometry.roller_radii
    form = _form(getattr(scene.bearing, f"{which}_waviness"))
    largest_roller = geometry.roller_radius if radii is None else float(radii.max())
    largest_load = TRACTION_RANGE * max(scene.operation.largest_load_N, 1.0)
    # A tilt may close the ends of a contact with an open middle.
    end_rise = 0.5 * scene.bearing.effective_length * abs(scene.bearing.tilt)
    return Race(
        radius=radius,
        reach=radius + largest_roller + largest_rise(form) + end_rise,
        form=form,
        contact=race_contact_law(scene, which),
        damping=_race_damping(scene),
        traction=race_traction(scene, rolling_contacts(scene)[which], scene.oil(which), largest_load, which),
        rolling=rolling_law(scene, scene.oil(which), reduced),
        tangential=_tangential(scene, place),
    )


def _tangential(scene: Scene, place: int) -> RigidContact | ElasticContact:
    """Law by which traction coefficients of the outer (0) or inner race (1) follow the steady law; rigid where none is a state."""
    start = layout_of(scene).coefficients
    if start is None:
        return RigidContact()
    # Of the most loaded roller (Stribeck), between its two races.
    load = 5.0 * max(scene.operation.largest_load_N, 1.0) / scene.bearing.rollers
    stiffness = 10.0 / 9.0 * load / contact_approach(scene, load)
    mass = scene.geometry.roller_mass
    ratio = 0.0 if scene.model.race_damping == "off" else scene.model.race_damping_ratio
    # Translation acts with the mass of the roller on two springs, traction with the third of it that turns with the slip.
    shortest, damping = 0.75 * math.sqrt(mass / (2.0 * stiffness)), 2.0 * ratio * math.sqrt(mass / (3.0 * stiffness))
    return ElasticContact(start + place * scene.bearing.rollers, shortest, damping, 1.0 / (LIGHT_LOAD * load))


def _form(harmonics: list[Harmonic]) -> Any:
    if not harmonics:
        return RoundRace()
    return wavy_race(
        np.array([harmonic.order for harmonic in harmonics]),
        np.array([harmonic.amplitude for harmonic in harmonics]),
        np.array([harmonic.phase for harmonic in harmonics]),
    )


def race_contact_law(scene: Scene, which: str) -> Any:
    """Load law of a roller on the "outer" or the "inner" race."""
    length, gamma = scene.bearing.effective_length, scene.bearing.diameter_ratio
    modulus = _modulus(scene, "roller", "rings")
    law = scene.model.line_contact
    contact: Any = palmgren(modulus, length)
    if law == "iso16281":
        contact = iso_16281(modulus, length)
    elif law == "houpert":
        contact = houpert(modulus, length, scene.geometry.reduced_radii[("outer", "inner").index(which)])
    elif law == "dowson_higginson":
        contact = dowson_higginson(modulus, length, gamma if which == "outer" else -gamma)
    if scene.slices == 1:
        return contact
    from rbdyn.contact.profile import slice_centres

    share = scene.bearing.inner_tilt_share if which == "inner" else 1.0 - scene.bearing.inner_tilt_share
    return slice_contact(
        contact,
        roller_relief(scene, scene.slices),
        slice_centres(scene.slices, length),
        scene.bearing.tilt * share,
        scene.bearing.tilt_direction,
    )


def roller_relief(scene: Scene, slices: int) -> Array:
    """Profile drop of the roller at its slice centres [m]."""
    if scene.bearing.roller_profile == "cylinder":
        return np.zeros(slices)
    from rbdyn.contact import profile

    drawing, length = scene.bearing, scene.bearing.effective_length
    position = profile.slice_centres(slices, length)
    if drawing.crown_radius is not None:
        return profile.crowned_relief(position, drawing.crown_radius)
    if drawing.lundberg_load_N is not None:
        return profile.lundberg_relief(position, length, drawing.lundberg_load_N, _modulus(scene, "roller", "rings"))
    if drawing.profile_table is not None:
        return profile.table_relief(position, drawing.profile_table)
    return profile.logarithmic_relief(position, drawing.roller_diameter, length)


def _race_damping(scene: Scene) -> NoDamping | ViscousDamping | HuntCrossleyDamping:
    laws = scene.model
    if laws.race_damping == "viscous":
        scale = 2.0 * laws.race_damping_ratio * math.sqrt(scene.geometry.roller_mass)
        return ViscousDamping(scale, laws.race_damping_rate)
    if laws.race_damping == "hunt_crossley":
        return HuntCrossleyDamping(laws.race_damping_alpha_s_m)
    return NoDamping()


def _friction(scene: Scene, coefficient: float) -> NoTraction | CoulombTraction:
    return dry_friction(coefficient, scene.traction.blend_speed_m_s)


def _hunt_crossley(alpha: float) -> NoDamping | HuntCrossleyDamping:
    return HuntCrossleyDamping(alpha) if alpha > 0.0 else NoDamping()


def _rolling_reduction(scene: Scene, oil: Oil) -> float:
    """Heating of the inlet times the scene's factor. The entrainment speed varies little: it is the kinematic one."""
    heating = resistance.aihara_thermal_factor(
        oil.viscosity_slope, oil.conductivity, abs(scene.geometry.motion.entrainment)
    )
    return heating * scene.model.rolling_resistance_factor


def _open_film(scene: Scene, oil: Oil, layer: float = 0.0) -> NoOpenFilm | resistance.OpenFilm | resistance.LayerFilm:
    """Film of the inner race and a roller that does not touch it, fed by an oil ``layer`` [m] unless the races are flooded."""
    if not scene.model.open_contact_film:
        return NoOpenFilm()
    lubricant, length, radius = scene.lubricant, scene.bearing.effective_length, scene.geometry.reduced_radii[1]
    stiffness = palmgren(_modulus(scene, "roller", "rings"), length).stiffness
    roughness = math.hypot(lubricant.roller_roughness, lubricant.race_roughness)
    speed = abs(scene.geometry.motion.entrainment)
    touching = resistance.touching_gap(oil.viscosity, radius, length, speed, stiffness, roughness)
    reduction = _rolling_reduction(scene, oil)
    fed = None if lubricant.inlet_distance is None else layer
    return resistance.open_film(oil.viscosity, radius, length, reduction, touching, fed)


def rolling_law(scene: Scene, oil: Oil, reduced_radius: float) -> Any:
    """Rolling resistance of a race contact of this reduced radius [m]."""
    if scene.model.rolling_resistance == "off":
        return resistance.NoRollingResistance()
    reduction = _rolling_reduction(scene, oil)
    modulus, length = _modulus(scene, "roller", "rings"), scene.bearing.effective_length
    flooded = resistance.biboulet_houpert(oil.viscosity, modulus, reduced_radius, length, reduction)
    distance = scene.lubricant.inlet_distance
    if distance is None:
        return flooded
    return resistance.starved(
        flooded, oil.viscosity, oil.pressure_coefficient, modulus, reduced_radius, length, distance
    )


def _pocket(scene: Scene, oil: Oil) -> Any:
    laws, cage = scene.model, scene.cage
    if laws.pocket == "off":
        return cage_laws.NoPocket()
    touching = cage.pocket_contact_length or scene.bearing.effective_length
    plain = palmgren(_modulus(scene, "roller", "cage"), touching)
    bar = laws.pocket_bar_stiffness_N_m
    contact = plain if bar == "rigid" else LineContactOnBar(plain.stiffness, float(bar))
    damping, friction = _hunt_crossley(laws.alpha("pocket")), _friction(scene, laws.pocket_friction)
    clearance, radius = 0.5 * scene.pocket_clearance_m, scene.geometry.roller_radius
    pocket: Any = cage_laws.Pocket(clearance, radius, contact, damping, friction)
    if laws.pocket_film:
        from rbdyn.contact.cage_film import pocket_film

        floor = laws.pocket_film_floor
        covered = cage.pocket_contact_length or scene.bearing.roller_length
        film = pocket_film(oil.viscosity, radius, covered, floor, laws.pocket_fill)
        walls = cage_laws.Pocket(clearance - floor, radius, contact, damping, friction)
        pocket = cage_laws.LubricatedPocket(walls, film, clearance, radius)
    lip, mounted = scene.lip_clearance_m, scene.cage_clearances
    if lip is None:
        return pocket
    outer, inner = scene.geometry.raceways
    circle = 0.5 * (outer + inner) + (0.0 if mounted is None else mounted.shift)
    return cage_laws.LippedPocket(pocket, circle, 0.5 * lip, radius, contact, damping, friction)


def pocket_width(scene: Scene) -> float:
    """Full Hertz width of a roller on a plane pocket wall [m] over the root of the force of all pockets [N]."""
    length = scene.cage.pocket_contact_length or scene.bearing.effective_length
    contact = film_thickness.RollingContact(
        scene.geometry.roller_radius, length, _modulus(scene, "roller", "cage"), 0.0
    )
    return 2.0 * float(film_thickness.half_width(contact, 1.0 / scene.bearing.rollers))


def _impacts(scene: Scene) -> cage_laws.NoImpacts | cage_laws.Impacts:
    damage = scene.damage
    if scene.model.pocket == "off" or not damage.impacts:
        return cage_laws.NoImpacts()
    return cage_laws.Impacts(damage.impact_speed_m_s, damage.fatigue_exponent)


# Factor of Blok's flash temperature for a parabolic distribution of heat.
BLOK = 1.11
# Samples of the races in a shaft turn; an entry begins at a tenth of the load, and ends at 2 % of the rolling speed.
RACE_SAMPLES, ENTRY_LOAD, ENTRY_SLIP = 24, 0.1, 0.02


def _race_samples(scene: Scene, bearing: RollerBearing) -> NoRaceSamples | RaceSamples:
    contacts, motion = rolling_contacts(scene), scene.geometry.motion
    speed = abs(motion.entrainment)
    if not scene.damage.races or speed == 0.0:
        return NoRaceSamples()
    effusivity = 0.5 * (scene.material("rings").effusivity + scene.material("roller").effusivity)

    def scale(contact: film_thickness.RollingContact) -> RaceScale:
        per_root = float(film_thickness.half_width(contact, 1.0))
        flash = BLOK / (contact.length * effusivity * math.sqrt(2.0 * per_root))
        return RaceScale(0.5 / (contact.length * per_root), flash, speed)

    inner = load_distribution(scene, bearing, _mean_load(scene)).inner
    load = ENTRY_LOAD * float(inner.max(axis=1).mean())
    spacing = scene.turn_s / RACE_SAMPLES
    pause = math.pi / (spacing * max(abs(motion.cage_speed), 1e-9 / spacing))
    return RaceSamples(
        spacing, scale(contacts["inner"]), scale(contacts["outer"]), load or math.inf, ENTRY_SLIP * speed, pause
    )


# Rate at which the film of the land stops a concentric cage, over the frequency of contacts, above which the steps of a run would
# be those of the film. It is 0.003 to 0.006 in bearings at working temperature, 0.03 there in a land of half the usual clearance,
# and 0.3 in thick oil at 0 C.
STOPPING = 0.05


def _guide(scene: Scene, oil: Oil) -> cage_laws.NoGuide | cage_laws.OuterGuide | cage_laws.InnerGuide:
    laws, cage, clearance = scene.model, scene.cage, scene.guide_clearance_m
    if clearance is None:
        return cage_laws.NoGuide()
    land = scene.geometry.land_radius
    journal = land - clearance if cage.guidance == "outer" else land
    film: Any = cage_laws.NoFilm()
    play = clearance
    if laws.guide_land == "film":
        floor = laws.land_film_floor
        play -= floor
        film = short_journal_film(oil.viscosity, journal, cage.land_width, cage.lands, clearance, floor, laws.land_fill)
        if stopping_rate(film, cage.mass) > STOPPING * scales(scene).speed / scales(scene).length:
            film = StoppingFilm(*film)
    dry = cage_laws.DryContact(
        play,
        palmgren(_modulus(scene, "cage", "rings"), cage.lands * cage.land_width),
        _hunt_crossley(laws.alpha("land")),
        _friction(scene, laws.land_friction),
    )
    return (
        cage_laws.OuterGuide(journal, film, dry)
        if cage.guidance == "outer"
        else cage_laws.InnerGuide(journal, film, dry)
    )


def _drag(scene: Scene, oil: Oil) -> Any:
    laws, drawing = scene.model, scene.bearing
    if laws.drag == "off" or laws.drag_coefficient == 0.0:
        return bodies.NoDrag()
    sizes, fraction = (drawing.roller_diameter, drawing.roller_length), scene.lubricant.oil_fraction
    return bodies.cylinder_drag(oil.density, fraction, laws.drag_coefficient, *sizes)


def _cage(scene: Scene) -> bodies.BalancedCage | bodies.UnbalancedCage:
    cage, inertia = scene.cage, scene.geometry.cage_inertia
    if cage.imbalance == 0.0:
        return bodies.BalancedCage(cage.mass, inertia)
    return bodies.UnbalancedCage(cage.mass, inertia, cage.imbalance)


def _outer_ring(scene: Scene) -> bodies.HeldRing | bodies.SupportedRing:
    support, start = scene.support, layout_of(scene).support
    if support is None or start is None:
        return bodies.HeldRing()
    return bodies.SupportedRing(
        start, support.outer_ring_mass_kg, float(support.stiffness_N_m), float(support.damping_N_s_m)
    )


def _gravity(scene: Scene) -> bodies.NoGravity | bodies.Gravity:
    size, direction = scene.operation.gravity_m_s2, scene.operation.gravity_direction
    return bodies.Gravity(size * math.cos(direction), size * math.sin(direction)) if size > 0.0 else bodies.NoGravity()


def _drive(scene: Scene) -> "bodies.SteadyDrive | bodies.TwoSpeedDrive | ClockedDrive":
    operation, clock = scene.operation, layout_of(scene).clock
    inner, outer = operation.speeds
    load = float(operation.radial_load_N)
    if clock is None:
        return bodies.SteadyDrive(inner, load) if outer == 0.0 else bodies.TwoSpeedDrive(inner, outer, load)
    from rbdyn.dynamics.forces.schedule import ClockedDrive

    return ClockedDrive(
        clock,
        _schedule(scene, "inner_speed", inner),
        outer,
        _schedule(scene, "radial_load_N", load),
        float(operation.rotating_load_N),
        operation.unbalance,
    )


def _schedule(scene: Scene, key: str, otherwise: float) -> Any:
    from rbdyn.dynamics.forces.schedule import Constant, Ramps, SmoothRamps, Steps

    schedule = scene.operation.schedule
    values = getattr(schedule, key, None)
    if schedule is None or values is None:
        return Constant(otherwise)
    kinds: dict[str, Any] = {"step": Steps, "linear": Ramps, "smooth": SmoothRamps}
    return kinds[schedule.shape](np.array(schedule.time_s, float), np.array(values, float))
