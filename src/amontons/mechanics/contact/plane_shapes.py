"""What two facets in 3D share in a plane, and their functions there, compiled.

Arguments and `ways` are those of `plane_integrals`.  The reference point (s, t) of a
quadrilateral is the root of an equation; it moves with the point y in the plane and the corners
x_k, phi_k their functions, by

    a ds + b dt = dy - sum_k phi_k dx_k,                                                    (1)

a and b the derivatives of x by s and t there.
"""

from __future__ import annotations

import numpy as np

from ...core.compiled import njit

ROOM = 10  # corners of what two quadrilaterals share, and two to spare
NEWTON = 20  # steps to the reference point of a quadrilateral
ENOUGH = 1e-14
ON_LINE = 1e-10  # distance of a corner from the line of a side, over its length, that is none


@njit(cache=True, error_model="numpy")
def _by_height(x, start, end, point, by_point, out):
    """Derivatives of the height in `_cut` of a point over a side, (ways,)."""
    e0, e1 = x[end, 0] - x[start, 0], x[end, 1] - x[start, 1]
    for w in range(len(out)):
        out[w] = e0 * by_point[1, w] - e1 * by_point[0, w]
    out[2 * start] += x[end, 1] - point[1]
    out[2 * start + 1] += point[0] - x[end, 0]
    out[2 * end] += point[1] - x[start, 1]
    out[2 * end + 1] += x[start, 0] - point[0]


@njit(cache=True, error_model="numpy")
def _cut(corners, slopes, count, x, start, end, out, by_out):  # noqa: PLR0913
    """What lies to the left of a side of x, start -> end, into out (ROOM, 2); how many corners.

    slopes, by_out (ROOM, 2, ways): derivatives.  Corners that are on the line up to rounding
    count as beyond it: slivers between two edges that coincide have derivatives that are
    rounding alone.
    """
    ways = slopes.shape[2]
    e0, e1 = x[end, 0] - x[start, 0], x[end, 1] - x[start, 1]
    near, kept = ON_LINE * (e0 * e0 + e1 * e1), 0
    height, by = np.empty(ROOM), np.empty((2, ways))
    for p in range(count):
        height[p] = e0 * (corners[p, 1] - x[start, 1]) - e1 * (corners[p, 0] - x[start, 0])
    for p in range(count):
        q = (p + 1) % count
        h, g = height[p], height[q]
        if h > near:
            for e in range(2):
                out[kept, e] = corners[p, e]
                for w in range(ways):
                    by_out[kept, e, w] = slopes[p, e, w]
            kept += 1
        if (h > near) == (g > near):
            continue
        if h > near:
            g = min(g, 0.0)
        else:
            h = min(h, 0.0)
        share = h / (h - g)
        for e in range(2):
            out[kept, e] = corners[p, e] + share * (corners[q, e] - corners[p, e])
        if ways > 0:
            _by_height(x, start, end, corners[p], slopes[p], by[0])
            _by_height(x, start, end, corners[q], slopes[q], by[1])
            for w in range(ways):
                by_share = (h * by[1, w] - g * by[0, w]) / ((h - g) * (h - g))
                for e in range(2):
                    by_out[kept, e, w] = (
                        (1 - share) * slopes[p, e, w] + share * slopes[q, e, w]
                        + by_share * (corners[q, e] - corners[p, e])
                    )
        kept += 1
    return kept


@njit(cache=True, error_model="numpy")
def polygon(x, y, numbers, corners, slopes):
    """What two facets share in the plane into corners (2, ROOM, 2) and slopes.

    (how many corners, in which of both).
    """
    na, nb, ways = numbers[0], numbers[1], slopes.shape[3]
    for p in range(nb):  # seen from behind it goes round the other way
        q = nb - 1 - p
        for e in range(2):
            corners[0, p, e] = y[q, e]
            slopes[0, p, e] = 0.0
            if ways > 0:
                slopes[0, p, e, 2 * (len(x) + q) + e] = 1.0
    count, now = nb, 0
    for side in range(na):
        count = _cut(corners[now], slopes[now], count, x, side, (side + 1) % na,
                     corners[1 - now], slopes[1 - now])  # fmt: skip
        now = 1 - now
        if count < 3:
            break
    return count, now


@njit(cache=True, error_model="numpy")
def reference(x, n, at, jacobian):
    """Reference point (s, t) of a point `at` of a facet with corners x (n, 2).

    jacobian (2, 2): derivatives of the place by s, then by t.
    """
    if n == 3:
        s, t = 0.0, 0.0
    else:
        s, t = 0.5, 0.5
    for _ in range(NEWTON):
        r = np.empty(2)
        for e in range(2):
            if n == 3:
                jacobian[0, e], jacobian[1, e] = x[1, e] - x[0, e], x[2, e] - x[0, e]
                r[e] = at[e] - x[0, e] - s * jacobian[0, e] - t * jacobian[1, e]
                continue
            jacobian[0, e] = (1 - t) * (x[1, e] - x[0, e]) + t * (x[2, e] - x[3, e])
            jacobian[1, e] = (1 - s) * (x[3, e] - x[0, e]) + s * (x[2, e] - x[1, e])
            r[e] = at[e] - (1 - s) * (1 - t) * x[0, e] - s * (1 - t) * x[1, e]
            r[e] -= s * t * x[2, e] + (1 - s) * t * x[3, e]
        a0, a1, b0, b1 = jacobian[0, 0], jacobian[0, 1], jacobian[1, 0], jacobian[1, 1]
        det = a0 * b1 - a1 * b0
        ds, dt = (r[0] * b1 - r[1] * b0) / det, (a0 * r[1] - a1 * r[0]) / det
        s, t = s + ds, t + dt
        if n == 3 or abs(ds) + abs(dt) < ENOUGH:
            break
    return s, t


@njit(cache=True, error_model="numpy")
def functions(s, t, a, n, count, out):  # noqa: PLR0913
    """Functions of n corners, in a places, and `count` nodes beside them, into out (a + e, 3).

    The values, and their derivatives by s and t.
    """
    out[:] = 0.0
    if n == 3:
        out[0, 0], out[0, 1], out[0, 2] = 1 - s - t, -1.0, -1.0
        out[1, 0], out[1, 1] = s, 1.0
        out[2, 0], out[2, 2] = t, 1.0
        for m in range(count):
            p, q = m, (m + 1) % 3
            for c in range(3):
                value = 4 * out[p, 0] * out[q, c]
                out[a + m, c] = value if c == 0 else value + 4 * out[p, c] * out[q, 0]
        return
    out[0, 0], out[0, 1], out[0, 2] = (1 - s) * (1 - t), t - 1, s - 1
    out[1, 0], out[1, 1], out[1, 2] = s * (1 - t), 1 - t, -s
    out[2, 0], out[2, 1], out[2, 2] = s * t, t, s
    out[3, 0], out[3, 1], out[3, 2] = (1 - s) * t, -t, 1 - s
    if count == 0:
        return
    along, across = 4 * s * (1 - s), 4 * t * (1 - t)
    u, v = 4 - 8 * s, 4 - 8 * t
    for m in range(4):
        first = m % 2 == 0  # of a side along s; (value, slope) of what it is multiplied by
        part = (1 - t, s, t, 1 - s)[m]
        sign = (-1.0, 1.0, 1.0, -1.0)[m]
        if first:
            values = along * part, u * part, along * sign
        else:
            values = across * part, across * sign, v * part
        if count == 5:  # with one inside: nothing there
            bend = (1 - 2 * t, 2 * s - 1, 2 * t - 1, 1 - 2 * s)[m]
            slope = (-2.0, 2.0, 2.0, -2.0)[m]
            by_s, by_t = (0.0, slope) if first else (slope, 0.0)
            values = (values[0] * bend, values[1] * bend + values[0] * by_s,
                      values[2] * bend + values[0] * by_t)  # fmt: skip
        out[a + m, 0], out[a + m, 1], out[a + m, 2] = values
    if count == 5:
        out[a + 4, 0], out[a + 4, 1], out[a + 4, 2] = along * across, u * across, along * v


@njit(cache=True, error_model="numpy")
def moved_functions(shapes, jacobian, by_at, first, n, out):  # noqa: PLR0913
    """Derivatives of functions, shapes (a + e, 3), into out (a + e, ways), by (1).

    by_at (2, ways): of the place; first: number of the facet's own coordinates among the ways.
    """
    a0, a1, b0, b1 = jacobian[0, 0], jacobian[0, 1], jacobian[1, 0], jacobian[1, 1]
    det = a0 * b1 - a1 * b0
    for w in range(by_at.shape[1]):
        r0, r1 = by_at[0, w], by_at[1, w]
        p = (w - first) // 2
        if first <= w < first + 2 * n:
            if (w - first) % 2 == 0:
                r0 -= shapes[p, 0]
            else:
                r1 -= shapes[p, 0]
        ds, dt = (r0 * b1 - r1 * b0) / det, (a0 * r1 - a1 * r0) / det
        for m in range(len(shapes)):
            out[m, w] = shapes[m, 1] * ds + shapes[m, 2] * dt
