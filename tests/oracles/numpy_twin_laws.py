"""Laws of single contacts for the numpy twin: scalars in, scalars out, from a scene's own numbers.

No kernel of ``rbdyn``: implicit laws are bracketed, slices are looped over, the schedule is interpolated by numpy. The
one thing taken from the package is the traction coefficient of a rheology, which other tests hold against quadrature.
"""

import functools
import math

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from rbdyn.contact import film_thickness, rheology
from rbdyn.properties.materials import oil_at

EXACT = {"xtol": 1e-300, "rtol": 1e-15}


def modulus(scene, first, second):
    parts = (scene.material(first), scene.material(second))
    return 2.0 / sum((1.0 - part.poisson_ratio**2) / part.elastic_modulus for part in parts)


def oil_of(scene):
    """Viscosity, its slope, density, conductivity, pressure coefficient, with what the scene replaces."""
    from dataclasses import replace

    oil, given = oil_at(scene.lubricant.oil, scene.lubricant.temperature_C), scene.lubricant
    if given.viscosity_mPas is not None:
        factor = given.viscosity_mPas * 1e-3 / oil.viscosity
        oil = replace(oil, viscosity=factor * oil.viscosity, viscosity_slope=factor * oil.viscosity_slope)
    if given.pressure_coefficient_1_GPa is not None:
        oil = replace(oil, pressure_coefficient=given.pressure_coefficient_1_GPa * 1e-9)
    return oil


def raceways(scene):
    """Radius of the outer and of the inner raceway [m]."""
    pitch, roller = scene.bearing.pitch_diameter_mm, scene.bearing.roller_diameter_mm
    clearance = scene.mounted_clearance_mm
    return (pitch + roller + 0.5 * clearance) / 2e3, (pitch - roller - 0.5 * clearance) / 2e3


def reduced_radius(scene, encloses):
    radius, race = 0.5e-3 * scene.bearing.roller_diameter_mm, raceways(scene)[0 if encloses else 1]
    return 1.0 / (1.0 / radius + (-1.0 if encloses else 1.0) / race)


def nominal_entrainment(scene):
    """Mean surface speed of rolling without slip, seen from the cage."""
    inner, outer = (
        speed * math.pi / 30.0 for speed in (scene.operation.inner_speed_rpm, scene.operation.outer_speed_rpm)
    )
    outer_radius, inner_radius = raceways(scene)
    return abs(inner - outer) * outer_radius * inner_radius / (outer_radius + inner_radius)


def palmgren_stiffness(scene, first, second, length):
    """Chen et al. 2022, eq 6, solved for the load [N/m^(10/9)]."""
    return modulus(scene, first, second) / 8.0 * (1.0 / 0.39) ** (10.0 / 9.0) * length ** (8.0 / 9.0)


def whole_load(scene, encloses, approach):
    """Load and tangent stiffness of an uncut roller on a race."""
    name, length = scene.model.line_contact, scene.bearing.effective_length_mm * 1e-3
    e = modulus(scene, "roller", "rings")
    if name == "palmgren":
        load = palmgren_stiffness(scene, "roller", "rings", length) * approach ** (10.0 / 9.0)
        return load, 10.0 / 9.0 * load / approach
    if name == "iso16281":
        # Both races of a steel roller together, each with half the approach.
        load = 35948.0 * (length * 1e3) ** (8.0 / 9.0) * (2e3 * approach) ** (10.0 / 9.0)
        load *= e / (206e9 / (1.0 - 0.3**2))
        return load, 10.0 / 9.0 * load / approach
    if name == "houpert":
        load = 0.2723 * length * e * reduced_radius(scene, encloses) ** -0.074 * approach**1.074
        return load, 1.074 * load / approach
    gamma = scene.bearing.roller_diameter_mm / scene.bearing.pitch_diameter_mm * (1.0 if encloses else -1.0)
    compliance, largest = 2.0 / (math.pi * e * length), math.pi * e * length**2 / (1.0 + gamma)
    # approach = compliance Q ln(largest/Q), sought as y = ln(largest/Q).
    y = brentq(lambda y: compliance * largest * math.exp(-y) * y / approach - 1.0, 1.0, 200.0, **EXACT)
    return largest * math.exp(-y), 1.0 / (compliance * (y - 1.0))


def drop(scene, x):
    """How far the roller's surface lies below a cylinder at ``x`` from its middle [m]."""
    drawing = scene.bearing
    length, diameter = drawing.effective_length_mm * 1e-3, drawing.roller_diameter_mm * 1e-3
    if drawing.roller_profile == "cylinder":
        return 0.0
    if drawing.roller_profile == "crowned":
        crown = drawing.crown_radius_mm * 1e-3
        return 2.0 * crown * math.sin(0.5 * math.asin(x / crown)) ** 2
    if drawing.roller_profile == "table":
        points = np.array(drawing.profile_table_mm_um)
        place = abs(x) * 1e3 if points[0, 0] >= 0.0 else x * 1e3
        return float(np.interp(place, points[:, 0], points[:, 1])) * 1e-6
    factor = 0.00035 * diameter
    if drawing.roller_profile == "lundberg":
        factor = 2.0 * drawing.lundberg_load_N / (math.pi * length * modulus(scene, "roller", "rings"))
    return -factor * math.log(1.0 - (2.0 * x / length) ** 2)


def race_load(scene, encloses, approach, azimuth):
    """Elastic load, tangent stiffness, mean approach (weighted by stiffness) of a roller's slices at an azimuth, and how
    their mean overlap (weighted by load) changes with the azimuth.
    """
    drawing = scene.bearing
    plain = drawing.roller_profile == "cylinder" and drawing.tilt_mrad == 0.0
    slices = scene.model.slices or (1 if plain else 31)
    share = 1.0 - drawing.inner_tilt_share if encloses else drawing.inner_tilt_share
    largest, from_there = drawing.tilt_mrad * 1e-3 * share, azimuth - math.radians(drawing.tilt_direction_deg)
    load = stiffness = weighted = arm = 0.0
    for s in range(slices):
        x = ((s + 0.5) / slices - 0.5) * drawing.effective_length_mm * 1e-3
        own = approach + x * largest * math.cos(from_there) - drop(scene, x)
        if own > 0.0:
            q, k = whole_load(scene, encloses, own)
            load, stiffness, weighted = load + q / slices, stiffness + k / slices, weighted + own * k / slices
            arm += x * q / slices
    lean = -largest * math.sin(from_there) * arm / max(load, 1e-300)
    return load, stiffness, weighted / max(stiffness, 1e-300), lean


def wall_load(scene, approach):
    """Elastic load on a pocket wall or lip: indentation plus bending of the bar make up the approach."""
    length = scene.cage.pocket_contact_length_mm or scene.bearing.effective_length_mm
    k = palmgren_stiffness(scene, "roller", "cage", length * 1e-3)
    bar = scene.model.pocket_bar_stiffness_N_m
    if bar == "rigid":
        return k * approach ** (10.0 / 9.0)
    dent = brentq(lambda d: d + k * d ** (10.0 / 9.0) / bar - approach, 0.0, approach, **EXACT)
    return k * dent ** (10.0 / 9.0)


def restitution_alpha(restitution, speed):
    """Alpha from phase-plane integration: m v dv = -Q (1 + 1.5 alpha v) dx gives the same integral both ways."""
    if restitution == 1.0:
        return 0.0
    nodes, weights = np.polynomial.legendre.leggauss(60)

    def work(v, d):
        """Integral of u/(1 + d u) from 0 to v, with speeds over the impact speed."""
        u = 0.5 * v * (nodes + 1.0)
        return 0.5 * v * float(weights @ (u / (1.0 + d * u)))

    largest = (1.0 - 1e-9) / restitution
    d = brentq(lambda d: work(1.0, d) - work(-restitution, d), 1e-12, largest, **EXACT)
    return d / (1.5 * speed)


def hunt_crossley(load, alpha, rate):
    return max(load * (1.0 + 1.5 * alpha * rate), 0.0)


def alpha_of(scene, part):
    laws = scene.model
    restitution = getattr(laws, f"{part}_restitution")
    if restitution is not None:
        return restitution_alpha(restitution, getattr(laws, f"{part}_restitution_speed_m_s"))
    given = getattr(laws, f"{part}_damping_alpha_s_m")
    return 0.75 if given is None else given


def race_damped(scene, load, stiffness, approach, rate, mass):
    laws = scene.model
    if laws.race_damping == "hunt_crossley":
        return hunt_crossley(load, laws.race_damping_alpha_s_m, rate)
    if laws.race_damping == "off":
        return load
    critical = 2.0 * math.sqrt(stiffness * mass)
    share = min(approach / (laws.race_damping_engagement_um * 1e-6), 1.0)
    return max(load + laws.race_damping_ratio * critical * (3.0 * share**2 - 2.0 * share**3) * rate, 0.0)


def gupta_constants(table):
    """A, B, C, D from the peak: x exp(-(x - A)/x) = mu_m - mu_inf, B = (x - A)/u_m, C = B/x."""
    if table.constants is not None:
        return table.constants
    a, peak = table.mu_0 - table.mu_inf, table.mu_m - table.mu_inf
    lowest, highest = max(a, 1e-4 * abs(a)), 100.0 * (abs(a) + peak)
    x = brentq(lambda x: x * math.exp(-(x - a) / x) - peak, lowest, highest, **EXACT)
    b = (x - a) / table.u_m_m_s
    return a, b, b / x, table.mu_inf


def rolling_contact(scene, encloses):
    return film_thickness.RollingContact(
        reduced_radius(scene, encloses),
        scene.bearing.effective_length_mm * 1e-3,
        modulus(scene, "roller", "rings"),
        nominal_entrainment(scene),
    )


def rheology_of(scene, oil):
    table = scene.traction
    if table.model == "eyring":
        return rheology.Eyring(
            oil.viscosity, oil.pressure_coefficient, table.eyring_stress_MPa * 1e6, table.largest_shear_ratio
        )
    if table.model == "limiting_shear":
        return rheology.LimitingShear(oil.viscosity, oil.pressure_coefficient, table.limiting_shear_ratio)
    name = table.rheology_oil or scene.lubricant.oil
    return rheology.thermal_newtonian(name, scene.lubricant.temperature_C, oil.conductivity, table.largest_shear_ratio)


def fluid_traction(scene, encloses, slip, load):
    table = scene.traction
    if table.model == "off":
        return 0.0
    if table.model == "coulomb":
        return table.coulomb * math.tanh(slip / table.blend_speed_m_s)
    if table.model != "four_constant":
        oil, contact = oil_of(scene), rolling_contact(scene, encloses)
        film = film_thickness.film_in_service(contact, oil, load, scene.lubricant.inlet_distance)
        mu = float(rheology.traction_coefficient(rheology_of(scene, oil), contact, abs(slip), load, film))
        # Carter's creep of the rolling bodies, mu = 2 R u/(b u_e), in series with the film.
        width = math.sqrt(8.0 * load * contact.radius / (math.pi * contact.length * modulus(scene, "roller", "rings")))
        creep = 2.0 * contact.radius * abs(slip) / (width * contact.entrainment_speed)
        return math.copysign(1.0 / math.hypot(1.0 / mu, 1.0 / creep), slip)
    a, b, c, d = gupta_constants(table)
    speed = abs(slip)
    mu = (a + b * speed) * math.exp(-c * speed) + d
    if a + d > 1e-15:
        return mu * slip / math.hypot(slip, table.blend_speed_m_s)
    return math.copysign(mu, slip)


def race_traction(scene, encloses, slip, load):
    """Traction coefficient; with mixed friction the asperities carry exp(-b Lambda^c), Lambda falling as Q^-0.1."""
    table, given = scene.traction, scene.lubricant
    fluid = fluid_traction(scene, encloses, slip, load) if load > 0.0 else 0.0
    if table.friction == "film" or load == 0.0:
        return fluid
    oil, contact = oil_of(scene), rolling_contact(scene, encloses)
    reference = 5.0 * scene.operation.largest_load_N / scene.bearing.rollers
    reference = max(reference, film_thickness.lightest_load(contact, oil))
    film = film_thickness.film_in_service(contact, oil, reference, given.inlet_distance)
    ratio = float(film) / math.hypot(given.roller_roughness_um, given.race_roughness_um) * 1e6
    ratio *= (load / reference) ** -0.1
    share = math.exp(-table.asperity_b * ratio**table.asperity_c)
    return share * table.boundary_friction * math.tanh(slip / table.blend_speed_m_s) + (1.0 - share) * fluid


def rolling_resistance(scene, encloses, load, speed):
    """Biboulet and Houpert 2010 with Aihara's heating of the inlet, from the dimensionless groups; each branch keeps its
    share where the oil begins at a distance."""
    if scene.model.rolling_resistance == "off" or load == 0.0:
        return 0.0
    oil, length, radius = (oil_of(scene), scene.bearing.effective_length_mm * 1e-3, reduced_radius(scene, encloses))
    e = modulus(scene, "roller", "rings")
    u, w = 2.0 * oil.viscosity * speed / (e * radius), load / (length * e * radius)
    heating = oil.viscosity_slope * nominal_entrainment(scene) ** 2 / oil.conductivity
    thermal = scene.model.rolling_resistance_factor / (1.0 + 0.29 * heating**0.78)
    rigid, elastic = 1.42 * math.sqrt(u * w), 1.42 * 1.45 / 1.4 * u**0.75
    distance = scene.lubricant.inlet_distance
    if distance is not None:
        rigid *= distance / (distance + 1.845 + 1.48 / (1.0 + distance / 2.2))
        wide = math.hypot(w, math.sqrt(math.pi * 4.894 / 8.0 * u))
        half_width = math.sqrt(8.0 * wide / math.pi) * radius
        m = 1.0 + distance
        gap = m * math.sqrt(m * m - 1.0) - math.acosh(m)
        # Goksem and Hargreaves 1978: dynamic loading D, and traction in load over alpha E'.
        dynamic = 48.0 * oil.pressure_coefficient * oil.viscosity * speed * radius**2 / half_width**3
        tension = elastic * oil.pressure_coefficient * e / wide
        elastic /= 1.0 + 2.0 * dynamic / (math.pi * tension * math.sqrt(gap)) + 0.3 * math.pi * tension / gap
    return thermal * rigid / (1.0 + (rigid / elastic) ** 10) ** 0.1 * e * radius * length


def roller_mass(scene):
    drawing = scene.bearing
    volume = math.pi * (drawing.roller_diameter_mm * 1e-3) ** 2 / 4.0 * drawing.roller_length_mm * 1e-3
    return scene.material("roller").density * volume


def elastic_traction(scene, load, curve, coefficient, slip, stiffness):
    """Traction coefficient that acts and the rate of the state: the steady ``curve`` over the slip, a hyperbola near it, in series
    with a spring of the contact's normal stiffness and a damper beside it. Times below a radian of the most loaded roller's
    vibration are as long as that, and what acts at once keeps the integral of the lag."""
    if not scene.traction.elasticity:
        return curve(slip) if load > 0.0 else 0.0, 0.0
    most = 5.0 * max(scene.operation.largest_load_N, 1.0) / scene.bearing.rollers
    length, mass = scene.bearing.effective_length_mm * 1e-3, roller_mass(scene)
    approach = (most / palmgren_stiffness(scene, "roller", "rings", length)) ** 0.9
    spring = 10.0 / 9.0 * most / approach
    ratio = 0.0 if scene.model.race_damping == "off" else scene.model.race_damping_ratio
    shortest, damping = 0.75 * (mass / (2.0 * spring)) ** 0.5, 2.0 * ratio * (mass / 3.0 / spring) ** 0.5
    dying = coefficient / (shortest + damping)
    if load == 0.0:
        return coefficient, -dying
    steady, step = curve(slip), 1e-5
    steepness = math.log(curve(slip * math.exp(step)) / curve(slip * math.exp(-step))) / (2.0 * step)
    rise = steady * load / slip / stiffness
    last = rise * float(np.clip(steepness, 0.0, 1.0))
    longer, later = max(rise, shortest), max(last, shortest)
    exponent = (longer + damping) / (later + damping)
    along = coefficient / steady
    # Convex, with the slope of the exponent at its end: of the flattest such curves, where the shortest time hides the true slope.
    lack, hidden = max(1.0 - abs(along), 0.0), 1.0 - last / later
    size = (1.0 - lack) / (1.0 + (exponent - 1.0) * lack + exponent * (exponent - 1.0) * hidden * lack**2)
    size += exponent * max(abs(along) - 1.0, 0.0)
    rate = steady * (1.0 - math.copysign(size, along)) / (longer + damping)
    acting = coefficient + rate * (damping + longer - longer * (rise + last) / (longer + later))
    # The state fades in over the first hundredth of the load of the most loaded roller.
    share = float(np.clip(100.0 * load / most, 0.0, 1.0))
    share = 3.0 * share**2 - 2.0 * share**3
    return acting, share * rate - (1.0 - share) * dying


def open_film(scene, gap):
    """Rolling force per surface over the entrainment speed, and sliding force over the slip, of the film in an open inner
    contact [N s/m]: Reynolds's equation by quadrature, from the meniscus where the gap has the layer's thickness."""
    oil, length, radius = oil_of(scene), scene.bearing.effective_length_mm * 1e-3, reduced_radius(scene, False)
    lubricant, speed = scene.lubricant, nominal_entrainment(scene)
    heating = oil.viscosity_slope * speed**2 / oil.conductivity
    thermal = scene.model.rolling_resistance_factor / (1.0 + 0.29 * heating**0.78)
    stiffness = palmgren_stiffness(scene, "roller", "rings", length)
    bearing = 4.895 * oil.viscosity * speed * radius * length
    oil_gap = brentq(lambda h: stiffness * h ** (10.0 / 9.0) - bearing / h, 1e-12, 1e-3, **EXACT)
    touching = max(oil_gap, math.hypot(lubricant.roller_roughness_um, lubricant.race_roughness_um) * 1e-6)
    size = math.hypot(gap, touching)
    scale = math.sqrt(2.0 * radius) * oil.viscosity * length * gap / size**1.5
    layer = math.inf if lubricant.inlet_distance is None else scene.once("twin_layer", lambda: oil_layer(scene))
    if size >= layer:
        return 0.0, 0.0
    meniscus = min(math.sqrt(layer / size - 1.0), 1e12)
    end = film_end(meniscus)
    passing = 1.0 + end * end
    # With h = 1 + x^2 and the flow of the film's end: pressure gradient (h - passing)/h^3; streamers fill passing/h.
    rolling = quad(lambda s: ((x := math.sinh(s)) ** 2 - end**2) / (1.0 + x * x) ** 2 * math.cosh(s),
                   math.asinh(-meniscus), math.asinh(end), epsabs=1e-14, limit=400)[0]  # fmt: skip
    film = quad(lambda s: 1.0 / math.cosh(s), math.asinh(-meniscus), math.asinh(end), epsabs=1e-14, limit=400)[0]
    streamers = quad(lambda x: passing / (1.0 + x * x) ** 2, end, math.inf, epsabs=1e-14)[0]
    fading = min(50.0 * (1.0 - size / layer), 1.0)
    return 6.0 * scale * thermal * rolling, scale * (film + streamers) * fading


def oil_layer(scene):
    """Gap [m] at the meniscus of the inner contact with the mean load of static equilibrium, at eight places of the cage."""
    drawing, load = scene.bearing, scene.operation.radial_load_N
    stiffness = palmgren_stiffness(scene, "roller", "rings", drawing.effective_length_mm * 1e-3)
    outer, inner = raceways(scene)
    place = 0.5 * (outer + inner)
    turning = (scene.operation.inner_speed_rpm * inner + scene.operation.outer_speed_rpm * outer) / (outer + inner)
    thrown = roller_mass(scene) * place * (turning * math.pi / 30.0) ** 2

    def pressed(closing):
        """Inner load of a roller between races that approach by ``closing``, which throws itself outwards."""
        if closing <= (thrown / stiffness) ** 0.9:
            return 0.0
        ends = (thrown / stiffness) ** 0.9, closing
        outside = brentq(lambda x: stiffness * (x ** (10 / 9) - (closing - x) ** (10 / 9)) - thrown, *ends, **EXACT)
        return stiffness * (closing - outside) ** (10.0 / 9.0)

    loads, loose = [], 0.5e-3 * scene.mounted_clearance_mm
    for position in range(8):
        cosines = np.cos(2.0 * np.pi * (np.arange(drawing.rollers) + (position + 0.5) / 8.0) / drawing.rollers)
        found = brentq(lambda d, c=cosines: sum(pressed(d * x - loose) * x for x in c) - load, 0.0, 1e-3, xtol=1e-16)
        loads += [pressed(found * x - loose) for x in cosines]
    mean = float(np.mean([each for each in loads if each > 0.0]))
    contact, oil, m = rolling_contact(scene, False), oil_of(scene), 1.0 + scene.lubricant.inlet_distance
    film = film_thickness.film_in_service(contact, oil, mean, scene.lubricant.inlet_distance)
    ahead = m * math.sqrt(m * m - 1.0) - math.acosh(m)
    return float(film) + ahead * 4.0 * mean / (math.pi * contact.equivalent_modulus * contact.length)


@functools.cache
def film_end(meniscus):
    """Where the pressure of a rigid pair ends with its gradient, in sqrt(2 R h), from the meniscus on."""

    def left(end):
        ends = math.asinh(-meniscus), math.asinh(end)
        return quad(lambda s: ((x := math.sinh(s)) ** 2 - end**2) / (1.0 + x * x) ** 3 * math.cosh(s), *ends,
                    epsabs=1e-14, limit=400)[0]  # fmt: skip

    return brentq(left, 1e-3 * min(meniscus, 1.0), min(meniscus, 0.6), xtol=1e-14)


def scheduled(scene, key, time):
    """Inner speed [rpm] or load [N] at a time."""
    schedule = scene.operation.schedule
    values = getattr(schedule, key) if schedule is not None else None
    if values is None:
        return getattr(scene.operation, key)
    times = np.array(schedule.time_s)
    if schedule.shape == "linear":
        return float(np.interp(time, times, values))
    last = int(np.sum(times <= time)) - 1
    if schedule.shape == "step" or last < 0 or last == len(times) - 1:
        return values[max(last, 0)]
    turned = math.pi * (time - times[last]) / (times[last + 1] - times[last])
    middle, half = 0.5 * (values[last] + values[last + 1]), 0.5 * (values[last] - values[last + 1])
    return middle + half * math.cos(turned)


def roller_errors(scene):
    """Radius of each roller [m]: the one number that must be drawn as the program draws it."""
    drawing = scene.bearing
    nominal = 0.5e-3 * drawing.roller_diameter_mm
    if drawing.roller_diameter_errors_um is not None:
        return nominal + 0.5e-6 * np.array(drawing.roller_diameter_errors_um)
    if drawing.roller_diameter_spread_um == 0.0:
        return np.full(drawing.rollers, nominal)

    return scene.geometry.roller_radii
