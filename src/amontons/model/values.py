"""Values that users give, as numbers or as functions of position, evaluated at nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..checked_arrays import LARGEST, number, real
from ..errors import InvalidInput, shown

Array = NDArray[np.float64]
Component = float | Callable[[Array], float] | None
VectorValue = float | Sequence[Component] | Callable[[Array], Sequence[float | None]]
ScalarValue = ArrayLike | Callable[[Array], ArrayLike]


def vector_at(value: VectorValue, points: Array, what: str, *, free: bool = False) -> Array:
    """A vector value at points (n, dim): (n, dim); a free component (None) becomes NaN.

    Callables take one point x of shape (dim,): the whole value, or one component each.
    """
    dim = points.shape[1]
    if callable(value):
        rows = [_row(value(x), dim, what, free) for x in points]
        return np.array(rows, dtype=float).reshape(len(points), dim)
    entries = _entries(value, dim, what)
    columns = [
        [_number(entry(x), what, free) for x in points]
        if callable(entry)
        else np.full(len(points), _number(entry, what, free))
        for entry in entries
    ]
    return np.array(columns, dtype=float).T.reshape(len(points), dim)


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


def _entries(value: object, dim: int, what: str) -> list:
    if isinstance(value, int | float | np.number):
        return [value] * dim
    if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str | bytes):
        raise InvalidInput(
            f"{what}: expected {dim} components or a function, got {shown(value)}"
        )
    entries = list(value)  # type: ignore[call-overload]
    if len(entries) != dim:
        raise InvalidInput(f"{what}: expected {dim} components, got {len(entries)}")
    return entries


def _row(values: object, dim: int, what: str, free: bool) -> list[float]:
    return [_number(entry, what, free) for entry in _entries(values, dim, what)]


def _number(entry: object, what: str, free: bool) -> float:
    if entry is None:
        if free:
            return np.nan
        raise InvalidInput(
            f"{what}: expected numbers, got None (only supports leave components free)"
        )
    if type(entry) is not float:  # what most functions return: no need to look closer
        return number(what, entry)
    if not abs(entry) <= LARGEST:
        raise InvalidInput(f"{what}: expected a finite number, got {entry}")
    return entry
