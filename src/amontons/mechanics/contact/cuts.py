"""Cuts: the parts of slave facets that face one master facet each, and quadrature points there.

Both facets are projected along the slave facet's normal onto the plane through its centre, and
the intersection is triangulated ([PL]).  Quadrilaterals and triangles in 3D, lines in 2D; all
pairs at once.

The rules integrate the shape functions of both sides exactly, which is all that a uniform
pressure asks for.  On quadrilaterals that are no parallelograms these are not polynomials on
the plane: there the weights are corrected, by less than 1e-3 of them on common meshes, so that
the integrals of all shape functions are those of a fine rule.

[PL] M. Puso, T. Laursen, "A mortar segment-to-segment contact method for large deformation
solid mechanics", Comput. Methods Appl. Mech. Engrg. 193 (2004) 601-629.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..elements.traces import FacetPoints
from ..meshes.cells import CELLS, LINEAR
from ..meshes.surfaces import outward
from .clipping import clip, line_rule, quadrature
from .geometry import frames
from .pairs import KINDS, shapes

if TYPE_CHECKING:
    from .segments import Surface

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Mask = NDArray[np.bool_]
SIDES = (*KINDS, "line3", "tri6", "quad8", "quad9")  # with the functions of displacements
AFFINE = 1e-9  # sides of a parallelogram differ by less, relative to its size
NEWTON = 30  # steps to the reference point of a quadrilateral
BENT_POINTS = 5  # points per direction on parts of bent quadrilaterals, before correction
FINE = ((0.6, 8), (0.45, 12), (0.35, 16), (0.25, 24), (-np.inf, 48))  # by evenness, to 1e-11
AT_ONCE = 400_000  # points of fine rules, for memory
SEPARATE = 1e-9  # moments that differ by less, relative, are one


@dataclass(frozen=True, eq=False)
class Cuts:
    """Quadrature points on t triangles (in 2D pieces of lines) that fill the parts.

    pair (t,): which of the pairs; at, opposite (t, q, dim - 1): reference coordinates in the
    slave and the master facet; weight (t, q), area.
    """

    pair: Index
    at: Array
    opposite: Array
    weight: Array


def cuts(
    slave: Surface, master: Surface, of: Index, facet: Index, points: int | None = None
) -> Iterator[tuple[Index, Index, Cuts]]:
    """Slave and master facets (k,) and cuts of given pairs (of, facet), kind by kind.

    points: per direction, at least as many as shape functions need; these many by default.
    """
    axes = frames(slave.normal[of])[:, 1:]
    for one in np.unique(slave.kind[of]):
        for other in np.unique(master.kind[facet]):
            both = (slave.kind[of] == one) & (master.kind[facet] == other)
            kinds = (SIDES[one], SIDES[other])
            n, m = (CELLS[kind].corner_count for kind in kinds)
            s, t, e = of[both], facet[both], axes[both]
            origin = slave.centre[s][:, None]
            x = np.einsum("kac,kec->kae", slave.points[slave.nodes[s, :n]] - origin, e)
            y = np.einsum("kac,kec->kae", master.points[master.nodes[t, :m]] - origin, e)
            near = ((x.max(axis=1) > y.min(axis=1)) & (x.min(axis=1) < y.max(axis=1))).all(
                axis=1
            )
            x, y, s, t = x[near], y[near], s[near], t[near]
            if n == 2:
                least = 4 if "line3" in kinds else 3
                yield s, t, _measured(slave, s, _on_lines(x, y, points or least))
                continue
            straight = _is_affine(x) & _is_affine(y)
            for chosen, rule in ((straight, _straight_cuts), (~straight, _bent_cuts)):
                if chosen.any():
                    found = rule(x[chosen], y[chosen], kinds, points)
                    yield s[chosen], t[chosen], _measured(slave, s[chosen], found)


def _measured(slave: Surface, of: Index, cut: Cuts) -> Cuts:
    """Weights of areas of the slave's facets (k,) themselves, around an axis or curved."""
    if not (slave.curved or slave.axisymmetric) or not len(cut.pair):
        return cut
    facet, weight = of[cut.pair], cut.weight
    cell = CELLS[SIDES[slave.kind[of[0]]]]
    t, q, e = cut.at.shape
    at, row = cut.at.reshape(-1, e), np.repeat(facet, q)
    x = slave.points[slave.all[row, : cell.nodes]]
    if slave.curved:
        flat = LINEAR[KINDS[cell.corner_count - 2]]
        true = np.linalg.norm(outward(cell.jacobians(x, at)), axis=1)
        plane = outward(flat.jacobians(x[:, : cell.corner_count], at))
        plane = np.einsum("rc,rc->r", plane, slave.normal[row])
        weight = weight * (true / plane).reshape(t, q)
    if slave.axisymmetric:
        r = np.einsum("ra,ra->r", cell.shape(at), x[:, :, 0])
        weight = weight * (2 * np.pi * r).reshape(t, q)
    return replace(cut, weight=weight)


def points_on(
    slave: Surface, master: Surface, of: Index, facet: Index, points: int
) -> tuple[FacetPoints, Index, Array]:
    """Points on the slave in the order of its facets, master facets (q,), where on them.

    Of given pairs (of, facet), (k,); points: as in `cuts`.
    """
    tables = []
    for one, other, cut in cuts(slave, master, of, facet, points):
        q, e = cut.weight.shape[1], cut.at.shape[2]
        tables.append((np.repeat(one[cut.pair], q), cut.at.reshape(-1, e), cut.weight.ravel(),
                       np.repeat(other[cut.pair], q), cut.opposite.reshape(-1, e)))  # fmt: skip
    columns = [np.concatenate(column) for column in zip(*tables, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    slaves, at, weight, masters, opposite = (column[order] for column in columns)
    return FacetPoints(slaves, at, weight), masters, opposite


def _on_lines(x: Array, y: Array, points: int) -> Cuts:
    """Overlaps of lines x with lines y, (k, 2, 1)."""
    x, y = x[:, :, 0], y[:, :, 0]
    low = np.maximum(x.min(axis=1), y.min(axis=1))
    high = np.minimum(x.max(axis=1), y.max(axis=1))
    pair = np.flatnonzero(high > low)
    x, y, low, high = x[pair], y[pair], low[pair], high[pair]
    at, weight = line_rule(max(points, 2))
    where = low[:, None] + (high - low)[:, None] * at[:, 0]
    shares = [((where - z[:, :1]) / (z[:, 1:] - z[:, :1]))[:, :, None] for z in (x, y)]
    return Cuts(pair, shares[0], shares[1], (high - low)[:, None] * weight)


def _straight_cuts(x: Array, y: Array, kinds: tuple[str, str], points: int | None) -> Cuts:
    """Parts of triangles and parallelograms: the rule is exact for polynomials."""
    second = [kind for kind in kinds if kind not in KINDS]
    least = 3 if any(kind.startswith("quad") for kind in second) else 2
    corners, count = clip(y[:, ::-1], x)  # seen from the slave, the master turns the other way
    wanted = points or (4 if second else 3)  # products with functions of first order
    pair, where, weight = quadrature(corners, count, max(wanted, least))
    return Cuts(pair, reference(x[pair], where), reference(y[pair], where), weight)


def _bent_cuts(x: Array, y: Array, kinds: tuple[str, str], points: int | None) -> Cuts:
    """Parts of other quadrilaterals, with corrected weights."""
    corners, count = clip(y[:, ::-1], x)
    many = "quad9" in kinds or "quad8" in kinds
    least = BENT_POINTS if many else 3  # per triangle more than conditions
    pair, where, weight = quadrature(corners, count, max(points or BENT_POINTS, least))
    at, opposite = reference(x[pair], where), reference(y[pair], where)
    both = _both(kinds, at, opposite)
    weighted = weight[:, :, None] * both
    missing = _fine_moments(x, y, corners, count, kinds)
    np.subtract.at(missing, pair, weighted.sum(axis=1))
    gram = np.zeros((*missing.shape, missing.shape[1]))
    np.add.at(gram, pair, np.swapaxes(weighted, 1, 2) @ both)
    change = np.einsum("kij,kj->ki", np.linalg.pinv(gram, SEPARATE, hermitian=True), missing)
    return Cuts(pair, at, opposite, weight * (1 + (both @ change[pair, :, None])[..., 0]))


def _fine_moments(
    x: Array, y: Array, corners: Array, count: Index, kinds: tuple[str, str]
) -> Array:
    """Integrals of the shape functions of both sides over polygons, (k, functions)."""
    out = np.zeros((len(x), sum(CELLS[kind].nodes for kind in kinds)))
    even = np.minimum(_evenness(x), _evenness(y))
    todo = count > 2
    for least, points in FINE:
        chosen = np.flatnonzero(todo & (even > least))
        todo[chosen] = False
        step = max(1, AT_ONCE // (corners.shape[1] * points**2))
        for start in range(0, len(chosen), step):
            part = chosen[start : start + step]
            pair, where, weight = quadrature(corners[part], count[part], points)
            pair = part[pair]
            both = _both(kinds, reference(x[pair], where), reference(y[pair], where))
            np.add.at(out, pair, np.einsum("tq,tqa->ta", weight, both))
    return out


def _both(kinds: tuple[str, str], at: Array, opposite: Array) -> Array:
    """Shape functions of slave and master side by side, (t, q, functions)."""
    return np.concatenate(
        [functions(kind, where) for kind, where in zip(kinds, (at, opposite), strict=True)],
        axis=2,
    )


def functions(kind: str, at: Array) -> Array:
    """Shape functions (t, q, a) at reference coordinates (t, q, dim - 1)."""
    if kind not in KINDS:
        return CELLS[kind].shape(at)
    return shapes(kind, at.reshape(-1, at.shape[2])).reshape(*at.shape[:2], CELLS[kind].nodes)


def _is_affine(x: Array) -> Mask:
    """Which polygons (k, a, 2) are triangles or parallelograms, (k,)."""
    if x.shape[1] == 3:
        return np.ones(len(x), dtype=bool)
    bent = np.abs(x[:, 0] - x[:, 1] + x[:, 2] - x[:, 3]).max(axis=1)
    return bent <= AFFINE * np.abs(x).max(axis=(1, 2))


def _evenness(x: Array) -> Array:
    """Least over largest double area at the corners of polygons (k, a, 2); 1 if affine."""
    out, into = np.roll(x, -1, axis=1) - x, np.roll(x, 1, axis=1) - x
    double = out[..., 0] * into[..., 1] - out[..., 1] * into[..., 0]
    double *= np.sign(double.sum(axis=1, keepdims=True))
    largest = double.max(axis=1)
    return double.min(axis=1) / np.where(largest > 0, largest, 1.0)


def reference(x: Array, where: Array) -> Array:
    """Reference coordinates (t, q, 2) of points in triangles or quadrilaterals x (t, a, 2)."""
    if x.shape[1] == 3:
        slopes = np.stack([x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]], axis=2)
        inverse = _inverse(slopes)
        return np.einsum("tij,tqj->tqi", inverse, where - x[:, None, 0])
    a, b, c = (
        x[:, None, 1] - x[:, None, 0],
        x[:, None, 3] - x[:, None, 0],
        (x[:, None, 0] - x[:, None, 1] + x[:, None, 2] - x[:, None, 3]),
    )
    at = np.full(where.shape, 0.5)
    for _ in range(NEWTON):
        s, t = at[..., :1], at[..., 1:]
        rest = where - x[:, None, 0] - s * a - t * b - s * t * c
        step = np.einsum(
            "tqij,tqj->tqi", _inverse(np.stack([a + t * c, b + s * c], axis=3)), rest
        )
        at = at + step
        if np.abs(step).max(initial=0.0) < 1e-14:
            break
    return at


def _inverse(matrices: Array) -> Array:
    """Inverses of (…, 2, 2), written out for speed."""
    (a, b), (c, d) = (
        (matrices[..., i, 0] for i in (0, 1)),
        (matrices[..., i, 1] for i in (0, 1)),
    )
    rows = np.stack([np.stack([d, -c], axis=-1), np.stack([-b, a], axis=-1)], axis=-2)
    return rows / (a * d - b * c)[..., None, None]
