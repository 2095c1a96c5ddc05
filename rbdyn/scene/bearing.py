"""Drawing of a roller bearing: bearing, cage with the section and stiffness of its bars, materials."""

import math
import re
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import AfterValidator, BeforeValidator, Field, ValidationError, ValidationInfo, field_validator
from pydantic_core import PydanticKnownError

from rbdyn.base.faults import (
    LIGHTEST_RING_KG,
    SI,
    Consistent,
    Fraction,
    NotVanishing,
    OptionalSI,
    Positive,
    Share,
    Sparse,
    Strict,
)
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import counted
from rbdyn.properties.catalogue import ROLLERS, envelope, read_designation
from rbdyn.properties.materials import MATERIALS, SOFTEST_METAL, Material

if TYPE_CHECKING:
    from rbdyn.contact.cage_bar import CageSection


# Keys that belong to one roller profile each.
PROFILE_KEYS = {"crowned": "crown_radius_mm", "lundberg": "lundberg_load_N", "table": "profile_table_mm_um"}


# Conductivity [W/(m K)] and heat capacity [J/(kg K)] of a material that states none: PA66 and PEEK have 0.25, PA66 1500 to 1700.
STEEL_CONDUCTION = MATERIALS["bearing_steel"].conductivity, MATERIALS["bearing_steel"].heat_capacity
POLYMER_CONDUCTION = 0.25, 1500.0


# Keys of [cage], without their unit, that make a section together.
SECTION_KEYS = ("bar_width", "bar_thickness", "bar_length", "side_ring_width")


def _catalogue_designation(text: str | None) -> str | None:
    """A designation of a cylindrical roller bearing that the catalogue lists. Raises ValueError."""
    if text is not None:
        designation = read_designation(text)
        if designation.kind != ROLLERS:
            raise ValueError("is a ball bearing; name the cylindrical roller bearing or leave it out")
        envelope(designation, "correct it or leave it out")
    return text


class Harmonic(Strict):
    """One harmonic of a raceway's radius: amplitude cos(order (angle - phase)), angle and phase counted on the ring."""

    order: Annotated[int, Field(ge=1, le=2000)]
    """Waves around the circumference."""
    amplitude_um: Annotated[float, Field(ge=-500.0, le=500.0)]
    """Amplitude of the radius."""
    phase_deg: float = 0.0
    """Angle of a crest on the ring."""
    amplitude, phase = SI("um"), SI("deg")


class Bearing(Consistent):
    """Geometry of a cylindrical roller bearing. Clearances are diametral."""

    kind: Literal["cylindrical_roller"]
    """Kind of bearing."""
    designation: Annotated[str | None, AfterValidator(_catalogue_designation)] = None
    """Designation in a manufacturer's catalogue, such as NU 210 or NU 210 ECP. Effect: it gives bore, outside diameter, width
    and series, and the result compares the power loss with SKF's friction model. The simulation does not change."""
    rollers: Annotated[int, Field(ge=2, le=500)]
    """Number of rollers."""
    roller_diameter_mm: Annotated[float, Field(ge=0.5, le=500.0)]
    """Diameter of a roller."""
    roller_length_mm: Annotated[float, Field(ge=0.5, le=1000.0)]
    """Overall length of a roller, which decides its mass, inertia and drag."""
    effective_length_mm: Annotated[float, Field(ge=0.1, le=1000.0)]
    """Part of the roller's length that carries load, without the rounded ends."""
    pitch_diameter_mm: Annotated[float, Field(ge=2.0, le=5000.0)]
    """Diameter of the circle through the rollers' centres, on which the clearance is split evenly."""
    radial_clearance_mm: Annotated[float, Field(ge=-0.2, le=2.0)]
    """Diametral clearance: outer raceway less inner raceway less twice the roller diameter; negative is a preload. With
    [mounting] it is the clearance before mounting."""
    roller_profile: Literal["cylinder", "crowned", "logarithmic", "lundberg", "table"] = "cylinder"
    """Shape of the roller: its drop towards the ends. "logarithmic" is the reference profile of ISO/TS 16281; "crowned",
    "lundberg" and "table" each need the key of their name."""
    crown_radius_mm: Positive | None = None
    """Radius of the crown, for roller_profile = "crowned"."""
    lundberg_load_N: Positive | None = None  # noqa: N815
    """Load at which the Lundberg profile spreads its pressure evenly, for roller_profile = "lundberg"."""
    profile_table_mm_um: Annotated[list[list[float]], Field(min_length=2)] | None = None
    """Points (distance from the middle in mm, drop in um) joined by straight lines, for roller_profile = "table". Points of
    one half are mirrored."""
    tilt_mrad: Annotated[float, Field(ge=-20.0, le=20.0)] = 0.0
    """Tilt of the inner ring against the outer ring, about an axis perpendicular to tilt_direction_deg."""
    tilt_direction_deg: float = 0.0
    """Direction in which the inner ring tilts, measured from the load."""
    inner_tilt_share: Fraction = 0.5
    """Share of the tilt between roller and inner raceway. A roller between equal contacts tilts by half (Harris)."""
    roller_diameter_errors_um: list[float] | None = None
    """Deviation of each roller's diameter from the nominal one, instead of roller_diameter_spread_um."""
    roller_diameter_spread_um: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    """Standard deviation of the rollers' diameters, drawn from a normal distribution with the seed of the scene."""
    outer_waviness: list[Harmonic] = []
    """Harmonics of the outer raceway's radius: out-of-round (orders 2, 3: lobes against skidding) and waviness."""
    inner_waviness: list[Harmonic] = []
    """Harmonics of the inner raceway's radius, which rotate with the ring."""
    dynamic_capacity_N: Positive | None = None  # noqa: N815
    """Basic dynamic load rating from the catalogue. Default: calculated from the dimensions by ISO 281."""
    inner_ring_mass_kg: Annotated[float, Field(ge=LIGHTEST_RING_KG, le=1e5)] = 1.0
    """Mass of the inner ring and the part of the shaft that moves with it. Drawings give the ring alone (0.04 kg for the
    bearing of Chen et al. 2022); add the share of the rotor that this bearing carries. Typical: 1 to 5 kg for a main shaft of
    this size. Effect: 0.3, 1 and 3 kg give impact forces of 91, 87 and 92 N and whirl ratios of 0.51, 0.41 and 0.54 in that
    bearing."""

    roller_diameter, pitch_diameter, radial_clearance = SI("mm"), SI("mm"), SI("mm")
    roller_length, effective_length, crown_radius = SI("mm"), SI("mm"), OptionalSI("mm")
    tilt, tilt_direction = SI("mrad"), SI("deg")

    @property
    def diameter_ratio(self) -> float:
        """Roller over pitch diameter."""
        return self.roller_diameter_mm / self.pitch_diameter_mm

    @property
    def rated_sizes(self) -> tuple[int, float, float, float]:
        """Inputs of the ratings by ISO 281 and ISO 76: rollers, their diameter and effective length, pitch diameter [m]."""
        return self.rollers, self.roller_diameter, self.effective_length, self.pitch_diameter

    @property
    def rated_capacity(self) -> float:
        """Basic dynamic capacity [N]: the catalogue's, or by ISO 281 from the dimensions."""
        from rbdyn.life.rollers import dynamic_capacity

        return self.dynamic_capacity_N or dynamic_capacity(*self.rated_sizes)

    @property
    def profile_table(self) -> list[tuple[float, float]] | None:
        """Points of the profile: distance from the middle, drop [m]."""
        points = self.profile_table_mm_um
        return None if points is None else [(x * 1e-3, drop * 1e-6) for x, drop in points]

    @property
    def raceway_diameters_mm(self) -> tuple[float, float]:
        """Diameters of the inner and outer raceway [mm]: the pitch diameter less and plus one roller.

        Their share of the clearance is left out, which would change the growth of a ring by about 1e-3 of itself.
        """
        return (self.pitch_diameter_mm - self.roller_diameter_mm, self.pitch_diameter_mm + self.roller_diameter_mm)

    def faults(self) -> Iterator[str]:
        chord = self.pitch_diameter_mm * math.sin(math.pi / self.rollers)
        if chord <= self.roller_diameter_mm:
            yield (
                f"bearing.rollers = {self.rollers}: rollers of {self.roller_diameter_mm:g} mm do not fit on a pitch circle of "
                f"{self.pitch_diameter_mm:g} mm, where each has {chord:.4g} mm; take fewer or smaller ones"
            )
        if self.roller_diameter_mm >= self.pitch_diameter_mm:
            yield (
                f"bearing.roller_diameter_mm = {self.roller_diameter_mm:g}: leaves no inner raceway on a pitch circle of "
                f"{self.pitch_diameter_mm:g} mm; make the roller smaller"
            )
        if self.effective_length_mm > self.roller_length_mm:
            yield (
                f"bearing.effective_length_mm = {self.effective_length_mm:g}: contact longer than the roller of "
                f"{self.roller_length_mm:g} mm; shorten it or lengthen bearing.roller_length_mm"
            )
        if abs(self.radial_clearance_mm) >= 0.1 * self.roller_diameter_mm:
            yield (
                f"bearing.radial_clearance_mm = {self.radial_clearance_mm:g}: out of proportion to a roller of "
                f"{self.roller_diameter_mm:g} mm; give millimetres, below a tenth of the roller"
            )
        yield from self._profile_faults()
        yield from self._form_faults()

    def _profile_faults(self) -> Iterator[str]:
        for profile, key in PROFILE_KEYS.items():
            value = getattr(self, key)
            if value is None and self.roller_profile == profile:
                yield f"bearing.{key}: missing; bearing.roller_profile = {profile!r} needs it"
            if value is not None and self.roller_profile != profile:
                yield (
                    f"bearing.{key} and bearing.roller_profile = {self.roller_profile!r} contradict each other: "
                    f"leave out the first or set the second to {profile!r}"
                )
        half = 0.5 * self.roller_length_mm
        if self.crown_radius_mm is not None and self.crown_radius_mm <= half:
            yield (
                f"bearing.crown_radius_mm = {self.crown_radius_mm:g}: the crown of a roller of {self.roller_length_mm:g} mm needs "
                f"a radius above {half:g} mm, commonly metres; enlarge it"
            )
        points = self.profile_table_mm_um or []
        if any(len(point) != 2 for point in points):
            yield "bearing.profile_table_mm_um: each point is [position in mm, drop in um]; fix the list"
            return
        if any(b[0] <= a[0] for a, b in pairwise(points)):
            yield "bearing.profile_table_mm_um: positions must rise from point to point; sort them"
        for x, drop in points:
            if abs(x) > half:
                yield (
                    f"bearing.profile_table_mm_um: point ({x:g} mm, {drop:g} um) lies beyond the roller's end at {half:g} mm; "
                    "shorten the profile or lengthen bearing.roller_length_mm"
                )
            if drop < 0.0:
                yield f"bearing.profile_table_mm_um: point ({x:g} mm, {drop:g} um) has a drop below 0; measure from the highest point"
        first, last = (points[0][0], points[-1][0]) if points else (0.0, math.inf)
        reach = last if first >= 0.0 else min(-first, last)
        if reach < 0.5 * self.effective_length_mm:
            yield (
                f"bearing.profile_table_mm_um: ends at {reach:g} mm, within the contact of "
                f"{0.5 * self.effective_length_mm:g} mm from the middle; extend the table"
            )

    def _form_faults(self) -> Iterator[str]:
        errors = self.roller_diameter_errors_um
        if errors is not None and len(errors) != self.rollers:
            yield (
                f"bearing.roller_diameter_errors_um: {counted(len(errors), 'value')} for {self.rollers} rollers; "
                "give one value for each roller"
            )
        if errors is not None and self.roller_diameter_spread_um > 0.0:
            yield (
                "bearing.roller_diameter_errors_um and bearing.roller_diameter_spread_um contradict each other: "
                "give the errors or their spread, not both"
            )
        limit = 0.01 * self.roller_diameter_mm * 1e3
        if errors is not None and any(abs(error) > limit for error in errors):
            yield f"bearing.roller_diameter_errors_um: beyond {limit:g} um, a hundredth of the roller; give micrometres"


class Cage(Consistent):
    """Cage and guide land. Clearances are diametral, and with [mounting] those of the drawing."""

    guidance: Literal["outer", "inner", "roller"]
    """Part that guides the cage: a land of the outer ring, a land of the inner ring, or the rollers."""
    guide_clearance_mm: Annotated[
        Annotated[float, Field(gt=0.0, le=10.0), NotVanishing] | None, Field(validate_default=True)
    ] = None
    """Diametral clearance between cage and guide land. Required if a ring guides the cage."""
    pocket_clearance_mm: Annotated[float, Field(gt=0.0, le=10.0), NotVanishing]
    """Pocket width less roller diameter."""
    mass_g: Annotated[float, Field(ge=0.01, le=1e6)]
    """Mass of the cage."""
    pocket_contact_length_mm: Positive | None = None
    """Length of contact between a roller and a pocket wall: the straight part of the wall without edge breaks. Default: the
    effective length of the roller for contact and lips, its full length for the film."""
    land_diameter_mm: Positive | None = None
    """Diameter of the guide land. Default: the pitch diameter plus (outer) or minus (inner) 2/3 roller diameter, 49.5 and
    40.5 mm for the bearing of Chen et al. 2022."""
    inertia_kg_mm2: Positive | None = None
    """Moment of inertia of the cage about its axis. Default: calculated as a ring from the land to the pitch diameter -+ 1/3
    roller diameter."""
    imbalance_um: Annotated[float, Field(ge=0.0, le=5000.0)] = 0.0
    """Eccentricity of the cage's centre of mass, towards the first pocket. Typical: 0 to 100 um."""
    pocket_radial_clearance_mm: Positive | None = None
    """Distance between pocket lips less roller diameter, where rollers guide the cage. Default: the pocket clearance. Without lips
    such a cage would have no radial guidance, because free rollers give way along their orbit."""
    lands: Annotated[int, Field(ge=1, le=4)] = 2
    """Number of guide lands side by side."""
    land_width_mm: Positive = 3.0
    """Width of one guide land."""
    bar_width_mm: Positive | None = None
    """Width of a cage bar along the circumference, at the pitch circle. The width does not change with
    cage.pocket_clearance_mm. Effect: bar width, bar thickness, bar length and side ring width together give the stiffness of a
    bar (rbdyn/contact/cage_bar.py), unless model.pocket_bar_stiffness_N_m is set."""
    bar_thickness_mm: Positive | None = None
    """Radial thickness of the cage bars and of the side rings."""
    bar_length_mm: Positive | None = None
    """Axial length of a cage bar and of a pocket."""
    side_ring_width_mm: Positive | None = None
    """Axial width of one side ring."""

    @field_validator("guide_clearance_mm")
    @classmethod
    def _needed_by_a_land(cls, value: float | None, info: ValidationInfo) -> float | None:
        if value is None and info.data.get("guidance") != "roller":
            raise PydanticKnownError("missing")
        return value

    hoop_modulus_share: Share = 0.65
    """Effective hoop modulus of the cage as a share of the material's modulus. Typical: 0.5 to 0.8; 1 is a hoop without
    pockets. Effect, only with [mounting]: how far rotation widens the cage. Between the bars only the side rings carry the
    hoop stress, with the mass of the bars as load. Side rings of a quarter to a third of the cage's width give 0.75 to 0.85,
    less their bending from bar to bar."""

    guide_clearance, pocket_clearance, lip_clearance = OptionalSI("mm"), SI("mm"), OptionalSI("mm")
    pocket_contact_length, land_width = OptionalSI("mm"), SI("mm")
    bar_width, bar_thickness, bar_length, side_ring_width = (OptionalSI("mm") for _ in SECTION_KEYS)
    mass, inertia, imbalance = SI("g"), OptionalSI("kg_mm2"), SI("um")

    def faults(self) -> Iterator[str]:
        wide = {
            key: value for key in ("pocket", "guide") if (value := getattr(self, f"{key}_clearance_mm") or 0.0) > 5.0
        }
        if wide:
            yield from (
                f"cage.{key}_clearance_mm = {value:g}: above 5 mm is implausible; give millimetres"
                for key, value in wide.items()
            )
        elif self.pocket_radial_clearance_mm is not None and self.guidance != "roller":
            yield (
                f"cage.pocket_radial_clearance_mm and cage.guidance = {self.guidance!r} contradict each other: lips guide the cage "
                "only under guidance by the rollers; leave out the first or set the second to 'roller'"
            )
        missing = [f"cage.{key}_mm" for key in SECTION_KEYS if getattr(self, f"{key}_mm") is None]
        if 0 < len(missing) < len(SECTION_KEYS):
            yield f"{', '.join(missing)}: missing; the stiffness of a bar needs its whole section, so give all four or none"

    @property
    def lip_clearance_mm(self) -> float | None:
        """Radial play between roller and pocket lips [mm]; None where a ring guides the cage."""
        if self.guidance != "roller":
            return None
        lips = self.pocket_radial_clearance_mm
        return self.pocket_clearance_mm if lips is None else lips


class CustomMaterial(Sparse):
    """A material by its properties."""

    UNSAVED: ClassVar[Mapping[str, Any]] = {"conductivity_W_mK": None, "heat_capacity_J_kgK": None}

    elastic_modulus_GPa: Annotated[float, Field(gt=0.0, le=2000.0), NotVanishing]  # noqa: N815
    """Young's modulus of the material."""
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)]
    """Poisson's ratio of the material."""
    density_kg_m3: Annotated[float, Field(ge=100.0, le=30000.0)]
    """Density of the material."""
    thermal_expansion_1e_6_K: Annotated[float, Field(ge=0.0, le=200.0)] = 12.0  # noqa: N815
    """Coefficient of linear thermal expansion in 1e-6 per K. Default: steel."""
    conductivity_W_mK: Annotated[float, Field(ge=0.01, le=2000.0)] | None = None  # noqa: N815
    """Thermal conductivity, uncertain by 15 %. Default: 46, bearing steel; for an elastic modulus below 20 GPa 0.25, a polymer."""
    heat_capacity_J_kgK: Annotated[float, Field(ge=50.0, le=10000.0)] | None = None  # noqa: N815
    """Specific heat capacity, uncertain by 15 %. Default: 470, bearing steel; for an elastic modulus below 20 GPa 1500, a polymer."""


def _in_any_case(value: Any) -> Any:
    """A name as it is listed: "PEEK" and "Silicon nitride" as well."""
    name = re.sub(r"[\s-]+", "_", value.strip().lower()) if isinstance(value, str) else value
    return name if isinstance(name, str) and name in MATERIALS else value


MaterialName = Annotated[
    Literal["bearing_steel", "m50", "silicon_nitride", "aisi_4340", "bronze", "aluminium_bronze", "brass", "titanium_6al4v",
            "peek", "phenolic_cotton"],
    BeforeValidator(_in_any_case),
]  # fmt: skip


class Materials(Strict):
    """Material of each part: a name, or a table of properties."""

    roller: MaterialName | CustomMaterial = "bearing_steel"
    """Material of the rollers."""
    rings: MaterialName | CustomMaterial = "bearing_steel"
    """Material of both rings."""
    cage: MaterialName | CustomMaterial = "bronze"
    """Material of the cage."""


def material_of(material: MaterialName | CustomMaterial) -> Material:
    """A material in SI, from its name or its properties."""
    if isinstance(material, CustomMaterial):
        modulus, expansion = material.elastic_modulus_GPa * 1e9, material.thermal_expansion_1e_6_K * 1e-6
        conductivity, capacity = POLYMER_CONDUCTION if modulus < SOFTEST_METAL else STEEL_CONDUCTION
        conductivity = conductivity if material.conductivity_W_mK is None else material.conductivity_W_mK
        capacity = capacity if material.heat_capacity_J_kgK is None else material.heat_capacity_J_kgK
        return Material(modulus, material.poisson_ratio, material.density_kg_m3, expansion, conductivity, capacity)
    return MATERIALS[material]


STIFFNESS = "pocket_bar_stiffness_N_m"
# Factors on the stiffness by a section at the ends of its error (reason in unknown_inputs.toml).
STIFFNESS_ERROR = (0.55, 1.25)
# Least width of a pocket in roller diameters. An estimated bar width may be that of one roller more or less.
NARROWEST_POCKET = 0.75


def with_bar_stiffness_of_section(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene, with the stiffness of a cross-bar by its section where [cage] states it and [model] no stiffness.

    Faults of the tables are left to their own validation.
    """
    laws, cage = scene.get("model", {}), scene.get("cage")
    if not isinstance(laws, Mapping) or STIFFNESS in laws or not isinstance(cage, Mapping):
        return scene
    if not all(f"{key}_mm" in cage for key in SECTION_KEYS):
        return scene
    try:
        drawing = Bearing.model_validate(scene.get("bearing"))
        cage_drawing = Cage.model_validate(cage)
        materials = Materials.model_validate(scene.get("materials", {}))
    except ValidationError:
        return scene
    section = section_of(drawing, cage_drawing)
    if section is None or any(section_misfits(drawing, cage_drawing)):
        return scene
    from rbdyn.contact.cage_bar import Elastic, bar_stiffness

    material = material_of(materials.cage)
    elastic = Elastic(material.elastic_modulus, material.poisson_ratio)
    contact = cage_drawing.pocket_contact_length or drawing.effective_length
    return {**scene, "model": {STIFFNESS: bar_stiffness(section, elastic, min(contact, section.bar_length)), **laws}}


def section_of(bearing: Bearing, cage: Cage) -> "CageSection | None":
    """Section of the cage in SI; None where the scene states none."""
    from rbdyn.contact.cage_bar import CageSection

    width, thickness = cage.bar_width, cage.bar_thickness
    length, ring = cage.bar_length, cage.side_ring_width
    if width is None or thickness is None or length is None or ring is None:
        return None
    return CageSection(width, thickness, length, ring, bearing.pitch_diameter, bearing.rollers)


def section_misfits(bearing: Bearing, cage: Cage) -> Iterator[str]:
    """A sentence for each size of a section that does not fit the bearing."""
    if any(getattr(cage, f"{key}_mm") is None for key in SECTION_KEYS):
        return
    width, thickness, length, _ = (float(getattr(cage, f"{key}_mm")) for key in SECTION_KEYS)
    roller = bearing.roller_diameter_mm
    pocket = math.pi * bearing.pitch_diameter_mm / bearing.rollers - width
    if pocket < NARROWEST_POCKET * roller:
        yield (
            f"cage.bar_width_mm = {width:g}: {bearing.rollers} such bars leave pockets of {max(pocket, 0.0):.4g} mm, too narrow "
            f"for rollers of {roller:g} mm; make it narrower"
        )
    if thickness >= roller:
        yield (
            f"cage.bar_thickness_mm = {thickness:g}: must be less than the roller diameter of {roller:g} mm for a cage between "
            "the raceways; make it thinner"
        )
    if length < bearing.roller_length_mm:
        yield (
            f"cage.bar_length_mm = {length:g}: the pocket is shorter than its roller of {bearing.roller_length_mm:g} mm; lengthen it"
        )


def section_notes(bearing: Bearing, cage: Cage, stiffness: float | str) -> Notes:
    """A sentence on the stiffness [N/m] by the section, with its error; none where the scene states no section."""
    if section_of(bearing, cage) is None or isinstance(stiffness, str):
        return ()
    low, high = (100.0 * (factor - 1.0) for factor in STIFFNESS_ERROR)
    sentence = f"cage: the section gives bars of {stiffness:.3g} N/m (model.{STIFFNESS}), {low:+.0f} to {high:+.0f} %"
    return (Note("estimate", sentence),)
