"""Integrals over what two facets in 3D share where they are now, compiled.

Both are projected along the slave's normal onto the plane through it, the master's outline is
cut by the sides of the slave's, and the part they share is filled with triangles from its first
corner.  Where corners coincide some of these have an area of rounding, of either sign, and yet
derivatives that only all together are right: none is left out.  Numbers are complex: real parts
decide, imaginary ones carry derivatives along, first those by the coordinates in the plane,
then those of these by the corners in space.

Functions of quadrilaterals that are no parallelograms are no polynomials in the plane, as
their reference point (s, t) is the root of an equation.  With x = c + a s + b t + h st the
determinant a x b + (a x h) s + (h x b) t vanishes outside of the facet, at a distance that
tells how fast Gauss rules with n points a way converge ([T]).  With m points for h = 0 the
error, as patch tests on random meshes show it, is below

    lost (2 rho)^2 rho^(2 (n - m)),    rho = d / (1 + (1 - d^2)^(1/2)),                    (1)

d = (|a x h| + |h x b|) / |a x b|, lost = LOST or, of second order, LOST_SECOND; n is the least
with which that is EXACT, as uniform pressures between meshes that do not match need it.

Arguments of all loops: corners (n, 2) in the plane with their number; facets (a, 3) padded,
with their numbers of corners; rules (m, q, 3): points and weights on the unit triangle, each
with more points than the one before, counts (m,) of them.

[T] L. N. Trefethen, "Is Gauss quadrature better than Clenshaw-Curtis?", SIAM Review 50 (2008).
"""

from __future__ import annotations

from functools import cache

import numpy as np

from ...core.compiled import njit
from .clipping import triangle_rule

MOST = 12  # Gauss points a way, however a quadrilateral is folded
LOST, LOST_SECOND = 4e-5, 4e-3
EXACT = 2e-11  # relative error of integrals that is none
ROOM = 10  # corners of what two quadrilaterals share, and two to spare
NEWTON = 20  # steps to the reference point of a quadrilateral
ENOUGH = 1e-14
ON_LINE = 1e-10  # distance of a corner from the line of a side, over its length, that is none
FLAT = 1e-10  # area of a triangle, over that of the square on a side, which may be rounding


@cache
def rules(*, second: bool) -> tuple[np.ndarray, np.ndarray]:
    """Points and weights (m, q, 3) on the unit triangle, and their counts (m,).

    The first is exact for products of shape functions that are polynomials; second: of first
    with second order.
    """
    orders = range(4 if second else 3, MOST + 1)
    counts = np.array([n * n for n in orders])
    out = np.zeros((len(counts), counts[-1], 3))
    for k, n in enumerate(orders):
        at, weight = triangle_rule(n)
        out[k, : n * n] = np.concatenate([at, weight[:, None]], axis=1)
    return out, counts


@njit(cache=True, error_model="numpy")
def _folded(x, n):
    """d of (1) for a facet with corners x (n, 2); of triangles 0, at most 1."""
    if n == 3:
        return 0.0
    size = 0.0
    sides = 0.0
    parts = np.empty((3, 2))
    for e in range(2):
        x0, x1, x2, x3 = x[0, e].real, x[1, e].real, x[2, e].real, x[3, e].real
        parts[0, e], parts[1, e] = x1 + x2 - x0 - x3, x2 + x3 - x0 - x1
        parts[2, e] = x0 - x1 + x2 - x3
    a, b, h = parts[0], parts[1], parts[2]
    size = abs(a[0] * b[1] - a[1] * b[0])
    sides = abs(a[0] * h[1] - a[1] * h[0]) + abs(h[0] * b[1] - h[1] * b[0])
    return min(sides / size, 1.0) if size > 0 else 1.0


@njit(cache=True, error_model="numpy")
def _level(x, na, y, nb, lost, levels):
    """Which of the rules a pair needs."""
    d = max(_folded(x, na), _folded(y, nb))
    rho = d / (1 + np.sqrt(max(1 - d * d, 0.0)))
    left = lost * 4 * rho * rho
    for k in range(levels - 1):
        if left < EXACT:
            return k
        left *= rho * rho
    return levels - 1


@njit(cache=True, error_model="numpy")
def _axes(x, n, axes):
    """Axes (2, 3) of the plane of a facet."""
    last = n - 1
    a, b = np.empty(3, np.complex128), np.empty(3, np.complex128)
    normal = np.empty(3, np.complex128)
    for i in range(3):
        a[i], b[i] = x[2, i] - x[0, i], x[last, i] - x[1, i]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        normal[i] = a[j] * b[k] - a[k] * b[j]
    size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    along = 0j
    for i in range(3):
        normal[i] /= size
        a[i] = x[1, i] - x[0, i]
        along += a[i] * normal[i]
    square = 0j
    for i in range(3):
        a[i] -= along * normal[i]
        square += a[i] ** 2
    for i in range(3):
        axes[0, i] = a[i] / np.sqrt(square)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        axes[1, i] = normal[j] * axes[0, k] - normal[k] * axes[0, j]


@njit(cache=True, error_model="numpy")
def _flat(x, n, origin, axes, out):
    """Corners (n, 2) of a facet seen in the plane."""
    for p in range(n):
        for e in range(2):
            out[p, e] = 0j
            for i in range(3):
                out[p, e] += (x[p, i] - origin[i]) * axes[e, i]


@njit(cache=True, error_model="numpy")
def _cut(corners, count, start, end, out):
    """What lies to the left of start -> end into out; how many corners.

    Corners that are on the line up to rounding count as beyond it: slivers between two edges
    that coincide have derivatives that are rounding alone.
    """
    kept = 0
    near = ON_LINE * ((end[0] - start[0]).real ** 2 + (end[1] - start[1]).real ** 2)
    for p in range(count):
        q = (p + 1) % count
        h = (end[0] - start[0]) * (corners[p, 1] - start[1]) - (end[1] - start[1]) * (
            corners[p, 0] - start[0]
        )
        g = (end[0] - start[0]) * (corners[q, 1] - start[1]) - (end[1] - start[1]) * (
            corners[q, 0] - start[0]
        )
        if h.real > near:
            out[kept, 0], out[kept, 1] = corners[p, 0], corners[p, 1]
            kept += 1
        if (h.real > near) != (g.real > near):
            if h.real > near:
                g -= max(g.real, 0.0)
            else:
                h -= max(h.real, 0.0)
            share = h / (h - g)
            for e in range(2):
                out[kept, e] = corners[p, e] + share * (corners[q, e] - corners[p, e])
            kept += 1
    return kept


@njit(cache=True, error_model="numpy")
def _shapes(x, n, at0, at1, phi):
    """Shape functions of a facet with corners x (n, 2) at a point of the plane."""
    for p in range(phi.shape[0]):
        phi[p] = 0j
    if n == 3:
        a0, a1 = x[1, 0] - x[0, 0], x[1, 1] - x[0, 1]
        b0, b1 = x[2, 0] - x[0, 0], x[2, 1] - x[0, 1]
        r0, r1 = at0 - x[0, 0], at1 - x[0, 1]
        det = a0 * b1 - a1 * b0
        s, t = (r0 * b1 - r1 * b0) / det, (a0 * r1 - a1 * r0) / det
        phi[0], phi[1], phi[2] = 1 - s - t, s, t
        return
    s, t = 0.5 + 0j, 0.5 + 0j
    for _ in range(NEWTON):
        a0 = (1 - t) * (x[1, 0] - x[0, 0]) + t * (x[2, 0] - x[3, 0])
        a1 = (1 - t) * (x[1, 1] - x[0, 1]) + t * (x[2, 1] - x[3, 1])
        b0 = (1 - s) * (x[3, 0] - x[0, 0]) + s * (x[2, 0] - x[1, 0])
        b1 = (1 - s) * (x[3, 1] - x[0, 1]) + s * (x[2, 1] - x[1, 1])
        r0 = at0 - (1 - s) * (1 - t) * x[0, 0] - s * (1 - t) * x[1, 0]
        r0 -= s * t * x[2, 0] + (1 - s) * t * x[3, 0]
        r1 = at1 - (1 - s) * (1 - t) * x[0, 1] - s * (1 - t) * x[1, 1]
        r1 -= s * t * x[2, 1] + (1 - s) * t * x[3, 1]
        det = a0 * b1 - a1 * b0
        ds, dt = (r0 * b1 - r1 * b0) / det, (a0 * r1 - a1 * r0) / det
        s, t = s + ds, t + dt
        if abs(ds.real) + abs(dt.real) < ENOUGH:
            break  # a step from there is exact in the imaginary parts, too
    phi[0], phi[1], phi[2], phi[3] = (1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t


@njit(cache=True, error_model="numpy")
def _bulging(phi, count, out):
    """Functions of middles into out (count,), by those of the corners phi."""
    if count == 3:  # of a triangle
        for m in range(3):
            out[m] = 4 * phi[m] * phi[(m + 1) % 3]
        return
    if count == 0:
        return
    s, t = phi[1] + phi[2], phi[2] + phi[3]
    along, across = 4 * s * (1 - s), 4 * t * (1 - t)
    out[0], out[1], out[2], out[3] = along * (1 - t), across * s, along * t, across * (1 - s)
    if count == 5:  # with one inside
        out[0], out[1] = out[0] * (1 - 2 * t), out[1] * (2 * s - 1)
        out[2], out[3] = out[2] * (2 * t - 1), out[3] * (1 - 2 * s)
        out[4] = along * across


@njit(cache=True, error_model="numpy")
def _in_plane(slave, master, numbers, x, y):
    """Corners of both in the plane of the slave into x (a, 2) and y (b, 2)."""
    axes = np.empty((2, 3), np.complex128)
    _axes(slave, numbers[0], axes)
    _flat(slave, numbers[0], slave[0], axes, x)
    _flat(master, numbers[1], slave[0], axes, y)


@njit(cache=True, error_model="numpy")
def _shared(x, y, numbers, rules, counts, mass, cross):  # noqa: PLR0913
    """int phi phi into mass (a, a + e) and int phi N into cross (a, b + h) of one pair.

    x (a, 2), y (b, 2): corners of slave and master in the plane.
    """
    na, nb = numbers[0], numbers[1]
    mass[:], cross[:] = 0j, 0j
    one, other = np.empty((ROOM, 2), np.complex128), np.empty((ROOM, 2), np.complex128)
    for p in range(nb):  # seen from behind it goes round the other way
        one[p, 0], one[p, 1] = y[nb - 1 - p, 0], y[nb - 1 - p, 1]
    count = nb
    for side in range(na):
        count = _cut(one, count, x[side], x[(side + 1) % na], other)
        one, other = other, one
        if count < 3:
            return
    a, b = x.shape[0], y.shape[0]
    lost = LOST_SECOND if numbers[2] + numbers[3] > 0 else LOST
    level = _level(x, na, y, nb, lost, len(counts))
    rule = rules[level]
    flat = FLAT * ((x[1, 0] - x[0, 0]).real ** 2 + (x[1, 1] - x[0, 1]).real ** 2)
    phi = np.zeros(mass.shape[1], np.complex128)
    opposite = np.zeros(cross.shape[1], np.complex128)
    for p in range(1, count - 1):
        a0, a1 = one[p, 0] - one[0, 0], one[p, 1] - one[0, 1]
        b0, b1 = one[p + 1, 0] - one[0, 0], one[p + 1, 1] - one[0, 1]
        double = a0 * b1 - a1 * b0
        if double.real < -flat:
            continue
        for q in range(counts[level]):
            at0 = one[0, 0] + rule[q, 0] * a0 + rule[q, 1] * b0
            at1 = one[0, 1] + rule[q, 0] * a1 + rule[q, 1] * b1
            _shapes(x, na, at0, at1, phi[:a])
            _shapes(y, nb, at0, at1, opposite[:b])
            _bulging(phi[:a], numbers[2], phi[a:])
            _bulging(opposite[:b], numbers[3], opposite[b:])
            for r in range(na):
                weight = rule[q, 2] * double * phi[r]
                for t in range(mass.shape[1]):
                    mass[r, t] += weight * phi[t]
                for t in range(cross.shape[1]):
                    cross[r, t] += weight * opposite[t]


@njit(cache=True, error_model="numpy")
def _slopes(p, q, x, y, numbers, rules, counts, step, m, c, mass, cross):  # noqa: PLR0913
    """Derivatives of one pair by its corners p (a, 3), q (b, 3) into mass and cross.

    x, y: those corners in the plane; m, c: room for values.  The first corner of the slave is
    the origin there and the second lies on the first axis: these three coordinates stay.
    """
    a, b = len(p), len(q)
    u, v = x.copy(), y.copy()
    by_plane = np.zeros((2 * (a + b), 3 * (a + b)))
    for way in range(3 * (a + b)):
        node, e = way // 3, way % 3
        if (node < a and node >= numbers[0]) or node - a >= numbers[1]:
            continue  # of the padding
        if node < a:
            p[node, e] += 1j * step
        else:
            q[node - a, e] += 1j * step
        _in_plane(p, q, numbers, u, v)
        for f in range(2):
            for r in range(numbers[0]):
                by_plane[2 * r + f, way] = u[r, f].imag / step
            for r in range(numbers[1]):
                by_plane[2 * (a + r) + f, way] = v[r, f].imag / step
        if node < a:
            p[node, e] = p[node, e].real
        else:
            q[node - a, e] = q[node - a, e].real
    for w in range(2 * (a + b)):
        node, f = w // 2, w % 2
        if w in (0, 1, 3) or (node < a and node >= numbers[0]) or node - a >= numbers[1]:
            continue
        if node < a:
            x[node, f] += 1j * step
        else:
            y[node - a, f] += 1j * step
        _shared(x, y, numbers, rules, counts, m, c)
        if node < a:
            x[node, f] = x[node, f].real
        else:
            y[node - a, f] = y[node - a, f].real
        for way in range(3 * (a + b)):
            factor = by_plane[w, way]
            if factor == 0:
                continue
            for r in range(a):
                for t in range(m.shape[1]):
                    mass[way, r, t] += factor * (m[r, t].imag / step)
                for t in range(c.shape[1]):
                    cross[way, r, t] += factor * (c[r, t].imag / step)


@njit(cache=True, error_model="numpy")
def plane_integrals(slave, master, numbers, rules, counts, step, mass, cross):  # noqa: PLR0913
    """Integrals of k pairs of facets (k, a, 3), (k, b, 3).

    numbers (k, 4): of corners of both, then of their nodes beside these.
    step 0: mass (k, 1, a, a + e) and cross (k, 1, a, b + h) themselves; else their derivatives
    by the (a + b) 3 coordinates in the second place, of a complex step.
    """
    k, a, b = slave.shape[0], slave.shape[1], master.shape[1]
    x, y = np.empty((a, 2), np.complex128), np.empty((b, 2), np.complex128)
    m = np.empty((a, mass.shape[3]), np.complex128)
    c = np.empty((a, cross.shape[3]), np.complex128)
    p, q = np.empty((a, 3), np.complex128), np.empty((b, 3), np.complex128)
    for i in range(k):
        p[:], q[:] = slave[i], master[i]
        _in_plane(p, q, numbers[i], x, y)
        if step > 0:
            _slopes(p, q, x, y, numbers[i], rules, counts, step, m, c, mass[i], cross[i])
            continue
        _shared(x, y, numbers[i], rules, counts, m, c)
        mass[i, 0], cross[i, 0] = m.real, c.real
