"""A scene of a catalogue bearing or of one's own: estimates of what no catalogue lists, mounting, oil and cage."""

import json
import math
from typing import Any, NamedTuple

from rbdyn.life.rollers import REFERENCE_SPEED_FACTOR
from rbdyn.properties.catalogue import (
    ANGULAR,
    CAGES,
    DEEP,
    NO_SERIES,
    ROLLERS,
    SMALLEST_CLEARANCE_MM,
    WIDEST_BAR,
    BallInterior,
    Designation,
    Envelope,
    RollerInterior,
    ball_interior,
    cage_estimate,
    radial_clearance,
    roller_interior,
)
from rbdyn.properties.drawing import (
    STATED,
    BallDrawing,
    Boundary,
    RollerDrawing,
    drawing_ball_interior,
    drawing_roller_interior,
)
from rbdyn.properties.materials import MATERIALS
from rbdyn.properties.oils import NamedOil
from rbdyn.properties.tolerances import Interference, housing_interference, shaft_interference

# Classes for a load that stands still on an inner ring that turns, where only the other seat is stated.
USUAL_SHAFT, USUAL_HOUSING = "k5", "H7"
# Outer diameter of the housing over that of the bearing; rise of inner ring and rollers above the outer ring [K] (NTN, NSK).
HOUSING_SHARE, INNER_RISE = 1.5, 7.5
# By how much of the inner ring's rise above its drawing, at 20 C, the shaft stays below it: 0.10 to 0.15 (NSK).
SHAFT_LAG, DRAWING = 0.125, 20.0
DRIVEN_UP = Interference(0.0, 0.0, 0.0, 0.0, 0.0)
# Values of a bearing that is not mounted, and what only a mounted one has.
LOOSE = ("loose_bore", "loose_outside")
NONE = dict.fromkeys(
    ("shaft_by", "rings_by", "housing_by", "mounted_bore", "mounted_outside", "mounted_width", "housing_diameter", "inner_temperature", "shaft_temperature",
     "outer_temperature", "temperatures_by", "inner_interference", "inner_fit_by", "outer_interference", "outer_fit_by", "inner_law",
     "outer_law")
)  # fmt: skip


class Rings(NamedTuple):
    """Rings as bought: class of ISO 492, what the scene says of it, and whether the bore is tapered, so driven up its seat."""

    ring_class: str = "Normal"
    words: str = "bearing of normal tolerances (ISO 492)"
    tapered: bool = False


def mounting_values(
    sizes: Envelope, rings: Rings, shaft: str | None, housing: str | None, temperature: float | None
) -> dict[str, Any]:
    """Values of the templates for the classes of shaft and housing, the usual one where one is None.

    A tapered bore has no interference: its clearance is stated as driven up. ``temperature``: of the oil [C], None where a heat balance computes it and those of the parts. Raises MethodError as
    ``shaft_interference``.
    """
    inner = DRIVEN_UP if rings.tapered else shaft_interference(sizes.bore, shaft or USUAL_SHAFT, rings.ring_class)
    outer = housing_interference(sizes.outside, housing or USUAL_HOUSING, rings.ring_class)
    seat = "tapered shaft" if rings.tapered else f"shaft {shaft or f'{USUAL_SHAFT} (not stated, usual)'}"
    return {
        **dict.fromkeys(LOOSE),
        **_assumed_temperatures(temperature),
        "shaft_by": seat,
        "rings_by": rings.words,
        "housing_by": f"housing {housing or f'{USUAL_HOUSING} (not stated, usual)'}",
        "mounted_bore": sizes.bore,
        "mounted_width": sizes.width,
        "mounted_outside": sizes.outside,
        "housing_diameter": round(HOUSING_SHARE * sizes.outside, 1),
        "inner_interference": round(inner.mean, 2) + 0.0,
        "inner_fit_by": "in the clearance, which is that of the bearing driven up" if rings.tapered else _reason(inner),
        "inner_law": _law(inner),
        "outer_interference": round(outer.mean, 2) + 0.0,
        "outer_fit_by": _reason(outer),
        "outer_law": _law(outer),
    }


def _assumed_temperatures(oil: float | None) -> dict[str, Any]:
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
POLYAMIDE_NAME, POLYAMIDE_DENSITY = "polyamide", 1.3e-3
# What a bearing of one's own is, next to its sizes, and how the templates name those that its drawing states or leaves open.
OWN, OWN_SIZES = "a drawing of one's own.", ("own_bore", "own_outside", "own_width")
NO_CLEARANCE = {"clearance": None, "clearance_by": ""}
# Radii of the inner and the outer groove over the ball's diameter, as ISO 281 rates.
USUAL_GROOVES = (0.52, 0.53)
BLOCK_BETWEEN = f"{WIDEST_BAR:g} roller diameters, for a block from pocket to pocket is no bar; it is stiffer"
# Upper end of the documented range of an effective length (unknown_inputs.toml).
LONGEST_EFFECTIVE = 1.05
# Of a side ring's width [%]; that of a bearing whose own width is an estimate too.
SIDE_RING_ERROR, BLIND_SIDE_RING_ERROR = 30, 50
# Where no suffix names a cage.
USUAL_CAGE = "MA"
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


# Of a template, by the names in it.
Values = dict[str, Any]


class CageKind(NamedTuple):
    """What guides a cage and what it is made of, and where each comes from: "of suffix MA", "stated", "assumed"."""

    guidance: str
    material: str
    guidance_by: str
    material_by: str

    @property
    def sentence(self) -> str:
        """Both with their sources."""
        guides = f"guided by the {self.guidance}{'s' if self.guidance == 'roller' else ' ring'}"
        if self.guidance_by == self.material_by:
            return f"{self.guidance_by}: {self.material}, {guides}"
        return f"{self.material_by}: {self.material}; {self.guidance_by}: {guides}"


class Heat(NamedTuple):
    """What cools a bearing: flow [L/min] and inlet temperature [C] of its oil, both None without a flow, and the temperature
    around it [C], None where it is left to this module."""

    flow: float | None
    inlet: float | None
    ambient: float | None


class OperatingPoint(NamedTuple):
    """What the user asks for; None where it is left to this module. ``clearance``: a class of ISO 5753-1, or diametral [mm].

    ``temperature`` of the oil [C]: None with ``heat``, which computes it. ``supply_stated``: by an option or by a grease.
    """

    speed: float | None
    load: float | None
    preload: float | None
    oil: NamedOil
    temperature: float | None
    clearance: str | float
    supply: str = "bath"
    supply_stated: bool = True
    heat: Heat | None = None


class Subject(NamedTuple):
    """The bearing that a scene is written of: by its designation, or by a drawing of one's own, whose ``boundary`` has sources.

    ``title`` and ``reason`` make the heading. ``series`` is ``NO_SERIES`` of a drawing. ``cage`` is of rollers, ``grooves`` of balls:
    radii of the inner and the outer one over the ball's diameter, None where ISO 281's are taken. ``clearance``: class of a suffix.
    """

    kind: str
    name: str
    title: str
    reason: str
    sizes: Envelope
    inside: RollerInterior | BallInterior
    boundary: Boundary | None = None
    series: str = NO_SERIES
    designation: str | None = None
    without_effect: str | None = None
    cage: CageKind | None = None
    grooves: tuple[float, float] | None = None
    clearance: str | None = None
    rings: Rings = Rings()

    @property
    def width_known(self) -> bool:
        """Whether the width of the rings is listed or stated."""
        return self.boundary is None or self.boundary.width_by == STATED


def catalogue_subject(
    named: Designation, sizes: Envelope, guidance: str | None = None, material: str | None = None, mounted: bool = False
) -> Subject:
    """A bearing by its designation; guidance and cage material as stated, else of its suffix. Raises MethodError for
    impossible dimensions.
    """
    stated, listed = named.value_of("tolerance"), named.ring_class
    alike = "" if stated in (None, listed) else f", diameters as of {listed}"
    words = Rings().words if listed == "Normal" else f"bearing of class {stated}{alike} (ISO 492)"
    rollers = named.kind == ROLLERS
    return Subject(
        kind=named.kind,
        name=named.name,
        title=f"{named.name}, {sizes.bore:g} x {sizes.outside:g} x {sizes.width:g} mm",
        reason="catalogues do not list what is inside.",
        sizes=sizes,
        inside=roller_interior(sizes, named.series == "10") if rollers else ball_interior(sizes, named),
        series=named.series,
        # Sizes that are typed are those of no listed bearing.
        designation=named.name if rollers and sizes.reference_speed is not None else None,
        without_effect=named.without_effect(mounted) or None,
        cage=cage_kind(named.value_of("cage"), guidance, material) if rollers else None,
        clearance=named.value_of("clearance"),
        rings=Rings(listed, words, named.value_of("bore") is not None),
    )


def roller_subject(drawing: RollerDrawing, boundary: Boundary, guidance: str | None, material: str | None) -> Subject:
    """A roller bearing of one's own."""
    rollers = f"{drawing.rollers} rollers of {drawing.diameter:g} x {drawing.length:g} mm"
    return Subject(
        kind=ROLLERS,
        name="own",
        title=f"{rollers} on a pitch diameter of {drawing.pitch_diameter:g} mm",
        reason=OWN,
        sizes=boundary.envelope,
        inside=drawing_roller_interior(drawing),
        boundary=boundary,
        cage=cage_kind(None, guidance, material),
    )


def ball_subject(drawing: BallDrawing, boundary: Boundary, grooves: tuple[float, float] | None) -> Subject:
    """A ball bearing of one's own; it is of deep grooves where it has a clearance in place of a contact angle."""
    balls = f"{drawing.balls} balls of {drawing.diameter:g} mm"
    return Subject(
        kind=DEEP if drawing.contact_angle is None else ANGULAR,
        name="own",
        title=f"{balls} on a pitch diameter of {drawing.pitch_diameter:g} mm",
        reason=OWN,
        sizes=boundary.envelope,
        inside=drawing_ball_interior(drawing),
        boundary=boundary,
        grooves=grooves,
    )


def cage_kind(suffix: str | None, guidance: str | None, material: str | None) -> CageKind:
    """A cage as stated, else as its suffix says, else the usual one."""
    usual_guidance, usual_material = CAGES[suffix or USUAL_CAGE]
    source = f"of suffix {suffix}" if suffix else "assumed"
    return CageKind(
        guidance or usual_guidance,
        material or usual_material,
        STATED if guidance else source,
        STATED if material else source,
    )


def roller_values(subject: Subject, point: OperatingPoint) -> Values:
    """Values of ``roller_scene.toml``. Raises ValueError for an unlisted clearance."""
    from rbdyn.life.rollers import dynamic_capacity

    inside, sizes = subject.inside, subject.sizes
    assert isinstance(inside, RollerInterior)
    diameter, pitch, listed = inside.roller_diameter, inside.pitch_diameter, sizes.dynamic_capacity
    by_iso = dynamic_capacity(inside.rollers, diameter * 1e-3, inside.effective_length * 1e-3, pitch * 1e-3)
    volume = math.pi / 4.0 * (pitch - diameter) ** 2 * sizes.outside
    ratings = "" if listed is None else f", C = {1e-3 * listed:g} kN, C0 = {1e-3 * (sizes.static_capacity or 0.0):g} kN"
    common = _common(subject, point, sizes.reference_speed or REFERENCE_SPEED_FACTOR / pitch, listed or by_iso)
    flooded, scarce = point.supply in FLOODED_SUPPLIES, point.supply in SCARCE_SUPPLIES
    return {
        **inside._asdict(),
        **common,
        **_clearance(sizes.bore, point.clearance, subject.kind),
        **_cage(subject, inside),
        "heading": _heading(subject, ratings or _rated(subject, by_iso)),
        "ring_mass": 1e-9 * MATERIALS["bearing_steel"].density * volume,
        "listed_capacity": listed,
        **_estimated(subject, inside),
        "capacity_share": by_iso / (listed or by_iso),
        "designation": None if subject.designation is None else json.dumps(subject.designation),
        "inlet_distance": None if flooded else INLET_DISTANCE,
        "oil_fraction": None if common["oil_flow"] else SCARCE_FRACTION if scarce else OIL_FRACTION,
        "oil_fraction_by": "0.001 to 0.02 where little oil enters" if scarce else "0.005 to 0.1",
    }


def _estimated(subject: Subject, inside: RollerInterior) -> Values:
    """Keys named in [uncertain] where they are estimates: not the bars between rollers that are counted, nor an effective length
    whose documented range is longer than the roller.
    """
    sources = {"roller_diameter_mm": inside.roller_diameter_by, "pitch_diameter_mm": inside.pitch_diameter_by}
    short = LONGEST_EFFECTIVE * inside.effective_length <= inside.roller_length
    return {
        "estimated_sizes": "".join(
            f'"bearing.{key}", ' for key, source in sources.items() if source.startswith("estimated")
        ),
        "estimated_length": '"bearing.effective_length_mm", ' if short else "",
        "estimated_bar": '"cage.bar_width_mm", ' if subject.boundary is None else "",
    }


def ball_values(subject: Subject, point: OperatingPoint) -> Values:
    """Values of ``ball_scene.toml``. Raises ValueError as ``roller_values``."""
    from rbdyn.life.balls import dynamic_capacity

    inside = subject.inside
    assert isinstance(inside, BallInterior)
    deep, angle = inside.contact_angle is None, math.radians(inside.contact_angle or 0.0)
    sizes = inside.balls, inside.ball_diameter * 1e-3, inside.pitch_diameter * 1e-3, angle
    capacity = dynamic_capacity(*sizes, *(subject.grooves or ()))
    common = _common(subject, point, BALL_SPEEDS[subject.kind] / inside.pitch_diameter, capacity)
    preload, why = point.preload, ""
    if preload is None and not deep:
        preload = float(f"{max(USUAL_PRELOAD * capacity, HALF_LOADED * common['load'] * math.tan(angle)):.2g}")
        why = "assumed: loads half of the balls, 1.216 F_r tan(contact angle), or 0.01 C"
    clearance = _clearance(subject.sizes.bore, point.clearance, subject.kind) if deep else NO_CLEARANCE
    heading = {"heading": _heading(subject, _rated(subject, capacity))}
    return {
        **inside._asdict(),
        **common,
        **clearance,
        **_grooves(subject),
        **heading,
        "preload": preload,
        "preload_by": why,
    }


def _heading(subject: Subject, ratings: str) -> str:
    return f"{subject.title}{ratings}: {subject.reason}"


def _rated(subject: Subject, capacity: float) -> str:
    """Capacity of a bearing of one's own; empty of one by its designation."""
    if subject.boundary is None:
        return ""
    error = "catalogues state up to 15 % more" if subject.kind == ROLLERS else "+-15 %"
    return f", C = {1e-3 * capacity:.3g} kN by ISO 281 ({error})"


def _grooves(subject: Subject) -> Values:
    inner, outer = subject.grooves or USUAL_GROOVES
    own_grooves = subject.grooves is not None
    return {
        "inner_groove_factor": inner,
        "outer_groove_factor": outer,
        "inner_groove_by": STATED if own_grooves else "assumed: as ISO 281 rates; 0.515 to 0.525",
        "outer_groove_by": STATED if own_grooves else "assumed: as ISO 281 rates; 0.52 to 0.54",
    }


def _common(subject: Subject, point: OperatingPoint, reference: float, capacity: float) -> Values:
    """What both kinds of bearing have: boundary dimensions, oil, speed [rpm] and load [N]; no mounting."""
    sizes, error = subject.sizes, 9 if subject.kind == ROLLERS else 20
    oil, base, grease = point.oil
    speed, load = point.speed, point.load
    speed = float(f"{USUAL_SPEED * reference:.2g}") if speed is None else speed
    load = float(f"{USUAL_LOAD * capacity:.2g}") if load is None else load
    return {
        "without_effect": subject.without_effect,
        "kind": subject.kind,
        "bore": sizes.bore,
        "outside": sizes.outside,
        **_sources(subject.boundary),
        "oil": oil,
        "oil_by": "base oil of the grease" if grease else "",
        "base_oil": (base or "mineral") if oil.startswith("ISO VG") else None,
        "base_oil_by": "" if base else "assumed; or naphthenic, PAO, ester, PAG",
        "temperature": point.temperature,
        "speed": speed,
        "speed_by": "assumed: half of the " if point.speed is None else "",
        "reference": f"{reference:g} rpm, catalogue"
        if reference == sizes.reference_speed
        else f"about {round(reference, -2):.0f} rpm, +-{error} %",
        "load": load,
        "load_by": "assumed: " if point.load is None else "",
        "load_share": load / capacity,
        **NONE,
        **dict(zip(LOOSE, (sizes.bore, sizes.outside), strict=True)),
        "estimated_mounting": "",
        **_oil_supply(point, subject.kind),
    }


def _oil_supply(point: OperatingPoint, kind: str) -> Values:
    """How oil gets to a bearing, and what a heat balance knows of its surroundings; balls need the supply for their heat only."""
    heat = point.heat or Heat(None, None, None)
    unknown = [] if heat.flow else ["lubricant.oil_fraction"]
    unknown += [] if point.heat else ["lubricant.temperature_C"]
    ambient = AMBIENT_C if heat.ambient is None else heat.ambient
    return {
        "supply": json.dumps(point.supply) if kind == ROLLERS or point.heat else None,
        "supply_by": f"{'' if point.supply_stated else 'assumed: '}{SUPPLY_WORDS[point.supply]}",
        "oil_flow": heat.flow,
        "oil_inlet": heat.inlet,
        "estimated_oil": "".join(f'"{key}", ' for key in unknown),
        "ambient": ambient if point.heat else None,
        "ambient_by": "; assumed, as of ISO 15312" if heat.ambient is None else "",
    }


def _sources(boundary: Boundary | None) -> Values:
    """Where the boundary dimensions of a drawing come from; a catalogue lists them."""
    if boundary is None:
        return {**dict.fromkeys(("bore_by", "outside_by", "width_by"), ""), **dict.fromkeys(OWN_SIZES)}
    own = dict(zip(OWN_SIZES, (boundary.bore, boundary.outside, boundary.width), strict=True))
    return {"bore_by": boundary.bore_by, "outside_by": boundary.outside_by, "width_by": boundary.width_by, **own}


def _clearance(bore: float, clearance: str | float, kind: str) -> Values:
    if not isinstance(clearance, str):
        return {"clearance": clearance, "clearance_by": STATED}
    lower, upper = (1e-3 * limit for limit in radial_clearance(bore, clearance, kind))
    middle = f"middle of {clearance}, {lower:.3f} to {upper:.3f} (ISO 5753-1)"
    return {"clearance": round(0.5 * (lower + upper), 4), "clearance_by": middle}


def _cage(subject: Subject, inside: RollerInterior) -> Values:
    """A cage of its kind about the pitch circle."""
    kind = subject.cage
    assert kind is not None
    soft, landed = kind.material == POLYAMIDE_NAME, kind.guidance != "roller"
    density = POLYAMIDE_DENSITY if soft else 1e-6 * MATERIALS[kind.material].density
    sizes = inside.rollers, inside.roller_diameter, inside.roller_length, inside.pitch_diameter
    cage = cage_estimate(subject.series, subject.sizes.width, *sizes)
    guide = max(round(GUIDE_CLEARANCE * inside.pitch_diameter, 2), SMALLEST_CLEARANCE_MM)
    return {
        **cage._asdict(),
        "side_ring_error": SIDE_RING_ERROR if subject.width_known else BLIND_SIDE_RING_ERROR,
        "cage_by": kind.sentence,
        "bar_width_by": BLOCK_BETWEEN if cage.bar_width == WIDEST_BAR * inside.roller_diameter else inside.bar_width_by,
        "guidance": kind.guidance,
        "guide_clearance": guide if landed else None,
        "cage_mass": cage.volume * density,
        "land_width": round(cage.side_ring_width, 2) if landed else None,
        "cage_material": POLYAMIDE if soft else json.dumps(kind.material),
    }
