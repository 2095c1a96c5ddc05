"""Clearances of a cage in its guide, its pockets and at their lips, between parts that grow by fits, rotation and temperature.

The land of a guiding ring has the displacement of the ring's free edge. The cage grows freely by temperature, and as a thin
hoop by rotation. Clearances and their changes are diametral [m], radii those of the drawing.
"""

from typing import TYPE_CHECKING, NamedTuple

from rbdyn.properties.materials import Material

if TYPE_CHECKING:
    from rbdyn.mounting.rings import MountedRings

# Sign of the effect of the guiding ring's growth on the clearance; the cage has the opposite sign.
SIDES = {"outer": 1.0, "inner": -1.0}


class OperatingClearance(NamedTuple):
    """A clearance on the drawing and its changes by fit, temperature and rotation [m], negative for a reduction."""

    drawn: float
    fit: float = 0.0
    temperature: float = 0.0
    rotation: float = 0.0

    @property
    def operating(self) -> float:
        """The clearance in operation [m]."""
        return self.drawn + self.fit + self.temperature + self.rotation


# Temperature difference between two parts [K] that no drawing and no heat balance excludes: balances leave 5 K and more open, and
# an inner ring that warms first is as much ahead of its housing for minutes. A clearance that it would use up is nearly lost.
NEARLY_K = 5.0


class RunningClearance(NamedTuple):
    """A clearance in operation between two parts, and how little of it may be left, diametral [m].

    ``key``: of its value on the drawing. ``touching``: at or below it the parts seize; minus infinity for one that may be a
    preload. ``growth``: by which it would shrink, a kelvin of difference between its parts [m/K].
    """

    key: str
    play: OperatingClearance
    touching: float
    growth: float

    @property
    def seizes(self) -> bool:
        """Whether the parts seize."""
        return self.play.operating <= self.touching

    @property
    def lost(self) -> bool:
        """Whether the parts seize, or a clearance of the drawing has become a preload."""
        return self.seizes or self.play.operating < 0.0 <= self.play.drawn

    @property
    def kelvins_left(self) -> float:
        """Further difference of temperatures between the parts after which they touch [K]."""
        return (self.play.operating - max(self.touching, 0.0)) / self.growth

    @property
    def floor(self) -> float:
        """Clearance in operation below which it is nearly lost: parts `NEARLY_K` farther apart in temperature would touch [m]."""
        return max(self.touching, 0.0) + NEARLY_K * self.growth


class CageClearances(NamedTuple):
    """Clearances of a cage [m]: diametral in its guide (None where no ring guides it), in its pockets, at their lips.

    ``lip`` is None except under guidance by the rollers. ``shift``: radial growth of the circle of pocket centres relative to
    that of the rollers [m].
    """

    guide: OperatingClearance | None
    pocket: OperatingClearance
    lip: OperatingClearance | None
    shift: float


class CageBody(NamedTuple):
    """A cage as a free hoop.

    ``modulus_share``: effective modulus of a hoop with pockets over that of the material. ``temperature_rise``: above the
    drawing [K]. ``speed`` [rad/s].
    """

    material: Material
    modulus_share: float
    temperature_rise: float
    speed: float

    def thermal_growth(self, size: float) -> float:
        """Growth of a length, radial or along the circumference, by free expansion [m]."""
        return self.material.thermal_expansion * self.temperature_rise * size

    def rotation_growth(self, radius: float) -> float:
        """Radial growth at ``radius`` by rotation [m]: rho w^2 r^3/E of a thin hoop, whose stress is rho w^2 r^2.

        A ring of wall thickness t differs by a share of about t/r.
        """
        modulus = self.modulus_share * self.material.elastic_modulus
        return self.material.density * self.speed**2 * radius**3 / modulus


def guide_clearance(
    clearance: float, land_radius: float, guidance: str, rings: "MountedRings", cage: CageBody
) -> OperatingClearance:
    """Operating clearance between the cage and the land of the "outer" or "inner" ring, from that of the drawing [m].

    Growth of an outer ring widens the clearance, growth of an inner ring narrows it.
    """
    side = SIDES[guidance]
    if guidance == "outer":
        ring, pressures = rings.outer_ring, (0.0, rings.outer_pressure)
    else:
        ring, pressures = rings.inner_ring, (rings.inner_pressure, 0.0)
    radius = land_radius - 0.5 * side * clearance
    return OperatingClearance(
        clearance,
        2.0 * side * ring.pressure_growth(land_radius, *pressures),
        2.0 * side * (ring.thermal_growth(land_radius) - cage.thermal_growth(radius)),
        2.0 * side * (ring.rotation_growth(land_radius) - cage.rotation_growth(radius)),
    )


def pocket_clearance(
    clearance: float, roller_diameter: float, roller_material: Material, roller_rise: float, cage: CageBody
) -> OperatingClearance:
    """Operating clearance of a roller in its pocket or between its lips; roller and cage grow by their temperature rises [K].

    Bending of the bars and stretching of the pockets by rotation are left out.
    """
    roller = roller_material.thermal_expansion * roller_rise * roller_diameter
    return OperatingClearance(clearance, 0.0, cage.thermal_growth(roller_diameter + clearance) - roller)


def pocket_circle_shift(pitch_radius: float, rings: "MountedRings", cage: CageBody) -> float:
    """Radial growth of the circle of pocket centres relative to the circle midway between the races [m]."""
    outer, inner = rings.outer_ring, rings.inner_ring
    races = outer.growth(outer.inner_radius, outside=rings.outer_pressure)
    races += inner.growth(inner.outer_radius, inside=rings.inner_pressure)
    return cage.thermal_growth(pitch_radius) + cage.rotation_growth(pitch_radius) - 0.5 * races
