"""Arithmetic on links, written as text: safe, since only numbers, names and the functions below are read."""

import ast
import json
import operator
from collections.abc import Callable, Mapping
from functools import cache, reduce
from math import pi
from typing import Any

import numpy as np

from rbdyn.faults import MethodError

Operator = Callable[[Any, Any], Any]

BINARY: dict[type[ast.operator], Operator] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    # Numpy's rules: what is infinite or undefined is so in the result, and neither raises nor turns complex.
    ast.Div: np.true_divide,
    ast.Pow: lambda base, power: np.asarray(base, float) ** power,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{name: getattr(np, name) for name in ("abs", "sqrt", "exp", "log", "sin", "cos", "tan", "arctan")},
    "min": lambda *values: reduce(np.minimum, values),
    "max": lambda *values: reduce(np.maximum, values),
}
CONSTANTS = {"pi": pi}
MANY = ("min", "max")  # the others take one value
LONGEST = 1000  # characters
DEEPEST = 100  # operations within each other, which a sum of as many terms has: each is a call within the last
SHOWN = 60  # characters of an expression in a message


def names_in(text: str) -> list[str]:
    """Links that an expression uses, in order. Raises MethodError for what is not such an expression."""
    tree = _parsed(text)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in called]
    return [name for name in dict.fromkeys(names) if name not in CONSTANTS]


def evaluate(text: str, sizes: Mapping[str, Any]) -> Any:
    """Value of an expression at the sizes of its links, numbers or arrays of one shape; infinite or NaN where it has none."""
    return _value(_parsed(text), sizes)


def shown(text: str) -> str:
    """An expression as messages have it: in quotes, on one line, cut."""
    return json.dumps(text if len(text) <= SHOWN else f"{text[: SHOWN - 3]}...", ensure_ascii=False)


@cache
def _parsed(text: str) -> ast.expr:
    if len(text) > LONGEST:
        raise MethodError(f"has {len(text)} characters, more than {LONGEST}; split it into links of coefficient 0")
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise MethodError("is no arithmetic expression; write it like 0.5*(bore - shaft)") from None
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
            what, known = shown(ast.unparse(node) or type(node).__name__), ", ".join(FUNCTIONS)
            raise MethodError(f"holds {what}; only + - * / **, numbers, names of links and {known} are read")
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
