"""Cheapest tolerances: the Lagrange optimum of cost curves a + b/T^k that together fill the closing link.

With one multiplier L the optimum is T = (k b/(L |c|))^(1/(k+1)) in worst case, sum |c| T = W, and
T = (k b/(2 L c^2))^(1/(k+2)) by root sum square, sum c^2 T^2 = W^2, each kept between the narrowest and the widest that
its process gives (Chase and Greenwood, Design issues in mechanical tolerance analysis, 1988).
"""

from collections.abc import Sequence
from math import exp, inf

from doe.dimension_chain.intervals import total
from doe.dimension_chain.links import Cost, Mode

SPAN = 700.0  # of the logarithm of the multiplier: all that a float holds


def cheapest(curves: Sequence[Cost], slopes: Sequence[float], width: float, mode: Mode) -> list[float]:
    """Tolerances, mm, of least cost whose worst case or root sum square is ``width``; slopes must not be zero.

    Where even the widest fill less than the width, these. Raises ValueError, with the width that is needed, where
    even the narrowest fill more.
    """

    from scipy.optimize import brentq

    def tolerance(curve: Cost, slope: float, log_multiplier: float) -> float:
        power, weight = (curve.k + 2, 2 * slope**2) if mode == "rss" else (curve.k + 1, abs(slope))
        wish = (curve.k * curve.b / weight) ** (1 / power) * exp(-log_multiplier / power)
        return min(max(wish, curve.narrowest_mm), curve.widest_mm or inf)

    def tolerances(log_multiplier: float) -> list[float]:
        return [tolerance(curve, slope, log_multiplier) for curve, slope in zip(curves, slopes, strict=True)]

    def excess(log_multiplier: float) -> float:
        shares = [abs(s) * t for s, t in zip(slopes, tolerances(log_multiplier), strict=True)]
        return total(shares, mode) / width - 1

    if excess(SPAN) > 0:
        needed = width * (1 + excess(SPAN))
        what = f"the narrowest tolerances of the cost curves fill {needed:.4f} mm of {width:.4f} mm"
        raise ValueError(f"{what}; widen the limits or let a process go narrower")
    if excess(-SPAN / 4) < 0:
        return tolerances(-SPAN / 4)
    return tolerances(brentq(excess, -SPAN / 4, SPAN, xtol=1e-13, rtol=1e-14))


def total_cost(curves: Sequence[Cost], tolerances: Sequence[float]) -> float:
    """Cost of all tolerances, mm."""
    return sum(curve.a + curve.b / t**curve.k for curve, t in zip(curves, tolerances, strict=True))
