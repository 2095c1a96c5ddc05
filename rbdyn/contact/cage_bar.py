"""Stiffness of a cross-bar of a window cage from its section, by beam theory.

A roller pushes a bar along the circumference, evenly over the contact length. The model has three bars and loads the middle one.
Each bar is a Timoshenko beam whose ends are elastic: there the side rings bend, twist and stretch. The side rings are fixed
half-way to the next pockets, one and a half pitches from the load. Farther parts of a ring respond to an impact by their mass,
which the equations of motion include, not by their stiffness. With supports one pitch farther, bars are 10 to 45 % softer, most
where few rollers have long pitches.

Rings: Timoshenko beams along the polygon of the pitch circle, rigid at the joints with bars. Bars: their walls are parallel to
those of the adjacent pockets, so a bar is wider outside than inside. The root of a bar in a ring rotates as on an elastic
half-plane: 18 M/(pi E b^2 t) + 6/5 (1 - nu) V/(E b t). This is the work average of Flamant's and Cerruti's solutions under the
beam's own stresses. O'Donnell 1960 has 16.67 instead of 18 and 1 instead of 6/5.

The stiffness is the load over the mean displacement of the loaded length, consistent with its work; a straight roller meets at
least this. A bar with clamped ends and constant width has 192 E I/L^3 under a load in the middle. Under an even load along its
length it has 720 E I/L^3 (384 for the displacement of the middle). The shear in series is 4 and 12 times 5/6 G A/L.

The wall itself adds no compliance: its indentation is part of the contact law in series, and the free back of a bar prevents
compression through it. Finite elements of the same three pitches, with the mean displacement of the loaded part of the bar,
agree within 20 % (``tests/oracle/test_cage_bar.py``).
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array

# Effective shear area of a rectangle as a share of its area.
SHEAR_SHARE = 5.0 / 6.0
# Rotation of the root by a moment, times E b^2 t, and by a shear force, times E b t/(1 - nu).
ROOT_BY_MOMENT, ROOT_BY_SHEAR = 18.0 / math.pi, 6.0 / 5.0
# Unknown components of the loaded joint: along the circumference, about the radius, about the axis.
FREE_BY_SYMMETRY = (0, 4, 5)


class CageSection(NamedTuple):
    """Section of a window cage [m].

    Bar width is along the circumference at the pitch circle, thickness of bars and rings is radial, bar length and side ring
    width are axial.
    """

    bar_width: float
    thickness: float
    bar_length: float
    side_ring_width: float
    pitch_diameter: float
    bars: int


class Elastic(NamedTuple):
    """Elastic modulus [Pa] and Poisson's ratio of the material."""

    modulus: float
    poisson_ratio: float

    @property
    def shear_modulus(self) -> float:
        """Shear modulus [Pa]."""
        return self.modulus / (2.0 * (1.0 + self.poisson_ratio))


class Beam(NamedTuple):
    """A straight beam: length [m], bending stiffness [N m^2] and effective shear stiffness [N]."""

    length: float
    bending: float
    shear: float


@functools.lru_cache(maxsize=256)
def bar_stiffness(section: CageSection, material: Elastic, contact_length: float) -> float:
    """Load of a roller on a bar over the mean displacement of their contact [N/m], of ``contact_length`` [m]."""
    bar = bar_beam(section, material)
    ring = side_ring_flexibility(section, material)
    # The bar ends at the edge of the ring, half the ring's width from its axis.
    lever = np.array([[1.0, -0.5 * section.side_ring_width], [0.0, 1.0]])
    return 1.0 / bar_compliance(bar, contact_length, lever @ ring @ lever.T + root_flexibility(section, material))


def bar_beam(section: CageSection, material: Elastic) -> Beam:
    """A bar between parallel walls of pockets: b(r) = b + 2 pi (r - r_pitch)/Z, so I = t (b^3 + b (pi t/Z)^2)/12."""
    width, thickness = section.bar_width, section.thickness
    inertia = thickness * width * (width**2 + (math.pi * thickness / section.bars) ** 2) / 12.0
    shear = SHEAR_SHARE * material.shear_modulus * width * thickness
    return Beam(section.bar_length, material.modulus * inertia, shear)


def clamped_stress(section: CageSection, contact_length: float) -> float:
    """Largest bending stress per load [Pa/N] of a bar with clamped ends under an even load over ``contact_length`` [m] in its middle.

    The moment at the ends is F L/8 for a load in the middle, F L/12 for one along the whole bar.
    """
    moment = section.bar_length / 8.0 - contact_length**2 / (24.0 * section.bar_length)
    return 6.0 * moment / (section.thickness * section.bar_width**2)


def bar_compliance(bar: Beam, contact_length: float, end: Array) -> float:
    """Mean displacement of the loaded length in the middle of a bar under an even load [m/N].

    ``end``: flexibility of the support of each end, displacement along the load and slope along the bar [m, rad] by force and
    moment [N, N m]; zeros for clamped ends.
    """
    length, load = bar.length, contact_length
    # The bar on hinges has the moment F (L/2 - z)/2 beyond the load and a parabola under it.
    middle = (2.0 * length - load) / 8.0
    bending = (length - load) ** 3 / 48.0 + middle**2 * load - middle * load**2 / 12.0 + load**3 / 320.0
    slope = (length**2 / 16.0 - load**2 / 48.0) / bar.bending
    shearing = (0.25 * length - load / 6.0) / bar.shear
    # Each end has half of the load, and the moment that gives bar and ring one slope.
    moment = (slope + 0.5 * end[1, 0]) / (0.5 * length / bar.bending + end[1, 1])
    return float(0.5 * end[0, 0] - end[0, 1] * moment + bending / bar.bending + shearing - 2.0 * moment * slope)


def root_flexibility(section: CageSection, material: Elastic) -> Array:
    """Flexibility of the root of a bar in its ring, a half-plane, by a force and a moment (``bar_compliance``)."""
    width, stiff = section.bar_width, material.modulus * section.bar_width * section.thickness
    by_shear = ROOT_BY_SHEAR * (1.0 - material.poisson_ratio) / stiff
    return np.array([[0.0, -by_shear], [-by_shear, ROOT_BY_MOMENT / (stiff * width)]])


def side_ring_flexibility(section: CageSection, material: Elastic) -> Array:
    """Flexibility of a side ring at a bar, on the ring's axis (``bar_compliance``).

    It is by a force along the circumference and a moment about the radius. The ring is symmetric about the bar.
    """
    pitch, radius = 2.0 * math.pi / section.bars, 0.5 * section.pitch_diameter
    angles = (0.0, pitch, 1.5 * pitch)
    joints = [radius * np.array([math.sin(angle), math.cos(angle), 0.0]) for angle in angles]
    stiffness = np.zeros((18, 18))
    rigid = 0.5 * section.bar_width
    for i, after in enumerate((rigid, 0.0)):
        part = slice(6 * i, 6 * i + 12)
        stiffness[part, part] += _ring_part(section, material, joints[i + 1] - joints[i], (rigid, after))
    stiffness[6:12, 6:12] += _next_bar(section, material, pitch)
    free = [*FREE_BY_SYMMETRY, *range(6, 12)]
    # Each side of the bar bears half of the load of the bar's end.
    return np.asarray(0.5 * np.linalg.inv(stiffness[np.ix_(free, free)])[:2, :2], float)


def _next_bar(section: CageSection, material: Elastic, angle: float) -> Array:
    """Stiffness [6, 6] of half a bar at a joint of the ring, with the middle of the bar in the plane of symmetry."""
    width, thickness, half = section.bar_width, section.thickness, 0.5 * section.bar_length
    around = np.array([math.cos(angle), -math.sin(angle), 0.0])
    outward, along = np.array([math.sin(angle), math.cos(angle), 0.0]), np.array([0.0, 0.0, 1.0])
    flat = material.modulus * width * thickness**3 / 12.0
    support = np.zeros((6, 6))
    support[:3, :3] = material.modulus * width * thickness / half * np.outer(along, along)
    support[3:, 3:] = bar_beam(section, material).bending / half * np.outer(outward, outward)
    support[3:, 3:] += flat / half * np.outer(around, around)
    return support


def _ring_part(section: CageSection, material: Elastic, chord: Array, rigid: tuple[float, float]) -> Array:
    """Stiffness [12, 12] of a piece of ring between two joints, rigid over a length [m] at its ends."""
    height, width = section.thickness, section.side_ring_width
    span = float(np.linalg.norm(chord))
    length, shear = span - sum(rigid), SHEAR_SHARE * material.shear_modulus * width * height
    axial = Beam(length, material.modulus * height * width**3 / 12.0, shear)
    radial = Beam(length, material.modulus * width * height**3 / 12.0, shear)
    local = np.zeros((12, 12))
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    local[np.ix_([0, 6], [0, 6])] = material.modulus * width * height / length * pair
    local[np.ix_([3, 9], [3, 9])] = material.shear_modulus * torsion_constant(width, height) / length * pair
    local[np.ix_([1, 5, 7, 11], [1, 5, 7, 11])] = beam_stiffness(radial)
    mirror = np.diag([1.0, -1.0, 1.0, -1.0])
    local[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])] = mirror @ beam_stiffness(axial) @ mirror
    axis, up = chord / span, np.array([0.0, 0.0, 1.0])
    frame = np.array([axis, np.cross(up, axis), up])
    ends = np.zeros((12, 12))
    for end, arm in enumerate((rigid[0] * axis, -rigid[1] * axis)):
        shifts, turns = slice(6 * end, 6 * end + 3), slice(6 * end + 3, 6 * end + 6)
        ends[shifts, shifts] = ends[turns, turns] = frame
        # The rigid end moves by rotation x arm.
        ends[shifts, turns] = frame @ np.array([[0.0, arm[2], -arm[1]], [-arm[2], 0.0, arm[0]], [arm[1], -arm[0], 0.0]])
    return ends.T @ local @ ends


def beam_stiffness(beam: Beam) -> Array:
    """Stiffness [4, 4] of Timoshenko's beam: deflection and slope of one end, then of the other."""
    length, flat = beam.length, 12.0 * beam.bending / (beam.shear * beam.length**2)
    near, far, lean = (4.0 + flat) * length**2, (2.0 - flat) * length**2, 6.0 * length
    rows = [[12.0, lean, -12.0, lean], [lean, near, -lean, far], [-12.0, -lean, 12.0, -lean], [lean, far, -lean, near]]
    return beam.bending / ((1.0 + flat) * length**3) * np.array(rows)


def torsion_constant(first: float, second: float) -> float:
    """St. Venant's constant of a rectangle [m^4], within 0.5 % (Roark)."""
    long, short = max(first, second), min(first, second)
    ratio = short / long
    return long * short**3 * (1.0 / 3.0 - 0.21 * ratio * (1.0 - ratio**4 / 12.0))
