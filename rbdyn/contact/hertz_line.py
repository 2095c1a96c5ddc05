"""Line contact: load against approach, by Palmgren (Chen et al. 2022, eq 6) or by another law.

A whole roller has one of the plain laws. A roller with a profile, or between tilted rings, has slices. Each slice carries its
share of a plain law at its own approach. Plain laws differ by at most 7 % between 50 and 800 N.

Limits of static pressure: ISO 76 allows a permanent dent of 1e-4 of the rolling element's diameter. Above the shakedown limit of
free rolling, 4 k for lines and 4.7 k for points (Johnson, Contact Mechanics, 9.2), each passage yields anew and no elastic theory
holds: k = Y/sqrt(3) with Y = H/3 (Tabor), and H = 6.9 GPa of a race of 58 HRC, the softest that ratings allow.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array, Whole
from rbdyn.base.notes import Note, Notes
from rbdyn.compiled.elementary import eighteenth_root, fast_exp, fast_log, fma, rough_power
from rbdyn.compiled.kernel import VECTOR, kernel, law, law_of

BALLS, ROLLERS = 4200e6, 4000e6  # [Pa]
SHEAR_YIELD = 6900e6 / 3.0 / math.sqrt(3.0)  # k [Pa]
SHAKEDOWN = {BALLS: 4.7 * SHEAR_YIELD, ROLLERS: 4.0 * SHEAR_YIELD}


def dent_sentence(pressure: float, limit: float, race: str) -> str:
    """Sentence on a ``pressure`` above the ``limit`` [Pa] on the "inner" or "outer" race, with the fix."""
    kind = "rollers" if limit == ROLLERS else "balls"
    return (
        f"{race} raceway: dented by {1e-6 * pressure:.0f} MPa, more than the {1e-6 * limit:.0f} MPa of ISO 76; reduce the load or take "
        f"more or larger {kind}"
    )


def overload_sentence(pressure: float, limit: float) -> str:
    """Words on a ``pressure`` [Pa] above the shakedown limit of the kind of contact with this ``limit`` by ISO 76."""
    return (
        f"{1e-6 * pressure:.0f} MPa, above the {1e-6 * SHAKEDOWN[limit]:.0f} MPa up to which a hardened raceway stays elastic under "
        "rolling (shakedown), so no result applies to a real bearing; reduce the load"
    )


def pressure_notes(pressure: float, limit: float, race: str) -> Notes:
    """A note on a largest ``pressure`` [Pa] that dents a race or is above its shakedown limit; ``limit``: ``BALLS`` or ``ROLLERS``."""
    if pressure > SHAKEDOWN[limit]:
        return (Note("overload", f"{race} raceway: overloaded: {overload_sentence(pressure, limit)}"),)
    return (Note("dent", dent_sentence(pressure, limit, race)),) if pressure > limit else ()


EXPONENT = 10.0 / 9.0
# Least overlap: a smaller one is round-off. It keeps logarithms and roots finite.
SMALLEST_APPROACH = 1e-18


class LineContact(NamedTuple):
    """Q = K delta^(10/9)."""

    stiffness: float  # K [N/m^(10/9)]


class PowerLineContact(NamedTuple):
    """Q = K delta^n (Houpert 2001)."""

    stiffness: float  # K [N/m^n]
    exponent: float  # n


class LogarithmicLineContact(NamedTuple):
    """delta = c Q ln(b/Q) (Lundberg 1939; Dowson and Higginson), solved for the load."""

    compliance: float  # c [m/N]
    load_scale: float  # b [N]


class SlicedLineContact(NamedTuple):
    """Equal slices, each relieved by the roller's profile: Q = sum_k Q_whole(delta - P_k)/m.

    Slices of one drop count as one. They stand in the order in which they begin to carry load.
    """

    line: Any
    relief: Array  # profile drop at the slice centres [m], padded to whole vectors
    share: Array  # of the m slices; 0 in the padding
    place: Whole  # of each slice along the roller, (m,)


class TiltedLineContact(NamedTuple):
    """Slices between races of different tilt: delta_k = delta + x_k theta cos(psi - psi_0) - P_k, in the order of P_k - |x_k theta|."""

    line: Any
    relief: Array  # [m]
    share: Array
    place: Whole
    rise: Array  # x_k theta [m]
    direction_x: float  # cos and sin of psi_0, where the tilt is largest
    direction_y: float


class Slice(NamedTuple):
    """One slice: profile drop [m], share of the length, additional overlap where the tilt is largest [m]."""

    drop: float
    share: float
    rise: float


class SummedLoad(NamedTuple):
    """A sliced contact whose slices have been summed: what ``line_load`` gives."""

    load: float  # [N]
    stiffness: float  # [N/m]
    approach: float  # [m]
    lean: float  # [m/rad]


class LineContactOnBar(NamedTuple):
    """A line contact in series with the elastic cross-bar of a cage pocket."""

    stiffness: float  # K [N/m^(10/9)]
    bar_stiffness: float  # [N/m]


def palmgren(equivalent_modulus: float, length: float) -> LineContact:
    """Palmgren's K = (E'/8) (1/0.39)^(10/9) l^(8/9).

    With E' of steel on steel this is delta = 3.84e-5 Q^0.9 / l^0.8 (mm, N), the sum of Chen et al. 2022, eq 6, over the slices.
    The -1/9 power has the whole length, so any number of slices gives the same sum.
    """
    return LineContact(equivalent_modulus / 8.0 * (1.0 / 0.39) ** EXPONENT * length ** (8.0 / 9.0))


def iso_16281(equivalent_modulus: float, length: float) -> LineContact:
    """ISO/TS 16281: c_L = 35948 l^(8/9) N/mm^(10/9) for both races of a steel roller in series, hence
    c_L 2^(10/9) for one; scaled by E' for other materials.
    """
    steel = 2.0 * 206e9 / (2.0 * (1.0 - 0.3**2))
    per_race = 35948.0 * 2.0**EXPONENT * (length * 1e3) ** (8.0 / 9.0) * 1e3**EXPONENT
    return LineContact(per_race * equivalent_modulus / steel)


def houpert(equivalent_modulus: float, length: float, radius: float) -> PowerLineContact:
    """Houpert 2001: Q = 0.2723 l E' R^-0.074 delta^1.074 with the reduced radius R."""
    return PowerLineContact(0.2723 * length * equivalent_modulus * radius**-0.074, 1.074)


def dowson_higginson(equivalent_modulus: float, length: float, gamma: float) -> LogarithmicLineContact:
    """delta = 2Q/(pi E* l) ln[pi E* l^2/(Q (1 + gamma))], E* = E/(1 - nu^2); gamma = +-D cos(alpha)/d_m.

    Positive gamma for the outer race, negative for the inner (Harris, Rolling Bearing Analysis).
    """
    return LogarithmicLineContact(
        2.0 / (math.pi * equivalent_modulus * length), math.pi * equivalent_modulus * length**2 / (1.0 + gamma)
    )


def slice_contact(
    line: Any, relief: Array, position: Array, tilt: float, direction: float
) -> SlicedLineContact | TiltedLineContact:
    """Cut a plain law into slices with profile drops and axial positions [m], tilted by ``tilt`` [rad].

    Empty slices fill them up to whole vectors.
    """
    rises = position * tilt + 0.0
    rows = np.column_stack((relief - abs(rises), relief, rises))
    # Between parallel rings both halves of a roller are one.
    unequal, place, count = np.unique(rows, axis=0, return_inverse=True, return_counts=True)
    padding = 0, -len(unequal) % VECTOR
    drop, rise = (np.pad(column, padding, "edge") for column in unequal.T[1:])
    share, place = np.pad(count / len(relief), padding), place.ravel()
    if tilt == 0.0:
        return SlicedLineContact(line, drop, share, place)
    return TiltedLineContact(line, drop, share, place, rise, math.cos(direction), math.sin(direction))


@law_of(LineContact)
def whole_load(contact, approach):
    """Load [N] and tangent stiffness [N/m] of a plain line contact at a positive approach [m]."""
    root = eighteenth_root(approach)
    per_approach = contact.stiffness * (root * root)
    return per_approach * approach, 10.0 / 9.0 * per_approach


@whole_load.body(PowerLineContact)
def _(contact, approach):
    load = contact.stiffness * fast_exp(contact.exponent * fast_log(approach))
    return load, contact.exponent * load / approach


@whole_load.body(LogarithmicLineContact)
def _(contact, approach):
    # With y = ln(b/Q) the law reads y - ln(y) = a, a = ln(c b/approach). From the first terms of the series of y,
    # Newton doubles the digits: three steps leave nothing. Below a = 2 the approach would be a third of the roller.
    a = max(fast_log(contact.compliance * contact.load_scale / approach), 2.0)
    log_a = fast_log(a)
    y = a + log_a + log_a / a
    for _ in range(3):
        y *= (a + fast_log(y) - 1.0) / (y - 1.0)
    load = contact.load_scale * fast_exp(-y)
    return load, 1.0 / (contact.compliance * (y - 1.0))


@whole_load.body(LineContactOnBar)
def _(contact, approach):
    # With y^9 as the indentation, K y^10/k_bar + y^9 = approach needs no powers. A step with the relative residual rho
    # multiplies y by the series of (1 + rho)^-a, a = dln(y)/dln(approach), with the change of a. The start is exact for a
    # stiff bar and 1 % off for a soft one; the first step leaves 4e-6, the second 1e-15.
    ratio, inverse = contact.stiffness / contact.bar_stiffness, 1.0 / approach
    alone = rough_power(approach, 1.0 / 9.0)
    y = alone * rough_power(1.0 + 10.0 / 9.0 * ratio * alone, -1.0 / 10.0)
    for _ in range(2):
        y2 = y * y
        y4 = y2 * y2
        y9 = y4 * y4 * y
        share = 1.0 + ratio * y
        a = share / (9.0 + 10.0 * ratio * y)
        rho = fma(y9 * share, inverse, -1.0)
        second = 0.5 * (1.0 + a - (1.0 - 9.0 * a) * (10.0 * a - 1.0))
        third = (2.0 + a) / 3.0
        y -= y * (a * rho) * fma(-second * rho, fma(-third, rho, 1.0), 1.0)
    y2 = y * y
    y4 = y2 * y2
    indentation_stiffness = 10.0 / 9.0 * contact.stiffness * y
    in_series = indentation_stiffness * contact.bar_stiffness / (indentation_stiffness + contact.bar_stiffness)
    return contact.stiffness * (y4 * y4 * y2), in_series


@law_of(PowerLineContact, LogarithmicLineContact, LineContactOnBar, SlicedLineContact, TiltedLineContact, SummedLoad)
def root_stiffness(contact, stiffness, approach):
    """Square root of the tangent stiffness [sqrt(N/m)] that a contact has at an approach [m]."""
    return math.sqrt(stiffness)


@root_stiffness.body(LineContact)
def _(contact, stiffness, approach):
    # The root that its load has taken already.
    return math.sqrt(10.0 / 9.0 * contact.stiffness) * eighteenth_root(approach)


@law
def line_load(contact, overlap, nx, ny):
    """Elastic load [N], tangent stiffness [N/m], approach [m] > 0 of a roller on a race, and how that changes with its
    azimuth [m/rad].

    ``overlap`` [m] of the roller's middle, negative where there is a gap; ``nx, ny``: outward unit vector from
    ring to roller. Without a branch, so that neighbouring contacts share vector instructions; NaN counts as closed.
    """


@kernel
def closed_load(contact, overlap):
    """Load, stiffness and approach of a plain law."""
    approach = SMALLEST_APPROACH if overlap < SMALLEST_APPROACH else overlap
    load, stiffness = whole_load(contact, approach)
    return (0.0 if overlap <= 0.0 else load), stiffness, approach


@line_load.body(LineContact, PowerLineContact, LogarithmicLineContact)
def _(contact, overlap, nx, ny):
    load, stiffness, approach = closed_load(contact, overlap)
    return load, stiffness, approach, 0.0


@law_of(SlicedLineContact)
def slice_of(contact, k):
    """``Slice`` number ``k``."""
    return Slice(contact.relief[k], contact.share[k], 0.0)


@slice_of.body(TiltedLineContact)
def _(contact, k):
    return Slice(contact.relief[k], contact.share[k], contact.rise[k])


@law_of(SlicedLineContact)
def slice_drop(contact, lamina, nx, ny):
    """Overlap of a ``Slice`` less than that of the roller's middle [m]."""
    return lamina.drop


@slice_drop.body(TiltedLineContact)
def _(contact, lamina, nx, ny):
    return lamina.drop - (nx * contact.direction_x + ny * contact.direction_y) * lamina.rise


@law_of(SlicedLineContact)
def least_overlap(contact, k):
    """Overlap of the roller's middle above which slice ``k`` may carry load [m]."""
    return contact.relief[k]


@least_overlap.body(TiltedLineContact)
def _(contact, k):
    return contact.relief[k] - abs(contact.rise[k])


@kernel
def loaded_slices(contact, overlap):
    """Number of the first slices, in whole vectors, beyond which none carries load; all for NaN."""
    count = 0
    while count < contact.share.size and not least_overlap(contact, count) >= overlap:
        count += VECTOR
    return count


@law_of(SlicedLineContact)
def lean(contact, rise, nx, ny):
    """Change of the overlap with the azimuth [m/rad] of a roller whose slices rise so much on average [m]."""
    return 0.0


@lean.body(TiltedLineContact)
def _(contact, rise, nx, ny):
    return rise * (nx * contact.direction_y - ny * contact.direction_x)


@kernel
def slice_terms(contact, lamina, overlap, nx, ny):
    """Load and stiffness of a ``Slice``, that times the approach, and the load times the rise."""
    own_overlap = overlap - slice_drop(contact, lamina, nx, ny)
    own_load, own_stiffness, approach = closed_load(contact.line, own_overlap)
    load = lamina.share * own_load
    stiffness = 0.0 if own_overlap <= 0.0 else lamina.share * own_stiffness
    return load, stiffness, stiffness * approach, load * lamina.rise


@kernel
def summed_load(contact, load, stiffness, weighted, raised, nx, ny):
    """``SummedLoad`` of the sums of ``slice_terms``: mean approach weighted by stiffness, mean rise by load."""
    none = load <= 0.0
    return SummedLoad(
        load,
        0.0 if none else stiffness,
        SMALLEST_APPROACH if none else weighted / stiffness,
        0.0 if none else lean(contact, raised / load, nx, ny),
    )


@line_load.body(SlicedLineContact, TiltedLineContact)
def _(contact, overlap, nx, ny):
    load = stiffness = weighted = raised = 0.0
    for k in range(loaded_slices(contact, overlap)):
        terms = slice_terms(contact, slice_of(contact, k), overlap, nx, ny)
        load += terms[0]
        stiffness += terms[1]
        weighted += terms[2]
        raised += terms[3]
    total = summed_load(contact, load, stiffness, weighted, raised, nx, ny)
    return total.load, total.stiffness, total.approach, total.lean


@line_load.body(SummedLoad)
def _(contact, overlap, nx, ny):
    return contact.load, contact.stiffness, contact.approach, contact.lean


@law_of(LineContact, PowerLineContact, LogarithmicLineContact)
def without_slices(contact):
    """The law as lanes read it, numbers alone."""
    return contact


@without_slices.body(SlicedLineContact, TiltedLineContact)
def _(contact):
    return SummedLoad(0.0, 0.0, SMALLEST_APPROACH, 0.0)


@law_of(LineContact, PowerLineContact, LogarithmicLineContact, SlicedLineContact)
def around(contact, slope, size):
    """``slope`` over azimuth times ``size``; nothing, and not computed, between parallel races."""
    return 0.0


@around.body(TiltedLineContact, SummedLoad)
def _(contact, slope, size):
    return slope * size


@law_of(LineContact)
def whole_energy(contact, approach):
    """Energy [J] stored in a plain line contact at a positive approach [m]: the integral of its load."""
    return 9.0 / 19.0 * whole_load(contact, approach)[0] * approach


@whole_energy.body(PowerLineContact)
def _(contact, approach):
    return whole_load(contact, approach)[0] * approach / (contact.exponent + 1.0)


@whole_energy.body(LogarithmicLineContact)
def _(contact, approach):
    load = whole_load(contact, approach)[0]
    y = fast_log(contact.load_scale / load)
    return contact.compliance * load * load * (0.5 * y - 0.25)


@whole_energy.body(LineContactOnBar)
def _(contact, approach):
    load = whole_load(contact, approach)[0]
    bar_deflection = load / contact.bar_stiffness
    return 9.0 / 19.0 * load * (approach - bar_deflection) + 0.5 * load * bar_deflection


@law
def line_energy(contact, overlap, nx, ny):
    """Energy [J] stored in a roller's contact on a race; arguments as in ``line_load``."""


@kernel
def closed_energy(contact, overlap):
    """``line_energy`` of a plain law."""
    return whole_energy(contact, overlap) if overlap > 0.0 else 0.0


@line_energy.body(LineContact, PowerLineContact, LogarithmicLineContact)
def _(contact, overlap, nx, ny):
    return closed_energy(contact, overlap)


@kernel
def energy_of_slices(contact, overlap, nx, ny):
    """``line_energy`` of a sliced roller."""
    energy = 0.0
    for k in range(loaded_slices(contact, overlap)):
        energy += contact.share[k] * closed_energy(
            contact.line, overlap - slice_drop(contact, slice_of(contact, k), nx, ny)
        )
    return energy


@line_energy.body(SlicedLineContact, TiltedLineContact)
def _(contact, overlap, nx, ny):
    return energy_of_slices(contact, overlap, nx, ny)
