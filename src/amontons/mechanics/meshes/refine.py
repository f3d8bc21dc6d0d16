"""Uniform refinement: every edge halved, regions, surfaces and coarser levels kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...core.errors import InvalidInput, shown
from .cells import LINEAR, SECOND
from .facets import Cells, Facets
from .mesh import Mesh
from .order import carried, with_middles
from .quadratic_cells import PARENTS

Array = NDArray[np.float64]
Index = NDArray[np.int64]
Child = tuple[int, ...]

_WEDGE = ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5),
          (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))  # fmt: skip
_PYRAMID = ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4), (0, 1, 2, 3))
MOST = 31  # a power of two: cells that node numbers can count
MIDDLES = {first: PARENTS[second] for first, second in SECOND.items()} | {
    "wedge": _WEDGE, "pyramid": _PYRAMID,
}  # fmt: skip


def refined(mesh: Mesh, times: int = 1) -> Mesh:
    """The mesh with every edge halved, `times` times, and the given one among its `levels`.

    Every line is cut in 2, a triangle or quadrilateral in 4, a tetrahedron, hexahedron or wedge
    in 8 (the inner octahedron of a tetrahedron along its shortest diagonal), a pyramid in 6 and
    4 tetrahedra.  Points keep their numbers, the new ones follow; sides stay straight, so
    curved surfaces keep the facets of the given mesh.  Finite element spaces are nested for
    simplices and parallelepipeds, nearly so for others, which is all that multigrid needs.

    >>> from amontons import box
    >>> refined(box((1, 1), 3)).cell_count
    36
    """
    whole = isinstance(times, int | np.integer) and not isinstance(times, bool | np.timedelta64)
    if not whole or times < 0:
        raise InvalidInput(f"times: expected a whole number >= 0, got {shown(times)}")
    if mesh.dim * min(times, MOST) > MOST - np.log2(mesh.cell_count):
        raise InvalidInput(f"times: expected at most 2^{MOST} cells, got {shown(times)}")
    if times and mesh.order == 2:
        raise InvalidInput("mesh: expected one of first order; refine first, then second_order")
    for _ in range(times):
        mesh = _once(mesh)
    return mesh


def _once(mesh: Mesh) -> Mesh:
    blocks = [*mesh.cells, *(facets for group in mesh.surfaces.values() for facets in group)]
    prolongation, tables = with_middles(len(mesh.points), blocks, MIDDLES)
    points = prolongation @ mesh.points
    cells = tuple(
        Cells(kind, nodes, block.region, block.integration if kind == block.kind else "auto")
        for block, table in zip(mesh.cells, tables, strict=False)
        for kind, nodes in _children(block.kind, table, points)
    )
    rest = iter(tables[len(mesh.cells) :])
    surfaces = {
        name: tuple(
            Facets(kind, nodes)
            for facets in group
            for kind, nodes in _children(facets.kind, next(rest), points)
        )
        for name, group in mesh.surfaces.items()
    }
    return Mesh(points, cells, surfaces, name=mesh.name, levels=(prolongation, *mesh.levels),
                node_sets=carried(mesh.node_sets, prolongation),
                axisymmetric=mesh.axisymmetric)  # fmt: skip


def _children(kind: str, table: Index, points: Array) -> list[tuple[str, Index]]:
    """(kind, nodes) of all parts of cells or facets, given with their middles."""
    out: dict[str, list[Index]] = {}
    for child_kind, child in CHILDREN[kind]:
        out.setdefault(child_kind, []).append(table[:, child])
    if kind == "tet":
        out[kind] += _inner_tetrahedra(table, points)
    return [(k, np.stack(v, axis=1).reshape(-1, v[0].shape[1])) for k, v in out.items()]


def _inner_tetrahedra(table: Index, points: Array) -> list[Index]:
    """The octahedron between the middles of the edges, cut along its shortest diagonal."""
    place = {frozenset(p): 4 + k for k, p in enumerate(MIDDLES["tet"])}
    opposite = [
        (place[frozenset((0, k))], place[frozenset({1, 2, 3} - {k})]) for k in (1, 2, 3)
    ]
    lengths = np.stack(
        [np.linalg.norm(points[table[:, a]] - points[table[:, b]], axis=1) for a, b in opposite]
    )
    choices = []
    for k, (a, b) in enumerate(opposite):
        (p, q), (r, s) = opposite[k - 2], opposite[k - 1]
        choices.append([(a, b, p, r), (a, b, r, q), (a, b, q, s), (a, b, s, p)])
    # lengths that differ by rounding alone must not decide, or equal cells are cut differently
    lengths = lengths / lengths.max(axis=0)
    shortest = (lengths > lengths.min(axis=0) + 1e-9).argmin(axis=0)
    local = np.array(choices)[shortest]  # (cells, 4, 4)
    rows = np.arange(len(table))[:, None]
    return [table[rows, local[:, k]] for k in range(4)]


def _corner_children(kind: str) -> list[tuple[str, Child]]:
    """The parts at the corners: their nodes halve the ways from one corner to all."""
    corners = LINEAR[kind].corners
    nodes = [*corners, *(corners[list(p)].mean(axis=0) for p in MIDDLES[kind])]
    place = {tuple(np.round(4 * x).astype(int)): k for k, x in enumerate(nodes)}
    return [
        (kind, tuple(place[tuple(np.round(2 * (a + b)).astype(int))] for b in corners))
        for a in corners
    ]


def _all_children(kind: str) -> list[tuple[str, Child]]:
    place = {frozenset(p): len(LINEAR[kind].corners) + k for k, p in enumerate(MIDDLES[kind])}

    def middle(*corners: int) -> int:
        return place[frozenset(corners)]

    out = _corner_children(kind)
    if kind == "tri":
        out.append((kind, tuple(middle(*pair) for pair in ((0, 1), (1, 2), (2, 0)))))
    elif kind == "wedge":
        ring = ((0, 1), (1, 2), (2, 0))
        across = [middle(a, b, a + 3, b + 3) for a, b in ring]
        out.append((kind, (*(middle(a, b) for a, b in ring), *across)))
        out.append((kind, (*across, *(middle(a + 3, b + 3) for a, b in ring))))
    elif kind == "pyramid":
        base, up = middle(0, 1, 2, 3), [middle(k, 4) for k in range(4)]
        out.append((kind, (*up[::-1], base)))
        for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
            out.append(("tet", (middle(a, b), up[b], up[a], base)))
    return out


CHILDREN = {kind: _all_children(kind) for kind in MIDDLES}
