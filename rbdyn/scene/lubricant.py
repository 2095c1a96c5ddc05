"""The oil and the traction of the races."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal, get_args

from pydantic import BeforeValidator, ConfigDict, Field

from rbdyn.base.faults import (
    RPM,
    SI,
    TO_SI,
    Consistent,
    Fraction,
    NonNegative,
    NotVanishing,
    OptionalSI,
    Positive,
    Share,
    Sparse,
)
from rbdyn.base.notes import Note, Notes
from rbdyn.base.words import all_of
from rbdyn.properties.materials import OILS, Oil, oil_at
from rbdyn.properties.oils import BASE_OILS, GOLD_SPREAD, TURBINE_OILS, BaseOil, Fluid, Walther, grade_oil

RheologyOil = Literal["MIL-L-7808", "MIL-L-23699", "MIL-L-27502", "Santotrac 30", "Santotrac 50", "Mobil DTE SAE30"]
RHEOLOGY_OILS = get_args(RheologyOil)
OilName = Literal[
    "MIL-L-7808", "MIL-L-23699", "MIL-L-85734", "Mobil Jet Oil II", "ISO VG 10", "ISO VG 15", "ISO VG 22", "ISO VG 32",
    "ISO VG 46", "ISO VG 68", "ISO VG 100", "ISO VG 150", "ISO VG 220", "ISO VG 320", "ISO VG 460", "data_sheet",
]  # fmt: skip
Supply = Literal["bath", "drop", "jet", "oil_air", "grease"]
SUPPLIES = get_args(Supply)
GRADE = "ISO VG "
COLDEST_C, HOTTEST_C = -60.0, 350.0
# Kinematic viscosity [mm^2/s] beyond that of any oil, even at its pour point.
THICKEST = 1e7
# Keys of a grade or a data sheet, which a scene without them does not save.
DATA_KEYS = ("base_oil", "viscosity_index", "viscosities_C_mm2_s", "density_kg_m3")
# Keys that only some scenes need, with the default that a scene does not save.
UNSAVED = dict.fromkeys((*DATA_KEYS, "supply", "oil_flow_l_min", "oil_inlet_temperature_C"))
UNSAVED |= {"film_temperature": "oil", "oil_fraction_factor": 1.0}
# Keys of [traction] for one curve at all loads.
CURVE_KEYS = ("mu_0", "mu_m", "mu_inf", "u_m_m_s", "constants")
# Models whose traction follows pressure and temperature.
RHEOLOGIES = ("thermal_newtonian", "eyring", "limiting_shear")


def _no_kelvin(value: Any) -> Any:
    if isinstance(value, int | float) and HOTTEST_C < value < 1e3:
        raise ValueError(f"must be at most {HOTTEST_C:g}; if {value:g} K are meant, write {value - 273.15:.4g}")
    return value


# Temperature of an oil, or of its surroundings [C].
OilCelsius = Annotated[float, Field(ge=COLDEST_C, le=HOTTEST_C), BeforeValidator(_no_kelvin)]


def _four_numbers(value: Any) -> Any:
    """The list of TOML as a tuple."""
    if value is not None and not (isinstance(value, list | tuple) and len(value) == 4):
        raise ValueError("must be a list of four numbers, [A, B, C, D]")
    return tuple(value) if isinstance(value, list) else value


class Lubricant(Consistent, Sparse):
    """The oil, its temperature and its supply."""

    # A heat balance has a first guess of temperature_C where that is left out.
    model_config = ConfigDict(json_schema_extra=lambda schema: schema["required"].remove("temperature_C"))
    UNSAVED: ClassVar[Mapping[str, Any]] = UNSAVED

    oil: OilName
    """Name of the oil, or of the base oil of a grease. Effect: it gives viscosity and pressure coefficient. "data_sheet" needs
    viscosities_C_mm2_s and density_kg_m3."""
    base_oil: Literal["mineral", "naphthenic", "PAO", "ester", "PAG"] | None = None
    """Base oil of a grade or a data sheet. Default: mineral. Effect: it gives estimates of pressure coefficient, density, heat
    capacity, conductivity and limiting traction (rbdyn/properties/oils.py)."""
    viscosity_index: Annotated[float, Field(ge=0.0, le=400.0)] | None = None
    """Viscosity index of a grade. Default by base oil: mineral 95, naphthenic 50, PAO and ester 140, PAG 200."""
    viscosities_C_mm2_s: Annotated[list[list[float]], Field(min_length=2, max_length=2)] | None = None  # noqa: N815
    """Two points [temperature in C, kinematic viscosity in mm^2/s] of a data sheet."""
    density_kg_m3: Annotated[float, Field(ge=500.0, le=3000.0)] | None = None
    """Density of the oil at 15 C."""
    temperature_C: OilCelsius  # noqa: N815
    """Temperature of the oil in the contacts. With [thermal] it is only a first guess, and optional."""
    film_temperature: Literal["oil", "parts"] = "oil"
    """Temperature of the films. oil: all films have temperature_C. parts: each film has the mean temperature of its surfaces
    by [mounting], and only the oil between the parts, which drags the rollers, has temperature_C. With [thermal] the films
    follow the parts."""
    viscosity_mPas: Positive | None = None  # noqa: N815
    """Dynamic viscosity at temperature_C. Default: from the oil."""
    pressure_coefficient_1_GPa: Annotated[float, Field(gt=0.0, le=100.0), NotVanishing] | None = None  # noqa: N815
    """Pressure coefficient alpha of viscosity exp(alpha p). Typical: 5 to 25 for oils. Default: from the oil."""
    supply: Supply | None = None
    """Lubrication method: bath, drop (drop feed), jet, oil_air or grease. Effect: it sets the starvation of SKF's friction
    model and the documented ranges of inlet_distance and oil_fraction. The simulation does not change."""
    oil_flow_l_min: Positive | None = None
    """Oil flow to the bearing. Effect: it gives oil_fraction, and with [thermal] it removes heat. Above D B/12 500 L/min, with
    outside diameter and width in mm, more oil hardly cools further (SKF)."""
    oil_inlet_temperature_C: OilCelsius | None = None  # noqa: N815
    """Oil inlet temperature."""
    oil_fraction: Fraction = 0.02
    """Share of oil in the oil-air mixture around the rollers. Typical: 0.2 to 5 % for jet lubrication. Default with
    oil_flow_l_min: 1e5 W^0.37/(n d_m^1.7) for a flow of W cm3/min, at most 0.15. The formula is unverified and meant for 1 to
    4 million n d_m."""
    oil_fraction_factor: Positive = 1.0
    """Factor on the oil fraction calculated from oil_flow_l_min. Use: a fraction known from a drag test of this supply."""
    roller_roughness_um: Annotated[float, Field(gt=0.0, le=100.0), NotVanishing] = 0.05
    """Root-mean-square roughness of the rollers. Typical: 0.03 to 0.1 for honed rollers of aircraft bearings. Effect: 0.05 on
    rollers and raceways gives Lambda = 2.4 to 2.9 in the bearing of Chen et al. 2022 at 100 C, and 0.1 gives 1.2 to 1.45."""
    race_roughness_um: Annotated[float, Field(gt=0.0, le=100.0), NotVanishing] = 0.05
    """Root-mean-square roughness of the raceways. Typical: 0.03 to 0.1 for honed raceways of aircraft bearings."""
    inlet_distance: Positive | None = None
    """Distance from the oil meniscus to the edge of the contact, in half-widths of the contact. Default: flooded. Bath, drop
    feed, oil-air and grease: 5 is assumed (2 to 10). Effect: it sets the starvation, which reduces film, traction and rolling
    resistance together. Therefore do not apply SKF's starvation factor in model.rolling_resistance_factor as well. ADORE-style
    inputs use 10: same film, 5 to 19 % less rolling resistance. At 135 points of five catalogue bearings, 5 removes trends
    with oil and load relative to SKF's rolling moment; a constant factor cannot. With model.open_contact_film the gap at this
    distance ahead of the mean loaded inner contact is the oil layer."""
    roller_roughness, race_roughness, oil_flow = SI("um"), SI("um"), OptionalSI("l_min")

    def unsaved(self) -> Mapping[str, Any]:
        """Also the oil fraction that follows from a flow, because it would contradict another speed."""
        follows = {} if self.oil_flow_l_min is None else {"oil_fraction": self.oil_fraction}
        return {**self.UNSAVED, **follows}

    def faults(self) -> Iterator[str]:
        """Whether the oil is stated once: by name, by grade with base oil and index, or by a data sheet; and no grease flows."""
        if self.oil_flow_l_min is not None and self.supply == "grease":
            yield (
                f"lubricant.oil_flow_l_min = {self.oil_flow_l_min:g}: contradicts lubricant.supply = 'grease', which does not flow; "
                "leave out one of them"
            )
        sheet = self.oil == "data_sheet"
        alien = {"viscosity_index"} if sheet else {"viscosities_C_mm2_s"} if self.oil.startswith(GRADE) else DATA_KEYS
        data = {key: value for key in DATA_KEYS if (value := getattr(self, key)) is not None}
        for key in (key for key in data if key in alien):
            yield f"lubricant.{key} = {data[key]}: contradicts lubricant.oil = {self.oil!r}, which implies it; leave out one of them"
        for key in ("viscosities_C_mm2_s", "density_kg_m3") if sheet else ():
            if key not in data:
                yield f"lubricant.{key}: missing; lubricant.oil = 'data_sheet' needs it"
        points = self.viscosities_C_mm2_s or []
        if any(len(point) != 2 for point in points):
            yield "lubricant.viscosities_C_mm2_s: each point is [temperature in C, viscosity in mm2/s]; fix it"
        elif points:
            (cold, thick), (hot, thin) = sorted(points)
            if not (COLDEST_C <= cold < hot <= HOTTEST_C and THICKEST >= thick > thin > 0.5):
                yield (
                    f"lubricant.viscosities_C_mm2_s = {points}: viscosity must fall with temperature, within {COLDEST_C:g} to {HOTTEST_C:g} C "
                    f"and 0.5 to {THICKEST:g} mm2/s; fix the points"
                )

    @property
    def base_oil_name(self) -> str:
        """Base oil: that of a grade or a data sheet, ester for turbine oils."""
        graded = self.oil.startswith(GRADE) or self.oil == "data_sheet"
        return self.base_oil or "mineral" if graded else "ester"

    def _base(self) -> BaseOil:
        return BASE_OILS[self.base_oil or "mineral"]

    def _fluid(self) -> Fluid:
        """A grade, a data sheet or a turbine oil at any temperature."""
        if self.oil in TURBINE_OILS:
            return TURBINE_OILS[self.oil]
        if self.viscosities_C_mm2_s is None:
            fluid = grade_oil(float(self.oil.removeprefix(GRADE)), self._base(), self.viscosity_index)
        else:
            first, second = ((point[0], point[1]) for point in self.viscosities_C_mm2_s)
            fluid = Fluid(Walther.through(first, second), self._base(), self._base().density)
        return fluid if self.density_kg_m3 is None else fluid._replace(density=self.density_kg_m3)

    @property
    def estimates(self) -> Notes:
        """A sentence on the estimated properties of the oil; none where its name gives all."""
        if self.oil == "MIL-L-85734":
            return (Note("estimate", "lubricant: MIL-L-85734 is treated as MIL-L-23699, an oil of the same class"),)
        if self.oil in OILS:
            return ()
        oil, parts, graded = self.in_service, [], self.oil.startswith(GRADE)
        base = self.base_oil_name
        if self.viscosity_mPas is None:
            index = BASE_OILS[base].viscosity_index if self.viscosity_index is None else self.viscosity_index
            by_index = f" and its viscosity index of {index:g} (D2270)" if graded else ""
            parts.append(f"{1e3 * oil.viscosity:.3g} mPa s by ASTM D341{by_index}")
        if self.pressure_coefficient_1_GPa is None:
            parts.append(
                f"pressure coefficient {1e9 * oil.pressure_coefficient:.3g} 1/GPa by Gold, within "
                f"{100.0 * GOLD_SPREAD:g} %"
            )
        if graded and self.density_kg_m3 is None:
            parts.append(f"density {oil.density:.3g} kg/m^3 within 3 %")
        parts.append(f"conductivity {oil.conductivity:.2g} W/(m K) and traction by base oil")
        return (
            Note(
                "estimate",
                f"lubricant: {self.oil} ({base}) is estimated at {self.temperature_C:g} C: {', '.join(parts)}",
            ),
        )

    @property
    def in_service(self) -> Oil:
        """The oil at its temperature, with the properties that the scene states."""
        return self.at(self.temperature_C)

    def at(self, temperature: float) -> Oil:
        """The oil at a temperature [C]; a stated viscosity follows it as that of the named oil does."""
        oil = self._named_at(temperature)
        if self.viscosity_mPas is not None:
            viscosity = self.viscosity_mPas * 1e-3
            if temperature != self.temperature_C:
                viscosity *= oil.viscosity / self._named_at(self.temperature_C).viscosity
            slope = oil.viscosity_slope * viscosity / oil.viscosity
            oil = replace(oil, viscosity=viscosity, viscosity_slope=slope)
        if self.pressure_coefficient_1_GPa is not None:
            oil = replace(oil, pressure_coefficient=self.pressure_coefficient_1_GPa * 1e-9)
        return oil

    def _named_at(self, temperature: float) -> Oil:
        """The named oil at a temperature [C], without the properties that the scene states."""
        return oil_at(self.oil, temperature) if self.oil in OILS else self._fluid().at_temperature(temperature)


def with_traction_of_oil(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene, with the default traction of its oil where [traction] states none.

    MIL-L-7808 and MIL-L-23699 keep the defaults of ``Traction``. Oils by grade or data sheet yield at the limit of their base
    oil. Other turbine oils have the thermal film of MIL-L-23699, which is of their class.
    """
    oil, traction = (scene.get(table, {}) for table in ("lubricant", "traction"))
    if not isinstance(oil, Mapping) or not isinstance(traction, Mapping):
        return scene
    name, base = oil.get("oil"), oil.get("base_oil") or "mineral"
    default: dict[str, Any] = {}
    if name in ("MIL-L-85734", *TURBINE_OILS):
        default = {"model": "thermal_newtonian", "rheology_oil": "MIL-L-23699"}
    elif isinstance(name, str) and (name.startswith(GRADE) or name == "data_sheet") and base in BASE_OILS:
        default = {"model": "limiting_shear", "limiting_shear_ratio": BASE_OILS[base].shear_ratio}
    if any(key in traction for key in CURVE_KEYS):
        default.pop("model", None)
    return {**scene, "traction": {**default, **traction}} if default else scene


def with_fraction_of_flow(scene: Mapping[str, Any]) -> Mapping[str, Any]:
    """Tables of a scene, with the oil fraction of its flow where [lubricant] states a flow and no fraction."""
    oil, bearing, operation = (scene.get(table, {}) for table in ("lubricant", "bearing", "operation"))
    if not all(isinstance(table, Mapping) for table in (oil, bearing, operation)) or "oil_fraction" in oil:
        return scene
    numbers = [
        oil.get("oil_flow_l_min"), bearing.get("pitch_diameter_mm"), operation.get("inner_speed_rpm"),
        operation.get("outer_speed_rpm", 0.0), oil.get("oil_fraction_factor", 1.0),
    ]  # fmt: skip
    if not all(isinstance(number, int | float) and number == number for number in numbers):
        return scene
    flow, pitch, inner, outer, factor = map(float, numbers)
    if not (flow > 0.0 and pitch > 0.0 and factor > 0.0):
        return scene
    return {**scene, "lubricant": {**oil, "oil_fraction": fraction_of_flow(flow, pitch, inner - outer, factor)}}


def fraction_of_flow(flow_l_min: float, pitch_mm: float, speed_rpm: float, factor: float) -> float:
    """Oil fraction of a flow; the largest at rest."""
    from rbdyn.thermal.oil_fraction import LARGEST, oil_fraction

    if speed_rpm == 0.0:
        return LARGEST
    return oil_fraction(flow_l_min * TO_SI["l_min"], abs(speed_rpm) * RPM, 1e-3 * pitch_mm, factor)


def fraction_faults(oil: Lubricant, pitch_mm: float, inner_rpm: float, outer_rpm: float) -> Iterator[str]:
    """The fault of a stated oil fraction next to a flow that gives another."""
    flow = oil.oil_flow_l_min
    if flow is None:
        return
    of_flow = fraction_of_flow(flow, pitch_mm, inner_rpm - outer_rpm, oil.oil_fraction_factor)
    if oil.oil_fraction != of_flow:
        yield (
            f"lubricant.oil_fraction = {oil.oil_fraction:g}: contradicts lubricant.oil_flow_l_min = {flow:g}, which gives "
            f"{of_flow:.3g}; leave out one of them"
        )


class Traction(Consistent):
    """Traction of the raceways. The defaults are an ADORE-style set for a turbine-engine oil."""

    model: Literal["four_constant", "thermal_newtonian", "eyring", "limiting_shear", "coulomb", "off"] = "four_constant"
    """Traction law. four_constant: one curve for all loads, as in Chen et al. 2022, which overestimates the traction of
    lightly loaded rollers and so underestimates skidding. thermal_newtonian, eyring, limiting_shear: by pressure and
    temperature. coulomb: dry friction. Default: limiting_shear for oils by grade or data sheet, four_constant for MIL-L-7808
    and MIL-L-23699, thermal_newtonian for other turbine oils."""
    mu_0: NonNegative = 0.0
    """Traction coefficient at zero slip, of an ADORE-style set for a turbine-engine oil."""
    mu_m: NonNegative = 0.050
    """Largest traction coefficient, at the slip u_m_m_s."""
    mu_inf: NonNegative = 0.036
    """Traction coefficient at large slip."""
    u_m_m_s: Positive = 1.0
    """Slip at which traction is largest."""
    constants: Annotated[tuple[float, float, float, float] | None, BeforeValidator(_four_numbers)] = None
    """Constants A, B [s/m], C [s/m], D of (A + B u) exp(-C u) + D. They replace mu_0, mu_m, mu_inf and u_m_m_s."""
    rheology_oil: RheologyOil | None = None
    """Oil of the thermal_newtonian constants of Gupta et al. 1981. Default: lubricant.oil, or MIL-L-23699 for turbine oils without
    constants."""
    eyring_stress_MPa: Positive = 5.0  # noqa: N815
    """Eyring stress: 3 to 10 MPa for mineral oils (Johnson and Tevaarwerk 1977)."""
    limiting_shear_ratio: Share = 0.07
    """Ratio of shear stress to pressure at which limiting_shear yields: 0.05 to 0.10 (Bair and Winer 1979)."""
    largest_shear_ratio: Share = 0.1
    """Largest ratio of shear stress to pressure for thermal_newtonian and eyring, whose stress is unbounded above 1.5 GPa."""
    elasticity: bool = False
    """Tangential elasticity of the raceway contacts. A spring as stiff as the contact in approach acts before traction follows
    the steady law. Effect: contacts with a steep traction curve need no implicit method, and most bearings of "rbdyn new" run
    five to ten times faster. Loss, slip and whirl do not change, and impacts do not within their errors: 144.7 +- 4.3 N
    compared with 144.5 +- 2.6 N for the NU 210 at its defaults (24 and 60 replicates)."""
    friction: Literal["film", "mixed"] = "film"
    """Friction of loaded contacts. film: the oil film carries the whole load. mixed: asperities carry the share exp(-b
    Lambda^c) of the load in dry friction (Zhou and Hoeprich 1991)."""
    boundary_friction: NonNegative = 0.1
    """Friction coefficient of asperities, for friction = "mixed"."""
    asperity_b: Positive = 2.32
    """Constant b of the asperities' share exp(-b Lambda^c). Default: raceways of a tapered roller bearing with a composite
    roughness of 0.16 um (Lubricants 11, 2023, 369, Table 4). The constant depends on the surface finish: Zhou and Hoeprich
    state no general values."""
    asperity_c: Positive = 0.97
    """Constant c of the asperities' share exp(-b Lambda^c), from the same source."""
    coulomb: NonNegative = 0.1
    """Friction coefficient of dry raceways, for model = "coulomb"."""
    blend_speed_m_s: Positive = 0.02
    """Slip over which the friction force changes sign smoothly instead of a jump."""
    eyring_stress = SI("MPa")

    def faults(self) -> Iterator[str]:
        if self.constants is not None:
            yield from self._constant_faults(*self.constants)
        elif self.model == "four_constant" and not self.mu_m > max(self.mu_0, self.mu_inf):
            yield (
                f"traction.mu_m = {self.mu_m:g}: the peak must lie above traction.mu_0 = {self.mu_0:g} and "
                f"traction.mu_inf = {self.mu_inf:g}; raise it"
            )
        if self.friction == "mixed" and self.model in ("coulomb", "off"):
            yield (
                f"traction.friction = 'mixed': traction.model = '{self.model}' has no film; choose a model of a film or set "
                "traction.friction = 'film'"
            )
        if self.elasticity and self.model == "off":
            yield "traction.elasticity = true and traction.model = 'off' contradict each other; leave out the elasticity"

    def _constant_faults(self, a: float, b: float, c: float, d: float) -> Iterator[str]:
        key = f"traction.constants = [{a:g}, {b:g}, {c:g}, {d:g}]"
        fields = type(self).model_fields
        rivals = [key for key in ("mu_0", "mu_m", "mu_inf", "u_m_m_s") if getattr(self, key) != fields[key].default]
        if rivals:
            others = all_of(f"traction.{name} = {getattr(self, name):g}" for name in rivals)
            yield f"{key}: contradicts {others}; give the constants or the peak, not both"
        if c <= 0.0:
            yield f"{key}: the third, C, must be greater than 0; fix it"
        elif smallest_traction(a, b, c, d) < 0.0:
            yield f"{key}: (A + B u) exp(-C u) + D must not be below 0 at any slip u; fix them"


def smallest_traction(a: float, b: float, c: float, d: float) -> float:
    """Smallest value of (a + b u) exp(-c u) + d at u >= 0, with c > 0: at u = 0, at infinity or, for b < 0, in between."""
    values = [a + d, d]
    lowest = 1.0 / c - a / b if b < 0.0 else 0.0
    if lowest > 0.0:
        values.append(b / c * math.exp(-c * lowest) + d)
    return min(values)
