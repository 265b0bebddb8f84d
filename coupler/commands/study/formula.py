"""Formulas of names of the case: "9/16 * joints.strength * joints.opening_at_failure", in SI.

Numbers, + - * / **, brackets, pi, and sqrt, exp, log, sin, cos, tan, tanh; a name is a key of the effective case, with
places in lists in brackets: structure.block[0].size[2]. Nothing else is evaluated.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping

import numpy as np

from coupler.program.errors import ExitCode, SurgebreakError, briefly, did_you_mean


class BadFormula(SurgebreakError):
    """A reference that cannot be evaluated."""

    exit_code = ExitCode.BAD_CASE


LONGEST = 1000
"""Largest number of characters of a formula."""
_OPERATIONS = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
_NAMES = ("sqrt", "exp", "log", "sin", "cos", "tan", "tanh")
_FUNCTIONS = {name: getattr(math, name) for name in _NAMES}
_OF_COLUMNS = {name: getattr(np, name) for name in (*_NAMES, "abs")}


def evaluate(formula: str | float, case: dict) -> float:
    """The number that a formula has in an effective case; numbers are themselves. Raises BadFormula."""
    if not isinstance(formula, str):
        return float(formula)
    found = _evaluated(formula, case, _FUNCTIONS)
    try:
        return float(found)
    except (TypeError, ValueError) as error:
        raise BadFormula(f"'{formula}': {error}") from error


def evaluate_columns(formula: str, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """The column (n,) that a formula of columns (n,) has, row by row; with abs as well. Raises BadFormula."""
    with np.errstate(all="ignore"):  # a root of a negative number is NaN there, and reported by who reads it
        found = _evaluated(formula, dict(columns), _OF_COLUMNS)
    size = len(next(iter(columns.values())))
    return np.broadcast_to(np.asarray(found, float), (size,))


def _evaluated(formula: str, names: dict, functions: dict[str, Callable]):
    if len(formula) > LONGEST:
        raise BadFormula(
            f"{briefly(formula)}: a formula of {len(formula)} characters; at most {LONGEST} are read"
        )
    try:
        return _value(ast.parse(formula, mode="eval").body, names, formula, functions)
    except SyntaxError as error:
        raise BadFormula(f"'{formula}': not a formula: {error.msg}") from error
    except (ArithmeticError, ValueError, TypeError) as error:
        raise BadFormula(f"'{formula}': {error}") from error
    except (RecursionError, MemoryError) as error:
        raise BadFormula(f"'{formula}': too many brackets or signs inside of one another") from error


def _value(node: ast.expr, case: dict, formula: str, functions: dict[str, Callable]):
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)  # powers of whole numbers could grow without end
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        sides = (_value(side, case, formula, functions) for side in (node.left, node.right))
        return _OPERATIONS[type(node.op)](*sides)
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATIONS:
        return _OPERATIONS[type(node.op)](_value(node.operand, case, formula, functions))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in functions:
        return functions[node.func.id](*(_value(inner, case, formula, functions) for inner in node.args))
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if isinstance(node, ast.Name | ast.Attribute | ast.Subscript):
        return _named(node, case, formula)
    raise BadFormula(
        f"'{formula}': {ast.unparse(node)} is neither a number, an operation nor a name of the case; functions: "
        f"{', '.join(functions)}"
    )


def _named(node: ast.expr, case: dict, formula: str):
    """The value under a name of the case."""
    if isinstance(node, ast.Name):
        above, step = case, node.id
    elif isinstance(node, ast.Attribute):
        above, step = _named(node.value, case, formula), node.attr
    else:
        above, step = _named(node.value, case, formula), _place(node.slice, formula)
    known = list(above) if isinstance(above, dict) else list(range(len(above))) if _is_list(above) else []
    if step not in known:
        hint = did_you_mean(step, known) if isinstance(step, str) else ""
        raise BadFormula(f"'{formula}': the case has no {ast.unparse(node)}{hint}")
    return above[step]


def _is_list(value) -> bool:
    return isinstance(value, list | tuple)


def _place(node: ast.expr, formula: str) -> int:
    if isinstance(node, ast.Constant) and isinstance(node.value, int):
        return node.value
    raise BadFormula(f"'{formula}': places in lists are whole numbers")
