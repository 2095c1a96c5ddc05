"""Steady traction coefficient of a contact against slip and load: laws, and tables of them."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rbdyn.base.arrays import Array
from rbdyn.compiled.elementary import fast_exp, fast_log, fast_tanh, fma
from rbdyn.compiled.kernel import kernel, law_of

SMALLEST_LOAD = 1e-30  # [N], keeps the logarithm finite
LARGEST_SPEED_RATIO = 1e12  # slip over the speed scale of a surface; mu has long become constant

Coefficient = Callable[[Array, Array], Any]

FEWEST_CELLS, MOST_CELLS = 12, 192
# Step of the difference quotients in cells, with an error below 1e-6 of a derivative.
DIFFERENCE = 1e-3


class NoTraction(NamedTuple):
    """Frictionless contact."""


class FourConstantTraction(NamedTuple):
    """Gupta's law mu(u) = (A + B u) exp(-C u) + D (Chen et al. 2022, eq 12) with mu(0) = 0, that is A = -D."""

    a: float  # [-]
    b: float  # [s/m]
    c: float  # [s/m]
    d: float  # [-]


class BlendedFourConstantTraction(NamedTuple):
    """Gupta's law with mu(0) > 0: its jump at rest is blended, mu(u) v/sqrt(u^2 + u_r^2)."""

    a: float  # [-]
    b: float  # [s/m]
    c: float  # [s/m]
    d: float  # [-]
    blend_speed: float  # u_r [m/s]


class CoulombTraction(NamedTuple):
    """Dry friction mu tanh(u/u_r)."""

    coefficient: float  # [-]
    blend_speed: float  # u_r [m/s]


# Laws without a table.
TABLELESS = (NoTraction, FourConstantTraction, BlendedFourConstantTraction, CoulombTraction)


class SurfaceAxes(NamedTuple):
    """Axes of the table of a ``TractionSurface``."""

    speed_density: float  # 1/u_0 [s/m]
    slip_density: float  # cells along ln(1 + x) [-]
    last_slip: float  # end of the cells [cells]
    load_origin: float  # sqrt(load) of the first cell [sqrt(N)]
    load_density: float  # cells along sqrt(load) [1/sqrt(N)]
    last_load: float  # end of the cells [cells]


class TractionSurface(NamedTuple):
    """mu over slip u and load Q from a table: mu = x/(1 + x) exp(L), x = u/u_0.

    L is bicubic (Hermite) and C1 over ln(1 + x) and sqrt(Q), in which it is smooth: it follows the pressure, which is
    proportional to sqrt(Q). Cells are uniform. Beyond the table L becomes constant within one cell, without a kink.
    """

    axes: SurfaceAxes
    cells: Array  # (slip cells x load cells, 16): polynomial of each, slip fastest
    columns: int  # cells along sqrt(load)


class MixedTraction(NamedTuple):
    """Asperities carry a share of the load in dry friction: f mu_b tanh(u/u_r) + (1 - f) mu_fluid.

    f = exp(-b Lambda^c) with a film that thins as Q^-0.1, that is exp(-share_scale Q^-share_exponent).
    """

    fluid: Any  # traction of the film, any other model
    boundary: float  # mu_b [-]
    blend_speed: float  # u_r [m/s]
    share_scale: float  # b Lambda_1^c, Lambda_1 at 1 N [N^share_exponent]
    share_exponent: float  # 0.1 c [-]


def dry_friction(coefficient: float, blend_speed: float) -> NoTraction | CoulombTraction:
    """Dry friction that changes sign over ``blend_speed`` [m/s]; none where the coefficient is zero."""
    return CoulombTraction(coefficient, blend_speed) if coefficient > 0.0 else NoTraction()


def four_constants(mu_0: float, mu_m: float, mu_inf: float, u_m: float) -> tuple[float, float, float, float]:
    """Gupta's A, B, C, D from mu at rest, the peak mu_m at the sliding speed u_m [m/s], and mu far beyond it.

    D = mu_inf, A = mu_0 - mu_inf; with x = A + B u_m the peak conditions give x exp(-(x - A)/x) = mu_m - mu_inf
    and C = B/x. Needs mu_m > mu_inf, mu_m > mu_0 and u_m > 0.
    """
    a, peak = mu_0 - mu_inf, mu_m - mu_inf

    def excess(x: float) -> float:
        return x * math.exp(-(x - a) / x) - peak

    # The function rises without bound from below the peak at the lower end: bisection cannot fail.
    low = max(a, 0.0) if a > 0.0 else 1e-300
    high = max(4.0 * peak, 2.0 * abs(a), 1e-12)
    while excess(high) < 0.0:
        high *= 2.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) < 0.0 else (low, middle)
    x = 0.5 * (low + high)
    b = (x - a) / u_m
    return a, b, b / x, mu_inf


@law_of(NoTraction)
def traction(model, slip, load):
    """Signed traction coefficient at a signed slip [m/s] and a load [N] >= 0; traction times slip is never negative."""
    return 0.0


@traction.body(FourConstantTraction)
def _(model, slip, load):
    speed = abs(slip)
    return math.copysign((model.a + model.b * speed) * fast_exp(-model.c * speed) + model.d, slip)


@traction.body(BlendedFourConstantTraction)
def _(model, slip, load):
    speed = abs(slip)
    coefficient = (model.a + model.b * speed) * fast_exp(-model.c * speed) + model.d
    return coefficient * slip / math.sqrt(slip * slip + model.blend_speed * model.blend_speed)


@traction.body(CoulombTraction)
def _(model, slip, load):
    return model.coefficient * fast_tanh(slip / model.blend_speed)


@traction.body(TractionSurface)
def _(model, slip, load):
    along, across = table_place(model.axes, slip, load)
    return traction_by_table(model.axes, slip, load, cubic(*table_cubic(model, along, across))[0])


@traction.body(MixedTraction)
def _(model, slip, load):
    return mixed(model, slip, load, traction(model.fluid, slip, load))


@law_of(NoTraction)
def growth(model, slip, load):
    """Growth of the size of the traction coefficient over the logarithm of the slip, arguments as of ``traction``; negative past a
    peak."""
    return 0.0


@growth.body(FourConstantTraction)
def _(model, slip, load):
    speed = abs(slip)
    return speed * (model.b - model.c * (model.a + model.b * speed)) * fast_exp(-model.c * speed)


@growth.body(BlendedFourConstantTraction)
def _(model, slip, load):
    speed, square = abs(slip), slip * slip + model.blend_speed * model.blend_speed
    drop = fast_exp(-model.c * speed)
    coefficient = (model.a + model.b * speed) * drop + model.d
    slope = (model.b - model.c * (model.a + model.b * speed)) * drop
    return speed * (slope * speed + coefficient * model.blend_speed * model.blend_speed / square) / math.sqrt(square)


@growth.body(CoulombTraction)
def _(model, slip, load):
    return rubbing_growth(model.coefficient, model.blend_speed, slip)


@growth.body(TractionSurface)
def _(model, slip, load):
    along, across = table_place(model.axes, slip, load)
    return growth_by_table(model.axes, slip, load, *cubic(*table_cubic(model, along, across)))


@growth.body(MixedTraction)
def _(model, slip, load):
    return mixed_growth(model, slip, load, growth(model.fluid, slip, load))


@kernel
def rubbing_growth(coefficient, blend_speed, slip):
    """``growth`` of dry friction."""
    saturation = fast_tanh(slip / blend_speed)
    return coefficient * abs(slip / blend_speed) * (1.0 - saturation * saturation)


@kernel
def mixed(model, slip, load, film):
    """Traction coefficient of asperities and a film whose own coefficient is ``film``."""
    share = asperity_load_share(model.share_scale, model.share_exponent, load)
    rubbing = model.boundary * fast_tanh(slip / model.blend_speed)
    return share * rubbing + (1.0 - share) * film


@kernel
def mixed_growth(model, slip, load, film):
    """``mixed`` of the growths."""
    share = asperity_load_share(model.share_scale, model.share_exponent, load)
    return share * rubbing_growth(model.boundary, model.blend_speed, slip) + (1.0 - share) * film


@law_of(*TABLELESS)
def without_table(model):
    """A law as scalars: ``SurfaceAxes`` replace its table, for ``table_place`` and ``traction_by_table``."""
    return model


@without_table.body(TractionSurface)
def _(model):
    return model.axes


@without_table.body(MixedTraction)
def _(model):
    return MixedTraction(
        without_table(model.fluid), model.boundary, model.blend_speed, model.share_scale, model.share_exponent
    )


@law_of(SurfaceAxes)
def table_place(model, slip, load):
    """Position of a slip [m/s] and a load [N] in the table of a law [cells]: along the slip and along the load."""
    along = fast_log(1.0 + slip_ratio(model, slip)) * model.slip_density
    along = along if along < model.last_slip else model.last_slip
    across = (math.sqrt(load if load > 0.0 else 0.0) - model.load_origin) * model.load_density
    across = across if across > 0.0 else 0.0
    across = across if across < model.last_load else model.last_load
    return along, across


@table_place.body(MixedTraction)
def _(model, slip, load):
    return table_place(model.fluid, slip, load)


@kernel
def slip_ratio(axes, slip):
    """Bounded slip over the speed scale of a surface; NaN stays NaN."""
    ratio = abs(slip) * axes.speed_density
    return LARGEST_SPEED_RATIO if ratio > LARGEST_SPEED_RATIO else ratio


@law_of(TractionSurface)
def table_cubic(model, along, across):
    """Coefficients of the cubic along the slip at a ``table_place``, from the constant on, and the place in its cell."""
    # Both positions are within the table for any slip and load, NaN included.
    i, j = int(along), int(across)
    # A row of its own would be counted by reference, in atomic instructions.
    c, k, y = model.cells, i * model.columns + j, across - j
    return (
        fma(fma(fma(c[k, 12], y, c[k, 8]), y, c[k, 4]), y, c[k, 0]),
        fma(fma(fma(c[k, 13], y, c[k, 9]), y, c[k, 5]), y, c[k, 1]),
        fma(fma(fma(c[k, 14], y, c[k, 10]), y, c[k, 6]), y, c[k, 2]),
        fma(fma(fma(c[k, 15], y, c[k, 11]), y, c[k, 7]), y, c[k, 3]),
        along - i,
    )


@table_cubic.body(MixedTraction)
def _(model, along, across):
    return table_cubic(model.fluid, along, across)


@law_of(*TABLELESS)
def traction_by_table(model, slip, load, value):
    """``traction`` of a law without its table, from the value of the table."""
    return traction(model, slip, load)


@traction_by_table.body(SurfaceAxes)
def _(model, slip, load, value):
    ratio = slip_ratio(model, slip)
    return math.copysign(ratio / (1.0 + ratio) * fast_exp(value), slip)


@traction_by_table.body(MixedTraction)
def _(model, slip, load, value):
    return mixed(model, slip, load, traction_by_table(model.fluid, slip, load, value))


@law_of(*TABLELESS)
def growth_by_table(model, slip, load, value, slope):
    """``growth`` of a law without its table, from value and slope of its ``table_cubic``."""
    return growth(model, slip, load)


@growth_by_table.body(SurfaceAxes)
def _(model, slip, load, value, slope):
    ratio = slip_ratio(model, slip)
    saturation = ratio / (1.0 + ratio)
    return saturation * fast_exp(value) * fma(saturation, slope * model.slip_density, 1.0 - saturation)


@growth_by_table.body(MixedTraction)
def _(model, slip, load, value, slope):
    return mixed_growth(model, slip, load, growth_by_table(model.fluid, slip, load, value, slope))


@kernel
def cubic(first, second, third, fourth, x):
    """Value of a cubic at x, from its coefficients, and its derivative there."""
    value = fma(fma(fma(fourth, x, third), x, second), x, first)
    return value, fma(fma(3.0 * fourth, x, 2.0 * third), x, second)


@kernel
def asperity_load_share(scale, exponent, load):
    """Share of a load [N] on asperities, exp(-scale load^-exponent): zero without load, increasing towards one."""
    positive = load if load > SMALLEST_LOAD else SMALLEST_LOAD
    return fast_exp(-scale * fast_exp(-exponent * fast_log(positive)))


class SurfaceFit(NamedTuple):
    """A surface, and its largest error midway between nodes as a share of the largest coefficient."""

    surface: TractionSurface
    error: float


def traction_surface(
    coefficient: Coefficient, largest_load: float, smallest_load: float, largest_slip: float, tolerance: float = 5e-4
) -> SurfaceFit:
    """Table of ``coefficient(slip, load)``, refined until its error is below ``tolerance`` of the largest value.

    ``coefficient`` takes arrays of slip [m/s] > 0 and load [N] that broadcast, and is positive, linear in the slip
    near rest. Below ``smallest_load`` and above the largest load and slip the coefficient soon becomes constant. A kink or a step of
    the coefficient may keep the error above the tolerance, so check it. A node next to a step has a slope far too large, so the
    best table counts, not the finest. Raises ValueError for a coefficient that is not positive and
    finite.
    """
    scale = _speed_scale(coefficient, largest_load, largest_slip)
    slips, loads, best = FEWEST_CELLS, FEWEST_CELLS, None
    while True:
        grid = _Grid(coefficient, scale, largest_slip, (smallest_load, largest_load), (slips, loads))
        cells = _polynomials(grid.nodes())
        along, across = (grid.error(cells, *shift) for shift in ((0.5, 0.0), (0.0, 0.5)))
        error = max(along, across, grid.error(cells, 0.5, 0.5))
        if best is None or error < best.error:
            best = SurfaceFit(grid.surface(cells), error)
        if error < tolerance or max(slips, loads) >= MOST_CELLS:
            return best
        slips, loads = _refined(slips, along, tolerance), _refined(loads, across, tolerance)


def _refined(cells: int, error: float, tolerance: float) -> int:
    """Cells of a direction for half the tolerance; the error decreases as their fourth power."""
    growth = (2.0 * error / tolerance) ** 0.25
    return min(math.ceil(cells * min(max(growth, 1.1), 3.0)), MOST_CELLS)


def _speed_scale(coefficient: Coefficient, load: float, largest_slip: float) -> float:
    """Slip [m/s] at which the coefficient at a load has fallen to half its tangent at rest."""
    slips = largest_slip * np.geomspace(1e-12, 1.0, 300)
    secant = np.asarray(coefficient(slips, np.array(load))) / slips
    fallen = secant < 0.5 * secant[0]
    return float(slips[int(np.argmax(fallen))] if fallen.any() else largest_slip)


class _Grid:
    """Nodes of a surface of ``size`` cells up to a ``slip`` [m/s] and between ``loads`` [N]; positions i along the slip and
    j along the load count cells."""

    def __init__(
        self, coefficient: Coefficient, scale: float, slip: float, loads: tuple[float, float], size: tuple[int, int]
    ) -> None:
        self.coefficient, self.scale = coefficient, scale
        self.slip_cell = math.log1p(slip / scale) / size[0]
        self.load_start = math.sqrt(loads[0])
        self.load_cell = (math.sqrt(loads[1]) - self.load_start) / size[1]
        self.i = np.arange(size[0] + 1.0)[:, np.newaxis]
        self.j = np.arange(size[1] + 1.0)[np.newaxis, :]

    def exact(self, i: Any, j: Any) -> tuple[Any, Any]:
        """The coefficient and x/(1 + x) at positions."""
        ratio = np.expm1(np.maximum(i * self.slip_cell, 1e-9))  # at rest both vanish: their quotient is sought
        load = (self.load_start + j * self.load_cell) ** 2
        return np.asarray(self.coefficient(ratio * self.scale, load)), ratio / (1.0 + ratio)

    def exponent(self, i: Any, j: Any) -> Any:
        """L at positions."""
        mu, rise = self.exact(i, j)
        if not (np.isfinite(mu).all() and (mu > 0.0).all()):
            raise ValueError("the traction coefficient must be positive and finite at every slip above zero")
        return np.log(mu / rise)

    def nodes(self) -> Array:
        """Value, slopes and twist of L at each node, (i, j, 4), with a row and two columns of landing."""
        i, j, d = self.i, self.j, DIFFERENCE
        low, high = np.maximum(i - d, 0.0), i + d  # no slip is smaller than rest
        nodes = np.zeros((i.size + 1, j.size + 2, 4))
        inside = nodes[:-1, 1:-1]
        inside[..., 0] = self.exponent(i, j)
        inside[..., 1] = (self.exponent(high, j) - self.exponent(low, j)) / (high - low)
        inside[..., 2] = (self.exponent(i, j + d) - self.exponent(i, j - d)) / (2.0 * d)
        upper = self.exponent(high, j + d) - self.exponent(high, j - d)
        lower = self.exponent(low, j + d) - self.exponent(low, j - d)
        inside[..., 3] = (upper - lower) / (2.0 * d * (high - low))
        # A landing goes on for half the slope of the edge, and ends level.
        nodes[:, 0], nodes[:, -1] = nodes[:, 1], nodes[:, -2]
        for column, way in ((0, -0.5), (-1, 0.5)):
            nodes[:, column, :2] += way * nodes[:, column, 2:]
            nodes[:, column, 2:] = 0.0
        nodes[-1] = nodes[-2]
        nodes[-1, :, ::2] += 0.5 * nodes[-1, :, 1::2]
        nodes[-1, :, 1::2] = 0.0
        return nodes

    def error(self, cells: Array, x: float, y: float) -> float:
        """Largest error at (x, y) of every cell within the table, as a share of the largest coefficient."""
        inside = cells.reshape(self.i.size, self.j.size + 1, 4, 4)[:-1, 1:-1]
        fitted = x ** np.arange(4) @ inside @ y ** np.arange(4)
        exact, rise = self.exact(self.i[:-1] + x, self.j[:, :-1] + y)
        return float(np.abs(rise * np.exp(fitted) - exact).max() / exact.max())

    def surface(self, cells: Array) -> TractionSurface:
        """The law."""
        within = 1.0 - 1e-12  # the last position still lies in the last cell
        axes = SurfaceAxes(
            speed_density=1.0 / self.scale,
            slip_density=1.0 / self.slip_cell,
            last_slip=self.i.size * within,
            load_origin=self.load_start - self.load_cell,
            load_density=1.0 / self.load_cell,
            last_load=(self.j.size + 1) * within,
        )
        slip_fastest = np.ascontiguousarray(cells.reshape(-1, 4, 4).swapaxes(1, 2))
        return TractionSurface(axes, slip_fastest.reshape(-1, 16), self.j.size + 1)


def _polynomials(nodes: Array) -> Array:
    """Polynomial of each cell, (cells, 16), from value, slopes and twist at its corners, (i, j, 4) per cell size."""
    # Values and slopes at both ends of an edge, times this, are the coefficients of its cubic.
    cubic = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [-3.0, 3.0, -2.0, -1.0], [2.0, -2.0, 1.0, 1.0]])
    value, along, across, twist = np.moveaxis(nodes, -1, 0)
    near, far = slice(None, -1), slice(1, None)
    corners = {(0, 0): (near, near), (0, 1): (near, far), (1, 0): (far, near), (1, 1): (far, far)}
    # Rows: value at both x ends, slope along x at both; columns: value at both y ends, slope along y at both.
    edges = np.empty((nodes.shape[0] - 1, nodes.shape[1] - 1, 4, 4))
    for (row, column), corner in corners.items():
        edges[..., row, column], edges[..., 2 + row, column] = value[corner], along[corner]
        edges[..., row, 2 + column], edges[..., 2 + row, 2 + column] = across[corner], twist[corner]
    return np.ascontiguousarray((cubic @ edges @ cubic.T).reshape(-1, 16))
