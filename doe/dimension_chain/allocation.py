"""Allocation: tolerances of the parts from the limits of the closing link.

"equal" gives all parts that are not fixed the same tolerance, "iso286" one in proportion to its tolerance unit. "cost" gives
the cheapest tolerances by the curves of the links. Together they fill the limits by worst case, root sum square, or a
yield. For a yield, or in a chain with functions, one factor scales the tolerances of the linear rule until they fill the
limits. The nominal of one part is moved so that the closing link's maximum is at its upper limit. For a yield its
mean is midway between the limits, or the middle of its tails in a chain with functions. Last, all sizes are rounded to the
resolution of the drawing and judged again; the widest tolerances are narrowed until the rounded parts keep the limits.

The cheapest tolerances are the Lagrange optimum of cost curves a + b/T^k with one multiplier L. By worst case
T = (k b/(L |c|))^(1/(k+1)) with sum |c| T = W. By root sum square T = (k b/(2 L c^2))^(1/(k+2)) with sum c^2 T^2 = W^2. Each
tolerance is limited to the narrowest of its process.

Source: Chase and Greenwood, Design issues in mechanical tolerance analysis (1988).
"""

from bisect import bisect_left
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from math import ceil, copysign, exp, inf, sqrt

import numpy as np

from doe.dimension_chain import links
from doe.dimension_chain.closing import ClosingFunction, NoValueError, closing_function, interval, middle, total
from doe.dimension_chain.yields import Assemblies, closing_moments, draw, exact_shares, standard_error
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record
from rbdyn.properties.tolerances import grade_tolerances, tolerance_unit

SAMPLES = 100_000  # assemblies for a yield in a chain with functions
HALVINGS = 26
NEWTON_STEPS = 30
WANDER = 0.5  # share of the nominal beyond which the steps of Newton have lost the solution
LEAST_MOVES = 1000  # steps of a move of a nominal in a drawing without a resolution
WIDEST = 64.0  # times the tolerances of the linear rule

Tolerances = Mapping[str, float]
Grades = Mapping[str, str]
SPAN = 700.0  # of the logarithm of the multiplier, the range of a float


class Allocation(Record):
    """The search for tolerances of a valid chain."""

    chain: links.Chain

    @cached_property
    def function(self) -> ClosingFunction:
        """The closing link of the chain."""
        return closing_function(self.chain.link)

    @property
    def mode(self) -> links.Mode:
        """Criterion by which the tolerances fill the limits."""
        return self.chain.allocate.mode

    @property
    def resolution(self) -> float:
        """Resolution of the drawing, mm."""
        return self.chain.allocate.resolution_mm

    @property
    def adjusted(self) -> links.Link:
        """The link whose nominal is moved."""
        free = {link.name: link for link in self.chain.free if link.coefficient or link.name in self.function.arguments}
        name = self.chain.allocate.adjust
        ranks = {1: 0, -1: 1, 0: 2}
        return free[name] if name else min(free.values(), key=lambda link: ranks[int(np.sign(link.coefficient))])

    @cached_property
    def slopes(self) -> dict[str, float]:
        """Change of the closing link per unit of each free link, at the stated nominals where the coefficient is 0."""
        by_coefficient = {link.name: link.coefficient for link in self.chain.free}
        if all(by_coefficient.values()):
            return by_coefficient
        by_name = {link.name: link for link in self.chain.link}
        parts = [
            links.stated_part(link, by_name) for link in self.chain.link if link.is_dimension or link.thermal_growth
        ]
        slopes = self.function.sensitivities(middle(parts))
        return {name: coefficient or slopes[name] for name, coefficient in by_coefficient.items()}

    def parts(self, tolerances: Tolerances, grades: Grades | None = None) -> list[links.Part]:
        """All parts, with ``tolerances`` in mm of those that are not fixed, and with one nominal moved.

        Raises MethodError where no nominal of that part brings the closing link to its limits.
        """
        return self._adjusted_parts(self._parts(tolerances, grades or {}))

    def _parts(self, tolerances: Tolerances, grades: Grades) -> list[links.Part]:
        """All parts at their stated nominals."""
        by_name = {link.name: link for link in self.chain.link}
        return [
            links.allocated_part(link, tolerances[link.name], grades.get(link.name), self.slopes[link.name])
            if link.name in tolerances
            else links.stated_part(link, by_name)
            for link in self.chain.link
            if link.is_dimension or link.thermal_growth
        ]

    def _adjusted_parts(self, parts: list[links.Part]) -> list[links.Part]:
        """The parts with one nominal moved. Raises MethodError as ``parts``."""
        stated, moved, distance = parts, self.adjusted.name, 0.0
        # One step is exact unless a function uses the moved part; then these are steps of Newton's method.
        for _ in range(NEWTON_STEPS):
            try:
                slope = self.function.sensitivities(middle(parts))[moved]
                step = self._missing(parts) / slope if slope else inf
            except NoValueError:
                # After a step, a missing value is no fault of the stated nominal.
                if distance:
                    break
                raise
            if not abs(step) < inf:
                break
            nominals = {part.name: round(part.nominal_mm + step, links.DIGITS) for part in parts if part.name == moved}
            parts = [links.at_nominal(part, nominals.get(part.name, part.nominal_mm)) for part in parts]
            if moved not in self.function.arguments or abs(step) < links.SLACK:
                return parts
            distance += abs(step)
            if not distance <= WANDER * abs(self.adjusted.nominal):
                break
        # A fit that is loose changes nothing: the closing link may be within its limits and reach neither.
        if moved in self.function.arguments and self.fits(stated):
            return stated
        raise MethodError("no nominal of this part brings the closing link to its limits; name another part")

    def rounded_parts(self, tolerances: Tolerances, grades: Grades | None = None) -> list[list[links.Part]]:
        """The parts as the drawing states them, with the moved nominal on the steps next to its place, the nearer first."""
        parts = [links.rounded_part(part, self.resolution) for part in self._parts(tolerances, grades or {})]
        parts = self._adjusted_parts(parts)
        moved = next(part for part in parts if part.name == self.adjusted.name)
        candidates = links.places(moved, self.resolution)
        return [[self._seat(place if part.name == moved.name else part) for part in parts] for place in candidates]

    def _seat(self, part: links.Part) -> links.Part:
        """An allocated seat, which counts by its fit only, with its stated nominal; other parts as they are."""
        seat = part.origin == "allocated" and part.coefficient == 0 and part.name in self.seats
        return links.seat_part(part) if seat else part

    @cached_property
    def seats(self) -> dict[str, bool]:
        """Links of press fits by name, and whether each is the inner one."""
        fits = [link.press_fit for link in self.chain.link if link.press_fit]
        return {fit.bore: False for fit in fits} | {fit.shaft: True for fit in fits}

    def narrowest(self) -> list[links.Part]:
        """The parts with the narrowest tolerances that drawing and processes carry; those that fit, if any do."""
        candidates = self.rounded_parts(self.least)
        return next((parts for parts in candidates if self.fits(parts)), candidates[0])

    @cached_property
    def least(self) -> dict[str, float]:
        """Narrowest tolerance, mm, of each free link."""
        return {link.name: links.least_tolerance(link, self.resolution) for link in self.chain.free}

    def fits(self, parts: list[links.Part]) -> bool:
        """Whether parts keep the limits in the mode of the chain."""
        if self.mode == "yield":
            return self.sure_yield(parts) >= self.chain.allocate.target_yield
        limits, (low, high) = self.chain.closing_link, interval(self.function, parts, self.mode)
        return limits.lower_mm - links.SLACK <= low and high <= limits.upper_mm + links.SLACK

    def sure_yield(self, parts: list[links.Part]) -> float:
        """Yield with each part's own distribution, by convolution or, with functions, two errors below a Monte Carlo."""
        limits = self.chain.closing_link
        if self.function.linear:
            return 1 - sum(exact_shares(self.function, parts, limits))
        share = self._assemblies(parts).yields["as_given"]
        return share - 2 * standard_error(share, SAMPLES)

    def tails(self, parts: list[links.Part]) -> links.Interval:
        """Closing links, mm, with the target yield between them and equal tails, by Monte Carlo."""
        tail = (1 - self.chain.allocate.target_yield) / 2
        low, high = np.quantile(self._assemblies(parts).values, (tail, 1 - tail))
        return float(low), float(high)

    def allocated(self) -> list[links.Part] | None:
        """Parts whose tolerances fill the limits, as the drawing states them; None where even the narrowest do not fit."""
        narrowest = self.narrowest()
        if not self.fits(narrowest):
            return None
        rule = self.linear_rule()
        scale = 1.0 if self.function.linear and self.mode != "yield" else self._scale(rule)
        tolerances = {name: max(scale * t, self.least[name]) for name, t in rule.items()}
        grades: dict[str, str] = {}
        if self.chain.allocate.grades:
            tolerances, grades = self._graded(tolerances)
        return self._classed(self._narrowed(tolerances, grades) or narrowest)

    def moved(self) -> list[links.Part] | None:
        """Stated parts with the least move of one nominal, in steps of the drawing, that keeps the limits; None where none does."""
        stated, name = links.stated_parts(self.chain.link), self.adjusted.name
        try:
            (move,) = (part.moved_mm for part in self._adjusted_parts(stated) if part.name == name)
        except MethodError:
            return None
        step = self.resolution or abs(move) / LEAST_MOVES

        def at(count: int) -> list[links.Part]:
            shift = copysign(count * step, move)
            return [
                links.at_nominal(part, round(part.nominal_mm + shift, links.DIGITS)) if part.name == name else part
                for part in stated
            ]

        counts = range(1, ceil(abs(move) / step - links.SLACK) + 1) if move else range(0)
        place = bisect_left(counts, True, key=lambda count: self.fits(at(count)))
        return at(counts[place]) if place < len(counts) else None

    def _classed(self, parts: list[links.Part]) -> list[links.Part]:
        """The parts, allocated seats with the class of ISO 286 within their limits."""
        return [
            replace(part, iso_class=links.class_within(part, self.seats[part.name]) or None)
            if part.origin == "allocated" and part.name in self.seats
            else part
            for part in parts
        ]

    def _narrowed(self, tolerances: dict[str, float], grades: dict[str, str]) -> list[links.Part] | None:
        """Rounded parts that keep the limits, the widest tolerances narrowed until they do; None where all are narrowest."""
        while True:
            try:
                candidates = self.rounded_parts(tolerances, grades)
            except MethodError:
                # The tolerances are too wide for a move of the nominal.
                candidates = []
            for parts in candidates:
                if self.fits(parts):
                    return parts
            wide = [name for name, tolerance in tolerances.items() if tolerance > self.least[name]]
            if not wide:
                return None
            widest = max(wide, key=lambda name: abs(self.slopes[name]) * tolerances[name])
            tolerances[widest] = links.narrower(tolerances[widest], self.least[widest], self.resolution)
            grades.pop(widest, None)

    def linear_rule(self) -> dict[str, float]:
        """Tolerances, mm, that fill the limits of the linear chain; for a yield by root sum square.

        Raises MethodError where a part has no effect.
        """
        rule, free = self.chain.allocate, self.chain.free
        mode: links.Mode = "worst_case" if rule.mode == "worst_case" else "rss"
        bare = self.parts({link.name: 0.0 for link in free})
        slopes = self.function.sensitivities(middle(bare))
        fixed = total([abs(slopes[part.name]) * part.tolerance_mm for part in bare], mode)
        width = self.chain.width_mm
        # A nonlinear chain may have more room than its tangent: any positive width can start the search.
        budget = sqrt(max(width**2 - fixed**2, 0.0)) if mode == "rss" else width - fixed
        budget = budget if budget > 0 else width
        idle = [link.name for link in free if slopes[link.name] == 0]
        if idle and (rule.method == "cost" or len(idle) == len(free)):
            raise MethodError(f'"{idle[0]}" does not change the closing link; fix it')
        if rule.method == "cost":
            curves = [link.cost for link in free if link.cost is not None]
            try:
                widths = cheapest(curves, [slopes[link.name] for link in free], budget, mode)
            except MethodError:
                # A yield may have room where the root sum square has none.
                widths = [self.least[link.name] for link in free]
            return {link.name: t for link, t in zip(free, widths, strict=True)}
        iso = rule.method == "iso286"
        weights = {link.name: tolerance_unit(link.nominal) if iso else 1.0 for link in free}
        share = budget / total([abs(slopes[name]) * weight for name, weight in weights.items()], mode)
        return {name: share * weight for name, weight in weights.items()}

    def _scale(self, rule: Tolerances) -> float:
        """Factor on the tolerances at which they just keep the limits."""

        def fits_at(scale: float) -> bool:
            try:
                return self.fits(self.parts({name: scale * t for name, t in rule.items()}))
            except MethodError:
                # The tolerances are too wide for the functions, or for a move of the nominal.
                return False

        low, high = 0.0, 1.0
        while high < WIDEST and fits_at(high):
            low, high = high, 2 * high
        for _ in range(HALVINGS):
            half = (low + high) / 2
            low, high = (half, high) if fits_at(half) else (low, half)
        return low

    def _graded(self, tolerances: Tolerances) -> tuple[dict[str, float], dict[str, str]]:
        """Each tolerance, mm, at the widest grade within it, and these grades; one finer than IT01 keeps its width."""
        free = {link.name: link for link in self.chain.free}
        ladders = {name: list(grade_tolerances(link.nominal).items()) for name, link in free.items()}
        room = {name: tolerances[name] + links.SLACK for name in ladders}
        steps = {name: sum(width <= room[name] for _, width in ladder) - 1 for name, ladder in ladders.items()}

        def choice(steps: Mapping[str, int]) -> tuple[dict[str, float], dict[str, str]]:
            grades = {name: ladders[name][step] for name, step in steps.items() if step >= 0}
            widths = {name: grades[name][1] if name in grades else t for name, t in tolerances.items()}
            return widths, {name: grade for name, (grade, _) in grades.items()}

        while self.chain.allocate.spend_slack:
            open_ones = [name for name, step in steps.items() if 0 <= step < len(ladders[name]) - 1]
            wider = [name for name in open_ones if self._fits_exactly(*choice({**steps, name: steps[name] + 1}))]
            if not wider:
                break
            best = max(wider, key=lambda name: self._worth(free[name], ladders[name], steps[name]))
            steps[best] += 1
        return choice(steps)

    def _fits_exactly(self, tolerances: Tolerances, grades: Grades) -> bool:
        """Whether tolerances fit before the drawing rounds them, so that grades do not depend on its resolution."""
        try:
            return self.fits(self.parts(tolerances, grades))
        except MethodError:
            return False

    def _worth(self, link: links.Link, ladder: list[tuple[str, float]], step: int) -> tuple[float, float]:
        """Value of the next wider grade: the saved cost, or without a curve the fineness of the present grade."""
        narrow, wide = ladder[step][1], ladder[step + 1][1]
        if link.cost is None:
            return 0.0, -step
        return link.cost.b * (narrow**-link.cost.k - wide**-link.cost.k), -step

    def _missing(self, parts: list[links.Part]) -> float:
        """Shift of the closing link to its target, mm.

        Of a moved part with deviations on both sides that is the middle of the limits. One with a limit of size for its nominal
        gets that from the upper limit: 9.29 0/-0.004.
        """
        limits = self.chain.closing_link
        target = (limits.lower_mm + limits.upper_mm) / 2
        if self.mode != "yield":
            ends = interval(self.function, parts, self.mode)
            return target - sum(ends) / 2 if self.adjusted.position in links.TWO_SIDED else limits.upper_mm - ends[1]
        if self.function.linear:
            return target - closing_moments(self.function, parts, None)[0]
        return target - sum(self.tails(parts)) / 2

    def _assemblies(self, parts: list[links.Part]) -> Assemblies:
        seed, limits = self.chain.monte_carlo.seed, self.chain.closing_link
        return draw(self.function, parts, limits, samples=SAMPLES, seed=seed, laws=())


def cheapest(curves: Sequence[links.Cost], slopes: Sequence[float], width: float, mode: links.Mode) -> list[float]:
    """Tolerances, mm, of least cost whose worst case or root sum square is ``width``; slopes must not be zero.

    Raises MethodError, with the required width, where the narrowest fill more.
    """

    from scipy.optimize import brentq

    def tolerance(curve: links.Cost, slope: float, log_multiplier: float) -> float:
        power, weight = (curve.k + 2, 2 * slope**2) if mode == "rss" else (curve.k + 1, abs(slope))
        optimum = (curve.k * curve.b / weight) ** (1 / power) * exp(-log_multiplier / power)
        return max(optimum, curve.narrowest_mm)

    def tolerances(log_multiplier: float) -> list[float]:
        return [tolerance(curve, slope, log_multiplier) for curve, slope in zip(curves, slopes, strict=True)]

    def excess(log_multiplier: float) -> float:
        shares = [abs(s) * t for s, t in zip(slopes, tolerances(log_multiplier), strict=True)]
        return total(shares, mode) / width - 1

    if excess(SPAN) > 0:
        needed = width * (1 + excess(SPAN))
        raise MethodError(f"the narrowest tolerances of the cost curves fill {needed:.4f} mm of {width:.4f} mm")
    return tolerances(brentq(excess, -SPAN / 4, SPAN, xtol=1e-13, rtol=1e-14))


def total_cost(curves: Sequence[links.Cost], tolerances: Sequence[float]) -> float:
    """Cost of all tolerances, mm."""
    return sum(curve.a + curve.b / t**curve.k for curve, t in zip(curves, tolerances, strict=True))
