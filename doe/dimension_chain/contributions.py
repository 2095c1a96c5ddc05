"""How much each part contributes to the spread of the closing link."""

from __future__ import annotations

from collections.abc import Sequence

from doe.dimension_chain.closing import ClosingFunction, middle
from doe.dimension_chain.distributions import moments
from doe.dimension_chain.links import Part


def contributions(function: ClosingFunction, parts: Sequence[Part]) -> dict[str, dict[str, float]]:
    """Percent of the variance, by each part's own distribution, and of the worst case; sensitivities at the middle."""
    slopes = function.sensitivities(middle(parts))
    spread = [slopes[part.name] ** 2 * moments(part, part.distribution)[1] for part in parts]
    reach = [abs(slopes[part.name]) * part.tolerance_mm for part in parts]
    return {
        part.name: {
            "variance_percent": 100 * variance / (sum(spread) or 1.0),
            "worst_case_percent": 100 * width / (sum(reach) or 1.0),
        }
        for part, variance, width in zip(parts, spread, reach, strict=True)
    }
