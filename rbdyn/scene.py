"""One validated scene: bearing, cage, lubricant, operation, laws and numerics.

Keys carry their units; whatever a paper leaves out stands here as a default with its reason. Nothing in this module
is compiled: ``rbdyn.dynamics.model`` turns a scene into the SI parameters of the kernels.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from rbdyn.faults import Strict, read_toml, set_key, validated
from rbdyn.materials import MATERIALS, Material

Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]
NonNegative = Annotated[float, Field(ge=0.0)]


class Bearing(Strict):
    """Geometry of a cylindrical roller bearing.

    ``radial_clearance_mm`` is diametral: outer raceway less inner raceway less twice the roller. It is split evenly
    about the pitch diameter; negative is a preload. ``roller_length_mm`` is the whole roller (mass, inertia, drag),
    ``effective_length_mm`` the part that carries load.
    """

    kind: Literal["cylindrical_roller"]
    rollers: Annotated[int, Field(ge=2, le=500)]
    roller_diameter_mm: Annotated[float, Field(ge=0.5, le=500.0)]
    roller_length_mm: Annotated[float, Field(ge=0.5, le=1000.0)]
    effective_length_mm: Annotated[float, Field(ge=0.1, le=1000.0)]
    pitch_diameter_mm: Annotated[float, Field(ge=2.0, le=5000.0)]
    radial_clearance_mm: Annotated[float, Field(ge=-0.2, le=2.0)]
    roller_profile: Literal["cylinder", "logarithmic"] = "cylinder"
    # Inner ring with its share of the shaft: 1 to 5 kg for a main shaft of this size; the outer ring is fixed.
    inner_ring_mass_kg: Annotated[float, Field(gt=0.0, le=1e5)] = 1.0

    @model_validator(mode="after")
    def _fits(self) -> Bearing:
        faults = []
        chord = self.pitch_diameter_mm * math.sin(math.pi / self.rollers)
        if chord <= self.roller_diameter_mm:
            faults.append(
                f"bearing.rollers = {self.rollers}: rollers of {self.roller_diameter_mm:g} mm do not fit on a pitch "
                f"circle of {self.pitch_diameter_mm:g} mm, where each has {chord:.4g} mm; take fewer or smaller ones"
            )
        if self.roller_diameter_mm >= self.pitch_diameter_mm:
            faults.append(
                f"bearing.roller_diameter_mm = {self.roller_diameter_mm:g}: leaves no inner raceway on a pitch circle "
                f"of {self.pitch_diameter_mm:g} mm; make the roller smaller"
            )
        if self.effective_length_mm > self.roller_length_mm:
            faults.append(
                f"bearing.effective_length_mm = {self.effective_length_mm:g}: contact longer than the roller of "
                f"{self.roller_length_mm:g} mm; shorten it or lengthen bearing.roller_length_mm"
            )
        if abs(self.radial_clearance_mm) >= 0.1 * self.roller_diameter_mm:
            faults.append(
                f"bearing.radial_clearance_mm = {self.radial_clearance_mm:g}: out of proportion to a roller of "
                f"{self.roller_diameter_mm:g} mm; give millimetres, below a tenth of the roller"
            )
        return _or_refuse(self, faults)


class Cage(Strict):
    """Cage and guide land. Clearances are diametral; ``pocket_clearance_mm`` is pocket width less roller diameter."""

    guidance: Literal["outer", "inner", "roller"]
    guide_clearance_mm: Annotated[float, Field(gt=0.0, le=10.0)]
    pocket_clearance_mm: Annotated[float, Field(gt=0.0, le=10.0)]
    mass_g: Annotated[float, Field(ge=0.01, le=1e6)]
    # Without a drawing: land at the pitch diameter + 2/3 roller (outer) or - 2/3 roller (inner), cage body from there
    # to the pitch diameter -+ 1/3 roller (49.5 mm and 40.5 mm for the bearing of Chen et al. 2022).
    land_diameter_mm: Positive | None = None
    inertia_kg_mm2: Positive | None = None
    lands: Annotated[int, Field(ge=1, le=4)] = 2
    land_width_mm: Positive = 3.0

    @model_validator(mode="after")
    def _sensible(self) -> Cage:
        if self.pocket_clearance_mm > 5.0 or self.guide_clearance_mm > 5.0:
            raise ValueError("cage: clearances above 5 mm are not clearances; give millimetres")
        return self


class CustomMaterial(Strict):
    """A material by its numbers."""

    elastic_modulus_GPa: Annotated[float, Field(gt=0.0, le=2000.0)]  # noqa: N815
    poisson_ratio: Annotated[float, Field(ge=0.0, lt=0.5)]
    density_kg_m3: Annotated[float, Field(ge=100.0, le=30000.0)]


MaterialName = Literal[
    "bearing_steel", "m50", "silicon_nitride", "aisi_4340", "bronze", "aluminium_bronze", "brass", "titanium_6al4v",
    "peek", "phenolic_cotton",
]  # fmt: skip


class Materials(Strict):
    """What each part is made of: a name, or a table of numbers."""

    roller: MaterialName | CustomMaterial = "bearing_steel"
    rings: MaterialName | CustomMaterial = "bearing_steel"
    cage: MaterialName | CustomMaterial = "bronze"


class Lubricant(Strict):
    """The oil and its temperature; ``viscosity_mPas`` replaces the oil's own viscosity."""

    oil: Literal["MIL-L-7808", "MIL-L-23699"]
    temperature_C: Annotated[float, Field(ge=-60.0, le=350.0)]  # noqa: N815
    viscosity_mPas: Positive | None = None  # noqa: N815
    # Share of oil in the mixture that rollers plough through: 0.2 to 5 % for jet lubrication.
    oil_fraction: Fraction = 0.02


class Traction(Strict):
    """Traction of the races. The defaults are an ADORE-style set for a turbine-engine oil.

    One load-independent set drives lightly loaded rollers too hard and so under-predicts skidding.
    """

    model: Literal["four_constant", "coulomb", "off"] = "four_constant"
    mu_0: NonNegative = 0.0
    mu_m: NonNegative = 0.050
    mu_inf: NonNegative = 0.036
    u_m_m_s: Positive = 1.0
    coulomb: NonNegative = 0.1
    # Slip over which friction changes sign, where it would otherwise jump.
    blend_speed_m_s: Positive = 0.02

    @model_validator(mode="after")
    def _peaks(self) -> Traction:
        if self.model == "four_constant" and not self.mu_m > max(self.mu_0, self.mu_inf):
            raise ValueError(
                f"traction.mu_m = {self.mu_m:g}: the peak must lie above traction.mu_0 = {self.mu_0:g} and "
                f"traction.mu_inf = {self.mu_inf:g}; raise it"
            )
        return self


class Operation(Strict):
    """Running conditions: constant speed of the inner ring, constant load on it along x."""

    inner_speed_rpm: Annotated[float, Field(ge=-1e6, le=1e6)]
    radial_load_N: Annotated[float, Field(ge=0.0, le=1e7)]  # noqa: N815

    @model_validator(mode="after")
    def _turns(self) -> Operation:
        if abs(self.inner_speed_rpm) < 0.1:
            raise ValueError(
                f"operation.inner_speed_rpm = {self.inner_speed_rpm:g}: a run is counted in shaft turns; give at least 0.1"
            )
        return self


class Laws(Strict):
    """The laws of each interaction and what they need. What is off is neither computed nor compiled."""

    # Slices of a roller; one is exact where there is no profile.
    slices: Annotated[int, Field(ge=1, le=1001)] | None = None
    race_damping: Literal["viscous", "hunt_crossley", "off"] = "viscous"
    # Share of critical damping (ADORE-style input 0.05; 0.1 elsewhere), engaged over about half a film thickness.
    race_damping_ratio: Annotated[float, Field(gt=0.0, le=1.0)] = 0.05
    race_damping_engagement_um: Positive = 0.1
    # 0.08 to 0.32 s/m for metals.
    race_damping_alpha_s_m: Positive = 0.2
    pocket: Literal["contact", "off"] = "contact"
    # Bending of the cross-bar, 1e7 to 1e8 N/m for metal cages.
    pocket_bar_stiffness_N_m: Positive | Literal["rigid"] = 5e7  # noqa: N815
    # Restitution 1 - alpha v: 0.5 to 0.7 for steel on wetted bronze at 0.5 m/s; 0 is undamped.
    pocket_damping_alpha_s_m: NonNegative = 0.75
    pocket_friction: NonNegative = 0.05
    guide_land: Literal["film", "dry", "off"] = "film"
    # Film below which the land touches (critical film of ADORE-style inputs), and how full of oil the land is.
    land_film_floor_um: Positive = 3.0
    land_fill: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    land_damping_alpha_s_m: NonNegative = 0.75
    land_friction: NonNegative = 0.05
    rolling_resistance: Literal["biboulet_houpert", "off"] = "biboulet_houpert"
    drag: Literal["cylinder", "off"] = "cylinder"
    # A free cylinder; packed rollers shield each other (0.3 to 0.5).
    drag_coefficient: NonNegative = 1.0


class Numerics(Strict):
    """Tolerance, length and replication of a run."""

    method: Literal["rk45"] = "rk45"
    # Per step, of the approach and speed of a race contact at its mean load share. At 1e-2 no output of the bearing
    # of Chen et al. 2022 is off by more than 0.2 %; looser ones add spurious power.
    rtol: Annotated[float, Field(ge=1e-13, le=0.1)] = 1e-2
    turns: Annotated[float, Field(gt=0.0, le=1e6)] = 100
    discard_turns: Annotated[float, Field(ge=0.0, le=1e6)] = 20
    replicates: Annotated[int, Field(ge=1, le=10000)] = 8
    seed: Annotated[int, Field(ge=0)] = 1
    # The largest force grows with the time one waits for it, so it is taken over windows of a fixed length.
    impact_window_turns: Annotated[float, Field(gt=0.0)] = 20
    samples_per_turn: Annotated[int, Field(ge=8, le=100000)] = 512
    # Repeats every replicate at a tenth of rtol to find the numerical error.
    companion: bool = True
    step_budget_per_turn: Annotated[int, Field(ge=100)] = 100_000


class Scene(Strict):
    """Everything a simulation needs. Equal scenes of equal seed and version give equal bits."""

    bearing: Bearing
    cage: Cage
    lubricant: Lubricant
    operation: Operation
    materials: Materials = Materials()
    traction: Traction = Traction()
    model: Laws = Laws()
    numerics: Numerics = Numerics()

    @classmethod
    def load(cls, path: Path | str, overrides: Iterable[str] = ()) -> Scene:
        """Read a TOML scene, with ``key.path=value`` overrides. Raises InputError with all faults at once."""
        return cls.from_dict(read_toml(path), str(path), overrides)

    @classmethod
    def from_dict(cls, data: dict[str, Any], source: str = "scene", overrides: Iterable[str] = ()) -> Scene:
        """Validate nested tables as TOML gives them; ``source`` stands in the messages. Raises InputError."""
        data = deepcopy(data)
        for override in overrides:
            set_key(data, override)
        return validated(cls, data, source)

    @model_validator(mode="after")
    def _assembles(self) -> Scene:
        bearing, cage, laws = self.bearing, self.cage, self.model
        faults = []
        chord = bearing.pitch_diameter_mm * math.sin(math.pi / bearing.rollers)
        web = chord - bearing.roller_diameter_mm - cage.pocket_clearance_mm
        if web <= 0.0:
            faults.append(
                f"cage.pocket_clearance_mm = {cage.pocket_clearance_mm:g}: leaves no cross-bar between "
                f"{bearing.rollers} pockets ({web:.4g} mm); make it smaller or take fewer rollers"
            )
        if laws.guide_land == "film" and cage.guidance != "roller":
            radial_um = 500.0 * cage.guide_clearance_mm
            if laws.land_film_floor_um >= radial_um:
                faults.append(
                    f"model.land_film_floor_um = {laws.land_film_floor_um:g}: not below the radial guide clearance of "
                    f"{radial_um:g} um; lower it, widen cage.guide_clearance_mm or set model.guide_land = 'dry'"
                )
        land = self.land_diameter_mm
        inner = bearing.pitch_diameter_mm - bearing.roller_diameter_mm
        outer = bearing.pitch_diameter_mm + bearing.roller_diameter_mm
        if cage.guidance != "roller" and not inner < land < outer:
            faults.append(
                f"cage.land_diameter_mm = {land:g}: not between the raceways of {inner:g} and {outer:g} mm; mend it"
            )
        numerics = self.numerics
        if numerics.turns * numerics.samples_per_turn < 2:
            faults.append(f"numerics.turns = {numerics.turns:g}: shorter than two samples; lengthen the run")
        return _or_refuse(self, faults)

    @property
    def land_diameter_mm(self) -> float:
        """Diameter of the guide land, given or estimated [mm]."""
        if self.cage.land_diameter_mm is not None:
            return self.cage.land_diameter_mm
        side = {"outer": 1.0, "inner": -1.0, "roller": 0.0}[self.cage.guidance]
        return self.bearing.pitch_diameter_mm + side * 2.0 / 3.0 * self.bearing.roller_diameter_mm

    @property
    def guide_clearance_m(self) -> float | None:
        """Radial play of the cage in its land [m]; None where no land guides it."""
        landless = self.cage.guidance == "roller" or self.model.guide_land == "off"
        return None if landless else 0.5e-3 * self.cage.guide_clearance_mm

    @property
    def turn_s(self) -> float:
        """Duration of one shaft turn [s]."""
        return 60.0 / abs(self.operation.inner_speed_rpm)

    @property
    def impact_window_turns(self) -> float:
        """Window of the largest force: as given, or the whole run where that is shorter."""
        return min(self.numerics.impact_window_turns, self.numerics.turns)

    def material(self, part: str) -> Material:
        """Material of 'roller', 'rings' or 'cage' in SI."""
        chosen = getattr(self.materials, part)
        if isinstance(chosen, CustomMaterial):
            return Material(chosen.elastic_modulus_GPa * 1e9, chosen.poisson_ratio, chosen.density_kg_m3)
        return MATERIALS[chosen]


def _or_refuse(table: Any, faults: list[str]) -> Any:
    if faults:
        raise ValueError("\n".join(faults))
    return table
