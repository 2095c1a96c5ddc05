"""The closing link as a function of the sizes of the parts, with its sensitivities, worst case and root sum square.

- ``ClosingFunction``: value and sensitivities; ``interval``: least and greatest value over the limits of the parts
- ``evaluate``: arithmetic on other links, written as text. It is safe, for it accepts only numbers, names and a few functions.
- ``press_fit_factor``: change of a raceway by a press fit. Rings, shafts and housings are thick cylinders of one length in
  plane stress (Lamé), as in `rbdyn.mounting.rings`.

In a linear chain the worst case and the root sum square are sums. Otherwise the worst case is the best of all corners of the
limits and of points between them, refined where it is no corner. The root sum square uses the sensitivities at
mid-tolerance.
"""

import ast
import json
import operator
from collections.abc import Callable, Mapping, Sequence
from functools import cache, reduce
from itertools import product
from math import pi, sqrt
from typing import Any

import numpy as np

from doe.dimension_chain.links import DIGITS, Interval, Link, Mode, Part, PressFit
from rbdyn.base.arrays import Array
from rbdyn.base.faults import MethodError
from rbdyn.base.records import Record
from rbdyn.mounting.rings import Ring, interface_pressure
from rbdyn.properties.materials import Material

Operator = Callable[[Any, Any], Any]

BINARY: dict[type[ast.operator], Operator] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    # Numpy's rules: infinite and undefined values pass into the result, without an error and without complex numbers.
    ast.Div: np.true_divide,
    ast.Pow: lambda base, power: np.asarray(base, float) ** power,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("abs", "sqrt", "exp", "log", "sin", "cos", "tan", "arctan")},
    "min": lambda *values: reduce(np.minimum, values),
    "max": lambda *values: reduce(np.maximum, values),
}
CONSTANTS = {"pi": pi}
MANY = ("min", "max")  # of several values, all others of one
LONGEST = 1000  # characters
DEEPEST = 100  # nested operations, each a nested call; a sum has as many as terms
SHOWN = 60  # characters of an expression in a message


def names_in(text: str) -> list[str]:
    """Links in an expression, in order. Raises MethodError for an invalid expression."""
    tree = _syntax_tree(text)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in called]
    return [name for name in dict.fromkeys(names) if name not in CONSTANTS]


def evaluate(text: str, sizes: Mapping[str, Any]) -> Any:
    """Value of an expression at the sizes of its links, numbers or arrays of one shape; infinite or NaN where undefined."""
    return _value(_syntax_tree(text), sizes)


def quotation(text: str) -> str:
    """An expression for messages: in quotes, on one line, shortened."""
    return json.dumps(text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}...", ensure_ascii=False)


@cache
def _syntax_tree(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise MethodError(f"has {len(text)} characters, more than {LONGEST}; split it into links of coefficient 0")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise MethodError("is not an arithmetic expression; write it like 0.5*(bore - shaft)") from None
    level: list[ast.AST] = [tree]
    for _ in range(DEEPEST + 1):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
    if level:
        raise MethodError(f"nests deeper than {DEEPEST} operations; split it into links of coefficient 0")
    for node in ast.walk(tree):
        match node:
            case ast.Name() | ast.Load() | ast.UAdd() | ast.USub() | ast.UnaryOp() | ast.operator():
                read = True
            case ast.BinOp(op=sign):
                read = type(sign) in BINARY
            case ast.Constant(value=number):
                read = type(number) in (int, float)
            case ast.Call(func=ast.Name(id=name), args=[_, *more], keywords=[]):
                read = name in FUNCTIONS and (not more or name in MANY)
            case _:
                read = False
        if not read:
            raise MethodError(
                f"contains {quotation(ast.unparse(node) or type(node).__name__)}; use only + - * / **, numbers, names of links "
                f"and {', '.join(FUNCTIONS)}"
            )
    return tree


def _value(node: ast.expr, sizes: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant):
        # A whole number too long for a float is infinite, as 1e999 is.
        return float(str(node.value))
    if isinstance(node, ast.Name):
        return CONSTANTS[node.id] if node.id in CONSTANTS else sizes[node.id]
    if isinstance(node, ast.UnaryOp):
        operand = _value(node.operand, sizes)
        return -operand if isinstance(node.op, ast.USub) else operand
    if isinstance(node, ast.BinOp):
        return BINARY[type(node.op)](_value(node.left, sizes), _value(node.right, sizes))
    assert isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    return FUNCTIONS[node.func.id](*(_value(argument, sizes) for argument in node.args))


MM = 1e-3
STEP = 1e-5  # mm of the central differences that give sensitivities
LARGEST = 1e12  # of a function's value, for squares of slopes must stay finite

Sizes = Mapping[str, Any]
CORNERS = 12  # number of parts up to which all corners count; with more parts, as many random corners
BETWEEN = 512  # points between the corners


class NoValueError(MethodError):
    """Sizes at which a function has no finite value; the message names the link, the sizes and the fix."""


class Function(Record):
    """A link that follows from others, and its value at their sizes."""

    link: Link
    value: Callable[[Sizes], Any]

    def without_value(self, value: Any, sizes: Sizes) -> NoValueError:
        """Error that names the first sizes at which the value is not finite."""
        link, values = self.link, np.atleast_1d(value)
        lost = np.flatnonzero(~(np.abs(values) <= LARGEST))
        first = {name: np.broadcast_to(sizes[name], values.shape)[lost[0]] for name in _varies_with(link)}
        place = ", ".join(f"{name} = {size:.6g}" for name, size in first.items())
        what = (
            f"expression = {quotation(link.expression)}"
            if link.expression is not None
            else "press_fit or thermal_growth"
        )
        share = f" ({len(lost)} of {len(values)} assemblies tried)" if len(values) > 1 else ""
        return NoValueError(
            f'link "{link.name}": {what}: is {values[lost[0]]:g} at {place or "any size"}{share}, which gives no '
            "finite closing link; limit its argument, as max(x, 0) does, or the sizes of its links"
        )


class ClosingFunction(Record):
    """Sum of coefficient times part and of coefficient times function, in their order.

    ``arguments``: names of the parts that functions use; without functions the chain is linear.
    """

    coefficients: Mapping[str, float]
    functions: tuple[Function, ...]
    arguments: tuple[str, ...]

    @property
    def linear(self) -> bool:
        """Whether the closing link is a sum of parts alone."""
        return not self.functions

    def value(self, sizes: Sizes) -> Any:
        """Closing link, mm, at sizes of the parts, mm; numbers or arrays of one shape."""
        return sum(c * sizes[name] for name, c in self.coefficients.items()) + self.bent(sizes)

    def bent(self, sizes: Sizes) -> Any:
        """Sum of the functions alone, mm, by the sizes of ``arguments``.

        Raises NoValueError where a function has no finite value.
        """
        values = dict(sizes)
        total: Any = 0.0
        with np.errstate(all="ignore"):
            for function in self.functions:
                values[function.link.name] = value = function.value(values)
                # Written so that NaN fails too.
                if not np.max(np.abs(value)) <= LARGEST:
                    raise function.without_value(value, values)
                total = total + function.link.coefficient * value
        return total

    def sensitivities(self, sizes: Sizes) -> dict[str, float]:
        """Change of the closing link per change of each part, at these sizes."""
        self.bent(sizes)  # so that an error names these sizes and not those of a step
        slopes = dict(self.coefficients)
        for name in self.arguments:
            above, below = ({**sizes, name: sizes[name] + sign * STEP} for sign in (1, -1))
            slopes[name] += float(self.bent(above) - self.bent(below)) / (2 * STEP)
        return slopes


def closing_function(links: Sequence[Link]) -> ClosingFunction:
    """The closing link of valid links.

    Raises MethodError for a press fit of impossible diameters.
    """
    by_name = {link.name: link for link in links}
    functions = [Function(link, _function(link, by_name)) for link in links if not link.is_dimension]
    used = [name for link in links for name in _varies_with(link)]
    return ClosingFunction(
        # A thermal growth is a function; the part of its name is only its temperature.
        {link.name: link.coefficient * link.is_dimension for link in links if is_part(link)},
        tuple(functions),
        tuple(name for name in dict.fromkeys(used) if is_part(by_name[name])),
    )


def is_part(link: Link) -> bool:
    """Whether the link is a part, a dimension or the temperature of a growth."""
    return link.is_dimension or link.thermal_growth is not None


def used_links(link: Link) -> list[str]:
    """Links in the function of a link. Raises MethodError for an invalid expression."""
    if link.press_fit:
        return [link.press_fit.shaft, link.press_fit.bore]
    if link.thermal_growth:
        return [link.thermal_growth.of]
    return names_in(link.expression) if link.expression is not None else []


def middle(parts: Sequence[Part]) -> dict[str, float]:
    """Sizes of the parts at mid-tolerance, mm."""
    return {part.name: part.nominal_mm + part.middle_mm for part in parts}


def _varies_with(link: Link) -> tuple[str, ...]:
    return (*used_links(link), *([link.name] if link.thermal_growth else []))


def _function(link: Link, by_name: Mapping[str, Link]) -> Callable[[Sizes], Any]:
    if link.press_fit:
        return _press_fit(link.press_fit, by_name[link.press_fit.bore].nominal)
    if link.thermal_growth:
        name, grown = link.name, link.thermal_growth.of
        nominal = by_name[grown].nominal
        return lambda sizes: sizes[name] * sizes[grown] / nominal
    text = link.expression or ""
    return lambda sizes: evaluate(text, sizes)


def _press_fit(fit: PressFit, fit_mm: float) -> Callable[[Sizes], Any]:
    factor, change = press_fit_factor(fit, fit_mm), fit.interference_change_mm
    return lambda sizes: factor * np.maximum(sizes[fit.shaft] - sizes[fit.bore] + change, 0.0)


def press_fit_factor(fit: PressFit, fit_mm: float) -> float:
    """Change of the raceway's diameter per interference of a tight fit; positive on the outer part, else negative.

    A solid shaft in a ring of its own material widens the ring's outside by fit/outside. ``fit_mm``: diameter of the fit, the nominal
    of the bore. Raises MethodError unless shaft_bore < fit < outside and the raceway is on one of
    the two parts.
    """
    raceway_mm = fit.raceway_mm
    outer = raceway_mm > fit_mm
    # By default the raceway bounds its part.
    shaft_bore_mm = (0.0 if outer else raceway_mm) if fit.shaft_bore_mm is None else fit.shaft_bore_mm
    outside_mm = raceway_mm if fit.outside_mm is None else fit.outside_mm
    if fit.outside_mm is None and not outer:
        raise MethodError("outside_mm is missing: give the outside diameter of what holds the ring")
    if not shaft_bore_mm <= raceway_mm <= outside_mm or raceway_mm == fit_mm:
        raise MethodError(f"a raceway of {raceway_mm:g} mm is on neither part; fix its diameter")
    # The fit needs neither density nor thermal expansion.
    shaft_steel = Material(1e9 * fit.shaft_modulus_GPa, fit.shaft_poisson, 0.0)
    bore_steel = Material(1e9 * fit.bore_modulus_GPa, fit.bore_poisson, 0.0)
    shaft = Ring(MM * shaft_bore_mm / 2, MM * fit_mm / 2, shaft_steel)
    bore = Ring(MM * fit_mm / 2, MM * outside_mm / 2, bore_steel)
    pressure = interface_pressure(shaft, bore, MM)
    radius = MM * raceway_mm / 2
    if outer:
        return 2 * bore.pressure_growth(radius, inside=pressure) / MM
    return 2 * shaft.pressure_growth(radius, outside=pressure) / MM


def interval(function: ClosingFunction, parts: Sequence[Part], mode: Mode) -> Interval:
    """Least and greatest closing link, mm: by root sum square about mid-tolerance in mode "rss", else worst case."""
    return linear_interval(function, parts, mode) if mode == "rss" or function.linear else _worst_case(function, parts)


def linear_interval(function: ClosingFunction, parts: Sequence[Part], mode: Mode) -> Interval:
    """The interval of the closing link linearised at mid-tolerance, exact for a linear chain."""
    sizes = middle(parts)
    centre, slopes = float(function.value(sizes)), function.sensitivities(sizes)
    half = total([abs(slopes[part.name]) * part.tolerance_mm for part in parts], mode) / 2
    return round(centre - half, DIGITS), round(centre + half, DIGITS)


def total(tolerances: Sequence[float], mode: Mode) -> float:
    """Sum of tolerances, or the root of the sum of their squares in mode "rss"."""
    return sqrt(sum(t * t for t in tolerances)) if mode == "rss" else sum(tolerances)


def _worst_case(function: ClosingFunction, parts: Sequence[Part]) -> Interval:
    """Worst case by a search over the parts in functions, with the other parts at the limits of their sign."""
    bent = [part for part in parts if part.name in function.arguments]
    straight = [part for part in parts if part.name not in function.arguments]
    ends = []
    for sign in (1, -1):
        end = 0.0
        for part in straight:
            coefficient = function.coefficients[part.name]
            end += coefficient * (part.nominal_mm + (part.lower_mm if sign * coefficient > 0 else part.upper_mm))
        ends.append(end + sign * _least(function, bent, sign))
    return round(ends[0], DIGITS), round(ends[1], DIGITS)


def _least(function: ClosingFunction, parts: list[Part], sign: int) -> float:
    """Least value of ``sign`` times the sum of the ``parts`` and the functions."""
    varying = [part for part in parts if part.tolerance_mm > 0]
    nominals = {part.name: np.asarray(part.nominal_mm + part.lower_mm) for part in parts}

    def value(places: Array) -> Array:
        """Values at places (n, k) from 0 to 1 between the limits."""
        sizes: dict[str, Array] = dict(nominals)
        for part, place in zip(varying, places.T, strict=True):
            sizes[part.name] = part.nominal_mm + part.lower_mm + part.tolerance_mm * place
        shares = sum(function.coefficients[part.name] * sizes[part.name] for part in parts)
        return np.broadcast_to(sign * (shares + function.bent(sizes)), len(places))

    generator = np.random.default_rng(0)
    if len(varying) <= CORNERS:
        corners = np.array(list(product((0.0, 1.0), repeat=len(varying)))).reshape(2 ** len(varying), len(varying))
    else:
        corners = generator.integers(0, 2, (2**CORNERS, len(varying))).astype(float)
    at_corners = value(corners)
    lowest = float(at_corners.min())
    if not varying:
        return lowest
    inside = generator.random((BETWEEN, len(varying)))
    at_inside = value(inside)
    if len(varying) <= CORNERS and at_inside.min() >= lowest:
        return lowest
    from scipy.optimize import minimize

    start = inside[at_inside.argmin()] if at_inside.min() < lowest else corners[at_corners.argmin()]
    scale = max(part.tolerance_mm for part in varying)
    optimum = minimize(lambda place: float(value(place[None, :])[0]) / scale, start, bounds=[(0.0, 1.0)] * len(varying))
    return min(lowest, scale * float(optimum.fun))
