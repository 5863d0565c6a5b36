"""Formulas in rows of makers: arithmetic and conditions over named values, without any other Python."""

import ast
from collections.abc import Callable, Collection
from typing import Any

import numpy as np

Names = dict[str, Any]
"""Values that a formula may use, by name."""
Value = Callable[[Names], Any]
"""Function that computes one value from named values."""


def points(*columns: Any) -> np.ndarray:
    """Return points (n, 3) or (n, 2) whose coordinates are arrays or numbers."""
    return np.stack(np.broadcast_arrays(*columns), axis=-1)


FUNCTIONS: dict[str, Any] = {
    **{
        name: getattr(np, name)
        for name in ("arctan2", "clip", "cos", "degrees", "flip", "interp", "linspace", "maximum", "pi")
    },
    **{name: getattr(np, name) for name in ("radians", "sin", "sqrt")},
    "max": max,
    "min": min,
    "points": points,
    "round": round,
}
_NODES = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.BoolOp, ast.Compare, ast.IfExp, ast.Call, ast.Name, ast.Constant,
    ast.Tuple, ast.operator, ast.unaryop, ast.boolop, ast.cmpop, ast.expr_context,
)  # fmt: skip


def formula(text: str, known: Collection[str]) -> Value:
    """Return the function that computes a formula. Raises ValueError if it is not arithmetic over known names."""
    try:
        tree = ast.parse(text, mode="eval")
    except SyntaxError as error:
        raise ValueError(f"{text!r} is not a formula: {error.msg}") from None
    for node in ast.walk(tree):
        if not isinstance(node, _NODES):
            raise ValueError(f"{text!r} is not a formula: {type(node).__name__} is not allowed")
        if isinstance(node, ast.Name) and node.id not in known and node.id not in FUNCTIONS:
            raise ValueError(f"{text!r} uses {node.id!r}, which is not known; known are {', '.join(sorted(known))}")
    code = compile(tree, "<formula>", "eval")
    return lambda names: eval(code, _GLOBALS, names)  # only arithmetic is left


_GLOBALS = {"__builtins__": {}, **FUNCTIONS}
