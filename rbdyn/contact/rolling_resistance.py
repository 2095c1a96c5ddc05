"""Rolling resistance of a lubricated roller: of a loaded line contact, flooded or starved, and of the film of an open contact.

The flow into the inlet of a loaded contact shears both surfaces with F_R each; the power loss is 2 F_R u.

An open contact is a pair of rigid cylinders at the remaining gap, with Reynolds' equation over h + x^2/(2 R). Its pressure begins
at the meniscus; at the end of the film pressure and slope vanish. In X = x/sqrt(2 R h), with the meniscus at -M, the film's end at
X_e and I_n(X) the integral of (1 + X^2)^-n:

    I_2 - (1 + X_e^2) I_3 = 0 between -M and X_e,    F = I_1 - (1 + X_e^2) I_2.

The rolling force on each surface is 6 sqrt(2) eta l sqrt(R/h) u F, for a flooded film 4.601 eta l u sqrt(R/h). Behind its end
the oil continues in streamers, which carry the flow there. Sliding shears film and streamers by sqrt(2) eta U l sqrt(R/h) S.
The push of the film is left out: it is a few newtons, well below the loads of a roller.

Oil that loaded contacts leave on the surfaces feeds the open ones too. This layer fills gaps up to its thickness h_s, so M is
sqrt((h_s - h)/h), and a gap of h_s or more has no film.
"""

import math
from typing import NamedTuple

from rbdyn.compiled.elementary import fma, tenth_root
from rbdyn.compiled.kernel import kernel, law_of

SMALLEST_LOAD = 1e-30  # [N], keeps the root finite
# Biboulet and Houpert 2010: the rigid branch 1.42 sqrt(U W), and its transition to the elastic one, 1.47 U^0.75.
RIGID_FORCE = 1.42
REGIME = 1.4 / 1.45
ELASTIC_FORCE = RIGID_FORCE / REGIME
# Load of flooded rigid cylinders, 4.894 eta u R l/h_0 (Martin 1916).
RIGID_LOAD = 4.894
# Flooded rigid cylinders, in half-widths of their pressure: the force beyond a far meniscus times its distance, 12/sqrt(2)/4.600;
# the limit of distance over share for a near meniscus; the distance of the transition between both.
FAR_MENISCUS, NEAR_MENISCUS, JOINT = 1.845, 3.325, 2.2


class NoRollingResistance(NamedTuple):
    """Rolling without loss."""


class RollingResistance(NamedTuple):
    """Biboulet and Houpert 2010, from the isoviscous-rigid to the elastohydrodynamic regime."""

    force_scale: float  # F_R = force_scale sqrt(Q u) / (1 + r^10)^0.1, [N/sqrt(N m/s)]
    regime_scale: float  # r^10 = regime_scale (Q/sqrt(u))^5, [(N/sqrt(m/s))^-5]


class StarvedRollingResistance(NamedTuple):
    """The same with a meniscus, which reduces each branch to a share, the elastic one to 1/(1 + beyond + short)."""

    force_scale: float  # of the starved rigid branch [N/sqrt(N m/s)]
    regime_scale: float  # of the flooded contact [(N/sqrt(m/s))^-5]
    rigid_share: float  # share of the rigid branch with the meniscus [-]
    beyond_scale: float  # beyond = beyond_scale u^0.25/sqrt(Q), shear beyond the meniscus [N^0.5 (m/s)^-0.25]
    short_scale: float  # short = short_scale u^0.75/Q, flooded force over that of a short inlet [N (m/s)^-0.75]
    rigid_load: float  # Q^2/u where Hertz's width is that of rigid cylinders [N^2 s/m]


def biboulet_houpert(
    viscosity: float, equivalent_modulus: float, radius: float, length: float, reduction: float
) -> RollingResistance:
    """Rolling resistance of a line contact of reduced radius and length [m] in oil of viscosity [Pa s].

    F_R/(E' R l) = 1.42 sqrt(U W)/(1 + r^10)^0.1 with U = 2 eta u/(E' R), W = Q/(l E' R),
    r = (1.4/1.45) sqrt(W/sqrt(U)), times ``reduction`` (heating, a factor of the user). F_R is the force on one surface, so the
    power loss is 2 F_R u. The Reynolds solution of rigid cylinders gives 1.47 for the same coefficient. Isothermal
    elastohydrodynamic solutions with compressible oil give 1.42 to 1.69 U^0.75 (both in the tests).
    """
    speed_part = 2.0 * viscosity / (equivalent_modulus * radius)
    load_part = 1.0 / (length * equivalent_modulus * radius)
    force = RIGID_FORCE * reduction * equivalent_modulus * radius * length * math.sqrt(speed_part * load_part)
    return RollingResistance(force, REGIME**10 * (load_part / math.sqrt(speed_part)) ** 5)


def aihara_thermal_factor(viscosity_slope: float, conductivity: float, entrainment_speed: float) -> float:
    """Inlet shear heating: 1/(1 + 0.29 L^0.78), L = (-d eta/dT) u^2/k (Aihara 1987)."""
    thermal_load = viscosity_slope * entrainment_speed**2 / conductivity
    return float(1.0 / (1.0 + 0.29 * thermal_load**0.78))


def gap_ahead(distance: float) -> float:
    """Gap of a Hertz line contact in b^2/(2 R), at a distance ahead of its edge in half-widths b.

    m sqrt(m^2 - 1) - ln(m + sqrt(m^2 - 1)) at m = 1 + distance: from (4 sqrt(2)/3) distance^1.5 to the parabola m^2.
    """
    if distance < 1e-4:
        return 4.0 * math.sqrt(2.0) / 3.0 * distance**1.5
    root = math.sqrt(distance * (2.0 + distance))
    return (1.0 + distance) * root - math.log1p(distance + root)


def rigid_inlet_share(distance: float) -> float:
    """Rolling force of starved rigid cylinders over the flooded one at the same load.

    ``distance``: of the meniscus from the centre in sqrt(2 R h_0), the half-width of their pressure, with h_0 flooded. A closed
    form through both limits of the Reynolds solution, with an error of 0.006.
    """
    slope = FAR_MENISCUS + (NEAR_MENISCUS - FAR_MENISCUS) / (1.0 + distance / JOINT)
    return distance / (distance + slope)


def starved(
    flooded: RollingResistance,
    viscosity: float,
    pressure_coefficient: float,
    equivalent_modulus: float,
    radius: float,
    length: float,
    inlet_distance: float,
) -> StarvedRollingResistance:
    """The law for oil that begins ``inlet_distance`` half-widths ahead of the edge of the contact; SI units as above.

    The flooded force is the smooth minimum of a rigid and an elastic branch. Each branch has its own share, with the distance in
    the half-width of its own pressure: Hertz's b, or the sqrt(2 R h_0) of rigid cylinders. So a light contact, whose b vanishes,
    still has oil. The elastic share is 1/(1 + F_beyond/F + F/F_short):

    - F_beyond = 12 eta u R l/(b sqrt(g)), the shear of the oil beyond the meniscus in a gap g b^2/(2 R) = ``gap_ahead``
    - F_short = (10/(3 pi)) g Q/(alpha E'), the limit of a short inlet with viscosity exp(alpha p)

    It is exact in both limits. From a distance of 0.1 its error is 0.032 compared with the quadrature over the Hertz gap (Grubin;
    Wolveridge, Baglin and Archard 1971, whose film is that of ``film_thickness.starvation_factor``). The fit of Goksem and Hargreaves 1978
    agrees with that quadrature within 0.1. Full elastohydrodynamic solutions agree with the law within 0.045 from 5 half-widths.
    Where b is the smaller width, the shares use the load at which both widths are equal.
    """
    gap = gap_ahead(inlet_distance)
    stiffness = equivalent_modulus * radius * length  # [N]
    speed_part = 2.0 * viscosity / (equivalent_modulus * radius)  # U/u
    force = ELASTIC_FORCE * speed_part**0.75 * stiffness  # F/u^0.75
    width = math.sqrt(8.0 * radius / (math.pi * equivalent_modulus * length))  # b/sqrt(Q)
    share = rigid_inlet_share(inlet_distance)
    return StarvedRollingResistance(
        force_scale=flooded.force_scale * share,
        regime_scale=flooded.regime_scale,
        rigid_share=share,
        beyond_scale=12.0 * viscosity * radius * length / (width * math.sqrt(gap)) / force,
        short_scale=0.3 * math.pi * force * pressure_coefficient * equivalent_modulus / gap,
        rigid_load=math.pi * RIGID_LOAD / 8.0 * speed_part * stiffness**2,
    )


@law_of(NoRollingResistance)
def rolling_force(film, load, entrainment_speed):
    """Rolling resistance per surface [N] at a contact load [N] and an entrainment speed [m/s], both > 0."""
    return 0.0


@rolling_force.body(RollingResistance)
def _(film, load, entrainment_speed):
    # sqrt(Q u)/(1 + c Q^5 u^-2.5)^0.1 as one tenth root, with one square root and one division.
    q = max(load, SMALLEST_LOAD)
    q5 = q * q * q * q * q
    u25 = entrainment_speed * entrainment_speed * math.sqrt(entrainment_speed)
    u75 = u25 * u25 * u25
    return film.force_scale * tenth_root(q5 * u75 / (u25 + film.regime_scale * q5))


@rolling_force.body(StarvedRollingResistance)
def _(film, load, entrainment_speed):
    q = max(load, SMALLEST_LOAD)
    q5 = q * q * q * q * q
    root = math.sqrt(entrainment_speed)
    fourth = math.sqrt(root)
    u25 = entrainment_speed * entrainment_speed * root
    u75 = u25 * u25 * u25
    wide = math.sqrt(q * q + film.rigid_load * entrainment_speed)
    losses = 1.0 + film.beyond_scale * fourth / math.sqrt(wide) + film.short_scale * root * fourth / wide
    # Rigid over elastic share: r^10 changes with its tenth power.
    ratio = film.rigid_share * losses
    ratio2 = ratio * ratio
    ratio5 = ratio2 * ratio2 * ratio
    return film.force_scale * tenth_root(q5 * u75 / (u25 + film.regime_scale * ratio5 * ratio5 * q5))


# Upper bound of the end of a film: that of a flooded pair is at 0.47513.
FLOODED_END = 0.4754
MARTIN = 4.895
BISECTIONS = 60


# The shear falls to 0 over the last fiftieth of the layer's thickness. Streamers of a vanishing film have a quarter of the flooded
# shear, with which it would jump.
FADING = 50.0
THINNEST_LAYER = 1e-12  # [m], below the size of a molecule


class OpenFilm(NamedTuple):
    """Flooded film at gaps well above ``touching_gap``; near that gap h/(h^2 + touching_gap^2)^0.75 replaces 1/sqrt(h)."""

    rolling_scale: float  # rolling force per surface is rolling_scale u/sqrt(h) [N s m^-0.5]
    shear_scale: float  # sliding force is shear_scale U/sqrt(h) [N s m^-0.5]
    touching_gap: float  # [m]


class LayerFilm(NamedTuple):
    """The same where an oil layer feeds the film, with sqrt(h^2 + touching_gap^2) for h in both."""

    rolling_scale: float  # rolling force per surface is rolling_scale u F/sqrt(h) [N s m^-0.5]
    shear_scale: float  # sliding force is shear_scale U S/sqrt(h) [N s m^-0.5]
    touching_gap: float  # [m]
    inverse_root: float  # 1/sqrt(h_s) [m^-0.5]


class Inlet(NamedTuple):
    """Shape integrals of the film of a rigid pair: its end X_e, rolling force F and shear S."""

    end: float
    rolling: float
    shear: float


def _integrals(x: float) -> tuple[float, float, float]:
    """Integrals from 0 to x of (1 + X^2)^-n for n = 1, 2, 3."""
    square = 1.0 + x * x
    first = math.atan(x)
    second = 0.5 * (first + x / square)
    return first, second, 0.25 * x / square**2 + 0.75 * second


def inlet(distance: float) -> Inlet:
    """Film that begins at a ``distance`` > 0 ahead of the middle, in sqrt(2 R h); ``math.inf`` is flooded."""
    ahead = (0.5 * math.pi, 0.25 * math.pi, 0.1875 * math.pi) if math.isinf(distance) else _integrals(distance)
    low, high = 0.0, min(distance, FLOODED_END)
    for _ in range(BISECTIONS):
        end = 0.5 * (low + high)
        behind = _integrals(end)
        beyond = ahead[1] + behind[1] < (1.0 + end * end) * (ahead[2] + behind[2])
        low, high = (low, end) if beyond else (end, high)
    behind = _integrals(high)
    passing = 1.0 + high * high
    rolling = ahead[0] + behind[0] - passing * (ahead[1] + behind[1])
    streamers = passing * (0.25 * math.pi - behind[1])
    return Inlet(high, rolling, ahead[0] + behind[0] + streamers)


def open_film(
    viscosity: float, radius: float, length: float, reduction: float, touching_gap: float, layer: float | None = None
) -> OpenFilm | LayerFilm:
    """Film of a pair of reduced ``radius`` and ``length`` [m] in oil of ``viscosity`` [Pa s].

    ``reduction``: factor of heating on the rolling force, times a factor of the user. ``touching_gap`` [m]. ``layer``: the
    largest gap h_s [m] that the oil fills; None for flooded.
    """
    scale = math.sqrt(2.0 * radius) * viscosity * length
    if layer is not None:
        return LayerFilm(6.0 * scale * reduction, scale, touching_gap, 1.0 / math.sqrt(max(layer, THINNEST_LAYER)))
    shape = inlet(math.inf)
    return OpenFilm(6.0 * scale * shape.rolling * reduction, scale * shape.shear, touching_gap)


def touching_gap(
    viscosity: float, radius: float, length: float, entrainment_speed: float, stiffness: float, roughness: float
) -> float:
    """Oil gap [m] between surfaces that would just touch when dry, at least ``roughness`` [m].

    There the load of the rigid pair, 4.895 eta u R l/h (Martin 1916), equals that of a contact of ``stiffness`` [N/m^(10/9)] at an
    equal approach.
    """
    gap = (MARTIN * viscosity * entrainment_speed * radius * length / stiffness) ** (9.0 / 19.0)
    return max(gap, roughness)


@law_of(OpenFilm)
def film_reach(film):
    """Gap [m] from which on there is no film."""
    return math.inf


@film_reach.body(LayerFilm)
def _(film):
    return 1.0 / (film.inverse_root * film.inverse_root)


@law_of(OpenFilm)
def film_forces(film, overlap, entrainment_speed, slip):
    """Rolling force on each surface and sliding force on the roller [N], with the signs of the speeds [m/s]; 0 in contact.

    ``overlap`` [m]: minus the gap.
    """
    gap = max(-overlap, 0.0)
    size = math.sqrt(gap * gap + film.touching_gap * film.touching_gap)
    root = gap / (size * math.sqrt(size))
    return film.rolling_scale * root * entrainment_speed, film.shear_scale * root * slip


@kernel
def layer_shape(ratio):
    """F and S of the film at a ``ratio`` sqrt(h/h_s), both 0 from 1 on.

    Minimax polynomials in the ratio and s = sqrt(1 - h/h_s), of which F has the factor s^5 of a short film, within 8e-6 of the
    flooded F and 1e-5 of the flooded S. S falls to 0 over the last 1/``FADING`` of h/h_s.
    """
    square = max(1.0 - ratio * ratio, 0.0)
    s = math.sqrt(square)
    rolling = fma(ratio, fma(ratio, 0.3032026257, -1.064219609), 1.698005502)
    rolling = fma(ratio, fma(ratio, fma(ratio, rolling, -1.705633725), 1.340257711), -0.9993726167)
    shear = fma(ratio, fma(ratio, 0.08104575355, -0.2968404493), 0.5311023782)
    shear = fma(ratio, fma(ratio, shear, -0.9117908923), 1.381902996) + s * fma(ratio, -0.0869574137, 1.085718634)
    return square * square * s * fma(ratio, rolling, 0.5422377818), min(FADING * square, 1.0) * shear


@film_forces.body(LayerFilm)
def _(film, overlap, entrainment_speed, slip):
    gap = max(-overlap, 0.0)
    size = math.sqrt(gap * gap + film.touching_gap * film.touching_gap)
    rooted = math.sqrt(size)
    root = gap / (size * rooted)
    rolling, shear = layer_shape(rooted * film.inverse_root)
    return film.rolling_scale * root * rolling * entrainment_speed, film.shear_scale * root * shear * slip
