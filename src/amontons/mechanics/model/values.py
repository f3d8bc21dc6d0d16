"""Values that users give, as numbers or as functions of position, evaluated at nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...core.arrays import LARGEST, number, real
from ...core.errors import InvalidInput, number_hint, shown
from .timing import steady_value

Array = NDArray[np.float64]
Component = float | Callable[..., float] | None
Vector = Sequence[float | None] | Array
VectorValue = float | Sequence[Component] | Callable[..., Vector]
ScalarValue = ArrayLike | Callable[[Array], ArrayLike]
PLAIN = {float, int, np.float64}  # numbers of what most functions return


def check_vector(value: object, what: str, *, free: bool = False) -> None:
    """Raise InvalidInput for what can be no vector, and for one number other than 0.

    It could only be meant along every axis, which is hardly ever what is wanted.  Also for
    texts and for numbers that are none.
    """
    if isinstance(value, list | tuple):
        for entry in value:
            if isinstance(entry, str):
                leave = "; None leaves a component free" if free else ""
                raise InvalidInput(f"{what}: expected a number, got {shown(entry)}"
                                   f"{number_hint(entry) or leave}")  # fmt: skip
            if is_number(entry) and not np.isfinite(entry):
                raise InvalidInput(f"{what}: expected a finite number, got {entry}")
    entries = list(value) if isinstance(value, list | tuple) else [value]
    if any(entry is ... for entry in entries):
        leave = ", None for a component that is free" if free else ""
        raise InvalidInput(
            f"{what}: got '...', which stands for nothing here; write a number for each "
            f"axis{leave}, or 0 for all of them"
        )
    if not (is_number(value) or callable(value) or isinstance(value, Sequence | np.ndarray)):
        raise InvalidInput(
            f"{what}: expected 0, a vector such as (0, 0, -1), or (0, -1) in 2D, or a function "
            f"of the position, got {shown(value)}"
        )
    if is_number(value) and value != 0:
        leave = f"; (None, None, {value}) leaves the others free" if free else ""
        raise InvalidInput(
            f"{what}: expected a vector or 0, got the number {value}, which would count along "
            f"every axis; write (0, 0, {value}), or (0, {value}) in 2D{leave}"
        )


def pressure_of(value: object, on: str) -> float:
    """The number that a pressure on a surface is; raises InvalidInput for anything else."""
    if isinstance(value, list | tuple | np.ndarray) and np.size(value) > 1:  # type: ignore[arg-type]
        raise InvalidInput(
            f"pressure on {on!r}: expected a number, which acts against the normal, got "
            f"{shown(value)}; a force per area with a direction is a Traction"
        )
    return number(f"pressure on {on!r}", value)


def check_scalar(value: object, what: str) -> None:
    """Raise InvalidInput for a number below 0, or an array with one."""
    if isinstance(value, str):
        raise InvalidInput(f"{what}: expected a number or a function, got the text {value!r}"
                           f"{number_hint(value)}")  # fmt: skip
    try:
        numbers = np.asarray(value, dtype=float)
    except (TypeError, ValueError):  # a function, or nothing of use, which `scalar_at` tells
        return
    if not np.isfinite(numbers).all():
        bad = numbers[~np.isfinite(numbers)].flat[0]
        raise InvalidInput(f"{what}: expected finite numbers >= 0, got {bad}")
    if (numbers < 0).any():
        raise InvalidInput(f"{what}: expected numbers >= 0, got {numbers.min():g}")


def vector_at(
    value: VectorValue, points: Array, what: str, *, free: bool = False, size: int | None = None
) -> Array:
    """A vector value at points (n, dim): (n, size); a free component (None) becomes NaN.

    size: number of components, by default dim.

    Callables take one point x of shape (dim,): the whole value, or one component each; those
    of (x, t) are taken at t = 0.
    """
    dim = points.shape[1] if size is None else size
    value = steady_value(value)
    if callable(value):
        return _table([value(x) for x in points], dim, what, free)
    columns = [_column(entry, points, what, free) for entry in _entries(value, dim, what)]
    return np.array(columns, dtype=float).T.reshape(len(points), dim)


def component_at(value: Component, points: Array, what: str) -> Array:
    """A number, or a function of one point x (dim,), at points (n, dim): (n,)."""
    return np.array(_column(steady_value(value), points, what, False), dtype=float)


def _column(entry: Component, points: Array, what: str, free: bool) -> Array | list[float]:
    if callable(entry):
        return [_number(entry(x), what, free) for x in points]
    return np.full(len(points), _number(entry, what, free))


def scalar_at(
    value: ScalarValue, points: Array, what: str, *, each: str = "slave node"
) -> Array:
    """A scalar value at points (n, dim): (n,), finite and >= 0.

    Callables take all points at once, (n, dim), and return (n,) or a number.
    """
    n = len(points)
    if callable(value):
        # never as many rows as columns: x[0] instead of x[:, 0] must not pass by chance
        padded = np.tile(points, (4, 1))
        found = real(what, value(padded))
        if found.ndim == 1 and len(found) == len(padded):
            found = found[:n]
        elif found.ndim:
            raise InvalidInput(
                f"{what}: expected a function of points (n, {points.shape[1]}) "
                f"that returns (n,), got shape {found.shape} for n = {len(padded)}; "
                "x[:, 0] is the first coordinate"
            )
    else:
        found = real(what, value)
    if found.shape not in ((), (n,)):
        raise InvalidInput(
            f"{what}: expected a number or one per {each}, ({n},), got {found.shape}"
        )
    out = np.array(np.broadcast_to(found, (n,)))
    bad = np.flatnonzero(~np.isfinite(out) | (out < 0))
    if bad.size:
        raise InvalidInput(
            f"{what}: expected finite numbers >= 0, got {out[bad[0]]} at {points[bad[0]]}"
        )
    return out


def is_number(value: object) -> bool:
    """True for one number, in Python's or NumPy's form."""
    return isinstance(value, int | float | np.number) or (
        isinstance(value, np.ndarray) and value.ndim == 0
    )


def _entries(value: object, dim: int, what: str) -> list:
    if is_number(value):
        return [value] * dim
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str | bytes):
        raise InvalidInput(
            f"{what}: expected {dim} components or a function, got {shown(value)}"
        )
    entries = list(value)  # type: ignore[call-overload]
    if len(entries) != dim:
        raise InvalidInput(f"{what}: expected {dim} components, got {len(entries)}")
    return entries


def _table(rows: list, dim: int, what: str, free: bool) -> Array:
    """What a function returned as an array (n, dim); looked at one by one where need be."""
    plain = all(type(row) in (tuple, list) and len(row) == dim for row in rows)
    if plain and {type(entry) for row in rows for entry in row} <= PLAIN:
        with suppress(OverflowError):
            found = np.array(rows, dtype=float).reshape(len(rows), dim)
            if (np.abs(found) <= LARGEST).all():
                return found
    found = [_row(row, dim, what, free) for row in rows]
    return np.array(found, dtype=float).reshape(len(rows), dim)


def _row(values: object, dim: int, what: str, free: bool) -> list[float]:
    if is_number(values):
        raise InvalidInput(
            f"{what}: expected {dim} components of the function, got the number {values}"
        )
    return [_number(entry, what, free) for entry in _entries(values, dim, what)]


def _number(entry: object, what: str, free: bool) -> float:
    if entry is None:
        if free:
            return np.nan
        raise InvalidInput(
            f"{what}: expected numbers, got None (only supports leave components free)"
        )
    if not isinstance(entry, float):  # what most functions return: no need to look closer
        return number(what, entry)
    if not abs(entry) <= LARGEST:
        raise InvalidInput(f"{what}: expected a finite number, got {entry}")
    return entry
