"""Integrals over what two facets in 3D share where they are now, with derivatives, compiled.

Both are projected along the slave's normal onto the plane through it, the master's outline is
cut by the sides of the slave's, and the part they share is filled with triangles from its first
corner.  Where corners coincide some of these have an area of rounding, of either sign, and yet
derivatives that only all together are right: none is left out.

Derivatives are carried along with all values, first those by the coordinates in the plane, in
the last place of arrays of `ways` of them, 0 where none are wanted; then those of these by the
corners in space, for which the axes of the plane take a complex step of STEP, exact to rounding
as nothing is subtracted.

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
from .plane_shapes import ROOM, functions, moved_functions, polygon, reference

MOST = 12  # Gauss points a way, however a quadrilateral is folded
LOST, LOST_SECOND = 4e-5, 4e-3
EXACT = 2e-11  # relative error of integrals that is none
FLAT = 1e-10  # area of a triangle, over that of the square on a side, which may be rounding
STEP = 1e-100


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
    parts = np.empty((3, 2))
    for e in range(2):
        parts[0, e] = x[1, e] + x[2, e] - x[0, e] - x[3, e]
        parts[1, e] = x[2, e] + x[3, e] - x[0, e] - x[1, e]
        parts[2, e] = x[0, e] - x[1, e] + x[2, e] - x[3, e]
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
    """Axes (2, 3) of the plane of a facet, real or complex."""
    last = n - 1
    a, b, normal = np.empty(3, x.dtype), np.empty(3, x.dtype), np.empty(3, x.dtype)
    for i in range(3):
        a[i], b[i] = x[2, i] - x[0, i], x[last, i] - x[1, i]
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        normal[i] = a[j] * b[k] - a[k] * b[j]
    size = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
    for i in range(3):
        normal[i] /= size
        a[i] = x[1, i] - x[0, i]
    along = a[0] * normal[0] + a[1] * normal[1] + a[2] * normal[2]
    for i in range(3):
        a[i] -= along * normal[i]
    square = np.sqrt(a[0] ** 2 + a[1] ** 2 + a[2] ** 2)
    for i in range(3):
        axes[0, i] = a[i] / square
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        axes[1, i] = normal[j] * axes[0, k] - normal[k] * axes[0, j]


@njit(cache=True, error_model="numpy")
def _flat(x, n, origin, axes, out):
    """Corners (n, 2) of a facet seen in the plane."""
    for p in range(n):
        for e in range(2):
            out[p, e] = 0.0
            for i in range(3):
                out[p, e] += (x[p, i] - origin[i]) * axes[e, i]


@njit(cache=True, error_model="numpy")
def _by_space(slave, master, numbers, axes, out):
    """Derivatives of both facets' corners in the plane by those in space.

    out (2 (a + b), 3 (a + b)), zero where nothing is written.
    """
    a, moved = len(slave), np.empty((2, 3), np.complex128)
    z = slave.astype(np.complex128)
    for first, count in ((0, numbers[0]), (a, numbers[1])):
        for p in range(count):
            for f in range(2):
                for i in range(3):
                    out[2 * (first + p) + f, 3 * (first + p) + i] += axes[f, i]
                    out[2 * (first + p) + f, i] -= axes[f, i]  # the origin
    for c in range(numbers[0]):
        for i in range(3):
            z[c, i] = slave[c, i] + 1j * STEP
            _axes(z, numbers[0], moved)
            z[c, i] = slave[c, i]
            for facet, first, count in ((slave, 0, numbers[0]), (master, a, numbers[1])):
                for p in range(count):
                    for f in range(2):
                        for j in range(3):
                            arm = facet[p, j] - slave[0, j]
                            by = moved[f, j].imag / STEP
                            out[2 * (first + p) + f, 3 * c + i] += arm * by


@njit(cache=True, error_model="numpy")
def _add(weight, by_weight, functions, slopes, out, by_out):  # noqa: PLR0913
    """weight times functions (m, 3) to out (m,), with derivatives (m, ways)."""
    for m in range(len(functions)):
        out[m] += weight * functions[m, 0]
        for w in range(len(by_weight)):
            by_out[m, w] += by_weight[w] * functions[m, 0] + weight * slopes[m, w]


@njit(cache=True, error_model="numpy")
def _shared(x, y, numbers, rules, counts, mass, cross, by_mass, by_cross):  # noqa: PLR0913
    """int phi phi into mass (a, a + e) and int phi N into cross (a, b + h) of one pair.

    x (a, 2), y (b, 2): corners of slave and master in the plane; by_mass (a, a + e, ways),
    by_cross (a, b + h, ways): derivatives by these.
    """
    na, nb, ways = numbers[0], numbers[1], by_mass.shape[2]
    mass[:], cross[:], by_mass[:], by_cross[:] = 0.0, 0.0, 0.0, 0.0
    corners, slopes = np.empty((2, ROOM, 2)), np.empty((2, ROOM, 2, ways))
    count, now = polygon(x, y, numbers, corners, slopes)
    if count < 3:
        return
    one, by_one = corners[now], slopes[now]
    a, b = x.shape[0], y.shape[0]
    lost = LOST_SECOND if numbers[2] + numbers[3] > 0 else LOST
    level = _level(x, na, y, nb, lost, len(counts))
    rule = rules[level]
    flat = FLAT * ((x[1, 0] - x[0, 0]) ** 2 + (x[1, 1] - x[0, 1]) ** 2)
    phi, opposite = np.empty((mass.shape[1], 3)), np.empty((cross.shape[1], 3))
    by_phi, by_opposite = np.empty((len(phi), ways)), np.empty((len(opposite), ways))
    at, by_at, by_double = np.empty(2), np.empty((2, ways)), np.empty(ways)
    by_weight, jacobian = np.empty(ways), np.empty((2, 2))
    for p in range(1, count - 1):
        a0, a1 = one[p, 0] - one[0, 0], one[p, 1] - one[0, 1]
        b0, b1 = one[p + 1, 0] - one[0, 0], one[p + 1, 1] - one[0, 1]
        double = a0 * b1 - a1 * b0
        if double < -flat:
            continue
        for w in range(ways):
            by_double[w] = (
                (by_one[p, 0, w] - by_one[0, 0, w]) * b1
                + a0 * (by_one[p + 1, 1, w] - by_one[0, 1, w])
                - (by_one[p, 1, w] - by_one[0, 1, w]) * b0
                - a1 * (by_one[p + 1, 0, w] - by_one[0, 0, w])
            )
        for q in range(counts[level]):
            u, v, part = rule[q, 0], rule[q, 1], rule[q, 2]
            for e in range(2):
                at[e] = (1 - u - v) * one[0, e] + u * one[p, e] + v * one[p + 1, e]
                for w in range(ways):
                    by_at[e, w] = (
                        (1 - u - v) * by_one[0, e, w] + u * by_one[p, e, w]
                        + v * by_one[p + 1, e, w]
                    )
            s, t = reference(x, na, at, jacobian)
            functions(s, t, a, na, numbers[2], phi)
            if ways > 0:
                moved_functions(phi, jacobian, by_at, 0, na, by_phi)
            s, t = reference(y, nb, at, jacobian)
            functions(s, t, b, nb, numbers[3], opposite)
            if ways > 0:
                moved_functions(opposite, jacobian, by_at, 2 * a, nb, by_opposite)
            for r in range(na):
                weight = part * double * phi[r, 0]
                for w in range(ways):
                    by_weight[w] = part * (by_double[w] * phi[r, 0] + double * by_phi[r, w])
                _add(weight, by_weight, phi, by_phi, mass[r], by_mass[r])
                _add(weight, by_weight, opposite, by_opposite, cross[r], by_cross[r])


@njit(cache=True, error_model="numpy")
def _in_plane(slave, master, numbers, axes, x, y):  # noqa: PLR0913
    """Corners of both in the plane of the slave into x (a, 2) and y (b, 2), and its axes."""
    _axes(slave, numbers[0], axes)
    _flat(slave, numbers[0], slave[0], axes, x)
    _flat(master, numbers[1], slave[0], axes, y)


@njit(cache=True, error_model="numpy")
def plane_integrals(slave, master, numbers, rules, counts, mass, cross):  # noqa: PLR0913
    """Integrals of k pairs of facets (k, a, 3), (k, b, 3) into mass and cross.

    numbers (k, 4): of corners of both, then of their nodes beside these; mass (k, a, a + e),
    cross (k, a, b + h).
    """
    k, a, b = slave.shape[0], slave.shape[1], master.shape[1]
    x, y, axes = np.empty((a, 2)), np.empty((b, 2)), np.empty((2, 3))
    by_mass, by_cross = np.empty((a, mass.shape[2], 0)), np.empty((a, cross.shape[2], 0))
    for i in range(k):
        _in_plane(slave[i], master[i], numbers[i], axes, x, y)
        _shared(x, y, numbers[i], rules, counts, mass[i], cross[i], by_mass, by_cross)


@njit(cache=True, error_model="numpy")
def plane_slopes(slave, master, numbers, rules, counts, by_mass, by_cross):  # noqa: PLR0913
    """Derivatives of these by the (a + b) 3 coordinates, in the last place.

    by_mass (k, a, a + e, 3 (a + b)), by_cross (k, a, b + h, 3 (a + b)), zero before.  In the
    plane the first corner of the slave is the origin and the second lies on the first axis:
    these three coordinates stay.
    """
    k, a, b = slave.shape[0], slave.shape[1], master.shape[1]
    x, y, axes = np.empty((a, 2)), np.empty((b, 2)), np.empty((2, 3))
    ways, span = 2 * (a + b), 3 * (a + b)
    mass, cross = np.empty((a, by_mass.shape[2])), np.empty((a, by_cross.shape[2]))
    m, c = np.empty((*mass.shape, ways)), np.empty((*cross.shape, ways))
    by_space = np.empty((ways, span))
    for i in range(k):
        _in_plane(slave[i], master[i], numbers[i], axes, x, y)
        _shared(x, y, numbers[i], rules, counts, mass, cross, m, c)
        by_space[:] = 0.0
        _by_space(slave[i], master[i], numbers[i], axes, by_space)
        for found, out in ((m, by_mass[i]), (c, by_cross[i])):
            for r in range(numbers[i, 0]):
                for t in range(found.shape[1]):
                    for w in range(2, ways):
                        factor = found[r, t, w]
                        if w == 3 or factor == 0:
                            continue
                        for v in range(span):
                            out[r, t, v] += factor * by_space[w, v]
