"""Arithmetic expressions of case files: parsed into a checked tree, never handed to `eval`.

Variables x, y, z (position) and t (time); + - * / ** ( ); comparisons, `and`, `or`, `not`;
where(condition, a, b), sqrt, exp, log, sin, cos, tan, abs, min, max; the constant pi.
All numbers are floats, so that 9**9**9 is an overflow and not an endless integer.
"""

from __future__ import annotations

import ast
import warnings
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InvalidInput
from .words import nearest

Array = NDArray[np.float64]
VARIABLES = ("x", "y", "z", "t")
CONSTANTS = {"pi": np.pi}
FUNCTIONS = {  # name: (function, number of arguments; None: two or more)
    "where": (np.where, 3), "min": (np.minimum, None), "max": (np.maximum, None),
    "sqrt": (np.sqrt, 1), "exp": (np.exp, 1), "log": (np.log, 1), "abs": (np.abs, 1),
    "sin": (np.sin, 1), "cos": (np.cos, 1), "tan": (np.tan, 1),
}  # fmt: skip
BINARY = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.true_divide,
    ast.Pow: np.float_power,
}  # fmt: skip
UNARY = {ast.USub: np.negative, ast.UAdd: np.positive, ast.Not: np.logical_not}
COMPARE = {
    ast.Lt: np.less, ast.LtE: np.less_equal, ast.Gt: np.greater, ast.GtE: np.greater_equal,
    ast.Eq: np.equal, ast.NotEq: np.not_equal,
}  # fmt: skip
MAX_LENGTH = 2000  # characters
MAX_DEPTH = 150  # nested operations; keeps the recursion far from the interpreter's limit


@dataclass(frozen=True)
class Expression:
    """A checked expression; call it with points (n, dim), or one point (dim,), to get values.

    >>> Expression("0.06 - 0.15*x")(np.array([[0.0, 0.0], [0.4, 0.0]]))
    array([0.06, 0.  ])
    """

    text: str
    time: float = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.text, str):
            raise InvalidInput(f"expression: expected a text, got {self.text!r}")
        _variables(self.text)

    @property
    def names(self) -> frozenset[str]:
        """Variables that occur."""
        return _variables(self.text)

    def __call__(self, points: Array) -> Array:
        """Values at points (n, dim), shape (n,); raises InvalidInput where not finite."""
        points = np.asarray(points, dtype=float)
        if points.ndim == 1:
            return self(points[None])[0]
        values: dict[str, Array | float] = dict(zip("xyz", points.T, strict=False))
        values |= {"t": self.time, **CONSTANTS}
        missing = sorted(self.names - set(values))
        if missing:
            raise _error(self.text, f"'{missing[0]}' does not exist in {points.shape[1]}D")
        with np.errstate(all="ignore"):
            result = _evaluate(_parse(self.text), values)
        out = np.array(np.broadcast_to(result, len(points)), dtype=float)
        bad = np.flatnonzero(~np.isfinite(out))
        if bad.size:
            where = ", ".join(f"{c:.6g}" for c in points[bad[0]])
            raise _error(self.text, f"is {out[bad[0]]} at the point ({where})")
        return out


def _error(text: str, message: str) -> InvalidInput:
    shown = text if len(text) <= 80 else f"{text[:77]}..."
    return InvalidInput(f"expression {shown!r}: {message}")


@lru_cache(maxsize=1024)
def _parse(text: str) -> ast.expr:
    if len(text) > MAX_LENGTH:
        raise _error(text, f"expected at most {MAX_LENGTH} characters, got {len(text)}")
    if not text.strip():
        raise _error(text, "expected an expression, this is empty")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # remarks on literals such as 1if: refused below
            return ast.parse(text.strip(), mode="eval").body
    except SyntaxError as reason:
        near = text.strip()[max((reason.offset or 1) - 1, 0) :][:12] or "the end"
        raise _error(text, f"can not be read near {near!r}") from None
    except (ValueError, MemoryError, RecursionError) as reason:
        raise _error(text, f"can not be read: {reason or 'too deeply nested'}") from None


@lru_cache(maxsize=1024)
def _variables(text: str) -> frozenset[str]:
    """Names of variables in an expression, which is checked."""
    tree = _parse(text)
    _check(text, tree, 0)
    found = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return frozenset(found & set(VARIABLES))


def _check(text: str, node: ast.AST, depth: int) -> None:
    """Raise InvalidInput for the first node that is not on the list above."""
    if depth > MAX_DEPTH:
        raise _error(text, f"expected at most {MAX_DEPTH} nested operations")
    for child in _children(text, node):
        _check(text, child, depth + 1)


def _children(text: str, node: ast.AST) -> list[ast.expr]:
    """Operands of an allowed node."""
    match node:
        case ast.Constant(value=value) if type(value) in (int, float):
            _number(text, value)
            return []
        case ast.Name(id=name):
            if name in FUNCTIONS:
                raise _error(text, f"'{name}' is a function, expected {name}(…)")
            if name not in VARIABLES and name not in CONSTANTS:
                raise _unknown(text, name)
            return []
        case ast.BinOp(left=left, op=op, right=right) if type(op) in BINARY:
            return [left, right]
        case ast.BinOp(op=ast.BitXor()):
            raise _error(text, "'^' is not a power, write **")
        case ast.UnaryOp(op=op, operand=operand) if type(op) in UNARY:
            return [operand]
        case ast.BoolOp(values=values):
            return values
        case ast.Compare(left=left, ops=ops, comparators=others) if all(
            type(op) in COMPARE for op in ops
        ):
            return [left, *others]
        case ast.Call():
            return _arguments(text, node)
    raise _error(text, f"{_source(text, node)!r} is not allowed; only arithmetic, "
                 "comparisons and the known functions are")  # fmt: skip


def _source(text: str, node: ast.AST) -> str:
    """The beginning of a node's text; `ast.unparse` could exhaust the stack."""
    return (ast.get_source_segment(text.strip(), node) or "this")[:40]


def _number(text: str, value: Any) -> float:
    try:
        return float(value)
    except OverflowError:
        raise _error(text, f"the number {str(value)[:12]}… is too large") from None


def _arguments(text: str, node: ast.Call) -> list[ast.expr]:
    name = node.func.id if isinstance(node.func, ast.Name) else _source(text, node.func)
    if name not in FUNCTIONS:
        raise _unknown(text, name)
    count, given = FUNCTIONS[name][1], len(node.args)
    if node.keywords or (given < 2 if count is None else given != count):
        wanted = "two or more" if count is None else count
        raise _error(text, f"{name} expects {wanted} argument(s), got {given}")
    return node.args


def _unknown(text: str, name: str) -> InvalidInput:
    known = (*VARIABLES, *CONSTANTS, *FUNCTIONS)
    return _error(text, f"unknown name '{name}'{nearest(name, known)}")


def _evaluate(node: ast.AST, values: dict[str, Array | float]) -> Any:
    """Value of a tree that `_check` has accepted."""
    match node:
        case ast.Constant(value=value):
            return _number("", value)
        case ast.Name(id=name):
            return values[name]
        case ast.BinOp(left=left, op=op, right=right):
            # times 1.0: NumPy refuses to subtract or negate truth values
            a, b = _evaluate(left, values) * 1.0, _evaluate(right, values) * 1.0
            return BINARY[type(op)](a, b)
        case ast.UnaryOp(op=op, operand=operand):
            return UNARY[type(op)](_evaluate(operand, values) * 1.0)
        case ast.BoolOp(op=op, values=parts):
            join = np.logical_and if isinstance(op, ast.And) else np.logical_or
            return reduce(join, (_evaluate(part, values) for part in parts))
        case ast.Compare(left=left, ops=ops, comparators=others):
            sides = [_evaluate(side, values) for side in (left, *others)]
            pairs = zip(ops, sides[:-1], sides[1:], strict=True)
            return reduce(np.logical_and, (COMPARE[type(op)](a, b) for op, a, b in pairs))
        case ast.Call(func=ast.Name(id=name), args=args):
            function, count = FUNCTIONS[name]
            parts = [_evaluate(part, values) * 1.0 for part in args]
            if name == "where":
                return np.where(np.asarray(parts[0]) != 0, parts[1], parts[2])
            return reduce(function, parts) if count is None else function(*parts)
    raise AssertionError(f"unchecked node {ast.dump(node)}")
