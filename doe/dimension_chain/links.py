"""What a dimension chain is made of: the closing link, its links, the wish for their tolerances.

A link is a dimension of a part, or a function of links that stand before it: the growth of a raceway by a press
fit, the growth by temperature, an expression. The closing link is the sum of coefficient times link. A dimension
that only functions use has the coefficient 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from rbdyn.faults import Strict
from rbdyn.fields import NonNegative, Positive

Distribution = Literal["normal", "truncated_normal", "uniform", "triangular"]
Mode = Literal["worst_case", "rss", "yield"]
Interval = tuple[float, float]
# A kilometre, or a coefficient of a million, is a slip of the pen.
Bounded = Annotated[float, Field(ge=-1e6, le=1e6)]
Poisson = Annotated[float, Field(ge=0.0, lt=0.5)]
Position = Literal[
    "unilateral", "symmetric",
    "d", "e", "f", "g", "h", "js", "m", "n", "p", "r", "s",
    "D", "E", "F", "G", "H", "JS",
]  # fmt: skip

SLACK = 1e-9  # mm: round-off allowed at a limit
DIGITS = 12  # decimals in mm kept of an allocated size


# Every assembly drawn is kept, and sorted for quantiles: a hundred million take 2 GB.
Samples = Annotated[int, Field(ge=1, le=100_000_000)]


class ClosingLink(Strict):
    """Limits of the closing link, mm."""

    lower_mm: Bounded
    upper_mm: Bounded


class Cost(Strict):
    """Cost of a tolerance T in mm, a + b/T^k, between the narrowest and the widest that the process gives."""

    a: NonNegative = 0.0
    b: Positive
    k: Annotated[float, Field(gt=0.0, le=10.0)] = 1.0
    narrowest_mm: NonNegative = 0.0
    widest_mm: Positive | None = None


class PressFit(Strict):
    """Change of the diameter ``raceway_mm`` by the fit of the link ``shaft`` in the link ``bore``, after Lamé.

    A raceway wider than the fit stands on the outer part and grows; one narrower stands on the inner part and
    shrinks: the value is then negative. ``fit_mm`` is the nominal of ``bore`` unless given. ``shaft_bore_mm`` is
    the bore of the inner part (0, or the raceway on it), ``outside_mm`` the outside of the outer part (the raceway
    on it, else to be given). ``interference_change_mm`` is what roughness, temperature and rotation add to the
    interference, negative where they take some. A loose fit changes nothing.
    """

    shaft: str
    bore: str
    raceway_mm: Positive
    fit_mm: Positive | None = None
    shaft_bore_mm: NonNegative | None = None
    outside_mm: Positive | None = None
    shaft_modulus_GPa: Positive = 206.0  # noqa: N815
    bore_modulus_GPa: Positive = 206.0  # noqa: N815
    shaft_poisson: Poisson = 0.3
    bore_poisson: Poisson = 0.3
    interference_change_mm: Bounded = 0.0


class ThermalGrowth(Strict):
    """Growth of the link ``of`` by a temperature rise, with the deviations of that rise."""

    of: str
    expansion_per_K: Annotated[float, Field(ge=-1.0, le=1.0)]  # noqa: N815
    temperature_rise_K: Bounded  # noqa: N815
    upper_K: Bounded = 0.0  # noqa: N815
    lower_K: Bounded = 0.0  # noqa: N815


class Link(Strict):
    """One link. ``mean_mm`` is a deviation from the nominal, like ``upper_mm`` and ``lower_mm``.

    ``fit`` gives the deviations by a code: "k5", "H7" of ISO 286, or "P5 bore", "Normal outside" of ISO 492.
    ``capability`` is T/(6 sigma) of a normal or truncated normal part. ``position`` says where an allocated
    tolerance lies: one side, so that it can only shorten the closing link, both sides, or by a letter of ISO 286.
    """

    name: Annotated[str, Field(min_length=1)]
    coefficient: Bounded
    nominal_mm: Bounded | None = None
    upper_mm: Bounded | None = None
    lower_mm: Bounded | None = None
    fit: str | None = None
    distribution: Distribution = "normal"
    mean_mm: Bounded | None = None
    capability: Positive = 1.0
    fixed: bool = False
    position: Position = "unilateral"
    cost: Cost | None = None
    press_fit: PressFit | None = None
    thermal_growth: ThermalGrowth | None = None
    expression: str | None = None

    @property
    def is_dimension(self) -> bool:
        """Whether the link is a dimension of a part and no function of others."""
        return self.press_fit is None and self.thermal_growth is None and self.expression is None

    @property
    def nominal(self) -> float:
        """Nominal of a dimension, mm; 0 where it is missing, which is a fault."""
        return self.nominal_mm or 0.0


class Allocate(Strict):
    """How tolerances are shared; ``adjust`` names the part whose nominal is moved.

    Default: the first part that is not fixed, of positive coefficient if there is one. ``target_yield`` is what
    mode "yield" keeps. ``grades`` narrows each tolerance to a grade of ISO 286; ``spend_slack`` then widens grades
    as long as the limits allow: where the curves save most, without curves the finest grade first.
    """

    method: Literal["equal", "iso286", "cost"] = "equal"
    mode: Mode = "worst_case"
    grades: bool = False
    spend_slack: bool = False
    target_yield: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.9973
    adjust: str | None = None


class MonteCarlo(Strict):
    """Size and seed of the Monte Carlo of the assemblies."""

    samples: Samples = 1_000_000
    seed: Annotated[int, Field(ge=0)] = 1


class Selective(Strict):
    """Selective assembly: ``first`` and ``second`` sorted in classes and matched class by class.

    Classes are of equal width over the tolerance, or of equal share of each part's production.
    """

    first: str
    second: str
    classes: Annotated[int, Field(ge=2, le=100)] = 4
    by: Literal["width", "probability"] = "width"
    # All sizes of all parts are kept.
    samples: Annotated[int, Field(ge=1, le=10_000_000)] = 200_000
    seed: Annotated[int, Field(ge=0)] = 1


class Chain(Strict):
    """A closing link, its links and the wish for their tolerances."""

    closing_link: ClosingLink
    link: Annotated[list[Link], Field(min_length=1)]
    allocate: Allocate = Allocate()
    monte_carlo: MonteCarlo = MonteCarlo()
    selective: Selective | None = None

    @property
    def width_mm(self) -> float:
        """Tolerance of the closing link."""
        return self.closing_link.upper_mm - self.closing_link.lower_mm

    @property
    def free(self) -> list[Link]:
        """Dimensions whose tolerances are to be allocated."""
        return [link for link in self.link if link.is_dimension and not link.fixed]


@dataclass(frozen=True)
class Part:
    """A part with all its numbers, mm; ``mean_mm`` is a deviation from the nominal."""

    name: str
    coefficient: float
    nominal_mm: float
    upper_mm: float
    lower_mm: float
    distribution: Distribution
    mean_mm: float
    grade: str | None = None
    capability: float = 1.0

    @property
    def tolerance_mm(self) -> float:
        """Width of the tolerance."""
        return self.upper_mm - self.lower_mm

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
        """'9.2900 0/-0.0050'."""
        upper, lower = (f"{value:+.4f}" if value else "0" for value in (self.upper_mm, self.lower_mm))
        return f"{self.nominal_mm:.4f} {upper}/{lower}"
