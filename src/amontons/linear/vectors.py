"""Long vectors on all cores: sums in blocks of fixed length, added in order.

Arrays of any shape are taken flat; they have to be contiguous.
"""

from __future__ import annotations

import numpy as np
from numba import uint64
from numpy.typing import NDArray

from ..core.compiled import njit
from ..core.threads import BLOCK, over_blocks, over_rows

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LEFT_OUT, BESIDE = 1, 2  # kinds of nodes, see `norms_of`


def blocks_of(size: int) -> int:
    """Number of partial sums of a vector."""
    return -(-size // BLOCK)


def dot(a: Array, b: Array) -> float:
    """a . b."""
    sums = np.empty(blocks_of(a.size))
    over_blocks(_dot, a.size, 2.0 * a.size, a.reshape(-1), b.reshape(-1), sums)
    return float(np.add.reduce(sums))


def norm(a: Array) -> float:
    """|a|."""
    return float(np.sqrt(dot(a, a)))


def norm_of_rest(a: Array, b: Array, c: Array) -> float:
    """|a - b - c|."""
    if a.size < BLOCK:  # nothing to share, nor a kernel to compile
        return float(np.linalg.norm(a - b - c))
    sums = np.empty(blocks_of(a.size))
    flat = [v.reshape(-1) for v in (a, b, c)]
    over_blocks(_rest, a.size, 4.0 * a.size, *flat, sums)
    return float(np.sqrt(np.add.reduce(sums)))


def norms_of(a: Array, kind: NDArray[np.int8]) -> tuple[float, float]:
    """|a| of (nodes, 3) without the nodes LEFT_OUT, and of those that are BESIDE alone."""
    sums = np.empty((blocks_of(len(a)), 2))
    over_blocks(_squares, len(a), 4.0 * len(a), a, kind, sums)
    rest, beside = np.sqrt(np.add.reduce(sums))
    return float(rest), float(beside)


def copy_into(a: Array, out: Array) -> None:
    """out = a."""
    over_blocks(_copy, a.size, 2.0 * a.size, a.reshape(-1), out.reshape(-1))


def copy_both(a: Array, a_out: Array, b: Array, b_out: Array) -> None:
    """a_out = a and b_out = b, all of one size."""
    flat = [v.reshape(-1) for v in (a, a_out, b, b_out)]
    over_blocks(_copy_both, a.size, 4.0 * a.size, *flat)


def add_scaled(a: float, x: Array, y: Array) -> None:
    """y += a x."""
    over_blocks(_add_scaled, x.size, 3.0 * x.size, a, x.reshape(-1), y.reshape(-1))


def turn(p: Array, factor: float, z: Array) -> None:
    """p = factor p + z."""
    over_blocks(_turn, p.size, 3.0 * p.size, p.reshape(-1), factor, z.reshape(-1))


def advance(x: Array, r: Array, step: float, p: Array, Ap: Array) -> float:
    """x += step p, r -= step A p; |r|."""
    sums = np.empty(blocks_of(x.size))
    flat = [v.reshape(-1) for v in (x, r, p, Ap)]
    over_blocks(_advance, x.size, 6.0 * x.size, *flat, step, sums)
    return float(np.sqrt(np.add.reduce(sums)))


def two_dots(a: Array, b: Array, c: Array) -> tuple[float, float]:
    """a . c and b . c."""
    sums = np.empty(2 * blocks_of(c.size))
    flat = [v.reshape(-1) for v in (a, b, c)]
    over_blocks(_two_dots, c.size, 3.0 * c.size, *flat, sums)
    first, second = sums.reshape(-1, 2).sum(axis=0)
    return float(first), float(second)


def add_two(
    y: Array, x: Array, a: tuple[float, float], ys: list[Array], xs: list[Array], r: Array
) -> tuple[float, float]:
    """y += a_0 y_0 + a_1 y_1 and x += a_0 x_0 + a_1 x_1; y . y and y . r."""
    sums = np.empty(2 * blocks_of(y.size))
    flat = [v.reshape(-1) for v in (y, x, *ys, *xs, r)]
    over_blocks(_add_two, y.size, 9.0 * y.size, *flat, *a, sums)
    first, second = sums.reshape(-1, 2).sum(axis=0)
    return float(first), float(second)


def put_at(place: Index, x: Array, out: Array) -> None:
    """out[place] = x, all flat; no place twice."""
    over_rows(_put_at, len(place), 3.0 * len(place), place, x, out)


def take_from(place: Index, x: Array, out: Array) -> None:
    """out = x[place], all flat."""
    over_rows(_take_from, len(place), 3.0 * len(place), place, x, out)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _dot(begin, end, a, b, sums):
    for first in range(begin, end, BLOCK):
        total = 0.0
        for i in range(first, min(first + BLOCK, end)):
            total += a[i] * b[i]
        sums[first // BLOCK] = total


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _square(a):
    total = 0.0
    for i in range(len(a)):
        total += a[i] * a[i]
    return total


@njit(cache=True, error_model="numpy", nogil=True)
def _rest(begin, end, a, b, c, sums):
    """Terms that cancel are taken off in their order, which `reassoc` would not keep."""
    rest = np.empty(BLOCK)
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        a_now, b_now, c_now = a[first:last], b[first:last], c[first:last]
        left = rest[: last - first]
        for i in range(len(left)):
            left[i] = a_now[i] - b_now[i] - c_now[i]
        sums[first // BLOCK] = _square(left)


@njit(cache=True, error_model="numpy", nogil=True)
def _squares(begin, end, a, kind, sums):
    for first in range(begin, end, BLOCK):
        rest, beside = 0.0, 0.0
        for i in range(first, min(first + BLOCK, end)):
            square = a[i, 0] * a[i, 0] + a[i, 1] * a[i, 1] + a[i, 2] * a[i, 2]
            if kind[i] != LEFT_OUT:
                rest += square
            if kind[i] == BESIDE:
                beside += square
        sums[first // BLOCK, 0], sums[first // BLOCK, 1] = rest, beside


@njit(cache=True, error_model="numpy", nogil=True)
def _copy(begin, end, a, out):
    for i in range(begin, end):
        out[i] = a[i]


@njit(cache=True, error_model="numpy", nogil=True)
def _copy_both(begin, end, a, a_out, b, b_out):  # noqa: PLR0913
    for i in range(begin, end):
        a_out[i] = a[i]
        b_out[i] = b[i]


@njit(cache=True, error_model="numpy", nogil=True)
def _add_scaled(begin, end, factor, x, y):
    for i in range(begin, end):
        y[i] += factor * x[i]


@njit(cache=True, error_model="numpy", nogil=True)
def _turn(begin, end, p, factor, z):
    for i in range(begin, end):
        p[i] = factor * p[i] + z[i]


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _advance(begin, end, x, r, p, Ap, step, sums):  # noqa: PLR0913
    for first in range(begin, end, BLOCK):
        total = 0.0
        for i in range(first, min(first + BLOCK, end)):
            x[i] += step * p[i]
            s = r[i] - step * Ap[i]
            r[i] = s
            total += s * s
        sums[first // BLOCK] = total


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _two_dots(begin, end, a, b, c, sums):
    for first in range(begin, end, BLOCK):
        one = two = 0.0
        for i in range(first, min(first + BLOCK, end)):
            one += a[i] * c[i]
            two += b[i] * c[i]
        k = 2 * (first // BLOCK)
        sums[k], sums[k + 1] = one, two


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"}, nogil=True)
def _add_two(begin, end, y, x, y0, y1, x0, x1, r, a0, a1, sums):  # noqa: PLR0913
    for first in range(begin, end, BLOCK):
        size = along = 0.0
        for i in range(first, min(first + BLOCK, end)):
            x[i] += a0 * x0[i] + a1 * x1[i]
            s = y[i] + a0 * y0[i] + a1 * y1[i]
            y[i] = s
            size += s * s
            along += s * r[i]
        k = 2 * (first // BLOCK)
        sums[k], sums[k + 1] = size, along


@njit(cache=True, nogil=True)
def _put_at(begin, end, place, x, out):
    for i in range(begin, end):
        out[uint64(place[i])] = x[i]


@njit(cache=True, nogil=True)
def _take_from(begin, end, place, x, out):
    for i in range(begin, end):
        out[i] = x[uint64(place[i])]
