"""Formulas in the rows of makers: arithmetic and conditions with named values. No other Python is allowed."""

import ast
from collections.abc import Callable, Sequence
from string import Formatter
from typing import Any

import numpy as np

from vigil.assets.kernel.arrange import egg, inscribed, shrunk
from vigil.assets.kernel.shapes import rounded_rectangle
from vigil.errors import did_you_mean

Names = dict[str, Any]
"""Name -> value, for the names that the formulas of a row use."""
Known = frozenset[str]
"""Names that have a value at some place in a row."""


def points(*columns: Any) -> np.ndarray:
    """Return points (n, 3) or (n, 2); each of `columns`, an array or a number, gives one coordinate of all points."""
    found = np.empty((max(map(np.size, columns)), len(columns)))
    for index, column in enumerate(columns):
        found[:, index] = column
    return found


def lowest(levels: Sequence[float], low: float, high: float, other: float) -> float:
    """Return the lowest of `levels` between two heights (m); `other` if there is none."""
    return next((level for level in levels if low < level < high), other)


_OF_NUMPY = (
    "arctan2", "clip", "cos", "degrees", "flip", "hypot", "interp", "linspace", "maximum", "pi", "radians", "sin",
    "sqrt",
)  # fmt: skip
FUNCTIONS: Names = {name: getattr(np, name) for name in _OF_NUMPY} | {"oblong": rounded_rectangle}
FUNCTIONS |= {each.__name__: each for each in (egg, inscribed, lowest, max, min, points, round, shrunk)}
"""Name -> function or constant that formulas may use."""
_NODES = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Call, ast.Name, ast.Constant,
    ast.Tuple, ast.operator, ast.unaryop, ast.boolop, ast.cmpop, ast.expr_context,
)  # fmt: skip


def formula(text: str, known: Known) -> str:
    """Return a formula as a Python expression. Raises ValueError if it has more than arithmetic with known names."""
    try:
        tree = ast.parse(text, mode="eval")
    except SyntaxError as error:
        raise ValueError(f"{text!r} is not a formula: {error.msg}") from None
    for node in ast.walk(tree):
        if not isinstance(node, _NODES):
            raise ValueError(f"{text!r} is not a formula: {type(node).__name__} is not allowed")
        if isinstance(node, ast.Name) and node.id not in known and node.id not in FUNCTIONS:
            raise ValueError(f"{text!r} uses {node.id!r}, which has no value here.{did_you_mean(node.id, known)}")
    return f"({text})"


def text(raw: Any, known: Known) -> str:
    """Return a Python expression for a text with names in braces; "{name}" alone gives the name's value as it is."""
    if not isinstance(raw, str):
        raise ValueError(f"{raw!r} is not a text")
    fields = [field for _, field, _, _ in Formatter().parse(raw) if field is not None]
    for field in fields:
        if field not in known:
            raise ValueError(f"{raw!r} names {field!r}, which has no value here.{did_you_mean(field, known)}")
    return fields[0] if fields and raw == f"{{{fields[0]}}}" else f"f{raw!r}" if fields else repr(raw)


def compiled(expression: str) -> Callable[[Names], Any]:
    """Return a function that computes an expression from the values that it is given and the values in `GLOBALS`."""
    code = compile(expression, "<row>", "eval")
    return lambda names: eval(code, names)  # nothing but arithmetic is left


GLOBALS: Names = {"__builtins__": {}, **FUNCTIONS}
