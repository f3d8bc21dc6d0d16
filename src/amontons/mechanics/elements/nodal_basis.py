"""From NGSolve's hierarchical functions of second order to values at nodes.

NGSolve's space is that of the quadratic Lagrange functions, but its unknowns beyond the corners
multiply bubbles: one per edge, quadrilateral and hexahedron.  Such an unknown times the value
of its bubble at the middle is the difference between the function there and its interpolation
from the nodes around: u_m - (u_a + u_b) / 2 on an edge.  On quadrilaterals and hexahedra the
rule acts once in each direction, and the bubble is the product of those of edges.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from ..meshes.cells import CELLS, ReferenceCell
from ..meshes.mesh import Mesh

Index = NDArray[np.int64]
DIRECTIONS = {1: 0, 2: 1, 4: 2, 8: 3}  # of a corner, edge, quadrilateral, hexahedron


def hierarchical_from_nodal(ng: Any, mesh: Mesh, engine_mesh: Any) -> sparse.csr_array:
    """The matrix (n, n) from values at the points of the mesh to the unknowns of NGSolve."""
    bubble = _edge_bubble(ng, engine_mesh)
    rows, columns, values = [], [], []
    for block in mesh.cells:
        for row, column, own, other in _pattern(CELLS[block.kind]):
            rows.append(block.nodes[:, row])
            columns.append(block.nodes[:, column])
            value = (-0.5) ** (own - other) / bubble**own
            values.append(np.full(len(block.nodes), value))
    pairs = np.stack([np.concatenate(rows), np.concatenate(columns)])
    (row, column), first = np.unique(pairs, axis=1, return_index=True)  # neighbours agree
    n = len(mesh.points)
    surplus = sparse.coo_array((np.concatenate(values)[first], (row, column)), shape=(n, n))
    return surplus.tocsr()[_order(mesh, engine_mesh)]


def _edge_bubble(ng: Any, engine_mesh: Any) -> float:
    """Value of an edge's function at its middle."""
    space = ng.H1(engine_mesh, order=2)
    cell = ng.ElementId(ng.VOL, 0)
    shape = np.array(space.GetFE(cell).CalcShape(0.5, 0, 0))  # the middle of some edge
    inner = shape[np.array(space.GetDofNrs(cell)) >= engine_mesh.nv]
    return float(inner[np.abs(inner).argmax()])


def _pattern(cell: ReferenceCell) -> list[tuple[int, int, int, int]]:
    """(node, node that its surplus depends on, directions of both) within one cell."""
    corners = cell.corner_count
    parts = [(k,) for k in range(corners)] + list(cell.parents)
    return [
        (row, column, DIRECTIONS[len(own)], DIRECTIONS[len(other)])
        for row, own in enumerate(parts)
        for column, other in enumerate(parts)
        if set(other) <= set(own)
    ]


def _order(mesh: Mesh, engine_mesh: Any) -> Index:
    """Our node of every unknown of NGSolve: vertices, edges, quadrilaterals, hexahedra."""
    faces = [tuple(v.nr for v in f.vertices) for f in engine_mesh.faces]
    wanted = {
        2: [tuple(v.nr for v in e.vertices) for e in engine_mesh.edges],
        4: [face for face in faces if len(face) == 4],
    }
    out = [np.arange(engine_mesh.nv)]
    for size, keys in wanted.items():
        if keys:
            out.append(_middles(mesh, size, np.sort(keys, axis=1)))
    out += [block.nodes[:, -1] for block in mesh.cells if block.kind == "hex27"]
    return np.concatenate(out)


def _middles(mesh: Mesh, size: int, wanted: Index) -> Index:
    """Nodes in the middle of edges or faces given by their sorted corners, (k, size)."""
    keys, nodes = [], []
    for block in mesh.cells:
        cell = CELLS[block.kind]
        for k, parents in enumerate(cell.parents, cell.corner_count):
            if len(parents) == size:
                keys.append(np.sort(block.nodes[:, parents], axis=1))
                nodes.append(block.nodes[:, k])
    known = np.concatenate(keys)
    _, label = np.unique(np.concatenate([known, wanted]), axis=0, return_inverse=True)
    label = label.ravel()
    node = np.empty(label.max() + 1, dtype=np.int64)
    node[label[: len(known)]] = np.concatenate(nodes)
    return node[label[len(known) :]]
