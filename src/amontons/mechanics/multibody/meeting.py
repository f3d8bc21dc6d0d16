"""Where rigid bodies meet: points, normals and gaps of balls, convex polyhedra and planes.

Pairs whose balls around are near are found along the axis on which the bodies are spread most.
Two polyhedra are apart along the normal of a face of one of them, or along the product of an
edge of each: the axis on which they are farthest apart decides (the separating axis theorem;
where they overlap, the one on which they do least).  On a face, the other body's face that
looks against it is cut by the sides of the first: its corners are the contacts.  Two edges meet
in one.  Gaps are along the normal, positive apart; for two corners they are less than the
distance, so that a contact may be listed early and never late.

All points and normals are in global axes; normals point from the master into the slave.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...core.compiled import njit
from ...core.copies import copy_inplace
from .apart import boxes_apart, cross, dot, edges_apart, face_apart
from .bodies import GROUND, Packed

Array = NDArray[np.float64]
Index = NDArray[np.int64]
FACES_FIRST = 1e-3  # of the size: edges must be apart by so much more than faces to decide
SPARE = 16  # corners that rounding may add to a face that is cut
PLACES = 1 << 20  # features of one pair that are told from each other


class Meetings(NamedTuple):
    """Contacts that may close: slave and master bodies, points, normals, gaps.

    feature (n,): the same in two steps where the same corners meet.
    """

    slave: Index
    master: Index
    feature: Index
    points: Array
    normals: Array
    gaps: Array


def meetings(packed: Packed, x: Array, R: Array, near: Array) -> Meetings:
    """Contacts with gaps up to near[i] + near[j] of bodies at x (n, 3), turned by R (n, 3, 3).

    near (n,): how far each body is looked for, unit of length.
    """
    vertices, normals, offsets, boxes = _placed(
        packed.first_vertex, packed.vertices, packed.first_face, packed.normals,
        packed.offsets, x, R,
    )  # fmt: skip
    room = 16 + 8 * len(x)
    while True:
        numbers, places = np.empty((3, room), np.int64), np.empty((room, 7))
        count = _meet(
            packed.radius, packed.reach, packed.first_vertex, vertices, packed.first_face,
            normals, offsets, packed.first_corner, packed.corners, packed.first_edge,
            packed.edges, packed.first_line, packed.lines, packed.planes, packed.apart, x, near,
            boxes, numbers, places,
        )  # fmt: skip
        if count <= room:
            slave, master, feature = numbers[:, :count]
            found = places[:count]
            return Meetings(slave, master, feature, found[:, :3], found[:, 3:6], found[:, 6])
        room = 2 * count


@njit(cache=True, error_model="numpy")
def _placed(first_vertex, vertices, first_face, normals, offsets, x, R):  # noqa: PLR0913
    """Vertices, face normals and offsets in global axes, boxes (n, 2, 3) around vertices."""
    v, n, o = np.empty_like(vertices), np.empty_like(normals), np.empty_like(offsets)
    boxes = np.empty((len(x), 2, 3))
    for b in range(len(x)):
        for i in range(3):
            boxes[b, 0, i], boxes[b, 1, i] = np.inf, -np.inf
        for k in range(first_vertex[b], first_vertex[b + 1]):
            for i in range(3):
                v[k, i] = x[b, i]
                for j in range(3):
                    v[k, i] += R[b, i, j] * vertices[k, j]
                boxes[b, 0, i] = min(boxes[b, 0, i], v[k, i])
                boxes[b, 1, i] = max(boxes[b, 1, i], v[k, i])
        for k in range(first_face[b], first_face[b + 1]):
            o[k] = offsets[k]
            for i in range(3):
                n[k, i] = 0.0
                for j in range(3):
                    n[k, i] += R[b, i, j] * normals[k, j]
                o[k] += n[k, i] * x[b, i]
    return v, n, o, boxes


@njit(cache=True, error_model="numpy")
def _add(count, slave, master, feature, px, py, pz, nx, ny, nz, gap, numbers, places):  # noqa: PLR0913
    """Store a contact where there is room; returns the new count."""
    if count < numbers.shape[1]:
        numbers[0, count], numbers[1, count], numbers[2, count] = slave, master, feature
        row = places[count]
        row[0], row[1], row[2], row[3], row[4], row[5], row[6] = px, py, pz, nx, ny, nz, gap
    return count + 1


@njit(cache=True, error_model="numpy")
def _meet(  # noqa: PLR0913
    radius, reach, first_vertex, v, first_face, n, o, first_corner, corners, first_edge, edges,
    first_line, lines, planes, apart, x, near, boxes, numbers, places,
):  # fmt: skip
    """Fill numbers (slave, master, feature) and places (point, normal, gap); the count."""
    count = 0
    for p in range(len(planes)):
        normal, offset = planes[p, :3], planes[p, 3]
        for b in range(len(x)):
            above = dot(normal, x[b]) - offset
            if above > reach[b] + near[b]:
                continue
            if radius[b] > 0:
                s = above
                count = _add(count, b, GROUND, p, x[b, 0] - s * normal[0],
                             x[b, 1] - s * normal[1], x[b, 2] - s * normal[2], normal[0],
                             normal[1], normal[2], s - radius[b], numbers, places)  # fmt: skip
            for k in range(first_vertex[b], first_vertex[b + 1]):
                gap = dot(normal, v[k]) - offset
                if gap <= near[b]:
                    count = _add(count, b, GROUND, p * PLACES + k - first_vertex[b],
                                 v[k, 0], v[k, 1], v[k, 2], normal[0], normal[1], normal[2],
                                 gap, numbers, places)  # fmt: skip
    axis, most = 0, -1.0
    for k in range(3):
        spread = np.var(x[:, k])
        if spread > most:
            axis, most = k, spread
    low = x[:, axis] - reach - near
    order = np.argsort(low)
    for a in range(len(order)):
        i = order[a]
        top = x[i, axis] + reach[i] + near[i]
        for c in range(a + 1, len(order)):
            j = order[c]
            if low[j] > top:
                break
            if len(apart) and apart[i, j]:
                continue
            limit, square = reach[i] + reach[j] + near[i] + near[j], 0.0
            for k in range(3):
                square += (x[i, k] - x[j, k]) ** 2
            if square > limit * limit:
                continue
            first, second = min(i, j), max(i, j)
            margin = near[i] + near[j]
            if radius[first] > 0 and radius[second] > 0:
                count = _balls(count, first, second, x, radius, margin, numbers, places)
            elif radius[first] > 0 or radius[second] > 0:
                ball, other = (first, second) if radius[first] > 0 else (second, first)
                count = _ball_on(count, ball, other, x, radius, first_face, n, o,
                                 first_corner, corners, v, margin, numbers, places)  # fmt: skip
            elif not boxes_apart(boxes[i], boxes[j], margin):
                count = _polyhedra(count, first, second, first_vertex, v, first_face, n, o,
                                   first_corner, corners, first_edge, edges, first_line, lines,
                                   x, reach, margin, numbers, places)  # fmt: skip
    return count


@njit(cache=True, error_model="numpy")
def _balls(count, i, j, x, radius, margin, numbers, places):  # noqa: PLR0913
    """Two balls: the second is the slave."""
    d = x[j] - x[i]
    length = np.sqrt(dot(d, d))
    gap = length - radius[i] - radius[j]
    if gap > margin:
        return count
    normal = d / length if length > 0 else np.array([0.0, 0.0, 1.0])
    at = x[i] + (radius[i] + 0.5 * gap) * normal
    return _add(count, j, i, 0, at[0], at[1], at[2], normal[0], normal[1], normal[2], gap,
                numbers, places)  # fmt: skip


@njit(cache=True, error_model="numpy")
def _ball_on(  # noqa: PLR0913
    count, ball, other, x, radius, first_face, n, o, first_corner, corners, v, margin,
    numbers, places,
):  # fmt: skip
    """A ball and a polyhedron, the ball the slave: the nearest point of the surface."""
    centre = x[ball]
    inside, deepest, face = True, -np.inf, -1
    for f in range(first_face[other], first_face[other + 1]):
        above = dot(n[f], centre) - o[f]
        inside = inside and above <= 0
        if above > deepest:
            deepest, face = above, f
    if deepest > radius[ball] + margin:
        return count
    normal, at = n[face].copy(), centre - deepest * n[face]
    distance, feature = deepest, face - first_face[other]
    if not inside:
        distance = np.inf
        for f in range(first_face[other], first_face[other + 1]):
            above = dot(n[f], centre) - o[f]
            if above <= 0:
                continue
            foot = centre - above * n[f]
            within = True
            begin, end = first_corner[f], first_corner[f + 1]
            for c in range(begin, end):
                p = v[corners[c]]
                q = v[corners[c + 1 if c + 1 < end else begin]]
                side = cross(q - p, n[f])
                if dot(side, foot - p) > 0:
                    within = False
                    edge = q - p
                    t = min(max(dot(edge, centre - p) / dot(edge, edge), 0.0), 1.0)
                    nearest = p + t * edge
                    length = np.sqrt(dot(centre - nearest, centre - nearest))
                    if length < distance:
                        distance, at = length, nearest
                        feature = PLACES // 2 + min(corners[c], corners[begin])
            if within and above < distance:
                distance, at, feature = above, foot, f - first_face[other]
        if distance > 0:
            normal = (centre - at) / distance
    gap = distance - radius[ball]
    if gap > margin:
        return count
    return _add(count, ball, other, feature, at[0], at[1], at[2], normal[0], normal[1],
                normal[2], gap, numbers, places)  # fmt: skip


@njit(cache=True, error_model="numpy")
def _polyhedra(  # noqa: PLR0913
    count, i, j, first_vertex, v, first_face, n, o, first_corner, corners, first_edge, edges,
    first_line, lines, x, reach, margin, numbers, places,
):  # fmt: skip
    """Two polyhedra: the corners of a face on another, or two edges."""
    apart_i, face_i = face_apart(first_face, n, o, i, first_vertex, v, j)
    if apart_i > margin:
        return count
    apart_j, face_j = face_apart(first_face, n, o, j, first_vertex, v, i)
    if apart_j > margin:
        return count
    size = FACES_FIRST * min(reach[i], reach[j])
    apart_e, one, two, m = edges_apart(i, j, first_vertex, v, edges, first_line, lines, x)
    if apart_e > margin:
        return count
    if one >= 0 and apart_e > max(apart_i, apart_j) + size:
        p, q = v[edges[one, 0]], v[edges[two, 0]]
        a, b = v[edges[one, 1]] - p, v[edges[two, 1]] - q
        aa, ab, bb = dot(a, a), dot(a, b), dot(b, b)
        s = (dot(a, q - p) * bb - dot(b, q - p) * ab) / (aa * bb - ab * ab)
        at = p + min(max(s, 0.0), 1.0) * a + 0.5 * apart_e * m
        feature = PLACES // 2 + (one - first_edge[i]) * 1024 + two - first_edge[j]
        return _add(count, j, i, feature, at[0], at[1], at[2], m[0], m[1], m[2], apart_e,
                    numbers, places)  # fmt: skip
    if apart_i >= apart_j - 1e-6 * reach[i]:
        return _on_face(count, i, j, face_i, first_vertex, v, first_face, n, o, first_corner,
                        corners, margin, numbers, places)  # fmt: skip
    return _on_face(count, j, i, face_j, first_vertex, v, first_face, n, o, first_corner,
                    corners, margin, numbers, places)  # fmt: skip


@njit(cache=True, error_model="numpy")
def _against(first_face, n, j, normal):
    """The face of j that looks against a normal."""
    against, lowest = -1, np.inf
    for f in range(first_face[j], first_face[j + 1]):
        cosine = dot(n[f], normal)
        if cosine < lowest:
            against, lowest = f, cosine
    return against


@njit(cache=True, error_model="numpy")
def _on_face(  # noqa: PLR0913
    count, i, j, face, first_vertex, v, first_face, n, o, first_corner, corners, margin,
    numbers, places,
):  # fmt: skip
    """The face of j that looks against one of i, cut by the sides of that; j is the slave."""
    normal, offset = n[face], o[face]
    against = _against(first_face, n, j, normal)
    begin, end = first_corner[face], first_corner[face + 1]
    room = first_corner[against + 1] - first_corner[against] + end - begin + SPARE
    polygon, cut = np.empty((room, 3)), np.empty((room, 3))
    marks, kept = np.empty(room, np.int64), np.empty(room, np.int64)
    size = 0
    for c in range(first_corner[against], first_corner[against + 1]):
        copy_inplace(v[corners[c]], polygon[size])
        marks[size] = corners[c] - first_vertex[j]
        size += 1
    for c in range(begin, end):
        p = v[corners[c]]
        q = v[corners[c + 1 if c + 1 < end else begin]]
        out = np.empty(3)
        out[0], out[1], out[2] = cross(q - p, normal)
        out = out / np.sqrt(dot(out, out))
        number, side = 0, PLACES // 4 + 256 * (c - begin)
        for k in range(size):
            a, b = polygon[k], polygon[k + 1 if k + 1 < size else 0]
            da, db = dot(out, a - p), dot(out, b - p)
            if da <= 0 and number < room:
                copy_inplace(a, cut[number])
                kept[number] = marks[k]
                number += 1
            if (da < 0) != (db < 0) and da != db and da != 0 and db != 0 and number < room:
                t = da / (da - db)
                for d in range(3):
                    cut[number, d] = a[d] + t * (b[d] - a[d])
                kept[number] = side + marks[k] % 256 + (128 if da < 0 else 0)
                number += 1
        size = number
        polygon, cut = cut, polygon
        marks, kept = kept, marks
        if size == 0:
            break
    low, high = (i, j) if i < j else (j, i)
    turn = PLACES if i == high else 0
    for k in range(size):
        gap = dot(normal, polygon[k]) - offset
        if gap <= margin:
            at = polygon[k] - 0.5 * gap * normal
            count = _add(count, j, i, turn + marks[k], at[0], at[1], at[2], normal[0],
                         normal[1], normal[2], gap, numbers, places)  # fmt: skip
    if size == 0:  # beside the face: the corner that is nearest to its plane
        best, gap = -1, np.inf
        for k in range(first_vertex[j], first_vertex[j + 1]):
            height = dot(normal, v[k]) - offset
            if height < gap:
                best, gap = k, height
        at = v[best] - 0.5 * gap * normal
        count = _add(count, j, i, turn + best - first_vertex[j], at[0], at[1], at[2],
                     normal[0], normal[1], normal[2], gap, numbers, places)  # fmt: skip
    return count
