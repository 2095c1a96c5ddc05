"""Stiffness of a cross-bar of a window cage from its section, by beams.

A roller pushes a bar along the circumference, evenly over their contact. The bar is a beam of Timoshenko, which its ends, where
the side rings bend, twist and stretch, hold elastically. Loaded is the middle of three bars; the side rings are held half-way
to the next pockets, one and a half pitches off: farther than that, in the time of an impact, a ring answers by its mass rather
than by its stiffness (and moves as the body that the equations of motion have). Held one pitch farther, bars are 10 to 45 %
softer, most where few rollers make long pitches.

Rings: beams of Timoshenko along the polygon of the pitch circle, rigid where a bar joins them. Bars: their walls are parallel
to those of the neighbours' pockets, so that a bar is wider outside than inside. Where a bar meets a ring it turns as on an
elastic half-plane (Flamant's and Cerruti's solutions under the beam's own stresses, averaged by their work):
18 M/(pi E b^2 t) + 6/5 (1 - nu) V/(E b t); O'Donnell 1960 has 16.67 in place of 18 and 1 in place of 6/5.

The stiffness is the load over the mean displacement of the loaded length: what its work asks for, and a lower bound of what a
straight roller meets. For clamped ends and a bar that does not widen this is 192 E I/L^3 where the load acts in the middle and
720 E I/L^3 where it acts all along (384 is that of the middle alone), with 4 and 12 times 5/6 G A/L of shear in series.

No compliance of the wall is added: the indentation stands in the law of the contact, which is in series, and a bar that is free
behind is not compressed through. Finite elements of the same three pitches, whose displacement is the mean of the loaded part
of the bar, hold it within 20 % (``tests/oracle/test_cage_bar.py``).
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from rbdyn.base.arrays import Array

# Share of a rectangle that bears shear.
SHEAR_SHARE = 5.0 / 6.0
# Rotation of the root by a moment, of E b^2 t, and by a shear force, of E b t/(1 - nu).
ROOT_BY_MOMENT, ROOT_BY_SHEAR = 18.0 / math.pi, 6.0 / 5.0
# Unknowns of the loaded joint, of six: along the circumference, about the radius, about the axis.
FREE_BY_SYMMETRY = (0, 4, 5)


class CageSection(NamedTuple):
    """Section of a window cage [m]: bar along the circumference at the pitch circle, radial thickness of bars and rings,
    axial length of a pocket, axial width of a side ring, pitch diameter; number of bars.
    """

    bar_width: float
    thickness: float
    bar_length: float
    side_ring_width: float
    pitch_diameter: float
    bars: int


class Elastic(NamedTuple):
    """Elastic modulus [Pa] and Poisson's ratio."""

    modulus: float
    poisson_ratio: float

    @property
    def shear_modulus(self) -> float:
        """Shear modulus [Pa]."""
        return self.modulus / (2.0 * (1.0 + self.poisson_ratio))


class Beam(NamedTuple):
    """A straight beam: length [m], bending stiffness [N m^2] and shear stiffness [N], share of the shear counted in."""

    length: float
    bending: float
    shear: float


@functools.lru_cache(maxsize=256)
def bar_stiffness(section: CageSection, material: Elastic, contact_length: float) -> float:
    """Load of a roller on a bar over the mean displacement of their contact [N/m], of ``contact_length`` [m]."""
    bar = bar_beam(section, material)
    ring = side_ring_flexibility(section, material)
    # The bar ends at the ring's edge, half the ring's width off its axis.
    lever = np.array([[1.0, -0.5 * section.side_ring_width], [0.0, 1.0]])
    return 1.0 / bar_compliance(bar, contact_length, lever @ ring @ lever.T + root_flexibility(section, material))


def bar_beam(section: CageSection, material: Elastic) -> Beam:
    """A bar between parallel walls of pockets: b(r) = b + 2 pi (r - r_pitch)/Z, so I = t (b^3 + b (pi t/Z)^2)/12."""
    width, thickness = section.bar_width, section.thickness
    inertia = thickness * width * (width**2 + (math.pi * thickness / section.bars) ** 2) / 12.0
    shear = SHEAR_SHARE * material.shear_modulus * width * thickness
    return Beam(section.bar_length, material.modulus * inertia, shear)


def bar_compliance(bar: Beam, contact_length: float, end: Array) -> float:
    """Mean displacement of the loaded length in the middle of a bar by a load spread over it [m/N].

    ``end``: flexibility of what holds each end, displacement along the load and slope along the bar [m, rad] by force
    and moment [N, N m]; zeros for clamped ends.
    """
    length, load = bar.length, contact_length
    # Of the bar on hinges, by the moment F (L/2 - z)/2 beyond the load and a parabola under it.
    middle = (2.0 * length - load) / 8.0
    bending = (length - load) ** 3 / 48.0 + middle**2 * load - middle * load**2 / 12.0 + load**3 / 320.0
    slope = (length**2 / 16.0 - load**2 / 48.0) / bar.bending
    shearing = (0.25 * length - load / 6.0) / bar.shear
    # Half of the load at each end, and the moment by which bar and ring have one slope there.
    moment = (slope + 0.5 * end[1, 0]) / (0.5 * length / bar.bending + end[1, 1])
    return float(0.5 * end[0, 0] - end[0, 1] * moment + bending / bar.bending + shearing - 2.0 * moment * slope)


def root_flexibility(section: CageSection, material: Elastic) -> Array:
    """What the root of a bar in its ring gives way, of a half-plane: by a force and a moment (``bar_compliance``)."""
    width, stiff = section.bar_width, material.modulus * section.bar_width * section.thickness
    by_shear = ROOT_BY_SHEAR * (1.0 - material.poisson_ratio) / stiff
    return np.array([[0.0, -by_shear], [-by_shear, ROOT_BY_MOMENT / (stiff * width)]])


def side_ring_flexibility(section: CageSection, material: Elastic) -> Array:
    """What a side ring gives way at a bar, on the ring's axis: by a force along the circumference and a moment about the
    radius (``bar_compliance``). The ring on one side of the bar mirrors that on the other.
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
    # Each side of the bar bears half of what the bar's end brings.
    return np.asarray(0.5 * np.linalg.inv(stiffness[np.ix_(free, free)])[:2, :2], float)


def _next_bar(section: CageSection, material: Elastic, angle: float) -> Array:
    """Stiffness [6, 6] by which half a bar holds a joint of the ring, its middle in the plane of symmetry."""
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
    whole = float(np.linalg.norm(chord))
    length, shear = whole - sum(rigid), SHEAR_SHARE * material.shear_modulus * width * height
    axial = Beam(length, material.modulus * height * width**3 / 12.0, shear)
    radial = Beam(length, material.modulus * width * height**3 / 12.0, shear)
    local = np.zeros((12, 12))
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    local[np.ix_([0, 6], [0, 6])] = material.modulus * width * height / length * pair
    local[np.ix_([3, 9], [3, 9])] = material.shear_modulus * torsion_constant(width, height) / length * pair
    local[np.ix_([1, 5, 7, 11], [1, 5, 7, 11])] = beam_stiffness(radial)
    mirror = np.diag([1.0, -1.0, 1.0, -1.0])
    local[np.ix_([2, 4, 8, 10], [2, 4, 8, 10])] = mirror @ beam_stiffness(axial) @ mirror
    axis, up = chord / whole, np.array([0.0, 0.0, 1.0])
    frame = np.array([axis, np.cross(up, axis), up])
    ends = np.zeros((12, 12))
    for end, arm in enumerate((rigid[0] * axis, -rigid[1] * axis)):
        at, turns = slice(6 * end, 6 * end + 3), slice(6 * end + 3, 6 * end + 6)
        ends[at, at] = ends[turns, turns] = frame
        # The rigid end moves by rotation x arm.
        ends[at, turns] = frame @ np.array([[0.0, arm[2], -arm[1]], [-arm[2], 0.0, arm[0]], [arm[1], -arm[0], 0.0]])
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
