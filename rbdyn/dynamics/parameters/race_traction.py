"""From a scene to the traction law of one race, and how thick its film is."""

import math
from typing import TYPE_CHECKING, Any

from rbdyn.contact import film_thickness, traction
from rbdyn.faults import InputError
from rbdyn.properties.lubricants import Oil
from rbdyn.properties.materials import equivalent_modulus
from rbdyn.scene import Scene
from rbdyn.scene.lubricant import RHEOLOGIES

if TYPE_CHECKING:
    from rbdyn.contact.rheology import Rheology

# The slip of rollers that stand still is twice the entrainment speed.
LARGEST_SLIP_RATIO = 2.0
# A table starts at the load where the film turns elastohydrodynamic, but spans at least this ratio of loads.
SMALLEST_RANGE = 10.0
# Entrainment speed [m/s] that is round-off of none.
ROLLING = 1e-9
# It ends at the static capacity of a roller contact (ISO 76: 4 GPa), past which no oil law holds.
LARGEST_PRESSURE = 4e9
# Error of a table, as a share of its largest coefficient, that is refused.
LARGEST_ERROR = 0.01


def race_traction(scene: Scene, contact: film_thickness.RollingContact, oil: Oil, largest_load: float) -> Any:
    """Traction law of a race by one of its contacts.

    ``oil`` is the scene's, at its temperature; a table covers loads up to ``largest_load`` [N]. The film is that of
    pure rolling. Raises InputError where a model needs a film and nothing rolls.
    """
    table = scene.traction
    if table.elasticity and not contact.entrainment_speed > ROLLING:
        raise InputError(["traction.elasticity = true: needs contacts that roll, but the races do not; leave it out"])
    if table.model not in RHEOLOGIES and table.friction == "film":
        return _load_independent(scene)
    if not contact.entrainment_speed > ROLLING:
        key = f"model = '{table.model}'" if table.model in RHEOLOGIES else "friction = 'mixed'"
        raise InputError([f"traction.{key}: needs a film, but the races do not roll; choose another"])
    law = _surface(scene, contact, oil, largest_load) if table.model in RHEOLOGIES else _load_independent(scene)
    return _mixed(scene, law, contact, oil) if table.friction == "mixed" else law


def rolling_contacts(scene: Scene) -> dict[str, film_thickness.RollingContact]:
    """The "outer" and "inner" contact of a whole roller, rolling at the nominal speed."""
    modulus = equivalent_modulus(scene.material("roller"), scene.material("rings"))
    length, speed = scene.bearing.effective_length, abs(scene.geometry.motion.entrainment)
    return {
        race: film_thickness.RollingContact(radius, length, modulus, speed)
        for race, radius in zip(("outer", "inner"), scene.geometry.reduced_radii, strict=True)
    }


def film_report(scene: Scene, oil: Oil, inner_load: float, outer_load: float) -> dict[str, dict[str, float]]:
    """Films at the loads [N] > 0 of an inner and an outer contact, in pure rolling at the nominal speed.

    For each of "inner" and "outer": load_N, hertz_pressure_Pa, central_film_m and minimum_film_m (both with inlet
    heating; the first with starvation where asked), thermal_factor, lambda_ratio (of the central film) and
    asperity_share (what mixed friction would take). Empty where the races do not roll.
    """
    report = {}
    for (race, contact), load in zip(rolling_contacts(scene).items(), (outer_load, inner_load), strict=True):
        if contact.entrainment_speed == 0.0:
            continue
        factor = film_thickness.thermal_factor(contact, oil, load)
        film = film_thickness.film_in_service(contact, oil, load, scene.lubricant.inlet_distance)
        ratio = _lambda(scene, film)
        values = {
            "load_N": load,
            "hertz_pressure_Pa": film_thickness.hertz_pressure(contact, load),
            "central_film_m": film,
            "minimum_film_m": factor * film_thickness.minimum_film(contact, oil, load),
            "thermal_factor": factor,
            "lambda_ratio": ratio,
            "asperity_share": film_thickness.asperity_share(
                ratio, scene.traction.asperity_b, scene.traction.asperity_c
            ),
        }
        report[race] = {key: float(value) for key, value in values.items()}
    return report


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


def _surface(scene: Scene, contact: film_thickness.RollingContact, oil: Oil, largest_load: float) -> Any:
    from rbdyn.contact.rheology import traction_coefficient, with_body_creep

    rheology = _rheology(scene, oil)

    def coefficient(slip: Any, load: Any) -> Any:
        film = film_thickness.film_in_service(contact, oil, load, scene.lubricant.inlet_distance)
        alone = traction_coefficient(rheology, contact, slip, load, film)
        return with_body_creep(alone, contact, slip, load)

    capacity = 2.0 * math.pi * contact.radius * contact.length * LARGEST_PRESSURE**2
    largest_load = min(largest_load, capacity / contact.equivalent_modulus)
    smallest_load = min(film_thickness.lightest_load(contact, oil), largest_load / SMALLEST_RANGE)
    largest_slip = LARGEST_SLIP_RATIO * contact.entrainment_speed
    fit = traction.traction_surface(coefficient, largest_load, smallest_load, largest_slip)
    if fit.error > LARGEST_ERROR:
        what = f"traction.model = '{scene.traction.model}': its table is off by {100.0 * fit.error:.2g} % of the peak"
        raise InputError([f"{what} up to {largest_load:.4g} N; raise lubricant.temperature_C or choose another model"])
    return fit.surface


def _rheology(scene: Scene, oil: Oil) -> "Rheology":
    from rbdyn.contact.rheology import Eyring, LimitingShear, thermal_newtonian

    table = scene.traction
    if table.model == "thermal_newtonian":
        name = table.rheology_oil or scene.lubricant.oil
        return thermal_newtonian(name, scene.lubricant.temperature_C, oil.conductivity, table.largest_shear_ratio)
    if table.model == "eyring":
        stress = table.eyring_stress
        return Eyring(oil.viscosity, oil.pressure_coefficient, stress, table.largest_shear_ratio)
    return LimitingShear(oil.viscosity, oil.pressure_coefficient, table.limiting_shear_ratio)


def _mixed(scene: Scene, fluid: Any, contact: film_thickness.RollingContact, oil: Oil) -> traction.MixedTraction:
    table = scene.traction
    # The film goes as Q^-0.1. Heating and starvation vary little with the load: they are taken at that of the most
    # loaded roller, 5 F/Z (Stribeck).
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
