"""Tables of a dimension chain: closing link, links, allocation of tolerances, Monte Carlo; and the parts of the links.

A link is a dimension of a part, or a function of links before it: the growth of a raceway by a press fit, the growth by
temperature, an expression. The closing link is the sum of coefficient times link. A dimension that only functions use has
the coefficient 0.

The limits of a part come from stated deviations, codes of fits (ISO 286, ISO 492), or allocated tolerances. Stated ones stay as
they are written, to the last digit; allocated ones are rounded to the resolution of the drawing: their deviations inwards, and the
nominal that is moved to the step next to its place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil, floor
from typing import Annotated, Literal

from pydantic import Field

from rbdyn.base.faults import MethodError, NonNegative, Positive, Strict
from rbdyn.base.records import Record
from rbdyn.properties.tolerances import SURFACES, fit_limits, grade_tolerances, position_limits, ring_limits

Distribution = Literal["normal", "truncated_normal", "uniform", "triangular"]
Mode = Literal["worst_case", "rss", "yield"]
Interval = tuple[float, float]
# A kilometre, or a coefficient of a million, is a typing error.
Bounded = Annotated[float, Field(ge=-1e6, le=1e6)]
Poisson = Annotated[float, Field(ge=0.0, lt=0.5)]
Position = Literal[
    "unilateral", "symmetric",
    "d", "e", "f", "g", "h", "js", "m", "n", "p", "r", "s",
    "D", "E", "F", "G", "H", "JS",
]  # fmt: skip

Origin = Literal["stated", "allocated", "temperature"]

SLACK = 1e-9  # mm: rounding tolerated at a limit
DIGITS = 12  # decimals of an allocated size in mm
DRAWING_DECIMALS = 3  # least decimals of a size in mm
ESTIMATED = "\u2248"  # before a size that is an estimate


TWO_SIDED = ("symmetric", "js", "JS")  # positions with as much on both sides of the nominal
LEAST = 1e-6  # mm: tolerance that counts as one where nothing is rounded
SHAFT_LETTERS = ("f", "g", "h", "js", "j", "k", "m", "n", "p", "r", "s")
HOLE_LETTERS = ("F", "G", "H", "JS", "J", "K", "M", "N", "P", "R", "S")
SEAT_GRADES = range(4, 10)
NEAR = 1e-6  # share of a step within which a size is on it


# All assemblies stay in memory and are sorted for quantiles: a hundred million take 2 GB.
Samples = Annotated[int, Field(ge=1, le=100_000_000)]


class ClosingLink(Strict):
    """Limits of the closing link, mm."""

    lower_mm: Bounded
    """Lower limit of the closing link."""
    upper_mm: Bounded
    """Upper limit of the closing link."""


class Cost(Strict):
    """Cost of a tolerance T in mm, a + b/T^k, from the narrowest that the process gives."""

    a: NonNegative = 0.0
    """Cost of the part without its tolerance."""
    b: Positive
    """Cost that falls with the tolerance T in mm, as b/T^k."""
    k: Annotated[float, Field(gt=0.0, le=10.0)] = 1.0
    """Exponent of the tolerance."""
    narrowest_mm: NonNegative = 0.0
    """Narrowest tolerance that the process gives."""


class PressFit(Strict):
    """Change of a diameter by a fit, after Lamé. A loose fit changes nothing."""

    shaft: str
    """Link of the inner part's diameter."""
    bore: str
    """Link of the outer part's diameter."""
    raceway_mm: Positive
    """Diameter whose change the link is. If larger than the fit it is on the outer part and grows, if smaller it is on the
    inner part and shrinks."""
    shaft_bore_mm: NonNegative | None = None
    """Bore of the inner part. Default: 0, or the raceway if it is on this part."""
    outside_mm: Positive | None = None
    """Outside diameter of the outer part. Default: the raceway if it is on this part, otherwise required."""
    shaft_modulus_GPa: Positive = 206.0  # noqa: N815
    """Young's modulus of the inner part; steel."""
    bore_modulus_GPa: Positive = 206.0  # noqa: N815
    """Young's modulus of the outer part; steel."""
    shaft_poisson: Poisson = 0.3
    """Poisson's ratio of the inner part; steel."""
    bore_poisson: Poisson = 0.3
    """Poisson's ratio of the outer part; steel."""
    interference_change_mm: Bounded = 0.0
    """Change of the interference by roughness, temperature and rotation; negative where they reduce it."""


class ThermalGrowth(Strict):
    """Growth of the link ``of`` by a temperature rise, with the deviations of that rise."""

    of: str
    """Link that grows."""
    expansion_per_K: Annotated[float, Field(ge=-1.0, le=1.0)]  # noqa: N815
    """Linear thermal expansion."""
    temperature_rise_K: Bounded  # noqa: N815
    """Temperature rise."""
    upper_K: Bounded = 0.0  # noqa: N815
    """Upper deviation of the temperature rise."""
    lower_K: Bounded = 0.0  # noqa: N815
    """Lower deviation of the temperature rise."""


class Link(Strict):
    """One link: a dimension with its deviations from the nominal, or a function of links before it."""

    name: Annotated[str, Field(min_length=1)]
    """Name of the link."""
    coefficient: Bounded
    """Change of the closing link per unit of this link; 0 for a link that only functions use."""
    nominal_mm: Bounded | None = None
    """Nominal of a dimension."""
    upper_mm: Bounded | None = None
    """Upper deviation."""
    lower_mm: Bounded | None = None
    """Lower deviation."""
    fit: str | None = None
    """Deviations by a code instead: "k5", "H7" of ISO 286, or "P5 bore", "Normal outside" of ISO 492."""
    distribution: Distribution = "normal"
    """Distribution of the manufactured parts."""
    mean_mm: Bounded | None = None
    """Mean of the manufactured parts, as a deviation from the nominal. Default: the middle of the tolerance."""
    capability: Positive = 1.0
    """T/(6 sigma) of a normal or truncated normal part."""
    estimated: bool = False
    """Whether the nominal is an estimate, which drawings, tables and reports mark until a drawing states it."""
    fixed: bool = False
    """Whether the allocation keeps the stated tolerance of this link. It matters where all links have deviations; if some
    have none, stated deviations always stay."""
    position: Position = "unilateral"
    """Position of an allocated tolerance. unilateral: on one side, so that it can only shorten the closing link. symmetric: on
    both sides. Otherwise: a letter of ISO 286."""
    cost: Cost | None = None
    """Cost of the tolerance."""
    press_fit: PressFit | None = None
    """Press fit whose change of a diameter is the link."""
    thermal_growth: ThermalGrowth | None = None
    """Thermal growth of another link, which is this link."""
    expression: str | None = None
    """Expression of earlier links whose value is the link."""

    @property
    def is_dimension(self) -> bool:
        """Whether the link is a dimension of a part and no function of others."""
        return self.press_fit is None and self.thermal_growth is None and self.expression is None

    @property
    def has_deviations(self) -> bool:
        """Whether the link has stated deviations; a growth by temperature always has."""
        return self.thermal_growth is not None or self.fit is not None or self.upper_mm is not None

    @property
    def nominal(self) -> float:
        """Nominal of a dimension, mm; 0 where it is missing, which is a fault."""
        return self.nominal_mm or 0.0


class Allocate(Strict):
    """Allocation of tolerances."""

    method: Literal["equal", "iso286", "cost"] = "equal"
    """Rule of the allocation. equal: equal tolerances. iso286: in proportion to the ISO 286 tolerance units (for its grades:
    grades = true). cost: least cost."""
    mode: Mode = "worst_case"
    """Criterion within the limits: the worst case, the root sum square, or target_yield of the assemblies."""
    grades: bool = False
    """Whether each tolerance is narrowed to a grade of ISO 286."""
    spend_slack: bool = False
    """Whether grades are widened as far as the limits allow. The first is the grade whose cost curve saves most or, without
    curves, the finest."""
    target_yield: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9973
    """Share of the assemblies that mode = "yield" keeps within the limits; 3 sigma."""
    adjust: str | None = None
    """Part whose nominal is moved. Default: the first that is not fixed, if possible with a positive coefficient."""
    resolution_mm: Annotated[float, Field(ge=0.0, le=1.0)] = 0.001
    """Resolution of the drawing, to which nominals and deviations of allocated parts are rounded. The closing link stays
    within its limits. 0 leaves the sizes unrounded. Stated deviations are never rounded."""


class MonteCarlo(Strict):
    """Size and seed of the Monte Carlo of the assemblies."""

    samples: Samples = 1_000_000
    """Number of random assemblies."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the assemblies."""


class Selective(Strict):
    """Selective assembly: two parts sorted in classes and matched class by class."""

    first: str
    """First of the two parts that are sorted and matched class by class."""
    second: str
    """Second of the two parts."""
    classes: Annotated[int, Field(ge=2, le=100)] = 4
    """Number of classes."""
    by: Literal["width", "probability"] = "width"
    """Classes of equal width over the tolerance, or of equal share of each part's production."""
    samples: Annotated[int, Field(ge=1, le=10_000_000)] = 200_000
    """Number of random parts of each link; all sizes stay in memory."""
    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the parts."""


class Chain(Strict):
    """A closing link, its links, and the allocation of their tolerances."""

    closing_link: ClosingLink
    """Gap or dimension that results from the links."""
    link: Annotated[list[Link], Field(min_length=1)]
    """Links of the chain."""
    allocate: Allocate = Allocate()
    """Allocation of tolerances."""
    monte_carlo: MonteCarlo = MonteCarlo()
    """Monte Carlo of the assemblies."""
    selective: Selective | None = None
    """Selective assembly of two parts."""

    @property
    def width_mm(self) -> float:
        """Tolerance of the closing link."""
        return self.closing_link.upper_mm - self.closing_link.lower_mm

    @property
    def free(self) -> list[Link]:
        """Dimensions for the allocation: those without deviations.

        If all have some, those that are neither fixed nor stated by a code; if all are stated by codes, these.
        """
        loose = [link for link in self.link if link.is_dimension and not link.fixed]
        bare = [link for link in loose if not link.has_deviations]
        return bare or [link for link in loose if link.fit is None] or loose

    @property
    def is_stated(self) -> bool:
        """Whether the deviations of all links are stated, so that nothing is to be allocated."""
        return all(link.has_deviations for link in self.free)


class Part(Record):
    """A part with all its sizes, mm; ``mean_mm`` is a deviation from the nominal, ``moved_mm`` the shift of the nominal.

    ``origin``: stated deviations, allocated ones, or the growth of another part by temperature. ``fit``: code that states them.
    ``iso_class``: class of ISO 286 within the limits of an allocated seat. ``estimated``: whether the nominal is an estimate.
    """

    name: str
    coefficient: float
    nominal_mm: float
    upper_mm: float
    lower_mm: float
    distribution: Distribution
    mean_mm: float
    grade: str | None = None
    capability: float = 1.0
    moved_mm: float = 0.0
    origin: Origin = "stated"
    fit: str | None = None
    iso_class: str | None = None
    estimated: bool = False

    @property
    def tolerance_mm(self) -> float:
        """Width of the tolerance; one below the last decimal of a size is none."""
        width = self.upper_mm - self.lower_mm
        return width if width > 10.0**-DIGITS else 0.0

    @property
    def middle_mm(self) -> float:
        """Deviation of mid-tolerance from the nominal."""
        return (self.upper_mm + self.lower_mm) / 2

    @property
    def sigma_mm(self) -> float:
        """Standard deviation before truncation of a normal part."""
        return self.tolerance_mm / (6 * self.capability)

    @property
    def text(self) -> str:
        """Size on a drawing, such as '9.290 0/-0.005'; stated by a code '27 k5 (+0.011/+0.002)'; an estimate begins with '≈'."""
        mark = f"{ESTIMATED} " if self.estimated else ""
        return mark + size_text(self.nominal_mm, self.upper_mm, self.lower_mm, self.fit)


def size_text(nominal_mm: float, upper_mm: float, lower_mm: float, fit: str | None = None) -> str:
    """'9.290 0/-0.005' of a nominal and deviations, to a micrometre or the last stated digit; with a code as it stands."""
    decimals = max(DRAWING_DECIMALS, *(_decimals(value) for value in (nominal_mm, upper_mm, lower_mm)))
    upper, lower = (f"{value:+.{decimals}f}" if value else "0" for value in (upper_mm, lower_mm))
    return f"{nominal_mm:.{decimals}f} {upper}/{lower}" if fit is None else f"{nominal_mm:.12g} {fit} ({upper}/{lower})"


def _decimals(value: float) -> int:
    """Decimals of a size in mm, of at most a picometre."""
    return len(f"{value:.{DIGITS}f}".rstrip("0").partition(".")[2])


def coded_limits(link: Link) -> Interval:
    """Lower and upper deviation, mm, of the link's ``fit``. Raises MethodError for an unknown code or size."""
    code = link.fit or ""
    rings = any(code.endswith(surface) for surface in SURFACES)
    return (ring_limits if rings else fit_limits)(link.nominal, code)


def stated_part(link: Link, by_name: Mapping[str, Link]) -> Part:
    """The part of a link with deviations, as they are written; without any it is exactly nominal."""
    nominal, mean = link.nominal, link.mean_mm
    lower, upper = link.lower_mm or 0.0, link.upper_mm or 0.0
    if link.thermal_growth:
        growth = link.thermal_growth
        per_kelvin = growth.expansion_per_K * by_name[growth.of].nominal
        nominal = per_kelvin * growth.temperature_rise_K
        lower, upper = (_rounded(end) for end in sorted((per_kelvin * growth.lower_K, per_kelvin * growth.upper_K)))
        return replace(_part(link, nominal, lower, upper, mean), origin="temperature")
    if link.fit is not None:
        lower, upper = (_rounded(end) for end in coded_limits(link))
    return replace(_part(link, nominal, lower, upper, mean), fit=link.fit)


def stated_parts(links: Sequence[Link]) -> list[Part]:
    """Parts of all links that vary."""
    by_name = {link.name: link for link in links}
    return [stated_part(link, by_name) for link in links if link.is_dimension or link.thermal_growth]


def allocated_part(link: Link, tolerance: float, grade: str | None, slope: float) -> Part:
    """The part of a link with a tolerance, mm, at the link's ``position``.

    ``slope``: change of the closing link per unit of this link.
    """
    if link.position == "symmetric":
        lower, upper = -tolerance / 2, tolerance / 2
    elif link.position == "unilateral":
        lower, upper = (-tolerance, 0.0) if slope > 0 else (0.0, tolerance)
    else:
        lower, upper = position_limits(link.nominal, link.position, tolerance)
    return replace(_part(link, link.nominal, _rounded(lower), _rounded(upper)), grade=grade, origin="allocated")


def _rounded(size: float) -> float:
    return round(size, DIGITS)


def _part(link: Link, nominal: float, lower: float, upper: float, mean: float | None = None) -> Part:
    mean = (upper + lower) / 2 if mean is None else mean
    part = Part(link.name, link.coefficient, nominal, upper, lower, link.distribution, mean)
    return replace(part, capability=link.capability, estimated=link.estimated)


def on_step(steps: int, resolution: float) -> float:
    """Size, mm, of a whole number of steps."""
    return round(steps * resolution, DIGITS)


def steps_below(size: float, resolution: float) -> int:
    """Whole steps in a size."""
    return floor(size / resolution + NEAR)


def steps_above(size: float, resolution: float) -> int:
    """Whole steps that a size needs."""
    return ceil(size / resolution - NEAR)


def least_tolerance(link: Link, resolution: float) -> float:
    """Narrowest tolerance, mm, that the drawing carries and the process of the link gives."""
    process = 0.0 if link.cost is None else link.cost.narrowest_mm
    if not resolution:
        return max(process, LEAST)
    # Both sides of a symmetric tolerance are whole steps.
    step = resolution * (2 if link.position in TWO_SIDED else 1)
    return on_step(max(steps_above(process, step), 1), step)


def rounded_part(part: Part, resolution: float) -> Part:
    """An allocated part with its nominal on the nearest step and its deviations rounded inwards; others as they are.

    A tolerance below one step takes one. A grade stays where the tolerance is no wider than it.
    """
    if part.origin != "allocated" or not resolution:
        return part
    lower, upper = steps_above(part.lower_mm, resolution), steps_below(part.upper_mm, resolution)
    if upper <= lower:
        below = part.lower_mm + part.upper_mm < 0
        lower, upper = (upper - 1, upper) if below else (lower, lower + 1)
    low, high = on_step(lower, resolution), on_step(upper, resolution)
    nominal = on_step(round(part.nominal_mm / resolution), resolution)
    grade = part.grade if high - low <= part.tolerance_mm + SLACK else None
    return replace(
        at_nominal(part, nominal), lower_mm=low, upper_mm=high, mean_mm=round((low + high) / 2, DIGITS), grade=grade
    )


def at_nominal(part: Part, nominal: float) -> Part:
    """The part with another nominal, and the whole move since the stated one."""
    return replace(part, nominal_mm=nominal, moved_mm=round(part.moved_mm + nominal - part.nominal_mm, DIGITS))


def seat_part(part: Part) -> Part:
    """A seat of a bought ring with its stated nominal: the move of the nominal is in the deviations, as of any fit."""
    shift = part.moved_mm
    low, high, mean = (round(value + shift, DIGITS) for value in (part.lower_mm, part.upper_mm, part.mean_mm))
    seat = at_nominal(part, round(part.nominal_mm - shift, DIGITS))
    return replace(seat, lower_mm=low, upper_mm=high, mean_mm=mean)


def class_within(part: Part, shaft: bool) -> str:
    """Widest tolerance class of ISO 286 within the limits of a seat, such as 'k5'; empty if there is none."""
    widest, name = 0.0, ""
    for letter in SHAFT_LETTERS if shaft else HOLE_LETTERS:
        for grade in SEAT_GRADES:
            try:
                lower, upper = fit_limits(part.nominal_mm, f"{letter}{grade}")
            except MethodError:
                continue
            inside = part.lower_mm - SLACK <= lower and upper <= part.upper_mm + SLACK
            if inside and upper - lower > widest + SLACK:
                widest, name = upper - lower, f"{letter}{grade}"
    return name


def places(part: Part, resolution: float) -> list[Part]:
    """The part with its nominal on the steps next to it, the nearer first; as it is where nothing is rounded.

    A stated nominal within a step comes first of all: a move that only the rounding asks for is none.
    """
    if not resolution:
        return [part]
    steps = {steps_below(part.nominal_mm, resolution), steps_above(part.nominal_mm, resolution)}
    nominals = sorted((on_step(step, resolution) for step in steps), key=lambda size: abs(size - part.nominal_mm))
    stated = round(part.nominal_mm - part.moved_mm, DIGITS)
    if (
        abs(part.moved_mm) < resolution * (1.0 + NEAR)
        and on_step(steps_below(stated, resolution), resolution) == stated
    ):
        nominals = [stated, *(nominal for nominal in nominals if nominal != stated)]
    return [at_nominal(part, nominal) for nominal in nominals]


def narrower(tolerance: float, least: float, resolution: float) -> float:
    """The next narrower tolerance, mm: by a step, at least by a hundredth, and no narrower than ``least``."""
    step = max(resolution, 0.01 * tolerance)
    return max(least, round(tolerance - step, DIGITS))


def grade_words(part: Part) -> str:
    """'IT5' of an allocated part, or the grade that it is finer than; empty for others and beyond ISO 286."""
    if part.grade or part.origin != "allocated":
        return part.grade or ""
    try:
        ladder = grade_tolerances(part.nominal_mm)
    except MethodError:
        return ""
    wider = [grade for grade, width in ladder.items() if part.tolerance_mm <= width + SLACK]
    if not wider:
        return ""
    return wider[0] if abs(ladder[wider[0]] - part.tolerance_mm) < SLACK else f"finer than {wider[0]}"
