"""Formulas of names of the case: "9/16 * joints.strength * joints.opening_at_failure", in SI.

Numbers, + - * / **, brackets, pi, and sqrt, exp, log, sin, cos, tan, tanh; a name is a key of the effective case, with
places in lists in brackets: structure.block[0].size[2]. Nothing else is evaluated.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, cast

import numpy as np

from coupler.program.errors import ExitCode, SurgebreakError, briefly, did_you_mean


class BadFormula(SurgebreakError):
    """A formula that cannot be evaluated."""

    exit_code = ExitCode.BAD_CASE


LONGEST = 1000
"""Largest number of characters of a formula."""
_OPERATIONS: dict[type[ast.AST], Callable] = {
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
_Named = Callable[[ast.expr], Any]
"""What stands under a name that is used in a formula."""


def evaluate(formula: str | float, case: dict) -> float:
    """The number that a formula has in an effective case; numbers are themselves. Raises BadFormula."""
    if not isinstance(formula, str):
        return float(formula)
    found = _evaluated(formula, partial(_value_of, case=case, formula=formula), _FUNCTIONS)
    try:
        return float(found)
    except (TypeError, ValueError) as error:
        raise BadFormula(f"'{formula}': {error}") from error


def evaluate_columns(formula: str, columns: Mapping[str, np.ndarray]) -> np.ndarray:
    """The column (n,) that a formula of columns (n,) has, row by row; with abs as well. Raises BadFormula."""
    with np.errstate(all="ignore"):  # a root of a negative number is NaN there, and reported by who reads it
        named = partial(_value_of, case=dict(columns), formula=formula)
        found = _evaluated(formula, named, _OF_COLUMNS)
    size = len(next(iter(columns.values())))
    return np.broadcast_to(np.asarray(found, float), (size,))


def names_used(formula: str, of_columns: bool = False) -> list[str]:
    """The names that a formula uses, before anything is known of their values; of_columns: for `evaluate_columns`.
    Raises BadFormula where it is none, whatever the names stand for."""
    found = []

    def named(node: ast.expr) -> float:
        found.append(ast.unparse(node))
        return math.nan

    with np.errstate(all="ignore"):
        _evaluated(formula, named, _OF_COLUMNS if of_columns else _FUNCTIONS)
    return found


def _evaluated(formula: str, named: _Named, functions: dict[str, Callable]) -> Any:
    if len(formula) > LONGEST:
        raise BadFormula(
            f"{briefly(formula)}: a formula of {len(formula)} characters; at most {LONGEST} are read"
        )
    try:
        return _value(ast.parse(formula, mode="eval").body, named, formula, functions)
    except SyntaxError as error:
        raise BadFormula(f"'{formula}': not a formula: {error.msg}") from error
    except (ArithmeticError, ValueError, TypeError) as error:
        raise BadFormula(f"'{formula}': {error}") from error
    except (RecursionError, MemoryError) as error:
        raise BadFormula(f"'{formula}': too many brackets or signs inside of one another") from error


def _value(node: ast.expr, named: _Named, formula: str, functions: dict[str, Callable]) -> Any:
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)  # powers of whole numbers could grow without end
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        sides = (_value(side, named, formula, functions) for side in (node.left, node.right))
        return _OPERATIONS[type(node.op)](*sides)
    if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATIONS:
        return _OPERATIONS[type(node.op)](_value(node.operand, named, formula, functions))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in functions:
        return functions[node.func.id](*(_value(inner, named, formula, functions) for inner in node.args))
    if isinstance(node, ast.Name) and node.id == "pi":
        return math.pi
    if _is_name(node, formula):
        return named(node)
    raise BadFormula(
        f"'{formula}': {ast.unparse(node)} is neither a number, a name nor an operation (+ - * / **); functions: "
        f"{', '.join(functions)}"
    )


def _is_name(node: ast.expr, formula: str) -> bool:
    """Whether this is a name, perhaps with names and places in lists below it."""
    while isinstance(node, ast.Attribute | ast.Subscript):
        if isinstance(node, ast.Subscript):
            _place(node.slice, formula)
        node = node.value
    return isinstance(node, ast.Name)


def _value_of(node: ast.expr, case: dict, formula: str) -> Any:
    """The value under a name of the case."""
    above: Any
    step: str | int
    if isinstance(node, ast.Attribute):
        above, step = _value_of(node.value, case, formula), node.attr
    elif isinstance(node, ast.Subscript):
        above, step = _value_of(node.value, case, formula), _place(node.slice, formula)
    else:
        above, step = case, cast("ast.Name", node).id
    known: list = (
        list(above) if isinstance(above, dict) else list(range(len(above))) if _is_list(above) else []
    )
    if step not in known:
        hint = did_you_mean(step, known) if isinstance(step, str) else ""
        raise BadFormula(f"'{formula}': the case has no {ast.unparse(node)}{hint}")
    return above[step]


def _is_list(value: object) -> bool:
    return isinstance(value, list | tuple)


def _place(node: ast.expr, formula: str) -> int:
    if isinstance(node, ast.Constant) and isinstance(node.value, int):
        return node.value
    raise BadFormula(f"'{formula}': places in lists are whole numbers")
