"""Loops over the lines of nodes of a box, with lines kept by components while they are near.

A line is a row of nodes along x; that of node (z, y) has the number z ny + y, so the nine lines
that a product needs are at most `ny + 1` away.  Lines that were read stay in a ring until none
needs them any more: vectors are read and written once, whatever is done with them.
"""

from __future__ import annotations

import numpy as np

from ..core.compiled import njit


@njit(cache=True, error_model="numpy", nogil=True)
def scaled(begin, end, shape, inverses, used, b, out):  # noqa: PLR0913
    """out = D^-1 b at the unknowns of the lines begin to end."""
    nz, ny, nx = shape
    node = begin * nx
    for line in range(begin, end):
        z, y = line // ny, line % ny
        cz = 0 if z == 0 else (2 if z == nz - 1 else 1)
        cy = 0 if y == 0 else (2 if y == ny - 1 else 1)
        for x in range(nx):
            cx = 0 if x == 0 else (2 if x == nx - 1 else 1)
            D = inverses[(cz * 3 + cy) * 3 + cx]
            b0, b1, b2 = b[node, 0], b[node, 1], b[node, 2]
            for a in range(3):
                s = D[a, 0] * b0 + D[a, 1] * b1 + D[a, 2] * b2
                out[node, a] = s * used[node, a]
            node += 1


@njit(cache=True, error_model="numpy")
def _load(x, node, nx, ring, row):
    """One line of nodes by components, in three rows of the ring with a zero at both ends."""
    for i in range(nx):
        for a in range(3):
            ring[row + a, i + 1] = x[node + i, a]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _inner(values, lines, shifts, ring, place, acc, width):  # noqa: PLR0913
    """acc[a, i] = sum of coefficients times shifted lines, inner nodes of one line."""
    for a in range(3):
        target = acc[a]
        target[:] = 0.0
        for t in range(0, values.shape[1], 4):
            v0, v1, v2, v3 = values[a, t], values[a, t + 1], values[a, t + 2], values[a, t + 3]
            o0 = 1 + shifts[a, t]
            o1 = 1 + shifts[a, t + 1]
            o2 = 1 + shifts[a, t + 2]
            o3 = 1 + shifts[a, t + 3]
            x0 = ring[place[lines[a, t]], o0 : o0 + width]
            x1 = ring[place[lines[a, t + 1]], o1 : o1 + width]
            x2 = ring[place[lines[a, t + 2]], o2 : o2 + width]
            x3 = ring[place[lines[a, t + 3]], o3 : o3 + width]
            for i in range(width):
                target[i] += v0 * x0[i] + v1 * x1[i] + v2 * x2[i] + v3 * x3[i]


@njit(cache=True, error_model="numpy")
def _end(stencil, ring, place, i, a):
    """Row a of the product at the end i of a line."""
    s = 0.0
    for dz in range(3):
        for dy in range(3):
            for dx in range(3):
                for b in range(3):
                    at = place[(3 * dz + dy) * 3 + b]
                    s += stencil[dz, dy, dx, a, b] * ring[at, i + dx]
    return s


@njit(cache=True, error_model="numpy")
def _product(line, shape, values, lines, shifts, stencils, ring, place, acc):  # noqa: PLR0913
    """acc (3, nx) = A x on a line, of the lines in the ring; the last row of it is zero.

    place (27,): working memory.  Returns 3 * class of z + class of y.
    """
    nz, ny, nx = shape
    z, y = line // ny, line % ny
    count = (len(ring) - 1) // 3
    for dz in range(3):
        for dy in range(3):
            inside = 0 <= z + dz - 1 < nz and 0 <= y + dy - 1 < ny
            there = ((z + dz - 1) * ny + y + dy - 1) % count
            for b in range(3):
                place[(3 * dz + dy) * 3 + b] = 3 * there + b if inside else 3 * count
    cz = 0 if z == 0 else (2 if z == nz - 1 else 1)
    cy = 0 if y == 0 else (2 if y == ny - 1 else 1)
    kind = 3 * cz + cy
    _inner(values[kind], lines[kind], shifts[kind], ring, place, acc, nx)
    for a in range(3):
        acc[a, 0] = _end(stencils[cz, cy, 0], ring, place, 0, a)
        acc[a, nx - 1] = _end(stencils[cz, cy, 2], ring, place, nx - 1, a)
    return kind


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def product_of_lines(begin, end, shape, values, lines, shifts, stencils, used, x, b, out, rest):  # noqa: PLR0913
    """out = A x, or b - A x with `rest`, on the lines begin to end; zero at idle components."""
    nz, ny, nx = shape
    ring = np.zeros((3 * (2 * ny + 3) + 1, nx + 2))
    acc, place = np.zeros((3, nx)), np.empty(27, np.int64)
    for ahead in range(begin - ny - 1, end + ny + 1):
        if 0 <= ahead < nz * ny:
            _load(x, ahead * nx, nx, ring, 3 * (ahead % (2 * ny + 3)))
        line = ahead - ny - 1
        if line < begin:
            continue
        _product(line, shape, values, lines, shifts, stencils, ring, place, acc)
        for i in range(nx):
            p = line * nx + i
            for a in range(3):
                value = b[p, a] - acc[a, i] if rest else acc[a, i]
                out[p, a] = value * used[p, a]


@njit(cache=True, error_model="numpy", fastmath={"contract"})
def _change(inverse, b, acc, used, p, i):  # noqa: PLR0913
    """D^-1 (b - A x) at node p, the i-th of its line."""
    r0 = (b[p, 0] - acc[0, i]) * used[p, 0]
    r1 = (b[p, 1] - acc[1, i]) * used[p, 1]
    r2 = (b[p, 2] - acc[2, i]) * used[p, 2]
    s0 = inverse[0, 0] * r0 + inverse[0, 1] * r1 + inverse[0, 2] * r2
    s1 = inverse[1, 0] * r0 + inverse[1, 1] * r1 + inverse[1, 2] * r2
    s2 = inverse[2, 0] * r0 + inverse[2, 1] * r1 + inverse[2, 2] * r2
    return s0 * used[p, 0], s1 * used[p, 1], s2 * used[p, 2]


@njit(cache=True, error_model="numpy", fastmath={"contract"}, nogil=True)
def smoothed_lines(begin, end, shape, values, lines, shifts, stencils, inverses, used, held,
                   x, b, ends, saved, first, keep, second, from_zero):  # noqa: PLR0913 # fmt: skip
    """Two steps d = keep d + step D^-1 (b - A x), x = x + d, on the lines begin to end.

    The first step, without d before, runs one plane and a line ahead of the second, and is done
    again for so many lines beyond both ends.  Other parts change x there: ends (k,) are where
    parts end, saved (k, n, 3): x of the two planes and two lines on either side of each.
    """
    nz, ny, nx = shape
    reach, count = ny + 1, 2 * ny + 3
    ring, after = np.zeros((3 * count + 1, nx + 2)), np.zeros((3 * count + 1, nx + 2))
    steps = np.zeros((3 * (reach + 1), nx))
    acc, acc_after, place = np.zeros((3, nx)), np.zeros((3, nx)), np.empty(27, np.int64)
    below, above = 0, 0
    for k in range(len(ends)):
        if ends[k] == begin:
            below = k
        if ends[k] == end:
            above = k
    for ahead in range(begin - 2 * reach, end + 2 * reach):
        if 0 <= ahead < nz * ny and not from_zero:
            row = 3 * (ahead % count)
            if ahead < begin:
                _load(saved[below], (ahead - begin + 2 * reach) * nx, nx, ring, row)
            elif ahead >= end:
                _load(saved[above], (ahead - end + 2 * reach) * nx, nx, ring, row)
            else:
                _load(x, ahead * nx, nx, ring, row)
        line = ahead - reach
        if line >= begin - reach and 0 <= line < nz * ny:
            z, y = line // ny, line % ny
            kind = 3 * (0 if z == 0 else (2 if z == nz - 1 else 1))
            kind += 0 if y == 0 else (2 if y == ny - 1 else 1)
            if not from_zero:
                _product(line, shape, values, lines, shifts, stencils, ring, place, acc)
            row, at = 3 * (line % count), 3 * (line % (reach + 1))
            for i in range(nx):
                p = line * nx + i
                cx = 0 if i == 0 else (2 if i == nx - 1 else 1)
                s0, s1, s2 = 0.0, 0.0, 0.0
                if not held[p]:
                    s0, s1, s2 = _change(inverses[3 * kind + cx], b, acc, used, p, i)
                steps[at, i], steps[at + 1, i], steps[at + 2, i] = (
                    first * s0, first * s1, first * s2
                )  # fmt: skip
                for a in range(3):
                    after[row + a, i + 1] = ring[row + a, i + 1] + steps[at + a, i]
        line -= reach
        if line < begin:
            continue
        kind = _product(line, shape, values, lines, shifts, stencils, after, place,
                        acc_after)  # fmt: skip
        row, at = 3 * (line % count), 3 * (line % (reach + 1))
        for i in range(nx):
            p = line * nx + i
            cx = 0 if i == 0 else (2 if i == nx - 1 else 1)
            s0, s1, s2 = 0.0, 0.0, 0.0
            if not held[p]:
                s0, s1, s2 = _change(inverses[3 * kind + cx], b, acc_after, used, p, i)
            x[p, 0] = after[row, i + 1] + (keep * steps[at, i] + second * s0)
            x[p, 1] = after[row + 1, i + 1] + (keep * steps[at + 1, i] + second * s1)
            x[p, 2] = after[row + 2, i + 1] + (keep * steps[at + 2, i] + second * s2)
