"""A scene of a catalogue bearing or of one's own: estimates of what no catalogue lists, mounting, oil and cage."""

import json
import math
from collections import defaultdict
from typing import Any, NamedTuple

from rbdyn.base.faults import given
from rbdyn.base.words import shown
from rbdyn.draft.options import POLYAMIDE_NAME, Options
from rbdyn.life import rollers
from rbdyn.properties import catalogue
from rbdyn.properties.drawing import (
    STATED,
    BallDrawing,
    Boundary,
    RollerDrawing,
    drawing_ball_interior,
    drawing_roller_interior,
)
from rbdyn.properties.materials import MATERIALS
from rbdyn.properties.tolerances import Interference, housing_interference, shaft_interference
from rbdyn.scene.uncertain import documented

# Of a template, by the names in it.
Values = dict[str, Any]
# Classes for a load that stands still on an inner ring that turns, where only the other seat is stated.
USUAL_SHAFT, USUAL_HOUSING = "k5", "H7"
# Outer diameter of the housing over that of the bearing; rise of inner ring and rollers above the outer ring [K] (NTN, NSK).
HOUSING_SHARE, INNER_RISE = 1.5, 7.5
# By how much of the inner ring's rise above its drawing, at 20 C, the shaft stays below it: 0.10 to 0.15 (NSK).
SHAFT_LAG, DRAWING = 0.125, 20.0
DRIVEN_UP = Interference(0.0, 0.0, 0.0, 0.0, 0.0)


class Rings(NamedTuple):
    """Rings as bought: class of ISO 492, what the scene says of it, and whether the bore is tapered, so driven up its seat."""

    ring_class: str = "Normal"
    words: str = "bearing of normal tolerances (ISO 492)"
    tapered: bool = False


def mounting_values(sizes: catalogue.Envelope, rings: Rings, options: Options) -> Values:
    """Values of [mounting] for the classes of shaft and housing, the usual one where one is None.

    A tapered bore has no interference: its clearance is stated as driven up. Raises MethodError as ``shaft_interference``.
    """
    shaft, housing, tapered = options.shaft, options.housing, rings.tapered
    inner = DRIVEN_UP if tapered else shaft_interference(sizes.bore, shaft or USUAL_SHAFT, rings.ring_class)
    outer = housing_interference(sizes.outside, housing or USUAL_HOUSING, rings.ring_class)
    values = _assumed_temperatures(options.oil_temperature) | {
        "mounted": sizes,
        "shaft_by": "tapered shaft" if tapered else f"shaft {shaft or f'{USUAL_SHAFT} (not stated, usual)'}",
        "housing_by": f"housing {housing or f'{USUAL_HOUSING} (not stated, usual)'}",
        "housing_diameter": round(HOUSING_SHARE * sizes.outside, 1),
    }
    for ring, fit in (("inner", inner), ("outer", outer)):
        values |= {
            f"{ring}_interference": round(fit.mean, 2) + 0.0,
            f"{ring}_fit_by": _reason(fit),
            f"{ring}_law": _law(fit),
        }
    return values


def _assumed_temperatures(oil: float | None) -> Values:
    """Temperatures of the parts of a bearing whose oil has a temperature [C]; none of them where a heat balance computes them."""
    if oil is None:
        return {}
    warm = oil + INNER_RISE
    return {
        "estimated_mounting": ',\n    "mounting.inner_ring_temperature_C"',
        "temperatures_by": "assumed",
        "outer_temperature": oil,
        "inner_temperature": warm,
        "shaft_temperature": round(warm - SHAFT_LAG * (warm - DRAWING), 1),
    }


def _reason(fit: Interference) -> str:
    if fit == DRIVEN_UP:
        return "in the clearance, which is the clearance after driving up"
    less = f", less {fit.smoothing:.3g} of smoothing" if fit.smoothing else ""
    return f"mean of {fit.low + fit.smoothing:.3g} to {fit.high + fit.smoothing:.3g}{less}; negative is loose"


def _law(fit: Interference) -> str | None:
    """Law of an interference; None where all of the fits are loose and none has any effect."""
    if fit.high <= 0.0:
        return None
    numbers = f"mean = {fit.mean + 0.0:.2f}, sd = {fit.sd:.2f}, low = {fit.low:.2f}, high = {fit.high:.2f}"
    return f'{{ law = "normal", {numbers}, kind = "varies" }}'


# Glass-filled polyamide as [materials] takes it, and its density [g/mm^3].
POLYAMIDE = (
    "{ elastic_modulus_GPa = 5.0, poisson_ratio = 0.35, density_kg_m3 = 1300.0, thermal_expansion_1e_6_K = 40.0 }"
)
POLYAMIDE_DENSITY = 1.3e-3
# Radii of the inner and the outer groove over the ball's diameter, as ISO 281 rates.
USUAL_GROOVES = (0.52, 0.53)
BLOCK_BETWEEN = f"{catalogue.WIDEST_BAR:g} roller diameters; a block from pocket to pocket is stiffer than a bar"
# Upper end of the documented range of an effective length (unknown_inputs.toml).
LONGEST_EFFECTIVE = 1.05
# Error of a side ring's width [%] where the width of the bearing is an estimate too.
BLIND_SIDE_RING_ERROR = 50
# Where no suffix names a cage, and where none and no option names a clearance.
USUAL_CAGE, CLEARANCE = "MA", "CN"
# Guide clearance in pitch diameters.
GUIDE_CLEARANCE = 0.004
# Half-widths at which the oil begins unless a jet floods the inlet; share of oil in the cavity, less where little oil enters.
INLET_DISTANCE, FLOODED_SUPPLIES = 5.0, ("jet",)
OIL_FRACTION, SCARCE_FRACTION, SCARCE_SUPPLIES = 0.02, 0.005, ("drop", "oil_air", "grease")
SUPPLY_WORDS = {
    "bath": "oil bath", "drop": "drop feed", "jet": "oil jet", "oil_air": "oil and air", "grease": "grease, its base oil above"
}  # fmt: skip
# Axial over radial load, by tan(contact angle), that loads half of the balls (NSK).
HALF_LOADED = 1.216
# Reference speed times pitch diameter of ball bearings, as usual in catalogues, within 20 % [mm/min].
BALL_SPEEDS = {"deep_groove_ball": 1.0e6, "angular_contact_ball": 6.3e5}
# Temperature around a bearing by ISO 15312 [C].
AMBIENT_C = 20.0
# Of the reference speed and of C, where the user gives nothing.
USUAL_SPEED, USUAL_LOAD, USUAL_PRELOAD = 0.5, 0.1, 0.01


class CageKind(NamedTuple):
    """What guides a cage, what it is made of, and a sentence on where each comes from: "of suffix MA", "stated", "assumed"."""

    guidance: str
    material: str
    sentence: str


class Subject(NamedTuple):
    """The bearing that a scene is written of: by its designation, or by a drawing of one's own, whose ``boundary`` has sources.

    ``title`` begins the heading. ``series`` is ``NO_SERIES`` of a drawing. ``cage`` is of rollers, ``grooves`` of balls:
    radii of the inner and the outer one over the ball's diameter, None where ISO 281's are taken. ``clearance``: class of ISO 5753-1, or diametral [mm].
    """

    kind: str
    name: str
    title: str
    sizes: catalogue.Envelope
    inside: catalogue.RollerInterior | catalogue.BallInterior
    boundary: Boundary | None = None
    series: str = catalogue.NO_SERIES
    designation: str | None = None
    without_effect: str | None = None
    cage: CageKind | None = None
    grooves: tuple[float, float] | None = None
    clearance: str | float = CLEARANCE
    rings: Rings = Rings()

    @property
    def width_known(self) -> bool:
        """Whether the width of the rings is listed or stated."""
        return self.boundary is None or self.boundary.width_by == STATED


def catalogue_subject(named: catalogue.Designation, sizes: catalogue.Envelope, options: Options) -> Subject:
    """A bearing by its designation; guidance, cage material and clearance as typed, else of its suffix. Raises MethodError for
    impossible dimensions.
    """
    stated, listed = named.value_of("tolerance"), named.ring_class
    alike = "" if stated in (None, listed) else f", diameters as of {listed}"
    words = Rings().words if listed == "Normal" else f"bearing of class {stated}{alike} (ISO 492)"
    rollers = named.kind == catalogue.ROLLERS
    return Subject(
        kind=named.kind,
        name=named.name,
        title=f"{named.name}, {sizes.bore:g} x {sizes.outside:g} x {sizes.width:g} mm",
        sizes=sizes,
        inside=catalogue.roller_interior(sizes, named.series == "10")
        if rollers
        else catalogue.ball_interior(sizes, named),
        series=named.series,
        # Sizes that are typed are those of no listed bearing.
        designation=named.name if rollers and sizes.reference_speed is not None else None,
        without_effect=named.without_effect(bool(options.mounted)) or None,
        cage=cage_kind(named.value_of("cage"), options) if rollers else None,
        clearance=_clearance_of(options, named.value_of("clearance")),
        rings=Rings(listed, words, named.value_of("bore") is not None),
    )


def _clearance_of(options: Options, suffix: str | None = None) -> str | float:
    return options.clearance if options.clearance is not None else suffix or CLEARANCE


def drawing_subject(drawing: RollerDrawing | BallDrawing, boundary: Boundary, options: Options) -> Subject:
    """A bearing of one's own; of balls it is of deep grooves where it has a clearance in place of a contact angle."""
    inside: catalogue.RollerInterior | catalogue.BallInterior
    if isinstance(drawing, RollerDrawing):
        kind, inside = catalogue.ROLLERS, drawing_roller_interior(drawing)
        elements = f"{drawing.rollers} rollers of {drawing.diameter:g} x {drawing.length:g} mm"
    else:
        kind = catalogue.DEEP if drawing.contact_angle is None else catalogue.ANGULAR
        inside = drawing_ball_interior(drawing)
        elements = f"{drawing.balls} balls of {drawing.diameter:g} mm"
    return Subject(
        kind=kind,
        name="own",
        title=f"{elements} on a pitch diameter of {drawing.pitch_diameter:g} mm",
        sizes=boundary.envelope,
        inside=inside,
        boundary=boundary,
        cage=cage_kind(None, options) if kind == catalogue.ROLLERS else None,
        grooves=options.conformity,
        clearance=_clearance_of(options),
    )


def cage_kind(suffix: str | None, options: Options) -> CageKind:
    """A cage as typed, else as its suffix says, else the usual one."""
    usual_guidance, usual_material = catalogue.CAGES[suffix or USUAL_CAGE]
    guidance, material = options.guidance or usual_guidance, options.cage_material or usual_material
    source = f"of suffix {suffix}" if suffix else "assumed"
    guidance_by, material_by = (STATED if typed else source for typed in (options.guidance, options.cage_material))
    between = ", " if guidance_by == material_by else f"; {guidance_by}: "
    guides = f"guided by the {guidance}{'s' if guidance == 'roller' else ' ring'}"
    return CageKind(guidance, material, f"{material_by}: {material}{between}{guides}")


def roller_values(subject: Subject, options: Options) -> Values:
    """Values of ``roller_scene.toml``. Raises ValueError for an unlisted clearance."""
    inside, sizes = subject.inside, subject.sizes
    assert isinstance(inside, catalogue.RollerInterior)
    diameter, pitch, listed = inside.roller_diameter, inside.pitch_diameter, sizes.dynamic_capacity
    by_iso = rollers.dynamic_capacity(inside.rollers, diameter * 1e-3, inside.effective_length * 1e-3, pitch * 1e-3)
    volume = math.pi / 4.0 * (pitch - diameter) ** 2 * sizes.outside
    ratings = "" if listed is None else f", C = {1e-3 * listed:g} kN, C0 = {1e-3 * (sizes.static_capacity or 0.0):g} kN"
    reference = sizes.reference_speed or rollers.REFERENCE_SPEED_FACTOR / pitch
    scarce = options.supply in SCARCE_SUPPLIES
    return _common(subject, options, reference, listed or by_iso) | {
        **_clearance(subject),
        **_cage(subject, inside),
        **_estimated(subject, inside),
        "ratings": ratings or _rated(subject, by_iso),
        "ring_mass": 1e-9 * MATERIALS["bearing_steel"].density * volume,
        "capacity_share": by_iso / (listed or by_iso),
        "inlet_distance": None if options.supply in FLOODED_SUPPLIES else INLET_DISTANCE,
        "oil_fraction": None if options.oil_flow else SCARCE_FRACTION if scarce else OIL_FRACTION,
        "oil_fraction_by": "0.001 to 0.02 where little oil enters" if scarce else "0.005 to 0.1",
    }


def _estimated(subject: Subject, inside: catalogue.RollerInterior) -> Values:
    """Keys named in [uncertain] where they are estimates: not the bars between rollers that are counted, nor an effective length
    whose documented range is longer than the roller.
    """
    sources = {"roller_diameter_mm": inside.roller_diameter_by, "pitch_diameter_mm": inside.pitch_diameter_by}
    sizes = (f'"bearing.{key}", ' for key, source in sources.items() if source.startswith("estimated"))
    short = LONGEST_EFFECTIVE * inside.effective_length <= inside.roller_length
    return {
        "estimated_sizes": "".join(sizes),
        "estimated_length": '"bearing.effective_length_mm", ' if short else "",
        "estimated_bar": '"cage.bar_width_mm", ' if subject.boundary is None else "",
    }


def error_of(key: str) -> int:
    """Error of an estimated size [%]: the half width of its documented range."""
    (entry,) = (entry for entry in documented() if entry.key == key)
    return round(100.0 * ((entry.high or 1.0) - 1.0))


def _side_ring(subject: Subject, landed: bool) -> Values:
    """Error of a side ring's width, and of a land as wide, and their declarations in [uncertain]."""
    rings = ("cage.land_width_mm", "cage.side_ring_width_mm")
    if subject.width_known:
        named = "".join(f'"{key}", ' for key in rings)
        return {"side_ring_error": error_of(rings[1]), "estimated_ring": named, "land_law": None, "ring_law": None}
    ends = f"low = {1.0 - 0.01 * BLIND_SIDE_RING_ERROR:g}, high = {1.0 + 0.01 * BLIND_SIDE_RING_ERROR:g}"
    land, ring = (f'{{ law = "uniform", {ends}, times = "{key}" }}' for key in rings)
    laws = {"land_law": land if landed else None, "ring_law": ring}
    return {"side_ring_error": BLIND_SIDE_RING_ERROR, "estimated_ring": "", **laws}


def ball_values(subject: Subject, options: Options) -> Values:
    """Values of ``ball_scene.toml``. Raises ValueError as ``roller_values``."""
    from rbdyn.life.balls import rated_capacity

    inside, is_own = subject.inside, subject.grooves is not None
    assert isinstance(inside, catalogue.BallInterior)
    deep, angle = inside.contact_angle is None, math.radians(inside.contact_angle or 0.0)
    sizes = inside.balls, inside.ball_diameter * 1e-3, inside.pitch_diameter * 1e-3, angle
    inner, outer = subject.grooves or USUAL_GROOVES
    capacity = rated_capacity(*sizes, inner, outer)
    common = _common(subject, options, BALL_SPEEDS[subject.kind] / inside.pitch_diameter, capacity)
    preload, assumed = options.preload, options.preload is None and not deep
    if assumed:
        preload = float(f"{max(USUAL_PRELOAD * capacity, HALF_LOADED * common['load'] * math.tan(angle)):.2g}")
    return common | {
        **(_clearance(subject) if deep else {}),
        "ratings": _rated(subject, capacity),
        "inner_groove_factor": inner,
        "outer_groove_factor": outer,
        "inner_groove_by": STATED if is_own else "assumed: as ISO 281 rates; 0.515 to 0.525",
        "outer_groove_by": STATED if is_own else "assumed: as ISO 281 rates; 0.52 to 0.54",
        "preload": preload,
        "preload_by": "assumed: loads half of the balls, 1.216 F_r tan(contact angle), or 0.01 C" if assumed else "",
    }


def _rated(subject: Subject, capacity: float) -> str:
    """Capacity of a bearing of one's own; empty of one by its designation."""
    if subject.boundary is None:
        return ""
    error = "catalogues state up to 15 % more" if subject.kind == catalogue.ROLLERS else "+-15 %"
    return f", C = {1e-3 * capacity:.3g} kN by ISO 281 ({error})"


def _common(subject: Subject, options: Options, reference: float, capacity: float) -> Values:
    """What both kinds of bearing have: the parts of the subject, oil, speed [rpm] and load [N]; what a scene lacks has no line."""
    sizes, error = subject.sizes, 9 if subject.kind == catalogue.ROLLERS else 20
    oil, base, grease = options.oil
    speed = float(f"{USUAL_SPEED * reference:.2g}") if options.speed is None else options.speed
    load = float(f"{USUAL_LOAD * capacity:.2g}") if options.load is None else options.load
    listed = f"{reference:g} rpm, catalogue"
    return defaultdict(
        lambda: None,
        subject=subject,
        inside=subject.inside,
        sizes=sizes,
        boundary=subject.boundary or Boundary(sizes.bore, sizes.outside, sizes.width, "", "", ""),
        own=subject.boundary,
        reason="your own drawing." if subject.boundary else "catalogues do not list the internal geometry.",
        oil=oil,
        oil_by="base oil of the grease" if grease else "",
        base_oil=(base or "mineral") if oil.startswith("ISO VG") else None,
        base_oil_by="" if base else "assumed; or naphthenic, PAO, ester, PAG",
        speed=speed,
        speed_by="assumed: half of the " if options.speed is None else "",
        reference=listed
        if reference == sizes.reference_speed
        else f"about {round(reference, -2):.0f} rpm, +-{error} %",
        load=load,
        load_by="assumed: " if options.load is None else "",
        load_share=load / capacity,
        estimated_mounting="",
        **_oil_supply(options, subject.kind),
    )


def _oil_supply(options: Options, kind: str) -> Values:
    """How oil gets to a bearing, and what a heat balance knows of its surroundings; balls need the supply for their heat only."""
    unknown = {"lubricant.oil_fraction": options.oil_flow, "lubricant.temperature_C": options.heat}
    stated = options.lubrication or options.oil.grease
    ambient = AMBIENT_C if options.ambient is None else options.ambient
    return {
        "temperature": options.oil_temperature,
        "supply": options.supply if kind == catalogue.ROLLERS or options.heat else None,
        "supply_by": f"{'' if stated else 'assumed: '}{SUPPLY_WORDS[options.supply]}",
        "oil_flow": options.oil_flow,
        "oil_inlet": options.oil_inlet,
        "estimated_oil": "".join(f'"{key}", ' for key, stated in unknown.items() if not stated),
        "ambient": ambient if options.heat else None,
        "ambient_by": "; assumed, as of ISO 15312" if options.ambient is None else "",
    }


def _clearance(subject: Subject) -> Values:
    if not isinstance(name := subject.clearance, str):
        return {"clearance": name, "clearance_by": STATED}
    lower, upper = (1e-3 * limit for limit in catalogue.radial_clearance(subject.sizes.bore, name, subject.kind))
    middle = f"middle of {name}, {lower:.3f} to {upper:.3f} (ISO 5753-1)"
    return {"clearance": round(0.5 * (lower + upper), 4), "clearance_by": middle}


def _cage(subject: Subject, inside: catalogue.RollerInterior) -> Values:
    """A cage of its kind about the pitch circle."""
    kind = given(subject.cage)
    soft, landed = kind.material == POLYAMIDE_NAME, kind.guidance != "roller"
    density = POLYAMIDE_DENSITY if soft else 1e-6 * MATERIALS[kind.material].density
    sizes = inside.rollers, inside.roller_diameter, inside.roller_length, inside.pitch_diameter
    cage = catalogue.cage_estimate(subject.series, subject.sizes.width, *sizes)
    guide = max(round(GUIDE_CLEARANCE * inside.pitch_diameter, 2), catalogue.SMALLEST_CLEARANCE_MM)
    return {
        "cage": cage,
        "cage_error": error_of("cage.mass_g"),
        **_side_ring(subject, landed),
        "bar_width_by": BLOCK_BETWEEN
        if cage.bar_width == catalogue.WIDEST_BAR * inside.roller_diameter
        else inside.bar_width_by,
        "guide_clearance": guide if landed else None,
        "cage_mass": shown(cage.volume * density, 3),
        "land_width": round(cage.side_ring_width, 2) if landed else None,
        "cage_material": POLYAMIDE if soft else json.dumps(kind.material),
    }
