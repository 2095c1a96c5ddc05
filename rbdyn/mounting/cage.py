"""What fits, heat and rotation do to the clearances of a cage: in its guide, in its pockets, at the lips of these.

A ring guides the cage by a land that grows with the ring, the free edge of whose displacement it carries on; the cage grows as
a free body by heat and as a thin hoop by rotation. Clearances and their changes are diametral [m], radii of the drawing.
"""

from typing import TYPE_CHECKING, NamedTuple

from rbdyn.properties.materials import Material

if TYPE_CHECKING:
    from rbdyn.mounting.rings import MountedRings

# Which way the growth of the guiding ring moves the clearance, and the cage the other way.
SIDES = {"outer": 1.0, "inner": -1.0}


class OperatingClearance(NamedTuple):
    """Where a clearance goes [m]: as drawn, and what fit, temperature and rotation add to it, negative where they take."""

    drawn: float
    fit: float = 0.0
    temperature: float = 0.0
    rotation: float = 0.0

    @property
    def operating(self) -> float:
        """The clearance as it runs [m]."""
        return self.drawn + self.fit + self.temperature + self.rotation


class CageClearances(NamedTuple):
    """Clearances of a cage [m]: diametral in its guide (None where no ring guides it), of its pockets, at their lips.

    ``lip`` is None but under guidance by the rollers, ``shift`` the way by which the circle of the pockets' centres grows
    beyond that of the rollers, radial [m].
    """

    guide: OperatingClearance | None
    pocket: OperatingClearance
    lip: OperatingClearance | None
    shift: float


class CageBody(NamedTuple):
    """A cage as a free hoop.

    ``modulus_share``: of the material's modulus that a hoop with pockets keeps; ``temperature_rise`` above the drawing [K];
    ``speed`` [rad/s].
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

        A ring of the wall t departs from it by some t/r of itself.
        """
        modulus = self.modulus_share * self.material.elastic_modulus
        return self.material.density * self.speed**2 * radius**3 / modulus


def guide_clearance(
    drawn: float, land_radius: float, guidance: str, rings: "MountedRings", cage: CageBody
) -> OperatingClearance:
    """Clearance between the land of the "outer" or the "inner" ring and the cage.

    The outer ring grows away from its cage, the inner one into it.
    """
    side = SIDES[guidance]
    if guidance == "outer":
        ring, pressures = rings.outer_ring, (0.0, rings.outer_pressure)
    else:
        ring, pressures = rings.inner_ring, (rings.inner_pressure, 0.0)
    radius = land_radius - 0.5 * side * drawn
    return OperatingClearance(
        drawn,
        2.0 * side * ring.pressure_growth(land_radius, *pressures),
        2.0 * side * (ring.thermal_growth(land_radius) - cage.thermal_growth(radius)),
        2.0 * side * (ring.rotation_growth(land_radius) - cage.rotation_growth(radius)),
    )


def pocket_clearance(
    drawn: float, roller_diameter: float, roller_material: Material, roller_rise: float, cage: CageBody
) -> OperatingClearance:
    """Width of a pocket, or room between its lips, less the roller: both grow by heat at their rises [K].

    That rotation bows the bars and stretches the pockets is left out.
    """
    roller = roller_material.thermal_expansion * roller_rise * roller_diameter
    return OperatingClearance(drawn, 0.0, cage.thermal_growth(roller_diameter + drawn) - roller)


def pocket_circle_shift(pitch_radius: float, rings: "MountedRings", cage: CageBody) -> float:
    """Growth of the circle of pocket centres less that of the circle midway between the races, radial [m]."""
    outer, inner = rings.outer_ring, rings.inner_ring
    races = outer.growth(outer.inner_radius, outside=rings.outer_pressure)
    races += inner.growth(inner.outer_radius, inside=rings.inner_pressure)
    return cage.thermal_growth(pitch_radius) + cage.rotation_growth(pitch_radius) - 0.5 * races
