"""The oil and the traction it gives."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from rbdyn.faults import Strict
from rbdyn.fields import SI, Fraction, NonNegative, NotVanishing, Positive, or_refuse
from rbdyn.properties.lubricants import Oil, oil_at

RheologyOil = Literal["MIL-L-7808", "MIL-L-23699", "MIL-L-27502", "Santotrac 30", "Santotrac 50", "Mobil DTE SAE30"]
HOTTEST_C = 350.0
# Models whose traction follows pressure and temperature.
RHEOLOGIES = ("thermal_newtonian", "eyring", "limiting_shear")


def _no_kelvin(value: Any) -> Any:
    if isinstance(value, float) and HOTTEST_C < value < 1e3:
        raise ValueError(f"must be at most {HOTTEST_C:g}; if {value:g} K are meant, write {value - 273.15:.4g}")
    return value


def _four_numbers(value: Any) -> Any:
    """TOML gives a list."""
    if value is not None and not (isinstance(value, list | tuple) and len(value) == 4):
        raise ValueError("must be a list of four numbers, [A, B, C, D]")
    return tuple(value) if isinstance(value, list) else value


class Lubricant(Strict):
    """The oil and its temperature; ``viscosity_mPas`` and ``pressure_coefficient_1_GPa`` replace the oil's own."""

    oil: Literal["MIL-L-7808", "MIL-L-23699"]
    temperature_C: Annotated[float, Field(ge=-60.0, le=HOTTEST_C), BeforeValidator(_no_kelvin)]  # noqa: N815
    viscosity_mPas: Positive | None = None  # noqa: N815
    # alpha of viscosity exp(alpha p): 5 to 25 for oils.
    pressure_coefficient_1_GPa: Annotated[float, Field(gt=0.0, le=100.0), NotVanishing] | None = None  # noqa: N815
    # Share of oil in the mixture that rollers plough through: 0.2 to 5 % for jet lubrication.
    oil_fraction: Fraction = 0.02
    # Root mean square. Honed races and rollers of aircraft bearings have 0.03 to 0.1; 0.05 gives Lambda = 2.4 to 2.9
    # in the bearing of Chen et al. 2022 at 100 C, 0.1 gives 1.2 to 1.45.
    roller_roughness_um: Annotated[float, Field(gt=0.0, le=100.0), NotVanishing] = 0.05
    race_roughness_um: Annotated[float, Field(gt=0.0, le=100.0), NotVanishing] = 0.05
    # Where the oil begins ahead of the edge of a contact, in its half-widths; flooded where left out. ADORE-style inputs
    # have 10, which leaves the film whole and takes 5 to 19 % of the rolling resistance.
    inlet_distance: Positive | None = None
    roller_roughness, race_roughness = SI("um"), SI("um")

    @property
    def in_service(self) -> Oil:
        """The oil at its temperature, with what the scene replaces."""
        oil = oil_at(self.oil, self.temperature_C)
        if self.viscosity_mPas is not None:
            viscosity = self.viscosity_mPas * 1e-3
            slope = oil.viscosity_slope * viscosity / oil.viscosity
            oil = replace(oil, viscosity=viscosity, viscosity_slope=slope)
        if self.pressure_coefficient_1_GPa is not None:
            oil = replace(oil, pressure_coefficient=self.pressure_coefficient_1_GPa * 1e-9)
        return oil


class Traction(Strict):
    """Traction of the races. The defaults are an ADORE-style set for a turbine-engine oil.

    One load-independent set drives lightly loaded rollers too hard and so under-predicts skidding. The models
    ``thermal_newtonian``, ``eyring`` and ``limiting_shear`` follow the pressure and the temperature instead.
    """

    model: Literal["four_constant", "thermal_newtonian", "eyring", "limiting_shear", "coulomb", "off"] = "four_constant"
    mu_0: NonNegative = 0.0
    mu_m: NonNegative = 0.050
    mu_inf: NonNegative = 0.036
    u_m_m_s: Positive = 1.0
    # A, B [s/m], C [s/m], D of (A + B u) exp(-C u) + D, instead of the four numbers above.
    constants: Annotated[tuple[float, float, float, float] | None, BeforeValidator(_four_numbers)] = None
    # Oil of the thermal_newtonian constants of Gupta et al. 1981; lubricant.oil where left out.
    rheology_oil: RheologyOil | None = None
    # 3 to 10 MPa for mineral oils (Johnson and Tevaarwerk 1977).
    eyring_stress_MPa: Positive = 5.0  # noqa: N815
    # Shear stress over pressure at which limiting_shear yields: 0.05 to 0.10 (Bair and Winer 1979).
    limiting_shear_ratio: Annotated[float, Field(gt=0.0, le=1.0), NotVanishing] = 0.07
    # The same as a cap of thermal_newtonian and eyring, whose stress grows without bound past 1.5 GPa.
    largest_shear_ratio: Annotated[float, Field(gt=0.0, le=1.0), NotVanishing] = 0.1
    # mixed: asperities carry the share exp(-b Lambda^c) of a load (Zhou and Hoeprich 1991) and rub dry.
    friction: Literal["film", "mixed"] = "film"
    boundary_friction: NonNegative = 0.1
    # Raceways of a tapered roller bearing, composite roughness 0.16 um (Lubricants 11, 2023, 369, Table 4). They
    # belong to a surface finish: Zhou and Hoeprich give no general values.
    asperity_b: Positive = 2.32
    asperity_c: Positive = 0.97
    coulomb: NonNegative = 0.1
    # Slip over which friction changes sign, where it would otherwise jump.
    blend_speed_m_s: Positive = 0.02
    eyring_stress = SI("MPa")

    @model_validator(mode="after")
    def _consistent(self) -> Traction:
        faults = []
        if self.constants is not None:
            faults += self._constant_faults(*self.constants)
        elif self.model == "four_constant" and not self.mu_m > max(self.mu_0, self.mu_inf):
            faults.append(
                f"traction.mu_m = {self.mu_m:g}: the peak must lie above traction.mu_0 = {self.mu_0:g} and "
                f"traction.mu_inf = {self.mu_inf:g}; raise it"
            )
        if self.friction == "mixed" and self.model in ("coulomb", "off"):
            faults.append(
                f"traction.friction = 'mixed': traction.model = '{self.model}' has no film; choose a model of a film "
                "or set traction.friction = 'film'"
            )
        return or_refuse(self, faults)

    def _constant_faults(self, a: float, b: float, c: float, d: float) -> list[str]:
        shown = f"traction.constants = [{a:g}, {b:g}, {c:g}, {d:g}]"
        faults = []
        fields = type(self).model_fields
        rivals = [key for key in ("mu_0", "mu_m", "mu_inf", "u_m_m_s") if getattr(self, key) != fields[key].default]
        if rivals:
            keys = " and ".join(f"traction.{key} = {getattr(self, key):g}" for key in rivals)
            faults.append(f"{shown}: contradicts {keys}; give the constants or the peak, not both")
        if c <= 0.0:
            faults.append(f"{shown}: the third, C, must be greater than 0; mend it")
        elif smallest_traction(a, b, c, d) < 0.0:
            faults.append(f"{shown}: (A + B u) exp(-C u) + D must not be below 0 at any slip u; mend them")
        return faults


def smallest_traction(a: float, b: float, c: float, d: float) -> float:
    """Smallest value of (a + b u) exp(-c u) + d at u >= 0, with c > 0: at rest, far out or, for b < 0, in between."""
    values = [a + d, d]
    lowest = 1.0 / c - a / b if b < 0.0 else 0.0
    if lowest > 0.0:
        values.append(b / c * math.exp(-c * lowest) + d)
    return min(values)
