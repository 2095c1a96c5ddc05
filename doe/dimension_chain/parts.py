"""Parts of links: given deviations, codes of fits, allocated tolerances in their place."""

from collections.abc import Mapping, Sequence

from doe.dimension_chain.links import DIGITS, Interval, Link, Part
from rbdyn.properties.tolerances import SURFACES, fit_limits, positioned, ring_limits


def coded_limits(link: Link) -> Interval:
    """Lower and upper deviation, mm, of the link's ``fit``. Raises MethodError for an unknown code or size."""
    code = link.fit or ""
    rings = any(code.endswith(surface) for surface in SURFACES)
    return (ring_limits if rings else fit_limits)(link.nominal, code)


def given_part(link: Link, by_name: Mapping[str, Link]) -> Part:
    """The part of a link with deviations; a link without any is taken at its nominal."""
    nominal, mean = link.nominal, link.mean_mm
    lower, upper = link.lower_mm or 0.0, link.upper_mm or 0.0
    if link.thermal_growth:
        growth = link.thermal_growth
        per_kelvin = growth.expansion_per_K * by_name[growth.of].nominal
        nominal = per_kelvin * growth.temperature_rise_K
        lower, upper = sorted((per_kelvin * growth.lower_K, per_kelvin * growth.upper_K))
    elif link.fit is not None:
        lower, upper = coded_limits(link)
    return _part(link, nominal, lower, upper, mean, None)


def given_parts(links: Sequence[Link]) -> list[Part]:
    """Parts of all links that vary."""
    by_name = {link.name: link for link in links}
    return [given_part(link, by_name) for link in links if link.is_dimension or link.thermal_growth]


def allocated_part(link: Link, tolerance: float, grade: str | None = None) -> Part:
    """The part of a link with a tolerance, mm, where the link's ``position`` puts it."""
    if link.position == "symmetric":
        lower, upper = -tolerance / 2, tolerance / 2
    elif link.position == "unilateral":
        lower, upper = (-tolerance, 0.0) if link.coefficient > 0 else (0.0, tolerance)
    else:
        lower, upper = positioned(link.nominal, link.position, tolerance)
    return _part(link, link.nominal, lower, upper, None, grade)


def _part(link: Link, nominal: float, lower: float, upper: float, mean: float | None, grade: str | None) -> Part:
    lower, upper = round(lower, DIGITS), round(upper, DIGITS)
    mean = (upper + lower) / 2 if mean is None else mean
    return Part(link.name, link.coefficient, nominal, upper, lower, link.distribution, mean, grade, link.capability)
