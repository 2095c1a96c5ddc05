"""Arithmetic on links, written as text: safe, since only numbers, names and the functions below are read."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from functools import cache, reduce
from math import pi
from typing import Any

import numpy as np

Operator = Callable[[Any, Any], Any]

BINARY: dict[type[ast.operator], Operator] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": np.abs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "arctan": np.arctan,
    "min": lambda *values: reduce(np.minimum, values),
    "max": lambda *values: reduce(np.maximum, values),
}
CONSTANTS = {"pi": pi}
MANY = ("min", "max")  # the others take one value


def names_in(text: str) -> list[str]:
    """Links that an expression uses, in order. Raises ValueError for what is not such an expression."""
    tree = _parsed(text)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names = [node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in called]
    return [name for name in dict.fromkeys(names) if name not in CONSTANTS]


def evaluate(text: str, sizes: Mapping[str, Any]) -> Any:
    """Value of an expression at the sizes of its links, numbers or arrays of one shape."""
    return _value(_parsed(text), sizes)


@cache
def _parsed(text: str) -> ast.expr:
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError:
        raise ValueError("is no arithmetic expression; write it like 0.5*(bore - shaft)") from None
    for node in ast.walk(tree):
        known = (
            isinstance(node, ast.Name | ast.Load | ast.UAdd | ast.USub | ast.UnaryOp)
            or (isinstance(node, ast.BinOp) and type(node.op) in BINARY)
            or isinstance(node, ast.operator)
            or (isinstance(node, ast.Constant) and type(node.value) in (int, float))
            or (
                isinstance(node, ast.Call)
                and isinstance(node.func, ast.Name)
                and node.func.id in FUNCTIONS
                and (len(node.args) == 1 or (node.args and node.func.id in MANY))
                and not node.keywords
            )
        )
        if not known:
            raise ValueError(
                f"holds {ast.unparse(node) or type(node).__name__!r}; only + - * / **, numbers, names of links and "
                f"{', '.join(FUNCTIONS)} are read"
            )
    return tree


def _value(node: ast.expr, sizes: Mapping[str, Any]) -> Any:
    if isinstance(node, ast.Constant):
        return node.value
    if isinstance(node, ast.Name):
        return CONSTANTS[node.id] if node.id in CONSTANTS else sizes[node.id]
    if isinstance(node, ast.UnaryOp):
        operand = _value(node.operand, sizes)
        return -operand if isinstance(node.op, ast.USub) else operand
    if isinstance(node, ast.BinOp):
        return BINARY[type(node.op)](_value(node.left, sizes), _value(node.right, sizes))
    assert isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    return FUNCTIONS[node.func.id](*(_value(argument, sizes) for argument in node.args))
